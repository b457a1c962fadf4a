//! What the tests of this crate share.

use proptest::test_runner::{Config, RngAlgorithm, RngSeed};

use crate::geometry::Point;
use crate::plane::Plane;

/// So many cases from a fixed seed, and no files of failures.
pub fn config(cases: u32) -> Config {
    Config {
        cases,
        failure_persistence: None,
        rng_algorithm: RngAlgorithm::ChaCha,
        rng_seed: RngSeed::Fixed(34),
        ..Config::default()
    }
}

/// A plane of dots that a test writes down.
pub fn plane(pairs: &[(f64, f64)]) -> Plane {
    Plane::new(pairs.iter().map(|&(x, y)| Point::new(x, y)).collect()).unwrap()
}

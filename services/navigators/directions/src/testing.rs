//! Helpers for the tests of this crate.

use proptest::test_runner::{Config, RngAlgorithm, RngSeed};

use crate::geometry::Point;
use crate::plane::Plane;

/// Returns a configuration with this many cases from a fixed seed, and without files of failed cases.
pub fn config(cases: u32) -> Config {
    Config {
        cases,
        failure_persistence: None,
        rng_algorithm: RngAlgorithm::ChaCha,
        rng_seed: RngSeed::Fixed(34),
        ..Config::default()
    }
}

/// Creates a plane of dots at these positions.
pub fn plane(pairs: &[(f64, f64)]) -> Plane {
    Plane::new(pairs.iter().map(|&(x, y)| Point::new(x, y)).collect()).unwrap()
}

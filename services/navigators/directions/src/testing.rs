//! Helpers for the tests of this crate.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use proptest::test_runner::{Config, RngAlgorithm, RngSeed};
use sketchnav_schemas::robot::MarkerCamera;

use crate::geometry::Point;
use crate::markers::{LandmarkKind, Marker, Markers};
use crate::plane::Plane;

/// Returns a configuration for the given number of cases from a fixed seed, without files for failed cases.
pub fn config(cases: u32) -> Config {
    Config {
        cases,
        failure_persistence: None,
        rng_algorithm: RngAlgorithm::ChaCha,
        rng_seed: RngSeed::Fixed(34),
        ..Config::default()
    }
}

/// Creates a plane of dots at the given positions.
pub fn plane(pairs: &[(f64, f64)]) -> Plane {
    Plane::new(pairs.iter().map(|&(x, y)| Point::new(x, y)).collect()).unwrap()
}

/// Returns a camera with a full field of view and a range of 6 m, which misses the given fraction of the markers right in front of
/// it.
pub fn camera(miss: f64) -> MarkerCamera {
    MarkerCamera {
        model: "omnidirectional".to_owned(),
        field_of_view_deg: 360.0,
        range_min_m: 0.3,
        range_max_m: 6.0,
        slant_max_deg: 60.0,
        rate_hz: 10.0,
        noise_per_m: 0.0,
        bearing_noise_deg: 0.0,
        facing_noise_deg_per_m: 0.0,
        miss,
        pixels: None,
        mount_x_m: 0.0,
        mount_y_m: 0.0,
        mount_yaw_deg: 0.0,
    }
}

/// Creates a plane of dots with the given kinds. Each dot with a kind has a marker on either side.
pub fn plane_of_kinds(camera: MarkerCamera, dots: &[(f64, f64, &str)]) -> Plane {
    let places = dots.iter().map(|&(x, y, _)| Point::new(x, y));
    let around = |(x, y, kind): &(f64, f64, &str)| {
        let (at, kind) = (Point::new(*x, *y), LandmarkKind::of(kind));
        let marker = move |facing_rad, kind| Marker {
            kind,
            at: at + Point::new(0.15, 0.0).turned(facing_rad),
            facing_rad,
        };
        (0..4).filter_map(move |side| Some(marker(f64::from(side) * FRAC_PI_2, kind?))).collect::<Vec<_>>()
    };
    let places: Vec<_> = places.collect();
    let markers = Markers::new(camera, &places, 0.15, dots.iter().flat_map(around)).unwrap();
    Plane::new(places).unwrap().marked(Some(Arc::new(markers)))
}

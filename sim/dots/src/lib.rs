//! Planes of identical dots (Park and Kender 1995, 3.1 and 7.1.1), shared by worlds and map-makers.
//!
//! - [`generate`] generates random positions from a seed.
//! - [`camera`] maps between positions on the plane and pixels of the global camera, which is calibrated by known points.
//! - [`calibration`] finds known points that disagree with the others.
//! - [`picture`] finds the spots of a picture and their centroids, and draws pictures of planes.
//! - [`light`] levels uneven light.
//! - [`alike`] separates dots from other spots.
//!
//! This crate does not open files and has no source of randomness.

pub mod alike;
pub mod calibration;
pub mod camera;
mod error;
pub mod generate;
pub mod light;
pub mod picture;

pub use error::DotsError;

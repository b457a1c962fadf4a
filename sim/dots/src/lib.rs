//! Planes of identical dots (Park and Kender 1995, 3.1 and 7.1.1): what worlds and map-makers share.
//!
//! - [`generate`]: random places, by seed;
//! - [`camera`]: where a global camera sees a place of the plane, and the calibration by known points;
//! - [`picture`]: the spots of a picture and their centroids, and pictures of planes.
//!
//! Nothing here opens a file or has randomness of its own.

pub mod camera;
mod error;
pub mod generate;
pub mod picture;

pub use error::DotsError;

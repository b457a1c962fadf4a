//! Planes of identical dots (Park and Kender 1995, 3.1 and 7.1.1), as shared by worlds and map-makers.
//!
//! - [`generate`]: random places, by seed;
//! - [`camera`]: where a global camera sees a place of the plane, and the calibration by known points;
//! - [`calibration`]: which of the known points disagree with the others;
//! - [`picture`]: the spots of a picture and their centroids, and pictures of planes; [`light`]: uneven light is levelled;
//!   [`alike`]: spots that are not dots.
//!
//! Nothing here opens a file or has randomness of its own.

pub mod alike;
pub mod calibration;
pub mod camera;
mod error;
pub mod generate;
pub mod light;
pub mod picture;

pub use error::DotsError;

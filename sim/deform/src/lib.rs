//! Drawings of a floor with the deformations that people make: out of proportion, doors shifted, a room left out, no furniture,
//! and strokes of a pen.
//!
//! ```text
//! floor plan, map ─floor, regions, trace→ Floor
//! Floor + degree + seed ─doors, warp, hand→ DeformedDrawing ─measure→ Deformation
//! ```
//!
//! Degree 0 traces the walls, degree 1 deforms as much as people do ([`PEOPLE`]), and degree 0.5 half as much. Nothing here
//! opens a file, except for [`files`], or reads a clock. The same floor, degree and seed give the same drawing.

mod doors;
mod drawing;
mod error;
pub mod files;
mod floor;
mod grid;
mod hand;
mod measure;
mod outline;
mod regions;
pub mod scenes;
mod trace;
mod warp;

pub use drawing::{DeformedDrawing, MOST_DEGREE, deform};
pub use error::DeformError;
pub use floor::{Floor, Furnishing};
pub use hand::Stroke;
pub use measure::{Deformation, PEOPLE};
pub use regions::{Doorway, Region};

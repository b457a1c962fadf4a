//! Drawings of a floor as people deform what they draw: out of proportion, doors shifted, a room left
//! out, no furniture, strokes of a pen.
//!
//! ```text
//! floor plan, map ─floor, regions, trace→ Floor
//! Floor + degree + seed ─doors, warp, hand→ DeformedDrawing ─measure→ Deformation
//! ```
//!
//! Degree 0 traces the walls; degree 1 deforms as people do ([`PEOPLE`]), 0.5 half as much. Except for [`files`], nothing here
//! opens a file or reads a clock; the same floor, degree and seed give the same drawing.

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

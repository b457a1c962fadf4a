//! Draws floors with the kinds of deformations that people make: wrong proportions, shifted doors, missing rooms, no furniture, and
//! pen strokes.
//!
//! ```text
//! floor plan, map ─floor, regions, trace→ Floor
//! Floor + degree + seed ─doors, warp, hand→ DeformedDrawing ─measure→ Deformation
//! ```
//!
//! Degree 0 traces the walls, degree 1 deforms them as much as people do ([`PEOPLE`]), and degree 0.5 half as
//! much. Apart from [`files`], this crate does not open files, and it does not read clocks. The same floor,
//! degree and seed give the same drawing.

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

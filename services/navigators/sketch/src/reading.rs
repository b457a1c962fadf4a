//! Reads drawings, which may be pictures, photographs of paper, SVG, or strokes. Finds the walls and their
//! direction, and places the mission's start and goals in the drawing.
//!
//! ```text
//! bytes ─encoding→ text ─vector (styles, pictures), raster, strokes→ tones
//! tones ─ink→ walls ─pen→ gaps closed ─direction→ DrawnMap
//! DrawnMap + mission ─labels, references to rooms→ Intent
//! DrawnMap + Intent ─places→ Places ─publish→ SketchMap, Route
//! DrawnMap + Places ─doubts→ warnings
//! ```
//!
//! Pictures are flipped vertically as they are decoded, so that everything after the decoders uses a single
//! frame, [`Sketch`](sketchnav_schemas::geometry::Sketch): pixels, y up. Coordinates that people write (in a
//! mission file or as strokes) are image pixels with row 0 at the top until [`DrawnMap::from_image`] converts
//! them.
//!
//! If people draw while the system runs, their drawings arrive at a [`desk`] instead of in a file.
//!
//! This module does not open files, read clocks or send messages. The same bytes, options and seed give the
//! same map, bit for bit. Sources: Boniardi et al. 2015, III-B (directions); Boniardi et al. 2016, IV
//! (canvas, obstacles, drawn routes).

mod bits;
mod budget;
#[cfg(test)]
mod canvas;
pub mod desk;
mod direction;
pub mod doubts;
mod drawn_map;
mod edges;
mod enclosure;
mod encoding;
mod error;
mod file;
mod hough;
mod ink;
mod labels;
mod left_out;
mod located;
mod pen;
mod places;
mod preview;
mod publish;
mod raster;
mod reference;
mod settings;
pub mod strokes;
mod vector;
mod walls;

pub(crate) use direction::walls as wall_direction;
pub use drawn_map::DrawnMap;
pub use error::SketchError;
pub use file::read;
pub use labels::Label;
pub use left_out::LeftOut;
pub(crate) use places::nearest_free;
pub use places::{ImageTask, Intent, Places, route_heading_rad};
pub use preview::preview;
pub use publish::{fill_cells, fill_sketch, fill_understood};
pub use reference::{Reference, ReferenceError, Relation, Side};
pub use settings::{Options, Settings};
pub use sketchnav_stage::drawn::{GoalMark, Marks, StartMark};
pub use walls::Kind;

#[cfg(test)]
mod tests;

//! Reads what a person drew: pictures, photographs of paper, SVG, strokes; finds the walls and their
//! direction, and places the mission's start and goals in the drawing.
//!
//! ```text
//! bytes ─raster, vector, strokes→ tones ─ink→ walls ─pen→ gaps closed ─direction→ Drawing
//! Drawing + Intent ─places→ Places ─publish→ SketchMap, Route
//! ```
//!
//! Pictures are turned upside down as they are decoded, so that behind the decoders there is one
//! frame only, [`Sketch`](sketchnav_schemas::geometry::Sketch): pixels, y up. Coordinates that people
//! write (mission file, strokes) are image pixels, row 0 at the top, until
//! [`Drawing::from_image`] turns them.
//!
//! Where people draw while the system runs, a [`desk`] takes what they send in place of a file.
//!
//! [`sketcher`] makes the stage of it. Nothing here opens a file, reads a clock or sends a message;
//! the same bytes, options and seed give the same drawing to the bit. Source: paper 001, III-B (directions) and paper 004, IV (canvas,
//! obstacles, drawn routes).

mod bits;
#[cfg(test)]
mod canvas;
pub mod desk;
mod direction;
mod drawing;
mod edges;
mod error;
mod hough;
mod ink;
mod pen;
mod places;
mod preview;
mod publish;
mod raster;
mod settings;
mod stage;
pub mod strokes;
mod vector;

pub use drawing::{Drawing, Kind};
pub use error::SketchError;
pub use places::{Errand, Intent, PlacedErrand, Places, route_heading_rad};
pub use preview::preview;
pub use publish::{fill_cells, fill_route, fill_sketch, fill_understood};
pub use settings::{Options, Settings};
pub use stage::{sketcher, understand};
pub use strokes::{GoalMark, Marks, StartMark};

use image::ImageFormat;

use drawing::Walls;
use error::Broken;

/// Reads a drawing: PNG, JPEG, SVG or [`strokes`] in JSON, told apart by their content.
///
/// `file` is the file's name, for the errors. A drawing of more than
/// [`MAX_SKETCH_CELLS`](sketchnav_schemas::channels::MAX_SKETCH_CELLS) pixels is scaled down; points
/// in image pixels scale along, see [`Drawing::scale`].
///
/// # Errors
/// [`SketchError`]: no drawing, truncated, a type that is not supported, too large to decode, no walls
/// or no free space in it.
pub fn read(bytes: &[u8], file: &str, options: &Options) -> Result<Drawing, SketchError> {
    let broken = Broken { file };
    let walls = match Type::of(bytes) {
        Some(Type::Png) => picture(bytes, ImageFormat::Png, &broken, options)?,
        Some(Type::Jpeg) => picture(bytes, ImageFormat::Jpeg, &broken, options)?,
        Some(Type::Svg) => drawn(vector::tones(bytes, &broken)?, &broken, options)?,
        Some(Type::Strokes) => strokes::walls(bytes, &broken)?,
        None => return Err(broken.unsupported(bytes)),
    };
    Drawing::finish(walls, &broken, options)
}

fn picture(
    bytes: &[u8],
    format: ImageFormat,
    broken: &Broken,
    options: &Options,
) -> Result<Walls, SketchError> {
    drawn(raster::tones(bytes, format, broken)?, broken, options)
}

fn drawn(tones: raster::Tones, broken: &Broken, options: &Options) -> Result<Walls, SketchError> {
    let ink = ink::find(&tones.picture, options.walls).ok_or_else(|| broken.no_walls())?;
    Ok(Walls {
        mask: ink.walls,
        scale: tones.scale,
        pen_width_px: None,
        kind: ink.kind,
        marks: Marks::default(),
    })
}

/// The file types that hold drawings.
enum Type {
    Png,
    Jpeg,
    Svg,
    Strokes,
}

impl Type {
    /// By the first bytes; a name may lie.
    fn of(bytes: &[u8]) -> Option<Self> {
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        match (bytes, text.trim_ascii_start().first()) {
            ([0x89, b'P', b'N', b'G', ..], _) => Some(Self::Png),
            ([0xff, 0xd8, 0xff, ..], _) => Some(Self::Jpeg),
            (_, Some(b'<')) => Some(Self::Svg),
            (_, Some(b'{')) => Some(Self::Strokes),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests;

//! A drawing in a file, whatever its format.

use image::ImageFormat;

use super::drawn_map::DrawnMap;
use super::error::{Broken, SketchError};
use super::marks::Marks;
use super::settings::Options;
use super::walls::Walls;
use super::{ink, raster, strokes, vector};

/// Reads a drawing: PNG, JPEG, SVG or [`strokes`](super::strokes) in JSON, recognized by their content.
///
/// `file` is the file's name, for the errors. A drawing of more than
/// [`MAX_SKETCH_CELLS`](sketchnav_schemas::channels::MAX_SKETCH_CELLS) pixels is scaled down; points
/// in image pixels scale along, see [`DrawnMap::scale`].
///
/// # Errors
/// [`SketchError`]: no drawing, truncated, a type that is not supported, too large to decode, no walls
/// or no free space in it.
pub fn read(bytes: &[u8], file: &str, options: &Options) -> Result<DrawnMap, SketchError> {
    let broken = Broken { file };
    let walls = match Type::of(bytes) {
        Some(Type::Png) => picture(bytes, ImageFormat::Png, &broken, options)?,
        Some(Type::Jpeg) => picture(bytes, ImageFormat::Jpeg, &broken, options)?,
        Some(Type::Svg) => drawn(vector::tones(bytes, &broken)?, &broken, options)?,
        Some(Type::Strokes) => strokes::walls(bytes, &broken)?,
        None => return Err(broken.unsupported(bytes)),
    };
    DrawnMap::finish(walls, &broken, options)
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

//! A drawing in a file, whatever its format.

use image::ImageFormat;

use super::Marks;
use super::drawn_map::DrawnMap;
use super::error::{Broken, SketchError};
use super::left_out::LeftOut;
use super::raster::Tones;
use super::settings::Options;
use super::walls::Walls;
use super::{encoding, ink, raster, strokes, vector};

/// Ink of a second tone is more than what people erase with white.
const MOST_LOST: f64 = 0.1;

/// Reads a drawing: PNG, JPEG, GIF, WebP, BMP, PNM, SVG or [`strokes`](super::strokes) in JSON, recognized by their content; packed
/// with gzip (`.svgz`) or not. Text may be in UTF-8, UTF-16, or the encoding that its XML declaration says.
///
/// `file` is the file's name, for the errors. A drawing of more than
/// [`MAX_SKETCH_CELLS`](crate::messages::MAX_SKETCH_CELLS) pixels is scaled down; points
/// in image pixels scale along, see [`DrawnMap::scale`].
///
/// # Errors
/// [`SketchError`]: no drawing, truncated, a type that is not supported, too large to decode, a style that cannot be read,
/// no walls or no free space in it.
pub fn read(bytes: &[u8], file: &str, options: &Options) -> Result<DrawnMap, SketchError> {
    let broken = Broken { file };
    let bytes = &*encoding::unpacked(bytes, &broken)?;
    let walls = match Type::of(bytes) {
        Some(Type::Picture(format)) => picture(bytes, format, &broken, options)?,
        Some(Type::Svg) => svg(&encoding::text(bytes, &broken)?, &broken, options)?,
        Some(Type::Strokes) => strokes::walls(&encoding::text(bytes, &broken)?, &broken)?,
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
    let tones = raster::tones(bytes, format, broken)?;
    let ink = ink::find(&tones, options.walls).ok_or_else(|| broken.no_walls(blank(&tones)))?;
    Ok(walls(ink, &tones, options, Vec::new()))
}

fn svg(text: &str, broken: &Broken, options: &Options) -> Result<Walls, SketchError> {
    let page = vector::page(text, broken)?;
    let ink = ink::find(&page.tones, options.walls).ok_or_else(|| broken.no_walls(page.blank()))?;
    Ok(walls(ink, &page.tones, options, page.left_out))
}

fn walls(ink: ink::Ink, tones: &Tones, options: &Options, mut left_out: Vec<LeftOut>) -> Walls {
    let share = ink::lost_share(tones, options.walls);
    left_out.extend((share > MOST_LOST).then_some(LeftOut::Tone { share }));
    left_out.extend((ink.faint > MOST_LOST).then_some(LeftOut::Faint { share: ink.faint }));
    let marks = Marks::default();
    Walls { mask: ink.walls, scale: tones.scale, pen_width_px: None, kind: ink.kind, marks, left_out }
}

/// What a picture is in which no walls are found.
fn blank(tones: &Tones) -> String {
    let is_bare = tones.cover.as_ref().is_some_and(|cover| cover.iter().all(|&cover| cover == 0));
    match ink::contrast(&tones.on_white()) {
        _ if is_bare => "a picture that is transparent everywhere".into(),
        0 => "a picture of one tone".into(),
        contrast => format!(
            "a picture in which no tone stands out (the darkest and the lightest are {contrast} of 255 levels apart): draw the walls darker"
        ),
    }
}

/// The file types that hold drawings.
enum Type {
    Picture(ImageFormat),
    Svg,
    Strokes,
}

impl Type {
    /// By the first bytes; a name may lie.
    fn of(bytes: &[u8]) -> Option<Self> {
        if let Some(format) = raster::format_of(bytes) {
            return Some(Self::Picture(format));
        }
        let marks: [&[u8]; 3] = [b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff"];
        let text = marks.into_iter().find_map(|mark| bytes.strip_prefix(mark)).unwrap_or(bytes);
        let text = text.strip_prefix(b"\0").filter(|_| encoding::wide(text).is_some()).unwrap_or(text);
        match text.trim_ascii_start().first() {
            Some(b'<') => Some(Self::Svg),
            Some(b'{') => Some(Self::Strokes),
            _ => None,
        }
    }
}

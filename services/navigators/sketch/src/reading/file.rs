//! Reads a drawing from a file in any supported format.

use image::ImageFormat;

use super::Marks;
use super::drawn_map::DrawnMap;
use super::error::{Broken, SketchError};
use super::labels::Label;
use super::left_out::LeftOut;
use super::raster::Tones;
use super::settings::Options;
use super::walls::Walls;
use super::{encoding, ink, raster, strokes, vector};

/// Maximum share of ink that may be lost without a warning. People who erase with white paint leave some ink in a second tone.
const MOST_LOST: f64 = 0.1;

/// Reads a drawing. The file may be PNG, JPEG, GIF, WebP, BMP, PNM, SVG or [`strokes`](super::strokes) in
/// JSON, optionally compressed with gzip (`.svgz`). The format is detected from the content. Text may be in
/// UTF-8, UTF-16, or the encoding that its XML declaration names.
///
/// `file` is the file's name, as used in errors. A drawing of more than
/// [`MAX_SKETCH_CELLS`](crate::messages::MAX_SKETCH_CELLS) pixels is scaled down together with its points in
/// image pixels, see [`DrawnMap::scale`].
///
/// # Errors
/// [`SketchError`] if the file is empty, truncated, of an unsupported type or too large to decode, if a style in it cannot be
/// read, or if the drawing has no walls or no free space.
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
    Ok(walls(ink, &tones, options, Vec::new(), Vec::new()))
}

fn svg(text: &str, broken: &Broken, options: &Options) -> Result<Walls, SketchError> {
    let page = vector::page(text, broken)?;
    let ink = ink::find(&page.tones, options.walls).ok_or_else(|| broken.no_walls(page.blank()))?;
    Ok(walls(ink, &page.tones, options, page.labels, page.left_out))
}

fn walls(
    ink: ink::Ink,
    tones: &Tones,
    options: &Options,
    labels: Vec<Label>,
    mut left_out: Vec<LeftOut>,
) -> Walls {
    let share = ink::lost_share(tones, options.walls);
    left_out.extend((share > MOST_LOST).then_some(LeftOut::Tone { share }));
    left_out.extend((ink.faint > MOST_LOST).then_some(LeftOut::Faint { share: ink.faint }));
    let marks = Marks::default();
    Walls { mask: ink.walls, scale: tones.scale, pen_width_px: None, kind: ink.kind, marks, labels, left_out }
}

/// Describes a picture in which no walls were found.
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

/// The types of files that can contain drawings.
enum Type {
    Picture(ImageFormat),
    Svg,
    Strokes,
}

impl Type {
    /// Recognizes the type by the first bytes, because a file's name may be wrong.
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

//! Decodes raster pictures (PNG, JPEG, GIF, WebP, BMP and PNM) within bounds and scales them to the canvas. Of an animation,
//! only the first frame is read.
//!
//! The rows of the output run from the bottom up. Only the decoders, here and elsewhere, deal with pictures whose row 0 is at
//! the top.

use std::borrow::Cow;
use std::io::Cursor;

use image::metadata::Orientation;
use image::{DynamicImage, GrayImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use super::error::{Broken, SketchError};
use crate::messages::MAX_SKETCH_CELLS;

/// Maximum number of pixels that are decoded, enough for a 50-megapixel photograph.
pub(crate) const MAX_PIXELS: u64 = 50_000_000;
/// Maximum side length that is decoded, in pixels.
const MAX_SIDE: u32 = 30_000;
/// Maximum memory that a decoder may take at once, in bytes.
const MAX_DECODER_BYTES: u64 = 512 << 20;
/// Maximum number of pixels in all passes of a JPEG. Each pass of a progressive JPEG goes through the whole picture.
const MAX_PASSED_PIXELS: u64 = 2_000_000_000;
/// Maximum side length of a sketch, in pixels. This bounds the table of the Hough transform for ribbon-like drawings.
const MAX_CANVAS_SIDE: u32 = 10_000;

/// A decoded picture, with rows from the bottom up.
pub(crate) struct Tones {
    /// Brightness of the ink times its coverage. This is how the picture looks on black paper.
    pub ink: GrayImage,
    /// Coverage of the ink, or `None` if no paper shows anywhere.
    pub cover: Option<GrayImage>,
    /// Sketch pixels per image pixel.
    pub scale: f64,
}

impl Tones {
    /// Creates a picture from the ink and its coverage. Paper shows where the coverage is below 255.
    pub fn new(ink: GrayImage, cover: GrayImage, scale: f64) -> Self {
        let is_opaque = cover.iter().all(|&cover| cover == 255);
        Self { ink, cover: (!is_opaque).then_some(cover), scale }
    }

    /// Returns the picture as it looks on white paper.
    pub fn on_white(&self) -> Cow<'_, GrayImage> {
        let Some(cover) = &self.cover else { return Cow::Borrowed(&self.ink) };
        let mut picture = self.ink.clone();
        picture
            .iter_mut()
            .zip(cover.iter())
            .for_each(|(tone, cover)| *tone = tone.saturating_add(255 - cover));
        Cow::Owned(picture)
    }
}

/// Returns the size on the canvas of a drawing of `width` x `height`, and the corresponding scale, at most `scale_max`.
pub(crate) fn fit(width: f64, height: f64, scale_max: f64) -> (u32, u32, f64) {
    let by_cells = (MAX_SKETCH_CELLS as f64 / (width * height)).sqrt();
    let by_side = f64::from(MAX_CANVAS_SIDE) / width.max(height);
    let mut scale = scale_max.min(by_cells).min(by_side);
    loop {
        let (w, h) = ((width * scale).ceil().max(1.0), (height * scale).ceil().max(1.0));
        if w * h <= MAX_SKETCH_CELLS as f64 && w.max(h) <= f64::from(MAX_CANVAS_SIDE) {
            return (w as u32, h as u32, scale);
        }
        scale *= 0.999;
    }
}

/// Returns the format of a picture, judging by its first bytes, or `None` if it is not decoded here. File names and declared
/// types are ignored because they may be wrong.
pub(crate) fn format_of(bytes: &[u8]) -> Option<ImageFormat> {
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => Some(ImageFormat::Png),
        [0xff, 0xd8, 0xff, ..] => Some(ImageFormat::Jpeg),
        [b'G', b'I', b'F', b'8', b'7' | b'9', b'a', ..] => Some(ImageFormat::Gif),
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Some(ImageFormat::WebP),
        // The length of the file is followed by four reserved bytes.
        [b'B', b'M', _, _, _, _, 0, 0, 0, 0, ..] => Some(ImageFormat::Bmp),
        // PBM, PGM and PPM, as text and as bytes, and PAM.
        [b'P', b'1'..=b'7', b' ' | b'\t' | b'\r' | b'\n' | b'#', ..] => Some(ImageFormat::Pnm),
        _ => None,
    }
}

fn name(format: ImageFormat) -> &'static str {
    match format {
        ImageFormat::Png => "PNG",
        ImageFormat::Jpeg => "JPEG",
        ImageFormat::Gif => "GIF",
        ImageFormat::WebP => "WebP",
        ImageFormat::Pnm => "PNM",
        _ => "BMP",
    }
}

/// Decodes a picture and scales it to the canvas.
pub(crate) fn tones(bytes: &[u8], format: ImageFormat, broken: &Broken) -> Result<Tones, SketchError> {
    Ok(shrink(upright(bytes, format, broken)?))
}

/// Decodes a picture and turns it the right way up.
pub(crate) fn upright(
    bytes: &[u8],
    format: ImageFormat,
    broken: &Broken,
) -> Result<DynamicImage, SketchError> {
    let (mut image, orientation) = decode(bytes, format, broken)?;
    image.apply_orientation(orientation);
    Ok(image)
}

fn decode(
    bytes: &[u8],
    format: ImageFormat,
    broken: &Broken,
) -> Result<(DynamicImage, Orientation), SketchError> {
    let kind = name(format);
    if format == ImageFormat::Jpeg && !jpeg_ends(bytes) {
        return Err(broken.decode(kind, "it ends in the middle of the picture"));
    }
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(limits());
    let mut decoder = reader.into_decoder().map_err(|error| broken.decode(kind, error))?;
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 {
        return Err(broken.decode(kind, "it has no pixels"));
    }
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        let limit = format!("{} megapixels", MAX_PIXELS / 1_000_000);
        return Err(broken.too_large(limit, format!("{width} x {height}")));
    }
    let passes = if format == ImageFormat::Jpeg { jpeg_passes(bytes) } else { 1 };
    if passes * u64::from(width) * u64::from(height) > MAX_PASSED_PIXELS {
        let limit = format!("{} megapixels in all passes", MAX_PASSED_PIXELS / 1_000_000);
        return Err(broken.too_large(limit, format!("{passes} passes of {width} x {height}")));
    }
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    let image = DynamicImage::from_decoder(decoder).map_err(|error| broken.decode(kind, error))?;
    Ok((image, orientation))
}

/// Returns true if the last scan of a JPEG is complete. This has to be checked because the decoder silently fills the rest of a
/// truncated picture with grey.
fn jpeg_ends(bytes: &[u8]) -> bool {
    let scan = bytes.windows(2).rposition(|pair| pair == [0xff, 0xda]);
    scan.is_some_and(|start| bytes[start..].windows(2).any(|pair| pair == [0xff, 0xd9]))
}

/// Counts the scans of a JPEG, including those of an embedded preview.
fn jpeg_passes(bytes: &[u8]) -> u64 {
    bytes.windows(2).filter(|pair| *pair == [0xff, 0xda]).count() as u64
}

fn limits() -> Limits {
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_DECODER_BYTES);
    limits
}

/// Scales a picture to the canvas. Each cell takes the mean of the pixels that fall into it.
fn shrink(image: DynamicImage) -> Tones {
    let (width, height) = (image.width(), image.height());
    let (cells_x, cells_y, scale) = fit(width.into(), height.into(), 1.0);
    let pixels = image.into_luma_alpha8();
    let mut sums = vec![(0_u32, 0_u32, 0_u32); cells_x as usize * cells_y as usize];
    for (row, line) in pixels.as_raw().chunks_exact(2 * width as usize).enumerate() {
        let first = ((row as f64 * scale) as usize).min(cells_y as usize - 1) * cells_x as usize;
        for (column, pixel) in line.chunks_exact(2).enumerate() {
            let cell = &mut sums[first + ((column as f64 * scale) as usize).min(cells_x as usize - 1)];
            let (tone, cover) = (u32::from(pixel[0]), u32::from(pixel[1]));
            *cell = (cell.0 + (tone * cover + 127) / 255, cell.1 + cover, cell.2 + 1);
        }
    }
    let cell = |x: u32, y: u32| sums[((cells_y - 1 - y) * cells_x + x) as usize];
    let mean = |sum: u32, count: u32| image::Luma([(sum / count.max(1)) as u8]);
    let ink = GrayImage::from_fn(cells_x, cells_y, |x, y| mean(cell(x, y).0, cell(x, y).2));
    let cover = GrayImage::from_fn(cells_x, cells_y, |x, y| mean(cell(x, y).1, cell(x, y).2));
    Tones::new(ink, cover, scale)
}

#[cfg(test)]
mod tests;

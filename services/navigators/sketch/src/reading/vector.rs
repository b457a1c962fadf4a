//! Drawings in SVG, rendered on white paper. Text and embedded pictures are not drawn: labels are no
//! walls, and a drawing may not make the reader open other files.

use image::GrayImage;
use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::{ImageHrefResolver, Options, Tree};

use super::error::{Broken, SketchError};
use super::raster::{Tones, fit};

/// Largest file that is parsed.
const MAX_BYTES: usize = 16 << 20;
/// A smaller drawing is rendered with its longer side that long: units may be metres.
const MIN_SIDE_PX: f64 = 1024.0;

/// Renders an SVG. The scale joins its user units to sketch pixels.
pub(crate) fn tones(bytes: &[u8], broken: &Broken) -> Result<Tones, SketchError> {
    if bytes.len() > MAX_BYTES {
        return Err(broken.too_large(format!("{MAX_BYTES} bytes of SVG"), bytes.len().to_string()));
    }
    let tree = Tree::from_data(bytes, &closed_options()).map_err(|error| broken.decode("SVG", error))?;
    let (width, height) = (f64::from(tree.size().width()), f64::from(tree.size().height()));
    let (w, h, scale) = fit(width, height, (MIN_SIDE_PX / width.max(height)).max(1.0));
    let mut page = Pixmap::new(w, h).ok_or_else(|| broken.decode("SVG", "it has no size"))?;
    page.fill(Color::WHITE);
    resvg::render(&tree, Transform::from_scale(scale as f32, scale as f32), &mut page.as_mut());
    Ok(Tones { picture: gray(&page), scale })
}

fn closed_options() -> Options<'static> {
    let nothing =
        ImageHrefResolver { resolve_data: Box::new(|_, _, _| None), resolve_string: Box::new(|_, _| None) };
    Options { image_href_resolver: nothing, ..Options::default() }
}

/// Brightness (Rec. 601) of an opaque page, rows from the bottom up.
pub(crate) fn gray(page: &Pixmap) -> GrayImage {
    let mut picture = GrayImage::new(page.width(), page.height());
    let width = page.width() as usize;
    let rows = page.pixels().chunks_exact(width).rev();
    for (tones, pixels) in picture.chunks_exact_mut(width).zip(rows) {
        for (tone, pixel) in tones.iter_mut().zip(pixels) {
            let (r, g, b) = (u32::from(pixel.red()), u32::from(pixel.green()), u32::from(pixel.blue()));
            *tone = ((299 * r + 587 * g + 114 * b) / 1000) as u8;
        }
    }
    picture
}

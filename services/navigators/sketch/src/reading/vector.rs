//! Drawings in SVG, rendered on white paper. Text and embedded pictures are not drawn: labels are no
//! walls, and a drawing may not make the reader open other files. What it would cost is counted first: its references
//! before they are followed, its painting before it is painted.

mod references;
mod work;

use image::GrayImage;
use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::roxmltree::{Document, ParsingOptions};
use resvg::usvg::{ImageHrefResolver, Options, Tree};

use super::error::{Broken, SketchError};
use super::raster::{Tones, fit};

/// Largest file that is parsed.
const MAX_BYTES: usize = 16 << 20;
/// Most nodes of XML that are parsed: elements, texts and comments.
const MAX_NODES: u32 = 1_000_000;
/// A smaller drawing is rendered with its longer side that long: units may be metres.
const MIN_SIDE_PX: f64 = 1024.0;

/// Renders an SVG. The scale joins its user units to sketch pixels.
pub(crate) fn tones(bytes: &[u8], broken: &Broken) -> Result<Tones, SketchError> {
    if bytes.len() > MAX_BYTES {
        return Err(broken.too_large(format!("{MAX_BYTES} bytes of SVG"), bytes.len().to_string()));
    }
    let text = std::str::from_utf8(bytes).map_err(|error| broken.decode("SVG", error))?;
    let options = ParsingOptions { allow_dtd: true, nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document =
        Document::parse_with_options(text, options).map_err(|error| broken.decode("SVG", error))?;
    let too_much = |found: references::TooMuch| broken.too_large(found.limit, found.found);
    references::check(&document).map_err(too_much)?;
    let tree =
        Tree::from_xmltree(&document, &closed_options()).map_err(|error| broken.decode("SVG", error))?;
    let (width, height) = (f64::from(tree.size().width()), f64::from(tree.size().height()));
    let (w, h, scale) = fit(width, height, (MIN_SIDE_PX / width.max(height)).max(1.0));
    let transform = Transform::from_scale(scale as f32, scale as f32);
    work::check(tree.root(), transform, w, h).map_err(too_much)?;
    let mut page = Pixmap::new(w, h).ok_or_else(|| broken.decode("SVG", "it has no size"))?;
    page.fill(Color::WHITE);
    resvg::render(&tree, transform, &mut page.as_mut());
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

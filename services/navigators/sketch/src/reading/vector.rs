//! Renders drawings in SVG as a browser would show them on white paper. Text is not drawn, because labels are
//! not walls, but it names the place where it is. No other file is opened. Anything that is left out is
//! reported.
//!
//! First, [`styles`] computes the styles. Then the costs are estimated before they are incurred: those of references before any is
//! followed, and those of painting before anything is painted.

mod pictures;
mod references;
mod styles;
mod work;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use image::GrayImage;
use resvg::tiny_skia::{Pixmap, PremultipliedColorU8, Transform};
use resvg::usvg::roxmltree::{Document, ParsingOptions};
use resvg::usvg::{Group, ImageHrefResolver, ImageKind, Node, Options, Path, Tree};

use super::error::{Broken, SketchError};
use super::labels::Label;
use super::left_out::LeftOut;
use super::raster::{Tones, fit};

/// Maximum size of a file that is parsed, in bytes.
const MAX_BYTES: usize = 16 << 20;
/// Maximum number of XML nodes (elements, texts and comments) that are parsed.
const MAX_NODES: u32 = 1_000_000;
/// Maximum number of languages taken from a drawing.
const MOST_LANGUAGES: usize = 64;
/// Minimum length of the longer side of the rendered drawing, in pixels. Smaller drawings are enlarged, because their units may
/// be metres.
const MIN_SIDE_PX: f64 = 1024.0;

/// Relative deviation that the width of a stroke may have without being reported.
const OFF_WIDTH: f64 = 0.05;

/// A rendered SVG.
pub(crate) struct Page {
    /// The rendered picture. Its scale is in sketch pixels per user unit.
    pub tones: Tones,
    /// Content that was left out.
    pub left_out: Vec<LeftOut>,
    /// The texts, with their positions in user units.
    pub labels: Vec<Label>,
    /// Content that was drawn.
    pub content: Content,
}

/// Amount of content to paint.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Content {
    /// Number of shapes with a fill or a stroke.
    pub shapes: usize,
    /// Number of pictures.
    pub pictures: usize,
    /// Pixels of the finest picture per user unit.
    fineness: f64,
}

/// Renders an SVG.
pub(crate) fn page(text: &str, broken: &Broken) -> Result<Page, SketchError> {
    if text.len() > MAX_BYTES {
        return Err(broken.too_large(format!("{MAX_BYTES} bytes of SVG"), text.len().to_string()));
    }
    let flat = styles::flatten(&parse_svg(text, broken)?, broken)?;
    let mut left_out = flat.left_out;
    let document = parse(&flat.text, broken)?;
    let too_much = |found: references::TooMuch| broken.too_large(found.limit, found.found);
    references::check(&document).map_err(too_much)?;
    let options = closed(flat.pictures, languages(&document));
    let tree = Tree::from_xmltree(&document, &options).map_err(|error| broken.decode("SVG", error))?;
    let mut seen = Seen::new(&flat.served, &flat.unscaled);
    seen.look(tree.root());
    left_out.extend(seen.lost(&flat.affected));
    let (width, height) = (f64::from(tree.size().width()), f64::from(tree.size().height()));
    let labels = placed(flat.labels, &tree);
    let content = Content::of(tree.root());
    let finest = (MIN_SIDE_PX / width.max(height)).max(1.0).max(content.fineness);
    let (w, h, scale) = fit(width, height, finest);
    let transform = Transform::from_scale(scale as f32, scale as f32);
    work::check(tree.root(), transform, w, h).map_err(too_much)?;
    let mut page = Pixmap::new(w, h).ok_or_else(|| broken.decode("SVG", "it has no size"))?;
    resvg::render(&tree, transform, &mut page.as_mut());
    complete(&mut page, [width * scale, height * scale]);
    Ok(Page { tones: Tones::new(gray(&page), cover(&page), scale), left_out, labels, content })
}

/// Returns the texts with the middle of their frames, which [`styles`] put in their places.
fn placed(labels: Vec<(String, String)>, tree: &Tree) -> Vec<Label> {
    let mut texts: BTreeMap<_, _> = labels.into_iter().collect();
    let mut placed = Vec::new();
    find_frames(tree.root(), &mut texts, &mut placed);
    placed
}

/// Moves the texts whose frames are in a group from `texts` to `placed`.
fn find_frames(group: &Group, texts: &mut BTreeMap<String, String>, placed: &mut Vec<Label>) {
    for node in group.children() {
        match node {
            Node::Group(group) => find_frames(group, texts, placed),
            Node::Path(path) => {
                let area = path.abs_bounding_box();
                let at = [f32::midpoint(area.left(), area.right()), f32::midpoint(area.top(), area.bottom())];
                let text = texts.remove(path.id());
                placed.extend(text.map(|text| Label { text, at: at.map(f64::from) }));
            }
            _ => {}
        }
    }
}

/// Parses an SVG. If the file is other XML, the error says which kind. Web pages are recognized even though they need not be
/// XML.
fn parse_svg<'a>(text: &'a str, broken: &Broken) -> Result<Document<'a>, SketchError> {
    let begin = text.trim_start().get(..14).unwrap_or("").to_ascii_lowercase();
    if begin.starts_with("<!doctype html") || begin.starts_with("<html") {
        return Err(broken.other_xml("html"));
    }
    let document = parse(text, broken)?;
    let root = document.root_element().tag_name().name();
    if root == "svg" { Ok(document) } else { Err(broken.other_xml(root)) }
}

fn parse<'a>(text: &'a str, broken: &Broken) -> Result<Document<'a>, SketchError> {
    let options = ParsingOptions { allow_dtd: true, nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    Document::parse_with_options(text, options).map_err(|error| broken.decode("SVG", error))
}

/// Returns options with which the renderer opens no files and finds only pictures that are already decoded.
fn closed(files: Vec<Arc<Vec<u8>>>, languages: Vec<String>) -> Options<'static> {
    let resolver = ImageHrefResolver {
        resolve_data: Box::new(|_, _, _| None),
        resolve_string: Box::new(move |link, _| pictures::find(&files, link).cloned().map(ImageKind::PNG)),
    };
    Options { image_href_resolver: resolver, languages, ..Options::default() }
}

/// Returns all languages that a drawing asks for, because walls are walls in any language.
fn languages(document: &Document) -> Vec<String> {
    let lists = document.descendants().filter_map(|node| node.attribute("systemLanguage"));
    let all: BTreeSet<_> = lists.flat_map(|list| list.split(',')).map(|one| one.trim().to_owned()).collect();
    all.into_iter().take(MOST_LANGUAGES).chain(["en".to_owned()]).collect()
}

/// Records how the renderer has drawn the watched elements. The renderer silently drops what it cannot paint: a straight line along
/// an axis, for example, has no box for a gradient, a filter, a mask or a clip path.
struct Seen<'a> {
    served: &'a BTreeMap<String, String>,
    unscaled: &'a BTreeMap<String, String>,
    ids: BTreeSet<&'a str>,
    /// The shapes whose strokes should have been painted by a gradient or a pattern, but were not.
    unpainted: BTreeSet<&'a str>,
    /// The strokes that should have kept their width, and how many times as wide they are drawn.
    widened: BTreeMap<&'a str, f64>,
}

impl<'a> Seen<'a> {
    fn new(served: &'a BTreeMap<String, String>, unscaled: &'a BTreeMap<String, String>) -> Self {
        let (ids, unpainted, widened) = (BTreeSet::new(), BTreeSet::new(), BTreeMap::new());
        Self { served, unscaled, ids, unpainted, widened }
    }

    /// Inspects a group and everything in it. Returns true if it shows anything.
    fn look(&mut self, group: &'a Group) -> bool {
        // An empty mask hides everything.
        if group.mask().is_some_and(|mask| !mask.root().has_children()) {
            return false;
        }
        let mut shows = false;
        for node in group.children() {
            shows |= match node {
                Node::Group(group) => self.look(group),
                Node::Path(path) => self.look_at(path),
                other => {
                    self.ids.insert(other.id());
                    true
                }
            };
        }
        if shows {
            self.ids.insert(group.id());
        }
        shows
    }

    fn look_at(&mut self, path: &'a Path) -> bool {
        self.ids.insert(path.id());
        if path.stroke().is_none() {
            self.unpainted.extend(self.served.get(path.id()).map(String::as_str));
        }
        let (x, y) = path.abs_transform().get_scale();
        let times = f64::from(x * y).sqrt();
        let is_other = path.stroke().is_some() && (times - 1.0).abs() > OFF_WIDTH;
        if let Some(element) = self.unscaled.get(path.id()).filter(|_| is_other) {
            self.widened.insert(element, times);
        }
        let bounds = path.bounding_box();
        let has_area = bounds.width() > 0.0 && bounds.height() > 0.0;
        path.stroke().is_some() || path.fill().is_some() && has_area
    }

    /// Returns everything that is not drawn as it should be.
    fn lost(self, affected: &BTreeMap<String, String>) -> Vec<LeftOut> {
        let Self { served, ids, mut unpainted, widened, .. } = self;
        let is_lost = |(id, _): &(&String, &String)| !ids.contains(id.as_str());
        let lost = affected.iter().filter(is_lost).map(|(_, element)| LeftOut::Effect(element.clone()));
        unpainted.extend(served.iter().filter(is_lost).map(|(_, element)| element.as_str()));
        let unpainted = unpainted.into_iter().map(|element| LeftOut::Paint(element.to_owned()));
        let widened = widened.into_iter();
        let widened = widened.map(|(element, times)| LeftOut::Width { element: element.to_owned(), times });
        unpainted.chain(lost).chain(widened).collect()
    }
}

/// Repairs the last column and row of a page that ends within a pixel. They are only partly covered, as if there were paper
/// beyond the page's edge, so each is replaced by its neighbour.
fn complete(page: &mut Pixmap, ends: [f64; 2]) {
    let [width, height] = [page.width(), page.height()].map(|side| side as usize);
    let is_partial = |side: usize, end: f64| side > 1 && 255.0 * (side as f64 - end) > 0.5;
    let pixels = page.pixels_mut();
    if is_partial(width, ends[0]) {
        pixels.chunks_exact_mut(width).for_each(|row| row[width - 1] = row[width - 2]);
    }
    if is_partial(height, ends[1]) {
        pixels.copy_within((height - 2) * width..(height - 1) * width, (height - 1) * width);
    }
}

impl Content {
    fn of(group: &Group) -> Self {
        group.children().iter().fold(Self::default(), |sum, node| {
            let more = match node {
                Node::Group(group) => Self::of(group),
                Node::Path(path) => Self {
                    shapes: usize::from(path.fill().is_some() || path.stroke().is_some()),
                    ..Self::default()
                },
                Node::Image(image) => {
                    let (x, y) = image.abs_transform().get_scale();
                    let fineness = 1.0 / f64::from(x.min(y)).max(1e-9);
                    Self { pictures: 1, fineness, ..Self::default() }
                }
                Node::Text(_) => Self::default(),
            };
            Self {
                shapes: sum.shapes + more.shapes,
                pictures: sum.pictures + more.pictures,
                fineness: sum.fineness.max(more.fineness),
            }
        })
    }
}

impl Page {
    /// Describes what the page shows instead of walls.
    pub fn blank(&self) -> String {
        let is_bare = self.tones.cover.as_ref().is_some_and(|cover| cover.iter().all(|&cover| cover == 0));
        let Content { shapes, pictures, .. } = self.content;
        let words = match (shapes, pictures) {
            (0, 0) if self.left_out.is_empty() => "an SVG without shapes".to_owned(),
            (0, 0) => "an SVG with nothing but what is left out".to_owned(),
            (0, _) => "a picture of one tone inside an SVG".to_owned(),
            _ if is_bare => "shapes of SVG that paint nothing within the page".to_owned(),
            _ => "shapes of SVG that all have the colour of the paper, or nearly so: draw the walls darker"
                .to_owned(),
        };
        let left_out: Vec<_> = self.left_out.iter().map(LeftOut::to_string).collect();
        if left_out.is_empty() { words } else { format!("{words}; left out: {}", left_out.join("; ")) }
    }
}

/// Returns the brightness (Rec. 601) of a page on black paper, in rows from the bottom up.
pub(crate) fn gray(page: &Pixmap) -> GrayImage {
    upright(page, |pixel| {
        let (r, g, b) = (u32::from(pixel.red()), u32::from(pixel.green()), u32::from(pixel.blue()));
        ((299 * r + 587 * g + 114 * b) / 1000) as u8
    })
}

/// Returns how much of each pixel is painted, in rows from the bottom up.
fn cover(page: &Pixmap) -> GrayImage {
    upright(page, |pixel| pixel.alpha())
}

fn upright(page: &Pixmap, value: impl Fn(PremultipliedColorU8) -> u8) -> GrayImage {
    let mut picture = GrayImage::new(page.width(), page.height());
    let width = page.width() as usize;
    let rows = page.pixels().chunks_exact(width).rev();
    for (values, pixels) in picture.chunks_exact_mut(width).zip(rows) {
        values.iter_mut().zip(pixels).for_each(|(found, pixel)| *found = value(*pixel));
    }
    picture
}

#[cfg(test)]
mod tests;

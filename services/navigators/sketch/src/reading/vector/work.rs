//! Counts the work of rendering an SVG by walking through its tree in the same order as resvg. What a mask, a pattern or a
//! filter costs depends on how many pixels it covers in the place where it is used.

use resvg::tiny_skia::{PathSegment, Point, Rect, Transform};
use resvg::usvg::{ClipPath, Group, Image, Mask, Node, Paint, Path, Pattern, filter};

use super::super::budget::{MOST_ELEMENTS, MOST_HELD_PX, MOST_NESTED, Outline, Steps, steps_words};
use super::references::TooMuch;

/// Steps per pixel that is painted in one colour, by a gradient, or by a pattern.
const PLAIN: f64 = 1.0;
const GRADIENT: f64 = 8.0;
const PATTERN: f64 = 30.0;
/// Steps per pixel of an intermediate page, which has to be created, painted, and composited with the page below.
const LAYER: f64 = 35.0;
/// Steps per pixel of a picture, both for decoding and for painting it.
const PICTURE: f64 = 30.0;
/// Steps per pixel for a simple filter primitive. Those that look at many neighbours take more.
const FILTER: f64 = 30.0;
/// Size of the largest intermediate page that resvg creates, in canvases in either direction.
const WIDEST: f64 = 5.0;
/// Maximum number of lines that a curve is painted as.
const LINES_OF_CURVE: f64 = 8.0;

/// Checks that rendering `root` on a page of `width` x `height` does not take too much work.
pub(crate) fn check(root: &Group, transform: Transform, width: u32, height: u32) -> Result<(), TooMuch> {
    let page = [f64::from(width), f64::from(height)];
    let mut work = Work { steps: Steps::default(), elements: 0.0, canvas: page };
    work.nodes(root, Place { transform, page, held_px: page[0] * page[1], nested: 0 })
}

struct Work {
    steps: Steps,
    elements: f64,
    canvas: [f64; 2],
}

/// The context for painting something.
#[derive(Clone, Copy)]
struct Place {
    transform: Transform,
    /// Width and height of the page, in pixels.
    page: [f64; 2],
    /// Number of pixels in all pages that are held in memory.
    held_px: f64,
    /// Number of masks, patterns and clip paths around it.
    nested: usize,
}

impl Place {
    /// Returns the number of sketch pixels per unit, along the axis where it is greater.
    fn scale(&self) -> f64 {
        let Transform { sx, kx, ky, sy, .. } = self.transform;
        f64::from(sx.hypot(ky)).max(f64::from(kx.hypot(sy)))
    }

    fn under(&self, transform: Transform) -> Self {
        Self { transform: self.transform.pre_concat(transform), ..*self }
    }

    /// Enters another mask, pattern or clip path, called `name`. Fails if they are nested too deeply.
    fn inside(&self, name: &str) -> Result<Self, TooMuch> {
        if self.nested == MOST_NESTED {
            let limit = format!("{MOST_NESTED} masks, patterns and clip paths of SVG inside each other");
            return Err(TooMuch { limit, found: format!("another one, {name}") });
        }
        Ok(Self { nested: self.nested + 1, ..*self })
    }

    /// Moves to a new page of the given size, for which `pages` pages of that size have to be held. Fails if too many pixels
    /// would be held.
    fn with_page(&self, page: [f64; 2], pages: f64, name: &str) -> Result<Self, TooMuch> {
        let held_px = self.held_px + pages * page[0] * page[1];
        if held_px <= MOST_HELD_PX {
            return Ok(Self { page, held_px, ..*self });
        }
        let limit = format!("{} million pixels of SVG held at the same time", MOST_HELD_PX / 1e6);
        Err(TooMuch { limit, found: format!("{:.0} million at {name}", held_px / 1e6) })
    }

    /// Returns the size of a box on the page, at most `most`. If the box cannot be transformed, returns `most`.
    fn size(&self, area: Rect, most: [f64; 2]) -> [f64; 2] {
        let area = area.transform(self.transform);
        area.map_or(most, |area| {
            [f64::from(area.width()).min(most[0]), f64::from(area.height()).min(most[1])]
        })
    }
}

impl Work {
    fn take(&mut self, steps: f64, name: impl FnOnce() -> String) -> Result<(), TooMuch> {
        if self.steps.take(steps) {
            return Ok(());
        }
        Err(TooMuch { limit: steps_words(), found: format!("more from {} on", name()) })
    }

    fn nodes(&mut self, group: &Group, place: Place) -> Result<(), TooMuch> {
        group.children().iter().try_for_each(|node| self.node(node, place))
    }

    fn node(&mut self, node: &Node, place: Place) -> Result<(), TooMuch> {
        self.elements += 1.0;
        if self.elements > MOST_ELEMENTS {
            let limit = format!("{MOST_ELEMENTS} elements of SVG to be painted");
            return Err(TooMuch { limit, found: format!("more from {} on", named("element", node.id())) });
        }
        match node {
            Node::Group(group) => self.group(group, place),
            Node::Path(path) => self.path(path, place),
            Node::Text(text) => self.group(text.flattened(), place),
            Node::Image(image) => self.image(image, place),
        }
    }

    /// Counts a picture. It is decoded each time it is painted.
    fn image(&mut self, image: &Image, place: Place) -> Result<(), TooMuch> {
        let size = image.size();
        let own = [f64::from(size.width()), f64::from(size.height())];
        place.with_page(own, 1.0, "a picture")?;
        let name = || named("picture", image.id());
        self.take(PICTURE * (own[0] * own[1] + self.canvas[0] * self.canvas[1]), name)
    }

    fn group(&mut self, group: &Group, place: Place) -> Result<(), TooMuch> {
        let place = place.under(group.transform());
        if !group.should_isolate() {
            return self.nodes(group, place);
        }
        let name = || named("group", group.id());
        let most = self.canvas.map(|side| WIDEST * side);
        let size = place.size(group.layer_bounding_box().to_rect(), most);
        let page = size.map(|side| side.ceil() + 4.0);
        let place = place.with_page(page, 1.0, &name())?;
        self.take(LAYER * page[0] * page[1], name)?;
        self.nodes(group, place)?;
        group.filters().iter().try_for_each(|filter| self.filter(filter, place))?;
        group.clip_path().map_or(Ok(()), |clip| self.clip(clip, place))?;
        group.mask().map_or(Ok(()), |mask| self.mask(mask, place))
    }

    fn mask(&mut self, mask: &Mask, place: Place) -> Result<(), TooMuch> {
        let name = named("mask", mask.id());
        // The mask itself, its region, and the combination of the two are held at the same time.
        let place = place.inside(&name)?.with_page(place.page, 1.5, &name)?;
        self.take(LAYER * place.page[0] * place.page[1], || name)?;
        self.nodes(mask.root(), place)?;
        mask.mask().map_or(Ok(()), |mask| self.mask(mask, place))
    }

    fn clip(&mut self, clip: &ClipPath, place: Place) -> Result<(), TooMuch> {
        let name = named("clip path", clip.id());
        let place = place.inside(&name)?.with_page(place.page, 1.25, &name)?;
        self.take(LAYER * place.page[0] * place.page[1], || name)?;
        self.clipped(clip.root(), place.under(clip.transform()))?;
        clip.clip_path().map_or(Ok(()), |clip| self.clip(clip, place))
    }

    /// Counts the content of a clip path. Unlike elsewhere, its groups have no intermediate pages, except for clip paths of
    /// their own.
    fn clipped(&mut self, group: &Group, place: Place) -> Result<(), TooMuch> {
        for node in group.children() {
            match node {
                Node::Group(inner) => {
                    let place = place.under(inner.transform());
                    self.clipped(inner, place)?;
                    inner.clip_path().map_or(Ok(()), |clip| self.clip(clip, place))?;
                }
                other => self.node(other, place)?,
            }
        }
        Ok(())
    }

    fn path(&mut self, path: &Path, place: Place) -> Result<(), TooMuch> {
        let name = || named("path", path.id());
        let outline = outline(path, &place);
        if let Some(fill) = path.fill() {
            let [width, height] = place.size(path.bounding_box(), place.page);
            let pixels = self.paint(fill.paint(), place)? * width * height;
            self.take(outline.fill_steps() + pixels, name)?;
        }
        let Some(stroke) = path.stroke() else { return Ok(()) };
        let width_px = f64::from(stroke.width().get()) * place.scale();
        let outline = stroke.dasharray().map_or(outline, |dashes| dashed(outline, dashes, place.scale()));
        let [width, height] = place.size(path.stroke_bounding_box(), place.page);
        let inked = (outline.length_px + (outline.corners + 1.0) * width_px) * width_px;
        let pixels = self.paint(stroke.paint(), place)? * inked.min(width * height);
        self.take(outline.stroke_steps(width_px) + pixels, name)
    }

    /// Returns the steps per pixel for painting with `paint`.
    fn paint(&mut self, paint: &Paint, place: Place) -> Result<f64, TooMuch> {
        match paint {
            Paint::Color(_) => Ok(PLAIN),
            Paint::LinearGradient(_) | Paint::RadialGradient(_) => Ok(GRADIENT),
            Paint::Pattern(pattern) => self.pattern(pattern, place).map(|()| PATTERN),
        }
    }

    fn pattern(&mut self, pattern: &Pattern, place: Place) -> Result<(), TooMuch> {
        let name = named("pattern", pattern.id());
        let (sx, sy) = place.transform.pre_concat(pattern.transform()).get_scale();
        let rect = pattern.rect();
        let page = [f64::from(rect.width() * sx), f64::from(rect.height() * sy)];
        let inside = place.inside(&name)?.with_page(page, 1.0, &name)?;
        self.take(LAYER * page[0] * page[1], || name)?;
        self.nodes(pattern.root(), Place { transform: Transform::from_scale(sx, sy), ..inside })
    }

    fn filter(&mut self, filter: &filter::Filter, place: Place) -> Result<(), TooMuch> {
        let (pixels, scale) = (place.page[0] * place.page[1], place.scale());
        let mut place = place;
        for primitive in filter.primitives() {
            let (kind, weight) = weight(primitive.kind(), scale, place.page);
            let name = format!("{}, {kind}", named("filter", filter.id()));
            // The result of each primitive is held until the filter is done.
            place = place.with_page(place.page, 1.0, &name)?;
            self.take(FILTER * weight * pixels, || name.clone())?;
            if let filter::Kind::Image(image) = primitive.kind() {
                self.nodes(image.root(), place.inside(&name)?)?;
            }
        }
        Ok(())
    }
}

/// Returns the name of a filter primitive, and its cost per pixel relative to a simple one.
fn weight(kind: &filter::Kind, scale: f64, page: [f64; 2]) -> (&'static str, f64) {
    match kind {
        filter::Kind::Turbulence(turbulence) => ("feTurbulence", 4.0 * f64::from(turbulence.num_octaves())),
        filter::Kind::Morphology(morphology) => {
            let radii = [morphology.radius_x(), morphology.radius_y()].map(|radius| f64::from(radius.get()));
            let reach = |axis: usize| (2.0 * radii[axis] * scale + 1.0).min(page[axis]);
            ("feMorphology", 1.0 + reach(0) * reach(1) / 8.0)
        }
        filter::Kind::ConvolveMatrix(convolve) => {
            let cells = f64::from(convolve.matrix().columns()) * f64::from(convolve.matrix().rows());
            ("feConvolveMatrix", 1.0 + cells / 4.0)
        }
        filter::Kind::DiffuseLighting(_) => ("feDiffuseLighting", 9.0),
        filter::Kind::SpecularLighting(_) => ("feSpecularLighting", 9.0),
        filter::Kind::GaussianBlur(_) => ("feGaussianBlur", 4.0),
        filter::Kind::DropShadow(_) => ("feDropShadow", 5.0),
        filter::Kind::Image(_) => ("feImage", 2.0),
        _ => ("a simple part", 1.0),
    }
}

fn named(what: &str, id: &str) -> String {
    if id.is_empty() { format!("a {what} without id") } else { format!("{what} {id:?}") }
}

/// Returns the outline of a path as it is painted. No line counts as longer than the page's width plus its height.
fn outline(path: &Path, place: &Place) -> Outline {
    let (scale, most) = (place.scale(), place.page[0] + place.page[1]);
    let mut outline = Outline { page_height_px: place.page[1], ..Outline::default() };
    let (mut last, mut begin) = (Point::zero(), Point::zero());
    let mut add = |points: &[Point], corners: f64, last: &mut Point| {
        for point in points {
            let length = f64::from(last.distance(*point)) * scale;
            outline.length_px += if length.is_finite() { length.min(most) } else { most };
            *last = *point;
        }
        outline.corners += corners;
    };
    for segment in path.data().segments() {
        match segment {
            PathSegment::MoveTo(to) => (last, begin) = (to, to),
            PathSegment::LineTo(to) => add(&[to], 1.0, &mut last),
            PathSegment::QuadTo(a, to) => add(&[a, to], LINES_OF_CURVE, &mut last),
            PathSegment::CubicTo(a, b, to) => add(&[a, b, to], LINES_OF_CURVE, &mut last),
            PathSegment::Close => add(&[begin], 1.0, &mut last),
        }
    }
    outline
}

/// Returns the outline of a dashed path. The renderer does not dash a line that would have more than a million dashes.
fn dashed(outline: Outline, dashes: &[f32], scale: f64) -> Outline {
    let round_px = dashes.iter().map(|dash| f64::from(*dash)).sum::<f64>() * scale;
    let count = outline.length_px / round_px.max(1e-9) * dashes.len() as f64;
    Outline { corners: outline.corners + 2.0 * count.min(1e6), ..outline }
}

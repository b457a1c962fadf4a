//! A sheet of SVG. It converts coordinates of a frame to units of the sheet, and offers the few shapes that pictures need.

use std::fmt::{Display, Write};

use sketchnav_schemas::geometry::Point;
use sketchnav_schemas::shown::one_line;

/// Colour of text and of outlines.
pub const INK: &str = "#20242c";
/// Colour of goals, the start, and the path of a map.
pub const GREEN: &str = "#1d8a4a";
/// Colour of contacts and recoveries.
pub const RED: &str = "#cf2e2e";
/// Width of a sheet, in its own units.
pub const SHEET_WIDTH: f64 = 1200.0;
/// Maximum height of the view, in units of the sheet.
const MAX_VIEW_HEIGHT: f64 = 1000.0;
/// Height of the space for the heading.
const TITLE_HEIGHT: f64 = 46.0;
/// Width of the empty border.
const MARGIN: f64 = 18.0;
/// Width of the empty border around points, as a share of the longer side of their box.
const BORDER: f64 = 0.04;
/// Minimum distance between successive points of a line. Points that are nearer to the previous one are left out.
const MIN_STEP: f64 = 0.8;

/// How a box of the frame is placed on the sheet. The y axis points up in the frame and down on the sheet.
#[derive(Debug, Clone, Copy)]
pub struct View {
    low: [f64; 2],
    high: [f64; 2],
    /// Units of the sheet per unit of the frame.
    pub scale: f64,
    left: f64,
}

impl View {
    /// Creates a view of the box from `low` to `high` in the frame. `border` is the width of the border, as a share of the longer
    /// side of the box.
    pub fn new(low: [f64; 2], high: [f64; 2], border: f64) -> Self {
        let pad = border * (high[0] - low[0]).max(high[1] - low[1]);
        let (low, high) = ([low[0] - pad, low[1] - pad], [high[0] + pad, high[1] + pad]);
        let (width, height) = (high[0] - low[0], high[1] - low[1]);
        let scale = ((SHEET_WIDTH - 2.0 * MARGIN) / width).min(MAX_VIEW_HEIGHT / height);
        Self { low, high, scale, left: (SHEET_WIDTH - width * scale) / 2.0 }
    }

    /// Creates a view of all finite points, with a small border. If there are none, it shows a few metres around the origin.
    pub fn around<'a, F: 'a>(points: impl Iterator<Item = &'a Point<F>>) -> Self {
        let finite = points.filter(|point| point.x.is_finite() && point.y.is_finite());
        let (low, high) = finite.fold(([f64::MAX; 2], [f64::MIN; 2]), |(low, high), point| {
            ([low[0].min(point.x), low[1].min(point.y)], [high[0].max(point.x), high[1].max(point.y)])
        });
        if low[0] > high[0] { Self::new([-1.0; 2], [1.0; 2], BORDER) } else { Self::new(low, high, BORDER) }
    }

    /// Creates a view as wide as the sheet and of the given height, in units of the sheet.
    pub fn plain(height: f64) -> Self {
        Self { low: [0.0, 0.0], high: [SHEET_WIDTH - 2.0 * MARGIN, height], scale: 1.0, left: MARGIN }
    }

    /// Converts a point in the frame to a position on the sheet.
    pub fn at<F>(&self, p: &Point<F>) -> [f64; 2] {
        let x = self.left + (p.x - self.low[0]) * self.scale;
        [x, TITLE_HEIGHT + (self.high[1] - p.y) * self.scale]
    }

    /// Returns the left edge, top edge, width and height of the view.
    pub fn frame(&self) -> [f64; 4] {
        let (width, height) = (self.high[0] - self.low[0], self.high[1] - self.low[1]);
        [self.left, TITLE_HEIGHT, width * self.scale, height * self.scale]
    }
}

/// Returns a round length: the greatest of 1, 2 and 5 times a power of ten, in metres, that is at most
/// `most_m`.
pub fn round_length(most_m: f64) -> f64 {
    // A tenth is not exact in binary, so allow for rounding errors.
    let most_m = most_m.max(1e-6) * (1.0 + 1e-9);
    let power = most_m.log10().floor() as i32;
    let in_power =
        |digit: f64| if power < 0 { digit / 10_f64.powi(-power) } else { digit * 10_f64.powi(power) };
    [5.0, 2.0, 1.0].map(in_power).into_iter().find(|length_m| *length_m <= most_m).unwrap_or(most_m)
}

/// A sheet to which shapes are added.
#[derive(Debug)]
pub struct Sheet {
    /// How the frame is placed on the sheet.
    pub view: View,
    body: String,
    /// Vertical position of the next row below the picture.
    pub bottom: f64,
}

impl Sheet {
    /// Creates an empty sheet with a heading.
    pub fn new(view: View, title: &str) -> Self {
        let [x, y, width, height] = view.frame();
        let mut sheet = Self { view, body: String::new(), bottom: y + height + MARGIN };
        sheet.text([SHEET_WIDTH / 2.0, 31.0], 21.0, "middle", INK, "600", title);
        sheet.raw(format_args!(
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" rx=\"3\" fill=\"#ffffff\" stroke=\"#d9dde4\"/>"
        ));
        sheet
    }

    /// Adds a shape given as SVG.
    pub fn raw(&mut self, shape: impl Display) {
        self.body.push_str(&format!("{shape}\n"));
    }

    /// Adds a line of text, with `anchor` and `weight` as in SVG.
    pub fn text(&mut self, [x, y]: [f64; 2], size: f64, anchor: &str, fill: &str, weight: &str, text: &str) {
        let text = escape(text);
        self.raw(format_args!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" text-anchor=\"{anchor}\" fill=\"{fill}\" font-weight=\"{weight}\">{text}</text>"
        ));
    }

    /// Adds a PNG that covers the whole view.
    pub fn image(&mut self, png: &[u8]) {
        let [x, y, width, height] = self.view.frame();
        let data = base64(png);
        self.raw(format_args!(
            "<image x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" preserveAspectRatio=\"none\" href=\"data:image/png;base64,{data}\"/>"
        ));
    }

    /// Adds a closed polygon, with SVG attributes as its `style`.
    pub fn polygon<F>(&mut self, corners: &[Point<F>], style: &str) {
        if corners.len() > 2 {
            let path = self.path(corners, 0.0);
            self.raw(format_args!("<path d=\"{path}z\" {style}/>"));
        }
    }

    /// Adds an open line without a fill, with SVG attributes as its `style`.
    pub fn line<F>(&mut self, points: &[Point<F>], style: &str) {
        if points.len() > 1 {
            let path = self.path(points, MIN_STEP);
            self.raw(format_args!(
                "<path d=\"{path}\" fill=\"none\" stroke-linejoin=\"round\" stroke-linecap=\"round\" {style}/>"
            ));
        }
    }

    /// Adds many segments as a single shape.
    pub fn segments<F>(&mut self, segments: &[[Point<F>; 2]], style: &str) {
        let mut path = String::new();
        for [a, b] in segments {
            let ([ax, ay], [bx, by]) = (self.view.at(a), self.view.at(b));
            path.push_str(&format!("M{ax:.1} {ay:.1}L{bx:.1} {by:.1}"));
        }
        self.raw(format_args!("<path d=\"{path}\" fill=\"none\" {style}/>"));
    }

    /// Adds a cross at a point.
    pub fn cross<F>(&mut self, at: &Point<F>, colour: &str) {
        let [x, y] = self.view.at(at).map(|part| part - 9.0);
        self.raw(format_args!(
            "<path d=\"M{x:.1} {y:.1}l18 18m0 -18l-18 18\" stroke=\"{colour}\" stroke-width=\"5\" fill=\"none\"/>"
        ));
    }

    /// Adds a line of text below the view.
    pub fn caption(&mut self, line: &str) {
        self.text([24.0, self.bottom + 12.0], 16.0, "start", INK, "400", line);
        self.bottom += 22.0;
    }

    /// Adds a bar of the given length at the lower right, for frames in metres.
    pub fn scale_bar(&mut self, metres: f64) {
        let [x, y, width, height] = self.view.frame();
        let (right, base, length) = (x + width - 16.0, y + height - 12.0, metres * self.view.scale);
        let left = right - length;
        self.raw(format_args!(
            "<path d=\"M{left:.1} {:.1}v10M{left:.1} {base:.1}H{right:.1}M{right:.1} {:.1}v10\" fill=\"none\" stroke=\"#20242c\" stroke-width=\"2\"/>",
            base - 5.0,
            base - 5.0,
        ));
        self.text([left - 7.0, base + 4.5], 14.0, "end", INK, "500", &format!("{metres} m"));
    }

    /// Returns the whole sheet as SVG.
    pub fn finish(self) -> String {
        let height = self.bottom + MARGIN;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {SHEET_WIDTH:.0} {height:.0}\" width=\"{SHEET_WIDTH:.0}\" height=\"{height:.0}\" font-family=\"Inter, 'Helvetica Neue', Helvetica, Arial, sans-serif\">\n<rect width=\"100%\" height=\"100%\" fill=\"#f7f8fa\"/>\n{}</svg>\n",
            self.body
        )
    }

    /// Returns the path data of a line, leaving out points nearer than `min_step` to the previous one. The last point is always
    /// kept.
    fn path<F>(&self, points: &[Point<F>], min_step: f64) -> String {
        let mut path = String::new();
        let mut last: Option<[f64; 2]> = None;
        for (i, point) in points.iter().enumerate() {
            let [x, y] = self.view.at(point);
            let near = last.is_some_and(|[lx, ly]| (x - lx).hypot(y - ly) < min_step);
            if near && i + 1 < points.len() {
                continue;
            }
            // Writing into a `String` cannot fail.
            let _ = write!(path, "{}{x:.1} {y:.1}", if last.is_none() { 'M' } else { 'L' });
            last = Some([x, y]);
        }
        path
    }
}

/// Replaces the reserved characters of XML in `text` by entities, and removes the characters that XML forbids.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in one_line(text).chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            c => escaped.push(c),
        }
    }
    escaped
}

/// Encodes bytes in base64 (RFC 4648, section 4).
pub fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            let letter = char::from(ALPHABET[(bits >> (18 - 6 * i) & 63) as usize]);
            text.push(if i <= chunk.len() { letter } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_of_scale_bars_are_round() {
        for (most_m, text) in [
            (4.963889603929565, "2"),
            (0.1, "0.1"),
            (0.05, "0.05"),
            (0.099, "0.05"),
            (8.6, "5"),
            (1.0, "1"),
            (30.0, "20"),
        ] {
            assert_eq!(round_length(most_m).to_string(), text);
        }
    }
}

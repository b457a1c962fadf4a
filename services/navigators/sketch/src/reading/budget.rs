//! Limits on the work that a drawing may cause.
//!
//! Drawings are untrusted input, and files of a few lines have kept the sketcher busy for hours or exhausted the memory: a filter
//! with a billion octaves, nested masks, or half a million strokes. All work is therefore estimated in advance, in *steps* of about
//! a nanosecond. Since no clock is involved, a drawing is either accepted on every machine or on none.

/// Maximum number of steps for painting a drawing. A plan of 20,000 strokes takes less than a twentieth of this.
pub(crate) const MOST_STEPS: f64 = 3e9;
/// Maximum number of strokes and obstacles in a drawing. People draw hundreds, and the pad sends at most 4096.
pub(crate) const MOST_STROKES: usize = 20_000;
/// Maximum number of corners of an obstacle. In the worst case, all of its lines cross the same row of pixels.
pub(crate) const MOST_OBSTACLE_CORNERS: usize = 4096;
/// Maximum number of corners of a stroke painted in one piece. Longer strokes are split, because all lines that cross a row of
/// pixels have to be sorted.
pub(crate) const PIECE_CORNERS: usize = 1024;
/// Maximum number of elements in an SVG, counting each reference as what it refers to.
pub(crate) const MOST_ELEMENTS: f64 = 200_000.0;
/// Maximum nesting depth of elements, including references. Each level takes space on the stack.
pub(crate) const MOST_DEPTH: usize = 100;
/// Maximum nesting depth of masks, patterns and clip paths, each of which requires its own page.
pub(crate) const MOST_NESTED: usize = 8;
/// Maximum number of pixels of pages held at the same time: half a gigabyte, as much as a photograph may take.
pub(crate) const MOST_HELD_PX: f64 = 128e6;

/// Steps per corner, which becomes several lines, on both sides of a stroke.
const CORNER_STEPS: f64 = 500.0;
/// Steps per line in a row of pixels, and per other line that it is compared with there.
const ROW_STEPS: f64 = 3.0;

/// The size of a path, in pixels of the page that it is painted on.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Outline {
    /// Number of corners. A curve counts as several.
    pub corners: f64,
    /// Total length of the path's lines.
    pub length_px: f64,
    /// Height of the page.
    pub page_height_px: f64,
}

impl Outline {
    /// Returns the number of steps to fill the path. In each row of pixels, its lines are advanced and sorted.
    pub fn fill_steps(&self) -> f64 {
        let rows = self.length_px + self.corners;
        CORNER_STEPS * self.corners + ROW_STEPS * rows * (1.0 + self.corners / self.page_height_px.max(1.0))
    }

    /// Returns the number of steps to stroke the path, which takes lines on both sides of it and around its corners.
    pub fn stroke_steps(&self, width_px: f64) -> f64 {
        let both = Self {
            corners: 4.0 * self.corners,
            length_px: 2.0 * (self.length_px + self.corners * width_px),
            ..*self
        };
        both.fill_steps()
    }
}

/// A counter of steps.
#[derive(Debug, Default)]
pub(crate) struct Steps(f64);

impl Steps {
    /// Adds to the count. Returns true if the total is still within the limit.
    #[must_use]
    pub fn take(&mut self, steps: f64) -> bool {
        self.0 += steps;
        // False for NaN, too.
        self.0 <= MOST_STEPS
    }
}

/// Returns the limit in words, for error messages.
pub(crate) fn steps_words() -> String {
    format!("{} million steps of painting", MOST_STEPS / 1e6)
}

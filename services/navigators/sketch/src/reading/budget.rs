//! How much work a drawing may be.
//!
//! Drawings come from strangers. A file of a few lines once kept the sketcher busy for hours or filled the memory. It
//! had a filter with a billion octaves, masks in masks, or half a million strokes. So all work is counted before it is
//! done, in *steps* of about a nanosecond. Nothing here depends on a clock: a drawing is taken everywhere or nowhere.

/// Most steps by which a drawing is painted. A plan of 20,000 strokes takes less than a twentieth of them.
pub(crate) const MOST_STEPS: f64 = 3e9;
/// Most strokes and obstacles of a drawing: people draw hundreds, and the pad sends at most 4096.
pub(crate) const MOST_STROKES: usize = 20_000;
/// Most corners of one obstacle, all of which may cross a row of pixels.
pub(crate) const MOST_OBSTACLE_CORNERS: usize = 4096;
/// A longer stroke is painted in pieces of so many corners: a row of pixels sorts those that cross it.
pub(crate) const PIECE_CORNERS: usize = 1024;
/// Most elements of an SVG, where each reference counts as what it refers to.
pub(crate) const MOST_ELEMENTS: f64 = 200_000.0;
/// Elements inside each other, references included: each takes its part of the stack.
pub(crate) const MOST_DEPTH: usize = 100;
/// Masks, patterns and clip paths inside each other: each holds a page of its own.
pub(crate) const MOST_NESTED: usize = 8;
/// Most pixels of pages that are held at the same time: half a gigabyte, as much as a photograph may take.
pub(crate) const MOST_HELD_PX: f64 = 128e6;

/// For a corner: it becomes several lines, on both sides of a stroke.
const CORNER_STEPS: f64 = 500.0;
/// For a line in a row of pixels, and for each other line that it is compared with there.
const ROW_STEPS: f64 = 3.0;

/// What a path is made of, in pixels of the page that it is painted on.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Outline {
    /// Corners; a curve has several.
    pub corners: f64,
    /// Length of all its lines.
    pub length_px: f64,
    /// Height of the page.
    pub page_height_px: f64,
}

impl Outline {
    /// Steps by which the inside of the path is found: for each row its lines are moved on and sorted.
    pub fn fill_steps(&self) -> f64 {
        let rows = self.length_px + self.corners;
        CORNER_STEPS * self.corners + ROW_STEPS * rows * (1.0 + self.corners / self.page_height_px.max(1.0))
    }

    /// The same for its stroke of that width: lines on both sides, and around its corners.
    pub fn stroke_steps(&self, width_px: f64) -> f64 {
        let both = Self {
            corners: 4.0 * self.corners,
            length_px: 2.0 * (self.length_px + self.corners * width_px),
            ..*self
        };
        both.fill_steps()
    }
}

/// The count of the steps.
#[derive(Debug, Default)]
pub(crate) struct Steps(f64);

impl Steps {
    /// Counts them; whether there may be so many.
    #[must_use]
    pub fn take(&mut self, steps: f64) -> bool {
        self.0 += steps;
        // False for NaN, too.
        self.0 <= MOST_STEPS
    }
}

/// What errors say is allowed.
pub(crate) fn steps_words() -> String {
    format!("{} million steps of painting", MOST_STEPS / 1e6)
}

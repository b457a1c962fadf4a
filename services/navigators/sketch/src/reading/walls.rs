//! The walls as they were drawn, before gaps are closed.

use image::GrayImage;

use super::Marks;
use super::labels::Label;
use super::left_out::LeftOut;
use super::pen;
use crate::messages::Origin;

/// Assumed brush width of a filled drawing, which shows no pen, as a share of the diagonal.
const BRUSH_SHARE: f64 = 0.004;

/// The kind of a drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Walls are lines on clean paper.
    Lines,
    /// Free space has one tone, and everything solid has the other.
    Filled,
    /// A map with the tones of map_server, in which everything solid or unknown is filled.
    Surveyed,
    /// Strokes on paper under uneven light.
    Photograph,
    /// A strokes file.
    Strokes,
}

impl Kind {
    /// Returns true if everything solid is filled, so that nothing is drawn with a pen.
    pub fn is_filled(self) -> bool {
        matches!(self, Self::Filled | Self::Surveyed)
    }

    /// Returns where a sketch made from such a drawing comes from.
    pub fn origin(self) -> Origin {
        if self == Self::Surveyed { Origin::Surveyed } else { Origin::Drawn }
    }
}

/// The walls as they were drawn, before gaps are closed.
pub(crate) struct Walls {
    /// 255 where there is a wall, in rows from the bottom up.
    pub mask: GrayImage,
    /// Sketch pixels per image pixel.
    pub scale: f64,
    /// Width of the pen in sketch pixels, if the file states it.
    pub pen_width_px: Option<f64>,
    pub kind: Kind,
    pub marks: Marks,
    pub labels: Vec<Label>,
    /// Content of the file that is not in the mask.
    pub left_out: Vec<LeftOut>,
}

impl Walls {
    /// Returns the width of the strokes, in sketch pixels. For a filled drawing, this is the fineness of its
    /// edges.
    pub fn pen_width(&self) -> f64 {
        let brush = (BRUSH_SHARE * diagonal(self.mask.width(), self.mask.height())).max(1.0);
        match self.kind {
            kind if kind.is_filled() => brush,
            _ => self.pen_width_px.or_else(|| pen::stroke_width(&self.mask)).unwrap_or(brush),
        }
    }
}

/// Returns the length of the diagonal, in pixels.
pub(crate) fn diagonal(width: u32, height: u32) -> f64 {
    f64::from(width).hypot(height.into())
}

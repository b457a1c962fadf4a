//! The walls as they were drawn, before gaps are closed.

use image::GrayImage;

use super::Marks;
use super::left_out::LeftOut;
use super::pen;

/// A filled drawing shows no pen; a slip of the brush is this share of the diagonal.
const BRUSH_SHARE: f64 = 0.004;

/// What kind of drawing it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Walls are lines on clean paper.
    Lines,
    /// Free space is one tone, everything solid the other.
    Filled,
    /// Strokes on paper under uneven light.
    Photograph,
    /// A strokes file.
    Strokes,
}

/// The walls as they were drawn, before gaps are closed.
pub(crate) struct Walls {
    /// 255 where a wall is; rows from the bottom up.
    pub mask: GrayImage,
    /// Sketch pixels an image pixel.
    pub scale: f64,
    /// The pen's width where the file has it, sketch pixels.
    pub pen_width_px: Option<f64>,
    pub kind: Kind,
    pub marks: Marks,
    /// What is in the file and not in the mask.
    pub left_out: Vec<LeftOut>,
}

impl Walls {
    /// Width of the strokes, sketch pixels; of a filled drawing how fine its edges are.
    pub fn pen_width(&self) -> f64 {
        let brush = (BRUSH_SHARE * diagonal(self.mask.width(), self.mask.height())).max(1.0);
        match self.kind {
            Kind::Filled => brush,
            _ => self.pen_width_px.or_else(|| pen::stroke_width(&self.mask)).unwrap_or(brush),
        }
    }
}

/// Length of the diagonal, pixels.
pub(crate) fn diagonal(width: u32, height: u32) -> f64 {
    f64::from(width).hypot(height.into())
}

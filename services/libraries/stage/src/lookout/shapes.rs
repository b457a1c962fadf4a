//! What lookouts draw.

use serde::Serialize;

/// Most points left in a thinned list.
const MAX_POINTS: usize = 256;

/// A thing on the sheet.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "shape", rename_all = "kebab-case")]
pub enum Shape {
    /// A line through points.
    Line {
        /// The points.
        points: Vec<[f64; 2]>,
        /// Its colour.
        color: Color,
        /// How it is drawn.
        stroke: Stroke,
    },
    /// A filled polygon, half transparent.
    Area {
        /// The corners.
        points: Vec<[f64; 2]>,
        /// Its colour.
        color: Color,
    },
    /// Small squares.
    Dots {
        /// Their middles.
        points: Vec<[f64; 2]>,
        /// Their colour.
        color: Color,
    },
    /// Circles.
    Rings {
        /// Their middles.
        points: Vec<[f64; 2]>,
        /// Their colour.
        color: Color,
    },
    /// Filled circles.
    Discs {
        /// Their middles.
        points: Vec<[f64; 2]>,
        /// Their colour.
        color: Color,
    },
    /// Words.
    Text {
        /// Their centre.
        at: [f64; 2],
        /// The words.
        text: String,
        /// Their colour.
        color: Color,
    },
}

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stroke {
    /// An ordinary line.
    Plain,
    /// With gaps.
    Dashed,
    /// Wide.
    Bold,
}

/// A colour of the page's theme, by what it stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Color {
    /// Edges of what a sensor could see.
    Edge,
    /// Words and outlines.
    Ink,
    /// What is in the way.
    Obstacle,
    /// What a sensor sees.
    Scan,
    /// What is remembered.
    Particle,
    /// What the robot is heading for or navigating by.
    Goal,
    /// Where the robot is about to go.
    Plan,
    /// The part of the drawing that it has seen.
    Seen,
    /// The part of the drawing that it could not see.
    Hidden,
}

impl Shape {
    /// A plain line.
    pub fn line(points: impl Into<Vec<[f64; 2]>>, color: Color) -> Self {
        Self::Line { points: points.into(), color, stroke: Stroke::Plain }
    }

    /// The same shape elsewhere: `place` moves each of its points.
    #[must_use]
    pub fn placed(mut self, place: impl Fn([f64; 2]) -> [f64; 2]) -> Self {
        match &mut self {
            Self::Line { points, .. }
            | Self::Area { points, .. }
            | Self::Dots { points, .. }
            | Self::Rings { points, .. }
            | Self::Discs { points, .. } => points.iter_mut().for_each(|at| *at = place(*at)),
            Self::Text { at, .. } => *at = place(*at),
        }
        self
    }
}

/// Every n-th of a list, so that what is sent stays small on a slow link.
pub fn thinned<T>(list: impl ExactSizeIterator<Item = T>) -> impl Iterator<Item = T> {
    let step = list.len().div_ceil(MAX_POINTS).max(1);
    list.step_by(step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_thinned() {
        assert_eq!([256, 257, 1024].map(|count| thinned(0..count).count()), [256, 129, 256]);
    }
}

//! The shapes that lookouts draw.

use serde::Serialize;

/// Maximum number of points that remain in a thinned list.
const MAX_POINTS: usize = 256;

/// A shape on the sheet.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "shape", rename_all = "kebab-case")]
pub enum Shape {
    /// A line through points.
    Line {
        /// Points of the line.
        points: Vec<[f64; 2]>,
        /// Colour of the line.
        color: Color,
        /// Style of the line.
        stroke: Stroke,
    },
    /// A filled, half-transparent polygon.
    Area {
        /// Corners of the polygon.
        points: Vec<[f64; 2]>,
        /// Colour of the polygon.
        color: Color,
    },
    /// Small squares.
    Dots {
        /// Centres of the squares.
        points: Vec<[f64; 2]>,
        /// Colour of the squares.
        color: Color,
    },
    /// Circles.
    Rings {
        /// Centres of the circles.
        points: Vec<[f64; 2]>,
        /// Colour of the circles.
        color: Color,
    },
    /// Filled circles.
    Discs {
        /// Centres of the circles.
        points: Vec<[f64; 2]>,
        /// Colour of the circles.
        color: Color,
    },
    /// A text.
    Text {
        /// Centre of the text.
        at: [f64; 2],
        /// The text itself.
        text: String,
        /// Colour of the text.
        color: Color,
    },
}

/// The style of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stroke {
    /// An ordinary line.
    Plain,
    /// A dashed line.
    Dashed,
    /// A wide line.
    Bold,
}

/// A colour of the page's theme, named after its meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Color {
    /// Edges of a sensor's field of view.
    Edge,
    /// Text and outlines.
    Ink,
    /// Obstacles.
    Obstacle,
    /// Readings of a sensor.
    Scan,
    /// Particles, and other things that are remembered.
    Particle,
    /// Things that the robot is heading for or navigating by.
    Goal,
    /// The path that the robot is about to take.
    Plan,
    /// The part of the drawing that the robot has seen.
    Seen,
    /// The part of the drawing that the robot could not see.
    Hidden,
}

impl Shape {
    /// Creates a plain line.
    pub fn line(points: impl Into<Vec<[f64; 2]>>, color: Color) -> Self {
        Self::Line { points: points.into(), color, stroke: Stroke::Plain }
    }

    /// Maps each point of the shape by `place`.
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

/// Keeps every n-th item of a list, so that few enough remain for messages to stay small on a slow link.
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

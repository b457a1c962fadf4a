//! Finds line segments in an edge picture by the progressive probabilistic Hough transform.
//!
//! Source: Matas, Galambos and Kittler, *Robust detection of lines using the progressive probabilistic Hough transform*,
//! Computer Vision and Image Understanding 78 (2000). Edge pixels vote in random order. As soon as a line has enough votes, the
//! picture is searched along the line. The longest stretch without a wide gap becomes a segment, and its pixels no longer vote.

use std::f64::consts::PI;

use image::GrayImage;
use rand::{Rng, RngExt};

/// Number of line directions in half a turn. They are half a degree apart.
const DIRECTIONS: usize = 360;

/// Criteria for a line.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lines {
    /// Number of votes that start the search along a line.
    pub votes: u32,
    /// Minimum length of a segment, in pixels.
    pub length_px: f64,
    /// Maximum gap within a segment, in pixels.
    pub gap_px: u32,
}

/// A straight piece of an edge, from one of its pixels to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Segment {
    pub from: (i32, i32),
    pub to: (i32, i32),
}

impl Segment {
    fn vector(&self) -> (f64, f64) {
        (f64::from(self.to.0 - self.from.0), f64::from(self.to.1 - self.from.1))
    }

    /// Returns the length in pixels.
    pub fn length(&self) -> f64 {
        let (dx, dy) = self.vector();
        dx.hypot(dy)
    }

    /// Returns the direction from the picture's x axis towards its y axis, in radians. It may point either way along the line.
    pub fn direction(&self) -> f64 {
        let (dx, dy) = self.vector();
        dy.atan2(dx)
    }
}

/// Finds the segments of an edge picture (non-zero pixels are edges).
pub(crate) fn segments(edges: &GrayImage, lines: Lines, rng: &mut impl Rng) -> Vec<Segment> {
    let mut table = Table::new(edges);
    let mut waiting = table.edge_pixels();
    let mut found = Vec::new();
    while !waiting.is_empty() {
        let pixel = waiting.swap_remove(rng.random_range(0..waiting.len()));
        if table.state(pixel) != Some(State::Waiting) {
            continue;
        }
        let (direction, votes) = table.vote(pixel);
        if votes < lines.votes {
            continue;
        }
        let segment = table.longest(pixel, direction, lines.gap_px);
        if segment.length() >= lines.length_px {
            found.push(segment);
        }
    }
    found
}

/// Rounds to the nearest integer, with halves away from zero, for |x| below 2³¹. This avoids `f64::round`, for which older
/// processors have no instruction.
fn rounded(x: f64) -> i32 {
    // The greatest number below one half. Adding one half itself would round this very number up to one.
    (x + 0.499_999_999_999_999_94_f64.copysign(x)) as i32
}

/// The state of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// Not an edge, or part of a line that was already found.
    Gone,
    /// An edge that has not voted yet.
    Waiting,
    /// An edge that has voted.
    Voted,
}

/// The votes, and the pixels that cast them.
struct Table {
    width: i32,
    states: Vec<State>,
    /// Cosine and sine of each direction's normal.
    normals: Vec<(f64, f64)>,
    /// Number of bins per direction, one for each signed distance of a line from the origin.
    distances: usize,
    votes: Vec<u16>,
}

impl Table {
    fn new(edges: &GrayImage) -> Self {
        let state = |&v: &u8| if v > 0 { State::Waiting } else { State::Gone };
        let diagonal = f64::from(edges.width()).hypot(edges.height().into()).ceil() as usize;
        let distances = 2 * diagonal + 3;
        let normal = |i: usize| (i as f64 * PI / DIRECTIONS as f64).sin_cos();
        Self {
            width: edges.width() as i32,
            states: edges.iter().map(state).collect(),
            normals: (0..DIRECTIONS).map(normal).map(|(sin, cos)| (cos, sin)).collect(),
            distances,
            votes: vec![0; DIRECTIONS * distances],
        }
    }

    fn edge_pixels(&self) -> Vec<(i32, i32)> {
        let edges = (0..self.states.len()).filter(|&i| self.states[i] == State::Waiting);
        edges.map(|i| (i as i32 % self.width, i as i32 / self.width)).collect()
    }

    fn index(&self, (x, y): (i32, i32)) -> Option<usize> {
        let within = (0..self.width).contains(&x) && y >= 0;
        let i = within.then(|| y as usize * self.width as usize + x as usize)?;
        (i < self.states.len()).then_some(i)
    }

    fn state(&self, pixel: (i32, i32)) -> Option<State> {
        self.index(pixel).map(|i| self.states[i])
    }

    /// Returns the bin of the line through `pixel` in direction `i`.
    fn bin(&self, pixel: (i32, i32), i: usize) -> usize {
        let (cos, sin) = self.normals[i];
        let distance = f64::from(pixel.0) * cos + f64::from(pixel.1) * sin;
        i * self.distances + (rounded(distance) as isize + self.distances as isize / 2) as usize
    }

    /// Casts the pixel's votes, one for every line through it. Returns the direction with the most votes so far, and how many
    /// it has.
    fn vote(&mut self, pixel: (i32, i32)) -> (usize, u32) {
        let (mut best, mut most) = (0, 0);
        for i in 0..DIRECTIONS {
            let bin = self.bin(pixel, i);
            self.votes[bin] = self.votes[bin].saturating_add(1);
            if self.votes[bin] > most {
                (best, most) = (i, self.votes[bin]);
            }
        }
        if let Some(i) = self.index(pixel) {
            self.states[i] = State::Voted;
        }
        (best, u32::from(most))
    }

    /// Removes a pixel along with its votes.
    fn take(&mut self, pixel: (i32, i32)) {
        let Some(index) = self.index(pixel) else { return };
        if self.states[index] == State::Voted {
            for i in 0..DIRECTIONS {
                let bin = self.bin(pixel, i);
                self.votes[bin] = self.votes[bin].saturating_sub(1);
            }
        }
        self.states[index] = State::Gone;
    }

    /// Returns the stretch of edge pixels through `pixel` in this direction and removes its pixels.
    fn longest(&mut self, pixel: (i32, i32), direction: usize, gap_px: u32) -> Segment {
        let (cos, sin) = self.normals[direction];
        let to = self.follow(pixel, (-sin, cos), gap_px);
        let from = self.follow(pixel, (sin, -cos), gap_px);
        self.take(pixel);
        Segment { from, to }
    }

    /// Returns the last edge pixel before a wide gap, within a corridor three pixels wide. Removes the edge pixels that it
    /// passes.
    fn follow(&mut self, start: (i32, i32), along: (f64, f64), gap_px: u32) -> (i32, i32) {
        let longer = along.0.abs().max(along.1.abs());
        let step = (along.0 / longer, along.1 / longer);
        let across = if along.0.abs() > along.1.abs() { (0, 1) } else { (1, 0) };
        let (mut last, mut gap, mut n) = (start, 0, 1.0);
        while gap <= gap_px {
            let x = (f64::from(start.0) + n * step.0).round() as i32;
            let y = (f64::from(start.1) + n * step.1).round() as i32;
            if self.index((x, y)).is_none() {
                break;
            }
            let mut hit = false;
            for side in [0, -1, 1] {
                let near = (x + side * across.0, y + side * across.1);
                if self.state(near).is_some_and(|state| state != State::Gone) {
                    last = if hit { last } else { near };
                    hit = true;
                    self.take(near);
                }
            }
            gap = if hit { 0 } else { gap + 1 };
            n += 1.0;
        }
        last
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    #[test]
    fn finds_the_sides_of_a_square() {
        let mut edges = GrayImage::new(200, 200);
        for i in 50..150 {
            for (x, y) in [(i, 50), (i, 149), (50, i), (149, i)] {
                edges.put_pixel(x, y, Luma([255]));
            }
        }
        let lines = Lines { votes: 15, length_px: 60.0, gap_px: 3 };
        let mut rng = sketchnav_schemas::seed::stream(1, "test");
        let found = segments(&edges, lines, &mut rng);
        assert_eq!(found.len(), 4, "{found:?}");
        for segment in found {
            let turns = segment.direction() / (PI / 2.0);
            assert!((turns - turns.round()).abs() < 0.03, "{segment:?}");
        }
    }

    #[test]
    fn whole_numbers_are_those_of_the_library() {
        let values =
            (-9000..9000).map(|i| f64::from(i) * 0.25).chain([0.499_999_999_999_999_94, 2.5_f64.next_down()]);
        for x in values {
            assert_eq!(rounded(x), x.round() as i32, "{x}");
            assert_eq!(rounded(-x), (-x).round() as i32, "-{x}");
        }
    }

    #[test]
    fn an_empty_picture_has_no_lines() {
        let lines = Lines { votes: 5, length_px: 5.0, gap_px: 1 };
        let mut rng = sketchnav_schemas::seed::stream(1, "test");
        assert!(segments(&GrayImage::new(30, 30), lines, &mut rng).is_empty());
    }
}

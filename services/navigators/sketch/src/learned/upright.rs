//! How the picture of a learned map is turned for people: its walls run along the edges of the sheet, and it lies like the drawing.
//! The map itself lies as the robot's first heading had it.

use std::f64::consts::{FRAC_PI_2, PI};

use sketchnav_mapping::Cell;

use super::{Learned, LearnedMap};

/// Angles that are tried at first, over a right angle, and then between two of these.
const STEPS: [usize; 2] = [90, 8];

/// A turn of the plane about the origin, counter-clockwise if y points up.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turn {
    /// Its angle, in degrees.
    pub degrees: f64,
    cos: f64,
    sin: f64,
}

impl Turn {
    pub fn new(rad: f64) -> Self {
        Self { degrees: rad.to_degrees(), cos: rad.cos(), sin: rad.sin() }
    }

    /// Returns the turn that puts the map upright: of the four that put its walls along the edges, the nearest to the one that puts
    /// the map on the drawing.
    pub fn upright(learned: &Learned) -> Self {
        let walls_rad = walls_rad(&learned.map);
        let quarters = ((to_drawing_rad(&learned.pairs) + walls_rad) / FRAC_PI_2).round();
        let rad = quarters * FRAC_PI_2 - walls_rad;
        Self::new(rad - 2.0 * PI * (rad / (2.0 * PI)).round())
    }

    /// Turns a position whose y points down.
    pub fn apply_down(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.cos * x + self.sin * y, self.cos * y - self.sin * x]
    }
}

/// Returns the angle by which the map has to be turned to lie like the drawing, as the pairs say altogether (Umeyama 1991), or 0 if
/// they do not say.
fn to_drawing_rad(pairs: &[[f64; 4]]) -> f64 {
    let count = pairs.len().max(1) as f64;
    let mean = |k: usize| pairs.iter().map(|pair| pair[k]).sum::<f64>() / count;
    let means = [0, 1, 2, 3].map(mean);
    let (mut along, mut across) = (0.0, 0.0);
    for pair in pairs {
        let [column, row, x, y] = [0, 1, 2, 3].map(|k| pair[k] - means[k]);
        // Rows run downwards.
        along += x * column - y * row;
        across -= x * row + y * column;
    }
    across.atan2(along)
}

/// Returns the main direction of the walls, from 0 to a right angle: the one along which most wall cells lie in line, or 0 if there
/// are none.
fn walls_rad(map: &LearnedMap) -> f64 {
    let width = map.width.max(1);
    let walls = map.cells.iter().enumerate().filter(|(_, cell)| **cell == Cell::Occupied);
    let walls: Vec<_> = walls.map(|(i, _)| [(i % width) as f64, (i / width) as f64]).collect();
    let mut lines = Lines::of(width + map.height());
    let mut best = (0.0, 0);
    let mut step = FRAC_PI_2;
    for count in STEPS {
        step /= count as f64;
        let (around, half) = (best.0, count as isize / 2);
        for k in -half..=half {
            let rad = around + k as f64 * step;
            let sharpness = lines.sharpness(&walls, rad);
            if sharpness > best.1 {
                best = (rad, sharpness);
            }
        }
    }
    best.0.rem_euclid(FRAC_PI_2)
}

/// Counts the cells on parallel lines that are one cell apart.
struct Lines {
    /// Where the line through the origin is counted.
    middle: f64,
    counts: Vec<u64>,
}

impl Lines {
    /// `reach` is the largest distance from the origin, in cells.
    fn of(reach: usize) -> Self {
        Self { middle: reach as f64 + 1.0, counts: vec![0; 2 * reach + 3] }
    }

    /// Returns the sum of the squared numbers of cells on each line along a direction and on each across it. It is the greater the
    /// fewer lines the cells lie on.
    fn sharpness(&mut self, cells: &[[f64; 2]], rad: f64) -> u64 {
        let (cos, sin) = (rad.cos(), rad.sin());
        let mut on_lines = |[a, b]: [f64; 2]| {
            self.counts.fill(0);
            for [x, y] in cells {
                self.counts[(a * x + b * y + self.middle).round() as usize] += 1;
            }
            self.counts.iter().map(|count| count * count).sum::<u64>()
        };
        on_lines([cos, sin]) + on_lines([-sin, cos])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two walls at a right angle and one across, as thick as a laser sees them.
    fn map(rad: f64) -> LearnedMap {
        let side = 240;
        let (cos, sin) = (rad.cos(), rad.sin());
        let cell = |index: usize| {
            let (x, y) = ((index % side) as f64 - 120.0, (index / side) as f64 - 120.0);
            let [u, v] = [cos * x + sin * y, cos * y - sin * x];
            let is_wall = (v.abs() < 1.0 && u.abs() < 80.0) || ((u - 30.0).abs() < 1.0 && v.abs() < 50.0);
            if is_wall || ((u - v).abs() < 1.0 && u.abs() < 20.0) { Cell::Occupied } else { Cell::Free }
        };
        LearnedMap { origin_m: [0.0; 2], width: side, cells: (0..side * side).map(cell).collect() }
    }

    #[test]
    fn the_main_direction_is_that_of_most_walls() {
        for degrees in [0.0, 3.0, 17.5, 44.0, 61.0, 89.0] {
            let found = walls_rad(&map(f64::to_radians(degrees))).to_degrees();
            let off = (found - degrees + 45.0_f64).rem_euclid(90.0) - 45.0;
            assert!(off.abs() < 0.5, "{degrees}: {found}");
        }
        assert_eq!(walls_rad(&LearnedMap { origin_m: [0.0; 2], width: 1, cells: vec![Cell::Free] }), 0.0);
    }

    #[test]
    fn pairs_say_how_the_drawing_lies() {
        let pairs = |rad: f64| {
            let of = |[x, y]: [f64; 2]| {
                let [u, v] = [rad.cos() * x - rad.sin() * y, rad.sin() * x + rad.cos() * y];
                [300.0 + 40.0 * u, 500.0 - 40.0 * v, x, y]
            };
            [[1.0, 2.0], [4.0, 2.5], [0.0, 7.0]].map(of)
        };
        for degrees in [0.0_f64, 30.0, -100.0, 170.0] {
            assert!((to_drawing_rad(&pairs(degrees.to_radians())).to_degrees() - degrees).abs() < 1e-9);
        }
        assert_eq!(to_drawing_rad(&[]), 0.0);
    }
}

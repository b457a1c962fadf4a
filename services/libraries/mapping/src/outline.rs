//! Outlines of the free space in a drawing, and of the free space that a robot has seen.
//!
//! An outline is closed and runs counter-clockwise. The outline of a drawing is a cyclic sequence of samples,
//! each with the direction of the wall there. The outline of a map is a sequence of *pieces*, which are
//! either pieces of wall or gaps beyond which the robot has not looked. Only the outer border counts, so
//! free-standing objects inside are not part of the outline.

use serde::{Deserialize, Serialize};

use crate::grid::CellGrid;
use crate::region::Region;
use crate::survey::Survey;

/// A point, as x and y.
pub type Place = [f64; 2];

/// Returns the distance between two points.
pub fn distance(a: Place, b: Place) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Maximum number of points kept for a gap.
const GAP_POINTS: usize = 96;

/// The outline of a drawing.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Outline {
    /// Samples at equal distances along the outline.
    pub places: Vec<Place>,
    /// The direction of the outline at each sample, as a unit vector.
    pub directions: Vec<[f64; 2]>,
    /// Length of the outline.
    pub length: f64,
}

impl Outline {
    /// Returns the outline of a connected region as `samples` samples, smoothed by a Gaussian with a standard deviation of
    /// `smoothing` cells.
    pub fn of_region(region: &Region, samples: usize, smoothing: f64) -> Self {
        let border = region.border();
        let middles: Vec<_> = border.iter().map(|at| at.map(|k| k as f64 + 0.5)).collect();
        Self::of_polygon(&smoothed(&middles, smoothing), samples)
    }

    /// Scales the outline by a factor.
    pub fn scale(&mut self, times: f64) {
        self.places.iter_mut().flatten().for_each(|part| *part *= times);
        self.length *= times;
    }

    /// Returns the outline of a closed, counter-clockwise polygon.
    pub fn of_polygon(corners: &[Place], samples: usize) -> Self {
        if corners.is_empty() || samples == 0 {
            return Self::default();
        }
        let closed: Vec<_> = corners.iter().chain(&corners[..1]).copied().collect();
        let along = arc_lengths(&closed);
        let length = along[along.len() - 1];
        let places = resampled(&closed, &along, (0..samples).map(|k| length * k as f64 / samples as f64));
        let directions = (0..samples)
            .map(|k| unit(minus(places[(k + 1) % samples], places[(k + samples - 1) % samples])))
            .collect();
        Self { places, directions, length }
    }
}

/// A piece of the outline that a robot has seen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Piece {
    /// A piece of wall.
    Wall {
        /// Centre of the piece.
        place: Place,
        /// Direction of the wall, as a unit vector.
        direction: [f64; 2],
    },
    /// A gap, as its index in [`SeenOutline::gaps`].
    Gap(u16),
}

/// The outline of the area that a robot has seen, in the map frame.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SeenOutline {
    /// Pieces in order around the region.
    pub pieces: Vec<Piece>,
    /// Points of each gap, in order along the outline.
    pub gaps: Vec<Vec<Place>>,
}

/// Parameters for extracting an outline from a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Taking {
    /// Length of a piece of wall, in metres.
    pub piece_m: f64,
    /// Standard deviation of the Gaussian that smooths the outline, in metres.
    pub smoothing_m: f64,
    /// Maximum distance between an occupied cell and the part of the outline that counts as wall, in metres.
    pub wall_m: f64,
    /// Minimum length of a gap, in metres. A shorter gap between walls counts as wall.
    pub least_gap_m: f64,
    /// Minimum length of a wall, in metres. A shorter wall between gaps counts as part of the gap.
    pub least_wall_m: f64,
    /// Maximum number of pieces.
    pub most_pieces: usize,
}

impl SeenOutline {
    /// Returns the outline of the free space around the robot. Cells near any of the `shut` points also count as wall, which closes
    /// gaps beyond which there turned out to be nothing to see.
    pub fn of_map(survey: &Survey, shut: &[Place], taking: &Taking) -> Self {
        let (grid, border) = (survey.grid(), survey.free().border());
        if border.len() < 8 {
            return Self::default();
        }
        let mut is_wall = walls(grid, &border, shut, taking.wall_m);
        let in_cells = |metres: f64| (metres / grid.cell).round() as usize;
        settle(&mut is_wall, in_cells(taking.least_gap_m), false);
        settle(&mut is_wall, in_cells(taking.least_wall_m), true);
        let place = |at: &[i64; 2]| [0, 1].map(|k| grid.origin[k] + (at[k] as f64 + 0.5) * grid.cell);
        let border: Vec<_> = border.iter().map(place).collect();
        let smooth = smoothed(&border, taking.smoothing_m / grid.cell);
        let mut outline = Self::default();
        for run in runs(&is_wall) {
            let points = |line: &[Place]| run.indices(border.len()).map(|k| line[k]).collect::<Vec<_>>();
            match run.is_set {
                true => outline.add_wall(&points(&smooth), taking),
                false => outline.add_gap(&points(&border), taking),
            }
        }
        outline
    }

    fn add_gap(&mut self, points: &[Place], taking: &Taking) {
        if self.pieces.len() < taking.most_pieces {
            let count = points.len().min(GAP_POINTS);
            let chosen = (0..count).map(|k| points[(2 * k + 1) * points.len() / (2 * count)]);
            self.pieces.push(Piece::Gap(self.gaps.len() as u16));
            self.gaps.push(chosen.collect());
        }
    }

    fn add_wall(&mut self, line: &[Place], taking: &Taking) {
        let along = arc_lengths(line);
        let length = along[along.len() - 1];
        let count = ((length / taking.piece_m).round() as usize).max(1);
        let middle = |k: usize| (k as f64 + 0.5) * length / count as f64;
        let at = |shift: f64| resampled(line, &along, (0..count).map(|k| middle(k) + shift));
        let reach = 0.6 * taking.piece_m;
        let (places, before, after) = (at(0.0), at(-reach), at(reach));
        for k in 0..count.min(taking.most_pieces.saturating_sub(self.pieces.len())) {
            let direction = unit(minus(after[k], before[k]));
            self.pieces.push(Piece::Wall { place: places[k], direction });
        }
    }
}

/// Returns, for each cell of the border, whether it lies near an occupied or shut cell.
fn walls(grid: &CellGrid, border: &[[i64; 2]], shut: &[Place], wall_m: f64) -> Vec<bool> {
    let mut near = grid.occupied.clone();
    for index in shut.iter().filter_map(|place| grid.occupied.index(grid.cell_of(*place))) {
        near.insert(index);
    }
    near.grow((wall_m / grid.cell).round() as usize);
    border.iter().map(|at| near.holds(*at)).collect()
}

/// A stretch of a closed line along which a flag keeps its value.
struct Run {
    first: usize,
    length: usize,
    is_set: bool,
}

impl Run {
    fn indices(&self, count: usize) -> impl Iterator<Item = usize> + use<> {
        let first = self.first;
        (0..self.length).map(move |k| (first + k) % count)
    }
}

fn runs(line: &[bool]) -> Vec<Run> {
    let count = line.len();
    let changes: Vec<_> = (0..count).filter(|&k| line[k] != line[(k + count - 1) % count]).collect();
    if changes.is_empty() {
        return vec![Run { first: 0, length: count, is_set: line[0] }];
    }
    let run = |k: usize| {
        let (first, next) = (changes[k], changes[(k + 1) % changes.len()]);
        Run { first, length: (next + count - first - 1) % count + 1, is_set: line[first] }
    };
    (0..changes.len()).map(run).collect()
}

/// Flips the stretches with the given value that are shorter than `least`.
fn settle(line: &mut [bool], least: usize, value: bool) {
    for run in runs(line) {
        if run.is_set == value && run.length < least {
            run.indices(line.len()).for_each(|k| line[k] = !value);
        }
    }
}

/// Smooths a closed line with a Gaussian, whose standard deviation is given in points of the line.
pub fn smoothed(line: &[Place], deviation: f64) -> Vec<Place> {
    let count = line.len() as i64;
    let half = ((3.0 * deviation) as i64).min((count - 1) / 2);
    if half < 1 {
        return line.to_vec();
    }
    let weight = |k: i64| (-0.5 * (k as f64 / deviation).powi(2)).exp();
    let weights: Vec<_> = (-half..=half).map(weight).collect();
    let sum: f64 = weights.iter().sum();
    let at = |k: i64| {
        let near = weights.iter().zip(k - half..).map(|(w, j)| (w / sum, line[j.rem_euclid(count) as usize]));
        near.fold([0.0; 2], |sum, (w, place)| [sum[0] + w * place[0], sum[1] + w * place[1]])
    };
    (0..count).map(at).collect()
}

/// Returns the length of the line from its start to each of its points.
pub fn arc_lengths(line: &[Place]) -> Vec<f64> {
    let mut so_far = 0.0;
    let steps = line.windows(2).map(|pair| {
        so_far += (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
        so_far
    });
    std::iter::once(0.0).chain(steps).collect()
}

/// Returns the points at increasing distances along a line, whose points lie at the distances `along`. A distance beyond either end
/// yields that end.
pub fn resampled(line: &[Place], along: &[f64], at: impl Iterator<Item = f64>) -> Vec<Place> {
    let mut k = 0;
    at.map(|length| {
        while k + 2 < line.len() && along[k + 1] < length {
            k += 1;
        }
        let Some(next) = line.get(k + 1) else { return line[k] };
        let step = along[k + 1] - along[k];
        let share = if step > 0.0 { ((length - along[k]) / step).clamp(0.0, 1.0) } else { 0.0 };
        [0, 1].map(|axis| line[k][axis] + share * (next[axis] - line[k][axis]))
    })
    .collect()
}

/// Returns the vector from `b` to `a`.
pub fn minus(a: Place, b: Place) -> Place {
    [a[0] - b[0], a[1] - b[1]]
}

/// Returns the unit vector along a vector, or along x if the vector has no length.
pub fn unit(v: Place) -> Place {
    let length = v[0].hypot(v[1]);
    if length > 0.0 { v.map(|part| part / length) } else { [1.0, 0.0] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Cell;

    const TAKING: Taking = Taking {
        piece_m: 0.5,
        smoothing_m: 0.12,
        wall_m: 0.15,
        least_gap_m: 0.36,
        least_wall_m: 0.24,
        most_pieces: 500,
    };

    /// Surveys a room of 4 × 3 m with a door 1 m wide in the right wall, through which the robot has not looked.
    fn room() -> Survey {
        let grid = CellGrid::of([100, 80], 0.05, [0.0, 0.0], |k| {
            let (column, row) = (k % 100, k / 100);
            let is_near = (9..91).contains(&column) && (9..71).contains(&row);
            let is_inside = (10..90).contains(&column) && (10..70).contains(&row);
            let is_door = column == 90 && (30..50).contains(&row);
            match (is_near, is_inside, is_door) {
                (_, true, _) => Cell::Free,
                (true, _, false) => Cell::Occupied,
                _ => Cell::Unknown,
            }
        });
        Survey::of(grid, [2.0, 2.0], 0.5)
    }

    #[test]
    fn a_room_with_a_door_is_walls_and_one_gap() {
        let seen = SeenOutline::of_map(&room(), &[], &TAKING);
        let [gap] = &seen.gaps[..] else { panic!("{} gaps", seen.gaps.len()) };
        assert!(gap.iter().all(|p| (p[0] - 4.475).abs() < 0.01 && (1.5..2.6).contains(&p[1])), "{gap:?}");
        let walls = seen.pieces.iter().filter(|piece| matches!(piece, Piece::Wall { .. })).count();
        assert!((24..=28).contains(&walls), "14 m less the door, by half metres: {walls}");
    }

    #[test]
    fn a_closed_gap_is_wall() {
        let shut: Vec<_> = (28..52).map(|row| [4.475, f64::from(row) * 0.05 + 0.025]).collect();
        let seen = SeenOutline::of_map(&room(), &shut, &TAKING);
        assert!(seen.gaps.is_empty() && seen.pieces.len() > 25);
    }

    #[test]
    fn a_drawings_outline_is_sampled_evenly_and_counter_clockwise() {
        let region = Region::of(120, 80, |k| (10..110).contains(&(k % 120)) && (10..70).contains(&(k / 120)));
        let outline = Outline::of_region(&region, 64, 1.0);
        assert!((outline.length - 316.0).abs() < 8.0, "{}", outline.length);
        let lowest = outline.places.iter().zip(&outline.directions).filter(|(place, _)| place[1] < 10.6);
        assert!(lowest.clone().count() > 15 && lowest.into_iter().all(|(_, direction)| direction[0] > 0.9));
    }

    #[test]
    fn runs_go_round() {
        let found: Vec<_> = runs(&[true, false, false, true]).iter().map(|r| (r.first, r.length)).collect();
        assert_eq!(found, [(1, 2), (3, 2)]);
        let mut line = [true, false, false, true];
        settle(&mut line, 3, false);
        assert_eq!(line, [true; 4]);
    }
}

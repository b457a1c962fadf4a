//! Finds the rigid motion between two maps of the same place, such as those of two drives, with unrelated origins and directions. The
//! maps may overlap only partly, but have the same scale.
//!
//! The directions of the walls determine a few candidates for the rotation (`rotation`; Carpin 2008). For each of them, branch and
//! bound finds the translations by which most walls coincide and the fewest stand in free space (`search`; Hess et al. 2016).
//! The best of these motions are refined by matching one map with the other like a scan ([`matching`](crate::matching)), and are
//! then judged by both maps at full resolution (`agreement`). A motion is only returned if it is clearly better than any other
//! one, because a building that looks the same after half a turn, or a corridor without ends, does not determine it.

mod agreement;
mod rotation;
mod search;

use sketchnav_schemas::geometry::{Pose, wrap_angle};

pub use agreement::Agreement;

use crate::grid::CellGrid;
use crate::matching::field::Field;
use crate::matching::{Matcher, Prior};
use crate::{Map, Parameters};

/// Maximum number of columns and of rows of a map, which bounds the memory. With cells of 0.05 m, it is more than 200 m.
const LONGEST: usize = 4096;
/// Number of motions that are judged at full resolution.
const CANDIDATES: usize = 12;
/// Distance between the places of the map's middle, in metres, and angle, in radians, beyond which two motions are different ones.
const DIFFERENT: (f64, f64) = (1.0, 0.15);
/// Minimum area that both maps show as free, in square metres.
const LEAST_OVERLAP_M2: f64 = 8.0;
/// Minimum length of walls that both maps show, in metres.
const LEAST_WALLS_M: f64 = 12.0;
/// Minimum share of the walls in the overlap that both maps show. Between maps of the same simulated building, it was at least 0.92 for
/// true motions, and at most 0.77 for wrong ones and between maps of different buildings.
const LEAST_SHARE: f64 = 0.85;
/// Maximum score of another motion, relative to the best one.
const MOST_OF_RIVAL: f64 = 0.8;
/// Distance from a candidate, in metres, and angle, in radians, within which it is refined.
const REFINE: (f64, f64) = (0.35, 0.03);
/// Standard deviation of the distance between the same wall in both maps, in metres.
const BLUR_M: f64 = 0.1;
/// Maximum number of wall cells by which a motion is refined.
const REFINE_POINTS: usize = 1000;

/// The motion between two maps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Registration {
    /// The origin of the other map in the first one, in metres and radians.
    pub motion: Pose<Map>,
    /// How well the maps agree.
    pub agreement: Agreement,
    /// Score of the best motion that is clearly another one, relative to the score of this one. It is 0 if no other motion is
    /// possible, and at most 0.8.
    pub rival: f64,
}

/// Why the motion between two maps cannot be determined.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RegistrationError {
    /// A map has too many columns or rows.
    #[error("expected maps of at most {LONGEST} columns and rows, found {0}")]
    TooLong(usize),
    /// A map shows no walls.
    #[error("expected walls in both maps, found none in the {0} one")]
    NoWalls(&'static str),
    /// The maps have too little in common.
    #[error(
        "expected maps that overlap, found at most {:.1} m of walls and {:.1} m² of floor in common, with {:.0} % of the walls \
         there in agreement; at least {LEAST_WALLS_M} m, {LEAST_OVERLAP_M2} m² and {:.0} % are needed",
        .0.wall_m, .0.floor_m2, 100.0 * .0.share(), 100.0 * LEAST_SHARE
    )]
    NoOverlap(Agreement),
    /// Two motions fit about equally well.
    #[error(
        "expected one way to lay the maps on each other, found two that fit about equally well: turned by {:.0}° and moved by \
         ({:.1}, {:.1}) m, and turned by {:.0}° and moved by ({:.1}, {:.1}) m, which fits {:.0} % as well; the place looks alike there",
        .best.yaw_rad.to_degrees(), .best.x, .best.y, .other.yaw_rad.to_degrees(), .other.x, .other.y, 100.0 * .rival
    )]
    Ambiguous {
        /// The motion that fits best.
        best: Pose<Map>,
        /// The other one.
        other: Pose<Map>,
        /// Score of the other one, relative to the best one.
        rival: f64,
    },
}

/// A motion of the other map's points around their middle, in metres and radians. Places are those in the first map, counted from
/// the lower left corner of its grid.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Motion {
    /// Where the middle of the other map's walls is.
    middle: [f64; 2],
    yaw_rad: f64,
}

impl Motion {
    /// Returns the motion as a function of points relative to the middle of the other map's walls.
    fn apply(&self) -> impl Fn([f64; 2]) -> [f64; 2] + use<> {
        let ([x, y], (sin, cos)) = (self.middle, self.yaw_rad.sin_cos());
        move |[px, py]| [x + cos * px - sin * py, y + sin * px + cos * py]
    }

    fn is_same(&self, other: &Self) -> bool {
        let [x, y] = [0, 1].map(|axis| self.middle[axis] - other.middle[axis]);
        x.hypot(y) <= DIFFERENT.0 && wrap_angle(self.yaw_rad - other.yaw_rad).abs() <= DIFFERENT.1
    }
}

/// The walls of a map.
#[derive(Debug)]
struct Walls {
    /// Their middle, in metres, in the frame of the map.
    middle: [f64; 2],
    /// The centres of the occupied cells, in metres, relative to the middle.
    points: Vec<[f64; 2]>,
}

impl Walls {
    fn of(grid: &CellGrid) -> Option<Self> {
        let mut points: Vec<_> = grid.occupied.iter().map(|index| grid.middle(index)).collect();
        let (mut low, mut high) = (*points.first()?, *points.first()?);
        for point in &points {
            for axis in 0..2 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        let middle = [0, 1].map(|axis| 0.5 * (low[axis] + high[axis]));
        points.iter_mut().for_each(|point| *point = [0, 1].map(|axis| point[axis] - middle[axis]));
        Some(Self { middle, points })
    }
}

/// Finds the motion between two maps. Both must have cells of the same length.
///
/// # Errors
/// [`RegistrationError`] if a map has no walls or is too long, if the maps overlap too little, or if several motions fit about equally
/// well.
pub fn register(first: &CellGrid, other: &CellGrid) -> Result<Registration, RegistrationError> {
    let longest = [first, other].map(|map| map.width().max(map.height())).into_iter().max().unwrap_or(0);
    if longest > LONGEST {
        return Err(RegistrationError::TooLong(longest));
    }
    let fixed = Walls::of(first).ok_or(RegistrationError::NoWalls("first"))?;
    let moved = Walls::of(other).ok_or(RegistrationError::NoWalls("second"))?;
    let turns = rotation::candidates(&fixed.points, &moved.points);
    let refiner = &mut Refiner::new(first, &moved);
    let mut found: Vec<(Motion, Agreement)> = Vec::new();
    for rough in search::best(first, &moved.points, &turns, CANDIDATES) {
        let motion = refiner.refine(&rough);
        let agreement = Agreement::of(first, other, &moved, &motion);
        match found.iter_mut().find(|(known, _)| known.is_same(&motion)) {
            Some(known) if known.1.score_m() < agreement.score_m() => *known = (motion, agreement),
            Some(_) => {}
            None => found.push((motion, agreement)),
        }
    }
    // The sort is stable, so motions with the same score stay in the order of the search.
    found.sort_by(|a, b| b.1.score_m().total_cmp(&a.1.score_m()));
    // A motion by which many walls of one map stand in free space of the other is no rival, however long the other walls are.
    let mut possible = found.iter().filter(|(_, agreement)| agreement.is_enough());
    let Some((motion, agreement)) = possible.next() else {
        let best = found.first().map_or_else(Agreement::default, |(_, agreement)| *agreement);
        return Err(RegistrationError::NoOverlap(best));
    };
    let pose = |motion: &Motion| {
        let [x, y] = motion.apply()(moved.middle.map(|at| -at));
        Pose::new(x + first.origin[0], y + first.origin[1], wrap_angle(motion.yaw_rad))
    };
    let other = possible.next();
    let rival = other.map_or(0.0, |(_, other)| other.score_m() / agreement.score_m());
    if let Some((other, _)) = other.filter(|_| rival > MOST_OF_RIVAL) {
        return Err(RegistrationError::Ambiguous { best: pose(motion), other: pose(other), rival });
    }
    Ok(Registration { motion: pose(motion), agreement: *agreement, rival })
}

/// Refines motions.
struct Refiner {
    field: Field,
    matcher: Matcher,
}

impl Refiner {
    fn new(first: &CellGrid, moved: &Walls) -> Self {
        let parameters = Parameters {
            cell_m: first.cell,
            max_points: REFINE_POINTS,
            blur_m: BLUR_M,
            // Many cells show the same wall, but together they outweigh the rough position.
            evidence: 10_000.0,
            window_sigmas: 1.0,
            window_max_m: REFINE.0,
            window_max_rad: REFINE.1,
            ..Parameters::default()
        };
        let size = [first.width(), first.height()];
        let longest_m = first.cell * size[0].max(size[1]) as f64;
        let mut field = Field::new(first.cell, 0.5 * longest_m, BLUR_M);
        let cells = first.occupied.places().map(|at| at.map(|at| at as i32));
        field.rebuild_of(cells, size.map(|cells| cells as i32 / 2));
        let mut matcher = Matcher::new(&parameters);
        let step = moved.points.len().div_ceil(REFINE_POINTS).max(1);
        matcher.set_points(moved.points.iter().copied().step_by(step));
        Self { field, matcher }
    }

    fn refine(&mut self, rough: &Motion) -> Motion {
        let [x, y] = rough.middle;
        let pose = Pose::new(x, y, rough.yaw_rad);
        let prior = Prior { pose, sigma_m: REFINE.0, sigma_rad: REFINE.1 };
        let fit = self.matcher.fit(&self.field, &prior);
        fit.map_or(*rough, |fit| Motion { middle: [fit.pose.x, fit.pose.y], yaw_rad: fit.pose.yaw_rad })
    }
}

#[cfg(test)]
mod tests;

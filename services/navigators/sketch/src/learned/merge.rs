//! Merges a learned map with what was seen on a drive in it. Both maps have the same scale, so a single motion transforms one into
//! the other. If a cell is known in both, that of the newer map is used.

use sketchnav_mapping::{Cell, Map};
use sketchnav_schemas::geometry::Pose;
use sketchnav_schemas::message::MAX_TASKS;

use super::learner::LearnError;
use super::{CELL_M, CELLS_PER_M, Goal, Learned, LearnedMap, MAX_PAIRS};
use crate::messages::MAX_SKETCH_CELLS;

/// Maximum distance, in metres, between two poses of the robot that agree.
const AGREE_M: f64 = 0.4;
/// Maximum difference between their headings, in radians.
const AGREE_RAD: f64 = 0.2;

/// Returns the origin of the newer map in the older one, from the robot's poses in both. A robot that is still localizing itself
/// may be wrong for a while, so the motion is the mean over the largest set of poses that agree. Returns `None` if fewer than two
/// do.
pub fn motion(poses: &[(Pose<Map>, Pose<Map>)]) -> Option<Pose<Map>> {
    let agree = |motion: &Pose<Map>, (seen, known): &(Pose<Map>, Pose<Map>)| {
        let off = known.motion_to(&motion.compose(seen));
        off.x.hypot(off.y) <= AGREE_M && off.yaw_rad.abs() <= AGREE_RAD
    };
    let supporters = |motion: &Pose<Map>| poses.iter().filter(|pair| agree(motion, pair)).count();
    let candidates = poses.iter().map(|(seen, known)| motion_between(seen, known));
    let best = candidates.max_by_key(|motion| supporters(motion))?;
    let agreed: Vec<_> = poses.iter().filter(|pair| agree(&best, pair)).collect();
    (agreed.len() >= 2).then(|| mean_motion(&agreed))
}

/// Returns the motion from the pose `seen` to `known`.
fn motion_between(seen: &Pose<Map>, known: &Pose<Map>) -> Pose<Map> {
    let back = seen.motion_to(&Pose::new(0.0, 0.0, 0.0));
    known.compose(&back)
}

/// Returns the motion from the places of one map to those of the other with the least squared error (Arun, Huang, Blostein 1987, in
/// the plane).
fn mean_motion(pairs: &[&(Pose<Map>, Pose<Map>)]) -> Pose<Map> {
    let count = pairs.len() as f64;
    let mean =
        |of: fn(&(Pose<Map>, Pose<Map>)) -> f64| pairs.iter().map(|pair| of(pair)).sum::<f64>() / count;
    let (seen, known) = ([mean(|p| p.0.x), mean(|p| p.0.y)], [mean(|p| p.1.x), mean(|p| p.1.y)]);
    let (mut along, mut across) = (0.0, 0.0);
    for (from, to) in pairs {
        let ([px, py], [qx, qy]) = ([from.x - seen[0], from.y - seen[1]], [to.x - known[0], to.y - known[1]]);
        along += px * qx + py * qy;
        across += px * qy - py * qx;
    }
    let yaw_rad = across.atan2(along);
    let (sin, cos) = yaw_rad.sin_cos();
    Pose::new(known[0] - cos * seen[0] + sin * seen[1], known[1] - sin * seen[0] - cos * seen[1], yaw_rad)
}

impl Learned {
    /// Returns the same with another map in the same frame, and with the goals of a later drive. Known goals are kept unless the
    /// robot had not arrived there.
    pub fn with(&self, map: LearnedMap, later: impl IntoIterator<Item = Goal>) -> Self {
        let mut goals = self.goals.clone();
        for goal in later {
            match goals.iter_mut().find(|known| known.is_at(goal.at)) {
                Some(known) if !known.reached => *known = goal,
                Some(_) => {}
                None => goals.push(goal),
            }
        }
        goals.drain(..goals.len().saturating_sub(MAX_TASKS));
        let new = goals.iter().filter(|goal| !self.goals.contains(goal));
        let new = new.filter_map(|goal| Some([goal.at[0], goal.at[1], goal.at_m?[0], goal.at_m?[1]]));
        let pairs = self.pairs.iter().copied().chain(new).take(MAX_PAIRS).collect();
        Self { map, goals, pairs, ..self.clone() }
    }
}

impl LearnedMap {
    /// Returns the position in metres of a place of the map as a drawing, in pixels of the frame `Sketch`.
    pub fn of_drawn(&self, px: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| self.origin_m[axis] + px[axis] * CELL_M)
    }

    /// Returns the place of the map as a drawing, in pixels of the frame `Sketch`, of a position in metres.
    pub fn to_drawn(&self, at_m: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| (at_m[axis] - self.origin_m[axis]) * CELLS_PER_M)
    }

    /// Returns this map with the known cells of `newer`. `motion` is the origin of `newer` in this map.
    ///
    /// # Errors
    /// [`LearnError::TooLarge`] if the map would have too many cells.
    pub fn updated_by(&self, newer: &Self, motion: &Pose<Map>) -> Result<Self, LearnError> {
        self.with_cells_of(newer, motion, |own, newer| if newer == Cell::Unknown { own } else { newer })
    }

    /// Returns this map with those cells of `other` that are unknown in it. `motion` is the origin of `other` in this map.
    ///
    /// # Errors
    /// [`LearnError::TooLarge`] if the map would have too many cells.
    pub fn extended_by(&self, other: &Self, motion: &Pose<Map>) -> Result<Self, LearnError> {
        self.with_cells_of(other, motion, |own, other| if own == Cell::Unknown { other } else { own })
    }

    /// Returns the area of both maps, where `choose` selects between the cell of this map and that of the other.
    fn with_cells_of(
        &self,
        other: &Self,
        motion: &Pose<Map>,
        choose: impl Fn(Cell, Cell) -> Cell,
    ) -> Result<Self, LearnError> {
        let (low, size) = self.bounds_with(other, motion);
        if size[0] * size[1] > MAX_SKETCH_CELLS {
            return Err(LearnError::TooLarge(size[0] * size[1]));
        }
        let cell = |index: usize| {
            let steps = [low[0] + (index % size[0]) as i64, low[1] + (index / size[0]) as i64];
            let at = [0, 1].map(|axis| self.origin_m[axis] + (steps[axis] as f64 + 0.5) * CELL_M);
            let seen = motion.motion_to(&Pose::new(at[0], at[1], 0.0));
            choose(self.at_m(at), other.at_m([seen.x, seen.y]))
        };
        let cells = (0..size[0] * size[1]).map(cell).collect();
        let origin_m = [0, 1].map(|axis| self.origin_m[axis] + low[axis] as f64 * CELL_M);
        Ok(Self { origin_m, width: size[0], cells })
    }

    /// Returns the lower left cell, relative to this map's, and the size of a map that contains both.
    fn bounds_with(&self, newer: &Self, motion: &Pose<Map>) -> ([i64; 2], [usize; 2]) {
        let (mut low, mut high) = ([0; 2], [self.width as i64, self.height() as i64]);
        let sides = [newer.width, newer.height()].map(|cells| cells as f64 * CELL_M);
        for (right, up) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let [x, y] = [newer.origin_m[0] + right * sides[0], newer.origin_m[1] + up * sides[1]];
            let corner = motion.compose(&Pose::<Map>::new(x, y, 0.0));
            for (axis, at) in [corner.x, corner.y].into_iter().enumerate() {
                let cells = (at - self.origin_m[axis]) * CELLS_PER_M;
                low[axis] = low[axis].min(cells.floor() as i64);
                high[axis] = high[axis].max(cells.ceil() as i64);
            }
        }
        (low, [0, 1].map(|axis| (high[axis] - low[axis]) as usize))
    }
}

//! Combines what was learned on drives by different drawings of one place. Each drive has a map of its own, and each drawing
//! corresponds to the map of its drive. Since all these maps have the same scale, a single motion leads from one to the other, and
//! with it everything that was learned in the other map.

use sketchnav_mapping::registration::{Agreement, RegistrationError, register};
use sketchnav_mapping::{Cell, CellGrid, Map};
use sketchnav_schemas::geometry::Pose;
use sketchnav_schemas::message::MAX_TASKS;
use sketchnav_schemas::nearest::folded;

use super::learner::LearnError;
use super::{CELL_M, FARTHEST, Goal, Learned, LearnedMap, MAX_PAIRS, rounded};
use sketchnav_mapping::outline::distance;

/// Maximum distance, in metres, between two goals with the same name that are the same goal.
const SAME_GOAL_M: f64 = 1.0;

/// What one learned map has gained from another.
#[derive(Debug, Clone, PartialEq)]
pub struct Gain {
    /// The origin of the other map in this one, in metres and radians.
    pub motion: Pose<Map>,
    /// How well the maps agree.
    pub agreement: Agreement,
    /// How well the best other motion fits, relative to this one, from 0 to 1.
    pub rival: f64,
    /// Area of the floor that only the other drive saw, in square metres.
    pub floor_m2: f64,
    /// Names of the goals that were added.
    pub goals: Vec<String>,
    /// Names of the goals that were left out, because a learned map has room for 64.
    pub left_out: Vec<String>,
}

/// Why two learned maps cannot be combined.
#[derive(Debug, thiserror::Error)]
pub enum CombineError {
    /// How one map lies in the other cannot be determined.
    #[error(transparent)]
    Registration(#[from] RegistrationError),
    /// The combined map would be too large.
    #[error(transparent)]
    TooLarge(#[from] LearnError),
}

impl Learned {
    /// Returns this with everything that only the drive of `other` saw, and with its goals. The result belongs to the drawing of
    /// this one, and what both drives saw remains as this one has it.
    ///
    /// Places that were learned by another drawing are converted to the map by the correspondence of that drawing, and from there
    /// to this drawing by its own. Corresponding places are only taken over from the same drawing.
    ///
    /// # Errors
    /// [`CombineError`] if the maps overlap too little, if they fit each other in several ways, or if the result would have too
    /// many cells.
    pub fn combined_with(&self, other: &Self) -> Result<(Self, Gain), CombineError> {
        let found = register(&self.map.grid(), &other.map.grid())?;
        let map = self.map.extended_by(&other.map, &found.motion)?;
        let in_map = |at: [f64; 2]| {
            let moved = found.motion.compose(&Pose::<Map>::new(at[0], at[1], 0.0));
            [moved.x, moved.y].map(|m| rounded(m, 1e3))
        };
        let (new, left_out) = self.goals_of(other, in_map);
        let gain = Gain {
            motion: found.motion,
            agreement: found.agreement,
            rival: found.rival,
            floor_m2: (map.free_cells() - self.map.free_cells()) as f64 * CELL_M * CELL_M,
            goals: new.iter().map(|goal| goal.task.clone()).collect(),
            left_out,
        };
        let is_same = self.drawing.is_same(&other.drawing);
        let theirs = other
            .pairs
            .iter()
            .filter(|_| is_same)
            .map(|&[column, row, x, y]| ([column, row], in_map([x, y])));
        let theirs = theirs
            .filter(|(_, at_m)| self.map.at_m(*at_m) == Cell::Unknown)
            .map(|([column, row], [x, y])| [column, row, x, y]);
        let pairs = self.pairs.iter().copied().chain(theirs).take(MAX_PAIRS).collect();
        let goals = self.goals.iter().cloned().chain(new).collect();
        Ok((Self { map, pairs, goals, ..self.clone() }, gain))
    }

    /// Returns the goals at which the robot of the other drive arrived and that are not known yet, and the names of those for which
    /// there is no room. `in_map` converts places from the other map to this one.
    fn goals_of(&self, other: &Self, in_map: impl Fn([f64; 2]) -> [f64; 2]) -> (Vec<Goal>, Vec<String>) {
        let is_same_drawing = self.drawing.is_same(&other.drawing);
        let to_drawing = self.to_map().inverse();
        let new = other.goals.iter().filter_map(|goal| {
            let at_m = in_map(goal.at_m?);
            let at = if is_same_drawing {
                goal.at
            } else {
                to_drawing.apply(at_m).map(|[column, up]| [column, -up].map(|px| rounded(px, 100.0)))?
            };
            let is_known = |known: &Goal| {
                let is_near = known.at_m.is_some_and(|known| distance(known, at_m) <= SAME_GOAL_M);
                is_near && folded(&known.task) == folded(&goal.task)
            };
            let is_new = at.iter().all(|px| px.abs() <= FARTHEST) && !self.goals.iter().any(is_known);
            is_new.then(|| Goal { at, at_m: Some(at_m), ..goal.clone() })
        });
        let mut new: Vec<_> = new.collect();
        let room = MAX_TASKS.saturating_sub(self.goals.len()).min(new.len());
        let left_out = new.split_off(room).into_iter().map(|goal| goal.task).collect();
        (new, left_out)
    }
}

impl LearnedMap {
    fn grid(&self) -> CellGrid {
        CellGrid::of([self.width, self.height()], CELL_M, self.origin_m, |index| self.cells[index])
    }
}

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
    /// Names of the goals that were left out, because a learned map has room for 64 or because their place in the drawing is unknown.
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
    /// Returns this map, extended by everything that only the drive of `other` saw and by the goals that its robot reached. The
    /// result belongs to the drawing of this one, and what both drives saw remains as this one has it.
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
        let Goals { all, added, left_out } = self.goals_with(other, in_map);
        let gain = Gain {
            motion: found.motion,
            agreement: found.agreement,
            rival: found.rival,
            floor_m2: (map.free_cells() - self.map.free_cells()) as f64 * CELL_M * CELL_M,
            goals: added,
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
        Ok((Self { map, pairs, goals: all, ..self.clone() }, gain))
    }

    /// Returns the goals of both drives. A goal of the other drive counts if its robot arrived there, and replaces a goal of the same
    /// name at the same place at which only that robot arrived. `in_map` converts places from the other map to this one.
    fn goals_with(&self, other: &Self, in_map: impl Fn([f64; 2]) -> [f64; 2]) -> Goals {
        let is_same_drawing = self.drawing.is_same(&other.drawing);
        let (to_map, to_drawing) = (self.to_map(), self.to_map().inverse());
        let mut goals = Goals { all: self.goals.clone(), added: Vec::new(), left_out: Vec::new() };
        for goal in &other.goals {
            let Some(at_m) = goal.at_m.map(&in_map) else { continue };
            let is_here = |known: &Goal| {
                let known_m = known.at_m.or_else(|| to_map.apply([known.at[0], -known.at[1]]));
                let is_near = known_m.is_some_and(|known| distance(known, at_m) <= SAME_GOAL_M);
                is_near && folded(&known.task) == folded(&goal.task)
            };
            let at = match is_same_drawing {
                true => Some(goal.at),
                false => {
                    to_drawing.apply(at_m).map(|[column, up]| [column, -up].map(|px| rounded(px, 100.0)))
                }
            };
            let at = at.filter(|at| at.iter().all(|px| px.abs() <= FARTHEST));
            match goals.all.iter_mut().find(|known| is_here(known)) {
                Some(known) if known.at_m.is_some() => continue,
                Some(known) => *known = Goal { at: known.at, at_m: Some(at_m), ..goal.clone() },
                None => {
                    let Some(at) = at.filter(|_| goals.all.len() < MAX_TASKS) else {
                        goals.left_out.push(goal.task.clone());
                        continue;
                    };
                    goals.all.push(Goal { at, at_m: Some(at_m), ..goal.clone() });
                }
            }
            goals.added.push(goal.task.clone());
        }
        goals
    }
}

/// The goals of two drives.
struct Goals {
    all: Vec<Goal>,
    /// Names of those at which only the robot of the other drive arrived.
    added: Vec<String>,
    left_out: Vec<String>,
}

impl LearnedMap {
    fn grid(&self) -> CellGrid {
        CellGrid::of([self.width, self.height()], CELL_M, self.origin_m, |index| self.cells[index])
    }
}

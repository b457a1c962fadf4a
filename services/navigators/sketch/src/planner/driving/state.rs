//! The state that the driver keeps from step to step, for checkpoints.
//!
//! The cost field is not part of the state, because it is large and can be recomputed from the drawing, the goal and the blockages.
//! The local planner's results are only needed within a step, except for the free space.

use crate::paths::chart::Chart;
use crate::paths::route::DrawnRoute;
use serde::{Deserialize, Serialize};
use sketchnav_motion::local;
use sketchnav_motion::obstacles::Obstacles;
use sketchnav_motion::pursuit::Pursuit;
use sketchnav_schemas::geometry::{Odom, Point, Sketch};

use super::super::explorer::{self, Explorer};
use super::finding::Finding;
use super::{Attempt, Driver, MAX_BLOCKAGES, Solved};

/// The driver's state, as read back from a checkpoint.
#[derive(Debug, Clone, Deserialize)]
pub struct State {
    obstacles: Obstacles,
    local: local::State,
    pursuit: Pursuit,
    route: DrawnRoute,
    attempt: Attempt,
    solved: Option<Solved>,
    global_path: Vec<Point<Sketch>>,
    local_path: Vec<Point<Odom>>,
    chart: Option<Chart>,
    planned: bool,
    explorer: Option<explorer::State>,
    finding: Option<Finding>,
}

/// A [`State`] by reference, for writing it without a copy. It has the same fields in the same order, and therefore the same
/// serialized form.
#[derive(Debug, Serialize)]
pub struct StateView<'a> {
    obstacles: &'a Obstacles,
    local: local::StateView<'a>,
    pursuit: &'a Pursuit,
    route: &'a DrawnRoute,
    attempt: &'a Attempt,
    solved: Option<Solved>,
    global_path: &'a [Point<Sketch>],
    local_path: &'a [Point<Odom>],
    chart: Option<Chart>,
    planned: bool,
    explorer: Option<explorer::StateView<'a>>,
    finding: Option<Finding>,
}

impl Driver {
    /// Returns the driver's state without copying it.
    pub fn state(&self) -> StateView<'_> {
        StateView {
            obstacles: &self.obstacles,
            local: self.local.state(),
            pursuit: &self.pursuit,
            route: &self.route,
            attempt: &self.attempt,
            solved: self.solved,
            global_path: &self.global_path,
            local_path: &self.local_path,
            chart: self.chart,
            planned: self.planned,
            explorer: self.explorer.as_ref().map(Explorer::state),
            finding: self.finding,
        }
    }

    /// Restores the state of a driver with the same drawing and parameters. Memory is reserved for everything that can grow, so
    /// that driving does not allocate afterwards.
    pub fn restore(&mut self, state: State) {
        let State { obstacles, local, pursuit, route, attempt, solved, chart, planned, .. } = state;
        (self.obstacles, self.pursuit, self.route, self.attempt) = (obstacles, pursuit, route, attempt);
        (self.solved, self.chart, self.planned) = (solved, chart, planned);
        self.finding = state.finding;
        self.local.restore(local);
        self.route.reserve();
        self.attempt.blocked.reserve(MAX_BLOCKAGES);
        refill(&mut self.global_path, &state.global_path);
        refill(&mut self.local_path, &state.local_path);
        self.solve_again();
        if let (Some(explorer), Some(state)) = (&mut self.explorer, state.explorer) {
            explorer.restore(state);
        }
    }
}

fn refill<T: Copy>(room: &mut Vec<T>, with: &[T]) {
    room.clear();
    room.extend_from_slice(with);
}

//! What the driver remembers from step to step, for a checkpoint.
//!
//! The cost field is large and follows from the drawing, the goal and the blockages: it is solved
//! again. What the local planner found is used up within the step, except for where there is room.

use crate::planning::chart::Chart;
use crate::planning::route::DrawnRoute;
use serde::{Deserialize, Serialize};
use sketchnav_motion::local;
use sketchnav_motion::obstacles::Obstacles;
use sketchnav_motion::pursuit::Pursuit;
use sketchnav_schemas::geometry::{Odom, Point, Sketch};

use super::super::explorer::{self, Explorer};
use super::{Attempt, Driver, MAX_BLOCKAGES, Solved};

/// The driver's state, as it is read back.
#[derive(Debug, Clone, Deserialize)]
pub struct Memory {
    obstacles: Obstacles,
    local: local::Memory,
    pursuit: Pursuit,
    route: DrawnRoute,
    attempt: Attempt,
    solved: Option<Solved>,
    global_path: Vec<Point<Sketch>>,
    local_path: Vec<Point<Odom>>,
    chart: Option<Chart>,
    planned: bool,
    explorer: Option<explorer::Memory>,
}

/// The same where it lies, to be written: field by field a [`Memory`].
#[derive(Debug, Serialize)]
pub struct MemoryView<'a> {
    obstacles: &'a Obstacles,
    local: local::MemoryView<'a>,
    pursuit: &'a Pursuit,
    route: &'a DrawnRoute,
    attempt: &'a Attempt,
    solved: Option<Solved>,
    global_path: &'a [Point<Sketch>],
    local_path: &'a [Point<Odom>],
    chart: Option<Chart>,
    planned: bool,
    explorer: Option<explorer::MemoryView<'a>>,
}

impl Driver {
    /// What it remembers; nothing is copied.
    pub fn memory(&self) -> MemoryView<'_> {
        MemoryView {
            obstacles: &self.obstacles,
            local: self.local.memory(),
            pursuit: &self.pursuit,
            route: &self.route,
            attempt: &self.attempt,
            solved: self.solved,
            global_path: &self.global_path,
            local_path: &self.local_path,
            chart: self.chart,
            planned: self.planned,
            explorer: self.explorer.as_ref().map(Explorer::memory),
        }
    }

    /// Goes on from the memory of a driver with the same drawing and parameters. Whatever grew before
    /// has its room again, so that driving on allocates nothing.
    pub fn restore(&mut self, memory: Memory) {
        let Memory { obstacles, local, pursuit, route, attempt, solved, chart, planned, .. } = memory;
        (self.obstacles, self.pursuit, self.route, self.attempt) = (obstacles, pursuit, route, attempt);
        (self.solved, self.chart, self.planned) = (solved, chart, planned);
        self.local.restore(local);
        self.route.reserve();
        self.attempt.blocked.reserve(MAX_BLOCKAGES);
        refill(&mut self.global_path, &memory.global_path);
        refill(&mut self.local_path, &memory.local_path);
        self.solve_again();
        if let (Some(explorer), Some(memory)) = (&mut self.explorer, memory.explorer) {
            explorer.restore(memory);
        }
    }
}

fn refill<T: Copy>(room: &mut Vec<T>, with: &[T]) {
    room.clear();
    room.extend_from_slice(with);
}

//! The part of a map that is free around the robot.

use crate::Parameters;
use crate::grid::CellGrid;
use crate::occupancy::Occupancy;
use crate::outline::Place;
use crate::region::Region;

/// Room for the stretches of free cells that are still to be visited.
const WAITING: usize = 1 << 14;

/// The map as a grid, and the free part of it that is connected to the robot's place.
#[derive(Debug, Clone, Default)]
pub struct Survey {
    grid: CellGrid,
    free: Region,
    /// Working memory.
    closed: Region,
    waiting: Vec<usize>,
}

impl Survey {
    /// An empty survey with room for any map with these parameters: [`Self::take`] allocates nothing.
    pub fn with_room(parameters: &Parameters) -> Self {
        let side = parameters.cells_per_side();
        let region = || Region::with_room(side, side);
        let grid = CellGrid { free: region(), occupied: region(), ..CellGrid::default() };
        Self { grid, free: region(), closed: region(), waiting: Vec::with_capacity(WAITING) }
    }

    /// Surveys a grid for a robot that is at most `within_m` away from free cells.
    pub fn of(grid: CellGrid, robot: Place, within_m: f64) -> Self {
        let mut survey = Self { grid, ..Self::default() };
        survey.look(robot, within_m);
        survey
    }

    /// Surveys a map.
    pub fn take(&mut self, map: &Occupancy, robot: Place, within_m: f64) {
        map.write(&mut self.grid);
        self.look(robot, within_m);
    }

    /// The map: the rectangle around all that has been seen.
    pub fn grid(&self) -> &CellGrid {
        &self.grid
    }

    /// The free part that is connected to the robot's place, with slits one cell wide between beams closed. Empty if the robot's
    /// place is not free.
    pub fn free(&self) -> &Region {
        &self.free
    }

    fn look(&mut self, robot: Place, within_m: f64) {
        let CellGrid { cell, origin, free, occupied } = &self.grid;
        self.closed.copy_from(free);
        self.closed.grow(1);
        self.closed.shrink(1);
        self.closed.subtract(occupied);
        let at = [0, 1].map(|k| (robot[k] - origin[k]) / cell);
        match self.closed.nearest(at, within_m / cell) {
            Some(seed) => self.closed.move_connected(seed, &mut self.free, &mut self.waiting),
            None => self.free.reset(free.width(), free.height()),
        }
    }
}

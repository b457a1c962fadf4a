//! What of a map is free around the robot.

use crate::Parameters;
use crate::grid::CellGrid;
use crate::occupancy::Occupancy;
use crate::outline::Place;
use crate::region::Region;

/// Room for parts of what is free that wait to be looked at.
const WAITING: usize = 1 << 14;

/// The map as a grid, and what of it is free and hangs together with the robot's place.
#[derive(Debug, Clone, Default)]
pub struct Survey {
    grid: CellGrid,
    free: Region,
    /// Working memory.
    closed: Region,
    waiting: Vec<usize>,
}

impl Survey {
    /// Of nothing, with room for a map of these parameters: to take it allocates nothing.
    pub fn with_room(parameters: &Parameters) -> Self {
        let side = parameters.cells_per_side();
        let region = || Region::with_room(side, side);
        let grid = CellGrid { free: region(), occupied: region(), ..CellGrid::default() };
        Self { grid, free: region(), closed: region(), waiting: Vec::with_capacity(WAITING) }
    }

    /// Of a grid, for a robot that stands at most `within_m` from what is free.
    pub fn of(grid: CellGrid, robot: Place, within_m: f64) -> Self {
        let mut survey = Self { grid, ..Self::default() };
        survey.look(robot, within_m);
        survey
    }

    /// Takes it of a map.
    pub fn take(&mut self, map: &Occupancy, robot: Place, within_m: f64) {
        map.write(&mut self.grid);
        self.look(robot, within_m);
    }

    /// The map: the rectangle of all that was seen.
    pub fn grid(&self) -> &CellGrid {
        &self.grid
    }

    /// What of it is free and hangs together with the robot's place: slits a cell wide between beams are closed. Empty where
    /// the robot stands in nothing that is free.
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

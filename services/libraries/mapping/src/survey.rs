//! Finds the free space around the robot in a map.

use crate::Parameters;
use crate::grid::CellGrid;
use crate::occupancy::Occupancy;
use crate::outline::Place;
use crate::region::Region;

/// Number of waiting stretches of a flood fill for which memory is reserved.
const WAITING: usize = 1 << 14;

/// Maximum distance, in metres, of a robot from the free part of its own map. Since a laser does not see the floor that the robot
/// stands on, the nearest free cells may be some distance away.
pub const OFF_FREE_M: f64 = 0.6;

/// The map as a grid, and the free space connected to the robot's position.
#[derive(Debug, Clone, Default)]
pub struct Survey {
    grid: CellGrid,
    free: Region,
    /// Working memory for closing slits in the free space.
    closed: Region,
    waiting: Vec<usize>,
}

impl Survey {
    /// Creates an empty survey with room for any map with the given parameters, so that [`Self::take`] does not allocate.
    pub fn with_room(parameters: &Parameters) -> Self {
        let side = parameters.cells_per_side();
        let region = || Region::with_room(side, side);
        let grid = CellGrid { free: region(), occupied: region(), ..CellGrid::default() };
        Self { grid, free: region(), closed: region(), waiting: Vec::with_capacity(WAITING) }
    }

    /// Surveys a grid around a robot, which must be at most `within_m` away from the nearest free cell. If it is farther away, no
    /// cell counts as free.
    pub fn of(grid: CellGrid, robot: Place, within_m: f64) -> Self {
        let mut survey = Self { grid, ..Self::default() };
        survey.look(robot, within_m);
        survey
    }

    /// Replaces the survey by one of a map, around a robot that must be at most `within_m` away from the nearest free cell. If it
    /// is farther away, no cell counts as free.
    pub fn take(&mut self, map: &Occupancy, robot: Place, within_m: f64) {
        map.write(&mut self.grid);
        self.look(robot, within_m);
    }

    /// Returns the map as a grid, which is the rectangle around everything that has been seen.
    pub fn grid(&self) -> &CellGrid {
        &self.grid
    }

    /// Returns the free space connected to the robot's position. Slits of up to two cells between beams are
    /// closed. Empty if there is no free cell near the robot.
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

//! Exploration among rooms by a robot that does not know where it is. It looks through one gap after another (Yamauchi 1997) until the
//! filter has seen enough to find it.

use sketchnav_mapping::outline::{Place, SeenOutline};

use super::{AT_GAP_M, Advice, Aim, Explorer};

impl Explorer {
    /// Returns true if the robot is among rooms and nobody knows where, so that it has to see as much as possible.
    pub(super) fn searches(&self) -> bool {
        !self.is_open() && !self.is_placed()
    }

    /// Sets a course to the gap beyond which the robot sees something new soonest. Returns `None` if there is none.
    pub(super) fn choose_any_gap(&mut self, seen: &SeenOutline) -> Option<Advice> {
        let (place, mut grid) = (self.place(), self.path_grid());
        let (gap, cell, way_m) = grid.next_gap(place, &seen.gaps)?;
        let points = seen.gaps[gap].clone();
        let target = points[points.len() / 2];
        self.follow(Aim::Gap, target, points.clone(), grid, cell);
        Some(self.look_through(&points, target, way_m))
    }

    /// Looks through a gap if the robot has arrived at it. `target` is the point of the gap that the course leads to, and `way_m` the
    /// length of the path that is left.
    pub(super) fn look_through(&mut self, points: &[Place], target: Place, way_m: f64) -> Advice {
        if way_m >= AT_GAP_M {
            return Advice::Drive;
        }
        let near = self.near_of(points, target);
        self.exploration.looking = Some((near, self.free_cells() as u32));
        Advice::Look
    }
}

//! Decides from what the robot has seen whether the floor is open or consists of rooms.
//!
//! If every passage as narrow as a door is shut, a floor of rooms falls apart while an open floor stays connected. The decision is
//! based on the map rather than the drawing, because doors in buildings are of similar width, whereas their width in drawings is
//! arbitrary.

use sketchnav_mapping::region::Region;

/// Widths, in metres, up to which passages are shut. These are the widths of single doors, wide doors and double doors.
const DOORS_M: [f64; 3] = [0.9, 1.2, 1.5];
/// Approximate minimum length of a cell's side, in metres.
const CELL_M: f64 = 0.1;

/// The working memory for judging floors.
#[derive(Debug, Default)]
pub struct Judge {
    coarse: Region,
    left: Region,
    waiting: Vec<usize>,
}

/// Number of stretches of the floor waiting to be visited for which memory is reserved.
const WAITING: usize = 1 << 14;

impl Judge {
    /// Creates a judge for maps with up to `side` cells of `cell_m` along a side, so that judging them allocates nothing.
    pub fn for_maps(side: usize, cell_m: f64) -> Self {
        let side = side / times(cell_m);
        let region = || Region::with_room(side, side);
        Self { coarse: region(), left: region(), waiting: Vec::with_capacity(WAITING) }
    }

    /// Returns the share of the largest part of `free` for the door width at which it is smallest, or 1 if nothing is left. Only
    /// the area that is farther than half the door width from walls counts.
    pub fn open_share(&mut self, free: &Region, cell_m: f64) -> f64 {
        let times = times(cell_m);
        free.coarsen(times, &mut self.coarse);
        let cell_m = cell_m * times as f64;
        DOORS_M.iter().map(|width_m| self.largest_share(width_m / cell_m)).fold(1.0, f64::min)
    }

    fn largest_share(&mut self, width: f64) -> f64 {
        self.left.copy_from(&self.coarse);
        self.left.shrink((width / 2.0).round() as usize);
        let whole = self.left.count();
        let largest = self.left.take_parts(&mut self.waiting);
        if whole > 0 { largest as f64 / whole as f64 } else { 1.0 }
    }
}

/// Returns the number of cells of `cell_m` along a side that are judged as one.
fn times(cell_m: f64) -> usize {
    ((CELL_M / cell_m).round() as usize).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open_share(free: &Region) -> f64 {
        Judge::default().open_share(free, 0.05)
    }

    /// Returns a floor of 10 × 6 m in cells of 5 cm, divided by a wall with a passage of the given width.
    fn parted(passage_m: f64) -> Region {
        Region::of(204, 124, |k| {
            let (x, y) = (k % 204, k / 204);
            let is_inside = (2..202).contains(&x) && (2..122).contains(&y);
            let passage = 60..60 + (passage_m / 0.05).round() as usize;
            is_inside && (!(120..122).contains(&x) || passage.contains(&y))
        })
    }

    #[test]
    fn doors_part_a_floor_and_wide_passages_do_not() {
        assert!((0.55..0.65).contains(&open_share(&parted(0.9))));
        assert!(open_share(&parted(2.4)) > 0.99);
    }

    #[test]
    fn what_is_too_narrow_for_any_of_it_to_be_left_is_open() {
        let slit = Region::of(40, 8, |k| (2..6).contains(&(k / 40)));
        assert!((open_share(&slit) - 1.0).abs() < 1e-12);
    }
}

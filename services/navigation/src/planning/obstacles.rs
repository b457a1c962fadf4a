//! What the laser saw lately: a rolling grid of obstacles in the odometry frame.
//!
//! It is paper 001's local grid map of the scaled scan, seen in metres, with a memory: a laser that
//! does not look back forgets the table it is about to turn into. A beam's end marks a cell, the
//! way there clears cells; what was not seen for long is forgotten, because odometry drifts.
//!
//! The grid lies fixed in the odometry frame and its window moves with the robot: cell (x, y) is
//! kept in slot (x mod [`SIDE`], y mod [`SIDE`]), and nothing is ever copied.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Odom, Point, Pose};
use sketchnav_schemas::message::LaserScan;

/// Cells a side of the window, a power of two.
pub const SIDE: usize = 128;
/// Side of a cell, metres.
pub const CELL_M: f64 = 0.055;
/// How far the window reaches from the robot, metres.
pub const REACH_M: f64 = (SIDE / 2 - 2) as f64 * CELL_M;

const MASK: i32 = SIDE as i32 - 1;
/// Ends of neighbouring beams farther apart than this are not joined, metres: less than a door.
const JOIN_M: f64 = 0.5;
/// Cosine of the largest bend of a wall between ends that are joined.
const STRAIGHT_COS: f64 = 0.97;
/// Evidence: 0 nothing known, 1 free, more: seen as an obstacle.
const FREE: u8 = 1;
const OCCUPIED: u8 = 3;
const HIT: u8 = 3;
const MOST: u8 = 7;

/// A cell of the odometry frame: (x, y) covers from x·[`CELL_M`] to (x + 1)·[`CELL_M`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cell {
    /// Column.
    pub x: i32,
    /// Row.
    pub y: i32,
}

impl Cell {
    /// The cell of a place.
    pub fn of(place: Point<Odom>) -> Self {
        Self { x: floor(place.x / CELL_M), y: floor(place.y / CELL_M) }
    }

    /// The middle of the cell.
    pub fn middle(self) -> Point<Odom> {
        Point::new((f64::from(self.x) + 0.5) * CELL_M, (f64::from(self.y) + 0.5) * CELL_M)
    }
}

/// The rolling grid.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Obstacles {
    evidence: Vec<u8>,
    marked_ms: Vec<u32>,
    touched: Vec<u32>,
    scan: u32,
    now_ms: u32,
    memory_ms: u32,
    corner: Cell,
}

impl Obstacles {
    /// Nothing known; what is marked is forgotten after `memory_s` seconds without being seen.
    pub fn new(memory_s: f64) -> Self {
        let cells = SIDE * SIDE;
        Self {
            evidence: vec![0; cells],
            marked_ms: vec![0; cells],
            touched: vec![0; cells],
            scan: 0,
            now_ms: 0,
            memory_ms: (memory_s * 1e3) as u32,
            corner: Cell { x: -(SIDE as i32) / 2, y: -(SIDE as i32) / 2 },
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.evidence.fill(0);
    }

    /// The window's lower left cell.
    pub fn corner(&self) -> Cell {
        self.corner
    }

    /// Whether an obstacle is known there; what lies outside of the window is free.
    pub fn is_occupied(&self, cell: Cell) -> bool {
        let slot = slot(cell);
        self.contains(cell) && self.evidence[slot] >= OCCUPIED && self.is_fresh(slot)
    }

    /// Whether the laser ever saw the cell.
    pub fn is_known(&self, cell: Cell) -> bool {
        self.contains(cell) && self.evidence[slot(cell)] > 0
    }

    /// Distance from `place` to the nearest side of an occupied cell, at most `cap_m`, metres.
    pub fn clearance_m(&self, place: Point<Odom>, cap_m: f64) -> f64 {
        let own = Cell::of(place);
        let reach = (cap_m / CELL_M).ceil() as i32;
        let mut nearest = cap_m;
        for y in own.y - reach..=own.y + reach {
            for x in own.x - reach..=own.x + reach {
                let cell = Cell { x, y };
                if self.is_occupied(cell) {
                    nearest = nearest.min(distance_to_side(place, cell));
                }
            }
        }
        nearest
    }

    /// Takes in a scan made at `sensor`, by a robot at `robot` whose footprint, of radius
    /// `footprint_m`, is free for sure. Invalid readings (NaN, nearer than the sensor can measure)
    /// are ignored; an infinite one clears up to the sensor's longest range.
    pub fn observe(&mut self, robot: &Pose<Odom>, footprint_m: f64, sensor: &Pose<Odom>, scan: &LaserScan) {
        self.scan += 1;
        self.now_ms = (scan.header.stamp_ns / 1_000_000) as u32;
        self.follow(robot);
        self.clear_ways(sensor, scan);
        self.mark_ends(sensor, scan);
        self.clear_footprint(robot, footprint_m);
    }

    fn is_fresh(&self, slot: usize) -> bool {
        self.now_ms.saturating_sub(self.marked_ms[slot]) <= self.memory_ms
    }

    fn contains(&self, cell: Cell) -> bool {
        let inside = |v: i32, corner: i32| (v.wrapping_sub(corner) as u32) < SIDE as u32;
        inside(cell.x, self.corner.x) && inside(cell.y, self.corner.y)
    }

    /// Moves the window with the robot and forgets what falls out of it.
    fn follow(&mut self, robot: &Pose<Odom>) {
        let middle = Cell::of(robot.position());
        let corner = Cell { x: middle.x - SIDE as i32 / 2, y: middle.y - SIDE as i32 / 2 };
        if let Some((from, to)) = entered(self.corner.x, corner.x) {
            (from..to).for_each(|x| (0..SIDE as i32).for_each(|y| self.evidence[slot(Cell { x, y })] = 0));
        }
        if let Some((from, to)) = entered(self.corner.y, corner.y) {
            (from..to).for_each(|y| (0..SIDE as i32).for_each(|x| self.evidence[slot(Cell { x, y })] = 0));
        }
        self.corner = corner;
    }

    fn clear_ways(&mut self, sensor: &Pose<Odom>, scan: &LaserScan) {
        let finest = f64::from(scan.angle_increment_rad) * REACH_M;
        let every = (CELL_M / finest).max(1.0) as usize;
        for (i, &range) in scan.ranges().iter().enumerate().step_by(every) {
            if range >= scan.range_min_m {
                let range = f64::from(range.min(scan.range_max_m)) - CELL_M;
                self.clear_way(sensor, f64::from(scan.angle_rad(i)), range);
            }
        }
    }

    fn clear_way(&mut self, sensor: &Pose<Odom>, angle_rad: f64, range_m: f64) {
        let (sin, cos) = (sensor.yaw_rad + angle_rad).sin_cos();
        let steps = (range_m.min(REACH_M * 1.5) * cos.abs().max(sin.abs()) / CELL_M) as usize;
        let (dx, dy) = (cos / cos.abs().max(sin.abs()), sin / cos.abs().max(sin.abs()));
        let (x0, y0) =
            (sensor.x / CELL_M - f64::from(self.corner.x), sensor.y / CELL_M - f64::from(self.corner.y));
        let ([mut x, mut y], dx, dy) = ([x0, y0].map(fixed), fixed(dx), fixed(dy));
        for _ in 0..=steps {
            let (column, row) = ((x >> FRACTION_BITS) as i32, (y >> FRACTION_BITS) as i32);
            if column as u32 >= SIDE as u32 || row as u32 >= SIDE as u32 {
                break;
            }
            self.miss(slot(Cell { x: self.corner.x + column, y: self.corner.y + row }));
            (x, y) = (x + dx, y + dy);
        }
    }

    /// However many beams of a scan cross a cell, they count once.
    fn miss(&mut self, slot: usize) {
        if self.touched[slot] != self.scan {
            self.touched[slot] = self.scan;
            self.evidence[slot] = self.evidence[slot].saturating_sub(1).max(FREE);
        }
    }

    fn mark_ends(&mut self, sensor: &Pose<Odom>, scan: &LaserScan) {
        let mut before = [None, None];
        for (i, &range) in scan.ranges().iter().enumerate() {
            let valid = range >= scan.range_min_m && range <= scan.range_max_m;
            let end = valid.then(|| end_of_beam(sensor, f64::from(scan.angle_rad(i)), f64::from(range)));
            if let Some(end) = end {
                self.hit(Cell::of(end));
            }
            if let [Some(first), Some(second)] = before
                && let Some(end) = end
                && is_one_wall(first, second, end)
            {
                self.mark_between(second, end);
            }
            before = [before[1], end];
        }
    }

    fn mark_between(&mut self, from: Point<Odom>, to: Point<Odom>) {
        let steps = (from.distance(&to) / CELL_M).ceil();
        for step in 1..steps as u32 {
            let share = f64::from(step) / steps;
            let x = from.x + share * (to.x - from.x);
            self.hit(Cell::of(Point::new(x, from.y + share * (to.y - from.y))));
        }
    }

    fn hit(&mut self, cell: Cell) {
        let slot = slot(cell);
        // The top bit tells that the cell was hit by this scan already.
        let hit_by_this_scan = self.scan | 1 << 31;
        if self.contains(cell) && self.touched[slot] != hit_by_this_scan {
            self.touched[slot] = hit_by_this_scan;
            self.evidence[slot] = (self.evidence[slot].max(FREE) + HIT).min(MOST);
            self.marked_ms[slot] = self.now_ms;
        }
    }

    fn clear_footprint(&mut self, robot: &Pose<Odom>, radius_m: f64) {
        let own = Cell::of(robot.position());
        let reach = (radius_m / CELL_M) as i32;
        for y in own.y - reach..=own.y + reach {
            for x in own.x - reach..=own.x + reach {
                let cell = Cell { x, y };
                if cell.middle().distance(&robot.position()) < radius_m - CELL_M {
                    self.evidence[slot(cell)] = FREE;
                }
            }
        }
    }
}

fn end_of_beam(sensor: &Pose<Odom>, angle_rad: f64, range_m: f64) -> Point<Odom> {
    let (sin, cos) = (sensor.yaw_rad + angle_rad).sin_cos();
    Point::new(sensor.x + range_m * cos, sensor.y + range_m * sin)
}

/// Whether three ends of neighbouring beams lie on one straight wall, seen along its length: then
/// what lies between the last two is wall, too.
fn is_one_wall(first: Point<Odom>, second: Point<Odom>, third: Point<Odom>) -> bool {
    let (a, b) = (second.coords() - first.coords(), third.coords() - second.coords());
    b.norm() <= JOIN_M && a.dot(&b) >= STRAIGHT_COS * a.norm() * b.norm()
}

/// Bits of a cell's fractions along a beam: its way is walked in whole numbers.
const FRACTION_BITS: u32 = 32;

fn fixed(cells: f64) -> i64 {
    (cells * (1_i64 << FRACTION_BITS) as f64) as i64
}

/// The greatest whole number that is not above `x`, or the nearest that there is. (Older processors have no
/// instruction for it.)
#[inline]
fn floor(x: f64) -> i32 {
    let whole = x as i32;
    whole.saturating_sub(i32::from(f64::from(whole) > x))
}

fn slot(cell: Cell) -> usize {
    (cell.y & MASK) as usize * SIDE + (cell.x & MASK) as usize
}

/// The columns, or rows, that enter the window when its corner moves.
fn entered(from: i32, to: i32) -> Option<(i32, i32)> {
    let side = SIDE as i32;
    match to.saturating_sub(from) {
        0 => None,
        moved if moved.saturating_abs() >= side => Some((to, to + side)),
        moved if moved > 0 => Some((from + side, to + side)),
        _ => Some((to, from)),
    }
}

fn distance_to_side(place: Point<Odom>, cell: Cell) -> f64 {
    let middle = cell.middle();
    let beyond = |v: f64, m: f64| ((v - m).abs() - CELL_M / 2.0).max(0.0);
    beyond(place.x, middle.x).hypot(beyond(place.y, middle.y))
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;
    use sketchnav_schemas::message::Header;

    use super::*;

    fn scan(stamp_s: u64, ranges: &[f32]) -> LaserScan {
        let mut scan = LaserScan {
            header: Header { seq: 1, stamp_ns: stamp_s * 1_000_000_000, source_seq: 1 },
            angle_min_rad: 0.0,
            angle_increment_rad: 0.01,
            range_min_m: 0.05,
            range_max_m: 5.0,
            beam_count: ranges.len() as u32,
            ..Zeroable::zeroed()
        };
        scan.ranges_m[..ranges.len()].copy_from_slice(ranges);
        scan
    }

    fn watch(obstacles: &mut Obstacles, x: f64, stamp_s: u64, ranges: &[f32]) {
        let robot = Pose::new(x, 0.0, 0.0);
        obstacles.observe(&robot, 0.2, &robot, &scan(stamp_s, ranges));
    }

    /// A laser of a degree a beam that looks along a wall hits it every half metre: the planner found
    /// its way through the wall, between the hits, and turned back and forth in the door.
    #[test]
    fn a_wall_seen_along_its_length_has_no_holes() {
        let mut obstacles = Obstacles::new(10.0);
        let mut along = scan(1, &[]);
        along.angle_increment_rad = 0.0175;
        along.beam_count = 60;
        // The wall y = 0.3 m, from 11 degrees to 70 degrees.
        for i in 0..60 {
            along.ranges_m[i] = (0.3 / (0.0175 * (i as f64 + 7.0)).sin()) as f32;
        }
        let robot = Pose::new(0.0, 0.0, 7.0 * 0.0175);
        obstacles.observe(&robot, 0.1, &robot, &along);
        for x in 3..38 {
            let wall = [5, 6].iter().any(|&y| obstacles.is_occupied(Cell { x, y }));
            assert!(wall, "{x}");
        }
    }

    const AHEAD: Cell = Cell { x: 36, y: 0 };

    #[test]
    fn the_floor_is_that_of_the_library() {
        let values = (-4000..4000).map(|i| f64::from(i) * 0.0371);
        for x in values.chain([-0.0, -1.0, 1e12, -1e12, f64::NAN, f64::INFINITY, f64::NEG_INFINITY]) {
            assert_eq!(floor(x), x.floor() as i32, "{x}");
        }
    }

    #[test]
    fn a_beam_marks_its_end_and_clears_its_way() {
        let mut obstacles = Obstacles::new(10.0);
        watch(&mut obstacles, 0.0, 1, &[2.0]);
        assert!(obstacles.is_occupied(AHEAD));
        assert!(!obstacles.is_known(Cell { x: 38, y: 0 }) && obstacles.is_known(Cell { x: 20, y: 0 }));
        (0..6).for_each(|_| watch(&mut obstacles, 0.0, 1, &[f32::INFINITY]));
        assert!(!obstacles.is_occupied(AHEAD) && obstacles.is_known(AHEAD));
    }

    #[test]
    fn invalid_readings_say_nothing() {
        let mut obstacles = Obstacles::new(10.0);
        watch(&mut obstacles, 0.0, 1, &[f32::NAN, 0.01]);
        assert!(!obstacles.is_known(Cell { x: 20, y: 0 }));
    }

    #[test]
    fn marks_fade() {
        let mut obstacles = Obstacles::new(10.0);
        watch(&mut obstacles, 0.0, 1, &[2.0]);
        watch(&mut obstacles, 0.0, 11, &[f32::NAN]);
        assert!(obstacles.is_occupied(AHEAD));
        watch(&mut obstacles, 0.0, 12, &[f32::NAN]);
        assert!(!obstacles.is_occupied(AHEAD));
    }

    #[test]
    fn what_falls_out_of_the_window_is_forgotten() {
        let mut obstacles = Obstacles::new(10.0);
        watch(&mut obstacles, 0.0, 1, &[2.0]);
        watch(&mut obstacles, 1.0, 1, &[f32::NAN]);
        assert!(obstacles.is_occupied(AHEAD));
        watch(&mut obstacles, 7.0, 1, &[f32::NAN]);
        watch(&mut obstacles, 0.0, 1, &[f32::NAN]);
        assert!(!obstacles.is_occupied(AHEAD));
    }

    #[test]
    fn clearance_is_measured_to_the_side_of_the_cell() {
        let mut obstacles = Obstacles::new(10.0);
        watch(&mut obstacles, 0.0, 1, &[2.0]);
        let clearance = obstacles.clearance_m(Point::new(1.5, 0.01), 1.0);
        assert!((clearance - (36.0 * CELL_M - 1.5)).abs() < 1e-9, "{clearance}");
        assert_eq!(obstacles.clearance_m(Point::new(-1.0, 0.0), 0.4), 0.4);
    }
}

//! A rolling grid, in the odometry frame, of the obstacles that the laser has seen recently.
//!
//! This is the local grid map of the scaled scan of Boniardi et al. 2015, but in metres and with a memory.
//! Without the memory, a robot whose laser does not look backwards would forget a table just before turning
//! into it. The end of a beam marks a cell as occupied, and the cells along the beam are cleared. Obstacles
//! that have not been seen for some time are forgotten, because odometry drifts.
//!
//! The grid is fixed in the odometry frame, and a window onto it moves with the robot. Cell (x, y) is stored in slot (x mod
//! [`SIDE`], y mod [`SIDE`]), so moving the window does not move any data. Because planning queries thousands of cells per step,
//! the occupied cells of the window are tabulated once per scan.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Odom, Point, Pose};
use sketchnav_schemas::message::LaserScan;

/// Number of cells along a side of the window. A power of two.
pub const SIDE: usize = 128;
/// Length of a cell's side, in metres.
pub const CELL_M: f64 = 0.055;
/// Distance that the window reaches from the robot, in metres.
pub const REACH_M: f64 = (SIDE / 2 - 2) as f64 * CELL_M;

const MASK: i32 = SIDE as i32 - 1;
/// Maximum gap, in metres, across which the endpoints of neighbouring beams are joined to a wall. Narrower than a door.
const JOIN_M: f64 = 0.5;
/// Cosine of the maximum bend at an endpoint for neighbouring beams to be joined.
const STRAIGHT_COS: f64 = 0.97;
/// Evidence about a cell: 0 if nothing is known, 1 if it is free, and more if an obstacle was seen there.
const FREE: u8 = 1;
const OCCUPIED: u8 = 3;
const HIT: u8 = 3;
const MOST: u8 = 7;

/// A cell of the odometry frame. The cell (x, y) extends from x·[`CELL_M`] to (x + 1)·[`CELL_M`] along x, and likewise along y.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cell {
    /// Column.
    pub x: i32,
    /// Row.
    pub y: i32,
}

impl Cell {
    /// Returns the cell that contains `place`.
    pub fn of(place: Point<Odom>) -> Self {
        Self { x: floor(place.x / CELL_M), y: floor(place.y / CELL_M) }
    }

    /// Returns the centre of the cell.
    pub fn middle(self) -> Point<Odom> {
        Point::new((f64::from(self.x) + 0.5) * CELL_M, (f64::from(self.y) + 0.5) * CELL_M)
    }
}

/// Mark for a cell that beams of a scan pass through, and for one in which they end.
const PASSED: u8 = 1;
const ENDED: u8 = 2;

/// The rolling grid of obstacles.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Obstacles {
    evidence: Vec<u8>,
    marked_ms: Vec<u32>,
    now_ms: u32,
    memory_ms: u32,
    corner: Cell,
    #[serde(skip)]
    window: Window,
}

/// The cells of the window, row by row from its corner. Derived from the rest of the grid at each scan.
#[derive(Debug, Clone)]
struct Window {
    /// Marks of the latest scan, [`PASSED`] and [`ENDED`].
    marks: Vec<u8>,
    known: Vec<bool>,
    occupied: Vec<bool>,
    /// The occupied cells again, as one bit per cell.
    rows: Vec<u128>,
}

impl Default for Window {
    fn default() -> Self {
        let cells = SIDE * SIDE;
        let (known, occupied) = (vec![false; cells], vec![false; cells]);
        Self { marks: vec![0; cells], known, occupied, rows: vec![0; SIDE] }
    }
}

impl Window {
    fn clear(&mut self) {
        self.known.fill(false);
        self.occupied.fill(false);
        self.rows.fill(0);
    }
}

impl Obstacles {
    /// Creates an empty grid. Obstacles are forgotten if they have not been seen for `obstacle_memory_s`
    /// seconds.
    pub fn new(obstacle_memory_s: f64) -> Self {
        let cells = SIDE * SIDE;
        Self {
            evidence: vec![0; cells],
            marked_ms: vec![0; cells],
            now_ms: 0,
            memory_ms: (obstacle_memory_s * 1e3) as u32,
            corner: Cell { x: -(SIDE as i32) / 2, y: -(SIDE as i32) / 2 },
            window: Window::default(),
        }
    }

    /// Forgets all obstacles.
    pub fn clear(&mut self) {
        self.evidence.fill(0);
        self.window.clear();
    }

    /// Returns the lower left cell of the window.
    pub fn corner(&self) -> Cell {
        self.corner
    }

    /// Returns, for each cell of the window, whether an obstacle is known there. Cells are in rows from the corner.
    pub fn occupied(&self) -> &[bool] {
        &self.window.occupied
    }

    /// Returns, for each cell of the window, whether the laser has ever seen it. Cells are in rows from the corner.
    pub fn known(&self) -> &[bool] {
        &self.window.known
    }

    /// Returns true if an obstacle is known in the cell. Cells outside the window count as free.
    pub fn is_occupied(&self, cell: Cell) -> bool {
        self.index(cell).is_some_and(|index| self.window.occupied[index])
    }

    /// Returns true if the cell lies in the window and the laser has ever seen it.
    pub fn is_known(&self, cell: Cell) -> bool {
        self.index(cell).is_some_and(|index| self.window.known[index])
    }

    /// Returns the distance from `place` to the nearest side of an occupied cell, in metres, but at most `cap_m`.
    pub fn clearance_m(&self, place: Point<Odom>, cap_m: f64) -> f64 {
        /// Bound on the rounding error of a distance to a cell.
        const ROUNDED_M: f64 = 1e-9;
        let own = Cell::of(place);
        let reach = (cap_m / CELL_M).ceil() as i32;
        let within = |own: i32, corner: i32| {
            let first = own.saturating_sub(reach).saturating_sub(corner).max(0);
            first..own.saturating_add(reach).saturating_sub(corner).saturating_add(1).min(SIDE as i32)
        };
        let (columns, rows) = (within(own.x, self.corner.x), within(own.y, self.corner.y));
        if columns.is_empty() {
            return cap_m;
        }
        let in_reach = u128::MAX << columns.start & u128::MAX >> (SIDE as i32 - columns.end);
        // In each row, only the first occupied cell on either side can be the nearest.
        let ahead = u128::MAX.checked_shl(own.x.saturating_sub(self.corner.x).max(0) as u32).unwrap_or(0);
        let mut nearest = cap_m;
        for row in rows {
            let bits = self.window.rows[row as usize] & in_reach;
            let y = self.corner.y + row;
            if bits == 0 || beyond(place.y, y) > nearest + ROUNDED_M {
                continue;
            }
            let right = (bits & ahead > 0).then(|| (bits & ahead).trailing_zeros());
            let left = (bits & !ahead).checked_ilog2();
            for column in [left, right].into_iter().flatten() {
                let cell = Cell { x: self.corner.x + column as i32, y };
                nearest = nearest.min(distance_to_side(place, cell));
            }
        }
        nearest
    }

    /// Adds a scan taken at `sensor` by a robot at `robot`, whose footprint of radius `footprint_m` is certainly free. Invalid
    /// readings (NaN or below the sensor's minimum range) are ignored. An infinite reading clears cells up to the sensor's maximum
    /// range.
    pub fn observe(&mut self, robot: &Pose<Odom>, footprint_m: f64, sensor: &Pose<Odom>, scan: &LaserScan) {
        self.now_ms = (scan.header.stamp_ns / 1_000_000) as u32;
        self.follow(robot);
        self.window.marks.fill(0);
        self.mark(sensor, scan);
        self.take_marks();
        self.clear_footprint(robot, footprint_m);
        self.tabulate();
    }

    /// Returns the index of a cell in the window, or `None` if it lies outside.
    fn index(&self, cell: Cell) -> Option<usize> {
        let (x, y) = (cell.x.wrapping_sub(self.corner.x) as u32, cell.y.wrapping_sub(self.corner.y) as u32);
        (x < SIDE as u32 && y < SIDE as u32).then_some(y as usize * SIDE + x as usize)
    }

    /// Returns the ranges of window indices that are contiguous in slots as well, each with its first slot. A row has two of them,
    /// one on either side of the point where its slots wrap around.
    fn parts(corner: Cell) -> impl Iterator<Item = (Range<usize>, usize)> {
        let shift = (corner.x & MASK) as usize;
        (0..SIDE).flat_map(move |row| {
            let (first, slots) = (row * SIDE, (corner.y.wrapping_add(row as i32) & MASK) as usize * SIDE);
            [(first..first + SIDE - shift, slots + shift), (first + SIDE - shift..first + SIDE, slots)]
        })
    }

    fn take_marks(&mut self) {
        for (window, slot) in Self::parts(self.corner) {
            take(&mut self.evidence[slot..slot + window.len()], &self.window.marks[window]);
        }
    }

    fn tabulate(&mut self) {
        let Self { evidence, marked_ms, window, .. } = self;
        let oldest_ms = self.now_ms.saturating_sub(self.memory_ms);
        for (cells, slot) in Self::parts(self.corner) {
            let slots = slot..slot + cells.len();
            let (known, occupied) = (&mut window.known[cells.clone()], &mut window.occupied[cells]);
            judge(&evidence[slots.clone()], &marked_ms[slots], oldest_ms, known, occupied);
        }
        for (row, cells) in window.rows.iter_mut().zip(window.occupied.chunks_exact(SIDE)) {
            let (eights, _) = cells.as_chunks::<8>();
            *row = eights.iter().rev().fold(0, |row, eight| row << 8 | u128::from(packed(eight)));
        }
    }

    /// Moves the window with the robot and forgets the cells that fall out of it.
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

    /// Marks the cells that the beams of a scan pass through and the cells where they end.
    fn mark(&mut self, sensor: &Pose<Odom>, scan: &LaserScan) {
        let finest = f64::from(scan.angle_increment_rad) * REACH_M;
        let every = (CELL_M / finest).max(1.0) as usize;
        let (mut before, mut next_way) = ([None, None], 0);
        for (i, &range) in scan.ranges().iter().enumerate() {
            let is_way = i == next_way;
            next_way += if is_way { every } else { 0 };
            if range.is_nan() || range < scan.range_min_m {
                before = [before[1], None];
                continue;
            }
            let (sin, cos) = (sensor.yaw_rad + f64::from(scan.angle_rad(i))).sin_cos();
            if is_way {
                self.mark_way(sensor, [cos, sin], f64::from(range.min(scan.range_max_m)) - CELL_M);
            }
            let range_m = f64::from(range);
            let end = (range <= scan.range_max_m)
                .then(|| Point::new(sensor.x + range_m * cos, sensor.y + range_m * sin));
            self.mark_end(before, end);
            before = [before[1], end];
        }
    }

    fn mark_way(&mut self, sensor: &Pose<Odom>, [cos, sin]: [f64; 2], range_m: f64) {
        let longer = cos.abs().max(sin.abs());
        let steps = (range_m.min(REACH_M * 1.5) * longer / CELL_M) as usize;
        let (x0, y0) =
            (sensor.x / CELL_M - f64::from(self.corner.x), sensor.y / CELL_M - f64::from(self.corner.y));
        let ([mut x, mut y], dx, dy) = ([x0, y0].map(fixed), fixed(cos / longer), fixed(sin / longer));
        let Some(cells) = passed([x, y], [dx, dy]) else { return };
        let Some(marks) = self.window.marks.first_chunk_mut::<{ SIDE * SIDE }>() else { return };
        for _ in 0..cells.min(steps + 1) {
            let (column, row) = ((x >> FRACTION_BITS) as usize, (y >> FRACTION_BITS) as usize);
            marks[(row % SIDE) * SIDE + column % SIDE] |= PASSED;
            (x, y) = (x + dx, y + dy);
        }
    }

    fn mark_end(&mut self, before: [Option<Point<Odom>>; 2], end: Option<Point<Odom>>) {
        let Some(end) = end else { return };
        self.hit(Cell::of(end));
        if let [Some(first), Some(second)] = before
            && is_one_wall(first, second, end)
        {
            self.mark_between(second, end);
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
        if let Some(index) = self.index(cell) {
            self.window.marks[index] |= ENDED;
            self.marked_ms[slot(cell)] = self.now_ms;
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

/// Returns true if the endpoints of three neighbouring beams lie on one straight wall. In that case, the gap between the last two
/// endpoints is part of the wall, too.
fn is_one_wall(first: Point<Odom>, second: Point<Odom>, third: Point<Odom>) -> bool {
    let (a, b) = (second.coords() - first.coords(), third.coords() - second.coords());
    b.norm() <= JOIN_M && a.dot(&b) >= STRAIGHT_COS * a.norm() * b.norm()
}

/// Number of fractional bits in a cell coordinate. Beams are traced in fixed-point arithmetic.
const FRACTION_BITS: u32 = 32;

fn fixed(cells: f64) -> i64 {
    (cells * (1_i64 << FRACTION_BITS) as f64) as i64
}

/// Returns the number of steps of `by` that stay within the window, counting `from` itself, or `None` if `from` lies outside. Both
/// are in fixed-point cells.
fn passed(from: [i64; 2], by: [i64; 2]) -> Option<usize> {
    const END: i64 = (SIDE as i64) << FRACTION_BITS;
    let along = |from: i64, by: i64| match by {
        0 => i64::MAX,
        by if by > 0 => (END - 1 - from) / by + 1,
        by => from / -by + 1,
    };
    let is_within = from.iter().all(|from| (0..END).contains(from));
    is_within.then(|| along(from[0], by[0]).min(along(from[1], by[1])) as usize)
}

/// Updates the evidence of some cells from the marks of a scan. Each scan counts once per cell, however many beams pass through it
/// or end in it, and endpoints are applied last.
fn take(evidence: &mut [u8], marks: &[u8]) {
    for (evidence, mark) in evidence.iter_mut().zip(marks) {
        let missed = evidence.saturating_sub(1).max(FREE);
        let before = if mark & PASSED > 0 { missed } else { *evidence };
        let hit = before.max(FREE).saturating_add(HIT).min(MOST);
        *evidence = if mark & ENDED > 0 { hit } else { before };
    }
}

/// Determines which of some cells are known and which are occupied. A cell is occupied if its evidence suffices and its last mark
/// is not older than `oldest_ms`.
fn judge(evidence: &[u8], marked_ms: &[u32], oldest_ms: u32, known: &mut [bool], occupied: &mut [bool]) {
    let cells = known.iter_mut().zip(occupied).zip(evidence).zip(marked_ms);
    for (((known, occupied), &evidence), &marked_ms) in cells {
        *known = evidence > 0;
        *occupied = (evidence >= OCCUPIED) & (marked_ms >= oldest_ms);
    }
}

/// Returns the greatest integer not above `x`, or the nearest representable one. Faster than [`f64::floor`] on older processors,
/// which have no instruction for it.
#[inline]
fn floor(x: f64) -> i32 {
    let whole = x as i32;
    whole.saturating_sub(i32::from(f64::from(whole) > x))
}

fn slot(cell: Cell) -> usize {
    (cell.y & MASK) as usize * SIDE + (cell.x & MASK) as usize
}

/// Returns the range of columns, or of rows, that enter the window when its corner moves, or `None` if none do.
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
    beyond(place.x, cell.x).hypot(beyond(place.y, cell.y))
}

/// Returns the distance from a coordinate to a column or a row of cells, in metres, or zero if it lies within.
fn beyond(coordinate: f64, cell: i32) -> f64 {
    ((coordinate - (f64::from(cell) + 0.5) * CELL_M).abs() - CELL_M / 2.0).max(0.0)
}

/// Packs eight cells into the bits of a byte, the first cell into the lowest bit.
fn packed(cells: &[bool; 8]) -> u8 {
    // The factor has one bit for each byte, which shifts the lowest bit of byte k to bit 56 + k.
    (u64::from_le_bytes(cells.map(u8::from)).wrapping_mul(0x0102_0408_1020_4080) >> 56) as u8
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

    /// With one beam per degree, a laser that looks along a wall has a return only every half metre. The planner used to find a
    /// path through the wall, between the returns, and the robot turned back and forth in the door.
    #[test]
    fn a_wall_seen_along_its_length_has_no_holes() {
        let mut obstacles = Obstacles::new(10.0);
        let mut along = scan(1, &[]);
        along.angle_increment_rad = 0.0175;
        along.beam_count = 60;
        // The wall is at y = 0.3 m and is seen at bearings from 7 to 66 degrees.
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
    fn the_floor_function_equals_that_of_the_library() {
        let values = (-4000..4000).map(|i| f64::from(i) * 0.0371);
        for x in values.chain([-0.0, -1.0, 1e12, -1e12, f64::NAN, f64::INFINITY, f64::NEG_INFINITY]) {
            assert_eq!(floor(x), x.floor() as i32, "{x}");
        }
    }

    #[test]
    fn a_beam_marks_its_end_and_clears_its_path() {
        let mut obstacles = Obstacles::new(10.0);
        watch(&mut obstacles, 0.0, 1, &[2.0]);
        assert!(obstacles.is_occupied(AHEAD));
        assert!(!obstacles.is_known(Cell { x: 38, y: 0 }) && obstacles.is_known(Cell { x: 20, y: 0 }));
        (0..6).for_each(|_| watch(&mut obstacles, 0.0, 1, &[f32::INFINITY]));
        assert!(!obstacles.is_occupied(AHEAD) && obstacles.is_known(AHEAD));
    }

    #[test]
    fn invalid_readings_are_ignored() {
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
    fn obstacles_outside_the_window_are_forgotten() {
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

//! A robot resumes in a learned map after somebody may have carried it. Where it stood last is one hypothesis among others.
//!
//! The map has two rooms that look the same, with a third one between them, along a corridor.

use bytemuck::Zeroable;
use rand_pcg::Pcg64Mcg;
use sketchnav_schemas::codes::{Tracking, WALL};
use sketchnav_schemas::geometry::{Base, Odom, Pose, Sketch, wrap_angle};
use sketchnav_schemas::message::LaserScan;
use sketchnav_schemas::robot::Drive;
use sketchnav_schemas::seed;
use sketchnav_sketch::filter::beams::Mounting;
use sketchnav_sketch::filter::parameters::Parameters;
use sketchnav_sketch::filter::{Estimate, Filter, Start, extent_px};
use sketchnav_sketch::sketch::SketchGrid;

/// Scale of the map, in pixels per metre.
const PXPM: f64 = 20.0;
/// The map, with one character for half a metre. The robot's places are in the middle of a character.
const PLAN: [&str; 16] = [
    "################################",
    "#       ###          ###       #",
    "#       ###          ###       #",
    "#       ###   ##     ###       #",
    "#   a   ###   ##  c  ###   b   #",
    "#       ###          ###       #",
    "#     ####           ###     ###",
    "#     ####           ###     ###",
    "##   ###########   #######   ###",
    "##   ###########   #######   ###",
    "#                              #",
    "#                              #",
    "#                              #",
    "#####                          #",
    "#####                          #",
    "################################",
];

/// A robot in the map, with the filter that localizes it.
struct Robot {
    map: SketchGrid,
    filter: Filter,
    truth: Pose<Sketch>,
    odometry: Pose<Odom>,
    noise: Pcg64Mcg,
}

/// Returns the middle of a character of the plan, in pixels.
fn place(letter: char) -> [f64; 2] {
    let row = PLAN.iter().position(|row| row.contains(letter)).unwrap();
    let column = PLAN[row].find(letter).unwrap();
    [column as f64 + 0.5, (PLAN.len() - row) as f64 - 0.5].map(|half_m| half_m / 2.0 * PXPM)
}

fn map() -> SketchGrid {
    let cells_per_letter = (PXPM / 2.0) as usize;
    let [width, height] = [PLAN[0].len(), PLAN.len()].map(|letters| letters * cells_per_letter);
    let is_wall = |i: usize| {
        let [column, row] = [i % width, i / width].map(|cell| cell / cells_per_letter);
        PLAN[PLAN.len() - 1 - row].as_bytes()[column] == b'#'
    };
    let cells: Vec<u8> = (0..width * height).map(|i| if is_wall(i) { WALL } else { 0 }).collect();
    SketchGrid::new(width, height, &cells, 0.0).unwrap()
}

impl Robot {
    /// Creates a robot at `at` that stood at `last` when it was last localized. It looks towards the corridor, as it did then.
    fn new(last: char, at: char, seed: u64) -> Self {
        let map = map();
        let pose = |letter| {
            let [x, y] = place(letter);
            Pose::new(x, y, -std::f64::consts::FRAC_PI_2)
        };
        let start = Start::anywhere(pose(last), [map.width(), map.height()]);
        let parameters =
            Parameters { building_size_m: extent_px(&map) / PXPM as f32, ..Parameters::learned() };
        let filter =
            Filter::new(&map, Mounting::default(), Drive::Omnidirectional, parameters, start, seed).unwrap();
        Self {
            map,
            filter,
            truth: pose(at),
            odometry: Pose::new(0.0, 0.0, 0.0),
            noise: seed::stream(seed, "noise"),
        }
    }

    /// Moves the robot by a step in its own axes, in metres, and returns the estimate, and its error in metres.
    fn advance(&mut self, forward_m: f64, turn_rad: f64) -> (Estimate, f64) {
        self.truth = self.truth.compose(&Pose::<Base>::new(forward_m * PXPM, 0.0, turn_rad));
        self.odometry = self.odometry.compose(&Pose::<Base>::new(forward_m * 1.01, 0.0, turn_rad * 0.99));
        let scan = self.scan();
        let estimate = self.filter.step(&self.odometry, &scan);
        (estimate, estimate.pose.position().distance(&self.truth.position()) / PXPM)
    }

    /// Turns the robot once around, and returns the estimates.
    fn look_around(&mut self) -> Vec<(Estimate, f64)> {
        (0..63).map(|_| self.advance(0.0, 0.1)).collect()
    }

    /// Drives to a place, in pixels, and returns the estimates.
    fn drive_to(&mut self, [x, y]: [f64; 2]) -> Vec<(Estimate, f64)> {
        let mut estimates = Vec::new();
        while (x - self.truth.x).hypot(y - self.truth.y) > 2.0 {
            let bearing = wrap_angle((y - self.truth.y).atan2(x - self.truth.x) - self.truth.yaw_rad);
            let forward_m = if bearing.abs() > 0.3 { 0.0 } else { 0.05 };
            estimates.push(self.advance(forward_m, bearing.clamp(-0.1, 0.1)));
        }
        estimates
    }

    /// Returns a scan of 121 beams over 240°, with a maximum range of 5.6 m.
    fn scan(&mut self) -> LaserScan {
        let mut scan = LaserScan::zeroed();
        (scan.beam_count, scan.range_min_m, scan.range_max_m) = (121, 0.02, 5.6);
        (scan.angle_min_rad, scan.angle_max_rad) = (-120_f32.to_radians(), 120_f32.to_radians());
        scan.angle_increment_rad = 2_f32.to_radians();
        for i in 0..121 {
            let (sin, cos) = (self.truth.yaw_rad + f64::from(scan.angle_rad(i))).sin_cos();
            let is_free = |px: &f64| {
                let at = [self.truth.x + cos * px, self.truth.y + sin * px].map(|at| at.floor() as i64);
                !self.map.is_wall_cell(at[0], at[1])
            };
            let steps = (1..).map(|step| f64::from(step) * 0.25).take_while(is_free);
            let range_m = steps.last().unwrap_or_default() / PXPM + 0.01 * normal(&mut self.noise);
            scan.ranges_m[i] = if range_m > 5.6 { f32::INFINITY } else { range_m as f32 };
        }
        scan
    }
}

fn normal(rng: &mut Pcg64Mcg) -> f64 {
    rand_distr::Distribution::sample(&rand_distr::StandardNormal, rng)
}

fn is_sure(estimate: &Estimate) -> bool {
    estimate.tracking == Tracking::Tracking
}

/// Returns the number of steps after which the robot is sure of its place on a turn, which must be the right one.
fn found_after(last: char, at: char, seed: u64) -> Option<usize> {
    let estimates = Robot::new(last, at, seed).look_around();
    let wrong = estimates.iter().filter(|(estimate, off_m)| is_sure(estimate) && *off_m > 0.3).count();
    assert_eq!(wrong, 0, "{last} to {at}, seed {seed}");
    estimates.iter().position(|(estimate, _)| is_sure(estimate))
}

#[test]
fn a_robot_that_stands_where_it_stood_is_sure_sooner_than_one_that_was_carried() {
    for seed in 1..=3 {
        let (same, carried) = (found_after('c', 'c', seed), found_after('a', 'c', seed));
        assert!(same.is_some_and(|steps| steps < 40), "{seed}: {same:?}");
        assert!(carried.is_none_or(|steps| same.is_some_and(|same| same < steps)), "{seed}: {carried:?}");
    }
}

/// The last pose would win if it were taken on trust, since all scans of a full turn confirm it.
#[test]
fn a_robot_that_was_carried_to_a_room_that_looks_the_same_is_sure_only_when_it_has_left_it() {
    for seed in 1..=3 {
        let mut robot = Robot::new('a', 'b', seed);
        let inside = robot.look_around();
        assert!(!inside.iter().any(|(estimate, _)| is_sure(estimate)), "{seed}");
        let [x, _] = place('b');
        let outside = [robot.drive_to([x - 10.0, 45.0]), robot.drive_to(place('c').map(|at| at.min(45.0)))];
        for (estimate, off_m) in outside.iter().flatten() {
            assert!(!is_sure(estimate) || *off_m < 0.5, "{seed}: off by {off_m} m");
        }
        let (last, off_m) = outside[1].last().unwrap();
        assert!(is_sure(last) && *off_m < 0.3, "{seed}: {last:?}, off by {off_m} m");
    }
}

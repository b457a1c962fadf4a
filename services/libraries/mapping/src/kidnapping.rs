//! Notices that somebody has carried the robot (the kidnapped robot problem, Engelson and McDermott 1992).
//!
//! A scan shows free space up to what it hits, or up to the laser's maximum range. If the robot was only driven, another scan from
//! nearby cannot hit anything in the middle of that space, nor look past what was hit, except for what moves by itself. After the
//! robot was carried, however, the odometry places the new scan where the old one was taken, and most of it contradicts the old one.
//! People and doors contradict only parts of a scan, or not for long, and errors of the odometry are not mistaken for it, because
//! the scans have to contradict each other even after any small correction.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Base, Odom, Pose};

use crate::outline::{Place, distance};
use crate::scan::{Beam, Scan};

/// Sum of the shares of both scans that must contradict each other.
const CONTRADICTED: f64 = 0.4;
/// Errors of the odometry between two scans to allow for: the length of a step, in metres and in radians, and the number of steps in
/// each direction.
const CORRECTION: [f64; 2] = [0.2, 0.1];
const CORRECTIONS: [i32; 2] = [1, 2];
/// Number of consecutive scans that must contradict the same earlier scan.
const PERSISTS: u32 = 10;
/// Distance, in metres, and number of scans after which a scan that does not contradict the earlier one replaces it.
const REPLACED_M: f64 = 0.4;
const REPLACED_AFTER: u32 = 20;
/// Distance, in metres, or angle, in radians, from the first scan beyond which the robot has set off.
const SET_OFF: f64 = 0.3;
/// Distance, in metres, by which a hit must lie within free space. It grows with the range, since errors of the heading do.
const WITHIN_M: f64 = 0.2;
const WITHIN_SHARE: f64 = 0.05;
/// Maximum number of beams of a scan to compare.
const MOST_BEAMS: usize = 240;
/// Angle, in radians, within which beams are compared.
const BESIDE_RAD: f64 = 0.05;
/// Minimum share of a scan's beams that must have hit something that the other scan shows as well. With fewer, nothing can be said.
const LEAST_HITS: f64 = 0.25;

/// A scan, and how later ones compare with it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Sweep {
    /// Pose of the laser.
    laser: Option<[f64; 3]>,
    /// Direction of beam 0 and angle from one beam to the next, in radians.
    beams_rad: [f64; 2],
    /// Maximum range of the laser, in metres.
    range_max_m: f64,
    /// Ranges, in metres: infinite without a return, and 0 if invalid.
    ranges_m: Vec<f32>,
    /// Number of scans since then.
    age: u32,
    /// Number of consecutive scans up to now that contradict this one.
    contradictions: u32,
}

impl Default for Sweep {
    /// Creates a sweep without a scan, with room for one.
    fn default() -> Self {
        let ranges_m = Vec::with_capacity(MOST_BEAMS);
        Self { laser: None, beams_rad: [0.0; 2], range_max_m: 0.0, ranges_m, age: 0, contradictions: 0 }
    }
}

/// Compares each scan with an earlier one. The whole state can be stored with serde.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct KidnapDetector {
    earlier: Sweep,
    /// Pose of the laser at the first scan, until the robot has set off.
    waits_at: Option<[f64; 3]>,
    /// Working memory for the new scan.
    #[serde(skip)]
    new: Sweep,
}

impl KidnapDetector {
    /// Processes a scan by a robot whose pose by odometry is `robot`. Returns true if somebody has carried the robot since the earlier
    /// scans. Before it sets off, a robot may be carried to where it is to start, which does not count. Invalid scans and poses are
    /// ignored.
    pub fn observe(&mut self, robot: Pose<Odom>, scan: &Scan<'_>) -> bool {
        let is_finite = [robot.x, robot.y, robot.yaw_rad].iter().all(|number| number.is_finite());
        if !is_finite || scan.check().is_err() || scan.step_rad == 0.0 {
            return false;
        }
        let Self { earlier, new, waits_at } = self;
        new.read(robot, scan);
        let is_first = earlier.laser.is_none();
        if is_first {
            *waits_at = new.laser;
        }
        waits_at.take_if(|[x, y, yaw_rad]| {
            let moved = Pose::<Odom>::new(*x, *y, *yaw_rad).motion_to(&new.laser());
            moved.x.hypot(moved.y).max(moved.yaw_rad.abs()) > SET_OFF
        });
        let is_contradicted = !is_first && contradict(earlier, new);
        let is_waiting = waits_at.is_some();
        (earlier.age, earlier.contradictions) =
            (earlier.age + 1, if is_contradicted { earlier.contradictions + 1 } else { 0 });
        let is_kidnapped = earlier.contradictions >= PERSISTS && !is_waiting;
        let is_old = distance(earlier.place(), new.place()) > REPLACED_M || earlier.age >= REPLACED_AFTER;
        if is_first || is_waiting || is_kidnapped || is_old && !is_contradicted {
            std::mem::swap(earlier, new);
        }
        is_kidnapped
    }
}

impl Sweep {
    fn read(&mut self, robot: Pose<Odom>, scan: &Scan<'_>) {
        let laser = robot.compose(&scan.base_from_laser);
        let every = scan.ranges_m.len().div_ceil(MOST_BEAMS).max(1);
        self.laser = Some([laser.x, laser.y, laser.yaw_rad]);
        self.beams_rad = [scan.first_rad, scan.step_rad * every as f64];
        self.range_max_m = scan.range_max_m;
        self.ranges_m.clear();
        self.ranges_m.reserve(MOST_BEAMS);
        self.ranges_m.extend((0..scan.ranges_m.len()).step_by(every).map(|index| match scan.beam(index) {
            Beam::Hit(range_m) => range_m as f32,
            Beam::Open => f32::INFINITY,
            Beam::Invalid => 0.0,
        }));
        (self.age, self.contradictions) = (0, 0);
    }

    fn laser(&self) -> Pose<Odom> {
        let [x, y, yaw_rad] = self.laser.unwrap_or_default();
        Pose::new(x, y, yaw_rad)
    }

    fn place(&self) -> Place {
        let [x, y, _] = self.laser.unwrap_or_default();
        [x, y]
    }

    /// Returns true if any beam has hit something.
    fn hits(&self) -> bool {
        self.ranges_m.iter().any(|range_m| is_hit(*range_m))
    }

    /// Returns true if a place, in the laser's frame, lies well within the free space of the scan, and false if it does not. `None` if
    /// the scan does not show it.
    fn frees(&self, [x, y]: [f64; 2]) -> Option<bool> {
        let [first_rad, step_rad] = self.beams_rad;
        let whole = std::f64::consts::TAU / step_rad.abs();
        let along = ((y.atan2(x) - first_rad) / step_rad).rem_euclid(whole).round() as usize;
        // A beam and its neighbours, because a beam between two of them may have hit an edge.
        let beside = ((BESIDE_RAD / step_rad.abs()) as usize).clamp(1, MOST_BEAMS);
        let near = self.ranges_m.get(along.saturating_sub(beside)..=along.saturating_add(beside))?;
        let free_m = near.iter().copied().fold(f32::INFINITY, f32::min);
        let range_m = x.hypot(y);
        if free_m == 0.0 || range_m > self.range_max_m {
            return None;
        }
        Some(range_m < f64::from(free_m).min(self.range_max_m) * (1.0 - WITHIN_SHARE) - WITHIN_M)
    }
}

fn is_hit(range_m: f32) -> bool {
    range_m.is_finite() && range_m > 0.0
}

/// Returns true if two scans contradict each other, whatever small error the odometry has made between them.
fn contradict(a: &Sweep, b: &Sweep) -> bool {
    let [m, rad] = CORRECTION;
    let [most, most_turns] = CORRECTIONS.map(|steps| -steps..=steps);
    let b_from_a = b.laser().motion_to(&a.laser());
    if !a.hits() || !b.hits() {
        // The laser may be covered.
        return false;
    }
    // Nearly all pairs of scans agree at once.
    is_contradiction(a, b, &b_from_a)
        && most_turns.into_iter().all(|turn| {
            most.clone().all(|x| {
                most.clone().all(|y| {
                    let [x, y, turn] = [m * f64::from(x), m * f64::from(y), rad * f64::from(turn)];
                    is_contradiction(a, b, &Pose::<Base>::new(x, y, turn).compose(&b_from_a))
                })
            })
        })
}

/// Returns true if the shares of each scan's hits that lie within the other's free space add up to enough. Scans with few hits say
/// nothing.
fn is_contradiction(a: &Sweep, b: &Sweep, b_from_a: &Pose<Base>) -> bool {
    let a_from_b = b_from_a.motion_to(&Pose::new(0.0, 0.0, 0.0));
    share_freed(a, b, b_from_a) + share_freed(b, a, &a_from_b) >= CONTRADICTED
}

/// Returns the share of the hits of one scan that lie within the free space of another.
fn share_freed(hits: &Sweep, free: &Sweep, free_from_hits: &Pose<Base>) -> f64 {
    let (sin, cos) = free_from_hits.yaw_rad.sin_cos();
    let [first_rad, step_rad] = hits.beams_rad;
    let (mut all, mut freed) = (0_u32, 0_u32);
    for (range_m, k) in hits.ranges_m.iter().zip(0_u32..).filter(|(range_m, _)| is_hit(**range_m)) {
        let angle_rad = first_rad + step_rad * f64::from(k);
        let (x, y) = (f64::from(*range_m) * angle_rad.cos(), f64::from(*range_m) * angle_rad.sin());
        let place = [free_from_hits.x + cos * x - sin * y, free_from_hits.y + sin * x + cos * y];
        if let Some(is_freed) = free.frees(place) {
            (all, freed) = (all + 1, freed + u32::from(is_freed));
        }
    }
    let least = LEAST_HITS * hits.ranges_m.len() as f64;
    if all > 0 && f64::from(all) >= least { f64::from(freed) / f64::from(all) } else { 0.0 }
}

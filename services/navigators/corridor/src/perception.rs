//! Interprets markers: which of them to remember, which two form a pair, how they move, and how far away they are.
//!
//! A pair is the nearest marker on the left and the nearest on the right, seen within 0.1 s of each other (Patil 2019, 3.2.2
//! and 3.2.3). "The marker's ID number is stored until the robot has moved past that particular set of markers" (3.2.2): with
//! [`Parameters::hold_s`] a pair is kept until neither of its markers is in view. The relations of a pair are, for each marker,
//! its QTC_B relation with the robot, which is at rest at the origin, and the class of its distance. Markers out of view are
//! remembered in the odometry frame.

use serde::{Deserialize, Serialize};
use sketchnav_qualitative::qtc::{QtcB, Sign};
use sketchnav_qualitative::{Point as Place, argd};
use sketchnav_schemas::geometry::{Base, Odom, Pose, wrap_angle};
use sketchnav_schemas::message::{MarkerView, PoseM, SeenMarker};

use crate::line::Line;
use crate::messages::{KnownMarker, MAX_KNOWN_MARKERS, PairedMarker, Relations, Trend};

/// Maximum time between the sightings of the two markers of a pair, in nanoseconds (Patil 2019, 3.2.3).
const PAIRED_NS: u64 = 100_000_000;
/// Maximum time between the two sightings that make a trend, in nanoseconds.
const TREND_NS: u64 = 250_000_000;
/// Minimum rate of images and ticks for detecting trends, in hertz.
pub const LEAST_HZ: f64 = 1e9 / TREND_NS as f64;
/// Tolerance, in nanoseconds, for two pictures that are closer together than their period, since timestamps are rounded.
const ROUNDING_NS: u64 = 1_000_000;
/// Sign of the lateral coordinate on the left and on the right.
const SIDES: [f64; 2] = [1.0, -1.0];
/// Weight of a new sighting in a marker's remembered pose. Sightings have errors, so a single one must not replace it.
const NEWEST: f64 = 0.3;

/// Parameters that a mission can set in its table `parameters.localizer`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// A distance that changes by no more than this between two sightings counts as unchanged, in metres
    /// (Patil 2019, 3.2.3).
    pub quantisation_m: f64,
    /// Thresholds of the distance classes, in metres (Patil 2019, 3.2.3).
    pub thresholds_m: [f64; 3],
    /// Whether a threshold is the upper bound of its class, as in QSRlib, or the lower bound, as in the thesis.
    pub thresholds_are_upper: bool,
    /// Time for which a marker is remembered while it is out of view, in seconds.
    pub memory_s: f64,
    /// Number of images to evaluate per second, evenly spaced, or 0 to evaluate every image.
    pub pair_rate_hz: f64,
    /// Time, in seconds, after which a pair counts as passed if neither of its markers was in view. With 0,
    /// pairs are not held, and each image forms its own.
    pub hold_s: f64,
    /// For `qtc-b-steady`: the age, in seconds, at which the weight of a sighting in a trend is 1/e.
    pub window_s: f64,
    /// For `qtc-b-steady`: the maximum speed of a distance that counts as unchanged, in metres per second.
    pub quantum_mps: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            quantisation_m: 0.01,
            thresholds_m: [3.0, 3.5, 4.0],
            thresholds_are_upper: true,
            memory_s: 120.0,
            pair_rate_hz: 0.0,
            hold_s: 0.0,
            window_s: 1.0,
            quantum_mps: 0.01,
        }
    }
}

/// How relations are computed.
#[derive(Debug, Clone)]
pub struct Terms {
    /// The mission's parameters.
    pub parameters: Parameters,
    /// Scale of distances that follows from these parameters.
    pub scale: argd::Scale,
    /// Whether trends are computed over many sightings instead of two.
    pub is_steady: bool,
}

impl Parameters {
    /// Returns the scale of distances.
    ///
    /// # Errors
    /// [`sketchnav_qualitative::Error`] if the thresholds are not positive and increasing, or if the
    /// quantisation is negative or not a number.
    pub fn scale(&self) -> Result<argd::Scale, sketchnav_qualitative::Error> {
        sketchnav_qualitative::Quantisation::distance(self.quantisation_m)?;
        let bound = if self.thresholds_are_upper { argd::Bound::Upper } else { argd::Bound::Lower };
        argd::Scale::new(crate::rules::CLASSES.into_iter().zip(self.thresholds_m), bound)
    }
}

/// A marker in memory.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Known {
    id: u32,
    /// Position and facing of the marker in the odometry frame.
    at: Pose<Odom>,
    seen_ns: u64,
    /// Position at the last sighting, in metres in the robot's frame at that time.
    now_m: [f64; 2],
    /// Position at the previous sighting, in metres in the robot's frame at that time, or `None` if it was
    /// too long ago for a trend.
    before_m: Option<[f64; 2]>,
    /// Line through the marker's recent distances from the camera.
    line: Line,
}

/// The markers that a robot has seen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Perception {
    /// The remembered markers, sorted by number.
    known: Vec<Known>,
    pairs: u64,
    /// Time at which the last pair was seen or, before the first pair, time of the first step.
    since_ns: Option<u64>,
    left: Member,
    right: Member,
    /// Numbers of the left and the right marker of the pair that is being held.
    held: Option<[u32; 2]>,
    /// Earliest time of the next image to evaluate.
    due_ns: u64,
}

/// A marker of the last pair.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct Member {
    id: u32,
    marker: u32,
    robot: u32,
    class: u32,
    place_m: [f64; 2],
}

impl Default for Perception {
    fn default() -> Self {
        let known = Vec::with_capacity(MAX_KNOWN_MARKERS);
        let (left, right) = (Member::default(), Member::default());
        Self { known, pairs: 0, since_ns: None, left, right, held: None, due_ns: 0 }
    }
}

impl Perception {
    /// Adds an image that was taken at `stamp_ns` by a robot at `robot`.
    pub fn see(&mut self, view: &MarkerView, robot: &Pose<Odom>, stamp_ns: u64, terms: &Terms) {
        if !self.is_due(stamp_ns, terms.parameters.pair_rate_hz) {
            return;
        }
        let camera_m = [view.camera_x_m, view.camera_y_m].map(f64::from);
        for marker in view.markers() {
            self.remember(marker, robot, camera_m, stamp_ns, terms.parameters.window_s);
        }
        let Some([left, right]) = self.pair(stamp_ns, terms.parameters.hold_s) else { return };
        // If neither marker of the pair is in this picture, the pair has been reported before.
        if left.seen_ns == stamp_ns || right.seen_ns == stamp_ns {
            (self.left, self.right) =
                (Member::of(&left, camera_m, terms), Member::of(&right, camera_m, terms));
            (self.pairs, self.since_ns) = (self.pairs + 1, Some(stamp_ns));
        }
    }

    /// Returns true if this picture should be evaluated. On average, `rate_hz` pictures per second are.
    fn is_due(&mut self, stamp_ns: u64, rate_hz: f64) -> bool {
        if rate_hz <= 0.0 {
            return true;
        }
        let is_due = stamp_ns + ROUNDING_NS >= self.due_ns;
        if is_due {
            self.due_ns = (self.due_ns + (1e9 / rate_hz) as u64).max(stamp_ns);
        }
        is_due
    }

    /// Returns the left and the right marker that are seen together, if any. While a pair is held, no other markers can form one.
    fn pair(&mut self, stamp_ns: u64, hold_s: f64) -> Option<[Known; 2]> {
        let age_ns = |known: &Known| stamp_ns.saturating_sub(known.seen_ns);
        if hold_s > 0.0
            && let Some(numbers) = self.held
        {
            let of = |id: u32| self.known.iter().find(|known| known.id == id).copied();
            let members = numbers.map(of);
            if members.iter().flatten().any(|known| age_ns(known) as f64 * 1e-9 <= hold_s) {
                let is_on = |side: usize| members[side].filter(|known| is_seen(known, SIDES[side], stamp_ns));
                return Some([is_on(0)?, is_on(1)?]);
            }
        }
        let nearest = |side: f64| {
            let distance = |known: &&Known| known.now_m[0].hypot(known.now_m[1]);
            let seen = self.known.iter().filter(|known| is_seen(known, side, stamp_ns));
            seen.min_by(|a, b| distance(a).total_cmp(&distance(b))).copied()
        };
        let pair = SIDES.map(nearest);
        self.held = pair[0].zip(pair[1]).map(|(left, right)| [left.id, right.id]);
        Some([pair[0]?, pair[1]?])
    }

    fn remember(
        &mut self,
        seen: &SeenMarker,
        robot: &Pose<Odom>,
        camera_m: [f64; 2],
        stamp_ns: u64,
        window_s: f64,
    ) {
        let [x, y, yaw_rad] = [seen.x_m, seen.y_m, seen.facing_rad].map(f64::from);
        let at = robot.compose(&Pose::<Base>::new(x, y, yaw_rad));
        let distance_m = (x - camera_m[0]).hypot(y - camera_m[1]);
        match self.known.binary_search_by_key(&seen.id, |known| known.id) {
            Ok(i) => {
                let known = &mut self.known[i];
                let is_recent = stamp_ns.saturating_sub(known.seen_ns) <= TREND_NS;
                known.before_m = is_recent.then_some(known.now_m);
                known.line.add(stamp_ns.saturating_sub(known.seen_ns) as f64 * 1e-9, distance_m, window_s);
                (known.now_m, known.seen_ns) = ([x, y], stamp_ns);
                let turn_rad = wrap_angle(at.yaw_rad - known.at.yaw_rad);
                known.at = Pose::new(
                    known.at.x + NEWEST * (at.x - known.at.x),
                    known.at.y + NEWEST * (at.y - known.at.y),
                    wrap_angle(known.at.yaw_rad + NEWEST * turn_rad),
                );
            }
            Err(_) => {
                self.make_room();
                let place = self.known.partition_point(|known| known.id < seen.id);
                let mut line = Line::default();
                line.add(0.0, distance_m, window_s);
                let known = Known { id: seen.id, at, seen_ns: stamp_ns, now_m: [x, y], before_m: None, line };
                self.known.insert(place, known);
            }
        }
    }

    /// Forgets the marker that has been out of view for longest, if the memory is full.
    fn make_room(&mut self) {
        if self.known.len() < MAX_KNOWN_MARKERS {
            return;
        }
        let oldest = self.known.iter().enumerate().min_by_key(|(_, known)| known.seen_ns).map(|(i, _)| i);
        if let Some(oldest) = oldest {
            self.known.remove(oldest);
        }
    }

    /// Forgets markers that have been out of view for longer than `memory_s`.
    pub fn forget(&mut self, stamp_ns: u64, memory_s: f64) {
        self.since_ns.get_or_insert(stamp_ns);
        self.known.retain(|known| stamp_ns.saturating_sub(known.seen_ns) as f64 * 1e-9 <= memory_s);
    }

    /// Fills in everything except the header of the message to be sent at `stamp_ns`, for a robot at `robot`.
    pub fn write(&self, robot: &Pose<Odom>, stamp_ns: u64, relations: &mut Relations) {
        relations.odometry = PoseM::new(robot);
        relations.pairs = self.pairs;
        relations.pair_age_s = stamp_ns.saturating_sub(self.since_ns.unwrap_or(stamp_ns)) as f64 * 1e-9;
        (relations.left, relations.right) = (self.left.message(), self.right.message());
        relations.marker_count = self.known.len() as u32;
        for (marker, known) in relations.markers.iter_mut().zip(&self.known) {
            let at = robot.motion_to(&known.at);
            let age_s = stamp_ns.saturating_sub(known.seen_ns) as f64 * 1e-9;
            *marker = KnownMarker {
                id: known.id,
                age_s: age_s as f32,
                x_m: at.x as f32,
                y_m: at.y as f32,
                facing_rad: at.yaw_rad as f32,
                reserved: 0,
            };
        }
    }
}

impl Member {
    /// Computes the relations of a marker with the camera, which represents the robot (Patil 2019, 3.2.3). A
    /// marker has no trend unless it was also seen just before.
    fn of(known: &Known, camera_m: [f64; 2], terms: &Terms) -> Self {
        let Terms { parameters, scale, is_steady } = terms;
        let from_camera = |at: [f64; 2]| [at[0] - camera_m[0], at[1] - camera_m[1]];
        let [x, y] = from_camera(known.now_m);
        let of_two = || {
            let (before, origin) = (from_camera(known.before_m?), Place::try_from([0.0, 0.0]).ok()?);
            let (before, now) = (Place::try_from(before).ok()?, Place::try_from([x, y]).ok()?);
            let [marker, robot] =
                QtcB::of([before, now], [origin, origin], parameters.quantisation_m).signs();
            Some([trend(marker), trend(robot)])
        };
        let of_many =
            || Some([known.line.trend(parameters.window_s, parameters.quantum_mps)?, Trend::Stable]);
        let trends = if *is_steady { of_many() } else { of_two() };
        let [marker, robot] = trends.unwrap_or([Trend::Unknown; 2]).map(Trend::code);
        let class = scale.rank(x.hypot(y)).place() as u32;
        Self { id: known.id, marker, robot, class, place_m: known.now_m }
    }

    fn message(&self) -> PairedMarker {
        let Self { id, marker, robot, class, place_m: [x_m, y_m] } = *self;
        PairedMarker { id, marker_trend: marker, robot_trend: robot, distance_class: class, x_m, y_m }
    }
}

/// Returns true if the marker is on the given side and has just been seen.
fn is_seen(known: &Known, side: f64, stamp_ns: u64) -> bool {
    known.now_m[1] * side > 0.0 && stamp_ns.saturating_sub(known.seen_ns) <= PAIRED_NS
}

fn trend(sign: Sign) -> Trend {
    match sign.symbol() {
        '-' => Trend::Towards,
        '+' => Trend::Away,
        _ => Trend::Stable,
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::*;

    fn view(markers: &[(u32, f32, f32)]) -> MarkerView {
        let mut view = MarkerView::zeroed();
        view.marker_count = markers.len() as u32;
        for (place, &(id, x_m, y_m)) in view.markers.iter_mut().zip(markers) {
            *place = SeenMarker { id, x_m, y_m, facing_rad: 0.0 };
        }
        view
    }

    fn terms(parameters: Parameters) -> Terms {
        Terms { parameters, scale: parameters.scale().unwrap(), is_steady: false }
    }

    fn said(perception: &Perception, robot: &Pose<Odom>, stamp_ns: u64) -> Relations {
        let mut relations = Relations::zeroed();
        perception.write(robot, stamp_ns, &mut relations);
        relations
    }

    #[test]
    fn the_nearest_marker_on_each_side_forms_a_pair_with_a_trend_after_two_sightings() {
        let (terms, mut perception) = (terms(Parameters::default()), Perception::default());
        let robot = Pose::new(0.0, 0.0, 0.0);
        let first = view(&[(1, 3.0, 1.0), (2, 2.0, 1.0), (3, 3.3, -1.0)]);
        perception.see(&first, &robot, 0, &terms);
        let relations = said(&perception, &robot, 0);
        assert_eq!((relations.pairs, relations.left.id, relations.right.id), (1, 2, 3));
        assert_eq!((relations.left.marker_trend(), relations.left.distance_class), (Trend::Unknown, 0));
        assert_eq!(relations.right.distance_class, 1, "3.45 m");
        let next = view(&[(2, 1.9, 1.0), (3, 3.3, -1.005)]);
        perception.see(&next, &robot, 100_000_000, &terms);
        let relations = said(&perception, &robot, 100_000_000);
        assert_eq!(
            (relations.left.marker_trend(), relations.left.robot_trend()),
            (Trend::Towards, Trend::Stable)
        );
        assert_eq!(relations.right.marker_trend(), Trend::Stable, "less than the quantisation");
        assert_eq!(relations.marker_count, 3);
    }

    #[test]
    fn one_side_is_not_a_pair_and_markers_out_of_view_are_remembered() {
        let (terms, mut perception) = (terms(Parameters::default()), Perception::default());
        perception.forget(0, terms.parameters.memory_s);
        perception.see(&view(&[(5, 2.0, 1.0)]), &Pose::new(0.0, 0.0, 0.0), 0, &terms);
        let moved = Pose::new(1.0, 0.0, 0.0);
        perception.see(&view(&[]), &moved, 3_000_000_000, &terms);
        let relations = said(&perception, &moved, 3_000_000_000);
        assert_eq!((relations.pairs, relations.pair_age_s), (0, 3.0));
        let marker = relations.markers()[0];
        assert!((marker.x_m - 1.0).abs() < 1e-6 && marker.age_s == 3.0, "{marker:?}");
        perception.forget(200_000_000_000, terms.parameters.memory_s);
        assert_eq!(said(&perception, &moved, 0).marker_count, 0);
    }

    /// A marker that came back into view after a minute used to be compared with its position from a minute before.
    #[test]
    fn a_marker_that_reappears_has_no_trend() {
        let (terms, mut perception) = (terms(Parameters::default()), Perception::default());
        let robot = Pose::new(0.0, 0.0, 0.0);
        let both = view(&[(2, 2.0, 1.0), (3, 3.0, -1.0)]);
        perception.see(&both, &robot, 0, &terms);
        perception.see(&view(&[(9, 3.0, 2.0)]), &robot, 50_000_000, &terms);
        assert_eq!(said(&perception, &robot, 50_000_000).pairs, 1, "neither of the pair is in this picture");
        perception.see(&both, &robot, 60_000_000_000, &terms);
        let relations = said(&perception, &robot, 60_000_000_000);
        assert_eq!((relations.pairs, relations.left.marker_trend()), (2, Trend::Unknown));
    }

    #[test]
    fn a_full_memory_forgets_the_oldest() {
        let (terms, mut perception) = (terms(Parameters::default()), Perception::default());
        let robot = Pose::new(0.0, 0.0, 0.0);
        for i in 0..100_u32 {
            perception.see(&view(&[(i * 7 % 100, 2.0, 1.0)]), &robot, u64::from(i), &terms);
        }
        let relations = said(&perception, &robot, 100);
        assert_eq!(relations.marker_count as usize, MAX_KNOWN_MARKERS);
        assert!(relations.markers().iter().all(|marker| marker.id != 0), "the first one is forgotten");
        assert!(relations.markers().is_sorted_by(|a, b| a.id < b.id));
    }

    /// The markers are staggered, so the left one leaves the view before the right one. Until the right one has left it, too,
    /// no other pair counts (Patil 2019, 3.2.2), although other markers are in view on both sides.
    #[test]
    fn a_pair_is_kept_until_neither_marker_is_in_view() {
        let robot = Pose::new(0.0, 0.0, 0.0);
        let pairs = |hold_s| {
            let terms = terms(Parameters { hold_s, ..Parameters::default() });
            let mut perception = Perception::default();
            let mut see = |tenth: u64, markers: &[(u32, f32, f32)]| {
                perception.see(&view(markers), &robot, tenth * 100_000_000, &terms);
                let relations = said(&perception, &robot, tenth * 100_000_000);
                (relations.pairs, relations.left.id, relations.right.id)
            };
            let [first, second] = [(1, 2.0, 1.0), (2, 3.0, 1.0)];
            let [right, next] = [(11, 2.5, -1.0), (12, 3.5, -1.0)];
            let mut pairs = vec![see(0, &[first, right])];
            pairs.extend((1..4).map(|tenth| see(tenth, &[second, right])));
            pairs.extend((4..11).map(|tenth| see(tenth, &[second, next])));
            pairs
        };
        let nearest = pairs(0.0);
        assert_eq!((nearest[2], nearest[4], nearest[10]), ((3, 2, 11), (5, 2, 11), (11, 2, 12)));
        let held = pairs(0.5);
        assert_eq!(held[1], (2, 1, 11), "the left one was seen a tenth of a second before");
        assert_eq!(held[2..9], [(2, 1, 11); 7], "the right one was seen half a second before");
        assert_eq!(held[9], (3, 2, 12));
    }

    /// The camera takes 30 pictures per second. The thesis issued 11.4, 10.8 and 20.5 commands per second (table 5.2), two for
    /// each pair, which makes 5.7, 5.4 and 10.3 pairs per second.
    #[test]
    fn pictures_are_evaluated_at_the_pair_rate() {
        let robot = Pose::new(0.0, 0.0, 0.0);
        let pairs = |pair_rate_hz| {
            let terms = terms(Parameters { pair_rate_hz, ..Parameters::default() });
            let mut perception = Perception::default();
            let both = view(&[(2, 2.0, 1.0), (3, 3.0, -1.0)]);
            (0..600).for_each(|picture| perception.see(&both, &robot, picture * 33_333_333, &terms));
            said(&perception, &robot, 600 * 33_333_333).pairs
        };
        assert_eq!([0.0, 10.0, 5.5, 60.0].map(pairs), [600, 200, 110, 600]);
    }

    /// Two markers approach by 8 cm and by half a centimetre per second and are seen five times per second, with errors that
    /// alternate between 2 cm too far and 2 cm too near. According to two sightings, both markers approach and recede in turn. The
    /// line through all sightings is not affected.
    #[test]
    fn a_steady_trend_is_the_mean_over_many_sightings() {
        let robot = Pose::new(0.0, 0.0, 0.0);
        let trends = |is_steady| {
            let terms = Terms { is_steady, ..terms(Parameters::default()) };
            let mut perception = Perception::default();
            let see = |k: u64| {
                let (time_s, error_m) = (k as f32 * 0.2, if k.is_multiple_of(2) { 0.02 } else { -0.02 });
                // On the diagonal, a step along both axes is longer by a factor of √2.
                let at = |mps: f32| (3.0 - mps * time_s + error_m) / std::f32::consts::SQRT_2;
                let [left, right] = [at(0.08), at(0.005)];
                perception.see(
                    &view(&[(2, left, left), (3, right, -right)]),
                    &robot,
                    k * 200_000_000,
                    &terms,
                );
                let relations = said(&perception, &robot, k * 200_000_000);
                [relations.left.marker_trend(), relations.right.marker_trend()]
            };
            (0..30).map(see).collect::<Vec<_>>()
        };
        let two = trends(false);
        assert_eq!((two[20], two[21]), ([Trend::Away; 2], [Trend::Towards; 2]));
        let many = trends(true);
        assert_eq!(many[4], [Trend::Unknown; 2], "not yet a second");
        assert!(many[20..].iter().all(|both| *both == [Trend::Towards, Trend::Stable]), "{many:?}");
    }
}

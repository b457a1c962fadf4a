//! Computes the figures of a recording: how accurate the estimates were, how the mission ended, and how long the services took.
//!
//! An estimate in a drawing is in pixels, so there are two ways to express its error in metres. The *metric* error is that of the
//! trajectory, converted to metres and aligned with the true one by a rotation and a translation. Pixels are converted by the map's
//! resolution if the drawing is the map of the world, and otherwise by the mean of the local scales along and across the walls. For
//! the *local* error, the true pose is mapped into the drawing by the best affine map of the whole trajectory. Its distance from
//! the estimate is converted to metres by the local scales of that estimate. This avoids counting the proportions of the drawing as
//! an error.

use std::collections::BTreeMap;

use serde::Serialize;
use sketchnav_schemas::codes::{Process, Tracking};
use sketchnav_schemas::geometry::{Point, Pose, World};
use sketchnav_schemas::message::{Health, Latency};
use sketchnav_schemas::mission::Mission;
use sketchnav_sketch::messages::{PoseEstimate, SketchMap};

use super::log::{Instant, Log};
use super::rooms::Rooms;
use super::trajectory::{self, NotAligned, Statistics};
use super::{Verdict, judge};

/// Number of estimates that a relative error spans: one second at ten scans per second.
pub const RELATIVE_STEPS: usize = 10;

/// The scale and position of a drawing in the world, for a drawing that is a map of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MetricMap {
    /// Metres per pixel.
    pub resolution_m: f64,
    /// Position of the drawing's lower left corner in the world, in metres.
    pub origin_m: [f64; 2],
}

/// The figures of a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figures {
    /// The verdict on the tasks, or `None` if no mission was driven in the recording.
    pub verdict: Option<Verdict>,
    /// Number of estimates that have a true pose of the same instant.
    pub estimates: usize,
    /// How the trajectory was converted to metres: `map` or `mean scales`.
    pub metres_by: &'static str,
    /// Why the trajectory could not be aligned with the true one although there are estimates. In this case, there is neither an
    /// absolute nor a local error.
    pub not_aligned: Option<NotAligned>,
    /// Absolute trajectory error after alignment, in metres.
    pub absolute_m: Option<Statistics>,
    /// Absolute trajectory error without alignment, in metres, if the drawing is a map of the world.
    pub unaligned_m: Option<Statistics>,
    /// Relative trajectory error over [`RELATIVE_STEPS`], in metres.
    pub relative_m: Option<Statistics>,
    /// Error in the local metric of the drawing, in metres.
    pub local_m: Option<Statistics>,
    /// How often the estimate is in the right room, if the rooms are known.
    pub rooms: Option<RoomFigures>,
    /// Number of times the robot began to touch something.
    pub collisions: usize,
    /// Effective sample size of the particles.
    pub effective_sample_size: Option<Statistics>,
    /// Local scale along the walls, in pixels per metre.
    pub scale_a_pxpm: Option<Statistics>,
    /// Local scale across the walls, in pixels per metre.
    pub scale_b_pxpm: Option<Statistics>,
    /// Share of estimates for each state in which the localizer reported its tracking to be.
    pub tracking: BTreeMap<&'static str, f64>,
    /// Wall-clock time from a message to the message that it caused, in milliseconds.
    pub latency_ms: BTreeMap<&'static str, Statistics>,
    /// Time that each process took per step, according to its health messages.
    pub stages: Vec<Stage>,
    /// Number of scans that no command responded to, or 0 if there are no commands at all, since no robot was driven in that case.
    pub unanswered_scans: u64,
}

/// How often the estimate is in the robot's true room.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RoomFigures {
    /// Number of estimates made while the robot actually was in one of the rooms.
    pub judged: usize,
    /// Number of these estimates that are in the same room of the drawing.
    pub right: usize,
    /// Share of right estimates in all judged ones.
    pub share: f64,
}

/// The wall-clock time that a process took for its steps.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stage {
    /// Name of the process. The localizer's time runs from the scan to the estimate, and the planner's from the estimate to the
    /// command.
    pub process: &'static str,
    /// Number of steps.
    pub steps: u64,
    /// Mean duration of a step, in milliseconds.
    pub mean_ms: f64,
    /// Median over seconds of the longest step in each second, in milliseconds.
    pub median_of_longest_ms: f64,
    /// Duration of the longest step, in milliseconds.
    pub max_ms: f64,
}

/// Computes the figures. `mission` is given if one was driven, `map` if the drawing is a map of the world, and `rooms` if they are
/// known.
pub fn figures(
    log: &Log,
    mission: Option<&Mission>,
    map: Option<MetricMap>,
    rooms: Option<&Rooms>,
) -> Figures {
    let instants = &log.instants;
    let of = |value: fn(&Instant) -> f64| Statistics::of(instants.iter().map(value));
    let (truth, estimate, metres_by) = metric(log, map);
    let not_aligned = not_aligned(log, &truth, &estimate);
    let is_aligned = not_aligned.is_none();
    let driven = mission.filter(|_| !log.status.is_empty());
    Figures {
        verdict: driven.map(|mission| judge(mission, &log.truth, &log.status, &log.contacts)),
        estimates: instants.len(),
        metres_by,
        absolute_m: is_aligned.then(|| absolute(&truth, &estimate)).flatten(),
        unaligned_m: map.and_then(|_| Statistics::of(trajectory::absolute(&truth, &estimate))),
        relative_m: Statistics::of(trajectory::relative(&truth, &estimate, RELATIVE_STEPS)),
        local_m: Statistics::of(local_errors_m(log)),
        not_aligned,
        rooms: rooms.zip(log.map()).map(|(rooms, sketch)| in_rooms(instants, rooms, sketch)),
        collisions: log.contacts.iter().filter(|contact| contact.begins == 1).count(),
        effective_sample_size: of(|i| i.effective_sample_size),
        scale_a_pxpm: of(|i| i.scales_pxpm[0]),
        scale_b_pxpm: of(|i| i.scales_pxpm[1]),
        tracking: tracking(instants),
        latency_ms: latencies(&log.latencies),
        stages: stages(&log.health),
        unanswered_scans: unanswered(log),
    }
}

/// Returns why the estimates could not be aligned with the truth, or `None` if they could, or if there are no estimates.
fn not_aligned(log: &Log, truth: &[Pose<World>], estimate: &[Pose<World>]) -> Option<NotAligned> {
    let estimates = log.estimates.len();
    if estimates == 0 {
        None
    } else if log.truth.is_empty() {
        Some(NotAligned::NoTruth { estimates })
    } else if !log.estimates.iter().any(PoseEstimate::is_placed) {
        Some(NotAligned::Unplaced)
    } else {
        trajectory::not_aligned(truth, estimate)
    }
}

fn absolute(truth: &[Pose<World>], estimate: &[Pose<World>]) -> Option<Statistics> {
    let aligned = trajectory::aligned(&trajectory::alignment(truth, estimate), estimate);
    Statistics::of(trajectory::absolute(truth, &aligned))
}

fn unanswered(log: &Log) -> u64 {
    if log.answered_scans == 0 { 0 } else { log.scans.saturating_sub(log.answered_scans) }
}

/// Returns the true and the estimated trajectory in metres, and the name of the conversion used for the estimated one.
pub fn metric(log: &Log, map: Option<MetricMap>) -> (Vec<Pose<World>>, Vec<Pose<World>>, &'static str) {
    let truth = log.instants.iter().map(|i| i.truth).collect();
    let (estimate, by) = match map {
        Some(map) => (log.instants.iter().map(|i| in_map(i, &map)).collect(), "map"),
        None => {
            (by_mean_scales(&log.instants, log.map().map_or(0.0, |s| s.wall_direction_rad)), "mean scales")
        }
    };
    (truth, estimate, by)
}

fn in_map(instant: &Instant, map: &MetricMap) -> Pose<World> {
    let Pose { x, y, yaw_rad, .. } = instant.estimate;
    let [x0, y0] = map.origin_m;
    Pose::new(x0 + x * map.resolution_m, y0 + y * map.resolution_m, yaw_rad)
}

fn by_mean_scales(instants: &[Instant], wall_direction_rad: f64) -> Vec<Pose<World>> {
    let n = instants.len().max(1) as f64;
    let mean = |axis: usize| (instants.iter().map(|i| i.scales_pxpm[axis].ln()).sum::<f64>() / n).exp();
    let scales = [mean(0), mean(1)];
    instants
        .iter()
        .map(|i| {
            let [x, y] = metres([i.estimate.x, i.estimate.y], scales, wall_direction_rad);
            Pose::new(x, y, i.estimate.yaw_rad)
        })
        .collect()
}

/// Converts a displacement from pixels to metres by R(φ) · diag(1/a, 1/b) · R(−φ), the inverse of Boniardi et al. 2015,
/// equation 1.
fn metres(px: [f64; 2], [a, b]: [f64; 2], wall_direction_rad: f64) -> [f64; 2] {
    let (sin, cos) = wall_direction_rad.sin_cos();
    let (along, across) = ((cos * px[0] + sin * px[1]) / a, (-sin * px[0] + cos * px[1]) / b);
    [cos * along - sin * across, sin * along + cos * across]
}

/// Returns the errors in the local metric of the drawing. Empty if the trajectory is too short or lies on a line.
pub fn local_errors_m(log: &Log) -> Vec<f64> {
    let (truth, estimate, _) = metric(log, None);
    match log.map() {
        Some(sketch) if not_aligned(log, &truth, &estimate).is_none() => fitted(&log.instants, sketch),
        _ => Vec::new(),
    }
}

/// Returns the errors relative to the best affine map. Empty if the trajectory lies on a line.
fn fitted(instants: &[Instant], sketch: &SketchMap) -> Vec<f64> {
    let truth: Vec<_> = instants.iter().map(|i| [i.truth.x, i.truth.y]).collect();
    let drawn: Vec<_> = instants.iter().map(|i| [i.estimate.x, i.estimate.y]).collect();
    let Some([row_x, row_y]) = trajectory::affine(&truth, &drawn) else { return Vec::new() };
    let at = |[a, b, c]: [f64; 3], [x, y]: [f64; 2]| a * x + b * y + c;
    let error = |((instant, t), d): ((&Instant, &[f64; 2]), &[f64; 2])| {
        let off = [d[0] - at(row_x, *t), d[1] - at(row_y, *t)];
        let [x, y] = metres(off, instant.scales_pxpm, sketch.wall_direction_rad);
        x.hypot(y)
    };
    instants.iter().zip(&truth).zip(&drawn).map(error).collect()
}

fn in_rooms(instants: &[Instant], rooms: &Rooms, sketch: &SketchMap) -> RoomFigures {
    let (mut judged, mut right) = (0, 0);
    for instant in instants {
        let Some(truly) = rooms.of_world(Point::new(instant.truth.x, instant.truth.y)) else { continue };
        judged += 1;
        let drawn = Point::new(instant.estimate.x, instant.estimate.y);
        right += usize::from(rooms.of_sketch(drawn, sketch.height_px.into()) == Some(truly));
    }
    RoomFigures { judged, right, share: right as f64 / judged.max(1) as f64 }
}

fn tracking(instants: &[Instant]) -> BTreeMap<&'static str, f64> {
    let mut shares = BTreeMap::new();
    for instant in instants {
        let word = Tracking::from_code(instant.tracking).map_or("unknown", Tracking::word);
        *shares.entry(word).or_insert(0.0) += 1.0 / instants.len() as f64;
    }
    shares
}

fn latencies(latencies: &[Latency]) -> BTreeMap<&'static str, Statistics> {
    let of =
        |ns: fn(&Latency) -> u64| Statistics::of(latencies.iter().map(|latency| ns(latency) as f64 / 1e6));
    let stages = [
        ("tick to situation", of(|latency| latency.situation_ns)),
        ("situation to command", of(|latency| latency.command_ns)),
        ("tick to command", of(|latency| latency.situation_ns + latency.command_ns)),
    ];
    stages.into_iter().filter_map(|(stage, ms)| Some((stage, ms?))).collect()
}

/// Computes the stages from health messages. Steps that a process took before it was killed and restarted count as well.
fn stages(health: &[Health]) -> Vec<Stage> {
    let mut lives: BTreeMap<u32, BTreeMap<u32, Vec<&Health>>> = BTreeMap::new();
    for message in health {
        lives.entry(message.process).or_default().entry(message.pid).or_default().push(message);
    }
    let stage = |(code, lives): (u32, BTreeMap<u32, Vec<&Health>>)| {
        let last = || lives.values().filter_map(|life| life.iter().max_by_key(|m| m.uptime_ns));
        let (steps, busy_ns) = (last().map(|m| m.steps).sum::<u64>(), last().map(|m| m.busy_ns).sum::<u64>());
        let longest =
            lives.values().flatten().filter(|m| m.step_max_ns > 0).map(|m| m.step_max_ns as f64 / 1e6);
        let longest = Statistics::of(longest)?;
        Some(Stage {
            process: Process::from_code(code)?.word(),
            steps,
            mean_ms: busy_ns as f64 / 1e6 / steps.max(1) as f64,
            median_of_longest_ms: longest.median,
            max_ms: longest.max,
        })
    };
    lives.into_iter().filter_map(stage).collect()
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;
    use sketchnav_schemas::message::GroundTruth;

    use super::*;

    /// Returns a log in which the robot drives around a corner while its estimate follows `at`.
    fn log(at: fn(f64) -> [f64; 2]) -> Log {
        let instants = (0..40).map(|i| {
            let way = f64::from(i) * 0.1;
            let truth = if way < 2.0 { [way, 0.0] } else { [2.0, way - 2.0] };
            let [x, y] = at(way);
            Instant {
                stamp_ns: i as u64,
                truth: Pose::new(truth[0], truth[1], 0.0),
                estimate: Pose::new(x, y, 0.0),
                scales_pxpm: [20.0, 20.0],
                effective_sample_size: 1.0,
                fit: 0.0,
                tracking: 1,
            }
        });
        Log {
            instants: instants.collect(),
            truth: vec![GroundTruth::zeroed()],
            estimates: vec![PoseEstimate::zeroed()],
            sketch: Some((SketchMap::zeroed(), Vec::new())),
            ..Log::default()
        }
    }

    /// Regression test: a log without ODOM lines was localized at a single point, and reported with "error in local metres 0.000
    /// m".
    #[test]
    fn a_fit_that_collapses_to_a_point_is_rejected() {
        let followed =
            figures(&log(|way| [20.0 * way.min(2.0), 20.0 * (way - 2.0).max(0.0)]), None, None, None);
        assert!(followed.not_aligned.is_none());
        assert!(followed.absolute_m.unwrap().rmse < 1e-6 && followed.local_m.unwrap().rmse < 1e-6);
        let stuck = figures(&log(|_| [3.0, 4.0]), None, None, None);
        assert!(stuck.absolute_m.is_none() && stuck.local_m.is_none(), "{stuck:?}");
        assert!(stuck.not_aligned.unwrap().to_string().contains("too short to align"));
        let unknown = figures(&Log { truth: Vec::new(), ..log(|_| [3.0, 4.0]) }, None, None, None);
        assert_eq!(unknown.not_aligned, Some(NotAligned::NoTruth { estimates: 1 }));
        let nowhere = PoseEstimate { tracking: Tracking::Lost.code(), ..Zeroable::zeroed() };
        let unplaced = Log { estimates: vec![nowhere], instants: Vec::new(), ..log(|_| [3.0, 4.0]) };
        assert_eq!(figures(&unplaced, None, None, None).not_aligned, Some(NotAligned::Unplaced));
    }
}

//! A robot drives through a small building and is tracked in drawings of the building. The drawings are stretched differently along
//! and across the corridor, are turned and wobbly, and lack the furniture.

mod support;

use sketchnav_schemas::codes::Tracking;
use sketchnav_schemas::geometry::{Pose, wrap_angle};
use sketchnav_sketch::filter::parameters::{Likelihood, Parameters};
use sketchnav_sketch::filter::{Estimate, Filter, Start};
use support::{Drawing, Drive, MAPPED, WAY, localizer_at};

/// A drawing with 21 pixels per metre along the corridor and 13 across.
const STRETCHED: Drawing = Drawing { size: [500, 500], a: 21.0, b: 13.0, turn_rad: 0.0, wobble_px: 0.0 };

/// The outcome of a drive.
struct Outcome {
    median_error_m: f64,
    final_error_m: f64,
    /// Mean of the logarithm of the ratio of estimated to true scale, in the last two thirds of the path.
    scale_a_error: f64,
    scale_b_error: f64,
    tracking: Tracking,
    trace: Vec<[u64; 5]>,
}

fn drive(drawing: Drawing, parameters: Parameters, seed: u64) -> Outcome {
    drive_with(drawing, parameters, seed, |_, _| ())
}

/// Drives the whole path and calls `meddle` after each step.
fn drive_with(
    drawing: Drawing,
    parameters: Parameters,
    seed: u64,
    mut meddle: impl FnMut(usize, &mut Filter),
) -> Outcome {
    let mut drive = Drive::new(drawing, parameters, seed);
    let (mut errors, mut scales, mut trace, mut tracking) = (vec![], vec![], vec![], Tracking::Waiting);
    for waypoint in WAY {
        while (waypoint[0] - drive.truth.x).hypot(waypoint[1] - drive.truth.y) > 0.1 {
            let (odometry, scan) = drive.advance(waypoint);
            let estimate = drive.localizer.step(&odometry, &scan);
            errors.push(error_m(&drawing, &drive, &estimate));
            scales.push([estimate.scale_a_pxpm / drawing.a, estimate.scale_b_pxpm / drawing.b]);
            trace.push(bits(&estimate));
            tracking = estimate.tracking;
            meddle(trace.len(), &mut drive.localizer);
        }
    }
    let final_error_m = *errors.last().unwrap();
    errors.sort_by(f64::total_cmp);
    let late = &scales[scales.len() / 3..];
    let mean = |i: usize| late.iter().map(|s| s[i].ln()).sum::<f64>() / late.len() as f64;
    let median_error_m = errors[errors.len() / 2];
    Outcome { median_error_m, final_error_m, scale_a_error: mean(0), scale_b_error: mean(1), tracking, trace }
}

fn error_m(drawing: &Drawing, drive: &Drive, estimate: &Estimate) -> f64 {
    let [x, y] = drawing.px([drive.truth.x, drive.truth.y]);
    let (sin, cos) = drawing.turn_rad.sin_cos();
    let (dx, dy) = (estimate.pose.x - x, estimate.pose.y - y);
    ((cos * dx + sin * dy) / drawing.a).hypot((cos * dy - sin * dx) / drawing.b)
}

fn bits(e: &Estimate) -> [u64; 5] {
    [e.pose.x, e.pose.y, e.pose.yaw_rad, e.scale_a_pxpm, e.fit].map(f64::to_bits)
}

fn assert_tracked(outcome: &Outcome, error_m: f64, scale_error: f64) {
    let Outcome { median_error_m, final_error_m, scale_a_error, scale_b_error, .. } = outcome;
    assert!(*median_error_m < error_m, "median error {median_error_m} m");
    assert!(*final_error_m < 2.0 * error_m, "final error {final_error_m} m");
    assert!(scale_a_error.abs() < scale_error, "scale a off by {scale_a_error}");
    assert!(scale_b_error.abs() < scale_error, "scale b off by {scale_b_error}");
}

#[test]
fn the_track_and_the_scales_are_found_in_a_stretched_drawing() {
    for seed in 1..=3 {
        let outcome = drive(STRETCHED, Parameters::default(), seed);
        assert_tracked(&outcome, 0.35, 0.25);
        assert_eq!(outcome.tracking, Tracking::Tracking);
    }
}

#[test]
fn a_turned_and_wobbly_drawing_is_no_obstacle() {
    let drawing = Drawing { size: [500, 500], a: 16.0, b: 24.0, turn_rad: 0.5, wobble_px: 3.0 };
    for seed in 1..=3 {
        assert_tracked(&drive(drawing, Parameters::default(), seed), 0.5, 0.3);
    }
}

#[test]
fn the_method_of_the_paper_tracks_too() {
    for seed in 1..=3 {
        let outcome = drive(STRETCHED, Parameters::paper(), seed);
        assert_eq!(Parameters::paper().likelihood, Likelihood::Field);
        assert_tracked(&outcome, 0.7, 0.35);
    }
}

#[test]
fn the_same_seed_gives_the_same_bits() {
    let bits = |seed| drive(STRETCHED, Parameters::default(), seed).trace;
    assert_eq!(bits(7), bits(7));
    assert_ne!(bits(7), bits(8));
}

#[test]
fn the_filter_goes_on_from_a_checkpoint() {
    let whole = drive(STRETCHED, Parameters::default(), 5);
    let resumed = drive_with(STRETCHED, Parameters::default(), 5, |step, localizer| {
        if step == 150 {
            let state = localizer.state().clone();
            let mut fresh = support::localizer(&STRETCHED, Parameters::default(), 99);
            fresh.restore(state);
            *localizer = fresh;
        }
    });
    assert_eq!(whole.trace, resumed.trace);
}

/// Drives along some waypoints. Returns the estimates with their errors in metres.
fn along(drive: &mut Drive, way: &[[f64; 2]]) -> Vec<(Estimate, f64)> {
    along_in(&MAPPED, drive, way)
}

/// Like [`along`], in another drawing.
fn along_in(drawing: &Drawing, drive: &mut Drive, way: &[[f64; 2]]) -> Vec<(Estimate, f64)> {
    let mut estimates = Vec::new();
    for waypoint in way {
        while (waypoint[0] - drive.truth.x).hypot(waypoint[1] - drive.truth.y) > 0.1 {
            let (odometry, scan) = drive.advance(*waypoint);
            let estimate = drive.localizer.step(&odometry, &scan);
            estimates.push((estimate, error_m(drawing, drive, &estimate)));
        }
    }
    estimates
}

/// Creates a robot that may be anywhere in the stretched drawing.
fn unmarked(seed: u64) -> Drive {
    Drive::anywhere_in(STRETCHED, Parameters::default(), seed)
}

/// The scales of the drawing are unknown as well. Until the particles agree on a place, the estimate means nothing. Sometimes they agree
/// on a wrong place, since rooms in a drawing look much alike. Only two doors tell this building from itself after half a turn.
#[test]
fn a_robot_anywhere_in_a_drawing_usually_finds_its_place() {
    let errors_m = [1, 2, 3, 4, 5, 6].map(|seed| {
        let mut drive = unmarked(seed);
        assert!(drive.localizer.is_unplaced());
        let first = along_in(&STRETCHED, &mut drive, &WAY[..1]);
        assert!(first.iter().all(|(estimate, _)| estimate.tracking == Tracking::Doubtful));
        let estimates = along_in(&STRETCHED, &mut drive, &WAY);
        let (last, error_m) = estimates.last().unwrap();
        if last.tracking == Tracking::Tracking { *error_m } else { f64::INFINITY }
    });
    assert!(errors_m.iter().filter(|error_m| **error_m < 0.7).count() >= 4, "{errors_m:?}");
}

/// Only the heading at the start is marked. Particles that are scattered later once had this heading too, however far the robot had
/// turned.
#[test]
fn particles_of_a_robot_whose_heading_was_marked_are_scattered_with_its_present_heading() {
    let mut drive = unmarked(1);
    let pose = Pose::new(250.0, 250.0, drive.truth.yaw_rad);
    let start = Start { spread_rad: 0.1, ..Start::anywhere(pose, STRETCHED.size) };
    drive.localizer = localizer_at(&STRETCHED, Parameters::default(), start, 1);
    let (mut furthest_rad, mut scans) = (0.0_f64, 0);
    for waypoint in WAY {
        while (waypoint[0] - drive.truth.x).hypot(waypoint[1] - drive.truth.y) > 0.1 {
            let (odometry, scan) = drive.advance(waypoint);
            drive.localizer.step(&odometry, &scan);
            if !drive.localizer.is_unplaced() {
                break;
            }
            let headings = &drive.localizer.particles().yaw_rad;
            let is_right = |yaw: &&f32| wrap_angle(f64::from(**yaw) - drive.truth.yaw_rad).abs() < 0.8;
            let right = headings.iter().filter(is_right).count();
            assert!(right * 100 > headings.len() * 97, "{right} of {}", headings.len());
            furthest_rad = furthest_rad.max(wrap_angle(drive.truth.yaw_rad - pose.yaw_rad).abs());
            scans += 1;
        }
    }
    assert!(scans > 50 && furthest_rad > 1.2, "{scans} scans, {furthest_rad} rad");
}

#[test]
fn a_robot_without_a_mark_goes_on_from_a_checkpoint() {
    let bits_of =
        |estimates: Vec<(Estimate, f64)>| estimates.iter().map(|(e, _)| bits(e)).collect::<Vec<_>>();
    let (mut whole, mut resumed) = (unmarked(2), unmarked(2));
    for way in [&WAY[..2], &WAY[2..8], &WAY[8..]] {
        let both = [&mut whole, &mut resumed].map(|drive| bits_of(along_in(&STRETCHED, drive, way)));
        assert_eq!(both[0], both[1]);
        let state = resumed.localizer.state().clone();
        resumed.localizer = unmarked(99).localizer;
        resumed.localizer.restore(state);
        assert_eq!(resumed.localizer.is_unplaced(), way.len() == 2, "it is found after the first stretch");
    }
}

#[test]
fn a_robot_anywhere_in_a_map_finds_its_place() {
    for seed in 1..=3 {
        let estimates = along(&mut Drive::anywhere(seed), &WAY);
        let (last, error_m) = estimates.last().unwrap();
        assert!(
            last.tracking == Tracking::Tracking && *error_m < 0.2,
            "{seed}: {last:?}, off by {error_m} m"
        );
    }
}

/// Somebody carries the robot from the last room to the first one, and its wheels do not notice.
#[test]
fn a_robot_that_is_carried_elsewhere_in_a_map_finds_its_place_again() {
    let mut drive = Drive::anywhere(1);
    let (_, error_m) = *along(&mut drive, &WAY).last().unwrap();
    assert!(error_m < 0.2, "{error_m} m before");
    drive.truth = Pose::new(WAY[0][0], WAY[0][1], 0.0);
    let estimates = along(&mut drive, &WAY[..9]);
    let wrong = estimates
        .iter()
        .rposition(|(estimate, error_m)| estimate.tracking != Tracking::Tracking || *error_m > 0.5);
    assert!(wrong.unwrap_or_default() < 250, "it finds itself within 25 s: {wrong:?}");
    let (last, error_m) = estimates.last().unwrap();
    assert!(last.tracking == Tracking::Tracking && *error_m < 0.2, "{last:?}, off by {error_m} m");
}

/// In a drawing, the particles are scattered over all of it. Where the robot started no longer matters.
#[test]
fn a_robot_that_is_carried_elsewhere_in_a_drawing_usually_finds_its_place_again() {
    let errors_m = [1, 2, 3, 4, 5, 6].map(|seed| {
        let mut drive = Drive::new(STRETCHED, Parameters::default(), seed);
        along_in(&STRETCHED, &mut drive, &WAY[..6]);
        assert!(!drive.localizer.is_unplaced());
        drive.truth = Pose::new(WAY[0][0], WAY[0][1], 0.0);
        let (odometry, _) = drive.advance(WAY[0]);
        drive.localizer.begin_elsewhere(&odometry);
        assert!(drive.localizer.is_unplaced());
        let estimates = along_in(&STRETCHED, &mut drive, &WAY);
        let (last, error_m) = estimates.last().unwrap();
        if last.tracking == Tracking::Tracking { *error_m } else { f64::INFINITY }
    });
    assert!(errors_m.iter().filter(|error_m| **error_m < 0.7).count() >= 4, "{errors_m:?}");
}

/// Until the robot knows a single place, the estimate is never one that it is sure of and wrong about.
#[test]
fn a_robot_anywhere_in_a_map_is_sure_of_no_wrong_place() {
    for seed in 4..=9 {
        let estimates = along(&mut Drive::anywhere(seed), &WAY[..5]);
        let wrong = estimates
            .iter()
            .filter(|(estimate, error_m)| estimate.tracking == Tracking::Tracking && *error_m > 0.5);
        assert_eq!(wrong.count(), 0, "{seed}");
    }
}

#[test]
fn a_search_goes_on_from_a_checkpoint() {
    let bits_of =
        |estimates: Vec<(Estimate, f64)>| estimates.iter().map(|(e, _)| bits(e)).collect::<Vec<_>>();
    let (mut whole, mut resumed) = (Drive::anywhere(2), Drive::anywhere(2));
    for drive in [&mut whole, &mut resumed] {
        along(drive, &WAY[..1]);
        (0..7).for_each(|_| {
            let (odometry, scan) = drive.advance(WAY[1]);
            drive.localizer.step(&odometry, &scan);
        });
    }
    let state = resumed.localizer.state().clone();
    resumed.localizer = Drive::anywhere(99).localizer;
    resumed.localizer.restore(state);
    assert_eq!(bits_of(along(&mut whole, &WAY[1..6])), bits_of(along(&mut resumed, &WAY[1..6])));
}

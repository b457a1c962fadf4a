//! Whether the contents of a message are valid: [`is_valid`](crate::message::Message::is_valid) of the messages
//! whose declaration names a function of this file. A channel's type is checked when it is opened; its contents
//! are whatever its writer put there, a real robot's driver among them.
//!
//! Readers reject counts beyond the list, numbers that are not finite, and headings that are no rotation. A
//! valid message can be recorded. Ranges follow REP 117: +∞ no return, −∞ too near, NaN invalid.

use crate::codes::{LandmarkEvent, RouteCommand};
use crate::message::{
    Description, DotView, Header, Journey, LandmarkProgress, LandmarkView, LaserScan, MAX_DOTS,
    MAX_KNOWN_MARKERS, MAX_MARKERS, MAX_MET_RELATIONS, MAX_REMEMBERED_PLACES, MAX_SEEN_OBJECTS, MAX_WORDS,
    MarkerView, Odometry, PoseEstimate, PoseM, PosePx, Relations, SonarScan, Tick, Twist, VelocityCommand,
};

/// Farther than any robot drives, metres or pixels.
const FAR: f64 = 1e7;
/// Most readings of a sensor between two ticks, on the average.
const MOST_READINGS: u64 = 1000;
/// What a quaternion's length may be off by.
const OFF_UNIT: f64 = 1e-3;

/// Ranges as many as are counted, of a sensor that can exist.
pub(crate) fn scan(scan: &LaserScan) -> bool {
    let Some((counted, behind)) = scan.ranges_m.split_at_checked(scan.beam_count as usize) else {
        return false;
    };
    let numbers = [
        scan.angle_min_rad,
        scan.angle_max_rad,
        scan.angle_increment_rad,
        scan.time_increment_s,
        scan.scan_time_s,
        scan.range_min_m,
        scan.range_max_m,
    ];
    timely(&scan.header)
        && numbers.iter().all(|v| v.abs() < FAR as f32)
        && scan.range_min_m >= 0.0
        && scan.range_max_m > scan.range_min_m
        && ranges(counted, behind)
}

/// Ranges as many as are counted, of cones that can exist.
pub(crate) fn sonar(scan: &SonarScan) -> bool {
    let Some((counted, behind)) = scan.ranges_m.split_at_checked(scan.sonar_count as usize) else {
        return false;
    };
    let numbers = [scan.angle_min_rad, scan.angle_increment_rad, scan.scan_time_s, scan.range_max_m];
    timely(&scan.header)
        && numbers.iter().all(|v| v.abs() < FAR as f32)
        && (0.0..=std::f32::consts::FRAC_PI_2).contains(&scan.half_opening_rad)
        && (0.0..FAR as f32).contains(&scan.ring_radius_m)
        && scan.range_min_m >= 0.0
        && scan.range_max_m > scan.range_min_m
        && ranges(counted, behind)
}

/// Markers as many as are counted, in the order of their numbers, of a camera that can exist.
pub(crate) fn markers(view: &MarkerView) -> bool {
    let count = view.marker_count as usize;
    let camera = [view.camera_x_m, view.camera_y_m, view.camera_yaw_rad, view.frame_time_s, view.range_max_m];
    let places = view.markers().iter().flat_map(|marker| [marker.x_m, marker.y_m, marker.facing_rad]);
    count <= MAX_MARKERS
        && timely(&view.header)
        && camera.into_iter().chain(places).all(|v| v.abs() < FAR as f32)
        && (0.0..=std::f32::consts::PI).contains(&view.half_view_rad)
        && view.range_min_m >= 0.0
        && view.range_max_m > view.range_min_m
        && view.markers().is_sorted_by(|a, b| a.id < b.id)
}

/// Dots as many as are counted, of a window that can exist.
pub(crate) fn view(view: &DotView) -> bool {
    let places = view.dots().iter().flat_map(|dot| [dot.x_m, dot.y_m]);
    view.dot_count as usize <= MAX_DOTS
        && timely(&view.header)
        && [view.side_m, view.margin_m, view.frame_time_s]
            .into_iter()
            .chain(places)
            .all(|v| v.abs() < FAR as f32)
        && view.side_m > 0.0
        && view.margin_m >= 0.0
}

/// Dots as many as are counted, and words that mean one of them or none.
pub(crate) fn description(description: &Description) -> bool {
    let places = description.dots().iter().flat_map(|dot| [dot.x_m, dot.y_m]);
    let count = description.dot_count;
    count as usize <= MAX_DOTS
        && places.into_iter().all(|v| v.abs() < FAR as f32)
        && description.meant[..MAX_WORDS].iter().all(|&dot| dot <= count)
}

/// A reference at a place that can be.
pub(crate) fn journey(journey: &Journey) -> bool {
    journey.has_reference <= 1
        && journey.cannot_locate <= 1
        && near([journey.reference_x_m, journey.reference_y_m])
}

/// Numbers that a driver can have reached by this tick: a reader of a tick waits for them.
pub(crate) fn tick(tick: &Tick) -> bool {
    let most = tick.header.seq.saturating_mul(MOST_READINGS);
    timely(&tick.header) && tick.newest.iter().all(|&newest| newest <= most)
}

/// A pose and a velocity.
pub(crate) fn odometry(odometry: &Odometry) -> bool {
    timely(&odometry.header) && metres(&odometry.pose) && twist(&odometry.twist)
}

/// Two poses and two scales.
pub(crate) fn estimate(estimate: &PoseEstimate) -> bool {
    let scales = [estimate.scale_a_pxpm, estimate.scale_b_pxpm];
    pixels(&estimate.pose)
        && metres(&estimate.odometry)
        && scales.iter().all(|scale| (0.0..FAR).contains(scale))
}

/// A pose, a pair and markers, as many as are counted.
pub(crate) fn relations(relations: &Relations) -> bool {
    let places = relations.markers().iter().flat_map(|marker| [marker.x_m, marker.y_m, marker.facing_rad]);
    let pair = [&relations.left, &relations.right];
    relations.marker_count as usize <= MAX_KNOWN_MARKERS
        && metres(&relations.odometry)
        && (0.0..FAR).contains(&relations.pair_age_s)
        && pair.iter().all(|marker| near([marker.x_m, marker.y_m]))
        && places.into_iter().all(|v| v.abs() < FAR as f32)
        && relations.markers().is_sorted_by(|a, b| a.id < b.id)
}

/// Two poses, ranges in sixteen directions, objects and places, as many as are counted.
pub(crate) fn landmark_view(view: &LandmarkView) -> bool {
    /// Greatest place of an object, and widest histogram.
    const MOST: (u32, f64) = (63, 180.0);
    let is_range = |range: &f64| *range == f64::INFINITY || (0.0..FAR).contains(range);
    view.object_count as usize <= MAX_SEEN_OBJECTS
        && view.place_count as usize <= MAX_REMEMBERED_PLACES
        && metres(&view.odometry)
        && metres(&view.in_sketch)
        && [view.stretch, view.spread_m].iter().all(|v| (0.0..FAR).contains(v))
        && (0.0..=1.0).contains(&view.fit)
        && view.sectors_m.iter().all(is_range)
        && view.objects().iter().all(|one| {
            one.place <= MOST.0
                && (0.0..FAR).contains(&one.proximity_m)
                && (0.0..=MOST.1).contains(&one.width)
        })
        && view.places().as_flattened().iter().all(|v| v.abs() < FAR as f32)
}

/// Lengths, a state of the route, and relations, as many as are counted.
pub(crate) fn landmark_progress(progress: &LandmarkProgress) -> bool {
    progress.met_count as usize <= MAX_MET_RELATIONS
        && near([progress.along_m, progress.length_m])
        && progress.next <= progress.state_count
        && RouteCommand::from_code(progress.command).is_some()
        && LandmarkEvent::from_code(progress.event).is_some()
}

/// A velocity.
pub(crate) fn command(command: &VelocityCommand) -> bool {
    twist(&command.twist)
}

/// Whether the stamp has room in a recorded message.
fn timely(header: &Header) -> bool {
    header.stamp_ns / 1_000_000_000 <= i32::MAX as u64
}

/// Whether there are ranges, each a distance or what REP 117 says, and nothing behind them.
fn ranges(counted: &[f32], behind: &[f32]) -> bool {
    let is_range = |range: &f32| !range.is_finite() || (0.0..FAR as f32).contains(range);
    !counted.is_empty() && counted.iter().all(is_range) && behind.iter().all(|range| range.to_bits() == 0)
}

fn metres(pose: &PoseM) -> bool {
    near([pose.x_m, pose.y_m]) && rotation([pose.orientation_z, pose.orientation_w])
}

fn pixels(pose: &PosePx) -> bool {
    near([pose.x_px, pose.y_px]) && rotation([pose.orientation_z, pose.orientation_w])
}

fn twist(twist: &Twist) -> bool {
    near([twist.vx_mps, twist.vy_mps]) && twist.yaw_rate_radps.abs() < FAR
}

/// False for NaN too.
fn near(numbers: [f64; 2]) -> bool {
    numbers.iter().all(|v| v.abs() < FAR)
}

fn rotation([z, w]: [f64; 2]) -> bool {
    (z.hypot(w) - 1.0).abs() < OFF_UNIT
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::Message;
    use crate::ros2::Ros2;
    use bytemuck::Zeroable;

    fn valid_scan() -> LaserScan {
        let mut scan = LaserScan::zeroed();
        (scan.angle_min_rad, scan.angle_max_rad, scan.angle_increment_rad) = (-1.0, 1.0, 0.5);
        (scan.range_max_m, scan.beam_count) = (5.0, 5);
        scan
    }

    /// A way to spoil a message.
    type Spoil<T> = fn(&mut T);

    fn rejected<T: Message>(valid: T, spoils: &[Spoil<T>]) {
        assert!(valid.is_valid());
        for (i, spoil) in spoils.iter().enumerate() {
            let mut spoilt = valid;
            spoil(&mut spoilt);
            assert!(!spoilt.is_valid(), "{} {i}", T::NAME);
        }
    }

    #[test]
    fn relations_hold_as_many_markers_as_they_count() {
        let mut valid = Relations::zeroed();
        valid.odometry.orientation_w = 1.0;
        valid.marker_count = 2;
        (valid.markers[0].id, valid.markers[1].id) = (1, 2);
        rejected(
            valid,
            &[
                |relations| relations.marker_count = 65,
                |relations| relations.markers[1].id = 1,
                |relations| relations.markers[0].x_m = f32::NAN,
                |relations| relations.left.y_m = f64::INFINITY,
                |relations| relations.pair_age_s = -1.0,
                |relations| relations.odometry.orientation_w = 0.0,
            ],
        );
    }

    #[test]
    fn a_view_of_landmarks_has_objects_at_places_that_exist() {
        let mut valid = LandmarkView::zeroed();
        (valid.odometry.orientation_w, valid.in_sketch.orientation_w) = (1.0, 1.0);
        (valid.object_count, valid.place_count, valid.sectors_m[3]) = (1, 1, f64::INFINITY);
        rejected(
            valid,
            &[
                |view| view.object_count = 17,
                |view| view.place_count = 49,
                |view| view.objects[0].place = 64,
                |view| view.objects[0].width = 181.0,
                |view| view.objects[0].proximity_m = -1.0,
                |view| view.places_m[0][1] = f32::NAN,
                |view| view.sectors_m[0] = f64::NAN,
                |view| view.sectors_m[0] = -0.5,
                |view| view.in_sketch.orientation_w = 0.0,
                |view| view.fit = 1.5,
                |view| view.stretch = f64::NAN,
            ],
        );
    }

    #[test]
    fn progress_along_landmarks_is_within_its_route() {
        let mut valid = LandmarkProgress::zeroed();
        (valid.next, valid.state_count) = (3, 3);
        rejected(
            valid,
            &[
                |progress| progress.next = 4,
                |progress| progress.command = 4,
                |progress| progress.event = 4,
                |progress| progress.met_count = 65,
                |progress| progress.along_m = f64::INFINITY,
            ],
        );
    }

    #[test]
    fn a_view_has_each_marker_once_and_a_camera_that_can_be() {
        let mut valid = MarkerView::zeroed();
        (valid.half_view_rad, valid.range_min_m, valid.range_max_m) = (0.5, 0.8, 3.5);
        assert!(valid.is_valid(), "no marker is in view");
        valid.marker_count = 2;
        (valid.markers[0].id, valid.markers[1].id, valid.markers[1].x_m) = (3, 7, 2.0);
        rejected(
            valid,
            &[
                |view| view.marker_count = 33,
                |view| view.markers[1].id = 3,
                |view| view.markers[0].y_m = f32::NAN,
                |view| view.markers[1].facing_rad = f32::INFINITY,
                |view| view.half_view_rad = -0.1,
                |view| view.range_max_m = 0.8,
                |view| view.camera_x_m = f32::NAN,
            ],
        );
    }

    #[test]
    fn a_view_of_dots_has_as_many_as_it_counts_and_words_mean_one_of_them() {
        let mut valid = DotView::zeroed();
        (valid.side_m, valid.dot_count, valid.dots[1].x_m) = (0.1, 2, -0.05);
        rejected(
            valid,
            &[
                |view| view.dot_count = 65,
                |view| view.side_m = 0.0,
                |view| view.margin_m = -0.1,
                |view| view.dots[1].y_m = f32::NAN,
                |view| view.header.stamp_ns = u64::MAX,
            ],
        );
        let mut valid = Description::zeroed();
        (valid.dot_count, valid.meant[3]) = (2, 2);
        rejected(
            valid,
            &[
                |described| described.dot_count = 65,
                |described| described.meant[0] = 3,
                |described| described.dots[0].x_m = f32::INFINITY,
            ],
        );
        let spoils: [Spoil<Journey>; 2] =
            [|journey| journey.has_reference = 2, |journey| journey.reference_x_m = f64::NAN];
        rejected(Journey::zeroed(), &spoils);
    }

    #[test]
    fn a_scan_has_as_many_ranges_as_it_says_and_a_sensor_that_can_be() {
        let mut valid = valid_scan();
        valid.ranges_m[..4].copy_from_slice(&[f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 4.9]);
        rejected(
            valid,
            &[
                |scan| scan.beam_count = 0,
                |scan| scan.beam_count = 1441,
                |scan| scan.beam_count = u32::MAX,
                |scan| scan.angle_increment_rad = f32::NAN,
                |scan| scan.angle_min_rad = f32::INFINITY,
                |scan| scan.range_max_m = 0.0,
                |scan| scan.range_min_m = -1.0,
                |scan| scan.ranges_m[4] = -0.5,
                |scan| scan.ranges_m[4] = 1e30,
                |scan| scan.ranges_m[5] = 1.0,
                |scan| scan.header.stamp_ns = u64::MAX,
            ],
        );
    }

    #[test]
    fn a_sonar_ring_has_as_many_ranges_as_it_says_and_cones_that_can_be() {
        let mut valid = SonarScan::zeroed();
        (valid.sonar_count, valid.half_opening_rad, valid.range_max_m) = (4, 0.2, 6.0);
        valid.ranges_m[..3].copy_from_slice(&[f32::INFINITY, f32::NEG_INFINITY, 5.0]);
        rejected(
            valid,
            &[
                |scan| scan.sonar_count = 0,
                |scan| scan.sonar_count = 33,
                |scan| scan.half_opening_rad = 3.0,
                |scan| scan.half_opening_rad = f32::NAN,
                |scan| scan.ring_radius_m = -1.0,
                |scan| scan.angle_increment_rad = f32::INFINITY,
                |scan| scan.range_max_m = 0.0,
                |scan| scan.range_min_m = f32::NAN,
                |scan| scan.ranges_m[3] = -0.5,
                |scan| scan.ranges_m[4] = 1.0,
                |scan| scan.header.stamp_ns = u64::MAX,
            ],
        );
    }

    /// A driver left old ranges behind those that count. It drove well and had no scan in its recording: the
    /// navigators accepted what the recorder rejected.
    #[test]
    fn what_is_valid_can_be_recorded() {
        let spoils: [Spoil<LaserScan>; 6] = [
            |_| {},
            |scan| scan.ranges_m[5] = 1.0,
            |scan| scan.ranges_m[1439] = -0.0,
            |scan| scan.beam_count = 4,
            |scan| scan.header.stamp_ns = (1 << 31) * 1_000_000_000 - 1,
            |scan| scan.header.stamp_ns = (1 << 31) * 1_000_000_000,
        ];
        let is_both = spoils.map(|spoil| {
            let mut scan = valid_scan();
            scan.ranges_m[4] = 1.0;
            (scan.header.seq, scan.header.source_seq) = (1, 1);
            spoil(&mut scan);
            let is_recordable = scan.to_cdr(&[], &mut Vec::new()).is_ok();
            assert_eq!(scan.is_valid(), is_recordable);
            is_recordable
        });
        assert_eq!(is_both, [true, false, false, false, true, false]);
    }

    #[test]
    fn a_pose_is_a_place_and_a_rotation() {
        let mut odometry = Odometry::zeroed();
        odometry.pose.orientation_w = -1.0;
        rejected(
            odometry,
            &[
                |odometry| odometry.pose.orientation_w = 0.0,
                |odometry| odometry.pose.orientation_z = f64::NAN,
                |odometry| odometry.pose.x_m = f64::INFINITY,
                |odometry| odometry.pose.y_m = -1e300,
                |odometry| odometry.twist.yaw_rate_radps = f64::NAN,
                |odometry| odometry.header.stamp_ns = u64::MAX,
            ],
        );
        let mut estimate = PoseEstimate::zeroed();
        (estimate.pose.orientation_w, estimate.odometry.orientation_z) = (1.0, 1.0);
        rejected(
            estimate,
            &[
                |estimate| estimate.pose.x_px = f64::NAN,
                |estimate| estimate.scale_a_pxpm = -1.0,
                |estimate| estimate.scale_b_pxpm = f64::NAN,
                |estimate| estimate.odometry.orientation_z = 0.5,
            ],
        );
        rejected(VelocityCommand::zeroed(), &[|command| command.twist.vx_mps = f64::NAN]);
    }
}

//! Writes trajectories as text for other programs.

use std::fmt::Write;

use sketchnav_schemas::geometry::{Pose, World};
use sketchnav_schemas::time::seconds;

use super::figures::{MetricMap, local_errors_m, metric};
use super::log::Log;

/// Returns one line per pose in the format of the TUM benchmark and evo: time, position and quaternion.
pub fn tum(stamps_ns: impl IntoIterator<Item = u64>, poses: &[Pose<World>]) -> String {
    let mut text = String::new();
    for (ns, pose) in stamps_ns.into_iter().zip(poses) {
        let (sin, cos) = (pose.yaw_rad / 2.0).sin_cos();
        let (s, rest) = (ns / 1_000_000_000, ns % 1_000_000_000);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{s}.{rest:09} {} {} 0 0 0 {sin} {cos}", pose.x, pose.y);
    }
    text
}

/// Returns one line per estimate: time, truth, estimate in the drawing, scales, effective sample size, fit and local error.
pub fn csv(log: &Log) -> String {
    let mut text = String::from(
        "stamp_s,truth_x_m,truth_y_m,truth_yaw_rad,estimate_x_px,estimate_y_px,estimate_yaw_rad,scale_a_pxpm,scale_b_pxpm,effective_sample_size,fit,local_error_m\n",
    );
    let errors = local_errors_m(log);
    for (i, instant) in log.instants.iter().enumerate() {
        let (t, e, [a, b]) = (&instant.truth, &instant.estimate, instant.scales_pxpm);
        let error = errors.get(i).map_or(String::new(), f64::to_string);
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{},{a},{b},{},{},{error}",
            seconds(instant.stamp_ns),
            t.x,
            t.y,
            t.yaw_rad,
            e.x,
            e.y,
            e.yaw_rad,
            instant.effective_sample_size,
            instant.fit,
        );
    }
    text
}

/// Returns the true and the estimated trajectory in metres, without aligning them, each in the format of [`tum`].
pub fn tum_pair(log: &Log, map: Option<MetricMap>) -> (String, String) {
    let (truth, estimate, _) = metric(log, map);
    let stamps = || log.instants.iter().map(|instant| instant.stamp_ns);
    (tum(stamps(), &truth), tum(stamps(), &estimate))
}

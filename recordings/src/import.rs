//! A laser log becomes a recording: scans, odometry, the reference poses as truth, and the drawing that they
//! are to be localized in.

use std::io::Write;

use bytemuck::Zeroable;
use sketchnav_schemas::channels::{self, ODOMETRY, ROUTE, SCAN, SKETCH, TICK, TRUTH};
use sketchnav_schemas::message::{
    GroundTruth, Header, LaserScan, Odometry, PoseM, Route, SketchMap, Tick, Twist,
};
use sketchnav_schemas::time::nanoseconds;

use crate::carmen::{CarmenError, CarmenScan};
use crate::error::RecordingError;
use crate::writer::Writer;

/// What a scan of the log does not say of its laser.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LaserFacts {
    /// Direction of the first beam.
    pub angle_min_rad: f64,
    /// From one beam to the next.
    pub angle_increment_rad: f64,
    /// Shortest range.
    pub range_min_m: f64,
    /// Longest range; a reading from there on is none.
    pub range_max_m: f64,
}

impl LaserFacts {
    /// CARMEN's lasers cover half a circle, from the right. Scans of 181 and 361 beams include both its edges; scans
    /// of 180 and 360 leave the last one out.
    pub fn of_half_circle(beams: usize, range_max_m: f64) -> Self {
        let gaps = if beams % 2 == 1 { beams - 1 } else { beams };
        Self {
            angle_min_rad: -std::f64::consts::FRAC_PI_2,
            angle_increment_rad: std::f64::consts::PI / gaps.max(1) as f64,
            range_min_m: 0.0,
            range_max_m,
        }
    }
}

/// Why a log cannot be taken over.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The log.
    #[error(transparent)]
    Carmen(#[from] CarmenError),
    /// The recording.
    #[error(transparent)]
    Recording(#[from] RecordingError),
}

/// Writes the scans of a log as a recording of `run`, still to be finished; how many they are.
///
/// # Errors
/// [`ImportError`].
pub fn import<W: Write>(
    scans: impl Iterator<Item = Result<CarmenScan, CarmenError>>,
    laser: &LaserFacts,
    (sketch, cells): (&SketchMap, &[u8]),
    route: &Route,
    writer: &mut Writer<W>,
) -> Result<u64, ImportError> {
    writer.write(SKETCH, sketch, cells)?;
    writer.write(ROUTE, route, &[])?;
    let (mut first_s, mut last_ns, mut count) = (None, None, 0);
    for scan in scans {
        let scan = scan?;
        let since_s = scan.time_s - *first_s.get_or_insert(scan.time_s);
        let stamp_ns = after(last_ns, nanoseconds(since_s));
        last_ns = Some(stamp_ns);
        count += 1;
        put(&scan, Header { seq: count, stamp_ns, source_seq: count }, laser, writer)?;
    }
    Ok(count)
}

/// Clocks of old logs go back at times; stamps never do.
fn after(last_ns: Option<u64>, ns: u64) -> u64 {
    last_ns.map_or(ns, |last| ns.max(last + 1))
}

fn put<W: Write>(
    scan: &CarmenScan,
    header: Header,
    laser: &LaserFacts,
    writer: &mut Writer<W>,
) -> Result<(), RecordingError> {
    let twist = Twist::zeroed();
    writer.write(TRUTH, &GroundTruth { header, pose: PoseM::new(&scan.reference), twist }, &[])?;
    writer.write(ODOMETRY, &Odometry { header, pose: PoseM::new(&scan.odometry), twist }, &[])?;
    let mut message = LaserScan { header, ..LaserScan::zeroed() };
    let beams = scan.ranges_m.len();
    message.angle_min_rad = laser.angle_min_rad as f32;
    message.angle_increment_rad = laser.angle_increment_rad as f32;
    message.angle_max_rad = (laser.angle_min_rad + laser.angle_increment_rad * (beams - 1) as f64) as f32;
    message.range_min_m = laser.range_min_m as f32;
    message.range_max_m = laser.range_max_m as f32;
    message.beam_count = beams as u32;
    for (range, found) in message.ranges_m.iter_mut().zip(&scan.ranges_m) {
        *range = if f64::from(*found) < laser.range_max_m { *found } else { f32::INFINITY };
    }
    writer.write(SCAN, &message, &[])?;
    writer.write(TICK, &tick(header), &[]).map(drop)
}

/// Every reading of a log bears the number of its tick.
fn tick(header: Header) -> Tick {
    let mut tick = Tick { header, ..Tick::zeroed() };
    for (newest, sensor) in tick.newest.iter_mut().zip(channels::sensors()) {
        if *sensor == *SCAN.spec || *sensor == *ODOMETRY.spec {
            *newest = header.seq;
        }
    }
    tick
}

/// The name that the runs of imported logs have in the place of a system's: nobody drove them.
pub const LOG_SYSTEM: &str = "log";

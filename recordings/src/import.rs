//! Converts a laser log into a recording with scans, odometry, the reference poses as ground truth, and the drawing in which
//! the scans are to be localized.

use std::io::Write;

use bytemuck::Zeroable;
use sketchnav_schemas::channels::{self, ODOMETRY, SCAN, TICK, TRUTH};
use sketchnav_schemas::message::{GroundTruth, Header, LaserScan, Message, Odometry, PoseM, Tick, Twist};
use sketchnav_schemas::time::nanoseconds;

use crate::carmen::{CarmenError, CarmenScan, Entry, Fault, LeftOut, Shapes};
use crate::error::RecordingError;
use crate::writer::Writer;

/// Maximum number of omissions that are listed with their lines. Any further ones are only counted.
const MAX_NAMED: usize = 1000;
/// A scan without any reading beyond this distance, in metres, counts as blind. Lasers report 0 if they have no reading.
const NEAREST_M: f32 = 0.01;
/// Latest timestamp of a recorded message, in seconds.
const MAX_STAMP_S: f64 = i32::MAX as f64;

/// The rules for importing a log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rules {
    /// Readings of this distance or more count as no return, in metres. A shorter maximum range stated in the
    /// log takes precedence.
    pub range_max_m: f64,
    /// True if leaving anything out is an error.
    pub is_strict: bool,
}

impl Default for Rules {
    /// Returns a maximum range of 79 m, since the lasers of most logs report 79 m or more if nothing returns.
    fn default() -> Self {
        Self { range_max_m: 79.0, is_strict: false }
    }
}

/// A summary of an import: what was imported, and what was left out.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Imported {
    /// Number of scans.
    pub scans: u64,
    /// The scans by the directions of their beams.
    pub shapes: Shapes,
    /// Number of lines that were left out.
    pub left_out_lines: u64,
    /// The first of the lines that were left out.
    pub left_out: Vec<LeftOut>,
    /// Number of readings that were left out of imported scans.
    pub left_out_readings: u64,
    /// The lines of the first scans with such readings, each with the number of these readings.
    pub unreadable: Vec<(u64, usize)>,
    /// Number of times that the log's clock goes back. Scans with an earlier time are stamped one nanosecond after the previous
    /// scan.
    pub clock_goes_back: u64,
    /// Number of times that the log's clock does not advance. Such a scan also gets a timestamp one nanosecond after that of the
    /// previous scan.
    pub clock_stands: u64,
    /// Number of scans without a single distance below the maximum range.
    pub blind: u64,
}

/// The reason why a log cannot be imported.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The log cannot be read.
    #[error(transparent)]
    Carmen(#[from] CarmenError),
    /// The recording cannot be written.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A line cannot be imported, and nothing may be left out.
    #[error("line {0}")]
    LeftOut(LeftOut),
    /// Readings cannot be imported, and nothing may be left out.
    #[error("line {line}: expected distances in metres, found {count} readings that are not distances")]
    Readings {
        /// The line.
        line: u64,
        /// Number of readings.
        count: usize,
    },
}

impl Imported {
    fn leave_out(&mut self, left_out: LeftOut, rules: &Rules) -> Result<(), ImportError> {
        if rules.is_strict {
            return Err(ImportError::LeftOut(left_out));
        }
        self.left_out_lines += 1;
        if self.left_out.len() < MAX_NAMED {
            self.left_out.push(left_out);
        }
        Ok(())
    }

    fn count(&mut self, scan: &CarmenScan, rules: &Rules) -> Result<(), ImportError> {
        let (line, count) = (scan.line, scan.unreadable());
        if count > 0 && rules.is_strict {
            return Err(ImportError::Readings { line, count });
        }
        if count > 0 && self.unreadable.len() < MAX_NAMED {
            self.unreadable.push((line, count));
        }
        self.left_out_readings += count as u64;
        self.shapes.take(scan.ranges_m.len(), scan.beams);
        self.scans += 1;
        Ok(())
    }
}

/// Writes the navigator's instructions, and then the scans of a log, to a recording. The caller finishes the recording.
///
/// # Errors
/// [`ImportError`] if the log cannot be read, the recording cannot be written, or anything is left out under strict rules.
pub fn import<W: Write>(
    entries: impl Iterator<Item = Result<Entry, CarmenError>>,
    rules: &Rules,
    writer: &mut Writer<W>,
) -> Result<Imported, ImportError> {
    let (mut imported, mut clock) = (Imported::default(), Clock::default());
    for entry in entries {
        let scan = match entry? {
            Entry::Scan(scan) => scan,
            Entry::LeftOut(left_out) => {
                imported.leave_out(left_out, rules)?;
                continue;
            }
        };
        match clock.stamp_ns(scan.time_s) {
            Ok(stamp_ns) => {
                let seq = imported.scans + 1;
                let messages = Messages::of(&scan, Header { seq, stamp_ns, source_seq: seq }, rules);
                match messages.check() {
                    Ok(()) => {
                        imported.count(&scan, rules)?;
                        imported.blind += u64::from(messages.is_blind());
                        messages.put(writer)?;
                    }
                    Err(why) => imported.leave_out(LeftOut { line: scan.line, why }, rules)?,
                }
            }
            Err(why) => imported.leave_out(LeftOut { line: scan.line, why }, rules)?,
        }
    }
    (imported.clock_goes_back, imported.clock_stands) = (clock.goes_back, clock.stands);
    Ok(imported)
}

/// Converts a log's times into timestamps that begin with 0. The clocks of old logs sometimes go back, but timestamps never do.
#[derive(Default)]
struct Clock {
    first_s: Option<f64>,
    last_s: Option<f64>,
    last_ns: Option<u64>,
    goes_back: u64,
    stands: u64,
}

impl Clock {
    fn stamp_ns(&mut self, time_s: f64) -> Result<u64, Fault> {
        let since_s = time_s - *self.first_s.get_or_insert(time_s);
        if since_s > MAX_STAMP_S {
            return Err(Fault::Time { since_s });
        }
        let last_s = self.last_s.replace(time_s);
        self.goes_back += u64::from(last_s.is_some_and(|last_s| time_s < last_s));
        self.stands += u64::from(last_s == Some(time_s));
        let ns = nanoseconds(since_s);
        let stamp_ns = self.last_ns.map_or(ns, |last| ns.max(last + 1));
        self.last_ns = Some(stamp_ns);
        Ok(stamp_ns)
    }
}

/// The messages that are recorded for a scan.
pub struct Messages {
    truth: Option<GroundTruth>,
    odometry: Odometry,
    /// The laser scan.
    pub scan: Box<LaserScan>,
    tick: Tick,
}

impl Messages {
    /// Returns the messages of a scan.
    pub fn of(scan: &CarmenScan, header: Header, rules: &Rules) -> Self {
        let twist = Twist::zeroed();
        let truth = |pose| GroundTruth { header, pose: PoseM::new(pose), twist };
        Self {
            truth: scan.reference.as_ref().map(truth),
            odometry: Odometry { header, pose: PoseM::new(&scan.odometry), twist },
            scan: Box::new(laser_scan(scan, header, rules)),
            tick: tick(header),
        }
    }

    /// Checks the messages. Invalid ones are not recorded, because readers would reject them and they could
    /// not be used for localization.
    ///
    /// # Errors
    /// [`Fault::Invalid`] if the odometry or the scan is invalid.
    pub fn check(&self) -> Result<(), Fault> {
        self.odometry.check().and_then(|()| self.scan.check()).map_err(Fault::Invalid)
    }

    fn is_blind(&self) -> bool {
        let found = self.scan.ranges_m.iter().take(self.scan.beam_count as usize);
        !found.into_iter().any(|range| range.is_finite() && *range > NEAREST_M)
    }

    fn put<W: Write>(&self, writer: &mut Writer<W>) -> Result<(), RecordingError> {
        if let Some(truth) = &self.truth {
            writer.write(TRUTH, truth, &[])?;
        }
        writer.write(ODOMETRY, &self.odometry, &[])?;
        writer.write(SCAN, &*self.scan, &[])?;
        writer.write(TICK, &self.tick, &[]).map(drop)
    }
}

/// Returns the message of a scan. Each scan contains the directions of its own beams.
fn laser_scan(scan: &CarmenScan, header: Header, rules: &Rules) -> LaserScan {
    let (beams, count) = (&scan.beams, scan.ranges_m.len());
    let range_max_m = scan.range_max_m.map_or(rules.range_max_m, |stated_m| stated_m.min(rules.range_max_m));
    let mut message = LaserScan { header, ..LaserScan::zeroed() };
    message.angle_min_rad = beams.angle_min_rad as f32;
    message.angle_increment_rad = beams.angle_increment_rad as f32;
    message.angle_max_rad = (beams.angle_min_rad + beams.span_rad(count)) as f32;
    message.range_max_m = range_max_m as f32;
    message.beam_count = count as u32;
    for (range, &found) in message.ranges_m.iter_mut().zip(&scan.ranges_m) {
        *range = if f64::from(found) >= range_max_m { f32::INFINITY } else { found };
    }
    message
}

/// Returns the tick of a scan. Every reading of a log has the same number as its tick.
fn tick(header: Header) -> Tick {
    let mut tick = Tick { header, ..Tick::zeroed() };
    for (newest, sensor) in tick.newest.iter_mut().zip(channels::sensors()) {
        if *sensor == *SCAN.spec || *sensor == *ODOMETRY.spec {
            *newest = header.seq;
        }
    }
    tick
}

/// System name in the runs of imported logs, which were not driven by any system.
pub const LOG_SYSTEM: &str = "log";

#[cfg(test)]
mod tests {
    use sketchnav_schemas::geometry::Pose;

    use super::*;
    use crate::carmen::Beams;

    const RULES: Rules = Rules { range_max_m: 79.0, is_strict: false };
    const STRICT: Rules = Rules { is_strict: true, ..RULES };

    fn scan(line: u64, ranges_m: Vec<f32>) -> CarmenScan {
        CarmenScan {
            line,
            time_s: 0.5,
            beams: Beams::by_count(ranges_m.len()),
            ranges_m,
            range_max_m: None,
            reference: None,
            odometry: Pose::new(0.0, 0.0, 0.0),
        }
    }

    /// Regression test: all scans used to get the angles of the first one.
    #[test]
    fn each_scan_has_its_own_angles_and_is_valid() {
        let header = Header { seq: 1, stamp_ns: 5, source_seq: 1 };
        for (count, first_rad) in [(180, -90_f32), (361, -90.0), (401, -50.0)] {
            let mut found = scan(1, vec![2.0; count]);
            (found.ranges_m[0], found.ranges_m[1], found.ranges_m[2]) = (f32::NAN, 79.5, f32::INFINITY);
            let message = laser_scan(&found, header, &RULES);
            assert_eq!((message.check(), message.beam_count), (Ok(()), count as u32));
            assert!((message.angle_min_rad - first_rad.to_radians()).abs() < 1e-6);
            assert_eq!(&message.ranges_m[1..4], [f32::INFINITY, f32::INFINITY, 2.0]);
        }
        let short = CarmenScan { range_max_m: Some(1.5), ..scan(1, vec![1.0, 2.0]) };
        let message = laser_scan(&short, header, &RULES);
        assert_eq!((message.range_max_m, message.ranges_m[1]), (1.5, f32::INFINITY));
    }

    /// Regression test: a scan with a maximum range of next to nothing was recorded, and so was one with an odometry beyond all
    /// bounds. The localizer rejected them without any message to the user.
    #[test]
    fn messages_that_every_reader_would_reject_are_left_out_with_the_reason() {
        let header = Header { seq: 1, stamp_ns: 5, source_seq: 1 };
        let whole = scan(1, vec![2.0; 3]);
        let why =
            |scan: &CarmenScan| Messages::of(scan, header, &RULES).check().map_err(|why| why.to_string());
        assert_eq!(why(&whole), Ok(()));
        let blind = CarmenScan { range_max_m: Some(0.0), ..whole.clone() };
        assert_eq!(
            why(&blind).unwrap_err(),
            "expected a scan with odometry that readers accept; range_max_m: expected a length above range_min_m, found 0"
        );
        let far = CarmenScan { odometry: Pose::new(2e7, 0.0, 0.0), ..whole };
        assert!(why(&far).unwrap_err().contains("pose: expected a number within ±1e7, found 20000000"));
    }

    /// Regression test: a single garbled time affected the timestamps of all scans after it.
    #[test]
    fn stamps_increase_even_if_the_clock_jumps() {
        let mut clock = Clock::default();
        let mut stamp = |time_s: f64| clock.stamp_ns(time_s).map_err(|why| why.to_string());
        assert_eq!([stamp(100.0), stamp(100.5)], [Ok(0), Ok(500_000_000)]);
        let far = stamp(1e12).unwrap_err();
        assert!(
            far.starts_with("expected a time at most 68 years after the first scan, found 999999999900 s"),
            "{far}"
        );
        assert_eq!([stamp(99.0), stamp(101.0)], [Ok(500_000_001), Ok(1_000_000_000)]);
        assert_eq!((clock.goes_back, clock.stands), (1, 0));
        clock.stamp_ns(101.0).unwrap();
        assert_eq!((clock.goes_back, clock.stands), (1, 1));
    }

    /// Regression test: in a log in millimetres, nothing was near enough to be detected, and the user got no warning.
    #[test]
    fn a_scan_without_any_distance_is_blind() {
        let header = Header { seq: 1, stamp_ns: 5, source_seq: 1 };
        let is_blind =
            |ranges_m: &[f32]| Messages::of(&scan(1, ranges_m.to_vec()), header, &RULES).is_blind();
        assert!(is_blind(&[2500.0, 79.0, f32::INFINITY, f32::NAN, 0.0]));
        assert!(!is_blind(&[2500.0, 2.5]));
    }

    #[test]
    fn omissions_are_counted_or_refused() {
        let mut imported = Imported::default();
        let long = |line| LeftOut { line, why: Fault::Long };
        for line in 1..=MAX_NAMED as u64 + 5 {
            imported.leave_out(long(line), &RULES).unwrap();
        }
        assert_eq!((imported.left_out_lines, imported.left_out.len()), (MAX_NAMED as u64 + 5, MAX_NAMED));
        let error = imported.leave_out(long(7), &STRICT).unwrap_err().to_string();
        assert_eq!(error, "line 7: expected a line of less than 256 KiB");
        let spoilt = scan(9, vec![1.0, f32::NAN, f32::NAN]);
        imported.count(&spoilt, &RULES).unwrap();
        assert_eq!((imported.left_out_readings, imported.unreadable.as_slice()), (2, &[(9, 2)][..]));
        let error = imported.count(&spoilt, &STRICT).unwrap_err().to_string();
        assert_eq!(error, "line 9: expected distances in metres, found 2 readings that are not distances");
    }
}

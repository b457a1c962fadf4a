//! Reads laser logs of the CARMEN toolkit, which have one record per line, in the formats described in
//! `record.rs`.
//!
//! **Odometry.** In logs that a mapper has corrected, both poses of a FLASER line are the reference pose, and the first ODOM line
//! after it repeats that pose. The odometry is therefore chained from the steps between consecutive ODOM lines, leaving out each
//! step that leads to such a repetition, so that the mapper's corrections never reach the odometry. In raw logs the chain is
//! identical to the odometry: the first ODOM line after a FLASER line continues from the previous ODOM line, and its pose is that
//! of the FLASER line only if the robot is stationary. If there are no ODOM lines, or none that move, the odometry is the robot
//! pose in each scan.
//!
//! **Unreadable lines** (a line that is truncated, garbled, too long or has the wrong number of fields, or
//! the end of a truncated compressed file) become an [`Entry::LeftOut`] with their line number, after which
//! reading continues. A number that no laser could have measured is only dropped from its scan.
//!
//! A log is read twice. [`Survey::of`] finds out which kinds of lines the log has, which determines how [`CarmenLog`] reads
//! it. Both read line by line from any [`BufRead`], and no line is longer than 256 KiB.

mod lines;
mod record;
mod survey;

use std::io::{BufRead, BufReader};
use std::path::Path;

use flate2::bufread::MultiGzDecoder;

use sketchnav_schemas::geometry::{Odom, Pose, World};

pub use lines::MAX_LINE_BYTES;
use lines::{Lines, Next};
pub use record::{Beams, Fault, ScanKind};
use record::{Record, ScanLine};
pub use survey::{Doubt, OdometrySource, Reading, Shape, Shapes, Survey};

/// A scan of a log.
#[derive(Debug, Clone, PartialEq)]
pub struct CarmenScan {
    /// Line number, from 1.
    pub line: u64,
    /// Time by the log's clock, in seconds.
    pub time_s: f64,
    /// The directions of the beams.
    pub beams: Beams,
    /// Ranges in metres, from right to left. NaN stands for a number that no laser could have measured.
    pub ranges_m: Vec<f32>,
    /// The maximum range according to the log, in metres.
    pub range_max_m: Option<f64>,
    /// The pose according to the corrected log, or `None` if the log's lines state no pose.
    pub reference: Option<Pose<World>>,
    /// The pose according to the robot's own odometry.
    pub odometry: Pose<Odom>,
}

impl CarmenScan {
    /// Returns the number of readings that are not a distance.
    pub fn unreadable(&self) -> usize {
        self.ranges_m.iter().filter(|range| range.is_nan()).count()
    }
}

/// A line of a log that was left out.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOut {
    /// Line number, from 1.
    pub line: u64,
    /// The reason.
    pub why: Fault,
}

impl std::fmt::Display for LeftOut {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.line, self.why)
    }
}

/// An item that is read from a log.
#[derive(Debug, Clone, PartialEq)]
pub enum Entry {
    /// A scan.
    Scan(CarmenScan),
    /// An unreadable line, left out.
    LeftOut(LeftOut),
}

/// The reason why a log cannot be read at all.
#[derive(Debug, thiserror::Error)]
pub enum CarmenError {
    /// The system cannot open the file.
    #[error("{0}")]
    Open(std::io::Error),
    /// The system cannot read the file.
    #[error("line {line}: {source}")]
    Io {
        /// The line.
        line: u64,
        /// The system's error.
        source: std::io::Error,
    },
    /// The file is neither text nor text compressed with gzip.
    #[error(
        "expected text in ASCII or UTF-8, plain or compressed with gzip, found {found}; convert it first"
    )]
    NotText {
        /// The format of the file.
        found: &'static str,
    },
    /// The log contains no scans.
    #[error("expected FLASER, ROBOTLASER1 or RAWLASER1 lines, found {found}")]
    NoScans {
        /// The kinds of lines that it contains instead.
        found: String,
    },
    /// The scans do not state poses and there are no ODOM lines, so it is not known how the robot moved.
    #[error("expected ODOM lines in addition to {kind} lines, which do not state a pose, found none")]
    NoOdometry {
        /// The kind of scan lines.
        kind: ScanKind,
    },
}

/// The first bytes of files that are not text, with the format that each of them indicates.
const NOT_TEXT: [(&[u8], &str); 6] = [
    (b"BZh", "bzip2"),
    (b"PK\x03\x04", "zip"),
    (b"\xfd7zXZ", "xz"),
    (b"\x28\xb5\x2f\xfd", "zstd"),
    (b"\xff\xfe", "UTF-16"),
    (b"\xfe\xff", "UTF-16"),
];

/// Opens the text of a log, which is decompressed if it is compressed with gzip.
///
/// # Errors
/// [`CarmenError::Open`] if the file cannot be opened, and [`CarmenError::NotText`] if it is not text.
pub fn open(path: &Path) -> Result<Box<dyn BufRead>, CarmenError> {
    let file = sketchnav_files::open(path, "a laser log").map_err(CarmenError::Open)?;
    let mut plain = BufReader::with_capacity(1 << 16, file);
    let begin = plain.fill_buf().map_err(CarmenError::Open)?;
    if let Some((_, found)) = NOT_TEXT.iter().find(|(magic, _)| begin.starts_with(magic)) {
        return Err(CarmenError::NotText { found });
    }
    let is_packed = begin.starts_with(&[0x1f, 0x8b]);
    Ok(if is_packed { Box::new(BufReader::new(MultiGzDecoder::new(plain))) } else { Box::new(plain) })
}

/// The odometry chained from ODOM lines. See the module's documentation.
#[derive(Debug, Clone, Copy)]
struct Chain {
    /// The pose in the last ODOM line.
    last: Option<Pose<Odom>>,
    /// The robot's pose according to a scan, set right after the scan. If the next ODOM line repeats it, the chain restarts from
    /// there.
    reset: Option<Pose<Odom>>,
    odometry: Pose<Odom>,
}

/// An iterator over the scans of a log and the lines that are left out.
pub struct CarmenLog<R> {
    lines: Lines<R>,
    reading: Reading,
    chain: Chain,
    is_over: bool,
}

impl Default for Chain {
    fn default() -> Self {
        Self { last: None, reset: None, odometry: Pose::new(0.0, 0.0, 0.0) }
    }
}

impl Chain {
    /// Processes the pose in an ODOM line.
    fn take(&mut self, now: Pose<Odom>) {
        let starts_again = self.reset.take() == Some(now);
        if let Some(last) = self.last.replace(now).filter(|_| !starts_again) {
            self.odometry = self.odometry.compose(&last.motion_to(&now));
        }
    }

    /// Processes the robot pose in a scan.
    fn meet(&mut self, stated: Option<Pose<Odom>>) {
        self.reset = stated.or(self.reset);
    }
}

impl<R: BufRead> CarmenLog<R> {
    /// Reads a log from its beginning, as determined by its survey.
    pub fn new(input: R, reading: Reading) -> Self {
        Self { lines: Lines::new(input), reading, chain: Chain::default(), is_over: false }
    }

    fn next_entry(&mut self) -> Result<Option<Entry>, CarmenError> {
        loop {
            let line = self.lines.number() + 1;
            let next = self.lines.next().map_err(|source| CarmenError::Io { line, source })?;
            let entry = match next {
                Next::End => return Ok(None),
                Next::Line => Record::parse(self.lines.text()).and_then(|record| self.take(record)),
                Next::TooLong => Err(Fault::Long),
                Next::BreaksOff(error) => {
                    self.is_over = true;
                    Err(Fault::BreaksOff { why: error.to_string() })
                }
            };
            match entry {
                Ok(None) => {}
                Ok(Some(scan)) => return Ok(Some(Entry::Scan(scan))),
                Err(why) => return Ok(Some(Entry::LeftOut(LeftOut { line, why }))),
            }
        }
    }

    fn take(&mut self, record: Record) -> Result<Option<CarmenScan>, Fault> {
        match record {
            Record::Odometry(pose) => self.chain.take(pose),
            Record::Scan(scan) => {
                self.chain.meet(scan.poses.map(|(_, own)| own));
                if scan.kind == self.reading.kind {
                    return self.finish(scan).map(Some);
                }
            }
            Record::Other(_) | Record::Nothing => {}
        }
        Ok(None)
    }

    /// Completes a scan with information from the preceding lines.
    fn finish(&self, scan: ScanLine) -> Result<CarmenScan, Fault> {
        if scan.surplus.is_some() && scan.surplus != self.reading.surplus {
            return Err(scan.surplus_fault());
        }
        let own = scan.poses.map(|(_, own)| own);
        let own = own.filter(|_| self.reading.odometry == OdometrySource::Scans);
        Ok(CarmenScan {
            line: self.lines.number(),
            time_s: scan.time_s,
            beams: scan.beams,
            range_max_m: scan.range_max_m.or(scan.surplus),
            ranges_m: scan.ranges_m,
            reference: scan.poses.map(|(reference, _)| reference),
            odometry: own.unwrap_or(self.chain.odometry),
        })
    }
}

impl<R: BufRead> Iterator for CarmenLog<R> {
    type Item = Result<Entry, CarmenError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_over {
            return None;
        }
        let next = self.next_entry().transpose();
        self.is_over |= !matches!(next, Some(Ok(_)));
        next
    }
}

#[cfg(test)]
mod tests;

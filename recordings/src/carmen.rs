//! Laser logs of the CARMEN toolkit: one record per line, in the formats of `record.rs`.
//!
//! **Odometry.** In logs that a mapper has corrected, both poses of a FLASER are the reference pose, and the first ODOM line
//! after it repeats that pose. The odometry is therefore chained from the steps between consecutive ODOM lines, without the one
//! that leads to such a repetition, so that the mapper's corrections never reach it. In raw logs the chain is the odometry
//! itself: there the first ODOM line after a FLASER continues from the ODOM line before, and its pose is the FLASER's only if
//! the robot stands still. If there are no ODOM lines, or none that move, the robot's pose that each scan states is the
//! odometry.
//!
//! **What cannot be read** (a line that is cut, garbled, too long or has a wrong number of fields, or the end of a truncated
//! compressed file) is an [`Entry::LeftOut`] with its line, after which reading continues. A number that no laser measures is
//! only left out of its scan.
//!
//! A log is read twice: [`Survey::of`] finds out which kinds of lines it has, which decides how [`CarmenLog`] reads it. Both
//! read line by line from any [`BufRead`]; a line is never longer than 256 KiB.

mod lines;
mod record;
mod survey;

use std::io::BufRead;

use sketchnav_schemas::geometry::{Odom, Pose, World};

pub use lines::MAX_LINE_BYTES;
use lines::{Lines, Next};
pub use record::{Beams, Fault, ScanKind};
use record::{Record, ScanLine};
pub use survey::{Doubt, OdometrySource, Reading, Shape, Shapes, Survey};

/// A scan of a log.
#[derive(Debug, Clone, PartialEq)]
pub struct CarmenScan {
    /// The line, from 1.
    pub line: u64,
    /// Seconds, by the log's clock.
    pub time_s: f64,
    /// Where its beams point.
    pub beams: Beams,
    /// Ranges in metres, from the right to the left; NaN if the log has no number that a laser measures.
    pub ranges_m: Vec<f32>,
    /// The maximum range that the log states, metres.
    pub range_max_m: Option<f64>,
    /// Where the robot was, according to the corrected log; `None` if its lines state no pose.
    pub reference: Option<Pose<World>>,
    /// Where the robot was by its own odometry.
    pub odometry: Pose<Odom>,
}

impl CarmenScan {
    /// The number of readings that are not a distance.
    pub fn unreadable(&self) -> usize {
        self.ranges_m.iter().filter(|range| range.is_nan()).count()
    }
}

/// A line that is left out.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOut {
    /// Its number, from 1.
    pub line: u64,
    /// Why.
    pub why: Fault,
}

impl std::fmt::Display for LeftOut {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.line, self.why)
    }
}

/// What a log yields.
#[derive(Debug, Clone, PartialEq)]
pub enum Entry {
    /// A scan.
    Scan(CarmenScan),
    /// An unreadable line, left out.
    LeftOut(LeftOut),
}

/// Why a log cannot be read at all.
#[derive(Debug, thiserror::Error)]
pub enum CarmenError {
    /// The system.
    #[error("line {line}: {source}")]
    Io {
        /// The line.
        line: u64,
        /// What it says.
        source: std::io::Error,
    },
    /// No line is a scan.
    #[error("expected FLASER, ROBOTLASER1 or RAWLASER1 lines, found {found}")]
    NoScans {
        /// What there is instead.
        found: String,
    },
    /// Scans without poses do not say where the robot has moved.
    #[error("expected ODOM lines beside {kind} lines, which state no pose, found none")]
    NoOdometry {
        /// The scans.
        kind: ScanKind,
    },
}

/// The odometry of ODOM lines; see the module's documentation.
#[derive(Debug, Clone, Copy)]
struct Chain {
    /// The last ODOM line.
    last: Option<Pose<Odom>>,
    /// Right after a scan, the robot's pose that it states: an ODOM line that repeats it restarts the chain from there.
    reset: Option<Pose<Odom>>,
    odometry: Pose<Odom>,
}

/// The scans of a log, one by one.
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
    /// Takes an ODOM line.
    fn take(&mut self, now: Pose<Odom>) {
        let starts_again = self.reset.take() == Some(now);
        if let Some(last) = self.last.replace(now).filter(|_| !starts_again) {
            self.odometry = self.odometry.compose(&last.motion_to(&now));
        }
    }

    /// Takes the robot's pose that a scan states.
    fn meet(&mut self, stated: Option<Pose<Odom>>) {
        self.reset = stated.or(self.reset);
    }
}

impl<R: BufRead> CarmenLog<R> {
    /// Reads a log from its beginning.
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

    /// The scan, completed by what the lines before it say.
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

//! Laser logs of the CARMEN toolkit: one record a line.
//!
//! ```text
//! FLASER n r1 … rn  x y θ  odom_x odom_y odom_θ  time host logger_time
//! ODOM x y θ tv rv accel  time host logger_time
//! ```
//! In logs that a mapper has corrected, both poses of a FLASER hold the reference pose. The first ODOM line behind it
//! repeats that pose. So the odometry is chained: the steps between consecutive ODOM lines, without the one that leads
//! to such a repetition. What the mapper put right never reaches the odometry. In raw logs the chain is the odometry
//! itself. There the first ODOM line behind a FLASER continues from the ODOM line before. Its pose is the FLASER's
//! only where the robot stands still.
//!
//! Reads line by line from any [`BufRead`]; a line is never longer than [`MAX_LINE_BYTES`].

use std::io::{BufRead, Read};

use sketchnav_schemas::geometry::{Odom, Pose, World};
use sketchnav_schemas::message::MAX_BEAMS;

/// Longest line that is read.
pub const MAX_LINE_BYTES: u64 = 1 << 18;

/// A scan of a log.
#[derive(Debug, Clone, PartialEq)]
pub struct CarmenScan {
    /// Seconds, by the log's clock.
    pub time_s: f64,
    /// Ranges in metres, from the right to the left.
    pub ranges_m: Vec<f32>,
    /// Where the robot was, by who corrected the log.
    pub reference: Pose<World>,
    /// Where it had come by its own count.
    pub odometry: Pose<Odom>,
}

/// What is wrong with a log.
#[derive(Debug, thiserror::Error)]
pub enum CarmenError {
    /// The system, or the compression.
    #[error("line {line}: {source}")]
    Io {
        /// The line.
        line: u64,
        /// What it says.
        source: std::io::Error,
    },
    /// A line that is not as it should be.
    #[error("line {line}: expected {expected}")]
    Line {
        /// The line.
        line: u64,
        /// What should be there.
        expected: &'static str,
    },
}

/// The scans of a log, one by one.
pub struct CarmenLog<R> {
    input: R,
    line: u64,
    text: Vec<u8>,
    /// The last ODOM line.
    last: Option<Pose<Odom>>,
    /// Right after a FLASER its second pose: an ODOM line that repeats it starts again from there.
    reset: Option<Pose<Odom>>,
    odometry: Pose<Odom>,
    is_over: bool,
}

impl<R: BufRead> CarmenLog<R> {
    /// Reads a log from its beginning.
    pub fn new(input: R) -> Self {
        Self {
            input,
            line: 0,
            text: Vec::new(),
            last: None,
            reset: None,
            odometry: Pose::new(0.0, 0.0, 0.0),
            is_over: false,
        }
    }

    fn wrong(&self, expected: &'static str) -> CarmenError {
        CarmenError::Line { line: self.line, expected }
    }

    /// The next line in `text`; false at the end.
    fn read_line(&mut self) -> Result<bool, CarmenError> {
        self.line += 1;
        self.text.clear();
        let read = self.input.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut self.text);
        let read = read.map_err(|source| CarmenError::Io { line: self.line, source })?;
        if read as u64 == MAX_LINE_BYTES && self.text.last() != Some(&b'\n') {
            return Err(self.wrong("a line of less than 256 KiB"));
        }
        Ok(read > 0)
    }

    fn next_scan(&mut self) -> Result<Option<CarmenScan>, CarmenError> {
        while self.read_line()? {
            let text = std::mem::take(&mut self.text);
            let words = std::str::from_utf8(&text).unwrap_or_default();
            let mut words = words.split_ascii_whitespace();
            let scan = match words.next() {
                Some("ODOM") => self.take_odometry(&mut words).map(|()| None),
                Some("FLASER") => self.take_scan(&mut words).map(Some),
                _ => Ok(None),
            };
            self.text = text;
            if let Some(scan) = scan? {
                return Ok(Some(scan));
            }
        }
        Ok(None)
    }

    fn take_odometry<'a>(&mut self, words: &mut impl Iterator<Item = &'a str>) -> Result<(), CarmenError> {
        let now = pose(words).ok_or_else(|| self.wrong("ODOM x y θ …, finite numbers"))?;
        let starts_again = self.reset.take() == Some(now);
        if let Some(last) = self.last.replace(now).filter(|_| !starts_again) {
            self.odometry = self.odometry.compose(&last.motion_to(&now));
        }
        Ok(())
    }

    fn take_scan<'a>(
        &mut self,
        words: &mut impl Iterator<Item = &'a str>,
    ) -> Result<CarmenScan, CarmenError> {
        let wrong = "FLASER n r1 … rn x y θ x y θ time …, n from 2 to 1440, finite numbers";
        let parse = || {
            let count = words.next()?.parse().ok().filter(|count| (2..=MAX_BEAMS).contains(count))?;
            let ranges_m: Vec<f32> = words.take(count).map_while(number).map(|range| range as f32).collect();
            let (reference, said): (_, Pose<Odom>) = (pose(words)?, pose(words)?);
            let time_s = number(words.next()?)?;
            (ranges_m.len() == count).then_some((ranges_m, reference, said, time_s))
        };
        let (ranges_m, reference, said, time_s) = { parse }().ok_or_else(|| self.wrong(wrong))?;
        self.reset = Some(said);
        Ok(CarmenScan { time_s, ranges_m, reference, odometry: self.odometry })
    }
}

fn number(word: &str) -> Option<f64> {
    word.parse().ok().filter(|value: &f64| value.is_finite())
}

fn pose<'a, F>(words: &mut impl Iterator<Item = &'a str>) -> Option<Pose<F>> {
    Some(Pose::new(number(words.next()?)?, number(words.next()?)?, number(words.next()?)?))
}

impl<R: BufRead> Iterator for CarmenLog<R> {
    type Item = Result<CarmenScan, CarmenError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_over {
            return None;
        }
        let next = self.next_scan().transpose();
        self.is_over = !matches!(next, Some(Ok(_)));
        next
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LOG: &str = "# a log\nPARAM robot_length 0.47\nODOM 0 0 0 0 0 0 0.1 h 0.1\nODOM 1 0 0 0 0 0 0.2 h 0.2\nFLASER 3 1.5 2.5 81.9 0.9 0.1 0 0.9 0.1 0 0.25 h 0.25\nODOM 0.9 0.1 0 0 0 0 0 h 0\nNEFF 4\nODOM 0.9 0.6 0 0 0 0 0.4 h 0.4\nFLASER 3 1 2 3 0.8 0.7 0.1 0.8 0.7 0.1 0.5 h 0.5\n";

    fn scans(text: &str) -> Vec<Result<CarmenScan, CarmenError>> {
        CarmenLog::new(text.as_bytes()).collect()
    }

    #[test]
    fn what_the_mapper_put_right_is_not_in_the_odometry() {
        let scans: Vec<_> = scans(LOG).into_iter().map(Result::unwrap).collect();
        assert_eq!(scans.len(), 2);
        assert_eq!(
            (scans[0].odometry, scans[0].reference),
            (Pose::new(1.0, 0.0, 0.0), Pose::new(0.9, 0.1, 0.0))
        );
        assert_eq!(scans[1].odometry, Pose::new(1.0, 0.5, 0.0));
        assert_eq!((scans[0].ranges_m.as_slice(), scans[1].time_s), (&[1.5, 2.5, 81.9][..], 0.5));
    }

    /// The step from the ODOM line before a scan to the first one behind it was always left out. With ODOM and FLASER
    /// in turn, as raw logs have them, the robot never moved.
    #[test]
    fn the_odometry_of_a_raw_log_is_what_it_says() {
        let scan = |x: f64| format!("FLASER 2 1 1 {x} 0 0 {x} 0 0 {x} h 0\n");
        let odom = |x: f64| format!("ODOM {x} 0 0 0 0 0 {x} h 0\n");
        let log: String = [0.0, 1.0, 2.0].map(|x| odom(x) + &scan(x + 0.1)).concat();
        let way: Vec<_> = scans(&log).into_iter().map(|scan| scan.unwrap().odometry.x).collect();
        assert_eq!(way, [0.0, 1.0, 2.0]);
    }

    #[test]
    fn a_broken_line_is_named() {
        for (text, line) in [
            ("FLASER 3 1 2\n", 1),
            ("# fine\nFLASER 4000000000 1\n", 2),
            ("ODOM 0 0\n", 1),
            ("ODOM nan 0 0\n", 1),
            ("FLASER 2 1 2 0 0 0 0 0 0\n", 1),
        ] {
            let error = scans(text).pop().unwrap().unwrap_err().to_string();
            assert!(error.starts_with(&format!("line {line}: expected")), "{error}");
        }
        let endless = "x".repeat(MAX_LINE_BYTES as usize + 5);
        assert!(scans(&endless).pop().unwrap().is_err());
    }

    proptest! {
        #[test]
        fn whatever_stands_there_is_read_or_refused(text in "(FLASER|ODOM|[0-9 .eE+-]|\n|nan|h){0,60}") {
            let _ = scans(&text);
        }
    }
}

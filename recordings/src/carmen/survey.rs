//! Surveys all lines of a log to determine which of them to read as scans, and which odometry to use.

use std::collections::BTreeMap;
use std::io::BufRead;

use sketchnav_schemas::geometry::{Odom, Pose};

use super::lines::{Lines, Next};
use super::record::{Beams, Fault, Record, ScanKind, ScanLine};
use super::{CarmenError, Chain, LeftOut};

/// Motion below this is ignored, in metres and in radians.
const STILL: f64 = 1e-3;
/// If the distances travelled according to the ODOM lines and to the scans' own poses differ by more than this share, they
/// are not the same odometry. In a log that a mapper has corrected, they differ by less than a tenth.
const MOST_DIFFERENCE: f64 = 0.2;
/// Maximum distance, in metres, that the robot may travel during scans without an ODOM line between them.
const LONGEST_GAP_M: f64 = 0.5;
/// Headings in radians that are not wrapped exceed this after two full turns. Headings in degrees nearly always do.
const FEW_TURNS_RAD: f64 = 2.0 * std::f64::consts::TAU;
/// Maximum number of scan shapes that are counted separately.
const MAX_SHAPES: usize = 32;
/// Maximum number of first words of unread lines that are counted separately.
const MAX_OTHERS: usize = 32;

/// The source of the scans' odometry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OdometrySource {
    /// The ODOM lines, chained by `Chain`.
    Lines,
    /// The pose of the robot according to each scan.
    Scans,
}

/// How to read a log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// The kind of lines to read as scans. Lines of other kinds repeat the same scans, or contain another laser's scans.
    pub kind: ScanKind,
    /// The source of the odometry.
    pub odometry: OdometrySource,
    /// The value of the extra field after the readings, if it is the same in all scans that have one. It is the maximum
    /// range, in metres.
    pub surplus: Option<f64>,
}

/// A reason to check a log before relying on it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Doubt {
    /// The odometry is constant while the reference moves.
    #[error(
        "the odometry never moves, although the reference poses move {reference_m:.1} m: it is missing, and no localizer \
         can follow this log"
    )]
    Still {
        /// Distance travelled by the reference, in metres.
        reference_m: f64,
    },
    /// The robot never moves.
    #[error("the robot never moves in this log: the path is too short to judge anything by")]
    Motionless,
    /// The ODOM lines cover a different distance than the scans.
    #[error(
        "the ODOM lines cover {lines_m:.1} m, the robot's own poses in the scans {scans_m:.1} m: ODOM lines are missing or \
         wrong, or the scans' poses are not the robot's own"
    )]
    Partial {
        /// Distance travelled according to the ODOM lines, in metres.
        lines_m: f64,
        /// Distance travelled according to the scans, in metres.
        scans_m: f64,
    },
    /// Too many scans follow each other without ODOM lines between them.
    #[error(
        "from line {line} on, the robot's own poses in the scans cover {gap_m:.1} m without an ODOM line: the odometry stands \
         still there (in all, the ODOM lines cover {lines_m:.1} m, the scans {scans_m:.1} m)"
    )]
    Gap {
        /// The line of the first of these scans.
        line: u64,
        /// Distance travelled during these scans, in metres.
        gap_m: f64,
        /// Distance travelled according to the ODOM lines, in metres.
        lines_m: f64,
        /// Distance travelled according to all scans, in metres.
        scans_m: f64,
    },
    /// Both poses of each scan are the same.
    #[error(
        "both poses of each scan are the same and there are no ODOM lines: if a mapper has corrected this log, its \
         odometry is lost; if none has, its reference is the odometry"
    )]
    SamePoses,
    /// The headings reach values that are unusual for radians.
    #[error("the headings of the poses reach {heading:.0}: expected radians; are they degrees?")]
    Headings {
        /// The largest heading.
        heading: f64,
    },
    /// The lines have a field that the format does not have.
    #[error(
        "{count} {kind} lines have an extra field after their readings, {value} in each: read as the maximum range"
    )]
    Surplus {
        /// The kind of lines.
        kind: ScanKind,
        /// Number of these lines.
        count: u64,
        /// The value of the field.
        value: f64,
    },
}

/// The motion along a sequence of poses.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Motion {
    last: Option<[f64; 3]>,
    /// Distance travelled, in metres.
    pub distance_m: f64,
    turn_rad: f64,
}

impl Motion {
    fn push<F>(&mut self, pose: &Pose<F>) {
        let now = [pose.x, pose.y, pose.yaw_rad];
        if let Some([x, y, yaw_rad]) = self.last.replace(now) {
            self.distance_m += (now[0] - x).hypot(now[1] - y);
            self.turn_rad += (now[2] - yaw_rad).abs();
        }
    }

    /// Returns true if there is any motion.
    pub fn moves(&self) -> bool {
        self.distance_m > STILL || self.turn_rad > STILL
    }
}

/// Scans with the same beam directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// Number of beams in a scan.
    pub count: usize,
    /// The directions of the beams.
    pub beams: Beams,
    /// Number of scans.
    pub scans: u64,
}

/// The scans of a log, counted by their beam directions.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Shapes {
    /// The shapes in order of first occurrence.
    pub known: Vec<Shape>,
    /// Number of scans with further shapes. No real laser produces so many.
    pub others: u64,
}

impl Shapes {
    /// Counts a scan.
    pub fn take(&mut self, count: usize, beams: Beams) {
        let known = self.known.iter().position(|shape| shape.count == count && shape.beams == beams);
        match known {
            Some(index) => self.known[index].scans += 1,
            None if self.known.len() < MAX_SHAPES => self.known.push(Shape { count, beams, scans: 1 }),
            None => self.others += 1,
        }
    }

    /// Returns the most frequent shape. If there are several, the one that occurred first.
    pub fn most_frequent(&self) -> Option<&Shape> {
        self.known.iter().rev().max_by_key(|shape| shape.scans)
    }
}

/// Consecutive scans without an ODOM line between them.
#[derive(Debug, Clone, Copy, Default)]
struct Gap {
    /// The line of the first of these scans.
    line: u64,
    /// Number of ODOM lines before the scans.
    odometry_lines: u64,
    motion: Motion,
}

/// The facts about one kind of lines.
#[derive(Debug, Clone, Default)]
struct Facts {
    scans: u64,
    reference: Motion,
    own: Motion,
    /// The current gap, which began after the last ODOM line, and the gap in which the robot travelled farthest.
    gap: Gap,
    longest_gap: Gap,
    /// True if the two poses of some scan differ.
    poses_differ: bool,
    /// The largest absolute heading of a pose.
    largest_heading: f64,
    /// The value of the extra field in the first line that has one, and the number of lines that have the same value.
    surplus: Option<(f64, u64)>,
    surplus_differs: bool,
    shapes: Shapes,
}

impl Facts {
    /// Processes the scan in a line, given the number of ODOM lines before it.
    fn take(&mut self, scan: &ScanLine, line: u64, odometry_lines: u64) {
        match (scan.surplus, &mut self.surplus) {
            (None, _) => self.scans += 1,
            (Some(value), None) => self.surplus = Some((value, 1)),
            (Some(value), Some((known, count))) if value == *known => *count += 1,
            (Some(_), Some(_)) => self.surplus_differs = true,
        }
        if let Some((reference, own)) = &scan.poses {
            self.reference.push(reference);
            self.own.push(own);
            self.take_gap(own, line, odometry_lines);
            self.poses_differ |= [reference.x, reference.y] != [own.x, own.y];
            self.largest_heading = self.largest_heading.max(reference.yaw_rad.abs()).max(own.yaw_rad.abs());
        }
        self.shapes.take(scan.ranges_m.len(), scan.beams);
    }

    fn take_gap(&mut self, own: &Pose<Odom>, line: u64, odometry_lines: u64) {
        if self.gap.line == 0 || self.gap.odometry_lines != odometry_lines {
            self.gap = Gap { line, odometry_lines, motion: Motion::default() };
        }
        self.gap.motion.push(own);
        if self.gap.motion.distance_m > self.longest_gap.motion.distance_m {
            self.longest_gap = self.gap;
        }
    }

    /// Returns the extra field and the number of lines that have it, provided that there are several and that all have the
    /// same value.
    fn surplus(&self) -> Option<(f64, u64)> {
        self.surplus.filter(|(_, count)| *count > 1 && !self.surplus_differs)
    }

    fn usable(&self) -> u64 {
        self.scans + self.surplus().map_or(0, |(_, count)| count)
    }
}

/// The facts about a log.
#[derive(Debug, Clone, Default)]
pub struct Survey {
    kinds: BTreeMap<ScanKind, Facts>,
    odometry_lines: u64,
    chained: Motion,
    /// Number of lines of the kinds that are not read, keyed by the first word of the line.
    others: BTreeMap<String, u64>,
    first_fault: Option<LeftOut>,
    faults: u64,
}

impl Survey {
    /// Surveys all lines.
    ///
    /// # Errors
    /// [`CarmenError::Io`] if the log cannot be read.
    pub fn of(input: impl BufRead) -> Result<Self, CarmenError> {
        let (mut survey, mut lines, mut chain) = (Self::default(), Lines::new(input), Chain::default());
        loop {
            let next = lines.next().map_err(|source| CarmenError::Io { line: lines.number(), source })?;
            let why = match next {
                Next::End => return Ok(survey),
                Next::Line => match Record::parse(lines.text()) {
                    Ok(record) => {
                        survey.take(record, lines.number(), &mut chain);
                        continue;
                    }
                    Err(why) => why,
                },
                Next::TooLong => Fault::Long,
                Next::BreaksOff(error) => {
                    survey.fault(lines.number(), Fault::BreaksOff { why: error.to_string() });
                    return Ok(survey);
                }
            };
            survey.fault(lines.number(), why);
        }
    }

    fn fault(&mut self, line: u64, why: Fault) {
        self.faults += 1;
        self.first_fault.get_or_insert(LeftOut { line, why });
    }

    fn take(&mut self, record: Record, line: u64, chain: &mut Chain) {
        match record {
            Record::Nothing => {}
            Record::Other(word) => {
                if self.others.len() < MAX_OTHERS || self.others.contains_key(&word) {
                    *self.others.entry(word).or_default() += 1;
                } else {
                    *self.others.entry("others".to_owned()).or_default() += 1;
                }
            }
            Record::Odometry(pose) => {
                self.odometry_lines += 1;
                chain.take(pose);
                self.chained.push(&chain.odometry);
            }
            Record::Scan(scan) => {
                chain.meet(scan.poses.map(|(_, own)| own));
                self.kinds.entry(scan.kind).or_default().take(&scan, line, self.odometry_lines);
            }
        }
    }

    /// Determines how to read the log. The kind of lines with the most scans is read, or the most informative one if
    /// several kinds have equally many.
    ///
    /// # Errors
    /// [`CarmenError::NoScans`] if no line is a scan, [`CarmenError::NoOdometry`] if the log has no odometry.
    pub fn reading(&self) -> Result<Reading, CarmenError> {
        let usable = |kind: &ScanKind| self.kinds.get(kind).map_or(0, Facts::usable);
        let kind = ScanKind::ALL.into_iter().rev().max_by_key(usable).filter(|kind| usable(kind) > 0);
        let Some((kind, facts)) = kind.and_then(|kind| Some((kind, self.kinds.get(&kind)?))) else {
            return Err(CarmenError::NoScans { found: self.found() });
        };
        let states_poses = facts.own.last.is_some();
        let odometry = match (self.chained.moves(), facts.own.moves()) {
            (true, _) => OdometrySource::Lines,
            (false, true) => OdometrySource::Scans,
            (false, false) if self.odometry_lines > 0 => OdometrySource::Lines,
            (false, false) if states_poses => OdometrySource::Scans,
            (false, false) => return Err(CarmenError::NoOdometry { kind }),
        };
        Ok(Reading { kind, odometry, surplus: facts.surplus().map(|(value, _)| value) })
    }

    /// Returns the distance travelled according to the odometry of `reading`, in metres.
    pub fn odometry_distance_m(&self, reading: &Reading) -> f64 {
        let own = self.kinds.get(&reading.kind).map_or(0.0, |facts| facts.own.distance_m);
        if reading.odometry == OdometrySource::Lines { self.chained.distance_m } else { own }
    }

    /// Returns the reasons to check the log before relying on it, if it is read in this way.
    pub fn doubts(&self, reading: &Reading) -> Vec<Doubt> {
        let Some(facts) = self.kinds.get(&reading.kind) else { return Vec::new() };
        let moves = self.chained.moves() || facts.own.moves();
        let reference_m = facts.reference.distance_m;
        let still = match (moves, facts.reference.moves()) {
            (true, _) => self.partial(reading, facts),
            (false, true) => Some(Doubt::Still { reference_m }),
            (false, false) => Some(Doubt::Motionless),
        };
        let is_one_pose = reading.odometry == OdometrySource::Scans && !facts.poses_differ && moves;
        let surplus =
            facts.surplus().map(|(value, count)| Doubt::Surplus { kind: reading.kind, count, value });
        let heading = facts.largest_heading;
        let headings = (heading > FEW_TURNS_RAD).then_some(Doubt::Headings { heading });
        let is_one_pose = is_one_pose.then_some(Doubt::SamePoses);
        still.into_iter().chain(is_one_pose).chain(headings).chain(surplus).collect()
    }

    fn partial(&self, reading: &Reading, facts: &Facts) -> Option<Doubt> {
        let (lines_m, scans_m) = (self.chained.distance_m, facts.own.distance_m);
        if reading.odometry != OdometrySource::Lines || !facts.own.moves() {
            return None;
        }
        let Gap { line, motion: Motion { distance_m: gap_m, .. }, .. } = facts.longest_gap;
        if gap_m > LONGEST_GAP_M {
            return Some(Doubt::Gap { line, gap_m, lines_m, scans_m });
        }
        let is_partial = (lines_m - scans_m).abs() > MOST_DIFFERENCE * lines_m.max(scans_m);
        is_partial.then_some(Doubt::Partial { lines_m, scans_m })
    }

    /// Returns the scans of `reading` by their beam directions.
    pub fn shapes(&self, reading: &Reading) -> Option<&Shapes> {
        self.kinds.get(&reading.kind).map(|facts| &facts.shapes)
    }

    /// Returns the number of unread lines by their first word. They are parameters, scans of other lasers,
    /// and lines that repeat scans that are read.
    pub fn not_read(&self, reading: &Reading) -> BTreeMap<String, u64> {
        let scans = self.kinds.iter().filter(|(kind, _)| **kind != reading.kind);
        let scans = scans.map(|(kind, facts)| (kind.word().to_owned(), facts.usable()));
        let odometry = (reading.odometry == OdometrySource::Scans && self.odometry_lines > 0)
            .then(|| ("ODOM".to_owned(), self.odometry_lines));
        let others = self.others.iter().map(|(word, count)| (word.clone(), *count));
        others.chain(scans).chain(odometry).collect()
    }

    /// Describes in words the contents of a log without scans.
    fn found(&self) -> String {
        let odometry = (self.odometry_lines > 0).then(|| format!("{} ODOM", self.odometry_lines));
        let others = self.others.iter().map(|(word, count)| format!("{count} {word}"));
        let kinds: Vec<_> = odometry.into_iter().chain(others).collect();
        let surplus =
            self.kinds.values().map(|facts| facts.surplus.map_or(0, |(_, count)| count)).sum::<u64>();
        let mut found =
            if kinds.is_empty() { "none".to_owned() } else { format!("{} lines", kinds.join(", ")) };
        if surplus > 0 {
            found += &format!("; {surplus} lines with one field too many after their readings");
        }
        if let Some(first) = &self.first_fault {
            found += &format!("; {} lines cannot be read, the first is line {first}", self.faults);
        }
        found
    }
}

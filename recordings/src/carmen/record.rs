//! The content of one line of a log. The formats are those that CARMEN writes at the head of its log files:
//!
//! ```text
//! RAWLASER1   laser_type start_angle field_of_view angular_resolution maximum_range accuracy remission_mode
//!             num_readings [range_readings] num_remissions [remission_values]
//! ROBOTLASER1 … the same …, then  laser_pose_x laser_pose_y laser_pose_theta
//!             robot_pose_x robot_pose_y robot_pose_theta
//!             laser_tv laser_rv forward_safety_dist side_safety_dist turn_axis
//! FLASER      num_readings [range_readings] x y theta odom_x odom_y odom_theta
//! ODOM        x y theta tv rv accel
//! ```
//! Each line ends with `ipc_timestamp ipc_hostname logger_timestamp`. The content of a line thus determines how many fields
//! it must have. Only the fields that are read must be ASCII text, since a host may have any name.

use std::f64::consts::{PI, TAU};

use sketchnav_schemas::geometry::{Odom, Pose, World};
use sketchnav_schemas::message::MAX_BEAMS;
use sketchnav_schemas::valid::Invalid;

/// Limit for positions, in metres. No robot drives that far, so a position beyond it is invalid.
const FAR_M: f64 = 1e7;
/// Number of fields at the end of a line: time, host, and the logger's time.
const END_FIELDS: usize = 3;
/// Maximum number of characters of a field that an error shows.
const MAX_SHOWN: usize = 24;

/// The kinds of lines that can be read as scans.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ScanKind {
    /// The line contains the laser's angles and both poses.
    RobotLaser1,
    /// The line contains both poses. The angles follow from the number of readings.
    Flaser,
    /// The line contains the laser's angles. The odometry is in ODOM lines.
    RawLaser1,
}

impl ScanKind {
    /// All kinds, the most informative one first.
    pub const ALL: [Self; 3] = [Self::RobotLaser1, Self::Flaser, Self::RawLaser1];

    /// Returns the first word of lines of this kind.
    pub const fn word(self) -> &'static str {
        match self {
            Self::RobotLaser1 => "ROBOTLASER1",
            Self::Flaser => "FLASER",
            Self::RawLaser1 => "RAWLASER1",
        }
    }

    /// Returns the number of fields after the readings, without remissions.
    const fn fields_after(self) -> usize {
        match self {
            // Both poses, two velocities, two safety distances, the turn axis.
            Self::RobotLaser1 => 11 + END_FIELDS,
            Self::Flaser => 6 + END_FIELDS,
            Self::RawLaser1 => END_FIELDS,
        }
    }
}

impl std::fmt::Display for ScanKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.word())
    }
}

/// The reason why a line is left out.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Fault {
    /// The line does not have the number of fields that its content implies.
    #[error("{word}: expected {expected} fields, found {found}")]
    Fields {
        /// The first word of the line, followed by the number of readings if there is one.
        word: String,
        /// The expected number of fields.
        expected: usize,
        /// The actual number of fields.
        found: usize,
    },
    /// A field has an unexpected value.
    #[error("{kind}, field {field}: expected {expected}, found {found:?}")]
    Field {
        /// The first word of the line.
        kind: &'static str,
        /// The number of the field, from 1.
        field: usize,
        /// What was expected.
        expected: &'static str,
        /// What was found.
        found: String,
    },
    /// The line begins with a word that is not known.
    #[error("expected a known kind of line, such as FLASER, found {found:?}")]
    Kind {
        /// The word.
        found: String,
    },
    /// The stated angles contradict each other.
    #[error(
        "{kind}: expected a resolution that fits a field of view of {view_deg:.1}°, found {found_deg:.4}° for {beams} \
         readings"
    )]
    Angles {
        /// The first word of the line.
        kind: &'static str,
        /// The field of view, in degrees.
        view_deg: f64,
        /// The angle between neighbouring beams according to the line, in degrees.
        found_deg: f64,
        /// Number of readings.
        beams: usize,
    },
    /// The line is longer than any line of a log should be.
    #[error("expected a line of less than 256 KiB")]
    Long,
    /// The timestamp does not fit into a recording.
    #[error("expected a time at most 68 years after the first scan, found {since_s:.0} s after it")]
    Time {
        /// Time since the first scan, in seconds.
        since_s: f64,
    },
    /// Every reader would reject the scan or its odometry.
    #[error("expected a scan with odometry that readers accept; {0}")]
    Invalid(Invalid),
    /// The data breaks off.
    #[error("the file breaks off here: {why}")]
    BreaksOff {
        /// The decompressor's error.
        why: String,
    },
}

/// The directions of a scan's beams.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beams {
    /// Direction of the first beam, in radians, positive to the left of straight ahead.
    pub angle_min_rad: f64,
    /// Angle from one beam to the next, in radians.
    pub angle_increment_rad: f64,
}

impl Beams {
    /// Applies CARMEN's rule for lines that do not state their angles. 400 and 401 readings span 100°, and any other number
    /// spans half a circle. An odd number of readings includes both edges (181, 361, 401), while an even number omits the
    /// last one (180, 360, 400).
    pub fn by_count(count: usize) -> Self {
        let view_rad = if matches!(count, 400 | 401) { 100_f64.to_radians() } else { PI };
        let gaps = if count % 2 == 1 { count - 1 } else { count };
        Self { angle_min_rad: -view_rad / 2.0, angle_increment_rad: view_rad / gaps.max(1) as f64 }
    }

    /// Returns the angle from the first of `count` beams to the last, in radians.
    pub fn span_rad(&self, count: usize) -> f64 {
        self.angle_increment_rad * count.saturating_sub(1) as f64
    }
}

/// A scan as stated by its line.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanLine {
    /// The kind of line.
    pub kind: ScanKind,
    /// The directions of the beams.
    pub beams: Beams,
    /// Ranges in metres, from right to left. NaN stands for a number that no laser could have measured.
    pub ranges_m: Vec<f32>,
    /// The maximum range according to the line, in metres.
    pub range_max_m: Option<f64>,
    /// Value of an extra field right after the readings, if the line has one. It is never less than any of the readings.
    pub surplus: Option<f64>,
    /// The pose of the laser and the pose of the robot. If a mapper has corrected the log, the former is the reference.
    pub poses: Option<(Pose<World>, Pose<Odom>)>,
    /// Time by the log's clock, in seconds.
    pub time_s: f64,
}

impl ScanLine {
    /// Returns the error for a line that has one field too many.
    pub fn surplus_fault(&self) -> Fault {
        let count = self.ranges_m.len();
        let expected = 2 + count + self.kind.fields_after();
        Fault::Fields { word: format!("{} {count}", self.kind), expected, found: expected + 1 }
    }
}

/// The content of a line.
#[derive(Debug, Clone, PartialEq)]
pub enum Record {
    /// A scan.
    Scan(ScanLine),
    /// The pose in an ODOM line.
    Odometry(Pose<Odom>),
    /// A line that does not go into a recording, such as a parameter or another laser's scan, with its first word.
    Other(String),
    /// An empty line or a comment.
    Nothing,
}

impl Record {
    /// Parses a line.
    ///
    /// # Errors
    /// [`Fault`] if the line is invalid.
    pub fn parse(line: &[u8]) -> Result<Self, Fault> {
        let line = line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line);
        let words: Vec<&[u8]> = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).collect();
        match words.first().copied() {
            None => Ok(Self::Nothing),
            Some(word) if word.starts_with(b"#") => Ok(Self::Nothing),
            Some(b"ODOM") => Fields::new("ODOM", &words).odometry().map(Self::Odometry),
            Some(b"FLASER") => Fields::new("FLASER", &words).flaser().map(Self::Scan),
            Some(b"ROBOTLASER1") => {
                Fields::new("ROBOTLASER1", &words).stated(ScanKind::RobotLaser1).map(Self::Scan)
            }
            // Some programs omit the number if there is only one laser.
            Some(b"RAWLASER1" | b"RAWLASER") => {
                Fields::new("RAWLASER1", &words).stated(ScanKind::RawLaser1).map(Self::Scan)
            }
            Some(word) if is_kind(word) => Ok(Self::Other(String::from_utf8_lossy(word).into_owned())),
            Some(word) => Err(Fault::Kind { found: shown(word) }),
        }
    }
}

/// Returns true if a line of an unknown kind may begin with this word.
fn is_kind(word: &[u8]) -> bool {
    let is_of_name = |byte: &u8| byte.is_ascii_uppercase() || byte.is_ascii_digit() || b"_-".contains(byte);
    word.len() <= MAX_SHOWN && word[0].is_ascii_uppercase() && word.iter().all(is_of_name)
}

fn shown(word: &[u8]) -> String {
    let text = String::from_utf8_lossy(word);
    let mut shown: String = text.chars().take(MAX_SHOWN).collect();
    if shown.len() < text.len() {
        shown.push('…');
    }
    shown
}

/// Reads the fields of a line one after another.
struct Fields<'a> {
    kind: &'static str,
    words: &'a [&'a [u8]],
    next: usize,
}

impl<'a> Fields<'a> {
    fn new(kind: &'static str, words: &'a [&'a [u8]]) -> Self {
        Self { kind, words, next: 1 }
    }

    /// Parses the next field with `read`.
    fn take<T>(&mut self, expected: &'static str, read: impl FnOnce(&str) -> Option<T>) -> Result<T, Fault> {
        let word = self.words.get(self.next).copied().unwrap_or_default();
        self.next += 1;
        let value = std::str::from_utf8(word).ok().and_then(read);
        value.ok_or_else(|| Fault::Field { kind: self.kind, field: self.next, expected, found: shown(word) })
    }

    fn number(&mut self) -> Result<f64, Fault> {
        self.take("a finite number", |word| word.parse().ok().filter(|value: &f64| value.is_finite()))
    }

    fn pose<F>(&mut self) -> Result<Pose<F>, Fault> {
        let place = |word: &str| word.parse().ok().filter(|value: &f64| value.abs() < FAR_M);
        let mut coordinate = || self.take("a finite number of metres", place);
        let (x, y) = (coordinate()?, coordinate()?);
        Ok(Pose::new(x, y, self.number()?))
    }

    /// Takes a range. An infinite value means "no return". Only a value that is not a distance at all becomes NaN.
    fn range(&mut self) -> Result<f32, Fault> {
        let range: f32 = self.take("a range in metres", |word| word.parse().ok())?;
        Ok(if range >= 0.0 { range } else { f32::NAN })
    }

    fn count(&mut self, least: usize) -> Result<usize, Fault> {
        let expected = if least > 0 { "a number of readings, 2 to 1440" } else { "a number of remissions" };
        self.take(expected, |word| word.parse().ok().filter(|count| (least..=MAX_BEAMS).contains(count)))
    }

    /// Checks that the line has this number of fields.
    fn expect(&self, word: String, expected: usize) -> Result<(), Fault> {
        let found = self.words.len();
        if found == expected { Ok(()) } else { Err(Fault::Fields { word, expected, found }) }
    }

    fn odometry(mut self) -> Result<Pose<Odom>, Fault> {
        self.expect("ODOM".to_owned(), 7 + END_FIELDS)?;
        self.pose()
    }

    fn flaser(mut self) -> Result<ScanLine, Fault> {
        let kind = ScanKind::Flaser;
        let count = self.count(2)?;
        let expected = self.next + count + kind.fields_after();
        let has_surplus = self.words.len() == expected + 1;
        if !has_surplus {
            self.expect(format!("{kind} {count}"), expected)?;
        }
        let ranges_m = self.ranges(count)?;
        let surplus = has_surplus.then(|| self.number()).transpose()?;
        let most = ranges_m.iter().copied().filter(|range| range.is_finite()).fold(0.0, f32::max);
        if surplus.is_some_and(|found| found < most.into()) {
            self.expect(format!("{kind} {count}"), expected)?;
        }
        let poses = Some((self.pose()?, self.pose()?));
        let time_s = self.number()?;
        let beams = Beams::by_count(count);
        Ok(ScanLine { kind, beams, ranges_m, range_max_m: None, surplus, poses, time_s })
    }

    /// Parses the rest of a line that contains the laser's angles.
    fn stated(mut self, kind: ScanKind) -> Result<ScanLine, Fault> {
        self.next += 1; // the type of the laser
        let (angle_min_rad, view_rad, angle_increment_rad) = (self.number()?, self.number()?, self.number()?);
        let range_max_m = self.take("a maximum range", |word| word.parse().ok())?;
        self.next += 2; // accuracy, remission mode
        let count = self.count(2)?;
        let word = || format!("{kind} {count}");
        if self.words.len() <= self.next + count {
            self.expect(word(), self.next + count + 1 + kind.fields_after())?;
        }
        let ranges_m = self.ranges(count)?;
        let remissions = self.count(0)?;
        self.expect(word(), self.next + remissions + kind.fields_after())?;
        self.next += remissions;
        let poses = match kind {
            ScanKind::RobotLaser1 => {
                let poses = (self.pose()?, self.pose()?);
                self.next += 5; // velocities, safety distances, turn axis
                Some(poses)
            }
            ScanKind::Flaser | ScanKind::RawLaser1 => None,
        };
        let time_s = self.number()?;
        let beams = Beams { angle_min_rad, angle_increment_rad };
        self.check_angles(&beams, view_rad, count)?;
        let range_max_m = Some(range_max_m).filter(|range: &f64| range.is_finite() && *range > 0.0);
        Ok(ScanLine { kind, beams, ranges_m, range_max_m, surplus: None, poses, time_s })
    }

    fn ranges(&mut self, count: usize) -> Result<Vec<f32>, Fault> {
        (0..count).map(|_| self.range()).collect()
    }

    /// Checks that the beams span the stated field of view, with a tolerance of one and a half beams.
    fn check_angles(&self, beams: &Beams, view_rad: f64, count: usize) -> Result<(), Fault> {
        let step_rad = beams.angle_increment_rad;
        let is_laser = step_rad > 0.0
            && beams.angle_min_rad.abs() <= TAU
            && (view_rad - beams.span_rad(count)).abs() <= 1.5 * step_rad
            && view_rad <= TAU + step_rad;
        let (view_deg, found_deg) = (view_rad.to_degrees(), step_rad.to_degrees());
        if is_laser {
            Ok(())
        } else {
            Err(Fault::Angles { kind: self.kind, view_deg, found_deg, beams: count })
        }
    }
}

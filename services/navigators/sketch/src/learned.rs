//! What a robot has learned on drives by a drawing: the map of what it saw, the goals in it, and the correspondence between places
//! of the drawing and of the map. The next drive can start from it.
//!
//! ```json
//! { "learned": 2,
//!   "drawing": { "file": "sketch-a.svg", "bytes": 2345, "crc32": "89abcdef" },
//!   "map": { "resolution_m": 0.05, "origin_m": [-1.2, -3.0], "width": 300, "rows": ["300u", "120u4f176u"] },
//!   "start": { "at": [310.0, 822.0], "heading_deg": 90.0 },
//!   "goals": [ { "task": "office", "at": [700.0, 200.0], "at_m": [7.9, 3.1], "reached": true } ],
//!   "pairs": [ [310.0, 822.0, 0.0, 0.0] ],
//!   "end": { "at_m": [7.7, 3.0], "heading_deg": -91.5 } }
//! ```
//!
//! Positions called `at` are pixels of the drawing's file (column, row; row 0 at the top), and those called `at_m` are metres in
//! the map, whose origin is the robot's position at its first scan and whose x axis is its heading there. Rows of the map run along
//! x, the lowest first; `120u4f1o` means 120 unknown cells, four free ones and an occupied one.

mod combine;
mod drive;
mod export;
mod frame;
mod learner;
mod merge;
mod place;
mod upright;
mod warp;

use serde::{Deserialize, Serialize};
use sketchnav_mapping::{Cell, Map};
use sketchnav_schemas::geometry::Pose;
use sketchnav_schemas::message::MAX_TASKS;

pub use combine::{CombineError, Gain};
pub use drive::{begin, of_drive};
pub use export::{MapServer, map_server, svg};
pub use frame::show;
pub use learner::{LearnError, Learner};
pub use warp::Warp;

use crate::messages::MAX_SKETCH_CELLS;

/// The version of the format.
pub const VERSION: u64 = 2;
/// The earlier version, which can still be read. It lacks [`Learned::end`].
const WITHOUT_END: u64 = 1;
/// Length of a cell's side, in metres. The mapper works with this length, and the format allows no other.
pub const CELL_M: f64 = 0.05;
/// Number of cells per metre, which is the scale of a learned map as a drawing, in pixels per metre.
pub const CELLS_PER_M: f64 = 1.0 / CELL_M;
/// Maximum number of corresponding places.
pub const MAX_PAIRS: usize = 4096;
/// Largest absolute value of a position, in pixels or metres.
const FARTHEST: f64 = 100_000.0;

/// What was learned on a drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Learned {
    /// Version of the format.
    learned: u64,
    /// The drawing that the robot drove by.
    pub drawing: DrawingFile,
    /// What the robot saw.
    pub map: LearnedMap,
    /// The start in the drawing, which corresponds to the map's origin.
    pub start: LearnedStart,
    /// The goals of the drive, in order, followed by those that were added from other drives.
    pub goals: Vec<Goal>,
    /// Corresponding places: column and row in the drawing, x and y in the map.
    pub pairs: Vec<[f64; 4]>,
    /// Where the robot was at the end of the drive. `None` in files of version 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub end: Option<LearnedEnd>,
}

/// The file of a drawing, which identifies the drawing.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DrawingFile {
    /// Name of the file, without its folder.
    pub file: String,
    /// Size of the file.
    pub bytes: u64,
    /// CRC-32 of the file, in hexadecimal.
    pub crc32: String,
}

/// The start of the drive in the drawing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LearnedStart {
    /// Position, in pixels of the file.
    pub at: [f64; 2],
    /// Heading, in degrees counter-clockwise from "to the right".
    pub heading_deg: f64,
}

/// The robot's pose at the end of the drive, which is one hypothesis for where the next drive starts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LearnedEnd {
    /// Position in the map, in metres.
    pub at_m: [f64; 2],
    /// Heading, in degrees counter-clockwise from the map's x axis.
    pub heading_deg: f64,
}

/// A goal of the drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Goal {
    /// Name of the task.
    pub task: String,
    /// Position in the drawing, in pixels of the file.
    pub at: [f64; 2],
    /// Position in the map, in metres, as estimated by the robot when it reported that it had arrived. `None` if it did not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_m: Option<[f64; 2]>,
    /// True if the robot reported that it had arrived.
    pub reached: bool,
}

/// The map of what the robot saw.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "MapText", into = "MapText")]
pub struct LearnedMap {
    /// The lower left corner, in metres.
    pub origin_m: [f64; 2],
    /// Number of cells in a row.
    pub width: usize,
    /// The cells, in rows from the bottom up.
    pub cells: Vec<Cell>,
}

/// A map as in the file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct MapText {
    resolution_m: f64,
    origin_m: [f64; 2],
    width: usize,
    rows: Vec<String>,
}

/// The reason why a file cannot be used as a learned map.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LearnedError {
    /// The file is something else, or damaged.
    #[error("expected a learned map, as `sketchnav learn` writes it: {0}")]
    Broken(String),
    /// The file was written by another version.
    #[error(
        "learned: expected version {WITHOUT_END} or {VERSION}, found {0}; learn it again from the recording"
    )]
    Version(String),
    /// A value is out of bounds.
    #[error("{key}: expected {expected}, found {found}")]
    Value {
        /// The key of the value.
        key: String,
        /// What was expected.
        expected: &'static str,
        /// What was found.
        found: String,
    },
}

/// The version of a file, which is read before anything else. Files of other kinds do not contain it.
#[derive(Deserialize)]
struct Version {
    learned: serde_json::Value,
}

impl DrawingFile {
    /// Describes the file with this name and content.
    pub fn of(name: &str, content: &[u8]) -> Self {
        let mut crc = flate2::Crc::new();
        crc.update(content);
        let file = name.rsplit('/').next().unwrap_or(name).to_owned();
        Self { file, bytes: content.len() as u64, crc32: format!("{:08x}", crc.sum()) }
    }

    /// Returns true if the two have the same content, regardless of their names.
    pub fn is_same(&self, other: &Self) -> bool {
        (self.bytes, &self.crc32) == (other.bytes, &other.crc32)
    }
}

impl LearnedEnd {
    /// Returns a pose in the map as it is written to the file.
    fn new(pose: &Pose<Map>) -> Self {
        Self {
            at_m: [pose.x, pose.y].map(|m| rounded(m, 1e3)),
            heading_deg: rounded(pose.yaw_rad.to_degrees(), 100.0),
        }
    }
}

impl Learned {
    /// Returns true if the file identifies itself as a learned map of any version.
    pub fn is_one(bytes: &[u8]) -> bool {
        serde_json::from_slice::<Version>(bytes).is_ok()
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`LearnedError`] if the file is not a learned map, is damaged, or is of another version.
    pub fn parse(bytes: &[u8]) -> Result<Self, LearnedError> {
        let version: Version =
            serde_json::from_slice(bytes).map_err(|error| LearnedError::Broken(error.to_string()))?;
        if !matches!(version.learned.as_u64(), Some(WITHOUT_END | VERSION)) {
            return Err(LearnedError::Version(version.learned.to_string()));
        }
        let read: Self =
            serde_json::from_slice(bytes).map_err(|error| LearnedError::Broken(error.to_string()))?;
        read.check()?;
        Ok(Self { learned: VERSION, ..read })
    }

    /// Writes the file.
    pub fn to_bytes(&self) -> Vec<u8> {
        // A structure of numbers and strings can always be written.
        let mut bytes = serde_json::to_vec_pretty(self).unwrap_or_default();
        bytes.push(b'\n');
        bytes
    }

    fn check(&self) -> Result<(), LearnedError> {
        let value = |key: String, expected, found: String| Err(LearnedError::Value { key, expected, found });
        for (key, found, most) in
            [("goals", self.goals.len(), MAX_TASKS), ("pairs", self.pairs.len(), MAX_PAIRS)]
        {
            if found > most {
                return value(key.to_owned(), "fewer entries", found.to_string());
            }
        }
        let places = std::iter::once(("start.at".to_owned(), &self.start.at[..]))
            .chain(self.goals.iter().enumerate().map(|(i, goal)| (format!("goals[{i}].at"), &goal.at[..])))
            .chain(
                self.goals
                    .iter()
                    .enumerate()
                    .filter_map(|(i, goal)| Some((format!("goals[{i}].at_m"), &goal.at_m.as_ref()?[..]))),
            )
            .chain(self.pairs.iter().enumerate().map(|(i, pair)| (format!("pairs[{i}]"), &pair[..])))
            .chain(self.end.iter().map(|end| ("end.at_m".to_owned(), &end.at_m[..])))
            .chain([("map.origin_m".to_owned(), &self.map.origin_m[..])]);
        for (key, numbers) in places {
            if let Some(far) = numbers.iter().find(|number| number.abs() > FARTHEST) {
                return value(key, "numbers from -100000 to 100000", format!("{far:?}"));
            }
        }
        let headings = [("start", self.start.heading_deg)];
        for (key, deg) in headings.into_iter().chain(self.end.map(|end| ("end", end.heading_deg))) {
            if deg.abs() > 360.0 {
                return value(format!("{key}.heading_deg"), "-360 to 360", format!("{deg:?}"));
            }
        }
        Ok(())
    }

    /// Returns the correspondence of the drawing and the map, from the drawing's file to the map.
    pub fn to_map(&self) -> Warp {
        // Rows of a file run downwards, and y of the map upwards.
        Warp::new(self.pairs.iter().map(|&[column, row, x, y]| ([column, -row], [x, y])).collect())
    }
}

impl LearnedMap {
    /// Returns the number of free cells.
    pub fn free_cells(&self) -> usize {
        self.cells.iter().filter(|cell| **cell == Cell::Free).count()
    }

    /// Returns the number of rows.
    pub fn height(&self) -> usize {
        self.cells.len() / self.width.max(1)
    }

    /// Returns the cell at a position in metres, which is unknown outside the map.
    pub fn at_m(&self, at: [f64; 2]) -> Cell {
        let [column, row] = [0, 1].map(|k| ((at[k] - self.origin_m[k]) * CELLS_PER_M).floor());
        let is_inside =
            (0.0..self.width as f64).contains(&column) && (0.0..self.height() as f64).contains(&row);
        if is_inside { self.cells[row as usize * self.width + column as usize] } else { Cell::Unknown }
    }
}

/// Rounds a number to whole parts of which `parts` make one.
fn rounded(number: f64, parts: f64) -> f64 {
    (number * parts).round() / parts
}

const fn letter(cell: Cell) -> char {
    match cell {
        Cell::Unknown => 'u',
        Cell::Free => 'f',
        Cell::Occupied => 'o',
    }
}

impl From<LearnedMap> for MapText {
    fn from(map: LearnedMap) -> Self {
        let row = |cells: &[Cell]| {
            cells.chunk_by(|a, b| a == b).fold(String::new(), |mut text, run| {
                text.push_str(&run.len().to_string());
                text.push(letter(run[0]));
                text
            })
        };
        let rows = map.cells.chunks(map.width.max(1)).map(row).collect();
        Self { resolution_m: CELL_M, origin_m: map.origin_m, width: map.width, rows }
    }
}

impl TryFrom<MapText> for LearnedMap {
    type Error = LearnedError;

    fn try_from(text: MapText) -> Result<Self, LearnedError> {
        let value = |key: String, expected, found: String| Err(LearnedError::Value { key, expected, found });
        if text.resolution_m != CELL_M {
            return value("map.resolution_m".into(), "0.05", text.resolution_m.to_string());
        }
        let count = text.width.saturating_mul(text.rows.len());
        if !(1..=MAX_SKETCH_CELLS).contains(&count) {
            return value("map".into(), "1 to 3180080 cells", count.to_string());
        }
        let mut cells = Vec::with_capacity(count);
        for (i, row) in text.rows.iter().enumerate() {
            let begun = cells.len();
            if read_row(row, text.width, &mut cells).is_none() || cells.len() - begun != text.width {
                let found = row.chars().take(40).collect();
                return value(
                    format!("map.rows[{i}]"),
                    "runs of u, f and o as long as the map is wide",
                    found,
                );
            }
        }
        Ok(Self { origin_m: text.origin_m, width: text.width, cells })
    }
}

/// Appends the cells of a row, at most `width` of them. Returns `None` if the row is not a sequence of runs, or is too long.
fn read_row(row: &str, width: usize, cells: &mut Vec<Cell>) -> Option<()> {
    let (mut left, mut rest) = (width, row);
    while !rest.is_empty() {
        let end = rest.find(|c: char| !c.is_ascii_digit())?;
        let count: usize = rest[..end].parse().ok()?;
        let cell = match rest.as_bytes()[end] {
            b'u' => Cell::Unknown,
            b'f' => Cell::Free,
            b'o' => Cell::Occupied,
            _ => return None,
        };
        left = left.checked_sub(count)?;
        cells.extend(std::iter::repeat_n(cell, count));
        rest = &rest[end + 1..];
    }
    Some(())
}

#[cfg(test)]
mod tests;

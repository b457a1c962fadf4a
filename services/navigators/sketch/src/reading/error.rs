//! Errors in drawings. Each states what was expected, what was found, and where.

use sketchnav_schemas::mission::MissionError;

use super::reference::ReferenceError;
use crate::learned::LearnedError;

/// An error in a drawing, its marks, or the sketcher's parameters. Positions are in image pixels (column,
/// row) of the original file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SketchError {
    /// The mission's keys for this navigator are invalid.
    #[error(transparent)]
    Mission(#[from] MissionError),
    /// The file is empty.
    #[error("{file}: expected a drawing, found an empty file")]
    Empty {
        /// The file.
        file: String,
    },
    /// The file is of an unsupported type.
    #[error("{file}: expected PNG, JPEG, GIF, WebP, BMP, PNM, SVG or strokes in JSON, found {found}")]
    Unsupported {
        /// The file.
        file: String,
        /// The type that the first bytes suggest.
        found: String,
    },
    /// The file is of a supported type but truncated or garbled.
    #[error("{file}: expected a whole {kind} file: {reason}")]
    Broken {
        /// The file.
        file: String,
        /// The type.
        kind: &'static str,
        /// The decoder's message.
        reason: String,
    },
    /// The drawing exceeds the size that the sketcher decodes.
    #[error("{file}: expected at most {limit}, found {found}")]
    TooLarge {
        /// The file.
        file: String,
        /// The limit.
        limit: String,
        /// The actual size.
        found: String,
    },
    /// A value in a strokes file is invalid.
    #[error("{file}: {key}: expected {expected}, found {found}")]
    Strokes {
        /// The file.
        file: String,
        /// The key of the value.
        key: String,
        /// The expected value.
        expected: &'static str,
        /// The value that was found.
        found: String,
    },
    /// The page is blank.
    #[error("{file}: expected walls, found {found}")]
    NoWalls {
        /// The file.
        file: String,
        /// Description of what the page shows, with advice on what to do.
        found: String,
    },
    /// A value in a style cannot be read, so whatever it paints would be missing.
    #[error(
        "{file}: {element}: {property}: {value:?} cannot be read: {reason}; write colours as #rrggbb, lengths as numbers"
    )]
    Unreadable {
        /// The file.
        file: String,
        /// The element and its line.
        element: String,
        /// The property.
        property: String,
        /// The value of the property.
        value: String,
        /// Why it cannot be read.
        reason: String,
    },
    /// There is no free space.
    #[error("{file}: expected free space between the walls, found none")]
    NoFreeSpace {
        /// The file.
        file: String,
    },
    /// Marks arrived before there was a drawing.
    #[error("expected a drawing before the marks in it, found none")]
    NoSketch,
    /// The drawing is neither a sketch nor a route.
    #[error("kind: expected 1 (sketch) or 2 (route), found {found}")]
    Kind {
        /// The number in the message.
        found: u32,
    },
    /// The drawing has repeatedly crashed the sketcher.
    #[error("expected a drawing that can be read, found one that crashed the sketcher {attempts} times")]
    Fatal {
        /// Number of attempts to read the drawing.
        attempts: u32,
    },
    /// Neither the mission nor the drawing specifies where the robot starts.
    #[error(
        "navigator.start: expected the start in image pixels of {file}, found none in the mission or the drawing; it may be left out only with the method `outline`"
    )]
    NoStart {
        /// The drawing.
        file: String,
    },
    /// A task is to follow a route, although nobody has marked the start.
    #[error(
        "{task}.route: expected a goal, or a marked start (`navigator.start`), found a route for a robot that has to find out where it is"
    )]
    RouteWithoutStart {
        /// The task.
        task: String,
    },
    /// The robot's heading at the start is not given.
    #[error(
        "navigator.start_heading_deg: expected degrees, or a drawn route as the first task that leads more than {threshold_px:.0} px away; found neither"
    )]
    NoHeading {
        /// Distance from its start that a route must reach to determine the heading, in image pixels.
        threshold_px: f64,
    },
    /// A position is outside the drawing.
    #[error("{what} at ({:.0}, {:.0}): expected a place in {file}, {width} x {height} px", place[0], place[1])]
    Outside {
        /// The start or the task.
        what: String,
        /// The position.
        place: [f64; 2],
        /// The drawing.
        file: String,
        /// Width of the drawing, in image pixels.
        width: u32,
        /// Height of the drawing, in image pixels.
        height: u32,
    },
    /// A position is inside a wall.
    #[error("{what} at ({:.0}, {:.0}) of {file}: expected free space, found a wall; the nearest free place is ({:.0}, {:.0})", place[0], place[1], nearest[0], nearest[1])]
    InWall {
        /// The start or the task.
        what: String,
        /// The position.
        place: [f64; 2],
        /// The drawing.
        file: String,
        /// The nearest free position.
        nearest: [f64; 2],
    },
    /// A position cannot be reached over free cells.
    #[error("{what} at ({:.0}, {:.0}) of {file}: expected a free path from {from} at ({:.0}, {:.0}), found walls all around; the nearest reachable place is ({:.0}, {:.0}): move it there, or draw a door", place[0], place[1], start[0], start[1], nearest[0], nearest[1])]
    Unreachable {
        /// The task.
        what: String,
        /// The position.
        place: [f64; 2],
        /// The drawing.
        file: String,
        /// The start, or the first goal if the start is not marked.
        from: &'static str,
        /// Its position.
        start: [f64; 2],
        /// The nearest position that can be reached.
        nearest: [f64; 2],
    },
    /// The start lies outside the walls that enclose a position.
    #[error("navigator.start at ({:.0}, {:.0}) of {file}: expected a place within the walls around {what} at ({:.0}, {:.0}), found one outside them; the start is in pixels of the drawing: column and row, from its top left corner", start[0], start[1], place[0], place[1])]
    StartOutside {
        /// The start.
        start: [f64; 2],
        /// The drawing.
        file: String,
        /// The task.
        what: String,
        /// The position.
        place: [f64; 2],
    },
    /// There are no walls near the start or the tasks, so neither the scale of the drawing nor the robot's position in it can be
    /// determined.
    #[error("{what} at ({:.0}, {:.0}) of {file}: expected walls around it or on the way, found none within the laser's reach (about {reach_px:.0} px). Draw the walls around them", at[0], at[1])]
    OpenField {
        /// The start, or the first goal if the start is not marked.
        what: &'static str,
        /// Its position.
        at: [f64; 2],
        /// The drawing.
        file: String,
        /// Estimated range of the laser, in image pixels.
        reach_px: f64,
    },
    /// A goal is given by an unknown name.
    #[error("{what}: expected the name of a place, found {name:?}; {hint}")]
    UnknownName {
        /// The task.
        what: String,
        /// The name.
        name: String,
        /// The names of the places, or how to name one.
        hint: String,
    },
    /// A goal is given by a name that several places share.
    #[error("{what}: expected the name of one place of {file}, found {name:?} at ({:.0}, {:.0}) and at ({:.0}, {:.0}); rename one, or say which in navigator.places", places[0][0], places[0][1], places[1][0], places[1][1])]
    AmbiguousName {
        /// The task.
        what: String,
        /// The name.
        name: String,
        /// The drawing.
        file: String,
        /// The first two places.
        places: [[f64; 2]; 2],
    },
    /// A goal is given by half a relation.
    #[error("{what}: {reason} in {text:?}; write it as in \"the room left of the kitchen\"")]
    Relation {
        /// The task.
        what: String,
        /// The text.
        text: String,
        /// What was expected and found.
        reason: ReferenceError,
    },
    /// There is no room where a relation says.
    #[error("{what}: expected a room {relation} in {file}, found {others}")]
    NoRoom {
        /// The task.
        what: String,
        /// The relation.
        relation: String,
        /// The drawing.
        file: String,
        /// The rooms that there are.
        others: String,
    },
    /// There are several rooms where a relation says.
    #[error(
        "{what}: expected one room {relation} in {file}, found {found}; name the one that you mean on the drawing or in navigator.places"
    )]
    SeveralRooms {
        /// The task.
        what: String,
        /// The relation.
        relation: String,
        /// The drawing.
        file: String,
        /// The rooms.
        found: String,
    },
    /// A name was given for a place in a drawing that is made on the pad.
    #[error(
        "{name}: expected a task, found a name; in this run, people draw on the pad: tap the place there"
    )]
    NamesOnPad {
        /// The name.
        name: String,
    },
    /// There are no tasks or points, or more than a route message can contain.
    #[error("{key}: expected {expected}, found {found}")]
    Count {
        /// What was counted: tasks or points.
        key: &'static str,
        /// The expected value.
        expected: String,
        /// The number that was found.
        found: usize,
    },
    /// A parameter has an invalid value.
    #[error("parameters.sketcher.{key}: {reason}")]
    Setting {
        /// The key.
        key: &'static str,
        /// What was expected and found.
        reason: String,
    },
    /// The learned map cannot be read.
    #[error("{file}: {reason}")]
    Learned {
        /// The file.
        file: String,
        /// Why it cannot be read.
        reason: LearnedError,
    },
    /// The learned map belongs to another drawing.
    #[error(
        "navigator.learned_file: expected what was learned by {drawing}, found {file}, which was learned by {of} with other content; learn it by this drawing, or leave it out"
    )]
    LearnedByAnother {
        /// The learned map.
        file: String,
        /// The drawing that it belongs to.
        of: String,
        /// The mission's drawing.
        drawing: String,
    },
    /// A task leads to a place that is not in the learned map.
    #[error("{what} at ({:.0}, {:.0}): expected a place that the robot saw on the drive from which {file} was learned, found one that it did not see; drive this task by the drawing, without the learned map", place[0], place[1])]
    Unseen {
        /// The task.
        what: String,
        /// The position in the drawing.
        place: [f64; 2],
        /// The learned map.
        file: String,
    },
    /// The drawing cannot be opened.
    #[error("{file}: expected a drawing: {reason}")]
    File {
        /// The file.
        file: String,
        /// Why it cannot be opened.
        reason: String,
    },
}

/// Unsupported file types that people draw in: the offset of their magic bytes, the magic bytes, and a name.
const OTHERS: [((usize, &[u8]), &str); 11] = [
    ((0, b"%PDF"), "a PDF"),
    ((0, b"%!PS"), "PostScript"),
    ((0, b"II*\0"), "a TIFF"),
    ((0, b"MM\0*"), "a TIFF"),
    ((4, b"ftyphei"), "a HEIC photo"),
    ((4, b"ftypmif1"), "a HEIF photo"),
    ((4, b"ftypavif"), "an AVIF picture"),
    ((0, b"AC10"), "an AutoCAD drawing (DWG)"),
    ((0, b"8BPS"), "a Photoshop file"),
    ((0, b"gimp xcf"), "a GIMP file (XCF)"),
    ((0, b"PK\x03\x04"), "a ZIP archive, as many drawing programs save in"),
];

/// Root elements of XML files other than SVG, with a name for each kind of file.
const ROOTS: [(&str, &str); 5] = [
    ("xournal", "a Xournal++ note"),
    ("mxfile", "a draw.io drawing"),
    ("mxGraphModel", "a draw.io drawing"),
    ("html", "a web page"),
    ("diagram", "a Dia drawing"),
];

/// Strings that identify JSON from other programs, with a name for each kind of file.
const OTHER_JSON: [(&str, &str); 3] = [
    ("\"excalidraw\"", "an Excalidraw drawing"),
    ("\"tldrawFileFormatVersion\"", "a tldraw drawing"),
    ("\"FeatureCollection\"", "GeoJSON"),
];
/// Number of bytes at the beginning of a file that are searched for signs of another program.
const MOST_HEAD: usize = 1024;

/// Returns the picture that a map's YAML file names, or `None` if the bytes are not such a file.
fn map_picture(bytes: &[u8]) -> Option<String> {
    let head = String::from_utf8_lossy(bytes.get(..MOST_HEAD).unwrap_or(bytes));
    let value = |key: &str| head.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(':'));
    value("resolution")?;
    Some(value("image")?.trim().trim_matches(['"', '\'']).to_owned())
}

/// Makes the errors about one file.
pub(crate) struct Broken<'a> {
    /// Name of the file.
    pub file: &'a str,
}

impl Broken<'_> {
    pub(crate) fn file(&self) -> String {
        self.file.to_owned()
    }

    pub(crate) fn decode(&self, kind: &'static str, reason: impl std::fmt::Display) -> SketchError {
        SketchError::Broken { file: self.file(), kind, reason: reason.to_string() }
    }

    pub(crate) fn too_large(&self, limit: String, found: String) -> SketchError {
        SketchError::TooLarge { file: self.file(), limit, found }
    }

    pub(crate) fn no_walls(&self, found: impl Into<String>) -> SketchError {
        SketchError::NoWalls { file: self.file(), found: found.into() }
    }

    /// Returns the error for XML whose root element is not `svg`.
    pub(crate) fn other_xml(&self, root: &str) -> SketchError {
        let known = ROOTS.iter().find(|(known, _)| *known == root);
        let kind =
            known.map_or_else(|| format!("XML that begins with <{root}>"), |(_, kind)| (*kind).to_owned());
        SketchError::Unsupported { file: self.file(), found: format!("{kind}; export it as SVG or PNG") }
    }

    /// Returns the error for JSON without readable strokes, which comes from another program or is broken.
    pub(crate) fn other_json(&self, text: &str, reason: impl std::fmt::Display) -> SketchError {
        let head = &text.as_bytes()[..text.len().min(MOST_HEAD)];
        let has = |mark: &str| head.windows(mark.len()).any(|found| found == mark.as_bytes());
        match OTHER_JSON.iter().find(|(mark, _)| has(mark)) {
            Some((_, kind)) => SketchError::Unsupported {
                file: self.file(),
                found: format!("{kind}; export it as SVG or PNG"),
            },
            None => self.decode("strokes", reason),
        }
    }

    pub(crate) fn unsupported(&self, bytes: &[u8]) -> SketchError {
        if bytes.is_empty() {
            return SketchError::Empty { file: self.file() };
        }
        if bytes.starts_with(b"version https://git-lfs") {
            let found = "a Git LFS pointer instead of the file; `git lfs pull` fetches the file";
            return SketchError::Unsupported { file: self.file(), found: found.to_owned() };
        }
        if let Some((_, kind)) =
            OTHERS.iter().find(|(mark, _)| bytes.get(mark.0..).is_some_and(|it| it.starts_with(mark.1)))
        {
            return SketchError::Unsupported {
                file: self.file(),
                found: format!("{kind}; export it as PNG"),
            };
        }
        if let Some(picture) = map_picture(bytes) {
            let found = format!("a map's YAML; name its picture {picture:?} as the drawing");
            return SketchError::Unsupported { file: self.file(), found };
        }
        let first: String = bytes.iter().take(8).flat_map(|b| b.escape_ascii()).map(char::from).collect();
        SketchError::Unsupported { file: self.file(), found: format!("a file that begins with \"{first}\"") }
    }
}

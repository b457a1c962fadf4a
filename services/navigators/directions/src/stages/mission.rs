//! The keys of a mission of this kind.
//!
//! ```toml
//! [navigator]
//! kind = "directions"
//! method = "arrival"               # or branching, whose maps branch; belief, without a map; shortest, simplest, fewest-views, quickest, reliable, d-r: Park and Kender 1995
//! plane_file = "plane.png"         # the plane as the global camera sees it
//! calibration = [[101.5, 702.0, 0.0, 0.0], …]  # four known points or more: column, row; x, y in metres
//! map_noise_m = 0.001              # error of the map-maker's positions; else by the calibration
//! verify = "recoverable"           # or nothing, detectable; `arrival` chooses by itself
//! words = ["Isol", "IsolPair", "*"] # what the navigator understands; else every word
//! least_probability = 0.5          # of arrival; `run` does not start below it without --go
//!
//! [[task]]
//! name = "to the north"
//! goal = [0.5, 0.9]                # metres: the dot nearest to it
//! ```
//! On land, a robot with a laser all around drives among pillars:
//! ```toml
//! [navigator]
//! kind = "directions"
//! floor_file = "poles.floor.toml"  # in place of plane_file and calibration: its round furniture
//! landmark_radius_m = 0.15         # the pillars' radius; all are alike
//! range_m = 8.0                    # how far the navigator looks; else as far as its laser
//! ```
//! Markers that the robot's camera sees may show the kinds of these landmarks:
//! ```toml
//! [navigator.markers]              # the numbers of the markers of each kind
//! door = [1, 2, 3]
//! stairs = [4]
//! ```
//! In either case, the mission may state the error of the robot's heading at the start: `heading_noise_deg = 2.0`. The maps then
//! include bearings, by which the robot corrects its heading.
//!
//! The custom map may also be written by hand: `map_file = "mine.directions"` in place of `plane_file`, `calibration` and `goal`.
//! For the judge, the task may then list the landmark of each entry: `landmarks = [[x, y], …]`.

use std::collections::BTreeMap;

use serde::Deserialize;
use sketchnav_dots::camera::Known;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::mission::{Mission, MissionError, Task, keys};
use sketchnav_schemas::robot::{Drive, Robot};

use super::error::DirectionsError;
use super::settings;
use crate::arrival::{WORDS, WORDS_ON_LAND};
use crate::description::Descriptor;
use crate::geometry::Point;
use crate::markers::LandmarkKind;
use crate::messages::MAX_PLANNED;
use crate::navigator::Settings;
use crate::orientation::FOUND_RAD;
use crate::path::Objective;
use crate::plan::Verify;
use crate::sides::{Ordinal, Side};
use crate::transitions::Kinds;

/// The value of `[navigator] kind`.
pub const KIND: &str = "directions";
/// The values of `[navigator] method`, the default first.
pub const METHODS: [&str; Method::ALL.len()] = {
    let mut names = [""; Method::ALL.len()];
    let mut index = 0;
    while index < names.len() {
        names[index] = Method::ALL[index].name();
        index += 1;
    }
    names
};

/// The criterion by which a path is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// The probability of arrival, estimated by simulation. This method is our own.
    #[default]
    Arrival,
    /// The probability of arrival when branching maps are considered as well.
    Branching,
    /// The probability of arrival of a navigator that knows the positions of the landmarks instead of a map.
    Belief,
    /// The shortest distance.
    Shortest,
    /// The smallest number of map entries.
    Simplest,
    /// The smallest number of views that the navigator needs for its decisions.
    FewestViews,
    /// The shortest time of the journey.
    Quickest,
    /// The largest product of reliabilities.
    Reliable,
    /// The smallest ratio of distance to reliability.
    Ratio,
}

impl Method {
    /// All methods, the default first.
    pub const ALL: [Self; 9] = [
        Self::Arrival,
        Self::Branching,
        Self::Belief,
        Self::Shortest,
        Self::Simplest,
        Self::FewestViews,
        Self::Quickest,
        Self::Reliable,
        Self::Ratio,
    ];

    /// Returns the name in missions.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Arrival => "arrival",
            Self::Branching => "branching",
            Self::Belief => "belief",
            Self::Shortest => "shortest",
            Self::Simplest => "simplest",
            Self::FewestViews => "fewest-views",
            Self::Quickest => "quickest",
            Self::Reliable => "reliable",
            Self::Ratio => "d-r",
        }
    }

    /// Returns the method with the given name. `turns` is true on land or if the heading may be wrong. The error for an unknown
    /// or unsuitable method lists those that are possible.
    fn of(name: &str, turns: bool) -> Result<Self, MissionError> {
        let method = Self::ALL.into_iter().find(|method| method.name() == name);
        let is_possible = |method: &Self| !turns || method.lacks().is_none();
        if let Some(method) = method.filter(is_possible) {
            return Ok(method);
        }
        let possible = names(Self::ALL.into_iter().filter(is_possible), "or");
        let place = if turns { " on land or with heading_noise_deg" } else { "" };
        let because =
            method.and_then(Self::lacks).map_or(String::new(), |lacks| format!(", because {lacks}"));
        let reason = format!("expected {possible}{place}{because}, found {name}");
        Err(MissionError::Key { key: "navigator.method".into(), reason })
    }

    /// Returns what a method lacks among walls and for a robot whose heading may be wrong, or `None` if it lacks nothing.
    fn lacks(self) -> Option<&'static str> {
        match self {
            Self::Branching => Some("maps that branch have no walls and no bearings"),
            Self::Belief => Some("the list of landmarks has no walls and no bearings"),
            _ => None,
        }
    }

    /// Returns true if the probability of arrival is found by simulated journeys.
    fn is_simulated(self) -> bool {
        matches!(self, Self::Arrival | Self::Branching | Self::Belief)
    }

    /// Returns the objective that the search minimises for a navigator with the given settings, or `None` if the plan is chosen by
    /// simulation.
    pub fn objective(self, settings: &Settings) -> Option<Objective> {
        match self {
            Self::Arrival | Self::Branching | Self::Belief => None,
            Self::Shortest => Some(Objective::SHORTEST),
            Self::Simplest => Some(Objective::FEWEST_ENTRIES),
            Self::FewestViews => Some(Objective::FEWEST_VIEWS),
            Self::Quickest => Some(Objective::quickest(settings)),
            Self::Reliable => Some(Objective::MOST_RELIABLE),
            Self::Ratio => Some(Objective::Ratio),
        }
    }
}

/// The origin of the custom maps.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// The map-maker makes the maps from a picture.
    Picture {
        /// Name of the picture's file.
        file: String,
        /// Points of the picture with known positions.
        calibration: Vec<Known>,
        /// Standard deviation of the map-maker's positions on each axis, in metres, if the mission states it.
        noise_m: Option<f64>,
    },
    /// The map-maker makes the maps from a floor plan.
    Floor {
        /// Name of the floor plan's file.
        file: String,
        /// Standard deviation of the map-maker's positions on each axis, in metres, if the mission states it.
        noise_m: Option<f64>,
    },
    /// The map was written by hand.
    Map {
        /// Name of the map's file.
        file: String,
    },
}

impl Source {
    /// Returns the name of the file.
    pub fn file(&self) -> &str {
        match self {
            Self::Picture { file, .. } | Self::Floor { file, .. } | Self::Map { file } => file,
        }
    }
}

/// The keys of a mission about the landmarks of a robot on land.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LandKeys {
    /// Radius of the landmarks, in metres.
    pub radius_m: f64,
    /// Maximum distance at which the robot looks for landmarks, in metres. `None` stands for the range of its laser.
    pub range_m: Option<f64>,
}

/// The part of a mission that is specific to this kind of navigator.
#[derive(Debug, Clone, PartialEq)]
pub struct DirectionsMission {
    /// The criterion by which a path is chosen.
    pub method: Method,
    /// The origin of the custom maps.
    pub source: Source,
    /// The landmarks of a robot on land, or `None` above a plane.
    pub land: Option<LandKeys>,
    /// Numbers of the markers on the landmarks of each kind.
    pub markers: BTreeMap<LandmarkKind, Vec<u32>>,
    /// Standard deviation of the heading at the start, in degrees. If it is above 0, the maps include bearings to correct the
    /// heading.
    pub heading_noise_deg: f64,
    /// Whether the robot may face any direction at the start. It finds its heading up to `heading_noise_deg`.
    pub heading_unknown: bool,
    /// Probability of arrival below which a robot should not start without a person's consent.
    pub least_probability: f64,
    /// The errors that the paper's maps allow the navigator to notice.
    pub verify: Verify,
    /// The words that the navigator understands. The first landmark on a side stands for all landmarks counted there.
    pub words: Vec<Descriptor>,
    /// Whether the map-maker counts landmarks on the sides that the navigator understands.
    pub ordinals: bool,
    /// The goal of each task. Empty if the custom map was written by hand.
    pub goals: Vec<Point>,
    /// The landmarks that a handwritten map refers to. Empty if the mission doesn't list them.
    pub landmarks: Vec<Point>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct NavigatorKeys {
    method: Option<String>,
    plane_file: Option<String>,
    calibration: Option<Vec<[f64; 4]>>,
    map_noise_m: Option<f64>,
    map_file: Option<String>,
    floor_file: Option<String>,
    landmark_radius_m: Option<f64>,
    range_m: Option<f64>,
    heading_noise_deg: Option<f64>,
    heading: Option<HeadingWord>,
    least_probability: Option<f64>,
    verify: Option<VerifyWord>,
    words: Option<Vec<String>>,
    #[serde(default)]
    ordinals: bool,
    #[serde(default)]
    markers: BTreeMap<String, Vec<u32>>,
}

/// The only value of `navigator.heading`.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum HeadingWord {
    Unknown,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum VerifyWord {
    Nothing,
    Recoverable,
    Detectable,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct TaskKeys {
    goal: Option<[f64; 2]>,
    landmarks: Option<Vec<[f64; 2]>>,
}

impl DirectionsMission {
    /// Reads and checks the keys of this kind.
    ///
    /// # Errors
    /// [`MissionError`] with the key and the expected value.
    pub fn of(mission: &Mission) -> Result<Self, MissionError> {
        let keys: NavigatorKeys = keys("navigator", &mission.navigator.given)?;
        let heading_noise_deg = heading_noise_deg(&keys)?;
        let turns = keys.landmark_radius_m.is_some() || heading_noise_deg > 0.0;
        let method = keys.method.as_deref().map_or(Ok(Method::default()), |name| Method::of(name, turns))?;
        if keys.verify.is_some() && method.is_simulated() {
            let simulated = names(Method::ALL.into_iter().filter(|method| method.is_simulated()), "and");
            let reason =
                format!("expected no such key for {simulated}, which verify where that pays, found it");
            return Err(MissionError::Key { key: "navigator.verify".into(), reason });
        }
        let verify = match keys.verify {
            Some(VerifyWord::Nothing) => Verify::Nothing,
            Some(VerifyWord::Recoverable) | None => Verify::Recoverable,
            Some(VerifyWord::Detectable) => Verify::Detectable,
        };
        let (land, words) = (land(&keys)?, words(keys.words.as_deref())?);
        let least_probability = least_probability(&keys)?;
        let ordinals = ordinals(&keys, method)?;
        let markers = markers(&keys)?;
        let heading_unknown = keys.heading.is_some();
        let source = source(keys)?;
        let is_written = matches!(source, Source::Map { .. });
        if is_written && method == Method::Belief {
            let expected = "another method with map_file, because a navigator with a belief follows no map";
            return Err(wrong("navigator.method", expected, "belief"));
        }
        if is_written && mission.task.len() != 1 {
            let found = mission.task.len();
            return Err(wrong("task", "one task with navigator.map_file", &found.to_string()));
        }
        let (mut goals, mut landmarks) = (Vec::new(), Vec::new());
        for (number, task) in (1..).zip(&mission.task) {
            let (goal, listed) = task_places(number, task, is_written)?;
            goals.extend(goal);
            landmarks.extend(listed);
        }
        Ok(Self {
            method,
            source,
            land,
            markers,
            heading_noise_deg,
            heading_unknown,
            least_probability,
            verify,
            words,
            ordinals,
            goals,
            landmarks,
        })
    }

    /// Returns the kind of landmark that the marker with the given number stands for, if the mission lists it.
    pub fn kind(&self, marker: u32) -> Option<LandmarkKind> {
        self.markers.iter().find(|(_, numbers)| numbers.contains(&marker)).map(|(kind, _)| *kind)
    }

    /// Returns the words for the map-maker's plans, namely those words of the method that the navigator understands or, if there
    /// are none, the understood words whose landmark is known beforehand.
    pub fn planned(&self) -> Vec<Descriptor> {
        let usual: &[Descriptor] = match self.land {
            _ if !self.method.is_simulated() => Kinds::PAPER.words,
            Some(_) => &WORDS_ON_LAND,
            None => &WORDS,
        };
        let understood = |words: &[Descriptor]| -> Vec<Descriptor> {
            words.iter().copied().filter(|word| self.words.contains(word)).collect()
        };
        let mut words = understood(usual);
        if words.is_empty() {
            words = understood(&Descriptor::DEFINITE);
        }
        let counted =
            self.words.iter().filter(|word| self.ordinals && matches!(word, Descriptor::Counted(..)));
        words.extend(counted);
        words
    }
}

/// Lists the names of methods.
fn names(methods: impl Iterator<Item = Method>, joint: &str) -> String {
    let mut names: Vec<_> = methods.map(Method::name).collect();
    let last = names.pop().unwrap_or_default();
    if names.is_empty() { last.to_owned() } else { format!("{} {joint} {last}", names.join(", ")) }
}

pub(super) fn wrong(key: &str, expected: &'static str, found: &str) -> MissionError {
    MissionError::Value { key: key.to_owned(), expected, found: found.to_owned() }
}

/// The words of a mission for the landmarks counted on a side.
const SIDES: [(&str, Descriptor); 4] = [
    ("Left", Descriptor::Counted(Side::Left, Ordinal::FIRST)),
    ("Right", Descriptor::Counted(Side::Right, Ordinal::FIRST)),
    ("Ahead", Descriptor::Counted(Side::Ahead, Ordinal::FIRST)),
    ("Behind", Descriptor::Counted(Side::Behind, Ordinal::FIRST)),
];

fn words(given: Option<&[String]>) -> Result<Vec<Descriptor>, MissionError> {
    let known = || Descriptor::ALL.map(|word| (word.word(), word)).into_iter().chain(SIDES);
    let Some(given) = given else { return Ok(known().map(|(_, word)| word).collect()) };
    let word = |word: &String| {
        let found = known().find(|(known, _)| known.eq_ignore_ascii_case(word)).map(|(_, word)| word);
        let words = || known().map(|(known, _)| known).collect::<Vec<_>>().join(", ");
        found.ok_or_else(|| MissionError::Key {
            key: "navigator.words".into(),
            reason: format!("expected some of {}, found {word:?}", words()),
        })
    };
    given.iter().map(word).collect()
}

/// Reads the keys for a robot on land.
fn land(keys: &NavigatorKeys) -> Result<Option<LandKeys>, MissionError> {
    let only = |key: &str, is_there: bool| match is_there {
        true => Err(wrong(key, "no such key without navigator.landmark_radius_m", "it")),
        false => Ok(()),
    };
    let Some(radius_m) = keys.landmark_radius_m else {
        only("navigator.floor_file", keys.floor_file.is_some())?;
        only("navigator.range_m", keys.range_m.is_some())?;
        return Ok(None);
    };
    if keys.plane_file.is_some() {
        return Err(wrong("navigator.landmark_radius_m", "no such key with plane_file", "it"));
    }
    for (key, expected, value, range) in [
        ("navigator.landmark_radius_m", "0.02 to 1 m", radius_m, 0.02..=1.0),
        ("navigator.range_m", "1 to 100 m", keys.range_m.unwrap_or(1.0), 1.0..=100.0),
    ] {
        if !range.contains(&value) {
            return Err(wrong(key, expected, &value.to_string()));
        }
    }
    Ok(Some(LandKeys { radius_m, range_m: keys.range_m }))
}

/// Reads the kinds of landmarks, and which markers show them.
fn markers(keys: &NavigatorKeys) -> Result<BTreeMap<LandmarkKind, Vec<u32>>, MissionError> {
    if keys.landmark_radius_m.is_none() && !keys.markers.is_empty() {
        return Err(wrong("navigator.markers", "no such key without navigator.landmark_radius_m", "it"));
    }
    let mut markers = BTreeMap::new();
    let mut kinds = BTreeMap::new();
    for (name, numbers) in &keys.markers {
        let key = format!("navigator.markers.{name}");
        let kind = LandmarkKind::of(name).ok_or_else(|| wrong(&key, NAME_OF_KIND, name))?;
        for number in numbers {
            if let Some(other) = kinds.insert(number, kind) {
                let found = format!("marker {number} also for {other}");
                return Err(wrong(&key, "numbers that no other kind has, each once", &found));
            }
        }
        markers.insert(kind, numbers.clone());
    }
    Ok(markers)
}

const NAME_OF_KIND: &str =
    "a kind: at most 16 letters (a to z), digits and hyphens, beginning with a letter, and no word of maps";

fn heading_noise_deg(keys: &NavigatorKeys) -> Result<f64, MissionError> {
    if keys.heading.is_some() {
        let expected = match (keys.landmark_radius_m, keys.heading_noise_deg) {
            (None, _) => "no such key above a plane, where the window's axes are those of the plane",
            (_, Some(_)) => "no such key with heading_noise_deg, since the robot finds its heading itself",
            (Some(_), None) => return Ok(FOUND_RAD.to_degrees()),
        };
        return Err(wrong("navigator.heading", expected, "it"));
    }
    let heading_noise_deg = keys.heading_noise_deg.unwrap_or(0.0);
    if !(0.0..=MOST_ASIDE_DEG).contains(&heading_noise_deg) {
        return Err(wrong("navigator.heading_noise_deg", "0 to 20 degrees", &heading_noise_deg.to_string()));
    }
    Ok(heading_noise_deg)
}

/// The default of `least_probability`, below which a journey is more likely to fail than to arrive.
const LEAST_PROBABILITY: f64 = 0.5;

fn least_probability(keys: &NavigatorKeys) -> Result<f64, MissionError> {
    let least = keys.least_probability.unwrap_or(LEAST_PROBABILITY);
    if !(0.0..=1.0).contains(&least) {
        return Err(wrong("navigator.least_probability", "0 to 1", &least.to_string()));
    }
    Ok(least)
}

/// Reads whether the map-maker counts landmarks.
fn ordinals(keys: &NavigatorKeys, method: Method) -> Result<bool, MissionError> {
    let expected = match (method, &keys.map_file) {
        _ if !keys.ordinals => return Ok(false),
        (_, Some(_)) => "no such key with map_file, in which a person decides what to count",
        (Method::Arrival, None) => return Ok(true),
        _ => "no such key for methods other than `arrival`, which do not count landmarks",
    };
    Err(wrong("navigator.ordinals", expected, "it"))
}

fn map_noise(keys: &NavigatorKeys) -> Result<Option<f64>, MissionError> {
    match keys.map_noise_m.filter(|noise_m| !(0.0..=10.0).contains(noise_m)) {
        Some(noise_m) => Err(wrong("navigator.map_noise_m", "0 to 10 m", &noise_m.to_string())),
        None => Ok(keys.map_noise_m),
    }
}

fn source(mut keys: NavigatorKeys) -> Result<Source, MissionError> {
    let expected = "one of plane_file, floor_file and map_file";
    if let Some(file) = keys.floor_file.take() {
        if keys.map_file.is_some() || keys.calibration.is_some() {
            return Err(wrong(
                "navigator.floor_file",
                "neither map_file nor calibration with it",
                "one of them",
            ));
        }
        return Ok(Source::Floor { file, noise_m: map_noise(&keys)? });
    }
    let noise_m = map_noise(&keys)?;
    match (keys.plane_file, keys.map_file) {
        (Some(file), None) => {
            let Some(points) = keys.calibration else {
                return Err(wrong(
                    "navigator.calibration",
                    "at least four known points with plane_file",
                    "none",
                ));
            };
            let known = |[column, row, x, y]: [f64; 4]| Known { pixel: [column, row], place: [x, y] };
            let calibration = points.into_iter().map(known).collect();
            Ok(Source::Picture { file, calibration, noise_m })
        }
        (None, Some(_)) if keys.calibration.is_some() || noise_m.is_some() => {
            Err(wrong("navigator.map_file", "neither calibration nor map_noise_m with it", "one of them"))
        }
        (None, Some(file)) => Ok(Source::Map { file }),
        (None, None) => Err(wrong("navigator", expected, "none")),
        (Some(_), Some(_)) => Err(wrong("navigator", expected, "both")),
    }
}

fn task_places(
    number: usize,
    task: &Task,
    is_written: bool,
) -> Result<(Option<Point>, Vec<Point>), MissionError> {
    let key = format!("task {number} ({})", task.name);
    let TaskKeys { goal, landmarks } = keys(&key, &task.given)?;
    let point = |[x, y]: [f64; 2]| Point::new(x, y);
    match (is_written, goal, landmarks) {
        (false, Some(goal), None) => Ok((Some(point(goal)), Vec::new())),
        (true, None, landmarks) => {
            let landmarks = landmarks.unwrap_or_default();
            if landmarks.len() > MAX_PLANNED {
                let found = landmarks.len().to_string();
                return Err(wrong(&format!("{key}.landmarks"), "at most 512 landmarks", &found));
            }
            Ok((None, landmarks.into_iter().map(point).collect()))
        }
        (false, None, _) => Err(wrong(&format!("{key}.goal"), "a place in metres", "none")),
        (false, ..) => {
            Err(wrong(&format!("{key}.landmarks"), "no such key without navigator.map_file", "it"))
        }
        (true, ..) => Err(wrong(&format!("{key}.goal"), "no such key with navigator.map_file", "it")),
    }
}

/// Maximum deviation of the robot's heading from the axes of the floor or plane at the start, in degrees.
const MOST_ASIDE_DEG: f64 = 20.0;

/// Checks the requirements of this kind of navigator for a mission and a robot.
///
/// # Errors
/// [`DirectionsError`] with the key or the sensor at fault.
pub fn check(mission: &Mission, robot: &Robot) -> Result<(), DirectionsError> {
    let read = DirectionsMission::of(mission)?;
    settings::effort(mission)?;
    settings::settings(mission, robot)?;
    settings::camera(mission, robot)?;
    // Above a plane, the heading is only corrected if the mission states that it may be wrong.
    let is_corrected = read.land.is_some() || read.heading_noise_deg > 0.0;
    let most_deg = match (read.heading_unknown, is_corrected) {
        (true, _) => f64::INFINITY,
        (_, true) => MOST_ASIDE_DEG,
        _ => 0.0,
    };
    if mission.start.world_heading_deg.abs() > most_deg {
        let found = mission.start.world_heading_deg.to_string();
        let expected = if is_corrected {
            "-20 to 20, or navigator.heading = \"unknown\": the robot's axes are nearly those of its map"
        } else {
            "0, or navigator.heading_noise_deg: the window's axes are those of the plane"
        };
        return Err(wrong("start.world_heading_deg", expected, &found).into());
    }
    let is_made = !matches!(read.source, Source::Map { .. });
    if is_made && robot.drive == Drive::Differential && read.land.is_some() && read.heading_noise_deg == 0.0 {
        let expected = "more than 0 for a robot with a differential drive, whose heading drifts as it turns";
        return Err(wrong("navigator.heading_noise_deg", expected, "0").into());
    }
    if is_made && (read.planned().is_empty() || !read.words.contains(&Descriptor::Any)) {
        let found = read.words.iter().map(|word| word.word()).collect::<Vec<_>>().join(", ");
        let expected = "* and one of Obvious, Isol, IsolPair, PlusPair: the map-maker plans with those";
        return Err(wrong("navigator.words", expected, &found).into());
    }
    if !mission.parameters.of(Process::Localizer).is_empty() {
        return Err(wrong("parameters.localizer", "no key: it has no parameters", "some").into());
    }
    Ok(())
}

#[cfg(test)]
mod tests;

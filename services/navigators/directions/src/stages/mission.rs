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
use sketchnav_schemas::robot::Robot;

use super::error::DirectionsError;
use super::settings;
use crate::arrival::{WORDS, WORDS_ON_LAND};
use crate::description::Descriptor;
use crate::geometry::Point;
use crate::markers::LandmarkKind;
use crate::messages::MAX_PLANNED;
use crate::navigator::Settings;
use crate::path::Objective;
use crate::plan::Verify;
use crate::transitions::Kinds;

/// The value of `[navigator] kind`.
pub const KIND: &str = "directions";
/// The values of `[navigator] method`, the default first.
pub const METHODS: [&str; 9] =
    ["arrival", "branching", "belief", "shortest", "simplest", "fewest-views", "quickest", "reliable", "d-r"];

/// The criterion by which a path is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
pub enum Method {
    /// The probability of arrival, estimated by simulation. This method is our own.
    #[default]
    #[serde(rename = "arrival")]
    Arrival,
    /// The probability of arrival when branching maps are considered as well.
    #[serde(rename = "branching")]
    Branching,
    /// The probability of arrival of a navigator that knows the positions of the landmarks instead of a map.
    #[serde(rename = "belief")]
    Belief,
    /// The shortest distance.
    #[serde(rename = "shortest")]
    Shortest,
    /// The smallest number of map entries.
    #[serde(rename = "simplest")]
    Simplest,
    /// The smallest number of views that the navigator needs for its decisions.
    #[serde(rename = "fewest-views")]
    FewestViews,
    /// The shortest time of the journey.
    #[serde(rename = "quickest")]
    Quickest,
    /// The largest product of reliabilities.
    #[serde(rename = "reliable")]
    Reliable,
    /// The smallest ratio of distance to reliability.
    #[serde(rename = "d-r")]
    Ratio,
}

impl Method {
    /// Returns true if the probability of arrival is found by simulated journeys.
    fn is_simulated(self) -> bool {
        matches!(self, Self::Arrival | Self::Branching | Self::Belief)
    }

    /// Rejects methods that support neither walls nor bearings.
    fn is_for_land(self) -> Result<(), MissionError> {
        let (expected, found) = match self {
            Self::Branching => (
                "another method on land or with heading_noise_deg, because maps that branch have no walls and no bearings",
                "branching",
            ),
            Self::Belief => (
                "another method on land or with heading_noise_deg, because the list of landmarks has no walls and no bearings",
                "belief",
            ),
            _ => return Ok(()),
        };
        Err(wrong("navigator.method", expected, found))
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
    /// Probability of arrival below which a robot should not start without a person's consent.
    pub least_probability: f64,
    /// The errors that the paper's maps allow the navigator to notice.
    pub verify: Verify,
    /// The words that the navigator understands.
    pub words: Vec<Descriptor>,
    /// The goal of each task. Empty if the custom map was written by hand.
    pub goals: Vec<Point>,
    /// The landmarks that a handwritten map refers to. Empty if the mission doesn't list them.
    pub landmarks: Vec<Point>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct NavigatorKeys {
    #[serde(default)]
    method: Method,
    plane_file: Option<String>,
    calibration: Option<Vec<[f64; 4]>>,
    map_noise_m: Option<f64>,
    map_file: Option<String>,
    floor_file: Option<String>,
    landmark_radius_m: Option<f64>,
    range_m: Option<f64>,
    heading_noise_deg: Option<f64>,
    least_probability: Option<f64>,
    verify: Option<VerifyWord>,
    words: Option<Vec<String>>,
    #[serde(default)]
    markers: BTreeMap<String, Vec<u32>>,
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
        if keys.verify.is_some() && keys.method.is_simulated() {
            let expected =
                "no such key for `arrival`, `branching` and `belief`, which verify where that pays";
            return Err(wrong("navigator.verify", expected, "it"));
        }
        let verify = match keys.verify {
            Some(VerifyWord::Nothing) => Verify::Nothing,
            Some(VerifyWord::Recoverable) | None => Verify::Recoverable,
            Some(VerifyWord::Detectable) => Verify::Detectable,
        };
        let (method, words) = (keys.method, words(keys.words.as_deref())?);
        let (land, heading_noise_deg) = (land(&keys)?, heading_noise_deg(&keys)?);
        let least_probability = least_probability(&keys)?;
        let markers = markers(&keys)?;
        if land.is_some() || heading_noise_deg > 0.0 {
            method.is_for_land()?;
        }
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
            least_probability,
            verify,
            words,
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
        let words = understood(usual);
        if words.is_empty() { understood(&Descriptor::DEFINITE) } else { words }
    }
}

pub(super) fn wrong(key: &str, expected: &'static str, found: &str) -> MissionError {
    MissionError::Value { key: key.to_owned(), expected, found: found.to_owned() }
}

fn words(given: Option<&[String]>) -> Result<Vec<Descriptor>, MissionError> {
    let Some(given) = given else { return Ok(Descriptor::ALL.to_vec()) };
    let word = |word: &String| {
        let known = Descriptor::ALL.into_iter().find(|known| known.word().eq_ignore_ascii_case(word));
        let words = || Descriptor::ALL.map(Descriptor::word).join(", ");
        known.ok_or_else(|| MissionError::Key {
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
    let most_deg = if is_corrected { MOST_ASIDE_DEG } else { 0.0 };
    if mission.start.world_heading_deg.abs() > most_deg {
        let found = mission.start.world_heading_deg.to_string();
        let expected = if is_corrected {
            "-20 to 20: the robot's axes are nearly those of its map"
        } else {
            "0, or navigator.heading_noise_deg: the window's axes are those of the plane"
        };
        return Err(wrong("start.world_heading_deg", expected, &found).into());
    }
    let is_made = !matches!(read.source, Source::Map { .. });
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
mod tests {
    use super::*;
    use crate::geometry::Window;

    const MISSION: &str = "name='m'\nrobot='helicopter'\nworld={plane='p.toml'}\nstart={world=[0,0],world_heading_deg=0}\n\
        [navigator]\nkind='directions'\nplane_file='p.png'\ncalibration=[[0,0,0,0]]\n[[task]]\nname='on'\ngoal=[0.5, 0.9]\n";

    fn read(text: &str) -> Result<DirectionsMission, MissionError> {
        DirectionsMission::of(&Mission::parse(text).unwrap())
    }

    #[test]
    fn branching_and_belief_are_for_planes_and_for_a_heading_that_is_right() {
        for (method, read_as) in [("branching", Method::Branching), ("belief", Method::Belief)] {
            let ours = MISSION.replace("kind='directions'", &format!("kind='directions'\nmethod='{method}'"));
            assert_eq!(read(&ours).unwrap().method, read_as);
            for key in ["heading_noise_deg=2.0", "landmark_radius_m=0.15"] {
                let wrong = ours
                    .replace("plane_file='p.png'", "floor_file='f.toml'")
                    .replace("calibration=[[0,0,0,0]]", key);
                let wrong = if key.starts_with('h') {
                    wrong.replace("floor_file='f.toml'", "map_file='m'")
                } else {
                    wrong
                };
                let error = read(&wrong).unwrap_err().to_string();
                assert!(
                    error.contains("navigator.method") && error.contains(&format!("found {method}")),
                    "{error}"
                );
            }
        }
    }

    #[test]
    fn a_mission_says_what_is_seen_and_where_to_go() {
        let mission = read(MISSION).unwrap();
        assert_eq!((mission.method, &mission.goals[..]), (Method::Arrival, &[Point::new(0.5, 0.9)][..]));
        let usual = Settings::new(Window::new(0.1, 0.015).unwrap(), 0.001);
        for method in METHODS {
            let text = MISSION.replace("kind='directions'", &format!("kind='directions'\nmethod='{method}'"));
            let objective = read(&text).unwrap().method.objective(&usual);
            assert_eq!(objective.is_none(), METHODS[..3].contains(&method));
        }
    }

    #[test]
    fn errors_name_the_key() {
        let navigator =
            |keys: &str| MISSION.replace("kind='directions'", &format!("kind='directions'\n{keys}"));
        let written =
            MISSION.replace("plane_file='p.png'\ncalibration=[[0,0,0,0]]", "map_file='a.directions'");
        for (text, words) in [
            (
                MISSION.replace("calibration=[[0,0,0,0]]", ""),
                "navigator.calibration: expected at least four known points",
            ),
            (
                MISSION.replace("plane_file='p.png'", ""),
                "navigator: expected one of plane_file, floor_file and map_file, found none",
            ),
            (
                navigator("map_file='a'"),
                "navigator: expected one of plane_file, floor_file and map_file, found both",
            ),
            (navigator("map_noise_m=-1.0"), "navigator.map_noise_m: expected 0 to 10 m, found -1"),
            (navigator("least_probability=50"), "navigator.least_probability: expected 0 to 1, found 50"),
            (navigator("words=['Isol','Lonely']"), "navigator.words: expected some of Obvious, Isol"),
            (navigator("verify='nothing'"), "navigator.verify: expected no such key for `arrival`"),
            (
                written
                    .replace("kind='directions'", "kind='directions'\nmethod='belief'")
                    .replace("goal=[0.5, 0.9]", ""),
                "navigator.method: expected another method with map_file",
            ),
            (navigator("method='fast'"), "navigator.method: unknown variant `fast`"),
            (
                MISSION.replace("goal=[0.5, 0.9]", ""),
                "task 1 (on).goal: expected a place in metres, found none",
            ),
            (MISSION.replace("goal=", "goals="), "task 1 (on): unknown field `goals`"),
            (written.clone(), "task 1 (on).goal: expected no such key with navigator.map_file"),
            (
                format!("{}[[task]]\nname='two'\n", written.replace("goal=[0.5, 0.9]", "")),
                "task: expected one task with navigator.map_file, found 2",
            ),
        ] {
            let error = read(&text).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    const ON_LAND: &str = "name='m'\nrobot='panorama'\nworld={floor_plan='f.toml'}\nstart={world=[0,0],world_heading_deg=0}\n\
        [navigator]\nkind='directions'\nfloor_file='f.toml'\nlandmark_radius_m=0.15\n\
        [navigator.markers]\nstairs=[4]\ndoor=[1, 2]\n[[task]]\nname='on'\ngoal=[0.5, 0.9]\n";

    #[test]
    fn a_mission_says_which_markers_show_which_kinds() {
        let mission = read(ON_LAND).unwrap();
        let kinds: Vec<_> = mission.markers.keys().map(LandmarkKind::name).collect();
        assert_eq!(kinds, ["door", "stairs"]);
        assert_eq!(
            [2, 3, 4].map(|id| mission.kind(id)),
            [LandmarkKind::of("door"), None, LandmarkKind::of("stairs")]
        );
        for (given, wrong, words) in [
            ("stairs=[4]", "Stairs=[4]", "navigator.markers.Stairs: expected a kind: at most 16 letters"),
            ("stairs=[4]", "isol=[4]", "navigator.markers.isol: expected a kind: "),
            (
                "stairs=[4]",
                "stairs=[4, 2]",
                "navigator.markers.stairs: expected numbers that no other kind has, each once, found marker 2 also for door",
            ),
            (
                "floor_file='f.toml'\nlandmark_radius_m=0.15",
                "map_file='m'",
                "navigator.markers: expected no such key without navigator.landmark_radius_m",
            ),
        ] {
            let error = read(&ON_LAND.replace(given, wrong)).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
        let robot = |name: &str| {
            let folder =
                std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../sim/missions/directions");
            sketchnav_sim::files::robot(&folder.join(name).to_string_lossy()).unwrap()
        };
        let mission = Mission::parse(ON_LAND).unwrap();
        assert!(check(&mission, &robot("panorama-camera.toml")).is_ok());
        let error = check(&mission, &robot("panorama.toml")).unwrap_err().to_string();
        assert!(error.contains("[camera]"), "{error}");
    }

    #[test]
    fn what_a_robot_lacks_or_a_parameter_cannot_be_is_said() {
        let robot = |name: &str| sketchnav_sim::robots::find(name).unwrap().unwrap();
        let checked = |text: &str, name: &str| {
            check(&Mission::parse(text).unwrap(), &robot(name)).map_err(|error| error.to_string())
        };
        assert_eq!(checked(MISSION, "helicopter"), Ok(()));
        assert!(checked(MISSION, "robotino").unwrap_err().contains("[view]"));
        for (text, words) in [
            (
                format!("{MISSION}[parameters.planner]\nlooks = 0\n"),
                "parameters.planner: looks: expected at least 1",
            ),
            (
                format!("{MISSION}[parameters.planner]\nlook = 1\n"),
                "parameters.planner: unknown field `look`",
            ),
            (
                format!("{MISSION}[parameters.sketcher]\ntrials = 0\n"),
                "parameters.sketcher.trials: expected 1 to",
            ),
            (
                MISSION.replace("world_heading_deg=0", "world_heading_deg=90"),
                "start.world_heading_deg: expected 0, or navigator.heading_noise_deg",
            ),
            (
                MISSION.replace("kind='directions'", "kind='directions'\nwords=['*', 'New']"),
                "navigator.words: expected * and one of Obvious, Isol, IsolPair, PlusPair",
            ),
            (
                MISSION.replace("kind='directions'", "kind='directions'\nwords=['Isol']"),
                "navigator.words: expected * and one of",
            ),
        ] {
            let error = checked(&text, "helicopter").unwrap_err();
            assert!(error.contains(words), "{error}");
        }
    }
}

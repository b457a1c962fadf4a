//! The keys of a mission of this kind.
//!
//! ```toml
//! [navigator]
//! kind = "directions"
//! method = "arrival"               # or branching, whose maps branch; shortest, simplest, fewest-views, quickest, reliable, d-r: Park and Kender 1995
//! plane_file = "plane.png"         # the plane as the global camera sees it
//! calibration = [[101.5, 702.0, 0.0, 0.0], …]  # four known points or more: column, row; x, y in metres
//! map_noise_m = 0.001              # error of the map-maker's positions; else by the calibration
//! verify = "recoverable"           # or nothing, detectable; `arrival` chooses by itself
//! words = ["Isol", "IsolPair", "*"] # what the navigator understands; else every word
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
//! Either may say by how much the robot may look aside of the map's axes at the start; the maps then say bearings, and these
//! correct its heading: `heading_noise_deg = 2.0`.
//!
//! Somebody may write the custom map: `map_file = "mine.directions"` in place of `plane_file`, `calibration` and `goal`. Its
//! task may list `landmarks = [[x, y], …]`, one for each entry: those that the map means, for the judge.

use serde::{Deserialize, Serialize};
use sketchnav_dots::camera::Known;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::mission::{Mission, MissionError, Task, keys};
use sketchnav_schemas::robot::{Drive, Laser, Robot};

use super::error::DirectionsError;
use crate::arrival::{Effort, Pilot, WORDS};
use crate::description::{Descriptor, Vocabulary};
use crate::error::Error;
use crate::geometry::{Land, Point, Window};
use crate::messages::MAX_PLANNED;
use crate::navigator::Settings;
use crate::path::Objective;
use crate::pillars::Finder;
use crate::plan::Verify;
use crate::transitions::Kinds;
use crate::traversal::Noise;
use crate::walls::Body;

/// The word of `[navigator] kind`.
pub const KIND: &str = "directions";
/// The words of `[navigator] method`, the default first.
pub const METHODS: [&str; 8] =
    ["arrival", "branching", "shortest", "simplest", "fewest-views", "quickest", "reliable", "d-r"];

/// What a path is chosen by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
pub enum Method {
    /// The probability of arrival, by simulation: this project's own.
    #[default]
    #[serde(rename = "arrival")]
    Arrival,
    /// The same, among maps that branch, too.
    #[serde(rename = "branching")]
    Branching,
    /// The distance.
    #[serde(rename = "shortest")]
    Shortest,
    /// The number of entries of the map.
    #[serde(rename = "simplest")]
    Simplest,
    /// The number of views by which the navigator decides.
    #[serde(rename = "fewest-views")]
    FewestViews,
    /// The time of the journey.
    #[serde(rename = "quickest")]
    Quickest,
    /// The product of reliabilities.
    #[serde(rename = "reliable")]
    Reliable,
    /// The distance over the reliability.
    #[serde(rename = "d-r")]
    Ratio,
}

impl Method {
    /// Whether a plan is chosen by simulated journeys.
    fn is_simulated(self) -> bool {
        matches!(self, Self::Arrival | Self::Branching)
    }

    /// What the search minimises, for a navigator with these settings; `None` for simulation.
    pub fn objective(self, settings: &Settings) -> Option<Objective> {
        match self {
            Self::Arrival | Self::Branching => None,
            Self::Shortest => Some(Objective::SHORTEST),
            Self::Simplest => Some(Objective::FEWEST_ENTRIES),
            Self::FewestViews => Some(Objective::FEWEST_VIEWS),
            Self::Quickest => Some(Objective::quickest(settings)),
            Self::Reliable => Some(Objective::MOST_RELIABLE),
            Self::Ratio => Some(Objective::Ratio),
        }
    }
}

/// Where the custom maps come from.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// The map-maker makes them from a picture.
    Picture {
        /// The picture.
        file: String,
        /// Its known points.
        calibration: Vec<Known>,
        /// The error of the map-maker's positions on each axis, where it is given, metres.
        noise_m: Option<f64>,
    },
    /// The map-maker makes them from a floor plan.
    Floor {
        /// The floor plan.
        file: String,
        /// The error of the map-maker's positions on each axis, metres.
        noise_m: Option<f64>,
    },
    /// Somebody has written one.
    Map {
        /// Its file.
        file: String,
    },
}

impl Source {
    /// Its file.
    pub fn file(&self) -> &str {
        match self {
            Self::Picture { file, .. } | Self::Floor { file, .. } | Self::Map { file } => file,
        }
    }
}

/// What a robot on land knows about its landmarks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LandKeys {
    /// Their radius, metres.
    pub radius_m: f64,
    /// How far it looks, metres; none as far as its laser.
    pub range_m: Option<f64>,
}

/// What belongs to this kind of a mission.
#[derive(Debug, Clone, PartialEq)]
pub struct DirectionsMission {
    /// What a path is chosen by.
    pub method: Method,
    /// Where the custom maps come from.
    pub source: Source,
    /// The landmarks of a robot on land; none above a plane.
    pub land: Option<LandKeys>,
    /// Standard deviation of the heading at the start, degrees. Above 0, the maps say bearings, and these correct it.
    pub heading_noise_deg: f64,
    /// Which errors the paper's maps let the navigator notice.
    pub verify: Verify,
    /// What the navigator understands.
    pub words: Vec<Descriptor>,
    /// Where each task leads; empty with a custom map that was written by hand.
    pub goals: Vec<Point>,
    /// The landmarks that such a map means; empty where nobody says.
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
    verify: Option<VerifyWord>,
    words: Option<Vec<String>>,
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
    /// [`MissionError`] with the key and what was expected.
    pub fn of(mission: &Mission) -> Result<Self, MissionError> {
        let keys: NavigatorKeys = keys("navigator", &mission.navigator.given)?;
        if keys.verify.is_some() && keys.method.is_simulated() {
            let expected = "no such key for `arrival` and `branching`, which verify where that pays";
            return Err(wrong("navigator.verify", expected, "it"));
        }
        let verify = match keys.verify {
            Some(VerifyWord::Nothing) => Verify::Nothing,
            Some(VerifyWord::Recoverable) | None => Verify::Recoverable,
            Some(VerifyWord::Detectable) => Verify::Detectable,
        };
        let (method, words) = (keys.method, words(keys.words.as_deref())?);
        let (land, heading_noise_deg) = (land(&keys)?, heading_noise_deg(&keys)?);
        if keys.method == Method::Branching && (land.is_some() || heading_noise_deg > 0.0) {
            let expected = "another method on land or with heading_noise_deg, because maps that branch have no walls and no bearings";
            return Err(wrong("navigator.method", expected, "branching"));
        }
        let source = source(keys)?;
        let is_written = matches!(source, Source::Map { .. });
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
        Ok(Self { method, source, land, heading_noise_deg, verify, words, goals, landmarks })
    }

    /// The words with which the map-maker plans: the method's own, or else any whose landmark is known beforehand, as far as
    /// the navigator understands them.
    pub fn planned(&self) -> Vec<Descriptor> {
        let usual: &[Descriptor] = if self.method.is_simulated() { &WORDS } else { Kinds::PAPER.words };
        let understood = |words: &[Descriptor]| -> Vec<Descriptor> {
            words.iter().copied().filter(|word| self.words.contains(word)).collect()
        };
        let words = understood(usual);
        if words.is_empty() { understood(&Descriptor::DEFINITE) } else { words }
    }
}

fn wrong(key: &str, expected: &'static str, found: &str) -> MissionError {
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

/// The keys of a robot on land.
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

fn heading_noise_deg(keys: &NavigatorKeys) -> Result<f64, MissionError> {
    let heading_noise_deg = keys.heading_noise_deg.unwrap_or(0.0);
    if !(0.0..=MOST_ASIDE_DEG).contains(&heading_noise_deg) {
        return Err(wrong("navigator.heading_noise_deg", "0 to 20 degrees", &heading_noise_deg.to_string()));
    }
    Ok(heading_noise_deg)
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

/// What may be set of the navigator: a mission's table `parameters.planner`. See [`Settings`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlannerParameters {
    /// How many views it takes where it stands before it decides.
    pub looks: u8,
    /// How often it looks again for a landmark that it cannot locate.
    pub patience: u8,
    /// How often it recovers within one entry.
    pub most_recoveries: u8,
    /// How long it works on an entry before it gives up, seconds.
    pub longest_entry_s: f64,
    /// How fast it removes an error of position, a second.
    pub gain: f64,
    /// The weight of a new position of a dot while the window moves, from 0 to 1.
    pub weight: f64,
}

/// What may be set of the map-maker: a mission's table `parameters.sketcher`. See [`Effort`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SketcherParameters {
    /// Simulations of each transition.
    pub trials: u32,
    /// Simulated journeys of each candidate.
    pub trial_journeys: u32,
    /// Simulated journeys for the stated probability.
    pub journeys: u32,
}

/// Most simulations of each kind.
const MOST_SIMULATIONS: u32 = 100_000;

/// How much the map-maker simulates.
///
/// # Errors
/// [`MissionError`] with the key.
pub fn effort(mission: &Mission) -> Result<Effort, MissionError> {
    let Effort { trials, trial_journeys, journeys } = Effort::USUAL;
    let usual = SketcherParameters { trials, trial_journeys, journeys };
    let SketcherParameters { trials, trial_journeys, journeys } =
        mission.parameters.over(Process::Sketcher, &usual)?;
    for (key, count) in [("trials", trials), ("trial_journeys", trial_journeys), ("journeys", journeys)] {
        if !(1..=MOST_SIMULATIONS).contains(&count) {
            return Err(wrong(&format!("parameters.sketcher.{key}"), "1 to 100000", &count.to_string()));
        }
    }
    Ok(Effort { trials, trial_journeys, journeys })
}

/// How far beside a landmark's and its own body the robot keeps, metres.
const BERTH_M: f64 = 0.15;
/// How much further than that it stands beside a landmark, metres.
const BESIDE_M: f64 = 0.25;

/// The distance at which position errors are stated, as a share of the robot's range: that of a usual landmark.
const USUAL_SHARE: f64 = 0.62;

/// What the robot of a mission sees: its window, and the standard deviation of a position in it, metres.
///
/// # Errors
/// A robot without a view, on land without a laser all around; [`DirectionsError::Settings`].
pub fn sight(mission: &Mission, robot: &Robot) -> Result<(Window, f64), DirectionsError> {
    let Some(land) = DirectionsMission::of(mission)?.land else {
        let view = robot.view()?;
        let window = Window::new(view.side_m, view.margin_m).map_err(DirectionsError::Settings)?;
        return Ok((window, view.noise_m));
    };
    let laser = robot.laser()?;
    let unfit =
        |what, expected, found| Err(DirectionsError::Settings(Error::Parameter { what, expected, found }));
    if laser.field_of_view_deg < 359.0 {
        return unfit("laser.field_of_view_deg", "359 and more on land", laser.field_of_view_deg);
    }
    if robot.drive != Drive::Omnidirectional {
        return unfit("drive", "omnidirectional on land", 0.0);
    }
    let clearance = land.radius_m + robot.radius_m + BERTH_M;
    let range = land.range_m.map_or(laser.range_max_m, |range_m| range_m.min(laser.range_max_m));
    let body = Land { radius: land.radius_m, range, stand_off: clearance + BESIDE_M, clearance };
    let window = Window::on_land(body).map_err(DirectionsError::Settings)?;
    Ok((window, position_noise_m(laser, land.radius_m, USUAL_SHARE * range)))
}

/// The standard deviation of a landmark's position at a distance, on each axis. Its returns are averaged along the
/// beams, and its edges lie between two of them.
fn position_noise_m(laser: &Laser, radius_m: f64, distance_m: f64) -> f64 {
    let beam_rad = laser.field_of_view_deg.to_radians() / f64::from(laser.beams.max(1));
    let returns = (2.0 * radius_m / distance_m / beam_rad).max(1.0);
    let along_m = (laser.noise_m + laser.noise_per_m * distance_m) / returns.sqrt();
    along_m.hypot(distance_m * beam_rad / 12.0_f64.sqrt())
}

/// Finds landmarks in the laser scans of a robot on land; none above a plane.
///
/// # Errors
/// As [`sight`].
pub fn finder(mission: &Mission, robot: &Robot) -> Result<Option<Finder>, DirectionsError> {
    let (window, _) = sight(mission, robot)?;
    let Some(land) = window.land else { return Ok(None) };
    let laser = robot.laser()?;
    let noise_m = laser.noise_m + laser.noise_per_m * land.range;
    Ok(Some(Finder { radius_m: land.radius, range_m: land.range, noise_m, mount: laser.mount() }))
}

/// What the walls of a floor mean to a robot on land.
///
/// # Errors
/// As [`sight`].
pub fn body(mission: &Mission, robot: &Robot) -> Result<Body, DirectionsError> {
    let merges = finder(mission, robot)?.map_or(0.0, |finder| finder.jump_m());
    Ok(Body { radius: robot.radius_m, keeps: robot.radius_m + BERTH_M, merges })
}

/// How the navigator of a mission sees and moves.
///
/// # Errors
/// As [`sight`], and [`DirectionsError::Settings`].
pub fn settings(mission: &Mission, robot: &Robot) -> Result<Settings, DirectionsError> {
    let (window, noise_m) = sight(mission, robot)?;
    let usual = Settings::new(window, noise_m);
    let defaults = PlannerParameters {
        looks: usual.looks,
        patience: usual.patience,
        most_recoveries: usual.most_recoveries,
        longest_entry_s: usual.longest_entry_s,
        gain: usual.gain,
        weight: usual.weight,
    };
    let PlannerParameters { looks, patience, most_recoveries, longest_entry_s, gain, weight } =
        mission.parameters.over(Process::Planner, &defaults)?;
    let DirectionsMission { words, heading_noise_deg, .. } = DirectionsMission::of(mission)?;
    let settings = Settings {
        vocabulary: Vocabulary::of(&words),
        heading_rad: heading_noise_deg.to_radians(),
        // A step is a tick: it never moves further in one than it may see.
        speed: usual.speed.min(robot.limits.speed_mps),
        looks,
        patience,
        most_recoveries,
        longest_entry_s,
        gain,
        weight,
        ..usual
    };
    settings.check().map_err(DirectionsError::Settings)
}

/// What the map-maker reckons with: the navigator, and the errors of both.
///
/// # Errors
/// As [`settings`].
pub fn pilot(mission: &Mission, robot: &Robot, map_noise_m: f64) -> Result<Pilot, DirectionsError> {
    let (_, sigma) = sight(mission, robot)?;
    let settings = settings(mission, robot)?;
    let read = DirectionsMission::of(mission)?;
    let heading_rad = read.heading_noise_deg.to_radians();
    let errors = Noise { sigma, map_sigma: map_noise_m, heading_rad, ..Noise::NONE };
    if read.land.is_some() {
        return Ok(Pilot { settings, noise: errors });
    }
    let (view, motion) = (robot.view()?, robot.motion_noise.unwrap_or_default());
    let noise = Noise {
        misses: view.miss,
        false_dots: view.false_dots,
        translation: motion.translation_m,
        rotation_rad: motion.rotation_rad,
        ..errors
    };
    Ok(Pilot { settings, noise })
}

/// How far aside of the axes of a floor or a plane a robot may look at its start, degrees.
const MOST_ASIDE_DEG: f64 = 20.0;

/// What this kind demands of a mission and a robot.
///
/// # Errors
/// [`DirectionsError`] with the key or the sensor.
pub fn check(mission: &Mission, robot: &Robot) -> Result<(), DirectionsError> {
    let read = DirectionsMission::of(mission)?;
    effort(mission)?;
    settings(mission, robot)?;
    // Above a plane nothing corrects a heading of which nobody has said that it may be wrong.
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

    const MISSION: &str = "name='m'\nrobot='helicopter'\nworld={plane='p.toml'}\nstart={world=[0,0],world_heading_deg=0}\n\
        [navigator]\nkind='directions'\nplane_file='p.png'\ncalibration=[[0,0,0,0]]\n[[task]]\nname='on'\ngoal=[0.5, 0.9]\n";

    fn read(text: &str) -> Result<DirectionsMission, MissionError> {
        DirectionsMission::of(&Mission::parse(text).unwrap())
    }

    #[test]
    fn maps_that_branch_are_for_planes_and_for_a_heading_that_is_right() {
        let branching = MISSION.replace("kind='directions'", "kind='directions'\nmethod='branching'");
        assert_eq!(read(&branching).unwrap().method, Method::Branching);
        for key in ["heading_noise_deg=2.0", "landmark_radius_m=0.15"] {
            let wrong = branching
                .replace("plane_file='p.png'", "floor_file='f.toml'")
                .replace("calibration=[[0,0,0,0]]", key);
            let wrong = if key.starts_with('h') {
                wrong.replace("floor_file='f.toml'", "map_file='m'")
            } else {
                wrong
            };
            let error = read(&wrong).unwrap_err().to_string();
            assert!(error.contains("navigator.method") && error.contains("found branching"), "{error}");
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
            assert_eq!(objective.is_none(), METHODS[..2].contains(&method));
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
                "navigator.calibration: expected four known points",
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
            (navigator("words=['Isol','Lonely']"), "navigator.words: expected some of Obvious, Isol"),
            (navigator("verify='nothing'"), "navigator.verify: expected no such key for `arrival`"),
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

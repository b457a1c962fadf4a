//! Mission keys of the navigator `landmarks`.
//!
//! ```toml
//! [navigator]
//! kind = "landmarks"
//! method = "belief"              # or chronis-2007
//! drawing = "sketch.json"        # strokes: see `file`
//! canvas_m = 20.32               # what the longer side of the canvas stands for, in metres
//! # route = [[12, 80], [90, 75]]  # the route, as columns and rows, if it is not in the drawing
//! # route_file = "route.txt"     # for chronis-2007, in place of a drawing: see `language`
//! # [navigator.markers]          # for a robot with a camera: which markers are on which labelled object
//! # desk = [7, 8]
//! ```
//!
//! A mission has one task, which is the route. In `[parameters.sketcher]`, it sets the parameters of
//! [`extraction`](crate::extraction::Parameters); in `[parameters.localizer]`, those of [`Locating`] and, in a table `perception`,
//! of [`Perceiving`]. `[parameters.planner]` has the tables `states` ([`Following`]) and `belief` ([`Guiding`]).

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::mission::{Mission, MissionError, keys};

use crate::belief::Believing;
use crate::error::Error;
use crate::extraction;
use crate::follower::Following;
use crate::guide::Guiding;
use crate::locator::Locating;
use crate::memory::Remembering;
use crate::numbers;
use crate::perception::Perceiving;
use crate::sketch::Reading;
use crate::sure::Assuring;

/// Value of `[navigator] kind`.
pub const KIND: &str = "landmarks";
/// Values of `[navigator] method`. The first one is the default.
pub const METHODS: [&str; 2] = ["belief", "chronis-2007"];

/// Methods of driving along a route.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// This project's own method: drives by the robot's estimated pose in the sketch.
    #[default]
    Belief,
    /// Chronis 2007: matches landmark states.
    #[serde(rename = "chronis-2007")]
    Chronis2007,
}

/// How a mission describes the route.
#[derive(Debug, Clone, PartialEq)]
pub enum Given {
    /// Name of a sketch file, and how to read it.
    Drawing(String, Reading),
    /// Name of a file with a route in words.
    Words(String),
}

impl Given {
    /// Returns the name of the file.
    pub fn file(&self) -> &str {
        match self {
            Self::Drawing(file, _) | Self::Words(file) => file,
        }
    }
}

/// The mission keys that are specific to this navigator.
#[derive(Debug, Clone, PartialEq)]
pub struct LandmarksMission {
    /// Method of driving.
    pub method: Method,
    /// Description of the route.
    pub given: Given,
    /// The route on the canvas, as columns and rows, if it is not in the drawing.
    pub route: Option<Vec<[f64; 2]>>,
    /// Numbers of the markers on each object, by the object's label in the sketch or its name in the words.
    pub markers: BTreeMap<String, Vec<u32>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct NavigatorKeys {
    #[serde(default)]
    method: Method,
    drawing: Option<String>,
    canvas_m: Option<f64>,
    route_step_m: Option<f64>,
    route: Option<Vec<[f64; 2]>>,
    route_file: Option<String>,
    #[serde(default)]
    markers: BTreeMap<String, Numbers>,
}

/// One marker, or a list of markers.
#[derive(Debug, Deserialize)]
#[serde(untagged, expecting = "expected the number of a marker, or a list of numbers")]
enum Numbers {
    One(u32),
    Several(Vec<u32>),
}

impl Numbers {
    fn list(self) -> Vec<u32> {
        match self {
            Self::One(number) => vec![number],
            Self::Several(numbers) => numbers,
        }
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct TaskKeys {}

impl LandmarksMission {
    /// Reads and checks the mission keys of this navigator.
    ///
    /// # Errors
    /// [`MissionError`], which names the key and what was expected.
    pub fn of(mission: &Mission) -> Result<Self, MissionError> {
        let NavigatorKeys { method, drawing, canvas_m, route_step_m, route, route_file, markers } =
            keys("navigator", &mission.navigator.given)?;
        let wrong = |key: &str, expected, found: String| {
            Err(MissionError::Value { key: format!("navigator.{key}"), expected, found })
        };
        if let Some(found) = route.as_ref().map(Vec::len).filter(|found| *found < 2) {
            return wrong("route", "2 points or more", found.to_string());
        }
        let markers: BTreeMap<_, _> =
            markers.into_iter().map(|(label, numbers)| (label, numbers.list())).collect();
        let mut owners = BTreeMap::new();
        for (label, numbers) in &markers {
            for number in numbers {
                if let Some(other) = owners.insert(number, label) {
                    let found = format!("marker {number} also on {other:?}");
                    return wrong(&format!("markers.{label}"), "markers of this object only", found);
                }
            }
        }
        if mission.task.len() != 1 {
            let (expected, found) = ("one task, which is the route", mission.task.len().to_string());
            return Err(MissionError::Value { key: "task".into(), expected, found });
        }
        let task = &mission.task[0];
        let _: TaskKeys = keys(&format!("task 1 ({})", task.name), &task.given)?;
        let given = match (drawing, route_file) {
            (Some(file), None) => {
                let usual = Reading::default();
                let canvas_m = canvas_m.unwrap_or(usual.canvas_m);
                if !(0.1..=1e4).contains(&canvas_m) {
                    return wrong("canvas_m", "0.1 to 10000", canvas_m.to_string());
                }
                let step_m = route_step_m.unwrap_or(usual.step_m);
                if !(0.05..=5.0).contains(&step_m) {
                    return wrong("route_step_m", "0.05 to 5", step_m.to_string());
                }
                Given::Drawing(file, Reading { canvas_m, step_m })
            }
            (None, Some(file)) if method == Method::Belief => {
                // Words tell in which direction objects are, but not by how much the robot turns, so they give no positions.
                let expected = "navigator.drawing in its place, because method \"belief\" needs positions, \
                                and words only give directions from the robot; with words, set method = \"chronis-2007\"";
                return wrong("route_file", expected, format!("{file:?}"));
            }
            (None, Some(_)) if canvas_m.or(route_step_m).is_some() || route.is_some() => {
                let key = match (canvas_m, route_step_m) {
                    (Some(_), _) => "canvas_m",
                    (None, Some(_)) => "route_step_m",
                    (None, None) => "route",
                };
                return wrong(key, "this key only with a drawing", "it together with route_file".into());
            }
            (None, Some(file)) => Given::Words(file),
            (None, None) => return wrong("drawing", "drawing or route_file", "neither".into()),
            (Some(_), Some(_)) => return wrong("drawing", "drawing or route_file", "both".into()),
        };
        Ok(Self { method, given, route, markers })
    }
}

/// Parameters of the localizer, as set in `[parameters.localizer]`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LocalizerParameters {
    /// Parameters of the belief.
    pub belief: Believing,
    /// Parameters of the memory.
    pub memory: Remembering,
    /// Parameters that determine where the robot is sure.
    pub sure: Assuring,
    /// Parameters for recognizing objects in range readings.
    pub perception: Perceiving,
}

impl LocalizerParameters {
    /// Returns the parameters for locating the robot.
    pub const fn locating(&self) -> Locating {
        Locating { belief: self.belief, memory: self.memory, sure: self.sure }
    }

    /// Checks that all numbers are within their ranges.
    ///
    /// # Errors
    /// [`Error::Number`], which names the first number that is out of range.
    pub fn check(&self) -> Result<(), Error> {
        self.locating().check()?;
        numbers::within("perception", self.perception.check())
    }
}

/// Parameters of the planner, as set in `[parameters.planner]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlannerParameters {
    /// Parameters for following states (`chronis-2007`).
    pub states: Following,
    /// Parameters for driving by the estimated pose (`belief`).
    pub belief: Guiding,
    /// Time without progress after which the robot counts as blocked, in seconds.
    pub blocked_s: f64,
}

impl Default for PlannerParameters {
    fn default() -> Self {
        Self { states: Following::default(), belief: Guiding::default(), blocked_s: 20.0 }
    }
}

impl PlannerParameters {
    /// Checks that all numbers are within their ranges.
    ///
    /// # Errors
    /// [`Error::Number`], which names the first number that is out of range.
    pub fn check(&self) -> Result<(), Error> {
        let Self { states, belief, blocked_s } = self;
        numbers::within("states", states.check())?;
        numbers::within("belief", belief.check())?;
        numbers::from_0_on(&[("blocked_s", *blocked_s)])
    }
}

/// All parameters of a mission.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// Parameters of the sketcher.
    pub extraction: extraction::Parameters,
    /// Parameters of the localizer.
    pub localizer: LocalizerParameters,
    /// Parameters of the planner.
    pub planner: PlannerParameters,
}

impl Parameters {
    /// Reads and checks the parameters of a mission.
    ///
    /// # Errors
    /// [`MissionError`] with the key of an invalid parameter.
    pub fn of(mission: &Mission) -> Result<Self, MissionError> {
        let extraction: extraction::Parameters =
            mission.parameters.over(Process::Sketcher, &Default::default())?;
        let localizer: LocalizerParameters =
            mission.parameters.over(Process::Localizer, &Default::default())?;
        let planner: PlannerParameters = mission.parameters.over(Process::Planner, &Default::default())?;
        for (process, checked) in [
            (Process::Sketcher, extraction.check()),
            (Process::Localizer, localizer.check()),
            (Process::Planner, planner.check()),
        ] {
            checked.map_err(|error| wrong(process, error.to_string()))?;
        }
        Ok(Self { extraction, localizer, planner })
    }
}

fn wrong(process: Process, reason: String) -> MissionError {
    MissionError::Key { key: format!("parameters.{process}"), reason }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MISSION: &str = "name='m'\nrobot='nomad200'\nworld={floor_plan='f.toml'}\nstart={world=[0,0],world_heading_deg=0}\n\
        [navigator]\nkind='landmarks'\ndrawing='s.json'\n[[task]]\nname='to the desk'\n";

    fn read(text: &str) -> Result<LandmarksMission, MissionError> {
        LandmarksMission::of(&Mission::parse(text).unwrap())
    }

    #[test]
    fn a_mission_has_a_sketch_or_words() {
        let mission = read(MISSION).unwrap();
        assert_eq!(
            (mission.method, mission.given),
            (Method::Belief, Given::Drawing("s.json".into(), Reading::default()))
        );
        let words = MISSION.replace("drawing='s.json'", "method='chronis-2007'\nroute_file='r.txt'");
        assert_eq!(read(&words).unwrap().given, Given::Words("r.txt".into()));
        for (i, method) in METHODS.into_iter().enumerate() {
            let found = read(&MISSION.replace("drawing", &format!("method='{method}'\ndrawing"))).unwrap();
            assert_eq!(found.method, [Method::Belief, Method::Chronis2007][i]);
        }
    }

    #[test]
    fn errors_name_the_key() {
        for (change, words) in [
            (("drawing='s.json'", ""), "navigator.drawing: expected drawing or route_file, found neither"),
            (
                ("drawing=", "route_file='r.txt'\ndrawing="),
                "navigator.drawing: expected drawing or route_file, found both",
            ),
            (
                ("drawing='s.json'", "route_file='r.txt'"),
                "navigator.route_file: expected navigator.drawing in its place, because method \"belief\" needs positions",
            ),
            (("drawing=", "canvas_m=0.0\ndrawing="), "navigator.canvas_m: expected 0.1 to 10000, found 0"),
            (
                ("drawing=", "route_step_m=9.0\ndrawing="),
                "navigator.route_step_m: expected 0.05 to 5, found 9",
            ),
            (
                ("drawing='s.json'", "method='chronis-2007'\nroute_file='r.txt'\nroute_step_m=0.5"),
                "navigator.route_step_m: expected this key only with a drawing",
            ),
            (("drawing=", "route=[[1,2]]\ndrawing="), "navigator.route: expected 2 points or more, found 1"),
            (
                ("drawing='s.json'", "method='chronis-2007'\nroute_file='r.txt'\nroute=[[1,2],[3,4]]"),
                "navigator.route: expected this key only with a drawing",
            ),
            (("drawing=", "method='best'\ndrawing="), "navigator.method: unknown variant `best`"),
            (("drawing=", "metres=1\ndrawing="), "navigator: unknown field `metres`"),
            (
                ("drawing=", "markers={desk=3,box=[2,3]}\ndrawing="),
                "navigator.markers.desk: expected markers of this object only, found marker 3 also on \"box\"",
            ),
            (
                ("drawing=", "markers={desk='a'}\ndrawing="),
                "navigator.markers.desk: expected the number of a marker, or a list of numbers",
            ),
            (("[[task]]\n", "[[task]]\ngoal=[1,2]\n"), "task 1 (to the desk): unknown field `goal`"),
            (
                ("[[task]]\n", "[[task]]\nname='a'\n[[task]]\n"),
                "task: expected one task, which is the route, found 2",
            ),
        ] {
            let error = read(&MISSION.replace(change.0, change.1)).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    #[test]
    fn parameters_are_checked_by_process_and_key() {
        let with = |text: &str| Parameters::of(&Mission::parse(&format!("{MISSION}{text}")).unwrap());
        let set = with("[parameters.localizer.belief]\nhypotheses=50\n[parameters.planner]\nblocked_s=5.0\n")
            .unwrap();
        assert_eq!((set.localizer.belief.hypotheses, set.planner.blocked_s), (50, 5.0));
        assert_eq!(set.localizer.belief.cone, Believing::default().cone);
        for (text, words) in [
            ("[parameters.localizer]\nbeams=3\n", "parameters.localizer: unknown field `beams`"),
            (
                "[parameters.localizer.belief]\nhypotheses=0\n",
                "belief.hypotheses: expected 1 to 20000, found 0",
            ),
            (
                "[parameters.localizer.belief]\nhypotheses=100000\n",
                "belief.hypotheses: expected 1 to 20000, found 100000",
            ),
            (
                "[parameters.planner.states.control]\nspeed_mps=-1.0\n",
                "states.control.speed_mps: expected a number above 0",
            ),
            (
                "[parameters.planner.belief]\nahead_m=0.0\n",
                "parameters.planner: belief.ahead_m: expected a number above 0",
            ),
            (
                "[parameters.sketcher]\nturn_unit_m=0.0\n",
                "parameters.sketcher: turn_unit_m: expected a number above 0",
            ),
            (
                "[parameters.planner.belief.control]\nstop_m=-1.0\n",
                "belief.control.stop_m: expected a number from 0 to 1000000",
            ),
            (
                "[parameters.localizer.perception]\njoining=0\n",
                "perception.joining: expected a number above 0",
            ),
        ] {
            let error = with(text).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    /// A mission used to be able to set the sizes of the robot and of its sensors, which were then silently overwritten.
    #[test]
    fn what_is_the_robot_s_is_no_key_of_a_mission() {
        for (table, key) in [
            ("localizer.perception", "robot_m"),
            ("localizer.perception", "ring_m"),
            ("localizer.perception", "range_max_m"),
            ("sketcher", "robot_m"),
        ] {
            let text = format!("{MISSION}[parameters.{table}]\n{key}=0.3\n");
            let error = Parameters::of(&Mission::parse(&text).unwrap()).unwrap_err().to_string();
            assert!(error.contains(&format!("unknown field `{key}`")), "{error}");
        }
    }
}

//! Mission keys of the navigator `corridor`.
//!
//! ```toml
//! [navigator]
//! kind = "corridor"
//! method = "corridor"            # or qtc-b, argd, combined: Patil 2019; or qtc-b-steady
//! rules_file = "mine.rules.toml" # in place of the method's own rules; not for `corridor`
//!
//! [[task]]
//! name = "to the lift"
//! metres = 12.0                  # along the corridor; or marker = 7: until it is passed; or until = "end"
//! turns = ["left"]               # which way at each junction; only for `corridor`
//! about = true                   # first turns around on the spot: from A to B, and back from B to A
//! ```

use serde::Deserialize;
use sketchnav_schemas::mission::{Mission, MissionError, Task, keys};

/// Value of `[navigator] kind`.
pub const KIND: &str = "corridor";
/// Values of `[navigator] method`, the default first.
pub const METHODS: [&str; 5] = ["corridor", "qtc-b", "argd", "combined", "qtc-b-steady"];
/// Longest distance that a task may ask for, in metres.
const MOST_METRES: f64 = 10_000.0;

/// Methods of driving along a corridor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// This project's own method: finds a way ahead through free space, by laser and remembered markers.
    #[default]
    Corridor,
    /// Patil 2019: applies rules to the qualitative trajectories of a pair of markers.
    QtcB,
    /// Patil 2019: applies rules to the distance classes of a pair of markers.
    Argd,
    /// The rules of `argd` and `qtc-b` combined, which Patil 2019 (5.4.3) leaves to future work.
    Combined,
    /// This project's own variant of `qtc-b`, with the same rules but trends over many sightings, so that the
    /// error of a single sighting is not decisive.
    QtcBSteady,
}

impl Method {
    /// Returns the name of the method, as listed in [`METHODS`].
    pub fn word(self) -> &'static str {
        METHODS[self as usize]
    }
}

/// Which way to go at a junction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Turn {
    /// Left.
    Left,
    /// Right.
    Right,
    /// Straight on.
    Straight,
}

/// Condition that ends a task.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    /// Drive this far along the corridor, in metres.
    Metres(f64),
    /// Pass the marker with this number.
    Marker(u32),
    /// The corridor has come to an end.
    End,
}

/// A task of a corridor mission.
#[derive(Debug, Clone, PartialEq)]
pub struct CorridorTask {
    /// Display name of the task.
    pub name: String,
    /// Condition that ends the task.
    pub goal: Goal,
    /// Which way to turn at each junction, in order.
    pub turns: Vec<Turn>,
    /// Whether the robot first turns around on the spot.
    pub about: bool,
}

/// The mission keys that are specific to this navigator.
#[derive(Debug, Clone, PartialEq)]
pub struct CorridorMission {
    /// Method of driving.
    pub method: Method,
    /// Rule file to use instead of the method's own rules.
    pub rules_file: Option<String>,
    /// Tasks, in order.
    pub tasks: Vec<CorridorTask>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct NavigatorKeys {
    #[serde(default)]
    method: Method,
    rules_file: Option<String>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct TaskKeys {
    metres: Option<f64>,
    marker: Option<u32>,
    until: Option<Until>,
    #[serde(default)]
    turns: Vec<Turn>,
    #[serde(default)]
    about: bool,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Until {
    End,
}

impl CorridorMission {
    /// Returns true if the robot must see markers, because its method drives by them or a task ends at one.
    pub fn needs_markers(&self) -> bool {
        self.method != Method::Corridor || self.tasks.iter().any(|task| matches!(task.goal, Goal::Marker(_)))
    }

    /// Reads and checks the mission keys of this navigator.
    ///
    /// # Errors
    /// [`MissionError`], which names the key and what was expected.
    pub fn of(mission: &Mission) -> Result<Self, MissionError> {
        let NavigatorKeys { method, rules_file } = keys("navigator", &mission.navigator.given)?;
        let wrong = |key: String, expected, found: String| MissionError::Value { key, expected, found };
        if let Some(file) = rules_file.as_ref().filter(|_| method == Method::Corridor) {
            let expected = "a method that drives by rules, as qtc-b, argd and combined do";
            return Err(wrong(
                "navigator.rules_file".into(),
                expected,
                format!("{file:?} together with corridor"),
            ));
        }
        let tasks = mission.task.iter().enumerate().map(|(i, task)| CorridorTask::of(i + 1, task, method));
        Ok(Self { method, rules_file, tasks: tasks.collect::<Result<_, _>>()? })
    }
}

impl CorridorTask {
    fn of(number: usize, task: &Task, method: Method) -> Result<Self, MissionError> {
        let key = format!("task {number} ({})", task.name);
        let TaskKeys { metres, marker, until, turns, about } = keys(&key, &task.given)?;
        let wrong = |expected, found: String| MissionError::Value { key: key.clone(), expected, found };
        let goal = match (metres, marker, until) {
            (Some(metres), None, None) if metres > 0.0 && metres <= MOST_METRES => Goal::Metres(metres),
            (Some(metres), None, None) => {
                return Err(wrong("metres above 0, at most 10000", metres.to_string()));
            }
            (None, Some(marker), None) => Goal::Marker(marker),
            (None, None, Some(Until::End)) => Goal::End,
            _ => return Err(wrong("one of metres, marker and until", "none or several".into())),
        };
        if method != Method::Corridor && (goal == Goal::End || !turns.is_empty()) {
            let expected =
                "metres or marker and no turns: methods with rules detect neither ends nor junctions";
            return Err(wrong(expected, "until or turns".into()));
        }
        Ok(Self { name: task.name.clone(), goal, turns, about })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MISSION: &str = "name='m'\nrobot='youbot'\nworld={floor_plan='f.toml'}\nstart={world=[0,0],world_heading_deg=0}\n\
        [navigator]\nkind='corridor'\n[[task]]\nname='on'\nmetres=7.0\n";

    fn read(text: &str) -> Result<CorridorMission, MissionError> {
        CorridorMission::of(&Mission::parse(text).unwrap())
    }

    #[test]
    fn a_mission_states_the_distance_and_the_turns() {
        let mission = read(&format!("{MISSION}turns=['left','straight']\n")).unwrap();
        assert_eq!((mission.method, mission.tasks[0].goal), (Method::Corridor, Goal::Metres(7.0)));
        assert_eq!(mission.tasks[0].turns, [Turn::Left, Turn::Straight]);
        for (i, method) in METHODS.into_iter().enumerate() {
            let found =
                read(&MISSION.replace("kind='corridor'", &format!("kind='corridor'\nmethod='{method}'")));
            let all = [Method::Corridor, Method::QtcB, Method::Argd, Method::Combined, Method::QtcBSteady];
            let expected = all[i];
            assert_eq!(found.unwrap().method, expected);
        }
    }

    #[test]
    fn errors_name_the_key() {
        let by_rules = MISSION.replace("kind='corridor'", "kind='corridor'\nmethod='argd'");
        for (text, words) in [
            (MISSION.replace("metres=7.0", ""), "task 1 (on): expected one of metres, marker and until"),
            (
                MISSION.replace("metres=7.0", "metres=-1"),
                "task 1 (on): expected metres above 0, at most 10000, found -1",
            ),
            (MISSION.replace("metres=7.0", "meters=7.0"), "task 1 (on): unknown field `meters`"),
            (MISSION.replace("metres=7.0", "until='lunch'"), "task 1 (on).until: unknown variant `lunch`"),
            (
                by_rules.replace("metres=7.0", "until='end'"),
                "task 1 (on): expected metres or marker and no turns",
            ),
            (
                MISSION.replace("kind='corridor'", "kind='corridor'\nmethod='map'"),
                "navigator.method: unknown variant `map`",
            ),
            (
                MISSION.replace("kind='corridor'", "kind='corridor'\nrules_file='r.toml'"),
                "navigator.rules_file: expected a method that drives by rules",
            ),
        ] {
            let error = read(&text).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}

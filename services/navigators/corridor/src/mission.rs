//! The keys of a mission of this kind.
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
//! turns = ["left"]               # which way at each junction; for `corridor` alone
//! about = true                   # first turns about on the spot: from A to B, and back from B to A
//! ```

use serde::Deserialize;
use sketchnav_schemas::mission::{Mission, MissionError, Task, keys};

/// The word of `[navigator] kind`.
pub const KIND: &str = "corridor";
/// The words of `[navigator] method`, the default first.
pub const METHODS: [&str; 5] = ["corridor", "qtc-b", "argd", "combined", "qtc-b-steady"];
/// The longest way of a task, metres.
const MOST_METRES: f64 = 10_000.0;

/// How a corridor is driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// This project's own: the way on through free space, by laser and remembered markers.
    #[default]
    Corridor,
    /// Patil 2019: rules by the qualitative trajectories of a pair of markers.
    QtcB,
    /// Patil 2019: rules by the distance classes of a pair of markers.
    Argd,
    /// Both.
    Combined,
    /// This project's own: the rules of `qtc-b` with trends over many sights, so that the errors of single sights do not decide.
    QtcBSteady,
}

impl Method {
    /// Its word of [`METHODS`].
    pub fn word(self) -> &'static str {
        METHODS[self as usize]
    }
}

/// Which way to turn at a junction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Turn {
    /// To the left.
    Left,
    /// To the right.
    Right,
    /// On.
    Straight,
}

/// Where a task ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    /// After so many metres along the corridor.
    Metres(f64),
    /// Beside the marker of this number.
    Marker(u32),
    /// Where the corridor ends.
    End,
}

/// A task.
#[derive(Debug, Clone, PartialEq)]
pub struct CorridorTask {
    /// Name, for people.
    pub name: String,
    /// Where it ends.
    pub goal: Goal,
    /// Which way to turn at each junction.
    pub turns: Vec<Turn>,
    /// Whether the robot first turns about on the spot.
    pub about: bool,
}

/// What belongs to this kind of a mission.
#[derive(Debug, Clone, PartialEq)]
pub struct CorridorMission {
    /// How it is driven.
    pub method: Method,
    /// A rule file in place of the method's own.
    pub rules_file: Option<String>,
    /// Its tasks.
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
    /// Reads and checks the keys of this kind.
    ///
    /// # Errors
    /// [`MissionError`] with the key and what was expected.
    pub fn of(mission: &Mission) -> Result<Self, MissionError> {
        let NavigatorKeys { method, rules_file } = keys("navigator", &mission.navigator.given)?;
        let wrong = |key: String, expected, found: String| MissionError::Value { key, expected, found };
        if let Some(file) = rules_file.as_ref().filter(|_| method == Method::Corridor) {
            let expected = "a method that drives by rules, as qtc-b, argd and combined do";
            return Err(wrong("navigator.rules_file".into(), expected, format!("{file:?} beside corridor")));
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
                "metres or marker and no turns: methods with rules know neither ends nor junctions";
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
    fn a_mission_says_how_far_and_where_to_turn() {
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

//! Missions: which world, which robot, which drawing, where to go.

use std::str::FromStr;

use serde::de::{DeserializeOwned, Error as _};
use serde::{Deserialize, Serialize};

use crate::floor_plan::{Furniture, Person};
use crate::message::{MAX_ROUTE_POINTS, MAX_TASKS};
use crate::method::Method;

/// A mission file. Parsed from TOML by [`Mission::parse`]; paths are relative to the file's folder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mission {
    /// Name, for people and for the recording's file name.
    pub name: String,
    /// What it shows.
    #[serde(default)]
    pub description: String,
    /// `robotino`, `turtlebot3`, or the path of a robot file.
    pub robot: String,
    /// How the robot finds its way.
    #[serde(default)]
    pub method: Method,
    /// Where it truly happens.
    pub world: WorldSource,
    /// Where the robot starts.
    pub start: Start,
    /// What the person drew.
    pub sketch: SketchSource,
    /// Where to go, in order.
    pub task: Vec<Task>,
    /// Parameters of the services, by service; what is left out keeps its default.
    #[serde(default)]
    pub parameters: Parameters,
}

/// The true world: `floor_plan` or `map`, and what else stands and walks there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorldSource {
    /// A floor plan of the project's own form (TOML).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub floor_plan: Option<String>,
    /// A map of ROS's map_server (YAML beside a PGM or PNG).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub map: Option<String>,
    /// Furniture beside what the floor plan has.
    #[serde(default)]
    pub furniture: Vec<Furniture>,
    /// People beside those of the floor plan.
    #[serde(default)]
    pub person: Vec<Person>,
}

/// Where the robot starts, in the world and in the drawing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    /// True position, metres.
    pub world: [f64; 2],
    /// True heading, degrees counter-clockwise from the world's x axis.
    pub world_heading_deg: f64,
    /// Position in the drawing, image pixels (column, row; row 0 at the top). May be left out where
    /// the first task is a drawn route or the drawing itself holds the start.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sketch: Option<[f64; 2]>,
    /// Heading in the drawing, degrees counter-clockwise from "to the right" as one looks at it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sketch_heading_deg: Option<f64>,
}

/// The drawing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SketchSource {
    /// PNG, JPEG, SVG or strokes in JSON.
    pub file: String,
    /// Whether the walls are dark lines, light lines, or to be found out.
    #[serde(default)]
    pub walls: WallTone,
}

/// Which tone of a picture is a wall.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WallTone {
    /// To be found out.
    #[default]
    Auto,
    /// Dark on light.
    Dark,
    /// Light on dark.
    Light,
}

/// A task: a goal, or a drawn route.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Task {
    /// Name, for people: `0 → 1`.
    pub name: String,
    /// The goal, image pixels (column, row).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub goal: Option<[f64; 2]>,
    /// Or a route to follow, image pixels, two points or more.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub route: Option<Vec<[f64; 2]>>,
    /// Which place of the true world counts as there. Who drives by a drawing alone may leave it out: then the
    /// robot's own word counts.
    #[serde(default, skip_serializing_if = "Place::is_unknown")]
    pub there: Place,
    /// Simulation time, seconds.
    #[serde(default = "time_limit_s")]
    pub time_limit_s: f64,
}

fn time_limit_s() -> f64 {
    180.0
}

/// A place of the true world: `polygon`, or `center` with `radius_m`; nothing of all where it is unknown.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Place {
    /// Corners of a simple polygon, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub polygon: Option<Vec<[f64; 2]>>,
    /// Middle of a disc, or the point from which the final error of a polygon is measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub center: Option<[f64; 2]>,
    /// Radius of the disc.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius_m: Option<f64>,
}

/// Parameters by service, each a table that the service itself checks.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Of the sketcher.
    #[serde(default)]
    pub sketcher: toml::Table,
    /// Of the localizer.
    #[serde(default)]
    pub localizer: toml::Table,
    /// Of the planner.
    #[serde(default)]
    pub planner: toml::Table,
}

impl Parameters {
    /// Takes over every key of `other`.
    pub fn extend(&mut self, other: &Self) {
        let Self { sketcher, localizer, planner } = other;
        self.sketcher.extend(sketcher.clone());
        self.localizer.extend(localizer.clone());
        self.planner.extend(planner.clone());
    }
}

/// One line of TOML, `localizer.beams = 48`: what `--set` takes.
impl FromStr for Parameters {
    type Err = toml::de::Error;

    fn from_str(line: &str) -> Result<Self, Self::Err> {
        toml::from_str(line)
    }
}

/// `base` with the values that `table` has in their place: what [`Parameters`] are for.
///
/// # Errors
/// A key that `base` does not have, or a value of the wrong type.
pub fn overlaid<T: Serialize + DeserializeOwned>(
    base: &T,
    table: &toml::Table,
) -> Result<T, toml::de::Error> {
    let mut whole = toml::Table::try_from(base).map_err(toml::de::Error::custom)?;
    whole.extend(table.clone());
    whole.try_into()
}

/// What is wrong with a mission.
#[derive(Debug, thiserror::Error)]
pub enum MissionError {
    /// No TOML, a key that is not known, a value of the wrong type.
    #[error("{0}")]
    Toml(#[from] toml::de::Error),
    /// A value that cannot be.
    #[error("{key}: expected {expected}, found {found}")]
    Value {
        /// The key.
        key: String,
        /// What would be right.
        expected: &'static str,
        /// What stands there.
        found: String,
    },
}

impl Mission {
    /// Reads a mission file and checks all that can be checked without opening another file.
    ///
    /// # Errors
    /// [`MissionError`] with the key and what was expected.
    pub fn parse(text: &str) -> Result<Self, MissionError> {
        let mission: Self = toml::from_str(text)?;
        check_finite("", &toml::Value::Table(toml::from_str(text)?))?;
        mission.check()?;
        Ok(mission)
    }

    /// The kind of navigator that drives it.
    pub fn navigator_kind(&self) -> &str {
        "sketch"
    }

    fn check(&self) -> Result<(), MissionError> {
        let sources = usize::from(self.world.floor_plan.is_some()) + usize::from(self.world.map.is_some());
        check(sources == 1, || "world".into(), "one of floor_plan and map", || sources.to_string())?;
        let tasks = self.task.len();
        check((1..=MAX_TASKS).contains(&tasks), || "task".into(), "1 to 64 tasks", || tasks.to_string())?;
        let points: usize = self.task.iter().map(Task::point_count).sum();
        let expected = "at most 8192 points of all goals and routes";
        check(points <= MAX_ROUTE_POINTS, || "task".into(), expected, || points.to_string())?;
        let start = &self.start;
        check_heading("start.world_heading_deg", start.world_heading_deg)?;
        check_heading("start.sketch_heading_deg", start.sketch_heading_deg.unwrap_or_default())?;
        check_name("name", &self.name)?;
        self.task.iter().enumerate().try_for_each(|(i, task)| task.check(i + 1))
    }
}

impl Task {
    fn point_count(&self) -> usize {
        self.route.as_ref().map_or(1, Vec::len)
    }

    fn check(&self, number: usize) -> Result<(), MissionError> {
        let key = |part: &str| format!("task {number} ({}){part}", self.name);
        let kinds = usize::from(self.goal.is_some()) + usize::from(self.route.is_some());
        check(kinds == 1, || key(""), "one of goal and route", || kinds.to_string())?;
        if let Some(route) = &self.route {
            check(route.len() >= 2, || key(".route"), "2 points or more", || route.len().to_string())?;
        }
        check_name(&key(".name"), &self.name)?;
        let limit = self.time_limit_s;
        check(limit > 0.0, || key(".time_limit_s"), "a number above 0", || limit.to_string())?;
        self.there.check(&key(".there"))
    }
}

impl Place {
    fn check(&self, key: &str) -> Result<(), MissionError> {
        let holds = match (&self.polygon, self.center, self.radius_m) {
            (Some(polygon), _, None) => polygon.len() >= 3,
            (None, Some(_), Some(radius)) => radius > 0.0,
            _ => false,
        };
        let expected = "a polygon of 3 corners or more, or center and radius_m";
        check(holds || self.is_unknown(), || key.to_owned(), expected, || self.words())
    }

    /// What it has, in a few words.
    fn words(&self) -> String {
        let parts = [
            self.polygon.as_ref().map(|polygon| format!("a polygon of {} corners", polygon.len())),
            self.center.map(|[x, y]| format!("center = [{x}, {y}]")),
            self.radius_m.map(|radius_m| format!("radius_m = {radius_m}")),
        ];
        parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
    }

    /// Whether nothing says where it is.
    pub fn is_unknown(&self) -> bool {
        self.polygon.is_none() && self.center.is_none() && self.radius_m.is_none()
    }

    /// Whether (x, y), metres, lies in the place (even-odd rule).
    pub fn contains(&self, x: f64, y: f64) -> bool {
        match (&self.polygon, self.center, self.radius_m) {
            (Some(polygon), ..) => inside(polygon, x, y),
            (None, Some(center), Some(radius)) => (x - center[0]).hypot(y - center[1]) <= radius,
            _ => false,
        }
    }

    /// The point from which the final error is measured: the given centre, or the corners' mean.
    pub fn middle(&self) -> [f64; 2] {
        let mean = |polygon: &Vec<[f64; 2]>| {
            let n = polygon.len() as f64;
            [polygon.iter().map(|p| p[0]).sum::<f64>() / n, polygon.iter().map(|p| p[1]).sum::<f64>() / n]
        };
        self.center.or_else(|| self.polygon.as_ref().map(mean)).unwrap_or_default()
    }
}

fn inside(polygon: &[[f64; 2]], x: f64, y: f64) -> bool {
    let edges = polygon.iter().zip(polygon.iter().cycle().skip(1));
    let crossed = edges
        .filter(|(a, b)| (a[1] > y) != (b[1] > y) && x < (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]) + a[0]);
    crossed.count() % 2 == 1
}

/// TOML knows `nan` and `inf`; no key of a mission does.
fn check_finite(key: &str, value: &toml::Value) -> Result<(), MissionError> {
    match value {
        toml::Value::Float(number) => {
            check(number.is_finite(), || key.to_owned(), "a finite number", || number.to_string())
        }
        toml::Value::Array(items) => {
            items.iter().enumerate().try_for_each(|(i, item)| match item {
                // Tables are things that people count.
                toml::Value::Table(_) => check_finite(&format!("{key} {}", i + 1), item),
                _ => check_finite(&format!("{key}[{i}]"), item),
            })
        }
        toml::Value::Table(table) => table.iter().try_for_each(|(name, item)| {
            check_finite(&if key.is_empty() { name.clone() } else { format!("{key}.{name}") }, item)
        }),
        _ => Ok(()),
    }
}

fn check_heading(key: &str, degrees: f64) -> Result<(), MissionError> {
    check(degrees.abs() <= 360.0, || key.to_owned(), "degrees from -360 to 360", || degrees.to_string())
}

/// Names are printed on terminals, which obey control characters.
fn check_name(key: &str, name: &str) -> Result<(), MissionError> {
    let holds = !name.is_empty() && !name.contains(char::is_control);
    check(holds, || key.to_owned(), "a name without control characters", || format!("{name:?}"))
}

fn check(
    holds: bool,
    key: impl FnOnce() -> String,
    expected: &'static str,
    found: impl FnOnce() -> String,
) -> Result<(), MissionError> {
    if holds { Ok(()) } else { Err(MissionError::Value { key: key(), expected, found: found() }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MISSION: &str = r#"
        name = "m"
        robot = "robotino"
        world = { map = "floor.yaml" }
        start = { world = [1.0, 1.0], world_heading_deg = 90, sketch = [1, 1], sketch_heading_deg = 90 }
        sketch = { file = "s.png" }
        [[task]]
        name = "kitchen"
        goal = [3, 4]
        there = { center = [1.0, 2.0], radius_m = 1.0 }
    "#;

    fn refusal(from: &str, to: &str) -> String {
        assert!(MISSION.contains(from));
        Mission::parse(&MISSION.replace(from, to)).unwrap_err().to_string()
    }

    #[test]
    fn a_valid_mission_is_read() {
        assert_eq!(Mission::parse(MISSION).unwrap().task[0].time_limit_s, 180.0);
    }

    #[test]
    fn the_method_is_ours_where_none_is_named() {
        assert_eq!(Mission::parse(MISSION).unwrap().method, Method::Ours);
        let named = MISSION.replace("robot =", "method = \"one-scale\"\nrobot =");
        assert_eq!(Mission::parse(&named).unwrap().method, Method::OneScale);
        let error = refusal("robot =", "method = \"theirs\"\nrobot =");
        assert!(error.contains("`fixed-scale`") && error.contains("theirs"), "{error}");
    }

    #[test]
    fn a_task_may_leave_open_where_in_the_world_it_ends() {
        let open = MISSION.replace("there = { center = [1.0, 2.0], radius_m = 1.0 }", "");
        let mission = Mission::parse(&open).unwrap();
        assert!(mission.task[0].there.is_unknown());
        assert!(!toml::to_string(&mission).unwrap().contains("there"));
        assert!(refusal("radius_m = 1.0", "").contains("center and radius_m"));
    }

    #[test]
    fn a_table_changes_single_values() {
        #[derive(Debug, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Some {
            length_m: f32,
            count: usize,
        }
        let base = Some { length_m: 0.1, count: 3 };
        let with = |text: &str| overlaid(&base, &toml::from_str(text).unwrap());
        assert_eq!(with("").unwrap(), base);
        assert_eq!(with("count = 5").unwrap(), Some { length_m: 0.1, count: 5 });
        let error = with("lenght_m = 5").unwrap_err().to_string();
        assert!(error.contains("lenght_m") && error.contains("`length_m`"), "{error}");
        assert!(with("count = true").unwrap_err().to_string().contains("boolean"));
    }

    #[test]
    fn a_number_that_is_none_is_named_wherever_it_stands() {
        // One of these once reached the services as `null` in a file of ours.
        for (from, to, key) in [
            ("world_heading_deg = 90", "world_heading_deg = nan", "start.world_heading_deg"),
            ("sketch = [1, 1]", "sketch = [nan, 1]", "start.sketch[0]"),
            ("radius_m = 1.0", "radius_m = inf", "task 1.there.radius_m"),
        ] {
            let error = refusal(from, to);
            assert!(error.contains(key) && error.contains("finite"), "{error}");
        }
    }

    /// It was told as Rust prints it: "Place { polygon: None, center: Some([1.0, 2.0]), …".
    #[test]
    fn a_place_that_is_none_is_told_in_the_words_of_the_file() {
        let error = refusal("center = [1.0, 2.0], radius_m = 1.0", "center = [1.0, 2.5]");
        assert!(error.ends_with("found center = [1, 2.5]"), "{error}");
    }

    #[test]
    fn a_heading_beyond_a_turn_is_refused() {
        // 1e300 degrees once kept the world busy for ever.
        assert!(refusal("world_heading_deg = 90", "world_heading_deg = 1e300").contains("-360 to 360"));
    }

    #[test]
    fn a_name_may_not_steer_the_terminal() {
        assert!(refusal("\"kitchen\"", "\"\\u001b[31m\"").contains("control"));
    }

    proptest::proptest! {
        #![proptest_config(proptest::prelude::ProptestConfig { failure_persistence: None, ..Default::default() })]

        #[test]
        fn no_text_makes_it_panic(text in ".*") {
            let _ = Mission::parse(&text);
        }

        #[test]
        fn no_damage_makes_it_panic(at in 0..MISSION.len(), cut in 0..MISSION.len(), put in ".{0,3}") {
            let parts = MISSION.get(..at).zip(MISSION.get(cut.max(at)..));
            if let Some((head, tail)) = parts {
                let _ = Mission::parse(&format!("{head}{put}{tail}"));
            }
        }
    }
}

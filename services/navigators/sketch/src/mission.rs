//! The keys of a mission of kind `sketch`, which specify the drawing, the robot's start in it, and the tasks.
//!
//! All code reads and writes these keys through [`SketchMission`].

use std::collections::BTreeMap;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use sketchnav_schemas::bounds;
use sketchnav_schemas::mission::{
    Mission, MissionError, NavigatorChoice, Place, Task, check, check_all, check_finite, check_heading, only,
    task_key,
};

use crate::messages::Origin;
use crate::method::Method;
use sketchnav_schemas::message::MAX_ROUTE_POINTS;
use sketchnav_schemas::toml_text::in_words;

/// The name of this kind of navigator, as in `navigator.kind`.
pub const KIND: &str = "sketch";

/// The part of a mission that is specific to the kind `sketch`.
#[derive(Debug, Clone, PartialEq)]
pub struct SketchMission {
    /// Method of localization and planning. If it is `None`, the kind of drawing determines it.
    pub method: Option<Method>,
    /// File name of the drawing, which may be PNG, JPEG, GIF, WebP, BMP, PNM, SVG or strokes in JSON.
    pub drawing: String,
    /// Tone of the walls in the drawing.
    pub walls: WallTone,
    /// Start in the drawing, in image pixels (column, row; row 0 at the top). May be `None` if the first task is a drawn route,
    /// if the drawing itself marks the start, or if the robot is to find out where it is.
    pub start: Option<[f64; 2]>,
    /// Heading at the start, in degrees counter-clockwise from "to the right" in the drawing.
    pub start_heading_deg: Option<f64>,
    /// Named places, in image pixels, in addition to those labelled on the drawing.
    pub places: BTreeMap<String, [f64; 2]>,
    /// File name of a map learned on an earlier drive by the drawing, in which the robot then drives. The start is not used.
    pub learned_file: Option<String>,
    /// The tasks, in order.
    pub tasks: Vec<SketchTask>,
}

/// Tone of the walls in a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WallTone {
    /// Determined from the picture.
    #[default]
    Auto,
    /// Dark walls on a light ground.
    Dark,
    /// Light walls on a dark ground.
    Light,
}

impl WallTone {
    const fn word(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Dark => "dark",
            Self::Light => "light",
        }
    }
}

/// A task in a drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct SketchTask {
    /// Human-readable name.
    pub name: String,
    /// The goal, or the route to follow.
    pub aim: Aim,
    /// Simulation time after which the task has failed, in seconds.
    pub time_limit_s: f64,
}

/// The goal or the route of a task, in image pixels (column, row).
#[derive(Debug, Clone, PartialEq)]
pub enum Aim {
    /// A point to drive to (key `goal`).
    Goal([f64; 2]),
    /// A named place to drive to (key `goal`).
    Place(String),
    /// Two or more points to drive along (key `route`).
    Route(Vec<[f64; 2]>),
}

impl Aim {
    /// Returns the points of the route, or the goal as the only point. A named place has none, because the
    /// name alone does not determine its position.
    pub fn points(&self) -> &[[f64; 2]] {
        match self {
            Self::Goal(at) => std::slice::from_ref(at),
            Self::Place(_) => &[],
            Self::Route(points) => points,
        }
    }

    /// Returns the points of a route, or `None` for a goal.
    pub fn route(&self) -> Option<&[[f64; 2]]> {
        match self {
            Self::Goal(_) | Self::Place(_) => None,
            Self::Route(points) => Some(points),
        }
    }

    /// Returns this aim as a key and value in a task's table.
    pub fn given(&self) -> toml::Table {
        let (key, value) = match self {
            Self::Goal(at) => ("goal", point(*at)),
            Self::Place(name) => ("goal", name.clone().into()),
            Self::Route(points) => ("route", points.iter().copied().map(point).collect::<Vec<_>>().into()),
        };
        [(key.to_owned(), value)].into_iter().collect()
    }

    fn of(key: &str, task: &Task) -> Result<Self, MissionError> {
        check_finite(key, &task.given.clone().into())?;
        let mut keys = Keys::new(key, &task.given, &["name", "goal", "route", "there", "time_limit_s"])?;
        let goal = match task.given.get("goal") {
            Some(toml::Value::String(_)) => keys.take("goal")?.map(Self::Place),
            _ => keys.take("goal")?.map(Self::Goal),
        };
        let route = keys.take::<Vec<[f64; 2]>>("route")?;
        let wrong = |found: &str| MissionError::Value {
            key: key.to_owned(),
            expected: "one of goal and route",
            found: found.to_owned(),
        };
        match (goal, route) {
            (Some(goal), None) => Ok(goal),
            (None, Some(route)) => {
                let length = route.len();
                check(length >= 2, || format!("{key}.route"), "2 points or more", || length.to_string())?;
                Ok(Self::Route(route))
            }
            (None, None) => Err(wrong("none")),
            (Some(_), Some(_)) => Err(wrong("both")),
        }
    }
}

fn point(at: [f64; 2]) -> toml::Value {
    at.to_vec().into()
}

impl SketchMission {
    /// Reads and checks the keys of the kind `sketch`. A mission without tasks is valid, because the tasks
    /// come later if people draw.
    ///
    /// # Errors
    /// [`MissionError`], which names the key and what was expected.
    pub fn of(mission: &Mission) -> Result<Self, MissionError> {
        let NavigatorChoice { kind, given } = &mission.navigator;
        check(kind == KIND, || "navigator.kind".into(), "\"sketch\"", || format!("{kind:?}"))?;
        check_finite("navigator", &given.clone().into())?;
        let known =
            ["kind", "method", "drawing", "walls", "start", "start_heading_deg", "places", "learned_file"];
        let mut keys = Keys::new("navigator", given, &known)?;
        let read = Self {
            method: keys.take("method")?,
            drawing: keys.take("drawing")?.ok_or_else(|| keys.missing("drawing", "the name of a file"))?,
            walls: keys.take("walls")?.unwrap_or_default(),
            start: keys.take("start")?,
            start_heading_deg: keys.take("start_heading_deg")?,
            places: keys.take("places")?.unwrap_or_default(),
            learned_file: keys.take("learned_file")?,
            tasks: mission.task.iter().enumerate().map(SketchTask::of).collect::<Result<_, _>>()?,
        };
        check_heading("navigator.start_heading_deg", read.start_heading_deg.unwrap_or_default())?;
        let points: usize = read.tasks.iter().map(|task| task.aim.points().len()).sum();
        let expected = "at most 8192 points in all goals and routes together";
        check(points <= MAX_ROUTE_POINTS, || "task".into(), expected, || points.to_string())?;
        read.check_places()?;
        if let (Some(method), true) = (read.method, read.is_learned()) {
            let expected = "outline or beam with a learned map";
            check(method.is_ours(), || "navigator.method".into(), expected, || method.word().to_owned())?;
        }
        Ok(read)
    }

    /// Returns true if the robot drives in a map that was learned on an earlier drive by the drawing.
    pub fn is_learned(&self) -> bool {
        self.learned_file.is_some()
    }

    /// Returns where the sketch comes from, as far as the mission tells. Whether a drawing is a surveyed map is only known once it
    /// has been read.
    pub fn expected_origin(&self) -> Origin {
        if self.is_learned() { Origin::Learned } else { Origin::Drawn }
    }

    /// Returns the method by which the robot drives in a sketch of this origin. If the mission names none, this is `beam` in a
    /// surveyed map, whose proportions are exact, and `outline` in a drawing, whose proportions are not. In a learned map, the
    /// methods that a mission may name do the same.
    pub fn method_in(&self, origin: Origin) -> Method {
        match (self.method, origin) {
            (Some(named), _) => named,
            (None, Origin::Surveyed) => Method::Beam,
            (None, Origin::Drawn | Origin::Learned) => Method::default(),
        }
    }

    /// Returns the parameters that are usual in a sketch: those of a learned map, or else those of the method.
    pub fn usual<P>(&self, origin: Origin, of_method: fn(Method) -> P, learned: fn() -> P) -> P {
        match origin {
            Origin::Learned => learned(),
            Origin::Surveyed | Origin::Drawn => of_method(self.method_in(origin)),
        }
    }

    fn check_places(&self) -> Result<(), MissionError> {
        let start = self.start.as_ref().map_or(&[][..], |at| &at[..]);
        check_all(|| "navigator.start".into(), start, bounds::COORDINATE_PX)?;
        for (name, at) in &self.places {
            check_all(|| format!("navigator.places.{name}"), at, bounds::COORDINATE_PX)?;
        }
        for (i, task) in self.tasks.iter().enumerate() {
            let key = match &task.aim {
                Aim::Goal(_) | Aim::Place(_) => "goal",
                Aim::Route(_) => "route",
            };
            let key = || format!("{}.{key}", task_key(i + 1, &task.name));
            check_all(key, task.aim.points().as_flattened(), bounds::COORDINATE_PX)?;
        }
        Ok(())
    }

    /// Returns the table `navigator` for a mission file. The tone of the walls is omitted if it is the default.
    pub fn navigator(&self) -> NavigatorChoice {
        let places: toml::Table = self.places.iter().map(|(name, at)| (name.clone(), point(*at))).collect();
        let entries = [
            ("method", self.method.map(|method| method.word().into())),
            ("drawing", Some(self.drawing.clone().into())),
            ("walls", (self.walls != WallTone::default()).then(|| self.walls.word().into())),
            ("start", self.start.map(point)),
            ("start_heading_deg", self.start_heading_deg.map(Into::into)),
            ("places", (!self.places.is_empty()).then(|| places.into())),
            ("learned_file", self.learned_file.clone().map(Into::into)),
        ];
        let given = entries.into_iter().filter_map(|(key, value)| Some((key.to_owned(), value?)));
        NavigatorChoice { kind: KIND.to_owned(), given: given.collect() }
    }

    /// Turns `mission` into one of this kind with these tasks. The tasks take over the `there` of the
    /// mission's previous tasks, in order. If there are more tasks than before, `there` is unknown for the
    /// additional ones.
    pub fn write_to(&self, mission: &mut Mission) {
        mission.navigator = self.navigator();
        let mut places = std::mem::take(&mut mission.task).into_iter().map(|task| task.there);
        let task = |task: &SketchTask| task.with_place(places.next().unwrap_or_default());
        mission.task = self.tasks.iter().map(task).collect();
    }
}

impl SketchTask {
    fn of((i, task): (usize, &Task)) -> Result<Self, MissionError> {
        let aim = Aim::of(&task_key(i + 1, &task.name), task)?;
        Ok(Self { name: task.name.clone(), aim, time_limit_s: task.time_limit_s })
    }

    /// Returns the task for a mission file, with `there` as its place in the true world.
    pub fn with_place(&self, there: Place) -> Task {
        let Self { name, aim, time_limit_s } = self;
        Task { name: name.clone(), there, time_limit_s: *time_limit_s, given: aim.given() }
    }
}

/// The keys of a table that have not been read yet.
struct Keys<'a> {
    table: &'a str,
    left: toml::Table,
}

impl<'a> Keys<'a> {
    /// Fails if there is a key that is not `known`. This is checked first because an unknown key may be a misspelt required one.
    fn new(table: &'a str, given: &toml::Table, known: &[&str]) -> Result<Self, MissionError> {
        only(table, given, known)?;
        Ok(Self { table, left: given.clone() })
    }

    fn take<T: DeserializeOwned>(&mut self, key: &str) -> Result<Option<T>, MissionError> {
        let read = self.left.remove(key).map(toml::Value::try_into).transpose();
        read.map_err(|error: toml::de::Error| MissionError::Key {
            key: format!("{}.{key}", self.table),
            reason: in_words(error.message()),
        })
    }

    fn missing(&self, key: &str, expected: &'static str) -> MissionError {
        MissionError::Value { key: format!("{}.{key}", self.table), expected, found: "none".into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MISSION: &str = r#"
        name = "m"
        robot = "robotino"
        world = { map = "floor.yaml" }
        start = { world = [1.0, 1.0], world_heading_deg = 90 }
        [navigator]
        kind = "sketch"
        drawing = "s.png"
        start = [1, 1]
        start_heading_deg = 90
        [[task]]
        name = "hall"
        goal = [3, 4]
        there = { center = [1.0, 2.0], radius_m = 1.0 }
        [[task]]
        name = "kitchen"
        route = [[3, 4], [5, 6.5]]
        [[task]]
        name = "coffee"
        goal = "Kitchen"
    "#;

    fn parse(text: &str) -> Result<SketchMission, MissionError> {
        SketchMission::of(&Mission::parse(text)?)
    }

    fn refusal(from: &str, to: &str) -> String {
        assert!(MISSION.contains(from));
        parse(&MISSION.replace(from, to)).unwrap_err().to_string()
    }

    #[test]
    fn a_mission_is_read_and_written() {
        let read = parse(MISSION).unwrap();
        assert_eq!((read.start, read.start_heading_deg), (Some([1.0, 1.0]), Some(90.0)));
        assert_eq!(read.tasks[0].aim, Aim::Goal([3.0, 4.0]));
        assert_eq!(read.tasks[1].aim.route().unwrap(), [[3.0, 4.0], [5.0, 6.5]]);
        assert_eq!(read.tasks[2].aim, Aim::Place("Kitchen".into()));
        let mut mission = Mission::parse(MISSION).unwrap();
        let there = mission.task[0].there.clone();
        let places = [("Kitchen".to_owned(), [7.0, 8.0])].into();
        let learned_file = Some("m.learned".to_owned());
        let changed = SketchMission {
            method: Some(Method::Beam),
            walls: WallTone::Light,
            places,
            learned_file,
            ..read
        };
        changed.write_to(&mut mission);
        let text = toml::to_string(&mission).unwrap();
        assert_eq!(parse(&text).unwrap(), changed, "{text}");
        assert_eq!(Mission::parse(&text).unwrap().task[0].there, there);
    }

    #[test]
    fn without_a_method_the_kind_of_drawing_determines_it() {
        let of = |text: &str, origin| parse(text).unwrap().usual(origin, Some, || None);
        assert_eq!(of(MISSION, Origin::Drawn), Some(Method::Outline));
        assert_eq!(of(MISSION, Origin::Surveyed), Some(Method::Beam));
        assert_eq!(of(MISSION, Origin::Learned), None);
        let mission = |line: &str| MISSION.replace("drawing =", &format!("method = \"{line}\"\ndrawing ="));
        for method in [Method::Behzadian2015, Method::Outline] {
            assert_eq!(of(&mission(method.word()), Origin::Surveyed), Some(method));
        }
        for word in ["ours", "theirs"] {
            let error = parse(&mission(word)).unwrap_err().to_string();
            assert!(
                error.starts_with("navigator.method: expected one of outline, beam, boniardi-2015, "),
                "{error}"
            );
            assert!(error.contains(word), "{error}");
        }
    }

    #[test]
    fn errors_name_the_key() {
        for (from, to, key, words) in [
            ("kind = \"sketch\"", "kind = \"walls\"", "navigator.kind", "\"sketch\""),
            ("drawing = \"s.png\"", "", "navigator.drawing", "a file"),
            // A misspelt required key was once reported as missing.
            ("drawing =", "drawng =", "navigator.drawng", "unknown key; did you mean `drawing`?"),
            ("goal = [3, 4]", "gaol = [3, 4]", "task 1 (hall).gaol", "unknown key; did you mean `goal`?"),
            (
                "drawing =",
                "colour = 1\ndrawing =",
                "navigator.colour",
                "expected one of kind, method, drawing, walls",
            ),
            ("drawing =", "wals = \"dark\"\ndrawing =", "navigator.wals", "walls"),
            ("drawing =", "walls = \"grey\"\ndrawing =", "navigator.walls", "`dark`"),
            ("start = [1, 1]", "start = [1]", "navigator.start", "2"),
            (
                "start_heading_deg = 90",
                "start_heading_deg = 1e300",
                "navigator.start_heading_deg",
                "-360 to 360",
            ),
            ("start = [1, 1]", "start = [1, 1e39]", "navigator.start", "-100000 to 100000 px, found 1e39"),
            ("goal = [3, 4]", "goal = [1e300, 4]", "task 1 (hall).goal", "-100000 to 100000 px"),
            ("[5, 6.5]", "[5, -1e6]", "task 2 (kitchen).route", "-100000 to 100000 px"),
            ("goal = [3, 4]", "goal = true", "task 1 (hall).goal", "boolean"),
            ("drawing =", "places = { hall = [1] }\ndrawing =", "navigator.places", "2"),
            ("drawing =", "places = { hall = [1, 1e6] }\ndrawing =", "navigator.places.hall", "100000 px"),
            ("goal = [3, 4]", "", "task 1 (hall)", "one of goal and route"),
            ("route =", "goal = [1, 1]\nroute =", "task 2 (kitchen)", "one of goal and route"),
            ("[[3, 4], [5, 6.5]]", "[[3, 4]]", "task 2 (kitchen).route", "2 points or more"),
            ("[[3, 4], [5, 6.5]]", "\"there\"", "task 2 (kitchen).route", "expected a list"),
        ] {
            let error = refusal(from, to);
            assert!(error.starts_with(&format!("{key}: ")) && error.contains(words), "{key}: {error}");
        }
        let long = format!("{:?}", vec![[1.0, 1.0]; MAX_ROUTE_POINTS]);
        assert!(refusal("[[3, 4], [5, 6.5]]", &long).contains("8192 points"));
    }

    /// Missions that were not read from a file are checked too.
    #[test]
    fn a_number_that_is_none_is_named() {
        let mut mission = Mission::parse(MISSION).unwrap();
        mission.task[1].given = Aim::Route(vec![[1.0, 1.0], [f64::NAN, 1.0]]).given();
        let error = SketchMission::of(&mission).unwrap_err().to_string();
        assert!(error.contains("task 2 (kitchen).route[1][0]") && error.contains("finite"), "{error}");
    }

    #[test]
    fn where_people_draw_the_tasks_come_later() {
        let mut mission = Mission::parse(MISSION).unwrap();
        mission.task.clear();
        assert!(SketchMission::of(&mission).unwrap().tasks.is_empty());
    }
}

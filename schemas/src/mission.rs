//! Mission files, which select a world, a robot, a navigator and tasks.
//!
//! A [`Mission`] contains the keys that are common to all kinds of navigators. Keys that belong to one kind
//! are kept as they are in the file ([`NavigatorChoice::given`], [`Task::given`]), and that kind reads and
//! checks them.

use std::collections::BTreeMap;
use std::str::FromStr;
use std::sync::LazyLock;

use serde::de::{DeserializeOwned, Error as _};
use serde::{Deserialize, Serialize};

use crate::bounds::{self, Bound};
use crate::channels::{NAVIGATORS, words};
use crate::codes::Process;
use crate::floor_plan::{Furniture, Marker, Person};
use crate::geometry::encloses;
use crate::message::MAX_TASKS;
use crate::nearest::{nearest, without_list};
use crate::toml_text::{self, TomlError, in_words};

/// A mission file, parsed from TOML by [`Mission::parse`]. Paths are relative to the folder of the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mission {
    /// Name, for people and for the recording's file name.
    pub name: String,
    /// What the mission shows.
    #[serde(default)]
    pub description: String,
    /// `robotino`, `turtlebot3`, or the path of a robot file.
    pub robot: String,
    /// The navigator to drive with, and what a person provides for it.
    pub navigator: NavigatorChoice,
    /// The true world.
    pub world: WorldSource,
    /// The true pose of the robot at the start.
    pub start: Start,
    /// The tasks, in order.
    #[serde(default)]
    pub task: Vec<Task>,
    /// Parameters of the navigator's processes. Parameters that are left out keep their defaults.
    #[serde(default)]
    pub parameters: Parameters,
}

/// The true world: `floor_plan`, `map` or `plane`, plus the furniture, people and markers in it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorldSource {
    /// A floor plan in the project's own format (TOML).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub floor_plan: Option<String>,
    /// A map in the format of ROS's map_server: a YAML file next to a PGM, PNG or BMP.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub map: Option<String>,
    /// A plane of dots (TOML).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plane: Option<String>,
    /// Furniture in addition to the floor plan's.
    #[serde(default)]
    pub furniture: Vec<Furniture>,
    /// People in addition to the floor plan's.
    #[serde(default)]
    pub person: Vec<Person>,
    /// Markers in addition to the floor plan's.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub marker: Vec<Marker>,
    /// Times at which somebody lifts the robot and sets it down elsewhere.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub carry: Vec<Carry>,
}

/// Somebody lifts the robot and sets it down elsewhere, which its odometry does not notice.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Carry {
    /// Time, in seconds of simulation time.
    pub at_s: f64,
    /// Position afterwards, in metres.
    pub to: [f64; 2],
    /// Heading afterwards, in degrees counter-clockwise from the world's x axis.
    pub heading_deg: f64,
}

/// The choice of a navigator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NavigatorChoice {
    /// Name of the kind, such as `sketch`.
    pub kind: String,
    /// The other keys of the table, which belong to the kind.
    #[serde(flatten)]
    pub given: toml::Table,
}

/// The true pose of the robot at the start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    /// Position, in metres.
    pub world: [f64; 2],
    /// Heading, in degrees counter-clockwise from the world's x axis.
    pub world_heading_deg: f64,
}

/// A task of a mission.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Task {
    /// Name, shown to people: `0 → 1`.
    pub name: String,
    /// The region of the true world that counts as the goal. When driving by a drawing only, it may be left
    /// out, in which case the robot's own report counts.
    #[serde(default, skip_serializing_if = "Place::is_unknown")]
    pub there: Place,
    /// Time limit, in seconds of simulation time.
    #[serde(default = "time_limit_s")]
    pub time_limit_s: f64,
    /// The other keys of the table, which belong to the kind of navigator.
    #[serde(flatten)]
    pub given: toml::Table,
}

fn time_limit_s() -> f64 {
    180.0
}

/// A region of the true world, given by `polygon`, or by `center` and `radius_m`, or by none of these if it
/// is unknown.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Place {
    /// Corners of a simple polygon, in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub polygon: Option<Vec<[f64; 2]>>,
    /// Centre of a disc, or for a polygon the reference point of the final error. In metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub center: Option<[f64; 2]>,
    /// Radius of the disc, in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius_m: Option<f64>,
}

/// Parameters by process. Each process has a table, which is checked by its stage.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(try_from = "BTreeMap<String, toml::Table>")]
pub struct Parameters(BTreeMap<String, toml::Table>);

impl Parameters {
    /// Returns the table of a process, which is empty if the mission has none.
    pub fn of(&self, process: Process) -> &toml::Table {
        static EMPTY: LazyLock<toml::Table> = LazyLock::new(toml::Table::new);
        self.0.get(process.word()).unwrap_or(&EMPTY)
    }

    /// Returns the parameters of a process, which are `usual` with the values set by the mission.
    ///
    /// # Errors
    /// [`MissionError::Key`] if the mission sets a key that `usual` does not have, or a value of the wrong type.
    pub fn over<T: Serialize + DeserializeOwned>(
        &self,
        process: Process,
        usual: &T,
    ) -> Result<T, MissionError> {
        let key = format!("parameters.{}", process.word());
        overlaid(usual, self.of(process)).map_err(|error| MissionError::of_key(&key, &error))
    }

    /// Returns the table of a process for modification. Adds an empty one if the mission has none.
    pub fn of_mut(&mut self, process: Process) -> &mut toml::Table {
        self.0.entry(process.word().to_owned()).or_default()
    }

    /// Collects the values of all parameters, including defaults, of the stages of some processes.
    ///
    /// # Errors
    /// An error if TOML cannot express a value.
    pub fn in_force(
        tables: impl IntoIterator<Item = (Process, Result<toml::Table, toml::ser::Error>)>,
    ) -> Result<Self, toml::ser::Error> {
        tables
            .into_iter()
            .map(|(process, table)| Ok((process.word().to_owned(), table?)))
            .collect::<Result<_, _>>()
            .map(Self)
    }

    /// Returns every parameter and its value, with names such as `localizer.belief.hypotheses`, sorted by
    /// name within a process.
    pub fn all(&self) -> Vec<(String, &toml::Value)> {
        let mut all = Vec::new();
        for (process, table) in &self.0 {
            flatten(process, table, &mut all);
        }
        all
    }

    /// Adds all keys of `other`, replacing existing ones.
    pub fn extend(&mut self, other: &Self) {
        for (process, table) in &other.0 {
            lay_over(self.0.entry(process.clone()).or_default(), table);
        }
    }
}

fn flatten<'a>(prefix: &str, table: &'a toml::Table, all: &mut Vec<(String, &'a toml::Value)>) {
    for (key, value) in table {
        let name = format!("{prefix}.{key}");
        match value {
            toml::Value::Table(inner) => flatten(&name, inner, all),
            value => all.push((name, value)),
        }
    }
}

/// Adds every value of `other` to `table`, including those in nested tables.
fn lay_over(table: &mut toml::Table, other: &toml::Table) {
    for (key, value) in other {
        match (table.get_mut(key), value) {
            (Some(toml::Value::Table(inner)), toml::Value::Table(other)) => lay_over(inner, other),
            _ => {
                table.insert(key.clone(), value.clone());
            }
        }
    }
}

impl TryFrom<BTreeMap<String, toml::Table>> for Parameters {
    type Error = String;

    fn try_from(tables: BTreeMap<String, toml::Table>) -> Result<Self, String> {
        let is_known = |word: &str| NAVIGATORS.iter().any(|process| process.word() == word);
        match tables.keys().find(|word| !is_known(word)) {
            Some(found) => Err(format!("parameters: expected one of {}, found `{found}`", words(NAVIGATORS))),
            None => Ok(Self(tables)),
        }
    }
}

/// Parses one line of TOML as given to `--set`, such as `localizer.beams = 48`.
impl FromStr for Parameters {
    type Err = toml::de::Error;

    fn from_str(line: &str) -> Result<Self, Self::Err> {
        toml::from_str(line)
    }
}

/// Returns `base` with values replaced by those of `table`.
fn overlaid<T: Serialize + DeserializeOwned>(base: &T, table: &toml::Table) -> Result<T, toml::de::Error> {
    let mut whole = toml::Table::try_from(base).map_err(toml::de::Error::custom)?;
    lay_over(&mut whole, table);
    whole.try_into()
}

/// Parses a table that belongs to a kind of navigator. `key` is the table's name, as used in errors.
///
/// # Errors
/// [`MissionError::Key`] if the table has a key that `T` does not have, lacks one that `T` needs, or has a value of the wrong
/// type.
pub fn keys<T: DeserializeOwned>(key: &str, given: &toml::Table) -> Result<T, MissionError> {
    given.clone().try_into().map_err(|error| MissionError::of_key(key, &error))
}

/// Keys of a kind that has none: see [`Mission::navigator_keys`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoKeys {}

/// Checks that a table of a kind of navigator has no keys but these. `key` is the table's name, as used in
/// errors.
///
/// # Errors
/// [`MissionError::Key`] for the first unknown key. The error suggests the key that was probably meant, or
/// lists all of them.
pub fn only(key: &str, given: &toml::Table, known: &[&str]) -> Result<(), MissionError> {
    let Some(other) = given.keys().find(|other| !known.contains(&other.as_str())) else { return Ok(()) };
    let reason = match nearest(other, known.iter().copied()) {
        Some(meant) => format!("unknown key; did you mean `{meant}`?"),
        None => format!("unknown key, expected one of {}", known.join(", ")),
    };
    Err(MissionError::Key { key: format!("{key}.{other}"), reason })
}

/// The reason why a mission is invalid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MissionError {
    /// The text is not TOML, or has an unknown key or a value of the wrong type.
    #[error("{0}")]
    Toml(#[from] TomlError),
    /// An invalid value.
    #[error("{key}: expected {expected}, found {found}")]
    Value {
        /// The key.
        key: String,
        /// What was expected.
        expected: &'static str,
        /// What was found.
        found: String,
    },
    /// A key that the kind of navigator does not have, or whose value it cannot read.
    #[error("{key}: {reason}")]
    Key {
        /// The key.
        key: String,
        /// The reason.
        reason: String,
    },
}

impl MissionError {
    /// Returns the error for the table `key`, or for the key inside it that `error` refers to.
    fn of_key(key: &str, error: &toml::de::Error) -> Self {
        // If the table does not come from text, only the last line of the error has the path of its key.
        let shown = error.to_string();
        let within = shown.trim_end().rsplit_once("\nin `").and_then(|(_, path)| path.strip_suffix('`'));
        let key = within.map_or_else(|| key.to_owned(), |path| format!("{key}.{path}"));
        Self::Key { key, reason: in_words(&without_list(error.message())) }
    }
}

impl Mission {
    /// Parses a mission file and checks everything that is common to all kinds of navigators.
    ///
    /// # Errors
    /// [`MissionError`], which names the key and what was expected.
    pub fn parse(text: &str) -> Result<Self, MissionError> {
        let file: toml::Table = toml_text::read(text)?;
        check_misspelt(&file)?;
        let mission: Self = toml_text::read(text)?;
        check_finite("", &toml::Value::Table(file))?;
        mission.check()?;
        Ok(mission)
    }

    /// Returns the kind of navigator to drive with.
    pub fn navigator_kind(&self) -> &str {
        &self.navigator.kind
    }

    /// Parses the keys of `[navigator]` that belong to the kind. If `T` denies unknown fields, so does this.
    ///
    /// # Errors
    /// Same errors as [`keys`].
    pub fn navigator_keys<T: DeserializeOwned>(&self) -> Result<T, MissionError> {
        keys("navigator", &self.navigator.given)
    }

    /// Parses the keys of each `[[task]]` that belong to the kind. If `T` denies unknown fields, so does this.
    ///
    /// # Errors
    /// Any error of [`keys`], with the number and the name of the task.
    pub fn task_keys<T: DeserializeOwned>(&self) -> Result<Vec<T>, MissionError> {
        let numbered = (1..).zip(&self.task);
        numbered.map(|(number, task)| keys(&task_key(number, &task.name), &task.given)).collect()
    }

    /// Returns the files given to the navigator, each with its key. They are the values of the key `drawing` and of
    /// every key that ends in `_file`, both in the table `navigator` and in tasks.
    pub fn navigator_files_mut(&mut self) -> impl Iterator<Item = (String, &mut String)> {
        let numbered = self.task.iter_mut().enumerate();
        let tasks = numbered.map(|(i, task)| (task_key(i + 1, &task.name), &mut task.given));
        let tables = std::iter::once(("navigator".to_owned(), &mut self.navigator.given)).chain(tasks);
        tables.flat_map(|(name, table)| {
            table.iter_mut().filter_map(move |(key, value)| match value {
                toml::Value::String(file) if names_a_file(key) => Some((format!("{name}.{key}"), file)),
                _ => None,
            })
        })
    }

    fn check(&self) -> Result<(), MissionError> {
        self.world.check()?;
        let tasks = self.task.len();
        check((1..=MAX_TASKS).contains(&tasks), || "task".into(), "1 to 64 [[task]]", || tasks.to_string())?;
        check_all(|| "start.world".into(), &self.start.world, bounds::COORDINATE_M)?;
        check_heading("start.world_heading_deg", self.start.world_heading_deg)?;
        check_name("name", &self.name)?;
        self.task.iter().enumerate().try_for_each(|(i, task)| task.check(i + 1))
    }
}

impl WorldSource {
    fn check(&self) -> Result<(), MissionError> {
        let sources = [&self.floor_plan, &self.map, &self.plane].into_iter().flatten().count();
        let expected = "one of floor_plan, map and plane";
        check(sources == 1, || "world".into(), expected, || sources.to_string())?;
        let others = self.furniture.len() + self.person.len() + self.marker.len() + self.carry.len();
        let expected = "no furniture, person, marker or carry with a plane";
        check(self.plane.is_none() || others == 0, || "world".into(), expected, || others.to_string())?;
        (1..).zip(&self.carry).try_for_each(|(number, carry)| carry.check(&carry_key(number)))
    }
}

/// Returns the name of a `[[world.carry]]` in error messages.
pub fn carry_key(number: usize) -> String {
    format!("world.carry {number}")
}

impl Carry {
    fn check(&self, key: &str) -> Result<(), MissionError> {
        check_all(|| format!("{key}.at_s"), &[self.at_s], bounds::CARRY_S)?;
        check_all(|| format!("{key}.to"), &self.to, bounds::COORDINATE_M)?;
        check_heading(&format!("{key}.heading_deg"), self.heading_deg)
    }
}

/// Rejects keys that look like misspelt required ones. Without this check, the required key would be reported
/// as missing, because the tables of navigators and tasks may have any other keys.
fn check_misspelt(file: &toml::Table) -> Result<(), MissionError> {
    let navigator = file.get("navigator").map(|table| ("navigator".to_owned(), "kind", table));
    let tasks = file.get("task").and_then(toml::Value::as_array).into_iter().flatten();
    let tasks = (1..).zip(tasks).map(|(number, table)| (format!("task {number}"), "name", table));
    for (key, required, table) in navigator.into_iter().chain(tasks) {
        let Some(table) = table.as_table().filter(|table| !table.contains_key(required)) else { continue };
        let Some(meant) = nearest(required, table.keys().map(String::as_str)) else { continue };
        let reason = format!("unknown key; did you mean `{required}`?");
        return Err(MissionError::Key { key: format!("{key}.{meant}"), reason });
    }
    Ok(())
}

fn names_a_file(key: &str) -> bool {
    key == "drawing" || key.ends_with("_file")
}

/// Returns the name of a task in error messages.
pub fn task_key(number: usize, name: &str) -> String {
    format!("task {number} ({name})")
}

impl Task {
    fn check(&self, number: usize) -> Result<(), MissionError> {
        let key = |part: &str| format!("{}.{part}", task_key(number, &self.name));
        check_name(&key("name"), &self.name)?;
        check_all(|| key("time_limit_s"), &[self.time_limit_s], bounds::TIME_LIMIT_S)?;
        self.there.check(&key("there"))
    }
}

impl Place {
    fn check(&self, key: &str) -> Result<(), MissionError> {
        let holds = match (&self.polygon, self.center, self.radius_m) {
            (Some(polygon), _, None) => polygon.len() >= 3,
            (None, Some(_), Some(radius)) => radius > 0.0,
            _ => false,
        };
        let expected = "a polygon with at least 3 corners, or center and radius_m";
        check(holds || self.is_unknown(), || key.to_owned(), expected, || self.words())?;
        let corners = self.polygon.as_deref().unwrap_or_default();
        let count = corners.len();
        check(
            count <= bounds::MOST_CORNERS,
            || format!("{key}.polygon"),
            "at most 1000 corners",
            || count.to_string(),
        )?;
        let coordinate = bounds::COORDINATE_M;
        check_all(|| format!("{key}.polygon"), corners.as_flattened(), coordinate)?;
        check_all(
            || format!("{key}.center"),
            self.center.as_ref().map_or(&[][..], |at| &at[..]),
            coordinate,
        )?;
        let radius = self.radius_m.as_slice();
        check_all(|| format!("{key}.radius_m"), radius, bounds::PLACE_RADIUS_M)
    }

    /// Describes the given keys in a few words, for errors.
    fn words(&self) -> String {
        let parts = [
            self.polygon.as_ref().map(|polygon| format!("a polygon of {} corners", polygon.len())),
            self.center.map(|[x, y]| format!("center = [{x}, {y}]")),
            self.radius_m.map(|radius_m| format!("radius_m = {radius_m}")),
        ];
        parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
    }

    /// Returns true if the region is unknown.
    pub fn is_unknown(&self) -> bool {
        self.polygon.is_none() && self.center.is_none() && self.radius_m.is_none()
    }

    /// Returns true if the point (x, y), in metres, is inside the region by the even-odd rule. An unknown region contains
    /// no point.
    pub fn contains(&self, x: f64, y: f64) -> bool {
        match (&self.polygon, self.center, self.radius_m) {
            (Some(polygon), ..) => encloses(polygon, [x, y]),
            (None, Some(center), Some(radius)) => (x - center[0]).hypot(y - center[1]) <= radius,
            _ => false,
        }
    }

    /// Returns the reference point of the final error, which is the given centre or else the mean of the corners.
    pub fn middle(&self) -> [f64; 2] {
        let mean = |polygon: &Vec<[f64; 2]>| {
            let n = polygon.len() as f64;
            [polygon.iter().map(|p| p[0]).sum::<f64>() / n, polygon.iter().map(|p| p[1]).sum::<f64>() / n]
        };
        self.center.or_else(|| self.polygon.as_ref().map(mean)).unwrap_or_default()
    }
}

/// Rejects TOML's `nan` and `inf`, which are not valid for any key of a mission.
///
/// # Errors
/// [`MissionError::Value`], which names the key of the first such number.
pub fn check_finite(key: &str, value: &toml::Value) -> Result<(), MissionError> {
    match value {
        toml::Value::Float(number) => {
            check(number.is_finite(), || key.to_owned(), "a finite number", || bounds::shown(*number))
        }
        toml::Value::Array(items) => {
            items.iter().enumerate().try_for_each(|(i, item)| match item {
                // Tables are items that people count from 1.
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

/// Checks an angle given in a file, in degrees.
///
/// # Errors
/// [`MissionError::Value`] if the angle is out of bounds.
pub fn check_heading(key: &str, degrees: f64) -> Result<(), MissionError> {
    check_all(|| key.to_owned(), &[degrees], bounds::ANGLE_DEG)
}

/// Checks that each of `numbers` is within the bound.
///
/// # Errors
/// [`MissionError::Value`] for the first number that is not.
pub fn check_all(key: impl FnOnce() -> String, numbers: &[f64], bound: Bound) -> Result<(), MissionError> {
    let wrong = numbers.iter().find(|number| !bound.holds(**number));
    wrong.map_or(Ok(()), |number| check(false, key, bound.words, || bounds::shown(*number)))
}

/// Checks a name. Names are printed on terminals, which would obey control characters in them.
fn check_name(key: &str, name: &str) -> Result<(), MissionError> {
    let holds = !name.is_empty() && !name.contains(char::is_control);
    check(holds, || key.to_owned(), "a name without control characters", || format!("{name:?}"))
}

/// Checks a condition on a key.
///
/// # Errors
/// [`MissionError::Value`] if the condition is false.
pub fn check(
    holds: bool,
    key: impl FnOnce() -> String,
    expected: &'static str,
    found: impl FnOnce() -> String,
) -> Result<(), MissionError> {
    if holds { Ok(()) } else { Err(MissionError::Value { key: key(), expected, found: found() }) }
}

#[cfg(test)]
mod tests;

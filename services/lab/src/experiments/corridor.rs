//! The suites of corridors with markers: `corridor` (Patil 2019, 5.4), `corridor-turns` and `corridor-person`.
//!
//! A drive ends at the first contact, which counts as a failure. The lines of the `corridor` suite are the twelve conditions of the
//! thesis: three starts, with markers opposite each other or staggered, and with equal or unequal numbers of them on the two walls.
//! Each condition is driven in both directions, in corridors of several widths. The table also summarizes figures 5.2 to 5.7 of the
//! thesis in words.

use std::path::Path;

use sketchnav_corridor::mission::KIND;
use sketchnav_schemas::floor_plan::Person;
use sketchnav_schemas::geometry::{Base, Pose, World};
use sketchnav_schemas::mission::{Mission, NavigatorChoice, Parameters, Place, Start, Task, WorldSource};
use sketchnav_sim::corridors::{Corridor, Drive, Numbers, Placement, Shape};
use sketchnav_sim::files;

use crate::error::EvalError;
use crate::experiments::suite::{Folders, Published, Remark, Suite};
use crate::experiments::trial::Trial;

const ROBOT: &str = "youbot";
/// Distance, in metres, from the side of the robot to the wall if it starts along a wall.
const BESIDE_M: f64 = 0.2;
/// Distance, in metres, before or beyond the end of the path within which the robot has arrived.
pub(crate) const THERE_M: f64 = 0.75;
/// Minimum average speed of any method, in metres per second, from which time limits follow.
pub(crate) const SLOWEST_MPS: f64 = 0.04;
const REPETITIONS: u32 = 5;

const TITLE: &str = "Corridors of 1.6 to 3.0 m with markers, 7 m there and back, from three starts; reached: at the end without contact.";
const TURNS_TITLE: &str =
    "Corridors with corners, a junction and a dead end; reached: at the end without contact.";
const PERSON_TITLE: &str =
    "Straight corridors in which a person walks back and forth; reached: at the end without contact.";
const NOTICE: &str = "paper: Patil 2019, 5.4: twelve experiments per calculus, in one real corridor. Its width, the spacing of the markers and the number of runs are not given.";

/// Where the robot starts across the corridor, seen in the direction of the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Beside {
    Middle,
    RightWall,
    LeftWall,
}

impl Beside {
    pub(crate) const ALL: [Self; 3] = [Self::Middle, Self::RightWall, Self::LeftWall];

    fn word(self) -> &'static str {
        match self {
            Self::Middle => "middle",
            Self::RightWall => "right wall",
            Self::LeftWall => "left wall",
        }
    }

    /// Returns the start of a drive, shifted towards the wall.
    pub(crate) fn start(self, drive: &Drive, width_m: f64, half_width_m: f64) -> Pose<World> {
        let beside_m = width_m / 2.0 - half_width_m - BESIDE_M;
        let left_m = match self {
            Self::Middle => 0.0,
            Self::RightWall => -beside_m,
            Self::LeftWall => beside_m,
        };
        drive.start.compose(&Pose::<Base>::new(0.0, left_m, 0.0))
    }
}

/// Loads the `corridor` suite.
///
/// # Errors
/// [`EvalError`] if a file is missing.
pub fn suite(folders: &Folders) -> Result<Suite, EvalError> {
    let mut trials = Vec::new();
    for beside in Beside::ALL {
        for corridor in Corridor::shipped().into_iter().filter(|corridor| corridor.shape == Shape::Straight) {
            for drive in corridor.drives() {
                trials.push(trial(folders, &corridor, &drive, beside, line(beside, &corridor))?);
            }
        }
    }
    // Sort the lines in the order of the thesis's figures.
    trials.sort_by_key(|trial| LINES.iter().position(|line| *line == trial.drawing));
    let published = |name: &str, reached| Published { name: name.into(), reached, attempts: 12 };
    Ok(Suite {
        title: TITLE.into(),
        notices: vec![NOTICE.into()],
        trials,
        lines: Some("start, markers, numbers"),
        repetitions: REPETITIONS,
        paper: vec![published("paper QTC_B", 10), published("paper ARGD", 8)],
        remarks: remarks(),
        ..Suite::default()
    })
}

/// Loads the `corridor-turns` suite.
///
/// # Errors
/// Any error of [`suite`].
pub fn turns(folders: &Folders) -> Result<Suite, EvalError> {
    let mut trials = Vec::new();
    for corridor in Corridor::shipped().into_iter().filter(|corridor| corridor.shape != Shape::Straight) {
        for drive in corridor.drives() {
            let line = format!("{}, {}", corridor.name().split(',').next().unwrap_or_default(), drive.name);
            trials.push(trial(folders, &corridor, &drive, Beside::Middle, line)?);
        }
    }
    let (title, lines) = (TURNS_TITLE.into(), Some("corridor, way"));
    Ok(Suite { title, trials, lines, repetitions: REPETITIONS, ..Suite::default() })
}

/// Loads the `corridor-person` suite.
///
/// # Errors
/// Any error of [`suite`].
pub fn person(folders: &Folders) -> Result<Suite, EvalError> {
    let mut trials = Vec::new();
    let is_chosen = |corridor: &Corridor| {
        let Corridor { shape, placement, numbers, .. } = *corridor;
        shape == Shape::Straight && placement == Placement::Opposite && numbers == Numbers::Equal
    };
    for corridor in Corridor::shipped().into_iter().filter(is_chosen) {
        for (drive, side) in
            corridor.drives().iter().flat_map(|drive| [0.0, 0.3, -0.3].map(|side| (drive, side)))
        {
            let line = format!("{:.1} m", corridor.width_m);
            let mut trial = trial(folders, &corridor, drive, Beside::Middle, line)?;
            trial.name = format!("{}/{side:+.1}", trial.name);
            trial.mission.world.person.push(walker(drive, side * corridor.width_m));
            trials.push(trial);
        }
    }
    let (title, lines) = (PERSON_TITLE.into(), Some("width"));
    Ok(Suite { title, trials, lines, repetitions: REPETITIONS, ..Suite::default() })
}

/// Returns a person who walks from beyond the goal to beyond the start, `side_m` off the middle of the corridor.
fn walker(drive: &Drive, side_m: f64) -> Person {
    let (start, goal) = (drive.start, drive.goal);
    let beyond = 1.5 * (goal[0] - start.x).signum();
    let waypoints = vec![[goal[0] + beyond, side_m], [start.x - beyond, side_m]];
    Person { waypoints, speed_mps: 0.5, radius_m: 0.25, pause_s: 2.0 }
}

pub(crate) fn trial(
    folders: &Folders,
    corridor: &Corridor,
    drive: &Drive,
    beside: Beside,
    line: String,
) -> Result<Trial, EvalError> {
    let robot = files::robot(ROBOT)?;
    let [_, half_width_m] = robot.half_extents_m();
    let start = beside.start(drive, corridor.width_m, half_width_m);
    let file = corridor.file_name();
    let path = folders.project.join("sim/missions/corridor").join(&file);
    let plain = file.trim_end_matches(".floor.toml");
    let name = format!("{plain}/{}/{}", beside.word(), drive.name).replace(' ', "-");
    let mission = Mission {
        name: format!("corridor/{name}"),
        description: corridor.name(),
        robot: ROBOT.into(),
        navigator: NavigatorChoice { kind: KIND.into(), given: toml::Table::new() },
        world: WorldSource { floor_plan: Some(absolute(&path)), ..WorldSource::default() },
        start: Start { world: [start.x, start.y], world_heading_deg: start.yaw_rad.to_degrees() },
        task: vec![task(corridor, drive)],
        parameters: Parameters::default(),
    };
    Ok(Trial { ends_with_contact: true, ..Trial::new(name, line, mission, robot) })
}

fn absolute(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

fn task(corridor: &Corridor, drive: &Drive) -> Task {
    let [x, y] = drive.goal;
    let half_m = corridor.width_m / 2.0;
    // The goal reaches across the corridor to both walls and a little way along it. Paths end along x or along y.
    let along_x = drive.turns.is_empty() && drive.start.y == y;
    let [dx, dy] = if along_x { [THERE_M, half_m] } else { [half_m.max(THERE_M); 2] };
    let corners = vec![[x - dx, y - dy], [x + dx, y - dy], [x + dx, y + dy], [x - dx, y + dy]];
    let mut given = toml::Table::new();
    // In corridors with corners, the goal is a marker instead of a length, since a robot that cuts corners drives less than the
    // path along the middle.
    match corridor.shape {
        Shape::Straight => given.insert("metres".into(), drive.distance_m.into()),
        _ => given.insert("marker".into(), i64::from(corridor.marker_beside(drive.goal)).into()),
    };
    if !drive.turns.is_empty() {
        let turns: Vec<_> = drive.turns.iter().map(|turn| toml::Value::from(*turn)).collect();
        given.insert("turns".into(), turns.into());
    }
    Task {
        name: drive.name.into(),
        there: Place { polygon: Some(corners), center: Some(drive.goal), radius_m: None },
        time_limit_s: 60.0 + drive.distance_m / SLOWEST_MPS,
        given,
    }
}

/// Returns the name of a condition in [`LINES`].
pub(crate) fn line(beside: Beside, corridor: &Corridor) -> String {
    let placement = if corridor.placement == Placement::Opposite { "opposite" } else { "staggered" };
    let numbers = if corridor.numbers == Numbers::Equal { "equal" } else { "uneven" };
    format!("{}, {placement}, {numbers}", beside.word())
}

/// The twelve conditions in the order of figures 5.2 to 5.7.
pub(crate) const LINES: [&str; 12] = [
    "middle, opposite, equal",
    "middle, opposite, uneven",
    "middle, staggered, equal",
    "middle, staggered, uneven",
    "right wall, opposite, equal",
    "right wall, opposite, uneven",
    "right wall, staggered, equal",
    "right wall, staggered, uneven",
    "left wall, opposite, equal",
    "left wall, opposite, uneven",
    "left wall, staggered, equal",
    "left wall, staggered, uneven",
];

/// What figures 5.2 to 5.4 show about QTC_B on each line, and whether they show that it passes. Starts along a wall pass "only if
/// the starting position still allowed the camera to detect both the markers". The thesis counts ten conditions that pass (5.4.1).
pub(crate) const QTC_B: [(&str, bool); 12] = [
    ("passes, in the middle", true),
    ("passes; collides too near a wall", true),
    ("almost always fails", false),
    ("passes, in zigzag", true),
    ("passes while both markers are in view", true),
    ("passes while two opposite markers are in view", true),
    ("almost always fails", false),
    ("passes while two markers are in view", true),
    ("passes while both markers are in view", true),
    ("passes while two opposite markers are in view", true),
    ("almost always fails", false),
    ("passes while two markers are in view", true),
];

/// What figures 5.5 to 5.7 show about ARGD on each line. The eight conditions that pass are those that the thesis counts (5.4.2).
/// Along a wall, they pass "if the markers are detected simultaneously".
pub(crate) const ARGD: [(&str, bool); 12] = [
    ("passes, in the middle", true),
    ("almost always fails: same distance class", false),
    ("collides: same class, out of view", false),
    ("passes, in the middle", true),
    ("crosses to the other wall; passes while both are in view", true),
    ("along the wall, or collides", true),
    ("collides: same class, out of view", false),
    ("almost never collides", true),
    ("crosses to the other wall; passes while both are in view", true),
    ("along the wall, or collides", true),
    ("collides: same class, out of view", false),
    ("almost never collides", true),
];

/// Returns the thesis's remarks on each line.
pub(crate) fn remarks() -> Vec<Remark> {
    let of = |method: &'static str, said: [(&'static str, bool); 12]| {
        LINES.into_iter().zip(said).map(move |(line, (words, _))| Remark { method, line, words })
    };
    of("qtc-b", QTC_B).chain(of("argd", ARGD)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::outcome::Kind;
    use crate::experiments::run;

    /// Regression test: a robot that stood still for 20 s because no pair of markers was in view counted as lost, like a robot that
    /// loses its markers on the way. The thesis has no drives that never begin.
    #[test]
    fn a_robot_without_a_pair_at_its_start_never_moved() {
        let suite = suite(&Folders::of_checkout()).unwrap();
        let trial =
            suite.trials.iter().find(|trial| trial.name.starts_with("straight-3.0-opposite-equal/right"));
        let ended = run::run(trial.unwrap(), "qtc-b", 1, 1).unwrap().remove(0);
        assert_eq!((ended.kind, ended.reason.as_str()), (Kind::NeverMoved, "no pair of markers for 20 s"));
    }
}

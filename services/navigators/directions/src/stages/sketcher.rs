//! The map-maker as a stage, which sees the plane through the global camera, plans, and publishes the custom maps once.
//!
//! The map-maker's only source about a plane is a picture. It finds the centroids of spots in the picture and maps them onto the
//! plane by a perspective transform through known points (Park and Kender 1995, 7.1.1). Its positions therefore have errors of
//! their own, which it takes into account. On land, it reads the floor plan instead.

use std::fmt::Write;

use rand::RngExt;
use serde::Serialize;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::run::RunConfig;
use sketchnav_schemas::seed::stream;
use sketchnav_schemas::shown::one_line;
use sketchnav_stage::doubts::Planned;
use sketchnav_stage::{Files, Outbox, Stage, StageError};

use super::belief::Charts;
use super::error::DirectionsError;
use super::mission::{DirectionsMission, Method};
use super::planner::Simulation;
use super::settings;
use super::survey::{Seen, bytes, seen};
use crate::arrival::{Effort, Pilot, most_probable};
use crate::branching::most_probable_branching;
use crate::custom_map::{CustomMap, Entry};
use crate::description::Descriptor;
use crate::error::Error;
use crate::geometry::Point;
use crate::markers::LandmarkKind;
use crate::messages::{DIRECTIONS, ITINERARY, Itinerary, MAX_PLANNED, PlannedJourney, PlannedLandmark};
use crate::navigator::Navigator;
use crate::path::{Atlas, Measure, Path, Start, best};
use crate::plan::{Plan, Weakest};
use crate::plane::{DotId, Plane};
use crate::reliability::Reliability;
use crate::transitions::Kinds;

/// The line that separates the maps of two tasks.
pub const BETWEEN: &str = "---";

/// Everything that the map-maker has prepared for a mission.
#[derive(Debug, Clone)]
pub struct Made {
    /// The dots at the positions where the map-maker sees them. Empty if the map was written by hand.
    pub dots: Vec<Point>,
    /// The custom map of each task.
    pub maps: Vec<CustomMap>,
    /// The plan of each task. Empty if the map was written by hand, or if there is a chart.
    pub plans: Vec<Plan>,
    /// Each task's journey, as far as it is known to the map-maker.
    pub journeys: Vec<PlannedJourney>,
    /// The chart, if the navigator has a belief, in which case there are no maps.
    pub charts: Option<Charts>,
    /// For each task, the landmarks that its map refers to. Each has its number in `dots` or, for a map written by hand, its
    /// position in the task's list.
    pub landmarks: Vec<Vec<(DotId, Point)>>,
}

/// Makes the custom maps of a run, or the chart of its landmarks.
///
/// # Errors
/// [`DirectionsError`] with the file, the key or the task at fault.
pub fn make(run: &RunConfig, files: &Files<'_>) -> Result<Made, DirectionsError> {
    let read = DirectionsMission::of(&run.mission)?;
    match (seen(run, &read, files)?, &read.source) {
        (Some(seen), _) => plans(run, &read, seen),
        (None, source) => written(run, &read, source.file(), files),
    }
}

/// Returns the map-maker's knowledge of the plane of a run, or `None` if the map was written by hand.
///
/// # Errors
/// [`DirectionsError`] with the file or the key at fault.
pub fn atlas(run: &RunConfig, files: &Files<'_>) -> Result<Option<Atlas>, DirectionsError> {
    let read = DirectionsMission::of(&run.mission)?;
    let Some(Seen { plane, noise_m, .. }) = seen(run, &read, files)? else { return Ok(None) };
    let pilot = settings::pilot(&run.mission, &run.robot, noise_m)?;
    Ok(Some(survey(&read, plane, &pilot)))
}

fn survey(read: &DirectionsMission, plane: Plane, pilot: &Pilot) -> Atlas {
    let kinds = Kinds { words: &read.planned(), trajectories: true };
    Atlas::new(plane, pilot.settings.window, kinds, Reliability::fitted(pilot.noise))
}

/// Checks the files of a run without planning anything. Returns notices for people about whatever is suspicious, such as known
/// points that disagree, uneven light, spots that are not dots, or bearings that are never used.
///
/// # Errors
/// [`DirectionsError`] with the file or the key at fault.
pub fn notices(run: &RunConfig, files: &Files<'_>) -> Result<Vec<String>, DirectionsError> {
    let read = DirectionsMission::of(&run.mission)?;
    if let Some(seen) = seen(run, &read, files)? {
        return Ok(seen.notices);
    }
    let file = read.source.file();
    let made = written(run, &read, file, files)?;
    // After `*`, a bearing says which landmark is meant.
    let only_corrects = |entry: &Entry| entry.bearing_deg.is_some() && entry.word != Descriptor::Any;
    let has_bearings = made.maps.iter().flat_map(CustomMap::entries).any(only_corrects);
    let corrects_nothing = has_bearings && read.heading_noise_deg == 0.0;
    let notice = || format!("{file}: its bearings correct nothing without navigator.heading_noise_deg");
    Ok(corrects_nothing.then(notice).into_iter().collect())
}

/// Probability of arrival below which a journey is reported before the start.
const LOW: f64 = 0.5;

/// Returns a warning for each journey that is more likely to fail than to arrive, according to the map-maker's own estimate.
pub fn doubts(mission: &Mission, journeys: &[PlannedJourney]) -> Vec<String> {
    less_probable(mission, journeys, LOW).collect()
}

/// Describes each journey whose stated probability of arrival is below a limit.
fn less_probable(mission: &Mission, journeys: &[PlannedJourney], limit: f64) -> impl Iterator<Item = String> {
    let planned = (1..).zip(mission.task.iter().zip(journeys));
    let low = planned.filter(move |(_, (_, journey))| (0.0..limit).contains(&journey.probability));
    low.map(|(number, (task, journey))| {
        let percent = 100.0 * journey.probability;
        format!("task {number} ({}): the stated probability of arrival is {percent:.1} %", task.name)
    })
}

/// Returns the reason why a robot should not start these journeys without a person's consent, or `None` if it may.
fn objection(mission: &Mission, journeys: &[PlannedJourney]) -> Option<String> {
    let least = DirectionsMission::of(mission).ok()?.least_probability;
    let low = less_probable(mission, journeys, least).reduce(|all, next| format!("{all}; {next}"))?;
    Some(format!("{low}: expected at least {:.1} % (navigator.least_probability)", 100.0 * least))
}

/// Shows the maps that the map-maker has made, with doubts about them.
pub const PLANNED: Planned = Planned {
    on: ITINERARY.spec,
    doubts: |run, message| {
        let itinerary: &Itinerary = bytemuck::from_bytes(message);
        doubts(&run.mission, itinerary.journeys())
    },
    objection: |run, message| {
        let itinerary: &Itinerary = bytemuck::from_bytes(message);
        objection(&run.mission, itinerary.journeys())
    },
    text: DIRECTIONS.spec,
};

/// Reads and checks a map that was written by hand.
fn written(
    run: &RunConfig,
    read: &DirectionsMission,
    file: &str,
    files: &Files<'_>,
) -> Result<Made, DirectionsError> {
    let wrong = |reason: &str| DirectionsError::File {
        key: "navigator.map_file",
        file: file.to_owned(),
        reason: reason.to_owned(),
    };
    let text = String::from_utf8(bytes("navigator.map_file", file, files)?);
    let text = text.map_err(|_| wrong("expected UTF-8, found other bytes"))?;
    let in_file = |cause| DirectionsError::Map { file: file.to_owned(), cause };
    let map: CustomMap = text.parse().map_err(in_file)?;
    Navigator::new(settings::settings(&run.mission, &run.robot)?, map.clone()).map_err(in_file)?;
    unknown_kind(&map, read).map_or(Ok(()), |cause| Err(in_file(cause)))?;
    if !read.landmarks.is_empty() && read.landmarks.len() != map.entries().len() {
        let (entries, found) = (map.entries().len(), read.landmarks.len());
        let reason =
            format!("expected one of the task's landmarks for each of its {entries} entries, found {found}");
        return Err(wrong(&reason));
    }
    let landmarks = vec![(0..).zip(read.landmarks.iter().copied()).collect()];
    let journeys = vec![PlannedJourney::new(0.0)];
    Ok(Made { dots: Vec::new(), maps: vec![map], plans: Vec::new(), journeys, charts: None, landmarks })
}

/// Returns an error if a map names a kind of landmark for which the mission has no markers.
fn unknown_kind(map: &CustomMap, read: &DirectionsMission) -> Option<Error> {
    let kinds = (1..).zip(map.entries()).filter_map(|(entry, line)| Some((entry, line.kind?)));
    let (entry, kind) = kinds.into_iter().find(|(_, kind)| !read.markers.contains_key(kind))?;
    let known: Vec<&str> = read.markers.keys().map(LandmarkKind::name).collect();
    let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
    Some(Error::UnknownKind { entry, known, found: kind.to_string() })
}

fn plans(
    run: &RunConfig,
    read: &DirectionsMission,
    Seen { plane, noise_m, notices }: Seen,
) -> Result<Made, DirectionsError> {
    let pilot = settings::pilot(&run.mission, &run.robot, noise_m)?;
    let atlas = survey(read, plane, &pilot);
    if read.method == Method::Belief {
        return charted(run, read, &atlas, &pilot, &notices);
    }
    let maker = Maker { atlas: &atlas, read, pilot, effort: settings::effort(&run.mission)?, seed: run.seed };
    let [x, y] = run.mission.start.world;
    let (mut plans, mut before) = (Vec::new(), None);
    for (index, &goal) in read.goals.iter().enumerate() {
        let plan = maker.plan(index, before, Point::new(x, y), goal);
        let plan = plan.map_err(|cause| in_task(&run.mission, index, cause, &notices))?;
        before = Some(Start::behind(&atlas, &plan.path));
        plans.push(plan);
    }
    let landmarks = plans
        .iter()
        .map(|plan| plan.landmarks().into_iter().map(|dot| (dot, atlas.plane.dot(dot))).collect());
    Ok(Made {
        landmarks: landmarks.collect(),
        maps: plans.iter().map(|plan| plan.map.clone()).collect(),
        dots: atlas.plane.dots().to_vec(),
        journeys: plans.iter().map(|plan| journey(&plan.path, plan.probability, plan.weakest)).collect(),
        charts: None,
        plans,
    })
}

fn journey(path: &Path, probability: Option<f64>, weakest: Option<Weakest>) -> PlannedJourney {
    let mut journey = PlannedJourney::new(path.distance);
    if let Some(probability) = probability {
        journey.probability = probability;
    }
    if let Some(Weakest { entry, failures, journeys }) = weakest {
        journey.weakest_entry = u32::from(entry) + 1;
        (journey.failure_count, journey.simulated_count) = (failures, journeys);
    }
    journey
}

/// Makes the chart for a navigator with a belief.
fn charted(
    run: &RunConfig,
    read: &DirectionsMission,
    atlas: &Atlas,
    pilot: &Pilot,
    notices: &[String],
) -> Result<Made, DirectionsError> {
    let in_task = |task| move |cause| in_task(&run.mission, task, cause, notices);
    let [x, y] = run.mission.start.world;
    let mut start = Start::at(&atlas.plane, atlas.window, Point::new(x, y)).map_err(in_task(0))?;
    let mut tasks = Vec::new();
    for (task, &goal) in read.goals.iter().enumerate() {
        let goal = wanted(atlas, goal).map_err(in_task(task))?;
        tasks.push((start, goal));
        start = Start::over(&atlas.plane, goal).map_err(in_task(task))?;
    }
    let simulation = Simulation { pilot: *pilot, seed: run.seed };
    let charts = Charts::new(atlas, &tasks, &simulation, settings::effort(&run.mission)?.journeys);
    let charts = charts.map_err(|(task, cause)| in_task(task)(cause))?;
    let landmarks =
        |path: &Path| path.landmarks().into_iter().map(|dot| (dot, atlas.plane.dot(dot))).collect();
    let planned = charts.paths.iter().zip(&charts.probabilities);
    Ok(Made {
        dots: atlas.plane.dots().to_vec(),
        maps: Vec::new(),
        plans: Vec::new(),
        journeys: planned.map(|(path, &probability)| journey(path, Some(probability), None)).collect(),
        landmarks: charts.paths.iter().map(landmarks).collect(),
        charts: Some(charts),
    })
}

fn in_task(mission: &Mission, index: usize, cause: Error, notices: &[String]) -> DirectionsError {
    let name = mission.task[index].name.clone();
    DirectionsError::Plan { number: index + 1, name, cause, notices: notices.to_vec() }
}

struct Maker<'a> {
    atlas: &'a Atlas,
    read: &'a DirectionsMission,
    pilot: Pilot,
    effort: Effort,
    seed: u64,
}

impl Maker<'_> {
    /// Plans a task. The first task begins at the mission's start, and every later task over the goal of the previous one.
    fn plan(&self, index: usize, before: Option<Start>, start: Point, goal: Point) -> Result<Plan, Error> {
        let Self { atlas, read, pilot, effort, seed } = self;
        let start = match before {
            Some(start) => start,
            None => Start::at(&atlas.plane, atlas.window, start)?,
        };
        let goal = wanted(atlas, goal)?;
        match read.method.objective(&pilot.settings) {
            Some(objective) => {
                let path = best(atlas, start, goal, Measure::Windows, objective)?;
                Plan::new(atlas, path, read.verify)
            }
            None if read.method == Method::Branching => {
                most_probable_branching(atlas, start, goal, pilot, *effort, own_seed(*seed, index))
            }
            None => most_probable(atlas, start, goal, pilot, *effort, own_seed(*seed, index)),
        }
    }
}

/// Returns the seed for the simulations of a task.
fn own_seed(seed: u64, task: usize) -> u64 {
    stream(seed, &format!("sketcher/arrival/{task}")).random()
}

/// Returns the dot closest to the middle of a window over the goal.
fn wanted(atlas: &Atlas, goal: Point) -> Result<DotId, Error> {
    Start::wanted(&atlas.plane, atlas.window, goal).map_err(no_goal).map(|start| start.landmark)
}

fn no_goal(cause: Error) -> Error {
    match cause {
        Error::NothingInView { x, y } => Error::NoGoal { x, y },
        other => other,
    }
}

/// The map-maker of a run.
pub struct Sketcher {
    made: Made,
    text: String,
}

impl Sketcher {
    /// Makes the custom maps of a run.
    ///
    /// # Errors
    /// [`DirectionsError`] with the file, the key or the task at fault.
    pub fn new(run: &RunConfig, files: &Files<'_>) -> Result<Self, DirectionsError> {
        let made = make(run, files)?;
        let entries: usize = made.maps.iter().map(|map| map.entries().len()).sum();
        let found = entries.max(made.landmarks.iter().map(Vec::len).sum());
        if found > MAX_PLANNED {
            return Err(DirectionsError::TooLong { limit: MAX_PLANNED, found });
        }
        Ok(Self { text: text(&run.mission, &made), made })
    }
}

/// Parses the text of several maps.
///
/// # Errors
/// [`Error`] if a part of the text is not a map. Line numbers are those within that part.
pub fn maps_of(text: &str) -> Result<Vec<CustomMap>, Error> {
    let lines: Vec<&str> = text.lines().collect();
    lines.split(|line| line.trim() == BETWEEN).map(|lines| lines.join("\n").parse()).collect()
}

/// Joins the maps of all tasks into one text. Comments state the probability of arrival, and at which entry most journeys fail.
fn text(mission: &Mission, made: &Made) -> String {
    let mut text = String::new();
    for (index, map) in made.maps.iter().enumerate() {
        let between = if index == 0 { String::new() } else { format!("{BETWEEN}\n") };
        // A line break in the name would end the comment.
        let name = one_line(&mission.task[index].name);
        let stated = made.journeys.get(index).and_then(PlannedJourney::stated);
        let stated = stated.map_or(String::new(), |stated| format!("# {name}: {stated}\n"));
        // Writing to a string never fails.
        let _ = write!(text, "{between}{stated}{map}");
    }
    text
}

impl Stage for Sketcher {
    const FORM: &'static str = "directions sketcher 1";
    type State = ();

    fn announce(&mut self, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let Self { made, text } = self;
        match &made.charts {
            Some(charts) => charts.announce(out)?,
            None => {
                out.send_with(DIRECTIONS, text.len(), |directions, cells| {
                    directions.map_count = made.maps.len() as u32;
                    cells.copy_from_slice(text.as_bytes());
                })?;
            }
        }
        let landmarks = (0..).zip(&made.landmarks);
        let landmarks = landmarks.flat_map(|(task, all)| all.iter().map(move |&(dot, at)| (task, dot, at)));
        out.send_with(ITINERARY, 8 * made.dots.len(), |itinerary, cells| {
            itinerary.journey_count = made.journeys.len() as u32;
            itinerary.journeys[..made.journeys.len()].copy_from_slice(&made.journeys);
            for (place, (task, dot, at)) in itinerary.landmarks.iter_mut().zip(landmarks) {
                *place = PlannedLandmark { task, dot, x_m: at.x as f32, y_m: at.y as f32 };
                itinerary.landmark_count += 1;
            }
            for (cell, dot) in cells.chunks_exact_mut(8).zip(&made.dots) {
                cell[..4].copy_from_slice(&(dot.x as f32).to_le_bytes());
                cell[4..].copy_from_slice(&(dot.y as f32).to_le_bytes());
            }
        })?;
        Ok(())
    }

    fn state(&self) -> impl Serialize {}

    fn restore(&mut self, (): ()) -> Result<(), StageError> {
        Ok(())
    }
}

/// Returns the dots in the slice of an itinerary, at the positions where the map-maker sees them.
pub fn dots_of(cells: &[u8]) -> impl Iterator<Item = Point> + '_ {
    let number = |bytes: &[u8]| f64::from(f32::from_le_bytes(bytes.try_into().unwrap_or_default()));
    cells.chunks_exact(8).map(move |cell| Point::new(number(&cell[..4]), number(&cell[4..])))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [320, 100];

    /// Returns a picture of 320 × 100 pixels of 2.5 mm, with a dark square for each dot (column and row of its middle).
    /// `changed` can modify the level of each pixel.
    fn picture(dots: &[[usize; 2]], changed: impl Fn([usize; 2], usize) -> usize) -> Vec<u8> {
        let is_dark = |[column, row]: [usize; 2]| {
            dots.iter().any(|dot| column.abs_diff(dot[0]) <= 2 && row.abs_diff(dot[1]) <= 2)
        };
        let mut text = format!("P2 {} {} 255\n", SIZE[0], SIZE[1]);
        for row in 0..SIZE[1] {
            for at in (0..SIZE[0]).map(|column| [column, row]) {
                let level = changed(at, if is_dark(at) { 10 } else { 245 });
                text.push_str(&format!("{level} "));
            }
            text.push('\n');
        }
        text.into_bytes()
    }

    const KNOWN: &str = "[0,0,0,0.25],[320,0,0.8,0.25],[0,100,0,0],[320,100,0.8,0]";

    fn run(known: &str, goal: [f64; 2]) -> RunConfig {
        let mission = format!(
            "name='m'\nrobot='helicopter'\nworld={{plane='p.toml'}}\nstart={{world=[0.1,0.1],world_heading_deg=0}}\n\
             [navigator]\nkind='directions'\nplane_file='p.png'\ncalibration=[{known}]\n\
             [[task]]\nname='over'\ngoal={goal:?}\n"
        );
        let robot = sketchnav_sim::robots::find("helicopter").unwrap().unwrap();
        RunConfig::lockstep("test", Mission::parse(&mission).unwrap(), robot, 1)
    }

    fn made(dots: &[[usize; 2]], goal: [f64; 2]) -> Result<Made, DirectionsError> {
        make(&run(KNOWN, goal), &|_| Ok(picture(dots, |_, level| level)))
    }

    /// Two pairs of dots, neither of which lies on the line through the other pair.
    const APART: [[usize; 2]; 4] = [[40, 60], [60, 40], [280, 60], [280, 36]];

    #[test]
    fn a_goal_that_no_path_reaches_is_named_with_what_would_join_it() {
        let error = made(&APART, [0.7, 0.16]).unwrap_err().to_string();
        assert!(error.starts_with("task 1 (over): no path from dot "), "{error}");
        assert!(
            error.contains(": 2 dots are reached from the start, 2 reach the goal. A path would have to"),
            "{error}"
        );
        assert!(error.contains(" apart, and two are seen together up to 0.141"), "{error}");
        let made = made(&APART, [0.15, 0.15]).unwrap();
        assert_eq!(made.maps[0].entries().len(), 2, "{}", made.maps[0]);
    }

    #[test]
    fn known_points_that_disagree_are_named_and_refused_where_nothing_could_be_right() {
        // Two further known points, which agree with the others, followed by `last`.
        let known = |last: &str| format!("{KNOWN},[160,0,0.4,0.25],[160,100,0.4,0],{last}");
        let see = |known: &str| {
            notices(&run(known, [0.15, 0.15]), &|_| Ok(picture(&APART, |_, level| level)))
                .map_err(|error| error.to_string())
        };
        assert_eq!(see(&known("[160,50,0.4,0.125]")), Ok(Vec::new()));
        let off = see(&known("[172,50,0.4,0.125]")).unwrap();
        assert_eq!(off.len(), 1, "{off:?}");
        assert!(
            off[0].starts_with("navigator.calibration: point 7 12 pixels off where the other 6 have it"),
            "{off:?}"
        );
        let exchanged =
            "[320,0,0,0.25],[0,0,0.8,0.25],[0,100,0,0],[320,100,0.8,0],[160,0,0.4,0.25],[160,50,0.4,0.125]";
        let error = see(exchanged).unwrap_err();
        assert!(
            error.starts_with("navigator.calibration: expected known points that agree, found point 1 "),
            "{error}"
        );
        assert!(error.ends_with("exchange the places of points 1 and 2, and all agree"), "{error}");
        let mirrored = "[0,100,0,0.25],[320,100,0.8,0.25],[0,0,0,0],[320,0,0.8,0]";
        let said = see(mirrored).unwrap();
        assert!(said[0].contains("as if from below"), "{said:?}");
        assert!(
            said[1].ends_with("cannot be checked against each other; a fifth would show an error"),
            "{said:?}"
        );
    }

    #[test]
    fn uneven_light_is_levelled_and_a_frame_is_left_out_and_both_are_said() {
        let seen = |changed: &dyn Fn([usize; 2], usize) -> usize| {
            let bytes = picture(&APART, changed);
            let run = run(&format!("{KNOWN},[160,50,0.4,0.125]"), [0.15, 0.15]);
            let made = make(&run, &|_| Ok(bytes.clone())).unwrap();
            (made.dots, notices(&run, &|_| Ok(bytes.clone())).unwrap())
        };
        let (dots, none) = seen(&|_, level| level);
        assert_eq!((dots.len(), none), (4, Vec::new()));
        let (lit, light) = seen(&|[column, _], level| level * (100 + column) / 420);
        assert!(lit.iter().zip(&dots).all(|(a, b)| (*a - *b).norm() < 0.001), "{lit:?}");
        assert!(light.len() == 1 && light[0].starts_with("p.png: the light is uneven"), "{light:?}");
        let is_frame = |[column, row]: [usize; 2]| column.min(row) == 0 || column == 319 || row == 99;
        let (framed, frame) = seen(&|at, level| if is_frame(at) { 10 } else { level });
        assert_eq!(framed.len(), 4);
        assert!(
            frame[0].starts_with("p.png: left out spots that are no dots: 1 (one around pixel (160, 50) is "),
            "{frame:?}"
        );
        assert!(frame[0].ends_with("; 4 dots are left"), "{frame:?}");
    }

    #[test]
    fn what_looks_wrong_is_said_with_a_goal_that_is_not_found() {
        let bytes = picture(&APART, |[column, _], level| level * (100 + column) / 420);
        let error = make(&run(KNOWN, [5.0, 5.0]), &|_| Ok(bytes.clone())).unwrap_err().to_string();
        assert!(error.starts_with("task 1 (over): goal (5, 5): expected a dot within a window"), "{error}");
        assert!(error.contains("; p.png: the light is uneven"), "{error}");
    }

    #[test]
    fn a_low_probability_is_doubted() {
        let mission = run(KNOWN, [0.15, 0.15]).mission;
        let doubts =
            |probability| doubts(&mission, &[PlannedJourney { probability, ..PlannedJourney::new(1.0) }]);
        assert_eq!(doubts(0.025), ["task 1 (over): the stated probability of arrival is 2.5 %"]);
        assert!(doubts(0.9).is_empty() && doubts(-1.0).is_empty());
    }

    #[test]
    fn a_robot_does_not_start_below_the_probability_that_the_mission_states() {
        let mut mission = run(KNOWN, [0.15, 0.15]).mission;
        let journey = |probability| [PlannedJourney { probability, ..PlannedJourney::new(1.0) }];
        assert_eq!((objection(&mission, &journey(0.5)), objection(&mission, &journey(-1.0))), (None, None));
        assert_eq!(
            objection(&mission, &journey(0.25)).unwrap(),
            "task 1 (over): the stated probability of arrival is 25.0 %: expected at least 50.0 % (navigator.least_probability)"
        );
        mission.navigator.given.insert("least_probability".to_owned(), 0.9.into());
        assert!(
            objection(&mission, &journey(0.89)).is_some() && objection(&mission, &journey(0.9)).is_none()
        );
    }

    /// Comments in the text of the maps state how the journeys will probably end, and the text is parsed like any other map.
    #[test]
    fn maps_are_sent_with_what_to_expect_of_them() {
        let mut run = run(KNOWN, [0.15, 0.15]);
        run.mission.task[0].name = "one\nline".to_owned();
        let made = make(&run, &|_| Ok(picture(&APART, |_, level| level))).unwrap();
        let text = text(&run.mission, &made);
        assert!(text.starts_with("# one"), "{text}");
        assert!(text.lines().next().unwrap().contains(": probability of arrival "), "{text}");
        assert_eq!(maps_of(&text).unwrap(), made.maps);
    }

    #[test]
    fn a_map_of_map_server_is_no_floor_plan() {
        let mut run = run(KNOWN, [0.15, 0.15]);
        let given = &mut run.mission.navigator.given;
        given.remove("plane_file");
        given.remove("calibration");
        given.insert("floor_file".to_owned(), "building_079.yaml".into());
        given.insert("landmark_radius_m".to_owned(), 0.15.into());
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let robot = folder.join("../../../sim/missions/directions/panorama.toml");
        run.robot = sketchnav_sim::files::robot(&robot.to_string_lossy()).unwrap();
        let error = make(&run, &|_| Ok(b"image: building_079.pgm".to_vec())).unwrap_err().to_string();
        let expected = "navigator.floor_file: building_079.yaml: expected a floor plan (TOML) with walls and round furniture";
        assert!(error.starts_with(expected), "{error}");
    }

    /// Plans a path through a hall of columns at this spacing, with `more` standing in the hall, for a robot that sees as far
    /// as `range_m`. The path leads from the column in the south-west to that in the north-east.
    fn hall(apart_m: f64, range_m: f64, more: &str) -> Result<Made, DirectionsError> {
        let mut floor = "name='hall'\nwall_thickness_m=0.1\n[[wall]]\nclosed=true\n\
                         points=[[-3,-3],[33,-3],[33,33],[-3,33]]\n"
            .to_owned();
        for (x, y) in
            (0..4).flat_map(|i| (0..3).map(move |j| (f64::from(i) * apart_m, f64::from(j) * apart_m)))
        {
            let _ = write!(floor, "[[furniture]]\ncenter=[{x},{y}]\nradius_m=0.15\n");
        }
        floor.push_str(more);
        let goal = [3.0 * apart_m, 2.0 * apart_m];
        let mission = format!(
            "name='m'\nrobot='panorama'\nworld={{floor_plan='f.toml'}}\nstart={{world=[0.6,0.6],world_heading_deg=0}}\n\
             [navigator]\nkind='directions'\nfloor_file='f.toml'\nlandmark_radius_m=0.15\nrange_m={range_m:?}\n\
             heading_noise_deg=2.0\n[[task]]\nname='across'\ngoal={goal:?}\n\
             [parameters.sketcher]\ntrials=32\ntrial_journeys=4\njourneys=32\n"
        );
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let robot = folder.join("../../../sim/missions/directions/panorama.toml");
        let robot = sketchnav_sim::files::robot(&robot.to_string_lossy()).unwrap();
        let run = RunConfig::lockstep("test", Mission::parse(&mission).unwrap(), robot, 1);
        make(&run, &|_| Ok(floor.clone().into_bytes()))
    }

    /// Regression test: to a robot with a range of 8 m, columns 6 m apart were not neighbours, because its window was a square that
    /// ended at 5 m.
    #[test]
    fn columns_that_are_in_sight_are_joined() {
        for (apart_m, range_m) in [(6.0, 8.0), (7.0, 9.5)] {
            let made = hall(apart_m, range_m, "").unwrap();
            assert!(
                made.plans[0].probability > Some(0.5),
                "{apart_m}: {:?}\n{}",
                made.plans[0].probability,
                made.maps[0]
            );
        }
        // The diagonally opposite column is out of sight, and the two along the axes are equally isolated. There is a path
        // nevertheless.
        assert!(hall(5.0, 6.0, "").is_ok());
        let error = hall(8.8, 8.0, "").unwrap_err().to_string();
        assert!(error.contains(" apart, and two are seen together up to 8.775"), "{error}");
    }

    /// Puts a wall with a gap between the second and the third row of columns.
    #[test]
    fn a_path_leads_through_the_gap_of_a_wall_and_none_through_the_wall() {
        let wall = |from: f64, to: f64| format!("[[wall]]\npoints=[[9,{from:?}],[9,{to:?}]]\n");
        let crossing = |more: &str| {
            let made = hall(6.0, 10.0, more).unwrap();
            let places: Vec<Point> = made.landmarks[0].iter().map(|(_, at)| *at).collect();
            let crosses = |pair: &[Point]| (pair[0].x < 9.0) != (pair[1].x < 9.0);
            let pairs: Vec<[Point; 2]> =
                places.windows(2).filter(|pair| crosses(pair)).map(|pair| [pair[0], pair[1]]).collect();
            assert_eq!(pairs.len(), 1, "{places:?}");
            assert!(made.plans[0].probability > Some(0.3), "{:?}", made.plans[0].probability);
            pairs[0].map(|at| at.y)
        };
        assert_eq!(crossing(&[wall(-3.0, 4.5), wall(7.5, 33.0)].concat()), [6.0; 2], "a gap in the middle");
        assert_eq!(crossing(&[wall(1.5, 33.0)].concat()), [0.0; 2], "around its southern end");
        let door = "[[door]]\nat=[9,12]\nwidth_m=1.6\n";
        assert_eq!(crossing(&[&wall(-3.0, 33.0), door].concat()), [12.0; 2], "through a door");
        for closed in [wall(-3.0, 33.0), [&wall(-3.0, 33.0), "[[door]]\nat=[9,12]\nwidth_m=0.3\n"].concat()] {
            let error = hall(6.0, 10.0, &closed).unwrap_err().to_string();
            assert!(error.contains("6 dots are reached from the start, 6 reach the goal"), "{error}");
            assert!(
                error.contains(" with a wall between them") || error.contains("too little room"),
                "{error}"
            );
        }
        let cupboard = "[[furniture]]\ncenter=[9,15]\nsize=[1,36]\n";
        assert!(hall(6.0, 10.0, cupboard).unwrap_err().to_string().contains(" with a wall between them"));
    }
}

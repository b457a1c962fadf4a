//! The `deformed` suite drives by drawings of four floors that are deformed in the way people deform theirs. `sketchnav deform`
//! makes the drawings at four degrees. Those of degree 1 have the statistics of people's drawings.
//!
//! In each trial, the robot drives from a place in one region to a place in another. The positions of both places in the drawing
//! follow from the deformation, and places that were left out of the drawing are never used. As in the `people` suite, arrival is
//! judged by region. Trials are named by floor, degree, number and pair. Drawings with the same number have the same places at all
//! degrees.

use std::path::Path;
use std::sync::Arc;

use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_pcg::Pcg64Mcg;
use sketchnav_deform::{DeformedDrawing, Floor};
use sketchnav_schemas::geometry::{Point, Pose, World, encloses};
use sketchnav_schemas::mission::{Mission, Place, Start, WorldSource};
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::seed;
use sketchnav_sketch::mission::{Aim, SketchMission, SketchTask, WallTone};
use sketchnav_sketch::reading::{DrawnMap, Intent, Options};

use crate::error::EvalError;
use crate::experiments::ground::{Ground, departure_deg, length_m, to_outline_m};
use crate::experiments::people::regions::Regions;
use crate::experiments::suite::{Datum, Folders, Suite};
use crate::experiments::trial::{Page, Sheet, Trial, time_limit_s};

const TITLE: &str = "Drawings of four floors, deformed as people deform them (degree 1; at 0 the walls are traced), seven of each floor at each degree; drives lead from one region to another.";
/// Floors that are not part of the project, with their names and their bare and furnished maps.
const MAPS: [(&str, [Datum; 2]); 2] = {
    const KTH: Datum = Datum {
        what: "the floor that ten people drew (M. Mielle et al., sketch_map_matching)",
        file: "sketches/kth/world.yaml",
    };
    const fn freiburg(file: &'static str) -> Datum {
        Datum { what: "the map of Building 079 in Freiburg", file }
    }
    [
        ("kth", [KTH; 2]),
        (
            "freiburg",
            [freiburg("maps/Freiburg79_scan.yaml"), freiburg("maps/Freiburg79_scan_furnitures.yaml")],
        ),
    ]
};
const DEGREES: [f64; 4] = [0.0, 0.5, 1.0, 1.5];
/// Number of drawings of each floor at each degree. Their seeds are the numbers from 1.
pub(crate) const DRAWINGS: u64 = 7;
/// Number of trials for each drawing.
const PAIRS: usize = 4;
/// Maximum number of random pairs that are tried to find the trials of a drawing.
const TRIES: usize = 60;
/// Distance that the robot keeps from walls, in metres, in addition to its radius.
const CLEARANCE_M: f64 = 0.1;
/// Cell size, in metres, of the grid on which paths are searched in a world of walls and furniture.
const CELL_M: f64 = 0.1;
/// Minimum depth of places inside their region, as a share of the depth of the deepest place.
const DEPTH: f64 = 0.5;
/// Distance along the path, in metres, of the point that the robot faces at the start.
const LOOK_AHEAD_M: f64 = 1.0;

/// A floor that is drawn and driven.
pub(crate) struct Site {
    pub(crate) name: String,
    world: WorldSource,
    floor: Floor,
    /// The positions where the robot fits.
    pub(crate) ground: Ground,
    robot: Robot,
    regions: Vec<Region>,
}

/// A region of the true floor, and the places in it that a person would mark.
struct Region {
    name: String,
    place: Place,
    marks: Vec<[f64; 2]>,
}

/// Loads the `deformed` suite.
///
/// # Errors
/// [`EvalError`] if a file is malformed. Floors whose data are missing are left out with a notice.
pub fn suite(folders: &Folders) -> Result<Suite, EvalError> {
    let mut suite = Suite { title: TITLE.into(), repetitions: 1, lines: Some("degree"), ..Suite::default() };
    let sites = sites(folders, &mut suite.notices)?;
    for degree in DEGREES {
        for site in &sites {
            for number in 1..=DRAWINGS {
                suite.trials.extend(site.trials(degree, number)?);
            }
        }
    }
    Ok(suite)
}

/// Returns the floors that are part of the project.
pub(crate) fn shipped(folders: &Folders) -> Result<Vec<Site>, EvalError> {
    let missions = folders.project.join("sim/missions");
    let plan = |name| Site::of_plan(name, &missions.join(format!("{name}/{name}.floor.toml")));
    ["building", "laboratory"].into_iter().map(plan).collect()
}

/// Returns all floors. Those whose data are missing are left out with a notice.
pub(crate) fn sites(folders: &Folders, notices: &mut Vec<String>) -> Result<Vec<Site>, EvalError> {
    let mut sites = shipped(folders)?;
    for (name, maps) in MAPS {
        let [bare, furnished] = maps.map(|map| folders.datum(map));
        match bare.and_then(|bare| Ok((bare, furnished?))) {
            Ok((bare, furnished)) => sites.push(Site::of_maps(name, &bare, &furnished)?),
            Err(missing) => notices.push(format!("skipped: {name}: {missing}")),
        }
    }
    Ok(sites)
}

impl Site {
    /// Opens a floor plan, with its furniture and the people who walk there.
    pub(crate) fn of_plan(name: impl Into<String>, path: &Path) -> Result<Self, EvalError> {
        let robot = sketchnav_sim::files::robot("robotino")?;
        let world = sketchnav_sim::files::floor_plan_file(path)?;
        let ground = Ground::of_world(&world, CELL_M, robot.radius_m + CLEARANCE_M);
        let floor = sketchnav_deform::files::floor(path)?;
        let regions = regions(&floor, &ground);
        let world = source(Some(path), None);
        Ok(Self { name: name.into(), world, floor, ground, robot, regions })
    }

    /// Opens a pair of maps: the bare one for drawings, and the furnished one for drives.
    fn of_maps(name: &'static str, bare: &Path, furnished: &Path) -> Result<Self, EvalError> {
        let robot = sketchnav_sim::files::robot("robotino")?;
        let map = sketchnav_sim::files::occupancy_map(furnished)?;
        let ground = Ground::new(&map, robot.radius_m + CLEARANCE_M);
        let floor = sketchnav_deform::files::floor(bare)?;
        let regions = if name == "kth" { annotated(&ground)? } else { regions(&floor, &ground) };
        let world = source(None, Some(furnished));
        Ok(Self { name: name.into(), world, floor, ground, robot, regions })
    }

    /// Returns the trials with one drawing.
    pub(crate) fn trials(&self, degree: f64, number: u64) -> Result<Vec<Trial>, EvalError> {
        let drawing = sketchnav_deform::deform(&self.floor, degree, number)?;
        let strokes = drawing.strokes_json();
        let name = format!("{}/{degree}/{number}", self.name);
        let options = Options { walls: WallTone::Dark, ..Options::default() };
        let paper = Arc::new(sketchnav_sketch::reading::read(strokes.as_bytes(), &name, &options)?);
        let bytes = Page::from(strokes.into_bytes());
        let mut rng = seed::stream(number, &format!("eval/deformed/{}", self.name));
        let tries = (1..=TRIES).map(|i| (i, self.mission(&drawing, &paper, &name, &mut rng)));
        let trial = |(i, mission)| Trial {
            sheet: Some(Sheet::new(paper.clone())),
            bytes: Some(bytes.clone()),
            cluster: Some(name.clone()),
            ..Trial::new(format!("{name}/{i}"), degree.to_string(), mission, self.robot.clone())
        };
        Ok(tries.filter_map(|(i, mission)| Some((i, mission?))).take(PAIRS).map(trial).collect())
    }

    /// Returns a mission from one random place to another, or `None` if the drawing lacks one of them or no path connects them.
    fn mission(
        &self,
        drawing: &DeformedDrawing,
        paper: &DrawnMap,
        name: &str,
        rng: &mut Pcg64Mcg,
    ) -> Option<Mission> {
        let [from, to] = [(); 2].map(|()| self.regions.choose(rng));
        let [a, b] = [from?, to?].map(|region| region.marks[rng.random_range(0..region.marks.len())]);
        let (from, to) = (from?, to?);
        if std::ptr::eq(from, to) {
            return None;
        }
        let way = self.ground.way(a, b)?;
        let heading_deg = departure_deg(&way, LOOK_AHEAD_M)?;
        let start = drawing.pose_to_sketch(&Pose::new(a[0], a[1], heading_deg.to_radians()))?;
        let goal = drawing.to_sketch(&Point::<World>::new(b[0], b[1]))?;
        let sketch = SketchMission {
            method: None,
            drawing: name.to_owned(),
            walls: WallTone::Dark,
            start: Some(drawing.to_image(&start.position())),
            start_heading_deg: Some(start.yaw_rad.to_degrees()),
            places: Default::default(),
            learned_file: None,
            tasks: vec![SketchTask {
                name: format!("{} → {}", from.name, to.name),
                aim: Aim::Goal(drawing.to_image(&goal)),
                time_limit_s: time_limit_s(length_m(&way)),
            }],
        };
        let settings = Options::default().settings;
        Intent::of_mission(&sketch, paper).ok()?.place(paper, &settings).ok()?;
        let there = Place { center: Some(b), ..to.place.clone() };
        Some(Mission {
            name: format!("deformed/{name}"),
            description: TITLE.into(),
            robot: "robotino".into(),
            navigator: sketch.navigator(),
            world: self.world.clone(),
            start: Start { world: a, world_heading_deg: heading_deg },
            task: sketch.tasks.iter().map(|task| task.with_place(there.clone())).collect(),
            parameters: Default::default(),
        })
    }
}

fn source(floor_plan: Option<&Path>, map: Option<&Path>) -> WorldSource {
    let text = |path: &Path| path.to_string_lossy().into_owned();
    WorldSource { floor_plan: floor_plan.map(text), map: map.map(text), ..WorldSource::default() }
}

/// Returns the regions of the floor where the robot fits.
fn regions(floor: &Floor, ground: &Ground) -> Vec<Region> {
    let regions = floor.regions().iter().enumerate();
    let polygons = regions.map(|(i, region)| (format!("room {}", i + 1), region.polygon.clone()));
    entered(polygons, ground)
}

/// Returns the regions of the `people` suite.
fn annotated(ground: &Ground) -> Result<Vec<Region>, EvalError> {
    let regions = Regions::shipped()?;
    let polygons = regions.enterable().map(|(name, polygon)| (name.to_owned(), polygon.to_vec()));
    Ok(entered(polygons, ground))
}

fn entered(polygons: impl Iterator<Item = (String, Vec<[f64; 2]>)>, ground: &Ground) -> Vec<Region> {
    let region = |(name, polygon): (String, Vec<[f64; 2]>)| {
        let inside = ground.places().filter(|at| encloses(&polygon, *at));
        let deep: Vec<_> = inside.map(|at| (at, to_outline_m(&polygon, at))).collect();
        let most_m = deep.iter().map(|(_, depth_m)| *depth_m).fold(0.0, f64::max);
        let marks: Vec<_> =
            deep.iter().filter(|(_, depth_m)| *depth_m >= DEPTH * most_m).map(|(at, _)| *at).collect();
        let place = Place { polygon: Some(polygon), center: None, radius_m: None };
        (!marks.is_empty()).then_some(Region { name, place, marks })
    };
    polygons.filter_map(region).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::path::PathBuf;

    use sketchnav_deform::{Deformation, PEOPLE};
    use sketchnav_schemas::geometry::Sketch;

    use super::*;
    use crate::experiments::people::matches::{self, Reading};

    fn shipped() -> Suite {
        suite(&Folders::of_checkout()).unwrap()
    }

    /// The goals of a trial are the same at every degree, unless their rooms were forgotten.
    #[test]
    fn every_trial_leads_from_one_region_to_another() {
        let suite = shipped();
        assert_eq!((suite.notices.len(), suite.drawings()), (2, DEGREES.map(|d| d.to_string()).to_vec()));
        let mut goals: BTreeMap<String, Vec<[f64; 2]>> = BTreeMap::new();
        for Trial { name, mission, .. } in &suite.trials {
            let (start, task) = (mission.start.world, &mission.task[0]);
            let goal = task.there.middle();
            assert!(
                task.there.contains(goal[0], goal[1]) && !task.there.contains(start[0], start[1]),
                "{name}"
            );
            let parts: Vec<_> = name.split('/').collect();
            goals.entry([parts[0], parts[2], parts[3]].join("/")).or_default().push(goal);
        }
        assert_eq!(suite.trials.len(), 2 * DEGREES.len() * DRAWINGS as usize * PAIRS);
        assert!(goals.values().all(|goals| goals.iter().all(|goal| *goal == goals[0])));
        assert!(goals.len() < suite.trials.len() / 2, "most pairs are driven at several degrees");
    }

    /// The statistics that `sketchnav deform` aims at must be those of the annotated drawings. If a place has several marks, the
    /// most plausible one is used here, since it is not known which of them is right.
    #[test]
    fn deformations_match_the_marks_in_peoples_drawings() {
        let folder = needs::data().join("sketches/kth");
        if !folder.is_dir() {
            return needs::skipped("data", format_args!("{} is not there", folder.display()));
        }
        let drawings = (0..10).flat_map(|n| ["a", "b"].map(|by| format!("{n:02}.annotator-{by}.dat")));
        let found: Vec<_> = drawings.filter_map(|file| measured(&folder.join(file))).map(figures).collect();
        assert!(found.len() >= 7, "{}", found.len());
        for (k, people) in figures(PEOPLE).into_iter().enumerate() {
            let mean = found.iter().map(|figures| figures[k]).sum::<f64>() / found.len() as f64;
            assert!((mean / people - 1.0).abs() < 0.25, "figure {k}: {mean} instead of {people}");
        }
    }

    fn figures(d: Deformation) -> [f64; 4] {
        [d.similarity_residual, d.affine_residual, d.anisotropy, d.log_scale_sd]
    }

    /// Returns the deformation of a drawing that has at least six matched places.
    fn measured(path: &PathBuf) -> Option<Deformation> {
        let text = String::from_utf8_lossy(&std::fs::read(path).unwrap()).into_owned();
        let mut matches = matches::parse(&text).unwrap();
        matches.iter_mut().flat_map(|m| &mut m.world).for_each(|at| at[1] = -at[1]);
        let reading = Reading::new(matches);
        let pair = |i: usize| reading.likeliest_pair(i, |_| true);
        let pairs = (0..reading.matches.len()).filter_map(pair);
        let places = pairs.map(|(s, w)| (Point::<World>::new(w[0], w[1]), Point::<Sketch>::new(s[0], -s[1])));
        let places: Vec<_> = places.collect();
        if places.len() < 6 { None } else { Deformation::measure(&places) }
    }
}

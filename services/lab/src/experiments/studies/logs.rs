//! Logs of real robots, localized in drawings of the buildings that they were recorded in.
//!
//! The robot is real, and so are its laser, its odometry, and the furniture and people around it. From the corrected poses of each
//! log, a map is built, which `sketchnav deform` draws. For each pose of the corrected log, the corresponding position in the
//! drawing is therefore known. The localizer receives the start, as a person would mark it, the scans and the odometry. Because the
//! robot does not navigate by its estimates, a localizer that has lost the robot stays lost.

use std::path::{Path, PathBuf};
use std::thread::available_parallelism;

use bytemuck::Zeroable;
use sketchnav_deform::{DeformedDrawing, Floor};
use sketchnav_mapping::{self as mapping, CellGrid, Mapper};
use sketchnav_recordings::carmen::{self, CarmenError, CarmenLog, CarmenScan, Entry, Survey};
use sketchnav_recordings::import::{Messages, Rules};
use sketchnav_schemas::geometry::{Odom, Point, Pose, Sketch, World};
use sketchnav_schemas::message::{Header, LaserScan};
use sketchnav_schemas::robot::Drive;
use sketchnav_sim::ros_map::OccupancyMap;
use sketchnav_sketch::filter::beams::Mounting;
use sketchnav_sketch::filter::parameters::Parameters;
use sketchnav_sketch::filter::{Filter, Start};
use sketchnav_sketch::localizer::LocalizerError;
use sketchnav_sketch::messages::SketchMap;
use sketchnav_sketch::method::Method;
use sketchnav_sketch::mission::WallTone;
use sketchnav_sketch::reading::{DrawnMap, Options};
use sketchnav_sketch::sketch::SketchGrid;

use super::{Drawn, Figure, Run, Size, Study, Table};
use crate::error::EvalError;
use crate::experiments::jobs::in_parallel;
use crate::experiments::statistics::OverDrawings;
use crate::experiments::suite::Folders;
use crate::experiments::trial::derived;

/// The study.
pub static STUDY: Study = Study {
    name: "logs",
    title: "Logs of real robots, localized in drawings of their buildings: how often the estimate is in the right room, and how far it is from the corrected log. A world is a drawing.",
    worlds: 7,
    run: Run::WithFiles(run),
};

/// The methods that have a localizer of their own. `outline` uses that of `beam`.
const METHODS: [Method; 4] =
    [Method::Beam, Method::Boniardi2015, Method::Boniardi2015FixedScale, Method::Behzadian2015];
/// Degrees of deformation. At degree 1, drawings are deformed as much as people's.
const DEGREES: [f64; 3] = [0.0, 0.5, 1.0];
/// The folder of the logs, within the folder of data.
const LOGS: &str = "logs";
/// Cell size, in metres, of the map that is built from a log.
const MAP_CELL_M: f64 = 0.1;
/// Spacing, in metres, of the points of the floor by which estimates in the drawing are converted to the floor.
const LATTICE_M: f64 = 0.2;

/// A recorded drive through a building.
struct Driven {
    floor: Floor,
    scans: Vec<Scan>,
}

/// A scan with the odometry and the true pose at the same time.
struct Scan {
    odometry: Pose<Odom>,
    truth: Pose<World>,
    message: Box<LaserScan>,
}

/// How an estimate compares with the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Located {
    is_right_room: bool,
    error_m: f64,
}

/// A drawing, with the method by which a drive is localized in it.
struct Job<'a> {
    driven: &'a Driven,
    degree: f64,
    seed: u64,
    method: Method,
}

fn run(folders: &Folders, size: Size) -> Result<Vec<Figure>, EvalError> {
    let driven = logs(folders)?.iter().map(|path| Driven::open(path)).collect::<Result<Vec<_>, _>>()?;
    let threads = available_parallelism().map_or(1, usize::from);
    let lines = driven.iter().flat_map(|driven| DEGREES.map(|degree| (driven, degree)));
    let lines: Vec<_> = lines.collect();
    METHODS
        .into_iter()
        .map(|method| {
            let job = |(driven, degree), seed| Job { driven, degree, seed, method };
            let jobs: Vec<_> =
                lines.iter().flat_map(|&line| size.seeds(0).map(move |seed| job(line, seed))).collect();
            let located = in_parallel(&jobs, threads, Job::locate);
            let located = located.into_iter().collect::<Result<Vec<_>, _>>()?;
            let of_lines = located.chunks(size.worlds.max(1) as usize);
            let rows = lines.iter().zip(of_lines).map(|((driven, degree), drawings)| {
                (format!("{}, degree {degree}", driven.floor.name), values(drawings))
            });
            let head = ["log", "right room", "low", "high", "median error, m", "drawings", "scans"];
            let table = Table {
                title: method.to_string(),
                head: head.map(str::to_owned).to_vec(),
                rows: rows.collect(),
            };
            Ok(Figure { table, drawn: Drawn::Shares([0, 1, 2]) })
        })
        .collect()
}

/// Returns the numbers of a row: the share of estimates in the right room with its interval over drawings, in percent, the
/// median error, and how many drawings and scans were compared.
fn values(drawings: &[Vec<Located>]) -> Vec<f64> {
    let names: Vec<_> = (0..drawings.len()).map(|i| i.to_string()).collect();
    let all = || names.iter().zip(drawings).flat_map(|(name, all)| all.iter().map(move |one| (name, one)));
    let rooms: Vec<_> = all().map(|(name, one)| (Some(name.as_str()), one.is_right_room)).collect();
    let right = rooms.iter().filter(|(_, is_right)| *is_right).count() as f64 / rooms.len().max(1) as f64;
    let (low, high) = OverDrawings::of(&rooms).map_or((0.0, 1.0), |over| (over.low, over.high));
    let mut errors: Vec<_> = all().map(|(_, one)| one.error_m).collect();
    errors.sort_by(f64::total_cmp);
    let median = errors.get(errors.len() / 2).copied().unwrap_or_default();
    vec![100.0 * right, 100.0 * low, 100.0 * high, median, drawings.len() as f64, rooms.len() as f64]
}

impl Driven {
    /// Reads a log, and draws the floor that its scans show. Scans that an import would leave out are left out here, too.
    fn open(path: &Path) -> Result<Self, EvalError> {
        let in_log = |cause| EvalError::Log { path: path.to_owned(), cause };
        let header = Header { seq: 1, stamp_ns: 0, source_seq: 1 };
        let scan = |scan: CarmenScan| {
            let messages = Messages::of(&scan, header, &Rules::default());
            messages.check().ok()?;
            Some(Scan { odometry: scan.odometry, truth: scan.reference?, message: messages.scan })
        };
        let scans: Vec<_> = scans(path).map_err(in_log)?.into_iter().filter_map(scan).collect();
        if scans.is_empty() {
            return Err(EvalError::NoReference { path: path.to_owned() });
        }
        Ok(Self { floor: floor(&scans, &building(path))?, scans })
    }
}

/// Returns the paths of all logs in the data folder, in the order of their names.
fn logs(folders: &Folders) -> Result<Vec<PathBuf>, EvalError> {
    let missing = |found| EvalError::NoData {
        suite: folders.suite,
        what: "logs of CARMEN with corrected poses",
        file: "logs/*.log, *.log.gz",
        found,
    };
    let folder = folders.data.as_ref().ok_or_else(|| missing("neither is set".to_owned()))?.join(LOGS);
    let entries = folder.read_dir().map_err(|error| missing(format!("{}: {error}", folder.display())))?;
    let is_log = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.ends_with(".log") || name.ends_with(".log.gz")
    };
    let mut paths: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).filter(is_log).collect();
    paths.sort();
    if paths.is_empty() {
        return Err(missing(format!("no such file in {}", folder.display())));
    }
    Ok(paths)
}

/// Returns the name of a log without its extensions.
fn building(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.trim_end_matches(".gz").trim_end_matches(".log").to_owned()
}

fn scans(path: &Path) -> Result<Vec<CarmenScan>, CarmenError> {
    let reading = Survey::of(carmen::open(path)?)?.reading()?;
    let entries = CarmenLog::new(carmen::open(path)?, reading).filter_map(|entry| match entry {
        Ok(Entry::Scan(scan)) => Some(Ok(scan)),
        Ok(Entry::LeftOut(_)) => None,
        Err(error) => Some(Err(error)),
    });
    entries.collect()
}

/// Returns the floor of the map that results from the scans at their corrected poses.
fn floor(scans: &[Scan], name: &str) -> Result<Floor, EvalError> {
    let in_map = |cause| EvalError::Mapping { log: name.to_owned(), cause };
    let parameters = mapping::Parameters { cell_m: MAP_CELL_M, extent_m: 400.0, ..Default::default() };
    let mut mapper = Mapper::new(parameters).map_err(in_map)?;
    let mount = Pose::new(0.0, 0.0, 0.0);
    for Scan { truth, message, .. } in scans {
        let pose = Pose::new(truth.x, truth.y, truth.yaw_rad);
        mapper.enter_at(pose, &mapping::Scan::of_message(message, mount)).map_err(in_map)?;
    }
    let mut grid = CellGrid::default();
    mapper.map().write(&mut grid);
    let is_solid = |cell: usize| !grid.free.holds(grid.free.at(cell));
    let map = OccupancyMap::of_cells([grid.width(), grid.height()], grid.cell, grid.origin, is_solid)?;
    Ok(Floor::of_map(&map, name)?)
}

impl Job<'_> {
    /// Localizes the drive in the drawing. Scans taken at positions that the drawing lacks are not compared.
    fn locate(&self) -> Result<Vec<Located>, EvalError> {
        let Driven { floor, scans, .. } = self.driven;
        let drawing = sketchnav_deform::deform(floor, self.degree, self.seed)?;
        let name = format!("{} at degree {}", floor.name, self.degree);
        let options = Options { walls: WallTone::Dark, ..Options::default() };
        let paper = sketchnav_sketch::reading::read(drawing.strokes_json().as_bytes(), &name, &options)?;
        let page = Page { drawing: &drawing, paper: &paper };
        let first = scans.iter().enumerate().find_map(|(i, scan)| Some((i, page.pose(&scan.truth)?)));
        let Some((first, pose)) = first else { return Ok(Vec::new()) };
        let start = Start {
            pose,
            spread_px: options.settings.start_spread_share * paper.diagonal_px(),
            spread_rad: options.settings.start_spread_deg.to_radians(),
        };
        let wrong = |cause| EvalError::Localizer { drawing: name.clone(), cause };
        let mut filter = self.filter(&paper, start).map_err(wrong)?;
        let lattice = Lattice::of(floor, &page);
        let scans = scans[first..].iter();
        Ok(scans
            .filter_map(|scan| {
                let estimate = filter.step(&scan.odometry, &scan.message);
                let room = floor.region_at(&scan.truth.position())?;
                page.point(&scan.truth.position())?;
                let (there, found) = lattice.nearest(&estimate.pose.position())?;
                let error_m = there.distance(&scan.truth.position());
                Some(Located { is_right_room: found == room, error_m })
            })
            .collect())
    }

    fn filter(&self, paper: &DrawnMap, start: Start) -> Result<Filter, LocalizerError> {
        let map = SketchMap {
            width_px: paper.width_px,
            height_px: paper.height_px,
            wall_direction_rad: paper.wall_direction_rad,
            ..SketchMap::zeroed()
        };
        let grid = SketchGrid::of_map(&map, &paper.cells)?;
        let parameters = Parameters::of(self.method);
        let seed = derived(self.seed, &format!("eval/logs/{}/{}", self.driven.floor.name, self.degree));
        Ok(Filter::new(&grid, Mounting::default(), Drive::Differential, parameters, start, seed)?)
    }
}

/// A drawing, both as it was made and as it was read.
struct Page<'a> {
    drawing: &'a DeformedDrawing,
    paper: &'a DrawnMap,
}

impl Page<'_> {
    fn point(&self, place: &Point<World>) -> Option<Point<Sketch>> {
        Some(self.paper.from_image(self.drawing.to_image(&self.drawing.to_sketch(place)?)))
    }

    fn pose(&self, pose: &Pose<World>) -> Option<Pose<Sketch>> {
        let (at, yaw_rad) = (self.point(&pose.position())?, self.drawing.pose_to_sketch(pose)?.yaw_rad);
        Some(Pose::new(at.x, at.y, yaw_rad))
    }
}

/// Points of the floor that lie in rooms: for each, its position in the drawing, its position on the floor, and the index of
/// its room.
struct Lattice(Vec<(Point<Sketch>, Point<World>, usize)>);

impl Lattice {
    fn of(floor: &Floor, page: &Page<'_>) -> Self {
        let corners = || floor.regions().iter().flat_map(|region| &region.polygon).copied();
        let [low, high] = [f64::min, f64::max].map(|extreme| {
            corners().reduce(|a, b| [extreme(a[0], b[0]), extreme(a[1], b[1])]).unwrap_or_default()
        });
        let steps = |axis: usize| {
            let count = ((high[axis] - low[axis]) / LATTICE_M) as usize;
            (0..=count).map(move |i| low[axis] + i as f64 * LATTICE_M)
        };
        let places = steps(0).flat_map(|x| steps(1).map(move |y| Point::<World>::new(x, y)));
        Self(places.filter_map(|at| Some((page.point(&at)?, at, floor.region_at(&at)?))).collect())
    }

    /// Returns the point of the floor that is nearest to `at` in the drawing, and its room.
    fn nearest(&self, at: &Point<Sketch>) -> Option<(Point<World>, usize)> {
        let nearer = |a: &&(Point<Sketch>, Point<World>, usize),
                      b: &&(Point<Sketch>, Point<World>, usize)| {
            a.0.distance(at).total_cmp(&b.0.distance(at))
        };
        self.0.iter().min_by(nearer).map(|(_, there, room)| (*there, *room))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With an exact drawing of the building, the estimates for a real log agree with its corrected poses.
    #[test]
    fn a_real_robot_is_found_in_an_exact_drawing() {
        let folders = Folders { suite: "logs", data: Some(needs::data()), ..Folders::of_checkout() };
        let intel = match logs(&folders) {
            Ok(paths) => paths.into_iter().find(|path| building(path).starts_with("intel")).expect("the log"),
            Err(missing) => return needs::skipped("data", missing),
        };
        let driven = Driven::open(&intel).unwrap();
        let job = Job { driven: &driven, degree: 0.0, seed: 1, method: Method::Beam };
        let located = job.locate().unwrap();
        let right = located.iter().filter(|one| one.is_right_room).count();
        assert!(located.len() > 800 && right * 10 > located.len() * 9, "{right} of {}", located.len());
        assert_eq!(job.locate().unwrap(), located, "the same seed finds the same");
    }

    #[test]
    fn a_row_counts_rooms_over_drawings_and_takes_the_median_error() {
        let located = |is_right_room, error_m| Located { is_right_room, error_m };
        let drawings = [vec![located(true, 0.1), located(true, 0.3)], vec![located(false, 9.0)]];
        let row = values(&drawings);
        assert_eq!((row[3], row[4], row[5]), (0.3, 2.0, 3.0));
        assert!((row[0] - 200.0 / 3.0).abs() < 1e-9 && row[1] <= row[0] && row[0] <= row[2], "{row:?}");
        assert_eq!(values(&[])[..4], [0.0, 0.0, 100.0, 0.0], "nothing was compared");
    }
}

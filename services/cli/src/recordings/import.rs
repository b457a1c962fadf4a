//! Converts laser logs to recordings.

mod summary;

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use bytemuck::Zeroable;
use sketchnav_files::draft::Draft;
use sketchnav_files::{MAP, MAP_PICTURE};
use sketchnav_recordings::carmen::{self, CarmenLog, CarmenScan, Entry, LeftOut, Reading, Shape, Survey};
use sketchnav_recordings::import::{self, Imported, LOG_SYSTEM, Rules};
use sketchnav_recordings::{Writer, sources};
use sketchnav_schemas::codes::{FREE, Process, WALL};
use sketchnav_schemas::geometry::{Pose, Sketch, World, wrap_angle};
use sketchnav_schemas::message::{Header, PosePx};
use sketchnav_schemas::mission::{Mission, Parameters, Place, Start, WorldSource};
use sketchnav_schemas::robot::{Drive, Laser, Limits, OdometryNoise, Robot};
use sketchnav_schemas::run::{Pace, Pad, RunConfig, Split};
use sketchnav_sim::ros_map::{MapInfo, OccupancyMap};
use sketchnav_sketch::messages::{ROUTE, Route, SKETCH, SketchMap};
use sketchnav_sketch::mission::{Aim, SketchMission, SketchTask, WallTone};

use super::args::ImportOptions;
use super::guard::Guard;
use crate::failure::{Failure, OrInput, Outcome};
use crate::folder::plain_name;
use crate::output::say;
use summary::Summary;

/// The spread of the log's starting position if the drawing is the map. It is small, since the position is either a corrected pose
/// from the log or one that was entered by hand.
const MAP_START_SPREAD_PX: f64 = 1.0;
const MAP_START_SPREAD_RAD: f64 = 0.03;
/// Time limit of the task, in seconds. A mission must have a task, although this one is never driven.
const TIME_LIMIT_S: f64 = 180.0;
/// The header of messages that are sent only once.
const ONCE: Header = Header { seq: 1, stamp_ns: 0, source_seq: 0 };

/// The drawing to localize the log in.
struct Drawn {
    sketch: SketchMap,
    cells: Vec<u8>,
    route: Box<Route>,
}

/// A log that is being read.
struct Log<'a> {
    path: &'a Path,
    reading: Reading,
    /// The first scan.
    first: CarmenScan,
    /// The shape of most of the log's scans.
    shape: Shape,
}

/// Converts a log to a recording.
pub fn import(path: &Path, options: &ImportOptions) -> Result<Outcome, Failure> {
    let inputs = [Some(path.to_owned()), options.map.clone(), options.sketch.clone()];
    super::refuse_to_overwrite(inputs.iter().flatten(), &options.output)?;
    let survey = survey(path).with_context(|| path.display().to_string()).or_input()?;
    let log = Log::of(path, &survey).with_context(|| path.display().to_string()).or_input()?;
    let doubts = survey.doubts(&log.reading);
    if let Some(doubt) = doubts.first().filter(|_| options.strict) {
        return Err(Failure::Input(anyhow!("{}: {doubt} (--strict)", path.display())));
    }
    let mut run = run(&log, options)?;
    let drawn = match (&options.sketch, &options.map) {
        (None, Some(map)) => of_map(map, &log, options, &mut run)?,
        _ => of_sketch(&run)?,
    };
    for parameters in &options.set {
        run.mission.parameters.extend(parameters);
    }
    // The recording is made for the localizer, so anything that the localizer would reject is reported now.
    sketchnav_sketch::localizer::Localizer::new(&run).or_input()?;
    let imported = write(&log, options, &run, &drawn)?;
    let way_m = survey.odometry_distance_m(&log.reading);
    Summary::new(&log.reading, way_m, &imported, survey.not_read(&log.reading), &doubts, options)
        .print(options.json)?;
    Ok(Outcome::Success)
}

impl<'a> Log<'a> {
    fn of(path: &'a Path, survey: &Survey) -> anyhow::Result<Self> {
        let reading = survey.reading()?;
        let shape = survey.shapes(&reading).and_then(|shapes| shapes.most_frequent().copied());
        let mut scans = CarmenLog::new(carmen::open(path)?, reading).filter_map(|entry| match entry {
            Ok(Entry::Scan(scan)) => Some(Ok(scan)),
            Ok(Entry::LeftOut(_)) => None,
            Err(error) => Some(Err(error)),
        });
        let first = scans.next().transpose()?.context("expected scans, found none")?;
        let shape = shape.unwrap_or(Shape { count: first.ranges_m.len(), beams: first.beams, scans: 1 });
        Ok(Self { path, reading, first, shape })
    }
}

fn survey(path: &Path) -> anyhow::Result<Survey> {
    Ok(Survey::of(carmen::open(path)?)?)
}

fn write(
    log: &Log<'_>,
    options: &ImportOptions,
    run: &RunConfig,
    drawn: &Drawn,
) -> Result<Imported, Failure> {
    let path = &options.output;
    let (draft, sink) = Draft::begin(path).with_context(|| path.display().to_string()).or_input()?;
    let files = sources::read(&run.mission);
    let mut writer = Writer::create_with(sink, run, &files).context("the recording")?;
    let rules = Rules { range_max_m: options.range_max, is_strict: options.strict };
    let work = || -> anyhow::Result<Imported> {
        let entries = CarmenLog::new(carmen::open(log.path)?, log.reading);
        writer.write(SKETCH, &drawn.sketch, &drawn.cells)?;
        writer.write(ROUTE, &*drawn.route, &[])?;
        let imported = import::import(entries, &rules, &mut writer);
        let strict = if options.strict { " (--strict)" } else { "" };
        let imported = imported.map_err(|error| anyhow!("{error}{strict}"))?;
        if let (0, Some(LeftOut { line, why })) = (imported.scans, imported.left_out.first()) {
            bail!("expected scans that can be recorded, found none; the first is line {line}: {why}");
        }
        Ok(imported)
    };
    let imported = { work }().with_context(|| log.path.display().to_string()).or_input()?;
    let messages = writer.message_count();
    writer.finish().context("the recording")?;
    // Only a recording may be replaced, and nothing else, such as the map's picture.
    Guard::default().place(draft, messages)?;
    Ok(imported)
}

/// Configures the run for the log. It has a task, because every mission must have one, but the task is never driven.
fn run(log: &Log<'_>, options: &ImportOptions) -> Result<RunConfig, Failure> {
    let absolute = |path: &PathBuf| -> anyhow::Result<String> {
        let path = std::path::absolute(path)?;
        path.into_os_string()
            .into_string()
            .map_err(|path| anyhow!("{}: expected a path in UTF-8", path.display()))
    };
    let drawing =
        options.sketch.as_ref().or(options.map.as_ref()).context("expected --map or --sketch").or_input()?;
    let drawing = absolute(drawing).or_input()?;
    let world = options.map.as_ref().map_or(Ok(drawing.clone()), absolute).or_input()?;
    let stem = log.path.file_name().unwrap_or_default().to_string_lossy();
    let name = plain_name(stem.split('.').next().unwrap_or_default());
    // A mission must have a start. Since this one is not driven, the first odometry pose is good enough if the log
    // states no corrected pose.
    let odometry = &log.first.odometry;
    let begin = log.first.reference.unwrap_or(Pose::new(odometry.x, odometry.y, odometry.yaw_rad));
    let Pose { x, y, yaw_rad, .. } = begin;
    let marked = options.start.map(|[column, row, _]| [column, row]);
    let aim = Aim::Goal(marked.unwrap_or_default());
    let task = SketchTask { name: LOG_SYSTEM.to_owned(), aim, time_limit_s: TIME_LIMIT_S };
    let sketch = SketchMission {
        method: None,
        drawing,
        walls: WallTone::Auto,
        start: marked,
        start_heading_deg: options.start.map(|[_, _, heading_deg]| heading_deg),
        places: Default::default(),
        learned_file: None,
        tasks: Vec::new(),
    };
    let there = Place { center: Some([x, y]), radius_m: Some(1.0), polygon: None };
    let mission = Mission {
        name,
        description: String::new(),
        robot: LOG_SYSTEM.to_owned(),
        navigator: sketch.navigator(),
        world: WorldSource { map: Some(world), ..WorldSource::default() },
        start: Start { world: [x, y], world_heading_deg: wrap_angle(yaw_rad).to_degrees() },
        task: vec![task.with_place(there)],
        parameters: Parameters::default(),
    };
    // Checked like a file written by a person.
    let text = toml::to_string(&mission).context("the mission as TOML").or_input()?;
    let mission = Mission::parse(&text).or_input()?;
    SketchMission::of(&mission).or_input()?;
    let robot = robot(&log.shape, options.range_max).or_input()?;
    let (system, recording) = (LOG_SYSTEM.to_owned(), None);
    Ok(RunConfig {
        system,
        method: sketchnav_navigators::method(&mission).to_owned(),
        mission,
        files_of: None,
        robot,
        seed: options.seed,
        pace: Pace::Lockstep,
        recording,
        split: Split::default(),
        pad: Pad::Absent,
        without: Vec::new(),
        faults: Vec::new(),
    })
}

/// Returns a robot of which only the laser is known. Values that the localizer does not use are those of a Pioneer.
fn robot(laser: &Shape, range_max_m: f64) -> anyhow::Result<Robot> {
    let limits =
        Limits { speed_mps: 0.7, yaw_rate_radps: 1.5, acceleration_mps2: 0.5, yaw_acceleration_radps2: 2.0 };
    let robot = Robot {
        laser: Some(Laser {
            model: "of a log".to_owned(),
            field_of_view_deg: laser.beams.span_rad(laser.count).to_degrees(),
            beams: laser.count as u32,
            range_min_m: 0.01,
            range_max_m,
            rate_hz: 10.0,
            noise_m: 0.01,
            noise_per_m: 0.0,
            dropout: 0.0,
            mount_x_m: 0.0,
            mount_y_m: 0.0,
            mount_yaw_deg: 0.0,
        }),
        odometry: Some(OdometryNoise {
            rate_hz: None,
            alpha_speed_speed: 0.01,
            alpha_speed_turn: 0.01,
            alpha_turn_speed: 0.01,
            alpha_turn_turn: 0.01,
            drift_distance: 0.0,
            drift_yaw_radpm: 0.0,
            slips_per_m: 0.0,
        }),
        ..Robot::bare(LOG_SYSTEM, 0.25, 20.0, Drive::Differential, limits)
    };
    Ok(Robot::parse(&toml::to_string(&robot)?)?)
}

/// Turns the map into a drawing with one pixel per cell, and walls where the map is occupied. Unknown cells
/// are transparent to the laser. Both scales are known and are passed to the localizer.
fn of_map(map: &Path, log: &Log<'_>, options: &ImportOptions, run: &mut RunConfig) -> Result<Drawn, Failure> {
    let known = occupied(map).or_input()?;
    let (width, height) = known.raster().size();
    let is_wall = |i: usize| {
        let (x, y) = ((i % width) as i64, (i / width) as i64);
        known.raster().is_solid(x, y) && !known.is_transparent(x, y)
    };
    if known.transparent_share() > 0.0 {
        say!(
            "notice: {}: {:.1} % of the map's picture is transparent, which counts as unknown and is taken as free",
            map.display(),
            100.0 * known.transparent_share()
        );
    }
    let cells: Vec<u8> = (0..height * width).map(|i| if is_wall(i) { WALL } else { FREE }).collect();
    let (resolution, [x0, y0]) = (known.resolution_m(), known.origin_m());
    let in_map =
        |at: Pose<World>| Pose::<Sketch>::new((at.x - x0) / resolution, (at.y - y0) / resolution, at.yaw_rad);
    let marked = |[column, row, heading_deg]: [f64; 3]| {
        Pose::new(column, height as f64 - row, heading_deg.to_radians())
    };
    let start = options.start.map(marked).or(log.first.reference.map(in_map)).with_context(|| {
        let kind = log.reading.kind;
        format!(
            "expected --start COLUMN,ROW,HEADING, where the log begins in the map: {kind} lines do not state a pose"
        )
    });
    let start = start.or_input()?;
    let sketch = SketchMap {
        header: ONCE,
        width_px: width as u32,
        height_px: height as u32,
        wall_direction_rad: 0.0,
        pen_width_px: 1.0,
        start: PosePx::new(&start),
        start_spread_px: MAP_START_SPREAD_PX,
        start_spread_rad: MAP_START_SPREAD_RAD,
    };
    *run.mission.parameters.of_mut(Process::Localizer) = known_scales(&cells, width, resolution);
    Ok(Drawn { sketch, cells, route: Box::new(Route { header: ONCE, ..Route::zeroed() }) })
}

/// Reads the map with only its occupied cells as walls.
fn occupied(path: &Path) -> anyhow::Result<OccupancyMap> {
    let named = || path.display().to_string();
    let mut info = MapInfo::parse(&sketchnav_files::read_to_string(path, MAP).with_context(named)?)
        .with_context(named)?;
    info.free_thresh = info.occupied_thresh;
    let picture = path.with_file_name(&info.image);
    let bytes =
        sketchnav_files::read(&picture, MAP_PICTURE).with_context(|| picture.display().to_string())?;
    OccupancyMap::decode(&info, &bytes).with_context(|| picture.display().to_string())
}

/// Returns the parameters that fix both scales to those of the map, from the first scan to the last.
fn known_scales(cells: &[u8], width: usize, resolution_m: f64) -> toml::Table {
    let walls =
        || cells.iter().enumerate().filter(|(_, cell)| **cell == WALL).map(|(i, _)| [i % width, i / width]);
    let extent = |axis: usize| {
        let (least, most) =
            walls().fold((usize::MAX, 0), |(least, most), at| (least.min(at[axis]), most.max(at[axis])));
        (most + 1).saturating_sub(least)
    };
    let building_size_m = extent(0).max(extent(1)).max(1) as f64 * resolution_m;
    let facts = [
        ("building_size_m", building_size_m),
        ("start_size_share", 1.0),
        ("start_log_scale_spread", 0.0),
        ("start_anisotropy", 0.0),
        ("anisotropic_share", 0.0),
        ("scale_noise", 0.0),
        ("step_scale_noise", 0.0),
        ("perturbation_log_scale", 0.0),
    ];
    facts.into_iter().map(|(key, value)| (key.to_owned(), value.into())).collect()
}

fn of_sketch(run: &RunConfig) -> Result<Drawn, Failure> {
    let (drawing, places) =
        sketchnav_sketch::sketcher::understand(run, &sketchnav_navigators::read_file).or_input()?;
    let mut sketch = SketchMap { header: ONCE, ..SketchMap::zeroed() };
    sketchnav_sketch::reading::fill_sketch(&drawing, &places, &mut sketch);
    let mut route = Box::new(Route { header: ONCE, ..Route::zeroed() });
    sketchnav_sketch::task::fill_route(&places.tasks, &mut route);
    route.header = ONCE;
    sketch.header = ONCE;
    Ok(Drawn { sketch, cells: drawing.cells, route })
}

#[cfg(test)]
mod tests;

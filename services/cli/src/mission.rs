//! Runs a mission: starts its system, shows its progress and reports the result.

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow};
use indicatif::{ProgressBar, ProgressStyle};
use sketchnav_pad::guard::Token;
use sketchnav_pad::token;
use sketchnav_runtime::{Error as RuntimeError, System};
use sketchnav_schemas::codes::TaskState;
use sketchnav_schemas::message::MissionStatus;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::run::{Pad, RunConfig};
use sketchnav_schemas::shown::one_line;
use sketchnav_supervisor::{Error as SystemError, Progress, Supervisor};

use crate::args::{RunOptions, SystemOptions};
use crate::doubts;
use crate::failure::{Failure, OrInput, Outcome, story};
use crate::folder::{RunFolder, create, plain_name};
use crate::launch::{classify, configure, drive_in_learned, grace, lines, load};
use crate::link::Link;
use crate::output::{self, out, say};
use crate::recordings::whole::only_one_in;
use crate::report;
use crate::view::Beside;
use crate::warnings;

/// Minimum width of the column with the tasks' names, in characters.
const LEAST_NAME: usize = 12;

/// Time between updates of the progress line.
const REFRESH: Duration = Duration::from_millis(100);

/// The files of the demo, which are embedded in the program.
const DEMO: [(&str, &[u8]); 3] = [
    ("building-a.toml", include_bytes!("../../../sim/missions/building/building-a.toml")),
    ("building.floor.toml", include_bytes!("../../../sim/missions/building/building.floor.toml")),
    ("sketch-a.svg", include_bytes!("../../../sim/missions/building/sketch-a.svg")),
];

/// The word for the demo wherever a mission file is expected.
const DEMO_WORD: &str = "demo";

/// Returns true if `mission` refers to the embedded demo. An existing file called `demo` takes precedence, but not a folder, which may
/// contain the results of an earlier demo.
pub fn is_demo(mission: &Path) -> bool {
    mission == Path::new(DEMO_WORD) && !mission.is_file()
}

/// Returns the mission of the embedded demo.
pub fn demo_mission() -> anyhow::Result<Mission> {
    Ok(Mission::parse(std::str::from_utf8(DEMO[0].1)?)?)
}

/// Runs the demo. Its files are written beside the results, where the user can edit them and run them again.
pub fn demo(options: &RunOptions) -> Result<Outcome, Failure> {
    let folder = create(&options.system.out, "demo").or_input()?;
    let (mission, robot) = load_demo(&folder, &options.system).inspect_err(|_| folder.discard())?;
    run_in(&folder, mission, robot, options)
}

/// Writes the demo's files into `folder` and reads its mission.
pub fn load_demo(folder: &Path, options: &SystemOptions) -> Result<(Mission, Robot), Failure> {
    for (name, content) in DEMO {
        let path = folder.join(name);
        std::fs::write(&path, content).with_context(|| path.display().to_string()).or_input()?;
    }
    load(&folder.join(DEMO[0].0), options)
}

/// Runs the mission in the file `path`.
pub fn run(path: &Path, options: &RunOptions) -> Result<Outcome, Failure> {
    let (mission, robot) = load(path, &options.system)?;
    let folder = create(&options.system.out, &plain_name(&mission.name)).or_input()?;
    run_in(&folder, mission, robot, options)
}

/// Resumes the mission whose recording is in `folder` and whose supervisor was killed.
pub fn resume(folder: &Path, options: &RunOptions) -> Result<Outcome, Failure> {
    let (system, run) = match System::resume(folder) {
        Err(error @ RuntimeError::NothingToResume { .. }) => return make_up_for(folder, options, error),
        resumed => resumed.map_err(|error| classify(error.into()))?,
    };
    let began = Instant::now();
    // Pages that are still open use the previous token.
    let token = options.token.clone().or_else(|| token::kept(&system));
    let (link, view) = (link(&run, options, token)?, Beside::prepare(options.foxglove)?);
    let lines = lines(&run, link.as_ref()).map_err(classify)?;
    let supervisor = Supervisor::resume(system, lines, grace(&options.system)).map_err(classify)?;
    if let Some(link) = link {
        output::aside(link.text());
    }
    let _view = view.map(|view| view.start(&run.system)).transpose()?;
    follow(supervisor, began, &run, options, (folder, None))
}

/// Completes a run whose supervisor was killed after everything else was done, by writing the table and the
/// pictures. For any other run, returns an error that says how much of its recording exists.
fn make_up_for(folder: &Path, options: &RunOptions, nothing: RuntimeError) -> Result<Outcome, Failure> {
    let Ok(recording) = only_one_in(folder) else { return Err(classify(nothing.into())) };
    let name = recording.display();
    let Some(report) = report::Report::of_ended(&recording, folder)? else {
        return Err(Failure::Input(anyhow!(
            "{nothing}. The mission had not ended; its recording so far was kept: sketchnav judge {name} makes the table, \
             sketchnav report {name} -o report.html the pictures"
        )));
    };
    say!("the mission had ended; the table and the pictures are those of its recording");
    report.print(options.json)?;
    Ok(if report.success() { Outcome::Success } else { Outcome::Short })
}

fn run_in(
    folder: &RunFolder,
    mission: Mission,
    robot: Robot,
    options: &RunOptions,
) -> Result<Outcome, Failure> {
    let pad = if options.pad { Pad::Watches } else { Pad::Absent };
    let mut mission = mission;
    if let Some(learned) = &options.learned {
        drive_in_learned(learned, &mut mission, &robot).inspect_err(|_| folder.discard())?;
    }
    let run = configure(&options.system, folder, mission, robot, (options.speed, pad)).or_input();
    let ready = run.and_then(|run| {
        let doubts = doubts::of(&run, &sketchnav_files::Disk)?;
        let link = link(&run, options, options.token.clone())?;
        Ok((link, Beside::prepare(options.foxglove)?, run, doubts))
    });
    let (link, view, run, doubts) = ready.inspect_err(|_| folder.discard())?;
    if !options.json {
        doubts::print(&doubts);
    }
    drive(&run, (link, view), options, folder)
}

fn drive(
    run: &RunConfig,
    (link, view): (Option<Link>, Option<Beside>),
    options: &RunOptions,
    folder: &RunFolder,
) -> Result<Outcome, Failure> {
    let began = Instant::now();
    let started = lines(run, link.as_ref())
        .and_then(|lines| Supervisor::start_without_order(run, lines, grace(&options.system)));
    let supervisor = started.map_err(|error| {
        folder.discard();
        classify(error)
    })?;
    if let Some(link) = link {
        output::aside(link.text());
    }
    let _view = view.map(|view| view.start(&run.system)).transpose()?;
    follow(supervisor, began, run, options, (folder, Some(folder)))
}

/// Follows the mission to its end and reports the result. `new` is a folder created for this run, which is removed if
/// the mission never began.
fn follow(
    mut supervisor: Supervisor,
    began: Instant,
    run: &RunConfig,
    options: &RunOptions,
    (folder, new): (&Path, Option<&RunFolder>),
) -> Result<Outcome, Failure> {
    let mut warnings = Vec::new();
    // A mission that is resumed has already been started.
    let insists = options.go || new.is_none();
    let watched = watch(&mut supervisor, run, (options.json, insists), &mut warnings);
    let wall = began.elapsed();
    let ended = supervisor.shut_down();
    let progress = match watched {
        Ok(Watched::Ended(progress)) => progress,
        Ok(Watched::Refused(objection)) => {
            if let Some(new) = new {
                new.discard();
            }
            return Err(Failure::Input(anyhow!("{objection}; to start nevertheless, add --go")));
        }
        Err(error) => {
            if let Some(new) = new.filter(|_| supervisor.status().is_none()) {
                new.discard();
                return Err(classify(error));
            }
            say!("the recording so far: {}", run.recording.as_deref().unwrap_or_default());
            if let Some(logs) = supervisor.logs() {
                say!("what the processes printed: {}", logs.display());
            }
            let failure = classify(error);
            return Err(if options.json { broken_off(&supervisor, run, failure)? } else { failure });
        }
    };
    let report = match report::Report::new(run, &supervisor, wall, folder, warnings) {
        Ok(report) => report,
        // The errors of processes are closer to the cause, such as a full disk, so they take precedence.
        Err(failure) => {
            let failure = ended.err().map_or(failure, classify);
            return Err(if options.json { broken_off(&supervisor, run, failure)? } else { failure });
        }
    };
    report.print(options.json)?;
    if let Some(words) = report.incomplete() {
        say!("the recording is incomplete {words}");
    }
    ended.map_err(|error| Failure::Reported(error.into()))?;
    match progress {
        Progress::Interrupted => Err(Failure::Reported(anyhow!("interrupted before the mission ended"))),
        _ if !report.success() => Ok(Outcome::Short),
        _ if report.incomplete().is_some() => Ok(Outcome::Incomplete),
        _ => Ok(Outcome::Success),
    }
}

/// Prints an object with the error, the tasks as the planner reported them, and what was kept of the run, since there is no whole
/// recording to judge. Bad input is returned as it is.
fn broken_off(supervisor: &Supervisor, run: &RunConfig, failure: Failure) -> Result<Failure, Failure> {
    if matches!(failure, Failure::Input(_)) {
        return Ok(failure);
    }
    let error = failure.into_error();
    let task = |status: &MissionStatus| {
        serde_json::json!({
            "name": status.name.as_str(),
            "state": TaskState::from_code(status.state),
            "reason": status.reason.as_str(),
            "time_s": status.task_time_s,
            "path_m": status.task_path_m,
        })
    };
    let tasks: Vec<_> = supervisor.ended_tasks().map(task).collect();
    let report = serde_json::json!({
        "error": story(&error),
        "exit": 3,
        "tasks": tasks,
        "recording": run.recording,
        "logs": supervisor.logs(),
    });
    out!("{report}")?;
    Ok(Failure::Reported(error))
}

/// Returns the link to the page, if the run has one.
fn link(run: &RunConfig, options: &RunOptions, token: Option<Token>) -> Result<Option<Link>, Failure> {
    if run.pad.is_absent() {
        return Ok(None);
    }
    Link::new(&options.site, token).or_input().map(Some)
}

/// How watching a run ended.
enum Watched {
    /// The mission ended, or never began.
    Ended(Progress),
    /// The robot was not started, because the navigator expects to fail.
    Refused(String),
}

/// Shows the mission's progress until it ends. Unless a person `insists`, a mission whose plan the navigator objects to is not
/// started.
fn watch(
    supervisor: &mut Supervisor,
    run: &RunConfig,
    (quiet, insists): (bool, bool),
    warnings: &mut Vec<String>,
) -> Result<Watched, SystemError> {
    let received = warnings::receive(supervisor, run, quiet)?;
    warnings.extend(received.doubts);
    if let Some(ended) = received.ended {
        return Ok(Watched::Ended(ended));
    }
    if let Some(objection) = received.objection.filter(|_| !insists) {
        return Ok(Watched::Refused(objection));
    }
    supervisor.order_start()?;
    let line = progress_line(run, quiet);
    let began = Instant::now();
    let (mut reported, mut mourned) = (0, 0);
    let names = run.mission.task.iter().map(|task| task.name.chars().count());
    let width = names.max().unwrap_or_default().max(LEAST_NAME);
    loop {
        let progress = supervisor.poll(REFRESH)?;
        for status in supervisor.ended_tasks().skip(reported) {
            print_above(&line, quiet, &task_ended(status, width));
            reported += 1;
        }
        for death in &supervisor.survived()[mourned..] {
            print_above(&line, quiet, &format!("  {}; restarted", death.how()));
            mourned += 1;
        }
        line.set_position(reported as u64);
        if let Some(status) = supervisor.status() {
            line.set_message(one_line(on_the_way(status, began.elapsed())));
        }
        if progress != Progress::Running {
            line.finish_and_clear();
            return Ok(Watched::Ended(progress));
        }
    }
}

fn progress_line(run: &RunConfig, quiet: bool) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{prefix:.bold} {bar:20.cyan/dim} {pos}/{len}  {msg}");
    ProgressBar::new(run.mission.task.len() as u64)
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        .with_prefix(one_line(&run.mission.name))
}

/// Prints a line above the progress line or, if there is no terminal, to standard error.
fn print_above(line: &ProgressBar, quiet: bool, text: &str) {
    match (quiet, line.is_hidden()) {
        (true, _) => {}
        (false, true) => say!("{text}"),
        (false, false) => line.println(one_line(text)),
    }
}

/// Describes the end of a task in one line. The task's name is padded to `width` characters.
fn task_ended(status: &MissionStatus, width: usize) -> String {
    let state = TaskState::from_code(status.state).map_or("?", TaskState::word);
    let (name, reason) = (status.name.as_str(), status.reason.as_str());
    let (time, path) = (status.task_time_s, status.task_path_m);
    format!("  {:>2}. {name:<width$} {state:<9} {time:6.1} s {path:6.1} m  {reason}", status.task + 1)
}

fn on_the_way(status: &MissionStatus, wall: Duration) -> String {
    let simulated_s = status.header.stamp_ns as f64 / 1e9;
    let state = TaskState::from_code(status.state).map_or("?", TaskState::word);
    let (name, reason) = (status.name.as_str(), status.reason.as_str());
    let how = if reason.is_empty() { state } else { reason };
    format!(
        "{name}: {how}; {:.1} m to go at {:.2} m/s; {simulated_s:.0} s simulated, {:.0} × real time",
        status.remaining_m,
        status.speed_mps,
        simulated_s / wall.as_secs_f64().max(1e-3),
    )
}

//! Drives missions in one process and prints how each task ended.
//!
//! `cargo run --release -p sketchnav-lab --example rehearse -- --help` lists the options.

#[path = "../tests/support/mod.rs"]
mod support;

use std::num::ParseIntError;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use sketchnav_lab::judge::judge;
use sketchnav_lab::judge::log::Log;
use sketchnav_rehearsal::Rehearsal;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sketch::method::Method;
use sketchnav_sketch::mission::SketchMission;

/// Drive missions in one process and print how each task ended.
#[derive(Debug, Parser)]
#[command(
    after_help = "Example: rehearse sim/missions/building/building-a.toml --seeds 1..5 --set 'particles = 800'
Exit codes: 0 all tasks reached, 1 some not, 2 bad input or usage."
)]
struct Options {
    /// Mission files.
    #[arg(required = true)]
    missions: Vec<PathBuf>,
    /// Seed, or first and last seed, to drive with.
    #[arg(long, value_name = "A..B", default_value = "1", value_parser = seeds)]
    seeds: RangeInclusive<u64>,
    /// Method to use instead of the mission's: outline, beam, boniardi-2015, boniardi-2015-fixed-scale or behzadian-2015.
    #[arg(long)]
    method: Option<Method>,
    /// Override a parameter of the localizer (may be repeated).
    #[arg(long, value_name = "KEY = VALUE")]
    set: Vec<String>,
    /// Use the true floor plan as the drawing.
    #[arg(long)]
    control: bool,
    /// Also print the tasks that were reached, and the estimate every five seconds.
    #[arg(long)]
    verbose: bool,
}

fn seeds(text: &str) -> Result<RangeInclusive<u64>, String> {
    let (first, last) = text.split_once("..").unwrap_or((text, text));
    let number = |text: &str| text.parse().map_err(|error: ParseIntError| format!("`{text}`: {error}"));
    let (first, last): (u64, u64) = (number(first)?, number(last)?);
    if first > last {
        return Err(format!("expected the smaller seed first: {last}..{first}"));
    }
    Ok(first..=last)
}

fn main() -> ExitCode {
    match rehearse_all(&Options::parse()) {
        Ok((reached, tasks)) => {
            println!("{reached} of {tasks} tasks");
            ExitCode::from(u8::from(reached < tasks))
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// Returns the number of tasks that were reached, and the number of all tasks.
fn rehearse_all(options: &Options) -> anyhow::Result<(usize, usize)> {
    let drawing = tempfile::Builder::new().prefix("control-").suffix(".svg").tempfile()?;
    let set: toml::Table = toml::from_str(&options.set.join("\n"))?;
    let (mut reached, mut tasks) = (0, 0);
    for path in &options.missions {
        for seed in options.seeds.clone() {
            let (mut mission, robot) = sketchnav_sim::mission_file::load(path)?;
            if options.control {
                mission = support::true_to_scale(&mission, drawing.path())?;
            }
            if let Some(method) = options.method {
                SketchMission { method: Some(method), ..SketchMission::of(&mission)? }.write_to(&mut mission);
            }
            mission.parameters.of_mut(Process::Localizer).extend(set.clone());
            let (sum, of) = rehearse(path, mission, robot, seed, options.verbose)?;
            (reached, tasks) = (reached + sum, tasks + of);
        }
    }
    Ok((reached, tasks))
}

fn rehearse(
    path: &Path,
    mission: Mission,
    robot: Robot,
    seed: u64,
    verbose: bool,
) -> anyhow::Result<(usize, usize)> {
    let run = RunConfig::lockstep("rehearsal", mission, robot, seed);
    let mut log = Log::default();
    let began = Instant::now();
    Rehearsal::new(&run)?.run(&mut log)?;
    let wall_s = began.elapsed().as_secs_f64();
    let verdict = judge(&run.mission, &log.truth, &log.status, &log.contacts);
    let reached = verdict.tasks.iter().filter(|task| task.reached).count();
    println!(
        "{} seed {seed}: {reached} of {}, {:.0} s, {:.0} × real time",
        path.display(),
        verdict.tasks.len(),
        verdict.sim_seconds,
        verdict.sim_seconds / wall_s
    );
    for task in verdict.tasks.iter().filter(|task| verbose || !task.reached) {
        println!("    {task:?}");
    }
    if verbose {
        for (estimate, truth) in log.estimates.iter().zip(&log.truth).step_by(50) {
            let (e, t) = (estimate.pose.pose(), truth.pose());
            println!(
                "    {:6.1} s: sketch ({:7.1}, {:7.1}) {:6.1}°, scales {:5.1} {:5.1}, fit {:6.2}, ess {:6.1} | world ({:6.2}, {:6.2}) {:6.1}°",
                estimate.header.stamp_ns as f64 / 1e9,
                e.x,
                e.y,
                e.yaw_rad.to_degrees(),
                estimate.scale_a_pxpm,
                estimate.scale_b_pxpm,
                estimate.fit,
                estimate.effective_sample_size,
                t.x,
                t.y,
                t.yaw_rad.to_degrees(),
            );
        }
    }
    Ok((reached, verdict.tasks.len()))
}

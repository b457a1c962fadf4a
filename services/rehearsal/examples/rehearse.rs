//! Drives missions in one process and prints how each task ended.
//!
//! `cargo run --release -p sketchnav-rehearsal --example rehearse -- MISSION… [--seeds A..B]
//! [--method M] [--set 'particles = 800'] [--control] [--verbose]`
//!
//! `--set` changes parameters of the localizer; `--control` takes the true floor plan for the drawing.

#[path = "../tests/support/mod.rs"]
mod support;

use std::path::Path;
use std::time::Instant;

use sketchnav_recordings::judge::judge;
use sketchnav_rehearsal::Rehearsal;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::run::{Pace, Pad, RunConfig};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut seeds = 1..=1;
    let mut missions = Vec::new();
    let (mut verbose, mut control) = (false, false);
    let drawing = std::env::temp_dir().join(format!("control-{}.svg", std::process::id()));
    let mut method = None;
    let mut set = String::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--seeds" => {
                let text = arguments.next().ok_or("--seeds: expected A..B")?;
                let (a, b) = text.split_once("..").ok_or("--seeds: expected A..B")?;
                seeds = a.parse()?..=b.parse()?;
            }
            "--method" => method = Some(arguments.next().ok_or("--method: expected a method")?.parse()?),
            "--set" => set = set + &arguments.next().ok_or("--set: expected KEY = VALUE")? + "\n",
            "--control" => control = true,
            "--verbose" => verbose = true,
            _ => missions.push(argument),
        }
    }
    let (mut reached, mut tasks) = (0, 0);
    for path in &missions {
        for seed in seeds.clone() {
            let (mut mission, robot) = sketchnav_sim::mission_file::load(Path::new(path))?;
            if control {
                mission = support::true_to_scale(&mission, &drawing)?;
            }
            mission.method = method.unwrap_or(mission.method);
            mission.parameters.localizer.extend(toml::from_str::<toml::Table>(&set)?);
            let (sum, of) = rehearse(path, mission, robot, seed, verbose)?;
            (reached, tasks) = (reached + sum, tasks + of);
        }
    }
    println!("{reached} of {tasks} tasks");
    Ok(())
}

fn rehearse(
    path: &str,
    mission: Mission,
    robot: Robot,
    seed: u64,
    verbose: bool,
) -> Result<(usize, usize), Box<dyn std::error::Error>> {
    let run = RunConfig {
        system: "rehearsal".into(),
        mission,
        robot,
        seed,
        pace: Pace::Lockstep,
        recording: None,
        pad: Pad::Absent,
    };
    let mut log = support::Log::default();
    let began = Instant::now();
    Rehearsal::new(&run)?.run(&mut log)?;
    let wall_s = began.elapsed().as_secs_f64();
    let verdict = judge(&run.mission, &log.truth, &log.status, &log.contacts);
    let reached = verdict.tasks.iter().filter(|task| task.reached).count();
    println!(
        "{path} seed {seed}: {reached} of {}, {:.0} s, {:.0} × real time",
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

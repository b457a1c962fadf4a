//! Measures how fast the whole process tree drives the demo mission in lockstep, and which processes take the time. For
//! comparison, the same stages are also called in turn by one process that records nothing. The difference combines the
//! gain from two cores with the cost of separate processes.
//!
//! `cargo bench --bench process_tree` prints a line for each run, and the shares of the fastest run.

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use serde_json::Value;
use sketchnav_rehearsal::{Onlooker, Rehearsal, Tap};
use sketchnav_schemas::channels::ChannelSpec;
use sketchnav_schemas::erased;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sim::mission_file;

const RUNS: u64 = 5;

fn main() {
    // `cargo test --benches` only checks that the benchmark starts.
    if std::env::args().any(|argument| argument == "--test") {
        return;
    }
    let runs: Vec<Value> = (1..=RUNS).map(run).collect();
    for report in &runs {
        println!(
            "seed {}: {:.0} s simulated in {:.2} s on the clock: {:.1} × real time, {} messages lost",
            report["seed"],
            number(&report["sim_seconds"]),
            number(&report["wall_seconds"]),
            number(&report["real_time_factor"]),
            report["lost_messages"],
        );
    }
    let alone: Vec<f64> = (1..=RUNS).map(in_one_process).collect();
    let ratio = |(report, alone): (&Value, &f64)| number(&report["real_time_factor"]) / alone;
    let mut ratios: Vec<f64> = runs.iter().zip(&alone).map(ratio).collect();
    ratios.sort_by(f64::total_cmp);
    println!(
        "the same stages in one process: {:.1} × real time at best; processes to one: {:.2} (median of {RUNS})",
        alone.iter().copied().fold(0.0, f64::max),
        ratios[ratios.len() / 2],
    );
    let factor = |report: &&Value| number(&report["real_time_factor"]);
    let fastest = runs.iter().max_by(|a, b| factor(a).total_cmp(&factor(b)));
    if let Some(report) = fastest {
        shares(report);
    }
}

fn run(seed: u64) -> Value {
    let out = tempfile::tempdir().expect("a folder for the recordings");
    let output = Command::new(env!("CARGO_BIN_EXE_sketchnav"))
        .args(["demo", "--json", "--seed", &seed.to_string(), "--out"])
        .arg(out.path())
        .output()
        .expect("sketchnav starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

/// The latest timestamp, in nanoseconds.
struct Last(u64);

impl Tap for Last {
    fn see(&mut self, _: &'static ChannelSpec, message: &[u8], _: &[u8]) {
        self.0 = self.0.max(erased::header(message).stamp_ns);
    }
}

impl Onlooker for Last {}

/// Returns the number of simulated seconds per second that the stages achieve when one process calls them in turn.
fn in_one_process(seed: u64) -> f64 {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("sim/missions/building/building-a.toml");
    let (mission, robot) = mission_file::load(&path).expect("the demo's mission");
    let run = RunConfig::lockstep("alone", mission, robot, seed);
    let began = Instant::now();
    let mut last = Last(0);
    Rehearsal::new(&run).and_then(|rehearsal| rehearsal.run(&mut last)).expect("the demo");
    last.0 as f64 * 1e-9 / began.elapsed().as_secs_f64()
}

fn shares(report: &Value) {
    let processes = report["processes"].as_array().cloned().unwrap_or_default();
    let total: f64 = processes.iter().map(|process| number(&process["busy_s"])).sum();
    println!("busy time of the fastest run, {:.1} × real time:", number(&report["real_time_factor"]));
    for process in &processes {
        let (busy, steps) = (number(&process["busy_s"]), number(&process["steps"]));
        println!(
            "  {:<10} {:5.1} %  {busy:6.3} s in {steps:5} steps, {:7.0} µs a step",
            process["process"].as_str().unwrap_or_default(),
            100.0 * busy / total,
            1e6 * busy / steps.max(1.0),
        );
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

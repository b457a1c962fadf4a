//! How fast the whole process tree drives the demo mission in lockstep, and who needs the time.
//!
//! `cargo bench --bench process_tree` prints a line a run and the shares of the fastest.

use std::process::Command;

use serde_json::Value;

const RUNS: u64 = 5;

fn main() {
    // `cargo test --benches` only wants to know that it starts.
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

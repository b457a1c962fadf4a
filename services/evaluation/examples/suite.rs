//! Drives trials of a suite and prints how they ended; of one trial, what the robot said on its way.
//!
//! `cargo run -p sketchnav-evaluation --example suite -- people --method outline --only 01/a/0-4`

use std::path::PathBuf;

use clap::Parser;
use sketchnav_evaluation::experiments::jobs::Job;
use sketchnav_evaluation::experiments::run;
use sketchnav_evaluation::experiments::statistics::Tally;
use sketchnav_evaluation::experiments::suite::Folders;
use sketchnav_evaluation::experiments::{suites, trial_picture};
use sketchnav_schemas::time::seconds;

/// Drive trials of a suite.
#[derive(Debug, Parser)]
struct Options {
    suite: String,
    #[arg(long, default_value = "outline")]
    method: String,
    #[arg(long)]
    data: Option<PathBuf>,
    #[arg(long, value_delimiter = ',')]
    drawings: Vec<String>,
    #[arg(long)]
    sample: Option<usize>,
    #[arg(long)]
    only: Option<String>,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Draws each trial into this folder.
    #[arg(long)]
    pictures: Option<PathBuf>,
    /// Parameters of the planner, `key = value`.
    #[arg(long)]
    set: Vec<String>,
}

fn main() -> anyhow::Result<()> {
    let options = Options::parse();
    let data = options.data.clone().or_else(|| std::env::var_os("SKETCHNAV_DATA").map(PathBuf::from));
    let mut suite = suites::load(&options.suite, &Folders { project: PathBuf::from("."), data })?;
    if !options.drawings.is_empty() {
        suite.trials.retain(|trial| options.drawings.contains(&trial.drawing));
    }
    if let Some(count) = options.sample {
        suite.sample(count);
    }
    if let Some(only) = &options.only {
        suite.trials.retain(|trial| trial.name == *only);
    }
    let set: toml::Table = toml::from_str(&options.set.join("\n"))?;
    for trial in &mut suite.trials {
        let table = trial.mission.parameters.of_mut(sketchnav_schemas::codes::Process::Planner);
        table.extend(set.clone());
    }
    let mut all = Vec::new();
    for trial in &suite.trials {
        let job = Job::new(trial, &options.method, 1, options.seed);
        let runs = run::drive(trial, job.method, job.seed)?;
        for driven in &runs {
            if let Some(folder) = &options.pictures {
                for (what, svg) in trial_picture::draw(trial, driven)? {
                    std::fs::write(folder.join(format!("{}-{what}.svg", trial.name.replace('/', "-"))), svg)?;
                }
            }
            if options.only.is_some() {
                let mut last = String::new();
                for (status, truth) in driven.log.status.iter().zip(&driven.log.truth) {
                    let words = status.reason.as_str();
                    if words != last {
                        let pose = truth.pose();
                        let at_s = seconds(status.header.stamp_ns);
                        println!("{at_s:6.1} s ({:6.2}, {:6.2}) {words}", pose.x, pose.y);
                        words.clone_into(&mut last);
                    }
                }
            }
            for ended in run::outcomes(trial, job.method, 1, driven) {
                if !ended.is_success() || options.only.is_some() {
                    let [x, y, _] = ended.end.unwrap_or([f64::NAN; 3]);
                    println!(
                        "{} {}: {} after {:.0} s, {:.0} m at ({x:.1}, {y:.1}), {:.1} m off: {}",
                        ended.id,
                        ended.task,
                        ended.kind.word(),
                        ended.time_s,
                        ended.path_m,
                        ended.final_error_m.unwrap_or(f64::NAN),
                        ended.reason
                    );
                } else {
                    println!("{} ok: {}", ended.id, ended.reason);
                }
                all.push(ended);
            }
        }
    }
    for drawing in suite.drawings() {
        let tally = Tally::of(all.iter().filter(|ended| ended.drawing == drawing));
        println!("{drawing} {} of {}", tally.reached, tally.attempts);
    }
    let tally = Tally::of(all.iter());
    println!("all {} of {}, {:?}; {tally:?}", tally.reached, tally.attempts, tally.interval());
    Ok(())
}

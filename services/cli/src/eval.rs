//! Runs experiments and prints their tables.

pub mod all;
mod elsewhere;
pub mod machine;
mod page;
mod parts;
mod processes;
mod study;
mod table;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow};
use indicatif::{ProgressBar, ProgressStyle};
use sketchnav_lab::EvalError;
use sketchnav_lab::experiments::jobs::{Job, run_all};
use sketchnav_lab::experiments::report::{Report, examples};
use sketchnav_lab::experiments::statistics::Tally;
use sketchnav_lab::experiments::suite::{Folders, Suite};
use sketchnav_lab::experiments::{TaskOutcome as Ended, run, studies, suites, trial_picture};

use crate::args::EvalOptions;
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::{self, out, say};
pub use elsewhere::Simulator;
use parts::Origin;
pub use parts::parse_jobs;
use processes::Check;

/// Runs the suite or the study called `name`.
pub fn eval(name: &str, options: &EvalOptions) -> Result<Outcome, Failure> {
    if name == all::WORD {
        return all::run(options);
    }
    all::refuse_for_one(name, options).or_input()?;
    if let Some(study) = studies::find(name) {
        return study::run(study, options);
    }
    let folders = folders(options).or_input()?;
    let mut suite = suites::load(name, &folders).map_err(classify)?;
    suite.shows_costs |= options.cost;
    choose(&mut suite, options)?;
    let methods = methods(&suite, options).or_input()?;
    if let Some(simulator) = elsewhere::open(options, &folders.project).or_input()? {
        simulator.take(&mut suite, &methods).map_err(anyhow::Error::msg).or_input()?;
    }
    let jobs = jobs(&suite, &methods, options)?;
    if jobs.is_empty() {
        let words = [&["no trial is left to drive".to_owned()], &suite.notices[..]].concat().join("; ");
        return Err(Failure::Input(anyhow!("suite {name}: {words}")));
    }
    refuse_missing_folder(options.output.as_deref())?;
    let origin = || Origin::of(&suite, &jobs, options.seed, &folders).or_input();
    if options.list_jobs {
        parts::list(&origin()?, &jobs, options.json)?;
        return Ok(Outcome::Success);
    }
    if let (Some(numbers), Some(path)) = (&options.job, &options.output) {
        let chosen = parts::chosen(&jobs, numbers).or_input()?;
        parts::write(path, origin()?, numbers, drive_each(chosen, options)?)?;
        parts::say(path, numbers, options.json)?;
        return Ok(Outcome::Success);
    }
    let began = Instant::now();
    let outcomes = match &options.merge {
        Some(parts) => parts::merge(parts, &origin()?, &options.accept).or_input()?,
        None => drive_each(&jobs, options)?,
    };
    let outcomes = outcomes.concat();
    let wall = began.elapsed();
    // Print what was driven in any case, since it may have taken hours.
    let check = options.check_processes.map(|count| processes::check(&jobs, count));
    let checked = check.as_ref().and_then(|check| check.as_ref().ok());
    let driven = Driven { suite: &suite, methods: &methods, jobs: &jobs, outcomes: &outcomes };
    let written = write_files(&driven, options);
    if options.json {
        out!("{}", json(&driven, options, checked, Some(wall))?)?;
    } else {
        print(&driven, options, wall)?;
        if let Some(Check { checked, identical, .. }) = checked {
            out!(
                "repeated by processes: {identical} of {checked} runs with the same messages, byte for byte"
            )?;
        }
    }
    written.map_err(Failure::Reported)?;
    let is_same = check.transpose()?.is_none_or(|check| check.identical == check.checked);
    Ok(if is_same { Outcome::Success } else { Outcome::Short })
}

/// The environment variable that names the data folder if `--data` is absent.
const DATA_VARIABLE: &str = "SKETCHNAV_DATA";
/// The folder of the missions in a checkout.
const MISSIONS: &str = "sim/missions";

fn folders(options: &EvalOptions) -> anyhow::Result<Folders> {
    let data = options.data.clone().or_else(|| std::env::var_os(DATA_VARIABLE).map(PathBuf::from));
    // Other processes also drive trials and are given the paths of their files, so the paths must be absolute.
    let data = data.map(std::path::absolute).transpose().context("the folder of the data")?;
    Ok(Folders { suite: "", project: project(options.project.as_deref())?, data })
}

fn project(named: Option<&Path>) -> anyhow::Result<PathBuf> {
    let has_missions = |folder: &&Path| folder.join(MISSIONS).is_dir();
    if let Some(folder) = named {
        let missing = || format!("--project {}: expected a checkout with {MISSIONS} in it", folder.display());
        let found = Some(folder).filter(has_missions).with_context(missing)?;
        return std::path::absolute(found).context("the current folder no longer exists");
    }
    let here = std::env::current_dir().context("the current folder no longer exists")?;
    let missing = || {
        format!(
            "expected {MISSIONS} in the current folder or above it: name a checkout of sketchnav by --project DIR"
        )
    };
    here.ancestors().find(has_missions).map(Path::to_path_buf).with_context(missing)
}

/// Classifies an error as bad input, since the user can correct data that a suite cannot read.
fn classify(error: EvalError) -> Failure {
    Failure::Input(error.into())
}

/// Selects the trials that the user asked for.
fn choose(suite: &mut Suite, options: &EvalOptions) -> Result<(), Failure> {
    let drawings = suite.drawings();
    if let Some(unknown) = options.drawings.iter().find(|wanted| !drawings.contains(wanted)) {
        let error = anyhow!("drawing {unknown:?}: expected one of {}", drawings.join(", "));
        return Err(Failure::Input(error));
    }
    if !options.drawings.is_empty() {
        suite.trials.retain(|trial| options.drawings.contains(&trial.drawing));
    }
    for trial in &mut suite.trials {
        options.parameters.iter().for_each(|set| trial.mission.parameters.extend(set));
    }
    if let Some(count) = options.sample {
        suite.sample(count);
    }
    Ok(())
}

/// Returns the methods that the user requested. By default, these are the suite's own methods or, if it does
/// not specify any, the first method of its kind of navigator.
fn methods(suite: &Suite, options: &EvalOptions) -> anyhow::Result<Vec<String>> {
    let Some(first) = suite.trials.first() else { return Ok(options.methods.clone()) };
    let known = sketchnav_navigators::of(&first.mission)?.methods;
    if let Some(unknown) = options.methods.iter().find(|wanted| !known.contains(&wanted.as_str())) {
        let words = known.join(", ");
        return Err(anyhow!("--method: suite {} expected one of {words}, found {unknown:?}", suite.name));
    }
    if !options.methods.is_empty() {
        return Ok(options.methods.clone());
    }
    if !suite.methods.is_empty() {
        return Ok(suite.methods.clone());
    }
    // If all trials prescribe one method, they are driven by it regardless of the user's choice, so the table is headed with its
    // name.
    let own = first.method.as_deref();
    let own = own.filter(|own| suite.trials.iter().all(|trial| trial.method.as_deref() == Some(own)));
    Ok(own.or(known.first().copied()).map(str::to_owned).into_iter().collect())
}

fn jobs<'a>(suite: &'a Suite, methods: &'a [String], options: &EvalOptions) -> Result<Vec<Job<'a>>, Failure> {
    let repetitions = 1..=options.trials.unwrap_or(suite.repetitions);
    let all = methods.iter().flat_map(|method| {
        let repetitions = repetitions.clone();
        let trials = repetitions.flat_map(|n| suite.trials.iter().map(move |trial| (trial, n)));
        let driven = trials.filter(move |(trial, _)| suite.is_driven(trial, method, methods));
        driven.map(move |(trial, n)| Job::new(trial, method, n, options.seed))
    });
    let Some(only) = &options.only else { return Ok(all.collect()) };
    let (name, repetition) = only.split_once('#').unwrap_or((only, "1"));
    let repetition: u32 = repetition.parse().with_context(|| format!("--only {only}")).or_input()?;
    let trial = suite.trials.iter().find(|trial| trial.name == name);
    let trial =
        trial.ok_or_else(|| anyhow!("--only {only}: no trial of that name in this suite")).or_input()?;
    let methods = methods.iter().filter(|method| suite.is_driven(trial, method, methods));
    Ok(methods.map(|method| Job::new(trial, method, repetition, options.seed)).collect())
}

/// Drives the jobs and returns the outcomes of each.
fn drive_each(jobs: &[Job<'_>], options: &EvalOptions) -> Result<Vec<Vec<Ended>>, Failure> {
    let bar = progress_bar(jobs.len(), options.json);
    let so_far = std::sync::Mutex::new(Vec::new());
    let progress = |ended: &[Ended]| {
        let mut so_far = so_far.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        so_far.extend_from_slice(ended);
        let tally = Tally::of(so_far.iter());
        bar.set_message(format!("{} of {} reached", tally.reached, tally.attempts));
        bar.inc(1);
    };
    let outcomes = run_all(jobs, options.jobs(), &progress).map_err(classify)?;
    bar.finish_and_clear();
    Ok(outcomes)
}

/// Rejects an output in a missing folder before anything is driven. If the folder is removed later, the results go to
/// standard output.
fn refuse_missing_folder(output: Option<&Path>) -> Result<(), Failure> {
    let folder = output.and_then(Path::parent).filter(|folder| !folder.as_os_str().is_empty());
    match folder.filter(|folder| !folder.is_dir()) {
        Some(missing) => {
            let words =
                format!("--output: expected a file in an existing folder, found none: {}", missing.display());
            Err(Failure::Input(anyhow!(words)))
        }
        None => Ok(()),
    }
}

/// The jobs of a suite, with their outcomes.
struct Driven<'a> {
    suite: &'a Suite,
    methods: &'a [String],
    jobs: &'a [Job<'a>],
    outcomes: &'a [Ended],
}

/// Writes the pictures and the report that the user asked for.
fn write_files(driven: &Driven<'_>, options: &EvalOptions) -> anyhow::Result<()> {
    let drawn = options.pictures.as_ref().map_or(Ok(()), |folder| draw(driven.jobs, folder));
    let reported = options.output.as_ref().map_or(Ok(()), |path| report(driven, path));
    drawn.and(reported)
}

fn progress_bar(length: usize, quiet: bool) -> ProgressBar {
    bar_of(length, quiet, "{bar:30.cyan/dim} {pos}/{len} trials, {msg}; {eta} to go")
}

fn bar_of(length: usize, quiet: bool, template: &str) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template(template);
    ProgressBar::new(length as u64).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// Drives each job once more to draw it. The drive is identical, so there is no need to keep the logs of thousands of
/// trials.
fn draw(jobs: &[Job<'_>], folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    for job in jobs {
        let runs = run::drive(job.trial, job.method, job.seed)?;
        for driven in &runs {
            let name = format!("{}-{}-{}", job.trial.name, job.repetition, job.method).replace('/', "-");
            for (what, svg) in trial_picture::draw(job.trial, driven)? {
                let path = folder.join(format!("{name}-{}-{what}.svg", driven.first_task + 1));
                sketchnav_files::write(&path, svg).with_context(|| path.display().to_string())?;
                say!("picture    {}", path.display());
            }
        }
    }
    Ok(())
}

fn report(driven: &Driven<'_>, path: &Path) -> anyhow::Result<()> {
    let &Driven { suite, methods, jobs, outcomes } = driven;
    let examples = examples(suite, jobs, outcomes)?;
    let command = command_line();
    let report = Report { suite, methods, outcomes, examples: &examples, command: &command };
    sketchnav_files::write(path, report.page()).with_context(|| path.display().to_string())?;
    say!("report     {}", path.display());
    Ok(())
}

/// Options that determine where the outcomes come from. Each takes a value. They are not shown, so that the page of a merged
/// experiment equals that of one driven on a single machine.
const WHERE_FROM: [&str; 2] = ["--merge", "--accept"];

/// Returns the command line as it was typed, without the program's path and the options in [`WHERE_FROM`].
fn command_line() -> String {
    let mut is_value = false;
    let is_shown = |word: &String| {
        let is_option = WHERE_FROM.contains(&word.as_str());
        let is_both = WHERE_FROM.iter().any(|option| word.starts_with(&format!("{option}=")));
        let is_shown = !(is_option || is_both || is_value);
        is_value = is_option;
        is_shown
    };
    let words = crate::WORDS.get().into_iter().flatten().map(|word| word.to_string_lossy().into_owned());
    let words = words.skip(1).filter(is_shown).map(|word| match word.contains(char::is_whitespace) {
        true => format!("'{word}'"),
        false => word,
    });
    std::iter::once("sketchnav".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

fn print(driven: &Driven<'_>, options: &EvalOptions, wall: Duration) -> anyhow::Result<()> {
    let &Driven { suite, methods, outcomes, .. } = driven;
    out!("{}: {}", suite.name, suite.title)?;
    for notice in &suite.notices {
        out!("note: {notice}")?;
    }
    for method in methods {
        let of_method: Vec<_> = outcomes.iter().filter(|ended| ended.method == *method).collect();
        out!("")?;
        out!("method {method}, seed {}", options.seed)?;
        output::lines(table::of_suite(suite, &of_method))?;
    }
    for section in suite.sections(outcomes) {
        out!("")?;
        out!("{}", section.title)?;
        output::lines(table::of_words(&section.table))?;
        section.words.iter().try_for_each(|words| out!("{words}"))?;
    }
    if options.verbose {
        print_failures(outcomes)?;
    }
    // Only the wall-clock time differs between two runs, so it goes to standard error.
    say!("{:.0} s by the clock", wall.as_secs_f64());
    out!("{} tasks", outcomes.len())
}

fn print_failures(outcomes: &[Ended]) -> anyhow::Result<()> {
    for ended in outcomes.iter().filter(|ended| !ended.is_success()) {
        let [x, y, _] = ended.end.unwrap_or([f64::NAN; 3]);
        out!(
            "{} {}, seed {}: {}: {}: {} after {:.0} s and {:.1} m at ({x:.2}, {y:.2}) m, {:.1} m off: {}",
            ended.id,
            ended.method,
            ended.seed,
            ended.task,
            ended.kind.word(),
            if ended.collisions > 0 {
                format!("{} collisions", ended.collisions)
            } else {
                "no collision".into()
            },
            ended.time_s,
            ended.path_m,
            ended.final_error_m.unwrap_or(f64::NAN),
            ended.reason
        )?;
    }
    Ok(())
}

fn json(
    driven: &Driven<'_>,
    options: &EvalOptions,
    check: Option<&Check>,
    wall: Option<Duration>,
) -> anyhow::Result<String> {
    let &Driven { suite, methods, outcomes, .. } = driven;
    let methods = methods.iter().map(|method| {
        let counted = |ended: &&Ended| suite.counts(ended);
        let of_method = || outcomes.iter().filter(move |ended| ended.method == *method).filter(counted);
        let drawings = suite.drawings().into_iter().map(|drawing| {
            let tally = Tally::of(of_method().filter(|ended| ended.drawing == drawing));
            (drawing, figures(tally))
        });
        let drawings: serde_json::Map<_, _> = drawings.collect();
        serde_json::json!({ "method": method, "total": figures(Tally::of(of_method())), "drawings": drawings })
    });
    let object = serde_json::json!({
        "suite": suite.name,
        "seed": options.seed,
        "notices": suite.notices,
        "methods": methods.collect::<Vec<_>>(),
        "sections": suite.sections(outcomes),
        "outcomes": outcomes,
        "processes": check,
        "wall_seconds": wall.map(|wall| wall.as_secs_f64()),
    });
    Ok(serde_json::to_string(&object)?)
}

fn figures(tally: Tally) -> serde_json::Value {
    serde_json::json!({
        "counts": tally,
        "rate": tally.rate(),
        "interval": tally.interval(),
        "share_of_failures_known": tally.share_that_knows(),
    })
}

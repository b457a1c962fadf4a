//! Runs every suite and study into a folder, one after another, and writes a Markdown and a JSON file for
//! each, as well as a list.
//!
//! The jobs of a suite are driven in small parts, each of which is written completely or not at all, so an
//! interrupted run can resume where it left off. Parts from another experiment, build or machine are rejected
//! as by `--merge`. With `--world`, the suites are driven in a simulator, and their figures are kept apart
//! from those of the project's own world. A study is skipped if its JSON file was written by the same program
//! for the same size. `--page` fills in the figures of pages.

use std::fmt::Write as _;
use std::ops::RangeInclusive;
use std::path::Path;

use anyhow::{Context, anyhow};
use serde_json::{Value, json};
use sketchnav_files::PAGE;
use sketchnav_lab::EvalError;
use sketchnav_lab::experiments::TaskOutcome as Ended;
use sketchnav_lab::experiments::elsewhere::Elsewhere;
use sketchnav_lab::experiments::figures::{Experiment, Method};
use sketchnav_lab::experiments::studies::{Size, Study, report};
use sketchnav_lab::experiments::{studies, suites, table};

use super::page::Pages;
use super::parts::{self, Origin};
use super::{Driven, choose, classify, drive_each, elsewhere, folders, jobs, machine, methods, study};
use crate::args::EvalOptions;
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::{out, say};

/// The word that stands for all experiments on the command line.
pub const WORD: &str = "all";
/// Number of jobs in a part, and thus the maximum that an interrupted run loses.
const JOBS_OF_A_PART: usize = 32;
/// The folder of the parts, inside the results folder.
const PARTS: &str = "parts";

/// An entry of the list: an experiment and its figures.
struct Entry {
    name: String,
    title: String,
    experiment: Experiment,
    /// The size of the experiment, if it is a study.
    size: Option<String>,
}

impl Entry {
    fn figures(&self) -> Vec<String> {
        self.experiment.methods.iter().map(Method::words).chain(self.size.clone()).collect()
    }
}

/// Runs all experiments. Those whose data are missing are skipped and listed.
pub fn run(options: &EvalOptions) -> Result<Outcome, Failure> {
    refuse_meaningless_options(options).or_input()?;
    let folder = options.output.as_deref();
    let folder = folder
        .ok_or_else(|| anyhow!("eval {WORD}: expected -o DIR, the folder of the results"))
        .or_input()?;
    let wanted = wanted(options)?;
    let simulator = match options.world {
        Some(_) => elsewhere::open(options, &folders(options).or_input()?.project).or_input()?,
        None => None,
    };
    let mut pages = Pages::open(&options.pages)?;
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string()).or_input()?;
    let (mut entries, mut left_out) = (Vec::<Entry>::new(), Vec::new());
    for name in wanted {
        let driven = match studies::find(name) {
            Some(study) => of_study(study, folder, options)?,
            None => of_suite(name, simulator.as_ref(), folder, options)?,
        };
        match driven {
            Ok(entry) => {
                pages.put(&entry.name, entry.experiment.clone())?;
                entries.push(entry);
            }
            Err(why) => left_out.push(format!("`{name}`: {why}")),
        }
        write(&folder.join("README.md"), &list(&entries, &left_out, options)?)?;
    }
    pages.print_outdated()?;
    left_out.iter().try_for_each(|why| out!("left out: {why}"))?;
    out!("{} of {} experiments in {}", entries.len(), entries.len() + left_out.len(), folder.display())?;
    Ok(if left_out.is_empty() { Outcome::Success } else { Outcome::Short })
}

/// Returns the suites and studies that the user asked for, which are all of them by default.
fn wanted(options: &EvalOptions) -> Result<Vec<&'static str>, Failure> {
    let known: Vec<_> = suites::names().chain(studies::names()).collect();
    if let Some(found) = options.suites.iter().find(|wanted| !known.contains(&wanted.as_str())) {
        return Err(classify(EvalError::Suite { found: found.clone(), known: known.join(", ") }));
    }
    let is_wanted = |name: &&str| {
        let is_named = options.suites.iter().any(|word| word == name);
        let is_driven = options.world.is_none() || studies::find(name).is_none();
        is_driven && (options.suites.is_empty() || is_named)
    };
    Ok(known.into_iter().filter(is_wanted).collect())
}

/// Rejects options that only `eval all` takes.
pub fn refuse_for_one(name: &str, options: &EvalOptions) -> anyhow::Result<()> {
    let given = [("--suites", !options.suites.is_empty()), ("--page", !options.pages.is_empty())];
    match given.into_iter().find(|(_, is_given)| *is_given) {
        Some((option, _)) => Err(anyhow!("{option}: expected eval {WORD}, found eval {name}")),
        None => Ok(()),
    }
}

/// Rejects options that only make sense for a single suite, or for parts driven on other machines.
fn refuse_meaningless_options(options: &EvalOptions) -> anyhow::Result<()> {
    let given = [
        ("--method", !options.methods.is_empty()),
        // In the project's own world, they would replace the figures of all drawings.
        ("--drawings", !options.drawings.is_empty() && options.world.is_none()),
        ("--set", !options.parameters.is_empty()),
        ("--cost", options.cost),
        ("--only", options.only.is_some()),
        ("--verbose", options.verbose),
        ("--pictures", options.pictures.is_some()),
        ("--check-processes", options.check_processes.is_some()),
        ("--list-jobs", options.list_jobs),
        ("--job", options.job.is_some()),
        ("--merge", options.merge.is_some()),
        ("--json", options.json),
    ];
    match given.into_iter().find(|(_, is_given)| *is_given) {
        Some((option, _)) => Err(anyhow!("{option}: eval {WORD} has no such option")),
        None => Ok(()),
    }
}

/// Drives a suite, or returns a message if its data are missing.
fn of_suite(
    name: &'static str,
    simulator: Option<&Elsewhere>,
    folder: &Path,
    options: &EvalOptions,
) -> Result<Result<Entry, String>, Failure> {
    let all_folders = folders(options).or_input()?;
    let mut suite = match suites::load(name, &all_folders) {
        Err(error @ EvalError::NoData { .. }) => return Ok(Err(error.to_string())),
        loaded => loaded.map_err(classify)?,
    };
    choose(&mut suite, options)?;
    let methods = match suites::compared(name) {
        // One drive there takes as long as dozens here.
        [first, ..] if simulator.is_some() => vec![(*first).to_owned()],
        [] => methods(&suite, options).or_input()?,
        compared => compared.iter().map(|&method| method.to_owned()).collect(),
    };
    if let Some(Err(why)) = simulator.map(|simulator| simulator.take(&mut suite, &methods)) {
        return Ok(Err(why));
    }
    let jobs = jobs(&suite, &methods, options)?;
    let origin = Origin::of(&suite, &jobs, options.seed, &all_folders).or_input()?;
    let parts_folder = folder.join(PARTS).join(&suite.name);
    std::fs::create_dir_all(&parts_folder).with_context(|| parts_folder.display().to_string()).or_input()?;
    for numbers in ranges(jobs.len()) {
        let path = parts_folder.join(format!("{:06}.json", numbers.start()));
        if path.is_file() {
            continue;
        }
        say!("{}: jobs {}-{} of {}", suite.name, numbers.start(), numbers.end(), jobs.len());
        let driven = drive_each(parts::chosen(&jobs, &numbers).or_input()?, options)?;
        parts::write(&path, origin.clone(), &numbers, driven)?;
    }
    let outcomes = parts::merge(&parts_folder, &origin, &options.accept).or_input()?.concat();
    let driven = Driven { suite: &suite, methods: &methods, jobs: &jobs, outcomes: &outcomes };
    let command = command(name, &methods, options);
    write(&folder.join(format!("{}.json", suite.name)), &super::json(&driven, options, None, None)?)?;
    write(&folder.join(format!("{}.md", suite.name)), &page(&driven, &command))?;
    let of_methods = methods.iter().map(|method| Method::of(&suite, method, &outcomes)).collect();
    let program = machine::program()?;
    let notices = suite.notices.clone();
    let sections = suite.sections(&outcomes).into_iter().map(|section| section.table).collect();
    let methods = of_methods;
    let experiment = Experiment { command, program, methods, notices, tables: Vec::new(), sections };
    let title = suite.title.clone();
    Ok(Ok(Entry { name: suite.name, title, experiment, size: None }))
}

/// Returns the range of job numbers of each part.
fn ranges(count: usize) -> impl Iterator<Item = RangeInclusive<usize>> {
    (1..=count).step_by(JOBS_OF_A_PART).map(move |first| first..=count.min(first + JOBS_OF_A_PART - 1))
}

fn of_method<'a>(driven: &'a Driven<'_>, method: &str) -> Vec<&'a Ended> {
    driven.outcomes.iter().filter(|ended| ended.method == method).collect()
}

fn page(driven: &Driven<'_>, command: &str) -> String {
    let mut text = heading(&driven.suite.name, &driven.suite.title, command);
    for notice in &driven.suite.notices {
        let _ = writeln!(text, "{notice}\n");
    }
    for method in driven.methods {
        let outcomes = of_method(driven, method);
        let _ = writeln!(text, "## `{method}`\n");
        for table in table::of_suite(driven.suite, &outcomes) {
            text += &table.markdown();
        }
        text.extend(table::note(driven.suite, &outcomes).map(|note| note + "\n\n"));
    }
    for section in driven.suite.sections(driven.outcomes) {
        let _ = writeln!(text, "## {}\n", section.title);
        text += &section.table.markdown();
        text.extend(section.words.iter().map(|words| format!("{words}\n\n")));
    }
    text
}

fn heading(name: &str, title: &str, command: &str) -> String {
    format!("# {name}\n\n{title}\n\n```text\n{command}\n```\n\n")
}

/// Returns the command that repeats the figures of one experiment.
fn command(name: &str, methods: &[String], options: &EvalOptions) -> String {
    let given = [
        options.world.map(|simulator| format!("--world {}", simulator.word())),
        (!options.drawings.is_empty()).then(|| format!("--drawings {}", options.drawings.join(","))),
        (!methods.is_empty()).then(|| format!("--method {}", methods.join(","))),
        options.trials.map(|trials| format!("--trials {trials}")),
        options.sample.map(|sample| format!("--sample {sample}")),
        Some(format!("--seed {}", options.seed)),
    ];
    given.into_iter().flatten().fold(format!("sketchnav eval {name}"), |line, option| line + " " + &option)
}

/// Runs a study unless its figures are already there, or returns a message if its data are missing.
fn of_study(
    study: &'static Study,
    folder: &Path,
    options: &EvalOptions,
) -> Result<Result<Entry, String>, Failure> {
    let size = Size { worlds: options.trials.map_or(study.worlds, u64::from), seed: options.seed };
    let (data, page) =
        (folder.join(format!("{}.json", study.name)), folder.join(format!("{}.md", study.name)));
    let program = machine::program()?;
    let command = command(study.name, &[], options);
    let entry = |tables| Entry {
        name: study.name.to_owned(),
        title: study.title.to_owned(),
        experiment: Experiment {
            command: command.clone(),
            program: program.clone(),
            methods: Vec::new(),
            notices: Vec::new(),
            tables,
            sections: Vec::new(),
        },
        size: Some(format!("{} worlds", size.worlds)),
    };
    if let Some(tables) = tables_of(&data, size, &program).filter(|_| page.is_file()) {
        return Ok(Ok(entry(tables)));
    }
    say!("{}: {} worlds", study.name, size.worlds);
    let figures = match study.run(&folders(options).or_input()?, size, options.jobs()) {
        Err(error @ EvalError::NoData { .. }) => return Ok(Err(error.to_string())),
        figures => figures.map_err(classify)?,
    };
    let mut text = heading(study.name, study.title, &command);
    for figure in &figures {
        let _ = writeln!(text, "## {}\n", figure.table.title);
        text += &report::words(&figure.table).markdown();
    }
    write(&page, &text)?;
    let mut object = study::json(study, size, &figures);
    object["program"] = json!(program);
    write(&data, &object.to_string())?;
    Ok(Ok(entry(figures.into_iter().map(|figure| figure.table).collect())))
}

/// Reads the tables in a study's file, if they are of the given size and by this program.
fn tables_of(data: &Path, size: Size, program: &str) -> Option<Vec<studies::Table>> {
    let bytes = sketchnav_files::read(data, PAGE).ok()?;
    let mut object = serde_json::from_slice::<Value>(&bytes).ok()?;
    let is_of =
        object["worlds"] == size.worlds && object["seed"] == size.seed && object["program"] == program;
    is_of.then(|| serde_json::from_value(object["figures"].take()).ok()).flatten()
}

/// Returns the list of all experiments, as Markdown.
fn list(entries: &[Entry], left_out: &[String], options: &EvalOptions) -> Result<String, Failure> {
    let program = machine::program()?;
    let mut text = format!(
        "# All experiments\n\nSeed {}, program {program}. Shares have Wilson's 95 % interval. Made by `sketchnav eval {WORD}`.\n\n",
        options.seed
    );
    let header = ["experiment", "what is driven", "figures"].map(str::to_owned);
    let row = |entry: &Entry| {
        vec![format!("[{0}]({0}.md)", entry.name), entry.title.clone(), entry.figures().join("<br>")]
    };
    text += &table::Table { header: header.to_vec(), rows: entries.iter().map(row).collect() }.markdown();
    for why in left_out {
        let _ = writeln!(text, "Left out: {why}\n");
    }
    Ok(text)
}

/// Writes a file either completely or not at all.
pub fn write(path: &Path, text: &str) -> Result<(), Failure> {
    sketchnav_files::write(path, text).with_context(|| path.display().to_string()).map_err(Failure::Other)
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::MetadataExt;

    use super::*;

    fn options(folder: &Path) -> EvalOptions {
        let words = ["--trials", "1", "--sample", "1", "-o", folder.to_str().unwrap(), "--project"];
        let checkout = env!("CARGO_MANIFEST_DIR");
        EvalOptions::of_words(&[&words[..], &[checkout]].concat())
    }

    fn drive(folder: &Path) -> Entry {
        of_suite("laboratory", None, folder, &options(folder)).unwrap().unwrap()
    }

    /// Regression test: driving all suites takes hours, and a run that was interrupted used to start again from the beginning.
    #[test]
    fn an_interrupted_evaluation_resumes_from_its_parts() {
        let folder = tempfile::tempdir().unwrap();
        let first = drive(folder.path());
        assert!(
            first.figures().len() == 2 && first.figures()[0].starts_with("`outline` "),
            "{:?}",
            first.figures()
        );
        let part = folder.path().join("parts/laboratory/000001.json");
        let driven = std::fs::metadata(&part).unwrap().ino();
        let page = std::fs::read_to_string(folder.path().join("laboratory.md")).unwrap();
        assert!(page.contains(
            "sketchnav eval laboratory --method outline,boniardi-2015 --trials 1 --sample 1 --seed 1"
        ));
        std::fs::remove_file(folder.path().join("laboratory.md")).unwrap();
        assert_eq!(drive(folder.path()).figures(), first.figures());
        assert_eq!(std::fs::metadata(&part).unwrap().ino(), driven, "it was driven again");
        assert_eq!(std::fs::read_to_string(folder.path().join("laboratory.md")).unwrap(), page);
    }

    #[test]
    fn a_part_of_other_trials_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        drive(folder.path());
        let other = EvalOptions { seed: 2, ..options(folder.path()) };
        let refused = of_suite("laboratory", None, folder.path(), &other).err().unwrap();
        assert!(
            matches!(refused, Failure::Input(error) if error.to_string().contains("seed: expected 2, found 1"))
        );
    }

    #[test]
    fn compared_methods_exist() {
        let known: Vec<_> = sketchnav_navigators::all().flat_map(|navigator| navigator.methods).collect();
        for name in suites::names() {
            assert!(suites::compared(name).iter().all(|method| known.contains(&method)), "{name}");
        }
    }

    #[test]
    fn an_unknown_suite_is_bad_input_and_given_suites_are_driven_alone() {
        let folder = tempfile::tempdir().unwrap();
        let suites = |names: &[&str]| EvalOptions {
            suites: names.iter().map(|&name| name.to_owned()).collect(),
            ..options(folder.path())
        };
        assert_eq!(wanted(&suites(&["routes", "people"])).unwrap(), ["people", "routes"]);
        assert_eq!(wanted(&suites(&[])).unwrap().len(), suites::names().count() + studies::names().count());
        let Failure::Input(error) = wanted(&suites(&["peopl"])).unwrap_err() else { panic!() };
        assert!(error.to_string().contains("suite \"peopl\": expected one of ablation"), "{error}");
        let error = refuse_for_one("people", &suites(&["routes"])).unwrap_err().to_string();
        assert_eq!(error, "--suites: expected eval all, found eval people");
    }

    #[test]
    fn parts_contain_each_job_once() {
        let numbers: Vec<_> = ranges(70).flatten().collect();
        assert_eq!(numbers, (1..=70).collect::<Vec<_>>());
        assert_eq!(ranges(0).count(), 0);
    }
}

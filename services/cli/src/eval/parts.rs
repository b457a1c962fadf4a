//! Drives experiments in parts. Each job can run on any machine, and the merged parts equal the result of one machine
//! that drove all jobs.
//!
//! A part identifies its experiment by a fingerprint of everything that determines its outcomes. Parts from another
//! experiment are always rejected. Parts from another kind of machine or another build are rejected unless the user
//! accepts them.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, ensure};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sketchnav_files::PART;
use sketchnav_lab::experiments::TaskOutcome as Ended;
use sketchnav_lab::experiments::jobs::Job;
use sketchnav_lab::experiments::studies::{Attempt, ByWorld, Size, Study, World};
use sketchnav_lab::experiments::suite::{Folders, Suite};
use sketchnav_lab::experiments::trial::Trial;
use sketchnav_recordings::sources;

use super::machine::{self, Machine};
use crate::args::Foreign;
use crate::output::{out, say};

/// The extension of part files.
const EXTENSION: &str = "json";

/// An experiment, with the program and the machine that drive it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Origin {
    suite: String,
    seed: u64,
    /// The number of jobs in the experiment.
    jobs: usize,
    /// A checksum of everything that determines the outcomes: trials, methods, seeds, parameters and files.
    fingerprint: u32,
    program: String,
    machine: Machine,
}

/// The outcomes of some jobs of an experiment.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Part<T> {
    #[serde(rename = "experiment")]
    origin: Origin,
    /// The outcomes of each job, by its number, from 1.
    outcomes: BTreeMap<usize, Vec<T>>,
}

/// The result of a job, as stored in parts.
pub trait Yield: Serialize + DeserializeOwned + Clone + PartialEq {
    /// Returns a copy without the values that depend on the clock.
    fn timeless(&self) -> Self {
        self.clone()
    }
}

impl Yield for Ended {
    fn timeless(&self) -> Self {
        let mut ended = self.clone();
        ended.cost.busy_s = 0.0;
        ended
    }
}

impl Yield for Attempt {}

impl Origin {
    /// Returns the origin of the parts that result if these jobs are driven on this machine.
    pub fn of(suite: &Suite, jobs: &[Job<'_>], seed: u64, folders: &Folders) -> anyhow::Result<Self> {
        Self::here(&suite.name, seed, jobs.len(), fingerprint(jobs, folders)?)
    }

    /// Returns the origin of the parts that result if a study is run on this machine.
    pub fn of_study(study: &Study, by_world: &ByWorld, size: Size) -> anyhow::Result<Self> {
        let cases = format!("{:?}", (by_world.cases)()?);
        let jobs = by_world.worlds(size).len();
        Self::here(study.name, size.seed, jobs, crc32fast::hash(cases.as_bytes()))
    }

    fn here(name: &str, seed: u64, jobs: usize, fingerprint: u32) -> anyhow::Result<Self> {
        let (program, machine) = (machine::program()?, Machine::this());
        Ok(Self { suite: name.to_owned(), seed, jobs, fingerprint, program, machine })
    }

    /// Explains why parts of the origin `other` cannot be merged into this experiment as it is driven here, or returns `None` if
    /// they can.
    fn refuses(&self, other: &Self, accepted: &[Foreign]) -> Option<String> {
        let differs = |key: &str, own: &dyn std::fmt::Display, found: &dyn std::fmt::Display| {
            format!("{key}: expected {own}, found {found}")
        };
        if self.suite != other.suite {
            return Some(differs("suite", &self.suite, &other.suite));
        }
        if self.seed != other.seed {
            return Some(differs("seed", &self.seed, &other.seed));
        }
        if (self.jobs, self.fingerprint) != (other.jobs, other.fingerprint) {
            let words =
                "other trials, methods, parameters, data or missions: merge with the options of the jobs";
            return Some(format!(
                "experiment: expected {} jobs with the options given here, found {} with {words}",
                self.jobs, other.jobs
            ));
        }
        if self.program != other.program && !accepted.contains(&Foreign::Program) {
            let difference = differs("program", &self.program, &other.program);
            return Some(format!("{difference}; --accept program accepts it anyway"));
        }
        if self.machine != other.machine && !accepted.contains(&Foreign::Machine) {
            let difference = differs("machine", &self.machine, &other.machine);
            return Some(format!(
                "{difference}; --accept machine accepts it anyway, although the last bits may differ"
            ));
        }
        None
    }
}

/// Computes the fingerprint of the jobs. Files are in different folders on different machines, so it covers their
/// contents but not their folders.
fn fingerprint(jobs: &[Job<'_>], folders: &Folders) -> anyhow::Result<u32> {
    let mut hasher = crc32fast::Hasher::new();
    for job in jobs {
        let mut text = inputs(job)?;
        for (folder, word) in [(Some(&folders.project), "<project>"), (folders.data.as_ref(), "<data>")] {
            if let Some(folder) = folder.and_then(|folder| folder.to_str()) {
                text = text.replace(folder, word);
            }
        }
        hasher.update(text.as_bytes());
        // Drawings that were made for a trial are not in files. Their bytes are part of the job's inputs.
        for file in sources::read(&job.trial.mission) {
            hasher.update(file.name.as_bytes());
            hasher.update(&file.data);
        }
    }
    Ok(hasher.finalize())
}

/// Lists everything that determines the drives, except for the contents of files.
fn inputs(job: &Job<'_>) -> anyhow::Result<String> {
    let Trial {
        name,
        drawing,
        mission,
        robot,
        sheet,
        bytes,
        method,
        ends_with_contact,
        tasks_are_one,
        thinking_scans,
        person,
        elsewhere,
        ..
    } = job.trial;
    let bytes = bytes.as_ref().map(|page| crc32fast::hash(page.origin()));
    let sheet =
        sheet.as_ref().map(|sheet| (&sheet.restarts, sheet.start_error, sheet.correspondence.is_some()));
    let ends = (ends_with_contact, tasks_are_one);
    let how = (name, drawing, job.method, method, job.repetition, job.seed, ends, thinking_scans);
    let what = serde_json::to_string(&(mission, robot))?;
    Ok(format!("{how:?} {sheet:?} {bytes:?} {person:?} {elsewhere:?} {what}"))
}

/// Prints the jobs with their numbers.
pub fn list(origin: &Origin, jobs: &[Job<'_>], json: bool) -> anyhow::Result<()> {
    let row = |(i, job): (usize, &Job<'_>)| {
        let (method, repetition) = (job.trial.method.as_deref().unwrap_or(job.method), job.repetition);
        (i + 1, format!("{}#{repetition}", job.trial.name), method.to_owned(), job.seed)
    };
    let rows = jobs.iter().enumerate().map(row);
    if json {
        let object = |(job, trial, method, seed)| serde_json::json!({ "job": job, "trial": trial, "method": method, "seed": seed });
        let jobs: Vec<_> = rows.map(object).collect();
        return out!("{}", serde_json::json!({ "experiment": origin, "jobs": jobs }));
    }
    for (job, trial, method, seed) in rows {
        out!("{job:>5}  {trial}  {method}  seed {seed}")?;
    }
    Ok(())
}

/// Prints the worlds of a study with the numbers of their jobs.
pub fn list_worlds(origin: &Origin, worlds: &[World], json: bool) -> anyhow::Result<()> {
    if json {
        let object = |(job, seed): &World| serde_json::json!({ "job": job, "seed": seed });
        let jobs: Vec<_> = worlds.iter().map(object).collect();
        return out!("{}", serde_json::json!({ "experiment": origin, "jobs": jobs }));
    }
    worlds.iter().try_for_each(|(job, seed)| out!("{job:>5}  world of seed {seed}"))
}

/// Returns the jobs with these numbers.
///
/// # Errors
/// If there are no jobs with these numbers.
pub fn chosen<'a, T>(jobs: &'a [T], numbers: &RangeInclusive<usize>) -> anyhow::Result<&'a [T]> {
    let (first, last) = (*numbers.start(), *numbers.end());
    let found = jobs.get(first - 1..last);
    found.ok_or_else(|| anyhow!("--job: expected numbers from 1 to {}, found {first}-{last}", jobs.len()))
}

/// Writes a part with the outcomes of some jobs. The file is written either completely or not at all.
pub fn write<T: Yield>(
    path: &Path,
    origin: Origin,
    numbers: &RangeInclusive<usize>,
    outcomes: Vec<Vec<T>>,
) -> anyhow::Result<()> {
    let part = Part { origin, outcomes: numbers.clone().zip(outcomes).collect() };
    sketchnav_files::write(path, serde_json::to_vec(&part)?).with_context(|| path.display().to_string())
}

/// Prints where a part with these jobs was written.
pub fn say(path: &Path, numbers: &RangeInclusive<usize>, json: bool) -> anyhow::Result<()> {
    if json {
        return out!(
            "{}",
            serde_json::json!({ "part": path, "first": numbers.start(), "last": numbers.end() })
        );
    }
    say!("part       {}", path.display());
    Ok(())
}

/// Reads the parts in `folder` and returns the outcomes of each job, in order.
///
/// # Errors
/// If a file is not a part or belongs to something else, a job is missing, or a job has two different outcomes.
pub fn merge<T: Yield>(folder: &Path, origin: &Origin, accepted: &[Foreign]) -> anyhow::Result<Vec<Vec<T>>> {
    let mut found: BTreeMap<usize, (PathBuf, Vec<T>)> = BTreeMap::new();
    for path in files_in(folder)? {
        let part: Part<T> = read(&path)?;
        if let Some(why) = origin.refuses(&part.origin, accepted) {
            return Err(anyhow!("{}: {why}", path.display()));
        }
        for (job, outcomes) in part.outcomes {
            let range = 1..=origin.jobs;
            ensure!(
                range.contains(&job),
                "{}: expected jobs from 1 to {}, found {job}",
                path.display(),
                origin.jobs
            );
            match found.get(&job) {
                // A job may have been driven twice, for example again after its worker was lost, but then both outcomes
                // are equal.
                Some((_, before)) if is_same(before, &outcomes) => {}
                Some((other, _)) => {
                    let (path, other) = (path.display(), other.display());
                    return Err(anyhow!(
                        "{path}: expected the outcomes of job {job} as in {other}, found others"
                    ));
                }
                None => drop(found.insert(job, (path.clone(), outcomes))),
            }
        }
    }
    let missing: Vec<_> = (1..=origin.jobs).filter(|job| !found.contains_key(job)).collect();
    ensure!(
        missing.is_empty(),
        "{}: expected all jobs from 1 to {}, found none of {}",
        folder.display(),
        origin.jobs,
        ranges(&missing)
    );
    Ok(found.into_values().map(|(_, outcomes)| outcomes).collect())
}

/// Returns true if two outcomes of one job agree in everything that does not depend on the clock.
fn is_same<T: Yield>(a: &[T], b: &[T]) -> bool {
    a.iter().map(T::timeless).eq(b.iter().map(T::timeless))
}

fn read<T: Yield>(path: &Path) -> anyhow::Result<Part<T>> {
    let bytes = sketchnav_files::read(path, PART).with_context(|| path.display().to_string())?;
    serde_json::from_slice(&bytes)
        .with_context(|| format!("{}: expected a part that `eval --job` wrote", path.display()))
}

fn files_in(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let named = || format!("--merge {}", folder.display());
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(named)? {
        let path = entry.with_context(named)?.path();
        if path.extension().is_some_and(|extension| extension == EXTENSION) {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// Formats numbers as ranges, such as `1, 4-6`.
fn ranges(numbers: &[usize]) -> String {
    let mut ranges: Vec<(usize, usize)> = Vec::new();
    for &number in numbers {
        match ranges.last_mut() {
            Some((_, last)) if *last + 1 == number => *last = number,
            _ => ranges.push((number, number)),
        }
    }
    let word = |(first, last): (usize, usize)| {
        if first == last { first.to_string() } else { format!("{first}-{last}") }
    };
    ranges.into_iter().map(word).collect::<Vec<_>>().join(", ")
}

/// Parses a job number `K` or a range `A-B`.
pub fn parse_jobs(text: &str) -> Result<RangeInclusive<usize>, String> {
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    let number = |text: &str| text.parse::<usize>().ok().filter(|number| *number >= 1);
    match (number(first), number(last)) {
        (Some(first), Some(last)) if first <= last => Ok(first..=last),
        _ => Err("expected the number of a job, from 1, or a range as 3-10".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn origin() -> Origin {
        let machine = Machine::this();
        let program = "0.1.0 7".to_owned();
        Origin { suite: "people".into(), seed: 1, jobs: 3, fingerprint: 9, program, machine }
    }

    fn refused(change: impl Fn(&mut Origin), accepted: &[Foreign]) -> Option<String> {
        let mut other = origin();
        change(&mut other);
        origin().refuses(&other, accepted)
    }

    #[test]
    fn parts_of_another_experiment_are_refused_with_the_reason() {
        assert_eq!(refused(|_| {}, &[]), None);
        type Change = fn(&mut Origin);
        let changes: [(Change, &str); 6] = [
            (|o| o.suite = "routes".into(), "suite: expected people, found routes"),
            (|o| o.seed = 2, "seed: expected 1, found 2"),
            (|o| o.jobs = 4, "experiment: expected 3 jobs"),
            (|o| o.fingerprint = 8, "merge with the options of the jobs"),
            (|o| o.program = "0.1.0 8".into(), "--accept program"),
            (|o| o.machine.library = "glibc 2.17".into(), "--accept machine"),
        ];
        let both = [Foreign::Machine, Foreign::Program];
        for (change, words) in changes {
            let why = refused(change, &[]).unwrap();
            assert!(why.contains(words), "{why}");
            let is_taken = words.starts_with("--accept");
            assert_eq!(refused(change, &both).is_none(), is_taken, "{words}");
        }
    }

    #[test]
    fn numbers_of_jobs_are_read_and_printed_as_ranges() {
        assert_eq!((parse_jobs("3"), parse_jobs("3-10")), (Ok(3..=3), Ok(3..=10)));
        for wrong in ["0", "", "-", "5-3", "a", "1-2-3", "-1"] {
            assert!(parse_jobs(wrong).is_err(), "{wrong}");
        }
        assert_eq!(ranges(&[1, 3, 4, 5, 9]), "1, 3-5, 9");
    }
}

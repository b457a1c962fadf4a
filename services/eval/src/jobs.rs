//! Many trials on several threads; the result does not depend on how many.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use sketchnav_schemas::method::Method;

use crate::error::EvalError;
use crate::outcome::Outcome;
use crate::run;
use crate::trial::{Trial, derived};

/// One repetition of a trial by a method.
#[derive(Debug, Clone, Copy)]
pub struct Job<'a> {
    /// What.
    pub trial: &'a Trial,
    /// How.
    pub method: Method,
    /// Which repetition, from 1.
    pub repetition: u32,
    /// Its seed.
    pub seed: u64,
}

impl<'a> Job<'a> {
    /// The repetition's seed comes from the suite's seed and the names alone; methods share it, so that
    /// they are compared in the same world with the same noise.
    pub fn new(trial: &'a Trial, method: Method, repetition: u32, suite_seed: u64) -> Self {
        let seed = derived(suite_seed, &format!("eval/{}#{repetition}", trial.name));
        Self { trial, method, repetition, seed }
    }
}

/// Does all jobs, `threads` at a time; the outcomes stand in the order of the jobs. `progress` hears of
/// each job as it is done.
///
/// # Errors
/// The first, in the order of the jobs, that could not begin.
pub fn run_all(
    jobs: &[Job<'_>],
    threads: usize,
    progress: &(dyn Fn(&[Outcome]) + Sync),
) -> Result<Vec<Outcome>, EvalError> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::with_capacity(jobs.len()));
    let work = || {
        while let Some((i, job)) = take(&next, jobs) {
            let result = run::run(job.trial, job.method, job.repetition, job.seed);
            if let Ok(outcomes) = &result {
                progress(outcomes);
            }
            done.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).push((i, result));
        }
    };
    thread::scope(|scope| {
        for _ in 0..threads.clamp(1, jobs.len().max(1)) {
            scope.spawn(work);
        }
    });
    let mut done = done.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    done.sort_by_key(|(i, _)| *i);
    let all: Result<Vec<_>, _> = done.into_iter().map(|(_, result)| result).collect();
    Ok(all?.concat())
}

fn take<'a, 'b>(next: &AtomicUsize, jobs: &'b [Job<'a>]) -> Option<(usize, &'b Job<'a>)> {
    let i = next.fetch_add(1, Ordering::Relaxed);
    jobs.get(i).map(|job| (i, job))
}

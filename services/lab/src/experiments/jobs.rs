//! Runs many trials on several threads. The results do not depend on the number of threads.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use crate::error::EvalError;
use crate::experiments::outcome::TaskOutcome;
use crate::experiments::run;
use crate::experiments::trial::{Trial, derived};

/// One repetition of a trial, driven by one method.
#[derive(Debug, Clone, Copy)]
pub struct Job<'a> {
    /// The trial.
    pub trial: &'a Trial,
    /// Name of the method, as the navigator calls it.
    pub method: &'a str,
    /// Number of the repetition, from 1.
    pub repetition: u32,
    /// Seed of the repetition.
    pub seed: u64,
}

impl<'a> Job<'a> {
    /// Creates a job. Its seed depends only on the suite's seed, the trial's name and the repetition. All methods and all variants
    /// of a trial use the same seed, so that they are compared in the same world with the same noise.
    pub fn new(trial: &'a Trial, method: &'a str, repetition: u32, suite_seed: u64) -> Self {
        let name = trial.variant_of.as_ref().unwrap_or(&trial.name);
        let seed = derived(suite_seed, &format!("eval/{name}#{repetition}"));
        Self { trial, method, repetition, seed }
    }
}

/// Runs all jobs, `threads` at a time, and returns the outcomes in the order of the jobs. Calls `progress` whenever a job is done.
///
/// # Errors
/// The first error, in the order of the jobs, of a trial that could not start.
pub fn run_all(
    jobs: &[Job<'_>],
    threads: usize,
    progress: &(dyn Fn(&[TaskOutcome]) + Sync),
) -> Result<Vec<Vec<TaskOutcome>>, EvalError> {
    let run = |job: &Job<'_>| {
        let result = run::run(job.trial, job.method, job.repetition, job.seed);
        if let Ok(outcomes) = &result {
            progress(outcomes);
        }
        result
    };
    in_parallel(jobs, threads, run).into_iter().collect()
}

/// Calls `work` for each item, `threads` at a time, and returns the results in the order of the items.
pub fn in_parallel<T: Sync, R: Send>(items: &[T], threads: usize, work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::with_capacity(items.len()));
    let each = || {
        while let Some((i, item)) = take(&next, items) {
            let result = work(item);
            done.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).push((i, result));
        }
    };
    thread::scope(|scope| {
        for _ in 0..threads.clamp(1, items.len().max(1)) {
            scope.spawn(each);
        }
    });
    let mut done = done.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    done.sort_by_key(|(i, _)| *i);
    done.into_iter().map(|(_, result)| result).collect()
}

fn take<'a, T>(next: &AtomicUsize, items: &'a [T]) -> Option<(usize, &'a T)> {
    let i = next.fetch_add(1, Ordering::Relaxed);
    items.get(i).map(|item| (i, item))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::deformed;
    use crate::experiments::sensitivity::variant;
    use crate::experiments::suite::Folders;

    fn trials() -> Vec<Trial> {
        let sites = deformed::shipped(&Folders::of_checkout()).unwrap();
        sites[1].trials(0.0, 1).unwrap()
    }

    #[test]
    fn outcomes_do_not_depend_on_the_number_of_threads() {
        let trials = trials();
        let jobs: Vec<_> = trials.iter().map(|trial| Job::new(trial, "beam", 1, 7)).collect();
        let [one, three] = [1, 3].map(|threads| {
            let mut outcomes = run_all(&jobs, threads, &|_| {}).unwrap().concat();
            outcomes.iter_mut().for_each(|ended| ended.cost.busy_s = 0.0);
            outcomes
        });
        assert_eq!(one, three);
        let order: Vec<_> = trials.iter().map(|trial| format!("{}#1", trial.name)).collect();
        assert_eq!(one.iter().map(|outcome| outcome.id.clone()).collect::<Vec<_>>(), order);
    }

    #[test]
    fn methods_and_variants_share_seeds_and_repetitions_do_not() {
        let trial = trials().remove(0);
        let other = variant(&trial, "other");
        let seed = |trial, method, repetition, suite| Job::new(trial, method, repetition, suite).seed;
        let first = seed(&trial, "beam", 1, 1);
        assert_eq!([seed(&trial, "boniardi-2015", 1, 1), seed(&other, "beam", 1, 1)], [first; 2]);
        assert!(seed(&trial, "beam", 2, 1) != first && seed(&trial, "beam", 1, 2) != first);
    }
}

//! Selects the tasks that a report shows as pictures.

use crate::error::EvalError;
use crate::experiments::jobs::Job;
use crate::experiments::outcome::TaskOutcome;
use crate::experiments::run::drive;
use crate::experiments::suite::Suite;
use crate::experiments::trial_picture;

/// Maximum number of successes, and of failures, that are shown.
const SHOWN: usize = 4;

/// A task that was driven and drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Example {
    /// Name of the task and how it ended.
    pub title: String,
    /// What the robot reported, and the figures.
    pub text: String,
    /// SVG of the drawing with the estimated path, and of the floor with the true path.
    pub pictures: Vec<String>,
}

/// Repeats some failures and some successes of the first method and draws them. The repeated drives are
/// identical bit for bit, so the logs of thousands of tasks need not be kept.
///
/// # Errors
/// [`EvalError`] if a floor or a drawing cannot be drawn.
pub fn examples(
    suite: &Suite,
    jobs: &[Job<'_>],
    outcomes: &[TaskOutcome],
) -> Result<Vec<Example>, EvalError> {
    let Some(first) = jobs.first() else { return Ok(Vec::new()) };
    let counted = |ended: &&TaskOutcome| ended.method == first.method && suite.counts(ended);
    let (reached, failed): (Vec<_>, Vec<_>) =
        outcomes.iter().filter(counted).partition(|ended| ended.is_success());
    let chosen = various(&failed).into_iter().chain(various(&reached));
    chosen.filter_map(|ended| example(jobs, ended).transpose()).collect()
}

/// Chooses a few outcomes that are as different as possible: each one has the least in common with those chosen before it.
fn various<'a>(outcomes: &[&'a TaskOutcome]) -> Vec<&'a TaskOutcome> {
    let mut chosen: Vec<&TaskOutcome> = Vec::new();
    while chosen.len() < SHOWN.min(outcomes.len()) {
        let alike = |ended: &TaskOutcome| -> usize {
            let alike = |other: &&TaskOutcome| {
                usize::from(other.kind == ended.kind) * 2
                    + usize::from(other.drawing == ended.drawing) * 2
                    + usize::from(other.task == ended.task)
                    + usize::from(std::ptr::eq(*other, ended)) * 100
            };
            chosen.iter().map(alike).sum()
        };
        // Start from the middle, since trials are in the order of their drawings.
        let turned = outcomes.iter().cycle().skip(outcomes.len() / 2).take(outcomes.len());
        chosen.extend(turned.min_by_key(|ended| alike(ended)));
    }
    chosen
}

fn example(jobs: &[Job<'_>], ended: &TaskOutcome) -> Result<Option<Example>, EvalError> {
    let is_it = |job: &&Job<'_>| {
        job.method == ended.method && format!("{}#{}", job.trial.name, job.repetition) == ended.id
    };
    let Some(job) = jobs.iter().find(is_it) else { return Ok(None) };
    let runs = drive(job.trial, job.method, job.seed)?;
    let Some(driven) = runs.iter().rfind(|driven| driven.first_task <= ended.task_index) else {
        return Ok(None);
    };
    let pictures = trial_picture::draw(job.trial, driven)?.into_iter().map(|(_, svg)| svg).collect();
    let title = format!("{}: {} ({})", ended.task, ended.kind.word(), ended.id);
    let off = ended.final_error_m.map(|off| format!(", {off:.1} m from the middle of the goal"));
    let said = if ended.reason.is_empty() { "nothing" } else { &ended.reason };
    let text = format!(
        "After {:.0} s and {:.1} m{}. The robot reported: {said}.",
        ended.time_s,
        ended.path_m,
        off.unwrap_or_default()
    );
    Ok(Some(Example { title, text, pictures }))
}

//! The parts of a report that are specific to one navigator and require the true state of the world, such as pictures and verdicts.
//! A navigator's own report about a run is its [`Account`](sketchnav_stage::account::Account).

pub mod directions;
mod drawing;
mod floor;
mod landmarks;

use maud::{Markup, html};
use sketchnav_files::Files;
use sketchnav_recordings::Recording;
use sketchnav_schemas::message::Message;
use sketchnav_schemas::run::RunConfig;

use crate::judge::directions::JourneyVerdict;
use crate::judge::log::Log;
use crate::judge::{self, TaskSpan, TaskVerdict, Verdict};
use crate::picture::TaskMark;
use landmarks::Landmarks;

/// Returns the part of a page that is specific to the run's navigator.
///
/// # Errors
/// Fails if a route or a plan in the recording cannot be read.
pub fn of(
    recording: &Recording,
    (run, files): (&RunConfig, &dyn Files),
    log: &Log,
    journeys: &[JourneyVerdict],
) -> anyhow::Result<Markup> {
    let landmarks = Landmarks::of(log)?;
    Ok(html! {
        (directions::section(run, log, journeys))
        (drawing::moments(recording, log)?)
        @if let Some(landmarks) = &landmarks { (landmarks.section(run, files, &log.truth)) }
        (drawing::correspondences(run, files, log)?)
    })
}

/// Returns a picture of the drawing or the sketch with the estimated path, or `None` if the recording contains neither.
///
/// # Errors
/// Fails if the drawing or the route cannot be read.
pub fn believed(run: &RunConfig, log: &Log, verdict: &Verdict) -> anyhow::Result<Option<String>> {
    match drawing::picture(run, log, verdict)? {
        None => Ok(Landmarks::of(log)?.and_then(|landmarks| landmarks.sketch_picture())),
        svg => Ok(svg),
    }
}

/// Returns a picture of the true floor with the true trajectory, or of the plane of dots, together with a file name for it.
///
/// # Errors
/// Fails if a file of the world cannot be read.
pub fn true_ground(
    run: &RunConfig,
    files: &dyn Files,
    log: &Log,
    verdict: &Verdict,
) -> anyhow::Result<(&'static str, String)> {
    if let Some(svg) = directions::plane_picture(run, files, log, verdict)? {
        return Ok(("plane.svg", svg));
    }
    let svg = floor::picture(run, files, log, verdict, &judge::spans(run.mission.task.len(), &log.status))?;
    Ok(("floor.svg", svg))
}

fn within<'a, T: Message>(span: &Option<TaskSpan>, messages: &'a [T]) -> &'a [T] {
    span.as_ref().map_or(&[], |span| span.of(messages))
}

/// Returns how pictures show the outcome of a task.
pub fn outcome(span: &Option<TaskSpan>, verdict: &TaskVerdict) -> TaskMark {
    match (span, verdict.reached) {
        (None, _) => TaskMark::NotBegun,
        (Some(_), true) => TaskMark::Reached,
        (Some(_), false) => TaskMark::Failed,
    }
}

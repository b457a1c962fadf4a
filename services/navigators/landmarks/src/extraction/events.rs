//! Landmark events around a step of the route, with their significance (Chronis 2007, 4.3.5).
//!
//! An event is an object that comes into view, changes its direction, or disappears. A change of the command lies between two
//! steps (figure 4.11: `turn[step] <> turn[step-1]`), at both of which everything in view counts as an event. This is why state
//! 6 of figure 4.29 has the table in two directions of consecutive steps, with equal significance.

use super::Parameters;
use super::fuzzy::{Status, significance};
use super::track::{Sight, Step, Track};

/// An event around a change of the command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// The object as seen from the step.
    pub sight: Sight,
    /// Significance of the event, from 0 to 1.
    pub significance: f64,
    /// Whether the object comes into view.
    pub is_new: bool,
}

/// Returns the events around the change of the command at a step, most significant first. Of several events of an object in the
/// same direction, only the most significant one is kept.
pub fn around(track: &Track, step: usize, parameters: &Parameters) -> Vec<Event> {
    let from = step.saturating_sub(parameters.event_steps);
    let to = (step + parameters.event_steps).min(track.steps.len() - 1);
    let mut events: Vec<Event> = Vec::new();
    for at in from..=to {
        for sight in &track.steps[at].sights {
            let status = status(track, at, sight.landmark);
            let before = at.checked_sub(1).and_then(|at| seen(&track.steps[at], sight.landmark));
            let has_moved = before.is_some_and(|before| before.place != sight.place);
            let steps_off = if at < step { step - 1 - at } else { at - step };
            if steps_off == 0 || status != Status::Unchanged || has_moved {
                let significance = significance(steps_off, sight.place, status);
                add(&mut events, Event { sight: *sight, significance, is_new: status == Status::New });
            }
        }
    }
    events.sort_by(|a, b| b.significance.total_cmp(&a.significance));
    events
}

fn add(events: &mut Vec<Event>, event: Event) {
    let is_same = |other: &&mut Event| {
        other.sight.landmark == event.sight.landmark && other.sight.place == event.sight.place
    };
    match events.iter_mut().find(is_same) {
        Some(other) if other.significance >= event.significance => {}
        Some(other) => *other = event,
        None => events.push(event),
    }
}

/// Returns how a landmark is seen at a step, or `None` if it is not in view.
pub fn seen(step: &Step, landmark: usize) -> Option<Sight> {
    step.sights.iter().find(|sight| sight.landmark == landmark).copied()
}

/// Returns the status of a landmark at a step. An object in view at the first step is not new, and none disappears at the last
/// step.
fn status(track: &Track, step: usize, landmark: usize) -> Status {
    let is_seen = |step: usize| seen(&track.steps[step], landmark).is_some();
    if step > 0 && !is_seen(step - 1) {
        Status::New
    } else if step + 1 < track.steps.len() && !is_seen(step + 1) {
        Status::Disappeared
    } else {
        Status::Unchanged
    }
}

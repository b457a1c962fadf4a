//! Judges how journeys by custom maps ended, as one of six kinds of success and failure (Park and Kender 1995, 7.2.6).
//!
//! The navigator reports whether it arrived. Whether it truly attained the landmarks that its map refers to is judged by the
//! true dots. A landmark on the map refers to the true dot that is nearest to where the map-maker sees the landmark.

use serde::Serialize;
use sketchnav_directions::messages::Journey;
use sketchnav_directions::stages::sketcher::maps_of;
use sketchnav_directions::traversal::Kind;
use sketchnav_schemas::codes::TaskState;
use sketchnav_schemas::geometry::{Pose, World};

use super::log::Log;
use super::{TaskSpan, spans};

/// The verdict on a journey.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JourneyVerdict {
    /// Name of the task.
    pub task: String,
    /// One of the six kinds, or `None` if the journey has not ended or its map's landmarks are not known.
    #[serde(serialize_with = "as_word")]
    pub kind: Option<Kind>,
    /// Number of entries that the navigator finished.
    pub accepted: u32,
    /// Number of finished entries whose landmark is the one that the map refers to.
    pub right: u32,
    /// Number of recoveries.
    pub recoveries: u32,
    /// Probability of arrival stated by the map-maker.
    pub stated: Option<f64>,
    /// Indices of the true dots that the navigator took for its landmarks.
    pub attained: Vec<usize>,
}

fn as_word<S: serde::Serializer>(kind: &Option<Kind>, serializer: S) -> Result<S::Ok, S::Error> {
    kind.map(Kind::word).serialize(serializer)
}

/// Returns the verdict on each task's journey over the true `dots`. `names` are the names of the tasks.
pub fn journeys(log: &Log, names: &[String], dots: &[[f64; 2]]) -> Vec<JourneyVerdict> {
    let spans = spans(names.len(), &log.status);
    let maps = log.directions.as_deref().and_then(|text| maps_of(text).ok()).unwrap_or_default();
    let verdict = |(task, (name, span)): (usize, (&String, &Option<TaskSpan>))| {
        let steps: Vec<&Journey> = span.iter().flat_map(|span| span.of(&log.journeys)).collect();
        let attained = attained(log, &steps, dots);
        let meant: Vec<usize> = (log.itinerary.iter())
            .flat_map(|itinerary| itinerary.landmarks(task))
            .map(|landmark| nearest(dots, [landmark.x_m.into(), landmark.y_m.into()]))
            .collect();
        let agreement: Vec<bool> = match maps.get(task) {
            Some(map) => map.agreement(&attained, &meant).collect(),
            None => attained.iter().zip(&meant).map(|(one, other)| one == other).collect(),
        };
        let recoveries = steps.last().map_or(0, |step| step.recoveries);
        let stated = log.itinerary.as_ref().and_then(|itinerary| itinerary.journeys().get(task));
        JourneyVerdict {
            task: name.clone(),
            kind: span.as_ref().and_then(|span| kind(span.state, &steps, (&attained, &meant), &agreement)),
            accepted: attained.len() as u32,
            right: agreement.iter().filter(|is_right| **is_right).count() as u32,
            recoveries,
            stated: stated.map(|journey| journey.probability).filter(|stated| *stated >= 0.0),
            attained,
        }
    };
    names.iter().zip(&spans).enumerate().map(verdict).collect()
}

/// Returns the index of the dot nearest to a position.
pub fn nearest(dots: &[[f64; 2]], [x, y]: [f64; 2]) -> usize {
    let far = |dot: &[f64; 2]| (dot[0] - x).hypot(dot[1] - y);
    let all = dots.iter().enumerate();
    all.min_by(|a, b| far(a.1).total_cmp(&far(b.1))).map_or(0, |(index, _)| index)
}

/// Returns, for each finished entry, the true dot that was taken for its landmark.
fn attained(log: &Log, steps: &[&Journey], dots: &[[f64; 2]]) -> Vec<usize> {
    let mut attained = Vec::new();
    for step in steps {
        let Some(window) = log.pose_at(step.header.stamp_ns) else { continue };
        while (step.accepted as usize) > attained.len() && step.has_reference == 1 {
            let reference = Pose::<World>::new(step.reference_x_m, step.reference_y_m, 0.0);
            let at = window.compose(&reference);
            attained.push(nearest(dots, [at.x, at.y]));
        }
    }
    attained
}

fn kind(
    state: TaskState,
    steps: &[&Journey],
    (attained, meant): (&[usize], &[usize]),
    agreement: &[bool],
) -> Option<Kind> {
    let is_planned = attained.len() == meant.len() && agreement.iter().all(|is_right| *is_right);
    let last = steps.last()?;
    match state {
        TaskState::Lost if last.cannot_locate == 1 => Some(Kind::CannotLocate),
        TaskState::Lost => Some(Kind::Lost),
        TaskState::Reached if meant.is_empty() => None,
        TaskState::Reached if attained.last() != meant.last() => Some(Kind::Astray),
        TaskState::Reached if !is_planned => Some(Kind::Unaware),
        TaskState::Reached if last.recoveries > 0 => Some(Kind::Recovered),
        TaskState::Reached => Some(Kind::Direct),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sketchnav_directions::messages::{Itinerary, PlannedLandmark};
    use sketchnav_schemas::message::{GroundTruth, Message, MissionStatus, PoseM};

    const DOTS: [[f64; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]];

    /// Returns the log of a journey over three dots, whose map refers to dots 0, 1 and 2.
    fn log(taken: &[usize], state: TaskState, change: impl Fn(&mut Journey)) -> Log {
        let mut log = Log::default();
        let mut itinerary = Box::new(bytemuck::Zeroable::zeroed());
        let meant: &mut Itinerary = &mut itinerary;
        (meant.landmark_count, meant.journey_count) = (3, 1);
        meant.journeys[0].probability = 0.75;
        for (landmark, [x, y]) in meant.landmarks.iter_mut().zip(DOTS) {
            *landmark = PlannedLandmark { task: 0, dot: 0, x_m: x as f32 + 0.1, y_m: y as f32 };
        }
        log.itinerary = Some(itinerary);
        for (step, &dot) in (1..).zip(taken) {
            let mut journey: Journey = bytemuck::Zeroable::zeroed();
            (journey.header_mut().stamp_ns, journey.accepted, journey.has_reference) = (step, step as u32, 1);
            // The window hovers slightly above the dot and is turned by 90°.
            (journey.reference_x_m, journey.reference_y_m) = (-0.2, 0.0);
            change(&mut journey);
            log.journeys.push(journey);
            let mut truth: GroundTruth = bytemuck::Zeroable::zeroed();
            truth.header_mut().stamp_ns = step;
            let [x, y] = DOTS[dot];
            truth.pose = PoseM::new(&Pose::<World>::new(x, y + 0.2, std::f64::consts::FRAC_PI_2));
            log.truth.push(truth);
            let mut status: MissionStatus = bytemuck::Zeroable::zeroed();
            status.header_mut().stamp_ns = step;
            let is_last = step as usize == taken.len();
            status.state = if is_last { state } else { TaskState::Driving }.code();
            log.status.push(status);
        }
        log
    }

    fn judged(taken: &[usize], state: TaskState, change: impl Fn(&mut Journey)) -> JourneyVerdict {
        journeys(&log(taken, state, change), &["there".to_owned()], &DOTS).remove(0)
    }

    #[test]
    fn the_six_kinds_are_told_apart() {
        let reached = |taken: &[usize], recoveries: u32| {
            judged(taken, TaskState::Reached, |journey| journey.recoveries = recoveries).kind
        };
        assert_eq!(reached(&[0, 1, 2], 0), Some(Kind::Direct));
        assert_eq!(reached(&[0, 1, 2], 2), Some(Kind::Recovered));
        assert_eq!(reached(&[0, 2, 2], 0), Some(Kind::Unaware));
        assert_eq!(reached(&[0, 1, 1], 1), Some(Kind::Astray));
        let lost = |flag| judged(&[0, 1], TaskState::Lost, |journey| journey.cannot_locate = flag).kind;
        assert_eq!([lost(1), lost(0)], [Some(Kind::CannotLocate), Some(Kind::Lost)]);
        assert_eq!(judged(&[0, 1], TaskState::TimedOut, |_| ()).kind, None);
    }

    #[test]
    fn where_landmarks_are_confusable_each_of_them_is_right() {
        let mut log = log(&[0, 2, 2], TaskState::Reached, |_| ());
        let judged = |log: &Log| journeys(log, &["there".to_owned()], &DOTS).remove(0);
        log.directions = Some("(*, SW)\n(Isol, SW)\n(Isol, -)\n".to_owned());
        assert_eq!((judged(&log).kind, judged(&log).right), (Some(Kind::Unaware), 2));
        log.directions = Some("(*, SW)\n(Confusable, SW)\n(Isol, -)\n".to_owned());
        assert_eq!((judged(&log).kind, judged(&log).right), (Some(Kind::Direct), 3));
    }

    #[test]
    fn what_was_right_and_what_was_stated_is_told() {
        let verdict = judged(&[0, 2, 2], TaskState::Reached, |_| ());
        assert_eq!((verdict.accepted, verdict.right, verdict.stated), (3, 2, Some(0.75)));
        assert_eq!(verdict.attained, [0, 2, 2]);
        assert!(serde_json::to_string(&verdict).unwrap().contains("\"kind\":\"unaware\""));
    }
}

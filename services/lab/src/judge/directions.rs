//! Judges how journeys by custom maps ended, as one of six kinds of successes and failures (Park and Kender 1995, 7.2.6).
//!
//! The navigator reports whether it arrived. Whether it actually reached the landmarks that its map refers to is judged by the true
//! dots. A landmark of the map refers to the true dot that is nearest to where the map-maker sees the landmark. Which landmark the
//! navigator takes a dot for is determined by the entry that it reads next ([`Reference`]), or by the most probable landmark if it
//! has a belief.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use sketchnav_directions::CustomMap;
use sketchnav_directions::custom_map::graph::Node;
use sketchnav_directions::messages::Journey;
use sketchnav_directions::stages::reference::Reference;
use sketchnav_directions::stages::sketcher::maps_of;
use sketchnav_directions::traversal::Kind;
use sketchnav_schemas::codes::TaskState;
use sketchnav_schemas::geometry::{Pose, World};

use super::log::Log;
use super::{TaskSpan, spans};

/// The verdict on a journey.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JourneyVerdict {
    /// Name of the task.
    pub task: String,
    /// One of the six kinds, or `None` if the journey has not ended or if the landmarks of its map are not known.
    #[serde(serialize_with = "as_word", deserialize_with = "of_word")]
    pub kind: Option<Kind>,
    /// Number of entries that the navigator has finished.
    pub accepted: u32,
    /// Number of finished entries whose landmark is the one that the map refers to.
    pub right: u32,
    /// Number of recoveries.
    pub recoveries: u32,
    /// Probability of arrival that the map-maker stated.
    pub stated: Option<f64>,
    /// Indices of the true dots that the navigator took for its landmarks.
    pub attained: Vec<usize>,
    /// Kinds of these dots, if the mission has markers on landmarks. A landmark without a marker is a `pole`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub kinds: Vec<String>,
}

fn as_word<S: Serializer>(kind: &Option<Kind>, serializer: S) -> Result<S::Ok, S::Error> {
    kind.map(Kind::word).serialize(serializer)
}

fn of_word<'a, D: Deserializer<'a>>(deserializer: D) -> Result<Option<Kind>, D::Error> {
    let Some(word) = Option::<String>::deserialize(deserializer)? else { return Ok(None) };
    let kind = Kind::ALL.into_iter().find(|kind| kind.word() == word);
    kind.map(Some).ok_or_else(|| D::Error::custom(format!("expected one of the six kinds, found {word:?}")))
}

/// Returns the verdict on the journey of each task, given the true `dots`. `names` are the names of the tasks.
pub fn journeys(log: &Log, names: &[String], dots: &[[f64; 2]]) -> Vec<JourneyVerdict> {
    let spans = spans(names.len(), &log.status);
    let maps = log.directions.as_deref().and_then(|text| maps_of(text).ok()).unwrap_or_default();
    let verdict = |(task, (name, span)): (usize, (&String, &Option<TaskSpan>))| {
        let steps: Vec<&Journey> = span.iter().flat_map(|span| span.of(&log.journeys)).collect();
        let taken = taken(log, maps.get(task), &steps, dots);
        let landmarks: Vec<usize> = (log.itinerary.iter())
            .flat_map(|itinerary| itinerary.landmarks(task))
            .map(|landmark| nearest(dots, [landmark.x_m.into(), landmark.y_m.into()]))
            .collect();
        let right = taken.iter().filter(|taken| taken.is_right(maps.get(task), &landmarks)).count();
        let recoveries = steps.last().map_or(0, |step| step.recoveries);
        let stated = log.itinerary.as_ref().and_then(|itinerary| itinerary.journeys().get(task));
        JourneyVerdict {
            task: name.clone(),
            kind: span
                .as_ref()
                .and_then(|span| kind(span.state, &steps, (&taken, right), (maps.get(task), &landmarks))),
            accepted: taken.len() as u32,
            right: right as u32,
            recoveries,
            stated: stated.map(|journey| journey.probability).filter(|stated| *stated >= 0.0),
            attained: taken.iter().map(|taken| taken.dot).collect(),
            kinds: Vec::new(),
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

/// A dot that the navigator took for a landmark of its map.
struct Taken {
    /// Index of the true dot.
    dot: usize,
    /// The entry that the navigator finished at this dot.
    entry: usize,
    /// The landmark that the dot was taken for, or `None` if the journey ended before the navigator continued from it.
    node: Option<Node>,
    /// The dot that belongs to the most probable landmark, if the navigator has a belief.
    believed: Option<usize>,
}

impl Taken {
    /// Returns true if the dot is the one that the map refers to. `landmarks` are all dots that the map refers to.
    fn is_right(&self, map: Option<&CustomMap>, landmarks: &[usize]) -> bool {
        if let Some(believed) = self.believed {
            return self.dot == believed;
        }
        let meant = self.node.and_then(|node| node.landmark(landmarks));
        meant.is_some_and(|meant| match map {
            Some(map) => map.is_right(self.entry, &self.dot, meant),
            None => self.dot == *meant,
        })
    }
}

/// Returns the dot that was taken for a landmark, for each finished entry. A map that is not known is taken to have no branches.
fn taken(log: &Log, map: Option<&CustomMap>, steps: &[&Journey], dots: &[[f64; 2]]) -> Vec<Taken> {
    let (mut taken, mut reference): (Vec<Taken>, _) = (Vec::new(), Reference::default());
    for step in steps {
        if let Some(map) = map {
            reference.update(map, step);
        }
        if let Some(last) = taken.last_mut().filter(|last| last.node.is_none()) {
            last.node = reference.node();
        }
        let Some(window) = log.pose_at(step.header.stamp_ns) else { continue };
        while (step.accepted as usize) > taken.len() && step.has_reference == 1 {
            let at = window.compose(&Pose::<World>::new(step.reference_x_m, step.reference_y_m, 0.0));
            let in_order = Node::Entry(taken.len() + 1);
            let node = if map.is_some() { reference.node() } else { Some(in_order) };
            let believed = believed(log, step.header.stamp_ns).map(|at| nearest(dots, at));
            taken.push(Taken {
                dot: nearest(dots, [at.x, at.y]),
                entry: step.entry as usize,
                node,
                believed,
            });
        }
    }
    taken
}

/// Returns the position of the most probable landmark at that time, if the navigator has a belief.
fn believed(log: &Log, stamp_ns: u64) -> Option<[f64; 2]> {
    let until = log.whereabouts.partition_point(|said| said.header.stamp_ns <= stamp_ns);
    let most = log.whereabouts[..until].last()?.landmarks().first()?;
    log.chart.get(most.landmark as usize).copied()
}

fn kind(
    state: TaskState,
    steps: &[&Journey],
    (taken, right): (&[Taken], usize),
    (map, landmarks): (Option<&CustomMap>, &[usize]),
) -> Option<Kind> {
    // Neither a branching map nor a belief follows a single path.
    let has_path =
        !map.is_some_and(CustomMap::branches) && taken.iter().all(|taken| taken.believed.is_none());
    let is_planned = right == taken.len() && (!has_path || taken.len() == landmarks.len());
    let last = steps.last()?;
    match state {
        TaskState::Lost if last.cannot_locate == 1 => Some(Kind::CannotLocate),
        TaskState::Lost => Some(Kind::Lost),
        TaskState::Reached if landmarks.is_empty() => None,
        TaskState::Reached if taken.last().map(|taken| &taken.dot) != landmarks.last() => Some(Kind::Astray),
        TaskState::Reached if !is_planned => Some(Kind::Unaware),
        TaskState::Reached if last.recoveries > 0 => Some(Kind::Recovered),
        TaskState::Reached => Some(Kind::Direct),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sketchnav_directions::messages::{
        Activity, BelievedLandmark, Itinerary, PlannedLandmark, Whereabouts,
    };
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
            // The window hovers slightly above the dot and is rotated by 90°.
            (journey.reference_x_m, journey.reference_y_m) = (-0.2, 0.0);
            let is_last = step as usize == taken.len();
            let activity =
                if is_last && state == TaskState::Reached { Activity::Rest } else { Activity::Adjust };
            (journey.entry, journey.activity) = (step as u32 - 1, activity.code());
            change(&mut journey);
            log.journeys.push(journey);
            let mut truth: GroundTruth = bytemuck::Zeroable::zeroed();
            truth.header_mut().stamp_ns = step;
            let [x, y] = DOTS[dot];
            truth.pose = PoseM::new(&Pose::<World>::new(x, y + 0.2, std::f64::consts::FRAC_PI_2));
            log.truth.push(truth);
            let mut status: MissionStatus = bytemuck::Zeroable::zeroed();
            status.header_mut().stamp_ns = step;
            status.state = if is_last { state } else { TaskState::Driving }.code();
            log.status.push(status);
        }
        log
    }

    fn judged(taken: &[usize], state: TaskState, change: impl Fn(&mut Journey)) -> JourneyVerdict {
        journeys(&log(taken, state, change), &["there".to_owned()], &DOTS).remove(0)
    }

    #[test]
    fn the_six_kinds_are_distinguished() {
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
    fn any_of_several_confusable_landmarks_is_correct() {
        let mut log = log(&[0, 2, 2], TaskState::Reached, |_| ());
        let judged = |log: &Log| journeys(log, &["there".to_owned()], &DOTS).remove(0);
        log.directions = Some("(*, SW)\n(Isol, SW)\n(Isol, -)\n".to_owned());
        assert_eq!((judged(&log).kind, judged(&log).right), (Some(Kind::Unaware), 2));
        log.directions = Some("(*, SW)\n(Confusable, SW)\n(Isol, -)\n".to_owned());
        assert_eq!((judged(&log).kind, judged(&log).right), (Some(Kind::Direct), 3));
    }

    /// Entry 2 recognizes the landmark of entry 4 by its surroundings. From there, entry 4 leads back to the path.
    #[test]
    fn in_a_branching_map_a_landmark_belongs_to_the_entry_read_next() {
        let map = "(*, SW)\n(Isol, (2, NE, 4), (3, -), SW)\n(Isol, -)\n(Isol, -)\n";
        // The landmarks of the entries 2, 3 and 4 and the goal.
        let meant = [0, 1, 2, 1];
        let judged = |taken: &[usize], branches: bool| {
            let mut log = log(taken, TaskState::Reached, |_| ());
            log.directions = Some(map.to_owned());
            if let Some(itinerary) = &mut log.itinerary {
                itinerary.landmark_count = 4;
                for (landmark, dot) in itinerary.landmarks.iter_mut().zip(meant) {
                    landmark.x_m = DOTS[dot][0] as f32;
                }
            }
            if branches {
                let begins =
                    Journey { entry: 3, activity: Activity::Seek.code(), recoveries: 1, ..log.journeys[1] };
                log.journeys[1].recoveries = 1;
                log.journeys[2] = Journey { entry: 3, recoveries: 1, ..log.journeys[2] };
                log.journeys.insert(2, begins);
            }
            let verdict = journeys(&log, &["there".to_owned()], &DOTS).remove(0);
            (verdict.kind, verdict.right)
        };
        assert_eq!(judged(&[0, 1, 1], false), (Some(Kind::Direct), 3));
        assert_eq!(
            judged(&[0, 2, 1], true),
            (Some(Kind::Recovered), 3),
            "it took dot 2 for the landmark of entry 4"
        );
        assert_eq!(
            judged(&[0, 1, 1], true),
            (Some(Kind::Unaware), 2),
            "dot 1 is not the landmark of entry 4"
        );
        assert_eq!(
            judged(&[0, 2, 1], false),
            (Some(Kind::Unaware), 2),
            "dot 2 is not the landmark of entry 3"
        );
        assert_eq!(judged(&[0, 2, 2], true), (Some(Kind::Astray), 2));
    }

    /// A belief does not follow a path: two of three landmarks are enough, if each is the one that it was most probably taken for.
    #[test]
    fn with_a_belief_a_landmark_is_the_most_probable_one() {
        let judged = |taken: &[usize], believed: &[u32]| {
            let mut log = log(taken, TaskState::Reached, |_| ());
            log.chart = DOTS.map(|[x, y]| [x, y + 0.1]).to_vec();
            for (stamp_ns, &landmark) in (1..).zip(believed) {
                let mut said: Whereabouts = bytemuck::Zeroable::zeroed();
                (said.header_mut().stamp_ns, said.landmark_count) = (stamp_ns, 1);
                said.landmarks[0] = BelievedLandmark { landmark, probability: 0.9 };
                log.whereabouts.push(said);
            }
            let verdict = journeys(&log, &["there".to_owned()], &DOTS).remove(0);
            (verdict.kind, verdict.right)
        };
        assert_eq!(judged(&[0, 2], &[0, 2]), (Some(Kind::Direct), 2));
        assert_eq!(judged(&[0, 1, 2], &[0, 2, 2]), (Some(Kind::Unaware), 2));
        assert_eq!(judged(&[0, 1], &[0, 2]), (Some(Kind::Astray), 1));
    }

    #[test]
    fn correct_and_stated_landmarks_are_counted() {
        let verdict = judged(&[0, 2, 2], TaskState::Reached, |_| ());
        assert_eq!((verdict.accepted, verdict.right, verdict.stated), (3, 2, Some(0.75)));
        assert_eq!(verdict.attained, [0, 2, 2]);
        assert!(serde_json::to_string(&verdict).unwrap().contains("\"kind\":\"unaware\""));
    }
}

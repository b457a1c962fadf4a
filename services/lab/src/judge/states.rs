//! Judges which landmark states of a drive were matched by the objects that the sketch depicts (Chronis 2007, 5.2.1).
//!
//! The thesis determined by hand "whether the sonar range system readings were from the extracted objects or random objects". Here,
//! the true scene tells which objects the sonars hit when an object was seen, and the names are compared. This module is pure.

use std::f64::consts::{FRAC_PI_8, TAU};

use serde::{Deserialize, Serialize};
use sketchnav_landmarks::drawn::DrawnMetres;
use sketchnav_landmarks::extraction::track::headings;
use sketchnav_landmarks::matching::{self, Features};
use sketchnav_landmarks::messages::{LandmarkEvent, LandmarkProgress, LandmarkView};
use sketchnav_landmarks::perception::Seen;
use sketchnav_landmarks::plane;
use sketchnav_landmarks::route::{DIRECTIONS, Place, Relation, Route, State};
use sketchnav_landmarks::sketch::Sketch;
use sketchnav_landmarks::view;
use sketchnav_schemas::geometry::{Point, Pose, World, wrap_angle};
use sketchnav_schemas::message::GroundTruth;
use sketchnav_schemas::run::RunConfig;

/// How long temporal matching remembers, in nanoseconds: three cycles of 0.192 s (4.6.4).
const REMEMBERED_NS: u64 = 600_000_000;
/// Number of rays that are cast on each side of the axis of a sonar cone.
const RAYS: i32 = 12;
/// Half the opening of the cone of a direction, for robots without sonars.
const HALF_DIRECTION_RAD: f64 = FRAC_PI_8 / 2.0;

/// What happened at a landmark state in a drive.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StateDriven {
    /// Whether the robot matched the state. The first state is always matched (rule 1), and the last one is if the robot arrived
    /// (rule 2).
    pub matched: bool,
    /// Whether the state was matched by the objects that the sketch depicts. For the last state, whether the robot stopped at its
    /// goal.
    pub correct: bool,
    /// Whether the piece of the route that ends with this state is a turn.
    pub ends_turn: bool,
    /// Number of steps of the drawn route since the previous state.
    pub steps: f64,
    /// Angle that the drawn route turns through since the previous state, in degrees.
    pub turned_deg: f64,
}

/// The messages of a drive past landmarks.
#[derive(Debug, Clone, Copy)]
pub struct Said<'a> {
    /// The route of landmark states.
    pub route: &'a Route,
    /// The sketch that the states were extracted from.
    pub sketch: &'a Sketch,
    /// The views of the surroundings, one per step.
    pub views: &'a [LandmarkView],
    /// The robot's progress along the route, one per step.
    pub progress: &'a [LandmarkProgress],
    /// The true poses, one per step.
    pub truth: &'a [GroundTruth],
}

/// Returns the states of a drive by landmark states. `is_reached` indicates whether the drive ended at its goal.
pub fn states(run: &RunConfig, said: &Said<'_>, is_reached: bool) -> Vec<StateDriven> {
    let scene = TrueScene::of(run);
    let mut driven = drawn(said.route, said.sketch);
    if let Some(first) = driven.first_mut() {
        (first.matched, first.correct) = (true, true);
    }
    for progress in said.progress {
        let event = LandmarkEvent::from_code(progress.event);
        let number = match event {
            Some(LandmarkEvent::Matched) => (progress.next as usize).saturating_sub(1),
            Some(LandmarkEvent::Arrived) => said.route.states.len() - 1,
            _ => continue,
        };
        let Some(state) = driven.get_mut(number) else { continue };
        state.matched = true;
        state.correct = match event {
            Some(LandmarkEvent::Arrived) => is_reached,
            _ => scene.explains(said, number, progress.header.stamp_ns),
        };
    }
    driven
}

/// Returns the states with those values that follow from the sketch alone, without a drive.
fn drawn(route: &Route, sketch: &Sketch) -> Vec<StateDriven> {
    let step = plane::length(&sketch.route) / (sketch.route.len() - 1).max(1) as f64;
    let steps = |along: Option<DrawnMetres>| along.unwrap_or_default().0 / step;
    let headings = headings(&sketch.route);
    let place = |along| (steps(along) as usize).min(headings.len() - 1);
    let places: Vec<usize> = route.along().into_iter().map(place).collect();
    let one = |(i, state): (usize, &State)| {
        let before = i.saturating_sub(1);
        let way = &headings[places[before].min(places[i])..=places[i]];
        let turned: f64 = way.windows(2).map(|pair| wrap_angle(pair[1] - pair[0])).sum();
        StateDriven {
            matched: false,
            correct: false,
            ends_turn: i > 0 && route.states[before].command.is_turn(),
            steps: if i == 0 { 0.0 } else { steps(state.after) },
            turned_deg: turned.abs().to_degrees(),
        }
    };
    route.states.iter().enumerate().map(one).collect()
}

/// The true objects that the sonars may hit, and the geometry of the sonars.
struct TrueScene<'a> {
    objects: Vec<(&'a str, Vec<Point<World>>)>,
    ring_m: f64,
    half_opening_rad: f64,
    features: Features,
}

impl<'a> TrueScene<'a> {
    fn of(run: &'a RunConfig) -> Self {
        let furniture = run.mission.world.furniture.iter();
        let objects = furniture.filter_map(|one| {
            let outline = one.polygon.as_ref()?.iter().copied().map(Point::from);
            Some((one.name.as_str(), outline.collect()))
        });
        let sonar = run.robot.sonar.as_ref();
        let features = sketchnav_landmarks::mission::Parameters::of(&run.mission);
        Self {
            objects: objects.collect(),
            ring_m: sonar.map_or(run.robot.radius_m, |sonar| sonar.ring_radius_m),
            half_opening_rad: sonar.map_or(HALF_DIRECTION_RAD, |sonar| sonar.opening_deg.to_radians() / 2.0),
            features: features.map_or_else(|_| Features::default(), |all| all.planner.states.features),
        }
    }

    /// Returns true if each object of the state that was matched at `stamp_ns` is actually there, according to the objects that the
    /// sonars hit.
    ///
    /// Since the state may have matched what was seen shortly before (4.6.4), the latest view counts in which something meets an
    /// object's relations.
    fn explains(&self, said: &Said<'_>, number: usize, stamp_ns: u64) -> bool {
        let end = said.views.partition_point(|view| view.header.stamp_ns <= stamp_ns);
        let is_remembered = |view: &&LandmarkView| view.header.stamp_ns + REMEMBERED_NS >= stamp_ns;
        let recent = || said.views[..end].iter().rev().take_while(is_remembered);
        said.route.states[number].groups().all(|group| {
            let name = said.route.objects[group[0].object].as_str();
            recent().find_map(|view| self.is_it(name, group, view, said.truth)).unwrap_or(false)
        })
    }

    /// Returns true if what meets an object's relations in a view is the named object, or `None` if nothing meets them.
    fn is_it(
        &self,
        name: &str,
        group: &[Relation],
        view: &LandmarkView,
        truth: &[GroundTruth],
    ) -> Option<bool> {
        let seen: Vec<Seen> = view::objects(view).collect();
        let witnesses: Vec<Vec<&Seen>> =
            group.iter().filter_map(|relation| witnesses(relation, &seen, self.features)).collect();
        if witnesses.is_empty() {
            return None;
        }
        let at = truth.partition_point(|truth| truth.header.stamp_ns < view.header.stamp_ns);
        let robot = truth.get(at)?.pose();
        Some(witnesses.iter().any(|all| all.iter().all(|seen| self.hit(&robot, seen, view) == Some(name))))
    }

    /// Returns the true object that most of the sonars hit whose returns form a seen object.
    fn hit(&self, robot: &Pose<World>, seen: &Seen, view: &LandmarkView) -> Option<&'a str> {
        let [first, count] = seen.beams.map(usize::from);
        let beams = (0..count).map(|i| (first + i) % usize::from(DIRECTIONS));
        let hits =
            beams.filter(|beam| view.sectors_m[*beam].is_finite()).filter_map(|beam| self.echo(robot, beam));
        let mut counts: Vec<(&str, usize)> = Vec::new();
        for name in hits {
            match counts.iter_mut().find(|(known, _)| *known == name) {
                Some((_, count)) => *count += 1,
                None => counts.push((name, 1)),
            }
        }
        counts.into_iter().max_by_key(|(_, count)| *count).map(|(name, _)| name)
    }

    /// Returns the nearest object in the cone of a direction.
    fn echo(&self, robot: &Pose<World>, direction: usize) -> Option<&'a str> {
        let axis = robot.yaw_rad + direction as f64 * TAU / f64::from(DIRECTIONS);
        let from = Point::new(robot.x + self.ring_m * axis.cos(), robot.y + self.ring_m * axis.sin());
        let rays = (-RAYS..=RAYS).map(|i| axis + f64::from(i) / f64::from(RAYS) * self.half_opening_rad);
        let hits = rays.flat_map(|ray| {
            self.objects.iter().filter_map(move |(name, outline)| Some((range(from, ray, outline)?, *name)))
        });
        hits.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, name)| name)
    }
}

/// Returns the objects that satisfy a relation: either a single one, or the two on either side of its direction (4.6.4). Returns
/// `None` if there are none.
fn witnesses<'s>(relation: &Relation, seen: &'s [Seen], features: Features) -> Option<Vec<&'s Seen>> {
    let alone = Features { neighbours: false, ..features };
    let met = |relation: &Relation| {
        seen.iter().find(|one| matching::is_met(relation, std::slice::from_ref(*one), alone))
    };
    if let Some(one) = met(relation) {
        return Some(vec![one]);
    }
    let direction = relation.place.direction().filter(|_| features.neighbours)?;
    let beside = |turn: u8| {
        met(&Relation { place: Place::Direction((direction + turn) % DIRECTIONS), ..relation.clone() })
    };
    Some(vec![beside(1)?, beside(DIRECTIONS - 1)?])
}

/// Returns the distance to an outline along a ray, or `None` if the ray does not hit it.
fn range(from: Point<World>, ray_rad: f64, outline: &[Point<World>]) -> Option<f64> {
    let (sin, cos) = ray_rad.sin_cos();
    let crossing = |[a, b]: [Point<World>; 2]| {
        let [ax, ay] = [a.x - from.x, a.y - from.y];
        let [dx, dy] = [b.x - a.x, b.y - a.y];
        let across = cos * dy - sin * dx;
        let (along, part) = ((ax * dy - ay * dx) / across, (ax * sin - ay * cos) / across);
        (along >= 0.0 && (0.0..=1.0).contains(&part)).then_some(along)
    };
    plane::edges(outline).filter_map(crossing).min_by(f64::total_cmp)
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;
    use sketchnav_landmarks::language;
    use sketchnav_landmarks::messages::SeenObject;
    use sketchnav_schemas::floor_plan::Furniture;

    use super::*;
    use crate::experiments::landmarks;
    use crate::experiments::suite::Folders;

    const WORDS: &str = "When the box is left, then turn left. At the end, stop.";

    fn square(name: &str, [x, y]: [f64; 2]) -> Furniture {
        let polygon = [[x, y], [x + 1.0, y], [x + 1.0, y + 1.0], [x, y + 1.0]];
        let (center, size, radius_m) = (None, None, None);
        Furniture { name: name.into(), polygon: Some(polygon.into()), center, size, yaw_deg: 0.0, radius_m }
    }

    /// Returns the states of a drive past an object called `left`. The robot stands at the origin with the object on its left, and
    /// matches the state at once.
    fn driven(left: &str, is_reached: bool) -> Vec<StateDriven> {
        let suite = landmarks::scenes(&Folders::of_checkout()).unwrap();
        let mut run = suite.trials[0].run("chronis-2007", 1, 0).unwrap();
        run.mission.world.furniture = vec![square(left, [-0.5, 1.5]), square("crate", [3.0, 0.0])];
        let mut view = LandmarkView::zeroed();
        view.sectors_m = [f64::INFINITY; 16];
        view.sectors_m[4] = 1.2;
        (view.object_count, view.objects[0]) =
            (1, SeenObject { place: 4, first: 4, count: 1, landmark: 0, proximity_m: 1.2, width: 30.0 });
        let mut truth = GroundTruth::zeroed();
        truth.pose.orientation_w = 1.0;
        let event = |event: LandmarkEvent| {
            let mut progress = LandmarkProgress::zeroed();
            (progress.next, progress.event) = (2, event.code());
            progress
        };
        let route = language::read(WORDS).unwrap();
        let line = (0..=20).map(|i| Point::new(f64::from(i) * 0.5, 0.0)).collect();
        let sketch = Sketch { landmarks: Vec::new(), route: line, metres_per_pixel: 0.1 };
        let progress = [event(LandmarkEvent::Matched), event(LandmarkEvent::Arrived)];
        let said =
            Said { route: &route, sketch: &sketch, views: &[view], progress: &progress, truth: &[truth] };
        states(&run, &said, is_reached)
    }

    fn correct(states: &[StateDriven]) -> Vec<bool> {
        states.iter().map(|state| state.correct).collect()
    }

    #[test]
    fn a_state_matches_if_the_sonars_hit_the_drawn_object() {
        assert_eq!(correct(&driven("box", true)), [true, true, true]);
        let other = driven("table", true);
        assert_eq!(correct(&other), [true, false, true], "another object in the same place");
        assert!(other.iter().all(|state| state.matched));
        assert_eq!(correct(&driven("box", false)), [true, true, false], "it stopped elsewhere");
    }

    #[test]
    fn the_nearest_object_in_the_cone_is_measured() {
        let outline = [[2.0, -0.2], [3.0, -0.2], [3.0, 0.2], [2.0, 0.2]].map(Point::from);
        assert_eq!(range(Point::new(0.0, 0.0), 0.0, &outline), Some(2.0));
        assert_eq!(range(Point::new(0.0, 0.0), 0.2, &outline), None);
        assert_eq!(range(Point::new(4.0, 0.0), 0.0, &outline), None, "it is behind");
    }
}

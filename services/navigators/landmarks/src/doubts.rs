//! Warnings about a sketch, given before the robot starts. They point out turns without an object in view, places that look alike,
//! and states that the robot cannot distinguish. If a smoother route needs fewer states, they suggest it.

use std::f64::consts::{FRAC_PI_4, TAU};
use std::fmt;

use sketchnav_schemas::geometry::{Point, wrap_angle};

use crate::drawn::{Drawn, DrawnMetres};
use crate::error::Pixel;
use crate::extraction::{self, extract};
use crate::instructions::Instructions;
use crate::matching::{Features, RecentMatches};
use crate::mission::{LandmarksMission, Method, Parameters};
use crate::perception::Seen;
use crate::plane;
use crate::route::{Route, State};
use crate::sketch::Sketch;

/// Length of the route before and after a position that is used to measure how far the route turns there.
const BEND: DrawnMetres = DrawnMetres(1.0);
/// Minimum angle of a turn, in radians.
const TURN_RAD: f64 = FRAC_PI_4;
/// Number of directions in which views are compared.
const DIRECTIONS: usize = 36;
/// Average difference between the views from two places below which they look alike, as a share of the range.
const ALIKE: f64 = 0.06;
/// Minimum share of the directions in which a robot must see something for its view to be compared.
const SEEN: f64 = 0.25;
/// Two positions can be confused if they are at most this far apart along the route, as a share of the distance from the start,
/// because neither the robot's odometry nor the scale of the sketch is more accurate.
const UNSURE: f64 = 0.5;
/// Minimum distance along the route between two positions that are compared.
const APART: DrawnMetres = DrawnMetres(2.0);
/// Number of states that a smoother route must save before it is proposed.
const SAVED: usize = 2;
/// Number of times that each point of a route moves halfway to the middle of its neighbours when it is smoothed.
const SMOOTHINGS: usize = 12;
/// Distance that a smoothed route keeps from objects, unless the drawn one was nearer.
const BESIDE: DrawnMetres = DrawnMetres(0.5);

/// A doubt about a sketch. Positions are in pixels of the canvas, with x to the right and y up, and states are numbered from 1.
#[derive(Debug, Clone, PartialEq)]
pub enum Doubt {
    /// The route turns where no object is within reach of the sensors.
    Bare {
        /// Position of the turn.
        at: Pixel,
        /// Range of the sensors, in metres.
        reach_m: f64,
    },
    /// A turn looks like another place on the route.
    Alike {
        /// Position of the turn.
        at: Pixel,
        /// Position of the other place.
        other: Pixel,
    },
    /// A state holds as soon as the previous one does.
    Same {
        /// Number of the previous state.
        state: usize,
    },
    /// A smoother route has fewer states.
    Winding {
        /// Number of states of the route as drawn.
        states: usize,
        /// Number of states of the smoother route.
        smooth: usize,
    },
}

impl Doubt {
    /// Returns the name of this kind of doubt, under which experiments count it.
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::Bare { .. } => "turn without an object in reach",
            Self::Alike { .. } => "turn like another place",
            Self::Same { .. } => "state like the one before",
            Self::Winding { .. } => "winding route",
        }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bare { at, reach_m } => write!(
                f,
                "the route turns at ({:.0}, {:.0}) where no object is within {reach_m:.1} m; draw what is there",
                at.x, at.y
            ),
            Self::Alike { at, other } => write!(
                f,
                "the turn at ({:.0}, {:.0}) looks like ({:.0}, {:.0}), so the robot may turn at the wrong place; draw more of what \
                 tells them apart, or use labels",
                at.x, at.y, other.x, other.y
            ),
            Self::Same { state } => write!(
                f,
                "state {} already holds when state {state} does, so the robot cannot tell when it begins; draw another object there",
                state + 1
            ),
            Self::Winding { states, smooth } => write!(
                f,
                "the route has {states} states, and a smoother one {smooth}; `sketchnav landmarks MISSION --smooth FILE` writes a \
                 sketch with the smoother route"
            ),
        }
    }
}

/// Returns the doubts about instructions that were read for a mission. With markers, no positions look alike.
pub fn of(
    instructions: &Instructions,
    mission: &LandmarksMission,
    parameters: &Parameters,
    extraction: &extraction::Parameters,
) -> Vec<Doubt> {
    match (mission.method, &instructions.sketch) {
        (Method::Belief, None) => Vec::new(),
        (Method::Belief, Some(sketch)) => {
            let mut found = of_sketch(sketch, parameters.localizer.belief.reach_m);
            // The camera distinguishes objects that carry markers.
            found.retain(|doubt| instructions.markers.is_empty() || !matches!(doubt, Doubt::Alike { .. }));
            found
        }
        (Method::Chronis2007, sketch) => instructions.route().ok().flatten().map_or(Vec::new(), |route| {
            of_states(&route, sketch.as_ref(), parameters.planner.states.features, extraction)
        }),
    }
}

/// Returns the doubts about a sketch that is driven by the method `belief`, with sensors of the given range.
fn of_sketch(sketch: &Sketch, reach_m: f64) -> Vec<Doubt> {
    let line = Line::of(sketch);
    let turns = line.turns();
    let bare = turns.iter().filter(|turn| sketch.clearance(line.at(**turn)).0 > reach_m);
    let bare = bare.map(|turn| Doubt::Bare { at: sketch.pixel(line.at(*turn)), reach_m });
    bare.chain(alike(sketch, &line, &turns, reach_m)).collect()
}

/// Returns the doubts about a route of landmark states and the sketch from which it was extracted, if it was drawn.
fn of_states(
    route: &Route,
    sketch: Option<&Sketch>,
    features: Features,
    parameters: &extraction::Parameters,
) -> Vec<Doubt> {
    let same =
        route.states.windows(2).enumerate().skip(1).filter(|(_, pair)| holds(&pair[1], &pair[0], features));
    let same = same.map(|(i, _)| Doubt::Same { state: i + 1 });
    let smooth = sketch.and_then(|sketch| extract(&smoothed(sketch), parameters).ok());
    let states = route.states.len();
    let winding = smooth.map(|smooth| smooth.states.len()).filter(|smooth| smooth + SAVED <= states);
    same.chain(winding.map(|smooth| Doubt::Winding { states, smooth })).collect()
}

/// Returns true if a robot that sees exactly what one state requires also sees what another state requires.
fn holds(state: &State, where_this_holds: &State, features: Features) -> bool {
    let seen: Vec<_> = where_this_holds
        .relations
        .iter()
        .map(|relation| Seen {
            place: relation.place,
            proximity_m: relation.proximity_m.map_or(0.0, |range| range.middle()),
            width: relation.width.map_or(0.0, |range| range.middle()),
            beams: [0, 0],
            landmark: relation.landmark,
        })
        .collect();
    RecentMatches::default().matches(state, &seen, features)
}

/// Returns the turns that look like another position near enough to be confused with them, each with the most similar position.
fn alike(sketch: &Sketch, line: &Line, turns: &[DrawnMetres], reach_m: f64) -> Vec<Doubt> {
    let views: Vec<_> = line
        .places()
        .map(|along| (along, view(sketch, line.at(along), line.heading(along), reach_m)))
        .collect();
    let of_turn = |turn: &DrawnMetres| {
        // Before it turns, the robot still faces the way it came.
        let here = view(sketch, line.at(*turn), line.heading(*turn - BEND), reach_m);
        let is_seen = here.iter().filter(|range| **range < 1.0).count() as f64 >= SEEN * DIRECTIONS as f64;
        let reach = *turn * UNSURE;
        let others = views.iter().filter(|(along, _)| {
            let off = (along.0 - turn.0).abs();
            off >= APART.0 && off <= reach.0
        });
        let difference = |other: &[f64; DIRECTIONS]| {
            here.iter().zip(other).map(|(a, b)| (a - b).abs()).sum::<f64>() / DIRECTIONS as f64
        };
        let (off, other) = others
            .map(|(along, view)| (difference(view), *along))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|_| is_seen)?;
        let [at, other] = [*turn, other].map(|along| sketch.pixel(line.at(along)));
        (off < ALIKE).then_some(Doubt::Alike { at, other })
    };
    turns.iter().filter_map(of_turn).collect()
}

/// Returns the free distance that a robot at the given pose sees in each direction, as a share of the range of its sensors.
fn view(sketch: &Sketch, at: Point<Drawn>, heading: f64, reach_m: f64) -> [f64; DIRECTIONS] {
    std::array::from_fn(|i| {
        let direction = heading + TAU * i as f64 / DIRECTIONS as f64;
        let end = Point::new(at.x + reach_m * direction.cos(), at.y + reach_m * direction.sin());
        let edges = sketch.landmarks.iter().flat_map(|landmark| plane::edges(&landmark.outline));
        let hits = edges.filter_map(|edge| plane::crossing([at, end], edge).map(|(part, _)| part));
        hits.fold(1.0, f64::min)
    })
}

/// The route of a sketch, with positions given by their distance from its start.
struct Line<'a> {
    points: &'a [Point<Drawn>],
    length: DrawnMetres,
}

impl<'a> Line<'a> {
    fn of(sketch: &'a Sketch) -> Self {
        Self { points: &sketch.route, length: DrawnMetres(plane::length(&sketch.route)) }
    }

    fn at(&self, along: DrawnMetres) -> Point<Drawn> {
        plane::at_length(self.points, along.0)
    }

    /// Returns the positions that are compared, half a metre apart.
    fn places(&self) -> impl Iterator<Item = DrawnMetres> {
        const STEP: DrawnMetres = DrawnMetres(0.5);
        (0..=(self.length.0 / STEP.0) as usize).map(|i| STEP * i as f64)
    }

    fn heading(&self, along: DrawnMetres) -> f64 {
        self.at(along - BEND * 0.5).direction_rad(&self.at(along + BEND * 0.5))
    }

    /// Returns the centres of the turns.
    fn turns(&self) -> Vec<DrawnMetres> {
        let turn = |along: DrawnMetres| {
            let [before, at, after] = [along - BEND, along, along + BEND].map(|along| self.at(along));
            wrap_angle(at.direction_rad(&after) - before.direction_rad(&at)).abs()
        };
        let inside = self.places().filter(|along| *along > BEND && *along + BEND < self.length);
        let turns: Vec<_> = inside.map(|along| (along, turn(along))).collect();
        // Of equally sharp turns near each other, only the first one counts.
        let is_sharpest = |(along, angle): &&(DrawnMetres, f64)| {
            let near = turns.iter().filter(|(other, _)| (other.0 - along.0).abs() <= BEND.0);
            let exceeds =
                |(other, sharper): &(DrawnMetres, f64)| sharper > angle || sharper == angle && other < along;
            *angle >= TURN_RAD && !near.into_iter().any(exceeds)
        };
        turns.iter().filter(is_sharpest).map(|(along, _)| *along).collect()
    }
}

/// Returns the sketch with a smoother route, which has the same ends and passes each object on the same side.
pub fn smoothed(sketch: &Sketch) -> Sketch {
    let mut route = sketch.route.clone();
    for _ in 0..SMOOTHINGS {
        let before = route.clone();
        for (i, at) in route.iter_mut().enumerate().skip(1).take(before.len().saturating_sub(2)) {
            let to = at.towards(&before[i - 1].towards(&before[i + 1], 0.5), 0.5);
            let least = sketch.clearance(*at).min(BESIDE);
            if sketch.clearance(to) >= least {
                *at = to;
            }
        }
    }
    Sketch { route, ..sketch.clone() }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::route::{Command, Kind, Place, Relation};
    use crate::sketch::Landmark;

    fn at(x: f64, y: f64) -> Point<Drawn> {
        Point::new(x, y)
    }

    fn square(x: f64, y: f64, side: f64) -> Landmark {
        let outline = vec![at(x, y), at(x + side, y), at(x + side, y + side), at(x, y + side)];
        Landmark { name: format!("object at {x}, {y}"), outline }
    }

    fn sketch(landmarks: Vec<Landmark>, route: &[Point<Drawn>]) -> Sketch {
        Sketch { landmarks, route: plane::resample(route, 0.5), metres_per_pixel: 0.1 }
    }

    /// A street that crosses three others. The route turns into the second one. Blocks have sides of 5 m.
    fn streets() -> Sketch {
        let corners = [-7.0, 0.0, 7.0, 14.0].into_iter().flat_map(|x| [[x, 1.0], [x, -6.0]]);
        let blocks = corners.map(|[x, y]| square(x, y, 5.0)).collect();
        sketch(blocks, &[at(-7.0, 0.0), at(13.0, 0.0), at(13.0, 5.0)])
    }

    #[test]
    fn a_turn_with_nothing_in_view_is_doubted() {
        let bend = [at(0.0, 0.0), at(6.0, 0.0), at(6.0, 6.0)];
        let found = of_sketch(&sketch(vec![square(-3.0, 0.0, 1.0)], &bend), 4.0);
        assert_eq!(found, [Doubt::Bare { at: Pixel::new(60.0, 0.0), reach_m: 4.0 }]);
        assert!(
            found[0].to_string().contains("turns at (60, 0) where no object is within 4.0 m"),
            "{}",
            found[0]
        );
        assert_eq!(of_sketch(&sketch(vec![square(7.0, 0.0, 1.0)], &bend), 4.0), []);
    }

    #[test]
    fn a_crossing_that_looks_like_the_one_before_is_doubted() {
        let alike = streets();
        let [Doubt::Alike { at: turn, other }] = of_sketch(&alike, 4.0)[..] else {
            panic!("{:?}", of_sketch(&alike, 4.0))
        };
        assert!((turn.x - 130.0).abs() < 6.0 && (other.x - 60.0).abs() < 6.0, "{turn:?} {other:?}");
        let mut kiosk = streets();
        kiosk.landmarks.push(square(12.3, -2.4, 1.4));
        assert_eq!(of_sketch(&kiosk, 4.0), [], "a kiosk at the crossing tells them apart");
    }

    #[test]
    fn a_state_that_holds_with_the_one_before_is_doubted() {
        let state = |direction| State {
            kind: Kind::Change,
            relations: vec![Relation {
                object: 0,
                place: Place::Direction(direction),
                proximity_m: None,
                width: None,
                landmark: None,
            }],
            command: Command::Forward,
            after: None,
        };
        let route = |directions: [u8; 4]| Route {
            objects: vec!["desk".into()],
            states: directions.map(state).into(),
        };
        let of = |directions| {
            of_states(&route(directions), None, Features::default(), &extraction::Parameters::default())
        };
        assert_eq!(of([0, 4, 12, 8]), []);
        assert_eq!(of([0, 4, 4, 8]), [Doubt::Same { state: 2 }]);
    }

    #[test]
    fn a_route_that_winds_has_a_smoother_one_with_fewer_states() {
        let waves = (0..=40).map(|i| {
            let x = 0.25 * f64::from(i);
            at(x, 0.45 * (1.3 * x).sin())
        });
        let winding = sketch(vec![square(2.0, 2.0, 2.0), square(6.0, -4.0, 2.0)], &waves.collect::<Vec<_>>());
        let parameters = extraction::Parameters::default();
        let route = extract(&winding, &parameters).unwrap();
        let found = of_states(&route, Some(&winding), Features::default(), &parameters);
        let is_proposed =
            |doubt: &Doubt| matches!(doubt, Doubt::Winding { states, smooth } if smooth < states);
        assert!(found.iter().any(is_proposed), "{} states: {found:?}", route.states.len());
    }

    proptest! {
        /// A route that a person accepts must not lead through an object, nor past it on the other side. Each point moves by less
        /// than its distance from the objects, so the line never sweeps over one.
        #[test]
        fn a_smoothed_route_keeps_its_ends_and_its_distance(
            corners in prop::collection::vec((0.0..20.0, -5.0..5.0), 2..8),
            squares in prop::collection::vec((0.0..20.0, -5.0..5.0, 0.3..2.0), 1..6),
        ) {
            let landmarks = squares.into_iter().map(|(x, y, side)| square(x, y, side)).collect();
            let corners: Vec<_> = corners.into_iter().map(|(x, y)| at(x, y)).collect();
            prop_assume!(plane::length(&corners) > 1.0);
            let drawn = sketch(landmarks, &corners);
            let smooth = smoothed(&drawn);
            prop_assert_eq!(smooth.route.first(), drawn.route.first());
            prop_assert_eq!(smooth.route.last(), drawn.route.last());
            for (before, after) in drawn.route.iter().zip(&smooth.route) {
                prop_assert!(drawn.clearance(*after) >= drawn.clearance(*before).min(BESIDE));
            }
        }
    }
}

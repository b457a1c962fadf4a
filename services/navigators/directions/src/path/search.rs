//! Dijkstra's algorithm with a lower bound of the remaining cost (A*), and an explanation if there is no path.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::{Atlas, Leg, Measure, Path, Start, Weights};
use crate::error::{Barrier, Error};
use crate::geometry::{Corner, Point};
use crate::plane::{DotId, Plane};
use crate::transitions::{Movement, Transition};

/// The transition number of a node that no transition leads to.
const NONE: u32 = u32::MAX;

/// The cheapest path to a node so far, as its cost and its last transition. Both are stored together because they are read and
/// written together.
#[derive(Debug, Clone, Copy)]
struct Node {
    cost: f64,
    by: u32,
}

/// A search in a graph of landmarks, or of landmarks in corners, with the goal as an additional node.
struct Search<'a> {
    atlas: &'a Atlas,
    goal: DotId,
    measure: Measure,
    weights: Weights,
    /// Number of nodes for each landmark: 1, or 4 for its corners.
    lanes: u32,
    nodes: Vec<Node>,
    open: BinaryHeap<(Reverse<u64>, Reverse<u32>, Reverse<u32>)>,
}

pub(super) fn search(
    atlas: &Atlas,
    start: Start,
    goal: DotId,
    measure: Measure,
    weights: Weights,
) -> Option<Path> {
    if start.landmark == goal {
        return Some(Path { start, legs: Vec::new(), distance: 0.0, unreliability: 0.0 });
    }
    let lanes = if measure == Measure::Windows { 4 } else { 1 };
    let nodes = atlas.plane.len() * lanes + 1;
    let mut search = Search {
        atlas,
        goal,
        measure,
        weights,
        lanes: lanes as u32,
        nodes: vec![Node { cost: f64::INFINITY, by: NONE }; nodes],
        open: BinaryHeap::new(),
    };
    search.begin(start);
    search.run().then(|| search.path(start))
}

impl Search<'_> {
    fn end(&self) -> u32 {
        self.atlas.plane.len() as u32 * self.lanes
    }

    fn node(&self, landmark: DotId, corner: Corner) -> u32 {
        if self.lanes == 4 { landmark * 4 + corner as u32 } else { landmark }
    }

    fn begin(&mut self, start: Start) {
        for corner in Corner::ALL.into_iter().take(self.lanes as usize) {
            let way = match self.measure {
                Measure::Landmarks => 0.0,
                Measure::Windows => (self.atlas.centre(start.landmark, corner) - start.centre).norm(),
            };
            let node = self.node(start.landmark, corner);
            if self.lanes == 4 && !self.atlas.is_free(start.centre, self.atlas.centre(start.landmark, corner))
            {
                continue;
            }
            self.reach(node, self.weights.distance * way, 0, NONE);
        }
    }

    /// Returns a lower bound of the remaining cost from a node.
    fn left(&self, node: u32) -> f64 {
        if node == self.end() || self.weights.distance == 0.0 {
            return 0.0;
        }
        let goal = self.atlas.plane.dot(self.goal);
        let way = match self.measure {
            Measure::Landmarks => (goal - self.atlas.plane.dot(node)).norm(),
            Measure::Windows => {
                let centre = self.atlas.centre(node / 4, Corner::ALL[node as usize % 4]);
                // At the end of the path, the goal only has to be in view.
                let shows = self
                    .atlas
                    .window
                    .land
                    .map_or(self.atlas.window.side * std::f64::consts::FRAC_1_SQRT_2, |land| land.range);
                (goal - centre).norm() - shows
            }
        };
        self.weights.distance * way.max(0.0)
    }

    fn reach(&mut self, node: u32, cost: f64, entries: u32, by: u32) {
        let known = &mut self.nodes[node as usize];
        if cost < known.cost {
            *known = Node { cost, by };
            // Costs are never negative, so their bit patterns have the same order.
            let rank = (cost + self.left(node)).to_bits();
            self.open.push((Reverse(rank), Reverse(entries), Reverse(node)));
        }
    }

    fn run(&mut self) -> bool {
        while let Some((Reverse(rank), Reverse(entries), Reverse(node))) = self.open.pop() {
            if node == self.end() {
                return true;
            }
            let cost = self.nodes[node as usize].cost;
            // A cheaper path to this node was found in the meantime.
            if f64::from_bits(rank) > cost + self.left(node) {
                continue;
            }
            self.leave(node, cost, entries + 1);
        }
        false
    }

    fn leave(&mut self, node: u32, cost: f64, entries: u32) {
        let atlas = self.atlas;
        let from = node / self.lanes;
        for number in atlas.transitions.numbers(from) {
            let transition = atlas.transitions.number(number);
            if self.lanes == 1 {
                self.leave_landmark(from, transition, number, cost, entries);
            } else if transition.corner as u32 == node % 4 {
                self.leave_window(from, transition, number, cost, entries);
            }
        }
    }

    /// Returns the cost of a transition except for its distance.
    fn fixed(&self, number: u32) -> f64 {
        let unreliability = f64::from(self.atlas.unreliability[number as usize]);
        let slides = self.atlas.transitions.number(number).movement != Movement::Seek;
        let slide = if slides { self.weights.slides } else { 0.0 };
        self.weights.unreliability * unreliability + self.weights.entries + slide
    }

    fn leave_landmark(&mut self, from: DotId, transition: &Transition, number: u32, cost: f64, entries: u32) {
        let to = if transition.to == self.goal { self.end() } else { transition.to };
        let way = self.weights.distance * self.atlas.landmark_distance(from, transition);
        self.reach(to, cost + self.fixed(number) + way, entries, number);
    }

    fn leave_window(&mut self, from: DotId, transition: &Transition, number: u32, cost: f64, entries: u32) {
        let (way, at) = self.atlas.window_way(from, transition);
        let cost = cost + self.fixed(number) + self.weights.distance * way;
        let atlas = self.atlas;
        if transition.to == self.goal {
            if atlas.is_free(at, atlas.over(at, self.goal)) {
                self.reach(self.end(), cost, entries, number);
            }
            return;
        }
        // A robot that drives around a landmark goes from each side to the next.
        let is_next = |place: Corner| transition.to != from || place.is_next_to(transition.corner);
        let leads_on = |&place: &Corner| {
            is_next(place)
                && atlas.leads_on(transition.to, place)
                && atlas.is_free(at, atlas.centre(transition.to, place))
        };
        for place in Corner::ALL.into_iter().filter(leads_on) {
            let further = (self.atlas.centre(transition.to, place) - at).norm();
            self.reach(
                self.node(transition.to, place),
                cost + self.weights.distance * further,
                entries,
                number,
            );
        }
    }

    fn distance(&self, from: DotId, transition: &Transition, place: Option<Corner>) -> f64 {
        match self.measure {
            Measure::Landmarks => self.atlas.landmark_distance(from, transition),
            Measure::Windows => self.atlas.window_distance(from, transition, place),
        }
    }

    /// Collects the path, from its end backwards.
    fn path(&self, start: Start) -> Path {
        let (mut legs, mut node, mut place) = (Vec::new(), self.end(), None);
        loop {
            let number = self.nodes[node as usize].by;
            if number == NONE {
                break;
            }
            let transition = *self.atlas.transitions.number(number);
            let from = self.atlas.transitions.origin(number);
            let distance = self.distance(from, &transition, place);
            let unreliability = f64::from(self.atlas.unreliability[number as usize]);
            legs.push(Leg { from, number, transition, place, distance, unreliability });
            place = Some(transition.corner);
            node = self.node(from, transition.corner);
        }
        legs.reverse();
        let unreliability = super::unreliability(&legs);
        let mut path = Path { start, legs, distance: 0.0, unreliability };
        path.distance = path.distance_by(self.atlas, self.measure);
        path
    }
}

/// Explains why there is no path: the dots that can be reached, the dots from which the goal can be reached, and where these two
/// sets are closest to each other.
pub(super) fn unreachable(atlas: &Atlas, start: DotId, goal: DotId) -> Error {
    let count = atlas.plane.len();
    let can_be_driven = |&(from, transition): &(DotId, &Transition)| atlas.can_be_driven(from, transition);
    let driven = atlas.transitions.all().filter(can_be_driven);
    let mut backwards: Vec<(DotId, DotId)> = driven.map(|(from, transition)| (transition.to, from)).collect();
    backwards.sort_unstable();
    let origins = |dot: DotId, visit: &mut dyn FnMut(DotId)| {
        let begin = backwards.partition_point(|&(to, _)| to < dot);
        backwards[begin..].iter().take_while(|&&(to, _)| to == dot).for_each(|&(_, from)| visit(from));
    };
    let targets = |dot: DotId, visit: &mut dyn FnMut(DotId)| {
        let driven = atlas.transitions.from(dot).iter().filter(|it| atlas.can_be_driven(dot, it));
        driven.for_each(|transition| visit(transition.to));
    };
    let (reached, reaching) = (flood(count, start, targets), flood(count, goal, origins));
    let ids = |set: &[bool]| -> Vec<DotId> {
        (0..).zip(set).filter(|(_, is_in)| **is_in).map(|(dot, _)| dot).collect()
    };
    let (near, far) = (ids(&reached), ids(&reaching));
    // The search starts from the smaller set.
    let (from, to) = if far.len() <= near.len() {
        let (to, from) = closest(&atlas.plane, &far, &reached);
        (from, to)
    } else {
        closest(&atlas.plane, &near, &reaching)
    };
    let why = barrier(atlas, from, to);
    Error::Unreachable { start, goal, reached: near.len(), reaching: far.len(), from, to, why }
}

/// Returns the obstacle to a transition from one dot to another.
fn barrier(atlas: &Atlas, from: DotId, to: DotId) -> Barrier {
    let (a, b) = (atlas.plane.dot(from), atlas.plane.dot(to));
    let gap = (b - a).norm();
    let window = atlas.window;
    let reach =
        window.land.map_or(window.side * std::f64::consts::SQRT_2, |land| land.range + land.stand_off);
    if from == to {
        Barrier::Around
    } else if atlas.plane.walls().cross(a, b) {
        Barrier::Wall { gap }
    } else if gap > reach {
        Barrier::Far { gap, reach }
    } else if atlas.transitions.from(from).iter().any(|transition| transition.to == to) {
        Barrier::Narrow { gap }
    } else {
        Barrier::Word { gap }
    }
}

fn flood(count: usize, from: DotId, visit: impl Fn(DotId, &mut dyn FnMut(DotId))) -> Vec<bool> {
    let mut is_in = vec![false; count];
    is_in[from as usize] = true;
    let mut open = vec![from];
    while let Some(dot) = open.pop() {
        visit(dot, &mut |next| {
            if !is_in[next as usize] {
                is_in[next as usize] = true;
                open.push(next);
            }
        });
    }
    is_in
}

/// Returns the dot of a list and the dot of a set that are closest to each other. Neither may be empty.
fn closest(plane: &Plane, list: &[DotId], set: &[bool]) -> (DotId, DotId) {
    let (low, high) = plane.bounds();
    let whole = (high - low).norm().max(1.0);
    let mut best = (list[0], list[0], f64::INFINITY);
    for &dot in list {
        let place = plane.dot(dot);
        let mut reach = whole / (plane.len() as f64).sqrt();
        loop {
            let candidates = plane.around(place, reach.min(best.2)).filter(|&(other, _)| set[other as usize]);
            let distance = |at: Point| (at - place).norm();
            if let Some((other, at)) =
                candidates.min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)).then(a.0.cmp(&b.0)))
                && distance(at) <= reach
            {
                if distance(at) < best.2 {
                    best = (dot, other, distance(at));
                }
                break;
            }
            if reach >= best.2 || reach > 2.0 * whole {
                break;
            }
            reach *= 2.0;
        }
    }
    (best.0, best.1)
}

//! A pair of objects and the forces between them. The parallels through all vertices and edge crossings cut the plane into
//! strips; [`super::power`] computes the force of a strip.

use std::f64::consts::TAU;

use super::chords::Chords;
use super::power::{Power, Section, mean_force};
use super::{Force, Polygon, polygon};
use crate::error::Error;
use crate::geometry::{MAX_COORDINATE, Point};

/// Ratio of a length to the size of the objects below which it is a rounding error. Objects this near to each other touch.
const ROUNDING: f64 = 1e-12;

/// Two objects, prepared for any exponent and direction.
#[derive(Debug, Clone, Default)]
pub struct Pair {
    /// The corners of the argument, then those of the referent, then the crossings of edges.
    knots: Vec<Point>,
    /// Number of corners of the argument, and of both objects.
    corners: [usize; 2],
    /// The edges of the argument, then those of the referent, as indices of their ends.
    edges: Vec<[usize; 2]>,
    /// The two edges at each corner.
    edges_at: Vec<[usize; 2]>,
    /// The centre and radius of a circle around each object.
    circles: [([f64; 2], f64); 2],
    /// Lengths up to this value count as rounding errors.
    rounding: f64,
    /// The normal, towards the argument, of a line that separates the objects. Only set if each object is a single ring that
    /// does not cross itself.
    normal: Option<[f64; 2]>,
}

/// Working memory for computing forces, kept so that it can be reused.
#[derive(Debug, Clone, Default)]
pub struct Workspace {
    /// Sine and cosine of the directions of the last histogram.
    turns: Vec<(f64, f64)>,
    /// The coordinates of the knots across and along the direction.
    turned: Vec<[f64; 2]>,
    /// The indices of the knots in order across the direction. They are kept, because the order for the next direction is nearly
    /// the same.
    order: Vec<usize>,
    argument: Cut,
    referent: Cut,
    chords: Chords,
}

/// An object cut by a parallel that sweeps over it. Holds the edges being cut, in order along the direction.
#[derive(Debug, Clone, Default)]
struct Cut {
    lines: Vec<Line>,
}

/// An edge that the sweeping parallel cuts.
#[derive(Debug, Clone, Copy)]
struct Line {
    edge: usize,
    /// The start of the edge, across and along the direction. `slope` is the slope of its line.
    begin: [f64; 2],
    slope: f64,
    /// The position along the direction of the cut at each side of the strip.
    cut: [f64; 2],
}

impl Pair {
    /// Prepares the pair of argument A and referent B. Forces are large in the direction of A as seen from B.
    pub fn new(argument: &Polygon, referent: &Polygon) -> Self {
        let mut pair = Self::default();
        pair.prepare(argument, referent);
        pair
    }

    /// Replaces this pair by another, reusing its memory.
    pub fn prepare(&mut self, argument: &Polygon, referent: &Polygon) {
        let (a, b) = (argument.corners(), referent.corners());
        self.knots.clear();
        self.knots.extend(a.iter().chain(b));
        self.corners = [a.len(), self.knots.len()];
        self.edges.clear();
        self.edges.extend(argument.edge_places());
        self.edges.extend(referent.edge_places().map(|edge| edge.map(|i| i + a.len())));
        self.edges_at.clear();
        self.edges_at.resize(self.knots.len(), [0; 2]);
        for (i, [from, to]) in self.edges.iter().enumerate() {
            // Each corner begins one edge and ends another.
            self.edges_at[*from][0] = i;
            self.edges_at[*to][1] = i;
        }
        let first = self.knots[0];
        self.rounding = self.knots.iter().map(|at| at.distance(first)).fold(0.0, f64::max) * ROUNDING;
        self.circles = [circle(a), circle(b)];
        for (i, edge) in self.edges.iter().enumerate() {
            for other in &self.edges[..i] {
                let [one, other] = [edge, other].map(|edge| edge.map(|at| self.knots[at]));
                self.knots.extend(polygon::crossing(one, other));
            }
        }
        let are_rings = argument.rings().count() == 1 && referent.rings().count() == 1;
        let edges = self.edges.split_at(a.len());
        let are_simple =
            self.knots.len() == self.corners[1] && [edges.0, edges.1].iter().all(|of| self.is_simple(of));
        self.normal = if are_simple && are_rings { self.parting_normal() } else { None };
    }

    /// Returns true if a ring neither crosses nor touches itself. Touching is excluded because a ring with a corner on one of
    /// its edges may cross itself there.
    fn is_simple(&self, edges: &[[usize; 2]]) -> bool {
        let neighbours = |i: usize, j: usize| j == i + 1 || i + j + 1 == edges.len() && i == 0;
        let pairs = (0..edges.len()).flat_map(|j| (0..j).map(move |i| (i, j)));
        let ends = |i: usize| edges[i].map(|at| self.knots[at]);
        pairs
            .filter(|(i, j)| !neighbours(*i, *j))
            .all(|(i, j)| !polygon::touch(ends(i), ends(j), self.rounding))
    }

    /// Returns the normal of a line that separates the objects, if one is found. Tries the direction between the centres of the
    /// circles, and those of the axes.
    fn parting_normal(&self) -> Option<[f64; 2]> {
        let [(a, _), (b, _)] = self.circles;
        let between = [a[0] - b[0], a[1] - b[1]];
        let normals = [between, [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
        let (argument, referent) = self.knots.split_at(self.corners[0]);
        normals.into_iter().find(|[x, y]| {
            let along = |at: &Point| at.x() * x + at.y() * y;
            let least = argument.iter().map(along).fold(f64::INFINITY, f64::min);
            let most = referent.iter().map(along).fold(f64::NEG_INFINITY, f64::max);
            least - most > self.rounding * x.hypot(*y)
        })
    }

    /// Returns the force F_r(θ), where r is the exponent of the distance.
    ///
    /// # Errors
    /// [`Error::Parameter`] if r is not between 0 and 16, or if the angle is not finite.
    pub fn force(&self, exponent: f64, angle_rad: f64, workspace: &mut Workspace) -> Result<Force, Error> {
        let power = Power::new(exponent)?;
        if angle_rad.abs() > MAX_COORDINATE || angle_rad.is_nan() {
            return Err(Error::Parameter {
                what: "angle_rad",
                expected: "a finite number",
                found: angle_rad,
            });
        }
        Ok(self.force_along(power, angle_rad.sin_cos(), workspace))
    }

    /// Returns the forces in `directions` evenly spaced directions, starting from 0.
    ///
    /// # Errors
    /// [`Error::Parameter`] if r is not between 0 and 16.
    pub fn histogram(&self, exponent: f64, directions: usize) -> Result<Vec<Force>, Error> {
        let mut forces = vec![Force::ZERO; directions];
        self.histogram_into(exponent, &mut forces, &mut Workspace::default())?;
        Ok(forces)
    }

    /// Like [`Self::histogram`], but writes the forces into a slice, with one direction per element. Once the workspace has
    /// been used for objects with as many corners, this does not allocate.
    ///
    /// # Errors
    /// [`Error::Parameter`] if r is not between 0 and 16.
    pub fn histogram_into(
        &self,
        exponent: f64,
        forces: &mut [Force],
        workspace: &mut Workspace,
    ) -> Result<(), Error> {
        let power = Power::new(exponent)?;
        let directions = forces.len();
        if workspace.turns.len() != directions {
            workspace.turns.clear();
            workspace.turns.extend((0..directions).map(|i| (i as f64 / directions as f64 * TAU).sin_cos()));
        }
        for (i, force) in forces.iter_mut().enumerate() {
            let turn = workspace.turns[i];
            *force = self.force_along(power, turn, workspace);
        }
        Ok(())
    }

    fn force_along(&self, power: Power, turn: (f64, f64), workspace: &mut Workspace) -> Force {
        if self.is_elsewhere(turn) {
            return Force::ZERO;
        }
        let Workspace { turned, order, argument, referent, chords, .. } = workspace;
        let (sin, cos) = turn;
        let ahead = self.normal.map(|[x, y]| x * cos + y * sin);
        if ahead.is_some_and(|ahead| ahead <= 0.0) {
            return Force::ZERO;
        }
        turned.clear();
        turned.extend(self.knots.iter().map(|at| [at.y() * cos - at.x() * sin, at.x() * cos + at.y() * sin]));
        let [a, b] = [&turned[..self.corners[0]], &turned[self.corners[0]..self.corners[1]]].map(extent);
        let [low, high] = [a.across[0].max(b.across[0]), a.across[1].min(b.across[1])];
        if high - low <= self.rounding || a.along[1] <= b.along[0] {
            return Force::ZERO;
        }
        sort(order, turned);
        if power.is_constant() && ahead.is_some() {
            let strips = order.iter().map(|knot| turned[*knot][0]).filter(|u| (low..=high).contains(u));
            let argument_edges = self.edges.len() - (self.corners[1] - self.corners[0]);
            let edges = self.edges.split_at(argument_edges);
            return Force::Finite(chords.constant_force([edges.0, edges.1], turned, [low, high], strips));
        }
        argument.lines.clear();
        referent.lines.clear();
        let mut force = Force::ZERO;
        let mut from = f64::NEG_INFINITY;
        for knot in order.iter().copied() {
            let to = turned[knot][0];
            let width = to - from;
            if width > self.rounding && from >= low - self.rounding && to <= high + self.rounding {
                argument.move_to(to);
                referent.move_to(to);
                force = force + self.strip(power, argument, referent).scaled(width);
            }
            if to >= high {
                break;
            }
            if width > self.rounding || from == f64::NEG_INFINITY {
                from = to;
            }
            if knot < self.corners[1] {
                let cut = if knot < self.corners[0] { &mut *argument } else { &mut *referent };
                for edge in self.edges_at[knot] {
                    cut.toggle(edge, knot, self.edges[edge], turned);
                }
            }
            if to >= low - self.rounding {
                argument.begin_at(to);
                referent.begin_at(to);
            }
        }
        force
    }

    /// Returns the mean force in a strip.
    fn strip(&self, power: Power, argument: &Cut, referent: &Cut) -> Force {
        let mut force = Force::ZERO;
        for a in argument.sections() {
            for b in referent.sections() {
                force = force + mean_force(power, a, b, self.rounding);
            }
        }
        force
    }

    /// Returns true if the circles around the objects show that no parallel meets the argument after the referent.
    fn is_elsewhere(&self, (sin, cos): (f64, f64)) -> bool {
        let [(a, a_radius), (b, b_radius)] = self.circles;
        let [x, y] = [a[0] - b[0], a[1] - b[1]];
        let reach = (a_radius + b_radius) * (1.0 + 1e-9);
        (y * cos - x * sin).abs() > reach || x * cos + y * sin < -reach
    }
}

impl Force {
    fn scaled(self, by: f64) -> Self {
        match self {
            Self::Finite(force) => Self::Finite(force * by),
            Self::Infinite => Self::Infinite,
        }
    }
}

/// The extent of a set of points across and along a direction.
struct Extent {
    across: [f64; 2],
    along: [f64; 2],
}

fn extent(turned: &[[f64; 2]]) -> Extent {
    let start = [f64::INFINITY, f64::NEG_INFINITY];
    let mut extent = Extent { across: start, along: start };
    for [u, v] in turned {
        extent.across = [extent.across[0].min(*u), extent.across[1].max(*u)];
        extent.along = [extent.along[0].min(*v), extent.along[1].max(*v)];
    }
    extent
}

/// Returns the centre and radius of a circle around points. The centre is the middle of their bounding box.
fn circle(corners: &[Point]) -> ([f64; 2], f64) {
    let middle = |of: fn(Point) -> f64| {
        let values = || corners.iter().map(|at| of(*at));
        values().fold(f64::INFINITY, f64::min) / 2.0 + values().fold(f64::NEG_INFINITY, f64::max) / 2.0
    };
    let centre = [middle(Point::x), middle(Point::y)];
    let radius = corners.iter().map(|at| (at.x() - centre[0]).hypot(at.y() - centre[1])).fold(0.0, f64::max);
    (centre, radius)
}

/// Sorts the indices of points by their position across the direction. This is fast if they are nearly sorted already.
fn sort(order: &mut Vec<usize>, turned: &[[f64; 2]]) {
    if order.len() != turned.len() {
        order.clear();
        order.extend(0..turned.len());
    }
    if order.len() > 40 {
        order.sort_unstable_by(|a, b| turned[*a][0].total_cmp(&turned[*b][0]));
        return;
    }
    for i in 1..order.len() {
        let (place, across) = (order[i], turned[order[i]][0]);
        if turned[order[i - 1]][0] <= across {
            continue;
        }
        let mut j = i;
        while j > 0 && turned[order[j - 1]][0] > across {
            order[j] = order[j - 1];
            j -= 1;
        }
        order[j] = place;
    }
}

impl Cut {
    /// Adds or removes an edge that begins or ends at a knot.
    fn toggle(&mut self, edge: usize, knot: usize, ends: [usize; 2], turned: &[[f64; 2]]) {
        if let Some(place) = self.lines.iter().position(|line| line.edge == edge) {
            // This breaks the order of the lines, but `move_to` restores it before it is used.
            self.lines.swap_remove(place);
            return;
        }
        let end = turned[if ends[0] == knot { ends[1] } else { ends[0] }];
        let begin = turned[knot];
        // The slope is not finite for an edge along the direction, but such an edge ends before the next strip.
        let slope = (end[1] - begin[1]) / (end[0] - begin[0]);
        self.lines.push(Line { edge, begin, slope, cut: [begin[1]; 2] });
    }

    /// Begins a strip at the end of the previous one.
    fn begin_at(&mut self, across: f64) {
        for line in &mut self.lines {
            line.cut[0] = line.begin[1] + (across - line.begin[0]) * line.slope;
        }
    }

    /// Extends the strip to `across`, which cuts the edges there and sorts them along the direction.
    fn move_to(&mut self, across: f64) {
        let mut is_sorted = true;
        let mut before = f64::NEG_INFINITY;
        for line in &mut self.lines {
            line.cut[1] = line.begin[1] + (across - line.begin[0]) * line.slope;
            let middle = line.cut[0] + line.cut[1];
            is_sorted &= before <= middle;
            before = middle;
        }
        if !is_sorted {
            self.lines.sort_unstable_by(|a, b| (a.cut[0] + a.cut[1]).total_cmp(&(b.cut[0] + b.cut[1])));
        }
    }

    /// Returns the sections of the object in the strip, in order along the direction.
    fn sections(&self) -> impl Iterator<Item = Section> {
        self.lines.chunks_exact(2).map(|ends| [ends[0].cut, ends[1].cut])
    }
}

//! Two objects and the forces between them. The parallels through all vertices and crossings of edges cut the plane
//! into strips; [`super::power`] has the force of a strip.

use std::f64::consts::TAU;

use super::power::{Power, Section, mean_force};
use super::{Force, Polygon, polygon};
use crate::error::Error;
use crate::geometry::{MAX_COORDINATE, Point};

/// Lengths below this part of the objects' size are rounding: objects so near to each other touch.
const ROUNDING: f64 = 1e-12;

/// Two objects, prepared for any exponent and direction.
#[derive(Debug, Clone, Default)]
pub struct Pair {
    /// The corners of the argument, those of the referent, and where edges cross.
    knots: Vec<Point>,
    /// How many corners the argument has, and how many both have.
    corners: [usize; 2],
    /// Edges of the argument, then those of the referent, by the places of their ends.
    edges: Vec<[usize; 2]>,
    /// How many edges the argument has.
    argument_edges: usize,
    /// A circle around each object: its centre and radius.
    circles: [([f64; 2], f64); 2],
    /// Lengths up to this are rounding.
    rounding: f64,
}

/// What a direction needs: kept, so that nothing is allocated again.
#[derive(Debug, Clone, Default)]
pub struct Workspace {
    /// Sine and cosine of as many directions as were asked for last.
    turns: Vec<(f64, f64)>,
    /// The knots across and along the direction.
    turned: Vec<[f64; 2]>,
    /// Where strips begin and end.
    strips: Vec<f64>,
    argument: Cut,
    referent: Cut,
}

/// An object cut by parallels.
#[derive(Debug, Clone, Default)]
struct Cut {
    lines: Vec<Line>,
    crossings: Vec<[f64; 2]>,
    sections: Vec<Section>,
}

/// An edge: from where to where it goes across the direction, and the line along it.
#[derive(Debug, Clone, Copy)]
struct Line {
    low: f64,
    high: f64,
    at_low: f64,
    slope: f64,
}

impl Pair {
    /// The argument A and the referent B: the forces are large where A is, seen from B.
    pub fn new(argument: &Polygon, referent: &Polygon) -> Self {
        let mut pair = Self::default();
        pair.prepare(argument, referent);
        pair
    }

    /// Becomes another pair, in the memory that it has.
    pub fn prepare(&mut self, argument: &Polygon, referent: &Polygon) {
        let (a, b) = (argument.corners(), referent.corners());
        self.knots.clear();
        self.knots.extend(a.iter().chain(b));
        self.corners = [a.len(), self.knots.len()];
        self.edges.clear();
        self.edges.extend(argument.edge_places());
        self.argument_edges = self.edges.len();
        self.edges.extend(referent.edge_places().map(|edge| edge.map(|i| i + a.len())));
        let first = self.knots[0];
        self.rounding = self.knots.iter().map(|at| at.distance(first)).fold(0.0, f64::max) * ROUNDING;
        self.circles = [circle(a), circle(b)];
        for (i, edge) in self.edges.iter().enumerate() {
            for other in &self.edges[..i] {
                let [one, other] = [edge, other].map(|edge| edge.map(|at| self.knots[at]));
                self.knots.extend(polygon::crossing(one, other));
            }
        }
    }

    /// The force F_r(θ), with r the exponent of the distance.
    ///
    /// # Errors
    /// [`Error::Parameter`] where r is not from 0 to 16 or the angle is not finite.
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

    /// The forces in `directions` directions, from 0 on, evenly spaced.
    ///
    /// # Errors
    /// [`Error::Parameter`] where r is not from 0 to 16.
    pub fn histogram(&self, exponent: f64, directions: usize) -> Result<Vec<Force>, Error> {
        let mut forces = vec![Force::ZERO; directions];
        self.histogram_into(exponent, &mut forces, &mut Workspace::default())?;
        Ok(forces)
    }

    /// The same into a slice, in as many directions as it has places. Nothing is allocated once the workspace has
    /// seen objects of that many corners.
    ///
    /// # Errors
    /// [`Error::Parameter`] where r is not from 0 to 16.
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
        let Workspace { turned, strips, argument, referent, .. } = workspace;
        let (sin, cos) = turn;
        turned.clear();
        turned.extend(self.knots.iter().map(|at| [at.y() * cos - at.x() * sin, at.x() * cos + at.y() * sin]));
        let [a, b] = [&turned[..self.corners[0]], &turned[self.corners[0]..self.corners[1]]].map(extent);
        let [low, high] = [a.across[0].max(b.across[0]), a.across[1].min(b.across[1])];
        if high - low <= self.rounding || a.along[1] <= b.along[0] {
            return Force::ZERO;
        }
        strips.clear();
        strips.push(low);
        strips.extend(turned.iter().map(|at| at[0]).filter(|u| *u > low && *u < high));
        strips.push(high);
        strips.sort_unstable_by(f64::total_cmp);
        let (argument_edges, referent_edges) = self.edges.split_at(self.argument_edges);
        argument.lines(argument_edges, turned, [low, high]);
        referent.lines(referent_edges, turned, [low, high]);
        let mut force = Force::ZERO;
        for strip in strips.windows(2) {
            let strip = [strip[0], strip[1]];
            if strip[1] - strip[0] <= self.rounding {
                continue;
            }
            argument.cut(strip);
            referent.cut(strip);
            for a in &argument.sections {
                for b in &referent.sections {
                    force = force + mean_force(power, *a, *b, self.rounding).scaled(strip[1] - strip[0]);
                }
            }
        }
        force
    }

    /// Whether the circles around the objects show that no parallel meets the argument after the referent.
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

/// From where to where points go across a direction and along it.
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

/// A circle around points, with the middle of their extent as its centre.
fn circle(corners: &[Point]) -> ([f64; 2], f64) {
    let middle = |of: fn(Point) -> f64| {
        let values = || corners.iter().map(|at| of(*at));
        values().fold(f64::INFINITY, f64::min) / 2.0 + values().fold(f64::NEG_INFINITY, f64::max) / 2.0
    };
    let centre = [middle(Point::x), middle(Point::y)];
    let radius = corners.iter().map(|at| (at.x() - centre[0]).hypot(at.y() - centre[1])).fold(0.0, f64::max);
    (centre, radius)
}

impl Cut {
    /// Takes the edges that are between two parallels.
    fn lines(&mut self, edges: &[[usize; 2]], turned: &[[f64; 2]], [low, high]: [f64; 2]) {
        self.lines.clear();
        for [from, to] in edges {
            let (from, to) = (turned[*from], turned[*to]);
            let (from, to) = if from[0] < to[0] { (from, to) } else { (to, from) };
            if from[0] < to[0] && from[0] < high && to[0] > low {
                let slope = (to[1] - from[1]) / (to[0] - from[0]);
                self.lines.push(Line { low: from[0], high: to[0], at_low: from[1], slope });
            }
        }
    }

    /// The sections in a strip between two neighbouring knots.
    fn cut(&mut self, strip: [f64; 2]) {
        let middle = strip[0] + (strip[1] - strip[0]) / 2.0;
        self.crossings.clear();
        let crossing = |line: &Line| strip.map(|u| line.at_low + (u - line.low) * line.slope);
        let crossed = self.lines.iter().filter(|line| line.low < middle && middle <= line.high);
        self.crossings.extend(crossed.map(crossing));
        self.crossings.sort_unstable_by(|a, b| (a[0] + a[1]).total_cmp(&(b[0] + b[1])));
        self.sections.clear();
        self.sections.extend(self.crossings.chunks_exact(2).map(|ends| [ends[0], ends[1]]));
    }
}

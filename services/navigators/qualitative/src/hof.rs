//! The histogram of forces between two polygons (Matsakis and Wendling 1999): how much of one is in each direction of
//! the other, near parts counting more.
//!
//! The force of an argument A on a referent B in direction θ is that of all pairs of points p in A and q in B, with
//! p − q in direction θ, each attracting by |p − q|^−r:
//!
//! F_r(θ) = ∫ du ∬ (p − q)^−r dp dq, the inner integrals along the parallels at θ, u across them.
//!
//! F_0 is the histogram of constant forces, F_2 that of gravitational ones. Its integral over all directions is
//! ∬ |p − q|^−(r + 1) dp dq over both areas. θ is counter-clockwise from the first axis.
//!
//! The integrals are in closed form. The parallels through all vertices and crossings of edges cut the plane into
//! strips. Within a strip each end of a section is linear in u. So the double integral of a power of a distance is a
//! difference of four powers. Its integral over the strip is a difference quotient. Where the objects are far
//! from each other for their size these differences would cancel; Gauss's quadrature takes their place there.
//!
//! A force is infinite, and is said to be ([`Force::Infinite`]), where for r ≥ 1 the objects overlap in the direction;
//! where for r ≥ 2 they touch along an edge; and where for r ≥ 3 they touch at a point.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::ops::Add;

use crate::error::Error;
use crate::geometry::{MAX_COORDINATE, Point, not_negative};

/// A polygon; where its edges cross, the even-odd rule says what is inside.
#[derive(Debug, Clone, PartialEq)]
pub struct Polygon {
    corners: Vec<Point>,
}

impl Polygon {
    /// A polygon by its corners, in either order.
    ///
    /// # Errors
    /// [`Error::Extent`] where there are fewer than three corners, or all in one line.
    pub fn new(corners: impl IntoIterator<Item = Point>) -> Result<Self, Error> {
        let corners: Vec<_> = corners.into_iter().collect();
        let first = corners.first().copied();
        let spans =
            |first: Point| corners.windows(2).any(|pair| (pair[0] - first).cross(pair[1] - first) != 0.0);
        if first.is_some_and(spans) {
            Ok(Self { corners })
        } else {
            Err(Error::Extent { what: "polygon", found: 0.0 })
        }
    }

    /// Its corners.
    pub fn corners(&self) -> &[Point] {
        &self.corners
    }

    fn edges(&self) -> impl Iterator<Item = [Point; 2]> + '_ {
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().zip(next).map(|(from, to)| [*from, *to])
    }
}

/// A force in a direction.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub enum Force {
    /// A number from 0.
    Finite(f64),
    /// More than any number: the objects touch or overlap.
    Infinite,
}

impl Force {
    /// The number; `None` for an infinite force.
    pub const fn finite(self) -> Option<f64> {
        match self {
            Self::Finite(force) => Some(force),
            Self::Infinite => None,
        }
    }
}

impl Add for Force {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        match (self, other) {
            (Self::Finite(a), Self::Finite(b)) => Self::Finite(a + b),
            _ => Self::Infinite,
        }
    }
}

/// Lengths below this part of the objects' size are rounding: objects so near to each other touch.
const ROUNDING: f64 = 1e-12;
/// Sections that are farther apart than so many of their lengths are taken by quadrature.
const FAR: f64 = 4.0;

/// Two polygons, prepared for any exponent and direction.
#[derive(Debug, Clone)]
pub struct Pair<'a> {
    argument: &'a Polygon,
    referent: &'a Polygon,
    /// The corners of both, and where edges cross.
    knots: Vec<Point>,
    /// Lengths up to this are rounding.
    rounding: f64,
}

/// A section of an object by a parallel, at both sides of a strip: its low and its high end.
type Section = [[f64; 2]; 2];

/// What a direction needs: kept, so that nothing is allocated again.
#[derive(Debug, Clone, Default)]
pub struct Workspace {
    knots: Vec<f64>,
    crossings: Vec<[f64; 2]>,
    argument: Vec<Section>,
    referent: Vec<Section>,
}

impl<'a> Pair<'a> {
    /// The argument A and the referent B: the forces are large where A is, seen from B.
    pub fn new(argument: &'a Polygon, referent: &'a Polygon) -> Self {
        let mut knots: Vec<_> = argument.corners.iter().chain(&referent.corners).copied().collect();
        let size = knots.iter().map(|at| at.distance(knots[0])).fold(0.0, f64::max);
        let edges: Vec<_> = argument.edges().chain(referent.edges()).collect();
        for (i, edge) in edges.iter().enumerate() {
            knots.extend(edges[..i].iter().filter_map(|other| crossing(*edge, *other)));
        }
        Self { argument, referent, knots, rounding: size * ROUNDING }
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
        let power = Power::new(exponent)?;
        let mut workspace = Workspace::default();
        let angle = |i: usize| i as f64 / directions as f64 * TAU;
        Ok((0..directions).map(|i| self.force_along(power, angle(i).sin_cos(), &mut workspace)).collect())
    }

    fn force_along(&self, power: Power, (sin, cos): (f64, f64), workspace: &mut Workspace) -> Force {
        let turned = |at: Point| [at.y() * cos - at.x() * sin, at.x() * cos + at.y() * sin];
        let mut knots = std::mem::take(&mut workspace.knots);
        knots.clear();
        knots.extend(self.knots.iter().map(|at| turned(*at)[0]));
        knots.sort_by(f64::total_cmp);
        let strips = knots.windows(2).map(|strip| [strip[0], strip[1]]);
        let mut force = Force::Finite(0.0);
        for strip in strips.filter(|[low, high]| high - low > self.rounding) {
            let crossings = &mut workspace.crossings;
            sections(self.argument, &turned, strip, crossings, &mut workspace.argument);
            sections(self.referent, &turned, strip, crossings, &mut workspace.referent);
            for a in &workspace.argument {
                for b in &workspace.referent {
                    let mean = match mean_force(power, *a, *b, self.rounding) {
                        Force::Finite(mean) => Force::Finite(mean * (strip[1] - strip[0])),
                        Force::Infinite => Force::Infinite,
                    };
                    force = force + mean;
                }
            }
        }
        workspace.knots = knots;
        force
    }
}

/// Where two edges cross, their ends left out.
fn crossing([a, b]: [Point; 2], [c, d]: [Point; 2]) -> Option<Point> {
    let (ab, cd, ac) = (b - a, d - c, c - a);
    let turn = ab.cross(cd);
    let (s, t) = (ac.cross(cd) / turn, ac.cross(ab) / turn);
    let is_inside = s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0;
    if is_inside { Point::new(a.x() + s * ab.x, a.y() + s * ab.y).ok() } else { None }
}

/// The sections of a polygon in a strip between two neighbouring knots.
fn sections(
    polygon: &Polygon,
    turned: &impl Fn(Point) -> [f64; 2],
    strip: [f64; 2],
    crossings: &mut Vec<[f64; 2]>,
    found: &mut Vec<Section>,
) {
    let middle = strip[0] + (strip[1] - strip[0]) / 2.0;
    crossings.clear();
    for [from, to] in polygon.edges().map(|edge| edge.map(turned)) {
        if (from[0] < middle) != (to[0] < middle) {
            let slope = (to[1] - from[1]) / (to[0] - from[0]);
            crossings.push(strip.map(|u| from[1] + (u - from[0]) * slope));
        }
    }
    crossings.sort_by(|a, b| (a[0] + a[1]).total_cmp(&(b[0] + b[1])));
    found.clear();
    found.extend(crossings.chunks_exact(2).map(|ends| [ends[0], ends[1]]));
}

/// The exponent r of a force, with what follows from it.
#[derive(Debug, Clone, Copy)]
struct Power {
    r: f64,
}

impl Power {
    fn new(r: f64) -> Result<Self, Error> {
        const MOST: f64 = 16.0;
        let found = not_negative("exponent", r)?;
        if found <= MOST {
            Ok(Self { r })
        } else {
            Err(Error::Parameter { what: "exponent", expected: "0 to 16", found })
        }
    }

    /// t^−r.
    fn law(self, t: f64) -> f64 {
        t.powf(-self.r)
    }

    /// A second integral of t^−r, that is 0 at 0 where one is.
    fn second(self, t: f64) -> f64 {
        if t <= 0.0 {
            0.0
        } else if self.r == 1.0 {
            t * t.ln()
        } else if self.r == 2.0 {
            -t.ln()
        } else {
            t.powf(2.0 - self.r) / ((1.0 - self.r) * (2.0 - self.r))
        }
    }

    /// A third integral, that is 0 at 0 where one is.
    fn third(self, t: f64) -> f64 {
        if t <= 0.0 {
            0.0
        } else if self.r == 1.0 {
            t * t * (t.ln() / 2.0 - 0.25)
        } else if self.r == 2.0 {
            t - t * t.ln()
        } else if self.r == 3.0 {
            t.ln() / 2.0
        } else {
            t.powf(3.0 - self.r) / ((1.0 - self.r) * (2.0 - self.r) * (3.0 - self.r))
        }
    }

    /// The mean of the second integral over a strip in which t goes from one number to another, both of one sign.
    fn mean(self, [from, to]: [f64; 2]) -> f64 {
        let (from, to) = (from.max(0.0), to.max(0.0));
        let difference = to - from;
        if self.r == 0.0 {
            (from * from + from * to + to * to) / 6.0
        } else if difference.abs() > 0.05 * from.max(to) {
            (self.third(to) - self.third(from)) / difference
        } else {
            GAUSS.iter().map(|(at, weight)| weight * self.second(from + at * difference)).sum()
        }
    }
}

/// Gauss's quadrature on [0, 1], with five places: each with its weight.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668_02, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

/// The mean over a strip of the force between a section of the argument and one of the referent.
fn mean_force(power: Power, [a_low, a_high]: Section, [b_low, b_high]: Section, rounding: f64) -> Force {
    let apart = |a: [f64; 2], b: [f64; 2]| [0, 1].map(|i| a[i] - b[i]);
    // What is within rounding of 0 at both sides is 0, so that the two have one sign.
    let rounded = |t: [f64; 2]| t.map(|t| if t.abs() <= rounding { 0.0 } else { t });
    let whole = rounded(apart(a_high, b_low));
    let gap = rounded(apart(a_low, b_high));
    if whole[0] <= 0.0 && whole[1] <= 0.0 {
        return Force::Finite(0.0);
    }
    let overlaps = gap[0] < 0.0 || gap[1] < 0.0;
    let touches_along = gap == [0.0; 2];
    let touches = gap[0] == 0.0 || gap[1] == 0.0;
    let is_section = |low: [f64; 2], high: [f64; 2]| (0..2).any(|i| high[i] - low[i] > rounding);
    if !is_section(a_low, a_high) || !is_section(b_low, b_high) {
        return Force::Finite(0.0);
    }
    if (overlaps && power.r >= 1.0) || (touches_along && power.r >= 2.0) || (touches && power.r >= 3.0) {
        return Force::Infinite;
    }
    let longest =
        [0, 1].map(|i| (a_high[i] - a_low[i]).max(b_high[i] - b_low[i])).into_iter().fold(0.0, f64::max);
    if power.r > 0.0 && gap[0].min(gap[1]) > FAR * longest {
        return Force::Finite(by_quadrature(power, [a_low, a_high], [b_low, b_high], 0));
    }
    let [a_begin, b_end] = [rounded(apart(a_low, b_low)), rounded(apart(a_high, b_high))];
    Force::Finite((power.mean(whole) - power.mean(a_begin) - power.mean(b_end) + power.mean(gap)).max(0.0))
}

/// The same for sections that are far from each other; the strip is halved until the distance is about one.
fn by_quadrature(power: Power, a: Section, b: Section, depth: u32) -> f64 {
    let gap = [0, 1].map(|i| a[0][i] - b[1][i]);
    if gap[0].max(gap[1]) > 2.0 * gap[0].min(gap[1]) && depth < 40 {
        let half = |section: Section, first: bool| {
            section.map(|[from, to]| {
                let middle = from + (to - from) / 2.0;
                if first { [from, middle] } else { [middle, to] }
            })
        };
        let part = |first: bool| by_quadrature(power, half(a, first), half(b, first), depth + 1);
        return (part(true) + part(false)) / 2.0;
    }
    let between = |[from, to]: [f64; 2], at: f64| from + (to - from) * at;
    let mut sum = 0.0;
    for (u, u_weight) in GAUSS {
        let [[a_low, a_high], [b_low, b_high]] = [a, b].map(|section| section.map(|end| between(end, u)));
        let area = (a_high - a_low) * (b_high - b_low);
        for (p, p_weight) in GAUSS {
            for (q, q_weight) in GAUSS {
                let distance = between([a_low, a_high], p) - between([b_low, b_high], q);
                sum += u_weight * p_weight * q_weight * area * power.law(distance);
            }
        }
    }
    sum
}

/// How true it is that the argument is in a direction of the referent, from 0 to 1, by a histogram of directions from 0
/// on that are evenly spaced (after Matsakis et al. 2001). `None` where a force is infinite or none is above 0.
///
/// Forces more than a right angle off `direction_rad` speak against it. Their moments about the right angle on their
/// side cancel as much of the moments of the forces within, from that right angle on inwards. What is left is
/// effective. The degree is 1 − |mean angle of the effective forces| / (π/2), times their share of all forces.
///
/// Matsakis et al. also tell optimal forces from others by a threshold. That is not done here.
pub fn degree_of_truth(histogram: &[Force], direction_rad: f64) -> Option<f64> {
    let turned = |i: usize| {
        let off = i as f64 / histogram.len() as f64 * TAU - direction_rad;
        off - TAU * (off / TAU).round()
    };
    let forces = histogram.iter().enumerate().map(|(i, force)| Some((turned(i), force.finite()?)));
    let mut forces: Vec<(f64, f64)> = forces.collect::<Option<_>>()?;
    let all: f64 = forces.iter().map(|(_, force)| force).sum();
    if all <= 0.0 {
        return None;
    }
    forces.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let beyond = |side: f64| {
        let moments = forces.iter().map(|(off, force)| (side * off - FRAC_PI_2).max(0.0) * force);
        moments.sum::<f64>()
    };
    let [left, right] = [beyond(1.0), beyond(-1.0)];
    let mut within: Vec<_> = forces.into_iter().filter(|(off, _)| off.abs() < FRAC_PI_2).collect();
    let is_outdone = cancel(within.iter_mut(), -1.0, right) || cancel(within.iter_mut().rev(), 1.0, left);
    let effective: f64 = within.iter().map(|(_, force)| force).sum();
    if is_outdone || effective <= 0.0 {
        return Some(0.0);
    }
    let mean = within.iter().map(|(off, force)| off * force).sum::<f64>() / effective;
    Some((1.0 - mean.abs() / FRAC_PI_2).max(0.0) * effective / all)
}

/// Takes a moment about the right angle of a side from forces, the outermost first. Whether it is more than they have.
fn cancel<'a>(forces: impl Iterator<Item = &'a mut (f64, f64)>, side: f64, mut moment: f64) -> bool {
    for (off, force) in forces {
        let arm = FRAC_PI_2 - side * *off;
        let taken = moment.min(arm * *force);
        moment -= taken;
        *force -= taken / arm;
    }
    moment > 0.0
}

//! The force that one section of an object exerts on another along parallels, in closed form.
//!
//! Within a strip, each end of a section is linear across the parallels. The double integral of a power of the distance is
//! therefore a difference of four powers, and its integral over the strip is a difference quotient. If the objects are far
//! apart compared to their size, these differences would cancel, so Gaussian quadrature is used instead.

use super::Force;
use crate::error::Error;
use crate::geometry::not_negative;

/// Ratio of distance to section length above which sections are integrated by quadrature.
const FAR: f64 = 4.0;
/// Ratio below which a distance that changes within a strip counts as nearly constant. Five points then give its logarithm to
/// 1e-10.
const STEADY: f64 = 1.4;

/// The section of an object cut by a parallel, at both sides of a strip: first the low end, then the high end.
pub(super) type Section = [[f64; 2]; 2];

/// The exponent r of a force, and the integrals of its law.
#[derive(Debug, Clone, Copy)]
pub(super) struct Power {
    r: f64,
}

impl Power {
    pub(super) fn new(r: f64) -> Result<Self, Error> {
        const MOST: f64 = 16.0;
        let found = not_negative("exponent", r)?;
        if found <= MOST {
            Ok(Self { r })
        } else {
            Err(Error::Parameter { what: "exponent", expected: "0 to 16", found })
        }
    }

    /// Returns true if forces do not depend on distance.
    pub(super) fn is_constant(self) -> bool {
        self.r == 0.0
    }

    /// Returns t^−r.
    fn law(self, t: f64) -> f64 {
        t.powf(-self.r)
    }

    /// Returns the second integral of t^−r, choosing the one that is 0 at 0 if there is one.
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

    /// Returns the third integral of t^−r, choosing the one that is 0 at 0 if there is one.
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

    /// Returns the mean of the second integral over a strip in which t changes linearly between two numbers of the same sign.
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

/// Points and weights of five-point Gaussian quadrature on [0, 1].
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668_02, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

/// Returns the mean, over a strip, of the force between a section of the argument and one of the referent.
pub(super) fn mean_force(
    power: Power,
    [a_low, a_high]: Section,
    [b_low, b_high]: Section,
    rounding: f64,
) -> Force {
    let is_after = a_low[0] - b_high[0] > rounding && a_low[1] - b_high[1] > rounding;
    if power.r == 0.0 && is_after {
        return Force::Finite(constant([a_low, a_high], [b_low, b_high]));
    }
    let apart = |a: [f64; 2], b: [f64; 2]| [0, 1].map(|i| a[i] - b[i]);
    // Values that are 0 up to rounding are set to 0, so that both sides of the strip have the same sign.
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
    let [a_begin, b_end] = [rounded(apart(a_low, b_low)), rounded(apart(a_high, b_high))];
    let is_steady = |t: [f64; 2]| t[0].max(t[1]) < STEADY * t[0].min(t[1]);
    if power.r == 2.0 && [gap, whole, a_begin, b_end].into_iter().all(is_steady) {
        return Force::Finite(gravitational([a_low, a_high], [b_low, b_high]));
    }
    let far = FAR * longest([a_low, a_high], [b_low, b_high]);
    if power.r > 0.0 && gap[0].min(gap[1]) > far {
        return Force::Finite(by_quadrature(power, [a_low, a_high], [b_low, b_high], 0));
    }
    Force::Finite((power.mean(whole) - power.mean(a_begin) - power.mean(b_end) + power.mean(gap)).max(0.0))
}

/// Returns the length of the longest of two sections at both sides of a strip.
fn longest(a: Section, b: Section) -> f64 {
    [a, b].iter().flat_map(|[low, high]| [high[0] - low[0], high[1] - low[1]]).fold(0.0, f64::max)
}

/// Returns F_0 of sections with a gap between them. It is the product of their lengths x and z, which are linear in the
/// strip.
fn constant(a: Section, b: Section) -> f64 {
    let [x, z] = [a, b].map(|[low, high]| [0, 1].map(|i| high[i] - low[i]));
    // If a section is only a rounding error, its length may be negative.
    ((2.0 * (x[0] * z[0] + x[1] * z[1]) + x[0] * z[1] + x[1] * z[0]) / 6.0).max(0.0)
}

/// Returns F_2 of sections with a gap y between them that changes little in the strip: ln[(x + y)(y + z) / (y(x + y + z))].
/// The equivalent form ln(1 + xz / (y(x + y + z))) loses no digits, however far apart the sections are.
fn gravitational([a_low, a_high]: Section, [b_low, b_high]: Section) -> f64 {
    let between = |[from, to]: [f64; 2], at: f64| from + (to - from) * at;
    let part = |(at, weight)| {
        let [a_low, a_high, b_low, b_high] = [a_low, a_high, b_low, b_high].map(|end| between(end, at));
        let excess = (a_high - a_low) * (b_high - b_low) / ((a_low - b_high) * (a_high - b_low));
        weight * ln_of_one_and(excess)
    };
    GAUSS.into_iter().map(part).sum()
}

/// Returns ln(1 + q) to a relative accuracy of 1e-13.
fn ln_of_one_and(q: f64) -> f64 {
    if q > 1e-3 { (1.0 + q).ln() } else { q * (1.0 - q * (0.5 - q * (1.0 / 3.0 - q * (0.25 - q * 0.2)))) }
}

/// Returns the force between sections that are far from each other, by quadrature. The strip is halved until the gaps at
/// its two sides differ by at most a factor of two.
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

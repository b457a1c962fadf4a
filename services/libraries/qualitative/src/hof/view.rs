//! Interpretation of a histogram of forces: how true it is that the argument is in a direction, whether a single direction
//! describes its position at all, how wide the argument appears, and whether it surrounds the referent.
//!
//! Sources: Matsakis et al. 2001 for the degree of truth, and Chronis 2007, 3.2.2, for the sixteen directions and the
//! surround relations. Nothing in this module allocates.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, PI, TAU};

use serde::{Deserialize, Serialize};

use super::Force;

/// A histogram seen relative to a heading. The directions of the histogram itself are those of the plane, evenly spaced
/// from 0. Since the view turns the histogram rather than the objects, a new heading needs no new histogram. Directions
/// passed to and returned by the methods are counter-clockwise from the heading.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    forces: &'a [Force],
    heading_rad: f64,
}

/// The direction that best describes the position of the argument.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Assessment {
    /// The index of the direction, counter-clockwise from 0 at the heading.
    pub direction: usize,
    /// Degree of truth, from 0 to 1, of the statement that the argument is in this direction.
    pub degree: f64,
}

/// How well a single direction describes the position of the argument.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Grade {
    /// No single direction describes the position: use [`Surround`] instead.
    Unsatisfactory,
    /// The argument is in this direction, but extends to others.
    RatherSatisfactory,
    /// The argument is in this direction.
    Satisfactory,
}

/// How the argument surrounds the referent (Chronis 2007, 3.2.2). The values are indices of directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Surround {
    /// The argument surrounds the referent from the side of the main direction.
    From(usize),
    /// The argument surrounds the referent except for an opening in this direction, which is opposite the main one.
    OpeningAt(usize),
    /// The argument surrounds the referent on all sides.
    Completely,
}

impl Assessment {
    /// Returns the grade of the assessment. Neither Matsakis et al. 2001 nor Chronis 2007 gives thresholds, so these are our
    /// own. With constant forces, a ring that covers 240° around the referent has a degree of 0.5.
    pub fn grade(self) -> Grade {
        match self.degree {
            degree if degree >= 0.75 => Grade::Satisfactory,
            degree if degree >= 0.5 => Grade::RatherSatisfactory,
            _ => Grade::Unsatisfactory,
        }
    }
}

impl Surround {
    /// Returns the surround relation for the width of a histogram of constant forces, or `None` if the width is below π/3. From
    /// π/3 to 2π/3, the referent is surrounded from the main direction. Above 2π/3, it is surrounded except for an opening if
    /// it can escape, and completely if it cannot.
    pub fn by_width(width_rad: f64, main: usize, directions: usize, can_escape: bool) -> Option<Self> {
        if width_rad < FRAC_PI_3 {
            None
        } else if width_rad <= 2.0 * FRAC_PI_3 {
            Some(Self::From(main))
        } else if can_escape {
            Some(Self::OpeningAt((main + directions / 2) % directions))
        } else {
            Some(Self::Completely)
        }
    }
}

impl<'a> View<'a> {
    /// Creates a view of a histogram relative to a heading.
    pub const fn new(forces: &'a [Force], heading_rad: f64) -> Self {
        Self { forces, heading_rad }
    }

    /// Returns the degree to which the argument is in a direction. See [`degree_of_truth`].
    pub fn degree(&self, direction_rad: f64) -> Option<f64> {
        degree_of_truth(self.forces, self.heading_rad + direction_rad)
    }

    /// Returns the best of `directions` directions. If several are equally good, returns the first. Returns `None` if no degree is
    /// known.
    pub fn assess(&self, directions: usize) -> Option<Assessment> {
        best(directions, |direction_rad| self.degree(direction_rad))
    }

    /// Like [`Self::assess`], but uses the lesser of the degrees of two histograms: `self`, of constant forces, and
    /// `gravitational`. If gravitational forces are infinite, only constant forces count.
    pub fn assess_with(&self, gravitational: &Self, directions: usize) -> Option<Assessment> {
        best(directions, |direction_rad| {
            let constant = self.degree(direction_rad)?;
            Some(gravitational.degree(direction_rad).map_or(constant, |degree| degree.min(constant)))
        })
    }

    /// Returns the width of the histogram, in radians: the part of a full turn over which there are forces, from 0 to 2π.
    pub fn width_rad(&self) -> f64 {
        let some = self.forces.iter().filter(|force| force.is_some()).count();
        some as f64 * TAU / self.forces.len() as f64
    }

    /// Returns the middle of the widest opening, from −π to π, and its width, in radians. An opening is a range of directions
    /// without forces. Returns `None` if there are forces all around.
    pub fn opening(&self) -> Option<(f64, f64)> {
        let count = self.forces.len();
        let step = TAU / count as f64;
        let mut widest = (0, 0);
        let mut run = 0;
        for i in 0..2 * count {
            run = if self.forces[i % count].is_some() { 0 } else { (run + 1).min(count) };
            if run > widest.1 {
                widest = (i, run);
            }
        }
        let (last, run) = widest;
        let middle = (last as f64 - (run.saturating_sub(1)) as f64 / 2.0) * step - self.heading_rad;
        (run > 0).then(|| (middle - TAU * (middle / TAU).round(), run as f64 * step))
    }
}

fn best(directions: usize, degree: impl Fn(f64) -> Option<f64>) -> Option<Assessment> {
    let mut best: Option<Assessment> = None;
    for direction in 0..directions {
        let degree = degree(direction as f64 / directions as f64 * TAU)?;
        // Mirror images differ by rounding errors, which must not decide between equally good directions.
        if best.is_none_or(|best| degree > best.degree + 1e-12) {
            best = Some(Assessment { direction, degree });
        }
    }
    best
}

/// Returns the degree to which the argument is in a direction of the referent, from 0 to 1 (after Matsakis et al. 2001). The
/// directions of the histogram are evenly spaced from 0. Returns `None` if a force is infinite or if no force is above 0.
///
/// - Forces more than a right angle off `direction_rad` contradict it. On each side, the moments of these forces about the
///   right angle cancel the same amount of moments of the forces within, starting at the right angle and moving inwards.
///   The forces that remain are called effective.
/// - A threshold separates the optimal part of each effective force from the rest. The threshold is the weighted mean of
///   the effective forces, with weights of 1 up to a quarter of a right angle off the direction, falling to 0 at a half.
///   The part of a force up to the threshold is optimal and counts as if it were in the direction; the part above the
///   threshold keeps its angle.
/// - The degree is 1 − |mean angle| / (π/2), multiplied by the share of effective forces in all forces.
pub fn degree_of_truth(histogram: &[Force], direction_rad: f64) -> Option<f64> {
    let bins = Bins::new(histogram, direction_rad);
    let mut all = 0.0;
    // Moments of the contradicting forces on the left and right, and the range of bins within a right angle.
    let mut moments = [0.0; 2];
    let mut within = [usize::MAX, 0];
    for k in 0..histogram.len() {
        let (off, force) = bins.get(k)?;
        all += force;
        if off.abs() < FRAC_PI_2 {
            within = [within[0].min(k), k + 1];
        } else {
            moments[usize::from(off < 0.0)] += (off.abs() - FRAC_PI_2) * force;
        }
    }
    if all <= 0.0 {
        return None;
    }
    let effective = Effective::new(&bins, within, moments);
    let sum: f64 = effective.clone().map(|(_, force)| force).sum();
    if sum <= 1e-12 * all {
        return Some(0.0);
    }
    let weigh = |(force, weight): (f64, f64), (off, of): (f64, f64)| {
        let trapezoid = ((0.5 - off.abs() / FRAC_PI_2) / 0.25).clamp(0.0, 1.0);
        (force + trapezoid * of, weight + trapezoid)
    };
    let (force, weight) = effective.clone().fold((0.0, 0.0), weigh);
    let threshold = if weight > 0.0 { force / weight } else { 0.0 };
    let mean = effective.map(|(off, force)| off * (force - threshold).max(0.0)).sum::<f64>() / sum;
    Some((1.0 - mean.abs() / FRAC_PI_2).max(0.0) * sum / all)
}

/// The bins of a histogram in order, going all the way around from the direction opposite `direction_rad`.
#[derive(Debug, Clone, Copy)]
struct Bins<'a> {
    histogram: &'a [Force],
    direction_rad: f64,
    begin: f64,
    first: usize,
}

impl<'a> Bins<'a> {
    fn new(histogram: &'a [Force], direction_rad: f64) -> Self {
        let count = histogram.len() as f64;
        let begin = ((direction_rad - PI) / TAU * count).ceil();
        Self { histogram, direction_rad, begin, first: begin.rem_euclid(count) as usize }
    }

    /// Returns the angle between a bin and the direction, from −π to π, and the force of the bin.
    fn get(&self, k: usize) -> Option<(f64, f64)> {
        let count = self.histogram.len();
        let off = (self.begin + k as f64) / count as f64 * TAU - self.direction_rad;
        let place = self.first + k;
        Some((off, self.histogram[if place < count { place } else { (place - count) % count }].finite()?))
    }
}

/// The effective forces: those within a right angle of the direction, less what contradicting moments cancel from either
/// side.
#[derive(Debug, Clone)]
struct Effective<'a> {
    bins: &'a Bins<'a>,
    places: std::ops::Range<usize>,
    /// The first bin with effective forces, and how much of its force is cancelled.
    low: (usize, f64),
    /// The last bin with effective forces, and how much of its force is cancelled.
    high: (usize, f64),
}

impl<'a> Effective<'a> {
    fn new(bins: &'a Bins<'a>, [begin, end]: [usize; 2], [left, right]: [f64; 2]) -> Self {
        let mut found =
            Self { bins, places: begin.min(end)..end, low: (usize::MAX, 0.0), high: (usize::MAX, 0.0) };
        found.low = found.cancelled(found.places.clone(), right, -1.0, (usize::MAX, 0.0));
        if found.low.0 == usize::MAX {
            found.places = end..end;
            return found;
        }
        found.places.start = found.low.0;
        found.high = found.cancelled(found.places.clone().rev(), left, 1.0, found.low);
        match found.high.0 {
            usize::MAX => found.places = end..end,
            last => found.places.end = last + 1,
        }
        found
    }

    /// Returns the bin at which a moment about the right angle of a side is used up, and how much of the force there is
    /// cancelled.
    fn cancelled(
        &self,
        places: impl Iterator<Item = usize>,
        mut moment: f64,
        side: f64,
        gone: (usize, f64),
    ) -> (usize, f64) {
        for k in places {
            let (off, force) = self.bins.get(k).unwrap_or((0.0, 0.0));
            let force = if k == gone.0 { force - gone.1 } else { force };
            let arm = FRAC_PI_2 - side * off;
            if moment < arm * force || moment == 0.0 {
                return (k, moment / arm);
            }
            moment -= arm * force;
        }
        (usize::MAX, 0.0)
    }
}

impl Iterator for Effective<'_> {
    type Item = (f64, f64);

    fn next(&mut self) -> Option<(f64, f64)> {
        let k = self.places.next()?;
        let (off, force) = self.bins.get(k)?;
        let gone = [self.low, self.high].map(|(place, gone)| if place == k { gone } else { 0.0 });
        Some((off, (force - gone[0] - gone[1]).max(0.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn histogram(of_degrees: impl Fn(usize) -> f64) -> Vec<Force> {
        (0..360).map(|degrees| Force::Finite(of_degrees(degrees))).collect()
    }

    fn is_near(found: Option<f64>, expected: f64) {
        assert!((found.unwrap() - expected).abs() < 1e-9, "{found:?}, {expected}");
    }

    #[test]
    fn a_single_force_satisfies_a_direction_by_its_angle() {
        let one = histogram(|degrees| f64::from(degrees == 60));
        is_near(degree_of_truth(&one, 0.0), 1.0 / 3.0);
        is_near(degree_of_truth(&one, FRAC_PI_3), 1.0);
        is_near(degree_of_truth(&one, -FRAC_PI_2), 0.0);
        is_near(View::new(&one, FRAC_PI_3).degree(0.0), 1.0);
    }

    #[test]
    fn the_part_up_to_the_threshold_counts_as_straight() {
        // The same force at every degree over 45° on one side. The weights have an integral of 0.75 × 45° over both sides, so the
        // threshold is half of the force, and half of the mean angle of 22.5° remains.
        let side = histogram(|degrees| f64::from(degrees <= 45));
        let weight = |off: usize| ((0.5 - off as f64 / 90.0) / 0.25).clamp(0.0, 1.0);
        let [one, both] = [(0..=45).map(weight).sum::<f64>(), (1..=45).map(weight).sum::<f64>() * 2.0 + 1.0];
        let mean = 22.5 * (1.0 - one / both);
        is_near(degree_of_truth(&side, 0.0), 1.0 - mean / 90.0);
    }

    #[test]
    fn contradicting_forces_cancel_by_moments() {
        // 1 at 120° (30° beyond the right angle) cancels a third of 1 at 0° (an arm of 90°).
        let two = histogram(|degrees| f64::from(degrees == 0 || degrees == 120));
        let threshold_has_it_straight = (1.0 - 1.0 / 3.0) / 2.0;
        is_near(degree_of_truth(&two, 0.0), threshold_has_it_straight);
        // One force on each side cancels two thirds. Three on each side would cancel more than there is.
        let three = histogram(|degrees| f64::from([0, 120, 240].contains(&degrees)));
        is_near(degree_of_truth(&three, 0.0), (1.0 / 3.0) / 3.0);
        let many = histogram(|degrees| match degrees {
            0 => 1.0,
            120 | 240 => 3.0,
            _ => 0.0,
        });
        is_near(degree_of_truth(&many, 0.0), 0.0);
    }

    #[test]
    fn a_ring_of_240_degrees_is_the_boundary_case() {
        let ring =
            |half: usize| histogram(move |degrees| f64::from(degrees <= half || degrees >= 360 - half));
        let grade = |half| View::new(&ring(half), 0.0).assess(16).unwrap();
        assert_eq!(grade(20).grade(), Grade::Satisfactory);
        assert_eq!(grade(110).grade(), Grade::RatherSatisfactory);
        assert_eq!(grade(125).grade(), Grade::Unsatisfactory);
        assert_eq!(grade(125).direction, 0);
        assert!(grade(180).degree < 1e-9);
    }

    #[test]
    fn widths_name_surround_relations() {
        let degrees = |width: f64, escapes| Surround::by_width(width.to_radians(), 14, 16, escapes);
        assert_eq!(degrees(59.0, true), None);
        assert_eq!(degrees(61.0, true), Some(Surround::From(14)));
        assert_eq!(degrees(119.0, false), Some(Surround::From(14)));
        assert_eq!(degrees(121.0, true), Some(Surround::OpeningAt(6)));
        assert_eq!(degrees(300.0, false), Some(Surround::Completely));
    }

    #[test]
    fn an_opening_is_where_there_is_no_force() {
        let gap = histogram(|degrees| f64::from(!(80..=120).contains(&degrees)));
        let (middle, width) = View::new(&gap, 0.0).opening().unwrap();
        assert!((middle.to_degrees() - 100.0).abs() < 1e-9 && (width.to_degrees() - 41.0).abs() < 1e-9);
        let (middle, _) = View::new(&gap, 190_f64.to_radians()).opening().unwrap();
        assert!((middle.to_degrees() + 90.0).abs() < 1e-9);
        // An opening across the first direction, no opening, and no forces at all.
        let across = histogram(|degrees| f64::from((10..350).contains(&degrees)));
        assert!(View::new(&across, 0.0).opening().unwrap().0.to_degrees().abs() < 1.0);
        assert_eq!(View::new(&histogram(|_| 1.0), 0.0).opening(), None);
        assert!((View::new(&histogram(|_| 0.0), 0.0).opening().unwrap().1 - TAU).abs() < 1e-9);
        assert!((View::new(&gap, 0.0).width_rad().to_degrees() - 319.0).abs() < 1e-9);
    }
}

//! A hypothesis of a [`crate::belief`]: a pose in the drawing, the stretch there, and the shifts of the objects near it. It is
//! compared with the robot's view.

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Base, Point};

use crate::belief::Believing;
use crate::drawn::{Drawn, DrawnMetres, Stretch};
use crate::memory::polar;
use crate::outlines::Outline;
use crate::shift::{Off, Prior, Shift};

/// Maximum number of objects whose shifts a hypothesis remembers: those nearest to it.
const NEAR: usize = 8;
/// Spacing of the points of a beam that are compared with objects, in metres.
pub const PROBE_M: f64 = 0.3;
/// Maximum distance between an object and an echo assigned to it: in drawn metres, and as the square of the distance divided by its
/// variance.
const GATE_M: f32 = 1.5;
const GATE_SQUARE: f32 = 16.0;
/// Density of echoes from objects that were not drawn, per drawn metre.
const ANYWHERE: f32 = 0.25;
/// Error of a marker's position, as a share of its distance.
const MARKER_LATERAL: f64 = 0.05;

/// The estimated shift of one object near a hypothesis.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Known {
    /// Number of the object, from 1, or 0 for none.
    number: u32,
    shift: Shift,
}

/// A hypothesis: a pose in the drawing, the stretch there, the shifts of the objects near it, and a weight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Hypothesis {
    /// Position in the drawing.
    pub at: Point<Drawn>,
    /// Heading in the drawing, in radians.
    pub heading_rad: f64,
    /// Stretch along each axis of the drawing.
    pub stretch: [f64; 2],
    /// Care: factor on how far objects and route are out of position.
    pub care: f64,
    /// Weight among all hypotheses.
    pub weight: f64,
    /// Shifts of the objects near the pose.
    pub near: [Known; NEAR],
}

impl Hypothesis {
    /// Converts a displacement from the robot's frame to the drawing, given the sine and cosine of the heading.
    pub fn drawn(&self, (sin, cos): (f64, f64), seen: Point<Base>) -> [f64; 2] {
        let [x, y] = [seen.x * cos - seen.y * sin, seen.x * sin + seen.y * cos];
        [x / self.stretch[0], y / self.stretch[1]]
    }

    /// Samples a hypothesis around a pose and a stretch, with the uncertainty of the start.
    pub fn around(
        at: Point<Drawn>,
        heading_rad: f64,
        stretch: [f64; 2],
        settings: &Believing,
        chance: &mut Pcg64Mcg,
    ) -> Self {
        let mut normal = || -> f64 { StandardNormal.sample(chance) };
        let DrawnMetres(sd) = settings.start_sd_m;
        let at = Point::new(at.x + sd * normal(), at.y + sd * normal());
        let heading_rad = heading_rad + settings.start_heading_sd * normal();
        let both = settings.start_stretch_sd * normal();
        let ratio = settings.aspect_sd * normal();
        let care = (settings.care_sd * normal()).exp();
        Self {
            at,
            heading_rad,
            stretch: [stretch[0] * (both + ratio).exp(), stretch[1] * (both - ratio).exp()],
            care,
            weight: 1.0 / settings.hypotheses.max(1) as f64,
            near: [Known::default(); NEAR],
        }
    }

    /// Returns a hypothesis of average care that has not observed any shifts yet.
    pub fn at(at: Point<Drawn>, heading_rad: f64, stretch: Stretch) -> Self {
        let near = [Known::default(); NEAR];
        Self { at, heading_rad, stretch: [stretch.0; 2], care: 1.0, weight: 1.0, near }
    }

    fn prior(&self, settings: &Believing) -> Prior {
        let of = |sd: f64| (sd * self.care) as f32;
        Prior { shift: of(settings.shift_sd_m.0), size: of(settings.size_sd), turn_rad: of(settings.turn_sd) }
    }

    /// Returns the estimated shift of an object.
    pub fn shift(&self, object: usize, settings: &Believing) -> Shift {
        let known = self.near.iter().find(|known| known.number as usize == object + 1);
        known.map_or_else(|| Shift::unseen(self.prior(settings)), |known| known.shift)
    }

    /// Remembers the shift of an object. If there is no room left, it replaces that of the farthest object.
    fn know(&mut self, object: usize, shift: Shift, outlines: &[Outline]) {
        let number = object as u32 + 1;
        let distance = |known: &Known| match known.number {
            0 => f32::INFINITY,
            other => {
                let outline = &outlines[other as usize - 1];
                let [x, y] = outline.middle();
                (self.at.x as f32 - x).hypot(self.at.y as f32 - y) - outline.radius()
            }
        };
        let same = self.near.iter().position(|known| known.number == number);
        let farthest = || {
            let far = self.near.iter().map(distance).enumerate();
            far.fold((0, f32::NEG_INFINITY), |best, one| if one.1 > best.1 { one } else { best }).0
        };
        let i = same.unwrap_or_else(farthest);
        self.near[i] = Known { number, shift };
    }
}

/// An object that an echo may have come from.
#[derive(Clone, Copy)]
struct Candidate {
    object: usize,
    shift: Shift,
    off: Off,
    /// Variance of the echo's distance from the outline if the object's position were known.
    variance: f32,
    likelihood: f32,
}

/// Returns the density of a normal distribution at a distance whose square is `square` times the variance.
fn normal(square: f32, variance: f32) -> f32 {
    (-0.5 * square).exp() / (std::f32::consts::TAU * variance).sqrt()
}

/// How likely an echo is, and how well it fits.
pub struct Likely {
    /// Logarithm of the likelihood.
    pub log: f64,
    /// How well the echo fits an object, from 0 to 1.
    pub fits: f64,
}

/// What hypotheses compare the robot's view with.
pub struct Within<'a> {
    /// Outlines of all objects in the sketch.
    pub outlines: &'a [Outline],
    /// Parameters of the belief.
    pub settings: Believing,
}

impl Within<'_> {
    /// Returns the objects that an echo may have come from.
    fn candidates(&self, one: &Hypothesis, from: [f64; 2]) -> [Option<Candidate>; 3] {
        let mut found = [None; 3];
        let mut count = 0;
        let at = Point::new(one.at.x + from[0], one.at.y + from[1]);
        let length = (from[0].hypot(from[1]) as f32).max(1e-3);
        let [bx, by] = from.map(|x| x as f32 / length);
        let sd = self.settings.echo_sd_m.0 as f32;
        for (object, outline) in self.outlines.iter().enumerate() {
            let [x, y] = outline.middle();
            let far = outline.radius() + GATE_M;
            let [dx, dy] = [at.x as f32 - x, at.y as f32 - y];
            if dx * dx + dy * dy > far * far || count == found.len() {
                continue;
            }
            let shift = one.shift(object, &self.settings);
            let Some(off) = shift.off(outline, at) else { continue };
            let facing = -(off.normal[0] * bx + off.normal[1] * by);
            if facing < -0.2 {
                continue;
            }
            let lateral = self.settings.cone as f32 * length;
            let variance = sd * sd + lateral * lateral * (1.0 - facing * facing).max(0.0);
            let total = variance + shift.variance(&off);
            let square = off.distance * off.distance / total;
            if square > GATE_SQUARE {
                continue;
            }
            let likelihood = normal(square, total);
            found[count] = Some(Candidate { object, shift, off, variance, likelihood });
            count += 1;
        }
        found
    }

    /// Assigns an echo to an object, or to none, and updates that object's shift.
    pub fn echo(&self, one: &mut Hypothesis, from: [f64; 2], chance: &mut Pcg64Mcg) -> Likely {
        let settings = &self.settings;
        let found = self.candidates(one, from);
        let drawn = 1.0 - settings.undrawn as f32;
        let undrawn = settings.undrawn as f32 * ANYWHERE;
        let sum: f32 = found.iter().flatten().map(|one| one.likelihood * drawn).sum();
        let part = settings.independent;
        let log = part * f64::from(undrawn + sum).max(f64::MIN_POSITIVE).ln();
        let mut chosen = chance.random::<f32>() * (undrawn + sum);
        for candidate in found.iter().flatten() {
            chosen -= candidate.likelihood * drawn;
            if chosen < 0.0 {
                let mut shift = candidate.shift;
                shift.touch(&candidate.off, candidate.variance / settings.learned as f32);
                one.know(candidate.object, shift, self.outlines);
                break;
            }
        }
        Likely { log, fits: f64::from(sum / (undrawn + sum).max(f32::MIN_POSITIVE)) }
    }

    /// Compares the free part of a beam with the objects that should be in its way. Returns the logarithm of the likelihood.
    pub fn free(&self, one: &Hypothesis, turn: (f64, f64), angle_rad: f64, free_m: f64) -> f64 {
        let settings = &self.settings;
        let sd = settings.echo_sd_m.0 as f32;
        let step = one.drawn(turn, polar(angle_rad, PROBE_M));
        let count = (free_m / PROBE_M) as usize;
        let end = [0, 1].map(|axis| step[axis] as f32 * count as f32);
        let length = end[0] * end[0] + end[1] * end[1];
        let mut log = 0.0;
        for (object, outline) in self.outlines.iter().enumerate() {
            // The object is compared if the beam passes through the circle around it.
            let [x, y] = outline.middle();
            let [x, y] = [x - one.at.x as f32, y - one.at.y as f32];
            let part = if length > 0.0 { ((x * end[0] + y * end[1]) / length).clamp(0.0, 1.0) } else { 0.0 };
            let [off_x, off_y] = [x - part * end[0], y - part * end[1]];
            let radius = outline.radius() + 0.3;
            if off_x * off_x + off_y * off_y > radius * radius {
                continue;
            }
            let shift = one.shift(object, settings);
            let mut deepest: Option<Off> = None;
            for i in 0..=count {
                let at = Point::new(one.at.x + step[0] * i as f64, one.at.y + step[1] * i as f64);
                if let Some(off) = shift.off(outline, at)
                    && deepest.is_none_or(|deepest| off.distance < deepest.distance)
                {
                    deepest = Some(off);
                }
            }
            let Some(off) = deepest.filter(|off| off.distance < 0.0) else { continue };
            let total = sd * sd + shift.variance(&off);
            // Approximates the normal distribution function by a logistic one (Abramowitz and Stegun).
            let inside = 1.0 / (1.0 + (1.702 * off.distance / total.sqrt()).exp());
            // At a depth of 0, the object is as likely to be in the way as not.
            let inside = f64::from(2.0 * inside - 1.0);
            log += settings.free * (1.0 - (1.0 - settings.missed) * inside).max(f64::MIN_POSITIVE).ln();
        }
        log
    }

    /// Compares a marker with the object that it is on. Returns the logarithm of the likelihood.
    pub fn marker(&self, one: &mut Hypothesis, object: usize, from: [f64; 2]) -> f64 {
        let settings = &self.settings;
        let outline = &self.outlines[object];
        let shift = one.shift(object, settings);
        let at = Point::new(one.at.x + from[0], one.at.y + from[1]);
        let Some(off) = shift.off(outline, at) else {
            return settings.marked * (settings.mistaken * f64::from(ANYWHERE)).max(f64::MIN_POSITIVE).ln();
        };
        let (sd, lateral) = (settings.echo_sd_m.0, MARKER_LATERAL * from[0].hypot(from[1]));
        let variance = (sd * sd + lateral * lateral) as f32;
        let total = variance + shift.variance(&off);
        let likelihood = f64::from(normal(off.distance * off.distance / total, total));
        let mistaken = settings.mistaken * f64::from(ANYWHERE);
        let part = settings.marked;
        if likelihood > mistaken {
            let mut shift = shift;
            shift.touch(&off, variance / part as f32);
            one.know(object, shift, self.outlines);
        }
        part * (mistaken + (1.0 - settings.mistaken) * likelihood).max(f64::MIN_POSITIVE).ln()
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::outlines::Outlines;
    use crate::sketch::{Landmark, Sketch};

    /// Returns the outlines of squares of 1 m with the given lower left corners.
    fn squares(corners: &[[f64; 2]]) -> Outlines {
        let outline =
            |x: f64, y: f64| [[x, y], [x + 1.0, y], [x + 1.0, y + 1.0], [x, y + 1.0]].map(Point::from).into();
        let landmark = |[x, y]: &[f64; 2]| Landmark { name: String::new(), outline: outline(*x, *y) };
        let landmarks = corners.iter().map(landmark).collect();
        Outlines::of(&Sketch { landmarks, route: Vec::new(), metres_per_pixel: 1.0 })
    }

    /// Returns a hypothesis at the origin, facing along x, in a drawing to scale.
    fn at_origin(settings: &Believing) -> Hypothesis {
        let mut chance = Pcg64Mcg::seed_from_u64(1);
        let one = Hypothesis::around(Point::new(0.0, 0.0), 0.0, [1.0; 2], settings, &mut chance);
        Hypothesis { at: Point::new(0.0, 0.0), heading_rad: 0.0, stretch: [1.0; 2], care: 1.0, ..one }
    }

    #[test]
    fn what_is_occluded_speaks_against_nothing() {
        // The first square hides the second one.
        let outlines = squares(&[[2.0, -0.5], [4.0, -0.5]]);
        let settings = Believing::default();
        let (within, one) = (Within { outlines: outlines.all(), settings }, at_origin(&settings));
        let log = |free_m| within.free(&one, (0.0, 1.0), 0.0, free_m);
        assert_eq!(log(2.0 - PROBE_M), 0.0);
        assert!(log(2.9) < 0.0 && log(4.9) < log(2.9), "{} {}", log(2.9), log(4.9));
    }

    /// Two objects are 0.8 m apart. Every echo used to be explained by the nearest of all outlines.
    #[test]
    fn an_object_whose_place_is_known_does_not_explain_its_neighbours_echoes() {
        let outlines = squares(&[[2.0, -0.5]]);
        let settings = Believing::default();
        let (within, mut one) = (Within { outlines: outlines.all(), settings }, at_origin(&settings));
        let mut chance = Pcg64Mcg::seed_from_u64(1);
        let beyond = |one: &mut Hypothesis, chance: &mut _| within.echo(one, [1.4, 0.0], chance).fits;
        let before = beyond(&mut one.clone(), &mut chance);
        for _ in 0..100 {
            within.echo(&mut one, [2.0, 0.0], &mut chance);
        }
        let after = beyond(&mut one, &mut chance);
        assert!(before > 2.0 * after, "{before} and {after}");
    }

    #[test]
    fn the_farthest_object_is_forgotten_for_a_nearer_one() {
        let corners: Vec<_> = (0..=NEAR).map(|i| [2.0 * i as f64, 1.0]).collect();
        let outlines = squares(&corners);
        let settings = Believing::default();
        let mut one = at_origin(&settings);
        for object in (0..=NEAR).rev() {
            one.know(object, Shift::unseen(one.prior(&settings)), outlines.all());
        }
        assert!(one.near.iter().all(|known| known.number as usize <= NEAR));
    }
}

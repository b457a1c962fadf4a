//! Estimates the robot's pose in the drawing. This is our own method, which the navigator uses by default
//! instead of exact matches.
//!
//! The hidden state is a pose in the drawing and the local stretch of the drawing, which is the number of
//! real metres per drawn metre. It is tracked by a particle filter (Thrun, Burgard and Fox 2005, table 8.2)
//! with odometry as its motion model. The observations are relations, that is, the direction and the distance
//! of each object that the robot sees or remembers. Each hypothesis predicts which drawn outline should be
//! there. Because people draw objects some decimetres from where they belong, forget some and draw others too
//! large, the cost of a relation that fits no outline is bounded.
//!
//! An update does not allocate. The random generator is part of the state.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Base, Point, wrap_angle};

use crate::drawn::{Drawn, DrawnMetres, Stretch};
use crate::error::Error;
use crate::memory::Memory;
use crate::numbers;
use crate::outlines::Outlines;

/// Parameters of the belief.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Believing {
    /// Number of hypotheses.
    pub hypotheses: usize,
    /// Standard deviation of drawn outlines from their true positions.
    pub outline_sd_m: DrawnMetres,
    /// Error of a relation perpendicular to its direction, as a share of its distance. This models the cone
    /// of a sonar.
    pub cone: f64,
    /// Probability that a relation belongs to an object that was not drawn.
    pub undrawn: f64,
    /// Probability that a marker is on a different object than stated.
    pub mistaken: f64,
    /// Number of independent observations that the relations of one update count as. It is small because the
    /// errors of a drawing repeat.
    pub independent: f64,
    /// Standard deviation of the position after one driven metre, in drawn metres. It grows with the square root of the
    /// distance.
    pub way_sd: f64,
    /// Standard deviation of the heading after one driven metre, in radians. It grows with the square root of the distance.
    pub heading_sd: f64,
    /// Standard deviation of the relative change in stretch over one driven metre. It grows with the square root of the
    /// distance.
    pub stretch_sd: f64,
    /// Standard deviation of the relative error in stretch at the start.
    pub start_stretch_sd: f64,
    /// Standard deviation of the robot's starting position from that of the drawn route, along each axis.
    pub start_sd_m: DrawnMetres,
    /// Standard deviation of the robot's starting heading from that of the drawn route, in radians.
    pub start_heading_sd: f64,
}

impl Default for Believing {
    fn default() -> Self {
        Self {
            hypotheses: 300,
            outline_sd_m: DrawnMetres(0.35),
            cone: 0.15,
            undrawn: 0.15,
            mistaken: 0.02,
            independent: 3.0,
            way_sd: 0.12,
            heading_sd: 0.06,
            stretch_sd: 0.03,
            start_stretch_sd: 0.15,
            start_sd_m: DrawnMetres(0.3),
            start_heading_sd: 0.12,
        }
    }
}

/// Weight of one update in the running mean of the fit.
const FIT_RATE: f64 = 0.05;
/// Maximum number of hypotheses.
const MOST_HYPOTHESES: usize = 20_000;

impl Believing {
    /// Checks that all numbers are within their ranges.
    ///
    /// # Errors
    /// [`Error::Number`], which names the first number that is out of range.
    pub fn check(&self) -> Result<(), Error> {
        let Self { hypotheses, outline_sd_m, cone, undrawn, mistaken, independent, .. } = *self;
        if !(1..=MOST_HYPOTHESES).contains(&hypotheses) {
            let (what, found) = ("hypotheses".into(), hypotheses as f64);
            return Err(Error::Number { what, expected: "1 to 20000", found });
        }
        for (what, found) in [("undrawn", undrawn), ("mistaken", mistaken)] {
            if !(0.0..=1.0).contains(&found) {
                return Err(Error::Number { what: what.into(), expected: "0 to 1", found });
            }
        }
        numbers::above_0(&[("outline_sd_m", outline_sd_m.0), ("independent", independent)])?;
        let Self { way_sd, heading_sd, stretch_sd, start_stretch_sd, start_sd_m, start_heading_sd, .. } =
            *self;
        numbers::from_0_on(&[
            ("cone", cone),
            ("way_sd", way_sd),
            ("heading_sd", heading_sd),
            ("stretch_sd", stretch_sd),
            ("start_stretch_sd", start_stretch_sd),
            ("start_sd_m", start_sd_m.0),
            ("start_heading_sd", start_heading_sd),
        ])
    }
}

/// A hypothesis: a pose in the drawing, the stretch there, and a weight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Hypothesis {
    at: Point<Drawn>,
    heading_rad: f64,
    stretch: Stretch,
    weight: f64,
}

impl Hypothesis {
    /// Returns the position in the drawing of an object seen from this hypothesis, and the square of its distance from the
    /// robot, in drawn metres.
    fn place(&self, (sin, cos): (f64, f64), seen: Point<Base>) -> (Point<Drawn>, f64) {
        let [ahead, left] = [seen.x, seen.y].map(|length_m| self.stretch.drawn(length_m).0);
        let at = Point::new(self.at.x + ahead * cos - left * sin, self.at.y + ahead * sin + left * cos);
        (at, ahead * ahead + left * left)
    }

    /// Samples a hypothesis around a pose and a stretch, with the uncertainty of the start.
    fn around(
        at: Point<Drawn>,
        heading_rad: f64,
        Stretch(stretch): Stretch,
        settings: &Believing,
        chance: &mut Pcg64Mcg,
    ) -> Self {
        let mut normal = || -> f64 { StandardNormal.sample(chance) };
        let DrawnMetres(sd) = settings.start_sd_m;
        Self {
            at: Point::new(at.x + sd * normal(), at.y + sd * normal()),
            heading_rad: heading_rad + settings.start_heading_sd * normal(),
            stretch: Stretch(stretch * (settings.start_stretch_sd * normal()).exp()),
            weight: 1.0 / settings.hypotheses.max(1) as f64,
        }
    }
}

/// Estimate of the robot's pose.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Position in the drawing.
    pub at: Point<Drawn>,
    /// Heading in the drawing, in radians.
    pub heading_rad: f64,
    /// Stretch of the drawing around the robot.
    pub stretch: Stretch,
    /// Spread of the hypotheses: the root mean square of their distances from the position.
    pub spread: DrawnMetres,
    /// How well the observations fit the drawing, from 0 to 1, as a running mean over recent updates.
    pub fit: f64,
}

/// Weighted hypotheses of the robot's pose in the drawing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Belief {
    settings: Believing,
    hypotheses: Vec<Hypothesis>,
    /// Buffer for resampling.
    #[serde(skip)]
    spare: Vec<Hypothesis>,
    chance: Pcg64Mcg,
    fit: f64,
}

impl Belief {
    /// Creates a belief at the start of a drawn route.
    pub fn new(at: Point<Drawn>, heading_rad: f64, settings: Believing, seed: u64) -> Self {
        let mut chance = Pcg64Mcg::seed_from_u64(seed);
        let count = settings.hypotheses.max(1);
        let mut one = || Hypothesis::around(at, heading_rad, Stretch::NONE, &settings, &mut chance);
        let hypotheses: Vec<_> = (0..count).map(|_| one()).collect();
        Self { settings, spare: Vec::with_capacity(count), hypotheses, chance, fit: 1.0 }
    }

    /// Places the robot where a person says it is. The hypotheses are sampled again with the same uncertainty
    /// as at the start. If no heading is given, the estimated heading is kept. The estimated stretch is
    /// always kept.
    pub fn place(&mut self, at: Point<Drawn>, heading_rad: Option<f64>) {
        let Estimate { heading_rad: believed_rad, stretch, .. } = self.estimate();
        let heading_rad = heading_rad.unwrap_or(believed_rad);
        for one in &mut self.hypotheses {
            *one = Hypothesis::around(at, heading_rad, stretch, &self.settings, &mut self.chance);
        }
        self.fit = 1.0;
    }

    /// Reserves the memory that updates need. Call this after reading a belief from a checkpoint, which
    /// stores values but no capacity.
    pub fn reserve(&mut self) {
        self.spare.reserve_exact(self.hypotheses.len());
    }

    /// Moves the hypotheses by the robot's motion, in real metres and radians.
    pub fn moved(&mut self, moved_m: f64, turned_rad: f64) {
        let settings = self.settings;
        let way = moved_m.abs();
        for one in &mut self.hypotheses {
            let mut normal = || -> f64 { StandardNormal.sample(&mut self.chance) };
            one.heading_rad += turned_rad + settings.heading_sd * way.sqrt() * normal();
            one.stretch.0 *= (settings.stretch_sd * way.sqrt() * normal()).exp();
            let (sin, cos) = (one.heading_rad - turned_rad / 2.0).sin_cos();
            let DrawnMetres(drawn) = one.stretch.drawn(moved_m);
            // A drawing's errors accumulate along the whole route. Those of single metres add up like random steps.
            let sd = settings.way_sd * way.sqrt();
            one.at.x += drawn * cos + sd * normal();
            one.at.y += drawn * sin + sd * normal();
        }
    }

    /// Weights the hypotheses by what the robot sees and remembers, and resamples them if necessary.
    pub fn seen(&mut self, memory: &Memory, outlines: &Outlines) {
        let (places, marked) = (memory.places(), memory.marked());
        if places.is_empty() && marked.is_empty() {
            return;
        }
        let settings = self.settings;
        let part_of = |count: usize| (settings.independent / count.max(1) as f64).min(1.0);
        let (part, marked_part) = (part_of(places.len()), part_of(marked.len()));
        let mut fit = 0.0;
        let mut sum = 0.0;
        for one in &mut self.hypotheses {
            let turn = one.heading_rad.sin_cos();
            let mut log = 0.0;
            let mut fits = 0.0;
            for place in places {
                let (at, square) = one.place(turn, *place);
                let likelihood = likelihood(outlines.nearest(at), square, &settings);
                log += (settings.undrawn + (1.0 - settings.undrawn) * likelihood).ln();
                fits += likelihood;
            }
            // The robot cannot be inside an object.
            if outlines.nearest(one.at) < DrawnMetres::default() {
                log -= 2.0 / part;
            }
            let mut log = log * part;
            for (object, place) in marked {
                let (at, square) = one.place(turn, *place);
                let likelihood = likelihood(outlines.marked(*object, at), square, &settings);
                log += marked_part * (settings.mistaken + (1.0 - settings.mistaken) * likelihood).ln();
            }
            one.weight *= log.exp();
            sum += one.weight;
            fit += one.weight * fits / places.len().max(1) as f64;
        }
        if !places.is_empty() {
            self.fit += FIT_RATE * (fit / sum - self.fit);
        }
        self.hypotheses.iter_mut().for_each(|one| one.weight /= sum);
        self.resample();
    }

    /// Resamples systematically if the effective number of hypotheses is below half of their number.
    fn resample(&mut self) {
        let count = self.hypotheses.len();
        let squares: f64 = self.hypotheses.iter().map(|one| one.weight * one.weight).sum();
        if 1.0 / squares > count as f64 / 2.0 {
            return;
        }
        let normal: f64 = StandardNormal.sample(&mut self.chance);
        let begin = (normal * 7919.0).rem_euclid(1.0);
        self.spare.clear();
        let (mut sum, mut next) = (0.0, begin);
        for one in &self.hypotheses {
            sum += one.weight * count as f64;
            while next < sum && self.spare.len() < count {
                self.spare.push(Hypothesis { weight: 1.0 / count as f64, ..*one });
                next += 1.0;
            }
        }
        while self.spare.len() < count {
            // Rounding may leave out the last hypothesis.
            let last = self.hypotheses[count - 1];
            self.spare.push(Hypothesis { weight: 1.0 / count as f64, ..last });
        }
        std::mem::swap(&mut self.hypotheses, &mut self.spare);
    }

    /// Returns the weighted mean of the hypotheses.
    pub fn estimate(&self) -> Estimate {
        let mean = |of: &dyn Fn(&Hypothesis) -> f64| {
            self.hypotheses.iter().map(|one| one.weight * of(one)).sum::<f64>()
        };
        let at = Point::new(mean(&|one| one.at.x), mean(&|one| one.at.y));
        let heading_rad = mean(&|one| one.heading_rad.sin()).atan2(mean(&|one| one.heading_rad.cos()));
        let square = mean(&|one| one.at.distance(&at).powi(2));
        let heading_rad = wrap_angle(heading_rad);
        Estimate {
            at,
            heading_rad,
            stretch: Stretch(mean(&|one| one.stretch.0)),
            spread: DrawnMetres(square.sqrt()),
            fit: self.fit,
        }
    }
}

/// Returns how well a relation fits the drawing, from 0 to 1. `off` is the distance of the object's expected
/// position from the outline, and is negative inside the object, which makes no difference. `square` is the
/// square of the object's distance from the robot, in square drawn metres.
fn likelihood(DrawnMetres(off): DrawnMetres, square: f64, settings: &Believing) -> f64 {
    let (cone, DrawnMetres(sd)) = (settings.cone * settings.cone * square, settings.outline_sd_m);
    (-0.5 * off * off / (sd * sd + cone)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::{Remembering, SeenMarker, polar};
    use crate::sketch::{Landmark, Sketch};

    fn at(x: f64, y: f64) -> Point<Drawn> {
        Point::new(x, y)
    }

    fn square(x: f64, y: f64) -> Landmark {
        let corners = [at(x, y), at(x + 1.0, y), at(x + 1.0, y + 1.0), at(x, y + 1.0)];
        Landmark { name: String::new(), outline: corners.to_vec() }
    }

    fn outlines() -> Outlines {
        let route = vec![at(0.0, 0.0), at(10.0, 0.0)];
        let landmarks = vec![square(3.0, 1.0), square(6.0, -2.5)];
        Outlines::of(&Sketch { landmarks, route, metres_per_pixel: 1.0 }, &[0, 1])
    }

    /// Adds what a robot at this pose sees of the drawing, the nearest corners and edges, in a world that is larger by the
    /// factor `stretch`.
    fn see(memory: &mut Memory, from: Point<Drawn>, heading_rad: f64, stretch: f64) {
        let points = [[3.0, 1.0], [3.5, 1.0], [4.0, 1.0], [3.0, 1.5], [6.0, -1.5], [6.5, -1.5], [7.0, -1.5]];
        memory.see(points.map(Point::from).into_iter().map(|to| {
            polar(
                from.direction_rad(&to) - heading_rad,
                Stretch(stretch).driven_m(DrawnMetres::between(&from, &to)),
            )
        }));
    }

    #[test]
    fn what_is_seen_corrects_a_wrong_start() {
        let outlines = outlines();
        let mut belief = Belief::new(at(0.4, -0.3), 0.1, Believing::default(), 3);
        let mut memory = Memory::new(Remembering::default());
        let mut at = at(0.0, 0.0);
        for _ in 0..80 {
            at.x += 0.05;
            belief.moved(0.05, 0.0);
            memory.moved(0.05, 0.0);
            see(&mut memory, at, 0.0, 1.0);
            belief.seen(&memory, &outlines);
        }
        let found = belief.estimate();
        assert!(found.at.distance(&at) < 0.35, "{found:?}");
        assert!(
            found.heading_rad.abs() < 0.15 && (found.stretch.0 - 1.0).abs() < 0.15 && found.fit > 0.6,
            "{found:?}"
        );
    }

    #[test]
    fn a_world_that_is_larger_than_its_drawing_is_noticed() {
        let outlines = outlines();
        let mut belief = Belief::new(at(0.0, 0.0), 0.0, Believing::default(), 3);
        let mut memory = Memory::new(Remembering { reach_m: 6.0, ..Remembering::default() });
        let mut at = at(0.0, 0.0);
        for _ in 0..100 {
            at.x += 0.04;
            belief.moved(0.052, 0.0);
            memory.moved(0.052, 0.0);
            see(&mut memory, at, 0.0, 1.3);
            belief.seen(&memory, &outlines);
        }
        assert!((belief.estimate().stretch.0 - 1.3).abs() < 0.15, "{:?}", belief.estimate());
    }

    /// Two objects look the same to a sonar, and the robot stands in front of the one that it does not believe to be there.
    #[test]
    fn a_marker_tells_two_objects_apart() {
        let outlines = outlines();
        let along = |marked: bool| {
            let settings = Believing { start_sd_m: DrawnMetres(1.5), ..Believing::default() };
            let mut belief = Belief::new(at(1.0, 0.0), 0.0, settings, 3);
            let mut memory = Memory::new(Remembering::default());
            let marker = polar(at(4.5, 0.0).direction_rad(&at(6.5, -1.5)), 2.5);
            for _ in 0..60 {
                belief.moved(0.01, 0.0);
                memory.moved(0.01, 0.0);
                let seen = SeenMarker { marker: 9, object: 1, place: marker };
                memory.see_markers(marked.then_some(seen).into_iter());
                belief.seen(&memory, &outlines);
            }
            belief.estimate().at.x
        };
        assert!(along(true) > along(false) + 1.5, "{} and {}", along(true), along(false));
    }

    #[test]
    fn a_robot_that_is_told_where_it_is_believes_it() {
        let outlines = outlines();
        let mut belief = Belief::new(at(0.0, 0.0), 0.0, Believing::default(), 3);
        let mut memory = Memory::new(Remembering::default());
        memory.see([polar(2.5, 2.0)].into_iter());
        (0..100).for_each(|_| belief.seen(&memory, &outlines));
        assert!(belief.estimate().fit < 0.15);
        let there = at(6.0, 1.0);
        belief.place(there, None);
        let Estimate { at, heading_rad, fit, .. } = belief.estimate();
        assert!(at.distance(&there) < 0.1 && heading_rad.abs() < 0.2 && fit == 1.0, "{at:?}");
        belief.place(there, Some(2.0));
        assert!((belief.estimate().heading_rad - 2.0).abs() < 0.05);
    }

    #[test]
    fn what_was_not_drawn_lowers_the_fit() {
        let outlines = outlines();
        let mut belief = Belief::new(at(0.0, 0.0), 0.0, Believing::default(), 3);
        let mut memory = Memory::new(Remembering::default());
        for _ in 0..100 {
            belief.moved(0.01, 0.0);
            memory.moved(0.01, 0.0);
            memory.see([polar(2.5, 2.0), polar(-2.5, 1.7)].into_iter());
            belief.seen(&memory, &outlines);
        }
        assert!(belief.estimate().fit < 0.15, "{:?}", belief.estimate());
    }

    #[test]
    fn equal_seeds_give_equal_beliefs() {
        let run = |seed| {
            let mut belief = Belief::new(at(0.0, 0.0), 0.0, Believing::default(), seed);
            (0..20).for_each(|_| belief.moved(0.1, 0.05));
            belief
        };
        assert_eq!(run(5), run(5));
        assert_ne!(run(5).estimate(), run(6).estimate());
    }
}

//! Where the robot may be in the drawing: our own way, instead of exact matches (the default navigator).
//!
//! The hidden state is a pose in the drawing and how the drawing is stretched: how many real metres a drawn one stands
//! for. Hypotheses of it (a particle filter; Thrun, Burgard and Fox 2005, table 8.2) move by odometry. The
//! observations are relations. Each object that the robot sees or remembers has a direction and a distance. Each
//! hypothesis says which drawn outline should be there. People draw objects some decimetres beside their places,
//! forget some and draw others too large. So a relation that fits no outline costs a bounded amount.
//!
//! Nothing is allocated in an update. Randomness arrives with the state.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::wrap_angle;

use crate::error::Error;
use crate::memory::{Memory, Relation};
use crate::numbers;
use crate::outlines::Outlines;
use crate::plane::{self, At};

/// How the belief changes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Believing {
    /// How many hypotheses there are.
    pub hypotheses: usize,
    /// How far drawn outlines are off, in metres (standard deviation).
    pub outline_sd_m: f64,
    /// How far off a relation is across its direction, as a part of its distance: a sonar's cone.
    pub cone: f64,
    /// How likely it is that a relation is of something that was not drawn.
    pub undrawn: f64,
    /// How likely it is that a marker is on another object than the person says.
    pub mistaken: f64,
    /// How many independent relations those of one update count as: a drawing is wrong in the same way again and again.
    pub independent: f64,
    /// The error of the way in the drawing, as a part of it; and of the heading, in radians per metre.
    pub way_sd: f64,
    /// See [`Self::way_sd`].
    pub heading_sd: f64,
    /// How the stretch changes, as a part of it per metre; and how far it is off at the start.
    pub stretch_sd: f64,
    /// See [`Self::stretch_sd`].
    pub start_stretch_sd: f64,
    /// How far the robot is off the start of the drawn route, in metres; and off its heading, in radians.
    pub start_sd_m: f64,
    /// See [`Self::start_sd_m`].
    pub start_heading_sd: f64,
}

impl Default for Believing {
    fn default() -> Self {
        Self {
            hypotheses: 300,
            outline_sd_m: 0.35,
            cone: 0.15,
            undrawn: 0.15,
            mistaken: 0.02,
            independent: 3.0,
            way_sd: 0.12,
            heading_sd: 0.06,
            stretch_sd: 0.03,
            start_stretch_sd: 0.15,
            start_sd_m: 0.3,
            start_heading_sd: 0.12,
        }
    }
}

/// The share of an update in the mean fit.
const FIT_RATE: f64 = 0.05;
/// Most hypotheses.
const MOST_HYPOTHESES: usize = 20_000;

impl Believing {
    /// `Ok` where all numbers are in their ranges.
    ///
    /// # Errors
    /// [`Error::Number`] with the key.
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
        numbers::above_0(&[("outline_sd_m", outline_sd_m), ("independent", independent)])?;
        let Self { way_sd, heading_sd, stretch_sd, start_stretch_sd, start_sd_m, start_heading_sd, .. } =
            *self;
        numbers::from_0_on(&[
            ("cone", cone),
            ("way_sd", way_sd),
            ("heading_sd", heading_sd),
            ("stretch_sd", stretch_sd),
            ("start_stretch_sd", start_stretch_sd),
            ("start_sd_m", start_sd_m),
            ("start_heading_sd", start_heading_sd),
        ])
    }
}

/// A hypothesis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Hypothesis {
    at: At,
    heading_rad: f64,
    /// Real metres for a drawn one.
    stretch: f64,
    weight: f64,
}

impl Hypothesis {
    /// Where something is in the drawing, and the square of how far from the robot there.
    fn place(&self, (sin, cos): (f64, f64), relation: Relation) -> (At, f64) {
        let [ahead, left] = [relation.ahead_m, relation.left_m].map(|length| length / self.stretch);
        let [x, y] = self.at;
        ([x + ahead * cos - left * sin, y + ahead * sin + left * cos], ahead * ahead + left * left)
    }
}

/// Where the robot probably is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The place in the drawing, in drawn metres.
    pub at: At,
    /// The heading in the drawing.
    pub heading_rad: f64,
    /// Real metres for a drawn one.
    pub stretch: f64,
    /// How far hypotheses are from the place, in drawn metres (standard deviation).
    pub spread_m: f64,
    /// How much of what is seen fits the drawing, from 0 to 1: the mean over recent updates.
    pub fit: f64,
}

/// Hypotheses with their weights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Belief {
    settings: Believing,
    hypotheses: Vec<Hypothesis>,
    /// Resampled into here.
    #[serde(skip)]
    spare: Vec<Hypothesis>,
    chance: Pcg64Mcg,
    fit: f64,
}

impl Belief {
    /// At the start of a drawn route.
    pub fn new(at: At, heading_rad: f64, settings: Believing, seed: u64) -> Self {
        let mut chance = Pcg64Mcg::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut chance) };
        let count = settings.hypotheses.max(1);
        let mut one = || Hypothesis {
            at: at.map(|x| x + settings.start_sd_m * normal()),
            heading_rad: heading_rad + settings.start_heading_sd * normal(),
            stretch: (settings.start_stretch_sd * normal()).exp(),
            weight: 1.0 / count as f64,
        };
        let hypotheses: Vec<_> = (0..count).map(|_| one()).collect();
        Self { settings, spare: Vec::with_capacity(count), hypotheses, chance, fit: 1.0 }
    }

    /// A person says where the robot is. The hypotheses are drawn anew, as at the start; a heading that is not given, and
    /// how the drawing is stretched, are the estimate's.
    pub fn place(&mut self, at: At, heading_rad: Option<f64>) {
        let Estimate { heading_rad: believed_rad, stretch, .. } = self.estimate();
        let (settings, count) = (self.settings, self.hypotheses.len() as f64);
        let heading_rad = heading_rad.unwrap_or(believed_rad);
        for one in &mut self.hypotheses {
            let mut normal = || -> f64 { StandardNormal.sample(&mut self.chance) };
            *one = Hypothesis {
                at: at.map(|x| x + settings.start_sd_m * normal()),
                heading_rad: heading_rad + settings.start_heading_sd * normal(),
                stretch: stretch * (settings.start_stretch_sd * normal()).exp(),
                weight: 1.0 / count,
            };
        }
        self.fit = 1.0;
    }

    /// Room for what an update needs: a checkpoint keeps values, not room.
    pub fn reserve(&mut self) {
        self.spare.reserve_exact(self.hypotheses.len());
    }

    /// The robot moved and turned, in real metres and radians.
    pub fn moved(&mut self, moved_m: f64, turned_rad: f64) {
        let settings = self.settings;
        let way = moved_m.abs();
        for one in &mut self.hypotheses {
            let mut normal = || -> f64 { StandardNormal.sample(&mut self.chance) };
            one.heading_rad += turned_rad + settings.heading_sd * way.sqrt() * normal();
            one.stretch *= (settings.stretch_sd * way.sqrt() * normal()).exp();
            let (sin, cos) = (one.heading_rad - turned_rad / 2.0).sin_cos();
            let drawn = moved_m / one.stretch;
            // Errors of a drawing are of the whole way: those of metres add up like chance.
            let sd = settings.way_sd * way.sqrt();
            one.at[0] += drawn * cos + sd * normal();
            one.at[1] += drawn * sin + sd * normal();
        }
    }

    /// What is seen and remembered.
    pub fn seen(&mut self, memory: &Memory, outlines: &Outlines) {
        let (relations, marked) = (memory.relations(), memory.marked());
        if relations.is_empty() && marked.is_empty() {
            return;
        }
        let settings = self.settings;
        let part_of = |count: usize| (settings.independent / count.max(1) as f64).min(1.0);
        let (part, marked_part) = (part_of(relations.len()), part_of(marked.len()));
        let mut fit = 0.0;
        let mut sum = 0.0;
        for one in &mut self.hypotheses {
            let turn = one.heading_rad.sin_cos();
            let mut log = 0.0;
            let mut fits = 0.0;
            for relation in relations {
                let (at, square) = one.place(turn, *relation);
                let likelihood = likelihood(outlines.nearest(at), square, &settings);
                log += (settings.undrawn + (1.0 - settings.undrawn) * likelihood).ln();
                fits += likelihood;
            }
            // The robot stands in no object.
            if outlines.nearest(one.at) < 0.0 {
                log -= 2.0 / part;
            }
            let mut log = log * part;
            for (object, relation) in marked {
                let (at, square) = one.place(turn, *relation);
                let likelihood = likelihood(outlines.marked(*object, at), square, &settings);
                log += marked_part * (settings.mistaken + (1.0 - settings.mistaken) * likelihood).ln();
            }
            one.weight *= log.exp();
            sum += one.weight;
            fit += one.weight * fits / relations.len().max(1) as f64;
        }
        if !relations.is_empty() {
            self.fit += FIT_RATE * (fit / sum - self.fit);
        }
        self.hypotheses.iter_mut().for_each(|one| one.weight /= sum);
        self.resample();
    }

    /// Systematic resampling, where fewer than half of the hypotheses count.
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
            // Rounding may leave the last one out.
            let last = self.hypotheses[count - 1];
            self.spare.push(Hypothesis { weight: 1.0 / count as f64, ..last });
        }
        std::mem::swap(&mut self.hypotheses, &mut self.spare);
    }

    /// The weighted mean.
    pub fn estimate(&self) -> Estimate {
        let mean = |of: &dyn Fn(&Hypothesis) -> f64| {
            self.hypotheses.iter().map(|one| one.weight * of(one)).sum::<f64>()
        };
        let at = [0, 1].map(|axis| mean(&|one| one.at[axis]));
        let heading_rad = mean(&|one| one.heading_rad.sin()).atan2(mean(&|one| one.heading_rad.cos()));
        let square = mean(&|one| plane::distance(one.at, at).powi(2));
        let heading_rad = wrap_angle(heading_rad);
        Estimate {
            at,
            heading_rad,
            stretch: mean(&|one| one.stretch),
            spread_m: square.sqrt(),
            fit: self.fit,
        }
    }
}

/// How well a relation fits the drawing, from 0 to 1: by how far the outline is off where the object should be, and by
/// the square of the distance from the robot. Inside an object is as far off as outside.
fn likelihood(off: f64, square: f64, settings: &Believing) -> f64 {
    let cone = settings.cone * settings.cone * square;
    (-0.5 * off * off / (settings.outline_sd_m * settings.outline_sd_m + cone)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::{Remembering, SeenMarker};
    use crate::sketch::{Landmark, Sketch};

    fn square(x: f64, y: f64) -> Landmark {
        let corners = [[x, y], [x + 1.0, y], [x + 1.0, y + 1.0], [x, y + 1.0]];
        Landmark { name: String::new(), outline: corners.to_vec() }
    }

    fn outlines() -> Outlines {
        let route = vec![[0.0, 0.0], [10.0, 0.0]];
        let landmarks = vec![square(3.0, 1.0), square(6.0, -2.5)];
        Outlines::of(&Sketch { landmarks, route, metres_per_pixel: 1.0 }, &[0, 1])
    }

    /// What a robot there sees of the drawing: the nearest corners and edges, in a world that is so many times larger.
    fn see(memory: &mut Memory, at: At, heading_rad: f64, stretch: f64) {
        let points = [[3.0, 1.0], [3.5, 1.0], [4.0, 1.0], [3.0, 1.5], [6.0, -1.5], [6.5, -1.5], [7.0, -1.5]];
        memory.see(points.into_iter().map(|to| {
            Relation::polar(plane::direction(at, to) - heading_rad, stretch * plane::distance(at, to))
        }));
    }

    #[test]
    fn what_is_seen_corrects_a_wrong_start() {
        let outlines = outlines();
        let mut belief = Belief::new([0.4, -0.3], 0.1, Believing::default(), 3);
        let mut memory = Memory::new(Remembering::default());
        let mut at = [0.0, 0.0];
        for _ in 0..80 {
            at[0] += 0.05;
            belief.moved(0.05, 0.0);
            memory.moved(0.05, 0.0);
            see(&mut memory, at, 0.0, 1.0);
            belief.seen(&memory, &outlines);
        }
        let found = belief.estimate();
        assert!(plane::distance(found.at, at) < 0.35, "{found:?}");
        assert!(
            found.heading_rad.abs() < 0.15 && (found.stretch - 1.0).abs() < 0.15 && found.fit > 0.6,
            "{found:?}"
        );
    }

    #[test]
    fn a_world_that_is_larger_than_its_drawing_is_noticed() {
        let outlines = outlines();
        let mut belief = Belief::new([0.0, 0.0], 0.0, Believing::default(), 3);
        let mut memory = Memory::new(Remembering { reach_m: 6.0, ..Remembering::default() });
        let mut at = [0.0, 0.0];
        for _ in 0..100 {
            at[0] += 0.04;
            belief.moved(0.052, 0.0);
            memory.moved(0.052, 0.0);
            see(&mut memory, at, 0.0, 1.3);
            belief.seen(&memory, &outlines);
        }
        assert!((belief.estimate().stretch - 1.3).abs() < 0.15, "{:?}", belief.estimate());
    }

    /// Two objects look the same to a sonar, and the robot was set down before the other one than it believes.
    #[test]
    fn a_marker_tells_two_objects_apart() {
        let outlines = outlines();
        let at = |marked: bool| {
            let mut belief =
                Belief::new([1.0, 0.0], 0.0, Believing { start_sd_m: 1.5, ..Believing::default() }, 3);
            let mut memory = Memory::new(Remembering::default());
            let marker = Relation::polar(plane::direction([4.5, 0.0], [6.5, -1.5]), 2.5);
            for _ in 0..60 {
                belief.moved(0.01, 0.0);
                memory.moved(0.01, 0.0);
                let seen = SeenMarker { marker: 9, object: 1, relation: marker };
                memory.see_markers(marked.then_some(seen).into_iter());
                belief.seen(&memory, &outlines);
            }
            belief.estimate().at[0]
        };
        assert!(at(true) > at(false) + 1.5, "{} and {}", at(true), at(false));
    }

    #[test]
    fn a_robot_that_is_told_where_it_is_believes_it() {
        let outlines = outlines();
        let mut belief = Belief::new([0.0, 0.0], 0.0, Believing::default(), 3);
        let mut memory = Memory::new(Remembering::default());
        memory.see([Relation::polar(2.5, 2.0)].into_iter());
        (0..100).for_each(|_| belief.seen(&memory, &outlines));
        assert!(belief.estimate().fit < 0.15);
        belief.place([6.0, 1.0], None);
        let Estimate { at, heading_rad, fit, .. } = belief.estimate();
        assert!(plane::distance(at, [6.0, 1.0]) < 0.1 && heading_rad.abs() < 0.2 && fit == 1.0, "{at:?}");
        belief.place([6.0, 1.0], Some(2.0));
        assert!((belief.estimate().heading_rad - 2.0).abs() < 0.05);
    }

    #[test]
    fn what_was_not_drawn_lowers_the_fit() {
        let outlines = outlines();
        let mut belief = Belief::new([0.0, 0.0], 0.0, Believing::default(), 3);
        let mut memory = Memory::new(Remembering::default());
        for _ in 0..100 {
            belief.moved(0.01, 0.0);
            memory.moved(0.01, 0.0);
            memory.see([Relation::polar(2.5, 2.0), Relation::polar(-2.5, 1.7)].into_iter());
            belief.seen(&memory, &outlines);
        }
        assert!(belief.estimate().fit < 0.15, "{:?}", belief.estimate());
    }

    #[test]
    fn equal_seeds_give_equal_beliefs() {
        let run = |seed| {
            let mut belief = Belief::new([0.0, 0.0], 0.0, Believing::default(), seed);
            (0..20).for_each(|_| belief.moved(0.1, 0.05));
            belief
        };
        assert_eq!(run(5), run(5));
        assert_ne!(run(5).estimate(), run(6).estimate());
    }
}

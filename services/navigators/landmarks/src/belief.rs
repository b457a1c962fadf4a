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
use sketchnav_schemas::geometry::{Base, Point, wrap_angle};

use crate::drawn::{Drawn, DrawnMetres, Stretch};
use crate::error::Error;
use crate::memory::Memory;
use crate::numbers;
use crate::outlines::Outlines;

/// How the belief changes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Believing {
    /// How many hypotheses there are.
    pub hypotheses: usize,
    /// How far drawn outlines are off (standard deviation).
    pub outline_sd_m: DrawnMetres,
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
    /// How far the robot is off the start of the drawn route; and off its heading, in radians.
    pub start_sd_m: DrawnMetres,
    /// See [`Self::start_sd_m`].
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

/// A hypothesis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Hypothesis {
    at: Point<Drawn>,
    heading_rad: f64,
    stretch: Stretch,
    weight: f64,
}

impl Hypothesis {
    /// Where something is in the drawing, and the square of how far from the robot there, in drawn metres.
    fn place(&self, (sin, cos): (f64, f64), seen: Point<Base>) -> (Point<Drawn>, f64) {
        let [ahead, left] = [seen.x, seen.y].map(|length_m| self.stretch.drawn(length_m).0);
        let at = Point::new(self.at.x + ahead * cos - left * sin, self.at.y + ahead * sin + left * cos);
        (at, ahead * ahead + left * left)
    }

    /// Drawn by chance around a pose and a stretch, as at the start.
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

/// Where the robot probably is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The place in the drawing.
    pub at: Point<Drawn>,
    /// The heading in the drawing.
    pub heading_rad: f64,
    /// How the drawing is stretched there.
    pub stretch: Stretch,
    /// How far hypotheses are from the place (standard deviation).
    pub spread: DrawnMetres,
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
    pub fn new(at: Point<Drawn>, heading_rad: f64, settings: Believing, seed: u64) -> Self {
        let mut chance = Pcg64Mcg::seed_from_u64(seed);
        let count = settings.hypotheses.max(1);
        let mut one = || Hypothesis::around(at, heading_rad, Stretch::NONE, &settings, &mut chance);
        let hypotheses: Vec<_> = (0..count).map(|_| one()).collect();
        Self { settings, spare: Vec::with_capacity(count), hypotheses, chance, fit: 1.0 }
    }

    /// A person says where the robot is. The hypotheses are drawn anew, as at the start; a heading that is not given, and
    /// how the drawing is stretched, are the estimate's.
    pub fn place(&mut self, at: Point<Drawn>, heading_rad: Option<f64>) {
        let Estimate { heading_rad: believed_rad, stretch, .. } = self.estimate();
        let heading_rad = heading_rad.unwrap_or(believed_rad);
        for one in &mut self.hypotheses {
            *one = Hypothesis::around(at, heading_rad, stretch, &self.settings, &mut self.chance);
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
            one.stretch.0 *= (settings.stretch_sd * way.sqrt() * normal()).exp();
            let (sin, cos) = (one.heading_rad - turned_rad / 2.0).sin_cos();
            let DrawnMetres(drawn) = one.stretch.drawn(moved_m);
            // Errors of a drawing are of the whole way: those of metres add up like chance.
            let sd = settings.way_sd * way.sqrt();
            one.at.x += drawn * cos + sd * normal();
            one.at.y += drawn * sin + sd * normal();
        }
    }

    /// What is seen and remembered.
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
            // The robot stands in no object.
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

/// How well a relation fits the drawing, from 0 to 1: by how far the outline is off where the object should be, and by
/// the square of the distance from the robot, in drawn metres. Inside an object is as far off as outside.
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

    /// What a robot there sees of the drawing: the nearest corners and edges, in a world that is so many times larger.
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

    /// Two objects look the same to a sonar, and the robot was set down before the other one than it believes.
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

//! Simulates single transitions by geometry alone: which dot the navigator picks, where a slide ends, and what a verification
//! counts.
//!
//! In each trial, a dot's position deviates from the map-maker's by one error, and each look at the dot adds another. Missed dots,
//! false dots and the helicopter's movements within a parkway are only simulated in whole journeys.

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use sketchnav_schemas::seed::stream;

use super::Pilot;
use crate::custom_map::{Response, Verification};
use crate::description::Descriptor;
use crate::error::Error;
use crate::generate::error;
use crate::geometry::{Corner, Land, Point};
use crate::markers::LandmarkKind;
use crate::navigator::Settings;
use crate::navigator::heading::Heading;
use crate::path::Atlas;
use crate::plane::DotId;
use crate::sight::{Eye, is_seen};
use crate::signature::Signature;
use crate::trajectory::Slide;
use crate::transitions::{Movement, Transition};
use crate::traversal::Noise;

/// Estimated probability that a transition attains its target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The probability without verification.
    pub plain: f64,
    /// The probability with verification and recovery, or 0 if the transition cannot be verified.
    pub verified: f64,
}

impl Estimate {
    /// Returns true if verification increases the probability of the transition.
    pub fn pays(&self) -> bool {
        self.verified > self.plain
    }

    /// Returns the probability with verification if that is greater, and without verification otherwise.
    pub fn best(&self) -> f64 {
        self.plain.max(self.verified)
    }
}

/// Maximum number of strips searched along a slide, each longer than the one before.
const STRIPS: u32 = 4;

/// Estimates the transitions that begin at the given landmarks. All others count as impossible.
pub fn estimates(
    atlas: &Atlas,
    pilot: &Pilot,
    trials: u32,
    seed: u64,
    is_tried: impl Fn(DotId) -> bool,
) -> Result<Vec<Estimate>, Error> {
    let recoveries = atlas.recoveries()?;
    let mut trial = Trial::new(atlas, pilot, stream(seed, "directions/transitions"));
    let share = |hits: u32| (f64::from(hits) + 1.0) / (f64::from(trials) + 2.0);
    let mut estimate = |(from, transition): (DotId, &Transition)| {
        if !is_tried(from) {
            return Estimate { plain: 0.0, verified: 0.0 };
        }
        let aside = atlas.reliability.aside(&atlas.plane, from, transition);
        let verification = recoveries.check(from, transition, aside).verification();
        let (mut plain, mut verified) = (0, 0);
        for _ in 0..trials {
            trial.begin();
            let attained = trial.attains(from, transition);
            plain += u32::from(attained == Some(transition.to));
            if let Some(verification) = verification {
                let attained = attained.and_then(|dot| trial.verifies(dot, verification));
                verified += u32::from(attained == Some(transition.to));
            }
        }
        let verified = if verification.is_some() { share(verified) } else { 0.0 };
        Estimate { plain: share(plain), verified }
    };
    Ok(atlas.transitions.all().map(&mut estimate).collect())
}

/// Simulates what the navigator does at one landmark after another.
pub(crate) struct Trial<'a> {
    atlas: &'a Atlas,
    pilot: &'a Pilot,
    /// Standard deviation of a position, averaged over the views of one look.
    look: f64,
    rng: Pcg64Mcg,
    /// Displacement of each dot, and the number of the trial in which it was drawn.
    off: Vec<(u32, Point)>,
    trial: u32,
    /// Heading error in the current trial, in radians.
    heading_rad: f64,
    places: Vec<Point>,
    dots: Vec<DotId>,
    /// The dots whose kind is known to the navigator.
    marked: Vec<DotId>,
}

impl<'a> Trial<'a> {
    pub(crate) fn new(atlas: &'a Atlas, pilot: &'a Pilot, rng: Pcg64Mcg) -> Self {
        let look = pilot.noise.sigma / f64::from(pilot.settings.looks).sqrt();
        let off = vec![(0, Point::default()); atlas.plane.len()];
        Self {
            atlas,
            pilot,
            look,
            rng,
            off,
            trial: 0,
            heading_rad: 0.0,
            places: Vec::new(),
            dots: Vec::new(),
            marked: Vec::new(),
        }
    }

    /// Begins a new trial, in which all dots have new positions.
    pub(crate) fn begin(&mut self) {
        self.trial += 1;
        let drawn: f64 = StandardNormal.sample(&mut self.rng);
        self.heading_rad = drawn * self.pilot.noise.heading_rad;
    }

    /// Returns the position of a dot in this trial.
    fn place(&mut self, dot: DotId) -> Point {
        let off = &mut self.off[dot as usize];
        if off.0 != self.trial {
            *off = (self.trial, error(&mut self.rng, self.pilot.noise.map_sigma));
        }
        self.atlas.plane.dot(dot) + off.1
    }

    /// Returns the position at which the navigator sees a dot in one look.
    fn seen(&mut self, dot: DotId) -> Point {
        self.place(dot) + error(&mut self.rng, self.look)
    }

    /// Takes one look at the surroundings of a landmark in a corner. Positions are relative to the landmark.
    pub(crate) fn look_around(&mut self, landmark: DotId, corner: Corner) {
        let window = self.atlas.window;
        let reach = window.land.map_or(window.side, |land| land.range + land.stand_off);
        let reach = reach + 5.0 * self.pilot.noise.combined_sigma();
        let origin = self.seen(landmark);
        self.dots.clear();
        self.places.clear();
        let around = self.atlas.plane.around(self.atlas.plane.dot(landmark), reach);
        self.dots.extend(around.map(|(dot, _)| dot).filter(|&dot| dot != landmark));
        if let Some(land) = window.land {
            self.hide(land, landmark, corner);
        }
        for index in 0..self.dots.len() {
            let place = (self.seen(self.dots[index]) - origin).turned(-self.heading_rad);
            self.places.push(place);
        }
    }

    /// Removes the dots that are hidden from the robot while it stands beside a landmark, close to its intended position.
    fn hide(&mut self, land: Land, landmark: DotId, corner: Corner) {
        let beside = self.atlas.window.centre_from(corner).turned(self.heading_rad);
        let at = self.place(landmark) + beside + error(&mut self.rng, self.pilot.settings.tolerance / 2.0);
        let eye = Eye { at, walls: self.atlas.plane.walls() };
        let own = self.place(landmark) - at;
        for index in 0..self.dots.len() {
            let place = self.place(self.dots[index]) - at;
            self.places.push(place);
        }
        let is_shown = |index: usize| {
            let others =
                self.places.iter().enumerate().filter(|&(other, _)| other != index).map(|(_, at)| *at);
            is_seen(land, eye, self.places[index], others.chain(std::iter::once(own)))
        };
        let shown: Vec<_> = (0..self.dots.len()).filter(|&index| is_shown(index)).collect();
        self.marked.clear();
        for &index in &shown {
            let dot = self.dots[index];
            let Some(shown) = self.atlas.plane.shown(dot, self.places[index]) else { continue };
            let missed = shown.missed.powi(i32::from(self.pilot.settings.looks));
            self.marked.extend((self.rng.random::<f64>() >= missed).then_some(dot));
        }
        self.dots = shown.into_iter().map(|index| self.dots[index]).collect();
        self.places.clear();
    }

    /// Removes all dots that the navigator does not know to be of the given kind.
    fn keep_only(&mut self, kind: LandmarkKind) {
        let is_own = |dot: &DotId| self.marked.contains(dot) && self.atlas.plane.kind(*dot) == Some(kind);
        let own: Vec<usize> = (0..self.dots.len()).filter(|&index| is_own(&self.dots[index])).collect();
        self.places = own.iter().map(|&index| self.places[index]).collect();
        self.dots = own.iter().map(|&index| self.dots[index]).collect();
    }

    /// Takes a look, and returns the dot that a word refers to.
    fn picks(&mut self, landmark: DotId, corner: Corner, word: Descriptor) -> Option<DotId> {
        self.look_around(landmark, corner);
        self.picked(corner, word)
    }

    /// Takes a look, and returns the dot that the word of a transition refers to. If the word is `*`, the dot is identified by its
    /// bearing. The reference itself cannot be confused with another dot.
    fn seeks(&mut self, from: DotId, transition: &Transition) -> Option<DotId> {
        if transition.word == Descriptor::Same {
            return Some(from);
        }
        self.look_around(from, transition.corner);
        if let Some(kind) = self.atlas.kind(transition) {
            self.keep_only(kind);
        }
        if transition.word != Descriptor::Any {
            return self.picked(transition.corner, transition.word);
        }
        let Settings { window, tolerance, .. } = self.pilot.settings;
        let slack = self.pilot.settings.slack();
        let covers = |place: &Point| {
            window.land.is_some() || transition.corner.nearly_covers(*place, window.side, slack)
        };
        let (dots, places): (Vec<_>, Vec<_>) =
            self.dots.iter().zip(&self.places).filter(|(_, place)| covers(place)).unzip();
        let heading = Heading::of_sigma(self.pilot.noise.heading_rad);
        let bearing_deg = self.atlas.bearing_deg(from, transition)?;
        heading.pick(bearing_deg, &places, tolerance).map(|index| dots[index])
    }

    /// Returns the dot that a word refers to in the last look.
    pub(crate) fn picked(&self, corner: Corner, word: Descriptor) -> Option<DotId> {
        let (side, slack) = (self.atlas.window.side, self.pilot.settings.slack());
        word.pick_in(&self.places, corner, side, slack).map(|index| self.dots[index])
    }

    /// Returns the dot attained by a slide along the line through two dots. The errors of all dots determine which one enters the
    /// window first.
    pub(crate) fn slides(&mut self, from: DotId, seen: DotId, movement: Movement) -> Option<DotId> {
        let (first, second) = (self.seen(from), self.seen(seen));
        let slide = Slide::of_pair(first, second, movement == Movement::Backward)?;
        let nominal = slide.lands(&self.atlas.plane, self.atlas.window)?;
        let way = Noise { sigma: 0.0, map_sigma: 0.0, ..self.pilot.noise };
        let aside = self.atlas.reliability.trajectories.aside(nominal.distance, (second - first).norm(), way);
        let slide = slide.moved_aside(error(&mut self.rng, aside).x);
        let reach = 6.0 * self.pilot.noise.combined_sigma();
        // The nominal landmark may pass beside the window, in which case a more distant one enters.
        (0..STRIPS).find_map(|strip| {
            let far = nominal.distance + reach + f64::from(strip * strip) * self.atlas.window.side;
            self.first_within(slide, far, reach)
        })
    }

    /// Returns the first dot met by a slide within a distance.
    fn first_within(&mut self, slide: Slide, far: f64, reach: f64) -> Option<DotId> {
        let (plane, window) = (&self.atlas.plane, self.atlas.window);
        let end = slide.from + slide.along * far;
        let half = Point::new(window.side / 2.0 + reach, window.side / 2.0 + reach);
        let low = Point::new(slide.from.x.min(end.x), slide.from.y.min(end.y)) - half;
        let high = Point::new(slide.from.x.max(end.x), slide.from.y.max(end.y)) + half;
        let dots: Vec<DotId> = plane.within(low, high).map(|(dot, _)| dot).collect();
        let met = dots.into_iter().filter_map(|dot| Some((slide.meets(window, self.place(dot))?, dot)));
        met.filter(|(distance, _)| *distance <= far).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, dot)| dot)
    }

    /// Returns the dot attained by a transition.
    fn attains(&mut self, from: DotId, transition: &Transition) -> Option<DotId> {
        let seen = self.seeks(from, transition)?;
        if transition.movement == Movement::Seek {
            return Some(seen);
        }
        self.lands(from, seen, transition)
    }

    /// Returns the dot attained by a slide with errors.
    fn lands(&mut self, from: DotId, seen: DotId, transition: &Transition) -> Option<DotId> {
        let (first, second) = (self.seen(from), self.seen(seen));
        let slide = Slide::of_pair(first, second, transition.movement == Movement::Backward)?;
        // The errors along the slide are the only remaining terms of equation 2, since the goal has an error of its own.
        let noise = self.pilot.noise;
        let way = Noise { sigma: 0.0, map_sigma: 0.0, ..noise };
        let pair = (second - first).norm();
        let aside = self.atlas.reliability.trajectories.aside(f64::from(transition.slide), pair, way);
        let drawn = error(&mut self.rng, aside.hypot(noise.map_sigma)).x;
        slide.moved_aside(drawn).lands(&self.atlas.plane, self.atlas.window).map(|landing| landing.dot)
    }

    /// Returns the dot that the navigator finally accepts as right, or `None` if it knows that it is lost.
    fn verifies(&mut self, attained: DotId, verification: Verification) -> Option<DotId> {
        let mut dot = attained;
        for _ in 0..=self.pilot.settings.most_recoveries {
            match verification.response(self.signature(dot)) {
                Response::Correct => return Some(dot),
                Response::Recover(recovery) => dot = self.picks(dot, recovery.corner, recovery.word)?,
                Response::Branch(_) | Response::Lost => return None,
            }
        }
        None
    }

    /// Returns the surroundings of a dot, with a separate look at each quadrant.
    pub(crate) fn signature(&mut self, dot: DotId) -> Signature {
        let side = self.atlas.window.side;
        let mut signature = Signature::default();
        for quadrant in Corner::ALL {
            self.look_around(dot, quadrant);
            let held = self.places.iter().filter(|&&place| quadrant.covers(place, side));
            held.for_each(|_| signature.occupy(quadrant));
        }
        signature
    }
}

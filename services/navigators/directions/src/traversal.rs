//! Simulates a helicopter or a robot on land that follows a custom map, for Monte Carlo estimates and for tests.
//!
//! The window hangs over the plane and follows commands. Its position and heading have random errors, which grow with the
//! square root of the distance travelled. The camera sees each dot with a position error, misses some dots, and sees some that
//! don't exist. The judge knows the plane and distinguishes the six kinds of success and failure (Park and Kender 1995, 7.2.6).

use std::f64::consts::PI;

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};

use crate::custom_map::CustomMap;
use crate::error::Error;
use crate::generate;
use crate::geometry::{Point, Window};
use crate::navigator::guide::Guide;
use crate::navigator::view::Seen;
use crate::navigator::{Activity, Navigator, Outcome, Output, Turning};
use crate::plane::{DotId, Plane};
use crate::sight::{Eye, bearing_rad, is_seen};
use crate::walls::Walls;

/// The time between two steps, in seconds.
pub const STEP_S: f64 = 0.1;
/// The time between two steps on land, in seconds. It is longer to save time, because a robot's journey takes minutes.
pub const LAND_STEP_S: f64 = 0.5;
/// Angle to its direction below which a robot with a differential drive stops turning on the spot, in radians.
const FACING_RAD: f64 = 0.35;
/// Angles at which a robot on land tries other directions if its own leads into a wall, in radians.
const ASIDE_RAD: [f64; 7] = [0.0, 0.4, -0.4, 0.9, -0.9, 1.5, -1.5];

/// The errors of the helicopter, its camera and the map-maker. Lengths are in the plane's unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// Standard deviation of a dot's position in the navigator's view, on each axis.
    pub sigma: f64,
    /// Standard deviation of a dot's position as the map-maker knows it, on each axis.
    pub map_sigma: f64,
    /// Probability that a view misses a dot.
    pub misses: f64,
    /// Mean number of false dots in a view.
    pub false_dots: f64,
    /// Standard deviation of the position after a movement of length 1, on each axis. It grows with the square root of the
    /// length.
    pub translation: f64,
    /// Standard deviation of the heading after a movement of length 1, in radians. It grows with the square root of the length.
    pub rotation_rad: f64,
    /// Standard deviation of the heading at the start, in radians.
    pub heading_rad: f64,
    /// Whether the heading at the start may be any, whatever its standard deviation.
    pub heading_unknown: bool,
}

impl Noise {
    /// No errors at all.
    pub const NONE: Self = Self {
        sigma: 0.0,
        map_sigma: 0.0,
        misses: 0.0,
        false_dots: 0.0,
        translation: 0.0,
        rotation_rad: 0.0,
        heading_rad: 0.0,
        heading_unknown: false,
    };

    /// Returns position errors only, the same for the navigator and the map-maker.
    pub fn of_sigma(sigma: f64) -> Self {
        Self { sigma, map_sigma: sigma, ..Self::NONE }
    }

    /// Returns the standard deviation of the difference between a position in the view and the same position on the map.
    pub fn combined_sigma(self) -> f64 {
        self.sigma.hypot(self.map_sigma)
    }

    /// Rejects negative errors and probabilities above 1.
    pub fn check(self) -> Result<Self, Error> {
        for (what, value, most) in [
            ("error of position", self.sigma, f64::MAX),
            ("error of the map", self.map_sigma, f64::MAX),
            ("probability of a miss", self.misses, 1.0),
            ("false dots", self.false_dots, 1000.0),
            ("error of translation", self.translation, f64::MAX),
            ("error of rotation", self.rotation_rad, f64::MAX),
            ("error of the heading", self.heading_rad, f64::MAX),
        ] {
            if !(0.0..=most).contains(&value) {
                return Err(Error::Parameter { what, expected: "a number from 0, in range", found: value });
            }
        }
        Ok(self)
    }
}

/// The window over the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Helicopter {
    /// The window's centre.
    pub centre: Point,
    /// Angle by which the window has turned to the left, in radians.
    pub heading_rad: f64,
    /// Direction that a robot on land faces, in radians to the left of the window's x axis.
    pub faces_rad: f64,
}

impl Helicopter {
    /// Creates a helicopter, or a robot that faces along the window's x axis.
    pub fn new(centre: Point, heading_rad: f64) -> Self {
        Self { centre, heading_rad, faces_rad: 0.0 }
    }

    /// Returns the dots that the camera sees in `view`, relative to the window's centre and along its axes.
    pub fn look(&self, plane: &Plane, window: Window, noise: Noise, rng: &mut Pcg64Mcg, view: &mut Seen) {
        view.clear();
        let half = window.side / 2.0 + window.margin;
        let around: Vec<(DotId, Point)> =
            plane.around(self.centre, window.reach()).map(|(dot, at)| (dot, at - self.centre)).collect();
        let eye = Eye { at: self.centre, walls: plane.walls() };
        for &(dot, at) in &around {
            // A dot doesn't hide itself, since only nearer dots can hide it.
            let is_hidden =
                window.land.is_some_and(|land| !is_seen(land, eye, at, around.iter().map(|(_, at)| *at)));
            let relative = at.turned(-self.heading_rad);
            if window.camera_sees(relative)
                && !is_hidden
                && !(noise.misses > 0.0 && rng.random_bool(noise.misses))
            {
                let place = relative + generate::error(rng, noise.sigma);
                let kind = plane.shown(dot, at).filter(|shown| rng.random::<f64>() >= shown.missed);
                view.push(place, kind.map(|shown| shown.kind));
            }
        }
        for _ in 0..arrivals(rng, noise.false_dots) {
            view.push(Point::new(rng.random_range(-half..=half), rng.random_range(-half..=half)), None);
        }
    }

    /// Moves for some time at a velocity in the window's axes.
    pub fn fly(&mut self, velocity: Point, elapsed_s: f64, noise: Noise, rng: &mut Pcg64Mcg) {
        let way = velocity * elapsed_s;
        let spread = way.norm().sqrt();
        if spread > 0.0 {
            let turn: f64 = StandardNormal.sample(rng);
            self.centre =
                self.centre + way.turned(self.heading_rad) + generate::error(rng, noise.translation * spread);
            self.heading_rad += turn * noise.rotation_rad * spread;
        }
    }

    /// Turns a robot with a differential drive towards the direction of a velocity, as far as it can in this time. Returns the
    /// velocity at which it drives meanwhile, which is zero until it nearly faces that direction.
    fn turn(&mut self, wish: Point, elapsed_s: f64, turning: Turning, rng: &mut Pcg64Mcg) -> Point {
        let front = Point::new(1.0, 0.0).turned(self.faces_rad);
        let (off_rad, most_rad) = (bearing_rad(front, wish), turning.rate_radps * elapsed_s);
        let turn_rad = off_rad.clamp(-most_rad, most_rad);
        let drawn: f64 = StandardNormal.sample(rng);
        self.faces_rad += turn_rad;
        self.heading_rad += drawn * turning.drift_rad * turn_rad.abs().sqrt();
        let (sin, cos) = (off_rad - turn_rad).sin_cos();
        let drives = cos > 0.0 && sin.abs() <= FACING_RAD.sin();
        let speed = if drives { wish.norm() * cos } else { 0.0 };
        front.turned(turn_rad) * speed
    }

    /// Returns the velocity closest to `wish` that doesn't lead into a wall, in the window's axes, or zero if every direction
    /// does.
    fn guarded(&self, wish: Point, elapsed_s: f64, walls: &Walls) -> Point {
        let is_free = |velocity: &Point| {
            let way = (*velocity * elapsed_s).turned(self.heading_rad);
            !walls.touch(self.centre, self.centre + way)
        };
        let ways = ASIDE_RAD.map(|aside_rad| wish.turned(aside_rad));
        ways.into_iter().find(is_free).unwrap_or_default()
    }

    /// Converts a position in the window to one on the plane.
    pub fn on_plane(&self, place: Point) -> Point {
        self.centre + place.turned(self.heading_rad)
    }
}

/// Draws a Poisson-distributed number by Knuth's multiplication method, which suits small means.
fn arrivals(rng: &mut Pcg64Mcg, mean: f64) -> u32 {
    if mean <= 0.0 {
        return 0;
    }
    let (limit, mut product, mut count) = ((-mean).exp(), rng.random::<f64>(), 0);
    while product > limit {
        product *= rng.random::<f64>();
        count += 1;
    }
    count
}

/// The outcome of a journey as determined by the judge, one of the six kinds of 7.2.6.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Kind {
    /// Success 1: at the goal by the right path, without a recovery.
    Direct,
    /// Success 2: at the goal, after recoveries.
    Recovered,
    /// Success 3: at the goal by a wrong path, without being aware of the mistake.
    Unaware,
    /// Failure 1: the navigator cannot locate a landmark, and knows it.
    CannotLocate,
    /// Failure 2: the verification has shown that the navigator is lost.
    Lost,
    /// Failure 3: the navigator reports success but is not at the goal.
    Astray,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 6] =
        [Self::Direct, Self::Recovered, Self::Unaware, Self::CannotLocate, Self::Lost, Self::Astray];

    /// Returns the display name.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Direct => "direct",
            Self::Recovered => "recovered",
            Self::Unaware => "unaware",
            Self::CannotLocate => "cannot locate",
            Self::Lost => "lost",
            Self::Astray => "astray",
        }
    }

    /// Returns true if the navigator is at the goal and reports it.
    pub fn is_success(self) -> bool {
        self < Self::CannotLocate
    }
}

/// The result of a journey.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The kind of outcome.
    pub kind: Kind,
    /// The dots that the navigator accepted as right, one for each entry that it finished.
    pub attained: Vec<DotId>,
    /// The dots that the navigator believed it had attained.
    pub meant: Vec<DotId>,
    /// Numbers of the entries that it finished with these dots, from 0.
    pub entries: Vec<u16>,
    /// The entry at which the journey ended or, if it failed, at which it first took a wrong dot.
    pub last_entry: u16,
    /// Number of recoveries.
    pub recoveries: u16,
    /// Number of steps.
    pub steps: u32,
    /// Distance that the window was moved.
    pub distance: f64,
}

/// A journey over a plane.
#[derive(Debug)]
pub struct Traversal<'a, G = CustomMap> {
    plane: &'a Plane,
    navigator: &'a Navigator<G>,
    noise: Noise,
    /// The landmarks that the guide refers to. For a map, one for each entry: the landmark at which the next entry begins or,
    /// for the last entry, the goal.
    intended: &'a [DotId],
}

impl<'a, G: Guide> Traversal<'a, G> {
    /// Creates a journey over the true plane. Rejects invalid errors. Also rejects intended landmarks that aren't dots of the
    /// plane, or whose number differs from that of the guide's landmarks.
    pub fn new(
        plane: &'a Plane,
        navigator: &'a Navigator<G>,
        intended: &'a [DotId],
        noise: Noise,
    ) -> Result<Self, Error> {
        let noise = noise.check()?;
        intended.iter().try_for_each(|&dot| plane.known(dot).map(drop))?;
        if intended.len() != navigator.guide().landmarks() {
            let found = intended.len() as f64;
            return Err(Error::Parameter {
                what: "intended landmarks",
                expected: "one for each that the guide refers to",
                found,
            });
        }
        Ok(Self { plane, navigator, noise, intended })
    }

    /// Simulates the journey from a position of the window's centre to its end. Calls `watch` after each step.
    pub fn run(
        &self,
        from: Point,
        rng: &mut Pcg64Mcg,
        mut watch: impl FnMut(&Helicopter, &Output, &[Point]),
    ) -> Report {
        let drawn: f64 = StandardNormal.sample(rng);
        let heading_rad = match self.noise.heading_unknown {
            true => rng.random_range(-PI..PI),
            false => drawn * self.noise.heading_rad,
        };
        let mut helicopter = Helicopter::new(from, heading_rad);
        let mut state = self.navigator.start();
        let mut view = Seen::default();
        let step_s = self.navigator.settings().window.land.map_or(STEP_S, |_| LAND_STEP_S);
        let mut report = Report {
            kind: Kind::Lost,
            attained: Vec::new(),
            meant: Vec::new(),
            entries: Vec::new(),
            last_entry: 0,
            recoveries: 0,
            steps: 0,
            distance: 0.0,
        };
        loop {
            helicopter.look(self.plane, self.navigator.settings().window, self.noise, rng, &mut view);
            let elapsed_s = if report.steps == 0 { 0.0 } else { step_s };
            let output = self.navigator.step(&mut state, view.view(), elapsed_s);
            report.steps += 1;
            if usize::from(output.accepted) > report.attained.len() {
                report.attained.push(self.attained(&helicopter, &output));
                report.meant.push(self.intended[usize::from(output.meant)]);
                report.entries.push(output.entry);
            }
            watch(&helicopter, &output, &view.dots);
            if let Some(outcome) = output.outcome {
                report.recoveries = output.recoveries;
                report.last_entry = self.slip(&report).unwrap_or(output.entry);
                report.kind = self.judge(outcome, &report);
                return report;
            }
            let mut velocity = output.velocity;
            if let Some(turning) = self.navigator.settings().turning {
                velocity = helicopter.turn(velocity, step_s, turning, rng);
                state.moves_by(velocity);
            }
            if !self.plane.walls().is_empty() {
                velocity = helicopter.guarded(velocity, step_s, self.plane.walls());
                state.moves_by(velocity);
            }
            report.distance += velocity.norm() * step_s;
            helicopter.fly(velocity, step_s, self.noise, rng);
        }
    }

    /// Returns the entry at which the navigator first took a wrong dot, if it did.
    fn slip(&self, report: &Report) -> Option<u16> {
        let taken = report.entries.iter().zip(report.attained.iter().zip(&report.meant));
        let is_wrong = |(entry, (attained, meant)): &(&u16, (&DotId, &DotId))| {
            !Guide::is_right(self.navigator.guide(), **entry, **attained, **meant)
        };
        taken.filter(is_wrong).map(|(&entry, _)| entry).next()
    }

    /// Returns the dot closest to where the navigator believes its reference to be.
    fn attained(&self, helicopter: &Helicopter, output: &Output) -> DotId {
        let place = helicopter.on_plane(output.reference.unwrap_or_default());
        let mut reach = self.navigator.settings().window.side / 8.0;
        loop {
            let distance = |dot: &(DotId, Point)| (dot.1 - place).norm_squared();
            let near = self.plane.around(place, reach).min_by(|a, b| distance(a).total_cmp(&distance(b)));
            if let Some((dot, _)) = near {
                return dot;
            }
            reach *= 2.0;
        }
    }

    fn judge(&self, outcome: Outcome, report: &Report) -> Kind {
        let guide = self.navigator.guide();
        let is_planned = || guide.is_planned(&report.attained, &report.meant, &report.entries);
        match outcome {
            Outcome::CannotLocate => Kind::CannotLocate,
            Outcome::Lost => Kind::Lost,
            Outcome::Arrived if report.attained.last() != self.intended.get(guide.goal()) => Kind::Astray,
            Outcome::Arrived if !is_planned() => Kind::Unaware,
            Outcome::Arrived if report.recoveries > 0 => Kind::Recovered,
            Outcome::Arrived => Kind::Direct,
        }
    }
}

/// Returns the activities of a journey in order, without immediate repetitions.
pub fn activities(journey: &Traversal<'_>, from: Point, rng: &mut Pcg64Mcg) -> Vec<Activity> {
    let mut seen = Vec::new();
    journey.run(from, rng, |_, output, _| {
        if seen.last() != Some(&output.activity) {
            seen.push(output.activity);
        }
    });
    seen
}

#[cfg(test)]
mod tests;

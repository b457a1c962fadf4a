//! Our own way along a sketched route: the robot drives by where it probably is in the drawing, and says how sure it is.
//!
//! [`crate::belief`] says where the robot is. From there it pursues the drawn route (Coulter 1992), while the reactive
//! controller of Chronis 2007 keeps it off objects. At the end it goes on to the object there and stops before it. It is
//! lost where what it sees does not fit the drawing any more, or where the goal does not come.

use serde::{Deserialize, Serialize};

use crate::belief::{Belief, Believing, Estimate};
use crate::control::{self, Controlling, Drive, Sectors};
use crate::error::Error;
use crate::extraction::track::headings;
use crate::follower::Sensed;
use crate::memory::{Memory, Relation, Remembering};
use crate::outlines::Outlines;
use crate::plane::{self, At};
use crate::route::INCH_M;
use crate::sketch::Sketch;

/// How the robot is guided.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Guiding {
    /// The belief.
    pub belief: Believing,
    /// The memory.
    pub memory: Remembering,
    /// Speeds, and how objects are avoided.
    pub control: Controlling,
    /// How far the sensors are from the robot's centre, in metres.
    pub ring_m: f64,
    /// Ranges from here on are no returns, in metres.
    pub range_max_m: f64,
    /// How far ahead on the route the robot aims, in metres.
    pub ahead_m: f64,
    /// The greatest turn rate, in degrees a second.
    pub turn_dps: f64,
    /// How much stronger objects are avoided than by formula 4.27.
    pub avoid: f64,
    /// From so far before the end on, an object in front is the goal, in drawn metres.
    pub goal_m: f64,
    /// How far the robot looks for the goal beyond the end of the route, in drawn metres.
    pub beyond_m: f64,
    /// The robot is lost where less than this of what it sees fits the drawing.
    pub least_fit: f64,
    /// It is lost where it goes so many times the way that is drawn.
    pub most_way: f64,
}

impl Default for Guiding {
    fn default() -> Self {
        Self {
            belief: Believing::default(),
            memory: Remembering::default(),
            control: Controlling::default(),
            ring_m: 10.0 * INCH_M,
            range_max_m: 255.0 * INCH_M,
            ahead_m: 1.2,
            turn_dps: 30.0,
            avoid: 2.0,
            goal_m: 1.5,
            beyond_m: 2.5,
            least_fit: 0.15,
            most_way: 2.0,
        }
    }
}

/// How the robot fares.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// It stopped before its goal.
    Arrived,
    /// It does not know where it is.
    Lost,
}

/// What the guide remembers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Journey {
    belief: Belief,
    memory: Memory,
    /// How far along the drawn route the robot is, in drawn metres; above its length beyond the end.
    along_m: f64,
    /// How far the robot went, in drawn metres.
    gone_m: f64,
    outcome: Option<Outcome>,
}

/// Guides a robot along a drawn route.
#[derive(Debug, Clone)]
pub struct Guide {
    settings: Guiding,
    angles_rad: Vec<f64>,
    outlines: Outlines,
    route: Vec<At>,
    /// How far each point of the route is from its start.
    lengths: Vec<f64>,
    journey: Journey,
}

impl Guide {
    /// At the start of a sketch's route, with a ring of sensors by the angles of its beams.
    ///
    /// # Errors
    /// [`Error::NoRoute`], and [`Error::Sensor`] where there are no beams.
    pub fn new(sketch: &Sketch, angles_rad: &[f64], settings: Guiding, seed: u64) -> Result<Self, Error> {
        if sketch.route.len() < 2 {
            return Err(Error::NoRoute { objects: sketch.landmarks.len(), stray: 0 });
        }
        if angles_rad.is_empty() {
            return Err(Error::Sensor { expected: "range sensors", found: "none".into() });
        }
        let route = sketch.route.clone();
        let mut along = 0.0;
        let steps = route.windows(2).map(|pair| {
            along += plane::distance(pair[0], pair[1]);
            along
        });
        let lengths = std::iter::once(0.0).chain(steps).collect();
        // A hand trembles where it begins: the heading is that of the first steps together.
        let heading_rad = headings(&route, 10.0 * INCH_M)[0];
        let journey = Journey {
            belief: Belief::new(route[0], heading_rad, settings.belief, seed),
            memory: Memory::new(settings.memory),
            along_m: 0.0,
            gone_m: 0.0,
            outcome: None,
        };
        Ok(Self {
            settings,
            angles_rad: angles_rad.to_vec(),
            outlines: Outlines::of(sketch),
            route,
            lengths,
            journey,
        })
    }

    /// What it remembers.
    pub const fn journey(&self) -> &Journey {
        &self.journey
    }

    /// Goes on from there.
    pub fn restore(&mut self, journey: Journey) {
        self.journey = journey;
    }

    /// Where the robot probably is.
    pub fn estimate(&self) -> Estimate {
        self.journey.belief.estimate()
    }

    /// How far along the drawn route it is, in drawn metres.
    pub const fn along_m(&self) -> f64 {
        self.journey.along_m
    }

    /// A step: what the robot is to do, and how it fared where it ended.
    ///
    /// # Errors
    /// [`Error::Sensor`] where the number of ranges is not that of the beams.
    pub fn step(&mut self, sensed: &Sensed<'_>) -> Result<(Drive, Option<Outcome>), Error> {
        if sensed.ranges_m.len() != self.angles_rad.len() {
            let found = format!("{}", sensed.ranges_m.len());
            return Err(Error::Sensor { expected: "as many ranges as beams", found });
        }
        if self.journey.outcome.is_some() {
            return Ok((Drive::default(), None));
        }
        self.perceive(sensed);
        let estimate = self.estimate();
        self.journey.gone_m += sensed.moved_m.abs() / estimate.stretch;
        self.advance(estimate.at, sensed.moved_m / estimate.stretch);
        let sectors = control::sectors(&self.angles_rad, sensed.ranges_m, self.settings.range_max_m);
        self.journey.outcome = self.outcome(&estimate, &sectors);
        if self.journey.outcome.is_some() {
            return Ok((Drive::default(), self.journey.outcome));
        }
        Ok((self.drive(&estimate, &sectors), None))
    }

    fn perceive(&mut self, sensed: &Sensed<'_>) {
        let Self { settings, angles_rad, outlines, journey, .. } = self;
        journey.belief.moved(sensed.moved_m, sensed.turned_rad);
        journey.memory.moved(sensed.moved_m, sensed.turned_rad);
        let returns = angles_rad
            .iter()
            .zip(sensed.ranges_m)
            .filter(|(_, range)| range.is_finite() && (0.0..settings.range_max_m).contains(*range));
        journey.memory.see(returns.map(|(angle, range)| Relation::polar(*angle, range + settings.ring_m)));
        if sensed.moved_m != 0.0 || sensed.turned_rad != 0.0 {
            journey.belief.seen(&journey.memory, outlines);
        }
    }

    fn length(&self) -> f64 {
        self.lengths[self.lengths.len() - 1]
    }

    /// The place on the route at a distance from its start; beyond its end straight on.
    fn place(&self, along: f64) -> At {
        let i = self.lengths.partition_point(|length| *length <= along).clamp(1, self.route.len() - 1);
        let part = (along - self.lengths[i - 1]) / (self.lengths[i] - self.lengths[i - 1]);
        plane::between(self.route[i - 1], self.route[i], part)
    }

    /// The place on the route is the nearest to the estimate, within what the robot may have gone.
    fn advance(&mut self, at: At, drawn_m: f64) {
        let begin = self.journey.along_m;
        let far = 1.0 + drawn_m;
        let candidates =
            (0..=40).map(|i| begin - 0.3 + (far + 0.3) * f64::from(i) / 40.0).filter(|along| *along >= 0.0);
        let distance = |along: f64| plane::distance(self.place(along), at);
        let nearest = candidates.map(|along| (distance(along), along)).min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, along)) = nearest {
            self.journey.along_m = along.clamp(begin - 0.1, begin + 0.3 + drawn_m);
        }
    }

    fn outcome(&self, estimate: &Estimate, sectors: &Sectors) -> Option<Outcome> {
        let left = self.length() - self.journey.along_m;
        let settings = &self.settings;
        if left < settings.goal_m && control::front_m(sectors) < settings.control.stop_m {
            return Some(Outcome::Arrived);
        }
        let is_beyond = left < -settings.beyond_m;
        let is_far = self.journey.gone_m > settings.most_way * self.length() + settings.beyond_m;
        (is_beyond || is_far || estimate.fit < settings.least_fit).then_some(Outcome::Lost)
    }

    /// Pure pursuit, with what the reactive controller avoids.
    fn drive(&self, estimate: &Estimate, sectors: &Sectors) -> Drive {
        let settings = &self.settings;
        let aim = self.place(self.journey.along_m + settings.ahead_m);
        let off = plane::wrap(plane::direction(estimate.at, aim) - estimate.heading_rad);
        let avoid = control::avoidance(sectors, &settings.control);
        let away = -avoid.direction_rad * avoid.strength * settings.control.range_m
            / INCH_M
            / settings.control.normalization
            * settings.avoid;
        let most = settings.turn_dps.to_radians();
        let front = control::front_m(sectors);
        let is_close = front < settings.control.close_m;
        let speed = if is_close { settings.control.slow_mps } else { settings.control.speed_mps };
        Drive { speed_mps: speed * off.cos().max(0.2), yaw_rate_radps: (1.2 * off).clamp(-most, most) + away }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sketch::Landmark;

    /// A route of 4 m to a wall.
    fn sketch() -> Sketch {
        let wall = vec![[5.0, -2.0], [5.5, -2.0], [5.5, 2.0], [5.0, 2.0]];
        let landmarks = vec![Landmark { name: "wall".into(), outline: wall }];
        Sketch { landmarks, route: plane::resample(&[[0.0, 0.0], [4.0, 0.0]], 0.5), metres_per_pixel: 0.1 }
    }

    fn angles() -> [f64; 16] {
        std::array::from_fn(|i| i as f64 * std::f64::consts::FRAC_PI_8)
    }

    fn guide() -> Guide {
        Guide::new(&sketch(), &angles(), Guiding::default(), 9).unwrap()
    }

    /// A step at a distance from the wall, of which the front sensors see something.
    fn step(guide: &mut Guide, left_m: f64) -> (Drive, Option<Outcome>) {
        let ranges_m =
            angles().map(|angle| if angle.cos() > 0.7 { left_m / angle.cos() } else { f64::INFINITY });
        guide.step(&Sensed { ranges_m: &ranges_m, time_s: 0.2, moved_m: 0.1, turned_rad: 0.0 }).unwrap()
    }

    #[test]
    fn the_robot_stops_before_the_object_at_the_end() {
        let mut guide = guide();
        let mut left_m = 4.7;
        let outcome = loop {
            left_m -= 0.1;
            if let (_, Some(outcome)) = step(&mut guide, left_m) {
                break outcome;
            }
        };
        assert_eq!(outcome, Outcome::Arrived);
        assert!((0.6..0.77).contains(&left_m), "{left_m}");
        assert_eq!(step(&mut guide, left_m), (Drive::default(), None));
    }

    #[test]
    fn an_object_in_the_middle_of_the_route_is_not_the_goal() {
        let (drive, outcome) = step(&mut guide(), 0.5);
        assert_eq!(outcome, None);
        assert!((drive.speed_mps - Controlling::default().slow_mps).abs() < 0.02, "{drive:?}");
    }

    #[test]
    fn a_robot_that_finds_no_goal_is_lost() {
        let mut guide = guide();
        let lost = (0..400).find_map(|_| step(&mut guide, f64::INFINITY).1);
        assert_eq!(lost, Some(Outcome::Lost));
    }

    #[test]
    fn a_guide_goes_on_from_what_it_remembers() {
        let run = |restore_at: usize| {
            let mut guide = guide();
            let mut found = Vec::new();
            for i in 0..30 {
                if i == restore_at {
                    let text = serde_json::to_string(guide.journey()).unwrap();
                    guide = self::guide();
                    guide.restore(serde_json::from_str(&text).unwrap());
                }
                found.push(step(&mut guide, 4.7 - 0.1 * i as f64));
            }
            found
        };
        let whole = run(99);
        for i in [1, 7, 20] {
            assert_eq!(run(i), whole);
        }
    }

    #[test]
    fn robots_without_sensors_are_rejected() {
        assert!(matches!(Guide::new(&sketch(), &[], Guiding::default(), 1), Err(Error::Sensor { .. })));
        let sensed = Sensed { ranges_m: &[1.0; 3], time_s: 0.2, moved_m: 0.0, turned_rad: 0.0 };
        assert!(guide().step(&sensed).is_err());
    }
}

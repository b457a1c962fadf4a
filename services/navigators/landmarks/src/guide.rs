//! Our own way along a sketched route: the robot drives by where it probably is in the drawing, and says how sure it is.
//!
//! [`crate::locator`] says where the robot is. From there it pursues the drawn route (Coulter 1992), while the reactive
//! controller of Chronis 2007 keeps it off objects. At the end it goes on to the object there and stops before it. It is
//! lost where what it sees does not fit the drawing any more, or where the goal does not come.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::wrap_angle;

use crate::belief::Estimate;
use crate::control::{self, Controlling, Drive, Sectors};
use crate::error::Error;
use crate::numbers;
use crate::plane::{self, At};
use crate::route::{Command, INCH_M};
use crate::sketch::Sketch;

/// How the robot is guided.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Guiding {
    /// Speeds, and how objects are avoided.
    pub control: Controlling,
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
            control: Controlling::default(),
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

impl Guiding {
    /// `Ok` where all numbers are in their ranges.
    ///
    /// # Errors
    /// [`Error::Number`] with the key.
    pub fn check(&self) -> Result<(), Error> {
        let Self { control, ahead_m, turn_dps, avoid, goal_m, beyond_m, least_fit, most_way } = self;
        numbers::within("control", control.check())?;
        numbers::above_0(&[("ahead_m", *ahead_m)])?;
        numbers::from_0_on(&[
            ("turn_dps", *turn_dps),
            ("avoid", *avoid),
            ("goal_m", *goal_m),
            ("beyond_m", *beyond_m),
            ("least_fit", *least_fit),
            ("most_way", *most_way),
        ])
    }
}

/// How the robot fares.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// It stopped before its goal.
    Arrived,
    /// The goal did not come: beyond the end of the drawn route, or after twice its length.
    NoGoal,
    /// What it sees does not fit the drawing.
    Lost,
}

/// What the guide remembers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// How far along the drawn route the robot is, in drawn metres; above its length beyond the end.
    along_m: f64,
    /// How far the robot went, in drawn metres.
    gone_m: f64,
    outcome: Option<Outcome>,
}

/// What the robot knows in a step.
#[derive(Debug, Clone, Copy)]
pub struct Guided<'a> {
    /// Where it probably is.
    pub estimate: Estimate,
    /// The nearest ranges in sixteen directions.
    pub sectors: &'a Sectors,
    /// The way since the last step by odometry, in metres.
    pub moved_m: f64,
}

/// Guides a robot along a drawn route.
#[derive(Debug, Clone)]
pub struct Guide {
    settings: Guiding,
    route: Vec<At>,
    /// How far each point of the route is from its start.
    lengths: Vec<f64>,
    state: State,
}

impl Guide {
    /// At the start of a sketch's route.
    ///
    /// # Errors
    /// [`Error::NoRoute`].
    pub fn new(sketch: &Sketch, settings: Guiding) -> Result<Self, Error> {
        if sketch.route.len() < 2 {
            return Err(Error::NoRoute { objects: sketch.landmarks.len(), stray: 0 });
        }
        let route = sketch.route.clone();
        let mut along = 0.0;
        let steps = route.windows(2).map(|pair| {
            along += plane::distance(pair[0], pair[1]);
            along
        });
        let lengths = std::iter::once(0.0).chain(steps).collect();
        Ok(Self { settings, route, lengths, state: State::default() })
    }

    /// What it remembers.
    pub const fn state(&self) -> &State {
        &self.state
    }

    /// Goes on from there.
    pub fn restore(&mut self, state: State) {
        self.state = state;
    }

    /// A person led the robot, which was lost, to a place on its route: it looks again. How far it went on the way there
    /// does not count.
    pub fn look_again(&mut self) {
        if self.state.outcome.is_some_and(|outcome| outcome != Outcome::Arrived) {
            self.state.gone_m = self.state.along_m;
            self.state.outcome = None;
        }
    }

    /// A person says where the robot is: it goes on from the nearest place of its route, and looks again if it was lost.
    pub fn told(&mut self, at: At) {
        self.state.along_m = plane::nearest_along(&self.route, at);
        self.look_again();
    }

    /// How far along the drawn route the robot is, in drawn metres.
    pub const fn along_m(&self) -> f64 {
        self.state.along_m
    }

    /// The length of the drawn route.
    pub fn length_m(&self) -> f64 {
        self.lengths[self.lengths.len() - 1]
    }

    /// What the route does where the robot is, for people: it turns where it bends by 20° or more within the next metre.
    pub fn command(&self) -> Command {
        if self.state.outcome.is_some() {
            return Command::Stop;
        }
        let along = self.state.along_m;
        let [here, there] = [along, along + 1.0]
            .map(|along| plane::direction(self.place(along - 0.3), self.place(along + 0.3)));
        match wrap_angle(there - here).to_degrees() {
            turn if turn > 20.0 => Command::Left,
            turn if turn < -20.0 => Command::Right,
            _ => Command::Forward,
        }
    }

    /// A step: what the robot is to do, and how it fared where it ended.
    pub fn step(&mut self, guided: &Guided<'_>) -> (Drive, Option<Outcome>) {
        if self.state.outcome.is_some() {
            return (Drive::default(), None);
        }
        let Guided { estimate, sectors, moved_m } = guided;
        self.state.gone_m += moved_m.abs() / estimate.stretch;
        self.advance(estimate.at, moved_m / estimate.stretch);
        self.state.outcome = self.outcome(estimate, sectors);
        if self.state.outcome.is_some() {
            return (Drive::default(), self.state.outcome);
        }
        (self.drive(estimate, sectors), None)
    }

    /// The place on the route at a distance from its start; beyond its end straight on.
    fn place(&self, along: f64) -> At {
        let i = self.lengths.partition_point(|length| *length <= along).clamp(1, self.route.len() - 1);
        let part = (along - self.lengths[i - 1]) / (self.lengths[i] - self.lengths[i - 1]);
        plane::between(self.route[i - 1], self.route[i], part)
    }

    /// The place on the route is the nearest to the estimate, within what the robot may have gone.
    fn advance(&mut self, at: At, drawn_m: f64) {
        let begin = self.state.along_m;
        let drawn_m = drawn_m.max(0.0);
        let far = 1.0 + drawn_m;
        let candidates =
            (0..=40).map(|i| begin - 0.3 + (far + 0.3) * f64::from(i) / 40.0).filter(|along| *along >= 0.0);
        let distance = |along: f64| plane::distance(self.place(along), at);
        let nearest = candidates.map(|along| (distance(along), along)).min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, along)) = nearest {
            self.state.along_m = along.clamp(begin - 0.1, begin + 0.3 + drawn_m);
        }
    }

    fn outcome(&self, estimate: &Estimate, sectors: &Sectors) -> Option<Outcome> {
        let left = self.length_m() - self.state.along_m;
        let settings = &self.settings;
        if left < settings.goal_m && control::front_m(sectors) < settings.control.stop_m {
            return Some(Outcome::Arrived);
        }
        let is_beyond = left < -settings.beyond_m;
        let is_far = self.state.gone_m > settings.most_way * self.length_m() + settings.beyond_m;
        if estimate.fit < settings.least_fit {
            return Some(Outcome::Lost);
        }
        (is_beyond || is_far).then_some(Outcome::NoGoal)
    }

    /// Pure pursuit, with what the reactive controller avoids.
    fn drive(&self, estimate: &Estimate, sectors: &Sectors) -> Drive {
        let settings = &self.settings;
        let aim = self.place(self.state.along_m + settings.ahead_m);
        let off = wrap_angle(plane::direction(estimate.at, aim) - estimate.heading_rad);
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

    /// The robot is where it believes to be.
    struct Robot {
        guide: Guide,
        at: At,
    }

    fn start() -> Robot {
        Robot { guide: Guide::new(&sketch(), Guiding::default()).unwrap(), at: [0.2, 0.0] }
    }

    impl Robot {
        /// A step of 0.1 m at a distance from the wall, of which the front sensors see something.
        fn step(&mut self, left_m: f64) -> (Drive, Option<Outcome>) {
            let mut sectors = [f64::INFINITY; 16];
            for x in [15, 0, 1] {
                sectors[x] = left_m / (x as f64 * std::f64::consts::FRAC_PI_8).cos();
            }
            self.at[0] += 0.1;
            let estimate = Estimate { at: self.at, heading_rad: 0.0, stretch: 1.0, spread_m: 0.1, fit: 0.8 };
            self.guide.step(&Guided { estimate, sectors: &sectors, moved_m: 0.1 })
        }
    }

    #[test]
    fn the_robot_stops_before_the_object_at_the_end() {
        let mut robot = start();
        let mut left_m = 4.7;
        let outcome = loop {
            left_m -= 0.1;
            if let (_, Some(outcome)) = robot.step(left_m) {
                break outcome;
            }
        };
        assert_eq!(outcome, Outcome::Arrived);
        assert!((0.6..0.77).contains(&left_m), "{left_m}");
        assert_eq!(robot.step(left_m), (Drive::default(), None));
        assert_eq!(robot.guide.command(), Command::Stop);
    }

    #[test]
    fn an_object_in_the_middle_of_the_route_is_not_the_goal() {
        let (drive, outcome) = start().step(0.5);
        assert_eq!(outcome, None);
        assert!((drive.speed_mps - Controlling::default().slow_mps).abs() < 0.02, "{drive:?}");
    }

    #[test]
    fn a_robot_that_finds_no_goal_says_so() {
        let mut robot = start();
        let ended = (0..400).find_map(|_| robot.step(f64::INFINITY).1);
        assert_eq!(ended, Some(Outcome::NoGoal));
    }

    #[test]
    fn a_robot_that_sees_something_else_is_lost() {
        let mut guide = start().guide;
        let estimate = Estimate { at: [1.0, 0.0], heading_rad: 0.0, stretch: 1.0, spread_m: 0.1, fit: 0.1 };
        let sectors = [f64::INFINITY; 16];
        assert_eq!(guide.step(&Guided { estimate, sectors: &sectors, moved_m: 0.1 }).1, Some(Outcome::Lost));
    }

    #[test]
    fn a_robot_that_was_lost_looks_again() {
        let mut guide = start().guide;
        let estimate = |fit| Estimate { at: [1.0, 0.0], heading_rad: 0.0, stretch: 1.0, spread_m: 0.1, fit };
        let sectors = [f64::INFINITY; 16];
        let step = |guide: &mut Guide, fit| {
            guide.step(&Guided { estimate: estimate(fit), sectors: &sectors, moved_m: 0.1 })
        };
        assert_eq!(step(&mut guide, 0.1).1, Some(Outcome::Lost));
        assert_eq!(step(&mut guide, 0.8), (Drive::default(), None));
        guide.look_again();
        let (drive, outcome) = step(&mut guide, 0.8);
        assert!(drive.speed_mps > 0.0 && outcome.is_none(), "{drive:?}");
    }

    #[test]
    fn a_robot_that_is_told_where_it_is_goes_on_from_there() {
        let mut robot = start();
        robot.guide.restore(State { outcome: Some(Outcome::Lost), gone_m: 30.0, ..State::default() });
        robot.guide.told([3.1, 0.4]);
        assert!((robot.guide.along_m() - 3.1).abs() < 1e-9, "{}", robot.guide.along_m());
        robot.at = [3.1, 0.4];
        let (drive, outcome) = robot.step(1.8);
        assert!(drive.speed_mps > 0.0 && outcome.is_none(), "{drive:?}");
    }

    #[test]
    fn a_guide_goes_on_from_what_it_remembers() {
        let run = |restore_at: usize| {
            let mut robot = start();
            let mut found = Vec::new();
            for i in 0..30 {
                if i == restore_at {
                    let text = serde_json::to_string(robot.guide.state()).unwrap();
                    robot.guide = start().guide;
                    robot.guide.restore(serde_json::from_str(&text).unwrap());
                }
                found.push(robot.step(4.7 - 0.1 * i as f64));
            }
            found
        };
        let whole = run(99);
        for i in [1, 7, 20] {
            assert_eq!(run(i), whole);
        }
    }

    /// A robot was pushed back by half a metre between two readings. The bounds of its place on the route were the
    /// wrong way round, and the planner panicked.
    #[test]
    fn a_robot_that_was_pushed_back_drives_on() {
        let mut robot = start();
        for _ in 0..20 {
            robot.step(4.0);
        }
        let along_m = robot.guide.along_m();
        let estimate = Estimate { at: [1.2, 0.0], heading_rad: 0.0, stretch: 1.0, spread_m: 0.1, fit: 0.8 };
        let sectors = [f64::INFINITY; 16];
        let (drive, outcome) = robot.guide.step(&Guided { estimate, sectors: &sectors, moved_m: -1.0 });
        assert!(outcome.is_none() && drive.speed_mps > 0.0, "{drive:?}");
        assert!((along_m - 0.1..=along_m).contains(&robot.guide.along_m()), "{}", robot.guide.along_m());
    }

    #[test]
    fn the_command_is_what_the_route_does() {
        let bend: Vec<At> = vec![[0.0, 0.0], [3.0, 0.0], [3.0, 3.0]];
        let sketch = Sketch { route: plane::resample(&bend, 0.25), ..sketch() };
        let mut guide = Guide::new(&sketch, Guiding::default()).unwrap();
        assert_eq!(guide.command(), Command::Forward);
        guide.restore(State { along_m: 2.5, ..State::default() });
        assert_eq!(guide.command(), Command::Left);
    }
}

//! Our own method of driving along a sketched route: the robot drives by its estimated pose in the drawing,
//! and reports how well its observations fit.
//!
//! [`crate::locator`] provides the pose. From there, the robot pursues the drawn route (Coulter 1992), while the reactive
//! controller of Chronis 2007 keeps it away from objects. At the end of the route, it drives on to the object there and stops in
//! front of it.
//!
//! If its observations no longer fit the drawing, or if it does not find its goal, the robot drives back by its odometry to a
//! place where it was sure ([`crate::retreat`]) and tries again. After a limited number of such attempts, it is lost.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Point, wrap_angle};

use crate::belief::Estimate;
use crate::control::{self, Attenuation, Controlling, Drive, Sectors};
use crate::drawn::{Drawn, DrawnMetres};
use crate::error::Error;
use crate::numbers;
use crate::plane;
use crate::retreat::{Step, Trail};
use crate::route::{Command, INCH_M};
use crate::sketch::Sketch;

/// Parameters for guiding the robot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Guiding {
    /// Speeds and avoidance.
    pub control: Controlling,
    /// Look-ahead distance along the route, in driven metres.
    pub ahead_m: f64,
    /// Maximum turn rate, in degrees per second.
    pub turn_dps: f64,
    /// Factor by which avoidance is stronger than in formula 4.27.
    pub avoid: f64,
    /// Maximum distance from the end of the route at which an object in front counts as the goal.
    pub goal_m: DrawnMetres,
    /// Distance beyond the end of the route up to which the robot looks for its goal.
    pub beyond_m: DrawnMetres,
    /// Minimum share of observations that fit the drawing. If the share falls below it, the robot is lost.
    pub least_fit: f64,
    /// Maximum ratio of the distance covered to the length of the drawn route. If it is exceeded, the robot
    /// is lost.
    pub most_way: f64,
    /// Maximum number of times that the robot drives back to a place where it was sure, instead of being lost. With a pad, it asks
    /// the person instead.
    pub returns: u32,
}

impl Default for Guiding {
    fn default() -> Self {
        Self {
            control: Controlling { attenuation: Attenuation::Product, ..Controlling::default() },
            ahead_m: 1.2,
            turn_dps: 30.0,
            avoid: 2.0,
            goal_m: DrawnMetres(1.5),
            beyond_m: DrawnMetres(2.5),
            least_fit: 0.15,
            most_way: 2.0,
            returns: 2,
        }
    }
}

impl Guiding {
    /// Checks that all numbers are within their ranges.
    ///
    /// # Errors
    /// [`Error::Number`], which names the first number that is out of range.
    pub fn check(&self) -> Result<(), Error> {
        let Self { control, ahead_m, turn_dps, avoid, goal_m, beyond_m, least_fit, most_way, returns } = self;
        numbers::within("control", control.check())?;
        numbers::above_0(&[("ahead_m", *ahead_m)])?;
        numbers::from_0_on(&[
            ("turn_dps", *turn_dps),
            ("avoid", *avoid),
            ("goal_m", goal_m.0),
            ("beyond_m", beyond_m.0),
            ("least_fit", *least_fit),
            ("most_way", *most_way),
            ("returns", f64::from(*returns)),
        ])
    }
}

/// Outcome of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The robot has stopped in front of its goal.
    Arrived,
    /// The robot has driven too far beyond the end of the drawn route, or too far in total, without reaching its goal.
    NoGoal,
    /// The observations do not fit the drawing.
    Lost,
}

/// State of the guide.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Position of the robot along the drawn route. Greater than the length of the route if the robot is beyond its end.
    along: DrawnMetres,
    /// Distance that the robot has covered.
    gone: DrawnMetres,
    outcome: Option<Outcome>,
    /// The robot's path, on which it drives back.
    trail: Trail,
    /// Number of times that the robot has driven back, and the reason for the last time.
    returns: u32,
    why: Option<Outcome>,
    /// Number of places where the robot was sure, as of the previous step.
    sure: u32,
}

/// Input of a step.
#[derive(Debug, Clone, Copy)]
pub struct Guided<'a> {
    /// Estimate of the robot's pose.
    pub estimate: Estimate,
    /// Nearest ranges in sixteen directions.
    pub sectors: &'a Sectors,
    /// Distance moved since the last step according to odometry, in metres.
    pub moved_m: f64,
    /// Angle turned since the last step according to odometry, in radians.
    pub turned_rad: f64,
    /// Number of places where the robot has been sure: see [`crate::sure`].
    pub sure: u32,
}

/// Guides a robot along a drawn route.
#[derive(Debug, Clone)]
pub struct Guide {
    settings: Guiding,
    route: Vec<Point<Drawn>>,
    /// Distance of each point of the route from the start, along the route.
    lengths: Vec<DrawnMetres>,
    state: State,
}

impl Guide {
    /// Creates a guide at the start of a sketch's route.
    ///
    /// # Errors
    /// [`Error::NoRoute`] if the route has fewer than two points.
    pub fn new(sketch: &Sketch, settings: Guiding) -> Result<Self, Error> {
        if sketch.route.len() < 2 {
            return Err(Error::NoRoute { objects: sketch.landmarks.len(), stray: 0 });
        }
        let route = sketch.route.clone();
        let mut along = DrawnMetres::default();
        let steps = route.windows(2).map(|pair| {
            along = along + DrawnMetres::between(&pair[0], &pair[1]);
            along
        });
        let lengths = std::iter::once(DrawnMetres::default()).chain(steps).collect();
        Ok(Self { settings, route, lengths, state: State::default() })
    }

    /// Returns the state of the guide.
    pub const fn state(&self) -> &State {
        &self.state
    }

    /// Resumes from a stored state.
    pub fn restore(&mut self, mut state: State) {
        state.trail.reserve();
        self.state = state;
    }

    /// Resumes driving after a person has taken the lost robot to a point on its route. The distance covered on the way there is
    /// not counted.
    pub fn look_again(&mut self) {
        if self.is_lost() {
            self.state.gone = self.state.along;
            self.state.outcome = None;
            self.state.returns = 0;
        }
    }

    /// Moves the guide to the point of the route nearest to `at`, where a person says the robot is. If the robot was lost, it
    /// resumes driving.
    pub fn told(&mut self, at: Point<Drawn>) {
        self.state.along = DrawnMetres(plane::nearest_along(&self.route, at));
        self.state.trail.forget_way_back();
        self.look_again();
    }

    /// Returns true if the drive has ended.
    pub const fn has_ended(&self) -> bool {
        self.state.outcome.is_some()
    }

    /// Returns true if the drive has ended because the robot is lost or has not found its goal.
    pub fn is_lost(&self) -> bool {
        self.state.outcome.is_some_and(|outcome| outcome != Outcome::Arrived)
    }

    /// Returns the position of the robot along the drawn route.
    pub const fn along(&self) -> DrawnMetres {
        self.state.along
    }

    /// Returns the length of the drawn route.
    pub fn length(&self) -> DrawnMetres {
        self.lengths[self.lengths.len() - 1]
    }

    /// Returns true if the robot is driving back to a place where it was sure.
    pub const fn is_going_back(&self) -> bool {
        self.state.trail.is_going_back()
    }

    /// Describes what the robot does at its position along the route, for people. The route counts as turning if it bends by more
    /// than 20° within the next drawn metre.
    pub fn command(&self) -> Command {
        if self.state.outcome.is_some() {
            return Command::Stop;
        }
        const AROUND: DrawnMetres = DrawnMetres(0.3);
        let along = self.state.along;
        let [here, there] = [along, along + DrawnMetres(1.0)]
            .map(|along| self.place(along - AROUND).direction_rad(&self.place(along + AROUND)));
        match wrap_angle(there - here).to_degrees() {
            turn if turn > 20.0 => Command::Left,
            turn if turn < -20.0 => Command::Right,
            _ => Command::Forward,
        }
    }

    /// Takes a step. Returns the command for the robot, and the outcome if the drive ends in this step.
    pub fn step(&mut self, guided: &Guided<'_>) -> (Drive, Option<Outcome>) {
        let Guided { estimate, sectors, moved_m, turned_rad, sure } = guided;
        self.state.trail.moved(*moved_m, *turned_rad);
        if self.state.outcome.is_some() {
            return (Drive::default(), None);
        }
        if self.state.trail.is_going_back() {
            return self.drive_back(sectors);
        }
        self.state.gone = self.state.gone + estimate.stretch.drawn(moved_m.abs());
        self.advance(estimate.at, estimate.stretch.drawn(*moved_m));
        self.state.trail.drop_crumb(self.state.along, *sure > self.state.sure);
        self.state.sure = *sure;
        match self.outcome(estimate, sectors) {
            None => (self.drive(estimate, sectors), None),
            Some(outcome) if outcome != Outcome::Arrived && self.turn_back() => {
                self.state.why = Some(outcome);
                (Drive::default(), None)
            }
            ended => {
                self.state.outcome = ended;
                (Drive::default(), ended)
            }
        }
    }

    /// Begins the way back. Returns false if the robot has used up its returns, or has no place to drive back to.
    pub fn turn_back(&mut self) -> bool {
        let before = self.state.returns;
        let turns_back = before < self.settings.returns && self.state.trail.turn_back(before);
        self.state.returns += u32::from(turns_back);
        turns_back
    }

    /// Drives back by odometry to a place where the robot was sure.
    fn drive_back(&mut self, sectors: &Sectors) -> (Drive, Option<Outcome>) {
        match self.state.trail.step() {
            Some(Step::Towards(off)) => (self.towards(off, sectors), None),
            Some(Step::Turn(off)) => (Drive { speed_mps: 0.0, yaw_rate_radps: self.turn(off) }, None),
            Some(Step::There(along)) => {
                (self.state.along, self.state.gone) = (along, along);
                (Drive::default(), None)
            }
            Some(Step::Failed) | None => {
                self.state.outcome = self.state.why.or(Some(Outcome::Lost));
                (Drive::default(), self.state.outcome)
            }
        }
    }

    /// Returns the point at a distance along the route. Beyond its end, the route is extended in a straight line.
    fn place(&self, along: DrawnMetres) -> Point<Drawn> {
        let i = self.lengths.partition_point(|length| *length <= along).clamp(1, self.route.len() - 1);
        let part = (along - self.lengths[i - 1]).0 / (self.lengths[i] - self.lengths[i - 1]).0;
        self.route[i - 1].towards(&self.route[i], part)
    }

    /// Moves the position along the route to the point nearest to the estimate, within the distance that the robot may have
    /// covered.
    fn advance(&mut self, at: Point<Drawn>, moved: DrawnMetres) {
        const BACK: DrawnMetres = DrawnMetres(0.1);
        const AROUND: DrawnMetres = DrawnMetres(0.3);
        const FAR: DrawnMetres = DrawnMetres(1.0);
        let begin = self.state.along;
        let moved = moved.max(DrawnMetres::default());
        let far = FAR + moved + AROUND;
        let candidates = (0..=40).map(|i| begin - AROUND + far * (f64::from(i) / 40.0));
        let candidates = candidates.filter(|along| *along >= DrawnMetres::default());
        let distance = |along: DrawnMetres| self.place(along).distance(&at);
        let nearest = candidates.map(|along| (distance(along), along)).min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, along)) = nearest {
            self.state.along = along.clamp(begin - BACK, begin + AROUND + moved);
        }
    }

    fn outcome(&self, estimate: &Estimate, sectors: &Sectors) -> Option<Outcome> {
        let left = self.length() - self.state.along;
        let settings = &self.settings;
        if left < settings.goal_m && control::front_m(sectors) < settings.control.stop_m {
            return Some(Outcome::Arrived);
        }
        let is_beyond = left + settings.beyond_m < DrawnMetres::default();
        let is_far = self.state.gone > self.length() * settings.most_way + settings.beyond_m;
        if estimate.fit < settings.least_fit {
            return Some(Outcome::Lost);
        }
        (is_beyond || is_far).then_some(Outcome::NoGoal)
    }

    /// Computes the command by pure pursuit.
    fn drive(&self, estimate: &Estimate, sectors: &Sectors) -> Drive {
        let aim = self.place(self.state.along + estimate.stretch.drawn(self.settings.ahead_m));
        let off = wrap_angle(estimate.at.direction_rad(&aim) - estimate.heading_rad);
        self.towards(off, sectors)
    }

    /// Drives in a direction, given in radians from the heading, fused with the output of the reactive controller. On the way back,
    /// the robot first turns on the spot if the direction is behind it.
    fn towards(&self, off: f64, sectors: &Sectors) -> Drive {
        const BEHIND_RAD: f64 = 2.0;
        let settings = &self.settings;
        if off.abs() > BEHIND_RAD && self.state.trail.is_going_back() {
            return Drive { speed_mps: 0.0, yaw_rate_radps: self.turn(off) };
        }
        let avoid = control::avoidance(sectors, &settings.control);
        let away = -avoid.direction_rad * avoid.strength * settings.control.range_m
            / INCH_M
            / settings.control.normalization
            * settings.avoid;
        let front = control::front_m(sectors);
        let is_close = front < settings.control.close_m;
        let speed = if is_close { settings.control.slow_mps } else { settings.control.speed_mps };
        Drive { speed_mps: speed * off.cos().max(0.2), yaw_rate_radps: self.turn(off) + away }
    }

    /// Returns the turn rate towards a direction.
    fn turn(&self, off: f64) -> f64 {
        let most = self.settings.turn_dps.to_radians();
        (1.2 * off).clamp(-most, most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn::Stretch;
    use crate::reckoning::Reckoning;
    use crate::sketch::Landmark;

    /// A robot that stands in front of nothing, in a drawing whose objects are where they were drawn.
    const STANDING: Guided<'_> = Guided {
        estimate: Estimate {
            at: Point::new(0.0, 0.0),
            heading_rad: 0.0,
            stretch: Stretch::NONE,
            spread: DrawnMetres(0.1),
            fit: 0.8,
        },
        sectors: &[f64::INFINITY; 16],
        moved_m: 0.0,
        turned_rad: 0.0,
        sure: 0,
    };

    fn at(x: f64, y: f64) -> Point<Drawn> {
        Point::new(x, y)
    }

    /// Returns a sketch with a route of 4 m to a wall.
    fn sketch() -> Sketch {
        let outline = vec![at(5.0, -2.0), at(5.5, -2.0), at(5.5, 2.0), at(5.0, 2.0)];
        let landmarks = vec![Landmark { name: "wall".into(), outline }];
        Sketch {
            landmarks,
            route: plane::resample(&[at(0.0, 0.0), at(4.0, 0.0)], 0.5),
            metres_per_pixel: 0.1,
        }
    }

    /// Returns an estimate without spread at the given position, facing along x, in a drawing to scale.
    fn sure(at: Point<Drawn>) -> Estimate {
        Estimate { at, ..STANDING.estimate }
    }

    /// A robot whose estimate is exact.
    struct Robot {
        guide: Guide,
        at: Point<Drawn>,
    }

    fn start() -> Robot {
        Robot { guide: Guide::new(&sketch(), Guiding::default()).unwrap(), at: at(0.2, 0.0) }
    }

    impl Robot {
        /// Moves the robot by 0.1 m, with a wall straight ahead at the distance `left_m`.
        fn step(&mut self, left_m: f64) -> (Drive, Option<Outcome>) {
            let mut sectors = [f64::INFINITY; 16];
            for x in [15, 0, 1] {
                sectors[x] = left_m / (x as f64 * std::f64::consts::FRAC_PI_8).cos();
            }
            self.at.x += 0.1;
            self.guide.step(&Guided { estimate: sure(self.at), sectors: &sectors, moved_m: 0.1, ..STANDING })
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
        let estimate = Estimate { fit: 0.1, ..sure(at(1.0, 0.0)) };
        let sectors = [f64::INFINITY; 16];
        assert_eq!(
            guide.step(&Guided { estimate, sectors: &sectors, moved_m: 0.1, ..STANDING }).1,
            Some(Outcome::Lost)
        );
    }

    /// From 2.5 m on, nothing fits, however often the robot gets there. It was sure at the start and at 1 m.
    #[test]
    fn a_lost_robot_goes_back_twice_before_it_gives_up() {
        let mut guide = start().guide;
        let (mut robot, mut command, mut back_at) = (Reckoning::default(), Drive::default(), Vec::new());
        let ended = (0..3000).find_map(|_| {
            let [moved_m, turned_rad] = [command.speed_mps, command.yaw_rate_radps].map(|rate| 0.1 * rate);
            robot.moved(moved_m, turned_rad);
            let place = at(robot.at.x, robot.at.y);
            let fit = if place.x < 2.5 { 0.8 } else { 0.1 };
            let estimate = Estimate { heading_rad: wrap_angle(robot.heading_rad), fit, ..sure(place) };
            let places = if robot.gone_m > 1.0 { 2 } else { 1 };
            let was_going_back = guide.is_going_back();
            let guided = Guided { estimate, moved_m, turned_rad, sure: places, ..STANDING };
            let (drive, outcome) = guide.step(&guided);
            command = drive;
            if was_going_back && !guide.is_going_back() {
                back_at.push(place.x);
            }
            outcome
        });
        assert_eq!(ended, Some(Outcome::Lost));
        assert_eq!(back_at.len(), 2, "{back_at:?}");
        assert!((back_at[0] - 1.0).abs() < 0.35 && back_at[1].abs() < 0.35, "{back_at:?}");
    }

    #[test]
    fn a_robot_that_was_lost_looks_again() {
        let mut guide = start().guide;
        let estimate = |fit| Estimate { fit, ..sure(at(1.0, 0.0)) };
        let sectors = [f64::INFINITY; 16];
        let step = |guide: &mut Guide, fit| {
            guide.step(&Guided { estimate: estimate(fit), sectors: &sectors, moved_m: 0.1, ..STANDING })
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
        robot.guide.restore(State {
            outcome: Some(Outcome::Lost),
            gone: DrawnMetres(30.0),
            ..State::default()
        });
        robot.guide.told(at(3.1, 0.4));
        assert!((robot.guide.along().0 - 3.1).abs() < 1e-9, "{:?}", robot.guide.along());
        robot.at = at(3.1, 0.4);
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

    /// Regression test: when a robot was pushed back by half a metre between two readings, the bounds of its position along the
    /// route were swapped, and the planner panicked.
    #[test]
    fn a_robot_that_was_pushed_back_drives_on() {
        let mut robot = start();
        for _ in 0..20 {
            robot.step(4.0);
        }
        let before = robot.guide.along();
        let estimate = sure(at(1.2, 0.0));
        let sectors = [f64::INFINITY; 16];
        let (drive, outcome) =
            robot.guide.step(&Guided { estimate, sectors: &sectors, moved_m: -1.0, ..STANDING });
        assert!(outcome.is_none() && drive.speed_mps > 0.0, "{drive:?}");
        let along = robot.guide.along();
        assert!((before - DrawnMetres(0.1)..=before).contains(&along), "{along:?}");
    }

    /// Regression test: the look-ahead, a driven distance, was added to a drawn distance without conversion. In a sketch at half
    /// the scale, the robot looked twice as far ahead and cut its corners.
    #[test]
    fn a_robot_looks_equally_far_ahead_at_any_scale_of_the_drawing() {
        let turn = |stretch: f64| {
            // The corner is 1 m ahead, in driven metres.
            let corner = at(1.0 / stretch, 0.0);
            let bend = [at(0.0, 0.0), corner, at(corner.x, 4.0 / stretch)];
            let sketch = Sketch { route: plane::resample(&bend, 0.25 / stretch), ..sketch() };
            let settings = Guiding { ahead_m: 2.0, turn_dps: 90.0, ..Guiding::default() };
            let mut guide = Guide::new(&sketch, settings).unwrap();
            let estimate = Estimate { stretch: Stretch(stretch), ..sure(at(0.0, 0.0)) };
            guide.step(&Guided { estimate, sectors: &[f64::INFINITY; 16], ..STANDING }).0.yaw_rate_radps
        };
        // Of the 2 m of look-ahead, 1 m leads straight ahead and 1 m to the left, which makes 45°. The position along the route is
        // accurate to a few centimetres.
        for stretch in [0.5, 0.8, 1.0, 1.6, 2.0] {
            let off = turn(stretch) / 1.2;
            assert!((off - std::f64::consts::FRAC_PI_4).abs() < 0.04, "{stretch}: {off}");
        }
    }

    #[test]
    fn the_command_is_what_the_route_does() {
        let bend = [at(0.0, 0.0), at(3.0, 0.0), at(3.0, 3.0)];
        let sketch = Sketch { route: plane::resample(&bend, 0.25), ..sketch() };
        let mut guide = Guide::new(&sketch, Guiding::default()).unwrap();
        assert_eq!(guide.command(), Command::Forward);
        guide.restore(State { along: DrawnMetres(2.5), ..State::default() });
        assert_eq!(guide.command(), Command::Left);
    }
}

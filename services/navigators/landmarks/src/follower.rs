//! The path controller (Chronis 2007, 4.1, 4.6 to 4.8), which follows a route by matching its states one
//! after another.
//!
//! - Rule 1: the first state is not matched. Its command is carried out at once.
//! - Rule 2: the last state is not matched. Once all others are, the robot stops as soon as an object in front is nearer than
//!   30 inches.
//! - After it has begun a turn, the robot turns by 30° before it matches the next state. After a command to move forward, it first
//!   drives 2 feet (five of the thesis's cycles).
//! - If the next state is not matched within twice the expected time, the robot is lost and stops.
//!
//! A step does not allocate. All state is kept in [`Progress`].

use serde::{Deserialize, Serialize};

use crate::control::{self, Behaviour, Controlling, Drive, Sectors};
use crate::error::Error;
use crate::lost::{Leg, Patience, Waiting};
use crate::matching::{Features, RecentMatches};
use crate::numbers;
use crate::perception::Seen;
use crate::route::{Command, INCH_M, Route, State};

/// Parameters for following a route.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Following {
    /// Features that are used for matching.
    pub features: Features,
    /// Parameters of the controllers.
    pub control: Controlling,
    /// Time to wait for a state before the robot counts as lost.
    pub patience: Patience,
    /// Rate at which states are matched, and the minimum motion between two matches.
    pub rhythm: Rhythm,
}

impl Following {
    /// Checks that all numbers are within their ranges.
    ///
    /// # Errors
    /// [`Error::Number`], which names the first number that is out of range.
    pub fn check(&self) -> Result<(), Error> {
        // Features are switches, so any value is valid.
        let Self { features: _, control, patience, rhythm } = self;
        numbers::within("control", control.check())?;
        numbers::within("patience", patience.check())?;
        numbers::within("rhythm", rhythm.check())
    }
}

impl Following {
    /// Returns the leg that leads to state `to`.
    fn leg(&self, states: &[State], to: usize) -> Leg {
        let Self { control, rhythm, .. } = self;
        let least_s = if states[to - 1].command.is_turn() {
            rhythm.least_turn_deg / control.turn_rate_dps
        } else {
            rhythm.least_way_m / control.speed_mps
        };
        Leg { length: states[to].after, speed_mps: control.speed_mps, least_s }
    }
}

/// Rate at which states are matched, and the minimum motion between two matches.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Rhythm {
    /// Duration of a cycle of sensing and matching, in seconds. Five cycles are "roughly 2 feet" at 25 inches per second.
    pub cycle_s: f64,
    /// Minimum turn between two matches, in degrees.
    pub least_turn_deg: f64,
    /// Minimum distance forward between two matches, in metres.
    pub least_way_m: f64,
}

impl Default for Rhythm {
    fn default() -> Self {
        Self { cycle_s: 0.192, least_turn_deg: 30.0, least_way_m: 24.0 * INCH_M }
    }
}

impl Rhythm {
    /// Checks that all numbers are within their ranges.
    ///
    /// # Errors
    /// [`Error::Number`], which names the first number that is out of range.
    pub fn check(&self) -> Result<(), Error> {
        let Self { cycle_s, least_turn_deg, least_way_m } = *self;
        let numbers =
            [("cycle_s", cycle_s), ("least_turn_deg", least_turn_deg), ("least_way_m", least_way_m)];
        numbers::from_0_on(&numbers)
    }
}

/// Input of a step.
#[derive(Debug, Clone, Copy)]
pub struct Viewed<'a> {
    /// Objects that the robot sees: see [`crate::perception`].
    pub seen: &'a [Seen],
    /// Nearest ranges in sixteen directions.
    pub sectors: &'a Sectors,
    /// Time since the last step, in seconds.
    pub time_s: f64,
    /// Distance moved since the last step, by odometry, in metres.
    pub moved_m: f64,
    /// Angle turned since the last step, by odometry, in radians, positive to the left.
    pub turned_rad: f64,
}

/// Events during a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Event {
    /// The state with this number, from 0, was matched.
    Matched(usize),
    /// The robot stopped at its goal.
    Arrived,
    /// The state with this number, from 0, was not matched in time.
    Lost(usize),
}

/// Position of the robot along its route.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// Number of the state that the robot is waiting for.
    next: usize,
    recent: RecentMatches,
    behaviour: Behaviour,
    waiting: Waiting,
    /// Angle turned and distance moved since the last match.
    turned_rad: f64,
    moved_m: f64,
    /// Time since the last cycle, in seconds.
    cycle_s: f64,
    ended: Option<Event>,
}

impl Default for Progress {
    fn default() -> Self {
        Self {
            next: 1,
            recent: RecentMatches::default(),
            behaviour: Behaviour::default(),
            waiting: Waiting::default(),
            turned_rad: 0.0,
            moved_m: 0.0,
            cycle_s: 0.0,
            ended: None,
        }
    }
}

/// Makes a robot follow a route.
#[derive(Debug, Clone)]
pub struct Follower {
    route: Route,
    settings: Following,
    progress: Progress,
}

impl Follower {
    /// Creates a follower at the start of a route.
    ///
    /// # Errors
    /// [`Error::States`] if the route cannot be driven.
    pub fn new(route: Route, settings: Following) -> Result<Self, Error> {
        route.check()?;
        Ok(Self { route, settings, progress: Progress::default() })
    }

    /// Returns the progress along the route, which is the entire state of a follower.
    pub const fn progress(&self) -> &Progress {
        &self.progress
    }

    /// Resumes from stored progress along the route.
    ///
    /// # Errors
    /// [`Error::States`] if the progress refers to a state that the route does not have.
    pub fn restore(&mut self, progress: Progress) -> Result<(), Error> {
        if !(1..self.route.states.len()).contains(&progress.next) {
            let found = format!("state {}", progress.next);
            return Err(Error::States { expected: "a state after the start", found });
        }
        self.progress = progress;
        Ok(())
    }

    /// Returns the route.
    pub const fn route(&self) -> &Route {
        &self.route
    }

    /// Returns the features that are used for matching.
    pub const fn features(&self) -> Features {
        self.settings.features
    }

    /// Returns the number of the state that the robot is waiting for.
    pub const fn next(&self) -> usize {
        self.progress.next
    }

    /// Returns the command that is being carried out.
    pub fn command(&self) -> Command {
        if self.progress.ended.is_some() {
            Command::Stop
        } else {
            self.route.states[self.progress.next - 1].command
        }
    }

    /// Returns true if the robot is lost.
    pub const fn is_lost(&self) -> bool {
        matches!(self.progress.ended, Some(Event::Lost(_)))
    }

    /// Resumes from a state that has just been matched because a person took the robot there (4.8).
    ///
    /// # Errors
    /// [`Error::States`] if the route has no such state before its end.
    pub fn resume_at(&mut self, state: usize) -> Result<(), Error> {
        self.restore(Progress { next: state + 1, ..Progress::default() })
    }

    /// Takes a step. Returns the command for the robot, and the event of this step, if any.
    pub fn step(&mut self, viewed: &Viewed<'_>) -> (Drive, Option<Event>) {
        let Self { route, settings, progress } = self;
        if progress.ended.is_some() {
            return (Drive::default(), None);
        }
        let Viewed { seen, sectors, time_s, moved_m, turned_rad } = *viewed;
        progress.turned_rad += turned_rad;
        progress.moved_m += moved_m;
        progress.cycle_s += time_s;
        let is_last = progress.next + 1 == route.states.len();
        let event = if is_last {
            (control::front_m(sectors) < settings.control.stop_m).then_some(Event::Arrived)
        } else if progress.cycle_s + 1e-9 >= settings.rhythm.cycle_s {
            progress.cycle_s = 0.0;
            progress.advance(&route.states, seen, settings)
        } else {
            None
        };
        let leg = settings.leg(&route.states, progress.next);
        let is_late = progress.waiting.pass(time_s, &leg, &settings.patience);
        let event = event.or_else(|| is_late.then_some(Event::Lost(progress.next)));
        progress.ended = event.filter(|event| !matches!(event, Event::Matched(_)));
        let command =
            if progress.ended.is_some() { Command::Stop } else { route.states[progress.next - 1].command };
        (progress.behaviour.fuse(command, sectors, &settings.control), event)
    }
}

impl Progress {
    /// Runs a cycle of matching.
    fn advance(&mut self, states: &[State], seen: &[Seen], settings: &Following) -> Option<Event> {
        let state = &states[self.next];
        let is_met = self.recent.matches(state, seen, settings.features);
        let has_moved = if states[self.next - 1].command.is_turn() {
            self.turned_rad.abs() >= settings.rhythm.least_turn_deg.to_radians()
        } else {
            self.moved_m >= settings.rhythm.least_way_m
        };
        if !is_met || !has_moved {
            return None;
        }
        let matched = self.next;
        self.waiting.matched(&settings.leg(states, matched), &settings.patience);
        self.next += 1;
        (self.turned_rad, self.moved_m, self.recent) = (0.0, 0.0, RecentMatches::default());
        Some(Event::Matched(matched))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language;
    use crate::perception::{Perceiving, Perception};

    const CYCLE: f64 = 0.192;

    fn follower(text: &str) -> Follower {
        Follower::new(language::read(text).unwrap(), Following::default()).unwrap()
    }

    fn step(
        follower: &mut Follower,
        ranges: &[f64; 16],
        time_s: f64,
        motion: [f64; 2],
    ) -> (Drive, Option<Event>) {
        let mut perception = Perception::nomad(Perceiving::default()).unwrap();
        let seen = perception.see(ranges).unwrap();
        let [moved_m, turned_rad] = motion;
        follower.step(&Viewed { seen, sectors: ranges, time_s, moved_m, turned_rad })
    }

    /// Runs a cycle with objects at the given directions and distances in inches. The robot turns by `degrees` and moves 5 inches.
    fn cycle(follower: &mut Follower, inches: &[(usize, f64)], degrees: f64) -> (Drive, Option<Event>) {
        let mut ranges = [f64::INFINITY; 16];
        for (beam, range) in inches {
            ranges[*beam] = range * INCH_M;
        }
        let turned_rad = degrees.to_radians();
        step(follower, &ranges, CYCLE, [5.0 * INCH_M, turned_rad])
    }

    #[test]
    fn the_first_command_is_carried_out_at_once() {
        // Rule 1: the robot carries out the command although it sees nothing of the first state.
        let mut follower =
            follower("At the start, when a desk is behind, then turn left. When a box is ahead, then stop.");
        let (drive, event) = cycle(&mut follower, &[], 0.0);
        assert_eq!((drive.yaw_rate_radps.to_degrees().round(), event), (10.0, None));
    }

    #[test]
    fn the_last_state_is_an_object_close_in_front() {
        // Rule 2: 30 inches in front of any of the five front sensors, wherever the objects of the last state are.
        let mut follower =
            follower("When a box is left, then turn right. At the end, when a desk is behind, then stop.");
        for _ in 0..5 {
            cycle(&mut follower, &[(4, 60.0)], 0.0);
        }
        assert_eq!(follower.next(), 2);
        assert_eq!(cycle(&mut follower, &[(14, 31.0)], 0.0).1, None);
        assert_eq!(cycle(&mut follower, &[(3, 20.0)], 0.0).1, None);
        let (drive, event) = cycle(&mut follower, &[(14, 29.0)], 0.0);
        assert_eq!((drive, event), (Drive::default(), Some(Event::Arrived)));
        assert_eq!(cycle(&mut follower, &[], 0.0), (Drive::default(), None));
        assert_eq!(follower.command(), Command::Stop);
    }

    #[test]
    fn the_robot_goes_two_feet_or_turns_by_30_degrees_before_it_matches_again() {
        let mut follower =
            follower("When a box is left, then turn right. When a box is left, then move forward.");
        let matched: Vec<_> = (0..12).map(|_| cycle(&mut follower, &[(4, 60.0)], -4.0).1).collect();
        // Five cycles of 5 inches, then eight of 4°.
        let expected = |i: usize| match i {
            4 => Some(Event::Matched(1)),
            _ => None,
        };
        assert_eq!(matched, (0..12).map(expected).collect::<Vec<_>>());
        assert_eq!(cycle(&mut follower, &[(4, 60.0)], -4.0).1, Some(Event::Matched(2)));
    }

    #[test]
    fn the_robot_is_lost_where_a_state_does_not_come_in_twice_the_time() {
        // At 25 inches per second, 2.54 m take 4 s. Twice that time is 41 cycles and two thirds.
        let mut follower = follower("After 2.54 m, when a box is left, then turn right.");
        for i in 1..=41 {
            assert_eq!(cycle(&mut follower, &[], 0.0).1, None, "{i}");
        }
        assert_eq!(cycle(&mut follower, &[], 0.0), (Drive::default(), Some(Event::Lost(1))));
        // A person leads the robot to the state that it missed, and it continues with the command of that state.
        follower.resume_at(1).unwrap();
        assert!(cycle(&mut follower, &[], 0.0).0.yaw_rate_radps < 0.0);
        assert!(follower.resume_at(2).is_err());
    }

    #[test]
    fn matching_has_its_own_rhythm() {
        let mut follower = follower("When a box is left, then turn right.");
        let mut ranges = [f64::INFINITY; 16];
        ranges[4] = 1.5;
        let mut matched = Vec::new();
        for i in 0..40 {
            if step(&mut follower, &ranges, CYCLE / 4.0, [1.25 * INCH_M, 0.0]).1.is_some() {
                matched.push(i);
            }
        }
        // Twenty steps of a quarter of 5 inches are 25 inches.
        assert_eq!(matched, [19]);
    }

    #[test]
    fn a_follower_goes_on_from_what_it_remembers() {
        let text = "When a box is left and a desk is right, then turn right. When a box is ahead, then move forward.";
        let run = |restore_at: Option<usize>| {
            let mut follower = follower(text);
            let mut found = Vec::new();
            for i in 0..40 {
                if restore_at == Some(i) {
                    let progress = *follower.progress();
                    follower = self::follower(text);
                    follower.restore(progress).unwrap();
                }
                let beams = [(4, 60.0), (12, 50.0), (0, 90.0)];
                found.push(cycle(&mut follower, &beams[i % 3..], -1.5));
            }
            found
        };
        let whole = run(None);
        assert!(whole.iter().filter(|(_, event)| event.is_some()).count() >= 2);
        for i in [1, 5, 9, 30] {
            assert_eq!(run(Some(i)), whole);
        }
    }
}

//! The path controller (Chronis 2007, 4.1, 4.6 to 4.8): follows a route by matching its states one after the other.
//!
//! - Rule 1: the first state is not matched; its command is carried out at once.
//! - Rule 2: the last state is not matched; once all others are, the robot stops where an object is nearer than 30 inches
//!   in front.
//! - After a turn begins, the robot turns by 30° before it matches again. After it moves forward, it goes 2 feet (five
//!   of the text's cycles).
//! - Where the next state does not come in twice the expected time, the robot is lost and stops.
//!
//! A step allocates nothing. What it remembers is [`Progress`].

use serde::{Deserialize, Serialize};

use crate::control::{self, Behaviour, Controlling, Drive, Sectors};
use crate::error::Error;
use crate::lost::{Leg, Patience, Waiting};
use crate::matching::{Features, RecentMatches};
use crate::numbers;
use crate::perception::Seen;
use crate::route::{Command, INCH_M, Route, State};

/// How a route is followed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Following {
    /// Which features count in matching.
    pub features: Features,
    /// How the robot is controlled.
    pub control: Controlling,
    /// When it is lost.
    pub patience: Patience,
    /// How often and how soon states are matched.
    pub rhythm: Rhythm,
}

impl Following {
    /// `Ok` where all numbers are in their ranges.
    ///
    /// # Errors
    /// [`Error::Number`] with the key.
    pub fn check(&self) -> Result<(), Error> {
        // Features are switches.
        let Self { features: _, control, patience, rhythm } = self;
        numbers::within("control", control.check())?;
        numbers::within("patience", patience.check())?;
        numbers::within("rhythm", rhythm.check())
    }
}

impl Following {
    /// The way to a state.
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

/// How often and how soon states are matched.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Rhythm {
    /// The length of a cycle of sensing and matching, in seconds. Five cycles are "roughly 2 feet" at 25 inches a second.
    pub cycle_s: f64,
    /// The least turn between matches, in degrees.
    pub least_turn_deg: f64,
    /// The least way forward between matches, in metres.
    pub least_way_m: f64,
}

impl Default for Rhythm {
    fn default() -> Self {
        Self { cycle_s: 0.192, least_turn_deg: 30.0, least_way_m: 24.0 * INCH_M }
    }
}

impl Rhythm {
    /// `Ok` where all numbers are in their ranges.
    ///
    /// # Errors
    /// [`Error::Number`] with the key.
    pub fn check(&self) -> Result<(), Error> {
        let Self { cycle_s, least_turn_deg, least_way_m } = *self;
        let numbers =
            [("cycle_s", cycle_s), ("least_turn_deg", least_turn_deg), ("least_way_m", least_way_m)];
        numbers::from_0_on(&numbers)
    }
}

/// What the robot knows in a step.
#[derive(Debug, Clone, Copy)]
pub struct Viewed<'a> {
    /// The objects that it sees: [`crate::perception`].
    pub seen: &'a [Seen],
    /// The nearest ranges in sixteen directions.
    pub sectors: &'a Sectors,
    /// The time since the last step, in seconds.
    pub time_s: f64,
    /// The way since the last step by odometry, in metres.
    pub moved_m: f64,
    /// The turn since the last step by odometry, in radians, left positive.
    pub turned_rad: f64,
}

/// What happened in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Event {
    /// The state with this number, from 0, was matched.
    Matched(usize),
    /// The robot stopped at its goal.
    Arrived,
    /// The state with this number did not come.
    Lost(usize),
}

/// Where the robot is along its route.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// The number of the state that the robot waits for.
    next: usize,
    recent: RecentMatches,
    behaviour: Behaviour,
    waiting: Waiting,
    /// Turn and way since the last match.
    turned_rad: f64,
    moved_m: f64,
    /// The time since the last cycle.
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

/// Follows a route.
#[derive(Debug, Clone)]
pub struct Follower {
    route: Route,
    settings: Following,
    progress: Progress,
}

impl Follower {
    /// At the start of a route.
    ///
    /// # Errors
    /// [`Error::States`] where the route cannot be driven.
    pub fn new(route: Route, settings: Following) -> Result<Self, Error> {
        route.check()?;
        Ok(Self { route, settings, progress: Progress::default() })
    }

    /// Where it is along the route: all that it remembers.
    pub const fn progress(&self) -> &Progress {
        &self.progress
    }

    /// Goes on from there.
    ///
    /// # Errors
    /// [`Error::States`] where it waits for a state that the route has not.
    pub fn restore(&mut self, progress: Progress) -> Result<(), Error> {
        if !(1..self.route.states.len()).contains(&progress.next) {
            let found = format!("state {}", progress.next);
            return Err(Error::States { expected: "a state after the start", found });
        }
        self.progress = progress;
        Ok(())
    }

    /// The route.
    pub const fn route(&self) -> &Route {
        &self.route
    }

    /// Which features count in matching.
    pub const fn features(&self) -> Features {
        self.settings.features
    }

    /// The number of the state that the robot waits for.
    pub const fn next(&self) -> usize {
        self.progress.next
    }

    /// The command that is carried out.
    pub fn command(&self) -> Command {
        if self.progress.ended.is_some() {
            Command::Stop
        } else {
            self.route.states[self.progress.next - 1].command
        }
    }

    /// Whether it is lost.
    pub const fn is_lost(&self) -> bool {
        matches!(self.progress.ended, Some(Event::Lost(_)))
    }

    /// A person led the robot to where this state has just been matched; it goes on from there (4.8).
    ///
    /// # Errors
    /// [`Error::States`] where the route has no such state before its end.
    pub fn resume_at(&mut self, state: usize) -> Result<(), Error> {
        self.restore(Progress { next: state + 1, ..Progress::default() })
    }

    /// A step: what the robot is to do, and what happened.
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
    /// A cycle of matching.
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

    /// A cycle with objects in these directions, in inches; the robot turns by so many degrees and goes 5 inches.
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
        // Rule 1: nothing of the first state is in view.
        let mut follower =
            follower("At the start, when a desk is behind, then turn left. When a box is ahead, then stop.");
        let (drive, event) = cycle(&mut follower, &[], 0.0);
        assert_eq!((drive.yaw_rate_radps.to_degrees().round(), event), (10.0, None));
    }

    #[test]
    fn the_last_state_is_an_object_close_in_front() {
        // Rule 2: 30 inches, in front of any of the five front sensors, wherever the last state has its objects.
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
        // Five cycles of 5 inches; then eight of 4°.
        let expected = |i: usize| match i {
            4 => Some(Event::Matched(1)),
            _ => None,
        };
        assert_eq!(matched, (0..12).map(expected).collect::<Vec<_>>());
        assert_eq!(cycle(&mut follower, &[(4, 60.0)], -4.0).1, Some(Event::Matched(2)));
    }

    #[test]
    fn the_robot_is_lost_where_a_state_does_not_come_in_twice_the_time() {
        // 2.54 m at 25 inches a second are 4 s: 8 s are 41 cycles and two thirds.
        let mut follower = follower("After 2.54 m, when a box is left, then turn right.");
        for i in 1..=41 {
            assert_eq!(cycle(&mut follower, &[], 0.0).1, None, "{i}");
        }
        assert_eq!(cycle(&mut follower, &[], 0.0), (Drive::default(), Some(Event::Lost(1))));
        // A person leads it to the state that it missed; it goes on with the command of that state.
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

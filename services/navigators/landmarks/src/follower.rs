//! The path controller (Chronis 2007, 4.1, 4.6 to 4.8): follows a route by matching its states one after the other.
//!
//! - Rule 1: the first state is not matched; its command is carried out at once.
//! - Rule 2: the last state is not matched; once all others are, the robot stops where an object is nearer than 30 inches
//!   in front.
//! - After a turn begins, the robot turns by 30° before it matches again; after it moves forward, it goes 2 feet (five of
//!   the text's cycles).
//! - Where the next state does not come in twice the expected time, the robot is lost and stops.
//!
//! A step allocates nothing. What it remembers is [`Progress`].

use serde::{Deserialize, Serialize};

use crate::control::{self, Behaviour, Controlling, Drive};
use crate::error::Error;
use crate::lost::{Patience, Waiting};
use crate::matching::{Features, Memory};
use crate::perception::{Perception, Seen};
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

/// What the robot measured since the last step.
#[derive(Debug, Clone, Copy)]
pub struct Sensed<'a> {
    /// The ranges of the ring, in metres.
    pub ranges_m: &'a [f64],
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
    memory: Memory,
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
            memory: Memory::default(),
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
    perception: Perception,
    settings: Following,
    progress: Progress,
}

impl Follower {
    /// At the start of a route.
    ///
    /// # Errors
    /// [`Error::States`] where the route cannot be driven.
    pub fn new(route: Route, perception: Perception, settings: Following) -> Result<Self, Error> {
        route.check()?;
        Ok(Self { route, perception, settings, progress: Progress::default() })
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

    /// A person led the robot to where this state has just been matched; it goes on from there (4.8).
    ///
    /// # Errors
    /// [`Error::States`] where the route has no such state before its end.
    pub fn resume_at(&mut self, state: usize) -> Result<(), Error> {
        self.restore(Progress { next: state + 1, ..Progress::default() })
    }

    /// A step: what the robot is to do, and what happened.
    ///
    /// # Errors
    /// [`Error::Sensor`] where the number of ranges is not that of the beams.
    pub fn step(&mut self, sensed: &Sensed<'_>) -> Result<(Drive, Option<Event>), Error> {
        let Self { route, perception, settings, progress } = self;
        if progress.ended.is_some() {
            return Ok((Drive::default(), None));
        }
        progress.turned_rad += sensed.turned_rad;
        progress.moved_m += sensed.moved_m;
        progress.cycle_s += sensed.time_s;
        let range_max_m = perception.settings().range_max_m;
        let sectors = control::sectors(perception.angles_rad(), sensed.ranges_m, range_max_m);
        let is_last = progress.next + 1 == route.states.len();
        let event = if is_last {
            (control::front_m(&sectors) < settings.control.stop_m).then_some(Event::Arrived)
        } else if progress.cycle_s + 1e-9 >= settings.rhythm.cycle_s {
            progress.cycle_s = 0.0;
            progress.advance(&route.states, perception.see(sensed.ranges_m)?, settings)
        } else {
            None
        };
        let leg_m = route.states[progress.next].after_m;
        let is_late =
            progress.waiting.pass(sensed.time_s, leg_m, settings.control.speed_mps, &settings.patience);
        let event = event.or_else(|| is_late.then_some(Event::Lost(progress.next)));
        progress.ended = event.filter(|event| !matches!(event, Event::Matched(_)));
        let command =
            if progress.ended.is_some() { Command::Stop } else { route.states[progress.next - 1].command };
        Ok((progress.behaviour.fuse(command, &sectors, &settings.control), event))
    }
}

impl Progress {
    /// A cycle of matching.
    fn advance(&mut self, states: &[State], seen: &[Seen], settings: &Following) -> Option<Event> {
        let state = &states[self.next];
        let is_met = self.memory.matches(state, seen, settings.features);
        let has_moved = if states[self.next - 1].command.is_turn() {
            self.turned_rad.abs() >= settings.rhythm.least_turn_deg.to_radians()
        } else {
            self.moved_m >= settings.rhythm.least_way_m
        };
        if !is_met || !has_moved {
            return None;
        }
        let matched = self.next;
        self.waiting.matched(state.after_m, settings.control.speed_mps, &settings.patience);
        self.next += 1;
        (self.turned_rad, self.moved_m, self.memory) = (0.0, 0.0, Memory::default());
        Some(Event::Matched(matched))
    }
}

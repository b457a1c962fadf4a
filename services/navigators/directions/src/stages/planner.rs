//! The navigator as a stage, which follows its guide and sees only the localizer's descriptions.
//!
//! The guide is a custom map or a chart of landmarks ([`super::belief`]), which the planner receives in an instruction
//! ([`Instructed`]).
//!
//! The planner responds to each description with one command and one status. If a view is repeated, the
//! navigator continues as before. At the goal, it moves its window over the landmark so that the next task
//! begins there.

use crate::messages::Activity as Code;
use crate::messages::{DESCRIPTION, DIRECTIONS, DescribedDot, Description, JOURNEY, Journey};
use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};
use sketchnav_motion::agenda::{Agenda, Due, Motion, Phase, Standing};
use sketchnav_schemas::channels::{ODOMETRY, SCAN};
use sketchnav_schemas::codes::TaskState;
use sketchnav_schemas::message::{LaserScan, MAX_DOTS, Odometry, Twist};
use sketchnav_schemas::robot::Drive;
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::{Incoming, Instant, Outbox, Remains, Stage, StageError};

use super::error::DirectionsError;
use super::guard::{Guard, Last};
use super::mission::DirectionsMission;
use super::sketcher::maps_of;
use super::{mission, settings};
use crate::arrival::Pilot;
use crate::custom_map::CustomMap;
use crate::error::Error;
use crate::geometry::Point;
use crate::markers::LandmarkKind;
use crate::navigator::guide::Guide;
use crate::navigator::view::View;
use crate::navigator::{self, Activity, Navigator, Outcome, Output, Settings};

/// A guide that the planner receives in an instruction.
pub trait Instructed: Guide + Sized {
    /// The form of the planner's state with this guide. See [`Stage::FORM`].
    const FORM: &'static str;
    /// Status text while the planner waits for its guide.
    const WAITING: &'static str;

    /// Returns the navigator of each task, if the message contains the guides of a run.
    ///
    /// # Errors
    /// [`StageError`] if the contents of the message are invalid.
    fn receive(
        message: &Incoming<'_>,
        simulation: &Simulation,
    ) -> Result<Option<Vec<Navigator<Self>>>, StageError>;

    /// Describes the progress of a journey in words.
    fn progress(&self, output: &Output) -> impl std::fmt::Display;

    /// Explains in words why a journey failed.
    fn failure(&self, outcome: Outcome, output: &Output) -> impl std::fmt::Display;

    /// Sends details about a journey in addition to its state.
    ///
    /// # Errors
    /// [`StageError`] if the message cannot be sent.
    fn report(_task: usize, _memory: Option<&Self::Memory>, _out: &mut Outbox<'_>) -> Result<(), StageError> {
        Ok(())
    }
}

/// How a navigator simulates the outcomes of its own movements.
#[derive(Debug, Clone, Copy)]
pub struct Simulation {
    /// The navigator's settings and its errors.
    pub pilot: Pilot,
    /// The seed of these simulations.
    pub seed: u64,
}

impl Simulation {
    /// Returns the simulation of a run's navigator.
    ///
    /// # Errors
    /// [`DirectionsError`] with the invalid key or the missing sensor.
    pub fn of(run: &RunConfig) -> Result<Self, DirectionsError> {
        Ok(Self { pilot: settings::pilot(&run.mission, &run.robot, 0.0)?, seed: run.seed })
    }
}

/// The planner of a run.
pub struct Planner<G: Guide> {
    simulation: Simulation,
    nominal_dt_s: f64,
    /// The kinds of landmarks, in the order in which descriptions count them.
    kinds: Vec<LandmarkKind>,
    agenda: Agenda,
    navigators: Vec<Navigator<G>>,
    /// Keeps a robot on land away from everything that isn't a landmark.
    guard: Option<Guard>,
    /// Whether the robot has a differential drive. It turns to where it drives, while the navigator's axes remain those of the robot
    /// at the start, according to its odometry.
    turns: bool,
    memory: Memory<G::Memory>,
}

/// The part of the state that changes during a run, apart from the agenda.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Memory<M> {
    /// The current journey, or the last one.
    journey: Option<navigator::State<M>>,
    /// Whether the journey has reached its goal and the window is moving over it.
    hovers: bool,
    /// Number of the last view, and the time at which it was taken.
    seen: Option<(u64, u64)>,
    /// The last command, for a robot on land only.
    last: Option<Last>,
}

impl<G: Instructed> Planner<G> {
    /// Creates the planner for the robot, the tasks and the mission parameters of a run.
    ///
    /// # Errors
    /// [`DirectionsError`] with the invalid key or the missing sensor.
    pub fn new(run: &RunConfig) -> Result<Self, DirectionsError> {
        mission::check(&run.mission, &run.robot)?;
        let simulation = Simulation::of(run)?;
        let guard = simulation.pilot.settings.window.land.map(|_| Guard::new(&run.robot)).transpose()?;
        let last = guard.as_ref().map(Guard::at_rest);
        let turns = guard.is_some() && run.robot.drive == Drive::Differential;
        Ok(Self {
            simulation,
            nominal_dt_s: 1.0 / run.robot.tick_hz(),
            kinds: DirectionsMission::of(&run.mission)?.markers.into_keys().collect(),
            agenda: Agenda::new(run),
            navigators: Vec::new(),
            guard,
            turns,
            memory: Memory { journey: None, hovers: false, seen: None, last },
        })
    }

    fn missing(&self) -> Option<&'static str> {
        self.navigators.is_empty().then_some(G::WAITING)
    }

    /// Begins the journey of a task at the end of the last one.
    fn begin(&mut self) {
        let last = self.memory.journey.take();
        self.memory.journey = self.navigators.get(self.agenda.task()).map(|navigator| match &last {
            Some(last) => navigator.start_after(last),
            None => navigator.start(),
        });
        (self.memory.hovers, self.memory.seen) = (false, None);
    }

    /// Continues the journey with a new view, whose axes are turned by `yaw_rad` from the navigator's.
    fn follow(&mut self, description: &Description, yaw_rad: f64) {
        let (Some(navigator), Some(state)) =
            (self.navigators.get(self.agenda.task()), &mut self.memory.journey)
        else {
            return;
        };
        let is_new = self.memory.seen.is_none_or(|(views, _)| views != description.views);
        if description.views > 0 && is_new {
            let place = |dot: &DescribedDot| {
                let place = Point::new(dot.x_m.into(), dot.y_m.into());
                if self.turns { place.turned(yaw_rad) } else { place }
            };
            let dots: ArrayVec<Point, MAX_DOTS> = description.dots().iter().map(place).collect();
            let kind = |dot: &DescribedDot| self.kinds.get((dot.kind as usize).checked_sub(1)?).copied();
            let kinds: ArrayVec<Option<LandmarkKind>, MAX_DOTS> =
                description.dots().iter().map(kind).collect();
            let view = View { dots: &dots, kinds: &kinds };
            let since_ns =
                self.memory.seen.map_or(0, |(_, last)| description.view_stamp_ns.saturating_sub(last));
            let elapsed_s = since_ns as f64 * 1e-9;
            self.memory.seen = Some((description.views, description.view_stamp_ns));
            let output = match self.memory.hovers {
                true => navigator.hover(state, view, elapsed_s),
                false => navigator.step(state, view, elapsed_s),
            };
            if let Some(outcome) = output.outcome {
                return self.end(outcome, &output);
            }
        }
        let output = navigator.output(state);
        let words = navigator.guide().progress(&output);
        if !self.agenda.keep_going(words) {
            self.stop();
        }
    }

    /// Handles the end of a journey. On arrival, the window moves over the goal before the task ends.
    fn end(&mut self, outcome: Outcome, output: &Output) {
        let (agenda, hovers) = (&mut self.agenda, &mut self.memory.hovers);
        let recoveries = output.recoveries;
        match outcome {
            Outcome::Arrived if !*hovers => {
                *hovers = true;
                return;
            }
            Outcome::Arrived if recoveries == 0 => agenda.end(TaskState::Reached, "at the goal"),
            Outcome::Arrived => {
                agenda.end(TaskState::Reached, format_args!("at the goal; recoveries: {recoveries}"));
            }
            Outcome::CannotLocate | Outcome::Lost => {
                let reason = self.navigators[agenda.task()].guide().failure(outcome, output);
                agenda.end(TaskState::Lost, reason);
            }
        }
        self.stop();
    }

    fn stop(&mut self) {
        self.memory.journey.iter_mut().for_each(|journey| journey.stand_still());
    }

    /// Stops the window. The journey's time limits do not run while it is paused.
    fn pause(&mut self, description: &Description) {
        self.stop();
        self.memory.seen = self.memory.seen.map(|_| (description.views, description.view_stamp_ns));
    }

    /// Returns the result of the last step, if there was one.
    fn output(&self) -> Option<Output> {
        let navigator = self.navigators.get(self.agenda.task())?;
        self.memory.journey.as_ref().map(|journey| navigator.output(journey))
    }

    /// Returns the velocity of the window, which is zero between tasks.
    fn velocity(&self) -> Point {
        let drives = self.agenda.phase() == Phase::Driving;
        let output = self.output().filter(|_| drives);
        output.map_or(Point::default(), |output| output.velocity)
    }

    /// Returns the command for the navigator's velocity, limited by obstacles in the newest scan.
    fn command(&mut self, scan: Option<&LaserScan>, yaw_rad: f64) -> Twist {
        let wish = self.velocity();
        let (Some(guard), Some(last), Some(scan)) = (&mut self.guard, &mut self.memory.last, scan) else {
            return Twist { vx_mps: wish.x, vy_mps: wish.y, yaw_rate_radps: 0.0 };
        };
        let dt_s = self.nominal_dt_s;
        let (velocity, twist) = if self.turns {
            let twist = guard.steer(last, wish.turned(-yaw_rad), scan, dt_s);
            // Halfway through the step, the robot has turned by half of the step's angle.
            let on_average_rad = yaw_rad + 0.5 * twist.yaw_rate_radps * dt_s;
            (Point::new(twist.vx_mps, 0.0).turned(on_average_rad), twist)
        } else {
            let velocity = guard.command(last, wish, scan, dt_s);
            (velocity, Twist { vx_mps: velocity.x, vy_mps: velocity.y, yaw_rate_radps: 0.0 })
        };
        self.memory.journey.iter_mut().for_each(|journey| journey.moves_by(velocity));
        twist
    }

    /// Returns the angle by which the robot has turned since the start, in radians.
    fn yaw_rad(&self, odometry: Option<&Odometry>) -> f64 {
        odometry.filter(|_| self.turns).map_or(0.0, |odometry| odometry.pose.yaw_rad())
    }

    fn write_journey(&self, journey: &mut Journey, yaw_rad: f64) {
        journey.task = self.agenda.task() as u32;
        journey.activity = Code::Rest.code();
        let Some(output) = self.output() else { return };
        journey.activity = code(output.activity).code();
        (journey.entry, journey.accepted) = (output.entry.into(), output.accepted.into());
        journey.recoveries = output.recoveries.into();
        journey.has_reference = output.reference.is_some().into();
        journey.cannot_locate = (output.outcome == Some(Outcome::CannotLocate)).into();
        let reference = output.reference.unwrap_or_default();
        let Point { x, y } = if self.turns { reference.turned(-yaw_rad) } else { reference };
        (journey.reference_x_m, journey.reference_y_m) = (x, y);
    }
}

pub(super) fn code(activity: Activity) -> Code {
    match activity {
        Activity::Seek => Code::Seek,
        Activity::Slide => Code::Slide,
        Activity::Verify => Code::Verify,
        Activity::Adjust => Code::Adjust,
        Activity::Recover => Code::Recover,
        Activity::Rest => Code::Rest,
    }
}

/// Creates a navigator for each map in a text.
fn navigators(text: &str, settings: Settings) -> Result<Vec<Navigator>, Error> {
    maps_of(text)?.into_iter().map(|map| Navigator::new(settings, map)).collect()
}

impl Instructed for CustomMap {
    const FORM: &'static str = "directions planner 10";
    const WAITING: &'static str = "waiting for the custom map";

    fn receive(
        message: &Incoming<'_>,
        simulation: &Simulation,
    ) -> Result<Option<Vec<Navigator>>, StageError> {
        if message.on(DIRECTIONS)?.is_none() {
            return Ok(None);
        }
        Ok(Some(navigators(std::str::from_utf8(message.cells())?, simulation.pilot.settings)?))
    }

    fn progress(&self, output: &Output) -> impl std::fmt::Display {
        let (entry, entries, activity) = (output.entry + 1, self.entries().len(), code(output.activity));
        std::fmt::from_fn(move |f| write!(f, "entry {entry} of {entries}: {activity}"))
    }

    fn failure(&self, outcome: Outcome, output: &Output) -> impl std::fmt::Display {
        let (entry, word) = (output.entry + 1, self.entries()[usize::from(output.entry)].landmark());
        let is_oriented = output.is_oriented;
        std::fmt::from_fn(move |f| match outcome {
            _ if !is_oriented => write!(f, "cannot tell its heading by the landmarks around the start"),
            Outcome::CannotLocate => write!(f, "entry {entry}: cannot locate the landmark ({word})"),
            _ => write!(f, "entry {entry}: the landmark is wrong, with no way back"),
        })
    }
}

impl<G: Instructed> Stage for Planner<G> {
    const FORM: &'static str = G::FORM;
    type State = (Standing, Memory<G::Memory>);

    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), StageError> {
        if let Some(navigators) = G::receive(message, &self.simulation)? {
            self.navigators = navigators;
        }
        self.agenda.receive(message)?;
        Ok(())
    }

    fn is_ready(&self) -> bool {
        self.agenda.is_ready(self.missing().is_none())
    }

    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let Some(description) = instant.newest(DESCRIPTION)? else { return Ok(()) };
        let odometry = if self.turns { instant.newest(ODOMETRY)? } else { None };
        let yaw_rad = self.yaw_rad(odometry);
        let motion = Motion::Commanded { speed_mps: self.velocity().norm() };
        self.agenda.begin_step(instant.stamp_ns, motion);
        match self.agenda.due(self.missing()) {
            Due::Begin => {
                self.begin();
                self.follow(description, yaw_rad);
            }
            Due::Drive => self.follow(description, yaw_rad),
            Due::Stand => self.pause(description),
        }
        out.send(JOURNEY, |journey| self.write_journey(journey, yaw_rad))?;
        G::report(self.agenda.task(), self.memory.journey.as_ref().map(navigator::State::memory), out)?;
        let twist = self.command(instant.newest(SCAN)?, yaw_rad);
        self.agenda.send(twist, 0.0, out)
    }

    fn state(&self) -> impl Serialize {
        (self.agenda.standing(), &self.memory)
    }

    fn restore(&mut self, (standing, memory): (Standing, Memory<G::Memory>)) -> Result<(), StageError> {
        self.agenda.restore(standing);
        self.memory = memory;
        Ok(())
    }

    fn recover(&mut self, remains: &dyn Remains) {
        self.agenda.recover(remains);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Window;

    #[test]
    fn maps_of_several_tasks_come_as_one_text() {
        let settings = Settings::new(Window::new(0.1, 0.015).unwrap(), 0.001);
        let two = navigators("(*, SW)\n(Isol, -)\n---\n(*, -)\n", settings).unwrap();
        let entries: Vec<_> = two.iter().map(|navigator| navigator.map().entries().len()).collect();
        assert_eq!(entries, [2, 1]);
        assert!(navigators("(*, SW)\n---\n", settings).is_err());
    }
}

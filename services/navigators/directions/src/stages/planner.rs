//! The navigator as a stage: follows a custom map by what the localizer describes, and by nothing else.
//!
//! It answers every description with one command and one status. Where the same view comes again it goes on as before. At the
//! goal it moves its window over the landmark, so that the next task begins there.

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};
use sketchnav_motion::mission::{Mission as Errands, Motion, Phase, TaskInfo};
use sketchnav_schemas::channels::{COMMAND, DESCRIPTION, DIRECTIONS, JOURNEY, MISSION, ORDERS, SCAN, STATUS};
use sketchnav_schemas::codes::{Activity as Code, TaskState};
use sketchnav_schemas::message::{Description, Journey, LaserScan, MAX_DOTS, Text, Twist};
use sketchnav_schemas::run::{Pace, RunConfig};
use sketchnav_stage::{Heard, Instant, Outbox, Remains, Stage, StageError};

use super::error::DirectionsError;
use super::guard::{Guard, Last};
use super::mission;
use super::sketcher::maps_of;
use crate::error::Error;
use crate::geometry::Point;
use crate::navigator::{self, Activity, Navigator, Outcome, Output, Settings};

/// The planner of a run.
pub struct Planner {
    settings: Settings,
    tasks: Vec<TaskInfo>,
    nominal_dt_s: f64,
    waits_for_order: bool,
    navigators: Vec<Navigator>,
    /// Keeps a robot on land from what is no landmark.
    guard: Option<Guard>,
    memory: Memory,
}

/// All that changes.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Memory {
    errands: Errands,
    /// The journey under way, or the last one.
    journey: Option<navigator::State>,
    /// Whether the journey is at its goal, and the window moves over it.
    hovers: bool,
    /// The number of the last view, and when it was taken.
    seen: Option<(u64, u64)>,
    /// On land, the last command.
    last: Option<Last>,
}

impl Planner {
    /// For a run: its robot, its tasks, and the parameters of its mission.
    ///
    /// # Errors
    /// [`DirectionsError`] with the key.
    pub fn new(run: &RunConfig) -> Result<Self, DirectionsError> {
        mission::check(&run.mission, &run.robot)?;
        let info = |task: &sketchnav_schemas::mission::Task| TaskInfo {
            name: Text::new(&task.name),
            time_limit_s: task.time_limit_s,
        };
        let settings = mission::settings(&run.mission, &run.robot)?;
        let guard = settings.window.land.map(|_| Guard::new(&run.robot)).transpose()?;
        let last = guard.as_ref().map(Guard::at_rest);
        Ok(Self {
            settings,
            tasks: run.mission.task.iter().map(info).collect(),
            nominal_dt_s: 1.0 / run.robot.tick_hz(),
            waits_for_order: run.pace == Pace::Lockstep,
            navigators: Vec::new(),
            guard,
            memory: Memory { errands: Errands::new(run.pad), journey: None, hovers: false, seen: None, last },
        })
    }

    fn has_maps(&self) -> bool {
        !self.navigators.is_empty()
    }

    /// Takes a step where nobody holds the window.
    fn go_on(&mut self, description: &Description) {
        let (is_ready, count) = (self.memory.errands.is_ordered() && self.has_maps(), self.tasks.len());
        if let Some(next) = self.memory.errands.due(is_ready, count) {
            self.memory.errands.begin(next);
            let last = self.memory.journey.take();
            self.memory.journey = self.navigators.get(next).map(|navigator| match &last {
                Some(last) => navigator.start_behind(last),
                None => navigator.start(),
            });
            (self.memory.hovers, self.memory.seen) = (false, None);
        }
        match self.memory.errands.phase() {
            Phase::Driving => self.follow(description),
            Phase::Waiting => {
                let reason = if self.has_maps() {
                    "waiting for the order to start"
                } else {
                    "waiting for the custom map"
                };
                self.memory.errands.report(TaskState::Waiting, reason);
            }
            Phase::Ended | Phase::Over => self.stop(),
        }
    }

    /// Follows the map by a new view.
    fn follow(&mut self, description: &Description) {
        let index = self.memory.errands.task();
        let (Some(info), Some(navigator), Some(state)) =
            (self.tasks.get(index), self.navigators.get(index), &mut self.memory.journey)
        else {
            return;
        };
        let is_new = self.memory.seen.is_none_or(|(views, _)| views != description.views);
        if description.views > 0 && is_new {
            let view: ArrayVec<Point, MAX_DOTS> =
                description.dots().iter().map(|dot| Point::new(dot.x_m.into(), dot.y_m.into())).collect();
            let since_ns =
                self.memory.seen.map_or(0, |(_, last)| description.view_stamp_ns.saturating_sub(last));
            let elapsed_s = since_ns as f64 * 1e-9;
            self.memory.seen = Some((description.views, description.view_stamp_ns));
            let output = match self.memory.hovers {
                true => navigator.hover(state, &view, elapsed_s),
                false => navigator.step(state, &view, elapsed_s),
            };
            if let Some(outcome) = output.outcome {
                return self.end(outcome, &output);
            }
        }
        let output = state.output();
        let words = Progress { output: &output, entries: navigator.map().entries().len() };
        if !self.memory.errands.go_on(info, words) {
            self.stop();
        }
    }

    /// The journey has ended, or the window is over its goal.
    fn end(&mut self, outcome: Outcome, output: &Output) {
        let Memory { errands, hovers, .. } = &mut self.memory;
        let (entry, recoveries) = (output.entry + 1, output.recoveries);
        match outcome {
            Outcome::Arrived if !*hovers => {
                *hovers = true;
                return;
            }
            Outcome::Arrived if recoveries == 0 => errands.end(TaskState::Reached, "at the goal"),
            Outcome::Arrived => {
                errands.end(TaskState::Reached, format_args!("at the goal; recoveries: {recoveries}"));
            }
            Outcome::CannotLocate => {
                let word = self.navigators[errands.task()].map().entries()[usize::from(output.entry)].word;
                errands
                    .end(TaskState::Lost, format_args!("entry {entry}: cannot locate the landmark ({word})"));
            }
            Outcome::Lost => {
                errands.end(
                    TaskState::Lost,
                    format_args!("entry {entry}: the landmark is wrong, with no way back"),
                );
            }
        }
        self.stop();
    }

    fn stop(&mut self) {
        self.memory.journey.iter_mut().for_each(navigator::State::stand_still);
    }

    /// The velocity of the window: none where no task is under way.
    fn velocity(&self) -> Point {
        let drives = self.memory.errands.phase() == Phase::Driving;
        let output = self.memory.journey.as_ref().filter(|_| drives).map(navigator::State::output);
        output.map_or(Point::default(), |output| output.velocity)
    }

    /// The velocity that what is near allows.
    fn guarded(&mut self, scan: Option<&LaserScan>) -> Point {
        let wish = self.velocity();
        let (Some(guard), Some(last), Some(scan)) = (&mut self.guard, &mut self.memory.last, scan) else {
            return wish;
        };
        let velocity = guard.command(last, wish, scan, self.nominal_dt_s);
        self.memory.journey.iter_mut().for_each(|journey| journey.moves_by(velocity));
        velocity
    }

    fn write_journey(&self, journey: &mut Journey) {
        journey.task = self.memory.errands.task() as u32;
        journey.activity = Code::Rest.code();
        let Some(output) = self.memory.journey.as_ref().map(navigator::State::output) else { return };
        journey.activity = code(output.activity).code();
        (journey.entry, journey.accepted) = (output.entry.into(), output.accepted.into());
        journey.recoveries = output.recoveries.into();
        journey.has_reference = output.reference.is_some().into();
        journey.cannot_locate = (output.outcome == Some(Outcome::CannotLocate)).into();
        let Point { x, y } = output.reference.unwrap_or_default();
        (journey.reference_x_m, journey.reference_y_m) = (x, y);
    }
}

fn code(activity: Activity) -> Code {
    match activity {
        Activity::Seek => Code::Seek,
        Activity::Slide => Code::Slide,
        Activity::Verify => Code::Verify,
        Activity::Adjust => Code::Adjust,
        Activity::Recover => Code::Recover,
        Activity::Rest => Code::Rest,
    }
}

/// What the navigator is about, for people.
struct Progress<'a> {
    output: &'a Output,
    entries: usize,
}

impl std::fmt::Display for Progress<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { output, entries } = self;
        write!(f, "entry {} of {entries}: {}", output.entry + 1, code(output.activity))
    }
}

/// The navigators of the maps in a text.
fn navigators(text: &str, settings: Settings) -> Result<Vec<Navigator>, Error> {
    maps_of(text)?.into_iter().map(|map| Navigator::new(settings, map)).collect()
}

impl Stage for Planner {
    const FORM: &'static str = "directions planner 2";
    type State = Memory;

    fn hear(&mut self, message: &Heard<'_>) -> Result<(), StageError> {
        if message.on(DIRECTIONS).is_some() {
            self.navigators = navigators(std::str::from_utf8(message.cells())?, self.settings)?;
        } else if let Some(order) = message.on(MISSION).or(message.on(ORDERS)) {
            self.memory.errands.on_order(order, self.tasks.len());
        }
        Ok(())
    }

    fn is_ready(&self) -> bool {
        self.memory.errands.is_ordered() && self.has_maps() || !self.waits_for_order
    }

    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let Some(description) = instant.newest(DESCRIPTION) else { return Ok(()) };
        let speed_mps = self.velocity().norm();
        let motion = Motion::Commanded { speed_mps };
        self.memory.errands.begin_step(&description.header, motion, self.nominal_dt_s);
        if self.memory.errands.is_held() {
            self.stop();
            self.memory.seen = self.memory.seen.map(|_| (description.views, description.view_stamp_ns));
        } else {
            self.go_on(description);
        }
        out.send(JOURNEY, |journey| self.write_journey(journey))?;
        let velocity = self.guarded(instant.newest(SCAN));
        out.send(COMMAND, |command| {
            command.twist = Twist { vx_mps: velocity.x, vy_mps: velocity.y, yaw_rate_radps: 0.0 };
            command.last = self.memory.errands.is_last().into();
        })?;
        let info = self.tasks.get(self.memory.errands.task());
        out.send(STATUS, |status| {
            let header = status.header;
            self.memory.errands.write_status(info, self.tasks.len(), 0.0, status);
            status.header = header;
        })?;
        Ok(())
    }

    fn state(&self) -> impl Serialize {
        &self.memory
    }

    fn restore(&mut self, state: Memory) -> Result<(), StageError> {
        self.memory = state;
        Ok(())
    }

    fn recover(&mut self, remains: &dyn Remains) {
        if let Some(last) = remains.of(STATUS) {
            self.memory.errands.resume_behind(&last);
        }
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

//! The planner stage of `landmarks`, which either follows landmark states or drives along the drawn route by the robot's estimated
//! pose.
//!
//! The planner responds to each view with the progress along the route, one command and one status.

use serde::{Deserialize, Serialize};
use sketchnav_motion::agenda::{Agenda, Due, Standing};
use sketchnav_schemas::channels::ODOMETRY;
use sketchnav_schemas::codes::{Order, TaskState};
use sketchnav_schemas::floor_plan::Marker;
use sketchnav_schemas::message::{Here, Twist};
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::robot::{Limits, Robot};
use sketchnav_schemas::run::{Pad, RunConfig};
use sketchnav_stage::{Incoming, Instant, Outbox, Remains, Stage, StageError};

use crate::control::{self, Drive};
use crate::drawn::{DrawnMetres, Stretch};
use crate::error::{Error, LandmarksError};
use crate::follower::{Event, Follower, Progress, Viewed};
use crate::guide::{self, Guide, Guided, Outcome};
use crate::instructions::Instructions;
use crate::matching::{self, Features};
use crate::messages::{
    LANDMARK_PROGRESS, LANDMARK_ROUTE, LANDMARK_VIEW, LandmarkEvent, LandmarkProgress, LandmarkView,
    MetRelation, RouteCommand,
};
use crate::mission::{LandmarksMission, Method, Parameters, PlannerParameters};
use crate::motion::Motion;
use crate::perception::Seen;
use crate::ring::Ring;
use crate::route::{Command, Route};
use crate::sketch::Sketch;
use crate::view;

/// Speed below which the robot counts as not making progress, in metres per second.
const STANDING_MPS: f64 = 0.02;

/// The method by which the robot drives. It also holds the method's state.
enum Driver {
    /// Matches landmark states.
    States(Follower),
    /// Drives along the drawn route by the estimated pose. Landmark states, if there are any, only serve to report progress.
    Belief { guide: Guide, sketch: Sketch, route: Option<Route> },
}

/// State of a [`Driver`], as saved in a checkpoint.
#[derive(Debug, Clone, Serialize, Deserialize)]
enum Driven {
    States(Progress),
    Belief(guide::State),
}

/// Planner of a run, for either method.
pub struct Planner {
    method: Method,
    pad: Pad,
    parameters: PlannerParameters,
    limits: Limits,
    driver: Option<Driver>,
    /// Number of the last route received, or 0 if there has been none.
    route: u64,
    /// Position of each state along the route, up to the first one whose position is unknown.
    along: Vec<DrawnMetres>,
    seen: Vec<Seen>,
    agenda: Agenda,
    motion: Motion,
    course: Course,
}

/// State of a drive that both methods share.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct Course {
    /// Time without progress, in seconds.
    standing_s: f64,
    /// The current command: speed in metres per second, and turn rate in radians per second.
    command: [f64; 2],
    /// Number of the state that the robot is waiting for.
    next: usize,
    /// The latest event, as a value of [`LandmarkEvent`].
    event: u32,
}

/// State of the planner, as saved in a checkpoint.
#[derive(Debug, Serialize, Deserialize)]
pub struct State {
    route: u64,
    agenda: Standing,
    motion: Motion,
    course: Course,
    driven: Option<Driven>,
}

/// Checks that a mission and a robot meet the requirements of this navigator.
///
/// # Errors
/// [`LandmarksError`], which names the key or the sensor, if they do not.
pub fn check(mission: &Mission, robot: &Robot) -> Result<(), LandmarksError> {
    let given = LandmarksMission::of(mission)?;
    Parameters::of(mission)?;
    robot.odometry()?;
    if !given.markers.is_empty() {
        robot.camera()?;
    }
    Ring::of(robot).map(drop)
}

/// Checks that the floor has all markers that a mission names.
///
/// # Errors
/// [`LandmarksError::Marker`] if one of them is missing.
pub fn check_markers(mission: &Mission, markers: &[Marker]) -> Result<(), LandmarksError> {
    let given = LandmarksMission::of(mission)?;
    let named = given.markers.iter().flat_map(|(label, numbers)| numbers.iter().map(move |one| (label, one)));
    for (label, &found) in named {
        if markers.iter().all(|marker| marker.id != found) {
            return Err(LandmarksError::Marker { label: label.clone(), found, count: markers.len() });
        }
    }
    Ok(())
}

impl Planner {
    /// Creates the planner of a run for its robot and its task, with the parameters of its mission.
    ///
    /// # Errors
    /// [`LandmarksError`], which names the key or the sensor, if [`check`] fails.
    pub fn new(run: &RunConfig) -> Result<Self, LandmarksError> {
        check(&run.mission, &run.robot)?;
        let mission = LandmarksMission::of(&run.mission)?;
        let mut parameters = Parameters::of(&run.mission)?.planner;
        let limits = run.robot.limits;
        if !run.pad.is_absent() {
            // If a person is watching, ask at once instead of driving back.
            parameters.belief.returns = 0;
        }
        for control in [&mut parameters.states.control, &mut parameters.belief.control] {
            control.speed_mps = control.speed_mps.min(limits.speed_mps);
        }
        Ok(Self {
            method: mission.method,
            pad: run.pad,
            parameters,
            limits,
            driver: None,
            route: 0,
            along: Vec::new(),
            seen: Vec::with_capacity(crate::messages::MAX_SEEN_OBJECTS),
            agenda: Agenda::new(run),
            motion: Motion::default(),
            course: Course::default(),
        })
    }

    fn missing(&self) -> Option<&'static str> {
        self.driver.is_none().then_some("waiting for the route")
    }

    fn drive(&mut self, view: &LandmarkView, [moved_m, turned_rad]: [f64; 2], dt_s: f64) {
        self.seen.clear();
        self.seen.extend(view::objects(view));
        let Some(driver) = &mut self.driver else { return };
        let viewed = Viewed { seen: &self.seen, sectors: &view.sectors_m, time_s: dt_s, moved_m, turned_rad };
        let (drive, ended) = match driver {
            Driver::States(follower) => by_states(follower, &viewed, &mut self.course),
            Driver::Belief { guide, .. } => by_belief(guide, &self.along, view, &viewed, &mut self.course),
        };
        self.command(drive);
        let stands = moved_m.abs() < STANDING_MPS * dt_s;
        self.course.standing_s = if stands { self.course.standing_s + dt_s } else { 0.0 };
        let front_m = control::front_m(&view.sectors_m);
        match ended {
            Some(End::Arrived) => {
                self.agenda.end(
                    TaskState::Reached,
                    format_args!("{front_m:.1} m before what is at the route's end"),
                );
            }
            Some(End::Lost(why)) => self.agenda.lose(why),
            None if self.course.standing_s > self.parameters.blocked_s && !self.turn_back() => {
                self.agenda.end(TaskState::Blocked, "found no way past the obstacle ahead");
            }
            None => {
                let is_going_back =
                    matches!(&self.driver, Some(Driver::Belief { guide, .. }) if guide.is_going_back());
                let about = About { next: self.course.next, command: self.about(), is_going_back };
                if self.agenda.keep_going(about) {
                    return;
                }
            }
        }
        self.stop();
    }

    /// Makes a blocked robot drive back. Returns false if it drives by states or has used up its returns.
    fn turn_back(&mut self) -> bool {
        let Some(Driver::Belief { guide, .. }) = &mut self.driver else { return false };
        self.course.standing_s = 0.0;
        guide.turn_back()
    }

    /// Resumes at a person's request: from the current position or, if `number` is not 0, from the state to which the person has
    /// taken the robot (4.8). States count from 1, without the last one.
    fn resume(&mut self, number: usize) {
        match &mut self.driver {
            Some(Driver::States(follower)) if number > 0 || follower.is_lost() => {
                let state = if number > 0 { number - 1 } else { follower.next() - 1 };
                match follower.resume_at(state) {
                    Ok(()) => self.course = Course { next: state + 1, ..self.course },
                    Err(_) => {
                        let last = follower.route().states.len() - 1;
                        self.agenda.lose(format_args!("expected a state from 1 to {last}, found {number}"));
                    }
                }
            }
            Some(Driver::Belief { .. }) if number > 0 => {
                self.agenda.lose("a belief has no states; lead the robot there, resume without a number");
            }
            Some(Driver::Belief { guide, .. }) => guide.look_again(),
            Some(Driver::States(_)) | None => {}
        }
        self.course.standing_s = 0.0;
    }

    /// Moves the robot's position along the route to where a person says it is in the sketch. Ignored if the robot drives by
    /// states.
    fn place(&mut self, here: &Here) {
        let Some(Driver::Belief { guide, sketch, .. }) = &mut self.driver else { return };
        guide.told(sketch.place(here));
        let along = guide.along();
        self.course.next = self.along.iter().take_while(|at| **at <= along).count();
        self.course.next = self.course.next.min(self.along.len().saturating_sub(1));
        self.course.standing_s = 0.0;
        self.agenda.find();
    }

    /// Returns true if the robot has driven the route to its end, or as far as it could find its way.
    fn is_behind(&self) -> bool {
        match &self.driver {
            Some(Driver::Belief { guide, .. }) => guide.has_ended(),
            Some(Driver::States(follower)) => follower.next() >= follower.route().states.len(),
            None => false,
        }
    }

    fn is_lost(&self) -> bool {
        match &self.driver {
            Some(Driver::States(follower)) => follower.is_lost(),
            Some(Driver::Belief { guide, .. }) => guide.is_lost(),
            None => false,
        }
    }

    fn stop(&mut self) {
        self.course.command = [0.0; 2];
    }

    /// Sets the command, within the limits of the robot.
    fn command(&mut self, drive: Drive) {
        let Limits { speed_mps, yaw_rate_radps, .. } = self.limits;
        self.course.command = [
            drive.speed_mps.clamp(-speed_mps, speed_mps),
            drive.yaw_rate_radps.clamp(-yaw_rate_radps, yaw_rate_radps),
        ];
    }

    /// Returns the command of the route at the robot's current position.
    fn about(&self) -> Command {
        match &self.driver {
            Some(Driver::States(follower)) => follower.command(),
            Some(Driver::Belief { guide, .. }) => guide.command(),
            None => Command::Stop,
        }
    }

    fn route(&self) -> Option<(&Route, Features)> {
        match self.driver.as_ref()? {
            Driver::States(follower) => Some((follower.route(), follower.features())),
            Driver::Belief { route, .. } => Some((route.as_ref()?, Features::default())),
        }
    }

    fn remaining_m(&self, view: &LandmarkView) -> f64 {
        match &self.driver {
            Some(Driver::Belief { guide, .. }) => {
                let left = guide.length() - guide.along();
                Stretch(view.stretch).driven_m(left.max(DrawnMetres::default()))
            }
            // Landmark states assume that the drawing is to scale, as the thesis does.
            Some(Driver::States(_)) => {
                let here = self.along.get(self.course.next.saturating_sub(1));
                here.zip(self.along.last()).map_or(0.0, |(here, end)| Stretch::NONE.driven_m(*end - *here))
            }
            None => 0.0,
        }
    }

    fn write(&self, progress: &mut LandmarkProgress) {
        progress.command = match self.about() {
            Command::Forward => RouteCommand::Forward,
            Command::Left => RouteCommand::Left,
            Command::Right => RouteCommand::Right,
            Command::Stop => RouteCommand::Stop,
        }
        .code();
        progress.event = self.course.event;
        progress.is_lost = self.is_lost().into();
        if let Some(Driver::Belief { guide, .. }) = &self.driver {
            (progress.along_m, progress.length_m) = (guide.along().0, guide.length().0);
        }
        let Some((route, features)) = self.route() else { return };
        progress.state_count = route.states.len() as u32;
        progress.next = self.course.next.min(route.states.len()) as u32;
        let is_matched = self.course.event == LandmarkEvent::Matched.code();
        let Some(state) =
            route.states.get(self.course.next - usize::from(is_matched && self.course.next > 0))
        else {
            return;
        };
        let met = matching::witnesses(state, &self.seen, features).take(progress.met.len());
        for (place, (relation, object)) in progress.met.iter_mut().zip(met) {
            *place = MetRelation { relation: relation as u32, object: object as u32 };
            progress.met_count += 1;
        }
    }
}

/// How a drive ends.
enum End {
    Arrived,
    Lost(Lost),
}

/// Why a robot is lost, as display text.
enum Lost {
    State(usize),
    NoGoal,
    Fit(f64),
}

impl std::fmt::Display for Lost {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::State(number) => {
                write!(f, "state {} was not matched within twice the expected time", number + 1)
            }
            Self::NoGoal => f.write_str("no object where the route ends"),
            Self::Fit(fit) => write!(f, "only {:.0} % of what is seen fits the sketch", 100.0 * fit),
        }
    }
}

/// What the robot is doing, as display text.
struct About {
    next: usize,
    command: Command,
    is_going_back: bool,
}

impl std::fmt::Display for About {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.is_going_back {
            return f.write_str("drive back to the last sure place");
        }
        write!(f, "{}, until state {}", self.command, self.next + 1)
    }
}

fn by_states(follower: &mut Follower, viewed: &Viewed<'_>, course: &mut Course) -> (Drive, Option<End>) {
    let (drive, event) = follower.step(viewed);
    course.next = follower.next();
    let (event, end) = match event {
        None => (LandmarkEvent::Nothing, None),
        Some(Event::Matched(_)) => (LandmarkEvent::Matched, None),
        Some(Event::Arrived) => (LandmarkEvent::Arrived, Some(End::Arrived)),
        Some(Event::Lost(state)) => (LandmarkEvent::Lost, Some(End::Lost(Lost::State(state)))),
    };
    course.event = event.code();
    (drive, end)
}

fn by_belief(
    guide: &mut Guide,
    along: &[DrawnMetres],
    view: &LandmarkView,
    viewed: &Viewed<'_>,
    course: &mut Course,
) -> (Drive, Option<End>) {
    let estimate = view::estimate(view);
    let Viewed { sectors, moved_m, turned_rad, .. } = *viewed;
    let (drive, outcome) =
        guide.step(&Guided { estimate, sectors, moved_m, turned_rad, sure: view.sure_count });
    // The last state counts as matched only when the robot arrives.
    let is_passed = along.get(course.next).is_some_and(|at| *at <= guide.along());
    let is_matched = is_passed && course.next + 1 < along.len();
    course.next += usize::from(is_matched);
    let (event, end) = match outcome {
        None if is_matched => (LandmarkEvent::Matched, None),
        None => (LandmarkEvent::Nothing, None),
        Some(Outcome::Arrived) => (LandmarkEvent::Arrived, Some(End::Arrived)),
        Some(Outcome::NoGoal) => (LandmarkEvent::Lost, Some(End::Lost(Lost::NoGoal))),
        Some(Outcome::Lost) => (LandmarkEvent::Lost, Some(End::Lost(Lost::Fit(estimate.fit)))),
    };
    course.event = event.code();
    (drive, end)
}

impl Driver {
    fn new(
        method: Method,
        instructions: &Instructions,
        parameters: &PlannerParameters,
    ) -> Result<Self, Error> {
        let route = instructions.route()?;
        if method == Method::Chronis2007 {
            let missing = || Error::States { expected: "landmark states", found: "none".into() };
            return Ok(Self::States(Follower::new(route.ok_or_else(missing)?, parameters.states)?));
        }
        let sketch = instructions.sketch.as_ref().ok_or(Error::NoRoute { objects: 0, stray: 0 })?;
        Ok(Self::Belief { guide: Guide::new(sketch, parameters.belief)?, sketch: sketch.clone(), route })
    }
}

impl Stage for Planner {
    const FORM: &'static str = "landmarks planner 4";
    type State = State;

    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), StageError> {
        if let Some(route) = message.on(LANDMARK_ROUTE)? {
            let before = std::mem::replace(&mut self.route, route.header.seq);
            if self.pad.draws() && before != 0 && before != route.header.seq {
                self.agenda.begin_again();
            }
            let instructions = Instructions::read(message.cells())?;
            let driver = Driver::new(self.method, &instructions, &self.parameters)?;
            self.driver = Some(driver);
            let along = self.route().map_or(Vec::new(), |(route, _)| route.along());
            self.along = along.into_iter().map_while(|along| along).collect();
        } else if let Some(order) = self.agenda.receive(message)? {
            if Order::from_code(order.order) == Some(Order::Resume) {
                self.resume(order.task as usize);
            }
            if let Some(here) = order.here() {
                self.place(&here);
            }
        }
        Ok(())
    }

    fn is_ready(&self) -> bool {
        self.agenda.is_ready(self.missing().is_none())
    }

    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let (Some(view), Some(odometry)) = (instant.newest(LANDMARK_VIEW)?, instant.newest(ODOMETRY)?) else {
            return Ok(());
        };
        let dt_s = self.agenda.begin_step(instant.stamp_ns, odometry);
        let motion = self.motion.to(&view.odometry());
        self.course.event = LandmarkEvent::Nothing.code();
        match self.agenda.due(self.missing()) {
            Due::Begin if self.is_behind() => {
                self.agenda.end(TaskState::Blocked, "the route has been driven; draw another one from here");
                self.stop();
            }
            Due::Begin => {
                self.course = Course { next: 1, ..Course::default() };
                self.drive(view, motion, dt_s);
            }
            Due::Drive => self.drive(view, motion, dt_s),
            Due::Stand => self.stop(),
        }
        out.send(LANDMARK_PROGRESS, |progress| self.write(progress))?;
        let [vx_mps, yaw_rate_radps] = self.course.command;
        self.agenda.send(Twist { vx_mps, vy_mps: 0.0, yaw_rate_radps }, self.remaining_m(view), out)
    }

    fn state(&self) -> impl Serialize {
        let driven = self.driver.as_ref().map(|driver| match driver {
            Driver::States(follower) => Driven::States(*follower.progress()),
            Driver::Belief { guide, .. } => Driven::Belief(guide.state().clone()),
        });
        State {
            route: self.route,
            agenda: self.agenda.standing(),
            motion: self.motion,
            course: self.course,
            driven,
        }
    }

    fn restore(&mut self, state: State) -> Result<(), StageError> {
        let State { route, agenda, motion, course, driven } = state;
        self.motion = motion;
        // If people draw, a newer route may have arrived, which has to wait for an order to start.
        if self.pad.draws() && route != self.route {
            return Ok(());
        }
        self.course = course;
        self.agenda.restore(agenda);
        match (&mut self.driver, driven) {
            (Some(Driver::States(follower)), Some(Driven::States(progress))) => follower.restore(progress)?,
            (Some(Driver::Belief { guide, .. }), Some(Driven::Belief(state))) => guide.restore(state),
            _ => {}
        }
        Ok(())
    }

    fn recover(&mut self, remains: &dyn Remains) {
        self.agenda.recover(remains);
    }
}

//! A navigator that this project does not know, whole: it follows the wall on its right by sonar. It is also a program
//! that is all of `sketchnav` and knows this navigator, too. `tests/stranger.rs` drives by it.
//!
//! ```toml
//! [navigator]
//! kind = "wall-follower"
//! [[task]]
//! name = "along the wall"
//! seconds = 20.0          # of driving, simulated
//! ```

use std::process::ExitCode;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::channels::{COMMAND, Channel, ChannelSpec, MISSION, Role, SONAR, STATUS};
use sketchnav_schemas::codes::{Order, Process, TaskState};
use sketchnav_schemas::erased::MessageType;
use sketchnav_schemas::message::{SonarScan, Text};
use sketchnav_schemas::mission::Mission;
use sketchnav_stage::{Heard, Instant, Navigator, Outbox, Stage, StageError};

const KIND: &str = "wall-follower";
/// Distance that it keeps from the wall, metres.
const BESIDE_M: f64 = 0.6;
/// Where something is nearer ahead, it turns away, metres.
const AHEAD_M: f64 = 0.9;
/// Share of the distance before in what it takes for the distance: sonars err.
const MEMORY: f64 = 0.5;

sketchnav_schemas::declare::messages! {
    /// The walls around the robot, as its sonars hear them.
    pub struct Walls version 1 in "base_link" {
        /// The nearest echo ahead, metres from the robot's centre.
        pub ahead_m: f64,
        /// The nearest echo to the right, metres from the robot's centre.
        pub right_m: f64,
    }
}

/// Its situation: the one channel that it has beside those of all navigators.
const WALLS: Channel<Walls> = Channel::of(&ChannelSpec {
    name: "walls",
    writer: Some(Process::Localizer),
    readers: &[Process::Planner],
    role: Role::Situation,
    kind: Some(KIND),
    per_tick: 1,
    max_cells: 0,
    message: MessageType::of::<Walls>(),
});

const NAVIGATOR: Navigator = Navigator {
    kind: KIND,
    about: "follows the wall on the right by sonar, for as long as each task says",
    methods: &[],
    check: |mission, robot| {
        robot.sonar()?;
        tasks(mission).map(drop)
    },
    check_markers: None,
    parameters: |mission, _| Ok(mission.parameters.clone()),
    sketcher: |_, _| Ok(Box::new(Silent)),
    localizer: |_, _| Ok(Box::new(Ears { heard: None })),
    planner: |run, _| Ok(Box::new(Driver { tasks: tasks(&run.mission)?, state: State::default() })),
};

fn main() -> ExitCode {
    sketchnav::main_with(&[NAVIGATOR], &[WALLS.spec])
}

/// How long each task takes, seconds, and its name.
fn tasks(mission: &Mission) -> Result<Vec<(f64, Text<32>)>, StageError> {
    let of_task = |(i, task): (usize, &sketchnav_schemas::mission::Task)| {
        let seconds = task.given.get("seconds").and_then(toml::Value::as_float);
        let seconds =
            seconds.ok_or_else(|| format!("task {}.seconds: expected a number of seconds", i + 1))?;
        Ok((seconds, Text::new(&task.name)))
    };
    mission.task.iter().enumerate().map(of_task).collect()
}

/// Nobody gives it anything.
struct Silent;

impl Stage for Silent {
    const FORM: &'static str = "wall-follower sketcher 1";
    type State = ();
    fn state(&self) -> impl Serialize {}
    fn restore(&mut self, (): ()) -> Result<(), StageError> {
        Ok(())
    }
}

/// Says where the walls are.
struct Ears {
    heard: Option<[f64; 2]>,
}

impl Stage for Ears {
    const FORM: &'static str = "wall-follower localizer 1";
    type State = Option<[f64; 2]>;

    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        if let Some(scan) = instant.fresh(SONAR) {
            let now = [nearest(scan, 0.0), nearest(scan, -std::f64::consts::FRAC_PI_2)];
            let before = self.heard.unwrap_or(now);
            self.heard = Some([0, 1].map(|i| MEMORY * before[i] + (1.0 - MEMORY) * now[i]));
        }
        let [ahead_m, right_m] = self.heard.unwrap_or([0.0; 2]);
        out.send(WALLS, |walls| (walls.ahead_m, walls.right_m) = (ahead_m, right_m))?;
        Ok(())
    }

    fn state(&self) -> impl Serialize {
        self.heard
    }

    fn restore(&mut self, state: Self::State) -> Result<(), StageError> {
        self.heard = state;
        Ok(())
    }
}

/// The nearest echo within 30° of a direction, metres from the centre; the longest range where there is none.
fn nearest(scan: &SonarScan, direction_rad: f64) -> f64 {
    let is_there = |i: &usize| (f64::from(scan.angle_rad(*i)) - direction_rad).cos() > 0.85;
    let ranges = (0..scan.ranges().len()).filter(is_there).map(|i| f64::from(scan.ranges()[i]));
    f64::from(scan.ring_radius_m) + ranges.fold(f64::from(scan.range_max_m), |a, b| a.min(b.max(0.0)))
}

/// Drives.
struct Driver {
    tasks: Vec<(f64, Text<32>)>,
    state: State,
}

#[derive(Clone, Copy, Default, Serialize, Deserialize)]
struct State {
    is_ordered: bool,
    task: usize,
    began_ns: u64,
}

impl Stage for Driver {
    const FORM: &'static str = "wall-follower planner 1";
    type State = State;

    fn hear(&mut self, message: &Heard<'_>) -> Result<(), StageError> {
        self.state.is_ordered |= message.on(MISSION).is_some_and(|order| order.order == Order::Start.code());
        Ok(())
    }

    fn is_ready(&self) -> bool {
        self.state.is_ordered
    }

    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let Some(walls) = instant.newest(WALLS) else { return Ok(()) };
        let (task, began_ns) = (self.state.task, self.state.began_ns);
        let elapsed_s = (instant.stamp_ns - began_ns) as f64 * 1e-9;
        let current = self.tasks.get(task);
        let is_reached = current.is_some_and(|(seconds, _)| elapsed_s >= *seconds);
        let turn = if walls.ahead_m < AHEAD_M { 0.8 } else { (BESIDE_M - walls.right_m).clamp(-0.5, 0.5) };
        out.send(COMMAND, |command| {
            if current.is_some() {
                command.twist.vx_mps = if walls.ahead_m < AHEAD_M { 0.0 } else { 0.25 };
                command.twist.yaw_rate_radps = turn;
            }
            command.last = current.is_none().into();
        })?;
        out.send(STATUS, |status| {
            let state = match (current, is_reached) {
                (None, _) => TaskState::Finished,
                (Some(_), true) => TaskState::Reached,
                (Some(_), false) => TaskState::Driving,
            };
            (status.task, status.task_count) = (task as u32, self.tasks.len() as u32);
            (status.state, status.reached_count) = (state.code(), (task + usize::from(is_reached)) as u32);
            (status.task_time_s, status.name) = (elapsed_s, current.map_or(Text([0; 32]), |(_, name)| *name));
        })?;
        if is_reached {
            (self.state.task, self.state.began_ns) = (task + 1, instant.stamp_ns);
        }
        Ok(())
    }

    fn state(&self) -> impl Serialize {
        self.state
    }

    fn restore(&mut self, state: State) -> Result<(), StageError> {
        self.state = state;
        Ok(())
    }
}

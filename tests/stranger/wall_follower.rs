//! A complete navigator that is not part of this project. It follows the wall on its right by sonar. The file
//! is also a program that combines all of `sketchnav` with this navigator. `tests/missions/stranger.rs`
//! drives with it.
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
use sketchnav_motion::agenda::{Agenda, Due, Standing};
use sketchnav_schemas::channels::{ODOMETRY, SONAR};
use sketchnav_schemas::codes::TaskState;
use sketchnav_schemas::message::{SonarScan, Twist};
use sketchnav_schemas::mission::{Mission, NoKeys};
use sketchnav_stage::account::{Account, Curve, Summary};
use sketchnav_stage::lookout::{Color, Lookout, Picture};
use sketchnav_stage::{Denied, Incoming, Instant, Navigator, Outbox, Stage, StageError};

const KIND: &str = "wall-follower";
/// Distance that the robot keeps from the wall, in metres.
const BESIDE_M: f64 = 0.6;
/// Distance of an obstacle ahead, in metres, below which the robot turns away.
const AHEAD_M: f64 = 0.9;
/// Weight of the previous distance in the smoothed distance. Distances are smoothed because sonars are noisy.
const MEMORY: f64 = 0.5;

sketchnav_schemas::declare::messages! {
    /// The walls around the robot, as its sonars measure them.
    pub struct Walls version 1 in "base_link" {
        /// The nearest echo ahead, metres from the robot's centre.
        pub ahead_m: f64,
        /// The nearest echo to the right, metres from the robot's centre.
        pub right_m: f64,
    }
}

sketchnav_schemas::declare::channels! {
    of KIND;
    /// The situation: the only channel that it adds to those of all navigators.
    WALLS: Situation Walls = "walls", Localizer => [Planner, Pad];
}

const NAVIGATOR: Navigator = Navigator {
    check: |mission, robot| {
        robot.sonar()?;
        robot.odometry()?;
        seconds(mission).map(drop)
    },
    channels: CHANNELS,
    lookout: Some(|_| Box::new(Watcher(None))),
    account: Some(|_| Box::new(Diary::default())),
    ..Navigator::new(
        KIND,
        "follows the wall on the right by sonar, for as long as each task says",
        [
            |_, _| Ok(Box::new(Silent)),
            |_, _| Ok(Box::new(Ears { walls_m: None })),
            |run, _| Ok(Box::new(Driver { seconds: seconds(&run.mission)?, agenda: Agenda::new(run) })),
        ],
    )
};

fn main() -> ExitCode {
    sketchnav::main_with(&[NAVIGATOR])
}

/// The keys of a task that belong to this navigator.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TaskKeys {
    seconds: f64,
}

/// How long each task takes, seconds.
fn seconds(mission: &Mission) -> Result<Vec<f64>, StageError> {
    let NoKeys {} = mission.navigator_keys()?;
    let tasks: Vec<TaskKeys> = mission.task_keys()?;
    Ok(tasks.iter().map(|task| task.seconds).collect())
}

/// Takes no input.
struct Silent;

impl Stage for Silent {
    const FORM: &'static str = "wall-follower sketcher 1";
    type State = ();
    fn state(&self) -> impl Serialize {}
    fn restore(&mut self, (): ()) -> Result<(), StageError> {
        Ok(())
    }
}

/// Measures how far away the walls are.
struct Ears {
    walls_m: Option<[f64; 2]>,
}

impl Stage for Ears {
    const FORM: &'static str = "wall-follower localizer 1";
    type State = Option<[f64; 2]>;

    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        if let Some(scan) = instant.fresh(SONAR)? {
            let now = [nearest(scan, 0.0), nearest(scan, -std::f64::consts::FRAC_PI_2)];
            let before = self.walls_m.unwrap_or(now);
            self.walls_m = Some([0, 1].map(|i| MEMORY * before[i] + (1.0 - MEMORY) * now[i]));
        }
        let [ahead_m, right_m] = self.walls_m.unwrap_or([0.0; 2]);
        out.send(WALLS, |walls| (walls.ahead_m, walls.right_m) = (ahead_m, right_m))?;
        Ok(())
    }

    fn state(&self) -> impl Serialize {
        self.walls_m
    }

    fn restore(&mut self, state: Self::State) -> Result<(), StageError> {
        self.walls_m = state;
        Ok(())
    }
}

/// Returns the nearest echo within about 30° of a direction, in metres from the robot's centre, or the maximum range if
/// there is none.
fn nearest(scan: &SonarScan, direction_rad: f64) -> f64 {
    let is_there = |i: &usize| (f64::from(scan.angle_rad(*i)) - direction_rad).cos() > 0.85;
    let ranges = (0..scan.ranges().len()).filter(is_there).map(|i| f64::from(scan.ranges()[i]));
    f64::from(scan.ring_radius_m) + ranges.fold(f64::from(scan.range_max_m), |a, b| a.min(b.max(0.0)))
}

/// Drives the robot.
struct Driver {
    seconds: Vec<f64>,
    agenda: Agenda,
}

impl Driver {
    /// Whether the robot is to drive in this step.
    fn drives(&mut self) -> bool {
        if self.agenda.due(None::<&str>) == Due::Stand {
            return false;
        }
        let is_over = self.agenda.elapsed_s() >= self.seconds[self.agenda.task()];
        if is_over {
            self.agenda.end(TaskState::Reached, "for as long as it should");
        }
        !is_over && self.agenda.keep_going("along the wall")
    }
}

impl Stage for Driver {
    const FORM: &'static str = "wall-follower planner 2";
    type State = Standing;

    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), StageError> {
        self.agenda.receive(message)?;
        Ok(())
    }

    fn is_ready(&self) -> bool {
        self.agenda.is_ready(true)
    }

    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let (Some(walls), Some(odometry)) = (instant.newest(WALLS)?, instant.newest(ODOMETRY)?) else {
            return Ok(());
        };
        self.agenda.begin_step(instant.stamp_ns, odometry);
        let [vx_mps, yaw_rate_radps] = match (self.drives(), walls.ahead_m < AHEAD_M) {
            (false, _) => [0.0, 0.0],
            (true, true) => [0.0, 0.8],
            (true, false) => [0.25, (BESIDE_M - walls.right_m).clamp(-0.5, 0.5)],
        };
        self.agenda.send(Twist { vx_mps, vy_mps: 0.0, yaw_rate_radps }, 0.0, out)
    }

    fn state(&self) -> impl Serialize {
        self.agenda.standing()
    }

    fn restore(&mut self, standing: Standing) -> Result<(), StageError> {
        self.agenda.restore(standing);
        Ok(())
    }
}

/// Shows a metre of each wall on the pad.
struct Watcher(Option<Walls>);

impl Lookout for Watcher {
    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), Denied> {
        self.0 = message.on(WALLS)?.copied().or(self.0);
        Ok(())
    }

    fn draw(&mut self, picture: &mut Picture) {
        let Some(Walls { ahead_m, right_m, .. }) = self.0 else { return };
        picture.line([[ahead_m, -0.5], [ahead_m, 0.5]], Color::Obstacle);
        picture.line([[-0.5, -right_m], [0.5, -right_m]], Color::Obstacle);
    }
}

/// Reports how far the robot was from its wall.
#[derive(Default)]
struct Diary(Vec<Walls>);

impl Account for Diary {
    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), Denied> {
        self.0.extend(message.on(WALLS)?);
        Ok(())
    }

    fn summarize(&self, summary: &mut Summary) {
        let nearest_m = self.0.iter().map(|walls| walls.right_m).fold(f64::INFINITY, f64::min);
        summary.figure("nearest wall on the right", format!("{nearest_m:.2} m"));
        let right = Curve::of("right", &self.0, |walls| &walls.header, |walls| walls.right_m);
        summary.chart("Distance of the wall", "m, from the centre", [right]);
    }
}

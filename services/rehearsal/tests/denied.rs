//! A navigator that asks for the truth, which the table grants to no process, fails immediately.

use std::path::Path;

use sketchnav_rehearsal::{Onlooker, Rehearsal, Tap};
use sketchnav_schemas::channels::{Channel, ChannelSpec, Role, TRUTH};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::erased::MessageType;
use sketchnav_schemas::message::Odometry;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sim::robots;
use sketchnav_stage::{Instant, Navigator, Outbox, Stage, StageError};

const KIND: &str = "curious";

const SITUATION: Channel<Odometry> = Channel::of(&ChannelSpec {
    name: "something",
    writer: Some(Process::Localizer),
    readers: &[Process::Planner],
    role: Role::Situation,
    kind: Some(KIND),
    per_tick: 1,
    max_cells: 0,
    message: MessageType::of::<Odometry>(),
});

const NAVIGATOR: Navigator = Navigator {
    channels: &[SITUATION.spec],
    ..Navigator::new(
        KIND,
        "looks at the truth",
        [
            |_, _| Ok(Box::new(Curious(Process::Sketcher))),
            |_, _| Ok(Box::new(Curious(Process::Localizer))),
            |_, _| Ok(Box::new(Curious(Process::Planner))),
        ],
    )
};

const MISSION: &str = r#"
name = "any"
robot = "robotino"
[world]
floor_plan = "floor"
[start]
world = [0.9, 6.15]
world_heading_deg = 0.0
[navigator]
kind = "curious"
[[task]]
name = "there"
"#;

struct Curious(Process);

impl Stage for Curious {
    const FORM: &'static str = "curious 1";
    type State = ();

    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        match self.0 {
            Process::Localizer => out.send(SITUATION, |_| ()).map(drop),
            _ => Ok(instant.newest(TRUTH).map(drop)?),
        }
    }

    fn state(&self) -> impl serde::Serialize {}

    fn restore(&mut self, (): ()) -> Result<(), StageError> {
        Ok(())
    }
}

struct Nobody;

impl Tap for Nobody {
    fn see(&mut self, _: &'static ChannelSpec, _: &[u8], _: &[u8]) {}
}

impl Onlooker for Nobody {}

/// Regression test: in a single process, every stage could reach the world's memory. A rehearsal used to hand the truth to any
/// stage that asked.
#[test]
fn a_navigator_that_asks_for_the_truth_fails_at_once() {
    sketchnav_navigators::register(&[NAVIGATOR]).unwrap();
    let mut mission = Mission::parse(MISSION).unwrap();
    let floor =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../sim/missions/laboratory/laboratory.floor.toml");
    mission.world.floor_plan = floor.to_str().map(str::to_owned);
    let robot = robots::find(&mission.robot).unwrap().unwrap();
    let run = RunConfig::lockstep("denied", mission, robot, 1);
    let error = Rehearsal::new(&run).unwrap().run(&mut Nobody).unwrap_err();
    assert_eq!(
        error.to_string(),
        "channel \"truth\": expected one that the planner of navigator \"curious\" reads, \
         found one of all navigators, read by no process"
    );
}

//! Stages under their host: how they answer after their process was killed, or their state was lost or rejected.

use std::fs::OpenOptions;
use std::os::unix::fs::FileExt;

use sketchnav_schemas::channels::{COMMAND, TRUTH};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::message::Header;
use sketchnav_sketch::messages::{ESTIMATE, PoseEstimate};
use sketchnav_stage::{Instant, Outbox, Stage as NavigatorStage, StageError};

use crate::stage::{Player, Stage};

/// A stage that counts the ticks it answers, as a localizer or as a planner.
pub struct Counter {
    process: Process,
    count: u32,
    refuses: bool,
}

impl Counter {
    /// Creates a counter, which rejects any state if `refuses` is true.
    pub fn new(process: Process, refuses: bool) -> Self {
        Self { process, count: 0, refuses }
    }
}

impl NavigatorStage for Counter {
    const FORM: &'static str = "counter 1";
    type State = u32;

    /// Notifies the test that the channels are open.
    fn announce(&mut self, _: &mut Outbox<'_>) -> Result<(), StageError> {
        println!("\n> open");
        Ok(())
    }

    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        self.count += 1;
        match self.process {
            Process::Planner => {
                assert!(instant.newest(ESTIMATE)?.is_some());
                out.send(COMMAND, |command| command.last = self.count)?
            }
            _ => out.send(ESTIMATE, |estimate| {
                let header = estimate.header;
                fill_estimate(estimate, header, self.count);
            })?,
        };
        Ok(())
    }

    fn state(&self) -> impl serde::Serialize {
        self.count
    }

    fn restore(&mut self, count: u32) -> Result<(), StageError> {
        if self.refuses {
            return Err(format!("expected no state, found {count}").into());
        }
        self.count = count;
        Ok(())
    }
}

/// A stage that asks for a channel that no navigator may read.
pub struct Curious;

impl NavigatorStage for Curious {
    const FORM: &'static str = "curious 1";
    type State = ();

    /// Notifies the test that the channels are open.
    fn announce(&mut self, _: &mut Outbox<'_>) -> Result<(), StageError> {
        println!("\n> open");
        Ok(())
    }

    fn step(&mut self, instant: &Instant<'_>, _: &mut Outbox<'_>) -> Result<(), StageError> {
        instant.newest(TRUTH)?;
        Ok(())
    }

    fn state(&self) -> impl serde::Serialize {}

    fn restore(&mut self, (): ()) -> Result<(), StageError> {
        Ok(())
    }
}

/// Fills in a valid estimate.
pub fn fill_estimate(estimate: &mut PoseEstimate, header: Header, count: u32) {
    (estimate.header, estimate.particle_count) = (header, count);
    estimate.pose.orientation_w = 1.0;
    estimate.odometry.orientation_w = 1.0;
}

fn hosting(stage: &Stage, system: &str, process: Process, order: &str) -> Player {
    let mut host = stage.join(system, process, &[]);
    host.does_as(order, "open");
    host
}

/// Returns the answers to `ticks`, the first of which has the number `seq`, by a stage that had counted `count` ticks before.
fn told(ticks: std::ops::RangeInclusive<u64>, seq: u64, count: u64) -> String {
    let first = *ticks.start();
    let one = |tick| format!("{tick}:{}:{}", seq + tick - first, count + tick - first);
    ticks.map(one).collect::<Vec<_>>().join(" ")
}

/// Overwrites the version in each file of a checkpoint.
fn damage_checkpoints(stage: &Stage, system: &str) {
    let files = [0, 1].map(|slot| stage.shared_memory(system, &format!("checkpoint_localizer_{slot}")));
    for path in files.concat() {
        OpenOptions::new().write(true).open(path).unwrap().write_all_at(&[0; 8], 0).unwrap();
    }
}

#[test]
fn a_killed_stage_answers_each_tick_once() {
    let stage = Stage::new();
    let mut supervisor = stage.system("kill");
    let mut world = stage.join("kill", Process::World, &["tick-writer"]);
    let mut recorder = stage.join("kill", Process::Recorder, &["estimate-reader"]);
    for (from, to) in [(1, 20), (21, 21), (22, 60), (61, 63)] {
        let mut host = hosting(&stage, "kill", Process::Localizer, "host");
        world.tell(&format!("tick {}", to - from + 1));
        assert_eq!(recorder.tell(&format!("estimates {to}")), told(from..=to, from, from));
        host.kill();
        supervisor.does("clear-dead");
    }
}

/// Regression test: a process that had started from scratch, and was killed once more before its next checkpoint, used to
/// answer old ticks a second time.
#[test]
fn a_stage_killed_again_after_a_fresh_start_answers_no_tick_twice() {
    let stage = Stage::new();
    let mut supervisor = stage.system("lost-state");
    let mut world = stage.join("lost-state", Process::World, &["tick-writer"]);
    let mut recorder = stage.join("lost-state", Process::Recorder, &["estimate-reader"]);
    let mut first = hosting(&stage, "lost-state", Process::Localizer, "host");
    world.tell("tick 40");
    assert_eq!(recorder.tell("estimates 40"), told(1..=40, 1, 1));
    first.kill();
    damage_checkpoints(&stage, "lost-state");
    // The first two of these rounds leave no checkpoint, the third leaves one.
    for (from, to, count) in [(41, 43, 1), (44, 46, 1), (47, 70, 1), (71, 72, 25)] {
        supervisor.does("clear-dead");
        let mut host = hosting(&stage, "lost-state", Process::Localizer, "host");
        world.tell(&format!("tick {}", to - from + 1));
        assert_eq!(recorder.tell(&format!("estimates {to}")), told(from..=to, from, count));
        host.kill();
    }
}

/// Regression test: this used to end the mission, because the error was attributed to the mission, and a restart cannot fix that.
#[test]
fn a_stage_that_refuses_its_state_starts_fresh() {
    let stage = Stage::new();
    let mut supervisor = stage.system("refused");
    let mut world = stage.join("refused", Process::World, &["tick-writer"]);
    let mut recorder = stage.join("refused", Process::Recorder, &["estimate-reader"]);
    let mut first = hosting(&stage, "refused", Process::Localizer, "host");
    world.tell("tick 40");
    assert_eq!(recorder.tell("estimates 40"), told(1..=40, 1, 1));
    first.kill();
    for count in [32, 16] {
        supervisor.does("clear-dead");
        let mut host = stage.join("refused", Process::Localizer, &[]);
        let error = host.tell("host-refusing");
        let expected = format!("checkpoint refused: expected no state, found {count}");
        assert!(error.starts_with("error ") && error.ends_with(&expected), "{error}");
        host.kill();
    }
    supervisor.does("clear-dead");
    let _host = hosting(&stage, "refused", Process::Localizer, "host-refusing");
    world.tell("tick 2");
    assert_eq!(recorder.tell("estimates 42"), told(41..=42, 41, 1));
}

/// Regression test: a planner that had fallen behind, as can happen in real time, mistook an estimate for that of the first
/// tick that was still there. From then on, each estimate was paired with the wrong tick.
#[test]
fn after_an_overflow_each_answer_still_belongs_to_its_tick() {
    let stage = Stage::new();
    let _supervisor = stage.system("overslept");
    let mut world = stage.join("overslept", Process::World, &["tick-writer"]);
    let mut localizer = stage.join("overslept", Process::Localizer, &["estimate-writer"]);
    let mut recorder = stage.join("overslept", Process::Recorder, &["command-reader"]);
    // Of 300 ticks, the history keeps 173 to 300. Of the estimates, it keeps all.
    world.tell("tick 300");
    for tick in (100..=103).chain(171..=174).chain(298..=300) {
        localizer.does(&format!("estimate {tick}"));
    }
    let _host = hosting(&stage, "overslept", Process::Planner, "host");
    world.tell("refresh");
    localizer.tell("refresh");
    let expected = [173, 174, 298, 299, 300];
    let expected: Vec<_> =
        expected.iter().enumerate().map(|(i, tick)| format!("{tick}:{0}:{0}", i + 1)).collect();
    assert_eq!(recorder.tell("commands 300"), expected.join(" "));
}

/// Regression test: such a stage used to wait forever for a first message, which it never got.
#[test]
fn a_stage_that_opens_a_forbidden_channel_fails_with_its_name() {
    let stage = Stage::new();
    let _supervisor = stage.system("curious");
    let mut world = stage.join("curious", Process::World, &["tick-writer"]);
    let mut host = hosting(&stage, "curious", Process::Localizer, "host-curious");
    world.tell("tick 1");
    assert_eq!(
        host.answer(),
        "stage: channel \"truth\": expected one that the localizer of navigator \"sketch\" reads, \
         found one of all navigators, read by no process"
    );
}

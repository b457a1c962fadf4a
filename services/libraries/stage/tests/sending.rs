//! Tests what a stage sends: messages whose fill function fails, and responses that are missing or sent twice.

use serde::Serialize;
use sketchnav_schemas::channels::{COMMAND, STATUS};
use sketchnav_schemas::codes::Process;
use sketchnav_stage::{Access, InProcess, Instant, Outbox, Stage, StageError, Unanswered, step};

/// The failed message used to overwrite the latest one, and was counted.
#[test]
fn a_message_whose_filling_fails_is_not_sent() {
    let mut memory = InProcess::of_writer(Process::Planner, "sketch");
    let mut out = Outbox::new(&mut memory, 7, 3);
    assert_eq!(out.send(COMMAND, |command| command.twist.vx_mps = 0.2).unwrap(), 1);
    let failed = out.send_bytes(COMMAND.spec, 0, |message, _| {
        message.fill(1);
        Err("no wall".into())
    });
    assert_eq!(failed.unwrap_err().to_string(), "no wall");
    assert_eq!(out.last(COMMAND).unwrap(), 1);
    let command = |memory: &InProcess| {
        let newest = memory.get(COMMAND.spec).unwrap();
        let command = COMMAND.message(COMMAND.spec, newest.bytes()).unwrap();
        (command.header.seq, command.header.stamp_ns, command.twist.vx_mps, command.twist.vy_mps)
    };
    assert_eq!(command(&memory), (1, 7, 0.2, 0.0));
    Outbox::new(&mut memory, 8, 4).send(COMMAND, |command| command.twist.vx_mps = 0.1).unwrap();
    assert_eq!(command(&memory), (2, 8, 0.1, 0.0), "all zero before it was filled");
}

/// A planner that sends the given numbers of commands and statuses.
struct Planner {
    commands: u32,
    statuses: u32,
}

impl Stage for Planner {
    const FORM: &'static str = "test planner 1";
    type State = ();

    fn step(&mut self, _: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        for _ in 0..self.commands {
            out.send(COMMAND, |_| {})?;
        }
        for _ in 0..self.statuses {
            out.send(STATUS, |_| {})?;
        }
        Ok(())
    }

    fn state(&self) -> impl Serialize {}

    fn restore(&mut self, (): ()) -> Result<(), StageError> {
        Ok(())
    }
}

/// If a response was missing, the other processes used to wait for it until the mission was reported as stuck, without naming the
/// process. A second response went unnoticed.
#[test]
fn a_step_sends_exactly_one_message_on_each_channel_that_responds_to_the_instant() {
    let (inputs, access) =
        (InProcess::of_reader(Process::Planner, "sketch"), Access::new(Process::Planner, "sketch"));
    let take = |memory: &mut InProcess, tick, commands, statuses| {
        let instant = Instant::new(&access, tick, 7, &inputs);
        step(&mut Planner { commands, statuses }, &instant, &mut Outbox::new(memory, 7, tick))
    };
    let wrong = [(0, 1, COMMAND.spec.name, 0), (1, 0, STATUS.spec.name, 0), (2, 1, COMMAND.spec.name, 2)];
    for (commands, statuses, channel, found) in wrong {
        let mut memory = InProcess::of_writer(Process::Planner, "sketch");
        take(&mut memory, 99, 0, 0).expect("it may lack a reading");
        take(&mut memory, 100, 1, 1).unwrap();
        let error = take(&mut memory, 101, commands, statuses).unwrap_err();
        let expected = Unanswered { process: Process::Planner, tick: 101, channel, found };
        assert_eq!(*error.downcast::<Unanswered>().unwrap(), expected);
    }
}

//! Messages whose fill function fails.

use sketchnav_schemas::channels::COMMAND;
use sketchnav_schemas::codes::Process;
use sketchnav_stage::{InProcess, Outbox};

/// The latest message used to be overwritten, and the failed one was counted.
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

//! Reports the duration of each stage for each tick on a separate channel, so that these figures are recorded, as the health
//! reports are. health.

use sketchnav_runtime::{Node, Result, SendTimes, Sent, Writer};
use sketchnav_schemas::channels::{COMMAND, LATENCY, Role, TICK, of_role};
use sketchnav_schemas::message::{Header, Latency};

/// Reads when ticks, situations and commands were sent, and publishes the delays.
pub(crate) struct Latencies {
    ticks: SendTimes,
    /// `None` if the navigator has no such channel.
    situations: Option<SendTimes>,
    commands: SendTimes,
    /// The last command that was examined.
    command: u64,
    /// The last tick that was reported, by this process or an earlier one.
    tick: u64,
    writer: Writer<Latency>,
}

impl Latencies {
    pub(crate) fn open(node: &Node, kind: &str) -> Result<Self> {
        let situations = of_role(Role::Situation, kind);
        let mut writer = node.writer(LATENCY)?;
        let tick = writer.last_sent().map_or(0, |last| last.header.source_seq);
        writer.resume_after_history();
        Ok(Self {
            ticks: SendTimes::open(node, TICK.spec)?,
            situations: situations.map(|spec| SendTimes::open(node, spec)).transpose()?,
            commands: SendTimes::open(node, COMMAND.spec)?,
            command: 0,
            tick,
            writer,
        })
    }

    /// Reports every command since the last call, except those that are too old to be looked up.
    pub(crate) fn send(&mut self) -> Result<()> {
        let newest = self.commands.newest();
        let oldest = newest.saturating_sub(COMMAND.spec.history() as u64) + 1;
        for seq in oldest.max(self.command + 1)..=newest {
            let Some(command) = self.commands.of(seq) else { continue };
            let source_seq = command.header.source_seq;
            let situation = self.situations.as_ref().and_then(|times| times.caused_by(source_seq));
            if source_seq > self.tick
                && let Some(latency) = self
                    .ticks
                    .of(source_seq)
                    .zip(situation)
                    .and_then(|(tick, situation)| of(&tick, &situation, &command))
            {
                self.writer.send(|message| *message = latency)?;
                self.tick = source_seq;
            }
        }
        self.command = newest;
        Ok(())
    }
}

/// Returns `None` if an effect was sent before its cause, which happens if a dead writer's number is used again.
fn of(tick: &Sent, situation: &Sent, command: &Sent) -> Option<Latency> {
    let header = Header { seq: 0, source_seq: tick.header.seq, ..tick.header };
    let situation_ns = situation.at_ns.checked_sub(tick.at_ns)?;
    let command_ns = command.at_ns.checked_sub(situation.at_ns)?;
    Some(Latency { header, situation_ns, command_ns })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sent(seq: u64, source_seq: u64, at_ns: u64) -> Sent {
        Sent { header: Header { seq, stamp_ns: 700, source_seq }, at_ns }
    }

    #[test]
    fn latencies_are_measured_from_the_input_of_each_stage() {
        let (scan, estimate, command) = (sent(7, 7, 1000), sent(5, 7, 1300), sent(6, 7, 1350));
        let header = Header { seq: 0, stamp_ns: 700, source_seq: 7 };
        let expected = Latency { header, situation_ns: 300, command_ns: 50 };
        assert_eq!(of(&scan, &estimate, &command), Some(expected));
        assert_eq!(of(&command, &estimate, &scan), None);
    }
}

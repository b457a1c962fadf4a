//! How long the navigators take for each scan, told on a channel of its own: what a person sees of it is in the
//! recording, beside the health.

use sketchnav_runtime::{Node, Result, SendTimes, Sent, Writer};
use sketchnav_schemas::channels::{COMMAND, ESTIMATE, LATENCY, SCAN};
use sketchnav_schemas::message::{Header, LaserScan, Latency, PoseEstimate, VelocityCommand};

/// Reads when scans, estimates and commands were sent, and tells the differences.
pub(crate) struct Latencies {
    scans: SendTimes<LaserScan>,
    estimates: SendTimes<PoseEstimate>,
    commands: SendTimes<VelocityCommand>,
    /// The last command that was looked at.
    command: u64,
    /// The last scan that was told of, by a predecessor too.
    scan: u64,
    writer: Writer<Latency>,
}

impl Latencies {
    pub(crate) fn open(node: &Node) -> Result<Self> {
        let mut writer = node.writer(LATENCY)?;
        let scan = writer.last_kept().map_or(0, |last| last.header.source_seq);
        writer.resume_behind_kept();
        Ok(Self {
            scans: SendTimes::open(node, SCAN)?,
            estimates: SendTimes::open(node, ESTIMATE)?,
            commands: SendTimes::open(node, COMMAND)?,
            command: 0,
            scan,
            writer,
        })
    }

    /// Tells of every command since the last time. What is too long ago to be looked up is left out.
    pub(crate) fn tell(&mut self) -> Result<()> {
        let newest = self.commands.newest();
        let oldest = newest.saturating_sub(COMMAND.spec.history as u64) + 1;
        for seq in oldest.max(self.command + 1)..=newest {
            let Some(command) = self.commands.of(seq) else { continue };
            let source_seq = command.header.source_seq;
            let (scan, estimate) = (self.scans.of(source_seq), self.estimates.caused_by(source_seq));
            if source_seq > self.scan
                && let Some(latency) =
                    scan.zip(estimate).and_then(|(scan, estimate)| of(&scan, &estimate, &command))
            {
                self.writer.send(|message| *message = latency)?;
                self.scan = source_seq;
            }
        }
        self.command = newest;
        Ok(())
    }
}

/// `None` where the clock says that an effect was before its cause: a dead writer's number was given anew.
fn of(scan: &Sent, estimate: &Sent, command: &Sent) -> Option<Latency> {
    let header = Header { seq: 0, source_seq: scan.header.seq, ..scan.header };
    let estimate_ns = estimate.at_ns.checked_sub(scan.at_ns)?;
    let command_ns = command.at_ns.checked_sub(estimate.at_ns)? + estimate_ns;
    Some(Latency { header, estimate_ns, command_ns })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sent(seq: u64, source_seq: u64, at_ns: u64) -> Sent {
        Sent { header: Header { seq, stamp_ns: 700, source_seq }, at_ns }
    }

    #[test]
    fn both_are_counted_from_the_scan() {
        let (scan, estimate, command) = (sent(7, 7, 1000), sent(5, 7, 1300), sent(6, 7, 1350));
        let header = Header { seq: 0, stamp_ns: 700, source_seq: 7 };
        let expected = Latency { header, estimate_ns: 300, command_ns: 350 };
        assert_eq!(of(&scan, &estimate, &command), Some(expected));
        assert_eq!(of(&command, &estimate, &scan), None);
    }
}

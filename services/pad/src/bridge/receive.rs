//! Receives messages for the machine from the channels that are common to all kinds of navigators.

use sketchnav_runtime::{Node, Reader};
use sketchnav_schemas::channels::{FAULTS, HEALTH, STATUS, UNDERSTOOD};
use sketchnav_schemas::message::{Fault, Health, MissionStatus, Understood};

/// A message for the machine.
pub(super) enum News {
    Status(MissionStatus),
    Understood(Understood),
    Fault(Fault),
    Health(Box<Health>),
}

/// The pad's own readers.
pub(super) struct Inbox {
    statuses: Reader<MissionStatus>,
    faults: Reader<Fault>,
    health: Reader<Health>,
    /// The sketcher's answers.
    pub(super) understood: Reader<Understood>,
}

impl Inbox {
    pub(super) fn open(node: &Node) -> anyhow::Result<Self> {
        Ok(Self {
            statuses: node.reader(STATUS)?,
            faults: node.reader(FAULTS)?,
            health: node.reader(HEALTH)?,
            understood: node.reader(UNDERSTOOD)?,
        })
    }

    /// The next message. Statuses that the planner sent before the sketcher's answer come before it.
    pub(super) fn next(&mut self) -> anyhow::Result<Option<News>> {
        if let Some(fault) = self.faults.receive()? {
            return Ok(Some(News::Fault(*fault)));
        }
        if let Some(health) = self.health.receive()? {
            return Ok(Some(News::Health(Box::new(*health))));
        }
        if let Some(status) = self.statuses.receive()? {
            return Ok(Some(News::Status(*status)));
        }
        Ok(self.understood.receive()?.map(|answer| News::Understood(*answer)))
    }
}

//! Each word that the machine has to hear, out of the channels that every kind of navigator has.

use sketchnav_runtime::{Node, Reader};
use sketchnav_schemas::channels::{FAULTS, HEALTH, STATUS, UNDERSTOOD};
use sketchnav_schemas::message::{Fault, Health, MissionStatus, Understood};

/// Something that the machine has to hear.
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
    /// What the sketcher says to what was sent.
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

    /// The next word. What the planner said before the sketcher's answer comes before it.
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

//! The channels that a recording is played into, each written in the name of its own process.

use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Duration;

use anyhow::Context;
use sketchnav_recordings::reader::RawMessage;
use sketchnav_runtime::{Node, SliceWriter, System, Wake, Writer};
use sketchnav_schemas::channels::{self, Channel, ChannelVisitor};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::message::Header;
use sketchnav_schemas::ros2::Ros2;
use sketchnav_supervisor::Supervisor;

use super::plan::{Plan, speaker};

/// What is added to numbers and stamps, so that they go on after a jump back.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Shift {
    /// To the number of the scan that is the cause.
    pub scans: u64,
    /// To the stamp, nanoseconds.
    pub ns: u64,
}

impl Shift {
    fn of(self, header: &Header) -> Header {
        Header {
            seq: header.seq,
            stamp_ns: header.stamp_ns + self.ns,
            source_seq: if header.source_seq == 0 { 0 } else { header.source_seq + self.scans },
        }
    }
}

/// A channel that is played into.
trait Port {
    fn play(&mut self, message: &RawMessage, shift: Shift) -> anyhow::Result<()>;
}

struct Fixed<T: Ros2> {
    writer: Writer<T>,
    is_numbered: bool,
    /// What is added to the numbers.
    ahead: u64,
}

impl<T: Ros2> Port for Fixed<T> {
    fn play(&mut self, raw: &RawMessage, shift: Shift) -> anyhow::Result<()> {
        let (message, _) = raw.typed::<T>()?;
        if self.is_numbered {
            // After a jump back the numbers go on; after one forward they show what was left out.
            if message.header().seq + self.ahead <= self.writer.last_seq() {
                self.ahead = self.writer.last_seq() + 1 - message.header().seq;
            }
            self.writer.resume_after(message.header().seq + self.ahead - 1);
        }
        let mut loan = self.writer.loan()?;
        *loan = message;
        *loan.header_mut() = shift.of(message.header());
        loan.send()?;
        Ok(())
    }
}

struct Sliced<T: Ros2> {
    writer: SliceWriter<T>,
}

impl<T: Ros2> Port for Sliced<T> {
    fn play(&mut self, raw: &RawMessage, shift: Shift) -> anyhow::Result<()> {
        let (message, cells) = raw.typed::<T>()?;
        let mut loan = self.writer.loan(cells.len())?;
        *loan.message_mut() = message;
        *loan.message_mut().header_mut() = shift.of(message.header());
        loan.bytes_mut().copy_from_slice(&cells);
        loan.send()?;
        Ok(())
    }
}

/// The channels, by the topic of the recording that is played into each.
pub struct Ports {
    ports: BTreeMap<String, Box<dyn Port>>,
    /// Behind the ports, which are to go first.
    nodes: BTreeMap<Process, Node>,
}

impl Ports {
    /// Opens the channels that are played into; those of the supervisor by its own node.
    pub fn open(system: &str, plan: &Plan, supervisor: &Supervisor) -> anyhow::Result<Self> {
        let ports = Self { ports: BTreeMap::new(), nodes: BTreeMap::new() };
        let mut open = Open { system, plan, supervisor, ports };
        channels::visit(&mut open)?;
        Ok(open.ports)
    }

    /// Sends a message.
    pub fn play(&mut self, message: &RawMessage, shift: Shift) -> anyhow::Result<()> {
        let Some(port) = self.ports.get_mut(&message.topic.name) else { return Ok(()) };
        port.play(message, shift)
            .with_context(|| format!("{} message {}", message.topic.name, message.sequence))
    }

    /// Sleeps, and hands what was sent before to readers that have come; whether the process is to end.
    pub fn nap(&self, timeout: Duration) -> Wake {
        let mut wake = Wake::Timeout;
        for (i, node) in self.nodes.values().enumerate() {
            wake = node.nap(if i == 0 { timeout } else { Duration::ZERO });
        }
        wake
    }
}

struct Open<'a> {
    system: &'a str,
    plan: &'a Plan,
    supervisor: &'a Supervisor,
    ports: Ports,
}

impl Open<'_> {
    /// The topic of the recording that is played into a channel, where one is, and who writes it.
    fn source<T: Ros2>(&self, channel: Channel<T>) -> Option<(String, Process)> {
        Some((self.plan.topic_of(channel.spec)?.to_owned(), speaker(channel.spec)))
    }

    fn node(&mut self, process: Process) -> anyhow::Result<&Node> {
        if process == Process::Supervisor {
            return self.supervisor.node().context("the system has ended");
        }
        if !self.ports.nodes.contains_key(&process) {
            let system = Rc::new(System::open(self.system)?);
            let node = Node::join(system, process).with_context(|| format!("speaking for the {process}"))?;
            self.ports.nodes.insert(process, node);
        }
        Ok(&self.ports.nodes[&process])
    }
}

impl ChannelVisitor for Open<'_> {
    type Error = anyhow::Error;

    fn fixed<T: Ros2>(&mut self, channel: Channel<T>) -> anyhow::Result<()> {
        if let Some((topic, process)) = self.source(channel) {
            let writer = self.node(process)?.writer(channel)?;
            let is_numbered = channel.spec.writer.is_some();
            self.ports.ports.insert(topic, Box::new(Fixed { writer, is_numbered, ahead: 0 }));
        }
        Ok(())
    }

    fn sliced<T: Ros2>(&mut self, channel: Channel<T>) -> anyhow::Result<()> {
        if let Some((topic, process)) = self.source(channel) {
            let writer = self.node(process)?.slice_writer(channel)?;
            self.ports.ports.insert(topic, Box::new(Sliced { writer }));
        }
        Ok(())
    }
}

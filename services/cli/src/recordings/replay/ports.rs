//! The channels that a recording is played into. Each is written in the name of the process that it belongs to.

use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Duration;

use anyhow::Context;
use sketchnav_recordings::reader::RawMessage;
use sketchnav_recordings::rejected::Rejections;
use sketchnav_runtime::{Node, RawWriter, System, Wake};
use sketchnav_schemas::channels::{self, HEALTH, Role};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::erased::{self, Owned};
use sketchnav_schemas::message::{Header, Health};
use sketchnav_supervisor::Supervisor;

use super::plan::{Plan, speaker};

/// Offsets for numbers and timestamps, so that they keep increasing after a jump back.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Shift {
    /// Added to the number of the tick that caused a message.
    pub ticks: u64,
    /// Added to the timestamp, in nanoseconds.
    pub ns: u64,
}

impl Shift {
    fn of(self, header: &Header) -> Header {
        Header {
            seq: header.seq,
            stamp_ns: header.stamp_ns + self.ns,
            source_seq: if header.source_seq == 0 { 0 } else { header.source_seq + self.ticks },
        }
    }
}

/// A channel that messages are played into.
struct Port {
    writer: RawWriter,
    /// The process in whose name the channel is written.
    process: Process,
    /// Added to the sequence numbers.
    ahead: u64,
}

impl Port {
    fn play(&mut self, node: &Node, message: &Owned, shift: Shift) -> anyhow::Result<()> {
        let spec = self.writer.spec();
        let header = erased::header(message.bytes());
        if spec.writer.is_some() && !spec.is_latched() {
            // After a jump back, the numbers continue. After a jump forward, the gap shows what was skipped.
            if header.seq + self.ahead <= self.writer.last_seq() {
                self.ahead = self.writer.last_seq() + 1 - header.seq;
            }
            self.writer.resume_after(header.seq + self.ahead - 1);
        }
        let mut loan = self.writer.loan(message.cells().len())?;
        let (bytes, cells) = loan.parts_mut();
        bytes.copy_from_slice(message.bytes());
        cells.copy_from_slice(message.cells());
        *erased::header_mut(bytes) = shift.of(header);
        if spec.role == Role::Tick {
            // Sensors whose channels are not played have no readings, so the tick must not name any of theirs.
            node.name_readings(bytemuck::from_bytes_mut(bytes));
        }
        loan.send()?;
        Ok(())
    }
}

/// The channels, keyed by the topic that is played into each of them.
pub struct Ports {
    ports: BTreeMap<String, Port>,
    /// The nodes that own the ports. Declared after `ports`, which must be dropped first.
    nodes: BTreeMap<Process, Node>,
    /// The processes that run live.
    live: Vec<Process>,
    not_played: Rejections,
    invalid: Rejections,
}

impl Ports {
    /// Opens the channels that are played into. The supervisor's own channels are opened through its node.
    pub fn open(
        system: &str,
        plan: &Plan,
        live: &[Process],
        supervisor: &Supervisor,
    ) -> anyhow::Result<Self> {
        let mut ports = Self {
            ports: BTreeMap::new(),
            nodes: BTreeMap::new(),
            live: live.to_vec(),
            not_played: Rejections::default(),
            invalid: Rejections::default(),
        };
        for spec in channels::all() {
            let Some(topic) = plan.topic_of(spec) else { continue };
            let process = speaker(spec);
            if process != Process::Supervisor && !ports.nodes.contains_key(&process) {
                let system = Rc::new(System::open(system)?);
                let node =
                    Node::join(system, process).with_context(|| format!("joining as the {process}"))?;
                ports.nodes.insert(process, node);
            }
            let node = node_of(&ports.nodes, process, supervisor)?;
            let port = Port { writer: node.raw_writer(spec)?, process, ahead: 0 };
            ports.ports.insert(topic.to_owned(), port);
        }
        Ok(ports)
    }

    /// Sends a message.
    pub fn play(
        &mut self,
        message: &RawMessage,
        shift: Shift,
        supervisor: &Supervisor,
    ) -> anyhow::Result<()> {
        let Some(port) = self.ports.get_mut(&message.topic.name) else { return Ok(()) };
        let node = node_of(&self.nodes, port.process, supervisor)?;
        let decoded = match message.decode(port.writer.spec()) {
            Err(error) if error.is_one_message() => {
                self.not_played.count_undecoded(message, &error);
                return Ok(());
            }
            decoded => decoded?,
        };
        // Readers would mistake the recorded health of a live process for that of a second instance, so it is not played.
        if port.writer.spec() == HEALTH.spec {
            let health: &Health = bytemuck::from_bytes(decoded.bytes());
            if self.live.iter().any(|process| process.code() == health.process) {
                return Ok(());
            }
        }
        self.invalid.check(message, port.writer.spec(), decoded.bytes());
        port.play(node, &decoded, shift)
            .with_context(|| format!("{} message {}", message.topic.name, message.sequence))
    }

    /// Returns the messages that were not sent because they could not be decoded.
    pub fn not_played(&self) -> &Rejections {
        &self.not_played
    }

    /// Returns the messages that were sent but are invalid, so that every reader rejects them.
    pub fn invalid(&self) -> &Rejections {
        &self.invalid
    }

    /// Sleeps, and passes earlier messages to readers that have joined. Returns true if the process was asked
    /// to end.
    pub fn nap(&self, timeout: Duration) -> Wake {
        let mut wake = Wake::Timeout;
        for (i, node) in self.nodes.values().enumerate() {
            wake = node.nap(if i == 0 { timeout } else { Duration::ZERO });
        }
        wake
    }
}

fn node_of<'a>(
    nodes: &'a BTreeMap<Process, Node>,
    process: Process,
    supervisor: &'a Supervisor,
) -> anyhow::Result<&'a Node> {
    match nodes.get(&process) {
        Some(node) => Ok(node),
        None => supervisor.node().context("the system has ended"),
    }
}

//! Measures the activity on the channels of a running system: rates, sizes, and the connected processes.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use anyhow::Context;
use serde::Serialize;
use sketchnav_runtime::{Node, Peer, RawReader, SendTimes, System, Wake};
use sketchnav_schemas::channels::{self, ChannelSpec};
use sketchnav_schemas::codes::Process;

use crate::failure::{Failure, OrInput};

/// Interval at which to poll. The buffer of a channel holds the messages that arrive in between.
const LOOK_EVERY: Duration = Duration::from_millis(5);
/// The period over which rates are measured.
const LOOK_FOR: Duration = Duration::from_secs(1);
/// The time to wait before measuring. Writers notice a new reader within a quarter of a second and then hand over their
/// histories, which must not be counted.
const WARM_UP: Duration = Duration::from_millis(300);

/// The figures of a channel.
#[derive(Debug, Serialize)]
pub struct Figures {
    /// The channel's name.
    pub channel: &'static str,
    /// Messages per second, by the wall clock.
    pub rate_hz: f64,
    /// Bytes of shared memory per second.
    pub bytes_per_second: f64,
    /// The number of messages sent so far, or `None` for the channel with several writers.
    pub sent: Option<u64>,
    /// The number of messages in the channel's history.
    pub kept: Option<u64>,
    /// The processes that have the channel open for writing.
    pub writers: Vec<Connected>,
    /// The processes that have the channel open for reading.
    pub readers: Vec<Connected>,
}

/// A process that has a channel open.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Connected {
    /// The process's name. The name of an observer includes its process id, and dead processes are marked as such.
    pub process: String,
    /// The process id, or `None` if the process is dead.
    pub pid: Option<u32>,
}

/// Measures the channels of a system for a second. Also returns its kind of navigator.
pub fn measure(system: System) -> Result<(String, Vec<Figures>), Failure> {
    let kind = system.run_config().or_input()?.mission.navigator_kind().to_owned();
    let name = system.name().to_owned();
    let node = Node::join(system, Process::Observer).with_context(|| format!("joining {name}"))?;
    let specs: Vec<_> = channels::of_kind(&kind).collect();
    // The connected processes are listed before this observer connects, so that it is not among them.
    let peers = specs.iter().map(|spec| node.peers(spec)).collect::<Result<Vec<_>, _>>();
    let peers = peers.context("listing the connected processes")?;
    let mut counted = open(&node, &specs)?;
    look_for(&node, &mut counted, WARM_UP)?;
    counted.iter_mut().for_each(|counted| (counted.messages, counted.bytes) = (0, 0));
    let took_s = look_for(&node, &mut counted, LOOK_FOR)?.as_secs_f64();
    let names = node.system().processes().context("the system's processes")?;
    let names: BTreeMap<_, _> = names.into_iter().map(|(name, pid)| (pid, name)).collect();
    let all =
        counted.iter().zip(peers).map(|(counted, peers)| counted.figures(&node, took_s, &peers, &names));
    Ok((kind, all.collect::<anyhow::Result<_>>()?))
}

/// Counts the messages that arrive, and returns how long that took.
fn look_for(node: &Node, counted: &mut [Counted], time: Duration) -> anyhow::Result<Duration> {
    let began = Instant::now();
    while began.elapsed() < time && node.nap(LOOK_EVERY) != Wake::Terminate {
        counted.iter_mut().try_for_each(Counted::look).context("reading")?;
    }
    Ok(began.elapsed())
}

fn open(node: &Node, specs: &[&'static ChannelSpec]) -> anyhow::Result<Vec<Counted>> {
    let open = |&spec| Ok(Counted { reader: node.raw_reader(spec)?, messages: 0, bytes: 0 });
    let all: sketchnav_runtime::Result<_> = specs.iter().map(open).collect();
    all.context("opening the channels")
}

struct Counted {
    reader: RawReader,
    messages: u64,
    bytes: u64,
}

impl Counted {
    fn look(&mut self) -> sketchnav_runtime::Result<()> {
        while let Some(sample) = self.reader.receive()? {
            self.messages += 1;
            self.bytes += (sample.message().len() + sample.cells().len()) as u64;
        }
        Ok(())
    }

    fn figures(
        &self,
        node: &Node,
        took_s: f64,
        peers: &[Peer],
        names: &BTreeMap<u32, String>,
    ) -> anyhow::Result<Figures> {
        let spec = self.reader.spec();
        let sent = spec.writer.is_some().then(|| SendTimes::open(node, spec)).transpose()?;
        let sent = sent.map(|times| times.newest());
        let connected = |writes: bool| {
            let of_kind = peers.iter().filter(move |peer| peer.writes == writes);
            of_kind
                .filter(|peer| peer.pid != Some(std::process::id()))
                .map(|peer| connected(peer, names))
                .collect()
        };
        Ok(Figures {
            channel: spec.name,
            rate_hz: self.messages as f64 / took_s,
            bytes_per_second: self.bytes as f64 / took_s,
            sent,
            kept: sent.map(|sent| sent.min(spec.history() as u64)),
            writers: connected(true),
            readers: connected(false),
        })
    }
}

fn connected(peer: &Peer, names: &BTreeMap<u32, String>) -> Connected {
    let name = peer.pid.map(|pid| names.get(&pid).cloned().unwrap_or_else(|| format!("process {pid}")));
    Connected { process: name.unwrap_or_else(|| "dead".to_owned()), pid: peer.pid }
}

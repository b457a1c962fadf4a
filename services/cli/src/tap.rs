//! Reads the channels of a running system without disturbing it, and the topics of recordings.

mod echo;
mod field;
mod rate;

use std::collections::BTreeSet;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow};
use sketchnav_recordings::Recording;
use sketchnav_runtime::{Node, RawReader, RawSample, System, Wake};
use sketchnav_schemas::channels::{self, ChannelSpec};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::nearest::nearest;

use crate::args::Tap;
use crate::failure::{Failure, OrInput, Outcome};
use crate::systems;

pub use echo::echo;
pub use rate::hz;

/// Interval at which to poll for messages, since messages do not wake observers.
const LOOK_EVERY: Duration = Duration::from_millis(2);
/// Interval at which to print a rate, and to check whether the system is still running.
const SECOND: Duration = Duration::from_secs(1);

/// Processes the messages of channels.
trait Listener {
    /// Whether to pass on the messages of the channel's history, which all arrive at the same time.
    const HISTORY: bool;
    /// Called once before the first message, with the channels that are read.
    fn begin(&mut self, node: &Node, specs: &[&'static ChannelSpec]) -> Result<(), Failure>;
    fn receive(&mut self, spec: &'static ChannelSpec, sample: &RawSample) -> Result<(), Failure>;
    /// Called once a second, with the number of messages of a channel that have been lost so far.
    fn tick(&mut self, spec: &'static ChannelSpec, lost: u64) -> Result<(), Failure>;
}

/// Number of messages to read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Amount {
    /// This many messages, as they arrive.
    Messages(u64),
    /// A single message: the latest one or, if there is none yet, the first one to arrive.
    Newest,
}

impl Amount {
    /// Returns that number of messages, or all messages if there is no number.
    fn of(count: Option<u64>) -> Self {
        Self::Messages(count.unwrap_or(u64::MAX))
    }
}

/// Passes messages on to the listener until there are enough of them, the system is gone, or the user ends the command.
fn follow<L: Listener>(tap: &Tap, amount: Amount, listener: &mut L) -> Result<Outcome, Failure> {
    let named = tap.channel.as_deref().map(known).transpose()?;
    let system = systems::find(tap.system.as_deref())?;
    let name = system.name().to_owned();
    let kind = system.run_config().or_input()?.mission.navigator_kind().to_owned();
    let specs = chosen(tap, named, &kind)?;
    let node = Node::join(system, Process::Observer).with_context(|| format!("joining {name}"))?;
    listener.begin(&node, &specs)?;
    listen(&node, &specs, amount, listener)?;
    Ok(Outcome::Success)
}

fn known(name: &str) -> Result<&'static ChannelSpec, Failure> {
    let unknown = || match Path::new(name).exists() {
        true => {
            anyhow!(
                "channel {name:?}: found a file; to read a recording: sketchnav echo CHANNEL --file {name}, or hz"
            )
        }
        false => match nearest(name.trim_start_matches('/'), channels::all().map(|spec| spec.name)) {
            Some(meant) => anyhow!("channel {name:?}: no such channel; did you mean {meant}?"),
            None => anyhow!("channel {name:?}: expected one of {}", channels::names()),
        },
    };
    // Names with the leading slash that ROS and recordings use are accepted, too.
    channels::find(name.strip_prefix('/').unwrap_or(name)).ok_or_else(unknown).or_input()
}

/// Returns the names of the selected topics of a recording, whether they are channels of ours or recorded by other
/// software.
fn recorded(recording: &Recording, tap: &Tap) -> Result<Vec<String>, Failure> {
    let plain = |name: &str| name.trim_start_matches('/').to_owned();
    let named = tap.channel.as_deref().map(plain);
    let topics = recording.topics().or_input()?;
    let names = || topics.iter().map(|topic| plain(&topic.name));
    let is_meant = |name: &String| {
        named.as_ref() == Some(name) || tap.regex.as_ref().is_some_and(|regex| regex.is_match(name))
    };
    let meant: BTreeSet<_> =
        topics.iter().filter(|topic| is_meant(&plain(&topic.name))).map(|topic| topic.name.clone()).collect();
    if !meant.is_empty() {
        return Ok(meant.into_iter().collect());
    }
    let (file, names) = (recording.path().display(), names().collect::<Vec<_>>());
    if let Some(named) = &named
        && let Some(meant) = nearest(named, names.iter().map(String::as_str))
    {
        return Err(Failure::Input(anyhow!("{file}: no topic {named:?}; did you mean {meant}?")));
    }
    let names = names.join(", ");
    let found = tap.channel.as_deref().map_or("no match of --regex".to_owned(), |name| format!("{name:?}"));
    Err(Failure::Input(anyhow!("{file}: expected one of {names}, found {found}")))
}

fn chosen(
    tap: &Tap,
    named: Option<&'static ChannelSpec>,
    kind: &str,
) -> Result<Vec<&'static ChannelSpec>, Failure> {
    let known = || channels::names_of_kind(kind);
    if let Some(spec) = named {
        if spec.belongs_to(kind) {
            return Ok(vec![spec]);
        }
        let found = spec.name;
        let error = anyhow!("channel {found:?}: expected one of {} of navigator {kind:?}", known());
        return Err(Failure::Input(error));
    }
    let matches = |spec: &&ChannelSpec| tap.regex.as_ref().is_some_and(|regex| regex.is_match(spec.name));
    let specs: Vec<_> = channels::of_kind(kind).filter(matches).collect();
    match specs.is_empty() {
        true => Err(Failure::Input(anyhow!("--regex: expected a match of {}, found none", known()))),
        false => Ok(specs),
    }
}

/// A channel that is read.
struct Tapped {
    reader: RawReader,
    /// Whether to pass on the messages that arrive. Messages from the history may be skipped.
    counts: bool,
}

fn listen<L: Listener>(
    node: &Node,
    specs: &[&'static ChannelSpec],
    mut amount: Amount,
    listener: &mut L,
) -> Result<(), Failure> {
    let open = |&spec| Ok(Tapped { reader: node.raw_reader(spec)?, counts: L::HISTORY });
    let tapped: anyhow::Result<Vec<_>> = specs.iter().map(open).collect();
    let mut tapped = tapped?;
    let mut tick = Instant::now();
    loop {
        for tapped in &mut tapped {
            receive(tapped, &mut amount, listener)?;
        }
        if amount == Amount::Messages(0) {
            return Ok(());
        }
        if tick.elapsed() >= SECOND {
            tick = Instant::now();
            for Tapped { reader, .. } in &tapped {
                listener.tick(reader.spec(), reader.lost())?;
            }
            if System::open(node.system().name()).is_err() {
                return Ok(());
            }
        }
        if node.nap(LOOK_EVERY) == Wake::Terminate {
            return Ok(());
        }
    }
}

/// Passes on the messages that have arrived, up to the wanted number.
fn receive<L: Listener>(tapped: &mut Tapped, amount: &mut Amount, listener: &mut L) -> Result<(), Failure> {
    let mut came = false;
    let spec = tapped.reader.spec();
    let mut newest = None;
    while *amount != Amount::Messages(0) {
        let Some(sample) = tapped.reader.receive().map_err(anyhow::Error::from)? else { break };
        came = true;
        match amount {
            Amount::Newest => newest = Some(sample),
            Amount::Messages(left) if tapped.counts => {
                listener.receive(spec, &sample)?;
                *left -= 1;
            }
            Amount::Messages(_) => {}
        }
    }
    if let Some(newest) = newest {
        listener.receive(spec, &newest)?;
        *amount = Amount::Messages(0);
    }
    tapped.counts |= came;
    Ok(())
}

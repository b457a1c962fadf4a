//! Looks at the channels of a running system without disturbing it.

use std::time::{Duration, Instant};

use anyhow::{Context, anyhow};
use sketchnav_runtime::{Node, RawSample, System, Wake};
use sketchnav_schemas::channels::{self, ChannelSpec};
use sketchnav_schemas::codes::Process;

use crate::args::Tap;
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::{live, say};
use crate::systems;

/// How often to look: messages wake no observer.
const LOOK_EVERY: Duration = Duration::from_millis(2);
/// How often to see whether the system still runs, and to print a rate.
const SECOND: Duration = Duration::from_secs(1);

/// Prints each message as a JSON object: its number, time and cause, and its ROS 2 form.
pub fn echo(tap: &Tap) -> Result<Outcome, Failure> {
    if let Some(kept) = channels::find(&tap.channel).map(ChannelSpec::history) {
        say!("first the history of {}: up to {kept} messages that were sent before", tap.channel);
    }
    follow(tap, &mut Echo)
}

/// Prints the rate once a second, and the whole at the end.
pub fn hz(tap: &Tap) -> Result<Outcome, Failure> {
    let mut rate = Rate::default();
    let followed = follow(tap, &mut rate);
    let outcome = followed?;
    rate.print("in all")?;
    Ok(outcome)
}

/// What is done with the messages of a channel.
trait Listener {
    /// Whether the channel's history, which comes all at once, counts.
    const HISTORY: bool;
    fn hear(&mut self, spec: &ChannelSpec, sample: &RawSample) -> anyhow::Result<()>;
    /// Called once a second, with the messages lost so far.
    fn tick(&mut self, lost: u64) -> anyhow::Result<()>;
}

struct Echo;

impl Listener for Echo {
    const HISTORY: bool = true;

    fn hear(&mut self, spec: &ChannelSpec, sample: &RawSample) -> anyhow::Result<()> {
        let header = sample.header();
        let form = spec.message.json(sample.message(), sample.cells()).map_err(anyhow::Error::from_boxed)?;
        let line = serde_json::json!({
            "seq": header.seq, "stamp_ns": header.stamp_ns, "source_seq": header.source_seq, "message": form,
        });
        live!("{line}")
    }

    fn tick(&mut self, _lost: u64) -> anyhow::Result<()> {
        Ok(())
    }
}

/// Messages, in wall-clock time and in simulation time.
#[derive(Default)]
struct Rate {
    first: Option<(Instant, u64)>,
    last: Option<(Instant, u64)>,
    count: u64,
    lost: u64,
}

impl Listener for Rate {
    /// The times at which it is handed over tell no rate.
    const HISTORY: bool = false;

    fn hear(&mut self, _: &ChannelSpec, sample: &RawSample) -> anyhow::Result<()> {
        let now = (Instant::now(), sample.header().stamp_ns);
        self.first.get_or_insert(now);
        self.last = Some(now);
        self.count += 1;
        Ok(())
    }

    fn tick(&mut self, lost: u64) -> anyhow::Result<()> {
        self.lost = lost;
        self.print("so far")
    }
}

impl Rate {
    fn print(&self, when: &str) -> anyhow::Result<()> {
        let (Some((first, first_ns)), Some((last, last_ns))) = (self.first, self.last) else {
            return live!("{when}: no message");
        };
        let intervals = self.count.saturating_sub(1) as f64;
        let wall = intervals / (last - first).as_secs_f64().max(1e-9);
        let simulated = intervals / (last_ns.saturating_sub(first_ns) as f64 / 1e9).max(1e-9);
        let (count, lost) = (self.count, self.lost);
        if intervals == 0.0 {
            live!("{when}: 1 message")
        } else {
            live!(
                "{when}: {wall:.1} messages a second, {simulated:.2} a simulated second; {count} seen, {lost} missed"
            )
        }
    }
}

/// Hands on what comes until the count is full, the system is gone or the user has enough.
fn follow<L: Listener>(tap: &Tap, listener: &mut L) -> Result<Outcome, Failure> {
    let Some(spec) = channels::find(&tap.channel) else {
        let (found, known) = (&tap.channel, channels::names());
        return Err(Failure::Input(anyhow!("channel {found:?}: expected one of {known}")));
    };
    let system = systems::find(tap.system.as_deref())?;
    let name = system.name().to_owned();
    let kind = system.run_config().or_input()?.mission.navigator_kind().to_owned();
    if !spec.belongs_to(&kind) {
        let (found, known) = (spec.name, channels::names_of_kind(&kind));
        return Err(Failure::Input(anyhow!(
            "channel {found:?}: expected one of {known} of navigator {kind:?}"
        )));
    }
    let node = Node::join(system, Process::Observer).with_context(|| format!("joining {name}"))?;
    listen(&node, spec, tap.count, listener)?;
    Ok(Outcome::Success)
}

fn listen<L: Listener>(
    node: &Node,
    spec: &'static ChannelSpec,
    count: Option<u64>,
    listener: &mut L,
) -> anyhow::Result<()> {
    let mut reader = node.raw_reader(spec)?;
    let (mut seen, mut tick) = (0, Instant::now());
    let mut counts = L::HISTORY;
    loop {
        let mut came = false;
        while let Some(sample) = reader.receive()? {
            came = true;
            if counts {
                listener.hear(spec, &sample)?;
                seen += 1;
            }
            if count == Some(seen) {
                return Ok(());
            }
        }
        counts |= came;
        if tick.elapsed() >= SECOND {
            tick = Instant::now();
            listener.tick(reader.lost())?;
            if System::open(node.system().name()).is_err() {
                return Ok(());
            }
        }
        if node.nap(LOOK_EVERY) == Wake::Terminate {
            return Ok(());
        }
    }
}

//! Looks at the channels of a running system without disturbing it.

use std::time::{Duration, Instant};

use anyhow::{Context, anyhow};
use sketchnav_runtime::{Node, System, Wake};
use sketchnav_schemas::channels::{self, Channel, ChannelVisitor, TABLE};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::ros2::Ros2;

use crate::args::Tap;
use crate::failure::{Failure, Outcome};
use crate::output::{live, say};
use crate::systems;

/// How often to look: messages wake no observer.
const LOOK_EVERY: Duration = Duration::from_millis(2);
/// How often to see whether the system still runs, and to print a rate.
const SECOND: Duration = Duration::from_secs(1);

/// Prints each message as a JSON object: its number, time and cause, and its ROS 2 form.
pub fn echo(tap: &Tap) -> Result<Outcome, Failure> {
    let kept = TABLE.iter().find(|spec| spec.name == tap.channel).map_or(0, |spec| spec.history);
    if kept > 0 {
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
    fn hear<T: Ros2>(&mut self, message: &T, cells: &[u8]) -> anyhow::Result<()>;
    /// Called once a second, with the messages lost so far.
    fn tick(&mut self, lost: u64) -> anyhow::Result<()>;
}

struct Echo;

impl Listener for Echo {
    const HISTORY: bool = true;

    fn hear<T: Ros2>(&mut self, message: &T, cells: &[u8]) -> anyhow::Result<()> {
        let header = message.header();
        let form = serde_json::to_value(message.to_ros2(cells)?)?;
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

    fn hear<T: Ros2>(&mut self, message: &T, _cells: &[u8]) -> anyhow::Result<()> {
        let now = (Instant::now(), message.header().stamp_ns);
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

fn follow(tap: &Tap, listener: &mut impl Listener) -> Result<Outcome, Failure> {
    if !TABLE.iter().any(|spec| spec.name == tap.channel) {
        let known: Vec<_> = TABLE.iter().map(|spec| spec.name).collect();
        return Err(Failure::Input(anyhow!(
            "channel {:?}: expected one of {}",
            tap.channel,
            known.join(", ")
        )));
    }
    let system = systems::find(tap.system.as_deref())?;
    let name = system.name().to_owned();
    let node = Node::join(system, Process::Observer).with_context(|| format!("joining {name}"))?;
    channels::visit(&mut Follow { tap, name, node, listener })?;
    Ok(Outcome::Success)
}

struct Follow<'a, L> {
    tap: &'a Tap,
    name: String,
    node: Node,
    listener: &'a mut L,
}

impl<L: Listener> Follow<'_, L> {
    /// Calls `look` until the count is full, the system is gone or the user has enough. `look` hands on
    /// one message to the listener, where there is one for it, tells whether one came, and how many were
    /// lost.
    fn run(
        &mut self,
        mut look: impl FnMut(Option<&mut L>) -> anyhow::Result<(bool, u64)>,
    ) -> anyhow::Result<()> {
        let (mut seen, mut tick) = (0, Instant::now());
        let mut counts = L::HISTORY;
        loop {
            let mut came = false;
            let lost = loop {
                let (there, lost) = look(counts.then_some(&mut *self.listener))?;
                if !there {
                    break lost;
                }
                came = true;
                seen += u64::from(counts);
                if self.tap.count == Some(seen) {
                    return Ok(());
                }
            };
            counts |= came;
            if tick.elapsed() >= SECOND {
                tick = Instant::now();
                self.listener.tick(lost)?;
                if System::open(&self.name).is_err() {
                    return Ok(());
                }
            }
            if self.node.nap(LOOK_EVERY) == Wake::Terminate {
                return Ok(());
            }
        }
    }
}

impl<L: Listener> ChannelVisitor for Follow<'_, L> {
    type Error = anyhow::Error;

    fn fixed<T: Ros2>(&mut self, channel: Channel<T>) -> anyhow::Result<()> {
        if channel.spec.name != self.tap.channel {
            return Ok(());
        }
        let mut reader = self.node.reader(channel)?;
        self.run(|listener| {
            let message = reader.receive()?;
            if let (Some(message), Some(listener)) = (&message, listener) {
                listener.hear::<T>(message, &[])?;
            }
            Ok((message.is_some(), reader.lost()))
        })
    }

    fn sliced<T: Ros2>(&mut self, channel: Channel<T>) -> anyhow::Result<()> {
        if channel.spec.name != self.tap.channel {
            return Ok(());
        }
        let mut reader = self.node.slice_reader(channel)?;
        self.run(|listener| {
            let message = reader.receive()?;
            if let (Some(sample), Some(listener)) = (&message, listener) {
                listener.hear(sample.message(), sample.bytes())?;
            }
            Ok((message.is_some(), reader.lost()))
        })
    }
}

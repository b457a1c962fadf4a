//! The bridge process: reads channels as an observer, publishes their messages, and passes on orders.
//!
//! Only messages that are sent while the bridge runs are published. Of earlier messages, subscribers only receive the latest one of
//! each latched channel.

use std::time::{Duration, Instant};

use sketchnav_runtime::{Node, RawReader, RawSample, SendTimes, System, Wake};
use sketchnav_schemas::channels::{self, ChannelSpec, FAULTS, HEALTH, ODOMETRY, Role};
use sketchnav_schemas::erased::Spare;
use sketchnav_schemas::ros2::{encode, transforms};
use sketchnav_schemas::run::RunConfig;

use crate::diagnostics::Diagnostics;
use crate::forms::{Clock, Text, time};
use crate::orders::{Allowance, FindGoal, parse};
use crate::participant::{Intake, Outlet, Participant};
use crate::topics::{Delivery, Source, Topic};
use crate::{BridgeError, Settings, Summary};

/// Interval at which to look for messages, since messages do not wake observers.
const LOOK_EVERY: Duration = Duration::from_millis(4);
/// Interval at which to publish the state of the processes, and to check whether the system still runs.
const SECOND: Duration = Duration::from_secs(1);
/// The topic of orders.
pub const ORDER_TOPIC: &str = "order";
/// The type of the topic of orders.
const ORDER_TYPE: &str = "std_msgs/msg/String";
/// Maximum number of orders that can wait.
const ORDER_DEPTH: usize = 10;

/// Publishes `topics` until the system has ended or the process is asked to end. `find` looks up the goals that orders name.
///
/// # Errors
/// [`BridgeError`] if the domain or a channel cannot be opened, or messages can no longer be sent.
pub fn run(
    node: &Node,
    run: &RunConfig,
    topics: &[Topic],
    settings: &Settings,
    find: &FindGoal<'_>,
) -> Result<Summary, BridgeError> {
    let mut participant = Participant::join(settings, &run.system)?;
    let mut bridge = Bridge::open(node, run, topics, &mut participant)?;
    let mut orders = settings.takes_orders.then(|| Orders::open(run, &mut participant)).transpose()?;
    let began = Instant::now();
    let mut reported_at = Duration::ZERO;
    loop {
        let now = began.elapsed();
        bridge.look(now)?;
        if let Some(orders) = &mut orders {
            orders.hand_on(node.system(), find, now)?;
        }
        if now >= reported_at + SECOND {
            reported_at = now;
            bridge.diagnose(now)?;
            if System::open(node.system().name()).is_err() {
                break;
            }
        }
        if node.nap(LOOK_EVERY) == Wake::Terminate {
            break;
        }
    }
    Ok(bridge.summary())
}

/// A channel that the bridge reads.
struct Inlet {
    reader: RawReader,
    /// The number of the last message that was sent before the bridge started and must not be published.
    seen: u64,
    spare: Spare,
    outlet: Option<Outlet>,
}

struct Bridge {
    system: String,
    inlets: Vec<Inlet>,
    clock: Option<Outlet>,
    transforms: Option<Outlet>,
    transform: transforms::Form,
    /// The transform to the laser. It was published once, and the topic is kept open for late subscribers.
    _mount: Option<Outlet>,
    diagnostics: Option<(Diagnostics, Outlet)>,
    stamp_ns: u64,
}

impl Bridge {
    fn open(
        node: &Node,
        run: &RunConfig,
        topics: &[Topic],
        participant: &mut Participant,
    ) -> Result<Self, BridgeError> {
        let mut outlet = |source: Source| {
            let topic = topics.iter().find(|topic| topic.source == source);
            topic.map(|topic| participant.publisher(topic.name, topic.kind, topic.delivery)).transpose()
        };
        let (clock, transforms) = (outlet(Source::Clock)?, outlet(Source::Transforms)?);
        let mut mount = outlet(Source::Mount)?;
        if let (Some(mount), Some(laser)) = (&mut mount, &run.robot.laser) {
            let mut cdr = Vec::new();
            transforms::laser_in_base(laser, &mut cdr)?;
            mount.publish(cdr)?;
        }
        let diagnostics = outlet(Source::Diagnostics)?.map(|outlet| (Diagnostics::default(), outlet));
        let kind = run.mission.navigator_kind();
        let is_needed = |spec: &ChannelSpec| {
            let for_diagnostics = [HEALTH.spec, FAULTS.spec];
            spec.role == Role::Tick
                || (transforms.is_some() && *spec == *ODOMETRY.spec)
                || (diagnostics.is_some() && for_diagnostics.contains(&spec))
        };
        let mut inlets = Vec::new();
        for spec in channels::of_kind(kind) {
            let outlet = outlet(Source::Channel(spec))?;
            if outlet.is_some() || is_needed(spec) {
                inlets.push(Inlet::open(node, spec, outlet)?);
            }
        }
        let transform = transforms::Form::default();
        let system = run.system.clone();
        Ok(Self { system, inlets, clock, transforms, transform, _mount: mount, diagnostics, stamp_ns: 0 })
    }

    /// Publishes the messages that have arrived.
    fn look(&mut self, now: Duration) -> Result<(), BridgeError> {
        let mut inlets = std::mem::take(&mut self.inlets);
        for inlet in &mut inlets {
            while let Some(sample) = inlet.reader.receive_valid()? {
                self.derive(inlet, &sample, now)?;
                inlet.publish(&sample)?;
            }
        }
        self.inlets = inlets;
        Ok(())
    }

    /// Publishes the messages derived from a message.
    fn derive(&mut self, inlet: &Inlet, sample: &RawSample, now: Duration) -> Result<(), BridgeError> {
        let (spec, message) = (inlet.reader.spec(), sample.message());
        if let Some((diagnostics, _)) = &mut self.diagnostics {
            // Earlier messages are included, because a process may have died before the bridge started.
            if let Some(health) = HEALTH.message(spec, message) {
                diagnostics.on_health(health, now);
            } else if let Some(fault) = FAULTS.message(spec, message) {
                diagnostics.on_fault(fault, now);
            }
        }
        if !inlet.is_new(sample) {
            return Ok(());
        }
        if spec.role == Role::Tick {
            self.stamp_ns = sample.header().stamp_ns;
            if let Some(clock) = &mut self.clock {
                let mut cdr = Vec::new();
                encode(&Clock { clock: time(self.stamp_ns) }, &mut cdr)?;
                clock.publish(cdr)?;
            }
        }
        if let (Some(outlet), Some(odometry)) = (&mut self.transforms, ODOMETRY.message(spec, message)) {
            let mut cdr = Vec::new();
            transforms::base_in_odom(odometry, &mut self.transform, &mut cdr)?;
            outlet.publish(cdr)?;
        }
        Ok(())
    }

    fn diagnose(&mut self, now: Duration) -> Result<(), BridgeError> {
        let Some((diagnostics, outlet)) = &mut self.diagnostics else { return Ok(()) };
        let mut cdr = Vec::new();
        encode(&diagnostics.report(&self.system, self.stamp_ns, now), &mut cdr)?;
        outlet.publish(cdr)
    }

    fn summary(&self) -> Summary {
        let of_channels = self.inlets.iter().filter_map(|inlet| inlet.outlet.as_ref());
        let derived = [&self.clock, &self.transforms, &self._mount].into_iter().flatten();
        let diagnostics = self.diagnostics.iter().map(|(_, outlet)| outlet);
        let mut summary = Summary::default();
        for outlet in of_channels.chain(derived).chain(diagnostics) {
            let (sent, unsent) = outlet.counts();
            summary.sent += sent;
            summary.unsent += unsent;
        }
        summary.lost = self.inlets.iter().map(|inlet| inlet.reader.lost()).sum();
        summary
    }
}

impl Inlet {
    fn open(node: &Node, spec: &'static ChannelSpec, outlet: Option<Outlet>) -> Result<Self, BridgeError> {
        let has_history = spec.writer.is_some() && !spec.is_latched();
        let seen = if has_history { SendTimes::open(node, spec)?.newest() } else { 0 };
        let reader = node.raw_reader(spec)?;
        Ok(Self { reader, seen, spare: spec.message.spare(), outlet })
    }

    /// Returns true if the message was sent after the bridge started.
    fn is_new(&self, sample: &RawSample) -> bool {
        self.reader.spec().writer.is_none() || sample.header().seq > self.seen
    }

    /// Publishes a message. One that has no ROS 2 form is left out, as it is in a recording.
    fn publish(&mut self, sample: &RawSample) -> Result<(), BridgeError> {
        let is_new = self.is_new(sample);
        let Some(outlet) = self.outlet.as_mut().filter(|_| is_new) else { return Ok(()) };
        let spec = self.reader.spec();
        let mut cdr = Vec::new();
        match spec.message.encode(sample.message(), sample.cells(), &mut self.spare, &mut cdr) {
            Ok(()) => outlet.publish(cdr),
            Err(error) => {
                sketchnav_schemas::say!(
                    "/{}: message {} is left out: {error}",
                    spec.name,
                    sample.header().seq
                );
                Ok(())
            }
        }
    }
}

/// Takes orders from ROS 2.
struct Orders {
    intake: Intake<Text>,
    task_count: usize,
    allowance: Allowance,
}

impl Orders {
    fn open(run: &RunConfig, participant: &mut Participant) -> Result<Self, BridgeError> {
        let delivery = Delivery::Reliable { depth: ORDER_DEPTH };
        let intake = participant.subscription(ORDER_TOPIC, ORDER_TYPE, delivery)?;
        Ok(Self { intake, task_count: run.mission.task.len(), allowance: Allowance::default() })
    }

    /// Passes on the orders that have arrived, for the supervisor to give them.
    fn hand_on(&mut self, system: &System, find: &FindGoal<'_>, now: Duration) -> Result<(), BridgeError> {
        while let Some(text) = self.intake.take() {
            let order = match self.allowance.take(now) {
                Ok(true) => parse(&text.data, self.task_count, find),
                Ok(false) => continue,
                Err(error) => Err(error),
            };
            match order {
                Ok(ordered) => system.order(ordered, "bridge ros2")?,
                Err(error) => sketchnav_schemas::say!("/{ORDER_TOPIC}: {error}"),
            }
        }
        Ok(())
    }
}

//! Follows a running system as an observer, which never writes and is not woken by messages. It polls the watched channels
//! every few milliseconds, and channels that no viewer watches are not even open.

use std::sync::Arc;
use std::time::{Duration, Instant};

use foxglove::{ChannelId, Context, SinkId};
use sketchnav_recordings::writer::topic_name;
use sketchnav_runtime::{Node, RawReader, RawSample, SendTimes, System, Wake};
use sketchnav_schemas::channels::{self, ChannelSpec, ODOMETRY, Role};
use sketchnav_schemas::erased::Spare;
use sketchnav_schemas::ros2::Ros2Error;
use sketchnav_schemas::ros2::derived::Derived;
use sketchnav_schemas::ros2::transforms::{self, TF, TF_STATIC};
use sketchnav_schemas::run::RunConfig;

use crate::Result;
use crate::server::{Event, Port, Served, Server};
use crate::topics::{Announced, Topic};

/// Interval at which to poll while a viewer watches. A channel's buffer holds the messages that arrive in between.
const LOOK_EVERY: Duration = Duration::from_millis(5);
/// Interval at which to check whether a viewer watches.
const IDLE: Duration = Duration::from_millis(50);
/// Interval at which to check whether the system still runs.
const SECOND: Duration = Duration::from_secs(1);

/// The reason why the view ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// A person or a program has asked the process to end.
    Asked,
    /// The system or the recording has ended.
    Over,
}

/// Shows the system of an observer's node until it ends or the process is asked to end. Calls `ready` when viewers can
/// connect.
///
/// # Errors
/// [`crate::ViewError`] if the system or the server fails. A message that has no ROS 2 form is not an error, but is printed,
/// once per channel.
pub fn show(node: &Node, port: Port, ready: impl FnOnce()) -> Result<End> {
    let run = node.run_config()?;
    let name = node.system().name().to_owned();
    let mut server = Server::start(port, Served { name: format!("sketchnav: {name}"), playback: None })?;
    let mut view = View::new(server.context(), &run)?;
    ready();
    let mut seen = Instant::now();
    loop {
        let is_watched = view.is_watched();
        if node.nap(if is_watched { LOOK_EVERY } else { IDLE }) == Wake::Terminate {
            return Ok(End::Asked);
        }
        while let Some(event) = server.next_event() {
            if let Event::Subscribed(channel, sink) = event {
                view.show_last(channel, sink);
            }
        }
        view.look(node)?;
        server.send_time(view.newest_ns);
        if seen.elapsed() >= SECOND {
            seen = Instant::now();
            if System::open(&name).is_err() {
                return Ok(End::Over);
            }
        }
    }
}

/// The parts of a system that are shown.
struct View {
    sources: Vec<Source>,
    /// The transform from the robot to its laser. `None` if the robot has no laser.
    fixed: Option<Topic>,
    newest_ns: u64,
}

impl View {
    fn new(context: &Arc<Context>, run: &RunConfig) -> Result<Self> {
        let shown = channels::of_kind(run.mission.navigator_kind()).filter(|spec| spec.is_recorded());
        let sources = shown.map(|spec| Source::new(context, spec)).collect::<Result<_>>()?;
        let fixed = run.robot.laser.as_ref().map(|laser| {
            let mut topic = Topic::transforms(context, TF_STATIC, true)?;
            let mut cdr = Vec::new();
            transforms::laser_in_base(laser, &mut cdr)?;
            topic.show(0, &cdr);
            Ok::<_, crate::ViewError>(topic)
        });
        Ok(Self { sources, fixed: fixed.transpose()?, newest_ns: 0 })
    }

    fn is_watched(&self) -> bool {
        self.sources.iter().any(Source::is_watched)
    }

    fn look(&mut self, node: &Node) -> Result<()> {
        for source in &mut self.sources {
            let newest_ns = source.look(node)?;
            self.newest_ns = self.newest_ns.max(newest_ns.unwrap_or(0));
        }
        Ok(())
    }

    fn show_last(&self, channel: ChannelId, sink: SinkId) {
        let topics = self.sources.iter().flat_map(Source::topics).chain(&self.fixed);
        topics.filter(|topic| topic.is(channel)).for_each(|topic| topic.show_last(sink));
    }
}

/// A channel, with the topics whose messages are made from it.
struct Source {
    spec: &'static ChannelSpec,
    /// Open only while a viewer watches the channel.
    reader: Option<RawReader>,
    own: Topic,
    derived: Vec<(&'static Derived, Topic)>,
    /// The topic `/tf`, if its messages are made from this channel.
    transform: Option<(Topic, transforms::Form)>,
    spare: Spare,
    cdr: Vec<u8>,
    has_complained: bool,
}

impl Source {
    fn new(context: &Arc<Context>, spec: &'static ChannelSpec) -> Result<Self> {
        let (topic, schema) = (topic_name(spec.name), spec.message.schema());
        let (kind, is_latched) = (spec.message.ros2, spec.is_latched());
        let own = Topic::new(context, Announced { topic: &topic, kind, schema, is_latched })?;
        let derived = sketchnav_navigators::derived(spec)
            .map(|derived| Ok((derived, Topic::derived(context, derived)?)));
        let derived = derived.collect::<Result<_>>()?;
        let has_transform = spec == ODOMETRY.spec;
        let transform = has_transform.then(|| Topic::transforms(context, TF, false)).transpose()?;
        Ok(Self {
            spec,
            reader: None,
            own,
            derived,
            transform: transform.map(|topic| (topic, transforms::Form::default())),
            spare: spec.message.spare(),
            cdr: Vec::new(),
            has_complained: false,
        })
    }

    fn topics(&self) -> impl Iterator<Item = &Topic> {
        let derived = self.derived.iter().map(|(_, topic)| topic);
        std::iter::once(&self.own).chain(derived).chain(self.transform.iter().map(|(topic, _)| topic))
    }

    fn is_watched(&self) -> bool {
        self.topics().any(Topic::is_watched)
    }

    /// Shows the messages that have arrived, and returns the time of the latest one.
    fn look(&mut self, node: &Node) -> Result<Option<u64>> {
        if !self.is_watched() {
            self.close();
            return Ok(None);
        }
        if self.reader.is_none() {
            self.reader = Some(open(node, self.spec)?);
        }
        let mut newest_ns = None;
        while let Some(sample) = self.reader.as_mut().map(RawReader::receive).transpose()?.flatten() {
            newest_ns = newest_ns.max(Some(sample.header().stamp_ns));
            if let Err(error) = self.show(&sample) {
                self.complain(node, &error);
            }
        }
        Ok(newest_ns)
    }

    /// Closes a channel that no viewer watches, and discards its last message, which may be outdated when a viewer returns.
    fn close(&mut self) {
        if self.reader.take().is_some() {
            self.own.forget();
            self.derived.iter_mut().for_each(|(_, topic)| topic.forget());
        }
    }

    fn show(&mut self, sample: &RawSample) -> Result<(), Ros2Error> {
        let (message, cells, stamp_ns) = (sample.message(), sample.cells(), sample.header().stamp_ns);
        let Self { spec, own, derived, transform, spare, cdr, .. } = self;
        if is_wanted(own) {
            cdr.clear();
            spec.message.encode(message, cells, spare, cdr)?;
            own.show(stamp_ns, cdr);
        }
        for (derived, topic) in derived.iter_mut().filter(|(_, topic)| is_wanted(topic)) {
            cdr.clear();
            derived.encode(message, cells, cdr)?;
            topic.show(stamp_ns, cdr);
        }
        if let Some((topic, form)) = transform.as_mut().filter(|(topic, _)| topic.is_watched())
            && let Some(odometry) = ODOMETRY.message(spec, message)
        {
            cdr.clear();
            transforms::base_in_odom(odometry, form, cdr)?;
            topic.show(stamp_ns, cdr);
        }
        Ok(())
    }

    fn complain(&mut self, node: &Node, error: &Ros2Error) {
        node.count_refused();
        if !std::mem::replace(&mut self.has_complained, true) {
            sketchnav_schemas::say!("/{}: not shown: {error}", self.spec.name);
        }
    }
}

/// Returns true if a viewer watches the topic, or if it is latched: its last message is also needed for viewers that connect
/// later while the channel is open.
fn is_wanted(topic: &Topic) -> bool {
    topic.is_watched() || topic.is_latched()
}

/// Opens a channel. For continuous data, a late reader needs only the latest message. Messages from people and reports of faults
/// are shown as far back as the history goes.
fn open(node: &Node, spec: &'static ChannelSpec) -> Result<RawReader> {
    let mut reader = node.raw_reader(spec)?;
    let is_kept = matches!(spec.role, Role::Instruction | Role::Request | Role::Reply | Role::Report);
    if !is_kept {
        let newest = SendTimes::open(node, spec)?.newest();
        reader.resume_after(newest.saturating_sub(1));
    }
    Ok(reader)
}

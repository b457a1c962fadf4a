//! The pipeline as a table. Each row describes a channel: its message, its writer, its readers and its role in an instant.
//!
//! Every list of channels or processes is derived from this table. The channels common to all navigators are
//! declared here, and each navigator declares its own and adds them with [`register`]. The order within an
//! instant follows from writers and roles. If two channels have the same writer and role, it is the order of
//! the rows.

use std::marker::PhantomData;
use std::sync::{LazyLock, PoisonError, RwLock};

use crate::codes::Process;
use crate::declare::channels;
use crate::erased::MessageType;
use crate::message::*;
use crate::ros2::Ros2;

/// Maximum number of ticks that the world, in lockstep, may be ahead of the recorder's file. The buffer and the history of every
/// recorded channel are larger than that.
pub const LOCKSTEP_WINDOW: u64 = 64;
/// Number of ticks between two acknowledgements by the recorder.
pub const RECORDED_EVERY: u64 = 16;
/// Number of instants in the history and the buffers of a channel.
const INSTANTS: usize = 128;
/// Maximum number of channels in a run, including those common to all kinds of navigators.
pub const MAX_CHANNELS: usize = 32;

/// Purpose of a channel's messages, which determines how many of them are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Stays in force until the next one arrives, like a sketch or a route. Transient-local (latched).
    Instruction,
    /// A request by a person. Each is received once.
    Request,
    /// The reply to a request.
    Reply,
    /// Ground truth, for the recorder and the judge only.
    Truth,
    /// A sensor reading, which the next tick refers to.
    Sensor,
    /// The heartbeat, which ends the world's part of an instant.
    Tick,
    /// The localizer's response to a tick.
    Situation,
    /// The planner's response to a situation.
    Command,
    /// The state of the mission, which is the last message of an instant.
    Status,
    /// Further details of an instant, for observers.
    Detail,
    /// Depends on the wall clock or on chance, and therefore differs from run to run.
    Report,
    /// How much of the run has been written to disk. Channels of all other roles are recorded, but not this one.
    Safe,
}

/// A row of the table.
#[derive(Debug)]
pub struct ChannelSpec {
    /// Name, unique within a system.
    pub name: &'static str,
    /// The only process that writes the channel, or `None` if every process does, which is the case for `health` only.
    pub writer: Option<Process>,
    /// The processes that may read the channel in addition to the recorder and to observers, which may read
    /// every channel.
    pub readers: &'static [Process],
    /// Purpose of the channel's messages.
    pub role: Role,
    /// The kind of navigator that the channel belongs to, or `None` if it is common to all kinds.
    pub kind: Option<&'static str>,
    /// Maximum number of messages between two ticks.
    pub per_tick: usize,
    /// Maximum length of the slice that follows a message, in bytes. 0 if there is none.
    pub max_cells: usize,
    /// The type of the channel's messages.
    pub message: MessageType,
}

impl PartialEq for ChannelSpec {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}
impl Eq for ChannelSpec {}

impl ChannelSpec {
    /// Returns true if the whole declaration is the same, not only the name. A Python navigator declares its channels again each
    /// time its module is loaded.
    fn is_declared_like(&self, other: &Self) -> bool {
        let declared = |spec: &Self| {
            let message = (spec.message.name, spec.message.schema());
            (spec.writer, spec.readers, spec.role, spec.kind, spec.per_tick, spec.max_cells, message)
        };
        declared(self) == declared(other)
    }

    /// Returns true if `process` may read the channel.
    pub fn may_read(&self, process: Process) -> bool {
        matches!(process, Process::Recorder | Process::Observer) || self.readers.contains(&process)
    }

    /// Returns true if `process` may write the channel.
    pub fn may_write(&self, process: Process) -> bool {
        self.writer.is_none_or(|writer| writer == process)
    }

    /// Returns the number of messages that the writer stores for late readers.
    pub fn history(&self) -> usize {
        match self.role {
            Role::Instruction => 1,
            // The next request may arrive before the reader has checkpointed this one.
            Role::Request if self.max_cells > 0 => 2,
            Role::Request | Role::Reply => 16,
            Role::Safe => 8,
            Role::Report if self.writer.is_none() => 8,
            _ => INSTANTS * self.per_tick,
        }
    }

    /// Returns the number of messages buffered for a reader before the oldest one is dropped.
    pub fn buffer(&self) -> usize {
        match self.role {
            Role::Instruction => 2,
            Role::Request if self.max_cells > 0 => 4,
            Role::Report if self.writer.is_none() => 64,
            _ => self.history().max(16),
        }
    }

    /// Returns true if the recorder writes the channel to the file.
    pub fn is_recorded(&self) -> bool {
        self.role != Role::Safe
    }

    /// Returns true if late readers receive the latest message, like transient-local topics in ROS 2.
    pub fn is_latched(&self) -> bool {
        self.role == Role::Instruction
    }

    /// Returns true if the channel's messages are sensor readings, each of which is its own cause.
    pub fn is_sensed(&self) -> bool {
        matches!(self.role, Role::Sensor | Role::Truth)
    }

    /// Returns the position of the writer within an instant, and the position of the role among the writer's messages.
    fn turn(&self) -> (u8, u8) {
        let is_for_sketcher = self.readers.contains(&Process::Sketcher);
        let whose = match (self.role, self.writer) {
            (Role::Report | Role::Safe, _) => 6,
            (Role::Request, _) if is_for_sketcher => 0,
            (_, Some(Process::Sketcher)) => 1,
            (_, Some(Process::World)) => 3,
            (_, Some(Process::Localizer)) => 4,
            (_, Some(Process::Planner)) => 5,
            _ => 2,
        };
        let when = match self.role {
            Role::Reply | Role::Tick | Role::Situation | Role::Command => 1,
            Role::Status => 2,
            _ => 0,
        };
        (whose, when)
    }

    /// Returns true if runs of navigators of this kind include the channel.
    pub fn belongs_to(&self, kind: &str) -> bool {
        self.kind.is_none_or(|own| own == kind)
    }

    /// Returns true if the channel is recorded under this topic, which is its name with a leading slash.
    pub fn is_topic(&self, topic: &str) -> bool {
        topic.strip_prefix('/') == Some(self.name)
    }
}

/// A channel of messages of type `T`.
pub struct Channel<T> {
    /// The channel's row of the table.
    pub spec: &'static ChannelSpec,
    message: PhantomData<fn() -> T>,
}

impl<T> Clone for Channel<T> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T> Copy for Channel<T> {}

impl<T: Ros2> Channel<T> {
    /// Creates a channel from a row whose message is `T`.
    ///
    /// # Panics
    /// Panics if the row's message has another size. For a constant, this happens at compile time.
    pub const fn of(spec: &'static ChannelSpec) -> Self {
        assert!(spec.message.size == size_of::<T>(), "the row is of another message");
        Self { spec, message: PhantomData }
    }
}

/// An operation on every channel of the table, called with the channel's own message type. Used by tests.
pub trait ChannelVisitor {
    /// The error that ends a visit.
    type Error;
    /// Visits a channel.
    fn visit<T: Ros2>(&mut self, channel: Channel<T>) -> Result<(), Self::Error>;
}

impl<T: Message> Channel<T> {
    /// Casts `message` to `T` if `spec` is this channel.
    pub fn message<'a>(&self, spec: &ChannelSpec, message: &'a [u8]) -> Option<&'a T> {
        (self.spec == spec).then(|| bytemuck::from_bytes(message))
    }
}

channels! {
    /// Drawings that people make.
    DRAWING: Request Drawing = "drawing", Pad => [Sketcher], behind it up to MAX_DRAWING_BYTES;
    /// The sketcher's reply to a drawing.
    UNDERSTOOD: Reply Understood = "understood", Sketcher => [Pad];
    /// Orders of the person at the pad.
    ORDERS: Request MissionCommand = "orders", Pad => [Localizer, Planner];
    /// Orders from the supervisor.
    MISSION: Request MissionCommand = "mission", Supervisor => [Localizer, Planner];
    /// Collisions with walls, furniture and people.
    CONTACT: Detail Contact = "contact", World => [], up to 4 a tick;
    /// The true pose. No navigator may open this channel.
    TRUTH: Truth GroundTruth = "truth", World => [];
    /// The true positions of people. No navigator may open this channel.
    PEOPLE: Truth People = "people", World => [];
    /// Dead reckoning.
    ODOMETRY: Sensor Odometry = "odometry", World => [Localizer, Planner], up to 8 a tick;
    /// Laser scans.
    SCAN: Sensor LaserScan = "scan", World => [Localizer, Planner, Pad];
    /// Readings of the ring of sonars.
    SONAR: Sensor SonarScan = "sonar", World => [Localizer, Planner, Pad];
    /// The markers that the camera sees.
    MARKERS: Sensor MarkerView = "markers", World => [Localizer, Planner, Pad], up to 8 a tick;
    /// The dots of a plane that the camera's window shows.
    VIEW: Sensor DotView = "view", World => [Localizer, Pad];
    /// The heartbeat, which is the last message of the world in an instant.
    TICK: Tick Tick = "tick", World => [Localizer, Planner, Pad];
    /// Velocities for the robot to drive.
    COMMAND: Command VelocityCommand = "command", Planner => [World];
    /// The state of the mission, which is the last message of an instant.
    STATUS: Status MissionStatus = "status", Planner => [Supervisor, Pad];
    /// The duration of each step by the clock.
    LATENCY: Report Latency = "latency", Recorder => [];
    /// Signs of life, from every process.
    HEALTH: Report Health = "health", every => [Supervisor, Pad];
    /// Kills, deaths, restarts and recoveries, as well as orders given by tools.
    FAULTS: Report Fault = "faults", Supervisor => [Pad];
    /// How much of the run is safely in the file.
    RECORDED: Safe Recorded = "recorded", Recorder => [World];
}

/// The table in the order of an instant. It grows only through [`register`], and nothing is ever removed.
static TABLE: LazyLock<RwLock<&'static [&'static ChannelSpec]>> =
    LazyLock::new(|| RwLock::new(in_order(CHANNELS.to_vec())));

fn in_order(mut table: Vec<&'static ChannelSpec>) -> &'static [&'static ChannelSpec] {
    table.sort_by_key(|spec| spec.turn());
    table.leak()
}

/// The reason why channels cannot be added.
#[derive(Debug, Clone, thiserror::Error, PartialEq, Eq)]
pub enum RegisterError {
    /// Two navigators have the same name.
    #[error("navigator {kind:?}: expected a name that no other navigator has")]
    Kind {
        /// The name.
        kind: &'static str,
    },
    /// A kind of navigator adds a channel of another kind.
    #[error("channel {name:?}: expected the kind {kind:?}")]
    Foreign {
        /// The channel.
        name: &'static str,
        /// The kind of navigator that adds the channel.
        kind: &'static str,
    },
    /// Two channels with the same name.
    #[error("channel {name:?}: expected a name that no other channel has")]
    Name {
        /// The name.
        name: &'static str,
    },
    /// A run would have too many channels.
    #[error("kind {kind:?}: expected at most {MAX_CHANNELS} channels, found {found}")]
    TooMany {
        /// The kind.
        kind: &'static str,
        /// The resulting number of channels.
        found: usize,
    },
    /// More sensor channels than a tick can refer to.
    #[error("expected at most {MAX_SENSORS} sensor channels in total, found {found}")]
    TooManySensors {
        /// The resulting number of sensor channels.
        found: usize,
    },
    /// A kind of navigator does not have exactly one channel of a role that its processes wait for.
    #[error("kind {kind:?}: expected one channel of role {role:?}, found {found}")]
    Role {
        /// The kind.
        kind: &'static str,
        /// The role.
        role: Role,
        /// The number of such channels.
        found: usize,
    },
}

/// Adds the channels of a kind of navigator to the table. Adding the same channels again has no effect.
///
/// # Errors
/// [`RegisterError`], in which case the table is unchanged.
pub fn register(kind: &'static str, channels: &[&'static ChannelSpec]) -> Result<(), RegisterError> {
    let mut table = TABLE.write().unwrap_or_else(PoisonError::into_inner);
    let mut known = table.to_vec();
    for &spec in channels {
        if spec.kind != Some(kind) {
            return Err(RegisterError::Foreign { name: spec.name, kind });
        }
        match known.iter().find(|known| **known == spec) {
            None => known.push(spec),
            Some(known) if known.is_declared_like(spec) => {}
            Some(_) => return Err(RegisterError::Name { name: spec.name }),
        }
    }
    check(&known, kind)?;
    if known.len() > table.len() {
        *table = in_order(known);
    }
    Ok(())
}

/// Checks that a table is within the limits, and that `kind` has exactly one channel for each role that its processes wait for.
fn check(table: &[&ChannelSpec], kind: &'static str) -> Result<(), RegisterError> {
    let found = table.iter().filter(|spec| spec.role == Role::Sensor).count();
    if found > MAX_SENSORS {
        return Err(RegisterError::TooManySensors { found });
    }
    let found = table.iter().filter(|spec| spec.belongs_to(kind)).count();
    if found > MAX_CHANNELS {
        return Err(RegisterError::TooMany { kind, found });
    }
    for role in [Role::Tick, Role::Situation, Role::Command, Role::Status] {
        let found = table.iter().filter(|spec| spec.belongs_to(kind) && spec.role == role).count();
        if found != 1 {
            return Err(RegisterError::Role { kind, role, found });
        }
    }
    Ok(())
}

/// Returns all channels, in the order of an instant. Channels whose content differs from run to run come last.
pub fn all() -> impl Iterator<Item = &'static ChannelSpec> + Clone {
    let table: &'static [_] = *TABLE.read().unwrap_or_else(PoisonError::into_inner);
    table.iter().copied()
}

/// Returns the position of a topic within an instant, which is that of its channel in [`all`]. Topics without
/// a channel, and topics of reports, come after all channels.
pub fn place_of(topic: &str) -> usize {
    let place = all().position(|spec| spec.is_topic(topic) && spec.role != Role::Report);
    place.unwrap_or_else(|| all().count())
}

/// Returns all channels in a run with this kind of navigator.
pub fn of_kind(kind: &str) -> impl Iterator<Item = &'static ChannelSpec> + Clone {
    all().filter(move |spec| spec.belongs_to(kind))
}

/// Returns the channel with the given name.
pub fn find(name: &str) -> Option<&'static ChannelSpec> {
    all().find(|spec| spec.name == name)
}

/// Returns the channel recorded under this topic.
pub fn of_topic(topic: &str) -> Option<&'static ChannelSpec> {
    find(topic.strip_prefix('/')?)
}

/// Returns true if several processes write the channel of this topic, in which case gaps in its sequence numbers are meaningless.
pub fn has_many_writers(topic: &str) -> bool {
    of_topic(topic).is_some_and(|spec| spec.writer.is_none())
}

/// Returns the names of all channels, as listed in errors: `scan, odometry, …`.
pub fn names() -> String {
    all().map(|spec| spec.name).collect::<Vec<_>>().join(", ")
}

/// Like [`names`], but only the channels in a run with this kind of navigator.
pub fn names_of_kind(kind: &str) -> String {
    of_kind(kind).map(|spec| spec.name).collect::<Vec<_>>().join(", ")
}

/// Returns the sensors' channels. `newest[i]` of a [`Tick`] is the number of the latest message of the `i`-th one.
pub fn sensors() -> impl Iterator<Item = &'static ChannelSpec> + Clone {
    all().filter(|spec| spec.role == Role::Sensor)
}

/// Returns the channel with role `role` in a run with a navigator of kind `kind`.
pub fn of_role(role: Role, kind: &str) -> Option<&'static ChannelSpec> {
    of_kind(kind).find(|spec| spec.role == role)
}

/// Returns the channels that `process` writes, except `health`, in the order of an instant.
pub fn written_by(process: Process, kind: &str) -> impl Iterator<Item = &'static ChannelSpec> + Clone {
    of_kind(kind).filter(move |spec| spec.writer == Some(process))
}

/// Returns the channels that `process` reads, in the order of an instant.
pub fn read_by(process: Process, kind: &str) -> impl Iterator<Item = &'static ChannelSpec> + Clone {
    of_kind(kind).filter(move |spec| spec.readers.contains(&process))
}

/// Returns the channel whose messages trigger the steps of `process`, or `None` if the process has no steps.
pub fn trigger_of(process: Process, kind: &str) -> Option<&'static ChannelSpec> {
    let role = match process {
        Process::World => Role::Command,
        Process::Localizer => Role::Tick,
        Process::Planner => Role::Situation,
        _ => return None,
    };
    of_role(role, kind)
}

/// Returns the last channel that `process` writes in an instant. Once its message has arrived, so have all other
/// messages of the process in that instant.
pub fn last_word_of(process: Process, kind: &str) -> Option<&'static ChannelSpec> {
    let role = match process {
        Process::World => Role::Tick,
        Process::Localizer => Role::Situation,
        Process::Planner => Role::Status,
        _ => return None,
    };
    of_role(role, kind)
}

/// The processes of every run, except its supervisor, in the order in which they start.
pub const SERVICES: [Process; 5] =
    [Process::World, Process::Sketcher, Process::Localizer, Process::Planner, Process::Recorder];
/// The processes that host the stages of a navigator, in the order of an instant.
pub const NAVIGATORS: [Process; 3] = [Process::Sketcher, Process::Localizer, Process::Planner];
/// Optional processes of a run.
pub const EXTRAS: [Process; 1] = [Process::Pad];

/// Returns the names of processes, for messages to people.
pub fn words(processes: impl IntoIterator<Item = Process>) -> String {
    processes.into_iter().map(Process::word).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::example;

    #[test]
    fn names_are_unique() {
        example::register();
        let mut names: Vec<_> = all().map(|c| c.name).collect();
        names.sort_unstable();
        let count = names.len();
        names.dedup();
        assert_eq!(names.len(), count);
    }

    /// Regression test: `rerun` and `replay` feed a process its inputs in this order, which once depended on the order of a
    /// single table.
    #[test]
    fn an_instant_begins_with_requests_and_ends_with_the_status() {
        example::register();
        let names: Vec<_> =
            of_kind(example::KIND).filter(|spec| spec.writer.is_some()).map(|spec| spec.name).collect();
        let expected = "drawing example_map understood orders mission contact truth people odometry scan sonar markers view \
                        tick example_detail example_place command status latency faults recorded";
        assert_eq!(names.join(" "), expected);
        assert!(place_of("/odometry") < place_of("/scan") && place_of("/status") < place_of("/health"));
    }

    #[test]
    fn no_navigator_reads_the_truth() {
        for process in NAVIGATORS {
            let reads = read_by(process, example::KIND).filter(|spec| spec.role == Role::Truth);
            assert_eq!(reads.count(), 0, "{process}");
        }
    }

    #[test]
    fn only_health_has_many_writers() {
        for channel in all() {
            assert_eq!(channel.writer.is_none(), channel.name == "health", "{}", channel.name);
        }
    }

    #[test]
    fn channels_of_an_instant_hold_more_than_the_lockstep_window() {
        let people = [Role::Instruction, Role::Request, Role::Reply];
        for channel in all().filter(|c| c.is_recorded() && c.writer.is_some() && !people.contains(&c.role)) {
            let instants = channel.buffer().min(channel.history()) / channel.per_tick;
            assert!(instants as u64 > LOCKSTEP_WINDOW + RECORDED_EVERY, "{}", channel.name);
        }
    }

    #[test]
    fn every_navigator_has_a_heartbeat_a_situation_a_command_and_a_status() {
        example::register();
        for process in [Process::World, Process::Localizer, Process::Planner] {
            let trigger = trigger_of(process, example::KIND).unwrap();
            assert!(trigger.readers.contains(&process), "{process} reads {}", trigger.name);
            assert_eq!(last_word_of(process, example::KIND).unwrap().writer, Some(process));
        }
    }

    #[test]
    fn registering_a_kind_again_adds_nothing() {
        example::register();
        let before = all().count();
        example::register();
        assert_eq!(all().count(), before);
    }

    #[test]
    fn channel_names_are_unique() {
        static TWICE: [&ChannelSpec; 1] = [&ChannelSpec { kind: Some("own"), ..*SCAN.spec }];
        assert_eq!(register("own", &TWICE), Err(RegisterError::Name { name: "scan" }));
    }

    /// Regression test: a second declaration that differed only in its role was accepted, and the first one remained in force.
    #[test]
    fn a_channel_that_is_registered_again_is_declared_the_same() {
        static OTHER: ChannelSpec = ChannelSpec { role: Role::Detail, ..*example::MAP.spec };
        example::register();
        assert_ne!(OTHER.role, example::MAP.spec.role);
        assert_eq!(register(example::KIND, &[&OTHER]), Err(RegisterError::Name { name: OTHER.name }));
    }

    #[test]
    fn a_channel_names_its_kind_of_navigator() {
        let error = register("own", example::CHANNELS).unwrap_err();
        assert_eq!(error.to_string(), "channel \"example_map\": expected the kind \"own\"");
    }

    /// Regression test: a navigator without a situation was accepted, and its planner then waited forever.
    #[test]
    fn a_navigator_without_a_situation_is_rejected() {
        let error = register("wall-follower", &[]).unwrap_err();
        let expected = "kind \"wall-follower\": expected one channel of role Situation, found 0";
        assert_eq!(error.to_string(), expected);
    }

    /// Regression test: the limit used to apply to the channels of all navigators together, so each new navigator left fewer
    /// for the others.
    #[test]
    fn the_limit_of_channels_ignores_other_kinds() {
        static OWN: ChannelSpec = ChannelSpec { kind: Some("own"), ..*example::MAP.spec };
        static PLACE: ChannelSpec = ChannelSpec { kind: Some("own"), ..*example::PLACE.spec };
        static OTHER: ChannelSpec = ChannelSpec { kind: Some("other"), ..*example::MAP.spec };
        let with = |own: &[&'static ChannelSpec]| [CHANNELS, own, &[&OTHER; MAX_CHANNELS]].concat();
        let room = MAX_CHANNELS - CHANNELS.len();
        assert_eq!(check(&with(&[&[&OWN][..].repeat(room - 1)[..], &[&PLACE]].concat()), "own"), Ok(()));
        let many = with(&[&OWN; MAX_CHANNELS]);
        let found = CHANNELS.len() + MAX_CHANNELS;
        assert_eq!(check(&many, "own"), Err(RegisterError::TooMany { kind: "own", found }));
    }

    #[test]
    fn more_sensors_than_a_tick_can_name_are_rejected() {
        let sensors = [SCAN.spec; MAX_SENSORS + 1];
        assert_eq!(check(&sensors, "own"), Err(RegisterError::TooManySensors { found: MAX_SENSORS + 1 }));
    }
}

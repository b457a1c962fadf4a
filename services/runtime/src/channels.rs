//! The channels of a system as iceoryx2 services, which are created by the supervisor and opened by all other
//! processes.
//!
//! To iceoryx2, a message is a slice of eight-byte words: the struct, followed by its cells. The user header
//! contains the length of the cells in bytes. An attribute of the service identifies the struct by its name
//! and the fingerprint of its layout, so two builds that disagree cannot connect.

use std::any::Any;
use std::fmt::Debug;
use std::time::Duration;

use iceoryx2::port::publisher::PublisherCreateError;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::*;
use iceoryx2::service::attribute::{AttributeKey, AttributeSpecifier, AttributeValue, AttributeVerifier};
use iceoryx2::service::builder::publish_subscribe::{Builder, PublishSubscribeOpenError};
use iceoryx2::service::port_factory::publish_subscribe;
use sketchnav_schemas::channels::{self, ChannelSpec};
use sketchnav_schemas::codes::Process;

use crate::node::Node;
use crate::{Error, Result};

/// Maximum number of observers that may read a channel at the same time. The readers in the table and the recorder have their
/// own slots, which observers cannot take.
const MAX_OBSERVERS: usize = 5;
/// Number of additional slots, in case several observers join at the same moment.
const SPARE: usize = 2;
/// Maximum number of writers of a channel with many writers.
const MAX_WRITERS: usize = 16;
/// Maximum time that an observer spends cleaning up after dead ones.
const CLEARING: Duration = Duration::from_millis(500);
/// Maximum number of processes that may have a channel open at the same time.
const MAX_NODES: usize = 32;
/// Maximum number of samples that a reader may hold at the same time. It is smaller for messages with cells,
/// which are large and which readers do not keep.
const MAX_HELD: usize = 8;
const MAX_HELD_WITH_CELLS: usize = 2;
/// Name of the attribute that identifies a channel's message type.
const MESSAGE: &str = "message";

/// An open channel.
pub(crate) type Factory = publish_subscribe::PortFactory<ipc::Service, [u64], u64>;

/// All channels of a run, held open. While this value lives, a channel survives its writer's death.
pub struct Channels {
    _held: Vec<Box<dyn Any>>,
}

impl Channels {
    /// Creates all channels of the run's kind of navigator. Only the supervisor does this, before it starts the processes.
    ///
    /// # Errors
    /// [`Error::SharedMemory`] if a channel cannot be created or already exists.
    pub fn create(node: &Node) -> Result<Self> {
        let run = node.run_config()?;
        let held = channels::of_kind(run.mission.navigator_kind())
            .map(|spec| Ok(Box::new(create(node, spec)?) as Box<dyn Any>));
        Ok(Self { _held: held.collect::<Result<_>>()? })
    }
}

fn create(node: &Node, spec: &'static ChannelSpec) -> Result<Factory> {
    let (key, value) = message_type(spec)?;
    let attributes = AttributeSpecifier::new().define(&key, &value).map_err(creating(spec))?;
    with_limits(builder(node, spec)?, spec).create_with_attributes(&attributes).map_err(creating(spec))
}

/// Opens a channel.
pub(crate) fn open(node: &Node, spec: &'static ChannelSpec) -> Result<Factory> {
    let (key, value) = message_type(spec)?;
    let attributes = AttributeVerifier::new().require(&key, &value).map_err(creating(spec))?;
    builder(node, spec)?.open_with_attributes(&attributes).map_err(|error| open_error(node, spec, error))
}

fn message_type(spec: &ChannelSpec) -> Result<(AttributeKey, AttributeValue)> {
    let key = AttributeKey::try_from(MESSAGE).map_err(creating(spec))?;
    let value = AttributeValue::try_from(spec.message.type_name().as_str()).map_err(creating(spec))?;
    Ok((key, value))
}

/// Opens the reading end of a channel. Observers may not take the slots of the pipeline's own readers.
///
/// # Errors
/// [`Error::TooManyObservers`] if there are already as many observers as allowed.
pub(crate) fn subscribe(
    node: &Node,
    spec: &'static ChannelSpec,
) -> Result<Subscriber<ipc::Service, [u64], u64>> {
    let service = open(node, spec)?;
    let reading = || format!("reading channel {:?}", spec.name);
    if node.process() == Process::Observer && observers(&service) >= MAX_OBSERVERS {
        // A killed observer keeps its slot until its remains have been cleared.
        node.clear_dead(CLEARING);
        if observers(&service) >= MAX_OBSERVERS {
            let system = node.system().name().into();
            return Err(Error::TooManyObservers { channel: spec.name, system, max: MAX_OBSERVERS });
        }
    }
    let name = node.process().word().try_into().map_err(Error::shared_memory(reading()))?;
    service.subscriber_builder().name(&name).create().map_err(Error::shared_memory(reading()))
}

fn observers(service: &Factory) -> usize {
    let mut count = 0;
    service.dynamic_config().list_subscribers(|subscriber| {
        count += usize::from(subscriber.subscriber_name.as_str() == Process::Observer.word());
        CallbackProgression::Continue
    });
    count
}

/// Explains why a writer could not be created.
pub(crate) fn writer_error(
    node: &Node,
    spec: &'static ChannelSpec,
    service: &Factory,
    error: PublisherCreateError,
) -> Error {
    if error != PublisherCreateError::ExceedsMaxSupportedPublishers {
        return Error::shared_memory(format!("writing channel {:?}", spec.name))(error);
    }
    let mut owner = spec.writer.map_or_else(|| "processes".into(), |process| process.to_string());
    service.dynamic_config().list_publishers(|publisher| {
        if let Ok(pid) = publisher.node_id.pid::<ipc::Service>() {
            owner += &format!(", process {}", pid.value());
        }
        CallbackProgression::Continue
    });
    Error::SecondWriter { channel: spec.name, system: node.system().name().into(), owner }
}

type ChannelBuilder = Builder<[u64], u64, ipc::Service>;

fn builder(node: &Node, spec: &ChannelSpec) -> Result<ChannelBuilder> {
    let builder = node.inner().service_builder(&service_name(spec)?).publish_subscribe::<[u64]>();
    Ok(builder.user_header::<u64>())
}

/// Enables safe overflow. Without it, a single stopped reader would block the writer for seconds.
fn with_limits(builder: ChannelBuilder, spec: &ChannelSpec) -> ChannelBuilder {
    builder
        .enable_safe_overflow(true)
        .max_publishers(if spec.writer.is_some() { 1 } else { MAX_WRITERS })
        .max_subscribers(spec.readers.len() + 1 + MAX_OBSERVERS + SPARE)
        .max_nodes(MAX_NODES)
        .history_size(spec.history())
        .subscriber_max_buffer_size(spec.buffer())
        .subscriber_max_borrowed_samples(if spec.max_cells > 0 { MAX_HELD_WITH_CELLS } else { MAX_HELD })
}

fn service_name(spec: &ChannelSpec) -> Result<ServiceName> {
    spec.name.try_into().map_err(Error::shared_memory(format!("naming channel {:?}", spec.name)))
}

fn creating<E: Debug>(spec: &ChannelSpec) -> impl FnOnce(E) -> Error {
    Error::shared_memory(format!("creating channel {:?}", spec.name))
}

fn open_error(node: &Node, spec: &'static ChannelSpec, error: PublishSubscribeOpenError) -> Error {
    if error != PublishSubscribeOpenError::IncompatibleAttributes {
        return Error::shared_memory(format!("opening channel {:?}", spec.name))(error);
    }
    Error::Mismatch {
        channel: spec.name,
        system: node.system().name().into(),
        expected: spec.message.type_name(),
        found: found_type(node, spec).unwrap_or_else(|| "another type".into()),
    }
}

/// Returns the type name of the message, as given by the channel's creator.
fn found_type(node: &Node, spec: &ChannelSpec) -> Option<String> {
    let name = service_name(spec).ok()?;
    let pattern = iceoryx2::service::messaging_pattern::MessagingPattern::PublishSubscribe;
    let details = ipc::Service::details(&name, node.inner().config(), pattern).ok()??;
    let key = AttributeKey::try_from(MESSAGE).ok()?;
    details.static_details.attributes().key_value(&key, 0).map(ToString::to_string)
}

#[cfg(test)]
mod tests {
    use std::rc::Rc;

    use super::*;
    use crate::reader::RawReader;
    use crate::system::System;
    use crate::writer::RawWriter;
    use sketchnav_schemas::channels::{ODOMETRY, SCAN};
    use sketchnav_schemas::codes::Process;

    /// The `scan` channel as declared by another build.
    static OTHER_SCAN: ChannelSpec = ChannelSpec {
        name: "scan",
        writer: Some(Process::World),
        readers: &[],
        role: channels::Role::Sensor,
        kind: None,
        per_tick: 1,
        max_cells: 0,
        message: ODOMETRY.spec.message,
    };

    #[test]
    fn builds_with_different_layouts_of_a_message_cannot_connect() {
        let root = tempfile::tempdir().unwrap();
        let mut run: sketchnav_schemas::run::RunConfig =
            serde_json::from_str(include_str!("../tests/run.json")).unwrap();
        run.system = "mismatch".into();
        let system = Rc::new(System::create_in(root.path().into(), &run).unwrap());
        let node = Node::join(system.clone(), Process::Supervisor).unwrap();
        let channels = Channels::create(&node).unwrap();

        RawWriter::open(&node, SCAN.spec).unwrap();
        let expected = format!(
            "channel \"scan\" of system \"mismatch\" carries {}, this program expects {}",
            SCAN.spec.message.type_name(),
            ODOMETRY.spec.message.type_name()
        );
        let errors = [
            RawReader::open(&node, &OTHER_SCAN).err().unwrap().to_string(),
            RawWriter::open(&node, &OTHER_SCAN).err().unwrap().to_string(),
        ];
        assert!(errors.iter().all(|error| error.starts_with(&expected)), "{errors:?}");

        drop((channels, node));
        Rc::into_inner(system).unwrap().remove().unwrap();
    }
}

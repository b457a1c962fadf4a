//! The channels of a system as services of iceoryx2: created by the supervisor, opened by everyone else.

use std::any::Any;
use std::fmt::Debug;

use iceoryx2::port::publisher::PublisherCreateError;
use iceoryx2::prelude::*;
use iceoryx2::service::builder::publish_subscribe::{Builder, PublishSubscribeOpenError};
use iceoryx2::service::port_factory::publish_subscribe;
use sketchnav_schemas::channels::{self, Channel, ChannelSpec, ChannelVisitor};
use sketchnav_schemas::message::Message;

use crate::node::Node;
use crate::wire::{Wire, type_name};
use crate::{Error, Result};

/// Readers of a channel at the same time: the table's, the recorder, and a few observers.
const MAX_READERS: usize = 8;
/// Writers of a channel that has many.
const MAX_WRITERS: usize = 16;
/// Processes that have a channel open at the same time.
const MAX_NODES: usize = 32;
/// Samples that a reader holds at the same time. A sketch is large, and nobody holds an old one.
const MAX_HELD: usize = 8;
const MAX_HELD_SLICES: usize = 2;

pub(crate) type Fixed<T> = publish_subscribe::PortFactory<ipc::Service, Wire<T>, ()>;
pub(crate) type Sliced<T> = publish_subscribe::PortFactory<ipc::Service, [u8], Wire<T>>;

/// Every channel of the table, held open. While this lives, a channel outlives its writer's death.
pub struct Channels {
    _held: Vec<Box<dyn Any>>,
}

impl Channels {
    /// Creates every channel. For the supervisor alone, before it starts the processes.
    ///
    /// # Errors
    /// [`Error::SharedMemory`] where a channel cannot be created or exists already.
    pub fn create(node: &Node) -> Result<Self> {
        let mut creator = Creator { node, held: Vec::new() };
        channels::visit(&mut creator)?;
        Ok(Self { _held: creator.held })
    }
}

struct Creator<'a> {
    node: &'a Node,
    held: Vec<Box<dyn Any>>,
}

impl ChannelVisitor for Creator<'_> {
    type Error = Error;

    fn fixed<T: Message>(&mut self, channel: Channel<T>) -> Result<()> {
        let service =
            with_limits(fixed_builder::<T>(self.node, channel.spec)?, channel.spec, MAX_HELD).create();
        self.held.push(Box::new(service.map_err(creating(channel.spec))?));
        Ok(())
    }

    fn sliced<T: Message>(&mut self, channel: Channel<T>) -> Result<()> {
        let builder = sliced_builder::<T>(self.node, channel.spec)?;
        let service = with_limits(builder, channel.spec, MAX_HELD_SLICES).create();
        self.held.push(Box::new(service.map_err(creating(channel.spec))?));
        Ok(())
    }
}

/// Opens a channel of messages of fixed size.
pub(crate) fn open_fixed<T: Message>(node: &Node, spec: &'static ChannelSpec) -> Result<Fixed<T>> {
    fixed_builder::<T>(node, spec)?.open().map_err(|error| open_error::<T>(node, spec, error))
}

/// Opens a channel of messages with a slice behind them: the slice is iceoryx2's payload, the message
/// its user header, both in the same sample.
pub(crate) fn open_sliced<T: Message>(node: &Node, spec: &'static ChannelSpec) -> Result<Sliced<T>> {
    sliced_builder::<T>(node, spec)?.open().map_err(|error| open_error::<T>(node, spec, error))
}

/// Why a writer could not be made.
pub(crate) fn writer_error<P, H>(
    node: &Node,
    spec: &'static ChannelSpec,
    service: &publish_subscribe::PortFactory<ipc::Service, P, H>,
    error: PublisherCreateError,
) -> Error
where
    P: IceoryxSend + Debug + ?Sized,
    H: ZeroCopySend + Debug,
{
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

type FixedBuilder<T> = Builder<Wire<T>, (), ipc::Service>;
type SlicedBuilder<T> = Builder<[u8], Wire<T>, ipc::Service>;

fn fixed_builder<T: Message>(node: &Node, spec: &ChannelSpec) -> Result<FixedBuilder<T>> {
    Ok(node.inner().service_builder(&service_name(spec)?).publish_subscribe::<Wire<T>>())
}

fn sliced_builder<T: Message>(node: &Node, spec: &ChannelSpec) -> Result<SlicedBuilder<T>> {
    let builder = node.inner().service_builder(&service_name(spec)?).publish_subscribe::<[u8]>();
    Ok(builder.user_header::<Wire<T>>())
}

/// Safe overflow stays on: with it off, one stopped reader blocks the writer for seconds.
fn with_limits<P, H>(
    builder: Builder<P, H, ipc::Service>,
    spec: &ChannelSpec,
    max_held: usize,
) -> Builder<P, H, ipc::Service>
where
    P: IceoryxSend + Debug + ?Sized,
    H: ZeroCopySend + Debug,
{
    builder
        .enable_safe_overflow(true)
        .max_publishers(if spec.writer.is_some() { 1 } else { MAX_WRITERS })
        .max_subscribers(MAX_READERS)
        .max_nodes(MAX_NODES)
        .history_size(spec.history)
        .subscriber_max_buffer_size(spec.buffer)
        .subscriber_max_borrowed_samples(max_held)
}

fn service_name(spec: &ChannelSpec) -> Result<ServiceName> {
    spec.name.try_into().map_err(Error::shared_memory(format!("naming channel {:?}", spec.name)))
}

fn creating<E: Debug>(spec: &ChannelSpec) -> impl FnOnce(E) -> Error {
    Error::shared_memory(format!("creating channel {:?}", spec.name))
}

fn open_error<T: Message>(
    node: &Node,
    spec: &'static ChannelSpec,
    error: PublishSubscribeOpenError,
) -> Error {
    if error != PublishSubscribeOpenError::IncompatibleTypes {
        return Error::shared_memory(format!("opening channel {:?}", spec.name))(error);
    }
    Error::Mismatch {
        channel: spec.name,
        system: node.system().name().into(),
        expected: type_name::<T>().into(),
        found: found_type(node, spec).unwrap_or_else(|| "another type".into()),
    }
}

/// The type name of the message that the channel's creator gave.
fn found_type(node: &Node, spec: &ChannelSpec) -> Option<String> {
    let name = service_name(spec).ok()?;
    let pattern = iceoryx2::service::messaging_pattern::MessagingPattern::PublishSubscribe;
    let details = ipc::Service::details(&name, node.inner().config(), pattern).ok()??;
    let types = details.static_details.publish_subscribe().message_type_details();
    let message = if spec.max_slice_bytes == 0 { &types.payload } else { &types.user_header };
    Some(message.type_name().to_string())
}

#[cfg(test)]
mod tests {
    use std::rc::Rc;

    use super::*;
    use crate::reader::Reader;
    use crate::system::System;
    use crate::writer::Writer;
    use sketchnav_schemas::channels::SCAN;
    use sketchnav_schemas::codes::Process;

    use sketchnav_schemas::message::{LaserScan, Odometry};

    #[test]
    fn two_builds_that_disagree_about_a_message_cannot_meet() {
        let root = tempfile::tempdir().unwrap();
        let mut run: sketchnav_schemas::run::RunConfig =
            serde_json::from_str(include_str!("../tests/run.json")).unwrap();
        run.system = "mismatch".into();
        let system = Rc::new(System::create_in(root.path().into(), &run).unwrap());
        let node = Node::join(system.clone(), Process::Supervisor).unwrap();
        let channels = Channels::create(&node).unwrap();

        let spec = SCAN.spec;
        Writer::<LaserScan>::open(&node, spec).unwrap();
        let expected = format!(
            "channel \"scan\" of system \"mismatch\" carries {}, this program expects {}",
            type_name::<LaserScan>(),
            type_name::<Odometry>()
        );
        let errors = [
            Reader::<Odometry>::open(&node, spec).err().unwrap().to_string(),
            Writer::<Odometry>::open(&node, spec).err().unwrap().to_string(),
        ];
        assert!(errors.iter().all(|error| error.starts_with(&expected)), "{errors:?}");

        drop((channels, node));
        Rc::into_inner(system).unwrap().remove().unwrap();
    }
}

//! What a system needs of its machine, and which processes are connected to its channels,
//! for diagnostic tools. Changes nothing.

use std::path::PathBuf;

use iceoryx2::prelude::*;
use nix::sys::statvfs::statvfs;
use sketchnav_schemas::channels::ChannelSpec;

use crate::node::Node;
use crate::shared::{self, SHARED_MEMORY};
use crate::system::{self, System};
use crate::{Error, Result, root};

/// What a system may come to need of `/dev/shm`, bytes: twice what the demo's uses.
const NEEDED_BYTES: u64 = 24 << 20;

/// The room in `/dev/shm`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Room {
    /// What a system needs, MiB.
    pub needed_mib: u64,
    /// What is free, MiB.
    pub free_mib: u64,
}

impl Room {
    /// The room that is free now.
    ///
    /// # Errors
    /// [`Error::File`] if the machine has no `/dev/shm`.
    pub fn now() -> Result<Self> {
        let found = statvfs(SHARED_MEMORY)
            .map_err(|error| Error::file(SHARED_MEMORY, "asking how much room there is")(error.into()))?;
        let free = found.blocks_available() as u64 * found.fragment_size() as u64;
        Ok(Self { needed_mib: NEEDED_BYTES >> 20, free_mib: free >> 20 })
    }

    /// Checks that it is enough for a system.
    ///
    /// # Errors
    /// [`Error::NoRoom`]: pages of shared memory are allocated when they are first written,
    /// and a process that gets none is killed.
    pub fn check(self) -> Result<()> {
        let Self { needed_mib, free_mib } = self;
        if free_mib < needed_mib { Err(Error::NoRoom { needed_mib, found_mib: free_mib }) } else { Ok(()) }
    }
}

impl System {
    /// The folder of all systems of this user; created if missing.
    ///
    /// # Errors
    /// [`Error::ForeignRoot`] if others than this user can access it.
    pub fn root_folder() -> Result<PathBuf> {
        root::of_this_user()
    }

    /// The length of the longest name that a system in that folder can have.
    ///
    /// # Errors
    /// As [`System::root_folder`].
    pub fn longest_name() -> Result<usize> {
        Ok(system::longest_name(&root::of_this_user()?))
    }

    /// What dead systems have left, as [`System::sweep_dead`] names it, without removing it.
    ///
    /// # Errors
    /// [`Error::File`] if the folders cannot be read.
    pub fn dead() -> Result<Vec<String>> {
        let mut found = system::dead(&root::of_this_user()?)?;
        found.extend(shared::Survey::now()?.orphans());
        Ok(found)
    }
}

/// A process that has a channel open.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Peer {
    /// Its process id; `None` if it is dead and not cleared yet.
    pub pid: Option<u32>,
    /// Whether it writes the channel; otherwise it reads it.
    pub writes: bool,
}

impl Node {
    /// The processes that have a channel open, this node's own readers and writers included; writers first.
    ///
    /// # Errors
    /// [`Error::SharedMemory`] if the channel cannot be inspected.
    pub fn peers(&self, spec: &'static ChannelSpec) -> Result<Vec<Peer>> {
        let service = crate::channels::open(self, spec)?;
        let ports = service.dynamic_config();
        let mut peers = Vec::new();
        ports.list_publishers(|port| {
            let pid = port.node_id.pid::<ipc::Service>().ok().map(|pid| pid.value() as u32);
            peers.push(Peer { pid, writes: true });
            CallbackProgression::Continue
        });
        ports.list_subscribers(|port| {
            let pid = port.node_id.pid::<ipc::Service>().ok().map(|pid| pid.value() as u32);
            peers.push(Peer { pid, writes: false });
            CallbackProgression::Continue
        });
        Ok(peers)
    }
}

//! Reports a system's requirements of its machine, and the processes that are connected to its channels, for diagnostic tools.
//! Nothing is changed.

use std::path::PathBuf;

use iceoryx2::prelude::*;
use nix::sys::statvfs::statvfs;
use sketchnav_schemas::channels::ChannelSpec;

use crate::node::Node;
use crate::shared::{self, SHARED_MEMORY};
use crate::system::{self, System};
use crate::{Error, Result, root};

/// Space in `/dev/shm` that a system may need, in bytes: twice that of the demo.
const NEEDED_BYTES: u64 = 24 << 20;

/// The space in `/dev/shm`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Room {
    /// Space that a system needs, in MiB.
    pub needed_mib: u64,
    /// Free space, in MiB.
    pub free_mib: u64,
}

impl Room {
    /// Returns the space that is free now.
    ///
    /// # Errors
    /// [`Error::File`] if the machine has no `/dev/shm`.
    pub fn now() -> Result<Self> {
        let found = statvfs(SHARED_MEMORY)
            .map_err(|error| Error::file(SHARED_MEMORY, "querying its free space")(error.into()))?;
        let free = found.blocks_available() as u64 * found.fragment_size() as u64;
        Ok(Self { needed_mib: NEEDED_BYTES >> 20, free_mib: free >> 20 })
    }

    /// Checks that there is enough space for a system. Pages of shared memory are allocated when they are
    /// first written, and a process that does not get one is killed, so it is better to check first.
    ///
    /// # Errors
    /// [`Error::NoRoom`] if there is not enough.
    pub fn check(self) -> Result<()> {
        let Self { needed_mib, free_mib } = self;
        if free_mib < needed_mib { Err(Error::NoRoom { needed_mib, found_mib: free_mib }) } else { Ok(()) }
    }
}

impl System {
    /// Returns the folder of all systems of this user, which is created if missing.
    ///
    /// # Errors
    /// [`Error::ForeignRoot`] if other users can access it.
    pub fn root_folder() -> Result<PathBuf> {
        root::of_this_user()
    }

    /// Returns the maximum length of a system's name in that folder.
    ///
    /// # Errors
    /// See [`System::root_folder`].
    pub fn longest_name() -> Result<usize> {
        Ok(system::longest_name(&root::of_this_user()?))
    }

    /// Lists what dead systems have left behind, named as by [`System::sweep_dead`], without removing
    /// anything.
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
    /// Process id, or `None` if the process is dead and has not been cleared yet.
    pub pid: Option<u32>,
    /// Whether the process writes the channel. Otherwise, it reads it.
    pub writes: bool,
}

impl Node {
    /// Returns the processes that have a channel open, writers first, including this node's own readers and writers.
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

//! A file in shared memory that one process writes and its successor finds: what survives a kill.
//!
//! Its memory is reserved when it is made, so that a full `/dev/shm` is an error then and no signal later.

use std::fs::{File, OpenOptions};
use std::num::NonZeroUsize;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::ptr::NonNull;
use std::sync::atomic::AtomicU64;

use nix::fcntl::posix_fallocate;
use nix::sys::mman::{MapFlags, ProtFlags, mmap, munmap};

use crate::{Error, Result};

/// A mapped file. All zero where it was not there before.
pub(crate) struct Mapping {
    path: PathBuf,
    file: File,
    start: NonNull<u8>,
    length: usize,
}

impl Mapping {
    /// Opens the file, or makes it, with at least `length` bytes (more than 0).
    pub(crate) fn open(path: &Path, length: usize) -> Result<Self> {
        let mut options = OpenOptions::new();
        let file = options.read(true).write(true).create(true).truncate(false).mode(0o600).open(path);
        let file = file.map_err(Error::file(path, "opening"))?;
        let found = file.metadata().map_err(Error::file(path, "looking at it"))?.len() as usize;
        let length = found.max(length);
        let start = map(&file, path, length)?;
        Ok(Self { path: path.into(), file, start, length })
    }

    /// Makes the file at least so long; what it holds stays.
    pub(crate) fn grow(&mut self, length: usize) -> Result<()> {
        if length > self.length {
            let start = map(&self.file, &self.path, length)?;
            self.unmap();
            (self.start, self.length) = (start, length);
        }
        Ok(())
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        // SAFETY: `length` bytes are mapped as long as this lives, and nobody else writes them.
        unsafe { std::slice::from_raw_parts(self.start.as_ptr(), self.length) }
    }

    pub(crate) fn bytes_mut(&mut self) -> &mut [u8] {
        // SAFETY: as above.
        unsafe { std::slice::from_raw_parts_mut(self.start.as_ptr(), self.length) }
    }

    /// The eight bytes from `offset`, a multiple of eight, as a number that is written in one piece.
    pub(crate) fn number(&self, offset: usize) -> &AtomicU64 {
        assert!(offset.is_multiple_of(size_of::<u64>()) && offset + size_of::<u64>() <= self.length);
        // SAFETY: inside of the mapping, which begins at a page, hence aligned; this process alone
        // writes it, through this function where anybody holds its reference.
        unsafe { AtomicU64::from_ptr(self.start.as_ptr().add(offset).cast()) }
    }

    fn unmap(&mut self) {
        // SAFETY: the mapping is ours, and no reference into it outlives the borrow of `self`. It
        // cannot fail for a mapping that is there.
        let _ = unsafe { munmap(self.start.cast(), self.length) };
    }
}

impl Drop for Mapping {
    fn drop(&mut self) {
        self.unmap();
    }
}

/// Reserves the memory and maps it; a page-aligned address.
fn map(file: &File, path: &Path, length: usize) -> Result<NonNull<u8>> {
    let reserved = posix_fallocate(file, 0, length as nix::libc::off_t);
    reserved.map_err(|error| Error::file(path, "reserving its memory")(error.into()))?;
    let size = NonZeroUsize::new(length).unwrap_or(NonZeroUsize::MIN);
    let access = ProtFlags::PROT_READ | ProtFlags::PROT_WRITE;
    // SAFETY: a new mapping at an address of the kernel's choice touches no memory of ours.
    let start = unsafe { mmap(None, size, access, MapFlags::MAP_SHARED, file, 0) }
        .map_err(|error| Error::file(path, "mapping")(error.into()))?;
    Ok(start.cast())
}

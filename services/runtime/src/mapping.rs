//! A file in shared memory that one process writes, and that other processes read, including the same process after a restart. It
//! remains intact if the process is killed.
//!
//! The file is an array of atomic words. Because another process may write to it at any time, there are no plain references into
//! it, and words are copied in and out. The owner marks words that belong together with numbers that it writes first and last.
//!
//! The memory is reserved when the file is created, so a full `/dev/shm` causes an error at that point
//! instead of a signal later.

use std::fs::File;
use std::io::ErrorKind;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::ptr::NonNull;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use nix::fcntl::posix_fallocate;
use nix::sys::mman::{MapFlags, ProtFlags, mmap, munmap};

use crate::{Error, Result, shared};

/// Length of a word, in bytes.
pub(crate) const WORD: usize = size_of::<u64>();

/// A mapped file. It is all zero if this mapping has created it.
pub(crate) struct Mapping {
    path: PathBuf,
    file: File,
    start: NonNull<AtomicU64>,
    /// Length in words.
    length: usize,
}

impl Mapping {
    /// Opens the file with at least `length` words (more than 0), creating it if it is missing.
    ///
    /// # Errors
    /// [`Error::ForeignFile`] if another user has created it, or it is a link.
    pub(crate) fn open(path: &Path, length: usize) -> Result<Self> {
        let file = match shared::private(path) {
            Ok(file) => file,
            Err(error) if error.kind() == ErrorKind::AlreadyExists => shared::open_own(path)?,
            Err(error) => return Err(Error::file(path, "creating it")(error)),
        };
        let found = file.metadata().map_err(Error::file(path, "inspecting it"))?.len() as usize / WORD;
        let length = found.max(length);
        let start = map(&file, path, length)?;
        Ok(Self { path: path.into(), file, start, length })
    }

    /// Makes the file at least `length` words long. Its content is kept.
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

    /// Returns the words of the file.
    pub(crate) fn words(&self) -> &[AtomicU64] {
        // SAFETY: `length` words are mapped for the lifetime of `self`, from the beginning of a page. Every process
        // that maps the file accesses it only through atomic words.
        unsafe { std::slice::from_raw_parts(self.start.as_ptr(), self.length) }
    }

    /// Copies words into `into`, starting at index `first`.
    pub(crate) fn read(&self, first: usize, into: &mut [u64]) {
        let words = &self.words()[first..first + into.len()];
        into.iter_mut().zip(words).for_each(|(into, word)| *into = word.load(Relaxed));
    }

    /// Copies `from` into the file, starting at index `first`.
    pub(crate) fn write(&self, first: usize, from: &[u64]) {
        let words = &self.words()[first..first + from.len()];
        words.iter().zip(from).for_each(|(word, from)| word.store(*from, Relaxed));
    }

    fn unmap(&mut self) {
        // SAFETY: the mapping is ours, and no reference into it outlives the borrow of `self`. Unmapping an existing mapping
        // cannot fail.
        let _ = unsafe { munmap(self.start.cast(), self.length * WORD) };
    }
}

impl Drop for Mapping {
    fn drop(&mut self) {
        self.unmap();
    }
}

/// Reserves memory for `length` words and maps it. Returns a page-aligned address.
fn map(file: &File, path: &Path, length: usize) -> Result<NonNull<AtomicU64>> {
    let bytes = length * WORD;
    let reserved = posix_fallocate(file, 0, bytes as nix::libc::off_t);
    reserved.map_err(|error| Error::file(path, "reserving its memory")(error.into()))?;
    let size = NonZeroUsize::new(bytes).unwrap_or(NonZeroUsize::MIN);
    let access = ProtFlags::PROT_READ | ProtFlags::PROT_WRITE;
    // SAFETY: a new mapping at an address of the kernel's choice touches no memory of ours.
    let start = unsafe { mmap(None, size, access, MapFlags::MAP_SHARED, file, 0) }
        .map_err(|error| Error::file(path, "mapping")(error.into()))?;
    Ok(start.cast())
}

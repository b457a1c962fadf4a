//! The file of a recording. It is created without overwriting an earlier one, and truncated to its complete part if the disk
//! is full.

use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Seek};
use std::path::{Path, PathBuf};

/// A second handle to the file that the recording is written to.
pub struct Disk {
    /// This handle shares its position with the one that is written to.
    file: File,
    whole_bytes: u64,
}

impl Disk {
    /// Creates the file at `path`, which must not exist. Its folder is created if missing.
    ///
    /// # Errors
    /// Any error of the system.
    pub fn create(path: &Path) -> io::Result<(Self, BufWriter<File>)> {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        let file = OpenOptions::new().write(true).create_new(true).open(path)?;
        let sink = BufWriter::new(file.try_clone()?);
        Ok((Self { file, whole_bytes: 0 }, sink))
    }

    /// Marks everything written so far as complete. Call this after a flush.
    ///
    /// # Errors
    /// Any error of the system.
    pub fn mark_whole(&mut self) -> io::Result<()> {
        self.whole_bytes = self.file.stream_position()?;
        Ok(())
    }

    /// Returns the length of the complete part of the file, in bytes.
    pub fn whole_bytes(&self) -> u64 {
        self.whole_bytes
    }

    /// Syncs the file to the device, in case the power fails.
    ///
    /// # Errors
    /// Any error of the system.
    pub fn sync(&self) -> io::Result<()> {
        self.file.sync_data()
    }

    /// Truncates the file to its complete part, removing the incomplete data that was being written when the disk filled up.
    ///
    /// # Errors
    /// Any error of the system.
    pub fn cut_back(&self) -> io::Result<()> {
        self.file.set_len(self.whole_bytes)
    }
}

/// Frees the name `path`. An existing recording of an earlier run is renamed to `NAME.1.mcap` and so on.
///
/// # Errors
/// Any error of the system.
pub fn set_aside(path: &Path) -> io::Result<()> {
    match std::fs::metadata(path) {
        Ok(there) if there.is_file() => std::fs::rename(path, free_name(path)),
        // A folder or a device is not a recording.
        Ok(_) => Err(io::Error::other("expected the name of a file, found something else")),
        Err(_) => Ok(()),
    }
}

/// Returns the file of a part of a recording. The first part is the recording itself, `NAME.mcap`. After a
/// recorder was killed, the next one writes `NAME.part2.mcap` and so on.
pub fn part(path: &Path, number: u32) -> PathBuf {
    if number == 1 { path.to_path_buf() } else { path.with_extension(format!("part{number}.mcap")) }
}

fn free_name(path: &Path) -> PathBuf {
    let numbered = (1..).map(|n: u32| path.with_extension(format!("{n}.mcap")));
    numbered.into_iter().find(|name| !name.exists()).unwrap_or_else(|| path.with_extension("old.mcap"))
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn an_earlier_recording_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("runs/demo.mcap");
        for _ in 0..3 {
            set_aside(&path).unwrap();
            let (_, mut sink) = Disk::create(&path).unwrap();
            sink.write_all(b"something").unwrap();
        }
        for name in ["demo.mcap", "demo.1.mcap", "demo.2.mcap"] {
            assert_eq!(std::fs::read(path.with_file_name(name)).unwrap(), b"something", "{name}");
        }
        assert!(set_aside(folder.path()).is_err() && folder.path().is_dir());
    }

    #[test]
    fn an_incomplete_end_can_be_cut_off() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("demo.mcap");
        let (mut disk, mut sink) = Disk::create(&path).unwrap();
        sink.write_all(b"whole").unwrap();
        sink.flush().unwrap();
        disk.mark_whole().unwrap();
        sink.write_all(b"half").unwrap();
        drop(sink);
        disk.cut_back().unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"whole");
    }
}

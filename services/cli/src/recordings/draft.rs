//! Files that appear under their names when they are whole. Until then an earlier file of that name stays, which may
//! be the very file that is being read. What is no file, a pipe or a device, is written as it is.

use std::ffi::OsString;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use anyhow::Context;

/// Where a draft is written to.
pub type Sink = BufWriter<File>;

/// A file that is moved to its name when it is whole; dropped before, it is gone.
pub struct Draft {
    path: PathBuf,
    /// None where there is nothing to be moved.
    draft: Option<PathBuf>,
}

impl Draft {
    /// Begins `path`, as `path.unfinished` beside it; of a link, where it leads to.
    pub fn begin(path: &Path) -> io::Result<(Self, Sink)> {
        if std::fs::metadata(path).is_ok_and(|there| !there.is_file()) {
            // To be moved over, a device would be gone; a folder is refused here.
            let file = File::options().write(true).open(path)?;
            return Ok((Self { path: path.to_owned(), draft: None }, BufWriter::new(file)));
        }
        let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let mut draft = OsString::from(&path);
        draft.push(".unfinished");
        let draft = PathBuf::from(draft);
        let file = File::create(&draft)?;
        Ok((Self { path, draft: Some(draft) }, BufWriter::new(file)))
    }

    /// Gives it its name, once its sink was flushed.
    pub fn finish(self) -> anyhow::Result<()> {
        let Some(draft) = &self.draft else { return Ok(()) };
        let work = || {
            File::open(draft)?.sync_data()?;
            std::fs::rename(draft, &self.path)
        };
        work().with_context(|| self.path.display().to_string())
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        if let Some(draft) = &self.draft {
            // After `finish` there is none.
            let _ = std::fs::remove_file(draft);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};

    use super::*;

    #[test]
    fn what_was_there_stays_until_the_draft_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mcap");
        std::fs::write(&path, "old").unwrap();
        let mut reading = File::open(&path).unwrap();
        let (draft, mut sink) = Draft::begin(&path).unwrap();
        sink.write_all(b"new").unwrap();
        sink.flush().unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        draft.finish().unwrap();
        let mut text = String::new();
        reading.read_to_string(&mut text).unwrap();
        assert_eq!((text.as_str(), std::fs::read(&path).unwrap().as_slice()), ("old", &b"new"[..]));
        drop(Draft::begin(&path).unwrap());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    /// `-o /dev/null`, as root, made a file of the device.
    #[test]
    fn what_is_no_file_stays_what_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let (pipe, link, file) = ["pipe", "link", "file"].map(|name| folder.path().join(name)).into();
        nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRWXU).unwrap();
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || std::fs::read(pipe).unwrap()
        });
        let (draft, mut sink) = Draft::begin(&pipe).unwrap();
        sink.write_all(b"said").unwrap();
        sink.flush().unwrap();
        drop(sink);
        draft.finish().unwrap();
        assert_eq!(reader.join().unwrap(), b"said");
        assert!(!std::fs::metadata(&pipe).unwrap().is_file());
        std::fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        Draft::begin(&link).unwrap().0.finish().unwrap();
        assert!(link.is_symlink() && std::fs::read(&file).unwrap().is_empty());
        let error = Draft::begin(folder.path()).err().unwrap();
        assert_eq!(error.kind(), io::ErrorKind::IsADirectory);
    }
}

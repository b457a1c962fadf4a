//! Files that appear under their names when they are whole: until then what was there before stays, which may
//! be the very file that is being read.

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
    draft: PathBuf,
}

impl Draft {
    /// Begins `path`, as `path.unfinished` beside it.
    pub fn begin(path: &Path) -> io::Result<(Self, Sink)> {
        let mut draft = OsString::from(path);
        draft.push(".unfinished");
        let draft = PathBuf::from(draft);
        let file = File::create(&draft)?;
        Ok((Self { path: path.to_owned(), draft }, BufWriter::new(file)))
    }

    /// Gives it its name, once its sink was flushed.
    pub fn finish(self) -> anyhow::Result<()> {
        let work = || {
            File::open(&self.draft)?.sync_data()?;
            std::fs::rename(&self.draft, &self.path)
        };
        work().with_context(|| self.path.display().to_string())
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        // After `finish` there is none.
        let _ = std::fs::remove_file(&self.draft);
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
}

//! Ensures that a recording gets its final name only when it is complete, and never replaces a file that
//! contains more. All commands that write recordings use this module.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use sketchnav_files::draft::{Draft, Sink, is_same};
use sketchnav_recordings::copy::{self, Copy, Held};
use sketchnav_recordings::{RecordingError, info};

/// The files that a recording must not replace.
#[derive(Debug, Default)]
pub struct Guard {
    /// The files that the recording was made from.
    sources: Vec<PathBuf>,
    /// Whether all existing recordings are guarded, or only the sources.
    guards_all: bool,
    /// Whether the recording may replace one that contains more. `None` if the command has no `--force`.
    force: Option<bool>,
}

impl Guard {
    /// Guards the files that a recording is made from.
    pub fn of(sources: impl IntoIterator<Item = PathBuf>) -> Self {
        Self { sources: sources.into_iter().collect(), ..Self::default() }
    }

    /// Sets the value of `--force`.
    #[must_use]
    pub fn with_force(self, force: bool) -> Self {
        Self { force: Some(force), ..self }
    }

    /// Guards all recordings, whether they are sources or not.
    #[must_use]
    pub fn over_all(self) -> Self {
        Self { guards_all: true, ..self }
    }

    /// Checks a draft, which should contain `messages` messages, and moves it to its final name.
    ///
    /// # Errors
    /// If the draft is incomplete, or would replace a file that contains more. An existing file is then left unchanged.
    pub fn place(&self, draft: Draft, messages: u64) -> anyhow::Result<()> {
        if let Some(written) = draft.written() {
            check_written(written, messages).with_context(|| draft.path().display().to_string())?;
            self.check_replaced(draft.path(), messages)?;
        }
        let path = draft.path().to_owned();
        draft.finish().with_context(|| path.display().to_string())
    }

    fn check_replaced(&self, path: &Path, messages: u64) -> anyhow::Result<()> {
        if std::fs::metadata(path).map_or(0, |there| there.len()) == 0 {
            return Ok(());
        }
        let is_source = self.sources.iter().any(|source| is_same(source, path));
        // The existing file may be a map, a drawing or a log, in which case the output is probably a mistake.
        copy::profile(path).map_err(|error| not_a_recording(path, error))?;
        if !(is_source || self.guards_all) || self.force == Some(true) {
            return Ok(());
        }
        let Held { messages: held, is_known } = copy::held(path)?;
        let way_on = match self.force {
            Some(_) => "choose another --output, or use --force",
            None => "choose another --output",
        };
        let place = path.display();
        ensure!(
            messages >= held,
            "{place}: expected at least the {held} messages of the file that would be replaced, found {messages}; it is \
             unchanged: {way_on}"
        );
        ensure!(
            is_known,
            "{place}: would be replaced by a copy without its damaged parts, whose content is not known; it is \
             unchanged: {way_on}"
        );
        Ok(())
    }
}

fn not_a_recording(path: &Path, error: RecordingError) -> anyhow::Error {
    let place = path.display();
    match error {
        RecordingError::Foreign { found, .. } => {
            anyhow::anyhow!(
                "{place}: expected a recording to replace, or no file, found {found}; it is unchanged"
            )
        }
        error => anyhow::Error::from(error)
            .context(format!("{place}: expected a recording to replace, or no file")),
    }
}

/// Reads a written file back before it replaces another one, in case the disk was full without an error or this program
/// has a bug.
fn check_written(path: &Path, messages: u64) -> anyhow::Result<()> {
    let found = info::info(path).context("reading what was written")?;
    if !found.clean_end || found.messages != messages {
        let end = if found.clean_end { "its end" } else { "no end" };
        bail!("expected {messages} messages written and the end, found {} and {end}", found.messages);
    }
    Ok(())
}

/// Begins a copy of messages with this profile. [`finish`] moves it to its final name.
pub fn begin(path: &Path, profile: &str) -> anyhow::Result<(Draft, Copy<Sink>)> {
    let (draft, sink) = Draft::begin(path).with_context(|| path.display().to_string())?;
    Ok((draft, Copy::of_profile(sink, profile)?))
}

/// Ends a copy and moves it to its final name.
pub fn finish(draft: Draft, copy: Copy<Sink>, guard: &Guard) -> anyhow::Result<()> {
    let messages = copy.messages();
    copy.finish()?;
    guard.place(draft, messages)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use clap::Parser;
    use proptest::prelude::*;
    use sketchnav_recordings::samples::{SampleForm, points, recording};

    use super::*;
    use crate::args::Cli;

    const COUNT: u64 = 25;
    const PER_CHUNK: usize = 10;

    /// Every way to ask a command to overwrite a file that it reads.
    const COMMANDS: [&str; 15] = [
        "recover X -o X",
        "recover X --keep-damaged -o X",
        "recover X -o X.unfinished",
        "recover X.unfinished -o X",
        "filter X -o X",
        "filter X --topics ball -o X",
        "filter X --end 1 -o X",
        "merge X X -o X",
        "split X --seconds 1 -o F",
        "import X --map X -o X",
        "import L --map X -o X",
        "report X -o X",
        "rerun X --process localizer -o X",
        "judge X --csv X",
        "deform X -o X",
    ];

    fn run(folder: &Path, line: &str) -> Result<crate::failure::Outcome, crate::failure::Failure> {
        let place = |name: &str| folder.join(name).display().to_string();
        let word = |word: &str| match word {
            "X" => place("x.mcap"),
            "X.unfinished" => place("x.mcap.unfinished"),
            "L" => place("log.log"),
            "F" => folder.display().to_string(),
            word => word.to_owned(),
        };
        crate::dispatch(Cli::parse_from(
            std::iter::once("sketchnav".to_owned()).chain(line.split(' ').map(word)),
        ))
    }

    fn sample(compression: &'static str, has_checksums: bool) -> Vec<u8> {
        let form = SampleForm { compression, has_checksums, per_chunk: PER_CHUNK, ..SampleForm::default() };
        recording(form, &[points("/ball", COUNT, false), points("/cup", COUNT, false)])
    }

    /// Returns the number of messages in the chunks that end before this byte.
    fn before(file: &[u8], end: usize) -> u64 {
        let (mut at, mut messages) = (8, 0);
        while at + 9 <= end {
            let length = u64::from_le_bytes(file[at + 1..at + 9].try_into().unwrap()) as usize;
            if file[at] == 6 && at + 9 + length <= end {
                messages += PER_CHUNK as u64;
            }
            at += 9 + length;
        }
        messages
    }

    /// Returns true if the source is unchanged, byte for byte, or contains at least `least` messages.
    fn survives(path: &Path, source: &[u8], least: u64) -> bool {
        let now = std::fs::read(path).unwrap_or_default();
        now == source
            || info::info_of_messages(path).is_ok_and(|info| info.clean_end && info.messages >= least)
    }

    #[derive(Debug, Clone)]
    enum Change {
        None,
        Cut(prop::sample::Index),
        Flips(Vec<(prop::sample::Index, u8)>),
        Other(Vec<u8>),
    }

    fn change() -> impl Strategy<Value = Change> {
        let flip = (any::<prop::sample::Index>(), 1..=255_u8);
        let foreign = prop::sample::select(vec![
            &b"SQLite format 3\0 a database"[..],
            b"#ROSBAG V2.0",
            b"image: m.pgm",
            b"",
            b"\x28\xb5\x2f\xfd nothing that unpacks",
        ]);
        prop_oneof![
            Just(Change::None),
            any::<prop::sample::Index>().prop_map(Change::Cut),
            prop::collection::vec(flip, 1..4).prop_map(Change::Flips),
            foreign.prop_map(|bytes| Change::Other(bytes.to_vec())),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn a_source_is_replaced_only_by_a_result_with_as_much(
            compression in prop::sample::select(vec!["", "lz4", "zstd", "snappy"]),
            has_checksums in any::<bool>(),
            change in change(),
        ) {
            let mut source = sample(compression, has_checksums);
            let mut least = 2 * COUNT;
            match change {
                Change::None => {}
                Change::Cut(cut) => {
                    let cut = cut.index(source.len());
                    least = before(&source, cut);
                    source.truncate(cut);
                }
                Change::Flips(flips) => {
                    for (at, by) in flips {
                        let at = at.index(source.len());
                        source[at] ^= by;
                    }
                }
                Change::Other(bytes) => source = bytes,
            }
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("x.mcap");
            let beside = folder.path().join("x.mcap.unfinished");
            for command in COMMANDS {
                std::fs::write(&path, &source).unwrap();
                std::fs::write(&beside, &source).unwrap();
                std::fs::write(folder.path().join("log.log"), "FLASER 2 1.0 1.0 0 0 0 0 0 0 0.1 host 0.1\n").unwrap();
                let _ = run(folder.path(), command);
                prop_assert!(survives(&path, &source, least), "{command}");
                prop_assert!(survives(&beside, &source, least), "{command}: beside");
            }
        }
    }

    #[test]
    fn a_smaller_copy_needs_force() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.mcap");
        let source = sample("zstd", false);
        std::fs::write(&path, &source).unwrap();
        let refused = run(folder.path(), "recover X -o X").unwrap_err();
        let words = format!("{refused:?}");
        assert!(words.contains("expected at least the 50 messages") && words.contains("--force"), "{words}");
        assert_eq!(std::fs::read(&path).unwrap(), source);
        // Everything is copied, including the damaged messages.
        assert!(run(folder.path(), "recover X --keep-damaged -o X").is_ok());
        assert_eq!(info::info(&path).unwrap().messages, 50);
        assert!(run(folder.path(), "filter X --topics ball -o X").is_err());
        assert!(run(folder.path(), "filter X --topics ball --force -o X").is_ok());
        assert_eq!(info::info(&path).unwrap().messages, 25);
        std::fs::write(&path, &source).unwrap();
        assert!(run(folder.path(), "recover X --force -o X").is_ok());
        assert_eq!(info::info(&path).unwrap().messages, 0);
    }

    #[test]
    fn a_recording_replaces_only_recordings() {
        let folder = tempfile::tempdir().unwrap();
        let source = folder.path().join("x.mcap");
        std::fs::write(&source, sample("zstd", true)).unwrap();
        for (name, content) in [("m.yaml", &b"image: m.pgm"[..]), ("m.pgm", b"P5 1 1 255 \0")] {
            let path = folder.path().join(name);
            std::fs::write(&path, content).unwrap();
            let line = ["sketchnav", "filter", source.to_str().unwrap(), "-o", path.to_str().unwrap()];
            let error = format!("{:?}", crate::dispatch(Cli::parse_from(line)).unwrap_err());
            assert!(error.contains("expected a recording to replace"), "{error}");
            assert_eq!(std::fs::read(&path).unwrap(), content);
        }
    }

    /// Files that only write into folders that they have created, with the reason for each.
    const OWN_FOLDERS: [&str; 4] = [
        // Each run gets a new folder.
        "mission.rs",
        // The folder is temporary.
        "eval/elsewhere.rs",
        "eval/processes.rs",
        "recordings/whole.rs",
    ];

    /// Any other way of writing a result could leave half of it in the place of a complete file.
    #[test]
    fn results_are_written_in_one_way() {
        let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("services/cli/src");
        let (mut folders, mut files, mut found) = (vec![sources.clone()], 0, Vec::new());
        while let Some(folder) = folders.pop() {
            for path in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
                if path.is_dir() {
                    folders.push(path);
                    continue;
                }
                // Modules that contain only tests may write files in other ways.
                if path.file_name().is_some_and(|name| name == "tests.rs") {
                    continue;
                }
                let text = std::fs::read_to_string(&path).unwrap();
                let code = text.split("#[cfg(test)]").next().unwrap_or_default();
                let name = path.strip_prefix(&sources).unwrap().display().to_string();
                let writes = ["std::fs::write(", "fs::rename(", "File::create("]
                    .iter()
                    .any(|call| code.contains(call));
                if writes && !OWN_FOLDERS.contains(&name.as_str()) {
                    found.push(name);
                }
                files += 1;
            }
        }
        assert!(files > 50, "{files}");
        assert_eq!(found, Vec::<String>::new(), "write by sketchnav_files::write or a Draft");
    }

    #[test]
    fn results_are_read_back_before_they_count() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("y.mcap");
        std::fs::write(&path, sample("zstd", true)).unwrap();
        let whole = std::fs::read(&path).unwrap();
        let (draft, mut sink) = Draft::begin(&path).unwrap();
        std::io::Write::write_all(&mut sink, &whole[..whole.len() / 2]).unwrap();
        std::io::Write::flush(&mut sink).unwrap();
        let error = format!("{:#}", Guard::default().place(draft, 50).unwrap_err());
        assert!(error.contains("expected 50 messages written"), "{error}");
        assert_eq!(std::fs::read(&path).unwrap(), whole);
    }
}

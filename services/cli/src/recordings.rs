//! The tools for recordings, one subcommand each.

mod account;
pub mod args;
pub mod guard;
mod import;
pub mod judge;
mod learn;
mod replay;
pub mod report;
mod rerun;
mod rewrite;
pub mod snapshot;
pub mod whole;

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use sketchnav_recordings::{Recording, copy};

use crate::failure::{Failure, OrInput, Outcome};
use crate::output::say;
use args::Tool;
use whole::Whole;

/// Runs a subcommand.
pub fn dispatch(tool: Tool) -> Result<Outcome, Failure> {
    match tool {
        Tool::Replay { file, options } => with(&file, |whole| replay::replay(whole.path(), &options)),
        Tool::Rerun { file, options } => with(&file, |whole| rerun::rerun(whole, &options)),
        Tool::Judge { files, options } => with_all(&files, |wholes| {
            let inputs: Vec<_> = wholes.iter().flat_map(Whole::sources).chain(options.inputs()).collect();
            options.csv.iter().try_for_each(|csv| refuse_to_overwrite(inputs.iter().copied(), csv))?;
            judge::judge(wholes, &options)
        }),
        Tool::Report { file, output, rooms, force, json } => with(&file, |whole| {
            refuse_to_overwrite(whole.sources().iter().chain(&rooms), &output)?;
            refuse_a_recording(&output, Some(force))?;
            report::report(whole, &output, rooms.as_deref(), json)
        }),
        Tool::Learn { file, options } => learn::learn(&file, &options),
        Tool::Import { log, options } => import::import(&log, &options),
        Tool::Recover { file, options } => rewrite::recover(&file, &options),
        Tool::Filter { file, options } => with(&file, |whole| rewrite::filter(whole, &options)),
        Tool::Merge { files, output, json } => {
            with_all(&files, |wholes| rewrite::merge(wholes, &output, json))
        }
        Tool::Split { file, options } => with(&file, |whole| rewrite::split(whole, &options)),
    }
}

/// Calls `work` with the recording that the path `file` refers to. Errors name that path, even if the
/// recording is in a temporary file.
pub fn with(file: &Path, work: impl FnOnce(&Whole) -> Result<Outcome, Failure>) -> Result<Outcome, Failure> {
    let whole = Whole::of(file)?;
    whole.known(work(&whole))
}

/// Like [`with`], but for several recordings.
pub fn with_all(
    files: &[PathBuf],
    work: impl FnOnce(&[Whole]) -> Result<Outcome, Failure>,
) -> Result<Outcome, Failure> {
    let wholes = Whole::of_all(files)?;
    wholes.iter().fold(work(&wholes), |result, whole| whole.known(result))
}

/// Rejects an output that would overwrite an input.
fn refuse_to_overwrite<'a>(
    inputs: impl IntoIterator<Item = &'a PathBuf>,
    output: &Path,
) -> Result<(), Failure> {
    sketchnav_files::draft::refuse_to_overwrite(inputs.into_iter().map(PathBuf::as_path), output).or_input()
}

/// Rejects an output that is not a recording but would overwrite one, which is probably a mistake. `force` is the value of the
/// command's option `--force`, which permits this, or `None` if the command has no such option.
fn refuse_a_recording(output: &Path, force: Option<bool>) -> Result<(), Failure> {
    let is_recording = || output.is_file() && (whole::is_packed(output) || copy::profile(output).is_ok());
    if force == Some(true) || !is_recording() {
        return Ok(());
    }
    let place = output.display();
    let remedy =
        if force.is_some() { "choose another --output, or use --force" } else { "choose another file" };
    Err(Failure::Input(anyhow!(
        "{place}: expected a file to replace, or none, found a recording; it is unchanged: {remedy}"
    )))
}

/// Warns that a recording is cut off, and so covers only part of the run.
pub fn tell_cut_off(name: impl std::fmt::Display) {
    say!("notice: {name} is cut off; the rest is intact");
}

fn open(path: &Path) -> Result<Recording, Failure> {
    Recording::open(path).or_input()
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use sketchnav_recordings::samples::{SampleForm, SampleTopic, points, recording};

    use crate::args::Cli;

    /// A temporary folder with a recording for running commands.
    struct Place(tempfile::TempDir);

    impl Place {
        fn new(form: SampleForm, topics: &[SampleTopic]) -> Self {
            let place = Self(tempfile::tempdir().unwrap());
            std::fs::write(place.0.path().join("x.mcap"), recording(form, topics)).unwrap();
            place
        }

        /// Runs a command and returns its error, or an empty string if it succeeds.
        fn run(&self, line: &str) -> String {
            let ends = [".mcap", ".html", ".zstd", "parts.d"];
            let here = |word: &str| match ends.iter().any(|end| word.ends_with(end)) {
                true => self.0.path().join(word).display().to_string(),
                false => word.to_owned(),
            };
            let words = std::iter::once("sketchnav".to_owned()).chain(line.split(' ').map(here));
            crate::dispatch(Cli::parse_from(words)).err().map_or(String::new(), |error| format!("{error:?}"))
        }
    }

    const READ: [&str; 10] = [
        "info x.mcap",
        "echo ball --file x.mcap --count 1",
        "echo /ball --file x.mcap --csv --once",
        "hz --regex .* --file x.mcap",
        "filter x.mcap --topics ball -o y.mcap",
        "merge x.mcap x.mcap -o z.mcap",
        "split x.mcap --seconds 1 -o parts.d",
        "recover x.mcap -o r.mcap",
        "relations x.mcap --calculus qtc-b --quantisation-m 0.01",
        "report x.mcap -o page.html",
    ];

    #[test]
    fn commands_for_any_recording_accept_those_of_other_tools() {
        let big_endian = [points("/ball", 25, true), points("/cup", 25, true)];
        let plain = [points("/ball", 25, false), points("/cup", 25, false)];
        for (form, topics) in [
            (SampleForm::default(), &plain),
            (SampleForm { compression: "lz4", ..SampleForm::default() }, &plain),
            (SampleForm::default(), &big_endian),
        ] {
            let place = Place::new(form, topics);
            for line in READ {
                let error = place.run(line);
                assert!(error.is_empty(), "{line}: {error}");
            }
            let page = std::fs::read_to_string(place.0.path().join("page.html")).unwrap();
            for words in
                ["/cup", "geometry_msgs/msg/PointStamped", "another tool", "not a sketchnav recording"]
            {
                assert!(page.contains(words), "{words}");
            }
        }
    }

    #[test]
    fn commands_for_runs_name_those_for_other_recordings() {
        let place = Place::new(SampleForm::default(), &[points("/ball", 25, false)]);
        for line in
            ["judge x.mcap", "rerun x.mcap --process localizer", "replay x.mcap", "diff x.mcap x.mcap"]
        {
            let error = place.run(line);
            let words = ["expected a recording of sketchnav", "info, echo, hz, filter, merge, split"];
            assert!(words.iter().all(|words| error.contains(words)), "{line}: {error}");
        }
        assert!(place.run("echo cup --file x.mcap").contains("expected one of ball, found"));
        assert!(place.run("relations x.mcap --calculus qtc-b").contains("2 objects or more, found ball"));
    }

    #[test]
    fn messages_of_another_form_are_described() {
        let ros1 = SampleTopic { encoding: "ros1", language: "ros1msg", ..points("/ball", 25, false) };
        let place = Place::new(SampleForm { profile: "ros1", ..SampleForm::default() }, &[ros1]);
        for line in READ.iter().filter(|line| !line.starts_with("echo") && !line.starts_with("relations")) {
            let error = place.run(line);
            assert!(error.is_empty(), "{line}: {error}");
        }
        for line in ["echo ball --file x.mcap", "relations x.mcap --calculus qtc-b"] {
            let error = place.run(line);
            assert!(
                error.contains("found ROS 1 messages") && error.contains("rosbags-convert"),
                "{line}: {error}"
            );
        }
        let json = SampleTopic {
            name: "/text",
            kind: "",
            language: "",
            definition: "",
            encoding: "json",
            messages: vec![(1_700_000_000_000_000_000, 0, b"{ \"a\": 1 }".to_vec())],
        };
        let place = Place::new(SampleForm::default(), &[json]);
        assert_eq!(place.run("echo text --file x.mcap --field a"), "");
    }

    /// Regression test: a single message that could not be decoded used to make `echo` and `relations` fail.
    #[test]
    fn a_message_that_cannot_be_decoded_is_skipped() {
        let cut = |count: usize| {
            let mut ball = points("/ball", 25, false);
            ball.messages.iter_mut().take(count).for_each(|(.., message)| message.truncate(20));
            Place::new(SampleForm::default(), &[ball, points("/cup", 25, false)])
        };
        let place = cut(2);
        for line in
            ["echo ball --file x.mcap", "echo ball --file x.mcap --once", "relations x.mcap --calculus qtc-b"]
        {
            assert_eq!(place.run(line), "", "{line}");
        }
        // If no message is left, the command fails with the error of the first one.
        assert!(cut(25).run("echo ball --file x.mcap").contains("found the end of the message"));
    }

    /// Regression test: `filter -o pipe` used to wait forever for a process to read the pipe.
    #[test]
    fn a_pipe_without_a_reader_is_refused_as_output() {
        let place =
            Place::new(SampleForm::default(), &[points("/ball", 25, false), points("/cup", 25, false)]);
        let pipe = place.0.path().join("pipe.mcap");
        nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRWXU).unwrap();
        for line in [
            "filter x.mcap -o pipe.mcap",
            "merge x.mcap x.mcap -o pipe.mcap",
            "recover x.mcap -o pipe.mcap",
            "report x.mcap -o pipe.mcap",
        ] {
            let error = place.run(line);
            assert!(error.contains("pipe.mcap"), "{line}: {error}");
            assert!(error.contains("found a pipe without one; start its reader first"), "{line}: {error}");
        }
        for line in [
            "info pipe.mcap",
            "echo ball --file pipe.mcap",
            "filter pipe.mcap -o y.mcap",
            "diff pipe.mcap x.mcap",
        ] {
            let error = place.run(line);
            assert!(error.contains("found a pipe"), "{line}: {error}");
        }
    }

    /// Regression test: a page once replaced a recording whose name resembled the intended one.
    #[test]
    fn no_page_overwrites_another_recording_without_force() {
        let place = Place::new(SampleForm::default(), &[points("/ball", 25, false)]);
        let other = place.0.path().join("other.mcap");
        let packed = place.0.path().join("packed.zstd");
        let recording = std::fs::read(place.0.path().join("x.mcap")).unwrap();
        std::fs::write(&other, &recording).unwrap();
        std::fs::write(&packed, sketchnav_recordings::samples::packed("zstd", &recording)).unwrap();
        for line in ["report x.mcap -o other.mcap", "report x.mcap -o packed.zstd"] {
            assert!(place.run(line).contains("found a recording; it is unchanged"), "{line}");
        }
        assert_eq!(std::fs::read(&other).unwrap(), recording);
        assert_eq!(place.run("report x.mcap -o other.mcap --force"), "");
        assert!(std::fs::read(&other).unwrap().starts_with(b"<!"));
        assert_eq!(place.run("report x.mcap -o other.mcap"), "", "a page may be written again");
    }

    /// Regression test: `report` once overwrote a packed recording with its page.
    #[test]
    fn no_page_overwrites_the_recording_that_it_shows() {
        let place = Place::new(SampleForm::default(), &[points("/ball", 25, false)]);
        let packed = sketchnav_recordings::samples::packed(
            "zstd",
            &std::fs::read(place.0.path().join("x.mcap")).unwrap(),
        );
        let file = place.0.path().join("x.mcap.zstd");
        std::fs::write(&file, &packed).unwrap();
        assert!(
            place.run("report x.mcap.zstd -o x.mcap.zstd").contains("expected a file other than the input")
        );
        assert_eq!(std::fs::read(&file).unwrap(), packed);
    }
}

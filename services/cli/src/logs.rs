//! Prints the output of a running system's processes, and follows it.

use std::fs::File;
use std::io::{ErrorKind, Read, Seek, SeekFrom};
use std::path::PathBuf;
use std::thread::sleep;
use std::time::Duration;

use anyhow::Context;
use sketchnav_runtime::System;
use sketchnav_schemas::channels::{EXTRAS, SERVICES};
use sketchnav_schemas::codes::Process;

use crate::args::LogsOptions;
use crate::failure::{Failure, Outcome};
use crate::output::live;
use crate::systems;

/// Interval at which to look for more output.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// Maximum length of a line, in bytes. A longer line is printed in pieces.
const MAX_LINE: usize = 64 << 10;
/// Length of a log's end that is searched for its last lines, in bytes.
const MAX_TAIL: u64 = 4 << 20;

/// Prints the last lines of each process's log and, with `--follow`, new lines as they are written.
pub fn logs(options: &LogsOptions) -> Result<Outcome, Failure> {
    let system = systems::find(options.system.as_deref())?;
    let wanted = |process: &Process| options.processes.is_empty() || options.processes.contains(process);
    let processes = SERVICES.into_iter().chain(EXTRAS).filter(wanted);
    let mut logs: Vec<_> = processes.map(|process| Log::of(&system, process)).collect();
    for log in &mut logs {
        log.tail(options.lines).with_context(|| log.path.display().to_string())?;
        log.print(options)?;
    }
    if options.follow {
        follow(&system, &mut logs, options)?;
    }
    Ok(Outcome::Success)
}

/// Prints new lines until the system ends.
fn follow(system: &System, logs: &mut [Log], options: &LogsOptions) -> anyhow::Result<()> {
    loop {
        // Checked before reading, so that lines written before the end are not missed.
        let has_ended = System::open(system.name()).is_err();
        for log in &mut *logs {
            log.read().with_context(|| log.path.display().to_string())?;
            log.print(options)?;
        }
        if has_ended {
            return Ok(());
        }
        sleep(LOOK_EVERY);
    }
}

/// The output of one process.
struct Log {
    process: Process,
    path: PathBuf,
    /// The log, opened as soon as it exists, since it may be removed before its last lines are read.
    file: Option<File>,
    /// Bytes that were read but not printed yet.
    rest: Vec<u8>,
}

impl Log {
    fn of(system: &System, process: Process) -> Self {
        Self { process, path: system.log_path(process), file: None, rest: Vec::new() }
    }

    fn open(&mut self) -> std::io::Result<Option<&mut File>> {
        if self.file.is_none() {
            self.file = match File::open(&self.path) {
                // A process that has not been started has no log.
                Err(error) if error.kind() == ErrorKind::NotFound => None,
                opened => Some(opened?),
            };
        }
        Ok(self.file.as_mut())
    }

    /// Reads the last `lines` lines of the log.
    fn tail(&mut self, lines: usize) -> std::io::Result<()> {
        let Some(file) = self.open()? else { return Ok(()) };
        let length = file.metadata()?.len();
        file.seek(SeekFrom::Start(length.saturating_sub(MAX_TAIL)))?;
        self.read()?;
        let ends = self.rest.iter().enumerate().rev().filter(|(_, byte)| **byte == b'\n');
        let begin = ends.map(|(at, _)| at + 1).nth(lines);
        self.rest.drain(..begin.unwrap_or(0));
        Ok(())
    }

    /// Reads everything that was appended to the log.
    fn read(&mut self) -> std::io::Result<()> {
        let mut rest = std::mem::take(&mut self.rest);
        let read = match self.open()? {
            Some(file) => file.read_to_end(&mut rest).map(drop),
            None => Ok(()),
        };
        self.rest = rest;
        read
    }

    /// Prints the complete lines.
    fn print(&mut self, options: &LogsOptions) -> anyhow::Result<()> {
        while let Some(line) = self.next_line() {
            if options.grep.as_ref().is_some_and(|pattern| !pattern.is_match(&line)) {
                continue;
            }
            let process = self.process.word();
            if options.json {
                live!("{}", serde_json::json!({ "process": process, "line": line }))?;
            } else {
                live!("{process:<10} {line}")?;
            }
        }
        Ok(())
    }

    fn next_line(&mut self) -> Option<String> {
        let end = self.rest.iter().position(|&byte| byte == b'\n').map(|end| end + 1);
        let end = end.or((self.rest.len() > MAX_LINE).then_some(MAX_LINE))?;
        let line: Vec<_> = self.rest.drain(..end).collect();
        Some(String::from_utf8_lossy(&line).trim_end_matches(['\n', '\r']).to_owned())
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    fn lines(log: &mut Log) -> Vec<String> {
        std::iter::from_fn(|| log.next_line()).collect()
    }

    #[test]
    fn the_last_lines_come_first_and_new_ones_follow() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("world.log");
        let mut log = Log { process: Process::World, path: path.clone(), file: None, rest: Vec::new() };
        log.tail(2).unwrap();
        assert_eq!(lines(&mut log), Vec::<String>::new());
        let mut file = File::create(path).unwrap();
        write!(file, "a\nb\nc\nhalf").unwrap();
        log.tail(2).unwrap();
        assert_eq!(lines(&mut log), ["b", "c"]);
        writeln!(file, " a line").unwrap();
        log.read().unwrap();
        assert_eq!(lines(&mut log), ["half a line"]);
    }

    #[test]
    fn an_overlong_line_is_printed_in_pieces() {
        let mut log =
            Log { process: Process::World, path: PathBuf::new(), file: None, rest: vec![b'x'; MAX_LINE + 1] };
        assert_eq!(lines(&mut log).iter().map(String::len).sum::<usize>(), MAX_LINE);
        assert_eq!(log.rest.len(), 1);
    }
}

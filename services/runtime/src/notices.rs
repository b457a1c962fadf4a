//! Notices, which processes and tools send to the supervisor to be published on `faults`.
//!
//! Notices are lines of JSON in a file in the system's folder. Each line is appended in one piece, so writers
//! need no lock, a killed writer does not leave a partial line, and a notice is kept even if no process is
//! running. Notices are not meant for frequent events.

use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::PathBuf;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::codes::{FaultKind, Order, Process};
use sketchnav_schemas::fault_plan::Starvation;
use sketchnav_schemas::message::{Here, MissionCommand, NamedPlace};

use crate::node::Node;
use crate::system::System;
use crate::{Error, Result, lock};

/// Maximum length of a notice's text, in bytes. The rest is cut off.
const MAX_WORDS: usize = 512;

/// A report to the supervisor.
#[derive(Debug, Clone, PartialEq)]
pub struct Notice {
    /// What happened.
    pub kind: FaultKind,
    /// The process concerned.
    pub process: Process,
    /// Process id of that process.
    pub pid: u32,
    /// The signal that is sent to it, or 0 if there is none.
    pub signal: u32,
    /// Number of messages lost.
    pub missing: u32,
    /// A description in words.
    pub words: String,
    /// An order that a tool asks the supervisor to give.
    pub order: Option<Ordered>,
    /// How the process is being starved of the processor from now on, so that the supervisor tolerates its slowness.
    pub starvation: Option<Starvation>,
}

/// An order for the supervisor to give.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ordered {
    /// The kind of order.
    pub order: Order,
    /// Index of the task that the order is about, from 0, if it is about one.
    pub task: u32,
    /// Position of the robot, for an order `here`.
    pub here: Option<Here>,
    /// The place that is the goal instead of a task, for an order `goal`.
    pub place: Option<NamedPlace>,
}

impl Ordered {
    /// Creates an order without a position.
    pub const fn new(order: Order, task: u32) -> Self {
        Self { order, task, here: None, place: None }
    }

    /// Creates the order to go to a place that is no task's goal.
    pub fn to_place(place: NamedPlace) -> Self {
        Self { place: Some(place), ..Self::new(Order::Goal, MissionCommand::NO_TASK) }
    }
}

/// A notice as written to the file.
#[derive(Serialize, Deserialize)]
struct Line {
    kind: u32,
    process: u32,
    pid: u32,
    signal: u32,
    missing: u32,
    words: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    order: Option<(u32, u32)>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    starvation: Option<Starvation>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    here: Option<Here>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    place: Option<NamedPlace>,
}

impl Notice {
    fn line(&self) -> Line {
        let end = (0..=self.words.len().min(MAX_WORDS)).rev().find(|&end| self.words.is_char_boundary(end));
        Line {
            kind: self.kind.code(),
            process: self.process.code(),
            pid: self.pid,
            signal: self.signal,
            missing: self.missing,
            words: self.words[..end.unwrap_or(0)].to_owned(),
            order: self.order.map(|ordered| (ordered.order.code(), ordered.task)),
            here: self.order.and_then(|ordered| ordered.here),
            place: self.order.and_then(|ordered| ordered.place),
            starvation: self.starvation,
        }
    }
}

impl Line {
    fn notice(self) -> Option<Notice> {
        let (here, place) = (self.here, self.place);
        let order = |(code, task)| Some(Ordered { order: Order::from_code(code)?, task, here, place });
        Some(Notice {
            // An invalid order makes the whole line invalid.
            order: match self.order {
                Some(order_and_task) => Some(order(order_and_task)?),
                None => None,
            },
            kind: FaultKind::from_code(self.kind)?,
            process: Process::from_code(self.process)?,
            pid: self.pid,
            signal: self.signal,
            missing: self.missing,
            words: self.words,
            starvation: self.starvation,
        })
    }
}

impl System {
    /// Sends a signal to the process `pid`, which serves as `process`. The fault is reported before its effects can be seen.
    /// `by` is the name of the tool.
    ///
    /// # Errors
    /// - [`Error::File`] if the system is gone.
    /// - [`Error::Signal`] if the process is gone or cannot be reached from here.
    pub fn inject(&self, process: Process, pid: u32, signal: Signal, by: &str) -> Result<()> {
        let failed = |source| Error::Signal { process, pid, source };
        // A process that has joined has written its identity to a file. One that has not is a child that the tool found by
        // itself.
        let joined = lock::owner(&self.process_lock(process)).filter(|owner| owner.pid == pid);
        let handle = joined.map(|owner| owner.handle()).transpose();
        let handle = handle.map_err(|words| failed(std::io::Error::other(words)))?;
        self.notify(&Notice {
            kind: FaultKind::Injected,
            process,
            pid,
            signal: signal as u32,
            missing: 0,
            words: format!("{by}: {signal} sent"),
            order: None,
            starvation: None,
        })?;
        match handle {
            Some(handle) => handle.send(signal).map_err(failed),
            None => kill(Pid::from_raw(pid as i32), signal).map_err(|error| failed(error.into())),
        }
    }

    /// Asks the supervisor to give the navigator an order, and to report which tool asked for it. `by` is the name of the tool.
    ///
    /// # Errors
    /// [`Error::File`] if the system is gone.
    pub fn order(&self, ordered: Ordered, by: &str) -> Result<()> {
        self.notify(&Notice {
            kind: FaultKind::Ordered,
            process: Process::Planner,
            pid: 0,
            signal: 0,
            missing: 0,
            words: format!("{by}: {}", ordered.order),
            order: Some(ordered),
            starvation: None,
        })
    }

    /// Asks the supervisor to publish a notice.
    ///
    /// # Errors
    /// [`Error::File`] if the system is gone.
    pub fn notify(&self, notice: &Notice) -> Result<()> {
        let path = self.notices();
        let append = || {
            let mut line = serde_json::to_vec(&notice.line())?;
            line.push(b'\n');
            OpenOptions::new().append(true).mode(0o600).open(&path)?.write_all(&line)
        };
        append().map_err(Error::file(path.clone(), "appending to it"))
    }
}

impl Node {
    /// Asks the supervisor to publish an event of this process, and writes it to the process's log.
    pub fn report_fault(&self, kind: FaultKind, missing: u64, words: &str) {
        sketchnav_schemas::say!("{words}");
        let notice = Notice {
            kind,
            process: self.process(),
            pid: std::process::id(),
            signal: 0,
            missing: u32::try_from(missing).unwrap_or(u32::MAX),
            words: words.to_owned(),
            order: None,
            starvation: None,
        };
        if let Err(error) = self.system().notify(&notice) {
            sketchnav_schemas::say!("cannot notify the supervisor: {error}");
        }
    }
}

/// The notices of a system as they arrive.
pub struct Notices {
    path: PathBuf,
    file: File,
    /// Text that has been read but does not form a whole line yet.
    rest: Vec<u8>,
}

impl Notices {
    /// Opens the notices, and starts with the first one. The file is created if it is missing.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be opened.
    pub fn open(system: &System) -> Result<Self> {
        Self::open_at(system.notices())
    }

    fn open_at(path: PathBuf) -> Result<Self> {
        let mut options = OpenOptions::new();
        let file = options.read(true).append(true).create(true).mode(0o600).open(&path);
        let file = file.map_err(Error::file(&path, "opening"))?;
        Ok(Self { path, file, rest: Vec::new() })
    }

    /// Returns the next notice, if there is one. Invalid lines are skipped.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be read.
    pub fn receive(&mut self) -> Result<Option<Notice>> {
        loop {
            while let Some(end) = self.rest.iter().position(|&byte| byte == b'\n') {
                let line: Vec<_> = self.rest.drain(..=end).collect();
                let notice = serde_json::from_slice::<Line>(&line).ok().and_then(Line::notice);
                if notice.is_some() {
                    return Ok(notice);
                }
            }
            let mut piece = [0; 4096];
            match self.file.read(&mut piece) {
                Ok(0) => return Ok(None),
                Ok(length) => self.rest.extend_from_slice(&piece[..length]),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(Error::file(&self.path, "reading")(error)),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use sketchnav_schemas::geometry::Point;
    use sketchnav_schemas::message::Text;

    use super::*;

    fn notice(words: &str) -> Notice {
        let (kind, process) = (FaultKind::RecordingFailed, Process::Recorder);
        let (order, starvation) = (None, None);
        Notice { kind, process, pid: 7, signal: 0, missing: 3, words: words.into(), order, starvation }
    }

    #[test]
    fn an_order_round_trips_and_invalid_ones_are_skipped() {
        let here = Here { at: Point::new(12.5, 0.1), yaw_rad: Some(-0.1) };
        let kitchen = NamedPlace { name: Text::new("Küche"), at: Point::new(0.1, -7.5) };
        for order in [
            Ordered::new(Order::Pause, 3),
            Ordered { here: Some(here), ..Ordered::new(Order::Here, 0) },
            Ordered::to_place(kitchen),
        ] {
            let ordered = Notice { order: Some(order), ..notice("send: something") };
            let text = serde_json::to_string(&ordered.line()).unwrap();
            assert_eq!(serde_json::from_str::<Line>(&text).unwrap().notice(), Some(ordered));
        }
        let ordered = Notice { order: Some(Ordered::new(Order::Pause, 3)), ..notice("send: pause") };
        let text = serde_json::to_string(&ordered.line()).unwrap();
        let unknown = text.replace("[3,3]", "[99,3]");
        assert_ne!(unknown, text);
        assert_eq!(serde_json::from_str::<Line>(&unknown).unwrap().notice(), None);
    }

    #[test]
    fn notices_arrive_in_order_and_invalid_ones_are_skipped() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("notices");
        let mut notices = Notices::open_at(path.clone()).unwrap();
        assert_eq!(notices.receive().unwrap(), None);
        let mut file = OpenOptions::new().append(true).open(&path).unwrap();
        let line = |words: &str| serde_json::to_string(&notice(words).line()).unwrap() + "\n";
        write!(file, "{}no notice\n{{}}\n{}{}", line("a\n\"b\""), line("ü"), &line("half")[..9]).unwrap();
        assert_eq!(notices.receive().unwrap(), Some(notice("a\n\"b\"")));
        assert_eq!(notices.receive().unwrap(), Some(notice("ü")));
        assert_eq!(notices.receive().unwrap(), None);
        file.write_all(&line("half").as_bytes()[9..]).unwrap();
        assert_eq!(notices.receive().unwrap(), Some(notice("half")));
        let long = notice(&"ü".repeat(1000));
        assert_eq!(long.line().words.len(), MAX_WORDS);
    }
}

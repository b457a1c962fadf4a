//! Planned faults, which are applied by the writers of channels. See [`sketchnav_schemas::fault_plan`].
//!
//! If no fault is planned for a channel, its writer has no trap and no overhead. Each fault happens only once, even if the writer
//! is restarted, because a file in the system's folder records that it has happened.

use std::fs::{File, OpenOptions};
use std::io::ErrorKind;
use std::os::unix::fs::FileExt;
use std::path::PathBuf;
use std::rc::Rc;
use std::time::Duration;

use nix::sys::signal::{Signal, raise};
use sketchnav_schemas::channels::ChannelSpec;
use sketchnav_schemas::codes::{FaultKind, Process};
use sketchnav_schemas::fault_plan::{Action, FaultPlan, PlannedFault, Starvation, When};

use crate::checkpoint;
use crate::node::Node;
use crate::notices::Notice;
use crate::starvation::starve;
use crate::system::System;
use crate::{Error, Result};

/// The faults of one channel that have not happened yet.
pub(crate) struct Trap {
    system: Rc<System>,
    process: Process,
    /// Faults with their indices in the plan.
    faults: Vec<(usize, PlannedFault)>,
}

/// What the plan does to a single message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Fate {
    pub(crate) is_dropped: bool,
    pub(crate) is_doubled: bool,
    pub(crate) is_held: bool,
}

impl Trap {
    /// Returns the trap of a writer of `node`, or `None` if nothing is planned for its channel.
    pub(crate) fn of(node: &Node, spec: &ChannelSpec) -> Result<Option<Self>> {
        let Some(plan) = node.system().fault_plan()? else { return Ok(None) };
        let own = plan.fault.into_iter().enumerate().filter(|(_, fault)| fault.channel == spec.name);
        let faults: Vec<_> = own.collect();
        let (system, process) = (node.system_handle(), node.process());
        Ok((!faults.is_empty()).then_some(Self { system, process, faults }))
    }

    /// Applies the faults planned for before the message is sent.
    pub(crate) fn before(&mut self, seq: u64, stamp_ns: u64) -> Result<Fate> {
        let mut fate = Fate::default();
        while let Some((place, fault)) = self.next(seq, stamp_ns, When::Before)? {
            self.report(place, &fault, seq)?;
            match fault.action {
                Action::Drop => fate.is_dropped = true,
                Action::Duplicate => fate.is_doubled = true,
                Action::Reorder => fate.is_held = true,
                // The planned fault is a delay of the writer, as a slow disk would delay its process.
                Action::Delay => std::thread::sleep(Duration::from_millis(fault.delay_ms.unwrap_or(0))),
                _ => self.hit(&fault)?,
            }
        }
        Ok(fate)
    }

    /// Applies the faults planned for after the message was sent.
    pub(crate) fn after(&mut self, seq: u64, stamp_ns: u64) -> Result<()> {
        while let Some((place, fault)) = self.next(seq, stamp_ns, When::After)? {
            self.report(place, &fault, seq)?;
            self.hit(&fault)?;
        }
        Ok(())
    }

    /// Returns the next fault that is due and has not happened in an earlier life.
    fn next(&mut self, seq: u64, stamp_ns: u64, when: When) -> Result<Option<(usize, PlannedFault)>> {
        while let Some(i) =
            self.faults.iter().position(|(_, fault)| fault.when == when && fault.is_due(seq, stamp_ns))
        {
            let (place, fault) = self.faults.remove(i);
            if self.claim(place)? {
                return Ok(Some((place, fault)));
            }
        }
        Ok(None)
    }

    /// Returns true if the fault has not happened yet, and records that it has now.
    fn claim(&self, place: usize) -> Result<bool> {
        let path = self.system.fault_file(place + 1);
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            Ok(_) => Ok(true),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(false),
            Err(error) => Err(Error::file(path, "noting a planned fault")(error)),
        }
    }

    fn report(&self, place: usize, fault: &PlannedFault, seq: u64) -> Result<()> {
        let (number, word, channel) = (place + 1, fault.action.word(), &fault.channel);
        let starvation = fault.starvation();
        let how = starvation.map_or(String::new(), |Starvation { share, duration_ms }| {
            format!(", {} % of the time for {duration_ms} ms", share * 100.0)
        });
        self.system.notify(&Notice {
            kind: FaultKind::Injected,
            process: self.process,
            pid: std::process::id(),
            signal: signal_of(fault.action).map_or(0, |signal| signal as u32),
            missing: u32::from(fault.action == Action::Drop),
            words: format!("fault {number} of the plan: {word} at {channel} {seq}{how}"),
            order: None,
            starvation,
        })
    }

    fn hit(&self, fault: &PlannedFault) -> Result<()> {
        if fault.action == Action::CorruptCheckpoint {
            let slots = checkpoint::slots(&self.system, self.process)?;
            corrupt_newest(&slots)?;
        }
        let done = match (fault.starvation(), signal_of(fault.action)) {
            (Some(starvation), _) => starve(starvation),
            (None, Some(signal)) => raise(signal),
            (None, None) => Ok(()),
        };
        let pid = std::process::id();
        done.map_err(|error| Error::Signal { process: self.process, pid, source: error.into() })
    }
}

fn signal_of(action: Action) -> Option<Signal> {
    match action {
        Action::Kill | Action::CorruptCheckpoint => Some(Signal::SIGKILL),
        Action::Stop => Some(Signal::SIGSTOP),
        Action::Term => Some(Signal::SIGTERM),
        _ => None,
    }
}

/// Inverts bits of the state in the slot with the larger number. A missing slot is left alone.
fn corrupt_newest(slots: &[PathBuf]) -> Result<()> {
    let mut newest = None;
    for path in slots {
        let Ok(file) = File::options().read(true).write(true).open(path) else { continue };
        let mut number = [0; 8];
        let read = file.read_exact_at(&mut number, checkpoint::NUMBER_AT).is_ok();
        let number = u64::from_ne_bytes(number);
        if read && number > newest.as_ref().map_or(0, |(newest, _)| *newest) {
            newest = Some((number, (path, file)));
        }
    }
    let Some((_, (path, file))) = newest else { return Ok(()) };
    let turn_over = || {
        let mut byte = [0];
        file.read_exact_at(&mut byte, checkpoint::STATE_AT)?;
        file.write_all_at(&[!byte[0]], checkpoint::STATE_AT)
    };
    turn_over().map_err(Error::file(path, "damaging a checkpoint"))
}

impl System {
    /// Returns the path of the file that exists once the planned fault with the given number, from 1, has happened.
    fn fault_file(&self, number: usize) -> PathBuf {
        self.folder().join(format!("fault-{number}"))
    }

    /// Returns the planned faults that have not happened yet, with their numbers from 1.
    ///
    /// # Errors
    /// See [`System::run_config`].
    pub fn outstanding_faults(&self) -> Result<Vec<(usize, PlannedFault)>> {
        let planned = self.fault_plan()?.map(|plan| plan.fault).unwrap_or_default();
        let numbered = planned.into_iter().enumerate().map(|(i, fault)| (i + 1, fault));
        Ok(numbered.filter(|(number, _)| !self.fault_file(*number).exists()).collect())
    }

    /// Returns the fault plan of the run, or `None` if there is none.
    fn fault_plan(&self) -> Result<Option<FaultPlan>> {
        if !self.faults_file().exists() {
            return Ok(None);
        }
        let fault = self.run_config()?.faults;
        Ok(Some(FaultPlan { fault }))
    }
}

//! Which processes are up, according to the supervisor's reports on `faults`.

use std::collections::BTreeMap;

use serde::Serialize;
use sketchnav_schemas::channels::SERVICES;
use sketchnav_schemas::codes::{FaultKind, Process};
use sketchnav_schemas::message::Fault;

/// A process that was restarted and has not died for this long counts as up, whether it has anything to do or not:
/// simulation time, nanoseconds.
const SETTLED_NS: u64 = 3_000_000_000;

/// The processes of the system, by number.
#[derive(Debug, Clone)]
pub struct Services {
    known: BTreeMap<u32, ServiceView>,
    /// When processes were restarted, until they have settled.
    restarted_ns: BTreeMap<u32, u64>,
}

/// The state of a process.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ServiceView {
    /// Its name.
    pub name: &'static str,
    /// Whether the process is up, as far as is known.
    pub up: bool,
    /// Number of restarts of the process.
    pub restarts: u32,
}

impl Default for Services {
    fn default() -> Self {
        let view = |p: Process| (p.code(), ServiceView { name: p.word(), up: true, restarts: 0 });
        Self { known: SERVICES.into_iter().map(view).collect(), restarted_ns: BTreeMap::new() }
    }
}

impl Services {
    /// Processes a fault or a recovery.
    pub fn on_fault(&mut self, fault: &Fault) {
        let Some(service) = self.known.get_mut(&fault.process) else { return };
        match FaultKind::from_code(fault.kind) {
            Some(FaultKind::Died | FaultKind::Unresponsive | FaultKind::GivenUp) => {
                service.up = false;
                self.restarted_ns.remove(&fault.process);
            }
            Some(FaultKind::Restarted) => {
                service.restarts = fault.restarts;
                self.restarted_ns.insert(fault.process, fault.header.stamp_ns);
            }
            Some(FaultKind::Recovered | FaultKind::Responsive) => service.up = true,
            _ => {}
        }
    }

    /// Counts restarted processes as up once enough time has passed. `now_ns` is the simulation time, in
    /// nanoseconds.
    pub fn settle(&mut self, now_ns: u64) {
        let settled = self.restarted_ns.extract_if(.., |_, since| now_ns.saturating_sub(*since) > SETTLED_NS);
        for (process, _) in settled {
            if let Some(service) = self.known.get_mut(&process) {
                service.up = true;
            }
        }
    }

    /// The state of all processes.
    pub fn views(&self) -> Vec<ServiceView> {
        self.known.values().cloned().collect()
    }

    /// Returns the names of the processes that are not up.
    pub fn down(&self) -> impl Iterator<Item = &'static str> + '_ {
        self.known.values().filter(|service| !service.up).map(|service| service.name)
    }
}

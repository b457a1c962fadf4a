//! The content of `/diagnostics`: one status per process, based on `health` and `faults`.
//!
//! Time is passed as an argument. The levels are those of `diagnostic_msgs/msg/DiagnosticStatus`.

use std::collections::BTreeMap;
use std::time::Duration;

use sketchnav_schemas::codes::{FaultKind, Process};
use sketchnav_schemas::message::{Fault, Health};

use crate::forms::{DiagnosticArray, DiagnosticStatus, KeyValue, time};

/// Age of the last report beyond which the figures of a process are stale. A process reports its health once a second.
const STALE_AFTER: Duration = Duration::from_secs(5);

/// The severity of a status.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Level {
    /// Nothing is wrong.
    Ok = 0,
    /// There is a problem, but the process continues.
    Warn = 1,
    /// The process does not do its work.
    Error = 2,
    /// The process has not reported.
    Stale = 3,
}

/// Information about the processes of a system.
#[derive(Debug, Default)]
pub struct Diagnostics {
    processes: BTreeMap<u32, Member>,
}

#[derive(Debug, Default)]
struct Member {
    health: Option<Health>,
    received: Duration,
    /// The numbers of lost and refused messages at the time of the previous diagnostics report.
    reported: (u64, u64),
    /// The current problem.
    trouble: Option<(Level, String)>,
    restarts: u32,
}

impl Diagnostics {
    /// Processes a health report that arrived at `now`.
    pub fn on_health(&mut self, health: &Health, now: Duration) {
        let member = self.processes.entry(health.process).or_default();
        let is_another = member.health.is_none_or(|before| before.pid != health.pid);
        if is_another {
            // A restarted process counts from 0.
            member.reported = (0, 0);
        }
        (member.health, member.received) = (Some(*health), now);
    }

    /// Processes a fault that arrived at `now`.
    pub fn on_fault(&mut self, fault: &Fault, now: Duration) {
        let Some(kind) = FaultKind::from_code(fault.kind) else { return };
        let member = self.processes.entry(fault.process).or_default();
        if member.health.is_none() {
            member.received = now;
        }
        member.restarts = member.restarts.max(fault.restarts);
        let words = fault.words.as_str();
        let trouble = if words.is_empty() { kind.word().to_owned() } else { format!("{kind}: {words}") };
        match kind {
            FaultKind::Injected | FaultKind::Ordered => {}
            FaultKind::Died | FaultKind::Unresponsive | FaultKind::GivenUp | FaultKind::RecordingFailed => {
                member.trouble = Some((Level::Error, trouble))
            }
            FaultKind::Restarted | FaultKind::StateRefused => member.trouble = Some((Level::Warn, trouble)),
            FaultKind::Recovered
            | FaultKind::Responsive
            | FaultKind::RecordingResumed
            | FaultKind::SystemResumed => member.trouble = None,
        }
    }

    /// Returns the report at `now`. `stamp_ns` is the simulation time, in nanoseconds.
    pub fn report(&mut self, system: &str, stamp_ns: u64, now: Duration) -> DiagnosticArray {
        let mut array = DiagnosticArray::default();
        array.header.stamp = time(stamp_ns);
        for (&code, member) in &mut self.processes {
            let Some(process) = Process::from_code(code) else { continue };
            array.status.push(member.status(process, system, now));
        }
        array
    }
}

impl Member {
    fn status(&mut self, process: Process, system: &str, now: Duration) -> DiagnosticStatus {
        let (level, message) = self.verdict(now);
        if let Some(health) = &self.health {
            self.reported = (health.lost_messages, health.refused_messages);
        }
        DiagnosticStatus {
            level: level as u8,
            name: format!("{system}: {process}"),
            message,
            hardware_id: system.to_owned(),
            values: self.values(),
        }
    }

    fn verdict(&self, now: Duration) -> (Level, String) {
        let silent = now.saturating_sub(self.received);
        if let Some((level, words)) = &self.trouble {
            return (*level, words.clone());
        }
        if silent > STALE_AFTER {
            return (Level::Stale, format!("no report for {:.0} s", silent.as_secs_f64()));
        }
        let Some(health) = &self.health else { return (Level::Ok, "no report yet".to_owned()) };
        let lost = health.lost_messages.saturating_sub(self.reported.0);
        let refused = health.refused_messages.saturating_sub(self.reported.1);
        match (lost, refused) {
            (0, 0) => (Level::Ok, format!("{} steps", health.steps)),
            _ => (Level::Warn, format!("{lost} messages lost, {refused} refused since the last report")),
        }
    }

    fn values(&self) -> Vec<KeyValue> {
        let pair = |key: &str, value: String| KeyValue { key: key.to_owned(), value };
        let mut values = vec![pair("restarts", self.restarts.to_string())];
        let Some(health) = &self.health else { return values };
        values.push(pair("pid", health.pid.to_string()));
        values.push(pair("uptime_s", format!("{:.3}", health.uptime_ns as f64 * 1e-9)));
        values.push(pair("steps", health.steps.to_string()));
        values.push(pair("busy_s", format!("{:.3}", health.busy_ns as f64 * 1e-9)));
        values.push(pair("step_max_ms", format!("{:.3}", health.step_max_ns as f64 * 1e-6)));
        values.push(pair("step_allocations", health.step_allocations.to_string()));
        values.push(pair("lost_messages", health.lost_messages.to_string()));
        values.push(pair("refused_messages", health.refused_messages.to_string()));
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;
    use sketchnav_schemas::message::Text;

    fn health(steps: u64, lost_messages: u64) -> Health {
        Health { process: Process::Localizer.code(), pid: 7, steps, lost_messages, ..Health::zeroed() }
    }

    fn fault(kind: FaultKind) -> Fault {
        let (kind, process) = (kind.code(), Process::Localizer.code());
        Fault { kind, process, restarts: 2, words: Text::new("SIGKILL"), ..Fault::zeroed() }
    }

    fn status(diagnostics: &mut Diagnostics, second: u64) -> (u8, String) {
        let array = diagnostics.report("lab", 1_500_000_000, Duration::from_secs(second));
        assert_eq!((array.header.stamp.sec, array.header.stamp.nanosec), (1, 500_000_000));
        let [status] = &array.status[..] else { panic!("{array:?}") };
        assert_eq!((status.name.as_str(), status.hardware_id.as_str()), ("lab: localizer", "lab"));
        (status.level, status.message.clone())
    }

    #[test]
    fn a_process_that_loses_messages_causes_one_warning() {
        let mut diagnostics = Diagnostics::default();
        diagnostics.on_health(&health(10, 0), Duration::ZERO);
        assert_eq!(status(&mut diagnostics, 1), (0, "10 steps".into()));
        diagnostics.on_health(&health(20, 3), Duration::from_secs(1));
        assert_eq!(
            status(&mut diagnostics, 1),
            (1, "3 messages lost, 0 refused since the last report".into())
        );
        assert_eq!(status(&mut diagnostics, 2), (0, "20 steps".into()));
    }

    #[test]
    fn a_silent_process_is_stale() {
        let mut diagnostics = Diagnostics::default();
        diagnostics.on_health(&health(10, 0), Duration::ZERO);
        assert_eq!(status(&mut diagnostics, 9), (3, "no report for 9 s".into()));
    }

    #[test]
    fn a_death_is_an_error_until_the_successor_takes_a_step() {
        let mut diagnostics = Diagnostics::default();
        diagnostics.on_health(&health(10, 0), Duration::ZERO);
        diagnostics.on_fault(&fault(FaultKind::Injected), Duration::ZERO);
        assert_eq!(status(&mut diagnostics, 0).0, 0);
        for (kind, level) in [
            (FaultKind::Died, 2),
            (FaultKind::Ordered, 2),
            (FaultKind::Restarted, 1),
            (FaultKind::Recovered, 0),
        ] {
            diagnostics.on_fault(&fault(kind), Duration::ZERO);
            assert_eq!(status(&mut diagnostics, 0).0, level, "{kind}");
        }
        let array = diagnostics.report("lab", 0, Duration::ZERO);
        assert!(array.status[0].values.contains(&KeyValue { key: "restarts".into(), value: "2".into() }));
    }

    #[test]
    fn unknown_processes_and_faults_are_left_out() {
        let mut diagnostics = Diagnostics::default();
        diagnostics.on_health(&Health { process: 9999, ..health(1, 0) }, Duration::ZERO);
        diagnostics.on_fault(&Fault { kind: 9999, ..Fault::zeroed() }, Duration::ZERO);
        assert!(diagnostics.report("lab", 0, Duration::ZERO).status.is_empty());
    }
}

//! Gathers the state of a running system's processes by joining the system as an observer and counting messages.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use serde::Serialize;
use sketchnav_runtime::{Node, ProcessState, RawReader, Reader, System};
use sketchnav_schemas::channels::{self, FAULTS, HEALTH, Role, SERVICES, STATUS};
use sketchnav_schemas::codes::{FaultKind, Process, TaskState};
use sketchnav_schemas::message::{Fault, Header, Health, MissionStatus};
use sketchnav_schemas::run::RunConfig;

/// The number of faults that are kept for display.
const LAST_FAULTS: usize = 8;

/// A snapshot of a system, as printed by `--json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Snapshot {
    /// The system's name.
    pub system: String,
    /// The mission's name.
    pub mission: String,
    /// Simulation time of the mission's last status, in seconds.
    pub simulated_s: f64,
    /// The state of the mission, in words.
    pub status: String,
    /// The processes.
    pub processes: Vec<Row>,
    /// The last faults, oldest first.
    pub faults: Vec<String>,
}

/// The state of a process in a [`Snapshot`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// The process's name.
    pub process: &'static str,
    /// The process id, or `None` if the process is dead.
    pub pid: Option<u32>,
    /// The process's state according to the kernel: running, sleeping, stopped …
    pub state: &'static str,
    /// Number of restarts of the process.
    pub restarts: u32,
    /// Messages per second on all channels that the process writes, by the wall clock.
    pub rate_hz: f64,
    /// Number of ticks that the process has not yet responded to or, for the recorder, that are not yet in the file. `None` if it
    /// does not respond to ticks.
    pub queue: Option<u64>,
    /// Time since the process's last message, or `None` before the first.
    pub age_ms: Option<f64>,
    /// Mean duration of the steps between the process's last two reports, which it sends once a second.
    pub step_ms: Option<f64>,
    /// Longest step between the process's last two reports.
    pub step_max_ms: Option<f64>,
    /// Number of messages that the process lost.
    pub lost: u64,
}

/// Follows a system by counting its messages.
pub struct Gatherer {
    node: Node,
    run: RunConfig,
    taps: Vec<Counted>,
    faults: Reader<Fault>,
    health: Reader<Health>,
    statuses: Reader<MissionStatus>,
    since: Instant,
    fault_lines: Vec<String>,
    restarts: BTreeMap<u32, u32>,
    lives: BTreeMap<u32, Life>,
    status: Option<MissionStatus>,
}

/// The reports of a process since it was last started.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Life {
    last: Health,
    /// Steps between the last two reports, and the time spent in them.
    steps: u64,
    busy_ns: u64,
}

impl Life {
    fn begin(first: Health) -> Self {
        Self { last: first, steps: first.steps, busy_ns: first.busy_ns }
    }

    fn update(&mut self, next: Health) {
        let since = |next: u64, last: u64| next.saturating_sub(last);
        *self = match self.last.pid == next.pid {
            true => Self {
                last: next,
                steps: since(next.steps, self.last.steps),
                busy_ns: since(next.busy_ns, self.last.busy_ns),
            },
            false => Self::begin(next),
        };
    }

    /// Returns the mean duration of the steps between the last two reports, in milliseconds, or `None` if there were no
    /// steps.
    fn step_ms(&self) -> Option<f64> {
        (self.steps > 0).then(|| ms(self.busy_ns) / self.steps as f64)
    }

    /// Returns the longest step between the last two reports, in milliseconds, or `None` if there were no steps.
    fn step_max_ms(&self) -> Option<f64> {
        (self.steps > 0).then(|| ms(self.last.step_max_ns))
    }
}

fn ms(ns: u64) -> f64 {
    ns as f64 / 1e6
}

impl Gatherer {
    /// Joins the system.
    pub fn join(system: System) -> anyhow::Result<Self> {
        let run = system.run_config()?;
        let node = Node::join(system, Process::Observer)?;
        let channels = channels::of_kind(run.mission.navigator_kind());
        let taps = channels.map(|spec| Ok(Counted::new(node.raw_reader(spec)?)));
        let taps = taps.collect::<sketchnav_runtime::Result<Vec<_>>>()?;
        let (faults, health, statuses) = (node.reader(FAULTS)?, node.reader(HEALTH)?, node.reader(STATUS)?);
        Ok(Self {
            node,
            run,
            taps,
            faults,
            health,
            statuses,
            since: Instant::now(),
            fault_lines: Vec::new(),
            restarts: BTreeMap::new(),
            lives: BTreeMap::new(),
            status: None,
        })
    }

    /// Returns the observer's node in the system, which can wait and send signals to processes.
    pub fn node(&self) -> &Node {
        &self.node
    }

    /// Takes the messages that have arrived. This must be called several times a second.
    pub fn look(&mut self) -> anyhow::Result<()> {
        for tap in &mut self.taps {
            tap.drain()?;
        }
        while let Some(fault) = self.faults.receive()? {
            self.restarts
                .entry(fault.process)
                .and_modify(|n| *n = (*n).max(fault.restarts))
                .or_insert(fault.restarts);
            self.fault_lines.push(words(&fault));
            let surplus = self.fault_lines.len().saturating_sub(LAST_FAULTS);
            self.fault_lines.drain(..surplus);
        }
        while let Some(health) = self.health.receive()? {
            let health = *health;
            self.lives
                .entry(health.process)
                .and_modify(|life| life.update(health))
                .or_insert_with(|| Life::begin(health));
        }
        while let Some(status) = self.statuses.receive()? {
            self.status = Some(*status);
        }
        Ok(())
    }

    /// Returns the current state. Rates cover the time since the previous snapshot.
    pub fn snapshot(&mut self) -> anyhow::Result<Snapshot> {
        self.look()?;
        let took = std::mem::replace(&mut self.since, Instant::now()).elapsed();
        let alive: BTreeMap<_, _> = self.node.system().processes()?.into_iter().collect();
        // A system without a pad may still have one that was started by hand.
        let has_pad = !self.run.pad.is_absent() || alive.contains_key(Process::Pad.word());
        let pad = has_pad.then_some(Process::Pad);
        let order = [Process::Supervisor].into_iter().chain(SERVICES).chain(pad);
        let rows: Vec<_> =
            order.map(|process| self.row(process, alive.get(process.word()).copied(), took)).collect();
        self.taps.iter_mut().for_each(Counted::reset_count);
        Ok(Snapshot {
            system: self.node.system().name().to_owned(),
            mission: self.run.mission.name.clone(),
            simulated_s: self.status.map_or(0.0, |status| status.header.stamp_ns as f64 / 1e9),
            status: self.status.as_ref().map_or_else(|| "not begun".to_owned(), mission),
            processes: rows,
            faults: self.fault_lines.clone(),
        })
    }

    fn row(&self, process: Process, pid: Option<u32>, took: Duration) -> Row {
        let own = || self.taps.iter().filter(|tap| tap.reader.spec().writer == Some(process));
        let messages: u64 = own().map(|tap| tap.count()).sum();
        let received = own().filter_map(|tap| tap.received).max();
        let life = self.lives.get(&process.code());
        Row {
            process: process.word(),
            pid,
            state: pid.map_or(ProcessState::Dead, ProcessState::of).word(),
            restarts: self.restarts.get(&process.code()).copied().unwrap_or(0),
            rate_hz: messages as f64 / took.as_secs_f64(),
            queue: self.queue(process),
            age_ms: received.map(|received| received.elapsed().as_secs_f64() * 1e3),
            step_ms: life.and_then(Life::step_ms),
            step_max_ms: life.and_then(Life::step_max_ms),
            lost: life.map_or(0, |life| life.last.lost_messages),
        }
    }

    /// Returns the number of ticks by which a process lags behind.
    fn queue(&self, process: Process) -> Option<u64> {
        let kind = self.run.mission.navigator_kind();
        let (input, output) = match process {
            Process::World => return None,
            Process::Recorder => (channels::of_role(Role::Tick, kind), channels::of_role(Role::Safe, kind)),
            _ => (channels::trigger_of(process, kind), channels::last_word_of(process, kind)),
        };
        let tick = |spec| {
            let newest = self.taps.iter().find(|tap| Some(tap.reader.spec()) == spec)?.newest?;
            Some(if spec?.role == Role::Tick { newest.seq } else { newest.source_seq })
        };
        Some(tick(input)?.saturating_sub(tick(output)?))
    }
}

fn mission(status: &MissionStatus) -> String {
    let state = TaskState::from_code(status.state).map_or("?", TaskState::word);
    let MissionStatus { task, task_count, reached_count, .. } = status;
    format!("task {} of {task_count}, {}: {state}; {reached_count} reached", task + 1, status.name.as_str())
}

fn words(fault: &Fault) -> String {
    let kind = FaultKind::from_code(fault.kind).map_or("?", FaultKind::word);
    let process = Process::from_code(fault.process).map_or("?", Process::word);
    let took = match fault.duration_ns {
        0 => String::new(),
        ns => format!(" {:.0} ms", ns as f64 / 1e6),
    };
    let at_s = fault.header.stamp_ns as f64 / 1e9;
    format!("{at_s:8.1} s  {process} {kind}{took}  {}", fault.words.as_str())
}

/// A channel whose messages are counted.
struct Counted {
    reader: RawReader,
    /// The header of the last message.
    newest: Option<Header>,
    /// When the last message arrived. Messages sent before this observer joined arrive when it first looks.
    received: Option<Instant>,
    /// Messages after this sequence number are counted.
    from_seq: Option<u64>,
}

impl Counted {
    fn new(reader: RawReader) -> Self {
        Self { reader, newest: None, received: None, from_seq: None }
    }

    fn drain(&mut self) -> sketchnav_runtime::Result<()> {
        while let Some(sample) = self.reader.receive()? {
            (self.newest, self.received) = (Some(*sample.header()), Some(Instant::now()));
        }
        // Messages of the history were sent before this observer joined, so they are not counted.
        self.from_seq = self.from_seq.or(self.newest.map(|newest| newest.seq));
        Ok(())
    }

    /// Returns the number of messages since the count was last reset.
    fn count(&self) -> u64 {
        let newest = self.newest.map_or(0, |newest| newest.seq);
        newest.saturating_sub(self.from_seq.unwrap_or(newest))
    }

    fn reset_count(&mut self) {
        self.from_seq = self.newest.map(|newest| newest.seq);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn health(pid: u32, steps: u64, busy_ns: u64, step_max_ns: u64) -> Health {
        Health { pid, steps, busy_ns, step_max_ns, ..bytemuck::Zeroable::zeroed() }
    }

    /// Regression test: the mean used to cover the process's whole life, but the longest step only the last second. A process
    /// whose earlier steps were longer was shown with a mean above its longest step.
    #[test]
    fn mean_and_longest_step_cover_the_same_time() {
        let mut life = Life::begin(health(7, 10, 50_000_000, 9_000_000));
        assert_eq!((life.step_ms(), life.step_max_ms()), (Some(5.0), Some(9.0)));
        life.update(health(7, 30, 70_000_000, 2_000_000));
        assert_eq!((life.step_ms(), life.step_max_ms()), (Some(1.0), Some(2.0)));
        life.update(health(7, 30, 70_000_000, 0));
        assert_eq!((life.step_ms(), life.step_max_ms()), (None, None), "it has done nothing since");
        life.update(health(8, 2, 4_000_000, 3_000_000));
        assert_eq!((life.step_ms(), life.step_max_ms()), (Some(2.0), Some(3.0)), "a new life");
    }
}

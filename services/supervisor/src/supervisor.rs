//! The life of a system.

use std::collections::BTreeMap;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::{Duration, Instant};

use nix::sys::resource::{Resource, getrlimit};
use nix::sys::signal::Signal;
use sketchnav_runtime::{Channels, Node, Ordered, Reader, System, Wake, Writer, provide_files};
use sketchnav_schemas::channels::{HEALTH, MISSION, STATUS};
use sketchnav_schemas::codes::{FaultKind, Order, Process, TaskState};
use sketchnav_schemas::fault_plan::PlannedFault;
use sketchnav_schemas::message::{Health, MissionCommand, MissionStatus, Text};
use sketchnav_schemas::run::{Pace, Pad, RunConfig};

use crate::child::{Child, ProcessLine};
use crate::error::{is_bad_input, is_incomplete};
use crate::faults::{Faults, RecordingFailure};
use crate::lives::{CLEARING, look_after, start_if_due};
use crate::stall::Stall;
use crate::{Death, Error, Result};

/// Interval between the supervisor's checks of its channels and children. It is short enough that a lockstep world, which waits for
/// the recorder, cannot send more statuses in the meantime than their channel holds.
const LOOK_EVERY: Duration = Duration::from_millis(4);
/// Time after the successful end of a process within which the mission may still end properly, since the status for the last
/// command may be on its way.
const EARLY_END: Duration = Duration::from_secs(2);
/// Maximum size of a channel's file, with any number of readers. For a sketch, 103 MiB were measured.
const LARGEST_FILE_MIB: u64 = 256;
/// Time since the beginning of the shutdown after which a signal means that the user does not want to wait.
const PATIENCE: Duration = Duration::from_secs(1);

/// Maximum time for the recorder to connect to its writers before they are ended.
const MEETING: Duration = Duration::from_secs(2);

/// Time limits for processes and for a lockstep.
#[derive(Debug, Clone, Copy)]
pub struct Grace {
    /// Time limit for world, sketcher, localizer and planner to end.
    pub services: Duration,
    /// Time limit for the recorder to write the remaining messages and close its file.
    pub recorder: Duration,
    /// Time for which a process may be stopped (SIGSTOP) during the mission before it is killed and restarted.
    pub stopped: Duration,
    /// Time for which all processes of a lockstep may wait for each other before the mission is ended.
    pub stalled: Duration,
}

impl Default for Grace {
    fn default() -> Self {
        Self {
            services: Duration::from_secs(5),
            recorder: Duration::from_secs(30),
            stopped: Duration::from_secs(3),
            stalled: Duration::from_secs(30),
        }
    }
}

/// The supervisor's channels that a player of a recording writes instead, through [`Supervisor::node`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Ceded {
    /// Whether orders are ceded. If so, the supervisor does not give any.
    pub mission: bool,
    /// Whether fault reports are ceded. If so, the supervisor does not publish any.
    pub faults: bool,
}

/// The state of the mission.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// The mission is running.
    Running,
    /// The planner has ended the mission, finished or aborted, and no pad can continue it.
    Ended,
    /// A SIGINT, SIGTERM or SIGHUP has asked the supervisor to end.
    Interrupted,
}

/// A running system. Dropping it has the same effect as [`Supervisor::shut_down`].
///
/// It must be started from a thread that lives as long as the system, because the kernel ends the processes started by a thread
/// when that thread ends.
pub struct Supervisor {
    grace: Grace,
    children: Vec<Child>,
    ports: Option<Ports>,
    channels: Option<Channels>,
    node: Option<Node>,
    system: Option<Rc<System>>,
    pad: Pad,
    status: Option<MissionStatus>,
    ended_tasks: BTreeMap<u32, MissionStatus>,
    /// Health reports by process and process id.
    health: BTreeMap<(u32, u32), Health>,
    survived: Vec<Death>,
    outstanding_faults: Vec<(usize, PlannedFault)>,
    recording_failure: Option<RecordingFailure>,
    /// The recording of the run, if there is one.
    recording: Option<PathBuf>,
    /// The folder next to the recording that contains the output of the processes.
    logs: Option<PathBuf>,
    /// Why the output of a process is missing from that folder.
    logs_failure: Option<String>,
    /// Detects a stuck lockstep. `None` unless the processes are paced only by each other.
    stall: Option<Stall>,
    /// The processes that the user runs by hand.
    by_hand: Vec<Process>,
}

struct Ports {
    /// Writer of orders, or `None` if they are ceded.
    mission: Option<Writer<MissionCommand>>,
    status: Reader<MissionStatus>,
    health: Reader<Health>,
    faults: Faults,
}

impl Supervisor {
    /// Creates the system `run.system`, starts its processes, and orders the mission to start unless people do that from the pad.
    /// First clears what dead systems have left behind.
    ///
    /// # Errors
    /// An error if the system is already running, or if a process cannot be started. In either case, nothing of the new system is
    /// left behind.
    pub fn start(run: &RunConfig, lines: Vec<ProcessLine>, grace: Grace) -> Result<Self> {
        let mut supervisor = Self::start_without_order(run, lines, grace)?;
        supervisor.order_start()?;
        Ok(supervisor)
    }

    /// Like [`Supervisor::start`], but the mission waits for [`Supervisor::order_start`].
    ///
    /// # Errors
    /// Any error of [`Supervisor::start`].
    pub fn start_without_order(run: &RunConfig, lines: Vec<ProcessLine>, grace: Grace) -> Result<Self> {
        check_limits()?;
        Self::begin(System::create(run)?, lines, grace, Ceded::default())
    }

    /// Like [`Supervisor::start`], but for a player that may also write the `ceded` channels of the supervisor.
    ///
    /// # Errors
    /// Any error of [`Supervisor::start`].
    pub fn start_for_player(
        run: &RunConfig,
        lines: Vec<ProcessLine>,
        grace: Grace,
        ceded: Ceded,
    ) -> Result<Self> {
        check_limits()?;
        let mut supervisor = Self::begin(System::create(run)?, lines, grace, ceded)?;
        supervisor.order_start()?;
        Ok(supervisor)
    }

    /// Continues a dead system that was taken over. Its processes resume from where they were.
    ///
    /// # Errors
    /// Any error of [`Supervisor::start`]. The system is cleared if that happens.
    pub fn resume(system: System, lines: Vec<ProcessLine>, grace: Grace) -> Result<Self> {
        let mut supervisor = Self::begin(system, lines, grace, Ceded::default())?;
        supervisor.order_start()?;
        if let Some(ports) = &mut supervisor.ports {
            let words = "its supervisor was killed; its processes resume where they left off";
            ports.faults.report(
                FaultKind::SystemResumed,
                Process::Supervisor,
                std::process::id(),
                |fault| {
                    fault.words = Text::new(words);
                },
            )?;
        }
        Ok(supervisor)
    }

    fn begin(system: System, lines: Vec<ProcessLine>, grace: Grace, ceded: Ceded) -> Result<Self> {
        let run = system.run_config()?;
        let pad = run.pad;
        let mut supervisor = Self::prepare(system, pad, grace, ceded)?;
        let paces_itself = run.pace == Pace::Lockstep && !pad.draws() && ceded == Ceded::default();
        supervisor.stall = paces_itself.then(|| Stall::begin(grace.stalled, Instant::now()));
        supervisor.by_hand = run.without;
        for line in lines {
            supervisor.spawn(line)?;
        }
        Ok(supervisor)
    }

    /// Orders the mission to start, unless that has already been done, or people do it from the pad.
    ///
    /// # Errors
    /// An error if the order cannot be sent.
    pub fn order_start(&mut self) -> Result<()> {
        // If an earlier supervisor gave orders, they were sent again when this one started.
        let mission = self.ports.as_ref().and_then(|ports| ports.mission.as_ref());
        let is_ordered = mission.is_none_or(|mission| mission.last_sent().is_some());
        if is_ordered || self.pad.draws() {
            return Ok(());
        }
        self.order(Ordered::new(Order::Start, 0))
    }

    /// Watches messages and processes until `timeout` has passed or the mission is no longer running.
    ///
    /// # Errors
    /// - [`Error::Died`] if a process that cannot resume ended before the mission did.
    /// - [`Error::GivenUp`] if a process kept dying without progress.
    /// - [`Error::Stalled`] if the processes of a lockstep no longer make progress.
    pub fn poll(&mut self, timeout: Duration) -> Result<Progress> {
        let end = Instant::now() + timeout;
        loop {
            self.receive()?;
            self.pass_on_orders()?;
            self.node.as_ref().map_or(Ok(()), Node::check_shared_memory)?;
            if self.mission_ended() {
                return Ok(Progress::Ended);
            }
            self.check_children()?;
            self.check_stall()?;
            let left = end.saturating_duration_since(Instant::now());
            match self.node.as_ref().map(|node| node.nap(left.min(LOOK_EVERY))) {
                Some(Wake::Terminate) => return Ok(Progress::Interrupted),
                _ if left.is_zero() => return Ok(Progress::Running),
                _ => {}
            }
        }
    }

    /// Returns the supervisor's node, through which a player writes the ceded channels, or `None` after shutdown.
    pub fn node(&self) -> Option<&Node> {
        self.node.as_ref()
    }

    /// Sends an order to the navigator, unless orders are ceded.
    pub fn order(&mut self, ordered: Ordered) -> Result<()> {
        if let Some(mission) = self.ports.as_mut().and_then(|ports| ports.mission.as_mut()) {
            let stamp_ns = self.status.map_or(0, |status| status.header.stamp_ns);
            mission.send(|message| {
                message.header.stamp_ns = stamp_ns;
                (message.order, message.task) = (ordered.order.code(), ordered.task);
                ordered.here.iter().for_each(|here| message.set_here(here));
                ordered.place.iter().for_each(|place| message.set_place(place));
            })?;
        }
        Ok(())
    }

    /// Returns the planner's last status of the mission.
    pub fn status(&self) -> Option<&MissionStatus> {
        self.status.as_ref()
    }

    /// Returns the last status of each task that has ended, in order, for display. The supervisor only looks occasionally, so a
    /// status may be missing. Only the recording is guaranteed to contain every status.
    pub fn ended_tasks(&self) -> impl Iterator<Item = &MissionStatus> {
        self.ended_tasks.values()
    }

    /// Returns the planned faults that had not happened when the system was shut down, with their numbers from 1. Empty before
    /// shutdown.
    pub fn outstanding_faults(&self) -> &[(usize, PlannedFault)] {
        &self.outstanding_faults
    }

    /// Returns the recorder's report about files that it could not write. Available after shutdown. If its disk had space again in
    /// time, the recording may still be complete.
    pub fn recording_failure(&self) -> Option<&RecordingFailure> {
        self.recording_failure.as_ref()
    }

    /// Returns the last health report of `process`, with its counts summed over all restarts.
    pub fn health(&self, process: Process) -> Option<Health> {
        let lives = self.health.range((process.code(), 0)..=(process.code(), u32::MAX));
        lives.map(|(_, health)| *health).reduce(sum)
    }

    /// Returns the deaths that the system has survived, in order.
    pub fn survived(&self) -> &[Death] {
        &self.survived
    }

    /// Returns the number of restarts of `process`.
    pub fn restarts(&self, process: Process) -> u64 {
        self.survived.iter().filter(|death| death.process == process).count() as u64
    }

    /// Returns the folder `logs` next to the recording, which contains `PROCESS.log` for each process that has printed something.
    /// `None` until [`Supervisor::shut_down`], and without a recording.
    pub fn logs(&self) -> Option<&Path> {
        self.logs.as_deref()
    }

    /// Returns why the output of a process could not be copied to the folder of [`Supervisor::logs`], or `None` if all of it was.
    pub fn logs_failure(&self) -> Option<&str> {
        self.logs_failure.as_deref()
    }

    /// Ends the services, and then the recorder, which by then has received everything that was sent. Finally, the channels and
    /// the system are removed, even if an earlier step fails.
    ///
    /// Everything that the supervisor has received can still be queried. A second call does nothing. Incomplete recordings and logs
    /// are not errors; see [`Supervisor::recording_failure`] and [`Supervisor::logs_failure`]. A further SIGINT, SIGTERM or SIGHUP,
    /// at least a second after the shutdown began, kills the processes that have not ended yet.
    ///
    /// # Errors
    /// - [`Error::Died`] if a process failed while it was ending.
    /// - [`Error::Killed`] if a process did not end.
    pub fn shut_down(&mut self) -> Result<()> {
        let met = self.await_recorder();
        let services = self.end_children(|process| process != Process::Recorder, self.grace.services);
        let recorder = self.end_recorder();
        let received = self.receive();
        let recorder = self.take_recording_failure_from(recorder);
        self.keep_logs();
        self.children.clear();
        if let Some(node) = &self.node {
            node.clear_dead(CLEARING);
        }
        (self.ports, self.channels, self.node) = (None, None, None);
        // The files from which this is read are removed with the system.
        let outstanding = self.system.as_ref().map_or(Ok(Vec::new()), |system| system.outstanding_faults());
        let outstanding = outstanding.map(|found| self.outstanding_faults = found);
        let removed = self.system.take().and_then(Rc::into_inner).map_or(Ok(()), System::remove);
        let removed = outstanding.and(removed).map_err(Error::from);
        met.and(services).and(recorder).and(received).and(removed)
    }

    /// Copies the output of the processes to the folder of the recording, since their logs are removed with the system.
    fn keep_logs(&mut self) {
        let Some(recording) = &self.recording else { return };
        let folder = recording.with_file_name("logs");
        for child in &self.children {
            match child.keep_log(&folder) {
                Ok(has_lines) => self.logs = self.logs.take().or_else(|| has_lines.then(|| folder.clone())),
                Err(error) => {
                    self.logs_failure =
                        Some(format!("{} of the {}: {error}", folder.display(), child.process.word()))
                }
            }
        }
    }

    /// Stores the recorder's report about its files. A recorder that ended because its files are incomplete has done all it could.
    fn take_recording_failure_from(&mut self, ended: Result<()>) -> Result<()> {
        if let Some(ports) = &mut self.ports {
            self.recording_failure = ports.faults.take_recording_failure();
        }
        match ended {
            Err(Error::Died(death)) if is_incomplete(death.status) => {
                let words = || RecordingFailure { words: death.last_lines, missing: 0 };
                self.recording_failure.get_or_insert_with(words);
                Ok(())
            }
            ended => ended,
        }
    }

    /// Waits until the recorder has connected, as shown by its first health report. Otherwise, all messages of a mission of a few
    /// instants could be lost.
    fn await_recorder(&mut self) -> Result<()> {
        let (begun, asked) = (Instant::now(), self.end_requests());
        loop {
            self.receive()?;
            let has_met = self.health.keys().any(|(process, _)| *process == Process::Recorder.code());
            let is_over = begun.elapsed() > MEETING || self.end_requests() > asked;
            let recorder = self.children.iter_mut().find(|child| child.process == Process::Recorder);
            let Some(recorder) = recorder else { return Ok(()) };
            if has_met || is_over || recorder.ended()?.is_some() {
                return Ok(());
            }
            // A nap would end immediately if a signal has asked the supervisor to end.
            std::thread::sleep(LOOK_EVERY);
        }
    }

    fn prepare(system: System, pad: Pad, grace: Grace, ceded: Ceded) -> Result<Self> {
        let recording = system.run_config()?.recording.map(PathBuf::from);
        let system = Rc::new(system);
        let mut supervisor = Self {
            grace,
            children: Vec::new(),
            ports: None,
            channels: None,
            node: None,
            system: Some(system.clone()),
            pad,
            status: None,
            ended_tasks: BTreeMap::new(),
            health: BTreeMap::new(),
            survived: Vec::new(),
            outstanding_faults: Vec::new(),
            recording_failure: None,
            recording,
            logs: None,
            logs_failure: None,
            stall: None,
            by_hand: Vec::new(),
        };
        let node = supervisor.node.insert(Node::join(system, Process::Supervisor)?);
        supervisor.channels = Some(Channels::create(node)?);
        let mut mission = (!ceded.mission).then(|| node.writer(MISSION)).transpose()?;
        mission.iter_mut().for_each(Writer::resume_after_history);
        supervisor.ports = Some(Ports {
            mission,
            status: node.reader(STATUS)?,
            health: node.reader(HEALTH)?,
            faults: Faults::open(node, ceded.faults)?,
        });
        Ok(supervisor)
    }

    fn spawn(&mut self, line: ProcessLine) -> Result<()> {
        if let Some(system) = &self.system {
            let log = system.log_path(line.process);
            self.children.push(Child::spawn(line, log, self.grace.stopped)?);
        }
        Ok(())
    }

    fn receive(&mut self) -> Result<()> {
        let Some(ports) = &mut self.ports else { return Ok(()) };
        while let Some(status) = ports.status.receive()? {
            if TaskState::from_code(status.state).is_some_and(TaskState::is_end) {
                self.ended_tasks.insert(status.task, *status);
            }
            self.status = Some(*status);
            ports.faults.is_now(status.header);
        }
        ports.faults.pass_on()?;
        for (pid, starvation) in ports.faults.take_starved() {
            let starved = self.children.iter_mut().filter(|child| child.pid() == pid);
            starved.for_each(|child| child.bear(starvation));
        }
        while let Some(health) = ports.health.receive()? {
            self.health.insert((health.process, health.pid), *health);
        }
        Ok(())
    }

    /// Sends the orders that tools have requested.
    fn pass_on_orders(&mut self) -> Result<()> {
        let orders = self.ports.as_mut().map(|ports| ports.faults.take_orders()).unwrap_or_default();
        orders.into_iter().try_for_each(|ordered| self.order(ordered))
    }

    fn mission_ended(&self) -> bool {
        match self.status.and_then(|status| TaskState::from_code(status.state)) {
            Some(TaskState::Finished) => !self.pad.draws(),
            Some(TaskState::Aborted) => self.pad.is_absent(),
            _ => false,
        }
    }

    /// Restarts processes that have died and can resume.
    fn check_children(&mut self) -> Result<()> {
        let (Some(node), Some(ports)) = (&self.node, &mut self.ports) else { return Ok(()) };
        for child in &mut self.children {
            self.survived.extend(look_after(child, node, &mut ports.faults)?);
            let Some((status, when)) = child.ended()? else { continue };
            // A process that is due is already being handled. One that has died since the line above is handled at the next
            // check.
            let is_final = !child.resumes() || is_bad_input(status);
            let is_early = !status.success() || child.process == Process::Recorder;
            if is_final && (is_early || when.elapsed() > EARLY_END) {
                let death = child.death(status);
                ports.faults.died(&death)?;
                return Err(Error::Died(death));
            }
        }
        Ok(())
    }

    /// Checks that the lockstep is not stuck. The check is suspended while a recorder waits because its disk is full, and while
    /// a process that the user runs by hand is missing.
    ///
    /// # Errors
    /// [`Error::Stalled`] if all processes have been waiting for each other for too long.
    fn check_stall(&mut self) -> Result<()> {
        let (Some(stall), Some(node), Some(ports)) = (&mut self.stall, &self.node, &self.ports) else {
            return Ok(());
        };
        let mut everybody_waits =
            !ports.faults.recording_stands() && has_joined(node.system(), &self.by_hand)?;
        let mut progress = 0;
        for child in &mut self.children {
            progress += u64::from(node.progress(child.process));
            everybody_waits &= child.ended()?.is_none() && child.is_responsive() && !child.is_starved();
        }
        let Some(stands) = stall.look(Instant::now(), progress, everybody_waits) else { return Ok(()) };
        let rejected = self.health.values().filter(|health| health.refused_messages > 0);
        let word = |health: &Health| {
            let process = Process::from_code(health.process).map_or("a process", Process::word);
            format!("; {process} rejected {} invalid messages", health.refused_messages)
        };
        let tick = self.status.map_or(0, |status| status.header.source_seq);
        Err(Error::Stalled { seconds: stands.as_secs(), tick, rejected: rejected.map(word).collect() })
    }

    /// Ends the recorder. If it is dead, or is killed while it ends, a successor writes the remaining messages.
    fn end_recorder(&mut self) -> Result<()> {
        loop {
            self.revive_recorder()?;
            let ended = self.end_children(|process| process == Process::Recorder, self.grace.recorder);
            if ended.is_err() || !self.recorder_was_killed()? {
                return ended;
            }
        }
    }

    fn revive_recorder(&mut self) -> Result<()> {
        let recorder = self.children.iter_mut().find(|child| child.process == Process::Recorder);
        let (Some(recorder), Some(node), Some(ports)) = (recorder, &self.node, &mut self.ports) else {
            return Ok(());
        };
        self.survived.extend(look_after(recorder, node, &mut ports.faults)?);
        while recorder.is_due() {
            std::thread::sleep(LOOK_EVERY);
            start_if_due(recorder, node, &mut ports.faults)?;
        }
        Ok(())
    }

    fn recorder_was_killed(&mut self) -> Result<bool> {
        let recorder = self.children.iter_mut().find(|child| child.process == Process::Recorder);
        let Some(recorder) = recorder.filter(|recorder| recorder.resumes()) else { return Ok(false) };
        Ok(recorder.ended()?.is_some_and(|(status, _)| status.signal().is_some()))
    }

    fn end_requests(&self) -> u32 {
        self.node.as_ref().map_or(0, Node::end_requests)
    }

    /// Asks some of the processes to end, kills those that do not, and waits for all of them.
    fn end_children(&mut self, kind: impl Fn(Process) -> bool, grace: Duration) -> Result<()> {
        let (begun, asked) = (Instant::now(), self.end_requests());
        let limit = begun + grace;
        let mut result = Ok(());
        let mut killed = Vec::new();
        let mut children: Vec<_> = self.children.iter_mut().filter(|child| kind(child.process)).collect();
        for child in &mut children {
            // Messages that a recorder misses by ending too early are not recorded anywhere.
            if child.process == Process::Recorder
                && !child.resumes()
                && let Some((status, _)) = child.ended()?
            {
                result = result.and(Err(Error::Died(child.death(status))));
            }
            result = result.and(child.signal(Signal::SIGTERM));
            // A stopped process receives SIGTERM only when it is continued.
            result = result.and(child.signal(Signal::SIGCONT));
        }
        let node = self.node.as_ref();
        let is_urgent = || begun.elapsed() > PATIENCE && node.is_some_and(|n| n.end_requests() > asked);
        for child in children {
            if !child.wait_until(limit, is_urgent).unwrap_or(false) {
                killed.push(child.process);
                result = result.and(child.kill());
            } else if let Some((status, _)) = child.ended()?
                && !status.success()
                && !(child.resumes() && status.signal().is_some())
            {
                result = result.and(Err(Error::Died(child.death(status))));
            }
        }
        if killed.is_empty() { result } else { result.and(Err(Error::Killed(killed))) }
    }
}

/// Returns true if all of these processes take part in the system.
fn has_joined(system: &System, processes: &[Process]) -> Result<bool> {
    if processes.is_empty() {
        return Ok(true);
    }
    let joined = system.processes()?;
    Ok(processes.iter().all(|process| joined.iter().any(|(name, _)| name == process.word())))
}

fn check_limits() -> Result<()> {
    check_file_limit()?;
    Ok(provide_files()?)
}

/// Checks that files may be as large as the largest file in shared memory. Without this check, a later error would only name a
/// channel.
///
/// # Errors
/// [`Error::FileLimit`] if the limit on file sizes is too low.
pub fn check_file_limit() -> Result<()> {
    // A limit that cannot be queried cannot be reported either.
    let found_mib = getrlimit(Resource::RLIMIT_FSIZE).map_or(u64::MAX, |(soft, _)| soft) >> 20;
    let needed_mib = LARGEST_FILE_MIB;
    if found_mib < needed_mib { Err(Error::FileLimit { needed_mib, found_mib }) } else { Ok(()) }
}

/// Merges the health of two lives of a process. The later life provides the current state.
fn sum(earlier: Health, later: Health) -> Health {
    Health {
        steps: earlier.steps + later.steps,
        busy_ns: earlier.busy_ns + later.busy_ns,
        step_allocations: earlier.step_allocations + later.step_allocations,
        lost_messages: earlier.lost_messages + later.lost_messages,
        refused_messages: earlier.refused_messages + later.refused_messages,
        ..later
    }
}

impl Drop for Supervisor {
    fn drop(&mut self) {
        // The result is ignored here. Call `shut_down` to see it.
        let _ = self.shut_down();
    }
}

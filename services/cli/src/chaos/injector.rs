//! Kills the processes of a run at random times.
//!
//! Times are fractions of the mission, measured by the world's progress rather than by the wall clock, so that the kills are spread
//! over the whole mission however long the recoveries take. The seed determines which processes are killed at which times, but not
//! at which point of its step a process is killed. Kills at start-up happen whenever a process starts.

use std::collections::{BTreeSet, VecDeque};
use std::fs;
use std::process::Child;
use std::thread::sleep;
use std::time::{Duration, Instant};

use nix::sys::signal::Signal;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use sketchnav_runtime::{System, Watch};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::fault_plan::Action;
use sketchnav_schemas::run::Pace;
use sketchnav_schemas::seed;

use crate::args::{ChaosOptions, KillSignal};

/// Interval at which to check the processes.
const LOOK_EVERY: Duration = Duration::from_micros(500);
/// Fraction of the mission after which no process is killed, since it would have no work left by which to tell that it has
/// recovered.
const LAST_SHARE: f64 = 0.95;
/// Like [`LAST_SHARE`], but for runs in real time, where a mission may end earlier than the undisturbed one.
const LAST_SHARE_IN_REAL_TIME: f64 = 0.8;
/// Probability that a second process is drawn to be killed at the same time.
const PAIRS: f64 = 0.2;
/// Maximum time after its start when a starting process is killed.
const YOUNG: Duration = Duration::from_millis(12);
/// Maximum number of times in a row that a process is killed while it starts. After a few more, the supervisor would give up on it.
const YOUNG_KILLS: u32 = 3;
/// Maximum time to wait for a recovery.
const PATIENCE: Duration = Duration::from_secs(20);

/// The run to disturb.
pub struct Plan {
    /// Number of messages that the world sends in the whole mission.
    pub steps: u32,
    /// The process id of the run, which is that of its supervisor.
    pub supervisor: u32,
    /// The name of the run's system.
    pub system: String,
}

/// The processes to kill at one moment of the mission.
#[derive(Debug, Clone, PartialEq)]
struct Blow {
    /// When to strike, as the number of messages that the world has sent by then.
    moment: u32,
    /// The process to kill, or two processes to kill at once.
    who: Vec<Process>,
}

/// Draws as many kills as the options ask for.
fn blows(options: &ChaosOptions, steps: u32, rng: &mut Pcg64Mcg) -> Vec<Blow> {
    let share = match options.speed {
        Pace::Lockstep => LAST_SHARE,
        Pace::RealTime { .. } => LAST_SHARE_IN_REAL_TIME,
    };
    let last = (f64::from(steps) * share) as u32;
    let targets = &options.targets;
    let (mut blows, mut left) = (Vec::new(), options.kills);
    while left > 0 {
        let moment = rng.random_range(0..=last);
        let [first, second] = [(); 2].map(|()| targets[rng.random_range(0..targets.len())]);
        let pair = rng.random_bool(PAIRS) && second != first && left > 1;
        let who = if pair { vec![first, second] } else { vec![first] };
        left -= who.len() as u32;
        blows.push(Blow { moment, who });
    }
    blows.sort_by_key(|blow| blow.moment);
    blows
}

/// A kill that happened.
#[derive(Debug)]
pub struct Hit {
    /// The process that was killed.
    pub process: Process,
    /// The time until the process had done new work, or `None` if it did not recover.
    pub recovered: Option<Duration>,
    at: Instant,
    progress: u32,
}

/// Kills processes, and measures how long their recoveries take.
pub struct Injector<'a> {
    options: &'a ChaosOptions,
    plan: Plan,
    rng: Pcg64Mcg,
    /// The kills to come, in order.
    blows: VecDeque<Blow>,
    hits: Vec<Hit>,
    system: Option<(System, Watch)>,
    /// The ids of processes whose start has already been handled.
    known: BTreeSet<u32>,
}

impl<'a> Injector<'a> {
    /// Draws the kills from the seed.
    pub fn new(options: &'a ChaosOptions, plan: Plan) -> Self {
        let mut rng = seed::stream(options.seed, "chaos");
        let blows = blows(options, plan.steps, &mut rng).into();
        let (hits, known) = (Vec::new(), BTreeSet::new());
        Self { options, plan, rng, blows, hits, system: None, known }
    }

    /// Disturbs the run until it ends, and returns the kills that happened.
    pub fn disturb(mut self, run: &mut Child) -> anyhow::Result<Vec<Hit>> {
        while run.try_wait()?.is_none() {
            if self.system.is_none() {
                let system = System::open(&self.plan.system).ok();
                self.system =
                    system.and_then(|system| Watch::open(&system).ok().map(|watch| (system, watch)));
            }
            self.note_recoveries();
            if self.options.at_start_up {
                self.hit_the_young();
            }
            self.hit_when_due();
            sleep(LOOK_EVERY);
        }
        Ok(self.hits)
    }

    fn progress(&self, process: Process) -> u32 {
        self.system.as_ref().map_or(0, |(_, watch)| watch.progress(process))
    }

    fn note_recoveries(&mut self) {
        let Some((_, watch)) = &self.system else { return };
        for hit in self.hits.iter_mut().filter(|hit| hit.recovered.is_none()) {
            if watch.progress(hit.process) != hit.progress {
                hit.recovered = Some(hit.at.elapsed());
            }
        }
    }

    fn is_recovering(&self, process: Process) -> bool {
        let open = |hit: &Hit| hit.recovered.is_none() && hit.at.elapsed() < PATIENCE;
        self.hits.iter().any(|hit| hit.process == process && open(hit))
    }

    /// Kills the next processes if their moment has come, and if all of them are running and have recovered from the previous
    /// kill.
    fn hit_when_due(&mut self) {
        let done = self.progress(Process::World);
        if self.blows.front().is_none_or(|blow| done < blow.moment) {
            return;
        }
        let alive = serving(self.plan.supervisor);
        let find = |process: &Process| alive.iter().find(|(found, _)| found == process).copied();
        let mut due = 0;
        while self.blows.get(due).is_some_and(|blow| blow.moment <= done) {
            let who = &self.blows[due].who;
            let ready = who.iter().filter(|&&process| !self.is_recovering(process)).filter_map(find);
            let ready: Vec<_> = ready.collect();
            if ready.len() == who.len() {
                self.strike(due, &ready);
                return;
            }
            due += 1;
        }
    }

    /// Kills the processes in `ready`. A process that has just ended by itself cannot be killed and is left in the blow for a
    /// later attempt.
    fn strike(&mut self, due: usize, ready: &[(Process, u32)]) {
        let missed = ready.iter().filter(|&&(process, pid)| !self.hit(process, pid));
        let missed: Vec<_> = missed.map(|&(process, _)| process).collect();
        if missed.is_empty() {
            self.blows.remove(due);
        } else {
            self.blows[due].who = missed;
        }
    }

    /// Kills processes that were just started.
    fn hit_the_young(&mut self) {
        for (process, pid) in serving(self.plan.supervisor) {
            let in_a_row = self.hits.iter().rev().filter(|hit| hit.process == process);
            let in_a_row = in_a_row.take_while(|hit| hit.recovered.is_none()).count() as u32;
            let is_target = self.options.targets.contains(&process) && in_a_row < YOUNG_KILLS;
            if self.known.insert(pid) && is_target && !self.blows.is_empty() {
                sleep(self.rng.random_range(Duration::ZERO..YOUNG));
                if self.hit(process, pid) {
                    self.forget_one();
                }
            }
        }
    }

    /// Drops the last planned kill to make up for one that was made at a start-up, so that the total stays the same.
    fn forget_one(&mut self) {
        if let Some(mut blow) = self.blows.pop_back() {
            blow.who.pop();
            self.blows.extend((!blow.who.is_empty()).then_some(blow));
        }
    }

    /// Kills a process. Returns false if the process has just ended by itself.
    fn hit(&mut self, process: Process, pid: u32) -> bool {
        let progress = self.progress(process);
        let Some((system, _)) = &self.system else { return false };
        let Some(signal) = KillSignal::drawn(&self.options.signal, &mut self.rng).signal() else {
            return false;
        };
        let is_hit = system.inject(process, pid, signal, "chaos").is_ok();
        if is_hit {
            self.hits.push(Hit { process, recovered: None, at: Instant::now(), progress });
        }
        is_hit
    }
}

/// Returns the running processes that a supervisor has started, with their process ids.
fn serving(supervisor: u32) -> Vec<(Process, u32)> {
    let children = fs::read_to_string(format!("/proc/{supervisor}/task/{supervisor}/children"));
    let pids = children.unwrap_or_default();
    let pids = pids.split_whitespace().filter_map(|pid| pid.parse().ok());
    pids.filter_map(|pid| Some((served(pid)?, pid))).collect()
}

/// Returns the process that `pid` serves as, according to its command line (`serve PROCESS …`), or `None` if it is dead.
fn served(pid: u32) -> Option<Process> {
    let line = fs::read_to_string(format!("/proc/{pid}/cmdline")).ok()?;
    let mut words = line.split('\0').skip_while(|word| *word != "serve");
    words.nth(1)?.parse().ok()
}

/// Returns the number of running processes that serve the system. After its run, these are orphans.
pub fn orphans(system: &str) -> usize {
    let entries = fs::read_dir("/proc").into_iter().flatten();
    let pids = entries.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse::<u32>().ok());
    let serves = |pid: &u32| {
        let line = fs::read_to_string(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        served(*pid).is_some() && line.split('\0').any(|word| word == system)
    };
    pids.filter(serves).count()
}

impl KillSignal {
    /// All kinds of faults.
    pub const ALL: [Self; 4] = [Self::Kill, Self::Stop, Self::Term, Self::Starve];

    /// Returns the corresponding action in a schedule.
    pub fn action(self) -> Action {
        match self {
            Self::Kill => Action::Kill,
            Self::Stop => Action::Stop,
            Self::Term => Action::Term,
            Self::Starve => Action::Starve,
        }
    }

    /// Returns the signal that causes the fault, or `None` if it needs more than one signal.
    pub fn signal(self) -> Option<Signal> {
        match self {
            Self::Kill => Some(Signal::SIGKILL),
            Self::Stop => Some(Signal::SIGSTOP),
            Self::Term => Some(Signal::SIGTERM),
            Self::Starve => None,
        }
    }

    /// Draws one of `kinds`, which must not be empty.
    pub fn drawn(kinds: &[Self], rng: &mut Pcg64Mcg) -> Self {
        match kinds {
            [only] => *only,
            kinds => kinds[rng.random_range(0..kinds.len())],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression test: which processes were killed once depended on which of them had just recovered, and thus on the clock.
    #[test]
    fn the_seed_determines_when_each_process_is_hit() {
        let options = ChaosOptions::of_words(&["--kills", "50", "--targets", "world,planner"]);
        let draw = || blows(&options, 1000, &mut seed::stream(7, "chaos"));
        let drawn = draw();
        assert_eq!(drawn, draw());
        assert_eq!(drawn.iter().map(|blow| blow.who.len()).sum::<usize>(), 50);
        assert!(drawn.is_sorted_by_key(|blow| blow.moment) && drawn.iter().all(|blow| blow.moment <= 950));
        assert!(drawn.iter().any(|blow| blow.who.len() == 2));
    }
}

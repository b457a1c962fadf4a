//! Kills the processes of a run at random moments.
//!
//! A moment is a fraction of the mission, measured by the world's progress and not by the clock, so that the kills
//! spread over the whole mission however long the recoveries take. The seed decides at which moments which processes
//! are hit; where in its step a process is hit is chance. Kills at start-up happen whenever a process starts.

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

/// How often to check the processes.
const LOOK_EVERY: Duration = Duration::from_micros(500);
/// Beyond this fraction of the mission no process is killed: it would have nothing left to recover.
const LAST_SHARE: f64 = 0.95;
/// The same in real time, where a mission may end earlier than the undisturbed one.
const LAST_SHARE_IN_REAL_TIME: f64 = 0.8;
/// How often two processes are killed at once.
const PAIRS: f64 = 0.2;
/// A starting process is killed within this time of its start.
const YOUNG: Duration = Duration::from_millis(12);
/// How often in a row a process is killed while it starts; a few more, and it would be given up.
const YOUNG_KILLS: u32 = 3;
/// How long a recovery is waited for.
const PATIENCE: Duration = Duration::from_secs(20);

/// The run to disturb.
pub struct Plan {
    /// How much work the world does in the whole mission.
    pub steps: u32,
    /// The run's process id.
    pub supervisor: u32,
    /// Its system.
    pub system: String,
}

/// What is to be killed at one moment.
#[derive(Debug, Clone, PartialEq)]
struct Blow {
    /// The world's progress at that moment.
    moment: u32,
    /// One process, or two at once.
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

/// A kill.
#[derive(Debug)]
pub struct Hit {
    /// The process that was hit.
    pub process: Process,
    /// How long it took until it had done new work.
    pub recovered: Option<Duration>,
    at: Instant,
    progress: u32,
}

/// Kills processes, and measures the recoveries.
pub struct Injector<'a> {
    options: &'a ChaosOptions,
    plan: Plan,
    rng: Pcg64Mcg,
    /// The kills to come, in order.
    blows: VecDeque<Blow>,
    hits: Vec<Hit>,
    system: Option<(System, Watch)>,
    /// Processes whose start has been handled.
    known: BTreeSet<u32>,
}

impl<'a> Injector<'a> {
    /// Draws the kills.
    pub fn new(options: &'a ChaosOptions, plan: Plan) -> Self {
        let mut rng = seed::stream(options.seed, "chaos");
        let blows = blows(options, plan.steps, &mut rng).into();
        let (hits, known) = (Vec::new(), BTreeSet::new());
        Self { options, plan, rng, blows, hits, system: None, known }
    }

    /// Disturbs the run until it has ended.
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

    /// Strikes once all processes that a blow hits are running and have recovered from the one before.
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

    /// A process that is missed because it has just ended by itself is tried again.
    fn strike(&mut self, due: usize, ready: &[(Process, u32)]) {
        let missed = ready.iter().filter(|&&(process, pid)| !self.hit(process, pid));
        let missed: Vec<_> = missed.map(|&(process, _)| process).collect();
        if missed.is_empty() {
            self.blows.remove(due);
        } else {
            self.blows[due].who = missed;
        }
    }

    /// Kills processes that have just been started.
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

    /// Drops the last of the drawn kills, in place of which an undrawn one was made.
    fn forget_one(&mut self) {
        if let Some(mut blow) = self.blows.pop_back() {
            blow.who.pop();
            self.blows.extend((!blow.who.is_empty()).then_some(blow));
        }
    }

    /// Kills a process; false if it has just ended by itself.
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

/// The living processes that a supervisor has started.
fn serving(supervisor: u32) -> Vec<(Process, u32)> {
    let children = fs::read_to_string(format!("/proc/{supervisor}/task/{supervisor}/children"));
    let pids = children.unwrap_or_default();
    let pids = pids.split_whitespace().filter_map(|pid| pid.parse().ok());
    pids.filter_map(|pid| Some((served(pid)?, pid))).collect()
}

/// The process as which `pid` was started: `serve PROCESS …`. `None` if it is dead.
fn served(pid: u32) -> Option<Process> {
    let line = fs::read_to_string(format!("/proc/{pid}/cmdline")).ok()?;
    let mut words = line.split('\0').skip_while(|word| *word != "serve");
    words.nth(1)?.parse().ok()
}

/// The number of living processes that serve the system.
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
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Kill, Self::Stop, Self::Term, Self::Starve];

    /// The corresponding action in a schedule.
    pub fn action(self) -> Action {
        match self {
            Self::Kill => Action::Kill,
            Self::Stop => Action::Stop,
            Self::Term => Action::Term,
            Self::Starve => Action::Starve,
        }
    }

    /// The signal, if it is done by one.
    pub fn signal(self) -> Option<Signal> {
        match self {
            Self::Kill => Some(Signal::SIGKILL),
            Self::Stop => Some(Signal::SIGSTOP),
            Self::Term => Some(Signal::SIGTERM),
            Self::Starve => None,
        }
    }

    /// Draws one of `kinds`, of which there is at least one.
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

    /// The processes to hit once depended on which one had just recovered, and so on the clock.
    #[test]
    fn the_seed_decides_when_who_is_hit() {
        let options = ChaosOptions::of_words(&["--kills", "50", "--targets", "world,planner"]);
        let draw = || blows(&options, 1000, &mut seed::stream(7, "chaos"));
        let drawn = draw();
        assert_eq!(drawn, draw());
        assert_eq!(drawn.iter().map(|blow| blow.who.len()).sum::<usize>(), 50);
        assert!(drawn.is_sorted_by_key(|blow| blow.moment) && drawn.iter().all(|blow| blow.moment <= 950));
        assert!(drawn.iter().any(|blow| blow.who.len() == 2));
    }
}

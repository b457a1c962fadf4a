//! Kills the processes of a run at moments drawn by lot.
//!
//! A moment is a share of the mission, told by how much the world has done, not by the clock: however long
//! the recoveries take, the kills spread over the whole mission. Which moments and which processes the seed
//! decides; where in its step a process is hit, chance.

use std::collections::BTreeSet;
use std::fs;
use std::process::Child;
use std::thread::sleep;
use std::time::{Duration, Instant};

use nix::sys::signal::Signal;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use sketchnav_runtime::{System, Watch};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::seed;

use crate::args::ChaosOptions;

/// How often to look.
const LOOK_EVERY: Duration = Duration::from_micros(500);
/// After this share of the mission nobody is killed: what is killed later has nothing left to recover.
const LAST_SHARE: f64 = 0.95;
/// How often two are killed at once.
const PAIRS: f64 = 0.2;
/// A process that starts is killed within this time of its life.
const YOUNG: Duration = Duration::from_millis(12);
/// A process is killed so many times in a row while it starts: after some more it would be given up.
const YOUNG_KILLS: u32 = 3;
/// A process that takes longer is no longer waited for.
const PATIENCE: Duration = Duration::from_secs(20);

/// What is to be disturbed.
pub struct Plan {
    /// How much the world does in the whole mission.
    pub steps: u32,
    /// The run's process id.
    pub supervisor: u32,
    /// Its system.
    pub system: String,
}

/// A kill.
#[derive(Debug)]
pub struct Hit {
    /// Who was hit.
    pub process: Process,
    /// How long it took until it had done something new.
    pub recovered: Option<Duration>,
    at: Instant,
    progress: u32,
}

/// Kills, and sees how long the recovery takes.
pub struct Injector<'a> {
    options: &'a ChaosOptions,
    plan: Plan,
    rng: Pcg64Mcg,
    /// When to kill, latest first.
    moments: Vec<u32>,
    hits: Vec<Hit>,
    system: Option<(System, Watch)>,
    /// Those whose start has been dealt with.
    known: BTreeSet<u32>,
}

impl<'a> Injector<'a> {
    /// Draws the moments.
    pub fn new(options: &'a ChaosOptions, plan: Plan) -> Self {
        let mut rng = seed::stream(options.seed, "chaos");
        let last = (f64::from(plan.steps) * LAST_SHARE) as u32;
        let mut moments: Vec<_> = (0..options.kills).map(|_| rng.random_range(0..=last)).collect();
        moments.sort_unstable_by(|a, b| b.cmp(a));
        let (hits, known) = (Vec::new(), BTreeSet::new());
        Self { options, plan, rng, moments, hits, system: None, known }
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

    fn hit_when_due(&mut self) {
        if self.moments.last().is_none_or(|&moment| self.progress(Process::World) < moment) {
            return;
        }
        let targets = &self.options.targets;
        let first = targets[self.rng.random_range(0..targets.len())];
        let second = targets[self.rng.random_range(0..targets.len())];
        let pair = self.rng.random_bool(PAIRS) && second != first && self.moments.len() > 1;
        let alive = serving(self.plan.supervisor);
        let chosen = [Some(first), pair.then_some(second)];
        for process in
            chosen.into_iter().flatten().filter(|&process| !self.is_recovering(process)).collect::<Vec<_>>()
        {
            if let Some(&(_, pid)) = alive.iter().find(|(found, _)| *found == process) {
                self.hit(process, pid);
            }
        }
    }

    /// Whoever has just been started.
    fn hit_the_young(&mut self) {
        for (process, pid) in serving(self.plan.supervisor) {
            let in_a_row = self.hits.iter().rev().filter(|hit| hit.process == process);
            let in_a_row = in_a_row.take_while(|hit| hit.recovered.is_none()).count() as u32;
            let is_target = self.options.targets.contains(&process) && in_a_row < YOUNG_KILLS;
            if self.known.insert(pid) && is_target && !self.moments.is_empty() {
                sleep(self.rng.random_range(Duration::ZERO..YOUNG));
                self.hit(process, pid);
            }
        }
    }

    fn hit(&mut self, process: Process, pid: u32) {
        let progress = self.progress(process);
        let Some((system, _)) = &self.system else { return };
        if system.inject(process, pid, self.options.signal.signal(), "chaos").is_ok() {
            self.hits.push(Hit { process, recovered: None, at: Instant::now(), progress });
            self.moments.pop();
        }
    }
}

/// The processes that a supervisor has started and that live.
fn serving(supervisor: u32) -> Vec<(Process, u32)> {
    let children = fs::read_to_string(format!("/proc/{supervisor}/task/{supervisor}/children"));
    let pids = children.unwrap_or_default();
    let pids = pids.split_whitespace().filter_map(|pid| pid.parse().ok());
    pids.filter_map(|pid| Some((served(pid)?, pid))).collect()
}

/// What the process `pid` was started as: `serve PROCESS …`. Nothing where it is dead.
fn served(pid: u32) -> Option<Process> {
    let line = fs::read_to_string(format!("/proc/{pid}/cmdline")).ok()?;
    let mut words = line.split('\0').skip_while(|word| *word != "serve");
    words.nth(1)?.parse().ok()
}

/// How many processes live that serve the system.
pub fn orphans(system: &str) -> usize {
    let entries = fs::read_dir("/proc").into_iter().flatten();
    let pids = entries.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse::<u32>().ok());
    let serves = |pid: &u32| {
        let line = fs::read_to_string(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        served(*pid).is_some() && line.split('\0').any(|word| word == system)
    };
    pids.filter(serves).count()
}

impl crate::args::KillSignal {
    fn signal(self) -> Signal {
        match self {
            Self::Kill => Signal::SIGKILL,
            Self::Stop => Signal::SIGSTOP,
            Self::Term => Signal::SIGTERM,
        }
    }
}

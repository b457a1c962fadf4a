//! Measures what observers cost the robot: the time from a tick to its command while the demo drives in real time.
//!
//! There are four cases: no observer, the live view with a viewer of every topic, the bridge to ROS 2, and both.
//!
//! `cargo bench --bench observers` drives missions in which the cases take turns of a few seconds. Each case is the first in a
//! round as often as the others. `--features ros2` adds the bridge, and `-- --missions 6` measures for longer. The figures come
//! from the recording, so the measurement does not need a separate observer. The viewer and the readers run on the same machine, so
//! the figures are only meaningful if nothing else is running.

use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use nix::sys::signal::Signal;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sketchnav_recordings::Recording;
use sketchnav_runtime::{Node, SendTimes, System};
use sketchnav_schemas::channels::{self, LATENCY, TICK};
use sketchnav_schemas::codes::Process;
use support::viewer::{Viewer, view};
use support::{Place, Running};

/// Time for an observer to attach or detach, which is not measured.
const SETTLE: Duration = Duration::from_secs(2);
/// Duration of a turn.
const TURN: Duration = Duration::from_secs(8);
/// Number of turns of each case in a mission. The demo has no time for more.
const TURNS: usize = 4;
/// Default number of missions, which `--missions` overrides.
const MISSIONS: usize = 2;
/// Number of bootstrap samples for an interval.
const DRAWS: usize = 2000;
/// The system's name.
const SYSTEM: &str = "observed";

/// The observers that are attached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Attached {
    Nobody,
    View,
    Bridge,
    Both,
}

impl Attached {
    fn all() -> &'static [Self] {
        if cfg!(feature = "ros2") {
            return &[Self::Nobody, Self::View, Self::Bridge, Self::Both];
        }
        println!("without the bridge: built without the feature ros2");
        &[Self::Nobody, Self::View]
    }

    fn word(self) -> &'static str {
        match self {
            Self::Nobody => "nobody",
            Self::View => "the live view, watched",
            Self::Bridge => "the bridge to ROS 2",
            Self::Both => "both",
        }
    }
}

/// A turn of one case, and the ticks during it.
struct Turn {
    attached: Attached,
    ticks: std::ops::Range<u64>,
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    // `cargo test --benches` only checks that the benchmark starts.
    if arguments.iter().any(|argument| argument == "--test") {
        return;
    }
    let missions = arguments.iter().skip_while(|word| *word != "--missions").nth(1);
    let missions = missions.map_or(MISSIONS, |number| number.parse().expect("--missions: a number"));
    let place = Place::new();
    // SAFETY: no other thread runs yet.
    unsafe { std::env::set_var("XDG_RUNTIME_DIR", place.root().parent().expect("a folder above")) };
    let taken: Vec<_> = (0..missions).flat_map(|_| drive(&place)).collect();
    print(&taken);
}

/// Drives a mission in real time while observers come and go. Returns which observers were attached in each turn, and
/// the delays in that turn in milliseconds.
fn drive(place: &Place) -> Vec<(Attached, Vec<f64>)> {
    let mut running = place.start(&format!("run demo --speed 1 --json --out out --system {SYSTEM}"));
    place.wait_until_driving(&mut running, SYSTEM);
    let taken = take_turns(place);
    running.signal(Signal::SIGINT);
    let report = running.end().json();
    assert_eq!(report["lost_messages"], 0, "{report:#}");
    let delays = delays(Path::new(report["recording"].as_str().expect("the recording's path")));
    let of_turn = |turn: &Turn| {
        let inside = delays.iter().filter(|(tick, _)| turn.ticks.contains(tick));
        inside.map(|(_, ms)| *ms).collect()
    };
    taken.iter().map(|turn| (turn.attached, of_turn(turn))).collect()
}

/// Attaches the observers of each case in turn until the mission ends.
fn take_turns(place: &Place) -> Vec<Turn> {
    let (all, mut taken) = (Attached::all(), Vec::new());
    for turn in 0..TURNS {
        for place_in_turn in 0..all.len() {
            // Each case comes first as often as the others, so that an expensive part of the drive does not always hit
            // the same case.
            let attached = all[(turn + place_in_turn) % all.len()];
            if System::open(SYSTEM).is_err() {
                return taken;
            }
            let observers = attach(place, attached);
            // The mission runs in real time. This process only waits, so that it does not disturb the measurement.
            sleep(SETTLE);
            let begin = next_tick();
            sleep(TURN);
            let end = next_tick();
            drop(observers);
            sleep(SETTLE);
            let (Some(begin), Some(end)) = (begin, end) else { return taken };
            taken.push(Turn { attached, ticks: begin..end });
        }
    }
    taken
}

/// Returns the number of the next tick, or `None` if the mission has ended. The reader is closed immediately, because a system that
/// ends also ends its observers.
fn next_tick() -> Option<u64> {
    let node = Node::join(System::open(SYSTEM).ok()?, Process::Observer).ok()?;
    Some(SendTimes::open(&node, TICK.spec).ok()?.newest() + 1)
}

/// Attaches observers, which are ended when they are dropped.
fn attach(place: &Place, attached: Attached) -> Vec<Running> {
    sketchnav_navigators::register(&[]).expect("the navigators of this project");
    let mut observers = Vec::new();
    if matches!(attached, Attached::View | Attached::Both) {
        let (running, link) = view(place, SYSTEM);
        let kind = channels::of_kind("sketch").filter(|spec| spec.is_recorded());
        let topics = kind.map(|spec| 1 + sketchnav_navigators::derived(spec).count()).sum::<usize>() + 2;
        let mut viewer = Viewer::of_all(&link, topics);
        // The viewer ends with the view.
        std::thread::spawn(move || while viewer.try_next().is_some() {});
        observers.push(running);
    }
    if matches!(attached, Attached::Bridge | Attached::Both) {
        observers
            .push(place.start(&format!("bridge ros2 --system {SYSTEM} --domain 77 --interface 127.0.0.1")));
    }
    observers
}

/// Returns the number of each tick, and the time from that tick to its command in milliseconds.
fn delays(recording: &Path) -> Vec<(u64, f64)> {
    let latencies = Recording::open(recording).and_then(|recording| recording.all(LATENCY));
    let latencies = latencies.expect("a recording that can be read");
    let delay = |ns: u64| ns as f64 / 1e6;
    latencies.iter().map(|l| (l.header.source_seq, delay(l.situation_ns + l.command_ns))).collect()
}

fn print(taken: &[(Attached, Vec<f64>)]) {
    let of = |attached| -> Vec<Vec<f64>> {
        taken.iter().filter(|turn| turn.0 == attached).map(|turn| turn.1.clone()).collect()
    };
    let alone = of(Attached::Nobody);
    println!("from tick to command, ms; the interval of a ratio is of 95 %, by drawing whole turns");
    for &attached in Attached::all() {
        let turns = of(attached);
        let mut all = turns.concat();
        all.sort_by(f64::total_cmp);
        let (median, p99, most) = (rank(&all, 0.5), rank(&all, 0.99), rank(&all, 1.0));
        print!(
            "{:<24} {:5} ticks: {median:6.2} median {p99:6.2} (99 %) {most:6.2} most",
            attached.word(),
            all.len()
        );
        if attached == Attached::Nobody {
            println!();
        } else {
            let (ratio, low, high) = ratio(&turns, &alone);
            println!(", 99 %: {ratio:.2} times as long ({low:.2} to {high:.2})");
        }
    }
}

/// Returns the smallest of the sorted values that at least this share of the values does not exceed.
fn rank(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    sorted[((sorted.len() as f64 * share).ceil() as usize).clamp(1, last + 1) - 1]
}

/// Returns the ratio of the times of the slowest percent with and without observers, and an interval from bootstrapping the turns.
fn ratio(with: &[Vec<f64>], without: &[Vec<f64>]) -> (f64, f64, f64) {
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let p99 = |turns: Vec<&Vec<f64>>| {
        let mut all: Vec<f64> = turns.into_iter().flatten().copied().collect();
        all.sort_by(f64::total_cmp);
        rank(&all, 0.99)
    };
    let mut draw = |turns: &'_ [Vec<f64>]| -> f64 {
        let drawn: Vec<usize> = (0..turns.len()).map(|_| random.random_range(0..turns.len())).collect();
        p99(drawn.into_iter().map(|turn| &turns[turn]).collect())
    };
    let mut drawn: Vec<f64> = (0..DRAWS).map(|_| draw(with) / draw(without)).collect();
    drawn.sort_by(f64::total_cmp);
    let found = p99(with.iter().collect()) / p99(without.iter().collect());
    (found, rank(&drawn, 0.025), rank(&drawn, 0.975))
}

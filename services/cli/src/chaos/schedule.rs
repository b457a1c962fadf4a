//! Draws, reads and writes schedules of faults.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use rand::RngExt;
use sketchnav_recordings::faults::{FaultInfo, faults};
use sketchnav_recordings::{Recording, info};
use sketchnav_schemas::channels::{self, ChannelSpec};
use sketchnav_schemas::codes::{FaultKind, Process};
use sketchnav_schemas::fault_plan::{FaultPlan, PlannedFault};
use sketchnav_schemas::seed;
use sketchnav_sim::mission_file;

use super::Kill;
use crate::args::{ChaosOptions, KillSignal};
use crate::failure::{Failure, OrInput};
use crate::launch::fault_plan;
use crate::mission;

/// Fraction of a process's messages after which no more faults are planned for it, since it would have no work left by which to
/// tell that it has recovered.
const LAST_SHARE: f64 = 0.9;
/// Maximum number of faults of a process at one message. After a few more, the supervisor would give up on it.
const MOST_AT_ONE: usize = 3;
/// Range of the share of the processor that a starved process gets, in percent, and range of the duration, in milliseconds.
const SHARES_PERCENT: RangeInclusive<u32> = 2..=50;
const STARVATION_MS: RangeInclusive<u64> = 200..=2000;
/// The heading of a schedule that was recorded instead of planned.
const HAPPENED: &str = "# What happened, each fault at the first message at or after its time.\n";
const PLANNED: &str =
    "# Played by `sketchnav chaos MISSION --schedule FILE` and `sketchnav run MISSION --faults FILE`.\n";

/// Reads the schedule that the user specified, if any, before anything starts.
pub fn given(options: &ChaosOptions, mission: &Path) -> Result<Option<FaultPlan>, Failure> {
    let Some(path) = &options.schedule else { return Ok(None) };
    let mission = match mission::is_demo(mission) {
        true => mission::demo_mission().or_input()?,
        false => mission_file::load(mission).or_input()?.0,
    };
    let kind = mission.navigator_kind();
    Ok(Some(fault_plan(path, kind).or_input()?))
}

/// Draws a random schedule from the messages in the undisturbed recording `reference`. Returns `None` if processes should be killed
/// at random times instead.
pub fn drawn(options: &ChaosOptions, reference: &Path) -> Result<Option<FaultPlan>, Failure> {
    if !options.at_messages {
        return Ok(None);
    }
    let run = Recording::open(reference).and_then(|recording| recording.run());
    let run = run.context("the undisturbed recording")?;
    let kind = run.mission.navigator_kind();
    let info = info::info(reference).context("the undisturbed recording")?;
    let counts: BTreeMap<_, _> = info
        .topics
        .iter()
        .filter_map(|topic| Some((channels::of_topic(&topic.topic)?.name, topic.messages)))
        .collect();
    Ok(Some(draw(options, kind, &counts)?))
}

/// Draws as many faults as the options ask for, each before a message of one of the target processes.
fn draw(options: &ChaosOptions, kind: &str, counts: &BTreeMap<&str, u64>) -> anyhow::Result<FaultPlan> {
    let places: Vec<(&str, u64)> = options
        .targets
        .iter()
        .filter_map(|&process| {
            let spec = mouth(process, kind, |spec| counts.get(spec.name).is_some_and(|&count| count > 0))?;
            let count = counts.get(spec.name).copied().unwrap_or(0);
            Some((spec.name, ((count as f64 * LAST_SHARE) as u64).max(1)))
        })
        .collect();
    let room: u64 = places.iter().map(|(_, last)| last * MOST_AT_ONE as u64).sum();
    if room < u64::from(options.kills) {
        return Err(anyhow!(
            "--kills: expected at most {room} for messages of this mission, found {}",
            options.kills
        ));
    }
    let mut rng = seed::stream(options.seed, "chaos/messages");
    let mut plan: Vec<PlannedFault> = Vec::new();
    while plan.len() < options.kills as usize {
        let (channel, last) = places[rng.random_range(0..places.len())];
        let message = rng.random_range(1..=last);
        let kind = KillSignal::drawn(&options.signal, &mut rng);
        let mut fault = PlannedFault::at_message(channel, message, kind.action());
        if kind == KillSignal::Starve {
            fault.share = Some(f64::from(rng.random_range(SHARES_PERCENT)) / 100.0);
            fault.duration_ms = Some(rng.random_range(STARVATION_MS));
        }
        let is_there =
            |other: &&PlannedFault| (&other.channel, other.message) == (&fault.channel, fault.message);
        if plan.iter().filter(is_there).count() < MOST_AT_ONE {
            plan.push(fault);
        }
    }
    plan.sort_by_key(|fault| fault.message);
    Ok(FaultPlan { fault: plan })
}

/// Returns the channel whose messages trigger the faults of a process: that of its last message in an instant or, if
/// there is none, the last channel that it writes.
fn mouth(
    process: Process,
    kind: &str,
    speaks: impl Fn(&&'static ChannelSpec) -> bool,
) -> Option<&'static ChannelSpec> {
    channels::last_word_of(process, kind).or_else(|| {
        channels::written_by(process, kind).filter(|spec| spec.is_recorded()).filter(speaks).last()
    })
}

/// Writes a schedule to be applied.
pub fn write(path: &Path, plan: &FaultPlan) -> anyhow::Result<()> {
    write_with(path, PLANNED, plan)
}

fn write_with(path: &Path, heading: &str, plan: &FaultPlan) -> anyhow::Result<()> {
    let text = toml::to_string(plan).context("the schedule as TOML")?;
    sketchnav_files::write(path, format!("{heading}{text}")).with_context(|| path.display().to_string())
}

/// Writes the faults that happened in the run whose results are below `out`, according to its recording.
pub fn write_happened(path: &Path, out: &Path) -> anyhow::Result<()> {
    let mut plan = FaultPlan::default();
    if let Some(recording) = recording_below(out) {
        let run = Recording::open(&recording)
            .and_then(|recording| recording.run())
            .context("the disturbed recording")?;
        let happened = faults(&recording).context("the disturbed recording")?;
        plan.fault = happened.iter().filter_map(|fault| again(fault, run.mission.navigator_kind())).collect();
    }
    write_with(path, HAPPENED, &plan)
}

fn again(fault: &FaultInfo, kind: &str) -> Option<PlannedFault> {
    let is_named =
        |kind: &KillSignal| kind.signal().is_some_and(|signal| fault.words.contains(signal.as_str()));
    let sent = KillSignal::ALL.into_iter().find(is_named);
    let action = sent.filter(|_| fault.kind == FaultKind::Injected.word())?.action();
    let channel = mouth(fault.process.parse().ok()?, kind, |_| true)?.name;
    Some(PlannedFault {
        message: None,
        time_s: Some(fault.stamp_s),
        ..PlannedFault::at_message(channel, 1, action)
    })
}

/// Returns the first recording in the subfolders of `out`.
fn recording_below(out: &Path) -> Option<PathBuf> {
    let folders = std::fs::read_dir(out).ok()?.filter_map(|entry| Some(entry.ok()?.path()));
    let files = folders.filter_map(|folder| std::fs::read_dir(folder).ok()).flatten();
    let files = files.filter_map(|entry| Some(entry.ok()?.path()));
    files.filter(|path| path.extension().is_some_and(|extension| extension == "mcap")).min()
}

/// Returns the planned faults that happened, according to a recording, with the time that each recovery took.
pub fn kills(recording: &Path) -> anyhow::Result<Vec<Kill>> {
    let mut kills: Vec<Kill> = Vec::new();
    for fault in faults(recording).context("the disturbed recording")? {
        let Ok(process) = fault.process.parse() else { continue };
        if fault.kind == FaultKind::Injected.word() {
            // Of all injected faults, only starvation has a duration.
            kills.push(Kill { process, recovered_ms: None, is_starved: fault.duration_ms > 0.0 });
        } else if fault.kind == FaultKind::Recovered.word() {
            let open = kills.iter_mut().rev().find(|kill| kill.process == process && kill.is_open());
            open.into_iter().for_each(|kill| kill.recovered_ms = Some(fault.duration_ms));
        }
    }
    Ok(kills)
}

/// Adds to the error of a failed run how to repeat it: with `--schedule` and this file.
pub fn with_repetition(failure: Failure, schedule: &Path) -> Failure {
    let words = |error: anyhow::Error| anyhow!("{error:#}; repeat it with --schedule {}", schedule.display());
    match failure {
        Failure::Other(error) => Failure::Other(words(error)),
        failure => failure,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn draw(
        options: &ChaosOptions,
        kind: &str,
        counts: &BTreeMap<&'static str, u64>,
    ) -> anyhow::Result<FaultPlan> {
        sketchnav_navigators::register(&[]).unwrap();
        super::draw(options, kind, counts)
    }

    #[test]
    fn the_seed_determines_the_messages_before_which_processes_are_hit() {
        let counts = BTreeMap::from([
            ("tick", 1000),
            ("estimate", 1000),
            ("status", 1000),
            ("route", 1),
            ("latency", 1000),
        ]);
        let options = |seed: &str| ChaosOptions::of_words(&["--kills", "40", "--seed", seed]);
        let drawn = draw(&options("7"), "sketch", &counts).unwrap();
        assert_eq!(drawn, draw(&options("7"), "sketch", &counts).unwrap());
        assert_ne!(drawn, draw(&options("8"), "sketch", &counts).unwrap());
        assert_eq!(drawn.fault.len(), 40);
        assert!(drawn.fault.iter().all(|fault| fault.message.is_some_and(|message| message <= 900)));
        assert!(drawn.fault.iter().filter(|fault| fault.channel == "route").count() <= MOST_AT_ONE);
        let text = toml::to_string(&drawn).unwrap();
        assert_eq!(FaultPlan::parse(&text, "sketch").unwrap(), drawn);
    }

    #[test]
    fn faults_are_drawn_at_random_and_starvations_written_exactly() {
        let counts = BTreeMap::from([("tick", 1000), ("estimate", 1000), ("status", 1000)]);
        let options = ChaosOptions::of_words(&["--kills", "60", "--at-messages", "--signal", "kill,starve"]);
        let drawn = draw(&options, "sketch", &counts).unwrap();
        let starved = drawn.fault.iter().filter_map(PlannedFault::starvation).count();
        let killed = drawn.fault.iter().filter(|fault| fault.action == KillSignal::Kill.action()).count();
        assert_eq!(starved + killed, 60);
        assert!(starved > 10 && killed > 10, "{starved} starvations, {killed} kills");
        let text = toml::to_string(&drawn).unwrap();
        assert_eq!(FaultPlan::parse(&text, "sketch").unwrap(), drawn);
    }

    #[test]
    fn more_kills_than_messages_are_refused() {
        let options = ChaosOptions::of_words(&["--kills", "4", "--targets", "sketcher"]);
        let error = draw(&options, "sketch", &BTreeMap::from([("route", 1)])).unwrap_err().to_string();
        assert!(error.contains("--kills: expected at most 3"), "{error}");
    }
}

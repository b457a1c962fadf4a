//! Determines which parts of a recording to play, and into which channels, before anything is started.

use std::collections::BTreeMap;
use std::ops::Range;

use anyhow::{Context, ensure};
use sketchnav_recordings::Recording;
use sketchnav_recordings::reader::Selection;
use sketchnav_recordings::writer::topic_name;
use sketchnav_schemas::channels::{self, ChannelSpec, FAULTS, MISSION};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::time::seconds;
use sketchnav_supervisor::Ceded;

use crate::recordings::args::ReplayOptions;

/// The parts of a recording to play.
pub struct Plan {
    /// For each channel, the topic of the recording that is played into it.
    topics: BTreeMap<&'static str, String>,
    /// The period, in nanoseconds, which contains at least one message.
    pub times_ns: Range<u64>,
    /// The supervisor's own channels that it cedes to the recording.
    pub ceded: Ceded,
}

/// Returns the process in whose name a channel is played.
pub fn speaker(channel: &ChannelSpec) -> Process {
    channel.writer.unwrap_or(Process::World)
}

impl Plan {
    /// Decides what to play.
    ///
    /// # Errors
    /// If a channel or a topic is unknown, or the period contains no message.
    pub fn new(recording: &Recording, options: &ReplayOptions) -> anyhow::Result<Self> {
        let (first_ns, last_ns) = recording.index()?.span_ns().context("the recording has no message")?;
        let asked = options.times.ns()?;
        let run = recording.run()?;
        let topics = topics(options, run.mission.navigator_kind())?;
        let known: Vec<_> = recording.topics()?.iter().map(|topic| topic.name.clone()).collect();
        let remapped = options.remap.iter().map(|(from, _)| from.clone());
        let named = options.topics.iter().filter_map(|name| topics.get(plain(name)).cloned());
        for topic in remapped.chain(named) {
            ensure!(known.contains(&topic), "topic {topic}: expected one of {}", known.join(", "));
        }
        if let Some(start) = options.times.start {
            ensure!(asked.start <= last_ns, "--start {start}: expected at most {} s", seconds(last_ns));
        }
        if let Some(end) = options.times.end {
            ensure!(asked.end > first_ns, "--end {end}: expected more than {} s", seconds(first_ns));
        }
        // The given period is limited to that of the recording.
        let times_ns = asked.start.max(first_ns)..asked.end.min(last_ns.saturating_add(1));
        let mut plan = Self { topics, times_ns, ceded: Ceded::default() };
        let is_there = |times: &Range<u64>| !times.is_empty() && plan.has_message(recording, times.clone());
        ensure!(
            is_there(&plan.times_ns),
            "nothing to play: expected messages of the played topics from {} to {} s, found none",
            seconds(plan.times_ns.start),
            seconds(plan.times_ns.end.min(last_ns)),
        );
        // If the recording has no orders, this system's own supervisor gives them to a live planner. No other process
        // needs orders.
        let has_orders = plan.topic_of(MISSION.spec).is_some_and(|topic| has_message_of(recording, topic));
        plan.ceded.mission = has_orders || !options.live.contains(&Process::Planner);
        plan.ceded.faults = options.live.is_empty();
        if !has_orders {
            plan.topics.remove(MISSION.spec.name);
        }
        Ok(plan)
    }

    /// Returns the topic of the recording that is played into a channel, if there is one.
    pub fn topic_of(&self, channel: &ChannelSpec) -> Option<&str> {
        self.topics.get(channel.name).map(String::as_str)
    }

    /// Returns the selection of all messages to play, without the limits of the period.
    pub fn selection(&self) -> Selection {
        Selection::of_topics(self.topics.values().cloned())
    }

    /// Returns true if there is a message to play. A damaged message counts, since the player reports it.
    fn has_message(&self, recording: &Recording, times_ns: Range<u64>) -> bool {
        let selected = recording.select(self.selection().between(times_ns));
        selected.is_ok_and(|mut messages| messages.next().is_some())
    }
}

fn has_message_of(recording: &Recording, topic: &str) -> bool {
    recording.select(Selection::of_topics([topic])).is_ok_and(|mut messages| messages.next().is_some())
}

fn plain(topic: &str) -> &str {
    topic.trim_start_matches('/')
}

/// Returns the topic to play into each channel. The channels are those of the processes that are not live or, with
/// `--topics`, the ones among them that the user named. The topic is the channel's own or the one remapped to it.
fn topics(options: &ReplayOptions, kind: &str) -> anyhow::Result<BTreeMap<&'static str, String>> {
    // This system's supervisor reports the faults of live processes itself.
    let is_faults = |spec: &ChannelSpec| spec.name == FAULTS.spec.name && !options.live.is_empty();
    let is_played = |spec: &&ChannelSpec| {
        spec.is_recorded() && !options.live.contains(&speaker(spec)) && !is_faults(spec)
    };
    let played: Vec<&'static ChannelSpec> = channels::of_kind(kind).filter(is_played).collect();
    let names = played.iter().map(|spec| spec.name).collect::<Vec<_>>();
    let targets = options.remap.iter().map(|(_, to)| ("--remap", plain(to)));
    for (option, name) in options.topics.iter().map(|name| ("--topics", plain(name))).chain(targets) {
        ensure!(names.contains(&name), "{option} {name}: expected one of {}", names.join(", "));
    }
    let is_wanted = |spec: &&'static ChannelSpec| {
        options.topics.is_empty() || options.topics.iter().any(|topic| plain(topic) == spec.name)
    };
    let source = |spec: &'static ChannelSpec| {
        let own = topic_name(spec.name);
        let remapped = options.remap.iter().find(|(_, to)| *to == own).map(|(from, _)| from.clone());
        let is_taken = options.remap.iter().any(|(from, to)| *from == own && *to != own);
        Some((spec.name, remapped.or((!is_taken).then_some(own))?))
    };
    Ok(played.into_iter().filter(is_wanted).filter_map(source).collect())
}

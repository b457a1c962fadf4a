//! Measures rates, bandwidth and delays of channels.
//!
//! The time of a message is when its writer sent it, by the clock that all processes share. An observer only checks for messages
//! every two milliseconds, so the times when it sees them would be too coarse for intervals. The delay of a message is the time
//! since the tick that caused it.

use std::collections::{BTreeMap, VecDeque};
use std::time::Instant;

use serde::Serialize;
use sketchnav_recordings::Recording;
use sketchnav_recordings::reader::Selection;
use sketchnav_runtime::{Node, RawSample, SendTimes};
use sketchnav_schemas::channels::{ChannelSpec, TICK};

use super::{Amount, Listener, follow};
use crate::args::HzOptions;
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::live;
use crate::recordings::whole::Whole;
use crate::recordings::with;

/// Number of the most recent intervals and delays that are used for percentiles.
const KEPT: usize = 10_000;

/// Prints the rates once a second, and totals at the end.
pub fn hz(options: &HzOptions) -> Result<Outcome, Failure> {
    if let Some(file) = &options.file {
        return with(file, |whole| of_recording(whole, options));
    }
    let mut rates = Rates { json: options.json, ticks: None, all: Vec::new() };
    let outcome = follow(&options.tap, Amount::of(options.tap.count), &mut rates)?;
    rates.all.iter().try_for_each(|rate| rate.print("in all", options.json))?;
    Ok(outcome)
}

/// Prints the rates of a recording's topics, from the times when their messages were recorded.
fn of_recording(whole: &Whole, options: &HzOptions) -> Result<Outcome, Failure> {
    let recording = Recording::open(whole.path()).or_input()?;
    let topics = super::recorded(&recording, &options.tap)?;
    let mut all: BTreeMap<_, _> = topics.iter().map(|topic| (topic.clone(), Recorded::default())).collect();
    let messages = recording.timeline(Selection::of_topics(topics)).or_input()?;
    for raw in messages
        .take(options.tap.count.map_or(usize::MAX, |count| usize::try_from(count).unwrap_or(usize::MAX)))
    {
        let raw = raw.or_input()?;
        if let Some(recorded) = all.get_mut(&raw.topic.name) {
            recorded.receive(raw.stamp_ns, raw.cdr.len() as u64);
        }
    }
    for (topic, recorded) in &all {
        print("recorded", &recorded.figures(topic.trim_start_matches('/')), options.json)?;
    }
    Ok(Outcome::Success)
}

/// The messages of a recorded topic.
#[derive(Default)]
struct Recorded {
    times_ns: Option<(u64, u64)>,
    count: u64,
    bytes: u64,
    intervals_ns: Recent,
}

impl Recorded {
    fn receive(&mut self, ns: u64, bytes: u64) {
        self.intervals_ns.extend(self.times_ns.map(|(_, last)| ns - last));
        self.times_ns = Some((self.times_ns.map_or(ns, |(first, _)| first), ns));
        self.count += 1;
        self.bytes += bytes;
    }

    fn figures(&self, channel: &str) -> Figures {
        let span_s =
            self.times_ns.map(|(first, last)| (last - first) as f64 / 1e9).filter(|span_s| *span_s > 0.0);
        let per = |count: u64| span_s.map(|span_s| count as f64 / span_s);
        // The first message arrived before the measured period began.
        let share = self.count.saturating_sub(1) as f64 / self.count.max(1) as f64;
        Figures {
            channel: channel.to_owned(),
            messages: self.count,
            missed: 0,
            rate_hz: per(self.count.saturating_sub(1)),
            simulated_rate_hz: None,
            bytes_per_second: per(self.bytes).map(|rate| rate * share),
            interval_ms: self.intervals_ns.percentiles(),
            delay_ms: None,
        }
    }
}

struct Rates {
    json: bool,
    ticks: Option<SendTimes>,
    all: Vec<Rate>,
}

impl Listener for Rates {
    /// The whole history is handed over at the same time, so its messages do not reflect the rate.
    const HISTORY: bool = false;

    fn begin(&mut self, node: &Node, specs: &[&'static ChannelSpec]) -> Result<(), Failure> {
        let open = |spec| SendTimes::open(node, spec).map_err(anyhow::Error::from);
        self.ticks = Some(open(TICK.spec)?);
        for &spec in specs {
            // A channel with several writers stores no send times.
            let sent = spec.writer.is_some().then(|| open(spec)).transpose()?;
            self.all.push(Rate::new(spec, sent));
        }
        Ok(())
    }

    fn receive(&mut self, spec: &'static ChannelSpec, sample: &RawSample) -> Result<(), Failure> {
        if let Some(rate) = self.all.iter_mut().find(|rate| rate.spec == spec) {
            rate.receive(sample, self.ticks.as_ref());
        }
        Ok(())
    }

    fn tick(&mut self, spec: &'static ChannelSpec, lost: u64) -> Result<(), Failure> {
        if let Some(rate) = self.all.iter_mut().find(|rate| rate.spec == spec) {
            rate.lost = lost;
            rate.print("so far", self.json)?;
        }
        Ok(())
    }
}

/// The messages of a channel, by the wall clock and in simulation time.
struct Rate {
    spec: &'static ChannelSpec,
    sent: Option<SendTimes>,
    first: Option<(Instant, u64)>,
    last: Option<(Instant, u64)>,
    sent_at_ns: Option<u64>,
    count: u64,
    bytes: u64,
    lost: u64,
    intervals_ns: Recent,
    delays_ns: Recent,
}

impl Rate {
    fn new(spec: &'static ChannelSpec, sent: Option<SendTimes>) -> Self {
        let (intervals_ns, delays_ns) = (Recent::default(), Recent::default());
        let (first, last, sent_at_ns) = (None, None, None);
        Self { spec, sent, first, last, sent_at_ns, count: 0, bytes: 0, lost: 0, intervals_ns, delays_ns }
    }

    fn receive(&mut self, sample: &RawSample, ticks: Option<&SendTimes>) {
        let header = sample.header();
        let now = (Instant::now(), header.stamp_ns);
        self.first.get_or_insert(now);
        self.last = Some(now);
        self.count += 1;
        self.bytes += (sample.message().len() + sample.cells().len()) as u64;
        let Some(at_ns) = self.sent.as_ref().and_then(|sent| sent.of(header.seq)).map(|sent| sent.at_ns)
        else {
            self.sent_at_ns = None;
            return;
        };
        let before = self.sent_at_ns.replace(at_ns);
        self.intervals_ns.extend(before.and_then(|before| at_ns.checked_sub(before)));
        let is_answer = !self.spec.is_sensed() && self.spec != TICK.spec && header.source_seq > 0;
        let caused = ticks.filter(|_| is_answer).and_then(|ticks| ticks.of(header.source_seq));
        self.delays_ns.extend(caused.and_then(|tick| at_ns.checked_sub(tick.at_ns)));
    }

    fn figures(&self) -> Figures {
        let intervals = self.count.saturating_sub(1) as f64;
        let span = self.first.zip(self.last);
        let per = |seconds: f64| (intervals > 0.0).then(|| intervals / seconds.max(1e-9));
        let wall_s = span.map(|((first, _), (last, _))| (last - first).as_secs_f64());
        let simulated_s = span.map(|((_, first), (_, last))| last.saturating_sub(first) as f64 / 1e9);
        let share = intervals / (self.count.max(1)) as f64;
        Figures {
            channel: self.spec.name.to_owned(),
            messages: self.count,
            missed: self.lost,
            rate_hz: wall_s.and_then(per),
            simulated_rate_hz: simulated_s.filter(|seconds| *seconds > 0.0).and_then(per),
            // The first message, and its bytes, arrived before the measured period began.
            bytes_per_second: wall_s.and_then(|s| per(s).map(|_| self.bytes as f64 * share / s.max(1e-9))),
            interval_ms: self.intervals_ns.percentiles(),
            delay_ms: self.delays_ns.percentiles(),
        }
    }

    fn print(&self, when: &str, json: bool) -> anyhow::Result<()> {
        print(when, &self.figures(), json)
    }
}

fn print(when: &str, figures: &Figures, json: bool) -> anyhow::Result<()> {
    if json {
        return live!("{}", serde_json::to_string(figures)?);
    }
    format!("{when}: {}", figures.words()).lines().try_for_each(|line| live!("{line}"))
}

/// The figures of a channel, printed as they are by `--json`.
#[derive(Debug, Serialize)]
struct Figures {
    channel: String,
    messages: u64,
    missed: u64,
    rate_hz: Option<f64>,
    simulated_rate_hz: Option<f64>,
    bytes_per_second: Option<f64>,
    interval_ms: Option<Percentiles>,
    delay_ms: Option<Percentiles>,
}

impl Figures {
    fn words(&self) -> String {
        let Self { channel, messages, missed, .. } = self;
        let (Some(rate), Some(bytes)) = (self.rate_hz, self.bytes_per_second) else {
            return match messages {
                0 => format!("{channel}: no message"),
                1 => format!("{channel}: 1 message"),
                _ => format!("{channel}: {messages} messages, all at the same time"),
            };
        };
        let simulated = self.simulated_rate_hz.map(|rate| format!(", {rate:.2} per simulated second"));
        let simulated = simulated.unwrap_or_default();
        let band = format!("{:.1} kB/s; {messages} seen, {missed} missed", bytes / 1e3);
        let mut words = format!("{channel}: {rate:.1} messages per second{simulated}; {band}");
        for (what, times) in [("interval", &self.interval_ms), ("delay from the tick", &self.delay_ms)] {
            if let Some(Percentiles { p50, p90, p99, max }) = times {
                words += &format!(
                    "\n  {what}: {p50:.2} ms (median), {p90:.2} (90 %), {p99:.2} (99 %), {max:.2} (max)"
                );
            }
        }
        words
    }
}

#[derive(Debug, PartialEq, Serialize)]
struct Percentiles {
    p50: f64,
    p90: f64,
    p99: f64,
    max: f64,
}

/// The most recent durations, in nanoseconds.
#[derive(Default)]
struct Recent(VecDeque<u64>);

impl Recent {
    fn extend(&mut self, time_ns: Option<u64>) {
        let Some(time_ns) = time_ns else { return };
        if self.0.len() == KEPT {
            self.0.pop_front();
        }
        self.0.push_back(time_ns);
    }

    /// Returns percentiles in milliseconds, by the nearest-rank method, or `None` if there are no durations.
    fn percentiles(&self) -> Option<Percentiles> {
        let mut times: Vec<_> = self.0.iter().copied().collect();
        times.sort_unstable();
        let last = times.len().checked_sub(1)?;
        let at = |share: f64| {
            times[((times.len() as f64 * share).ceil() as usize).clamp(1, last + 1) - 1] as f64 / 1e6
        };
        Some(Percentiles { p50: at(0.5), p90: at(0.9), p99: at(0.99), max: at(1.0) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_those_of_the_nearest_rank() {
        let mut recent = Recent::default();
        assert_eq!(recent.percentiles(), None);
        (1..=100).rev().for_each(|ms| recent.extend(Some(ms * 1_000_000)));
        recent.extend(None);
        let expected = Percentiles { p50: 50.0, p90: 90.0, p99: 99.0, max: 100.0 };
        assert_eq!(recent.percentiles(), Some(expected));
    }

    #[test]
    fn rates_of_a_recording_use_its_times() {
        let mut recorded = Recorded::default();
        (0..21).for_each(|n| recorded.receive(5_000_000_000 + n * 100_000_000, 40));
        let figures = recorded.figures("odom");
        assert_eq!((figures.rate_hz, figures.messages), (Some(10.0), 21));
        assert_eq!(figures.bytes_per_second, Some(400.0));
        assert_eq!(figures.interval_ms.map(|interval| interval.p50), Some(100.0));
        let mut at_once = Recorded::default();
        (0..2).for_each(|_| at_once.receive(7, 1));
        assert_eq!(at_once.figures("odom").words(), "odom: 2 messages, all at the same time");
        assert_eq!(Recorded::default().figures("odom").words(), "odom: no message");
    }

    #[test]
    fn old_times_go() {
        let mut recent = Recent::default();
        (0..KEPT as u64 + 5).for_each(|ns| recent.extend(Some(ns)));
        assert_eq!((recent.0.len(), recent.0[0]), (KEPT, 5));
    }
}

//! Metrics of the processes and channels for Prometheus at `/metrics`, in its text format (version 0.0.4).
//!
//! The text is generated on request from existing data, without any additional measurement. Rates are left to Prometheus, as in
//! `rate()` of a counter.

use std::collections::BTreeMap;
use std::fmt::Write;

use sketchnav_runtime::{Node, SendTimes};
use sketchnav_schemas::channels::{self, ChannelSpec};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::message::Health;

use crate::feed::ServiceView;

/// The content type of the text.
pub const CONTENT_TYPE: &str = "text/plain; version=0.0.4; charset=utf-8";

/// The figures of a system.
pub struct Metrics {
    channels: Vec<(&'static ChannelSpec, SendTimes)>,
    health: BTreeMap<u32, Health>,
}

/// A figure of a process: its name without the prefix, whether it is a counter, its description, and its value.
type Figure = (&'static str, bool, &'static str, fn(&Health) -> f64);

const FIGURES: [Figure; 7] = [
    ("steps_total", true, "Steps done since the process started.", |health| health.steps as f64),
    ("busy_seconds_total", true, "Time inside steps.", |health| health.busy_ns as f64 * 1e-9),
    ("step_seconds_max", false, "Longest step of the last second.", |health| {
        health.step_max_ns as f64 * 1e-9
    }),
    ("step_allocations_total", true, "Heap allocations inside steps.", |health| {
        health.step_allocations as f64
    }),
    ("lost_messages_total", true, "Messages that were missing on its inputs.", |health| {
        health.lost_messages as f64
    }),
    ("refused_messages_total", true, "Messages that were refused as malformed.", |health| {
        health.refused_messages as f64
    }),
    ("uptime_seconds", false, "Time since the process started.", |health| health.uptime_ns as f64 * 1e-9),
];

impl Metrics {
    /// Creates the metrics for runs of this kind of navigator.
    ///
    /// # Errors
    /// If a channel cannot be inspected.
    pub fn open(node: &Node, kind: &str) -> anyhow::Result<Self> {
        let of_one_writer = channels::of_kind(kind).filter(|spec| spec.writer.is_some());
        let open = |spec| Ok((spec, SendTimes::open(node, spec)?));
        let channels = of_one_writer.map(open).collect::<anyhow::Result<_>>()?;
        Ok(Self { channels, health: BTreeMap::new() })
    }

    /// Processes a health report.
    pub fn on_health(&mut self, health: &Health) {
        self.health.insert(health.process, *health);
    }

    /// Returns the text. `services` lists which processes are up and how often they were restarted, and `stamp_ns` is the
    /// simulation time.
    pub fn text(&self, services: &[ServiceView], stamp_ns: u64) -> String {
        let sent = self.channels.iter().map(|(spec, times)| (spec.name, times.newest()));
        render(&self.health, services, &sent.collect::<Vec<_>>(), stamp_ns)
    }
}

fn render(
    health: &BTreeMap<u32, Health>,
    services: &[ServiceView],
    sent: &[(&'static str, u64)],
    stamp_ns: u64,
) -> String {
    let mut text = String::new();
    let time = [(String::new(), stamp_ns as f64 * 1e-9)];
    family(&mut text, "simulation_seconds", false, "Simulation time of the mission.", time);
    let label = |name: &str| format!("{{process=\"{name}\"}}");
    let up = services.iter().map(|service| (label(service.name), f64::from(u8::from(service.up))));
    family(&mut text, "process_up", false, "1 if the process is up, 0 if not.", up);
    let restarts = services.iter().map(|service| (label(service.name), f64::from(service.restarts)));
    family(&mut text, "process_restarts_total", true, "How often the process was restarted.", restarts);
    let known = || health.values().filter_map(|health| Some((Process::from_code(health.process)?, health)));
    for (name, grows, meaning, value) in FIGURES {
        let samples = known().map(|(process, health)| (label(process.word()), value(health)));
        family(&mut text, &format!("process_{name}"), grows, meaning, samples);
    }
    let sent = sent.iter().map(|(name, count)| (format!("{{channel=\"{name}\"}}"), *count as f64));
    family(&mut text, "channel_messages_total", true, "Messages sent on the channel.", sent);
    text
}

/// A family of samples with their labels; omitted if there are none.
fn family(
    text: &mut String,
    name: &str,
    grows: bool,
    meaning: &str,
    samples: impl IntoIterator<Item = (String, f64)>,
) {
    let mut samples = samples.into_iter().peekable();
    if samples.peek().is_none() {
        return;
    }
    let kind = if grows { "counter" } else { "gauge" };
    let _ = writeln!(text, "# HELP sketchnav_{name} {meaning}\n# TYPE sketchnav_{name} {kind}");
    for (labels, value) in samples {
        let _ = writeln!(text, "sketchnav_{name}{labels} {value}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    fn text() -> String {
        let localizer = Process::Localizer.code();
        let health = Health { process: localizer, steps: 12, busy_ns: 1_500_000_000, ..Health::zeroed() };
        let unknown = Health { process: 9999, ..Health::zeroed() };
        let services = [ServiceView { name: "localizer", up: false, restarts: 2 }];
        render(
            &BTreeMap::from([(localizer, health), (9999, unknown)]),
            &services,
            &[("scan", 77)],
            2_500_000_000,
        )
    }

    #[test]
    fn figures_of_processes_and_channels_are_told() {
        let text = text();
        for line in [
            "sketchnav_simulation_seconds 2.5",
            "sketchnav_process_up{process=\"localizer\"} 0",
            "sketchnav_process_restarts_total{process=\"localizer\"} 2",
            "sketchnav_process_steps_total{process=\"localizer\"} 12",
            "sketchnav_process_busy_seconds_total{process=\"localizer\"} 1.5",
            "sketchnav_channel_messages_total{channel=\"scan\"} 77",
        ] {
            assert!(text.lines().any(|found| found == line), "{line}: {text}");
        }
    }

    /// The format requires HELP and TYPE once, before the samples of their family, and
    /// `_total` at the end of a counter's name.
    #[test]
    fn each_family_is_declared_once_before_its_samples() {
        let text = text();
        let mut declared = Vec::new();
        for line in text.lines() {
            if let Some(rest) = line.strip_prefix("# TYPE ") {
                let (name, kind) = rest.split_once(' ').unwrap();
                assert!(!declared.contains(&name), "{name}");
                assert_eq!(kind == "counter", name.ends_with("_total"), "{line}");
                declared.push(name);
            } else if !line.starts_with('#') {
                let name = line.split(['{', ' ']).next().unwrap();
                assert_eq!(declared.last(), Some(&name), "{line}");
            }
        }
        assert_eq!(declared.len(), 11);
    }
}

//! Shows the pipeline: every channel with its message, its writer and its readers, in the order of an
//! instant. For a running system, also shows the connected processes, the number of messages in each history,
//! and the rates.

use anyhow::Context;
use comfy_table::{Table, presets::UTF8_FULL_CONDENSED};
use serde::Serialize;
use sketchnav_schemas::channels::{self, ChannelSpec};
use sketchnav_schemas::codes::Process;

use crate::failure::{Failure, Outcome};
use crate::live::{self, Connected, Figures};
use crate::output::{self, out};
use crate::systems;

#[derive(Serialize)]
struct Row {
    channel: &'static str,
    /// The ROS 2 type under which the message is recorded.
    message: &'static str,
    ros2: &'static str,
    /// The process that writes the channel, or `None` if all processes do.
    writer: Option<&'static str>,
    readers: Vec<&'static str>,
    /// The kind of navigator that has the channel, or `None` if all kinds do.
    kind: Option<&'static str>,
    /// The number of messages that a reader receives when it connects late.
    history: usize,
    latched: bool,
    recorded: bool,
}

impl Row {
    fn of(spec: &'static ChannelSpec) -> Self {
        Self {
            channel: spec.name,
            message: spec.message.name,
            ros2: spec.message.ros2,
            writer: spec.writer.map(Process::word),
            readers: spec.readers.iter().map(|process| process.word()).collect(),
            kind: spec.kind,
            history: spec.history(),
            latched: spec.is_latched(),
            recorded: spec.is_recorded(),
        }
    }
}

/// Prints the channels of a running system with their connected processes and rates.
pub fn show_live(system: &str, json: bool) -> Result<Outcome, Failure> {
    let (_, figures) = live::measure(systems::find(Some(system))?)?;
    if json {
        out!("{}", serde_json::to_string(&figures).context("the table as JSON")?)?;
    } else {
        output::lines(live_table(&figures))?;
    }
    Ok(Outcome::Success)
}

fn live_table(all: &[Figures]) -> Table {
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED);
    table.set_header(["channel", "rate", "kB/s", "sent", "kept", "writers", "readers"]);
    for figures in all {
        let count = |count: Option<u64>| count.map_or("–".to_owned(), |count| count.to_string());
        table.add_row([
            figures.channel.to_owned(),
            format!("{:.1} Hz", figures.rate_hz),
            format!("{:.1}", figures.bytes_per_second / 1e3),
            count(figures.sent),
            count(figures.kept),
            names(&figures.writers),
            names(&figures.readers),
        ]);
    }
    table
}

fn names(all: &[Connected]) -> String {
    all.iter().map(|connected| connected.process.as_str()).collect::<Vec<_>>().join(", ")
}

/// Rejects an unknown kind of navigator.
pub fn check_kind(kind: Option<&str>) -> Result<(), Failure> {
    let known = || channels::all().filter_map(|spec| spec.kind);
    let unknown = kind.filter(|kind| known().all(|known| known != *kind));
    if let Some(kind) = unknown {
        let mut known: Vec<_> = known().collect();
        known.sort_unstable();
        known.dedup();
        let known = known.join(", ");
        return Err(Failure::Input(anyhow::anyhow!("--kind: expected one of {known}, found {kind:?}")));
    }
    Ok(())
}

/// Prints the channels of a kind of navigator, or of all kinds.
pub fn show(kind: Option<&str>, json: bool) -> Result<Outcome, Failure> {
    check_kind(kind)?;
    let of_kind = |spec: &&'static ChannelSpec| kind.is_none_or(|kind| spec.belongs_to(kind));
    let rows: Vec<_> = channels::all().filter(of_kind).map(Row::of).collect();
    if json {
        out!("{}", serde_json::to_string(&rows).context("the table as JSON")?)?;
    } else {
        output::lines(table(&rows))?;
    }
    Ok(Outcome::Success)
}

fn table(rows: &[Row]) -> Table {
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED);
    table.set_header(["channel", "ROS 2 message", "writer", "readers", "kind", "history"]);
    for row in rows {
        let history = if row.latched { "latched".to_owned() } else { row.history.to_string() };
        table.add_row([
            row.channel.to_owned(),
            row.ros2.replace("/msg/", "/"),
            row.writer.unwrap_or("every process").to_owned(),
            row.readers.join(", "),
            row.kind.unwrap_or("all").to_owned(),
            history,
        ]);
    }
    table
}

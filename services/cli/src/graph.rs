//! Draws the pipeline with a lane per process and a row per channel, in the order of an instant.

use std::fmt::Write;
use std::path::Path;

use anyhow::Context;
use sketchnav_lab::picture::escape;
use sketchnav_runtime::System;
use sketchnav_schemas::channels::{self, ChannelSpec, EXTRAS, Role, SERVICES};
use sketchnav_schemas::codes::Process;

use crate::args::GraphOptions;
use crate::failure::{Failure, OrInput, Outcome};
use crate::live::{self, Figures};
use crate::output::{out, say};
use crate::{channels as table, systems};

const LANE_PX: f64 = 118.0;
const ROW_PX: f64 = 30.0;
/// Space to the left of the lanes for the names and types of the channels.
const LEFT_PX: f64 = 292.0;
/// Space to the right of the lanes for the figures.
const RIGHT_PX: f64 = 170.0;
/// Width of the column for the bandwidth, which is part of `RIGHT_PX`.
const BAND_PX: f64 = 76.0;
const TOP_PX: f64 = 104.0;
const FONT: &str = "font-family=\"Helvetica, Arial, sans-serif\"";
const INK: &str = "#20242c";
const FAINT: &str = "#6b7280";
const LINE: &str = "#d9dde4";
const SENT: &str = "#1d4ed8";
const QUIET: &str = "#9aa3b2";

/// Draws the channels of a kind of navigator, or of a running system with their rates.
pub fn graph(options: &GraphOptions) -> Result<Outcome, Failure> {
    table::check_kind(options.kind.as_deref())?;
    let system = options.system.as_deref().map(|name| systems::find(Some(name))).transpose()?;
    let live = system.map(measured).transpose()?;
    let kind = live.as_ref().map(|live| live.kind.as_str()).or(options.kind.as_deref());
    let specs: Vec<_> =
        channels::all().filter(|spec| kind.is_none_or(|kind| spec.belongs_to(kind))).collect();
    let svg = draw(&specs, kind, live.as_ref());
    write(&options.output, &svg).or_input()?;
    if options.json {
        let (system, figures) =
            (live.as_ref().map(|live| &live.system), live.as_ref().map(|live| &live.figures));
        let names: Vec<_> = specs.iter().map(|spec| spec.name).collect();
        let object = serde_json::json!({
            "output": options.output, "kind": kind, "channels": names, "system": system, "figures": figures,
        });
        out!("{object}")?;
    } else {
        say!("picture    {}", options.output.display());
    }
    Ok(Outcome::Success)
}

fn write(path: &Path, svg: &str) -> anyhow::Result<()> {
    sketchnav_files::write(path, svg).with_context(|| format!("--output {}", path.display()))
}

/// A running system and the figures of its channels.
struct Live {
    system: String,
    kind: String,
    figures: Vec<Figures>,
}

fn measured(system: System) -> Result<Live, Failure> {
    let name = system.name().to_owned();
    let (kind, figures) = live::measure(system)?;
    Ok(Live { system: name, kind, figures })
}

/// Returns the processes in their order within an instant.
fn lanes() -> Vec<Process> {
    let [world, sketcher, localizer, planner, recorder] = SERVICES;
    let [pad] = EXTRAS;
    vec![pad, Process::Supervisor, sketcher, world, localizer, planner, recorder]
}

fn draw(specs: &[&'static ChannelSpec], kind: Option<&str>, live: Option<&Live>) -> String {
    let lanes = lanes();
    let bottom = TOP_PX + ROW_PX * specs.len() as f64;
    let width = LEFT_PX + LANE_PX * lanes.len() as f64 + if live.is_some() { RIGHT_PX } else { 24.0 };
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {:.0}\" width=\"{width:.0}\" {FONT}>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n",
        bottom + 44.0
    );
    text(&mut svg, [24.0, 36.0], 20.0, "start", INK, &title(kind, live));
    let legend = "a row is a channel, in the order of an instant: ● writes, → reads, ○ records";
    text(&mut svg, [24.0, 58.0], 12.5, "start", FAINT, legend);
    for (i, process) in lanes.iter().enumerate() {
        lane(&mut svg, lane_x(i), bottom, process.word());
    }
    for (i, spec) in specs.iter().enumerate() {
        let figures = live.and_then(|live| live.figures.iter().find(|figures| figures.channel == spec.name));
        row(&mut svg, TOP_PX + ROW_PX * (i as f64 + 0.5), spec, &lanes, figures, live.is_some());
    }
    if live.is_some() {
        text(&mut svg, [width - 24.0 - BAND_PX, TOP_PX - 16.0], 12.5, "end", FAINT, "Hz");
        text(&mut svg, [width - 24.0, TOP_PX - 16.0], 12.5, "end", FAINT, "kB/s");
    }
    svg.push_str("</svg>\n");
    svg
}

fn title(kind: Option<&str>, live: Option<&Live>) -> String {
    match (live, kind) {
        (Some(live), _) => format!("{}: navigator {}", live.system, live.kind),
        (None, Some(kind)) => format!("the pipeline of navigator {kind}"),
        (None, None) => "the pipeline, all kinds of navigators".to_owned(),
    }
}

fn lane_x(lane: usize) -> f64 {
    LEFT_PX + LANE_PX * (lane as f64 + 0.5)
}

fn lane(svg: &mut String, x: f64, bottom: f64, word: &str) {
    let top = TOP_PX - 34.0;
    let _ = writeln!(
        svg,
        "<line x1=\"{x}\" y1=\"{TOP_PX}\" x2=\"{x}\" y2=\"{bottom}\" stroke=\"{LINE}\"/>\n\
         <rect x=\"{:.1}\" y=\"{top}\" width=\"100\" height=\"26\" rx=\"5\" fill=\"#eef2ff\" stroke=\"#c7d2fe\"/>",
        x - 50.0
    );
    text(svg, [x, top + 18.0], 13.5, "middle", INK, word);
}

/// Draws a channel with its name, type, writer, readers and rate.
fn row(
    svg: &mut String,
    y: f64,
    spec: &ChannelSpec,
    lanes: &[Process],
    figures: Option<&Figures>,
    is_live: bool,
) {
    let is_silent = is_live && figures.is_none_or(|figures| figures.rate_hz == 0.0);
    let color = if is_silent { QUIET } else { SENT };
    text(svg, [24.0, y + 4.5], 13.5, "start", INK, spec.name);
    let message = spec.message.ros2.rsplit('/').next().unwrap_or_default();
    text(svg, [LEFT_PX - 24.0, y + 4.5], 11.5, "end", FAINT, message);
    let places = |wanted: &dyn Fn(Process) -> bool| -> Vec<f64> {
        lanes.iter().enumerate().filter(|(_, lane)| wanted(**lane)).map(|(i, _)| lane_x(i)).collect()
    };
    let writers = places(&|process| spec.may_write(process));
    let readers = places(&|process| spec.readers.contains(&process));
    let ends = writers.iter().chain(&readers).copied();
    let (low, high) = ends.fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)));
    if low < high {
        let dash = if spec.role == Role::Instruction { " stroke-dasharray=\"6 4\"" } else { "" };
        let _ = writeln!(
            svg,
            "<line x1=\"{low}\" y1=\"{y}\" x2=\"{high}\" y2=\"{y}\" stroke=\"{color}\" stroke-width=\"1.6\"{dash}/>"
        );
    }
    for &x in readers.iter().filter(|x| !writers.contains(x)) {
        arrow(svg, x, y, writers.first().is_none_or(|&writer| writer < x), color);
    }
    for x in writers {
        let _ = writeln!(svg, "<circle cx=\"{x}\" cy=\"{y}\" r=\"4.5\" fill=\"{color}\"/>");
    }
    let recorder =
        places(&|process| process == Process::Recorder && spec.is_recorded() && !spec.may_write(process));
    for x in recorder {
        let _ = writeln!(svg, "<circle cx=\"{x}\" cy=\"{y}\" r=\"4\" fill=\"#ffffff\" stroke=\"{color}\"/>");
    }
    if let Some(figures) = figures {
        let right = LEFT_PX + LANE_PX * lanes.len() as f64 + RIGHT_PX - 24.0;
        let ink = if is_silent { QUIET } else { INK };
        for (x, figure) in [(right - BAND_PX, figures.rate_hz), (right, figures.bytes_per_second / 1e3)] {
            text(svg, [x, y + 4.5], 12.5, "end", ink, &format!("{figure:.1}"));
        }
    }
}

/// Draws the head of an arrow that ends at `x`.
fn arrow(svg: &mut String, x: f64, y: f64, from_left: bool, color: &str) {
    let back = if from_left { x - 9.0 } else { x + 9.0 };
    let _ =
        writeln!(svg, "<path d=\"M{x} {y} L{back} {} L{back} {} Z\" fill=\"{color}\"/>", y - 4.5, y + 4.5);
}

fn text(svg: &mut String, [x, y]: [f64; 2], size: f64, anchor: &str, fill: &str, words: &str) {
    let words = escape(words);
    let _ = writeln!(
        svg,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" text-anchor=\"{anchor}\" fill=\"{fill}\">{words}</text>"
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_channel_has_a_row_and_every_writer_and_reader_a_lane() {
        let specs: Vec<_> = channels::all().collect();
        let svg = draw(&specs, None, None);
        for spec in &specs {
            assert!(svg.contains(&format!(">{}</text>", spec.name)), "{}", spec.name);
            let of_lane = |process: &&Process| lanes().contains(process);
            assert_eq!(spec.readers.iter().filter(of_lane).count(), spec.readers.len(), "{}", spec.name);
            assert!(lanes().iter().any(|&process| spec.may_write(process)), "{}", spec.name);
        }
    }
}

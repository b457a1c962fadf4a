//! Summarizes which parts of a log were converted and which were not, for people and programs.

use std::collections::BTreeMap;

use anyhow::Context;
use serde::Serialize;
use sketchnav_recordings::carmen::{Doubt, OdometrySource, Reading};
use sketchnav_recordings::import::Imported;

use crate::output::{out, say};
use crate::recordings::args::ImportOptions;

/// Maximum number of reasons, and of lines for each reason, that are shown to people. Programs get more of them.
const MAX_SHOWN: usize = 5;

/// Logs written with a coarse clock contain some scans with equal times. If more than one in this number of scans repeats the time
/// of the previous scan, the user is warned.
const STANDING_SHARE: f64 = 10.0;

/// How much of a log was converted, and what was left out.
#[derive(Debug, Serialize)]
pub struct Summary {
    recording: String,
    scans: u64,
    /// The first word of the lines that contain the scans.
    kind: &'static str,
    lasers: Vec<LaserFigures>,
    odometry: Odometry,
    left_out: LeftOut,
    /// Number of lines of each unsupported kind, keyed by the first word of the line.
    not_read: BTreeMap<String, u64>,
    warnings: Vec<String>,
}

/// Scans whose beams have the same directions.
#[derive(Debug, Serialize)]
struct LaserFigures {
    beams: usize,
    /// The angle from the first beam to the last, in degrees.
    span_deg: f64,
    scans: u64,
}

#[derive(Debug, Serialize)]
struct Odometry {
    from: &'static str,
    way_m: f64,
}

/// What was left out of the log. Everything is counted, but only the first thousand lines are listed.
#[derive(Debug, Serialize)]
struct LeftOut {
    lines: u64,
    readings: u64,
    why: Vec<Why>,
}

#[derive(Debug, Serialize)]
struct Why {
    line: u64,
    why: String,
}

impl Summary {
    pub fn new(
        reading: &Reading,
        way_m: f64,
        imported: &Imported,
        not_read: BTreeMap<String, u64>,
        doubts: &[Doubt],
        options: &ImportOptions,
    ) -> Self {
        let lines = imported.left_out.iter().map(|left| Why { line: left.line, why: left.why.to_string() });
        let readings = imported.unreadable.iter().map(|(line, count)| {
            let why = format!("{count} readings that are not distances; the rest of each scan is read");
            Why { line: *line, why }
        });
        let scans = imported.scans;
        let clock = |count: u64, what: &str| {
            format!(
                "the log's clock {what} {count} times: these scans follow the previous one without a pause"
            )
        };
        let goes_back = Some(imported.clock_goes_back).filter(|count| *count > 0);
        let stands =
            Some(imported.clock_stands).filter(|count| STANDING_SHARE * *count as f64 > scans as f64);
        let blind = Some(imported.blind).filter(|count| 2 * count > scans);
        let found = [
            goes_back.map(|count| clock(count, "goes back")),
            stands.map(|count| clock(count, "stands still")),
            blind.map(|count| {
                let most_m = options.range_max;
                format!("{count} of {scans} scans have no distance below {most_m} m: expected metres")
            }),
        ];
        let lasers = imported.shapes.known.iter().map(|shape| LaserFigures {
            beams: shape.count,
            span_deg: shape.beams.span_rad(shape.count).to_degrees(),
            scans: shape.scans,
        });
        Self {
            recording: options.output.display().to_string(),
            scans: imported.scans,
            kind: reading.kind.word(),
            lasers: lasers.collect(),
            odometry: Odometry {
                from: match reading.odometry {
                    OdometrySource::Lines => "ODOM lines",
                    OdometrySource::Scans => "the robot's pose in each scan",
                },
                way_m,
            },
            left_out: LeftOut {
                lines: imported.left_out_lines,
                readings: imported.left_out_readings,
                why: lines.chain(readings).collect(),
            },
            not_read,
            warnings: doubts.iter().map(Doubt::to_string).chain(found.into_iter().flatten()).collect(),
        }
    }

    /// Prints the summary as text or as one JSON object, and the warnings to standard error.
    pub fn print(&self, json: bool) -> anyhow::Result<()> {
        for warning in &self.warnings {
            say!("warning: {warning}");
        }
        if json {
            return out!("{}", serde_json::to_string(self).context("the summary as JSON")?);
        }
        self.text().iter().try_for_each(|line| out!("{line}"))
    }

    fn text(&self) -> Vec<String> {
        let mut lines: Vec<String> = match self.lasers.as_slice() {
            [laser] => vec![format!("{} scans of {}", self.scans, laser.words(self.kind))],
            lasers => std::iter::once(format!("{} scans", self.scans))
                .chain(lasers.iter().map(|laser| format!("  {} of {}", laser.scans, laser.words(self.kind))))
                .collect(),
        };
        lines.push(format!("odometry   {}: {:.1} m", self.odometry.from, self.odometry.way_m));
        let LeftOut { lines: left_out, readings, why } = &self.left_out;
        if left_out + readings > 0 {
            lines.push(format!("left out   {left_out} lines, {readings} readings of other lines"));
            lines.extend(grouped(why).into_iter().map(|reason| format!("  {reason}")));
        }
        if !self.not_read.is_empty() {
            let kinds: Vec<_> = self.not_read.iter().map(|(word, count)| format!("{count} {word}")).collect();
            lines.push(format!("not read   {}", kinds.join(", ")));
        }
        lines.push(format!("recording  {}", self.recording));
        lines
    }
}

impl LaserFigures {
    fn words(&self, kind: &str) -> String {
        format!("{} beams over {:.1}° ({kind})", self.beams, self.span_deg)
    }
}

/// Formats a line for each reason, with the lines of the log that it applies to.
fn grouped(all: &[Why]) -> Vec<String> {
    let mut groups: Vec<(&str, Vec<u64>)> = Vec::new();
    for Why { line, why } in all {
        match groups.iter_mut().find(|(known, _)| *known == why.as_str()) {
            Some((_, lines)) => lines.push(*line),
            None => groups.push((why.as_str(), vec![*line])),
        }
    }
    let more = |count: usize| if count > 0 { format!(" and {count} more") } else { String::new() };
    let words = |(why, lines): &(&str, Vec<u64>)| {
        let shown: Vec<_> = lines.iter().take(MAX_SHOWN).map(u64::to_string).collect();
        let rest = more(lines.len().saturating_sub(MAX_SHOWN));
        let line = if lines.len() > 1 { "lines" } else { "line" };
        format!("{line} {}{rest}: {why}", shown.join(", "))
    };
    let mut reasons: Vec<_> = groups.iter().take(MAX_SHOWN).map(words).collect();
    let rest = groups.len().saturating_sub(MAX_SHOWN);
    if rest > 0 {
        reasons.push(format!("{rest} more reasons (--json names them)"));
    }
    reasons
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_are_printed_once_with_their_lines() {
        let why = |line, why: &str| Why { line, why: why.to_owned() };
        let mut all: Vec<_> = (1..=8).map(|line| why(line, "too short")).collect();
        all.push(why(9, "garbled"));
        assert_eq!(grouped(&all), ["lines 1, 2, 3, 4, 5 and 3 more: too short", "line 9: garbled"]);
        let all: Vec<_> = (1..=7).map(|line| why(line, &format!("reason {line}"))).collect();
        assert_eq!(grouped(&all).last().unwrap(), "2 more reasons (--json names them)");
    }
}

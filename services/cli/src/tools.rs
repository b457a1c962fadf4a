//! Tools for recordings.

use std::path::Path;

use anyhow::Context;
use comfy_table::{Table, presets::UTF8_FULL_CONDENSED};
use sketchnav_recordings::info::Info;

use crate::failure::{Failure, OrInput, Outcome};
use crate::output::out;

/// Compares two recordings.
pub fn diff(a: &Path, b: &Path, json: bool) -> Result<Outcome, Failure> {
    let difference = sketchnav_recordings::diff::diff(a, b).or_input()?;
    if json {
        let object = serde_json::json!({ "identical": difference.is_none(), "difference": difference });
        out!("{object}")?;
    } else {
        match &difference {
            None => out!("identical: every message of every channel (health left out)")?,
            Some(difference) => out!("different: {difference}")?,
        }
    }
    Ok(if difference.is_none() { Outcome::Success } else { Outcome::Short })
}

/// Tells what a recording holds.
pub fn info(file: &Path, json: bool) -> Result<Outcome, Failure> {
    let info = sketchnav_recordings::info::info(file).or_input()?;
    if json {
        out!("{}", serde_json::to_string(&info).context("the info as JSON")?)?;
    } else {
        print(&info)?;
    }
    Ok(Outcome::Success)
}

fn print(info: &Info) -> anyhow::Result<()> {
    out!("{}  ({:.1} MB)", info.path, info.bytes as f64 / 1e6)?;
    for (key, value) in &info.run {
        out!("{key:<10} {value}")?;
    }
    let end = match (info.clean_end, info.restarts) {
        (false, _) => "cut off; what is there is whole".to_owned(),
        (true, 0) => "ended cleanly".to_owned(),
        (true, restarts) => format!("ended cleanly; the recorder was killed and went on {restarts} times"),
    };
    out!("{:.1} s simulated, {} messages, {} missing; {end}", info.duration_s, info.messages, info.missing)?;
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED);
    table.set_header(["topic", "type", "messages", "rate", "missing"]);
    for topic in &info.topics {
        table.add_row([
            topic.topic.clone(),
            topic.ros2_type.clone(),
            topic.messages.to_string(),
            topic.rate_hz.map_or("–".into(), |rate| format!("{rate:.2} Hz")),
            topic.missing.to_string(),
        ]);
    }
    out!("{table}")?;
    for topic in &info.topics {
        for gap in &topic.gaps {
            out!("{}: {gap:?}", topic.topic)?;
        }
    }
    Ok(())
}

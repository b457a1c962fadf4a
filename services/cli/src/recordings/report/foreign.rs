//! The page of a recording by other software, with its content and the positions in its topics.

use std::path::Path;

use anyhow::Context;
use maud::{Markup, html};
use sketchnav_lab::page::{self, Chart, Series};
use sketchnav_recordings::Recording;
use sketchnav_recordings::info::{self, Info, TopicInfo};

use crate::failure::{Failure, OrInput, Outcome};
use crate::output::{out, say};
use crate::poses::{self, Way};
use crate::recordings::tell_cut_off;
use crate::recordings::whole::Whole;

/// Writes the page.
pub fn report(whole: &Whole, recording: &Recording, output: &Path, json: bool) -> Result<Outcome, Failure> {
    let mut info = info::info(recording.path()).or_input()?;
    let is_reported = !whole.lacks().cut_off.is_empty();
    info.clean_end &= !is_reported;
    // If the positions cannot be read, say so and show everything else.
    let ways = poses::read(recording).unwrap_or_else(|error| {
        say!("notice: positions are not shown: {error}");
        Vec::new()
    });
    ways.iter().filter_map(Way::notice).for_each(|words| say!("notice: {words}"));
    let page =
        page::document(&format!("{} · sketchnav report", name(recording)), &body(recording, &info, &ways));
    sketchnav_files::write(output, page).with_context(|| output.display().to_string()).or_input()?;
    if !info.clean_end && !is_reported {
        tell_cut_off(whole.name().display());
    }
    say!("notice: not a sketchnav recording: the page shows topics and positions only");
    let page = output.display().to_string();
    match json {
        true => {
            out!("{}", serde_json::json!({ "page": page, "cut_off": !info.clean_end, "notes": info.notes }))?
        }
        false => out!("page       {page}")?,
    }
    Ok(Outcome::Success)
}

fn name(recording: &Recording) -> String {
    recording.path().file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn body(recording: &Recording, info: &Info, ways: &[Way]) -> Markup {
    let header = recording.header();
    let said = |text: &str| if text.is_empty() { "–".to_owned() } else { text.to_owned() };
    html! {
        h1 { (name(recording)) }
        @if !info.clean_end { p.notice { "The recording is cut off: what follows covers only part of it." } }
        @for note in &info.notes { p.notice { (note) } }
        @for note in ways.iter().filter_map(Way::notice) { p.notice { (note) } }
        p.facts {
            span { "profile " b { (said(&header.profile)) } }
            span { "written by " b { (said(&header.library)) } }
            span { "messages " b { (info.messages) } }
            span { "seconds " b { (format!("{:.1}", info.duration_s)) } }
        }
        h2 { "Topics" }
        (page::table(&["topic", "type", "encoding", "messages", "rate", "missing"].map(str::to_owned), &rows(info)))
        (places(ways))
    }
}

fn rows(info: &Info) -> Vec<Vec<String>> {
    let row = |topic: &TopicInfo| {
        let rate = topic.rate_hz.map_or("–".to_owned(), |rate| format!("{rate:.2} Hz"));
        let (messages, missing) = (topic.messages.to_string(), topic.missing.to_string());
        vec![topic.topic.clone(), topic.ros2_type.clone(), topic.encoding.clone(), messages, rate, missing]
    };
    info.topics.iter().map(row).collect()
}

/// Draws how far each object was from its first position.
fn places(ways: &[Way]) -> Markup {
    let times = || ways.iter().flat_map(|way| way.places.iter().map(|place| place.time_s));
    let (Some(begin_s), Some(end_s)) = (times().reduce(f64::min), times().reduce(f64::max)) else {
        return html! {};
    };
    let series: Vec<_> = ways.iter().map(|way| from_begin(way, begin_s)).collect();
    let chart = Chart {
        title: "Distance from where it began",
        unit: "m",
        series: &series,
        x_unit: "s",
        span: [0.0, (end_s - begin_s).max(1e-3)],
        marks: &[],
        faults: &[],
    };
    html! {
        h2 { "Positions over time" }
        div.cards { (chart.figure()) }
    }
}

fn from_begin(way: &Way, begin_s: f64) -> Series {
    let first = way.places.first().map_or([0.0; 2], |place| place.at_m);
    let far = |at: [f64; 2]| (at[0] - first[0]).hypot(at[1] - first[1]);
    let points = way.places.iter().map(|place| [place.time_s - begin_s, far(place.at_m)]).collect();
    Series { name: way.name.clone(), points }
}

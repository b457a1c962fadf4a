//! Computes relations between objects over time, from a table of positions or from a recording.

mod association;
mod bodies;
mod calculi;
mod forces;
mod table;

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::{Context, bail, ensure};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use comfy_table::{Table, presets::UTF8_FULL_CONDENSED};
use serde::Serialize;
use sketchnav_qualitative::argd::Bound;
use sketchnav_recordings::copy;

use crate::failure::{Failure, OrInput, Outcome};
use crate::output::{self, out, say};
use crate::recordings::whole::Whole;
use association::Meetings;
use calculi::Word;

/// The options of `relations`.
#[derive(Debug, Clone, Args)]
pub struct RelationsOptions {
    /// The calculus.
    #[arg(long, value_enum)]
    pub calculus: Word,
    /// The objects, in the order of the relation's arguments, separated by commas. Default: all combinations.
    #[arg(long, value_delimiter = ',', value_name = "A,B")]
    pub between: Vec<String>,
    /// Ignore motion up to this distance between two samples, in metres (qtc, mos).
    #[arg(long, value_name = "METRES", conflicts_with = "quantisation_mps")]
    pub quantisation_m: Option<f64>,
    /// Ignore motion up to this speed, in metres per second.
    #[arg(long, value_name = "M/S")]
    pub quantisation_mps: Option<f64>,
    /// Maximum distance where qtc-bc includes the sides, in metres.
    #[arg(long, value_name = "METRES", default_value_t = sketchnav_qualitative::qtc::PERSONAL_SPACE_M)]
    pub near_m: f64,
    /// Labels and thresholds for argd, separated by commas.
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "LABEL=METRES",
        default_value = "near=3.0,medium=3.5,far=4.0"
    )]
    pub thresholds: Vec<String>,
    /// Whether a threshold of argd is the greatest distance of its label, or the least.
    #[arg(long, value_parser = bounds(), default_value = "upper")]
    pub bound: Bound,
    /// Treat sides that differ by up to this distance as equal (rcc, rectangle, allen), and points within this distance of each
    /// other or of a line as coincident (flipflop, doublecross, dra), in metres.
    #[arg(long, value_name = "METRES", default_value_t = 0.0)]
    pub tolerance_m: f64,
    /// Treat timestamps that differ by up to this many seconds as equal. The object with the fewest samples sets the times, and the
    /// nearest sample of each other object is used. By default timestamps must be equal.
    #[arg(long, value_name = "SECONDS", value_parser = parse_tolerance)]
    pub tolerance: Option<f64>,
    /// Do not follow objects across gaps of more than this many seconds in their samples.
    #[arg(long, value_name = "SECONDS")]
    pub max_gap_s: Option<f64>,
    /// Print a line for each sample, even if the relation does not change.
    #[arg(long)]
    pub every_sample: bool,
    /// Omit relations that were not sampled but that motion must have passed through between two samples.
    #[arg(long)]
    pub observed_only: bool,
    /// Print one JSON object instead of a table.
    #[arg(long, conflicts_with = "csv")]
    pub json: bool,
    /// Print comma-separated values instead of a table.
    #[arg(long)]
    pub csv: bool,
}

fn bounds() -> impl TypedValueParser<Value = Bound> {
    let words = PossibleValuesParser::new(["upper", "lower"]);
    words.map(|word| if word == "lower" { Bound::Lower } else { Bound::Upper })
}

fn parse_tolerance(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds: &f64| seconds.is_finite() && *seconds >= 0.0);
    seconds.ok_or_else(|| "expected a number of seconds, 0 or above".to_owned())
}

/// The position, heading and size of an object at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Body {
    /// Position, in metres.
    at: [f64; 2],
    /// Heading, in radians, or `None` to use the direction of motion.
    heading_rad: Option<f64>,
    /// Length along x and width along y of the bounding box, in metres.
    size_m: Option<[f64; 2]>,
}

/// An object and its samples over time.
#[derive(Debug, Clone, PartialEq)]
struct Track {
    name: String,
    /// The samples with their times, in seconds, in ascending order.
    samples: Vec<(f64, Body)>,
}

/// The relations of some objects over time.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Series {
    between: Vec<String>,
    relations: Vec<Held>,
    /// Explains why there are no relations, or fewer than the number of samples would suggest.
    #[serde(skip_serializing_if = "Option::is_none")]
    note: Option<String>,
}

/// A relation and the period when it held.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Held {
    from_s: f64,
    to_s: f64,
    relation: String,
    /// The kind of change from the previous relation, as a word.
    change: String,
}

/// Prints the relations of a recording or of a table.
pub fn relations(whole: &Whole, options: &RelationsOptions) -> Result<Outcome, Failure> {
    let series = compute(whole, options).or_input()?;
    for one in &series {
        if let Some(note) = &one.note {
            say!("notice: {}", one.named(note));
        }
    }
    if options.json {
        let object = serde_json::json!({ "calculus": word(options.calculus), "series": series });
        out!("{object}")?;
    } else if options.csv {
        output::lines(comma_separated(&series)?)?;
    } else {
        output::lines(drawn(&series))?;
    }
    Ok(Outcome::Success)
}

fn compute(whole: &Whole, options: &RelationsOptions) -> anyhow::Result<Vec<Series>> {
    let file = whole.path();
    let tracks = if is_recording(file) { bodies::read(whole)? } else { table::read(file)? };
    let chosen = choose(&tracks, options).with_context(|| file.display().to_string())?;
    let of = |tracks: Vec<&Track>| of_tracks(&tracks, options).with_context(|| file.display().to_string());
    let series: Vec<Series> = chosen.into_iter().map(of).collect::<anyhow::Result<_>>()?;
    if series.iter().all(|one| one.relations.is_empty()) {
        let why: Vec<_> = series.iter().filter_map(|one| Some(one.named(one.note.as_ref()?))).collect();
        bail!("{}: expected relations, found none: {}", file.display(), why.join("; "));
    }
    Ok(series)
}

/// Returns true if the file is named like a recording, or is one under another name.
fn is_recording(file: &Path) -> bool {
    let is_named_so = file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mcap"));
    is_named_so || copy::profile(file).is_ok()
}

fn of_tracks(tracks: &[&Track], options: &RelationsOptions) -> anyhow::Result<Series> {
    let between: Vec<_> = tracks.iter().map(|track| track.name.clone()).collect();
    let scenes = association::associate(tracks, options.tolerance);
    let relations = calculi::series(tracks, &scenes, options).with_context(|| between.join(", "))?;
    let note = note(&Meetings::of(tracks, &scenes), relations.is_empty(), options);
    Ok(Series { between, relations, note })
}

/// Explains why there are no relations, or what most samples lack.
fn note(meetings: &Meetings, is_empty: bool, options: &RelationsOptions) -> Option<String> {
    let Meetings { together, rarest, samples, .. } = meetings;
    let times = match options.tolerance {
        None => "time in common".to_owned(),
        Some(tolerance_s) => format!("time in common to within {tolerance_s} s"),
    };
    if *together == 0 {
        Some(format!("no {times}: {}", meetings.miss()))
    } else if is_empty {
        let hint = match options.tolerance {
            None => "; --tolerance 0 leaves out times at which not all objects were seen",
            Some(_) => "",
        };
        Some(format!(
            "{together} samples with a {times}, and no relation: most calculi compare a sample with the previous one, and \
             no two follow each other without a pause{hint}"
        ))
    } else if 2 * together < *samples {
        Some(format!("{together} of {samples} samples of {rarest} have a {times}: {}", meetings.miss()))
    } else {
        None
    }
}

impl Series {
    fn named(&self, note: &str) -> String {
        format!("{}: {note}", self.between.join(", "))
    }
}

/// Returns the objects that the user named or, by default, all combinations of as many objects as the calculus takes.
fn choose<'a>(tracks: &'a [Track], options: &RelationsOptions) -> anyhow::Result<Vec<Vec<&'a Track>>> {
    let count = options.calculus.arguments();
    if options.between.is_empty() {
        ensure!(tracks.len() >= count, "expected {count} objects or more, found {}", names(tracks));
        return Ok(combinations(tracks, count));
    }
    let found = options.between.len();
    ensure!(found == count, "--between: {} expected {count} objects, found {found}", word(options.calculus));
    let named = options.between.iter().map(|name| {
        let track = tracks.iter().find(|track| track.name == *name);
        track.with_context(|| format!("--between: expected some of {}, found {name:?}", names(tracks)))
    });
    let named: Vec<_> = named.collect::<anyhow::Result<_>>()?;
    let distinct: BTreeSet<_> = named.iter().map(|track| &track.name).collect();
    if distinct.len() < count {
        bail!("--between: expected different objects, found {}", options.between.join(", "));
    }
    Ok(vec![named])
}

/// Returns all combinations of `count` tracks, in the order of the tracks.
fn combinations(tracks: &[Track], count: usize) -> Vec<Vec<&Track>> {
    if count == 0 {
        return vec![Vec::new()];
    }
    let with = |(i, track)| {
        let rest = combinations(&tracks[i + 1..], count - 1).into_iter();
        rest.map(move |rest| [vec![track], rest].concat())
    };
    tracks.iter().enumerate().flat_map(with).collect()
}

fn names(tracks: &[Track]) -> String {
    let names: Vec<_> = tracks.iter().map(|track| track.name.as_str()).collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

fn word(calculus: Word) -> String {
    calculus.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}

const COLUMNS: [&str; 5] = ["between", "from_s", "to_s", "relation", "change"];

fn rows(series: &[Series]) -> impl Iterator<Item = [String; 5]> {
    series.iter().flat_map(|one| {
        one.relations.iter().map(|held| {
            let times = [held.from_s, held.to_s].map(|time_s| format!("{time_s:.3}"));
            let [from_s, to_s] = times;
            [one.between.join(" "), from_s, to_s, held.relation.clone(), held.change.clone()]
        })
    })
}

fn drawn(series: &[Series]) -> Table {
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED);
    table.set_header(COLUMNS);
    table.add_rows(rows(series));
    table
}

fn comma_separated(series: &[Series]) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(COLUMNS)?;
    rows(series).try_for_each(|row| writer.write_record(row))?;
    let bytes = writer.into_inner().map_err(|error| error.into_error())?;
    Ok(String::from_utf8(bytes)?.trim_end().to_owned())
}

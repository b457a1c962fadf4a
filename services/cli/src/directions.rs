//! Prints what the map-maker derives from a mission: itineraries, landmarks, or the transition matrix.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use clap::{Args, ValueEnum};
use maud::{PreEscaped, html};
use sketchnav_directions::messages::PlannedJourney;
use sketchnav_directions::plane::DotId;
use sketchnav_directions::stages::belief::Charts;
use sketchnav_directions::stages::mission::{self, KIND};
use sketchnav_directions::stages::settings;
use sketchnav_directions::stages::sketcher::{self, Made};
use sketchnav_directions::survey::{Cost, Parkways, Survey};
use sketchnav_directions::{CustomMap, Point as Place};
use sketchnav_lab::page::document;
use sketchnav_lab::picture::{PlanePicture, PlannedMap, map_graph, plane};
use sketchnav_schemas::geometry::{Point, World};
use sketchnav_schemas::mission::Task;
use sketchnav_schemas::run::RunConfig;

use crate::failure::{Failure, OrInput, Outcome};
use crate::output;

/// The options of `directions`.
#[derive(Debug, Clone, Args)]
pub struct DirectionsOptions {
    /// Print a table of the plane instead of the itineraries.
    #[arg(long, value_enum)]
    table: Option<Table>,
    /// Restrict the table to these parkways and trajectories: detectable, recoverable, or reliable=R, where R is the
    /// least reliability, from 0 to 1.
    #[arg(long, value_name = "WHICH", value_parser = parse_parkways, requires = "table")]
    only: Option<Parkways>,
    /// Plan with this method instead of the mission's.
    #[arg(long)]
    method: Option<String>,
    /// Explain in words what each entry of the custom maps means.
    #[arg(long, conflicts_with = "table")]
    words: bool,
    /// Draw the custom maps as graphs into this SVG file.
    #[arg(long, value_name = "FILE", conflicts_with = "table")]
    graph: Option<PathBuf>,
    /// Write the custom maps as a page to print into this HTML file: a picture of the landmarks, and what each entry means.
    #[arg(long, value_name = "FILE", conflicts_with = "table")]
    page: Option<PathBuf>,
    /// The seed of the map-maker's simulations.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl DirectionsOptions {
    /// Returns true if the custom maps should be explained, which is possible without a plan.
    fn explains(&self) -> bool {
        self.words || self.graph.is_some() || self.page.is_some()
    }
}

/// The contents of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Table {
    /// The landmarks, starting with those that can be reached from most others.
    Landmarks,
    /// The transition matrix as CSV: the distance between each pair of landmarks (Park and Kender 1995, table 2).
    Distances,
    /// The transition matrix as CSV: -ln R of each transition, where R is its reliability.
    Unreliability,
}

fn parse_parkways(word: &str) -> Result<Parkways, String> {
    let least = |number: &str| number.parse().ok().filter(|least| (0.0..=1.0).contains(least));
    match word.split_once('=') {
        None if word == "detectable" => Some(Parkways::Detectable),
        None if word == "recoverable" => Some(Parkways::Recoverable),
        Some(("reliable", number)) => least(number).map(Parkways::Reliable),
        _ => None,
    }
    .ok_or_else(|| "expected detectable, recoverable or reliable=R with R from 0 to 1".to_owned())
}

/// Prints the itinerary of each task, or a table.
pub fn print(path: &Path, options: &DirectionsOptions) -> Result<Outcome, Failure> {
    let (mut mission, robot) = sketchnav_sim::mission_file::load(path).or_input()?;
    let in_file = |reason: String| anyhow!("{}: {reason}", path.display());
    let kind = mission.navigator_kind();
    if kind != KIND {
        return Err(in_file(format!("navigator.kind: expected {KIND:?}, found {kind:?}"))).or_input();
    }
    if let Some(method) = &options.method {
        mission.navigator.given.insert("method".to_owned(), method.as_str().into());
    }
    mission::check(&mission, &robot).map_err(|error| in_file(error.to_string())).or_input()?;
    let run = RunConfig::lockstep("map-maker", mission, robot, options.seed);
    let text = match options.table {
        None => {
            let made = sketcher::make(&run, &sketchnav_navigators::read_file);
            let made = made.map_err(|error| in_file(error.to_string())).or_input()?;
            if made.charts.is_some() && options.explains() {
                let wrong = "navigator.method: expected one with custom maps for --words, --graph and --page, found belief";
                return Err(in_file(wrong.to_owned())).or_input();
            }
            if let Some(file) = &options.page {
                write_page(file, &run, &made).or_input()?;
            }
            if let Some(file) = &options.graph {
                draw(file, &run, &made).or_input()?;
            }
            itineraries(&run, &made, options)
        }
        Some(table) => survey(&run, table, options.only.unwrap_or(Parkways::All)),
    };
    output::lines(text.map_err(in_file).or_input()?.trim_end())?;
    Ok(Outcome::Success)
}

/// Draws the custom maps as graphs into a file.
fn draw(file: &Path, run: &RunConfig, made: &Made) -> anyhow::Result<()> {
    let names = run.mission.task.iter().map(|task| task.name.as_str());
    let maps: Vec<_> = names.zip(&made.maps).collect();
    let svg = map_graph(&format!("{}: the custom maps as graphs", run.mission.name), &maps);
    sketchnav_files::write(file, svg).with_context(|| format!("--graph {}", file.display()))
}

/// Writes a page to print: for each task a picture of the landmarks with the numbers of their entries, and the map in sentences.
fn write_page(file: &Path, run: &RunConfig, made: &Made) -> anyhow::Result<()> {
    let (window, _) = settings::sight(&run.mission, &run.robot)?;
    let atlas = sketcher::atlas(run, &sketchnav_navigators::read_file)?;
    let walls = atlas.iter().flat_map(|atlas| atlas.plane.walls().lines());
    let walls: Vec<_> = walls.map(|ends| ends.map(on_picture)).collect();
    let dots: Vec<_> = made.dots.iter().copied().map(on_picture).collect();
    let markers = atlas.as_ref().and_then(|atlas| atlas.plane.markers());
    let kinds = markers.map(|markers| (0..dots.len() as DotId).map(|dot| markers.name(dot)).collect());
    let kinds: Vec<String> = kinds.unwrap_or_default();
    let task = |((task, map), (number, landmarks)): ((&Task, &CustomMap), (usize, &Landmarks))| {
        let planned = PlannedMap::of(map, landmarks.iter().map(|(_, at)| on_picture(*at)).collect());
        let picture = plane(&PlanePicture {
            title: &task.name,
            dots: &dots,
            kinds: &kinds,
            walls: &walls,
            parkways: &[],
            trajectories: &[],
            planned: &[planned],
            ways: &[],
            windows: &[],
            tasks: &[],
            bar_m: window.side,
        });
        html! {
            h2 { (task.name) }
            @if !dots.is_empty() { div.pictures { figure { (PreEscaped(picture)) } } }
            @if let Some(stated) = made.journeys.get(number).and_then(PlannedJourney::stated) { p { (stated) } }
            @if let Some(words) = map.around_in_words() { p { (words) } }
            ol { @for words in map.in_words() { li { (words) } } }
        }
    };
    let tasks = run.mission.task.iter().zip(&made.maps).zip(made.landmarks.iter().enumerate()).map(task);
    let title = format!("{}: custom maps", run.mission.name);
    let body = html! { h1 { (title) } @for task in tasks { (task) } };
    sketchnav_files::write(file, document(&title, &body))
        .with_context(|| format!("--page {}", file.display()))
}

/// The landmark of each entry of a map: its number in the plane and its position.
type Landmarks = Vec<(DotId, Place)>;

fn on_picture(at: Place) -> Point<World> {
    Point::new(at.x, at.y)
}

/// Formats each task's landmarks as in figure 30, with the costs of its path and its map. A map that was written by hand has no
/// costs.
fn itineraries(run: &RunConfig, made: &Made, options: &DirectionsOptions) -> Result<String, String> {
    let settings = settings::settings(&run.mission, &run.robot).map_err(|error| error.to_string())?;
    if let Some(charts) = &made.charts {
        return Ok(charted(run, made, charts));
    }
    if made.plans.is_empty() && !options.explains() {
        return Err(written());
    }
    let tasks = run.mission.task.iter().zip(&made.maps).enumerate();
    let text = tasks.map(|(number, (task, map))| {
        let itinerary = made.plans.get(number).map_or(String::new(), |plan| {
            let (entries, views, time_s) = (plan.path.entries(), plan.sensing(), plan.path.time_s(&settings));
            let costs = match map.branches() {
                true => format!(
                    "{} entries; a straight map of its path: {entries}, {time_s:.1} s",
                    map.entries().len()
                ),
                false => format!("{entries} entries, {views} views, {time_s:.1} s"),
            };
            format!("{}{costs}\n", plan.itinerary())
        });
        let words = if options.words { map.sentences() } else { String::new() };
        format!("{}\n{itinerary}{map}{words}", task.name)
    });
    Ok(text.collect::<Vec<_>>().join("\n"))
}

/// Formats the size of a chart, and each task's probability of arrival.
fn charted(run: &RunConfig, made: &Made, charts: &Charts) -> String {
    let mut text =
        format!("{} landmarks in {} bytes, in place of a map\n", charts.charted.dots.len(), charts.bytes());
    for (task, journey) in run.mission.task.iter().zip(&made.journeys) {
        let PlannedJourney { distance_m, probability, .. } = journey;
        text +=
            &format!("\n{}\ndistance {distance_m:.3}, probability of arrival {probability:.3}\n", task.name);
    }
    text
}

fn survey(run: &RunConfig, table: Table, parkways: Parkways) -> Result<String, String> {
    let atlas = sketcher::atlas(run, &sketchnav_navigators::read_file).map_err(|error| error.to_string())?;
    let atlas = atlas.ok_or_else(written)?;
    let survey = Survey::new(&atlas, parkways).map_err(|error| error.to_string())?;
    Ok(match table {
        Table::Landmarks => survey.to_string(),
        Table::Distances => survey.csv(Cost::Distance),
        Table::Unreliability => survey.csv(Cost::Unreliability),
    })
}

fn written() -> String {
    "navigator: expected plane_file or floor_file, found map_file, a map that was written by hand".to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parkways_are_named_and_a_reliability_is_a_share() {
        assert_eq!(parse_parkways("detectable"), Ok(Parkways::Detectable));
        assert_eq!(parse_parkways("reliable=0.95"), Ok(Parkways::Reliable(0.95)));
        for wrong in ["reliable", "reliable=2", "reliable=much", "detectable=1", ""] {
            assert!(parse_parkways(wrong).unwrap_err().starts_with("expected detectable"), "{wrong}");
        }
    }
}

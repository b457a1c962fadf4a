//! Prints what the map-maker derives from a mission: itineraries, landmarks, or the transition matrix.

use std::path::Path;

use anyhow::anyhow;
use clap::{Args, ValueEnum};
use sketchnav_directions::stages::mission::{self, KIND};
use sketchnav_directions::stages::sketcher;
use sketchnav_directions::survey::{Cost, Parkways, Survey};
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
    /// The seed of the map-maker's simulations.
    #[arg(long, default_value_t = 1)]
    seed: u64,
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
        None => itineraries(&run),
        Some(table) => survey(&run, table, options.only.unwrap_or(Parkways::All)),
    };
    output::lines(text.map_err(in_file).or_input()?.trim_end())?;
    Ok(Outcome::Success)
}

/// Formats each task's landmarks as in figure 30, with the costs of its path.
fn itineraries(run: &RunConfig) -> Result<String, String> {
    let made = sketcher::make(run, &sketchnav_navigators::read_file).map_err(|error| error.to_string())?;
    let settings = mission::settings(&run.mission, &run.robot).map_err(|error| error.to_string())?;
    if made.plans.is_empty() {
        return Err(written());
    }
    let tasks = run.mission.task.iter().zip(&made.plans).zip(&made.maps);
    let text = tasks.map(|((task, plan), map)| {
        let (entries, views, time_s) = (plan.path.entries(), plan.sensing(), plan.path.time_s(&settings));
        let costs = format!("{entries} entries, {views} views, {time_s:.1} s");
        format!("{}\n{}{costs}\n{map}", task.name, plan.itinerary())
    });
    Ok(text.collect::<Vec<_>>().join("\n"))
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

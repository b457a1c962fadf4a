//! Runs a study, whole or in parts, and prints its tables.

use std::time::Instant;

use anyhow::{Context, anyhow};
use comfy_table::{CellAlignment, Table, presets::UTF8_FULL_CONDENSED};
use sketchnav_lab::experiments::studies::{ByWorld, Figure, Run, Size, Study, World, report};

use super::parts::{self, Origin};
use super::{bar_of, classify, command_line, folders, refuse_missing_folder};
use crate::args::EvalOptions;
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::{self, out, say};

/// Runs the study, or a part of it, or merges its parts. `--trials` sets the number of worlds.
pub fn run(study: &Study, options: &EvalOptions) -> Result<Outcome, Failure> {
    refuse_meaningless_options(study, options).or_input()?;
    refuse_missing_folder(options.output.as_deref())?;
    let began = Instant::now();
    let size = Size { worlds: options.trials.map_or(study.worlds, u64::from), seed: options.seed };
    let figures = match study.run {
        Run::ByWorld(by_world) => match in_parts(study, by_world, size, options)? {
            Some(figures) => figures,
            None => return Ok(Outcome::Success),
        },
        _ => study.run(&folders(options).or_input()?, size, options.jobs()).map_err(classify)?,
    };
    if let Some(path) = &options.output {
        let page = report::page(study, &figures, &command_line());
        sketchnav_files::write(path, page).with_context(|| path.display().to_string()).or_input()?;
        say!("report     {}", path.display());
    }
    if options.json {
        out!("{}", json(study, size, &figures))?;
        return Ok(Outcome::Success);
    }
    out!("{}: {}", study.name, study.title)?;
    for figure in &figures {
        out!("")?;
        out!("{}", figure.table.title)?;
        output::lines(table(figure))?;
    }
    out!("{} worlds, seed {}", size.worlds, size.seed)?;
    say!("{:.0} s", began.elapsed().as_secs_f64());
    Ok(Outcome::Success)
}

/// Returns the figures of a study that runs world by world, either from its parts or by running all of it. Returns `None` if only
/// the jobs were listed, or only a part was run.
fn in_parts(
    study: &Study,
    by_world: ByWorld,
    size: Size,
    options: &EvalOptions,
) -> Result<Option<Vec<Figure>>, Failure> {
    let worlds = by_world.worlds(size);
    let origin = || Origin::of_study(study, &by_world, size);
    let attempt = |worlds: &[World]| {
        let bar = bar_of(worlds.len(), options.json, "{bar:30.cyan/dim} {pos}/{len} worlds; {eta} to go");
        let attempts = by_world.attempt(worlds, options.jobs(), &|| bar.inc(1)).map_err(classify);
        bar.finish_and_clear();
        attempts
    };
    if options.list_jobs {
        parts::list_worlds(&origin()?, &worlds, options.json)?;
        return Ok(None);
    }
    if let (Some(numbers), Some(path)) = (&options.job, &options.output) {
        let chosen = parts::chosen(&worlds, numbers).or_input()?;
        parts::write(path, origin()?, numbers, attempt(chosen)?)?;
        parts::say(path, numbers, options.json)?;
        return Ok(None);
    }
    let attempts = match &options.merge {
        Some(parts) => parts::merge(parts, &origin()?, &options.accept).or_input()?,
        None => attempt(&worlds)?,
    };
    by_world.figures(&attempts).map(Some).map_err(classify)
}

/// Rejects options of suites that mean nothing for a study.
fn refuse_meaningless_options(study: &Study, options: &EvalOptions) -> anyhow::Result<()> {
    let is_whole = !matches!(study.run, Run::ByWorld(_));
    let given = [
        ("--method", !options.methods.is_empty()),
        ("--drawings", !options.drawings.is_empty()),
        ("--set", !options.parameters.is_empty()),
        ("--cost", options.cost),
        ("--sample", options.sample.is_some()),
        ("--only", options.only.is_some()),
        ("--pictures", options.pictures.is_some()),
        ("--world", options.world.is_some()),
        ("--check-processes", options.check_processes.is_some()),
        ("--list-jobs", is_whole && options.list_jobs),
        ("--job", is_whole && options.job.is_some()),
        ("--merge", is_whole && options.merge.is_some()),
    ];
    match given.into_iter().find(|(_, is_given)| *is_given) {
        Some((option @ ("--list-jobs" | "--job" | "--merge"), _)) => {
            Err(anyhow!("{option}: {} is not divided into jobs", study.name))
        }
        Some((option, _)) => {
            Err(anyhow!("{option}: {} drives no missions and has no such option", study.name))
        }
        None => Ok(()),
    }
}

fn table(figure: &Figure) -> Table {
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED);
    let words = report::words(&figure.table);
    table.set_header(words.header);
    table.add_rows(words.rows);
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// Returns the figures as JSON, for programs.
pub fn json(study: &Study, size: Size, figures: &[Figure]) -> serde_json::Value {
    let figures: Vec<_> = figures.iter().map(|figure| &figure.table).collect();
    serde_json::json!({ "study": study.name, "worlds": size.worlds, "seed": size.seed, "figures": figures })
}

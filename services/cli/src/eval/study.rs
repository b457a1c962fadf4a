//! Runs a study and prints its tables.

use std::time::Instant;

use anyhow::{Context, anyhow};
use comfy_table::{CellAlignment, Table, presets::UTF8_FULL_CONDENSED};
use sketchnav_lab::experiments::studies::{Figure, Size, Study, report};

use super::{classify, command_line, folders, refuse_missing_folder};
use crate::args::EvalOptions;
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::{self, out, say};

/// Runs the study. `--trials` sets the number of worlds.
pub fn run(study: &Study, options: &EvalOptions) -> Result<Outcome, Failure> {
    refuse_meaningless_options(study, options).or_input()?;
    refuse_missing_folder(options.output.as_deref())?;
    let began = Instant::now();
    let size = Size { worlds: options.trials.map_or(study.worlds, u64::from), seed: options.seed };
    let figures = study.run(&folders(options).or_input()?, size).map_err(classify)?;
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

/// Rejects options of suites that mean nothing for a study.
fn refuse_meaningless_options(study: &Study, options: &EvalOptions) -> anyhow::Result<()> {
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
        ("--list-jobs", options.list_jobs),
        ("--job", options.job.is_some()),
        ("--merge", options.merge.is_some()),
    ];
    match given.into_iter().find(|(_, is_given)| *is_given) {
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

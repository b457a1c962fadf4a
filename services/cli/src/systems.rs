//! Lists the systems on this machine, cleans up after dead ones, and finds a running one by name.

use std::path::Path;

use anyhow::Context;
use comfy_table::{Table, presets::UTF8_FULL_CONDENSED};
use serde::Serialize;
use sketchnav_runtime::System;
use sketchnav_schemas::run::{Pace, RunConfig};

use crate::failure::{Failure, Outcome};
use crate::output::{self, out};

#[derive(Serialize)]
struct Row {
    system: String,
    mission: String,
    seed: u64,
    pace: Pace,
    processes: Vec<Member>,
}

#[derive(Serialize)]
struct Member {
    process: String,
    pid: u32,
}

/// Lists this user's systems and their processes.
pub fn ps(json: bool) -> Result<Outcome, Failure> {
    let systems = System::list().context("looking for systems")?;
    // Systems that end in the meantime are left out.
    let rows: Vec<_> = systems.iter().filter_map(|system| row(system).ok()).collect();
    if json {
        out!("{}", serde_json::to_string(&rows).context("the list as JSON")?)?;
        return Ok(Outcome::Success);
    }
    if rows.is_empty() {
        out!("no system is running; `sketchnav run demo --speed 1` starts one")?;
    } else {
        output::lines(table(&rows))?;
    }
    // A system that is being created has no description yet.
    let dead = System::list_dead().context("looking for dead systems")?;
    let dead = dead.iter().filter_map(|system| Some((system, system.run_config().ok()?)));
    dead.into_iter().try_for_each(|(system, run)| out!("{}", resume_hint(system.name(), &run)))?;
    Ok(Outcome::Success)
}

/// Says how to resume a system whose supervisor was killed.
fn resume_hint(name: &str, run: &RunConfig) -> String {
    let folder = run.recording.as_deref().and_then(|recording| Path::new(recording).parent());
    match folder {
        Some(folder) => format!(
            "{name}: its supervisor was killed; resume it with: sketchnav run --resume {}",
            folder.display()
        ),
        None => format!("{name}: its supervisor was killed; `sketchnav clean` removes what it left behind"),
    }
}

/// Removes what this user's dead systems have left behind.
pub fn clean(json: bool) -> Result<Outcome, Failure> {
    let cleared = System::sweep_dead().context("removing what dead systems left behind")?;
    if json {
        out!("{}", serde_json::json!({ "removed": cleared }))?;
    } else if cleared.is_empty() {
        out!("nothing to remove")?;
    } else {
        cleared.iter().try_for_each(|name| out!("removed {name}"))?;
    }
    Ok(Outcome::Success)
}

fn row(system: &System) -> anyhow::Result<Row> {
    let run = system.run_config()?;
    let processes = system.processes()?.into_iter().map(|(process, pid)| Member { process, pid });
    Ok(Row {
        system: system.name().to_owned(),
        mission: run.mission.name,
        seed: run.seed,
        pace: run.pace,
        processes: processes.collect(),
    })
}

fn table(rows: &[Row]) -> Table {
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED);
    table.set_header(["system", "mission", "seed", "process", "pid"]);
    for row in rows {
        for (i, member) in row.processes.iter().enumerate() {
            let first = |text: String| if i == 0 { text } else { String::new() };
            table.add_row([
                first(row.system.clone()),
                first(row.mission.clone()),
                first(row.seed.to_string()),
                member.process.clone(),
                member.pid.to_string(),
            ]);
        }
    }
    table
}

/// Opens the system with the given name or, without a name, the only one that is running.
pub fn find(name: Option<&str>) -> Result<System, Failure> {
    if let Some(name) = name {
        return System::open(name).map_err(|error| Failure::Input(error.into()));
    }
    let mut systems = System::list().context("looking for systems")?;
    match systems.len() {
        1 => Ok(systems.remove(0)),
        0 => Err(Failure::Input(anyhow::anyhow!(
            "no system is running; `sketchnav run demo --speed 1` starts one"
        ))),
        _ => {
            let names: Vec<_> = systems.iter().map(System::name).collect();
            Err(Failure::Input(anyhow::anyhow!(
                "several systems are running; choose one with --system {}",
                names.join(" or --system ")
            )))
        }
    }
}

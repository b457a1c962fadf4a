//! The process that reads the mission's drawing: sends the sketch and the route once, then stays, so
//! that who comes late still gets them. Where people draw while it runs, see `live`.

use std::path::Path;
use std::time::Duration;

use anyhow::Context;
use sketchnav_runtime::{HealthReporter, Node, Step, Wake};
use sketchnav_schemas::channels::{ROUTE, SKETCH};
use sketchnav_schemas::run::RunConfig;

use crate::drawing::Drawing;
use crate::places::{Intent, Places};
use crate::publish::{fill_cells, fill_route, fill_sketch};
use crate::settings::Options;

/// Longest sleep between two signs of life.
const NAP: Duration = Duration::from_millis(250);

/// Runs the sketcher in `node`'s system until it is asked to end.
///
/// # Errors
/// A drawing that is missing, or that [`read`](crate::read) or [`Intent::place`] refuses; a channel
/// that fails.
pub fn run(node: &Node) -> anyhow::Result<()> {
    let config = node.run_config()?;
    if config.pad.draws() {
        return crate::live::run(node, &config);
    }
    let mut health = HealthReporter::new(node)?;
    let (mut sketches, mut routes) = (node.slice_writer(SKETCH)?, node.writer(ROUTE)?);
    let step = Step::begin();
    let (drawing, places) = understand(&config)?;
    let mut sketch = sketches.loan(drawing.cells.len())?;
    fill_sketch(&drawing, &places, sketch.message_mut());
    fill_cells(&drawing, sketch.bytes_mut())?;
    sketch.send()?;
    routes.send(|route| fill_route(&places, route))?;
    health.end(step);
    loop {
        health.report_if_due(0)?;
        if node.wait(NAP) == Wake::Terminate {
            return Ok(health.report(0)?);
        }
    }
}

/// Reads the drawing of a run and places its start and tasks in it; the mission goes before what the
/// drawing itself marks.
///
/// # Errors
/// As [`run`].
pub fn understand(run: &RunConfig) -> anyhow::Result<(Drawing, Places)> {
    let file = &run.mission.sketch.file;
    let bytes = std::fs::read(Path::new(file)).with_context(|| format!("{file}: expected a drawing"))?;
    understand_bytes(run, &bytes)
}

/// As [`understand`], of a drawing that is in no file: `bytes` stand for the file that the mission names.
///
/// # Errors
/// As [`run`].
pub fn understand_bytes(run: &RunConfig, bytes: &[u8]) -> anyhow::Result<(Drawing, Places)> {
    let (mission, options) = (&run.mission, Options::of_mission(&run.mission, run.seed)?);
    let drawing = crate::read(bytes, &mission.sketch.file, &options)?;
    let intent = Intent::of_mission(mission).or(Intent::of_marks(&drawing.marks));
    let places = intent.place(&drawing, &options.settings)?;
    Ok((drawing, places))
}

//! Shows how the sketcher understands a drawing: `preview DRAWING OUT.png [MISSION.toml]`.

#![expect(clippy::disallowed_methods, reason = "an example has a clock")]

use std::fs;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use sketchnav_files::{DRAWING, MISSION};
use sketchnav_schemas::mission::Mission;
use sketchnav_sketch::mission::SketchMission;
use sketchnav_sketch::reading::{Intent, Options, preview, read};

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (file, out, mission) = match &arguments[..] {
        [file, out] => (file, out, None),
        [file, out, mission] => (file, out, Some(mission)),
        _ => bail!("usage: preview DRAWING OUT.png [MISSION.toml]"),
    };
    let text = mission.map(|file| sketchnav_files::read_to_string(file, MISSION)).transpose()?;
    let mission = text.map(|text| Mission::parse(&text)).transpose()?;
    let options = mission.as_ref().map(|mission| Options::of_mission(mission, 1)).transpose()?;
    let options = options.unwrap_or_default();
    let bytes = sketchnav_files::read(file, DRAWING).with_context(|| format!("drawing {file}"))?;

    let begin = Instant::now();
    let drawing = read(&bytes, file, &options)?;
    let took = begin.elapsed();
    let walls = drawing.cells.iter().filter(|&&cell| cell != 0).count();
    println!(
        "{file}: {:?}, {} x {} px, scale {:.3}, pen {:.1} px, direction {:.1} deg, walls {:.1} %, {took:.0?}",
        drawing.kind,
        drawing.width_px,
        drawing.height_px,
        drawing.scale,
        drawing.pen_width_px,
        drawing.wall_direction_rad.to_degrees(),
        100.0 * walls as f64 / drawing.cells.len() as f64,
    );
    let intent = mission.as_ref().map(SketchMission::of).transpose()?;
    let intent =
        intent.map(|mission| Intent::of_mission(&mission, &drawing)).transpose()?.unwrap_or_default();
    let intent = intent.or(Intent::of_marks(&drawing.marks));
    let placed = intent.place(&drawing, &options.settings);
    let places = if intent == Intent::default() { None } else { Some(placed?) };
    fs::write(out, preview(&drawing, places.as_ref())?)?;
    Ok(())
}

//! Writes a drawing of a floor, deformed as people deform what they draw.

use std::path::Path;

use anyhow::{Context, anyhow};
use sketchnav_deform::{DeformError, Deformation, DeformedDrawing, Floor, PEOPLE, files};

use crate::args::DeformOptions;
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::out;

/// Draws the floor of `map`.
pub fn deform(map: &Path, options: &DeformOptions) -> Result<Outcome, Failure> {
    let floor = files::floor(map).or_input()?;
    let drawing = sketchnav_deform::deform(&floor, options.degree, options.seed).or_input()?;
    let bytes = encoded(&drawing, &options.output)?;
    std::fs::write(&options.output, bytes)
        .with_context(|| options.output.display().to_string())
        .or_input()?;
    if options.json {
        out!("{}", json(&floor, &drawing, options))?;
    } else {
        print(&floor, &drawing, options)?;
    }
    Ok(Outcome::Success)
}

fn encoded(drawing: &DeformedDrawing, path: &Path) -> Result<Vec<u8>, Failure> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("json") => Ok(drawing.strokes_json().into_bytes()),
        Some("svg") => Ok(drawing.svg().into_bytes()),
        Some("png") => drawing.png().map_err(|error: DeformError| Failure::Other(error.into())),
        _ => Err(anyhow!("--output {}: expected .json, .svg or .png", path.display())).or_input(),
    }
}

/// The middles of the rooms that were forgotten, metres.
fn forgotten(floor: &Floor, drawing: &DeformedDrawing) -> Vec<[f64; 2]> {
    let middle = |&room: &usize| [floor.regions()[room].center.x, floor.regions()[room].center.y];
    drawing.forgotten.iter().map(middle).collect()
}

fn json(floor: &Floor, drawing: &DeformedDrawing, options: &DeformOptions) -> serde_json::Value {
    serde_json::json!({
        "floor": floor.name,
        "degree": options.degree,
        "seed": options.seed,
        "drawing": options.output,
        "canvas_px": drawing.canvas_px,
        "regions": floor.regions().len(),
        "forgotten": forgotten(floor, drawing),
        "deformation": drawing.deformation,
        "as_annotated": drawing.as_annotated,
        "people": PEOPLE,
    })
}

fn print(floor: &Floor, drawing: &DeformedDrawing, options: &DeformOptions) -> anyhow::Result<()> {
    let [width, height] = drawing.canvas_px;
    out!("{}  {width} × {height} px, {} strokes", options.output.display(), drawing.strokes.len())?;
    for [x, y] in forgotten(floor, drawing) {
        out!("forgotten: the room around ({x:.1}, {y:.1}) m")?;
    }
    let rows = [
        ("deformation", drawing.deformation),
        ("as annotated", drawing.as_annotated),
        ("people", Some(PEOPLE)),
    ];
    for (what, found) in rows {
        match found {
            Some(found) => out!("{what:<13} {}", line(&found))?,
            None => out!("{what:<13} too few places to measure it")?,
        }
    }
    Ok(())
}

fn line(d: &Deformation) -> String {
    format!(
        "residual {:.2} of the extent (affine {:.2}), anisotropy {:.2}, log of local scale sd {:.2}, 5 to 95 % {:.2} to {:.2}, {} places",
        d.similarity_residual,
        d.affine_residual,
        d.anisotropy,
        d.log_scale_sd,
        d.scale_p05,
        d.scale_p95,
        d.places
    )
}

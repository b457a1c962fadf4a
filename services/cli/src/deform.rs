//! Writes a drawing of a floor with the distortions of a hand-drawn map, and prints where given positions on the floor
//! lie in that drawing.

use std::path::Path;

use anyhow::{Context, anyhow};
use serde::Serialize;
use sketchnav_deform::{DeformError, Deformation, DeformedDrawing, Floor, Furnishing, PEOPLE, files};
use sketchnav_schemas::geometry::{Point, Pose, World};

use crate::args::{DeformOptions, FloorPlace};
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::out;

/// Maximum number of omitted pieces of furniture that are printed.
const PRINTED: usize = 12;

/// Draws the floor of the file `map`.
pub fn deform(map: &Path, options: &DeformOptions) -> Result<Outcome, Failure> {
    let floor = files::floor(map).or_input()?;
    let drawing = sketchnav_deform::deform(&floor, options.degree, options.seed).or_input()?;
    let asked = options.places.iter().map(|place| asked(&floor, &drawing, place));
    let asked = asked.collect::<anyhow::Result<Vec<_>>>().or_input()?;
    let bytes = encoded(&drawing, &options.output)?;
    refuse_to_overwrite(map, &options.output).or_input()?;
    sketchnav_files::write(&options.output, bytes)
        .with_context(|| options.output.display().to_string())
        .or_input()?;
    if options.json {
        out!("{}", json(&floor, &drawing, options, &asked))?;
    } else {
        print(&floor, &drawing, options, &asked)?;
    }
    Ok(Outcome::Success)
}

/// Rejects an output that would overwrite the map or its picture.
fn refuse_to_overwrite(map: &Path, output: &Path) -> anyhow::Result<()> {
    let picture = sketchnav_sim::files::picture_of(map);
    let inputs = [Some(map), picture.as_deref()].into_iter().flatten();
    Ok(sketchnav_files::draft::refuse_to_overwrite(inputs, output)?)
}

fn encoded(drawing: &DeformedDrawing, path: &Path) -> Result<Vec<u8>, Failure> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("json") => Ok(drawing.strokes_json().into_bytes()),
        Some("svg") => Ok(drawing.svg().into_bytes()),
        Some("png") => drawing.png().map_err(|error: DeformError| Failure::Other(error.into())),
        _ => Err(anyhow!("--output {}: expected .json, .svg or .png", path.display())).or_input(),
    }
}

/// A position on the floor, and the corresponding position in the drawing.
#[derive(Serialize)]
struct Drawn {
    /// Position on the floor, in metres.
    at_m: [f64; 2],
    /// Column and row in the drawing, or `None` if the position lies in a room that was left out.
    at_px: Option<[f64; 2]>,
    /// The heading at that position in the drawing, in degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    heading_deg: Option<f64>,
    /// The name of the omitted piece of furniture whose bounding box contains the position.
    #[serde(skip_serializing_if = "Option::is_none")]
    within: Option<String>,
}

/// Finds where a position given by the user lies in the drawing.
fn asked(floor: &Floor, drawing: &DeformedDrawing, place: &FloorPlace) -> anyhow::Result<Drawn> {
    let [x, y] = place.at_m;
    if floor.region_at(&Point::<World>::new(x, y)).is_none() {
        let [low, high] = extent(floor);
        return Err(anyhow!(
            "--place {x},{y}: expected a place in a room, found a wall or the outside; the rooms reach from ({:.1}, {:.1}) to ({:.1}, {:.1}) m",
            low[0],
            low[1],
            high[0],
            high[1]
        ));
    }
    let heading_rad = place.heading_deg.unwrap_or(0.0).to_radians();
    let pose = drawing.pose_to_sketch(&Pose::new(x, y, heading_rad));
    Ok(Drawn {
        at_m: place.at_m,
        at_px: pose.map(|pose| drawing.to_image(&pose.position()).map(f64::round)),
        heading_deg: pose
            .filter(|_| place.heading_deg.is_some())
            .map(|pose| pose.yaw_rad.to_degrees().round()),
        within: floor
            .furniture()
            .iter()
            .find(|piece| covers(piece, place.at_m))
            .map(|piece| piece_name(piece).to_owned()),
    })
}

/// Returns the lower left and the upper right corner of the box around all rooms, in metres.
fn extent(floor: &Floor) -> [[f64; 2]; 2] {
    let corners = floor.regions().iter().flat_map(|region| &region.polygon);
    corners.fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[low, high], at| {
        [[low[0].min(at[0]), low[1].min(at[1])], [high[0].max(at[0]), high[1].max(at[1])]]
    })
}

/// Returns the centres of the rooms, and where they lie in the drawing.
fn rooms(floor: &Floor, drawing: &DeformedDrawing) -> Vec<Drawn> {
    let room = |center: &Point<World>| {
        let at = drawing.to_sketch(center);
        let at_px = at.map(|at| drawing.to_image(&at).map(f64::round));
        Drawn { at_m: [center.x, center.y], at_px, heading_deg: None, within: None }
    };
    floor.regions().iter().map(|region| room(&region.center)).collect()
}

fn json(
    floor: &Floor,
    drawing: &DeformedDrawing,
    options: &DeformOptions,
    asked: &[Drawn],
) -> serde_json::Value {
    let rooms = rooms(floor, drawing);
    let forgotten: Vec<_> = rooms.iter().filter(|room| room.at_px.is_none()).map(|room| room.at_m).collect();
    let furniture = |piece: &Furnishing| {
        let Furnishing { name, center, size_m } = piece;
        serde_json::json!({ "name": name, "center_m": [center.x, center.y], "size_m": size_m })
    };
    serde_json::json!({
        "floor": floor.name,
        "degree": options.degree,
        "seed": options.seed,
        "drawing": options.output,
        "canvas_px": drawing.canvas_px,
        "regions": rooms.len(),
        "rooms": rooms,
        "places": asked,
        "forgotten": forgotten,
        "left_out": floor.furniture().iter().map(furniture).collect::<Vec<_>>(),
        "deformation": drawing.deformation,
        "as_annotated": drawing.as_annotated,
        "people": PEOPLE,
    })
}

fn print(
    floor: &Floor,
    drawing: &DeformedDrawing,
    options: &DeformOptions,
    asked: &[Drawn],
) -> anyhow::Result<()> {
    let [width, height] = drawing.canvas_px;
    out!("{}  {width} × {height} px, {} strokes", options.output.display(), drawing.strokes.len())?;
    for Drawn { at_m: [x, y], at_px, .. } in rooms(floor, drawing) {
        match at_px {
            Some([column, row]) => out!("the room around ({x:.1}, {y:.1}) m is at [{column}, {row}]")?,
            None => out!("forgotten: the room around ({x:.1}, {y:.1}) m")?,
        }
    }
    for piece @ Furnishing { center, size_m: [length, width], .. } in floor.furniture().iter().take(PRINTED) {
        let what = piece_name(piece);
        out!("left out: {what}, {length:.1} m × {width:.1} m at ({:.1}, {:.1}) m", center.x, center.y)?;
    }
    if let Some(more @ 1..) = floor.furniture().len().checked_sub(PRINTED) {
        out!("left out: {more} more pieces; --json lists all")?;
    }
    let guessed = floor.furniture().iter().filter(|piece| piece.name.is_empty()).count();
    if guessed > PRINTED {
        out!("{guessed} pieces of the map may be walls: compare the drawing with the map")?;
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
    for Drawn { at_m: [x, y], at_px, heading_deg, within } in asked {
        if let Some(piece) = within {
            out!("({x}, {y}) m: {piece} at or next to it is left out of the drawing")?;
        }
        match (at_px, heading_deg) {
            (None, _) => out!("({x}, {y}) m lies in a room that was forgotten")?,
            (Some([column, row]), None) => out!("({x}, {y}) m: goal = [{column}, {row}]")?,
            (Some([column, row]), Some(heading)) => {
                out!("({x}, {y}) m: start = [{column}, {row}], start_heading_deg = {heading}")?;
            }
        }
    }
    Ok(())
}

fn piece_name(piece: &Furnishing) -> &str {
    if piece.name.is_empty() { "a piece that was taken for furniture" } else { &piece.name }
}

/// Returns true if a position, in metres, is inside the bounding box of a piece of furniture.
fn covers(piece: &Furnishing, at_m: [f64; 2]) -> bool {
    let offsets = [at_m[0] - piece.center.x, at_m[1] - piece.center.y];
    offsets.iter().zip(piece.size_m).all(|(offset, size_m)| offset.abs() <= size_m / 2.0)
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

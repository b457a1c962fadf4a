//! Shows what was learned in the frame of the drawing.

use std::sync::Arc;

use sketchnav_mapping::Cell;
use sketchnav_schemas::codes::{FREE, WALL};
use sketchnav_schemas::geometry::Point;
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::StageError;
use sketchnav_stage::drawn::{Frame, Lesson, UNSEEN};
use sketchnav_stage::lookout::Walls;

use super::warp::Lattice;
use super::{DrawingFile, Learned, LearnedMap, Warp, svg};
use crate::reading::{self, DrawnMap, Options, SketchError, desk};

/// Distance, in metres, between places of the map that are converted exactly.
const MESH_M: f64 = 0.4;
/// Distance, in pixels of the grid, between places of the drawing that are converted exactly.
const MESH_PX: f64 = 8.0;

/// Shows what was learned by a drawing of the pad.
///
/// # Errors
/// If either cannot be read, or if they do not belong together.
pub fn show(run: &RunConfig, drawing: &[u8], file: &[u8]) -> Result<Lesson, StageError> {
    let options = Options::of_mission(&run.mission, run.seed)?;
    let learned = Learned::parse(file)?;
    if !learned.drawing.is_same(&DrawingFile::of(desk::NAME, drawing)) {
        let (file, of, drawing) = (String::new(), learned.drawing.file, desk::NAME.to_owned());
        return Err(SketchError::LearnedByAnother { file, of, drawing }.into());
    }
    let drawing = reading::read(drawing, desk::NAME, &options)?;
    lesson(&learned, &drawing)
}

/// Shows what was learned by a drawing.
///
/// # Errors
/// If the correspondence does not determine where the map lies in the drawing.
pub(super) fn lesson(learned: &Learned, drawing: &DrawnMap) -> Result<Lesson, StageError> {
    let frame = DrawingFrame::of(learned).ok_or("pairs: expected at least two different places")?;
    let corrected = svg(learned, drawing).into_bytes();
    Ok(Lesson { seen: overlay(learned, drawing), frame: Arc::new(frame), corrected })
}

/// Converts between the map as a sketch and the drawing's file.
#[derive(Debug)]
struct DrawingFrame {
    map: LearnedMap,
    to_map: Warp,
    from_map: Warp,
    near: Lattice,
}

impl DrawingFrame {
    /// Returns the frame of what was learned, or `None` if it does not correspond to the drawing.
    fn of(learned: &Learned) -> Option<Self> {
        let (map, to_map) = (learned.map.clone(), learned.to_map());
        let from_map = to_map.inverse();
        from_map.apply([0.0; 2]).and(to_map.apply([0.0; 2]))?;
        let sides = [map.width, map.height()].map(|side| side as f64);
        let near = Lattice::new(&from_map, map.of_drawn([0.0; 2]), map.of_drawn(sides), MESH_M);
        Some(Self { map, to_map, from_map, near })
    }
}

impl Frame for DrawingFrame {
    fn to_drawing(&self, sketch_px: [f64; 2]) -> [f64; 2] {
        let at_m = self.map.of_drawn(sketch_px);
        let found = self.near.apply(at_m).or_else(|| self.from_map.apply(at_m));
        let [column, up] = found.unwrap_or_default();
        [column, -up]
    }

    fn to_sketch(&self, [column, row]: [f64; 2]) -> [f64; 2] {
        self.map.to_drawn(self.to_map.apply([column, -row]).unwrap_or_default())
    }
}

/// Returns what was seen as cells of the drawing, which are unknown where nothing was seen.
fn overlay(learned: &Learned, drawing: &DrawnMap) -> Walls {
    let size_px = [drawing.width_px, drawing.height_px];
    let at_px = |index: usize| {
        let width = size_px[0] as usize;
        [index % width, index / width].map(|cell| cell as f64 + 0.5)
    };
    let to_map = |at: [f64; 2]| {
        let [column, row] = drawing.to_image(&Point::new(at[0], at[1]));
        [column, -row]
    };
    let warp = learned.to_map();
    let lattice = Lattice::by(|at| warp.apply(to_map(at)), [0.0; 2], size_px.map(f64::from), MESH_PX);
    let code = |at: [f64; 2]| match lattice.apply(at).map_or(Cell::Unknown, |at| learned.map.at_m(at)) {
        Cell::Unknown => UNSEEN,
        Cell::Free => FREE,
        Cell::Occupied => WALL,
    };
    let count = size_px[0] as usize * size_px[1] as usize;
    Walls { size_px, cells: (0..count).map(|index| code(at_px(index))).collect() }
}

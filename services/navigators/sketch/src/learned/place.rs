//! Uses a learned map in place of the drawing. The map becomes the sketch, with one pixel per cell, and the tasks are placed in it.

use image::{GrayImage, Luma};
use sketchnav_mapping::Cell;
use sketchnav_mapping::outline::distance;
use sketchnav_schemas::codes::{FREE, WALL};
use sketchnav_schemas::geometry::{Point, Pose, Sketch, wrap_angle};
use sketchnav_schemas::seed;
use sketchnav_stage::drawn::UNSEEN;

use super::{Goal, Learned, LearnedEnd, LearnedMap, Warp};
use crate::filter::Start;
use crate::messages::SketchMap;
use crate::reading::{self, DrawnMap, ImageTask, Intent, Kind, Label, Marks, Options, Places, SketchError};

/// Maximum distance in the drawing, in pixels of the file, between a goal and the same goal on the drive that was learned from.
const SAME_GOAL_PX: f64 = 1.0;
/// Maximum distance, in cells, from a place that was not driven to, to the nearest place that was seen.
const SEEN_WITHIN: f64 = 10.0;

impl LearnedMap {
    /// Returns the place of a position in metres, in pixels of the map as a picture (column, row; row 0 at the top).
    fn to_image(&self, at: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.to_drawn(at);
        [x, self.height() as f64 - y]
    }

    /// Returns the map as a drawing at [`CELLS_PER_M`](super::CELLS_PER_M).
    fn drawn(&self, file: &str, options: &Options) -> DrawnMap {
        let (width, height) = (self.width as u32, self.height() as u32);
        let picture = GrayImage::from_fn(width, height, |column, row| {
            let cell = self.cells[row as usize * self.width + column as usize];
            Luma([if cell == Cell::Occupied { 255 } else { 0 }])
        });
        let mut rng = seed::stream(options.seed, "sketcher/lines");
        DrawnMap {
            file: file.to_owned(),
            kind: Kind::Filled,
            width_px: width,
            height_px: height,
            cells: self
                .cells
                .iter()
                .map(|cell| match cell {
                    Cell::Free => FREE,
                    Cell::Occupied => WALL,
                    Cell::Unknown => UNSEEN,
                })
                .collect(),
            scale: 1.0,
            pen_width_px: SketchMap::NO_PEN_PX,
            wall_direction_rad: reading::wall_direction(&picture, &options.settings, &mut rng),
            marks: Marks::default(),
            labels: Vec::new(),
            known_goals: Vec::new(),
            left_out: Vec::new(),
        }
    }
}

impl Goal {
    /// Returns true if the goal is at a place in the drawing, in pixels of its file.
    pub(super) fn is_at(&self, at: [f64; 2]) -> bool {
        distance(self.at, at) <= SAME_GOAL_PX
    }
}

impl Learned {
    /// Returns the goals at which the robot arrived, in pixels of the drawing's file.
    pub fn known_goals(&self) -> Vec<Label> {
        let known = self.goals.iter().filter(|goal| goal.at_m.is_some());
        known.map(|goal| Label { text: goal.task.clone(), at: goal.at }).collect()
    }

    /// Returns the map as a drawing, with the tasks of a mission placed in it. `intent` contains the tasks in pixels of the
    /// drawing's file. The robot may start anywhere in the area that was seen, with any heading, but is most likely where it was
    /// at the end of the drive, or if that is unknown, at its beginning.
    ///
    /// # Errors
    /// [`SketchError::Unseen`] if a task leads to a place that was not seen.
    pub fn place(
        &self,
        file: &str,
        intent: &Intent,
        options: &Options,
    ) -> Result<(DrawnMap, Places), SketchError> {
        let drawing = self.map.drawn(file, options);
        let warp = self.to_map();
        let tasks = intent.tasks.iter().enumerate().map(|(i, task)| {
            let what = format!("task {} ({})", i + 1, task.name);
            let points = task.points.iter().map(|&at| {
                let seen = self.seen(at, &warp, &drawing);
                seen.ok_or_else(|| SketchError::Unseen {
                    what: what.clone(),
                    place: at,
                    file: file.to_owned(),
                })
            });
            let points = points.collect::<Result<_, _>>()?;
            Ok(ImageTask { points, is_named: true, ..task.clone() })
        });
        let tasks = tasks.collect::<Result<_, SketchError>>()?;
        // The robot stood at the origin, but something else may have stood there later.
        let origin = drawing.from_image(self.map.to_image([0.0; 2]));
        let start = drawing.to_image(&reading::nearest_free(&drawing, &origin).unwrap_or(origin));
        let placed = Intent { start: Some(start), heading_deg: Some(0.0), tasks, ..Intent::default() };
        let places = placed.place(&drawing, &options.settings)?;
        let end = self.end.unwrap_or(LearnedEnd { at_m: [0.0; 2], heading_deg: 0.0 });
        let likely = drawing.from_image(self.map.to_image(end.at_m));
        let likely = free_near(&drawing, &likely).unwrap_or(likely);
        let likely = Pose::new(likely.x, likely.y, wrap_angle(end.heading_deg.to_radians()));
        let Start { pose, spread_px, spread_rad } = Start::anywhere(likely, drawing.size());
        let anywhere =
            Places { start: pose, start_spread_px: spread_px, start_spread_rad: spread_rad, ..places };
        Ok((drawing, anywhere))
    }

    /// Returns the place in the map, in pixels of the map as a picture, of a place in the drawing, in pixels of its file. For a
    /// goal at which the robot has arrived, this is where the robot stood. Returns `None` if the place was not seen.
    fn seen(&self, at: [f64; 2], warp: &Warp, drawing: &DrawnMap) -> Option<[f64; 2]> {
        let arrived = self.goals.iter().filter(|goal| goal.is_at(at)).find_map(|goal| goal.at_m);
        let at_m = arrived.or_else(|| warp.apply([at[0], -at[1]]))?;
        let near = free_near(drawing, &drawing.from_image(self.map.to_image(at_m)))?;
        Some(drawing.to_image(&near))
    }
}

/// Returns the point itself if it is free, or else the centre of the nearest free cell that is at most [`SEEN_WITHIN`] cells away.
fn free_near(drawing: &DrawnMap, point: &Point<Sketch>) -> Option<Point<Sketch>> {
    if drawing.cell(point) == Some(FREE) {
        return Some(*point);
    }
    reading::nearest_free(drawing, point).filter(|cell| cell.distance(point) <= SEEN_WITHIN)
}

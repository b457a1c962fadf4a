//! Control missions: their drawing is the true floor plan, to scale and without furniture and people.

use std::fmt::Write as _;
use std::path::Path;

use sketchnav_schemas::mission::Mission;
use sketchnav_sim::convex::Convex;
use sketchnav_sim::{SimError, WorldDescription};
use sketchnav_sketch::mission::{Aim, SketchMission, WallTone};

/// Scale of the drawings, in pixels per metre.
const SCALE_PXPM: f64 = 40.0;
/// Width of the paper around the walls, in metres.
const EDGE_M: f64 = 1.0;

/// Returns `mission` with the walls of its floor as its drawing, which is written to `file`. Each goal is at the centre of its
/// task's place.
pub fn true_to_scale(mission: &Mission, file: &Path) -> Result<Mission, SimError> {
    let world = sketchnav_sim::files::world(&mission.world)?;
    let sheet = Sheet::around(&world);
    std::fs::write(file, sheet.svg(&world.walls))?;
    let mut control = mission.clone();
    let mut sketch = SketchMission {
        drawing: file.display().to_string(),
        walls: WallTone::Dark,
        start: Some(sheet.px(control.start.world)),
        start_heading_deg: Some(control.start.world_heading_deg),
        ..SketchMission::of(mission)?
    };
    for (drawn, task) in sketch.tasks.iter_mut().zip(&mission.task) {
        drawn.aim = Aim::Goal(sheet.px(task.there.middle()));
    }
    sketch.write_to(&mut control);
    Ok(control)
}

/// Converts metres on the floor to image pixels.
struct Sheet {
    /// Left and top edge, in metres.
    corner_m: [f64; 2],
    size_px: [f64; 2],
}

impl Sheet {
    fn around(world: &WorldDescription) -> Self {
        let (mut least, mut most) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in world.walls.iter().flat_map(Convex::edges).map(|[a, _]| a) {
            (0..2).for_each(|axis| {
                least[axis] = least[axis].min(point[axis] - EDGE_M);
                most[axis] = most[axis].max(point[axis] + EDGE_M);
            });
        }
        let size_px = [(most[0] - least[0]) * SCALE_PXPM, (most[1] - least[1]) * SCALE_PXPM];
        Self { corner_m: [least[0], most[1]], size_px: size_px.map(f64::ceil) }
    }

    /// Returns the column and row, in image pixels, of a point on the floor.
    fn px(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [(x - self.corner_m[0]) * SCALE_PXPM, (self.corner_m[1] - y) * SCALE_PXPM]
    }

    fn svg(&self, walls: &[Convex]) -> String {
        let [width, height] = self.size_px;
        let mut path = String::new();
        for wall in walls {
            for (i, [corner, _]) in wall.edges().enumerate() {
                let [column, row] = self.px(corner);
                let _ = write!(path, "{}{column:.2},{row:.2}", if i == 0 { "M" } else { "L" });
            }
            path.push('Z');
        }
        format!(
            r#"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}"><rect width="100%" height="100%" fill="white"/><path fill="black" d="{path}"/></svg>"#
        )
    }
}

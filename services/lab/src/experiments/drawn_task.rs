//! Judges a task of a drive by a drawing: whether the path was consistent with the drawing, whether the goal was reached according
//! to the sketch, and how far the robot was from a drawn route.

use sketchnav_schemas::geometry::{Point, Sketch, World};
use sketchnav_sketch::messages::PoseEstimate;
use sketchnav_sketch::mission::SketchTask;
use sketchnav_sketch::paths::chart::Chart;
use sketchnav_sketch::paths::cost_field::CostField;
use sketchnav_sketch::paths::parameters::Parameters;
use sketchnav_sketch::sketch::SketchGrid;

use crate::experiments::ground::to_edge_m;
use crate::experiments::run::Driven;
use crate::experiments::trial::{Sheet, Trial};
use crate::judge::TaskSpan;
use crate::judge::on_sketch::{Asked, LIMIT_M};

/// A task that was begun in a drive by a drawing.
pub struct DrawnTask<'a> {
    sheet: &'a Sheet,
    driven: &'a Driven,
    span: &'a TaskSpan,
    task: &'a SketchTask,
    limit_m: f64,
}

impl<'a> DrawnTask<'a> {
    /// Returns task `index` of the run, or `None` if there is no drawing or the task never began.
    pub fn of(
        trial: &'a Trial,
        driven: &'a Driven,
        span: Option<&'a TaskSpan>,
        index: usize,
    ) -> Option<Self> {
        let task = driven.sketch.as_ref()?.tasks.get(index)?;
        let limit_m = driven.run.mission.task[index].there.radius_m.unwrap_or(LIMIT_M);
        Some(Self { sheet: trial.sheet.as_ref()?, driven, span: span?, task, limit_m })
    }

    /// Returns true if the true path was homotopic to the drawn route or, for a goal, to the planned path to it in the drawing.
    /// Returns `None` if the correspondence between drawing and floor is not known.
    ///
    /// Boniardi et al. 2015, IV, "required the executed trajectories to be topologically consistent with the sketch", and their
    /// 2016 paper, V-B, compares them with the drawn path "similarly".
    pub fn is_consistent(&self) -> Option<bool> {
        let join = self.sheet.correspondence.as_ref()?;
        let drawn = self.route().or_else(|| self.planned())?;
        Some(join.is_homotopic(&self.true_way(), &drawn))
    }

    /// Returns true if the task was reached according to the robot's own pose in the drawing. See
    /// [`crate::judge::on_sketch`].
    pub fn is_reached_on_sketch(&self) -> bool {
        let (Some(&goal), Some(map)) = (self.task.aim.points().last(), self.driven.log.map()) else {
            return false;
        };
        let route = self.route();
        let asked = Asked {
            goal: self.sheet.paper.from_image(goal),
            limit_m: self.limit_m,
            route: self.sheet.correspondence.as_deref().zip(route.as_deref()),
            wall_direction_rad: map.wall_direction_rad,
        };
        asked.is_reached(self.span.state, self.estimates())
    }

    /// Returns the mean distance, in metres, of the true path from the drawn route, which is first mapped to the floor. This is the
    /// "displacement from the drawn path" of Boniardi et al. 2016, V-B. Returns `None` if there is no route or the robot did not
    /// move.
    pub fn displacement_m(&self) -> Option<f64> {
        let join = self.sheet.correspondence.as_ref()?;
        let route: Option<Vec<_>> = self.route()?.into_iter().map(|place| join.to_floor(place)).collect();
        displacement_m(&self.true_way(), &route?)
    }

    fn true_way(&self) -> Vec<Point<World>> {
        self.span.of(&self.driven.log.truth).iter().map(|truth| truth.pose().position()).collect()
    }

    fn estimates(&self) -> &[PoseEstimate] {
        self.span.of(&self.driven.log.estimates)
    }

    fn route(&self) -> Option<Vec<Point<Sketch>>> {
        let points = self.task.aim.route()?;
        Some(points.iter().map(|&at| self.sheet.paper.from_image(at)).collect())
    }

    /// Returns the path of the connectivity planner (Boniardi et al. 2015, III-C) from the robot's first pose in the drawing to
    /// the goal.
    fn planned(&self) -> Option<Vec<Point<Sketch>>> {
        let (map, cells) = self.driven.log.sketch.as_ref()?;
        let chart = Chart::new(self.estimates().first()?, map.wall_direction_rad)?;
        let sketch = SketchGrid::of_map(map, cells).ok()?;
        let goal = self.sheet.paper.from_image(*self.task.aim.points().last()?);
        Some(way_through(&sketch, chart.robot_px().position(), goal, chart.mean_scale_pxpm()))
    }
}

/// Returns the path of the connectivity planner from one point of a drawing to another. The scale determines how far the path keeps
/// from walls, but not on which side it passes obstacles.
pub(super) fn way_through(
    sketch: &SketchGrid,
    from: Point<Sketch>,
    goal: Point<Sketch>,
    scale_pxpm: f64,
) -> Vec<Point<Sketch>> {
    let mut field = CostField::new(sketch);
    field.solve(goal, scale_pxpm, &[], &Parameters::default());
    let mut way = Vec::new();
    field.descend(from, &mut way);
    way
}

/// Returns the mean distance of a path from a line, weighted by length along the path, or `None` if the path has no length
/// or the line no edges.
fn displacement_m(way: &[Point<World>], line: &[Point<World>]) -> Option<f64> {
    let from_line = |at: &Point<World>| {
        let edges = line.windows(2).map(|pair| to_edge_m(&xy(&pair[0]), &xy(&pair[1]), xy(at)));
        edges.fold(f64::INFINITY, f64::min)
    };
    let step = |pair: &[Point<World>]| {
        let length_m = pair[0].distance(&pair[1]);
        (length_m, length_m * f64::midpoint(from_line(&pair[0]), from_line(&pair[1])))
    };
    let (length_m, area) =
        way.windows(2).map(step).fold((0.0, 0.0), |(a, b), (length_m, area)| (a + length_m, b + area));
    (length_m > 0.0 && line.len() > 1).then(|| area / length_m)
}

fn xy(at: &Point<World>) -> [f64; 2] {
    [at.x, at.y]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(points: &[[f64; 2]]) -> Vec<Point<World>> {
        points.iter().map(|[x, y]| Point::new(*x, *y)).collect()
    }

    /// The robot drives two metres at 0.5 m beside the line, then one metre straight away from it, at a mean distance of 1 m. The
    /// mean is (2 · 0.5 + 1 · 1) / 3.
    #[test]
    fn the_displacement_is_the_mean_along_the_path() {
        let drawn = line(&[[0.0, 0.0], [10.0, 0.0]]);
        let way = line(&[[1.0, 0.5], [2.0, 0.5], [2.0, 0.5], [3.0, 0.5], [3.0, 1.5]]);
        assert!((displacement_m(&way, &drawn).unwrap() - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!(displacement_m(&way[..1], &drawn), None, "it did not move");
        assert_eq!(displacement_m(&way, &drawn[..1]), None, "a point is no route");
    }
}

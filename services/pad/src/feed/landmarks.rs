//! What there is to see of a route past landmarks: the matched state, the objects, the place along the route.

use serde::Serialize;
use sketchnav_landmarks::instructions::Instructions;
use sketchnav_landmarks::plane;
use sketchnav_landmarks::route::Route;
use sketchnav_landmarks::view;
use sketchnav_schemas::codes::{RouteCommand, Tracking, WALL};
use sketchnav_schemas::message::{LandmarkProgress, LandmarkView};
use sketchnav_schemas::robot::Robot;

use super::{PlanView, PoseView, thinned};

/// Longer side of the canvas.
const CANVAS_PX: f64 = 1000.0;
/// Room around the sketch, canvas pixels.
const RIM_PX: f64 = 40.0;
/// Less than this of what is seen fits where the robot is not sure.
const DOUBTFUL: f64 = 0.3;

/// A route as the canvas shows it.
#[derive(Debug, Clone)]
pub struct Canvas {
    /// Width and height.
    pub size_px: [u32; 2],
    route: Option<Route>,
    /// The drawn route and outlines, canvas pixels.
    line: Vec<[f64; 2]>,
    outlines: Vec<Vec<[f64; 2]>>,
    low_m: [f64; 2],
    pixels_per_m: f64,
}

/// How the robot stands on its route.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LandmarkFeed {
    /// The state that is waited for, from 1, and how many there are.
    pub next: u32,
    /// How many states there are.
    pub states: u32,
    /// What the robot is about.
    pub command: &'static str,
    /// The share of the route that is behind the robot; null where nobody drew it.
    pub along: Option<f64>,
    /// What is seen: column, row, and whether it meets the state.
    pub objects: Vec<(f64, f64, bool)>,
    /// Names of the objects that meet the state.
    pub met: Vec<String>,
}

impl Canvas {
    /// Of a route; without a sketch the robot stays in the middle.
    pub fn of(instructions: &Instructions) -> Self {
        let route = instructions.route().ok().flatten();
        let points = || {
            let sketch = instructions.sketch.iter();
            sketch.flat_map(|sketch| {
                sketch.route.iter().chain(sketch.landmarks.iter().flat_map(|one| &one.outline))
            })
        };
        let bound = |axis: usize, least: bool| {
            let values = points().map(|at| at[axis]);
            if least {
                values.fold(f64::INFINITY, f64::min)
            } else {
                values.fold(f64::NEG_INFINITY, f64::max)
            }
        };
        let (low, high) = match points().next() {
            Some(_) => ([bound(0, true), bound(1, true)], [bound(0, false), bound(1, false)]),
            None => ([-5.0; 2], [5.0; 2]),
        };
        let side = (high[0] - low[0]).max(high[1] - low[1]).max(0.1);
        let pixels_per_m = (CANVAS_PX - 2.0 * RIM_PX) / side;
        let size_px =
            [0, 1].map(|axis| ((high[axis] - low[axis]) * pixels_per_m + 2.0 * RIM_PX).ceil() as u32);
        let mut canvas =
            Self { size_px, route, line: Vec::new(), outlines: Vec::new(), low_m: low, pixels_per_m };
        if let Some(sketch) = &instructions.sketch {
            canvas.line = sketch.route.iter().map(|at| canvas.point(*at)).collect();
            let outline = |line: &Vec<[f64; 2]>| line.iter().map(|at| canvas.point(*at)).collect();
            canvas.outlines = sketch.landmarks.iter().map(|one| outline(&one.outline)).collect();
        }
        canvas
    }

    /// A place of the sketch, metres, on the canvas, tenths of a pixel.
    fn point(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let height = f64::from(self.size_px[1]);
        let [x, y] = [x - self.low_m[0], y - self.low_m[1]].map(|v| v * self.pixels_per_m + RIM_PX);
        [super::tenth(x), super::tenth(height - y)]
    }

    /// The outlines as cells, row 0 at the bottom.
    pub fn cells(&self) -> Vec<u8> {
        let [width, height] = self.size_px.map(|side| side as usize);
        let mut cells = vec![0; width * height];
        for [a, b] in self.outlines.iter().flat_map(|outline| plane::edges(outline)) {
            let steps = plane::distance(a, b).ceil().max(1.0);
            for i in 0..=steps as usize {
                let [x, y] = plane::between(a, b, i as f64 / steps);
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let (column, row) = (x as usize + dx, y as usize + dy);
                    if column < width && row < height {
                        cells[(height - 1 - row) * width + column] = WALL;
                    }
                }
            }
        }
        cells
    }

    /// Where the robot probably is; `None` where there is no sketch.
    pub fn pose(&self, view: &LandmarkView, robot: &Robot) -> Option<PoseView> {
        if self.line.is_empty() {
            return None;
        }
        let pose = view.in_sketch();
        let [x, y] = self.point([pose.x, pose.y]);
        let spread = super::tenth(2.0 * view.spread_m * self.pixels_per_m / std::f64::consts::SQRT_2);
        Some(PoseView {
            x,
            y,
            heading_rad: super::thousandth(pose.yaw_rad),
            ellipse: [spread, spread, 0.0],
            radius_px: super::tenth(robot.radius_m / view.stretch.max(0.1) * self.pixels_per_m),
            tracking: self.tracking(view).word(),
            effective: super::thousandth(view.fit),
        })
    }

    /// How sure the localizer is. Landmark states know no place.
    pub fn tracking(&self, view: &LandmarkView) -> Tracking {
        if !self.line.is_empty() && view.fit < DOUBTFUL { Tracking::Doubtful } else { Tracking::Tracking }
    }

    /// A place in the robot's axes, real metres, on the canvas.
    fn seen(&self, view: &LandmarkView, [ahead, left]: [f64; 2]) -> [f64; 2] {
        let (pose, stretch) = (view.in_sketch(), view.stretch.max(0.1));
        let (sin, cos) = pose.yaw_rad.sin_cos();
        let [ahead, left] = [ahead / stretch, left / stretch];
        self.point([pose.x + ahead * cos - left * sin, pose.y + ahead * sin + left * cos])
    }

    /// Where the robot remembers something.
    pub fn places(&self, view: &LandmarkView) -> Vec<[f64; 2]> {
        thinned(view.places().iter()).map(|place| self.seen(view, place.map(f64::from))).collect()
    }

    /// The drawn route that is left.
    pub fn plan(&self, progress: &LandmarkProgress) -> Option<PlanView> {
        let behind = progress.along_m * self.pixels_per_m;
        let mut along = 0.0;
        let mut left: Vec<[f64; 2]> = Vec::new();
        for pair in self.line.windows(2) {
            along += plane::distance(pair[0], pair[1]);
            if along >= behind {
                left.push(pair[1]);
            }
        }
        (!self.line.is_empty()).then_some(PlanView { global: left, local: Vec::new() })
    }

    /// How the robot stands on its route.
    pub fn feed(&self, view: &LandmarkView, progress: &LandmarkProgress, robot: &Robot) -> LandmarkFeed {
        let is_met = |i: usize| progress.met().iter().any(|met| met.object as usize == i);
        // What surrounds the robot lies in no direction.
        let objects = view::objects(view).enumerate().filter_map(|(i, object)| {
            let direction = f64::from(object.place.direction()?) * std::f64::consts::FRAC_PI_8;
            let far = object.proximity_m + robot.radius_m;
            let [x, y] = self.seen(view, [far * direction.cos(), far * direction.sin()]);
            Some((x, y, is_met(i)))
        });
        let met = self.route.as_ref().map_or(Vec::new(), |route| view::met(route, progress));
        LandmarkFeed {
            next: progress.next + 1,
            states: progress.state_count,
            command: RouteCommand::from_code(progress.command).map_or("", RouteCommand::word),
            along: (progress.length_m > 0.0)
                .then(|| super::thousandth((progress.along_m / progress.length_m).clamp(0.0, 1.0))),
            objects: objects.collect(),
            met: met.into_iter().map(str::to_owned).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;
    use sketchnav_landmarks::sketch::{Landmark, Sketch};

    use super::*;

    fn canvas() -> Canvas {
        let outline = vec![[4.0, 1.0], [6.0, 1.0], [6.0, 3.0], [4.0, 3.0]];
        let landmarks = vec![Landmark { name: "desk".into(), outline }];
        let sketch =
            Sketch { landmarks, route: vec![[0.0, 0.0], [5.0, 0.0], [10.0, 0.0]], metres_per_pixel: 0.1 };
        let words = "When the desk is left, then turn left.\nAt the end, stop.\n".to_owned();
        Canvas::of(&Instructions { sketch: Some(sketch), words, markers: Vec::new() })
    }

    fn robot() -> Robot {
        Robot::parse(include_str!("../../../../sim/robots/nomad200.toml")).unwrap()
    }

    #[test]
    fn the_sketch_fills_the_canvas_and_its_outlines_are_walls() {
        let canvas = canvas();
        assert_eq!(canvas.size_px, [1000, 356]);
        let cells = canvas.cells();
        assert_eq!(cells.len(), 1000 * 356);
        let [x, y] = canvas.point([4.0, 2.0]);
        let row = 355 - y as usize;
        assert!(cells[row * 1000 + x as usize] == WALL && cells[row * 1000 + x as usize + 50] == 0);
    }

    #[test]
    fn what_meets_the_state_is_marked_and_named() {
        let (canvas, robot) = (canvas(), robot());
        let mut view = LandmarkView::zeroed();
        (view.in_sketch.orientation_w, view.in_sketch.x_m, view.stretch, view.fit) = (1.0, 5.0, 1.0, 0.8);
        (view.object_count, view.objects[0].place, view.objects[0].proximity_m) =
            (1, 4, 1.0 - robot.radius_m);
        let mut progress = LandmarkProgress::zeroed();
        (progress.next, progress.state_count, progress.met_count) = (1, 3, 1);
        (progress.along_m, progress.length_m) = (5.0, 10.0);
        let feed = canvas.feed(&view, &progress, &robot);
        let [x, y] = canvas.point([5.0, 1.0]);
        assert_eq!((feed.objects, feed.met), (vec![(x, y, true)], vec!["desk".to_owned()]));
        assert_eq!((feed.next, feed.along), (2, Some(0.5)));
        assert_eq!(canvas.pose(&view, &robot).unwrap().tracking, "tracking");
        assert_eq!(canvas.plan(&progress).unwrap().global.len(), 2);
    }
}

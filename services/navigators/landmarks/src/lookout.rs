//! Draws a route past landmarks for a page, with the sketch, the robot's position along the route, the
//! objects, and the matched state.

use sketchnav_schemas::codes::{Tracking, WALL};
use sketchnav_schemas::geometry::{Base, Point};
use sketchnav_schemas::robot::Robot;
use sketchnav_stage::lookout::{self, Color, Picture, Shape, Sheet, Stroke, Walls, Whereabouts, thinned};
use sketchnav_stage::{Denied, Incoming};

use crate::drawn::{Drawn, DrawnMetres, Stretch};
use crate::instructions::Instructions;
use crate::memory::polar;
use crate::messages::{
    LANDMARK_PROGRESS, LANDMARK_ROUTE, LANDMARK_VIEW, LandmarkProgress, LandmarkView, RouteCommand,
};
use crate::plane;
use crate::route::Route;
use crate::view;

/// Longer side of the sheet, in pixels.
const SHEET_PX: f64 = 1000.0;
/// Margin around the sketch, in pixels of the sheet.
const RIM_PX: f64 = 40.0;
/// Fit below which the robot counts as unsure of its position.
const DOUBTFUL: f64 = 0.3;

/// The latest messages about the route, ready to be drawn.
pub struct Lookout {
    radius_m: f64,
    sketched: Option<Sketched>,
    walls: Option<Walls>,
    view: Option<Box<LandmarkView>>,
    progress: Option<Box<LandmarkProgress>>,
}

impl Lookout {
    /// Creates a lookout for this robot.
    pub fn new(robot: &Robot) -> Self {
        Self { radius_m: robot.radius_m, sketched: None, walls: None, view: None, progress: None }
    }
}

impl lookout::Lookout for Lookout {
    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), Denied> {
        // An unreadable route is not drawn. The stages that drive by it report the error.
        if message.on(LANDMARK_ROUTE)?.is_some()
            && let Ok(instructions) = Instructions::read(message.cells())
        {
            let sketched = Sketched::of(&instructions);
            (self.walls, self.sketched) = (Some(sketched.walls()), Some(sketched));
        }
        if let Some(view) = message.on(LANDMARK_VIEW)? {
            self.view = Some(Box::new(*view));
        }
        if let Some(progress) = message.on(LANDMARK_PROGRESS)? {
            self.progress = Some(Box::new(*progress));
        }
        Ok(())
    }

    fn sheet(&self) -> Sheet {
        Sheet::Drawing(self.sketched.as_ref().map(|sketched| sketched.size_px))
    }

    fn take_walls(&mut self) -> Option<Walls> {
        self.walls.take()
    }

    fn draw(&mut self, picture: &mut Picture) {
        let Some((sketched, view)) = self.sketched.as_ref().zip(self.view.as_deref()) else { return };
        picture.robot = sketched.robot(view, self.radius_m);
        if let Some(progress) = &self.progress {
            picture.shapes.extend(sketched.plan(progress));
            picture.words = sketched.words(progress);
        }
        picture.shapes.push(Shape::Dots { points: sketched.places(view), color: Color::Scan });
        if let Some(progress) = &self.progress {
            picture.shapes.extend(sketched.objects(view, progress, self.radius_m));
        }
    }
}

/// Returns the stretch of the sketch around the robot. A view without a sketch may have none.
fn stretch(view: &LandmarkView) -> Stretch {
    Stretch(view.stretch.max(0.1))
}

/// A route, laid out on the sheet.
struct Sketched {
    /// Width and height of the sheet.
    size_px: [u32; 2],
    route: Option<Route>,
    /// The drawn route, and the outlines of objects.
    line: Vec<Point<Drawn>>,
    outlines: Vec<Vec<Point<Drawn>>>,
    /// Lower left corner of the drawing.
    low: Point<Drawn>,
    pixels_per_m: f64,
}

impl Sketched {
    /// Lays out a route. Without a sketch, the robot stays in the middle of the sheet.
    fn of(instructions: &Instructions) -> Self {
        let route = instructions.route().ok().flatten();
        let points = || {
            let sketch = instructions.sketch.iter();
            sketch.flat_map(|sketch| {
                sketch.route.iter().chain(sketch.landmarks.iter().flat_map(|one| &one.outline))
            })
        };
        let [low, high] = match points().next() {
            Some(_) => plane::bounds(points()),
            None => [Point::new(-5.0, -5.0), Point::new(5.0, 5.0)],
        };
        let extent = [high.x - low.x, high.y - low.y];
        let pixels_per_m = (SHEET_PX - 2.0 * RIM_PX) / extent[0].max(extent[1]).max(0.1);
        let size_px = extent.map(|side| (side * pixels_per_m + 2.0 * RIM_PX).ceil() as u32);
        let sketch = instructions.sketch.as_ref();
        let line = sketch.map_or(Vec::new(), |sketch| sketch.route.clone());
        let landmarks = sketch.map_or(&[][..], |sketch| &sketch.landmarks);
        let outlines = landmarks.iter().map(|one| one.outline.clone()).collect();
        Self { size_px, route, line, outlines, low, pixels_per_m }
    }

    /// Converts a drawn length to pixels of the sheet.
    fn pixels(&self, DrawnMetres(length): DrawnMetres) -> f64 {
        length * self.pixels_per_m
    }

    /// Converts a point of the sketch to pixels of the sheet.
    fn point(&self, at: &Point<Drawn>) -> [f64; 2] {
        [at.x - self.low.x, at.y - self.low.y].map(|v| v * self.pixels_per_m + RIM_PX)
    }

    /// Returns the outlines as a grid.
    fn walls(&self) -> Walls {
        let [width, height] = self.size_px.map(|side| side as usize);
        let mut cells = vec![0; width * height];
        for [a, b] in self.outlines.iter().flat_map(|outline| plane::edges(outline)) {
            let steps = self.pixels(DrawnMetres::between(&a, &b)).ceil().max(1.0);
            for i in 0..=steps as usize {
                let [x, y] = self.point(&a.towards(&b, i as f64 / steps));
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let (column, row) = (x as usize + dx, (y as usize).saturating_sub(dy));
                    if column < width && row < height {
                        cells[row * width + column] = WALL;
                    }
                }
            }
        }
        Walls { size_px: self.size_px, cells }
    }

    /// Returns the estimated pose of the robot on the sheet, or `None` if there is no sketch.
    fn robot(&self, view: &LandmarkView, radius_m: f64) -> Option<Whereabouts> {
        let pose = view.in_sketch();
        let spread = self.pixels(DrawnMetres(view.spread_m)) * std::f64::consts::SQRT_2;
        (!self.line.is_empty()).then(|| Whereabouts {
            at: self.point(&pose.position()),
            heading_rad: pose.yaw_rad,
            ellipse: [spread, spread, 0.0],
            radius: self.pixels(stretch(view).drawn(radius_m)),
            tracking: if view.fit < DOUBTFUL { Tracking::Doubtful } else { Tracking::Tracking },
            effective: view.fit,
        })
    }

    /// Returns the position on the sheet of something that the robot sees.
    fn seen(&self, view: &LandmarkView, seen: Point<Base>) -> [f64; 2] {
        let pose = view.in_sketch();
        let (sin, cos) = pose.yaw_rad.sin_cos();
        let [ahead, left] = [seen.x, seen.y].map(|length_m| stretch(view).drawn(length_m).0);
        self.point(&Point::new(pose.x + ahead * cos - left * sin, pose.y + ahead * sin + left * cos))
    }

    /// Returns the remembered positions on the sheet.
    fn places(&self, view: &LandmarkView) -> Vec<[f64; 2]> {
        thinned(view.places().iter()).map(|place| self.seen(view, place.map(f64::from).into())).collect()
    }

    /// Returns the part of the drawn route that lies ahead.
    fn plan(&self, progress: &LandmarkProgress) -> Option<Shape> {
        let driven = DrawnMetres(progress.along_m);
        let mut along = DrawnMetres::default();
        let mut points: Vec<[f64; 2]> = Vec::new();
        for pair in self.line.windows(2) {
            along = along + DrawnMetres::between(&pair[0], &pair[1]);
            if along >= driven {
                points.push(self.point(&pair[1]));
            }
        }
        let line = Shape::Line { points, color: Color::Plan, stroke: Stroke::Dashed };
        (!self.line.is_empty()).then_some(line)
    }

    /// Returns what the range sensors see: rings, and discs for objects that meet the relevant state.
    fn objects(&self, view: &LandmarkView, progress: &LandmarkProgress, radius_m: f64) -> [Shape; 2] {
        let [mut seen, mut met] = [Vec::new(), Vec::new()];
        for (i, object) in view::objects(view).enumerate() {
            // An object that surrounds the robot has no direction.
            let Some(direction) = object.place.direction() else { continue };
            let direction_rad = f64::from(direction) * std::f64::consts::FRAC_PI_8;
            let far = object.proximity_m + radius_m;
            let is_met = progress.met().iter().any(|met| met.object as usize == i);
            let at = self.seen(view, polar(direction_rad, far));
            if is_met { met.push(at) } else { seen.push(at) }
        }
        [Shape::Rings { points: seen, color: Color::Goal }, Shape::Discs { points: met, color: Color::Goal }]
    }

    /// Describes the robot's progress along its route in words.
    fn words(&self, progress: &LandmarkProgress) -> Vec<String> {
        let command = RouteCommand::from_code(progress.command).map_or("", RouteCommand::word);
        let mut words = vec![match progress.state_count {
            0 => command.to_owned(),
            count => format!("{command} until state {} of {count}", progress.next + 1),
        }];
        if progress.length_m > 0.0 {
            let share = (progress.along_m / progress.length_m).clamp(0.0, 1.0);
            words.push(format!("{:.0} % of the route", 100.0 * share));
        }
        let met = self.route.as_ref().map_or(Vec::new(), |route| view::met(route, progress));
        if !met.is_empty() {
            words.push(format!("seen: {}", met.join(", ")));
        }
        words
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;
    use sketchnav_stage::lookout::Lookout as _;

    use super::*;
    use crate::sketch::{Landmark, Sketch};

    fn instructions() -> Instructions {
        let outline = [[4.0, 1.0], [6.0, 1.0], [6.0, 3.0], [4.0, 3.0]].map(Point::from).into();
        let landmarks = vec![Landmark { name: "desk".into(), outline }];
        let route = [[0.0, 0.0], [5.0, 0.0], [10.0, 0.0]].map(Point::from).into();
        let sketch = Sketch { landmarks, route, metres_per_pixel: 0.1 };
        let words = "When the desk is left, then turn left.\nAt the end, stop.\n".to_owned();
        Instructions { sketch: Some(sketch), words, markers: Vec::new() }
    }

    fn robot() -> Robot {
        Robot::parse(include_str!("../../../../sim/robots/nomad200.toml")).unwrap()
    }

    #[test]
    fn the_sketch_fills_the_sheet_and_its_outlines_are_walls() {
        let sketched = Sketched::of(&instructions());
        let Walls { size_px, cells } = sketched.walls();
        assert_eq!((size_px, cells.len()), ([1000, 356], 1000 * 356));
        let [x, y] = sketched.point(&Point::new(4.0, 2.0)).map(|v| v as usize);
        assert!(cells[y * 1000 + x] == WALL && cells[y * 1000 + x + 50] == 0);
    }

    #[test]
    fn what_meets_the_state_is_marked_and_named() {
        let robot = robot();
        let mut view = LandmarkView::zeroed();
        (view.in_sketch.orientation_w, view.in_sketch.x_m, view.stretch, view.fit) = (1.0, 5.0, 1.0, 0.8);
        (view.object_count, view.objects[0].place, view.objects[0].proximity_m) =
            (1, 4, 1.0 - robot.radius_m);
        let mut progress = LandmarkProgress::zeroed();
        (progress.next, progress.state_count, progress.met_count) = (1, 3, 1);
        (progress.along_m, progress.length_m) = (5.0, 10.0);
        let mut lookout = Lookout::new(&robot);
        (lookout.view, lookout.progress) = (Some(Box::new(view)), Some(Box::new(progress)));
        lookout.sketched = Some(Sketched::of(&instructions()));
        let mut picture = Picture::default();
        lookout.draw(&mut picture);
        let [x, y] = lookout.sketched.as_ref().unwrap().point(&Point::new(5.0, 1.0));
        let [.., Shape::Rings { points: seen, .. }, Shape::Discs { points: met, .. }] = &picture.shapes[..]
        else {
            panic!("{picture:?}")
        };
        assert!(seen.is_empty() && (met[0][0] - x).hypot(met[0][1] - y) < 1e-9, "{met:?}");
        assert!(picture.words[0].ends_with(" until state 2 of 3"), "{:?}", picture.words);
        assert_eq!(picture.words[1..], ["50 % of the route", "seen: desk"]);
        assert_eq!(picture.robot.unwrap().tracking, Tracking::Tracking);
        let Shape::Line { points, .. } = &picture.shapes[0] else { panic!("{picture:?}") };
        assert_eq!(points.len(), 2);
    }
}

//! Draws a route past landmarks for a page: the sketch, the robot's position along the route, the objects, and the matched state.
//! If the robot is lost, it offers the positions where the robot may be.

use std::f64::consts::FRAC_PI_8;

use sketchnav_schemas::codes::{Tracking, WALL};
use sketchnav_schemas::geometry::{Base, Point};
use sketchnav_schemas::robot::Robot;
use sketchnav_stage::lookout::{self, Color, Picture, Shape, Sheet, Stroke, Walls, Whereabouts, thinned};
use sketchnav_stage::{Denied, Incoming};

use crate::alternatives::{self, Surroundings};
use crate::belief::{Beam, Believing};
use crate::drawn::{Drawn, DrawnMetres, Stretch};
use crate::error::Pixel;
use crate::instructions::Instructions;
use crate::memory::polar;
use crate::messages::{
    LANDMARK_PROGRESS, LANDMARK_ROUTE, LANDMARK_VIEW, LandmarkProgress, LandmarkView, RouteCommand,
};
use crate::outlines::Outlines;
use crate::plane;
use crate::route::Route;
use crate::sketch::Sketch;
use crate::view;

/// Longer side of the grid on which outlines are painted, in cells.
const GRID_PX: f64 = 1000.0;
/// Side length of the sheet for a route in words, both in pixels and in metres.
const EMPTY_PX: u32 = 1000;
const EMPTY_M: f64 = 10.0;
/// Fit below which the robot counts as unsure of its position.
const DOUBTFUL: f64 = 0.3;

/// Draws the latest messages about the route.
pub struct Lookout {
    radius_m: f64,
    /// Parameters of the belief if the robot drives by its pose in the sketch, which a person can then correct, or else `None`.
    by_position: Option<Believing>,
    sketched: Option<Sketched>,
    walls: Option<Walls>,
    view: Option<Box<LandmarkView>>,
    progress: Option<Box<LandmarkProgress>>,
    /// Positions offered in the question to a person. Set from when the robot is lost until it drives on.
    question: Option<Vec<[f64; 2]>>,
}

impl Lookout {
    /// Creates a lookout for a robot. `by_position` is set if the robot drives by its pose in the sketch.
    pub fn new(robot: &Robot, by_position: Option<Believing>) -> Self {
        Self {
            radius_m: robot.radius_m,
            by_position,
            sketched: None,
            walls: None,
            view: None,
            progress: None,
            question: None,
        }
    }

    /// Returns the positions on the sheet where the robot may be, as far as it can tell. If there are none, it may be anywhere.
    fn places(&self, settings: &Believing) -> Vec<[f64; 2]> {
        let Some((sketched, view)) = self.sketched.as_ref().zip(self.view.as_deref()) else {
            return Vec::new();
        };
        let Some(sketch) = &sketched.sketch else { return Vec::new() };
        let echoes: Vec<_> = view.places().iter().map(|place| place.map(f64::from).into()).collect();
        let beam = |(i, range_m): (usize, &f64)| Beam {
            angle_rad: FRAC_PI_8 * i as f64,
            range_m: range_m + self.radius_m,
        };
        let beams: Vec<_> = view.sectors_m.iter().enumerate().map(beam).collect();
        let along = DrawnMetres(self.progress.as_ref().map_or(0.0, |progress| progress.along_m));
        let known = Surroundings { estimate: view::estimate(view), along, echoes: &echoes, beams: &beams };
        let places = alternatives::places(&Outlines::of(sketch), settings, &known);
        places.iter().map(|place| sketched.point(place)).collect()
    }
}

impl lookout::Lookout for Lookout {
    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), Denied> {
        // An unreadable route is not drawn. The stages that drive by it report the error.
        if message.on(LANDMARK_ROUTE)?.is_some()
            && let Ok(instructions) = Instructions::read(message.cells())
        {
            let sketched = Sketched::of(&instructions);
            let walls = painted(&sketched.outlines(), sketched.size_px.map(f64::from));
            // Earlier messages refer to another sketch.
            (self.view, self.progress, self.question) = (None, None, None);
            (self.walls, self.sketched) = (Some(walls), Some(sketched));
        }
        if let Some(view) = message.on(LANDMARK_VIEW)? {
            self.view = Some(Box::new(*view));
        }
        if let Some(progress) = message.on(LANDMARK_PROGRESS)? {
            self.progress = Some(Box::new(*progress));
            match self.by_position.filter(|_| progress.is_lost > 0) {
                None => self.question = None,
                // The robot is standing still, so the positions stay the same.
                Some(settings) if self.question.is_none() => self.question = Some(self.places(&settings)),
                Some(_) => {}
            }
        }
        Ok(())
    }

    fn sheet(&self) -> Sheet {
        Sheet::Drawing(self.sketched.as_ref().map(|sketched| sketched.size_px))
    }

    fn take_walls(&mut self) -> Option<Walls> {
        self.walls.take()
    }

    /// Asks a person where the robot is, if it is lost and drives by its pose in the sketch.
    fn question(&self) -> Option<Vec<[f64; 2]>> {
        self.question.clone()
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

/// Paints outlines, in pixels of a canvas of this width and height, as a grid whose longer side has [`GRID_PX`] cells.
pub(crate) fn painted(outlines: &[Vec<Pixel>], canvas: [f64; 2]) -> Walls {
    let scale = GRID_PX / canvas[0].max(canvas[1]).max(1.0);
    let size_px = canvas.map(|side| (side * scale).ceil().max(1.0) as u32);
    let [width, height] = size_px.map(|side| side as usize);
    let mut cells = vec![0; width * height];
    for [a, b] in outlines.iter().flat_map(|outline| plane::edges(outline)) {
        let steps = (a.distance(&b) * scale).ceil().max(1.0);
        for i in 0..=steps as usize {
            let at = a.towards(&b, i as f64 / steps);
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let (column, row) =
                    ((at.x * scale) as usize + dx, ((at.y * scale) as usize).saturating_sub(dy));
                if column < width && row < height {
                    cells[row * width + column] = WALL;
                }
            }
        }
    }
    Walls { size_px, cells }
}

/// Returns the stretch of the sketch around the robot, at least 0.1. A view without a sketch may contain 0.
fn stretch(view: &LandmarkView) -> Stretch {
    Stretch(view.stretch.max(0.1))
}

/// A route and its position on the sheet.
struct Sketched {
    /// Width and height of the sheet.
    size_px: [u32; 2],
    route: Option<Route>,
    sketch: Option<Sketch>,
    /// Position of the sketch's origin on the sheet, in pixels.
    origin_px: [f64; 2],
    pixels_per_m: f64,
}

impl Sketched {
    /// Lays out a route. Without a sketch, the robot stays in the middle of the sheet.
    fn of(instructions: &Instructions) -> Self {
        let route = instructions.route().ok().flatten();
        let sketch = instructions.sketch.as_ref();
        let (size_px, pixels_per_m, origin_px) = match sketch.zip(instructions.canvas) {
            Some((sketch, canvas)) => {
                (canvas.map(|side| side.ceil() as u32), 1.0 / sketch.metres_per_pixel, [0.0; 2])
            }
            None => ([EMPTY_PX; 2], f64::from(EMPTY_PX) / EMPTY_M, [f64::from(EMPTY_PX) / 2.0; 2]),
        };
        Self { size_px, route, sketch: sketch.cloned(), origin_px, pixels_per_m }
    }

    /// Returns the drawn route.
    fn line(&self) -> &[Point<Drawn>] {
        self.sketch.as_ref().map_or(&[], |sketch| &sketch.route)
    }

    /// Converts a drawn length to pixels of the sheet.
    fn pixels(&self, DrawnMetres(length): DrawnMetres) -> f64 {
        length * self.pixels_per_m
    }

    /// Converts a point of the sketch to pixels of the sheet.
    fn point(&self, at: &Point<Drawn>) -> [f64; 2] {
        let [x, y] = self.origin_px;
        [x + at.x * self.pixels_per_m, y + at.y * self.pixels_per_m]
    }

    /// Returns the outlines on the sheet.
    fn outlines(&self) -> Vec<Vec<Pixel>> {
        let landmarks = self.sketch.iter().flat_map(|sketch| &sketch.landmarks);
        landmarks.map(|one| one.outline.iter().map(|at| self.point(at).into()).collect()).collect()
    }

    /// Returns the estimated pose of the robot on the sheet, or `None` if there is no sketch.
    fn robot(&self, view: &LandmarkView, radius_m: f64) -> Option<Whereabouts> {
        let pose = view.in_sketch();
        let spread = self.pixels(DrawnMetres(view.spread_m)) * std::f64::consts::SQRT_2;
        (!self.line().is_empty()).then(|| Whereabouts {
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
        for pair in self.line().windows(2) {
            along = along + DrawnMetres::between(&pair[0], &pair[1]);
            if along >= driven {
                points.push(self.point(&pair[1]));
            }
        }
        let line = Shape::Line { points, color: Color::Plan, stroke: Stroke::Dashed };
        (!self.line().is_empty()).then_some(line)
    }

    /// Returns what the range sensors see: rings, with discs for objects that meet the relevant state.
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
    use sketchnav_schemas::codes::Process;
    use sketchnav_stage::Access;
    use sketchnav_stage::lookout::Lookout as _;

    use super::*;
    use crate::sketch::{Landmark, Sketch};

    fn instructions() -> Instructions {
        let outline = [[4.0, 1.0], [6.0, 1.0], [6.0, 3.0], [4.0, 3.0]].map(Point::from).into();
        let landmarks = vec![Landmark { name: "desk".into(), outline }];
        let route = [[0.0, 0.0], [5.0, 0.0], [10.0, 0.0]].map(Point::from).into();
        let sketch = Sketch { landmarks, route, metres_per_pixel: 0.1 };
        let words = "When the desk is left, then turn left.\nAt the end, stop.\n".to_owned();
        Instructions { sketch: Some(sketch), words, canvas: Some([100.0, 40.0]), markers: Vec::new() }
    }

    fn robot() -> Robot {
        Robot::parse(include_str!("../../../../sim/robots/nomad200.toml")).unwrap()
    }

    #[test]
    fn the_sheet_is_the_canvas_and_outlines_are_walls() {
        let sketched = Sketched::of(&instructions());
        assert_eq!(sketched.size_px, [100, 40]);
        assert_eq!(sketched.point(&Point::new(4.0, 2.0)), [40.0, 20.0]);
        let Walls { size_px, cells } = painted(&sketched.outlines(), [100.0, 40.0]);
        assert_eq!((size_px, cells.len()), ([1000, 400], 1000 * 400));
        assert!(cells[200 * 1000 + 400] == WALL && cells[200 * 1000 + 450] == 0);
    }

    /// The question used to depend on the single message sent when the robot became lost, so a pad that was restarted at that
    /// moment never asked.
    #[test]
    fn a_robot_that_is_lost_asks_whichever_message_arrives_first() {
        let mut lookout = Lookout::new(&robot(), None);
        let access = Access::new(Process::Pad, crate::mission::KIND);
        let mut tell = |is_lost, is_by_position: bool| {
            let progress = LandmarkProgress { is_lost, ..LandmarkProgress::zeroed() };
            lookout.by_position = is_by_position.then(Believing::default);
            let message = bytemuck::bytes_of(&progress);
            lookout.receive(&Incoming::new(&access, LANDMARK_PROGRESS.spec, message, &[])).unwrap();
            lookout.question()
        };
        assert_eq!(tell(1, true), Some(Vec::new()));
        assert_eq!(tell(1, false), None, "landmark states have no position to be told");
        assert_eq!(tell(0, true), None, "it has been told");
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
        let mut lookout = Lookout::new(&robot, Some(Believing::default()));
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

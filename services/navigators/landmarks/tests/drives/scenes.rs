//! The two scenes of Chronis 2007, figure 5.2. The figures are lost. Scene A is reconstructed from the relations of figure
//! 4.29, which give its commands and the positions of files, table, trash, crate, cabinet and boxes. Scene B is reconstructed
//! from its six commands. The coordinates are pixels of the PDA, 5 inches each.

use sketchnav_landmarks::drawn::Drawn;
use sketchnav_landmarks::plane::resample;
use sketchnav_landmarks::sketch::{Landmark, Sketch};
use sketchnav_schemas::geometry::{Point, Pose, World};

use crate::world::Object;

pub const PIXEL_M: f64 = 0.127;

/// A scene, with its goal and the route that people had in mind.
pub struct Scene {
    pub objects: Vec<Object>,
    pub goal: &'static str,
    pub start: Pose<World>,
    /// The route, made of straight pieces and quarter circles.
    pub way: Vec<Point<World>>,
    /// Sketches by careful people, as many as in the thesis.
    pub sketches: Vec<&'static str>,
    /// As many sketches by careless people: scaled by 0.72 to 1.08, sides stretched by 0.86 to 1.16, and objects moved by a metre.
    pub coarse: Vec<&'static str>,
}

fn object((name, [x, y, width, height]): (&'static str, [f64; 4])) -> Object {
    let [w, h] = [width / 2.0, height / 2.0];
    let corners = [[x - w, y - h], [x + w, y - h], [x + w, y + h], [x - w, y + h]];
    Object { name, outline: corners.map(pixels).to_vec() }
}

/// Converts pixels of the PDA to a point of the world.
fn pixels([x, y]: [f64; 2]) -> Point<World> {
    Point::new(x * PIXEL_M, y * PIXEL_M)
}

/// Returns the corresponding point of a drawing without errors.
pub fn exactly(at: &Point<World>) -> Point<Drawn> {
    Point::new(at.x, at.y)
}

/// Builds a route from pieces, each of which is a distance straight ahead followed by a quarter circle: 1 for left, −1 for right, 0
/// for none.
fn way(pieces: &[(f64, f64, f64)]) -> Vec<Point<World>> {
    let (mut at, mut heading) = ([0.0, 0.0], 0.0_f64);
    let mut points = vec![at];
    for (straight, side, radius) in pieces {
        at = [at[0] + straight * heading.cos(), at[1] + straight * heading.sin()];
        points.push(at);
        let steps = 30;
        for _ in 0..if *side == 0.0 { 0 } else { steps } {
            let turn = side * std::f64::consts::FRAC_PI_2 / f64::from(steps);
            let chord = 2.0 * radius * (turn / 2.0).sin().abs();
            heading += turn / 2.0;
            at = [at[0] + chord * heading.cos(), at[1] + chord * heading.sin()];
            heading += turn / 2.0;
            points.push(at);
        }
    }
    points.into_iter().map(pixels).collect()
}

fn scene(
    objects: &[(&'static str, [f64; 4])],
    pieces: &[(f64, f64, f64)],
    [sketches, coarse]: [Vec<&'static str>; 2],
) -> Scene {
    Scene {
        objects: objects.iter().copied().map(object).collect(),
        goal: "desk",
        start: Pose::new(0.0, 0.0, 0.0),
        way: way(pieces),
        sketches,
        coarse,
    }
}

macro_rules! drawings {
    ($set:literal, $($number:literal),*) => {
        vec![$(include_str!(concat!("../../../../../sim/missions/landmarks/sketches/", $set, "-", $number, ".json"))),*]
    };
}

/// Scene A with eight commands: forward, left, forward, right, forward, right, forward, stop.
pub fn scene_a() -> Scene {
    scene(
        &[
            ("chair", [-9.0, 0.0, 6.0, 6.0]),
            ("files", [32.0, -12.0, 8.0, 8.0]),
            ("table", [86.0, 22.0, 18.0, 14.0]),
            ("crate", [30.0, 19.0, 8.0, 8.0]),
            ("trash", [42.0, 66.0, 10.0, 12.0]),
            ("boxes", [72.0, 98.0, 10.0, 8.0]),
            ("cabinet", [112.0, 80.0, 12.0, 10.0]),
            ("desk", [120.0, -2.0, 18.0, 10.0]),
        ],
        &[(20.0, 1.0, 28.0), (8.0, -1.0, 28.0), (16.0, -1.0, 28.0), (26.0, 0.0, 0.0)],
        [
            drawings!("a", "01", "02", "03", "04", "05", "06", "07", "08", "09", "10", "11"),
            drawings!("careless-a", "01", "02", "03", "04", "05", "06", "07", "08", "09", "10", "11"),
        ],
    )
}

/// Scene B with six commands: forward, left, forward, right, forward, stop.
pub fn scene_b() -> Scene {
    scene(
        &[
            ("chair", [-9.0, 0.0, 6.0, 6.0]),
            ("cabinet", [62.0, -4.0, 12.0, 14.0]),
            ("table", [24.0, 26.0, 16.0, 12.0]),
            ("boxes", [82.0, 34.0, 12.0, 12.0]),
            ("trash", [48.0, 63.0, 10.0, 8.0]),
            ("files", [92.0, 82.0, 12.0, 8.0]),
            ("desk", [115.0, 62.0, 10.0, 18.0]),
        ],
        &[(26.0, 1.0, 28.0), (6.0, -1.0, 28.0), (22.0, 0.0, 0.0)],
        [
            drawings!("b", "01", "02", "03", "04", "05", "06", "07", "08", "09"),
            drawings!("careless-b", "01", "02", "03", "04", "05", "06", "07", "08", "09"),
        ],
    )
}

impl Scene {
    /// Returns the scene itself as a sketch, with the true route. In the thesis, a simulated robot draws this (5.2.3).
    pub fn as_sketch(&self) -> Sketch {
        let line = |line: &[Point<World>]| line.iter().map(exactly).collect::<Vec<_>>();
        let landmark =
            |object: &Object| Landmark { name: object.name.into(), outline: line(&object.outline) };
        Sketch {
            landmarks: self.objects.iter().map(landmark).collect(),
            route: resample(&line(&self.way), 4.0 * PIXEL_M),
            metres_per_pixel: PIXEL_M,
        }
    }
}

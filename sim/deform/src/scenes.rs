//! Sketches of scenes of objects, with the kinds of deformations that people make. The sketches are not to scale, and objects are
//! shifted, turned, too large, too small, or forgotten. The route is redrawn so that it passes the objects as drawn, then bent and
//! smoothed.
//!
//! At degree 0, the scene is traced. At degree 1, objects are about 0.5 m out of position, and other degrees are in proportion. If
//! outlines touch or the route enters one, the scene is redrawn, because people would not draw that on purpose. After several
//! attempts, all shifts become smaller. Equal scenes, degrees and seeds result in equal sketches.
//!
//! [`hasty`] draws like a person in a hurry, who cuts corners, and [`SceneSketch::on_a_pda`] converts a
//! sketch to whole pixels of a PDA.

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use serde_json::json;
use sketchnav_schemas::seed;
use sketchnav_sim::scenes::{At, Scene, apart, distance, distance_to, middle};

/// Standard deviations at degree 1: of the logarithms of the overall scale, of the overall aspect, and of the size and the aspect
/// of an object; and of the position (in metres) and the heading (in radians) of an object.
const SCALE: f64 = 0.12;
const ASPECT: f64 = 0.08;
const SIZE: f64 = 0.2;
const OBJECT_ASPECT: f64 = 0.12;
const SHIFT_M: f64 = 0.35;
const TURN_RAD: f64 = 0.2;
/// Probability at degree 1 that an object is forgotten, and minimum number of objects that are drawn.
const FORGOTTEN: f64 = 0.12;
const LEAST_OBJECTS: usize = 4;
/// Deviation of the route, and length over which its corners are smoothed, both in metres.
const BEND_M: f64 = 0.2;
const SMOOTH_M: f64 = 0.8;
/// Length over which people in a hurry smooth the corners of a route: its median, in metres, and the standard deviation of its
/// logarithm.
const HASTE_M: f64 = 1.5;
const HASTE_SPREAD: f64 = 0.8;
/// Width of a PDA's screen, in pixels, and size of a pixel, in metres: 5 inches (Chronis 2007, 4.3.2).
const PDA_PX: f64 = 160.0;
const PDA_PIXEL_M: f64 = 0.127;
/// Standard deviation of a trembling pen, in metres.
const TREMBLE_M: f64 = 0.015;
/// Minimum distance between outlines, and between the route and outlines, in metres.
const BETWEEN_M: f64 = 0.2;
const BESIDE_ROUTE_M: f64 = 0.3;
/// Number of attempts after which shifts become smaller.
const ATTEMPTS: usize = 20;
/// Scale of the file's canvas, in pixels per metre.
const PIXELS_PER_M: f64 = 50.0;
/// Margin around the drawing, in metres.
const RIM_M: f64 = 1.0;

/// A sketch of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneSketch {
    /// The drawn objects: their indices in the scene, and their outlines, in metres.
    pub objects: Vec<(usize, Vec<At>)>,
    /// The drawn route, in metres.
    pub route: Vec<At>,
    names: Vec<String>,
    tremble_m: f64,
    seed: u64,
}

fn normal(rng: &mut Pcg64Mcg) -> f64 {
    StandardNormal.sample(rng)
}

/// Draws a scene.
pub fn sketch(scene: &Scene, degree: f64, mission_seed: u64) -> SceneSketch {
    let mut rng = seed::stream(mission_seed, "deform/scene");
    drawn(scene, &Hand { degree, smooth_m: SMOOTH_M * degree }, mission_seed, &mut rng)
}

/// Draws a scene like a person in a hurry, who cuts corners. If corners are cut a lot, two turns to the same
/// side merge into one.
pub fn hasty(scene: &Scene, degree: f64, mission_seed: u64) -> SceneSketch {
    let mut rng = seed::stream(mission_seed, "deform/hasty scene");
    let smooth_m = HASTE_M * (HASTE_SPREAD * normal(&mut rng)).exp();
    drawn(scene, &Hand { degree, smooth_m }, mission_seed, &mut rng)
}

/// How a person draws.
struct Hand {
    degree: f64,
    /// Length of the route over which its corners are smoothed, in metres.
    smooth_m: f64,
}

fn drawn(scene: &Scene, hand: &Hand, mission_seed: u64, rng: &mut Pcg64Mcg) -> SceneSketch {
    let mut shifts = 1.0;
    loop {
        for _ in 0..ATTEMPTS {
            let drawn = attempt(scene, hand, shifts, rng);
            if drawn.holds() {
                let tremble_m = TREMBLE_M * hand.degree.min(1.0);
                return SceneSketch { tremble_m, seed: mission_seed, ..drawn };
            }
        }
        shifts *= 0.8;
    }
}

fn attempt(scene: &Scene, hand: &Hand, shifts: f64, rng: &mut Pcg64Mcg) -> SceneSketch {
    let degree = hand.degree;
    let scale = (SCALE * degree * normal(rng)).exp();
    let aspect = (ASPECT * degree * normal(rng)).exp();
    let whole = |[x, y]: At| [x * scale * aspect, y * scale / aspect];
    let mut drawn = Vec::new();
    let mut moves = Vec::new();
    for (i, object) in scene.objects.iter().enumerate() {
        let at = middle(&object.outline);
        let shift = [0, 1].map(|_| SHIFT_M * degree * shifts * normal(rng));
        let size = (SIZE * degree * shifts * normal(rng)).exp();
        let wide = (OBJECT_ASPECT * degree * shifts * normal(rng)).exp();
        let (sin, cos) = (TURN_RAD * degree * shifts * normal(rng)).sin_cos();
        let is_forgotten = rng.random_range(0.0..1.0) < FORGOTTEN * degree && i != scene.goal;
        if is_forgotten && scene.objects.len() - (i - drawn.len()) > LEAST_OBJECTS {
            continue;
        }
        let to = whole(at);
        let to = [to[0] + shift[0], to[1] + shift[1]];
        let corner = |corner: &At| {
            let [x, y] =
                [(corner[0] - at[0]) * size * wide * scale, (corner[1] - at[1]) * size / wide * scale];
            [to[0] + x * cos - y * sin, to[1] + x * sin + y * cos]
        };
        drawn.push((i, object.outline.iter().map(corner).collect::<Vec<_>>()));
        moves.push((at, shift));
    }
    let hand = Hand { degree: degree * shifts, smooth_m: hand.smooth_m * shifts };
    let route = route(scene, &whole, &moves, &hand, rng);
    let names = scene.objects.iter().map(|object| object.name.clone()).collect();
    SceneSketch { objects: drawn, route, names, tremble_m: 0.0, seed: 0 }
}

/// Draws the route of a scene: moved along with the objects next to it, bent and smoothed.
fn route(
    scene: &Scene,
    whole: &impl Fn(At) -> At,
    moves: &[(At, At)],
    &Hand { degree, smooth_m }: &Hand,
    rng: &mut Pcg64Mcg,
) -> Vec<At> {
    let length = scene.path_m();
    let waves: Vec<_> = (1..=3)
        .map(|n| {
            let [x, y] = [0, 1].map(|_| BEND_M * degree * normal(rng) / f64::from(n));
            (f64::from(n), rng.random_range(0.0..std::f64::consts::TAU), [x, y])
        })
        .collect();
    let mut along = 0.0;
    let mut last = scene.way[0];
    let bent: Vec<At> = scene
        .way
        .iter()
        .map(|at| {
            along += distance(last, *at);
            last = *at;
            let weights = moves.iter().map(|(from, _)| 1.0 / (0.5 + distance(*from, *at).powi(2)));
            let sum: f64 = weights.clone().sum();
            let mut to = whole(*at);
            for (axis, value) in to.iter_mut().enumerate() {
                let moved: f64 = weights.clone().zip(moves).map(|(weight, (_, by))| weight * by[axis]).sum();
                let wave = |(n, phase, by): &(f64, f64, At)| {
                    by[axis] * (std::f64::consts::PI * n * along / length + phase).sin()
                };
                *value += moved / sum + waves.iter().map(wave).sum::<f64>();
            }
            to
        })
        .collect();
    let half = (smooth_m / 0.1 / 2.0) as usize;
    let mean = |i: usize| {
        // The ends of the route stay in place.
        let half = half.min(i).min(bent.len() - 1 - i);
        middle(&bent[i - half..=i + half])
    };
    (0..bent.len()).map(mean).collect()
}

impl SceneSketch {
    fn holds(&self) -> bool {
        let is_clear =
            |outline: &[At]| self.route.iter().all(|at| distance_to(outline, *at) >= BESIDE_ROUTE_M);
        self.objects.iter().enumerate().all(|(i, (_, outline))| {
            is_clear(outline) && self.objects[..i].iter().all(|(_, other)| apart(other, outline) >= BETWEEN_M)
        })
    }

    /// Returns the root mean square distance, in metres, between the drawn objects and their positions under the best similarity.
    pub fn shift_m(&self, scene: &Scene) -> f64 {
        let pairs: Vec<_> = self
            .objects
            .iter()
            .map(|(i, outline)| (middle(&scene.objects[*i].outline), middle(outline)))
            .collect();
        let centre = |of: fn(&(At, At)) -> At| middle(&pairs.iter().map(of).collect::<Vec<_>>());
        let [from, to] = [centre(|pair| pair.0), centre(|pair| pair.1)];
        // Compute the similarity as a complex number, the least-squares solution of to ≈ factor · from.
        let (mut re, mut im, mut squares) = (0.0, 0.0, 0.0);
        let off = |at: At, middle: At| [at[0] - middle[0], at[1] - middle[1]];
        for (a, b) in &pairs {
            let ([ax, ay], [bx, by]) = (off(*a, from), off(*b, to));
            re += ax * bx + ay * by;
            im += ax * by - ay * bx;
            squares += ax * ax + ay * ay;
        }
        let (re, im) = (re / squares, im / squares);
        let left = pairs.iter().map(|(a, b)| {
            let ([ax, ay], b) = (off(*a, from), off(*b, to));
            distance([ax * re - ay * im, ax * im + ay * re], b).powi(2)
        });
        (left.sum::<f64>() / pairs.len() as f64).sqrt()
    }

    /// Returns the length, in metres, of the longer side of the file's canvas at the scale of the scene.
    pub fn canvas_m(&self) -> f64 {
        let [low, high] = self.bounds();
        (high[0] - low[0]).max(high[1] - low[1])
    }

    fn bounds(&self) -> [At; 2] {
        let points = || self.route.iter().chain(self.objects.iter().flat_map(|(_, outline)| outline));
        let low = [0, 1].map(|axis| points().map(|at| at[axis]).fold(f64::INFINITY, f64::min) - RIM_M);
        let high = [0, 1].map(|axis| points().map(|at| at[axis]).fold(f64::NEG_INFINITY, f64::max) + RIM_M);
        [low, high]
    }

    /// Returns the sketch as the file of a PDA: strokes in whole pixels, centred on the screen, at the drawing's own scale. Returns
    /// `None` if the sketch does not fit on the screen.
    pub fn on_a_pda(&self) -> Option<String> {
        let points = || self.route.iter().chain(self.objects.iter().flat_map(|(_, outline)| outline));
        let ends = [0, 1].map(|axis| {
            let values = || points().map(move |at| at[axis]);
            [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)]
        });
        if ends.iter().any(|[low, high]| (high - low) / PDA_PIXEL_M >= PDA_PX - 1.0) {
            return None;
        }
        let pixel = |at: &At| {
            let [x, y] =
                [0, 1].map(|axis| (at[axis] - f64::midpoint(ends[axis][0], ends[axis][1])) / PDA_PIXEL_M);
            [x, -y].map(|off| (off + PDA_PX / 2.0).round() as i32)
        };
        let line = |line: &[At]| stroke(line.iter().map(pixel).collect());
        let closed = |outline: &[At]| dense(&[outline, &outline[..1]].concat());
        let mut strokes: Vec<_> = self.objects.iter().map(|(_, outline)| line(&closed(outline))).collect();
        strokes.push(line(&self.route));
        let label = |(i, outline): &(usize, Vec<At>)| json!({ "text": self.names[*i], "at": pixel(&middle(outline)) });
        let labels: Vec<_> = self.objects.iter().map(label).collect();
        Some(json!({ "canvas": [PDA_PX, PDA_PX], "strokes": strokes, "labels": labels }).to_string())
    }

    /// Returns the sketch as a file of strokes, drawn by an unsteady hand, with labels.
    pub fn file(&self) -> String {
        let mut rng = seed::stream(self.seed, "deform/scene pen");
        let [low, high] = self.bounds();
        let tremble = self.tremble_m;
        let pixel = |at: At, rng: &mut Pcg64Mcg| {
            let [x, y] = [0, 1].map(|axis| at[axis] + tremble * normal(rng));
            [(x - low[0]) * PIXELS_PER_M, (high[1] - y) * PIXELS_PER_M].map(|x| (x * 10.0).round() / 10.0)
        };
        let canvas = [0, 1].map(|axis| (high[axis] - low[axis]) * PIXELS_PER_M);
        let mut strokes = Vec::new();
        let mut labels = Vec::new();
        for (i, outline) in &self.objects {
            let closed: Vec<_> = outline.iter().chain(outline.first()).copied().collect();
            let points: Vec<_> = dense(&closed).into_iter().map(|at| pixel(at, &mut rng)).collect();
            strokes.push(json!({ "points": points }));
            labels.push(json!({ "text": self.names[*i], "at": pixel(middle(outline), &mut rng) }));
        }
        let points: Vec<_> = self.route.iter().step_by(2).map(|at| pixel(*at, &mut rng)).collect();
        strokes.push(json!({ "points": points }));
        json!({ "canvas": canvas, "strokes": strokes, "labels": labels }).to_string()
    }
}

/// Returns a stroke as JSON, without repeated points.
fn stroke(mut points: Vec<[i32; 2]>) -> serde_json::Value {
    points.dedup();
    json!({ "points": points })
}

/// Returns a line with additional points, so that they are at most 0.15 m apart.
fn dense(line: &[At]) -> Vec<At> {
    const STEP_M: f64 = 0.15;
    let mut points = Vec::new();
    for pair in line.windows(2) {
        let steps = (distance(pair[0], pair[1]) / STEP_M).ceil().max(1.0);
        for i in 0..steps as usize {
            let part = i as f64 / steps;
            points.push([0, 1].map(|axis| pair[0][axis] + part * (pair[1][axis] - pair[0][axis])));
        }
    }
    points.extend(line.last());
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean_shift_m(degree: f64) -> f64 {
        let scenes = [Scene::a(), Scene::b()];
        let shifts = scenes
            .iter()
            .flat_map(|scene| (0..20).map(move |seed| sketch(scene, degree, seed).shift_m(scene)));
        shifts.sum::<f64>() / 40.0
    }

    #[test]
    fn degree_0_traces_and_others_shift_in_proportion() {
        let scene = Scene::a();
        let traced = sketch(&scene, 0.0, 5);
        assert_eq!(traced.objects.len(), scene.objects.len());
        assert!(traced.objects.iter().all(|(i, outline)| {
            outline.iter().zip(&scene.objects[*i].outline).all(|(a, b)| distance(*a, *b) < 1e-9)
        }));
        let shifts = [0.0, 0.5, 1.0, 1.5].map(mean_shift_m);
        println!("shifts: {shifts:?} m");
        assert!(shifts.is_sorted() && shifts[0] < 1e-6 && (0.3..0.8).contains(&shifts[2]), "{shifts:?}");
    }

    #[test]
    fn hurried_sketches_cut_corners() {
        let scene = Scene::a();
        let length = |sketch: &SceneSketch| -> f64 {
            sketch.route.windows(2).map(|pair| distance(pair[0], pair[1])).sum()
        };
        let mut lengths: Vec<_> = (0..40).map(|seed| length(&hasty(&scene, 0.0, seed))).collect();
        lengths.sort_by(f64::total_cmp);
        assert!(lengths[39] <= scene.path_m() + 1e-6 && lengths[0] < 0.97 * scene.path_m(), "{lengths:?}");
    }

    #[test]
    fn a_sketch_on_a_pda_is_rounded_to_its_pixels() {
        let scene = Scene::b();
        let drawn = sketch(&scene, 0.0, 1);
        let file: serde_json::Value = serde_json::from_str(&drawn.on_a_pda().unwrap()).unwrap();
        let strokes = file["strokes"].as_array().unwrap();
        assert_eq!((strokes.len(), &file["canvas"]), (scene.objects.len() + 1, &json!([160.0, 160.0])));
        let points = |stroke: &serde_json::Value| -> Vec<[i32; 2]> {
            serde_json::from_value(stroke["points"].clone()).unwrap()
        };
        assert!(strokes.iter().flat_map(points).flatten().all(|pixel| (0..160).contains(&pixel)));
        // The chair is 6 pixels wide.
        let columns: Vec<_> = points(&strokes[0]).iter().map(|[column, _]| *column).collect();
        assert_eq!(columns.iter().max().unwrap() - columns.iter().min().unwrap(), 6);
        let large = SceneSketch { route: vec![[0.0, 0.0], [21.0, 0.0]], ..drawn };
        assert_eq!(large.on_a_pda(), None);
    }

    #[test]
    fn a_sketch_keeps_its_goal_and_its_route_free() {
        for scene in Scene::twelve(1) {
            for seed in 0..5 {
                let drawn = sketch(&scene, 1.5, seed);
                assert!(
                    drawn.objects.iter().any(|(i, _)| *i == scene.goal) && drawn.holds(),
                    "{}",
                    scene.name
                );
                assert_eq!(drawn, sketch(&scene, 1.5, seed));
            }
        }
    }
}

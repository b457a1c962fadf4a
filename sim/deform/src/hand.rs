//! Lines drawn by hand, which wobble and run past corners or end short of them.

use std::f64::consts::TAU;

use nalgebra::Vector2;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use sketchnav_schemas::geometry::{Point, Sketch};

use crate::doors::{Wall, WallEnd, shorten};

/// Spacing of the points of a stroke, in pixels.
const STEP_PX: f64 = 8.0;
/// Wobbles at degree 1: for each, the root mean square amplitude and the range of wavelengths, in pixels.
const WOBBLES: [(f64, [f64; 2]); 3] = [(1.6, [300.0, 700.0]), (0.9, [90.0, 200.0]), (0.3, [25.0, 50.0])];
/// Length by which a stroke overshoots a corner at degree 1 (negative if it ends short of it): mean and standard deviation, in pen
/// widths.
const PAST_CORNER: (f64, f64) = (0.2, 0.5);
/// Maximum gap at a corner, in pen widths. A person would notice a wider gap and close it.
const GAP_PENS: f64 = 0.6;
/// Share of corners drawn without lifting the pen at degree 1.
const ROUND_CORNER: f64 = 0.4;
/// Minimum angle of a corner in a line, in radians.
const CORNER_RAD: f64 = 0.6;
/// Minimum width of a door, in pen widths. A narrower one would not be recognized as a door.
const DOOR_PENS: f64 = 3.5;
/// Minimum share of a wall that remains when the door next to it is widened.
const STUB: f64 = 0.3;
/// Spread of the pen's width from stroke to stroke at degree 1.
const PRESSURE: f64 = 0.1;

/// A stroke of the pen, in the drawing's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Stroke {
    /// Points of the stroke, in pixels.
    pub points: Vec<Point<Sketch>>,
    /// Width of the stroke, in pixels.
    pub width_px: f64,
}

/// Widens narrow doors. `walls` are in pixels.
pub(crate) fn widen_doors(walls: &mut [Wall], doors: &[[WallEnd; 2]], pen_px: f64) {
    for [a, b] in doors {
        let [p, q] = [a, b].map(|&(wall, end)| end_of(&walls[wall], end));
        let missing = DOOR_PENS * pen_px - (q - p).norm();
        if missing <= 0.0 {
            continue;
        }
        let spare = [a, b].map(|&(wall, _)| walls[wall].length() * (1.0 - STUB));
        let first = (missing / 2.0).min(spare[0]).max(missing - spare[1]);
        for (&(wall, end), by) in [a, b].into_iter().zip([first, missing - first]) {
            let most = (1.0 - STUB) * walls[wall].length();
            shorten(&mut walls[wall].points, end, by.clamp(0.0, most));
        }
    }
}

fn end_of(wall: &Wall, end: usize) -> Vector2<f64> {
    if end == 0 { wall.points[0] } else { wall.points[wall.points.len() - 1] }
}

/// Draws a wall, whose points are in pixels, with one or more strokes.
pub(crate) fn draw(wall: &Wall, degree: f64, pen_px: f64, rng: &mut Pcg64Mcg) -> Vec<Stroke> {
    if degree == 0.0 {
        let points = wall.points.iter().map(|p| Point::from(*p)).collect();
        return vec![Stroke { points, width_px: pen_px }];
    }
    let mut lines = at_corners(&wall.points, degree, rng);
    let last = lines.len() - 1;
    for (i, line) in lines.iter_mut().enumerate() {
        let at_door = [i == 0 && wall.jambs[0], i == last && wall.jambs[1]];
        past_corners(line, at_door, degree, pen_px, rng);
    }
    let stroke = |line: Vec<Vector2<f64>>| {
        let width_px = pen_px * (1.0 + PRESSURE * degree * normal(rng)).clamp(0.7, 1.4);
        Stroke { points: wobbled(&line, degree, rng), width_px }
    };
    lines.into_iter().map(stroke).collect()
}

/// Splits a wall at the corners where the pen is lifted.
fn at_corners(points: &[Vector2<f64>], degree: f64, rng: &mut Pcg64Mcg) -> Vec<Vec<Vector2<f64>>> {
    let mut lines = vec![vec![points[0]]];
    for i in 1..points.len() {
        if let Some(line) = lines.last_mut() {
            line.push(points[i]);
        }
        let turns = i + 1 < points.len() && turn(points[i - 1], points[i], points[i + 1]) > CORNER_RAD;
        if turns && !rng.random_bool((ROUND_CORNER * degree).min(1.0)) {
            lines.push(vec![points[i]]);
        }
    }
    lines
}

fn turn(a: Vector2<f64>, b: Vector2<f64>, c: Vector2<f64>) -> f64 {
    let (u, v) = (b - a, c - b);
    u.perp(&v).atan2(u.dot(&v)).abs()
}

fn past_corners(line: &mut [Vector2<f64>], at_door: [bool; 2], degree: f64, pen_px: f64, rng: &mut Pcg64Mcg) {
    let last = line.len() - 1;
    for (end, at, inner) in [(0, 0, 1), (1, last, last - 1)] {
        let (mean, spread) = PAST_CORNER;
        let past = (degree * (mean + spread * normal(rng))).max(-GAP_PENS) * pen_px;
        let way = line[at] - line[inner];
        if !at_door[end] && way.norm() > 4.0 * pen_px {
            line[at] += way * (past / way.norm());
        }
    }
}

/// Returns the points of a line, displaced by a few slow waves that fade towards its ends.
fn wobbled(line: &[Vector2<f64>], degree: f64, rng: &mut Pcg64Mcg) -> Vec<Point<Sketch>> {
    let waves = WOBBLES.map(|(amplitude, [shortest, longest])| {
        let length = rng.random_range(shortest..longest);
        (std::f64::consts::SQRT_2 * amplitude * degree, length, rng.random_range(0.0..TAU))
    });
    let total: f64 = line.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
    let aside = |at: f64| {
        let fade = (at.min(total - at) / 40.0).clamp(0.0, 1.0);
        fade * waves.iter().map(|(high, long, phase)| high * (TAU * at / long + phase).sin()).sum::<f64>()
    };
    let mut points = vec![line[0]];
    let mut from = 0.0;
    for pair in line.windows(2) {
        let (way, length) = (pair[1] - pair[0], (pair[1] - pair[0]).norm());
        let count = (length / STEP_PX).ceil().max(1.0) as usize;
        let side = Vector2::new(-way.y, way.x) / length.max(1e-9);
        for i in 1..=count {
            let share = i as f64 / count as f64;
            points.push(pair[0] + way * share + side * aside(from + share * length));
        }
        from += length;
    }
    points.into_iter().map(Point::from).collect()
}

fn normal(rng: &mut Pcg64Mcg) -> f64 {
    StandardNormal.sample(rng)
}

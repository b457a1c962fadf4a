//! Candidates for the rotation between two maps: those by which the directions of the walls coincide.
//!
//! The Hough spectrum of a map says for each direction how much of its walls lies on common lines of that direction. Unlike the
//! lines, it depends neither on the position of the map nor, much, on which part of a building the map shows. The rotations are the
//! maxima of the circular cross-correlation of the two spectra (Carpin 2008, section 4.1). Since a line has no sense of direction,
//! each of them is also tried with half a turn.

use std::f64::consts::PI;

/// Number of directions of a spectrum, which covers half a turn.
const DIRECTIONS: usize = 360;
/// Distance between lines, in metres.
const LINE_M: f64 = 0.1;
/// Minimum correlation of a maximum, relative to the best one.
const LEAST: f64 = 0.4;
/// Maximum number of maxima. In most buildings there are two. A round room has many.
const MOST: usize = 16;

/// Returns the rotations from the other map's points to those of the first one, the best one first, in radians.
pub fn candidates(first: &[[f64; 2]], other: &[[f64; 2]]) -> Vec<f64> {
    let (fixed, moved) = (spectrum(first), spectrum(other));
    let correlation: Vec<f64> = (0..DIRECTIONS)
        .map(|turn| (0..DIRECTIONS).map(|k| moved[k] * fixed[(k + turn) % DIRECTIONS]).sum())
        .collect();
    let at = |turn: usize| correlation[turn % DIRECTIONS];
    let is_peak = |&turn: &usize| at(turn) >= at(turn + 1) && at(turn) > at(turn + DIRECTIONS - 1);
    let mut peaks: Vec<usize> = (0..DIRECTIONS).filter(is_peak).collect();
    peaks.sort_by(|a, b| at(*b).total_cmp(&at(*a)));
    let best = peaks.first().map_or(0.0, |turn| at(*turn));
    peaks.retain(|turn| at(*turn) >= LEAST * best);
    peaks.truncate(MOST);
    let step = PI / DIRECTIONS as f64;
    let rotation = |turn: usize| {
        // The maximum of the parabola through the peak and its neighbours.
        let [before, here, after] = [DIRECTIONS - 1, 0, 1].map(|by| at(turn + by));
        let off = 0.5 * (before - after) / (before - 2.0 * here + after);
        (turn as f64 + if off.is_finite() { off } else { 0.0 }) * step
    };
    peaks.into_iter().flat_map(|turn| [rotation(turn), rotation(turn) + PI]).collect()
}

/// Returns the Hough spectrum of points, less its mean.
fn spectrum(points: &[[f64; 2]]) -> Vec<f64> {
    let reach_m = points.iter().map(|[x, y]| x.hypot(*y)).fold(0.0, f64::max);
    let lines = (2.0 * reach_m / LINE_M) as usize + 2;
    let mut on_line = vec![0.0_f64; lines];
    let mut spectrum: Vec<f64> = (0..DIRECTIONS)
        .map(|k| {
            let (sin, cos) = (PI * k as f64 / DIRECTIONS as f64).sin_cos();
            on_line.fill(0.0);
            for [x, y] in points {
                // Each point belongs to the two nearest lines, so that the spectrum does not depend on where the lines begin.
                let at = (cos * y - sin * x + reach_m) / LINE_M;
                let line = (at as usize).min(lines - 2);
                let share = (at - line as f64).min(1.0);
                on_line[line] += 1.0 - share;
                on_line[line + 1] += share;
            }
            on_line.iter().map(|count| count * count).sum()
        })
        .collect();
    let mean = spectrum.iter().sum::<f64>() / DIRECTIONS as f64;
    spectrum.iter_mut().for_each(|value| *value -= mean);
    spectrum
}

//! Lines and outlines in the plane: lengths, resampling, crossings.

use sketchnav_schemas::geometry::encloses;

/// A place: x and y.
pub type At = [f64; 2];

/// The distance of two places.
pub fn distance(a: At, b: At) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

/// The length of a line.
pub fn length(line: &[At]) -> f64 {
    line.windows(2).map(|pair| distance(pair[0], pair[1])).sum()
}

/// The place between two, at a part of the way.
pub fn between(a: At, b: At, part: f64) -> At {
    [a[0] + (b[0] - a[0]) * part, a[1] + (b[1] - a[1]) * part]
}

/// The direction from one place to another, in radians.
pub fn direction(from: At, to: At) -> f64 {
    (to[1] - from[1]).atan2(to[0] - from[0])
}

/// A line in equal steps of about the length given, from its first to its last point. It has at least two points if
/// the line has two.
pub fn resample(line: &[At], step: f64) -> Vec<At> {
    let total = length(line);
    let [first, .., last] = line else { return line.to_vec() };
    let steps = (total / step).round().max(1.0);
    let mut points = vec![*first];
    let (mut walked, mut next) = (0.0, total / steps);
    for pair in line.windows(2) {
        let long = distance(pair[0], pair[1]);
        while next <= walked + long && (points.len() as f64) < steps {
            points.push(between(pair[0], pair[1], (next - walked) / long));
            next = total / steps * points.len() as f64;
        }
        walked += long;
    }
    points.push(*last);
    points
}

/// The extent of points along both axes.
pub fn extent(points: &[At]) -> [f64; 2] {
    [0, 1].map(|axis| {
        let values = || points.iter().map(|at| at[axis]);
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
    })
}

/// The area of an outline, without a sign.
pub fn area(outline: &[At]) -> f64 {
    let next = outline.iter().cycle().skip(1);
    let twice: f64 = outline.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum();
    (twice / 2.0).abs()
}

/// The edges of an outline; the last goes from the last point to the first.
pub fn edges(outline: &[At]) -> impl Iterator<Item = [At; 2]> + Clone {
    let next = outline.iter().cycle().skip(1);
    outline.iter().zip(next).map(|(from, to)| [*from, *to])
}

/// How far along a line the point of it is that is nearest to a place.
pub fn nearest_along(line: &[At], at: At) -> f64 {
    let (mut before, mut best) = (0.0, (f64::INFINITY, 0.0));
    for pair in line.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        let (along, off) = ([to[0] - from[0], to[1] - from[1]], [at[0] - from[0], at[1] - from[1]]);
        let length = distance(from, to);
        let square = length * length;
        let part = if square > 0.0 { (along[0] * off[0] + along[1] * off[1]) / square } else { 0.0 };
        let part = part.clamp(0.0, 1.0);
        let off = distance(between(from, to, part), at);
        if off < best.0 {
            best = (off, before + part * length);
        }
        before += length;
    }
    best.1
}

/// The distance of a place to a segment.
pub fn distance_to_segment(at: At, [from, to]: [At; 2]) -> f64 {
    let (along, off) = ([to[0] - from[0], to[1] - from[1]], [at[0] - from[0], at[1] - from[1]]);
    let square = along[0] * along[0] + along[1] * along[1];
    let part =
        if square > 0.0 { ((off[0] * along[0] + off[1] * along[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
    (off[0] - part * along[0]).hypot(off[1] - part * along[1])
}

/// The distance of a place to what an outline is around, 0 inside.
pub fn distance_to_outline(at: At, outline: &[At]) -> f64 {
    if encloses(outline, at) {
        return 0.0;
    }
    edges(outline).map(|edge| distance_to_segment(at, edge)).fold(f64::INFINITY, f64::min)
}

/// Where two segments meet, as parts of the way along each. `None` for parallel ones.
pub fn crossing([a, b]: [At; 2], [c, d]: [At; 2]) -> Option<(f64, f64)> {
    let cross = |p: At, q: At| p[0] * q[1] - p[1] * q[0];
    let minus = |p: At, q: At| [p[0] - q[0], p[1] - q[1]];
    let (ab, cd, ac) = (minus(b, a), minus(d, c), minus(c, a));
    let turn = cross(ab, cd);
    let (s, t) = (cross(ac, cd) / turn, cross(ac, ab) / turn);
    let is_within = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
    is_within.then_some((s, t))
}

/// Where an outline crosses itself: the numbers of the two edges, and the place.
pub fn self_crossing(outline: &[At]) -> Option<(usize, usize, At)> {
    let count = outline.len();
    for (i, one) in edges(outline).enumerate() {
        for (j, other) in edges(outline).enumerate().skip(i + 2) {
            if (j + 1) % count != i
                && let Some((part, _)) = crossing(one, other)
            {
                return Some((i, j, between(one[0], one[1], part)));
            }
        }
    }
    None
}

/// The convex hull of points, counter-clockwise (Andrew 1979).
pub fn hull(points: &[At]) -> Vec<At> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    sorted.dedup();
    let turns_left =
        |a: At, b: At, c: At| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0;
    let chain = |points: &mut dyn Iterator<Item = At>| {
        let mut chain: Vec<At> = Vec::new();
        for at in points {
            while chain.len() > 1 && !turns_left(chain[chain.len() - 2], chain[chain.len() - 1], at) {
                chain.pop();
            }
            chain.push(at);
        }
        chain.pop();
        chain
    };
    let lower = chain(&mut sorted.iter().copied());
    let upper = chain(&mut sorted.iter().rev().copied());
    [lower, upper].concat()
}

/// Where two outlines cross, or where one is in the other.
pub fn outlines_meet(one: &[At], other: &[At]) -> Option<At> {
    for a in edges(one) {
        for b in edges(other) {
            if let Some((part, _)) = crossing(a, b) {
                return Some(between(a[0], a[1], part));
            }
        }
    }
    let inside = |outer: &[At], inner: &[At]| encloses(outer, inner[0]).then_some(inner[0]);
    inside(one, other).or_else(|| inside(other, one))
}

/// Where a segment first meets an outline, or its start where that is inside.
pub fn enters(from: At, to: At, outline: &[At]) -> Option<At> {
    if encloses(outline, from) {
        return Some(from);
    }
    let parts = edges(outline).filter_map(|edge| crossing([from, to], edge)).map(|(part, _)| part);
    parts.min_by(f64::total_cmp).map(|part| between(from, to, part))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_equal_along_the_line() {
        let line = [[0.0, 0.0], [0.1, 0.0], [3.0, 0.0], [3.0, 4.0]];
        let steps = resample(&line, 1.0);
        let expected: Vec<_> =
            (0..=3).map(|i| [f64::from(i), 0.0]).chain((1..=4).map(|i| [3.0, f64::from(i)])).collect();
        for (found, expected) in steps.iter().zip(&expected) {
            assert!(distance(*found, *expected) < 1e-12, "{found:?}, {expected:?}");
        }
        assert_eq!(steps.len(), 8);
        assert_eq!(resample(&[[0.0, 0.0], [0.2, 0.0]], 1.0), [[0.0, 0.0], [0.2, 0.0]]);
        assert_eq!(resample(&[[1.0, 1.0]], 1.0), [[1.0, 1.0]]);
    }

    #[test]
    fn a_bow_tie_crosses_itself() {
        let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        assert_eq!(self_crossing(&square), None);
        let tie = [square[0], square[2], square[1], square[3]];
        assert!(distance(self_crossing(&tie).unwrap().2, [1.0, 1.0]) < 1e-12);
        assert_eq!(hull(&[&tie[..], &[[1.0, 1.0], [1.0, 0.0]]].concat()), square);
        assert_eq!(area(&square), 4.0);
        assert_eq!(enters([-1.0, 1.0], [3.0, 1.0], &square), Some([0.0, 1.0]));
        assert_eq!(enters([1.0, 1.0], [3.0, 1.0], &square), Some([1.0, 1.0]));
        assert_eq!(enters([-1.0, 3.0], [3.0, 3.0], &square), None);
        assert_eq!(distance_to_outline([5.0, 2.0], &square), 3.0);
    }

    #[test]
    fn outlines_meet_where_they_cross_or_one_is_inside() {
        let square = |x: f64, side: f64| [[x, 0.0], [x + side, 0.0], [x + side, side], [x, side]].to_vec();
        assert_eq!(outlines_meet(&square(0.0, 1.0), &square(2.0, 1.0)), None);
        assert!(outlines_meet(&square(0.0, 2.0), &square(1.0, 2.0)).is_some());
        let inner = [[0.5, 0.5], [0.6, 0.5], [0.6, 0.6]];
        assert_eq!(outlines_meet(&square(0.0, 1.0), &inner), Some([0.5, 0.5]));
    }
}

//! Plane geometry of lines and outlines: lengths, resampling and crossings. Lengths are in the unit of the
//! points' frame.

use sketchnav_schemas::geometry::{Point, encloses};

/// Returns the length of a polyline.
pub fn length<F>(line: &[Point<F>]) -> f64 {
    line.windows(2).map(|pair| pair[0].distance(&pair[1])).sum()
}

/// Resamples a line from its first to its last point in equal steps of approximately `step`. The result has at least two points
/// if the line does.
pub fn resample<F>(line: &[Point<F>], step: f64) -> Vec<Point<F>> {
    let total = length(line);
    let [first, .., last] = line else { return line.to_vec() };
    let steps = (total / step).round().max(1.0);
    let mut points = vec![*first];
    let (mut walked, mut next) = (0.0, total / steps);
    for pair in line.windows(2) {
        let long = pair[0].distance(&pair[1]);
        while next <= walked + long && (points.len() as f64) < steps {
            points.push(pair[0].towards(&pair[1], (next - walked) / long));
            next = total / steps * points.len() as f64;
        }
        walked += long;
    }
    points.push(*last);
    points
}

/// Returns the point at a given length along the line, or the end of the line if it is shorter than that.
pub fn at_length<F>(line: &[Point<F>], length: f64) -> Point<F> {
    let mut left = length;
    for pair in line.windows(2) {
        let step = pair[0].distance(&pair[1]);
        if left <= step && step > 0.0 {
            return pair[0].towards(&pair[1], left / step);
        }
        left -= step;
    }
    line[line.len() - 1]
}

/// Returns the minimum and the maximum coordinates of points along both axes. Without points, they are +∞ and −∞.
pub fn bounds<'a, F: 'a>(points: impl Iterator<Item = &'a Point<F>>) -> [Point<F>; 2] {
    const NONE: f64 = f64::INFINITY;
    points.fold([Point::new(NONE, NONE), Point::new(-NONE, -NONE)], |[low, high], at| {
        [Point::new(low.x.min(at.x), low.y.min(at.y)), Point::new(high.x.max(at.x), high.y.max(at.y))]
    })
}

/// Returns the extent of points along both axes.
pub fn extent<F>(points: &[Point<F>]) -> [f64; 2] {
    let [low, high] = bounds(points.iter());
    [high.x - low.x, high.y - low.y]
}

/// Returns the area of an outline, which is positive in both orientations.
pub fn area<F>(outline: &[Point<F>]) -> f64 {
    let twice: f64 = edges(outline).map(|[a, b]| a.x * b.y - a.y * b.x).sum();
    (twice / 2.0).abs()
}

/// Returns the edges of an outline, including the one from the last point to the first.
pub fn edges<F>(outline: &[Point<F>]) -> impl Iterator<Item = [Point<F>; 2]> + Clone {
    let next = outline.iter().cycle().skip(1);
    outline.iter().zip(next).map(|(from, to)| [*from, *to])
}

/// Returns the position of the point of a segment nearest to `at`, from 0 at the start to 1 at the end.
fn nearest_part<F>(at: Point<F>, [from, to]: [Point<F>; 2]) -> f64 {
    let (along, off) = (to.coords() - from.coords(), at.coords() - from.coords());
    let square = along.dot(&along);
    if square > 0.0 { (along.dot(&off) / square).clamp(0.0, 1.0) } else { 0.0 }
}

/// Returns the length along a line from its start to the point of the line nearest to `at`.
pub fn nearest_along<F>(line: &[Point<F>], at: Point<F>) -> f64 {
    let (mut before, mut best) = (0.0, (f64::INFINITY, 0.0));
    for pair in line.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        let (length, part) = (from.distance(&to), nearest_part(at, [from, to]));
        let off = from.towards(&to, part).distance(&at);
        if off < best.0 {
            best = (off, before + part * length);
        }
        before += length;
    }
    best.1
}

/// Returns the distance from a point to a segment.
pub fn distance_to_segment<F>(at: Point<F>, segment: [Point<F>; 2]) -> f64 {
    let [from, to] = segment.map(|end| end.coords());
    let left = at.coords() - from - (to - from) * nearest_part(at, segment);
    left.x.hypot(left.y)
}

/// Returns the distance from a point to the area within an outline, which is 0 inside.
pub fn distance_to_outline<F>(at: Point<F>, outline: &[Point<F>]) -> f64 {
    if encloses(outline, at) {
        return 0.0;
    }
    edges(outline).map(|edge| distance_to_segment(at, edge)).fold(f64::INFINITY, f64::min)
}

/// Returns the position on each of two segments where they cross, from 0 to 1, or `None` if they do not cross or are parallel.
pub fn crossing<F>([a, b]: [Point<F>; 2], [c, d]: [Point<F>; 2]) -> Option<(f64, f64)> {
    let [ab, cd, ac] = [(a, b), (c, d), (a, c)].map(|(from, to)| to.coords() - from.coords());
    let turn = ab.perp(&cd);
    let (s, t) = (ac.perp(&cd) / turn, ac.perp(&ab) / turn);
    let is_within = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
    is_within.then_some((s, t))
}

/// Returns the first self-intersection found in an outline, as the indices of the two edges and the point.
pub fn self_crossing<F>(outline: &[Point<F>]) -> Option<(usize, usize, Point<F>)> {
    let count = outline.len();
    for (i, one) in edges(outline).enumerate() {
        for (j, other) in edges(outline).enumerate().skip(i + 2) {
            if (j + 1) % count != i
                && let Some((part, _)) = crossing(one, other)
            {
                return Some((i, j, one[0].towards(&one[1], part)));
            }
        }
    }
    None
}

/// Returns the convex hull of points, counter-clockwise, by Andrew's algorithm (1979).
pub fn hull<F>(points: &[Point<F>]) -> Vec<Point<F>> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    sorted.dedup_by(|a, b| (a.x, a.y) == (b.x, b.y));
    let turns_left = |a: Point<F>, b: Point<F>, c: Point<F>| {
        (b.coords() - a.coords()).perp(&(c.coords() - a.coords())) > 0.0
    };
    let chain = |points: &mut dyn Iterator<Item = Point<F>>| {
        let mut chain: Vec<Point<F>> = Vec::new();
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

/// Returns a point where two outlines cross or, if one lies inside the other, a point of the inner one.
pub fn outlines_meet<F>(one: &[Point<F>], other: &[Point<F>]) -> Option<Point<F>> {
    for a in edges(one) {
        for b in edges(other) {
            if let Some((part, _)) = crossing(a, b) {
                return Some(a[0].towards(&a[1], part));
            }
        }
    }
    let inside = |outer: &[Point<F>], inner: &[Point<F>]| encloses(outer, inner[0]).then_some(inner[0]);
    inside(one, other).or_else(|| inside(other, one))
}

/// Returns the point where a segment first meets an outline, or the start of the segment if it is inside.
pub fn enters<F>(from: Point<F>, to: Point<F>, outline: &[Point<F>]) -> Option<Point<F>> {
    if encloses(outline, from) {
        return Some(from);
    }
    let parts = edges(outline).filter_map(|edge| crossing([from, to], edge)).map(|(part, _)| part);
    parts.min_by(f64::total_cmp).map(|part| from.towards(&to, part))
}

#[cfg(test)]
mod tests {
    use sketchnav_schemas::geometry::World;

    use super::*;

    type At = Point<World>;

    fn points<const N: usize>(places: [[f64; 2]; N]) -> [At; N] {
        places.map(At::from)
    }

    #[test]
    fn steps_are_equal_along_the_line() {
        let line = points([[0.0, 0.0], [0.1, 0.0], [3.0, 0.0], [3.0, 4.0]]);
        let steps = resample(&line, 1.0);
        let expected: Vec<_> = (0..=3)
            .map(|i| At::new(f64::from(i), 0.0))
            .chain((1..=4).map(|i| At::new(3.0, f64::from(i))))
            .collect();
        for (found, expected) in steps.iter().zip(&expected) {
            assert!(found.distance(expected) < 1e-12, "{found:?}, {expected:?}");
        }
        assert_eq!(steps.len(), 8);
        let short = points([[0.0, 0.0], [0.2, 0.0]]);
        assert_eq!(resample(&short, 1.0), short);
        assert_eq!(resample(&short[..1], 1.0), short[..1]);
        assert_eq!([3.5, 9.0].map(|length| at_length(&line, length)), points([[3.0, 0.5], [3.0, 4.0]]));
    }

    #[test]
    fn a_bow_tie_crosses_itself() {
        let square = points([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]);
        let at = |x, y| At::new(x, y);
        assert_eq!(self_crossing(&square), None);
        let tie = [square[0], square[2], square[1], square[3]];
        assert!(self_crossing(&tie).unwrap().2.distance(&at(1.0, 1.0)) < 1e-12);
        assert_eq!(hull(&[&tie[..], &[at(1.0, 1.0), at(1.0, 0.0)]].concat()), square);
        assert_eq!(area(&square), 4.0);
        assert_eq!(enters(at(-1.0, 1.0), at(3.0, 1.0), &square), Some(at(0.0, 1.0)));
        assert_eq!(enters(at(1.0, 1.0), at(3.0, 1.0), &square), Some(at(1.0, 1.0)));
        assert_eq!(enters(at(-1.0, 3.0), at(3.0, 3.0), &square), None);
        assert_eq!(distance_to_outline(at(5.0, 2.0), &square), 3.0);
    }

    #[test]
    fn outlines_meet_where_they_cross_or_one_is_inside() {
        let square = |x: f64, side: f64| points([[x, 0.0], [x + side, 0.0], [x + side, side], [x, side]]);
        assert_eq!(outlines_meet(&square(0.0, 1.0), &square(2.0, 1.0)), None);
        assert!(outlines_meet(&square(0.0, 2.0), &square(1.0, 2.0)).is_some());
        let inner = points([[0.5, 0.5], [0.6, 0.5], [0.6, 0.6]]);
        assert_eq!(outlines_meet(&square(0.0, 1.0), &inner), Some(At::new(0.5, 0.5)));
    }
}

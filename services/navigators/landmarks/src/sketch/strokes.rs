//! Interprets each stroke by its shape. Chronis 2007, 3.3, names the four classes but does not say how the PDA's interface told
//! them apart (Bailey 2003), so the rules and numbers are ours:
//!
//! - A stroke smaller than 1.5 % of the canvas is stray.
//! - A stroke that goes back and forth is a deletion of those earlier strokes that it crosses out. If it crosses out nothing,
//!   it is stray.
//! - A stroke whose ends meet around an area is an object. Small loops, such as those of ends that overshoot, are cut off. Open
//!   strokes that meet end to end are joined, since people may draw an object one side at a time.
//! - The longest of the remaining strokes is the route. Strokes of less than a quarter of its length are stray.

use sketchnav_schemas::geometry::{encloses, wrap_angle};

use crate::error::{Error, Pixel};
use crate::plane;

use super::Drawing;

/// Minimum size of a stroke, as a share of the canvas. Smaller marks are stray.
const SMALLEST: f64 = 0.015;
/// Maximum gap between strokes that are joined, as a share of the canvas.
const JOINT: f64 = 0.03;
/// Maximum gap between the ends of an outline, as a share of its length.
const CLOSING: f64 = 0.2;
/// Minimum area of an outline, as a share of its squared length (that of a bar of 1 by 20).
const COMPACT: f64 = 0.011;
/// Minimum number of times that a deletion reverses its direction.
const REVERSALS: usize = 4;
/// Minimum length of a deletion, as a multiple of its extent.
const DENSE: f64 = 2.5;
/// Number of times that a deletion must cross a stroke to delete it.
const CROSSED: usize = 3;
/// Maximum length of a loop that counts as a slip of the pen, as a share of the outline's length.
const LOOP: f64 = 0.3;
/// Maximum size of an outline that counts as a blob if it crosses itself, as a share of the canvas.
const BLOB: f64 = 0.08;
/// Spacing of the corners of an outline, as a share of the canvas: two of the PDA's pixels.
const DENSITY: f64 = 1.0 / 80.0;
/// Minimum length of a line, as a share of the route's length. Shorter lines are stray.
const SHORT: f64 = 0.25;

/// The strokes of a drawing, by class.
#[derive(Debug, Clone, PartialEq)]
pub struct Classified {
    /// Outlines of objects, resampled, without overshooting ends.
    pub outlines: Vec<Vec<Pixel>>,
    /// The route, without the parts inside the objects where it begins and ends.
    pub route: Vec<Pixel>,
    /// Number of stray strokes.
    pub stray: usize,
    /// Number of deleted strokes.
    pub deleted: usize,
}

/// A line of one or more joined strokes, with the number of the first one, from 0.
#[derive(Debug, Clone)]
struct Line {
    number: usize,
    points: Vec<Pixel>,
}

/// Classifies the strokes of a drawing.
///
/// # Errors
/// - [`Error::NoRoute`] if there is no open line.
/// - [`Error::SeveralRoutes`] if more than one line qualifies as the route.
/// - [`Error::NoObjects`] if there is no outline.
pub fn classify(drawing: &Drawing) -> Result<Classified, Error> {
    let Marks { outlines, mut open, mut stray, deleted } = marks(drawing);
    open.sort_by(|a, b| plane::length(&b.points).total_cmp(&plane::length(&a.points)));
    let mut open = open.into_iter();
    let Some(route) = open.next() else { return Err(Error::NoRoute { objects: outlines.len(), stray }) };
    for other in open {
        if plane::length(&other.points) > SHORT * plane::length(&route.points) {
            let (first, second) = (route.number + 1, other.number + 1);
            return Err(Error::SeveralRoutes { first, second, at: other.points[0] });
        }
        stray += 1;
    }
    if outlines.is_empty() {
        return Err(Error::NoObjects);
    }
    let route = between_objects(&route.points, &outlines);
    if route.len() < 2 {
        return Err(Error::NoRoute { objects: outlines.len(), stray });
    }
    Ok(Classified { outlines, route, stray, deleted })
}

/// Returns the outlines of the objects in a drawing that may have no route.
pub fn outlines(drawing: &Drawing) -> Vec<Vec<Pixel>> {
    marks(drawing).outlines
}

/// The strokes of a drawing, before one of them is selected as the route.
struct Marks {
    outlines: Vec<Vec<Pixel>>,
    open: Vec<Line>,
    stray: usize,
    deleted: usize,
}

fn marks(drawing: &Drawing) -> Marks {
    let canvas = drawing.canvas[0].max(drawing.canvas[1]);
    let (lines, stray, deleted) = without_deletions(drawing, canvas);
    let (closed, open): (Vec<_>, Vec<_>) = lines.into_iter().partition(|line| is_outline(&line.points));
    let (joined, open) = join(open, JOINT * canvas);
    let mut closed: Vec<_> = closed.into_iter().chain(joined).collect();
    closed.sort_by_key(|line| line.number);
    Marks {
        outlines: closed.iter().map(|line| outline(&line.points, canvas)).collect(),
        open,
        stray,
        deleted,
    }
}

/// Returns the lines that are neither stray nor deletions nor deleted, and the numbers of stray and of deleted strokes.
fn without_deletions(drawing: &Drawing, canvas: f64) -> (Vec<Line>, usize, usize) {
    let mut lines: Vec<Line> = Vec::new();
    let (mut stray, mut deleted) = (0, 0);
    for (number, stroke) in drawing.strokes.iter().enumerate() {
        let mut points = stroke.points.clone();
        points.dedup();
        let [width, height] = plane::extent(&points);
        if points.len() < 2 || width.hypot(height) < SMALLEST * canvas {
            stray += 1;
        } else if is_scribble(&points) {
            let before = lines.len();
            lines.retain(|line| !crosses_out(&points, &line.points));
            deleted += before - lines.len();
            stray += usize::from(before == lines.len());
        } else {
            lines.push(Line { number, points });
        }
    }
    (lines, stray, deleted)
}

/// Returns true if a stroke goes back and forth, that is, if its direction reverses often within its extent.
fn is_scribble(points: &[Pixel]) -> bool {
    let [width, height] = plane::extent(points);
    let size = width.hypot(height);
    if plane::length(points) < DENSE * size {
        return false;
    }
    // The steps are short enough to resolve the strokes of a scribble, and long enough to ignore a trembling hand.
    let steps = plane::resample(points, size / 16.0);
    let turns = steps.windows(5).map(|at| {
        let [before, after] = [at[0].direction_rad(&at[2]), at[2].direction_rad(&at[4])];
        wrap_angle(after - before).abs() > 2.0
    });
    // Neighbouring steps detect the same reversal, which must count only once.
    let mut reversals = 0;
    let mut was_turn = false;
    for is_turn in turns {
        reversals += usize::from(is_turn && !was_turn);
        was_turn = is_turn;
    }
    reversals >= REVERSALS
}

fn crosses_out(scribble: &[Pixel], line: &[Pixel]) -> bool {
    let crossings = scribble.windows(2).flat_map(|one| {
        line.windows(2).filter(|other| plane::crossing([one[0], one[1]], [other[0], other[1]]).is_some())
    });
    crossings.take(CROSSED).count() == CROSSED
}

fn is_outline(points: &[Pixel]) -> bool {
    let length = plane::length(points);
    let gap = points[0].distance(&points[points.len() - 1]);
    points.len() > 2 && gap <= CLOSING * length && plane::area(points) >= COMPACT * length * length
}

/// Joins lines that meet end to end. Returns the lines that become outlines, and those that stay open.
fn join(mut lines: Vec<Line>, within: f64) -> (Vec<Line>, Vec<Line>) {
    let mut outlines = Vec::new();
    while let Some((i, j)) = nearest_ends(&lines, within) {
        let second = lines.remove(j);
        let first = lines.remove(i);
        let line = joined(first, second);
        if is_outline(&line.points) { outlines.push(line) } else { lines.push(line) }
    }
    (outlines, lines)
}

fn nearest_ends(lines: &[Line], within: f64) -> Option<(usize, usize)> {
    let ends = |line: &Line| [line.points[0], line.points[line.points.len() - 1]];
    let gap = |i: usize, j: usize| {
        let pairs = ends(&lines[i]).into_iter().flat_map(|a| ends(&lines[j]).map(|b| a.distance(&b)));
        pairs.fold(f64::INFINITY, f64::min)
    };
    let pairs = (0..lines.len()).flat_map(|j| (0..j).map(move |i| (i, j)));
    let gaps = pairs.map(|(i, j)| (gap(i, j), (i, j))).filter(|(gap, _)| *gap <= within);
    gaps.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, pair)| pair)
}

/// Joins two lines that meet, in the direction of the one that was drawn first.
fn joined(first: Line, second: Line) -> Line {
    let (first, second) = if first.number <= second.number { (first, second) } else { (second, first) };
    let number = first.number;
    let ends = |line: &Line| [line.points[0], line.points[line.points.len() - 1]];
    let ([a_start, a_end], [b_start, b_end]) = (ends(&first), ends(&second));
    let gaps = [
        a_end.distance(&b_start),
        a_end.distance(&b_end),
        a_start.distance(&b_end),
        a_start.distance(&b_start),
    ];
    let nearest = (0..4).min_by(|i, j| gaps[*i].total_cmp(&gaps[*j])).unwrap_or(0);
    let mut other = second.points;
    if nearest % 2 == 1 {
        other.reverse();
    }
    let points = if nearest < 2 { [first.points, other].concat() } else { [other, first.points].concat() };
    Line { number, points }
}

/// Removes small loops from an outline: ends that overshoot the meeting point, and loops of a trembling hand.
fn without_loops(points: &[Pixel]) -> Vec<Pixel> {
    let mut outline = points.to_vec();
    // Each round removes at least one point.
    while let Some((i, j, at)) = plane::self_crossing(&outline) {
        let inner = plane::length(&outline[i + 1..=j]);
        let whole = plane::edges(&outline).map(|[from, to]| from.distance(&to)).sum::<f64>();
        if inner.min(whole - inner) > LOOP * whole {
            break;
        }
        if inner < whole / 2.0 {
            outline.splice(i + 1..=j, [at]);
        } else {
            outline = std::iter::once(at).chain(outline[i + 1..=j].iter().copied()).collect();
        }
    }
    outline
}

/// Returns the outline of a closed line. Because resampling can make nearly parallel sections cross, loops are cut off both before
/// and after it. If a small outline still crosses itself, it is a blob, which is replaced by its convex hull.
fn outline(points: &[Pixel], canvas: f64) -> Vec<Pixel> {
    let outline = without_loops(&resample_outline(&without_loops(points), DENSITY * canvas));
    let [width, height] = plane::extent(&outline);
    let is_blob = width.hypot(height) < BLOB * canvas && plane::self_crossing(&outline).is_some();
    if is_blob { plane::hull(&outline) } else { outline }
}

/// Resamples an outline to corners at equal distances.
fn resample_outline(points: &[Pixel], step: f64) -> Vec<Pixel> {
    let closed: Vec<_> = points.iter().chain(&points[..1]).copied().collect();
    let step = step.min(plane::length(&closed) / 8.0);
    let mut outline = plane::resample(&closed, step);
    outline.pop();
    outline
}

/// Returns the part of a route between the object in which it begins and the object in which it ends.
fn between_objects(route: &[Pixel], outlines: &[Vec<Pixel>]) -> Vec<Pixel> {
    let is_inside = |at: &Pixel| outlines.iter().any(|outline| encloses(outline, *at));
    let begin = route.iter().position(|at| !is_inside(at)).unwrap_or(route.len());
    let end = route.iter().rposition(|at| !is_inside(at)).map_or(begin, |last| last + 1);
    route[begin..end].to_vec()
}

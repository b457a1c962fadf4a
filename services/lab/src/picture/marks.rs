//! Symbols on a picture: tasks, trails, the start, contacts and the legend.

use std::collections::BTreeSet;

use sketchnav_schemas::geometry::{Point, Pose};

use super::svg::{GREEN, INK, RED, SHEET_WIDTH, Sheet};
use super::task::{TaskMark, TaskPicture};

/// Colours of successive tasks. They can be distinguished on white, even by most people with colour blindness.
const COLOURS: [&str; 10] = [
    "#2f6fd0", "#e07b16", "#2b9a55", "#c23b8f", "#7a52cc", "#0e9aa7", "#a8641f", "#d14545", "#5b8a00",
    "#5a6b86",
];

/// An entry in the last row of the legend.
#[derive(Debug, Clone, Copy)]
pub enum Symbol {
    /// The start pose.
    Start,
    /// A goal.
    Goal,
    /// A trail with its description.
    Trail(&'static str),
    /// A drawn route.
    Route,
    /// The end of a task that was reached.
    Reached,
    /// The end of a task that failed.
    Failed,
    /// Particles.
    Particles,
    /// Furniture.
    Furniture,
    /// A contact.
    Contact,
    /// A marker.
    Marker,
    /// The field of view of a camera.
    View,
    /// The path of a person.
    Person,
    /// A line with a name and a colour.
    Line(&'static str, &'static str),
}

fn colour(task: usize) -> &'static str {
    COLOURS[task % COLOURS.len()]
}

/// Style of a person's path.
const WAY: &str = "stroke=\"#8a93a3\" stroke-width=\"2\" stroke-dasharray=\"1 6\"";
/// Side length of a square, in metres, within which paths are drawn only once.
const SAME_M: f64 = 0.25;

/// Draws the paths of people, but only once at each place. Otherwise, the dots of a person who walks back and forth would overlap
/// and look like a solid line.
pub fn ways<F>(sheet: &mut Sheet, ways: &[Vec<Point<F>>]) {
    let mut drawn = BTreeSet::new();
    for way in ways {
        first_passes(way, &mut drawn).iter().for_each(|piece| sheet.line(piece, WAY));
    }
}

/// Returns the pieces of a path that lie in squares in which no path has been drawn yet.
fn first_passes<F>(way: &[Point<F>], drawn: &mut BTreeSet<[i64; 2]>) -> Vec<Vec<Point<F>>> {
    let (mut pieces, mut piece) = (Vec::new(), Vec::new());
    let mut last = None;
    for at in way {
        let square = [at.x, at.y].map(|v| (v / SAME_M).floor() as i64);
        let continues = last == Some(square) && !piece.is_empty();
        if drawn.insert(square) || continues {
            piece.push(Point::new(at.x, at.y));
        } else if !piece.is_empty() {
            pieces.push(std::mem::take(&mut piece));
        }
        last = Some(square);
    }
    pieces.extend((!piece.is_empty()).then_some(piece));
    pieces
}

/// Tints the goal area of each task lightly.
pub fn places<F>(sheet: &mut Sheet, tasks: &[TaskPicture<F>]) {
    for (i, task) in tasks.iter().enumerate() {
        sheet.polygon(&task.place, &format!("fill=\"{}\" fill-opacity=\"0.07\"", colour(i)));
    }
}

/// Draws routes, trails, particles, goals and ends of all tasks, with each kind on top of the kinds before it.
pub fn tasks<F>(sheet: &mut Sheet, tasks: &[TaskPicture<F>]) {
    for (i, task) in tasks.iter().enumerate().filter(|(_, task)| task.marks.len() > 1) {
        route(sheet, &task.marks, colour(i));
    }
    for task in tasks {
        sheet.line(&task.trail, "stroke=\"#ffffff\" stroke-width=\"6\" stroke-opacity=\"0.8\"");
    }
    for (i, task) in tasks.iter().enumerate() {
        sheet.line(&task.trail, &format!("stroke=\"{}\" stroke-width=\"3\"", colour(i)));
        cloud(sheet, &task.particles, colour(i));
    }
    for (i, task) in tasks.iter().enumerate() {
        if let [goal] = &task.marks[..] {
            ring(sheet, sheet.view.at(goal), colour(i));
        }
    }
    ends(sheet, tasks);
    let mut taken: Vec<[f64; 2]> = Vec::new();
    for (i, task) in tasks.iter().enumerate() {
        if let Some(mark) = task.marks.last() {
            let at = free_spot(sheet.view.at(mark), &taken);
            taken.push(at);
            badge(sheet, at, i);
        }
    }
}

/// Draws how each task ended, for those that began.
pub fn ends<F>(sheet: &mut Sheet, tasks: &[TaskPicture<F>]) {
    for task in tasks.iter().filter(|task| task.outcome != TaskMark::NotBegun) {
        if let Some(end) = task.trail.last() {
            let at = sheet.view.at(end);
            if task.outcome == TaskMark::Reached { tick(sheet, at) } else { cross(sheet, at) }
        }
    }
}

/// Draws the robot's position and heading at the start.
pub fn start<F>(sheet: &mut Sheet, start: &Pose<F>) {
    let [x, y] = sheet.view.at(&start.position());
    arrow(sheet, [x, y], start.yaw_rad);
}

/// Draws a star where each contact began.
pub fn contacts<F>(sheet: &mut Sheet, contacts: &[Point<F>]) {
    for contact in contacts {
        star(sheet, sheet.view.at(contact));
    }
}

/// Draws the legend below the picture: the tasks by number, colour and outcome, followed by the meaning of the symbols.
pub fn legend<F>(sheet: &mut Sheet, tasks: &[TaskPicture<F>], symbols: &[Symbol]) {
    let longest = tasks.iter().map(|task| task.name.chars().count()).max().unwrap_or(0);
    let column = (74.0 + 8.6 * longest as f64).clamp(110.0, SHEET_WIDTH - 40.0);
    let columns = ((SHEET_WIDTH - 40.0) / column).floor().max(1.0) as usize;
    for (i, task) in tasks.iter().enumerate() {
        let x = 34.0 + (i % columns) as f64 * column;
        let y = sheet.bottom + 12.0 + (i / columns) as f64 * 28.0;
        badge(sheet, [x, y], i);
        sheet.text([x + 17.0, y + 5.0], 15.0, "start", INK, "400", &task.name);
        let after = x + 17.0 + 8.6 * task.name.chars().count() as f64 + 14.0;
        match task.outcome {
            TaskMark::Reached => tick(sheet, [after, y]),
            TaskMark::Failed => cross(sheet, [after, y]),
            TaskMark::NotBegun => sheet.text([after - 5.0, y + 5.0], 15.0, "start", "#8a93a3", "400", "–"),
        }
    }
    sheet.bottom += tasks.len().div_ceil(columns) as f64 * 28.0 + 8.0;
    symbol_row(sheet, symbols);
}

fn symbol_row(sheet: &mut Sheet, symbols: &[Symbol]) {
    let y = sheet.bottom + 10.0;
    let mut x = 34.0;
    for symbol in symbols {
        let text = draw_symbol(sheet, *symbol, [x, y]);
        sheet.text([x + 19.0, y + 4.5], 13.5, "start", "#4a5261", "400", text);
        x += 19.0 + 7.2 * text.chars().count() as f64 + 26.0;
    }
    sheet.bottom += 22.0;
}

fn draw_symbol(sheet: &mut Sheet, symbol: Symbol, [x, y]: [f64; 2]) -> &'static str {
    let line = |style: &str| {
        format!("<path d=\"M{:.1} {y:.1}h22\" fill=\"none\" stroke-linecap=\"round\" {style}/>", x - 11.0)
    };
    match symbol {
        Symbol::Start => arrow(sheet, [x, y], 0.0),
        Symbol::Goal => ring(sheet, [x, y], "#4a5261"),
        Symbol::Trail(_) => sheet.raw(line("stroke=\"#4a5261\" stroke-width=\"3\"")),
        Symbol::Route => {
            let style = "stroke=\"#4a5261\" stroke-width=\"2\" stroke-dasharray=\"2 6\"";
            sheet.raw(line(style));
        }
        Symbol::Reached => tick(sheet, [x, y]),
        Symbol::Failed => cross(sheet, [x, y]),
        Symbol::Particles => {
            for (dx, dy) in [(-6.0, 2.0), (-2.0, -3.0), (1.0, 3.0), (4.0, -1.0), (7.0, 3.0), (-4.0, 5.0)] {
                dot(sheet, [x + dx, y + dy], "#4a5261");
            }
        }
        Symbol::Furniture => sheet.raw(format_args!(
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"18\" height=\"11\" fill=\"#e9dcc6\" stroke=\"#cbb894\"/>",
            x - 9.0,
            y - 5.5
        )),
        Symbol::Contact => star(sheet, [x, y]),
        Symbol::Marker => {
            sheet.raw(format_args!("<path d=\"M{:.1} {y:.1}m0 -6l7 6l-7 6z\" fill=\"#c23b8f\"/>", x - 3.0))
        }
        Symbol::View => sheet.raw(format_args!(
            "<path d=\"M{:.1} {y:.1}l18 -8v16z\" fill=\"#7a52cc\" fill-opacity=\"0.15\" stroke=\"#7a52cc\"/>",
            x - 9.0
        )),
        Symbol::Line(_, colour) => sheet.raw(line(&format!("stroke=\"{colour}\" stroke-width=\"2.6\""))),
        Symbol::Person => sheet.raw(line(WAY)),
    }
    match symbol {
        Symbol::Start => "start",
        Symbol::Goal => "goal",
        Symbol::Trail(whose) => whose,
        Symbol::Route => "drawn route",
        Symbol::Reached => "ended: reached",
        Symbol::Failed => "ended: not reached",
        Symbol::Particles => "particles at the end",
        Symbol::Furniture => "furniture",
        Symbol::Contact => "contact",
        Symbol::Marker => "marker",
        Symbol::View => "the camera's view",
        Symbol::Person => "a person's path",
        Symbol::Line(name, _) => name,
    }
}

fn route<F>(sheet: &mut Sheet, points: &[Point<F>], colour: &str) {
    let style =
        format!("stroke=\"{colour}\" stroke-width=\"2.5\" stroke-opacity=\"0.75\" stroke-dasharray=\"2 7\"");
    sheet.line(points, &style);
    let [.., before, last] = points else { return };
    let ([ax, ay], [bx, by]) = (sheet.view.at(before), sheet.view.at(last));
    let degrees = (by - ay).atan2(bx - ax).to_degrees();
    sheet.raw(format_args!(
        "<path d=\"M0 0L-12 -6L-12 6z\" transform=\"translate({bx:.1} {by:.1}) rotate({degrees:.0})\" fill=\"{colour}\"/>"
    ));
}

/// Draws each particle as a dot.
pub fn cloud<F>(sheet: &mut Sheet, particles: &[Point<F>], colour: &str) {
    for particle in particles {
        dot(sheet, sheet.view.at(particle), colour);
    }
}

fn dot(sheet: &mut Sheet, [x, y]: [f64; 2], colour: &str) {
    sheet.raw(format_args!(
        "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"1.5\" fill=\"{colour}\" fill-opacity=\"0.45\"/>"
    ));
}

fn ring(sheet: &mut Sheet, [x, y]: [f64; 2], colour: &str) {
    sheet.raw(format_args!(
        "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"7.5\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2.5\"/>"
    ));
}

/// Draws the number of a task in white on the colour of the task.
fn badge(sheet: &mut Sheet, [x, y]: [f64; 2], task: usize) {
    let (fill, number) = (colour(task), (task + 1).to_string());
    sheet.raw(format_args!(
        "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"10.5\" fill=\"{fill}\" stroke=\"#ffffff\" stroke-width=\"1.5\"/>"
    ));
    sheet.text([x, y + 4.5], 13.0, "middle", "#ffffff", "700", &number);
}

/// Returns a position next to a mark that is not occupied by the badge of another mark.
fn free_spot([x, y]: [f64; 2], taken: &[[f64; 2]]) -> [f64; 2] {
    let spots = [(17.0, -17.0), (-17.0, -17.0), (17.0, 17.0), (-17.0, 17.0), (0.0, -25.0), (0.0, 25.0)];
    let mut spots = spots.iter().map(|(dx, dy)| [x + dx, y + dy]);
    let first = [x + 17.0, y - 17.0];
    spots.find(|[sx, sy]| taken.iter().all(|[tx, ty]| (sx - tx).hypot(sy - ty) > 21.0)).unwrap_or(first)
}

fn tick(sheet: &mut Sheet, [x, y]: [f64; 2]) {
    sheet.raw(format_args!(
        "<g transform=\"translate({x:.1} {y:.1})\"><circle r=\"6.5\" fill=\"{GREEN}\" stroke=\"#ffffff\" stroke-width=\"1.2\"/><path d=\"M-3 0.2L-0.9 2.4L3.1 -2.2\" fill=\"none\" stroke=\"#ffffff\" stroke-width=\"1.8\" stroke-linecap=\"round\" stroke-linejoin=\"round\"/></g>"
    ));
}

fn cross(sheet: &mut Sheet, [x, y]: [f64; 2]) {
    sheet.raw(format_args!(
        "<g transform=\"translate({x:.1} {y:.1})\"><circle r=\"6.5\" fill=\"{RED}\" stroke=\"#ffffff\" stroke-width=\"1.2\"/><path d=\"M-2.5 -2.5L2.5 2.5M2.5 -2.5L-2.5 2.5\" fill=\"none\" stroke=\"#ffffff\" stroke-width=\"1.8\" stroke-linecap=\"round\"/></g>"
    ));
}

fn arrow(sheet: &mut Sheet, [x, y]: [f64; 2], yaw_rad: f64) {
    let degrees = -yaw_rad.to_degrees();
    sheet.raw(format_args!(
        "<path d=\"M11 0L-8 -7.5L-4 0L-8 7.5z\" transform=\"translate({x:.1} {y:.1}) rotate({degrees:.0})\" fill=\"{INK}\" stroke=\"#ffffff\" stroke-width=\"1.5\" stroke-linejoin=\"round\" paint-order=\"stroke\"/>"
    ));
}

fn star(sheet: &mut Sheet, [x, y]: [f64; 2]) {
    sheet.raw(format_args!(
        "<path d=\"M0 -7L1.8 -1.8L7 0L1.8 1.8L0 7L-1.8 1.8L-7 0L-1.8 -1.8z\" transform=\"translate({x:.1} {y:.1}) rotate(22)\" fill=\"#ff5a1f\" stroke=\"#ffffff\" stroke-width=\"0.8\"/>"
    ));
}

#[cfg(test)]
mod tests {
    use sketchnav_schemas::geometry::World;

    use super::*;

    /// Regression test: a person who walked along a corridor ten times was drawn as a solid line, which the legend did not list.
    #[test]
    fn a_person_who_walks_back_and_forth_is_drawn_once() {
        let there = (0..=40).map(|i| Point::<World>::new(0.1 * f64::from(i), 1.0));
        let back = there.clone().rev();
        let way: Vec<_> = there.clone().chain(back).chain(there.clone()).collect();
        let pieces = first_passes(&way, &mut BTreeSet::new());
        assert_eq!(pieces.len(), 1);
        let length = pieces[0].len();
        assert!((41..=44).contains(&length), "{length} points: the path, and what lies in its last square");
        let elsewhere = way.iter().map(|at| Point::new(at.x, at.y + 1.0)).collect::<Vec<_>>();
        let both = [way, elsewhere].concat();
        assert_eq!(first_passes(&both, &mut BTreeSet::new()).len(), 2);
    }
}

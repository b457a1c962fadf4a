//! Checks whether a robot can navigate by a drawing, and reports what is doubtful about it, with positions in image pixels.
//!
//! The true size of a drawing is not known. Like the localizer, these checks assume that the drawn floor is 25 m long. With walls
//! all around the start, it may just as well be a single room, in which case 6 m are enough. The laser is therefore only expected
//! to see nothing if this is the case at every likely scale. A doubt is a warning, whereas [`hopeless`] rejects drawings that
//! cannot possibly work.

use std::fmt;

use sketchnav_schemas::codes::{FREE, WALL};
use sketchnav_schemas::geometry::{Point, Sketch};

use super::drawn_map::DrawnMap;
use super::enclosure::encloses;
use super::error::SketchError;
use super::left_out::LeftOut;
use super::places::{Places, flood};

/// Assumed length of the drawn floor, in metres: for a building, and for a single room.
const BUILDING_M: f64 = 25.0;
const ROOM_M: f64 = 6.0;
/// Walls count as all around a position if at least this share of the directions leads to one.
const ENCLOSED_SHARE: f64 = 0.5;
/// Number of directions in which to look for walls.
const DIRECTIONS: u32 = 72;
/// Minimum share of the page that strokes must cover.
const LEAST_INK_SHARE: f64 = 0.002;
/// Minimum area of the free space around the start, in square metres.
const LEAST_ROOM_M2: f64 = 1.0;
/// Maximum width of a door, in metres, in a building as small as a room.
const DOOR_M: f64 = 1.0;
/// Walls within this share of the page's diagonal from its edge count as a frame.
const FRAME_SHARE: f64 = 0.02;
/// Radius, in pen widths, within which free cells must be joined to count as being on the same side of a wall. A route that
/// runs along a wall may touch it.
const BRUSH_PENS: f64 = 4.0;

/// A reason to doubt that a robot can navigate by a drawing. Positions and lengths are in image pixels.
#[derive(Debug, Clone, PartialEq)]
pub enum Doubt {
    /// The laser sees no wall at the start.
    NoWallNear {
        /// The start, or the first goal if the start is not marked.
        what: &'static str,
        /// Its position.
        at: [f64; 2],
        /// Estimated range of the laser.
        reach_px: f64,
    },
    /// The laser sees no wall anywhere along a task.
    OpenField {
        /// The task.
        task: String,
        /// Start of the path.
        from: [f64; 2],
        /// End of the path.
        to: [f64; 2],
        /// Estimated range of the laser.
        reach_px: f64,
    },
    /// The free space around the start is too small for a room.
    ShutIn {
        /// The start, or the first goal if the start is not marked.
        what: &'static str,
        /// Its position.
        at: [f64; 2],
        /// Area of the free space.
        area_px2: f64,
    },
    /// A drawn route crosses a wall.
    ThroughWall {
        /// The task.
        task: String,
        /// Position of the crossing.
        at: [f64; 2],
    },
    /// The walls do not enclose the start, so they hardly distinguish one position from another.
    Unenclosed {
        /// The start, or the first goal if the start is not marked.
        what: &'static str,
        /// Its position.
        at: [f64; 2],
        /// Maximum width of an opening that counts as a door.
        opening_px: f64,
    },
    /// Hardly anything is drawn.
    LittleInk {
        /// Share of the page that is wall.
        share: f64,
    },
    /// Nothing is drawn except a frame around the page.
    OnlyFrame,
    /// Something was left out of the drawing that may have been a wall.
    LeftOut(LeftOut),
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at = |place: &[f64; 2]| format!("({:.0}, {:.0})", place[0], place[1]);
        match self {
            Self::NoWallNear { what, at: start, reach_px } => write!(
                f,
                "no wall within the laser's reach (about {reach_px:.0} px) of {what} at {}: draw the walls around it",
                at(start)
            ),
            Self::OpenField { task, from, to, reach_px } => write!(
                f,
                "{task}: no wall within the laser's reach (about {reach_px:.0} px) on the way from {} to {}",
                at(from),
                at(to)
            ),
            Self::ShutIn { what, at: start, area_px2 } => write!(
                f,
                "{what} at {} is shut in: only {area_px2:.0} square pixels around it are free; move it, or draw a door",
                at(start)
            ),
            Self::ThroughWall { task, at: place } => write!(
                f,
                "{task}: the route crosses a wall at {}: draw a door there, or lead the route around",
                at(place)
            ),
            Self::Unenclosed { what, at: start, opening_px } => write!(
                f,
                "the walls do not enclose {what} at {}: expected openings of {opening_px:.0} px at most, a sixth of \
                 what is drawn; draw the walls around it",
                at(start)
            ),
            Self::OnlyFrame => {
                write!(f, "nothing is drawn except a frame along the page's edge: are walls missing?")
            }
            Self::LittleInk { share } => write!(
                f,
                "only {:.2} % of the page is wall, less than {} %: are walls missing?",
                100.0 * share,
                100.0 * LEAST_INK_SHARE
            ),
            Self::LeftOut(what) => write!(f, "left out: {what}"),
        }
    }
}

/// Returns the doubts about driving a robot by a drawing. `range_max_m` is the range of the robot's laser, in
/// metres. If it is `None`, anything that depends on the laser is not checked.
pub fn doubts(drawing: &DrawnMap, places: &Places, range_max_m: Option<f64>) -> Vec<Doubt> {
    let mut doubts = of_drawing(drawing);
    let walls = Walls::new(drawing);
    let start = places.start.position();
    let what = if places.is_anywhere(drawing) { "the first goal" } else { "the start" };
    doubts.extend(shut_in(drawing, &walls, what, &start));
    if let Some(range_max_m) = range_max_m {
        let reach_px = walls.reach_px(&start, range_max_m);
        if !walls.are_within(&start, reach_px) {
            let at = drawing.to_image(&start);
            doubts.push(Doubt::NoWallNear { what, at, reach_px: reach_px / drawing.scale });
            doubts.extend(open_fields(drawing, &walls, places, reach_px));
        } else {
            doubts.extend(unenclosed(drawing, &walls, what, &start));
        }
    }
    doubts.extend(crossings(drawing, places));
    doubts
}

/// Returns the doubts about a drawing without marks.
pub fn of_drawing(drawing: &DrawnMap) -> Vec<Doubt> {
    let walls = drawing.cells.iter().filter(|&&cell| cell == WALL).count();
    let share = walls as f64 / drawing.cells.len() as f64;
    let is_bare = !drawing.kind.is_filled() && share < LEAST_INK_SHARE;
    let is_bare = is_bare.then_some(Doubt::LittleInk { share });
    let is_frame = is_frame(drawing).then_some(Doubt::OnlyFrame);
    let left_out = drawing.left_out.iter().filter(|what| what.is_doubtful());
    let left_out = left_out.cloned().map(Doubt::LeftOut);
    is_bare.into_iter().chain(is_frame).chain(left_out).collect()
}

/// Rejects a drawing that cannot possibly work, because there are no walls near the start or along any task.
///
/// # Errors
/// [`SketchError::OpenField`] if `doubts` contains a [`Doubt::NoWallNear`], and a [`Doubt::OpenField`] for each task.
pub fn hopeless(drawing: &DrawnMap, places: &Places, doubts: &[Doubt]) -> Result<(), SketchError> {
    let open = doubts.iter().filter(|doubt| matches!(doubt, Doubt::OpenField { .. })).count();
    let near = doubts.iter().find_map(|doubt| match doubt {
        Doubt::NoWallNear { at, reach_px, .. } => Some((*at, *reach_px)),
        _ => None,
    });
    match near {
        Some((at, reach_px)) if open == places.tasks.len() => {
            let what = if places.is_anywhere(drawing) { "the first goal" } else { "navigator.start" };
            Err(SketchError::OpenField { what, at, file: drawing.file.clone(), reach_px })
        }
        _ => Ok(()),
    }
}

fn shut_in(drawing: &DrawnMap, walls: &Walls, what: &'static str, start: &Point<Sketch>) -> Option<Doubt> {
    let free = flood(drawing, start).into_iter().filter(|&reached| reached).count() as f64;
    let px_per_m = walls.length_px() / BUILDING_M;
    let is_small = free < LEAST_ROOM_M2 * px_per_m * px_per_m;
    let area_px2 = free / (drawing.scale * drawing.scale);
    is_small.then(|| Doubt::ShutIn { what, at: drawing.to_image(start), area_px2 })
}

/// Returns a doubt if the walls do not enclose the start, or the first goal if the start is not marked. A filled drawing always does, since it is solid beyond the page.
fn unenclosed(drawing: &DrawnMap, walls: &Walls, what: &'static str, start: &Point<Sketch>) -> Option<Doubt> {
    let opening_px = walls.length_px() * DOOR_M / ROOM_M;
    let is_open = !drawing.kind.is_filled() && !encloses(drawing, start, opening_px);
    is_open.then(|| Doubt::Unenclosed {
        what,
        at: drawing.to_image(start),
        opening_px: opening_px / drawing.scale,
    })
}

/// Returns true if all walls lie along the page's edge. This does not exclude filled drawings, because a frame that touches the
/// edge is taken for one.
fn is_frame(drawing: &DrawnMap) -> bool {
    let width = drawing.width_px as usize;
    let most = [width - 1, drawing.height_px as usize - 1];
    let frame_px = FRAME_SHARE * drawing.diagonal_px();
    let is_near = |i: usize| {
        let [column, row] = [i % width, i / width];
        let ends = [column, row, most[0] - column, most[1] - row];
        ends.into_iter().min().is_some_and(|near| near as f64 <= frame_px)
    };
    let mut walls = drawing.cells.iter().enumerate().filter(|&(_, &cell)| cell == WALL);
    walls.all(|(i, _)| is_near(i))
}

/// Returns a doubt for each task along whose path the laser sees no wall.
fn open_fields<'a>(
    drawing: &'a DrawnMap,
    walls: &'a Walls,
    places: &'a Places,
    reach_px: f64,
) -> impl Iterator<Item = Doubt> + 'a {
    let ends = places.tasks.iter().filter_map(|task| task.points.last().copied());
    let begins = std::iter::once(places.start.position()).chain(ends);
    places.tasks.iter().zip(begins).filter_map(move |(task, from)| {
        let to = *task.points.last()?;
        let way: Vec<_> = std::iter::once(from).chain(task.points.iter().copied()).collect();
        let is_open = way.windows(2).all(|ends| {
            along(&ends[0], &ends[1], (reach_px / 2.0).max(1.0))
                .all(|place| !walls.are_within(&place, reach_px))
        });
        is_open.then(|| Doubt::OpenField {
            task: task.name.clone(),
            from: drawing.to_image(&from),
            to: drawing.to_image(&to),
            reach_px: reach_px / drawing.scale,
        })
    })
}

/// Returns a doubt for each route that crosses a wall, with the position of the first crossing.
fn crossings<'a>(drawing: &'a DrawnMap, places: &'a Places) -> impl Iterator<Item = Doubt> + 'a {
    let routes = places.tasks.iter().filter(|task| task.points.len() > 1);
    routes.filter_map(|task| {
        let at = crossing(drawing, &task.points)?;
        Some(Doubt::ThroughWall { task: task.name.clone(), at: drawing.to_image(&at) })
    })
}

/// Returns the first position at which a line goes from one side of a wall to the other.
fn crossing(drawing: &DrawnMap, line: &[Point<Sketch>]) -> Option<Point<Sketch>> {
    let steps = line.windows(2).flat_map(|ends| along(&ends[0], &ends[1], 0.5));
    let (mut free, mut wall): (Option<Point<Sketch>>, Option<Point<Sketch>>) = (None, None);
    for place in steps {
        if drawing.cell(&place) == Some(WALL) {
            wall.get_or_insert(place);
        } else if let (Some(before), Some(inside)) = (free, wall.take()) {
            if !are_joined(drawing, &before, &place) {
                return Some(inside);
            }
            free = Some(place);
        } else {
            free = Some(place);
        }
    }
    None
}

/// Returns true if free cells nearby join the two positions.
fn are_joined(drawing: &DrawnMap, from: &Point<Sketch>, to: &Point<Sketch>) -> bool {
    let reach_px = BRUSH_PENS * drawing.pen_width_px + 2.0 * from.distance(to);
    let cell = |point: &Point<Sketch>| [point.x.floor() as i64, point.y.floor() as i64];
    let (first, last) = (cell(from), cell(to));
    let middle = [0, 1].map(|axis| (first[axis] + last[axis]) / 2);
    let near = |at: &[i64; 2]| (0..2).all(|axis| (at[axis] - middle[axis]).abs() as f64 <= reach_px);
    let is_free =
        |at: &[i64; 2]| drawing.cell(&Point::new(at[0] as f64 + 0.5, at[1] as f64 + 0.5)) == Some(FREE);
    let (mut seen, mut open) = (std::collections::BTreeSet::from([first]), vec![first]);
    while let Some(at) = open.pop() {
        if at == last {
            return true;
        }
        let beside = [[1, 0], [-1, 0], [0, 1], [0, -1]].map(|step| [at[0] + step[0], at[1] + step[1]]);
        open.extend(beside.into_iter().filter(|next| near(next) && is_free(next) && seen.insert(*next)));
    }
    false
}

/// Returns the positions from one point to another, both included, at most `step_px` apart.
fn along(from: &Point<Sketch>, to: &Point<Sketch>, step_px: f64) -> impl Iterator<Item = Point<Sketch>> {
    let count = (from.distance(to) / step_px).ceil().max(1.0) as usize;
    let (from, to) = (*from, *to);
    (0..=count).map(move |i| {
        let share = i as f64 / count as f64;
        Point::new(from.x + (to.x - from.x) * share, from.y + (to.y - from.y) * share)
    })
}

/// A summed-area table of the walls, which determines in constant time whether a box of any size contains a wall.
struct Walls<'a> {
    drawing: &'a DrawnMap,
    /// For each corner of a cell, the number of wall cells below and to the left of it.
    sums: Vec<u32>,
    /// The first and last column and the first and last row that contain walls.
    extent: [[usize; 2]; 2],
}

impl<'a> Walls<'a> {
    fn new(drawing: &'a DrawnMap) -> Self {
        let width = drawing.width_px as usize;
        let mut sums = vec![0; (width + 1) * (drawing.height_px as usize + 1)];
        let mut extent = [[usize::MAX, 0], [usize::MAX, 0]];
        for (row, cells) in drawing.cells.chunks_exact(width).enumerate() {
            let mut of_row = 0;
            for (column, &cell) in cells.iter().enumerate() {
                if cell == WALL {
                    of_row += 1;
                    let grown = |[low, high]: [usize; 2], at: usize| [low.min(at), high.max(at)];
                    extent = [grown(extent[0], column), grown(extent[1], row)];
                }
                sums[(row + 1) * (width + 1) + column + 1] = sums[row * (width + 1) + column + 1] + of_row;
            }
        }
        Self { drawing, sums, extent }
    }

    /// Returns the longer side of the drawn floor, in sketch pixels. For a filled drawing, which is solid outside, this is the
    /// longer side of the page.
    fn length_px(&self) -> f64 {
        let sides = self.extent.map(|[low, high]| high.saturating_sub(low) + 1);
        sides.into_iter().max().unwrap_or(1) as f64
    }

    /// Returns the laser's range in sketch pixels, assuming the smallest building that this is likely to be.
    fn reach_px(&self, start: &Point<Sketch>, range_max_m: f64) -> f64 {
        let length_m = if self.are_around(start) { ROOM_M } else { BUILDING_M };
        range_max_m * self.length_px() / length_m
    }

    /// Returns true if there is a wall within the square around a position that extends `half_px` to each side.
    fn are_within(&self, place: &Point<Sketch>, half_px: f64) -> bool {
        let (width, height) = (self.drawing.width_px as usize, self.drawing.height_px as usize);
        let cells = |at: f64, most: usize| {
            let low = (at - half_px).floor().clamp(0.0, most as f64) as usize;
            let high = (at + half_px).ceil().clamp(0.0, most as f64) as usize;
            [low, high]
        };
        let ([left, right], [low, high]) = (cells(place.x, width), cells(place.y, height));
        let sum = |column: usize, row: usize| u64::from(self.sums[row * (width + 1) + column]);
        sum(right, high) + sum(left, low) > sum(left, high) + sum(right, low)
    }

    /// Returns true if there are walls all around a position.
    fn are_around(&self, place: &Point<Sketch>) -> bool {
        let hits = (0..DIRECTIONS).filter(|&k| {
            let (sin, cos) = (f64::from(k) / f64::from(DIRECTIONS) * std::f64::consts::TAU).sin_cos();
            let ray = (1..).map(|i| Point::new(place.x + f64::from(i) * cos, place.y + f64::from(i) * sin));
            ray.map_while(|at| self.drawing.cell(&at)).any(|cell| cell == WALL)
        });
        hits.count() as f64 >= ENCLOSED_SHARE * f64::from(DIRECTIONS)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::reading::{Intent, Options, Settings, read};

    /// Reads a drawing of strokes on 1000 x 800 px with these marks and returns it with its doubts.
    fn doubted(strokes: &[&[[f64; 2]]], marks: serde_json::Value) -> (DrawnMap, Places, Vec<Doubt>) {
        let strokes: Vec<_> = strokes.iter().map(|points| json!({ "points": points })).collect();
        let mut page = json!({ "canvas": [1000, 800], "strokes": strokes });
        page.as_object_mut().unwrap().extend(marks.as_object().unwrap().clone());
        let drawing = read(page.to_string().as_bytes(), "pad.json", &Options::default()).unwrap();
        let places = Intent::of_marks(&drawing.marks).place(&drawing, &Settings::default()).unwrap();
        let found = doubts(&drawing, &places, Some(3.5));
        (drawing, places, found)
    }

    fn goal(start: [f64; 2], goal: [f64; 2]) -> serde_json::Value {
        json!({ "start": { "at": start, "heading_deg": 0.0 }, "goals": [{ "name": "g", "at": goal }] })
    }

    const ROOM: &[[f64; 2]] = &[[50.0, 50.0], [950.0, 50.0], [950.0, 750.0], [50.0, 750.0], [50.0, 50.0]];
    const WALL: &[[f64; 2]] = &[[500.0, 50.0], [500.0, 500.0]];

    #[test]
    fn rooms_and_drawn_routes_through_doors_are_not_doubted() {
        let (.., found) = doubted(&[ROOM, WALL], goal([200.0, 200.0], [800.0, 200.0]));
        assert_eq!(found, []);
        // A hall, and the start in its middle.
        assert_eq!(doubted(&[ROOM], goal([500.0, 400.0], [600.0, 400.0])).2, []);
        // A route that touches the end of a wall in passing, and then runs along another wall.
        let route = json!({ "route": [[200, 200], [480, 501], [499, 502], [520, 501], [800, 200], [948, 300], [940, 500]] });
        assert_eq!(doubted(&[ROOM, WALL], route).2, []);
    }

    #[test]
    fn a_field_without_walls_is_hopeless() {
        let corner: &[[f64; 2]] = &[[900.0, 40.0], [960.0, 40.0], [960.0, 90.0]];
        let (drawing, places, found) = doubted(&[corner], goal([200.0, 600.0], [400.0, 700.0]));
        let [Doubt::LittleInk { .. }, Doubt::NoWallNear { at, reach_px, .. }, Doubt::OpenField { task, .. }] =
            &found[..]
        else {
            panic!("{found:?}");
        };
        assert_eq!((*at, task.as_str()), ([200.0, 600.0], "g"));
        assert!((5.0..15.0).contains(reach_px), "{reach_px}");
        let error = hopeless(&drawing, &places, &found).unwrap_err().to_string();
        assert!(error.starts_with("navigator.start at (200, 600) of pad.json: expected walls"), "{error}");
        // With a task that leads to walls, the drawing is not hopeless.
        let mut marks = goal([200.0, 600.0], [400.0, 700.0]);
        marks["goals"].as_array_mut().unwrap().push(json!({ "name": "h", "at": [954.0, 60.0] }));
        let (drawing, places, found) = doubted(&[corner], marks);
        assert!(hopeless(&drawing, &places, &found).is_ok());
        let words: Vec<_> = found.iter().map(Doubt::to_string).collect();
        assert!(words[1].contains("of the start at (200, 600): draw the walls around it"), "{words:?}");
        assert!(
            words[2].contains("g: no wall") && words[2].contains("from (200, 600) to (400, 700)"),
            "{words:?}"
        );
    }

    /// A robot was driven by a drawing of a single line without a warning: the line covered more than 0.2 % of the page, and the
    /// start was near it.
    #[test]
    fn walls_that_do_not_enclose_the_start_are_doubted() {
        let line: &[[f64; 2]] = &[[50.0, 700.0], [950.0, 700.0]];
        let other: &[[f64; 2]] = &[[50.0, 50.0], [950.0, 50.0]];
        let corner: &[[f64; 2]] = &[[50.0, 400.0], [50.0, 750.0], [300.0, 750.0]];
        let strip: &[[f64; 2]] = &[[120.0, 300.0], [120.0, 790.0]];
        for strokes in [&[line][..], &[line, other], &[corner], &[strip], &[&ROOM[..4]]] {
            let (.., found) = doubted(strokes, goal([100.0, 640.0], [200.0, 500.0]));
            assert!(matches!(found[..], [Doubt::Unenclosed { at: [100.0, 640.0], .. }]), "{found:?}");
        }
        // Three walls and a door in the fourth.
        let door: &[[f64; 2]] = &[[50.0, 700.0], [50.0, 190.0]];
        let (.., found) = doubted(
            &[&ROOM[..4], &[[50.0, 750.0], [50.0, 700.0]], door],
            goal([100.0, 640.0], [200.0, 500.0]),
        );
        assert_eq!(found, []);
    }

    #[test]
    fn a_frame_of_the_page_alone_is_doubted() {
        let frame: &[[f64; 2]] = &[[4.0, 4.0], [996.0, 4.0], [996.0, 796.0], [4.0, 796.0], [4.0, 4.0]];
        assert_eq!(doubted(&[frame], goal([200.0, 200.0], [800.0, 200.0])).2, [Doubt::OnlyFrame]);
        assert_eq!(doubted(&[frame, WALL], goal([200.0, 200.0], [800.0, 200.0])).2, []);
        // A frame that touches the page's edge.
        let page = |inside: &str| {
            let svg = format!(
                "<svg xmlns='http://www.w3.org/2000/svg' width='960' height='640'>\
                 <path d='M2 2H958V638H2z{inside}' fill='none' stroke='black' stroke-width='5'/></svg>"
            );
            of_drawing(&read(svg.as_bytes(), "frame.svg", &Options::default()).unwrap())
        };
        assert_eq!(page(""), [Doubt::OnlyFrame]);
        assert_eq!(page("M480 2V400"), []);
    }

    #[test]
    fn a_start_in_a_wall_of_two_lines_is_shut_in() {
        let slit: &[[f64; 2]] =
            &[[100.0, 100.0], [160.0, 100.0], [160.0, 116.0], [100.0, 116.0], [100.0, 100.0]];
        let (.., found) = doubted(&[ROOM, WALL, slit], goal([110.0, 108.0], [150.0, 108.0]));
        assert!(matches!(found[..], [Doubt::ShutIn { at: [110.0, 108.0], .. }]), "{found:?}");
    }

    #[test]
    fn a_route_through_a_wall_is_doubted_where_it_crosses() {
        let route = json!({ "route": [[200, 300], [800, 300], [800, 600]] });
        let (.., found) = doubted(&[ROOM, WALL], route);
        let [Doubt::ThroughWall { task, at }] = &found[..] else { panic!("{found:?}") };
        assert_eq!(task, "route");
        assert!((at[0] - 500.0).abs() < 5.0 && (at[1] - 300.0).abs() < 1.0, "{at:?}");
    }
}

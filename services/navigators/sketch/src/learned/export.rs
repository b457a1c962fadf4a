//! Exports what was learned for other programs: as a map of map_server, and as a picture with the corrected drawing.

use std::fmt::Write;

use sketchnav_mapping::Cell;
use sketchnav_mapping::region::Region;

use super::upright::Turn;
use super::warp::Lattice;
use super::{CELL_M, Learned, LearnedMap};
use crate::reading::DrawnMap;
use sketchnav_schemas::codes::WALL;
use sketchnav_schemas::geometry::Point;
use sketchnav_schemas::nearest::folded;

/// Margin around a picture, in cells.
const MARGIN: i64 = 10;
/// Size of the letters in a picture, in cells.
const FONT_SIZE: f64 = 14.0;
/// Half the height of a line of text, in cells.
const HALF_LINE: f64 = 8.0;
/// Distance from what was seen, in cells, within which the drawing is not shown.
const SEEN_AROUND: usize = 12;
/// Distance, in metres, between places that are converted to the drawing exactly.
const MESH_M: f64 = 0.4;
/// How far the picture extends beyond the area seen on each side, relative to the size of that area. A drawing that extends farther
/// is cut off.
const LARGEST: i64 = 3;

/// A map in the format of map_server.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MapServer {
    /// The file that names the picture.
    pub yaml: String,
    /// The picture, a PGM: black is occupied, near-white is free, grey is unknown.
    pub pgm: Vec<u8>,
}

/// Returns what was seen as a map of map_server, whose picture is called `picture`. The map is not turned: its frame is that of the
/// learned map, and most programs ignore a heading of the origin.
pub fn map_server(map: &LearnedMap, picture: &str) -> MapServer {
    let [x, y] = map.origin_m;
    let yaml = format!(
        "image: {picture:?}\nresolution: {CELL_M}\norigin: [{x}, {y}, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    );
    let mut pgm = format!("P5\n{} {}\n255\n", map.width, map.height()).into_bytes();
    let tone = |cell: &Cell| match cell {
        Cell::Free => 254,
        Cell::Occupied => 0,
        Cell::Unknown => 205,
    };
    pgm.extend(map.cells.chunks(map.width.max(1)).rev().flatten().map(tone));
    MapServer { yaml, pgm }
}

/// The cells of a picture: its size, and the position of its lower left cell relative to that of the map.
#[derive(Debug, Clone, Copy)]
struct Sheet {
    low: [i64; 2],
    size: [usize; 2],
}

impl Sheet {
    /// Returns the sheet that shows the map and the drawing around it.
    fn of(learned: &Learned, drawing: &DrawnMap) -> Self {
        let map = &learned.map;
        let side = [map.width as i64, map.height() as i64];
        let (mut low, mut high) = ([0; 2], side);
        let warp = learned.to_map();
        let (width, height) = (f64::from(drawing.width_px), f64::from(drawing.height_px));
        let is_wall = |x: f64, y: f64| drawing.cell(&Point::new(x, y)) == Some(WALL);
        let step = (width.max(height) / 400.0).max(1.0);
        let walk = |length: f64| (0..(length / step) as usize).map(move |k| (k as f64 + 0.5) * step);
        for (x, y) in walk(height).flat_map(|y| walk(width).map(move |x| (x, y))) {
            if !is_wall(x, y) {
                continue;
            }
            let [column, row] = drawing.to_image(&Point::new(x, y));
            let Some(at) = warp.apply([column, -row]) else { continue };
            for axis in 0..2 {
                let cell = ((at[axis] - map.origin_m[axis]) / CELL_M) as i64;
                low[axis] = low[axis].min(cell.max(-LARGEST * side[axis]));
                high[axis] = high[axis].max(cell.min((1 + LARGEST) * side[axis]));
            }
        }
        let low = low.map(|low| low - MARGIN);
        Self { low, size: [0, 1].map(|axis| (high[axis] + MARGIN - low[axis]) as usize) }
    }

    /// Returns the middle of a cell, in metres.
    fn middle_m(&self, map: &LearnedMap, index: usize) -> [f64; 2] {
        let at = [index % self.size[0], index / self.size[0]];
        [0, 1].map(|k| map.origin_m[k] + (self.low[k] as f64 + at[k] as f64 + 0.5) * CELL_M)
    }

    /// Returns a position in metres as column and row of the picture, with row 0 at the top.
    fn place(&self, map: &LearnedMap, at: [f64; 2]) -> [f64; 2] {
        let [x, y] = [0, 1].map(|k| (at[k] - map.origin_m[k]) / CELL_M - self.low[k] as f64);
        [x, self.size[1] as f64 - y]
    }

    /// Like [`Sheet::place`], or `None` if the position is not on the sheet.
    fn shown(&self, map: &LearnedMap, at: [f64; 2]) -> Option<[f64; 2]> {
        let at = self.place(map, at);
        let is_on = |axis: usize| (0.0..=self.size[axis] as f64).contains(&at[axis]);
        (is_on(0) && is_on(1)).then_some(at)
    }

    fn region(&self, holds: impl FnMut(usize) -> bool) -> Region {
        Region::of(self.size[0], self.size[1], holds)
    }
}

/// What a picture shows of the map and of the drawing around it, as cells of its sheet.
struct Layers {
    free: Region,
    occupied: Region,
    /// Drawn walls where nothing was seen.
    unseen: Region,
}

impl Layers {
    fn of(learned: &Learned, drawing: &DrawnMap, sheet: &Sheet) -> Self {
        let map = &learned.map;
        let [width, height] = sheet.size;
        let is = |what: Cell| sheet.region(|index| map.at_m(sheet.middle_m(map, index)) == what);
        let (free, occupied) = (is(Cell::Free), is(Cell::Occupied));
        let corner = |index: usize| sheet.middle_m(map, index);
        let to_drawing =
            Lattice::new(&learned.to_map().inverse(), corner(0), corner(width * height - 1), MESH_M);
        let mut around = sheet.region(|index| free.contains(index) || occupied.contains(index));
        around.grow(SEEN_AROUND);
        let unseen = sheet.region(|index| {
            let drawn = || {
                let [column, up] = to_drawing.apply(sheet.middle_m(map, index))?;
                drawing.cell(&drawing.from_image([column, -up]))
            };
            !around.contains(index) && drawn() == Some(WALL)
        });
        Self { free, occupied, unseen }
    }

    /// Returns the corners of the first and the last cell of each row that is shown, as places of the picture.
    fn corners(&self, [width, height]: [usize; 2]) -> impl Iterator<Item = [f64; 2]> {
        let is_shown = move |index| {
            [&self.free, &self.occupied, &self.unseen].iter().any(|region| region.contains(index))
        };
        (0..height)
            .filter_map(move |row| {
                let mut columns = (0..width).filter(|column| is_shown(row * width + column));
                let first = columns.next()?;
                let (left, right) = (first as f64, columns.next_back().unwrap_or(first) as f64 + 1.0);
                let (top, bottom) = ((height - 1 - row) as f64, (height - row) as f64);
                Some([[left, top], [left, bottom], [right, top], [right, bottom]])
            })
            .flatten()
    }
}

/// Something written on a picture.
struct Note {
    /// Its SVG.
    svg: String,
    /// The lower and the higher corner of what it covers, roughly.
    corners: [[f64; 2]; 2],
}

/// Returns a picture of the drawing, corrected by what was seen. Walls that were seen are in their true proportions, the others are
/// as drawn and lighter, and goals and names are marked. The picture is turned so that its walls run along the edges and it lies like
/// the drawing. A unit is a cell of 0.05 m.
pub fn svg(learned: &Learned, drawing: &DrawnMap) -> String {
    let (sheet, turn) = (Sheet::of(learned, drawing), Turn::upright(learned));
    let layers = Layers::of(learned, drawing, &sheet);
    let mut notes = vec![start(&learned.map, &sheet, &turn)];
    let goals: Vec<_> = goals(learned, &sheet, &turn).collect();
    notes.extend(names(learned, drawing, &sheet, &turn, &goals));
    notes.extend(goals);
    let shown = layers.corners(sheet.size).map(|corner| turn.apply_down(corner));
    let [low, high] = bounds(shown.chain(notes.iter().flat_map(|note| note.corners)));
    let [width, height] = [0, 1].map(|axis| high[axis] - low[axis]);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{} {} {width} {height}\" width=\"{width}\" height=\"{height}\" \
         font-family=\"sans-serif\" font-size=\"{FONT_SIZE}\">\n\
         <rect x=\"{0}\" y=\"{1}\" width=\"100%\" height=\"100%\" fill=\"#f3f3f0\"/>\n<g transform=\"rotate({:.3})\">\n",
        low[0], low[1], -turn.degrees
    );
    for (name, region, colour) in [
        ("free", &layers.free, "#ffffff"),
        ("drawn", &layers.unseen, "#b8b8b8"),
        ("walls", &layers.occupied, "#1c1c1c"),
    ] {
        // Writing to a string cannot fail.
        let _ = writeln!(svg, "<path class=\"{name}\" fill=\"{colour}\" d=\"{}\"/>", runs(region));
    }
    svg.push_str("</g>\n");
    notes.iter().for_each(|note| svg.push_str(&note.svg));
    svg.push_str("</svg>\n");
    svg
}

/// Returns the whole numbers around all places, with a margin.
fn bounds(places: impl Iterator<Item = [f64; 2]>) -> [[i64; 2]; 2] {
    let all = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    let [low, high] = places.fold(all, |[low, high], at| {
        [[0, 1].map(|axis| low[axis].min(at[axis])), [0, 1].map(|axis| high[axis].max(at[axis]))]
    });
    [low.map(|low| low.floor() as i64 - MARGIN), high.map(|high| high.ceil() as i64 + MARGIN)]
}

/// Returns an arrow at the start of the drive, in the robot's first heading.
fn start(map: &LearnedMap, sheet: &Sheet, turn: &Turn) -> Note {
    let at = turn.apply_down(sheet.place(map, [0.0; 2]));
    let svg = format!(
        "<path class=\"start\" transform=\"translate({:.1} {:.1}) rotate({:.3})\" d=\"M-5 -6l14 6l-14 6z\" fill=\"#2563eb\">\
         <title>start</title></path>\n",
        at[0], at[1], -turn.degrees
    );
    Note { svg, corners: [at, at] }
}

/// Returns the goals with the names of their tasks.
fn goals(learned: &Learned, sheet: &Sheet, turn: &Turn) -> impl Iterator<Item = Note> {
    learned.goals.iter().filter_map(move |goal| {
        let at = goal.at_m.or_else(|| learned.to_map().apply([goal.at[0], -goal.at[1]]))?;
        let [x, y] = turn.apply_down(sheet.shown(&learned.map, at)?);
        let (colour, dash) =
            if goal.reached { ("#15803d", "") } else { ("#b91c1c", " stroke-dasharray=\"3 2\"") };
        let (name, beside) = (escaped(&goal.task), x + 10.0);
        let svg = format!(
            "<circle class=\"goal\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"6\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2.5\"{dash}/>\
             <text x=\"{beside:.1}\" y=\"{:.1}\" fill=\"{colour}\">{name}</text>\n",
            y + 5.0
        );
        Some(Note { svg, corners: [[x - 6.0, y - HALF_LINE], [beside + length(&goal.task), y + HALF_LINE]] })
    })
}

/// Returns the names that are written on the drawing, except for those that a goal has at its side. A name that would cover a goal
/// stands above it.
fn names(
    learned: &Learned,
    drawing: &DrawnMap,
    sheet: &Sheet,
    turn: &Turn,
    goals: &[Note],
) -> impl Iterator<Item = Note> {
    let is_goal = |name: &str| learned.goals.iter().any(|goal| folded(&goal.task) == folded(name));
    let to_map = learned.to_map();
    drawing.labels.iter().filter(move |label| !is_goal(&label.text)).filter_map(move |label| {
        let at = to_map.apply([label.at[0], -label.at[1]])?;
        let [x, y] = turn.apply_down(sheet.shown(&learned.map, at)?);
        let half = length(&label.text) / 2.0;
        let around = |y: f64| [[x - half, y - HALF_LINE], [x + half, y + HALF_LINE]];
        let covered = goals.iter().find(|goal| overlap(&goal.corners, &around(y)));
        let y = covered.map_or(y, |goal| goal.corners[0][1] - HALF_LINE);
        let svg = format!(
            "<text class=\"name\" x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"#6b7280\">{}</text>\n",
            y + 5.0,
            escaped(&label.text)
        );
        Some(Note { svg, corners: around(y) })
    })
}

fn overlap([low, high]: &[[f64; 2]; 2], [other_low, other_high]: &[[f64; 2]; 2]) -> bool {
    (0..2).all(|axis| low[axis] < other_high[axis] && other_low[axis] < high[axis])
}

/// Returns the approximate length of a text on a picture.
fn length(text: &str) -> f64 {
    0.6 * FONT_SIZE * text.chars().count() as f64
}

/// Returns the region as a path of rectangles, one for each run of cells in a row.
fn runs(region: &Region) -> String {
    let (width, height) = (region.width(), region.height());
    let mut path = String::new();
    for row in 0..height {
        let mut column = 0;
        while column < width {
            let begun = column;
            while column < width && region.contains(row * width + column) {
                column += 1;
            }
            if column > begun {
                let length = column - begun;
                // Writing to a string cannot fail.
                let _ = write!(path, "M{begun} {}h{length}v1h-{length}z", height - 1 - row);
            }
            column = column.max(begun + 1);
        }
    }
    path
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

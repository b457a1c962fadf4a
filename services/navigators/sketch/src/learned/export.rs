//! Exports what was learned for other programs: as a map of map_server, and as a picture with the corrected drawing.

use std::fmt::Write;

use sketchnav_mapping::Cell;
use sketchnav_mapping::region::Region;

use super::warp::Lattice;
use super::{CELL_M, Learned, LearnedMap};
use crate::reading::DrawnMap;
use sketchnav_schemas::codes::WALL;
use sketchnav_schemas::geometry::Point;

/// Margin around a picture, in cells.
const MARGIN: i64 = 10;
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

/// Returns what was seen as a map of map_server, whose picture is called `picture`.
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

    fn region(&self, holds: impl FnMut(usize) -> bool) -> Region {
        Region::of(self.size[0], self.size[1], holds)
    }
}

/// Returns a picture of the drawing, corrected by what was seen. Walls that were seen are at their true positions, the others are
/// as drawn and lighter, and the goals are marked. A unit is a cell of 0.05 m.
pub fn svg(learned: &Learned, drawing: &DrawnMap) -> String {
    let map = &learned.map;
    let sheet = Sheet::of(learned, drawing);
    let [width, height] = sheet.size;
    let is = |what: Cell| sheet.region(|index| map.at_m(sheet.middle_m(map, index)) == what);
    let (free, occupied) = (is(Cell::Free), is(Cell::Occupied));
    let corner = |index: usize| sheet.middle_m(map, index);
    let to_drawing = Lattice::new(&learned.to_map().inverse(), corner(0), corner(width * height - 1), MESH_M);
    let mut around = sheet.region(|index| free.contains(index) || occupied.contains(index));
    around.grow(SEEN_AROUND);
    let unseen = sheet.region(|index| {
        let drawn = || {
            let [column, up] = to_drawing.apply(sheet.middle_m(map, index))?;
            drawing.cell(&drawing.from_image([column, -up]))
        };
        !around.contains(index) && drawn() == Some(WALL)
    });
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         font-family=\"sans-serif\" font-size=\"14\">\n<rect width=\"100%\" height=\"100%\" fill=\"#f3f3f0\"/>\n"
    );
    for (name, region, colour) in
        [("free", &free, "#ffffff"), ("drawn", &unseen, "#b8b8b8"), ("walls", &occupied, "#1c1c1c")]
    {
        // Writing to a string cannot fail.
        let _ = writeln!(svg, "<path class=\"{name}\" fill=\"{colour}\" d=\"{}\"/>", runs(region));
    }
    let [x, y] = sheet.place(map, [0.0; 2]);
    let _ = writeln!(
        svg,
        "<path class=\"start\" d=\"M{x:.1} {y:.1}m-5 -6l14 6l-14 6z\" fill=\"#2563eb\"><title>start</title></path>"
    );
    for goal in &learned.goals {
        let Some(at) = goal.at_m.or_else(|| learned.to_map().apply([goal.at[0], -goal.at[1]])) else {
            continue;
        };
        let [x, y] = sheet.place(map, at);
        let (colour, dash) =
            if goal.reached { ("#15803d", "") } else { ("#b91c1c", " stroke-dasharray=\"3 2\"") };
        let name = escaped(&goal.task);
        let _ = writeln!(
            svg,
            "<circle class=\"goal\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"6\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2.5\"{dash}/>\
             <text x=\"{:.1}\" y=\"{:.1}\" fill=\"{colour}\">{name}</text>",
            x + 10.0,
            y + 5.0
        );
    }
    svg.push_str("</svg>\n");
    svg
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

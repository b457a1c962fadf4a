//! Traces the walls of a raster as lines. Those solid cells that are within a wall's thickness of a room are thinned to a line,
//! which is followed and straightened.
//!
//! Thinning: Zhang and Suen, *A fast parallel algorithm for thinning digital patterns*, 1984.
//! Straightening: Douglas and Peucker, 1973.

use nalgebra::Vector2;

use crate::grid::{Grid, Solid};
use crate::regions::Regions;

/// Maximum depth, from the border of a room, of solid cells that count as wall, in metres. Cells beyond it are not drawn.
const DEPTH_M: f64 = 0.15;
/// Minimum length of a line, in metres. A shorter side branch is an artefact of thinning, and a shorter separate line is a speck.
const SPUR_M: f64 = 0.4;
/// Half the maximum width of a slit between two faces of a wall, in metres. A slit is drawn as one line.
const SLIT_M: f64 = 0.13;
/// Maximum deviation of a straightened line from the cells, in metres, but at least this number of cells.
const STRAIGHT_M: f64 = 0.1;
const STRAIGHT_CELLS: f64 = 1.2;
/// Number of cells that thinning removes from corners.
const ROUND_CELLS: usize = 3;
/// Minimum slant of a line, in cells. A piece that slants by less is drawn straight.
const SLANT_CELLS: f64 = 2.0;
/// Maximum distance between a corner and the point where the two pieces next to it meet, in cells.
const MEET_CELLS: f64 = 4.0;
/// Maximum size of furniture, in metres. Anything solid that is smaller than this in both directions and stands within a single
/// region is furniture.
const FURNITURE_M: f64 = 2.0;

/// Returns the centre lines of the walls around the regions.
pub(crate) fn walls(solid: &Solid, regions: &Regions) -> Vec<Vec<Vector2<f64>>> {
    let grid = &solid.grid;
    let rooms = without_slits(grid, (0..grid.len()).map(|i| regions.at_cell(i).is_some()).collect());
    let far_m = grid.distances_m(&rooms);
    let depth_m = DEPTH_M.max(1.5 * grid.cell_m);
    // A pocket within a wall is part of the wall.
    let near = |i: usize| !rooms[i] && far_m[i] <= depth_m;
    let mut ink: Vec<bool> = (0..grid.len()).map(near).collect();
    thin(grid, &mut ink);
    let spur = (SPUR_M / grid.cell_m) as usize;
    let chains = without_spurs(grid, &mut ink, spur);
    let slack_m = STRAIGHT_M.max(STRAIGHT_CELLS * grid.cell_m);
    let lines = chains.into_iter().filter(|chain| chain.len() > 2);
    lines
        .map(|chain| fitted(&chain.iter().map(|&i| grid.middle(i)).collect::<Vec<_>>(), slack_m, grid.cell_m))
        .collect()
}

/// Returns the cells of all discs, wider than a slit, that fit into the rooms.
fn without_slits(grid: &Grid, rooms: Vec<bool>) -> Vec<bool> {
    let outside: Vec<bool> = rooms.iter().map(|room| !room).collect();
    let wide: Vec<bool> = grid.distances_m(&outside).into_iter().map(|depth_m| depth_m > SLIT_M).collect();
    let reach_m = SLIT_M + grid.cell_m / 2.0;
    let far_m = grid.distances_m(&wide);
    rooms.into_iter().zip(far_m).map(|(room, far_m)| room && far_m <= reach_m).collect()
}

/// Clears furniture from rooms, and returns the cells of each piece.
pub(crate) fn remove_furniture(solid: &mut Solid, regions: &Regions) -> Vec<Vec<usize>> {
    let grid = solid.grid.clone();
    let mut removed = Vec::new();
    let mut seen = vec![false; grid.len()];
    for i in 0..grid.len() {
        if !solid.cells[i] || seen[i] {
            continue;
        }
        let piece = connected(&grid, i, &solid.cells, &mut seen);
        if is_furniture(&grid, &piece, regions) {
            piece.iter().for_each(|&i| solid.cells[i] = false);
            removed.push(piece);
        }
    }
    removed
}

fn connected(grid: &Grid, from: usize, cells: &[bool], seen: &mut [bool]) -> Vec<usize> {
    let (mut found, mut waiting) = (Vec::new(), vec![from]);
    while let Some(i) = waiting.pop() {
        if cells[i] && !std::mem::replace(&mut seen[i], true) {
            found.push(i);
            waiting.extend(grid.around(i));
        }
    }
    found
}

fn is_furniture(grid: &Grid, piece: &[usize], regions: &Regions) -> bool {
    let places = || piece.iter().map(|&i| grid.middle(i));
    let low = places().fold(Vector2::repeat(f64::INFINITY), |low, p| low.inf(&p));
    let high = places().fold(Vector2::repeat(f64::NEG_INFINITY), |high, p| high.sup(&p));
    let mut around = piece.iter().flat_map(|&i| grid.around(i)).filter_map(|i| regions.at_cell(i));
    let first = around.next();
    (high - low).max() < FURNITURE_M && first.is_some() && around.all(|region| Some(region) == first)
}

/// Peels off cells, alternately from two sides, until only lines remain.
fn thin(grid: &Grid, ink: &mut [bool]) {
    loop {
        let mut peeled = 0;
        for second in [false, true] {
            let gone: Vec<usize> =
                (0..ink.len()).filter(|&i| ink[i] && may_go(grid, ink, i, second)).collect();
            peeled += gone.len();
            gone.into_iter().for_each(|i| ink[i] = false);
        }
        if peeled == 0 {
            return;
        }
    }
}

/// Returns true if a cell meets the conditions of Zhang and Suen for removal. The neighbours go around from the cell above.
fn may_go(grid: &Grid, ink: &[bool], i: usize, second: bool) -> bool {
    if grid.at_rim(i) {
        return true;
    }
    let w = grid.width;
    let ring = [i + w, i + w + 1, i + 1, i - w + 1, i - w, i - w - 1, i - 1, i + w - 1].map(|k| ink[k]);
    let neighbours = ring.iter().filter(|&&on| on).count();
    let steps = (0..8).filter(|&k| !ring[k] && ring[(k + 1) % 8]).count();
    let [north, _, east, _, south, _, west, _] = ring;
    let side = if second { !(north && west && (east || south)) } else { !(east && south && (north || west)) };
    (2..=6).contains(&neighbours) && steps == 1 && side
}

/// Follows the lines, removes short ones with a free end, and follows the rest again.
fn without_spurs(grid: &Grid, ink: &mut [bool], shortest: usize) -> Vec<Vec<usize>> {
    let is_spur = |chain: &Chain| chain.ends.contains(&End::Free) && chain.ends.contains(&End::Branch);
    for chain in chains(grid, ink) {
        if is_spur(&chain) && chain.cells.len() < shortest {
            let branch = if chain.ends[0] == End::Branch { 0 } else { chain.cells.len() - 1 };
            let spur = chain.cells.iter().enumerate().filter(|(k, _)| *k != branch);
            spur.for_each(|(_, &i)| ink[i] = false);
        }
    }
    let is_speck = |chain: &Chain| chain.ends == [End::Free; 2] && chain.cells.len() < shortest;
    let lines = chains(grid, ink).into_iter().filter(|chain| !is_speck(chain));
    lines.map(|chain| chain.cells).collect()
}

/// How a line ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    Free,
    Branch,
}

/// A line of cells, which either has two ends or is closed.
struct Chain {
    cells: Vec<usize>,
    ends: [End; 2],
}

/// Returns the neighbours of a cell along its line. A diagonal neighbour counts only if it cannot be reached across a side.
fn links(grid: &Grid, ink: &[bool], i: usize) -> Vec<usize> {
    let w = grid.width as i64;
    let on = |step: i64| ink.get((i as i64 + step) as usize).copied().unwrap_or(false);
    let sides = [1, w, -1, -w].into_iter().filter(|&step| on(step));
    let corners = [(1, w), (-1, w), (-1, -w), (1, -w)].into_iter();
    let corners = corners.filter(|&(a, b)| on(a + b) && !on(a) && !on(b)).map(|(a, b)| a + b);
    sides.chain(corners).map(|step| (i as i64 + step) as usize).collect()
}

fn chains(grid: &Grid, ink: &[bool]) -> Vec<Chain> {
    let degree = |i: usize| links(grid, ink, i).len();
    let mut used = vec![false; ink.len()];
    let mut found = Vec::new();
    let all = || (0..ink.len()).filter(|&i| ink[i]);
    for begin in all().filter(|&i| degree(i) != 2) {
        for next in links(grid, ink, begin) {
            if degree(next) != 2 && next < begin || degree(next) == 2 && used[next] {
                continue;
            }
            found.push(follow(grid, ink, begin, next, &mut used));
        }
    }
    for begin in all().filter(|&i| degree(i) == 2) {
        if !used[begin] {
            let next = links(grid, ink, begin)[0];
            found.push(follow(grid, ink, begin, next, &mut used));
        }
    }
    found
}

/// Follows a line from `begin` through `next` to the next branch or end, or back to `begin`.
fn follow(grid: &Grid, ink: &[bool], begin: usize, next: usize, used: &mut [bool]) -> Chain {
    let end = |i: usize| if links(grid, ink, i).len() == 1 { End::Free } else { End::Branch };
    let (mut cells, mut at) = (vec![begin], next);
    used[begin] = true;
    loop {
        let before = cells[cells.len() - 1];
        cells.push(at);
        let ahead = links(grid, ink, at);
        if ahead.len() != 2 || at == begin {
            return Chain { ends: [end(begin), end(at)], cells };
        }
        used[at] = true;
        at = if ahead[0] == before { ahead[1] } else { ahead[0] };
    }
}

/// Returns the line with its corners moved to where the straight pieces between them meet. Thinning rounds corners off by a cell,
/// so with the corner cells themselves, straight walls would be drawn slanted by that much.
fn fitted(line: &[Vector2<f64>], slack: f64, cell_m: f64) -> Vec<Vector2<f64>> {
    let corners = corners(line, slack);
    let pieces: Vec<_> =
        corners.windows(2).map(|ends| Piece::through(&line[ends[0]..=ends[1]], cell_m)).collect();
    let last = corners.len() - 1;
    let closed = line[0] == line[line.len() - 1];
    let before = |k: usize| if k == 0 { pieces.last().filter(|_| closed) } else { pieces.get(k - 1) };
    let after = |k: usize| if k == last { pieces.first().filter(|_| closed) } else { pieces.get(k) };
    let corner = |(k, &i): (usize, &usize)| match (before(k), after(k)) {
        (Some(a), Some(b)) => a.meets(b, line[i], MEET_CELLS * cell_m),
        (Some(piece), None) | (None, Some(piece)) => piece.foot(line[i]),
        (None, None) => line[i],
    };
    corners.iter().enumerate().map(corner).collect()
}

/// A straight piece of a wall: a point on it, and its direction.
struct Piece {
    at: Vector2<f64>,
    along: Vector2<f64>,
}

impl Piece {
    /// Fits a line to cells by least squares, leaving out the cells near the ends. In a raster, a slant of a cell or two cannot
    /// be distinguished from none.
    fn through(cells: &[Vector2<f64>], cell_m: f64) -> Self {
        let inner = if cells.len() > 4 * ROUND_CELLS {
            &cells[ROUND_CELLS..cells.len() - ROUND_CELLS]
        } else {
            cells
        };
        let count = inner.len() as f64;
        let at = inner.iter().sum::<Vector2<f64>>() / count;
        let [xx, xy, yy] = inner
            .iter()
            .map(|cell| cell - at)
            .fold([0.0; 3], |[xx, xy, yy], d| [xx + d.x * d.x, xy + d.x * d.y, yy + d.y * d.y]);
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
        let along = Vector2::new(angle.cos(), angle.sin());
        let slant = count * cell_m * along.abs().min();
        if slant >= SLANT_CELLS * cell_m {
            return Self { at, along };
        }
        let along = if along.x.abs() > along.y.abs() { Vector2::x() } else { Vector2::y() };
        let middle = |axis: usize| {
            let mut places: Vec<f64> = inner.iter().map(|cell| cell[axis]).collect();
            places.sort_by(f64::total_cmp);
            places[places.len() / 2]
        };
        Self { at: Vector2::new(middle(0), middle(1)), along }
    }

    /// Returns the point of the piece's line that is nearest to `place`.
    fn foot(&self, place: Vector2<f64>) -> Vector2<f64> {
        self.at + self.along * self.along.dot(&(place - self.at))
    }

    /// Returns the point near `near` where the piece meets another, or the point halfway between both if they do not meet near it.
    fn meets(&self, other: &Self, near: Vector2<f64>, within: f64) -> Vector2<f64> {
        let across = self.along.perp(&other.along);
        let meeting = self.at + self.along * ((other.at - self.at).perp(&other.along) / across);
        let is_near = across.abs() > 0.1 && (meeting - near).norm() <= within;
        if is_near { meeting } else { (self.foot(near) + other.foot(near)) / 2.0 }
    }
}

/// Returns the indices of the corners of a line, including its ends. No point of the line is farther than `slack` from the line
/// through the corners.
fn corners(line: &[Vector2<f64>], slack: f64) -> Vec<usize> {
    let end = line.len() - 1;
    let (first, last) = (line[0], line[end]);
    let beside = |p: &Vector2<f64>| {
        let along = last - first;
        if along.norm() < 1e-9 { (p - first).norm() } else { along.perp(&(p - first)).abs() / along.norm() }
    };
    let farthest = (1..end).max_by(|&a, &b| beside(&line[a]).total_cmp(&beside(&line[b])));
    match farthest.filter(|&i| beside(&line[i]) > slack) {
        None => vec![0, end],
        Some(i) => {
            let mut found = corners(&line[..=i], slack);
            found.pop();
            found.extend(corners(&line[i..], slack).into_iter().map(|k| i + k));
            found
        }
    }
}

#[cfg(test)]
mod tests {
    use sketchnav_sim::ros_map::{MapInfo, OccupancyMap};

    use crate::{Floor, deform};

    /// Creates a floor of two rooms, 12 m × 8 m in total, with a door between them and walls of `thick` cells of 5 cm.
    fn rooms(thick: usize) -> Floor {
        const SIZE: [usize; 2] = [280, 200];
        let wall = |x: usize, y: usize| {
            let on = |v: usize, from: usize| (from..from + thick).contains(&v);
            let within = (20..260).contains(&x) && (20..180).contains(&y);
            let ring = within && (on(x, 20) || on(x, 260 - thick) || on(y, 20) || on(y, 180 - thick));
            ring || within && on(x, 120) && !(90..110).contains(&y)
        };
        let mut picture = format!("P5\n{} {}\n255\n", SIZE[0], SIZE[1]).into_bytes();
        for y in 0..SIZE[1] {
            picture.extend((0..SIZE[0]).map(|x| if wall(x, y) { 0 } else { 254 }));
        }
        let yaml =
            "image: m.pgm\nresolution: 0.05\norigin: [0, 0, 0]\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
        let map = OccupancyMap::decode(&MapInfo::parse(yaml).unwrap(), &picture).unwrap();
        Floor::of_map(&map, "rooms").unwrap()
    }

    /// A straight wall of a map used to be drawn slanted by 5 px of 1320, because its corner was a cell that thinning had
    /// rounded off.
    #[test]
    fn straight_walls_are_drawn_straight_at_degree_0() {
        for thick in 2..=6 {
            let drawing = deform(&rooms(thick), 0.0, 1).unwrap();
            let mut length_px = 0.0;
            for pair in drawing.strokes.iter().flat_map(|stroke| stroke.points.windows(2)) {
                let [dx, dy] = [pair[1].x - pair[0].x, pair[1].y - pair[0].y].map(f64::abs);
                assert!(dx.min(dy) < 0.01, "{thick} cells: from {:?} to {:?}", pair[0], pair[1]);
                length_px += dx + dy;
            }
            // The length is once around the rooms, and once between them without the door, at 1200 px for 12 m. Both faces of a
            // thicker wall between rooms are drawn.
            let is_one_line = thick <= 4;
            assert!(!is_one_line || (4600.0..4850.0).contains(&length_px), "{thick} cells: {length_px}");
        }
    }
}

//! The walls of a raster as lines: the solid cells within a wall's thickness of a room, thinned to a
//! line, followed, and straightened.
//!
//! Thinning: Zhang and Suen, *A fast parallel algorithm for thinning digital patterns*, 1984.
//! Straightening: Douglas and Peucker, 1973.

use nalgebra::Vector2;

use crate::grid::{Grid, Solid};
use crate::regions::Regions;

/// How deep behind a room's border a wall is looked for; what is solid beyond belongs to no line.
const DEPTH_M: f64 = 0.15;
/// A side line that is shorter is the thinning's, not the wall's; a line apart that is shorter is a speck.
const SPUR_M: f64 = 0.4;
/// Part of a room that is narrower than twice this is a slit between two faces of a wall: one line is drawn.
const SLIT_M: f64 = 0.13;
/// How far a straightened line may lie beside the cells, and at least so many cells.
const STRAIGHT_M: f64 = 0.1;
const STRAIGHT_CELLS: f64 = 1.2;
/// Something solid that is smaller both ways, and stands within a single region, is furniture.
const FURNITURE_M: f64 = 2.0;

/// The middle lines of the walls around the regions.
pub(crate) fn walls(solid: &Solid, regions: &Regions) -> Vec<Vec<Vector2<f64>>> {
    let grid = &solid.grid;
    let rooms = without_slits(grid, (0..grid.len()).map(|i| regions.at_cell(i).is_some()).collect());
    let far_m = grid.distances_m(&rooms);
    let depth_m = DEPTH_M.max(1.5 * grid.cell_m);
    // A pocket within a wall is wall.
    let near = |i: usize| !rooms[i] && far_m[i] <= depth_m;
    let mut ink: Vec<bool> = (0..grid.len()).map(near).collect();
    thin(grid, &mut ink);
    let spur = (SPUR_M / grid.cell_m) as usize;
    let chains = without_spurs(grid, &mut ink, spur);
    let slack_m = STRAIGHT_M.max(STRAIGHT_CELLS * grid.cell_m);
    let lines = chains.into_iter().filter(|chain| chain.len() > 2);
    lines
        .map(|chain| straightened(&chain.iter().map(|&i| grid.middle(i)).collect::<Vec<_>>(), slack_m))
        .collect()
}

/// The cells of all discs that fit into the rooms.
fn without_slits(grid: &Grid, rooms: Vec<bool>) -> Vec<bool> {
    let outside: Vec<bool> = rooms.iter().map(|room| !room).collect();
    let wide: Vec<bool> = grid.distances_m(&outside).into_iter().map(|depth_m| depth_m > SLIT_M).collect();
    let reach_m = SLIT_M + grid.cell_m / 2.0;
    let far_m = grid.distances_m(&wide);
    rooms.into_iter().zip(far_m).map(|(room, far_m)| room && far_m <= reach_m).collect()
}

/// Clears what stands around in rooms; the cells of each piece.
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

/// Peels the cells until lines are left, alternately from the two sides.
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

/// The conditions of Zhang and Suen; neighbours in turn from the cell above.
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

/// Follows the lines; those that end freely and are short go, and what is left is followed again.
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

/// A line of cells between two ends, or around.
struct Chain {
    cells: Vec<usize>,
    ends: [End; 2],
}

/// Neighbours along the line: a diagonal one counts only where no side leads there.
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

/// From `begin` over `next` to the next branch or end, or back to `begin`.
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

/// The corners of a line: no place of it lies farther than `slack` beside the line through them.
pub(crate) fn straightened(line: &[Vector2<f64>], slack: f64) -> Vec<Vector2<f64>> {
    let (first, last) = (line[0], line[line.len() - 1]);
    let beside = |p: &Vector2<f64>| {
        let along = last - first;
        if along.norm() < 1e-9 { (p - first).norm() } else { along.perp(&(p - first)).abs() / along.norm() }
    };
    let farthest =
        (1..line.len().saturating_sub(1)).max_by(|&a, &b| beside(&line[a]).total_cmp(&beside(&line[b])));
    match farthest.filter(|&i| beside(&line[i]) > slack) {
        None => vec![first, last],
        Some(i) => {
            let mut corners = straightened(&line[..=i], slack);
            corners.pop();
            corners.extend(straightened(&line[i..], slack));
            corners
        }
    }
}

//! Outlines of sets of cells as polygons. Coordinates are in metres, in frame `World`.

use crate::grid::Grid;

/// Returns the outline of a set, traced from its lowest cell all the way around, with its cells on the left. Holes in the set and
/// separate pieces are not part of the outline. Returns an empty outline for an empty set.
pub(crate) fn polygon(grid: &Grid, belongs: impl Fn(usize) -> bool) -> Vec<[f64; 2]> {
    let Some(first) = (0..grid.len()).find(|&i| belongs(i)) else { return Vec::new() };
    let inside = |x: i64, y: i64| {
        let within = (0..grid.width as i64).contains(&x) && (0..grid.height as i64).contains(&y);
        within && belongs(y as usize * grid.width + x as usize)
    };
    let begin = [(first % grid.width) as i64, (first / grid.width) as i64];
    let (mut at, mut step) = (begin, [1, 0]);
    let mut corners = Vec::new();
    loop {
        let next = turn(at, step, &inside);
        if next != step || corners.is_empty() {
            corners.push(at);
        }
        step = next;
        at = [at[0] + step[0], at[1] + step[1]];
        if at == begin && turn(at, step, &inside) == [1, 0] {
            break;
        }
    }
    let place = |corner: [i64; 2]| [0, 1].map(|axis| grid.origin[axis] + corner[axis] as f64 * grid.cell_m);
    corners.into_iter().map(place).collect()
}

/// Returns the next step from a corner that was reached by `step`: to the right if a cell is there, otherwise straight on if
/// possible, otherwise to the left.
fn turn(at: [i64; 2], step: [i64; 2], inside: &impl Fn(i64, i64) -> bool) -> [i64; 2] {
    let right = [step[1], -step[0]];
    let left = [-step[1], step[0]];
    // The cell to the left of an edge that begins at `at`, given its direction.
    let cell = |edge: [i64; 2]| match edge {
        [1, 0] => inside(at[0], at[1]),
        [0, 1] => inside(at[0] - 1, at[1]),
        [-1, 0] => inside(at[0] - 1, at[1] - 1),
        _ => inside(at[0], at[1] - 1),
    };
    [left, step, right].into_iter().rfind(|&edge| edge_is_border(cell, edge)).unwrap_or(left)
}

/// Returns true if an edge has a cell of the set on its left and none on its right. The cell on its right is the one to the
/// left of the edge that results from turning right.
fn edge_is_border(cell: impl Fn([i64; 2]) -> bool, edge: [i64; 2]) -> bool {
    cell(edge) && !cell([edge[1], -edge[0]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;

    fn outline(rows: &[&str]) -> Vec<[f64; 2]> {
        let (width, height) = (rows[0].len(), rows.len());
        let grid = Grid { width, height, cell_m: 1.0, origin: Vector2::zeros() };
        let cell = |i: usize| rows[height - 1 - i / width].as_bytes()[i % width] == b'#';
        polygon(&grid, cell)
    }

    #[test]
    fn the_outline_follows_corners() {
        let corners = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        assert_eq!(outline(&["#..", "##."]), corners);
    }

    #[test]
    fn the_outline_closes_around_cells_that_touch_at_a_corner() {
        let outline = outline(&[".##", "##.", "..#"]);
        assert!(outline.len() >= 4, "{outline:?}");
    }

    #[test]
    fn an_empty_grid_has_no_outline() {
        assert!(outline(&["..", ".."]).is_empty());
    }
}

//! Finds the best pose on a raster of cells and angles, by branch and bound (Hess et al. 2016, algorithm 2). A block of shifts is
//! searched only if its bound beats the best pose so far, so the result is as good as that of a full search.

use sketchnav_schemas::geometry::Pose;

use super::Prior;
use super::field::{BLOCKS, Field};
use crate::grid::floor;
use crate::{Map, Parameters};

/// Maximum number of angles to try. The step between angles grows if the window would need more.
const MAX_ANGLES: usize = 161;
const COARSEST: usize = BLOCKS.len() - 1;

/// Extent of the search on either side of the prior.
#[derive(Debug, Clone, Copy)]
pub(super) struct Window {
    pub half_m: f64,
    pub half_rad: f64,
}

/// A block of shifts at one angle.
#[derive(Debug, Clone, Copy)]
struct Node {
    angle: usize,
    shift: [i32; 2],
    level: usize,
    bound: f64,
}

/// Working memory of a search.
#[derive(Debug)]
pub(super) struct Search {
    /// For each angle, the cells that the points fall into, counted from the field's corner.
    cells: Vec<[i32; 2]>,
    nodes: Vec<Node>,
}

/// The input of a search.
struct Problem<'a> {
    field: &'a Field,
    cells: &'a [[i32; 2]],
    points: usize,
    half: i32,
    middle_angle: usize,
    step_rad: f64,
    /// Half the inverse variances of position and heading, per square cell and per square radian.
    weights: [f64; 2],
    evidence: f64,
}

impl Search {
    pub fn new(parameters: &Parameters) -> Self {
        let per_side = (2.0 * parameters.window_max_m / parameters.cell_m) as usize / BLOCKS[COARSEST] + 2;
        Self {
            cells: Vec::with_capacity(MAX_ANGLES * parameters.max_points),
            // Room for all blocks of all angles and, on the way down, three siblings per level.
            nodes: Vec::with_capacity(MAX_ANGLES * per_side * per_side + 4 * BLOCKS.len()),
        }
    }

    /// Returns the pose on the raster with the largest posterior.
    pub fn best(
        &mut self,
        field: &Field,
        points: &[[f64; 2]],
        prior: &Prior,
        window: &Window,
        evidence: f64,
    ) -> Pose<Map> {
        let farthest = points.iter().map(|p| p[0].hypot(p[1])).fold(1.0, f64::max);
        let step_rad = (field.cell_m() / farthest).max(2.0 * window.half_rad / (MAX_ANGLES - 3) as f64);
        let to_side = (window.half_rad / step_rad).ceil() as usize;
        let angles = 2 * to_side + 1;
        self.place_points(field, points, prior, angles, step_rad);
        let problem = Problem {
            field,
            cells: &self.cells,
            points: points.len(),
            half: (window.half_m / field.cell_m()).ceil() as i32,
            middle_angle: to_side,
            step_rad,
            weights: [
                0.5 * (field.cell_m() / prior.sigma_m).powi(2),
                0.5 / (prior.sigma_rad * prior.sigma_rad),
            ],
            evidence,
        };
        let found = problem.solve(&mut self.nodes, angles);
        let [x, y] = found.shift.map(|cells| f64::from(cells) * field.cell_m());
        let turn = (found.angle as f64 - to_side as f64) * step_rad;
        Pose::new(prior.pose.x + x, prior.pose.y + y, prior.pose.yaw_rad + turn)
    }

    fn place_points(&mut self, field: &Field, points: &[[f64; 2]], prior: &Prior, angles: usize, step: f64) {
        self.cells.clear();
        for k in 0..angles {
            let yaw = prior.pose.yaw_rad + (k as f64 - (angles / 2) as f64) * step;
            let (sin, cos) = yaw.sin_cos();
            self.cells.extend(points.iter().map(|[x, y]| {
                let x_m = prior.pose.x + cos * x - sin * y;
                let y_m = prior.pose.y + sin * x + cos * y;
                let [low_x, low_y] = field.low();
                [floor(x_m / field.cell_m()) - low_x, floor(y_m / field.cell_m()) - low_y]
            }));
        }
    }
}

impl Problem<'_> {
    fn solve(&self, nodes: &mut Vec<Node>, angles: usize) -> Node {
        nodes.clear();
        let block = BLOCKS[COARSEST] as i32;
        let per_side = (2 * self.half) / block + 1;
        for angle in 0..angles {
            for k in 0..per_side * per_side {
                let shift = [k % per_side, k / per_side].map(|at| at * block - self.half);
                nodes.push(self.node(angle, shift, COARSEST));
            }
        }
        // Sorts the best block last. Ties are broken by angle and shift, so that the order is deterministic.
        let order = |a: &Node, b: &Node| {
            a.bound.total_cmp(&b.bound).then(b.angle.cmp(&a.angle)).then(b.shift.cmp(&a.shift))
        };
        nodes.sort_unstable_by(order);
        let mut best = self.node(self.middle_angle, [0, 0], 0);
        while let Some(node) = nodes.pop() {
            if node.bound <= best.bound {
                continue;
            }
            if node.level == 0 {
                best = node;
                continue;
            }
            let half = BLOCKS[node.level - 1] as i32;
            let first = nodes.len();
            for [x, y] in [[0, 0], [half, 0], [0, half], [half, half]] {
                let shift = [node.shift[0] + x, node.shift[1] + y];
                if shift.iter().all(|&at| at <= self.half) {
                    nodes.push(self.node(node.angle, shift, node.level - 1));
                }
            }
            nodes[first..].sort_unstable_by(order);
        }
        best
    }

    /// Creates the node of a block, with an upper bound of the posterior in the block. The bound is exact for a single shift.
    fn node(&self, angle: usize, shift: [i32; 2], level: usize) -> Node {
        let cells = &self.cells[angle * self.points..][..self.points];
        let sum: u32 = cells
            .iter()
            .map(|cell| u32::from(self.field.block(level, [cell[0] + shift[0], cell[1] + shift[1]])))
            .sum();
        let last = BLOCKS[level] as i32 - 1;
        let nearest = shift.map(|at| f64::from(if at > 0 { at } else { (at + last).min(0) }));
        let turn = (angle as f64 - self.middle_angle as f64) * self.step_rad;
        let prior =
            self.weights[0] * (nearest[0].powi(2) + nearest[1].powi(2)) + self.weights[1] * turn * turn;
        let bound = self.evidence * f64::from(sum) / (255.0 * self.points as f64) - prior;
        Node { angle, shift, level, bound }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::occupancy::Occupancy;
    use proptest::prelude::*;

    fn field(walls: &[[i32; 2]]) -> Field {
        let parameters = Parameters { max_tiles: 64, extent_m: 10.0, ..Parameters::default() };
        let mut map = Occupancy::new(&parameters);
        let mut touched = Vec::new();
        let mut scan = map.scan(&mut touched);
        walls.iter().for_each(|&cell| scan.hit(cell));
        drop(scan);
        let mut field = Field::new(0.05, 4.0, 0.08);
        field.rebuild(&map, [0, 0]);
        field
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(2), ..ProptestConfig::default() })]

        #[test]
        fn branch_and_bound_agrees_with_an_exhaustive_search(
            walls in proptest::collection::vec([-40..40i32, -40..40i32], 1..60),
            points in proptest::collection::vec([-2.0..2.0f64, -2.0..2.0f64], 1..40),
            x in -0.3..0.3f64, yaw in -3.0..3.0f64, half_m in 0.0..0.6f64, half_rad in 0.0..0.3f64,
        ) {
            let field = field(&walls);
            let prior = Prior { pose: Pose::new(x, 0.1, yaw), sigma_m: 0.2, sigma_rad: 0.1 };
            let mut search = Search::new(&Parameters::default());
            let window = Window { half_m, half_rad };
            let found = search.best(&field, &points, &prior, &window, 60.0);
            let problem = Problem {
                field: &field, cells: &search.cells, points: points.len(),
                half: (half_m / 0.05).ceil() as i32,
                middle_angle: search.cells.len() / points.len() / 2,
                step_rad: (0.05 / points.iter().map(|p| p[0].hypot(p[1])).fold(1.0, f64::max)).max(2.0 * half_rad / 158.0),
                weights: [0.5 * (0.05f64 / 0.2).powi(2), 0.5 / 0.01], evidence: 60.0,
            };
            let shifts = || (-problem.half..=problem.half).flat_map(|x| (-problem.half..=problem.half).map(move |y| [x, y]));
            let angles = 0..search.cells.len() / points.len();
            let best = angles.flat_map(|k| shifts().map(move |s| (k, s))).map(|(k, s)| problem.node(k, s, 0).bound).fold(f64::MIN, f64::max);
            let shift = [(found.x - x) / 0.05, (found.y - 0.1) / 0.05].map(|at| at.round() as i32);
            let angle = ((found.yaw_rad - yaw) / problem.step_rad).round() as i64 + problem.middle_angle as i64;
            prop_assert_eq!(problem.node(angle as usize, shift, 0).bound, best);
        }
    }
}

//! Finds out whether a drawing looks the same after half a turn, as many office floors do, and whether the robot has seen anything
//! there that tells the two halves apart.
//!
//! Scattered particles agree on one of two places that look the same sooner or later, because resampling favours one of two equals
//! by chance. Therefore, they count as agreed only once the scans have been much likelier at their place than at its twin.

use std::f32::consts::PI;

use super::Filter;
use super::grid::Grid;
use super::metric::wrap;
use super::scales::ScaledPose;

/// Minimum share of the walls that must lie on walls after half a turn.
const ALIKE: f32 = 0.9;
/// Distance within which a point lies on a wall, as a share of the drawing's extent.
const WITHIN: f32 = 0.015;
/// Number of coarse steps, in each direction, by which the centre may differ from that of the walls' bounding box. A step is half of
/// the distance above, and the best of them is refined to a cell.
const COARSE: i32 = 8;
/// Maximum number of points on walls that are compared.
const MOST_POINTS: usize = 800;

/// Odds of a place against its twin at which scattered particles are believed.
pub(super) const ODDS_AGAINST_TWIN: f32 = 20.0;
/// Size of the first steps, in metres and in radians, of the search for the best fit near a pose. Each of the rounds halves them.
const NEAR_M: f32 = 0.2;
const NEAR_RAD: f32 = 0.05;
const ROUNDS: i32 = 3;

/// A half turn after which the drawing looks the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfTurn {
    /// The sum of any place and its twin, in pixels.
    sum_px: [f32; 2],
}

impl HalfTurn {
    /// Returns the half turn after which a drawing looks the same, if there is one.
    pub fn of(grid: &Grid) -> Option<Self> {
        let walls = Walls::of(grid)?;
        let (coarse_px, fine_px) = (0.5 * walls.within_px, grid.px_per_cell());
        let about = walls.best(Self { sum_px: walls.sum_px }, COARSE, coarse_px);
        let best = walls.best(about, (coarse_px / fine_px).ceil() as i32, fine_px);
        (walls.share_on_walls(&best) >= ALIKE).then_some(best)
    }

    /// Returns the pose that looks like this one.
    pub fn twin(&self, pose: &ScaledPose) -> ScaledPose {
        let [x_px, y_px] = self.place([pose.x_px, pose.y_px]);
        ScaledPose { x_px, y_px, yaw_rad: wrap(pose.yaw_rad + PI), ..*pose }
    }

    fn place(&self, [x_px, y_px]: [f32; 2]) -> [f32; 2] {
        [self.sum_px[0] - x_px, self.sum_px[1] - y_px]
    }
}

impl Filter {
    /// Returns the half turn after which everything looks the same. If the heading is known, there is none.
    fn confusing_turn(&self) -> Option<HalfTurn> {
        self.half_turn.filter(|_| self.state.is_kidnapped || self.start.has_any_heading())
    }

    /// Returns true if the particles have not found the robot, and may never find it, because the drawing looks the same after half
    /// a turn.
    pub(super) fn is_ambiguous(&self) -> bool {
        self.is_unplaced() && self.confusing_turn().is_some()
    }

    /// Returns the log odds of the mode against its twin after the last scan. `before` are those before this scan, and `last` is the
    /// mode of that time, moved to where the robot is now. Infinite if there is no twin.
    ///
    /// Each of the two places is varied, since the halves of a drawing are never exactly alike.
    pub(super) fn ln_odds_against_twin(&mut self, before: f32, last: Option<ScaledPose>) -> f32 {
        let Some(turn) = self.confusing_turn() else { return f32::INFINITY };
        let mode = self.state.mode;
        let off_px = |pose: &ScaledPose| (pose.x_px - mode.x_px).hypot(pose.y_px - mode.y_px);
        let has_swapped = last.is_some_and(|last| off_px(&turn.twin(&last)) < off_px(&last));
        let before = if has_swapped { -before } else { before };
        let [here, there] = [mode, turn.twin(&mode)].map(|pose| self.best_fit_near(pose));
        before + self.independent_beams() * (here - there)
    }

    /// Returns the best fit of the last scan near a pose.
    fn best_fit_near(&mut self, mut pose: ScaledPose) -> f32 {
        let mut best = self.fit(&pose);
        for round in 0..ROUNDS {
            let share = 0.5_f32.powi(round);
            let step_px = share * NEAR_M * pose.a_pxpm.max(pose.b_pxpm);
            let steps = [[step_px, 0.0, 0.0], [0.0, step_px, 0.0], [0.0, 0.0, share * NEAR_RAD]];
            for [x_px, y_px, yaw_rad] in steps.into_iter().flat_map(|step| [step, step.map(|by| -by)]) {
                let near = ScaledPose {
                    x_px: pose.x_px + x_px,
                    y_px: pose.y_px + y_px,
                    yaw_rad: wrap(pose.yaw_rad + yaw_rad),
                    ..pose
                };
                let fit = self.fit(&near);
                if fit > best {
                    (best, pose) = (fit, near);
                }
            }
        }
        best
    }
}

/// The walls of a drawing.
struct Walls<'a> {
    grid: &'a Grid,
    points_px: Vec<[f32; 2]>,
    /// Sum of the lowest and the highest coordinates.
    sum_px: [f32; 2],
    within_px: f32,
}

impl<'a> Walls<'a> {
    fn of(grid: &'a Grid) -> Option<Self> {
        let ([width, height], steps) = (grid.cells(), grid.distance_steps());
        // The ring around the drawing is no wall.
        let is_drawn =
            |at: &usize| (1..width - 1).contains(&(at % width)) && (1..height - 1).contains(&(at / width));
        let surface: Vec<usize> = (0..steps.len()).filter(|at| steps[*at] == 0 && is_drawn(at)).collect();
        let middle = |cell: usize| (cell as f32 - 0.5) * grid.px_per_cell();
        let point = |at: &usize| [middle(at % width), middle(at / width)];
        let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        for place in surface.iter().map(point) {
            for axis in 0..2 {
                (low[axis], high[axis]) = (low[axis].min(place[axis]), high[axis].max(place[axis]));
            }
        }
        let every = surface.len().div_ceil(MOST_POINTS).max(1);
        (!surface.is_empty()).then(|| Self {
            grid,
            points_px: surface.iter().step_by(every).map(point).collect(),
            sum_px: [low[0] + high[0], low[1] + high[1]],
            within_px: WITHIN * (high[0] - low[0]).max(high[1] - low[1]),
        })
    }

    /// Returns the best half turn within some steps of another.
    fn best(&self, about: HalfTurn, steps: i32, step_px: f32) -> HalfTurn {
        let offsets = (-steps..=steps).flat_map(|i| (-steps..=steps).map(move |j| [i, j]));
        let turns = offsets.map(|offset| {
            let sum_px = [0, 1].map(|axis| about.sum_px[axis] + offset[axis] as f32 * step_px);
            HalfTurn { sum_px }
        });
        let judged = turns.map(|turn| (self.agreement(&turn), turn));
        judged.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(about, |(_, turn)| turn)
    }

    /// Returns how well walls lie on walls after a half turn. It is largest if they lie on them exactly.
    fn agreement(&self, turn: &HalfTurn) -> f32 {
        self.off_px(turn).map(|off_px| (self.within_px - off_px).max(0.0)).sum()
    }

    fn share_on_walls(&self, turn: &HalfTurn) -> f32 {
        let on_walls = self.off_px(turn).filter(|off_px| *off_px <= self.within_px);
        on_walls.count() as f32 / self.points_px.len() as f32
    }

    /// Returns the distance of each point from the nearest wall after a half turn.
    fn off_px(&self, turn: &HalfTurn) -> impl Iterator<Item = f32> {
        self.points_px.iter().map(|place| self.grid.surface_px(turn.place(*place)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sketch::SketchGrid;
    use sketchnav_schemas::codes::{FREE, WALL};

    const SIZE: [usize; 2] = [360, 240];
    const ROUND: [[f32; 4]; 3] =
        [[40.0, 30.0, 320.0, 210.0], [40.0, 30.0, 160.0, 100.0], [200.0, 140.0, 320.0, 210.0]];

    /// Draws the outlines of boxes, each from two corners.
    fn half_turn(boxes: &[[f32; 4]]) -> Option<HalfTurn> {
        let is_wall = |x: f32, y: f32| {
            boxes.iter().any(|[left, low, right, high]| {
                let is_within =
                    |by: f32| (left - by..right + by).contains(&x) && (low - by..high + by).contains(&y);
                is_within(2.0) && !is_within(-2.0)
            })
        };
        let cell = |k: usize| {
            if is_wall((k % SIZE[0]) as f32 + 0.5, (k / SIZE[0]) as f32 + 0.5) { WALL } else { FREE }
        };
        let cells: Vec<u8> = (0..SIZE[0] * SIZE[1]).map(cell).collect();
        HalfTurn::of(&Grid::new(&SketchGrid::new(SIZE[0], SIZE[1], &cells, 0.0).unwrap(), 500_000))
    }

    #[test]
    fn a_floor_that_looks_the_same_after_half_a_turn_has_twins() {
        let pose = ScaledPose { x_px: 60.0, y_px: 50.0, yaw_rad: 1.0, a_pxpm: 20.0, b_pxpm: 22.0 };
        let twin = half_turn(&ROUND).unwrap().twin(&pose);
        assert!((twin.x_px - 300.0).abs() <= 1.0 && (twin.y_px - 190.0).abs() <= 1.0, "{twin:?}");
        assert!((twin.yaw_rad - (1.0 - PI)).abs() < 1e-5, "{twin:?}");
        // A cupboard beside the wall and a line that sticks out are too little to tell the halves apart.
        let cupboard = [[40.0, 180.0, 50.0, 210.0], [320.0, 100.0, 326.0, 100.0]];
        let twin = half_turn(&[&ROUND[..], &cupboard].concat()).unwrap().twin(&pose);
        assert!((twin.x_px - 300.0).abs() <= 2.0 && (twin.y_px - 190.0).abs() <= 2.0, "{twin:?}");
    }

    #[test]
    fn other_floors_have_none() {
        assert_eq!(half_turn(&ROUND[..2]), None, "one room in a corner");
        let three = [ROUND[0], ROUND[1], [40.0, 140.0, 160.0, 210.0]];
        assert_eq!(half_turn(&three), None, "rooms on one side");
        assert_eq!(half_turn(&[]), None, "nothing is drawn");
    }
}

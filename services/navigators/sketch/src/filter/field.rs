//! The likelihood of a scan by the paper's likelihood field (Boniardi et al. 2015, equation 7).

use super::beams::Beams;
use super::grid::Grid;
use super::metric::PxFromBase;
use super::parameters::Parameters;

/// The likelihood field (Thrun, Burgard and Fox, section 6.4), which gives ln p of an end point as a function of its distance to
/// the nearest drawn wall.
#[derive(Debug, Clone)]
pub struct Field {
    cells: [usize; 2],
    px_per_cell: f32,
    /// Value of ln p for an end point in each cell.
    by_cell: Vec<f32>,
}

impl Field {
    /// Tabulates the field of a drawing with the mean scale `scale_pxpm`.
    pub fn new(grid: &Grid, parameters: &Parameters, scale_pxpm: f32) -> Self {
        let sigma_px = (parameters.field_sigma_m * scale_pxpm).max(grid.px_per_cell());
        let kernel = |step: u8| {
            let away = grid.distance_px(step) / sigma_px;
            let hit = (1.0 - parameters.field_random) * (-0.5 * away * away).exp();
            (hit + parameters.field_random.max(1e-3)).ln()
        };
        let by_step: Vec<f32> = (0..=u8::MAX).map(kernel).collect();
        let by_cell = grid.distance_steps().iter().map(|&step| by_step[usize::from(step)]).collect();
        Self { cells: grid.cells(), px_per_cell: grid.px_per_cell(), by_cell }
    }

    /// Returns the numbers of columns and rows, including the ring around the drawing.
    pub fn cells(&self) -> [usize; 2] {
        self.cells
    }

    /// Returns the length of a cell's side, in pixels.
    pub fn px_per_cell(&self) -> f32 {
        self.px_per_cell
    }

    /// Returns ln p of an end point in each cell, row by row from the bottom.
    pub fn by_cell(&self) -> &[f32] {
        &self.by_cell
    }

    /// Returns Σ ln p over the beams that returned. This is the plain equivalent of [`super::weighing`].
    pub fn log_likelihood(&self, beams: &Beams, place_px: [f32; 2], metric: &PxFromBase) -> f32 {
        let inverse = 1.0 / self.px_per_cell;
        let cell = |px: f32, size: usize| ((px * inverse + 1.0) as usize).min(size - 1);
        let [width, height] = self.cells;
        let mut sum = 0.0;
        for end_m in &beams.end_m {
            let end = metric.apply(end_m[0], end_m[1]);
            let (x, y) = (place_px[0] + end[0], place_px[1] + end[1]);
            sum += self.by_cell[cell(y, height) * width + cell(x, width)];
        }
        sum
    }
}

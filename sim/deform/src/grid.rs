//! A grid of cells over a floor. Coordinates are in metres, in frame `World`, and rows go from the bottom up.

use image::{GrayImage, Luma};
use imageproc::distance_transform::euclidean_squared_distance_transform;
use nalgebra::Vector2;
use sketchnav_schemas::bounds::MOST_MAP_CELLS;
use sketchnav_sim::convex::Convex;
use sketchnav_sim::description::WorldDescription;
use sketchnav_sim::ros_map::OccupancyMap;

use crate::error::DeformError;

/// Side length of a cell of a floor plan, in metres.
const PLAN_CELL_M: f64 = 0.05;
/// Width of the free margin around a floor plan, in metres. It joins the outside into one region.
const PLAN_RIM_M: f64 = 1.0;

/// Size and position of a grid.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Grid {
    pub width: usize,
    pub height: usize,
    pub cell_m: f64,
    pub origin: Vector2<f64>,
}

impl Grid {
    pub fn len(&self) -> usize {
        self.width * self.height
    }

    /// Returns the index of the cell at a point, or `None` outside the grid.
    pub fn index(&self, place: Vector2<f64>) -> Option<usize> {
        let cell = (place - self.origin) / self.cell_m;
        let within = cell.x >= 0.0 && cell.y >= 0.0;
        let (x, y) = (cell.x as usize, cell.y as usize);
        (within && x < self.width && y < self.height).then_some(y * self.width + x)
    }

    /// Returns the centre of a cell.
    pub fn middle(&self, i: usize) -> Vector2<f64> {
        let cell = Vector2::new((i % self.width) as f64 + 0.5, (i / self.width) as f64 + 0.5);
        self.origin + cell * self.cell_m
    }

    /// Returns the cells around a cell, of which there are up to eight.
    pub fn around(&self, i: usize) -> impl Iterator<Item = usize> {
        const STEPS: [(i64, i64); 8] = [(1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (-1, -1), (1, -1)];
        let (width, height) = (self.width as i64, self.height as i64);
        let (x, y) = (i as i64 % width, i as i64 / width);
        STEPS.into_iter().map(move |(dx, dy)| (x + dx, y + dy)).filter_map(move |(x, y)| {
            let within = (0..width).contains(&x) && (0..height).contains(&y);
            within.then_some((y * width + x) as usize)
        })
    }

    /// Returns true if a cell is on the rim of the grid.
    pub fn at_rim(&self, i: usize) -> bool {
        let (x, y) = (i % self.width, i / self.width);
        x == 0 || y == 0 || x + 1 == self.width || y + 1 == self.height
    }

    /// Returns the distance from each cell to the nearest of `cells`, in metres.
    pub fn distances_m(&self, cells: &[bool]) -> Vec<f64> {
        let mask = GrayImage::from_fn(self.width as u32, self.height as u32, |x, y| {
            Luma([if cells[y as usize * self.width + x as usize] { 255 } else { 0 }])
        });
        let squared = euclidean_squared_distance_transform(&mask);
        squared.iter().map(|squared| squared.sqrt() * self.cell_m).collect()
    }
}

/// The solid cells of a floor.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Solid {
    pub grid: Grid,
    pub cells: Vec<bool>,
}

/// Returns the lower left and the upper right corner of the box around some points.
fn extent<'a>(corners: impl Iterator<Item = &'a [f64; 2]> + Clone) -> [Vector2<f64>; 2] {
    let corners = corners.map(|corner| Vector2::from(*corner));
    let low = corners.clone().fold(Vector2::repeat(f64::INFINITY), |low, c| low.inf(&c));
    [low, corners.fold(Vector2::repeat(f64::NEG_INFINITY), |high, c| high.sup(&c))]
}

impl Solid {
    /// Fills the cells covered by the walls of a world, without its furniture.
    ///
    /// # Errors
    /// [`DeformError::TooLarge`] if the walls extend too far for a grid.
    pub fn of_walls(world: &WorldDescription) -> Result<Self, DeformError> {
        let [low, high] = extent(world.walls.iter().flat_map(|wall| wall.corners()));
        let low = low.add_scalar(-PLAN_RIM_M);
        let size = (high - low).add_scalar(PLAN_RIM_M) / PLAN_CELL_M;
        let (width, height) = (size.x.ceil() as usize, size.y.ceil() as usize);
        if width as u64 * height as u64 > MOST_MAP_CELLS {
            let found_m = [high.x - low.x, high.y - low.y].map(|side| side - PLAN_RIM_M);
            return Err(DeformError::TooLarge { name: world.name.clone(), found_m });
        }
        let grid = Grid { width, height, cell_m: PLAN_CELL_M, origin: low };
        let mut solid = Self { cells: vec![false; grid.len()], grid };
        world.walls.iter().for_each(|wall| solid.fill(wall));
        Ok(solid)
    }

    /// Copies the solid cells of a map, and surrounds them with a ring of solid cells.
    pub fn of_map(map: &OccupancyMap) -> Self {
        let (raster, cell_m) = (map.raster(), map.resolution_m());
        let (width, height) = (raster.size().0 + 2, raster.size().1 + 2);
        let origin = Vector2::from(map.origin_m()).add_scalar(-cell_m);
        let cell = |i: usize| raster.is_solid((i % width) as i64 - 1, (i / width) as i64 - 1);
        let cells = (0..width * height).map(cell).collect();
        Self { grid: Grid { width, height, cell_m, origin }, cells }
    }

    fn fill(&mut self, wall: &Convex) {
        let [low, high] = extent(wall.corners().iter());
        let cell = |place: Vector2<f64>| (place - self.grid.origin) / self.grid.cell_m;
        let (from, to) = (cell(low), cell(high));
        let columns = from.x.max(0.0) as usize..(to.x.ceil() as usize).min(self.grid.width);
        let rows = from.y.max(0.0) as usize..(to.y.ceil() as usize).min(self.grid.height);
        let width = self.grid.width;
        for i in rows.flat_map(|y| columns.clone().map(move |x| y * width + x)) {
            let p = self.grid.middle(i);
            let left =
                |[a, b]: [[f64; 2]; 2]| (b[0] - a[0]) * (p.y - a[1]) - (b[1] - a[1]) * (p.x - a[0]) >= 0.0;
            self.cells[i] = self.cells[i] || wall.edges().all(left);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A floor of 20 km by 20 km would have 160 billion cells.
    #[test]
    fn a_floor_too_large_for_a_grid_is_refused() {
        let wall = |side: f64| Convex::rectangle([0.0, 0.0], [side, side], 0.0);
        let world = |side: f64| WorldDescription {
            name: "plain".into(),
            walls: vec![wall(side)],
            ..Default::default()
        };
        let error = Solid::of_walls(&world(20_000.0)).unwrap_err().to_string();
        assert!(
            error.starts_with("plain: expected a floor of at most 40000 m², found 20000 m x 20000 m"),
            "{error}"
        );
        let solid = Solid::of_walls(&world(2.0)).unwrap();
        assert_eq!(solid.cells.iter().filter(|&&cell| cell).count(), 40 * 40);
    }
}

//! Cells over a floor: which place is which cell. Metres, frame `World`; rows from the bottom up.

use image::{GrayImage, Luma};
use imageproc::distance_transform::euclidean_squared_distance_transform;
use nalgebra::Vector2;
use sketchnav_sim::convex::Convex;
use sketchnav_sim::description::WorldDescription;
use sketchnav_sim::ros_map::OccupancyMap;

/// Side of a cell of a floor plan.
const PLAN_CELL_M: f64 = 0.05;
/// What is left free around a floor plan, so that its outside is one region.
const PLAN_RIM_M: f64 = 1.0;

/// Where cells lie.
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

    /// The cell at a place, `None` outside.
    pub fn index(&self, place: Vector2<f64>) -> Option<usize> {
        let cell = (place - self.origin) / self.cell_m;
        let within = cell.x >= 0.0 && cell.y >= 0.0;
        let (x, y) = (cell.x as usize, cell.y as usize);
        (within && x < self.width && y < self.height).then_some(y * self.width + x)
    }

    /// The middle of a cell.
    pub fn middle(&self, i: usize) -> Vector2<f64> {
        let cell = Vector2::new((i % self.width) as f64 + 0.5, (i / self.width) as f64 + 0.5);
        self.origin + cell * self.cell_m
    }

    /// The up to eight cells around a cell.
    pub fn around(&self, i: usize) -> impl Iterator<Item = usize> {
        const STEPS: [(i64, i64); 8] = [(1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (-1, -1), (1, -1)];
        let (width, height) = (self.width as i64, self.height as i64);
        let (x, y) = (i as i64 % width, i as i64 / width);
        STEPS.into_iter().map(move |(dx, dy)| (x + dx, y + dy)).filter_map(move |(x, y)| {
            let within = (0..width).contains(&x) && (0..height).contains(&y);
            within.then_some((y * width + x) as usize)
        })
    }

    /// Whether a cell lies at the rim.
    pub fn at_rim(&self, i: usize) -> bool {
        let (x, y) = (i % self.width, i / self.width);
        x == 0 || y == 0 || x + 1 == self.width || y + 1 == self.height
    }

    /// Distance of each cell to the nearest of `cells`, metres.
    pub fn distances_m(&self, cells: &[bool]) -> Vec<f64> {
        let mask = GrayImage::from_fn(self.width as u32, self.height as u32, |x, y| {
            Luma([if cells[y as usize * self.width + x as usize] { 255 } else { 0 }])
        });
        let squared = euclidean_squared_distance_transform(&mask);
        squared.iter().map(|squared| squared.sqrt() * self.cell_m).collect()
    }
}

/// Which cells of a floor are solid.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Solid {
    pub grid: Grid,
    pub cells: Vec<bool>,
}

impl Solid {
    /// The walls of a world, without its furniture.
    pub fn of_walls(world: &WorldDescription) -> Self {
        let corners = || world.walls.iter().flat_map(|wall| wall.corners()).map(|c| Vector2::from(*c));
        let low =
            corners().fold(Vector2::repeat(f64::INFINITY), |low, c| low.inf(&c)).add_scalar(-PLAN_RIM_M);
        let high = corners().fold(Vector2::repeat(f64::NEG_INFINITY), |high, c| high.sup(&c));
        let size = (high - low).add_scalar(PLAN_RIM_M) / PLAN_CELL_M;
        let (width, height) = (size.x.ceil() as usize, size.y.ceil() as usize);
        let grid = Grid { width, height, cell_m: PLAN_CELL_M, origin: low };
        let mut solid = Self { cells: vec![false; grid.len()], grid };
        world.walls.iter().for_each(|wall| solid.fill(wall));
        solid
    }

    /// The solid cells of a map, and a ring of solid cells around them.
    pub fn of_map(map: &OccupancyMap) -> Self {
        let (raster, cell_m) = (map.raster(), map.resolution_m());
        let (width, height) = (raster.size().0 + 2, raster.size().1 + 2);
        let origin = Vector2::from(map.origin_m()).add_scalar(-cell_m);
        let cell = |i: usize| raster.is_solid((i % width) as i64 - 1, (i / width) as i64 - 1);
        let cells = (0..width * height).map(cell).collect();
        Self { grid: Grid { width, height, cell_m, origin }, cells }
    }

    fn fill(&mut self, wall: &Convex) {
        for i in 0..self.cells.len() {
            let p = self.grid.middle(i);
            let left =
                |[a, b]: [[f64; 2]; 2]| (b[0] - a[0]) * (p.y - a[1]) - (b[1] - a[1]) * (p.x - a[0]) >= 0.0;
            self.cells[i] = self.cells[i] || wall.edges().all(left);
        }
    }
}

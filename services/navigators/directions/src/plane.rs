//! The world: identical dots on a plane, with a uniform grid that finds the dots in a rectangle.
//!
//! The grid has about one dot per cell, so a query takes time proportional to the number of dots that it finds. The dots are
//! stored in the order of their cells, so each row of cells is a contiguous slice.

use std::sync::Arc;

use crate::error::Error;
use crate::geometry::Point;
use crate::markers::{LandmarkKind, Markers, Shown};
use crate::walls::Walls;

/// The number of a dot, from 0.
pub type DotId = u32;

/// Maximum magnitude of a coordinate.
pub const LIMIT: f64 = 1e9;
/// Maximum number of dots.
const MOST_DOTS: usize = 1 << 28;

/// A plane of dots, no two of which have the same position.
#[derive(Debug, Clone, PartialEq)]
pub struct Plane {
    dots: Vec<Point>,
    bounds: (Point, Point),
    grid: Grid,
    walls: Arc<Walls>,
    markers: Option<Arc<Markers>>,
}

/// Dots sorted by the cells of a uniform grid, with the rows starting in the south.
#[derive(Debug, Clone, PartialEq)]
struct Grid {
    south_west: Point,
    cell: f64,
    columns: usize,
    rows: usize,
    /// Index in `sorted` at which each cell begins, and the end of the last cell.
    begins: Vec<u32>,
    sorted: Vec<(DotId, Point)>,
}

impl Plane {
    /// Creates a plane from its dots. Rejects an empty list, invalid coordinates, and two dots with the same position.
    pub fn new(dots: Vec<Point>) -> Result<Self, Error> {
        if dots.is_empty() {
            return Err(Error::NoDots);
        }
        if dots.len() > MOST_DOTS {
            return Err(Error::TooManyDots { limit: MOST_DOTS, found: dots.len() });
        }
        let is_good = |value: f64| value.is_finite() && value.abs() <= LIMIT;
        if let Some(dot) = dots.iter().position(|dot| !is_good(dot.x) || !is_good(dot.y)) {
            return Err(Error::Coordinate { dot, x: dots[dot].x, y: dots[dot].y, limit: LIMIT });
        }
        let grid = Grid::new(&dots);
        grid.same_place()?;
        Ok(Self { bounds: bounds(&dots), dots, grid, walls: Arc::default(), markers: None })
    }

    /// Returns the same dots, standing among walls.
    pub fn among(self, walls: Arc<Walls>) -> Self {
        Self { walls, ..self }
    }

    /// Returns the same dots with markers, which show their kinds to a robot.
    pub fn marked(self, markers: Option<Arc<Markers>>) -> Self {
        Self { markers, ..self }
    }

    /// Returns the markers on the dots, if there are any.
    pub fn markers(&self) -> Option<&Arc<Markers>> {
        self.markers.as_ref()
    }

    /// Returns the kind of a dot, if it has a marker.
    pub fn kind(&self, dot: DotId) -> Option<LandmarkKind> {
        self.markers.as_ref()?.kind(dot)
    }

    /// Returns the kind of a dot if a robot's camera may see it. `at` is the dot's position relative to the robot.
    pub fn shown(&self, dot: DotId, at: Point) -> Option<Shown> {
        self.markers.as_ref()?.shown(dot, at)
    }

    /// Returns the walls that stand among the dots. Above a plane, there are none.
    pub fn walls(&self) -> &Arc<Walls> {
        &self.walls
    }

    /// Returns the dots, indexed by their numbers.
    pub fn dots(&self) -> &[Point] {
        &self.dots
    }

    /// Returns the number of dots, which is never 0.
    #[allow(clippy::len_without_is_empty, reason = "a plane is never empty")]
    pub fn len(&self) -> usize {
        self.dots.len()
    }

    /// Returns the position of a dot.
    pub fn dot(&self, id: DotId) -> Point {
        self.dots[id as usize]
    }

    /// Returns the number of a dot, or [`Error::UnknownDot`] if the plane doesn't have it.
    pub fn known(&self, dot: DotId) -> Result<DotId, Error> {
        if (dot as usize) < self.len() { Ok(dot) } else { Err(Error::UnknownDot { dot, dots: self.len() }) }
    }

    /// Returns the south-west and north-east corners of the smallest rectangle that contains all dots.
    pub fn bounds(&self) -> (Point, Point) {
        self.bounds
    }

    /// Returns the bounds of the dots, enlarged by a margin on each side.
    pub fn bounds_with_margin(&self, margin: f64) -> (Point, Point) {
        let half = Point::new(margin, margin);
        (self.bounds.0 - half, self.bounds.1 + half)
    }

    /// Iterates over the dots in a rectangle, including its edges, in a fixed order.
    pub fn within(&self, south_west: Point, north_east: Point) -> impl Iterator<Item = (DotId, Point)> + '_ {
        self.grid.within(south_west, north_east)
    }

    /// Iterates over the dots in the square that extends by `reach` to each side of a point, including its edges.
    pub fn around(&self, centre: Point, reach: f64) -> impl Iterator<Item = (DotId, Point)> + '_ {
        let half = Point::new(reach, reach);
        self.within(centre - half, centre + half)
    }
}

fn bounds(dots: &[Point]) -> (Point, Point) {
    dots.iter().fold((dots[0], dots[0]), |(low, high), dot| {
        (Point::new(low.x.min(dot.x), low.y.min(dot.y)), Point::new(high.x.max(dot.x), high.y.max(dot.y)))
    })
}

impl Grid {
    fn new(dots: &[Point]) -> Self {
        let (south_west, north_east) = bounds(dots);
        let extent = north_east - south_west;
        let count = dots.len() as f64;
        // There is about one dot per cell, and never many more cells than dots, however narrow the plane is.
        let cell = (extent.x * extent.y / count).sqrt().max(extent.x.max(extent.y) / count);
        let cell = if cell > 0.0 { cell } else { 1.0 };
        let columns = (extent.x / cell) as usize + 1;
        let rows = (extent.y / cell) as usize + 1;
        let mut grid =
            Self { south_west, cell, columns, rows, begins: vec![0; columns * rows + 1], sorted: Vec::new() };
        grid.sort(dots);
        grid
    }

    /// Sorts the dots by their cells, with a counting sort.
    fn sort(&mut self, dots: &[Point]) {
        let cells: Vec<usize> = dots.iter().map(|&dot| self.cell_of(dot)).collect();
        for &cell in &cells {
            self.begins[cell + 1] += 1;
        }
        for cell in 1..self.begins.len() {
            self.begins[cell] += self.begins[cell - 1];
        }
        let mut next = self.begins.clone();
        self.sorted = vec![(0, Point::default()); dots.len()];
        for (id, (&cell, &dot)) in (0..).zip(cells.iter().zip(dots)) {
            self.sorted[next[cell] as usize] = (id, dot);
            next[cell] += 1;
        }
    }

    /// Returns the number of whole cells between two coordinates, clamped to the grid.
    fn step(&self, from: f64, to: f64, cells: usize) -> usize {
        (((to - from) / self.cell).max(0.0) as usize).min(cells - 1)
    }

    fn cell_of(&self, dot: Point) -> usize {
        let column = self.step(self.south_west.x, dot.x, self.columns);
        let row = self.step(self.south_west.y, dot.y, self.rows);
        row * self.columns + column
    }

    fn within(&self, low: Point, high: Point) -> impl Iterator<Item = (DotId, Point)> + '_ {
        let first = self.step(self.south_west.x, low.x, self.columns);
        let last = self.step(self.south_west.x, high.x, self.columns);
        let rows =
            self.step(self.south_west.y, low.y, self.rows)..=self.step(self.south_west.y, high.y, self.rows);
        let is_inside =
            move |dot: Point| low.x <= dot.x && dot.x <= high.x && low.y <= dot.y && dot.y <= high.y;
        rows.flat_map(move |row| {
            let begin = self.begins[row * self.columns + first] as usize;
            let end = self.begins[row * self.columns + last + 1] as usize;
            self.sorted[begin..end.max(begin)].iter().copied()
        })
        .filter(move |&(_, dot)| is_inside(dot))
    }

    fn same_place(&self) -> Result<(), Error> {
        let mut ids = Vec::new();
        for cell in self.begins.windows(2) {
            ids.clear();
            ids.extend_from_slice(&self.sorted[cell[0] as usize..cell[1] as usize]);
            ids.sort_by(|(a, at), (b, bt)| at.x.total_cmp(&bt.x).then(at.y.total_cmp(&bt.y)).then(a.cmp(b)));
            if let Some(pair) = ids.windows(2).find(|pair| pair[0].1 == pair[1].1) {
                let [(first, at), (second, _)] = [pair[0], pair[1]];
                let (first, second) = (first as usize, second as usize);
                return Err(Error::SamePlace { first, second, x: at.x, y: at.y });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::config;

    fn points(pairs: &[(f64, f64)]) -> Vec<Point> {
        pairs.iter().map(|&(x, y)| Point::new(x, y)).collect()
    }

    #[test]
    fn bad_worlds_are_rejected() {
        assert_eq!(Plane::new(Vec::new()).unwrap_err(), Error::NoDots);
        let twice = Plane::new(points(&[(1.0, 2.0), (5.0, 5.0), (1.0, 2.0)])).unwrap_err();
        assert_eq!(twice, Error::SamePlace { first: 0, second: 2, x: 1.0, y: 2.0 });
        let nowhere = Plane::new(points(&[(1.0, 2.0), (f64::NAN, 0.0)])).unwrap_err();
        assert!(matches!(nowhere, Error::Coordinate { dot: 1, .. }), "{nowhere}");
        // 0.0 and -0.0 are the same coordinate.
        assert!(Plane::new(points(&[(0.0, 1.0), (-0.0, 1.0)])).is_err());
    }

    #[test]
    fn one_dot_and_dots_on_a_line_are_worlds() {
        let one = Plane::new(points(&[(3.0, 4.0)])).unwrap();
        assert_eq!(one.around(Point::new(3.0, 4.0), 0.0).count(), 1);
        assert_eq!(one.around(Point::new(30.0, 4.0), 1.0).count(), 0);
        let line = Plane::new((0..1000).map(|i| Point::new(f64::from(i), 7.0)).collect()).unwrap();
        assert_eq!(line.around(Point::new(500.0, 7.0), 2.0).count(), 5);
    }

    proptest! {
        #![proptest_config(config(64))]

        #[test]
        fn the_grid_finds_what_a_scan_finds(
            places in prop::collection::btree_set((-50_i32..50, -50_i32..50), 1..80),
            (x, y, width, height) in (-60_i32..60, -60_i32..60, 0_i32..60, 0_i32..60),
        ) {
            let dots: Vec<_> = places.iter().map(|&(x, y)| Point::new(f64::from(x), f64::from(y))).collect();
            let plane = Plane::new(dots.clone()).unwrap();
            let low = Point::new(f64::from(x), f64::from(y));
            let high = Point::new(f64::from(x + width), f64::from(y + height));
            let mut found: Vec<_> = plane.within(low, high).map(|(id, _)| id).collect();
            found.sort_unstable();
            let is_inside = |p: &Point| low.x <= p.x && p.x <= high.x && low.y <= p.y && p.y <= high.y;
            let expected: Vec<_> = (0..).zip(&dots).filter(|(_, p)| is_inside(p)).map(|(id, _)| id).collect();
            prop_assert_eq!(found, expected);
        }
    }
}

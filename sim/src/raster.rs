//! Converts the solid cells of a grid to a small number of line segments and rectangles. The unit is the cell, the origin is at
//! the lower left, and y points up.

/// Depth below the surface of a solid that has to be filled with rectangles, in cells.
const DEPTH: i64 = 2;

/// A grid of solid and free cells, row by row from the bottom up. Everything beyond the grid is solid.
#[derive(Debug, Clone, PartialEq)]
pub struct Raster {
    width: usize,
    height: usize,
    solid: Vec<bool>,
}

/// A rectangle of cells, from the lower left corner (x0, y0) to the upper right corner (x1, y1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CellBox {
    /// First column.
    pub x0: i64,
    /// First row.
    pub y0: i64,
    /// One past the last column.
    pub x1: i64,
    /// One past the last row.
    pub y1: i64,
}

impl Raster {
    /// Creates a grid of `width` × `height` cells, or returns `None` if `solid` has a different number of cells.
    pub fn new(width: usize, height: usize, solid: Vec<bool>) -> Option<Self> {
        (solid.len() == width * height).then_some(Self { width, height, solid })
    }

    /// Returns the number of columns and the number of rows.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Returns true if the cell in column `x` and row `y` is solid.
    pub fn is_solid(&self, x: i64, y: i64) -> bool {
        let inside = (0..self.width as i64).contains(&x) && (0..self.height as i64).contains(&y);
        !inside || self.solid[y as usize * self.width + x as usize]
    }

    /// Returns the border between solid and free cells. Each straight run is one segment, whose ends are in cells.
    pub fn outline(&self) -> Vec<[[i64; 2]; 2]> {
        let (width, height) = (self.width as i64, self.height as i64);
        let mut segments = Vec::new();
        for y in 0..=height {
            let border = runs(width, |x| self.is_solid(x, y) != self.is_solid(x, y - 1));
            segments.extend(border.into_iter().map(|[a, b]| [[a, y], [b, y]]));
        }
        for x in 0..=width {
            let border = runs(height, |y| self.is_solid(x, y) != self.is_solid(x - 1, y));
            segments.extend(border.into_iter().map(|[a, b]| [[x, a], [x, b]]));
        }
        segments
    }

    /// Returns rectangles that cover only solid cells, and every solid cell within two cells of a free one, including those in
    /// the ring of cells around the grid. The rectangles may overlap. Each is as large as possible: it is grown in width first
    /// if the run of cells is wider than tall, and in height first otherwise. Returns `None` if there would be more than
    /// `most`.
    pub fn boxes(&self, most: usize) -> Option<Vec<CellBox>> {
        let mut covered = vec![false; (self.width + 2) * (self.height + 2)];
        let index = |x: i64, y: i64| (y + 1) as usize * (self.width + 2) + (x + 1) as usize;
        let mut boxes = Vec::new();
        for y in -1..=self.height as i64 {
            for x in -1..=self.width as i64 {
                if covered[index(x, y)] || !self.is_solid(x, y) || !self.near_free(x, y) {
                    continue;
                }
                if boxes.len() == most {
                    return None;
                }
                let cells = self.grow(x, y);
                for row in cells.y0..cells.y1 {
                    covered[index(cells.x0, row)..=index(cells.x1 - 1, row)].fill(true);
                }
                boxes.push(cells);
            }
        }
        Some(boxes)
    }

    fn near_free(&self, x: i64, y: i64) -> bool {
        (-DEPTH..=DEPTH).any(|dy| (-DEPTH..=DEPTH).any(|dx| !self.is_solid(x + dx, y + dy)))
    }

    fn grow(&self, x: i64, y: i64) -> CellBox {
        let cell = CellBox { x0: x, y0: y, x1: x + 1, y1: y + 1 };
        let (wide, high) = (self.widen(cell), self.heighten(cell));
        if wide.x1 - wide.x0 >= high.y1 - high.y0 { self.heighten(wide) } else { self.widen(high) }
    }

    fn widen(&self, mut cells: CellBox) -> CellBox {
        let column = |x: i64| (cells.y0..cells.y1).all(|y| self.is_solid(x, y));
        while cells.x0 > -1 && column(cells.x0 - 1) {
            cells.x0 -= 1;
        }
        while cells.x1 <= self.width as i64 && column(cells.x1) {
            cells.x1 += 1;
        }
        cells
    }

    fn heighten(&self, mut cells: CellBox) -> CellBox {
        let row = |y: i64| (cells.x0..cells.x1).all(|x| self.is_solid(x, y));
        while cells.y0 > -1 && row(cells.y0 - 1) {
            cells.y0 -= 1;
        }
        while cells.y1 <= self.height as i64 && row(cells.y1) {
            cells.y1 += 1;
        }
        cells
    }
}

/// Returns the stretches [from, to) of 0..`count` on which `holds` is true.
fn runs(count: i64, holds: impl Fn(i64) -> bool) -> Vec<[i64; 2]> {
    let mut found: Vec<[i64; 2]> = Vec::new();
    for i in (0..count).filter(|&i| holds(i)) {
        match found.last_mut() {
            Some(run) if run[1] == i => run[1] = i + 1,
            _ => found.push([i, i + 1]),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    fn raster() -> impl Strategy<Value = Raster> {
        (1..12_usize, 1..12_usize).prop_flat_map(|(width, height)| {
            prop::collection::vec(any::<bool>(), width * height).prop_map(move |solid| Raster {
                width,
                height,
                solid,
            })
        })
    }

    fn cells(raster: &Raster) -> impl Iterator<Item = (i64, i64)> {
        let (width, height) = (raster.width as i64, raster.height as i64);
        (-1..=height).flat_map(move |y| (-1..=width).map(move |x| (x, y)))
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

        /// Along a line that starts in the solid ring outside, each segment crossed changes between solid and free.
        #[test]
        fn the_outline_encloses_exactly_the_solid_cells(raster in raster()) {
            let outline = raster.outline();
            for (x, y) in cells(&raster) {
                let crossed = |[[xa, ya], [xb, yb]]: &[[i64; 2]; 2]| xa == xb && *xa <= x && *ya <= y && y < *yb;
                let solid = outline.iter().filter(|s| crossed(s)).count() % 2 == 0;
                prop_assert_eq!(solid, raster.is_solid(x, y), "{} {}", x, y);
            }
        }

        #[test]
        fn boxes_contain_only_solid_cells_and_the_whole_surface(raster in raster()) {
            let boxes = raster.boxes(usize::MAX).unwrap();
            for (x, y) in cells(&raster) {
                let boxed = boxes.iter().any(|b| (b.x0..b.x1).contains(&x) && (b.y0..b.y1).contains(&y));
                prop_assert!(!boxed || raster.is_solid(x, y));
                prop_assert!(boxed || !raster.is_solid(x, y) || !raster.near_free(x, y));
            }
        }
    }
}

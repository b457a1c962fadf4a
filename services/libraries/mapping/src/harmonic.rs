//! Harmonic measure: how much each sample of an outline contributes to a point inside the outline.
//!
//! A mapping between two outlines extends to their interiors by Laplace's equation. The image of an interior point is the mean of
//! the images of the outline's samples, weighted by harmonic measure: the weight of a sample is the probability that a random walk
//! from the point first meets the outline there. The equation is solved on a coarse grid by conjugate gradients (Hestenes and
//! Stiefel 1952).

use crate::outline::{Outline, Place};
use crate::region::Region;

/// The interior of a drawing's outline, on a coarse grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Interior {
    /// Length of a coarse cell's side, in cells of the region.
    step: f64,
    /// The coarse cells inside the outline. The border of the grid is empty, so every cell inside has four neighbours.
    grid: Region,
    /// The sides of cells that face the outside, each as the index of the cell and the nearest sample of the outline.
    sides: Vec<(u32, u16)>,
    samples: usize,
}

/// Minimum share of a coarse cell that the region must cover for the cell to be inside.
const COVERED: f64 = 0.4;
const TOLERANCE: f64 = 1e-7;
const MOST_ROUNDS: usize = 4000;

impl Interior {
    /// Creates the interior of a region with the given outline. The coarse grid has at most about `cells` cells along its longer
    /// side.
    pub fn new(region: &Region, outline: &Outline, cells: usize) -> Self {
        let step = (region.width().max(region.height()) as f64 / cells as f64).max(1.0);
        let along = |length: usize| (length as f64 / step).ceil() as usize;
        let [width, height] = [along(region.width()), along(region.height())].map(|count| count + 2);
        let (mut free, mut all) = (vec![0.0; width * height], vec![0.0; width * height]);
        let coarse = |index: usize| {
            let [column, row] = region.at(index).map(|at| (at as f64 / step) as usize + 1);
            row * width + column
        };
        (0..region.cells()).for_each(|index| all[coarse(index)] += 1.0);
        region.iter().for_each(|index| free[coarse(index)] += 1.0);
        let inside = Region::of(width, height, |k| free[k] > 0.0 && free[k] >= COVERED * all[k]);
        let parts = largest(&inside);
        let mut interior = Self { step, grid: parts, sides: Vec::new(), samples: outline.places.len() };
        interior.sides = interior.find_sides(outline);
        interior
    }

    fn find_sides(&self, outline: &Outline) -> Vec<(u32, u16)> {
        let nearest = |place: Place| {
            let square = |k: &usize| {
                let off = [0, 1].map(|axis| outline.places[*k][axis] - place[axis]);
                off[0] * off[0] + off[1] * off[1]
            };
            (0..outline.places.len()).min_by(|a, b| square(a).total_cmp(&square(b))).unwrap_or_default()
        };
        let beside = |cell| self.beside(cell).map(|beside| (cell, beside));
        let sides = self.grid.iter().flat_map(beside).filter(|(_, beside)| !self.grid.contains(*beside));
        sides.map(|(cell, beside)| (cell as u32, nearest(self.middle(beside)) as u16)).collect()
    }

    fn beside(&self, cell: usize) -> [usize; 4] {
        [cell + 1, cell - 1, cell + self.grid.width(), cell - self.grid.width()]
    }

    /// Returns the centre of a coarse cell, in cells of the region.
    fn middle(&self, cell: usize) -> Place {
        self.grid.at(cell).map(|at| (at as f64 - 0.5) * self.step)
    }

    /// Returns the harmonic measure of a point, in cells of the region, as one share per sample of the outline. The shares sum to
    /// 1. A point outside the outline gets the measure of the nearest point inside.
    pub fn measure(&self, at: Place) -> Vec<f64> {
        let mut shares = vec![0.0; self.samples];
        let place = at.map(|part| part / self.step + 1.0);
        let reach = (self.grid.width() + self.grid.height()) as f64;
        let Some(cell) = self.grid.nearest(place, reach) else { return shares };
        let mut source = vec![0.0; self.grid.cells()];
        source[cell] = 1.0;
        let visits = self.solve(source);
        for &(cell, sample) in &self.sides {
            shares[usize::from(sample)] += visits[cell as usize];
        }
        let sum: f64 = shares.iter().sum();
        if sum > 0.0 {
            shares.iter_mut().for_each(|share| *share /= sum);
        }
        shares
    }

    /// Returns the point whose image is nearest to `image`. `images` contains the image of each sample of the outline, if it is
    /// known. The image of an interior point is the mean of these, weighted by harmonic measure, and only points for which the
    /// samples with a known image contribute a share of at least `least` are considered. This is the inverse of
    /// [`Interior::measure`], computed for all points at once.
    pub fn place_of(&self, images: &[Option<Place>], image: Place, least: f64) -> Option<Place> {
        let extended = |value: &dyn Fn(Place) -> f64| {
            let mut source = vec![0.0; self.grid.cells()];
            for &(cell, sample) in &self.sides {
                source[cell as usize] += images[usize::from(sample)].map_or(0.0, value);
            }
            self.solve(source)
        };
        let known = extended(&|_| 1.0);
        let [x, y] = [0, 1].map(|axis| extended(&|place| place[axis]));
        let square = |cell: usize| {
            let off = [x[cell] / known[cell] - image[0], y[cell] / known[cell] - image[1]];
            off[0] * off[0] + off[1] * off[1]
        };
        let inside = self.grid.iter().filter(|cell| known[*cell] >= least.max(1e-9));
        let nearest = inside.min_by(|a, b| square(*a).total_cmp(&square(*b)))?;
        Some(self.middle(nearest))
    }

    /// Solves Poisson's equation with the given sources and zero outside, by conjugate gradients.
    fn solve(&self, source: Vec<f64>) -> Vec<f64> {
        let inside: Vec<usize> = self.grid.iter().collect();
        let mut found = vec![0.0; self.grid.cells()];
        let mut residual = source;
        let (mut direction, mut image) = (residual.clone(), found.clone());
        let whole: f64 = residual.iter().map(|part| part * part).sum();
        let rounds = if whole > 0.0 { MOST_ROUNDS } else { 0 };
        let mut square = whole;
        for _ in 0..rounds {
            let mut along = 0.0;
            for &cell in &inside {
                let beside: f64 = self.beside(cell).iter().map(|beside| direction[*beside]).sum();
                image[cell] = 4.0 * direction[cell] - beside;
                along += direction[cell] * image[cell];
            }
            let step = square / along;
            let mut next = 0.0;
            for &cell in &inside {
                found[cell] += step * direction[cell];
                residual[cell] -= step * image[cell];
                next += residual[cell] * residual[cell];
            }
            if next < TOLERANCE * TOLERANCE * whole {
                break;
            }
            let share = next / square;
            square = next;
            inside.iter().for_each(|&cell| direction[cell] = residual[cell] + share * direction[cell]);
        }
        found
    }
}

/// Returns the largest connected component of a region.
fn largest(region: &Region) -> Region {
    let mut left = region.clone();
    let mut largest = Region::empty(region.width(), region.height());
    while let Some(seed) = left.first() {
        let part = left.connected(seed);
        left.subtract(&part);
        if part.count() > largest.count() {
            largest = part;
        }
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle(width: usize, height: usize) -> (Region, Outline) {
        let region = Region::of(width + 20, height + 20, |k| {
            let (x, y) = (k % (width + 20), k / (width + 20));
            (10..width + 10).contains(&x) && (10..height + 10).contains(&y)
        });
        let outline = Outline::of_region(&region, 200, 1.0);
        (region, outline)
    }

    /// Coordinates are harmonic functions, so the mean of the outline's points, weighted by the measure of a point, is the point
    /// itself.
    #[test]
    fn the_identity_on_the_outline_is_the_identity_inside() {
        let (region, outline) = rectangle(200, 120);
        let interior = Interior::new(&region, &outline, 128);
        for at in [[110.0, 70.0], [30.0, 30.0], [200.0, 120.0]] {
            let shares = interior.measure(at);
            assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-9);
            let image =
                [0, 1].map(|k| shares.iter().zip(&outline.places).map(|(w, p)| w * p[k]).sum::<f64>());
            assert!((image[0] - at[0]).hypot(image[1] - at[1]) < 3.0, "{at:?} {image:?}");
        }
    }

    /// The drawing is one and a half times as large as the map and rotated by a right angle. Each point of the map is found in the
    /// drawing, even if one wall was not seen.
    #[test]
    fn the_harmonic_measure_maps_images_back_to_their_places() {
        let (region, outline) = rectangle(200, 120);
        let interior = Interior::new(&region, &outline, 128);
        let image = |[x, y]: Place| [-y / 1.5, x / 1.5];
        let mut images: Vec<_> = outline.places.iter().map(|place| Some(image(*place))).collect();
        for at in [[110.0, 70.0], [30.0, 30.0], [200.0, 120.0]] {
            let found = interior.place_of(&images, image(at), 0.5).unwrap();
            assert!((found[0] - at[0]).hypot(found[1] - at[1]) < 4.0, "{at:?} {found:?}");
        }
        for (place, image) in outline.places.iter().zip(&mut images) {
            image.take_if(|_| place[0] > 180.0);
        }
        let found = interior.place_of(&images, image([60.0, 70.0]), 0.5).unwrap();
        assert!((found[0] - 60.0).hypot(found[1] - 70.0) < 12.0, "{found:?}");
        images.fill(None);
        assert_eq!(interior.place_of(&images, [0.0; 2], 0.5), None);
    }

    #[test]
    fn a_place_in_an_arm_depends_on_the_walls_of_that_arm() {
        let region = Region::of(300, 300, |k| {
            let (x, y) = (k % 300, k / 300);
            (20..280).contains(&x) && (20..80).contains(&y) || (20..80).contains(&x) && (20..280).contains(&y)
        });
        let outline = Outline::of_region(&region, 220, 2.0);
        let shares = Interior::new(&region, &outline, 128).measure([50.0, 240.0]);
        let upper: f64 =
            shares.iter().zip(&outline.places).filter(|(_, p)| p[1] > 150.0).map(|(w, _)| w).sum();
        assert!(upper > 0.97, "{upper}");
    }
}

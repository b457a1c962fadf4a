//! Generates random planes from a seed.

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use sketchnav_dots::{DotsError, generate as places};

use crate::error::Error;
use crate::geometry::Point;
use crate::plane::Plane;

/// Draws a point whose coordinates are normal errors with the given standard deviation.
pub fn error(rng: &mut Pcg64Mcg, sigma: f64) -> Point {
    let (x, y): (f64, f64) = (StandardNormal.sample(rng), StandardNormal.sample(rng));
    Point::new(x, y) * sigma
}

/// Generates dots that are uniformly distributed over a square with the given side.
pub fn uniform(dots: usize, side: f64, seed: u64) -> Result<Plane, Error> {
    plane(places::uniform(dots, side, seed))
}

/// Generates dots around `clusters` centres on a square with the given side, at normally distributed distances with the given
/// spread. A dot that falls outside the square is drawn again.
pub fn clustered(dots: usize, side: f64, clusters: usize, spread: f64, seed: u64) -> Result<Plane, Error> {
    plane(places::clustered(dots, side, clusters, spread, seed))
}

/// Generates dots that are uniformly distributed over a square with the given side, and additional dots in a wall. The wall is a
/// vertical strip in the middle, a tenth of the side wide and nine tenths high (Park and Kender 1995, figure 25).
pub fn walled(dots: usize, in_wall: usize, side: f64, seed: u64) -> Result<Plane, Error> {
    plane(places::walled(dots, in_wall, side, seed))
}

fn plane(places: Result<Vec<[f64; 2]>, DotsError>) -> Result<Plane, Error> {
    match places {
        Ok(places) => Plane::new(places.into_iter().map(|[x, y]| Point::new(x, y)).collect()),
        Err(DotsError::Parameter { what, expected, found }) => {
            Err(Error::Parameter { what, expected, found })
        }
        Err(_) => Err(Error::NoDots),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_gives_the_same_plane() {
        assert_eq!(uniform(100, 1000.0, 1), uniform(100, 1000.0, 1));
        assert_ne!(uniform(100, 1000.0, 1), uniform(100, 1000.0, 2));
    }

    #[test]
    fn clusters_crowd() {
        let near = |plane: &Plane| -> usize {
            plane.dots().iter().map(|&dot| plane.around(dot, 20.0).count() - 1).sum()
        };
        let flat = uniform(300, 1000.0, 5).unwrap();
        let crowded = clustered(300, 1000.0, 10, 30.0, 5).unwrap();
        assert_eq!(crowded.len(), 300);
        assert!(near(&crowded) > 5 * near(&flat), "{} {}", near(&crowded), near(&flat));
    }

    #[test]
    fn a_wall_is_crowded() {
        let world = walled(100, 60, 1000.0, 3).unwrap();
        assert_eq!(world.len(), 160);
        let in_wall = world.within(Point::new(450.0, 0.0), Point::new(550.0, 900.0)).count();
        assert!((60..80).contains(&in_wall), "{in_wall}");
    }

    #[test]
    fn bad_parameters_are_rejected() {
        assert_eq!(uniform(0, 10.0, 1).unwrap_err(), Error::NoDots);
        assert!(uniform(5, 0.0, 1).is_err());
        assert!(clustered(5, 10.0, 0, 1.0, 1).is_err());
        assert!(clustered(5, 10.0, 2, f64::NAN, 1).is_err());
    }
}

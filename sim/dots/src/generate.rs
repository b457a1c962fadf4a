//! Generates distinct random positions on a square from a seed.

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;

use crate::error::DotsError;

/// Maximum side of a square.
pub const LIMIT: f64 = 1e9;

/// Generates positions that are uniformly distributed over a square with the given side.
///
/// # Errors
/// [`DotsError::Parameter`] if the side is out of range.
pub fn uniform(dots: usize, side: f64, seed: u64) -> Result<Vec<[f64; 2]>, DotsError> {
    let mut rng = generator(side, seed)?;
    Ok(distinct(dots, || place(&mut rng, side)))
}

/// Generates positions around `clusters` centres on a square with the given side, at normally distributed distances with the given
/// spread. Positions outside the square are drawn again.
///
/// # Errors
/// [`DotsError::Parameter`] if the side or the spread is out of range, or if there are no clusters.
pub fn clustered(
    dots: usize,
    side: f64,
    clusters: usize,
    spread: f64,
    seed: u64,
) -> Result<Vec<[f64; 2]>, DotsError> {
    let mut rng = generator(side, seed)?;
    if clusters == 0 {
        return Err(DotsError::Parameter { what: "clusters", expected: "at least 1", found: 0.0 });
    }
    if !(spread > 0.0 && spread <= side) {
        let expected = "a length above 0 that is at most the side";
        return Err(DotsError::Parameter { what: "spread", expected, found: spread });
    }
    let centres: Vec<_> = (0..clusters).map(|_| place(&mut rng, side)).collect();
    Ok(distinct(dots, || {
        let centre = centres[rng.random_range(0..clusters)];
        loop {
            let dot = centre.map(|at| {
                let off: f64 = StandardNormal.sample(&mut rng);
                at + off * spread
            });
            if dot.iter().all(|at| (0.0..=side).contains(at)) {
                return dot;
            }
        }
    }))
}

/// Generates positions that are uniformly distributed over a square with the given side, and additional ones in a wall. The wall is
/// a vertical strip in the middle, a tenth of the side wide and nine tenths high (Park and Kender 1995, figure 25).
///
/// # Errors
/// [`DotsError::Parameter`] if the side is out of range.
pub fn walled(dots: usize, in_wall: usize, side: f64, seed: u64) -> Result<Vec<[f64; 2]>, DotsError> {
    let mut rng = generator(side, seed)?;
    let mut drawn = 0;
    Ok(distinct(dots + in_wall, || {
        drawn += 1;
        if drawn <= dots {
            return place(&mut rng, side);
        }
        [rng.random_range(0.45 * side..0.55 * side), rng.random_range(0.0..0.9 * side)]
    }))
}

fn generator(side: f64, seed: u64) -> Result<Pcg64Mcg, DotsError> {
    if side > 0.0 && side <= LIMIT {
        Ok(Pcg64Mcg::seed_from_u64(seed))
    } else {
        let expected = "a length above 0";
        Err(DotsError::Parameter { what: "side of the plane", expected, found: side })
    }
}

fn place(rng: &mut Pcg64Mcg, side: f64) -> [f64; 2] {
    [rng.random_range(0.0..side), rng.random_range(0.0..side)]
}

/// Draws positions until no two are the same. With 53 bits per coordinate, it rarely has to draw again.
fn distinct(dots: usize, mut draw: impl FnMut() -> [f64; 2]) -> Vec<[f64; 2]> {
    let mut places: Vec<_> = (0..dots).map(|_| draw()).collect();
    while let Some((_, second)) = same_place(&places) {
        places[second] = draw();
    }
    places
}

/// Returns the indices of two equal positions, if there are any.
pub fn same_place(places: &[[f64; 2]]) -> Option<(usize, usize)> {
    let mut order: Vec<usize> = (0..places.len()).collect();
    // 0.0 and -0.0 are the same coordinate.
    let key = |number: usize| places[number].map(|at| at + 0.0);
    let by_place = |a: [f64; 2], b: [f64; 2]| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]));
    order.sort_by(|&a, &b| by_place(key(a), key(b)).then(a.cmp(&b)));
    order.windows(2).map(|pair| (pair[0], pair[1])).find(|&(a, b)| places[a] == places[b])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_gives_the_same_dots() {
        assert_eq!(uniform(100, 1.0, 1).unwrap(), uniform(100, 1.0, 1).unwrap());
        assert_ne!(uniform(100, 1.0, 1).unwrap(), uniform(100, 1.0, 2).unwrap());
    }

    #[test]
    fn a_wall_is_crowded_and_clusters_stay_on_the_square() {
        let in_wall = |dots: &[[f64; 2]]| dots.iter().filter(|dot| (0.45..0.55).contains(&dot[0])).count();
        assert!((60..85).contains(&in_wall(&walled(100, 60, 1.0, 3).unwrap())));
        let crowded = clustered(300, 1.0, 10, 0.03, 5).unwrap();
        assert!(crowded.iter().flatten().all(|at| (0.0..=1.0).contains(at)));
    }

    #[test]
    fn duplicate_dots_are_found_wherever_they_are_in_the_list() {
        assert_eq!(same_place(&[[0.0, 1.0], [5.0, 5.0], [-0.0, 1.0]]), Some((0, 2)));
        assert_eq!(same_place(&[[0.0, 1.0], [1.0, 0.0]]), None);
    }

    #[test]
    fn bad_parameters_are_rejected() {
        assert!(uniform(5, 0.0, 1).is_err());
        assert!(clustered(5, 10.0, 0, 1.0, 1).is_err());
        assert!(clustered(5, 10.0, 2, f64::NAN, 1).is_err());
    }
}

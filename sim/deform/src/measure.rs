//! Measures how much a drawing deviates from the floor that it shows, given corresponding places in both.
//!
//! The figures for people are based on the matched places of the drawings of Mielle et al. (*Using sketch-maps for robot
//! navigation*, 2016), which people annotated.

use nalgebra::{DMatrix, Matrix2, Vector2};
use rand::Rng;
use rand::seq::IndexedRandom;
use rand_distr::{Distribution, StandardNormal};
use serde::Serialize;
use sketchnav_schemas::geometry::{Point, Sketch, World};

/// Number of nearest places from which local scales are measured at each place.
const NEIGHBOURS: usize = 2;
/// Minimum number of places. With fewer, an affine map always fits without a residual.
const LEAST_PLACES: usize = 4;

/// Number of places in an annotated drawing.
const ANNOTATED: usize = 7;
/// Root mean square distance of an annotator's mark from the place, as a share of the extent of the places. Two annotators' marks
/// for the same region are 0.21 of that extent apart (37 pairs).
const MARK_SCATTER: f64 = 0.15;

/// The deformations of people's drawings, as measured by [`Deformation::as_annotated`]. They are means over the seven annotated
/// drawings that have at least six matched places, and include the scatter of the annotators. Depending on which of an annotator's
/// several marks for one place is used, the first figure is 0.31 to 0.36 and the fourth 0.41 to 0.51. `tests/people.rs` compares
/// synthetic drawings with these figures.
pub const PEOPLE: Deformation = Deformation {
    places: 7,
    similarity_residual: 0.34,
    affine_residual: 0.24,
    anisotropy: 1.85,
    log_scale_sd: 0.51,
    scale_p05: 0.56,
    scale_p95: 2.17,
};

/// The deformation of a drawing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Deformation {
    /// Number of corresponding places.
    pub places: usize,
    /// Root mean square residual of the best similarity (translation, rotation, scale), as a share of the root mean square distance
    /// of the places from their centre in the drawing.
    pub similarity_residual: f64,
    /// Root mean square residual of the best affine map, as a share of the same distance.
    pub affine_residual: f64,
    /// Ratio of the two scales of the best affine map, 1 or more.
    pub anisotropy: f64,
    /// Standard deviation of the logarithm of the local scale, in pixels per metre, between a place and each of its two nearest
    /// places.
    pub log_scale_sd: f64,
    /// 5th percentile of the local scales, as a share of their geometric mean.
    pub scale_p05: f64,
    /// 95th percentile of the local scales, as a share of their geometric mean.
    pub scale_p95: f64,
}

impl Deformation {
    /// Measures corresponding places as annotators would: seven well-spread places, each of which is marked somewhere near it in
    /// the drawing. This makes the result comparable with [`PEOPLE`].
    pub fn as_annotated(pairs: &[(Point<World>, Point<Sketch>)], rng: &mut impl Rng) -> Option<Self> {
        let mut marked = well_spread(pairs, rng);
        let extent: f64 =
            centered(marked.iter().map(|(_, p)| p.coords())).iter().map(Vector2::norm_squared).sum();
        let scatter = MARK_SCATTER * (extent / marked.len().max(1) as f64 / 2.0).sqrt();
        for (_, mark) in &mut marked {
            let [x, y] = [(); 2].map(|()| -> f64 { StandardNormal.sample(rng) });
            *mark = Point::new(mark.x + scatter * x, mark.y + scatter * y);
        }
        Self::measure(&marked)
    }

    /// Measures corresponding places. Returns `None` if there are fewer than four, or if they lie on a line.
    pub fn measure(pairs: &[(Point<World>, Point<Sketch>)]) -> Option<Self> {
        if pairs.len() < LEAST_PLACES {
            return None;
        }
        let world = centered(pairs.iter().map(|(world, _)| world.coords()));
        let sketch = centered(pairs.iter().map(|(_, sketch)| sketch.coords()));
        let affine = affine(&world, &sketch)?;
        let scales = affine.singular_values();
        let logs = log_scales(&world, &sketch);
        Some(Self {
            places: pairs.len(),
            similarity_residual: residual(&world, &sketch, &similarity(&world, &sketch)),
            affine_residual: residual(&world, &sketch, &affine),
            anisotropy: scales.max() / scales.min(),
            log_scale_sd: (logs.iter().map(|l| l * l).sum::<f64>() / logs.len() as f64).sqrt(),
            scale_p05: percentile(&logs, 0.05).exp(),
            scale_p95: percentile(&logs, 0.95).exp(),
        })
    }
}

/// Chooses seven of the places: a random one first, then repeatedly the one farthest from those already chosen.
fn well_spread(
    pairs: &[(Point<World>, Point<Sketch>)],
    rng: &mut impl Rng,
) -> Vec<(Point<World>, Point<Sketch>)> {
    let mut chosen: Vec<_> = pairs.choose(rng).into_iter().copied().collect();
    while chosen.len() < ANNOTATED.min(pairs.len()) {
        let lonely = |pair: &(Point<World>, Point<Sketch>)| {
            chosen.iter().map(|(place, _)| place.distance(&pair.0)).fold(f64::INFINITY, f64::min)
        };
        chosen.extend(pairs.iter().max_by(|a, b| lonely(a).total_cmp(&lonely(b))).copied());
    }
    chosen
}

fn centered(places: impl Iterator<Item = Vector2<f64>>) -> Vec<Vector2<f64>> {
    let places: Vec<_> = places.collect();
    let middle = places.iter().sum::<Vector2<f64>>() / places.len() as f64;
    places.into_iter().map(|p| p - middle).collect()
}

/// Returns the rotation and scale that best map `from` to `to`, by least squares, as a matrix.
fn similarity(from: &[Vector2<f64>], to: &[Vector2<f64>]) -> Matrix2<f64> {
    let pairs = || from.iter().zip(to);
    let along: f64 = pairs().map(|(f, t)| f.dot(t)).sum();
    let across: f64 = pairs().map(|(f, t)| f.perp(t)).sum();
    let extent: f64 = from.iter().map(Vector2::norm_squared).sum();
    Matrix2::new(along, -across, across, along) / extent
}

/// Returns the linear map that best maps `from` to `to`, or `None` if `from` lies on a line.
fn affine(from: &[Vector2<f64>], to: &[Vector2<f64>]) -> Option<Matrix2<f64>> {
    let outer = |a: &[Vector2<f64>], b: &[Vector2<f64>]| {
        a.iter().zip(b).map(|(a, b)| a * b.transpose()).sum::<Matrix2<f64>>()
    };
    Some(outer(to, from) * outer(from, from).try_inverse()?)
}

fn residual(from: &[Vector2<f64>], to: &[Vector2<f64>], map: &Matrix2<f64>) -> f64 {
    let left: f64 = from.iter().zip(to).map(|(f, t)| (t - map * f).norm_squared()).sum();
    let extent: f64 = to.iter().map(Vector2::norm_squared).sum();
    (left / extent).sqrt()
}

/// Returns the sorted logarithms of the scale between neighbouring places, relative to their mean.
fn log_scales(world: &[Vector2<f64>], sketch: &[Vector2<f64>]) -> Vec<f64> {
    let apart = DMatrix::from_fn(world.len(), world.len(), |i, k| (world[i] - world[k]).norm());
    let mut logs = Vec::new();
    for i in 0..world.len() {
        let mut others: Vec<usize> = (0..world.len()).filter(|&k| apart[(i, k)] > 0.0).collect();
        others.sort_by(|&a, &b| apart[(i, a)].total_cmp(&apart[(i, b)]));
        for &k in others.iter().take(NEIGHBOURS) {
            logs.push(((sketch[i] - sketch[k]).norm() / apart[(i, k)]).max(1e-9).ln());
        }
    }
    let mean = logs.iter().sum::<f64>() / logs.len() as f64;
    logs.iter_mut().for_each(|l| *l -= mean);
    logs.sort_by(f64::total_cmp);
    logs
}

/// Returns a percentile of sorted values, interpolated between neighbours.
fn percentile(sorted: &[f64], share: f64) -> f64 {
    let at = share * (sorted.len() - 1) as f64;
    let (low, part) = (at.floor() as usize, at.fract());
    let high = (low + 1).min(sorted.len() - 1);
    sorted[low] * (1.0 - part) + sorted[high] * part
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(map: impl Fn(f64, f64) -> [f64; 2]) -> Deformation {
        let places = (0..12).map(|i| (f64::from(i % 4), f64::from(i / 4)));
        let pairs: Vec<_> =
            places.map(|(x, y)| (Point::new(x, y), Point::from(Vector2::from(map(x, y))))).collect();
        Deformation::measure(&pairs).expect("twelve places")
    }

    #[test]
    fn a_scaled_and_turned_drawing_is_not_deformed() {
        let found = drawn(|x, y| [30.0 * y + 100.0, 7.0 - 30.0 * x]);
        assert!(
            found.similarity_residual < 1e-9 && found.affine_residual < 1e-9 && found.log_scale_sd < 1e-9
        );
        assert!((found.anisotropy - 1.0).abs() < 1e-9);
    }

    /// If a drawing is stretched twofold along x, the best similarity has the scale 10 (2 Sx + Sy)/(Sx + Sy), as computed by hand.
    #[test]
    fn a_stretched_drawing_is_affine() {
        let found = drawn(|x, y| [20.0 * x, 10.0 * y]);
        let (sx, sy) = (3.0 * 5.0, 4.0 * 2.0);
        let scale = 10.0 * (2.0 * sx + sy) / (sx + sy);
        let left = (20.0_f64 - scale).powi(2) * sx + (10.0_f64 - scale).powi(2) * sy;
        let extent = 400.0 * sx + 100.0 * sy;
        assert!((found.similarity_residual - (left / extent).sqrt()).abs() < 1e-9, "{found:?}");
        assert!((found.anisotropy - 2.0).abs() < 1e-9 && found.affine_residual < 1e-9);
        assert!((found.scale_p95 / found.scale_p05 - 2.0).abs() < 1e-9);
    }

    #[test]
    fn too_few_or_collinear_places_have_no_measure() {
        let line = |n: usize| {
            (0..n).map(|i| (Point::new(i as f64, 0.0), Point::new(i as f64, 1.0))).collect::<Vec<_>>()
        };
        assert_eq!(Deformation::measure(&line(3)), None);
        assert_eq!(Deformation::measure(&line(6)), None);
    }
}

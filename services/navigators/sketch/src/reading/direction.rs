//! Finds the direction of the walls, along which the drawing may be stretched (Boniardi et al. 2015, III-B). The progressive
//! probabilistic Hough transform finds segments in Canny's edges, and k-means clusters their directions modulo a right angle.
//! The centroid of the heaviest cluster is the direction.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use image::GrayImage;
use rand::Rng;

use super::edges::edges;
use super::hough::{Lines, Segment, segments};
use super::settings::Settings;

/// Maximum side length of the picture that is searched for lines, in pixels. A finer picture would not improve the direction.
const LONGEST_SIDE: u32 = 1600;
/// Initial number of clusters.
const CLUSTERS: usize = 4;
/// Clusters whose centroids are closer than this are merged, because k-means cuts a single broad cluster to pieces.
const SAME_CLUSTER_RAD: f64 = 12.0 * PI / 180.0;

/// Returns the direction of the walls in (−π/4, π/4], from the picture's x axis towards its y axis, or 0 if the drawing has no
/// straight line. `walls` is 255 where there is a wall.
pub(crate) fn walls(walls: &GrayImage, settings: &Settings, rng: &mut impl Rng) -> f64 {
    let small = reduced(walls);
    let diagonal = f64::from(small.width()).hypot(small.height().into());
    let length_px = (settings.line_length_share * diagonal).max(8.0);
    let lines = Lines { votes: (length_px / 2.0) as u32, length_px, gap_px: settings.line_gap_px };
    let found = segments(&edges(&small), lines, rng);
    dominant(&found.iter().map(Line::of).collect::<Vec<_>>())
}

/// Shrinks a picture by a whole factor. A wall anywhere in a block of pixels makes the whole block a wall.
fn reduced(walls: &GrayImage) -> GrayImage {
    let (width, height) = walls.dimensions();
    let factor = width.max(height).div_ceil(LONGEST_SIDE);
    if factor == 1 {
        return walls.clone();
    }
    let mut small = GrayImage::new(width.div_ceil(factor), height.div_ceil(factor));
    let (factor, wide) = (factor as usize, small.width() as usize);
    let mut joined = vec![0; width as usize];
    let rows = walls.chunks(factor * width as usize).zip(small.chunks_exact_mut(wide));
    for (rows, small) in rows {
        joined.fill(0);
        for row in rows.chunks_exact(width as usize) {
            joined.iter_mut().zip(row).for_each(|(any, v)| *any |= v);
        }
        let blocks = small.iter_mut().zip(joined.chunks(factor));
        blocks.for_each(|(v, block)| *v = block.iter().fold(0, |any, v| any | v));
    }
    small
}

/// The weight and direction of a line, with directions scaled so that a right angle is a full turn.
#[derive(Debug, Clone, Copy)]
struct Line {
    /// Four times the direction, so that a right angle becomes a full turn.
    turn_rad: f64,
    weight: f64,
}

impl Line {
    fn of(segment: &Segment) -> Self {
        Self { turn_rad: 4.0 * segment.direction(), weight: segment.length() }
    }
}

/// Returns the centroid of the heaviest cluster, in (−π/4, π/4], or 0 if there are no lines.
fn dominant(lines: &[Line]) -> f64 {
    let clusters = merged(k_means(lines));
    let heaviest = clusters.into_iter().max_by(|a, b| a.weight.total_cmp(&b.weight));
    heaviest.map_or(0.0, |line| quarter(line.turn_rad / 4.0))
}

fn quarter(angle_rad: f64) -> f64 {
    let folded = angle_rad - FRAC_PI_2 * (angle_rad / FRAC_PI_2).round();
    if folded <= -FRAC_PI_4 { folded + FRAC_PI_2 } else { folded }
}

fn apart(a: f64, b: f64) -> f64 {
    let turn = (a - b).rem_euclid(2.0 * PI);
    turn.min(2.0 * PI - turn)
}

/// Returns the circular mean of weighted directions, or `None` if the weights add up to zero.
fn centroid<'a>(lines: impl Iterator<Item = &'a Line>) -> Option<Line> {
    let (mut x, mut y, mut weight) = (0.0, 0.0, 0.0);
    for line in lines {
        x += line.weight * line.turn_rad.cos();
        y += line.weight * line.turn_rad.sin();
        weight += line.weight;
    }
    (weight > 0.0).then(|| Line { turn_rad: y.atan2(x), weight })
}

/// Clusters lines by Lloyd's algorithm. The first initial centre is the heaviest line, and each further one
/// is the line farthest from the centres chosen so far.
fn k_means(lines: &[Line]) -> Vec<Line> {
    let mut centers = first_centers(lines);
    for _ in 0..50 {
        let nearest: Vec<_> = lines.iter().map(|line| nearest(&centers, line)).collect();
        let members = |k: usize| lines.iter().zip(&nearest).filter(move |(_, n)| **n == k).map(|(l, _)| l);
        let next: Vec<_> = (0..centers.len()).filter_map(|k| centroid(members(k))).collect();
        let moved = next.len() != centers.len()
            || next.iter().zip(&centers).any(|(a, b)| apart(a.turn_rad, b.turn_rad) > 1e-9);
        centers = next;
        if !moved {
            break;
        }
    }
    centers
}

fn nearest(centers: &[Line], line: &Line) -> usize {
    let distance = |k: &usize| apart(centers[*k].turn_rad, line.turn_rad);
    (0..centers.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
}

fn first_centers(lines: &[Line]) -> Vec<Line> {
    let mut centers: Vec<Line> =
        lines.iter().max_by(|a, b| a.weight.total_cmp(&b.weight)).into_iter().copied().collect();
    while !centers.is_empty() && centers.len() < CLUSTERS.min(lines.len()) {
        let lonely = |line: &Line| apart(centers[nearest(&centers, line)].turn_rad, line.turn_rad);
        let farthest = lines.iter().max_by(|a, b| lonely(a).total_cmp(&lonely(b)));
        centers.extend(farthest.copied());
    }
    centers
}

/// Merges the closest clusters, pair by pair, until all of them are well apart.
fn merged(mut clusters: Vec<Line>) -> Vec<Line> {
    while let Some((i, k)) = closest_pair(&clusters) {
        let last = clusters.swap_remove(k);
        if let Some(both) = centroid([clusters[i], last].iter()) {
            clusters[i] = both;
        }
    }
    clusters
}

fn closest_pair(clusters: &[Line]) -> Option<(usize, usize)> {
    let pairs = (0..clusters.len()).flat_map(|i| (i + 1..clusters.len()).map(move |k| (i, k)));
    let distance = |&(i, k): &(usize, usize)| apart(clusters[i].turn_rad, clusters[k].turn_rad);
    let closest = pairs.min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    (distance(&closest) < 4.0 * SAME_CLUSTER_RAD).then_some(closest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn line(degrees: f64, weight: f64) -> Line {
        Line { turn_rad: 4.0 * degrees.to_radians(), weight }
    }

    #[test]
    fn right_angles_are_one_direction() {
        let lines = [line(10.0, 5.0), line(100.0, 5.0), line(-80.0, 2.0), line(40.0, 3.0)];
        assert!((dominant(&lines).to_degrees() - 10.0).abs() < 1e-6);
    }

    #[test]
    fn a_drawing_without_lines_has_direction_0() {
        assert_eq!(dominant(&[]), 0.0);
    }

    proptest! {
        #[test]
        fn the_direction_is_folded(degrees in -720.0..720.0) {
            let direction = dominant(&[line(degrees, 1.0)]);
            prop_assert!(direction > -FRAC_PI_4 && direction <= FRAC_PI_4 + 1e-12);
            prop_assert!(apart(4.0 * direction, 4.0 * f64::to_radians(degrees)) < 1e-6);
        }
    }
}

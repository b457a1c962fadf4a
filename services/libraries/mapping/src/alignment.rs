//! Finds the correspondence between the pieces of a seen outline and of a drawing's outline, by a cyclic alignment of the two with
//! dynamic programming.
//!
//! The alignment compares the directions of walls, as in the matching of closed contours (Schmidt, Farin and Cremers 2007;
//! Sebastian, Klein and Kimia 2003). It also compares the bearing and the distance from the robot's start, and weighs them more
//! heavily close to the start. Because either side may advance while the other stays, at a cost, the alignment does not depend on
//! scale. A gap in the seen outline can be the partner of any stretch of the drawing, at a small cost per sample. Both outlines run
//! counter-clockwise, so no alignment is a mirror image.
//!
//! The outline of a drawing is closed and has no natural first sample, so several samples are tried in turn as the partner of the
//! first piece. [`Search`] spreads these trials over any number of steps.

use std::f64::consts::{FRAC_PI_2, TAU};

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::wrap_angle;

use crate::outline::{Outline, Piece, Place, SeenOutline};

/// Weights of the alignment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Cost of advancing one side while the other stays, in addition to the cost of the pair of samples.
    pub stay: f64,
    /// Cost of each sample of the drawing that lies beyond a gap of the map.
    pub gap: f64,
    /// Cost of each sample of the drawing that comes before the first piece.
    pub unmatched: f64,
    /// Weight of a difference in bearing from the start. The cost close to the start is this times 1 − cos of the difference.
    pub bearing: f64,
    /// Weight of a difference in distance from the start. The cost close to the start is this times the square of the logarithm of
    /// the ratio.
    pub distance: f64,
    /// Maximum of the squared logarithm of the ratio of distances. Larger values are capped.
    pub most_distance: f64,
    /// Distance from the start, in metres, over which the costs of bearing and distance decay by a factor of e.
    pub reach_m: f64,
    /// Share of the costs of bearing and distance that does not decay.
    pub share_afar: f64,
    /// Length, in metres, added to both distances before they are compared, so that tiny distances do not differ by large factors.
    pub near_m: f64,
    /// Extra cost of pairing a sample with a place that is forbidden for it.
    pub forbidden: f64,
    /// Radius, in metres, around a forbidden place within which every other place is forbidden, too.
    pub away_m: f64,
    /// Stride, in samples of the drawing, between the starts to try.
    pub stride: usize,
}

impl Default for Weights {
    fn default() -> Self {
        Self {
            stay: 0.15,
            gap: 0.03,
            unmatched: 1.0,
            bearing: 0.5,
            distance: 0.1,
            most_distance: 4.0,
            reach_m: 4.0,
            share_afar: 0.15,
            near_m: 0.3,
            forbidden: 5.0,
            away_m: 2.5,
            stride: 5,
        }
    }
}

/// The known correspondence between the drawing and the map: the robot's start, and the approximate scale of the drawing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Anchor {
    /// The robot's start in the drawing.
    pub drawn: Place,
    /// The robot's start in the map.
    pub seen: Place,
    /// Approximate length of one unit of the drawing, in metres.
    pub scale_m: f64,
}

/// A position in the map that must not be the partner of a sample.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Forbidden {
    /// Index of the sample in the drawing.
    pub sample: u16,
    /// The forbidden place in the map.
    pub place: Place,
}

/// Two outlines to be aligned.
#[derive(Debug, Clone, Copy)]
pub struct Problem<'a> {
    /// The outline of the drawing.
    pub drawn: &'a Outline,
    /// The outline that the robot has seen.
    pub seen: &'a SeenOutline,
    /// Counter-clockwise angle from a direction in the map to the same direction in the drawing, in radians.
    pub turn_rad: f64,
    /// The robot's start in both frames, and the scale. If the start is unknown, only the directions of walls are compared.
    pub anchor: Option<&'a Anchor>,
    /// Factor on the cost of each sample. Empty if all samples have the same weight.
    pub emphasis: &'a [f64],
    /// Pairs of a sample and a place that are ruled out.
    pub forbidden: &'a [Forbidden],
}

/// The partner with which a sample of the drawing is aligned.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Partner {
    /// The sample has no partner, because the map does not include it.
    Nothing,
    /// A place on a wall of the map.
    Wall(Place),
    /// The sample lies beyond this gap of the map.
    Gap(u16),
}

/// An alignment of a drawing with a map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Alignment {
    /// Cost of the alignment. Lower is better.
    pub cost: f64,
    /// The partner of each sample of the drawing.
    pub partners: Vec<Partner>,
    /// Difference in direction between each sample and its partners, as the mean of 1 − cos over the partners, or 0 without
    /// partners.
    pub misfits: Vec<f32>,
    /// The rotation of the [`Problem`], in radians.
    pub turn_rad: f64,
}

/// Number of rotations to try if the walls have no main directions.
pub const ROUND: usize = 12;

const MATCH: u8 = 1;
const SAMPLE: u8 = 2;
const PIECE: u8 = 3;
const BEHIND: u8 = 4;

/// Aligns the outline of a drawing with outlines that the robot has seen, reusing its working memory.
#[derive(Debug, Clone, Default)]
pub struct Aligner {
    weights: Costs,
    turn_rad: f64,
    samples: usize,
    /// For each piece, the cost of pairing it with each sample. The samples are repeated once, so that those from any start are
    /// contiguous. Zero for a gap.
    costs: Vec<f32>,
    /// The directions of the samples and of the pieces, the latter rotated into the drawing's frame.
    directions: [Vec<[f64; 2]>; 2],
    pieces: Vec<Piece>,
    column: Vec<f32>,
    steps: Vec<u8>,
}

/// The subset of [`Weights`] that the dynamic programme itself uses.
#[derive(Debug, Clone, Copy, Default)]
struct Costs {
    stay: f32,
    gap: f32,
    unmatched: f32,
    stride: usize,
}

impl Aligner {
    /// Sets the two outlines to align, and computes the cost of every pair of a sample and a piece.
    pub fn set(&mut self, weights: &Weights, problem: &Problem<'_>) {
        let Problem { drawn, seen, turn_rad, anchor, emphasis, forbidden } = *problem;
        let Weights { stay, gap, unmatched, stride, .. } = *weights;
        let [stay, gap, unmatched] = [stay, gap, unmatched].map(|weight| weight as f32);
        self.weights = Costs { stay, gap, unmatched, stride };
        (self.turn_rad, self.samples) = (turn_rad, drawn.places.len());
        self.pieces.clear();
        self.pieces.extend(&seen.pieces);
        self.costs.clear();
        self.costs.resize(self.pieces.len() * 2 * self.samples, 0.0);
        let samples = from_start(drawn, anchor, weights);
        let [sample_directions, piece_directions] = &mut self.directions;
        sample_directions.clone_from(&drawn.directions);
        piece_directions.clear();
        for (piece, row) in self.pieces.iter().zip(self.costs.chunks_mut((2 * self.samples).max(1))) {
            let mut turned = [0.0; 2];
            if let Piece::Wall { place, direction } = piece {
                let piece = Seen::new(*place, *direction, turn_rad, anchor, weights);
                turned = piece.direction;
                for (sample, cost) in samples.iter().zip(&mut *row) {
                    *cost = sample.cost(&piece, weights) as f32;
                }
                row.iter_mut().zip(emphasis).for_each(|(cost, emphasis)| *cost *= *emphasis as f32);
                for forbidden in forbidden {
                    let off = [0, 1].map(|k| place[k] - forbidden.place[k]);
                    if off[0].hypot(off[1]) < weights.away_m {
                        row[usize::from(forbidden.sample)] += weights.forbidden as f32;
                    }
                }
                let (first, second) = row.split_at_mut(self.samples);
                second.copy_from_slice(first);
            }
            piece_directions.push(turned);
        }
    }

    /// Returns the number of samples to try as the partner of the first piece.
    pub fn starts(&self) -> usize {
        self.samples.div_ceil(self.weights.stride.max(1))
    }

    /// Returns the number of steps that the dynamic programme takes for one start.
    pub fn work(&self) -> usize {
        self.samples * self.pieces.len()
    }

    /// Returns the cost of the best alignment with the given start, an index below [`Self::starts`].
    pub fn cost(&mut self, start: usize) -> f64 {
        self.sweep::<false>(start)
    }

    /// Returns the best alignment with the given start, an index below [`Self::starts`].
    pub fn trace(&mut self, start: usize) -> Alignment {
        let cost = self.sweep::<true>(start);
        let (samples, rows) = (self.samples, self.samples + 1);
        let first = start * self.weights.stride;
        let mut sums = vec![([0.0; 2], 0.0, 0.0); samples];
        let mut partners = vec![Partner::Nothing; samples];
        let (mut i, mut j) = (samples, self.pieces.len());
        while i > 0 || j > 0 {
            let step = if j > 0 { self.steps[j * rows + i] } else { SAMPLE };
            let sample = (i + samples - 1 + first) % samples.max(1);
            match (step, j.checked_sub(1).map(|j| self.pieces[j])) {
                (BEHIND, Some(Piece::Gap(gap))) => partners[sample] = Partner::Gap(gap),
                (_, Some(Piece::Wall { place, .. })) if i > 0 => {
                    let (sum, misfit, count) = &mut sums[sample];
                    (0..2).for_each(|k| sum[k] += place[k]);
                    let [drawn, seen] = [self.directions[0][sample], self.directions[1][j - 1]];
                    *misfit += 1.0 - (drawn[0] * seen[0] + drawn[1] * seen[1]);
                    *count += 1.0;
                }
                _ => {}
            }
            i -= usize::from(matches!(step, MATCH | SAMPLE | BEHIND));
            j -= usize::from(matches!(step, MATCH | PIECE));
        }
        let mut misfits = vec![0.0; samples];
        for ((partner, misfit), (sum, off, count)) in partners.iter_mut().zip(&mut misfits).zip(sums) {
            if count > 0.0 {
                *partner = Partner::Wall(sum.map(|part| part / count));
                *misfit = (off / count) as f32;
            }
        }
        Alignment { cost, partners, misfits, turn_rad: self.turn_rad }
    }

    /// Runs the dynamic programme, one piece after another. `column[i]` is the minimum cost of aligning the first i samples,
    /// counted from the start, with the pieces so far.
    fn sweep<const TRACES: bool>(&mut self, start: usize) -> f64 {
        let (samples, first) = (self.samples, start * self.weights.stride);
        let Costs { stay, gap, unmatched, .. } = self.weights;
        let rows = samples + 1;
        self.column.clear();
        self.column.extend((0..rows).map(|i| i as f32 * unmatched));
        if TRACES {
            self.steps.clear();
            self.steps.resize((self.pieces.len() + 1) * rows, SAMPLE);
        }
        for (j, piece) in self.pieces.iter().enumerate() {
            let steps = if TRACES { &mut self.steps[(j + 1) * rows..][..rows] } else { &mut [][..] };
            if TRACES {
                steps[0] = PIECE;
            }
            if matches!(piece, Piece::Gap(_)) {
                let mut above = self.column[0];
                for (i, cell) in self.column.iter_mut().enumerate().skip(1) {
                    let (stays, behind) = (*cell, above + gap);
                    above = if behind < stays { behind } else { stays };
                    *cell = above;
                    if TRACES {
                        steps[i] = if behind < stays { BEHIND } else { PIECE };
                    }
                }
                continue;
            }
            let costs = &self.costs[j * 2 * samples + first..][..samples];
            let mut diagonal = self.column[0];
            let mut above = diagonal + costs.first().copied().unwrap_or_default() + stay;
            self.column[0] = above;
            for (i, (cell, cost)) in self.column[1..].iter_mut().zip(costs).enumerate() {
                let (both, one) = (diagonal + 2.0 * cost, cost + stay);
                let (sample, piece) = (above + one, *cell + one);
                diagonal = *cell;
                let lesser = if sample < both { sample } else { both };
                above = if piece < lesser { piece } else { lesser };
                *cell = above;
                if TRACES {
                    let less = if sample < both { SAMPLE } else { MATCH };
                    steps[i + 1] = if piece < lesser { PIECE } else { less };
                }
            }
        }
        f64::from(self.column[samples])
    }
}

/// A sample of the drawing, relative to the robot's start.
struct Drawn {
    direction: [f64; 2],
    bearing: [f64; 2],
    ln_distance: f64,
}

/// A piece of the seen outline, relative to the robot's start and rotated into the drawing's frame.
struct Seen {
    direction: [f64; 2],
    bearing: [f64; 2],
    ln_distance: f64,
    /// Weight of bearing and distance, which is 0 if the start is unknown.
    nearness: f64,
}

/// The origins from which bearings and distances are measured if the start is unknown. They do not matter.
const ANYWHERE: Anchor = Anchor { drawn: [0.0; 2], seen: [0.0; 2], scale_m: 1.0 };

fn from_start(drawn: &Outline, anchor: Option<&Anchor>, weights: &Weights) -> Vec<Drawn> {
    let anchor = anchor.unwrap_or(&ANYWHERE);
    let sample = |(place, direction): (&Place, &[f64; 2])| {
        let off = [0, 1].map(|k| (place[k] - anchor.drawn[k]) * anchor.scale_m);
        let distance = off[0].hypot(off[1]);
        let ln_distance = (distance + weights.near_m).ln();
        Drawn { direction: *direction, bearing: off.map(|part| part / distance.max(1e-9)), ln_distance }
    };
    drawn.places.iter().zip(&drawn.directions).map(sample).collect()
}

impl Seen {
    fn new(
        place: Place,
        direction: [f64; 2],
        turn_rad: f64,
        anchor: Option<&Anchor>,
        weights: &Weights,
    ) -> Self {
        let (sin, cos) = turn_rad.sin_cos();
        let turned = |v: [f64; 2]| [cos * v[0] - sin * v[1], sin * v[0] + cos * v[1]];
        let start = anchor.unwrap_or(&ANYWHERE).seen;
        let off = turned([0, 1].map(|k| place[k] - start[k]));
        let distance = off[0].hypot(off[1]);
        let nearness = (-distance / weights.reach_m).exp() + weights.share_afar;
        Self {
            direction: turned(direction),
            bearing: off.map(|part| part / distance.max(1e-9)),
            ln_distance: (distance + weights.near_m).ln(),
            nearness: if anchor.is_some() { nearness } else { 0.0 },
        }
    }
}

impl Drawn {
    fn cost(&self, seen: &Seen, weights: &Weights) -> f64 {
        let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
        let ratio = self.ln_distance - seen.ln_distance;
        let bearing = weights.bearing * (1.0 - dot(self.bearing, seen.bearing));
        let distance = weights.distance * (ratio * ratio).min(weights.most_distance);
        1.0 - dot(self.direction, seen.direction) + (bearing + distance) * seen.nearness
    }
}

/// A search for the best alignment that can be interrupted after each start.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Search {
    next: u32,
    best: Option<(f64, u32)>,
}

impl Search {
    /// Tries one or more starts, and stops after about `work` steps of the dynamic programme. Returns true if no start is left.
    pub fn advance(&mut self, aligner: &mut Aligner, work: usize) -> bool {
        let count = (work / aligner.work().max(1)).max(1);
        for start in (self.next as usize..aligner.starts()).take(count) {
            let cost = aligner.cost(start);
            if self.best.is_none_or(|(least, _)| cost < least) {
                self.best = Some((cost, start as u32));
            }
            self.next = start as u32 + 1;
        }
        self.next as usize >= aligner.starts()
    }

    /// Returns the best start found so far.
    pub fn best(&self) -> Option<usize> {
        self.least().map(|(_, start)| start)
    }

    /// Returns the lowest cost found so far, and the start that has it.
    pub fn least(&self) -> Option<(f64, usize)> {
        self.best.map(|(cost, start)| (cost, start as usize))
    }

    /// Tries all starts and returns the best alignment, or `None` if there are no starts.
    pub fn whole(aligner: &mut Aligner) -> Option<Alignment> {
        let mut search = Self::default();
        while !search.advance(aligner, usize::MAX) {}
        search.best().map(|start| aligner.trace(start))
    }
}

/// Returns the rotation from the map to the drawing that is nearest to `guess_rad` and makes their walls parallel. This relies on
/// the walls of most buildings meeting at right angles. If the walls of either outline have no main directions, returns `guess_rad`
/// unchanged.
pub fn turn_by_walls(drawn: &Outline, seen: &SeenOutline, guess_rad: f64) -> f64 {
    parallel_rad(drawn, seen).map_or(guess_rad, |parallel_rad| {
        let off = parallel_rad - guess_rad;
        guess_rad + off - FRAC_PI_2 * (off / FRAC_PI_2).round()
    })
}

/// Returns all rotations from the map to the drawing that make their walls parallel, which differ by right angles. If the walls of
/// either outline have no main directions, returns [`ROUND`] rotations, evenly spaced.
pub fn turns_by_walls(drawn: &Outline, seen: &SeenOutline) -> Vec<f64> {
    let around = |count: usize, first_rad: f64| {
        (0..count).map(|k| wrap_angle(first_rad + TAU * k as f64 / count as f64)).collect()
    };
    parallel_rad(drawn, seen).map_or_else(|| around(ROUND, 0.0), |parallel_rad| around(4, parallel_rad))
}

/// Returns a rotation from the map to the drawing that makes their walls parallel, or `None` if either have no main directions.
fn parallel_rad(drawn: &Outline, seen: &SeenOutline) -> Option<f64> {
    const LEAST_COHERENCE: f64 = 0.3;
    let walls = seen.pieces.iter().filter_map(|piece| match piece {
        Piece::Wall { direction, .. } => Some(*direction),
        Piece::Gap(_) => None,
    });
    let (drawn_rad, drawn) = main_direction(drawn.directions.iter().copied())?;
    let (seen_rad, seen) = main_direction(walls)?;
    (drawn.min(seen) > LEAST_COHERENCE).then_some(drawn_rad - seen_rad)
}

/// Returns the main direction of the walls, modulo a right angle, and how well they agree with it, from 0 to 1.
pub fn main_direction(directions: impl Iterator<Item = [f64; 2]>) -> Option<(f64, f64)> {
    let (mut sum, mut count) = ([0.0; 2], 0.0);
    for [x, y] in directions {
        // The fourth power of x + iy maps directions that differ by right angles to the same one.
        let (real, imaginary) = (x * x - y * y, 2.0 * x * y);
        sum = [sum[0] + real * real - imaginary * imaginary, sum[1] + 2.0 * real * imaginary];
        count += 1.0;
    }
    (count > 0.0).then(|| (sum[1].atan2(sum[0]) / 4.0, sum[0].hypot(sum[1]) / count))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An L with arms of unequal length, counter-clockwise. [`DRAWN`] is the same L with other proportions, as a person might draw
    /// it.
    const FLOOR: [Place; 6] = [[0.0, 0.0], [12.0, 0.0], [12.0, 3.0], [4.0, 3.0], [4.0, 8.0], [0.0, 8.0]];
    const DRAWN: [Place; 6] =
        [[0.0, 0.0], [150.0, 0.0], [150.0, 60.0], [70.0, 60.0], [70.0, 130.0], [0.0, 130.0]];
    const START: [Place; 2] = [[35.0, 65.0], [2.0, 4.0]];

    fn pieces(corners: &[Place], count: usize) -> SeenOutline {
        let outline = Outline::of_polygon(corners, count);
        let piece =
            |(place, direction): (&Place, &[f64; 2])| Piece::Wall { place: *place, direction: *direction };
        let pieces = outline.places.iter().zip(&outline.directions).map(piece).collect();
        SeenOutline { pieces, gaps: Vec::new() }
    }

    const ANCHOR: Anchor = Anchor { drawn: START[0], seen: START[1], scale_m: 0.08 };

    fn aligned_at(drawn: &Outline, seen: &SeenOutline, turn_rad: f64, anchor: Option<&Anchor>) -> Alignment {
        let mut aligner = Aligner::default();
        let problem = Problem { drawn, seen, turn_rad, anchor, emphasis: &[], forbidden: &[] };
        aligner.set(&Weights::default(), &problem);
        Search::whole(&mut aligner).unwrap()
    }

    fn aligned(drawn: &Outline, seen: &SeenOutline, turn_rad: f64) -> Alignment {
        aligned_at(drawn, seen, turn_rad, Some(&ANCHOR))
    }

    /// Returns the maximum distance, in metres, between the partner of a corner of the drawing and the corresponding corner of the
    /// floor.
    fn off_m(drawn: &Outline, alignment: &Alignment, floor: &[Place]) -> f64 {
        let nearest = |corner: &Place| {
            let off = |k: &usize| {
                let place = drawn.places[*k];
                (place[0] - corner[0]).hypot(place[1] - corner[1])
            };
            (0..drawn.places.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap()
        };
        let off = |(drawn_corner, corner): (&Place, &Place)| match alignment.partners[nearest(drawn_corner)] {
            Partner::Wall(place) => (place[0] - corner[0]).hypot(place[1] - corner[1]),
            _ => f64::INFINITY,
        };
        DRAWN.iter().zip(floor).map(off).fold(0.0, f64::max)
    }

    #[test]
    fn corners_are_matched_despite_other_proportions() {
        let drawn = Outline::of_polygon(&DRAWN, 220);
        let found = aligned(&drawn, &pieces(&FLOOR, 160), 0.0);
        assert!(off_m(&drawn, &found, &FLOOR) < 0.8, "{}", off_m(&drawn, &found, &FLOOR));
    }

    #[test]
    fn the_start_of_the_outlines_does_not_matter() {
        let drawn = Outline::of_polygon(&DRAWN, 220);
        let whole = pieces(&FLOOR, 160);
        let cost = aligned(&drawn, &whole, 0.0).cost;
        for shift in [7, 40, 111] {
            let mut turned = whole.clone();
            turned.pieces.rotate_left(shift);
            let found = aligned(&drawn, &turned, 0.0);
            assert!((found.cost - cost).abs() < 0.1 * cost, "{shift}: {} {cost}", found.cost);
            assert!(off_m(&drawn, &found, &FLOOR) < 0.8);
        }
    }

    #[test]
    fn a_rotated_map_aligns_equally_well() {
        let drawn = Outline::of_polygon(&DRAWN, 220);
        let cost = aligned(&drawn, &pieces(&FLOOR, 160), 0.0).cost;
        let turn = 2.0_f64;
        let (sin, cos) = turn.sin_cos();
        let turned = FLOOR.map(|p| {
            let off = [p[0] - START[1][0], p[1] - START[1][1]];
            [START[1][0] + cos * off[0] - sin * off[1], START[1][1] + sin * off[0] + cos * off[1]]
        });
        let seen = pieces(&turned, 160);
        let by_walls = turn_by_walls(&drawn, &seen, -turn + 0.2);
        assert!((by_walls + turn).abs() < 0.02, "{by_walls}");
        let found = aligned(&drawn, &seen, by_walls);
        assert!((found.cost - cost).abs() < 0.1 * cost, "{} {cost}", found.cost);
        assert!(off_m(&drawn, &found, &turned) < 0.8);
    }

    /// Without a start, the lengths of the arms do not matter, but the order of the turns does: only one of the four rotations that
    /// make the walls parallel fits.
    #[test]
    fn without_a_start_the_turns_of_the_walls_determine_the_rotation() {
        let drawn = Outline::of_polygon(&DRAWN, 220);
        let (sin, cos) = 2.0_f64.sin_cos();
        let turned = FLOOR.map(|p| [cos * p[0] - sin * p[1], sin * p[0] + cos * p[1]]);
        let seen = pieces(&turned, 160);
        let turns = turns_by_walls(&drawn, &seen);
        let mut found: Vec<_> =
            turns.iter().map(|&turn_rad| aligned_at(&drawn, &seen, turn_rad, None)).collect();
        found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        assert_eq!(found.len(), 4);
        assert!((wrap_angle(found[0].turn_rad + 2.0)).abs() < 0.02, "{}", found[0].turn_rad);
        assert!(found[1].cost > 1.5 * found[0].cost, "{} {}", found[1].cost, found[0].cost);
        assert!(off_m(&drawn, &found[0], &turned) < 0.8);
    }

    /// In the mirror image, the arms of the L are swapped.
    #[test]
    fn a_mirror_image_is_never_preferred() {
        let mirror = |p: Place| [-p[0], p[1]];
        let mut mirrored = DRAWN.map(mirror);
        mirrored.reverse();
        let seen = pieces(&FLOOR, 160);
        let right = aligned(&Outline::of_polygon(&DRAWN, 220), &seen, 0.0);
        let wrong = Anchor { drawn: mirror(START[0]), ..ANCHOR };
        for turn in 0..4 {
            let turn_rad = f64::from(turn) * std::f64::consts::FRAC_PI_2;
            let found = aligned_at(&Outline::of_polygon(&mirrored, 220), &seen, turn_rad, Some(&wrong));
            assert!(found.cost > 1.5 * right.cost, "{turn}: {} {}", found.cost, right.cost);
        }
    }

    /// The robot has seen the upper arm, but not the right one.
    #[test]
    fn unseen_parts_are_matched_to_gaps() {
        let drawn = Outline::of_polygon(&DRAWN, 220);
        let mut seen = pieces(&FLOOR, 160);
        seen.pieces.retain(|piece| matches!(piece, Piece::Wall { place, .. } if place[0] < 5.0));
        let gap = seen.pieces.windows(2).position(|pair| {
            let place = |piece: Piece| match piece {
                Piece::Wall { place, .. } => place,
                Piece::Gap(_) => [0.0; 2],
            };
            place(pair[1])[1] - place(pair[0])[1] > 2.0
        });
        seen.pieces.insert(gap.unwrap() + 1, Piece::Gap(0));
        seen.gaps.push(vec![[5.0, 1.5]]);
        let found = aligned(&drawn, &seen, 0.0);
        for (place, partner) in drawn.places.iter().zip(&found.partners) {
            if place[0] > 100.0 {
                assert_eq!(*partner, Partner::Gap(0), "{place:?}");
            } else if place[0] < 50.0 {
                assert!(matches!(partner, Partner::Wall(_)), "{place:?} {partner:?}");
            }
        }
    }

    #[test]
    fn a_rival_avoids_forbidden_matches() {
        let drawn = Outline::of_polygon(&DRAWN, 220);
        let seen = pieces(&FLOOR, 160);
        let best = aligned(&drawn, &seen, 0.0);
        let forbidden: Vec<_> = best.partners[30..50]
            .iter()
            .zip(30..)
            .filter_map(|(partner, sample)| match partner {
                Partner::Wall(place) => Some(Forbidden { sample, place: *place }),
                _ => None,
            })
            .collect();
        let mut aligner = Aligner::default();
        let (anchor, emphasis) = (Some(&ANCHOR), &[]);
        let problem =
            Problem { drawn: &drawn, seen: &seen, turn_rad: 0.0, anchor, emphasis, forbidden: &forbidden };
        aligner.set(&Weights::default(), &problem);
        let rival = Search::whole(&mut aligner).unwrap();
        assert!(rival.cost > best.cost + 1.0, "{} {}", rival.cost, best.cost);
    }

    #[test]
    fn an_incremental_search_finds_the_same() {
        let drawn = Outline::of_polygon(&DRAWN, 220);
        let seen = pieces(&FLOOR, 160);
        let mut aligner = Aligner::default();
        let (drawn, seen, anchor) = (&drawn, &seen, Some(&ANCHOR));
        let problem = Problem { drawn, seen, turn_rad: 0.0, anchor, emphasis: &[], forbidden: &[] };
        aligner.set(&Weights::default(), &problem);
        let whole = Search::whole(&mut aligner).unwrap();
        let mut search = Search::default();
        let mut steps = 1;
        while !search.advance(&mut aligner, 100_000) {
            steps += 1;
        }
        assert!(steps > 10);
        assert_eq!(aligner.trace(search.best().unwrap()), whole);
    }
}

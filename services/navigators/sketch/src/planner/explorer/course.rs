//! Where the goal is according to an alignment, and the robot's course to it.

use serde::{Deserialize, Serialize};
use sketchnav_mapping::alignment::{Alignment, Partner};
use sketchnav_mapping::outline::{Place, SeenOutline};

use super::path_grid::PathGrid;

/// The kind of place that a course leads to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Aim {
    /// The goal.
    Goal,
    /// The gap that leads to the goal.
    Gap,
    /// Where the best rival locates the goal, or the gap to look through for it.
    Rival,
}

impl Aim {
    /// Returns the distance from the end of a course, in metres, within which the course counts as completed.
    pub fn within_m(self) -> f64 {
        match self {
            Self::Goal => super::AT_GOAL_M,
            Self::Gap => super::AT_GAP_M,
            Self::Rival => super::AT_GAP_M,
        }
    }
}

/// A course for the robot to drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Course {
    pub aim: Aim,
    /// The place that the robot is looking for.
    pub target: Place,
    /// The reachable place that is nearest to the target.
    pub end: Place,
    /// Points of the gap that the course leads to.
    pub gap: Vec<Place>,
    /// The free space when the course was set.
    pub grid: PathGrid,
    /// The grid's cell at the end of the course.
    pub cell: usize,
}

/// Where the goal is according to an alignment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Likely {
    /// Share of the goal's outline that was seen.
    pub seen: f64,
    /// Share of the goal's outline that lies behind gaps.
    pub hidden: f64,
    /// The goal's place in the map, if enough was seen.
    pub place: Option<Place>,
    /// The gap with the largest share, and the point in the gap beyond which the goal lies.
    pub gap: Option<(u16, Place)>,
}

impl Likely {
    /// Locates the goal by an alignment. `shares` is the goal's share of each sample of the drawing's outline.
    pub fn new(shares: &[f64], outline: &SeenOutline, alignment: &Alignment) -> Self {
        let (mut seen, mut hidden, mut sum) = (0.0, 0.0, [0.0; 2]);
        let mut by_gap = vec![0.0; outline.gaps.len()];
        for (partner, share) in alignment.partners.iter().zip(shares) {
            match partner {
                Partner::Wall(place) => {
                    seen += share;
                    (0..2).for_each(|k| sum[k] += share * place[k]);
                }
                Partner::Gap(gap) => {
                    hidden += share;
                    by_gap[usize::from(*gap)] += share;
                }
                Partner::Nothing => {}
            }
        }
        let place = (seen > 1e-9).then(|| sum.map(|part| part / seen));
        let heaviest = (0..by_gap.len()).max_by(|a, b| by_gap[*a].total_cmp(&by_gap[*b]).then(b.cmp(a)));
        let gap = heaviest.filter(|gap| by_gap[*gap] > 0.0).map(|gap| {
            let points = &outline.gaps[gap];
            let along = along_gap(shares, alignment, gap as u16);
            (gap as u16, points[((along * points.len() as f64) as usize).min(points.len() - 1)])
        });
        Self { seen, hidden, place, gap }
    }
}

/// Returns how far along a gap the goal's mass behind the gap lies, from 0 to 1.
fn along_gap(shares: &[f64], alignment: &Alignment, gap: u16) -> f64 {
    let count = shares.len();
    let is_behind = |k: usize| alignment.partners[k % count] == Partner::Gap(gap);
    // Samples behind the same gap are consecutive, possibly across the drawing's first sample.
    let first = (0..count).find(|&k| is_behind(k) && !is_behind(k + count - 1)).unwrap_or_default();
    let stretch: Vec<_> =
        (first..first + count).take_while(|k| is_behind(*k)).map(|k| shares[k % count]).collect();
    let whole: f64 = stretch.iter().sum();
    let moment: f64 = stretch.iter().zip(0..).map(|(share, k)| share * (f64::from(k) + 0.5)).sum();
    if whole > 0.0 { moment / whole / stretch.len() as f64 } else { 0.5 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outline(gaps: usize) -> SeenOutline {
        let gap = |k: usize| (0..10).map(|j| [k as f64, f64::from(j)]).collect();
        SeenOutline { pieces: Vec::new(), gaps: (0..gaps).map(gap).collect() }
    }

    fn likely(shares: &[f64], partners: Vec<Partner>, gaps: usize) -> Likely {
        Likely::new(
            shares,
            &outline(gaps),
            &Alignment { cost: 0.0, partners, misfits: vec![0.0; shares.len()], turn_rad: 0.0 },
        )
    }

    #[test]
    fn a_goal_between_walls_that_were_seen_lies_at_their_mean() {
        let walls = vec![Partner::Wall([0.0, 0.0]), Partner::Wall([4.0, 0.0]), Partner::Nothing];
        let found = likely(&[0.25, 0.75, 0.0], walls, 0);
        assert_eq!((found.place, found.gap, found.hidden), (Some([3.0, 0.0]), None, 0.0));
    }

    #[test]
    fn a_goal_behind_two_gaps_lies_behind_the_one_with_more_of_it() {
        let partners = vec![Partner::Gap(0), Partner::Wall([1.0, 1.0]), Partner::Gap(1), Partner::Gap(1)];
        let found = likely(&[0.3, 0.1, 0.1, 0.5], partners, 2);
        assert!((found.hidden - 0.9).abs() < 1e-12 && (found.seen - 0.1).abs() < 1e-12);
        // Five sixths of the mass lie behind the second half of the gap.
        assert_eq!(found.gap, Some((1, [1.0, 6.0])));
    }

    /// The samples behind the gap extend across the drawing's first sample.
    #[test]
    fn how_far_along_a_gap_the_goal_lies_does_not_depend_on_where_the_samples_begin() {
        let (gap, wall) = (Partner::Gap(0), Partner::Wall([0.0; 2]));
        let found = likely(&[0.0, 0.8, 0.0, 0.1, 0.1], vec![gap, gap, wall, gap, gap], 1);
        let turned = likely(&[0.1, 0.1, 0.0, 0.8, 0.0], vec![gap, gap, gap, gap, wall], 1);
        assert_eq!(found.gap, turned.gap);
    }
}

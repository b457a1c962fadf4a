//! The interval of a success rate over drawings. Drives by the same drawing mostly have the same outcome and are not independent
//! trials, so the sample consists of drawings, each with several drives.
//!
//! The drawings are resampled with replacement, each with all of its drives, and the interval contains the middle 95 % of
//! the resulting success rates (A. C. Davison and D. V. Hinkley, Bootstrap Methods and their Application, 1997, section
//! 3.8; the percentile interval of B. Efron and R. J. Tibshirani, An Introduction to the Bootstrap, 1993, section 13.3).

use std::collections::BTreeMap;

use rand::RngExt;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::seed;
use sketchnav_schemas::statistics::wilson;

/// Number of times that the drawings are resampled.
const RESAMPLES: usize = 2_000;
/// Share of resamples beyond each end of the interval.
const TAIL: f64 = 0.025;
/// Seed of the resampling. It is fixed, so that the same counts yield the same interval regardless of the suite's seed.
const SEED: u64 = 1;

/// A 95 % interval over drawings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OverDrawings {
    /// Number of drawings. If there is only one, the interval is Wilson's over its drives, and does not apply to other drawings.
    pub drawings: usize,
    /// Lower end, from 0 to 1.
    pub low: f64,
    /// Upper end, from 0 to 1.
    pub high: f64,
}

impl OverDrawings {
    /// Computes the interval from the drawing of each drive and whether it reached its goal. Returns `None` if there are no
    /// drives, or if one has no drawing.
    pub fn of(drives: &[(Option<&str>, bool)]) -> Option<Self> {
        let mut counts: BTreeMap<&str, [usize; 2]> = BTreeMap::new();
        for (drawing, is_reached) in drives {
            let [reached, attempts] = counts.entry((*drawing)?).or_default();
            *reached += usize::from(*is_reached);
            *attempts += 1;
        }
        let counts: Vec<_> = counts.into_values().collect();
        let [low, high] = interval(&counts)?;
        Some(Self { drawings: counts.len(), low, high })
    }
}

/// Computes the interval from the successes and attempts of each drawing, or returns `None` if there are no drawings.
///
/// If all drives have the same outcome, every resample is the same, although other drawings might differ. Each drawing then counts
/// as one trial in Wilson's interval.
fn interval(counts: &[[usize; 2]]) -> Option<[f64; 2]> {
    let [reached, attempts] = counts.iter().fold([0, 0], |[a, b], [c, d]| [a + c, b + d]);
    match counts.len() {
        0 => None,
        1 => Some(wilson(reached, attempts)),
        drawings if reached == 0 || reached == attempts => Some(wilson(drawings.min(reached), drawings)),
        drawings => {
            let mut rng = seed::stream(SEED, "eval/bootstrap");
            let mut share = || {
                let drawn = (0..drawings).map(|_| counts[rng.random_range(0..drawings)]);
                let [reached, attempts] = drawn.fold([0, 0], |[a, b], [c, d]| [a + c, b + d]);
                reached as f64 / attempts as f64
            };
            let mut shares: Vec<_> = (0..RESAMPLES).map(|_| share()).collect();
            shares.sort_by(f64::total_cmp);
            let beyond = (TAIL * RESAMPLES as f64) as usize;
            Some([shares[beyond], shares[RESAMPLES - 1 - beyond]])
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// One drawing is always reached and the other one never. A resample has the first twice, once or never, in a quarter, half
    /// and a quarter of all cases. The four drives of each are not eight independent trials, for which Wilson's interval is 22
    /// to 78 %.
    #[test]
    fn two_drawings_with_different_results_allow_no_conclusion() {
        assert_eq!(interval(&[[4, 4], [0, 4]]), Some([0.0, 1.0]));
    }

    /// Of 25 drawings with four drives each, 13 are always reached. The number of reached drawings in a resample is binomial, and
    /// the middle 95 % are 8 to 18 of 25 according to tables. For 100 independent trials, the interval would be 42 to 62 %.
    #[test]
    fn drawings_that_always_end_alike_count_once_each() {
        let counts: Vec<_> = (0..25).map(|i| if i < 13 { [4, 4] } else { [0, 4] }).collect();
        let [low, high] = interval(&counts).unwrap();
        assert!((low - 8.0 / 25.0).abs() < 0.041 && (high - 18.0 / 25.0).abs() < 0.041, "{low} {high}");
    }

    #[test]
    fn if_all_drives_end_alike_each_drawing_is_one_trial() {
        assert_eq!(interval(&[[4, 4]; 25]), Some(wilson(25, 25)));
        assert_eq!(interval(&[[0, 4]; 25]), Some(wilson(0, 25)));
    }

    #[test]
    fn one_drawing_has_wilsons_interval_and_no_drawing_has_none() {
        let drives = [(Some("a"), true), (Some("a"), false), (Some("a"), true), (Some("a"), true)];
        let [low, high] = wilson(3, 4);
        assert_eq!(OverDrawings::of(&drives), Some(OverDrawings { drawings: 1, low, high }));
        assert_eq!(OverDrawings::of(&[]), None);
        assert_eq!(OverDrawings::of(&[drives[0], (None, true)]), None, "independent trials");
    }

    fn drives() -> impl Strategy<Value = Vec<[usize; 2]>> {
        proptest::collection::vec((0..=9_usize, 1..=9_usize).prop_map(|(a, n)| [a.min(n), n]), 1..30)
    }

    proptest! {
        #[test]
        fn the_interval_contains_the_share_and_is_always_the_same(counts in drives()) {
            let [low, high] = interval(&counts).unwrap();
            let [reached, attempts] = counts.iter().fold([0, 0], |[a, b], [c, d]| [a + c, b + d]);
            let share = reached as f64 / attempts as f64;
            // Wilson's ends are exact except for rounding.
            let contains = low <= share + 1e-12 && share <= high + 1e-12;
            prop_assert!(0.0 <= low && contains && high <= 1.0, "{low} {share} {high}");
            prop_assert_eq!(interval(&counts), Some([low, high]));
        }

        /// Driving each drawing twice yields no more information about other drawings.
        #[test]
        fn more_drives_of_the_same_drawings_do_not_narrow_the_interval(counts in drives()) {
            prop_assume!(counts.len() > 1);
            let twice: Vec<_> = counts.iter().map(|[a, n]| [2 * a, 2 * n]).collect();
            prop_assert_eq!(interval(&twice), interval(&counts));
        }
    }
}

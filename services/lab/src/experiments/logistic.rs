//! Logistic regression (D. R. Cox, The regression analysis of binary sequences, 1958), and measures of how good stated
//! probabilities are.

/// Weight of the prior, as the inverse variance of each coefficient. It keeps coefficients finite if the examples can be separated.
const RIDGE: f64 = 0.1;
/// Number of steps of Newton's method. Far fewer are required.
const STEPS: usize = 40;

use nalgebra::{DMatrix, DVector};

/// The probability of success as a function of features.
#[derive(Debug, Clone, PartialEq)]
pub struct Logistic {
    /// The constant, followed by the coefficient of each feature.
    pub coefficients: Vec<f64>,
}

impl Logistic {
    /// Fits the coefficients to examples, each of which consists of its features and whether it was a success. All examples must
    /// have the same number of features.
    pub fn fit(examples: &[(Vec<f64>, bool)]) -> Self {
        let width = examples.first().map_or(0, |(features, _)| features.len()) + 1;
        let mut coefficients = DVector::zeros(width);
        for _ in 0..STEPS {
            let mut gradient = DVector::zeros(width);
            let mut curvature = DMatrix::zeros(width, width);
            for k in 1..width {
                gradient[k] = -RIDGE * coefficients[k];
                curvature[(k, k)] = RIDGE;
            }
            for (features, is_success) in examples {
                let x = DVector::from_iterator(width, std::iter::once(1.0).chain(features.iter().copied()));
                let p = sigmoid(coefficients.dot(&x));
                gradient += (f64::from(u8::from(*is_success)) - p) * &x;
                curvature += (p * (1.0 - p)).max(1e-9) * &x * x.transpose();
            }
            match curvature.cholesky() {
                Some(cholesky) => coefficients += cholesky.solve(&gradient),
                None => break,
            }
        }
        Self { coefficients: coefficients.iter().copied().collect() }
    }

    /// Returns the probability of success.
    pub fn probability(&self, features: &[f64]) -> f64 {
        let [constant, coefficients @ ..] = &self.coefficients[..] else { return 0.5 };
        sigmoid(constant + coefficients.iter().zip(features).map(|(b, x)| b * x).sum::<f64>())
    }
}

fn sigmoid(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

/// Returns the area under the ROC curve of a score that should be larger for successes: the probability that it is larger for a
/// random success than for a random failure, where ties count as half. Returns `None` if there are no successes or no failures.
pub fn area_under_curve(scores: &[(f64, bool)]) -> Option<f64> {
    let of = |success: bool| scores.iter().filter(move |(_, is)| *is == success).map(|(score, _)| *score);
    let (pairs, wins) =
        of(true).flat_map(|a| of(false).map(move |b| (a, b))).fold((0.0, 0.0), |(n, w), (a, b)| {
            let win = if a > b {
                1.0
            } else if a == b {
                0.5
            } else {
                0.0
            };
            (n + 1.0, w + win)
        });
    (pairs > 0.0).then_some(wins / pairs)
}

/// Returns the mean logarithmic loss and the mean squared error (Brier 1950) of stated probabilities. On average, both are minimal
/// if the stated probabilities are the true ones.
pub fn losses(stated: &[(f64, bool)]) -> [f64; 2] {
    let count = stated.len().max(1) as f64;
    let sum = stated.iter().fold([0.0; 2], |[log, brier], (p, is_success)| {
        let of_truth = if *is_success { *p } else { 1.0 - p };
        [log - of_truth.max(1e-6).ln(), brier + (1.0 - of_truth).powi(2)]
    });
    sum.map(|sum| sum / count)
}

#[cfg(test)]
mod tests {
    use rand::RngExt;
    use rand_pcg::Pcg64Mcg;

    use super::*;

    #[test]
    fn coefficients_are_found_again_and_the_stated_probability_is_kept() {
        let truth = Logistic { coefficients: vec![0.5, 1.5, -2.0] };
        let mut random = Pcg64Mcg::new(7);
        let mut example = || {
            let features = vec![random.random_range(-1.0..1.0), random.random_range(-1.0..1.0)];
            let is_success = random.random::<f64>() < truth.probability(&features);
            (features, is_success)
        };
        let examples: Vec<_> = (0..4000).map(|_| example()).collect();
        let fitted = Logistic::fit(&examples);
        for (found, expected) in fitted.coefficients.iter().zip(&truth.coefficients) {
            assert!((found - expected).abs() < 0.25, "{fitted:?}");
        }
        let stated: Vec<_> =
            examples.iter().map(|(x, is_success)| (fitted.probability(x), *is_success)).collect();
        let mean = stated.iter().map(|(p, _)| p).sum::<f64>() / stated.len() as f64;
        let share = stated.iter().filter(|(_, is_success)| *is_success).count() as f64 / stated.len() as f64;
        assert!((mean - share).abs() < 1e-6);
        assert!(
            losses(&stated)[0] < losses(&stated.iter().map(|(_, is)| (share, *is)).collect::<Vec<_>>())[0]
        );
    }

    /// Without the prior, the coefficient of a feature that separates the examples would be infinite.
    #[test]
    fn examples_that_can_be_separated_have_finite_coefficients() {
        let examples: Vec<_> = (0..20).map(|k| (vec![f64::from(k) - 9.5], k >= 10)).collect();
        let fitted = Logistic::fit(&examples);
        assert!(fitted.coefficients.iter().all(|b| b.is_finite()));
        assert!(fitted.probability(&[3.0]) > 0.9 && fitted.probability(&[-3.0]) < 0.1);
    }

    #[test]
    fn the_area_under_the_curve_counts_pairs() {
        let scores = [(3.0, true), (2.0, true), (2.0, false), (1.0, false)];
        assert_eq!(area_under_curve(&scores), Some(3.5 / 4.0));
        assert_eq!(area_under_curve(&scores[..2]), None);
        let [log, brier] = losses(&[(0.5, true), (0.5, false)]);
        assert!((log - 2.0_f64.ln()).abs() < 1e-12 && (brier - 0.25).abs() < 1e-12);
    }
}

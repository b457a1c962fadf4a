//! Comparison of two variances by Fisher's F-test (Fisher 1924).

use sketchnav_schemas::statistics::{incomplete_beta, variance};

/// The result of comparing two variances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FTest {
    /// The ratio of the variances.
    pub f: f64,
    /// Degrees of freedom of the two samples.
    pub freedom: [usize; 2],
    /// Two-sided probability of a ratio at least this far from 1 if the variances are equal.
    pub p: f64,
}

/// Tests whether two samples are from populations of equal variance. Returns `None` if a variance cannot be computed or the
/// denominator's is 0.
pub fn f_test(numerator: &[f64], denominator: &[f64]) -> Option<FTest> {
    let f = variance(numerator)? / variance(denominator).filter(|variance| *variance > 0.0)?;
    let freedom = [numerator.len() - 1, denominator.len() - 1];
    let [a, b] = freedom.map(|freedom| freedom as f64);
    let below = incomplete_beta(a / 2.0, b / 2.0, a * f / (a * f + b));
    Some(FTest { f, freedom, p: (2.0 * below.min(1.0 - below)).min(1.0) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fishers_f_matches_published_values() {
        // The upper 5 % points of F.
        for (a, b, f) in [(1.0, 1.0, 161.448), (5.0, 10.0, 3.326), (10.0, 20.0, 2.348), (60.0, 60.0, 1.534)] {
            let above = 1.0 - incomplete_beta(a / 2.0, b / 2.0, a * f / (a * f + b));
            assert!((above - 0.05).abs() < 2e-4, "{a} {b}: {above}");
        }
        // Chronis 2007 gives 1.6 for 44 and 54 degrees of freedom.
        let above = 1.0 - incomplete_beta(22.0, 27.0, 44.0 * 1.6 / (44.0 * 1.6 + 54.0));
        assert!((above - 0.05).abs() < 3e-3, "{above}");
    }

    #[test]
    fn equal_samples_have_equal_variances() {
        let sample = [1.0, 2.0, 4.0, 7.0];
        let test = f_test(&sample, &sample).unwrap();
        assert!(test.f == 1.0 && (test.p - 1.0).abs() < 1e-9 && test.freedom == [3, 3], "{test:?}");
        assert_eq!(f_test(&sample, &[1.0, 1.0]), None);
        let wide = sample.map(|number| 20.0 * number);
        assert!(f_test(&wide, &sample).unwrap().p < 0.001);
    }
}

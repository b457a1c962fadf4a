//! Means with their intervals, and the comparison of two variances (Student 1908, Fisher 1924).

use std::f64::consts::PI;

/// The mean of numbers; 0 if there are none.
pub fn mean(numbers: &[f64]) -> f64 {
    numbers.iter().sum::<f64>() / numbers.len().max(1) as f64
}

/// The variance of the population that a sample is drawn from; `None` for fewer than two numbers.
pub fn variance(numbers: &[f64]) -> Option<f64> {
    let middle = mean(numbers);
    let squares: f64 = numbers.iter().map(|number| (number - middle).powi(2)).sum();
    (numbers.len() > 1).then(|| squares / (numbers.len() - 1) as f64)
}

/// Student's 95 % interval of the mean; `None` for fewer than two numbers.
pub fn interval_of_mean(numbers: &[f64]) -> Option<[f64; 2]> {
    let count = numbers.len() as f64;
    let half = student(0.95, count - 1.0) * (variance(numbers)? / count).sqrt();
    Some([mean(numbers) - half, mean(numbers) + half])
}

/// The comparison of two variances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FTest {
    /// The ratio of the variances.
    pub f: f64,
    /// Degrees of freedom of both.
    pub freedom: [usize; 2],
    /// The two-sided probability of a ratio that far from 1 if the variances are equal.
    pub p: f64,
}

/// Whether two samples are from populations of equal variance; `None` if one has no variance.
pub fn f_test(numerator: &[f64], denominator: &[f64]) -> Option<FTest> {
    let f = variance(numerator)? / variance(denominator).filter(|variance| *variance > 0.0)?;
    let freedom = [numerator.len() - 1, denominator.len() - 1];
    let [a, b] = freedom.map(|freedom| freedom as f64);
    let below = incomplete_beta(a / 2.0, b / 2.0, a * f / (a * f + b));
    Some(FTest { f, freedom, p: (2.0 * below.min(1.0 - below)).min(1.0) })
}

/// The number that the absolute value of Student's t exceeds in only this share of cases.
fn student(share: f64, freedom: f64) -> f64 {
    let outside = |t: f64| incomplete_beta(freedom / 2.0, 0.5, freedom / (freedom + t * t));
    let (mut low, mut high) = (0.0, 1e4);
    for _ in 0..100 {
        let middle = f64::midpoint(low, high);
        if outside(middle) > 1.0 - share { low = middle } else { high = middle }
    }
    high
}

/// The regularized incomplete beta function, by its continued fraction (Abramowitz and Stegun 1964, 26.5.8).
fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return f64::from(u8::from(x >= 1.0));
    }
    // It converges fast only on this side.
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(b, a, 1.0 - x);
    }
    let front = (a * x.ln() + b * (1.0 - x).ln() + ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b)).exp() / a;
    let term = |i: u32| {
        let m = f64::from(i / 2);
        if i.is_multiple_of(2) {
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m))
        } else {
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0))
        }
    };
    // Evaluated from its end backwards; 200 terms are more than enough for a few hundred degrees of freedom.
    front / (1..=200).rev().fold(1.0, |rest, i| 1.0 + term(i) / rest)
}

/// The logarithm of the gamma function above 0 (Lanczos 1964, with Pugh's coefficients for g = 5).
fn ln_gamma(x: f64) -> f64 {
    const COEFFICIENTS: [f64; 6] = [
        76.180_091_729_471_46,
        -86.505_320_329_416_77,
        24.014_098_240_830_91,
        -1.231_739_572_450_155,
        0.001_208_650_973_866_179,
        -0.000_005_395_239_384_953,
    ];
    let base = x + 5.5;
    let series = COEFFICIENTS.iter().enumerate().map(|(i, coefficient)| coefficient / (x + 1.0 + i as f64));
    let sum = 1.000_000_000_190_015 + series.sum::<f64>();
    (x + 0.5) * base.ln() - base + ((2.0 * PI).sqrt() * sum / x).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn student_s_numbers_are_those_of_the_books() {
        for (freedom, t) in [(1.0, 12.706), (8.0, 2.306), (10.0, 2.228), (19.0, 2.093), (120.0, 1.980)] {
            assert!((student(0.95, freedom) - t).abs() < 6e-4, "{freedom}");
        }
    }

    #[test]
    fn fisher_s_numbers_are_those_of_the_books() {
        // Upper 5 % points of F.
        for (a, b, f) in [(1.0, 1.0, 161.448), (5.0, 10.0, 3.326), (10.0, 20.0, 2.348), (60.0, 60.0, 1.534)] {
            let above = 1.0 - incomplete_beta(a / 2.0, b / 2.0, a * f / (a * f + b));
            assert!((above - 0.05).abs() < 2e-4, "{a} {b}: {above}");
        }
        // 1.6 is the value of Chronis 2007 for 44 and 54 degrees.
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

    #[test]
    fn the_mean_lies_in_the_middle_of_its_interval() {
        let [low, high] = interval_of_mean(&[1.0, 2.0, 3.0]).unwrap();
        // 4.303 / √3 to either side.
        assert!((low + 0.484).abs() < 1e-3 && (high - 4.484).abs() < 1e-3, "{low} {high}");
        assert_eq!(interval_of_mean(&[1.0]), None);
    }
}

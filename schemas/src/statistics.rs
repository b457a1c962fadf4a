//! Statistics: rates and means with their confidence intervals.

use std::f64::consts::PI;

/// The 97.5 % point of the normal distribution, with which an interval contains the true rate in 95 % of all cases.
const Z: f64 = 1.959_963_984_540_054;

/// Returns Wilson's interval for a rate, from 0 to 1 (E. B. Wilson, JASA 22, 1927). With no attempts, it is the whole range.
pub fn wilson(successes: usize, attempts: usize) -> [f64; 2] {
    if attempts == 0 {
        return [0.0, 1.0];
    }
    let n = attempts as f64;
    let p = successes as f64 / n;
    let middle = p + Z * Z / (2.0 * n);
    let half = Z * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
    let scale = 1.0 + Z * Z / n;
    [((middle - half) / scale).max(0.0), ((middle + half) / scale).min(1.0)]
}

/// Returns the mean of the numbers, or 0 if there are none.
pub fn mean(numbers: &[f64]) -> f64 {
    numbers.iter().sum::<f64>() / numbers.len().max(1) as f64
}

/// Returns the median, or `None` if there are no numbers. For an even count, it is the mean of the two middle numbers.
pub fn median(numbers: &[f64]) -> Option<f64> {
    let mut sorted = numbers.to_vec();
    sorted.sort_by(f64::total_cmp);
    let upper = *sorted.get(sorted.len() / 2)?;
    Some(if sorted.len() % 2 == 1 { upper } else { f64::midpoint(sorted[sorted.len() / 2 - 1], upper) })
}

/// Returns the sample variance, an unbiased estimate of the population's. `None` for fewer than two numbers.
pub fn variance(numbers: &[f64]) -> Option<f64> {
    let middle = mean(numbers);
    let squares: f64 = numbers.iter().map(|number| (number - middle).powi(2)).sum();
    (numbers.len() > 1).then(|| squares / (numbers.len() - 1) as f64)
}

/// Returns Student's 95 % interval of the mean (Student, Biometrika 6, 1908), or `None` for fewer than two numbers.
pub fn interval_of_mean(numbers: &[f64]) -> Option<[f64; 2]> {
    let count = numbers.len() as f64;
    let half = student(0.95, count - 1.0) * (variance(numbers)? / count).sqrt();
    Some([mean(numbers) - half, mean(numbers) + half])
}

/// Returns the number that the absolute value of Student's t stays below with probability `share`.
fn student(share: f64, freedom: f64) -> f64 {
    let outside = |t: f64| incomplete_beta(freedom / 2.0, 0.5, freedom / (freedom + t * t));
    let (mut low, mut high) = (0.0, 1e4);
    for _ in 0..100 {
        let middle = f64::midpoint(low, high);
        if outside(middle) > 1.0 - share { low = middle } else { high = middle }
    }
    high
}

/// Returns the regularized incomplete beta function, by its continued fraction (Abramowitz and Stegun 1964, 26.5.8).
pub fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return f64::from(u8::from(x >= 1.0));
    }
    // The fraction converges fast only on this side.
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
    // The fraction is evaluated from its end backwards. 200 terms are more than enough for a few hundred degrees of
    // freedom.
    front / (1..=200).rev().fold(1.0, |rest, i| 1.0 + term(i) / rest)
}

/// Returns the logarithm of the gamma function above 0 (Lanczos 1964, with Pugh's coefficients for g = 5).
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

    /// Values of Newcombe, Statistics in Medicine 17 (1998), table I, method 3.
    #[test]
    fn wilsons_interval_matches_published_values() {
        for (successes, attempts, low, high) in [
            (81, 263, 0.2553, 0.3662),
            (15, 148, 0.0624, 0.1605),
            (0, 20, 0.0, 0.1611),
            (1, 29, 0.0061, 0.1718),
        ] {
            let [a, b] = wilson(successes, attempts);
            assert!((a - low).abs() < 6e-5 && (b - high).abs() < 6e-5, "{successes}/{attempts}: {a} {b}");
        }
        assert_eq!(wilson(0, 0), [0.0, 1.0]);
        assert_eq!(wilson(20, 20)[1], 1.0);
    }

    #[test]
    fn students_t_matches_published_values() {
        for (freedom, t) in [(1.0, 12.706), (8.0, 2.306), (10.0, 2.228), (19.0, 2.093), (120.0, 1.980)] {
            assert!((student(0.95, freedom) - t).abs() < 6e-4, "{freedom}");
        }
    }

    #[test]
    fn the_median_of_an_even_count_lies_between_the_two_in_the_middle() {
        assert_eq!(median(&[]), None);
        assert_eq!(median(&[449.0]), Some(449.0));
        assert_eq!(median(&[496.0, 65.0]), Some(280.5));
        assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[4.0, 1.0, 3.0, 2.0]), Some(2.5));
    }

    #[test]
    fn the_mean_is_the_middle_of_its_interval() {
        let [low, high] = interval_of_mean(&[1.0, 2.0, 3.0]).unwrap();
        // 4.303 / √3 on either side.
        assert!((low + 0.484).abs() < 1e-3 && (high - 4.484).abs() < 1e-3, "{low} {high}");
        assert_eq!(interval_of_mean(&[1.0]), None);
    }
}

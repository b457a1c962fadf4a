//! Statistics of counts.

/// The 97.5 % point of the normal distribution: intervals contain the true rate in 95 % of all cases.
const Z: f64 = 1.959_963_984_540_054;

/// Wilson's interval for a rate, from 0 to 1 (E. B. Wilson, JASA 22, 1927); with no attempts it is the whole range.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of Newcombe, Statistics in Medicine 17 (1998), table I, method 3.
    #[test]
    fn wilson_s_interval_is_that_of_the_books() {
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
}

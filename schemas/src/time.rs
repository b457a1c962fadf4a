//! Simulation time, which is in nanoseconds in messages and in seconds in files and output.

/// Nanoseconds in a second.
pub const NS_PER_S: u64 = 1_000_000_000;

/// Converts nanoseconds to seconds.
pub fn seconds(ns: u64) -> f64 {
    ns as f64 / NS_PER_S as f64
}

/// Converts seconds to nanoseconds, rounded to the nearest. Saturates at 0 and at the largest value.
pub fn nanoseconds(s: f64) -> u64 {
    (s * NS_PER_S as f64).round() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back() {
        assert_eq!((seconds(1_500_000_000), nanoseconds(1.5)), (1.5, 1_500_000_000));
        assert_eq!((seconds(NS_PER_S), nanoseconds(1.0)), (1.0, NS_PER_S));
        assert_eq!((nanoseconds(-1.0), nanoseconds(f64::INFINITY)), (0, u64::MAX));
    }
}

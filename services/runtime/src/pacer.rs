//! Paces simulated time by the wall clock.

use std::time::{Duration, Instant};

/// Determines when a simulated time is due.
#[derive(Debug, Clone, Copy)]
pub struct Pacer {
    started: Instant,
    started_ns: u64,
    speed: f64,
}

impl Pacer {
    /// Starts at the simulated time `now_ns`, which then advances by `speed` seconds (more than 0) per second of real time.
    pub fn start(now_ns: u64, speed: f64) -> Self {
        Self { started: Instant::now(), started_ns: now_ns, speed }
    }

    /// Returns the time until the simulated time `stamp_ns` is due, or zero if it has passed.
    pub fn until(&self, stamp_ns: u64) -> Duration {
        due_after(stamp_ns.saturating_sub(self.started_ns), self.speed).saturating_sub(self.started.elapsed())
    }
}

fn due_after(stamp_ns: u64, speed: f64) -> Duration {
    Duration::try_from_secs_f64(stamp_ns as f64 * 1e-9 / speed).unwrap_or(Duration::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twice_the_rate_halves_the_wait() {
        assert_eq!(due_after(3_000_000_000, 1.0), Duration::from_secs(3));
        assert_eq!(due_after(3_000_000_000, 2.0), Duration::from_millis(1500));
        assert_eq!(due_after(1, 0.0), Duration::MAX);
    }
}

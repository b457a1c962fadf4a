//! When a recorded message is due, by the clock.

use std::time::{Duration, Instant};

use super::super::args::Rate;

/// Slowest and fastest that the keys set.
const RATES: std::ops::RangeInclusive<f64> = 1.0 / 64.0..=64.0;

/// Recorded time against the clock.
pub struct Clock {
    rate: Rate,
    /// A recorded time, and when it was.
    anchor: Option<(u64, Instant)>,
}

impl Clock {
    pub fn new(rate: Rate) -> Self {
        Self { rate, anchor: None }
    }

    /// How long until a message of that recorded time is due.
    pub fn until(&mut self, stamp_ns: u64) -> Duration {
        let Rate::Times(rate) = self.rate else { return Duration::ZERO };
        let (from_ns, since) = *self.anchor.get_or_insert((stamp_ns, Instant::now()));
        let due = Duration::from_nanos((stamp_ns.saturating_sub(from_ns) as f64 / rate) as u64);
        due.saturating_sub(since.elapsed())
    }

    /// The next message is due at once: after a pause, a seek, another rate.
    pub fn restart(&mut self) {
        self.anchor = None;
    }

    /// Twice as fast, or half; `max` is left for real time.
    pub fn change_rate(&mut self, factor: f64) {
        let now = if let Rate::Times(rate) = self.rate { rate } else { 1.0 };
        self.rate = Rate::Times((now * factor).clamp(*RATES.start(), *RATES.end()));
        self.restart();
    }

    pub fn rate(&self) -> String {
        match self.rate {
            Rate::Max => "max".to_owned(),
            Rate::Times(rate) => format!("{rate} ×"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_due_by_its_rate() {
        let mut clock = Clock::new(Rate::Times(4.0));
        assert_eq!(clock.until(1_000_000_000), Duration::ZERO);
        let due = clock.until(9_000_000_000);
        assert!(due > Duration::from_millis(1500) && due <= Duration::from_secs(2), "{due:?}");
        clock.change_rate(2.0);
        assert_eq!((clock.until(9_000_000_000), clock.rate()), (Duration::ZERO, "8 ×".to_owned()));
        assert_eq!(Clock::new(Rate::Max).until(u64::MAX), Duration::ZERO);
    }
}

//! Computes when a recorded message is due by the wall clock.

use std::time::{Duration, Instant};

use super::super::args::Rate;

/// Range of rates that the keys can set.
const RATES: std::ops::RangeInclusive<f64> = 1.0 / 64.0..=64.0;

/// Relates recorded time to the wall clock.
pub struct Clock {
    rate: Rate,
    /// A recorded time, in nanoseconds, and the time when it was played.
    anchor: Option<(u64, Instant)>,
    is_paused: bool,
    /// The timestamp of the instant that is being stepped through, in nanoseconds.
    stepping_ns: Option<u64>,
}

impl Clock {
    pub fn new(rate: Rate, is_paused: bool) -> Self {
        Self { rate, anchor: None, is_paused, stepping_ns: None }
    }

    /// Returns the time until a message with the given timestamp is due, or `None` while paused.
    pub fn until(&mut self, stamp_ns: u64) -> Option<Duration> {
        if self.stepping_ns == Some(stamp_ns) {
            return Some(Duration::ZERO);
        }
        if self.is_paused {
            self.anchor = None;
            return None;
        }
        Some(self.until_by_rate(stamp_ns))
    }

    fn until_by_rate(&mut self, stamp_ns: u64) -> Duration {
        let Rate::Times(rate) = self.rate else { return Duration::ZERO };
        let (from_ns, since) = *self.anchor.get_or_insert((stamp_ns, Instant::now()));
        let due = Duration::from_nanos((stamp_ns.saturating_sub(from_ns) as f64 / rate) as u64);
        due.saturating_sub(since.elapsed())
    }

    /// Makes the next message due immediately, after a pause, a seek or a change of the rate.
    pub fn restart(&mut self) {
        (self.anchor, self.stepping_ns) = (None, None);
    }

    pub fn toggle_pause(&mut self) {
        self.is_paused = !self.is_paused;
    }

    /// Makes all messages of the instant with the given timestamp due, and none after it.
    pub fn step(&mut self, stamp_ns: u64) {
        (self.is_paused, self.stepping_ns) = (true, Some(stamp_ns));
    }

    /// Multiplies the rate by a factor. The rate `max` first becomes real time.
    pub fn change_rate(&mut self, factor: f64) {
        let now = if let Rate::Times(rate) = self.rate { rate } else { 1.0 };
        self.rate = Rate::Times((now * factor).clamp(*RATES.start(), *RATES.end()));
        self.restart();
    }

    /// Returns the playback rate for people to read, or `paused`.
    pub fn words(&self) -> String {
        match self.rate {
            _ if self.is_paused => "paused".to_owned(),
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
        let mut clock = Clock::new(Rate::Times(4.0), false);
        assert_eq!(clock.until(1_000_000_000), Some(Duration::ZERO));
        let due = clock.until(9_000_000_000).unwrap();
        assert!(due > Duration::from_millis(1500) && due <= Duration::from_secs(2), "{due:?}");
        clock.change_rate(2.0);
        assert_eq!((clock.until(9_000_000_000), clock.words()), (Some(Duration::ZERO), "8 ×".to_owned()));
        assert_eq!(Clock::new(Rate::Max, false).until(u64::MAX), Some(Duration::ZERO));
    }

    /// Regression test: a step used to be a single message, so stepping through an instant of nine messages took nine steps.
    #[test]
    fn a_step_is_an_instant() {
        let mut clock = Clock::new(Rate::Max, true);
        assert_eq!((clock.until(100), clock.words().as_str()), (None, "paused"));
        clock.step(100);
        assert_eq!(
            [100, 100, 200].map(|ns| clock.until(ns)),
            [Some(Duration::ZERO), Some(Duration::ZERO), None]
        );
        clock.toggle_pause();
        assert_eq!(clock.until(200), Some(Duration::ZERO));
    }
}

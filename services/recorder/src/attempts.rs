//! Schedules further attempts at a failed recording, after pauses that grow while the disk stays full.

use std::time::{Duration, Instant};

/// The pause before the first attempt to continue a failed recording. It doubles with each further attempt.
const FIRST_PAUSE: Duration = Duration::from_secs(1);
const LONGEST_PAUSE: Duration = Duration::from_secs(16);

/// The time of the next attempt, and the pause before the one after it.
#[derive(Debug)]
pub(crate) struct Attempts {
    next: Option<Instant>,
    pause: Duration,
}

impl Attempts {
    pub(crate) fn new() -> Self {
        Self { next: None, pause: FIRST_PAUSE }
    }

    /// Returns true if another attempt is due. Only call this while the recording has failed.
    pub(crate) fn is_due(&mut self, now: Instant) -> bool {
        if now < *self.next.get_or_insert(now + self.pause) {
            return false;
        }
        (self.next, self.pause) = (None, LONGEST_PAUSE.min(2 * self.pause));
        true
    }

    /// Records that the recording continues and has reached the device, so that the next failure counts as a new one.
    pub(crate) fn succeeded(&mut self) {
        *self = Self::new();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOOK: Duration = Duration::from_millis(5);

    /// Returns the time until the next attempt, in seconds.
    fn next(attempts: &mut Attempts, now: &mut Instant) -> f64 {
        let begin = *now;
        while !attempts.is_due(*now) {
            *now += LOOK;
        }
        (*now - begin).as_secs_f64()
    }

    /// Regression test: after the disk had been full for a long time, the recorder stayed slow. When the disk filled up again, the
    /// recorder returned later than the channels can bridge.
    #[test]
    fn pauses_grow_while_the_disk_is_full_and_reset_afterwards() {
        let (mut attempts, mut now) = (Attempts::new(), Instant::now());
        let pauses: Vec<_> = (0..6).map(|_| next(&mut attempts, &mut now)).collect();
        assert_eq!(pauses, [1.0, 2.0, 4.0, 8.0, 16.0, 16.0]);
        attempts.succeeded();
        assert_eq!(next(&mut attempts, &mut now), 1.0);
    }
}

//! When a recording that failed is tried again: after pauses that grow while the disk stays full.

use std::time::{Duration, Instant};

/// First pause before a recording that failed is tried again; each further one is twice as long.
const FIRST_PAUSE: Duration = Duration::from_secs(1);
const LONGEST_PAUSE: Duration = Duration::from_secs(16);

/// The next attempt, and the pause before the one after it.
#[derive(Debug)]
pub(crate) struct Attempts {
    next: Option<Instant>,
    pause: Duration,
}

impl Attempts {
    pub(crate) fn new() -> Self {
        Self { next: None, pause: FIRST_PAUSE }
    }

    /// Whether it is time for an attempt, now that the recording has failed.
    pub(crate) fn is_due(&mut self, now: Instant) -> bool {
        if now < *self.next.get_or_insert(now + self.pause) {
            return false;
        }
        (self.next, self.pause) = (None, LONGEST_PAUSE.min(2 * self.pause));
        true
    }

    /// The recording goes on, and is on the device: the next failure is another one.
    pub(crate) fn succeeded(&mut self) {
        *self = Self::new();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOOK: Duration = Duration::from_millis(5);

    /// After how many seconds the next attempt is made.
    fn next(attempts: &mut Attempts, now: &mut Instant) -> f64 {
        let begin = *now;
        while !attempts.is_due(*now) {
            *now += LOOK;
        }
        (*now - begin).as_secs_f64()
    }

    /// A disk that was full for long once made the recorder slow for ever. It came back to a second full disk later
    /// than the channels can hold.
    #[test]
    fn pauses_grow_while_the_disk_is_full_and_begin_anew_when_it_was_not() {
        let (mut attempts, mut now) = (Attempts::new(), Instant::now());
        let pauses: Vec<_> = (0..6).map(|_| next(&mut attempts, &mut now)).collect();
        assert_eq!(pauses, [1.0, 2.0, 4.0, 8.0, 16.0, 16.0]);
        attempts.succeeded();
        assert_eq!(next(&mut attempts, &mut now), 1.0);
    }
}

//! When to start a process again that has died: at once, then after growing pauses, in the end no more.
//!
//! What counts is whether it gets anywhere. A process that is killed again and again but does something
//! new in between is started again as often as that; one that dies of the same message each time is not.

use std::time::Duration;

/// The pause before the second attempt of a row; each further one is twice as long.
const FIRST_PAUSE: Duration = Duration::from_millis(50);
/// Who has lived so long was well, whether there was anything to do or not.
const GOOD_LIFE: Duration = Duration::from_secs(10);
/// Attempts in a row: the last comes some six seconds after the first.
const ATTEMPTS: u32 = 8;

/// The attempts of one process.
#[derive(Debug, Clone, Default)]
pub(crate) struct Restarts {
    in_a_row: u32,
    progress: Option<u32>,
    total: u64,
    pause: Duration,
}

impl Restarts {
    /// The process has died after `life`, having come so far (over all its lives). How long to wait before it is
    /// started again; `None` where that is given up.
    pub(crate) fn pause_after_death(&mut self, life: Duration, progress: u32) -> Option<Duration> {
        if self.progress.replace(progress) != Some(progress) || life >= GOOD_LIFE {
            self.in_a_row = 0;
        }
        let attempt = self.in_a_row;
        self.in_a_row += 1;
        self.total += u64::from(attempt < ATTEMPTS);
        self.pause = match attempt {
            0 => Duration::ZERO,
            1..ATTEMPTS => FIRST_PAUSE * (1 << (attempt - 1)),
            _ => return None,
        };
        Some(self.pause)
    }

    /// Attempts in a row that came to nothing, and the one that is made now.
    pub(crate) fn attempt(&self) -> u32 {
        self.in_a_row
    }

    /// The pause before the last attempt.
    pub(crate) fn pause(&self) -> Duration {
        self.pause
    }

    /// How often it was started again.
    pub(crate) fn total(&self) -> u64 {
        self.total
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHORT: Duration = Duration::from_millis(20);

    #[test]
    fn pauses_grow_and_end() {
        let mut restarts = Restarts::default();
        let mut pause = || restarts.pause_after_death(SHORT, 3).map(|pause| pause.as_millis());
        let pauses: Vec<_> = (0..9).map(|_| pause()).collect();
        let expected = [0, 50, 100, 200, 400, 800, 1600, 3200].map(Some);
        assert_eq!((&pauses[..8], pauses[8]), (&expected[..], None));
        assert_eq!(restarts.total(), 8);
    }

    #[test]
    fn who_gets_on_is_started_again_for_ever() {
        let mut restarts = Restarts::default();
        assert!((0..1000).all(|i| restarts.pause_after_death(SHORT, i) == Some(Duration::ZERO)));
        assert_eq!(restarts.pause_after_death(SHORT, 999), Some(FIRST_PAUSE));
        assert_eq!(restarts.pause_after_death(GOOD_LIFE, 999), Some(Duration::ZERO));
    }
}

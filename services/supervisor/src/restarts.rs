//! Decides when to restart a process that has died: immediately, then after growing pauses, and finally not at all.
//!
//! The decision depends on progress. A process that is killed over and over, but sends something new in between, is restarted each
//! time. If a process dies on the same message each time, or hangs, the supervisor eventually gives up on it.

use std::time::Duration;

/// Pause before the second attempt in a row. It doubles with each further attempt.
const FIRST_PAUSE: Duration = Duration::from_millis(50);
/// Maximum number of attempts in a row. Their pauses add up to about six seconds.
const ATTEMPTS: u32 = 8;

/// If a process has run for this long without hanging when it is killed from outside, it counts as healthy, even if it had nothing
/// to send.
const PEACEFUL: Duration = Duration::from_secs(10);

/// How one run of a process ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    /// The process was killed because it hung.
    Hung,
    /// The process failed by itself, with an error, a panic or a crash.
    Failed,
    /// The process was killed by another process.
    Killed {
        /// Time for which the process had been running.
        after: Duration,
    },
}

/// Restarts of one process.
#[derive(Debug, Clone, Default)]
pub(crate) struct Restarts {
    in_a_row: u32,
    progress: Option<u32>,
    total: u64,
    pause: Duration,
}

impl Restarts {
    /// Counts a death, given the progress of the process across all restarts. Returns the pause before the process is restarted, or
    /// `None` if it has failed for good.
    pub(crate) fn pause_after_death(&mut self, end: End, progress: u32) -> Option<Duration> {
        let got_on = self.progress.replace(progress) != Some(progress);
        let was_good = match end {
            End::Hung => false,
            End::Failed => got_on,
            End::Killed { after } => got_on || after >= PEACEFUL,
        };
        if was_good {
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

    /// Returns the number of the current attempt in a row without progress.
    pub(crate) fn attempt(&self) -> u32 {
        self.in_a_row
    }

    /// Returns the pause before the last attempt.
    pub(crate) fn pause(&self) -> Duration {
        self.pause
    }

    /// Returns the number of restarts of the process.
    pub(crate) fn total(&self) -> u64 {
        self.total
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KILLED: End = End::Killed { after: Duration::from_secs(1) };

    fn millis(pause: Option<Duration>) -> Option<u128> {
        pause.map(|pause| pause.as_millis())
    }

    const PAUSES: [Option<u128>; 9] =
        [Some(0), Some(50), Some(100), Some(200), Some(400), Some(800), Some(1600), Some(3200), None];

    #[test]
    fn pauses_grow_and_end() {
        let mut restarts = Restarts::default();
        assert_eq!(PAUSES.map(|_| millis(restarts.pause_after_death(KILLED, 3))), PAUSES);
        assert_eq!(restarts.total(), 8);
    }

    #[test]
    fn a_process_that_makes_progress_is_restarted_without_limit() {
        let mut restarts = Restarts::default();
        assert!((0..1000).all(|i| restarts.pause_after_death(KILLED, i) == Some(Duration::ZERO)));
        assert_eq!(restarts.pause_after_death(KILLED, 999), Some(FIRST_PAUSE));
        assert_eq!(restarts.pause_after_death(KILLED, 1000), Some(Duration::ZERO));
    }

    /// Regression test: a life of ten seconds used to count as healthy, but a hanging process is killed only after thirty, so a
    /// process that hung on the same drawing each time was restarted forever.
    #[test]
    fn a_process_that_hangs_after_every_restart_is_given_up() {
        let mut restarts = Restarts::default();
        assert_eq!(PAUSES.map(|_| millis(restarts.pause_after_death(End::Hung, 3))), PAUSES);
        let (mut restarts, mut progress) = (Restarts::default(), 0);
        let hangs = PAUSES.map(|_| {
            progress += 1;
            millis(restarts.pause_after_death(End::Hung, progress))
        });
        assert_eq!(hangs, PAUSES);
    }

    #[test]
    fn a_long_life_resets_the_count_of_hangs() {
        let mut restarts = Restarts::default();
        (0..5).for_each(|_| assert!(restarts.pause_after_death(End::Hung, 3).is_some()));
        assert_eq!(
            restarts.pause_after_death(KILLED, 4),
            Some(Duration::ZERO),
            "it was killed, and had got on"
        );
        assert_eq!(restarts.pause_after_death(End::Hung, 5), Some(FIRST_PAUSE));
    }

    /// A sketcher sends its sketch once and then waits, so killing it every minute must not end the mission. A sketcher that
    /// crashes every minute before it has sent anything must end it.
    #[test]
    fn an_idle_process_is_restarted_without_limit() {
        let end = End::Killed { after: Duration::from_secs(60) };
        let mut restarts = Restarts::default();
        assert!((0..100).all(|_| restarts.pause_after_death(end, 3) == Some(Duration::ZERO)));
        let mut restarts = Restarts::default();
        assert_eq!(PAUSES.map(|_| millis(restarts.pause_after_death(End::Failed, 3))), PAUSES);
    }
}

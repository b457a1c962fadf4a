//! When to restart a process that has died: at once, then after growing pauses, and finally not at all.
//!
//! What counts is progress. A process that is killed over and over but sends something new in between is restarted each
//! time. One that dies of the same message each time is given up eventually, and so is one that hangs.

use std::time::Duration;

/// The pause before the second attempt in a row; it doubles with each further one.
const FIRST_PAUSE: Duration = Duration::from_millis(50);
/// Attempts in a row; their pauses add up to some six seconds.
const ATTEMPTS: u32 = 8;

/// A process that lived this long, did not hang and was killed from outside was healthy and had nothing to send.
const PEACEFUL: Duration = Duration::from_secs(10);

/// How a life ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    /// It hung and was killed for that.
    Hung,
    /// It ended by itself, with an error, a panic or a crash.
    Failed,
    /// Another process killed it.
    Killed {
        /// The length of its life.
        after: Duration,
    },
}

/// The restarts of one process.
#[derive(Debug, Clone, Default)]
pub(crate) struct Restarts {
    in_a_row: u32,
    progress: Option<u32>,
    total: u64,
    pause: Duration,
}

impl Restarts {
    /// Counts a death. `progress` is the process's progress across all restarts. Returns how long to wait before it is
    /// restarted; `None` if it is given up.
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

    /// The number of the current attempt in a row without progress.
    pub(crate) fn attempt(&self) -> u32 {
        self.in_a_row
    }

    /// The pause before the last attempt.
    pub(crate) fn pause(&self) -> Duration {
        self.pause
    }

    /// How often it was restarted.
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
    fn who_gets_on_is_started_again_for_ever() {
        let mut restarts = Restarts::default();
        assert!((0..1000).all(|i| restarts.pause_after_death(KILLED, i) == Some(Duration::ZERO)));
        assert_eq!(restarts.pause_after_death(KILLED, 999), Some(FIRST_PAUSE));
        assert_eq!(restarts.pause_after_death(KILLED, 1000), Some(Duration::ZERO));
    }

    /// A life of ten seconds used to count as healthy, while a process that hangs is killed only after thirty. One that
    /// hung in the same drawing each time was restarted forever.
    #[test]
    fn who_hangs_each_time_is_given_up_whatever_it_has_sent_before() {
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
    fn after_a_good_life_a_hang_is_the_first() {
        let mut restarts = Restarts::default();
        (0..5).for_each(|_| assert!(restarts.pause_after_death(End::Hung, 3).is_some()));
        assert_eq!(
            restarts.pause_after_death(KILLED, 4),
            Some(Duration::ZERO),
            "it was killed, and had got on"
        );
        assert_eq!(restarts.pause_after_death(End::Hung, 5), Some(FIRST_PAUSE));
    }

    /// A sketcher sends its sketch once and then waits; killing it every minute must not end the mission. One that
    /// crashes every minute before it has sent anything must end it.
    #[test]
    fn who_waits_in_peace_and_is_killed_is_started_again_for_ever() {
        let end = End::Killed { after: Duration::from_secs(60) };
        let mut restarts = Restarts::default();
        assert!((0..100).all(|_| restarts.pause_after_death(end, 3) == Some(Duration::ZERO)));
        let mut restarts = Restarts::default();
        assert_eq!(PAUSES.map(|_| millis(restarts.pause_after_death(End::Failed, 3))), PAUSES);
    }
}

//! When to start a process again that has died: at once, then after growing pauses, in the end no more.
//!
//! What counts is whether it gets anywhere. A process that is killed again and again but sends something new in between is
//! started again as often as that. One that dies of the same message each time is not, and neither is one that hangs.

use std::time::Duration;

/// The pause before the second attempt of a row; each further one is twice as long.
const FIRST_PAUSE: Duration = Duration::from_millis(50);
/// Attempts in a row: their pauses are some six seconds together.
const ATTEMPTS: u32 = 8;

/// Who was killed by somebody else after so long, and did not hang, had nothing to send and nothing wrong with it.
const PEACEFUL: Duration = Duration::from_secs(10);

/// How a life ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    /// It hung, and was killed for it.
    Hung,
    /// It ended by itself: by an error, a panic, a crash.
    Failed,
    /// Another process ended it.
    Killed {
        /// The length of its life.
        after: Duration,
    },
}

/// The attempts of one process.
#[derive(Debug, Clone, Default)]
pub(crate) struct Restarts {
    in_a_row: u32,
    progress: Option<u32>,
    total: u64,
    pause: Duration,
}

impl Restarts {
    /// The process has died, having come so far (over all its lives). How long to wait before it is started again;
    /// `None` where that is given up.
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

    /// A life of ten seconds counted as good, and a process that hangs is killed after thirty. One that hung in the
    /// same drawing each time was started again for ever.
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

    /// A sketcher sends its sketch once and then waits; somebody who kills it every minute must not end the mission. One
    /// that crashes every minute before it has sent anything must.
    #[test]
    fn who_waits_in_peace_and_is_killed_is_started_again_for_ever() {
        let end = End::Killed { after: Duration::from_secs(60) };
        let mut restarts = Restarts::default();
        assert!((0..100).all(|_| restarts.pause_after_death(end, 3) == Some(Duration::ZERO)));
        let mut restarts = Restarts::default();
        assert_eq!(PAUSES.map(|_| millis(restarts.pause_after_death(End::Failed, 3))), PAUSES);
    }
}

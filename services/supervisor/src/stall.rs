//! Notices a lockstep in which every process waits for another one: nothing more will ever happen.
//!
//! It takes a defect for that, a message that its reader rejects, for example. Without a word the mission would wait for ever.
//! Time in which the supervisor itself did not run does not count.

use std::time::{Duration, Instant};

/// Between two looks no more than this counts.
const MOST_AT_ONCE: Duration = Duration::from_millis(100);

/// For how long no process has made progress.
#[derive(Debug, Clone)]
pub(crate) struct Stall {
    limit: Duration,
    looked: Instant,
    progress: u64,
    stands: Duration,
}

impl Stall {
    /// Begins to watch. A lockstep stands still for good after `limit`.
    pub(crate) fn begin(limit: Duration, now: Instant) -> Self {
        Self { limit, looked: now, progress: 0, stands: Duration::ZERO }
    }

    /// Looks at how much all processes have done; `everybody_waits`: whether they run, and none computes or is about
    /// to be started. Returns how long the lockstep has stood still, where that is too long.
    pub(crate) fn look(&mut self, now: Instant, progress: u64, everybody_waits: bool) -> Option<Duration> {
        let since = now.saturating_duration_since(std::mem::replace(&mut self.looked, now));
        let goes_on = std::mem::replace(&mut self.progress, progress) != progress;
        self.stands =
            if goes_on || !everybody_waits { Duration::ZERO } else { self.stands + since.min(MOST_AT_ONCE) };
        (self.stands >= self.limit).then_some(self.stands)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: Duration = Duration::from_secs(30);
    const LOOK: Duration = Duration::from_millis(50);

    /// The first look, counted in steps of 50 ms, at which it stands still, of so many.
    fn stands_after(looks: u32, progress: impl Fn(u32) -> u64, waits: impl Fn(u32) -> bool) -> Option<u32> {
        let now = Instant::now();
        let mut stall = Stall::begin(LIMIT, now);
        (1..looks).find(|&look| stall.look(now + look * LOOK, progress(look), waits(look)).is_some())
    }

    #[test]
    fn who_waits_for_ever_is_noticed() {
        assert_eq!(stands_after(2000, |_| 7, |_| true), Some(601));
        assert_eq!(stands_after(2000, |look| u64::from(look.min(100)), |_| true), Some(700));
    }

    #[test]
    fn who_gets_on_or_computes_is_not() {
        assert_eq!(stands_after(2000, |look| u64::from(look / 500), |_| true), None);
        assert_eq!(stands_after(2000, |_| 7, |look| look % 500 != 0), None);
    }

    #[test]
    fn a_supervisor_that_slept_notices_nothing() {
        let now = Instant::now();
        let mut stall = Stall::begin(LIMIT, now);
        stall.look(now, 7, true);
        assert_eq!(stall.look(now + Duration::from_secs(600), 7, true), None);
    }
}

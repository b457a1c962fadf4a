//! Detects a lockstep where every process waits for another, so that nothing will ever happen again.
//!
//! The cause is always a defect, such as a message that its reader rejects. Without this check, the mission would silently wait
//! forever. Time in which the supervisor itself did not run is not counted.

use std::time::{Duration, Instant};

/// Maximum time between two checks that is counted. If more has passed, the supervisor itself did not run.
const MOST_AT_ONCE: Duration = Duration::from_millis(100);

/// Measures for how long none of the processes has made progress.
#[derive(Debug, Clone)]
pub(crate) struct Stall {
    limit: Duration,
    looked: Instant,
    progress: u64,
    stands: Duration,
}

impl Stall {
    /// Starts watching. A lockstep counts as stuck after `limit`.
    pub(crate) fn begin(limit: Duration, now: Instant) -> Self {
        Self { limit, looked: now, progress: 0, stands: Duration::ZERO }
    }

    /// Checks the sum of the progress of all processes. `everybody_waits` is true if all of them are running, and none is computing
    /// or about to be restarted. If the lockstep has been stuck for longer than the limit, returns for how long.
    pub(crate) fn look(&mut self, now: Instant, progress: u64, everybody_waits: bool) -> Option<Duration> {
        let since = now.saturating_duration_since(std::mem::replace(&mut self.looked, now));
        let has_progressed = std::mem::replace(&mut self.progress, progress) != progress;
        self.stands = if has_progressed || !everybody_waits {
            Duration::ZERO
        } else {
            self.stands + since.min(MOST_AT_ONCE)
        };
        (self.stands >= self.limit).then_some(self.stands)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: Duration = Duration::from_secs(30);
    const LOOK: Duration = Duration::from_millis(50);

    /// Returns the first of `looks` checks, 50 ms apart, that finds the lockstep stuck.
    fn stands_after(looks: u32, progress: impl Fn(u32) -> u64, waits: impl Fn(u32) -> bool) -> Option<u32> {
        let now = Instant::now();
        let mut stall = Stall::begin(LIMIT, now);
        (1..looks).find(|&look| stall.look(now + look * LOOK, progress(look), waits(look)).is_some())
    }

    #[test]
    fn a_stalled_process_is_detected() {
        assert_eq!(stands_after(2000, |_| 7, |_| true), Some(601));
        assert_eq!(stands_after(2000, |look| u64::from(look.min(100)), |_| true), Some(700));
    }

    #[test]
    fn a_progressing_or_busy_process_is_not_stalled() {
        assert_eq!(stands_after(2000, |look| u64::from(look / 500), |_| true), None);
        assert_eq!(stands_after(2000, |_| 7, |look| look % 500 != 0), None);
    }

    #[test]
    fn a_suspended_supervisor_detects_no_stall() {
        let now = Instant::now();
        let mut stall = Stall::begin(LIMIT, now);
        stall.look(now, 7, true);
        assert_eq!(stall.look(now + Duration::from_secs(600), 7, true), None);
    }
}

//! Watches whether a process shows signs of life.
//!
//! Every process gives a heartbeat at least every quarter of a second. A process that does not is either
//! stopped (SIGSTOP), hanging, or busy with something that takes long. The kernel reports whether it is
//! stopped or computing. Time in which the supervisor itself did not run does not count, since the processes
//! may not have run either. While a plan starves the process, only its share of the time counts, and a stop
//! counts as part of the starvation. Afterwards, the count starts again from zero.

use std::time::{Duration, Instant};

use sketchnav_runtime::ProcessState;
use sketchnav_schemas::fault_plan::Starvation;

/// Time without a heartbeat after which a stopped process is reported.
const DEADLINE: Duration = Duration::from_secs(1);
/// Time without a heartbeat after which a process that seems to compute is reported. It is longer because drawings are read in
/// one step.
const BUSY_DEADLINE: Duration = Duration::from_secs(5);
/// Time without a heartbeat after which a process that seems to compute is killed. The drawing may be large, or the machine
/// loaded.
const BUSY_LIMIT: Duration = Duration::from_secs(30);
/// Maximum time between two checks that is counted. If more has passed, the supervisor itself did not run.
const MOST_AT_ONCE: Duration = Duration::from_millis(100);

/// Measures how long a process has been unresponsive.
#[derive(Debug, Clone)]
pub(crate) struct Watchdog {
    signs: u32,
    looked: Instant,
    unresponsive: Duration,
    is_told: bool,
    /// Time for which the process may be stopped before it is killed.
    stopped_limit: Duration,
    /// Share of the time that the process may run, and until when, or `None` if it is not starved.
    starved: Option<(f64, Instant)>,
    /// Whether the process must be killed. Until it has ended, there is nothing more to report.
    is_condemned: bool,
    /// Whether it must be killed because it hangs, rather than because it was stopped from outside.
    hangs: bool,
}

/// The action to take after a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Alarm {
    /// Do nothing.
    Nothing,
    /// Report that the process has missed its deadline. Returned once.
    Missed(Duration),
    /// Kill the process, since it has been unresponsive for too long. Returned once.
    Kill(Duration),
    /// Report that the process shows signs of life again.
    Over(Duration),
}

impl Watchdog {
    /// Starts watching a process that has just been started.
    pub(crate) fn begin(signs: u32, now: Instant, stopped_limit: Duration) -> Self {
        let unresponsive = Duration::ZERO;
        let (is_told, is_condemned, hangs) = (false, false, false);
        let starved = None;
        Self { signs, looked: now, unresponsive, is_told, stopped_limit, starved, is_condemned, hangs }
    }

    /// Tolerates slowness of a process that a plan starves from now on.
    pub(crate) fn bear(&mut self, Starvation { share, duration_ms }: Starvation, now: Instant) {
        self.starved = Some((share, now + Duration::from_millis(duration_ms)));
    }

    /// Returns true if a plan starves the process at that time.
    pub(crate) fn is_starved(&self, now: Instant) -> bool {
        self.starved.is_some_and(|(_, until)| now < until)
    }

    /// Returns true if the process must be killed because it hangs. A process that was stopped from outside does not hang.
    pub(crate) fn hangs(&self) -> bool {
        self.hangs
    }

    /// Returns true if nothing was wrong at the last check.
    pub(crate) fn is_quiet(&self) -> bool {
        self.unresponsive < DEADLINE
    }

    /// Checks the process. `state` is only called if there have been no signs of life since the last check.
    pub(crate) fn look(&mut self, signs: u32, now: Instant, state: impl FnOnce() -> ProcessState) -> Alarm {
        if self.is_condemned {
            return Alarm::Nothing;
        }
        let since = now.saturating_duration_since(std::mem::replace(&mut self.looked, now));
        if signs != self.signs {
            self.signs = signs;
            let unresponsive = std::mem::take(&mut self.unresponsive);
            return if std::mem::take(&mut self.is_told) {
                Alarm::Over(unresponsive)
            } else {
                Alarm::Nothing
            };
        }
        if self.starved.take_if(|(_, until)| *until <= now).is_some() {
            self.unresponsive = Duration::ZERO;
        }
        let share = self.starved.map_or(1.0, |(share, _)| share);
        self.unresponsive += since.min(MOST_AT_ONCE).mul_f64(share);
        if self.unresponsive < DEADLINE {
            return Alarm::Nothing;
        }
        let state = match state() {
            ProcessState::Stopped if self.is_starved(now) => ProcessState::Running,
            state => state,
        };
        let (deadline, limit) = match state {
            ProcessState::Stopped => (DEADLINE, self.stopped_limit),
            // A debugger is attached.
            ProcessState::Traced => (DEADLINE, Duration::MAX),
            _ => (BUSY_DEADLINE, BUSY_LIMIT),
        };
        if self.unresponsive >= deadline && !std::mem::replace(&mut self.is_told, true) {
            return Alarm::Missed(self.unresponsive);
        }
        self.is_condemned = self.unresponsive >= limit;
        self.hangs = self.is_condemned && state != ProcessState::Stopped;
        if self.is_condemned { Alarm::Kill(self.unresponsive) } else { Alarm::Nothing }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOOK: Duration = Duration::from_millis(4);
    const LIMIT: Duration = Duration::from_secs(3);

    /// Checks every four milliseconds until there is an alarm, and returns it. `now` is then its time.
    fn next(watchdog: &mut Watchdog, now: &mut Instant, state: ProcessState) -> Alarm {
        loop {
            *now += LOOK;
            match watchdog.look(7, *now, || state) {
                Alarm::Nothing => {}
                verdict => return verdict,
            }
        }
    }

    #[test]
    fn a_stopped_process_is_killed_long_before_a_busy_one() {
        let stopped = (ProcessState::Stopped, DEADLINE, LIMIT);
        for (state, deadline, limit) in [stopped, (ProcessState::Running, BUSY_DEADLINE, BUSY_LIMIT)] {
            let mut now = Instant::now();
            let mut watchdog = Watchdog::begin(7, now, LIMIT);
            assert_eq!(next(&mut watchdog, &mut now, state), Alarm::Missed(deadline));
            assert_eq!(next(&mut watchdog, &mut now, state), Alarm::Kill(limit));
        }
    }

    /// Regression test: a process used to be killed, and reported, at every check until the kernel had removed it.
    #[test]
    fn a_process_to_be_killed_is_reported_once() {
        let mut now = Instant::now();
        let mut watchdog = Watchdog::begin(7, now, LIMIT);
        assert!(matches!(next(&mut watchdog, &mut now, ProcessState::Stopped), Alarm::Missed(_)));
        assert!(matches!(next(&mut watchdog, &mut now, ProcessState::Stopped), Alarm::Kill(_)));
        let looks = (0..1000).map(|look| watchdog.look(7, now + look * LOOK, || ProcessState::Stopped));
        assert!(looks.into_iter().all(|verdict| verdict == Alarm::Nothing));
    }

    #[test]
    fn only_a_process_killed_while_computing_counts_as_hanging() {
        for (state, hangs) in [(ProcessState::Running, true), (ProcessState::Stopped, false)] {
            let mut now = Instant::now();
            let mut watchdog = Watchdog::begin(7, now, LIMIT);
            assert!(matches!(next(&mut watchdog, &mut now, state), Alarm::Missed(_)));
            assert!(!watchdog.hangs(), "it may only be slow");
            assert!(matches!(next(&mut watchdog, &mut now, state), Alarm::Kill(_)));
            assert_eq!(watchdog.hangs(), hangs, "{state:?}");
        }
    }

    #[test]
    fn a_sign_of_life_resets_the_watchdog() {
        let mut now = Instant::now();
        let mut watchdog = Watchdog::begin(7, now, LIMIT);
        assert_eq!(next(&mut watchdog, &mut now, ProcessState::Stopped), Alarm::Missed(DEADLINE));
        assert_eq!(watchdog.look(8, now + LOOK, || ProcessState::Stopped), Alarm::Over(DEADLINE));
        assert_eq!(watchdog.look(9, now + 2 * LOOK, || ProcessState::Stopped), Alarm::Nothing);
        assert_eq!(watchdog.unresponsive, Duration::ZERO);
    }

    /// A tenth of the processor for fifty seconds amounts to five seconds, which is long for a stopped process, but not for a
    /// busy one.
    #[test]
    fn a_starved_process_is_excused_until_the_starvation_ends() {
        let mut now = Instant::now();
        let mut watchdog = Watchdog::begin(7, now, LIMIT);
        watchdog.bear(Starvation { share: 0.1, duration_ms: 40_000 }, now);
        let end = now + Duration::from_secs(40);
        while now + LOOK < end {
            now += LOOK;
            assert_eq!(watchdog.look(7, now, || ProcessState::Stopped), Alarm::Nothing);
        }
        assert!(!watchdog.is_starved(end));
        assert_eq!(next(&mut watchdog, &mut now, ProcessState::Stopped), Alarm::Missed(DEADLINE));
        assert_eq!(next(&mut watchdog, &mut now, ProcessState::Stopped), Alarm::Kill(LIMIT));
    }

    /// The machine may have been asleep, or the supervisor itself stopped.
    #[test]
    fn time_during_which_the_watchdog_was_suspended_does_not_count() {
        let now = Instant::now();
        let mut watchdog = Watchdog::begin(7, now, LIMIT);
        assert_eq!(
            watchdog.look(7, now + Duration::from_secs(600), || ProcessState::Stopped),
            Alarm::Nothing
        );
    }

    #[test]
    fn a_process_under_a_debugger_is_left_alone() {
        let mut now = Instant::now();
        let mut watchdog = Watchdog::begin(7, now, LIMIT);
        assert_eq!(next(&mut watchdog, &mut now, ProcessState::Traced), Alarm::Missed(DEADLINE));
        let looks = (0..20_000).map(|_| {
            now += LOOK;
            watchdog.look(7, now, || ProcessState::Traced)
        });
        assert!(looks.into_iter().all(|verdict| verdict == Alarm::Nothing));
    }
}

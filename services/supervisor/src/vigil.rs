//! Watches whether a process shows signs of life.
//!
//! Every process looks up from its work at least every quarter of a second. One that does not is stopped
//! (SIGSTOP), hangs, or takes long over something; the kernel says which of the first two it is not. Time in
//! which the supervisor itself did not run does not count: then nothing ran, perhaps.

use std::time::{Duration, Instant};

use sketchnav_runtime::ProcessState;

/// Who is stopped and shows no sign of life for so long has missed its deadline, which is told.
const DEADLINE: Duration = Duration::from_secs(1);
/// One that seems to compute has more time before it is told of: drawings are read in one step.
const BUSY_DEADLINE: Duration = Duration::from_secs(5);
/// One that seems to compute may only be slow: a large drawing, a loaded machine.
const BUSY_LIMIT: Duration = Duration::from_secs(30);
/// Between two looks of the supervisor no more than this counts.
const MOST_AT_ONCE: Duration = Duration::from_millis(100);

/// How long a process has been silent.
#[derive(Debug, Clone)]
pub(crate) struct Vigil {
    signs: u32,
    looked: Instant,
    silent: Duration,
    is_told: bool,
    /// One that is stopped is killed after so long.
    stopped_limit: Duration,
    /// It was to be killed: until it is gone there is nothing more to say.
    is_condemned: bool,
}

/// What is to be done about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// Nothing.
    Nothing,
    /// It has missed its deadline: say so, once.
    Missed(Duration),
    /// It has missed it for too long: end it. Said once.
    Kill(Duration),
    /// It shows signs of life again.
    Heard(Duration),
}

impl Vigil {
    /// Begins with a process that was just started.
    pub(crate) fn begin(signs: u32, now: Instant, stopped_limit: Duration) -> Self {
        let silent = Duration::ZERO;
        Self { signs, looked: now, silent, is_told: false, stopped_limit, is_condemned: false }
    }

    /// Looks at it. `state` is asked for where it matters.
    pub(crate) fn look(&mut self, signs: u32, now: Instant, state: impl FnOnce() -> ProcessState) -> Verdict {
        if self.is_condemned {
            return Verdict::Nothing;
        }
        let since = now.saturating_duration_since(std::mem::replace(&mut self.looked, now));
        if signs != self.signs {
            self.signs = signs;
            let silent = std::mem::take(&mut self.silent);
            return if std::mem::take(&mut self.is_told) { Verdict::Heard(silent) } else { Verdict::Nothing };
        }
        self.silent += since.min(MOST_AT_ONCE);
        if self.silent < DEADLINE {
            return Verdict::Nothing;
        }
        let (deadline, limit) = match state() {
            ProcessState::Stopped => (DEADLINE, self.stopped_limit),
            // Somebody looks at it.
            ProcessState::Traced => (DEADLINE, Duration::MAX),
            _ => (BUSY_DEADLINE, BUSY_LIMIT),
        };
        if self.silent >= deadline && !std::mem::replace(&mut self.is_told, true) {
            return Verdict::Missed(self.silent);
        }
        self.is_condemned = self.silent >= limit;
        if self.is_condemned { Verdict::Kill(self.silent) } else { Verdict::Nothing }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOOK: Duration = Duration::from_millis(4);
    const LIMIT: Duration = Duration::from_secs(3);

    /// Looks every four milliseconds until there is something to say; when that was.
    fn next(vigil: &mut Vigil, now: &mut Instant, state: ProcessState) -> Verdict {
        loop {
            *now += LOOK;
            match vigil.look(7, *now, || state) {
                Verdict::Nothing => {}
                verdict => return verdict,
            }
        }
    }

    #[test]
    fn the_silent_is_told_once_and_the_stopped_killed_long_before_the_busy() {
        let stopped = (ProcessState::Stopped, DEADLINE, LIMIT);
        for (state, deadline, limit) in [stopped, (ProcessState::Running, BUSY_DEADLINE, BUSY_LIMIT)] {
            let mut now = Instant::now();
            let mut vigil = Vigil::begin(7, now, LIMIT);
            assert_eq!(next(&mut vigil, &mut now, state), Verdict::Missed(deadline));
            assert_eq!(next(&mut vigil, &mut now, state), Verdict::Kill(limit));
        }
    }

    /// Until the kernel had taken it away, a process was once killed, and told of, at every look.
    #[test]
    fn who_is_to_be_killed_is_told_of_once() {
        let mut now = Instant::now();
        let mut vigil = Vigil::begin(7, now, LIMIT);
        assert!(matches!(next(&mut vigil, &mut now, ProcessState::Stopped), Verdict::Missed(_)));
        assert!(matches!(next(&mut vigil, &mut now, ProcessState::Stopped), Verdict::Kill(_)));
        let looks = (0..1000).map(|look| vigil.look(7, now + look * LOOK, || ProcessState::Stopped));
        assert!(looks.into_iter().all(|verdict| verdict == Verdict::Nothing));
    }

    #[test]
    fn a_sign_of_life_begins_it_anew() {
        let mut now = Instant::now();
        let mut vigil = Vigil::begin(7, now, LIMIT);
        assert_eq!(next(&mut vigil, &mut now, ProcessState::Stopped), Verdict::Missed(DEADLINE));
        assert_eq!(vigil.look(8, now + LOOK, || ProcessState::Stopped), Verdict::Heard(DEADLINE));
        assert_eq!(vigil.look(9, now + 2 * LOOK, || ProcessState::Stopped), Verdict::Nothing);
        assert_eq!(vigil.silent, Duration::ZERO);
    }

    /// The machine was asleep, or the supervisor itself was stopped.
    #[test]
    fn a_time_in_which_nobody_looked_does_not_count() {
        let now = Instant::now();
        let mut vigil = Vigil::begin(7, now, LIMIT);
        assert_eq!(vigil.look(7, now + Duration::from_secs(600), || ProcessState::Stopped), Verdict::Nothing);
    }

    #[test]
    fn who_is_looked_at_with_a_debugger_is_left_alone() {
        let mut now = Instant::now();
        let mut vigil = Vigil::begin(7, now, LIMIT);
        assert_eq!(next(&mut vigil, &mut now, ProcessState::Traced), Verdict::Missed(DEADLINE));
        let looks = (0..20_000).map(|_| {
            now += LOOK;
            vigil.look(7, now, || ProcessState::Traced)
        });
        assert!(looks.into_iter().all(|verdict| verdict == Verdict::Nothing));
    }
}

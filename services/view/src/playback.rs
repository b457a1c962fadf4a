//! The position in a recording that is being played: a clock that viewers can pause, seek and speed up. It is pure, since
//! time is passed as an argument.

use std::time::{Duration, Instant};

/// The range of rates, in recorded seconds per second.
pub const RATES: std::ops::RangeInclusive<f64> = 1.0 / 64.0..=64.0;

/// A viewer's request.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Request {
    /// True to play, false to pause.
    pub plays: bool,
    /// Recorded seconds per second. If this is not a positive number, the rate is left unchanged.
    pub rate: f64,
    /// Recorded time to seek to first, in nanoseconds.
    pub seek_ns: Option<u64>,
}

/// The state of playback.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// The recording is playing.
    Playing,
    /// The recording is paused.
    Paused,
    /// The recording has been played to its end.
    Ended,
}

/// The clock of a recording that is being played.
#[derive(Debug, Clone)]
pub struct Playback {
    first_ns: u64,
    last_ns: u64,
    rate: f64,
    state: State,
    /// A recorded time in nanoseconds, and the wall-clock time when it was reached.
    anchor: (u64, Instant),
    /// True if a viewer is connected. Otherwise playback is paused.
    is_watched: bool,
}

impl Playback {
    /// Creates a clock stopped at `first_ns`. The two times are those of the recording's first and last message, in
    /// nanoseconds.
    pub fn new((first_ns, last_ns): (u64, u64), rate: f64, state: State, now: Instant) -> Self {
        Self { first_ns, last_ns, rate, state, anchor: (first_ns, now), is_watched: false }
    }

    /// Returns the state of playback.
    pub fn state(&self) -> State {
        self.state
    }

    /// Returns the rate, in recorded seconds per second.
    pub fn rate(&self) -> f64 {
        self.rate
    }

    /// Returns the current recorded time, in nanoseconds.
    pub fn at_ns(&self, now: Instant) -> u64 {
        let (from_ns, since) = self.anchor;
        if !self.moves() {
            return from_ns;
        }
        let passed_ns = now.saturating_duration_since(since).as_nanos() as f64 * self.rate;
        from_ns.saturating_add(passed_ns as u64).min(self.last_ns)
    }

    /// Returns the time until the message of this recorded time is due, or `None` while playback is paused.
    pub fn until(&self, stamp_ns: u64, now: Instant) -> Option<Duration> {
        let left_ns = stamp_ns.saturating_sub(self.at_ns(now));
        match (left_ns, self.moves()) {
            (0, true) => Some(Duration::ZERO),
            (_, true) => Some(Duration::from_nanos((left_ns as f64 / self.rate) as u64)),
            (_, false) => None,
        }
    }

    /// Handles a viewer's request. Returns the new playback position, if it changes. Playing from the end starts again at the
    /// beginning.
    pub fn ask(&mut self, request: Request, now: Instant) -> Option<u64> {
        self.settle(now);
        if request.rate.is_finite() && request.rate > 0.0 {
            self.rate = request.rate.clamp(*RATES.start(), *RATES.end());
        }
        let restarts = request.plays && self.state == State::Ended;
        let target = request.seek_ns.or(restarts.then_some(self.first_ns));
        let target = target.map(|ns| ns.clamp(self.first_ns, self.last_ns));
        self.state = if request.plays { State::Playing } else { State::Paused };
        if let Some(target) = target {
            self.anchor = (target, now);
        }
        target
    }

    /// Sets whether a viewer watches.
    pub fn watch(&mut self, is_watched: bool, now: Instant) {
        if self.is_watched != is_watched {
            self.settle(now);
            self.is_watched = is_watched;
        }
    }

    /// Records that the last message has been played.
    pub fn end(&mut self, now: Instant) {
        self.state = State::Ended;
        self.anchor = (self.last_ns, now);
    }

    fn moves(&self) -> bool {
        self.state == State::Playing && self.is_watched
    }

    fn settle(&mut self, now: Instant) {
        self.anchor = (self.at_ns(now), now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: u64 = 1_000_000_000;

    fn playing(began: Instant) -> Playback {
        let mut playback = Playback::new((10 * S, 20 * S), 2.0, State::Playing, began);
        playback.watch(true, began);
        playback
    }

    fn after(began: Instant, seconds: f64) -> Instant {
        began + Duration::from_secs_f64(seconds)
    }

    #[test]
    fn time_advances_by_the_rate_and_stops_at_the_end() {
        let began = Instant::now();
        let playback = playing(began);
        assert_eq!(playback.at_ns(after(began, 1.5)), 13 * S);
        assert_eq!(playback.until(14 * S, after(began, 1.0)), Some(Duration::from_secs(1)));
        assert_eq!(playback.until(11 * S, after(began, 1.0)), Some(Duration::ZERO));
        assert_eq!(playback.at_ns(after(began, 100.0)), 20 * S);
    }

    #[test]
    fn pausing_and_changing_the_rate_do_not_jump() {
        let began = Instant::now();
        let mut playback = playing(began);
        let pause = Request { plays: false, rate: 2.0, seek_ns: None };
        assert_eq!(playback.ask(pause, after(began, 1.0)), None);
        assert_eq!((playback.state(), playback.at_ns(after(began, 9.0))), (State::Paused, 12 * S));
        assert_eq!(playback.until(13 * S, after(began, 9.0)), None);
        let slower = Request { plays: true, rate: 0.5, seek_ns: None };
        assert_eq!(playback.ask(slower, after(began, 9.0)), None);
        assert_eq!(playback.at_ns(after(began, 11.0)), 13 * S);
    }

    #[test]
    fn a_seek_stays_within_the_recording() {
        let began = Instant::now();
        let mut playback = playing(began);
        for (asked, found) in [(15 * S, 15 * S), (0, 10 * S), (u64::MAX, 20 * S)] {
            let seek = Request { plays: false, rate: 1.0, seek_ns: Some(asked) };
            assert_eq!(playback.ask(seek, began), Some(found));
            assert_eq!(playback.at_ns(after(began, 5.0)), found);
        }
    }

    #[test]
    fn playing_from_the_end_restarts() {
        let began = Instant::now();
        let mut playback = playing(began);
        playback.end(after(began, 5.0));
        assert_eq!((playback.state(), playback.at_ns(after(began, 6.0))), (State::Ended, 20 * S));
        let play = Request { plays: true, rate: 1.0, seek_ns: None };
        assert_eq!(playback.ask(play, after(began, 6.0)), Some(10 * S));
        assert_eq!(playback.state(), State::Playing);
    }

    /// Regression test: a recording that was opened before its viewer had already ended when the viewer connected.
    #[test]
    fn without_a_client_nothing_is_played() {
        let began = Instant::now();
        let mut playback = Playback::new((0, 20 * S), 1.0, State::Playing, began);
        assert_eq!((playback.at_ns(after(began, 9.0)), playback.until(S, after(began, 9.0))), (0, None));
        playback.watch(true, after(began, 9.0));
        assert_eq!(playback.at_ns(after(began, 10.0)), S);
        playback.watch(false, after(began, 10.0));
        assert_eq!(playback.at_ns(after(began, 20.0)), S);
    }

    #[test]
    fn an_invalid_rate_is_ignored() {
        let began = Instant::now();
        let mut playback = playing(began);
        for (asked, found) in [(f64::NAN, 2.0), (-1.0, 2.0), (0.0, 2.0), (1e9, 64.0), (1e-9, 1.0 / 64.0)] {
            playback.rate = 2.0;
            playback.ask(Request { plays: true, rate: asked, seek_ns: None }, began);
            assert_eq!(playback.rate(), found, "{asked}");
        }
    }
}

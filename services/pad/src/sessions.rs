//! Which pages are connected, which of them has the wheel, and whether the driver responds.
//!
//! A session is a page across all of its connections, so a page that reconnects keeps its session. Times are
//! measured since the pad's start, by the caller's clock.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::protocol::{DEFAULT_LINK_LIMIT_S, LINK_LIMIT_S, Refusal};

/// Maximum number of pages that are open at the same time, not counting that of the driver.
const MAX_CONNECTED: usize = 16;
/// Maximum number of connections of one page, since lost ones are noticed late.
const MAX_CONNECTIONS: u32 = 8;
/// Maximum number of pages that are remembered after they have disconnected.
const MAX_REMEMBERED: usize = 32;

#[derive(Debug)]
struct Session {
    connections: u32,
    heard: Duration,
}

/// The sessions of a pad.
#[derive(Debug)]
pub struct Sessions {
    known: BTreeMap<String, Session>,
    driver: Option<String>,
    limit: Duration,
    /// Whether the driver's current silence has been reported.
    is_told: bool,
}

impl Default for Sessions {
    fn default() -> Self {
        let limit = Duration::from_secs_f64(DEFAULT_LINK_LIMIT_S);
        Self { known: BTreeMap::new(), driver: None, limit, is_told: false }
    }
}

impl Sessions {
    /// Resumes from a previous pad. Its driver must respond again within the limit.
    pub fn resume(&mut self, driver: Option<String>, link_limit_s: f64, now: Duration) {
        if let Some(id) = &driver {
            self.known.insert(id.clone(), Session { connections: 0, heard: now });
        }
        self.driver = driver;
        // A limit that was set before is within its range.
        let _ = self.set_limit(link_limit_s);
    }

    /// Checks whether a page that names this session would be admitted.
    ///
    /// # Errors
    /// [`Refusal::Absent`] if there are already too many pages, or too many connections of this one.
    pub fn check_seat(&self, named: Option<&str>) -> Result<(), Refusal> {
        let known = named.and_then(|id| self.known.get(id));
        let own = known.map_or(0, |session| session.connections);
        if own >= MAX_CONNECTIONS {
            let words = format!("expected at most {MAX_CONNECTIONS} links of a page, found one more");
            return Err(Refusal::Absent(words));
        }
        let others = self.known.iter().filter(|(id, session)| session.connections > 0 && !self.drives(id));
        let has_seat = own > 0 || named.is_some_and(|id| self.drives(id)) || self.driver.is_none();
        if !has_seat && others.count() >= MAX_CONNECTED {
            let words =
                format!("expected at most {MAX_CONNECTED} open pages besides the driver's, found one more");
            return Err(Refusal::Absent(words));
        }
        Ok(())
    }

    /// Adds a connection of a page. Returns the session that it names if that is known, and `fresh`
    /// otherwise. The first page gets the wheel.
    ///
    /// # Errors
    /// As [`Sessions::check_seat`].
    pub fn join(&mut self, named: Option<&str>, fresh: String, now: Duration) -> Result<String, Refusal> {
        self.check_seat(named)?;
        let known = named.filter(|&id| self.known.contains_key(id)).map(str::to_owned);
        let id = known.unwrap_or(fresh);
        let session = self.known.entry(id.clone()).or_insert(Session { connections: 0, heard: now });
        session.connections += 1;
        self.hear(&id, now);
        if self.driver.is_none() {
            self.give_wheel(&id);
        }
        self.forget_some();
        Ok(id)
    }

    /// Records that a connection of the session has ended.
    pub fn leave(&mut self, id: &str) {
        if let Some(session) = self.known.get_mut(id) {
            session.connections = session.connections.saturating_sub(1);
        }
    }

    /// Records that something has arrived from the session.
    pub fn hear(&mut self, id: &str, now: Duration) {
        if let Some(session) = self.known.get_mut(id) {
            session.heard = now;
            self.is_told &= self.driver.as_deref() != Some(id);
        }
    }

    /// Returns true if the session is known.
    pub fn knows(&self, id: &str) -> bool {
        self.known.contains_key(id)
    }

    /// Returns true if the session has the wheel.
    pub fn drives(&self, id: &str) -> bool {
        self.driver.as_deref() == Some(id)
    }

    /// The session that has the wheel.
    pub fn driver(&self) -> Option<&str> {
        self.driver.as_deref()
    }

    /// Returns the time since the driver was last heard.
    pub fn silence(&self, now: Duration) -> Option<Duration> {
        let driver = self.known.get(self.driver.as_ref()?)?;
        Some(now.saturating_sub(driver.heard))
    }

    /// Returns true if the driver has been silent for longer than the limit.
    pub fn is_unattended(&self, now: Duration) -> bool {
        self.silence(now).is_some_and(|silence| silence > self.limit)
    }

    /// Like [`Sessions::is_unattended`], but returns true only once per silence.
    pub fn has_fallen_silent(&mut self, now: Duration) -> bool {
        let has = self.is_unattended(now) && !self.is_told;
        self.is_told |= has;
        has
    }

    /// Gives the session the wheel.
    ///
    /// # Errors
    /// [`Refusal::Forbidden`] if another page has it and responds.
    pub fn take_wheel(&mut self, id: &str, now: Duration) -> Result<(), Refusal> {
        if self.driver.is_some() && !self.drives(id) && !self.is_unattended(now) {
            return Err(Refusal::Forbidden("another page drives and is still connected".into()));
        }
        self.give_wheel(id);
        Ok(())
    }

    /// Returns the maximum time that the driver may be silent, in seconds.
    pub fn limit_s(&self) -> f64 {
        self.limit.as_secs_f64()
    }

    /// Sets how long the driver may be silent, in seconds.
    ///
    /// # Errors
    /// [`Refusal::Malformed`] if the time is not within [`LINK_LIMIT_S`].
    pub fn set_limit(&mut self, limit_s: f64) -> Result<(), Refusal> {
        let [least, most] = LINK_LIMIT_S;
        if !(least..=most).contains(&limit_s) {
            let words = format!("link_limit_s: expected {least} to {most} seconds, found {limit_s}");
            return Err(Refusal::Malformed(words));
        }
        self.limit = Duration::from_secs_f64(limit_s);
        Ok(())
    }

    fn give_wheel(&mut self, id: &str) {
        self.driver = Some(id.to_owned());
        self.is_told = false;
    }

    /// Forgets pages that have disconnected, starting with the one that has been silent for longest, but never the driver's.
    fn forget_some(&mut self) {
        while self.known.len() > MAX_REMEMBERED {
            let gone = self.known.iter().filter(|(id, s)| s.connections == 0 && !self.drives(id));
            let Some(id) = gone.min_by_key(|(_, s)| s.heard).map(|(id, _)| id.clone()) else { return };
            self.known.remove(&id);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn s(seconds: u64) -> Duration {
        Duration::from_secs(seconds)
    }

    #[test]
    fn the_first_page_drives_and_keeps_the_wheel_when_it_comes_back() {
        let mut sessions = Sessions::default();
        let first = sessions.join(None, "a".into(), s(0)).unwrap();
        let second = sessions.join(Some("made up"), "b".into(), s(0)).unwrap();
        assert_eq!((first.as_str(), second.as_str()), ("a", "b"));
        assert!(sessions.drives("a") && !sessions.drives("b"));
        sessions.leave("a");
        assert_eq!(sessions.join(Some("a"), "c".into(), s(1)).unwrap(), "a");
        assert!(sessions.drives("a") && !sessions.knows("c"));
    }

    #[test]
    fn the_wheel_is_free_when_the_driver_is_silent_for_longer_than_the_limit() {
        let mut sessions = Sessions::default();
        sessions.join(None, "a".into(), s(0)).unwrap();
        sessions.join(None, "b".into(), s(0)).unwrap();
        sessions.hear("a", s(2));
        assert_eq!(sessions.take_wheel("b", s(5)).unwrap_err().status(), 403);
        assert!(!sessions.has_fallen_silent(s(5)));
        assert!(sessions.has_fallen_silent(s(6)) && !sessions.has_fallen_silent(s(7)), "told once");
        sessions.take_wheel("b", s(7)).unwrap();
        assert!(sessions.drives("b"));
    }

    #[test]
    fn who_is_heard_again_can_fall_silent_again() {
        let mut sessions = Sessions::default();
        sessions.join(None, "a".into(), s(0)).unwrap();
        assert!(sessions.has_fallen_silent(s(9)));
        sessions.hear("a", s(10));
        assert!(!sessions.has_fallen_silent(s(11)) && sessions.has_fallen_silent(s(14)));
    }

    #[test]
    fn the_limit_is_within_bounds() {
        let mut sessions = Sessions::default();
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY, 61.0] {
            assert_eq!(sessions.set_limit(wrong).unwrap_err().status(), 400, "{wrong}");
        }
        sessions.set_limit(10.0).unwrap();
        sessions.join(None, "a".into(), s(0)).unwrap();
        assert!(!sessions.is_unattended(s(10)) && sessions.is_unattended(s(11)));
    }

    #[test]
    fn a_successor_waits_for_the_driver_of_its_predecessor() {
        let mut sessions = Sessions::default();
        sessions.resume(Some("a".into()), 5.0, s(0));
        sessions.join(None, "b".into(), s(1)).unwrap();
        assert!(!sessions.drives("b") && !sessions.is_unattended(s(5)) && sessions.is_unattended(s(6)));
        assert_eq!(sessions.join(Some("a"), "c".into(), s(6)).unwrap(), "a");
        assert!(sessions.drives("a"));
    }

    #[test]
    fn pages_are_bounded() {
        let mut sessions = Sessions::default();
        for i in 0..200 {
            sessions.join(None, format!("{i}"), s(i)).unwrap();
            sessions.leave(&format!("{i}"));
        }
        assert_eq!(sessions.known.len(), MAX_REMEMBERED);
        assert!(sessions.drives("0"));
        for i in 0..MAX_CONNECTED {
            sessions.join(None, format!("open {i}"), s(300)).unwrap();
        }
        assert_eq!(sessions.join(None, "more".into(), s(300)).unwrap_err().status(), 503);
        assert_eq!(sessions.join(Some("0"), "more".into(), s(300)).unwrap(), "0", "who drives comes back");
        assert_eq!(sessions.join(Some("open 3"), "more".into(), s(300)).unwrap(), "open 3");
        for _ in 1..MAX_CONNECTIONS {
            sessions.join(Some("0"), "more".into(), s(300)).unwrap();
        }
        assert_eq!(sessions.check_seat(Some("0")).unwrap_err().status(), 503);
    }
}

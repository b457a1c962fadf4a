//! Which pages are connected, which of them has the wheel, which ask for it, and whether the driver responds.
//!
//! A session is a page across all of its connections, so a page that reconnects keeps its session. Times are
//! measured since the pad's start, by the caller's clock.

use std::collections::BTreeMap;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::protocol::{DEFAULT_LINK_LIMIT_S, LINK_LIMIT_S, MAX_NAME, Refusal};

/// Maximum number of pages that are open at the same time, not counting that of the driver.
const MAX_CONNECTED: usize = 16;
/// Maximum number of connections of one page, since lost ones are noticed late.
const MAX_CONNECTIONS: u32 = 8;
/// Maximum number of pages that are remembered after they have disconnected.
const MAX_REMEMBERED: usize = 32;

#[derive(Debug)]
struct Session {
    /// Number of the page, from 1, by which other pages may know it.
    page: u32,
    connections: u32,
    heard: Duration,
}

/// A page's request for the wheel.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Plea {
    /// The page's session, which other pages must not learn.
    pub session: String,
    /// Number of the page.
    pub page: u32,
    /// Name that a person entered, or that of the page.
    pub name: String,
}

/// The sessions of a pad.
#[derive(Debug)]
pub struct Sessions {
    known: BTreeMap<String, Session>,
    driver: Option<String>,
    /// The pages that ask for the wheel, the first one first.
    pleas: Vec<Plea>,
    /// Number of pages so far.
    pages: u32,
    limit: Duration,
    /// Whether the driver's current silence has been reported.
    is_told: bool,
}

impl Default for Sessions {
    fn default() -> Self {
        let limit = Duration::from_secs_f64(DEFAULT_LINK_LIMIT_S);
        let (known, pleas) = (BTreeMap::new(), Vec::new());
        Self { known, driver: None, pleas, pages: 0, limit, is_told: false }
    }
}

impl Sessions {
    /// Resumes from a previous pad. Its driver must respond again within the limit.
    pub fn resume(&mut self, driver: Option<String>, pleas: Vec<Plea>, link_limit_s: f64, now: Duration) {
        self.pages = pleas.iter().map(|plea| plea.page).max().unwrap_or(0);
        for Plea { session, page, .. } in &pleas {
            self.known.insert(session.clone(), Session { page: *page, connections: 0, heard: now });
        }
        if let Some(id) = &driver {
            self.know(id, now);
        }
        (self.driver, self.pleas) = (driver, pleas);
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
        self.know(&id, now).connections += 1;
        self.hear(&id, now);
        if self.driver.is_none() {
            self.give_wheel(&id);
        }
        self.forget_some();
        Ok(id)
    }

    fn know(&mut self, id: &str, now: Duration) -> &mut Session {
        self.known.entry(id.to_owned()).or_insert_with(|| {
            self.pages += 1;
            Session { page: self.pages, connections: 0, heard: now }
        })
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

    /// Returns the number of the session's page, or 0 if it is not known.
    pub fn page(&self, id: &str) -> u32 {
        self.known.get(id).map_or(0, |session| session.page)
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

    /// Asks the driver for the wheel, under this name, or `guest 2` if it is empty. A page that asks again changes its name.
    ///
    /// # Errors
    /// [`Refusal::NotNow`] if the page drives already, or [`Refusal::Malformed`] if the name is too long or has control characters.
    pub fn ask_for_wheel(&mut self, id: &str, name: &str) -> Result<(), Refusal> {
        if self.drives(id) {
            return Err(Refusal::NotNow("this page drives already".into()));
        }
        let name = name.trim();
        if name.chars().count() > MAX_NAME || name.contains(char::is_control) {
            let expected = format!("at most {MAX_NAME} characters, and no control characters");
            return Err(Refusal::Malformed(format!("the name: expected {expected}")));
        }
        let Some(page) = self.known.get(id).map(|session| session.page) else {
            return Err(Refusal::Forbidden("expected a page that is connected".into()));
        };
        let name = if name.is_empty() { format!("guest {page}") } else { name.to_owned() };
        match self.pleas.iter_mut().find(|plea| plea.session == id) {
            Some(plea) => plea.name = name,
            None => self.pleas.push(Plea { session: id.to_owned(), page, name }),
        }
        Ok(())
    }

    /// Withdraws the page's request for the wheel, if it has made one.
    pub fn withdraw(&mut self, id: &str) {
        self.pleas.retain(|plea| plea.session != id);
    }

    /// Returns the requests for the wheel, the first one first.
    pub fn pleas(&self) -> &[Plea] {
        &self.pleas
    }

    /// Returns the requests of pages that are connected.
    pub fn open_pleas(&self) -> impl Iterator<Item = &Plea> {
        let is_open = |plea: &&Plea| self.known.get(&plea.session).is_some_and(|page| page.connections > 0);
        self.pleas.iter().filter(is_open)
    }

    /// Hands the driver's wheel over to the page with this number, which has asked for it, or declines its request if `give` is
    /// false.
    ///
    /// # Errors
    /// [`Refusal::Forbidden`] if the session does not drive, or [`Refusal::NotNow`] if the page does not ask, or cannot be heard.
    pub fn answer_plea(&mut self, id: &str, page: u32, give: bool, now: Duration) -> Result<(), Refusal> {
        if !self.drives(id) {
            return Err(Refusal::watches());
        }
        let plea = self.open_pleas().find(|plea| plea.page == page).cloned();
        let plea = plea.ok_or_else(|| Refusal::NotNow("that page no longer asks for the wheel".into()))?;
        let heard = self.known.get(&plea.session).map_or(Duration::ZERO, |session| session.heard);
        if give && now.saturating_sub(heard) > self.limit {
            return Err(Refusal::NotNow(format!("{} cannot be heard at the moment", plea.name)));
        }
        self.withdraw(&plea.session);
        if give {
            self.give_wheel(&plea.session);
        }
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
        self.withdraw(id);
    }

    /// Forgets pages that have disconnected, starting with the one that has been silent for longest, but never the driver's.
    fn forget_some(&mut self) {
        while self.known.len() > MAX_REMEMBERED {
            let gone = self.known.iter().filter(|(id, s)| s.connections == 0 && !self.drives(id));
            let Some(id) = gone.min_by_key(|(_, s)| s.heard).map(|(id, _)| id.clone()) else { return };
            self.withdraw(&id);
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
        sessions.resume(Some("a".into()), Vec::new(), 5.0, s(0));
        sessions.join(None, "b".into(), s(1)).unwrap();
        assert!(!sessions.drives("b") && !sessions.is_unattended(s(5)) && sessions.is_unattended(s(6)));
        assert_eq!(sessions.join(Some("a"), "c".into(), s(6)).unwrap(), "a");
        assert!(sessions.drives("a"));
    }

    /// Returns the pages that ask for the wheel.
    fn asking(sessions: &Sessions) -> Vec<(u32, &str)> {
        sessions.open_pleas().map(|plea| (plea.page, plea.name.as_str())).collect()
    }

    #[test]
    fn the_driver_hands_the_wheel_to_a_page_that_asks() {
        let mut sessions = Sessions::default();
        for id in ["a", "b", "c"] {
            sessions.join(None, id.into(), s(0)).unwrap();
        }
        sessions.ask_for_wheel("c", "  ").unwrap();
        sessions.ask_for_wheel("b", "B").unwrap();
        sessions.ask_for_wheel("b", "Berta").unwrap();
        assert_eq!(asking(&sessions), [(3, "guest 3"), (2, "Berta")]);
        assert_eq!(sessions.answer_plea("c", 3, true, s(1)).unwrap_err().status(), 403, "not by itself");
        sessions.answer_plea("a", 2, true, s(1)).unwrap();
        assert!(sessions.drives("b") && !sessions.is_unattended(s(2)));
        assert_eq!(asking(&sessions), [(3, "guest 3")], "who asked as well still does");
        sessions.answer_plea("b", 3, false, s(2)).unwrap();
        assert!(sessions.drives("b") && asking(&sessions).is_empty());
        assert_eq!(sessions.ask_for_wheel("b", "").unwrap_err().status(), 409);
        for name in ["x".repeat(25), "\u{1b}".into()] {
            assert_eq!(sessions.ask_for_wheel("a", &name).unwrap_err().status(), 400);
        }
    }

    /// A driver must not hand a moving robot to a page that has lost its link.
    #[test]
    fn the_wheel_is_not_handed_to_a_page_that_is_gone() {
        let mut sessions = Sessions::default();
        sessions.join(None, "a".into(), s(0)).unwrap();
        sessions.join(None, "b".into(), s(0)).unwrap();
        sessions.ask_for_wheel("b", "").unwrap();
        sessions.hear("a", s(9));
        assert_eq!(sessions.answer_plea("a", 2, true, s(9)).unwrap_err().status(), 409);
        sessions.leave("b");
        assert!(asking(&sessions).is_empty());
        assert_eq!(sessions.answer_plea("a", 2, true, s(9)).unwrap_err().status(), 409);
        sessions.join(Some("b"), "new".into(), s(10)).unwrap();
        assert_eq!(asking(&sessions), [(2, "guest 2")], "it still asks when it comes back");
        sessions.answer_plea("a", 2, true, s(10)).unwrap();
        assert!(sessions.drives("b"));
    }

    #[test]
    fn a_successor_knows_who_asks() {
        let mut sessions = Sessions::default();
        sessions.join(None, "a".into(), s(0)).unwrap();
        sessions.join(None, "b".into(), s(0)).unwrap();
        sessions.ask_for_wheel("b", "Berta").unwrap();
        let mut successor = Sessions::default();
        successor.resume(Some("a".into()), sessions.pleas().to_vec(), 5.0, s(0));
        assert!(asking(&successor).is_empty(), "until its page is back");
        assert_eq!(successor.join(Some("b"), "new".into(), s(1)).unwrap(), "b");
        assert_eq!(asking(&successor), [(2, "Berta")]);
        successor.answer_plea("a", 2, true, s(1)).unwrap();
        assert!(successor.drives("b"));
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

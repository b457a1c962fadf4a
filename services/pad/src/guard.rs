//! Who may ask, and how often: the page's own origin, the token, buckets for each session.
//!
//! Pure: time is the caller's. A pad is guarded by the name under which it is called. Another page cannot make a
//! browser send the pad's own origin, nor a name of its own for the pad's address. So the name is a number, of an
//! address on which the pad listens, `localhost`, or a host name that the user has allowed. An address that is not
//! loopback wants a token, too.

use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::protocol::Refusal;

/// Requests that a session may make at once, and each second after that: uploads, all others.
const UPLOADS: [f64; 2] = [8.0, 1.0];
const OTHERS: [f64; 2] = [20.0, 5.0];
/// Requests of a session that may be under way at the same time: a browser opens six connections.
const AT_ONCE: usize = 6;
/// Most sessions with buckets.
const MAX_SESSIONS: usize = 64;

/// Checks where a request comes from.
#[derive(Debug, Clone)]
pub struct Guard {
    address: SocketAddr,
    hosts: Vec<String>,
    token: Option<String>,
}

impl Guard {
    /// For a pad that listens here, and that people also call by the host names `hosts`, which have no port.
    pub fn new(address: SocketAddr, hosts: Vec<String>, token: Option<String>) -> Self {
        Self { address, hosts, token }
    }

    /// Checks the headers `host` and `origin`. A program that is no browser may leave the origin out.
    ///
    /// # Errors
    /// [`Refusal::Forbidden`] with what was expected.
    pub fn check_origin(&self, host: Option<&str>, origin: Option<&str>) -> Result<(), Refusal> {
        let host =
            host.ok_or_else(|| Refusal::Forbidden("host: expected the pad's address, found none".into()))?;
        if !self.is_own_name(host) {
            let names = self.names();
            let words = format!("host: expected {names}, found {host:?}; --host NAME allows a name");
            return Err(Refusal::Forbidden(words));
        }
        match origin {
            Some(origin) if origin.strip_prefix("http://") != Some(host) => {
                Err(Refusal::Forbidden(format!("origin: expected http://{host}, found {origin:?}")))
            }
            _ => Ok(()),
        }
    }

    /// A name of somebody else's that leads here (DNS rebinding) is no number, and nobody has allowed it.
    fn is_own_name(&self, host: &str) -> bool {
        let Some(name) = without_port(host, self.address.port()) else { return false };
        // A dot at the end is the root of all names.
        let host = name.strip_suffix('.').unwrap_or(name);
        if self.hosts.iter().any(|own| own.eq_ignore_ascii_case(host)) {
            return true;
        }
        let own = self.address.ip().to_canonical();
        let is_any = own.is_unspecified();
        if name.eq_ignore_ascii_case("localhost") {
            return is_any || own.is_loopback();
        }
        let bare = name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(name);
        let is_own = |ip: IpAddr| is_any || ip == own || (ip.is_loopback() && own.is_loopback());
        bare.parse::<IpAddr>().is_ok_and(|ip| is_own(ip.to_canonical()))
    }

    fn names(&self) -> String {
        let port = self.address.port();
        let numbers = match self.address.ip() {
            ip if ip.is_unspecified() => format!("an address of this machine in numbers, and port {port}"),
            ip if ip.is_loopback() => format!("{} or localhost:{port}", self.address),
            _ => self.address.to_string(),
        };
        self.hosts.iter().fold(numbers, |names, host| format!("{names} or {host}:{port}"))
    }

    /// Checks the token, in a time that does not tell how much of it is right.
    ///
    /// # Errors
    /// [`Refusal::Token`].
    pub fn check_token(&self, found: Option<&str>) -> Result<(), Refusal> {
        match (&self.token, found) {
            (None, _) => Ok(()),
            (Some(_), None) => Err(Refusal::Token("none")),
            (Some(token), Some(found)) if is_same(token.as_bytes(), found.as_bytes()) => Ok(()),
            (Some(_), Some(_)) => Err(Refusal::Token("another one")),
        }
    }
}

/// What stands before the port; a browser leaves out that of HTTP.
fn without_port(host: &str, port: u16) -> Option<&str> {
    let name = host.strip_suffix(&port.to_string()).and_then(|name| name.strip_suffix(':'));
    name.or((port == 80).then_some(host))
}

fn is_same(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |differs, (a, b)| differs | (a ^ b)) == 0
}

/// What a request is, for the bucket that it is taken from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Load {
    /// A drawing, a path, a mission file.
    Upload,
    /// All others.
    Other,
}

/// What may come at once, refilled as time goes by.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bucket {
    left: f64,
    at: Duration,
}

impl Bucket {
    /// All of it.
    pub(crate) fn full([most, _]: [f64; 2], now: Duration) -> Self {
        Self { left: most, at: now }
    }

    /// Takes one, where there is one left.
    pub(crate) fn take(&mut self, [most, each_s]: [f64; 2], now: Duration) -> bool {
        let since = now.saturating_sub(self.at).as_secs_f64();
        (self.left, self.at) = (most.min(self.left + since * each_s), now);
        let has = self.left >= 1.0;
        self.left -= if has { 1.0 } else { 0.0 };
        has
    }
}

/// How often each session has asked, and how much of it is under way.
#[derive(Debug, Default)]
pub struct Rates {
    sessions: BTreeMap<String, Rate>,
}

#[derive(Debug)]
struct Rate {
    buckets: [Bucket; 2],
    places: Arc<Semaphore>,
    connections: u32,
}

impl Rates {
    /// A connection of the session has come. Where there are too many sessions, one without a connection goes, but
    /// never the driver's.
    pub fn enter(&mut self, session: &str, driver: Option<&str>, now: Duration) {
        if self.sessions.len() >= MAX_SESSIONS && !self.sessions.contains_key(session) {
            let gone = self
                .sessions
                .iter()
                .filter(|(id, rate)| rate.connections == 0 && driver != Some(id.as_str()));
            let oldest = gone.min_by_key(|(_, rate)| rate.buckets[0].at.max(rate.buckets[1].at));
            let oldest = oldest.map(|(id, _)| id.clone());
            oldest.and_then(|id| self.sessions.remove(&id));
        }
        let fresh = || Rate {
            buckets: [Bucket::full(UPLOADS, now), Bucket::full(OTHERS, now)],
            places: Arc::new(Semaphore::new(AT_ONCE)),
            connections: 0,
        };
        self.sessions.entry(session.to_owned()).or_insert_with(fresh).connections += 1;
    }

    /// A connection of the session has ended.
    pub fn leave(&mut self, session: &str) {
        if let Some(rate) = self.sessions.get_mut(session) {
            rate.connections = rate.connections.saturating_sub(1);
        }
    }

    /// Takes a request from the session's bucket, and a place for as long as it lasts.
    ///
    /// # Errors
    /// [`Refusal::Forbidden`] for a session that is none, [`Refusal::TooOften`], [`Refusal::AtOnce`].
    pub fn take(
        &mut self,
        session: Option<&str>,
        load: Load,
        now: Duration,
    ) -> Result<(String, OwnedSemaphorePermit), Refusal> {
        let found = session.and_then(|id| self.sessions.get_mut(id).map(|rate| (id, rate)));
        let Some((id, rate)) = found else {
            let words = "x-sketchnav-session: expected the session of the page's link, found another or none";
            return Err(Refusal::Forbidden(words.into()));
        };
        let has = match load {
            Load::Upload => rate.buckets[0].take(UPLOADS, now),
            Load::Other => rate.buckets[1].take(OTHERS, now),
        };
        if !has {
            return Err(Refusal::TooOften);
        }
        let place = rate.places.clone().try_acquire_owned().map_err(|_| Refusal::AtOnce(AT_ONCE))?;
        Ok((id.to_owned(), place))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guard(address: &str, token: Option<&str>) -> Guard {
        Guard::new(address.parse().unwrap(), Vec::new(), token.map(str::to_owned))
    }

    #[test]
    fn another_origin_and_another_name_are_refused() {
        let guard = guard("127.0.0.1:7004", None);
        let check = |host, origin| guard.check_origin(host, origin).is_ok();
        assert!(check(Some("127.0.0.1:7004"), None));
        assert!(check(Some("localhost:7004"), Some("http://localhost:7004")));
        assert!(check(Some("[::1]:7004"), Some("http://[::1]:7004")));
        assert!(!check(Some("127.0.0.1:7004"), Some("http://evil.example")));
        assert!(!check(Some("127.0.0.1:7004"), Some("null")));
        assert!(!check(Some("127.0.0.1:7004"), Some("http://127.0.0.1:8000")));
        assert!(
            !check(Some("evil.example:7004"), Some("http://evil.example:7004")),
            "a name for our address"
        );
        assert!(!check(Some("127.0.0.1:8000"), None) && !check(None, None));
    }

    /// With `--bind 0.0.0.0` any name was accepted. A page of `evil.example`, whose name leads to the pad's address,
    /// was of the pad's own origin for the browser.
    #[test]
    fn on_every_address_the_pad_is_called_by_a_number() {
        for (address, own, others) in [
            (
                "0.0.0.0:7004",
                &["192.0.2.1:7004", "127.0.0.1:7004", "localhost:7004", "[2001:db8::1]:7004"][..],
                &[][..],
            ),
            ("[::]:7004", &["192.0.2.1:7004", "[2001:db8::1]:7004", "LOCALHOST:7004"], &[]),
            ("192.0.2.1:7004", &["192.0.2.1:7004"], &["192.0.2.2:7004", "localhost:7004", "127.0.0.1:7004"]),
            ("192.0.2.1:80", &["192.0.2.1:80", "192.0.2.1"], &["192.0.2.2"]),
            ("127.0.0.1:7004", &["127.0.0.1:7004", "127.0.0.2:7004"], &["192.0.2.1:7004", "0.0.0.0:7004"]),
        ] {
            let guard = guard(address, Some("t"));
            let check = |host: &&str| {
                let origin = format!("http://{host}");
                guard.check_origin(Some(host), Some(&origin)).is_ok()
                    && guard.check_origin(Some(host), None).is_ok()
            };
            assert!(own.iter().all(check), "{address}");
            assert!(!others.iter().any(check), "{address}");
            let foreign = [
                "evil.example:7004",
                "evil.example",
                "192.0.2.1:7005",
                "7004",
                ":7004",
                "",
                "[192.0.2.1:7004",
            ];
            assert!(!foreign.iter().any(check), "{address}");
        }
        let error =
            guard("0.0.0.0:7004", Some("t")).check_origin(Some("evil.example:7004"), None).unwrap_err();
        assert!(
            error.to_string().contains("expected an address of this machine in numbers, and port 7004"),
            "{error}"
        );
    }

    /// A pad that is called `robot.local` by everybody in the house refused them all.
    #[test]
    fn a_name_that_the_user_allows_is_the_pads_own_and_no_other_is() {
        for address in ["0.0.0.0:7004", "192.0.2.1:7004", "127.0.0.1:7004"] {
            let hosts = ["robot.local", "robot"].map(str::to_owned).to_vec();
            let guard = Guard::new(address.parse().unwrap(), hosts, Some("t".into()));
            let check = |host: &str, origin: &str| guard.check_origin(Some(host), Some(origin)).is_ok();
            for host in ["robot.local:7004", "ROBOT.local:7004", "robot.local.:7004", "robot:7004"] {
                assert!(check(host, &format!("http://{host}")), "{address}: {host}");
                assert!(guard.check_origin(Some(host), None).is_ok(), "{address}: {host}");
                assert!(!check(host, "http://evil.example:7004"), "another page's origin");
            }
            let foreign = [
                "evil.example:7004",
                "evil.robot.local:7004",
                "robot.local.evil.example:7004",
                "xrobot:7004",
                "robot.local",
                "robot.local:7005",
                "robot.local..:7004",
                ".:7004",
                ":7004",
            ];
            for host in foreign {
                assert!(!check(host, &format!("http://{host}")), "{address}: {host}");
            }
            let error = guard.check_origin(Some("evil.example:7004"), None).unwrap_err().to_string();
            assert!(error.contains("or robot.local:7004 or robot:7004, found"), "{error}");
        }
    }

    #[test]
    fn where_there_is_a_token_it_must_be_right() {
        let open = guard("192.0.2.1:7004", Some("abcdef"));
        assert!(open.check_origin(Some("192.0.2.1:7004"), Some("http://192.0.2.1:7004")).is_ok());
        assert!(open.check_token(Some("abcdef")).is_ok());
        for wrong in [None, Some(""), Some("abcdeg"), Some("abcde"), Some("abcdef0")] {
            assert_eq!(open.check_token(wrong).unwrap_err().status(), 401, "{wrong:?}");
        }
    }

    #[test]
    fn a_session_that_asks_too_often_waits_and_no_other_does() {
        let mut rates = Rates::default();
        let now = Duration::from_secs(5);
        rates.enter("a", None, now);
        rates.enter("b", None, now);
        let mut take = |id, at| rates.take(Some(id), Load::Upload, at).is_ok();
        assert_eq!((0..20).filter(|_| take("a", now)).count(), 8);
        assert!(take("b", now) && !take("a", now));
        assert!(take("a", now + Duration::from_secs(1)));
        assert_eq!(rates.take(Some("c"), Load::Other, now).unwrap_err().status(), 403);
        assert_eq!(rates.take(None, Load::Other, now).unwrap_err().status(), 403);
    }

    #[test]
    fn a_session_has_few_requests_under_way() {
        let mut rates = Rates::default();
        rates.enter("a", None, Duration::ZERO);
        let mut take = || rates.take(Some("a"), Load::Other, Duration::ZERO);
        let mut under_way: Vec<_> = (0..AT_ONCE).map(|_| take().unwrap()).collect();
        assert_eq!(take().unwrap_err().status(), 429);
        under_way.pop();
        assert!(take().is_ok());
    }

    #[test]
    fn neither_the_driver_nor_a_page_that_is_open_is_forgotten() {
        let mut rates = Rates::default();
        for id in ["driver", "watcher"] {
            rates.enter(id, Some("driver"), Duration::ZERO);
        }
        rates.leave("driver");
        for i in 0..200 {
            rates.enter(&format!("{i}"), Some("driver"), Duration::from_secs(i));
            rates.leave(&format!("{i}"));
        }
        assert_eq!(rates.sessions.len(), MAX_SESSIONS);
        for id in ["driver", "watcher"] {
            assert!(rates.take(Some(id), Load::Other, Duration::from_secs(200)).is_ok(), "{id}");
        }
    }
}

//! Decides which requests are accepted, and how often. It checks that they come from the pad's own page and
//! contain the token, and limits the rate of each session.
//!
//! This module is pure, and the caller passes in the time. A pad is guarded in two ways. The token in its
//! link keeps out people who were not given the link, because even on a loopback address every user of the
//! machine can connect. The host name in the request keeps out other web pages, because they can neither make
//! a browser send the pad's own origin, nor use a host name of their own for the pad's address. The host must
//! therefore be a numeric address on which the pad listens, `localhost`, or a name that the user has allowed.

use std::collections::BTreeMap;
use std::fmt::{Debug, Formatter};
use std::net::{IpAddr, SocketAddr};
use std::str::FromStr;
use std::sync::Arc;
use std::time::Duration;

use rand::RngExt;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::protocol::Refusal;

/// Number of requests that a session may make in a burst, and per second after that: for uploads, for changes of the shared
/// drawing, and for all others.
const UPLOADS: [f64; 2] = [8.0, 1.0];
const CHANGES: [f64; 2] = [40.0, 20.0];
const OTHERS: [f64; 2] = [20.0, 5.0];
/// Requests of a session that may be in progress at the same time: a browser opens six connections.
const AT_ONCE: usize = 6;
/// Maximum number of sessions with buckets.
const MAX_SESSIONS: usize = 64;

/// Shorter tokens could be guessed.
const MIN_TOKEN: usize = 16;
const MAX_TOKEN: usize = 64;

/// The secret in the link to a page, which consists of letters and digits and must be part of every request.
/// `Debug` does not show it.
#[derive(Clone, PartialEq, Eq)]
pub struct Token(String);

impl Token {
    /// Creates a new token that cannot be guessed.
    pub fn random() -> Self {
        Self(format!("{:032x}", rand::rng().random::<u128>()))
    }

    /// Its letters and digits.
    pub fn text(&self) -> &str {
        &self.0
    }
}

impl FromStr for Token {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let holds =
            (MIN_TOKEN..=MAX_TOKEN).contains(&text.len()) && text.bytes().all(|b| b.is_ascii_alphanumeric());
        let expected = || format!("expected {MIN_TOKEN} to {MAX_TOKEN} letters and digits");
        if holds { Ok(Self(text.to_owned())) } else { Err(expected()) }
    }
}

impl Debug for Token {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str("Token")
    }
}

/// Returns the value of a header that may occur at most once, or `None` if it is missing.
///
/// # Errors
/// [`Refusal::Forbidden`] if it occurs more than once or is not ASCII, because another program might read a
/// different value.
pub fn only<'a>(name: &str, values: impl IntoIterator<Item = &'a [u8]>) -> Result<Option<&'a str>, Refusal> {
    let refused =
        |found: &str| Refusal::Forbidden(format!("{name}: expected one header of ASCII, found {found}"));
    let mut values = values.into_iter();
    let Some(value) = values.next() else { return Ok(None) };
    if values.next().is_some() {
        return Err(refused("several"));
    }
    let is_visible = |byte: &u8| matches!(byte, b' '..=b'~');
    let text = std::str::from_utf8(value).ok().filter(|text| text.as_bytes().iter().all(is_visible));
    text.map(Some).ok_or_else(|| refused("other characters"))
}

/// Checks the origin of requests.
#[derive(Debug, Clone)]
pub struct Guard {
    address: SocketAddr,
    hosts: Vec<String>,
    token: Token,
}

impl Guard {
    /// Creates the guard of a pad that listens on `address`, and that people can also reach by the host names
    /// `hosts`, given without a port.
    pub fn new(address: SocketAddr, hosts: Vec<String>, token: Token) -> Self {
        Self { address, hosts, token }
    }

    /// Checks the headers `host` and `origin`. A program that is not a browser may omit the origin.
    ///
    /// # Errors
    /// [`Refusal::Forbidden`], which states what was expected.
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

    /// A foreign name that resolves to this address (DNS rebinding) is neither numeric nor allowed.
    fn is_own_name(&self, host: &str) -> bool {
        let Some(name) = without_port(host, self.address.port()) else { return false };
        // A trailing dot denotes the root of all names.
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
            ip if ip.is_unspecified() => format!("a numeric address of this machine and port {port}"),
            ip if ip.is_loopback() => format!("{} or localhost:{port}", self.address),
            _ => self.address.to_string(),
        };
        self.hosts.iter().fold(numbers, |names, host| format!("{names} or {host}:{port}"))
    }

    /// Checks the token. The time taken does not reveal how much of it is right.
    ///
    /// # Errors
    /// [`Refusal::Token`].
    pub fn check_token(&self, found: Option<&str>) -> Result<(), Refusal> {
        match found {
            None => Err(Refusal::Token("none")),
            Some(found) if is_same(self.token.text().as_bytes(), found.as_bytes()) => Ok(()),
            Some(_) => Err(Refusal::Token("another one")),
        }
    }
}

/// The part before the port; a browser omits the default port of HTTP.
fn without_port(host: &str, port: u16) -> Option<&str> {
    let name = host.strip_suffix(&port.to_string()).and_then(|name| name.strip_suffix(':'));
    name.or((port == 80).then_some(host))
}

/// Compares every byte, regardless of where the first difference is.
fn is_same(a: &[u8], b: &[u8]) -> bool {
    let differs = a.iter().zip(b).fold(0, |differs, (a, b)| std::hint::black_box(differs | (a ^ b)));
    a.len() == b.len() && differs == 0
}

/// The kind of a request, which determines its rate limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Load {
    /// A drawing, a path or a mission file.
    Upload,
    /// Changes of the shared drawing.
    Change,
    /// Any other request.
    Other,
}

/// A token bucket: a number of requests that may come in a burst, refilled over time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bucket {
    left: f64,
    at: Duration,
}

impl Bucket {
    /// A full bucket.
    pub(crate) fn full([most, _]: [f64; 2], now: Duration) -> Self {
        Self { left: most, at: now }
    }

    /// Takes one request, if there is one left.
    pub(crate) fn take(&mut self, [most, each_s]: [f64; 2], now: Duration) -> bool {
        let since = now.saturating_sub(self.at).as_secs_f64();
        (self.left, self.at) = (most.min(self.left + since * each_s), now);
        let has = self.left >= 1.0;
        self.left -= if has { 1.0 } else { 0.0 };
        has
    }
}

/// Numbers of recent requests and of requests in progress, for each session.
#[derive(Debug, Default)]
pub struct Rates {
    sessions: BTreeMap<String, Rate>,
}

#[derive(Debug)]
struct Rate {
    buckets: [Bucket; 3],
    places: Arc<Semaphore>,
    connections: u32,
}

impl Rates {
    /// Counts a new connection of the session. If there are too many sessions, one without a connection is
    /// dropped, but never the driver's.
    pub fn enter(&mut self, session: &str, driver: Option<&str>, now: Duration) {
        if self.sessions.len() >= MAX_SESSIONS && !self.sessions.contains_key(session) {
            let gone = self
                .sessions
                .iter()
                .filter(|(id, rate)| rate.connections == 0 && driver != Some(id.as_str()));
            let oldest = gone.min_by_key(|(_, rate)| rate.buckets.iter().map(|bucket| bucket.at).max());
            let oldest = oldest.map(|(id, _)| id.clone());
            oldest.and_then(|id| self.sessions.remove(&id));
        }
        let fresh = || Rate {
            buckets: [UPLOADS, CHANGES, OTHERS].map(|limit| Bucket::full(limit, now)),
            places: Arc::new(Semaphore::new(AT_ONCE)),
            connections: 0,
        };
        self.sessions.entry(session.to_owned()).or_insert_with(fresh).connections += 1;
    }

    /// Counts the end of a connection of the session.
    pub fn leave(&mut self, session: &str) {
        if let Some(rate) = self.sessions.get_mut(session) {
            rate.connections = rate.connections.saturating_sub(1);
        }
    }

    /// Counts a request against the session's limits, and reserves a place while it is in progress.
    ///
    /// # Errors
    /// [`Refusal::Forbidden`] for an unknown session, [`Refusal::TooOften`], or [`Refusal::AtOnce`].
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
            Load::Change => rate.buckets[1].take(CHANGES, now),
            Load::Other => rate.buckets[2].take(OTHERS, now),
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

    fn guard(address: &str) -> Guard {
        Guard::new(address.parse().unwrap(), Vec::new(), Token::random())
    }

    #[test]
    fn another_origin_and_another_name_are_refused() {
        let guard = guard("127.0.0.1:7004");
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

    /// With `--bind 0.0.0.0` any host name was once accepted, so a page of `evil.example`, whose name resolves to the
    /// pad's address, had the pad's own origin for the browser.
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
            let guard = guard(address);
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
        let error = guard("0.0.0.0:7004").check_origin(Some("evil.example:7004"), None).unwrap_err();
        assert!(
            error.to_string().contains("expected a numeric address of this machine and port 7004"),
            "{error}"
        );
    }

    /// A pad that was addressed as `robot.local` once refused all requests.
    #[test]
    fn a_name_that_the_user_allows_is_the_pads_own_and_no_other_is() {
        for address in ["0.0.0.0:7004", "192.0.2.1:7004", "127.0.0.1:7004"] {
            let hosts = ["robot.local", "robot"].map(str::to_owned).to_vec();
            let guard = Guard::new(address.parse().unwrap(), hosts, Token::random());
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
    fn a_token_must_be_right_on_every_address() {
        for address in ["127.0.0.1:7004", "[::1]:7004", "0.0.0.0:7004", "192.0.2.1:7004"] {
            let token = "abcdefgh12345678".parse().unwrap();
            let guard = Guard::new(address.parse().unwrap(), Vec::new(), token);
            assert!(guard.check_token(Some("abcdefgh12345678")).is_ok());
            for wrong in
                [None, Some(""), Some("abcdefgh12345679"), Some("abcdefgh1234567"), Some("abcdefgh123456780")]
            {
                assert_eq!(guard.check_token(wrong).unwrap_err().status(), 401, "{wrong:?}");
            }
        }
    }

    #[test]
    fn a_token_is_long_and_kept_out_of_what_is_printed() {
        assert_ne!(Token::random(), Token::random());
        let token: Token = Token::random().text().parse().unwrap();
        assert!(!format!("{token:?}").contains(token.text()));
        for wrong in ["", "abcdefgh1234567", "abcdefgh1234567-", &"a".repeat(65)] {
            assert!(wrong.parse::<Token>().unwrap_err().contains("expected 16 to 64"), "{wrong}");
        }
    }

    /// An origin with other characters once counted as missing, which is allowed, and of two hosts the first was read.
    #[test]
    fn a_header_that_can_be_read_in_two_ways_is_refused() {
        assert_eq!(only("host", []), Ok(None));
        assert_eq!(only("host", [b"a:1".as_slice()]), Ok(Some("a:1")));
        let refused = [
            vec!["http://ä".as_bytes()],
            vec![b"http://\xff"],
            vec![b"a\tb"],
            vec![b"a:1", b"a:1"],
            vec![b"a:1", b"evil.example:1"],
        ];
        for values in refused {
            assert_eq!(only("origin", values.clone()).unwrap_err().status(), 403, "{values:?}");
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
        assert_eq!((0..99).filter(|_| rates.take(Some("a"), Load::Change, now).is_ok()).count(), 40);
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

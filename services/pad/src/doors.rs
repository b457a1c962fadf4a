//! Limits the connections whose session is not known yet, and decides which of them to close if there are too
//! many.
//!
//! A connection is a stranger's until a request on it has named a session, or a page has joined through it. From then on, the
//! session's own limits apply. The number of strangers' connections is limited. If there is one too many, the oldest connection of
//! the address with the most connections is closed. A client that opens connections without sending anything therefore only
//! displaces its own, and a client that sends its request promptly is finished before that happens.
//!
//! This module is pure. `T` is what notifies a connection that it is closed.

use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv6Addr};

/// Maximum number of strangers' connections at a time.
pub const MAX_STRANGERS: usize = 64;

/// The strangers' connections, in order of arrival.
#[derive(Debug)]
pub struct Doors<T> {
    next: u64,
    strangers: BTreeMap<u64, (IpAddr, T)>,
}

impl<T> Default for Doors<T> {
    fn default() -> Self {
        Self { next: 0, strangers: BTreeMap::new() }
    }
}

impl<T> Doors<T> {
    /// Adds a connection. Returns its number, and the connection that must be closed in exchange, if any.
    pub fn enter(&mut self, from: IpAddr, bell: T) -> (u64, Option<T>) {
        let id = self.next;
        self.next += 1;
        self.strangers.insert(id, (origin(from), bell));
        let is_full = self.strangers.len() > MAX_STRANGERS;
        let goes = is_full.then(|| self.oldest_of_most()).flatten();
        (id, goes.and_then(|id| self.strangers.remove(&id)).map(|(_, bell)| bell))
    }

    /// Removes a connection that has ended or whose session has become known.
    pub fn leave(&mut self, id: u64) -> Option<T> {
        self.strangers.remove(&id).map(|(_, bell)| bell)
    }

    fn oldest_of_most(&self) -> Option<u64> {
        let mut counts = BTreeMap::<IpAddr, usize>::new();
        for (from, _) in self.strangers.values() {
            *counts.entry(*from).or_default() += 1;
        }
        let most = counts.values().max()?;
        self.strangers.iter().find(|(_, (from, _))| counts[from] == *most).map(|(id, _)| *id)
    }
}

/// The origin of a connection: an IPv4 address, or an IPv6 network, because one device may use any number of addresses of its
/// network.
fn origin(from: IpAddr) -> IpAddr {
    match from.to_canonical() {
        IpAddr::V6(address) if !address.is_loopback() => {
            let [a, b, c, d, ..] = address.segments();
            Ipv6Addr::new(a, b, c, d, 0, 0, 0, 0).into()
        }
        address => address,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn from(text: &str) -> IpAddr {
        text.parse().unwrap()
    }

    #[test]
    fn whoever_has_the_most_connections_goes_the_oldest_first() {
        let mut doors = Doors::default();
        for i in 0..MAX_STRANGERS - 1 {
            assert_eq!(doors.enter(from("192.0.2.1"), i).1, None);
        }
        assert_eq!(doors.enter(from("192.0.2.2"), 1000), (63, None));
        assert_eq!(doors.enter(from("192.0.2.3"), 1001).1, Some(0), "a phone gets in");
        assert_eq!(doors.enter(from("192.0.2.1"), 1002).1, Some(1), "by itself it pushes out itself");
        assert_eq!(doors.leave(63), Some(1000));
        assert_eq!(doors.enter(from("192.0.2.1"), 1003).1, None, "one place was free");
        assert_eq!(doors.leave(63), None);
    }

    #[test]
    fn a_network_is_one_origin() {
        assert_eq!(origin(from("2001:db8::1")), origin(from("2001:db8::2:3")));
        assert_ne!(origin(from("2001:db8::1")), origin(from("2001:db8:0:1::1")));
        assert_eq!(origin(from("::ffff:192.0.2.1")), from("192.0.2.1"));
        assert_eq!(origin(from("::1")), from("::1"));
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// The number of connections stays limited, regardless of how many arrive and from where, and a newcomer is not closed if
        /// another address has more.
        #[test]
        fn strangers_stay_few(comers in prop::collection::vec((0..6_u8, any::<bool>()), 0..400)) {
            let mut doors = Doors::default();
            for (place, leaves) in comers {
                let (id, gone) = doors.enter(IpAddr::from([192, 0, 2, place]), place);
                prop_assert!(doors.strangers.len() <= MAX_STRANGERS && gone.is_none_or(|_| doors.strangers.contains_key(&id)));
                if leaves {
                    doors.leave(id);
                }
            }
        }
    }
}

//! Notifies a service manager that this service is ready, still alive, or stopping (sd_notify(3)).
//!
//! Does nothing if there is no manager (`NOTIFY_SOCKET` is not set). Failed notifications are ignored, since the
//! manager notices that they are missing.

use std::env;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::time::{Duration, Instant};

/// The service manager that started this process.
pub struct Manager {
    socket: Option<(UnixDatagram, SocketAddr)>,
    /// Interval at which to send a sign of life, or `None` if the manager does not expect any.
    ping_every: Option<Duration>,
    pinged: Instant,
}

impl Manager {
    /// Returns the manager that the environment variables describe.
    pub fn of_environment() -> Self {
        let variable = |name: &str| env::var(name).ok();
        let is_for_us = variable("WATCHDOG_PID").is_none_or(|pid| pid == std::process::id().to_string());
        let limit = variable("WATCHDOG_USEC").filter(|_| is_for_us);
        Self::new(variable("NOTIFY_SOCKET").as_deref(), limit.as_deref())
    }

    /// Returns the manager that listens at the address `socket`. `limit_us` is the longest time, in microseconds, that it waits
    /// for a sign of life; signs are sent twice as often.
    fn new(socket: Option<&str>, limit_us: Option<&str>) -> Self {
        let address = socket.and_then(address);
        let socket = address.and_then(|address| Some((UnixDatagram::unbound().ok()?, address)));
        let limit_us = limit_us.and_then(|text| text.parse().ok()).filter(|limit| *limit > 0);
        Self {
            socket,
            ping_every: limit_us.map(|limit| Duration::from_micros(limit) / 2),
            pinged: Instant::now(),
        }
    }

    /// Reports that the service has started its work. `status` is a line for people.
    pub fn ready(&self, status: &str) {
        self.notify(&format!("READY=1\nSTATUS={status}"));
    }

    /// Sends a sign of life if one is due.
    pub fn ping_if_due(&mut self) {
        if self.ping_every.is_some_and(|period| self.pinged.elapsed() >= period) {
            self.pinged = Instant::now();
            self.notify("WATCHDOG=1");
        }
    }

    /// Reports that the service is about to end.
    pub fn stopping(&self) {
        self.notify("STOPPING=1");
    }

    fn notify(&self, text: &str) {
        if let Some((socket, address)) = &self.socket {
            // If the manager is gone, the message is not needed.
            let _ = socket.send_to_addr(text.as_bytes(), address);
        }
    }
}

/// Parses the address of a socket: a path, or an abstract name preceded by `@`.
fn address(name: &str) -> Option<SocketAddr> {
    match name.strip_prefix('@') {
        Some(name) => SocketAddr::from_abstract_name(name).ok(),
        None => SocketAddr::from_pathname(name).ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn received(manager: &UnixDatagram) -> String {
        let mut text = [0; 256];
        let length = manager.recv(&mut text).unwrap();
        String::from_utf8_lossy(&text[..length]).into_owned()
    }

    #[test]
    fn the_service_manager_is_notified_of_start_life_and_stop() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("notify");
        let abstract_name = format!("sketchnav-test-{}", std::process::id());
        let abstract_address = SocketAddr::from_abstract_name(&abstract_name).unwrap();
        let sockets = [
            (path.to_str().unwrap().to_owned(), UnixDatagram::bind(&path).unwrap()),
            (format!("@{abstract_name}"), UnixDatagram::bind_addr(&abstract_address).unwrap()),
        ];
        for (name, socket) in sockets {
            let mut manager = Manager::new(Some(&name), Some("2"));
            manager.ready("the page");
            assert_eq!(received(&socket), "READY=1\nSTATUS=the page");
            // The watchdog of this manager is due after 1 µs. A longer wait does no harm.
            std::thread::sleep(Duration::from_micros(1));
            manager.ping_if_due();
            assert_eq!(received(&socket), "WATCHDOG=1");
            manager.stopping();
            assert_eq!(received(&socket), "STOPPING=1");
        }
    }

    #[test]
    fn without_a_service_manager_nothing_is_sent_and_nothing_fails() {
        for (socket, limit) in [(None, None), (Some("/nowhere/notify"), Some("0")), (Some(""), Some("soon"))]
        {
            let mut manager = Manager::new(socket, limit);
            assert_eq!(manager.ping_every, None);
            manager.ready("");
            manager.ping_if_due();
            manager.stopping();
        }
    }
}

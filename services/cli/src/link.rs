//! The link to the page that people draw on.

use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::time::Duration;

use anyhow::Context;
use qrcode::QrCode;
use qrcode::render::unicode::Dense1x2;
use rand::RngExt;
use sketchnav_pad::TOKEN_VARIABLE;
use sketchnav_schemas::codes::Process;
use sketchnav_supervisor::{Error as SystemError, ProcessLine};

use crate::args::PadSite;

/// Longest that the page may take to answer a look whether it is there.
const LOOK: Duration = Duration::from_millis(50);

/// The link to a page, and what its process has to know.
pub struct Link {
    site: PadSite,
    token: Option<String>,
}

impl Link {
    /// Port 0 becomes one that is free; a token is made where it takes one and none is given.
    ///
    /// # Errors
    /// Where no port is free.
    pub fn new(site: &PadSite, token: Option<String>) -> anyhow::Result<Self> {
        let mut site = site.clone();
        if site.port == 0 {
            let free = TcpListener::bind((site.bind, 0)).and_then(|listener| listener.local_addr());
            site.port = free.with_context(|| format!("{}: expected a free port", site.bind))?.port();
        }
        site.save = std::path::absolute(&site.save).context("the current folder is gone")?;
        let made = || format!("{:032x}", rand::rng().random::<u128>());
        let token = token.or_else(|| (!site.bind.is_loopback()).then(made));
        Ok(Self { site, token })
    }

    /// How the pad's process is started.
    ///
    /// # Errors
    /// As [`ProcessLine::serve`].
    pub fn line(&self, system: &str) -> Result<ProcessLine, SystemError> {
        let PadSite { port, bind, hosts, save } = &self.site;
        let mut line = ProcessLine::serve(Process::Pad, system)?;
        line.command.args(["--port", &port.to_string(), "--bind", &bind.to_string()]);
        line.command.args(hosts.iter().flat_map(|host| ["--host", host]));
        line.command.arg("--save").arg(save);
        match &self.token {
            Some(token) => line.command.env(TOKEN_VARIABLE, token),
            None => line.command.env_remove(TOKEN_VARIABLE),
        };
        Ok(line)
    }

    /// Whether a process listens there.
    pub fn is_up(&self) -> bool {
        let host = if self.site.bind.is_unspecified() { loopback(self.site.bind) } else { self.site.bind };
        TcpStream::connect_timeout(&SocketAddr::new(host, self.site.port), LOOK).is_ok()
    }

    /// What to print: the link; for another device as a picture, too.
    pub fn text(&self) -> String {
        let url = self.url();
        let code = self.token.as_ref().and_then(|_| QrCode::new(&url).ok());
        let picture = code.map(|code| code.render::<Dense1x2>().quiet_zone(true).build());
        format!("the page: {url}{}", picture.map_or_else(String::new, |picture| format!("\n{picture}")))
    }

    fn url(&self) -> String {
        let host = if self.site.bind.is_unspecified() { own_address(self.site.bind) } else { self.site.bind };
        let address = SocketAddr::new(host, self.site.port);
        match &self.token {
            Some(token) => format!("http://{address}/?token={token}"),
            None => format!("http://{address}/"),
        }
    }
}

fn loopback(unspecified: IpAddr) -> IpAddr {
    match unspecified {
        IpAddr::V4(_) => std::net::Ipv4Addr::LOCALHOST.into(),
        IpAddr::V6(_) => std::net::Ipv6Addr::LOCALHOST.into(),
    }
}

/// The address by which others reach this machine: that of the way out, towards an address for documentation
/// (RFC 5737, RFC 3849). Nothing is sent.
fn own_address(unspecified: IpAddr) -> IpAddr {
    let outside = match unspecified {
        IpAddr::V4(_) => "192.0.2.1:9",
        IpAddr::V6(_) => "[2001:db8::1]:9",
    };
    let way_out = UdpSocket::bind((unspecified, 0)).and_then(|socket| {
        socket.connect(outside)?;
        socket.local_addr()
    });
    way_out.map_or_else(|_| loopback(unspecified), |address| address.ip())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn site(bind: &str) -> PadSite {
        PadSite { port: 0, bind: bind.parse().unwrap(), hosts: vec!["robot.local".into()], save: ".".into() }
    }

    #[test]
    fn a_link_to_this_machine_alone_needs_no_token() {
        let link = Link::new(&site("127.0.0.1"), None).unwrap();
        assert!(link.token.is_none() && link.site.port > 0);
        assert_eq!(link.url(), format!("http://127.0.0.1:{}/", link.site.port));
        assert!(!link.is_up());
    }

    #[test]
    fn a_link_for_others_has_a_token_that_nobody_guesses() {
        let links = [(); 2].map(|()| Link::new(&site("0.0.0.0"), None).unwrap());
        assert_ne!(links[0].token, links[1].token);
        let token = links[0].token.as_ref().unwrap();
        assert!(token.len() == 32 && links[0].url().ends_with(&format!("?token={token}")));
        let line = links[0].line("x").unwrap();
        let shown = format!("{:?}", line.command.get_args().collect::<Vec<_>>());
        assert!(shown.contains("\"--host\", \"robot.local\""), "{shown}");
        assert!(!shown.contains(token), "a command line is everybody's to read: {shown}");
    }
}

//! The link to the page that people draw on.

use std::ffi::OsStr;
use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::path::PathBuf;
use std::time::Duration;

use anyhow::Context;
use qrcode::QrCode;
use qrcode::render::unicode::Dense1x2;
use sketchnav_pad::guard::Token;
use sketchnav_pad::token::{self, TOKEN_VARIABLE};
use sketchnav_schemas::codes::Process;
use sketchnav_supervisor::{Error as SystemError, ProcessLine};

use crate::args::PadSite;

/// Longest time that the page may take to accept a connection.
const LOOK: Duration = Duration::from_millis(50);

/// The link to a page, and the arguments of the process that serves it.
pub struct Link {
    site: PadSite,
    token: Token,
    study: Option<PathBuf>,
}

impl Link {
    /// Creates a link. Port 0 is replaced by a free port. If neither the command line nor the environment provides a
    /// token, a new one is generated.
    ///
    /// # Errors
    /// If no port is free, or the token in the environment is invalid.
    pub fn new(site: &PadSite, token: Option<Token>) -> anyhow::Result<Self> {
        let mut site = site.clone();
        if site.port == 0 {
            let free = TcpListener::bind((site.bind, 0)).and_then(|listener| listener.local_addr());
            site.port = free.with_context(|| format!("{}: expected a free port", site.bind))?.port();
        }
        site.save = std::path::absolute(&site.save).context("the current folder no longer exists")?;
        let given = token.map_or_else(token::of_environment, |token| Ok(Some(token)))?;
        Ok(Self { site, token: given.unwrap_or_else(Token::random), study: None })
    }

    /// Turns this into the link to the page of the study in `folder`, which must be an absolute path.
    pub fn of_study(self, folder: PathBuf) -> Self {
        Self { study: Some(folder), ..self }
    }

    /// Returns the command line of the pad's process.
    ///
    /// # Errors
    /// Those of [`ProcessLine::serve`].
    pub fn line(&self, system: &str) -> Result<ProcessLine, SystemError> {
        let PadSite { port, bind, hosts, save } = &self.site;
        let mut line = ProcessLine::serve(Process::Pad, system)?;
        line.command.args(["--port", &port.to_string(), "--bind", &bind.to_string()]);
        line.command.args(hosts.iter().flat_map(|host| ["--host", host]));
        line.command.arg("--save").arg(save);
        line.command.args(self.study.iter().flat_map(|folder| [OsStr::new("--study"), folder.as_os_str()]));
        line.command.env(TOKEN_VARIABLE, self.token.text());
        Ok(line)
    }

    /// Returns true if a process is listening at the link's address.
    pub fn is_up(&self) -> bool {
        let host = if self.site.bind.is_unspecified() { loopback(self.site.bind) } else { self.site.bind };
        TcpStream::connect_timeout(&SocketAddr::new(host, self.site.port), LOOK).is_ok()
    }

    /// Returns the text to print: the link and, if other devices can reach the page, a QR code of the link.
    pub fn text(&self) -> String {
        let url = self.url();
        let code = (!self.site.bind.is_loopback()).then(|| QrCode::new(&url).ok()).flatten();
        let picture = code.map(|code| code.render::<Dense1x2>().quiet_zone(true).build());
        format!("the page: {url}{}", picture.map_or_else(String::new, |picture| format!("\n{picture}")))
    }

    fn url(&self) -> String {
        let host = if self.site.bind.is_unspecified() { own_address(self.site.bind) } else { self.site.bind };
        let address = SocketAddr::new(host, self.site.port);
        format!("http://{address}/?token={}", self.token.text())
    }
}

fn loopback(unspecified: IpAddr) -> IpAddr {
    match unspecified {
        IpAddr::V4(_) => std::net::Ipv4Addr::LOCALHOST.into(),
        IpAddr::V6(_) => std::net::Ipv6Addr::LOCALHOST.into(),
    }
}

/// Returns the address at which other machines reach this one, which is the local address of the route to an
/// address reserved for documentation (RFC 5737, RFC 3849). Nothing is sent.
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

    /// Regression test: links to loopback addresses had no token. Since all users of the machine can reach these addresses, another
    /// user could drive the robot.
    #[test]
    fn every_link_has_an_unguessable_token() {
        for bind in ["127.0.0.1", "::1", "0.0.0.0"] {
            let links = [(); 2].map(|()| Link::new(&site(bind), None).unwrap());
            assert_ne!(links[0].token, links[1].token);
            let token = links[0].token.text();
            assert!(token.len() == 32 && links[0].url().ends_with(&format!("/?token={token}")));
            assert!(links[0].text().contains(token) && links[0].site.port > 0 && !links[0].is_up());
            let line = links[0].line("x").unwrap();
            let shown = format!("{:?}", line.command.get_args().collect::<Vec<_>>());
            assert!(shown.contains("\"--host\", \"robot.local\""), "{shown}");
            assert!(!shown.contains(token), "a command line is everybody's to read: {shown}");
            let given: Vec<_> = line.command.get_envs().filter(|(name, _)| *name == TOKEN_VARIABLE).collect();
            assert_eq!(given, [(TOKEN_VARIABLE.as_ref(), Some(token.as_ref()))]);
        }
        let chosen: Token = "abcdefgh12345678".parse().unwrap();
        assert_eq!(Link::new(&site("127.0.0.1"), Some(chosen.clone())).unwrap().token, chosen);
    }

    #[test]
    fn the_qr_code_is_for_other_devices() {
        let lines = |bind| Link::new(&site(bind), None).unwrap().text().lines().count();
        assert!(lines("127.0.0.1") == 1 && lines("0.0.0.0") > 10);
    }
}

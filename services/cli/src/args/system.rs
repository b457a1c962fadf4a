//! Options of the commands that run a whole system.

use std::net::IpAddr;
use std::path::PathBuf;

use clap::Args;
use sketchnav_pad::guard::Token;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::run::{Pace, Split};
use sketchnav_schemas::time::nanoseconds;

use super::values::{MAX_SPEED, parse_service, parse_speed};

/// Which system to run, and where to put its results.
#[derive(Debug, Clone, Args)]
pub struct SystemOptions {
    /// The mission's seed.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// The method, overriding the mission's `navigator.method`. For drawings: outline, beam, boniardi-2015,
    /// boniardi-2015-fixed-scale or behzadian-2015.
    #[arg(long)]
    pub method: Option<String>,
    /// Folder for the recording and the pictures; created if missing.
    #[arg(long, default_value = "out")]
    pub out: PathBuf,
    /// The system's name; several systems can run side by side without affecting each other.
    #[arg(long)]
    pub system: Option<String>,
    /// Do not start this process, which is run by hand or replaced by a real robot's driver (may be repeated).
    #[arg(long, value_name = "PROCESS", value_parser = parse_service)]
    pub without: Vec<Process>,
    /// Inject the faults planned in this file (TOML; `sketchnav help ecosystem` says how to write one).
    #[arg(long, value_name = "FILE")]
    pub faults: Option<PathBuf>,
    /// Seconds after which a process that was stopped (SIGSTOP) is killed and restarted.
    #[arg(long, value_name = "SECONDS", default_value_t = 3.0, value_parser = parse_seconds)]
    pub stopped_limit: f64,
    #[command(flatten)]
    pub split: SplitWhileGrowing,
}

/// The options that split a recording into files while it grows: `NAME_0.mcap`, `NAME_1.mcap` and so on.
#[derive(Debug, Clone, Args)]
pub struct SplitWhileGrowing {
    /// Start the next file of the recording (NAME_0.mcap, NAME_1.mcap and so on) after this many megabytes. NAME.mcap
    /// then refers to all of them.
    #[arg(long, value_name = "MEGABYTES", value_parser = parse_megabytes)]
    split_size: Option<f64>,
    /// Start the next file of the recording after this many simulated seconds.
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds)]
    split_duration: Option<f64>,
}

impl SplitWhileGrowing {
    /// Returns the limits in the recorder's units.
    pub fn of(&self) -> Split {
        let bytes = self.split_size.map(|megabytes| (megabytes * 1e6) as u64);
        Split { bytes, duration_ns: self.split_duration.map(nanoseconds) }
    }
}

/// The options of `run`.
#[derive(Debug, Clone, Args)]
pub struct RunOptions {
    /// `max`: in lockstep, as fast as possible; a number: simulated seconds per second (1 is real time).
    #[arg(long, default_value = "max", value_parser = parse_speed)]
    pub speed: Pace,
    #[command(flatten)]
    pub system: SystemOptions,
    /// Drive in the map that was learned on an earlier drive by the mission's drawing (`sketchnav learn`). The robot may start
    /// anywhere in it.
    #[arg(long, value_name = "FILE")]
    pub learned: Option<PathBuf>,
    /// Start even if the navigator predicts that it will probably fail.
    #[arg(long)]
    pub go: bool,
    /// Print one JSON object instead of progress and a table.
    #[arg(long)]
    pub json: bool,
    /// Also serve a page that shows the mission and can abort and continue it.
    #[arg(long)]
    pub pad: bool,
    /// Also show the mission in Foxglove or Lichtblick, as `sketchnav view` does, on this port (0: any free port).
    #[arg(long, value_name = "PORT", num_args = 0..=1, default_missing_value = super::tools::VIEW_PORT)]
    pub foxglove: Option<u16>,
    #[command(flatten)]
    pub site: PadSite,
    /// The token of the page, letters and digits. Default: the environment variable SKETCHNAV_PAD_TOKEN, otherwise a
    /// new one. Other users of this machine can read the command line, but not your environment.
    #[arg(long, requires = "pad")]
    pub token: Option<Token>,
}

/// Where the pad serves its page.
#[derive(Debug, Clone, Args)]
pub struct PadSite {
    /// Port of the page.
    #[arg(long, default_value_t = 7004)]
    pub port: u16,
    /// Address of the page; 0.0.0.0 for all addresses of this machine. On any address, the page
    /// requires the token in the printed link.
    #[arg(long, default_value = "127.0.0.1", value_name = "ADDRESS")]
    pub bind: IpAddr,
    /// A host name of the page, such as `robot.local` (may be repeated). Numeric addresses are always accepted.
    #[arg(long = "host", value_name = "NAME", value_parser = parse_host)]
    pub hosts: Vec<String>,
    /// Folder for mission files that are saved from the page.
    #[arg(long, default_value = ".", value_name = "DIR")]
    pub save: PathBuf,
}

/// The options of `pad`.
#[derive(Debug, Clone, Args)]
pub struct PadOptions {
    /// Use the world, the robot and its true start from this mission, but not its drawing or its tasks. Default, also
    /// for `demo`: the demo's building.
    #[arg(long, value_name = "FILE")]
    pub mission: Option<PathBuf>,
    /// Simulated seconds per second (1 is real time).
    #[arg(long, default_value = "1", value_parser = parse_pace)]
    pub speed: Pace,
    /// Run a user study on the page (Boniardi et al. 2016) and store everything in this folder: each participant draws
    /// the place and a path, the robot drives once, and the participant rates statements. If the folder contains a
    /// study, continue it.
    #[arg(long, value_name = "DIR", conflicts_with = "out")]
    pub study: Option<PathBuf>,
    /// Only write the table and the pages of the study again, from the files in its folder.
    #[arg(long, requires = "study", conflicts_with = "mission")]
    pub report: bool,
    #[command(flatten)]
    pub system: SystemOptions,
    #[command(flatten)]
    pub site: PadSite,
    /// The token of the page, letters and digits. Default: the environment variable SKETCHNAV_PAD_TOKEN, otherwise a
    /// new one. Other users of this machine can read the command line, but not your environment.
    #[arg(long)]
    pub token: Option<Token>,
}

/// Parses a host name (RFC 1123) and converts it to lower case.
fn parse_host(text: &str) -> Result<String, String> {
    let known = |b: u8| b.is_ascii_alphanumeric() || matches!(b, b'-' | b'_');
    let is_label = |label: &str| (1..=63).contains(&label.len()) && label.bytes().all(known);
    let holds = text.len() <= 253 && text.split('.').all(is_label);
    let expected = || "expected a host name without scheme and port, such as robot.local".to_owned();
    if holds { Ok(text.to_ascii_lowercase()) } else { Err(expected()) }
}

/// Parses a pace in real time. Lockstep is rejected, since people cannot draw in lockstep.
fn parse_pace(text: &str) -> Result<Pace, String> {
    match parse_speed(text)? {
        Pace::Lockstep => Err(format!("expected a number above 0 and up to {MAX_SPEED}")),
        pace => Ok(pace),
    }
}

/// Parses a file size in megabytes.
fn parse_megabytes(text: &str) -> Result<f64, String> {
    let megabytes = text.parse().ok().filter(|megabytes| (0.1..=1e6).contains(megabytes));
    megabytes.ok_or_else(|| "expected a number of megabytes, from 0.1 to 1000000".into())
}

/// Parses a length of time in seconds.
fn parse_seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds| (1.0..=86_400.0).contains(seconds));
    seconds.ok_or_else(|| "expected a number of seconds, from 1 to 86400".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_host_is_only_a_name() {
        for (text, name) in [("robot.local", "robot.local"), ("Robot", "robot"), ("192.0.2.1", "192.0.2.1")] {
            assert_eq!(parse_host(text).as_deref(), Ok(name));
        }
        let long = "x".repeat(64);
        for wrong in
            ["", ".", "a..b", "robot.local:7004", "http://robot.local", "robot local", "*", "ä", &long]
        {
            assert!(parse_host(wrong).unwrap_err().contains("expected a host name"), "{wrong}");
        }
    }
}

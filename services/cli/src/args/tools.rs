//! Options of the tools that inspect a running system or intervene in it.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use regex_lite::Regex;
use sketchnav_schemas::bounds::ANGLE_DEG;
use sketchnav_schemas::codes::{Order, Process};

use super::values::{parse_drawn_place, parse_pattern, parse_served};

/// The channels to read, and the system that they belong to.
#[derive(Debug, Clone, Args)]
pub struct Tap {
    /// The channel, as listed by `sketchnav channels`.
    #[arg(required_unless_present = "regex", conflicts_with = "regex")]
    pub channel: Option<String>,
    /// Read all channels whose whole name matches this regular expression, instead of one.
    #[arg(long, value_name = "PATTERN", value_parser = parse_pattern)]
    pub regex: Option<Regex>,
    /// The system's name; optional if only one is running.
    #[arg(long)]
    pub system: Option<String>,
    /// Stop after this many messages.
    #[arg(long)]
    pub count: Option<u64>,
}

/// Default port of Foxglove's WebSocket protocol, to which viewers connect unless told otherwise.
pub const VIEW_PORT: &str = "8765";

/// The options of `view`.
#[derive(Debug, Clone, Args)]
pub struct ViewOptions {
    /// A recording, or the name of a running system; optional if only one is running. A file takes precedence over a
    /// system.
    #[arg(value_name = "SYSTEM|FILE")]
    pub target: Option<String>,
    /// The system's name, even if there is a file of that name.
    #[arg(long, conflicts_with = "target")]
    pub system: Option<String>,
    /// The port on this machine; 0 for any free port.
    #[arg(long, default_value = VIEW_PORT)]
    pub port: u16,
    /// For a recording: playback rate, in recorded seconds per second; viewers may change it.
    #[arg(long, value_parser = parse_playback_rate)]
    pub rate: Option<f64>,
    /// For a recording: start again at the end.
    #[arg(long = "loop")]
    pub again: bool,
    /// For a recording: wait for the viewer's play button.
    #[arg(long)]
    pub paused: bool,
}

/// The options of `echo`.
#[derive(Debug, Clone, Args)]
pub struct EchoOptions {
    #[command(flatten)]
    pub tap: Tap,
    /// Print only this field, such as `pose.pose.position.x` or `ranges[3]`; may be repeated.
    #[arg(long = "field", value_name = "PATH")]
    pub fields: Vec<String>,
    /// Print a single message: the latest one or, if there is none yet, the first one to arrive.
    #[arg(long, conflicts_with = "count")]
    pub once: bool,
    /// Print the messages of this recording in order of time, instead of a running system's.
    #[arg(long, value_name = "RECORDING", conflicts_with = "system")]
    pub file: Option<PathBuf>,
    /// Print comma-separated values instead of JSON: number, time, cause and the fields; without --field, all fields
    /// outside lists.
    #[arg(long, conflicts_with = "regex")]
    pub csv: bool,
}

/// The options of `hz`.
#[derive(Debug, Clone, Args)]
pub struct HzOptions {
    #[command(flatten)]
    pub tap: Tap,
    /// Measure the messages of this recording, by their recorded times, instead of a running system's.
    #[arg(long, value_name = "RECORDING", conflicts_with = "system")]
    pub file: Option<PathBuf>,
    /// Print one JSON object per line instead of text.
    #[arg(long = "json", id = "json_lines")]
    pub json: bool,
}

/// The options of `logs`.
#[derive(Debug, Clone, Args)]
pub struct LogsOptions {
    /// Print only the output of these processes. Default: all.
    #[arg(value_parser = parse_served)]
    pub processes: Vec<Process>,
    /// The system's name; optional if only one is running.
    #[arg(long)]
    pub system: Option<String>,
    /// Keep printing until the system ends.
    #[arg(short, long)]
    pub follow: bool,
    /// Start with this many lines from the end of each process's output.
    #[arg(short = 'n', long, default_value_t = 100)]
    pub lines: usize,
    /// Print only lines that match this regular expression.
    #[arg(long, value_name = "PATTERN", value_parser = parse_part)]
    pub grep: Option<Regex>,
    /// Print one JSON object per line instead of text.
    #[arg(long = "json", id = "json_lines")]
    pub json: bool,
}

/// The options of `restart`.
#[derive(Debug, Clone, Args)]
pub struct RestartOptions {
    /// The process.
    #[arg(value_parser = parse_served)]
    pub process: Process,
    /// The system's name; optional if only one is running.
    #[arg(long)]
    pub system: Option<String>,
    /// Kill the process at once (SIGKILL) instead of asking it to end (SIGTERM).
    #[arg(long)]
    pub kill: bool,
    /// Maximum time to wait for the successor, in seconds.
    #[arg(long, value_name = "SECONDS", default_value = "10", value_parser = parse_patience)]
    pub timeout: Duration,
    /// Print one JSON object instead of text.
    #[arg(long)]
    pub json: bool,
}

/// The options of `send`.
#[derive(Debug, Clone, Args)]
pub struct SendOptions {
    /// The order: start, abort, pause, resume, unattended, goal or here.
    #[arg(value_parser = parse_order)]
    pub order: Order,
    /// With `goal`: the name of a task, of the place that is its goal, or of any place in the drawing, or a room by its position,
    /// as in `the room left of the kitchen`.
    #[arg(value_name = "NAME", num_args = 0.., conflicts_with_all = ["task", "state", "at"])]
    pub name: Vec<String>,
    /// The number of the task that the order refers to, from 1, for orders that refer to one.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub task: u32,
    /// With `resume`: the number of the landmark state, from 1, to which a lost robot was led and from which it
    /// continues.
    #[arg(long, value_name = "N", conflicts_with = "task", value_parser = clap::value_parser!(u32).range(1..))]
    pub state: Option<u32>,
    /// With `here`: the robot's position in the drawing, in image pixels (column, row; row 0 at the top).
    #[arg(long, value_name = "X,Y", value_parser = parse_drawn_place, conflicts_with_all = ["task", "state"])]
    pub at: Option<[f64; 2]>,
    /// With `here`: the robot's heading in the drawing, in degrees counter-clockwise from pointing right.
    #[arg(long, value_name = "DEG", value_parser = parse_heading, requires = "at", allow_negative_numbers = true)]
    pub heading: Option<f64>,
    /// The system's name; optional if only one is running.
    #[arg(long)]
    pub system: Option<String>,
    /// Maximum time to wait until the order appears on its channel, in seconds.
    #[arg(long, value_name = "SECONDS", default_value = "5", value_parser = parse_patience)]
    pub timeout: Duration,
    /// Print one JSON object instead of text.
    #[arg(long)]
    pub json: bool,
}

/// The options of `snapshot`.
#[derive(Debug, Clone, Args)]
pub struct SnapshotOptions {
    /// The system's name; optional if only one is running.
    #[arg(long)]
    pub system: Option<String>,
    /// How much to save, in recorded seconds up to now.
    #[arg(long, value_name = "S", default_value = "30", value_parser = parse_patience)]
    pub last: Duration,
    /// First wait for the next message on this channel, such as `faults` or `contact`.
    #[arg(long, value_name = "CHANNEL")]
    pub on: Option<String>,
    /// After the trigger, wait this long, in seconds, to include its effects.
    #[arg(long, value_name = "S", default_value = "0", value_parser = parse_patience)]
    pub after: Duration,
    /// Save only topics whose whole name matches this regular expression.
    #[arg(long, value_name = "PATTERN", value_parser = parse_pattern)]
    pub regex: Option<Regex>,
    /// Where to write the recording.
    #[arg(short, long, value_name = "MCAP")]
    pub output: PathBuf,
    /// Print one JSON object instead of text.
    #[arg(long)]
    pub json: bool,
}

/// The options of `graph`.
#[derive(Debug, Clone, Args)]
pub struct GraphOptions {
    /// Draw the channels of this running system, with their current rates.
    #[arg(long, conflicts_with = "kind")]
    pub system: Option<String>,
    /// Draw the channels of this kind of navigator.
    #[arg(long)]
    pub kind: Option<String>,
    /// Where to write the picture.
    #[arg(short, long, value_name = "SVG", default_value = "pipeline.svg")]
    pub output: PathBuf,
    /// Print one JSON object with the figures.
    #[arg(long)]
    pub json: bool,
}

fn parse_playback_rate(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|rate| (0.02..=64.0).contains(rate));
    rate.ok_or_else(|| "expected a number from 0.02 to 64".to_owned())
}

fn parse_part(text: &str) -> Result<Regex, String> {
    Regex::new(text).map_err(|error| format!("expected a regular expression: {error}"))
}

fn parse_order(text: &str) -> Result<Order, String> {
    text.parse()
}

/// Parses a heading in degrees and converts it to radians.
fn parse_heading(text: &str) -> Result<f64, String> {
    let degrees = text.parse().ok().filter(|degrees| ANGLE_DEG.holds(*degrees));
    let radians = degrees.map(f64::to_radians);
    radians.ok_or_else(|| format!("expected a heading, {}", ANGLE_DEG.words))
}

fn parse_patience(text: &str) -> Result<Duration, String> {
    let seconds = text.parse().ok().filter(|seconds| (0.0..=3600.0).contains(seconds));
    let seconds = seconds.ok_or("expected a number of seconds, from 0 to 3600")?;
    Ok(Duration::from_secs_f64(seconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heading_is_at_most_a_full_turn() {
        assert_eq!(parse_heading("-90"), Ok(-std::f64::consts::FRAC_PI_2));
        for wrong in ["", "up", "361", "nan"] {
            assert!(parse_heading(wrong).unwrap_err().contains("-360 to 360 degrees"), "{wrong}");
        }
    }

    #[test]
    fn patience_is_finite() {
        assert_eq!(parse_patience("0.5"), Ok(Duration::from_millis(500)));
        for wrong in ["-1", "inf", "nan", "soon", "4000"] {
            assert!(parse_patience(wrong).is_err(), "{wrong}");
        }
    }
}

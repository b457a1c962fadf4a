//! The command lines of the tools for recordings.

use std::ops::Range;
use std::path::PathBuf;

use anyhow::ensure;
use clap::{Args, Subcommand};
use regex_lite::Regex;
use sketchnav_recordings::diff::Tolerance;
use sketchnav_recordings::import::Rules;
use sketchnav_schemas::channels::NAVIGATORS;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::mission::Parameters;
use sketchnav_schemas::time::nanoseconds;

/// The tools for recordings.
#[derive(Debug, Subcommand)]
pub enum Tool {
    /// Play a recording into the channels of a system, for live tools and processes.
    #[command(
        after_help = "Keys: space pauses and continues, s takes one step, ←/→ (or h/l) jump 10 s, + and - change the rate, q ends.\nExit codes: 0 played, 2 bad input, 3 anything else.\nExample: sketchnav replay a.mcap --live localizer,planner,recorder --rate max --record again.mcap"
    )]
    Replay {
        /// The recording.
        file: PathBuf,
        #[command(flatten)]
        options: ReplayOptions,
    },
    /// Run a service's core again on the recorded inputs, and compare its messages with the recorded ones.
    #[command(
        after_help = "Exit codes: 0 identical, 1 different, 2 bad input, 3 anything else.\nExample: sketchnav rerun a.mcap --process localizer --set particles=500"
    )]
    Rerun {
        /// The recording.
        file: PathBuf,
        #[command(flatten)]
        options: RerunOptions,
    },
    /// Report how a mission went and how far the estimates were from the truth.
    #[command(
        after_help = "Exit codes: 0 done, 1 some task was not reached, 2 bad input, 3 anything else.\nExample: sketchnav judge a.mcap b.mcap --json"
    )]
    Judge {
        /// The recordings.
        #[arg(required = true)]
        files: Vec<PathBuf>,
        #[command(flatten)]
        options: JudgeOptions,
    },
    /// Show a recording as one self-contained HTML page.
    #[command(
        after_help = "Exit codes: 0 done, 2 bad input, 3 anything else.\nExample: sketchnav report a.mcap -o page.html"
    )]
    Report {
        /// The recording.
        file: PathBuf,
        /// The page.
        #[arg(short, long, value_name = "HTML")]
        output: PathBuf,
        /// A file (TOML) that maps rooms of the floor to rooms of the drawing.
        #[arg(long, value_name = "TOML")]
        rooms: Option<PathBuf>,
        /// Write the page even if it replaces a recording.
        #[arg(long)]
        force: bool,
        /// Print one JSON object instead of text.
        #[arg(long)]
        json: bool,
    },
    /// Learn from a drive by a drawing: the map of what the robot saw, the goals in it, and how it corresponds to the drawing. The
    /// next drive starts from it with `run --learned`. Drives by several drawings of one place are combined with `--with`.
    #[command(
        after_help = "Exit codes: 0 done (also if the recording is still being written), 2 bad input, 3 anything else.\nExample: sketchnav learn out/building-a-001 -o building.learned --svg corrected.svg\nExample: sketchnav run sim/missions/building/building-a.toml --learned building.learned\nExample: sketchnav learn a.learned --with b.learned -o both.learned"
    )]
    Learn {
        /// The recording, the folder of a run, or a learned map.
        file: PathBuf,
        #[command(flatten)]
        options: LearnOptions,
    },
    /// Convert a laser log of the CARMEN toolkit (.log or .log.gz) to a recording.
    #[command(
        after_help = "Exit codes: 0 done, 2 bad input, 3 anything else.\nExample: sketchnav import intel.log.gz --map intel.yaml -o intel.mcap"
    )]
    Import {
        /// The log.
        log: PathBuf,
        #[command(flatten)]
        options: ImportOptions,
    },
    /// Copy whatever can be read of a recording that is cut off or damaged.
    #[command(
        after_help = "Exit codes: 0 all of it, 1 error, 2 usage, 3 recovered with loss, or with damaged chunks.\nExample: sketchnav recover broken.mcap -o whole.mcap"
    )]
    Recover {
        /// The recording.
        file: PathBuf,
        #[command(flatten)]
        options: RecoverOptions,
    },
    /// Copy selected topics or a period of a recording.
    #[command(
        after_help = "Exit codes: 0 done, 1 error, 2 usage, 3 done, of a recording that was cut off or has damaged messages.\nExample: sketchnav filter a.mcap --topics scan,odometry --start 10 --end 20 -o part.mcap"
    )]
    Filter {
        /// The recording.
        file: PathBuf,
        #[command(flatten)]
        options: FilterOptions,
    },
    /// Merge several recordings into one, in order of time.
    #[command(
        after_help = "Exit codes: 0 done, 1 error, 2 usage, 3 done, of recordings of which one was cut off or has damaged messages.\nExample: sketchnav merge a.mcap b.mcap -o both.mcap"
    )]
    Merge {
        /// The recordings.
        #[arg(required = true, num_args = 2..)]
        files: Vec<PathBuf>,
        /// The merged recording.
        #[arg(short, long)]
        output: PathBuf,
        /// Print one JSON object instead of text.
        #[arg(long)]
        json: bool,
    },
    /// Split a recording into parts, each with the latched messages, or convert it to a rosbag2 folder.
    #[command(
        after_help = "Exit codes: 0 done, 1 error, 2 usage, 3 done, of a recording that was cut off or has damaged messages.\nExample: sketchnav split a.mcap --seconds 60 --rosbag2 -o bag"
    )]
    Split {
        /// The recording.
        file: PathBuf,
        #[command(flatten)]
        options: SplitOptions,
    },
}

/// The options of `learn`.
#[derive(Debug, Clone, Args)]
pub struct LearnOptions {
    /// Where to write what was learned; beside the recording if left out.
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Add what was learned on another drive in the same place, also by another drawing: a learned map, a recording, or the folder
    /// of a run. Can be repeated.
    #[arg(long, value_name = "FILE")]
    pub with: Vec<PathBuf>,
    /// Also write what the robot saw into this folder as a map of map_server: a YAML file and a PGM picture.
    #[arg(long, value_name = "DIR")]
    pub map_server: Option<PathBuf>,
    /// Also write a version of the drawing that is corrected by what the robot saw.
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    pub json: bool,
}

/// A period of a recording.
#[derive(Debug, Clone, Copy, Args)]
pub struct Times {
    /// Start at this recorded second.
    #[arg(long, value_name = "S", value_parser = parse_second, allow_hyphen_values = true)]
    pub start: Option<f64>,
    /// Stop before this recorded second.
    #[arg(long, value_name = "S", value_parser = parse_second, allow_hyphen_values = true)]
    pub end: Option<f64>,
}

impl Times {
    /// Returns the period in nanoseconds.
    ///
    /// # Errors
    /// If the period ends before it begins.
    pub fn ns(&self) -> anyhow::Result<Range<u64>> {
        let times = self.start.map_or(0, nanoseconds)..self.end.map_or(u64::MAX, nanoseconds);
        ensure!(!times.is_empty(), "expected --end after --start");
        Ok(times)
    }
}

fn parse_second(text: &str) -> Result<f64, String> {
    let second = text.parse().ok().filter(|s: &f64| s.is_finite() && *s >= 0.0);
    second.ok_or_else(|| "expected a number of seconds, 0 or above".to_owned())
}

/// The options of `replay`.
#[derive(Debug, Clone, Args)]
pub struct ReplayOptions {
    /// Recorded seconds per second, or `max`: as fast as the readers keep up.
    #[arg(long, default_value = "1", value_parser = parse_rate)]
    pub rate: Rate,
    #[command(flatten)]
    pub times: Times,
    /// Start again at the end; sequence numbers and timestamps continue.
    #[arg(long = "loop")]
    pub again: bool,
    /// Play only these channels, separated by commas.
    #[arg(long, value_delimiter = ',')]
    pub topics: Vec<String>,
    /// Play the recording's topic A into the channel B; may be repeated.
    #[arg(long, value_name = "A:=B", value_parser = parse_remap)]
    pub remap: Vec<(String, String)>,
    /// Wait for the space bar before the first message.
    #[arg(long)]
    pub paused: bool,
    /// Start these processes live, and play the messages of all others; separated by commas.
    #[arg(long, value_delimiter = ',', value_parser = crate::args::values::parse_service)]
    pub live: Vec<Process>,
    /// Where the live recorder writes its recording.
    #[arg(long, value_name = "MCAP")]
    pub record: Option<PathBuf>,
    /// The system's name.
    #[arg(long)]
    pub system: Option<String>,
}

/// The playback rate of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rate {
    /// As fast as the readers keep up.
    Max,
    /// Recorded seconds per second.
    Times(f64),
}

fn parse_rate(text: &str) -> Result<Rate, String> {
    if text == "max" {
        return Ok(Rate::Max);
    }
    let rate = text.parse().ok().filter(|rate: &f64| *rate > 0.0 && *rate <= 1000.0);
    rate.map(Rate::Times).ok_or_else(|| "expected `max`, or a number above 0 and up to 1000".to_owned())
}

fn parse_remap(text: &str) -> Result<(String, String), String> {
    let (from, to) = text.split_once(":=").ok_or("expected A:=B")?;
    let slashed = |name: &str| format!("/{}", name.trim_start_matches('/'));
    Ok((slashed(from), slashed(to)))
}

fn parse_range(text: &str) -> Result<f64, String> {
    let range = text.parse().ok().filter(|m: &f64| m.is_finite() && *m > 0.0);
    range.ok_or_else(|| "expected a number of metres above 0".to_owned())
}

fn parse_start(text: &str) -> Result<[f64; 3], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|word| word.trim().parse()).collect();
    let numbers = numbers.ok().and_then(|numbers| numbers.try_into().ok());
    numbers.ok_or_else(|| format!("expected COLUMN,ROW,HEADING, such as 120,340,90, found {text:?}"))
}

/// The options of `rerun`.
#[derive(Debug, Clone, Args)]
pub struct RerunOptions {
    /// The service: world, sketcher, localizer or planner.
    #[arg(long, value_parser = crate::args::values::parse_rerun)]
    pub process: Process,
    /// Set a parameter of the service, such as `particles=500`; may be repeated. The results are printed beside the
    /// recorded ones.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Ignore differences in this field up to this value, such as `estimate.pose.x_px=0.5`; may be repeated.
    #[arg(long = "tolerance", value_name = "CHANNEL.FIELD=NUMBER")]
    pub tolerances: Vec<Tolerance>,
    /// Write a copy of the recording in which the service's new messages replace the recorded ones.
    #[arg(short, long, value_name = "MCAP")]
    pub output: Option<PathBuf>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    pub json: bool,
}

impl RerunOptions {
    /// Parses the values of `--set` as parameters of the process.
    pub fn parameters(&self) -> Result<Parameters, String> {
        let mut all = Parameters::default();
        for line in &self.set {
            let word = line.split('.').next().unwrap_or_default().trim();
            let named = NAVIGATORS.iter().any(|process| process.word() == word);
            let line = if named { line.clone() } else { format!("{}.{line}", self.process.word()) };
            let parsed: Parameters = line.parse().map_err(|error| format!("--set {line}: {error}"))?;
            all.extend(&parsed);
        }
        Ok(all)
    }
}

/// The options of `judge`.
#[derive(Debug, Clone, Args)]
pub struct JudgeOptions {
    /// A file (TOML) that maps rooms of the floor to rooms of the drawing.
    #[arg(long, value_name = "TOML")]
    pub rooms: Option<PathBuf>,
    /// A file (TOML) that maps positions in the drawing to positions on the floor, such as
    /// sim/missions/routes/anchors.toml. Adds whether the robot's path was homotopic to the drawn route.
    #[arg(long, value_name = "TOML")]
    pub anchors: Option<PathBuf>,
    /// Write a line with each estimate and the truth to this file or, for several recordings, to a file each in this folder.
    #[arg(long, value_name = "CSV")]
    pub csv: Option<PathBuf>,
    /// Write the true and the estimated trajectory, in metres, into this folder in evo's format.
    #[arg(long, value_name = "DIR")]
    pub tum: Option<PathBuf>,
    /// Print one JSON array instead of tables.
    #[arg(long)]
    pub json: bool,
}

/// The options of `import`, which supply what a log does not contain.
#[derive(Debug, Clone, Args)]
pub struct ImportOptions {
    /// Localize the log in this map_server map, which determines both scales.
    #[arg(long, value_name = "YAML", required_unless_present = "sketch")]
    pub map: Option<PathBuf>,
    /// Localize the log in this drawing instead; needs --start.
    #[arg(long, value_name = "FILE", requires = "start")]
    pub sketch: Option<PathBuf>,
    /// Where the log begins in the drawing or the map, in image pixels and degrees: `COLUMN,ROW,HEADING`. Default in a
    /// map: the pose logged with the first scan.
    #[arg(long, value_name = "C,R,DEG", value_parser = parse_start, allow_hyphen_values = true)]
    pub start: Option<[f64; 3]>,
    /// Treat readings of this range or more as invalid, in metres. If a line of the log states a shorter maximum range,
    /// that one applies.
    #[arg(long, value_name = "M", default_value_t = Rules::default().range_max_m, value_parser = parse_range, allow_hyphen_values = true)]
    pub range_max: f64,
    /// Refuse a log if anything in it would be left out or is doubtful.
    #[arg(long)]
    pub strict: bool,
    /// The seed of the run created for the log.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Set a parameter, such as `localizer.particles=5000`; may be repeated.
    #[arg(long = "set", value_name = "SERVICE.KEY=VALUE")]
    pub set: Vec<Parameters>,
    /// The recording.
    #[arg(short, long)]
    pub output: PathBuf,
    /// Print one JSON object instead of text.
    #[arg(long)]
    pub json: bool,
}

impl JudgeOptions {
    /// Returns the files that `judge` reads besides the recordings.
    pub fn inputs(&self) -> impl Iterator<Item = &PathBuf> {
        self.rooms.iter().chain(&self.anchors)
    }
}

/// The options of `recover`.
#[derive(Debug, Clone, Args)]
pub struct RecoverOptions {
    /// Where to write the copy. It never replaces a recording with more messages.
    #[arg(short, long)]
    pub output: PathBuf,
    /// Also copy the messages of chunks whose checksum is wrong.
    #[arg(long)]
    pub keep_damaged: bool,
    /// Replace the output even if it contains more messages than the copy.
    #[arg(long)]
    pub force: bool,
    /// Print one JSON object instead of text.
    #[arg(long)]
    pub json: bool,
}

/// The options of `filter`.
#[derive(Debug, Clone, Args)]
pub struct FilterOptions {
    /// Copy only these topics, separated by commas.
    #[arg(long, value_delimiter = ',')]
    pub topics: Vec<String>,
    /// Copy only topics whose whole name, without the leading slash, matches this regular expression.
    #[arg(long, value_name = "PATTERN", value_parser = crate::args::values::parse_pattern, conflicts_with = "topics")]
    pub regex: Option<Regex>,
    #[command(flatten)]
    pub times: Times,
    /// Where to write the copy. It never replaces a source with more messages.
    #[arg(short, long)]
    pub output: PathBuf,
    /// Replace the source even if the copy has fewer messages.
    #[arg(long)]
    pub force: bool,
    /// Print one JSON object instead of text.
    #[arg(long)]
    pub json: bool,
}

/// The options of `split`.
#[derive(Debug, Clone, Args)]
pub struct SplitOptions {
    /// The length of each part, in recorded seconds.
    #[arg(long, value_name = "S", conflicts_with = "megabytes")]
    pub seconds: Option<f64>,
    /// The size of each part, in megabytes of messages before compression.
    #[arg(long, value_name = "MB")]
    pub megabytes: Option<f64>,
    /// Also write a rosbag2 metadata.yaml; without --seconds or --megabytes, write a single part.
    #[arg(long)]
    pub rosbag2: bool,
    /// Folder for the parts; created if missing.
    #[arg(short, long)]
    pub output: PathBuf,
    /// Print one JSON object instead of text.
    #[arg(long)]
    pub json: bool,
}

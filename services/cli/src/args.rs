//! The command line of `sketchnav`.

mod bridge;
mod system;
mod tools;
pub mod values;

use std::ops::RangeInclusive;
use std::path::PathBuf;

use clap::builder::PossibleValuesParser;
use clap::{ArgMatches, Args, Parser, Subcommand};
use sketchnav_lab::experiments::{studies, suites};
use sketchnav_schemas::channels::{EXTRAS, SERVICES, words};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::mission::Parameters;
use sketchnav_schemas::run::Pace;

#[cfg(any(feature = "ros2", feature = "zenoh"))]
pub use self::bridge::parse_domain;
pub use self::bridge::{Other, Rmw, Ros2Options, parse_rmw};
pub use self::system::{PadOptions, PadSite, RunOptions, SystemOptions};
pub use self::tools::{
    EchoOptions, GraphOptions, HzOptions, LogsOptions, RestartOptions, SendOptions, SnapshotOptions, Tap,
    ViewOptions,
};
pub use self::values::FloorPlace;
use self::values::{parse_degree, parse_floor_place, parse_served, parse_service, parse_speed};
pub use crate::directions::DirectionsOptions;
use crate::eval::all::WORD as ALL;
use crate::eval::{Simulator, parse_jobs};
pub use crate::relations::RelationsOptions;

fn experiments() -> PossibleValuesParser {
    suites::names().chain(studies::names()).chain([ALL]).collect::<Vec<_>>().into()
}

/// Drives a robot by a drawing, a sketched route or directions.
#[derive(Debug, Parser)]
#[command(
    name = "sketchnav",
    version,
    disable_version_flag = true,
    disable_help_subcommand = true,
    about,
    after_help = "Example: sketchnav run my-floor.toml --seed 3 --out results\nWithout a subcommand the demo mission runs. `sketchnav help` also lists the pages of the documentation."
)]
pub struct Cli {
    /// Print the version, the commit if it was given to the build, and the build number.
    #[arg(short = 'V', long)]
    pub version: bool,
    /// The subcommand.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// Returns true if the command was given a `--json` that makes standard output a single JSON object. Commands whose
/// `--json` prints one object per line give that option another id, so they are not counted.
pub fn wants_json(command: &ArgMatches) -> bool {
    let is_given = command.try_get_one::<bool>("json").is_ok_and(|json| json == Some(&true));
    is_given || command.subcommand().is_some_and(|(_, command)| wants_json(command))
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a mission: start its processes, drive to its goals, record everything.
    #[command(
        override_usage = "sketchnav run [OPTIONS] <MISSION>\n       sketchnav run --resume <DIR> [OPTIONS]",
        after_help = "Exit codes: 0 all tasks reached, 1 some not, 2 bad input, 3 anything else, 4 all reached but the recording is incomplete.\nExample: sketchnav run sim/missions/laboratory/laboratory-a.toml --speed 2 --json"
    )]
    Run {
        /// The mission file (TOML; `sketchnav help missions` says how to write one), or `demo`.
        #[arg(required_unless_present = "resume", conflicts_with = "resume")]
        mission: Option<PathBuf>,
        /// Continue the mission recorded in this folder after its supervisor was killed. Seed, pace and processes are
        /// those of the original run.
        #[arg(long, value_name = "DIR", conflicts_with_all = ["speed", "seed", "method", "out", "system", "without", "faults", "split_size", "split_duration", "learned"])]
        resume: Option<PathBuf>,
        #[command(flatten)]
        options: RunOptions,
    },
    /// Run the demo mission: a corridor with rooms, nine tasks from a hand-drawn sketch.
    #[command(after_help = "Example: sketchnav demo --seed 4 --out results")]
    Demo {
        #[command(flatten)]
        options: RunOptions,
    },
    /// Serve a page on which people draw a map and a path, and drive the robot by their drawing in real time.
    #[command(
        after_help = "Ends with Ctrl-C. Exit codes: 0 ended by a person, 2 bad input, 3 anything else (including files of a study that cannot be read), 4 the recording is incomplete.\nExample: sketchnav pad --mission sim/missions/laboratory/laboratory-a.toml --port 8000\nExample, a user study: sketchnav pad --mission sim/missions/routes/court-01.toml --study study\nTo write its pages again: sketchnav pad --study study --report"
    )]
    Pad {
        #[command(flatten)]
        options: PadOptions,
    },
    /// Run an experiment: drive every trial of a suite and count how the tasks ended.
    #[command(
        after_help = "Exit codes: 0 done, 1 processes sent different messages, 2 bad input (missing data, nothing to drive), 3 anything else.\nExample: sketchnav eval people --data ~/data --sample 4 --verbose\nExample, on many machines: sketchnav eval building --job 3 -o parts/3.json; then: sketchnav eval building --merge parts"
    )]
    Eval {
        /// A suite of drives, a study, or `all`, which runs every suite and study into the folder given by --output and
        /// skips those already there.
        #[arg(value_parser = experiments())]
        suite: String,
        #[command(flatten)]
        options: EvalOptions,
    },
    /// Draw a floor with the distortions of a hand-drawn map: out of proportion, doors shifted, no furniture.
    #[command(
        after_help = "Exit codes: 0 done, 2 bad input, 3 anything else.\nExample: sketchnav deform sim/missions/building/building.floor.toml --degree 1 --seed 3 -o drawing.png\nExample: sketchnav deform sim/missions/building/building.floor.toml --place 2.0,6.95,0 --place 14.0,10.6 -o drawing.png"
    )]
    Deform {
        /// A floor plan (.toml) or a map_server map (.yaml).
        map: PathBuf,
        #[command(flatten)]
        options: DeformOptions,
    },
    /// Run a mission twice, kill its processes during the second run, and compare the two.
    #[command(
        after_help = "Exit codes: 0 if identical and the robot safe, 1 otherwise, 2 bad input, 3 anything else.\nHow the mission went, and whether it ended before all kills, is reported as text and in --json.\nEvery run writes its schedule.toml, which --schedule repeats.\nExample: sketchnav chaos sim/missions/building/building-a.toml --kills 30 --targets world,localizer\nExample: sketchnav chaos demo --at-messages --signal kill,starve --kills 6\nExample: sketchnav chaos demo --schedule out/chaos-001/schedule.toml"
    )]
    Chaos {
        /// The mission file (TOML), or `demo`.
        mission: PathBuf,
        #[command(flatten)]
        options: ChaosOptions,
    },
    /// Run one process of a running system by hand, such as one left out by `run --without`.
    #[command(after_help = "Example: sketchnav serve localizer --system lab")]
    Serve {
        /// A process of a run.
        #[arg(value_parser = parse_served, help = format!("One of {}", words(SERVICES.into_iter().chain(EXTRAS))))]
        process: Process,
        /// The system's name, as `sketchnav ps` lists it.
        #[arg(long)]
        system: String,
        /// Options of the pad.
        #[command(flatten)]
        site: PadSite,
        /// The folder of the pad's study.
        #[arg(long, value_name = "DIR")]
        study: Option<PathBuf>,
    },
    /// List the running systems and their processes.
    Ps {
        /// Print one JSON list instead of a table.
        #[arg(long)]
        json: bool,
    },
    /// List the channels with their messages, writers and readers, in pipeline order. For a running system, also list
    /// the connected processes, the number of messages in each history, and the rates.
    #[command(
        after_help = "Exit codes: 0 done, 2 bad input (no such system or kind), 3 anything else.\nExample: sketchnav channels --kind sketch\nExample: sketchnav channels lab --json"
    )]
    Channels {
        /// The name of a running system.
        #[arg(conflicts_with = "kind")]
        system: Option<String>,
        /// List only the channels of this kind of navigator.
        #[arg(long)]
        kind: Option<String>,
        /// Print one JSON list instead of a table.
        #[arg(long)]
        json: bool,
    },
    /// Draw the pipeline as SVG: processes, channels, writers and readers. For a running system, add the rates of the
    /// last second.
    #[command(
        after_help = "Exit codes: 0 drawn, 2 bad input, 3 anything else.\nExample: sketchnav graph --system lab -o lab.svg"
    )]
    Graph {
        #[command(flatten)]
        options: GraphOptions,
    },
    /// Check whether this machine can run a system: shared memory, permissions, limits, leftovers, versions, clock.
    #[command(
        after_help = "Every warning and every error comes with advice.\nExit codes: 0 no error (there may be warnings), 1 an error: no system can run here.\nExample: sketchnav doctor --json"
    )]
    Doctor {
        /// Print one JSON object instead of lines.
        #[arg(long)]
        json: bool,
    },
    /// Remove what dead systems have left behind: processes, folders, shared memory. Running systems are not affected.
    #[command(
        after_help = "A removed system cannot be resumed.\nStarting another system cleans up as well.\nExample: sketchnav clean"
    )]
    Clean {
        /// Print one JSON object instead of lines.
        #[arg(long)]
        json: bool,
    },
    /// Show the processes of a running system: state, restarts, rates, step times. Keys kill, stop and continue them.
    #[command(after_help = "Example: sketchnav top --json")]
    Top {
        #[command(flatten)]
        options: TopOptions,
    },
    /// Show a running system or a recording in Foxglove or Lichtblick, by serving their WebSocket protocol on this machine.
    #[command(
        after_help = "Ends with Ctrl-C, or with the system. Open the printed ws:// link in the viewer; docs/foxglove-layout.json is a layout.\nExit codes: 0 ended, 2 bad input (no such system, no recording, the port is taken), 3 anything else.\nExample: sketchnav view lab\nExample: sketchnav view results/building-a.mcap --rate 4 --port 9000"
    )]
    View {
        #[command(flatten)]
        options: ViewOptions,
    },
    /// Print the messages of a channel, one JSON object per line: first those of its history, then new ones as they
    /// arrive. With `--file`, print those of a recording.
    #[command(
        after_help = "Exit codes: 0 done, 2 bad input (no such channel or field), 3 anything else.\nExample: sketchnav echo estimate --count 10\nExample: sketchnav echo odometry --csv --field pose.pose.position.x --field pose.pose.position.y\nExample: sketchnav echo --regex 'scan|odo.*' --once\nExample: sketchnav echo status --once --file results/building-a.mcap"
    )]
    Echo {
        #[command(flatten)]
        options: EchoOptions,
    },
    /// Measure the rate of a channel, its bandwidth, and percentiles of intervals and delays.
    #[command(
        after_help = "The delay of a message is the time since the tick that caused it, by the clock.\nExamples: sketchnav hz estimate --json; sketchnav hz odom --file bag"
    )]
    Hz {
        #[command(flatten)]
        options: HzOptions,
    },
    /// Print the output of a running system's processes.
    #[command(
        after_help = "When a run has ended, the folder `logs` beside its recording contains the same lines.\nExample: sketchnav logs --follow localizer planner"
    )]
    Logs {
        #[command(flatten)]
        options: LogsOptions,
    },
    /// End a process of a running system and wait for its successor, which resumes where it left off.
    #[command(
        after_help = "Exit codes: 0 the successor has joined, 2 bad input (no such process), 3 anything else.\nExample: sketchnav restart localizer --system lab"
    )]
    Restart {
        #[command(flatten)]
        options: RestartOptions,
    },
    /// Give a running mission one order by hand: start, abort, pause, resume, unattended, goal or here.
    #[command(
        after_help = "The supervisor forwards the order, so this works alongside a pad, and the order is recorded.\nExit codes: 0 sent, 2 bad input, 3 anything else.\nExample: sketchnav send pause --system lab\nExample, to go to the third task now: sketchnav send goal --task 3\nExample, to go to the kitchen, which a task or the drawing names: sketchnav send goal kitchen\nExample, to go to a room without a name: sketchnav send goal the room left of the kitchen\nExample, to set the robot's position in the drawing: sketchnav send here --at 520,90"
    )]
    Send {
        #[command(flatten)]
        options: SendOptions,
    },
    /// Print the parameters in force in a running system, including defaults.
    #[command(
        after_help = "A parameter is set at the start of a run: in the mission, or tried on a recording by `rerun --set`.\nExit codes: 0 done, 2 bad input, 3 anything else.\nExample: sketchnav param get localizer.beams --system lab"
    )]
    Param {
        #[command(subcommand)]
        what: Param,
    },
    /// Save the last seconds of a running system's recording, now or when a message arrives on a channel.
    #[command(
        after_help = "The copy is a separate recording that includes the latched messages; the system keeps recording.\nExit codes: 0 done, 2 bad input, 3 anything else.\nExample: sketchnav snapshot --last 20 -o moment.mcap\nExample: sketchnav snapshot --on contact --after 2 -o bump.mcap"
    )]
    Snapshot {
        #[command(flatten)]
        options: SnapshotOptions,
    },
    /// Pass a running system's messages to other software, on this host or on others.
    Bridge {
        #[command(subcommand)]
        other: Other,
    },
    /// Compare two recordings, every message of every channel byte for byte (health, faults and latency are left out).
    #[command(
        after_help = "Exit codes: 0 identical, 1 different, 2 unreadable.\nExample: sketchnav diff a.mcap b.mcap"
    )]
    Diff {
        /// A recording.
        a: PathBuf,
        /// Another recording.
        b: PathBuf,
        /// Print one JSON object instead of text.
        #[arg(long)]
        json: bool,
    },
    /// Show what a recording contains. Quick even for a long file, if it was closed properly.
    #[command(after_help = "Example: sketchnav info results/building-a.mcap --json")]
    Info {
        /// The recording, or a folder of recordings.
        file: PathBuf,
        /// Print one JSON object instead of text.
        #[arg(long)]
        json: bool,
    },
    /// Compute the qualitative relations of objects over time: motion towards each other, direction, distance, contact.
    #[command(
        after_help = "A table has the columns time_s, object, x_m, y_m and may have heading_deg, length_m, width_m.\nExit codes: 0 done, 2 bad input, 3 anything else.\nExample: sketchnav relations results/building-a.mcap --calculus qtc-b --between robot,person-1 --quantisation-m 0.01"
    )]
    Relations {
        /// A table of positions (.csv), or a recording (.mcap).
        file: PathBuf,
        #[command(flatten)]
        options: RelationsOptions,
    },
    /// Print the landmark states of a mission's sketch in words, in the format of a `route_file`.
    #[command(
        after_help = "Exit codes: 0 done, 2 bad input, 3 anything else.\nExample: sketchnav landmarks sim/missions/landmarks/scene-a-states.toml > route.txt\nExample: sketchnav landmarks my-route.toml --smooth smoother.json"
    )]
    Landmarks {
        /// A mission of kind `landmarks`.
        mission: PathBuf,
        /// Print the states as a table (Chronis 2007, table 4.1) instead of words.
        #[arg(long)]
        table: bool,
        /// Write the sketch with a smoother route into this file, as a proposal. The route keeps its ends, and passes each object
        /// on the same side.
        #[arg(long, value_name = "FILE", conflicts_with = "table")]
        smooth: Option<PathBuf>,
    },
    /// Print what the map-maker derives from a mission with directions: itineraries, landmarks, the transition matrix.
    #[command(
        after_help = "Exit codes: 0 done, 2 bad input, 3 anything else.\nExample: sketchnav directions sim/missions/directions/hundred.toml --method d-r\nExample: sketchnav directions sim/missions/directions/hundred.toml --table landmarks --only reliable=0.95"
    )]
    Directions {
        /// A mission of kind `directions`.
        mission: PathBuf,
        #[command(flatten)]
        options: DirectionsOptions,
    },
    /// Print the completion script for a shell.
    #[command(
        after_help = "Exit codes: 0 done, 2 built without them, 3 anything else.\nExample: sketchnav completions bash > ~/.local/share/bash-completion/completions/sketchnav"
    )]
    Completions {
        /// The shell.
        #[arg(value_enum)]
        shell: Shell,
    },
    /// Write the manual pages, one per subcommand, into a folder.
    #[command(
        after_help = "Exit codes: 0 done, 2 built without them or no such folder, 3 anything else.\nExample: sketchnav man ~/.local/share/man/man1"
    )]
    Man {
        /// The folder; created if missing.
        folder: PathBuf,
    },
    /// Show the help of a command or a page of the documentation; without a topic, list both.
    #[command(
        after_help = "On a terminal, pages are shown by the program in PAGER, or by less. If a command and a page have the same name, both are shown.\nExit codes: 0 shown, 2 no such topic, 3 anything else.\nExample: sketchnav help missions\nExample: sketchnav help bridge ros2"
    )]
    Help {
        /// A command, or a page: its name or its path, such as docs/missions.md.
        topic: Vec<String>,
    },
    /// Tools for recordings.
    #[command(flatten)]
    Recordings(crate::recordings::args::Tool),
}

/// The subcommands of `param`.
#[derive(Debug, Clone, Subcommand)]
pub enum Param {
    /// Print all parameters, one per line.
    List {
        #[command(flatten)]
        options: ParamOptions,
    },
    /// Print the value of one parameter.
    Get {
        /// The parameter's process and key, such as `localizer.beams`.
        #[arg(value_name = "PROCESS.KEY")]
        key: String,
        #[command(flatten)]
        options: ParamOptions,
    },
}

/// The options of `param`.
#[derive(Debug, Clone, Args)]
pub struct ParamOptions {
    /// The system's name; optional if only one is running.
    #[arg(long)]
    pub system: Option<String>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// The options of `deform`.
#[derive(Debug, Clone, Args)]
pub struct DeformOptions {
    /// Degree of distortion: 0 leaves the walls as they are, 1 distorts them as people do; at most 3.
    #[arg(long, default_value_t = 1.0, value_parser = parse_degree)]
    pub degree: f64,
    /// The seed; each seed gives a different drawing.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Where to write the drawing: strokes (.json), .svg or .png.
    #[arg(short, long, default_value = "sketch.json")]
    pub output: PathBuf,
    /// Print where this position on the floor lies in the drawing: metres and, for a start, a heading in degrees. May
    /// be repeated.
    #[arg(long = "place", value_name = "X,Y[,DEG]", value_parser = parse_floor_place, allow_hyphen_values = true)]
    pub places: Vec<FloorPlace>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    pub json: bool,
}

/// The options of `eval`.
#[derive(Debug, Clone, Args)]
pub struct EvalOptions {
    /// One or more methods of the suite's kind of navigator, separated by commas; an unknown name lists all of them.
    /// Default: the suite's methods, otherwise the default method of that kind.
    #[arg(long = "method", value_delimiter = ',')]
    pub methods: Vec<String>,
    /// Repetitions of each trial, each with its own seed. Default: set by the suite.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub trials: Option<u32>,
    /// The seed from which all others are derived.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Number of trials to drive at a time. Default: the number of cores. Does not affect the results.
    #[arg(long)]
    pub jobs: Option<usize>,
    /// Drive only these drawings, separated by commas.
    #[arg(long, value_delimiter = ',')]
    pub drawings: Vec<String>,
    /// Set a parameter in all trials, such as `localizer.beams=60` or `planner.footprint_padding_m=0.1`; may be
    /// repeated.
    #[arg(long = "set", value_name = "SERVICE.KEY=VALUE")]
    pub parameters: Vec<Parameters>,
    /// Also print a table of what the drives cost: commands, messages, processor time, energy.
    #[arg(long)]
    pub cost: bool,
    /// Drive at most this many trials of each drawing, the same ones every time.
    #[arg(long)]
    pub sample: Option<usize>,
    /// With `eval all`: run only these suites and studies, separated by commas.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub suites: Vec<String>,
    /// With `eval all`: fill in the figures of this page, and store them as JSON beside it; may be repeated. Further
    /// pages use the figures stored beside the first.
    #[arg(long = "page", value_name = "FILE")]
    pub pages: Vec<PathBuf>,
    /// Drive only this trial, named as `--verbose` and `--json` name it.
    #[arg(long, value_name = "TRIAL")]
    pub only: Option<String>,
    /// List each task that failed, and why.
    #[arg(long)]
    pub verbose: bool,
    /// List the jobs with their numbers instead of driving them.
    #[arg(long, conflicts_with_all = ["job", "merge", "output"])]
    pub list_jobs: bool,
    /// Drive only the job with this number, or a range such as 3-10, and write the outcomes to --output for --merge.
    #[arg(long, value_name = "K", value_parser = parse_jobs, requires = "output", conflicts_with_all = ["merge", "check_processes", "pictures"])]
    pub job: Option<RangeInclusive<usize>>,
    /// Drive nothing; merge the parts (.json) in this folder, which together contain the outcomes of all jobs. Give the
    /// same options as for the jobs.
    #[arg(long, value_name = "DIR")]
    pub merge: Option<PathBuf>,
    /// Also accept parts from another kind of machine, or from another build of the program.
    #[arg(long, value_enum, value_name = "WHAT", value_delimiter = ',', requires = "merge")]
    pub accept: Vec<Foreign>,
    /// Write all figures, with pictures of some of the tasks, as one HTML page; with --job, write the part.
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Draw each trial into this folder.
    #[arg(long, value_name = "DIR")]
    pub pictures: Option<PathBuf>,
    /// Also drive this many of the trials with separate processes, and compare every message.
    #[arg(long, value_name = "N")]
    pub check_processes: Option<usize>,
    /// Drive in a simulator that is not part of this project, by its driver in `examples`, instead of in the project's own
    /// world.
    #[arg(long, value_enum, value_name = "SIMULATOR", conflicts_with_all = ["check_processes", "pictures"])]
    pub world: Option<Simulator>,
    /// With --world: the Python interpreter that has the simulator and the package sketchnav.
    #[arg(long, value_name = "PROGRAM", default_value = "python3", requires = "world")]
    pub python: PathBuf,
    /// Folder of the maps and drawings that are not part of the project. Default: the value of the environment variable
    /// SKETCHNAV_DATA.
    #[arg(long, value_name = "DIR")]
    pub data: Option<PathBuf>,
    /// A checkout of sketchnav, for the missions that suites drive. Default: the one that contains the current folder.
    #[arg(long, value_name = "DIR")]
    pub project: Option<PathBuf>,
    /// Print one JSON object instead of tables.
    #[arg(long)]
    pub json: bool,
}

impl EvalOptions {
    /// Returns the number of trials to drive at a time, at least 1.
    pub fn jobs(&self) -> usize {
        let cores = || std::thread::available_parallelism().map_or(1, usize::from);
        self.jobs.unwrap_or_else(cores).max(1)
    }
}

/// A difference between this program on this machine and the origin of a part, which the user may accept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Foreign {
    /// Another kind of machine, whose outcomes may differ in the last bits.
    Machine,
    /// Another version or build of the program.
    Program,
}

/// The options of `chaos`.
#[derive(Debug, Clone, Args)]
pub struct ChaosOptions {
    /// The number of kills.
    #[arg(long, default_value_t = 20)]
    pub kills: u32,
    /// The mission's seed, which also determines the kills.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Apply the faults of this file (TOML), written by chaos or by hand, instead of random kills.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["kills", "targets", "signal", "at_start_up", "at_messages"])]
    pub schedule: Option<PathBuf>,
    /// Kill processes before randomly chosen messages instead of at random times, so that the schedule can be repeated exactly.
    #[arg(long, conflicts_with = "at_start_up")]
    pub at_messages: bool,
    /// The processes that may be killed, separated by commas.
    #[arg(long, value_delimiter = ',', value_parser = parse_service, default_values_t = SERVICES)]
    pub targets: Vec<Process>,
    /// What to do to the targets, separated by commas; one is chosen at random each time. kill: kill at once, in the
    /// middle of whatever the process is doing. stop: stop the process, which the supervisor has to detect. term: ask
    /// the process to end. starve: limit it to 2 to 50 % of the processor for 0.2 to 2 s; needs `--at-messages`.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "kill")]
    pub signal: Vec<KillSignal>,
    /// Also kill processes while they start, up to three times in a row.
    #[arg(long)]
    pub at_start_up: bool,
    /// `max`: in lockstep, as fast as possible; a number: simulated seconds per second (1 is real time).
    #[arg(long, default_value = "max", value_parser = parse_speed)]
    pub speed: Pace,
    /// Folder for both recordings; created if missing.
    #[arg(long, default_value = "out")]
    pub out: PathBuf,
    /// Print one JSON object instead of text.
    #[arg(long)]
    pub json: bool,
}

/// A shell with support for completions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Shell {
    /// Bourne Again shell.
    Bash,
    /// Elvish.
    Elvish,
    /// Friendly Interactive shell.
    Fish,
    /// PowerShell.
    Powershell,
    /// Z shell.
    Zsh,
}

/// How `chaos` disturbs a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum KillSignal {
    /// SIGKILL.
    Kill,
    /// SIGSTOP.
    Stop,
    /// SIGTERM.
    Term,
    /// SIGSTOP and SIGCONT in turn.
    Starve,
}

/// The options of `top`.
#[derive(Debug, Clone, Args)]
pub struct TopOptions {
    /// The system's name; optional if only one is running.
    #[arg(long)]
    pub system: Option<String>,
    /// Print the view once, after a second, and exit.
    #[arg(long)]
    pub once: bool,
    /// Print the view once, as one JSON object.
    #[arg(long)]
    pub json: bool,
}

#[cfg(test)]
impl EvalOptions {
    /// Parses the words that follow `eval SUITE`.
    pub fn of_words(words: &[&str]) -> Self {
        use clap::FromArgMatches;
        let line = Self::augment_args(clap::Command::new("eval").no_binary_name(true));
        Self::from_arg_matches(&line.get_matches_from(words)).unwrap()
    }
}

#[cfg(test)]
impl ChaosOptions {
    /// Parses the words that follow `chaos`.
    pub fn of_words(words: &[&str]) -> Self {
        use clap::FromArgMatches;
        let line = Self::augment_args(clap::Command::new("chaos").no_binary_name(true));
        Self::from_arg_matches(&line.get_matches_from(words)).unwrap()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }

    #[test]
    fn a_program_reads_the_output_of_a_command_with_json() {
        use clap::CommandFactory;
        let wants = |line: &str| wants_json(&Cli::command().try_get_matches_from(line.split(' ')).unwrap());
        for line in ["ps", "run x.toml", "param list", "judge x.mcap", "merge x.mcap y.mcap -o z.mcap"] {
            let line = format!("sketchnav {line}");
            assert!(!wants(&line) && wants(&format!("{line} --json")), "{line}");
        }
        for line in ["sketchnav", "sketchnav hz scan --json", "sketchnav logs --json"] {
            assert!(!wants(line), "{line}");
        }
    }
}

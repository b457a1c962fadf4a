//! `sketchnav` drives a robot through places that nobody has surveyed, by a drawing, a route past landmarks, or directions. This
//! crate is the command line, and its building blocks are separate libraries.
//!
//! | to | take |
//! |---|---|
//! | write a navigator | [`sketchnav_stage`], with an example [`Stage`](sketchnav_stage::Stage); [`Navigator`]; [`main_with`] |
//! | see which process sends what to which | [`sketchnav_schemas::channels`]; messages in [`sketchnav_schemas::message`] |
//! | drive a mission in a test, without processes | [`sketchnav_rehearsal`] |
//! | read, repair or compare recordings | [`sketchnav_recordings`] |
//! | compute qualitative relations of objects | [`sketchnav_qualitative`]: no robot in it |
//! | write a robot's driver, or read a running system | [`sketchnav_runtime`]: `Node`, `System` |
//! | simulate a robot, a laser, people | [`sketchnav_sim`] |
//! | judge runs and drive experiments | [`sketchnav_lab`] |
//! | read drawings, localize and plan in them | [`sketchnav_sketch`] |
//!
//! The README explains what `sketchnav` is and how to run it, `docs/` how to use it, and `ARCHITECTURE.md`
//! how it is built.
//!
//! # A mission in one process
//!
//! A mission can also run in a single process, with the same stages and the same messages, byte for byte, as
//! with separate processes. An [`Onlooker`](sketchnav_rehearsal::Onlooker) sees every message and can end the
//! mission.
//!
//! ```
//! use sketchnav_rehearsal::{Onlooker, Rehearsal, Tap};
//! use sketchnav_schemas::channels::{COMMAND, ChannelSpec};
//! use sketchnav_schemas::run::RunConfig;
//!
//! struct Commands(u64);
//!
//! impl Tap for Commands {
//!     fn see(&mut self, channel: &'static ChannelSpec, message: &[u8], _: &[u8]) {
//!         if let Some(command) = COMMAND.message(channel, message) {
//!             self.0 += u64::from(command.twist.vx_mps > 0.0);
//!         }
//!     }
//! }
//!
//! impl Onlooker for Commands {}
//!
//! let path = concat!(env!("CARGO_MANIFEST_DIR"), "/sim/missions/corridor/corridor-qtc.toml");
//! let (mission, robot) = sketchnav_sim::mission_file::load(path.as_ref())?;
//! let mut ahead = Commands(0);
//! Rehearsal::new(&RunConfig::lockstep("example", mission, robot, 1))?.run(&mut ahead)?;
//! assert!(ahead.0 > 100);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The pipeline
//!
//! ```
//! use sketchnav_schemas::channels;
//! use sketchnav_schemas::codes::Process;
//!
//! let names: Vec<_> = channels::written_by(Process::Planner, "corridor").map(|channel| channel.name).collect();
//! assert_eq!(names, ["command", "status"]);
//! let scan = channels::find("scan").expect("a channel of this name");
//! assert!(scan.may_read(Process::Localizer) && !scan.may_write(Process::Localizer));
//! ```
//!
//! # A recording
//!
//! ```no_run
//! use sketchnav_recordings::reader::Recording;
//! use sketchnav_schemas::channels::SCAN;
//!
//! let recording = Recording::open("out/demo-001/building-a.mcap".as_ref())?;
//! for scan in recording.channel(SCAN)?.between(60_000_000_000..65_000_000_000) {
//!     let (scan, _cells) = scan?;
//!     println!("{} beams at {} s", scan.beam_count, scan.header.stamp_ns as f64 * 1e-9);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Relations
//!
//! ```
//! use sketchnav_qualitative::{Options, Point, qtc, series};
//!
//! let at = |x: f64, y: f64| Point::new(x, y).expect("finite numbers");
//! let scenes = [[at(0.0, 0.0), at(5.0, 0.0)], [at(1.0, 0.0), at(4.0, 0.0)]];
//! let samples = scenes.into_iter().enumerate().map(|(i, scene)| (i as f64, Some(scene)));
//! let found = series(qtc::Basic::default(), Options::default(), samples)?;
//! assert_eq!(found[0].relation.to_string(), "-,-"); // both approach
//! # Ok::<(), sketchnav_qualitative::Error>(())
//! ```
//!
//! # A program with your own navigator
//!
//! A `main` that calls [`main_with`] is a complete `sketchnav` that includes your own navigators. `docs/write-a-navigator.md` walks
//! through such a program, `tests/stranger/wall_follower.rs`.

// All printing goes through `output`, which escapes any text that could control a terminal.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod args;
mod bridge;
mod channels;
mod chaos;
mod deform;
mod directions;
mod doctor;
mod doubts;
mod eval;
mod failure;
mod folder;
mod graph;
mod help;
mod landmarks;
mod launch;
mod link;
mod live;
mod logs;
#[cfg_attr(not(feature = "manuals"), path = "manuals/absent.rs")]
mod manuals;
mod mission;
mod notify;
mod output;
mod pad;
mod param;
mod poses;
mod recordings;
mod relations;
mod report;
mod serve;
mod step_in;
mod study;
mod systems;
mod tap;
mod tools;
mod top;
mod view;
mod warnings;

use std::ffi::OsString;
use std::process::ExitCode;
use std::sync::OnceLock;

use clap::{CommandFactory, FromArgMatches, Parser};
use nix::sys::signal::{SigHandler, Signal, signal};
use sketchnav_stage::Navigator;
pub use sketchnav_supervisor::start_by;

use args::{Cli, Command};
use failure::{Failure, Outcome, exit_code};

/// Reads the command line and runs the command.
pub fn main() -> ExitCode {
    main_with(&[])
}

/// Like [`main`], but also registers your own navigators.
pub fn main_with(navigators: &'static [Navigator]) -> ExitCode {
    ExitCode::from(run(navigators, std::env::args_os().collect()))
}

/// Like [`main_with`], but takes the command line as words, the first of which is the program's name, and
/// returns the exit code. If a program is not started by its own executable, it must first call [`start_by`].
pub fn run(navigators: &'static [Navigator], words: Vec<OsString>) -> u8 {
    let words = WORDS.get_or_init(|| words);
    // This must come before anything that needs a lot of stack.
    if let Err(error) = sketchnav_runtime::provide_stack() {
        return exit_code(Err(Failure::Other(error.into())), false);
    }
    ignore_file_size_signal();
    if let Err(error) = sketchnav_navigators::register(navigators) {
        return exit_code(Err(Failure::Other(error.into())), false);
    }
    match parse(words) {
        Ok((cli, wants_json)) => exit_code(dispatch(cli), wants_json),
        Err(error) => failure::refuse_usage(&error, words),
    }
}

/// The words of the command line.
static WORDS: OnceLock<Vec<OsString>> = OnceLock::new();

/// Parses the command line. Also returns whether standard output must be a single JSON object.
fn parse(words: &[OsString]) -> clap::error::Result<(Cli, bool)> {
    let matches = Cli::command().try_get_matches_from(words)?;
    let cli = Cli::from_arg_matches(&matches).map_err(|error| error.format(&mut Cli::command()))?;
    Ok((cli, args::wants_json(&matches)))
}

/// Ignores SIGXFSZ, which would end the process without a message. A write beyond `ulimit -f` then fails with an error,
/// as on a full disk. Processes started by this program ignore the signal too.
fn ignore_file_size_signal() {
    // SAFETY: no handler runs. The call can only fail for invalid signals.
    let _ = unsafe { signal(Signal::SIGXFSZ, SigHandler::SigIgn) };
}

/// Returns the definition of the command line, for documentation and completions.
pub fn command_line() -> clap::Command {
    Cli::command()
}

fn dispatch(cli: Cli) -> Result<Outcome, Failure> {
    if cli.version {
        output::out!("sketchnav {}", eval::machine::build()?)?;
        return Ok(Outcome::Success);
    }
    match cli.command {
        None => dispatch(Cli::parse_from(["sketchnav", "demo"])),
        Some(Command::Demo { options }) => mission::demo(&options),
        Some(Command::Run { resume: Some(folder), options, .. }) => mission::resume(&folder, &options),
        Some(Command::Run { mission, options, .. }) => match mission {
            Some(mission) if mission::is_demo(&mission) => mission::demo(&options),
            Some(mission) => mission::run(&mission, &options),
            None => mission::demo(&options),
        },
        Some(Command::Pad { options }) => pad::pad(&options),
        Some(Command::Eval { suite, options }) => eval::eval(&suite, &options),
        Some(Command::Deform { map, options }) => deform::deform(&map, &options),
        Some(Command::Chaos { mission, options }) => chaos::chaos(&mission, &options),
        Some(Command::Serve { process, system, site, study }) => {
            serve::serve(process, &system, (site, study))
        }
        Some(Command::Ps { json }) => systems::ps(json),
        Some(Command::Channels { system: Some(system), json, .. }) => channels::show_live(&system, json),
        Some(Command::Channels { kind, json, .. }) => channels::show(kind.as_deref(), json),
        Some(Command::Graph { options }) => graph::graph(&options),
        Some(Command::Doctor { json }) => doctor::doctor(json),
        Some(Command::Clean { json }) => systems::clean(json),
        Some(Command::Top { options }) => top::top(&options),
        Some(Command::View { options }) => view::view(&options),
        Some(Command::Echo { options }) => tap::echo(&options),
        Some(Command::Hz { options }) => tap::hz(&options),
        Some(Command::Logs { options }) => logs::logs(&options),
        Some(Command::Restart { options }) => step_in::restart(&options),
        Some(Command::Send { options }) => step_in::send(&options),
        Some(Command::Param { what }) => param::param(&what),
        Some(Command::Snapshot { options }) => recordings::snapshot::snapshot(&options),
        Some(Command::Bridge { other }) => bridge::bridge(&other),
        Some(Command::Diff { a, b, json }) => {
            recordings::with_all(&[a, b], |wholes| tools::diff(wholes, json))
        }
        Some(Command::Info { file, json }) => tools::info(&file, json),
        Some(Command::Relations { file, options }) => {
            recordings::with(&file, |whole| relations::relations(whole, &options))
        }
        Some(Command::Landmarks { mission, table: _, smooth: Some(file) }) => {
            landmarks::smooth(&mission, &file)
        }
        Some(Command::Landmarks { mission, table, smooth: None }) => landmarks::print(&mission, table),
        Some(Command::Directions { mission, options }) => directions::print(&mission, &options),
        Some(Command::Completions { shell }) => manuals::completions(shell),
        Some(Command::Man { folder }) => manuals::man(&folder),
        Some(Command::Help { topic }) => help::help(&topic),
        Some(Command::Recordings(tool)) => recordings::dispatch(tool),
    }
}

//! The `sketchnav` command as a library: one program, a subcommand for each process and tool.
//!
//! A program of one's own has a `main` that calls [`main_with`]: it is then all of `sketchnav`, and knows one's own
//! navigators, too. `tests/stranger/wall_follower.rs` is such a program.

mod args;
mod bridge;
mod channels;
mod chaos;
mod deform;
mod doctor;
mod eval;
mod failure;
mod folder;
mod graph;
mod landmarks;
mod launch;
mod link;
mod live;
mod logs;
mod mission;
mod notify;
mod output;
mod pad;
mod recordings;
mod relations;
mod report;
mod serve;
mod step_in;
mod systems;
mod tap;
mod tools;
mod top;

use std::process::ExitCode;

use clap::Parser;
use nix::sys::signal::{SigHandler, Signal, signal};
use sketchnav_schemas::channels::ChannelSpec;
use sketchnav_stage::Navigator;

use args::{Cli, Command};
use failure::{Failure, Outcome, exit_code};

/// What this project's own program does: reads the command line and obeys it.
pub fn main() -> ExitCode {
    ignore_file_size_signal();
    let cli = Cli::parse();
    let json = cli.wants_json();
    exit_code(dispatch(cli), json)
}

/// Ignores SIGXFSZ, which would end the process without a message. A write beyond `ulimit -f` then fails with an error, as
/// on a full disk. Processes that this program starts ignore the signal too.
fn ignore_file_size_signal() {
    // SAFETY: no handler runs. The call fails for invalid signals only.
    let _ = unsafe { signal(Signal::SIGXFSZ, SigHandler::SigIgn) };
}

/// The same with navigators of one's own, and the channels that they have beside those of all.
pub fn main_with(navigators: &'static [Navigator], channels: &'static [&'static ChannelSpec]) -> ExitCode {
    match sketchnav_navigators::register(navigators, channels) {
        Ok(()) => main(),
        Err(error) => exit_code(Err(Failure::Other(error.into())), false),
    }
}

fn dispatch(cli: Cli) -> Result<Outcome, Failure> {
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
        Some(Command::Serve { process, system, site }) => serve::serve(process, &system, site),
        Some(Command::Ps { json }) => systems::ps(json),
        Some(Command::Channels { system: Some(system), json, .. }) => channels::show_live(&system, json),
        Some(Command::Channels { kind, json, .. }) => channels::show(kind.as_deref(), json),
        Some(Command::Graph { options }) => graph::graph(&options),
        Some(Command::Doctor { json }) => doctor::doctor(json),
        Some(Command::Clean { json }) => systems::clean(json),
        Some(Command::Top { options }) => top::top(&options),
        Some(Command::Echo { options }) => tap::echo(&options),
        Some(Command::Hz { options }) => tap::hz(&options),
        Some(Command::Logs { options }) => logs::logs(&options),
        Some(Command::Restart { options }) => step_in::restart(&options),
        Some(Command::Send { options }) => step_in::send(&options),
        Some(Command::Bridge { other }) => bridge::bridge(&other),
        Some(Command::Diff { a, b, json }) => tools::diff(&a, &b, json),
        Some(Command::Info { file, json }) => tools::info(&file, json),
        Some(Command::Relations { file, options }) => relations::relations(&file, &options),
        Some(Command::Landmarks { mission, table }) => landmarks::print(&mission, table),
        Some(Command::Recordings(tool)) => recordings::dispatch(tool),
    }
}

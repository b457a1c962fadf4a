//! The live view, in a program that was built with it.

use std::path::Path;

use anyhow::Context;
use sketchnav_recordings::Recording;
use sketchnav_runtime::{Node, System};
use sketchnav_schemas::codes::Process;
pub use sketchnav_view::Port;
use sketchnav_view::{ViewError, file, live};

use crate::args::ViewOptions;
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::{out, say};
use crate::recordings::with;

/// Returns the port with the given number if it is free, or any free port for 0.
pub fn port(number: u16) -> Result<Port, Failure> {
    Port::free(number).or_input()
}

/// Shows a running system.
pub fn system(system: System, port: Port) -> Result<Outcome, Failure> {
    let name = system.name().to_owned();
    let node = Node::join(system, Process::Observer).with_context(|| format!("joining {name}"))?;
    let end = live::show(&node, port, || announce(port)).map_err(classify)?;
    if end == live::End::Over {
        say!("{name} has ended");
    }
    Ok(Outcome::Success)
}

/// Shows a recording.
pub fn file(path: &Path, port: Port, options: &ViewOptions) -> Result<Outcome, Failure> {
    let rate = options.rate.unwrap_or(1.0);
    let how = file::Options { rate, again: options.again, is_paused: options.paused };
    with(path, |whole| {
        let recording = Recording::open(whole.path()).or_input()?;
        file::play(&recording, port, how, || announce(port)).map_err(classify)?;
        Ok(Outcome::Success)
    })
}

/// Prints the view's address. If standard output is closed, the user may know the address already.
fn announce(port: Port) {
    let _ = out!("the live view: {}", port.url());
}

/// Classifies an error as bad input if the user can correct it.
fn classify(error: ViewError) -> Failure {
    match error {
        ViewError::Address { .. } | ViewError::Empty { .. } | ViewError::Recording(_) => {
            Failure::Input(error.into())
        }
        _ => Failure::Other(error.into()),
    }
}

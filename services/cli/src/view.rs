//! Shows a running system or a recording in Foxglove and Lichtblick, for `sketchnav view` and, alongside a
//! mission, for `run --foxglove`.
//!
//! The view is an observer in a separate process, so a mission neither waits for it nor ends with it. It is only
//! available if the program was built with the feature `foxglove`.

#[cfg_attr(not(feature = "foxglove"), path = "view/absent.rs")]
mod shown;

use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow};
use nix::sys::prctl::set_pdeathsig;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use sketchnav_runtime::System;

use crate::args::ViewOptions;
use crate::failure::{Failure, Outcome};
use crate::output::say;
use crate::systems;

/// Maximum time that a view may take to end after its mission has ended.
const GOODBYE: Duration = Duration::from_secs(2);
/// Interval at which to check whether the view has ended.
const LOOK_EVERY: Duration = Duration::from_millis(10);

/// The source of a view.
enum Target<'a> {
    System(System),
    File(&'a Path),
}

/// Serves the view until the user ends it or the system ends.
pub fn view(options: &ViewOptions) -> Result<Outcome, Failure> {
    let port = shown::port(options.port)?;
    match target(options)? {
        Target::System(system) => shown::system(system, port),
        Target::File(file) => shown::file(file, port, options),
    }
}

fn target(options: &ViewOptions) -> Result<Target<'_>, Failure> {
    let Some(text) = &options.target else {
        return system(options.system.as_deref(), options);
    };
    let path = Path::new(text);
    if path.exists() || text.contains(['/', '.']) {
        return Ok(Target::File(path));
    }
    system(Some(text), options)
}

fn system<'a>(name: Option<&str>, options: &ViewOptions) -> Result<Target<'a>, Failure> {
    let given = [("--rate", options.rate.is_some()), ("--loop", options.again), ("--paused", options.paused)];
    if let Some((option, _)) = given.into_iter().find(|(_, is_given)| *is_given) {
        return Err(Failure::Input(anyhow!("{option}: expected a recording, found a running system")));
    }
    systems::find(name).map(Target::System)
}

/// A view to be shown alongside a mission.
pub struct Beside {
    port: shown::Port,
}

impl Beside {
    /// Checks that the port is free, before anything else starts.
    pub fn prepare(port: Option<u16>) -> Result<Option<Self>, Failure> {
        port.map(|number| Ok(Self { port: shown::port(number)? })).transpose()
    }

    /// Starts the view and prints its address.
    pub fn start(self, system: &str) -> anyhow::Result<Running> {
        let mut command = sketchnav_supervisor::this_program().context("path of this program")?;
        command.args(["view", "--system", system, "--port", &self.port.number().to_string()]);
        // The address is printed here. The view gets its own process group, since Ctrl-C is meant for the mission,
        // which ends the view.
        command.stdin(Stdio::null()).stdout(Stdio::null()).process_group(0);
        // SAFETY: between fork and exec the closure only makes one system call.
        unsafe { command.pre_exec(|| Ok(set_pdeathsig(Signal::SIGKILL)?)) };
        let child = command.spawn().context("starting the live view")?;
        say!("the live view: {}", self.port.url());
        Ok(Running(child))
    }
}

/// A view that is shown alongside a mission. Dropping this ends the view.
pub struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let limit = Instant::now() + GOODBYE;
        let _ = kill(Pid::from_raw(self.0.id().cast_signed()), Signal::SIGTERM);
        while matches!(self.0.try_wait(), Ok(None)) && Instant::now() < limit {
            sleep(LOOK_EVERY);
        }
        // If the view has already ended, these calls do nothing.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

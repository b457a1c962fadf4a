//! Drives trials in simulators that are not part of this project. Each run is a whole system, where a driver of `examples` takes
//! the world's place.

use std::fs::File;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread::sleep;
use std::time::Duration;

use anyhow::{Context, anyhow, bail};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use sketchnav_lab::experiments::elsewhere::{Elsewhere, SIMULATORS};
use sketchnav_lab::experiments::trial::Trial;
use sketchnav_recordings::Recording;
use sketchnav_recordings::reader::Selection;
use sketchnav_runtime::System;
use sketchnav_schemas::channels::of_topic;
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::Tap;

use super::processes;
use crate::args::EvalOptions;

/// Interval at which to check whether a system has started.
const LOOK_EVERY: Duration = Duration::from_millis(20);
/// Counts the systems of this process, so that each has its own name.
static STARTED: AtomicU32 = AtomicU32::new(0);

/// A simulator with a driver in `examples`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Simulator {
    /// ir-sim: noisy kinematics, contacts, a noisy lidar.
    Irsim,
    /// `MuJoCo`: wheels that slip, contacts, a laser by ray casting.
    Mujoco,
}

impl Simulator {
    /// Returns the name on the command line, which is also that of the Python module.
    pub fn word(self) -> &'static str {
        SIMULATORS[self as usize]
    }

    /// Returns the name of the simulator for pip.
    fn distribution(self) -> &'static str {
        match self {
            Self::Irsim => "ir-sim",
            Self::Mujoco => "mujoco",
        }
    }
}

/// Returns the simulator that the user asked for, driven by the example in the checkout `project`.
///
/// # Errors
/// If the example is missing, or the Python lacks the simulator or this package.
pub fn open(options: &EvalOptions, project: &Path) -> anyhow::Result<Option<Elsewhere>> {
    let Some(simulator) = options.world else { return Ok(None) };
    let word = simulator.word();
    let script = project.join(format!("examples/{word}_driver.py"));
    let text = std::fs::read(&script).with_context(|| format!("--world {word}: {}", script.display()))?;
    let python = options.python.clone();
    check_python(&python, simulator)?;
    let drive = move |trial: &Trial, run: &RunConfig, tap: &mut dyn Tap| {
        drive(trial, run, (&python, &script), tap).map_err(Into::into)
    };
    Ok(Some(Elsewhere::new(word, crc32fast::hash(&text), drive)))
}

/// Checks that the Python can import the driver's dependencies.
fn check_python(python: &Path, simulator: Simulator) -> anyhow::Result<()> {
    let word = simulator.word();
    let imported = Command::new(python).args(["-c", &format!("import {word}, sketchnav._core")]).output();
    let why = match imported {
        Ok(output) if output.status.success() => return Ok(()),
        Ok(output) => String::from_utf8_lossy(&output.stderr).trim_end().lines().last().map(str::to_owned),
        Err(error) => Some(error.to_string()),
    };
    bail!(
        "--world {word}: expected a Python with {word} and the sketchnav of this checkout, found {}: {}; install both by `pip install ./python {}`, and name the Python by --python",
        python.display(),
        why.unwrap_or_default(),
        simulator.distribution()
    )
}

/// Runs a trial as a whole system, with a simulator in place of the world. `driver` is the Python interpreter and the
/// driver's script. Afterwards, passes the messages of the recording to `tap`.
fn drive(trial: &Trial, run: &RunConfig, driver: (&Path, &Path), tap: &mut dyn Tap) -> anyhow::Result<()> {
    let place = tempfile::tempdir()?;
    let mission = processes::write_mission(trial, run, place.path())?;
    let number = STARTED.fetch_add(1, Ordering::Relaxed);
    let system = format!("eval-{}-{number}", std::process::id());
    // Use files, because a pipe that nobody reads would fill up and stop the system.
    let printed = ["report", "said"].map(|name| place.path().join(name));
    let mut command = processes::command(&mission, run.seed, place.path(), &system)?;
    command.args(["--without", "world"]);
    command.stdout(File::create(&printed[0])?).stderr(File::create(&printed[1])?);
    let mut running = command.spawn().context("starting the mission")?;
    let driven = in_system(&system, driver, &mut running);
    if driven.is_err() {
        // Without a driver, the system would wait forever.
        let _ = kill(Pid::from_raw(running.id().cast_signed()), Signal::SIGTERM);
    }
    let status = running.wait().context("waiting for the mission")?;
    driven?;
    let [stdout, stderr] = printed.map(std::fs::read);
    show(&processes::recording(&Output { status, stdout: stdout?, stderr: stderr? })?, tap)
}

/// Runs the driver once the system has started, and waits until the driver ends.
fn in_system(system: &str, (python, script): (&Path, &Path), running: &mut Child) -> anyhow::Result<()> {
    // Nothing announces a new system, so poll until its files appear.
    while System::open(system).is_err() {
        if running.try_wait()?.is_some() {
            // Its report explains why.
            return Ok(());
        }
        sleep(LOOK_EVERY);
    }
    let output = Command::new(python).arg(script).arg(system).stdin(Stdio::null()).output();
    let output = output.with_context(|| format!("starting {}", python.display()))?;
    if output.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&output.stderr);
    Err(anyhow!("{} ({}): {}", script.display(), output.status, said.trim_end()))
}

/// Passes the messages of a recording to `tap`, in order of time.
fn show(path: &Path, tap: &mut dyn Tap) -> anyhow::Result<()> {
    let recording = Recording::open(path)?;
    for raw in recording.timeline(Selection::default())? {
        let raw = raw?;
        if let Some(spec) = of_topic(&raw.topic.name) {
            let message = raw.decode_in(spec, recording.path())?;
            tap.see(spec, message.bytes(), message.cells());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use clap::ValueEnum;

    use super::*;

    #[test]
    fn simulators_are_called_as_on_the_command_line() {
        for simulator in Simulator::value_variants() {
            assert_eq!(simulator.to_possible_value().unwrap().get_name(), simulator.word());
        }
    }

    #[test]
    fn a_python_without_the_simulator_is_refused_with_what_to_install() {
        let project = Path::new(env!("CARGO_MANIFEST_DIR"));
        let options = |python| EvalOptions::of_words(&["--world", "irsim", "--python", python]);
        for (python, why) in [("/nowhere/python3", "No such file"), ("false", "found false: ;")] {
            let error = open(&options(python), project).unwrap_err().to_string();
            assert!(error.contains(why) && error.contains("`pip install ./python ir-sim`"), "{error}");
        }
        let error = open(&options("false"), Path::new("/nowhere")).unwrap_err().to_string();
        assert_eq!(error, "--world irsim: /nowhere/examples/irsim_driver.py");
    }
}

//! The simulated world as a process, which passes messages between a [`Simulation`] and the channels, and
//! decides when the next instant is due. The driver of a real robot does the same with real sensors.
//!
//! The checkpoint contains the whole world before its sensors are read. Since the readings follow from the world, a restarted
//! process sends the same readings again and continues.

// `say!` prints, and escapes text that could control a terminal.
#![deny(clippy::print_stdout, clippy::print_stderr)]

use std::time::{Duration, Instant};

use anyhow::Context;
use serde::{Deserialize, Serialize};
use sketchnav_files::Files;
use sketchnav_runtime::{
    Checkpoints, Found, HealthReporter, Node, Pacer, RawWriter, Reader, Step, Wake, Writer,
};
use sketchnav_schemas::channels::{self, COMMAND, Channel, LOCKSTEP_WINDOW, MAX_CHANNELS, RECORDED, TICK};
use sketchnav_schemas::erased;
use sketchnav_schemas::message::{Header, Recorded, Tick, VelocityCommand};
use sketchnav_schemas::ros2::Ros2;
use sketchnav_schemas::run::{Pace, RunConfig};
use sketchnav_sim::{Senses, Simulation, World};

/// Maximum time between two checks for new messages.
const LOOK_UP: Duration = Duration::from_millis(20);
/// Interval of checks for the first answer, and maximum time to wait for it.
const LOOK_SOON: Duration = Duration::from_millis(2);
const PATIENCE: Duration = Duration::from_secs(10);
/// Format version of [`Positions`] and [`World`] in a checkpoint.
const CHECKPOINT: &str = "world 6";

/// The world's positions in its channels before its sensors are read. For a channel that it writes, this is
/// the number of the last message sent. For a channel that it reads, it is the number before the next message
/// to be received.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Positions {
    tick: u64,
    /// Positions in the channels of readings, in the order of the table, padded with zeros.
    readings: [u64; MAX_CHANNELS],
    command: u64,
    recorded: u64,
}

/// Runs the world of the node's system until the process is asked to end. `files` provides the files that the mission names.
///
/// # Errors
/// - [`sketchnav_sim::SimError`] if the mission's world or start is impossible.
/// - any error of the runtime.
pub fn run(node: &Node, files: &dyn Files) -> anyhow::Result<()> {
    let run = node.run_config()?;
    let mut shell = Shell::open(node, &run, files)?;
    match run.pace {
        Pace::Lockstep => shell.lockstep(),
        Pace::RealTime { speed } => shell.real_time(speed),
    }
}

/// Restores the world from the latest checkpoint, or creates a new one if there has been no checkpoint.
fn resume(
    run: &RunConfig,
    files: &dyn Files,
    found: Found<(Positions, World)>,
) -> anyhow::Result<(Option<Positions>, World)> {
    let is_lost = found.is_lost();
    match found.state {
        Some((positions, world)) => Ok((Some(positions), world)),
        None if is_lost => {
            anyhow::bail!("expected a usable checkpoint, found none: the robot's position is unknown")
        }
        None => Ok((None, World::of_run(run, files)?)),
    }
}

struct Shell<'a, S> {
    node: &'a Node,
    world: S,
    voices: Voices,
    tick: Writer<Tick>,
    command: Reader<VelocityCommand>,
    recorded: Reader<Recorded>,
    health: HealthReporter,
    checkpoints: Checkpoints<(Positions, S)>,
    pace: Pace,
    /// The latest command.
    held: Option<VelocityCommand>,
    /// The latest tick that is known to be safe in the recording, or a number above any tick if nothing is recorded.
    recorded_tick: u64,
}

impl<'a> Shell<'a, World> {
    fn open(node: &'a Node, run: &RunConfig, files: &dyn Files) -> anyhow::Result<Self> {
        let (checkpoints, found) = Checkpoints::open(node, CHECKPOINT)?;
        found.report(node);
        let (positions, world) = resume(run, files, found)?;
        let mut shell = Self {
            node,
            world,
            voices: Voices::open(node, run.mission.navigator_kind())?,
            tick: node.writer(TICK)?,
            command: node.reader(COMMAND)?,
            recorded: node.reader(RECORDED)?,
            health: HealthReporter::new(node)?,
            checkpoints,
            pace: run.pace,
            held: None,
            recorded_tick: if run.recording.is_some() { 0 } else { u64::MAX - LOCKSTEP_WINDOW },
        };
        if let Some(positions) = positions {
            shell.resume_after(&positions);
        }
        Ok(shell)
    }
}

impl<S: Simulation> Shell<'_, S> {
    fn resume_after(&mut self, positions: &Positions) {
        self.tick.resume_after(positions.tick);
        self.voices.resume_after(&positions.readings);
        self.command.resume_after(positions.command);
        self.recorded.resume_after(positions.recorded);
    }

    /// Returns the channel positions for receiving the current command and the recorder's last acknowledgement again.
    fn positions(&self) -> Positions {
        Positions {
            tick: self.tick.last_seq(),
            readings: self.voices.positions(),
            command: self.held.map_or(0, |command| command.header.seq - 1),
            recorded: self.recorded.position().saturating_sub(1),
        }
    }

    /// Takes one step per command. The next step is due when the command caused by this tick has arrived and the recorder is
    /// not too far behind.
    fn lockstep(&mut self) -> anyhow::Result<()> {
        self.observe()?;
        loop {
            if self.node.wait(LOOK_UP) == Wake::Terminate {
                return self.end();
            }
            self.receive()?;
            if self.next_is_due() {
                self.step()?;
            }
            self.health.report_if_due(self.world.stamp_ns())?;
        }
    }

    fn next_is_due(&self) -> bool {
        let tick = self.tick.last_seq();
        let answered =
            self.held.is_some_and(|command| command.header.source_seq == tick && command.last == 0);
        answered && tick < self.recorded_tick + LOCKSTEP_WINDOW
    }

    /// Returns true if the command for the current step has arrived. In lockstep, each command is for its own step, even if
    /// commands for several steps have arrived, because a world that resumes from a checkpoint repeats the steps since then.
    fn has_its_command(&self) -> bool {
        let tick = self.tick.last_seq();
        self.pace == Pace::Lockstep && self.held.is_some_and(|command| command.header.source_seq >= tick)
    }

    /// Takes each step when it is due, with whatever command has arrived, until the last one.
    fn real_time(&mut self, speed: f64) -> anyhow::Result<()> {
        self.observe()?;
        self.await_navigators()?;
        let pacer = Pacer::start(self.world.stamp_ns(), speed);
        loop {
            self.receive()?;
            let is_over = self.held.is_some_and(|command| command.last == 1);
            let due = pacer.until(self.world.stamp_ns() + self.world.period_ns());
            if due.is_zero() && !is_over {
                self.step()?;
            }
            let nap = if is_over { LOOK_UP } else { due.min(LOOK_UP) };
            if self.node.nap(nap) == Wake::Terminate {
                return self.end();
            }
            self.health.report_if_due(self.world.stamp_ns())?;
        }
    }

    /// Starts the clock when the first tick has been answered, so that a stage that is still reading the
    /// drawing does not miss anything, no matter how fast time passes. If there is no answer, for example
    /// because there are no navigators, the clock starts anyway.
    fn await_navigators(&mut self) -> anyhow::Result<()> {
        let began = Instant::now();
        while self.held.is_none() && began.elapsed() < PATIENCE && self.node.nap(LOOK_SOON) != Wake::Terminate
        {
            self.receive()?;
            self.health.report_if_due(self.world.stamp_ns())?;
        }
        Ok(())
    }

    fn receive(&mut self) -> anyhow::Result<()> {
        while !self.has_its_command()
            && let Some(command) = self.command.receive_valid()?
        {
            self.held = Some(*command);
        }
        while let Some(recorded) = self.recorded.receive()? {
            self.recorded_tick = recorded.header.source_seq;
        }
        Ok(())
    }

    fn step(&mut self) -> anyhow::Result<()> {
        let step = Step::begin();
        self.world.step(self.held.as_ref());
        let positions = self.positions();
        match self.pace {
            Pace::Lockstep => self.checkpoints.after_step(|| (positions, &self.world))?,
            // Which command had arrived by then is a matter of chance, so a step cannot be repeated.
            Pace::RealTime { .. } => self.checkpoints.write(&(positions, &self.world))?,
        }
        self.observe()?;
        self.health.end(step);
        Ok(())
    }

    /// Sends the current sensor readings, and then the tick, which lists the readings and wakes the readers.
    fn observe(&mut self) -> anyhow::Result<()> {
        let (stamp_ns, source_seq) = (self.world.stamp_ns(), self.tick.last_seq() + 1);
        self.voices.source_seq = source_seq;
        self.world.sense(&mut self.voices)?;
        let mut tick = self.tick.loan()?;
        tick.header = Header { seq: 0, stamp_ns, source_seq };
        self.node.name_readings(&mut tick);
        tick.send()?;
        Ok(())
    }

    fn end(&mut self) -> anyhow::Result<()> {
        Ok(self.health.report(self.world.stamp_ns())?)
    }
}

/// Writers of everything that a world sends before the tick.
struct Voices {
    writers: Vec<RawWriter>,
    /// Number of the instant's tick.
    source_seq: u64,
}

impl Voices {
    fn open(node: &Node, kind: &str) -> anyhow::Result<Self> {
        let own = channels::written_by(node.process(), kind).filter(|spec| *spec != TICK.spec);
        let writers = own.map(|spec| node.raw_writer(spec)).collect::<Result<_, _>>()?;
        Ok(Self { writers, source_seq: 0 })
    }

    fn positions(&self) -> [u64; MAX_CHANNELS] {
        let mut positions = [0; MAX_CHANNELS];
        for (position, writer) in positions.iter_mut().zip(&self.writers) {
            *position = writer.last_seq();
        }
        positions
    }

    fn resume_after(&mut self, positions: &[u64; MAX_CHANNELS]) {
        for (writer, &position) in self.writers.iter_mut().zip(positions) {
            writer.resume_after(position);
        }
    }
}

impl Senses for Voices {
    type Error = anyhow::Error;

    fn reading<T: Ros2>(
        &mut self,
        channel: Channel<T>,
        stamp_ns: u64,
        fill: impl FnOnce(&mut T),
    ) -> anyhow::Result<()> {
        let writer = self.writers.iter_mut().find(|writer| writer.spec() == channel.spec);
        let writer = writer.with_context(|| format!("no writer for {}", channel.spec.name))?;
        let mut loan = writer.loan(0)?;
        let (message, _) = loan.parts_mut();
        *erased::header_mut(message) = Header { seq: 0, stamp_ns, source_seq: self.source_seq };
        fill(bytemuck::from_bytes_mut(message));
        loan.send_quietly()?;
        Ok(())
    }
}

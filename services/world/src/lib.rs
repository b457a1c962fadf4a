//! The simulated world as a process: moves the bytes between `sketchnav_sim` and the channels, and
//! decides when the next step is due. A real robot's driver does the same with real sensors.
//!
//! Its checkpoint holds the whole world as it is before its sensors speak: what they say follows from it,
//! so a successor says the same again and goes on.

use std::any::Any;
use std::time::{Duration, Instant};

use anyhow::Context;
use serde::{Deserialize, Serialize};
use sketchnav_runtime::{Checkpoints, Found, HealthReporter, Node, Pacer, Reader, Step, Wake, Writer};
use sketchnav_schemas::channels::{
    COMMAND, CONTACT, Channel, LOCKSTEP_WINDOW, ODOMETRY, RECORDED, SCAN, SONAR, TRUTH,
};
use sketchnav_schemas::geometry::Pose;
use sketchnav_schemas::message::{
    Contact, GroundTruth, Header, LaserScan, Odometry, Recorded, SonarScan, VelocityCommand,
};
use sketchnav_schemas::ros2::Ros2;
use sketchnav_schemas::run::{Pace, RunConfig};
use sketchnav_sim::{Floor, Senses, Simulation};

/// How long to sleep at most before looking whether somebody new listens.
const LOOK_UP: Duration = Duration::from_millis(20);
/// How often to look for the first answer, and how long to wait for it.
const LOOK_SOON: Duration = Duration::from_millis(2);
const PATIENCE: Duration = Duration::from_secs(10);
/// The form of [`Positions`] and [`Floor`].
const CHECKPOINT: &str = "world 2";

/// Where in its channels the world stands before its sensors speak: the last number that was given, or
/// the one before the message that counts.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Positions {
    scan: u64,
    sonar: u64,
    odometry: u64,
    truth: u64,
    contact: u64,
    command: u64,
    recorded: u64,
}

/// Runs the world of the node's system until the process is asked to end.
///
/// # Errors
/// [`sketchnav_sim::SimError`] where the mission's world or start cannot be; the runtime's errors.
pub fn run(node: &Node) -> anyhow::Result<()> {
    let run = node.run_config()?;
    let mut shell = Shell::open(node, &run)?;
    match run.pace {
        Pace::Lockstep => shell.lockstep(),
        Pace::RealTime { speed } => shell.real_time(speed),
    }
}

/// The world that a run describes, before its first scan.
///
/// # Errors
/// [`sketchnav_sim::SimError`] with the file, the key or the place.
pub fn build(run: &RunConfig) -> Result<Floor, sketchnav_sim::SimError> {
    let description = sketchnav_sim::files::world(&run.mission.world)?;
    let start = &run.mission.start;
    let pose = Pose::new(start.world[0], start.world[1], start.world_heading_deg.to_radians());
    Floor::new(description, &run.robot, pose, run.seed)
}

/// The world of the newest checkpoint, or a new one.
fn resume(run: &RunConfig, found: Found<(Positions, Floor)>) -> anyhow::Result<(Option<Positions>, Floor)> {
    let is_lost = found.is_lost();
    match found.state {
        Some((positions, world)) => Ok((Some(positions), world)),
        None if is_lost => anyhow::bail!("no checkpoint can be used: nobody knows where the robot is"),
        None => Ok((None, build(run)?)),
    }
}

struct Shell<'a> {
    node: &'a Node,
    world: Floor,
    voices: Voices,
    command: Reader<VelocityCommand>,
    recorded: Reader<Recorded>,
    health: HealthReporter,
    checkpoints: Checkpoints<(Positions, Floor)>,
    pace: Pace,
    /// The newest command.
    held: Option<VelocityCommand>,
    /// The newest scan that is safe in the file; beyond all scans where nothing records.
    recorded_scan: u64,
}

impl<'a> Shell<'a> {
    fn open(node: &'a Node, run: &RunConfig) -> anyhow::Result<Self> {
        let (checkpoints, found) = Checkpoints::open(node, CHECKPOINT)?;
        found.report(node);
        let (positions, world) = resume(run, found)?;
        let mut shell = Self {
            node,
            world,
            voices: Voices::open(node)?,
            command: node.reader(COMMAND)?,
            recorded: node.reader(RECORDED)?,
            health: HealthReporter::new(node)?,
            checkpoints,
            pace: run.pace,
            held: None,
            recorded_scan: if run.recording.is_some() { 0 } else { u64::MAX - LOCKSTEP_WINDOW },
        };
        if let Some(positions) = positions {
            shell.resume_after(&positions);
        }
        Ok(shell)
    }

    fn resume_after(&mut self, positions: &Positions) {
        self.voices.scan.resume_after(positions.scan);
        self.voices.sonar.resume_after(positions.sonar);
        self.voices.odometry.resume_after(positions.odometry);
        self.voices.truth.resume_after(positions.truth);
        self.voices.contact.resume_after(positions.contact);
        self.command.resume_after(positions.command);
        self.recorded.resume_after(positions.recorded);
    }

    /// The command that is held and the recorder's last word are to come again.
    fn positions(&self) -> Positions {
        Positions {
            scan: self.voices.scan.last_seq(),
            sonar: self.voices.sonar.last_seq(),
            odometry: self.voices.odometry.last_seq(),
            truth: self.voices.truth.last_seq(),
            contact: self.voices.contact.last_seq(),
            command: self.held.map_or(0, |command| command.header.seq - 1),
            recorded: self.recorded.position().saturating_sub(1),
        }
    }

    /// A step for every command: the next when the one that this scan caused has come and the recorder
    /// is not too far behind.
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
        let scan = self.voices.scan.last_seq();
        let answered =
            self.held.is_some_and(|command| command.header.source_seq == scan && command.last == 0);
        answered && scan < self.recorded_scan + LOCKSTEP_WINDOW
    }

    /// In lockstep each command is for its own step, also where those of many steps have come: a world that
    /// goes on from a checkpoint takes the steps since then again.
    fn has_its_command(&self) -> bool {
        let scan = self.voices.scan.last_seq();
        self.pace == Pace::Lockstep && self.held.is_some_and(|command| command.header.source_seq >= scan)
    }

    /// A step when its time has come, whatever command there is, until the last one.
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

    /// Time begins when the first scan is answered: whoever still reads the drawing misses nothing, however
    /// fast time passes then. Without navigators it begins all the same.
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
            && let Some(command) = self.command.receive_sound()?
        {
            self.held = Some(*command);
        }
        while let Some(recorded) = self.recorded.receive()? {
            self.recorded_scan = recorded.header.source_seq;
        }
        Ok(())
    }

    fn step(&mut self) -> anyhow::Result<()> {
        let step = Step::begin();
        self.world.step(self.held.as_ref());
        let positions = self.positions();
        match self.pace {
            Pace::Lockstep => self.checkpoints.after_step(|| (positions, &self.world))?,
            // Which command had come by then is chance: no step can be taken a second time.
            Pace::RealTime { .. } => self.checkpoints.write(&(positions, &self.world))?,
        }
        self.observe()?;
        self.health.end(step);
        Ok(())
    }

    /// Sends what the sensors say now; the scan wakes the readers.
    fn observe(&mut self) -> anyhow::Result<()> {
        self.voices.source_seq = self.voices.scan.last_seq() + 1;
        self.world.sense(&mut self.voices)
    }

    fn end(&mut self) -> anyhow::Result<()> {
        Ok(self.health.report(self.world.stamp_ns())?)
    }
}

/// A writer for everything that a world says.
struct Voices {
    scan: Writer<LaserScan>,
    sonar: Writer<SonarScan>,
    odometry: Writer<Odometry>,
    truth: Writer<GroundTruth>,
    contact: Writer<Contact>,
    /// The scan of the instant.
    source_seq: u64,
}

impl Voices {
    fn open(node: &Node) -> anyhow::Result<Self> {
        Ok(Self {
            scan: node.writer(SCAN)?,
            sonar: node.writer(SONAR)?,
            odometry: node.writer(ODOMETRY)?,
            truth: node.writer(TRUTH)?,
            contact: node.writer(CONTACT)?,
            source_seq: 0,
        })
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
        let Self { scan, sonar, odometry, truth, contact, source_seq } = self;
        let writers: [&mut dyn Any; 5] = [scan, sonar, odometry, truth, contact];
        let writer = writers.into_iter().find_map(|writer| writer.downcast_mut::<Writer<T>>());
        let writer = writer.with_context(|| format!("no writer for {}", channel.spec.name))?;
        let mut loan = writer.loan()?;
        *loan.header_mut() = Header { seq: 0, stamp_ns, source_seq: *source_seq };
        fill(&mut loan);
        if channel.spec.name == SCAN.spec.name {
            loan.send()?
        } else {
            loan.send_quietly()?
        };
        Ok(())
    }
}

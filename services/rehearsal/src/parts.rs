//! The parts of a rehearsal, each of which replaces a process. A part contains the computation of the process and the messages that
//! it has sent.

use std::time::{Duration, Instant as Clock};

use sketchnav_schemas::channels::{self, Channel, ChannelSpec, MISSION, Role, TICK};
use sketchnav_schemas::codes::{Order, Process};
use sketchnav_schemas::erased::{self, Owned};
use sketchnav_schemas::message::{Header, Here, MAX_SENSORS, VelocityCommand};
use sketchnav_schemas::ros2::Ros2;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sim::{self as sim, Senses, Simulation};
use sketchnav_stage::{
    Access, Files, Hosted, InProcess, Incoming, Inputs, Instant, Outbox, Sink, StageError, Tap,
};

use crate::RehearsalError;

/// The part that replaces the world: the simulation, and the messages that it has sent.
pub(crate) struct World {
    simulation: sim::World,
    pub(crate) memory: InProcess,
    tick: u64,
    /// Time spent in the world so far.
    pub(crate) spent: Duration,
}

impl World {
    pub(crate) fn new(run: &RunConfig, files: &dyn sketchnav_files::Files) -> Result<Self, RehearsalError> {
        let simulation = sim::World::of_run(run, files)?;
        let memory = InProcess::of_writer(Process::World, run.mission.navigator_kind());
        Ok(Self { simulation, memory, tick: 0, spent: Duration::ZERO })
    }

    /// Advances to the next instant with the given command, or with the previous one if there is none.
    pub(crate) fn step(&mut self, command: Option<&VelocityCommand>) {
        let began = Clock::now();
        self.simulation.step(command);
        self.spent += began.elapsed();
    }

    pub(crate) fn stamp_ns(&self) -> u64 {
        self.simulation.stamp_ns()
    }

    pub(crate) fn tick(&self) -> u64 {
        self.tick
    }

    /// Sends the messages of the instant: contacts, truth, readings, tick.
    pub(crate) fn observe(&mut self, tap: &mut impl Tap) -> Result<(), StageError> {
        let began = Clock::now();
        let Self { simulation, memory, .. } = self;
        let (stamp_ns, source_seq) = (simulation.stamp_ns(), self.tick + 1);
        simulation.sense(&mut Said { sink: &mut memory.tapped(tap), source_seq })?;
        let newest = newest_readings(memory);
        let mut sink = memory.tapped(tap);
        let mut out = Outbox::new(&mut sink, stamp_ns, source_seq);
        self.tick = out.send(TICK, |tick| tick.newest = newest)?;
        self.spent += began.elapsed();
        Ok(())
    }
}

/// Returns the sequence number of each sensor's latest message, for the tick. The number is 0 if a sensor has not sent any.
fn newest_readings(memory: &InProcess) -> [u64; MAX_SENSORS] {
    let mut newest = [0; MAX_SENSORS];
    for (newest, sensor) in newest.iter_mut().zip(channels::sensors()) {
        *newest = memory.get(sensor).map_or(0, |reading| erased::header(reading.bytes()).seq);
    }
    newest
}

/// Sends the messages of the simulation.
struct Said<'a> {
    sink: &'a mut dyn Sink,
    /// Number of the instant's tick.
    source_seq: u64,
}

impl Senses for Said<'_> {
    type Error = StageError;

    fn reading<T: Ros2>(
        &mut self,
        channel: Channel<T>,
        stamp_ns: u64,
        fill: impl FnOnce(&mut T),
    ) -> Result<(), StageError> {
        Outbox::new(self.sink, stamp_ns, self.source_seq).send(channel, fill).map(drop)
    }
}

/// The part that replaces a process of the navigator: its stage, and the messages that it has sent.
pub(crate) struct Part {
    access: Access,
    stage: Box<dyn Hosted>,
    pub(crate) memory: InProcess,
    /// Time spent in the stage so far.
    pub(crate) spent: Duration,
}

impl Part {
    /// Creates the part for a process, or returns `None` if the process hosts no stage.
    pub(crate) fn new(
        process: Process,
        run: &RunConfig,
        files: &Files<'_>,
    ) -> Result<Option<Self>, RehearsalError> {
        let began = Clock::now();
        let navigator = sketchnav_navigators::of(&run.mission)?;
        let stage = navigator.stage(process, run, files).map_err(RehearsalError::Stage)?;
        let memory = InProcess::of_writer(process, navigator.kind);
        let access = Access::new(process, navigator.kind);
        Ok(stage.map(|stage| Self { access, stage, memory, spent: began.elapsed() }))
    }

    pub(crate) fn is_ready(&self) -> Result<bool, StageError> {
        self.stage.is_ready()
    }

    /// Passes an instruction or a request to the stage. If it is a request, the stage answers it immediately.
    pub(crate) fn receive(
        &mut self,
        spec: &'static ChannelSpec,
        message: &Owned,
        tap: &mut impl Tap,
    ) -> Result<(), StageError> {
        let began = Clock::now();
        let incoming = Incoming::new(&self.access, spec, message.bytes(), message.cells());
        let result = self.stage.receive(&incoming);
        self.spent += began.elapsed();
        result?;
        if spec.role == Role::Request { self.announce(*erased::header(message.bytes()), tap) } else { Ok(()) }
    }

    pub(crate) fn announce(&mut self, cause: Header, tap: &mut impl Tap) -> Result<(), StageError> {
        let began = Clock::now();
        let mut sink = self.memory.tapped(tap);
        let said = self.stage.announce(&mut Outbox::new(&mut sink, cause.stamp_ns, cause.seq));
        self.spent += began.elapsed();
        said
    }

    /// Lets the stage take its step for an instant.
    pub(crate) fn step(
        &mut self,
        (tick, stamp_ns): (u64, u64),
        inputs: &dyn Inputs,
        tap: &mut impl Tap,
    ) -> Result<(), StageError> {
        let began = Clock::now();
        let mut sink = self.memory.tapped(tap);
        let mut out = Outbox::new(&mut sink, stamp_ns, tick);
        let instant = Instant::new(&self.access, tick, stamp_ns, inputs);
        let stepped = sketchnav_stage::step(self.stage.as_mut(), &instant, &mut out);
        self.spent += began.elapsed();
        stepped
    }
}

/// Sends an order in place of the supervisor and returns the message.
pub(crate) fn order(
    memory: &mut InProcess,
    stamp_ns: u64,
    (order, here): (Order, Option<Here>),
    tap: &mut impl Tap,
) -> Result<Owned, StageError> {
    let mut sink = memory.tapped(tap);
    Outbox::new(&mut sink, stamp_ns, 0).send(MISSION, |mission| {
        mission.order = order.code();
        here.iter().for_each(|here| mission.set_here(here));
    })?;
    drop(sink);
    Ok(memory.get(MISSION.spec).cloned().unwrap_or_default())
}

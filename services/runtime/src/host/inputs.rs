//! The channels that a stage reads. Instructions and requests are delivered as they arrive. An instant
//! consists of a tick, the readings that the tick refers to, and the message that the step responds to.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::channels::{self, ChannelSpec, Role};
use sketchnav_schemas::message::Tick;
use sketchnav_stage::{Access, Instant, Reading};

use crate::{Node, RawReader, RawSample, Result};

/// Numbers of the last messages taken from the channels, by kind of channel.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Positions {
    instructions: Vec<u64>,
    requests: Vec<u64>,
    /// Numbers of the readings that belong to the last instant.
    sensors: Vec<u64>,
    tick: u64,
    trigger: u64,
    /// The last tick that got a response before a start without a checkpoint.
    answered: u64,
    /// Time and number of the last request.
    last_request: (u64, u64),
}

pub(super) struct Inputs {
    access: Access,
    instructions: Vec<RawReader>,
    requests: Vec<Requests>,
    last_request: (u64, u64),
    sensors: Vec<Sensor>,
    ticks: Option<Queue>,
    /// Queue of the messages that steps respond to, if these are not the ticks.
    triggers: Option<Queue>,
    /// The last tick that got a response before a start without a checkpoint.
    answered: u64,
    /// Buffer for [`Inputs::positions`].
    positions: Positions,
}

struct Requests {
    reader: RawReader,
    /// Number of the last message taken in.
    taken: u64,
}

/// A channel that contributes one message to each instant: the ticks, or the messages that steps answer.
struct Queue {
    reader: RawReader,
    /// The message of the instant that is being assembled.
    current: Option<RawSample>,
    /// Number of the last instant's message.
    taken: u64,
}

impl Inputs {
    pub(super) fn open(node: &Node, kind: &str) -> Result<Self> {
        let process = node.process();
        let trigger = channels::trigger_of(process, kind);
        let of_role = |role| channels::read_by(process, kind).filter(move |spec| spec.role == role);
        let readers = |role| of_role(role).map(|spec| node.raw_reader(spec)).collect::<Result<Vec<_>>>();
        let mut instructions = readers(Role::Instruction)?;
        instructions.iter_mut().for_each(RawReader::resume_anywhere);
        let requests = readers(Role::Request)?.into_iter().map(|reader| Requests { reader, taken: 0 });
        let sensors = readers(Role::Sensor)?.into_iter().map(Sensor::new);
        let queue = |spec| Ok(Queue { reader: node.raw_reader(spec)?, current: None, taken: 0 });
        let ticks = of_role(Role::Tick).next().filter(|_| trigger.is_some()).map(queue);
        let triggers = trigger.filter(|spec| spec.role != Role::Tick).map(queue);
        Ok(Self {
            access: Access::new(process, kind),
            instructions,
            requests: requests.collect(),
            last_request: (0, 0),
            sensors: sensors.collect(),
            ticks: ticks.transpose()?,
            triggers: triggers.transpose()?,
            answered: 0,
            positions: Positions::default(),
        })
    }

    /// Returns the stage's access to channels.
    pub(super) fn access(&self) -> &Access {
        &self.access
    }

    pub(super) fn next_instruction(&mut self) -> Result<Option<(&'static ChannelSpec, RawSample)>> {
        for reader in &mut self.instructions {
            if let Some(sample) = reader.receive_valid()? {
                return Ok(Some((reader.spec(), sample)));
            }
        }
        Ok(None)
    }

    /// Returns true if each instruction, or a newer one, has arrived.
    pub(super) fn has_instructions(&self, awaited: &Positions) -> bool {
        let came = self.instructions.iter().map(RawReader::position);
        came.zip(&awaited.instructions).all(|(came, &awaited)| came >= awaited)
    }

    /// Returns the next request, and the index of its channel. The same request is returned until [`Inputs::take_request`] is
    /// called.
    pub(super) fn next_request(&mut self) -> Result<Option<(usize, RawSample)>> {
        for (index, requests) in self.requests.iter_mut().enumerate() {
            if let Some(sample) = requests.reader.receive_valid()? {
                return Ok(Some((index, sample)));
            }
        }
        Ok(None)
    }

    pub(super) fn request_spec(&self, index: usize) -> &'static ChannelSpec {
        self.requests[index].reader.spec()
    }

    pub(super) fn take_request(&mut self, index: usize, stamp_ns: u64, seq: u64) {
        self.requests[index].taken = seq;
        self.last_request = (stamp_ns, seq);
    }

    /// Returns the time and the number of the last request that was taken in.
    pub(super) fn last_request(&self) -> (u64, u64) {
        self.last_request
    }

    /// Advances to the next instant if all its parts have arrived. Returns true if it did. Which part arrives
    /// first is a matter of chance, since a reader that joins late gets the history of each channel when its
    /// writer next serves it.
    pub(super) fn next_instant(&mut self, node: &Node) -> Result<bool> {
        let Self { ticks, triggers, answered, sensors, .. } = self;
        let Some(ticks) = ticks else { return Ok(false) };
        let is_there = match triggers {
            None => ticks.next_after(*answered)?,
            Some(triggers) => triggers.next_with_tick(ticks, *answered)?,
        };
        let Some(tick) = ticks.current.as_ref().filter(|_| is_there) else { return Ok(false) };
        let tick: &Tick = bytemuck::from_bytes(tick.message());
        let mut is_whole = true;
        for sensor in sensors {
            is_whole &= sensor.advance_to(tick.newest[sensor.index], node)?;
        }
        Ok(is_whole)
    }

    /// Returns the instant that [`Inputs::next_instant`] advanced to.
    pub(super) fn instant(&self) -> Option<Instant<'_>> {
        let tick = self.ticks.as_ref()?.current.as_ref()?.header();
        Some(Instant::new(&self.access, tick.seq, tick.stamp_ns, self))
    }

    /// Ends the step. From now on, everything that has arrived belongs to an earlier instant.
    pub(super) fn end_instant(&mut self) {
        self.queues_mut().for_each(Queue::end_instant);
        self.sensors.iter_mut().for_each(Sensor::end_instant);
    }

    fn queues_mut(&mut self) -> impl Iterator<Item = &mut Queue> {
        self.ticks.iter_mut().chain(&mut self.triggers)
    }

    pub(super) fn positions(&mut self) -> &Positions {
        let Positions { instructions, requests, sensors, .. } = &mut self.positions;
        instructions.clear();
        instructions.extend(self.instructions.iter().map(RawReader::position));
        requests.clear();
        requests.extend(self.requests.iter().map(|requests| requests.taken));
        sensors.clear();
        sensors.extend(self.sensors.iter().map(|sensor| sensor.before));
        self.positions.tick = self.ticks.as_ref().map_or(0, |ticks| ticks.taken);
        self.positions.trigger = self.triggers.as_ref().map_or(0, |triggers| triggers.taken);
        self.positions.answered = self.answered;
        self.positions.last_request = self.last_request;
        &self.positions
    }

    /// Returns true if the instant of this tick is still to come.
    pub(super) fn is_before(&self, tick: u64) -> bool {
        self.ticks.as_ref().is_some_and(|ticks| ticks.taken < tick)
    }

    /// Resumes after the messages that the process had received before it was killed. Instructions are delivered again, and the
    /// latest reading of each sensor is taken once more, because it belongs to the instants that follow.
    pub(super) fn resume(&mut self, positions: &Positions) {
        for (requests, &taken) in self.requests.iter_mut().zip(&positions.requests) {
            requests.taken = taken;
            requests.reader.resume_after(taken);
        }
        for (sensor, &before) in self.sensors.iter_mut().zip(&positions.sensors) {
            sensor.before = before;
            sensor.reader.resume_after(before.saturating_sub(1));
        }
        if let Some(ticks) = &mut self.ticks {
            ticks.taken = positions.tick;
            ticks.reader.resume_after(positions.tick);
        }
        if let Some(triggers) = &mut self.triggers {
            triggers.taken = positions.trigger;
            triggers.reader.resume_after(positions.trigger);
        }
        self.answered = positions.answered;
        self.last_request = positions.last_request;
    }

    /// Resumes after the tick `answered` with the messages that the channels still contain. Earlier requests
    /// from the pad are skipped. Drawings need not be skipped, because no history stores them.
    pub(super) fn resume_after(&mut self, answered: u64, node: &Node) -> Result<()> {
        self.answered = answered;
        for requests in self.requests.iter_mut().filter(|requests| is_of_people(requests.reader.spec())) {
            requests.reader.take_kept(node, |_| {})?;
            requests.taken = requests.reader.position();
        }
        let readers = self.sensors.iter_mut().map(|sensor| &mut sensor.reader);
        let readers = readers.chain(self.ticks.iter_mut().map(|ticks| &mut ticks.reader));
        let readers = readers.chain(self.triggers.iter_mut().map(|triggers| &mut triggers.reader));
        let drawings = self.requests.iter_mut().map(|requests| &mut requests.reader);
        readers
            .chain(drawings.filter(|reader| reader.spec().max_cells > 0))
            .for_each(RawReader::resume_anywhere);
        Ok(())
    }
}

fn is_of_people(spec: &ChannelSpec) -> bool {
    spec.writer == Some(sketchnav_schemas::codes::Process::Pad)
}

impl sketchnav_stage::Inputs for Inputs {
    fn newest(&self, spec: &ChannelSpec) -> Option<Reading<'_>> {
        if let Some(sensor) = self.sensors.iter().find(|sensor| sensor.reader.spec() == spec) {
            let newest = sensor.newest.as_ref()?;
            return Some(reading(newest, newest.header().seq > sensor.before));
        }
        let mut queues = self.ticks.iter().chain(&self.triggers);
        let queue = queues.find(|queue| queue.reader.spec() == spec)?;
        queue.current.as_ref().map(|current| reading(current, true))
    }
}

fn reading(sample: &RawSample, is_fresh: bool) -> Reading<'_> {
    Reading { message: sample.message(), cells: sample.cells(), is_fresh }
}

impl Queue {
    /// Takes the next message that no predecessor has answered, unless there is a current one. Returns true if there is one now.
    fn next_after(&mut self, answered: u64) -> Result<bool> {
        while self.current.is_none() {
            let Some(next) = self.reader.receive_valid()? else { return Ok(false) };
            self.current = Some(next).filter(|next| self.tick_of(next) > answered);
        }
        Ok(true)
    }

    /// Takes the next message whose tick has arrived. Returns true if both have arrived. A message without
    /// its tick, as after an overflow in real time, is skipped, since its readings may be missing as well.
    fn next_with_tick(&mut self, ticks: &mut Self, answered: u64) -> Result<bool> {
        while self.next_after(answered)? {
            if !ticks.advance_to(self.tick())? {
                return Ok(false);
            }
            if ticks.tick() == self.tick() {
                return Ok(true);
            }
            self.end_instant();
        }
        Ok(false)
    }

    /// Advances to the tick with this number, or to the first one after it. Returns true if it has arrived.
    fn advance_to(&mut self, tick: u64) -> Result<bool> {
        while self.tick() < tick {
            let Some(next) = self.reader.receive_valid()? else { return Ok(false) };
            self.current = Some(next);
        }
        Ok(true)
    }

    /// Returns the number of the current tick, or of the tick that caused the current message, or 0 if there is none.
    fn tick(&self) -> u64 {
        self.current.as_ref().map_or(0, |current| self.tick_of(current))
    }

    fn tick_of(&self, sample: &RawSample) -> u64 {
        let header = sample.header();
        if self.reader.spec().role == Role::Tick { header.seq } else { header.source_seq }
    }

    fn end_instant(&mut self) {
        self.taken = self.current.take().map_or(self.taken, |current| current.header().seq);
    }
}

/// The channel of a sensor, read only up to the message that the tick refers to.
struct Sensor {
    reader: RawReader,
    /// Index of the sensor in [`Tick::newest`].
    index: usize,
    newest: Option<RawSample>,
    /// A reading that belongs to a later instant.
    next: Option<RawSample>,
    /// Number of the latest reading at the previous instant.
    before: u64,
}

impl Sensor {
    fn new(reader: RawReader) -> Self {
        let index = channels::sensors().position(|spec| spec == reader.spec()).unwrap_or_default();
        Self { reader, index, newest: None, next: None, before: 0 }
    }

    /// Takes the readings up to the number `seq`. Returns true if all have arrived. Invalid readings are rejected and counted.
    fn advance_to(&mut self, seq: u64, node: &Node) -> Result<bool> {
        loop {
            if self.next.is_none() && self.reader.position() < seq {
                self.next = self.reader.receive()?;
            }
            let Some(reading) = self.next.take_if(|next| next.header().seq <= seq) else {
                return Ok(self.next.is_some() || self.reader.position() >= seq);
            };
            let spec = self.reader.spec();
            match spec.message.check(reading.message()) {
                Ok(()) => self.newest = Some(reading),
                Err(why) => node.count_invalid(spec.name, reading.header().seq, &why),
            }
        }
    }

    fn end_instant(&mut self) {
        self.before = self.newest.as_ref().map_or(self.before, |newest| newest.header().seq);
    }
}

//! Runs a stage of a navigator as a process: its channels, steps, checkpoints and health.
//!
//! The table of channels determines what the process reads and writes. Instructions and requests are
//! delivered as they arrive, and each request is delivered after the instructions that were sent before it.
//! Instants are processed one after another, each with all the readings that its tick refers to.
//!
//! After a kill, the restarted process resumes from the last checkpoint. It receives the current
//! instructions, takes its inputs since the checkpoint from the channels' histories, and sends only what has
//! not been sent yet.
//!
//! A checkpoint is written every few steps, before and after each request, and after instructions. The arrival time of a person's
//! request is random, so a step after the request cannot be computed again from a state before it.

mod inputs;
mod outputs;

use std::time::Duration;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::channels;
use sketchnav_stage::{Hosted, Incoming, Outbox, StageError};

use self::inputs::Inputs;
use self::outputs::Outputs;
use crate::{Checkpoints, Error, Found, HealthReporter, Node, RawSample, Step, Wake};

/// Maximum sleep between two checks of the channels.
const NAP: Duration = Duration::from_millis(250);

/// The reason why a process that hosts a stage ended before it was asked to.
#[derive(Debug, thiserror::Error)]
pub enum HostError {
    /// Shared memory, a channel or a checkpoint failed.
    #[error(transparent)]
    Runtime(#[from] Error),
    /// The stage failed.
    #[error("{0}")]
    Stage(#[source] StageError),
}

impl From<StageError> for HostError {
    /// Unwraps an error of the outbox, which a stage passes on, because a failure of shared memory is not the stage's fault.
    fn from(error: StageError) -> Self {
        error.downcast().map_or_else(Self::Stage, |error| Self::Runtime(*error))
    }
}

/// Runs `stage` as the node's process until the process is asked to end.
///
/// # Errors
/// [`HostError::Stage`] if the stage failed, and [`HostError::Runtime`] otherwise.
pub fn host(node: &Node, stage: &mut dyn Hosted) -> Result<(), HostError> {
    let kind = node.run_config()?.mission.navigator_kind().to_owned();
    let health = HealthReporter::new(node)?;
    let (checkpoints, found) = Checkpoints::open_with(node, stage.form(), parse)?;
    found.report(node);
    let (inputs, outputs) = (Inputs::open(node, &kind)?, Outputs::open(node, &kind)?);
    let spoken_from = outputs::Positions::default();
    let mut host = Host {
        node,
        stage,
        inputs,
        outputs,
        health,
        checkpoints,
        spoken_from,
        attempts: 0,
        stamp_ns: 0,
        answered: 0,
    };
    if host.resume(&kind, found)? {
        host.serve()?;
    }
    Ok(host.health.report(host.stamp_ns)?)
}

/// The part of a checkpoint that precedes the stage's own state.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Head {
    inputs: inputs::Positions,
    outputs: outputs::Positions,
    /// Positions of the outputs before the stage's last announcement, which it repeats after a restart.
    spoken_from: outputs::Positions,
    /// Number of times that the stage began to handle the next request without completing it.
    attempts: u32,
    stamp_ns: u64,
}

/// Borrowed counterpart of [`Head`], used for writing a checkpoint.
#[derive(Serialize)]
struct HeadView<'a> {
    inputs: &'a inputs::Positions,
    outputs: &'a outputs::Positions,
    spoken_from: &'a outputs::Positions,
    attempts: u32,
    stamp_ns: u64,
}

/// A checkpoint as read back.
struct Saved {
    head: Head,
    stage: Vec<u8>,
}

fn parse(bytes: &[u8]) -> postcard::Result<Saved> {
    let (head, stage) = postcard::take_from_bytes(bytes)?;
    Ok(Saved { head, stage: stage.to_vec() })
}

struct Host<'a> {
    node: &'a Node,
    stage: &'a mut dyn Hosted,
    inputs: Inputs,
    outputs: Outputs,
    health: HealthReporter,
    checkpoints: Checkpoints<Saved>,
    /// Positions of the outputs before the stage's last announcement.
    spoken_from: outputs::Positions,
    /// Number of times that the process has already died while handling the next request.
    attempts: u32,
    /// Simulation time of the last instant, in nanoseconds.
    stamp_ns: u64,
    /// Number of the last tick that an earlier instance responded to.
    answered: u64,
}

impl Host<'_> {
    fn serve(&mut self) -> Result<(), HostError> {
        loop {
            self.receive_all()?;
            while self.stage.is_ready()? && self.inputs.next_instant(self.node)? {
                self.step()?;
                self.health.report_if_due(self.stamp_ns)?;
                if self.node.end_requested() {
                    return Ok(());
                }
                self.receive_all()?;
            }
            self.health.report_if_due(self.stamp_ns)?;
            if self.node.wait(NAP) == Wake::Terminate {
                return Ok(());
            }
        }
    }

    fn step(&mut self) -> Result<(), HostError> {
        let step = Step::begin();
        if let Some(instant) = self.inputs.instant() {
            self.stamp_ns = instant.stamp_ns;
            let mut out = Outbox::new(&mut self.outputs, instant.stamp_ns, instant.tick);
            sketchnav_stage::step(self.stage, &instant, &mut out)?;
        }
        self.inputs.end_instant();
        if self.checkpoints.is_due_after_step() {
            self.write_checkpoint()?;
        }
        self.health.end(step);
        Ok(())
    }

    /// Delivers everything that has arrived. The instructions come before each request, because the request may refer to what was
    /// drawn before it. A request waits until all responses of the process before the kill have been computed again, because the
    /// request was made later.
    fn receive_all(&mut self) -> Result<(), HostError> {
        loop {
            if self.receive_instructions()? {
                self.write_checkpoint()?;
            }
            if self.inputs.is_before(self.answered) {
                return Ok(());
            }
            let Some((index, request)) = self.inputs.next_request()? else { return Ok(()) };
            self.receive_instructions()?;
            self.receive_request(index, &request)?;
        }
    }

    /// Delivers the instructions that have arrived. Returns true if there were any.
    fn receive_instructions(&mut self) -> Result<bool, HostError> {
        let mut is_new = false;
        while let Some((spec, sample)) = self.inputs.next_instruction()? {
            let incoming = Incoming::new(self.inputs.access(), spec, sample.message(), sample.cells());
            self.stage.receive(&incoming)?;
            is_new = true;
        }
        Ok(is_new)
    }

    /// Delivers a request, and counts how often it has killed the process, so that the stage can refuse it.
    fn receive_request(&mut self, index: usize, request: &RawSample) -> Result<(), HostError> {
        let step = Step::begin();
        let header = *request.header();
        self.attempts += 1;
        self.write_checkpoint()?;
        let spec = self.inputs.request_spec(index);
        let incoming = Incoming::new(self.inputs.access(), spec, request.message(), request.cells());
        self.stage.receive(&incoming.again(self.attempts - 1))?;
        self.inputs.take_request(index, header.stamp_ns, header.seq);
        self.spoken_from.clone_from(self.outputs.positions());
        self.attempts = 0;
        // This must come before the answer is sent, because a sender that has the answer may forget the request.
        self.write_checkpoint()?;
        self.announce(header.stamp_ns, header.seq, false)?;
        self.health.end(step);
        Ok(())
    }

    fn announce(&mut self, stamp_ns: u64, source_seq: u64, is_resuming: bool) -> Result<(), HostError> {
        let mut out = Outbox::new(&mut self.outputs, stamp_ns, source_seq).resuming(is_resuming);
        Ok(self.stage.announce(&mut out)?)
    }

    fn write_checkpoint(&mut self) -> Result<(), HostError> {
        let Self { inputs, outputs, spoken_from, stage, attempts, stamp_ns, .. } = self;
        let (inputs, outputs) = (inputs.positions(), outputs.positions());
        let head = HeadView { inputs, outputs, spoken_from, attempts: *attempts, stamp_ns: *stamp_ns };
        self.checkpoints.write_with(|room| {
            let used = postcard::to_slice(&head, room)?.len();
            Ok(used + stage.save(&mut room[used..])?)
        })
    }

    /// Continues from where the predecessor stopped. Returns false if the process is asked to end first.
    fn resume(&mut self, kind: &str, found: Found<Saved>) -> Result<bool, HostError> {
        let is_lost = found.is_lost();
        let head = found.state.as_ref().map(|saved| saved.head.clone());
        if let Some(saved) = found.state {
            self.inputs.resume(&saved.head.inputs);
            self.outputs.resume(&saved.head.spoken_from);
            self.spoken_from.clone_from(&saved.head.spoken_from);
            (self.attempts, self.stamp_ns) = (saved.head.attempts, saved.head.stamp_ns);
            if !self.await_instructions(&saved.head.inputs)? {
                return Ok(false);
            }
            self.load(&saved.stage)?;
            self.answered = self.last_answered(kind);
        } else if is_lost {
            self.start_over(kind)?;
        }
        let step = Step::begin();
        let (stamp_ns, source_seq) = self.inputs.last_request();
        self.announce(stamp_ns, source_seq, head.is_some())?;
        if let Some(head) = &head {
            self.outputs.resume_no_earlier(&head.outputs);
        }
        self.health.end(step);
        Ok(true)
    }

    /// Loads a state into the stage. If the stage rejects a state, that state is hidden from the restarted
    /// process, which then resumes from an older one or starts from scratch.
    fn load(&mut self, state: &[u8]) -> Result<(), HostError> {
        let loaded = self.stage.load(state);
        Ok(loaded.map_err(|error| self.checkpoints.refuse_newest(&error.to_string()))?)
    }

    /// Delivers instructions until those that the state depends on, or newer ones, have arrived. Returns false if the process is
    /// asked to end first.
    fn await_instructions(&mut self, awaited: &inputs::Positions) -> Result<bool, HostError> {
        loop {
            self.receive_instructions()?;
            if self.inputs.has_instructions(awaited) {
                return Ok(true);
            }
            self.health.report_if_due(self.stamp_ns)?;
            if self.node.wait(NAP) == Wake::Terminate {
                return Ok(false);
            }
        }
    }

    /// Returns the number of the last tick that a predecessor answered, or 0 if there is none.
    fn last_answered(&self, kind: &str) -> u64 {
        let last_word = channels::last_word_of(self.node.process(), kind);
        last_word.and_then(|spec| self.outputs.last_sent(spec)).map_or(0, |header| header.source_seq)
    }

    /// Starts from scratch with the last messages sent before the kill, because no checkpoint can be used.
    /// Earlier requests from people are outdated by now, and must not make the robot drive off.
    fn start_over(&mut self, kind: &str) -> Result<(), HostError> {
        self.outputs.resume_after_history();
        let (process, answered) = (self.node.process(), self.last_answered(kind));
        sketchnav_schemas::say!(
            "no checkpoint can be used: the {process} restarts from scratch after tick {answered}"
        );
        self.spoken_from.clone_from(self.outputs.positions());
        self.inputs.resume_after(answered, self.node)?;
        Ok(self.stage.recover(&self.outputs)?)
    }
}

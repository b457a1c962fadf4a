//! The steps of Boniardi et al. 2016, figure 4: draw a map, send it, draw a path, send it, execute, abort, restore or start again.
//! This module determines which steps are allowed for which page, and the navigator's response to the last one.
//!
//! This module is pure: it takes events and returns what to send. Times are measured since the pad's start,
//! by the caller's clock. After an order, the planner's statuses only count once they can reflect the order.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::codes::{DrawingKind, Order, TaskState};
use sketchnav_schemas::message::{MissionStatus, Understood};

use crate::protocol::{PathRequest, Refusal, SketchRequest, SketchType, Step};

/// Number of statuses after an order, or after new tasks, that may still refer to the time before. One may
/// have been in transit, and the other is a safety margin.
const SETTLING: u32 = 2;
/// Time without a status after which the planner counts as unresponsive.
const STALE: Duration = Duration::from_millis(1500);
/// Maximum time that the sketcher may take to read a drawing.
const PATIENCE: Duration = Duration::from_secs(60);

/// The state of the mission, as shown to people.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// Nothing has been sent yet.
    NoSketch,
    /// A sketch has been sent.
    Sketch,
    /// A path has been sent.
    Path,
    /// The robot drives, or is about to.
    Driving,
    /// A page has aborted the mission.
    Aborted,
    /// The robot waits for the driver.
    Paused,
    /// All tasks have ended.
    Ended,
}

/// A drawing that the sketcher has accepted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AcceptedSketch {
    /// Its type.
    pub kind: SketchType,
    /// The content as it was sent.
    pub bytes: Vec<u8>,
    /// Width and height of the canvas, in image pixels.
    pub canvas: [u32; 2],
    /// Width and height of the grid, in pixels.
    pub size_px: [u32; 2],
    /// Pixels of the grid per image pixel.
    pub scale: f64,
}

/// A path drawn in the sketch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Path {
    /// The body as it was sent.
    pub body: String,
    /// The marks as JSON, in the form that the sketcher reads.
    pub marks: Vec<u8>,
    /// The marks that placed the robot, as JSON. They are these or earlier ones.
    pub placing: Vec<u8>,
    /// The sketch that the robot was placed in.
    pub sketch_seq: u64,
}

/// A drawing that the sketcher has not yet responded to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pending {
    /// Its number on the channel.
    pub seq: u64,
    /// The drawing.
    pub what: Submission,
    /// When it was sent. Reset by a restarted pad.
    #[serde(skip)]
    pub since: Duration,
    /// Whether its sender has been notified that the sketcher does not respond. A response may still arrive.
    #[serde(default)]
    pub late: bool,
}

/// Something sent to the sketcher.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Submission {
    /// A drawing.
    Sketch {
        /// Its type.
        kind: SketchType,
        /// The content as it was sent.
        bytes: Vec<u8>,
        /// Its canvas, if it specifies one.
        canvas: Option<[u32; 2]>,
    },
    /// The file of a map learned by the sketch, which takes its place.
    Learned(Vec<u8>),
    /// A path drawn in the sketch.
    Path {
        /// The body as it was sent.
        body: String,
        /// The marks as JSON, in the form that the sketcher reads.
        marks: Vec<u8>,
    },
}

impl Submission {
    /// The kind, as in the channel's message.
    pub fn kind(&self) -> DrawingKind {
        match self {
            Self::Sketch { .. } | Self::Learned(_) => DrawingKind::Sketch,
            Self::Path { .. } => DrawingKind::Route,
        }
    }

    /// The bytes that follow the message.
    pub fn bytes(&self) -> &[u8] {
        match self {
            Self::Sketch { bytes, .. } | Self::Learned(bytes) | Self::Path { marks: bytes, .. } => bytes,
        }
    }
}

/// The state that a successor needs.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// Number of the last drawing that was sent, or 0 before the first.
    pub drawing_seq: u64,
    /// The current sketch.
    pub sketch: Option<AcceptedSketch>,
    /// The file of a map learned by the sketch, if the robot drives in it.
    pub learned: Option<Vec<u8>>,
    /// The current path.
    pub path: Option<Path>,
    /// The drawing that is waiting for a response.
    pub pending: Option<Pending>,
    /// Whether a page has ordered the robot to drive the path.
    pub ordered: bool,
}

/// The state of the machine.
#[derive(Debug)]
pub struct Machine {
    draws: bool,
    memory: Memory,
    status: Option<MissionStatus>,
    status_at: Duration,
    /// Whether the robot is localized, if it needs to be.
    is_located: bool,
    /// Whether the robot is asking where it is.
    is_asking: bool,
    /// Whether something was learned that has not been accepted or rejected yet.
    is_offered: bool,
    /// Number of upcoming statuses that may still refer to the time before the last order.
    settling: u32,
    /// The state until they have arrived.
    assumed: Option<State>,
}

impl Machine {
    /// Creates a machine. If `draws` is set, the drawing and the tasks come from the page. Otherwise, the
    /// page watches a mission from a file.
    pub fn new(draws: bool) -> Self {
        let (memory, status_at) = (Memory::default(), Duration::ZERO);
        Self {
            draws,
            memory,
            status: None,
            status_at,
            is_located: false,
            is_asking: false,
            is_offered: false,
            settling: 0,
            assumed: None,
        }
    }

    /// Resumes from the memory of a previous pad.
    pub fn resume(&mut self, mut memory: Memory, now: Duration) {
        if let Some(pending) = &mut memory.pending {
            pending.since = now;
        }
        self.memory = memory;
    }

    /// Starts after a previous pad, of which only the number of the last drawing is known. A page may have ordered the robot to
    /// drive.
    pub fn resume_after(&mut self, drawing_seq: u64) {
        self.memory.drawing_seq = drawing_seq;
        self.memory.ordered = true;
    }

    /// The state for a checkpoint.
    pub fn memory(&self) -> &Memory {
        &self.memory
    }

    /// Processes a status of the planner.
    pub fn on_status(&mut self, status: &MissionStatus, now: Duration) {
        self.status_at = now;
        self.settling = self.settling.saturating_sub(1);
        if self.settling == 0 {
            self.assumed = None;
            self.status = Some(*status);
        }
    }

    /// Processes the lookout's report on whether the robot is localized, if it needs to be, and whether it is asking a person.
    pub fn on_lookout(&mut self, is_located: bool, is_asking: bool) {
        (self.is_located, self.is_asking) = (is_located, is_asking);
    }

    /// Records whether something was learned that a person may accept or reject.
    pub fn offer(&mut self, is_offered: bool) {
        self.is_offered = is_offered;
    }

    /// Returns true if the robot is waiting for a person to set its position.
    pub fn asks(&self) -> bool {
        self.is_asking && self.state() == State::Paused
    }

    /// Returns the planner's last status that counts.
    pub fn status(&self) -> Option<&MissionStatus> {
        self.status.as_ref().filter(|_| self.assumed.is_none())
    }

    /// Returns the state as shown to people. A driving robot counts as driving even if its drawing is no longer known.
    pub fn state(&self) -> State {
        let state = self.assumed.unwrap_or_else(|| self.told());
        match (&self.memory.sketch, &self.memory.path) {
            _ if !self.draws || state == State::Driving => state,
            (None, _) => State::NoSketch,
            (Some(_), None) => State::Sketch,
            (Some(_), Some(_)) => state,
        }
    }

    /// Returns the state according to the planner. If the planner waits, or has not sent anything yet, and
    /// has been ordered to drive, it is about to drive. The order comes from a page or, if the mission is
    /// from a file, from the supervisor.
    fn told(&self) -> State {
        let state = self.status.and_then(|status| TaskState::from_code(status.state));
        let is_ordered = self.memory.ordered || !self.draws;
        match state {
            None | Some(TaskState::Waiting) if is_ordered => State::Driving,
            None | Some(TaskState::Waiting) => State::Path,
            Some(TaskState::Paused) => State::Paused,
            Some(TaskState::Aborted) => State::Aborted,
            Some(TaskState::Finished) => State::Ended,
            Some(_) => State::Driving,
        }
    }

    /// Returns true if the navigator responds and, if there is a path, the robot is localized.
    pub fn is_ready(&self, now: Duration) -> bool {
        let answers = self.status_at > Duration::ZERO && now.saturating_sub(self.status_at) < STALE;
        let needs_pose = !self.draws || self.memory.path.is_some();
        answers && (!needs_pose || self.is_located) && self.settling == 0
    }

    /// Returns the steps that a page may take. `drives` indicates whether it has the wheel.
    pub fn allowed(&self, drives: bool, now: Duration) -> Vec<Step> {
        let drawing = [Step::Sketch, Step::Path];
        let orders = [Step::Execute, Step::Abort, Step::Restore, Step::Again, Step::Here];
        let steps = drawing.into_iter().chain(orders).chain([Step::Accept, Step::Reject]);
        steps.filter(|&step| self.check(step, drives, now).is_ok()).collect()
    }

    /// Checks whether a step is allowed.
    ///
    /// # Errors
    /// [`Refusal`], which states what is required.
    pub fn check(&self, step: Step, drives: bool, now: Duration) -> Result<(), Refusal> {
        // Anyone who sees that something goes wrong may stop the robot, even without the wheel.
        if step == Step::Abort {
            let words = || not_now("the robot drives", self.state());
            return if self.may_be_under_way() { Ok(()) } else { Err(words()) };
        }
        if !drives {
            return Err(Refusal::watches());
        }
        self.check_state(step)?;
        let is_drawing = matches!(step, Step::Sketch | Step::Path | Step::Accept | Step::Reject);
        if is_drawing && self.memory.pending.as_ref().is_some_and(|pending| !pending.late) {
            return Err(Refusal::NotNow("the last drawing is still being read".into()));
        }
        if !is_drawing && !self.is_ready(now) {
            return Err(Refusal::Absent("the navigation is not ready: it is waiting or restarting".into()));
        }
        Ok(())
    }

    /// Returns true if there may be something to abort. A superfluous abort has no effect, whereas one that is not passed on would
    /// let the robot drive off.
    fn may_be_under_way(&self) -> bool {
        match self.state() {
            State::Driving | State::Paused => true,
            // It has been ordered to continue in the meantime, and the planner has not confirmed that yet.
            State::Aborted => self.memory.ordered,
            State::NoSketch | State::Sketch | State::Path | State::Ended => false,
        }
    }

    fn check_state(&self, step: Step) -> Result<(), Refusal> {
        let state = self.state();
        let is_page_only = !matches!(step, Step::Abort | Step::Restore | Step::Here);
        if !self.draws && is_page_only {
            return Err(Refusal::NotNow(
                "the drawing and the tasks of this run come from a mission file".into(),
            ));
        }
        let (holds, expected) = match step {
            Step::Sketch => (state != State::Driving, "the robot is standing still"),
            Step::Path => {
                let holds = !matches!(state, State::Driving | State::NoSketch);
                (holds, "a sketch has been sent and the robot is standing still")
            }
            Step::Execute => (state == State::Path, "a path has been sent but not driven yet"),
            Step::Restore => (matches!(state, State::Aborted | State::Paused), "the robot was stopped"),
            Step::Again => {
                let holds = matches!(state, State::Aborted | State::Paused | State::Ended);
                (holds, "the robot was stopped, or has ended its tasks")
            }
            Step::Here => (self.asks(), "the robot asks where it is"),
            Step::Accept => {
                (self.is_offered && state != State::Driving, "something was learned on a drive that is over")
            }
            Step::Reject => {
                let is_learned = self.is_offered || self.memory.learned.is_some();
                (
                    is_learned && state != State::Driving,
                    "something was learned and the robot is standing still",
                )
            }
            Step::Abort => (true, ""),
        };
        if holds { Ok(()) } else { Err(not_now(expected, state)) }
    }

    /// Submits a drawing and returns its number.
    ///
    /// # Errors
    /// As [`Machine::check`].
    pub fn send_sketch(
        &mut self,
        request: SketchRequest,
        drives: bool,
        now: Duration,
    ) -> Result<u64, Refusal> {
        self.check(Step::Sketch, drives, now)?;
        let SketchRequest { kind, bytes, canvas } = request;
        Ok(self.submit(Submission::Sketch { kind, bytes, canvas }, now))
    }

    /// Submits marks in the drawing and returns their number.
    ///
    /// # Errors
    /// As [`Machine::check`].
    pub fn send_path(&mut self, request: PathRequest, drives: bool, now: Duration) -> Result<u64, Refusal> {
        self.check(Step::Path, drives, now)?;
        let marks = serde_json::to_vec(&request.marks).map_err(|e| Refusal::malformed("the path", e))?;
        Ok(self.submit(Submission::Path { body: request.body, marks }, now))
    }

    /// Submits a learned map and returns its number.
    ///
    /// # Errors
    /// As [`Machine::check`].
    pub fn accept(&mut self, file: Vec<u8>, drives: bool, now: Duration) -> Result<u64, Refusal> {
        self.check(Step::Accept, drives, now)?;
        self.is_offered = false;
        Ok(self.submit(Submission::Learned(file), now))
    }

    /// Discards the learned map. Returns true if the robot drove in it, in which case its drawing is submitted again.
    ///
    /// # Errors
    /// As [`Machine::check`].
    pub fn reject(&mut self, drives: bool, now: Duration) -> Result<bool, Refusal> {
        self.check(Step::Reject, drives, now)?;
        if std::mem::take(&mut self.is_offered) {
            return Ok(false);
        }
        let Some(AcceptedSketch { kind, bytes, canvas, .. }) = self.memory.sketch.clone() else {
            return Ok(false);
        };
        self.submit(Submission::Sketch { kind, bytes, canvas: Some(canvas) }, now);
        Ok(true)
    }

    fn submit(&mut self, what: Submission, now: Duration) -> u64 {
        let seq = self.memory.drawing_seq + 1;
        self.memory.drawing_seq = seq;
        self.memory.pending = Some(Pending { seq, what, since: now, late: false });
        seq
    }

    /// Processes the sketcher's response. Returns `None` if it does not belong to the pending drawing.
    pub fn on_understood(&mut self, answer: &Understood) -> Option<Result<(), Refusal>> {
        let pending = self.memory.pending.take_if(|pending| pending.seq == answer.header.source_seq)?;
        if answer.accepted == 0 {
            return Some(Err(Refusal::Drawing(answer.words.as_str().to_owned())));
        }
        match pending.what {
            Submission::Sketch { kind, bytes, canvas } => {
                let size_px = [answer.sketch_width_px, answer.sketch_height_px];
                let scale = answer.scale;
                let own = size_px.map(|side| (f64::from(side) / scale).round() as u32);
                let canvas = canvas.unwrap_or(own);
                self.memory.sketch = Some(AcceptedSketch { kind, bytes, canvas, size_px, scale });
                (self.memory.learned, self.memory.path) = (None, None);
            }
            Submission::Learned(file) => {
                (self.memory.learned, self.memory.path) = (Some(file), None);
            }
            Submission::Path { body, marks } => {
                let before = self.memory.path.take().filter(|path| path.sketch_seq == answer.sketch_seq);
                let placing = before.map_or_else(|| marks.clone(), |path| path.placing);
                self.memory.path = Some(Path { body, marks, placing, sketch_seq: answer.sketch_seq });
                self.assume(State::Path);
            }
        }
        self.memory.ordered = false;
        Some(Ok(()))
    }

    /// Gives up waiting for a sketcher that does not respond, and returns true if this has just happened.
    /// From then on, another drawing may be sent. A response that arrives before that still counts.
    pub fn has_waited_too_long(&mut self, now: Duration) -> bool {
        let pending = self.memory.pending.as_mut().filter(|pending| !pending.late);
        let late = pending.filter(|pending| now.saturating_sub(pending.since) > PATIENCE);
        late.map(|pending| pending.late = true).is_some()
    }

    /// Processes a page's order and returns the order to send to the planner.
    ///
    /// # Errors
    /// As [`Machine::check`].
    pub fn order(&mut self, step: Step, drives: bool, now: Duration) -> Result<Order, Refusal> {
        self.check(step, drives, now)?;
        let (order, state) = match step {
            Step::Execute | Step::Again => (Order::Start, State::Driving),
            Step::Abort => (Order::Abort, State::Aborted),
            Step::Restore => (Order::Resume, State::Driving),
            Step::Here => (Order::Here, State::Driving),
            Step::Sketch | Step::Path | Step::Accept | Step::Reject => {
                return Err(Refusal::Malformed("order: expected execute, abort, restore or again".into()));
            }
        };
        self.memory.ordered = order != Order::Abort;
        self.assume(state);
        Ok(order)
    }

    /// Returns the order for the planner when the driver no longer responds. A mission from a file needs no driver.
    pub fn on_silence(&mut self) -> Option<Order> {
        (self.draws && self.state() == State::Driving).then(|| {
            self.assume(State::Paused);
            Order::Unattended
        })
    }

    fn assume(&mut self, state: State) {
        (self.assumed, self.settling) = (Some(state), SETTLING);
    }
}

fn not_now(expected: &str, state: State) -> Refusal {
    let found = match state {
        State::NoSketch => "no sketch has been sent yet",
        State::Sketch => "no path has been sent yet",
        State::Path => "the path is not being driven",
        State::Driving => "the robot drives: abort first",
        State::Aborted => "the mission is aborted",
        State::Paused => "the mission is paused",
        State::Ended => "the tasks have ended",
    };
    Refusal::NotNow(format!("expected that {expected}; found that {found}"))
}

#[cfg(test)]
mod tests;

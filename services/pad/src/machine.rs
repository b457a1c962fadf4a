//! The steps of Boniardi et al. 2016, figure 4: draw a map, send it, draw a path, send it, execute, abort, restore or start
//! again. Which of them is allowed, for whom, and what the navigation has made of the last one.
//!
//! Pure: what happens goes in, what is to be sent comes out; times are since the pad's start, by the caller's
//! clock. What the planner says counts from the step on that can have known of the last order.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::codes::{DrawingKind, Order, TaskState};
use sketchnav_schemas::message::{MissionStatus, Understood};

use crate::protocol::{PathRequest, Refusal, SketchRequest, SketchType, Step};

/// Statuses after an order, or after new tasks, that may still be about what was before. One was on its way; the other
/// is to be on the safe side.
const SETTLING: u32 = 2;
/// A planner that has said nothing for so long does not answer.
const STALE: Duration = Duration::from_millis(1500);
/// Longest that the sketcher may take for a drawing.
const PATIENCE: Duration = Duration::from_secs(60);

/// Where people are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// Nothing was sent yet.
    NoSketch,
    /// The sketch was sent.
    Sketch,
    /// The path was sent.
    Path,
    /// The robot drives, or is about to.
    Driving,
    /// A page has aborted.
    Aborted,
    /// The robot waits for who drives.
    Paused,
    /// All tasks have ended.
    Ended,
}

/// A drawing that the sketcher has taken over.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AcceptedSketch {
    /// What it is.
    pub kind: SketchType,
    /// As it was sent.
    pub bytes: Vec<u8>,
    /// Width and height of the canvas, image pixels.
    pub canvas: [u32; 2],
    /// Width and height of the grid.
    pub size_px: [u32; 2],
    /// Pixels of the grid an image pixel.
    pub scale: f64,
}

/// What is marked in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Path {
    /// As it was sent.
    pub body: String,
    /// As the sketcher has it, JSON.
    pub marks: Vec<u8>,
    /// The marks that placed the robot, JSON: these or earlier ones.
    pub placing: Vec<u8>,
    /// The sketch that the robot was placed in.
    pub sketch_seq: u64,
}

/// A drawing that the sketcher has not answered yet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pending {
    /// Its number on the channel.
    pub seq: u64,
    /// What it is.
    pub what: Submission,
    /// When it was sent; not for a successor.
    #[serde(skip)]
    pub since: Duration,
    /// Whether its sender was told that the sketcher does not answer. It may answer yet.
    #[serde(default)]
    pub late: bool,
}

/// Something that goes to the sketcher.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Submission {
    /// A drawing.
    Sketch {
        /// What it is.
        kind: SketchType,
        /// As it was sent.
        bytes: Vec<u8>,
        /// Its canvas, where it says one.
        canvas: Option<[u32; 2]>,
    },
    /// What is marked in it.
    Path {
        /// As it was sent.
        body: String,
        /// As the sketcher reads it, JSON.
        marks: Vec<u8>,
    },
}

impl Submission {
    /// What the channel says of it.
    pub fn kind(&self) -> DrawingKind {
        match self {
            Self::Sketch { .. } => DrawingKind::Sketch,
            Self::Path { .. } => DrawingKind::Route,
        }
    }

    /// What goes behind the message.
    pub fn bytes(&self) -> &[u8] {
        match self {
            Self::Sketch { bytes, .. } | Self::Path { marks: bytes, .. } => bytes,
        }
    }
}

/// What a successor needs to know.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// The last drawing that was sent; 0 before the first.
    pub drawing_seq: u64,
    /// The sketch that holds.
    pub sketch: Option<AcceptedSketch>,
    /// The path that holds.
    pub path: Option<Path>,
    /// What has no answer yet.
    pub pending: Option<Pending>,
    /// Whether a page has ordered the path to be driven.
    pub ordered: bool,
}

/// What the machine knows.
#[derive(Debug)]
pub struct Machine {
    draws: bool,
    memory: Memory,
    status: Option<MissionStatus>,
    status_at: Duration,
    /// Whether the robot knows where it is, where it needs to.
    is_located: bool,
    /// Whether the robot asks where it is.
    is_asking: bool,
    /// Statuses that may still be about what was before.
    settling: u32,
    /// The state until they have come.
    assumed: Option<State>,
}

impl Machine {
    /// `draws`: the drawing and the tasks come from the page; otherwise it watches a mission from a file.
    pub fn new(draws: bool) -> Self {
        let (memory, status_at) = (Memory::default(), Duration::ZERO);
        Self {
            draws,
            memory,
            status: None,
            status_at,
            is_located: false,
            is_asking: false,
            settling: 0,
            assumed: None,
        }
    }

    /// Goes on for a predecessor.
    pub fn resume(&mut self, mut memory: Memory, now: Duration) {
        if let Some(pending) = &mut memory.pending {
            pending.since = now;
        }
        self.memory = memory;
    }

    /// Goes on for a predecessor that has left nothing but the number of its last drawing. Somebody may have ordered
    /// the robot to drive.
    pub fn begin_behind(&mut self, drawing_seq: u64) {
        self.memory.drawing_seq = drawing_seq;
        self.memory.ordered = true;
    }

    /// For a checkpoint.
    pub fn memory(&self) -> &Memory {
        &self.memory
    }

    /// The planner has said how the mission stands.
    pub fn on_status(&mut self, status: &MissionStatus, now: Duration) {
        self.status_at = now;
        self.settling = self.settling.saturating_sub(1);
        if self.settling == 0 {
            self.assumed = None;
            self.status = Some(*status);
        }
    }

    /// The navigator has said something of itself: whether the robot knows where it is, where it needs to, and whether it
    /// asks a person.
    pub fn on_lookout(&mut self, is_located: bool, is_asking: bool) {
        (self.is_located, self.is_asking) = (is_located, is_asking);
    }

    /// Whether the robot waits until a person says where it is.
    pub fn asks(&self) -> bool {
        self.is_asking && self.state() == State::Paused
    }

    /// The planner's last word that counts.
    pub fn status(&self) -> Option<&MissionStatus> {
        self.status.as_ref().filter(|_| self.assumed.is_none())
    }

    /// Where people are. A robot that drives does so even where nobody knows any more what it was sent.
    pub fn state(&self) -> State {
        let state = self.assumed.unwrap_or_else(|| self.told());
        match (&self.memory.sketch, &self.memory.path) {
            _ if !self.draws || state == State::Driving => state,
            (None, _) => State::NoSketch,
            (Some(_), None) => State::Sketch,
            (Some(_), Some(_)) => state,
        }
    }

    /// As the planner says. A planner that waits, or has said nothing yet, is about to drive where it is ordered to.
    /// The order comes from a page, or from the supervisor where the mission is from a file.
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

    /// Whether the navigation answers and, where there is a path, knows where the robot is.
    pub fn is_ready(&self, now: Duration) -> bool {
        let answers = self.status_at > Duration::ZERO && now.saturating_sub(self.status_at) < STALE;
        let needs_pose = !self.draws || self.memory.path.is_some();
        answers && (!needs_pose || self.is_located) && self.settling == 0
    }

    /// What a page may do; `drives`: whether it has the wheel.
    pub fn allowed(&self, drives: bool, now: Duration) -> Vec<Step> {
        let steps =
            [Step::Sketch, Step::Path, Step::Execute, Step::Abort, Step::Restore, Step::Again, Step::Here];
        steps.into_iter().filter(|&step| self.check(step, drives, now).is_ok()).collect()
    }

    /// Whether a step is allowed.
    ///
    /// # Errors
    /// [`Refusal`] with what it takes.
    pub fn check(&self, step: Step, drives: bool, now: Duration) -> Result<(), Refusal> {
        // Who sees that something goes wrong stops the robot, whoever has the wheel.
        if step == Step::Abort {
            let words = || not_now("the robot drives", self.state());
            return if self.may_be_under_way() { Ok(()) } else { Err(words()) };
        }
        if !drives {
            return Err(Refusal::watches());
        }
        self.check_state(step)?;
        let is_drawing = matches!(step, Step::Sketch | Step::Path);
        if is_drawing && self.memory.pending.as_ref().is_some_and(|pending| !pending.late) {
            return Err(Refusal::NotNow("the last drawing is still being read".into()));
        }
        if !is_drawing && !self.is_ready(now) {
            return Err(Refusal::Absent("the navigation is not ready: it waits, or starts again".into()));
        }
        Ok(())
    }

    /// Whether there is something to abort, as far as anybody can know. An abort too many changes nothing; one that is
    /// not passed on lets the robot drive off.
    fn may_be_under_way(&self) -> bool {
        match self.state() {
            State::Driving | State::Paused => true,
            // Somebody has ordered it to go on since, and the planner has not said so yet.
            State::Aborted => self.memory.ordered,
            State::NoSketch | State::Sketch | State::Path | State::Ended => false,
        }
    }

    fn check_state(&self, step: Step) -> Result<(), Refusal> {
        let state = self.state();
        let is_page_only = matches!(step, Step::Sketch | Step::Path | Step::Execute | Step::Again);
        if !self.draws && is_page_only {
            return Err(Refusal::NotNow(
                "the drawing and the tasks of this run come from a mission file".into(),
            ));
        }
        let (holds, expected) = match step {
            Step::Sketch => (state != State::Driving, "the robot stands"),
            Step::Path => {
                let holds = !matches!(state, State::Driving | State::NoSketch);
                (holds, "a sketch was sent and the robot stands")
            }
            Step::Execute => (state == State::Path, "a path was sent and not driven yet"),
            Step::Restore => (matches!(state, State::Aborted | State::Paused), "the robot was stopped"),
            Step::Again => {
                let holds = matches!(state, State::Aborted | State::Paused | State::Ended);
                (holds, "the robot was stopped, or has ended its tasks")
            }
            Step::Here => (self.asks(), "the robot asks where it is"),
            Step::Abort => (true, ""),
        };
        if holds { Ok(()) } else { Err(not_now(expected, state)) }
    }

    /// A drawing is to be sent.
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

    /// What is marked in it is to be sent.
    ///
    /// # Errors
    /// As [`Machine::check`].
    pub fn send_path(&mut self, request: PathRequest, drives: bool, now: Duration) -> Result<u64, Refusal> {
        self.check(Step::Path, drives, now)?;
        let marks = serde_json::to_vec(&request.marks).map_err(|e| Refusal::malformed("the path", e))?;
        Ok(self.submit(Submission::Path { body: request.body, marks }, now))
    }

    fn submit(&mut self, what: Submission, now: Duration) -> u64 {
        let seq = self.memory.drawing_seq + 1;
        self.memory.drawing_seq = seq;
        self.memory.pending = Some(Pending { seq, what, since: now, late: false });
        seq
    }

    /// The sketcher has answered; `None` where that is no answer to what is pending.
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
                self.memory.path = None;
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

    /// Gives up waiting for a sketcher that does not answer; whether it has. Another drawing may be sent from then on,
    /// and if an answer comes before that, it counts.
    pub fn has_waited_too_long(&mut self, now: Duration) -> bool {
        let pending = self.memory.pending.as_mut().filter(|pending| !pending.late);
        let late = pending.filter(|pending| now.saturating_sub(pending.since) > PATIENCE);
        late.map(|pending| pending.late = true).is_some()
    }

    /// Somebody orders something that is no drawing; what to tell the planner.
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
            Step::Sketch | Step::Path => {
                return Err(Refusal::Malformed("order: expected execute, abort, restore or again".into()));
            }
        };
        self.memory.ordered = order != Order::Abort;
        self.assume(state);
        Ok(order)
    }

    /// The driver cannot be heard any more: what to tell the planner. A mission from a file needs nobody.
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
        State::NoSketch => "no sketch was sent yet",
        State::Sketch => "no path was sent yet",
        State::Path => "the path is not being driven",
        State::Driving => "it drives: abort first",
        State::Aborted => "the mission is aborted",
        State::Paused => "the mission is paused",
        State::Ended => "the tasks have ended",
    };
    Refusal::NotNow(format!("expected that {expected}; found that {found}"))
}

#[cfg(test)]
mod tests;

//! The pad's thread that owns the node. It forwards the pages' requests, and sends them what they display.
//!
//! Everything that it sends is stored in its checkpoint first. If this process dies before the sketcher has
//! responded to a drawing, the restarted process sends the drawing again with the same number. An abort takes
//! precedence over everything that is waiting.

mod lessons;
mod lookout;
mod receive;
mod sendings;
mod show;
mod study;

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sketchnav_runtime::{Checkpoints, HealthReporter, Node, Step as WorkStep, Wake, Writer};
use sketchnav_schemas::channels::{DRAWING, ORDERS};
use sketchnav_schemas::codes::Order;
use sketchnav_schemas::message::{Drawing, Here, MissionCommand, Understood};
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::Navigator;
use sketchnav_stage::drawn::Drawn;
use tokio::sync::oneshot;

use crate::board::{Answer, Call, Caller, Calls, Request};
use crate::feed::{Ends, Services, Trail};
use crate::machine::{Machine, Memory, Submission};
use crate::metrics::Metrics;
use crate::mission_file;
use crate::protocol::{Refusal, Step, WheelWish};
use crate::sessions::{Plea, Sessions};
use crate::study::Sitting;
use crate::walls;

pub use lessons::Looked;

use lessons::Lessons;
use lookout::Watch;
use receive::{Inbox, News};
use sendings::Sendings;

/// Maximum sleep between two checks of the channels, the calls and the clock.
const NAP: Duration = Duration::from_millis(50);
/// The format of [`State`].
const CHECKPOINT: &str = "pad 6";

/// The state that a successor needs.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct State {
    machine: Memory,
    understood: u64,
    driver: Option<String>,
    pleas: Vec<Plea>,
    link_limit_s: f64,
    sendings: Sendings,
    saved: BTreeSet<String>,
    /// The code of the study's participant.
    participant: Option<String>,
}

/// Runs the bridge until the process is asked to end. Mission files are saved in `folder`, and `study` is the
/// study with its participants.
///
/// # Errors
/// A channel that fails.
pub fn run(
    node: &Node,
    navigator: &Navigator,
    run: &RunConfig,
    (folder, study): (PathBuf, Option<Sitting>),
    caller: Caller,
    calls: &Calls,
) -> anyhow::Result<()> {
    let mut health = HealthReporter::new(node)?;
    let mut bridge = Bridge::open(node, navigator, run, (folder, study), caller)?;
    loop {
        let step = WorkStep::begin();
        bridge.pass(calls)?;
        health.end(step);
        health.report_if_due(bridge.stamp_ns)?;
        if node.wait(NAP) == Wake::Terminate {
            return Ok(health.report(bridge.stamp_ns)?);
        }
    }
}

struct Bridge<'a> {
    run: &'a RunConfig,
    /// How the navigator interprets drawings.
    drawn: Option<Drawn>,
    folder: PathBuf,
    caller: Caller,
    began: Instant,
    checkpoints: Checkpoints<State>,
    drawings: Writer<Drawing>,
    orders: Writer<MissionCommand>,
    inbox: Inbox,
    /// What pages see of the run.
    watch: Watch,
    machine: Machine,
    sessions: Sessions,
    /// Channel for the sketcher's response.
    reply: Option<oneshot::Sender<Answer>>,
    sendings: Sendings,
    /// Names of the mission files saved so far, which may be overwritten.
    saved: BTreeSet<String>,
    study: Option<Sitting>,
    lessons: Lessons,
    /// The rooms that the mission's goals describe, in words.
    resolved: Vec<String>,
    ends: Ends,
    services: Services,
    metrics: Metrics,
    trail: Trail,
    stamp_ns: u64,
    /// Number of the walls on the board, and of the drawing whose walls are being painted.
    walls: u64,
    painting: u64,
    /// When the last feed was sent, and whether there has been anything new since then.
    fed: Duration,
    is_new: bool,
}

impl<'a> Bridge<'a> {
    fn open(
        node: &Node,
        navigator: &Navigator,
        run: &'a RunConfig,
        (folder, study): (PathBuf, Option<Sitting>),
        caller: Caller,
    ) -> anyhow::Result<Self> {
        let (checkpoints, found) = Checkpoints::<State>::open(node, CHECKPOINT)?;
        found.report(node);
        let is_lost = found.is_lost();
        let mut orders = node.writer(ORDERS)?;
        orders.resume_after_history();
        let mut bridge = Self {
            run,
            drawn: navigator.drawn,
            folder,
            caller,
            began: Instant::now(),
            checkpoints,
            drawings: node.writer(DRAWING)?,
            orders,
            inbox: Inbox::open(node)?,
            watch: Watch::open(node, navigator, run)?,
            machine: Machine::new(run.pad.draws()),
            sessions: Sessions::default(),
            reply: None,
            sendings: Sendings::default(),
            saved: BTreeSet::new(),
            study,
            lessons: Lessons::default(),
            resolved: Vec::new(),
            ends: Ends::default(),
            services: Services::default(),
            metrics: Metrics::open(node, navigator.kind)?,
            trail: Trail::default(),
            stamp_ns: 0,
            walls: 0,
            painting: 0,
            fed: Duration::ZERO,
            is_new: true,
        };
        if let Some(state) = found.state {
            bridge.resume(state)?;
        } else if is_lost {
            bridge.resume_after(node)?;
        }
        bridge.paint();
        bridge.resume_lessons();
        bridge.resolve(navigator);
        bridge.show_place()?;
        bridge.welcome();
        Ok(bridge)
    }

    /// Resumes where the predecessor stopped.
    fn resume(&mut self, state: State) -> anyhow::Result<()> {
        let now = self.began.elapsed();
        let seq = state.machine.drawing_seq;
        self.inbox.understood.resume_after(state.understood);
        self.sessions.resume(state.driver, state.pleas, state.link_limit_s, now);
        self.machine.resume(state.machine, now);
        self.sendings = state.sendings;
        self.saved = state.saved;
        if let (Some(study), Some(code)) = (&mut self.study, &state.participant) {
            study.resume(code)?;
        }
        self.drawings.resume_after(seq);
        if let Some(pending) = self.machine.memory().pending.clone() {
            self.drawings.resume_after(seq - 1);
            self.send_drawing(&pending.what)?;
        }
        Ok(())
    }

    /// Starts without the previous drawings, so people have to send them again. The numbers continue after the last drawing that
    /// received a response, and after one more that may not have received any.
    fn resume_after(&mut self, node: &Node) -> anyhow::Result<()> {
        let mut last = 0;
        self.inbox.understood.take_kept(node, |answer| last = answer.header.source_seq)?;
        sketchnav_schemas::say!("no checkpoint can be used: send the drawing again");
        self.machine.resume_after(last + 1);
        self.drawings.resume_after(last + 1);
        Ok(())
    }

    fn checkpoint(&mut self) -> anyhow::Result<()> {
        let state = State {
            machine: self.machine.memory().clone(),
            understood: self.inbox.understood.position(),
            driver: self.sessions.driver().map(str::to_owned),
            pleas: self.sessions.pleas().to_vec(),
            link_limit_s: self.sessions.limit_s(),
            sendings: self.sendings.clone(),
            saved: self.saved.clone(),
            participant: self.study.as_ref().and_then(Sitting::code).map(str::to_owned),
        };
        Ok(self.checkpoints.write(&state)?)
    }

    /// Does everything that is due, once.
    fn pass(&mut self, calls: &Calls) -> anyhow::Result<()> {
        self.abort_if_asked(calls)?;
        self.receive()?;
        for session in calls.take_leaves() {
            self.sessions.leave(&session);
        }
        for call in calls.waiting() {
            self.abort_if_asked(calls)?;
            self.answer(call)?;
        }
        self.watch_the_clock()?;
        self.learn(self.began.elapsed());
        self.feed();
        Ok(())
    }

    fn abort_if_asked(&mut self, calls: &Calls) -> anyhow::Result<()> {
        let Some(waiting) = calls.take_aborts() else { return Ok(()) };
        let now = self.began.elapsed();
        let ordered = self.machine.order(Step::Abort, false, now);
        if let Ok(order) = &ordered {
            self.send_order(*order)?;
            self.checkpoint()?;
        }
        let answer = ordered.map(|_| json!({}));
        for reply in waiting {
            // A sender that has disconnected ignores the result.
            let _ = reply.send(answer.clone());
        }
        Ok(())
    }

    fn watch_the_clock(&mut self) -> anyhow::Result<()> {
        let now = self.began.elapsed();
        if self.sessions.has_fallen_silent(now)
            && let Some(order) = self.machine.on_silence()
        {
            self.send_order(order)?;
            self.checkpoint()?;
        }
        if self.machine.has_waited_too_long(now) {
            self.checkpoint()?;
            self.tell(Err(Refusal::Absent("the sketcher does not answer".into())));
        }
        Ok(())
    }

    /// Processes the report of the navigator's lookout.
    fn look(&mut self) -> anyhow::Result<()> {
        self.is_new |= self.watch.receive()?;
        self.machine.on_lookout(self.watch.is_ready(), self.watch.question().is_some());
        // If people draw, the walls on the board are those of the drawing that they sent last.
        if let Some(walls) = self.watch.take_walls().filter(|_| !self.run.pad.draws())
            && let Some(picture) = walls::png(&walls)
        {
            self.walls += 1;
            self.show_walls(picture);
        }
        Ok(())
    }

    fn receive(&mut self) -> anyhow::Result<()> {
        let now = self.began.elapsed();
        self.look()?;
        while let Some(news) = self.inbox.next()? {
            match news {
                News::Status(status) => {
                    self.stamp_ns = status.header.stamp_ns;
                    self.machine.on_status(&status, now);
                    self.ends.on_status(&status);
                    self.is_new = true;
                }
                News::Understood(answer) => {
                    // The sketch that the answer is about was sent before it.
                    self.look()?;
                    let said = self.machine.on_understood(&answer);
                    // This is stored first, so that after a crash it is stored again rather than not at all.
                    let said =
                        said.map(|said| said.and_then(|()| self.keep_for_study()).map(|()| facts(&answer)));
                    if let Some(said) = &said {
                        self.sendings.answer(said);
                    }
                    self.checkpoint()?;
                    if let Some(said) = said {
                        self.on_answer(said);
                    }
                }
                News::Fault(fault) => self.services.on_fault(&fault),
                News::Health(health) => self.metrics.on_health(&health),
            }
        }
        Ok(())
    }

    /// Handles the sketcher's answer to what is pending.
    fn on_answer(&mut self, said: Answer) {
        if said.is_ok() {
            self.ends.clear();
            self.trail = Trail::default();
            self.paint();
            self.settle_lessons();
            self.welcome();
        }
        self.tell(said);
        self.is_new = true;
    }

    /// Passes the answer to the request that waits for the sketcher; after a restart none does.
    fn tell(&mut self, answer: Answer) {
        if let Some(reply) = self.reply.take() {
            // A sender that has disconnected ignores the answer.
            let _ = reply.send(answer);
        }
    }

    fn answer(&mut self, call: Call) -> anyhow::Result<()> {
        let now = self.began.elapsed();
        match call {
            Call::Join { named, fresh, reply } => {
                let before = self.sessions.driver().map(str::to_owned);
                let joined = self.sessions.join(named.as_deref(), fresh, now);
                if self.sessions.driver() == before.as_deref() {
                    self.freshen_welcome();
                } else {
                    self.checkpoint()?;
                    self.welcome();
                }
                let joined = joined.map(|session| {
                    let page = self.sessions.page(&session);
                    (session, page)
                });
                if let Err(Ok((session, _))) = reply.send(joined) {
                    // The page has already disconnected again.
                    self.sessions.leave(&session);
                }
            }
            Call::Seat { named, reply } => {
                let _ = reply.send(self.sessions.check_seat(named.as_deref()));
            }
            Call::Heard(session) => self.sessions.hear(&session, now),
            // A monitoring system that has disconnected ignores the figures.
            Call::Metrics(reply) => {
                let _ = reply.send(self.metrics.text(&self.services.views(), self.stamp_ns));
            }
            Call::Walls(number, picture) if number == self.painting => {
                self.walls = number;
                self.show_walls(picture);
            }
            Call::Walls(..) => {}
            Call::Resolved(resolved) => {
                self.resolved = resolved;
                self.is_new = true;
            }
            Call::Looked(looked) => self.on_looked(*looked, now),
            Call::Ask { session, request, reply } => {
                self.sessions.hear(&session, now);
                if let Some(answer) = self.ask(&session, request, now)? {
                    let _ = reply.send(answer);
                } else {
                    self.reply = Some(reply);
                }
                self.is_new = true;
            }
        }
        Ok(())
    }

    /// Handles a request; `None` if the sketcher has to answer.
    fn ask(&mut self, session: &str, request: Request, now: Duration) -> anyhow::Result<Option<Answer>> {
        let drives = self.sessions.drives(session);
        if let Some(step) = request.step()
            && let Err(refusal) = self.allow_by_study(step, drives, now)
        {
            return Ok(Some(Err(refusal)));
        }
        let done = |result: Result<(), Refusal>| result.map(|()| json!({}));
        let answer = match request {
            Request::Sketch(sketch, name) => match self.sendings.again(name.as_deref()) {
                Some(answer) => return Ok(answer),
                None => match self.machine.send_sketch(sketch, drives, now) {
                    Ok(_) => return self.submit(name),
                    Err(refusal) => Err(refusal),
                },
            },
            Request::Path(path, name) => match self.sendings.again(name.as_deref()) {
                Some(answer) => return Ok(answer),
                None => match self.machine.send_path(path, drives, now) {
                    Ok(_) => return self.submit(name),
                    Err(refusal) => Err(refusal),
                },
            },
            Request::Order(Step::Here) => Err(Refusal::Malformed(
                "order: expected execute, abort, restore or again; a place is not an order".into(),
            )),
            Request::Order(Step::Accept) => return self.accept(drives, now),
            Request::Order(Step::Reject) => match self.reject(drives, now)? {
                Some(answer) => answer,
                None => return Ok(None),
            },
            Request::Order(step) => match self.machine.order(step, drives, now) {
                Ok(order) => {
                    if order == Order::Start {
                        self.ends.clear();
                    }
                    // Without the order, a successor would refuse an abort.
                    self.checkpoint()?;
                    self.send_order(order)?;
                    Ok(json!({}))
                }
                Err(refusal) => Err(refusal),
            },
            Request::Here(place) => match self.place(place) {
                Ok(here) => match self.machine.order(Step::Here, drives, now) {
                    Ok(order) => {
                        self.checkpoint()?;
                        self.send(order, Some(here))?;
                        Ok(json!({}))
                    }
                    Err(refusal) => Err(refusal),
                },
                Err(refusal) => Err(refusal),
            },
            Request::Wheel(wish) => done(self.pass_wheel(session, wish, now)),
            Request::Limit(limit_s) if drives => done(self.sessions.set_limit(limit_s)),
            Request::Mission(name) if drives => self.write_mission(&name),
            Request::Study(told) if drives => self.hear_participant(told),
            Request::Limit(_) | Request::Mission(_) | Request::Study(_) => Err(Refusal::watches()),
        };
        self.checkpoint()?;
        self.welcome();
        Ok(Some(answer))
    }

    /// Does what a page wants with the wheel. The robot drives on meanwhile.
    fn pass_wheel(&mut self, session: &str, wish: WheelWish, now: Duration) -> Result<(), Refusal> {
        match wish {
            WheelWish::Take => self.sessions.take_wheel(session, now),
            WheelWish::Ask(_) if self.study.is_some() => {
                Err(Refusal::NotNow("in a study, the participant drives".into()))
            }
            WheelWish::Ask(name) => self.sessions.ask_for_wheel(session, &name),
            WheelWish::Withdraw => {
                self.sessions.withdraw(session);
                Ok(())
            }
            WheelWish::Give(page) => self.sessions.answer_plea(session, page, true, now),
            WheelWish::Decline(page) => self.sessions.answer_plea(session, page, false, now),
        }
    }

    /// Sends the machine's latest submission, after writing the checkpoint.
    fn submit(&mut self, name: Option<String>) -> anyhow::Result<Option<Answer>> {
        self.sendings.pending = name;
        self.checkpoint()?;
        let Some(pending) = self.machine.memory().pending.clone() else { return Ok(None) };
        self.send_drawing(&pending.what)?;
        Ok(None)
    }

    fn send_drawing(&mut self, what: &Submission) -> anyhow::Result<()> {
        let mut loan = self.drawings.loan_with(what.bytes().len())?;
        let (drawing, cells) = loan.parts_mut();
        (drawing.header.stamp_ns, drawing.kind) = (self.stamp_ns, what.kind().code());
        cells.copy_from_slice(what.bytes());
        loan.send()?;
        Ok(())
    }

    fn send_order(&mut self, order: Order) -> anyhow::Result<()> {
        self.send(order, None)
    }

    fn send(&mut self, order: Order, here: Option<Here>) -> anyhow::Result<()> {
        let stamp_ns = self.stamp_ns;
        self.orders.send(|message| {
            message.header.stamp_ns = stamp_ns;
            message.order = order.code();
            here.iter().for_each(|here| message.set_here(here));
        })?;
        self.is_new = true;
        Ok(())
    }

    fn write_mission(&mut self, name: &str) -> Answer {
        let memory = self.machine.memory();
        let (Some(sketch), Some(path), Some(drawn)) = (&memory.sketch, &memory.path, &self.drawn) else {
            return Err(Refusal::NotNow(
                "expected a sketch and a path to have been sent; one is missing".into(),
            ));
        };
        let (mission, learned) = ((&self.run.mission, drawn), memory.learned.as_deref());
        let files =
            mission_file::write(&self.folder, name, mission, (sketch, learned), path, &mut self.saved)?;
        Ok(json!({ "files": files }))
    }
}

/// The answer to the sender of a drawing.
fn facts(answer: &Understood) -> Value {
    json!({
        "seq": answer.header.source_seq,
        "wall_direction_rad": answer.wall_direction_rad,
        "width_px": answer.sketch_width_px,
        "height_px": answer.sketch_height_px,
        "doubts": answer.words.as_str(),
    })
}

/// Returns a response as JSON, with `ok` and the other members.
pub fn ok(facts: Value) -> Value {
    let mut answer = json!({ "ok": true });
    if let (Value::Object(answer), Value::Object(facts)) = (&mut answer, facts) {
        answer.extend(facts);
    }
    answer
}

#[cfg(test)]
mod tests;

//! The sketcher where people draw while it runs: answers each drawing of the pad with one word, and sends
//! what follows from it before.
//!
//! Its checkpoint holds the drawings that were taken over, so that its successor has what the pad has
//! forgotten. It is written before a drawing is read, so that one that has killed the sketcher three times is
//! refused, and before it is answered, with the answer: the pad may send the next one as soon as it has that.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use sketchnav_runtime::{
    Checkpoints, Found, HealthReporter, Node, SliceReader, SliceSample, SliceWriter, Step, Wake, Writer,
};
use sketchnav_schemas::channels::{DRAWING, ROUTE, SKETCH, UNDERSTOOD};
use sketchnav_schemas::codes::DrawingKind;
use sketchnav_schemas::message::{Drawing, Header, Route, SketchMap, Understood};
use sketchnav_schemas::run::RunConfig;

use crate::desk::{self, Change, Desk};
use crate::error::SketchError;
use crate::publish::{fill_cells, fill_route, fill_sketch, fill_understood};

/// Longest sleep between two signs of life.
const NAP: Duration = Duration::from_millis(250);
/// How often a drawing is read that has killed the sketcher each time.
const MAX_ATTEMPTS: u32 = 3;
/// The form of [`State`].
const CHECKPOINT: &str = "sketcher 1";

/// What a successor needs to know: the last number that was taken or given, and what holds.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct State {
    drawing: u64,
    sketch: u64,
    route: u64,
    /// How often the next drawing was read, without an answer.
    attempts: u32,
    /// The last answer, which may not have been sent.
    answer: Option<Answer>,
    desk: desk::State,
}

/// What is said to a drawing.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Answer {
    /// Its number on the channel.
    seq: u64,
    drawing: u64,
    stamp_ns: u64,
    kind: u32,
    /// Why it was refused, where it was.
    refusal: Option<String>,
}

impl Answer {
    fn header(&self) -> Header {
        Header { seq: 0, stamp_ns: self.stamp_ns, source_seq: self.drawing }
    }
}

/// Runs the sketcher in `node`'s system until it is asked to end.
///
/// # Errors
/// Parameters that cannot be; a channel that fails. A drawing that cannot be is answered.
pub(crate) fn run(node: &Node, run: &RunConfig) -> anyhow::Result<()> {
    let mut health = HealthReporter::new(node)?;
    let (mut checkpoints, found) = Checkpoints::<State>::open(node, CHECKPOINT)?;
    found.report(node);
    let mut ports = Ports::open(node, run)?;
    let mut attempts = ports.resume(found)?;
    loop {
        while let Some(drawing) = ports.drawings.receive()? {
            let step = Step::begin();
            checkpoints.write(&ports.state(attempts + 1))?;
            ports.take(&drawing, attempts)?;
            attempts = 0;
            checkpoints.write(&ports.state(attempts))?;
            ports.send_answer()?;
            health.end(step);
        }
        health.report_if_due(0)?;
        if node.wait(NAP) == Wake::Terminate {
            return Ok(health.report(0)?);
        }
    }
}

struct Ports {
    desk: Desk,
    drawings: SliceReader<Drawing>,
    /// The last drawing that was taken, and what there is to say to it.
    taken: u64,
    answer: Option<Answer>,
    understood: Writer<Understood>,
    sketches: SliceWriter<SketchMap>,
    routes: Writer<Route>,
}

impl Ports {
    fn open(node: &Node, run: &RunConfig) -> anyhow::Result<Self> {
        Ok(Self {
            desk: Desk::new(run)?,
            drawings: node.slice_reader(DRAWING)?,
            taken: 0,
            answer: None,
            understood: node.writer(UNDERSTOOD)?,
            sketches: node.slice_writer(SKETCH)?,
            routes: node.writer(ROUTE)?,
        })
    }

    /// Goes on where the predecessor stood, and sends the sketch that holds again: a dead writer's is gone.
    /// Where no checkpoint can be used it begins anew, and people have to send their drawing again. How often
    /// the next drawing was read already.
    fn resume(&mut self, found: Found<State>) -> anyhow::Result<u32> {
        let is_lost = found.is_lost();
        let Some(state) = found.state else {
            if is_lost {
                eprintln!("no checkpoint can be used: the drawing is to be sent again");
                self.understood.resume_behind_kept();
                self.routes.resume_behind_kept();
                let last = self.understood.last_kept().copied();
                self.taken = last.map_or(0, |last| last.header.source_seq);
                self.drawings.resume_after(self.taken);
                self.sketches.resume_after(last.map_or(0, |last| last.sketch_seq));
            }
            return Ok(0);
        };
        self.taken = state.drawing;
        self.drawings.resume_after(state.drawing);
        self.routes.resume_after(state.route);
        self.desk.restore(&state.desk)?;
        self.sketches.resume_after(state.sketch.saturating_sub(1));
        if state.sketch > 0 && self.desk.placed().is_some() {
            self.send_sketch(Header { seq: 0, stamp_ns: 0, source_seq: self.taken })?;
        }
        self.sketches.resume_after(state.sketch);
        self.answer = state.answer;
        self.understood.resume_after(self.answer.as_ref().map_or(0, |answer| answer.seq - 1));
        self.send_answer()?;
        Ok(state.attempts)
    }

    fn state(&self, attempts: u32) -> State {
        State {
            drawing: self.taken,
            sketch: self.sketches.last_seq(),
            route: self.routes.last_seq(),
            attempts,
            answer: self.answer.clone(),
            desk: self.desk.state().clone(),
        }
    }

    /// Sends the sketch and the tasks that follow from a drawing; the answer to it is still to be sent.
    fn take(&mut self, drawing: &SliceSample<Drawing>, attempts: u32) -> anyhow::Result<()> {
        let about = drawing.message();
        let header = Header { seq: 0, source_seq: about.header.seq, ..about.header };
        let read = match DrawingKind::from_code(about.kind) {
            Some(_) if attempts >= MAX_ATTEMPTS => Err(SketchError::Fatal { attempts }),
            Some(kind) => self.desk.take(kind, drawing.bytes()),
            None => Err(SketchError::Kind { found: about.kind }),
        };
        match read {
            Ok(Change::Start) => {
                self.send_sketch(header)?;
                self.send_route(header)?;
            }
            Ok(Change::Tasks) => self.send_route(header)?,
            Ok(Change::Sketch) | Err(_) => {}
        }
        self.taken = about.header.seq;
        let refusal = read.err().map(|error| error.to_string());
        self.answer = Some(Answer {
            seq: self.understood.last_seq() + 1,
            drawing: self.taken,
            stamp_ns: header.stamp_ns,
            kind: about.kind,
            refusal,
        });
        Ok(())
    }

    fn send_sketch(&mut self, header: Header) -> anyhow::Result<()> {
        let Some((drawing, places)) = self.desk.placed() else { return Ok(()) };
        let mut sketch = self.sketches.loan(drawing.cells.len())?;
        sketch.message_mut().header = header;
        fill_sketch(drawing, places, sketch.message_mut());
        fill_cells(drawing, sketch.bytes_mut())?;
        sketch.send()?;
        Ok(())
    }

    /// The tasks say which sketch they are places of.
    fn send_route(&mut self, header: Header) -> anyhow::Result<()> {
        let Some((_, places)) = self.desk.placed() else { return Ok(()) };
        let source_seq = self.sketches.last_seq();
        self.routes.send(|route| {
            route.header = Header { source_seq, ..header };
            fill_route(places, route);
        })?;
        Ok(())
    }

    /// Sends the answer that is still to be sent; one that was sent already passes.
    fn send_answer(&mut self) -> anyhow::Result<()> {
        let Some(said) = &self.answer else { return Ok(()) };
        let (sketch_seq, route_seq) = (self.sketches.last_seq(), self.routes.last_seq());
        let drawing = self.desk.drawing();
        self.understood.send(|answer| {
            answer.header = said.header();
            answer.kind = said.kind;
            (answer.sketch_seq, answer.route_seq) = (sketch_seq, route_seq);
            fill_understood(drawing, said.refusal.as_deref(), answer);
        })?;
        Ok(())
    }
}

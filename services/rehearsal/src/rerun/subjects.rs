//! The services as what they are to a recording: inputs in, outputs out.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use sketchnav_recordings::reader::RawMessage;
use sketchnav_schemas::channels::{
    COMMAND, DRAWING, ESTIMATE, MISSION, ODOMETRY, ROUTE, SCAN, SKETCH, UNDERSTOOD,
};
use sketchnav_schemas::codes::{DrawingKind, Process};
use sketchnav_schemas::message::{
    Drawing as DrawingMessage, Header, LaserScan, Odometry, PoseEstimate, Route, SketchMap, Understood,
};
use sketchnav_schemas::run::{Pace, RunConfig};
use sketchnav_sketcher::desk::{Change, Desk};
use sketchnav_sketcher::{Drawing, Places, SketchError, fill_route, fill_sketch, fill_understood};

use super::RerunError;
use crate::voices::{self, LocalizerVoice, Outbox, PlannerVoice, WorldVoice};
use crate::{RehearsalError, Tap};

/// A service under examination.
pub(super) enum Subject {
    World(Box<WorldVoice>),
    Sketcher(Box<Sketcher>),
    LiveSketcher(Box<LiveSketcher>),
    Localizer(Box<Localizer>),
    Planner(Box<Planner>),
}

impl Subject {
    pub(super) fn new(process: Process, run: &RunConfig) -> Result<Self, RerunError> {
        match process {
            Process::World => {
                let world = WorldVoice::new(run).map_err(RehearsalError::from)?;
                Ok(Self::World(Box::new(world)))
            }
            Process::Sketcher if run.pad.draws() => Ok(Self::LiveSketcher(Box::new(LiveSketcher::new(run)?))),
            Process::Sketcher => Ok(Self::Sketcher(Box::new(Sketcher::new(run)?))),
            Process::Localizer => Ok(Self::Localizer(Box::new(Localizer::new(run)?))),
            Process::Planner => Ok(Self::Planner(Box::new(Planner::new(run)?))),
            _ => Err(RerunError::Process { process }),
        }
    }

    /// Leaves the scans that are not among these without an answer; `None`: answers all.
    pub(super) fn answers(&mut self, scans: Option<BTreeSet<u64>>) {
        match self {
            Self::Localizer(localizer) => localizer.answered = scans,
            Self::Planner(planner) => planner.answered = scans,
            Self::World(_) | Self::Sketcher(_) | Self::LiveSketcher(_) => {}
        }
    }

    /// What it says before it hears anything.
    pub(super) fn begin(&mut self, tap: &mut impl Tap) {
        match self {
            Self::World(world) => world.observe(tap),
            Self::Sketcher(sketcher) => drop(voices::sketch(&sketcher.understood, tap)),
            Self::LiveSketcher(_) | Self::Localizer(_) | Self::Planner(_) => {}
        }
    }

    /// What it says to a message of another process.
    pub(super) fn hear(&mut self, message: &RawMessage, tap: &mut impl Tap) -> Result<(), RerunError> {
        match self {
            Self::World(world) => hear_command(world, message, tap),
            Self::Sketcher(_) => Ok(()),
            Self::LiveSketcher(sketcher) => sketcher.hear(message, tap),
            Self::Localizer(localizer) => localizer.hear(message, tap),
            Self::Planner(planner) => planner.hear(message, tap),
        }
    }

    /// How long the core took so far: without reading, encoding, comparing and writing.
    pub(super) fn spent(&self) -> Duration {
        match self {
            Self::World(world) => world.spent,
            Self::Sketcher(sketcher) => sketcher.spent,
            Self::LiveSketcher(sketcher) => sketcher.spent,
            Self::Localizer(localizer) => localizer.voice.spent,
            Self::Planner(planner) => planner.voice.spent,
        }
    }
}

fn hear_command(world: &mut WorldVoice, raw: &RawMessage, tap: &mut impl Tap) -> Result<(), RerunError> {
    if raw.topic.is(COMMAND) {
        let (command, _) = raw.read(COMMAND)?;
        if command.last == 0 {
            world.step(Some(&command));
            world.observe(tap);
        }
    }
    Ok(())
}

pub(super) struct Sketcher {
    understood: (Drawing, Places),
    spent: Duration,
}

impl Sketcher {
    fn new(run: &RunConfig) -> Result<Self, RehearsalError> {
        let began = Instant::now();
        let understood = sketchnav_sketcher::understand(run).map_err(RehearsalError::Sketch)?;
        Ok(Self { understood, spent: began.elapsed() })
    }
}

/// The sketcher where people draw while it runs: all that it says follows from the drawings in their order.
pub(super) struct LiveSketcher {
    desk: Desk,
    sketches: Outbox<SketchMap>,
    routes: Outbox<Route>,
    answers: Outbox<Understood>,
    spent: Duration,
}

impl LiveSketcher {
    fn new(run: &RunConfig) -> Result<Self, RehearsalError> {
        Ok(Self {
            desk: Desk::new(run).map_err(|error| RehearsalError::Sketch(error.into()))?,
            sketches: Outbox::new(SKETCH),
            routes: Outbox::new(ROUTE),
            answers: Outbox::new(UNDERSTOOD),
            spent: Duration::ZERO,
        })
    }

    fn hear(&mut self, raw: &RawMessage, tap: &mut impl Tap) -> Result<(), RerunError> {
        if raw.topic.is(DRAWING) {
            let (about, bytes) = raw.read(DRAWING)?;
            let began = Instant::now();
            let read = match DrawingKind::from_code(about.kind) {
                Some(kind) => self.desk.take(kind, &bytes),
                None => Err(SketchError::Kind { found: about.kind }),
            };
            self.spent += began.elapsed();
            self.answer(&about, read, tap);
        }
        Ok(())
    }

    fn answer(&mut self, about: &DrawingMessage, read: Result<Change, SketchError>, tap: &mut impl Tap) {
        let header = Header { seq: 0, source_seq: about.header.seq, ..about.header };
        let placed = self.desk.placed().filter(|_| matches!(read, Ok(Change::Start | Change::Tasks)));
        if let Some((drawing, places)) = placed {
            if matches!(read, Ok(Change::Start)) {
                let sketch = self.sketches.blank();
                fill_sketch(drawing, places, sketch);
                sketch.header = header;
                self.sketches.send(tap, &drawing.cells);
            }
            let route = self.routes.blank();
            fill_route(places, route);
            route.header = Header { source_seq: self.sketches.last_seq, ..header };
            self.routes.send(tap, &[]);
        }
        let refusal = read.err().map(|error| error.to_string());
        let answer = self.answers.blank();
        fill_understood(self.desk.drawing(), refusal.as_deref(), answer);
        answer.header = header;
        answer.kind = about.kind;
        (answer.sketch_seq, answer.route_seq) = (self.sketches.last_seq, self.routes.last_seq);
        self.answers.send(tap, &[]);
    }
}

pub(super) struct Localizer {
    voice: LocalizerVoice,
    answered: Option<BTreeSet<u64>>,
    odometry: Option<Odometry>,
}

impl Localizer {
    fn new(run: &RunConfig) -> Result<Self, RehearsalError> {
        Ok(Self { voice: LocalizerVoice::new(run)?, answered: None, odometry: None })
    }

    fn hear(&mut self, raw: &RawMessage, tap: &mut impl Tap) -> Result<(), RerunError> {
        let topic = &raw.topic;
        if topic.is(SKETCH) {
            let (map, cells) = raw.read(SKETCH)?;
            self.voice.on_sketch(&map, &cells).map_err(RehearsalError::from)?;
        } else if topic.is(ODOMETRY) {
            self.odometry = Some(raw.read(ODOMETRY)?.0);
        } else if topic.is(SCAN) {
            self.answer(&raw.read(SCAN)?.0, tap);
        }
        Ok(())
    }

    fn answer(&mut self, scan: &LaserScan, tap: &mut impl Tap) {
        let is_left_out = self.answered.as_ref().is_some_and(|scans| !scans.contains(&scan.header.seq));
        if let (Some(odometry), false) = (&self.odometry, is_left_out) {
            self.voice.answer(odometry, scan, tap);
        }
    }
}

pub(super) struct Planner {
    voice: PlannerVoice,
    answered: Option<BTreeSet<u64>>,
    pace: Pace,
    scan: Option<Box<LaserScan>>,
    odometry: Option<Odometry>,
}

impl Planner {
    fn new(run: &RunConfig) -> Result<Self, RehearsalError> {
        let voice = PlannerVoice::new(run)?;
        Ok(Self { voice, answered: None, pace: run.pace, scan: None, odometry: None })
    }

    fn hear(&mut self, raw: &RawMessage, tap: &mut impl Tap) -> Result<(), RerunError> {
        let topic = &raw.topic;
        if topic.is(SKETCH) {
            let (map, cells) = raw.read(SKETCH)?;
            self.voice.take(|core| core.on_sketch(&map, &cells)).map_err(RehearsalError::from)?;
        } else if topic.is(ROUTE) {
            let (route, _) = raw.read(ROUTE)?;
            self.voice.take(|core| core.on_route(&route));
        } else if topic.is(MISSION) {
            let (order, _) = raw.read(MISSION)?;
            self.voice.take(|core| core.on_order(&order));
        } else if topic.is(ODOMETRY) {
            self.odometry = Some(raw.read(ODOMETRY)?.0);
        } else if topic.is(SCAN) {
            self.scan = Some(Box::new(raw.read(SCAN)?.0));
        } else if topic.is(ESTIMATE) {
            self.answer(&raw.read(ESTIMATE)?.0, tap);
        }
        Ok(())
    }

    fn answer(&mut self, estimate: &PoseEstimate, tap: &mut impl Tap) {
        let seq = estimate.header.source_seq;
        let is_left_out = self.answered.as_ref().is_some_and(|scans| !scans.contains(&seq));
        let waits = is_left_out || (self.pace == Pace::Lockstep && !self.voice.is_ready());
        if let (Some(scan), Some(odometry), false) = (&self.scan, &self.odometry, waits) {
            self.voice.answer(estimate, scan, odometry, tap);
        }
    }
}

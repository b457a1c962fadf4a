//! What comes in from the channels: the newest of everything, and each word that the machine has to hear.

use sketchnav_landmarks::instructions::Instructions;
use sketchnav_runtime::{Node, Reader};
use sketchnav_schemas::channels::{
    CORRESPONDENCE, Channel, ESTIMATE, FAULTS, HEALTH, LANDMARK_PROGRESS, LANDMARK_ROUTE, LANDMARK_VIEW,
    PARTICLES, PLAN, QUESTION, SCAN, SKETCH, STATUS, UNDERSTOOD,
};
use sketchnav_schemas::codes::QuestionKind;
use sketchnav_schemas::message::{
    Correspondence, Fault, Health, LandmarkProgress, LandmarkRoute, LandmarkView, LaserScan, Message,
    MissionStatus, Particles, Plan, PoseEstimate, Question, SketchMap, Understood,
};
use sketchnav_schemas::ros2::Ros2;
use sketchnav_schemas::run::RunConfig;

use crate::feed::landmarks::Canvas;
use crate::walls;

/// Estimates after another sketch that may still be about the one before: on their way, or at work.
const IN_FLIGHT: u32 = 2;

/// Something that the machine has to hear.
pub(super) enum News {
    Status(MissionStatus),
    Estimate(Box<PoseEstimate>),
    /// What the robot asks a person.
    Question(QuestionKind),
    Understood(Understood),
    Fault(Fault),
    Health(Box<Health>),
    /// A robot has seen something of landmarks.
    View,
    /// The walls of a mission from a file, as a picture.
    Walls(Vec<u8>),
}

/// The pad's readers, and the newest of what they have read.
pub(super) struct Inbox {
    statuses: Reader<MissionStatus>,
    // Of one kind of navigator each.
    estimates: Option<Reader<PoseEstimate>>,
    particle_sets: Option<Reader<Particles>>,
    plans: Option<Reader<Plan>>,
    correspondences: Option<Reader<Correspondence>>,
    questions: Option<Reader<Question>>,
    sketches: Option<Reader<SketchMap>>,
    scans: Option<Reader<LaserScan>>,
    routes: Option<Reader<LandmarkRoute>>,
    views: Option<Reader<LandmarkView>>,
    progresses: Option<Reader<LandmarkProgress>>,
    faults: Reader<Fault>,
    health: Reader<Health>,
    /// What the sketcher says to what was sent.
    pub(super) understood: Reader<Understood>,
    draws: bool,
    /// Width and height of the last sketch that was sent to the localizer.
    pub(super) size_px: Option<[u32; 2]>,
    pub(super) sketch_seq: u64,
    pub(super) wall_direction_rad: f64,
    /// Estimates to come that may still be about an earlier sketch.
    in_flight: u32,
    pub(super) estimate: Option<Box<PoseEstimate>>,
    pub(super) scan: Option<Box<LaserScan>>,
    pub(super) plan: Option<Box<Plan>>,
    pub(super) particles: Option<Box<Particles>>,
    pub(super) correspondence: Option<Box<Correspondence>>,
    pub(super) question: Option<Box<Question>>,
    /// A route past landmarks, what is seen of them, and how far the robot has come.
    pub(super) canvas: Option<Canvas>,
    pub(super) view: Option<Box<LandmarkView>>,
    pub(super) progress: Option<Box<LandmarkProgress>>,
}

/// A reader of a channel that runs of this kind of navigator have.
fn open<T: Ros2>(node: &Node, kind: &str, channel: Channel<T>) -> anyhow::Result<Option<Reader<T>>> {
    Ok(channel.spec.belongs_to(kind).then(|| node.reader(channel)).transpose()?)
}

impl Inbox {
    pub(super) fn open(node: &Node, run: &RunConfig) -> anyhow::Result<Self> {
        let kind = run.mission.navigator_kind();
        Ok(Self {
            statuses: node.reader(STATUS)?,
            estimates: open(node, kind, ESTIMATE)?,
            particle_sets: open(node, kind, PARTICLES)?,
            plans: open(node, kind, PLAN)?,
            correspondences: open(node, kind, CORRESPONDENCE)?,
            questions: open(node, kind, QUESTION)?,
            sketches: open(node, kind, SKETCH)?,
            scans: ESTIMATE.spec.belongs_to(kind).then(|| node.reader(SCAN)).transpose()?,
            routes: open(node, kind, LANDMARK_ROUTE)?,
            views: open(node, kind, LANDMARK_VIEW)?,
            progresses: open(node, kind, LANDMARK_PROGRESS)?,
            faults: node.reader(FAULTS)?,
            health: node.reader(HEALTH)?,
            understood: node.reader(UNDERSTOOD)?,
            draws: run.pad.draws(),
            size_px: None,
            sketch_seq: 0,
            wall_direction_rad: 0.0,
            in_flight: 0,
            estimate: None,
            scan: None,
            plan: None,
            particles: None,
            correspondence: None,
            question: None,
            canvas: None,
            view: None,
            progress: None,
        })
    }

    /// The next word that the machine has to hear. What the planner said before the sketcher's answer comes
    /// before it.
    pub(super) fn next(&mut self) -> anyhow::Result<Option<News>> {
        if let Some(walls) = self.take_sketch()? {
            return Ok(Some(News::Walls(walls)));
        }
        if let Some(walls) = self.take_route()? {
            return Ok(Some(News::Walls(walls)));
        }
        if let Some(view) = newest(&mut self.views)? {
            self.view = Some(view);
            return Ok(Some(News::View));
        }
        if let Some(fault) = self.faults.receive()? {
            return Ok(Some(News::Fault(*fault)));
        }
        if let Some(health) = self.health.receive()? {
            return Ok(Some(News::Health(Box::new(*health))));
        }
        if let Some(estimate) = next(&mut self.estimates)? {
            match self.in_flight.checked_sub(1) {
                Some(left) => self.in_flight = left,
                None => self.estimate = Some(estimate.clone()),
            }
            return Ok(Some(News::Estimate(estimate)));
        }
        if let Some(question) = newest(&mut self.questions)? {
            let kind = QuestionKind::from_code(question.kind).unwrap_or(QuestionKind::Nothing);
            self.question = Some(question);
            return Ok(Some(News::Question(kind)));
        }
        if let Some(status) = self.statuses.receive()? {
            return Ok(Some(News::Status(*status)));
        }
        self.keep_newest()?;
        Ok(self.understood.receive()?.map(|answer| News::Understood(*answer)))
    }

    fn keep_newest(&mut self) -> anyhow::Result<()> {
        self.scan = newest(&mut self.scans)?.or(self.scan.take());
        self.plan = newest(&mut self.plans)?.or(self.plan.take());
        self.correspondence = newest(&mut self.correspondences)?.or(self.correspondence.take());
        self.particles = newest(&mut self.particle_sets)?.or(self.particles.take());
        self.progress = newest(&mut self.progresses)?.or(self.progress.take());
        Ok(())
    }

    /// The picture of a route past landmarks.
    fn take_route(&mut self) -> anyhow::Result<Option<Vec<u8>>> {
        let Some(routes) = &mut self.routes else { return Ok(None) };
        let Some(route) = routes.receive()? else { return Ok(None) };
        let canvas = Canvas::of(&Instructions::read(route.cells())?);
        let [width, height] = canvas.size_px;
        let picture = walls::png(width, height, &canvas.cells());
        (self.size_px, self.canvas) = (Some(canvas.size_px), Some(canvas));
        Ok(picture)
    }

    fn take_sketch(&mut self) -> anyhow::Result<Option<Vec<u8>>> {
        let Some(readers) = &mut self.sketches else { return Ok(None) };
        let Some(sketch) = readers.receive()? else { return Ok(None) };
        let map = &*sketch;
        self.size_px = Some([map.width_px, map.height_px]);
        self.wall_direction_rad = map.wall_direction_rad;
        if map.header.seq != self.sketch_seq {
            self.forget_pose(map.header.seq);
        }
        let paints = !self.draws;
        Ok(paints.then(|| walls::png(map.width_px, map.height_px, sketch.cells())).flatten())
    }

    /// What was known belongs to a sketch before the one with this number.
    pub(super) fn forget_pose(&mut self, sketch_seq: u64) {
        (self.sketch_seq, self.in_flight) = (sketch_seq, IN_FLIGHT);
        (self.estimate, self.plan, self.particles, self.correspondence) = (None, None, None, None);
    }
}

/// The next message of a channel that the run has.
fn next<T: Message>(reader: &mut Option<Reader<T>>) -> anyhow::Result<Option<Box<T>>> {
    let Some(reader) = reader else { return Ok(None) };
    Ok(reader.receive_valid()?.map(|message| Box::new(*message)))
}

/// The newest of those that have come.
fn newest<T: Message>(reader: &mut Option<Reader<T>>) -> anyhow::Result<Option<Box<T>>> {
    let mut newest = None;
    while let Some(message) = next(reader)? {
        newest = Some(message);
    }
    Ok(newest)
}

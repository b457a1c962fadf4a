//! What comes in from the channels: the newest of everything, and each word that the machine has to hear.

use sketchnav_landmarks::instructions::Instructions;
use sketchnav_runtime::{Node, Reader};
use sketchnav_schemas::channels::{
    Channel, ESTIMATE, FAULTS, LANDMARK_PROGRESS, LANDMARK_ROUTE, LANDMARK_VIEW, PARTICLES, PLAN, SCAN,
    SKETCH, STATUS, UNDERSTOOD,
};
use sketchnav_schemas::message::{
    Fault, LandmarkProgress, LandmarkRoute, LandmarkView, LaserScan, Message, MissionStatus, Particles, Plan,
    PoseEstimate, SketchMap, Understood,
};

use crate::feed::landmarks::Canvas;
use crate::walls;

/// Estimates after another sketch that may still be about the one before: on their way, or at work.
const IN_FLIGHT: u32 = 2;

/// Something that the machine has to hear.
pub(super) enum News {
    Status(MissionStatus),
    Estimate(Box<PoseEstimate>),
    Understood(Understood),
    Fault(Fault),
    /// What a robot sees of landmarks.
    View(Box<LandmarkView>),
    /// The walls of a mission from a file, as a picture.
    Walls(Vec<u8>),
}

/// The pad's readers, and the newest of what they have read.
pub(super) struct Inbox {
    statuses: Reader<MissionStatus>,
    estimates: Option<Reader<PoseEstimate>>,
    particle_sets: Option<Reader<Particles>>,
    plans: Option<Reader<Plan>>,
    scans: Reader<LaserScan>,
    sketches: Option<Reader<SketchMap>>,
    routes: Option<Reader<LandmarkRoute>>,
    views: Option<Reader<LandmarkView>>,
    progresses: Option<Reader<LandmarkProgress>>,
    faults: Reader<Fault>,
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
    /// A route past landmarks, what is seen of them, and how far the robot has come.
    pub(super) canvas: Option<Canvas>,
    pub(super) view: Option<Box<LandmarkView>>,
    pub(super) progress: Option<Box<LandmarkProgress>>,
}

/// A reader of a channel that the run's kind of navigator may have.
fn reader<T: Message>(node: &Node, channel: Channel<T>, kind: &str) -> anyhow::Result<Option<Reader<T>>> {
    Ok(if channel.spec.belongs_to(kind) { Some(node.reader(channel)?) } else { None })
}

impl Inbox {
    pub(super) fn open(node: &Node, kind: &str, draws: bool) -> anyhow::Result<Self> {
        Ok(Self {
            statuses: node.reader(STATUS)?,
            estimates: reader(node, ESTIMATE, kind)?,
            particle_sets: reader(node, PARTICLES, kind)?,
            plans: reader(node, PLAN, kind)?,
            scans: node.reader(SCAN)?,
            sketches: reader(node, SKETCH, kind)?,
            routes: reader(node, LANDMARK_ROUTE, kind)?,
            views: reader(node, LANDMARK_VIEW, kind)?,
            progresses: reader(node, LANDMARK_PROGRESS, kind)?,
            faults: node.reader(FAULTS)?,
            understood: node.reader(UNDERSTOOD)?,
            draws,
            size_px: None,
            sketch_seq: 0,
            wall_direction_rad: 0.0,
            in_flight: 0,
            estimate: None,
            scan: None,
            plan: None,
            particles: None,
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
        if let Some(views) = &mut self.views
            && let Some(view) = views.receive_valid()?
        {
            let view: Box<LandmarkView> = Box::new(*view);
            self.view = Some(view.clone());
            return Ok(Some(News::View(view)));
        }
        if let Some(fault) = self.faults.receive()? {
            return Ok(Some(News::Fault(*fault)));
        }
        if let Some(estimates) = &mut self.estimates
            && let Some(estimate) = estimates.receive_valid()?
        {
            let estimate: Box<PoseEstimate> = Box::new(*estimate);
            match self.in_flight.checked_sub(1) {
                Some(left) => self.in_flight = left,
                None => self.estimate = Some(estimate.clone()),
            }
            return Ok(Some(News::Estimate(estimate)));
        }
        if let Some(status) = self.statuses.receive()? {
            return Ok(Some(News::Status(*status)));
        }
        self.keep_newest()?;
        Ok(self.understood.receive()?.map(|answer| News::Understood(*answer)))
    }

    fn keep_newest(&mut self) -> anyhow::Result<()> {
        while let Some(scan) = self.scans.receive_valid()? {
            self.scan = Some(Box::new(*scan));
        }
        while let Some(plan) = newest(&mut self.plans)? {
            self.plan = Some(plan);
        }
        while let Some(particles) = newest(&mut self.particle_sets)? {
            self.particles = Some(particles);
        }
        while let Some(progress) = newest(&mut self.progresses)? {
            self.progress = Some(progress);
        }
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
        let Some(sketches) = &mut self.sketches else { return Ok(None) };
        let Some(sketch) = sketches.receive()? else { return Ok(None) };
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
        (self.estimate, self.plan, self.particles) = (None, None, None);
    }
}

/// The next message of a channel, where the run has it.
fn newest<T: Message>(reader: &mut Option<Reader<T>>) -> anyhow::Result<Option<Box<T>>> {
    let Some(reader) = reader else { return Ok(None) };
    Ok(reader.receive()?.map(|message| Box::new(*message)))
}

//! What comes in from the channels: the newest of everything, and each word that the machine has to hear.

use sketchnav_runtime::{Node, Reader};
use sketchnav_schemas::channels::{ESTIMATE, FAULTS, PARTICLES, PLAN, SCAN, SKETCH, STATUS, UNDERSTOOD};
use sketchnav_schemas::message::{
    Fault, LaserScan, MissionStatus, Particles, Plan, PoseEstimate, SketchMap, Understood,
};

use crate::walls;

/// Estimates after another sketch that may still be about the one before: on their way, or at work.
const IN_FLIGHT: u32 = 2;

/// Something that the machine has to hear.
pub(super) enum News {
    Status(MissionStatus),
    Estimate(Box<PoseEstimate>),
    Understood(Understood),
    Fault(Fault),
    /// The walls of a mission from a file, as a picture.
    Walls(Vec<u8>),
}

/// The pad's readers, and the newest of what they have read.
pub(super) struct Inbox {
    statuses: Reader<MissionStatus>,
    estimates: Reader<PoseEstimate>,
    particle_sets: Reader<Particles>,
    plans: Reader<Plan>,
    scans: Reader<LaserScan>,
    sketches: Reader<SketchMap>,
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
}

impl Inbox {
    pub(super) fn open(node: &Node, draws: bool) -> anyhow::Result<Self> {
        Ok(Self {
            statuses: node.reader(STATUS)?,
            estimates: node.reader(ESTIMATE)?,
            particle_sets: node.reader(PARTICLES)?,
            plans: node.reader(PLAN)?,
            scans: node.reader(SCAN)?,
            sketches: node.reader(SKETCH)?,
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
        })
    }

    /// The next word that the machine has to hear. What the planner said before the sketcher's answer comes
    /// before it.
    pub(super) fn next(&mut self) -> anyhow::Result<Option<News>> {
        if let Some(walls) = self.take_sketch()? {
            return Ok(Some(News::Walls(walls)));
        }
        if let Some(fault) = self.faults.receive()? {
            return Ok(Some(News::Fault(*fault)));
        }
        if let Some(estimate) = self.estimates.receive_valid()? {
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
        while let Some(plan) = self.plans.receive()? {
            self.plan = Some(Box::new(*plan));
        }
        while let Some(particles) = self.particle_sets.receive()? {
            self.particles = Some(Box::new(*particles));
        }
        Ok(())
    }

    fn take_sketch(&mut self) -> anyhow::Result<Option<Vec<u8>>> {
        let Some(sketch) = self.sketches.receive()? else { return Ok(None) };
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

//! What comes in from the channels: the newest of everything, and each word that the machine has to hear.

use sketchnav_runtime::{Node, Reader};
use sketchnav_schemas::channels::{
    CORRESPONDENCE, ESTIMATE, FAULTS, PARTICLES, PLAN, SCAN, SKETCH, STATUS, UNDERSTOOD,
};
use sketchnav_schemas::message::{
    Correspondence, Fault, LaserScan, MissionStatus, Particles, Plan, PoseEstimate, SketchMap, Understood,
};
use sketchnav_schemas::sketch_mission::KIND;

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
    drawn: Option<DrawnReaders>,
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
    pub(super) correspondence: Option<Box<Correspondence>>,
}

/// Readers of what a navigator in drawings says.
struct DrawnReaders {
    estimates: Reader<PoseEstimate>,
    particle_sets: Reader<Particles>,
    plans: Reader<Plan>,
    correspondences: Reader<Correspondence>,
    scans: Reader<LaserScan>,
    sketches: Reader<SketchMap>,
}

impl DrawnReaders {
    fn open(node: &Node) -> anyhow::Result<Self> {
        Ok(Self {
            estimates: node.reader(ESTIMATE)?,
            particle_sets: node.reader(PARTICLES)?,
            plans: node.reader(PLAN)?,
            correspondences: node.reader(CORRESPONDENCE)?,
            scans: node.reader(SCAN)?,
            sketches: node.reader(SKETCH)?,
        })
    }
}

impl Inbox {
    pub(super) fn open(node: &Node, kind: &str, draws: bool) -> anyhow::Result<Self> {
        Ok(Self {
            statuses: node.reader(STATUS)?,
            drawn: (kind == KIND).then(|| DrawnReaders::open(node)).transpose()?,
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
            correspondence: None,
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
        if let Some(estimate) = self.next_estimate()? {
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

    fn next_estimate(&mut self) -> anyhow::Result<Option<Box<PoseEstimate>>> {
        let Some(drawn) = &mut self.drawn else { return Ok(None) };
        Ok(drawn.estimates.receive_valid()?.map(|estimate| Box::new(*estimate)))
    }

    fn keep_newest(&mut self) -> anyhow::Result<()> {
        let Some(drawn) = &mut self.drawn else { return Ok(()) };
        while let Some(scan) = drawn.scans.receive_valid()? {
            self.scan = Some(Box::new(*scan));
        }
        while let Some(plan) = drawn.plans.receive()? {
            self.plan = Some(Box::new(*plan));
        }
        while let Some(found) = drawn.correspondences.receive()? {
            self.correspondence = Some(Box::new(*found));
        }
        while let Some(particles) = drawn.particle_sets.receive()? {
            self.particles = Some(Box::new(*particles));
        }
        Ok(())
    }

    fn take_sketch(&mut self) -> anyhow::Result<Option<Vec<u8>>> {
        let Some(drawn) = &mut self.drawn else { return Ok(None) };
        let Some(sketch) = drawn.sketches.receive()? else { return Ok(None) };
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

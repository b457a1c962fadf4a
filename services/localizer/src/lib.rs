//! The process that finds the robot in the drawing: a thin shell around [`core::Core`].
//!
//! It answers every scan with one estimate, and once a simulated second with a sample of the
//! particles before it. Scans that come before the sketch wait, and a scan waits for the odometry of its
//! moment. Where people draw while it runs, nothing waits for a sketch, and with each new one the filter
//! begins anew. Killed, its successor goes on from the last checkpoint and sends each message once.

pub mod core;

use std::time::Duration;

use anyhow::Context;
use serde::{Deserialize, Serialize};
use sketchnav_runtime::{
    Checkpoints, Found, HealthReporter, Node, Reader, Sample, SliceReader, Step, UpTo, Wake, Writer,
};
use sketchnav_schemas::channels::{ESTIMATE, ODOMETRY, PARTICLES, SCAN, SKETCH};
use sketchnav_schemas::message::{LaserScan, Odometry, Particles, PoseEstimate, SketchMap};

use crate::core::{Core, State};

/// Longest sleep between two looks at the channels.
const NAP: Duration = Duration::from_millis(250);
/// The form of [`Positions`] and [`State`].
const CHECKPOINT: &str = "localizer 3";

/// Where in its channels the localizer stands: the last number that was taken or given.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Positions {
    scan: u64,
    odometry: u64,
    estimate: u64,
    particles: u64,
}

/// Runs the localizer in `node`'s system until it is asked to end.
///
/// # Errors
/// Parameters or a sketch that cannot be; a channel that fails.
pub fn run(node: &Node) -> anyhow::Result<()> {
    let config = node.run_config()?;
    let mut core = Core::new(&config)?;
    let mut health = HealthReporter::new(node)?;
    let (mut checkpoints, found) = Checkpoints::<(Positions, State)>::open(node, CHECKPOINT)?;
    found.report(node);
    let mut ports = Ports::open(node)?;
    if let Some(last) = ports.estimates.last_kept().filter(|_| found.is_lost()) {
        core.begin_at(last);
    }
    let mut stamp_ns = 0;
    let before = found.state.as_ref().map_or(0, |(_, state)| state.sketch_seq());
    let awaited = if config.pad.draws() { before } else { before.max(1) };
    if ports.wait_for_sketch(node, &mut core, &mut health, awaited)? {
        ports.resume(&mut core, found);
        loop {
            while let Some(scan) = ports.next()? {
                if ports.take_sketch(&mut core)? {
                    checkpoints.write(&(ports.positions(), core.state()))?;
                }
                stamp_ns = scan.header.stamp_ns;
                let step = Step::begin();
                ports.answer(&mut core, &scan)?;
                checkpoints.after_step(|| (ports.positions(), core.state()))?;
                health.end(step);
            }
            health.report_if_due(stamp_ns)?;
            if node.wait(NAP) == Wake::Terminate {
                break;
            }
        }
    }
    Ok(health.report(stamp_ns)?)
}

struct Ports {
    sketches: SliceReader<SketchMap>,
    scans: Reader<LaserScan>,
    /// The last scan that was answered.
    answered: u64,
    /// A scan whose odometry has not come yet.
    waiting: Option<Sample<LaserScan>>,
    odometry: UpTo<Odometry>,
    estimates: Writer<PoseEstimate>,
    particles: Writer<Particles>,
}

impl Ports {
    fn open(node: &Node) -> anyhow::Result<Self> {
        Ok(Self {
            sketches: node.slice_reader(SKETCH)?,
            scans: node.reader(SCAN)?,
            answered: 0,
            waiting: None,
            odometry: UpTo::new(node.reader(ODOMETRY)?),
            estimates: node.writer(ESTIMATE)?,
            particles: node.writer(PARTICLES)?,
        })
    }

    /// Waits until the sketch number `awaited` has come, or a newer one; false where the end comes first.
    fn wait_for_sketch(
        &mut self,
        node: &Node,
        core: &mut Core,
        health: &mut HealthReporter,
        awaited: u64,
    ) -> anyhow::Result<bool> {
        loop {
            self.take_sketch(core)?;
            if core.sketch_seq() >= awaited {
                return Ok(true);
            }
            health.report_if_due(0)?;
            if node.wait(NAP) == Wake::Terminate {
                return Ok(false);
            }
        }
    }

    /// Whether a sketch has come, the first or another.
    fn take_sketch(&mut self, core: &mut Core) -> anyhow::Result<bool> {
        let mut is_new = false;
        while let Some(sketch) = self.sketches.receive()? {
            core.on_sketch(sketch.message(), sketch.bytes()).context("the sketch cannot be used")?;
            is_new = true;
        }
        Ok(is_new)
    }

    /// Goes on where the predecessor stood. Where its checkpoints cannot be used, the filter begins anew
    /// where the robot was last, with the scan after the last one that was answered.
    fn resume(&mut self, core: &mut Core, found: Found<(Positions, State)>) {
        let is_lost = found.is_lost();
        if let Some((positions, state)) = found.state {
            core.restore(state);
            self.answered = positions.scan;
            self.scans.resume_after(positions.scan);
            self.odometry.resume_after(positions.odometry);
            self.estimates.resume_after(positions.estimate);
            self.particles.resume_after(positions.particles);
        } else if is_lost {
            let answered = self.estimates.last_kept().map_or(0, |last| last.header.source_seq);
            eprintln!("no checkpoint can be used: the filter begins anew after scan {answered}");
            self.answered = answered;
            self.scans.resume_after(answered);
            self.odometry.resume_after(answered);
            self.estimates.resume_behind_kept();
            self.particles.resume_behind_kept();
        }
    }

    fn positions(&self) -> Positions {
        Positions {
            scan: self.answered,
            odometry: self.odometry.position(),
            estimate: self.estimates.last_seq(),
            particles: self.particles.last_seq(),
        }
    }

    /// The next scan whose odometry is here too. One from before all odometry has no answer.
    fn next(&mut self) -> anyhow::Result<Option<Sample<LaserScan>>> {
        loop {
            let scan = match self.waiting.take() {
                None => self.scans.receive_valid()?,
                scan => scan,
            };
            let Some(scan) = scan else { return Ok(None) };
            if !self.odometry.advance_to(scan.header.stamp_ns)? {
                self.waiting = Some(scan);
                return Ok(None);
            }
            if self.odometry.newest().is_some() {
                return Ok(Some(scan));
            }
        }
    }

    /// Fills the messages where they lie in shared memory; the particles go before the estimate.
    fn answer(&mut self, core: &mut Core, scan: &LaserScan) -> anyhow::Result<()> {
        let Some(odometry) = self.odometry.newest() else { return Ok(()) };
        let due = core.particles_due(scan.header.stamp_ns);
        let mut particles = due.then(|| self.particles.loan()).transpose()?;
        let mut estimate = self.estimates.loan()?;
        core.step(odometry, scan, &mut estimate, particles.as_deref_mut());
        if let Some(particles) = particles {
            particles.send_quietly()?;
        }
        estimate.send()?;
        self.answered = scan.header.seq;
        Ok(())
    }
}

//! The process that finds the robot in the drawing: a thin shell around [`core::Core`].
//!
//! It answers every scan with one estimate, and once a simulated second with a sample of the
//! particles before it. Scans that come before the sketch wait, and a scan waits for the odometry of its
//! moment.

pub mod core;

use std::time::Duration;

use anyhow::Context;
use sketchnav_runtime::{HealthReporter, Node, Reader, Sample, Step, UpTo, Wake, Writer};
use sketchnav_schemas::channels::{ESTIMATE, ODOMETRY, PARTICLES, SCAN, SKETCH};
use sketchnav_schemas::message::{LaserScan, Odometry, Particles, PoseEstimate};

use crate::core::Core;

/// Longest sleep between two looks at the channels.
const NAP: Duration = Duration::from_millis(250);

/// Runs the localizer in `node`'s system until it is asked to end.
///
/// # Errors
/// Parameters or a sketch that cannot be; a channel that fails.
pub fn run(node: &Node) -> anyhow::Result<()> {
    let mut core = Core::new(&node.run_config()?)?;
    let mut health = HealthReporter::new(node)?;
    let mut scans = node.reader(SCAN)?;
    let mut odometry = UpTo::new(node.reader(ODOMETRY)?);
    let mut output = Output { estimates: node.writer(ESTIMATE)?, particles: node.writer(PARTICLES)? };
    let (mut stamp_ns, mut waiting) = (0, None);
    if wait_for_sketch(node, &mut core, &mut health)? {
        loop {
            while let Some(scan) = next(&mut waiting, &mut scans)? {
                stamp_ns = scan.header.stamp_ns;
                if !odometry.advance_to(stamp_ns)? {
                    waiting = Some(scan);
                    break;
                }
                let Some(reading) = odometry.newest() else { continue };
                let step = Step::begin();
                output.answer(&mut core, reading, &scan)?;
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

/// Returns whether the sketch came before the end.
fn wait_for_sketch(node: &Node, core: &mut Core, health: &mut HealthReporter) -> anyhow::Result<bool> {
    let mut sketches = node.slice_reader(SKETCH)?;
    loop {
        if let Some(sketch) = sketches.receive()? {
            core.on_sketch(sketch.message(), sketch.bytes()).context("the sketch cannot be used")?;
            return Ok(true);
        }
        health.report_if_due(0)?;
        if node.wait(NAP) == Wake::Terminate {
            return Ok(false);
        }
    }
}

/// The scan that waits for its odometry, or the next one.
fn next(
    waiting: &mut Option<Sample<LaserScan>>,
    scans: &mut Reader<LaserScan>,
) -> anyhow::Result<Option<Sample<LaserScan>>> {
    match waiting.take() {
        None => Ok(scans.receive()?),
        scan => Ok(scan),
    }
}

struct Output {
    estimates: Writer<PoseEstimate>,
    particles: Writer<Particles>,
}

impl Output {
    /// Fills the messages where they lie in shared memory; the particles go before the estimate.
    fn answer(&mut self, core: &mut Core, odometry: &Odometry, scan: &LaserScan) -> anyhow::Result<()> {
        let due = core.particles_due(scan.header.stamp_ns);
        let mut particles = due.then(|| self.particles.loan()).transpose()?;
        let mut estimate = self.estimates.loan()?;
        core.step(odometry, scan, &mut estimate, particles.as_deref_mut());
        if let Some(particles) = particles {
            particles.send_quietly()?;
        }
        estimate.send()?;
        Ok(())
    }
}

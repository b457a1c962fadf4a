//! The process that drives the robot to its goals: a thin shell around [`core::Core`].
//!
//! It answers every estimate with a plan where one is due, one command and, last, one status. In
//! lockstep the first estimate waits for the sketch, the route and the order to start; in real time
//! the robot stands still until they have come.

pub mod core;

use std::time::Duration;

use anyhow::Context;
use sketchnav_runtime::{HealthReporter, Node, Reader, Sample, SliceReader, Step, UpTo, Wake, Writer};
use sketchnav_schemas::channels::{COMMAND, ESTIMATE, MISSION, ODOMETRY, PLAN, ROUTE, SCAN, SKETCH, STATUS};
use sketchnav_schemas::message::{
    LaserScan, MissionCommand, MissionStatus, Odometry, Plan, PoseEstimate, Route, SketchMap, VelocityCommand,
};
use sketchnav_schemas::run::Pace;

use crate::core::Core;

/// Longest sleep between two looks at the channels.
const NAP: Duration = Duration::from_millis(250);

/// Runs the planner in `node`'s system until it is asked to end.
///
/// # Errors
/// Parameters or a sketch that cannot be; a channel that fails.
pub fn run(node: &Node) -> anyhow::Result<()> {
    let config = node.run_config()?;
    let mut core = Core::new(&config)?;
    let mut health = HealthReporter::new(node)?;
    let mut wishes = Wishes::open(node)?;
    let mut senses = Senses::open(node)?;
    let mut output = Output::open(node)?;
    let mut stamp_ns = 0;
    loop {
        wishes.pass_on(&mut core)?;
        while core.is_ready() || config.pace != Pace::Lockstep {
            let Some(estimate) = senses.next()? else { break };
            let step = Step::begin();
            stamp_ns = estimate.header.stamp_ns;
            output.answer(&mut core, &senses, &estimate)?;
            health.end(step);
            wishes.pass_on(&mut core)?;
        }
        health.report_if_due(stamp_ns)?;
        if node.wait(NAP) == Wake::Terminate {
            return Ok(health.report(stamp_ns)?);
        }
    }
}

/// What people want: the drawing, the tasks, the orders.
struct Wishes {
    sketches: SliceReader<SketchMap>,
    routes: Reader<Route>,
    orders: Reader<MissionCommand>,
}

impl Wishes {
    fn open(node: &Node) -> anyhow::Result<Self> {
        let sketches = node.slice_reader(SKETCH)?;
        Ok(Self { sketches, routes: node.reader(ROUTE)?, orders: node.reader(MISSION)? })
    }

    fn pass_on(&mut self, core: &mut Core) -> anyhow::Result<()> {
        while let Some(sketch) = self.sketches.receive()? {
            core.on_sketch(sketch.message(), sketch.bytes()).context("the sketch cannot be used")?;
        }
        while let Some(route) = self.routes.receive()? {
            core.on_route(&route);
        }
        while let Some(order) = self.orders.receive()? {
            core.on_order(&order);
        }
        Ok(())
    }
}

/// What the robot knows: the estimates, and the scans and odometry that they come from.
struct Senses {
    estimates: Reader<PoseEstimate>,
    /// An estimate whose scan or odometry has not come yet.
    waiting: Option<Sample<PoseEstimate>>,
    scans: UpTo<LaserScan>,
    odometry: UpTo<Odometry>,
}

impl Senses {
    fn open(node: &Node) -> anyhow::Result<Self> {
        Ok(Self {
            estimates: node.reader(ESTIMATE)?,
            waiting: None,
            scans: UpTo::new(node.reader(SCAN)?),
            odometry: UpTo::new(node.reader(ODOMETRY)?),
        })
    }

    /// The next estimate whose scan and odometry are here too. Which of them comes first is chance:
    /// a reader that joins late gets each channel's history when its writer comes to it.
    fn next(&mut self) -> anyhow::Result<Option<Sample<PoseEstimate>>> {
        let estimate = match self.waiting.take() {
            None => self.estimates.receive()?,
            estimate => estimate,
        };
        let Some(estimate) = estimate else { return Ok(None) };
        let stamp_ns = estimate.header.stamp_ns;
        let scan_is_here = self.scans.advance_to(stamp_ns)?;
        if self.odometry.advance_to(stamp_ns)? && scan_is_here {
            return Ok(Some(estimate));
        }
        self.waiting = Some(estimate);
        Ok(None)
    }
}

struct Output {
    plans: Writer<Plan>,
    commands: Writer<VelocityCommand>,
    statuses: Writer<MissionStatus>,
}

impl Output {
    fn open(node: &Node) -> anyhow::Result<Self> {
        Ok(Self {
            plans: node.writer(PLAN)?,
            commands: node.writer(COMMAND)?,
            statuses: node.writer(STATUS)?,
        })
    }

    /// Fills the messages where they lie in shared memory. An estimate has no answer before the first
    /// scan and odometry: the world stops a robot that nobody commands.
    fn answer(&mut self, core: &mut Core, senses: &Senses, estimate: &PoseEstimate) -> anyhow::Result<()> {
        let (Some(scan), Some(odometry)) = (senses.scans.newest(), senses.odometry.newest()) else {
            return Ok(());
        };
        if core.step(estimate, scan, odometry).planned {
            let mut plan = self.plans.loan()?;
            core.write_plan(&mut plan);
            plan.send_quietly()?;
        }
        self.commands.send(|command| core.write_command(command))?;
        self.statuses.send(|status| core.write_status(status))?;
        Ok(())
    }
}

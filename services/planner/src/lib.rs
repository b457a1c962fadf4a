//! The process that drives the robot to its goals: a thin shell around [`core::Core`].
//!
//! It answers every estimate with a plan where one is due, one command and, last, one status. In
//! lockstep the first estimate waits for the sketch, the route and the order to start; in real time
//! the robot stands still until they have come. Orders come from the supervisor and from the pad.

pub mod core;

use std::time::Duration;

use anyhow::Context;
use serde::{Deserialize, Serialize};
use sketchnav_runtime::{
    Checkpoints, Found, HealthReporter, Node, Reader, Sample, SliceReader, Step, UpTo, Wake, Writer,
};
use sketchnav_schemas::channels::{
    COMMAND, ESTIMATE, MISSION, ODOMETRY, ORDERS, PLAN, ROUTE, SCAN, SKETCH, STATUS,
};
use sketchnav_schemas::message::{
    LaserScan, MissionCommand, MissionStatus, Odometry, Plan, PoseEstimate, Route, SketchMap, VelocityCommand,
};
use sketchnav_schemas::run::{Pace, RunConfig};

use crate::core::{Core, State};

/// Longest sleep between two looks at the channels.
const NAP: Duration = Duration::from_millis(250);
/// The form of [`Positions`] and [`State`].
const CHECKPOINT: &str = "planner 6";

/// Where in its channels the planner stands: the last number that was taken or given.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Positions {
    order: u64,
    pad_order: u64,
    estimate: u64,
    scan: u64,
    odometry: u64,
    plan: u64,
    command: u64,
    status: u64,
}

/// Runs the planner in `node`'s system until it is asked to end.
///
/// # Errors
/// Parameters or a sketch that cannot be; a channel that fails.
pub fn run(node: &Node) -> anyhow::Result<()> {
    let config = node.run_config()?;
    let mut core = Core::new(&config)?;
    let mut health = HealthReporter::new(node)?;
    let (mut checkpoints, found) = Checkpoints::<(Positions, State)>::open(node, CHECKPOINT)?;
    let mut ports = Ports::open(node)?;
    let mut stamp_ns = 0;
    if !ports.resume(node, &config, &mut core, &mut health, found)? {
        return Ok(health.report(stamp_ns)?);
    }
    loop {
        ports.take_wishes(&config, &mut core, &mut checkpoints)?;
        while core.is_ready() || config.pace != Pace::Lockstep {
            let Some(estimate) = ports.senses.next()? else { break };
            let step = Step::begin();
            stamp_ns = estimate.header.stamp_ns;
            ports.output.answer(&mut core, &ports.senses, &estimate)?;
            ports.answered = estimate.header.seq;
            checkpoints.after_step(|| (ports.positions(), core.state()))?;
            health.end(step);
            ports.take_wishes(&config, &mut core, &mut checkpoints)?;
        }
        health.report_if_due(stamp_ns)?;
        if node.wait(NAP) == Wake::Terminate {
            return Ok(health.report(stamp_ns)?);
        }
    }
}

struct Ports {
    wishes: Wishes,
    senses: Senses,
    output: Output,
    /// The last estimate that was answered.
    answered: u64,
}

impl Ports {
    fn open(node: &Node) -> anyhow::Result<Self> {
        let (wishes, senses, output) = (Wishes::open(node)?, Senses::open(node)?, Output::open(node)?);
        Ok(Self { wishes, senses, output, answered: 0 })
    }

    /// Where people take part it is chance when they say something: a step after that cannot be taken a second
    /// time from before it.
    fn take_wishes(
        &mut self,
        config: &RunConfig,
        core: &mut Core,
        checkpoints: &mut Checkpoints<(Positions, State)>,
    ) -> anyhow::Result<()> {
        if self.wishes.pass_on(core)? && !config.pad.is_absent() {
            checkpoints.write(&(self.positions(), core.state()))?;
        }
        Ok(())
    }

    /// Goes on where the predecessor stood, as soon as the drawing and the tasks have come again; false
    /// where the end comes first. Where its checkpoints cannot be used the task that it was at begins anew, with
    /// the estimate after the last one that was answered; where people draw, once somebody orders it again.
    fn resume(
        &mut self,
        node: &Node,
        config: &RunConfig,
        core: &mut Core,
        health: &mut HealthReporter,
        found: Found<(Positions, State)>,
    ) -> anyhow::Result<bool> {
        let is_lost = found.is_lost();
        found.report(node);
        if let Some((positions, state)) = found.state {
            self.wishes.resume_after(&positions);
            self.answered = positions.estimate;
            self.senses.resume_after(&positions);
            self.output.resume_after(&positions);
            let is_here = |core: &Core| match config.pad.draws() {
                true => core.drawing().iter().zip(state.drawing()).all(|(came, awaited)| *came >= awaited),
                false => core.has_drawing(),
            };
            while !is_here(core) {
                self.wishes.pass_on_drawing(core)?;
                health.report_if_due(0)?;
                if !is_here(core) && node.wait(NAP) == Wake::Terminate {
                    return Ok(false);
                }
            }
            core.restore(state);
        } else if is_lost {
            self.output.resume_behind_kept();
            // What was ordered at the pad is old by now; a robot does not drive off by it.
            self.wishes.pad_orders.take_kept(node, |_| {})?;
            if let Some(last) = self.output.statuses.last_kept() {
                eprintln!("no checkpoint can be used: task {} begins anew", last.task + 1);
                core.resume_behind(last);
                self.senses.resume_after_scan(last.header.source_seq);
            }
        }
        Ok(true)
    }

    fn positions(&self) -> Positions {
        Positions {
            order: self.wishes.orders.position(),
            pad_order: self.wishes.pad_orders.position(),
            estimate: self.answered,
            scan: self.senses.scans.position(),
            odometry: self.senses.odometry.position(),
            plan: self.output.plans.last_seq(),
            command: self.output.commands.last_seq(),
            status: self.output.statuses.last_seq(),
        }
    }
}

/// What people want: the drawing, the tasks, the orders.
struct Wishes {
    sketches: SliceReader<SketchMap>,
    routes: Reader<Route>,
    orders: Reader<MissionCommand>,
    pad_orders: Reader<MissionCommand>,
}

impl Wishes {
    fn open(node: &Node) -> anyhow::Result<Self> {
        Ok(Self {
            sketches: node.slice_reader(SKETCH)?,
            routes: node.reader(ROUTE)?,
            orders: node.reader(MISSION)?,
            pad_orders: node.reader(ORDERS)?,
        })
    }

    fn resume_after(&mut self, positions: &Positions) {
        self.orders.resume_after(positions.order);
        self.pad_orders.resume_after(positions.pad_order);
    }

    /// Whether there was anything.
    fn pass_on(&mut self, core: &mut Core) -> anyhow::Result<bool> {
        let mut is_new = self.pass_on_drawing(core)?;
        while let Some(order) = self.next_order()? {
            // What is ordered was drawn before, and may have come since the line above.
            self.pass_on_drawing(core)?;
            core.on_order(&order);
            is_new = true;
        }
        Ok(is_new)
    }

    /// What a person says at the pad goes before.
    fn next_order(&mut self) -> anyhow::Result<Option<Sample<MissionCommand>>> {
        let order = self.pad_orders.receive()?;
        Ok(if order.is_some() { order } else { self.orders.receive()? })
    }

    /// Whether there was anything.
    fn pass_on_drawing(&mut self, core: &mut Core) -> anyhow::Result<bool> {
        let mut is_new = false;
        while let Some(sketch) = self.sketches.receive()? {
            core.on_sketch(sketch.message(), sketch.bytes()).context("the sketch cannot be used")?;
            is_new = true;
        }
        while let Some(route) = self.routes.receive()? {
            core.on_route(&route);
            is_new = true;
        }
        Ok(is_new)
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

    fn resume_after(&mut self, positions: &Positions) {
        self.estimates.resume_after(positions.estimate);
        self.scans.resume_after(positions.scan);
        self.odometry.resume_after(positions.odometry);
    }

    /// An estimate, a scan and a reading of the odometry a step: they bear the same number.
    fn resume_after_scan(&mut self, seq: u64) {
        self.estimates.resume_after(seq);
        self.scans.resume_after(seq);
        self.odometry.resume_after(seq);
    }

    /// The next estimate whose scan and odometry are here too. Which of them comes first is chance:
    /// a reader that joins late gets each channel's history when its writer comes to it.
    fn next(&mut self) -> anyhow::Result<Option<Sample<PoseEstimate>>> {
        let estimate = match self.waiting.take() {
            None => self.estimates.receive_sound()?,
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

    fn resume_after(&mut self, positions: &Positions) {
        self.plans.resume_after(positions.plan);
        self.commands.resume_after(positions.command);
        self.statuses.resume_after(positions.status);
    }

    fn resume_behind_kept(&mut self) {
        self.plans.resume_behind_kept();
        self.commands.resume_behind_kept();
        self.statuses.resume_behind_kept();
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

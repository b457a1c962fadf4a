//! Health reports, which a process publishes once a second and when it ends.

use std::rc::Rc;
use std::time::{Duration, Instant};

use sketchnav_schemas::channels::HEALTH;
use sketchnav_schemas::message::Health;

use crate::Result;
use crate::allocations::allocations_of_this_thread;
use crate::node::{Counters, Node};
use crate::writer::Writer;

const PERIOD: Duration = Duration::from_secs(1);

/// Measures steps and publishes `health`.
pub struct HealthReporter {
    writer: Writer<Health>,
    counters: Rc<Counters>,
    process: u32,
    started: Instant,
    reported: Option<Instant>,
    steps: u64,
    busy: Duration,
    longest_step: Duration,
    allocations: u64,
}

/// A step in progress.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    began: Instant,
    allocations: u64,
}

impl Step {
    /// Begins a step now.
    pub fn begin() -> Self {
        Self { began: Instant::now(), allocations: allocations_of_this_thread() }
    }
}

impl HealthReporter {
    /// Opens `health` for the node's process. The first message is due immediately.
    pub fn new(node: &Node) -> Result<Self> {
        Ok(Self {
            writer: node.writer(HEALTH)?,
            counters: node.counters(),
            process: node.process().code(),
            started: Instant::now(),
            reported: None,
            steps: 0,
            busy: Duration::ZERO,
            longest_step: Duration::ZERO,
            allocations: 0,
        })
    }

    /// Ends a step, and counts its duration and its heap allocations.
    pub fn end(&mut self, step: Step) {
        let took = step.began.elapsed();
        self.steps += 1;
        self.busy += took;
        self.longest_step = self.longest_step.max(took);
        self.allocations += allocations_of_this_thread() - step.allocations;
    }

    /// Publishes if a second has passed since the last message. `stamp_ns` is the simulation time in nanoseconds.
    pub fn report_if_due(&mut self, stamp_ns: u64) -> Result<()> {
        match self.reported {
            Some(reported) if reported.elapsed() < PERIOD => Ok(()),
            _ => self.report(stamp_ns),
        }
    }

    /// Publishes now. A process also does this when it ends. `stamp_ns` is the simulation time in nanoseconds.
    pub fn report(&mut self, stamp_ns: u64) -> Result<()> {
        self.reported = Some(Instant::now());
        let longest_step = std::mem::take(&mut self.longest_step);
        let mut health = self.writer.loan()?;
        health.header.stamp_ns = stamp_ns;
        health.process = self.process;
        health.pid = std::process::id();
        health.steps = self.steps;
        health.busy_ns = self.busy.as_nanos() as u64;
        health.step_max_ns = longest_step.as_nanos() as u64;
        health.step_allocations = self.allocations;
        health.lost_messages = self.counters.lost.get();
        health.refused_messages = self.counters.refused.get();
        health.uptime_ns = self.started.elapsed().as_nanos() as u64;
        health.send()?;
        Ok(())
    }
}

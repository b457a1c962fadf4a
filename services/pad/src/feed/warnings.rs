//! Warnings in words.

use std::time::Duration;

use serde::Serialize;
use sketchnav_schemas::codes::{TaskState, Tracking};
use sketchnav_schemas::message::MissionStatus;

use super::Services;

/// A warning for people.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Warning {
    /// `lost`, `doubtful`, `blocked`, `stopped`, `restarting` or `link`.
    pub kind: &'static str,
    /// The text.
    pub text: String,
}

/// How the failed tasks of the current drive ended.
#[derive(Debug, Clone, Default)]
pub struct Ends {
    failed: Vec<(u32, Warning)>,
}

impl Ends {
    /// Processes a status of the planner.
    pub fn on_status(&mut self, status: &MissionStatus) {
        let kind = match TaskState::from_code(status.state) {
            Some(TaskState::Blocked) => "blocked",
            Some(TaskState::Lost) => "lost",
            Some(TaskState::TimedOut) => "stopped",
            _ => return,
        };
        if self.failed.iter().all(|(task, _)| *task != status.task) {
            let text = format!("{}: {}", status.name.as_str(), status.reason.as_str());
            self.failed.push((status.task, Warning { kind, text }));
        }
    }

    /// Clears the warnings, because another drive begins.
    pub fn clear(&mut self) {
        self.failed.clear();
    }
}

/// Returns the current warnings about the robot, its tasks, its processes and the link to the driver.
pub fn warnings(
    status: Option<&MissionStatus>,
    tracking: Option<Tracking>,
    ends: &Ends,
    services: &Services,
    silence: Option<Duration>,
) -> Vec<Warning> {
    let mut all: Vec<_> = ends.failed.iter().map(|(_, warning)| warning.clone()).collect();
    let mut warn = |kind, text: String| all.push(Warning { kind, text });
    match tracking {
        Some(Tracking::Lost) => warn("lost", "the robot does not know where it is".into()),
        Some(Tracking::Doubtful) => warn("doubtful", "the robot is not sure where it is".into()),
        _ => {}
    }
    if let Some(status) = status.filter(|status| !status.reason.as_str().is_empty()) {
        let text = status.reason.as_str().to_owned();
        match TaskState::from_code(status.state) {
            Some(TaskState::Driving) => warn("blocked", text),
            Some(TaskState::Paused) => warn("stopped", text),
            _ => {}
        }
    }
    for name in services.down() {
        warn("restarting", format!("the {name} does not answer: it is being restarted"));
    }
    if let Some(silence) = silence {
        warn("link", format!("no sign of life from the driver for {:.0} s", silence.as_secs_f64()));
    }
    all
}

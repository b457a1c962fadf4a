//! What every process of a system gets at its start: the resolved mission, the seed, the pace.

use serde::{Deserialize, Serialize};

use crate::codes::Process;
use crate::fault_plan::PlannedFault;
use crate::mission::Mission;
use crate::robot::Robot;

/// How simulated time passes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pace {
    /// The world takes a step as soon as the command for the step before has arrived.
    Lockstep,
    /// The world follows the clock at this many simulated seconds per second, whether the services keep up or not.
    RealTime {
        /// Simulated seconds per second.
        speed: f64,
    },
}

/// Whether people take part in a run by the pad's page, and how.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pad {
    /// There is no page.
    #[default]
    Absent,
    /// It shows the mission, and can abort and continue it.
    Watches,
    /// The drawing and the tasks come from the page instead of the mission, as often as they are sent. The run continues until
    /// it is interrupted.
    Draws,
}

impl Pad {
    /// Whether there is no page.
    pub fn is_absent(&self) -> bool {
        *self == Self::Absent
    }

    /// Whether the drawing and the tasks come from the page.
    pub fn draws(self) -> bool {
        self == Self::Draws
    }
}

/// When a growing recording continues in a new file: as soon as either limit is reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Split {
    /// The file has this many bytes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bytes: Option<u64>,
    /// It covers this much simulated time, nanoseconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration_ns: Option<u64>,
}

impl Split {
    /// Whether the recording is one file.
    pub fn is_never(&self) -> bool {
        *self == Self::default()
    }

    /// Whether a file of this size and length is full.
    pub fn is_full(&self, bytes: u64, duration_ns: u64) -> bool {
        self.bytes.is_some_and(|most| bytes >= most)
            || self.duration_ns.is_some_and(|longest| duration_ns >= longest)
    }
}

/// A run: written by the supervisor as `run.json` in the system's folder, read by every process.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunConfig {
    /// Name of the system.
    pub system: String,
    /// The mission; its paths are absolute, or names inside the recording `files_of`.
    pub mission: Mission,
    /// The method by which the navigator drives, resolved at launch and never empty in a system. It is empty in runs within one
    /// process, and in some recordings of earlier versions.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub method: String,
    /// The recording that contains the files of the mission; `None` if they are on disk. This is for the processes of a running
    /// system and has no meaning in a recording.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub files_of: Option<String>,
    /// The robot that the mission names.
    pub robot: Robot,
    /// The mission's seed.
    pub seed: u64,
    /// How time passes.
    pub pace: Pace,
    /// The recording's path; `None` if nothing records.
    pub recording: Option<String>,
    /// When the recording continues in a new file.
    #[serde(default, skip_serializing_if = "Split::is_never")]
    pub split: Split,
    /// Whether people take part by the pad's page.
    #[serde(default, skip_serializing_if = "Pad::is_absent")]
    pub pad: Pad,
    /// The services that the supervisor does not start: they are run by hand, or a robot's driver stands in for the world.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub without: Vec<Process>,
    /// Planned faults of its messages and processes, each of which happens once.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<PlannedFault>,
}

impl RunConfig {
    /// A run in lockstep without a recording, for one process or a test.
    pub fn lockstep(system: &str, mission: Mission, robot: Robot, seed: u64) -> Self {
        Self {
            system: system.to_owned(),
            mission,
            method: String::new(),
            files_of: None,
            robot,
            seed,
            pace: Pace::Lockstep,
            recording: None,
            split: Split::default(),
            pad: Pad::Absent,
            without: Vec::new(),
            faults: Vec::new(),
        }
    }
}

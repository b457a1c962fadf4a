//! The description of a run that every process of a system receives at its start: the resolved mission, the
//! seed and the pace.

use serde::{Deserialize, Serialize};

use crate::codes::Process;
use crate::fault_plan::PlannedFault;
use crate::mission::Mission;
use crate::robot::Robot;

/// How simulated time relates to the wall clock during a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pace {
    /// The world takes a step as soon as the command for the previous step has arrived.
    Lockstep,
    /// The world follows the wall clock, whether or not the services keep up.
    RealTime {
        /// Simulated seconds per second.
        speed: f64,
    },
}

/// Whether, and how, people take part in a run through the pad's page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pad {
    /// There is no page.
    #[default]
    Absent,
    /// The page shows the mission and can abort and continue it.
    Watches,
    /// The drawing and the tasks come from the page instead of the mission, and may be sent again at any
    /// time. The run continues until it is interrupted.
    Draws,
}

impl Pad {
    /// Returns true if there is no page.
    pub fn is_absent(&self) -> bool {
        *self == Self::Absent
    }

    /// Returns true if the drawing and the tasks come from the page.
    pub fn draws(self) -> bool {
        self == Self::Draws
    }
}

/// The limits at which a growing recording is continued in a new file. Whichever is reached first applies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Split {
    /// Maximum size of a file, in bytes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bytes: Option<u64>,
    /// Maximum simulated time that a file covers, in nanoseconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration_ns: Option<u64>,
}

impl Split {
    /// Returns true if the recording is not split.
    pub fn is_never(&self) -> bool {
        *self == Self::default()
    }

    /// Returns true if a file of the given size and duration is full.
    pub fn is_full(&self, bytes: u64, duration_ns: u64) -> bool {
        self.bytes.is_some_and(|most| bytes >= most)
            || self.duration_ns.is_some_and(|longest| duration_ns >= longest)
    }
}

/// The description of a run. The supervisor writes it to `run.json` in the folder of the system, and every
/// process reads it from there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunConfig {
    /// Name of the system.
    pub system: String,
    /// The mission. Its paths are absolute, or names inside the recording `files_of`.
    pub mission: Mission,
    /// The navigator's method, resolved at launch. It is never empty in a running system, but it is in runs within one process and
    /// in some recordings of earlier versions.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub method: String,
    /// The recording that contains the files of the mission, or `None` if they are on disk. Only the
    /// processes of a running system use this, and it has no meaning in a recording.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub files_of: Option<String>,
    /// The robot that the mission names.
    pub robot: Robot,
    /// The mission's seed.
    pub seed: u64,
    /// How simulated time passes during the run.
    pub pace: Pace,
    /// Path of the recording, or `None` if nothing is recorded.
    pub recording: Option<String>,
    /// The limits at which the recording is continued in a new file.
    #[serde(default, skip_serializing_if = "Split::is_never")]
    pub split: Split,
    /// Whether people take part through the pad's page.
    #[serde(default, skip_serializing_if = "Pad::is_absent")]
    pub pad: Pad,
    /// The services that the supervisor does not start, because they are started by hand or because a robot's
    /// driver replaces the world.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub without: Vec<Process>,
    /// Planned faults of the run's messages and processes. Each of them happens once.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<PlannedFault>,
}

impl RunConfig {
    /// Creates a run in lockstep without a recording. Used for tests and for runs within one process.
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

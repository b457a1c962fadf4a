//! What the judge needs of a recording, read in one pass over the channels that hold it.

use std::collections::BTreeMap;

use sketchnav_schemas::channels::{CONTACT, Channel, ESTIMATE, HEALTH, SKETCH, STATUS, TRUTH};
use sketchnav_schemas::geometry::{Pose, Sketch, World};
use sketchnav_schemas::message::{Contact, GroundTruth, Health, MissionStatus, PoseEstimate, SketchMap};
use sketchnav_schemas::ros2::Ros2;

use crate::error::RecordingError;
use crate::reader::Recording;

/// An estimate beside the truth of its instant.
#[derive(Debug, Clone, Copy)]
pub struct Instant {
    /// Simulation time, nanoseconds.
    pub stamp_ns: u64,
    /// Where the robot truly was.
    pub truth: Pose<World>,
    /// Where it believed to be.
    pub estimate: Pose<Sketch>,
    /// The local scales, pixels a metre: along the walls and across.
    pub scales_pxpm: [f64; 2],
    /// Kish's effective sample size.
    pub effective_sample_size: f64,
    /// How well the scan fitted.
    pub fit: f64,
    /// A [`sketchnav_schemas::codes::Tracking`].
    pub tracking: u32,
}

/// The drawing's facts.
#[derive(Debug, Clone, Copy)]
pub struct SketchFacts {
    /// Width.
    pub width_px: u32,
    /// Height.
    pub height_px: u32,
    /// Direction of the walls.
    pub wall_direction_rad: f64,
}

/// What the judge needs of a recording.
#[derive(Debug, Clone, Default)]
pub struct Log {
    /// The channel `truth`.
    pub truth: Vec<GroundTruth>,
    /// The channel `status`.
    pub status: Vec<MissionStatus>,
    /// The channel `contact`.
    pub contacts: Vec<Contact>,
    /// The channel `health`.
    pub health: Vec<Health>,
    /// Each estimate that has a truth of its instant.
    pub instants: Vec<Instant>,
    /// How many estimates there are.
    pub estimates: usize,
    /// The drawing.
    pub sketch: Option<SketchFacts>,
}

impl Log {
    /// Reads it.
    ///
    /// # Errors
    /// [`RecordingError`].
    pub fn read(recording: &Recording) -> Result<Self, RecordingError> {
        let truth: Vec<GroundTruth> = all(recording, TRUTH)?;
        let places: BTreeMap<u64, Pose<World>> =
            truth.iter().map(|m| (m.header.stamp_ns, m.pose())).collect();
        let (mut instants, mut estimates) = (Vec::new(), 0);
        for estimate in recording.channel(ESTIMATE)? {
            let (estimate, _) = estimate?;
            estimates += 1;
            instants.extend(places.get(&estimate.header.stamp_ns).map(|truth| instant(*truth, &estimate)));
        }
        let sketch = recording.channel(SKETCH)?.next().transpose()?;
        Ok(Self {
            truth,
            status: all(recording, STATUS)?,
            contacts: all(recording, CONTACT)?,
            health: all(recording, HEALTH)?,
            instants,
            estimates,
            sketch: sketch.map(|(map, _)| facts(&map)),
        })
    }
}

fn instant(truth: Pose<World>, estimate: &PoseEstimate) -> Instant {
    Instant {
        stamp_ns: estimate.header.stamp_ns,
        truth,
        estimate: estimate.pose.pose(),
        scales_pxpm: [estimate.scale_a_pxpm, estimate.scale_b_pxpm],
        effective_sample_size: estimate.effective_sample_size,
        fit: estimate.fit,
        tracking: estimate.tracking,
    }
}

fn facts(map: &SketchMap) -> SketchFacts {
    let SketchMap { width_px, height_px, wall_direction_rad, .. } = *map;
    SketchFacts { width_px, height_px, wall_direction_rad }
}

fn all<T: Ros2>(recording: &Recording, channel: Channel<T>) -> Result<Vec<T>, RecordingError> {
    recording.channel(channel)?.map(|message| Ok(message?.0)).collect()
}

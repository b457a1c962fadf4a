//! The latest readings of a simulation, one for each channel.

#![allow(dead_code)] // each test uses a part

use std::any::Any;
use std::convert::Infallible;

use sketchnav_schemas::channels::Channel;
use sketchnav_schemas::message::{
    Contact, DotView, GroundTruth, Header, LaserScan, MarkerView, Odometry, People, SonarScan, Twist,
    VelocityCommand,
};
use sketchnav_schemas::ros2::Ros2;
use sketchnav_sim::{Senses, Simulation};

/// The latest readings, and a log of all readings.
pub struct Readings {
    pub scan: Box<LaserScan>,
    pub sonar: SonarScan,
    pub odometry: Odometry,
    pub truth: GroundTruth,
    pub contact: Contact,
    pub people: People,
    pub markers: MarkerView,
    pub view: Box<DotView>,
    /// Channel name and timestamp of each reading, in order.
    pub log: Vec<(&'static str, u64)>,
    /// Bytes of all readings except the numbers in their headers, if they are kept.
    pub bytes: Option<Vec<u8>>,
    pub contacts: Vec<Contact>,
}

impl Readings {
    /// Returns the current readings of a simulation.
    pub fn of(simulation: &impl Simulation) -> Self {
        let mut readings = Self::new();
        readings.take(simulation);
        readings
    }

    /// Reserves memory for all readings that a test takes, so that taking them does not allocate.
    pub fn new() -> Self {
        Self {
            scan: bytemuck::zeroed_box(),
            sonar: bytemuck::Zeroable::zeroed(),
            odometry: bytemuck::Zeroable::zeroed(),
            truth: bytemuck::Zeroable::zeroed(),
            contact: bytemuck::Zeroable::zeroed(),
            people: bytemuck::Zeroable::zeroed(),
            markers: bytemuck::Zeroable::zeroed(),
            view: bytemuck::zeroed_box(),
            log: Vec::with_capacity(100_000),
            bytes: None,
            contacts: Vec::with_capacity(1000),
        }
    }

    /// Like [`Readings::new`], but keeps the bytes of all readings.
    pub fn with_bytes() -> Self {
        Self { bytes: Some(Vec::new()), ..Self::new() }
    }

    /// Takes the current readings of a simulation.
    pub fn take(&mut self, simulation: &impl Simulation) {
        let Ok(()) = simulation.sense(self);
    }

    /// Returns the timestamps of all readings of a channel so far.
    pub fn stamps(&self, channel: &str) -> Vec<u64> {
        self.log.iter().filter(|(name, _)| *name == channel).map(|(_, stamp_ns)| *stamp_ns).collect()
    }
}

impl Senses for Readings {
    type Error = Infallible;

    fn reading<T: Ros2>(
        &mut self,
        channel: Channel<T>,
        stamp_ns: u64,
        fill: impl FnOnce(&mut T),
    ) -> Result<(), Infallible> {
        self.log.push((channel.spec.name, stamp_ns));
        let Self { scan, sonar, odometry, truth, contact, people, markers, view, .. } = self;
        let places: [&mut dyn Any; 8] =
            [&mut **scan, sonar, odometry, truth, contact, people, markers, &mut **view];
        let place = places.into_iter().find_map(|place| place.downcast_mut::<T>());
        let place = place.expect("an entry for every message");
        fill(place);
        if let Some(bytes) = &mut self.bytes {
            bytes.extend(bytemuck::bytes_of(place));
        }
        if channel.spec.name == "contact" {
            self.contacts.push(self.contact);
        }
        Ok(())
    }
}

/// Returns a command stamped with the present instant.
pub fn command(
    simulation: &impl Simulation,
    vx_mps: f64,
    vy_mps: f64,
    yaw_rate_radps: f64,
) -> VelocityCommand {
    let seq = simulation.steps() + 1;
    let header = Header { seq, stamp_ns: simulation.stamp_ns(), source_seq: seq };
    VelocityCommand { header, twist: Twist { vx_mps, vy_mps, yaw_rate_radps }, last: 0, reserved: 0 }
}

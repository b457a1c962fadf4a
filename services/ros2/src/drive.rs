//! Drives a ROS 2 robot in place of the simulated world. Its scans (`/scan`) and odometry (`/odom`) become
//! the sensors' channels and the tick, and commands become velocities (`/cmd_vel`).
//!
//! Each scan ends an instant. The robot is stopped at the end, and whenever no command has arrived for half a
//! second.

use std::time::{Duration, Instant};

use serde::de::DeserializeOwned;
use sketchnav_driver::{Driver, DriverError, STANDSTILL};
use sketchnav_schemas::channels::{ODOMETRY, SCAN};
use sketchnav_schemas::message::{LaserScan, Odometry, Twist};
use sketchnav_schemas::ros2::{Field, encode};

use crate::participant::{Intake, Outlet, Participant};
use crate::readings::{self, OdometryForm, Publishers, ReadingError, ScanForm, Timebase};
use crate::topics::Delivery;
use crate::{BridgeError, RobotTopics, Settings, Summary};

/// Interval at which to look for messages, since ROS 2 messages wake no process.
const LOOK_EVERY: Duration = Duration::from_millis(2);
/// Maximum time for sending the last message.
const FAREWELL: Duration = Duration::from_millis(100);
/// If no readings have arrived for this long after the start, that is reported.
const SILENCE: Duration = Duration::from_secs(3);

/// Drives the robot until its mission is over, the system has ended, or the process is asked to end.
///
/// # Errors
/// [`BridgeError`] if the domain or a channel cannot be opened, or messages can no longer be sent.
pub fn drive(driver: Driver, settings: &Settings, topics: &RobotTopics) -> Result<Summary, BridgeError> {
    let mut robot = Robot::open(driver, settings, topics)?;
    loop {
        robot.sense()?;
        let Some(twist) = robot.driver.command(Duration::ZERO)? else { break };
        robot.move_at(twist)?;
        robot.driver.idle(LOOK_EVERY)?;
    }
    robot.end()
}

struct Robot {
    driver: Driver,
    scans: Sensor<ScanForm>,
    odometry: Sensor<OdometryForm>,
    wheels: Outlet,
    time: Timebase,
    began: Instant,
    /// True once silent sensors have been reported.
    has_looked: bool,
    has_odometry: bool,
    /// The last velocity that was sent, and the tick that it responds to.
    sent: (Twist, u64),
    refused: u64,
    /// Nothing more is received once this is dropped.
    participant: Participant,
}

/// A topic of the robot's readings.
struct Sensor<F> {
    intake: Intake<F>,
    kind: &'static str,
    /// The option that selects another topic.
    option: &'static str,
    publishers: Publishers,
    is_silent: bool,
}

impl<F: DeserializeOwned + 'static> Sensor<F> {
    fn open(
        participant: &mut Participant,
        topic: &str,
        kind: &'static str,
        option: &'static str,
    ) -> Result<Self, BridgeError> {
        let intake = participant.subscription(topic, kind, Delivery::Sensor)?;
        Ok(Self { intake, kind, option, publishers: Publishers::default(), is_silent: true })
    }

    /// Takes the next reading, and reports a second publisher, whose readings would be mixed with those of the first.
    fn take(&mut self) -> Option<F> {
        let (form, publisher) = self.intake.take_with_publisher()?;
        self.is_silent = false;
        if self.publishers.is_second(publisher) {
            let (topic, option) = (self.intake.name(), self.option);
            sketchnav_schemas::say!(
                "notice: {topic} has a second publisher; if it belongs to another robot, choose one of them by --domain, \
                 --namespace or {option}"
            );
        }
        Some(form)
    }

    /// Reports the sensor if none of its readings has arrived so far.
    fn report_silence(&self, participant: &Participant) -> Result<(), BridgeError> {
        if self.is_silent {
            let known = participant.topics_of(self.kind)?;
            let words = readings::silent(self.intake.name(), self.kind, self.option, &known);
            sketchnav_schemas::say!("notice: {words}");
        }
        Ok(())
    }
}

impl Robot {
    fn open(driver: Driver, settings: &Settings, topics: &RobotTopics) -> Result<Self, BridgeError> {
        let mut participant = Participant::join(settings, &driver.run().system)?;
        let RobotTopics { scan, odom, cmd_vel } = topics;
        let scans = Sensor::open(&mut participant, scan, "sensor_msgs/msg/LaserScan", "--scan")?;
        let odometry = Sensor::open(&mut participant, odom, "nav_msgs/msg/Odometry", "--odom")?;
        let wheels =
            participant.publisher(cmd_vel, "geometry_msgs/msg/Twist", Delivery::Reliable { depth: 1 })?;
        Ok(Self {
            time: Timebase::at(driver.now_ns()),
            driver,
            scans,
            odometry,
            wheels,
            has_odometry: false,
            sent: (STANDSTILL, 0),
            refused: 0,
            began: Instant::now(),
            has_looked: false,
            participant,
        })
    }

    /// Passes on the robot's readings.
    fn sense(&mut self) -> Result<(), BridgeError> {
        let now = self.began.elapsed();
        while let Some(form) = self.odometry.take() {
            let stamp_ns = self.time.of(&form.header.stamp, now);
            let reading = stamp_ns.and_then(|stamp_ns| readings::odometry(form, stamp_ns));
            let sent = reading.and_then(|odometry| self.on_odometry(odometry));
            self.passed_on("odometry", sent)?;
        }
        while let Some(form) = self.scans.take() {
            let stamp_ns = self.time.of(&form.header.stamp, now);
            let reading = stamp_ns.and_then(|stamp_ns| readings::scan(form, stamp_ns));
            let sent = reading.and_then(|scan| self.on_scan(&scan));
            self.passed_on("scan", sent)?;
        }
        if now >= SILENCE && !std::mem::replace(&mut self.has_looked, true) {
            self.scans.report_silence(&self.participant)?;
            self.odometry.report_silence(&self.participant)?;
        }
        Ok(())
    }

    fn on_odometry(&mut self, odometry: Odometry) -> Result<(), ReadingError> {
        self.driver.send(ODOMETRY, odometry.header.stamp_ns, |message| *message = odometry)?;
        self.has_odometry = true;
        Ok(())
    }

    /// Passes on a scan, which ends an instant. A scan that arrives before the first odometry reading is left out, because
    /// its position is unknown.
    fn on_scan(&mut self, scan: &LaserScan) -> Result<(), ReadingError> {
        if self.has_odometry {
            self.driver.send(SCAN, scan.header.stamp_ns, |message| *message = *scan)?;
            self.driver.tick(scan.header.stamp_ns)?;
        }
        Ok(())
    }

    /// Counts a reading that must not be passed on, and prints every hundredth of them, beginning with the first, to
    /// standard error.
    fn passed_on(&mut self, reading: &str, sent: Result<(), ReadingError>) -> Result<(), BridgeError> {
        let error = match sent {
            // After the end of the mission, the loop ends with the next command.
            Ok(()) | Err(ReadingError::Driver(DriverError::Over { .. })) => return Ok(()),
            Err(ReadingError::Driver(DriverError::Runtime(error))) => return Err(error.into()),
            Err(error) => error,
        };
        if self.refused.is_multiple_of(100) {
            sketchnav_schemas::say!("{reading}: left out ({} so far): {error}", self.refused + 1);
        }
        self.refused += 1;
        self.driver.count_refused();
        Ok(())
    }

    /// Passes on each command, and stops the robot if the latest one is too old.
    fn move_at(&mut self, twist: Twist) -> Result<(), BridgeError> {
        let command = (twist, self.driver.answered());
        if command != self.sent { self.send(command) } else { Ok(()) }
    }

    fn send(&mut self, command: (Twist, u64)) -> Result<(), BridgeError> {
        self.sent = command;
        let mut cdr = Vec::new();
        encode(&command.0.to_form_in("twist", Default::default())?, &mut cdr)?;
        self.wheels.publish(cdr)
    }

    fn end(mut self) -> Result<Summary, BridgeError> {
        self.send((STANDSTILL, 0))?;
        // The last command is sent by another thread, which cannot report when it has been sent.
        std::thread::sleep(FAREWELL);
        let (sent, unsent) = self.wheels.counts();
        Ok(Summary { sent, unsent, lost: self.driver.lost() })
    }
}

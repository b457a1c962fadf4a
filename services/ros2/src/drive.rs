//! Drives a ROS 2 robot in place of the simulated world: `/scan` and `/odom` become the sensors' channels and the tick, and
//! commands become `/cmd_vel`.
//!
//! An instant ends with each scan. The robot is stopped if no command has arrived for half a second, and at the end.

use std::time::Duration;

use sketchnav_driver::{Driver, DriverError, STANDSTILL};
use sketchnav_schemas::channels::{ODOMETRY, SCAN};
use sketchnav_schemas::message::{LaserScan, Odometry, Twist};
use sketchnav_schemas::ros2::{Field, encode};

use crate::participant::{Intake, Outlet, Participant};
use crate::readings::{self, OdometryForm, ReadingError, ScanForm, Timebase};
use crate::topics::Delivery;
use crate::{BridgeError, Settings, Summary};

/// How often to look for messages, since ROS 2 messages wake no process.
const LOOK_EVERY: Duration = Duration::from_millis(2);
/// Maximum time for sending the last message.
const FAREWELL: Duration = Duration::from_millis(100);

/// Drives the robot until its mission is over, the system is gone, or the process is asked to end.
///
/// # Errors
/// [`BridgeError`] if the domain or a channel cannot be opened, or sending is no longer possible.
pub fn drive(driver: Driver, settings: &Settings) -> Result<Summary, BridgeError> {
    let mut robot = Robot::open(driver, settings)?;
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
    scans: Intake<ScanForm>,
    odometry: Intake<OdometryForm>,
    wheels: Outlet,
    time: Timebase,
    has_odometry: bool,
    /// The last velocity that was sent, and the tick whose answer it is.
    sent: (Twist, u64),
    refused: u64,
    /// Once this is dropped, nothing is received any more.
    _participant: Participant,
}

impl Robot {
    fn open(driver: Driver, settings: &Settings) -> Result<Self, BridgeError> {
        let mut participant = Participant::join(settings, &driver.run().system)?;
        let sensor = Delivery::Sensor;
        let scans = participant.subscription("scan", "sensor_msgs/msg/LaserScan", sensor)?;
        let odometry = participant.subscription("odom", "nav_msgs/msg/Odometry", sensor)?;
        let wheels =
            participant.publisher("cmd_vel", "geometry_msgs/msg/Twist", Delivery::Reliable { depth: 1 })?;
        Ok(Self {
            time: Timebase::at(driver.now_ns()),
            driver,
            scans,
            odometry,
            wheels,
            has_odometry: false,
            sent: (STANDSTILL, 0),
            refused: 0,
            _participant: participant,
        })
    }

    /// Passes on the robot's readings.
    fn sense(&mut self) -> Result<(), BridgeError> {
        while let Some(form) = self.odometry.take() {
            let stamp_ns = self.time.of(&form.header.stamp);
            let sent = readings::odometry(form, stamp_ns).and_then(|odometry| self.on_odometry(odometry));
            self.passed_on("odom", sent)?;
        }
        while let Some(form) = self.scans.take() {
            let stamp_ns = self.time.of(&form.header.stamp);
            let sent = readings::scan(form, stamp_ns).and_then(|scan| self.on_scan(&scan));
            self.passed_on("scan", sent)?;
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
    fn passed_on(&mut self, topic: &str, sent: Result<(), ReadingError>) -> Result<(), BridgeError> {
        let error = match sent {
            // After the end, the loop ends with the next command.
            Ok(()) | Err(ReadingError::Driver(DriverError::Over { .. })) => return Ok(()),
            Err(ReadingError::Driver(DriverError::Runtime(error))) => return Err(error.into()),
            Err(error) => error,
        };
        if self.refused.is_multiple_of(100) {
            sketchnav_schemas::say!("/{topic}: left out ({} so far): {error}", self.refused + 1);
        }
        self.refused += 1;
        self.driver.count_refused();
        Ok(())
    }

    /// Passes on each command, and stops the robot if the newest one is too old.
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

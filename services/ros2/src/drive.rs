//! Drives a ROS 2 robot in place of the simulated world: `/scan` and `/odom` become the sensors' channels and the tick, and
//! commands become `/cmd_vel`.
//!
//! An instant ends with each scan. The robot is stopped if no command has arrived for half a second, and at the end.

use std::time::{Duration, Instant};

use sketchnav_runtime::{HealthReporter, Node, Reader, Step, System, Wake, Writer};
use sketchnav_schemas::channels::{COMMAND, ODOMETRY, SCAN, TICK};
use sketchnav_schemas::message::{Header, LaserScan, Odometry, Tick, Twist, VelocityCommand};
use sketchnav_schemas::ros2::{Field, encode};
use sketchnav_schemas::run::RunConfig;

use crate::participant::{Intake, Outlet, Participant};
use crate::readings::{self, OdometryForm, ReadingError, ScanForm, Thinning, Timebase};
use crate::topics::Delivery;
use crate::{BridgeError, Settings, Summary};

/// How often to look for messages, since ROS 2 messages wake no process.
const LOOK_EVERY: Duration = Duration::from_millis(2);
/// How often to check whether the system still runs.
const SECOND: Duration = Duration::from_secs(1);
/// How long the robot moves without a new command before it is stopped.
const COMMAND_LIMIT: Duration = Duration::from_millis(500);
/// Maximum time for sending the last message.
const FAREWELL: Duration = Duration::from_millis(100);
const STANDSTILL: Twist = Twist { vx_mps: 0.0, vy_mps: 0.0, yaw_rate_radps: 0.0 };

/// Drives the robot until its mission is over, the system is gone, or the process is asked to end.
///
/// # Errors
/// [`BridgeError`] if the domain or a channel cannot be opened, or sending is no longer possible.
pub fn drive(node: &Node, run: &RunConfig, settings: &Settings) -> Result<Summary, BridgeError> {
    let mut driver = Driver::open(node, run, settings)?;
    let mut looked = Instant::now();
    loop {
        let step = Step::begin();
        driver.sense()?;
        let is_over = driver.command()?;
        driver.health.end(step);
        driver.health.report_if_due(driver.stamp_ns)?;
        if looked.elapsed() >= SECOND {
            looked = Instant::now();
            if System::open(node.system().name()).is_err() {
                break;
            }
        }
        if is_over || node.wait(LOOK_EVERY) == Wake::Terminate {
            break;
        }
    }
    driver.end()
}

struct Driver<'a> {
    node: &'a Node,
    scans: Intake<ScanForm>,
    odometry: Intake<OdometryForm>,
    wheels: Outlet,
    scan: Writer<LaserScan>,
    reading: Writer<Odometry>,
    tick: Writer<Tick>,
    commands: Reader<VelocityCommand>,
    health: HealthReporter,
    time: Timebase,
    thinning: Thinning,
    /// The newest odometry reading, if it has not been sent yet.
    held: Option<Odometry>,
    has_odometry: bool,
    /// The last tick of an earlier driver. Commands that answer it or older ticks are ignored.
    ticks_before: u64,
    stamp_ns: u64,
    commanded: Instant,
    is_moving: bool,
    refused: u64,
    /// Once this is dropped, nothing is received any more.
    _participant: Participant,
}

impl<'a> Driver<'a> {
    fn open(node: &'a Node, run: &RunConfig, settings: &Settings) -> Result<Self, BridgeError> {
        let mut participant = Participant::join(settings, &run.system)?;
        let sensor = Delivery::Sensor;
        let scans = participant.subscription("scan", "sensor_msgs/msg/LaserScan", sensor)?;
        let odometry = participant.subscription("odom", "nav_msgs/msg/Odometry", sensor)?;
        let wheels =
            participant.publisher("cmd_vel", "geometry_msgs/msg/Twist", Delivery::Reliable { depth: 1 })?;
        let (mut scan, mut reading, mut tick) =
            (node.writer(SCAN)?, node.writer(ODOMETRY)?, node.writer(TICK)?);
        // If an earlier driver has died, its sequence numbers and its clock are continued.
        scan.resume_after_history();
        reading.resume_after_history();
        tick.resume_after_history();
        let begin_ns = tick.last_sent().map_or(0, |tick| tick.header.stamp_ns + 1);
        let period_ns = (1e9 / run.robot.tick_hz()) as u64;
        Ok(Self {
            node,
            scans,
            odometry,
            wheels,
            scan,
            reading,
            commands: node.reader(COMMAND)?,
            health: HealthReporter::new(node)?,
            time: Timebase::at(begin_ns),
            thinning: Thinning::new(period_ns, ODOMETRY.spec.per_tick),
            held: None,
            has_odometry: false,
            ticks_before: tick.last_seq(),
            tick,
            stamp_ns: begin_ns,
            commanded: Instant::now(),
            is_moving: false,
            refused: 0,
            _participant: participant,
        })
    }

    /// Passes on the robot's readings.
    fn sense(&mut self) -> Result<(), BridgeError> {
        while let Some(form) = self.odometry.take() {
            let stamp_ns = self.time.of(&form.header.stamp);
            match readings::odometry(form, stamp_ns) {
                Ok(odometry) => self.on_odometry(odometry)?,
                Err(error) => self.refuse("odom", &error),
            }
        }
        while let Some(form) = self.scans.take() {
            let stamp_ns = self.time.of(&form.header.stamp);
            match readings::scan(form, stamp_ns) {
                Ok(scan) if self.tick.last_seq() > self.ticks_before && stamp_ns <= self.stamp_ns => {
                    let (found_ns, before_ns) = (scan.header.stamp_ns, self.stamp_ns);
                    self.refuse("scan", &ReadingError::Stamp { found_ns, before_ns });
                }
                Ok(scan) => self.on_scan(&scan)?,
                Err(error) => self.refuse("scan", &error),
            }
        }
        Ok(())
    }

    fn on_odometry(&mut self, odometry: Odometry) -> Result<(), BridgeError> {
        self.has_odometry = true;
        if self.thinning.takes(odometry.header.stamp_ns) {
            self.held = None;
            self.reading.send(|message| *message = odometry)?;
        } else {
            self.held = Some(odometry);
        }
        Ok(())
    }

    /// Passes on a scan, which ends an instant. A scan that arrives before the first odometry reading is left out, because
    /// its position is unknown.
    fn on_scan(&mut self, scan: &LaserScan) -> Result<(), BridgeError> {
        if !self.has_odometry {
            return Ok(());
        }
        if let Some(odometry) = self.held.take() {
            self.reading.send(|message| *message = odometry)?;
        }
        self.scan.send(|message| *message = *scan)?;
        self.stamp_ns = scan.header.stamp_ns;
        let (node, number) = (self.node, self.tick.last_seq() + 1);
        self.tick.send(|tick| {
            tick.header = Header { seq: 0, stamp_ns: scan.header.stamp_ns, source_seq: number };
            node.name_readings(tick);
        })?;
        self.thinning.ticked();
        Ok(())
    }

    /// Counts a reading that must not be passed on, and prints every hundredth of them, beginning with the first, to
    /// standard error.
    fn refuse(&mut self, topic: &str, error: &ReadingError) {
        if self.refused.is_multiple_of(100) {
            sketchnav_schemas::say!("/{topic}: left out ({} so far): {error}", self.refused + 1);
        }
        self.refused += 1;
        self.node.count_refused();
    }

    /// Passes commands on. Returns true if the last one was among them.
    fn command(&mut self) -> Result<bool, BridgeError> {
        let mut newest = None;
        while let Some(command) = self.commands.receive_valid()? {
            if command.header.source_seq > self.ticks_before {
                newest = Some(*command);
            }
        }
        if let Some(command) = newest {
            self.commanded = Instant::now();
            self.send(command.twist)?;
            return Ok(command.last == 1);
        }
        if self.is_moving && self.commanded.elapsed() > COMMAND_LIMIT {
            self.send(STANDSTILL)?;
        }
        Ok(false)
    }

    fn send(&mut self, twist: Twist) -> Result<(), BridgeError> {
        self.is_moving = twist != STANDSTILL;
        let mut cdr = Vec::new();
        encode(&twist.to_form_in("twist", Default::default())?, &mut cdr)?;
        self.wheels.publish(cdr)
    }

    fn end(mut self) -> Result<Summary, BridgeError> {
        self.send(STANDSTILL)?;
        // The last command is sent by another thread, which cannot report when it has been sent.
        std::thread::sleep(FAREWELL);
        self.health.report(self.stamp_ns)?;
        let (sent, unsent) = self.wheels.counts();
        Ok(Summary { sent, unsent, lost: self.commands.lost() })
    }
}

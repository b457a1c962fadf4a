//! A driver: a robot, or a third-party simulator, in place of the simulated world.

use std::time::{Duration, Instant};

use sketchnav_runtime::{HealthReporter, Node, Pacer, Reader, Step, System, Wake, Writer};
use sketchnav_schemas::channels::{self, Channel, ChannelSpec, LOCKSTEP_WINDOW, ODOMETRY, RECORDED, TICK};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::geometry::{Odom, Pose};
use sketchnav_schemas::message::{Header, Message, Odometry, PoseM, Recorded, Tick, Twist};
use sketchnav_schemas::run::{Pace, RunConfig};
use sketchnav_schemas::say;
use sketchnav_schemas::time::{NS_PER_S, nanoseconds};

use crate::error::DriverError;
use crate::orders::Orders;
use crate::outlet::Outlet;

/// Maximum time between two checks for new messages.
const LOOK_UP: Duration = Duration::from_millis(20);
/// Time between two checks whether the system still runs.
const SECOND: Duration = Duration::from_secs(1);
/// Maximum time that a simulator waits for the first command.
const PATIENCE: Duration = Duration::from_secs(10);

/// The clock that determines the mission time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clock {
    /// Time passes by itself.
    Robot,
    /// Time passes in the simulator, by one tick period per tick. In lockstep, it advances as fast as the
    /// navigators respond. In real time, the driver waits for the wall clock.
    Simulator,
}

/// A robot that takes the place of a system's simulated world.
pub struct Driver {
    run: RunConfig,
    clock: Clock,
    period_ns: u64,
    outlets: Vec<Outlet>,
    ticks: Writer<Tick>,
    orders: Orders,
    recorded: Reader<Recorded>,
    /// The latest tick that has been safely written to a file, or a number above any tick if nothing is
    /// recorded.
    recorded_tick: u64,
    health: HealthReporter,
    step: Step,
    /// Start of the driver, and the mission time at its start.
    began: (Instant, u64),
    /// Stamp of the last tick.
    tick_ns: Option<u64>,
    /// Paces a simulator in real time, starting with the first response.
    pacer: Option<Pacer>,
    /// The last pose of an earlier driver until the first odometry reading arrives, and from then on the
    /// transform from that reading to the pose.
    joint: Joint,
    looked: Instant,
    is_over: bool,
    is_late: bool,
    node: Node,
}

/// The link between a robot's odometry and that of an earlier driver.
enum Joint {
    /// There was no earlier driver.
    None,
    /// The last pose sent by an earlier driver.
    Before(Pose<Odom>),
    /// The last pose sent by an earlier driver, and the first one of this driver.
    At(Pose<Odom>, Pose<Odom>),
}

impl Joint {
    fn apply(&mut self, pose: &Pose<Odom>) -> Pose<Odom> {
        if let Self::Before(last) = self {
            *self = Self::At(*last, *pose);
        }
        match self {
            Self::At(last, first) => last.compose(&first.motion_to(pose)),
            _ => *pose,
        }
    }
}

impl Driver {
    /// Joins a system as its world. If an earlier driver has died, its message numbers, time and odometry are
    /// continued.
    ///
    /// # Errors
    /// [`DriverError`] if the system is not running, has a world of its own or another driver, or runs in
    /// lockstep with a driver whose time passes by itself.
    pub fn join(system: &str, clock: Clock) -> Result<Self, DriverError> {
        let opened = System::open(system)?;
        let run = opened.run_config()?;
        if !run.without.contains(&Process::World) {
            return Err(DriverError::HasWorld { system: run.system });
        }
        if run.pace == Pace::Lockstep && clock == Clock::Robot {
            return Err(DriverError::Lockstep { system: run.system });
        }
        let node = Node::join(opened, Process::World)?;
        let period_ns = nanoseconds(1.0 / run.robot.tick_hz());
        let kind = run.mission.navigator_kind();
        let specs = channels::written_by(Process::World, kind).filter(|spec| *spec != TICK.spec);
        let outlets: Vec<_> =
            specs.map(|spec| Outlet::open(&node, spec, period_ns)).collect::<Result<_, _>>()?;
        let mut ticks = node.writer(TICK)?;
        ticks.resume_after_history();
        let newest_ns = outlets.iter().filter_map(Outlet::newest_ns).max();
        let newest_ns = newest_ns.max(ticks.last_sent().map(|tick| tick.header.stamp_ns));
        // A simulator's first instant also ends only after a full period.
        let is_first = newest_ns.is_none() && clock == Clock::Robot;
        let begin_ns = if is_first { 0 } else { newest_ns.unwrap_or(0) + period_ns };
        let mut driver = Self {
            clock,
            period_ns,
            orders: Orders::open(&node, ticks.last_seq())?,
            recorded: node.reader(RECORDED)?,
            recorded_tick: if run.recording.is_some() { 0 } else { u64::MAX - LOCKSTEP_WINDOW },
            health: HealthReporter::new(&node)?,
            step: Step::begin(),
            began: (Instant::now(), begin_ns),
            tick_ns: None,
            pacer: None,
            joint: Joint::None,
            looked: Instant::now(),
            is_over: false,
            is_late: false,
            outlets,
            ticks,
            run,
            node,
        };
        if let Some(last) = driver.last_of(ODOMETRY)? {
            driver.joint = Joint::Before(last.pose());
        }
        driver.health.report(driver.began.1)?;
        Ok(driver)
    }

    /// Returns the run that the driver takes part in.
    pub fn run(&self) -> &RunConfig {
        &self.run
    }

    /// Returns the time from one tick to the next, in nanoseconds.
    pub fn period_ns(&self) -> u64 {
        self.period_ns
    }

    /// Returns the mission time, in nanoseconds, which is the timestamp for a reading taken now.
    pub fn now_ns(&self) -> u64 {
        let (began, begin_ns) = self.began;
        match (self.clock, self.tick_ns) {
            (Clock::Robot, _) => begin_ns + began.elapsed().as_nanos() as u64,
            (Clock::Simulator, tick_ns) => tick_ns.map_or(begin_ns, |tick_ns| tick_ns + self.period_ns),
        }
    }

    /// Returns the last message that an earlier driver sent on a channel, or `None` if there was none.
    ///
    /// # Errors
    /// [`DriverError::NoChannel`] if the world does not write this channel.
    pub fn last_of<T: Message>(&mut self, channel: Channel<T>) -> Result<Option<T>, DriverError> {
        let last = self.outlet(channel.spec)?.last_sent();
        Ok(last.map(|words| *bytemuck::from_bytes(bytemuck::cast_slice(&words))))
    }

    fn outlet(&mut self, spec: &'static ChannelSpec) -> Result<&mut Outlet, DriverError> {
        let known = || self.outlets.iter().map(|outlet| outlet.spec().name).collect::<Vec<_>>().join(", ");
        match self.outlets.iter().position(|outlet| outlet.spec() == spec) {
            Some(index) => Ok(&mut self.outlets[index]),
            None => Err(DriverError::NoChannel { channel: spec.name, known: known() }),
        }
    }

    /// Sends a reading taken at the given time, in nanoseconds. `fill` receives the message, which is zeroed.
    ///
    /// # Errors
    /// [`DriverError`] if the message is invalid or not later than the previous one on its channel, in which
    /// case it is not sent.
    pub fn send<T: Message>(
        &mut self,
        channel: Channel<T>,
        stamp_ns: u64,
        fill: impl FnOnce(&mut T),
    ) -> Result<(), DriverError> {
        self.send_bytes(channel.spec, stamp_ns, |message| {
            fill(bytemuck::from_bytes_mut(message));
            Ok(())
        })
    }

    /// Like [`Driver::send`], for any message type.
    ///
    /// # Errors
    /// Any error of [`Driver::send`] or `fill`.
    pub fn send_bytes<E: From<DriverError>>(
        &mut self,
        spec: &'static ChannelSpec,
        stamp_ns: u64,
        fill: impl FnOnce(&mut [u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        self.check_not_over(spec.name)?;
        let source_seq = self.ticks.last_seq() + 1;
        self.outlet(spec)?.send((stamp_ns, source_seq), fill)
    }

    /// Sends an odometry reading. Because navigators interpret every difference as a distance driven, the
    /// first reading of a restarted driver continues from the last pose of the previous driver.
    ///
    /// # Errors
    /// See [`Driver::send`].
    pub fn odometry(&mut self, stamp_ns: u64, pose: &Pose<Odom>, twist: Twist) -> Result<(), DriverError> {
        let pose = PoseM::new(&self.joint.apply(pose));
        self.send(ODOMETRY, stamp_ns, |message| {
            *message = Odometry { header: message.header, pose, twist };
        })
    }

    /// Ends an instant with a tick, which refers to the readings sent before it, and wakes the navigators.
    /// Returns the number of the tick.
    ///
    /// # Errors
    /// [`DriverError::Stamp`] if the time, in nanoseconds, is not after that of the previous tick.
    pub fn tick(&mut self, stamp_ns: u64) -> Result<u64, DriverError> {
        let name = TICK.spec.name;
        self.check_not_over(name)?;
        if let Some(before_ns) = self.tick_ns.filter(|before| stamp_ns <= *before) {
            return Err(DriverError::Stamp { channel: name, before_ns, found_ns: stamp_ns });
        }
        self.outlets.iter_mut().try_for_each(Outlet::flush)?;
        let source_seq = self.ticks.last_seq() + 1;
        let mut tick = self.ticks.loan()?;
        tick.header = Header { seq: 0, stamp_ns, source_seq };
        self.node.name_readings(&mut tick);
        tick.send()?;
        self.tick_ns = Some(stamp_ns);
        self.orders.ticked(source_seq);
        self.health.end(std::mem::replace(&mut self.step, Step::begin()));
        self.health.report_if_due(stamp_ns)?;
        Ok(source_seq)
    }

    /// Returns the velocity to drive at until the next instant, or `None` if the robot should stop permanently because the mission
    /// is over, the system has ended, or the process was asked to end.
    ///
    /// With a robot, this is the response to the last tick if it arrives within `wait`. Otherwise, it is the latest command, or a
    /// standstill if that is older than half a second. With a simulator in lockstep, it is the response to the last tick. With a
    /// simulator in real time, it is the latest command at the time when the next instant is due. Simulators ignore `wait`.
    ///
    /// # Errors
    /// Any error of the runtime.
    pub fn command(&mut self, wait: Duration) -> Result<Option<Twist>, DriverError> {
        let twist = match (self.clock, self.run.pace) {
            (Clock::Robot, _) => self.answer_within(wait)?,
            (Clock::Simulator, Pace::Lockstep) => self.answer()?,
            (Clock::Simulator, Pace::RealTime { speed }) => self.newest_when_due(speed)?,
        };
        self.is_over |= self.orders.is_last();
        self.step = Step::begin();
        Ok((!self.is_over).then_some(twist))
    }

    /// Returns the number of the tick that the latest command responds to, or 0 before the first one.
    pub fn answered(&self) -> u64 {
        self.orders.answered()
    }

    /// Sleeps until a message arrives or `timeout` has passed. This is for robots that do not wake the driver
    /// when they send a reading.
    ///
    /// # Errors
    /// Any error of the runtime.
    pub fn idle(&mut self, timeout: Duration) -> Result<(), DriverError> {
        self.wait(timeout)
    }

    /// Returns true if the robot should stop for good.
    pub fn is_over(&self) -> bool {
        self.is_over
    }

    /// Returns the number of missing commands, according to their sequence numbers.
    pub fn lost(&self) -> u64 {
        self.orders.lost()
    }

    /// Counts a reading that was rejected before it could be sent.
    pub fn count_refused(&self) {
        self.node.count_refused();
    }

    fn check_not_over(&self, channel: &'static str) -> Result<(), DriverError> {
        if self.is_over { Err(DriverError::Over { channel }) } else { Ok(()) }
    }

    fn answer_within(&mut self, wait: Duration) -> Result<Twist, DriverError> {
        let until = Instant::now() + wait;
        self.orders.receive()?;
        while self.orders.answered() < self.ticks.last_seq() && !self.is_over {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                break;
            }
            self.wait(left.min(LOOK_UP))?;
        }
        // A driver that never waits may also be asked to end.
        self.is_over |= self.node.end_requested() || self.is_gone();
        Ok(self.orders.in_force())
    }

    /// Waits for the answer to the last tick, and until the recorder is not too far behind.
    fn answer(&mut self) -> Result<Twist, DriverError> {
        let tick = self.ticks.last_seq();
        self.orders.receive()?;
        while !(self.is_over
            || self.orders.is_last()
            || self.orders.answered() >= tick && tick < self.recorded_tick + LOCKSTEP_WINDOW)
        {
            self.wait(LOOK_UP)?;
        }
        Ok(self.orders.newest())
    }

    /// Waits until the next instant is due. Time begins to pass with the first command, so that navigators that are still
    /// reading the drawing miss nothing.
    fn newest_when_due(&mut self, speed: f64) -> Result<Twist, DriverError> {
        let began = Instant::now();
        while self.pacer.is_none()
            && !self.is_over
            && self.orders.answered() == 0
            && began.elapsed() < PATIENCE
        {
            self.wait(LOOK_UP)?;
        }
        let now_ns = self.now_ns();
        let tick_ns = self.tick_ns.unwrap_or(now_ns);
        let pacer = *self.pacer.get_or_insert_with(|| Pacer::start(tick_ns, speed));
        self.orders.receive()?;
        if !self.is_late && pacer.until(now_ns + NS_PER_S).is_zero() {
            self.is_late = true;
            say!(
                "the simulator is slower than --speed {speed}; in lockstep (--speed max), the navigators wait for it"
            );
        }
        while !self.is_over && !self.orders.is_last() {
            let left = pacer.until(now_ns);
            if left.is_zero() {
                break;
            }
            self.wait(left.min(LOOK_UP))?;
        }
        self.is_over |= self.node.end_requested() || self.is_gone();
        Ok(self.orders.in_force_at(tick_ns))
    }

    /// Sleeps until a message arrives, and receives all that have arrived.
    fn wait(&mut self, timeout: Duration) -> Result<(), DriverError> {
        self.is_over |= self.node.wait(timeout) == Wake::Terminate || self.is_gone();
        self.orders.receive()?;
        while let Some(recorded) = self.recorded.receive()? {
            self.recorded_tick = recorded.header.source_seq;
        }
        self.health.report_if_due(self.tick_ns.unwrap_or(self.began.1))?;
        Ok(())
    }

    /// Returns true if the system has ended. This is checked once a second.
    fn is_gone(&mut self) -> bool {
        let is_due = self.looked.elapsed() >= SECOND;
        if is_due {
            self.looked = Instant::now();
        }
        is_due && System::open(self.node.system().name()).is_err()
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        // The system may have ended.
        let _ = self.health.report(self.tick_ns.unwrap_or(self.began.1));
    }
}

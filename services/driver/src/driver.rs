//! A robot in place of the world.

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
/// Maximum time for which a simulator waits for the first command.
const PATIENCE: Duration = Duration::from_secs(10);

/// Whose time it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clock {
    /// Time passes by itself.
    Robot,
    /// Time passes in the simulator, by one period of the ticks from one tick to the next. In a system in lockstep, as fast as
    /// the navigators answer. In real time, the driver waits for the clock.
    Simulator,
}

/// A robot in place of the world of a system.
pub struct Driver {
    run: RunConfig,
    clock: Clock,
    period_ns: u64,
    outlets: Vec<Outlet>,
    ticks: Writer<Tick>,
    orders: Orders,
    recorded: Reader<Recorded>,
    /// The latest tick that has safely been written to a file, or a number above any tick if nothing is recorded.
    recorded_tick: u64,
    health: HealthReporter,
    step: Step,
    /// When the driver began, and which time of the mission it was.
    began: (Instant, u64),
    /// Stamp of the last tick.
    tick_ns: Option<u64>,
    /// Paces a simulator in real time, from the first answer on.
    pacer: Option<Pacer>,
    /// The last pose of an earlier driver, until the first reading of the odometry, and from then on what leads from there to it.
    joint: Joint,
    looked: Instant,
    is_over: bool,
    is_late: bool,
    node: Node,
}

/// What joins a robot's odometry to that of an earlier driver.
enum Joint {
    /// There was no earlier driver.
    None,
    /// The last pose of an earlier driver.
    Before(Pose<Odom>),
    /// The last pose of an earlier driver, and the first one of this driver.
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
    /// Joins a system as its world. If an earlier driver has died, its numbers, its time and its odometry are continued.
    ///
    /// # Errors
    /// [`DriverError`] if the system is not running, has a world of its own or another driver, or is in lockstep although time
    /// passes by itself.
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
        // The first instant of a simulator ends after a period, too.
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

    /// Returns the time of the mission, in nanoseconds: the stamp of a reading that is taken now.
    pub fn now_ns(&self) -> u64 {
        let (began, begin_ns) = self.began;
        match (self.clock, self.tick_ns) {
            (Clock::Robot, _) => begin_ns + began.elapsed().as_nanos() as u64,
            (Clock::Simulator, tick_ns) => tick_ns.map_or(begin_ns, |tick_ns| tick_ns + self.period_ns),
        }
    }

    /// Returns the last message on a channel that an earlier driver sent, or `None` if there was none.
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

    /// Sends a reading that was taken at this time, in nanoseconds. `fill` gets the message, which is all zero.
    ///
    /// # Errors
    /// [`DriverError`] if the message is invalid or not later than the previous one on its channel. It is not sent then.
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

    /// Like [`Driver::send`], whatever the type of the message.
    ///
    /// # Errors
    /// Those of [`Driver::send`] and of `fill`.
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

    /// Sends a reading of the odometry. The first one of a driver that was started again continues at the last pose of the
    /// driver before it, because navigators take every difference as a distance driven.
    ///
    /// # Errors
    /// See [`Driver::send`].
    pub fn odometry(&mut self, stamp_ns: u64, pose: &Pose<Odom>, twist: Twist) -> Result<(), DriverError> {
        let pose = PoseM::new(&self.joint.apply(pose));
        self.send(ODOMETRY, stamp_ns, |message| {
            *message = Odometry { header: message.header, pose, twist };
        })
    }

    /// Ends an instant with a tick, which names the readings that were sent before it, and wakes the navigators. Returns the
    /// number of the tick.
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

    /// Returns how fast the robot is to drive until the next instant, or `None` once it is to stand still for good: the mission
    /// is over, the system is gone, or the process was asked to end.
    ///
    /// A robot gets the answer to its last tick if that arrives within `wait`; otherwise the newest command, or standstill if it
    /// is older than half a second. A simulator gets the answer to its last tick in lockstep. In real time, it gets the newest
    /// command when the next instant is due. In both cases, `wait` has no effect.
    ///
    /// # Errors
    /// Those of the runtime.
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

    /// Returns the number of the tick that the newest command answers, or 0 before the first one.
    pub fn answered(&self) -> u64 {
        self.orders.answered()
    }

    /// Sleeps until a message arrives or `timeout` has passed. For drivers whose robot wakes nobody when it sends a reading.
    ///
    /// # Errors
    /// Those of the runtime.
    pub fn idle(&mut self, timeout: Duration) -> Result<(), DriverError> {
        self.wait(timeout)
    }

    /// Returns true if the robot is to stand still for good.
    pub fn is_over(&self) -> bool {
        self.is_over
    }

    /// Returns how many commands are missing, according to their numbers.
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
        // A driver that does not wait is asked to end, too.
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

    /// Sleeps until a message arrives, and receives what there is.
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
        // The system may be gone.
        let _ = self.health.report(self.tick_ns.unwrap_or(self.began.1));
    }
}

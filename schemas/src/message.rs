//! Messages common to all navigators, with the layout that they have in shared memory.
//!
//! Every message is a plain `#[repr(C)]` struct without padding, pointers or enums, so messages are equal if and only if their
//! bytes are. Text and lists have a fixed capacity and a count, and the entries beyond the count are zero.

mod dots;
mod markers;

use bytemuck::{Pod, Zeroable};

use crate::codes::{BodyKind, DrawingKind, FaultKind, Order, Process, TaskState};
use crate::declare::{layout, messages, parts};
use crate::geometry::{Odom, Point, Pose, Sketch, World};
use crate::layout::Layout;
use crate::valid::{self, Invalid};
pub use dots::*;
pub use markers::*;

/// A message type, with its name on the channel and a description of its layout.
///
/// # Safety
/// Implemented only by `messages!`, which derives the layout from the declaration.
pub unsafe trait Message: Pod {
    /// `sketchnav/<Type>/<version>`.
    const NAME: &'static str;
    /// One `field: type` per line, in order, with the declared types.
    const LAYOUT: &'static str;

    /// Returns the memory layout of the message.
    fn layout() -> Layout;

    /// Checks the contents as described in [`crate::valid`]. If the declaration does not name a check, all contents are valid.
    ///
    /// # Errors
    /// [`Invalid`] with the first invalid field.
    fn check(&self) -> Result<(), Invalid>;
    /// Returns whether the contents are valid.
    fn is_valid(&self) -> bool {
        self.check().is_ok()
    }
    /// Returns the message's header.
    fn header(&self) -> &Header;
    /// Returns the message's header for modification.
    fn header_mut(&mut self) -> &mut Header;

    /// Returns the name, the version and a fingerprint of the layout, including nested structs. Two builds that disagree about a
    /// message can therefore not connect to each other on its channel.
    fn type_name() -> String {
        format!("{}/{:016x}", Self::NAME, fingerprint(&Self::layout().expanded()))
    }
}

/// Returns the 64-bit FNV-1a hash of `text`.
pub const fn fingerprint(text: &str) -> u64 {
    let bytes = text.as_bytes();
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut i = 0;
    while i < bytes.len() {
        hash = (hash ^ bytes[i] as u64).wrapping_mul(0x0000_0100_0000_01b3);
        i += 1;
    }
    hash
}

layout! {
    /// The fields that every message begins with.
    pub struct Header {
        /// Number of the message on its channel: 1, 2, 3 …, never reused in a mission.
        pub seq: u64,
        /// Simulation time of the content, in nanoseconds since the mission's start.
        pub stamp_ns: u64,
        /// `seq` of the tick that caused this message. A sensor's reading is its own cause.
        pub source_seq: u64,
    }
}

/// Returns z and w of the unit quaternion of a heading. Messages contain these instead of the angle, so that the ROS 2 form has the
/// same bits.
pub fn orientation(yaw_rad: f64) -> (f64, f64) {
    ((yaw_rad / 2.0).sin(), (yaw_rad / 2.0).cos())
}

layout! {
    /// A planar pose in metres.
    pub struct PoseM {
        /// First coordinate.
        pub x_m: f64,
        /// Second coordinate.
        pub y_m: f64,
        /// z of the unit quaternion of the heading.
        pub orientation_z: f64,
        /// w of the unit quaternion of the heading.
        pub orientation_w: f64,
    }
}

layout! {
    /// A planar pose in sketch pixels (frame [`Sketch`]).
    pub struct PosePx {
        /// First coordinate.
        pub x_px: f64,
        /// Second coordinate, upwards.
        pub y_px: f64,
        /// z of the unit quaternion of the heading.
        pub orientation_z: f64,
        /// w of the unit quaternion of the heading.
        pub orientation_w: f64,
    }
}

layout! {
    /// A velocity in the robot's own axes.
    pub struct Twist {
        /// Forward velocity, in m/s.
        pub vx_mps: f64,
        /// Velocity to the left, in m/s. 0 for a differential drive.
        pub vy_mps: f64,
        /// Counter-clockwise turn rate, in rad/s.
        pub yaw_rate_radps: f64,
    }
}

impl PoseM {
    /// Converts a pose in any metric frame.
    pub fn new<F>(pose: &Pose<F>) -> Self {
        let (orientation_z, orientation_w) = orientation(pose.yaw_rad);
        Self { x_m: pose.x, y_m: pose.y, orientation_z, orientation_w }
    }

    /// Returns the heading, in radians in (−π, π].
    pub fn yaw_rad(&self) -> f64 {
        crate::geometry::wrap_angle(2.0 * self.orientation_z.atan2(self.orientation_w))
    }

    /// Returns the pose, in the message's frame.
    pub fn pose<F>(&self) -> Pose<F> {
        Pose::new(self.x_m, self.y_m, self.yaw_rad())
    }
}

impl PosePx {
    /// Converts a pose in the sketch.
    pub fn new(pose: &Pose<Sketch>) -> Self {
        let (orientation_z, orientation_w) = orientation(pose.yaw_rad);
        Self { x_px: pose.x, y_px: pose.y, orientation_z, orientation_w }
    }

    /// Returns the pose in the sketch.
    pub fn pose(&self) -> Pose<Sketch> {
        let yaw = crate::geometry::wrap_angle(2.0 * self.orientation_z.atan2(self.orientation_w));
        Pose::new(self.x_px, self.y_px, yaw)
    }
}

/// Up to `N` bytes of UTF-8, zero-filled.
#[repr(transparent)]
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Text<const N: usize>(pub [u8; N]);

// SAFETY: a transparent wrapper around a byte array.
unsafe impl<const N: usize> Zeroable for Text<N> {}
// SAFETY: as above; every bit pattern is a value.
unsafe impl<const N: usize> Pod for Text<N> {}

impl<const N: usize> Text<N> {
    /// Stores `text`, truncated at a character boundary if it is longer than `N` bytes.
    pub fn new(text: &str) -> Self {
        let mut end = text.len().min(N);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        let mut bytes = [0; N];
        bytes[..end].copy_from_slice(&text.as_bytes()[..end]);
        Self(bytes)
    }

    /// Formats `words` as a text, truncated as by [`Text::new`]. Does not allocate.
    pub fn of(words: impl std::fmt::Display) -> Self {
        let mut text = Appended { bytes: [0; N], length: 0 };
        // Truncation is not an error, so writing fails only if `words` itself does.
        let _ = std::fmt::Write::write_fmt(&mut text, format_args!("{words}"));
        Self(text.bytes)
    }

    /// Returns the text up to the first zero, or up to the first byte that is not UTF-8.
    pub fn as_str(&self) -> &str {
        let end = self.0.iter().position(|&b| b == 0).unwrap_or(N);
        match std::str::from_utf8(&self.0[..end]) {
            Ok(text) => text,
            Err(error) => std::str::from_utf8(&self.0[..error.valid_up_to()]).unwrap_or_default(),
        }
    }
}

struct Appended<const N: usize> {
    bytes: [u8; N],
    length: usize,
}

impl<const N: usize> std::fmt::Write for Appended<N> {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        let mut end = text.len().min(N - self.length);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        self.bytes[self.length..self.length + end].copy_from_slice(&text.as_bytes()[..end]);
        self.length += end;
        Ok(())
    }
}

impl<const N: usize> Default for Text<N> {
    fn default() -> Self {
        Self([0; N])
    }
}

impl<const N: usize> std::fmt::Display for Text<N> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.as_str())
    }
}

impl<const N: usize> serde::Serialize for Text<N> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.as_str())
    }
}

impl<'de, const N: usize> serde::Deserialize<'de> for Text<N> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer).map(|text| Self::new(&text))
    }
}

impl<const N: usize> std::fmt::Debug for Text<N> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.as_str())
    }
}

/// Maximum number of beams in a scan: a full circle at a quarter of a degree.
pub const MAX_BEAMS: usize = 1440;
/// Maximum number of tasks in a mission.
pub const MAX_TASKS: usize = 64;
/// Maximum total number of points in the goals and drawn routes of a mission.
pub const MAX_ROUTE_POINTS: usize = 8192;
/// Maximum size of a drawing in a message, in bytes.
pub const MAX_DRAWING_BYTES: usize = 8 << 20;
/// Maximum total number of points in the strokes and obstacles of a drawing in a message.
pub const MAX_DRAWN_POINTS: usize = 1 << 18;
/// Maximum number of sensor channels that a [`Tick`] can refer to.
pub const MAX_SENSORS: usize = 16;
/// Maximum number of contacts in one step.
pub const MAX_CONTACTS: usize = 8;
/// Maximum number of sonars in a ring.
pub const MAX_SONARS: usize = 32;
/// Maximum number of people in a world.
pub const MAX_PEOPLE: usize = 100;

messages! {
    /// One sweep of a planar laser range finder (ROS 2: `sensor_msgs/LaserScan`).
    pub struct LaserScan version 1 valid if valid::scan {
        /// Direction of beam 0 in the sensor's frame, counter-clockwise from its forward axis.
        pub angle_min_rad: f32,
        /// Direction of the last beam in the sensor's frame.
        pub angle_max_rad: f32,
        /// Step from one beam to the next.
        pub angle_increment_rad: f32,
        /// Time between two beams.
        pub time_increment_s: f32,
        /// Time between two scans.
        pub scan_time_s: f32,
        /// Shortest range that the sensor measures.
        pub range_min_m: f32,
        /// Longest range that the sensor measures.
        pub range_max_m: f32,
        /// Number of entries of `ranges_m` in use.
        pub beam_count: u32 as Count,
        /// Ranges. +∞ if nothing returned, NaN if the reading is invalid (REP 117).
        pub ranges_m: [f32; 1440] where beam_count counts,
    }

    /// The heartbeat: the world has sent everything of this instant. Its `seq` is the number of the instant, to which the
    /// messages that follow from it refer by `source_seq`.
    pub struct Tick version 1 in "" valid if valid::tick {
        /// Number of the newest message of each sensor, in the order of [`crate::channels::sensors`], or 0 if there is none
        /// yet.
        pub newest: [u64; 16],
    }

    /// Dead reckoning in frame [`Odom`] (ROS 2: `nav_msgs/Odometry`).
    pub struct Odometry version 1 valid if valid::odometry {
        /// Pose by dead reckoning, which starts at the origin.
        pub pose: PoseM,
        /// Estimated velocity.
        pub twist: Twist,
    }

    /// The robot's true pose in frame [`World`] (ROS 2: `nav_msgs/Odometry`).
    /// Only for the recorder and the judge.
    pub struct GroundTruth version 1 {
        /// The true pose.
        pub pose: PoseM,
        /// The true velocity.
        pub twist: Twist,
    }

    /// The true positions of the people in the world, in frame [`World`]. Not sent if the world has no people. Only for the
    /// recorder and the judge.
    pub struct People version 1 in "world" {
        /// Number of entries of `people` in use.
        pub count: u32 as Count,
        /// Zero.
        pub reserved: u32 as Zero,
        /// The people, in the order of the world's file.
        pub people: [WalkingPerson; 100] where count counts,
    }

    /// The robot started or stopped touching something.
    pub struct Contact version 1 in "world" {
        /// Position of the contact, x and y.
        pub position_m: [f64; 2],
        /// Largest impulse of the contact so far, N·s.
        pub impulse_ns: f64,
        /// What the robot touched.
        pub body_kind: u32 as BodyKind,
        /// 1: the contact begins, 0: it ends.
        pub begins: u32,
    }

    /// The velocity that the robot is to drive, in its own axes.
    pub struct VelocityCommand version 1 in "base_link" valid if valid::command {
        /// The velocity.
        pub twist: Twist,
        /// 1: the mission is over, and the world may stop.
        pub last: u32,
        /// Zero.
        pub reserved: u32 as Zero,
    }

    /// An order from a person or a tool.
    pub struct MissionCommand version 3 in "sketch" {
        /// The kind of order.
        pub order: u32 as Order,
        /// The task that the order names, if it names one, or the largest number if `place` is the goal.
        pub task: u32,
        /// For the order `here`, the position of the robot in the sketch. For the order `goal` with a `place`, the position of
        /// that place. Zeros for all other orders.
        pub here_px: [f64; 2],
        /// For the order `here`, the heading of the robot, or 0 if `has_heading` is 0.
        pub here_yaw_rad: f64,
        /// 1: the heading is given, 0: it is not.
        pub has_heading: u32,
        /// Zero.
        pub reserved: u32 as Zero,
        /// For the order `goal`, the name of a place in the sketch that is no task's goal. Empty for all other orders.
        pub place: Text<32>,
    }

    /// The status of the mission.
    pub struct MissionStatus version 1 in "" {
        /// Index of the current task.
        pub task: u32,
        /// Number of tasks in the mission.
        pub task_count: u32,
        /// The state of the current task.
        pub state: u32 as TaskState,
        /// Number of tasks that have been reached so far.
        pub reached_count: u32,
        /// Simulation time since the task began.
        pub task_time_s: f64,
        /// Distance travelled since the task began, by odometry.
        pub task_path_m: f64,
        /// Remaining distance, by the estimated local scale.
        pub remaining_m: f64,
        /// Estimated speed.
        pub speed_mps: f64,
        /// Name of the task.
        pub name: Text<32>,
        /// Reason for the state, in words.
        pub reason: Text<96>,
    }

    /// A drawing that a person sent from the pad. The slice after it is a drawing file (strokes in JSON, PNG, JPEG), or
    /// JSON with what is marked in the drawing.
    pub struct Drawing version 1 in "" with data {
        /// What the drawing contains.
        pub kind: u32 as DrawingKind,
        /// Zero.
        pub reserved: u32 as Zero,
    }

    /// The sketcher's reply to a [`Drawing`], whose number is `source_seq`.
    pub struct Understood version 1 in "sketch" {
        /// What the drawing contains.
        pub kind: u32 as DrawingKind,
        /// 1: the drawing was accepted, 0: it was rejected and nothing changes.
        pub accepted: u32,
        /// Number of the last drawing that was sent to the navigator, or 0 before the first.
        pub sketch_seq: u64,
        /// Number of the last route that was sent to the navigator, or 0 before the first.
        pub route_seq: u64,
        /// Width of the grid that was made from the drawing.
        pub sketch_width_px: u32,
        /// Height of the grid that was made from the drawing.
        pub sketch_height_px: u32,
        /// Grid pixels per image pixel of the drawing.
        pub scale: f64,
        /// Direction of the walls in (−π/4, π/4], in radians modulo a right angle. 0 if the drawing has no
        /// straight lines, and NaN if it consists of objects, which are not walls.
        pub wall_direction_rad: f64,
        /// Why a drawing was rejected, or what is doubtful about an accepted one, in words.
        pub words: Text<256>,
    }

    /// A sign of life from a process. Measures wall-clock time, so no two runs agree on it.
    pub struct Health version 1 in "" {
        /// The process.
        pub process: u32 as Process,
        /// Process id.
        pub pid: u32,
        /// Number of steps since the process started.
        pub steps: u64,
        /// Wall-clock time spent inside steps since the process started.
        pub busy_ns: u64,
        /// Duration of the longest step since the last health message.
        pub step_max_ns: u64,
        /// Number of heap allocations inside steps since the process started.
        pub step_allocations: u64,
        /// Number of messages that are missing on the inputs of the process, according to their `seq`.
        pub lost_messages: u64,
        /// Number of messages that were refused as malformed.
        pub refused_messages: u64,
        /// Wall-clock time since the process started.
        pub uptime_ns: u64,
    }

    /// How long each stage took for the tick `source_seq`, by the clock, so no two runs agree on it.
    pub struct Latency version 2 in "" {
        /// From sending the tick to sending the situation.
        pub situation_ns: u64,
        /// From sending the situation to sending the command.
        pub command_ns: u64,
    }

    /// A process failed or recovered, at the time of the mission's last status. When and how often this happens is a matter
    /// of chance, so no two runs agree on it.
    pub struct Fault version 1 in "" {
        /// What happened.
        pub kind: u32 as FaultKind,
        /// The process concerned.
        pub process: u32 as Process,
        /// Process id, or 0 if no process is meant.
        pub pid: u32,
        /// The signal that was sent to the process or that ended it, or 0 if none.
        pub signal: u32,
        /// Exit code of the process, or 0 if a signal ended it.
        pub exit_code: u32,
        /// Number of consecutive restarts without progress, from 1, or 0 if not applicable.
        pub attempt: u32,
        /// How often the process was restarted in total.
        pub restarts: u32,
        /// Number of messages that are missing because of the fault.
        pub missing: u32,
        /// Wall-clock duration, depending on the kind: the pause before a restart, the time from a death to the first
        /// progress after it, the silence of a process, or the length of a starvation.
        pub duration_ns: u64,
        /// Details, in words.
        pub words: Text<160>,
    }

    /// The recorder has everything up to and including the tick `source_seq` in its file. In lockstep, the world never runs
    /// further ahead of the recorder than the channels can hold.
    pub struct Recorded version 1 in "" {
        /// Number of messages in the file so far.
        pub message_count: u64,
    }

    /// The nearest echoes of a ring of sonars. Each sonar sits on the ring and looks outwards.
    pub struct SonarScan version 1 in "base_link" valid if valid::sonar {
        /// Direction of sonar 0 from the robot's centre, counter-clockwise from its forward axis.
        pub angle_min_rad: f32,
        /// Step from one sonar to the next.
        pub angle_increment_rad: f32,
        /// Half the opening angle of a sonar's cone.
        pub half_opening_rad: f32,
        /// Radius of the ring, at which the ranges begin.
        pub ring_radius_m: f32,
        /// Time between two scans.
        pub scan_time_s: f32,
        /// Shortest range that the sensor measures.
        pub range_min_m: f32,
        /// Longest range that the sensor measures.
        pub range_max_m: f32,
        /// Number of entries of `ranges_m` in use.
        pub sonar_count: u32 as Count,
        /// Range of the nearest echo in each cone. +∞ if nothing returned, −∞ if the echo is too near (REP 117).
        pub ranges_m: [f32; 32] where sonar_count counts,
    }
}

parts! {
    /// One of the [`People`].
    pub struct WalkingPerson {
        /// First coordinate, in metres.
        pub x_m: f64,
        /// Second coordinate, in metres.
        pub y_m: f64,
        /// Radius of the body, in metres.
        pub radius_m: f64,
    }
}

/// Pose in the sketch, as set by a person.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Here {
    /// Position.
    pub at: Point<Sketch>,
    /// Heading in radians, if given.
    pub yaw_rad: Option<f64>,
}

/// A named place in the sketch to which a person sends the robot.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct NamedPlace {
    /// Name, truncated if it is too long.
    pub name: Text<32>,
    /// Position.
    pub at: Point<Sketch>,
}

impl MissionCommand {
    /// The `task` of an order that names a place instead of a task.
    pub const NO_TASK: u32 = u32::MAX;

    /// Returns the pose set by a person, or `None` if the order is not `here` or a number is not finite.
    pub fn here(&self) -> Option<Here> {
        let is_finite = self.here_px.iter().chain([&self.here_yaw_rad]).all(|number| number.is_finite());
        (self.order == Order::Here.code() && is_finite).then(|| Here {
            at: Point::new(self.here_px[0], self.here_px[1]),
            yaw_rad: (self.has_heading != 0).then_some(self.here_yaw_rad),
        })
    }

    /// Sets the position and, if given, the heading.
    pub fn set_here(&mut self, here: &Here) {
        self.here_px = [here.at.x, here.at.y];
        self.here_yaw_rad = here.yaw_rad.unwrap_or_default();
        self.has_heading = here.yaw_rad.is_some().into();
    }

    /// Returns the place to go to, or `None` if the order is not `goal`, names no place, or a number is not finite.
    pub fn place(&self) -> Option<NamedPlace> {
        let is_goal = self.order == Order::Goal.code() && !self.place.as_str().is_empty();
        let [x, y] = self.here_px;
        let is_finite = x.is_finite() && y.is_finite();
        (is_goal && is_finite).then(|| NamedPlace { name: self.place, at: Point::new(x, y) })
    }

    /// Sets the place to go to instead of a task.
    pub fn set_place(&mut self, place: &NamedPlace) {
        (self.task, self.place) = (Self::NO_TASK, place.name);
        self.here_px = [place.at.x, place.at.y];
    }
}

impl LaserScan {
    /// Returns the valid entries of `ranges_m`.
    pub fn ranges(&self) -> &[f32] {
        &self.ranges_m[..(self.beam_count as usize).min(MAX_BEAMS)]
    }

    /// Returns the direction of beam `i` in the sensor's frame.
    pub fn angle_rad(&self, i: usize) -> f32 {
        self.angle_min_rad + i as f32 * self.angle_increment_rad
    }
}

impl SonarScan {
    /// Returns the valid entries of `ranges_m`.
    pub fn ranges(&self) -> &[f32] {
        &self.ranges_m[..(self.sonar_count as usize).min(MAX_SONARS)]
    }

    /// Returns the direction of sonar `i` from the robot's centre.
    pub fn angle_rad(&self, i: usize) -> f32 {
        self.angle_min_rad + i as f32 * self.angle_increment_rad
    }
}

impl Odometry {
    /// Returns the dead-reckoned pose.
    pub fn pose(&self) -> Pose<Odom> {
        self.pose.pose()
    }
}

impl People {
    /// Returns the valid entries of `people`.
    pub fn people(&self) -> &[WalkingPerson] {
        &self.people[..(self.count as usize).min(MAX_PEOPLE)]
    }
}

impl GroundTruth {
    /// Returns the true pose.
    pub fn pose(&self) -> Pose<World> {
        self.pose.pose()
    }
}

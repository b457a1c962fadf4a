//! A run to record and its messages, shared by the tests.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use bytemuck::Zeroable;
use rand_pcg::Pcg64Mcg;
use sketchnav_recordings::Writer;
use sketchnav_schemas::channels::{self, Channel, ChannelSpec, ChannelVisitor};
use sketchnav_schemas::codes::{FREE, Order, Process, TaskState, Tracking, WALL};
use sketchnav_schemas::geometry::{Odom, Pose, Sketch, World};
use sketchnav_schemas::message::*;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::ros2::Ros2;
use sketchnav_schemas::run::RunConfig;
use sketchnav_schemas::samples::sample;
use sketchnav_schemas::seed::stream;
use sketchnav_sketch::messages::{PoseEstimate, Route, RouteTask, SketchMap};

const MISSION: &str = r#"
name = "two rooms"
robot = "robotino"
[world]
floor_plan = "rooms.toml"
[start]
world = [1.0, 1.0]
world_heading_deg = 0.0
[navigator]
kind = "sketch"
drawing = "rooms.png"
[[task]]
name = "0 → 1"
goal = [30.0, 10.0]
there = { center = [4.0, 1.0], radius_m = 0.5 }
[parameters.localizer]
particles = 2000
"#;

const ROBOT: &str = r#"
name = "robotino"
radius_m = 0.225
mass_kg = 11.0
drive = "omnidirectional"
limits = { speed_mps = 0.5, yaw_rate_radps = 1.0, acceleration_mps2 = 1.0, yaw_acceleration_radps2 = 2.0 }
[laser]
model = "URG-04LX"
field_of_view_deg = 240.0
beams = 41
range_min_m = 0.02
range_max_m = 5.6
rate_hz = 10.0
noise_m = 0.01
noise_per_m = 0.01
dropout = 0.01
mount_x_m = 0.1
[odometry]
alpha_speed_speed = 0.01
alpha_speed_turn = 0.01
alpha_turn_speed = 0.01
alpha_turn_turn = 0.01
drift_distance = 0.01
drift_yaw_radpm = 0.01
slips_per_m = 0.0
"#;

/// Returns an invented run of the kind `sketch`.
pub fn run_config() -> RunConfig {
    sketchnav_navigators::register(&[]).unwrap();
    let mission = Mission::parse(MISSION).unwrap();
    let method = "outline".to_owned();
    RunConfig { method, ..RunConfig::lockstep("test", mission, Robot::parse(ROBOT).unwrap(), 42) }
}

/// Creates a new file and a writer of the run to it.
pub fn create(path: &Path) -> Writer<BufWriter<File>> {
    create_run(path, &run_config())
}

/// Creates a new file and a writer of `run` to it.
pub fn create_run(path: &Path, run: &RunConfig) -> Writer<BufWriter<File>> {
    sketchnav_navigators::register(&[]).unwrap();
    Writer::create(BufWriter::new(File::create(path).unwrap()), run).unwrap()
}

/// Writes `count` random messages to a channel.
pub struct WriteSamples<'a> {
    pub writer: &'a mut Writer<BufWriter<File>>,
    /// The name of the channel to write.
    pub channel: &'static str,
    pub count: u64,
    pub random: Pcg64Mcg,
}

impl ChannelVisitor for WriteSamples<'_> {
    type Error = ();
    fn visit<T: Ros2>(&mut self, channel: Channel<T>) -> Result<(), ()> {
        let is_meant = channel.spec.name == self.channel;
        for seq in 1..=self.count * u64::from(is_meant) {
            let (message, cells) = sample::<T>(&mut self.random, seq);
            self.writer.write(channel, &message, &cells).unwrap();
        }
        Ok(())
    }
}

/// Returns the channels that are recorded in a run of this kind of navigator, in the order of an instant.
pub fn channels_of(kind: &str) -> impl Iterator<Item = &'static ChannelSpec> {
    channels::of_kind(kind).filter(|spec| spec.is_recorded())
}

/// Records `count` random messages of every type that a run of the kind `sketch` has.
pub fn record_samples(path: &Path, seed: u64, count: u64) {
    record_samples_of("sketch", path, seed, count);
}

/// Like [`record_samples`], for any kind of navigator.
pub fn record_samples_of(kind: &str, path: &Path, seed: u64, count: u64) {
    let mut run = run_config();
    run.mission.navigator.kind = kind.to_owned();
    let mut writer = create_run(path, &run);
    let random = stream(seed, "samples");
    let mut samples = WriteSamples { writer: &mut writer, channel: "", count, random };
    for spec in channels_of(kind) {
        samples.channel = spec.name;
        sketchnav_navigators::visit(&mut samples).unwrap();
    }
    writer.finish().unwrap();
}

fn header(step: u64) -> Header {
    Header { seq: step, stamp_ns: step * 100_000_000, source_seq: step }
}

fn latched() -> Header {
    Header { seq: 1, stamp_ns: 0, source_seq: 0 }
}

/// Returns the drawing of the story: a frame of walls around free space.
pub fn sketch() -> (SketchMap, Vec<u8>) {
    let (width_px, height_px) = (40, 30);
    let is_wall = |x: u32, y: u32| x == 0 || y == 0 || x == width_px - 1 || y == height_px - 1;
    let cells = (0..width_px * height_px)
        .map(|i| if is_wall(i % width_px, i / width_px) { WALL } else { FREE })
        .collect();
    let start = PosePx::new(&Pose::<Sketch>::new(10.0, 10.0, 0.0));
    let sketch =
        SketchMap { header: latched(), width_px, height_px, pen_width_px: 1.0, start, ..Zeroable::zeroed() };
    (sketch, cells)
}

fn route() -> Route {
    let mut route = Route { header: latched(), task_count: 1, point_count: 1, ..Zeroable::zeroed() };
    route.tasks[0] =
        RouteTask { name: Text::new("0 → 1"), first_point: 0, point_count: 1, time_limit_s: 180.0 };
    route.points_px[0] = [30.0, 20.0];
    route
}

/// Returns the scan of a step: a wall ahead that comes nearer, and one lost beam.
pub fn scan(step: u64) -> LaserScan {
    let mut scan = LaserScan {
        header: header(step),
        angle_min_rad: -2.0,
        angle_max_rad: 2.0,
        angle_increment_rad: 0.1,
        range_max_m: 5.6,
        beam_count: 41,
        ..Zeroable::zeroed()
    };
    let distance = 3.0 - 0.03 * step as f32;
    scan.ranges_m[..41].fill(distance);
    scan.ranges_m[7] = f32::INFINITY;
    scan
}

fn twist() -> Twist {
    Twist { vx_mps: 0.3, vy_mps: 0.0, yaw_rate_radps: 0.0 }
}

/// Writes the messages at the start of the story.
pub fn write_beginning(writer: &mut Writer<BufWriter<File>>) {
    let (map, cells) = sketch();
    writer.write(sketchnav_sketch::messages::SKETCH, &map, &cells).unwrap();
    writer.write(sketchnav_sketch::messages::ROUTE, &route(), &[]).unwrap();
    let order = MissionCommand { header: latched(), order: Order::Start.code(), ..Zeroable::zeroed() };
    writer.write(channels::MISSION, &order, &[]).unwrap();
}

/// Returns the tick that ends the world's part of a step. It names a reading of each sensor that the story has.
pub fn tick(step: u64) -> Tick {
    let mut tick = Tick { header: header(step), ..Zeroable::zeroed() };
    for (newest, sensor) in tick.newest.iter_mut().zip(channels::sensors()) {
        *newest = if *sensor == *channels::SONAR.spec { 0 } else { step };
    }
    tick
}

/// Writes all messages of a step of the story of a robot that drives along x.
pub fn write_step(writer: &mut Writer<BufWriter<File>>, step: u64) {
    let (header, x) = (header(step), 0.03 * step as f64);
    let pose = PoseM::new(&Pose::<Odom>::new(x, 0.0, 0.0));
    let truth = PoseM::new(&Pose::<World>::new(1.0 + x, 1.0, 0.0));
    writer.write(channels::TRUTH, &GroundTruth { header, pose: truth, twist: twist() }, &[]).unwrap();
    writer.write(channels::ODOMETRY, &Odometry { header, pose, twist: twist() }, &[]).unwrap();
    writer.write(channels::SCAN, &scan(step), &[]).unwrap();
    writer.write(channels::TICK, &tick(step), &[]).unwrap();
    let estimate = PoseEstimate {
        header,
        pose: PosePx::new(&Pose::new(10.0 + 6.0 * x, 10.0, 0.0)),
        scale_a_pxpm: 6.0,
        scale_b_pxpm: 6.5,
        odometry: pose,
        tracking: Tracking::Tracking.code(),
        ..Zeroable::zeroed()
    };
    writer.write(sketchnav_sketch::messages::ESTIMATE, &estimate, &[]).unwrap();
    let command = VelocityCommand { header, twist: twist(), last: 0, reserved: 0 };
    writer.write(channels::COMMAND, &command, &[]).unwrap();
    let state = TaskState::Driving.code();
    let status =
        MissionStatus { header, task_count: 1, state, name: Text::new("0 → 1"), ..Zeroable::zeroed() };
    writer.write(channels::STATUS, &status, &[]).unwrap();
    let health = Health { header, process: Process::World.code(), steps: step, ..Zeroable::zeroed() };
    writer.write(channels::HEALTH, &health, &[]).unwrap();
}

/// Records this many steps of the story.
pub fn record_story(path: &Path, steps: u64) {
    let mut writer = create(path);
    write_beginning(&mut writer);
    (1..=steps).for_each(|step| write_step(&mut writer, step));
    writer.finish().unwrap();
}

/// Returns the number of messages by topic.
pub fn counts(path: &Path) -> BTreeMap<String, u64> {
    let info = sketchnav_recordings::info::info(path).unwrap();
    info.topics.into_iter().map(|t| (t.topic, t.messages)).collect()
}

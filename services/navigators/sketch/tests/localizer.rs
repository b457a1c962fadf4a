//! Tests the localizer through its messages.

use bytemuck::Zeroable;
use sketchnav_schemas::channels::{self, Channel, ChannelSpec, ODOMETRY, ORDERS, SCAN};
use sketchnav_schemas::codes::{FREE, Order, Process, Tracking, WALL};
use sketchnav_schemas::geometry::{Point, Pose};
use sketchnav_schemas::message::{Header, Here, LaserScan, Message, MissionCommand, Odometry, PoseM, PosePx};
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sketch::localizer::{Localizer, LocalizerError};
use sketchnav_sketch::messages::{CHANNELS, ESTIMATE, PARTICLES, Particles, PoseEstimate, SKETCH, SketchMap};
use sketchnav_sketch::mission::KIND;
use sketchnav_stage::{
    Access, InProcess, Incoming, Inputs, Instant, Outbox, Reading, Remains, Stage, StageError,
};

const MISSION: &str = r#"
name = "test"
robot = "test"
[world]
floor_plan = "none.toml"
[start]
world = [0, 0]
world_heading_deg = 0
[navigator]
kind = "sketch"
drawing = "none.png"
[[task]]
name = "0 → 1"
goal = [1, 1]
there = { center = [0, 0], radius_m = 1 }
"#;

const ROBOT: &str = r#"
name = "test"
radius_m = 0.2
mass_kg = 10
drive = "differential"
limits = { speed_mps = 1, yaw_rate_radps = 1, acceleration_mps2 = 1, yaw_acceleration_radps2 = 1 }
[laser]
model = "test"
field_of_view_deg = 240
beams = 61
range_min_m = 0.02
range_max_m = 5.6
rate_hz = 10
noise_m = 0.01
noise_per_m = 0
dropout = 0
[odometry]
alpha_speed_speed = 0
alpha_speed_turn = 0
alpha_turn_speed = 0
alpha_turn_turn = 0
drift_distance = 0
drift_yaw_radpm = 0
slips_per_m = 0
"#;

fn localizer(parameters: &str) -> Result<Localizer, LocalizerError> {
    localizer_of(Robot::parse(ROBOT).unwrap(), parameters)
}

fn localizer_of(robot: Robot, parameters: &str) -> Result<Localizer, LocalizerError> {
    let mission = Mission::parse(&format!("{MISSION}{parameters}")).unwrap();
    Localizer::new(&RunConfig::lockstep("test", mission, robot, 1))
}

/// A localizer, with the messages that it has sent.
struct Hosted {
    stage: Localizer,
    sent: InProcess,
}

impl Hosted {
    fn new(parameters: &str) -> Self {
        channels::register(KIND, CHANNELS).unwrap();
        let sent = InProcess::of_writer(Process::Localizer, KIND);
        Self { stage: localizer(parameters).unwrap(), sent }
    }

    /// Creates a localizer that has the sketch of the room.
    fn in_room(parameters: &str) -> Self {
        let (mut hosted, (map, cells)) = (Self::new(parameters), room());
        hosted.receive(SKETCH, &map, &cells).unwrap();
        hosted
    }

    fn receive<T: Message>(
        &mut self,
        channel: Channel<T>,
        message: &T,
        cells: &[u8],
    ) -> Result<(), StageError> {
        let access = Access::new(Process::Localizer, "sketch");
        self.stage.receive(&Incoming::new(&access, channel.spec, bytemuck::bytes_of(message), cells))
    }

    fn order(&mut self, order: &MissionCommand) {
        self.receive(ORDERS, order, &[]).unwrap();
    }

    /// Returns the localizer's answer to an instant with a scan, without the header.
    fn answer(&mut self, odometry: &Odometry, scan: &LaserScan) -> PoseEstimate {
        self.step(odometry, Some(scan), scan.header.stamp_ns)
    }

    fn step(&mut self, odometry: &Odometry, scan: Option<&LaserScan>, stamp_ns: u64) -> PoseEstimate {
        self.sent.end_instant();
        let senses = Senses { odometry, scan };
        let out = &mut Outbox::new(&mut self.sent, stamp_ns, 1);
        let access = Access::new(Process::Localizer, "sketch");
        self.stage.step(&Instant::new(&access, 1, stamp_ns, &senses), out).unwrap();
        PoseEstimate { header: Header::zeroed(), ..*self.said(ESTIMATE).unwrap() }
    }

    /// Returns the message that the localizer sent on a channel in the last step.
    fn said<T: Message>(&self, channel: Channel<T>) -> Option<&T> {
        let said = self.sent.newest(channel.spec).filter(|said| said.is_fresh);
        said.map(|said| bytemuck::from_bytes(said.message))
    }

    /// Returns the places and headings of the particles that the localizer sent in the last step.
    fn particles(&self) -> Vec<[f32; 3]> {
        let Particles { particles, count, .. } = self.said(PARTICLES).unwrap();
        particles[..*count as usize].iter().map(|p| [p.x_px, p.y_px, p.yaw_rad]).collect()
    }

    fn stored(&self) -> Vec<u8> {
        postcard::to_stdvec(&self.stage.state()).unwrap()
    }

    fn restore(&mut self, stored: &[u8]) {
        self.stage.restore(postcard::from_bytes(stored).unwrap()).unwrap();
    }
}

/// The messages of the sensors.
struct Senses<'a> {
    odometry: &'a Odometry,
    scan: Option<&'a LaserScan>,
}

impl Inputs for Senses<'_> {
    fn newest(&self, spec: &ChannelSpec) -> Option<Reading<'_>> {
        let of = |message| Reading { message, cells: &[], is_fresh: true };
        match spec {
            spec if *spec == *ODOMETRY.spec => Some(of(bytemuck::bytes_of(self.odometry))),
            spec if *spec == *SCAN.spec => self.scan.map(|scan| of(bytemuck::bytes_of(scan))),
            _ => None,
        }
    }
}

/// The last estimate of a localizer that was killed.
struct Last(PoseEstimate);

impl Remains for Last {
    fn last(&self, spec: &ChannelSpec) -> Option<Vec<u64>> {
        (*spec == *ESTIMATE.spec).then(|| bytemuck::cast_slice(std::slice::from_ref(&self.0)).to_vec())
    }
}

#[test]
fn a_robot_without_a_sensor_that_the_localizer_needs_is_named_with_the_key_of_its_file() {
    let robot = Robot::parse(ROBOT).unwrap();
    let blind = Robot { laser: None, ..robot.clone() };
    let lost = Robot { odometry: None, ..robot };
    for (robot, key) in [(blind, "[laser]"), (lost, "[odometry]")] {
        let error = localizer_of(robot, "").unwrap_err().to_string();
        assert!(error.contains(key) && error.contains("\"test\""), "{error}");
    }
}

/// Returns a room of 80 × 60 px with the robot in its middle.
fn room() -> (SketchMap, Vec<u8>) {
    let mut map = SketchMap::zeroed();
    (map.width_px, map.height_px) = (100, 80);
    map.start = PosePx::new(&Pose::new(50.0, 40.0, 0.0));
    let free = |i: usize| (10..90).contains(&(i % 100)) && (10..70).contains(&(i / 100));
    (map, (0..8000).map(|i| if free(i) { FREE } else { WALL }).collect())
}

/// Returns a scan of the room from its middle, at 20 px per metre.
fn scan(seq: u64) -> LaserScan {
    scan_at(seq, 0.0)
}

/// Returns a scan of the room from `x` metres ahead of its middle.
fn scan_at(seq: u64, x: f32) -> LaserScan {
    let mut scan = LaserScan::zeroed();
    (scan.header.seq, scan.header.stamp_ns) = (seq, (seq - 1) * 100_000_000);
    (scan.beam_count, scan.range_min_m, scan.range_max_m) = (61, 0.02, 5.6);
    (scan.angle_min_rad, scan.angle_increment_rad) = (-120_f32.to_radians(), 4_f32.to_radians());
    for i in 0..61 {
        let (sin, cos) = scan.angle_rad(i).sin_cos();
        scan.ranges_m[i] = ((2.0 - x * cos.signum()) / cos.abs()).min(1.5 / sin.abs());
    }
    scan
}

/// Returns the odometry of a robot that has not moved.
fn at_the_origin() -> Odometry {
    ahead(0.0)
}

/// Returns the odometry of a robot that has driven `x` metres straight ahead.
fn ahead(x: f64) -> Odometry {
    Odometry { pose: PoseM::new(&Pose::<()>::new(x, 0.0, 0.0)), ..Odometry::zeroed() }
}

#[test]
fn without_a_sketch_it_waits() {
    let out = Hosted::new("").answer(&at_the_origin(), &scan(4));
    assert_eq!(out.tracking, Tracking::Waiting.code());
}

#[test]
fn each_scan_is_answered_and_the_scales_are_found() {
    // One look at a bare room provides little information, so its expected size must be right.
    let mut localizer = Hosted::in_room("[parameters.localizer]\nbuilding_size_m = 5");
    let mut out = PoseEstimate::zeroed();
    for seq in 1..=5 {
        out = localizer.answer(&at_the_origin(), &scan(seq));
        assert_eq!(out.tracking, Tracking::Tracking.code());
    }
    assert!((out.pose.x_px - 50.0).abs() < 5.0 && (out.pose.y_px - 40.0).abs() < 5.0, "{:?}", out.pose);
    for scale in [out.scale_a_pxpm, out.scale_b_pxpm] {
        assert!((scale / 20.0).ln().abs() < 0.2, "{scale}");
    }
}

/// A building is assumed to be 25 m long by default, but this one is a room of 4 m. The first look alone does not show enough to
/// determine this, but driving a few metres does.
#[test]
fn a_room_far_smaller_than_expected_is_doubtful_until_the_robot_drives() {
    let mut localizer = Hosted::in_room("");
    let mut out = localizer.answer(&at_the_origin(), &scan(1));
    assert_eq!(out.tracking, Tracking::Doubtful.code());
    for seq in 2..=60 {
        let x = 1.2 * (0.1 * (seq - 1) as f64).sin();
        out = localizer.answer(&ahead(x), &scan_at(seq, x as f32));
        assert_ne!(out.tracking, Tracking::Lost.code());
    }
    assert_eq!(out.tracking, Tracking::Tracking.code());
    // The laser hardly sees the wall behind the robot, and the expected scale of 4 px/m draws the estimate back.
    let expected = 50.0 + 20.0 * 1.2 * 5.9_f64.sin();
    assert!((out.pose.x_px - expected).abs() < 15.0 && (out.pose.y_px - 40.0).abs() < 5.0, "{:?}", out.pose);
}

#[test]
fn with_another_sketch_the_filter_begins_anew() {
    let (mut localizer, (mut map, cells)) = (Hosted::new(""), room());
    map.header.seq = 1;
    localizer.receive(SKETCH, &map, &cells).unwrap();
    let first = (1..=5).map(|seq| localizer.answer(&at_the_origin(), &scan(seq))).last().unwrap();
    let stored = localizer.stored();
    map.header.seq = 2;
    map.start = PosePx::new(&Pose::new(30.0, 40.0, 0.0));
    localizer.receive(SKETCH, &map, &cells).unwrap();
    // A checkpoint that belongs to the first sketch does not apply to this one.
    localizer.restore(&stored);
    let second = localizer.answer(&at_the_origin(), &scan(6));
    assert!((first.pose.x_px - 50.0).abs() < 5.0 && (second.pose.x_px - 30.0).abs() < 10.0, "{second:?}");
}

fn here(x: f64, y: f64, yaw_rad: Option<f64>) -> MissionCommand {
    let header = Header { seq: 2, stamp_ns: 500_000_000, source_seq: 0 };
    let mut order = MissionCommand { header, order: Order::Here.code(), ..MissionCommand::zeroed() };
    order.set_here(&Here { at: Point::new(x, y), yaw_rad });
    order
}

/// Returns a localizer in the room that has seen five scans.
fn settled() -> Hosted {
    let mut localizer = Hosted::in_room("");
    for seq in 1..=5 {
        localizer.answer(&at_the_origin(), &scan(seq));
    }
    localizer
}

/// Returns the estimate, and the places and headings of the particles, after an order and the scan that follows it, one second
/// after the first scan.
fn particles_after(localizer: &mut Hosted, order: &MissionCommand) -> (PoseEstimate, Vec<[f32; 3]>) {
    localizer.order(order);
    (localizer.answer(&at_the_origin(), &scan(11)), localizer.particles())
}

#[test]
fn a_person_who_says_where_the_robot_is_has_its_particles_drawn_there() {
    let (out, particles) = particles_after(&mut settled(), &here(25.0, 55.0, Some(1.0)));
    assert!((out.pose.x_px - 25.0).abs() < 15.0 && (out.pose.y_px - 55.0).abs() < 15.0, "{:?}", out.pose);
    assert!(particles.iter().all(|at| (at[0] - 25.0).hypot(at[1] - 55.0) < 30.0));
    assert!(particles.iter().all(|at| (at[2] - 1.0).abs() < 1.0), "{particles:?}");
    // Without a heading, the robot is assumed to face the same direction as before.
    let (_, particles) = particles_after(&mut settled(), &here(25.0, 55.0, None));
    assert!(particles.iter().all(|at| at[2].abs() < 1.0), "{particles:?}");
}

/// Nobody has marked where the robot is, and it cannot find out, because the room looks the same after half a turn.
#[test]
fn without_a_start_mark_a_person_can_place_the_robot() {
    let (mut map, cells) = room();
    (map.start_spread_px, map.start_spread_rad) = (1e3, std::f64::consts::PI);
    let hosted = || {
        let mut localizer = Hosted::new("");
        localizer.receive(SKETCH, &map, &cells).unwrap();
        localizer
    };
    let mut localizer = hosted();
    for seq in 1..=5 {
        let out = localizer.answer(&at_the_origin(), &scan(seq));
        assert!(!out.is_placed() && out.tracking == Tracking::Doubtful.code(), "{out:?}");
    }
    let mut successor = hosted();
    successor.restore(&localizer.stored());
    for localizer in [&mut localizer, &mut successor] {
        let (out, particles) = particles_after(localizer, &here(50.0, 40.0, Some(0.0)));
        assert!(out.is_placed() && out.tracking != Tracking::Lost.code(), "{out:?}");
        assert!((out.pose.x_px - 50.0).hypot(out.pose.y_px - 40.0) < 15.0, "{out:?}");
        let is_near = |at: &&[f32; 3]| (at[0] - 50.0).hypot(at[1] - 40.0) < 30.0;
        assert!(10 * particles.iter().filter(is_near).count() > 9 * particles.len(), "{particles:?}");
    }
}

/// A lost robot does not know its heading either, so it has to try all of them. In a learned map the robot may be anywhere, but if
/// a person sets its position, that place counts.
#[test]
fn a_place_that_was_told_counts_in_a_learned_map_too() {
    let (mut map, cells) = room();
    (map.start_spread_px, map.start_spread_rad) = (1e3, std::f64::consts::PI);
    map.pen_width_px = SketchMap::NO_PEN_PX;
    let mission = MISSION.replace("drawing = ", "learned_file = \"room.learned\"\ndrawing = ");
    let run = RunConfig::lockstep("test", Mission::parse(&mission).unwrap(), Robot::parse(ROBOT).unwrap(), 1);
    let mut localizer = Hosted { stage: Localizer::new(&run).unwrap(), ..Hosted::new("") };
    localizer.receive(SKETCH, &map, &cells).unwrap();
    localizer.answer(&at_the_origin(), &scan(1));
    let (_, particles) = particles_after(&mut localizer, &here(25.0, 55.0, Some(1.0)));
    let is_near = |[x, y, _]: &&[f32; 3]| (x - 25.0).hypot(y - 55.0) < 30.0;
    assert!(10 * particles.iter().filter(is_near).count() > 9 * particles.len(), "{particles:?}");
}

#[test]
fn a_lost_robot_that_is_told_a_place_tries_every_heading() {
    let mut localizer = settled();
    let covered = |seq| {
        let mut covered = scan(seq);
        covered.ranges_m.fill(f32::NAN);
        covered
    };
    let mut out = PoseEstimate::zeroed();
    for seq in 6..106 {
        out = localizer.answer(&ahead(0.1 * (seq - 6) as f64), &covered(seq));
    }
    assert_eq!(out.tracking, Tracking::Lost.code());
    localizer.order(&here(50.0, 40.0, None));
    localizer.answer(&ahead(9.9), &covered(111));
    let particles = localizer.particles();
    let quarter = |k: f32| {
        let from = -std::f32::consts::PI + k * std::f32::consts::FRAC_PI_2;
        let is_in = |yaw: f32| (from..from + std::f32::consts::FRAC_PI_2).contains(&yaw);
        particles.iter().filter(|at| is_in(at[2])).count()
    };
    assert!(
        [0.0, 1.0, 2.0, 3.0].into_iter().all(|k| quarter(k) > 50),
        "{:?}",
        [0.0, 1.0, 2.0, 3.0].map(quarter)
    );
    // It recovers in the middle of a room, since the room is longer than wide.
    for seq in 7..40 {
        let x = (0.1 * f64::from(seq)).sin();
        out = localizer.answer(&ahead(9.9 + x), &scan_at(u64::from(seq as u32), x as f32));
    }
    assert_ne!(out.tracking, Tracking::Lost.code());
}

/// Between the order and the next scan, the place is stored only in the checkpoint.
#[test]
fn a_place_that_was_told_survives_the_localizer() {
    let mut whole = settled();
    let mut broken = settled();
    let order = here(25.0, 55.0, None);
    broken.order(&order);
    let mut successor = settled();
    successor.restore(&broken.stored());
    let expected = particles_after(&mut whole, &order);
    let again = successor.answer(&at_the_origin(), &scan(11));
    assert_eq!((again, successor.particles()), expected);
}

/// An order has no effect without a drawing, if its place is outside the drawing, or if it is older than the robot's own
/// information. A localizer without a checkpoint receives old orders again.
#[test]
fn a_place_that_is_none_or_is_old_changes_nothing() {
    let nothing = MissionCommand { order: Order::Pause.code(), ..MissionCommand::zeroed() };
    let expected = particles_after(&mut settled(), &nothing);
    for order in [here(-1.0, 40.0, None), here(50.0, 80.5, None), here(f64::NAN, 40.0, None)] {
        assert_eq!(particles_after(&mut settled(), &order), expected);
    }
    let anew = |order: &MissionCommand| {
        let (mut localizer, (map, cells)) = (Hosted::new(""), room());
        localizer.order(order);
        localizer.stage.recover(&Last(PoseEstimate { header: order.header, ..expected.0 }));
        localizer.receive(SKETCH, &map, &cells).unwrap();
        particles_after(&mut localizer, order)
    };
    assert_eq!(
        anew(&here(25.0, 55.0, None)),
        anew(&MissionCommand { header: here(0.0, 0.0, None).header, ..nothing })
    );
}

/// An estimate that waits for a sketch is at (0, 0), which is a place in every drawing. The localizer used to start there and to
/// forget the start that the person had marked.
#[test]
fn an_estimate_that_waits_is_no_place_to_begin_at() {
    let (mut localizer, (map, cells)) = (Hosted::new(""), room());
    let out = localizer.answer(&at_the_origin(), &scan(1));
    assert_eq!(out.tracking, Tracking::Waiting.code());
    localizer.stage.recover(&Last(out));
    localizer.receive(SKETCH, &map, &cells).unwrap();
    let out = localizer.answer(&at_the_origin(), &scan(2));
    assert!((out.pose.x_px - 50.0).abs() < 5.0, "{:?}", out.pose);
}

/// A scan without any reading used to fit best of all, so a robot with a covered lens was certain of its place, and even a lost one
/// seemed to recover.
#[test]
fn a_robot_that_sees_nothing_is_lost_and_one_that_sees_again_is_not() {
    let (mut localizer, mut out) = (Hosted::in_room(""), PoseEstimate::zeroed());
    let mut drive = |seqs: std::ops::RangeInclusive<u64>, covered: bool| {
        for seq in seqs {
            let x = (seq as f64 * 0.1).sin();
            let mut scan = scan_at(seq, x as f32);
            if covered {
                scan.ranges_m.fill(f32::NAN);
            }
            out = localizer.answer(&ahead(x), &scan);
        }
        out.tracking
    };
    assert_eq!(drive(1..=60, false), Tracking::Tracking.code());
    assert_eq!(drive(61..=120, true), Tracking::Lost.code());
    assert_eq!(drive(121..=240, false), Tracking::Tracking.code());
}

#[test]
fn particles_are_due_once_a_second() {
    let mut waiting = Hosted::new("");
    waiting.answer(&at_the_origin(), &scan(1));
    assert!(waiting.said(PARTICLES).is_none());
    let mut localizer = Hosted::in_room("");
    let mut sent = vec![];
    for seq in 1..=25 {
        let out = localizer.answer(&at_the_origin(), &scan(seq));
        if let Some(particles) = localizer.said(PARTICLES) {
            assert_eq!((particles.count, particles.total), (500, out.particle_count));
            sent.push(seq);
        }
    }
    assert_eq!(sent, [1, 11, 21]);
}

/// If the heartbeat is faster than the laser, the last estimate remains valid in between, with the odometry that it belongs to.
#[test]
fn without_a_new_scan_the_last_estimate_holds() {
    let mut localizer = Hosted::in_room("");
    let first = localizer.answer(&at_the_origin(), &scan(1));
    assert_eq!(localizer.step(&ahead(0.1), None, 50_000_000), first);
}

#[test]
fn errors_name_what_is_wrong() {
    let error = |parameters: &str| {
        localizer(&format!("[parameters.localizer]\n{parameters}")).unwrap_err().to_string()
    };
    assert!(error("particels = 5").contains("particels"), "{}", error("particels = 5"));
    assert!(error("particles = 5").contains("particles: expected 16 to 100000, found 5"));
    let (mut map, cells) = room();
    map.start = PosePx::new(&Pose::new(500.0, 40.0, 0.0));
    let outside = Hosted::new("").receive(SKETCH, &map, &cells).unwrap_err().to_string();
    assert!(outside.contains("100 × 80") && outside.contains("500.0"), "{outside}");
    let short = Hosted::new("").receive(SKETCH, &map, &cells[1..]).unwrap_err();
    assert!(matches!(short.downcast_ref(), Some(LocalizerError::Cells { .. })), "{short}");
}

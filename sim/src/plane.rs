//! The plane of dots: a helicopter moves over it in x and y and sees a small window (Park and Kender 1995, 3.1). This is the second
//! kind of [`Simulation`].
//!
//! The plane has no walls, so there are no contacts. The helicopter follows its commands as fast as its
//! limits allow, with random errors in position and heading that grow with the square root of the distance.
//! It has neither an odometer nor a compass, and never turns on purpose.

use nalgebra::Vector2;
use rand::RngExt;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::channels::{TRUTH, VIEW};
use sketchnav_schemas::geometry::{Pose, World};
use sketchnav_schemas::message::{GroundTruth, PoseM, Twist, VelocityCommand};
use sketchnav_schemas::robot::{Drive, Limits, MotionNoise, Robot};
use sketchnav_schemas::seed;

use crate::drive::{self, Velocity};
use crate::error::{SimError, check, check_start};
use crate::plane_file::PlaneDescription;
use crate::sensors::Schedule;
use crate::sensors::dots::DownCamera;
use crate::simulation::{COMMAND_LIMIT_NS, Senses, Simulation};

/// Minimum number of motion steps per second.
const MOTION_HZ: f64 = 100.0;

/// A plane of dots and a helicopter over it. Its whole state can be stored and restored with serde.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct DotPlane {
    dots: Vec<[f64; 2]>,
    limits: Limits,
    noise: MotionNoise,
    stream: Pcg64Mcg,
    camera: Option<(Schedule, DownCamera)>,
    /// Number of the view taken at the current instant, if any.
    reading: Option<u64>,
    robot: Pose<World>,
    /// Velocity in the world's axes, in m/s.
    velocity: [f64; 2],
    /// The command, forward and to the left, in m/s, and its timestamp.
    command: Option<([f64; 2], u64)>,
    steps: u64,
    period_ns: u64,
    substeps: u32,
}

impl DotPlane {
    /// Creates a plane with the robot hovering over `start`, at time 0. Its camera has taken one view.
    ///
    /// # Errors
    /// - [`SimError::Value`] if the start is out of bounds, or the robot has a sensor that is useless over a
    ///   plane.
    /// - [`SimError::Robot`] if the robot's numbers are out of range.
    pub fn new(
        description: PlaneDescription,
        robot: &Robot,
        start: Pose<World>,
        seed: u64,
    ) -> Result<Self, SimError> {
        robot.check_numbers()?;
        check_sensors(robot)?;
        check_start(&start)?;
        let (tick_hz, period_s) = (robot.tick_hz(), 1.0 / robot.tick_hz());
        let camera = robot.view.as_ref().map(|view| {
            let schedule = Schedule::new(view.rate_hz, tick_hz, 1);
            (schedule, DownCamera::new(view, seed::stream(seed, "world/view")))
        });
        let mut plane = Self {
            dots: description.dots,
            limits: robot.limits,
            noise: robot.motion_noise.unwrap_or_default(),
            stream: seed::stream(seed, "world/motion"),
            camera,
            reading: None,
            robot: start,
            velocity: [0.0; 2],
            command: None,
            steps: 0,
            period_ns: (period_s * 1e9).round() as u64,
            substeps: (MOTION_HZ * period_s - 1e-9).ceil().max(1.0) as u32,
        };
        plane.look();
        Ok(plane)
    }

    /// Returns the positions of the dots.
    pub fn dots(&self) -> &[[f64; 2]] {
        &self.dots
    }

    /// Returns the true pose of the robot.
    pub fn robot_pose(&self) -> Pose<World> {
        self.robot
    }

    fn look(&mut self) {
        self.reading = self.camera.as_mut().and_then(|(schedule, _)| schedule.take(self.steps));
    }

    fn substep(&mut self, now_ns: u64, dt_s: f64) {
        let fresh = self.command.filter(|(_, stamp_ns)| now_ns.saturating_sub(*stamp_ns) <= COMMAND_LIMIT_NS);
        let [vx_mps, vy_mps] = fresh.map_or([0.0; 2], |(velocity, _)| velocity);
        let goal = Twist { vx_mps, vy_mps, yaw_rate_radps: 0.0 };
        let now = Velocity { linear: self.velocity.into(), angular: 0.0 };
        let yaw_rad = self.robot.yaw_rad;
        let next = drive::accelerate(now, yaw_rad, &goal, Drive::Omnidirectional, &self.limits, dt_s);
        self.velocity = next.linear.into();
        let way = next.linear * dt_s;
        if way.norm() > 0.0 {
            self.stray(way);
        }
    }

    /// Moves the robot along `way`, with random errors.
    fn stray(&mut self, way: Vector2<f64>) {
        let [x, y, turn] = [(); 3].map(|()| self.stream.sample::<f64, _>(StandardNormal));
        let spread = way.norm().sqrt();
        let off = Vector2::new(x, y) * (self.noise.translation_m * spread);
        let Pose { x, y, yaw_rad, .. } = self.robot;
        let yaw_rad = yaw_rad + turn * self.noise.rotation_rad * spread;
        self.robot = Pose::new(x + way.x + off.x, y + way.y + off.y, yaw_rad);
    }
}

/// Rejects robots with sensors that are of no use over a plane of dots.
fn check_sensors(robot: &Robot) -> Result<(), SimError> {
    let slip = robot.slip.is_some().then_some("slip");
    let sensors = robot.sensors().filter(|sensor| sensor.channel.name != VIEW.spec.name);
    sensors.map(|sensor| sensor.table).chain(slip).next().map_or(Ok(()), |key| {
        let expected = "a robot without that table over a plane of dots";
        check(false, format!("robot {:?}: [{key}]", robot.name), expected, key)
    })
}

impl Simulation for DotPlane {
    fn step(&mut self, command: Option<&VelocityCommand>) {
        if let Some(command) = command {
            let Twist { vx_mps, vy_mps, .. } = command.twist;
            // A timestamp in the future would never become too old.
            self.command = Some(([vx_mps, vy_mps], command.header.stamp_ns.min(self.stamp_ns())));
        }
        let dt_ns = self.period_ns / u64::from(self.substeps);
        for substep in 0..u64::from(self.substeps) {
            self.substep(self.stamp_ns() + substep * dt_ns, dt_ns as f64 / 1e9);
        }
        self.steps += 1;
        self.look();
    }

    fn sense<S: Senses>(&self, senses: &mut S) -> Result<(), S::Error> {
        senses.reading(TRUTH, self.stamp_ns(), |truth| self.fill_truth(truth))?;
        if let (Some((_, camera)), Some(number)) = (&self.camera, self.reading) {
            let fill = |view: &mut _| camera.fill(&self.robot, &self.dots, number, view);
            senses.reading(VIEW, self.stamp_ns(), fill)?;
        }
        Ok(())
    }

    fn fill_truth(&self, truth: &mut GroundTruth) {
        let (sin, cos) = self.robot.yaw_rad.sin_cos();
        let [x, y] = self.velocity;
        truth.pose = PoseM::new(&self.robot);
        truth.twist = Twist { vx_mps: x * cos + y * sin, vy_mps: y * cos - x * sin, yaw_rate_radps: 0.0 };
    }

    fn steps(&self) -> u64 {
        self.steps
    }

    fn period_ns(&self) -> u64 {
        self.period_ns
    }
}

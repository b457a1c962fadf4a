//! The floor: physics, people, the robot with its drive, and its sensors. Given a command, it advances by one
//! instant and yields readings. The floor is one of the two kinds of [`Simulation`].
//!
//! A floor never reads a clock and does not set the pace, which is up to the caller of [`Simulation::step`].

use nalgebra::Rotation2;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::channels::{CONTACT, MARKERS, ODOMETRY, PEOPLE, SCAN, SONAR, TRUTH};
use sketchnav_schemas::geometry::{Pose, World};
use sketchnav_schemas::message::{
    Contact, GroundTruth, MAX_CONTACTS, People, PoseM, Twist, VelocityCommand, WalkingPerson,
};
use sketchnav_schemas::robot::{Drive, Limits, Robot};
use sketchnav_schemas::seed;

use crate::convex::{Convex, Segment};
use crate::description::WorldDescription;
use crate::drive::{self, Slip};
use crate::error::{SimError, check, check_start};
use crate::people::Walker;
use crate::physics::{Physics, Touching, TruePose};
use crate::raycast::Faces;
use crate::sensors::camera::Camera;
use crate::sensors::laser::Scanner;
use crate::sensors::odometry::{DeadReckoning, Odometer};
use crate::sensors::sonar::SonarRing;
use crate::sensors::{Disc, Scene, Schedule};
use crate::simulation::{COMMAND_LIMIT_NS, Senses, Simulation};
use sketchnav_schemas::mission::{Carry, carry_key};

/// Minimum number of physics steps per second.
const PHYSICS_HZ: f64 = 100.0;
const STOP: Twist = Twist { vx_mps: 0.0, vy_mps: 0.0, yaw_rate_radps: 0.0 };

/// A floor and everything on it. Its whole state can be stored and restored with serde.
#[derive(Serialize, Deserialize)]
pub struct Floor {
    outline: Vec<Segment>,
    furniture: Vec<Convex>,
    faces: Faces,
    body: Body,
    laser: Option<Sensor<Scanner>>,
    sonar: Option<Sensor<SonarRing>>,
    camera: Option<Sensor<Camera>>,
    odometry: Option<(Schedule, Odometer)>,
    /// State of the world at each reading of a ranging sensor within the last step. The vector may be longer than `moment_count`.
    moments: Vec<Moment>,
    moment_count: usize,
    people: Vec<Walker>,
    physics: Physics,
    touches: Vec<Touch>,
    events: Vec<Event>,
    command: Option<Held>,
    /// Times at which somebody will carry the robot, latest first.
    carries: Vec<Carry>,
    steps: u64,
    period_ns: u64,
    substeps: u32,
}

/// The parts of the robot file that determine how the robot moves.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Body {
    radius_m: f64,
    drive: Drive,
    limits: Limits,
    slip: Option<Slip>,
}

/// A ranging sensor, with its readings since the previous instant.
#[derive(Serialize, Deserialize)]
struct Sensor<S> {
    model: S,
    schedule: Schedule,
    readings: Vec<Reading>,
}

#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Reading {
    number: u64,
    /// Index into `moments` of the time of the reading.
    moment: usize,
}

/// The state of the world at the time of a reading, as far as ranging sensors depend on it.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Moment {
    stamp_ns: u64,
    robot: Pose<World>,
    people: Vec<Disc>,
}

/// The command that the robot is following.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Held {
    /// Velocity: forward and left, in m/s, and turn rate, in rad/s.
    velocity: [f64; 3],
    stamp_ns: u64,
}

/// State of the robot's contact with a body.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct Touch {
    /// Whether the robot touched the body during the last step.
    now: bool,
    /// Whether the beginning of the contact has been reported, but not its end.
    reported: bool,
    place: [f64; 2],
    impulse_ns: f64,
}

#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Event {
    body: usize,
    begins: bool,
    touch: Touch,
}

/// Rejects robots with tables that are only used over a plane of dots.
fn check_sensors(robot: &Robot) -> Result<(), SimError> {
    for (key, is_there) in [("view", robot.view.is_some()), ("motion_noise", robot.motion_noise.is_some())] {
        let expected = "a robot without that table on a floor: only a plane of dots has it";
        check(!is_there, format!("robot {:?}: [{key}]", robot.name), expected, key)?;
    }
    Ok(())
}

impl<S> Sensor<S> {
    fn new(model: S, schedule: Schedule, capacity: usize) -> Self {
        Self { model, schedule, readings: Vec::with_capacity(capacity) }
    }

    /// Takes a reading if one is due after the given number of physics steps. Returns true if it did.
    fn takes(&mut self, physics_steps: u64, moment: usize) -> bool {
        let number = self.schedule.take(physics_steps);
        self.readings.extend(number.map(|number| Reading { number, moment }));
        number.is_some()
    }
}

impl Floor {
    /// Creates a floor with the robot at `start`, at time 0. Its sensors have taken their first readings.
    ///
    /// # Errors
    /// - [`SimError::Start`] if the robot does not fit at its start.
    /// - [`SimError::Value`] if the start or a table of the robot is invalid.
    /// - [`SimError::Robot`] if the robot's numbers are out of range, which only happens if they were not read from a file.
    pub fn new(
        description: WorldDescription,
        robot: &Robot,
        start: Pose<World>,
        seed: u64,
    ) -> Result<Self, SimError> {
        robot.check_numbers()?;
        check_sensors(robot)?;
        check_start(&start)?;
        description.check_start([start.x, start.y])?;
        let (tick_hz, period_s) = (robot.tick_hz(), 1.0 / robot.tick_hz());
        let substeps = substeps(robot, period_s);
        let at = TruePose { at: start.position().coords(), yaw_rad: start.yaw_rad };
        let physics = Physics::new(&description, robot, at, period_s / f64::from(substeps))?;
        let stream = |name| seed::stream(seed, name);
        let schedule = |rate_hz| Schedule::new(rate_hz, tick_hz, substeps);
        let capacity = substeps as usize;
        let laser = robot.laser.as_ref().map(|laser| {
            let scanner = Scanner::new(laser, stream("world/laser"));
            Sensor::new(scanner, schedule(laser.rate_hz), capacity)
        });
        let sonar = robot.sonar.as_ref().map(|sonar| {
            let ring = SonarRing::new(sonar, stream("world/sonar"));
            Sensor::new(ring, schedule(sonar.rate_hz), capacity)
        });
        let camera = robot.camera.as_ref().map(|camera| {
            let finder = Camera::new(camera, &description.markers, stream("world/camera"));
            Sensor::new(finder, schedule(camera.rate_hz), capacity)
        });
        let odometry = robot.odometry.as_ref().map(|noise| {
            let count = DeadReckoning::new(noise, robot.drive, stream("world/odometry"));
            let mut schedule = schedule(noise.rate_hz.unwrap_or(tick_hz));
            schedule.take(0);
            (schedule, Odometer::new(count, pose(&physics), capacity))
        });
        let WorldDescription { outline, furniture, people, .. } = description;
        let faces = outline.iter().copied().chain(furniture.iter().flat_map(Convex::edges)).collect();
        let people: Vec<_> = people.iter().map(Walker::new).collect();
        let moment = Moment { stamp_ns: 0, robot: start, people: people.iter().map(Walker::disc).collect() };
        let mut floor = Self {
            outline,
            furniture,
            faces: Faces::new(faces),
            body: Body {
                radius_m: robot.radius_m,
                drive: robot.drive,
                limits: robot.limits,
                slip: robot.slip.as_ref().map(|slip| Slip::new(slip, stream("world/slip"))),
            },
            laser,
            sonar,
            camera,
            odometry,
            moments: vec![moment; capacity],
            moment_count: 0,
            people,
            touches: vec![Touch::default(); physics.body_count()],
            physics,
            events: Vec::with_capacity(MAX_CONTACTS),
            command: None,
            carries: Vec::new(),
            steps: 0,
            period_ns: (period_s * 1e9).round() as u64,
            substeps,
        };
        floor.read(0, 0);
        Ok(floor)
    }

    /// Lets somebody carry the robot at the given times.
    ///
    /// # Errors
    /// [`SimError::Value`] if the robot does not fit where it is set down.
    pub fn carry(&mut self, carries: &[Carry], robot: &Robot) -> Result<(), SimError> {
        for (number, carry) in (1..).zip(carries) {
            if let Err(SimError::Start { kind, distance_m, .. }) =
                self.physics.check_free(robot, true_pose(carry))
            {
                let [key, found] = [carry_key(number), format!("a {kind} {distance_m:.3} m away")];
                return Err(SimError::Value { key, expected: "free floor around `to`", found });
            }
        }
        self.carries = carries.to_vec();
        self.carries.sort_by(|a, b| b.at_s.total_cmp(&a.at_s));
        Ok(())
    }

    /// Sets the robot down elsewhere if it is time.
    fn carry_if_due(&mut self) {
        let now_s = self.stamp_ns() as f64 / 1e9;
        while let Some(carry) = self.carries.pop_if(|carry| carry.at_s <= now_s) {
            self.physics.put_robot(true_pose(&carry));
            let at = self.robot_pose();
            self.odometry.iter_mut().for_each(|(_, odometer)| odometer.carry(at));
        }
    }

    /// Takes a reading of each sensor that is due after the given number of physics steps since the start.
    fn read(&mut self, physics_steps: u64, stamp_ns: u64) {
        let (robot, moment) = (self.robot_pose(), self.moment_count);
        let by_laser = self.laser.as_mut().is_some_and(|laser| laser.takes(physics_steps, moment));
        let by_sonar = self.sonar.as_mut().is_some_and(|sonar| sonar.takes(physics_steps, moment));
        let by_camera = self.camera.as_mut().is_some_and(|camera| camera.takes(physics_steps, moment));
        if by_laser || by_sonar || by_camera {
            let place = &mut self.moments[moment];
            (place.stamp_ns, place.robot) = (stamp_ns, robot);
            place.people.clear();
            place.people.extend(self.people.iter().map(Walker::disc));
            self.moment_count += 1;
        }
        if let Some((schedule, odometer)) = &mut self.odometry
            && schedule.take(physics_steps).is_some()
        {
            odometer.read(stamp_ns, robot);
        }
    }

    fn forget_readings(&mut self) {
        self.moment_count = 0;
        self.laser.iter_mut().for_each(|laser| laser.readings.clear());
        self.sonar.iter_mut().for_each(|sonar| sonar.readings.clear());
        self.camera.iter_mut().for_each(|camera| camera.readings.clear());
        self.odometry.iter_mut().for_each(|(_, odometer)| odometer.clear());
    }

    /// Returns the scene of a reading, and its timestamp.
    fn scene(&self, reading: &Reading) -> (u64, Scene<'_>) {
        let Moment { stamp_ns, robot, people } = &self.moments[reading.moment];
        (*stamp_ns, Scene { robot: *robot, faces: &self.faces, people })
    }

    fn substep(&mut self, substep: u32) {
        let dt_ns = self.period_ns / u64::from(self.substeps);
        let now_ns = self.stamp_ns() + u64::from(substep) * dt_ns;
        let (dt_s, pose) = (dt_ns as f64 / 1e9, self.physics.robot_pose());
        let (drive, limits) = (self.body.drive, &self.body.limits);
        let goal = self.goal(now_ns);
        let velocity =
            drive::accelerate(self.physics.robot_velocity(), pose.yaw_rad, &goal, drive, limits, dt_s);
        self.physics.set_robot_velocity(velocity);
        for (i, person) in self.people.iter_mut().enumerate() {
            person.step(dt_s, pose.at, self.body.radius_m);
            self.physics.move_person(i, person.position());
        }
        self.physics.step();
        for touching in self.physics.touching() {
            self.touches[touching.body].update(&touching);
        }
    }

    fn goal(&self, now_ns: u64) -> Twist {
        let fresh = self.command.filter(|held| now_ns.saturating_sub(held.stamp_ns) <= COMMAND_LIMIT_NS);
        let commanded = fresh.map_or(STOP, |Held { velocity: [vx_mps, vy_mps, yaw_rate_radps], .. }| Twist {
            vx_mps,
            vy_mps,
            yaw_rate_radps,
        });
        self.body.slip.map_or(commanded, |slip| slip.motion(&commanded))
    }

    /// Collects the contacts that begin or end. A contact begins with the first step in which it is detected, and ends with the
    /// first step in which it is not. Contacts that come and go within a step count as one. Events that do not fit into a step are
    /// delivered in the next one.
    fn collect_events(&mut self) {
        self.events.clear();
        for (body, touch) in self.touches.iter_mut().enumerate() {
            if touch.now != touch.reported && self.events.len() < MAX_CONTACTS {
                self.events.push(Event { body, begins: touch.now, touch: *touch });
                touch.reported = touch.now;
                if !touch.now {
                    touch.impulse_ns = 0.0;
                }
            }
        }
    }

    fn fill_contact(&self, event: &Event, contact: &mut Contact) {
        contact.position_m = event.touch.place;
        contact.impulse_ns = event.touch.impulse_ns;
        contact.body_kind = self.physics.kind(event.body).code();
        contact.begins = u32::from(event.begins);
    }

    fn fill_people(&self, people: &mut People) {
        people.count = self.people.len() as u32;
        for (place, person) in people.people.iter_mut().zip(&self.people) {
            let ([x_m, y_m], radius_m) = person.disc();
            *place = WalkingPerson { x_m, y_m, radius_m };
        }
    }

    /// Returns the true pose of the robot.
    pub fn robot_pose(&self) -> Pose<World> {
        pose(&self.physics)
    }

    /// Returns the true velocity of the robot, in its own axes.
    pub fn robot_twist(&self) -> Twist {
        let velocity = self.physics.robot_velocity();
        let body = Rotation2::new(-self.robot_pose().yaw_rad) * velocity.linear;
        Twist { vx_mps: body.x, vy_mps: body.y, yaw_rate_radps: velocity.angular }
    }

    /// Returns the faces of the walls, in metres, in frame `World`.
    pub fn outline(&self) -> &[Segment] {
        &self.outline
    }

    /// Returns the furniture.
    pub fn furniture(&self) -> &[Convex] {
        &self.furniture
    }

    /// Returns the position and the radius of each person.
    pub fn people(&self) -> impl ExactSizeIterator<Item = Disc> + '_ {
        self.people.iter().map(Walker::disc)
    }
}

impl Simulation for Floor {
    fn step(&mut self, command: Option<&VelocityCommand>) {
        if let Some(command) = command {
            let Twist { vx_mps, vy_mps, yaw_rate_radps } = command.twist;
            // A timestamp in the future would never become too old.
            let stamp_ns = command.header.stamp_ns.min(self.stamp_ns());
            self.command = Some(Held { velocity: [vx_mps, vy_mps, yaw_rate_radps], stamp_ns });
        }
        self.forget_readings();
        self.carry_if_due();
        self.touches.iter_mut().for_each(|touch| touch.now = false);
        let (before, count) = (self.steps * u64::from(self.substeps), self.substeps);
        for substep in 0..count {
            self.substep(substep);
            let passed_ns = self.period_ns * u64::from(substep + 1) / u64::from(count);
            self.read(before + u64::from(substep + 1), self.stamp_ns() + passed_ns);
        }
        self.steps += 1;
        self.collect_events();
    }

    fn sense<S: Senses>(&self, senses: &mut S) -> Result<(), S::Error> {
        for event in &self.events {
            senses.reading(CONTACT, self.stamp_ns(), |contact| self.fill_contact(event, contact))?;
        }
        senses.reading(TRUTH, self.stamp_ns(), |truth| self.fill_truth(truth))?;
        if !self.people.is_empty() {
            senses.reading(PEOPLE, self.stamp_ns(), |people| self.fill_people(people))?;
        }
        for reading in self.odometry.iter().flat_map(|(_, odometer)| odometer.readings()) {
            senses.reading(ODOMETRY, reading.stamp_ns, |odometry| reading.fill(odometry))?;
        }
        for (laser, reading) in readings(&self.laser) {
            let (stamp_ns, scene) = self.scene(reading);
            senses.reading(SCAN, stamp_ns, |scan| laser.fill(&scene, reading.number, scan))?;
        }
        for (sonar, reading) in readings(&self.sonar) {
            let (stamp_ns, scene) = self.scene(reading);
            senses.reading(SONAR, stamp_ns, |scan| sonar.fill(&scene, reading.number, scan))?;
        }
        for (camera, reading) in readings(&self.camera) {
            let (stamp_ns, scene) = self.scene(reading);
            senses.reading(MARKERS, stamp_ns, |view| camera.fill(&scene, reading.number, view))?;
        }
        Ok(())
    }

    fn fill_truth(&self, truth: &mut GroundTruth) {
        truth.pose = PoseM::new(&self.robot_pose());
        truth.twist = self.robot_twist();
    }

    fn steps(&self) -> u64 {
        self.steps
    }

    fn period_ns(&self) -> u64 {
        self.period_ns
    }
}

/// Returns the readings of a sensor since the previous instant, oldest first, or none if the robot lacks the sensor.
fn readings<S>(sensor: &Option<Sensor<S>>) -> impl Iterator<Item = (&S, &Reading)> {
    sensor
        .iter()
        .flat_map(|Sensor { model, readings, .. }| readings.iter().map(move |reading| (model, reading)))
}

fn pose(physics: &Physics) -> Pose<World> {
    let TruePose { at, yaw_rad } = physics.robot_pose();
    Pose::new(at.x, at.y, yaw_rad)
}

fn true_pose(Carry { to, heading_deg, .. }: &Carry) -> TruePose {
    TruePose { at: (*to).into(), yaw_rad: heading_deg.to_radians() }
}

impl Touch {
    fn update(&mut self, touching: &Touching) {
        if !self.now || touching.impulse_ns >= self.impulse_ns {
            self.place = touching.place.into();
        }
        self.impulse_ns = self.impulse_ns.max(touching.impulse_ns);
        self.now = true;
    }
}

/// Returns the number of physics steps per instant. There are so many that the robot never moves far within a step, and that no
/// sensor takes two readings in one.
fn substeps(robot: &Robot, period_s: f64) -> u32 {
    let by_rate = PHYSICS_HZ * period_s;
    let by_speed = 4.0 * robot.limits.speed_mps * period_s / robot.radius_m;
    let by_sensors = robot.sensors().map(|sensor| sensor.rate_hz).fold(0.0, f64::max) * period_s;
    (by_rate.max(by_speed).max(by_sensors) - 1e-9).ceil() as u32
}

//! Dead reckoning with errors: the velocity motion model (Thrun, Burgard and Fox, *Probabilistic Robotics*, table 5.3),
//! extended by slips and by a drift that is constant during a run.
//!
//! Over a step of length dt, the speed and the turn rate have noise of variance (α₁ v² + α₂ ω²)/dt and (α₃ v² + α₄ ω²)/dt,
//! which makes the spread of a path independent of the length of the steps. An omnidirectional drive has the same errors along
//! both of its axes. The third noise of the model, a final rotation, is left out, because the noise of the turn rate takes its
//! place.
//!
//! [`DeadReckoning`] counts motions, and an [`Odometer`] feeds it the motion from one reading to the next.

use rand::RngExt;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Base, Odom, Pose, World};
use sketchnav_schemas::message::{Odometry, PoseM, Twist};
use sketchnav_schemas::robot::{Drive, OdometryNoise};

/// The motion of a robot as its own wheels count it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DeadReckoning {
    noise: OdometryNoise,
    drive: Drive,
    /// Counted metres per metre actually driven.
    distance_factor: f64,
    drift_yaw_radpm: f64,
    stream: Pcg64Mcg,
    x_m: f64,
    y_m: f64,
    yaw_rad: f64,
    /// Counted velocity: forward and left in m/s, turn rate in rad/s.
    velocity: [f64; 3],
}

impl DeadReckoning {
    /// Starts dead reckoning at the origin of [`Odom`]. The run's drift is drawn from `stream`.
    pub fn new(noise: &OdometryNoise, drive: Drive, mut stream: Pcg64Mcg) -> Self {
        let distance: f64 = stream.sample(StandardNormal);
        let yaw: f64 = stream.sample(StandardNormal);
        Self {
            noise: *noise,
            drive,
            distance_factor: 1.0 + distance * noise.drift_distance,
            drift_yaw_radpm: yaw * noise.drift_yaw_radpm,
            stream,
            x_m: 0.0,
            y_m: 0.0,
            yaw_rad: 0.0,
            velocity: [0.0; 3],
        }
    }

    /// Counts a true motion that took `dt_s` seconds, given in the robot's axes before the motion.
    pub fn step(&mut self, motion: &Pose<Base>, dt_s: f64) {
        let distance_m = motion.x.hypot(motion.y);
        let (speed, turn_rate) = (distance_m / dt_s, motion.yaw_rad / dt_s);
        let noise = self.noise;
        let speed_noise =
            noise.alpha_speed_speed * speed.powi(2) + noise.alpha_speed_turn * turn_rate.powi(2);
        let turn_noise = noise.alpha_turn_speed * speed.powi(2) + noise.alpha_turn_turn * turn_rate.powi(2);
        let (deviation_m, deviation_rad) = ((speed_noise * dt_s).sqrt(), (turn_noise * dt_s).sqrt());
        let [along, across, around] = [(); 3].map(|()| self.stream.sample::<f64, _>(StandardNormal));
        let counted = self.distance_factor * self.slip(distance_m);
        let across_m = if self.drive == Drive::Omnidirectional { deviation_m * across } else { 0.0 };
        let yaw_rad = motion.yaw_rad + self.drift_yaw_radpm * distance_m + deviation_rad * around;
        let step = Pose::<Base>::new(
            motion.x * counted + deviation_m * along,
            motion.y * counted + across_m,
            yaw_rad,
        );
        self.velocity = [step.x / dt_s, step.y / dt_s, step.yaw_rad / dt_s];
        let pose = self.pose().compose(&step);
        (self.x_m, self.y_m, self.yaw_rad) = (pose.x, pose.y, pose.yaw_rad);
    }

    /// Returns the ratio of the counted to the actual distance in a slip. The wheels turn up to twice as far as the robot moves.
    fn slip(&mut self, distance_m: f64) -> f64 {
        let (chance, share) = (self.stream.random::<f64>(), self.stream.random::<f64>());
        if chance < self.noise.slips_per_m * distance_m { 1.0 + share } else { 1.0 }
    }

    /// Returns the pose of the robot by its own count.
    pub fn pose(&self) -> Pose<Odom> {
        Pose::new(self.x_m, self.y_m, self.yaw_rad)
    }
}

/// Dead reckoning together with its readings since the last instant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Odometer {
    count: DeadReckoning,
    /// Time and true pose of the last reading.
    last_ns: u64,
    last: Pose<World>,
    readings: Vec<Reading>,
}

/// An odometry reading.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// Simulation time of the reading, in nanoseconds.
    pub stamp_ns: u64,
    pose: Pose<Odom>,
    velocity: [f64; 3],
}

impl Odometer {
    /// Creates an odometer at the start, with its first reading. It takes up to `capacity` readings per instant without
    /// allocating.
    pub fn new(count: DeadReckoning, start: Pose<World>, capacity: usize) -> Self {
        let mut odometer = Self { count, last_ns: 0, last: start, readings: Vec::with_capacity(capacity) };
        odometer.put(0);
        odometer
    }

    /// Forgets the readings of the previous instant.
    pub fn clear(&mut self) {
        self.readings.clear();
    }

    /// Takes a reading at `stamp_ns`, with the robot's true pose at that time.
    pub fn read(&mut self, stamp_ns: u64, at: Pose<World>) {
        self.count.step(&self.last.motion_to(&at), (stamp_ns - self.last_ns) as f64 / 1e9);
        (self.last_ns, self.last) = (stamp_ns, at);
        self.put(stamp_ns);
    }

    /// Records that somebody has carried the robot to this pose. No wheel has turned.
    pub fn carry(&mut self, to: Pose<World>) {
        self.last = to;
    }

    /// Returns the readings since the previous instant, oldest first.
    pub fn readings(&self) -> &[Reading] {
        &self.readings
    }

    fn put(&mut self, stamp_ns: u64) {
        let DeadReckoning { velocity, .. } = self.count;
        self.readings.push(Reading { stamp_ns, pose: self.count.pose(), velocity });
    }
}

impl Reading {
    /// Fills in the reading, except for the header.
    pub fn fill(&self, odometry: &mut Odometry) {
        let [vx_mps, vy_mps, yaw_rate_radps] = self.velocity;
        odometry.pose = PoseM::new(&self.pose);
        odometry.twist = Twist { vx_mps, vy_mps, yaw_rate_radps };
    }
}

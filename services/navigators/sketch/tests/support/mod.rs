//! A small world for the localization, which has a robot on rails in the [`building`], with a laser and noisy odometry.

mod building;

use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use sketchnav_schemas::geometry::{Base, Odom, Pose, World, wrap_angle};
use sketchnav_schemas::message::LaserScan;
use sketchnav_schemas::seed;
use sketchnav_sketch::filter::beams::Mounting;
use sketchnav_sketch::filter::parameters::Parameters;
use sketchnav_sketch::filter::{Filter, Start, extent_px};

use building::normal;
pub use building::{Drawing, WAY, scan_from};

/// Creates a localizer at the start of the path, in a drawing.
pub fn localizer(drawing: &Drawing, parameters: Parameters, seed: u64) -> Filter {
    let [x, y] = drawing.px(WAY[0]);
    let pose = Pose::new(x, y, std::f64::consts::FRAC_PI_2 + drawing.turn_rad);
    localizer_at(drawing, parameters, Start { pose, spread_px: 5.0, spread_rad: 0.1 }, seed)
}

/// Creates a localizer with this start in a drawing.
pub fn localizer_at(drawing: &Drawing, parameters: Parameters, start: Start, seed: u64) -> Filter {
    let drive = sketchnav_schemas::robot::Drive::Omnidirectional;
    Filter::new(&drawing.sketch(), Mounting::default(), drive, parameters, start, seed).unwrap()
}

/// A map as a laser has seen it, at 20 pixels per metre.
pub const MAPPED: Drawing = Drawing { size: [400, 320], a: 20.0, b: 20.0, turn_rad: 0.0, wobble_px: 0.0 };

/// A robot driving along [`WAY`].
pub struct Drive {
    pub localizer: Filter,
    rng: Pcg64Mcg,
    pub truth: Pose<World>,
    odometry: Pose<Odom>,
}

impl Drive {
    pub fn new(drawing: Drawing, parameters: Parameters, seed: u64) -> Self {
        let truth = Pose::new(WAY[0][0], WAY[0][1], std::f64::consts::FRAC_PI_2);
        let localizer = localizer(&drawing, parameters, seed);
        Self { localizer, rng: seed::stream(seed, "drive"), truth, odometry: Pose::new(0.0, 0.0, 0.0) }
    }

    /// Creates a robot that may be anywhere in [`MAPPED`]. It last stood in the middle of the map.
    pub fn anywhere(seed: u64) -> Self {
        let building_size_m = extent_px(&MAPPED.sketch()) / MAPPED.a as f32;
        Self::anywhere_in(MAPPED, Parameters { building_size_m, ..Parameters::learned() }, seed)
    }

    /// Creates a robot that may be anywhere in a drawing.
    pub fn anywhere_in(drawing: Drawing, parameters: Parameters, seed: u64) -> Self {
        let [width, height] = drawing.size.map(|side| side as f64);
        let start = Start::anywhere(Pose::new(width / 2.0, height / 2.0, 0.0), drawing.size);
        let localizer = localizer_at(&drawing, parameters, start, seed);
        Self { localizer, ..Self::new(drawing, Parameters::default(), seed) }
    }

    /// Moves the robot for a tenth of a second at half a metre per second towards a waypoint. If the waypoint is to the side, the
    /// robot turns first.
    pub fn advance(&mut self, [x, y]: [f64; 2]) -> (Pose<Odom>, LaserScan) {
        let bearing = wrap_angle((y - self.truth.y).atan2(x - self.truth.x) - self.truth.yaw_rad);
        let forward = if bearing.abs() > 0.4 { 0.0 } else { 0.05 };
        let step = Pose::<Base>::new(forward, 0.0, bearing.clamp(-0.1, 0.1));
        self.truth = self.truth.compose(&step);
        let slip = if self.rng.random::<f64>() < 0.02 { 0.7 } else { 1.0 };
        let noisy = Pose::<Base>::new(
            step.x * (1.02 + 0.05 * normal(&mut self.rng)) * slip,
            0.002 * normal(&mut self.rng),
            step.yaw_rad * (1.0 + 0.05 * normal(&mut self.rng))
                + 0.06 * step.x.sqrt() * normal(&mut self.rng),
        );
        self.odometry = self.odometry.compose(&noisy);
        (self.odometry, self.scan())
    }

    /// Returns a scan of 121 beams over 240°, with a maximum range of 5.6 m.
    fn scan(&mut self) -> LaserScan {
        let (pose, rng) = ([self.truth.x, self.truth.y, self.truth.yaw_rad], &mut self.rng);
        let mut scan = scan_from(pose, 121, -120_f32.to_radians(), 5.6, || 0.02 * normal(rng));
        scan.ranges_m[17] = f32::NAN;
        scan
    }
}

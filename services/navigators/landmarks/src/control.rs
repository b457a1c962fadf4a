//! The reactive controller, and its fusion with the command of the path controller (Chronis 2007, 4.7).
//!
//! Formula 4.26 is
//!
//! α = Σ s / e^μ(x) · w(x) · cos(x π/8), and β the same with the sine,
//!
//! where p(x) is the proximity in direction x and r is the range, both in inches. S₁ = √(α² + β²) is the
//! strength of the avoidance, and F₁ = atan2(β, α) is the direction to avoid. There are two readings of μ:
//! see [`Attenuation`].
//!
//! We read formula 4.27, F₂ = d S₁ r / c + p t, with d = −F₁ in degrees, so that the robot turns away from obstacles. The
//! weights of figure 4.25 are lost. According to the text, they are greatest in front, smaller at the sides, and zero in the rear
//! (see [`WEIGHTS`]).

use std::f64::consts::FRAC_PI_8;

use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::numbers;
use crate::route::{Command, DIRECTIONS, INCH_M, between};

/// Our weights of directions, indexed by how far a direction is off the front, in sixteenths of a turn.
pub const WEIGHTS: [f64; 9] = [1.0, 0.9, 0.75, 0.5, 0.25, 0.0, 0.0, 0.0, 0.0];

/// The nearest range in each of the sixteen directions, in metres, or infinity if there is no return.
pub type Sectors = [f64; DIRECTIONS as usize];

/// How the weight of an object decreases with its distance. This is the μ of formula 4.26, computed from the proximity p and
/// the range r.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Attenuation {
    /// μ = (p − ln(r − 1)) / r, as printed. An object weighs 1.03 s on contact, still 0.38 s at the range of
    /// 150 inches, and nothing beyond.
    Printed,
    /// μ = p · ln(r − 1) / r, taking the minus for a product. An object weighs s on contact and s / (r − 1),
    /// about 1, at the range.
    Product,
}

impl Attenuation {
    /// Returns the μ of an object. Both lengths are in inches.
    fn mu(self, proximity: f64, range: f64) -> f64 {
        let log = (range - 1.0).ln();
        match self {
            Self::Printed => (proximity - log) / range,
            Self::Product => proximity * log / range,
        }
    }
}

/// Parameters of the controllers. The defaults are those of Chronis 2007, 4.7, unless stated otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Controlling {
    /// Sensitivity s.
    pub sensitivity: f64,
    /// Range r up to which objects are avoided, in metres.
    pub range_m: f64,
    /// How the weight of an object decreases with its distance.
    pub attenuation: Attenuation,
    /// Normalization constant c.
    pub normalization: f64,
    /// Turn rate constant t, in degrees per second.
    pub turn_rate_dps: f64,
    /// Speed, in metres per second.
    pub speed_mps: f64,
    /// Speed while an object is very close, in metres per second.
    pub slow_mps: f64,
    /// Turn rate while an object is very close, in degrees per second.
    pub quick_turn_dps: f64,
    /// Distance below which an object in front is very close, in metres. The thesis does not give a number.
    /// Ours is smaller than the distance at which the robot stops in front of its goal.
    pub close_m: f64,
    /// Distance at which the robot stops in front of its goal, in metres (rule 2).
    pub stop_m: f64,
}

impl Default for Controlling {
    fn default() -> Self {
        Self {
            sensitivity: 200.0,
            range_m: 150.0 * INCH_M,
            attenuation: Attenuation::Product,
            normalization: 90_000.0,
            turn_rate_dps: 10.0,
            speed_mps: 25.0 * INCH_M,
            slow_mps: 5.0 * INCH_M,
            quick_turn_dps: 105.0,
            close_m: 24.0 * INCH_M,
            stop_m: 30.0 * INCH_M,
        }
    }
}

impl Controlling {
    /// Checks that all numbers are within their ranges. The logarithm in formula 4.26 needs a range of more than an inch.
    ///
    /// # Errors
    /// [`Error::Number`], which names the first number that is out of range.
    pub fn check(&self) -> Result<(), Error> {
        let Self { sensitivity, range_m, normalization, turn_rate_dps, speed_mps, .. } = *self;
        let Self { slow_mps, quick_turn_dps, close_m, stop_m, .. } = *self;
        numbers::above_0(&[
            ("normalization", normalization),
            ("speed_mps", speed_mps),
            ("turn_rate_dps", turn_rate_dps),
        ])?;
        if range_m <= 2.0 * INCH_M {
            return Err(Error::Number {
                what: "range_m".into(),
                expected: "above 0.0508 (2 inches)",
                found: range_m,
            });
        }
        numbers::from_0_on(&[
            ("sensitivity", sensitivity),
            ("range_m", range_m),
            ("slow_mps", slow_mps),
            ("quick_turn_dps", quick_turn_dps),
            ("close_m", close_m),
            ("stop_m", stop_m),
        ])
    }
}

/// Output of the reactive controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Avoidance {
    /// Strength of the avoidance, S₁.
    pub strength: f64,
    /// Direction to avoid, F₁, in radians from the front, positive to the left.
    pub direction_rad: f64,
}

/// A command to the robot.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Drive {
    /// Speed, in metres per second.
    pub speed_mps: f64,
    /// Turn rate, in radians per second, positive to the left.
    pub yaw_rate_radps: f64,
}

/// Returns the nearest range in each direction, from beams in any order. A range that is not finite or reaches the limit counts
/// as no return.
pub fn sectors(angles_rad: &[f64], ranges_m: &[f64], range_max_m: f64) -> Sectors {
    let mut sectors = [f64::INFINITY; DIRECTIONS as usize];
    for (angle, range) in angles_rad.iter().zip(ranges_m) {
        if range.is_finite() && (0.0..range_max_m).contains(range) {
            let sector = (angle / FRAC_PI_8).round().rem_euclid(f64::from(DIRECTIONS)) as usize;
            sectors[sector % sectors.len()] = sectors[sector % sectors.len()].min(*range);
        }
    }
    sectors
}

/// Computes the direction to avoid, by formula 4.26.
pub fn avoidance(sectors: &Sectors, settings: &Controlling) -> Avoidance {
    let range = settings.range_m / INCH_M;
    let (mut alpha, mut beta) = (0.0, 0.0);
    for (x, proximity) in sectors.iter().enumerate() {
        if *proximity < settings.range_m {
            let mu = settings.attenuation.mu(proximity / INCH_M, range);
            let force = settings.sensitivity / mu.exp() * WEIGHTS[usize::from(between(x as u8, 0))];
            let (sin, cos) = (x as f64 * FRAC_PI_8).sin_cos();
            alpha += force * cos;
            beta += force * sin;
        }
    }
    Avoidance { strength: alpha.hypot(beta), direction_rad: beta.atan2(alpha) }
}

/// Returns the nearest range of the front sensors, which are 0, 1, 2, 14 and 15 (rule 2).
pub fn front_m(sectors: &Sectors) -> f64 {
    [0, 1, 2, 14, 15].into_iter().map(|x| sectors[x]).fold(f64::INFINITY, f64::min)
}

/// Behaviour controller with the three cases of 4.7.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Behaviour {
    /// Direction in which the robot turns away from something very close: 1 for left, −1 for right, 0 for
    /// neither. The robot keeps turning to the same side until there is nothing close in front of it.
    escape: i8,
}

impl Behaviour {
    /// Fuses the command of the path controller with that of the reactive controller.
    pub fn fuse(&mut self, command: Command, sectors: &Sectors, settings: &Controlling) -> Drive {
        if command == Command::Stop {
            self.escape = 0;
            return Drive::default();
        }
        if front_m(sectors) < settings.close_m {
            // Case 3: the command of the path controller is ignored.
            if self.escape == 0 {
                self.escape =
                    if nearness(sectors, settings, 1) > nearness(sectors, settings, -1) { -1 } else { 1 };
            }
            let turn = settings.quick_turn_dps * f64::from(self.escape);
            return Drive { speed_mps: settings.slow_mps, yaw_rate_radps: turn.to_radians() };
        }
        self.escape = 0;
        // Case 2 is formula 4.27, which reduces to case 1 if S₁ = 0.
        let avoid = avoidance(sectors, settings);
        let away = -avoid.direction_rad.to_degrees();
        let fused = away * avoid.strength * (settings.range_m / INCH_M) / settings.normalization
            + command.value() * settings.turn_rate_dps;
        Drive { speed_mps: settings.speed_mps, yaw_rate_radps: fused.to_radians() }
    }
}

/// Returns the weighted nearness of obstacles on one side of the front half. `side` is 1 for left and −1 for right.
fn nearness(sectors: &Sectors, settings: &Controlling, side: i8) -> f64 {
    let near = (1..=4).map(|off| {
        let x = (i32::from(side) * off).rem_euclid(i32::from(DIRECTIONS)) as usize;
        (1.0 - sectors[x] / settings.range_m).max(0.0) * WEIGHTS[off as usize]
    });
    near.sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(inches: &[(usize, f64)]) -> Sectors {
        let mut sectors = [f64::INFINITY; 16];
        for (x, range) in inches {
            sectors[*x] = range * INCH_M;
        }
        sectors
    }

    const BOTH: [Attenuation; 2] = [Attenuation::Printed, Attenuation::Product];

    fn strength(attenuation: Attenuation, x: usize, inches: f64) -> f64 {
        avoidance(&ring(&[(x, inches)]), &Controlling { attenuation, ..Controlling::default() }).strength
    }

    fn turn(attenuation: Attenuation, command: Command, inches: &[(usize, f64)]) -> f64 {
        let settings = Controlling { attenuation, ..Controlling::default() };
        Behaviour::default().fuse(command, &ring(inches), &settings).yaw_rate_radps.to_degrees()
    }

    #[test]
    fn the_front_is_avoided_most_and_the_rear_never() {
        for (inches, of) in [20.0, 60.0, 149.0].into_iter().flat_map(|inches| BOTH.map(|of| (inches, of))) {
            let strength = |x, inches| strength(of, x, inches);
            for x in 0..8 {
                assert!(strength(x, inches) >= strength(x + 1, inches));
                assert!((strength(x, inches) - strength((16 - x) % 16, inches)).abs() < 1e-9);
            }
            assert_eq!(strength(8, inches), 0.0);
            assert_eq!(strength(6, inches), 0.0);
        }
    }

    #[test]
    fn what_is_nearer_is_avoided_more() {
        for (inches, of) in (0..149).flat_map(|inches| BOTH.map(|of| (f64::from(inches), of))) {
            assert!(strength(of, 1, inches) > strength(of, 1, inches + 1.0));
        }
        assert!(BOTH.iter().all(|of| strength(*of, 0, 150.0) == 0.0));
    }

    /// Checks formula 4.26 against a calculation by hand, with ln 149 = 5.003946.
    #[test]
    fn the_minus_of_formula_4_26_is_a_minus_or_a_product() {
        for (of, inches, mu) in [
            (Attenuation::Printed, 0.0, -5.003946 / 150.0),
            (Attenuation::Printed, 75.0, (75.0 - 5.003946) / 150.0),
            (Attenuation::Product, 0.0, 0.0),
            (Attenuation::Product, 75.0, 5.003946 / 2.0),
        ] {
            assert!((of.mu(inches, 150.0) - mu).abs() < 1e-6, "{of:?}, {inches}");
            assert!((strength(of, 0, inches) - 200.0 / mu.exp()).abs() < 1e-4);
        }
        // At the limit of the range: 200 / e^0.9666 and 200 / 149.
        assert!((strength(Attenuation::Printed, 0, 150.0 - 1e-9) - 76.07).abs() < 0.01);
        assert!((strength(Attenuation::Product, 0, 150.0 - 1e-9) - 200.0 / 149.0).abs() < 1e-6);
    }

    #[test]
    fn formula_4_27_by_hand() {
        // One object in direction 2 (45°), 75 inches away. As a product: 200 / 149^0.5 × 0.75 = 12.288; × 45 × 150 / 90000 =
        // 0.922. As printed: 200 / e^0.46664 × 0.75 = 94.066; × 0.075 = 7.055.
        for (of, expected) in [(Attenuation::Product, -0.92164), (Attenuation::Printed, -7.05494)] {
            assert!((turn(of, Command::Forward, &[(2, 75.0)]) - expected).abs() < 1e-4);
            assert!((turn(of, Command::Left, &[(2, 75.0)]) - expected - 10.0).abs() < 1e-4);
            assert!((turn(of, Command::Right, &[(14, 75.0)]) + expected + 10.0).abs() < 1e-4);
        }
    }

    #[test]
    fn the_three_cases_have_the_published_speeds() {
        let drive = |inches: &[(usize, f64)], command| {
            let drive = Behaviour::default().fuse(command, &ring(inches), &Controlling::default());
            (drive.speed_mps / INCH_M, drive.yaw_rate_radps.to_degrees().round())
        };
        assert_eq!(drive(&[], Command::Left), (25.0, 10.0));
        assert_eq!(drive(&[], Command::Forward), (25.0, 0.0));
        // With objects on both sides at equal distances, the robot prefers neither side.
        assert_eq!(drive(&[(4, 50.0), (12, 50.0)], Command::Forward), (25.0, 0.0));
        assert_eq!(drive(&[(1, 20.0)], Command::Left), (5.0, -105.0));
        assert_eq!(drive(&[(15, 20.0)], Command::Right), (5.0, 105.0));
        assert_eq!(drive(&[(15, 20.0)], Command::Stop), (0.0, 0.0));
        // An object next to the robot is not in its way.
        assert_eq!(drive(&[(4, 20.0)], Command::Forward).0, 25.0);
    }

    #[test]
    fn the_robot_keeps_to_the_side_to_which_it_escapes() {
        let (mut behaviour, settings) = (Behaviour::default(), Controlling::default());
        let first =
            behaviour.fuse(Command::Forward, &ring(&[(1, 20.0), (0, 20.0)]), &settings).yaw_rate_radps;
        let then =
            behaviour.fuse(Command::Forward, &ring(&[(15, 18.0), (0, 20.0)]), &settings).yaw_rate_radps;
        assert!(first < 0.0 && then == first);
        behaviour.fuse(Command::Forward, &ring(&[]), &settings);
        assert!(behaviour.fuse(Command::Forward, &ring(&[(15, 18.0)]), &settings).yaw_rate_radps > 0.0);
    }

    #[test]
    fn beams_fall_into_directions() {
        let angles: Vec<_> = (0..360).map(|i| f64::from(i - 180).to_radians()).collect();
        let mut ranges = vec![f64::INFINITY; 360];
        ranges[180 + 93] = 2.0;
        ranges[180 + 88] = 1.5;
        ranges[5] = 9.0;
        let sectors = sectors(&angles, &ranges, 8.0);
        assert_eq!(sectors[4], 1.5);
        assert!(sectors[8].is_infinite());
    }
}

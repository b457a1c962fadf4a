//! Finds objects and their spatial relations with a ring of range sensors (Chronis 2007, 4.4 and 4.5).
//!
//! Each return becomes a trapezoid along the axis of its beam, with its small base at the measured range.
//! Adjacent returns form one object if the robot does not fit between them. Each object has a direction or a
//! surround relation, a proximity and a width. The ring may have any number of sensors at any angles, as long
//! as they are ordered around the robot. The many beams of a laser are first reduced to sixteen by
//! [`crate::control::sectors`]. After the first reading, nothing is allocated.

use std::f64::consts::{FRAC_PI_8, PI, TAU};

use serde::{Deserialize, Serialize};
use sketchnav_qualitative::Point;
use sketchnav_qualitative::hof::{Force, Pair, Polygon, Workspace};
use sketchnav_schemas::geometry::wrap_angle;

use crate::error::Error;
use crate::extraction::track::{HISTOGRAM, place};
use crate::numbers;
use crate::route::{INCH_M, Place};

/// Parameters of perception.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Perceiving {
    /// Diameter of the robot, in metres (20 inches for the Nomad), from the robot file rather than a key of the mission.
    #[serde(skip)]
    pub robot_m: f64,
    /// Distance of the sensors from the robot's centre, in metres, from the robot file. The Nomad's sensors are on its rim.
    #[serde(skip)]
    pub ring_m: f64,
    /// Minimum range that counts as no return, in metres, from the robot file: 255 inches for the Nomad (4.2).
    #[serde(skip)]
    pub range_max_m: f64,
    /// Factor applied to the angle between adjacent returns before their distance is computed. Chronis 2007 uses c = 24 with 16
    /// sensors, which gives clearance: 16 / 24 (4.4).
    pub joining: f64,
    /// Thickness of an object, in metres: "a constant arbitrary thickness" (4.4). Our default is the robot's diameter.
    pub thickness_m: f64,
}

impl Default for Perceiving {
    fn default() -> Self {
        Self {
            robot_m: 20.0 * INCH_M,
            ring_m: 10.0 * INCH_M,
            range_max_m: 255.0 * INCH_M,
            joining: 16.0 / 24.0,
            thickness_m: 20.0 * INCH_M,
        }
    }
}

impl Perceiving {
    /// Checks that all numbers are within their ranges.
    ///
    /// # Errors
    /// [`Error::Number`], which names the first number that is out of range.
    pub fn check(&self) -> Result<(), Error> {
        let Self { robot_m, ring_m, range_max_m, joining, thickness_m } = *self;
        numbers::above_0(&[
            ("robot_m", robot_m),
            ("ring_m", ring_m),
            ("range_max_m", range_max_m),
            ("joining", joining),
            ("thickness_m", thickness_m),
        ])
    }
}

/// An object as the robot sees it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Seen {
    /// Direction or surround relation of the object.
    pub place: Place,
    /// Mean of the object's ranges, in metres (4.5.3).
    pub proximity_m: f64,
    /// Width of the object's histogram of constant forces, from 0 to 180 (4.5.4).
    pub width: f64,
    /// Index of the object's first beam, counter-clockwise, and the number of its beams.
    pub beams: [u16; 2],
    /// Index of the landmark that the object has been recognized as ([`crate::labels`]), or `None` if it has not been recognized.
    pub landmark: Option<usize>,
}

/// Finds the objects around a ring of range sensors.
#[derive(Debug, Clone)]
pub struct Perception {
    settings: Perceiving,
    /// Directions of the beams, in radians counter-clockwise from the front.
    angles_rad: Vec<f64>,
    robot: Polygon,
    object: Polygon,
    outline: Vec<Point>,
    pair: Pair,
    workspace: Workspace,
    forces: [Vec<Force>; 2],
    seen: Vec<Seen>,
}

impl Perception {
    /// Creates a ring from the directions of its beams, in radians counter-clockwise from the front, in order around the robot.
    ///
    /// # Errors
    /// - [`Error::Sensor`] if there are fewer than eight beams, if they do not go around exactly once, or if a gap between
    ///   neighbours exceeds a right angle;
    /// - [`Error::Number`] if a parameter is out of range.
    pub fn new(settings: Perceiving, angles_rad: &[f64]) -> Result<Self, Error> {
        let expected = "range sensors all around the robot";
        let wrong = |found: String| Err(Error::Sensor { expected, found });
        let count = angles_rad.len();
        if !(8..=10_000).contains(&count) {
            return wrong(format!("{count} beams"));
        }
        let gaps: Vec<_> = (0..count).map(|i| gap(angles_rad, i)).collect();
        if let Some(i) = gaps.iter().position(|gap| !(1e-6..=PI / 2.0).contains(gap)) {
            return wrong(format!("a gap of {:.0}° after beam {i}", gaps[i].to_degrees()));
        }
        if (gaps.iter().sum::<f64>() - TAU).abs() > 1e-3 {
            return wrong("beams that go around more than once".into());
        }
        settings.check()?;
        let robot = square(settings.robot_m)?;
        Ok(Self {
            pair: Pair::new(&robot, &robot),
            object: robot.clone(),
            robot,
            outline: Vec::with_capacity(4 * count + 4),
            workspace: Workspace::default(),
            forces: [vec![Force::ZERO; HISTOGRAM], vec![Force::ZERO; HISTOGRAM]],
            seen: Vec::with_capacity(count),
            angles_rad: angles_rad.to_vec(),
            settings,
        })
    }

    /// Creates the ring of a Nomad, which has 16 sensors, the first of them in front.
    ///
    /// # Errors
    /// See [`Self::new`].
    pub fn nomad(settings: Perceiving) -> Result<Self, Error> {
        Self::new(settings, &std::array::from_fn::<_, 16, _>(|i| i as f64 * FRAC_PI_8))
    }

    /// Returns the directions of the beams, in radians counter-clockwise from the front.
    pub fn angles_rad(&self) -> &[f64] {
        &self.angles_rad
    }

    /// Returns the parameters.
    pub const fn settings(&self) -> &Perceiving {
        &self.settings
    }

    /// Returns the objects found by the last call of [`Self::see`].
    pub fn last_seen(&self) -> &[Seen] {
        &self.seen
    }

    /// Returns the histograms of constant and of gravitational forces of the object found last, counter-clockwise from ahead. If
    /// only one object is in range, they are the histograms of that object.
    pub fn histograms(&self) -> [&[Force]; 2] {
        [&self.forces[0], &self.forces[1]]
    }

    /// Finds the objects in a reading, which contains one range per beam, in metres from the sensors. A range that is not finite or
    /// reaches the limit counts as no return.
    ///
    /// # Errors
    /// [`Error::Sensor`] if the number of ranges differs from that of the beams.
    pub fn see(&mut self, ranges_m: &[f64]) -> Result<&[Seen], Error> {
        let count = self.angles_rad.len();
        if ranges_m.len() != count {
            let found = format!("{}", ranges_m.len());
            return Err(Error::Sensor { expected: "as many ranges as beams", found });
        }
        self.seen.clear();
        let is_joint = |i: usize| self.joins(ranges_m, i);
        // Begin at the end of an object, so that no object is split in two.
        let Some(first) = (0..count).find(|i| !is_joint((i + count - 1) % count)) else {
            self.add(ranges_m, 0, count);
            return Ok(&self.seen);
        };
        let mut begin = 0;
        while begin < count {
            let at = |i: usize| (first + i) % count;
            let mut length = 1;
            while begin + length < count && self.joins(ranges_m, at(begin + length - 1)) {
                length += 1;
            }
            if self.is_return(ranges_m[at(begin)]) {
                self.add(ranges_m, at(begin), length);
            }
            begin += length;
        }
        Ok(&self.seen)
    }

    fn is_return(&self, range_m: f64) -> bool {
        range_m.is_finite() && (0.0..self.settings.range_max_m).contains(&range_m)
    }

    /// Returns true if the returns of a beam and of the next one are of the same object, which is the case if the robot does not
    /// fit between them. Their distance is √(s₁² + s₂² − 2 s₁ s₂ cos(2π/c)) (4.4).
    fn joins(&self, ranges_m: &[f64], i: usize) -> bool {
        let (one, other) = (ranges_m[i], ranges_m[(i + 1) % ranges_m.len()]);
        let angle = gap(&self.angles_rad, i) * self.settings.joining;
        let square = one * one + other * other - 2.0 * one * other * angle.cos();
        self.is_return(one) && self.is_return(other) && square < self.settings.robot_m * self.settings.robot_m
    }

    /// Adds the object of `length` beams, starting with beam `first`.
    fn add(&mut self, ranges_m: &[f64], first: usize, length: usize) {
        let count = ranges_m.len();
        let beams = || (0..length).map(|i| (first + i) % count);
        let proximity_m = beams().map(|beam| ranges_m[beam]).sum::<f64>() / length as f64;
        self.outline.clear();
        for beam in beams() {
            self.outline.extend(self.base(ranges_m, beam, 0.0));
        }
        for beam in beams().rev() {
            let [right, left] = self.base(ranges_m, beam, self.settings.thickness_m);
            self.outline.extend([left, right]);
        }
        if self.object.replace(self.outline.iter().copied()).is_err() {
            return;
        }
        self.pair.prepare(&self.object, &self.robot);
        for (exponent, forces) in [0.0, 2.0].into_iter().zip(&mut self.forces) {
            // Neither exponent is out of range, so this cannot fail.
            let _ = self.pair.histogram_into(exponent, forces, &mut self.workspace);
        }
        if let Some((place, width)) = place(&self.forces[0], &self.forces[1], 0.0) {
            let beams = [first as u16, length as u16];
            self.seen.push(Seen { place, proximity_m, width, beams, landmark: None });
        }
    }

    /// Returns the right and the left end of one base of a beam's trapezoid. The base lies `beyond` metres behind the beam's
    /// return, and extends half-way to the axes of the neighbouring beams.
    fn base(&self, ranges_m: &[f64], beam: usize, beyond: f64) -> [Point; 2] {
        let count = self.angles_rad.len();
        let axis = self.angles_rad[beam];
        let along = self.settings.ring_m + ranges_m[beam] + beyond;
        let (sin, cos) = axis.sin_cos();
        let sides = [-gap(&self.angles_rad, (beam + count - 1) % count), gap(&self.angles_rad, beam)];
        sides.map(|side| {
            let across = along * (side / 2.0).tan();
            // Sums of a range and a diameter are finite, so this cannot fail.
            Point::new(along * cos - across * sin, along * sin + across * cos)
                .unwrap_or_else(|_| self.robot.corners()[0])
        })
    }
}

/// Returns the angle from a beam to the next one, from 0 to 2π.
fn gap(angles_rad: &[f64], i: usize) -> f64 {
    let next = angles_rad[(i + 1) % angles_rad.len()];
    wrap_angle(next - angles_rad[i]).rem_euclid(TAU)
}

fn square(side: f64) -> Result<Polygon, Error> {
    let half = side / 2.0;
    let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
    let corners = corners.into_iter().map(Point::try_from).collect::<Result<Vec<_>, _>>();
    corners.and_then(Polygon::new).map_err(|_| Error::Number {
        what: "robot_m".into(),
        expected: "a number above 0",
        found: side,
    })
}

#[cfg(test)]
mod tests {
    use sketchnav_qualitative::hof::Surround;

    use super::*;

    const NONE: f64 = 255.0 * INCH_M;

    fn see(inches: &[(usize, f64)]) -> Vec<Seen> {
        let mut ranges = [NONE; 16];
        for (beam, range) in inches {
            ranges[*beam] = range * INCH_M;
        }
        Perception::nomad(Perceiving::default()).unwrap().see(&ranges).unwrap().to_vec()
    }

    fn directions(seen: &[Seen]) -> Vec<u8> {
        seen.iter().filter_map(|seen| seen.place.direction()).collect()
    }

    #[test]
    fn a_return_is_an_object_in_the_direction_of_its_beam() {
        for beam in 0..16 {
            let seen = see(&[(beam, 60.0)]);
            assert_eq!(directions(&seen), [beam as u8]);
            assert!((seen[0].proximity_m - 60.0 * INCH_M).abs() < 1e-12);
        }
        assert_eq!(see(&[]), []);
    }

    #[test]
    fn adjacent_returns_are_one_object_where_the_robot_does_not_fit() {
        // Chronis 2007, figures 4.13 and 4.14: with c = 24, two equal returns are 2 s sin(π/24) apart, which equals the robot's
        // 20 inches at 76.6 inches.
        assert_eq!(see(&[(15, 76.0), (0, 76.0), (1, 76.0)]).len(), 1);
        assert_eq!(directions(&see(&[(15, 77.0), (0, 77.0), (1, 77.0)])), [0, 1, 15]);
        // A step in depth separates two objects.
        assert_eq!(see(&[(3, 40.0), (4, 62.0)]).len(), 2);
        let one = see(&[(2, 40.0), (3, 50.0), (4, 45.0)]);
        assert_eq!((directions(&one), one[0].beams), (vec![3], [2, 3]));
        assert!((one[0].proximity_m - 45.0 * INCH_M).abs() < 1e-12);
    }

    #[test]
    fn an_object_across_the_first_beam_is_not_cut_in_two() {
        let seen = see(&[(14, 40.0), (15, 38.0), (0, 37.0), (1, 38.0), (2, 40.0)]);
        assert_eq!(directions(&seen), [0]);
        assert_eq!(seen[0].beams, [14, 5]);
    }

    #[test]
    fn what_is_wider_or_nearer_has_a_wider_histogram() {
        let width = |inches: &[(usize, f64)]| see(inches)[0].width;
        let narrow = width(&[(0, 60.0)]);
        assert!(width(&[(0, 30.0)]) > narrow);
        assert!(width(&[(0, 60.0), (1, 60.0)]) > narrow);
        assert!(width(&[(15, 60.0), (0, 60.0), (1, 60.0)]) > width(&[(0, 60.0), (1, 60.0)]));
    }

    #[test]
    fn what_is_all_around_surrounds() {
        let around: Vec<_> = (0..16).map(|beam| (beam, 30.0)).collect();
        let seen = see(&around);
        assert_eq!(seen[0].place, Place::Surrounds(Surround::Completely));
        assert_eq!(seen[0].width, 180.0);
        // Chronis 2007, figure 4.19: there is an opening behind on the right.
        let open: Vec<_> = (0..16).filter(|beam| !(9..=11).contains(beam)).map(|beam| (beam, 25.0)).collect();
        assert_eq!(see(&open)[0].place, Place::Surrounds(Surround::OpeningAt(10)));
    }

    #[test]
    fn rings_that_do_not_go_around_are_rejected() {
        let new = |angles: &[f64]| Perception::new(Perceiving::default(), angles).unwrap_err().to_string();
        let front: Vec<_> = (0..180).map(|i| f64::from(i - 90).to_radians()).collect();
        assert!(new(&front).contains("a gap of 181° after beam 179"), "{}", new(&front));
        assert!(new(&[0.0, 1.0, 2.0]).contains("3 beams"));
        let mut perception = Perception::nomad(Perceiving::default()).unwrap();
        assert!(perception.see(&[1.0; 15]).is_err());
        assert_eq!(perception.see(&[f64::NAN; 16]).unwrap(), []);
    }
}

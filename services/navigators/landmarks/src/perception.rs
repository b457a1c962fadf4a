//! Perception: objects and their spatial relations by a ring of range sensors (Chronis 2007, 4.4 and 4.5).
//!
//! Each return is a trapezoid on the axis of its beam, its small base at the range. Adjacent returns between which the
//! robot does not fit are one object. Each object has its direction or surround relation, its proximity and its width.
//! Nothing is allocated once the ring was seen. It takes any number of sensors, in any order of angles that goes
//! around. Of the many beams of a laser, [`crate::control::sectors`] makes sixteen of them.

use std::f64::consts::{FRAC_PI_8, PI, TAU};

use serde::{Deserialize, Serialize};
use sketchnav_qualitative::Point;
use sketchnav_qualitative::hof::{Force, Pair, Polygon, Workspace};
use sketchnav_schemas::geometry::wrap_angle;

use crate::error::Error;
use crate::extraction::track::{HISTOGRAM, place};
use crate::numbers;
use crate::route::{INCH_M, Place};

/// How the robot perceives.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Perceiving {
    /// The diameter of the robot, in metres: the Nomad's 20 inches. The robot's own: no key of a mission.
    #[serde(skip)]
    pub robot_m: f64,
    /// How far the sensors are from the robot's centre, in metres. The Nomad's are on its rim. The robot's own.
    #[serde(skip)]
    pub ring_m: f64,
    /// Ranges from here on are no returns, in metres: 255 inches (4.2). The robot's own.
    #[serde(skip)]
    pub range_max_m: f64,
    /// The angle between adjacent returns is taken to be so many times smaller than it is. Chronis 2007 uses c = 24 with 16
    /// sensors, which gives clearance: 16 / 24 (4.4).
    pub joining: f64,
    /// How thick an object is, in metres: "a constant arbitrary thickness" (4.4). Ours: the robot's diameter.
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
    /// `Ok` where all numbers are in their ranges.
    ///
    /// # Errors
    /// [`Error::Number`] with the key.
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
    /// Where it is.
    pub place: Place,
    /// The mean of its ranges, in metres (4.5.3).
    pub proximity_m: f64,
    /// The width of its histogram of constant forces, from 0 to 180 (4.5.4).
    pub width: f64,
    /// The first of its beams, counter-clockwise, and how many there are.
    pub beams: [u16; 2],
}

/// A ring of range sensors, and what it sees.
#[derive(Debug, Clone)]
pub struct Perception {
    settings: Perceiving,
    /// Where the beams point, counter-clockwise from the front.
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
    /// A ring by the angles of its beams, in radians from the front, counter-clockwise, from one neighbour to the next.
    ///
    /// # Errors
    /// [`Error::Sensor`] where there are fewer than eight beams, or angles do not go around once. It is also given for
    /// a gap above a right angle between neighbours. [`Error::Number`].
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

    /// The Nomad's ring: 16 sensors, the first one in front.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn nomad(settings: Perceiving) -> Result<Self, Error> {
        Self::new(settings, &std::array::from_fn::<_, 16, _>(|i| i as f64 * FRAC_PI_8))
    }

    /// Where the beams point.
    pub fn angles_rad(&self) -> &[f64] {
        &self.angles_rad
    }

    /// How it perceives.
    pub const fn settings(&self) -> &Perceiving {
        &self.settings
    }

    /// What was seen last.
    pub fn last_seen(&self) -> &[Seen] {
        &self.seen
    }

    /// The histograms of constant and of gravitational forces of the object that was seen last, counter-clockwise from
    /// ahead. Where one object alone is in range, they are its.
    pub fn histograms(&self) -> [&[Force]; 2] {
        [&self.forces[0], &self.forces[1]]
    }

    /// What is seen by these ranges, one for each beam, in metres from the sensor. A range that is not finite, or not
    /// below the greatest one, is no return.
    ///
    /// # Errors
    /// [`Error::Sensor`] where the number of ranges is not that of the beams.
    pub fn see(&mut self, ranges_m: &[f64]) -> Result<&[Seen], Error> {
        let count = self.angles_rad.len();
        if ranges_m.len() != count {
            let found = format!("{}", ranges_m.len());
            return Err(Error::Sensor { expected: "as many ranges as beams", found });
        }
        self.seen.clear();
        let is_joint = |i: usize| self.joins(ranges_m, i);
        // Begin where an object ends, so that none is cut in two.
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

    /// Whether the return of a beam and the next one are of one object: the robot does not fit between them. Their
    /// distance is √(s₁² + s₂² − 2 s₁ s₂ cos(2π/c)) (4.4).
    fn joins(&self, ranges_m: &[f64], i: usize) -> bool {
        let (one, other) = (ranges_m[i], ranges_m[(i + 1) % ranges_m.len()]);
        let angle = gap(&self.angles_rad, i) * self.settings.joining;
        let square = one * one + other * other - 2.0 * one * other * angle.cos();
        self.is_return(one) && self.is_return(other) && square < self.settings.robot_m * self.settings.robot_m
    }

    /// Adds the object of so many beams from one on.
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
            // Both exponents are in their range.
            let _ = self.pair.histogram_into(exponent, forces, &mut self.workspace);
        }
        if let Some((place, width)) = place(&self.forces[0], &self.forces[1], 0.0) {
            self.seen.push(Seen { place, proximity_m, width, beams: [first as u16, length as u16] });
        }
    }

    /// The ends of a base of the trapezoid of a beam, right and left. They lie at its range and so much beyond, up to
    /// half-way to the neighbours' axes.
    fn base(&self, ranges_m: &[f64], beam: usize, beyond: f64) -> [Point; 2] {
        let count = self.angles_rad.len();
        let axis = self.angles_rad[beam];
        let along = self.settings.ring_m + ranges_m[beam] + beyond;
        let (sin, cos) = axis.sin_cos();
        let sides = [-gap(&self.angles_rad, (beam + count - 1) % count), gap(&self.angles_rad, beam)];
        sides.map(|side| {
            let across = along * (side / 2.0).tan();
            // Numbers of at most a range and a diameter are finite.
            Point::new(along * cos - across * sin, along * sin + across * cos)
                .unwrap_or_else(|_| self.robot.corners()[0])
        })
    }
}

/// The angle from a beam to the next one, from 0 to 2π.
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
        // Chronis 2007, figures 4.13 and 4.14: with c = 24 two equal returns are 2 s sin(π/24) apart, which is the robot's
        // 20 inches at 76.6 inches.
        assert_eq!(see(&[(15, 76.0), (0, 76.0), (1, 76.0)]).len(), 1);
        assert_eq!(directions(&see(&[(15, 77.0), (0, 77.0), (1, 77.0)])), [0, 1, 15]);
        // A step in depth parts them.
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
        // Chronis 2007, figure 4.19: an opening behind on the right.
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

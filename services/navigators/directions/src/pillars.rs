//! Finds landmarks on land in a laser scan. The landmarks are upright cylinders of a known radius.
//!
//! Neighbouring returns at similar ranges form one object. If the object is as wide as a landmark, and everything on either side
//! of it is farther away, a circle with the landmark's radius is fitted to it by the Gauss-Newton method. If a straight line
//! fits better, the object is flat.
//!
//! An object next to a nearer one is ignored, although it may be a partly hidden landmark, because in a building it is usually a
//! part of a wall seen through a gap. The map-maker makes the same assumption ([`crate::sight`]).

use arrayvec::ArrayVec;
use sketchnav_schemas::geometry::{Base, Pose};
use sketchnav_schemas::message::{LaserScan, MAX_BEAMS, MAX_DOTS};

use crate::geometry::Point;
use crate::sight::half_angle_rad;

/// Minimum number of returns from a landmark.
const LEAST_RETURNS: usize = 3;
/// Maximum number of consecutive lost beams within an object.
const MOST_LOST: usize = 2;
/// Number of iterations of a fit.
const STEPS: usize = 6;
/// Damping of a fit. It prevents a fit to a short arc from drifting along the arc.
const DAMPING: f64 = 0.02;
/// Minimum and maximum apparent width of a landmark, as multiples of its true width. One beam more or less is allowed as well.
const NARROWEST: f64 = 0.7;
const WIDEST: f64 = 1.25;
/// Maximum margin by which a line may fit better than a circle, as a sum of squares in variances of a range. It is above 0 because
/// a landmark at the end of the robot's range has few returns, and a line occasionally fits them better by chance.
const FLAT: f64 = 6.0;
/// Largest misfit of a circle in standard deviations of the misfit, and additional misfit as a share of the radius.
const MISFIT: f64 = 3.0;
const OUT_OF_ROUND: f64 = 0.05;

/// The properties of the landmarks and of the laser.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finder {
    /// Radius of a landmark, in metres.
    pub radius_m: f64,
    /// Maximum distance of a landmark, in metres.
    pub range_m: f64,
    /// Standard deviation of a range at that distance, in metres.
    pub noise_m: f64,
    /// Pose of the laser on the robot.
    pub mount: Pose<Base>,
}

/// A return, as the number of its beam and its range in metres.
type Return = (usize, f64);

impl Finder {
    /// Returns the positions of the landmarks in a scan, in the robot's axes.
    pub fn find(&self, scan: &LaserScan) -> ArrayVec<Point, MAX_DOTS> {
        let returns = self.returns(scan);
        let mut found = ArrayVec::new();
        // A full turn has no beginning, so the search starts where an object ends.
        let Some(first) = (0..returns.len()).find(|&at| !self.joins(&returns, at, scan)) else {
            return found;
        };
        let mut begin = first + 1;
        for at in first + 1..=first + returns.len() {
            if self.joins(&returns, at % returns.len(), scan) {
                continue;
            }
            if let Some(place) = self.landmark(&returns, begin, at, scan) {
                // Landmarks beyond the capacity are left out.
                let _ = found.try_push(place);
            }
            begin = at + 1;
        }
        found
    }

    fn returns(&self, scan: &LaserScan) -> ArrayVec<Return, MAX_BEAMS> {
        let ranges = scan.ranges().iter().enumerate();
        ranges
            .map(|(beam, range)| (beam, f64::from(*range)))
            .filter(|(_, range)| range.is_finite() && *range > 0.0)
            .collect()
    }

    /// Returns the maximum difference in range between two neighbouring returns from the same object, in metres.
    pub fn jump_m(&self) -> f64 {
        2.0 * self.radius_m + 4.0 * self.noise_m
    }

    /// Returns true if a return and the next one, cyclically, belong to the same object.
    fn joins(&self, returns: &[Return], at: usize, scan: &LaserScan) -> bool {
        let (beam, range) = returns[at];
        let (next, next_range) = returns[(at + 1) % returns.len()];
        let lost = (next + scan.beam_count as usize - beam) % scan.beam_count.max(1) as usize;
        lost <= MOST_LOST + 1 && (range - next_range).abs() <= self.jump_m()
    }

    /// Returns the position of the landmark from which these returns come, or `None` if they don't come from one.
    fn landmark(&self, returns: &[Return], begin: usize, end: usize, scan: &LaserScan) -> Option<Point> {
        let at = |index: usize| returns[index % returns.len()];
        let count = end + 1 - begin;
        if !(LEAST_RETURNS..=returns.len()).contains(&count) {
            return None;
        }
        let increment_rad = f64::from(scan.angle_increment_rad);
        let beams =
            (at(end).0 + scan.beam_count as usize - at(begin).0) % scan.beam_count.max(1) as usize + 1;
        let nearest = (begin..=end).map(|index| at(index).1).fold(f64::INFINITY, f64::min);
        let shown_rad = beams as f64 * increment_rad;
        let whole_rad = 2.0 * half_angle_rad(self.radius_m, nearest + self.radius_m);
        if shown_rad > WIDEST * whole_rad + increment_rad || shown_rad < NARROWEST * whole_rad - increment_rad
        {
            return None;
        }
        let hides = |other: usize, own: usize| {
            let (beam, range) = at(other);
            let off = beam.abs_diff(at(own).0);
            let off = off.min(scan.beam_count as usize - off);
            off <= MOST_LOST + 1 && range < at(own).1
        };
        if hides(begin + returns.len() - 1, begin) || hides(end + 1, end) {
            return None;
        }
        let place = |index: usize| {
            let (beam, range) = at(index);
            let bearing = f64::from(scan.angle_min_rad) + beam as f64 * increment_rad;
            Point::new(range, 0.0).turned(bearing)
        };
        let centre = self.fit(count, |index| place(begin + index))?;
        (centre.norm() <= self.range_m)
            .then(|| centre.turned(self.mount.yaw_rad) + Point::new(self.mount.x, self.mount.y))
    }

    /// Fits a circle with the landmark's radius to points that are seen from the origin. Returns its centre, or `None` if the
    /// points don't lie on such a circle, or a straight line fits better.
    fn fit(&self, count: usize, place: impl Fn(usize) -> Point) -> Option<Point> {
        let n = count as f64;
        let mean = (0..count).fold(Point::default(), |sum, index| sum + place(index)) * (1.0 / n);
        // Half of the circle is visible, and the mean of its points lies this far in front of the centre.
        let mut centre = mean + mean.direction()? * (self.radius_m * std::f64::consts::FRAC_PI_4);
        let mut squares = 0.0;
        for _ in 0..STEPS {
            let (mut xx, mut xy, mut yy) = (DAMPING * n, 0.0, DAMPING * n);
            let mut slope = Point::default();
            squares = 0.0;
            for index in 0..count {
                let off = centre - place(index);
                let (residual, along) = (off.norm() - self.radius_m, off.direction()?);
                (xx, xy, yy) = (xx + along.x * along.x, xy + along.x * along.y, yy + along.y * along.y);
                slope = slope + along * residual;
                squares += residual * residual;
            }
            let determinant = xx * yy - xy * xy;
            let step =
                Point::new(yy * slope.x - xy * slope.y, xx * slope.y - xy * slope.x) * (1.0 / determinant);
            centre = centre - step;
        }
        let spread = 1.0 + MISFIT / (2.0 * n).sqrt();
        let is_round = (squares / n).sqrt() <= self.noise_m * spread + OUT_OF_ROUND * self.radius_m;
        let is_flat = || squares - off_line(count, mean, &place) > FLAT * self.noise_m * self.noise_m;
        (is_round && !is_flat()).then_some(centre)
    }
}

/// Returns the sum of the squared distances of points from the straight line that fits them best, which leads through their mean.
fn off_line(count: usize, mean: Point, place: impl Fn(usize) -> Point) -> f64 {
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for off in (0..count).map(|index| place(index) - mean) {
        (xx, xy, yy) = (xx + off.x * off.x, xy + off.x * off.y, yy + off.y * off.y);
    }
    // The smaller eigenvalue of the scatter matrix.
    (xx + yy - ((xx - yy) * (xx - yy) + 4.0 * xy * xy).sqrt()) / 2.0
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;
    use rand_distr::{Distribution, Normal};
    use sketchnav_schemas::seed::stream;

    use super::*;

    const RADIUS_M: f64 = 0.15;

    fn finder(noise_m: f64) -> Finder {
        Finder { radius_m: RADIUS_M, range_m: 8.0, noise_m, mount: Pose::new(0.0, 0.0, 0.0) }
    }

    /// Returns a scan of cylinders in front of a wall, which lies north of all of them.
    fn scan(landmarks: &[Point], wall_m: f64, noise_m: f64, seed: u64) -> Box<LaserScan> {
        let mut scan: Box<LaserScan> = Box::new(Zeroable::zeroed());
        scan.beam_count = 900;
        scan.angle_min_rad = -std::f32::consts::PI;
        scan.angle_increment_rad = std::f32::consts::TAU / 900.0;
        let (mut rng, normal) = (stream(seed, "laser"), Normal::new(0.0, noise_m).unwrap());
        for beam in 0..900 {
            let way = Point::new(1.0, 0.0)
                .turned(f64::from(scan.angle_min_rad) + beam as f64 * f64::from(scan.angle_increment_rad));
            let hit = |place: &Point| {
                let (along, aside) = (place.dot(way), place.x * way.y - place.y * way.x);
                let half = (RADIUS_M * RADIUS_M - aside * aside).max(0.0).sqrt();
                if along > 0.0 && half > 0.0 { along - half } else { f64::INFINITY }
            };
            let wall = if way.y > 0.0 { wall_m / way.y } else { f64::INFINITY };
            let range = landmarks.iter().map(hit).fold(wall, f64::min);
            let range = if range < 10.0 { range + normal.sample(&mut rng) } else { f64::INFINITY };
            scan.ranges_m[beam] = range as f32;
        }
        scan
    }

    fn nearest(found: &[Point], place: Point) -> f64 {
        found.iter().map(|other| (*other - place).norm()).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn landmarks_are_found_where_they_are_and_a_wall_is_none() {
        // One of them lies behind the robot, where the scan begins and ends.
        let landmarks =
            [(2.0, 1.0), (-6.5, 0.0), (0.0, -0.9), (5.0, -4.0), (0.4, 3.0)].map(|(x, y)| Point::new(x, y));
        for seed in 0..20 {
            let found = finder(0.03).find(&scan(&landmarks, 4.0, 0.03, seed));
            assert_eq!(found.len(), landmarks.len(), "{found:?}");
            for place in landmarks {
                assert!(nearest(&found, place) < 0.12, "{place:?} {found:?}");
            }
        }
    }

    #[test]
    fn what_is_hidden_even_in_part_is_not_found() {
        let hidden = [Point::new(2.0, 0.0), Point::new(5.0, 0.0)];
        assert_eq!(finder(0.01).find(&scan(&hidden, 50.0, 0.01, 1)).len(), 1);
        let partly = [Point::new(2.0, 0.16), Point::new(5.0, 0.0)];
        assert_eq!(finder(0.01).find(&scan(&partly, 50.0, 0.01, 1)).len(), 1);
        let beside = [Point::new(2.0, 0.26), Point::new(5.0, 0.0)];
        let found = finder(0.01).find(&scan(&beside, 50.0, 0.01, 1));
        assert_eq!(found.len(), 2);
        assert!(nearest(&found, beside[1]) < 0.1, "{found:?}");
        // Between a landmark and the edge of another, a wall appears as narrow as a landmark.
        let slit = [Point::new(2.0, 0.22), Point::new(2.0, -0.22)];
        let turned: Vec<_> = slit.iter().map(|place| place.turned(std::f64::consts::FRAC_PI_2)).collect();
        assert_eq!(finder(0.01).find(&scan(&turned, 6.0, 0.01, 1)).len(), 2);
    }

    /// The front of a box, and a thicker column.
    #[test]
    fn what_is_as_wide_as_a_landmark_but_not_round_is_none() {
        let at = |beam: usize| std::f64::consts::TAU * (beam as f64 / 900.0 - 0.5);
        let front = |beam: usize| {
            let angle = at(beam);
            (angle.cos() > 0.0 && (3.0 * angle.tan()).abs() < 0.15).then(|| 3.0 / angle.cos())
        };
        let column = |beam: usize| {
            let (along, aside) = (3.0 * at(beam).cos(), 3.0 * at(beam).sin());
            (along > 0.0 && aside.abs() < 0.3).then(|| along - (0.09 - aside * aside).sqrt())
        };
        for object in [&front as &dyn Fn(usize) -> Option<f64>, &column] {
            let mut scan = scan(&[], 50.0, 0.01, 1);
            for beam in 0..900 {
                if let Some(range) = object(beam) {
                    scan.ranges_m[beam] = range as f32;
                }
            }
            assert!(finder(0.01).find(&scan).is_empty());
        }
    }

    #[test]
    fn the_laser_s_place_on_the_robot_counts() {
        let mounted = Finder { mount: Pose::new(0.2, 0.0, std::f64::consts::PI), ..finder(0.0) };
        let found = mounted.find(&scan(&[Point::new(2.0, 1.0)], 50.0, 0.0, 1));
        assert!(nearest(&found, Point::new(-1.8, -1.0)) < 0.02, "{found:?}");
    }

    #[test]
    fn nothing_is_found_in_an_empty_scan() {
        assert!(finder(0.03).find(&scan(&[], 50.0, 0.0, 1)).is_empty());
        assert!(finder(0.03).find(&LaserScan::zeroed()).is_empty());
    }
}

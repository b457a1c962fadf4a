//! Positions where a lost robot may be, offered to a person to choose from: is it at this crossing, or at the next one?
//!
//! When the observations no longer fit the sketch, the hypotheses of the [`crate::belief`] have usually gathered around one
//! position, which is the wrong one. The robot's remembered surroundings are therefore compared with the sketch at all positions
//! around the estimated one, using the likelihoods of the belief. The heading is kept, because odometry knows it far better than
//! the position.

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use sketchnav_schemas::geometry::{Base, Point};

use crate::belief::{Beam, Believing, Estimate};
use crate::drawn::{Drawn, DrawnMetres};
use crate::hypothesis::{Hypothesis, PROBE_M, Within};
use crate::outlines::Outlines;

/// Maximum number of positions that are offered.
pub const MOST: usize = 4;
/// Spacing of the positions that are compared, along each axis.
const STEP: DrawnMetres = DrawnMetres(0.4);
/// Minimum distance between two positions that are offered.
const APART: DrawnMetres = DrawnMetres(2.0);
/// Standard deviation of the robot's distance from the estimated position: as a share of the distance driven along the route, and
/// its lower and upper limit. The upper limit bounds the time that the comparison takes.
const ASTRAY_SHARE: f64 = 0.25;
const ASTRAY: [DrawnMetres; 2] = [DrawnMetres(2.0), DrawnMetres(8.0)];
/// Maximum distance from the estimated position at which positions are compared, in standard deviations.
const REACH: f64 = 2.5;
/// Number of independent observations that a remembered echo counts as. Unlike the echoes of successive steps, remembered echoes
/// come from different spots, but several of them come from the same object.
const INDEPENDENT: f64 = 0.3;
/// Same as [`INDEPENDENT`], for a beam that passes where an object should be. Each beam is compared only once.
const FREE: f64 = 1.0;
/// Minimum likelihood of a position that is offered, as a share of the likelihood of the most likely one.
const LEAST: f64 = 0.05;

/// What a lost robot knows about its surroundings.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a> {
    /// The estimated pose.
    pub estimate: Estimate,
    /// Position along the drawn route.
    pub along: DrawnMetres,
    /// Positions of obstacles that the robot remembers.
    pub echoes: &'a [Point<Base>],
    /// The latest beams, which also show where there are no obstacles.
    pub beams: &'a [Beam],
}

/// Returns the positions where the robot may be, most likely first, at most [`MOST`]. Empty if it remembers no echoes.
pub fn places(outlines: &Outlines, settings: &Believing, known: &Surroundings<'_>) -> Vec<Point<Drawn>> {
    if known.echoes.is_empty() {
        return Vec::new();
    }
    let settings = Believing { independent: INDEPENDENT, learned: INDEPENDENT, free: FREE, ..*settings };
    let within = Within { outlines: outlines.all(), settings };
    let DrawnMetres(sd) = (known.along * ASTRAY_SHARE).clamp(ASTRAY[0], ASTRAY[1]);
    let steps = (REACH * sd / STEP.0) as i32;
    let offsets = (-steps..=steps).flat_map(|row| (-steps..=steps).map(move |column| [column, row]));
    let mut found: Vec<(f64, Point<Drawn>)> = offsets
        .map(|offset| offset.map(|cells| STEP.0 * f64::from(cells)))
        .filter(|[x, y]| x.hypot(*y) <= REACH * sd)
        .map(|[x, y]| {
            let at = Point::new(known.estimate.at.x + x, known.estimate.at.y + y);
            (log_likelihood(&within, known, at) - 0.5 * (x * x + y * y) / (sd * sd), at)
        })
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let most = found.first().map_or(0.0, |(log, _)| *log);
    let mut places: Vec<Point<Drawn>> = Vec::with_capacity(MOST);
    for (_, at) in found.iter().take_while(|(log, _)| *log >= most + LEAST.ln()) {
        if places.len() < MOST && places.iter().all(|place| DrawnMetres::between(place, at) >= APART) {
            places.push(*at);
        }
    }
    places
}

/// Returns the logarithm of the likelihood of everything that the robot sees and remembers, given that it is at `at`.
fn log_likelihood(within: &Within<'_>, known: &Surroundings<'_>, at: Point<Drawn>) -> f64 {
    let Estimate { heading_rad, stretch, .. } = known.estimate;
    let mut one = Hypothesis::at(at, heading_rad, stretch);
    // Every position uses the same random numbers, so that equal surroundings are equally likely.
    let mut chance = Pcg64Mcg::seed_from_u64(0);
    let turn = heading_rad.sin_cos();
    let free = known.beams.iter().map(|beam| {
        let free_m = (beam.range_m - PROBE_M).min(within.settings.reach_m);
        within.free(&one, turn, beam.angle_rad, free_m)
    });
    let free: f64 = free.sum();
    let echoes = known.echoes.iter().map(|echo| {
        let from = one.drawn(turn, *echo);
        within.echo(&mut one, from, &mut chance).log
    });
    free + echoes.sum::<f64>()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_8;

    use super::*;
    use crate::drawn::Stretch;
    use crate::memory::polar;
    use crate::plane;
    use crate::sketch::{Landmark, Sketch};

    /// Distance between the crossings of the street.
    const BLOCK_M: f64 = 6.0;

    fn block(x: f64, y: f64) -> Landmark {
        let outline = [[x, y], [x + 3.0, y], [x + 3.0, y + 3.0], [x, y + 3.0]].map(Point::from).into();
        Landmark { name: String::new(), outline }
    }

    /// Returns a street along x, with four equal blocks on each side. The centres of its crossings are at 6.5, 12.5 and 18.5 m.
    fn street() -> Sketch {
        let both = |i: usize| [1.5, -4.5].map(|y| block(2.0 + BLOCK_M * i as f64, y));
        let route = plane::resample(&[Point::new(0.0, 0.0), Point::new(24.0, 0.0)], 0.5);
        Sketch { landmarks: (0..4).flat_map(both).collect(), route, metres_per_pixel: 0.1 }
    }

    fn range_m(sketch: &Sketch, from: Point<Drawn>, angle_rad: f64) -> f64 {
        const FAR_M: f64 = 4.0;
        let (sin, cos) = angle_rad.sin_cos();
        let far = Point::new(from.x + FAR_M * cos, from.y + FAR_M * sin);
        let hits = sketch.landmarks.iter().filter_map(|one| plane::enters(from, far, &one.outline));
        let nearest = hits.map(|hit| hit.distance(&from)).fold(f64::INFINITY, f64::min);
        if nearest < FAR_M { nearest } else { f64::INFINITY }
    }

    /// Returns the positions offered to a robot that stands at `stands_at` and believes it is at `believed`, after it has driven
    /// 3 m along x.
    fn of_a_robot(sketch: &Sketch, stands_at: Point<Drawn>, believed: Point<Drawn>) -> Vec<Point<Drawn>> {
        let beams: [Beam; 16] = std::array::from_fn(|i| {
            let angle_rad = FRAC_PI_8 * i as f64;
            Beam { angle_rad, range_m: range_m(sketch, stands_at, angle_rad) }
        });
        let mut echoes: Vec<Point<Base>> = Vec::new();
        for behind_m in [0.0, 1.0, 2.0, 3.0] {
            let from = Point::new(stands_at.x - behind_m, stands_at.y);
            let seen = beams.iter().map(|beam| (beam.angle_rad, range_m(sketch, from, beam.angle_rad)));
            for (angle_rad, range_m) in seen.filter(|(_, range_m)| range_m.is_finite()) {
                let Point { x, y, .. } = polar(angle_rad, range_m);
                echoes.push(Point::new(x - behind_m, y));
            }
        }
        let spread = DrawnMetres(0.3);
        let estimate = Estimate { at: believed, heading_rad: 0.0, stretch: Stretch::NONE, spread, fit: 0.1 };
        let along = DrawnMetres(believed.x);
        let known = Surroundings { estimate, along, echoes: &echoes, beams: &beams };
        places(&Outlines::of(sketch), &Believing::default(), &known)
    }

    #[test]
    fn one_crossing_looks_like_the_next() {
        let [here, next] = [Point::new(12.5, 0.0), Point::new(18.5, 0.0)];
        let places = of_a_robot(&street(), next, here);
        let is_offered = |crossing: &Point<Drawn>| places.iter().any(|place| place.distance(crossing) < 0.7);
        assert!(is_offered(&here) && is_offered(&next), "{places:?}");
        assert!(places.windows(2).all(|pair| pair[0].distance(&pair[1]) >= APART.0), "{places:?}");
        assert!(places[0].distance(&here) < 0.7, "the estimate is the likeliest place: {places:?}");
    }

    #[test]
    fn a_crossing_that_looks_like_what_the_robot_sees_comes_first() {
        let mut sketch = street();
        // Beyond the last crossing, there are no blocks.
        sketch.landmarks.truncate(6);
        let [before, last] = [Point::new(12.5, 0.0), Point::new(18.5, 0.0)];
        let places = of_a_robot(&sketch, last, before);
        assert!(places[0].distance(&last) < 0.7, "{places:?}");
    }

    #[test]
    fn a_robot_that_remembers_nothing_may_be_anywhere() {
        let nowhere = Point::new(200.0, 200.0);
        assert_eq!(of_a_robot(&street(), nowhere, Point::new(6.5, 0.0)), []);
    }
}

//! Finds the known points of a calibration that disagree with the others.
//!
//! A least-squares fit hides a wrong point, because the point pulls the camera towards itself and makes the others look wrong too.
//! Instead, cameras are fitted to four points each, and the one with which most of the remaining points agree shows which points
//! are off (random sample consensus, Fischler and Bolles 1981). Four points always fit exactly. Five may disagree, but don't show
//! which of them is wrong.

use std::fmt;

use rand::SeedableRng;
use rand::seq::index::sample;
use rand_pcg::Pcg64Mcg;

use crate::camera::{Camera, Known};

/// Maximum error of a well-measured point, in pixels or as a fraction of the extent of all points, whichever is greater. People
/// cannot measure much better than this.
const MEASURED_PX: f64 = 4.0;
const MEASURED: f64 = 0.002;
/// Minimum ratio between the errors of a wrong point and of the points that agree.
const FAR: f64 = 4.0;
/// Minimum number of points whose agreement is meaningful, since four always agree.
const FEWEST: usize = 5;
/// Maximum number of cameras of four points that are tried.
const MOST_CAMERAS: usize = 3000;
/// Maximum number of points for trying an exchange of every pair.
const MOST_EXCHANGED: usize = 12;

/// A known point that disagrees with the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Off {
    /// Number of the point, from 1.
    pub number: usize,
    /// Distance from where the other points place it, in pixels.
    pub off_px: f64,
}

/// The result of comparing known points with one another.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Review {
    /// The points that disagree with the others.
    pub off: Vec<Off>,
    /// Number of points that agree.
    pub agreeing: usize,
    /// Distance of the worst of the agreeing points from where the fit places it, in pixels.
    pub agreement_px: f64,
    /// Numbers of two points that would agree with the others after being exchanged.
    pub exchanged: Option<[usize; 2]>,
    /// Whether the picture shows the plane as if from below.
    pub is_mirrored: bool,
}

impl Review {
    /// Reviews known points. For fewer than five points, it only checks whether the picture is mirrored, because four always agree.
    pub fn of(points: &[Known]) -> Self {
        let everybody: Vec<usize> = (0..points.len()).collect();
        let plain =
            Self { agreeing: points.len(), is_mirrored: is_mirrored(points, &everybody), ..Self::default() };
        if points.len() < FEWEST {
            return plain;
        }
        let measured_px = measured_px(points);
        if let Some(off_px) = residuals(points, &everybody).filter(|off_px| furthest(off_px) <= measured_px) {
            return Self { agreement_px: furthest(&off_px), ..plain };
        }
        let chosen = agreeing(points, measured_px).unwrap_or_default();
        let others: Vec<usize> = everybody.iter().copied().filter(|at| !chosen.contains(at)).collect();
        let suspects = if points.len() <= MOST_EXCHANGED { &everybody } else { &others };
        // Agreement of all points after an exchange is the strongest evidence. Agreement of most points comes second.
        if let Some(([a, b], corrected)) = exchanged(points, suspects, measured_px) {
            let by = Camera::calibrated(&corrected).ok();
            let off_px = |at: usize| by.map_or(f64::INFINITY, |camera| off(&camera, &points[at]));
            let others = everybody.iter().filter(|&&at| at != a && at != b);
            return Self {
                off: [a, b].map(|at| Off { number: at + 1, off_px: off_px(at) }).to_vec(),
                agreeing: points.len() - 2,
                agreement_px: others.map(|&at| off_px(at)).fold(0.0, f64::max),
                exchanged: Some([a + 1, b + 1]),
                is_mirrored: is_mirrored(&corrected, &everybody),
            };
        }
        let by = if chosen.is_empty() { &everybody } else { &chosen };
        let off_px = residuals(points, by).unwrap_or_else(|| vec![f64::INFINITY; points.len()]);
        Self {
            off: others.iter().map(|&at| Off { number: at + 1, off_px: off_px[at] }).collect(),
            agreeing: chosen.len(),
            agreement_px: chosen.iter().map(|&at| off_px[at]).fold(0.0, f64::max),
            exchanged: None,
            is_mirrored: is_mirrored(points, by),
        }
    }

    /// Returns true if no point disagrees with the others.
    pub fn agrees(&self) -> bool {
        self.off.is_empty()
    }

    /// Returns true if there are so few points that they would agree even if some of them were wrong.
    pub fn is_unchecked(&self) -> bool {
        self.agreeing + self.off.len() < FEWEST
    }
}

/// Describes which points are off, by how much, and how to correct them.
impl fmt::Display for Review {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { off, agreeing, agreement_px, .. } = self;
        if self.is_unchecked() {
            return write!(
                f,
                "{agreeing} known points cannot be checked against each other; a fifth would show an error"
            );
        }
        if off.is_empty() {
            return write!(f, "{agreeing} points that agree to {agreement_px:.1} pixels");
        }
        if *agreeing > 0 {
            for (index, Off { number, off_px }) in off.iter().enumerate() {
                let between = match index {
                    0 => "",
                    _ if index + 1 == off.len() => " and ",
                    _ => ", ",
                };
                write!(f, "{between}point {number} {}", pixels(*off_px))?;
            }
            write!(f, " off where the other {agreeing} have it, which agree to {agreement_px:.1} pixels")?;
        } else {
            let most = off.iter().map(|it| it.off_px).fold(0.0, f64::max);
            write!(f, "{} points that lie up to {} off each other", off.len(), pixels(most))?;
        }
        match self.exchanged {
            Some([a, b]) => write!(f, "; exchange the places of points {a} and {b}, and all agree"),
            None if *agreeing > 0 => write!(f, "; correct or remove what is wrong"),
            None => write!(f, "; more points would say which of them is wrong"),
        }
    }
}

fn pixels(off_px: f64) -> String {
    if off_px.is_finite() { format!("{off_px:.0} pixels") } else { "infinitely far".to_owned() }
}

/// Returns the points that agree with one another, if there are more of them than would agree by chance.
fn agreeing(points: &[Known], measured_px: f64) -> Option<Vec<usize>> {
    let cost = |off_px: &[f64]| off_px.iter().map(|off| off.min(measured_px)).sum::<f64>();
    let tried = fours(points.len()).filter_map(|four| residuals(points, &four));
    let mut off_px = tried.min_by(|a, b| cost(a).total_cmp(&cost(b)))?;
    let mut most_px = measured_px;
    let mut chosen = Vec::new();
    // A camera fitted to all agreeing points is better than one fitted to four.
    for _ in 0..3 {
        chosen = (0..points.len()).filter(|&at| off_px[at] <= most_px).collect();
        // More than half of the points in excess of the four that always agree.
        if chosen.len() < FEWEST.max(points.len() / 2 + 2) {
            return None;
        }
        off_px = residuals(points, &chosen)?;
        let squares: f64 = chosen.iter().map(|&at| off_px[at].powi(2)).sum();
        most_px = measured_px.max(FAR * (squares / chosen.len() as f64).sqrt());
    }
    Some(chosen)
}

/// Returns how accurately people measure points in a picture of this extent, in pixels.
fn measured_px(points: &[Known]) -> f64 {
    let extent = |axis: usize| {
        let ends = points.iter().fold((f64::MAX, f64::MIN), |(low, high), known| {
            (low.min(known.pixel[axis]), high.max(known.pixel[axis]))
        });
        ends.1 - ends.0
    };
    MEASURED_PX.max(MEASURED * extent(0).hypot(extent(1)))
}

fn furthest(off_px: &[f64]) -> f64 {
    off_px.iter().copied().fold(0.0, f64::max)
}

/// Iterates over choices of four of `count` points: either all choices, or a large pseudo-random sample that is always the same.
fn fours(count: usize) -> impl Iterator<Item = Vec<usize>> {
    let all = count * (count - 1) * (count - 2) * (count - 3) / 24;
    let mut rng = Pcg64Mcg::seed_from_u64(1984);
    let by_chance =
        (all > MOST_CAMERAS).then(|| (0..MOST_CAMERAS).map(move |_| sample(&mut rng, count, 4).into_vec()));
    let each = (all <= MOST_CAMERAS).then(|| {
        (0..count).flat_map(move |a| {
            (a + 1..count).flat_map(move |b| {
                (b + 1..count).flat_map(move |c| (c + 1..count).map(move |d| vec![a, b, c, d]))
            })
        })
    });
    by_chance.into_iter().flatten().chain(each.into_iter().flatten())
}

/// Returns the distance of each point, in pixels, from where a camera fitted to some of the points places it.
fn residuals(points: &[Known], of: &[usize]) -> Option<Vec<f64>> {
    let chosen: Vec<Known> = of.iter().map(|&at| points[at]).collect();
    let camera = Camera::fitted(&chosen).ok()?;
    Some(points.iter().map(|known| off(&camera, known)).collect())
}

fn off(camera: &Camera, known: &Known) -> f64 {
    let seen = camera.pixel(known.place);
    seen.map_or(f64::INFINITY, |[x, y]| (x - known.pixel[0]).hypot(y - known.pixel[1]))
}

/// Finds two of the given points such that all points agree once these two have swapped positions. Returns these two, and all
/// points after the swap. For a rectangle, swapping the other two may work as well, but would mirror the picture, so the swap that
/// doesn't is preferred.
fn exchanged(points: &[Known], of: &[usize], measured_px: f64) -> Option<([usize; 2], Vec<Known>)> {
    let everybody: Vec<usize> = (0..points.len()).collect();
    let few: &[usize] = if of.len() <= MOST_EXCHANGED { of } else { &[] };
    let pairs = few.iter().enumerate().flat_map(|(i, &a)| few[i + 1..].iter().map(move |&b| [a, b]));
    let tried = pairs.filter_map(|[a, b]| {
        let mut corrected = points.to_vec();
        (corrected[a].place, corrected[b].place) = (points[b].place, points[a].place);
        let off_px = furthest(&residuals(&corrected, &everybody)?);
        (off_px <= measured_px).then(|| (is_mirrored(&corrected, &everybody), off_px, [a, b], corrected))
    });
    let best = tried.min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    best.map(|(_, _, pair, corrected)| (pair, corrected))
}

/// Returns true if the camera fitted to some points sees the plane as if from below.
fn is_mirrored(points: &[Known], of: &[usize]) -> bool {
    let chosen: Vec<Known> = of.iter().map(|&at| points[at]).collect();
    let area = |camera: Camera| camera.area(chosen[0].pixel);
    Camera::calibrated(&chosen).ok().and_then(area).is_some_and(|area| area < 0.0)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Returns known points of a picture that was taken at a slight angle, measured to the nearest pixel.
    fn points(count: usize) -> Vec<Known> {
        let places = [
            [0.0, 0.0],
            [1.0, 0.0],
            [0.0, 1.0],
            [1.0, 1.0],
            [0.5, 0.5],
            [0.5, 0.0],
            [0.0, 0.5],
            [0.8, 0.3],
            [0.2, 0.9],
        ];
        let truth = Camera::calibrated(&[
            Known { pixel: [90.0, 940.0], place: [0.0, 0.0] },
            Known { pixel: [1110.0, 930.0], place: [1.0, 0.0] },
            Known { pixel: [985.0, 85.0], place: [1.0, 1.0] },
            Known { pixel: [230.0, 95.0], place: [0.0, 1.0] },
        ])
        .unwrap();
        let seen = |place: [f64; 2]| Known { pixel: truth.pixel(place).unwrap().map(f64::round), place };
        places[..count].iter().copied().map(seen).collect()
    }

    fn numbers(review: &Review) -> Vec<usize> {
        review.off.iter().map(|off| off.number).collect()
    }

    #[test]
    fn points_that_agree_are_not_doubted() {
        for count in 4..=9 {
            let review = Review::of(&points(count));
            assert!(review.agrees() && !review.is_mirrored && review.exchanged.is_none(), "{review:?}");
        }
    }

    #[test]
    fn one_or_two_wrong_points_are_named() {
        for wrong in 0..7 {
            let mut one = points(7);
            one[wrong].pixel[0] += 50.0;
            let review = Review::of(&one);
            assert_eq!(numbers(&review), [wrong + 1], "{review}");
            assert!((review.off[0].off_px - 50.0).abs() < 10.0 && review.agreement_px < 2.0, "{review}");
        }
        let mut two = points(9);
        two[1].place[0] -= 0.1;
        two[4].pixel[1] += 30.0;
        let review = Review::of(&two);
        assert_eq!(numbers(&review), [2, 5], "{review}");
        let words = review.to_string();
        assert!(words.starts_with("point 2 ") && words.contains(" and point 5 "), "{words}");
        assert!(words.contains("the other 7 have it"), "{words}");
    }

    #[test]
    fn two_exchanged_points_are_named() {
        for count in [5, 6, 7, 9] {
            let mut exchanged = points(count);
            (exchanged[0].pixel, exchanged[1].pixel) = (exchanged[1].pixel, exchanged[0].pixel);
            let review = Review::of(&exchanged);
            assert_eq!(review.exchanged, Some([1, 2]), "{review:?}");
            assert!(review.to_string().contains("exchange the places of points 1 and 2"), "{review}");
        }
    }

    #[test]
    fn five_points_that_disagree_do_not_say_which_is_wrong() {
        let mut five = points(5);
        five[3].pixel[1] += 80.0;
        let review = Review::of(&five);
        assert!(review.off.len() == 5 && review.agreeing == 0, "{review:?}");
        assert!(review.to_string().contains("more points would say"), "{review}");
    }

    /// Regression test: four points used to "agree to 0.0 pixels" although one was 50 pixels off, because a camera fits any
    /// four.
    #[test]
    fn four_points_cannot_be_checked_whatever_is_wrong_with_one() {
        let mut four = points(4);
        four[3].pixel[0] -= 50.0;
        let review = Review::of(&four);
        assert!(review.agrees() && review.is_unchecked(), "{review:?}");
        let words = "4 known points cannot be checked against each other; a fifth would show an error";
        assert_eq!(review.to_string(), words);
        assert!(!Review::of(&points(5)).is_unchecked());
    }

    #[test]
    fn four_points_reveal_a_mirrored_picture() {
        for count in [4, 7] {
            let mut mirrored = points(count);
            mirrored.iter_mut().for_each(|known| known.place[1] = 1.0 - known.place[1]);
            assert!(Review::of(&mirrored).is_mirrored && Review::of(&mirrored).agrees());
        }
    }

    #[test]
    fn many_points_are_reviewed_by_a_sample_of_cameras() {
        let mut many: Vec<Known> = (0..12)
            .flat_map(|i| (0..8).map(move |j| [f64::from(i), f64::from(j)]))
            .map(|[x, y]| Known { pixel: [100.0 * x, 900.0 - 100.0 * y], place: [x, y] })
            .collect();
        many[40].pixel[0] += 20.0;
        assert_eq!(numbers(&Review::of(&many)), [41]);
        many[40].pixel[0] -= 20.0;
        (many[3].place, many[90].place) = (many[90].place, many[3].place);
        assert_eq!(Review::of(&many).exchanged, Some([4, 91]));
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, cases: 64, ..ProptestConfig::default() })]

        #[test]
        fn any_points_can_be_reviewed(
            values in prop::collection::vec(prop::array::uniform4(-1e4..1e4_f64), 0..9),
        ) {
            let points: Vec<_> =
                values.iter().map(|[a, b, c, d]| Known { pixel: [*a, *b], place: [*c, *d] }).collect();
            let _ = Review::of(&points).to_string();
        }
    }
}

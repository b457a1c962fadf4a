//! The global camera: a perspective transform from pixels to positions on the plane, calibrated by known points (Park and
//! Kender 1995, 7.1.1).
//!
//! A plane and its picture are related by eight numbers (Hartley and Zisserman 2004, 4.1), which are determined by four points
//! or, in the least-squares sense, by more.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use crate::error::DotsError;

/// A point whose position is known both in the picture and on the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// Column and row in the picture, from its upper left corner.
    pub pixel: [f64; 2],
    /// Position on the plane.
    pub place: [f64; 2],
}

/// A perspective transform between a plane and its picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    place_from_pixel: Matrix3<f64>,
    pixel_from_place: Matrix3<f64>,
}

impl Camera {
    /// Returns the camera that best fits the known points.
    ///
    /// # Errors
    /// [`DotsError::Calibration`] if the points do not determine a camera. [`DotsError::Crossed`] if they are four points that
    /// would do so if two of them were exchanged. [`DotsError::Behind`] if one of them would lie behind the camera.
    pub fn calibrated(points: &[Known]) -> Result<Self, DotsError> {
        Self::fitted(points).map_err(|error| {
            uncrossing(points).map_or(error, |pair| DotsError::Crossed { exchange: pair.map(|at| at + 1) })
        })
    }

    /// Like [`Camera::calibrated`], but doesn't look for two points to exchange, so it never returns [`DotsError::Crossed`].
    pub(crate) fn fitted(points: &[Known]) -> Result<Self, DotsError> {
        let wrong = || DotsError::Calibration { found: points.len() };
        if points.len() < 4 {
            return Err(wrong());
        }
        // Centring and scaling the coordinates keeps the equations well-conditioned.
        let pixels = Normal::of(points.iter().map(|known| known.pixel)).ok_or_else(wrong)?;
        let places = Normal::of(points.iter().map(|known| known.place)).ok_or_else(wrong)?;
        let mut left = DMatrix::zeros(2 * points.len(), 8);
        let mut right = DVector::zeros(2 * points.len());
        for (i, known) in points.iter().enumerate() {
            let ([u, v], [x, y]) = (pixels.apply(known.pixel), places.apply(known.place));
            for (row, at, first) in [(2 * i, x, 0), (2 * i + 1, y, 3)] {
                (left[(row, first)], left[(row, first + 1)], left[(row, first + 2)]) = (u, v, 1.0);
                (left[(row, 6)], left[(row, 7)], right[row]) = (-u * at, -v * at, at);
            }
        }
        let svd = left.svd(true, true);
        if svd.singular_values.min() < 1e-9 * svd.singular_values.max() {
            return Err(wrong());
        }
        let h = svd.solve(&right, 0.0).map_err(|_| wrong())?;
        let normal = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0);
        let place_from_pixel = places.matrix().try_inverse().ok_or_else(wrong)? * normal * pixels.matrix();
        let pixel_from_place = place_from_pixel.try_inverse().ok_or_else(wrong)?;
        let camera = Self { place_from_pixel, pixel_from_place };
        match points.iter().position(|known| camera.place(known.pixel).is_err()) {
            Some(index) => Err(DotsError::Behind { number: index + 1, pixel: points[index].pixel }),
            None => Ok(camera),
        }
    }

    /// Returns the position on the plane that a pixel shows.
    ///
    /// # Errors
    /// [`DotsError::Horizon`] if the pixel is on the horizon or beyond.
    pub fn place(&self, [x, y]: [f64; 2]) -> Result<[f64; 2], DotsError> {
        project(&self.place_from_pixel, [x, y]).ok_or(DotsError::Horizon { x, y })
    }

    /// Returns the pixel that shows a position, or `None` if the position is behind the camera.
    pub fn pixel(&self, place: [f64; 2]) -> Option<[f64; 2]> {
        project(&self.pixel_from_place, place)
    }

    /// Returns the area of the plane that a pixel covers at this point of the picture, in the plane's squared unit. It is
    /// negative if the picture shows the plane as if from below. Returns `None` on the horizon and beyond.
    pub fn area(&self, [x, y]: [f64; 2]) -> Option<f64> {
        let h = &self.place_from_pixel;
        let at = h * Vector3::new(x, y, 1.0);
        // This is the Jacobian determinant of the perspective transform. Its sign is inverted because the rows of a picture
        // count downwards.
        let area = -h.determinant() / at.z.powi(3);
        (at.z > 1e-12 && area.is_finite()).then_some(area)
    }

    /// Estimates the standard deviation of a position on each axis from the residuals of the known points. Returns `None` for
    /// four points, which always fit exactly.
    pub fn spread(&self, points: &[Known]) -> Option<f64> {
        // The fit determines eight numbers from two coordinates of each point.
        let freedom = (2 * points.len()).checked_sub(8).filter(|&freedom| freedom > 0)?;
        let squared = |known: &Known| {
            let [x, y] = self.place(known.pixel).ok()?;
            Some((x - known.place[0]).powi(2) + (y - known.place[1]).powi(2))
        };
        let sum: f64 = points.iter().map(squared).sum::<Option<f64>>()?;
        Some((sum / freedom as f64).sqrt())
    }
}

/// Returns two of four points that have each other's positions, if a camera sees all four after exchanging
/// them. Exchanging the other two would work as well, but would mirror the picture, so the exchange that
/// doesn't is preferred.
fn uncrossing(points: &[Known]) -> Option<[usize; 2]> {
    const PAIRS: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
    let exchanged = |[a, b]: [usize; 2]| {
        let mut exchanged: [Known; 4] = points.try_into().ok()?;
        (exchanged[a].place, exchanged[b].place) = (points[b].place, points[a].place);
        Camera::fitted(&exchanged).ok()?.area(points[0].pixel)
    };
    let seen = PAIRS.into_iter().filter_map(|pair| Some((pair, exchanged(pair)?)));
    let (upright, mirrored): (Vec<_>, Vec<_>) = seen.partition(|(_, area)| *area > 0.0);
    upright.first().or(mirrored.first()).map(|(pair, _)| *pair)
}

/// Applies a perspective transform. Returns `None` on the horizon and beyond. The third coordinate is 1 at the mean of the
/// known pixels, so in both directions, it is positive for everything in front of the camera.
fn project(matrix: &Matrix3<f64>, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let at = matrix * Vector3::new(x, y, 1.0);
    let projected = [at.x / at.z, at.y / at.z];
    (at.z > 1e-12 && projected.iter().all(|v| v.is_finite())).then_some(projected)
}

/// A transform that moves the mean of points to the origin and scales their mean distance from it to 1.
struct Normal {
    mean: [f64; 2],
    scale: f64,
}

impl Normal {
    fn of(points: impl Iterator<Item = [f64; 2]> + Clone) -> Option<Self> {
        let count = points.clone().count() as f64;
        let mean = [0, 1].map(|axis| points.clone().map(|point| point[axis]).sum::<f64>() / count);
        let off = |point: [f64; 2]| (point[0] - mean[0]).hypot(point[1] - mean[1]);
        let size = points.map(off).sum::<f64>() / count;
        (size > 0.0 && size.is_finite()).then(|| Self { mean, scale: 1.0 / size })
    }

    fn apply(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [(x - self.mean[0]) * self.scale, (y - self.mean[1]) * self.scale]
    }

    fn matrix(&self) -> Matrix3<f64> {
        let Self { mean: [x, y], scale } = *self;
        Matrix3::new(scale, 0.0, -x * scale, 0.0, scale, -y * scale, 0.0, 0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn known(pixels: [[f64; 2]; 4], places: [[f64; 2]; 4]) -> Vec<Known> {
        pixels.into_iter().zip(places).map(|(pixel, place)| Known { pixel, place }).collect()
    }

    const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

    #[test]
    fn the_centre_of_a_square_in_perspective_is_where_its_diagonals_meet() {
        let points = known([[100.0, 700.0], [900.0, 700.0], [700.0, 300.0], [300.0, 300.0]], SQUARE);
        let camera = Camera::calibrated(&points).unwrap();
        for point in &points {
            let [x, y] = camera.place(point.pixel).unwrap();
            assert!((x - point.place[0]).hypot(y - point.place[1]) < 1e-9);
        }
        // The diagonals of the picture meet at x = 500, a third of the way up from the near side of 800 px to the far side of
        // 400 px.
        let [x, y] = camera.pixel([0.5, 0.5]).unwrap();
        assert!((x - 500.0).abs() < 1e-6 && (y - 1300.0 / 3.0).abs() < 1e-6, "{x} {y}");
        assert!(camera.spread(&points).is_none());
    }

    #[test]
    fn points_on_a_line_and_too_few_points_are_rejected() {
        let line = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]];
        let error = Camera::calibrated(&known(line, SQUARE)).unwrap_err().to_string();
        assert!(error.contains("no three on one line, found 4 points"), "{error}");
        assert!(Camera::calibrated(&known(SQUARE, SQUARE)[..3]).is_err());
        assert!(Camera::calibrated(&known([[2.0, 2.0]; 4], SQUARE)).is_err());
    }

    /// Regression test: a pixel above the horizon used to have a position, which was a mirrored one on the plane behind the
    /// camera.
    #[test]
    fn above_the_horizon_and_behind_the_camera_there_is_no_projection() {
        let aslant = [[100.0, 700.0], [900.0, 700.0], [700.0, 300.0], [300.0, 300.0]];
        let camera = Camera::calibrated(&known(aslant, SQUARE)).unwrap();
        // The sides of the square meet in row -100, and the camera is above y = -1.
        assert!(camera.place([500.0, -99.0]).is_ok() && camera.pixel([0.5, -0.99]).is_some());
        for beyond in [[500.0, -100.0], [500.0, -101.0], [300.0, -5000.0]] {
            assert!(matches!(camera.place(beyond), Err(DotsError::Horizon { .. })), "{beyond:?}");
        }
        assert_eq!(camera.pixel([0.5, -1.0]), None);
        assert_eq!(camera.pixel([0.5, -1.01]), None);
    }

    #[test]
    fn distant_pixels_cover_more_of_the_plane() {
        let points = known([[100.0, 700.0], [900.0, 700.0], [700.0, 300.0], [300.0, 300.0]], SQUARE);
        let camera = Camera::calibrated(&points).unwrap();
        let [near, far] = [680.0, 320.0].map(|row| {
            let corners =
                [[500.0, row], [501.0, row], [500.0, row + 1.0]].map(|at| camera.place(at).unwrap());
            let [a, b] = [1, 2].map(|i| [0, 1].map(|axis| corners[i][axis] - corners[0][axis]));
            let measured = -(a[0] * b[1] - a[1] * b[0]);
            let area = camera.area([500.0, row]).unwrap();
            assert!((area / measured - 1.0).abs() < 0.02, "{area} {measured}");
            area
        });
        assert!(near > 0.0 && far > 4.0 * near, "{near} {far}");
        let mirrored: Vec<_> =
            points.iter().map(|it| Known { pixel: [-it.pixel[0], it.pixel[1]], ..*it }).collect();
        assert!(Camera::calibrated(&mirrored).unwrap().area([-500.0, 500.0]).unwrap() < 0.0);
    }

    /// Four points always fit. If two of them were exchanged, the horizon used to run between them, and half of the plane lay
    /// behind the camera. For a rectangle seen straight from above, the error used to claim that three of its corners lie on
    /// one line.
    #[test]
    fn four_crossed_points_are_reported_with_those_to_exchange() {
        let aslant = [[90.0, 700.0], [900.0, 690.0], [700.0, 300.0], [310.0, 320.0]];
        let from_above = [[50.0, 1250.0], [1250.0, 1250.0], [1250.0, 50.0], [50.0, 50.0]];
        for [a, b, c, d] in [aslant, from_above] {
            for (exchanged, pair) in [
                ([b, a, c, d], [1, 2]),
                ([a, c, b, d], [2, 3]),
                ([a, b, d, c], [3, 4]),
                ([d, b, c, a], [1, 4]),
            ] {
                let error = Camera::calibrated(&known(exchanged, SQUARE)).unwrap_err();
                assert!(matches!(error, DotsError::Crossed { exchange } if exchange == pair), "{error}");
            }
        }
    }

    /// One of the four pixels lies inside the triangle of the others, and no exchange makes them the picture of a square.
    #[test]
    fn a_point_behind_the_camera_is_named() {
        let inside = [[0.0, 900.0], [900.0, 900.0], [400.0, 0.0], [400.0, 600.0]];
        let error = Camera::calibrated(&known(inside, SQUARE)).unwrap_err().to_string();
        assert!(error.contains("expected a place in front of the camera, like the others"), "{error}");
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn projecting_a_place_and_back_returns_it(
            near in 300.0..800.0_f64, far in 100.0..300.0_f64, x in 0.0..1.0_f64, y in 0.0..1.0_f64,
        ) {
            let pixels = [[400.0 - near / 2.0, 600.0], [400.0 + near / 2.0, 600.0],
                [400.0 + far / 2.0, 100.0], [400.0 - far / 2.0, 100.0]];
            let camera = Camera::calibrated(&known(pixels, SQUARE)).unwrap();
            let again = camera.place(camera.pixel([x, y]).unwrap()).unwrap();
            prop_assert!((again[0] - x).hypot(again[1] - y) < 1e-9);
        }
    }
}

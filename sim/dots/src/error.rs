//! What can be wrong with input.

/// Why dots, a calibration or a picture are rejected.
#[derive(Debug, thiserror::Error)]
pub enum DotsError {
    /// A parameter out of its range.
    #[error("{what}: expected {expected}, found {found}")]
    Parameter {
        /// Which parameter.
        what: &'static str,
        /// Its range.
        expected: &'static str,
        /// The number.
        found: f64,
    },
    /// A calibration from which no camera follows.
    #[error("expected at least four points, no three on one line, found {found} points")]
    Calibration {
        /// How many points there are.
        found: usize,
    },
    /// Four known points of which two have each other's places: a proper quadrilateral in the picture, a crossed one on the plane.
    #[error(
        "expected four points that go around a quadrilateral in the picture as they do on the plane, found one that crosses \
         itself: exchange the places of points {} and {}",
        exchange[0], exchange[1]
    )]
    Crossed {
        /// The numbers, from 1, of two points that are to be exchanged.
        exchange: [usize; 2],
    },
    /// A known point that would lie behind the camera: two of them are exchanged, or one is far off.
    #[error(
        "known point {number}, pixel ({}, {}): expected a place in front of the camera, like the others, found one behind it",
        pixel[0], pixel[1]
    )]
    Behind {
        /// Its number, from 1.
        number: usize,
        /// Its pixel.
        pixel: [f64; 2],
    },
    /// Known points that disagree by more than a map can tolerate.
    #[error("expected known points that agree, found {0}")]
    Disagree(String),
    /// A picture in which light and shadow leave no dots that can be told from their ground.
    #[error(
        "expected even light, found a ground from {darkest} to {lightest} of 255 on which {found}: photograph it in even light"
    )]
    Light {
        /// The darkest ground.
        darkest: u8,
        /// The lightest ground.
        lightest: u8,
        /// What is wrong with the spots.
        found: String,
    },
    /// A place behind the camera, or on its horizon.
    #[error("pixel ({x}, {y}): expected a place on the plane, found one on the camera's horizon or beyond")]
    Horizon {
        /// The pixel.
        x: f64,
        /// The pixel.
        y: f64,
    },
    /// A picture without a spot.
    #[error("expected dots on a plain ground, found none in {width} × {height} pixels")]
    NoDots {
        /// Pixels.
        width: u32,
        /// Pixels.
        height: u32,
    },
    /// More spots than a plane has dots.
    #[error("expected at most {limit} dots, found {found}")]
    TooManyDots {
        /// The greatest number.
        limit: usize,
        /// How many there are.
        found: usize,
    },
    /// A picture with too many pixels.
    #[error("expected a picture of at most {limit} pixels, found {width} × {height}")]
    Size {
        /// The greatest number of pixels.
        limit: u64,
        /// Pixels.
        width: u32,
        /// Pixels.
        height: u32,
    },
    /// Not a picture that can be read.
    #[error("expected a PNG, JPEG or PNM picture: {0}")]
    Picture(#[from] image::ImageError),
}

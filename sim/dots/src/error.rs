//! Errors in the input of this crate.

/// Why dots, a calibration or a picture were rejected.
#[derive(Debug, thiserror::Error)]
pub enum DotsError {
    /// A parameter is out of range.
    #[error("{what}: expected {expected}, found {found}")]
    Parameter {
        /// Name of the parameter.
        what: &'static str,
        /// Description of the valid range.
        expected: &'static str,
        /// The invalid value.
        found: f64,
    },
    /// The known points don't determine a camera.
    #[error("expected at least four points, no three on one line, found {found} points")]
    Calibration {
        /// Number of points.
        found: usize,
    },
    /// Two of the four known points have each other's positions, so that a proper quadrilateral in the picture crosses itself
    /// on the plane.
    #[error(
        "expected four points that go around a quadrilateral in the picture as they do on the plane, found one that crosses \
         itself: exchange the places of points {} and {}",
        exchange[0], exchange[1]
    )]
    Crossed {
        /// Numbers of the two points to exchange, from 1.
        exchange: [usize; 2],
    },
    /// A known point would lie behind the camera, because two points are exchanged or one is far off.
    #[error(
        "known point {number}, pixel ({}, {}): expected a place in front of the camera, like the others, found one behind it",
        pixel[0], pixel[1]
    )]
    Behind {
        /// Number of the point, from 1.
        number: usize,
        /// Pixel of the point.
        pixel: [f64; 2],
    },
    /// The known points disagree by more than a map can tolerate.
    #[error("expected known points that agree, found {0}")]
    Disagree(String),
    /// Light and shadow prevent dots from being distinguished from the ground.
    #[error(
        "expected even light, found a ground from {darkest} to {lightest} of 255 on which {found}: photograph it in even light"
    )]
    Light {
        /// Level of the darkest ground.
        darkest: u8,
        /// Level of the lightest ground.
        lightest: u8,
        /// Description of the spots, such as their number.
        found: String,
    },
    /// A pixel shows a position on the camera's horizon or beyond.
    #[error("pixel ({x}, {y}): expected a place on the plane, found one on the camera's horizon or beyond")]
    Horizon {
        /// Column of the pixel.
        x: f64,
        /// Row of the pixel.
        y: f64,
    },
    /// A picture contains no spots.
    #[error("expected dots on a plain ground, found none in {width} × {height} pixels")]
    NoDots {
        /// Width of the picture, in pixels.
        width: u32,
        /// Height of the picture, in pixels.
        height: u32,
    },
    /// A picture has more spots than a plane may have dots.
    #[error("expected at most {limit} dots, found {found}")]
    TooManyDots {
        /// Maximum number of dots.
        limit: usize,
        /// Number of spots found.
        found: usize,
    },
    /// A picture has too many pixels.
    #[error("expected a picture of at most {limit} pixels, found {width} × {height}")]
    Size {
        /// Maximum number of pixels.
        limit: u64,
        /// Width of the picture, in pixels.
        width: u32,
        /// Height of the picture, in pixels.
        height: u32,
    },
    /// The bytes are not a readable picture.
    #[error("expected a PNG, JPEG or PNM picture: {0}")]
    Picture(#[from] image::ImageError),
}

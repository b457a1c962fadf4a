//! Kinds of landmarks on land, such as doors and stairs (Park and Kender 1995, figures 1 and 2, with one world for each kind).
//!
//! A laser cannot distinguish landmarks. Their kinds are shown by fiducial markers on or beside them, which the robot's camera
//! detects. The map-maker knows the positions of the markers, and from where the camera can see them.

use std::fmt;

use arrayvec::ArrayString;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::wrap_angle;
use sketchnav_schemas::robot::MarkerCamera;

use crate::description::Descriptor;
use crate::error::Error;
use crate::geometry::Point;
use crate::navigator::tracks::nearest;
use crate::plane::DotId;

/// Maximum number of letters of a kind.
const MOST_LETTERS: usize = 16;
/// Maximum distance between a marker and the surface of its landmark, in metres.
const BESIDE_M: f64 = 0.5;
/// Returns the maximum distance between a marker and the middle of its landmark, in metres.
pub fn reach_m(radius_m: f64) -> f64 {
    radius_m + BESIDE_M
}

/// The word for a landmark of any kind, which is therefore not a valid kind.
pub(crate) const ANY_KIND: &str = "landmark";

/// A kind of landmark: a word of lower-case letters (a to z), digits and hyphens that begins with a letter.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "ArrayString<MOST_LETTERS>", into = "ArrayString<MOST_LETTERS>")]
pub struct LandmarkKind(ArrayString<MOST_LETTERS>);

impl LandmarkKind {
    /// Returns the kind with the given name, or `None` if the name is not such a word, is too long, or has another meaning in maps.
    pub fn of(name: &str) -> Option<Self> {
        let is_letter = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        let is_word = name.starts_with(|c: char| c.is_ascii_lowercase()) && name.chars().all(is_letter);
        let is_taken = name == ANY_KIND || Descriptor::of_word(name).is_some();
        ArrayString::from(name).ok().filter(|_| is_word && !is_taken).map(Self)
    }

    /// Returns the name.
    pub fn name(&self) -> &str {
        &self.0
    }
}

impl TryFrom<ArrayString<MOST_LETTERS>> for LandmarkKind {
    type Error = Error;
    fn try_from(name: ArrayString<MOST_LETTERS>) -> Result<Self, Error> {
        Self::of(&name).ok_or_else(|| Error::NoKind { found: name.to_string() })
    }
}

impl From<LandmarkKind> for ArrayString<MOST_LETTERS> {
    fn from(kind: LandmarkKind) -> Self {
        kind.0
    }
}

impl fmt::Debug for LandmarkKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl fmt::Display for LandmarkKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// The markers on landmarks, and the camera that sees them.
#[derive(Debug, Clone, PartialEq)]
pub struct Markers {
    camera: MarkerCamera,
    /// The markers of each landmark.
    marked: Vec<Option<Marked>>,
}

/// A landmark with markers.
#[derive(Debug, Clone, PartialEq)]
struct Marked {
    kind: LandmarkKind,
    /// Position of each marker relative to the landmark, and the direction it faces, in radians counter-clockwise from east.
    markers: Vec<(Point, f64)>,
}

/// A marker on a floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Marker {
    /// The kind of landmark that the marker stands for.
    pub kind: LandmarkKind,
    /// Position, in metres.
    pub at: Point,
    /// The direction that the marker faces, in radians counter-clockwise from east.
    pub facing_rad: f64,
}

/// A kind of landmark that a camera may see from somewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shown {
    /// The kind.
    pub kind: LandmarkKind,
    /// Probability that one picture doesn't show it.
    pub missed: f64,
}

impl Markers {
    /// Assigns each marker to the nearest landmark within reach. Markers out of reach of any landmark are ignored. Rejects a
    /// landmark with markers of two kinds.
    pub fn new(
        camera: MarkerCamera,
        landmarks: &[Point],
        radius_m: f64,
        markers: impl Iterator<Item = Marker>,
    ) -> Result<Self, Error> {
        let mut marked: Vec<Option<Marked>> = vec![None; landmarks.len()];
        for Marker { kind, at, facing_rad } in markers {
            let Some(dot) = nearest(landmarks, at, reach_m(radius_m)) else { continue };
            let own = marked[dot].get_or_insert(Marked { kind, markers: Vec::new() });
            if own.kind != kind {
                let Point { x, y } = landmarks[dot];
                return Err(Error::TwoKinds { x, y, first: own.kind, second: kind });
            }
            own.markers.push((at - landmarks[dot], facing_rad));
        }
        Ok(Self { camera, marked })
    }

    /// Returns the markers of some of the landmarks, in their order.
    pub fn of_some(&self, landmarks: &[DotId]) -> Self {
        let own = |dot: &DotId| self.marked.get(*dot as usize).cloned().flatten();
        Self { camera: self.camera.clone(), marked: landmarks.iter().map(own).collect() }
    }

    /// Returns the kind of a landmark, or `None` if it has no marker.
    pub fn kind(&self, landmark: DotId) -> Option<LandmarkKind> {
        Some(self.marked.get(landmark as usize)?.as_ref()?.kind)
    }

    /// Returns the name of a landmark's kind for display, which is `pole` without a marker.
    pub fn name(&self, landmark: DotId) -> String {
        self.kind(landmark).map_or("pole".to_owned(), |kind| kind.to_string())
    }

    /// Returns the kind of a landmark if the robot's camera may see one of its markers. `at` is the landmark's position relative to
    /// the robot. Occlusion is not considered.
    pub fn shown(&self, landmark: DotId, at: Point) -> Option<Shown> {
        let Marked { kind, markers } = self.marked.get(landmark as usize)?.as_ref()?;
        let mount = self.camera.mount();
        let missed = markers.iter().filter_map(|&(beside, facing_rad)| {
            let way = at + beside - Point::new(mount.x, mount.y);
            let (distance_m, towards_rad) = (way.norm(), way.y.atan2(way.x));
            let bearing_rad = wrap_angle(towards_rad - mount.yaw_rad);
            let slant_rad = wrap_angle(towards_rad + std::f64::consts::PI - facing_rad).abs();
            let is_seen = self.camera.sees(distance_m, bearing_rad, slant_rad);
            is_seen.then(|| self.camera.missed(distance_m))
        });
        missed.reduce(|all, missed| all * missed).map(|missed| Shown { kind: *kind, missed })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::camera;

    #[test]
    fn a_kind_is_a_word_that_maps_have_no_other_use_for() {
        for name in ["door", "fire-door-2", "x"] {
            assert_eq!(LandmarkKind::of(name).map(|kind| kind.to_string()), Some(name.to_owned()));
        }
        let wrong = [
            "",
            "Door",
            "2nd",
            "-door",
            "fire door",
            "tür",
            "landmark",
            "isol",
            "left2",
            "a-door-that-is-wide",
        ];
        for name in wrong {
            assert_eq!(LandmarkKind::of(name), None, "{name}");
        }
        let stored = postcard::to_allocvec(&LandmarkKind::of("door").unwrap()).unwrap();
        assert_eq!(postcard::from_bytes::<LandmarkKind>(&stored).ok(), LandmarkKind::of("door"));
        assert!(postcard::from_bytes::<LandmarkKind>(b"\x04Door").is_err());
    }

    /// A camera with a full field of view and a range of 6 m detects markers at angles of up to 60 degrees.
    #[test]
    fn a_kind_shows_where_the_camera_sees_a_marker() {
        let door = LandmarkKind::of("door").unwrap();
        let landmarks = [Point::new(10.0, 10.0), Point::new(14.0, 10.0)];
        let marker = |x: f64, facing_rad: f64| Marker { kind: door, at: Point::new(x, 10.0), facing_rad };
        let markers = [marker(9.85, std::f64::consts::PI), marker(12.0, 0.0)];
        let markers = Markers::new(camera(0.1), &landmarks, 0.15, markers.into_iter()).unwrap();
        assert_eq!(
            [0, 1, 2].map(|dot| markers.kind(dot)),
            [Some(door), None, None],
            "12 m is beside neither"
        );
        let shown = |x: f64, y: f64| markers.shown(0, Point::new(x, y)).map(|shown| shown.kind);
        assert_eq!(shown(3.0, 0.0), Some(door), "from the west");
        assert_eq!(shown(-3.0, 0.0), None, "from the east, its back");
        assert_eq!((shown(3.0, 4.0), shown(2.0, 4.0)), (Some(door), None), "at 53 and at 65 degrees");
        assert_eq!(shown(6.5, 0.0), None, "too far");
        let missed = |x: f64| markers.shown(0, Point::new(x, 0.0)).unwrap().missed;
        assert!((missed(6.0) - 0.197).abs() < 0.002 && missed(2.0) < missed(5.0), "{}", missed(6.0));
        assert_eq!(markers.of_some(&[1, 0]).kind(1), Some(door));
    }

    #[test]
    fn a_landmark_has_one_kind() {
        let marker = |kind: &str, y: f64| Marker {
            kind: LandmarkKind::of(kind).unwrap(),
            at: Point::new(0.0, y),
            facing_rad: 0.0,
        };
        let markers = [marker("door", 0.15), marker("stairs", -0.15)];
        let both = Markers::new(camera(0.0), &[Point::default()], 0.15, markers.into_iter());
        let error = both.unwrap_err().to_string();
        assert_eq!(error, "landmark at (0, 0): expected markers of one kind, found door and stairs");
    }
}

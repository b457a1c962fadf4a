//! Planes of dots as files (TOML), and the plane that a file describes.
//!
//! ```toml
//! name = "a hundred dots"
//! random = { dots = 100, side_m = 1.0, seed = 4 }   # or clustered, dots or picture
//! ```
//!
//! - `dots = [[x, y], …]`: positions in metres.
//! - `random = { dots, side_m, seed }`: uniformly distributed on a square.
//! - `clustered = { dots, side_m, clusters, spread_m, seed }`: normally distributed around random centres.
//! - `picture = { file, pixels_per_m }`: the spots in a picture taken vertically from above. The origin is
//!   the lower left corner of the picture, with x to the right and y up.

use serde::Deserialize;
use sketchnav_dots::alike::alike;
use sketchnav_dots::generate;
use sketchnav_dots::picture::{self, Reading};
use sketchnav_schemas::bounds;
use sketchnav_schemas::toml_text;

use crate::error::{SimError, check, check_within};

/// A plane of dots, as described by a plane file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlaneDescription {
    /// Display name of the plane.
    pub name: String,
    /// Positions of the dots, in metres, in frame `World`. No two are the same.
    pub dots: Vec<[f64; 2]>,
}

/// A plane file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaneFile {
    /// Display name of the plane.
    #[serde(default)]
    pub name: String,
    dots: Option<Vec<[f64; 2]>>,
    random: Option<Random>,
    clustered: Option<Clustered>,
    picture: Option<PictureSource>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Random {
    dots: usize,
    side_m: f64,
    seed: u64,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Clustered {
    dots: usize,
    side_m: f64,
    clusters: usize,
    spread_m: f64,
    seed: u64,
}

/// A picture of a plane.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PictureSource {
    /// Name of the picture's file, in the folder of the plane file.
    pub file: String,
    /// Scale, in pixels per metre.
    pub pixels_per_m: f64,
}

impl PlaneFile {
    /// Reads a plane file.
    ///
    /// # Errors
    /// [`SimError::Toml`] if it is invalid, or [`SimError::Value`] unless it has exactly one source of dots.
    pub fn parse(text: &str) -> Result<Self, SimError> {
        let file: Self = toml_text::read(text)?;
        let sources =
            [file.dots.is_some(), file.random.is_some(), file.clustered.is_some(), file.picture.is_some()];
        let count = sources.into_iter().filter(|&is_given| is_given).count();
        check(count == 1, "plane", "one of dots, random, clustered and picture", count)?;
        Ok(file)
    }

    /// Returns the picture that the plane file names, if any.
    pub fn picture(&self) -> Option<&PictureSource> {
        self.picture.as_ref()
    }

    /// Returns the plane that the file describes. `picture` is the content of the picture file that it names.
    ///
    /// # Errors
    /// [`SimError`], which names the key, if there are no dots or too many, a number is out of bounds, or two
    /// dots are at the same position.
    pub fn describe(&self, picture: &[u8]) -> Result<PlaneDescription, SimError> {
        let dots = self.places(picture)?;
        let most = bounds::MOST_PLANE_DOTS;
        check((1..=most).contains(&dots.len()), "dots", "1 to 20000 dots", dots.len())?;
        check_within("dots", bounds::COORDINATE_M, dots.as_flattened())?;
        if let Some((first, second)) = generate::same_place(&dots) {
            let [x, y] = dots[first];
            return Err(SimError::Value {
                key: format!("dots {} and {}", first + 1, second + 1),
                expected: "different places",
                found: format!("both at ({x}, {y}) m"),
            });
        }
        Ok(PlaneDescription { name: self.name.clone(), dots })
    }

    fn places(&self, bytes: &[u8]) -> Result<Vec<[f64; 2]>, SimError> {
        let few = |count: usize| check(count <= bounds::MOST_PLANE_DOTS, "dots", "1 to 20000 dots", count);
        if let Some(Random { dots, side_m, seed }) = self.random {
            few(dots)?;
            check_within("random.side_m", bounds::PLANE_SIDE_M, &[side_m])?;
            return Ok(generate::uniform(dots, side_m, seed)?);
        }
        if let Some(Clustered { dots, side_m, clusters, spread_m, seed }) = self.clustered {
            few(dots)?;
            check_within("clustered.side_m", bounds::PLANE_SIDE_M, &[side_m])?;
            let is_spread = spread_m >= bounds::PLANE_SIDE_M.least && spread_m <= side_m;
            check(is_spread, "clustered.spread_m", "0.001 m to side_m", spread_m)?;
            let most = bounds::MOST_PLANE_DOTS;
            check((1..=most).contains(&clusters), "clustered.clusters", "1 to 20000 clusters", clusters)?;
            return Ok(generate::clustered(dots, side_m, clusters, spread_m, seed)?);
        }
        if let Some(PictureSource { pixels_per_m, .. }) = self.picture {
            check_within("picture.pixels_per_m", bounds::PICTURE_PXPM, &[pixels_per_m])?;
            let Reading { spots, height, .. } = picture::read(bytes)?;
            // Frames, letters and dirt are not dots. Seen vertically from above, all dots look alike.
            let (dots, _) = alike(spots, |_| 1.0);
            let place = |[x, y]: [f64; 2]| [x / pixels_per_m, (f64::from(height) - y) / pixels_per_m];
            return Ok(dots.iter().map(|dot| place(dot.at)).collect());
        }
        Ok(self.dots.clone().unwrap_or_default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<PlaneDescription, SimError> {
        PlaneFile::parse(text)?.describe(&[])
    }

    #[test]
    fn a_plane_is_listed_or_generated_from_a_seed() {
        assert_eq!(read("dots = [[0.5, 1.0], [2.0, 3.0]]").unwrap().dots, [[0.5, 1.0], [2.0, 3.0]]);
        let random = read("random = { dots = 100, side_m = 1.0, seed = 4 }").unwrap();
        assert_eq!(random.dots, generate::uniform(100, 1.0, 4).unwrap());
        let crowded = "clustered = { dots = 50, side_m = 2.0, clusters = 5, spread_m = 0.1, seed = 1 }";
        assert_eq!(read(crowded).unwrap().dots.len(), 50);
    }

    #[test]
    fn errors_name_the_key() {
        for (text, words) in [
            ("name = 'p'", "plane: expected one of dots, random, clustered and picture, found 0"),
            ("dots = [[0, 0]]\nrandom = { dots = 1, side_m = 1.0, seed = 4 }", "found 2"),
            ("dots = []", "dots: expected 1 to 20000 dots, found 0"),
            (
                "dots = [[1, 2], [3, 4], [1, 2]]",
                "dots 1 and 3: expected different places, found both at (1, 2) m",
            ),
            ("dots = [[1, nan]]", "dots: expected -10000 to 10000 m"),
            ("random = { dots = 10, side_m = -1.0, seed = 4 }", "random.side_m: expected 0.001 to 10000 m"),
            ("random = { dots = 1000000, side_m = 1.0, seed = 4 }", "dots: expected 1 to 20000 dots"),
            ("random = { dots = 10, side = 1.0, seed = 4 }", "unknown field `side`"),
            (
                "clustered = { dots = 10, side_m = 1.0, clusters = 0, spread_m = 0.1, seed = 1 }",
                "clustered.clusters: expected 1 to 20000 clusters, found 0",
            ),
            // That many centres would not fit into memory.
            (
                "clustered = { dots = 10, side_m = 1.0, clusters = 9000000000000000000, spread_m = 0.1, seed = 1 }",
                "clustered.clusters: expected 1 to 20000 clusters",
            ),
            // Without a spread, all dots of a cluster coincided, and drawing them again never ended.
            (
                "clustered = { dots = 10, side_m = 1.0, clusters = 1, spread_m = 1e-300, seed = 1 }",
                "clustered.spread_m: expected 0.001 m to side_m",
            ),
            (
                "clustered = { dots = 10, side_m = 1.0, clusters = 1, spread_m = 2.0, seed = 1 }",
                "clustered.spread_m: expected 0.001 m to side_m, found 2.0",
            ),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}

//! Maps of ROS's map_server: a YAML beside a picture.
//!
//! The occupancy of a cell of grey value v is p = (255 − v)/255, or v/255 where `negate` is set. It is occupied above
//! `occupied_thresh`, free below `free_thresh`, and unknown between (mode `trinary`). **Whatever is not free is solid
//! here**: nobody knows that one could drive through an unknown cell, and people draw furniture with grey outlines.
//! Beyond the picture everything is solid. What is drawn so lightly that the map calls it free (the inside of a
//! cupboard, the thin legs of a chair) stays free. A grey outline still keeps the robot and the laser out of it. A
//! lower `free_thresh` in the YAML makes it solid.

use std::io::Cursor;

use image::{DynamicImage, ImageDecoder, ImageReader};
use serde::Deserialize;
use sketchnav_schemas::bounds;

use crate::convex::Convex;
use crate::description::WorldDescription;
use crate::error::{SimError, check, check_within};
use crate::raster::{CellBox, Raster};

/// The YAML of a map. Unknown keys are ignored.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct MapInfo {
    /// Path of the picture, relative to the YAML.
    pub image: String,
    /// Metres a pixel.
    pub resolution: f64,
    /// Place of the lower left corner of the lower left pixel: x and y in metres, yaw in radians.
    pub origin: [f64; 3],
    /// Whether light is occupied and dark free.
    #[serde(default)]
    pub negate: Negate,
    /// Above this a cell is occupied.
    pub occupied_thresh: f64,
    /// Below this a cell is free.
    pub free_thresh: f64,
    /// How pixels are read: `trinary` alone.
    #[serde(default = "trinary")]
    pub mode: String,
}

fn trinary() -> String {
    "trinary".into()
}

/// `negate` as people write it.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Negate {
    /// `true` or `false`.
    Bool(bool),
    /// `1` or `0`.
    Number(i64),
}

impl Default for Negate {
    fn default() -> Self {
        Self::Number(0)
    }
}

/// A map: which cells are solid, and where they lie.
#[derive(Debug, Clone, PartialEq)]
pub struct OccupancyMap {
    raster: Raster,
    resolution_m: f64,
    origin_m: [f64; 2],
}

impl MapInfo {
    /// Reads the YAML.
    ///
    /// # Errors
    /// [`SimError::Yaml`], or [`SimError::Value`] with the key and what was expected.
    pub fn parse(text: &str) -> Result<Self, SimError> {
        let info: Self = serde_saphyr::from_str(text).map_err(|error| SimError::Yaml(error.to_string()))?;
        info.check()?;
        Ok(info)
    }

    fn check(&self) -> Result<(), SimError> {
        let resolution = self.resolution;
        check(!self.image.is_empty(), "image", "the path of a picture", &self.image)?;
        check(resolution > 0.0, "resolution", "a number above 0", resolution)?;
        check((1e-3..=10.0).contains(&resolution), "resolution", "0.001 to 10 metres a pixel", resolution)?;
        check_within("origin", bounds::COORDINATE_M, &self.origin[..2])?;
        check(self.origin[2] == 0.0, "origin", "a yaw of 0 (a turned map is not supported)", self.origin[2])?;
        let known = matches!(self.negate, Negate::Bool(_) | Negate::Number(0 | 1));
        check(known, "negate", "0 or 1", self.negate)?;
        check(self.mode == "trinary", "mode", "trinary", &self.mode)?;
        let (free, occupied) = (self.free_thresh, self.occupied_thresh);
        for (key, value) in [("free_thresh", free), ("occupied_thresh", occupied)] {
            check((0.0..=1.0).contains(&value), key, "a number from 0 to 1", value)?;
        }
        check(free < occupied, "free_thresh", "less than occupied_thresh", (free, occupied))
    }

    fn is_free(&self, grey: f64) -> bool {
        let negate = matches!(self.negate, Negate::Bool(true) | Negate::Number(1));
        let occupancy = if negate { grey / 255.0 } else { (255.0 - grey) / 255.0 };
        occupancy < self.free_thresh
    }
}

impl OccupancyMap {
    /// Decodes the picture (PGM or PNG; the mean of red, green and blue counts, opacity does not).
    ///
    /// # Errors
    /// [`SimError::Picture`], or [`SimError::Value`] where the picture has no free cell, or is too large.
    pub fn decode(info: &MapInfo, picture: &[u8]) -> Result<Self, SimError> {
        let reader = ImageReader::new(Cursor::new(picture)).with_guessed_format()?;
        let decoder = reader.into_decoder()?;
        let (width, height) = decoder.dimensions();
        let cells = u64::from(width) * u64::from(height);
        let size = format!("{width} x {height} pixels");
        check(cells <= bounds::MOST_MAP_CELLS, "image", "at most 16000000 pixels", &size)?;
        let image = DynamicImage::from_decoder(decoder)?.to_rgb8();
        let (width, height) = (image.width() as usize, image.height() as usize);
        // Rows of a picture go down, rows of a map up.
        let pixels = image.rows().rev().flatten();
        let solid =
            |pixel: &image::Rgb<u8>| !info.is_free(pixel.0.iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0);
        let cells: Vec<bool> = pixels.map(solid).collect();
        check(cells.contains(&false), "image", "a picture with free cells", &size)?;
        let raster = Raster::new(width, height, cells).unwrap_or_else(|| unreachable!("a cell a pixel"));
        let [x, y, _] = info.origin;
        Ok(Self { raster, resolution_m: info.resolution, origin_m: [x, y] })
    }

    /// Its cells, row 0 at the bottom.
    pub fn raster(&self) -> &Raster {
        &self.raster
    }

    /// Metres a cell.
    pub fn resolution_m(&self) -> f64 {
        self.resolution_m
    }

    /// Lower left corner of the lower left cell, metres, frame `World`.
    pub fn origin_m(&self) -> [f64; 2] {
        self.origin_m
    }

    /// The map as walls.
    ///
    /// # Errors
    /// [`SimError::Value`] where they are too many: a picture of noise.
    pub fn describe(&self, name: &str) -> Result<WorldDescription, SimError> {
        let outline = self.raster.outline().into_iter().map(|segment| segment.map(|p| self.corner(p)));
        let most = bounds::MOST_MAP_SOLIDS;
        let boxes = self.raster.boxes(most).ok_or_else(|| SimError::Value {
            key: "image".into(),
            expected: "a picture of at most 100000 rectangles of occupied cells",
            found: "more".into(),
        })?;
        let walls = boxes.into_iter().map(|cells| self.wall(cells));
        Ok(WorldDescription {
            name: name.to_owned(),
            outline: outline.collect(),
            walls: walls.collect(),
            ..Default::default()
        })
    }

    fn corner(&self, cell: [i64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| self.origin_m[axis] + cell[axis] as f64 * self.resolution_m)
    }

    fn wall(&self, cells: CellBox) -> Convex {
        let (low, high) = (self.corner([cells.x0, cells.y0]), self.corner([cells.x1, cells.y1]));
        let middle = [0, 1].map(|axis| (low[axis] + high[axis]) / 2.0);
        Convex::rectangle(middle, [high[0] - low[0], high[1] - low[1]], 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const YAML: &str = "image: m.pgm\nresolution: 0.5\norigin: [-1.0, 2, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";

    fn map(yaml: &str, pixels: &str) -> Result<OccupancyMap, SimError> {
        OccupancyMap::decode(&MapInfo::parse(yaml)?, format!("P2\n3 2\n255\n{pixels}\n").as_bytes())
    }

    #[test]
    fn rows_go_up_and_what_is_not_free_is_solid() {
        let map = map(YAML, "0 205 254\n 254 254 206").unwrap();
        let solid = |x, y| map.raster.is_solid(x, y);
        assert_eq!([solid(0, 1), solid(1, 1), solid(2, 1)], [true, true, false]);
        assert_eq!([solid(0, 0), solid(1, 0), solid(2, 0)], [false; 3]);
        assert_eq!(map.corner([0, 0]), [-1.0, 2.0]);
        assert_eq!(map.corner([2, 1]), [0.0, 2.5]);
    }

    #[test]
    fn negate_turns_light_and_dark_around() {
        let yaml = YAML.replace("negate: 0", "negate: true");
        let map = map(&yaml, "0 205 254\n 254 254 206").unwrap();
        assert!(!map.raster.is_solid(0, 1) && map.raster.is_solid(2, 1));
    }

    #[test]
    fn a_yaml_that_lies_is_refused_with_the_key() {
        let cases = [
            ("resolution: 0.5", "resolution: 0", "resolution: expected a number above 0"),
            ("[-1.0, 2, 0]", "[-1.0, 2, 0.3]", "origin: expected a yaw of 0"),
            ("free_thresh: 0.196", "free_thresh: 0.7", "free_thresh: expected less than occupied_thresh"),
            ("negate: 0", "negate: 7", "negate: expected 0 or 1"),
            ("negate: 0", "mode: scale", "mode: expected trinary"),
            ("image: m.pgm\n", "", "image"),
        ];
        for (from, to, message) in cases {
            let error = MapInfo::parse(&YAML.replace(from, to)).unwrap_err().to_string();
            assert!(error.contains(message), "{error}");
        }
        let error = map(YAML, "0 0 0\n0 0 0").unwrap_err().to_string();
        assert!(error.contains("expected a picture with free cells"), "{error}");
        assert!(map(YAML, "0 0").is_err());
    }

    /// A picture of noise is a rectangle every few pixels, each of which the physics holds. One of a billion pixels
    /// filled the memory before its size was checked.
    #[test]
    fn a_picture_that_is_no_floor_is_refused() {
        let info = MapInfo::parse(YAML).unwrap();
        let large = OccupancyMap::decode(&info, b"P5\n40000 30000\n255\n").unwrap_err().to_string();
        assert_eq!(large, "image: expected at most 16000000 pixels, found \"40000 x 30000 pixels\"");
        let mut noise = b"P5\n1000 1000\n255\n".to_vec();
        noise.extend((0..1_000_000_u32).map(|i| if (i % 1000 + i / 1000) % 2 == 0 { 0 } else { 254 }));
        let error = OccupancyMap::decode(&info, &noise).unwrap().describe("noise").unwrap_err().to_string();
        assert!(error.contains("image: expected a picture of at most 100000 rectangles"), "{error}");
    }
}

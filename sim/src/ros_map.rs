//! Maps in the format of ROS's map_server: a YAML file next to an image.
//!
//! The occupancy of a cell with the grey value v is p = (255 − v)/255, or v/255 if `negate` is set. The cell is occupied above
//! `occupied_thresh`, free below `free_thresh`, and unknown in between (mode `trinary`). **Here, every cell that is not free is
//! solid**, because the robot might not be able to drive through an unknown cell, and because furniture is often drawn with grey
//! outlines. Everything outside the image is solid. Anything drawn so lightly that it counts as free (the inside of a cupboard, the
//! thin legs of a chair) stays free, but a grey outline still keeps the robot and the laser out of it. To make it solid, lower
//! `free_thresh` in the YAML file.

use std::io::Cursor;

use image::{DynamicImage, ImageDecoder, ImageReader};
use serde::Deserialize;
use sketchnav_schemas::bounds;
use sketchnav_schemas::geometry::wrap_angle;

use crate::convex::Convex;
use crate::description::{Extent, WorldDescription};
use crate::error::{SimError, check, check_within};
use crate::raster::{CellBox, Raster};

/// Describes a position at which the image is transparent.
pub(crate) const TRANSPARENT: &str = "a transparent part of the map: transparent counts as unknown, and unknown as solid; \
    save the picture with a white background";
/// Yaw of a map, in radians, below which the map counts as not rotated. Over 100 m, such a yaw displaces a position by at most a
/// centimetre.
const LEAST_YAW_RAD: f64 = 1e-4;

/// The YAML file of a map. Unknown keys are ignored.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct MapInfo {
    /// Path of the image, relative to the YAML file.
    pub image: String,
    /// Metres per pixel.
    pub resolution: f64,
    /// Position of the lower left corner of the lower left pixel: x and y in metres, and yaw in radians.
    pub origin: [f64; 3],
    /// Whether light cells are occupied and dark ones free.
    #[serde(default)]
    pub negate: Negate,
    /// Occupancy above which a cell is occupied.
    pub occupied_thresh: f64,
    /// Occupancy below which a cell is free.
    pub free_thresh: f64,
    /// How pixels are interpreted. Only `trinary` is accepted.
    #[serde(default = "trinary")]
    pub mode: String,
}

fn trinary() -> String {
    "trinary".into()
}

/// The value of `negate` as people write it: a number, a word, or either in quotes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(try_from = "Written")]
pub struct Negate(bool);

/// A single value in a YAML file.
#[derive(Deserialize)]
#[serde(untagged)]
enum Written {
    Bool(bool),
    Number(f64),
    Text(String),
    Else(serde::de::IgnoredAny),
}

impl TryFrom<Written> for Negate {
    type Error = String;

    fn try_from(written: Written) -> Result<Self, String> {
        let text = match written {
            Written::Bool(negate) => return Ok(Self(negate)),
            Written::Number(number) => number.to_string(),
            Written::Text(text) => text.trim().to_ascii_lowercase(),
            Written::Else(_) => "something else".into(),
        };
        match text.as_str() {
            "1" | "true" => Ok(Self(true)),
            "0" | "false" => Ok(Self(false)),
            _ => Err(format!("negate: expected 0 or 1, found {text}")),
        }
    }
}

/// A map: which cells are solid, and where they are.
#[derive(Debug, Clone, PartialEq)]
pub struct OccupancyMap {
    raster: Raster,
    /// For each cell in the order of the raster, whether the image is transparent there. Empty if it is not transparent anywhere.
    transparent: Vec<bool>,
    resolution_m: f64,
    origin_m: [f64; 2],
}

impl MapInfo {
    /// Reads the YAML file of a map.
    ///
    /// # Errors
    /// [`SimError::Yaml`], or [`SimError::Value`], which names the key and what was expected.
    pub fn parse(text: &str) -> Result<Self, SimError> {
        let info: Self = serde_saphyr::from_str(text).map_err(|error| SimError::Yaml(error.to_string()))?;
        info.check()?;
        Ok(info)
    }

    fn check(&self) -> Result<(), SimError> {
        let resolution = self.resolution;
        check(!self.image.is_empty(), "image", "the path of a picture", &self.image)?;
        check(resolution > 0.0, "resolution", "a number above 0", resolution)?;
        check((1e-3..=10.0).contains(&resolution), "resolution", "0.001 to 10 metres per pixel", resolution)?;
        check_within("origin", bounds::COORDINATE_M, &self.origin[..2])?;
        let yaw_rad = wrap_angle(self.origin[2]);
        // The comparison is also false for NaN.
        let is_straight = yaw_rad.abs() < LEAST_YAW_RAD;
        check(is_straight, "origin", "a yaw of 0 (a rotated map is not supported)", self.origin[2])?;
        check(self.mode == "trinary", "mode", "trinary", &self.mode)?;
        let (free, occupied) = (self.free_thresh, self.occupied_thresh);
        for (key, value) in [("free_thresh", free), ("occupied_thresh", occupied)] {
            check((0.0..=1.0).contains(&value), key, "a number from 0 to 1", value)?;
        }
        check(free < occupied, "free_thresh", "less than occupied_thresh", (free, occupied))
    }

    fn is_free(&self, grey: f64) -> bool {
        let occupancy = if self.negate.0 { grey / 255.0 } else { (255.0 - grey) / 255.0 };
        occupancy < self.free_thresh
    }
}

impl OccupancyMap {
    /// Decodes an image in PGM, PNG or BMP. The value of a pixel is the mean of red, green and blue. Where the image is
    /// transparent, the cell is unknown and therefore solid.
    ///
    /// # Errors
    /// [`SimError::Picture`] if it cannot be decoded, or [`SimError::Value`] if it has no free cell or is too large.
    pub fn decode(info: &MapInfo, picture: &[u8]) -> Result<Self, SimError> {
        let reader = ImageReader::new(Cursor::new(picture)).with_guessed_format()?;
        let decoder = reader.into_decoder()?;
        let (width, height) = decoder.dimensions();
        let cells = u64::from(width) * u64::from(height);
        let size = format!("{width} x {height} pixels");
        check(cells <= bounds::MOST_MAP_CELLS, "image", "at most 16000000 pixels", &size)?;
        let image = DynamicImage::from_decoder(decoder)?.to_rgba8();
        let (width, height) = (image.width() as usize, image.height() as usize);
        // The rows of an image go down, those of a map go up.
        let pixels = image.rows().rev().flatten();
        let is_free = |pixel: &image::Rgba<u8>| {
            info.is_free(pixel.0[..3].iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0)
        };
        let clear = |pixel: &image::Rgba<u8>| pixel.0[3] < 128;
        let mut transparent: Vec<bool> = pixels.clone().map(clear).collect();
        let cells: Vec<bool> = pixels.map(|pixel| clear(pixel) || !is_free(pixel)).collect();
        let count = transparent.iter().filter(|clear| **clear).count();
        if !cells.contains(&false) {
            return Err(without_floor(size, count));
        }
        if count == 0 {
            transparent = Vec::new();
        }
        let raster = Raster::new(width, height, cells).unwrap_or_else(|| unreachable!("a cell a pixel"));
        let [x, y, _] = info.origin;
        Ok(Self { raster, transparent, resolution_m: info.resolution, origin_m: [x, y] })
    }

    /// Creates a map from its cells. `is_solid` receives the index of a cell, row by row from the bottom up.
    ///
    /// # Errors
    /// [`SimError::Value`] if it has no free cell or is too large.
    pub fn of_cells(
        [width, height]: [usize; 2],
        resolution_m: f64,
        origin_m: [f64; 2],
        is_solid: impl Fn(usize) -> bool,
    ) -> Result<Self, SimError> {
        let size = format!("{width} x {height} cells");
        let is_small = width as u64 * height as u64 <= bounds::MOST_MAP_CELLS;
        check(is_small, "map", "at most 16000000 cells", &size)?;
        let cells: Vec<_> = (0..width * height).map(is_solid).collect();
        check(cells.contains(&false), "map", "a free cell", &size)?;
        let raster = Raster::new(width, height, cells).unwrap_or_else(|| unreachable!("a state per cell"));
        Ok(Self { raster, transparent: Vec::new(), resolution_m, origin_m })
    }

    /// Returns the share of cells where the image is transparent, which makes them unknown.
    pub fn transparent_share(&self) -> f64 {
        self.transparent.iter().filter(|clear| **clear).count() as f64 / self.transparent.len().max(1) as f64
    }

    /// Returns true if the image is transparent in the cell in column `x` and row `y`.
    pub fn is_transparent(&self, x: i64, y: i64) -> bool {
        let (width, height) = self.raster.size();
        let inside = (0..width as i64).contains(&x) && (0..height as i64).contains(&y);
        inside && self.transparent.get(y as usize * width + x as usize).copied().unwrap_or(false)
    }

    /// Describes why a position (in metres, frame `World`) is solid, or returns `None` if it is free.
    pub(crate) fn solid_at(&self, at: [f64; 2]) -> Option<&'static str> {
        let [x, y] = [0, 1].map(|axis| ((at[axis] - self.origin_m[axis]) / self.resolution_m).floor() as i64);
        match (self.is_transparent(x, y), self.raster.is_solid(x, y)) {
            (true, _) => Some(TRANSPARENT),
            (_, true) => Some("an occupied or unknown part of the map"),
            _ => None,
        }
    }

    /// Returns the extent of the image.
    pub(crate) fn extent(&self) -> Extent {
        let (width, height) = self.raster.size();
        Extent::of([self.corner([0, 0]), self.corner([width as i64, height as i64])])
    }

    /// Returns the cells of the map, with row 0 at the bottom.
    pub fn raster(&self) -> &Raster {
        &self.raster
    }

    /// Returns the size of a cell, in metres.
    pub fn resolution_m(&self) -> f64 {
        self.resolution_m
    }

    /// Returns the lower left corner of the lower left cell, in metres, in frame `World`.
    pub fn origin_m(&self) -> [f64; 2] {
        self.origin_m
    }

    /// Converts the map to a world with walls.
    ///
    /// # Errors
    /// [`SimError::Value`] if it would need too many walls, as an image of noise does.
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
            map: Some(self.clone()),
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

/// Returns the error for an image without a free cell. People get such an image if they export only the walls, with a transparent
/// background.
fn without_floor(size: String, transparent: usize) -> SimError {
    let found = match transparent {
        0 => size,
        count => format!(
            "{size}, {count} of them transparent: transparent cells count as unknown, and unknown as solid; \
            save the picture with a white background"
        ),
    };
    SimError::Value { key: "image".into(), expected: "a picture with free cells", found }
}

#[cfg(test)]
mod tests {
    use sketchnav_schemas::mission::{Place, Task};

    use super::*;

    const YAML: &str = "image: m.pgm\nresolution: 0.5\norigin: [-1.0, 2, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";

    fn map(yaml: &str, pixels: &str) -> Result<OccupancyMap, SimError> {
        OccupancyMap::decode(&MapInfo::parse(yaml)?, format!("P2\n3 2\n255\n{pixels}\n").as_bytes())
    }

    #[test]
    fn rows_run_upwards_and_unknown_cells_are_solid() {
        let map = map(YAML, "0 205 254\n 254 254 206").unwrap();
        let solid = |x, y| map.raster.is_solid(x, y);
        assert_eq!([solid(0, 1), solid(1, 1), solid(2, 1)], [true, true, false]);
        assert_eq!([solid(0, 0), solid(1, 0), solid(2, 0)], [false; 3]);
        assert_eq!(map.corner([0, 0]), [-1.0, 2.0]);
        assert_eq!(map.corner([2, 1]), [0.0, 2.5]);
    }

    #[test]
    fn a_map_of_cells_is_that_of_its_picture() {
        let of_picture = map(YAML, "0 205 254\n 254 254 206").unwrap();
        let of_cells = |size, solid: &[bool]| OccupancyMap::of_cells(size, 0.5, [-1.0, 2.0], |i| solid[i]);
        assert_eq!(of_cells([3, 2], &[false, false, false, true, true, false]).unwrap(), of_picture);
        let error = of_cells([2, 1], &[true, true]).unwrap_err().to_string();
        assert_eq!(error, "map: expected a free cell, found \"2 x 1 cells\"");
    }

    #[test]
    fn negate_turns_light_and_dark_around() {
        let yaml = YAML.replace("negate: 0", "negate: true");
        let map = map(&yaml, "0 205 254\n 254 254 206").unwrap();
        assert!(!map.raster.is_solid(0, 1) && map.raster.is_solid(2, 1));
    }

    #[test]
    fn invalid_yaml_is_refused_with_the_key() {
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

    #[test]
    fn a_negligible_yaw_and_a_quoted_negate_are_accepted() {
        for yaw in ["-1.2e-17", "6.283185307179586", "6.283185", "-6.2832", "0.0", "1e-9"] {
            let yaml = YAML.replace("[-1.0, 2, 0]", &format!("[-1.0, 2, {yaw}]"));
            assert!(MapInfo::parse(&yaml).is_ok(), "{yaw}");
        }
        for yaw in ["3.14159", "1.5708", ".nan", "0.01"] {
            let error =
                MapInfo::parse(&YAML.replace("[-1.0, 2, 0]", &format!("[-1.0, 2, {yaw}]"))).unwrap_err();
            assert!(error.to_string().contains("origin: expected a yaw of 0"), "{yaw}: {error}");
        }
        for (negate, expected) in [
            ("\"0\"", false),
            ("'1'", true),
            ("0.0", false),
            ("1.0", true),
            ("False", false),
            ("\"true\"", true),
            ("\" 0 \"", false),
        ] {
            let info = MapInfo::parse(&YAML.replace("negate: 0", &format!("negate: {negate}"))).unwrap();
            assert_eq!(info.negate, Negate(expected), "{negate}");
        }
        for negate in ["maybe", "2", "-1", "[0]"] {
            let error = MapInfo::parse(&YAML.replace("negate: 0", &format!("negate: {negate}"))).unwrap_err();
            assert!(error.to_string().contains("negate: expected 0 or 1"), "{negate}: {error}");
        }
    }

    #[test]
    fn a_map_with_a_transparent_floor_is_reported() {
        let encoded = |floor: [u8; 4]| {
            let wall = |x: u32, y: u32| x == 0 || y == 0;
            let picture = image::RgbaImage::from_fn(5, 4, |x, y| {
                image::Rgba(if wall(x, y) { [0, 0, 0, 255] } else { floor })
            });
            let mut bytes = Cursor::new(Vec::new());
            picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
            bytes.into_inner()
        };
        let info = MapInfo::parse(YAML).unwrap();
        assert!(OccupancyMap::decode(&info, &encoded([255; 4])).is_ok());
        for floor in [[0, 0, 0, 0], [255, 255, 255, 0]] {
            let error = OccupancyMap::decode(&info, &encoded(floor)).unwrap_err().to_string();
            let words = "expected a picture with free cells, found 5 x 4 pixels, 12 of them transparent: \
                transparent cells count as unknown, and unknown as solid; save the picture with a white background";
            assert!(error.contains(words), "{error}");
        }
    }

    /// Regression test: a robot that started in a transparent part of the map could not move, and a goal there was never reached.
    #[test]
    fn places_in_the_transparent_part_of_a_map_are_refused_with_the_reason() {
        let picture = image::RgbaImage::from_fn(40, 20, |x, y| {
            let is_wall = [0, 39].contains(&x) || [0, 19].contains(&y);
            image::Rgba(if is_wall { [0, 0, 0, 255] } else { [255, 255, 255, if x < 20 { 255 } else { 0 }] })
        });
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        let map = OccupancyMap::decode(&MapInfo::parse(YAML).unwrap(), &bytes.into_inner()).unwrap();
        assert!((map.transparent_share() - 19.0 * 18.0 / 800.0).abs() < 1e-12);
        let world = map.describe("half").unwrap();
        let text_of = |error: SimError| error.to_string();
        assert!(world.check_start([4.0, 7.0]).is_ok());
        let error = text_of(world.check_start([14.0, 7.0]).unwrap_err());
        let words = "start.world: expected a free place, found (14, 7) m, in a transparent part of the map: transparent";
        assert!(error.starts_with(words), "{error}");
        let error = text_of(world.check_start([-0.9, 7.0]).unwrap_err());
        assert!(error.ends_with("found (-0.9, 7) m, in an occupied or unknown part of the map"), "{error}");
        let place = |x: f64| Place { center: Some([x, 7.0]), radius_m: Some(1.0), polygon: None };
        let task = |x: f64| Task {
            name: "there".into(),
            there: place(x),
            time_limit_s: 60.0,
            given: toml::Table::default(),
        };
        // An area that overlaps free floor can be reached.
        assert!(world.check_places(&[task(4.0), task(9.5)]).is_ok());
        let error = text_of(world.check_places(&[task(4.0), task(14.0)]).unwrap_err());
        assert!(error.contains("there: expected a place that reaches onto free floor, found"), "{error}");
        assert!(error.contains("a transparent part of the map"), "{error}");
    }

    /// An image of noise turns into a rectangle every few pixels, all of which the physics has to keep. An image of a billion
    /// pixels used to fill the memory before its size was checked.
    #[test]
    fn a_picture_without_a_floor_is_refused() {
        let info = MapInfo::parse(YAML).unwrap();
        let large = OccupancyMap::decode(&info, b"P5\n40000 30000\n255\n").unwrap_err().to_string();
        assert_eq!(large, "image: expected at most 16000000 pixels, found \"40000 x 30000 pixels\"");
        let mut noise = b"P5\n1000 1000\n255\n".to_vec();
        noise.extend((0..1_000_000_u32).map(|i| if (i % 1000 + i / 1000) % 2 == 0 { 0 } else { 254 }));
        let error = OccupancyMap::decode(&info, &noise).unwrap().describe("noise").unwrap_err().to_string();
        assert!(error.contains("image: expected a picture of at most 100000 rectangles"), "{error}");
    }
}

//! Drawings for tests: a small line-drawn building at any angle, drawn with a steady or an unsteady hand, on clean paper or on
//! a photographed sheet.

use std::io::Cursor;

use image::{DynamicImage, GrayImage, ImageFormat, Luma};
use rand::RngExt;
use sketchnav_schemas::seed;

/// Walls of a corridor with three rooms, in a square of 100 units. The gaps are doors.
pub const BUILDING: [[f64; 4]; 12] = [
    [0.0, 0.0, 100.0, 0.0],
    [100.0, 0.0, 100.0, 60.0],
    [100.0, 60.0, 0.0, 60.0],
    [0.0, 60.0, 0.0, 0.0],
    [0.0, 35.0, 12.0, 35.0],
    [22.0, 35.0, 46.0, 35.0],
    [56.0, 35.0, 80.0, 35.0],
    [90.0, 35.0, 100.0, 35.0],
    [33.0, 35.0, 33.0, 60.0],
    [66.0, 35.0, 66.0, 60.0],
    [0.0, 22.0, 30.0, 22.0],
    [40.0, 22.0, 100.0, 22.0],
];

/// The two ends of a line, in image pixels.
pub type Line = ((f64, f64), (f64, f64));

/// A page of ink and paper.
pub struct Sheet {
    pub width: u32,
    pub height: u32,
    pub pen: f64,
    pub paper: u8,
    pub ink: u8,
    /// Maximum deviation of the hand from a line, in pixels.
    pub wobble: f64,
}

impl Default for Sheet {
    fn default() -> Self {
        Self { width: 600, height: 500, pen: 4.0, paper: 255, ink: 0, wobble: 0.0 }
    }
}

impl Sheet {
    /// Draws the building, turned counter-clockwise (as one looks at it) about the middle of the page.
    pub fn building(&self, angle_rad: f64) -> GrayImage {
        let unit = f64::from(self.width.min(self.height)) / 140.0;
        let (sin, cos) = angle_rad.sin_cos();
        let place = |x: f64, y: f64| {
            let (x, y) = ((x - 50.0) * unit, (y - 30.0) * unit);
            let (x, y) = (x * cos - y * sin, x * sin + y * cos);
            (f64::from(self.width) / 2.0 + x, f64::from(self.height) / 2.0 - y)
        };
        let lines: Vec<_> = BUILDING.iter().map(|w| (place(w[0], w[1]), place(w[2], w[3]))).collect();
        self.lines(&lines)
    }

    /// Draws lines, in image pixels.
    pub fn lines(&self, lines: &[Line]) -> GrayImage {
        let mut page = GrayImage::from_pixel(self.width, self.height, Luma([self.paper]));
        let mut rng = seed::stream(7, "hand");
        for (from, to) in lines {
            let length = (to.0 - from.0).hypot(to.1 - from.1).max(1.0);
            let normal = ((from.1 - to.1) / length, (to.0 - from.0) / length);
            let phase: f64 = rng.random_range(0.0..std::f64::consts::TAU);
            for step in 0..=(2.0 * length) as u32 {
                let along = f64::from(step) / 2.0;
                let stray = self.wobble * (along / 25.0 + phase).sin();
                let x = from.0 + (to.0 - from.0) * along / length + stray * normal.0;
                let y = from.1 + (to.1 - from.1) * along / length + stray * normal.1;
                self.dab(&mut page, x, y);
            }
        }
        page
    }

    fn dab(&self, page: &mut GrayImage, x: f64, y: f64) {
        let radius = self.pen / 2.0;
        let (low, high) = ((-radius - 1.0) as i64, (radius + 1.0) as i64);
        for dy in low..=high {
            for dx in low..=high {
                let (column, row) = (x as i64 + dx, y as i64 + dy);
                let far = (column as f64 + 0.5 - x).hypot(row as f64 + 0.5 - y) > radius;
                let within =
                    column >= 0 && row >= 0 && column < self.width.into() && row < self.height.into();
                if within && !far {
                    page.put_pixel(column as u32, row as u32, Luma([self.ink]));
                }
            }
        }
    }
}

/// Makes the page look photographed by a phone: lit from one corner, darker towards the edges, and grainy.
pub fn photographed(page: &GrayImage, seed: u64) -> GrayImage {
    let mut rng = seed::stream(seed, "grain");
    let (width, height) = (f64::from(page.width()), f64::from(page.height()));
    GrayImage::from_fn(page.width(), page.height(), |x, y| {
        let (u, v) = (f64::from(x) / width, f64::from(y) / height);
        let lamp = 1.0 - 0.35 * u - 0.15 * v;
        let vignette = 1.0 - 0.45 * ((u - 0.5).powi(2) + (v - 0.5).powi(2)) * 2.0;
        let grain: f64 = (0..4).map(|_| rng.random_range(-4.0..4.0)).sum();
        let tone = f64::from(page.get_pixel(x, y).0[0]) * lamp * vignette + grain;
        Luma([tone.clamp(0.0, 255.0) as u8])
    })
}

/// Encodes the page as a file.
pub fn encoded(page: &GrayImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    DynamicImage::from(page.clone()).to_rgb8().write_to(&mut bytes, format).expect("a picture in memory");
    bytes.into_inner()
}

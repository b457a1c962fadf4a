//! A picture that shows how a drawing was interpreted, with the wall direction, the start, goals and routes.

use std::io::Cursor;

use image::{ImageFormat, Rgb, RgbImage};
use imageproc::drawing::{draw_filled_circle_mut, draw_hollow_circle_mut, draw_line_segment_mut};
use sketchnav_schemas::codes::FREE;
use sketchnav_schemas::geometry::{Point, Sketch};

use super::drawn_map::DrawnMap;
use super::error::SketchError;
use super::places::{Places, flood};

const PAPER: Rgb<u8> = Rgb([255, 255, 255]);
const WALL: Rgb<u8> = Rgb([40, 40, 48]);
const UNREACHED: Rgb<u8> = Rgb([214, 218, 226]);
const ALONG: Rgb<u8> = Rgb([200, 60, 40]);
const ACROSS: Rgb<u8> = Rgb([40, 110, 200]);
const START: Rgb<u8> = Rgb([20, 140, 60]);
const GOAL: Rgb<u8> = Rgb([170, 60, 170]);

/// Paints the drawing as PNG. Walls are dark. Free space is white, or grey if it cannot be reached from the
/// start. A red line in the middle shows the wall direction, and a blue one the direction across it. The
/// start is green, and goals and routes are purple.
///
/// # Errors
/// [`SketchError::Broken`] if the picture cannot be encoded.
pub fn preview(drawing: &DrawnMap, places: Option<&Places>) -> Result<Vec<u8>, SketchError> {
    let mut page = Page { picture: paper(drawing, places), height: drawing.height_px as f32 };
    let mark = (0.012 * drawing.diagonal_px()) as f32;
    page.axes(drawing);
    if let Some(places) = places {
        page.places(drawing, places, mark.max(2.0));
    }
    let mut bytes = Cursor::new(Vec::new());
    page.picture.write_to(&mut bytes, ImageFormat::Png).map_err(|error| SketchError::Broken {
        file: drawing.file.clone(),
        kind: "PNG",
        reason: error.to_string(),
    })?;
    Ok(bytes.into_inner())
}

fn paper(drawing: &DrawnMap, places: Option<&Places>) -> RgbImage {
    let reached = places.map(|places| flood(drawing, &places.start.position()));
    let (width, height) = (drawing.width_px, drawing.height_px);
    RgbImage::from_fn(width, height, |x, row| {
        let i = ((height - 1 - row) * width + x) as usize;
        let far = reached.as_ref().is_some_and(|reached| !reached[i]);
        match drawing.cells[i] {
            FREE if far => UNREACHED,
            FREE => PAPER,
            _ => WALL,
        }
    })
}

/// A picture with row 0 at the top, painted in the coordinates of the drawing's frame.
struct Page {
    picture: RgbImage,
    height: f32,
}

impl Page {
    fn turned(&self, point: &Point<Sketch>) -> (f32, f32) {
        (point.x as f32, self.height - point.y as f32)
    }

    fn line(&mut self, from: &Point<Sketch>, to: &Point<Sketch>, color: Rgb<u8>) {
        let (from, to) = (self.turned(from), self.turned(to));
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)] {
            let (from, to) = ((from.0 + dx, from.1 + dy), (to.0 + dx, to.1 + dy));
            draw_line_segment_mut(&mut self.picture, from, to, color);
        }
    }

    fn ray(&mut self, from: &Point<Sketch>, yaw_rad: f64, length: f64, color: Rgb<u8>) {
        let to = Point::new(from.x + length * yaw_rad.cos(), from.y + length * yaw_rad.sin());
        self.line(from, &to, color);
    }

    fn axes(&mut self, drawing: &DrawnMap) {
        let middle = Point::new(f64::from(drawing.width_px) / 2.0, f64::from(drawing.height_px) / 2.0);
        let length = 0.1 * drawing.diagonal_px();
        self.ray(&middle, drawing.wall_direction_rad, length, ALONG);
        self.ray(&middle, drawing.wall_direction_rad + std::f64::consts::FRAC_PI_2, length, ACROSS);
    }

    fn places(&mut self, drawing: &DrawnMap, places: &Places, mark: f32) {
        for task in &places.tasks {
            task.points.windows(2).for_each(|pair| self.line(&pair[0], &pair[1], GOAL));
            let goal = task.points.last().map(|point| self.turned(point));
            if let Some((x, y)) = goal {
                draw_hollow_circle_mut(&mut self.picture, (x as i32, y as i32), mark as i32, GOAL);
                draw_filled_circle_mut(&mut self.picture, (x as i32, y as i32), mark as i32 / 3, GOAL);
            }
        }
        if places.is_anywhere(drawing) {
            return;
        }
        let (x, y) = self.turned(&places.start.position());
        draw_filled_circle_mut(&mut self.picture, (x as i32, y as i32), mark as i32 / 2, START);
        self.ray(&places.start.position(), places.start.yaw_rad, 3.0 * f64::from(mark), START);
    }
}

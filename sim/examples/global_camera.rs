//! Renders a plane of dots as a global camera sees it, at a slant, and prints the known points of the camera's calibration.
//!
//! ```text
//! cargo run -p sketchnav-sim --example global_camera -- x.plane.toml x.png
//! ```
//! The known points are accurate to half a pixel, like points that people measure in a picture. Positions
//! measured with this calibration therefore have errors, like those of Park and Kender 1995 (7.1.1).

use sketchnav_dots::camera::{Camera, Known};
use sketchnav_dots::picture;

/// Width and height of the picture.
const SIZE: [u32; 2] = [1200, 1000];
/// The corners of the plane in the picture. Those nearer to the camera are farther apart.
const CORNERS: [[f64; 2]; 4] = [[90.0, 940.0], [1110.0, 930.0], [985.0, 85.0], [230.0, 95.0]];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let usage = "expected a plane file and the picture's file";
    let mut files = std::env::args().skip(1);
    let (plane, png) = (files.next().ok_or(usage)?, files.next().ok_or(usage)?);
    let dots = sketchnav_sim::files::plane_file(plane.as_ref())?.dots;
    let extent = |axis: usize| {
        let along = dots.iter().map(|dot| dot[axis]);
        along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    };
    let [x, y] = [0, 1].map(extent).map(|(low, high)| [low.floor(), high.ceil()]);
    let places = [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]];
    let known = CORNERS.into_iter().zip(places).map(|(pixel, place)| Known { pixel, place });
    let camera = Camera::calibrated(&known.collect::<Vec<_>>())?;
    // So small that dots seldom touch, since the map-maker would take two touching dots for one.
    let radius = 0.002 * (x[1] - x[0]).max(y[1] - y[0]);
    picture::draw(SIZE, &camera, &dots, radius).save(&png)?;
    println!("calibration = [");
    for (i, j) in (0..3).flat_map(|j| (0..3).map(move |i| (i, j))) {
        let along = |range: [f64; 2], k: i32| range[0] + (range[1] - range[0]) * f64::from(k) / 2.0;
        let place = [along(x, i), along(y, j)];
        let [column, row] = camera.pixel(place).ok_or("a known point is out of sight")?;
        let half = |v: f64| (2.0 * v).round() / 2.0;
        println!("    [{:.1}, {:.1}, {:?}, {:?}],", half(column), half(row), place[0], place[1]);
    }
    println!("]");
    Ok(())
}

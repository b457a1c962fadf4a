//! Property tests for all relations and all scenes.

mod dipoles;
mod motion;
mod networks;
mod oriented;
mod scenes;
mod speeds;
mod stories;
mod tables;
mod ways;

use sketchnav_qualitative::Point;

fn point([x, y]: [f64; 2]) -> Point {
    Point::new(x, y).unwrap()
}

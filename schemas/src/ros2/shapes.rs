//! Building blocks of standard messages for viewers: paths and shapes.
//!
//! Lengths in frame `sketch` are in pixels, and those in all other frames are in metres.

use ros2_interfaces_jazzy_serde::{
    geometry_msgs::msg::{Point, Pose, PoseStamped, Vector3},
    nav_msgs::msg::Path,
    std_msgs::msg::{ColorRGBA, Header as HeaderForm},
    visualization_msgs::msg::{Marker, MarkerArray},
};

use super::Ros2Error;
use super::fields::pose;
use super::parts::header_form;
use crate::message::Header;

/// Returns the ROS 2 header of a message in a frame.
///
/// # Errors
/// [`Ros2Error`] if the message's number or time does not fit into ROS 2.
pub fn stamped(header: &Header, frame: &str) -> Result<HeaderForm, Ros2Error> {
    header_form(header, frame, HeaderForm::default())
}

/// Returns a path through points. Each of its poses faces the next one.
///
/// # Errors
/// Same errors as [`stamped`].
pub fn path(header: &Header, frame: &str, points: &[[f32; 2]]) -> Result<Path, Ros2Error> {
    let header = stamped(header, frame)?;
    let yaw = |i: usize| {
        let (from, to) = if i + 1 < points.len() { (i, i + 1) } else { (i.saturating_sub(1), i) };
        f64::from(points[to][1] - points[from][1]).atan2(f64::from(points[to][0] - points[from][0]))
    };
    let poses = points.iter().enumerate().map(|(i, [x, y])| PoseStamped {
        header: header.clone(),
        pose: turned(f64::from(*x), f64::from(*y), yaw(i)),
    });
    Ok(Path { poses: poses.collect(), header })
}

/// Returns a pose in the plane.
pub fn turned(x: f64, y: f64, yaw_rad: f64) -> Pose {
    pose(x, y, (yaw_rad / 2.0).sin(), (yaw_rad / 2.0).cos())
}

/// Returns the first `count` entries, or all of them if there are fewer.
pub fn first<T>(all: &[T], count: u32) -> &[T] {
    &all[..(count as usize).min(all.len())]
}

/// Colour of the place that the robot should reach.
pub const ROUTE_COLOR: [f32; 4] = [0.85, 0.33, 0.1, 0.9];
/// Colour of what the robot currently sees.
pub const SEEN_COLOR: [f32; 4] = [0.93, 0.69, 0.13, 1.0];
/// Colour of what the robot remembers.
pub const REMEMBERED_COLOR: [f32; 4] = [0.47, 0.53, 0.6, 0.9];
/// Colour of people.
pub const PERSON_COLOR: [f32; 4] = [0.49, 0.18, 0.56, 0.9];

/// The shapes of one message, in one frame.
pub struct Shapes {
    header: HeaderForm,
    markers: Vec<Marker>,
}

impl Shapes {
    /// Starts with no shapes. The new shapes replace those of the previous message.
    ///
    /// # Errors
    /// Same errors as [`stamped`].
    pub fn new(header: &Header, frame: &str) -> Result<Self, Ros2Error> {
        let header = stamped(header, frame)?;
        let clear = Marker { header: header.clone(), action: Marker::DELETEALL, ..Marker::default() };
        Ok(Self { header, markers: vec![clear] })
    }

    /// Adds a shape and returns it. `kind` is one of the types of a [`Marker`].
    pub fn add(&mut self, kind: i32, pose: Pose, scale: [f64; 3], color: [f32; 4]) -> &mut Marker {
        let [x, y, z] = scale;
        let id = self.markers.len();
        self.markers.push(Marker {
            header: self.header.clone(),
            id: id as i32, // far fewer than 2^31
            type_: kind,
            action: Marker::ADD,
            pose,
            scale: Vector3 { x, y, z },
            color: rgba(color),
            frame_locked: true,
            ..Marker::default()
        });
        &mut self.markers[id]
    }

    /// Adds a line.
    pub fn line(&mut self, points: impl Iterator<Item = [f64; 2]>, width: f64, color: [f32; 4]) {
        let marker = self.add(Marker::LINE_STRIP, turned(0.0, 0.0, 0.0), [width, 0.0, 0.0], color);
        marker.points = points.map(|[x, y]| Point { x, y, z: 0.0 }).collect();
    }

    /// Adds text.
    pub fn text(&mut self, at: [f64; 2], height: f64, words: &str) {
        let marker =
            self.add(Marker::TEXT_VIEW_FACING, turned(at[0], at[1], 0.0), [height; 3], [0.1, 0.1, 0.1, 1.0]);
        words.clone_into(&mut marker.text);
    }

    /// Adds a disc.
    pub fn disc(&mut self, at: [f64; 2], diameter: f64, color: [f32; 4]) {
        let scale = [diameter, diameter, diameter / 10.0];
        self.add(Marker::CYLINDER, turned(at[0], at[1], 0.0), scale, color);
    }

    /// Returns the message with all shapes.
    pub fn finish(self) -> MarkerArray {
        MarkerArray { markers: self.markers }
    }
}

fn rgba([r, g, b, a]: [f32; 4]) -> ColorRGBA {
    ColorRGBA { r, g, b, a }
}

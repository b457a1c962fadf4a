//! Reads positions of objects from recordings by other software, using every topic whose messages contain a
//! position.

use std::collections::BTreeMap;

use serde_json::Value;
use sketchnav_recordings::dynamic::Decoder;
use sketchnav_recordings::reader::{RawMessage, Selection, Topic};
use sketchnav_recordings::{Recording, RecordingError};

/// The message types that contain a position, with the path to its field.
const TYPES: [(&str, &[&str]); 4] = [
    ("nav_msgs/Odometry", &["pose", "pose"]),
    ("geometry_msgs/PoseWithCovarianceStamped", &["pose", "pose"]),
    ("geometry_msgs/PoseStamped", &["pose"]),
    ("geometry_msgs/PointStamped", &["point"]),
];

/// The position of an object at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    pub time_s: f64,
    /// Position in the topic's frame, in metres.
    pub at_m: [f64; 2],
    /// Heading in the topic's frame, in radians, or `None` if the message contains no orientation.
    pub heading_rad: Option<f64>,
}

/// An object whose positions are in a topic.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Way {
    /// The topic without its leading slash.
    pub name: String,
    pub frame: String,
    /// The positions in order of time, at most one for each time.
    pub places: Vec<Place>,
    /// Number of messages that were ignored because they are not of the topic's type, lack finite numbers, or
    /// repeat the time of another message.
    pub left_out: usize,
}

/// Returns the names of the supported types, for error messages.
pub fn types() -> String {
    TYPES.map(|(name, _)| name).join(", ")
}

/// Reads the positions in all topics that contain any, ordered by the topics' names.
///
/// # Errors
/// [`RecordingError`] if the recording or a message definition cannot be read.
pub fn read(recording: &Recording) -> Result<Vec<Way>, RecordingError> {
    let topics: Vec<_> = recording.topics()?.into_iter().filter(|topic| path_in(topic).is_some()).collect();
    let mut ways: BTreeMap<_, Way> = BTreeMap::new();
    if topics.is_empty() {
        return Ok(Vec::new());
    }
    let mut decoder = Decoder::default();
    for raw in recording.timeline(Selection::of_topics(topics.iter().map(|topic| topic.name.clone())))? {
        let raw = raw?;
        let way = ways.entry(raw.topic.name.clone()).or_insert_with(|| Way {
            name: raw.topic.name.trim_start_matches('/').to_owned(),
            ..Way::default()
        });
        match decoder.decode(&raw) {
            Ok(message) => way.take(&raw, &message),
            Err(error) if error.is_one_message() => way.left_out += 1,
            Err(error) => return Err(error),
        }
    }
    Ok(ways.into_values().map(Way::in_order).collect())
}

fn path_in(topic: &Topic) -> Option<&'static [&'static str]> {
    // Type names in ROS 1 contain no `msg`. Messages in ROS 1's encoding cannot be read, which is reported when they
    // are decoded.
    let kind = topic.ros2_type.replacen("/msg/", "/", 1);
    TYPES.iter().find(|(name, _)| *name == kind).map(|(_, path)| *path)
}

impl Way {
    /// Returns a notice for the user if messages were ignored.
    pub fn notice(&self) -> Option<String> {
        let Self { name, left_out, .. } = self;
        let words = "not of the topic's type, without finite numbers, or with a repeated time";
        (*left_out > 0).then(|| format!("{name}: {left_out} messages left out: {words}"))
    }

    fn take(&mut self, raw: &RawMessage, message: &Value) {
        if let Some(frame) = message["header"]["frame_id"].as_str() {
            frame.clone_into(&mut self.frame);
        }
        let path = path_in(&raw.topic).unwrap_or_default();
        let pose = path.iter().fold(message, |value, name| &value[name]);
        match place(pose, time_s(message, raw.stamp_ns)) {
            Some(place) => self.places.push(place),
            None => self.left_out += 1,
        }
    }

    fn in_order(mut self) -> Self {
        let count = self.places.len();
        self.places.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        self.places.dedup_by(|a, b| a.time_s == b.time_s);
        self.left_out += count - self.places.len();
        self
    }
}

/// Returns the time in the message's header or, if it has none, the time at which it was recorded, in seconds.
fn time_s(message: &Value, recorded_ns: u64) -> f64 {
    let stamp = &message["header"]["stamp"];
    let said = stamp["sec"].as_f64().zip(stamp["nanosec"].as_f64()).map(|(s, ns)| s + ns / 1e9);
    said.filter(|s| *s > 0.0).unwrap_or(recorded_ns as f64 / 1e9)
}

/// Reads the position of a point, or of a pose that contains one.
fn place(pose: &Value, time_s: f64) -> Option<Place> {
    let point = pose.get("position").unwrap_or(pose);
    let at_m = [point["x"].as_f64()?, point["y"].as_f64()?];
    Some(Place { time_s, at_m, heading_rad: heading_rad(&pose["orientation"]) })
}

/// Returns the yaw of a quaternion, or `None` for a zero quaternion, which has no direction.
fn heading_rad(turn: &Value) -> Option<f64> {
    let [x, y, z, w] = ["x", "y", "z", "w"].map(|name| turn[name].as_f64());
    let (x, y, z, w) = (x?, y?, z?, w?);
    let is_zero = [x, y, z, w].iter().all(|part| *part == 0.0);
    (!is_zero).then(|| (2.0 * (w * z + x * y)).atan2(w * w + x * x - y * y - z * z))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn poses_and_points_are_read() {
        let turn = json!({ "x": 0.0, "y": 0.0, "z": 1.0, "w": 1.0 });
        let pose = json!({ "position": { "x": 1.0, "y": 2.0, "z": 0.0 }, "orientation": turn });
        let found = place(&pose, 3.0).unwrap();
        assert_eq!((found.time_s, found.at_m), (3.0, [1.0, 2.0]));
        assert!((found.heading_rad.unwrap() - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        let point = json!({ "x": 1.0, "y": 2.0 });
        assert_eq!(place(&point, 3.0), Some(Place { time_s: 3.0, at_m: [1.0, 2.0], heading_rad: None }));
        assert_eq!(place(&json!({ "x": null, "y": 2.0 }), 3.0), None);
    }

    #[test]
    fn a_message_without_a_stamp_has_its_log_time() {
        let stamped = json!({ "header": { "stamp": { "sec": 5, "nanosec": 500_000_000 } } });
        assert_eq!(time_s(&stamped, 7_000_000_000), 5.5);
        assert_eq!(time_s(&json!({}), 7_000_000_000), 7.0);
    }
}

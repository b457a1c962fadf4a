//! The `.msg` texts, and the `ros2msg` schemas built from them. The standard definitions are files in
//! `schemas/msg`, and our own are generated from the declarations of the messages.

use crate::codes::Value;

macro_rules! definitions {
    ($($package:literal: $($name:literal),*;)*) => {
        /// Every standard definition: `package/Type` and the text of its `.msg` file, in which all types are named with
        /// their packages.
        const STANDARD: &[(&str, &str)] = &[$($((
            concat!($package, "/", $name),
            include_str!(concat!("../../msg/", $package, "/", $name, ".msg")),
        ),)*)*];
    };
}

definitions! {
    "builtin_interfaces": "Duration", "Time";
    "diagnostic_msgs": "DiagnosticArray", "DiagnosticStatus", "KeyValue";
    "std_msgs": "ColorRGBA", "Header", "String";
    "geometry_msgs": "Point", "Point32", "Pose", "PoseArray", "PoseStamped", "PoseWithCovariance", "Quaternion",
        "Transform", "TransformStamped", "Twist", "TwistWithCovariance", "Vector3";
    "tf2_msgs": "TFMessage";
    "nav_msgs": "MapMetaData", "OccupancyGrid", "Odometry", "Path";
    "rosgraph_msgs": "Clock";
    "sensor_msgs": "CompressedImage", "LaserScan";
    "visualization_msgs": "Marker", "MarkerArray", "MeshFile", "UVCoordinate";
}

const SEPARATOR: &str = "================================================================================\n";

/// A `.msg` text and the name of its type.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Definition {
    /// `package/Type`.
    pub name: &'static str,
    /// The text.
    pub text: String,
}

/// A field in the `.msg`.
#[derive(Debug)]
pub struct Line {
    /// The comment of the field, in the markup of the source.
    pub doc: &'static [&'static str],
    /// The field's name.
    pub name: &'static str,
    /// The field's ROS 2 type, or `None` if the field is not transmitted on its own.
    pub kind: Option<String>,
    /// The possible values of the field, if it contains the number of a code.
    pub values: &'static [Value],
}

/// Returns the `.msg` text of a comment and fields, which consists of the comment and the constants, an empty
/// line, and the fields.
pub fn compose(doc: &[&str], lines: &[Line]) -> String {
    let mut text = comment(doc);
    for value in lines.iter().flat_map(|line| line.values) {
        let meaning = plain(value.doc);
        text.push_str(&format!("uint32 {}={} #{meaning}\n", constant(value.name), value.code));
    }
    text.push('\n');
    for line in lines {
        let Some(kind) = &line.kind else { continue };
        text.push_str(&format!("{}{kind} {}\n", comment(line.doc), line.name));
    }
    text
}

fn comment(doc: &[&str]) -> String {
    doc.iter().map(|line| format!("#{}\n", plain(line))).collect()
}

/// Removes the links and code marks of the source from a comment.
fn plain(doc: &str) -> String {
    ["[`", "`]", "`", "crate::", "sketchnav_schemas::", "codes::", "message::"]
        .iter()
        .fold(doc.to_owned(), |text, mark| text.replace(mark, ""))
}

/// Converts the name of a variant into that of a constant, for example `GivenUp` into `GIVEN_UP`.
pub fn constant(name: &str) -> String {
    let mut text = String::new();
    for letter in name.chars() {
        if letter.is_uppercase() && !text.is_empty() {
            text.push('_');
        }
        text.extend(letter.to_uppercase());
    }
    text
}

/// Returns the `ros2msg` schema of `package/msg/Type`, which is its text followed by the texts of all types
/// that it uses, each once. Empty for a type that is neither standard nor in `own`.
pub fn schema(ros2_type: &str, own: &[Definition]) -> String {
    let mut needed = Vec::new();
    collect(&ros2_type.replace("/msg/", "/"), own, &mut needed);
    let mut text = String::new();
    for (i, (name, definition)) in needed.iter().enumerate() {
        if i > 0 {
            text.push_str(&format!("{SEPARATOR}MSG: {name}\n"));
        }
        text.push_str(definition);
    }
    text
}

fn collect<'a>(name: &str, own: &'a [Definition], needed: &mut Vec<(&'a str, &'a str)>) {
    let known = own.iter().map(|definition| (definition.name, definition.text.as_str()));
    let Some(found) = known.chain(STANDARD.iter().copied()).find(|(known, _)| *known == name) else { return };
    if needed.contains(&found) {
        return;
    }
    needed.push(found);
    for used in used_types(found.1) {
        collect(used, own, needed);
    }
}

/// Returns the types used in a text that have a definition of their own.
pub fn used_types(text: &str) -> impl Iterator<Item = &str> {
    let words = text.lines().filter_map(|line| line.split_whitespace().next());
    let types = words.map(|word| word.split('[').next().unwrap_or(word));
    types.filter(|word| word.contains('/') && !word.starts_with('#'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_that_a_standard_definition_uses_is_standard() {
        for (name, text) in STANDARD {
            for used in used_types(text) {
                assert!(STANDARD.iter().any(|(known, _)| *known == used), "{name} uses {used}");
            }
        }
    }

    #[test]
    fn constants_are_named_as_in_ros() {
        assert_eq!(["Pad", "GivenUp", "TimedOut"].map(constant), ["PAD", "GIVEN_UP", "TIMED_OUT"]);
    }

    #[test]
    fn a_schema_holds_each_dependency_once() {
        let schema = schema("nav_msgs/msg/Odometry", &[]);
        assert!(schema.starts_with("# A pose in header.frame_id"), "{schema}");
        for used in ["std_msgs/Header", "geometry_msgs/Quaternion", "geometry_msgs/Vector3"] {
            assert_eq!(schema.matches(&format!("MSG: {used}\n")).count(), 1, "{used}");
        }
    }
}

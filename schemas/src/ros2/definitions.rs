//! The `.msg` texts, and the `ros2msg` schemas that are made of them.

macro_rules! definitions {
    ($($package:literal: $($name:literal),*;)*) => {
        /// Every definition: `package/Type` and the text of its `.msg` file. All types in them are
        /// named with their package.
        pub const DEFINITIONS: &[(&str, &str)] = &[$($((
            concat!($package, "/", $name),
            include_str!(concat!("../../msg/", $package, "/", $name, ".msg")),
        ),)*)*];
    };
}

definitions! {
    "builtin_interfaces": "Time";
    "std_msgs": "Header";
    "geometry_msgs": "Point", "Point32", "Pose", "PoseWithCovariance", "Quaternion", "Transform",
        "TransformStamped", "Twist", "TwistWithCovariance", "Vector3";
    "tf2_msgs": "TFMessage";
    "nav_msgs": "MapMetaData", "OccupancyGrid", "Odometry";
    "sensor_msgs": "LaserScan";
    "sketchnav_msgs": "Contact", "Drawing", "Fault", "Health", "Latency", "MissionCommand", "MissionStatus", "Particle", "Particles",
        "Plan", "PoseEstimate", "Recorded", "Route", "RouteTask", "SketchMap", "SonarScan", "Understood", "VelocityCommand";
}

const SEPARATOR: &str = "================================================================================\n";

/// The `ros2msg` schema of `package/msg/Type`: its text, and behind it those of all types that it
/// uses, each once. Empty for a type that is not in [`DEFINITIONS`].
pub fn schema(ros2_type: &str) -> String {
    let name = ros2_type.replace("/msg/", "/");
    let mut needed = Vec::new();
    collect(&name, &mut needed);
    let mut text = String::new();
    for (i, (name, definition)) in needed.iter().enumerate() {
        if i > 0 {
            text.push_str(&format!("{SEPARATOR}MSG: {name}\n"));
        }
        text.push_str(definition);
    }
    text
}

fn collect(name: &str, needed: &mut Vec<(&'static str, &'static str)>) {
    let Some(&definition) = DEFINITIONS.iter().find(|(known, _)| *known == name) else { return };
    if needed.contains(&definition) {
        return;
    }
    needed.push(definition);
    for used in used_types(definition.1) {
        collect(used, needed);
    }
}

fn used_types(text: &str) -> impl Iterator<Item = &str> {
    let words = text.lines().filter_map(|line| line.split_whitespace().next());
    let types = words.map(|word| word.split('[').next().unwrap_or(word));
    types.filter(|word| word.contains('/') && !word.starts_with('#'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_that_a_definition_uses_is_defined() {
        for (name, text) in DEFINITIONS {
            for used in used_types(text) {
                assert!(DEFINITIONS.iter().any(|(known, _)| *known == used), "{name} uses {used}");
            }
        }
    }

    #[test]
    fn a_schema_holds_each_dependency_once() {
        let schema = schema("nav_msgs/msg/Odometry");
        assert!(schema.starts_with("# A pose in header.frame_id"), "{schema}");
        for used in ["std_msgs/Header", "geometry_msgs/Quaternion", "geometry_msgs/Vector3"] {
            assert_eq!(schema.matches(&format!("MSG: {used}\n")).count(), 1, "{used}");
        }
    }
}

//! The robots that ship with this project.

use sketchnav_schemas::robot::{Robot, RobotError};

/// Name and file of each robot.
const ROBOTS: [(&str, &str); 7] = [
    ("helicopter", include_str!("../robots/helicopter.toml")),
    ("nomad200", include_str!("../robots/nomad200.toml")),
    ("nomad200-camera", include_str!("../robots/nomad200-camera.toml")),
    ("robotino", include_str!("../robots/robotino.toml")),
    ("turtlebot3", include_str!("../robots/turtlebot3.toml")),
    ("youbot", include_str!("../robots/youbot.toml")),
    ("youbot-markers", include_str!("../robots/youbot-markers.toml")),
];

/// Returns the robot with that name, or `None` if there is none.
///
/// # Errors
/// [`RobotError`] if the robot's file in the repository is invalid, which a test rules out.
pub fn find(name: &str) -> Result<Option<Robot>, RobotError> {
    let file = ROBOTS.iter().find(|(known, _)| *known == name);
    file.map(|(_, text)| Robot::parse(text)).transpose()
}

/// Returns the names of the robots.
pub fn names() -> impl Iterator<Item = &'static str> {
    ROBOTS.iter().map(|(name, _)| *name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shipped_robot_is_valid_and_has_the_name_of_its_file() {
        for name in names() {
            assert_eq!(find(name).unwrap().unwrap().name, name);
        }
        assert!(find("nobody").unwrap().is_none());
    }
}

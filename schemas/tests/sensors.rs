//! The sensors of the robots that come with the project.

use std::path::Path;

use sketchnav_schemas::robot::{Robot, SENSORS};

#[test]
fn each_table_is_that_of_its_sensor() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sim/robots");
    let mut found = [0; SENSORS.len()];
    for file in std::fs::read_dir(folder).unwrap() {
        let robot = Robot::parse(&std::fs::read_to_string(file.unwrap().path()).unwrap()).unwrap();
        let [laser, sonar, camera, view] = [
            robot.laser().map(|laser| laser.rate_hz),
            robot.sonar().map(|sonar| sonar.rate_hz),
            robot.camera().map(|camera| camera.rate_hz),
            robot.view().map(|view| view.rate_hz),
        ];
        let odometry = robot.odometry().map(|odometry| odometry.rate_hz.unwrap_or(robot.tick_hz()));
        for (i, expected) in [laser, sonar, camera, view, odometry].into_iter().enumerate() {
            let fitted = robot.sensors().find(|sensor| sensor.table == SENSORS[i]);
            assert_eq!(fitted.map(|sensor| sensor.rate_hz), expected.as_ref().ok().copied());
            assert_eq!(
                robot.require(SENSORS[i]).err().map(|e| e.to_string()),
                expected.err().map(|e| e.to_string())
            );
            found[i] += usize::from(fitted.is_some());
        }
    }
    assert!(found.iter().all(|&robots| robots > 0), "{found:?}");
}

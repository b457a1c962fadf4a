//! A robot's driver in the simulated world's place: `examples/driver.rs` brings a robot next door.

mod support;

use std::path::Path;
use std::process::Command;

use support::{Place, Running, room};

#[test]
fn the_example_of_a_driver_drives_a_mission() {
    let place = Place::new();
    room::write(place.files());
    let mut running = place.start("run room.toml --system driver --speed 1 --without world --json");
    place.wait_until_joined(&mut running, "driver", &["localizer", "planner", "recorder", "sketcher"]);
    let program = Path::new(env!("CARGO_BIN_EXE_sketchnav")).with_file_name("examples").join("driver");
    assert!(
        program.exists(),
        "{}: expected the example; `cargo build --examples` makes it",
        program.display()
    );
    let mut command = Command::new(program);
    command.arg("driver");
    place.settle(&mut command);
    let driver = Running::spawn(command);
    let ended = running.end();
    assert_eq!(driver.end().code, Some(0));
    let report = ended.json();
    assert_eq!(report["tasks"][0]["state"], "reached", "{report:#}");
    place.assert_nothing_left("driver");
}

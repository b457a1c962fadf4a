//! A robot's driver takes the place of the simulated world: `examples/driver.rs` brings a robot to the next room.

use std::path::Path;

use nix::sys::signal::Signal;
use sketchnav_recordings::Recording;
use sketchnav_schemas::channels::{ODOMETRY, SCAN, TICK};
use sketchnav_schemas::message::{LaserScan, Message, Odometry, Tick};
use support::{BESIDE_A_DRIVER, Place, Running, room};

/// Starts a mission in the room that waits for its driver.
fn start(place: &Place) -> Running {
    room::write(place.files());
    let mut running = place.start("run room.toml --system driver --speed 1 --without world --json");
    place.wait_until_joined(&mut running, "driver", &BESIDE_A_DRIVER);
    running
}

#[test]
fn the_example_driver_drives_a_mission() {
    let place = Place::new();
    let running = start(&place);
    let driver = place.driver("driver");
    let ended = running.end();
    assert_eq!(driver.end().code, Some(0));
    // The mission gives the position of the goal in the world, but the robot's true position is not known, not even to the driver.
    assert_eq!(ended.code, Some(0), "{ended}");
    let report = ended.json();
    let task = &report["tasks"][0];
    assert!(task["state"] == "reached" && task["reached"] == true, "{report:#}");
    assert!(task["path_m"].as_f64().is_some_and(|path_m| path_m > 3.0), "{report:#}");
    assert!(
        task["reason"].as_str().is_some_and(|reason| reason.contains("according to the robot only")),
        "{report:#}"
    );
    place.assert_nothing_left("driver");
}

/// The laser used to be the clock for everything, with exactly one odometry reading per scan. With more readings, the
/// history of the odometry was too short for a late reader, and its messages counted as lost.
#[test]
fn odometry_at_five_times_the_scan_rate_loses_nothing() {
    let place = Place::new();
    let running = start(&place);
    let driver = place.driver("driver 5");
    let ended = running.end();
    assert_eq!(driver.end().code, Some(0));
    let report = ended.json();
    assert_eq!(report["tasks"][0]["state"], "reached", "{report:#}");
    assert_eq!(report["lost_messages"], 0, "{report:#}");
    let recording = Recording::open(Path::new(report["recording"].as_str().unwrap())).unwrap();
    let (ticks, odometry) = (recording.all(TICK).unwrap(), recording.all(ODOMETRY).unwrap());
    let newest = |tick: &Tick| tick.newest.into_iter().max();
    assert!(ticks.len() > BEFORE && odometry.len() >= 5 * ticks.len(), "{} {}", ticks.len(), odometry.len());
    assert!(
        ticks.iter().zip(1..).all(|(tick, i)| newest(tick) == Some(5 * i)),
        "a tick names the newest of five"
    );
}

/// The number of scans that the first driver sends before it is killed.
pub(crate) const BEFORE: usize = 60;
const PERIOD_NS: u64 = 100_000_000;

/// The driver dies during the mission and is started again. Its numbers used to start over, so readers mistook its messages for
/// ones that they had already received. They dropped the messages for as long as the first driver had run, and nothing was
/// reported. The clock and the odometry also restarted at 0, which readers see as a jump.
#[test]
fn a_restarted_driver_continues() {
    let place = Place::new();
    let running = start(&place);
    let first = place.driver("driver");
    let echoed = place.run(&format!("echo scan --count {BEFORE} --system driver"));
    assert_eq!(echoed.out.lines().count(), BEFORE, "{echoed}");
    first.signal(Signal::SIGKILL);
    assert_eq!(first.end().code, None);
    let second = place.driver("driver");
    let ended = running.end();
    assert_eq!(second.end().code, Some(0));
    let report = ended.json();
    assert_eq!(report["tasks"][0]["state"], "reached", "{report:#}");
    assert_eq!(report["lost_messages"], 0, "{report:#}");
    let recording = Recording::open(Path::new(report["recording"].as_str().unwrap())).unwrap();
    let (scans, odometry) = (recording.all(SCAN).unwrap(), recording.all(ODOMETRY).unwrap());
    assert!(scans.len() > BEFORE, "{}", scans.len());
    assert_taken_over(&scans, &odometry);
    place.assert_nothing_left("driver");
}

/// Asserts that a second driver has continued what a first one had sent: numbers, timestamps and the position.
pub(crate) fn assert_taken_over(scans: &[LaserScan], odometry: &[Odometry]) {
    assert_continuous(scans);
    assert_continuous(odometry);
    for pair in odometry.windows(2) {
        let jump_m = pair[0].pose().position().distance(&pair[1].pose().position());
        assert!(jump_m < 0.5, "{jump_m} m from {:?}", pair[0].header);
    }
}

/// Asserts that the messages continue without a gap. If the second driver were ignored for as long as the first one
/// ran, there would be a gap of that length.
fn assert_continuous<T: Message>(messages: &[T]) {
    for (seq, message) in (1..).zip(messages) {
        assert_eq!((message.header().seq, message.header().source_seq), (seq, seq));
    }
    for pair in messages.windows(2) {
        let (from, to) = (pair[0].header().stamp_ns, pair[1].header().stamp_ns);
        assert!(from < to && to - from < BEFORE as u64 * PERIOD_NS / 2, "{} {from} to {to}", T::NAME);
    }
}

//! A driver in Python takes the place of the simulated world: `tests/rooms_driver.py` brings a robot to the next room.
//!
//! These tests need a Python with the wheel of this checkout. `SKETCHNAV_WHEEL_PYTHON` names it; without it, the tests are skipped.

use std::path::PathBuf;
use std::process::Command;

use crate::driver::{BEFORE, assert_taken_over};
use nix::sys::signal::Signal;
use sketchnav_recordings::Recording;
use sketchnav_schemas::channels::{ODOMETRY, SCAN, TICK, TRUTH};
use support::{BESIDE_A_DRIVER, Ended, Place, Running, repository, room};

/// A mission in the room that waits for its driver.
struct Waiting {
    place: Place,
    running: Running,
    python: PathBuf,
}

/// Starts the mission with the given options, or returns `None` without a Python that has the wheel.
fn waiting(options: &str) -> Option<Waiting> {
    let python = needs::python("wheel", "SKETCHNAV_WHEEL_PYTHON", "numpy, sketchnav._core")?;
    let place = Place::new();
    room::write(place.files());
    let mut running = place.start(&format!("run room.toml --system rooms --json {options}"));
    place.wait_until_joined(&mut running, "rooms", &BESIDE_A_DRIVER);
    Some(Waiting { place, running, python })
}

const REAL_TIME: &str = "--without world --speed 1";

impl Waiting {
    /// Runs a driver with these parts of its text replaced.
    fn driver(&self, arguments: &str, changes: &[(&str, &str)]) -> Running {
        let tests = repository().join("tests");
        let mut text = std::fs::read_to_string(tests.join("rooms_driver.py")).unwrap();
        for (old, new) in changes {
            assert!(text.contains(old), "{old}");
            text = text.replace(old, new);
        }
        let script = self.place.files().join("driver.py");
        std::fs::write(&script, text).unwrap();
        let mut command = Command::new(&self.python);
        command.arg(script).arg("rooms").args(arguments.split_whitespace()).env("PYTHONPATH", tests);
        self.place.settle(&mut command);
        Running::spawn(command)
    }

    /// Waits until this many scans have been sent.
    fn wait_for_scans(&self, count: usize) {
        let echoed = self.place.run(&format!("echo scan --count {count} --system rooms"));
        assert_eq!(echoed.out.lines().count(), count, "{echoed}");
    }

    /// Ends the mission early.
    fn interrupt(self) {
        self.running.signal(Signal::SIGINT);
        self.running.end();
        self.place.assert_nothing_left("rooms");
    }

    /// Waits for the end of the driver and of the mission, in which the goal must be reached.
    fn reached_by(self, driver: Running) -> Driven {
        let driver = driver.end();
        assert_eq!(driver.code, Some(0), "{driver}");
        let report = self.running.end().json();
        assert_eq!(report["tasks"][0]["state"], "reached", "{report:#}");
        assert_eq!(report["tasks"][0]["reached"], true, "{report:#}");
        assert_eq!(report["lost_messages"], 0, "{report:#}");
        let path = self.place.files().join(report["recording"].as_str().unwrap());
        self.place.assert_nothing_left("rooms");
        Driven { recording: Recording::open(&path).unwrap(), driver, _place: self.place }
    }
}

/// The results of a mission that was driven.
struct Driven {
    recording: Recording,
    driver: Ended,
    _place: Place,
}

fn assert_fine(ended: &Ended) {
    assert_eq!(ended.code, Some(0), "{ended}");
    assert!(ended.err.is_empty(), "{ended}");
}

#[test]
fn it_drives_a_mission_in_real_time() {
    let Some(waiting) = waiting(REAL_TIME) else { return };
    let driver = waiting.driver("", &[]);
    let Driven { recording, driver, _place } = waiting.reached_by(driver);
    assert!(driver.err.is_empty(), "{driver}");
    let (ticks, odometry) = (recording.all(TICK).unwrap(), recording.all(ODOMETRY).unwrap());
    let newest = ticks.iter().map(|tick| tick.newest.into_iter().max().unwrap());
    assert!(newest.eq((0..ticks.len() as u64).map(|i| 1 + 5 * i)), "a tick names the newest of five");
    assert!(odometry.len() as u64 >= 5 * (ticks.len() as u64 - 1));
}

/// A simulator controls its own time, so the same drive takes the same steps each time.
#[test]
fn a_simulator_drives_in_lockstep_and_repeats_itself() {
    let drive = || {
        let waiting = waiting("--without world")?;
        let driver = waiting.driver("simulated", &[]);
        let Driven { recording, driver, _place } = waiting.reached_by(driver);
        let stamps: Vec<_> = recording.all(TICK).unwrap().iter().map(|tick| tick.header.stamp_ns).collect();
        assert!(stamps.iter().zip(1..).all(|(stamp, i)| *stamp == i * 100_000_000), "{stamps:?}");
        Some((recording.all(TRUTH).unwrap(), driver.out))
    };
    let Some(first) = drive() else { return };
    assert_eq!(Some(first), drive());
}

#[test]
fn a_simulator_keeps_time_in_real_time() {
    let Some(waiting) = waiting("--without world --speed 20") else { return };
    let driver = waiting.driver("simulated", &[]);
    waiting.reached_by(driver);
}

/// The second driver's odometry starts at 0 again, which navigators would mistake for a drive back to the start.
#[test]
fn a_killed_driver_is_continued_by_another_one() {
    let Some(waiting) = waiting(REAL_TIME) else { return };
    let first = waiting.driver("", &[]);
    waiting.wait_for_scans(BEFORE);
    first.signal(Signal::SIGKILL);
    assert_eq!(first.end().code, None);
    let second = waiting.driver("", &[]);
    let Driven { recording, _place, .. } = waiting.reached_by(second);
    let (scans, odometry) = (recording.all(SCAN).unwrap(), recording.all(ODOMETRY).unwrap());
    assert!(scans.len() > BEFORE, "{}", scans.len());
    assert_taken_over(&scans, &odometry);
}

/// A process that is killed while it creates a file in shared memory leaves an incomplete file.
#[test]
fn drivers_that_are_killed_as_they_join_leave_nothing_in_the_way() {
    let Some(waiting) = waiting("--without world") else { return };
    // Each one kills itself at a different time.
    let joins = "    with sketchnav.drive(";
    for ms in [1, 2, 3, 5, 8, 13, 21] {
        let dies = format!(
            "    import ctypes, os, threading, time\n    def die():\n        time.sleep({ms} / 1000)\n        \
             os.kill(os.getpid(), 9)\n    threading.Thread(target=die, daemon=True).start()\n{joins}"
        );
        assert_eq!(waiting.driver("simulated", &[(joins, &dies)]).end().code, None);
    }
    let driver = waiting.driver("simulated", &[]);
    waiting.reached_by(driver);
}

/// If a driver hangs, its base keeps the last velocity, and the driver must not repeat that velocity afterwards.
#[test]
fn a_driver_that_is_too_slow_gets_no_old_command() {
    let Some(waiting) = waiting(REAL_TIME) else { return };
    let command = "        robot.velocity = system.command(wait_s";
    let hangs = format!(
        "        if any(robot.velocity) and robot.readings > 100 and not hasattr(robot, 'hung'):\n            \
         robot.hung = True\n            time.sleep(0.7)\n            stale = system.command()\n            \
         assert not any(stale), stale\n            print('stood still')\n{command}"
    );
    let driver = waiting.driver("", &[(command, &hangs)]);
    let ended = waiting.reached_by(driver).driver;
    assert!(ended.out.contains("stood still"), "{ended}");
}

#[test]
fn a_simulator_slower_than_the_clock_says_so_and_still_arrives() {
    let Some(waiting) = waiting("--without world --speed 100") else { return };
    let scan = "        system.scan(";
    let driver = waiting.driver("simulated", &[(scan, &format!("        time.sleep(0.05)\n{scan}"))]);
    let ended = waiting.reached_by(driver).driver;
    assert!(ended.err.contains("the simulator is slower than --speed 100"), "{ended}");
}

/// Each error names the field, what was expected and what was found. The invalid readings are not sent.
#[test]
fn a_bad_reading_is_an_error_that_names_what_is_wrong() {
    let Some(waiting) = waiting("--without world") else { return };
    let bad = [
        ("scan(robot.ranges()[:360])", "scan: expected 683 ranges, as [laser] of the robot says, found 360"),
        ("scan([1.0] * 682 + [-1.0])", "scan: ranges_m: expected a distance, infinity or NaN, found -1"),
        ("scan([1.0] * 3, angle_min_rad=0.0)", "angle_min_rad and angle_increment_rad, found one without"),
        (
            "scan([1.0] * 360, angle_min_rad=-180.0, angle_increment_rad=1.0)",
            "scan: angle_increment_rad: expected beams over at most a full turn, in radians, found 1",
        ),
        ("scan([1.0] * 2000, angle_min_rad=0.0, angle_increment_rad=0.001)", "expected at most 1440 entries"),
        ("scan(robot.ranges(), range_max_m=0.0)", "scan: range_max_m: expected a length above range_min_m"),
        ("scan(robot.ranges(), age_s=-1.0)", "scan: age_s: expected seconds since the reading, 0 or more"),
        ("scan(['far'] * 683)", "LaserScan.ranges_m: "),
        ("odometry(float('nan'), 0.0, 0.0)", "odometry: pose: expected a number within ±1e7, found NaN"),
        ("odometry(0.0, 0.0, 0.0, age_s=10.0)", "odometry: expected a time after that of the previous one"),
        ("odometry(1.0, 2.0, 3.0, 4.0)", "positional arguments"),
        ("sonar([1.0] * 16)", "sonar: expected a robot with [sonar] in its file, found 16 ranges"),
        ("contact(0.0, 0.0, begins=True, body='dog')", "body: expected one of wall, furniture, person"),
        ("send(sketchnav.channels.COMMAND)", "command: expected a channel that the world writes: "),
        ("send(sketchnav.channels.SCAN, lidar=1)", "LaserScan: expected one of header, "),
    ];
    let (scan, tick) = ("        system.scan(", "        system.tick()\n");
    let attempt = |call: &str| {
        format!(
            "            try:\n                system.{call}\n            except (TypeError, ValueError) as error:\n                \
             print('refused:', error)\n            else:\n                print('sent')\n"
        )
    };
    let begins = "        import sketchnav.channels\n        if robot.readings == 101:\n";
    let before: String = bad.iter().map(|(call, _)| attempt(call)).collect();
    let after = attempt("scan(robot.ranges())");
    let changes = [
        (scan, format!("{begins}{before}{scan}")),
        (tick, format!("        if robot.readings == 101:\n{after}{tick}")),
    ];
    let driver = waiting.driver("simulated", &changes.each_ref().map(|(old, new)| (*old, new.as_str())));
    let ended = waiting.reached_by(driver).driver;
    let refused: Vec<_> = ended.out.lines().filter(|line| line.starts_with("refused: ")).collect();
    let again = "scan: expected at most 1 between two ticks, found another one";
    let expected = bad.iter().map(|(_, words)| *words).chain([again]);
    assert_eq!(refused.len(), bad.len() + 1, "{ended}");
    for (found, words) in refused.iter().zip(expected) {
        assert!(found.contains(words), "expected {words:?}, found {found:?}");
    }
}

#[test]
fn a_system_that_a_driver_cannot_join_is_named() {
    let (with, joins) = ("    with sketchnav.drive(sys.argv[1]", "    with sketchnav.drive('lobby'");
    if let Some(waiting) = waiting("--without world") {
        let ended = waiting.driver("", &[]).end();
        assert!(
            ended.err.contains("system \"rooms\": expected one that runs in real time, as with --speed 1"),
            "{ended}"
        );
        let ended = waiting.driver("", &[(with, joins)]).end();
        assert!(ended.err.contains("system \"lobby\" is not running (running: rooms)"), "{ended}");
        let tick = "        system.tick()\n";
        let first = waiting.driver("simulated", &[(tick, &format!("{tick}        time.sleep(1000)\n"))]);
        waiting.wait_for_scans(1);
        let ended = waiting.driver("simulated", &[]).end();
        assert!(ended.err.contains("world of system \"rooms\" is already running as process"), "{ended}");
        drop(first);
        waiting.interrupt();
    }
    let Some(python) = needs::python("wheel", "SKETCHNAV_WHEEL_PYTHON", "numpy, sketchnav._core") else {
        return;
    };
    let place = Place::new();
    room::write(place.files());
    let mut running = place.start("run room.toml --system rooms --json --speed 1");
    place.wait_until_driving(&mut running, "rooms");
    let waiting = Waiting { place, running, python };
    let ended = waiting.driver("", &[]).end();
    assert!(
        ended.err.contains("system \"rooms\": expected one that was started with --without world"),
        "{ended}"
    );
    waiting.interrupt();
}

/// Ctrl-C ends the loop of the driver, after which Python handles it again.
#[test]
fn a_driver_that_is_asked_to_end_leaves_its_loop() {
    let Some(waiting) = waiting(REAL_TIME) else { return };
    let summary = "    print(robot.summary())\n";
    let again = "    import os, signal\n    try:\n        os.kill(os.getpid(), signal.SIGINT)\n        time.sleep(10)\n    \
                 except KeyboardInterrupt:\n        print('Python again')\n    try:\n        system.tick()\n    \
                 except RuntimeError as error:\n        print(error)\n";
    // A shell starts background commands with SIGINT ignored.
    let joins = "    with sketchnav.drive(";
    let heeds =
        format!("    import signal\n    signal.signal(signal.SIGINT, signal.default_int_handler)\n{joins}");
    let driver = waiting.driver("", &[(summary, again), (joins, &heeds)]);
    waiting.wait_for_scans(3);
    driver.signal(Signal::SIGINT);
    let ended = driver.end();
    assert_fine(&ended);
    assert!(ended.out.contains("Python again\ndriver: expected a call inside"), "{ended}");
    waiting.interrupt();
}

/// A driver outlives the system and notices its end by itself.
#[test]
fn a_driver_leaves_its_loop_when_the_system_is_gone() {
    for options in [REAL_TIME, "--without world"] {
        let Some(waiting) = waiting(options) else { return };
        let driver = waiting.driver(if options == REAL_TIME { "" } else { "simulated" }, &[]);
        waiting.wait_for_scans(3);
        waiting.running.signal(Signal::SIGKILL);
        assert_fine(&driver.end());
        waiting.running.end();
        waiting.place.fine("clean");
    }
}

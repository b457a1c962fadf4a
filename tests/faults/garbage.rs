//! A robot's driver writes garbage of the right size between its readings. The garbage is rejected and counted, and
//! nothing crashes.

use std::process::Command;
use std::time::Duration;

use nix::sys::signal::Signal;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use sketchnav_runtime::{Node, System, Wake};
use sketchnav_schemas::channels::{ODOMETRY, SCAN, TICK};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::message::{Header, LaserScan, Odometry, Tick};
use sketchnav_schemas::seed::stream;
use support::{Place, Running, room};

const SYSTEM: &str = "garbage";
/// This variable is set only for the driver's process.
const DRIVES: &str = "SKETCHNAV_TEST_DRIVES_GARBAGE";
const PAUSE: Duration = Duration::from_millis(2);

/// The driver, which is this test binary started again.
#[test]
#[ignore = "a process of the other test, which starts it itself"]
fn driver() {
    if std::env::var_os(DRIVES).is_none() {
        return; // as with `--include-ignored`
    }
    let node = Node::join(System::open(SYSTEM).unwrap(), Process::World).unwrap();
    let (mut scans, mut odometry) = (node.writer(SCAN).unwrap(), node.writer(ODOMETRY).unwrap());
    let mut ticks = node.writer(TICK).unwrap();
    let random = &mut stream(1, "garbage");
    for seq in 1.. {
        let stamp_ns = seq * 100_000_000;
        let mut reading = garbage::<Odometry>(random);
        if seq % 3 > 0 {
            reading = bytemuck::Zeroable::zeroed();
            reading.pose.orientation_w = 1.0;
        }
        let mut scan = garbage::<LaserScan>(random);
        match seq % 4 {
            0 => scan.beam_count = u32::MAX,
            1 => {}
            _ => echo(&mut scan),
        }
        odometry.send(|message| *message = Odometry { header: header(stamp_ns, seq), ..reading }).unwrap();
        scans.send(|message| *message = LaserScan { header: header(stamp_ns, seq), ..scan }).unwrap();
        ticks.send(|message| *message = Tick { header: header(stamp_ns, seq), ..garbage(random) }).unwrap();
        ticks
            .send(|message| {
                message.header = header(stamp_ns, seq);
                node.name_readings(message);
            })
            .unwrap();
        if node.nap(PAUSE) == Wake::Terminate {
            return;
        }
    }
}

fn garbage<T: bytemuck::Pod>(random: &mut Pcg64Mcg) -> T {
    let mut message = T::zeroed();
    random.fill(bytemuck::bytes_of_mut(&mut message));
    message
}

fn header(stamp_ns: u64, source_seq: u64) -> Header {
    Header { seq: 0, stamp_ns, source_seq }
}

/// Writes a scan of walls two metres away in all directions.
fn echo(scan: &mut LaserScan) {
    (scan.angle_min_rad, scan.angle_max_rad, scan.angle_increment_rad) = (-2.0, 2.0, 0.05);
    (scan.time_increment_s, scan.scan_time_s) = (0.0, 0.1);
    (scan.range_min_m, scan.range_max_m, scan.beam_count) = (0.02, 5.6, 81);
    scan.ranges_m.fill(0.0);
    scan.ranges_m[..81].fill(2.0);
}

#[test]
fn a_driver_that_writes_garbage_crashes_no_process() {
    let place = Place::new();
    room::write(place.files());
    let options = "--speed 1 --without world --json";
    let mut running = place.start(&format!("run room.toml --system {SYSTEM} {options}"));
    place.wait_until_joined(&mut running, SYSTEM, &["localizer", "planner", "recorder", "sketcher"]);
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["garbage::driver", "--exact", "--ignored"]).env(DRIVES, "1");
    place.settle(&mut command);
    let driver = Running::spawn(command);
    // The history comes first. The remaining estimates follow while the driver drives.
    let echoed = place.run(&format!("echo estimate --count 300 --system {SYSTEM}"));
    assert_eq!(echoed.out.lines().count(), 300, "{echoed}");
    assert!(echoed.out.lines().all(|line| !line.contains("null")), "numbers alone");
    driver.signal(Signal::SIGTERM);
    let driver = driver.end();
    assert_eq!(driver.code, Some(0), "{driver}");
    running.signal(Signal::SIGINT);
    let ended = running.end();
    let report = ended.json();
    let figures = report["processes"].as_array().unwrap_or_else(|| panic!("{ended}"));
    for process in ["localizer", "planner", "recorder"] {
        let figures = figures.iter().find(|figures| figures["process"] == process).unwrap();
        assert!(figures["refused_messages"].as_u64().unwrap() > 50, "{figures:#}");
        assert_eq!(figures["restarts"], 0, "{figures:#}");
    }
    place.assert_nothing_left(SYSTEM);
}

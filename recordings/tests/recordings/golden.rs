//! Recordings of earlier versions stay readable: the files in `golden` contain what this version would write. `story.mcap` has the
//! messages of a mission, `samples.mcap` has every message type, `log.mcap` has an imported CARMEN log, and `cut.mcap` is a file
//! whose recorder was killed. To change them on purpose, run `SKETCHNAV_UPDATE_GOLDEN=1 cargo test -p sketchnav-recordings golden`.

use std::fs::File;
use std::path::{Path, PathBuf};

use sketchnav_recordings::carmen::{CarmenLog, Survey};
use sketchnav_recordings::copy::Copy;
use sketchnav_recordings::diff::{Comparison, Difference, Side, Tolerances};
use sketchnav_recordings::import::{Rules, import};
use sketchnav_recordings::info::info;
use sketchnav_recordings::reader::{Part, Recording};
use sketchnav_schemas::channels;
use sketchnav_sketch::messages::{ROUTE, Route, SKETCH};

use super::common;

const STEPS: u64 = 30;

/// Compares a golden file with what `record` writes now, or updates it.
fn check(name: &str, record: impl Fn(&Path)) -> PathBuf {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden").join(name);
    if std::env::var_os("SKETCHNAV_UPDATE_GOLDEN").is_some() {
        record(&golden);
    }
    let folder = tempfile::tempdir().unwrap();
    let now = folder.path().join(name);
    record(&now);
    assert_eq!(difference(&golden, &now), None, "{name}");
    assert_eq!(common::counts(&golden), common::counts(&now), "{name}");
    assert_eq!(Recording::open(&golden).unwrap().run().unwrap(), common::run_config(), "{name}");
    let bytes = std::fs::metadata(&golden).unwrap().len();
    assert!(bytes < 300_000, "{name}: {bytes} bytes");
    golden
}

/// Returns the first difference in any channel. `diff` leaves out health and faults, which differ from run to run, so a change in
/// the format of those messages would not be noticed here.
fn difference(a: &Path, b: &Path) -> Option<Difference> {
    let recorded = channels::all().filter(|spec| spec.is_recorded());
    let mut comparison = Comparison::of(recorded, Tolerances::default());
    for (side, path) in [(Side::A, a), (Side::B, b)] {
        for part in Recording::open(path).unwrap().parts().unwrap() {
            if let Part::Message(message) = part.unwrap() {
                comparison.take(side, message);
            }
        }
    }
    comparison.finish()
}

/// A changed health message is a difference, and so is a changed fault.
#[test]
fn every_recorded_channel_is_compared() {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/samples.mcap");
    let folder = tempfile::tempdir().unwrap();
    let other = folder.path().join("other.mcap");
    for topic in ["/health", "/faults"] {
        let mut copy = Copy::new(File::create(&other).unwrap()).unwrap();
        for part in Recording::open(&golden).unwrap().parts().unwrap() {
            let mut part = part.unwrap();
            if let Part::Message(message) = &mut part
                && message.topic.name == topic
            {
                *message.cdr.last_mut().unwrap() ^= 1;
            }
            copy.part(&part).unwrap();
        }
        copy.finish().unwrap();
        assert_eq!(difference(&golden, &other).map(|found| found.channel), Some(&topic[1..]));
    }
}

#[test]
fn the_golden_recordings_still_decode_to_the_same_messages() {
    let story = check("story.mcap", |path| common::record_story(path, STEPS));
    assert!(info(&story).unwrap().clean_end);
    check("samples.mcap", |path| common::record_samples(path, 7, 2));
    let log = check("log.mcap", record_log);
    let info_of_log = info(&log).unwrap();
    let scans = info_of_log.topics.iter().find(|topic| topic.topic == "/scan").unwrap();
    assert_eq!((scans.messages, scans.last_s), (2, Some(0.25)));
}

#[test]
fn an_old_recording_cut_off_by_a_kill_is_still_read() {
    let cut = check("cut.mcap", |path| {
        let whole = path.with_extension("whole");
        common::record_story(&whole, STEPS);
        let bytes = std::fs::read(&whole).unwrap();
        std::fs::write(path, &bytes[..bytes.len() - 4000]).unwrap();
        std::fs::remove_file(whole).unwrap();
    });
    assert!(!info(&cut).unwrap().clean_end);
}

const LOG: &str = "ODOM 0 0 0 0 0 0 10.1 h 0.1\nODOM 1 0 0 0 0 0 10.2 h 0.2\nFLASER 3 1.5 2.5 81.9 0.9 0.1 0 0.9 0.1 0 10.25 h 0.25\nODOM 0.9 0.1 0 0 0 0 0 h 0\nODOM 0.9 0.6 0 0 0 0 10.4 h 0.4\nFLASER 3 1 2 3 0.8 0.7 0.1 0.8 0.7 0.1 10.5 h 0.5\n";

fn record_log(path: &Path) {
    let mut writer = common::create(path);
    let (sketch, cells) = common::sketch();
    let rules = Rules { range_max_m: 79.0, is_strict: true };
    let mut route: Box<Route> = bytemuck::zeroed_box();
    route.header.seq = 1;
    writer.write(SKETCH, &sketch, &cells).unwrap();
    writer.write(ROUTE, &route, &[]).unwrap();
    let reading = Survey::of(LOG.as_bytes()).unwrap().reading().unwrap();
    let log = CarmenLog::new(LOG.as_bytes(), reading);
    let imported = import(log, &rules, &mut writer).unwrap();
    assert_eq!(imported.scans, 2);
    writer.finish().unwrap();
}

use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;
use sketchnav_recordings::Recording;
use sketchnav_recordings::reader::Selection;
use sketchnav_rehearsal::rerun;
use sketchnav_schemas::channels::{ODOMETRY, SCAN, TRUTH};

use super::super::judge;
use super::*;

/// A folder with the map of a walled hall, and a log beside it.
struct Place(tempfile::TempDir);

impl Place {
    fn new(name: &str, log: &[u8]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let is_wall = |i: usize| [i / 40, i % 40].contains(&0) || [i / 40, i % 40].contains(&39);
        let cell = |i: usize| if is_wall(i) { 0 } else { 255 };
        let mut map = b"P5 40 40 255 ".to_vec();
        map.extend((0..1600).map(cell));
        let yaml = "image: map.pgm\nresolution: 0.25\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n";
        std::fs::write(folder.path().join("map.pgm"), map).unwrap();
        std::fs::write(folder.path().join("map.yaml"), yaml).unwrap();
        std::fs::write(folder.path().join(name), log).unwrap();
        Self(folder)
    }

    fn import(&self, name: &str, strict: bool, start: Option<[f64; 3]>) -> Result<Recording, String> {
        let output = self.0.path().join("out.mcap");
        let options = ImportOptions {
            map: Some(self.0.path().join("map.yaml")),
            sketch: None,
            start,
            range_max: 79.0,
            strict,
            seed: 1,
            set: Vec::new(),
            output: output.clone(),
            json: true,
        };
        match import(&self.0.path().join(name), &options) {
            Ok(outcome) => assert_eq!(outcome, Outcome::Success),
            Err(Failure::Input(error)) => return Err(crate::failure::story(&error)),
            Err(other) => panic!("{other:?}"),
        }
        Ok(Recording::open(&output).unwrap())
    }
}

fn flaser(count: usize, x: f64) -> String {
    format!("FLASER {count} {}{x} 5 0 {x} 0 0 {x} host {x}\n", "2.5 ".repeat(count))
}

fn packed(text: &[u8]) -> Vec<u8> {
    let mut packer = GzEncoder::new(Vec::new(), Compression::default());
    packer.write_all(text).unwrap();
    packer.finish().unwrap()
}

#[test]
fn a_truncated_compressed_log_is_imported_up_to_the_cut() {
    let text: String =
        (0..40).map(|i| flaser(if i < 20 { 180 } else { 361 }, 3.0 + f64::from(i) / 10.0)).collect();
    let whole = packed(text.as_bytes());
    let place = Place::new("cut.log.gz", &whole[..whole.len() - 12]);
    let error = place.import("cut.log.gz", true, None).unwrap_err();
    assert!(error.contains("cut.log.gz: ") && error.contains("(--strict)"), "{error}");
    assert!(!place.0.path().join("out.mcap").exists());
    let recording = place.import("cut.log.gz", false, None).unwrap();
    let scans = recording.all(SCAN).unwrap();
    assert!(scans.len() > 20, "{}", scans.len());
    assert_eq!((scans[0].beam_count, scans.last().unwrap().beam_count), (180, 361));
    let odometry = recording.all(ODOMETRY).unwrap();
    assert!((odometry[10].pose().x - odometry[0].pose().x - 1.0).abs() < 1e-9, "the scans' own poses");
}

/// Lines without a pose do not contain the robot's position, and a guess must not be presented as a fact.
#[test]
fn a_log_without_poses_needs_a_start() {
    let line = |x: f64| {
        format!("ODOM {x} 0 0 0 0 0 {x} h {x}\nRAWLASER1 0 -1 2 0.5 80 0 0 5 2 2 2 2 2 0 {x} h {x}\n")
    };
    let place = Place::new("raw.log", [0.0, 0.5, 1.0].map(line).concat().as_bytes());
    let error = place.import("raw.log", false, None).unwrap_err();
    assert!(error.contains("expected --start COLUMN,ROW,HEADING"), "{error}");
    let recording = place.import("raw.log", true, Some([20.0, 20.0, 90.0])).unwrap();
    assert_eq!(recording.all(SCAN).unwrap().len(), 3);
    assert_eq!(recording.all(TRUTH).unwrap().len(), 0, "its true pose is unknown");
}

/// Regression test: a log of a robot that had turned round many times was rejected, because its headings exceeded those allowed
/// in missions. Headings that look like degrees only raise a doubt.
#[test]
fn headings_continue_beyond_a_full_turn() {
    let line = |i: f64| {
        format!("FLASER 180 {}{i} 5 {} {i} 0 {} {i} host {i}\n", "2.5 ".repeat(180), 20.0 + i, 20.0 + i)
    };
    let text: String = (0..5).map(|i| line(3.0 + f64::from(i) / 10.0)).collect();
    let place = Place::new("turned.log", text.as_bytes());
    let error = place.import("turned.log", true, None).unwrap_err();
    assert!(error.contains("headings of the poses reach 23: expected radians; are they degrees?"), "{error}");
    let recording = place.import("turned.log", false, None).unwrap();
    let heading_deg = recording.run().unwrap().mission.start.world_heading_deg;
    assert!((heading_deg - (23.0_f64.to_degrees() - 3.0 * 360.0 - 360.0)).abs() < 1e-9, "{heading_deg}");
}

/// Regression test: the quaternions of a recording's odometry had length 0.5. The result was "0 estimates", without a reason.
#[test]
fn odometry_that_every_reader_rejects_is_reported() {
    let text: String = (0..10).map(|i| flaser(180, 3.0 + f64::from(i) / 10.0)).collect();
    let place = Place::new("a.log", text.as_bytes());
    let whole = place.import("a.log", true, None).unwrap();
    let path = place.0.path().join("half.mcap");
    let mut writer =
        Writer::create_with(std::fs::File::create(&path).unwrap(), &whole.run().unwrap(), &[]).unwrap();
    for message in whole.timeline(Selection::default()).unwrap() {
        let message = message.unwrap();
        if message.topic.is(ODOMETRY) {
            let (mut odometry, _) = message.read(ODOMETRY).unwrap();
            odometry.pose.orientation_z *= 0.5;
            odometry.pose.orientation_w *= 0.5;
            writer.write(ODOMETRY, &odometry, &[]).unwrap();
        } else {
            writer.write_raw(&message).unwrap();
        }
    }
    writer.finish().unwrap();
    let half = Recording::open(&path).unwrap();
    let (run, none) =
        (sketchnav_recordings::sources::RecordedRun::of(&half).unwrap(), None::<&mut Writer<std::fs::File>>);
    let rerun = rerun::rerun(&half, Process::Localizer, &run, std::iter::empty().collect(), none).unwrap();
    let expected =
        "10 messages of /odometry: pose: expected an orientation of length 1, found 0.5 (the first is";
    let words = rerun.rejected.list().first().map_or_else(String::new, ToString::to_string);
    assert!(words.starts_with(expected), "{words}");
    let rows = judge::rows(&judge::of_file(&path, None).unwrap());
    assert!(rows.contains(&("messages rejected as invalid".to_owned(), "10".to_owned())), "{rows:?}");
}

#[test]
fn anything_but_a_log_is_reported() {
    for (name, bytes, words) in [
        ("a.zip", &b"PK\x03\x04...."[..], "found zip; convert it first"),
        ("a.bz2", b"BZh9....", "found bzip2"),
        ("a.txt", b"\xff\xfeF\0L\0", "found UTF-16"),
        ("empty.log", b"", "expected FLASER, ROBOTLASER1 or RAWLASER1 lines, found none"),
        (
            "two.log.gz",
            b"\x1f\x8b",
            "found none; 1 lines cannot be read, the first is line 1: the file breaks off here",
        ),
    ] {
        let error = Place::new(name, bytes).import(name, false, None).err().unwrap();
        assert!(error.contains(&format!("{name}: ")) && error.contains(words), "{error}");
    }
}

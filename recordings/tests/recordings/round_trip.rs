//! Recordings are read back as they were written: every message type, files cut off by a kill, gaps and repetitions.

use std::io::{self, Write};
use std::path::Path;

use bytemuck::Zeroable;
use sketchnav_recordings::info::info;
use sketchnav_recordings::reader::{RawMessage, Recording, Selection};
use sketchnav_recordings::sequence::{Gap, Seen};
use sketchnav_recordings::{RecordingError, Writer};
use sketchnav_schemas::channels::{self, Channel, ChannelVisitor, HEALTH};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::message::{Header, Health};
use sketchnav_schemas::ros2::Ros2;
use sketchnav_schemas::samples::sample;
use sketchnav_schemas::seed::stream;

use super::common;

struct ReadSamples<'a> {
    recording: &'a Recording,
    channel: &'static str,
    count: u64,
    random: rand_pcg::Pcg64Mcg,
}

impl ChannelVisitor for ReadSamples<'_> {
    type Error = RecordingError;
    fn visit<T: Ros2>(&mut self, channel: Channel<T>) -> Result<(), RecordingError> {
        if channel.spec.name != self.channel {
            return Ok(());
        }
        let read: Vec<_> = self.recording.channel(channel)?.collect::<Result<_, _>>()?;
        assert_eq!(read.len() as u64, self.count, "{}", channel.spec.name);
        for (seq, (message, cells)) in (1..).zip(read) {
            let (expected, expected_cells) = sample::<T>(&mut self.random, seq);
            assert!(bytemuck::bytes_of(&message) == bytemuck::bytes_of(&expected), "{}", channel.spec.name);
            assert_eq!(cells, expected_cells, "{}", channel.spec.name);
        }
        Ok(())
    }
}

/// Stack size of the test's thread. A route takes 131 kB, and a test build keeps several copies of it on the stack.
const STACK_BYTES: usize = 16 << 20;

#[test]
fn every_message_of_every_channel_round_trips() {
    let thread = std::thread::Builder::new().stack_size(STACK_BYTES).spawn(compare_every_message).unwrap();
    thread.join().unwrap();
}

fn compare_every_message() {
    let folder = tempfile::tempdir().unwrap();
    for kind in sketchnav_navigators::all().map(|navigator| navigator.kind) {
        let path = folder.path().join(format!("{kind}.mcap"));
        common::record_samples_of(kind, &path, 1, 5);
        let recording = Recording::open(&path).unwrap();
        let random = stream(1, "samples");
        let mut samples = ReadSamples { recording: &recording, channel: "", count: 5, random };
        for spec in common::channels_of(kind) {
            samples.channel = spec.name;
            sketchnav_navigators::visit(&mut samples).unwrap();
        }
    }
}

/// A recording may come from anywhere, so its robot was not necessarily parsed from a file. An impossible robot once reached
/// the cores.
#[test]
fn an_impossible_robot_in_a_recording_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("strange.mcap");
    let mut run = common::run_config();
    run.robot.radius_m = 1e-6;
    common::create_run(&path, &run).finish().unwrap();
    let error = Recording::open(&path).unwrap().run().unwrap_err().to_string();
    assert!(error.contains("robot: radius_m: expected 0.01 to 10 m, found 1e-6"), "{error}");
}

#[test]
fn the_run_is_in_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("story.mcap");
    common::record_story(&path, 20);
    let recording = Recording::open(&path).unwrap();
    assert_eq!(recording.run().unwrap(), common::run_config());
    assert_eq!(recording.fact("sketchnav", "seed"), Some("42"));
    assert_eq!(recording.fact("parameters", "localizer"), Some("particles = 2000\n"));
    let mission = String::from_utf8(recording.attachments()["mission.toml"].data.clone()).unwrap();
    assert_eq!(sketchnav_schemas::mission::Mission::parse(&mission).unwrap(), common::run_config().mission);
    let info = info(&path).unwrap();
    assert!(info.clean_end && info.missing == 0 && info.run["mission"] == "two rooms", "{info:?}");
    let scan = info.topics.iter().find(|t| t.topic == "/scan").unwrap();
    assert_eq!((scan.messages, scan.rate_hz.map(f64::round)), (20, Some(10.0)));
    assert_eq!(common::counts(&path)["/tf"], 20);
    assert_eq!(common::counts(&path)["/tf_static"], 1);
}

#[test]
fn a_file_cut_anywhere_is_read_up_to_its_last_complete_chunk() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("story.mcap");
    let mut writer = common::create(&path);
    common::write_beginning(&mut writer);
    let mut flushed = Vec::new();
    for step in 1..=30 {
        common::write_step(&mut writer, step);
        if step % 10 == 0 {
            writer.flush().unwrap();
            flushed.push((std::fs::metadata(&path).unwrap().len(), step));
        }
    }
    writer.finish().unwrap();
    let whole = std::fs::read(&path).unwrap();
    for cut in (0..whole.len()).step_by(97).chain(flushed.iter().map(|(bytes, _)| *bytes as usize)) {
        std::fs::write(&path, &whole[..cut]).unwrap();
        let expected = flushed.iter().rfind(|(bytes, _)| *bytes as usize <= cut);
        check_cut(&path, cut, expected.map_or(0, |(_, step)| *step));
    }
}

fn check_cut(path: &Path, cut: usize, least: u64) {
    match info(path) {
        Ok(info) => {
            assert!(!info.clean_end, "cut at {cut}");
            let scans = info.topics.iter().find(|t| t.topic == "/scan").map_or(0, |t| t.messages);
            assert!(scans >= least, "cut at {cut}: {scans} scans of {least} flushed");
            let read = Recording::open(path).unwrap().channel(channels::SCAN).unwrap();
            assert_eq!(read.map(Result::unwrap).count() as u64, scans, "cut at {cut}");
        }
        Err(error) => assert!(cut <= 16, "cut at {cut}: {error}"),
    }
}

#[test]
fn a_damaged_byte_is_detected_or_harmless() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("story.mcap");
    common::record_story(&path, 10);
    let whole = std::fs::read(&path).unwrap();
    for at in (0..whole.len()).step_by(41) {
        let mut damaged = whole.clone();
        damaged[at] ^= 0x55;
        std::fs::write(&path, &damaged).unwrap();
        let read = Recording::open(&path).and_then(|recording| recording.channel(channels::SCAN));
        for (step, scan) in (1..).zip(read.into_iter().flatten().map_while(Result::ok)) {
            assert_eq!(scan.0, common::scan(step), "byte {at} damaged");
        }
    }
}

#[test]
fn gaps_and_repetitions_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("gaps.mcap");
    let mut writer = common::create(&path);
    let seen = [1, 2, 2, 5, 4, 6].map(|n| writer.write(channels::SCAN, &common::scan(n), &[]).unwrap());
    let new = |missing| Seen::New { missing };
    assert_eq!(seen, [new(0), new(0), Seen::Again, new(2), Seen::Again, new(0)]);
    let topic = writer.topics().iter().find(|t| t.spec.name == "scan").unwrap();
    assert_eq!((topic.messages, topic.sequence.missing()), (4, 2));
    writer.finish().unwrap();
    let info = info(&path).unwrap();
    let scan = info.topics.iter().find(|t| t.topic == "/scan").unwrap();
    assert_eq!(scan.gaps, [Gap { after_seq: 2, missing: 2 }]);
    assert_eq!((info.missing, scan.messages), (2, 4));
}

#[test]
fn a_malformed_message_is_rejected_and_recording_continues() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("refused.mcap");
    let mut writer = common::create(&path);
    let mut scan = common::scan(1);
    scan.beam_count = 5000;
    let error = writer.write(channels::SCAN, &scan, &[]).unwrap_err();
    assert!(error.is_one_message(), "{error}");
    assert_eq!(
        error.to_string(),
        "/scan, message 1: ranges_m: expected a count within the capacity, found 5000"
    );
    writer.write(channels::SCAN, &common::scan(2), &[]).unwrap();
    writer.finish().unwrap();
    assert_eq!(common::counts(&path)["/scan"], 1);
}

/// Returns the message with this x in the quaternion of its pose, whose w is 1.
fn with_x(raw: &RawMessage, x: f64) -> RawMessage {
    let mut raw = raw.clone();
    let w = raw.cdr.windows(8).position(|bytes| bytes == 1.0_f64.to_le_bytes()).unwrap();
    raw.cdr[w - 24..w - 16].copy_from_slice(&x.to_le_bytes());
    raw
}

/// Regression test: if a driver computes its quaternions, their x and y may be −0 or have rounding errors, and all of its
/// odometry was rejected. A single tilted quaternion, which must be rejected, ended the command that encountered it, even if that
/// command only copied messages.
#[test]
fn rounding_in_a_quaternion_is_accepted_and_a_tilt_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("story.mcap");
    common::record_story(&path, 20);
    let recording = Recording::open(&path).unwrap();
    let raw = recording.select(Selection::of_topics(["/odometry"])).unwrap().next().unwrap().unwrap();
    let bytes = |raw: &RawMessage| raw.read(channels::ODOMETRY).map(|(m, _)| bytemuck::bytes_of(&m).to_vec());
    let exact = bytes(&raw).unwrap();
    for x in [-0.0, 1e-17, -1e-9] {
        assert_eq!(bytes(&with_x(&raw, x)).unwrap(), exact, "{x}");
    }
    let tilted = with_x(&raw, 0.25);
    let error = bytes(&tilted).unwrap_err();
    assert!(error.is_one_message() && error.to_string().ends_with("found 0.25"), "{error}");
    let to = folder.path().join("tilted.mcap");
    let mut writer = common::create(&to);
    writer.write_raw(&tilted).unwrap();
    writer.finish().unwrap();
    let copy = Recording::open(&to).unwrap();
    let copied: Vec<_> =
        copy.select(Selection::of_topics(["/odometry"])).unwrap().map(Result::unwrap).collect();
    assert!(copied.len() == 1 && copied[0].cdr == tilted.cdr);
    assert_eq!(info(&to).unwrap().missing, 0);
}

/// A disk that takes this many bytes and is then full.
struct FullDisk {
    file: std::fs::File,
    room: usize,
}

impl Write for FullDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.room == 0 {
            return Err(io::ErrorKind::StorageFull.into());
        }
        let written = self.file.write(&bytes[..bytes.len().min(self.room)])?;
        self.room -= written;
        Ok(written)
    }
    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

#[test]
fn on_a_full_disk_flushed_messages_stay_readable() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("full.mcap");
    let disk = FullDisk { file: std::fs::File::create(&path).unwrap(), room: 40_000 };
    let mut writer = Writer::create(disk, &common::run_config()).unwrap();
    let (mut step, mut flushed) = (0, 0);
    let error = loop {
        step += 1;
        let (scan, _) = sample(&mut stream(step, "noise"), step);
        let written = writer.write(channels::SCAN, &scan, &[]).and_then(|_| writer.flush());
        match written {
            Ok(()) => flushed = step,
            Err(error) => break error,
        }
    };
    assert!(matches!(error, RecordingError::Write(_)) && !error.is_one_message(), "{error}");
    assert!(writer.write(channels::SCAN, &common::scan(step + 1), &[]).is_err(), "nothing after a failure");
    drop(writer);
    assert!(flushed > 0 && common::counts(&path)["/scan"] >= flushed);
    assert!(!info(&path).unwrap().clean_end);
}

#[test]
fn anything_but_a_recording_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("text.mcap");
    let missing = Recording::open(&path).unwrap_err();
    assert!(matches!(missing, RecordingError::File { .. }) && missing.to_string().contains("text.mcap"));
    std::fs::write(&path, "this is no recording, but long enough").unwrap();
    let error = Recording::open(&path).unwrap_err();
    assert!(matches!(error, RecordingError::Foreign { .. }), "{error}");
    std::fs::write(&path, "").unwrap();
    assert!(Recording::open(&path).is_err());
}

/// Messages of several processes may arrive out of order. Readers assume that the times of a topic never go back, so the
/// logged time is adjusted and the message keeps its own time.
#[test]
fn times_within_a_topic_never_decrease() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("health.mcap");
    let mut writer = common::create(&path);
    let stamps = [5, 2, 9, 7];
    for stamp_ns in stamps {
        let header = Header { seq: 1, stamp_ns, source_seq: 0 };
        writer.write(HEALTH, &Health { header, ..Health::zeroed() }, &[]).unwrap();
    }
    writer.finish().unwrap();
    let recording = Recording::open(&path).unwrap();
    let all = || recording.select(Selection::of_topics(["/health"])).unwrap().map(Result::unwrap);
    assert_eq!(
        all().map(|m| [m.stamp_ns, m.publish_ns]).collect::<Vec<_>>(),
        [[5; 2], [5; 2], [9; 2], [9; 2]]
    );
    let said: Vec<_> = recording.all(HEALTH).unwrap().iter().map(|health| health.header.stamp_ns).collect();
    assert_eq!(said, stamps);
}

/// Regression test: the recorder reports its restarts in `health`, as every process does, and also counts them itself. Each of
/// its restarts was therefore counted twice.
#[test]
fn a_restart_of_the_recorder_counts_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("restarts.mcap");
    // In one of its lives the recorder reported nothing.
    for (own_count, all) in [(0, 3), (2, 3), (3, 4)] {
        let mut writer = common::create(&path);
        for (process, pids) in
            [(Process::Recorder, 1..=3), (Process::Planner, 11..=12), (Process::World, 20..=20)]
        {
            for pid in pids {
                let header = Header { seq: pid.into(), stamp_ns: 0, source_seq: 0 };
                let health = Health { header, process: process.code(), pid, ..Health::zeroed() };
                writer.write(HEALTH, &health, &[]).unwrap();
            }
        }
        writer.survived(own_count);
        writer.finish().unwrap();
        assert_eq!(info(&path).unwrap().all_restarts(), all, "{own_count} by its own count");
    }
}

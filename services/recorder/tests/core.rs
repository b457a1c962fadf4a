//! Tests of the recorder's core, without files and processes.

use std::io::{self, Write};

use bytemuck::Zeroable;
use sketchnav_recorder::core::Core;
use sketchnav_recordings::RecordingError;
use sketchnav_schemas::channels::{RECORDED_EVERY, TICK};
use sketchnav_schemas::message::{Header, Tick};
use sketchnav_schemas::run::RunConfig;
use sketchnav_sketch::messages::{SKETCH, SketchMap};

fn run() -> RunConfig {
    sketchnav_navigators::register(&[]).unwrap();
    serde_json::from_str(include_str!("run.json")).unwrap()
}

fn header(seq: u64) -> Header {
    Header { seq, stamp_ns: seq * 100_000_000, source_seq: seq }
}

fn record<W: Write>(core: &mut Core<W>, seq: u64) -> Result<(), RecordingError> {
    let tick = Tick { header: header(seq), ..Zeroable::zeroed() };
    core.record(TICK.spec, bytemuck::bytes_of(&tick), &[])
}

fn draw<W: Write>(core: &mut Core<W>, seq: u64, cells: &[u8]) -> Result<(), RecordingError> {
    let sketch = SketchMap { header: header(seq), width_px: 2, height_px: 2, ..Zeroable::zeroed() };
    core.record(SKETCH.spec, bytemuck::bytes_of(&sketch), cells)
}

#[test]
fn the_recorder_acknowledges_at_regular_ticks() {
    let mut core = Core::new(Vec::new(), &run(), &[]).unwrap();
    let mut acknowledged = Vec::new();
    for seq in 1..=50 {
        record(&mut core, seq).unwrap();
        acknowledged.extend(core.end_pass().unwrap());
        assert!(core.end_pass().unwrap().is_none(), "the same ticks are acknowledged once");
    }
    let ticks: Vec<_> = acknowledged.iter().map(|recorded| recorded.header.source_seq).collect();
    assert_eq!(ticks, [16, 32, 48]);
    assert_eq!(acknowledged[1].header.stamp_ns, 3_200_000_000);
    assert_eq!(acknowledged[1].message_count, 32 + 1, "and the static transform");
}

/// A pass may take many ticks at once; the last one acknowledges all of them.
#[test]
fn a_late_recorder_catches_up_in_one_pass() {
    let mut core = Core::new(Vec::new(), &run(), &[]).unwrap();
    (1..=3 * RECORDED_EVERY + 1).for_each(|seq| record(&mut core, seq).unwrap());
    assert_eq!(core.end_pass().unwrap().unwrap().header.source_seq, 3 * RECORDED_EVERY + 1);
    assert!(core.end_pass().unwrap().is_none());
}

#[test]
fn missing_and_malformed_messages_are_counted() {
    let mut core = Core::new(Vec::new(), &run(), &[]).unwrap();
    record(&mut core, 1).unwrap();
    record(&mut core, 4).unwrap();
    let error = draw(&mut core, 1, &[0, 0, 0]).unwrap_err();
    assert!(error.is_one_message() && error.to_string().starts_with("/sketch, message 1: cells"), "{error}");
    draw(&mut core, 2, &[0, 0, 0, 0]).unwrap();
    let (report, sink) = core.finish();
    assert_eq!((report.messages, report.missing, report.refused, report.unrecorded), (4, 2, 1, 0));
    assert!(sink.unwrap().starts_with(b"\x89MCAP0\r\n"));
}

/// A disk with this much space left.
struct Disk {
    room: usize,
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.room == 0 {
            return Err(io::ErrorKind::StorageFull.into());
        }
        let written = bytes.len().min(self.room);
        self.room -= written;
        Ok(written)
    }
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A full disk must not stop a robot. The failure is reported once, and the world in lockstep still gets its
/// acknowledgements.
#[test]
fn a_full_disk_is_reported_once_and_stops_no_process() {
    let mut core = Core::new(Disk { room: 20_000 }, &run(), &[]).unwrap();
    let (mut failures, mut acknowledged) = (Vec::new(), 0);
    for seq in 1..=5000 {
        failures.extend(record(&mut core, seq).err());
        match core.end_pass() {
            Ok(recorded) => {
                acknowledged = recorded.map_or(acknowledged, |recorded| recorded.header.source_seq)
            }
            Err(error) => failures.push(error),
        }
    }
    assert_eq!(failures.len(), 1, "{failures:?}");
    assert!(acknowledged > 5000 - 2 * RECORDED_EVERY, "acknowledged {acknowledged}");
    let (report, sink) = core.finish();
    assert!(sink.is_none() && report.unrecorded > 0 && report.failure.is_some(), "{report:?}");
}

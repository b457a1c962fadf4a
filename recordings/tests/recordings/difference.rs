//! Two recordings of the same messages count as the same. For any others, the first message that differs is named.

use std::path::Path;

use sketchnav_recordings::diff::{Difference, Side, What, diff};
use sketchnav_schemas::channels::{self, DRAWING, SCAN};
use sketchnav_schemas::message::*;
use sketchnav_sketch::messages::SKETCH;

use super::common;

fn record(path: &Path, change: impl Fn(u64, &mut LaserScan)) {
    let mut writer = common::create(path);
    for step in 1..=12 {
        let mut scan = common::scan(step);
        change(step, &mut scan);
        writer.write(SCAN, &scan, &[]).unwrap();
    }
    writer.finish().unwrap();
}

fn difference(a: impl Fn(u64, &mut LaserScan), b: impl Fn(u64, &mut LaserScan)) -> Option<Difference> {
    let folder = tempfile::tempdir().unwrap();
    let paths = [folder.path().join("a.mcap"), folder.path().join("b.mcap")];
    record(&paths[0], a);
    record(&paths[1], b);
    diff(&paths[0], &paths[1]).unwrap()
}

fn same(_: u64, _: &mut LaserScan) {}

#[test]
fn the_field_and_both_values_are_named() {
    let changed = |step, scan: &mut LaserScan| {
        if step >= 4 {
            scan.ranges_m[3] = f32::NAN;
        }
    };
    let found = difference(same, changed).unwrap();
    assert_eq!(
        found.to_string(),
        "scan message 4 at 0.400 s: ranges_m[3] is 2.88 in the first, NaN (bits 0x7fc00000) in the second"
    );
    assert_eq!(difference(changed, changed), None, "the very same NaN");
}

#[test]
fn a_shorter_list_is_a_different_count() {
    let shorter = |step, scan: &mut LaserScan| {
        if step == 2 {
            scan.beam_count = 40;
            scan.ranges_m[40] = 0.0;
        }
    };
    let found = difference(same, shorter).unwrap();
    let what = What::Field { field: "beam_count".into(), a: "41".into(), b: "40".into() };
    assert_eq!((found.channel, found.seq, found.what), ("scan", 2, what));
}

fn renumbered(path: &Path, steps: impl Iterator<Item = u64>) {
    let mut writer = common::create(path);
    for step in steps {
        writer.write(SCAN, &common::scan(step), &[]).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn a_message_missing_from_one_recording_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let paths = [folder.path().join("a.mcap"), folder.path().join("b.mcap")];
    renumbered(&paths[0], 1..=9);
    renumbered(&paths[1], (1..=9).filter(|n| *n != 5));
    let found = diff(&paths[0], &paths[1]).unwrap().unwrap();
    assert_eq!((found.seq, found.what), (5, What::OnlyIn(Side::A)));
    renumbered(&paths[0], 1..=8);
    renumbered(&paths[1], 1..=9);
    let found = diff(&paths[0], &paths[1]).unwrap().unwrap();
    assert_eq!((found.seq, found.what), (9, What::OnlyIn(Side::B)));
}

#[test]
fn interleaving_flushing_and_health_are_ignored() {
    let folder = tempfile::tempdir().unwrap();
    let paths = [folder.path().join("a.mcap"), folder.path().join("b.mcap")];
    common::record_story(&paths[0], 8);
    let mut writer = common::create(&paths[1]);
    for step in 1..=8 {
        writer.write(SCAN, &common::scan(step), &[]).unwrap();
    }
    writer.flush().unwrap();
    common::write_beginning(&mut writer);
    (1..=8).for_each(|step| common::write_step(&mut writer, step));
    let stray =
        Health { header: Header { seq: 9, stamp_ns: 1, source_seq: 1 }, ..bytemuck::Zeroable::zeroed() };
    writer.write(channels::HEALTH, &stray, &[]).unwrap();
    writer.finish().unwrap();
    assert_eq!(diff(&paths[0], &paths[1]).unwrap(), None);
}

#[test]
fn a_cell_of_the_drawing_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let paths = [folder.path().join("a.mcap"), folder.path().join("b.mcap")];
    let (map, mut cells) = common::sketch();
    for path in &paths {
        let mut writer = common::create(path);
        writer.write(SKETCH, &map, &cells).unwrap();
        writer.finish().unwrap();
        cells[100] = 100;
    }
    let found = diff(&paths[0], &paths[1]).unwrap().unwrap();
    let what = What::Field { field: "cells[100]".into(), a: "0".into(), b: "100".into() };
    assert_eq!((found.channel, found.what), ("sketch", what));
}

/// Regression test: a drawing has no field for its length. If one drawing began with all of the other, the two did not differ
/// in any common byte and counted as the same.
#[test]
fn a_longer_drawing_is_a_different_one() {
    let folder = tempfile::tempdir().unwrap();
    let paths = [folder.path().join("a.mcap"), folder.path().join("b.mcap")];
    let header = Header { seq: 1, stamp_ns: 0, source_seq: 0 };
    for (path, drawn) in paths.iter().zip(["a wall", "a wall and a door"]) {
        let mut writer = common::create(path);
        let drawing = Drawing { header, ..bytemuck::Zeroable::zeroed() };
        writer.write(DRAWING, &drawing, drawn.as_bytes()).unwrap();
        writer.finish().unwrap();
    }
    let found = |a: usize, b: usize| diff(&paths[a], &paths[b]).unwrap().map(|found| found.to_string());
    let begin = "drawing message 1 at 0.000 s: length of cells is";
    assert_eq!(found(0, 1), Some(format!("{begin} 6 in the first, 17 in the second")));
    assert_eq!(found(1, 0), Some(format!("{begin} 17 in the first, 6 in the second")));
    assert_eq!((found(0, 0), found(1, 1)), (None, None));
}

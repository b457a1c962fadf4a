//! Tests which parts of a recording the judge reads.

#[allow(dead_code, reason = "the tests of the recordings use more of it")]
#[path = "../../../recordings/tests/recordings/common.rs"]
mod common;

use sketchnav_lab::judge::figures::figures;
use sketchnav_lab::judge::log::Log;
use sketchnav_recordings::Recording;
use sketchnav_schemas::channels;

/// Everything that the judge needs is read in one pass. A scan that no command responded to must be counted as unanswered, even if
/// there was no estimate for it either, as may happen in real time. Regression test: estimates without a status were counted
/// instead.
#[test]
fn scans_without_a_command_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hurried.mcap");
    let mut writer = common::create(&path);
    common::write_beginning(&mut writer);
    (1..=10).for_each(|step| common::write_step(&mut writer, step));
    for step in 11..=15 {
        writer.write(channels::SCAN, &common::scan(step), &[]).unwrap();
    }
    writer.finish().unwrap();
    let log = Log::read(&Recording::open(&path).unwrap()).unwrap();
    assert_eq!((log.scans, log.answered_scans, log.estimates.len(), log.instants.len()), (15, 10, 10, 10));
    assert_eq!((log.status.len(), log.health.len(), log.route.is_some()), (10, 10, true));
    assert_eq!(log.sketch.as_ref().map(|(map, cells)| (map.width_px, cells.len())), Some((40, 1200)));
    assert_eq!(figures(&log, None, None, None).unanswered_scans, 5);
}

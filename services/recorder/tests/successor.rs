//! A recorder dies and another one continues. The parts become one recording without gaps or duplicates.

mod support;

use std::fs::OpenOptions;

use sketchnav_recorder::Recorder;
use sketchnav_recordings::info::info;
use sketchnav_recordings::reader::Recording;
use sketchnav_schemas::channels::{ODOMETRY, RECORDED, TICK};
use sketchnav_schemas::codes::Process;
use support::{TestSystem, header, run};

#[test]
fn a_successor_continues_in_a_new_part_and_the_parts_are_joined() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("runs/test.mcap");
    let run = run("successor", &path);
    let system = TestSystem::create(&run);
    let world = system.join(Process::World);
    let (mut ticks, mut odometry) = (world.writer(TICK).unwrap(), world.writer(ODOMETRY).unwrap());
    let mut recorded = world.reader(RECORDED).unwrap();
    let mut step = |seq| {
        odometry.send(|message| message.header = header(seq)).unwrap();
        ticks.send(|message| message.header = header(seq)).unwrap();
    };

    let mut seq = 0;
    for life in 1..=3 {
        let node = system.join(Process::Recorder);
        let mut recorder = Recorder::open(&node).unwrap();
        for _ in 0..40 {
            seq += 1;
            step(seq);
            recorder.pass().unwrap();
        }
        // Some messages that the recorder has not read when it dies.
        for _ in 0..5 {
            seq += 1;
            step(seq);
        }
        drop(recorder);
        // The recorder was killed, so nothing completes its file.
        let part = if life == 1 { path.clone() } else { path.with_extension(format!("part{life}.mcap")) };
        let file = OpenOptions::new().write(true).open(part).unwrap();
        file.set_len(file.metadata().unwrap().len() - 50).unwrap();
    }
    let node = system.join(Process::Recorder);
    Recorder::open(&node).unwrap().end().unwrap();

    let found = info(&path).unwrap();
    assert_eq!((found.missing, found.clean_end, found.restarts), (0, true, 3), "{found:#?}");
    let ticks = Recording::open(&path).unwrap().channel(TICK).unwrap();
    let numbers: Vec<_> = ticks.map(|message| message.unwrap().0.header.seq).collect();
    assert_eq!(numbers, (1..=seq).collect::<Vec<_>>());
    let mut acknowledged = Vec::new();
    while let Some(message) = recorded.receive().unwrap() {
        acknowledged.push(message.header.source_seq);
    }
    assert!(acknowledged.is_sorted_by(|a, b| a < b), "{acknowledged:?}");
    let files = std::fs::read_dir(path.parent().unwrap()).unwrap().count();
    assert_eq!(files, 1, "the parts are gone");

    drop((recorded, node, world));
    system.remove();
}

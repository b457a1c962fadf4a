//! The recorder in its own system, with the test as the world.

mod support;

use sketchnav_recorder::Recorder;
use sketchnav_recordings::info::info;
use sketchnav_recordings::reader::Recording;
use sketchnav_schemas::channels::{ODOMETRY, RECORDED, TICK};
use sketchnav_schemas::codes::Process;
use sketchnav_sketch::messages::SKETCH;
use support::{TestSystem, header, run};

#[test]
fn every_message_is_recorded_and_acknowledged() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("runs/test.mcap");
    let run = run("recorder", &path);
    let system = TestSystem::create(&run);
    let world = system.join(Process::World);
    let sketcher = system.join(Process::Sketcher);
    let recorder_node = system.join(Process::Recorder);
    let mut recorder = Recorder::open(&recorder_node).unwrap();

    let (mut ticks, mut odometry) = (world.writer(TICK).unwrap(), world.writer(ODOMETRY).unwrap());
    let mut recorded = world.reader(RECORDED).unwrap();
    let mut sketches = sketcher.writer(SKETCH).unwrap();
    let mut sketch = sketches.loan_with(6).unwrap();
    (sketch.width_px, sketch.height_px) = (3, 2);
    sketch.parts_mut().1.copy_from_slice(&[0, 100, 0, 0, 0, 100]);
    sketch.send().unwrap();
    let mut step = |seq| {
        odometry.send(|message| message.header = header(seq)).unwrap();
        ticks.send(|message| message.header = header(seq)).unwrap();
    };

    for seq in 1..=40 {
        step(seq);
        recorder.pass().unwrap();
    }
    let mut acknowledged = Vec::new();
    while let Some(message) = recorded.receive().unwrap() {
        acknowledged.push(message.header.source_seq);
    }
    assert_eq!(acknowledged, [16, 32]);
    (41..=45).for_each(step); // sent, and not read before the end
    recorder.end().unwrap();

    let info = info(&path).unwrap();
    assert!(info.clean_end && info.missing == 0, "{info:?}");
    let drawn: Vec<_> = Recording::open(&path).unwrap().channel(SKETCH).unwrap().collect();
    assert_eq!(Recording::open(&path).unwrap().channel(TICK).unwrap().count(), 45);
    assert_eq!(drawn[0].as_ref().unwrap().1, [0, 100, 0, 0, 0, 100]);

    drop((ticks, odometry, recorded, sketches));
    drop((world, sketcher, recorder_node));
    system.remove();
}

/// Regression test: on a busy machine, a mission of twelve instants was once over before its recorder had connected to the writers.
/// The recording lacked the odometry and the status, and nothing counted as missing.
#[test]
fn a_late_recorder_reads_the_writers_histories() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("runs/test.mcap");
    let run = run("late", &path);
    let system = TestSystem::create(&run);
    let world = system.join(Process::World);
    let (mut ticks, mut odometry) = (world.writer(TICK).unwrap(), world.writer(ODOMETRY).unwrap());
    for seq in 1..=12 {
        odometry.send(|message| message.header = header(seq)).unwrap();
        ticks.send(|message| message.header = header(seq)).unwrap();
    }
    drop((ticks, odometry, world));
    let node = system.join(Process::Recorder);
    Recorder::open(&node).unwrap().end().unwrap();

    let recording = Recording::open(&path).unwrap();
    let numbers = |messages: Vec<u64>| assert_eq!(messages, (1..=12).collect::<Vec<_>>());
    numbers(recording.channel(TICK).unwrap().map(|message| message.unwrap().0.header.seq).collect());
    numbers(recording.channel(ODOMETRY).unwrap().map(|message| message.unwrap().0.header.seq).collect());
    drop(node);
    system.remove();
}

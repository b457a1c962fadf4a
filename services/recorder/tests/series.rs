//! A recording that is split into several files while it grows. Whatever is killed, nothing is lost, and all files together
//! are one recording.

mod support;

use std::fs::OpenOptions;
use std::path::{Path, PathBuf};

use sketchnav_recorder::Recorder;
use sketchnav_recordings::Recording;
use sketchnav_recordings::info::info;
use sketchnav_recordings::series;
use sketchnav_schemas::channels::{ODOMETRY, TICK};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::run::Split;
use sketchnav_sketch::messages::SKETCH;
use support::{TestSystem, header, run};

fn ticks(file: &Path) -> Vec<u64> {
    let ticks = Recording::open(file).unwrap().channel(TICK).unwrap();
    ticks.map(|message| message.unwrap().0.header.seq).collect()
}

#[test]
fn files_of_four_seconds_form_one_recording_despite_three_kills() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("runs/test.mcap");
    let mut run = run("series", &path);
    run.split = Split { bytes: None, duration_ns: Some(4_000_000_000) };
    let system = TestSystem::create(&run);
    let (world, sketcher) = (system.join(Process::World), system.join(Process::Sketcher));
    let (mut ticks_out, mut odometry) = (world.writer(TICK).unwrap(), world.writer(ODOMETRY).unwrap());
    let mut sketches = sketcher.writer(SKETCH).unwrap();
    let mut step = |seq| {
        odometry.send(|message| message.header = header(seq)).unwrap();
        ticks_out.send(|message| message.header = header(seq)).unwrap();
    };

    let mut seq = 0;
    for life in 1..=4 {
        let node = system.join(Process::Recorder);
        let mut recorder = Recorder::open(&node).unwrap();
        if life == 1 {
            let mut sketch = sketches.loan_with(1).unwrap();
            (sketch.width_px, sketch.height_px) = (1, 1);
            sketch.send().unwrap();
        }
        for _ in 0..100 {
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
        let newest = series::files(&path).unwrap().pop().unwrap();
        let file = OpenOptions::new().write(true).open(newest).unwrap();
        file.set_len(file.metadata().unwrap().len() - 50).unwrap();
    }
    let node = system.join(Process::Recorder);
    Recorder::open(&node).unwrap().end().unwrap();

    let files = series::files(&path).unwrap();
    assert!(files.len() > 8 && !path.exists(), "{files:?}");
    let mut together = Vec::new();
    for file in &files {
        let found = info(file).unwrap();
        assert!(found.clean_end && found.missing == 0 && found.duration_s < 7.0, "{found:#?}");
        together.extend(ticks(file));
    }
    assert_eq!(together, (1..=seq).collect::<Vec<_>>(), "each message is in one file");
    // The second file does not follow a kill, yet it begins with the latched messages.
    assert_eq!(Recording::open(&files[1]).unwrap().channel(SKETCH).unwrap().count(), 1);

    let whole = folder.path().join("whole.mcap");
    series::whole(&files, std::fs::File::create(&whole).unwrap()).unwrap();
    let found = info(&whole).unwrap();
    assert_eq!((found.missing, found.clean_end, found.restarts), (0, true, 4), "{found:#?}");
    assert_eq!(ticks(&whole), together);
    assert_eq!(Recording::open(&whole).unwrap().channel(SKETCH).unwrap().count(), 1, "it was sent once");
    let yaml = std::fs::read_to_string(path.with_file_name("metadata.yaml")).unwrap();
    let named = files.iter().filter(|file| yaml.contains(file.file_name().unwrap().to_str().unwrap()));
    assert_eq!(named.count(), files.len(), "{yaml}");

    drop((node, ticks_out, odometry, sketches, world, sketcher));
    system.remove();
}

/// Regression test: if no limit of duration was set, a large run was once recorded into one file, regardless of the requested size.
/// The size is now checked at the same point as the duration.
#[test]
fn a_file_ends_at_the_size_limit_of_the_run() {
    const LIMIT: u64 = 60_000;
    let folder = tempfile::tempdir().unwrap();
    // The rest of a file besides its messages: the description of the run, the definitions and the index.
    let rest: u64 =
        record_ticks("series-nothing", &folder.path().join("nothing.mcap"), 0)[0].metadata().unwrap().len();
    let files = record_ticks("series-size", &folder.path().join("test.mcap"), 1600);
    let sizes: Vec<_> = files.iter().map(|file| file.metadata().unwrap().len()).collect();
    assert!(
        files.len() > 1 && sizes.iter().all(|bytes| *bytes < LIMIT + rest),
        "{sizes:?} of {LIMIT} + {rest}"
    );
    assert_eq!(files.iter().flat_map(|file| ticks(file)).collect::<Vec<_>>(), (1..=1600).collect::<Vec<_>>());

    /// Records this many ticks with files of `LIMIT` bytes, and returns the files.
    fn record_ticks(name: &str, path: &Path, count: u64) -> Vec<PathBuf> {
        let mut run = run(name, path);
        run.split = Split { bytes: Some(LIMIT), duration_ns: None };
        let system = TestSystem::create(&run);
        let (world, node) = (system.join(Process::World), system.join(Process::Recorder));
        let mut ticks_out = world.writer(TICK).unwrap();
        let mut recorder = Recorder::open(&node).unwrap();
        for seq in 1..=count {
            ticks_out.send(|message| message.header = header(seq)).unwrap();
            recorder.pass().unwrap();
        }
        recorder.end().unwrap();
        drop((node, ticks_out, world));
        system.remove();
        series::files(path).unwrap()
    }
}

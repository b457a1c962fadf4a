//! The file cannot grow for a while: what the channels still hold is recorded afterwards, the rest counted.

mod support;

use std::path::Path;
use std::time::{Duration, Instant};

use nix::sys::resource::{Resource, getrlimit, setrlimit};
use nix::sys::signal::{SigSet, Signal};
use sketchnav_recorder::Recorder;
use sketchnav_recordings::info::info;
use sketchnav_recordings::reader::Recording;
use sketchnav_runtime::Writer;
use sketchnav_schemas::channels::{SKETCH, TICK};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::message::SketchMap;
use support::{TestSystem, header, run};

/// Longest that the recorder may take to go on.
const LIMIT: Duration = Duration::from_secs(60);

/// A disk without room for more than is on it: no file of this process grows, and nothing can be made at `next_part`.
struct FullDisk<'a> {
    next_part: &'a Path,
    most: (u64, u64),
}

impl<'a> FullDisk<'a> {
    fn fill(recording: &Path, next_part: &'a Path) -> Self {
        // The kernel has a word for it, which ends who does not know it.
        SigSet::from(Signal::SIGXFSZ).thread_block().unwrap();
        let most = getrlimit(Resource::RLIMIT_FSIZE).unwrap();
        setrlimit(Resource::RLIMIT_FSIZE, recording.metadata().unwrap().len(), most.1).unwrap();
        std::fs::create_dir(next_part).unwrap();
        Self { next_part, most }
    }

    /// Files may grow again; still none can be made.
    fn let_grow(&self) {
        setrlimit(Resource::RLIMIT_FSIZE, self.most.0, self.most.1).unwrap();
    }
}

impl Drop for FullDisk<'_> {
    fn drop(&mut self) {
        self.let_grow();
        std::fs::remove_dir(self.next_part).unwrap();
    }
}

fn draw(sketches: &mut Writer<SketchMap>) {
    let mut sketch = sketches.loan_with(6).unwrap();
    (sketch.width_px, sketch.height_px) = (3, 2);
    sketch.send().unwrap();
}

/// Records a run in which a sketch is drawn, a second one just before the disk is full, and so many while it is. Gives
/// the numbers of the sketches in the recording, and how many messages it reports as missing.
fn record(drawn_meanwhile: usize) -> (Vec<u64>, u64) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("test.mcap");
    let next_part = path.with_extension("part2.mcap");
    let run = run("full-disk", &path);
    let system = TestSystem::create(&run);
    let (world, sketcher, recorder_node) =
        (system.join(Process::World), system.join(Process::Sketcher), system.join(Process::Recorder));
    let mut ticks = world.writer(TICK).unwrap();
    let mut sketches = sketcher.writer(SKETCH).unwrap();
    let mut recorder = Recorder::open(&recorder_node).unwrap();
    let mut seq = 0;
    let mut drive = |recorder: &mut Recorder| {
        for _ in 0..20 {
            seq += 1;
            ticks.send(|message| message.header = header(seq)).unwrap();
            // Serves readers that have come.
            sketcher.nap(Duration::ZERO);
            recorder.pass().unwrap();
        }
    };

    draw(&mut sketches);
    drive(&mut recorder);
    let disk = FullDisk::fill(&path, &next_part);
    draw(&mut sketches);
    drive(&mut recorder);
    disk.let_grow();
    (0..drawn_meanwhile).for_each(|_| draw(&mut sketches));
    drive(&mut recorder);
    drop(disk);
    let since = Instant::now();
    while !next_part.exists() {
        assert!(since.elapsed() < LIMIT, "the recorder does not go on");
        recorder.pass().unwrap();
    }
    recorder.end().unwrap();

    let recording = Recording::open(&path).unwrap();
    assert_eq!(recording.channel(TICK).unwrap().count(), 60);
    let drawn = recording.channel(SKETCH).unwrap().map(|sketch| sketch.unwrap().0.header.seq).collect();
    let found = info(&path).unwrap();
    assert_eq!((found.clean_end, found.restarts), (true, 0), "{found:#?}");
    drop((ticks, sketches, world, sketcher, recorder_node));
    system.remove();
    (drawn, found.missing)
}

/// The recorder took sketches out of their channel while it could not write them, and went on behind them. The
/// recording of a run on the pad had a route and estimates in a drawing that was not there. By its numbers nothing was
/// missing, since people do not draw the same drawing twice.
#[test]
fn what_is_drawn_while_the_disk_is_full_is_recorded_when_there_is_room() {
    // The second one was taken, and lost with what could not be written.
    assert_eq!(record(0), (vec![1, 2], 0));
    assert_eq!(record(1), (vec![1, 2, 3], 0));
    // Two wait in the channel.
    assert_eq!(record(3), (vec![1, 4, 5], 2));
}

//! The file cannot grow for a while. Messages that the channels still have are recorded afterwards, and the others are
//! counted.

mod support;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use nix::sys::resource::{Resource, getrlimit, setrlimit};
use nix::sys::signal::{SigSet, Signal};
use sketchnav_recorder::Recorder;
use sketchnav_recordings::info::info;
use sketchnav_recordings::reader::Recording;
use sketchnav_runtime::Writer;
use sketchnav_schemas::channels::TICK;
use sketchnav_schemas::codes::Process;
use sketchnav_sketch::messages::{SKETCH, SketchMap};
use support::{TestSystem, header, run};

/// Maximum time that the recorder may take to continue.
const LIMIT: Duration = Duration::from_secs(60);

/// A disk without any space left. No file of this process grows, and none can be created in the recording's folder, since the
/// folder has been moved elsewhere and a file has taken its name.
struct FullDisk {
    folder: PathBuf,
    elsewhere: PathBuf,
    most: (u64, u64),
}

impl FullDisk {
    fn fill(recording: &Path) -> Self {
        // The kernel sends a signal when a file exceeds the limit, which ends a process that does not handle it.
        SigSet::from(Signal::SIGXFSZ).thread_block().unwrap();
        let most = getrlimit(Resource::RLIMIT_FSIZE).unwrap();
        setrlimit(Resource::RLIMIT_FSIZE, recording.metadata().unwrap().len(), most.1).unwrap();
        let folder = recording.parent().unwrap().to_owned();
        let elsewhere = folder.with_extension("elsewhere");
        std::fs::rename(&folder, &elsewhere).unwrap();
        std::fs::File::create(&folder).unwrap();
        Self { folder, elsewhere, most }
    }

    /// Lets files grow again, although none can be created yet.
    fn let_grow(&self) {
        setrlimit(Resource::RLIMIT_FSIZE, self.most.0, self.most.1).unwrap();
    }
}

impl Drop for FullDisk {
    fn drop(&mut self) {
        self.let_grow();
        std::fs::remove_file(&self.folder).unwrap();
        std::fs::rename(&self.elsewhere, &self.folder).unwrap();
    }
}

fn draw(sketches: &mut Writer<SketchMap>) {
    let mut sketch = sketches.loan_with(6).unwrap();
    (sketch.width_px, sketch.height_px) = (3, 2);
    sketch.send().unwrap();
}

/// Records a run in which a sketch is drawn at the start, a second one when the disk has just filled up and the recorder has not
/// noticed yet, and `drawn_meanwhile` more while no new part can be created. Returns the numbers of the sketches in the recording,
/// and how many messages it reports as missing. With `ends_at_once`, the run ends as soon as there is space again, before the
/// recorder has noticed. A foreign file has the name of the next part. Such a file was once taken for a part of the recording,
/// joined with it and removed.
fn record(drawn_meanwhile: usize, ends_at_once: bool) -> (Vec<u64>, u64) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("runs/test.mcap");
    let next_part = path.with_extension("part3.mcap");
    let run = run("full-disk", &path);
    let system = TestSystem::create(&run);
    let (world, sketcher, recorder_node) =
        (system.join(Process::World), system.join(Process::Sketcher), system.join(Process::Recorder));
    let mut ticks = world.writer(TICK).unwrap();
    let mut sketches = sketcher.writer(SKETCH).unwrap();
    let mut recorder = Recorder::open(&recorder_node).unwrap();
    // A foreign file with the name that the next part would have.
    let foreign = path.with_extension("part2.mcap");
    std::fs::write(&foreign, "precious").unwrap();
    let mut seq = 0;
    let mut drive = |recorder: &mut Recorder| {
        for _ in 0..20 {
            seq += 1;
            ticks.send(|message| message.header = header(seq)).unwrap();
            // Serves readers that have joined.
            sketcher.nap(Duration::ZERO);
            recorder.pass().unwrap();
        }
    };

    draw(&mut sketches);
    drive(&mut recorder);
    let disk = FullDisk::fill(&path);
    draw(&mut sketches);
    drive(&mut recorder);
    disk.let_grow();
    (0..drawn_meanwhile).for_each(|_| draw(&mut sketches));
    drive(&mut recorder);
    drop(disk);
    let since = Instant::now();
    while !ends_at_once && !next_part.exists() {
        assert!(since.elapsed() < LIMIT, "the recorder does not continue");
        recorder.pass().unwrap();
    }
    recorder.end().unwrap();
    assert_eq!(std::fs::read_to_string(&foreign).unwrap(), "precious");

    let recording = Recording::open(&path).unwrap();
    assert_eq!(recording.channel(TICK).unwrap().count(), 60);
    let drawn = recording.channel(SKETCH).unwrap().map(|sketch| sketch.unwrap().0.header.seq).collect();
    let found = info(&path).unwrap();
    assert_eq!((found.clean_end, found.restarts), (true, 0), "{found:#?}");
    drop((ticks, sketches, world, sketcher, recorder_node));
    system.remove();
    (drawn, found.missing)
}

/// Regression test: while the recorder could not write, it removed sketches from their channel and continued after them. The
/// recording of a run on the pad then contained a route and estimates that referred to a missing drawing. The message numbers did
/// not reveal the gap, since people do not draw the same drawing twice.
#[test]
fn a_drawing_made_while_the_disk_is_full_is_recorded_once_there_is_space() {
    // The second sketch was taken from the channel, and lost with the messages that could not be written.
    assert_eq!(record(0, false), (vec![1, 2], 0));
    assert_eq!(record(1, false), (vec![1, 2, 3], 0));
    // Only two sketches fit into the channel.
    assert_eq!(record(3, false), (vec![1, 4, 5], 2));
    assert_eq!(record(1, true), (vec![1, 2, 3], 0));
}

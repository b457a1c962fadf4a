//! Measures how fast recordings are read: the summary of a 1 GB recording, five seconds from its middle, and a whole channel.
//! `SKETCHNAV_BENCH_BYTES` sets the size of the file, which is written once into a temporary folder.

use std::fs::File;
use std::hint::black_box;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use bytemuck::Zeroable;
use criterion::{Criterion, criterion_group, criterion_main};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;
use sketchnav_recordings::reader::Selection;
use sketchnav_recordings::{Recording, Writer, info};
use sketchnav_schemas::channels::{ODOMETRY, SCAN};
use sketchnav_schemas::geometry::Pose;
use sketchnav_schemas::message::{Header, LaserScan, MAX_BEAMS, Odometry, PoseM};
use sketchnav_schemas::run::RunConfig;
use sketchnav_schemas::seed::stream;

const STEP_NS: u64 = 100_000_000;

fn bytes() -> u64 {
    std::env::var("SKETCHNAV_BENCH_BYTES").ok().and_then(|text| text.parse().ok()).unwrap_or(1_000_000_000)
}

/// Writes scans of noise, which cannot be compressed, and odometry, flushed every 16 steps as by a recorder. Returns the
/// number of steps.
fn write(path: &Path) -> u64 {
    let run: RunConfig =
        serde_json::from_str(include_str!("../../services/recorder/tests/run.json")).expect("a run");
    let mut writer =
        Writer::create(BufWriter::new(File::create(path).expect("a file")), &run).expect("a writer");
    let mut random: Pcg64Mcg = stream(1, "bench");
    let mut scan = LaserScan { beam_count: MAX_BEAMS as u32, range_max_m: 30.0, ..LaserScan::zeroed() };
    let mut step = 0;
    loop {
        step += 1;
        let header = Header { seq: step, stamp_ns: step * STEP_NS, source_seq: step };
        scan.header = header;
        scan.ranges_m.iter_mut().for_each(|range| *range = random.next_u32() as f32 * 1e-9);
        let pose = PoseM::new(&Pose::<sketchnav_schemas::geometry::Odom>::new(step as f64, 0.0, 0.0));
        writer.write(ODOMETRY, &Odometry { header, pose, ..Odometry::zeroed() }, &[]).expect("odometry");
        writer.write(SCAN, &scan, &[]).expect("a scan");
        if step % 16 == 0 {
            writer.flush().expect("a flush");
            if step % 1024 == 0 && std::fs::metadata(path).expect("the file").len() >= bytes() {
                break;
            }
        }
    }
    writer.finish().expect("an end");
    step
}

fn reading(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a folder");
    let path: PathBuf = folder.path().join("large.mcap");
    let steps = write(&path);
    let size = std::fs::metadata(&path).expect("the file").len();
    let recording = Recording::open(&path).expect("the recording");
    let chunks = recording.index().expect("its index").chunk_count();
    let middle = steps / 2 * STEP_NS;
    let five_seconds = middle..middle + 50 * STEP_NS;
    let mut seek = recording.channel(SCAN).expect("scans").between(five_seconds.clone());
    let found = seek.by_ref().count();
    println!(
        "{:.2} GB, {steps} scans, {chunks} chunks; 5 s: {found} scans, {:.2} MB read",
        size as f64 / 1e9,
        seek.bytes_read() as f64 / 1e6
    );
    let mut group = criterion.benchmark_group("reading");
    group.sample_size(10);
    group.bench_function("info", |b| b.iter(|| info::info(black_box(&path)).expect("info")));
    group.bench_function("five seconds of scans, index and all", |b| {
        b.iter(|| {
            let recording = Recording::open(&path).expect("the recording");
            recording.channel(SCAN).expect("scans").between(five_seconds.clone()).count()
        });
    });
    group.bench_function("five seconds in the order of time", |b| {
        b.iter(|| {
            recording.timeline(Selection::default().between(five_seconds.clone())).expect("messages").count()
        });
    });
    group.bench_function("all odometry", |b| {
        b.iter(|| recording.channel(ODOMETRY).expect("odometry").count())
    });
    group.finish();
}

criterion_group!(benches, reading);
criterion_main!(benches);

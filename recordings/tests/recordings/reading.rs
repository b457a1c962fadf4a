//! Tests how part of a recording is read (a range of times, some topics, or in order of time), and how little of the file that
//! takes.

use std::path::{Path, PathBuf};

use proptest::prelude::*;
use sketchnav_recordings::Recording;
use sketchnav_recordings::info::{info, info_of_messages};
use sketchnav_recordings::reader::{Part, RawMessage, Selection};
use sketchnav_schemas::channels;

use super::common;

const STEPS: u64 = 400;
const STEP_NS: u64 = 100_000_000;

/// Writes the story in chunks of `of` steps, each as a recorder drains it: one channel after another.
fn story_in_chunks(path: &Path, steps: u64, of: u64) {
    let mut writer = common::create(path);
    common::write_beginning(&mut writer);
    for step in 1..=steps {
        common::write_step(&mut writer, step);
        if step % of == 0 {
            writer.flush().unwrap();
        }
    }
    writer.finish().unwrap();
}

fn story() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("story.mcap");
    story_in_chunks(&path, STEPS, 16);
    (folder, path)
}

fn all(recording: &Recording) -> Vec<RawMessage> {
    let messages = recording.parts().unwrap().map(Result::unwrap);
    messages.filter_map(|part| if let Part::Message(message) = part { Some(message) } else { None }).collect()
}

fn key(message: &RawMessage) -> (String, u32, u64) {
    (message.topic.name.clone(), message.sequence, message.stamp_ns)
}

#[test]
fn a_seek_reads_only_the_chunks_that_it_needs() {
    let (_folder, path) = story();
    let recording = Recording::open(&path).unwrap();
    let index = recording.index().unwrap();
    assert!(index.is_from_summary() && index.chunk_count() >= 25, "{} chunks", index.chunk_count());
    let mut scans = recording.channel(channels::SCAN).unwrap().between(20 * STEP_NS..25 * STEP_NS);
    let read: Vec<_> = scans.by_ref().map(|scan| scan.unwrap().0.header.seq).collect();
    assert_eq!(read, [20, 21, 22, 23, 24]);
    let whole = std::fs::metadata(&path).unwrap().len();
    assert!(scans.bytes_read() < whole / 10, "{} of {whole} bytes", scans.bytes_read());
    // The sketch is only in the first chunk.
    let mut sketch = recording.channel(sketchnav_sketch::messages::SKETCH).unwrap();
    assert_eq!(sketch.by_ref().count(), 1);
    assert!(sketch.bytes_read() < whole / 10, "{} of {whole} bytes", sketch.bytes_read());
}

#[test]
fn messages_in_order_of_time_keep_the_order_of_a_step() {
    let (_folder, path) = story();
    let recording = Recording::open(&path).unwrap();
    let messages: Vec<_> = recording.timeline(Selection::default()).unwrap().map(Result::unwrap).collect();
    assert_eq!(messages.len(), all(&recording).len());
    assert!(messages.is_sorted_by_key(|message| message.stamp_ns));
    let of_step = messages.iter().filter(|message| message.stamp_ns == 7 * STEP_NS);
    let topics: Vec<_> = of_step.map(|message| message.topic.name.as_str()).collect();
    assert_eq!(
        topics,
        ["/truth", "/odometry", "/scan", "/tick", "/estimate", "/command", "/status", "/tf", "/health"]
    );
}

#[test]
fn the_summary_agrees_with_the_messages() {
    let (_folder, path) = story();
    assert_eq!(info(&path).unwrap(), info_of_messages(&path).unwrap());
}

#[test]
fn a_file_without_a_summary_can_be_indexed() {
    let (_folder, path) = story();
    let whole = std::fs::read(&path).unwrap();
    let expected: Vec<_> = all(&Recording::open(&path).unwrap()).iter().map(key).collect();
    std::fs::write(&path, &whole[..whole.len() - 1]).unwrap();
    let recording = Recording::open(&path).unwrap();
    assert!(!recording.index().unwrap().is_from_summary());
    let found = recording.select(Selection::default()).unwrap().map(|message| key(&message.unwrap()));
    assert!(found.eq(expected));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Whatever is selected, the result is the same as filtering all messages.
    #[test]
    fn a_selection_yields_exactly_the_matching_messages(first in 0..50_u64, length in 0..50_u64, topics in prop::option::of(0..8_usize), of in 1..20_u64) {
        const TOPICS: [&str; 8] = ["/scan", "/odometry", "/sketch", "/tf", "/health", "/estimate", "/plan", "/none"];
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("story.mcap");
        story_in_chunks(&path, 40, of);
        let recording = Recording::open(&path).unwrap();
        let times = first * STEP_NS..(first + length) * STEP_NS;
        let wanted = |m: &&RawMessage| times.contains(&m.stamp_ns) && topics.is_none_or(|t| m.topic.name == TOPICS[t]);
        let everything = all(&recording);
        let mut expected: Vec<_> = everything.iter().filter(wanted).map(key).collect();
        let selection = topics.map_or(Selection::default(), |t| Selection::of_topics([TOPICS[t]]));
        let selection = selection.between(times.clone());
        let found = recording.select(selection.clone()).unwrap().map(|message| key(&message.unwrap()));
        prop_assert!(found.eq(expected.iter().cloned()));
        let mut in_time: Vec<_> = recording.timeline(selection).unwrap().map(|m| key(&m.unwrap())).collect();
        expected.sort();
        in_time.sort();
        prop_assert_eq!(in_time, expected);
    }
}

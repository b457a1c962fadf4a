//! Files that are cut, flipped, or lie: a clear error, or what is whole; never a panic, and never more
//! memory than the file and its longest chunk explain.

use std::path::Path;

use proptest::prelude::*;
use sketchnav_recordings::info::info_of_messages;
use sketchnav_recordings::reader::{Part, Selection};
use sketchnav_recordings::{Recording, RecordingError};

use super::common;

/// Reads a file in every way that there is; what the first said.
fn read_all(path: &Path) -> Result<(u64, bool), RecordingError> {
    let told = info_of_messages(path).map(|info| (info.messages, info.clean_end));
    let _ = sketchnav_recordings::info::info(path);
    if let Ok(recording) = Recording::open(path) {
        let _ = recording.run();
        let _ = recording.select(Selection::default()).map(|all| all.filter(Result::is_ok).count());
        let _ = recording.timeline(Selection::default()).map(|all| all.filter(Result::is_ok).count());
        let _ = recording.parts().map(|parts| parts.filter(Result::is_ok).count());
    }
    told
}

fn story(path: &Path, steps: u64) -> Vec<u8> {
    let mut writer = common::create(path);
    common::write_beginning(&mut writer);
    for step in 1..=steps {
        common::write_step(&mut writer, step);
        if step % 4 == 0 {
            writer.flush().unwrap();
        }
    }
    writer.finish().unwrap();
    std::fs::read(path).unwrap()
}

/// Where each top-level record begins, and its opcode.
fn records(file: &[u8]) -> Vec<(usize, u8)> {
    let (mut at, mut found) = (8, Vec::new());
    while at + 9 <= file.len() - 8 {
        found.push((at, file[at]));
        at += 9 + u64::from_le_bytes(file[at + 1..at + 9].try_into().unwrap()) as usize;
    }
    found
}

const CHUNK: u8 = 6;

#[test]
fn a_file_cut_at_any_byte_of_its_last_chunks_gives_what_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.mcap");
    let whole = story(&path, 12);
    let messages = read_all(&path).unwrap().0;
    let chunks: Vec<_> = records(&whole).into_iter().filter(|(_, opcode)| *opcode == CHUNK).collect();
    let begin = chunks[chunks.len() - 2].0;
    let mut least = 0;
    let last = chunks[chunks.len() - 1].0;
    let length = u64::from_le_bytes(whole[last + 1..last + 9].try_into().unwrap()) as usize;
    let end = last + 9 + length;
    for cut in (begin..=end).chain((end..whole.len()).step_by(7)).chain([whole.len() - 1]) {
        std::fs::write(&path, &whole[..cut]).unwrap();
        let (found, clean) = read_all(&path).unwrap_or_else(|error| panic!("cut at {cut}: {error}"));
        assert!((least..=messages).contains(&found), "cut at {cut}: {found} messages");
        assert!(!clean || found == messages, "cut at {cut}");
        least = found;
    }
    assert_eq!(least, messages);
}

#[test]
fn lengths_and_counts_that_lie_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lies.mcap");
    let whole = story(&path, 8);
    let (expected, _) = read_all(&path).unwrap();
    for (at, opcode) in records(&whole) {
        // The record's own length, then every four bytes of its content: lengths of texts, maps, chunks.
        let content = at + 9..(at + 9 + 48).min(whole.len() - 8);
        for place in [at + 1].into_iter().chain(content.step_by(4)) {
            for lie in [u64::MAX, 1 << 31, 0xffff] {
                let mut file = whole.clone();
                let width = (file.len() - place).min(8);
                file[place..place + width].copy_from_slice(&lie.to_le_bytes()[..width]);
                std::fs::write(&path, &file).unwrap();
                if let Ok((found, _)) = read_all(&path) {
                    assert!(found <= expected, "record {opcode} at {at}, byte {place}: {found} messages");
                }
            }
        }
    }
}

/// A file without chunks read as an empty one: its messages were in no index.
#[test]
fn messages_in_no_chunk_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("loose.mcap");
    let options = mcap::WriteOptions::new().use_chunks(false);
    let mut other = options.create(std::fs::File::create(&path).unwrap()).unwrap();
    let ids = ["/a", "/b"].map(|topic| other.add_channel(0, topic, "json", &Default::default()).unwrap());
    // Some megabytes, so that there is more than one run of them.
    let text = vec![b' '; 4000];
    for sequence in 1..=800_u32 {
        let log_time = 1000 - u64::from(sequence);
        let channel_id = ids[usize::from(sequence % 4 == 0)];
        let header = mcap::records::MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
        other.write_to_known_channel(&header, &text).unwrap();
    }
    other.finish().unwrap();
    drop(other);
    assert_eq!(read_all(&path).unwrap(), (800, true));
    let recording = Recording::open(&path).unwrap();
    assert!(recording.index().unwrap().chunk_count() > 2);
    let wanted = Selection::of_topics(["/b"]).between(500..u64::MAX);
    let found: Vec<_> = recording.select(wanted.clone()).unwrap().map(|m| m.unwrap().sequence).collect();
    assert_eq!(found, (4..=500).step_by(4).collect::<Vec<_>>());
    let mut in_time: Vec<_> = recording.timeline(wanted).unwrap().map(|m| m.unwrap().sequence).collect();
    in_time.reverse();
    assert_eq!(in_time, found);
}

/// The length of a chunk that the file has no room for: the error says where, not that there is no index.
#[test]
fn a_chunk_that_ends_behind_the_file_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.mcap");
    let mut file = story(&path, 8);
    let (at, _) = records(&file).into_iter().filter(|(_, opcode)| *opcode == CHUNK).nth(1).unwrap();
    file[at + 1..at + 9].copy_from_slice(&(1_u64 << 24).to_le_bytes());
    std::fs::write(&path, &file).unwrap();
    let mut selected = Recording::open(&path).unwrap().select(Selection::default()).unwrap();
    let error = selected.find_map(Result::err).unwrap().to_string();
    assert!(error.contains(&format!("byte {at}: the file ends before")), "{error}");
}

#[test]
fn of_another_profile_or_empty() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("other.mcap");
    let mut other = mcap::Writer::new(std::fs::File::create(&path).unwrap()).unwrap();
    let id = other.add_channel(0, "/text", "json", &Default::default()).unwrap();
    let header = mcap::records::MessageHeader { channel_id: id, sequence: 7, log_time: 5, publish_time: 5 };
    other.write_to_known_channel(&header, b"{}").unwrap();
    other.finish().unwrap();
    drop(other);
    assert_eq!(read_all(&path).unwrap(), (1, true));
    let recording = Recording::open(&path).unwrap();
    let error = recording.run().unwrap_err().to_string();
    assert_eq!(error, "the run's run.json: is not in the file");
    let mut messages = recording.parts().unwrap().filter_map(|part| match part.unwrap() {
        Part::Message(message) => Some(message.typed::<sketchnav_schemas::message::LaserScan>()),
        _ => None,
    });
    assert!(messages.next().unwrap().is_err());
    for (content, said) in
        [("", "it is empty"), ("\u{89}MCA", "it is empty"), ("no recording at all", "magic")]
    {
        std::fs::write(&path, content).unwrap();
        let error = Recording::open(&path).unwrap_err().to_string();
        assert!(error.contains(said) && error.contains("other.mcap"), "{error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn flipped_bytes_and_cuts_never_panic(
        flips in prop::collection::vec((any::<prop::sample::Index>(), 1..=255_u8), 0..4),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("story.mcap");
        let mut file = story(&path, 12);
        for (at, by) in flips {
            let at = at.index(file.len());
            file[at] ^= by;
        }
        if let Some(cut) = cut {
            file.truncate(cut.index(file.len() + 1));
        }
        std::fs::write(&path, &file).unwrap();
        let _ = read_all(&path);
    }
}

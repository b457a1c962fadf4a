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

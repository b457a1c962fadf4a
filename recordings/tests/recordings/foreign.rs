//! Recordings by other software are read, and other files are identified in the error.

use std::path::{Path, PathBuf};

use sketchnav_recordings::copy::{Copied, Copy, Damaged, filter, held, merge, recover, split};
use sketchnav_recordings::dynamic::Decoder;
use sketchnav_recordings::info::{info, info_of_messages};
use sketchnav_recordings::reader::{RawMessage, Selection};
use sketchnav_recordings::samples::{SampleForm, SampleTopic, packed, point_stamped, points, recording};
use sketchnav_recordings::{Recording, RecordingError, Writer};

use super::common;

const COUNT: u64 = 25;

/// A way of copying a recording.
type CopyBy<'a> = dyn Fn(&mut Copy<Vec<u8>>) + 'a;

fn write(folder: &Path, form: SampleForm, topics: &[SampleTopic]) -> PathBuf {
    let path = folder.join("other.mcap");
    std::fs::write(&path, recording(form, topics)).unwrap();
    path
}

fn messages(path: &Path) -> Vec<RawMessage> {
    let recording = Recording::open(path).unwrap();
    recording.timeline(Selection::default()).unwrap().map(Result::unwrap).collect()
}

fn recovered(path: &Path, damaged: Damaged) -> (Copied, Vec<u8>) {
    let mut copy = Copy::new(Vec::new()).unwrap();
    let copied = recover(path, damaged, &mut copy).unwrap();
    (copied, copy.finish().unwrap())
}

/// Regression test: a recording with lz4 chunks was reported as damaged, and `recover` left nothing of it.
#[test]
fn every_compression_of_mcap_is_read() {
    let folder = tempfile::tempdir().unwrap();
    for compression in ["", "lz4", "zstd"] {
        let form = SampleForm { compression, ..SampleForm::default() };
        let path = write(folder.path(), form, &[points("/ball", COUNT, false)]);
        assert_eq!(messages(&path).len() as u64, COUNT, "{compression}");
        let (copied, _) = recovered(&path, Damaged::LeaveOut);
        assert!(copied.messages == COUNT && !copied.has_loss(), "{compression}: {copied:?}");
        // After a wrong length, the next chunk is found, however it is compressed.
        let mut file = std::fs::read(&path).unwrap();
        let chunk = 8 + 9 + 4 + 4 + 4 + "another tool".len();
        assert_eq!(file[chunk], 6);
        file[chunk + 1..chunk + 9].fill(0xff);
        std::fs::write(&path, file).unwrap();
        let (copied, _) = recovered(&path, Damaged::LeaveOut);
        assert_eq!(copied.messages, COUNT - 10, "{compression}: {copied:?}");
    }
}

/// Regression test: among messages that rosbag2 had compressed individually, a damaged one was silently copied unchanged.
#[test]
fn a_message_that_cannot_be_decompressed_is_skipped_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let mut ball = points("/ball", COUNT, false);
    ball.messages.iter_mut().for_each(|(_, _, data)| *data = packed("zstd", data));
    let damaged = &mut ball.messages[20].2;
    damaged.truncate(damaged.len() - 5);
    let path = write(folder.path(), SampleForm::default(), &[ball]);
    let recording = Recording::open(&path).unwrap();
    let copies: [&CopyBy; 2] = [
        &|copy: &mut Copy<Vec<u8>>| filter(&recording, &Selection::default(), copy).unwrap(),
        &|copy: &mut Copy<Vec<u8>>| merge(std::slice::from_ref(&recording), copy).unwrap(),
    ];
    for make in copies {
        let mut copy = Copy::new(Vec::new()).unwrap();
        make(&mut copy);
        assert_eq!((copy.messages(), copy.left_out().messages()), (COUNT - 1, 1));
        let words = copy.left_out().list()[0].to_string();
        assert!(words.contains("1 message of /ball") && words.contains("a damaged one"), "{words}");
    }
    let parts = split(&recording, None, |_| Ok(Vec::new())).unwrap();
    assert_eq!((parts[0].messages["/ball"], parts[0].left_out.messages()), (COUNT - 1, 1));
    let (copied, _) = recovered(&path, Damaged::LeaveOut);
    assert!(copied.has_loss() && copied.lost_chunks == 0, "{copied:?}");
    assert_eq!((copied.messages, copied.lost.len()), (COUNT - 1, 1), "{copied:?}");
    assert_eq!(held(&path).unwrap().messages, COUNT);
    let notes = info(&path).unwrap().notes.join(" ");
    assert!(notes.contains("damaged: 1 of them"), "{notes}");
}

#[test]
fn an_unknown_compression_is_named_and_everything_else_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let form = SampleForm { compression: "snappy", ..SampleForm::default() };
    let path = write(folder.path(), form, &[points("/ball", COUNT, false)]);
    let error = Recording::open(&path).unwrap_err().to_string();
    assert!(error.contains("zstd, with lz4 or not at all, found \"snappy\""), "{error}");
    let (copied, _) = recovered(&path, Damaged::LeaveOut);
    assert_eq!((copied.messages, copied.lost_chunks), (0, 3));
    assert_eq!(held(&path).unwrap().messages, COUNT, "a copy must not replace these");
}

/// rosbag2 writes 0 as the sequence number of every message, which MCAP allows.
#[test]
fn messages_without_sequence_numbers_do_not_count_as_missing() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), SampleForm::default(), &[points("/ball", COUNT, false)]);
    let info_of_copy = info(&path).unwrap();
    assert_eq!((info_of_copy.messages, info_of_copy.missing), (COUNT, 0));
    assert_eq!((info_of_copy.profile.as_str(), info_of_copy.library.as_str()), ("ros2", "another tool"));
    assert!(info_of_copy.notes[0].contains("not a sketchnav recording"), "{:?}", info_of_copy.notes);
    let original = Recording::open(&path).unwrap();
    let mut copies = Vec::new();
    let mut copy = Copy::new(Vec::new()).unwrap();
    filter(&original, &Selection::default(), &mut copy).unwrap();
    copies.push((COUNT, copy.finish().unwrap()));
    let mut copy = Copy::new(Vec::new()).unwrap();
    merge(&[original.clone(), original.clone()], &mut copy).unwrap();
    copies.push((2 * COUNT, copy.finish().unwrap()));
    let part = folder.path().join("part.mcap");
    split(&original, None, |_| Ok(std::fs::File::create(&part).unwrap())).unwrap();
    copies.push((COUNT, std::fs::read(&part).unwrap()));
    for (count, bytes) in copies {
        let path = folder.path().join("copy.mcap");
        std::fs::write(&path, bytes).unwrap();
        let info_of_copy = info(&path).unwrap();
        assert_eq!((info_of_copy.messages, info_of_copy.missing), (count, 0));
        assert_eq!(info_of_copy.messages, info_of_messages(&path).unwrap().messages);
    }
}

/// A recording may begin while its publishers' numbers are already running.
#[test]
fn other_tools_may_begin_counting_at_any_number() {
    let folder = tempfile::tempdir().unwrap();
    let mut topic = points("/ball", COUNT, false);
    topic.messages.iter_mut().zip(500..).for_each(|((_, seq, _), number)| *seq = number);
    topic.messages.remove(7);
    let path = write(folder.path(), SampleForm::default(), &[topic]);
    assert_eq!(info(&path).unwrap().missing, 1);
}

#[test]
fn both_byte_orders_and_messages_compressed_one_by_one_decode_alike() {
    let folder = tempfile::tempdir().unwrap();
    let plain = points("/ball", COUNT, false);
    let mut packed = plain.clone();
    for (_, _, data) in &mut packed.messages {
        *data = zstd::stream::encode_all(data.as_slice(), 1).unwrap();
    }
    let mut said = Vec::new();
    for topic in [plain, points("/ball", COUNT, true), packed] {
        let path = write(folder.path(), SampleForm::default(), &[topic]);
        let mut decoder = Decoder::default();
        let all: Vec<_> = messages(&path).iter().map(|raw| decoder.decode(raw).unwrap()).collect();
        assert_eq!(all.len() as u64, COUNT);
        said.push(all);
    }
    assert_eq!(said[0], said[1]);
    assert_eq!(said[0], said[2]);
    assert_eq!(said[0][3]["point"]["x"], 3.0);
    assert_eq!(said[0][3]["header"]["stamp"]["nanosec"], 300_000_000);
    assert_eq!(said[0][3]["header"]["frame_id"], "map");
}

#[test]
fn a_copy_contains_compressed_messages_decompressed() {
    let folder = tempfile::tempdir().unwrap();
    let mut topic = points("/ball", 1, false);
    let data = zstd::stream::encode_all(topic.messages[0].2.as_slice(), 1).unwrap();
    topic.messages[0].2 = data;
    let path = write(folder.path(), SampleForm::default(), &[topic]);
    let notes = info(&path).unwrap().notes.join("\n");
    assert!(notes.contains("1 messages compressed individually") && notes.contains("MESSAGE"), "{notes}");
    let (_, copy) = recovered(&path, Damaged::LeaveOut);
    std::fs::write(&path, copy).unwrap();
    assert_eq!(messages(&path)[0].cdr, point_stamped(1_700_000_000_000_000_000, [0.0, 2.0], false));
}

#[test]
fn ros_1_messages_are_reported_and_json_is_passed_on() {
    let folder = tempfile::tempdir().unwrap();
    let form = SampleForm { profile: "ros1", compression: "lz4", ..SampleForm::default() };
    let ros1 = SampleTopic { encoding: "ros1", language: "ros1msg", ..points("/ball", 3, false) };
    let json = SampleTopic {
        name: "/text",
        kind: "",
        language: "jsonschema",
        definition: "{}",
        encoding: "json",
        messages: vec![(1_700_000_000_000_000_000, 0, br#"{ "a": [1, 2] }"#.to_vec())],
    };
    let path = write(folder.path(), form, &[ros1, json]);
    let info_of_copy = info(&path).unwrap();
    assert_eq!((info_of_copy.profile.as_str(), info_of_copy.messages), ("ros1", 4));
    let notes = info_of_copy.notes.join("\n");
    assert!(notes.contains("/ball: ROS 1 messages") && notes.contains("rosbags-convert"), "{notes}");
    assert!(notes.contains("/text: messages in JSON"), "{notes}");
    let mut decoder = Decoder::default();
    for raw in messages(&path) {
        match (raw.topic.name.as_str(), decoder.decode(&raw)) {
            ("/text", said) => assert_eq!(said.unwrap()["a"][1], 2),
            (_, Err(error @ RecordingError::Form { .. })) => {
                let error = error.to_string();
                assert!(error.contains("found ROS 1 messages") && error.contains("filter, merge"), "{error}");
            }
            (name, other) => panic!("{name}: {other:?}"),
        }
    }
    // A copy has the same profile.
    let mut copy = Copy::of_profile(Vec::new(), &Recording::open(&path).unwrap().header().profile).unwrap();
    filter(&Recording::open(&path).unwrap(), &Selection::default(), &mut copy).unwrap();
    std::fs::write(&path, copy.finish().unwrap()).unwrap();
    assert_eq!(info(&path).unwrap().profile, "ros1");
}

/// Regression test: `recover` dropped chunks with a wrong checksum for good. It reported how many there were, but not where and
/// why.
#[test]
fn messages_with_a_wrong_checksum_are_listed_and_kept_on_request() {
    let folder = tempfile::tempdir().unwrap();
    let form = SampleForm { has_checksums: false, ..SampleForm::default() };
    let path = write(folder.path(), form, &[points("/ball", COUNT, false)]);
    let (copied, _) = recovered(&path, Damaged::LeaveOut);
    let lost: Vec<_> = copied.lost.iter().map(|lost| lost.messages).collect();
    assert_eq!((copied.messages, lost), (0, vec![Some(10), Some(10), Some(5)]));
    assert!(copied.lost[0].reason.contains("checksum of a chunk is wrong"), "{copied:?}");
    assert!(copied.lost.is_sorted_by_key(|lost| lost.at) && copied.lost[0].at > 8);
    let held = held(&path).unwrap();
    assert!(held.messages == COUNT && held.is_known, "{held:?}");
    let (copied, copy) = recovered(&path, Damaged::Keep);
    assert_eq!((copied.messages, copied.kept_damaged, copied.has_loss()), (COUNT, 3, false));
    std::fs::write(&path, copy).unwrap();
    assert_eq!(messages(&path).len() as u64, COUNT);
}

#[test]
fn a_file_other_than_a_recording_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.mcap");
    for (content, words) in [
        (&b"SQLite format 3\0 and so on"[..], "ros2 bag convert"),
        (b"#ROSBAG V2.0\n and so on", "rosbags-convert"),
        (b"rosbag2_bagfile_information:\n", "pass the folder"),
        (b"\x04\x22\x4d\x18 and so on", "lz4 -d"),
        (b"PARAM laser_front_laser_resolution 1\n", "sketchnav import"),
    ] {
        std::fs::write(&path, content).unwrap();
        let errors =
            [Recording::open(&path).unwrap_err(), held(&path).unwrap_err(), info(&path).unwrap_err()];
        for error in errors {
            assert!(matches!(error, RecordingError::Foreign { .. }), "{error}");
            assert!(error.to_string().contains(words) && error.to_string().contains("x.mcap"), "{error}");
        }
    }
}

/// Regression test: a message whose topic is not a channel was silently left out of a copy.
#[test]
fn the_writer_of_runs_refuses_an_unknown_topic() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), SampleForm::default(), &[points("/ball", 1, false)]);
    let mut writer = Writer::create(Vec::new(), &common::run_config()).unwrap();
    let error = writer.write_raw(&messages(&path)[0]).unwrap_err();
    assert!(matches!(&error, RecordingError::UnknownTopic { topic } if topic == "/ball"), "{error}");
}

/// Regression test: if rosbag2 had not found a definition, its messages were reported as too long. If a topic had two types,
/// only one was shown.
#[test]
fn an_empty_definition_and_a_second_type_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let undefined = SampleTopic { definition: "", ..points("/ball", COUNT, false) };
    let path = write(folder.path(), SampleForm::default(), &[undefined]);
    let error = Decoder::default().decode(&messages(&path)[0]).unwrap_err();
    let words = "expected the definition of geometry_msgs/msg/PointStamped, found none in the file";
    assert!(error.to_string().contains(words) && !error.is_one_message(), "{error}");
    let other = SampleTopic { kind: "geometry_msgs/msg/PoseStamped", ..points("/ball", COUNT, false) };
    let path = write(folder.path(), SampleForm::default(), &[points("/ball", COUNT, false), other]);
    let notes = info(&path).unwrap().notes.join("\n");
    let words = "/ball: messages of 2 types: geometry_msgs/msg/PointStamped, geometry_msgs/msg/PoseStamped";
    assert!(notes.contains(words), "{notes}");
}

/// Regression test: another tool had left out scans but copied the facts about the topics, which said "0 missing".
#[test]
fn metadata_of_topics_copied_by_another_tool_is_ignored() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("story.mcap");
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/story.mcap");
    let mut file = std::fs::read(golden).unwrap();
    let mut replace = |from: &[u8], to: &[u8]| {
        let at = file.windows(from.len()).position(|found| found == from).unwrap();
        file[at..at + to.len()].copy_from_slice(to);
        std::fs::write(&path, &file).unwrap();
        info(&path).unwrap().missing
    };
    assert_eq!(replace(br#""missing":0"#, br#""missing":7"#), 7);
    assert_eq!(replace(b"sketchnav ", b"other-tool"), 0);
}

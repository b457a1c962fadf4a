//! Recordings made from other ones: intact parts stay as they are, and damaged parts are left out and counted.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use proptest::prelude::*;
use sketchnav_recordings::copy::{Copied, Copy, Damaged, Limit, filter, merge, recover, split, window};
use sketchnav_recordings::diff::diff;
use sketchnav_recordings::info::{info, info_of_messages};
use sketchnav_recordings::reader::{Part, RawMessage, Selection};
use sketchnav_recordings::{Recording, rosbag2};

use super::common;

fn begin(path: &Path) -> Copy<BufWriter<File>> {
    Copy::new(BufWriter::new(File::create(path).unwrap())).unwrap()
}

fn story(folder: &Path) -> PathBuf {
    let path = folder.join("story.mcap");
    let mut writer = common::create(&path);
    common::write_beginning(&mut writer);
    for step in 1..=60 {
        common::write_step(&mut writer, step);
        if step % 10 == 0 {
            writer.flush().unwrap();
        }
    }
    writer.finish().unwrap();
    path
}

fn recovered(path: &Path, to: &Path) -> Copied {
    let mut copy = begin(to);
    let copied = recover(path, Damaged::LeaveOut, &mut copy).unwrap();
    copy.finish().unwrap();
    copied
}

fn messages(path: &Path) -> Vec<RawMessage> {
    let recording = Recording::open(path).unwrap();
    let parts = recording.parts().unwrap().map(Result::unwrap);
    parts.filter_map(|part| if let Part::Message(message) = part { Some(message) } else { None }).collect()
}

/// Returns the positions of the chunks.
fn chunks(file: &[u8]) -> Vec<usize> {
    let (mut at, mut chunks) = (8, Vec::new());
    while at + 9 < file.len() - 8 {
        if file[at] == 6 {
            chunks.push(at);
        }
        at += 9 + u64::from_le_bytes(file[at + 1..at + 9].try_into().unwrap()) as usize;
    }
    chunks
}

#[test]
fn recovering_a_complete_file_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (path, copy) = (story(folder.path()), folder.path().join("copy.mcap"));
    let copied = recovered(&path, &copy);
    assert!(copied.was_whole && !copied.has_loss(), "{copied:?}");
    assert_eq!(diff(&path, &copy).unwrap(), None);
    let (mut was, is) = (info(&path).unwrap(), info(&copy).unwrap());
    (was.path, was.bytes) = (is.path.clone(), is.bytes);
    assert_eq!(was, is, "and the metadata agree");
    assert_eq!(is.messages, info_of_messages(&copy).unwrap().messages);
    assert_eq!(Recording::open(&copy).unwrap().run().unwrap(), common::run_config());
}

#[test]
fn a_file_truncated_by_a_kill_is_recovered_up_to_the_cut() {
    let folder = tempfile::tempdir().unwrap();
    let (path, copy) = (story(folder.path()), folder.path().join("copy.mcap"));
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    let known = info(&path).unwrap().messages;
    let copied = recovered(&path, &copy);
    assert!(!copied.was_whole && copied.has_loss() && copied.messages == known, "{copied:?}");
    let info = info(&copy).unwrap();
    assert!(info.clean_end && info.messages == known);
}

/// Regression test: a recorder that is killed usually leaves a file that ends after a complete record. `info` reported such a
/// file as cut off, but a copy of it counted as complete.
#[test]
fn a_file_that_ends_after_a_complete_record_is_truncated_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = story(folder.path());
    let is_cut_off = || Recording::open(&path).unwrap().index().unwrap().is_cut_off();
    assert!(!is_cut_off());
    let whole = std::fs::read(&path).unwrap();
    let third = chunks(&whole)[2];
    for end in [third, third + 20] {
        std::fs::write(&path, &whole[..end]).unwrap();
        assert!(is_cut_off() && !info(&path).unwrap().clean_end, "up to byte {end}");
    }
}

/// Flips one byte of a chunk in the middle, so that its checksum is wrong. All other chunks survive.
#[test]
fn only_the_damaged_chunk_is_lost() {
    let folder = tempfile::tempdir().unwrap();
    let (path, copy) = (story(folder.path()), folder.path().join("copy.mcap"));
    let everything = messages(&path).len() as u64;
    let mut file = std::fs::read(&path).unwrap();
    let third = chunks(&file)[2];
    file[third + 200] ^= 0x10;
    std::fs::write(&path, &file).unwrap();
    let copied = recovered(&path, &copy);
    assert_eq!((copied.lost_chunks, copied.was_whole), (1, true), "{copied:?}");
    assert!(copied.messages > everything / 2 && copied.messages < everything, "{copied:?}");
    assert!(info(&copy).unwrap().missing > 0, "missing messages are counted");
}

/// The length of a chunk in the middle is wrong, and the search finds the next chunk.
#[test]
fn records_after_a_wrong_length_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let (path, copy) = (story(folder.path()), folder.path().join("copy.mcap"));
    let mut file = std::fs::read(&path).unwrap();
    let third = chunks(&file)[2];
    for lie in [u64::MAX, 1 << 20] {
        file[third + 1..third + 9].copy_from_slice(&lie.to_le_bytes());
        std::fs::write(&path, &file).unwrap();
        let copied = recovered(&path, &copy);
        assert!(copied.has_loss() && copied.was_whole, "{copied:?}");
        let scans = messages(&copy).iter().filter(|m| m.topic.name == "/scan").count();
        assert!((40..60).contains(&scans), "{scans} scans");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Whatever is wrong, the recovered file is a complete recording, and everything in it was in the original.
    #[test]
    fn recovered_messages_are_complete_and_from_the_original(
        flips in prop::collection::vec((any::<prop::sample::Index>(), 1..=255_u8), 0..4),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let (path, to) = (story(folder.path()), folder.path().join("copy.mcap"));
        let known: BTreeMap<_, _> =
            messages(&path).into_iter().map(|m| ((m.topic.name.clone(), m.sequence, m.stamp_ns), m.cdr)).collect();
        let mut file = std::fs::read(&path).unwrap();
        for (at, by) in flips {
            let at = at.index(file.len());
            file[at] ^= by;
        }
        if let Some(cut) = cut {
            file.truncate(cut.index(file.len() + 1));
        }
        std::fs::write(&path, &file).unwrap();
        let mut copy = begin(&to);
        let copied = recover(&path, Damaged::LeaveOut, &mut copy);
        copy.finish().unwrap();
        if copied.is_ok() {
            prop_assert!(info_of_messages(&to).unwrap().clean_end);
            for message in messages(&to) {
                let key = (message.topic.name.clone(), message.sequence, message.stamp_ns);
                prop_assert_eq!(known.get(&key), Some(&message.cdr));
            }
        }
    }
}

#[test]
fn a_filter_keeps_the_selected_messages() {
    let folder = tempfile::tempdir().unwrap();
    let (path, to) = (story(folder.path()), folder.path().join("part.mcap"));
    let mut copy = begin(&to);
    let selection = Selection::of_topics(["/scan", "/odometry"]).between(1_000_000_000..2_000_000_000);
    filter(&Recording::open(&path).unwrap(), &selection, &mut copy).unwrap();
    copy.finish().unwrap();
    let kept = messages(&to);
    assert_eq!(kept.len(), 20);
    assert!(kept.iter().all(|m| (10..20).contains(&m.sequence)));
    assert_eq!(info(&to).unwrap().run["mission"], "two rooms");
}

/// Merging the two halves of a recording restores the recording.
#[test]
fn halves_become_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = story(folder.path());
    let halves = [0..3_000_000_000, 3_000_000_000..u64::MAX].map(|times| {
        let to = folder.path().join(format!("{}.mcap", times.start));
        let mut copy = begin(&to);
        let recording = Recording::open(&path).unwrap();
        filter(&recording, &Selection::default().between(times), &mut copy).unwrap();
        copy.finish().unwrap();
        Recording::open(&to).unwrap()
    });
    let to = folder.path().join("both.mcap");
    let mut copy = begin(&to);
    merge(&halves, &mut copy).unwrap();
    copy.finish().unwrap();
    assert_eq!(diff(&path, &to).unwrap(), None);
    assert_eq!(messages(&to).len(), messages(&path).len());
}

/// Regression test: a filter that started 2 s into the recording reported everything before as missing. So did every part except
/// the first and, at any time, `/health`, whose numbers mean nothing.
#[test]
fn messages_left_out_on_purpose_do_not_count_as_missing() {
    let folder = tempfile::tempdir().unwrap();
    let (path, to) = (story(folder.path()), folder.path().join("part.mcap"));
    for (times, missing) in [(2_000_000_000..4_000_000_000, 0), (0..u64::MAX, 0)] {
        let mut copy = begin(&to);
        filter(&Recording::open(&path).unwrap(), &Selection::default().between(times), &mut copy).unwrap();
        copy.finish().unwrap();
        let info = info(&to).unwrap();
        assert_eq!((info.missing, info.topics.iter().all(|topic| topic.gaps.is_empty())), (missing, true));
    }
    // In a part of a part, the messages that are not in the first part were left out on purpose.
    let mut copy = begin(&to);
    let late = Selection::default().between(3_000_000_000..u64::MAX);
    filter(&Recording::open(&path).unwrap(), &late, &mut copy).unwrap();
    copy.finish().unwrap();
    let recording = Recording::open(&to).unwrap();
    let name = |number: usize| folder.path().join(format!("late_{number}.mcap"));
    let open = |number: usize| Ok(BufWriter::new(File::create(name(number)).unwrap()));
    let parts = split(&recording, Some(Limit::Time(1_000_000_000)), open).unwrap();
    for number in 0..parts.len() {
        assert_eq!(info(&name(number)).unwrap().missing, 0, "part {number}");
    }
}

/// Messages that are really missing still count as such, even between the end of one part and the beginning of the next.
#[test]
fn parts_report_what_the_recording_lacks() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("gap.mcap");
    let mut writer = common::create(&path);
    common::write_beginning(&mut writer);
    (3..=40).filter(|step| !(19..=22).contains(step)).for_each(|step| common::write_step(&mut writer, step));
    writer.finish().unwrap();
    let recording = Recording::open(&path).unwrap();
    let name = |number: usize| folder.path().join(format!("part_{number}.mcap"));
    let open = |number: usize| Ok(BufWriter::new(File::create(name(number)).unwrap()));
    let parts = split(&recording, Some(Limit::Time(2_100_000_000)), open).unwrap();
    let missing = (0..parts.len()).map(|number| info(&name(number)).unwrap().missing);
    assert_eq!(missing.sum::<u64>(), info(&path).unwrap().missing);
}

/// The drawing is latched and therefore in every part. Regression test: with a limit below its size, each message became a
/// separate part.
#[test]
fn a_part_keeps_its_limit_despite_latched_messages() {
    let folder = tempfile::tempdir().unwrap();
    let path = story(folder.path());
    let recording = Recording::open(&path).unwrap();
    let name = |number: usize| folder.path().join(format!("part_{number}.mcap"));
    let open = |number: usize| Ok(BufWriter::new(File::create(name(number)).unwrap()));
    let all: usize = messages(&path).iter().map(|message| message.cdr.len()).sum();
    let limit = 1000;
    let parts = split(&recording, Some(Limit::Bytes(limit)), open).unwrap();
    assert!(parts.len() <= 1 + 2 * all / limit as usize, "{} parts of {all} bytes", parts.len());
    for number in 1..parts.len() {
        let latched = ["/sketch", "/route", "/tf_static", "/mission"];
        let own = messages(&name(number)).into_iter().filter(|m| !latched.contains(&m.topic.name.as_str()));
        assert!(own.map(|message| message.cdr.len() as u64).sum::<u64>() <= limit, "part {number}");
    }
}

/// Regression test: if two runs had descriptions of different lengths, both descriptions were written and the last one was
/// used.
#[test]
fn the_first_of_several_descriptions_counts() {
    let folder = tempfile::tempdir().unwrap();
    for seeds in [[9, 10], [1, 2]] {
        let runs = seeds.map(|seed| {
            let path = folder.path().join(format!("{seed}.mcap"));
            let run = sketchnav_schemas::run::RunConfig { seed, ..common::run_config() };
            let mut writer = common::create_run(&path, &run);
            common::write_step(&mut writer, seed);
            writer.finish().unwrap();
            Recording::open(&path).unwrap()
        });
        let to = folder.path().join("both.mcap");
        let mut copy = begin(&to);
        merge(&runs, &mut copy).unwrap();
        copy.finish().unwrap();
        let both = Recording::open(&to).unwrap();
        assert_eq!(both.run().unwrap().seed, seeds[0]);
        assert_eq!(both.fact("sketchnav", "seed"), Some(seeds[0].to_string().as_str()));
        assert_eq!(info(&to).unwrap().attachments.len(), both.attachments().len());
    }
}

/// Other software puts attachments and metadata after the messages, and some of it writes no chunks.
#[test]
fn the_description_may_be_at_the_end_of_a_recording() {
    let folder = tempfile::tempdir().unwrap();
    let (path, to) = (folder.path().join("other.mcap"), folder.path().join("copy.mcap"));
    for use_chunks in [true, false] {
        let options = mcap::WriteOptions::new().use_chunks(use_chunks);
        let mut other = options.create(File::create(&path).unwrap()).unwrap();
        let id = other.add_channel(0, "/text", "json", &BTreeMap::new()).unwrap();
        for sequence in 1..=9 {
            let (log_time, publish_time) = (u64::from(sequence), u64::from(sequence));
            let header = mcap::records::MessageHeader { channel_id: id, sequence, log_time, publish_time };
            other.write_to_known_channel(&header, b"{}").unwrap();
        }
        let (name, media_type) = ("a.txt".to_owned(), "text/plain".to_owned());
        let data = b"text".as_slice().into();
        other.attach(&mcap::Attachment { log_time: 0, create_time: 0, name, media_type, data }).unwrap();
        let metadata = BTreeMap::from([("key".to_owned(), "value".to_owned())]);
        other.write_metadata(&mcap::records::Metadata { name: "facts".to_owned(), metadata }).unwrap();
        other.finish().unwrap();
        drop(other);
        let mut copy = begin(&to);
        let selection = Selection::default().between(3..7);
        filter(&Recording::open(&path).unwrap(), &selection, &mut copy).unwrap();
        copy.finish().unwrap();
        let recording = Recording::open(&to).unwrap();
        assert_eq!(messages(&to).len(), 4, "in chunks: {use_chunks}");
        assert_eq!(recording.attachments()["a.txt"].data, b"text");
        assert_eq!(recording.fact("facts", "key"), Some("value"));
    }
}

/// Rewrites the messages of a recording to another file, followed by the description.
fn rewritten(path: &Path, to: &Path, form: mcap::WriteOptions) {
    let mut other = form.create(File::create(to).unwrap()).unwrap();
    for RawMessage { topic, sequence, stamp_ns, publish_ns, cdr } in messages(path) {
        let schema = &topic.schema;
        let schema = other.add_schema(&schema.name, &schema.encoding, &schema.data).unwrap();
        let id = other.add_channel(schema, &topic.name, &topic.encoding, &topic.metadata).unwrap();
        let (log_time, publish_time) = (stamp_ns, publish_ns);
        let header = mcap::records::MessageHeader { channel_id: id, sequence, log_time, publish_time };
        other.write_to_known_channel(&header, &cdr).unwrap();
    }
    let was = Recording::open(path).unwrap();
    for file in was.attachments().values() {
        let (name, media_type) = (file.name.clone(), file.media_type.clone());
        let data = file.data.as_slice().into();
        other.attach(&mcap::Attachment { log_time: 0, create_time: 0, name, media_type, data }).unwrap();
    }
    for (name, metadata) in was.metadata() {
        let (name, metadata) = (name.clone(), metadata.clone());
        other.write_metadata(&mcap::records::Metadata { name, metadata }).unwrap();
    }
    other.finish().unwrap();
}

/// Regression test: another tool had rewritten the recording of a run with its attachments at the end, where many tools put
/// them. It was treated as a recording without run.json, which neither `rerun` nor `replay` accepts, and so was its recovered
/// copy.
#[test]
fn the_run_is_found_wherever_another_tool_wrote_it() {
    let folder = tempfile::tempdir().unwrap();
    let (path, to) = (story(folder.path()), folder.path().join("other.mcap"));
    let was = Recording::open(&path).unwrap();
    let form = mcap::WriteOptions::new;
    let forms = [
        form(),
        form().use_chunks(false),
        // Files in these forms do not record where the attachments are.
        form().emit_attachment_indexes(false).emit_metadata_indexes(false),
        form().emit_summary_records(false),
    ];
    for (number, form) in forms.into_iter().enumerate() {
        rewritten(&path, &to, form);
        let copy = folder.path().join("copy.mcap");
        recovered(&to, &copy);
        for path in [&to, &copy] {
            let is = Recording::open(path).unwrap();
            assert_eq!(is.run().unwrap(), was.run().unwrap(), "form {number}");
            assert_eq!(is.attachments(), was.attachments(), "form {number}");
            assert_eq!(is.fact("sketchnav", "seed"), Some("42"), "form {number}");
        }
    }
}

/// Each kind of damage is counted as such. An attachment is not a chunk.
#[test]
fn a_damaged_attachment_counts_as_lost_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let (path, copy) = (story(folder.path()), folder.path().join("copy.mcap"));
    let everything = messages(&path).len() as u64;
    let mut file = std::fs::read(&path).unwrap();
    let at = file.windows(8).position(|bytes| bytes == b"run.json").unwrap();
    file[at + 100] ^= 1;
    std::fs::write(&path, &file).unwrap();
    let copied = recovered(&path, &copy);
    assert_eq!(copied.lost_chunks, 0, "{copied:?}");
    assert!(copied.lost_bytes > 100 && copied.messages == everything, "{copied:?}");
}

#[test]
fn each_part_begins_with_the_latched_messages() {
    let folder = tempfile::tempdir().unwrap();
    let path = story(folder.path());
    let recording = Recording::open(&path).unwrap();
    let name = |number: usize| folder.path().join(format!("part_{number}.mcap"));
    let open = |number: usize| Ok(BufWriter::new(File::create(name(number)).unwrap()));
    let parts = split(&recording, Some(Limit::Time(2_000_000_000)), open).unwrap();
    assert_eq!(parts.len(), 4, "{parts:?}");
    for (number, part) in parts.iter().enumerate() {
        assert_eq!((part.messages["/sketch"], part.messages["/tf_static"]), (1, 1), "part {number}");
        let total: u64 = part.messages.values().sum();
        assert_eq!(info(&name(number)).unwrap().messages, total);
    }
    let scans: u64 = parts.iter().map(|part| part.messages.get("/scan").copied().unwrap_or(0)).sum();
    assert_eq!(scans, 60);
    let files: Vec<_> = (0..).map(|n| format!("part_{n}.mcap")).zip(parts).collect();
    let yaml = rosbag2::metadata_yaml(&files, &recording.topics().unwrap());
    assert!(
        yaml.contains("version: 9") && yaml.contains("- part_3.mcap") && yaml.contains("name: /scan"),
        "{yaml}"
    );
}

/// A restarted recorder begins a little before the end of the previous part. Messages in both parts appear once, even health
/// messages, whose numbers mean nothing.
#[test]
fn messages_in_two_parts_are_joined_once() {
    let folder = tempfile::tempdir().unwrap();
    let parts = [(1, 20), (15, 40)].map(|(first, last)| {
        let path = folder.path().join(format!("{first}.mcap"));
        let mut writer = common::create(&path);
        common::write_beginning(&mut writer);
        (first..=last).for_each(|step| common::write_step(&mut writer, step));
        writer.finish().unwrap();
        path
    });
    let to = folder.path().join("joined.mcap");
    let sink = BufWriter::new(File::create(&to).unwrap());
    let joined = sketchnav_recordings::join(&parts, &common::run_config(), sink).unwrap();
    joined.finish().unwrap();
    let counts = common::counts(&to);
    assert_eq!([counts["/scan"], counts["/health"], counts["/sketch"]], [40, 40, 1]);
    assert_eq!(info(&to).unwrap().missing, 0);
}

/// If a recorder was killed and restarted, the recording so far is in two files.
#[test]
fn a_window_of_a_split_recording_begins_with_the_latched_messages() {
    let folder = tempfile::tempdir().unwrap();
    let whole = Recording::open(&story(folder.path())).unwrap();
    let (first_ns, last_ns) = whole.index().unwrap().span_ns().unwrap();
    let middle_ns = first_ns.midpoint(last_ns);
    let start_ns = first_ns.midpoint(middle_ns);
    let halves = [("a", 0..middle_ns), ("b", middle_ns..u64::MAX)].map(|(name, times_ns)| {
        let path = folder.path().join(name);
        let mut copy = begin(&path);
        filter(&whole, &Selection::default().between(times_ns), &mut copy).unwrap();
        copy.finish().unwrap();
        Recording::open(&path).unwrap()
    });
    let path = folder.path().join("window.mcap");
    let mut copy = begin(&path);
    window(&halves, &Selection::default().between(start_ns..u64::MAX), &mut copy).unwrap();
    copy.finish().unwrap();

    let latched = whole.latched_before(start_ns).unwrap();
    assert!(!latched.is_empty());
    let rest = whole.timeline(Selection::default().between(start_ns..u64::MAX)).unwrap().map(Result::unwrap);
    let expected =
        latched.into_iter().map(|message| RawMessage { stamp_ns: start_ns, ..message }).chain(rest);
    let key =
        |message: RawMessage| (message.topic.name.clone(), message.sequence, message.stamp_ns, message.cdr);
    let found: Vec<_> = messages(&path).into_iter().map(key).collect();
    assert_eq!(found, expected.map(key).collect::<Vec<_>>());
    assert_eq!(info(&path).unwrap().missing, 0);
    assert_eq!(Recording::open(&path).unwrap().run().unwrap(), common::run_config());
}

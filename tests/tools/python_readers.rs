//! Third-party tools decode every message in the recording of a real run using only the schemas inside the file:
//! rosbags and mcap-ros2-support. The test needs a Python with both, which is named by `SKETCHNAV_PYTHON` or found as
//! `python3`. Without it, the test is skipped.

use std::collections::BTreeMap;
use std::process::Command;

use support::{Ended, Place, repository, room};

#[test]
fn python_decodes_every_message_of_a_run() {
    let modules = "rosbags, mcap_ros2";
    let Some(python) = needs::python("rosbags", "SKETCHNAV_PYTHON", modules) else { return };
    let place = Place::new();
    room::write(place.files());
    let (report, _) = place.mission("run room.toml", "room");
    let recording = report["recording"].as_str().unwrap();
    let script = repository().join("tests/decode_recording.py");
    let decoded: Ended = Command::new(python).arg(script).arg(recording).output().unwrap().into();
    assert_eq!(decoded.code, Some(0), "{decoded}");
    let pair = |line: &str| line.split_once(' ').map(|(topic, count)| (topic.into(), count.parse().unwrap()));
    let by_python: BTreeMap<String, u64> = decoded.out.lines().filter_map(pair).collect();
    assert_eq!(by_python, topics_with_messages(&place, recording));
}

fn topics_with_messages(place: &Place, recording: &str) -> BTreeMap<String, u64> {
    let info = place.run(&format!("info {recording} --json")).json();
    let topics = info["topics"].as_array().unwrap();
    let pair = |topic: &serde_json::Value| {
        (topic["topic"].as_str().unwrap().to_owned(), topic["messages"].as_u64().unwrap())
    };
    topics.iter().map(pair).filter(|(_, messages)| *messages > 0).collect()
}

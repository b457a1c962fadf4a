//! The `metadata.yaml` of a rosbag2 folder, version 9: what `ros2 bag` and rosbags read before the files.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::sync::Arc;

use crate::copy::PartFacts;
use crate::directory::Topic;

/// The text of `metadata.yaml` for these files, each with what is in it; `topics` are all topics.
pub fn metadata_yaml(files: &[(String, PartFacts)], topics: &[Arc<Topic>]) -> String {
    let first = files.iter().map(|(_, part)| part.first_ns).min().unwrap_or(0);
    let last = files.iter().map(|(_, part)| part.last_ns).max().unwrap_or(0);
    let mut counts: BTreeMap<&str, u64> = BTreeMap::new();
    for (topic, count) in files.iter().flat_map(|(_, part)| &part.messages) {
        *counts.entry(topic).or_default() += count;
    }
    let mut text = String::new();
    // Writing to a text cannot fail.
    let _ = write!(
        text,
        "rosbag2_bagfile_information:\n  version: 9\n  storage_identifier: mcap\n  duration:\n    nanoseconds: {}\n  starting_time:\n    nanoseconds_since_epoch: {first}\n  message_count: {}\n  topics_with_message_count:\n",
        last - first,
        counts.values().sum::<u64>(),
    );
    for topic in topics {
        let _ = topic_yaml(&mut text, topic, counts.get(topic.name.as_str()).copied().unwrap_or(0));
    }
    let _ = writeln!(text, "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:");
    for (name, _) in files {
        let _ = writeln!(text, "    - {name}");
    }
    let _ = writeln!(text, "  files:");
    for (name, part) in files {
        let _ = write!(
            text,
            "    - path: {name}\n      starting_time:\n        nanoseconds_since_epoch: {}\n      duration:\n        nanoseconds: {}\n      message_count: {}\n",
            part.first_ns,
            part.last_ns - part.first_ns,
            part.messages.values().sum::<u64>(),
        );
    }
    let _ = writeln!(text, "  custom_data: ~\n  ros_distro: jazzy");
    text
}

/// The profile is word for word the one inside the files: readers compare them.
fn topic_yaml(text: &mut String, topic: &Topic, count: u64) -> std::fmt::Result {
    let profile = topic.metadata.get("offered_qos_profiles").map_or("", String::as_str);
    let Topic { name, ros2_type, encoding, .. } = topic;
    write!(
        text,
        "    - topic_metadata:\n        name: {name}\n        type: {ros2_type}\n        serialization_format: {encoding}\n        offered_qos_profiles:"
    )?;
    if profile.trim().is_empty() {
        writeln!(text, " []")?;
    } else {
        writeln!(text)?;
        profile.lines().try_for_each(|line| writeln!(text, "          {line}"))?;
    }
    writeln!(text, "        type_description_hash: \"\"\n      message_count: {count}")
}

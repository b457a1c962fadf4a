//! Third-party tools (rosbags and mcap-ros2-support) decode every message type from the file alone. The test needs a Python
//! with both, which is named by `SKETCHNAV_PYTHON` or found as `python3`, and is skipped without it.

use std::path::Path;
use std::process::Command;

use super::common;

#[test]
fn python_decodes_every_message_type() {
    let modules = "rosbags, mcap_ros2";
    let Some(python) = needs::python("rosbags", "SKETCHNAV_PYTHON", modules) else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("samples.mcap");
    common::record_samples(&path, 3, 4);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/decode_recording.py");
    let output = Command::new(python).arg(script).arg(&path).output().unwrap();
    let (told, errors) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{told}{errors}");
    let expected = common::counts(&path).into_iter().map(|(topic, count)| format!("{topic} {count}\n"));
    assert_eq!(told, expected.collect::<String>());
}

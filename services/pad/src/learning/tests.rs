//! Tests of a pad that learns from a recording while it is being written. The navigator notes what it sees instead of learning.

use std::path::Path;
use std::sync::Arc;

use sketchnav_stage::StageError;
use sketchnav_stage::drawn::Frame;
use sketchnav_stage::lookout::Walls;

use super::*;

/// Notes the channel and the number of each message.
#[derive(Debug, Default)]
struct Notes(String);

impl Learning for Notes {
    fn see(&mut self, spec: &ChannelSpec, message: &[u8], _: &[u8]) {
        let seq = u64::from_ne_bytes(message[..8].try_into().unwrap());
        self.0.push_str(&format!("{} {seq}\n", spec.name));
    }

    fn learned(&self) -> Result<(Vec<u8>, Lesson), StageError> {
        let seen = Walls { size_px: [1, 1], cells: vec![0] };
        Ok((self.0.clone().into_bytes(), Lesson { seen, frame: Arc::new(Still), corrected: Vec::new() }))
    }
}

#[derive(Debug)]
struct Still;

impl Frame for Still {
    fn to_drawing(&self, sketch_px: [f64; 2]) -> [f64; 2] {
        sketch_px
    }

    fn to_sketch(&self, image_px: [f64; 2]) -> [f64; 2] {
        image_px
    }
}

const NOTES: Lessons =
    Lessons { begin: |_, _| Ok(Box::new(Notes::default())), show: |_, _, _| Err("not shown".into()) };

/// Returns what is seen in a whole recording, up to its last status.
fn whole(path: &Path) -> String {
    let recording = Recording::open(path).unwrap();
    let (mut notes, mut upto) = (Notes::default(), 0);
    let kind = recording.run().unwrap().mission.navigator_kind().to_owned();
    replay(&recording, &kind, |spec, message| {
        notes.see(spec, message.bytes(), message.cells());
        if STATUS.message(spec, message.bytes()).is_some() {
            upto = notes.0.len();
        }
    })
    .unwrap();
    notes.0.truncate(upto);
    notes.0
}

/// A recording of a whole run, as the recordings crate keeps it.
fn story() -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../recordings/golden/story.mcap")).unwrap()
}

fn follower(path: &Path) -> Follower {
    Follower { recording: Some(path.to_str().unwrap().to_owned()), lessons: NOTES, begun: None }
}

/// While a recording grows, what was learned is always what a reader of the whole file so far would have learned.
#[test]
fn a_growing_recording_teaches_what_the_whole_one_does() {
    let (folder, story) = (tempfile::tempdir().unwrap(), story());
    let path = folder.path().join("run.mcap");
    let (mut follower, mut lengths) = (follower(&path), Vec::new());
    for part in 1..=24 {
        std::fs::write(&path, &story[..story.len() * part / 24]).unwrap();
        // The first pieces do not even contain the mission.
        let Ok(learned) = follower.look() else { continue };
        assert!(learned.file == whole(&path).into_bytes(), "after {part} of 24 parts");
        lengths.push(learned.file.len());
    }
    assert!(lengths.is_sorted() && lengths.last() > lengths.first(), "{lengths:?}");
    assert_eq!(follower.look().unwrap().file.len(), *lengths.last().unwrap(), "nothing is seen twice");
}

/// A message that is recorded late belongs between others that were seen before. Then everything is learned again.
#[test]
fn a_recording_that_does_not_continue_is_learned_from_its_beginning() {
    let (folder, story) = (tempfile::tempdir().unwrap(), story());
    let path = folder.path().join("run.mcap");
    std::fs::write(&path, &story).unwrap();
    let mut follower = follower(&path);
    let learned = follower.look().unwrap();
    let begun = follower.begun.as_mut().unwrap();
    begun.taken -= 1;
    assert_eq!(follower.look().unwrap().file, learned.file);
}

#[test]
fn a_run_without_a_recording_teaches_nothing() {
    let mut follower = Follower { recording: None, lessons: NOTES, begun: None };
    let error = follower.look().unwrap_err().to_string();
    assert_eq!(error, "expected a run that is recorded, found one that is not");
}

//! Replays what the planner received and sent during a drive, together with people's drawings.

use sketchnav_schemas::channels::{self, ChannelSpec, DRAWING};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::erased::Owned;

use crate::error::RecordingError;
use crate::reader::{Recording, Selection};
use crate::writer::topic_name;

/// Calls `see` with every drawing and with every valid message that the planner received or sent, in order of time. Messages of
/// the same instant are in the order of a step. `kind` is the kind of navigator. Messages that processes rejected when they
/// arrived are left out.
///
/// # Errors
/// [`RecordingError`] if the file cannot be read.
pub fn replay(
    recording: &Recording,
    kind: &str,
    mut see: impl FnMut(&'static ChannelSpec, &Owned),
) -> Result<(), RecordingError> {
    let planner = Process::Planner;
    let heard = channels::read_by(planner, kind).chain(channels::written_by(planner, kind));
    let topics = heard.chain([DRAWING.spec]).map(|spec| topic_name(spec.name));
    for message in recording.timeline(Selection::of_topics(topics))? {
        let message = message?;
        let Some(spec) = channels::of_topic(&message.topic.name) else { continue };
        match message.decode(spec) {
            Err(error) if error.is_one_message() => {}
            Err(error) => return Err(error),
            Ok(decoded) if spec.message.check(decoded.bytes()).is_err() => {}
            Ok(decoded) => see(spec, &decoded),
        }
    }
    Ok(())
}

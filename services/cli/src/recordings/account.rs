//! A navigator's own account of a recorded run.

use sketchnav_recordings::Recording;
use sketchnav_recordings::reader::Selection;
use sketchnav_recordings::writer::topic_name;
use sketchnav_schemas::channels;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::account::Summary;
use sketchnav_stage::{Access, Incoming};

/// Passes the recorded messages of a run to its navigator's account and returns the summary. The summary is
/// empty if this program does not know the navigator.
///
/// # Errors
/// If the recording cannot be read, or the account asks for another navigator's channel.
pub fn of(recording: &Recording, run: &RunConfig) -> anyhow::Result<Summary> {
    let mut summary = Summary::default();
    let kind = run.mission.navigator_kind();
    let review = sketchnav_navigators::of(&run.mission).ok().and_then(|navigator| navigator.account);
    let Some(review) = review else { return Ok(summary) };
    let (mut account, access) = (review(run), Access::new(Process::Observer, kind));
    let is_relevant =
        |spec: &&channels::ChannelSpec| spec.kind.is_some() || spec.role == channels::Role::Status;
    let topics = channels::of_kind(kind).filter(is_relevant).map(|spec| topic_name(spec.name));
    for message in recording.select(Selection::of_topics(topics))? {
        let message = message?;
        let Some(spec) = channels::of_topic(&message.topic.name) else { continue };
        // Messages that cannot be decoded are skipped, since judging the recording counts them.
        let Ok(said) = message.decode(spec) else { continue };
        account.receive(&Incoming::new(&access, spec, said.bytes(), said.cells()))?;
    }
    account.summarize(&mut summary);
    Ok(summary)
}

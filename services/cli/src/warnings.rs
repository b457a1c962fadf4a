//! Warnings of `run` about the plan that the navigator makes before the start.

use std::time::Duration;

use sketchnav_recordings::Recording;
use sketchnav_recordings::reader::Selection;
use sketchnav_recordings::writer::topic_name;
use sketchnav_schemas::run::RunConfig;
use sketchnav_supervisor::{Error as SystemError, Progress, Supervisor};

use crate::output::say;

/// How often to check whether the navigator has planned.
const LOOK: Duration = Duration::from_millis(20);

/// Waits until the navigator of a run has made its plan, prints its doubts about the plan unless `quiet`, and adds them
/// to `warnings`. If the run ends in the meantime, returns how it ended.
///
/// # Errors
/// Those of [`Supervisor::poll`].
pub fn receive(
    warnings: &mut Vec<String>,
    supervisor: &mut Supervisor,
    run: &RunConfig,
    quiet: bool,
) -> Result<Option<Progress>, SystemError> {
    let planned = sketchnav_navigators::of(&run.mission).ok().and_then(|navigator| navigator.planned);
    let (Some(planned), Some(node)) = (planned, supervisor.node()) else { return Ok(None) };
    let mut plans = node.raw_reader(planned.on)?;
    loop {
        if let Some(plan) = plans.receive_valid()? {
            let doubts = (planned.doubts)(run, plan.message());
            doubts.iter().filter(|_| !quiet).for_each(|doubt| say!("warning: {doubt}"));
            warnings.extend(doubts);
            return Ok(None);
        }
        match supervisor.poll(LOOK)? {
            Progress::Running => {}
            ended => return Ok(Some(ended)),
        }
    }
}

/// Returns the doubts that the navigator of a recorded run had about its plan.
///
/// # Errors
/// If the recording cannot be read.
pub fn of_recording(recording: &Recording, run: &RunConfig) -> anyhow::Result<Vec<String>> {
    let planned = sketchnav_navigators::of(&run.mission).ok().and_then(|navigator| navigator.planned);
    let Some(planned) = planned else { return Ok(Vec::new()) };
    let mut doubts = Vec::new();
    for plan in recording.select(Selection::of_topics([topic_name(planned.on.name)]))? {
        let plan = plan?;
        let plan = planned.on.message.decode(&plan.cdr, plan.sequence.into())?;
        doubts.extend((planned.doubts)(run, plan.bytes()));
    }
    Ok(doubts)
}

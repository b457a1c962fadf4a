//! Prints the plan that the navigator makes before the start, and warns about anything doubtful in it.

use std::time::Duration;

use sketchnav_recordings::Recording;
use sketchnav_recordings::reader::Selection;
use sketchnav_recordings::writer::topic_name;
use sketchnav_schemas::run::RunConfig;
use sketchnav_supervisor::{Error as SystemError, Progress, Supervisor};

use crate::output::say;

/// Interval at which to check whether the navigator has planned.
const LOOK: Duration = Duration::from_millis(20);

/// Maximum number of lines of a plan that are printed.
const MOST_LINES: usize = 60;

/// Information about the plan of a run.
#[derive(Debug, Default)]
pub struct Received {
    /// The navigator's doubts about the plan.
    pub doubts: Vec<String>,
    /// The reason why the robot should not start by the plan unless a person insists.
    pub objection: Option<String>,
    /// How the run ended, if it ended before there was a plan.
    pub ended: Option<Progress>,
}

/// Waits until the navigator of a run has made its plan, and prints the plan and the doubts about it unless `quiet`.
///
/// # Errors
/// Those of [`Supervisor::poll`].
pub fn receive(supervisor: &mut Supervisor, run: &RunConfig, quiet: bool) -> Result<Received, SystemError> {
    let planned = sketchnav_navigators::of(&run.mission).ok().and_then(|navigator| navigator.planned);
    let (Some(planned), Some(node)) = (planned, supervisor.node()) else { return Ok(Received::default()) };
    let (mut texts, mut plans) = (node.raw_reader(planned.text)?, node.raw_reader(planned.on)?);
    loop {
        if let Some(plan) = plans.receive_valid()? {
            let doubts = (planned.doubts)(run, plan.message());
            let objection = (planned.objection)(run, plan.message());
            if !quiet {
                if let Some(text) = texts.receive_valid()? {
                    print(&String::from_utf8_lossy(text.cells()));
                }
                doubts.iter().for_each(|doubt| say!("warning: {doubt}"));
            }
            return Ok(Received { doubts, objection, ended: None });
        }
        match supervisor.poll(LOOK)? {
            Progress::Running => {}
            ended => return Ok(Received { ended: Some(ended), ..Received::default() }),
        }
    }
}

/// Prints a plan to standard error. Of a long one, only the comments are printed, which describe what to expect.
fn print(text: &str) {
    let is_short = text.lines().count() <= MOST_LINES;
    text.lines().filter(|line| is_short || line.starts_with('#')).for_each(|line| say!("{line}"));
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

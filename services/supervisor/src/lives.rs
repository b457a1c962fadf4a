//! Looks after a process across restarts. It restarts the process when it dies, kills it when it is unresponsive for too long,
//! and reports both on `faults`.

use std::time::Duration;

use nix::sys::signal::Signal;
use sketchnav_runtime::Node;
use sketchnav_schemas::codes::FaultKind;
use sketchnav_schemas::message::Text;

use crate::child::Child;
use crate::error::is_bad_input;
use crate::faults::Faults;
use crate::watchdog::Alarm;
use crate::{Death, Error, Result};

/// Maximum time spent on clearing a killed process's remains in shared memory.
pub(crate) const CLEARING: Duration = Duration::from_millis(500);

/// Looks after a process that can resume. If it has just died and the system survives that, returns its death.
pub(crate) fn look_after(child: &mut Child, node: &Node, faults: &mut Faults) -> Result<Option<Death>> {
    start_if_due(child, node, faults)?;
    if let Some(took) = child.recovery(node.progress(child.process)) {
        faults.report(FaultKind::Recovered, child.process, child.pid(), |fault| {
            fault.restarts = child.restarts().total() as u32;
            fault.duration_ns = took.as_nanos() as u64;
        })?;
    }
    let death = revive(child, node, faults)?;
    if child.resumes() && child.ended()?.is_none() {
        watch(child, node, faults)?;
    }
    Ok(death)
}

/// Restarts a process if that is due.
pub(crate) fn start_if_due(child: &mut Child, node: &Node, faults: &mut Faults) -> Result<()> {
    if !child.start_if_due(node.signs_of_life(child.process))? {
        return Ok(());
    }
    faults.report(FaultKind::Restarted, child.process, child.pid(), |fault| {
        let restarts = child.restarts();
        (fault.attempt, fault.restarts) = (restarts.attempt(), restarts.total() as u32);
        fault.duration_ns = restarts.pause().as_nanos() as u64;
    })
}

/// Schedules the restart of a process that has died, now or after a pause.
fn revive(child: &mut Child, node: &Node, faults: &mut Faults) -> Result<Option<Death>> {
    let Some((status, _)) = child.ended()?.filter(|_| child.resumes() && !child.is_due()) else {
        return Ok(None);
    };
    if is_bad_input(status) {
        return Ok(None);
    }
    let death = child.death(status);
    faults.died(&death)?;
    // Only now can the successor take over the process's slots as a writer and a reader.
    node.clear_dead(CLEARING);
    if !child.schedule(status, node.progress(child.process)) {
        let words = if child.hung() { "hung repeatedly" } else { "died each time before it made progress" };
        let error = Error::GivenUp(death, child.restarts().total());
        faults.report(FaultKind::GivenUp, child.process, child.pid(), |fault| {
            fault.restarts = child.restarts().total() as u32;
            fault.words = Text::new(words);
        })?;
        return Err(error);
    }
    start_if_due(child, node, faults)?;
    Ok(Some(death))
}

fn watch(child: &mut Child, node: &Node, faults: &mut Faults) -> Result<()> {
    let (process, pid) = (child.process, child.pid());
    match child.watch(node.signs_of_life(process)) {
        Alarm::Nothing => Ok(()),
        Alarm::Missed(for_) => faults.unresponsive(process, pid, for_, "no sign of life"),
        Alarm::Kill(for_) => {
            faults.unresponsive(process, pid, for_, "no sign of life for too long: killed")?;
            child.signal(Signal::SIGKILL)
        }
        Alarm::Over(for_) => faults.report(FaultKind::Responsive, process, pid, |fault| {
            fault.duration_ns = for_.as_nanos() as u64;
        }),
    }
}

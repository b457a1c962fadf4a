//! Access control: which channels a stage may read and write, according to the table of channels.

use sketchnav_schemas::channels::{self, ChannelSpec, NAVIGATORS, Role};
use sketchnav_schemas::codes::Process;

/// The channels that a process may read and write in a run of one kind of navigator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Access {
    process: Process,
    kind: String,
}

/// Why a stage may not use a channel: it receives from one that never delivers to it, or sends on one that it does not write.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Denied {
    /// The process does not read the channel.
    #[error(
        "channel {channel:?}: expected one that the {process} of navigator {kind:?} reads, found {found}"
    )]
    Read {
        /// Name of the channel.
        channel: &'static str,
        /// Process that hosts the stage.
        process: Process,
        /// Kind of navigator of the run.
        kind: String,
        /// Navigators that have the channel, and the processes that read it.
        found: String,
    },
    /// The process does not write the channel.
    #[error("channel {channel:?}: expected one that this process writes, found {found}")]
    Write {
        /// Name of the channel.
        channel: &'static str,
        /// Navigators that have the channel, and the process that writes it.
        found: String,
    },
    /// The messages of the channel do not belong to an instant.
    #[error("channel {channel:?}: expected a sensor, the tick or the situation, found the role {role:?}")]
    Step {
        /// Name of the channel.
        channel: &'static str,
        /// Role of the channel.
        role: Role,
    },
    /// The messages of the channel belong to an instant.
    #[error("channel {channel:?}: expected an instruction or a request, found the role {role:?}")]
    Hear {
        /// Name of the channel.
        channel: &'static str,
        /// Role of the channel.
        role: Role,
    },
}

impl Access {
    /// Creates the access rights of `process` in a run with a navigator of kind `kind`.
    pub fn new(process: Process, kind: &str) -> Self {
        Self { process, kind: kind.to_owned() }
    }

    /// Returns the process and the kind of navigator.
    pub(crate) fn host(&self) -> (Process, &str) {
        (self.process, &self.kind)
    }

    /// Checks that messages of a channel can belong to an instant of this process.
    pub(crate) fn to_step(&self, spec: &ChannelSpec) -> Result<(), Denied> {
        self.to_read(spec)?;
        match spec.role {
            Role::Sensor | Role::Tick | Role::Situation => Ok(()),
            role => Err(Denied::Step { channel: spec.name, role }),
        }
    }

    /// Checks that this process may receive messages of a channel outside its steps.
    pub(crate) fn to_receive(&self, spec: &ChannelSpec) -> Result<(), Denied> {
        self.to_read(spec)?;
        match spec.role {
            Role::Instruction | Role::Request => Ok(()),
            // Observers take no steps, so they may receive everything.
            _ if !NAVIGATORS.contains(&self.process) => Ok(()),
            role => Err(Denied::Hear { channel: spec.name, role }),
        }
    }

    fn to_read(&self, spec: &ChannelSpec) -> Result<(), Denied> {
        let Self { process, kind } = self;
        if spec.may_read(*process) && spec.belongs_to(kind) {
            return Ok(());
        }
        let readers = channels::words(spec.readers.iter().copied());
        let readers = if readers.is_empty() { "no process".to_owned() } else { readers };
        let found = format!("one of {}, read by {readers}", owner(spec));
        Err(Denied::Read { channel: spec.name, process: *process, kind: kind.clone(), found })
    }
}

impl Denied {
    /// Creates the error for a channel that the process does not write.
    pub fn to_write(spec: &ChannelSpec) -> Self {
        let writer = spec.writer.map_or("every process", Process::word);
        Self::Write { channel: spec.name, found: format!("one of {}, written by {writer}", owner(spec)) }
    }
}

/// Returns the navigators that have a channel, in words.
fn owner(spec: &ChannelSpec) -> String {
    spec.kind.map_or_else(|| "all navigators".to_owned(), |kind| format!("navigator {kind:?}"))
}

#[cfg(test)]
mod tests {
    use sketchnav_schemas::channels::{DRAWING, MISSION, ODOMETRY, SCAN, TICK, TRUTH};
    use sketchnav_schemas::message::Message;
    use sketchnav_schemas::samples::example::{DETAIL, KIND, MAP, PLACE};

    use super::*;
    use crate::{InProcess, Incoming, Instant};

    /// Lets a planner of this kind ask for the latest message of a channel before any has arrived.
    fn newest<T: Message>(kind: &str, channel: channels::Channel<T>) -> Result<bool, String> {
        let (access, inputs) =
            (Access::new(Process::Planner, kind), InProcess::of_reader(Process::Planner, kind));
        let instant = Instant::new(&access, 1, 0, &inputs);
        assert_eq!(
            instant.newest(channel).map(|it| it.is_some()),
            instant.fresh(channel).map(|it| it.is_some())
        );
        instant.newest(channel).map(|newest| newest.is_some()).map_err(|denied| denied.to_string())
    }

    fn error<T>(text: &str) -> Result<T, String> {
        Err(text.to_owned())
    }

    #[test]
    fn a_channel_without_a_message_yet_is_not_an_error() {
        assert_eq!([newest(KIND, SCAN), newest(KIND, TICK)], [Ok(false), Ok(false)]);
        assert_eq!(newest(KIND, PLACE), Ok(false));
    }

    /// Regression test: instead of reporting an error, the navigator used to wait forever.
    #[test]
    fn a_channel_that_the_table_does_not_grant_is_an_error() {
        assert_eq!(
            newest(KIND, TRUTH),
            error(
                "channel \"truth\": expected one that the planner of navigator \"example\" reads, \
                 found one of all navigators, read by no process"
            )
        );
        assert_eq!(
            newest("other", PLACE),
            error(
                "channel \"example_place\": expected one that the planner of navigator \"other\" reads, \
                 found one of navigator \"example\", read by planner, pad"
            )
        );
    }

    #[test]
    fn instructions_are_not_part_of_an_instant_nor_readings_instructions() {
        assert_eq!(
            newest(KIND, MAP),
            error(
                "channel \"example_map\": expected a sensor, the tick or the situation, found the role Instruction"
            )
        );
        let access = Access::new(Process::Planner, KIND);
        let incoming = Incoming::new(&access, MISSION.spec, &[], &[]);
        let denied = incoming.on(ODOMETRY).unwrap_err().to_string();
        assert_eq!(
            denied,
            "channel \"odometry\": expected an instruction or a request, found the role Sensor"
        );
    }

    #[test]
    fn a_stage_cannot_read_a_channel_that_its_process_may_not() {
        let access = Access::new(Process::Planner, KIND);
        let incoming = Incoming::new(&access, MISSION.spec, &[], &[]);
        assert!(incoming.on(MAP).is_ok_and(|map| map.is_none()), "the planner's, of another channel");
        let denied = [incoming.on(DRAWING).map(drop), incoming.on(DETAIL).map(drop)];
        assert_eq!(
            denied.map(|denied| denied.unwrap_err().to_string()),
            [
                "channel \"drawing\": expected one that the planner of navigator \"example\" reads, \
                 found one of all navigators, read by sketcher",
                "channel \"example_detail\": expected one that the planner of navigator \"example\" reads, \
                 found one of navigator \"example\", read by pad",
            ]
        );
    }
}

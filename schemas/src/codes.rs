//! The small numbers inside messages, as types.

use crate::declare::codes;

/// A type whose values are small numbers in messages: `as Process` after a field of a declaration.
pub trait Code {
    /// Every value, in order.
    const VALUES: &'static [Value];
}

/// A value of a [`Code`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Value {
    /// The variant's name.
    pub name: &'static str,
    /// The number in the message.
    pub code: u32,
    /// What it means.
    pub doc: &'static str,
}

/// A free cell of a drawing that is a grid.
pub const FREE: u8 = 0;
/// A wall cell of a drawing that is a grid.
pub const WALL: u8 = 100;

codes! {
    /// The processes of a system.
    pub enum Process {
        /// The simulated world, or a real robot's driver in its place.
        World = 1 "world",
        /// Reads what a person drew.
        Sketcher = 2 "sketcher",
        /// Finds the robot in the drawing.
        Localizer = 3 "localizer",
        /// Drives it to its goals.
        Planner = 4 "planner",
        /// Writes every channel to a file.
        Recorder = 5 "recorder",
        /// Owns the others.
        Supervisor = 6 "supervisor",
        /// A tool that looks on: `echo`, `hz`, a user's own.
        Observer = 7 "observer",
        /// Serves the page on which people draw, watch and order.
        Pad = 8 "pad",
    }

    /// What the robot touched.
    pub enum BodyKind {
        /// A wall of the building.
        Wall = 1 "wall",
        /// Furniture, which no sketch shows.
        Furniture = 2 "furniture",
        /// Somebody who walks.
        Person = 3 "person",
    }

    /// How sure the localizer is.
    pub enum Tracking {
        /// Waiting for the sketch or the first scan.
        Waiting = 0 "waiting",
        /// The scans fit.
        Tracking = 1 "tracking",
        /// The scans fit badly, or several places fit.
        Doubtful = 2 "doubtful",
        /// The scans do not fit anywhere near.
        Lost = 3 "lost",
    }

    /// What a person can order.
    pub enum Order {
        /// Begin with the first task.
        Start = 1 "start",
        /// Stop and give up the mission; where there is a pad, it can be gone on with.
        Abort = 2 "abort",
        /// Stop, go on later.
        Pause = 3 "pause",
        /// Go on.
        Resume = 4 "resume",
        /// Stop, because the link to whoever drives was lost; go on later.
        Unattended = 5 "unattended",
        /// Leave the task that is under way for the one that the order names; those behind it follow.
        Goal = 6 "goal",
        /// Take the robot to be where the order says: what ROS calls `initialpose`.
        Here = 7 "here",
    }

    /// What a [`crate::message::Drawing`] holds.
    pub enum DrawingKind {
        /// The place: strokes in JSON, or a picture.
        Sketch = 1 "sketch",
        /// Where to go in it: a start, goals, a route, in JSON.
        Route = 2 "route",
    }

    /// How a task stands.
    pub enum TaskState {
        /// Not begun: the sketch, the route or the order to start is missing.
        Waiting = 0 "waiting",
        /// On the way.
        Driving = 1 "driving",
        /// Stopped by a person.
        Paused = 2 "paused",
        /// The robot believes to be at the goal; ends the task.
        Reached = 3 "reached",
        /// No way to the goal around what the laser sees; ends the task.
        Blocked = 4 "blocked",
        /// The robot does not know where it is; ends the task.
        Lost = 5 "lost",
        /// The time limit passed; ends the task.
        TimedOut = 6 "timed out",
        /// Given up by a person; ends the mission, where no pad can go on with it.
        Aborted = 7 "aborted",
        /// All tasks have ended; ends the mission, where no pad can give new ones.
        Finished = 8 "finished",
    }

    /// What went wrong with a process, what went right again, and what people and tools did to the run.
    pub enum FaultKind {
        /// A person or a tool has sent it a signal, or a planned fault has happened to it.
        Injected = 1 "injected",
        /// It has ended before its system did.
        Died = 2 "died",
        /// A successor was started.
        Restarted = 3 "restarted",
        /// The successor has done something that none before it had.
        Recovered = 4 "recovered",
        /// It has shown no sign of life for longer than it may.
        Unresponsive = 5 "unresponsive",
        /// It shows signs of life again.
        Responsive = 6 "responsive again",
        /// It died as often as it was started again, and got nowhere; ends the mission.
        GivenUp = 7 "given up",
        /// What its predecessor left cannot be used.
        StateRefused = 8 "state refused",
        /// The recording cannot be written: the disk is full, most likely.
        RecordingFailed = 9 "recording failed",
        /// The recording is written again.
        RecordingResumed = 10 "recording resumed",
        /// The system goes on after its supervisor's death.
        SystemResumed = 11 "system resumed",
        /// A person or a tool has given the navigator an order. No fault: it explains what the robot did.
        Ordered = 12 "order given",
    }
}

impl TaskState {
    /// Whether a task in this state is over. [`TaskState::Finished`] refers to the mission.
    pub const fn is_end(self) -> bool {
        matches!(self, Self::Reached | Self::Blocked | Self::Lost | Self::TimedOut | Self::Aborted)
    }
}

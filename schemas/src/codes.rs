//! Enumerations whose values are small numbers inside messages.

use crate::declare::codes;

/// A type whose values are small numbers in messages. A declaration names it after the field, as in `as Process`.
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
    /// The meaning of the value.
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
        /// A person walking.
        Person = 3 "person",
    }

    /// The certainty of the localizer.
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
        /// Stop and give up the mission; with a pad, it can be continued.
        Abort = 2 "abort",
        /// Stop, and continue later.
        Pause = 3 "pause",
        /// Continue.
        Resume = 4 "resume",
        /// Stop, because the link to the driving page was lost; continue later.
        Unattended = 5 "unattended",
        /// Leave the current task for the one that the order names; the tasks after it follow.
        Goal = 6 "goal",
        /// Take the robot to be where the order says: what ROS calls `initialpose`.
        Here = 7 "here",
    }

    /// What a [`crate::message::Drawing`] contains.
    pub enum DrawingKind {
        /// The place: strokes in JSON, or a picture.
        Sketch = 1 "sketch",
        /// Where to go in it: a start, goals, a route, in JSON.
        Route = 2 "route",
    }

    /// The state of a task.
    pub enum TaskState {
        /// Not begun: the sketch, the route or the order to start is missing.
        Waiting = 0 "waiting",
        /// On the way.
        Driving = 1 "driving",
        /// Stopped by a person.
        Paused = 2 "paused",
        /// The robot is at the goal by its own estimate; ends the task.
        Reached = 3 "reached",
        /// No way to the goal around what the laser sees; ends the task.
        Blocked = 4 "blocked",
        /// The robot does not know where it is; ends the task.
        Lost = 5 "lost",
        /// The time limit passed; ends the task.
        TimedOut = 6 "timed out",
        /// Given up by a person; ends the mission, unless a pad can continue it.
        Aborted = 7 "aborted",
        /// All tasks have ended; ends the mission, unless a pad can give new ones.
        Finished = 8 "finished",
    }

    /// How a process failed or recovered, and what people and tools did to the run.
    pub enum FaultKind {
        /// A person or a tool has sent it a signal, or a planned fault has happened to it.
        Injected = 1 "injected",
        /// It ended before its system did.
        Died = 2 "died",
        /// It was started again.
        Restarted = 3 "restarted",
        /// The restarted process has made progress.
        Recovered = 4 "recovered",
        /// It has shown no sign of life for longer than it may.
        Unresponsive = 5 "unresponsive",
        /// It shows signs of life again.
        Responsive = 6 "responsive again",
        /// It kept dying without progress; ends the mission.
        GivenUp = 7 "given up",
        /// Its predecessor's state cannot be used.
        StateRefused = 8 "state refused",
        /// The recording cannot be written: the disk is full, most likely.
        RecordingFailed = 9 "recording failed",
        /// The recording is being written again.
        RecordingResumed = 10 "recording resumed",
        /// The system continues after its supervisor's death.
        SystemResumed = 11 "system resumed",
        /// A person or a tool has given the navigator an order. No fault: it explains what the robot did.
        Ordered = 12 "order given",
    }
}

impl TaskState {
    /// Returns true if a task in this state is over. [`TaskState::Finished`] refers to the mission and therefore does not
    /// count.
    pub const fn is_end(self) -> bool {
        matches!(self, Self::Reached | Self::Blocked | Self::Lost | Self::TimedOut | Self::Aborted)
    }
}

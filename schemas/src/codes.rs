//! Enumerations whose values are small numbers inside messages.

use crate::declare::codes;

/// A type whose values are small numbers in messages. In a declaration, it follows the field: `as Process`.
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

/// Value of a free cell in a grid drawing.
pub const FREE: u8 = 0;
/// Value of a wall cell in a grid drawing.
pub const WALL: u8 = 100;

codes! {
    /// The processes of a system.
    pub enum Process {
        /// The simulated world, or a real robot's driver in its place.
        World = 1 "world",
        /// Reads what a person drew.
        Sketcher = 2 "sketcher",
        /// Localizes the robot in the drawing.
        Localizer = 3 "localizer",
        /// Drives the robot to its goals.
        Planner = 4 "planner",
        /// Writes every channel to a file.
        Recorder = 5 "recorder",
        /// Owns the other processes.
        Supervisor = 6 "supervisor",
        /// A tool that observes: `echo`, `hz`, or a user's own.
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
        /// A person who walks.
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
        /// Stop and give up the mission. With a pad, the mission can be continued.
        Abort = 2 "abort",
        /// Stop, to be continued later.
        Pause = 3 "pause",
        /// Continue.
        Resume = 4 "resume",
        /// Stop, to be continued later, because the link to the driving page was lost.
        Unattended = 5 "unattended",
        /// Leave the current task for the one that the order names, which the tasks after it follow, or for a place in the
        /// drawing, after which the mission is over.
        Goal = 6 "goal",
        /// Assume that the robot is where the order says, like `initialpose` in ROS.
        Here = 7 "here",
    }

    /// What a [`crate::message::Drawing`] contains.
    pub enum DrawingKind {
        /// A drawing of the place: strokes in JSON, or a picture.
        Sketch = 1 "sketch",
        /// Where to go in the drawing: a start, goals and a route, in JSON.
        Route = 2 "route",
    }

    /// The state of a task.
    pub enum TaskState {
        /// Not begun, because the sketch, the route or the order to start is missing.
        Waiting = 0 "waiting",
        /// The robot is driving to the goal.
        Driving = 1 "driving",
        /// Stopped by a person.
        Paused = 2 "paused",
        /// The robot is at the goal by its own estimate. Ends the task.
        Reached = 3 "reached",
        /// There is no path to the goal around what the laser sees. Ends the task.
        Blocked = 4 "blocked",
        /// The robot does not know where it is. Ends the task.
        Lost = 5 "lost",
        /// The time limit has passed. Ends the task.
        TimedOut = 6 "timed out",
        /// Given up by a person. Ends the mission, unless a pad can continue it.
        Aborted = 7 "aborted",
        /// All tasks have ended. Ends the mission, unless a pad can give new ones.
        Finished = 8 "finished",
    }

    /// The kinds of faults: how a process failed or recovered, and what people and tools did to the run.
    pub enum FaultKind {
        /// A person or a tool has sent the process a signal, or a planned fault has happened to it.
        Injected = 1 "injected",
        /// The process ended before its system did.
        Died = 2 "died",
        /// The process was started again.
        Restarted = 3 "restarted",
        /// The restarted process has made progress.
        Recovered = 4 "recovered",
        /// The process has shown no sign of life for too long.
        Unresponsive = 5 "unresponsive",
        /// The process shows signs of life again.
        Responsive = 6 "responsive again",
        /// The process kept dying without progress. Ends the mission.
        GivenUp = 7 "given up",
        /// The state that its predecessor left cannot be used.
        StateRefused = 8 "state refused",
        /// The recording cannot be written, most likely because the disk is full.
        RecordingFailed = 9 "recording failed",
        /// The recording is being written again.
        RecordingResumed = 10 "recording resumed",
        /// The system continues after the death of its supervisor.
        SystemResumed = 11 "system resumed",
        /// A person or a tool has given the navigator an order. This is not a fault, but explains what the robot did.
        Ordered = 12 "order given",
    }
}

impl TaskState {
    /// Returns whether a task in this state is over. [`TaskState::Finished`] refers to the mission and therefore does not count.
    pub const fn is_end(self) -> bool {
        matches!(self, Self::Reached | Self::Blocked | Self::Lost | Self::TimedOut | Self::Aborted)
    }
}

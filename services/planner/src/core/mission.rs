//! Where the mission stands, and what a person's orders make of it.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::codes::{Order, TaskState};
use sketchnav_schemas::geometry::{Odom, Pose};
use sketchnav_schemas::run::Pad;

use super::report::Reason;

/// How far the mission has come.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) enum Phase {
    /// Not begun.
    Waiting,
    /// A task is under way.
    Driving,
    /// A task has ended and was reported; the next step begins the next one.
    Ended,
    /// Nothing is left to do.
    Over,
}

/// Why the robot stands although there is something left to do.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) enum Hold {
    /// A person stopped it.
    Paused,
    /// Whoever drives cannot be heard.
    Unattended,
    /// A person gave it up, and may think better of it.
    Aborted,
}

impl Hold {
    /// What there is to say about it.
    pub(super) fn words(self) -> (TaskState, Reason) {
        match self {
            Self::Paused => (TaskState::Paused, Reason::Stopped),
            Self::Unattended => (TaskState::Paused, Reason::Unattended),
            Self::Aborted => (TaskState::Aborted, Reason::GivenUp),
        }
    }
}

/// What the core remembers from step to step, beside the driver's own state.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Mission {
    pub(super) phase: Phase,
    pub(super) held: Option<Hold>,
    pub(super) ordered: bool,
    pub(super) task: usize,
    pub(super) reached: u32,
    pub(super) state: u32,
    pub(super) reason: Reason,
    pub(super) elapsed_s: f64,
    pub(super) path_m: f64,
    pub(super) last_stamp_ns: Option<u64>,
    pub(super) last_odometry: Option<Pose<Odom>>,
    pub(super) speed_mps: f64,
    pub(super) stamp_ns: u64,
    pub(super) source_seq: u64,
    /// The sketch and the route that this is about; 0 before the first.
    pub(super) sketch_seq: u64,
    pub(super) route_seq: u64,
}

impl Default for Mission {
    fn default() -> Self {
        Self {
            phase: Phase::Waiting,
            held: None,
            ordered: false,
            task: 0,
            reached: 0,
            state: TaskState::Waiting.code(),
            reason: Reason::None,
            elapsed_s: 0.0,
            path_m: 0.0,
            last_stamp_ns: None,
            last_odometry: None,
            speed_mps: 0.0,
            stamp_ns: 0,
            source_seq: 0,
            sketch_seq: 0,
            route_seq: 0,
        }
    }
}

impl Mission {
    pub(super) fn set(&mut self, state: TaskState, reason: Reason) {
        (self.state, self.reason) = (state.code(), reason);
    }

    /// Begins a task.
    pub(super) fn begin(&mut self, task: usize) {
        (self.phase, self.task) = (Phase::Driving, task);
        (self.elapsed_s, self.path_m) = (0.0, 0.0);
    }

    /// Forgets what it was about: the order to start is to come again.
    pub(super) fn begin_anew(&mut self) {
        (self.phase, self.held, self.ordered) = (Phase::Waiting, None, false);
        (self.task, self.reached) = (0, 0);
        (self.elapsed_s, self.path_m) = (0.0, 0.0);
    }

    /// Does what a person orders.
    pub(super) fn on_order(&mut self, order: Order, pad: Pad) {
        match order {
            Order::Start if pad.draws() && (self.held.is_some() || self.phase == Phase::Over) => {
                self.begin_anew();
                self.ordered = true;
            }
            Order::Start => self.ordered = true,
            Order::Abort if self.phase == Phase::Over => {}
            Order::Abort if pad.is_absent() => {
                self.phase = Phase::Over;
                self.set(TaskState::Aborted, Reason::GivenUp);
            }
            // The supervisor's order to start may come after it: what a person says at the pad goes before.
            Order::Abort if pad == Pad::Watches => self.held = Some(Hold::Aborted),
            Order::Abort => self.hold(Hold::Aborted),
            Order::Pause => self.hold(Hold::Paused),
            Order::Unattended => self.hold(Hold::Unattended),
            Order::Resume => self.held = None,
        }
    }

    /// What was aborted is not merely paused.
    fn hold(&mut self, hold: Hold) {
        let is_under_way = self.ordered && self.phase != Phase::Over;
        if is_under_way && self.held != Some(Hold::Aborted) {
            self.held = Some(hold);
        }
    }

    /// Whether the robot drives, or is about to.
    pub(super) fn is_driving(&self) -> bool {
        self.ordered && self.held.is_none() && self.phase != Phase::Over
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn driving() -> Mission {
        let mut mission = Mission { ordered: true, ..Mission::default() };
        mission.begin(2);
        mission
    }

    #[test]
    fn without_a_pad_what_is_aborted_is_over() {
        let mut mission = driving();
        mission.on_order(Order::Abort, Pad::Absent);
        assert_eq!((mission.phase, mission.state), (Phase::Over, TaskState::Aborted.code()));
        mission.on_order(Order::Resume, Pad::Absent);
        assert_eq!(mission.phase, Phase::Over);
    }

    #[test]
    fn with_a_pad_what_is_aborted_can_be_gone_on_with() {
        for pad in [Pad::Watches, Pad::Draws] {
            let mut mission = driving();
            mission.on_order(Order::Abort, pad);
            assert_eq!((mission.held, mission.is_driving()), (Some(Hold::Aborted), false));
            // The link breaks while it stands: it stays what a person said of it.
            mission.on_order(Order::Unattended, pad);
            assert_eq!(mission.held, Some(Hold::Aborted));
            mission.on_order(Order::Resume, pad);
            assert_eq!((mission.phase, mission.task, mission.is_driving()), (Phase::Driving, 2, true));
        }
    }

    #[test]
    fn who_has_aborted_can_start_again_with_the_first_task() {
        let mut mission = driving();
        mission.on_order(Order::Start, Pad::Draws);
        assert_eq!((mission.phase, mission.task), (Phase::Driving, 2), "it drives already");
        mission.on_order(Order::Abort, Pad::Draws);
        mission.on_order(Order::Start, Pad::Draws);
        assert_eq!((mission.phase, mission.task, mission.is_driving()), (Phase::Waiting, 0, true));
    }

    /// The planner reads what comes from the pad first. Of a mission from a file it once forgot an abort that came
    /// before the supervisor's order to start, and drove off.
    #[test]
    fn a_mission_from_a_file_can_be_aborted_before_it_is_started() {
        let mut mission = Mission::default();
        mission.on_order(Order::Abort, Pad::Watches);
        mission.on_order(Order::Start, Pad::Watches);
        assert_eq!((mission.held, mission.is_driving()), (Some(Hold::Aborted), false));
        mission.on_order(Order::Resume, Pad::Watches);
        assert!(mission.is_driving());
    }

    #[test]
    fn only_what_is_under_way_can_be_held() {
        let mut mission = Mission::default();
        mission.on_order(Order::Pause, Pad::Absent);
        mission.on_order(Order::Abort, Pad::Draws);
        assert_eq!(mission.held, None);
        let mut mission = Mission { phase: Phase::Over, ..driving() };
        mission.on_order(Order::Unattended, Pad::Draws);
        assert_eq!(mission.held, None);
    }
}

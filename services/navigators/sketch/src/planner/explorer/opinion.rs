//! A second opinion on an arrival: regions joined by doors are asked whether the goal is here.

use std::sync::Arc;
use std::task::Poll;

use serde::{Deserialize, Serialize};
use sketchnav_mapping::outline::Place;

use super::Explorer;
use crate::planner::certainty::Said;
use crate::rooms::{Floor, Inquiry};

/// Number of energies of pairs to compute in each step.
const WORK: usize = 40_000;

/// A question that is being answered.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Question {
    floor: Floor,
    /// The robot's place, and its region.
    place: Place,
    room: Option<u16>,
    /// Number of steps of the answer so far.
    steps: u32,
}

impl Explorer {
    /// Begins to ask regions and doors about the map as it is now. Returns false if they have nothing to say.
    pub fn ask_rooms(&mut self) -> bool {
        self.take_survey();
        let (place, Some(drawing), Some(paper)) = (self.place(), &self.rooms, &self.paper) else {
            return false;
        };
        let floor = Floor::of_map(&self.survey, [0.0; 2], paper.start.yaw_rad, drawing);
        self.exploration.question = floor.map(|floor| {
            let room = floor.room_at(place);
            Question { floor, place, room, steps: 0 }
        });
        self.prepare_inquiry();
        self.inquiry.is_some()
    }

    /// Prepares to answer the question, and repeats the steps that were taken before it was stored.
    pub(super) fn prepare_inquiry(&mut self) {
        self.inquiry = None;
        let (Some(question), Some(drawing), Some(goal)) =
            (&self.exploration.question, &self.rooms, self.exploration.goal)
        else {
            return;
        };
        self.inquiry = Inquiry::new(drawing, &Arc::new(question.floor.clone()), [goal.x, goal.y]);
        if let Some(inquiry) = &mut self.inquiry {
            (0..question.steps).for_each(|_| drop(inquiry.advance(WORK)));
        }
    }

    /// Takes a step of the answer, which is `None` if regions and doors have nothing to say.
    pub fn hear_rooms(&mut self) -> Poll<Option<Said>> {
        let (Some(question), Some(inquiry)) = (&mut self.exploration.question, &mut self.inquiry) else {
            return Poll::Ready(None);
        };
        question.steps += 1;
        let Poll::Ready(answer) = inquiry.advance(WORK) else { return Poll::Pending };
        let said = Said::of(&answer, question.room, question.place);
        self.withdraw_question();
        Poll::Ready(said)
    }

    /// Withdraws the question.
    pub(super) fn withdraw_question(&mut self) {
        (self.exploration.question, self.inquiry) = (None, None);
    }
}

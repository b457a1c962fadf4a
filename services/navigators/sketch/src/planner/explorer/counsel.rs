//! A second opinion on how a task is about to end.
//!
//! Before the robot reports that it has arrived or failed, regions joined by doors are asked where the goal lies. If they agree
//! with an arrival or say nothing, it stands. Otherwise the place where they have the goal is a rival like those of the outline:
//! the robot drives there, or to the gap beyond which the goal must lie, looks around, and asks again. It has arrived if they then
//! have the goal there by a margin and most doors have a partner. If they have it nowhere else any more, the robot returns, and the
//! first decision stands. A robot that has failed has nothing to return to and simply tries what they say.

use std::sync::Arc;
use std::task::Poll;

use serde::{Deserialize, Serialize};
use sketchnav_mapping::outline::Place;

use super::course::Aim;
use super::{AT_GAP_M, AT_GOAL_M, Explorer, LOOKED_AT_M, USUAL_MPS, distance};
use crate::planner::certainty::{AGREE_M, Said};
use crate::rooms::{Answer, Floor, Hypothesis, Inquiry};

/// Number of energies of pairs to compute in each step.
const WORK: usize = 40_000;
/// Share of the alignments that a place must have for the robot to look there.
const LEAST_SHARE: f64 = 0.15;
/// Maximum number of places to look at.
const MOST_LOOKS: usize = 6;
/// Share of all doors that must have a partner for an arrival by regions and doors. Of 11 such arrivals at deformed drawings, the 6
/// right ones had at least 0.7 and the 5 wrong ones at most 0.62.
const LEAST_MATCHED: f64 = 0.65;
/// Time that is reserved for the end of a task, in seconds.
const SPARE_S: f64 = 30.0;

/// What to do about the end of a task.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Opinion {
    /// Wait, because there is no answer yet.
    Wait,
    /// Drive along the course.
    Drive,
    /// Turn on the spot, to see everything around.
    Look,
    /// End the task as it was about to end.
    Stand(Option<Said>),
    /// The goal is here, according to regions and doors.
    Arrived(Said),
}

/// A question that is being answered.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Question {
    floor: Floor,
    /// The robot's place, and its region.
    place: Place,
    room: Option<u16>,
    /// Number of steps of the answer so far.
    steps: u32,
}

/// Where the robot drives because of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
enum Way {
    /// To a place or a gap that is to be looked at.
    ToLook,
    /// To the goal's place, where it has looked around.
    ToGoal,
    /// Back to where it had arrived.
    Back,
}

/// The state of asking regions and doors about the end of a task.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Counsel {
    /// Where the robot has arrived, or `None` if it has failed.
    home: Option<Place>,
    question: Option<Question>,
    way: Option<Way>,
    looked_at: Vec<Place>,
    said: Option<Said>,
}

impl Explorer {
    /// Returns true if regions and doors can be asked.
    pub fn has_counsel(&self) -> bool {
        self.parameters.asks_rooms && self.rooms.is_some() && self.exploration.goal.is_some()
    }

    /// Begins to ask regions and doors about an arrival here, or about what to do instead of failing.
    pub fn consult(&mut self, has_arrived: bool) {
        let home = has_arrived.then(|| self.place());
        (self.exploration.job, self.exploration.course, self.field) = (None, None, None);
        self.exploration.counsel = Some(Counsel { home, ..Counsel::default() });
        self.inquire();
    }

    /// Ends the consultation.
    pub fn dismiss(&mut self) {
        (self.exploration.counsel, self.inquiry) = (None, None);
    }

    /// Asks about the map as it is now.
    fn inquire(&mut self) {
        self.take_survey();
        let (place, Some(drawing), Some(paper)) = (self.place(), &self.rooms, &self.paper) else { return };
        let Some(counsel) = &mut self.exploration.counsel else { return };
        let floor = Floor::of_map(&self.survey, [0.0; 2], paper.start.yaw_rad, drawing);
        counsel.question = floor.map(|floor| {
            let room = floor.room_at(place);
            Question { floor, place, room, steps: 0 }
        });
        counsel.way = None;
        self.prepare_inquiry();
    }

    /// Prepares to answer the question, and repeats the steps that were taken before it was stored.
    pub(super) fn prepare_inquiry(&mut self) {
        let question = self.exploration.counsel.as_ref().and_then(|counsel| counsel.question.as_ref());
        let (Some(question), Some(drawing), Some(goal)) = (question, &self.rooms, self.exploration.goal)
        else {
            self.inquiry = None;
            return;
        };
        self.inquiry = Inquiry::new(drawing, &Arc::new(question.floor.clone()), [goal.x, goal.y]);
        if let Some(inquiry) = &mut self.inquiry {
            (0..question.steps).for_each(|_| drop(inquiry.advance(WORK)));
        }
    }

    /// Takes a step of the consultation, with `left_s` seconds left for the task.
    pub fn hear_counsel(&mut self, left_s: f64) -> Opinion {
        let Some(counsel) = &mut self.exploration.counsel else { return Opinion::Stand(None) };
        if let Some(way) = counsel.way {
            return self.follow_counsel(way);
        }
        let answer = match (&mut counsel.question, &mut self.inquiry) {
            (Some(question), Some(inquiry)) => {
                question.steps += 1;
                match inquiry.advance(WORK) {
                    Poll::Pending => return Opinion::Wait,
                    Poll::Ready(answer) => Some((answer, question.room, question.place)),
                }
            }
            _ => None,
        };
        (counsel.question, self.inquiry) = (None, None);
        self.weigh_counsel(answer, left_s)
    }

    /// Asks again, because the robot has looked around or gets no farther.
    pub(super) fn ask_counsel_again(&mut self) {
        if let (Some(course), Some(counsel)) = (self.exploration.course.take(), &mut self.exploration.counsel)
        {
            counsel.looked_at.push(course.target);
        }
        self.field = None;
        self.inquire();
    }

    /// Returns true if regions and doors are being asked.
    pub fn is_consulting(&self) -> bool {
        self.exploration.counsel.is_some()
    }

    /// Drives until the end of the course is reached.
    fn follow_counsel(&mut self, way: Way) -> Opinion {
        let Some(course) = &self.exploration.course else { return self.give_counsel_up() };
        let within_m = if way == Way::ToLook { AT_GAP_M } else { AT_GOAL_M };
        if distance(self.place(), course.end) >= within_m {
            return Opinion::Drive;
        }
        let said = self.exploration.counsel.as_ref().and_then(|counsel| counsel.said);
        match (way, said) {
            (Way::ToLook, _) => Opinion::Look,
            (Way::ToGoal, Some(said)) => {
                self.dismiss();
                Opinion::Arrived(said)
            }
            (Way::ToGoal | Way::Back, _) => Opinion::Stand(said),
        }
    }

    /// Decides where to drive because of an answer.
    fn weigh_counsel(&mut self, answer: Option<(Answer, Option<u16>, Place)>, left_s: f64) -> Opinion {
        let Some(counsel) = &mut self.exploration.counsel else { return Opinion::Stand(None) };
        let Some((answer, room, place)) = answer else { return self.give_counsel_up() };
        let said = Said::of(&answer, room, place);
        let (home, is_first) = (counsel.home, counsel.looked_at.is_empty());
        let Some(said) = said else { return self.give_counsel_up() };
        if is_first || home.is_none() {
            counsel.said = Some(said);
        }
        let is_certain = said.margin >= self.parameters.rooms_margin;
        if is_first && home.is_some() && (said.agrees || !is_certain) {
            return Opinion::Stand(Some(said));
        }
        let looks = counsel.looked_at.len();
        let best = answer.hypotheses[0];
        let is_home = |at: Place| home.is_some_and(|home| distance(home, at) < AGREE_M);
        if best.place.is_some_and(is_home) {
            counsel.said = Some(Said { agrees: true, ..said });
            return self.give_counsel_up();
        }
        if said.agrees
            && is_certain
            && said.doors_matched >= LEAST_MATCHED
            && let Some(goal) = best.place
        {
            let opinion = self.set_way(Way::ToGoal, goal, left_s);
            if let (Some(_), Some(counsel)) = (opinion, &mut self.exploration.counsel) {
                counsel.said = Some(said);
            }
            return opinion.unwrap_or_else(|| self.give_counsel_up());
        }
        if looks < MOST_LOOKS
            && let Some(target) = self.target(&answer.hypotheses)
        {
            return self.set_way(Way::ToLook, target, left_s).unwrap_or_else(|| self.give_counsel_up());
        }
        self.give_counsel_up()
    }

    /// Returns the likeliest place that has not been looked at.
    fn target(&self, hypotheses: &[Hypothesis]) -> Option<Place> {
        let counsel = self.exploration.counsel.as_ref()?;
        let is_near = |a: Place, b: Place| distance(a, b) < LOOKED_AT_M;
        let is_new =
            |at: &Place| !counsel.looked_at.iter().chain(&counsel.home).any(|seen| is_near(*seen, *at));
        let likely = hypotheses.iter().filter(|hypothesis| hypothesis.share >= LEAST_SHARE);
        likely.filter_map(|hypothesis| hypothesis.place.or(hypothesis.gap)).find(is_new)
    }

    /// Sets a course, unless nothing is in reach or there is no time to drive there and back.
    fn set_way(&mut self, way: Way, target: Place, left_s: f64) -> Option<Opinion> {
        let back = self.exploration.counsel.as_ref()?.home.map_or(0.0, |home| distance(home, target));
        let way_m = self.set_course(Aim::Rival, target, Vec::new())?;
        if way != Way::Back && (way_m + 1.5 * back) / USUAL_MPS + SPARE_S > left_s {
            return None;
        }
        self.exploration.counsel.as_mut()?.way = Some(way);
        Some(Opinion::Drive)
    }

    /// Lets the first decision stand, after returning to where it was made.
    fn give_counsel_up(&mut self) -> Opinion {
        let Some(counsel) = &self.exploration.counsel else { return Opinion::Stand(None) };
        let said = counsel.said;
        match counsel.home.filter(|home| distance(*home, self.place()) > AT_GOAL_M) {
            Some(home) if counsel.way != Some(Way::Back) => {
                self.set_way(Way::Back, home, f64::INFINITY).unwrap_or(Opinion::Stand(said))
            }
            _ => Opinion::Stand(said),
        }
    }
}

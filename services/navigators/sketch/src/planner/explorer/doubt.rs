//! A doubt that only a person can settle: the goal seems to be here, but according to other alignments of hardly greater cost, the
//! robot is elsewhere in the drawing, and there is nothing left to look at that could distinguish them.
//!
//! The robot then waits and shows in the drawing where it might be. A person's answer decides between the alignments and anchors
//! all later ones.

use serde::{Deserialize, Serialize};
use sketchnav_mapping::alignment::{Alignment, Forbidden};
use sketchnav_schemas::geometry::{Point, Sketch, wrap_angle};
use sketchnav_schemas::message::Here;

use super::{Advice, Explorer, Known};
use crate::messages::{PossiblePlace, Question};

/// Maximum number of places that a [`Question`] offers.
const MOST_PLACES: usize = 4;
/// Maximum number of rivals to compute.
const MOST_RIVALS: u32 = 6;
/// Distance, in metres, within which two places are the same to a person.
const APART_M: f64 = 2.0;

/// Where the robot and the goal are according to an alignment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Hypothesis {
    /// The robot's position in the drawing.
    at: Point<Sketch>,
    /// Amount by which the alignment costs more than the best one.
    margin: f64,
    /// Partners that determine where this alignment locates the goal.
    goal: Vec<Forbidden>,
}

/// A doubt about which a person is being asked, or will be.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Doubt {
    /// Amount by which the best rival costs more.
    margin: f64,
    /// Hypotheses, starting with that of the best alignment.
    hypotheses: Vec<Hypothesis>,
    /// Partners that determine where the hypotheses so far locate the goal. The next rival must not use them.
    found: Vec<Forbidden>,
    rivals: u32,
    /// Whether all rivals are known and a person is being asked.
    is_open: bool,
}

/// The result of settling a doubt about an arrival.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Settled {
    /// Amount by which the best rival costs more.
    margin: f64,
    /// Whether a person has confirmed where the robot is.
    is_confirmed: bool,
}

impl Explorer {
    /// Begins a doubt about an arrival, when nothing is left to look at. `rival` costs `margin` more than the best alignment,
    /// according to which the goal is here.
    pub(super) fn doubt(&mut self, rival: &Alignment, margin: f64) -> Advice {
        if !self.may_ask() || margin > self.parameters.ask_margin {
            return self.arrived(Some(margin));
        }
        let best = self.exploration.last.take();
        let first = best.as_ref().and_then(|(_, best)| self.hypothesis(best, 0.0));
        self.exploration.last = best;
        let Some(first) = first else { return self.arrived(Some(margin)) };
        let found = first.goal.clone();
        let doubt = Doubt { margin, hypotheses: vec![first], found, rivals: 0, is_open: false };
        self.doubt_more(doubt, rival, margin)
    }

    /// Returns true if a person can be asked.
    pub(super) fn may_ask(&self) -> bool {
        self.parameters.ask_margin > 0.0
    }

    /// Adds another rival to a doubt that is not complete yet. A rival that costs too much completes it.
    pub(super) fn doubt_on(&mut self, doubt: Doubt, rival: &Alignment, margin: f64) -> Advice {
        match margin <= self.parameters.ask_margin {
            true => self.doubt_more(doubt, rival, margin),
            false => self.ask(doubt),
        }
    }

    fn doubt_more(&mut self, mut doubt: Doubt, rival: &Alignment, margin: f64) -> Advice {
        let found = self.goal_places(rival);
        doubt.found.extend(&found);
        doubt.rivals += 1;
        let apart_px = self.paper.as_ref().map_or(0.0, |paper| APART_M / paper.scale_m);
        let is_new =
            |at: &Point<Sketch>| doubt.hypotheses.iter().all(|known| known.at.distance(at) > apart_px);
        let hypothesis = self.hypothesis(rival, margin).filter(|hypothesis| is_new(&hypothesis.at));
        doubt.hypotheses.extend(hypothesis);
        let best = self.exploration.last.as_ref().map(|(_, best)| best.cost);
        if doubt.hypotheses.len() == MOST_PLACES || doubt.rivals == MOST_RIVALS || found.is_empty() {
            return self.ask(doubt);
        }
        self.begin_job(doubt.found.clone(), best);
        self.exploration.doubt = Some(doubt);
        Advice::Drive
    }

    /// Asks a person, unless there is only one place to choose from.
    fn ask(&mut self, doubt: Doubt) -> Advice {
        if doubt.hypotheses.len() < 2 {
            return self.arrived(Some(doubt.margin));
        }
        self.exploration.doubt = Some(Doubt { is_open: true, ..doubt });
        Advice::Ask
    }

    fn hypothesis(&self, alignment: &Alignment, margin: f64) -> Option<Hypothesis> {
        let at = self.paper.as_ref()?.place_of(&alignment.partners, self.place())?;
        Some(Hypothesis { at, margin, goal: self.goal_places(alignment) })
    }

    /// While a person is being asked, returns the number of places to choose from, and the amount by which the second place's
    /// alignment costs more.
    pub fn asks(&self) -> Option<(usize, f64)> {
        let doubt = self.exploration.doubt.as_ref().filter(|doubt| doubt.is_open)?;
        Some((doubt.hypotheses.len(), doubt.hypotheses.get(1)?.margin))
    }

    /// Writes the places for a question to a person.
    pub fn write_question(&self, out: &mut Question) {
        let doubt = self.exploration.doubt.as_ref().filter(|doubt| doubt.is_open);
        let places = doubt.map_or(&[][..], |doubt| &doubt.hypotheses);
        for (slot, Hypothesis { at, margin, .. }) in out.places.iter_mut().zip(places) {
            *slot = PossiblePlace { x_px: at.x, y_px: at.y, margin: *margin };
        }
        out.place_count = places.len().min(out.places.len()) as u32;
    }

    /// Accepts the arrival on its own evidence, because nobody answers.
    pub fn believe(&mut self) {
        let doubt = self.exploration.doubt.take_if(|doubt| doubt.is_open);
        self.exploration.settled = doubt.map(|doubt| Settled { margin: doubt.margin, is_confirmed: false });
    }

    /// Takes the result of a doubt that has been settled, if there is one.
    pub(super) fn take_settled(&mut self) -> Option<Advice> {
        let Settled { margin, is_confirmed } = self.exploration.settled.take()?;
        Some(match self.arrived(Some(margin)) {
            Advice::Arrived(evidence) => Advice::Arrived(super::Evidence { is_confirmed, ..evidence }),
            advice => advice,
        })
    }

    /// Processes a person's report of where the robot is. If it agrees with the best alignment, the arrival in doubt is accepted.
    /// If it agrees with a rival, the goal must no longer be where the other hypotheses locate it. Unless the arrival is accepted,
    /// alignments are anchored at the reported position from now on.
    pub fn tell(&mut self, here: &Here) {
        if !self.is_in_charge() {
            return;
        }
        let doubt = self.exploration.doubt.take_if(|doubt| doubt.is_open);
        let near = doubt.as_ref().and_then(|doubt| Some((doubt, self.nearest(doubt, &here.at)?)));
        let robot = self.robot();
        let turn_rad = here.yaw_rad.map(|yaw_rad| wrap_angle(yaw_rad - robot.yaw_rad));
        let told = Known { places: Some([[here.at.x, here.at.y], self.place()]), turn_rad };
        if let Some((doubt, 0)) = near {
            self.exploration.settled = Some(Settled { margin: doubt.margin, is_confirmed: true });
            if !self.is_anchored() {
                self.exploration.told = Some(told);
            }
            return;
        }
        if let Some((doubt, chosen)) = near {
            let others = doubt.hypotheses.iter().enumerate().filter(|(k, _)| *k != chosen);
            self.exploration.denied.extend(others.flat_map(|(_, other)| &other.goal));
        }
        self.exploration.told = Some(told);
        self.look_anew();
    }

    /// Discards all comparisons so far and begins a new one.
    fn look_anew(&mut self) {
        (self.exploration.job, self.exploration.course, self.field) = (None, None, None);
        (self.exploration.doubt, self.exploration.settled) = (None, None);
        (self.exploration.looking, self.exploration.looks) = (None, 0);
        (self.exploration.looked_at, self.exploration.rival) = (Vec::new(), None);
        if self.exploration.goal.is_some() && self.exploration.has_looked {
            self.begin_job(Vec::new(), None);
        }
    }

    /// Returns the index of the hypothesis nearest to a place, or `None` if all are too far away.
    fn nearest(&self, doubt: &Doubt, at: &Point<Sketch>) -> Option<usize> {
        let off_px = |k: &usize| doubt.hypotheses[*k].at.distance(at);
        let nearest = (0..doubt.hypotheses.len()).min_by(|a, b| off_px(a).total_cmp(&off_px(b)))?;
        let off_m = off_px(&nearest) * self.paper.as_ref()?.scale_m;
        (off_m <= self.parameters.rival_away_m).then_some(nearest)
    }
}

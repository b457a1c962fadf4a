//! Determines which transitions are error-detectable and error-recoverable, and how to recover (Park and Kender 1995, 6.3).
//!
//! The navigator verifies a landmark by its quadrant occupancy count (QOC). A transition is *detectable* if none of the dots that
//! can be mistaken for the target has the same count. It is *recoverable* (6.3.2) if
//! 1. it is detectable;
//! 2. for each other count, there is a quadrant in which the target is visible from every mistakable dot with that count;
//! 3. from each of these dots, the recoveries, applied repeatedly, lead to the target.
//!
//! Condition 3 follows a recovery to any dot of the plane, including dots that were not in the first view. Their counts, too,
//! must differ from the target's and have a recovery.
//!
//! In a parkway, the dots that can be mistaken for the target are the candidates of the view. On a trajectory, they are the
//! dots that a slide beside the correct line attains.

use crate::custom_map::{Recovery, Response, Sign, Verification};
use crate::description::Descriptor;
use crate::error::Error;
use crate::geometry::{Corner, Window};
use crate::plane::{DotId, Plane};
use crate::reliability::quantiles;
use crate::signature::Signature;
use crate::trajectory::Slide;
use crate::transitions::{Candidates, Movement, Transition};

/// Maximum number of different signs among the mistakable dots for which a complete recovery is searched. Each further sign
/// multiplies the number of combinations by up to four.
const MOST_SIGNS: usize = 4;

/// The result of checking a transition for errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Check {
    /// There is only one candidate, so nothing can be mistaken for the target.
    Trivial,
    /// All errors are detected and corrected.
    Recoverable(Verification),
    /// All errors are detected, but only those that a single recovery can correct are corrected.
    Detectable(Verification),
    /// A wrong dot has the same count as the target.
    Unverifiable,
}

impl Check {
    /// Returns the verification for the map, or `None` for trivial and unverifiable transitions, as in 6.3.4.
    pub fn verification(self) -> Option<Verification> {
        match self {
            Self::Recoverable(verification) | Self::Detectable(verification) => Some(verification),
            Self::Trivial | Self::Unverifiable => None,
        }
    }

    /// Returns true if an error would be noticed.
    pub fn is_detectable(self) -> bool {
        self != Self::Unverifiable
    }

    /// Returns true if an error would be corrected.
    pub fn is_recoverable(self) -> bool {
        matches!(self, Self::Trivial | Self::Recoverable(_))
    }
}

/// Searches for recoveries on a plane.
#[derive(Debug)]
pub struct Recoveries<'a> {
    plane: &'a Plane,
    window: Window,
    signatures: &'a [Signature],
    /// The word that recoveries use to seek the target.
    word: Descriptor,
}

impl<'a> Recoveries<'a> {
    /// Creates a search for recoveries that use this word. `signatures` must have one entry for each dot of the plane.
    pub fn new(
        plane: &'a Plane,
        window: Window,
        signatures: &'a [Signature],
        word: Descriptor,
    ) -> Result<Self, Error> {
        if signatures.len() == plane.len() {
            Ok(Self { plane, window, signatures, word })
        } else {
            let found = signatures.len() as f64;
            Err(Error::Parameter { what: "signatures", expected: "one for each dot", found })
        }
    }

    /// Checks how errors of a transition can be detected and corrected. `aside` is the standard deviation of a slide's sideways
    /// error.
    pub fn check(&self, from: DotId, transition: &Transition, aside: f64) -> Check {
        let mistaken = self.mistaken(from, transition, aside);
        if mistaken.is_empty() {
            return Check::Trivial;
        }
        let target = transition.to;
        let expected = self.sign(target);
        let Ok(plain) = Verification::new(expected) else { return Check::Unverifiable };
        if mistaken.iter().any(|&dot| self.sign(dot) == expected) {
            return Check::Unverifiable;
        }
        let complete = self.recoverable(target, &mistaken, plain).map(Check::Recoverable);
        let check =
            complete.unwrap_or_else(|| Check::Detectable(self.partly_recoverable(target, &mistaken, plain)));
        // A recovery for one panorama also accepts similar ones, so a wrong panorama that resembles the right one may still be
        // accepted as correct.
        let is_taken = |dot: &DotId| {
            let response = check.verification().map(|way| way.response(self.signatures[*dot as usize]));
            response == Some(Response::Correct)
        };
        if mistaken.iter().any(is_taken) { Check::Unverifiable } else { check }
    }

    /// Returns the sign that the map uses for the surroundings of a dot.
    fn sign(&self, dot: DotId) -> Sign {
        let signature = self.signatures[dot as usize];
        match self.window.land {
            None => Sign::Count(signature.count()),
            Some(_) => Sign::Panorama(signature),
        }
    }

    /// Returns the distinct signs of some dots, sorted.
    fn signs(&self, dots: &[DotId]) -> Vec<Sign> {
        let mut signs: Vec<_> = dots.iter().map(|&dot| self.sign(dot)).collect();
        signs.sort_unstable();
        signs.dedup();
        signs
    }

    /// Returns the verification with recoveries only for those signs from which a single recovery leads to the target.
    fn partly_recoverable(&self, target: DotId, mistaken: &[DotId], plain: Verification) -> Verification {
        self.signs(mistaken).into_iter().fold(plain, |way, sign| {
            let same: Vec<_> = mistaken.iter().filter(|&&dot| self.sign(dot) == sign).collect();
            let recoveries = Corner::ALL.into_iter().map(|corner| Recovery { corner, word: self.word });
            let leads =
                |recovery: &Recovery| same.iter().all(|&&dot| self.next(dot, *recovery) == Some(target));
            recoveries.into_iter().find(leads).map_or(way, |recovery| way.recovering(sign, recovery))
        })
    }

    /// Returns the dots that can be mistaken for the target, in ascending order.
    pub fn mistaken(&self, from: DotId, transition: &Transition, aside: f64) -> Vec<DotId> {
        if transition.word == Descriptor::Same {
            return Vec::new();
        }
        let mut dots = if transition.movement == Movement::Seek {
            let mut candidates = Candidates::default();
            candidates.find(self.plane, self.window, from, transition.corner);
            if transition.by_kind {
                let kind = self.plane.kind(transition.seen);
                candidates.dots.retain(|&dot| self.plane.kind(dot) == kind);
            }
            candidates.dots
        } else {
            self.landings(from, transition, aside)
        };
        dots.sort_unstable();
        dots.dedup();
        dots.retain(|&dot| dot != transition.to);
        dots
    }

    fn landings(&self, from: DotId, transition: &Transition, aside: f64) -> Vec<DotId> {
        let is_backward = transition.movement == Movement::Backward;
        let (first, second) = (self.plane.dot(from), self.plane.dot(transition.seen));
        let Some(slide) = Slide::of_pair(first, second, is_backward) else { return Vec::new() };
        let lands = |quantile| slide.moved_aside(quantile * aside).lands(self.plane, self.window);
        quantiles().filter_map(lands).map(|landing| landing.dot).collect()
    }

    /// Returns the verification with recoveries for all signs, or `None` unless conditions 2 and 3 hold.
    fn recoverable(&self, target: DotId, mistaken: &[DotId], plain: Verification) -> Option<Verification> {
        let mut ways = vec![plain];
        let signs = self.signs(mistaken);
        if signs.len() > MOST_SIGNS {
            return None;
        }
        for sign in signs {
            let same: Vec<_> = mistaken.iter().copied().filter(|&dot| self.sign(dot) == sign).collect();
            let corners: Vec<_> = Corner::ALL
                .into_iter()
                .filter(|corner| same.iter().all(|&dot| self.shows(dot, *corner, target)))
                .collect();
            let extended = ways.iter().flat_map(|way| {
                corners.iter().map(|&corner| way.recovering(sign, Recovery { corner, word: self.word }))
            });
            ways = extended.collect();
        }
        ways.into_iter().find(|way| mistaken.iter().all(|&dot| self.leads(dot, target, *way)))
    }

    /// Returns true if the target is visible in a quadrant of a dot.
    fn shows(&self, dot: DotId, quadrant: Corner, target: DotId) -> bool {
        let mut candidates = Candidates::default();
        candidates.find(self.plane, self.window, dot, quadrant);
        candidates.dots.contains(&target)
    }

    /// Returns the dot to which a recovery leads from another.
    pub fn next(&self, dot: DotId, recovery: Recovery) -> Option<DotId> {
        let mut candidates = Candidates::default();
        candidates.find(self.plane, self.window, dot, recovery.corner);
        candidates.pick(recovery.word)
    }

    /// Checks condition 3: returns true if the recoveries lead from a dot to the target.
    fn leads(&self, from: DotId, target: DotId, verification: Verification) -> bool {
        let mut seen = Vec::new();
        let mut dot = from;
        while dot != target {
            let response = verification.response(self.signatures[dot as usize]);
            let (Response::Recover(recovery), false) = (response, seen.contains(&dot)) else { return false };
            seen.push(dot);
            let Some(next) = self.next(dot, recovery) else { return false };
            dot = next;
        }
        true
    }
}

#[cfg(test)]
mod tests;

//! Everything that the map-maker knows about a plane: the transitions, their reliability, and the surroundings of each dot.

use crate::description::Descriptor;
use crate::error::Error;
use crate::geometry::{Corner, Point, Window};
use crate::markers::LandmarkKind;
use crate::navigator::heading::bearing_deg;
use crate::plane::{DotId, Plane};
use crate::recovery::{Check, Recoveries};
use crate::reliability::Reliability;
use crate::signature::Signature;
use crate::transitions::{Kinds, Movement, Transition, Transitions};

/// Everything that the map-maker knows about a plane.
#[derive(Debug, Clone)]
pub struct Atlas {
    /// The dots at the positions where the map-maker sees them.
    pub plane: Plane,
    /// The navigator's window.
    pub window: Window,
    /// The transitions from landmark to landmark.
    pub transitions: Transitions,
    /// The surroundings of each dot.
    pub signatures: Vec<Signature>,
    /// −ln R of each transition, in the order of the transitions' numbers.
    pub unreliability: Vec<f32>,
    /// The error model that `unreliability` was computed with.
    pub reliability: Reliability,
    /// The word in recoveries for the right landmark.
    recovers_by: Descriptor,
    /// Bit mask of the corners at which a transition begins, for each landmark.
    exits: Vec<u8>,
}

impl Atlas {
    /// Surveys a plane for a navigator with this window and these errors.
    pub fn new(plane: Plane, window: Window, kinds: Kinds<'_>, reliability: Reliability) -> Self {
        let transitions = Transitions::new(&plane, window, kinds);
        let unreliability = transitions
            .all()
            .map(|(from, transition)| -reliability.of(&plane, window, from, transition).ln() as f32)
            .map(|cost| cost.max(0.0))
            .collect();
        let signatures = Signature::of_all(&plane, window);
        let exits = (0..plane.len() as DotId)
            .map(|dot| transitions.from(dot).iter().fold(0, |bits, entry| bits | 1 << entry.corner as u8))
            .collect();
        // A navigator that doesn't know the word of the paper's recoveries uses the first word that it does know.
        let knows_isolated = kinds.words.is_empty() || kinds.words.contains(&Descriptor::Isolated);
        let recovers_by = if knows_isolated { Descriptor::Isolated } else { kinds.words[0] };
        Self { plane, window, transitions, signatures, unreliability, reliability, recovers_by, exits }
    }

    /// Creates the search for recoveries on this plane.
    pub fn recoveries(&self) -> Result<Recoveries<'_>, Error> {
        Recoveries::new(&self.plane, self.window, &self.signatures, self.recovers_by)
    }

    /// Returns true if any transition begins at a landmark while it lies in a corner.
    pub fn leads_on(&self, landmark: DotId, corner: Corner) -> bool {
        self.exits[landmark as usize] >> corner as u8 & 1 == 1
    }

    /// Returns the reliable parkways and trajectories, which are those with at least this R (4.2.3).
    pub fn reliable(&self, least: f64) -> Transitions {
        let most = -least.max(f64::MIN_POSITIVE).ln();
        let mut number = 0;
        self.transitions.filtered(|_, _| {
            number += 1;
            f64::from(self.unreliability[number - 1]) <= most
        })
    }

    /// Returns the parkways and trajectories that pass a check, such as [`Check::is_detectable`] or [`Check::is_recoverable`]
    /// (4.2.4).
    pub fn checked(&self, keeps: impl Fn(Check) -> bool) -> Result<Transitions, Error> {
        let recoveries = self.recoveries()?;
        Ok(self.transitions.filtered(|from, transition| {
            let aside = self.reliability.aside(&self.plane, from, transition);
            keeps(recoveries.check(from, transition, aside))
        }))
    }

    /// Replaces the probabilities by simulated ones, one for each transition.
    pub fn with_probabilities(mut self, probabilities: &[f64]) -> Result<Self, Error> {
        if probabilities.len() != self.unreliability.len() {
            let found = probabilities.len() as f64;
            let what = "probabilities";
            return Err(Error::Parameter { what, expected: "one for each transition", found });
        }
        let least = crate::reliability::LEAST;
        self.unreliability = probabilities.iter().map(|p| -p.clamp(least, 1.0).ln() as f32).collect();
        Ok(self)
    }

    /// Returns true if a robot on land can drive straight from one position to another without coming too
    /// close to walls. Above a plane, this is always true.
    pub fn is_free(&self, from: Point, to: Point) -> bool {
        !self.plane.walls().bar(from, to)
    }

    /// Returns true if a robot on land can drive all the way around a landmark.
    pub fn is_free_around(&self, landmark: DotId) -> bool {
        let beside = Corner::ROUND.map(|corner| self.centre(landmark, corner));
        self.plane.walls().is_empty() || beside.windows(2).all(|pair| self.is_free(pair[0], pair[1]))
    }

    /// Returns the position of the window's centre at the end of a journey, which is over the last target or, on land, beside it.
    pub fn over(&self, from: Point, landmark: DotId) -> Point {
        let at = self.plane.dot(landmark);
        self.window.land.map_or(at, |_| from + self.window.over(at - from))
    }

    /// Returns true if a robot can drive to the target of a transition, either as the goal or to at least one side of it.
    pub fn can_be_driven(&self, from: DotId, transition: &Transition) -> bool {
        let at = self.centre(from, transition.corner);
        self.plane.walls().is_empty()
            || self.is_free(at, self.over(at, transition.to))
            || Corner::ALL.into_iter().any(|corner| self.is_free(at, self.centre(transition.to, corner)))
    }

    /// Returns the bearing that a map states for the visible landmark of a transition. A map states bearings if the landmark is
    /// identified by its bearing, or if the robot's heading is uncertain. Confusable landmarks have no single bearing, and the
    /// reference has none.
    pub fn bearing_deg(&self, from: DotId, transition: &Transition) -> Option<u16> {
        let is_stated = match transition.word {
            Descriptor::Any => true,
            Descriptor::Confusable | Descriptor::Same => false,
            _ => self.reliability.noise.heading_rad > 0.0,
        };
        is_stated.then(|| bearing_deg(self.plane.dot(transition.seen) - self.plane.dot(from)))
    }

    /// Returns the kind of landmark that a map names for a transition, if any.
    pub fn kind(&self, transition: &Transition) -> Option<LandmarkKind> {
        self.plane.kind(transition.seen).filter(|_| transition.by_kind)
    }

    /// Returns the position of the window's centre when a landmark lies in a corner.
    pub fn centre(&self, landmark: DotId, corner: Corner) -> Point {
        self.plane.dot(landmark) + self.window.centre_from(corner)
    }

    /// Returns the distance that the window's centre travels from the corner where a transition begins until the target is
    /// known, and the position of the centre at that moment.
    pub fn window_way(&self, from: DotId, transition: &Transition) -> (f64, Point) {
        let begin = self.centre(from, transition.corner);
        if transition.movement == Movement::Seek {
            return (0.0, begin);
        }
        let (first, second) = (self.plane.dot(from), self.plane.dot(transition.seen));
        let middle = (first + second) * 0.5;
        let along = (second - first).direction().unwrap_or_default();
        let along = if transition.movement == Movement::Backward { -along } else { along };
        let slide = f64::from(transition.slide);
        ((middle - begin).norm() + slide, middle + along * slide)
    }

    /// Returns the distance that the window's centre travels until the target lies in a corner or, without a corner, until the
    /// target is known.
    pub fn window_distance(&self, from: DotId, transition: &Transition, place: Option<Corner>) -> f64 {
        let (way, at) = self.window_way(from, transition);
        way + place.map_or(0.0, |corner| (self.centre(transition.to, corner) - at).norm())
    }

    /// Returns the distance from dot to dot.
    pub fn landmark_distance(&self, from: DotId, transition: &Transition) -> f64 {
        (self.plane.dot(transition.to) - self.plane.dot(from)).norm()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::uniform;
    use crate::traversal::Noise;

    fn atlas() -> Atlas {
        let window = Window::new(100.0, 15.0).unwrap();
        let noise = Noise { map_sigma: 0.0, ..Noise::of_sigma(2.0) };
        Atlas::new(uniform(150, 1000.0, 9).unwrap(), window, Kinds::PAPER, Reliability::fitted(noise))
    }

    #[test]
    fn a_higher_threshold_leaves_fewer_reliable_parkways() {
        let atlas = atlas();
        let counts = [0.0, 0.8, 0.95, 1.0].map(|least| atlas.reliable(least).count());
        assert_eq!(counts[0], atlas.transitions.count());
        assert!(counts[0] > counts[1] && counts[1] > counts[2] && counts[2] > counts[3], "{counts:?}");
        // These include some of the obvious landmarks, but none of the crowded ones.
        assert!(atlas.reliable(0.95).all().all(|(_, entry)| entry.candidates == 1));
    }

    #[test]
    fn what_is_recoverable_is_detectable() {
        let atlas = atlas();
        let detectable = atlas.checked(Check::is_detectable).unwrap();
        let recoverable = atlas.checked(Check::is_recoverable).unwrap();
        let all = |some: &Transitions| some.all().map(|(from, entry)| (from, *entry)).collect::<Vec<_>>();
        let (all_detectable, all_recoverable) = (all(&detectable), all(&recoverable));
        assert!(all_recoverable.iter().all(|entry| all_detectable.contains(entry)));
        assert!(all_recoverable.len() < all_detectable.len());
        assert!(all_detectable.len() < atlas.transitions.count());
    }

    #[test]
    fn a_corner_leads_on_where_a_transition_begins() {
        let atlas = atlas();
        for dot in 0..150 {
            for corner in Corner::ALL {
                let begins = atlas.transitions.from(dot).iter().any(|entry| entry.corner == corner);
                assert_eq!(atlas.leads_on(dot, corner), begins);
            }
        }
    }
}

//! Alignments that are spread over steps: one for each rotation of the map that is possible.

use serde::{Deserialize, Serialize};
use sketchnav_mapping::alignment::{Anchor, Forbidden, Problem, Search, turn_by_walls, turns_by_walls};
use sketchnav_mapping::outline::SeenOutline;

use super::Explorer;
use super::paper::Paper;

/// An alignment that is being computed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Job {
    pub seen: SeenOutline,
    anchor: Option<Anchor>,
    /// The rotations to try, and the index of the one that is being tried.
    turns_rad: Vec<f64>,
    pub turn: usize,
    forbidden: Vec<Forbidden>,
    /// Cost of the best alignment, if this job computes a rival.
    pub best: Option<f64>,
    pub search: Search,
    /// The best alignment of the rotations tried so far, as its cost, the index of its rotation, and its start in the search.
    pub least: Option<(f64, usize, usize)>,
}

impl Job {
    /// Takes the result of the search with the current rotation into account. Returns true if there is another rotation to try,
    /// which is now the current one.
    pub fn turns_again(&mut self) -> bool {
        if let Some((cost, start)) = self.search.least()
            && self.least.is_none_or(|(least, ..)| cost < least)
        {
            self.least = Some((cost, self.turn, start));
        }
        let turns_again = self.turn + 1 < self.turns_rad.len();
        if turns_again {
            (self.turn, self.search) = (self.turn + 1, Search::default());
        }
        turns_again
    }

    /// Returns the alignment to compute with the current rotation.
    pub fn problem<'a>(&'a self, paper: &'a Paper, emphasis: &'a [f64]) -> Problem<'a> {
        Problem {
            drawn: &paper.outline,
            seen: &self.seen,
            turn_rad: self.turns_rad.get(self.turn).copied().unwrap_or_default(),
            anchor: self.anchor.as_ref(),
            emphasis,
            forbidden: &self.forbidden,
        }
    }
}

impl Explorer {
    /// Extracts the outline of what was seen and begins to align it.
    pub(super) fn begin_job(&mut self, mut forbidden: Vec<Forbidden>, best: Option<f64>) {
        self.take_survey();
        if self.shares.is_empty() {
            self.weigh_goal();
        }
        let (Some(paper), place) = (&self.paper, self.place()) else { return };
        let seen = match (&self.exploration.last, best) {
            // A rival must align the same outline as the alignment that it rivals.
            (Some((seen, _)), Some(_)) => seen.clone(),
            _ => SeenOutline::of_map(&self.survey, &self.exploration.shut, &paper.taking()),
        };
        if best.is_none() {
            (self.exploration.taken_at, self.exploration.doubt) = (Some(place), None);
        }
        let known = self.known();
        let turns_rad = match known.turn_rad {
            Some(guess_rad) => vec![turn_by_walls(&paper.outline, &seen, guess_rad)],
            None => turns_by_walls(&paper.outline, &seen),
        };
        let anchor = known.places.map(|[drawn, seen]| Anchor { drawn, seen, scale_m: paper.scale_m });
        forbidden.extend(&self.exploration.denied);
        self.exploration.job = Some(Job {
            seen,
            anchor,
            turns_rad,
            turn: 0,
            forbidden,
            best,
            search: Search::default(),
            least: None,
        });
        self.prepare_job();
    }

    /// Prepares the aligner for the job under way, if there is one.
    pub(super) fn prepare_job(&mut self) {
        let (Some(paper), Some(job)) = (&self.paper, &self.exploration.job) else { return };
        self.aligner.set(&self.weights, &job.problem(paper, &self.emphasis));
    }
}

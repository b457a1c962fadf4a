//! The custom map as a guide. Each entry says what to do about wrong landmarks (Park and Kender 1995, 5.5, 6.3).

use serde::{Deserialize, Serialize};

use super::guide::{Counts, Decision, Guide, Next, Order};
use super::{Outcome, Settings};
use crate::custom_map::{Branch, CustomMap, Entry, Recovery, Response, Verification};
use crate::plane::DotId;
use crate::signature::Signature;

/// What a navigator with a custom map remembers of a journey.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Progress {
    entry: u16,
    accepted: u16,
    meant: u16,
    recoveries: u16,
    /// Number of recoveries within the current entry.
    tries: u8,
}

impl Guide for CustomMap {
    type Memory = Progress;

    fn begin(&self) -> Progress {
        Progress::default()
    }

    fn order(&self, progress: &Progress) -> Order {
        let Entry { kind, word, bearing_deg, trajectory, verification, .. } = *self.current(progress);
        let looks_around = verification.is_some_and(Verification::looks_around);
        Order { kind, word, bearing_deg, trajectory, looks_around }
    }

    fn attained(&self, progress: &mut Progress, seen: Signature, settings: &Settings) -> Decision {
        let signs = self.current(progress).verification;
        let response = signs.map_or(Response::Correct, |signs| signs.response(seen));
        let decision = self.follow(progress, response, settings);
        if let (Response::Branch(branch), Decision::Adjust { .. }) = (response, decision) {
            progress.accepted = progress.accepted.saturating_add(1);
            progress.meant = branch.entry.saturating_sub(1);
        }
        decision
    }

    fn nothing(&self, progress: &mut Progress, settings: &Settings) -> Decision {
        match self.current(progress).verification.and_then(Verification::without_landmark) {
            Some(way) => self.follow(progress, way.into(), settings),
            None => Decision::Finish(Outcome::CannotLocate),
        }
    }

    fn enter(&self, progress: &mut Progress, entry: u16) -> bool {
        progress.tries = 0;
        let exists = usize::from(entry) < self.entries().len();
        if exists {
            progress.entry = entry;
        }
        exists
    }

    fn counts(&self, progress: &Progress) -> Counts {
        let Progress { entry, accepted, meant, recoveries, .. } = *progress;
        Counts { entry, accepted, meant, recoveries }
    }

    fn landmarks(&self) -> usize {
        self.entries().len()
    }

    fn goal(&self) -> usize {
        self.entries().len() - 1
    }

    fn is_right(&self, entry: u16, attained: DotId, meant: DotId) -> bool {
        CustomMap::is_right(self, entry.into(), &attained, &meant)
    }

    fn is_planned(&self, attained: &[DotId], meant: &[DotId], entries: &[u16]) -> bool {
        let mut pairs = attained.iter().zip(meant).zip(entries);
        (self.branches() || attained.len() == self.entries().len())
            && pairs.all(|((attained, meant), &entry)| self.is_right(entry.into(), attained, meant))
    }
}

impl CustomMap {
    fn current(&self, progress: &Progress) -> &Entry {
        &self.entries()[usize::from(progress.entry)]
    }

    /// Returns the number of the last entry, from 0.
    fn last_entry(&self) -> u16 {
        (self.entries().len() - 1) as u16
    }

    /// Accepts the landmark as right.
    fn accept(&self, progress: &mut Progress) -> Decision {
        progress.accepted += 1;
        match self.current(progress).place {
            Some(corner) => {
                progress.meant = progress.entry;
                Decision::Adjust { corner, next: Next::Entry(progress.entry + 1) }
            }
            None => {
                progress.meant = self.last_entry();
                Decision::Finish(Outcome::Arrived)
            }
        }
    }

    fn follow(&self, progress: &mut Progress, response: Response, settings: &Settings) -> Decision {
        let most = u16::from(settings.most_recoveries);
        match response {
            Response::Correct => self.accept(progress),
            Response::Recover(Recovery { corner, word }) if u16::from(progress.tries) < most => {
                progress.tries += 1;
                progress.recoveries = progress.recoveries.saturating_add(1);
                Decision::Adjust { corner, next: Next::Seek(word) }
            }
            Response::Branch(Branch { corner, entry })
                if progress.recoveries < most.saturating_mul(self.last_entry() + 1) =>
            {
                // A branch to the next entry has the same effect as a right landmark, so it doesn't count as a recovery.
                let turns = u16::from(entry != progress.entry + 1);
                progress.recoveries = progress.recoveries.saturating_add(turns);
                Decision::Adjust { corner, next: Next::Entry(entry) }
            }
            Response::Recover(_) | Response::Branch(_) | Response::Lost => Decision::Finish(Outcome::Lost),
        }
    }
}

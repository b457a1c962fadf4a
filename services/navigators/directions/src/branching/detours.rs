//! Branching maps on land, with detours around landmarks that are out of sight.
//!
//! On land, a map states bearings, and all landmarks in sight have different ones. A robot therefore hardly ever takes a wrong
//! landmark, but people may hide the right one. For each landmark that the straight map seeks, a branching map says how to continue
//! without it: by another path to the goal or back to the straight map, whichever comes first.

use crate::atlas::Atlas;
use crate::custom_map::{Branch, CustomMap, MOST_WAYS, Sign, Verification};
use crate::description::Descriptor;
use crate::error::Error;
use crate::geometry::Corner;
use crate::path::{Leg, Measure, Objective, Path, Start, Weights, best};
use crate::plan::{Plan, entry};
use crate::plane::DotId;

/// Costs of a detour for each window side of its length and for each of its entries, relative to its −ln R.
const DISTANCE: f64 = 0.01;
const ENTRY: f64 = 0.01;
/// The −ln R of transitions to the landmark that is out of sight. A path uses one of these only if there is no other.
const UNSEEN: f32 = 100.0;

/// Returns the straight plan with its detours, or `None` if there are none. The map has at most `most` entries.
pub fn detoured(atlas: &Atlas, straight: &Plan, most: usize) -> Result<Option<Plan>, Error> {
    let legs = &straight.path.legs;
    let Some(goal) = legs.last().map(|leg| leg.transition.to) else { return Ok(None) };
    let mut entries = straight.map.entries().to_vec();
    // Where each entry begins. The first one has no leg.
    let mut begins: Vec<Option<(DotId, Corner)>> =
        std::iter::once(None).chain(legs.iter().map(begin)).collect();
    for (index, leg) in (1..).zip(legs) {
        let signs = entries[index].verification.unwrap_or_default();
        // The last landmark itself is always known, and an entry has only so many signs.
        if leg.transition.word == Descriptor::Same || signs.ways().count() == MOST_WAYS {
            continue;
        }
        let Some(path) = around(atlas, leg, goal) else { continue };
        let entry_after = |leg: &Leg| {
            let at = Some((leg.transition.to, leg.place?));
            begins.iter().position(|begin| *begin == at).filter(|entry| *entry != index)
        };
        let joins = path.legs.iter().position(|leg| entry_after(leg).is_some());
        let detour = &path.legs[..joins.map_or(path.legs.len(), |last| last + 1)];
        if entries.len() + detour.len() > most {
            continue;
        }
        let mut added: Vec<_> = detour.iter().map(|leg| entry(atlas, leg, None)).collect();
        if let Some((last, leg)) = added.last_mut().zip(detour.last())
            && let Some((corner, to)) = leg.place.zip(entry_after(leg))
        {
            let branch = Branch { corner, entry: to as u16 };
            (last.verification, last.place) =
                (Some(Verification::default().branching(Sign::Other, branch)), None);
        }
        let branch = Branch { corner: detour[0].transition.corner, entry: entries.len() as u16 };
        entries[index].verification = Some(signs.branching(Sign::Nothing, branch));
        entries.extend(added);
        begins.extend(detour.iter().map(begin));
    }
    if begins.len() == legs.len() + 1 {
        return Ok(None);
    }
    let landmarks = begins[1..].iter().flatten().map(|(landmark, _)| *landmark).chain([goal]).collect();
    let map = CustomMap::new(entries)?.starting_among(straight.map.around().clone());
    Ok(Some(Plan { map, landmarks, probability: None, weakest: None, ..straight.clone() }))
}

fn begin(leg: &Leg) -> Option<(DotId, Corner)> {
    Some((leg.from, leg.transition.corner))
}

/// Returns the best path to the goal for a robot at the beginning of a leg that does not see the leg's landmark, or `None` if every
/// path begins by seeking that landmark.
fn around(atlas: &Atlas, leg: &Leg, goal: DotId) -> Option<Path> {
    let mut without = atlas.clone();
    for number in atlas.transitions.numbers(leg.from) {
        if atlas.transitions.number(number).seen == leg.transition.seen {
            without.unreliability[number as usize] = UNSEEN;
        }
    }
    let centre = atlas.centre(leg.from, leg.transition.corner);
    let start = Start { centre, landmark: leg.from, faces_anywhere: false };
    let weights =
        Weights { distance: DISTANCE / atlas.window.side, unreliability: 1.0, entries: ENTRY, slides: 0.0 };
    let path = best(&without, start, goal, Measure::Windows, Objective::Sum(weights)).ok()?;
    Some(path).filter(|path| path.unreliability < f64::from(UNSEEN))
}

//! Cuts the outline of a region into walls, doors and gaps.

use std::collections::BTreeMap;

use sketchnav_mapping::outline::{Place, arc_lengths, minus, resampled, smoothed, unit};

use super::floor::{Door, Ground, Kind, Outline, Token};
use super::partition::Partition;

/// Length of an outline, in cells, below which it is ignored.
const LEAST_OUTLINE: usize = 12;
/// Length, in cells, below which a gap between walls, or a wall between two stretches of the same kind, is ignored.
const LEAST_RUN: usize = 4;

/// The outline of a region and the kinds of cells along it.
pub struct Border<'a> {
    pub partition: &'a Partition,
    pub outline: &'a Outline,
    pub ground: &'a Ground<'a>,
    pub label: u16,
    pub doors: &'a [Door],
    pub door_at: &'a BTreeMap<usize, u16>,
}

/// Adjacent cells of an outline that are of the same kind.
struct Run {
    first: usize,
    length: usize,
    kind: Kind,
}

/// Returns the outline as tokens, with walls cut into pieces of equal length, or nothing if the outline is too short.
pub fn tokens(border: &Border<'_>) -> Vec<Token> {
    let cells = &border.outline.cells;
    let count = cells.len();
    if count < LEAST_OUTLINE {
        return Vec::new();
    }
    let mut kinds: Vec<_> = cells.iter().map(|at| border.kind(*at)).collect();
    settle(&mut kinds);
    let places: Vec<Place> = cells.iter().map(|at| at.map(|part| part as f64 + 0.5)).collect();
    let piece = border.ground.piece;
    let smooth = smoothed(&places, (piece / 6.0).max(1.5));
    let mut tokens = Vec::new();
    for Run { first, length, kind } in runs(&kinds) {
        let indices = || (0..length).map(|k| (first + k) % count);
        if kind == Kind::Wall {
            let line: Vec<_> = indices().map(|k| smooth[k]).collect();
            add_wall(&line, piece, &mut tokens);
            continue;
        }
        let sum = indices().fold([0.0; 2], |sum, k| [sum[0] + places[k][0], sum[1] + places[k][1]]);
        let chord = minus(places[(first + length - 1) % count], places[first]);
        let narrow = border.ground.narrow;
        let is_narrow = (length as f64) < 2.5 * narrow && chord[0].hypot(chord[1]) < narrow;
        let kind = if kind == Kind::Gap && is_narrow { Kind::NarrowGap } else { kind };
        tokens.push(Token { kind, place: sum.map(|part| part / length as f64), direction: unit(chord) });
    }
    tokens
}

impl Border<'_> {
    /// Returns the kind of stretch that a cell of the outline belongs to.
    fn kind(&self, at: [i64; 2]) -> Kind {
        let [column, row] = at.map(|part| part as usize);
        let cell = row * self.partition.width + column;
        let door = self.door_at.get(&cell).map(|door| (*door, self.doors[*door as usize].rooms));
        match door {
            Some((door, [a, b])) if a == self.label => Kind::Door { door, beyond: b },
            Some((door, [a, b])) if b == self.label => Kind::Door { door, beyond: a },
            _ if self.outline.cuts.contains(cell) => Kind::Cut,
            _ if self.ground.walls.is_some_and(|walls| !walls.contains(cell)) => Kind::Gap,
            _ => Kind::Wall,
        }
    }
}

/// Removes short gaps, and short walls between stretches of the same kind.
fn settle(kinds: &mut [Kind]) {
    let count = kinds.len();
    for Run { first, length, kind } in runs(kinds) {
        if kind == Kind::Gap && length < LEAST_RUN {
            (0..length).for_each(|k| kinds[(first + k) % count] = Kind::Wall);
        }
    }
    for Run { first, length, kind } in runs(kinds) {
        let (before, after) = (kinds[(first + count - 1) % count], kinds[(first + length) % count]);
        if kind == Kind::Wall && length < LEAST_RUN && before == after {
            (0..length).for_each(|k| kinds[(first + k) % count] = before);
        }
    }
}

fn runs(kinds: &[Kind]) -> Vec<Run> {
    let count = kinds.len();
    let changes: Vec<_> = (0..count).filter(|&k| kinds[k] != kinds[(k + count - 1) % count]).collect();
    if changes.is_empty() {
        return vec![Run { first: 0, length: count, kind: kinds[0] }];
    }
    let run = |k: usize| {
        let (first, next) = (changes[k], changes[(k + 1) % changes.len()]);
        Run { first, length: (next + count - first - 1) % count + 1, kind: kinds[first] }
    };
    (0..changes.len()).map(run).collect()
}

fn add_wall(line: &[Place], piece: f64, tokens: &mut Vec<Token>) {
    const LEAST: f64 = 0.3;
    const REACH: f64 = 0.6;
    let along = arc_lengths(line);
    let length = along[along.len() - 1];
    if length < LEAST * piece {
        return;
    }
    let count = ((length / piece).round() as usize).max(1);
    let middle = |k: usize| (k as f64 + 0.5) * length / count as f64;
    let at = |shift: f64| resampled(line, &along, (0..count).map(|k| middle(k) + shift));
    let (places, before, after) = (at(0.0), at(-REACH * piece), at(REACH * piece));
    for ((place, before), after) in places.iter().zip(before).zip(after) {
        tokens.push(Token { kind: Kind::Wall, place: *place, direction: unit(minus(after, before)) });
    }
}

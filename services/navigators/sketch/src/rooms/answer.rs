//! The place of the goal according to regions and doors, and its certainty.

use std::collections::{BTreeMap, BTreeSet};

use rand_pcg::Pcg64Mcg;
use sketchnav_mapping::outline::{Place, minus};

use super::floor::{Floor, Kind};
use super::joint::{Forbidden, Joint};
use super::lattice::Lattice;
use super::pairing::{Pair, Step, drawn};

/// Number of alignments that are drawn.
const SAMPLES: usize = 40;
/// Initial state of the random number generator, so that equal floors result in equal answers.
const SEED: u128 = 0x2545_f491_4f6c_dd1d;
/// Share of the weight around the goal that must have different partners in a rival.
const DECIDING: f64 = 0.7;
/// Distance, in metres, within which pieces of wall around the goal have about the same weight.
const AROUND_M: f64 = 0.3;
/// Weight of a stretch of a region other than the goal's.
const OTHER_ROOM: f64 = 0.3;
/// Bounds of the local scale of the drawing around the goal.
const SCALES: [f64; 2] = [0.2, 5.0];

/// A possible place of the goal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothesis {
    /// The region of the map.
    pub room: u16,
    /// The goal's place in the map, in metres, or `None` if too little of its surroundings has a partner.
    pub place: Option<Place>,
    /// The middle of the gap beyond which the goal lies, in metres, or `None` if it does not lie beyond one.
    pub gap: Option<Place>,
    /// Share of the alignments that locate the goal here, from 0 to 1.
    pub share: f64,
    /// Standard deviation of the place over these alignments, in metres.
    pub spread_m: f64,
}

/// Numbers of doors with and without partners.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Doors {
    /// Doors of the drawing that have a partner in the map.
    pub matched: u32,
    /// Doors of the drawing that have none, although their position was seen in the map.
    pub only_drawn: u32,
    /// Doors of the map that have none.
    pub only_seen: u32,
}

impl Doors {
    /// Returns the share of all doors that have a partner, or 1 without doors.
    pub fn share_matched(&self) -> f64 {
        let all = self.matched + self.only_drawn + self.only_seen;
        if all == 0 { 1.0 } else { f64::from(self.matched) / f64::from(all) }
    }
}

/// The place of the goal.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// The possible places of the goal, the most probable first.
    pub hypotheses: Vec<Hypothesis>,
    /// Additional cost of the best alignment that locates the goal elsewhere. `None` if the goal is not located.
    pub margin: Option<f64>,
    /// The doors in one alignment, which is the best one for the first regions' outlines and random otherwise.
    pub doors: Doors,
    /// Pairs of regions of the drawing and of the map in the same alignment. A region of the drawing has at most one partner.
    pub regions: Vec<[u16; 2]>,
    /// The goal's place in the map according to each alignment that locates it, in metres.
    pub places: Vec<Place>,
}

impl Answer {
    /// Returns the share of all alignments that locate the goal within a distance of a place of the map, both in metres.
    pub fn share_near(&self, place: Place, within_m: f64) -> f64 {
        let is_near = |other: &&Place| {
            let off = minus(**other, place);
            off[0].hypot(off[1]) <= within_m
        };
        self.places.iter().filter(is_near).count() as f64 / SAMPLES as f64
    }
}

/// The place of the goal according to one alignment.
enum Found {
    Room { room: u16, place: Option<Place>, gap: Option<Place>, deciding: Forbidden },
    Gap { room: u16, gap: Place },
}

/// Aligns a map with a drawing and locates a goal of the drawing, given in its pixels, in the map. Returns `None` if the goal
/// cannot be reached through doors of the drawing.
pub fn locate(drawing: &Floor, map: &Floor, goal: Place) -> Option<Answer> {
    let room = drawing.room_at(goal)?;
    let way = drawing.way_to(room)?;
    let on_way: Vec<_> = way.iter().map(|(door, _)| *door).collect();
    let nothing = Forbidden::new();
    let joint = Joint::new([drawing, map], on_way.clone(), &nothing);
    let asked = Asked { joint: &joint, goal: drawing.frame.of_place(goal), room, way };
    let mut random = Pcg64Mcg::new(SEED);
    let found: Vec<_> = (0..SAMPLES).filter_map(|_| asked.sample(&mut random)).collect();
    let mut answer = summary(map, &found);
    (answer.doors, answer.regions) = asked.passed(&mut random);
    let best = answer.hypotheses.first().map(|best| (best.room, best.place.is_some()));
    let deciding = found.iter().find_map(|found| match found {
        Found::Room { room, deciding, .. } if best == Some((*room, true)) && !deciding.is_empty() => {
            Some(deciding)
        }
        _ => None,
    });
    answer.margin = deciding.map(|deciding| {
        let rival = Joint::new([drawing, map], on_way, deciding);
        f64::from(rival.energy() - joint.energy())
    });
    Some(answer)
}

/// Groups the alignments by their place of the goal.
fn summary(map: &Floor, found: &[Found]) -> Answer {
    let mut groups: BTreeMap<(u16, Option<[i64; 2]>), Vec<&Found>> = BTreeMap::new();
    for one in found {
        let key = match one {
            Found::Room { room, .. } => (*room, None),
            Found::Gap { room, gap } => (*room, Some(gap.map(|part| (part * 10.0).round() as i64))),
        };
        groups.entry(key).or_default().push(one);
    }
    let mut hypotheses: Vec<_> =
        groups.iter().map(|((room, _), group)| hypothesis(map, *room, group)).collect();
    hypotheses.sort_by(|a, b| b.share.total_cmp(&a.share));
    let place = |found: &Found| match found {
        Found::Room { place, .. } => place.map(|place| map.frame.to_place(place)),
        Found::Gap { .. } => None,
    };
    let places = found.iter().filter_map(place).collect();
    Answer { hypotheses, margin: None, doors: Doors::default(), regions: Vec::new(), places }
}

fn hypothesis(map: &Floor, room: u16, group: &[&Found]) -> Hypothesis {
    let (mut places, mut gaps) = (Vec::new(), Vec::new());
    for found in group {
        match found {
            Found::Room { place, gap, .. } => {
                places.extend(*place);
                gaps.extend(*gap);
            }
            Found::Gap { gap, .. } => gaps.push(*gap),
        }
    }
    let to_map = |place: Place| map.frame.to_place(place);
    Hypothesis {
        room,
        place: (!places.is_empty()).then(|| to_map([0, 1].map(|k| median(places.iter().map(|at| at[k]))))),
        gap: gaps.get(gaps.len() / 2).copied().map(to_map),
        share: group.len() as f64 / SAMPLES as f64,
        spread_m: [0, 1].map(|k| deviation(places.iter().map(|at| at[k]))).into_iter().fold(0.0, f64::max),
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<_> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn deviation(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / count;
    (values.map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
}

/// A goal and the alignment that locates it.
struct Asked<'a> {
    joint: &'a Joint<'a>,
    /// The goal in the frame of the drawing's floor.
    goal: Place,
    /// The goal's region.
    room: u16,
    /// The doors on the way to the goal, each with the region that it leads to.
    way: Vec<(u16, u16)>,
}

impl Asked<'_> {
    /// Draws an alignment at random and follows the drawing's doors to the goal.
    fn sample(&self, random: &mut Pcg64Mcg) -> Option<Found> {
        let mut index = self.joint.roots[drawn(self.joint.root_energies(), random)?];
        let mut passed = 0;
        loop {
            let ([a, b], pairing) = self.joint.at(index);
            let pairs = pairing.draw(a, b, random);
            let advanced = || pairs.iter().filter(|pair| pair.step != Step::Seen);
            let rooms: BTreeSet<_> = advanced().map(|pair| a.nodes[pair.drawn].room).collect();
            let is_entered = |k: usize| match k.checked_sub(1) {
                Some(before) => rooms.contains(&self.way[before].1),
                None => rooms.contains(&self.joint.floors[0].home),
            };
            let last = (passed..=self.way.len()).rev().find(|k| is_entered(*k)).unwrap_or(passed);
            if last == self.way.len() || rooms.contains(&self.room) {
                return Some(self.place([a, b], &pairs));
            }
            let (door, beyond) = self.way[last];
            let kind = Kind::Door { door, beyond };
            let pair = advanced().find(|pair| a.nodes[pair.drawn].token.kind == kind)?;
            let seen = &b.nodes[pair.seen];
            match (pair.step, seen.token.kind) {
                (Step::Both, Kind::Door { door: other, beyond: behind }) => {
                    let Some(next) = self.joint.beyond([(door, beyond), (other, behind)]) else {
                        return Some(Found::Room {
                            room: behind,
                            place: None,
                            gap: None,
                            deciding: Forbidden::new(),
                        });
                    };
                    (index, passed) = (next, last + 1);
                }
                (Step::Both, _) | (Step::Drawn, Kind::Gap | Kind::Cut) if pair.seen > 0 => {
                    return Some(Found::Gap { room: seen.room, gap: seen.token.place });
                }
                _ => return None,
            }
        }
    }

    /// Locates the goal by the partners of the walls and doors around it.
    fn place(&self, [a, b]: [&Lattice; 2], pairs: &[Pair]) -> Found {
        let around = Around::new(a, b, pairs, self.goal, self.room);
        let home = self.joint.floors[1].home;
        let room = around.votes.iter().max_by(|x, y| x.1.total_cmp(y.1)).map_or(home, |(room, _)| *room);
        let gap = around.gap(b);
        let place = around.place(self.goal);
        let deciding = if place.is_some() { around.deciding(a) } else { Forbidden::new() };
        Found::Room { room, place, gap, deciding }
    }

    /// Counts the doors of an alignment, and pairs its regions.
    fn passed(&self, random: &mut Pcg64Mcg) -> (Doors, Vec<[u16; 2]>) {
        let mut doors = Doors::default();
        let mut votes: BTreeMap<u16, BTreeMap<u16, u32>> = BTreeMap::new();
        let energies = || self.joint.root_energies().enumerate();
        let best = energies().min_by(|x, y| x.1.total_cmp(&y.1)).map(|(k, _)| self.joint.roots[k]);
        let (mut waiting, mut seen) = (Vec::from_iter(best), BTreeSet::new());
        while let Some(index) = waiting.pop() {
            let ([a, b], pairing) = self.joint.at(index);
            for Pair { drawn, seen: partner, step } in pairing.draw(a, b, random) {
                if step == Step::Both {
                    let [own, other] = [a.nodes[drawn].room, b.nodes[partner].room];
                    *votes.entry(own).or_default().entry(other).or_insert(0) += 1;
                }
                match (step, a.nodes[drawn].token.kind, b.nodes[partner].token.kind) {
                    (Step::Drawn, Kind::Door { .. }, kind) if !matches!(kind, Kind::Gap | Kind::Cut) => {
                        doors.only_drawn += 1
                    }
                    (Step::Seen, _, Kind::Door { .. }) => doors.only_seen += 1,
                    (Step::Both, Kind::Door { door, beyond }, Kind::Door { door: other, beyond: behind }) => {
                        doors.matched += 1;
                        let next = self.joint.beyond([(door, beyond), (other, behind)]);
                        waiting.extend(next.filter(|next| seen.insert(*next)));
                    }
                    (Step::Both, Kind::Door { .. }, _) => doors.matched += 1,
                    _ => {}
                }
            }
        }
        let most = |(own, others): (u16, BTreeMap<u16, u32>)| {
            others.into_iter().max_by_key(|(_, count)| *count).map(|(other, _)| [own, other])
        };
        (doors, votes.into_iter().filter_map(most).collect())
    }
}

/// The surroundings of a goal and their partners.
struct Around {
    /// Place, weight and mean partner of each node of the drawing that has a partner.
    known: Vec<(usize, Place, f64, Place)>,
    /// Weight of the nodes that lie beyond each gap, by the gap's node.
    hidden: BTreeMap<usize, f64>,
    /// Weight of the nodes with partners in each region.
    votes: BTreeMap<u16, f64>,
}

impl Around {
    fn new(a: &Lattice, b: &Lattice, pairs: &[Pair], goal: Place, room: u16) -> Self {
        let weight = |k: usize| {
            let node = &a.nodes[k];
            let off = minus(node.token.place, goal);
            let own = if node.room == room { 1.0 } else { OTHER_ROOM };
            own / (off[0].hypot(off[1]) + AROUND_M).powi(2)
        };
        let mut sums: BTreeMap<usize, (Place, f64)> = BTreeMap::new();
        let mut gaps = BTreeMap::new();
        let mut votes = BTreeMap::new();
        for &Pair { drawn, seen, step } in pairs.iter().filter(|pair| pair.drawn > 0 && pair.seen > 0) {
            let kinds = [a.nodes[drawn].token.kind, b.nodes[seen].token.kind];
            let is_partner = step == Step::Both || kinds == [Kind::Wall; 2];
            if is_partner {
                let (sum, count) = sums.entry(drawn).or_default();
                let place = b.nodes[seen].token.place;
                (*sum, *count) = ([sum[0] + place[0], sum[1] + place[1]], *count + 1.0);
            } else if step == Step::Drawn && matches!(kinds[1], Kind::Gap | Kind::Cut) {
                gaps.insert(drawn, seen);
            }
            if step == Step::Both || step == Step::Drawn && kinds[1] == Kind::Wall {
                *votes.entry(b.nodes[seen].room).or_insert(0.0) += weight(drawn);
            }
        }
        let mut hidden = BTreeMap::new();
        for (drawn, gap) in gaps.iter().filter(|(drawn, _)| !sums.contains_key(drawn)) {
            *hidden.entry(*gap).or_insert(0.0) += weight(*drawn);
        }
        let known = sums
            .into_iter()
            .map(|(k, (sum, count))| (k, a.nodes[k].token.place, weight(k), sum.map(|part| part / count)));
        Self { known: known.collect(), hidden, votes }
    }

    /// Returns the gap beyond which most of the surroundings lie.
    fn gap(&self, b: &Lattice) -> Option<Place> {
        let heaviest = self.hidden.iter().max_by(|x, y| x.1.total_cmp(y.1));
        heaviest.map(|(gap, _)| b.nodes[*gap].token.place)
    }

    /// Returns the goal's place by a weighted regression of the partners along each axis.
    fn place(&self, goal: Place) -> Option<Place> {
        const LEAST_KNOWN: usize = 3;
        /// Weight of the scale 1, as a share of the variance, and in square metres.
        const PRIOR: [f64; 2] = [0.05, 0.003];
        let whole: f64 = self.known.iter().map(|(_, _, weight, _)| weight).sum();
        if self.known.len() < LEAST_KNOWN {
            return None;
        }
        Some([0, 1].map(|axis| {
            let mean = |of: &dyn Fn(Place, Place) -> f64| {
                let sum: f64 =
                    self.known.iter().map(|(_, drawn, weight, seen)| weight * of(*drawn, *seen)).sum();
                sum / whole
            };
            let (x, y) = (mean(&|drawn, _| drawn[axis] - goal[axis]), mean(&|_, seen| seen[axis]));
            let variance = mean(&|drawn, _| (drawn[axis] - goal[axis] - x).powi(2));
            let covariance = mean(&|drawn, seen| (drawn[axis] - goal[axis] - x) * (seen[axis] - y));
            let prior = PRIOR[0] * variance + PRIOR[1];
            y - ((covariance + prior) / (variance + prior)).clamp(SCALES[0], SCALES[1]) * x
        }))
    }

    /// Returns the partners that determine the place of the goal, which are those with most of the weight.
    fn deciding(&self, a: &Lattice) -> Forbidden {
        let mut order: Vec<_> = self.known.iter().collect();
        order.sort_by(|x, y| y.2.total_cmp(&x.2));
        let whole: f64 = order.iter().map(|(_, _, weight, _)| weight).sum();
        let mut so_far = 0.0;
        let heaviest = order.into_iter().take_while(|(_, _, weight, _)| {
            let is_in = so_far <= DECIDING * whole;
            so_far += weight;
            is_in
        });
        heaviest.map(|(k, _, _, seen)| ((a.nodes[*k].room, a.nodes[*k].index), *seen)).collect()
    }
}

//! The joint alignment of two floors. The outline of the region with the start is aligned with that of the drawing's, and a pair of
//! doors costs what the regions beyond them cost, and so on.

use std::collections::BTreeMap;
use std::sync::Arc;

use sketchnav_mapping::outline::Place;

use super::floor::{Floor, Kind};
use super::lattice::{Lattice, Node, Opening};
use super::pairing::{self, NEVER, Pairing, Problem, misfit, passages};

/// Number of doors that are passed one after the other.
const DEPTH: u32 = 7;
/// Number of ways in which the outlines of the two first regions are turned against each other.
const TURNS: usize = 8;
/// Number of energies after which no further regions are aligned. What is beyond them costs nothing. The first regions are always
/// aligned.
pub const MOST_ENERGIES: usize = 4_000_000;
/// Difference in direction of two doors, as 1 − cos, up to which they may be the same.
const MOST_TURNED: f32 = 0.6;
/// Gain of a pair of doors, and of a door whose partner is a gap as narrow as a door.
const GAIN: [f32; 2] = [1.0, 0.7];
/// Cost of a door without a partner, in the drawing and in the map, if there is a whole room beyond it.
const ALONE: [f64; 2] = [3.0, 2.5];
/// Area, in square metres, from which on a room is whole.
const WHOLE_M2: f64 = 4.0;
/// Additional cost of a door of the drawing without a partner on the way to the goal.
const ON_WAY: f32 = 5.0;

/// The regions beyond a door of each floor: the door and the region, of the drawing and of the map.
pub type Beyond = [(u16, u16); 2];

/// A stretch of the drawing, by region and index, and the place in the map that its partner must be away from.
pub type Forbidden = BTreeMap<(u16, u16), Place>;

/// A pair of aligned regions, by the indices of their lattices.
#[derive(Debug)]
struct Aligned {
    lattices: [usize; 2],
    pairing: Pairing,
}

/// A pair of regions that is being aligned. The regions beyond its doors are aligned first.
#[derive(Debug)]
struct Open {
    lattices: [usize; 2],
    origins: [Place; 2],
    /// Number of doors that may still be passed.
    depth: u32,
    /// The doors through which the regions were entered, unless these are the first ones.
    entered: Option<Beyond>,
    /// The doors of the drawing, and the doors and narrow gaps of the map.
    passages: [Vec<Node>; 2],
    /// The energies of the first pairs of these.
    doors: Vec<f32>,
    /// The alignment, once all energies of doors are known.
    pairing: Option<Pairing>,
}

/// The joint alignment of a drawing and a map.
#[derive(Debug)]
pub struct Joint {
    pub floors: [Arc<Floor>; 2],
    forbidden: Forbidden,
    /// Doors of the drawing on the way to the goal.
    pub on_way: Vec<u16>,
    lattices: Vec<Lattice>,
    known: BTreeMap<(usize, u16, Opening), usize>,
    aligned: Vec<Aligned>,
    beyond: BTreeMap<Beyond, usize>,
    /// The first regions, turned against each other in several ways, as indices of `aligned`.
    pub roots: Vec<usize>,
    /// Pairs of first regions that are not aligned yet, by their lattices, the last one first.
    homes: Vec<[usize; 2]>,
    /// What is being aligned. Each is needed for the one before it.
    open: Vec<Open>,
    energies: usize,
}

impl Joint {
    /// Prepares the alignment of two floors, of which the first is the drawing. The doors `on_way` of the drawing lead to the goal.
    pub fn new(floors: [Arc<Floor>; 2], on_way: Vec<u16>, forbidden: Forbidden) -> Self {
        let mut joint = Self {
            floors,
            forbidden,
            on_way,
            lattices: Vec::new(),
            known: BTreeMap::new(),
            aligned: Vec::new(),
            beyond: BTreeMap::new(),
            roots: Vec::new(),
            homes: Vec::new(),
            open: Vec::new(),
            energies: 0,
        };
        joint.prepare_homes();
        joint
    }

    /// Computes about `work` energies, and takes what was done off it. Returns true once everything is aligned.
    pub fn advance(&mut self, work: &mut usize) -> bool {
        while *work > 0 {
            let Some(mut open) = self.open.pop() else {
                let Some(home) = self.homes.pop() else { return true };
                let starts = [0, 1].map(|side| self.floors[side].start);
                let open = self.opened(home, starts, DEPTH, None);
                self.open.push(open);
                continue;
            };
            if let Some(next) = self.rate_doors(&mut open) {
                self.open.extend([open, next]);
                continue;
            }
            let [a, b] = open.lattices.map(|k| &self.lattices[k]);
            let doors = &mut open.doors;
            let pairing = open.pairing.get_or_insert_with(|| {
                let forbidden = |node: &Node| self.forbidden.get(&(node.room, node.index)).copied();
                Pairing::new(Problem {
                    lattices: [a, b],
                    origins: open.origins,
                    forbidden: a.nodes.iter().map(forbidden).collect(),
                    alone: [self.alone(0, a), self.alone(1, b)],
                    doors: std::mem::take(doors),
                })
            });
            if pairing.fill(a, b, work) {
                self.close(open);
            } else {
                self.open.push(open);
            }
        }
        self.open.is_empty() && self.homes.is_empty()
    }

    /// Returns the free energy of the best turn, or infinity if there is none.
    pub fn energy(&self) -> f32 {
        self.root_energies().fold(f32::INFINITY, f32::min)
    }

    /// Returns the number of energies that are kept.
    #[cfg(test)]
    pub fn size(&self) -> usize {
        self.energies
    }

    /// Returns the free energy of each of the roots.
    pub fn root_energies(&self) -> impl Iterator<Item = f32> + '_ {
        self.roots.iter().map(|root| self.aligned[*root].pairing.energy())
    }

    /// Returns the lattices and the alignment of an index.
    pub fn at(&self, index: usize) -> ([&Lattice; 2], &Pairing) {
        let Aligned { lattices, pairing } = &self.aligned[index];
        (lattices.map(|k| &self.lattices[k]), pairing)
    }

    /// Returns the index of the alignment of the regions beyond a pair of doors, if there is one.
    pub fn beyond(&self, doors: Beyond) -> Option<usize> {
        self.beyond.get(&doors).copied()
    }

    fn prepare_homes(&mut self) {
        let [drawn, seen] = [0, 1].map(|side| Arc::clone(&self.floors[side]));
        let (walls, starts) = (
            [&drawn, &seen].map(|floor| &floor.rooms[floor.home as usize].tokens),
            [drawn.start, seen.start],
        );
        let near = |place: Place| (place[0] - seen.start[0]).hypot(place[1] - seen.start[1]);
        let is_wall = |k: &usize| walls[1][*k].kind == Kind::Wall;
        let nearest = (0..walls[1].len())
            .filter(is_wall)
            .min_by(|a, b| near(walls[1][*a].place).total_cmp(&near(walls[1][*b].place)));
        let first = nearest.unwrap_or_default();
        let b = self.lattice(1, seen.home, Opening::Stretch(first as u16));
        for turn in turns(walls[0], starts, &walls[1][first]) {
            let a = self.lattice(0, drawn.home, Opening::Stretch(turn as u16));
            self.homes.push([a, b]);
        }
        self.homes.reverse();
    }

    fn lattice(&mut self, side: usize, room: u16, opening: Opening) -> usize {
        let next = self.lattices.len();
        let index = *self.known.entry((side, room, opening)).or_insert(next);
        if index == next {
            self.lattices.push(Lattice::new(&self.floors[side], room, opening));
        }
        index
    }

    /// Begins to align two regions.
    fn opened(
        &mut self,
        lattices: [usize; 2],
        origins: [Place; 2],
        depth: u32,
        entered: Option<Beyond>,
    ) -> Open {
        let [a, b] = lattices.map(|k| &self.lattices[k]);
        self.energies += a.len() * b.len();
        let nodes =
            |lattice: &Lattice, with_gaps| passages(lattice, with_gaps).map(|k| lattice.nodes[k]).collect();
        let passages = [nodes(a, false), nodes(b, true)];
        Open { lattices, origins, depth, entered, passages, doors: Vec::new(), pairing: None }
    }

    /// Keeps a finished alignment.
    fn close(&mut self, open: Open) {
        let index = self.aligned.len();
        match open.entered {
            Some(doors) => drop(self.beyond.insert(doors, index)),
            None => self.roots.push(index),
        }
        self.aligned.extend(open.pairing.map(|pairing| Aligned { lattices: open.lattices, pairing }));
    }

    /// Adds the energies of pairs of doors until all are known, or the regions beyond a pair must be aligned first, which are then
    /// returned.
    fn rate_doors(&mut self, open: &mut Open) -> Option<Open> {
        let [drawn, seen] = [0, 1].map(|side| open.passages[side].len());
        while open.pairing.is_none() && open.doors.len() < drawn * seen {
            let k = open.doors.len();
            let (a, b) = (&open.passages[0][k / seen], &open.passages[1][k % seen]);
            let turned = misfit(a, b);
            let energy = match (a.token.kind, b.token.kind) {
                _ if turned > MOST_TURNED => NEVER,
                (Kind::Door { door, beyond }, Kind::Door { door: other, beyond: behind }) => {
                    match self.pass([(door, beyond), (other, behind)], open) {
                        Ok(energy) => turned - GAIN[0] + energy,
                        Err(next) => return Some(next),
                    }
                }
                _ => turned - GAIN[1],
            };
            open.doors.push(energy);
        }
        None
    }

    /// Returns the energy of the regions beyond two doors of regions that are being aligned, or these as what must be aligned first.
    /// The energy is kept as it was first needed, although it would be another one if fewer doors had been passed before, or others.
    fn pass(&mut self, doors: Beyond, from: &Open) -> Result<f32, Open> {
        if let Some(index) = self.beyond.get(&doors) {
            return Ok(self.aligned[*index].pairing.energy());
        }
        let depth = from.depth - 1;
        let is_passing =
            |open: &Open| open.entered.is_some_and(|other| other[0] == doors[0] || other[1] == doors[1]);
        if depth == 0 || is_passing(from) || self.open.iter().any(is_passing) {
            return Ok(0.0);
        }
        let lattices = [0, 1].map(|side| self.lattice(side, doors[side].1, Opening::Door(doors[side].0)));
        let size: usize = lattices.iter().map(|k| self.lattices[*k].len()).product();
        if self.energies + size > MOST_ENERGIES {
            return Ok(0.0);
        }
        let origins = [0, 1].map(|side| self.floors[side].doors[doors[side].0 as usize].place);
        Err(self.opened(lattices, origins, depth, Some(doors)))
    }

    fn alone(&self, side: usize, lattice: &Lattice) -> Vec<f32> {
        let of = |kind: Kind| match kind {
            Kind::Door { door, beyond } => {
                let area_m2 = self.floors[side].rooms[beyond as usize].area_m2;
                let on_way = if side == 0 && self.on_way.contains(&door) { ON_WAY } else { 0.0 };
                (ALONE[side] * (area_m2 / WHOLE_M2).min(1.0)) as f32 + on_way
            }
            _ => 0.0,
        };
        lattice.nodes.iter().map(|node| of(node.token.kind)).collect()
    }
}

/// Returns the stretches of the drawing's first region that are most like a stretch of the map's, as indices.
fn turns(tokens: &[super::floor::Token], starts: [Place; 2], seen: &super::floor::Token) -> Vec<usize> {
    let likeness = |k: usize| match tokens[k].kind {
        Kind::Wall => pairing::unlikeness([&tokens[k], seen], starts),
        _ => NEVER,
    };
    let mut order: Vec<_> = (0..tokens.len()).map(|k| (likeness(k), k)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut turns: Vec<usize> = Vec::new();
    for (_, k) in order {
        let is_apart = |other: &usize| {
            let off = other.abs_diff(k);
            off.min(tokens.len() - off) >= 2
        };
        if turns.len() < TURNS && turns.iter().all(is_apart) {
            turns.push(k);
        }
    }
    turns
}

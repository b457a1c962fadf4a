//! The joint alignment of two floors. The outlines of the two regions with the start are aligned, and the cost of a pair of doors
//! is that of aligning the regions beyond them, recursively.

use std::collections::BTreeMap;

use sketchnav_mapping::outline::Place;

use super::floor::{Floor, Kind};
use super::lattice::{Lattice, Opening};
use super::pairing::{self, NEVER, Pairing, Problem, misfit, passages};

/// Maximum number of doors passed in a row.
const DEPTH: u32 = 7;
/// Number of relative rotations to try for the outlines of the first two regions.
const TURNS: usize = 8;
/// Number of energies after which no further regions are aligned, and everything beyond costs nothing. The first regions are always
/// aligned.
pub const MOST_ENERGIES: usize = 4_000_000;
/// Maximum difference in direction, as 1 − cos, of two doors that may be the same.
const MOST_TURNED: f32 = 0.6;
/// Gain of a pair of doors, and of a door whose partner is a gap as narrow as a door.
const GAIN: [f32; 2] = [1.0, 0.7];
/// Cost of a door without a partner, in the drawing and in the map, if there is a whole room beyond it.
const ALONE: [f64; 2] = [3.0, 2.5];
/// Minimum area, in square metres, of a whole room.
const WHOLE_M2: f64 = 4.0;
/// Additional cost of a door of the drawing without a partner on the way to the goal.
const ON_WAY: f32 = 5.0;

/// The regions beyond a door of each floor: the door and the region, of the drawing and of the map.
pub type Beyond = [(u16, u16); 2];

/// Stretches of the drawing, by region and index, with a place in the map that their partner must not be near.
pub type Forbidden = BTreeMap<(u16, u16), Place>;

/// A pair of aligned regions, by the indices of their lattices.
#[derive(Debug)]
struct Aligned {
    lattices: [usize; 2],
    pairing: Pairing,
}

/// The joint alignment of a drawing and a map.
#[derive(Debug)]
pub struct Joint<'a> {
    pub floors: [&'a Floor; 2],
    forbidden: &'a Forbidden,
    /// Doors of the drawing on the way to the goal.
    on_way: Vec<u16>,
    lattices: Vec<Lattice>,
    known: BTreeMap<(usize, u16, Opening), usize>,
    aligned: Vec<Aligned>,
    beyond: BTreeMap<Beyond, usize>,
    /// The first regions in several relative rotations, as indices of `aligned`.
    pub roots: Vec<usize>,
    /// The doors passed so far.
    passing: Vec<Beyond>,
    energies: usize,
}

impl<'a> Joint<'a> {
    /// Aligns two floors, of which the first is the drawing. `on_way` lists the drawing's doors on the way to the goal.
    pub fn new(floors: [&'a Floor; 2], on_way: Vec<u16>, forbidden: &'a Forbidden) -> Self {
        let mut joint = Self {
            floors,
            forbidden,
            on_way,
            lattices: Vec::new(),
            known: BTreeMap::new(),
            aligned: Vec::new(),
            beyond: BTreeMap::new(),
            roots: Vec::new(),
            passing: Vec::new(),
            energies: 0,
        };
        joint.align_homes();
        joint
    }

    /// Returns the free energy of the best rotation, or infinity if there is none.
    pub fn energy(&self) -> f32 {
        self.root_energies().fold(f32::INFINITY, f32::min)
    }

    /// Returns the number of stored energies.
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

    fn align_homes(&mut self) {
        let [drawn, seen] = self.floors;
        let (walls, starts) =
            ([drawn, seen].map(|floor| &floor.rooms[floor.home as usize].tokens), [drawn.start, seen.start]);
        let near = |place: Place| (place[0] - seen.start[0]).hypot(place[1] - seen.start[1]);
        let is_wall = |k: &usize| walls[1][*k].kind == Kind::Wall;
        let nearest = (0..walls[1].len())
            .filter(is_wall)
            .min_by(|a, b| near(walls[1][*a].place).total_cmp(&near(walls[1][*b].place)));
        let first = nearest.unwrap_or_default();
        let b = self.lattice(1, seen.home, Opening::Stretch(first as u16));
        for turn in turns(walls[0], starts, &walls[1][first]) {
            let a = self.lattice(0, drawn.home, Opening::Stretch(turn as u16));
            let aligned = self.align([a, b], starts, DEPTH);
            self.roots.push(self.aligned.len());
            self.aligned.push(aligned);
        }
    }

    fn lattice(&mut self, side: usize, room: u16, opening: Opening) -> usize {
        let next = self.lattices.len();
        let index = *self.known.entry((side, room, opening)).or_insert(next);
        if index == next {
            self.lattices.push(Lattice::new(self.floors[side], room, opening));
        }
        index
    }

    /// Returns the energy of the regions beyond two doors. The first value computed is stored and reused, although it depends on
    /// the doors passed before.
    fn pass(&mut self, doors: Beyond, depth: u32) -> f32 {
        if let Some(index) = self.beyond.get(&doors) {
            return self.aligned[*index].pairing.energy();
        }
        let is_passing = |other: &Beyond| other[0] == doors[0] || other[1] == doors[1];
        if depth == 0 || self.passing.iter().any(is_passing) {
            return 0.0;
        }
        let lattices = [0, 1].map(|side| self.lattice(side, doors[side].1, Opening::Door(doors[side].0)));
        let size: usize = lattices.iter().map(|k| self.lattices[*k].len()).product();
        if self.energies + size > MOST_ENERGIES {
            return 0.0;
        }
        self.passing.push(doors);
        let origins = [0, 1].map(|side| self.floors[side].doors[doors[side].0 as usize].place);
        let aligned = self.align(lattices, origins, depth);
        self.passing.pop();
        let energy = aligned.pairing.energy();
        self.beyond.insert(doors, self.aligned.len());
        self.aligned.push(aligned);
        energy
    }

    fn align(&mut self, lattices: [usize; 2], origins: [Place; 2], depth: u32) -> Aligned {
        let sizes = lattices.map(|k| self.lattices[k].len());
        self.energies += sizes[0] * sizes[1];
        let doors = self.doors(lattices, depth);
        let [a, b] = lattices.map(|k| &self.lattices[k]);
        let forbidden = a.nodes.iter().map(|node| self.forbidden.get(&(node.room, node.index)).copied());
        let problem = Problem {
            lattices: [a, b],
            origins,
            forbidden: forbidden.collect(),
            alone: [self.alone(0, a), self.alone(1, b)],
            doors,
        };
        Aligned { lattices, pairing: Pairing::new(problem) }
    }

    /// Returns the energies of all pairs of doors of two lattices.
    fn doors(&mut self, lattices: [usize; 2], depth: u32) -> Vec<f32> {
        let nodes = |side: usize, with_gaps| -> Vec<_> {
            let lattice = &self.lattices[lattices[side]];
            passages(lattice, with_gaps).map(|k| lattice.nodes[k]).collect()
        };
        let (drawn, seen) = (nodes(0, false), nodes(1, true));
        let mut energies = Vec::with_capacity(drawn.len() * seen.len());
        for a in &drawn {
            for b in &seen {
                let turned = misfit(a, b);
                energies.push(match (a.token.kind, b.token.kind) {
                    _ if turned > MOST_TURNED => NEVER,
                    (Kind::Door { door, beyond }, Kind::Door { door: other, beyond: behind }) => {
                        turned - GAIN[0] + self.pass([(door, beyond), (other, behind)], depth - 1)
                    }
                    _ => turned - GAIN[1],
                });
            }
        }
        energies
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

/// Returns the indices of those stretches of the drawing's first region that are most similar to a stretch of the map's.
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

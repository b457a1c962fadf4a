//! The alignment of two lattices by dynamic programming. It computes the free energy of all alignments instead of the cost of the
//! best one, so that alignments can be drawn at random in proportion to their weight.

use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use sketchnav_mapping::outline::{Place, minus, unit};

use super::floor::{Kind, Token};
use super::lattice::{Lattice, Node};

/// Energy of impossible alignments.
pub const NEVER: f32 = 1e9;
/// Energy difference that reduces the weight of an alignment by a factor of e.
const TEMPERATURE: f32 = 0.3;
/// Gain of a piece of wall with a partner, in each of the floors.
const GAIN_WALL: f32 = 0.3;
/// Cost of a piece of wall that shares its partner with others, in addition to that of the pair.
const SHARES: f32 = 0.12;
/// Cost of a stretch that has no partner.
const ALONE: f32 = 0.35;
/// Cost of a drawn wall, and of a drawn door, behind a gap.
const BEHIND_GAP: [f32; 2] = [0.03, 0.05];
/// Cost of a stretch of the drawing behind a gap as narrow as a door, and of such a gap that has no partner.
const BY_NARROW: [f32; 2] = [0.15, 0.1];
/// Weight of differences in bearing and in distance from where the lattices begin.
const BEARING: f32 = 0.5;
const DISTANCE: f32 = 0.1;
/// Maximum of the squared logarithm of the ratio of distances.
const MOST_DISTANCE: f32 = 4.0;
/// Distance, in metres, over which the weight of bearing and distance falls by a factor of e, and its share that does not fall.
const REACH_M: f64 = 4.0;
const SHARE_AFAR: f64 = 0.15;
/// Length, in metres, added to distances before they are compared.
const NEAR_M: f64 = 0.3;
/// Cost of a partner that is ruled out.
const FORBIDDEN: f32 = 5.0;
/// Distance, in metres, within which the partners around a forbidden one are forbidden, too.
pub const AWAY_M: f64 = 2.5;

/// A step of an alignment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// To the next stretch of both.
    Both,
    /// To the next stretch of the drawing, while the map stays at a stretch.
    Drawn,
    /// To the next stretch of the map, while the drawing stays at a stretch.
    Seen,
}

/// A node of each lattice, and how the alignment reached it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pair {
    pub drawn: usize,
    pub seen: usize,
    pub step: Step,
}

/// The contribution of a node to costs.
#[derive(Debug, Clone, Copy)]
struct Side {
    direction: [f32; 2],
    bearing: [f32; 2],
    log_distance: f32,
    /// Weight of bearing and distance. Only that of the map counts.
    weight: f32,
}

impl Side {
    fn of(token: &Token, origin: Place) -> Self {
        let off = minus(token.place, origin);
        let distance = off[0].hypot(off[1]);
        let single = |v: [f64; 2]| v.map(|part| part as f32);
        Self {
            direction: single(token.direction),
            bearing: single(unit(off)),
            log_distance: (distance + NEAR_M).ln() as f32,
            weight: ((-distance / REACH_M).exp() + SHARE_AFAR) as f32,
        }
    }

    /// Returns the dissimilarity of a piece of wall of the drawing and one of the map.
    fn unlike(&self, seen: &Self) -> f32 {
        let ratio = self.log_distance - seen.log_distance;
        let far = BEARING * apart(self.bearing, seen.bearing) + DISTANCE * (ratio * ratio).min(MOST_DISTANCE);
        apart(self.direction, seen.direction) + far * seen.weight
    }
}

fn apart(a: [f32; 2], b: [f32; 2]) -> f32 {
    1.0 - a[0] * b[0] - a[1] * b[1]
}

/// The alignments of two lattices.
#[derive(Debug, Clone)]
pub struct Pairing {
    sides: [Vec<Side>; 2],
    /// For each stretch of the drawing, a place that its partner must not be near.
    forbidden: Vec<Option<Place>>,
    /// Cost of each stretch without a partner.
    alone: [Vec<f32>; 2],
    /// Energy of each pair of doors, by the index of the doors in each lattice.
    doors: Vec<f32>,
    door_indices: [Vec<u16>; 2],
    door_count: usize,
    /// Free energy of all alignments up to each pair of nodes.
    energies: Vec<f32>,
}

/// The input for the alignment of two lattices.
pub struct Problem<'a> {
    pub lattices: [&'a Lattice; 2],
    /// The first cells of the lattices, in their floors.
    pub origins: [Place; 2],
    /// For each node of the drawing, a place that its partner must not be near.
    pub forbidden: Vec<Option<Place>>,
    /// Cost of each door of either floor without a partner, by node.
    pub alone: [Vec<f32>; 2],
    /// Energy of each pair of doors, in the order of the doors in both lattices.
    pub doors: Vec<f32>,
}

/// Returns the dissimilarity of a piece of wall of the drawing and one of the map, for regions that begin at `origins`.
pub fn unlikeness([drawn, seen]: [&Token; 2], origins: [Place; 2]) -> f32 {
    Side::of(drawn, origins[0]).unlike(&Side::of(seen, origins[1]))
}

/// Returns the nodes of a lattice that can be the partner of a door.
pub fn passages(lattice: &Lattice, with_gaps: bool) -> impl Iterator<Item = usize> + '_ {
    let is_passage = move |node: &Node| match node.token.kind {
        Kind::Door { .. } => true,
        Kind::NarrowGap => with_gaps,
        _ => false,
    };
    (1..lattice.len() - 1).filter(move |k| is_passage(&lattice.nodes[*k]))
}

/// Returns the difference in direction of two stretches, as 1 − cos.
pub fn misfit(a: &Node, b: &Node) -> f32 {
    let single = |node: &Node| node.token.direction.map(|part| part as f32);
    apart(single(a), single(b))
}

impl Pairing {
    pub fn new(problem: Problem<'_>) -> Self {
        let Problem { lattices: [a, b], origins, forbidden, alone, doors } = problem;
        let sides = |lattice: &Lattice, origin| {
            lattice.nodes.iter().map(|node| Side::of(&node.token, origin)).collect()
        };
        let indices = |lattice: &Lattice, with_gaps| {
            let mut indices = vec![u16::MAX; lattice.len()];
            passages(lattice, with_gaps).zip(0..).for_each(|(node, k)| indices[node] = k);
            indices
        };
        let mut pairing = Self {
            sides: [sides(a, origins[0]), sides(b, origins[1])],
            forbidden,
            alone,
            doors,
            door_indices: [indices(a, false), indices(b, true)],
            door_count: passages(b, true).count(),
            energies: vec![NEVER; a.len() * b.len()],
        };
        pairing.fill(a, b);
        pairing
    }

    /// Returns the free energy of all alignments.
    pub fn energy(&self) -> f32 {
        self.energies[self.energies.len() - 1]
    }

    fn at(&self, i: usize, j: usize) -> f32 {
        self.energies[i * self.sides[1].len() + j]
    }

    /// Returns the cost of two pieces of wall.
    pub fn cost(&self, b: &Lattice, i: usize, j: usize) -> f32 {
        let is_forbidden = self.forbidden[i].is_some_and(|place| {
            let off = minus(place, b.nodes[j].token.place);
            off[0].hypot(off[1]) < AWAY_M
        });
        let forbidden = if is_forbidden { FORBIDDEN } else { 0.0 };
        self.sides[0][i].unlike(&self.sides[1][j]) + forbidden
    }

    /// Returns the energy of advancing both to `i` and `j`, only the drawing to `i`, and only the map to `j`.
    fn steps(&self, a: &Lattice, b: &Lattice, i: usize, j: usize) -> [f32; 3] {
        let (drawn, seen) = (a.nodes[i].token.kind, b.nodes[j].token.kind);
        let is_pair = i > 0 && j > 0;
        let of_walls = is_pair && drawn == Kind::Wall && seen == Kind::Wall;
        let cost = if of_walls { self.cost(b, i, j) } else { 0.0 };
        let both = match (drawn, seen) {
            _ if of_walls => 2.0 * (cost - GAIN_WALL / 2.0),
            (Kind::Door { .. }, Kind::Door { .. } | Kind::NarrowGap) if is_pair => {
                let [x, y] = [self.door_indices[0][i], self.door_indices[1][j]].map(usize::from);
                self.doors[x * self.door_count + y]
            }
            _ => NEVER,
        };
        let only_drawn = match (drawn, seen) {
            _ if i == 0 => NEVER,
            (Kind::Cut, _) => 0.0,
            (Kind::Door { .. }, Kind::Gap | Kind::Cut) => BEHIND_GAP[1],
            (_, Kind::Gap | Kind::Cut) => BEHIND_GAP[0],
            (Kind::Door { .. }, _) => self.alone[0][i],
            (_, Kind::Wall) if j > 0 => self.shared(b, i, j),
            (_, Kind::NarrowGap) => BY_NARROW[0],
            _ => ALONE,
        };
        let only_seen = match (seen, drawn) {
            _ if j == 0 => NEVER,
            (Kind::Gap | Kind::Cut, _) => 0.0,
            (Kind::Door { .. }, _) => self.alone[1][j],
            (Kind::NarrowGap, _) => BY_NARROW[1],
            (_, Kind::Wall) if i > 0 => self.shared(b, i, j) - GAIN_WALL,
            (_, Kind::Cut) => 0.0,
            _ => ALONE,
        };
        [both, only_drawn, only_seen]
    }

    fn shared(&self, b: &Lattice, i: usize, j: usize) -> f32 {
        self.cost(b, i, j) + SHARES
    }

    /// Calls `each` with the energy of every way to reach a pair of nodes.
    fn ways(
        &self,
        a: &Lattice,
        b: &Lattice,
        i: usize,
        j: usize,
        mut each: impl FnMut(f32, usize, usize, Step),
    ) {
        let [both, only_drawn, only_seen] = self.steps(a, b, i, j);
        let (own, other) = (a.nodes[i].price, b.nodes[j].price);
        for &before in a.before(i) {
            let before = usize::from(before);
            each(self.at(before, j) + only_drawn + own, before, j, Step::Drawn);
            if both < NEVER {
                for &seen in b.before(j) {
                    let seen = usize::from(seen);
                    each(self.at(before, seen) + both + own + other, before, seen, Step::Both);
                }
            }
        }
        for &before in b.before(j) {
            let before = usize::from(before);
            each(self.at(i, before) + only_seen + other, i, before, Step::Seen);
        }
    }

    fn fill(&mut self, a: &Lattice, b: &Lattice) {
        self.energies[0] = 0.0;
        for i in 0..a.len() - 1 {
            for j in 0..b.len() - 1 {
                if i + j > 0 {
                    let mut sum = NEVER;
                    self.ways(a, b, i, j, |energy, _, _, _| sum = joined(sum, energy));
                    self.energies[i * b.len() + j] = sum;
                }
            }
        }
        let mut sum = NEVER;
        self.ends(a, b, |energy, _, _| sum = joined(sum, energy));
        let last = self.energies.len() - 1;
        self.energies[last] = sum;
    }

    /// Calls `each` with the energy of every pair of last nodes.
    fn ends(&self, a: &Lattice, b: &Lattice, mut each: impl FnMut(f32, usize, usize)) {
        for &drawn in a.before(a.len() - 1) {
            for &seen in b.before(b.len() - 1) {
                let (drawn, seen) = (usize::from(drawn), usize::from(seen));
                each(self.at(drawn, seen), drawn, seen);
            }
        }
    }

    /// Draws an alignment at random, in proportion to its weight. The pairs are in reverse order.
    pub fn draw(&self, a: &Lattice, b: &Lattice, random: &mut Pcg64Mcg) -> Vec<Pair> {
        let mut pairs = Vec::new();
        let mut choice = Choice::none();
        self.ends(a, b, |energy, i, j| choice.offer(energy, (i, j, Step::Both), random));
        let Some((mut i, mut j, _)) = choice.chosen else { return pairs };
        while i + j > 0 {
            let mut choice = Choice::none();
            self.ways(a, b, i, j, |energy, i, j, step| choice.offer(energy, (i, j, step), random));
            let Some((before, seen, step)) = choice.chosen else { break };
            pairs.push(Pair { drawn: i, seen: j, step });
            (i, j) = (before, seen);
        }
        pairs
    }
}

/// Returns the free energy of two alternatives.
fn joined(a: f32, b: f32) -> f32 {
    /// Difference, in units of the temperature, beyond which the worse alternative has no weight.
    const MOST: f32 = 9.0;
    let (low, high) = if a < b { (a, b) } else { (b, a) };
    let apart = (high - low) / TEMPERATURE;
    if apart > MOST { low } else { low - TEMPERATURE * (-apart).exp().ln_1p() }
}

/// A random choice among a sequence of alternatives.
#[derive(Debug)]
struct Choice<T> {
    chosen: Option<T>,
    /// Free energy of all alternatives so far.
    energy: f32,
}

impl<T> Choice<T> {
    fn none() -> Self {
        Self { chosen: None, energy: NEVER }
    }

    fn offer(&mut self, energy: f32, alternative: T, random: &mut Pcg64Mcg) {
        if energy >= NEVER {
            return;
        }
        let sum = joined(self.energy, energy);
        let share = ((sum - energy) / TEMPERATURE).exp();
        if self.chosen.is_none() || random.random::<f32>() < share {
            self.chosen = Some(alternative);
        }
        self.energy = sum;
    }
}

/// Returns an index drawn at random in proportion to the weight of each energy. `None` if there are none.
pub fn drawn(energies: impl Iterator<Item = f32>, random: &mut Pcg64Mcg) -> Option<usize> {
    let mut choice = Choice::none();
    energies.enumerate().for_each(|(k, energy)| choice.offer(energy, k, random));
    choice.chosen
}

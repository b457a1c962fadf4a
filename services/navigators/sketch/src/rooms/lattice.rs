//! The outline of a region, cut open, as a lattice. A door that is hardly narrower than the regions beside it may be missing on the
//! other floor, so it is represented by one stretch or, at a cost, by the whole outline of the region beyond it.

use sketchnav_mapping::outline::Place;

use super::floor::{Floor, Kind, Token};

/// Maximum number of stretches of a lattice.
const MOST_NODES: usize = 300;
/// Maximum number of predecessors of a stretch. The last stretch of a lattice may have more.
const MOST_BEFORE: usize = 4;
/// Maximum depth of regions entered through others.
const MOST_ENTERED: usize = 2;
/// Share of a door's width below which the region beyond it is always separate.
const WEAK: f64 = 0.45;

/// A stretch in a lattice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    pub token: Token,
    /// The region whose outline contains the stretch.
    pub room: u16,
    /// Index of the stretch in that outline.
    pub index: u16,
    /// Cost of passing the node, namely that of the door through which its region was entered.
    pub price: f32,
}

/// A lattice of stretches in topological order. Node 0 is the source and the last one the sink.
#[derive(Debug, Clone, Default)]
pub struct Lattice {
    pub nodes: Vec<Node>,
    /// The predecessors of each node.
    before: Vec<[u16; 2 * MOST_BEFORE]>,
    counts: Vec<u8>,
}

/// The position at which the outline of a region is cut open.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Opening {
    /// At a door, which is left out.
    Door(u16),
    /// Before a stretch, by its index.
    Stretch(u16),
}

impl Lattice {
    /// Returns the lattice of a region.
    pub fn new(floor: &Floor, room: u16, opening: Opening) -> Self {
        let mut lattice = Self::default();
        let ends = lattice.push(source(room), &[]);
        let tokens = &floor.rooms[room as usize].tokens;
        let (order, entry) = match opening {
            Opening::Door(door) => (after_door(tokens, door).unwrap_or_default(), Some(door)),
            Opening::Stretch(first) => {
                ((0..tokens.len()).map(|k| (k + usize::from(first)) % tokens.len()).collect(), None)
            }
        };
        let ends = lattice.build(floor, &order, ends, &mut vec![room], entry, 0.0);
        lattice.push(source(room), &ends);
        lattice
    }

    /// Returns the number of nodes, including source and sink.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Returns the predecessors of a node.
    pub fn before(&self, node: usize) -> &[u16] {
        &self.before[node][..usize::from(self.counts[node])]
    }

    fn push(&mut self, node: Node, ends: &[u16]) -> Vec<u16> {
        let mut before = [0; 2 * MOST_BEFORE];
        let count = ends.len().min(before.len());
        before[..count].copy_from_slice(&ends[..count]);
        self.before.push(before);
        self.counts.push(count as u8);
        self.nodes.push(node);
        vec![self.nodes.len() as u16 - 1]
    }

    /// Appends stretches of the last visited region after the nodes `ends`, and returns the new last nodes.
    fn build(
        &mut self,
        floor: &Floor,
        order: &[usize],
        mut ends: Vec<u16>,
        visited: &mut Vec<u16>,
        entry: Option<u16>,
        mut price: f32,
    ) -> Vec<u16> {
        let room = visited[visited.len() - 1];
        for &index in order {
            let token = floor.rooms[room as usize].tokens[index];
            ends.truncate(MOST_BEFORE);
            let node = Node { token, room, index: index as u16, price: std::mem::take(&mut price) };
            let mut new = self.push(node, &ends);
            if let Kind::Door { door, beyond } = token.kind
                && visited.len() <= MOST_ENTERED
                && Some(door) != entry
                && !visited.contains(&beyond)
                && let Some(price) = price_of(floor.doors[door as usize].share)
            {
                let far = &floor.rooms[beyond as usize].tokens;
                let order = after_door(far, door).filter(|order| !order.is_empty());
                if let Some(order) = order.filter(|_| self.len() + far.len() < MOST_NODES) {
                    visited.push(beyond);
                    let mut through = self.build(floor, &order, ends, visited, entry, price);
                    visited.pop();
                    through.append(&mut new);
                    new = through;
                }
            }
            ends = new;
        }
        ends
    }
}

/// Returns the cost of treating a door as open, or `None` if it is too narrow for that.
fn price_of(share: f64) -> Option<f32> {
    const LEAST: f64 = 0.3;
    const MOST: f64 = 2.0;
    (share >= WEAK).then(|| (LEAST + 3.0 * (0.75 - share)).clamp(LEAST, MOST) as f32)
}

/// Returns the indices of an outline's stretches, starting just after a door and ending at that door.
fn after_door(tokens: &[Token], door: u16) -> Option<Vec<usize>> {
    let at = tokens.iter().position(|token| matches!(token.kind, Kind::Door { door: d, .. } if d == door))?;
    Some((1..tokens.len()).map(|k| (at + k) % tokens.len()).collect())
}

fn source(room: u16) -> Node {
    let token = Token { kind: Kind::Wall, place: Place::default(), direction: [1.0, 0.0] };
    Node { token, room, index: 0, price: 0.0 }
}

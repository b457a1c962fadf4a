//! A custom map as a graph. The nodes are the entries and the goal, and each edge leads from an entry to a node at which the
//! navigator may continue.

use super::{CustomMap, Entry, Sign, Verification};
use crate::geometry::Corner;

/// A node at which the navigator continues.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Node {
    /// The entry with this number, from 0.
    Entry(usize),
    /// The end of the journey, because the landmark is the goal.
    Goal,
}

impl Node {
    /// Returns the landmark of this node, given the landmarks of a map, one for each entry. The first entry has none, because it
    /// begins without a landmark.
    pub fn landmark<T>(self, landmarks: &[T]) -> Option<&T> {
        match self {
            Self::Entry(entry) => landmarks.get(entry.checked_sub(1)?),
            Self::Goal => landmarks.last(),
        }
    }
}

/// A way in which the navigator may continue from an entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// The entry, from 0.
    pub from: usize,
    /// The sign that leads here, or `None` if the entry accepts any landmark.
    pub sign: Option<Sign>,
    /// True if this edge is for the right landmark of the entry.
    pub is_right: bool,
    /// The corner to move the landmark to, if there is one.
    pub corner: Option<Corner>,
    /// The node at which the navigator continues.
    pub to: Node,
}

impl CustomMap {
    /// Returns the node after an entry, at which the navigator continues unless it takes a branch.
    pub fn next(&self, entry: usize) -> Node {
        if entry + 1 < self.entries().len() { Node::Entry(entry + 1) } else { Node::Goal }
    }

    /// Returns the edge for the right landmark of an entry, or `None` if the entry accepts no landmark.
    pub fn right(&self, entry: usize) -> Option<Edge> {
        let Entry { verification, place, .. } = *self.entries().get(entry)?;
        if !verification.is_none_or(Verification::accepts) {
            return None;
        }
        let to = if place.is_some() { self.next(entry) } else { Node::Goal };
        let sign = verification.and_then(Verification::expected);
        Some(Edge { from: entry, sign, is_right: true, corner: place, to })
    }

    /// Returns all edges from an entry: the edge for the right landmark, followed by the branches.
    pub fn edges(&self, entry: usize) -> impl Iterator<Item = Edge> {
        let signs = self.entries().get(entry).and_then(|entry| entry.verification);
        let branches = signs.into_iter().flat_map(Verification::branches).map(move |(sign, branch)| Edge {
            from: entry,
            sign: Some(sign),
            is_right: false,
            corner: Some(branch.corner),
            to: Node::Entry(branch.entry.into()),
        });
        self.right(entry).into_iter().chain(branches)
    }

    /// Returns the nodes on the path from `node` to the goal on which every landmark is the right one. The path ends early at an
    /// entry that accepts no landmark.
    pub fn path_from(&self, node: Node) -> Vec<Node> {
        let mut path = vec![node];
        while let Some(Node::Entry(entry)) = path.last().copied() {
            match self.right(entry).map(|edge| edge.to) {
                Some(to) if !path.contains(&to) => path.push(to),
                _ => break,
            }
        }
        path
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entry_leads_to_the_next_one_to_its_branches_or_to_the_goal() {
        let map: CustomMap =
            "(*, SW)\n(Isol, (2, NE, 4), (3, -), SW)\n(Isol, -)\n(Isol, (*, SE, 2), -)".parse().unwrap();
        let leads = |entry| map.edges(entry).map(|edge| (edge.is_right, edge.to)).collect::<Vec<_>>();
        assert_eq!(leads(0), [(true, Node::Entry(1))]);
        assert_eq!(leads(1), [(true, Node::Entry(2)), (false, Node::Entry(3))]);
        assert_eq!(leads(2), [(true, Node::Goal)]);
        assert_eq!(leads(3), [(false, Node::Entry(1))], "it takes no landmark as right");
        assert_eq!(map.path_from(Node::Entry(1)), [Node::Entry(1), Node::Entry(2), Node::Goal]);
        assert_eq!(map.path_from(Node::Entry(3)), [Node::Entry(3)]);
    }

    #[test]
    fn each_node_has_its_landmark() {
        let landmarks = ["a", "b", "c"];
        let of = |node: Node| node.landmark(&landmarks).copied();
        assert_eq!([0, 1, 2].map(|entry| of(Node::Entry(entry))), [None, Some("a"), Some("b")]);
        assert_eq!(of(Node::Goal), Some("c"));
        let map: CustomMap = "(*, SW)\n(Isol, SE)".parse().unwrap();
        assert_eq!(
            map.right(1).map(|edge| edge.to),
            Some(Node::Goal),
            "its last entry moves the goal to a corner"
        );
    }
}

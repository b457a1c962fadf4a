//! Reduced words: the edges that a line crosses, without crossings there and back.

/// A reduced word: the edges that a line crosses, without the crossings that undo each other. An edge is given by the indices of
/// its anchors; the four indices after the last anchor are the frame's corners.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Word(Vec<[usize; 2]>);

impl Word {
    /// The letters.
    pub fn letters(&self) -> &[[usize; 2]] {
        &self.0
    }

    /// Whether nothing is left.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Appends a letter. An edge crossed twice in a row was crossed there and back.
    pub(super) fn push(&mut self, edge: [usize; 2]) {
        if self.0.last() == Some(&edge) {
            self.0.pop();
        } else {
            self.0.push(edge);
        }
    }
}

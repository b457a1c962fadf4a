//! Reduced words: the sequence of edges that a line crosses, without crossings that undo each other.

/// The sequence of edges that a line crosses, without crossings that undo each other. An edge is given by the indices of
/// its anchors. The four indices after that of the last anchor are the corners of the frame.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Word(Vec<[usize; 2]>);

impl Word {
    /// Returns the letters of the word.
    pub fn letters(&self) -> &[[usize; 2]] {
        &self.0
    }

    /// Returns true if no letters remain.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Appends a letter. If it equals the last one, both are removed, since an edge that is crossed twice in a row is crossed there
    /// and back.
    pub(super) fn push(&mut self, edge: [usize; 2]) {
        if self.0.last() == Some(&edge) {
            self.0.pop();
        } else {
            self.0.push(edge);
        }
    }
}

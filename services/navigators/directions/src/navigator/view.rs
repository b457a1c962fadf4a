//! What a navigator sees at one moment.

use crate::geometry::Point;
use crate::markers::LandmarkKind;

/// A navigator's view at one moment. Positions are relative to the window's centre, in the window's axes.
#[derive(Debug, Clone, Copy, Default)]
pub struct View<'a> {
    /// The dots.
    pub dots: &'a [Point],
    /// The kinds of the dots, as far as they are known. The list may be shorter than that of the dots.
    pub kinds: &'a [Option<LandmarkKind>],
}

impl<'a> View<'a> {
    /// Creates a view of dots of unknown kinds.
    pub fn of(dots: &'a [Point]) -> Self {
        Self { dots, kinds: &[] }
    }

    /// Returns the kind of a dot, if it is known.
    pub fn kind(&self, dot: usize) -> Option<LandmarkKind> {
        self.kinds.get(dot).copied().flatten()
    }
}

/// A view with its own memory.
#[derive(Debug, Clone, Default)]
pub struct Seen {
    /// See [`View::dots`].
    pub dots: Vec<Point>,
    /// See [`View::kinds`].
    pub kinds: Vec<Option<LandmarkKind>>,
}

impl Seen {
    /// Removes all dots.
    pub fn clear(&mut self) {
        self.dots.clear();
        self.kinds.clear();
    }

    /// Adds a dot, with its kind if that is known.
    pub fn push(&mut self, dot: Point, kind: Option<LandmarkKind>) {
        self.dots.push(dot);
        self.kinds.push(kind);
    }

    /// Returns the view.
    pub fn view(&self) -> View<'_> {
        View { dots: &self.dots, kinds: &self.kinds }
    }
}

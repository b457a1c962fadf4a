//! Whether a path on the true floor passes the same things on the same sides as a route in the drawing, as often and in the same
//! order. This is the criterion of Boniardi et al. 2016, V-B: "homotopically equivalent with respect to the topology induced by the
//! sketch".
//!
//! The path and the route lie in different planes. They are joined by [`Anchor`]s: things of which both places are known, above all
//! the obstacles that the person drew. On the anchors we lay a triangulation whose straight edges cross nowhere in either plane.
//! Taking triangle to triangle is then one map from plane to plane, continuous both ways, that carries every anchor to its
//! counterpart. A path crosses the same edges in both planes, and the sequence of these edges is its *word*.
//!
//! The paper judges the path on the sketch, which is the estimated one ([`Correspondence::is_homotopic_on_sketch`]). An estimate
//! that is wrong in just the right manner excuses itself there, so the true path is judged, too
//! ([`Correspondence::is_homotopic`]).
//!
//! A word without two equal neighbours is reduced. All triangles are discs and all anchors are corners, so the plane without its
//! anchors retracts to the graph of adjacent triangles. A walk on a graph is determined up to homotopy by its reduced form. A
//! closed line can therefore be contracted without passing over an anchor exactly if its word reduces to nothing. That is the
//! fundamental (free) group, which is finer than winding numbers: those do not see the order. (S. Bhattacharya et al., "Topological
//! constraints in search-based robot path planning", 2012, compare h-signatures; D. Grigoriev and A. Slissenko, 1998, reduced words
//! of cuts.) The path and the route are closed to a single line by joining their ends in the drawing.
//!
//! Anchors at wall ends and corners do no harm, since no path leads around them except through a wall.
//!
//! Pure: points in, a word out, with no knowledge of recordings.

mod mesh;
mod word;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Point, Sketch, World};

use mesh::{Mesh, Plane};
pub use word::Word;

/// A thing of which both places are known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Anchor {
    /// On the true floor, metres.
    pub world: Point<World>,
    /// In the drawing, pixels.
    pub drawing: Point<Sketch>,
}

/// Why anchors do not join the planes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum CorrespondenceError {
    /// Fewer than three, or all on a line, or the drawing is the mirror image of the floor.
    #[error(
        "anchors: expected three that are not on a line and have the same orientation in both planes, found none among {0}"
    )]
    Flat(usize),
    /// The places contradict each other too much: no triangulation is valid in both planes.
    #[error(
        "anchors: expected a triangulation of {expected} triangles common to floor and drawing, found {found}"
    )]
    Torn {
        /// How many triangles there must be.
        expected: usize,
        /// How many were found.
        found: usize,
    },
}

/// The common triangulation of floor and drawing; see the module.
#[derive(Debug, Clone)]
pub struct Correspondence {
    floor: Plane<World>,
    drawing: Plane<Sketch>,
    mesh: Mesh,
}

impl Correspondence {
    /// Joins the planes by their anchors. A frame far outside is laid around these, mapped by the best affine map, so that every
    /// place near the anchors lies in some triangle.
    ///
    /// # Errors
    /// [`CorrespondenceError`] if the anchors are too few or contradict each other.
    pub fn new(anchors: &[Anchor]) -> Result<Self, CorrespondenceError> {
        let mut floor: Vec<_> = anchors.iter().map(|a| a.world).collect();
        let mut drawing: Vec<_> = anchors.iter().map(|a| a.drawing).collect();
        let affine = mesh::Affine::fit(&floor, &drawing).filter(|affine| affine.determinant() > 0.0);
        let affine = affine.ok_or(CorrespondenceError::Flat(anchors.len()))?;
        let frame = mesh::frame(&floor);
        drawing.extend(frame.iter().map(|&corner| affine.apply(corner)));
        floor.extend(frame);
        let (floor, drawing) = (Plane::new(floor), Plane::new(drawing));
        let mesh = Mesh::common(&floor, &drawing);
        let (expected, found) = (2 * floor.len() - 2 - frame.len(), mesh.triangle_count());
        if found == expected {
            Ok(Self { floor, drawing, mesh })
        } else {
            Err(CorrespondenceError::Torn { expected, found })
        }
    }

    /// Where a place of the floor lies in the drawing; `None` far from all anchors.
    pub fn to_drawing(&self, place: Point<World>) -> Option<Point<Sketch>> {
        self.mesh.carry(&self.floor, &self.drawing, place)
    }

    /// Where a place of the drawing lies on the floor; `None` far from all anchors.
    pub fn to_floor(&self, place: Point<Sketch>) -> Option<Point<World>> {
        self.mesh.carry(&self.drawing, &self.floor, place)
    }

    /// The reduced word of a closed line that runs along `way`, straight (in the drawing) to the end of `route`, back along it, and
    /// straight to the start of `way`. It is empty if the two are homotopic. `None` if one of them is empty or leaves the anchors'
    /// surroundings.
    pub fn difference(&self, way: &[Point<World>], route: &[Point<Sketch>]) -> Option<Word> {
        let (first, last) = (self.to_drawing(*way.first()?)?, self.to_drawing(*way.last()?)?);
        let back: Vec<_> = std::iter::once(last).chain(route.iter().rev().copied()).chain([first]).collect();
        route.first()?;
        let mut word = Word::default();
        self.mesh.write(&self.floor, way, &mut word);
        self.mesh.write(&self.drawing, &back, &mut word);
        Some(word)
    }

    /// Whether `way` and `route` are homotopic.
    pub fn is_homotopic(&self, way: &[Point<World>], route: &[Point<Sketch>]) -> bool {
        self.difference(way, route).is_some_and(|word| word.is_empty())
    }

    /// Whether a way in the drawing, such as that of the robot's estimate, and `route` are homotopic. Their ends are joined by
    /// straight lines. An empty one is homotopic to none.
    pub fn is_homotopic_on_sketch(&self, way: &[Point<Sketch>], route: &[Point<Sketch>]) -> bool {
        let (Some(&first), false) = (way.first(), route.is_empty()) else { return false };
        let closed: Vec<_> = way.iter().chain(route.iter().rev()).copied().chain([first]).collect();
        let mut word = Word::default();
        self.mesh.write(&self.drawing, &closed, &mut word);
        word.is_empty()
    }
}

#[cfg(test)]
mod tests;

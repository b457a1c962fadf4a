//! Decides whether a path on the true floor passes the same obstacles on the same sides as a route in the drawing, as often
//! and in the same order. This is the criterion of Boniardi et al. 2016, V-B: "homotopically equivalent with respect to the
//! topology induced by the sketch".
//!
//! The path and the route are in different planes. These are linked by [`Anchor`]s, which are points with known positions in both
//! planes, mainly the obstacles that the person drew. The anchors are the corners of a triangulation whose straight edges do not
//! cross in either plane. Mapping each triangle to its counterpart is then a map from plane to plane that is continuous in both
//! directions and maps every anchor to its counterpart. A path crosses the same edges in both planes, and the sequence of these
//! edges is its *word*.
//!
//! The paper judges the path on the sketch, that is, the estimated path ([`Correspondence::is_homotopic_on_sketch`]). Since a wrong
//! estimate may pass this test by chance, the true path is judged as well ([`Correspondence::is_homotopic`]).
//!
//! A word without two equal neighbours is reduced. All triangles are discs and all anchors are corners, so the plane
//! without its anchors retracts to the graph of adjacent triangles, in which a walk is determined up to homotopy by its
//! reduced form. A closed line can therefore be contracted without passing over an anchor if and only if its word reduces
//! to nothing. This is the fundamental (free) group, which is finer than winding numbers because those do not see the
//! order. (S. Bhattacharya et al., "Topological constraints in search-based robot path planning", 2012, compare
//! h-signatures; D. Grigoriev and A. Slissenko, 1998, reduced words of cuts.) The path and the route are closed to a single
//! line by joining their ends in the drawing.
//!
//! Anchors at the ends and corners of walls do no harm, since the only paths around them lead through a wall.
//!
//! This module is pure: points go in and a word comes out. It knows nothing about recordings.

mod mesh;
mod word;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Point, Sketch, World};

use mesh::{Mesh, Plane};
pub use word::Word;

/// A point whose position is known in both planes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Anchor {
    /// Position on the true floor, in metres.
    pub world: Point<World>,
    /// Position in the drawing, in pixels.
    pub drawing: Point<Sketch>,
}

/// Why anchors do not link the planes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum CorrespondenceError {
    /// There are fewer than three anchors, all of them lie on a line, or the drawing is a mirror image of the floor.
    #[error(
        "anchors: expected three that are not on a line and have the same orientation in both planes, found none among {0}"
    )]
    Flat(usize),
    /// The positions contradict each other too much, so no triangulation is valid in both planes.
    #[error(
        "anchors: expected a triangulation of {expected} triangles common to floor and drawing, found {found}"
    )]
    Torn {
        /// Number of triangles that are needed.
        expected: usize,
        /// Number of triangles that were found.
        found: usize,
    },
}

/// The common triangulation of floor and drawing, as described in the module documentation.
#[derive(Debug, Clone)]
pub struct Correspondence {
    floor: Plane<World>,
    drawing: Plane<Sketch>,
    mesh: Mesh,
}

impl Correspondence {
    /// Links the planes by their anchors. A distant frame is added around the anchors and mapped into the drawing by the best
    /// affine map, so that every point near the anchors is in some triangle.
    ///
    /// # Errors
    /// [`CorrespondenceError`] if there are too few anchors, or if they contradict each other.
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

    /// Maps a point on the floor to the drawing, or returns `None` if it is far from all anchors.
    pub fn to_drawing(&self, place: Point<World>) -> Option<Point<Sketch>> {
        self.mesh.carry(&self.floor, &self.drawing, place)
    }

    /// Maps a point in the drawing to the floor, or returns `None` if it is far from all anchors.
    pub fn to_floor(&self, place: Point<Sketch>) -> Option<Point<World>> {
        self.mesh.carry(&self.drawing, &self.floor, place)
    }

    /// Returns the reduced word of a closed line, which is empty if `way` and `route` are homotopic. The line runs along `way`,
    /// straight (in the drawing) to the end of `route`, back along `route`, and straight to the start of `way`. Returns `None`
    /// if either is empty, or if `way` begins or ends far from the anchors.
    pub fn difference(&self, way: &[Point<World>], route: &[Point<Sketch>]) -> Option<Word> {
        let (first, last) = (self.to_drawing(*way.first()?)?, self.to_drawing(*way.last()?)?);
        let back: Vec<_> = std::iter::once(last).chain(route.iter().rev().copied()).chain([first]).collect();
        route.first()?;
        let mut word = Word::default();
        self.mesh.write(&self.floor, way, &mut word);
        self.mesh.write(&self.drawing, &back, &mut word);
        Some(word)
    }

    /// Returns true if `way` and `route` are homotopic.
    pub fn is_homotopic(&self, way: &[Point<World>], route: &[Point<Sketch>]) -> bool {
        self.difference(way, route).is_some_and(|word| word.is_empty())
    }

    /// Returns true if `route` is homotopic to a path in the drawing, such as that of the robot's estimate. Their ends are joined
    /// by straight lines. An empty path or route is not homotopic to anything.
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

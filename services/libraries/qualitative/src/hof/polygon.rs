//! Objects as polygons of one or more rings, with the even-odd rule for what is inside.

use crate::error::Error;
use crate::geometry::Point;

/// A polygon of one or more rings. A point is inside if it is surrounded by an odd number of rings, so a ring inside
/// another is a hole and rings next to each other are separate parts. The same rule applies to a ring whose edges cross.
#[derive(Debug, Clone, PartialEq)]
pub struct Polygon {
    corners: Vec<Point>,
    /// The end of each ring in `corners`.
    ends: Vec<usize>,
}

impl Polygon {
    /// Creates a polygon of one ring from its corners, in either orientation.
    ///
    /// # Errors
    /// [`Error::Extent`] if there are fewer than three corners, or if all corners are on one line.
    pub fn new(corners: impl IntoIterator<Item = Point>) -> Result<Self, Error> {
        Self::from_rings([corners])
    }

    /// Creates a polygon of several rings.
    ///
    /// # Errors
    /// [`Error::Extent`] if there are no rings, or if a ring has fewer than three corners or has all its corners on one line.
    pub fn from_rings(
        rings: impl IntoIterator<Item = impl IntoIterator<Item = Point>>,
    ) -> Result<Self, Error> {
        let mut polygon = Self { corners: Vec::new(), ends: Vec::new() };
        for ring in rings {
            let begin = polygon.corners.len();
            polygon.corners.extend(ring);
            check(polygon.corners[begin..].iter().copied())?;
            polygon.ends.push(polygon.corners.len());
        }
        if polygon.ends.is_empty() { Err(no_extent()) } else { Ok(polygon) }
    }

    /// Replaces the polygon by one with a single ring, reusing its memory.
    ///
    /// # Errors
    /// Any error of [`Self::new`]. On error, the polygon is left unchanged.
    pub fn replace(
        &mut self,
        corners: impl IntoIterator<IntoIter = impl Iterator<Item = Point> + Clone>,
    ) -> Result<(), Error> {
        let corners = corners.into_iter();
        check(corners.clone())?;
        self.corners.clear();
        self.corners.extend(corners);
        self.ends.clear();
        self.ends.push(self.corners.len());
        Ok(())
    }

    /// Returns the corners of all rings, one ring after another.
    pub fn corners(&self) -> &[Point] {
        &self.corners
    }

    /// Returns the corners of each ring.
    pub fn rings(&self) -> impl Iterator<Item = &[Point]> {
        self.ranges().map(|[begin, end]| &self.corners[begin..end])
    }

    fn ranges(&self) -> impl Iterator<Item = [usize; 2]> {
        let begins = std::iter::once(0).chain(self.ends.iter().copied());
        begins.zip(&self.ends).map(|(begin, end)| [begin, *end])
    }

    /// Returns the edges as pairs of indices into [`Self::corners`].
    pub(super) fn edge_places(&self) -> impl Iterator<Item = [usize; 2]> {
        self.ranges()
            .flat_map(|[begin, end]| (begin..end).map(move |i| [i, if i + 1 == end { begin } else { i + 1 }]))
    }

    /// Returns the edges of all rings.
    pub fn edges(&self) -> impl Iterator<Item = [Point; 2]> {
        self.edge_places().map(|edge| edge.map(|i| self.corners[i]))
    }

    /// Returns true if a point is inside.
    pub fn contains(&self, at: Point) -> bool {
        let crossed = self.edges().filter(|[from, to]| {
            (from.y() > at.y()) != (to.y() > at.y()) && {
                let part = (at.y() - from.y()) / (to.y() - from.y());
                at.x() < from.x() + part * (to.x() - from.x())
            }
        });
        crossed.count() % 2 == 1
    }

    /// Returns the proximity: the minimum distance between a point of this object and a point of the other, or 0 if they overlap.
    pub fn distance(&self, other: &Self) -> f64 {
        let is_inside = |of: &Self, ring: &[Point]| of.contains(ring[0]);
        if other.rings().any(|ring| is_inside(self, ring)) || self.rings().any(|ring| is_inside(other, ring))
        {
            return 0.0;
        }
        let pairs = self.edges().flat_map(|a| other.edges().map(move |b| between_edges(a, b)));
        pairs.fold(f64::INFINITY, f64::min)
    }

    /// Returns the minimum distance from a point to this object, or 0 if the point is inside.
    pub fn distance_to(&self, at: Point) -> f64 {
        if self.contains(at) {
            return 0.0;
        }
        self.edges().map(|edge| to_edge(at, edge)).fold(f64::INFINITY, f64::min)
    }
}

const fn no_extent() -> Error {
    Error::Extent { what: "polygon", found: 0.0 }
}

/// Checks that a ring has three corners that do not lie on one line.
fn check(mut corners: impl Iterator<Item = Point> + Clone) -> Result<(), Error> {
    let Some(first) = corners.next() else { return Err(no_extent()) };
    let pairs = corners.clone().zip(corners.skip(1));
    let spans = pairs.into_iter().any(|(a, b)| (a - first).cross(b - first) != 0.0);
    if spans { Ok(()) } else { Err(no_extent()) }
}

fn to_edge(at: Point, [from, to]: [Point; 2]) -> f64 {
    let (along, off) = (to - from, at - from);
    let square = along.dot(along);
    let part = if square > 0.0 { (off.dot(along) / square).clamp(0.0, 1.0) } else { 0.0 };
    (off.x - part * along.x).hypot(off.y - part * along.y)
}

/// Returns the distance between two edges, or 0 if they cross.
fn between_edges(a: [Point; 2], b: [Point; 2]) -> f64 {
    if crossing(a, b).is_some() {
        return 0.0;
    }
    let ends = [to_edge(a[0], b), to_edge(a[1], b), to_edge(b[0], a), to_edge(b[1], a)];
    ends.into_iter().fold(f64::INFINITY, f64::min)
}

/// Returns the crossing of two edges, excluding their ends, or `None` if they do not cross.
pub(super) fn crossing([a, b]: [Point; 2], [c, d]: [Point; 2]) -> Option<Point> {
    let apart = |[a, b]: [f64; 2], [c, d]: [f64; 2]| a.max(b) < c.min(d) || c.max(d) < a.min(b);
    if apart([a.x(), b.x()], [c.x(), d.x()]) || apart([a.y(), b.y()], [c.y(), d.y()]) {
        return None;
    }
    let (ab, cd, ac) = (b - a, d - c, c - a);
    let turn = ab.cross(cd);
    let (s, t) = (ac.cross(cd) / turn, ac.cross(ab) / turn);
    let is_inside = s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0;
    if is_inside { Point::new(a.x() + s * ab.x, a.y() + s * ab.y).ok() } else { None }
}

/// Returns true if two edges, including their ends, meet or come within about `rounding` of each other.
pub(super) fn touch([a, b]: [Point; 2], [c, d]: [Point; 2], rounding: f64) -> bool {
    let apart =
        |[a, b]: [f64; 2], [c, d]: [f64; 2]| a.max(b) + rounding < c.min(d) || c.max(d) + rounding < a.min(b);
    if apart([a.x(), b.x()], [c.x(), d.x()]) || apart([a.y(), b.y()], [c.y(), d.y()]) {
        return false;
    }
    // True if both ends of one edge are on the same side of the line through the other.
    let is_beside = |from: Point, to: Point, ends: [Point; 2]| {
        let along = to - from;
        let sides = ends.map(|end| along.cross(end - from));
        let near = rounding * along.length();
        sides.iter().all(|side| *side > near) || sides.iter().all(|side| *side < -near)
    };
    !is_beside(a, b, [c, d]) && !is_beside(c, d, [a, b])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(corners: &[[f64; 2]]) -> Vec<Point> {
        corners.iter().map(|at| Point::try_from(*at).unwrap()).collect()
    }

    fn square(x: f64, y: f64, side: f64) -> Vec<Point> {
        ring(&[[x, y], [x + side, y], [x + side, y + side], [x, y + side]])
    }

    #[test]
    fn a_ring_in_another_is_a_hole() {
        let frame = Polygon::from_rings([square(0.0, 0.0, 4.0), square(1.0, 1.0, 2.0)]).unwrap();
        let at = |x, y| Point::new(x, y).unwrap();
        assert!(
            frame.contains(at(0.5, 0.5)) && !frame.contains(at(2.0, 2.0)) && !frame.contains(at(5.0, 2.0))
        );
        assert_eq!(frame.edges().count(), 8);
        let inside = Polygon::new(square(1.5, 1.5, 1.0)).unwrap();
        assert_eq!(frame.distance(&inside), 0.5);
        assert_eq!(frame.distance_to(at(2.0, 2.0)), 1.0);
        assert_eq!(frame.distance_to(at(0.5, 0.5)), 0.0);
    }

    #[test]
    fn the_proximity_is_the_distance_of_the_nearest_points() {
        let polygon = |corners: &[[f64; 2]]| Polygon::new(ring(corners)).unwrap();
        let unit = Polygon::new(square(0.0, 0.0, 1.0)).unwrap();
        assert_eq!(unit.distance(&Polygon::new(square(3.0, 0.2, 1.0)).unwrap()), 2.0);
        assert_eq!(unit.distance(&Polygon::new(square(4.0, 5.0, 1.0)).unwrap()), 5.0);
        // A triangle with a corner in front of an edge, and a bar right across the square that has no corner inside it.
        assert!((unit.distance(&polygon(&[[1.5, 0.5], [3.0, 0.0], [3.0, 1.0]])) - 0.5).abs() < 1e-15);
        assert_eq!(unit.distance(&polygon(&[[-1.0, 0.4], [2.0, 0.4], [2.0, 0.6], [-1.0, 0.6]])), 0.0);
        assert_eq!(unit.distance(&Polygon::new(square(-1.0, -1.0, 3.0)).unwrap()), 0.0);
    }

    #[test]
    fn a_polygon_that_cannot_be_replaced_is_kept() {
        let mut polygon = Polygon::new(square(0.0, 0.0, 1.0)).unwrap();
        let before = polygon.clone();
        assert!(polygon.replace(ring(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]])).is_err());
        assert_eq!(polygon, before);
        polygon.replace(square(1.0, 1.0, 2.0)).unwrap();
        assert_eq!(polygon, Polygon::new(square(1.0, 1.0, 2.0)).unwrap());
        assert!(Polygon::from_rings(Vec::<Vec<Point>>::new()).is_err());
    }
}

//! A triangulation of the same corners in two planes.

use sketchnav_schemas::geometry::Point;

use super::word::Word;

/// Distance of the frame from the anchors, in multiples of their extent.
const FRAME: f64 = 2.0;
/// Number of corners of the frame.
const FRAME_CORNERS: usize = 4;
/// Maximum distance from an edge at which a corner counts as lying on it, as a share of the edge's length.
const ON_EDGE: f64 = 1e-9;

/// The positions of the corners in one plane.
#[derive(Debug, Clone)]
pub(super) struct Plane<F> {
    corners: Vec<Point<F>>,
}

/// Edges and triangles, as indices of their corners, which are the same in both planes.
#[derive(Debug, Clone)]
pub(super) struct Mesh {
    edges: Vec<[usize; 2]>,
    triangles: Vec<[usize; 3]>,
}

/// Returns twice the signed area of a triangle, which is positive for counter-clockwise corners.
fn area<F>(a: Point<F>, b: Point<F>, c: Point<F>) -> f64 {
    (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)
}

impl<F: Copy> Plane<F> {
    pub(super) fn new(corners: Vec<Point<F>>) -> Self {
        Self { corners }
    }

    pub(super) fn len(&self) -> usize {
        self.corners.len()
    }

    /// Returns true if two edges cross between their ends.
    fn cross(&self, [a, b]: [usize; 2], [c, d]: [usize; 2]) -> bool {
        let [a, b, c, d] = [a, b, c, d].map(|i| self.corners[i]);
        area(a, b, c) * area(a, b, d) < 0.0 && area(c, d, a) * area(c, d, b) < 0.0
    }

    /// Returns true if a third corner lies on the edge.
    fn is_occupied(&self, edge: [usize; 2]) -> bool {
        let [a, b] = edge.map(|i| self.corners[i]);
        let length = a.distance(&b);
        let between = |c: Point<F>| {
            let along = ((c.x - a.x) * (b.x - a.x) + (c.y - a.y) * (b.y - a.y)) / (length * length);
            area(a, b, c).abs() <= ON_EDGE * length * length && along > 0.0 && along < 1.0
        };
        (0..self.len()).any(|i| !edge.contains(&i) && between(self.corners[i]))
    }

    fn area(&self, triangle: [usize; 3]) -> f64 {
        let [a, b, c] = triangle.map(|i| self.corners[i]);
        area(a, b, c)
    }

    /// Returns true if a fourth corner lies inside the triangle.
    fn holds_corner(&self, triangle: [usize; 3]) -> bool {
        (0..self.len()).any(|i| {
            !triangle.contains(&i) && self.weights(triangle, self.corners[i]).iter().all(|&w| w > 0.0)
        })
    }

    /// Returns the barycentric coordinates of a point in the triangle.
    fn weights(&self, triangle: [usize; 3], place: Point<F>) -> [f64; 3] {
        let [a, b, c] = triangle.map(|i| self.corners[i]);
        let whole = area(a, b, c);
        [area(place, b, c) / whole, area(a, place, c) / whole, area(a, b, place) / whole]
    }

    /// Returns the squared length of an edge as a share of the frame's squared diagonal.
    fn relative_length(&self, [a, b]: [usize; 2]) -> f64 {
        let corner = |i| self.corners[self.len() - FRAME_CORNERS + i];
        (self.corners[a].distance(&self.corners[b]) / corner(0).distance(&corner(2))).powi(2)
    }

    /// Returns where a straight line crosses the edge, from 0 at `from` to 1 at `to`. The test is half open: a point on the line
    /// through an edge counts as being on the right of it, so a line through that point crosses exactly once.
    fn crossing(&self, from: Point<F>, to: Point<F>, edge: [usize; 2]) -> Option<f64> {
        let [a, b] = edge.map(|i| self.corners[i]);
        let (before, after) = (area(a, b, from), area(a, b, to));
        let cut = (before > 0.0) != (after > 0.0) && (area(from, to, a) > 0.0) != (area(from, to, b) > 0.0);
        cut.then(|| before / (before - after))
    }
}

impl Mesh {
    /// Builds a greedy triangulation: takes the shortest edges first, and skips those that cross another edge in either plane.
    pub(super) fn common<F: Copy, G: Copy>(floor: &Plane<F>, drawing: &Plane<G>) -> Self {
        let n = floor.len();
        let mut candidates: Vec<_> = (0..n).flat_map(|i| (i + 1..n).map(move |j| [i, j])).collect();
        let length = |edge| floor.relative_length(edge) + drawing.relative_length(edge);
        candidates.sort_by(|a, b| length(*a).total_cmp(&length(*b)));
        let mut edges: Vec<[usize; 2]> = Vec::new();
        for edge in candidates {
            let crossed = |other: &[usize; 2]| floor.cross(edge, *other) || drawing.cross(edge, *other);
            if !floor.is_occupied(edge) && !drawing.is_occupied(edge) && !edges.iter().any(crossed) {
                edges.push(edge);
            }
        }
        let triangles = triangles(&edges, floor, drawing);
        Self { edges, triangles }
    }

    pub(super) fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Maps a point from one plane to the other, by the triangle that contains it.
    pub(super) fn carry<F: Copy, G: Copy>(
        &self,
        from: &Plane<F>,
        to: &Plane<G>,
        place: Point<F>,
    ) -> Option<Point<G>> {
        let located = self.triangles.iter().map(|&triangle| (triangle, from.weights(triangle, place)));
        let least = |weights: &[f64; 3]| weights.iter().copied().fold(f64::INFINITY, f64::min);
        let (triangle, weights) = located.max_by(|a, b| least(&a.1).total_cmp(&least(&b.1)))?;
        let [a, b, c] = triangle.map(|i| to.corners[i]);
        let [u, v, w] = weights;
        (least(&weights) >= -ON_EDGE)
            .then(|| Point::new(u * a.x + v * b.x + w * c.x, u * a.y + v * b.y + w * c.y))
    }

    /// Appends the edges that a line crosses to the word, in order.
    pub(super) fn write<F: Copy>(&self, plane: &Plane<F>, line: &[Point<F>], word: &mut Word) {
        for pair in line.windows(2) {
            let crossing = |edge: &[usize; 2]| Some((plane.crossing(pair[0], pair[1], *edge)?, *edge));
            let mut crossings: Vec<_> = self.edges.iter().filter_map(crossing).collect();
            crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
            crossings.into_iter().for_each(|(_, edge)| word.push(edge));
        }
    }
}

/// Returns the triangles between edges that have the same orientation in both planes and do not contain any corner.
fn triangles<F: Copy, G: Copy>(
    edges: &[[usize; 2]],
    floor: &Plane<F>,
    drawing: &Plane<G>,
) -> Vec<[usize; 3]> {
    let joined = |i: usize, j: usize| edges.contains(&[i, j]);
    let mut found = Vec::new();
    for &[i, j] in edges {
        for k in (j + 1..floor.len()).filter(|&k| joined(i, k) && joined(j, k)) {
            let triangle = if floor.area([i, j, k]) > 0.0 { [i, j, k] } else { [i, k, j] };
            let sound = floor.area(triangle) > 0.0 && drawing.area(triangle) > 0.0;
            if sound && !floor.holds_corner(triangle) && !drawing.holds_corner(triangle) {
                found.push(triangle);
            }
        }
    }
    found
}

/// Returns four points far around `places`, counter-clockwise.
pub(super) fn frame<F: Copy>(places: &[Point<F>]) -> [Point<F>; FRAME_CORNERS] {
    let fold = |of: fn(&Point<F>) -> f64, choose: fn(f64, f64) -> f64| {
        places.iter().map(of).reduce(choose).unwrap_or(0.0)
    };
    let (left, right) = (fold(|p| p.x, f64::min), fold(|p| p.x, f64::max));
    let (low, high) = (fold(|p| p.y, f64::min), fold(|p| p.y, f64::max));
    let far = FRAME * (right - left).max(high - low);
    let (left, right, low, high) = (left - far, right + far, low - far, high + far);
    [Point::new(left, low), Point::new(right, low), Point::new(right, high), Point::new(left, high)]
}

/// An affine map from one plane to another.
#[derive(Debug, Clone, Copy)]
pub(super) struct Affine<F, G> {
    from: Point<F>,
    to: Point<G>,
    matrix: [[f64; 2]; 2],
}

impl<F: Copy, G: Copy> Affine<F, G> {
    /// Returns the best map in the least-squares sense, or `None` if the points lie on a line.
    pub(super) fn fit(from: &[Point<F>], to: &[Point<G>]) -> Option<Self> {
        let (center, image) = (mean(from)?, mean(to)?);
        let (mut square, mut mixed) = ([[0.0; 2]; 2], [[0.0; 2]; 2]);
        for (p, q) in from.iter().zip(to) {
            let (u, v) = ([p.x - center.x, p.y - center.y], [q.x - image.x, q.y - image.y]);
            for (row, column) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                square[row][column] += u[row] * u[column];
                mixed[row][column] += v[row] * u[column];
            }
        }
        let [[a, b], [c, d]] = square;
        let determinant = a * d - b * c;
        let flat = from.len() < 3 || determinant <= ON_EDGE * (a + d).powi(2);
        let times_inverse = |[x, y]: [f64; 2]| [(x * d - y * c) / determinant, (y * a - x * b) / determinant];
        (!flat).then(|| Self { from: center, to: image, matrix: mixed.map(times_inverse) })
    }

    pub(super) fn determinant(&self) -> f64 {
        let [[a, b], [c, d]] = self.matrix;
        a * d - b * c
    }

    pub(super) fn apply(&self, place: Point<F>) -> Point<G> {
        let (x, y) = (place.x - self.from.x, place.y - self.from.y);
        let [[a, b], [c, d]] = self.matrix;
        Point::new(self.to.x + a * x + b * y, self.to.y + c * x + d * y)
    }
}

fn mean<F>(places: &[Point<F>]) -> Option<Point<F>> {
    let n = places.len() as f64;
    let sum = |of: fn(&Point<F>) -> f64| places.iter().map(of).sum::<f64>() / n;
    (!places.is_empty()).then(|| Point::new(sum(|p| p.x), sum(|p| p.y)))
}

//! Constant forces between two objects that a line separates, computed by integrating the product of their chords.
//!
//! If the whole argument is after the referent, F_0(θ) = ∫ X(u) Z(u) du, where X and Z are the lengths of the two objects on the
//! parallel u. For a simple ring, this length follows from the edges that the parallel meets: it is the sum of the heights of those
//! that run one way, minus the heights of those that run back. Between neighbouring corners it is linear in u, so nothing has to be
//! sorted along the direction.

/// An edge that runs across the direction: where it begins and ends across, and the height at 0 and the slope of its line. Height
/// and slope are negated for edges that run backwards.
#[derive(Debug, Clone, Copy)]
struct Edge {
    low: f64,
    high: f64,
    height: f64,
    slope: f64,
}

/// The edges of two objects between two parallels, kept between calls to reuse its memory.
#[derive(Debug, Clone, Default)]
pub(super) struct Chords {
    edges: [Vec<Edge>; 2],
}

impl Chords {
    /// Computes F_0 from the edges of both objects and their corners across and along the direction. `low` and `high` are the
    /// outermost parallels that both objects meet, and `strips` are the corners between them in ascending order across the
    /// direction.
    pub(super) fn constant_force(
        &mut self,
        edges: [&[[usize; 2]]; 2],
        turned: &[[f64; 2]],
        [low, high]: [f64; 2],
        strips: impl Iterator<Item = f64>,
    ) -> f64 {
        for (taken, edges) in self.edges.iter_mut().zip(edges) {
            taken.clear();
            for [from, to] in edges {
                take(taken, turned[*from], turned[*to], [low, high]);
            }
        }
        let mut force = 0.0;
        let mut from = low;
        for to in strips.chain([high]) {
            if to > from {
                let [x, z] = [&self.edges[0], &self.edges[1]].map(|edges| lengths(edges, [from, to]));
                force += (to - from) * (2.0 * (x[0] * z[0] + x[1] * z[1]) + x[0] * z[1] + x[1] * z[0]) / 6.0;
                from = to;
            }
        }
        force
    }
}

/// Appends an edge if it runs across the direction between two parallels.
fn take(edges: &mut Vec<Edge>, from: [f64; 2], to: [f64; 2], [low, high]: [f64; 2]) {
    let (sign, from, to) = if from[0] < to[0] { (1.0, from, to) } else { (-1.0, to, from) };
    if from[0] < to[0] && from[0] < high && to[0] > low {
        let slope = (to[1] - from[1]) / (to[0] - from[0]);
        let height = sign * (from[1] - slope * from[0]);
        edges.push(Edge { low: from[0], high: to[0], height, slope: sign * slope });
    }
}

/// Returns the lengths of an object on both sides of a strip between neighbouring corners.
fn lengths(edges: &[Edge], [from, to]: [f64; 2]) -> [f64; 2] {
    let middle = from + (to - from) / 2.0;
    let (mut height, mut slope) = (0.0, 0.0);
    for edge in edges {
        let is_met = edge.low < middle && middle <= edge.high;
        height += if is_met { edge.height } else { 0.0 };
        slope += if is_met { edge.slope } else { 0.0 };
    }
    [from, to].map(|u| (height + slope * u).abs())
}

//! Converts places between a drawing and a map by corresponding places. Near each place, the conversion is the similarity transform
//! that best fits the pairs, with more weight on near ones (moving least squares; Schaefer, McPhail and Warren 2006, section 2.2).

/// Squared distance, in the unit of the places, that is added so that a place at a pair has a finite weight.
const SOFTENING: f64 = 1e-6;

/// A conversion from one plane to another.
#[derive(Debug, Clone, PartialEq)]
pub struct Warp {
    pairs: Vec<([f64; 2], [f64; 2])>,
}

impl Warp {
    /// Creates the conversion from the first place of each pair to the second one.
    pub fn new(pairs: Vec<([f64; 2], [f64; 2])>) -> Self {
        Self { pairs }
    }

    /// Returns the conversion in the opposite direction.
    pub fn inverse(&self) -> Self {
        Self { pairs: self.pairs.iter().map(|&(from, to)| (to, from)).collect() }
    }

    /// Converts a place. Returns `None` if there are fewer than two distinct pairs.
    pub fn apply(&self, at: [f64; 2]) -> Option<[f64; 2]> {
        let weight = |from: [f64; 2]| {
            let [x, y] = [from[0] - at[0], from[1] - at[1]];
            (x * x + y * y + SOFTENING).powi(-2)
        };
        let mut total = 0.0;
        let (mut mean_from, mut mean_to) = ([0.0; 2], [0.0; 2]);
        for &(from, to) in &self.pairs {
            let weight = weight(from);
            total += weight;
            for axis in 0..2 {
                mean_from[axis] += weight * from[axis];
                mean_to[axis] += weight * to[axis];
            }
        }
        let [mean_from, mean_to] = [mean_from, mean_to].map(|sum| sum.map(|sum| sum / total));
        let (mut along, mut across, mut spread) = (0.0, 0.0, 0.0);
        for &(from, to) in &self.pairs {
            let weight = weight(from);
            let [px, py] = [0, 1].map(|axis| from[axis] - mean_from[axis]);
            let [qx, qy] = [0, 1].map(|axis| to[axis] - mean_to[axis]);
            along += weight * (px * qx + py * qy);
            across += weight * (px * qy - py * qx);
            spread += weight * (px * px + py * py);
        }
        let [x, y] = [0, 1].map(|axis| at[axis] - mean_from[axis]);
        let [along, across] = [along / spread, across / spread];
        let found = [mean_to[0] + along * x - across * y, mean_to[1] + across * x + along * y];
        found.iter().all(|number| number.is_finite()).then_some(found)
    }
}

/// A conversion at the nodes of a square lattice, in between which it is interpolated. It saves time if there are many places and
/// many pairs.
#[derive(Debug, Clone)]
pub struct Lattice {
    low: [f64; 2],
    side: f64,
    columns: usize,
    nodes: Vec<Option<[f64; 2]>>,
}

impl Lattice {
    /// Creates the lattice for the places between `low` and `high`. `side` is the length of a mesh.
    pub fn new(warp: &Warp, low: [f64; 2], high: [f64; 2], side: f64) -> Self {
        Self::by(|at| warp.apply(at), low, high, side)
    }

    /// As [`Lattice::new`], for any conversion.
    pub fn by(
        convert: impl Fn([f64; 2]) -> Option<[f64; 2]>,
        low: [f64; 2],
        high: [f64; 2],
        side: f64,
    ) -> Self {
        let [columns, rows] =
            [0, 1].map(|axis| ((high[axis] - low[axis]) / side).ceil().max(0.0) as usize + 2);
        let at = |k: usize| [low[0] + (k % columns) as f64 * side, low[1] + (k / columns) as f64 * side];
        Self { low, side, columns, nodes: (0..columns * rows).map(|k| convert(at(k))).collect() }
    }

    /// Converts a place. Returns `None` outside the lattice, or if the conversion has no result nearby.
    pub fn apply(&self, at: [f64; 2]) -> Option<[f64; 2]> {
        let [x, y] = [0, 1].map(|axis| (at[axis] - self.low[axis]) / self.side);
        if x < 0.0 || y < 0.0 || x as usize + 1 >= self.columns {
            return None;
        }
        let (column, row) = (x as usize, y as usize);
        let node = |dx: usize, dy: usize| *self.nodes.get((row + dy) * self.columns + column + dx)?;
        let [[a, b], [c, d]] = [[node(0, 0)?, node(1, 0)?], [node(0, 1)?, node(1, 1)?]];
        let (tx, ty) = (x.fract(), y.fract());
        let mix = |from: f64, to: f64, part: f64| from + part * (to - from);
        Some([0, 1].map(|k| mix(mix(a[k], b[k], tx), mix(c[k], d[k], tx), ty)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_near(found: Option<[f64; 2]>, expected: [f64; 2]) -> bool {
        found.is_some_and(|found| (0..2).all(|axis| (found[axis] - expected[axis]).abs() < 1e-3))
    }

    /// A quarter turn, twice as large, and moved by (5, 1).
    #[test]
    fn two_pairs_are_a_similarity() {
        let warp = Warp::new(vec![([0.0, 0.0], [5.0, 1.0]), ([10.0, 0.0], [5.0, 21.0])]);
        assert!(is_near(warp.apply([0.0, 10.0]), [-15.0, 1.0]), "{:?}", warp.apply([0.0, 10.0]));
        assert!(is_near(warp.inverse().apply([-15.0, 1.0]), [0.0, 10.0]));
    }

    /// A corridor that is drawn twice as long as the room beside it.
    #[test]
    fn near_pairs_decide_the_scale() {
        let room = (0..5).map(|i| ([f64::from(i), 0.0], [f64::from(i), 0.0]));
        let corridor = (1..5).map(|i| ([4.0 + 2.0 * f64::from(i), 0.0], [4.0 + f64::from(i), 0.0]));
        let warp = Warp::new(room.chain(corridor).collect());
        let scale =
            |at: f64| warp.apply([at + 0.1, 0.0]).unwrap()[0] - warp.apply([at - 0.1, 0.0]).unwrap()[0];
        assert!((scale(1.5) - 0.2).abs() < 0.06, "{}", scale(1.5));
        assert!((scale(10.0) - 0.1).abs() < 0.06, "{}", scale(10.0));
    }

    #[test]
    fn a_lattice_converts_as_its_warp_does() {
        let bend = |x: f64, y: f64| ([x, y], [x + 0.02 * x * y, 2.0 * y]);
        let pairs = (0..6).flat_map(|i| (0..6).map(move |j| bend(f64::from(i), f64::from(j))));
        let warp = Warp::new(pairs.collect());
        let lattice = Lattice::new(&warp, [-1.0, -1.0], [7.0, 7.0], 0.1);
        for at in [[-0.95, -0.99], [0.03, 2.47], [3.333, 4.444], [6.99, 7.0]] {
            let (exact, found) = (warp.apply(at).unwrap(), lattice.apply(at).unwrap());
            assert!((0..2).all(|axis| (exact[axis] - found[axis]).abs() < 0.02), "{exact:?} {found:?}");
        }
        assert_eq!((lattice.apply([-1.1, 0.0]), lattice.apply([0.0, 9.0])), (None, None));
        assert_eq!(Lattice::new(&Warp::new(Vec::new()), [0.0; 2], [1.0; 2], 0.5).apply([0.5; 2]), None);
    }

    #[test]
    fn a_single_pair_converts_nothing() {
        assert_eq!(Warp::new(Vec::new()).apply([1.0, 2.0]), None);
        assert_eq!(Warp::new(vec![([1.0, 1.0], [2.0, 2.0])]).apply([1.0, 2.0]), None);
    }
}

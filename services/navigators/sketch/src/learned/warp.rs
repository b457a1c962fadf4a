//! Converts places between a drawing and a map by corresponding places. Near each place, the conversion is the similarity that fits
//! the pairs best if near ones count more (moving least squares; Schaefer, McPhail and Warren 2006, section 2.2).

/// Squared distance, in the unit of the places, that is added so that a place at a pair has a finite weight.
const SOFTENING: f64 = 1e-6;

/// A conversion from one plane to another.
#[derive(Debug, Clone, PartialEq)]
pub struct Warp {
    pairs: Vec<([f64; 2], [f64; 2])>,
}

impl Warp {
    /// Creates the conversion by which each pair's first place corresponds to its second one.
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
    fn a_single_pair_converts_nothing() {
        assert_eq!(Warp::new(Vec::new()).apply([1.0, 2.0]), None);
        assert_eq!(Warp::new(vec![([1.0, 1.0], [2.0, 2.0])]).apply([1.0, 2.0]), None);
    }
}

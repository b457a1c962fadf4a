//! Determines which of several dots is the most isolated (Park and Kender 1995, 5.6.2, after Gowda and Krishna 1978).
//!
//! The *mutual neighbourhood value* of two dots is the sum of two ranks, one for each dot among the neighbours of the other. The
//! *c-value* of a dot is its smallest mutual neighbourhood value, and the most isolated dot has the largest c-value.
//!
//! Dots at equal distance share the better rank, so the result does not depend on the order of the dots. All functions take at
//! most cubic time in the number of dots, which a window keeps small, and none of them allocates.

use crate::geometry::Point;

/// Returns the rank of `other` among the neighbours of `dot`, 1 for the closest.
fn rank(dots: &[Point], other: usize, dot: usize) -> u32 {
    let distance = (dots[other] - dots[dot]).norm_squared();
    let is_closer =
        |&(index, place): &(usize, &Point)| index != dot && (*place - dots[dot]).norm_squared() < distance;
    dots.iter().enumerate().filter(is_closer).count() as u32 + 1
}

/// Returns the mutual neighbourhood value of two different dots, which is 2 if each is the other's closest neighbour.
pub fn mutual_neighbourhood(dots: &[Point], a: usize, b: usize) -> u32 {
    rank(dots, a, b) + rank(dots, b, a)
}

/// Returns the c-value of a dot, or `None` if there is no other dot.
pub fn c_value(dots: &[Point], dot: usize) -> Option<u32> {
    (0..dots.len()).filter(|&other| other != dot).map(|other| mutual_neighbourhood(dots, other, dot)).min()
}

/// Returns the c-value of a pair: the smallest mutual neighbourhood value of either dot with a third one. Returns `None` if
/// there is no third dot.
pub fn c_value_of_pair(dots: &[Point], [a, b]: [usize; 2]) -> Option<u32> {
    let thirds = (0..dots.len()).filter(|&third| third != a && third != b);
    thirds.map(|third| mutual_neighbourhood(dots, third, a).min(mutual_neighbourhood(dots, third, b))).min()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::config;

    /// Four dots as in figure 20: B and C are close together, D is near C, and A is apart.
    const FIGURE_20: [Point; 4] =
        [Point::new(0.0, 10.0), Point::new(6.0, 4.0), Point::new(8.0, 2.0), Point::new(11.0, 0.0)];

    #[test]
    fn figure_20_has_c_values_of_4_2_2_3() {
        let c_values: Vec<_> = (0..4).map(|dot| c_value(&FIGURE_20, dot).unwrap()).collect();
        assert_eq!(c_values, [4, 2, 2, 3]);
        // A's closest neighbour is B, for which A is the most distant one: 1 + 3.
        assert_eq!(mutual_neighbourhood(&FIGURE_20, 0, 1), 4);
        // B and C are each other's closest neighbours. D's closest neighbour is C, for which D is the second closest.
        assert_eq!(mutual_neighbourhood(&FIGURE_20, 1, 2), 2);
        assert_eq!(mutual_neighbourhood(&FIGURE_20, 2, 3), 3);
    }

    #[test]
    fn the_second_closest_and_the_third_closest_make_five() {
        // The paper's own example, in which B is second to A, and A is third to B.
        let dots = [0.0, 4.0, -3.0, 5.0, 7.5].map(|x| Point::new(x, 0.0));
        assert_eq!((rank(&dots, 1, 0), rank(&dots, 0, 1)), (2, 3));
        assert_eq!(mutual_neighbourhood(&dots, 0, 1), 5);
    }

    #[test]
    fn a_dot_alone_has_no_c_value_and_a_pair_alone_neither() {
        assert_eq!(c_value(&FIGURE_20[..1], 0), None);
        assert_eq!(c_value_of_pair(&FIGURE_20[..2], [0, 1]), None);
        assert_eq!(c_value_of_pair(&FIGURE_20, [1, 2]), Some(3));
    }

    proptest! {
        #![proptest_config(config(64))]

        #[test]
        fn values_are_symmetric_and_whatever_the_order(
            places in prop::collection::btree_set((0_i32..20, 0_i32..20), 2..9),
            turn in 0_usize..9,
        ) {
            let dots: Vec<_> = places.iter().map(|&(x, y)| Point::new(f64::from(x), f64::from(y))).collect();
            let mut turned = dots.clone();
            turned.rotate_left(turn % dots.len());
            for dot in 0..dots.len() {
                let there = (dot + dots.len() - turn % dots.len()) % dots.len();
                prop_assert_eq!(c_value(&dots, dot), c_value(&turned, there));
                let c = c_value(&dots, dot).unwrap();
                prop_assert!((2..=2 * (dots.len() as u32 - 1)).contains(&c));
                for other in (0..dots.len()).filter(|&other| other != dot) {
                    prop_assert_eq!(mutual_neighbourhood(&dots, dot, other), mutual_neighbourhood(&dots, other, dot));
                }
            }
        }
    }
}

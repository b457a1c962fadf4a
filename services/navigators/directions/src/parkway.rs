//! Parkways: sets of landmarks that follow one another without ever being out of sight (Park and Kender 1995, 4.1 to 4.3).
//!
//! In a *general* parkway, two dots are connected if one window can show both. *Obvious* and *isolated* parkways are directed
//! graphs of transitions ([`Kinds::OBVIOUS`], [`Kinds::ISOLATED`]), of which the strongly connected components are counted.
//! Reliable, error-detectable and error-recoverable parkways consist of the transitions that pass a test
//! ([`Transitions::filtered`]).

use petgraph::unionfind::UnionFind;

use crate::geometry::Window;
use crate::plane::{DotId, Plane};
use crate::transitions::{Components, Kinds, Transitions};

/// Iterates over the dots that one window can show together with this dot.
pub fn neighbours(plane: &Plane, window: Window, dot: DotId) -> impl Iterator<Item = DotId> + '_ {
    let is_other = move |&(other, _): &(DotId, _)| other != dot;
    plane.around(plane.dot(dot), window.side).filter(is_other).map(|(other, _)| other)
}

/// Returns the general parkways.
pub fn general(plane: &Plane, window: Window) -> Components {
    let mut sets = UnionFind::<u32>::new(plane.len());
    for dot in 0..plane.len() as DotId {
        for other in neighbours(plane, window, dot).filter(|&other| other > dot) {
            sets.union(dot, other);
        }
    }
    let mut names = vec![u32::MAX; plane.len()];
    let mut components = Components { of: Vec::with_capacity(plane.len()), sizes: Vec::new() };
    for root in sets.into_labeling() {
        let name = &mut names[root as usize];
        if *name == u32::MAX {
            *name = components.sizes.len() as u32;
            components.sizes.push(0);
        }
        components.sizes[*name as usize] += 1;
        components.of.push(*name);
    }
    components
}

/// Number of parkways of each kind on a plane (figure 7).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counts {
    /// Number of general parkways.
    pub general: usize,
    /// Number of isolated parkways.
    pub isolated: usize,
    /// Number of obvious parkways.
    pub obvious: usize,
}

/// Counts the parkways of a plane.
pub fn count(plane: &Plane, window: Window) -> Counts {
    let directed = |kinds| Transitions::new(plane, window, kinds).components().count();
    Counts {
        general: general(plane, window).count(),
        isolated: directed(Kinds::ISOLATED),
        obvious: directed(Kinds::OBVIOUS),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;
    use crate::testing::{config, plane};

    fn window() -> Window {
        Window::new(10.0, 0.0).unwrap()
    }

    #[test]
    fn a_new_dot_in_reach_of_a_parkway_joins_it_and_a_dot_apart_begins_one() {
        // Figure 6.
        assert_eq!(general(&plane(&[(0.0, 0.0), (9.0, 9.0)]), window()).sizes, [2]);
        assert_eq!(general(&plane(&[(0.0, 0.0), (9.0, 9.0), (18.0, 19.0)]), window()).sizes, [3]);
        assert_eq!(general(&plane(&[(0.0, 0.0), (9.0, 9.0), (18.0, 19.5)]), window()).sizes, [2, 1]);
    }

    #[test]
    fn what_is_obvious_one_way_may_not_be_so_in_reverse() {
        // A sees only B in its north-east. B's south-west shows both A and C.
        let world = plane(&[(0.0, 0.0), (5.0, 5.0), (-4.0, -3.0)]);
        let obvious = Transitions::new(&world, window(), Kinds::OBVIOUS);
        let leads = |from: DotId, to: DotId| obvious.from(from).iter().any(|entry| entry.to == to);
        assert!(leads(0, 1) && !leads(1, 0));
    }

    proptest! {
        #![proptest_config(config(64))]

        #[test]
        fn obvious_is_within_isolated_and_isolated_within_general(
            places in prop::collection::btree_set((0_i32..60, 0_i32..60), 1..60),
        ) {
            let pairs: Vec<_> = places.iter().map(|&(x, y)| (f64::from(x), f64::from(y))).collect();
            let world = plane(&pairs);
            let edges = |kinds| -> BTreeSet<_> {
                Transitions::new(&world, window(), kinds).all().map(|(from, e)| (from, e.corner, e.to)).collect()
            };
            let (obvious, isolated) = (edges(Kinds::OBVIOUS), edges(Kinds::ISOLATED));
            prop_assert!(obvious.is_subset(&isolated));
            for &(from, _, to) in &isolated {
                prop_assert!(neighbours(&world, window(), from).any(|dot| dot == to));
                prop_assert!(neighbours(&world, window(), to).any(|dot| dot == from), "symmetric");
            }
            let counts = count(&world, window());
            prop_assert!(counts.general <= counts.isolated && counts.isolated <= counts.obvious);
        }
    }
}

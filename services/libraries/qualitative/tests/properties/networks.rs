//! Properties of networks: closure against all models of small networks, and against scenes that exist.

use proptest::prelude::*;
use sketchnav_qualitative::algebra::{Relation, RelationSet};
use sketchnav_qualitative::allen::Allen;
use sketchnav_qualitative::argd::{Bound, Rank, Scale};
use sketchnav_qualitative::cardinal::Direction;
use sketchnav_qualitative::order::Order;
use sketchnav_qualitative::rcc::{Rcc2, Rcc3, Rcc4, Rcc5, Rcc8};
use sketchnav_qualitative::rectangle::Rectangular;
use sketchnav_qualitative::{Error, Inconsistent, Interval, Network, Point, Rect, Table};

use crate::point;
use crate::scenes::{anywhere, rect};
use crate::tables::of_cells;

/// Generates a set of relations that contains each relation with the given probability.
fn some<R: Relation>(probability: f64) -> impl Strategy<Value = RelationSet<R>> {
    prop::collection::vec(prop::bool::weighted(probability), R::COUNT).prop_map(|chosen| {
        R::all().zip(chosen).filter(|(_, is_in)| *is_in).map(|(relation, _)| relation).collect()
    })
}

/// Generates a network of four objects with a set of relations for each of the six pairs.
fn network<R: Relation>() -> impl Strategy<Value = Network<R>> {
    prop::collection::vec((some(0.3), any::<bool>()), 6).prop_map(|sets| {
        let mut network = Network::new(4);
        let pairs = (0..4).flat_map(|i| (i + 1..4).map(move |j| (i, j)));
        for ((i, j), (set, is_turned)) in pairs.zip(sets) {
            let (i, j) = if is_turned { (j, i) } else { (i, j) };
            network.constrain(i, j, set).unwrap();
        }
        network
    })
}

fn pairs(objects: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..objects).flat_map(move |i| (0..objects).map(move |j| (i, j))).filter(|(i, j)| i != j)
}

/// Returns the relations of each pair in all models of a network, found by trying every choice of objects.
fn by_all_models<O: Copy, R: Relation>(
    network: &Network<R>,
    objects: &[O],
    relate: impl Fn(O, O) -> R,
) -> Vec<RelationSet<R>> {
    fn extend(
        at: &mut Vec<usize>,
        allows: &dyn Fn(&[usize]) -> bool,
        of: usize,
        to: usize,
        take: &mut dyn FnMut(&[usize]),
    ) {
        if at.len() == to {
            return take(at);
        }
        for next in 0..of {
            at.push(next);
            if allows(at) {
                extend(at, allows, of, to, take);
            }
            at.pop();
        }
    }
    let related: Vec<Vec<R>> =
        objects.iter().map(|a| objects.iter().map(|b| relate(*a, *b)).collect()).collect();
    let allows = |at: &[usize]| {
        let last = at.len() - 1;
        (0..last).all(|i| {
            network.relations(i, last).unwrap().contains(related[at[i]][at[last]])
                && network.relations(last, i).unwrap().contains(related[at[last]][at[i]])
        })
    };
    let mut found = vec![RelationSet::EMPTY; network.objects() * network.objects()];
    extend(&mut Vec::new(), &allows, objects.len(), network.objects(), &mut |at| {
        for (i, j) in pairs(at.len()) {
            found[i * at.len() + j].insert(related[at[i]][at[j]]);
        }
    });
    found
}

fn is_minimal<O: Copy, R: Relation>(
    table: &Table<R>,
    network: &Network<R>,
    objects: &[O],
    relate: impl Fn(O, O) -> R,
) -> Result<(), TestCaseError> {
    let models = by_all_models(network, objects, relate);
    let is_possible = !models[1].is_empty();
    let minimal = table.minimal(network);
    prop_assert_eq!(minimal.is_ok(), is_possible, "{:?}", &minimal);
    prop_assert_eq!(table.scenario(network).is_some(), is_possible);
    let mut closed = network.clone();
    if table.close(&mut closed).is_err() {
        prop_assert!(!is_possible);
        return Ok(());
    }
    let mut again = closed.clone();
    prop_assert_eq!(table.close(&mut again), Ok(()));
    prop_assert_eq!(&again, &closed);
    for (i, j) in pairs(network.objects()) {
        let (model, closed) = (models[i * network.objects() + j], closed.relations(i, j).unwrap());
        prop_assert_eq!(closed.intersection(model), model, "{}, {}", i, j);
        if let Ok(minimal) = &minimal {
            prop_assert_eq!(minimal.relations(i, j).unwrap(), model, "{}, {}", i, j);
        }
    }
    Ok(())
}

/// Checks that neither closure nor search removes a relation that actual objects have.
fn keeps_what_holds<O, R: Relation>(
    table: &Table<R>,
    objects: &[O],
    hidden: &[bool],
    relate: impl Fn(&O, &O) -> R,
) -> Result<(), TestCaseError> {
    let mut network = Network::new(objects.len());
    for ((i, j), _) in pairs(objects.len()).zip(hidden).filter(|(_, is_hidden)| !**is_hidden) {
        network.constrain(i, j, relate(&objects[i], &objects[j])).unwrap();
    }
    prop_assert_eq!(table.close(&mut network), Ok(()));
    for (i, j) in pairs(objects.len()) {
        prop_assert!(
            network.relations(i, j).unwrap().contains(relate(&objects[i], &objects[j])),
            "{}, {}",
            i,
            j
        );
    }
    Ok(())
}

/// Returns all intervals whose ends are at eight positions, which are enough for four intervals.
fn intervals() -> Vec<Interval> {
    let ends = (0..8).flat_map(|low| (low + 1..8).map(move |high| [f64::from(low), f64::from(high)]));
    ends.map(|ends| Interval::try_from(ends).unwrap()).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn minimal_networks_of_intervals_are_what_all_intervals_show(network in network::<Allen>()) {
        is_minimal(&Table::default(), &network, &intervals(), |a, b| Allen::of(a, b, 0.0))?;
    }

    #[test]
    fn minimal_networks_of_places_are_what_all_places_show(network in network::<Order>()) {
        let places: Vec<_> = (0..4).map(|x| point([f64::from(x), 0.0])).collect();
        is_minimal(&Table::default(), &network, &places, Order::of)?;
    }

    #[test]
    fn closure_keeps_what_holds(
        rects in prop::collection::vec(rect(), 6),
        places in prop::collection::vec(anywhere().prop_map(point), 6),
        hidden in prop::collection::vec(any::<bool>(), 30),
    ) {
        let rcc8 = |a: &Rect, b: &Rect| Rcc8::of(*a, *b, 0.0);
        keeps_what_holds(&Table::default(), &rects, &hidden, rcc8)?;
        keeps_what_holds(&Table::default(), &rects, &hidden, |a, b| Rcc5::from(rcc8(a, b)))?;
        keeps_what_holds(&Rcc4::table(), &rects, &hidden, |a, b| Rcc4::from(rcc8(a, b)))?;
        keeps_what_holds(&Table::default(), &rects, &hidden, |a, b| Rcc3::from(rcc8(a, b)))?;
        keeps_what_holds(&Table::default(), &rects, &hidden, |a, b| Rcc2::from(rcc8(a, b)))?;
        keeps_what_holds(&Table::default(), &rects[..4], &hidden, |a, b| Rectangular::of(*a, *b, 0.0))?;
        keeps_what_holds(&Table::default(), &places, &hidden, |a, b| Direction::of(*a, *b))?;
        let scale = Scale::new([("at", 1.0), ("near", 3.0), ("far", 9.0)], Bound::Upper).unwrap();
        let rank = |a: &Point, b: &Point| scale.rank(a.distance(*b));
        keeps_what_holds::<_, Rank>(&scale.table(), &places, &hidden, rank)?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn minimal_networks_of_regions_are_what_regions_of_cells_show(sets in prop::collection::vec(some::<Rcc8>(0.4), 3)) {
        // Three regions of cells on a line exhibit every triangle that the composition table allows.
        let mut network = Network::new(3);
        for ((i, j), set) in [(0, 1), (1, 2), (0, 2)].into_iter().zip(sets) {
            network.constrain(i, j, set).unwrap();
        }
        let regions: Vec<u32> = (1..1 << 6).map(|cells: u32| cells << 1).collect();
        is_minimal(&Table::default(), &network, &regions, of_cells)?;
    }
}

#[test]
fn a_contradiction_is_named() {
    let table = Table::<Rcc8>::default();
    let mut network = Network::new(4);
    network.constrain(0, 1, Rcc8::Ntpp).unwrap();
    network.constrain(1, 2, Rcc8::Dc).unwrap();
    network.constrain(2, 0, Rcc8::Ec).unwrap();
    let error = table.close(&mut network).unwrap_err();
    assert!(matches!(error, Inconsistent::Triangle { .. }), "{error}");
    let mut network = Network::new(2);
    network.constrain(0, 1, Rcc8::Ntpp).unwrap();
    network.constrain(1, 0, Rcc8::Tppi).unwrap();
    let error = table.close(&mut network).unwrap_err();
    assert_eq!(error, Inconsistent::Pair { first: 0, second: 1 });
    for (first, second) in [(0, 0), (0, 2), (2, 1)] {
        let error = network.constrain(first, second, Rcc8::Dc).unwrap_err();
        assert_eq!(error, Error::Pair { objects: 2, first, second });
    }
}

/// Closure only considers triangles, so it misses contradictions among four intervals.
#[test]
fn search_finds_contradictions_that_closure_misses() {
    let set =
        |words: &str| words.split(' ').map(|word| word.parse().unwrap()).collect::<RelationSet<Allen>>();
    let mut network = Network::new(4);
    for (i, j, words) in
        [(0, 1, "oi d"), (0, 2, "< oi"), (0, 3, "m oi"), (1, 2, "s di"), (1, 3, "< oi"), (2, 3, "mi di")]
    {
        network.constrain(i, j, set(words)).unwrap();
    }
    let table = Table::default();
    assert_eq!(by_all_models(&network, &intervals(), |a, b| Allen::of(a, b, 0.0))[1], RelationSet::EMPTY);
    assert_eq!(table.close(&mut network), Ok(()));
    assert_eq!(table.minimal(&network), Err(Inconsistent::NoScenario));
    assert_eq!(table.scenario(&network), None);
}

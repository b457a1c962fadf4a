//! Properties of relations without scenes: words, neighbours, converses and compositions.

use std::f64::consts::TAU;

use sketchnav_qualitative::Error;
use sketchnav_qualitative::algebra::{Compose, Converse, Relation, RelationSet};
use sketchnav_qualitative::allen::Allen;
use sketchnav_qualitative::cardinal::Direction;
use sketchnav_qualitative::dipole::{DraC, DraF};
use sketchnav_qualitative::doublecross::DoubleCross;
use sketchnav_qualitative::flipflop::FlipFlop;
use sketchnav_qualitative::mos::Motion;
use sketchnav_qualitative::opra::Opra;
use sketchnav_qualitative::order::Order;
use sketchnav_qualitative::qrpc::{Disposition, Qrpc};
use sketchnav_qualitative::qtc::{QtcB, QtcB22, QtcBc, QtcC, QtcC22};
use sketchnav_qualitative::rcc::{Rcc2, Rcc3, Rcc4, Rcc5, Rcc8};
use sketchnav_qualitative::rectangle::Rectangular;
use sketchnav_qualitative::tpcc::Tpcc;

use crate::point;

fn is_well_formed<R: Relation>(count: usize) {
    assert_eq!(R::all().count(), count, "{}", R::CALCULUS);
    assert_eq!(R::COUNT.max(count), R::COUNT);
    assert_eq!(R::from_index(R::COUNT), None);
    for (i, relation) in R::all().enumerate() {
        assert_eq!(relation.index(), i);
        assert_eq!(R::from_index(i), Some(relation));
        assert_eq!(relation.to_string().parse(), Ok(relation), "{relation}");
        assert!(!relation.is_neighbour(relation) && !relation.limits_to(relation));
        assert!(!relation.neighbours().is_empty() || count == 1, "{relation}");
        for other in R::all() {
            assert_eq!(relation.is_neighbour(other), other.is_neighbour(relation), "{relation}, {other}");
            assert!(!(relation.limits_to(other) && other.limits_to(relation)), "{relation}, {other}");
            if let Some(via) = relation.between(other) {
                assert!(via.is_neighbour(relation) && via.is_neighbour(other), "{relation}, {via}, {other}");
            }
        }
    }
    let error = "nonsense".parse::<R>().unwrap_err();
    assert!(matches!(error, Error::UnknownRelation { .. }), "{error}");
}

#[test]
fn every_relation_has_a_place_a_word_and_neighbours() {
    is_well_formed::<QtcB>(9);
    is_well_formed::<QtcC>(81);
    is_well_formed::<QtcBc>(90);
    is_well_formed::<QtcB22>(27);
    is_well_formed::<QtcC22>(257);
    is_well_formed::<DraC>(24);
    is_well_formed::<DraF>(72);
    is_well_formed::<DoubleCross>(17);
    is_well_formed::<Qrpc>(41);
    is_well_formed::<Disposition>(5);
    is_well_formed::<Motion>(2);
    is_well_formed::<Order>(3);
    is_well_formed::<Direction>(9);
    is_well_formed::<Allen>(13);
    is_well_formed::<Rectangular>(169);
    is_well_formed::<Rcc8>(8);
    is_well_formed::<Rcc5>(5);
    is_well_formed::<Rcc4>(4);
    is_well_formed::<Rcc3>(3);
    is_well_formed::<Rcc2>(2);
    is_well_formed::<Tpcc>(27);
    is_well_formed::<FlipFlop>(9);
    is_well_formed::<Opra<1>>(20);
    is_well_formed::<Opra<2>>(72);
    is_well_formed::<Opra<3>>(156);
    is_well_formed::<Opra<4>>(272);
}

fn edges<R: Relation>() -> usize {
    R::all().map(|relation| relation.neighbours().len()).sum::<usize>() / 2
}

#[test]
fn the_number_of_neighbours_agrees_with_the_literature() {
    // Van de Weghe 2004 gives 16 for QTC_B and 544 for QTC_C. Randell et al. 1992 give 11 for RCC8.
    assert_eq!([edges::<QtcB>(), edges::<QtcC>(), edges::<QtcBc>()], [16, 544, 16 + 544 + 225]);
    assert_eq!([edges::<Rcc8>(), edges::<Rcc5>(), edges::<Rcc2>()], [11, 6, 1]);
    assert_eq!(Rcc5::Po.neighbours().to_string(), "{dr pp ppi eq}");
    assert_eq!(edges::<Direction>(), 8 + 8);
}

fn converse_is_an_involution<R: Converse>() {
    for a in R::all() {
        assert_eq!(a.converse().converse(), a);
        for b in R::all() {
            assert_eq!(a.limits_to(b), a.converse().limits_to(b.converse()), "{a}, {b}");
        }
    }
}

#[test]
fn the_converse_of_the_converse_is_the_relation_and_keeps_neighbours() {
    converse_is_an_involution::<QtcB>();
    converse_is_an_involution::<QtcC>();
    converse_is_an_involution::<QtcBc>();
    converse_is_an_involution::<QtcB22>();
    converse_is_an_involution::<QtcC22>();
    converse_is_an_involution::<DraC>();
    converse_is_an_involution::<DraF>();
    converse_is_an_involution::<Order>();
    converse_is_an_involution::<Direction>();
    converse_is_an_involution::<Allen>();
    converse_is_an_involution::<Rectangular>();
    converse_is_an_involution::<Rcc8>();
    converse_is_an_involution::<Rcc5>();
    converse_is_an_involution::<Rcc3>();
    converse_is_an_involution::<Rcc2>();
    converse_is_an_involution::<Opra<1>>();
    converse_is_an_involution::<Opra<2>>();
    converse_is_an_involution::<Opra<3>>();
    converse_is_an_involution::<Opra<4>>();
    for a in Qrpc::all() {
        for b in Qrpc::all() {
            assert_eq!(a.converses().contains(b), b.converses().contains(a), "{a}, {b}");
        }
    }
    assert_eq!(Rcc4::Pp.converses().to_string(), "{pp ppi}");
    assert_eq!(Rcc4::Ppi.converses(), Rcc4::Pp.into());
}

fn composition_is_an_algebra<R: Compose + Converse>(identity: Option<R>) {
    for a in R::all() {
        if let Some(identity) = identity {
            assert_eq!(identity.compose(a), a.into());
            assert_eq!(a.compose(identity), a.into());
            assert!(a.compose(a.converse()).contains(identity), "{a}");
        }
        for b in R::all() {
            let composed = a.compose(b);
            assert_eq!(composed.converse(), b.converse().compose(a.converse()), "{a}, {b}");
            for c in composed.iter() {
                // A triangle can be read from each of its corners (Peirce's law).
                assert!(c.compose(b.converse()).contains(a), "{a}, {b}, {c}");
                assert!(a.converse().compose(c).contains(b), "{a}, {b}, {c}");
            }
        }
    }
}

#[test]
fn compositions_are_algebras() {
    composition_is_an_algebra(Some(Rcc8::Eq));
    composition_is_an_algebra(Some(Rcc5::Eq));
    composition_is_an_algebra::<Rcc3>(None);
    composition_is_an_algebra::<Rcc2>(None);
    composition_is_an_algebra(Some(Allen::Equal));
    composition_is_an_algebra(Some(Direction::Eq));
    composition_is_an_algebra(Some(Order::Together));
    composition_is_an_algebra("s_0".parse::<Opra<1>>().ok());
    composition_is_an_algebra("s_0".parse::<Opra<2>>().ok());
    composition_is_an_algebra("sese".parse::<DraC>().ok());
    composition_is_an_algebra("sese".parse::<DraF>().ok());
    composition_is_an_algebra::<QtcB22>(None);
    composition_is_an_algebra::<QtcC>(None);
}

#[test]
fn the_interval_algebra_has_409_compositions() {
    // The number of entries in the whole table of Allen 1983, figure 4.
    let entries = |a: Allen| Allen::all().map(|b| a.compose(b).len()).sum::<usize>();
    assert_eq!(Allen::all().map(entries).sum::<usize>(), 409);
    assert_eq!(Allen::Overlaps.compose(Allen::Overlaps).to_string(), "{< m o}");
    assert_eq!(Allen::During.compose(Allen::Contains).len(), 13);
    let ra = |word: &str| word.parse::<Rectangular>().unwrap();
    assert_eq!(ra("o,<").compose(ra("o,m")).to_string(), "{<,< m,< o,<}");
    let all = RelationSet::<Rectangular>::universal();
    assert_eq!(all.compose(ra("=,=").into()), all);
}

/// Returns the relation of regions made of cells on a line, given as bits. A line is enough for RCC8, whose consistent
/// networks can be drawn in any dimension (Renz 2002).
pub fn of_cells(a: u32, b: u32) -> Rcc8 {
    let grown = |cells: u32| cells | cells << 1 | cells >> 1;
    match (a == b, a & b, a & !b, b & !a) {
        (true, ..) => Rcc8::Eq,
        (_, 0, ..) if grown(a) & b == 0 => Rcc8::Dc,
        (_, 0, ..) => Rcc8::Ec,
        (_, _, 0, _) if grown(a) & !b == 0 => Rcc8::Ntpp,
        (_, _, 0, _) => Rcc8::Tpp,
        (_, _, _, 0) if grown(b) & !a == 0 => Rcc8::Ntppi,
        (_, _, _, 0) => Rcc8::Tppi,
        _ => Rcc8::Po,
    }
}

fn composition_agrees_with_random_regions<R: Compose + From<Rcc8>>() {
    let regions: Vec<_> = (1..1 << 6).map(|cells: u32| cells << 1).collect();
    let mut shown = vec![vec![RelationSet::<R>::EMPTY; R::COUNT]; R::COUNT];
    for a in &regions {
        for b in &regions {
            let first = R::from(of_cells(*a, *b)).index();
            for c in &regions {
                shown[first][R::from(of_cells(*b, *c)).index()].insert(of_cells(*a, *c).into());
            }
        }
    }
    for a in R::all() {
        for b in R::all() {
            assert_eq!(a.compose(b), shown[a.index()][b.index()], "{a}, {b}");
        }
    }
}

#[test]
fn the_tables_of_rcc_agree_with_all_regions_of_six_cells() {
    composition_agrees_with_random_regions::<Rcc8>();
    composition_agrees_with_random_regions::<Rcc5>();
    composition_agrees_with_random_regions::<Rcc4>();
    composition_agrees_with_random_regions::<Rcc3>();
    composition_agrees_with_random_regions::<Rcc2>();
}

#[test]
fn composed_directions_agree_with_vectors() {
    let radii = [0.3, 1.0, 2.0, 3.0, 4.0];
    let places = || (0..64).flat_map(|i| radii.map(|r| ((f64::from(i) + 0.3) * TAU / 64.0, r)));
    let place = |(angle, r): (f64, f64)| point([r * angle.cos(), r * angle.sin()]);
    let origin = point([0.0, 0.0]);
    let mut shown = vec![vec![RelationSet::<Direction>::EMPTY; 9]; 9];
    for a in places().map(place) {
        for c in places().map(place) {
            // The middle point is at the origin.
            let (first, next) = (Direction::of(a, origin), Direction::of(origin, c));
            shown[first.index()][next.index()].insert(Direction::of(a, c));
        }
    }
    for a in Direction::all().filter(|a| *a != Direction::Eq) {
        for b in Direction::all().filter(|b| *b != Direction::Eq) {
            assert_eq!(a.compose(b), shown[a.index()][b.index()], "{a}, {b}");
        }
    }
}

#[test]
fn relations_are_parsed_in_the_notations_of_the_literature() {
    for word in ["-,+,0,0", "-+00", "(- + 0 0)", "(−, +, 0, 0)", " - + 0 0 "] {
        let relation: QtcC = word.parse().unwrap();
        assert_eq!(relation.to_string(), "-,+,0,0", "{word}");
        assert_eq!(format!("{relation:#}"), "(- + 0 0)");
    }
    for word in ["", "-", "-,+,0", "-,+,0,0,0", "-,x", "(-,+"] {
        let error = word.parse::<QtcB>().unwrap_err().to_string();
        assert!(error.contains("qtcbs") && error.contains("-,-"), "{word}: {error}");
    }
    assert_eq!("NTPP".parse(), Ok(Rcc8::Ntpp));
    assert_eq!("[X - (+,-) +]".parse::<Qrpc>().unwrap().disposition(), Disposition::Crossed);
    // C cannot be behind both and yet leave i in front of j.
    assert!("[X - (-,-) +]".parse::<Qrpc>().is_err());
}

//! Checks that a stream in steady state does not allocate.

use sketchnav_qualitative::argd::{Bound, Scale};
use sketchnav_qualitative::cardinal::Directions;
use sketchnav_qualitative::dipole::{Dipole, Dipoles, FINE};
use sketchnav_qualitative::doublecross::Crosses;
use sketchnav_qualitative::hof::{Force, Pair, Polygon, View, Workspace};
use sketchnav_qualitative::qrpc::Projections;
use sketchnav_qualitative::rcc::{Rcc8, Regions};
use sketchnav_qualitative::rectangle::Rectangles;
use sketchnav_qualitative::tpcc::Configurations;
use sketchnav_qualitative::{Calculus, Options, Oriented, Point, Rect, Stream, qtc};
use sketchnav_runtime::{CountingAllocator, allocations_of_this_thread};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Returns a position on a walk through whole numbers that turns, jumps and rests.
fn walk(i: u32, salt: u32) -> [f64; 2] {
    let hash = |of: u32| f64::from(of.wrapping_mul(2_654_435_761).rotate_left(salt) % 7);
    [hash(i / 3), hash(i / 2 + 17 * salt)]
}

fn point(i: u32, salt: u32) -> Point {
    Point::try_from(walk(i, salt)).unwrap()
}

/// Checks that a stream does not allocate, with every option that adds work: insertions, jumps and gaps.
fn allocates_nothing<C: Calculus>(calculus: C, scene: impl Fn(u32) -> C::Scene) {
    let mut stream = Stream::new(calculus, Options { max_gap_s: Some(3.0), ..Options::default() });
    let mut found = 0;
    let before = allocations_of_this_thread();
    for i in 0..2000 {
        let is_seen = i % 50 != 49;
        let time_s = f64::from(i + i / 100 * 10);
        let step = stream.push(time_s, is_seen.then(|| scene(i))).unwrap();
        found += step.into_iter().count();
    }
    assert_eq!(allocations_of_this_thread() - before, 0);
    assert!(found > 100, "{found}");
}

#[test]
fn a_stream_allocates_nothing() {
    let points = |i| [point(i, 1), point(i, 2)];
    allocates_nothing(qtc::Basic::default(), points);
    allocates_nothing(qtc::DoubleCross::default(), points);
    allocates_nothing(qtc::Switching::default(), points);
    allocates_nothing(qtc::Speeds::default(), points);
    allocates_nothing(qtc::Angles::default(), points);
    allocates_nothing(Directions, points);
    allocates_nothing(Scale::new([("near", 2.0), ("far", 5.0)], Bound::Upper).unwrap(), points);
    allocates_nothing(Configurations::default(), |i| [point(i, 1), point(i, 2), point(i, 3)]);
    allocates_nothing(Crosses::default(), |i| [point(i, 1), point(i, 2), point(i, 3)]);
    let dipole = |i: u32| {
        let [x, y] = walk(i, 5);
        Dipole::new(point(i, 4), Point::new(x + 0.5, y).unwrap()).unwrap()
    };
    allocates_nothing(Dipoles::<FINE>::default(), |i| [dipole(i), dipole(i / 2)]);
    let rects =
        |i| [Rect::around(point(i, 1), 3.0, 2.0).unwrap(), Rect::around(point(i, 2), 2.0, 2.0).unwrap()];
    allocates_nothing(Regions::<Rcc8>::default(), rects);
    allocates_nothing(Rectangles::default(), rects);
    let oriented = |i: u32, salt| Oriented::new(point(i, salt), f64::from(i % 16)).unwrap();
    allocates_nothing(Projections::default(), |i| [oriented(i, 1), oriented(i / 2, 2)]);
}

#[test]
fn histograms_of_the_same_size_allocate_nothing() {
    let corners = |i: u32, at: f64| {
        (0..12).map(move |k| {
            let angle = f64::from(k) * std::f64::consts::FRAC_PI_6 + f64::from(i) * 0.1;
            let radius = 1.0 + 0.3 * f64::from(k % 3);
            Point::new(at + radius * angle.cos(), radius * angle.sin()).unwrap()
        })
    };
    let robot = Polygon::new(corners(0, 0.0).step_by(3)).unwrap();
    let mut object = Polygon::new(corners(0, 4.0)).unwrap();
    let (mut pair, mut workspace) = (Pair::new(&object, &robot), Workspace::default());
    let mut forces = [[Force::ZERO; 180]; 3];
    let mut step = |i: u32, pair: &mut Pair| {
        object.replace(corners(i, 4.0)).unwrap();
        pair.prepare(&object, &robot);
        for (r, forces) in [0.0, 1.0, 2.0].into_iter().zip(&mut forces) {
            pair.histogram_into(r, forces, &mut workspace).unwrap();
        }
        let [constant, _, gravitational] = &forces;
        View::new(constant, 0.3).assess_with(&View::new(gravitational, 0.3), 16).unwrap()
    };
    step(0, &mut pair);
    let before = allocations_of_this_thread();
    for i in 1..50 {
        assert_eq!(step(i, &mut pair).direction, 15);
    }
    assert_eq!(allocations_of_this_thread() - before, 0);
}

//! Checks that continuous motion passes only from neighbour to neighbour.

use std::f64::consts::TAU;
use std::fmt::Debug;

use proptest::prelude::*;
use sketchnav_qualitative::algebra::Relation;
use sketchnav_qualitative::allen::Allen;
use sketchnav_qualitative::argd::{Bound, Scale};
use sketchnav_qualitative::cardinal::Direction;
use sketchnav_qualitative::dipole::{Dipole, DraC, DraF};
use sketchnav_qualitative::doublecross::DoubleCross;
use sketchnav_qualitative::flipflop::FlipFlop;
use sketchnav_qualitative::mos::Motion;
use sketchnav_qualitative::opra::Opra;
use sketchnav_qualitative::qrpc::{Projections, Qrpc};
use sketchnav_qualitative::qtc::{QtcB, QtcB22, QtcBc, QtcC, QtcC22};
use sketchnav_qualitative::rcc::{Rcc5, Rcc8};
use sketchnav_qualitative::rectangle::Rectangular;
use sketchnav_qualitative::tpcc::Tpcc;
use sketchnav_qualitative::{Oriented, Point, Rect};

use crate::point;
use crate::scenes::anywhere;

/// A smooth curve: the sum of two circular motions.
#[derive(Debug, Clone, Copy)]
struct Curve([f64; 8]);

impl Curve {
    fn at(self, t: f64) -> [f64; 2] {
        let [x, y, r1, w1, p1, r2, w2, p2] = self.0;
        let part = |f: fn(f64) -> f64| r1 * f(w1 * t + p1) + r2 * f(w2 * t + p2);
        [x + part(f64::cos), y + part(f64::sin)]
    }

    fn point(self, t: f64) -> Point {
        point(self.at(t))
    }

    fn heading(self, t: f64) -> f64 {
        self.0[4] + self.0[3] * t
    }
}

fn curve() -> impl Strategy<Value = Curve> {
    (anywhere(), [0.5..4.0, -2.0..2.0, 0.0..TAU], [0.1..2.0, -3.0..3.0, 0.0..TAU])
        .prop_map(|([x, y], [r1, w1, p1], [r2, w2, p2])| Curve([x / 4.0, y / 4.0, r1, w1, p1, r2, w2, p2]))
}

/// Checks that a motion passes through neighbours even if some relations, such as equal speeds, hold only for an instant. Such
/// instants are never sampled, so the relations before and after one must have a neighbour in common.
fn passes_instants_only<R: Relation>(relation: impl Fn(f64) -> R) -> Result<(), TestCaseError> {
    let mut last = relation(0.0);
    // Two instants that follow each other within one step are treated as one, which must limit both.
    for i in 1..=30_000 {
        let now = relation(f64::from(i) * 1e-4);
        let shares = || R::all().any(|instant| last.limits_to(instant) && now.limits_to(instant));
        prop_assert!(last == now || last.is_neighbour(now) || shares(), "{last} to {now} at {i}");
        last = now;
    }
    Ok(())
}

/// Follows a motion from time 0 to 3. The interval between successive times is refined until the relations at its ends are
/// neighbours.
fn passes_neighbours_only<R: Relation>(relation: impl Fn(f64) -> R) -> Result<usize, TestCaseError> {
    fn refined<R: Relation>(
        f: &impl Fn(f64) -> R,
        from: (f64, R),
        to: (f64, R),
        depth: u32,
    ) -> Result<(), TestCaseError> {
        if from.1 == to.1 || from.1.is_neighbour(to.1) {
            return Ok(());
        }
        prop_assert!(depth < 45, "{} to {} at {}", from.1, to.1, from.0);
        let middle = (from.0 + to.0) / 2.0;
        let middle = (middle, f(middle));
        refined(f, from, middle, depth + 1)?;
        refined(f, middle, to, depth + 1)
    }
    let mut changes = 0;
    let mut last = (0.0, relation(0.0));
    for i in 1..=60 {
        let t = f64::from(i) * 0.05;
        let now = (t, relation(t));
        refined(&relation, last, now, 0)?;
        changes += usize::from(last.1 != now.1);
        last = now;
    }
    Ok(changes)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// A tolerance lets relations that would only hold for an instant, such as a sign of 0, last for a while.
    #[test]
    fn continuous_motion_passes_only_through_neighbours(k in curve(), l in curve(), m in curve(), sizes in [0.5..4.0, 0.5..4.0, 0.5..4.0, 0.5..4.0]) {
        let step = 1e-3;
        let motion = |curve: Curve, t: f64| [curve.point(t), curve.point(t + step)];
        let q = 0.05 * step;
        passes_neighbours_only(|t| QtcB::of(motion(k, t), motion(l, t), q))?;
        passes_neighbours_only(|t| QtcC::of(motion(k, t), motion(l, t), q))?;
        passes_neighbours_only(|t| {
            let relation = QtcC::of(motion(k, t), motion(l, t), q);
            let is_near = k.point(t).distance(l.point(t)) <= 2.0;
            if is_near { QtcBc::Near(relation) } else { QtcBc::Far(relation.basic()) }
        })?;
        passes_neighbours_only(|t| Motion::of(k.point(t), k.point(t + step), step))?;
        passes_neighbours_only(|t| Tpcc::of(k.point(t), l.point(t), m.point(t), 0.02))?;
        passes_neighbours_only(|t| FlipFlop::of(k.point(t), l.point(t), m.point(t), 0.02))?;
        passes_neighbours_only(|t| FlipFlop::of(k.point(t), l.point(t), m.point(t), 1.0))?;
        passes_neighbours_only(|t| DoubleCross::of(k.point(t), l.point(t), m.point(t), 0.02))?;
        passes_neighbours_only(|t| DoubleCross::of(k.point(t), l.point(t), m.point(t), 1.0))?;
        passes_neighbours_only(|t| Direction::of(k.point(t), l.point(t)))?;
        let [a, b, c, d] = sizes;
        let rects = |t: f64| {
            let breath = 1.0 + 0.2 * t.sin();
            [Rect::around(k.point(t), a, b * breath).unwrap(), Rect::around(l.point(t), c * breath, d).unwrap()]
        };
        passes_neighbours_only(|t| { let [a, b] = rects(t); Allen::of(a.x(), b.x(), 0.01) })?;
        passes_neighbours_only(|t| { let [a, b] = rects(t); Rectangular::of(a, b, 0.01) })?;
        passes_neighbours_only(|t| { let [a, b] = rects(t); Rcc8::of(a, b, 0.01) })?;
        passes_neighbours_only(|t| { let [a, b] = rects(t); Rcc5::from(Rcc8::of(a, b, 0.01)) })?;
        let scale = Scale::new([("near", 1.0), ("far", 4.0)], Bound::Lower).unwrap();
        passes_neighbours_only(|t| scale.rank(k.point(t).distance(l.point(t))))?;
        let oriented = |curve: Curve, t: f64| Oriented::new(curve.point(t), curve.heading(t)).unwrap();
        let tolerances = Projections::new(1e-7, 1e-7).unwrap();
        passes_neighbours_only(|t| Qrpc::of(oriented(k, t), oriented(l, t), &tolerances))?;
        passes_neighbours_only(|t| Opra::<1>::of(oriented(k, t), oriented(l, t), 0.01))?;
        passes_neighbours_only(|t| Opra::<4>::of(oriented(k, t), oriented(l, t), 0.01))?;
        // Points that stay together only turn, and those that meet do so at the origin.
        let turning = |at: [f64; 2], of: Curve, t: f64| Oriented::new(point(at), of.heading(t)).unwrap();
        passes_neighbours_only(|t| Opra::<2>::of(turning([0.0; 2], k, t), turning([0.0; 2], l, t), 0.01))?;
        let meeting = |t: f64| { let apart = (1.5 - t).max(0.0); [apart * a, apart * b] };
        // Where points meet, the two directions, each within the tolerance, become one whose error may be twice as large. The
        // tolerance is therefore so small that this makes no difference.
        passes_neighbours_only(|t| Opra::<2>::of(turning([0.0; 2], k, t), turning(meeting(t), l, t), 1e-9))?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn speeds_and_dipoles_change_through_instants(ends in [curve(), curve(), curve(), curve()]) {
        let step = 1e-3;
        let [k, l, ..] = ends;
        let motion = |curve: Curve, t: f64| [curve.point(t), curve.point(t + step)];
        passes_instants_only(|t| QtcB22::of(motion(k, t), motion(l, t), 0.0))?;
        passes_instants_only(|t| QtcC22::of(motion(k, t), motion(l, t), 0.0))?;
        let dipole = |of: [Curve; 2], t: f64| {
            let [start, end] = of.map(|end| end.point(t));
            Dipole::new(start, end).unwrap()
        };
        let [a, b] = [[ends[0], ends[1]], [ends[2], ends[3]]];
        passes_instants_only(|t| DraF::of(dipole(a, t), dipole(b, t), 0.0).unwrap())?;
        passes_instants_only(|t| DraC::of(dipole(a, t), dipole(b, t), 0.0).unwrap())?;
    }
}

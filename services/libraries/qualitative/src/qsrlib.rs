//! Reproduces the results of QSRlib (Gatsoulis et al. 2016; strands_qsr_lib 0.4.1) relation for relation, for comparison or
//! as a replacement.
//!
//! QSRlib differs from this crate's own calculi as follows:
//!
//! - **QTC**: if both points coincide, all signs are 0. Times are counted from 1, unless neither collapsing nor validation
//!   is on. When the distance passes the threshold, QTC_BC may insert a relation that continuous motion cannot reach
//!   (compare [`crate::qtc::QtcBc`]). Every object must be seen at all times.
//! - **RCC**: regions with a gap of up to twice the quantisation are connected. With a quantisation above 0, regions that
//!   touch or are less than the quantisation apart count as overlapping.
//! - **RCC4**: equal regions are `pp` in both directions.
//! - **Directions**: the cones are half open. Each includes its counter-clockwise border only.
//! - **TPCC**: a border at 45° belongs to the next sector counter-clockwise. If origin and relatum coincide, the direction
//!   of sight is taken to be east. Positions are straight within 0.26° of a right angle, but only within 0.0006° of the
//!   line of sight. QSRlib fails on some points straight ahead. This is not reproduced: `sb` is returned for them.
//!
//! `argprobd` is left out because it draws random numbers.

use std::f64::consts::{PI, TAU};
use std::fmt;
use std::str::FromStr;

use crate::algebra::{Relation, words};
use crate::allen::Allen;
use crate::argd::{Rank, Scale};
use crate::cardinal::Direction;
use crate::error::Error;
use crate::geometry::Point;
use crate::mos::Motion;
use crate::order::Order;
use crate::qtc::{self, PERSONAL_SPACE_M, QtcB, QtcBc, QtcC};
use crate::rcc::Rcc8;
use crate::rectangle::Rectangular;
use crate::tpcc::Tpcc;

/// A bounding box, as x and y of its low corner followed by x and y of its high corner. It may have no extent.
pub type Box2 = [f64; 4];

words! {
    /// The calculi of QSRlib, named by its identifiers.
    Which, "qsrlib", limits = |_, _| false, {
        /// Distances.
        Argd = "argd",
        /// Cardinal directions.
        Cardir = "cardir",
        /// Moving or stationary.
        Mos = "mos",
        /// Order along x.
        Mwe = "mwe",
        /// QTC_BC.
        Qtcbcs = "qtcbcs",
        /// QTC_B.
        Qtcbs = "qtcbs",
        /// QTC_C.
        Qtccs = "qtccs",
        /// Rectangle algebra.
        Ra = "ra",
        /// RCC2.
        Rcc2 = "rcc2",
        /// RCC3.
        Rcc3 = "rcc3",
        /// RCC4.
        Rcc4 = "rcc4",
        /// RCC5.
        Rcc5 = "rcc5",
        /// RCC8.
        Rcc8 = "rcc8",
        /// Ternary point configurations.
        Tpcc = "tpcc",
    }
}

impl Which {
    /// Returns the number of objects in a relation.
    pub const fn arity(self) -> usize {
        match self {
            Self::Mos => 1,
            Self::Tpcc => 3,
            _ => 2,
        }
    }
}

/// The parameters that QSRlib calls `dynamic_args`.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// `quantisation_factor`.
    pub quantisation_factor: f64,
    /// `validate`, for QTC.
    pub validate: bool,
    /// `no_collapse`, for QTC.
    pub no_collapse: bool,
    /// `distance_threshold`, for QTC_BC.
    pub distance_threshold: f64,
    /// `qsr_relations_and_values`, for distances.
    pub scale: Option<Scale>,
    /// `qsrs_for`, the objects to relate, in the order in which the relation takes them. `None` relates all permutations.
    pub qsrs_for: Option<Vec<Vec<String>>>,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            quantisation_factor: 0.0,
            validate: true,
            no_collapse: false,
            distance_threshold: PERSONAL_SPACE_M,
            scale: None,
            qsrs_for: None,
        }
    }
}

/// The state of an object at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectState {
    /// Position of the object.
    pub position: Point,
    /// Size in x and y, which is 0 for a point.
    pub size: [f64; 2],
}

impl ObjectState {
    /// Returns the bounding box.
    pub fn bounds(&self) -> Box2 {
        let ([x, y], [width, height]) = (<[f64; 2]>::from(self.position), self.size);
        [x - width / 2.0, y - height / 2.0, x + width / 2.0, y + height / 2.0]
    }
}

/// Objects over time. This is QSRlib's `World_Trace`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct World {
    /// The names of the objects, sorted.
    pub names: Vec<String>,
    /// The time of each sample, with the states of the objects in the order of their names.
    pub states: Vec<(f64, Vec<ObjectState>)>,
}

/// The time that QSRlib reports for a relation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum At {
    /// The time of the sample. For relations of motion, the time of the later sample.
    Time(f64),
    /// The position in the series, counted from 1. Used for QTC that was collapsed or validated.
    Place(usize),
}

/// A relation as reported by QSRlib.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// The time of the relation.
    pub at: At,
    /// The names of the related objects, separated by commas.
    pub between: String,
    /// The relation's word.
    pub relation: String,
}

impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Time(time) => write!(f, "{time:?}"),
            Self::Place(place) => write!(f, "{place}"),
        }
    }
}

/// Returns all relations of a world, ordered by objects and then by time.
///
/// # Errors
/// [`Error::Object`] if an entry of `qsrs_for` names an unknown object, or too few or too many objects;
/// [`Error::Thresholds`] if distances are requested without a scale.
pub fn request(which: Which, world: &World, parameters: &Parameters) -> Result<Vec<Answer>, Error> {
    let mut answers = Vec::new();
    for objects in tuples(which, world, parameters)? {
        let names: Vec<_> = objects.iter().map(|at| world.names[*at].as_str()).collect();
        let between = names.join(",");
        let relations = relations(which, world, &objects, parameters)?;
        answers.extend(relations.into_iter().map(|(at, relation)| Answer {
            at,
            between: between.clone(),
            relation,
        }));
    }
    Ok(answers)
}

/// Returns the tuples of objects to relate, as indices.
fn tuples(which: Which, world: &World, parameters: &Parameters) -> Result<Vec<Vec<usize>>, Error> {
    let Some(asked) = &parameters.qsrs_for else {
        return Ok(permutations(world.names.len(), which.arity()));
    };
    let unknown = |found: &str| Error::Object { expected: world.names.join(" "), found: found.to_owned() };
    let place = |name: &String| world.names.iter().position(|own| own == name).ok_or_else(|| unknown(name));
    let tuple = |names: &Vec<String>| {
        let places: Vec<_> = names.iter().map(place).collect::<Result<_, _>>()?;
        if places.len() == which.arity() { Ok(places) } else { Err(unknown(&names.join(","))) }
    };
    asked.iter().map(tuple).collect()
}

/// Returns all ordered selections of `arity` of the numbers below `count`.
fn permutations(count: usize, arity: usize) -> Vec<Vec<usize>> {
    if arity == 0 {
        return vec![Vec::new()];
    }
    let shorter = permutations(count, arity - 1);
    let longer = shorter.into_iter().flat_map(|shorter| {
        let others: Vec<_> = (0..count).filter(|next| !shorter.contains(next)).collect();
        others.into_iter().map(move |next| [shorter.as_slice(), &[next]].concat())
    });
    longer.collect()
}

fn relations(
    which: Which,
    world: &World,
    objects: &[usize],
    parameters: &Parameters,
) -> Result<Vec<(At, String)>, Error> {
    let q = parameters.quantisation_factor;
    let scene =
        |states: &[ObjectState]| -> Vec<ObjectState> { objects.iter().map(|at| states[*at]).collect() };
    let of_time = |relate: &dyn Fn(&[ObjectState]) -> String| {
        let states = world.states.iter();
        states.map(|(time, states)| (At::Time(*time), relate(&scene(states)))).collect::<Vec<_>>()
    };
    let of_boxes = |relate: &dyn Fn(Box2, Box2) -> String| {
        of_time(&|scene| relate(scene[0].bounds(), scene[1].bounds()))
    };
    let of_points = |relate: &dyn Fn(Point, Point) -> String| {
        of_time(&|scene| relate(scene[0].position, scene[1].position))
    };
    Ok(match which {
        Which::Argd => {
            let scale = parameters.scale.as_ref();
            let scale = scale.ok_or(Error::Thresholds { limit: crate::argd::MAX_THRESHOLDS, found: 0 })?;
            let label = |rank: Rank| scale.label(rank).unwrap_or_default().to_owned();
            of_points(&|a, b| label(scale.rank(a.distance(b))))
        }
        Which::Cardir => of_boxes(&|a, b| direction(a, b).to_string()),
        Which::Mwe => of_points(&|a, b| Order::of(a, b).to_string()),
        Which::Ra => of_boxes(&|a, b| rectangular(a, b).to_string()),
        Which::Rcc2 => of_boxes(&|a, b| crate::rcc::Rcc2::from(rcc8(a, b, q)).to_string()),
        Which::Rcc3 => of_boxes(&|a, b| crate::rcc::Rcc3::from(rcc8(a, b, q)).to_string()),
        Which::Rcc4 => of_boxes(&|a, b| crate::rcc::Rcc4::from(rcc8(a, b, q)).to_string()),
        Which::Rcc5 => of_boxes(&|a, b| crate::rcc::Rcc5::from(rcc8(a, b, q)).to_string()),
        Which::Rcc8 => of_boxes(&|a, b| rcc8(a, b, q).to_string()),
        Which::Tpcc => {
            of_time(&|scene| tpcc(scene[0].position, scene[1].position, scene[2].position).to_string())
        }
        Which::Mos => {
            let moved = |before: &[ObjectState], now: &[ObjectState]| {
                Motion::of(before[objects[0]].position, now[objects[0]].position, q).to_string()
            };
            let steps = world.states.windows(2);
            steps.map(|step| (At::Time(step[1].0), moved(&step[0].1, &step[1].1))).collect()
        }
        Which::Qtcbs | Which::Qtccs | Which::Qtcbcs => {
            let points = world.states.iter().map(|(_, states)| [states[objects[0]], states[objects[1]]]);
            let points: Vec<_> = points.map(|pair| pair.map(|state| state.position)).collect();
            let is_timed = parameters.no_collapse && !parameters.validate;
            let at = |i: usize| if is_timed { At::Time(world.states[i + 1].0) } else { At::Place(i + 1) };
            let found = qtc(which, &points, parameters);
            found.into_iter().enumerate().map(|(i, relation)| (at(i), relation.to_string())).collect()
        }
    })
}

/// Returns the QTC series of two points, collapsed and then validated if `parameters` ask for it. QTC_B is returned as
/// [`QtcBc::Far`] and QTC_C as [`QtcBc::Near`].
pub fn qtc(which: Which, points: &[[Point; 2]], parameters: &Parameters) -> Vec<QtcBc> {
    let steps = points.windows(2).map(|step| {
        let relation =
            qtc_c([step[0][0], step[1][0]], [step[0][1], step[1][1]], parameters.quantisation_factor);
        let is_near = match which {
            Which::Qtccs => true,
            Which::Qtcbs => false,
            _ => step[1][0].distance(step[1][1]) <= parameters.distance_threshold,
        };
        if is_near { QtcBc::Near(relation) } else { QtcBc::Far(relation.basic()) }
    });
    let mut states: Vec<_> = steps.collect();
    if !parameters.no_collapse {
        states.dedup();
    }
    if parameters.validate { validated(&states) } else { states }
}

/// Returns the relation of QSRlib's QTC_C, in which coincident points have only zeros because their distance from the
/// double cross is 0.
fn qtc_c(k: [Point; 2], l: [Point; 2], quantisation: f64) -> QtcC {
    let is_cross = k[0] != l[0];
    if is_cross { QtcC::of(k, l, quantisation) } else { QtcC::from_signs([qtc::Sign::Zero; 4]) }
}

/// Returns the series, including the states that QSRlib inserts.
fn validated(states: &[QtcBc]) -> Vec<QtcBc> {
    let mut found = Vec::with_capacity(states.len());
    for (i, state) in states.iter().enumerate() {
        found.extend(i.checked_sub(1).and_then(|before| inserted(states[before], *state)));
        found.push(*state);
    }
    found
}

/// Returns the state that QSRlib inserts between two others, if any. When the distance passes the threshold, QSRlib only
/// looks at the first two signs and gives the inserted state the form of the later one.
fn inserted(before: QtcBc, now: QtcBc) -> Option<QtcBc> {
    match (before, now) {
        (QtcBc::Near(before), QtcBc::Near(now)) => {
            qtc::inserted(before.signs(), now.signs()).map(QtcC::from_signs).map(QtcBc::Near)
        }
        _ => {
            let via = qtc::inserted(before.basic().signs(), now.basic().signs()).map(QtcB::from_signs)?;
            Some(match now {
                QtcBc::Far(_) => QtcBc::Far(via),
                QtcBc::Near(now) => QtcBc::Near(QtcC { k: via.k, l: via.l, ..now }),
            })
        }
    }
}

/// Returns QSRlib's RCC8 relation of bounding boxes, with `q` as the quantisation.
pub fn rcc8(a: Box2, b: Box2, q: f64) -> Rcc8 {
    let ([ax, ay, bx, by], [cx, cy, dx, dy]) = (a, b);
    if a == b {
        return Rcc8::Eq;
    }
    if ax - q > dx + q || bx + q < cx - q || ay - q > dy + q || by + q < cy - q {
        return Rcc8::Dc;
    }
    let b_inside = ax <= cx && ay <= cy && bx >= dx && by >= dy;
    let a_inside = ax >= cx && ay >= cy && bx <= dx && by <= dy;
    let is_same = |a: f64, b: f64| (a - b).abs() <= q;
    let shares = |a: [f64; 2], b: [f64; 2]| a.iter().any(|a| b.iter().any(|b| is_same(*a, *b)));
    let is_tangential = shares([ax, bx], [cx, dx]) || shares([ay, by], [cy, dy]);
    match (a_inside, b_inside, is_tangential) {
        (true, _, true) => return Rcc8::Tpp,
        (_, true, true) => return Rcc8::Tppi,
        (true, ..) => return Rcc8::Ntpp,
        (_, true, _) => return Rcc8::Ntppi,
        _ => {}
    }
    // True if the low side of one box and the high side of the other are between q and 2 q apart.
    let touches = |low: f64, high: f64| low - q <= high + q && low - q >= high;
    let is_touching = touches(cx, bx) || touches(ax, dx) || touches(cy, by) || touches(ay, dy);
    if is_touching { Rcc8::Ec } else { Rcc8::Po }
}

/// Returns QSRlib's rectangle algebra relation of bounding boxes.
pub fn rectangular(a: Box2, b: Box2) -> Rectangular {
    Rectangular { x: allen([a[0], a[2]], [b[0], b[2]]), y: allen([a[1], a[3]], [b[1], b[3]]) }
}

fn allen(a: [f64; 2], b: [f64; 2]) -> Allen {
    use crate::algebra::Converse;
    let [[a0, a1], [b0, b1]] = [a, b];
    let first = |[a0, a1]: [f64; 2], [b0, b1]: [f64; 2]| {
        if a1 < b0 {
            Some(Allen::Before)
        } else if a1 == b0 {
            Some(Allen::Meets)
        } else if a0 < b0 && b0 < a1 && a1 < b1 {
            Some(Allen::Overlaps)
        } else if a0 == b0 && a1 < b1 {
            Some(Allen::Starts)
        } else if b0 < a0 && a0 < b1 && b0 < a1 && a1 < b1 {
            Some(Allen::During)
        } else if b0 < a0 && a0 < b1 && a1 == b1 {
            Some(Allen::Finishes)
        } else {
            None
        }
    };
    first([a0, a1], [b0, b1])
        .or_else(|| first([b0, b1], [a0, a1]).map(Allen::converse))
        .unwrap_or(Allen::Equal)
}

/// Returns QSRlib's direction between the centres of bounding boxes.
pub fn direction(a: Box2, b: Box2) -> Direction {
    let dx = (b[0] + b[2]) / 2.0 - (a[0] + a[2]) / 2.0;
    let dy = (b[1] + b[3]) / 2.0 - (a[1] + a[3]) / 2.0;
    if dx == 0.0 && dy == 0.0 {
        return Direction::Eq;
    }
    let angle = dx.atan2(dy) * (180.0 / PI) + 22.5;
    let angle = if angle < 0.0 { 360.0 + angle } else { angle };
    // Cone 0 is south: the angle is that of b as seen from a, so b is north of a and a is south of b.
    Direction::from_index(((angle / 45.0).floor() as usize + 4) % 8).unwrap_or(Direction::S)
}

/// Returns QSRlib's TPCC relation.
pub fn tpcc(origin: Point, relatum: Point, referent: Point) -> Tpcc {
    let base = origin.distance(relatum);
    let distance = referent.distance(relatum);
    if distance == 0.0 {
        return Tpcc::Sam;
    }
    let turned = |angle: f64| if angle < 0.0 { angle + TAU } else { angle };
    let angle = |from: Point, to: Point| turned((to.y() - from.y()).atan2(to.x() - from.x()));
    let relative = turned(angle(relatum, referent) - angle(origin, relatum));
    let sine = relative.sin().abs();
    let is_straight = !(0.00001..=0.99999).contains(&sine);
    const SECTORS: [&str; 8] = ["lb", "bl", "fl", "lf", "rf", "fr", "br", "rb"];
    // Rounding may yield a full turn.
    let sector = SECTORS[(relative / (TAU / 8.0)) as usize % 8];
    let range = if distance > base { "d" } else { "c" };
    let word = if is_straight { format!("{range}s{}", &sector[1..]) } else { format!("{range}{sector}") };
    Tpcc::from_str(&word).unwrap_or(Tpcc::Sam)
}

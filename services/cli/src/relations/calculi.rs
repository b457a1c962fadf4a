//! The calculi, selected by name, and the series of relations that each of them computes.

use std::fmt::Display;

use anyhow::{Context, bail, ensure};
use clap::ValueEnum;
use sketchnav_qualitative::dipole::{COARSE, Dipole, Dipoles, FINE};
use sketchnav_qualitative::rcc::{Rcc2, Rcc3, Rcc4, Rcc5, Rcc8, Regions};
use sketchnav_qualitative::{
    Calculus, Change, Interval, Options, Oriented, Point, Quantisation, Rect, allen, argd, cardinal,
    doublecross, flipflop, mos, opra, order, qrpc, qtc, rectangle, series as series_of, tpcc,
};

use super::association::Scene;
use super::forces::{Extended, Forces};
use super::{Body, Held, RelationsOptions, Track};

/// The calculi.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Word {
    /// Towards or away: two points in motion.
    QtcB,
    /// Like qtc-b, with the side to which each point moves.
    QtcC,
    /// Like qtc-c, but with the sides only while the two points are near each other.
    QtcBc,
    /// Like qtc-b, with the relative speed.
    #[value(name = "qtc-b22")]
    QtcB22,
    /// Like qtc-c, with the relative speed and the relative angle of the motions to the line between the points.
    #[value(name = "qtc-c22")]
    QtcC22,
    /// Moving or stationary: one point.
    Mos,
    /// Rectilinear projections: two points with headings.
    Qrpc,
    /// Oriented points with 4 segments each: two points with headings.
    #[value(name = "opra-1")]
    Opra1,
    /// Oriented points with 8 segments each: two points with headings.
    #[value(name = "opra-2")]
    Opra2,
    /// Oriented points with 12 segments each: two points with headings.
    #[value(name = "opra-3")]
    Opra3,
    /// Oriented points with 16 segments each: two points with headings.
    #[value(name = "opra-4")]
    Opra4,
    /// Dipoles, 24 relations: two segments through points, by heading and length.
    DraC,
    /// Dipoles, 72 relations: two segments through points, by heading and length.
    DraF,
    /// Distances by named thresholds.
    Argd,
    /// Cardinal directions.
    Cardinal,
    /// Order along the x axis.
    Order,
    /// Interval algebra of the extents along the x axis: two boxes.
    Allen,
    /// Rectangle algebra: two boxes.
    Rectangle,
    /// Region connection, 2 relations: two boxes.
    Rcc2,
    /// Region connection, 3 relations: two boxes.
    Rcc3,
    /// Region connection, 4 relations: two boxes.
    Rcc4,
    /// Region connection, 5 relations: two boxes.
    Rcc5,
    /// Region connection, 8 relations: two boxes.
    Rcc8,
    /// Flip-flop: where a third point is as seen on the way from the first to the second.
    #[value(name = "flipflop")]
    FlipFlop,
    /// Histogram of forces: in which of 16 directions, counter-clockwise from the heading of the second box, the first one is,
    /// and how well that describes it.
    Forces,
    /// Double cross: like flipflop, with the perpendiculars at the first and the second point.
    #[value(name = "doublecross")]
    DoubleCross,
    /// Ternary point configurations: three points.
    Tpcc,
}

impl Word {
    /// Returns the number of objects that a relation of this calculus has as arguments.
    pub fn arguments(self) -> usize {
        match self {
            Self::Mos => 1,
            Self::DoubleCross | Self::FlipFlop | Self::Tpcc => 3,
            _ => 2,
        }
    }
}

/// Computes the relations of `tracks`, of which there must be as many as the calculus takes, in the given scenes.
///
/// # Errors
/// If a parameter is invalid, or a table lacks columns that the calculus needs.
pub fn series(tracks: &[&Track], scenes: &[Scene], options: &RelationsOptions) -> anyhow::Result<Vec<Held>> {
    let of_points = Scenes { tracks, scenes, options };
    match options.calculus {
        Word::QtcB => of_points.two(qtc::Basic { quantisation: quantisation(options)? }, point),
        Word::QtcC => of_points.two(qtc::DoubleCross { quantisation: quantisation(options)? }, point),
        Word::QtcBc => of_points.two(qtc::Switching::new(quantisation(options)?, options.near_m)?, point),
        Word::QtcB22 => of_points.two(qtc::Speeds { quantisation: quantisation(options)? }, point),
        Word::QtcC22 => of_points.two(qtc::Angles { quantisation: quantisation(options)? }, point),
        Word::Mos => of_points.one(mos::Motions { quantisation: quantisation(options)? }, point),
        Word::Qrpc => of_points.two(qrpc::Projections::default(), oriented),
        Word::Opra1 => of_points.two(opra::Orientations::<1>::default(), oriented),
        Word::Opra2 => of_points.two(opra::Orientations::<2>::default(), oriented),
        Word::Opra3 => of_points.two(opra::Orientations::<3>::default(), oriented),
        Word::Opra4 => of_points.two(opra::Orientations::<4>::default(), oriented),
        Word::DraC => of_points.two(Dipoles::<COARSE>::new(options.tolerance_m)?, dipole),
        Word::DraF => of_points.two(Dipoles::<FINE>::new(options.tolerance_m)?, dipole),
        Word::Argd => of_points.argd(scale(options)?),
        Word::Cardinal => of_points.two(cardinal::Directions, point),
        Word::Order => of_points.two(order::Orders, point),
        Word::Allen => of_points.two(allen::Intervals::new(options.tolerance_m)?, extent),
        Word::Rectangle => of_points.two(rectangle::Rectangles::new(options.tolerance_m)?, rect),
        Word::Rcc2 => of_points.two(Regions::<Rcc2>::new(options.tolerance_m)?, rect),
        Word::Rcc3 => of_points.two(Regions::<Rcc3>::new(options.tolerance_m)?, rect),
        Word::Rcc4 => of_points.two(Regions::<Rcc4>::new(options.tolerance_m)?, rect),
        Word::Rcc5 => of_points.two(Regions::<Rcc5>::new(options.tolerance_m)?, rect),
        Word::Rcc8 => of_points.two(Regions::<Rcc8>::new(options.tolerance_m)?, rect),
        Word::Forces => of_points.two(Forces, extended),
        Word::DoubleCross => of_points.three(doublecross::Crosses::new(options.tolerance_m)?, point),
        Word::FlipFlop => of_points.three(flipflop::Ways::new(options.tolerance_m)?, point),
        Word::Tpcc => of_points.three(tpcc::Configurations::default(), point),
    }
}

fn quantisation(options: &RelationsOptions) -> anyhow::Result<Quantisation> {
    Ok(match (options.quantisation_m, options.quantisation_mps) {
        (Some(distance_m), _) => Quantisation::distance(distance_m)?,
        (None, Some(speed_mps)) => Quantisation::speed(speed_mps)?,
        (None, None) => Quantisation::NONE,
    })
}

fn scale(options: &RelationsOptions) -> anyhow::Result<argd::Scale> {
    let parsed = options.thresholds.iter().map(|threshold| {
        let parts = threshold.split_once('=');
        let number = parts.and_then(|(label, bound)| Some((label.to_owned(), bound.parse::<f64>().ok()?)));
        number.with_context(|| format!("--thresholds: expected LABEL=METRES, found {threshold:?}"))
    });
    let parsed = parsed.collect::<anyhow::Result<Vec<_>>>()?;
    Ok(argd::Scale::new(parsed, options.bound)?)
}

/// Converts an object's sample to the type that the calculus takes. `before` is the object's previous sample.
type Make<T> = fn(before: Option<&Body>, now: &Body) -> anyhow::Result<Option<T>>;

fn point(_: Option<&Body>, now: &Body) -> anyhow::Result<Option<Point>> {
    Ok(Some(Point::try_from(now.at)?))
}

/// Orients a point. If the sample has no heading, the direction of motion is used, which an object at rest does not
/// have.
fn oriented(before: Option<&Body>, now: &Body) -> anyhow::Result<Option<Oriented>> {
    let at = Point::try_from(now.at)?;
    match (now.heading_rad, before) {
        (Some(heading_rad), _) => Ok(Some(Oriented::new(at, heading_rad)?)),
        (None, Some(before)) => Ok(Oriented::from_motion(Point::try_from(before.at)?, at)),
        (None, None) => Ok(None),
    }
}

/// Returns the dipole of an object's length along its heading, with the position in its middle.
fn dipole(before: Option<&Body>, now: &Body) -> anyhow::Result<Option<Dipole>> {
    let Some([length_m, _]) = now.size_m else {
        bail!("expected the columns length_m and width_m for a calculus of dipoles, found none");
    };
    let Some(oriented) = oriented(before, now)? else { return Ok(None) };
    let ([x, y], ahead) = (now.at, oriented.direction());
    let end = |by_m: f64| Point::new(x + by_m * ahead.x, y + by_m * ahead.y);
    Ok(Some(Dipole::new(end(-length_m / 2.0)?, end(length_m / 2.0)?)?))
}

/// Returns a box with the heading of the object. Without one, directions are counted from the x axis.
fn extended(before: Option<&Body>, now: &Body) -> anyhow::Result<Option<Extended>> {
    let heading_rad = now.heading_rad.unwrap_or_default();
    Ok(rect(before, now)?.map(|rect| Extended { rect, heading_rad }))
}

fn rect(_: Option<&Body>, now: &Body) -> anyhow::Result<Option<Rect>> {
    let Some([length_m, width_m]) = now.size_m else {
        bail!("expected the columns length_m and width_m for a calculus of boxes, found none");
    };
    Ok(Some(Rect::around(Point::try_from(now.at)?, length_m, width_m)?))
}

/// Returns the extent of a box along the x axis.
fn extent(before: Option<&Body>, now: &Body) -> anyhow::Result<Option<Interval>> {
    Ok(rect(before, now)?.map(|rect| rect.x()))
}

/// Returns the word for how a relation follows the previous one, for people and programs.
fn word(change: Change) -> &'static str {
    match change {
        Change::First => "first",
        Change::Same => "same",
        Change::Neighbour => "neighbour",
        Change::Jump => "jump",
        Change::Inserted => "inserted",
    }
}

/// Some objects and the scenes that show them.
struct Scenes<'a> {
    tracks: &'a [&'a Track],
    scenes: &'a [Scene],
    options: &'a RelationsOptions,
}

impl Scenes<'_> {
    fn one<T: Copy, C>(&self, calculus: C, make: Make<T>) -> anyhow::Result<Vec<Held>>
    where
        C: Calculus<Scene = T>,
        C::Relation: Display,
    {
        self.held(
            calculus,
            self.scenes::<T, 1>(make)?.into_iter().map(|(at, scene)| (at, scene.map(|[a]| a))),
        )
    }

    fn two<T: Copy, C>(&self, calculus: C, make: Make<T>) -> anyhow::Result<Vec<Held>>
    where
        C: Calculus<Scene = [T; 2]>,
        C::Relation: Display,
    {
        self.held(calculus, self.scenes::<T, 2>(make)?)
    }

    fn three<T: Copy, C>(&self, calculus: C, make: Make<T>) -> anyhow::Result<Vec<Held>>
    where
        C: Calculus<Scene = [T; 3]>,
        C::Relation: Display,
    {
        self.held(calculus, self.scenes::<T, 3>(make)?)
    }

    /// Computes the relations of argd. They are ranks, which are replaced by their labels for people to read.
    fn argd(&self, scale: argd::Scale) -> anyhow::Result<Vec<Held>> {
        let label = |rank| scale.label(rank).unwrap_or_default().to_owned();
        self.said(scale.clone(), self.scenes::<Point, 2>(point)?, label)
    }

    fn held<C: Calculus>(
        &self,
        calculus: C,
        scenes: impl IntoIterator<Item = (f64, Option<C::Scene>)>,
    ) -> anyhow::Result<Vec<Held>>
    where
        C::Relation: Display,
    {
        self.said(calculus, scenes, |relation| relation.to_string())
    }

    fn said<C: Calculus>(
        &self,
        calculus: C,
        scenes: impl IntoIterator<Item = (f64, Option<C::Scene>)>,
        say: impl Fn(C::Relation) -> String,
    ) -> anyhow::Result<Vec<Held>> {
        let options = Options {
            collapse: !self.options.every_sample,
            validate: !self.options.observed_only,
            max_gap_s: self.options.max_gap_s,
        };
        let found = series_of(calculus, options, scenes)?;
        let held = found.into_iter().map(|timed| Held {
            from_s: timed.from_s,
            to_s: timed.to_s,
            relation: say(timed.relation),
            change: word(timed.change).to_owned(),
        });
        Ok(held.collect())
    }

    /// Returns the objects in each scene, or `None` if one of them was not seen.
    fn scenes<T: Copy, const N: usize>(&self, make: Make<T>) -> anyhow::Result<Vec<(f64, Option<[T; N]>)>> {
        ensure!(self.tracks.len() == N, "expected {N} objects, found {}", self.tracks.len());
        self.scenes.iter().map(|scene| Ok((scene.at_s, self.scene(scene, make)?))).collect()
    }

    fn scene<T: Copy, const N: usize>(&self, of: &Scene, make: Make<T>) -> anyhow::Result<Option<[T; N]>> {
        let mut scene = [None; N];
        for ((slot, track), index) in scene.iter_mut().zip(self.tracks).zip(&of.samples) {
            let Some(index) = *index else { continue };
            let before = index.checked_sub(1).map(|before| &track.samples[before].1);
            *slot = make(before, &track.samples[index].1)?;
        }
        Ok(scene.iter().all(Option::is_some).then(|| scene.map(|object| object.expect("all are there"))))
    }
}

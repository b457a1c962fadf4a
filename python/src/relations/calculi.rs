//! The calculi, selected by name, with their parameters as Python passes them.

use serde::Deserialize;
use sketchnav_qualitative::argd::{Bound, Rank, Scale};
use sketchnav_qualitative::dipole::{COARSE, Dipoles, FINE};
use sketchnav_qualitative::doublecross::{Crosses, DoubleCross};
use sketchnav_qualitative::opra::Orientations;
use sketchnav_qualitative::rcc::{Rcc2, Rcc3, Rcc4, Rcc5, Rcc8, Regions};
use sketchnav_qualitative::tpcc::{Configurations, Tpcc};
use sketchnav_qualitative::{
    Error, Quantisation, RelationSet, allen, cardinal, flipflop, mos, order, qrpc, qtc, rectangle,
};

use super::related::{Of, Related};

/// A calculus with its parameters. Lengths are in the unit of the coordinates.
#[derive(Debug, Deserialize)]
#[serde(tag = "calculus", rename_all = "kebab-case")]
pub enum Spec {
    QtcB {
        quantisation: Quantisation,
    },
    QtcC {
        quantisation: Quantisation,
    },
    QtcBc {
        quantisation: Quantisation,
        near: f64,
    },
    QtcB22 {
        quantisation: Quantisation,
    },
    QtcC22 {
        quantisation: Quantisation,
    },
    Mos {
        quantisation: Quantisation,
    },
    DraC {
        tolerance: f64,
    },
    DraF {
        tolerance: f64,
    },
    DoubleCross {
        tolerance: f64,
    },
    Qrpc {
        tolerance_rad: f64,
        tolerance: f64,
    },
    Opra {
        m: usize,
        tolerance_rad: f64,
    },
    Argd {
        labels: Vec<(String, f64)>,
        bound: Bound,
    },
    Cardinal,
    Order,
    Allen {
        tolerance: f64,
    },
    Rectangle {
        tolerance: f64,
    },
    Rcc2 {
        tolerance: f64,
    },
    Rcc3 {
        tolerance: f64,
    },
    Rcc4 {
        tolerance: f64,
    },
    Rcc5 {
        tolerance: f64,
    },
    Rcc8 {
        tolerance: f64,
    },
    Tpcc {
        tolerance_rad: f64,
    },
    #[serde(rename = "flipflop")]
    FlipFlop {
        tolerance: f64,
    },
}

impl Spec {
    /// Creates the calculus.
    ///
    /// # Errors
    /// If a parameter is out of range.
    pub fn open(self) -> Result<Box<dyn Related>, Error> {
        Ok(match self {
            Self::QtcB { quantisation } => Box::new(Of::new(qtc::Basic { quantisation }).with_converse()),
            Self::QtcC { quantisation } => {
                Box::new(Of::new(qtc::DoubleCross { quantisation }).with_algebra())
            }
            Self::QtcB22 { quantisation } => Box::new(Of::new(qtc::Speeds { quantisation }).with_algebra()),
            Self::QtcC22 { quantisation } => Box::new(Of::new(qtc::Angles { quantisation }).with_converse()),
            Self::DraC { tolerance } => Box::new(Of::new(Dipoles::<COARSE>::new(tolerance)?).with_algebra()),
            Self::DraF { tolerance } => Box::new(Of::new(Dipoles::<FINE>::new(tolerance)?).with_algebra()),
            Self::DoubleCross { tolerance } => Box::new(
                Of::new(Crosses::new(tolerance)?)
                    .permuted(DoubleCross::permuted)
                    .composed(DoubleCross::compose),
            ),
            Self::QtcBc { quantisation, near } => {
                Box::new(Of::new(qtc::Switching::new(quantisation, near)?).with_converse())
            }
            Self::Mos { quantisation } => Box::new(Of::new(mos::Motions { quantisation })),
            Self::Qrpc { tolerance_rad, tolerance } => {
                let projections = qrpc::Projections::new(tolerance_rad, tolerance)?;
                Box::new(Of::new(projections).converses(qrpc::Qrpc::converses))
            }
            Self::Opra { m, tolerance_rad } => match m {
                1 => oriented::<1>(tolerance_rad)?,
                2 => oriented::<2>(tolerance_rad)?,
                3 => oriented::<3>(tolerance_rad)?,
                4 => oriented::<4>(tolerance_rad)?,
                _ => return Err(Error::Parameter { what: "m", expected: "1, 2, 3 or 4", found: m as f64 }),
            },
            Self::Argd { labels, bound } => distances(Scale::new(labels, bound)?),
            Self::Cardinal => Box::new(Of::new(cardinal::Directions).with_algebra()),
            Self::Order => Box::new(Of::new(order::Orders).with_algebra()),
            Self::Allen { tolerance } => Box::new(Of::new(allen::Intervals::new(tolerance)?).with_algebra()),
            Self::Rectangle { tolerance } => {
                Box::new(Of::new(rectangle::Rectangles::new(tolerance)?).with_algebra())
            }
            Self::Rcc2 { tolerance } => Box::new(Of::new(Regions::<Rcc2>::new(tolerance)?).with_algebra()),
            Self::Rcc3 { tolerance } => Box::new(Of::new(Regions::<Rcc3>::new(tolerance)?).with_algebra()),
            Self::Rcc4 { tolerance } => {
                use sketchnav_qualitative::Compose;
                let rcc4 = Of::new(Regions::<Rcc4>::new(tolerance)?);
                Box::new(rcc4.converses(Rcc4::converses).composed(Rcc4::compose).with_table(Rcc4::table))
            }
            Self::Rcc5 { tolerance } => Box::new(Of::new(Regions::<Rcc5>::new(tolerance)?).with_algebra()),
            Self::Rcc8 { tolerance } => Box::new(Of::new(Regions::<Rcc8>::new(tolerance)?).with_algebra()),
            Self::Tpcc { tolerance_rad } => {
                Box::new(Of::new(Configurations::new(tolerance_rad)?).permuted(Tpcc::permuted))
            }
            Self::FlipFlop { tolerance } => Box::new(
                Of::new(flipflop::Ways::new(tolerance)?)
                    .permuted(|relation, by| relation.permuted(by).into())
                    .composed(flipflop::FlipFlop::compose),
            ),
        })
    }
}

fn oriented<const M: usize>(tolerance_rad: f64) -> Result<Box<dyn Related>, Error> {
    Ok(Box::new(Of::new(Orientations::<M>::new(tolerance_rad)?).with_algebra()))
}

fn distances(scale: Scale) -> Box<dyn Related> {
    use sketchnav_qualitative::Relation;
    let labels = Rank::all().map_while(|rank| scale.label(rank).map(str::to_owned)).collect();
    let (composed, table) = (scale.clone(), scale.clone());
    let compose = move |first, next| -> RelationSet<Rank> {
        let ranks = composed.compose(first, next);
        Rank::all().filter(|rank| ranks.contains(rank)).collect()
    };
    Box::new(Of::new(scale).named(labels).with_converse().composed(compose).with_table(move || table.table()))
}

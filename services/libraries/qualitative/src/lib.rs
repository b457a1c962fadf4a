#![doc = include_str!("../README.md")]

pub mod algebra;
pub mod allen;
pub mod argd;
pub mod calculus;
pub mod cardinal;
pub mod dipole;
pub mod doublecross;
pub mod error;
pub mod flipflop;
pub mod geometry;
pub mod hof;
pub mod mos;
pub mod network;
pub mod opra;
pub mod order;
pub mod qrpc;
pub mod qsrlib;
pub mod qtc;
pub mod rcc;
pub mod rectangle;
pub mod series;
pub mod tpcc;

pub use algebra::{Compose, Converse, Relation, RelationSet};
pub use calculus::{Calculus, Quantisation};
pub use error::Error;
pub use geometry::{Interval, Oriented, Point, Rect};
pub use network::{Inconsistent, Network, Table};
pub use series::{Change, Options, Stream, Timed, joined, series};

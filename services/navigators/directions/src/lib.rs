//! Directions from landmark to landmark, after Park and Kender 1995.
//!
//! A *map-maker* sees a plane of identical dots, while a *navigator* sees only a small window of that plane and has no other
//! sensor, neither odometer nor compass. The map-maker plans a path and writes it down as a *custom map*, a short list of symbols
//! for the navigator to follow. The map also describes how to recognise a mistake and how to recover from it.
//!
//! The map-maker uses:
//! - [`plane`]: the dots and their spatial index. [`generate`]: random planes.
//! - [`isolation`] and [`description`]: which dot of a view a word refers to. [`signature`]: the surroundings of a dot. [`sight`]
//!   and [`walls`]: what hides a landmark and what blocks the path to it.
//! - [`parkway`], [`trajectory`] and [`transitions`]: which landmark can be attained from which, and the
//!   sparse matrix of these transitions.
//! - [`reliability`] and [`fit`]: equations 1 and 2. [`recovery`]: how errors are detected and corrected.
//! - [`atlas`] and [`survey`]: combine all of the above. [`path`] and [`plan`]: the costs and the best path.
//!   [`wording`]: the words that depend on the path.
//! - [`pillars`]: finds landmarks on land in a laser scan.
//! - [`arrival`]: finds the most probable path by simulation. [`branching`]: branching maps. [`belief`]: a
//!   navigator that knows the positions of its landmarks instead of a map.
//! - [`experiments`]: both the paper's and our own.
//!
//! The map-maker and the navigator share [`custom_map`], a file that people can read and write. [`navigator`]
//! follows such a map, and [`traversal`] simulates journeys for trials. [`stages`] contains the stages of the
//! navigator `directions`.
//!
//! **Units and frames.** All lengths are in one unit that the caller chooses. The paper uses millimetres. x
//! points east and y north. The window never turns on purpose, so its axes are those of the plane except for
//! the helicopter's own errors.
//!
//! Except for the stages, this crate does not use clocks, files, channels, threads, or a source of randomness
//! of its own.

pub mod arrival;
pub mod atlas;
pub mod belief;
pub mod branching;
pub mod custom_map;
pub mod description;
pub mod error;
pub mod experiments;
pub mod fit;
pub mod generate;
pub mod geometry;
pub mod isolation;
pub mod markers;
pub mod messages;
pub mod navigator;
pub mod parkway;
pub mod path;
pub mod pillars;
pub mod plan;
pub mod plane;
pub mod recovery;
pub mod reliability;
pub mod sight;
pub mod signature;
pub mod stages;
pub mod survey;
pub mod trajectory;
pub mod transitions;
pub mod traversal;
pub mod walls;
pub mod wording;

#[cfg(test)]
mod testing;

/// Makes the README's example a documentation test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

pub use custom_map::{CustomMap, Entry};
pub use description::Descriptor;
pub use error::Error;
pub use geometry::{Corner, Point, Window};
pub use plane::{DotId, Plane};
pub use signature::Signature;
pub use stages::NAVIGATOR;
pub use transitions::{Movement, Transition, Transitions};

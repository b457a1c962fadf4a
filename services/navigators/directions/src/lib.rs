//! Directions from landmark to landmark, after Park and Kender 1995.
//!
//! A *map-maker* sees a plane of identical dots. A *navigator* sees a small window of it and measures nothing else: it has
//! no odometer and no compass. The map-maker plans a path that the navigator can follow by a short list of symbols, the
//! *custom map*. The map also tells the navigator how to notice that it went wrong, and how to come back.
//!
//! The map-maker:
//! - [`plane`]: the dots and their spatial index; [`generate`]: random planes;
//! - [`isolation`], [`description`]: which dot of a view a word means; [`signature`]: what surrounds a dot; [`sight`], [`walls`]: what
//!   hides it, and what bars the way to it;
//! - [`parkway`], [`trajectory`], [`transitions`]: which landmark is attained from which, and their sparse matrix;
//! - [`reliability`], [`fit`]: equations 1 and 2; [`recovery`]: errors that are detected and corrected;
//! - [`atlas`], [`survey`]: all of that together; [`path`], [`plan`]: costs and the best path; [`wording`]: words that depend on
//!   the path;
//! - [`pillars`]: landmarks on land in a laser scan;
//! - [`arrival`]: the most probable path, by simulation; [`experiments`]: the paper's, and ours.
//!
//! The stages of the navigator `directions`: [`stages`].
//!
//! Both: [`custom_map`], the file that people read and write. The navigator: [`navigator`]. For trials: [`traversal`].
//!
//! **Units and frames.** Lengths are in one unit that the caller chooses; the paper's is the millimetre. x points east, y
//! north. The window never turns on purpose, so its axes are those of the plane except for the helicopter's own errors.
//!
//! Nothing here knows a clock, a file, a channel, a thread or randomness of its own.

pub mod arrival;
pub mod atlas;
pub mod branching;
pub mod custom_map;
pub mod description;
pub mod error;
pub mod experiments;
pub mod fit;
pub mod generate;
pub mod geometry;
pub mod isolation;
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

/// The README's example runs.
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

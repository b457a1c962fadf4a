#![doc = include_str!("../README.md")]

pub mod belief;
pub mod control;
pub mod error;
pub mod extraction;
pub mod follower;
pub mod guide;
pub mod language;
pub mod lost;
pub mod matching;
pub mod memory;
pub mod outlines;
pub mod perception;
pub mod plane;
pub mod route;
pub mod sketch;

pub use error::Error;

#![doc = include_str!("../README.md")]

pub mod account;
pub mod belief;
pub mod control;
pub mod derived;
pub mod drawn;
pub mod error;
pub mod extraction;
pub mod file;
pub mod follower;
pub mod guide;
mod hypothesis;
pub mod instructions;
pub mod language;
pub mod localizer;
pub mod locator;
pub mod lookout;
pub mod lost;
pub mod matching;
pub mod memory;
pub mod messages;
pub mod mission;
mod motion;
mod navigator;
mod numbers;
pub mod outlines;
pub mod perception;
pub mod plane;
pub mod planner;
pub mod ring;
pub mod route;
pub mod shift;
pub mod sketch;
pub mod sketcher;
pub mod view;

pub use error::{Error, LandmarksError};
pub use navigator::NAVIGATOR;

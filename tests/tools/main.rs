//! Tests of everything that people and other programs use: commands, recordings, the pad, viewers and bridges.

mod commands;
mod pad;
mod pad_browser;
mod pad_study;
mod python_readers;
mod recordings;
mod relations;
#[cfg(feature = "ros2")]
mod ros2;
mod top;
#[cfg(feature = "foxglove")]
mod view;
#[cfg(feature = "zenoh")]
mod zenoh;

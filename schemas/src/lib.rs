//! Every message, channel and file format common to all navigators, declared once, and the means by which each navigator
//! declares its own.
//!
//! - [`message`]: the structs as they are in shared memory; [`declare`]: how one is declared; [`codes`]: the small numbers
//!   inside them.
//! - [`layout`]: their memory layout; [`ros2`]: their ROS 2 form; [`valid`]: what they may contain.
//! - [`channels`]: the pipeline, with writer and readers of each channel; [`erased`]: messages as bytes.
//! - [`geometry`]: frames and units; [`time`]: seconds and nanoseconds.
//! - [`mission`], [`floor_plan`], [`robot`]: the files that people write; [`bounds`]: the bounds of the numbers in them.
//! - [`shown`]: text from outside, as it is shown; [`nearest`]: what a wrong word probably meant; [`run`]: what a process gets at
//!   its start; [`seed`]: random streams; [`statistics`]: intervals of counts and means.
//!
//! Nothing here opens a file, reads a clock or depends on how a message travels.

pub mod bounds;
pub mod channels;
pub mod codes;
pub mod cpp;
pub mod declare;
pub mod erased;
pub mod fault_plan;
pub mod floor_plan;
pub mod geometry;
pub mod layout;
pub mod message;
pub mod mission;
pub mod nearest;
pub mod python;
pub mod robot;
pub mod ros2;
pub mod run;
pub mod samples;
pub mod seed;
pub mod shown;
pub mod statistics;
pub mod time;
pub mod valid;

//! Recordings as users encounter them: files that are written, cut off, damaged, compared, and decoded by third-party tools.

mod common;
mod copies;
mod damage;
mod difference;
mod foreign;
mod golden;
mod python;
mod reading;
mod round_trip;
mod sources;

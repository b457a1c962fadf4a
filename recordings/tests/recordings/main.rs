//! Recordings as their users meet them: files that are written, cut, damaged, compared, decoded by
//! other people's tools.

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

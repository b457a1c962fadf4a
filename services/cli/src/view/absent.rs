//! Stands in for the live view in a program that was built without it. All functions return an error that explains how to build it.

use std::path::Path;

use anyhow::anyhow;
use sketchnav_runtime::System;

use crate::args::ViewOptions;
use crate::failure::{Failure, Outcome};

/// A port for the view. There is no value of this type.
pub enum Port {}

impl Port {
    pub fn number(&self) -> u16 {
        match *self {}
    }

    pub fn url(&self) -> String {
        match *self {}
    }
}

/// Always returns an error.
pub fn port(_: u16) -> Result<Port, Failure> {
    let advice = "cargo build --features foxglove";
    Err(Failure::Input(anyhow!("this program was built without the live view; build it with: {advice}")))
}

pub fn system(_: System, port: Port) -> Result<Outcome, Failure> {
    match port {}
}

pub fn file(_: &Path, port: Port, _: &ViewOptions) -> Result<Outcome, Failure> {
    match port {}
}

//! Reports on a run with custom maps: which entry the navigator worked on, and how often it recovered.

use sketchnav_stage::account::{self, Curve, Summary};
use sketchnav_stage::{Denied, Heard};

use crate::messages::{JOURNEY, Journey};

/// The states of the journeys that the navigator of a run reported.
#[derive(Default)]
pub struct Account(Vec<Journey>);

impl account::Account for Account {
    fn hear(&mut self, message: &Heard<'_>) -> Result<(), Denied> {
        self.0.extend(message.on(JOURNEY)?);
        Ok(())
    }

    fn tell(&self, summary: &mut Summary) {
        let of = |name, value: fn(&Journey) -> u32| {
            Curve::of(name, &self.0, |said| &said.header, |said| f64::from(value(said)))
        };
        summary.chart("Entry of the custom map", "from 1", [of("entry", |said| said.entry + 1)]);
        summary.chart("Recoveries", "so far", [of("recoveries", |said| said.recoveries)]);
    }
}

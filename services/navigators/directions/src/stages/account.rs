//! Reports on a run: the current entry of the map or, without a map, how certain the navigator was of its landmark, and how often
//! it recovered.

use sketchnav_stage::account::{self, Curve, Summary};
use sketchnav_stage::{Denied, Incoming};

use crate::messages::{BelievedLandmark, JOURNEY, Journey, WHEREABOUTS, Whereabouts};

/// The states of the journeys that the navigator of a run reported, and its beliefs if it has any.
#[derive(Default)]
pub struct Account {
    journeys: Vec<Journey>,
    beliefs: Vec<Whereabouts>,
}

impl account::Account for Account {
    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), Denied> {
        self.journeys.extend(message.on(JOURNEY)?);
        self.beliefs.extend(message.on(WHEREABOUTS)?);
        Ok(())
    }

    fn summarize(&self, summary: &mut Summary) {
        let of = |name, value: fn(&Journey) -> u32| {
            Curve::of(name, &self.journeys, |said| &said.header, |said| f64::from(value(said)))
        };
        if self.beliefs.is_empty() {
            summary.chart("Entry of the custom map", "from 1", [of("entry", |said| said.entry + 1)]);
        } else {
            let percent = |believed: &BelievedLandmark| 100.0 * f64::from(believed.probability);
            let most = |said: &Whereabouts| said.landmarks().first().map_or(f64::NAN, percent);
            let curve = Curve::of("probability", &self.beliefs, |said| &said.header, most);
            summary.chart("Probability of the most probable landmark", "%", [curve]);
            summary.chart("Movements", "so far", [of("movements", |said| said.entry)]);
        }
        summary.chart("Recoveries", "so far", [of("recoveries", |said| said.recoveries)]);
    }
}

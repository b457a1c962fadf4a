//! Summarizes a drive along corridors: the pair of markers, and the number of markers that the robot remembered.

use sketchnav_stage::account::{self, Curve, Summary};
use sketchnav_stage::{Denied, Incoming};

use crate::messages::{PairedMarker, RELATIONS, Relations, Trend};

/// The relations that were published during a run.
#[derive(Default)]
pub struct Account(Vec<Relations>);

impl account::Account for Account {
    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), Denied> {
        self.0.extend(message.on(RELATIONS)?);
        Ok(())
    }

    fn summarize(&self, summary: &mut Summary) {
        let of = |name, value: fn(&Relations) -> f64| Curve::of(name, &self.0, |said| &said.header, value);
        let distances = [
            of("left", |said| while_seen(said, distance_m(&said.left))),
            of("right", |said| while_seen(said, distance_m(&said.right))),
        ];
        summary.chart("Distance of the pair", "m, robot to marker", distances);
        let trends = [
            of("left", |said| while_seen(said, height(&said.left))),
            of("right", |said| while_seen(said, height(&said.right))),
        ];
        summary.chart("QTC of the pair", "0 towards, 1 stable, 2 away", trends);
        summary.chart(
            "Markers in memory",
            "markers",
            [of("remembered", |said| f64::from(said.marker_count))],
        );
    }
}

/// Returns `value` while a pair is in view, and otherwise NaN, which means that the curve has no value.
fn while_seen(said: &Relations, value: f64) -> f64 {
    if said.pair_age_s == 0.0 { value } else { f64::NAN }
}

fn distance_m(marker: &PairedMarker) -> f64 {
    marker.x_m.hypot(marker.y_m)
}

fn height(marker: &PairedMarker) -> f64 {
    match marker.marker_trend() {
        Trend::Towards => 0.0,
        Trend::Stable => 1.0,
        Trend::Away => 2.0,
        Trend::Unknown => f64::NAN,
    }
}

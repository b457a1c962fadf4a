//! Charts for the report of a run in a drawing, showing local scales, effective sample size, and the misfit
//! of the scans.

use sketchnav_stage::account::{self, Curve, Summary};
use sketchnav_stage::{Denied, Incoming};

use crate::messages::{ESTIMATE, PoseEstimate};

/// Collects the estimates of a run and charts them.
#[derive(Default)]
pub struct Account(Vec<PoseEstimate>);

impl account::Account for Account {
    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), Denied> {
        self.0.extend(message.on(ESTIMATE)?.filter(|estimate| estimate.is_placed()));
        Ok(())
    }

    fn summarize(&self, summary: &mut Summary) {
        let of = |name, value: fn(&PoseEstimate) -> f64| Curve::of(name, &self.0, |said| &said.header, value);
        let along = of("a, along the walls", |said| said.scale_a_pxpm);
        let across = of("b, across", |said| said.scale_b_pxpm);
        summary.chart("Local scales", "px/m", [along, across]);
        let effective = of("effective", |said| said.effective_sample_size);
        summary.chart("Effective sample size", "particles", [effective]);
        summary.chart("Misfit of the scan", "−ln p, mean beam", [of("misfit", |said| -said.fit)]);
    }
}

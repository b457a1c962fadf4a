//! Summarizes a drive past landmarks: the objects in view, the belief, and the progress along the route.

use sketchnav_stage::account::{self, Curve, Summary};
use sketchnav_stage::{Denied, Incoming};

use crate::instructions::Instructions;
use crate::messages::{LANDMARK_PROGRESS, LANDMARK_ROUTE, LANDMARK_VIEW, LandmarkProgress, LandmarkView};

/// Messages of a run that its summary is computed from.
#[derive(Default)]
pub struct Account {
    is_sketched: bool,
    views: Vec<LandmarkView>,
    progress: Vec<LandmarkProgress>,
}

impl account::Account for Account {
    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), Denied> {
        if message.on(LANDMARK_ROUTE)?.is_some() {
            // If the route is unreadable, the summary itself fails with that error.
            self.is_sketched = Instructions::read(message.cells()).is_ok_and(|read| read.sketch.is_some());
        }
        self.views.extend(message.on(LANDMARK_VIEW)?);
        self.progress.extend(message.on(LANDMARK_PROGRESS)?);
        Ok(())
    }

    fn summarize(&self, summary: &mut Summary) {
        let of =
            |name, value: fn(&LandmarkView) -> f64| Curve::of(name, &self.views, |said| &said.header, value);
        let seen = of("seen", |view| f64::from(view.object_count));
        let remembered = of("remembered places", |view| f64::from(view.place_count));
        summary.chart("Objects", "number", [seen, remembered]);
        if self.is_sketched {
            summary.chart("Fit of what is seen", "share", [of("fit", |view| view.fit)]);
            summary.chart("Spread of the belief", "drawn m", [of("spread", |view| view.spread_m)]);
            let stretch = of("stretch", |view| view.stretch);
            summary.chart("Stretch of the sketch", "real m for a drawn one", [stretch]);
        }
        if self.progress.iter().any(|said| said.length_m > 0.0) {
            let along = Curve::of("along", &self.progress, |said| &said.header, |said| said.along_m);
            summary.chart("Way along the drawn route", "drawn m", [along]);
        }
    }
}

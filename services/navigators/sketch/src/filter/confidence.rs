//! Judges the confidence in the localization, with hysteresis so that the judgement does not flicker.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::codes::Tracking;

use super::parameters::Parameters;

/// Factor on the share of the weight near the mode that a doubtful estimate needs to be trusted again.
const REGAINED: f64 = 1.5;
/// Upper limit of the share of the weight that is required to trust a doubtful estimate again.
const NEARLY_ALL: f64 = 0.8;
/// Rate at which the running mean of the fit adapts, as a share per update.
const FOLLOW: f32 = 0.25;
/// Rates at which the quick and the slow mean likelihood adapt (Thrun, Burgard and Fox, table 8.3).
const QUICK: f32 = 0.25;
const SLOW: f32 = 0.02;

/// The current judgement and the means that it is based on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Confidence {
    level: u32,
    fit: f32,
    quick: f32,
    slow: f32,
    seen: bool,
}

impl Default for Confidence {
    fn default() -> Self {
        Self { level: Tracking::Waiting.code(), fit: 0.0, quick: 0.0, slow: 0.0, seen: false }
    }
}

impl Confidence {
    /// Returns the current judgement.
    pub fn tracking(&self) -> Tracking {
        Tracking::from_code(self.level).unwrap_or(Tracking::Waiting)
    }

    /// Returns the decline of the scans' fit, from 0 to 1.
    pub fn decline(&self) -> f32 {
        if self.slow > 0.0 { (1.0 - self.quick / self.slow).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// Updates the judgement with `fit`, the mean log likelihood of a beam at the estimate, and `share`, the share of the weight
    /// near the estimate.
    pub fn update(&mut self, fit: f32, share: f64, parameters: &Parameters) {
        let likelihood = fit.exp();
        if !self.seen {
            (self.fit, self.quick, self.slow, self.seen) = (fit, likelihood, likelihood, true);
        }
        self.fit += FOLLOW * (fit - self.fit);
        self.quick += QUICK * (likelihood - self.quick);
        self.slow += SLOW * (likelihood - self.slow);
        self.level = self.judge(share, parameters).code();
    }

    fn judge(&self, share: f64, p: &Parameters) -> Tracking {
        let was = self.tracking();
        let rises = |from: Tracking| if was >= from { p.hysteresis } else { 0.0 };
        let regained = (p.one_place_share * REGAINED).min(NEARLY_ALL.max(p.one_place_share));
        let one_place = if was >= Tracking::Doubtful { regained } else { p.one_place_share };
        if self.fit < p.lost_below + rises(Tracking::Lost) {
            Tracking::Lost
        } else if self.fit < p.doubtful_below + rises(Tracking::Doubtful) || share < one_place {
            Tracking::Doubtful
        } else {
            Tracking::Tracking
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(confidence: &mut Confidence, fit: f32, rounds: usize) -> Tracking {
        (0..rounds).for_each(|_| confidence.update(fit, 0.9, &Parameters::default()));
        confidence.tracking()
    }

    #[test]
    fn the_judgement_has_hysteresis() {
        let p = Parameters::default();
        let mut confidence = Confidence::default();
        assert_eq!(confidence.tracking(), Tracking::Waiting);
        assert_eq!(after(&mut confidence, p.doubtful_below + 0.1, 1), Tracking::Tracking);
        assert_eq!(after(&mut confidence, p.doubtful_below - 0.1, 30), Tracking::Doubtful);
        assert_eq!(after(&mut confidence, p.doubtful_below + 0.1, 60), Tracking::Doubtful);
        assert_eq!(after(&mut confidence, p.doubtful_below + p.hysteresis + 0.1, 30), Tracking::Tracking);
        assert_eq!(after(&mut confidence, p.lost_below - 0.5, 30), Tracking::Lost);
    }

    #[test]
    fn several_places_are_doubtful() {
        let mut confidence = Confidence::default();
        confidence.update(0.0, 0.2, &Parameters::default());
        assert_eq!(confidence.tracking(), Tracking::Doubtful);
    }
}

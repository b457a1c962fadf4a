//! The method `belief`: the map-maker's chart, the navigator that uses it, and its reports.

use std::fmt::Display;
use std::sync::Arc;

use sketchnav_stage::{Incoming, Outbox, StageError};

use super::planner::{Instructed, Simulation, code};
use super::sketcher::dots_of;
use crate::arrival::Effort;
use crate::belief::policy::{Belief, Policy};
use crate::belief::{Chart, Charted, Journey, navigator};
use crate::error::Error;
use crate::geometry::Point;
use crate::messages::{BelievedLandmark, CHART, ChartedJourney, WHEREABOUTS, Whereabouts};
use crate::navigator::{Navigator, Outcome, Output};
use crate::path::{Atlas, Measure, Objective, Path, Start, best};
use crate::plane::DotId;

/// Number of simulations of each movement. Both the map-maker and the navigator compute the model from the chart with this number,
/// which is low enough that the supervisor does not consider the navigator stuck meanwhile.
const TRIALS: u32 = Effort::USUAL.trials;

/// The chart of a mission, with its journeys.
#[derive(Debug, Clone)]
pub struct Charts {
    /// The chart.
    pub charted: Charted,
    /// The journey of each task.
    pub journeys: Vec<Journey>,
    /// The most reliable path of each task, as planned by a map-maker. The navigator may take another one.
    pub paths: Vec<Path>,
    /// The probability of arrival of each task.
    pub probabilities: Vec<f64>,
}

impl Charts {
    /// Charts the landmarks of journeys, each from a start to a goal, and simulates the journeys.
    ///
    /// # Errors
    /// [`Error::Unreachable`] with the index of the task whose goal no path reaches, among others.
    pub fn new(
        atlas: &Atlas,
        tasks: &[(Start, DotId)],
        simulation: &Simulation,
        journeys: u32,
    ) -> Result<Self, (usize, Error)> {
        let path = |(task, &(start, goal)): (usize, &(Start, DotId))| {
            best(atlas, start, goal, Measure::Windows, Objective::MOST_RELIABLE)
                .map_err(|error| (task, error))
        };
        let paths = tasks.iter().enumerate().map(path).collect::<Result<Vec<_>, _>>()?;
        let in_first = |error| (0, error);
        let sigma = simulation.pilot.noise.map_sigma;
        let charted = Charted::new(atlas, &paths.iter().collect::<Vec<_>>(), sigma).map_err(in_first)?;
        let model = charted.chart.model(&simulation.pilot, TRIALS, simulation.seed).map_err(in_first)?;
        let (model, mut all, mut probabilities) = (Arc::new(model), Vec::new(), Vec::new());
        for (task, &(start, goal)) in tasks.iter().enumerate() {
            let journey = charted.journey(start, goal).ok_or((task, Error::NoDots))?;
            let by = (&model, journey);
            let tally = charted.simulate(atlas, &simulation.pilot, by, journeys, (simulation.seed, "stated"));
            probabilities.push(tally.map_err(|error| (task, error))?.probability());
            all.push(journey);
        }
        Ok(Self { charted, journeys: all, paths, probabilities })
    }

    /// Returns the size of the landmarks' positions in their message, in bytes.
    pub fn bytes(&self) -> usize {
        8 * self.charted.dots.len()
    }

    /// Sends the chart.
    pub(super) fn announce(&self, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let Self { charted, journeys, .. } = self;
        out.send_with(CHART, self.bytes(), |chart, cells| {
            chart.journey_count = journeys.len() as u32;
            chart.sigma_m = charted.chart.sigma();
            for (own, journey) in chart.journeys.iter_mut().zip(journeys) {
                let Point { x, y } = journey.start;
                let goal = u32::from(journey.goal);
                *own = ChartedJourney { start_x_m: x as f32, start_y_m: y as f32, goal };
            }
            for (cell, at) in cells.chunks_exact_mut(8).zip(charted.chart.landmarks()) {
                cell[..4].copy_from_slice(&(at.x as f32).to_le_bytes());
                cell[4..].copy_from_slice(&(at.y as f32).to_le_bytes());
            }
        })?;
        Ok(())
    }
}

impl Instructed for Policy {
    const FORM: &'static str = "directions planner with a belief 5";
    const WAITING: &'static str = "waiting for the list of landmarks";

    fn receive(
        message: &Incoming<'_>,
        simulation: &Simulation,
    ) -> Result<Option<Vec<Navigator<Self>>>, StageError> {
        let Some(sent) = message.on(CHART)? else { return Ok(None) };
        let chart = Chart::new(dots_of(message.cells()), sent.sigma_m)?;
        let model = Arc::new(chart.model(&simulation.pilot, TRIALS, simulation.seed)?);
        let by = |journey: &ChartedJourney| {
            let start = Point::new(journey.start_x_m.into(), journey.start_y_m.into());
            let journey = Journey { start, goal: u16::try_from(journey.goal).unwrap_or(u16::MAX) };
            navigator(&chart, &simulation.pilot, &model, journey)
        };
        Ok(Some(sent.journeys().iter().map(by).collect::<Result<_, _>>()?))
    }

    fn progress(&self, output: &Output) -> impl Display {
        let (movement, activity, meant) = (output.entry, code(output.activity), output.meant);
        std::fmt::from_fn(move |f| {
            write!(f, "movement {movement}: {activity}; most probably at landmark {meant}")
        })
    }

    fn failure(&self, outcome: Outcome, output: &Output) -> impl Display {
        let movement = output.entry;
        std::fmt::from_fn(move |f| match outcome {
            Outcome::CannotLocate => write!(f, "movement {movement}: cannot locate the landmark"),
            _ => write!(f, "movement {movement}: no way to the goal is probable enough"),
        })
    }

    fn report(task: usize, belief: Option<&Belief>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        out.send(WHEREABOUTS, |whereabouts| {
            whereabouts.task = task as u32;
            belief.iter().for_each(|belief| write_most_probable(belief.weights(), whereabouts));
        })?;
        Ok(())
    }
}

/// Writes the most probable landmarks, in descending order of probability. Landmarks with a probability of 0 are left out.
fn write_most_probable(weights: &[f32], whereabouts: &mut Whereabouts) {
    let most = whereabouts.landmarks.len();
    let mut count = 0;
    for (landmark, &probability) in (0..).zip(weights).filter(|(_, weight)| **weight > 0.0) {
        let probability = probability.min(1.0);
        let place = whereabouts.landmarks[..count].partition_point(|other| other.probability >= probability);
        if place < most {
            count = (count + 1).min(most);
            whereabouts.landmarks[place..count].rotate_right(1);
            whereabouts.landmarks[place] = BelievedLandmark { landmark, probability };
        }
    }
    whereabouts.landmark_count = count as u32;
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_most_probable_landmarks_come_first(weights in prop::collection::vec(0.0_f32..1.0, 0..40)) {
            let mut whereabouts = Whereabouts::zeroed();
            write_most_probable(&weights, &mut whereabouts);
            let written: Vec<f32> = whereabouts.landmarks().iter().map(|believed| believed.probability).collect();
            let mut sorted: Vec<f32> = weights.iter().copied().filter(|weight| *weight > 0.0).collect();
            sorted.sort_by(|a, b| b.total_cmp(a));
            sorted.truncate(8);
            prop_assert_eq!(written, sorted);
            for believed in whereabouts.landmarks() {
                prop_assert_eq!(weights[believed.landmark as usize], believed.probability);
            }
        }
    }
}

//! The navigator's messages and channels: the custom maps, the description of the view, and the state of a journey.
//!
//! Positions in the view are in metres, in the window's own axes and relative to its centre: x to the right, y upwards.

use sketchnav_schemas::declare::{channels, codes, messages, parts};
use sketchnav_schemas::message::{MAX_DOTS, MAX_PLANE_DOTS};
use sketchnav_schemas::valid::{Checked, count, ensure, near};

use crate::belief::MOST_LANDMARKS;
use crate::stages::mission::KIND;

/// Maximum size of the custom maps of a mission, in bytes.
pub const MAX_DIRECTIONS_BYTES: usize = 1 << 20;
/// Maximum number of landmarks of all journeys of a mission.
pub const MAX_PLANNED: usize = 512;
/// Number of words in the language of custom maps.
pub const MAX_WORDS: usize = 8;

codes! {
    /// The current activity of a navigator by landmarks.
    pub enum Activity {
        /// Looks for the landmark that a word means.
        Seek = 0 "seek",
        /// Brings a pair of landmarks to the middle of the window, or slides along the line through them.
        Slide = 1 "slide",
        /// Looks around the landmark that it has attained.
        Verify = 2 "verify",
        /// Moves the landmark to the corner that the entry names.
        Adjust = 3 "adjust",
        /// Returns from a wrong landmark.
        Recover = 4 "recover",
        /// Rests.
        Rest = 5 "rest",
    }
}

messages! {
    /// The custom maps of the tasks. The slice after the message is their text, in which a line `---` separates the maps of two
    /// tasks.
    pub struct Directions version 1 in "" with data {
        /// Number of maps.
        pub map_count: u32,
        /// Zero.
        pub reserved: u32 as Zero,
    }

    /// The landmarks that a navigator with a belief knows, in place of custom maps. The slice after the message has their
    /// positions, as two f32 each: x and y in metres, in the frame `world`.
    pub struct Chart version 1 in "world" with data valid if chart {
        /// Number of valid entries of `journeys`.
        pub journey_count: u32 as Count,
        /// Zero.
        pub reserved: u32 as Zero,
        /// Standard deviation of a position on each axis, in metres.
        pub sigma_m: f64,
        /// The journeys, one for each task.
        pub journeys: [ChartedJourney; 64] where journey_count counts,
    }

    /// The map-maker's intentions behind the custom maps, for people and for the judge. No navigator may read this message. The
    /// slice after the message has the dots at the positions where the map-maker sees them, as two f32 each: x and y in metres,
    /// in the frame `world`.
    pub struct Itinerary version 2 in "world" with data {
        /// Number of valid entries of `journeys`.
        pub journey_count: u32 as Count,
        /// Number of valid entries of `landmarks`.
        pub landmark_count: u32 as Count,
        /// The journeys, one for each task.
        pub journeys: [PlannedJourney; 64] where journey_count counts,
        /// The landmarks, one for each entry of each map. Empty for a map that the map-maker did not make.
        pub landmarks: [PlannedLandmark; 512] where landmark_count counts,
    }

    /// The view, described: how isolated each dot is, what surrounds it, and which dot each word means.
    pub struct Description version 2 in "window" valid if description {
        /// Time at which the view was taken, or 0 before the first view.
        pub view_stamp_ns: u64,
        /// Number of the view, or 0 before the first view. An unchanged number means an unchanged view.
        pub views: u64,
        /// Number of valid entries of `dots`.
        pub dot_count: u32 as Count,
        /// Zero.
        pub reserved: u32 as Zero,
        /// For each word, in the order of the language, the entry of `dots` that it means in the window proper, counted from 1.
        /// 0 if the word means no dot.
        pub meant: [u32; 8],
        /// The dots.
        pub dots: [DescribedDot; 64] where dot_count counts,
    }

    /// The belief about the landmark at hand.
    pub struct Whereabouts version 1 in "world" valid if whereabouts {
        /// The task, from 0.
        pub task: u32,
        /// Number of valid entries of `landmarks`.
        pub landmark_count: u32 as Count,
        /// The most probable landmarks, in descending order of their probabilities.
        pub landmarks: [BelievedLandmark; 8] where landmark_count counts,
    }

    /// The state of a journey.
    pub struct Journey version 1 in "window" valid if journey {
        /// The navigator's current activity.
        pub activity: u32 as Activity,
        /// The task, from 0.
        pub task: u32,
        /// The current entry of the map, from 0.
        pub entry: u32,
        /// Number of entries finished, each with a landmark that the navigator accepted as right.
        pub accepted: u32,
        /// Number of recoveries so far.
        pub recoveries: u32,
        /// 1 if the navigator knows the position of its reference landmark, otherwise 0.
        pub has_reference: u32,
        /// 1 if the navigator could not locate the landmark of its entry and has given up, otherwise 0.
        pub cannot_locate: u32,
        /// Zero.
        pub reserved: u32 as Zero,
        /// Position of the reference landmark, in metres to the right of the window's centre.
        pub reference_x_m: f64,
        /// Position of the reference landmark, in metres above the window's centre.
        pub reference_y_m: f64,
    }
}

parts! {
    /// A dot in view with its description.
    pub struct DescribedDot {
        /// Position in metres to the right of the window's centre.
        pub x_m: f32,
        /// Position in metres above the window's centre.
        pub y_m: f32,
        /// Isolation among the dots of the window proper: the dot's smallest mutual neighbourhood value, or 0 if it has none.
        pub isolation: u32,
        /// The quadrants of the dot that hold another dot in view, one bit each: SE 1, SW 2, NE 4, NW 8.
        pub quadrants: u32,
        /// The kind of landmark that a marker in view shows, counted from 1 in the alphabetical order of the mission's kinds, or 0
        /// if it is not known.
        pub kind: u32,
    }
}

parts! {
    /// A journey as planned.
    pub struct PlannedJourney {
        /// Distance that the window travels, in metres, or 0 if the map-maker did not make the map.
        pub distance_m: f64,
        /// The probability of arrival, or a negative number if it was not estimated.
        pub probability: f64,
        /// The entry at which most simulated journeys failed, from 1, or 0 if none failed or none were simulated.
        pub weakest_entry: u32,
        /// Number of simulated journeys that failed there.
        pub failure_count: u32,
        /// Number of all simulated journeys.
        pub simulated_count: u32,
        /// Zero.
        pub reserved: u32,
    }
}

parts! {
    /// A journey by a chart.
    pub struct ChartedJourney {
        /// Position of the window's centre at the start, in metres.
        pub start_x_m: f32,
        /// Position of the window's centre at the start, in metres.
        pub start_y_m: f32,
        /// Number of the landmark to go to, from 0.
        pub goal: u32,
    }
}

parts! {
    /// A landmark that may be the one at hand.
    pub struct BelievedLandmark {
        /// Number of the landmark in the chart, from 0.
        pub landmark: u32,
        /// The probability that it is the one at hand, from 0 to 1.
        pub probability: f32,
    }
}

parts! {
    /// A landmark as the map-maker sees it.
    pub struct PlannedLandmark {
        /// The task, from 0.
        pub task: u32,
        /// Number of the dot among those that the map-maker sees, from 0.
        pub dot: u32,
        /// The x coordinate, in metres.
        pub x_m: f32,
        /// The y coordinate, in metres.
        pub y_m: f32,
    }
}

impl Description {
    /// Returns the valid entries of `dots`.
    pub fn dots(&self) -> &[DescribedDot] {
        &self.dots[..(self.dot_count as usize).min(MAX_DOTS)]
    }
}

impl Chart {
    /// Returns the valid entries of `journeys`.
    pub fn journeys(&self) -> &[ChartedJourney] {
        &self.journeys[..(self.journey_count as usize).min(self.journeys.len())]
    }
}

impl Whereabouts {
    /// Returns the valid entries of `landmarks`.
    pub fn landmarks(&self) -> &[BelievedLandmark] {
        &self.landmarks[..(self.landmark_count as usize).min(self.landmarks.len())]
    }
}

impl PlannedJourney {
    /// Creates a journey without an estimate.
    pub fn new(distance_m: f64) -> Self {
        Self { distance_m, probability: -1.0, ..bytemuck::Zeroable::zeroed() }
    }

    /// Describes the probability of arrival and the entry that is most likely to fail, or returns `None` if they were not
    /// estimated.
    pub fn stated(&self) -> Option<String> {
        let percent = 100.0 * (self.probability >= 0.0).then_some(self.probability)?;
        let weakest = self.weakest().map_or(String::new(), |weakest| format!("; most failures at {weakest}"));
        Some(format!("probability of arrival {percent:.1} %{weakest}"))
    }

    /// Describes the entry at which most simulated journeys failed, or returns `None` if there is none.
    pub fn weakest(&self) -> Option<String> {
        let Self { weakest_entry, failure_count, simulated_count, .. } = self;
        let words =
            || format!("entry {weakest_entry}: {failure_count} of {simulated_count} simulated journeys");
        (*weakest_entry > 0).then(words)
    }
}

impl Itinerary {
    /// Returns the valid entries of `journeys`.
    pub fn journeys(&self) -> &[PlannedJourney] {
        &self.journeys[..(self.journey_count as usize).min(self.journeys.len())]
    }

    /// Returns the landmarks of a task, one for each entry of its map.
    pub fn landmarks(&self, task: usize) -> impl Iterator<Item = &PlannedLandmark> {
        let counted = &self.landmarks[..(self.landmark_count as usize).min(MAX_PLANNED)];
        counted.iter().filter(move |landmark| landmark.task as usize == task)
    }
}

channels! {
    of KIND;
    /// The custom maps of the tasks.
    DIRECTIONS: Instruction Directions = "directions", Sketcher => [Supervisor, Planner, Pad],
        behind it up to MAX_DIRECTIONS_BYTES;
    /// The landmarks that a navigator with a belief knows.
    CHART: Instruction Chart = "chart", Sketcher => [Planner, Pad],
        behind it up to 8 * MOST_LANDMARKS;
    /// The intentions of the map-maker behind the custom maps. No navigator may open this channel.
    ITINERARY: Instruction Itinerary = "itinerary", Sketcher => [Supervisor, Pad],
        behind it up to 8 * MAX_PLANE_DOTS;
    /// The description of the view.
    DESCRIPTION: Situation Description = "description", Localizer => [Planner, Pad];
    /// The state of the journey.
    JOURNEY: Detail Journey = "journey", Planner => [Pad];
    /// The belief about the current landmark.
    WHEREABOUTS: Detail Whereabouts = "whereabouts", Planner => [Pad];
}

/// Checks that the dots are as many as counted and that each word means one of them or none.
fn description(description: &Description) -> Checked {
    count("dot_count", description.dot_count, MAX_DOTS)?;
    near("dots", description.dots().iter().flat_map(|dot| [dot.x_m, dot.y_m]))?;
    let meant = &description.meant[..MAX_WORDS];
    let dots = description.dot_count;
    meant.iter().try_for_each(|&dot| ensure(dot <= dots, "meant", "a dot of those that are counted", dot))
}

/// Checks that the journeys are as many as counted, that they begin somewhere, and that the error is one.
fn chart(chart: &Chart) -> Checked {
    count("journey_count", chart.journey_count, chart.journeys.len())?;
    let is_error = chart.sigma_m >= 0.0 && chart.sigma_m.is_finite();
    ensure(is_error, "sigma_m", "a number from 0", chart.sigma_m)?;
    near("journeys", chart.journeys().iter().flat_map(|journey| [journey.start_x_m, journey.start_y_m]))
}

/// Checks that the landmarks are as many as counted, and that their probabilities are probabilities.
fn whereabouts(whereabouts: &Whereabouts) -> Checked {
    count("landmark_count", whereabouts.landmark_count, whereabouts.landmarks.len())?;
    whereabouts.landmarks().iter().try_for_each(|believed| {
        let is_one = (0.0..=1.0).contains(&believed.probability);
        ensure(is_one, "landmarks", "a probability from 0 to 1", believed.probability)
    })
}

/// Checks that the flags are 0 or 1 and that the reference has a plausible position.
fn journey(journey: &Journey) -> Checked {
    ensure(journey.has_reference <= 1, "has_reference", "0 or 1", journey.has_reference)?;
    ensure(journey.cannot_locate <= 1, "cannot_locate", "0 or 1", journey.cannot_locate)?;
    near("reference_x_m, reference_y_m", [journey.reference_x_m, journey.reference_y_m])
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;
    use sketchnav_schemas::samples::{Spoil, rejected};

    use super::*;

    #[test]
    fn words_mean_one_of_the_dots_in_view() {
        let mut valid = Description::zeroed();
        (valid.dot_count, valid.meant[3]) = (2, 2);
        rejected(
            valid,
            &[
                |described| described.dot_count = 65,
                |described| described.meant[0] = 3,
                |described| described.dots[0].x_m = f32::INFINITY,
            ],
        );
        let spoils: [Spoil<Journey>; 2] =
            [|journey| journey.has_reference = 2, |journey| journey.reference_x_m = f64::NAN];
        rejected(Journey::zeroed(), &spoils);
    }

    #[test]
    fn a_chart_has_journeys_and_a_belief_has_probabilities() {
        let mut valid = Chart::zeroed();
        (valid.journey_count, valid.sigma_m) = (1, 0.001);
        rejected(
            valid,
            &[
                |chart| chart.journey_count = 65,
                |chart| chart.sigma_m = -0.001,
                |chart| chart.journeys[0].start_x_m = f32::NAN,
            ],
        );
        let mut valid = Whereabouts::zeroed();
        valid.landmark_count = 2;
        rejected(
            valid,
            &[
                |whereabouts| whereabouts.landmark_count = 9,
                |whereabouts| whereabouts.landmarks[1].probability = 1.5,
            ],
        );
    }
}

//! Its messages and channels: the custom maps, the description of the window, the state of a journey.
//!
//! Places in the view are metres in the window's own axes, from its centre: x to its right, y upwards.

use sketchnav_schemas::declare::{channels, codes, messages, parts};
use sketchnav_schemas::message::{MAX_DOTS, MAX_PLANE_DOTS};
use sketchnav_schemas::valid::{Checked, count, ensure, near};

use crate::stages::mission::KIND;

/// Most bytes of the custom maps of a mission.
pub const MAX_DIRECTIONS_BYTES: usize = 1 << 20;
/// Most landmarks of all journeys of a mission.
pub const MAX_PLANNED: usize = 512;
/// Words of the language of custom maps.
pub const MAX_WORDS: usize = 8;

codes! {
    /// What a navigator by landmarks is doing.
    pub enum Activity {
        /// It looks for the landmark that a word means.
        Seek = 0 "seek",
        /// It brings a pair of landmarks to the middle of its window, or slides along their line.
        Slide = 1 "slide",
        /// It looks around the landmark that it has attained.
        Verify = 2 "verify",
        /// It moves the landmark to the corner that the entry says.
        Adjust = 3 "adjust",
        /// It goes back from a wrong landmark.
        Recover = 4 "recover",
        /// It rests.
        Rest = 5 "rest",
    }
}

messages! {
    /// The custom maps of the tasks; the slice behind it is their text. A line `---` ends the map of a task.
    pub struct Directions version 1 in "" with data {
        /// How many maps there are.
        pub map_count: u32,
        /// Zero.
        pub reserved: u32 as Zero,
    }

    /// What the map-maker means by the custom maps, for people and the judge: no navigator hears of it. The slice behind it
    /// has the dots as the map-maker sees them, two f32 each: x and y, metres, frame `world`.
    pub struct Itinerary version 1 in "world" with data {
        /// How many entries of `journeys` count.
        pub journey_count: u32 as Count,
        /// How many entries of `landmarks` count.
        pub landmark_count: u32 as Count,
        /// The journeys, one a task.
        pub journeys: [PlannedJourney; 64] where journey_count counts,
        /// The landmarks, one for each entry of each map; empty for a map that the map-maker did not make.
        pub landmarks: [PlannedLandmark; 512] where landmark_count counts,
    }

    /// What is in view, described: how isolated each dot is, what surrounds it, and which dot each word means.
    pub struct Description version 1 in "window" valid if description {
        /// When the view was taken; 0 before the first.
        pub view_stamp_ns: u64,
        /// The number of the view: the same number is the same view; 0 before the first.
        pub views: u64,
        /// How many entries of `dots` count.
        pub dot_count: u32 as Count,
        /// Zero.
        pub reserved: u32 as Zero,
        /// Which entry of `dots` each word means in the window proper, from 1; 0 for none. The order is that of
        /// the language.
        pub meant: [u32; 8],
        /// The dots.
        pub dots: [DescribedDot; 64] where dot_count counts,
    }

    /// How a journey stands.
    pub struct Journey version 1 in "window" valid if journey {
        /// What the navigator is doing.
        pub activity: u32 as Activity,
        /// The task, from 0.
        pub task: u32,
        /// The entry of the map that it works on, from 0.
        pub entry: u32,
        /// How many entries it has finished, each with a landmark that it took as right.
        pub accepted: u32,
        /// How often it has recovered.
        pub recoveries: u32,
        /// Whether it knows where its reference landmark is: 0 or 1.
        pub has_reference: u32,
        /// 1: it could not locate the landmark of its entry, and has given up.
        pub cannot_locate: u32,
        /// Zero.
        pub reserved: u32 as Zero,
        /// The reference landmark, to the right of the window's centre.
        pub reference_x_m: f64,
        /// The reference landmark, above the window's centre.
        pub reference_y_m: f64,
    }
}

parts! {
    /// A dot in view with what is said of it.
    pub struct DescribedDot {
        /// To the right of the window's centre, metres.
        pub x_m: f32,
        /// Above the window's centre, metres.
        pub y_m: f32,
        /// How isolated it is among the dots of the window proper: the least of its mutual neighbourhood values; 0 for none.
        pub isolation: u32,
        /// Which of its quadrants hold another dot in view, a bit each: SE 1, SW 2, NE 4, NW 8.
        pub quadrants: u32,
    }
}

parts! {
    /// A journey as it is planned.
    pub struct PlannedJourney {
        /// The way of the window, metres; 0 where the map-maker did not make the map.
        pub distance_m: f64,
        /// The probability of arrival; below 0 where it was not estimated.
        pub probability: f64,
    }
}

parts! {
    /// A landmark as the map-maker sees it.
    pub struct PlannedLandmark {
        /// The task, from 0.
        pub task: u32,
        /// Its number among the dots that the map-maker sees, from 0.
        pub dot: u32,
        /// Its place, metres.
        pub x_m: f32,
        /// Its place, metres.
        pub y_m: f32,
    }
}

impl Description {
    /// The dots that count.
    pub fn dots(&self) -> &[DescribedDot] {
        &self.dots[..(self.dot_count as usize).min(MAX_DOTS)]
    }
}

impl Itinerary {
    /// The journeys that count.
    pub fn journeys(&self) -> &[PlannedJourney] {
        &self.journeys[..(self.journey_count as usize).min(self.journeys.len())]
    }

    /// The landmarks of a task, one for each entry of its map.
    pub fn landmarks(&self, task: usize) -> impl Iterator<Item = &PlannedLandmark> {
        let counted = &self.landmarks[..(self.landmark_count as usize).min(MAX_PLANNED)];
        counted.iter().filter(move |landmark| landmark.task as usize == task)
    }
}

channels! {
    of KIND;
    /// The custom maps.
    DIRECTIONS: Instruction Directions = "directions", Sketcher => [Planner],
        behind it up to MAX_DIRECTIONS_BYTES;
    /// What the map-maker means by them; no navigator may open it.
    ITINERARY: Instruction Itinerary = "itinerary", Sketcher => [Supervisor, Pad],
        behind it up to 8 * MAX_PLANE_DOTS;
    /// What is in view, described.
    DESCRIPTION: Situation Description = "description", Localizer => [Planner, Pad];
    /// How the journey stands.
    JOURNEY: Detail Journey = "journey", Planner => [Pad];
}

/// Dots as many as are counted, and words that mean one of them or none.
fn description(description: &Description) -> Checked {
    count("dot_count", description.dot_count, MAX_DOTS)?;
    near("dots", description.dots().iter().flat_map(|dot| [dot.x_m, dot.y_m]))?;
    let meant = &description.meant[..MAX_WORDS];
    let dots = description.dot_count;
    meant.iter().try_for_each(|&dot| ensure(dot <= dots, "meant", "a dot of those that are counted", dot))
}

/// A reference at a place that can be.
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
}

//! Messages about outlines: what of a drawing corresponds to what a robot has seen.

use super::PoseM;
use crate::codes::{CourseAim, QuestionKind};
use crate::declare::{messages, parts};

/// Most samples of a drawing's outline.
pub const MAX_SAMPLES: usize = 256;

messages! {
    /// The outline of the drawing, aligned with that of what the robot has seen, and what it drives to because of it. Places of
    /// the map are in metres; its origin is where the robot was at its first scan, x along its heading then.
    pub struct Correspondence version 1 in "map" {
        /// The robot in the map.
        pub robot: PoseM,
        /// The odometry that belongs to it.
        pub odometry: PoseM,
        /// Where the goal lies by the walls that were seen.
        pub goal_m: [f64; 2],
        /// Share of the outline around the goal that was seen.
        pub seen_share: f64,
        /// Share that lies behind gaps.
        pub hidden_share: f64,
        /// What the alignment costs.
        pub cost: f64,
        /// What the best alignment that has the goal elsewhere costs more; negative where none was asked for.
        pub rival_margin: f64,
        /// Where that has the goal, or the gap behind which it has it.
        pub rival_m: [f64; 2],
        /// What the robot looks for on its course.
        pub target_m: [f64; 2],
        /// What the course leads to.
        pub aim: u32 as CourseAim,
        /// How many gaps the outline of what was seen has.
        pub gap_count: u32,
        /// How many entries of `samples` count.
        pub sample_count: u32 as Count,
        /// How many entries of `way_m` count.
        pub way_count: u32 as Count,
        /// The samples of the drawing's outline, counter-clockwise.
        pub samples: [OutlineSample; 256] where sample_count counts,
        /// The way to the end of the course.
        pub way_m: [[f32; 2]; 128] where way_count counts,
    }
}

messages! {
    /// What the robot asks a person: where in the drawing it is. The answer is an order `here`.
    pub struct Question version 1 in "sketch" {
        /// What is asked.
        pub kind: u32 as QuestionKind,
        /// How many entries of `places` count.
        pub place_count: u32 as Count,
        /// Where the robot may be, the likeliest first: A, B, C, D for people.
        pub places: [PossiblePlace; 4] where place_count counts,
    }
}

parts! {
    /// A place of the drawing where the robot may be.
    pub struct PossiblePlace {
        /// First coordinate, pixels.
        pub x_px: f64,
        /// Second coordinate, pixels, upwards.
        pub y_px: f64,
        /// What the alignment that has the robot there costs more than the best one.
        pub margin: f64,
    }
}

parts! {
    /// A sample of a drawing's outline.
    pub struct OutlineSample {
        /// Where it is in the drawing, pixels.
        pub x_px: f32,
        /// Where it is in the drawing, pixels, upwards.
        pub y_px: f32,
        /// Its partner's place in the map; of a gap its middle.
        pub x_m: f32,
        /// Its partner's place in the map.
        pub y_m: f32,
        /// What it corresponds to: a number of [`crate::codes::PartnerKind`].
        pub partner: u32,
        /// Share of the goal's outline that it has.
        pub goal_share: f32,
    }
}

impl Question {
    /// The places that count.
    pub fn places(&self) -> &[PossiblePlace] {
        &self.places[..(self.place_count as usize).min(self.places.len())]
    }
}

impl Correspondence {
    /// The samples that count.
    pub fn samples(&self) -> &[OutlineSample] {
        &self.samples[..(self.sample_count as usize).min(MAX_SAMPLES)]
    }
}

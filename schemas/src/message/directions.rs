//! Messages of directions from landmark to landmark (Park and Kender 1995). They hold the dots that a window shows,
//! the description of the window, the custom map, and the state of a journey.
//!
//! Places in the view are metres in the window's own axes, from its centre: x to its right, y upwards.

use crate::codes::Activity;
use crate::declare::{messages, parts};
use crate::valid;

/// Most bytes of the custom maps of a mission.
pub const MAX_DIRECTIONS_BYTES: usize = 1 << 20;
/// Most dots that a view shows.
pub const MAX_DOTS: usize = 64;
/// Most landmarks of all journeys of a mission.
pub const MAX_PLANNED: usize = 512;
/// Most dots of a plane.
pub const MAX_PLANE_DOTS: usize = 20_000;
/// Words of the language of custom maps.
pub const MAX_WORDS: usize = 8;

messages! {
    /// What a square window shows of a plane of dots. A view has no names and no numbers: all dots are alike.
    pub struct DotView version 1 in "window" valid if valid::view {
        /// The side of the window.
        pub side_m: f32,
        /// How far the camera sees beyond each edge of the window.
        pub margin_m: f32,
        /// Time between two views.
        pub frame_time_s: f32,
        /// How many entries of `dots` count.
        pub dot_count: u32 as Count,
        /// The dots, from the bottom of the view to its top.
        pub dots: [SeenDot; 64] where dot_count counts,
    }

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
    pub struct Description version 1 in "window" valid if valid::description {
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
    pub struct Journey version 1 in "window" valid if valid::journey {
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
    /// A dot in view.
    pub struct SeenDot {
        /// To the right of the window's centre, metres.
        pub x_m: f32,
        /// Above the window's centre, metres.
        pub y_m: f32,
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

impl DotView {
    /// The dots that count.
    pub fn dots(&self) -> &[SeenDot] {
        &self.dots[..(self.dot_count as usize).min(MAX_DOTS)]
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

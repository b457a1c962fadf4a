//! Draws the markers that the robot remembers for a page, and the pair that it drives by.

use sketchnav_schemas::robot::Robot;
use sketchnav_stage::lookout::{self, Around, Color, Picture, Shape, polar};
use sketchnav_stage::{Denied, Incoming};

use crate::messages::{KnownMarker, PairedMarker, RELATIONS, Relations, Trend};

/// Length of the line that shows which way a marker faces, in metres.
const FACING_M: f64 = 0.25;
/// Positions of the two lines of text that describe the pair, as shares of the visible distance ahead.
const ROWS: [f64; 2] = [0.94, 0.88];

/// Draws the latest relations.
pub struct Lookout {
    around: Around,
    relations: Option<Box<Relations>>,
}

impl Lookout {
    /// Creates a lookout for this robot.
    pub fn new(robot: &Robot) -> Self {
        Self { around: Around::robot(robot), relations: None }
    }

    fn marker(&self, marker: &KnownMarker) -> Vec<Shape> {
        let [x, y, facing] = [marker.x_m, marker.y_m, marker.facing_rad].map(f64::from);
        let at = [x, y];
        // A marker outside the sheet would be drawn over its neighbours.
        if !self.around.shows(at) {
            return Vec::new();
        }
        let color = if marker.age_s == 0.0 { Color::Goal } else { Color::Particle };
        let beside = polar(at, -FACING_M, facing);
        vec![
            Shape::line([at, polar(at, FACING_M, facing)], color),
            Shape::Text { at: beside, text: marker.id.to_string(), color: Color::Ink },
        ]
    }
}

impl lookout::Lookout for Lookout {
    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), Denied> {
        if let Some(relations) = message.on(RELATIONS)? {
            self.relations = Some(Box::new(*relations));
        }
        Ok(())
    }

    fn draw(&mut self, picture: &mut Picture) {
        let Some(relations) = &self.relations else { return };
        picture.shapes.extend(relations.markers().iter().flat_map(|marker| self.marker(marker)));
        if relations.pairs > 0 && relations.pair_age_s == 0.0 {
            let pair = [&relations.left, &relations.right];
            pair.iter().for_each(|marker| picture.line([[0.0; 2], [marker.x_m, marker.y_m]], Color::Plan));
            picture.shapes.extend(pair.into_iter().zip(ROWS).map(|(marker, row)| {
                let at = [row * self.around.reach_m, 0.0];
                Shape::Text { at, text: described(marker), color: Color::Ink }
            }));
        }
    }
}

fn described(marker: &PairedMarker) -> String {
    let class = ["near", "medium", "far"].get(marker.distance_class as usize).copied();
    let trend = match marker.marker_trend() {
        Trend::Towards => "coming nearer",
        Trend::Stable => "at the same distance",
        Trend::Away => "going away",
        Trend::Unknown => "seen for the first time",
    };
    format!("{} is {}, {trend}", marker.id, class.unwrap_or("of no class"))
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;
    use sketchnav_schemas::codes::Process;
    use sketchnav_stage::Access;
    use sketchnav_stage::lookout::Lookout as _;

    use super::*;
    use crate::mission::KIND;

    fn youbot() -> Robot {
        Robot::parse(include_str!("../../../../sim/robots/youbot.toml")).unwrap()
    }

    /// A marker beyond the edge of the canvas used to be drawn over its neighbours.
    #[test]
    fn a_pair_is_described_and_a_far_marker_is_omitted() {
        let mut relations = Relations::zeroed();
        (relations.pairs, relations.marker_count) = (1, 2);
        relations.markers[0] = KnownMarker { id: 3, x_m: 2.0, y_m: 1.0, ..KnownMarker::zeroed() };
        relations.markers[1] = KnownMarker { id: 4, x_m: 90.0, ..KnownMarker::zeroed() };
        (relations.left.id, relations.left.distance_class) = (3, 1);
        relations.left.marker_trend = Trend::Towards.code();
        let mut lookout = Lookout::new(&youbot());
        let access = Access::new(Process::Pad, KIND);
        lookout
            .receive(&Incoming::new(&access, RELATIONS.spec, bytemuck::bytes_of(&relations), &[]))
            .unwrap();
        let mut picture = Picture::default();
        lookout.draw(&mut picture);
        let words: Vec<_> = picture
            .shapes
            .into_iter()
            .filter_map(|shape| if let Shape::Text { text, .. } = shape { Some(text) } else { None })
            .collect();
        assert_eq!(words[..2], ["3", "3 is medium, coming nearer"]);
        assert!(!words.contains(&"4".to_owned()), "{words:?}");
    }
}

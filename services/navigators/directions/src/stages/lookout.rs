//! Draws a journey with a custom map for the page. The window and its dots are in the middle of the sheet, surrounded by the plane
//! as the map-maker sees it, on the assumption that the navigator is right about its landmark. If the dots in the window do not
//! coincide with those of the plane, the navigator is wrong. For a navigator with a belief, the plane is placed by the most
//! probable landmark, and the other candidates are marked.

use sketchnav_schemas::robot::Robot;
use sketchnav_stage::lookout::{self, Around, Color, Picture, Shape};
use sketchnav_stage::{Denied, Incoming};

use super::reference::Reference;
use super::sketcher::{dots_of, maps_of};
use crate::custom_map::CustomMap;
use crate::custom_map::graph::Node;
use crate::markers::LandmarkKind;
use crate::messages::{
    Activity, CHART, DESCRIPTION, DIRECTIONS, Description, ITINERARY, Itinerary, JOURNEY, Journey,
    PlannedLandmark, WHEREABOUTS, Whereabouts,
};

/// Distance ahead of the robot at which the name of the current entry appears, as a fraction of the displayed distance.
const ROW: f64 = 0.92;
/// Points farther away than this multiple of the displayed distance are left out.
const NEAR: f64 = 3.0;

/// Landmarks with at least this probability are marked.
const LEAST: f32 = 0.02;

/// The latest state of the plane and of the journey.
pub struct Lookout {
    reach_m: f64,
    /// Side of the window, in metres. `None` for a robot on land, for which only the sensors and the kinds of the landmarks in view
    /// are drawn.
    side_m: Option<f64>,
    /// The kinds of landmarks, in the order in which descriptions count them.
    kinds: Vec<LandmarkKind>,
    itinerary: Option<Box<Itinerary>>,
    /// The custom maps of the tasks.
    maps: Vec<CustomMap>,
    /// The dots at the positions where the map-maker sees them, in metres.
    dots: Vec<[f64; 2]>,
    description: Option<Box<Description>>,
    journey: Option<Journey>,
    reference: Reference,
    /// The landmarks that a navigator with a belief knows, in metres.
    chart: Vec<[f64; 2]>,
    whereabouts: Option<Whereabouts>,
}

impl Lookout {
    /// Creates a lookout for a robot and the given kinds of landmarks.
    pub fn new(robot: &Robot, kinds: Vec<LandmarkKind>) -> Self {
        let side_m = robot.view.as_ref().map(|view| view.side_m);
        let Around { reach_m } = Around::robot(robot);
        Self {
            reach_m,
            side_m,
            kinds,
            itinerary: None,
            maps: Vec::new(),
            dots: Vec::new(),
            description: None,
            journey: None,
            reference: Reference::default(),
            chart: Vec::new(),
            whereabouts: None,
        }
    }

    /// Updates the planned landmarks and the dots that accompany them.
    fn intend(&mut self, itinerary: &Itinerary, cells: &[u8]) {
        self.dots = dots_of(cells).map(|dot| [dot.x, dot.y]).collect();
        self.itinerary = Some(Box::new(*itinerary));
    }

    /// Updates the state of the journey.
    fn follow(&mut self, journey: &Journey) {
        if self.journey.is_some_and(|last| last.task != journey.task) {
            self.reference = Reference::default();
        }
        if let Some(map) = self.maps.get(journey.task as usize) {
            self.reference.update(map, journey);
        }
        self.journey = Some(*journey);
    }

    /// Returns the landmarks that the map of the current task refers to.
    fn landmarks(&self) -> Vec<PlannedLandmark> {
        let under_way = self.itinerary.iter().zip(&self.journey);
        under_way.flat_map(|(all, journey)| all.landmarks(journey.task as usize)).copied().collect()
    }

    /// Returns the position of the window's centre, assuming that the reference is the landmark that the map refers to.
    fn centre(&self) -> Option<[f64; 2]> {
        let journey = self.journey.as_ref().filter(|journey| journey.has_reference == 1)?;
        let in_map = || {
            let landmark = *self.reference.node()?.landmark(&self.landmarks())?;
            Some([landmark.x_m, landmark.y_m].map(f64::from))
        };
        let [x, y] = self.believed().next().map(|(at, _)| at).or_else(in_map)?;
        Some([x - journey.reference_x_m, y - journey.reference_y_m])
    }

    /// Returns the landmarks at which a navigator with a belief may be, with their probabilities, in descending order.
    fn believed(&self) -> impl Iterator<Item = ([f64; 2], f32)> {
        let all = self.whereabouts.iter().flat_map(|whereabouts| whereabouts.landmarks());
        let at = |landmark: u32| self.chart.get(landmark as usize).copied();
        all.filter_map(move |believed| Some((at(believed.landmark)?, believed.probability)))
    }

    /// Returns all shapes, with a window of the given side in the middle. The robot's forward axis is the window's first axis.
    fn shapes(&self, side_m: f64) -> Vec<Shape> {
        let half_m = side_m / 2.0;
        let corners = vec![[-half_m, -half_m], [half_m, -half_m], [half_m, half_m], [-half_m, half_m]];
        let mut shapes = vec![Shape::Area { points: corners, color: Color::Edge }];
        if let Some([x, y]) = self.centre() {
            let beside = self.dots.iter().map(|dot| [dot[0] - x, dot[1] - y]);
            shapes.push(Shape::Dots { points: self.near(beside), color: Color::Particle });
            let planned = self.ahead().into_iter().map(|[to_x, to_y]| [to_x - x, to_y - y]);
            shapes.push(Shape::line(self.near(planned), Color::Plan));
            let others = self.believed().skip(1).filter(|(_, probability)| *probability >= LEAST);
            let others = others.map(|([at_x, at_y], _)| [at_x - x, at_y - y]);
            shapes.push(Shape::Dots { points: self.near(others), color: Color::Goal });
        }
        let seen = self.description.iter().flat_map(|all| all.dots());
        let seen = seen.map(|dot| [dot.x_m.into(), dot.y_m.into()]);
        shapes.push(Shape::Dots { points: self.near(seen), color: Color::Scan });
        if let Some(journey) = &self.journey {
            let reference = [journey.reference_x_m, journey.reference_y_m];
            let points = self.near((journey.has_reference == 1).then_some(reference));
            shapes.push(Shape::Dots { points, color: Color::Goal });
            let activity = Activity::from_code(journey.activity).map_or("", Activity::word);
            let text = match self.believed().next() {
                Some((_, probability)) => {
                    let (movement, percent) = (journey.entry, 100.0 * probability);
                    format!("movement {movement}: {activity}; {percent:.0} % sure of its landmark")
                }
                None => format!("entry {}: {activity}", journey.entry + 1),
            };
            shapes.push(Shape::Text { at: [ROW * self.reach_m, 0.0], text, color: Color::Ink });
        }
        shapes
    }

    /// Describes the stated probability of arrival of the current task, or of the first one before the start, and the entry that is
    /// most likely to fail.
    fn stated(&self) -> Option<String> {
        let task = self.journey.map_or(0, |journey| journey.task as usize);
        self.itinerary.as_ref()?.journeys().get(task)?.stated()
    }

    /// Returns labels beside the dots in view that name their kinds.
    fn names(&self) -> impl Iterator<Item = Shape> {
        let dots = self.description.iter().flat_map(|all| all.dots());
        dots.filter_map(|dot| {
            let kind = self.kinds.get((dot.kind as usize).checked_sub(1)?)?;
            let at = [dot.x_m.into(), dot.y_m.into()];
            Some(Shape::Text { at, text: kind.to_string(), color: Color::Ink })
        })
    }

    /// Returns the positions of the planned landmarks of the current task from the reference to the goal, in metres.
    fn ahead(&self) -> Vec<[f64; 2]> {
        let (Some(journey), Some(node)) = (&self.journey, self.reference.node()) else { return Vec::new() };
        let path = self.maps.get(journey.task as usize).map(|map| map.path_from(node)).unwrap_or_default();
        let landmarks = self.landmarks();
        let places = path.into_iter().filter_map(|node: Node| node.landmark(&landmarks));
        places.map(|landmark| [landmark.x_m.into(), landmark.y_m.into()]).collect()
    }

    /// Removes points far beyond the sheet.
    fn near(&self, places: impl IntoIterator<Item = [f64; 2]>) -> Vec<[f64; 2]> {
        let is_near = |at: &[f64; 2]| at.iter().all(|v| v.abs() <= NEAR * self.reach_m);
        places.into_iter().filter(is_near).collect()
    }
}

impl lookout::Lookout for Lookout {
    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), Denied> {
        if let Some(itinerary) = message.on(ITINERARY)? {
            self.intend(itinerary, message.cells());
        }
        if message.on(DIRECTIONS)?.is_some() {
            // An invalid text contains no maps.
            let text = std::str::from_utf8(message.cells()).unwrap_or_default();
            self.maps = maps_of(text).unwrap_or_default();
        }
        if message.on(CHART)?.is_some() {
            self.chart = dots_of(message.cells()).map(|at| [at.x, at.y]).collect();
        }
        if let Some(whereabouts) = message.on(WHEREABOUTS)? {
            self.whereabouts = Some(*whereabouts);
        }
        if let Some(description) = message.on(DESCRIPTION)? {
            self.description = Some(Box::new(*description));
        }
        if let Some(journey) = message.on(JOURNEY)? {
            self.follow(journey);
        }
        Ok(())
    }

    fn draw(&mut self, picture: &mut Picture) {
        picture.words.extend(self.stated());
        picture.shapes.extend(self.side_m.iter().flat_map(|side_m| self.shapes(*side_m)));
        picture.shapes.extend(self.names());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{BelievedLandmark, Chart, DescribedDot, Directions, PlannedJourney};
    use crate::stages::mission::KIND;
    use sketchnav_schemas::codes::Process;
    use sketchnav_stage::Access;
    use sketchnav_stage::lookout::Lookout as _;

    fn lookout() -> Lookout {
        let robot = include_str!("../../../../../sim/robots/helicopter.toml");
        Lookout::new(&Robot::parse(robot).unwrap(), Vec::new())
    }

    /// Returns the dots of all shapes in the wanted colour.
    fn dots(shapes: &[Shape], wanted: Color) -> Vec<[f64; 2]> {
        let of = |shape: &Shape| match shape {
            Shape::Dots { points, color } if *color == wanted => points.clone(),
            _ => Vec::new(),
        };
        shapes.iter().flat_map(of).collect()
    }

    #[test]
    fn a_dot_in_view_lies_on_its_dot_of_the_plane_where_the_navigator_is_right() {
        let mut itinerary: Box<Itinerary> = bytemuck::zeroed_box();
        itinerary.landmark_count = 2;
        itinerary.landmarks[1] = PlannedLandmark { task: 0, dot: 0, x_m: 1.0, y_m: 0.5 };
        let cells: Vec<u8> = [1.0_f32, 0.5].iter().flat_map(|v| v.to_le_bytes()).collect();
        let mut journey: Box<Journey> = bytemuck::zeroed_box();
        (journey.activity, journey.entry) = (Activity::Rest.code(), 1);
        (journey.accepted, journey.has_reference, journey.reference_x_m) = (2, 1, 0.25);
        let mut description: Box<Description> = bytemuck::zeroed_box();
        description.dot_count = 1;
        description.dots[0] = DescribedDot { x_m: 0.25, y_m: 0.0, isolation: 0, quadrants: 0, kind: 0 };
        let mut lookout = lookout();
        let access = Access::new(Process::Pad, KIND);
        lookout
            .receive(&Incoming::new(&access, ITINERARY.spec, bytemuck::bytes_of(&*itinerary), &cells))
            .unwrap();
        let map = b"(*, SW)\n(Isol, -)";
        let directions: Box<Directions> = bytemuck::zeroed_box();
        lookout
            .receive(&Incoming::new(&access, DIRECTIONS.spec, bytemuck::bytes_of(&*directions), map))
            .unwrap();
        lookout.receive(&Incoming::new(&access, JOURNEY.spec, bytemuck::bytes_of(&*journey), &[])).unwrap();
        lookout
            .receive(&Incoming::new(&access, DESCRIPTION.spec, bytemuck::bytes_of(&*description), &[]))
            .unwrap();
        let shapes = lookout.shapes(0.1);
        let there = dots(&shapes, Color::Particle);
        assert_eq!((there.len(), dots(&shapes, Color::Scan)), (1, there.clone()));
        assert_eq!(dots(&shapes, Color::Goal), there);
    }

    /// What to expect of a journey used to be printed on the terminal only.
    #[test]
    fn the_page_says_how_probable_the_arrival_is_and_which_entry_is_weakest() {
        let mut itinerary: Box<Itinerary> = bytemuck::zeroed_box();
        itinerary.journey_count = 2;
        itinerary.journeys[0] = PlannedJourney {
            probability: 0.617,
            weakest_entry: 4,
            failure_count: 95,
            simulated_count: 512,
            ..PlannedJourney::new(1.0)
        };
        itinerary.journeys[1] = PlannedJourney::new(1.0);
        let mut lookout = lookout();
        let mut picture = Picture::default();
        lookout.draw(&mut picture);
        assert!(picture.words.is_empty(), "nothing is planned yet");
        lookout.intend(&itinerary, &[]);
        lookout.draw(&mut picture);
        let words = "probability of arrival 61.7 %; most failures at entry 4: 95 of 512 simulated journeys";
        assert_eq!(picture.words, [words]);
        let mut journey: Box<Journey> = bytemuck::zeroed_box();
        journey.task = 1;
        lookout.follow(&journey);
        let mut picture = Picture::default();
        lookout.draw(&mut picture);
        assert!(picture.words.is_empty(), "the second task has no estimate");
    }

    #[test]
    fn on_land_a_landmark_has_the_name_of_its_kind() {
        let kinds = ["door", "stairs"].map(|name| LandmarkKind::of(name).unwrap()).to_vec();
        let robot = include_str!("../../../../../sim/missions/directions/panorama-camera.toml");
        let mut lookout = Lookout::new(&Robot::parse(robot).unwrap(), kinds);
        let mut description: Box<Description> = bytemuck::zeroed_box();
        description.dot_count = 2;
        (description.dots[0].x_m, description.dots[1].x_m, description.dots[1].kind) = (1.0, 2.0, 2);
        let access = Access::new(Process::Pad, KIND);
        let incoming = Incoming::new(&access, DESCRIPTION.spec, bytemuck::bytes_of(&*description), &[]);
        lookout.receive(&incoming).unwrap();
        let mut picture = Picture::default();
        lookout.draw(&mut picture);
        let [Shape::Text { at, text, .. }] = &picture.shapes[..] else { panic!("{:?}", picture.shapes) };
        assert_eq!((*at, text.as_str()), ([2.0, 0.0], "stairs"));
    }

    #[test]
    fn after_a_branch_the_plane_is_drawn_around_the_landmark_of_the_entry() {
        let mut itinerary: Box<Itinerary> = bytemuck::zeroed_box();
        itinerary.landmark_count = 4;
        for (landmark, x_m) in itinerary.landmarks.iter_mut().zip([1.0, 2.0, 3.0, 3.1]) {
            landmark.x_m = x_m;
        }
        let map = b"(*, SW)\n(Isol, (2, NE, 4), (3, -), SW)\n(Isol, -)\n(Isol, -)";
        let directions: Box<Directions> = bytemuck::zeroed_box();
        let mut lookout = lookout();
        let access = Access::new(Process::Pad, KIND);
        lookout
            .receive(&Incoming::new(&access, ITINERARY.spec, bytemuck::bytes_of(&*itinerary), &[]))
            .unwrap();
        lookout
            .receive(&Incoming::new(&access, DIRECTIONS.spec, bytemuck::bytes_of(&*directions), map))
            .unwrap();
        let mut centre = |activity: Activity, entry: u32, accepted: u32, recoveries: u32| {
            let mut journey: Box<Journey> = bytemuck::zeroed_box();
            (journey.activity, journey.entry, journey.has_reference) = (activity.code(), entry, 1);
            (journey.accepted, journey.recoveries) = (accepted, recoveries);
            let incoming = Incoming::new(&access, JOURNEY.spec, bytemuck::bytes_of(&*journey), &[]);
            lookout.receive(&incoming).unwrap();
            (lookout.centre().map(|[x, _]| x), lookout.ahead().len())
        };
        assert_eq!(
            centre(Activity::Seek, 1, 1, 0),
            (Some(1.0), 3),
            "the landmarks of entries 2 and 3, and the goal"
        );
        assert_eq!(centre(Activity::Adjust, 1, 2, 1), (None, 0), "it does not say yet where it goes on");
        assert_eq!(centre(Activity::Seek, 3, 2, 1), (Some(3.0), 2), "the landmark of entry 4, and the goal");
    }

    #[test]
    fn around_a_belief_the_plane_is_drawn_as_if_its_most_probable_landmark_were_right() {
        let mut lookout = lookout();
        let access = Access::new(Process::Pad, KIND);
        let cells: Vec<u8> = [1.0_f32, 0.5, 1.1, 0.5].iter().flat_map(|v| v.to_le_bytes()).collect();
        let chart: Box<Chart> = bytemuck::zeroed_box();
        lookout.receive(&Incoming::new(&access, CHART.spec, bytemuck::bytes_of(&*chart), &cells)).unwrap();
        let mut journey: Box<Journey> = bytemuck::zeroed_box();
        (journey.entry, journey.has_reference) = (2, 1);
        lookout.receive(&Incoming::new(&access, JOURNEY.spec, bytemuck::bytes_of(&*journey), &[])).unwrap();
        let mut whereabouts: Box<Whereabouts> = bytemuck::zeroed_box();
        whereabouts.landmark_count = 2;
        whereabouts.landmarks[0] = BelievedLandmark { landmark: 1, probability: 0.9 };
        whereabouts.landmarks[1] = BelievedLandmark { landmark: 0, probability: 0.1 };
        let incoming = Incoming::new(&access, WHEREABOUTS.spec, bytemuck::bytes_of(&*whereabouts), &[]);
        lookout.receive(&incoming).unwrap();
        let [x, _] = lookout.centre().unwrap();
        assert!((x - 1.1).abs() < 1e-6, "{x}");
        let shapes = lookout.shapes(0.1);
        let marked = dots(&shapes, Color::Goal);
        assert!(marked.len() == 2 && (marked[0][0] + 0.1).abs() < 1e-6, "{marked:?}");
        let says = |shape: &Shape| matches!(shape, Shape::Text { text, .. } if text.contains("movement 2: seek; 90 %"));
        assert!(shapes.iter().any(says), "{shapes:?}");
    }

    #[test]
    fn before_the_first_landmark_there_is_the_window_alone() {
        assert_eq!(lookout().shapes(0.1).len(), 2);
    }
}

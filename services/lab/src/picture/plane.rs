//! Draws a plane of dots: its parkways and trajectories, the planned path, and the journeys over the plane.
//!
//! The colour of a journey's path shows what the navigator was doing.

use sketchnav_directions::CustomMap;
use sketchnav_directions::custom_map::graph::Node;
use sketchnav_directions::messages::Activity;
use sketchnav_schemas::geometry::{Point, World};

use super::marks::{self, Symbol};
use super::svg::{INK, Sheet, View, round_length};
use super::task::TaskPicture;

/// The landmarks of a task's custom map.
#[derive(Debug, Clone, Default)]
pub struct PlannedMap {
    /// Landmarks, one for each entry.
    pub landmarks: Vec<Point<World>>,
    /// Pairs of landmarks, where the first leads to the second.
    pub links: Vec<[Point<World>; 2]>,
    /// Whether the map branches. If so, the number of an entry is shown at the landmark where the entry begins, and otherwise at
    /// the landmark that it attains.
    pub branches: bool,
}

/// A plane and the journeys over it.
#[derive(Debug, Clone)]
pub struct PlanePicture<'a> {
    /// Heading of the picture.
    pub title: &'a str,
    /// Positions of the true dots.
    pub dots: &'a [Point<World>],
    /// Kinds of the dots, or empty if all are alike.
    pub kinds: &'a [String],
    /// Walls and other obstacles of a robot on land, as line segments.
    pub walls: &'a [[Point<World>; 2]],
    /// Pairs of landmarks that are joined by a parkway, as the map-maker sees them.
    pub parkways: &'a [[Point<World>; 2]],
    /// Pairs of landmarks that are joined by a trajectory.
    pub trajectories: &'a [[Point<World>; 2]],
    /// The landmarks of each task's map, in order.
    pub planned: &'a [PlannedMap],
    /// Paths of the window's centre, with one piece for each activity of the navigator.
    pub ways: &'a [(Activity, Vec<Point<World>>)],
    /// Corners of the window at some points in time.
    pub windows: &'a [Vec<Point<World>>],
    /// The tasks in order.
    pub tasks: &'a [TaskPicture<World>],
    /// Maximum length of the scale bar, in metres. Its actual length is a round number.
    pub bar_m: f64,
}

impl PlannedMap {
    /// Returns the landmarks of a map, given one for each entry.
    pub fn of(map: &CustomMap, landmarks: Vec<Point<World>>) -> Self {
        let link = |from: usize, to: Node| {
            Some([*Node::Entry(from).landmark(&landmarks)?, *to.landmark(&landmarks)?])
        };
        let edges = (0..map.entries().len()).flat_map(|entry| map.edges(entry));
        let links = edges.filter_map(|edge| link(edge.from, edge.to)).collect();
        Self { links, branches: map.branches(), landmarks }
    }
}

/// Returns the colour of an activity.
fn colour(activity: Activity) -> &'static str {
    match activity {
        Activity::Seek | Activity::Rest => "#5a6b86",
        Activity::Slide => "#c23b8f",
        Activity::Verify => "#e07b16",
        Activity::Adjust => "#2f6fd0",
        Activity::Recover => "#cf2e2e",
    }
}

/// Draws the plane as SVG.
pub fn plane(picture: &PlanePicture<'_>) -> String {
    let ways = picture.ways.iter().flat_map(|(_, way)| way);
    let view = View::around(picture.dots.iter().chain(ways).chain(picture.walls.as_flattened()));
    let mut sheet = Sheet::new(view, picture.title);
    marks::places(&mut sheet, picture.tasks);
    sheet.segments(picture.walls, "stroke=\"#20242c\" stroke-width=\"3\" stroke-linecap=\"round\"");
    sheet.segments(picture.trajectories, "stroke=\"#c23b8f\" stroke-width=\"0.8\" stroke-opacity=\"0.16\"");
    sheet.segments(picture.parkways, "stroke=\"#2b9a55\" stroke-width=\"2.2\" stroke-opacity=\"0.3\"");
    for window in picture.windows {
        sheet.polygon(
            window,
            "fill=\"#7a52cc\" fill-opacity=\"0.06\" stroke=\"#7a52cc\" stroke-opacity=\"0.4\"",
        );
    }
    for planned in picture.planned {
        sheet.segments(
            &planned.links,
            "stroke=\"#20242c\" stroke-width=\"1.6\" stroke-dasharray=\"3 5\" stroke-opacity=\"0.7\"",
        );
    }
    for (activity, way) in picture.ways {
        let style = format!("stroke=\"{}\" stroke-width=\"2.6\" stroke-opacity=\"0.85\"", colour(*activity));
        sheet.line(way, &style);
    }
    for dot in picture.dots {
        let [x, y] = sheet.view.at(dot);
        sheet.raw(format_args!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4.4\" fill=\"#20242c\"/>"));
    }
    for (dot, kind) in picture.dots.iter().zip(picture.kinds) {
        let [x, y] = sheet.view.at(dot);
        sheet.text([x, y + 18.0], 11.0, "middle", INK, "400", kind);
    }
    numbers(&mut sheet, picture.planned);
    marks::ends(&mut sheet, picture.tasks);
    sheet.scale_bar(round_length(picture.bar_m));
    marks::legend(&mut sheet, picture.tasks, &symbols(picture));
    sheet.finish()
}

/// Draws the landmarks with the numbers of their entries. Since each task begins where the previous one ends, several entries and
/// tasks may lead to the same landmark, which has a single label. If there are several tasks, the number of the task precedes that
/// of the entry.
fn numbers(sheet: &mut Sheet, planned: &[PlannedMap]) {
    for (landmark, numbers) in labels(planned) {
        let [x, y] = sheet.view.at(&landmark);
        sheet.raw(format_args!(
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"7\" fill=\"none\" stroke=\"#20242c\" stroke-width=\"1.4\"/>"
        ));
        sheet.text([x + 9.0, y - 7.0], 13.0, "start", INK, "600", &numbers.join(", "));
    }
}

fn labels(planned: &[PlannedMap]) -> Vec<(Point<World>, Vec<String>)> {
    let mut labels: Vec<(Point<World>, Vec<String>)> = Vec::new();
    for (task, map) in (1..).zip(planned) {
        for (entry, landmark) in (1..).zip(&map.landmarks) {
            let number = match map.branches {
                true if entry == map.landmarks.len() => "goal".to_owned(),
                branches => (entry + usize::from(branches)).to_string(),
            };
            let number = if planned.len() > 1 { format!("{task}.{number}") } else { number };
            match labels.iter_mut().find(|(at, _)| at == landmark) {
                Some((_, numbers)) => numbers.push(number),
                None => labels.push((*landmark, vec![number])),
            }
        }
    }
    labels
}

fn symbols(picture: &PlanePicture<'_>) -> Vec<Symbol> {
    let mut symbols = vec![Symbol::Line("planned", INK)];
    symbols.extend((!picture.parkways.is_empty()).then_some(Symbol::Line("parkways", "#2b9a55")));
    symbols.extend((!picture.windows.is_empty()).then_some(Symbol::View));
    for activity in [Activity::Slide, Activity::Verify, Activity::Adjust, Activity::Recover] {
        if picture.ways.iter().any(|(other, _)| *other == activity) {
            symbols.push(Symbol::Line(activity.word(), colour(activity)));
        }
    }
    symbols.extend([Symbol::Reached, Symbol::Failed]);
    symbols
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_landmark_of_several_entries_has_one_label() {
        let [a, b, c] = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)].map(|(x, y)| Point::<World>::new(x, y));
        let texts = |branches: bool, planned: &[&[Point<World>]]| -> Vec<String> {
            let map = |landmarks: &&[Point<World>]| PlannedMap {
                landmarks: landmarks.to_vec(),
                branches,
                ..PlannedMap::default()
            };
            let planned: Vec<_> = planned.iter().map(map).collect();
            labels(&planned).into_iter().map(|(_, numbers)| numbers.join(", ")).collect()
        };
        assert_eq!(texts(false, &[&[a, b], &[b, c, a]]), ["1.1, 2.3", "1.2, 2.1", "2.2"]);
        assert_eq!(texts(false, &[&[a, b, a]]), ["1, 3", "2"]);
        assert_eq!(texts(true, &[&[a, b, c]]), ["2", "3", "goal"], "where entries 2 and 3 begin");
    }

    #[test]
    fn a_picture_has_walls_and_a_round_scale_bar() {
        let [a, b] = [(0.0, 0.0), (30.0, 0.0)].map(|(x, y)| Point::<World>::new(x, y));
        let svg = plane(&PlanePicture {
            title: "a hall",
            dots: &[a, b],
            kinds: &["door".to_owned(), "pole".to_owned()],
            walls: &[[Point::new(9.0, -3.0), Point::new(9.0, 3.0)]],
            parkways: &[],
            trajectories: &[],
            planned: &[PlannedMap { landmarks: vec![a, b], links: vec![[a, b]], branches: false }],
            ways: &[],
            windows: &[],
            tasks: &[],
            bar_m: 4.963889603929565,
        });
        assert!(svg.contains(">2 m<"), "{svg}");
        assert!(svg.contains(">door<") && svg.contains(">pole<"), "{svg}");
        assert_eq!(svg.matches("stroke-width=\"3\"").count(), 1);
    }
}

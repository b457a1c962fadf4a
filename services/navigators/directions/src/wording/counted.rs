//! Landmarks counted on a side, such as "the second door on the left", in place of other words.
//!
//! The direction of travel depends on the previous landmark, so these words cannot be a property of a single transition either.

use super::Leg;
use crate::description::Descriptor;
use crate::geometry::Point;
use crate::markers::LandmarkKind;
use crate::path::{Atlas, Path};
use crate::plane::DotId;
use crate::sides::{Course, Ordinal, Side};
use crate::transitions::{Candidates, Movement};

/// Minimum angle between a leg and any direction in which the course of the next leg would be another, in radians.
const CLEAR_RAD: f64 = 0.17;

/// Returns the path with landmarks counted wherever the navigator will certainly count like the map-maker, even if it stands
/// up to `slack` from its intended position. Returns `None` if that is so nowhere.
pub fn counted(atlas: &Atlas, path: &Path, slack: f64) -> Option<Path> {
    let mut counted = path.clone();
    let mut course = Some(Course::default());
    for (index, leg) in path.legs.iter().enumerate() {
        let before = index.checked_sub(1).map(|before| &path.legs[before]);
        course = before.map_or(course, |before| next_course(atlas, before, course));
        let said = course.and_then(|course| said(atlas, leg, course, slack));
        if let Some((word, by_kind)) = said {
            let own = &mut counted.legs[index].transition;
            (own.word, own.by_kind) = (word, by_kind);
        }
    }
    (counted != *path).then_some(counted)
}

/// Returns the direction of travel after a leg, or `None` if it is too close to a diagonal of the map to be known.
fn next_course(atlas: &Atlas, leg: &Leg, before: Option<Course>) -> Option<Course> {
    if leg.transition.to == leg.from {
        return before;
    }
    let way = atlas.plane.dot(leg.transition.to) - atlas.plane.dot(leg.from);
    let course = Course::of(way);
    (course.clearness_rad(way) > CLEAR_RAD).then_some(course)
}

/// Returns the counted word for the landmark of a leg, and whether only landmarks of its kind count. Kinds and small ordinals are
/// preferred.
fn said(atlas: &Atlas, leg: &Leg, course: Course, slack: f64) -> Option<(Descriptor, bool)> {
    let is_seek = leg.transition.movement == Movement::Seek && leg.transition.word != Descriptor::Same;
    if !is_seek || atlas.counts.is_empty() {
        return None;
    }
    let mut seen = Candidates::default();
    seen.find(&atlas.plane, atlas.window, leg.from, leg.transition.corner);
    let own = leg.transition.seen;
    let kind = seen.marked.iter().find(|(dot, _)| *dot == own).map(|(_, kind)| *kind);
    let is_of_kind = |(_, other): &&(DotId, LandmarkKind)| Some(*other) == kind;
    let of_kind = seen.marked.iter().filter(is_of_kind).map(|(dot, _)| *dot);
    let all = seen.dots.iter().chain(&seen.beside).copied();
    let eye = atlas.centre(leg.from, leg.transition.corner);
    let among = |dots: Vec<DotId>| {
        let places: Vec<Point> = dots.iter().map(|&dot| atlas.plane.dot(dot) - eye).collect();
        let own = dots.iter().position(|&dot| dot == own)?;
        let words = Ordinal::all().flat_map(|number| atlas.counts.iter().map(move |&side| (side, number)));
        let is_sure = |&(side, number): &(Side, Ordinal)| is_sure(course, side, number, &places, own, slack);
        words.into_iter().find(is_sure).map(|(side, number)| Descriptor::Counted(side, number))
    };
    let by_kind = among(of_kind.collect()).map(|word| (word, true));
    by_kind.or_else(|| Some((among(all.collect())?, false)))
}

/// Returns true if an ordinal means this landmark wherever the navigator stands within `slack`, and no other landmark is counted at
/// nearly the same distance.
fn is_sure(course: Course, side: Side, number: Ordinal, places: &[Point], own: usize, slack: f64) -> bool {
    let offsets = [-slack, 0.0, slack].map(|x| [-slack, 0.0, slack].map(|y| Point::new(x, y)));
    let is_picked = |offset: Point| {
        let moved: Vec<Point> = places.iter().map(|&place| place - offset).collect();
        course.pick(side, number, &moved) == Some(own)
    };
    let is_apart =
        |place: &Point| !course.has(side, *place) || (place.norm() - places[own].norm()).abs() > slack;
    let mut others = places.iter().enumerate().filter(|(other, _)| *other != own).map(|(_, place)| place);
    offsets.into_iter().flatten().all(is_picked) && others.all(is_apart)
}

#[cfg(test)]
mod tests {
    use sketchnav_schemas::seed::stream;

    use super::*;
    use crate::custom_map::CustomMap;
    use crate::geometry::{Land, Window};
    use crate::navigator::{Navigator, Settings};
    use crate::path::{Measure, Objective, Start, best};
    use crate::plan::{Plan, Verify};
    use crate::plane::Plane;
    use crate::reliability::Reliability;
    use crate::testing::{camera, plane_of_kinds};
    use crate::transitions::Kinds;
    use crate::traversal::{Kind, Noise, Traversal};

    const LAND: Land = Land { radius: 0.15, range: 8.0, stand_off: 0.8, clearance: 0.5 };
    const WORDS: [Descriptor; 5] = [
        Descriptor::Any,
        Descriptor::Counted(Side::Left, Ordinal::FIRST),
        Descriptor::Counted(Side::Right, Ordinal::FIRST),
        Descriptor::Counted(Side::Ahead, Ordinal::FIRST),
        Descriptor::Counted(Side::Behind, Ordinal::FIRST),
    ];

    /// A corridor to the east with doors on both sides, and stairs to the north of its end.
    fn corridor() -> Plane {
        let dots = [
            (0.0, 0.0, "pole"),
            (2.6, 2.0, "door"),
            (5.0, 2.2, "door"),
            (4.0, -1.5, "door"),
            (9.6, 1.5, "door"),
            (9.0, 6.5, "stairs"),
        ];
        plane_of_kinds(camera(0.0), &dots)
    }

    fn atlas(words: &[Descriptor]) -> Atlas {
        let kinds = Kinds { words, trajectories: false };
        let window = Window::on_land(LAND).unwrap();
        Atlas::new(corridor(), window, kinds, Reliability::fitted(Noise::NONE))
    }

    fn shortest(atlas: &Atlas, goal: DotId) -> Path {
        let start = Start::over(&atlas.plane, 0).unwrap();
        best(atlas, start, goal, Measure::Windows, Objective::SHORTEST).unwrap()
    }

    #[test]
    fn a_map_counts_doors_and_the_navigator_takes_the_same() {
        let atlas = atlas(&WORDS);
        for (goal, word) in [(1, "door, Left1"), (2, "door, Left2"), (3, "door, Right1")] {
            let path = counted(&atlas, &shortest(&atlas, goal), 0.1).unwrap();
            let plan = Plan::new(&atlas, path, Verify::Nothing).unwrap();
            let map: CustomMap = plan.map.sentences().parse().unwrap();
            assert_eq!(map, plan.map);
            assert!(map.to_string().contains(word), "{map}");
            let settings = Settings { speed: 0.5, ..Settings::new(atlas.window, 0.0) };
            let navigator = Navigator::new(settings, map).unwrap();
            let meant = plan.landmarks();
            let journey = Traversal::new(&atlas.plane, &navigator, &meant, Noise::NONE).unwrap();
            let report = journey.run(plan.path.start.centre, &mut stream(1, "journey"), |_, _, _| {});
            assert_eq!(report.kind, Kind::Direct, "{}{report:?}", plan.map);
        }
    }

    #[test]
    fn what_a_small_error_would_count_differently_is_not_counted() {
        let atlas = atlas(&WORDS);
        let words = |slack: f64| -> Option<Vec<Descriptor>> {
            let path = counted(&atlas, &shortest(&atlas, 2), slack)?;
            Some(path.legs.iter().map(|leg| leg.transition.word).collect())
        };
        assert!(words(0.1).is_some());
        // The first and the second door on the left are 2.4 m apart.
        assert_eq!(words(2.6), None);
    }

    #[test]
    fn a_map_maker_that_is_not_to_count_does_not() {
        let atlas = atlas(&WORDS[..1]);
        assert_eq!(counted(&atlas, &shortest(&atlas, 2), 0.1), None);
    }

    #[test]
    fn after_a_diagonal_the_direction_of_travel_is_unknown() {
        let atlas = atlas(&WORDS);
        let leg = |from: DotId, to: DotId| {
            let path = shortest(&atlas, 1);
            Leg { from, transition: crate::Transition { to, ..path.legs[0].transition }, ..path.legs[0] }
        };
        let after = |from, to| next_course(&atlas, &leg(from, to), Some(Course::South));
        assert_eq!(after(0, 2), Some(Course::East));
        assert_eq!(after(4, 5), Some(Course::North));
        assert_eq!(after(0, 1), None, "38 degrees are too close to 45");
        assert_eq!(after(1, 1), Some(Course::South), "around the same landmark");
    }
}

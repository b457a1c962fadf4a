//! Tests of journeys through small worlds.

use std::sync::Arc;

use sketchnav_schemas::seed::stream;

use super::*;
use crate::custom_map::CustomMap;
use crate::error::Error;
use crate::geometry::{Corner, Land};
use crate::navigator::Settings;
use crate::signature::Signature;
use crate::testing::plane;
use crate::walls::Body;

fn window() -> Window {
    Window::new(10.0, 1.5).unwrap()
}

fn navigator(map: &str) -> Navigator {
    Navigator::new(Settings::new(window(), 0.0), map.parse::<CustomMap>().unwrap()).unwrap()
}

fn run(world: &Plane, map: &str, intended: &[DotId], from: (f64, f64)) -> (Report, Vec<Activity>) {
    let navigator = navigator(map);
    let journey = Traversal::new(world, &navigator, intended, Noise::NONE).unwrap();
    let from = Point::new(from.0, from.1);
    (
        journey.run(from, &mut stream(1, "journey"), |_, _, _| {}),
        activities(&journey, from, &mut stream(1, "journey")),
    )
}

/// A line of dots towards the north-east. From each dot, only the next one is within reach.
fn stairs() -> Plane {
    plane(&[(0.0, 0.0), (7.0, 6.0), (13.0, 14.0), (20.0, 20.0)])
}

#[test]
fn stairs_are_followed_directly() {
    let map = "(*, SW)\n(Isol, SW)\n(Obvious, SW)\n(Isol, -)";
    let (report, activities) = run(&stairs(), map, &[0, 1, 2, 3], (0.5, 0.5));
    assert_eq!((report.kind, &report.attained[..]), (Kind::Direct, &[0, 1, 2, 3][..]));
    assert_eq!(activities.first(), Some(&Activity::Adjust));
    assert_eq!(activities.last(), Some(&Activity::Rest));
    // The window's centre moves from (0.5, 0.5) to a position 5 north-east of the third dot.
    assert!((23.0..28.0).contains(&report.distance), "{}", report.distance);
}

/// Wherever the navigator is on the stairs, the panorama shows whether it is at the top.
#[test]
fn a_written_map_that_branches_goes_on_where_its_signs_say() {
    let step =
        |next: u32| format!("(Isol, (none+point+none+point, SW, {next}), (none+none+none+point, -), -)\n");
    let map = format!("(*, SW)\n{}{}(Isol, (none+none+none+point, -), -)", step(3), step(4));
    let (report, _) = run(&stairs(), &map, &[0, 1, 2, 3], (0.5, 0.5));
    assert_eq!((report.kind, &report.attained[..]), (Kind::Direct, &[0, 1, 2, 3][..]));
    assert_eq!(report.attained, report.meant);
    // From one step higher, the navigator also arrives, but by landmarks other than those that its map refers to.
    let (report, _) = run(&stairs(), &map, &[0, 1, 2, 3], (7.0, 6.0));
    assert_eq!((report.kind, &report.attained[..]), (Kind::Unaware, &[1, 2, 3][..]));
}

#[test]
fn where_a_word_means_nothing_a_map_that_branches_looks_elsewhere() {
    // There is nothing north-east of the top.
    let map = "(*, SW)\n(Isol, (-, NE, 3), SW)\n(Isol, -)";
    let (report, _) = run(&stairs(), map, &[3, 3, 2], (20.0, 20.0));
    assert_eq!((report.kind, &report.attained[..]), (Kind::Direct, &[3, 2][..]));
}

#[test]
fn who_branches_in_circles_is_lost_in_the_end() {
    let map = "(*, SW)\n(Isol, (*, NE, 3), -)\n(Isol, (*, SW, 2), -)";
    let (report, _) = run(&stairs(), map, &[0, 1, 0], (0.0, 0.0));
    assert_eq!(report.kind, Kind::Lost);
    assert!(report.recoveries > 8, "{report:?}");
}

#[test]
fn a_landmark_that_is_not_there_cannot_be_located() {
    // There is nothing north-west of the first dot.
    let (report, _) = run(&stairs(), "(*, SE)\n(Isol, -)", &[0, 1], (0.0, 0.0));
    assert_eq!((report.kind, report.attained.len()), (Kind::CannotLocate, 1));
    // Of two candidates, neither is obvious.
    let two = plane(&[(0.0, 0.0), (7.0, 6.0), (3.0, 8.0)]);
    assert_eq!(run(&two, "(*, SW)\n(Obvious, -)", &[0, 1], (0.0, 0.0)).0.kind, Kind::CannotLocate);
}

#[test]
fn a_count_that_differs_and_has_no_recovery_is_lost() {
    // The second dot has two occupied quadrants.
    let map = |count| format!("(*, SW)\n(Isol, ({count}, -), SW)\n(Isol, -)");
    let intended = [0, 1, 2];
    assert_eq!(run(&stairs(), &map(2), &intended, (0.0, 0.0)).0.kind, Kind::Direct);
    assert_eq!(run(&stairs(), &map(3), &intended, (0.0, 0.0)).0.kind, Kind::Lost);
}

#[test]
fn a_wrong_path_to_the_goal_is_success_unaware_and_elsewhere_it_is_astray() {
    let map = "(*, SW)\n(Isol, SW)\n(Isol, -)";
    assert_eq!(run(&stairs(), map, &[0, 3, 2], (0.0, 0.0)).0.kind, Kind::Unaware);
    assert_eq!(run(&stairs(), map, &[0, 1, 3], (0.0, 0.0)).0.kind, Kind::Astray);
}

#[test]
fn a_trajectory_crosses_the_void() {
    let world = plane(&[(0.0, 0.0), (6.0, 0.5), (60.0, 3.0), (-40.0, -5.0)]);
    let (ahead, activities) = run(&world, "(*, SW)\n(Isol, Trajp, -)", &[0, 2], (0.0, 0.0));
    assert_eq!((ahead.kind, ahead.attained), (Kind::Direct, vec![0, 2]));
    assert!(activities.contains(&Activity::Slide));
    let (behind, _) = run(&world, "(*, SW)\n(Isol, Trajn, SE)", &[0, 3], (0.0, 0.0));
    assert_eq!((behind.kind, behind.attained), (Kind::Direct, vec![0, 3]));
}

#[test]
fn a_slide_into_nothing_ends() {
    let world = plane(&[(0.0, 0.0), (6.0, 0.5)]);
    assert_eq!(run(&world, "(*, SW)\n(Isol, Trajp, -)", &[0, 1], (0.0, 0.0)).0.kind, Kind::CannotLocate);
}

#[test]
fn what_the_last_movement_brought_in_is_new() {
    // From the first dot, only the second is in view. With the second dot in the south-west, the third and the fourth are in
    // view, but the third was there before, at the edge of the first window.
    let world = plane(&[(0.0, 0.0), (4.0, 5.0), (9.0, 8.0), (12.0, 13.0)]);
    let map = "(*, SW)\n(Any, SW)\n(New, -)";
    assert!(map.parse::<CustomMap>().is_err(), "the word for any is a star");
    let (report, _) = run(&world, "(*, SW)\n(*, SW)\n(New, -)", &[0, 1, 3], (0.0, 0.0));
    assert_eq!((report.kind, report.attained), (Kind::Direct, vec![0, 1, 3]));
}

#[test]
fn every_word_is_understood() {
    // North-east of the first dot there are a pair, and a separate dot that is the isolated one.
    let world = plane(&[(0.0, 0.0), (7.0, 2.0), (8.0, 3.0), (2.0, 9.0), (3.0, 12.0), (9.5, 13.0)]);
    let attained = |word: &str| run(&world, &format!("(*, SW)\n({word}, -)"), &[0, 0], (0.0, 0.0)).0.attained;
    assert_eq!(attained("Isol"), [0, 3]);
    assert_eq!(attained("IsolPair"), [0, 2]);
    assert_eq!(attained("*"), [0, 1]);
    assert_eq!(attained("Confusable"), [0, 1]);
    // From the separate dot, two are in view, so none is obvious, and `PlusPair` means the more distant one.
    let from_isolated = |word: &str| {
        run(&world, &format!("(*, SW)\n(Isol, SW)\n({word}, -)"), &[0, 3, 0], (0.0, 0.0)).0.attained
    };
    assert_eq!(from_isolated("PlusPair"), [0, 3, 5]);
    assert_eq!(from_isolated("Obvious"), [0, 3]);
}

#[test]
fn false_dots_and_misses_are_outvoted_by_several_looks() {
    let noise = Noise { misses: 0.1, false_dots: 0.3, sigma: 0.1, ..Noise::NONE };
    let successes = |looks| {
        let map = "(*, SW)\n(Isol, SW)\n(Isol, SW)\n(Isol, -)".parse::<CustomMap>().unwrap();
        let settings = Settings { looks, ..Settings::new(window(), noise.sigma) };
        let navigator = Navigator::new(settings, map).unwrap();
        let world = stairs();
        let journey = Traversal::new(&world, &navigator, &[0, 1, 2, 3], noise).unwrap();
        let run = |seed| {
            journey.run(Point::new(0.5, 0.5), &mut stream(seed, "journey"), |_, _, _| {}).kind.is_success()
        };
        (0..200).filter(|&seed| run(seed)).count()
    };
    let (one, five) = (successes(1), successes(5));
    assert!(five > 170 && one < five, "{one} {five}");
}

#[test]
fn a_seed_gives_the_same_journey() {
    let map = "(*, SW)\n(Isol, SW)\n(Isol, -)";
    let navigator = navigator(map);
    let world = stairs();
    let noise = Noise { translation: 0.05, rotation_rad: 0.01, ..Noise::of_sigma(0.2) };
    let run = |seed| {
        Traversal::new(&world, &navigator, &[0, 1, 2], noise).unwrap().run(
            Point::default(),
            &mut stream(seed, "journey"),
            |_, _, _| {},
        )
    };
    assert_eq!(run(7), run(7));
    assert_ne!(run(7).distance, run(8).distance);
}

#[test]
fn impossible_noise_is_rejected() {
    assert!(Noise { misses: 1.5, ..Noise::NONE }.check().is_err());
    assert!(Noise { sigma: f64::NAN, ..Noise::NONE }.check().is_err());
    assert!(Noise::of_sigma(1.0).check().is_ok());
    let (world, navigator) = (stairs(), navigator("(*, SW)\n(Isol, -)"));
    let journey = |intended: &[DotId], noise| Traversal::new(&world, &navigator, intended, noise).is_ok();
    assert!(journey(&[0, 1], Noise::NONE));
    assert!(!journey(&[0, 1], Noise { misses: -0.1, ..Noise::NONE }));
    assert!(!journey(&[0], Noise::NONE) && !journey(&[0, 9], Noise::NONE));
}

/// The window of a robot among poles with a radius of 0.15 m, which it sees up to 8 m away.
fn on_land() -> Window {
    Window::on_land(Land { radius: 0.15, range: 8.0, stand_off: 0.8, clearance: 0.5 }).unwrap()
}

fn driven(world: &Plane, map: &str, intended: &[DotId], noise: Noise) -> (Report, f64) {
    let settings = Settings { speed: 0.5, ..Settings::new(on_land(), noise.sigma) };
    let navigator = Navigator::new(settings, map.parse::<CustomMap>().unwrap()).unwrap();
    let journey = Traversal::new(world, &navigator, intended, noise).unwrap();
    let mut nearest = f64::INFINITY;
    let from = world.dot(intended[0]) + on_land().centre_from(Corner::Sw);
    let report = journey.run(from, &mut stream(1, "journey"), |robot, _, _| {
        let distances = world.dots().iter().map(|&dot| (dot - robot.centre).norm());
        nearest = distances.fold(nearest, f64::min);
    });
    (report, nearest)
}

#[test]
fn on_land_it_drives_around_a_pole_and_finds_the_one_that_it_hid() {
    // From beside the first pole, only the second is in sight, because it hides the third. To look north-east from the second,
    // the robot has to drive around it.
    let world = plane(&[(0.0, 0.0), (2.0, 0.8), (4.0, 1.3)]);
    let (report, nearest) = driven(&world, "(*, SW)\n(Obvious, SW)\n(Obvious, -)", &[0, 1, 2], Noise::NONE);
    assert_eq!((report.kind, &report.attained[..]), (Kind::Direct, &[0, 1, 2][..]), "{report:?}");
    assert!(nearest > 0.4, "{nearest}");
}

/// No word refers to the middle one of these three poles, which is neither the most isolated nor the closest.
#[test]
fn on_land_each_pole_is_known_by_its_bearing() {
    let world = plane(&[(0.0, 0.0), (1.5, 4.0), (4.0, 4.0), (5.5, 1.5)]);
    let kind = |bearing: &str, pole| {
        let map = format!("(*, SW)\n(*, {bearing}, -)");
        driven(&world, &map, &[0, pole], Noise::NONE).0.kind
    };
    assert_eq!([kind("021", 1), kind("045", 2), kind("075", 3)], [Kind::Direct; 3]);
    assert_eq!(kind("060", 2), Kind::CannotLocate, "nothing is there");
}

#[test]
fn on_land_a_panorama_tells_the_wrong_pole_and_the_way_back() {
    // There are two poles north-east of the first, of which the more distant one is isolated. With a map that means the nearer
    // one, the robot notices by its surroundings that it is at the wrong pole.
    let world = plane(&[(0.0, 0.0), (2.0, 2.5), (4.5, 4.0), (9.0, 4.5)]);
    let around = |dot| Signature::of(&world, dot, on_land());
    assert_ne!(around(1), around(2));
    let map = format!("(*, SW)\n(Isol, ({}, -), ({}, NE, *), -)", around(1), around(2));
    let taken = driven(&world, "(*, SW)\n(Isol, -)", &[0, 2], Noise::NONE).0;
    assert_eq!(taken.kind, Kind::Direct, "{taken:?}");
    let (report, _) = driven(&world, &map, &[0, 1], Noise::NONE);
    assert_eq!((report.kind, report.recoveries), (Kind::Recovered, 1), "{report:?}");
}

/// Returns the number of direct journeys out of forty although the heading error at the start has a standard deviation of 5°. The
/// landmark to seek lies 2° inside the edge of its quadrant. With a larger error, the navigator believes it to be outside the
/// quadrant and goes to another landmark, unless the bearing of the previous landmark has corrected the heading.
fn direct(window: Window, from: Point, map: &str) -> usize {
    let world = plane(&[(0.0, 0.0), (4.0, 3.0), (4.19, 8.5), (8.9, 4.0)]);
    let noise = Noise { heading_rad: 5_f64.to_radians(), ..Noise::NONE };
    let usual = Settings::new(window, 0.0);
    let speed = window.land.map_or(usual.speed, |_| 0.5);
    let settings = Settings { speed, heading_rad: noise.heading_rad, ..usual };
    let navigator = Navigator::new(settings, map.parse().unwrap()).unwrap();
    let journey = Traversal::new(&world, &navigator, &[0, 1, 2], noise).unwrap();
    let kind = |seed| journey.run(from, &mut stream(seed, "journey"), |_, _, _| {}).kind;
    (0..40).filter(|&seed| kind(seed) == Kind::Direct).count()
}

const WITH_BEARINGS: &str = "(*, SW)\n(Isol, 053, SW)\n(Isol, 002, -)";
const WITHOUT: &str = "(*, SW)\n(Isol, SW)\n(Isol, -)";

#[test]
fn on_land_bearings_correct_the_heading() {
    let from = on_land().centre_from(Corner::Sw);
    let [with, without] = [WITH_BEARINGS, WITHOUT].map(|map| direct(on_land(), from, map));
    assert!(with >= 39 && without <= 35, "{with} {without}");
}

/// A robot with a differential drive turns before it drives to the west. This takes time, and its heading error grows with every turn.
/// It then takes some landmarks for being in another quadrant, but still knows them by their bearings.
#[test]
fn on_land_turns_take_time_and_cost_heading() {
    let world = plane(&[(0.0, 0.0), (-4.0, 3.0), (-4.19, 8.5), (-8.9, 4.0)]);
    let noise = Noise { heading_rad: 0.5_f64.to_radians(), ..Noise::NONE };
    let journeys = |(turning, map): (Option<Turning>, &str)| {
        let usual = Settings::new(on_land(), 0.0);
        let settings = Settings { speed: 0.5, heading_rad: noise.heading_rad, turning, ..usual };
        let navigator = Navigator::new(settings, map.parse().unwrap()).unwrap();
        let journey = Traversal::new(&world, &navigator, &[0, 1, 2], noise).unwrap();
        let from = on_land().centre_from(Corner::Se);
        let run = |seed| journey.run(from, &mut stream(seed, "journey"), |_, _, _| {});
        let reports: Vec<_> = (0..40).map(run).collect();
        let direct = reports.iter().filter(|report| report.kind == Kind::Direct).count();
        (direct, reports.iter().map(|report| report.steps).sum::<u32>())
    };
    let words = "(*, SE)\n(Isol, SE)\n(Isol, -)";
    let bearings = "(*, SE)\n(*, 307, SE)\n(*, 358, -)";
    let turning = |drift_deg: f64| Some(Turning { rate_radps: 1.0, drift_rad: drift_deg.to_radians() });
    let cases = [(None, words), (turning(0.0), words), (turning(4.0), words), (turning(4.0), bearings)];
    let [free, turns, drifts, by_bearing] = cases.map(journeys);
    assert!(free.0 == 40 && turns.0 == 40 && turns.1 > free.1 + 120, "{free:?} {turns:?}");
    assert!(drifts.0 <= 36 && by_bearing.0 >= 39, "{drifts:?} {by_bearing:?}");
}

/// Regression test: the corrected heading was applied to the navigator's movements, but not to its view.
#[test]
fn above_a_plane_bearings_correct_the_heading_too() {
    let window = Window::new(7.0, 1.5).unwrap();
    let [with, without] = [WITH_BEARINGS, WITHOUT].map(|map| direct(window, Point::new(0.5, 0.5), map));
    assert!(with >= 38 && without <= 33, "{with} {without}");
}

/// A wall stands between two landmarks, across the straight path. The robot comes along the wall and must not touch anything.
#[test]
fn on_land_a_wall_is_neither_seen_through_nor_driven_through() {
    let body = Body { radius: 0.225, keeps: 0.375, merges: 0.4 };
    let wall = |ends: [(f64, f64); 2]| Arc::new(Walls::new([ends.map(|(x, y)| Point::new(x, y))], 0.1, body));
    let run = |ends: [(f64, f64); 2]| {
        let world = plane(&[(0.0, 0.0), (5.0, 4.0)]).among(wall(ends));
        let settings = Settings { speed: 0.5, longest_entry_s: 60.0, ..Settings::new(on_land(), 0.0) };
        let navigator = Navigator::new(settings, "(*, SW)\n(Isol, NE)\n(Isol, -)".parse().unwrap()).unwrap();
        let journey = Traversal::new(&world, &navigator, &[0, 1, 0], Noise::NONE).unwrap();
        let from = on_land().centre_from(Corner::Sw);
        let mut nearest = f64::INFINITY;
        let report = journey.run(from, &mut stream(1, "journey"), |helicopter, _, _| {
            let at = helicopter.centre;
            let touches = world.walls().touch(at, at);
            nearest = if touches { 0.0 } else { nearest };
        });
        assert!(nearest > 0.0, "touched");
        report.kind
    };
    assert_eq!(run([(20.0, 0.0), (20.0, 9.0)]), Kind::Direct);
    assert_eq!(run([(2.5, -9.0), (2.5, 9.0)]), Kind::CannotLocate);
}

/// A short wall hides the landmark from the corner of the reference, but not from the other side of the reference.
#[test]
fn on_land_it_looks_again_from_elsewhere_before_it_gives_up() {
    let body = Body { radius: 0.225, keeps: 0.375, merges: 0.4 };
    let kind = |from: f64, to: f64| {
        let ends = [Point::new(from, 3.0), Point::new(to, 3.0)];
        let world = plane(&[(0.0, 0.0), (1.0, 6.0)]).among(Arc::new(Walls::new([ends], 0.1, body)));
        driven(&world, "(*, SW)\n(Isol, -)", &[0, 1], Noise::NONE).0.kind
    };
    assert_eq!([kind(9.0, 9.5), kind(0.5, 1.05)], [Kind::Direct; 2]);
    assert_eq!(kind(-4.0, 5.0), Kind::CannotLocate);
}

#[test]
fn on_land_there_are_no_trajectories() {
    let settings = Settings::new(on_land(), 0.02);
    let map = "(*, SW)\n(Isol, Trajp, -)".parse::<CustomMap>().unwrap();
    let error = Navigator::new(settings, map).unwrap_err();
    assert_eq!(error, Error::Vocabulary { entry: 2, word: "Trajp" });
}

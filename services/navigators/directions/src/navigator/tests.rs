//! Tests of a navigator's state, and of invalid input.

use proptest::prelude::*;
use sketchnav_schemas::robot::MarkerCamera;
use sketchnav_schemas::seed::stream;

use super::*;
use crate::geometry::Land;
use crate::navigator::view::Seen;
use crate::orientation::Around;
use crate::plane::DotId;
use crate::testing::{camera, config, plane, plane_of_kinds};
use crate::traversal::{Helicopter, Kind, Noise, STEP_S, Traversal};

const MAP: &str = "(*, SW)\n(Isol, (2, -), SW)\n(Isol, Trajp, (0, -), -)";

fn navigator() -> Navigator {
    let window = Window::new(10.0, 1.5).unwrap();
    Navigator::new(Settings::new(window, 0.1), MAP.parse().unwrap()).unwrap()
}

#[test]
fn a_word_that_the_navigator_lacks_is_named() {
    let window = Window::new(10.0, 1.5).unwrap();
    let vocabulary = Vocabulary::of(&[Descriptor::Any, Descriptor::Isolated]);
    let settings = Settings { vocabulary, ..Settings::new(window, 0.1) };
    let with = |map: &str| Navigator::new(settings, map.parse().unwrap());
    assert!(with(MAP).is_ok());
    let error = with("(*, SW)\n(Isol, (2, SE, IsolPair), (3, -), SW)\n(Isol, -)").unwrap_err();
    assert_eq!(error, Error::Vocabulary { entry: 2, word: "IsolPair" });
}

#[test]
fn settings_out_of_range_are_rejected() {
    let window = Window::new(10.0, 1.5).unwrap();
    let good = Settings::new(window, 0.1);
    for bad in [
        Settings { speed: 0.0, ..good },
        Settings { gate: f64::NAN, ..good },
        Settings { weight: 1.5, ..good },
        Settings { looks: 0, ..good },
    ] {
        assert!(matches!(Navigator::new(bad, MAP.parse().unwrap()), Err(Error::Parameter { .. })), "{bad:?}");
    }
}

/// Regression test: the number of looks, which exceeds the patience by one, was stored in a byte, so a patience of 255 overflowed.
#[test]
fn a_navigator_of_the_greatest_patience_gives_up_after_so_many_looks() {
    for patience in [0, 5, u8::MAX] {
        let settings = Settings { patience, longest_entry_s: 1e6, ..*navigator().settings() };
        let navigator = Navigator::new(settings, MAP.parse().unwrap()).unwrap();
        let mut state = navigator.start();
        let looks = (1..1000).find(|_| navigator.step(&mut state, View::default(), STEP_S).outcome.is_some());
        assert_eq!(looks, Some(u32::from(patience) + 1));
        assert_eq!(state.outcome(), Some(Outcome::CannotLocate));
    }
}

/// Regression test: if someone stood in front of the goal, the robot reported its arrival 4 m away from it.
#[test]
fn on_land_a_goal_that_goes_out_of_sight_is_not_reached() {
    let land = Land { radius: 0.15, range: 8.0, stand_off: 0.8, clearance: 0.5 };
    let settings = Settings { speed: 0.3, ..Settings::new(Window::on_land(land).unwrap(), 0.02) };
    let navigator = Navigator::new(settings, "(*, -)".parse().unwrap()).unwrap();
    let mut state = navigator.start();
    let goal = [Point::new(4.0, 0.0)];
    let goal = View::of(&goal);
    assert!((0..100).any(|_| navigator.step(&mut state, goal, STEP_S).outcome == Some(Outcome::Arrived)));
    let mut ways = Vec::new();
    let outcome = (0..1000).find_map(|_| {
        let output = navigator.hover(&mut state, View::default(), STEP_S);
        ways.push(output.velocity);
        output.outcome
    });
    assert_eq!(outcome, Some(Outcome::CannotLocate));
    // The robot makes way to either side, then backwards.
    let is_back = |way: &Point| way.x < 0.0;
    assert!(ways.iter().any(|way| is_back(way) && way.y < -0.1), "{ways:?}");
    assert!(ways.iter().any(|way| is_back(way) && way.y > 0.1), "{ways:?}");
}

/// The robot stands before two doors, a nearer pole and stairs. The map can name the farther door only by its kind.
#[test]
fn on_land_a_word_means_a_landmark_of_its_kind_whose_marker_is_in_view() {
    let land = Land { radius: 0.15, range: 8.0, stand_off: 0.8, clearance: 0.5 };
    let dots = [(0.0, 0.0, ""), (1.0, 2.5, "door"), (5.0, 1.0, "door"), (3.0, 5.0, "stairs"), (2.5, 1.2, "")];
    let attained = |map: &str, meant: DotId, camera: MarkerCamera| {
        let world = plane_of_kinds(camera, &dots);
        let settings = Settings { speed: 0.5, ..Settings::new(Window::on_land(land).unwrap(), 0.0) };
        let navigator = Navigator::new(settings, map.parse().unwrap()).unwrap();
        let meant = [0, meant];
        let journey = Traversal::new(&world, &navigator, &meant, Noise::NONE).unwrap();
        let report = journey.run(Point::new(0.5, 0.6), &mut stream(1, "journey"), |_, _, _| {});
        (report.kind, report.attained.last().copied())
    };
    assert_eq!(attained("(*, SW)\n(Isol, -)", 3, camera(0.0)), (Kind::Direct, Some(3)));
    assert_eq!(attained("(*, SW)\n(door, Isol, -)", 2, camera(0.0)), (Kind::Direct, Some(2)));
    assert_eq!(attained("(*, SW)\n(door, *, -)", 1, camera(0.0)), (Kind::Direct, Some(1)));
    assert_eq!(attained("(*, SW)\n(stairs, Obvious, -)", 3, camera(0.0)), (Kind::Direct, Some(3)));
    assert_eq!(attained("(*, SW)\n(machine, Obvious, -)", 3, camera(0.0)).0, Kind::CannotLocate);
    let short = MarkerCamera { range_max_m: 4.0, ..camera(0.0) };
    assert_eq!(attained("(*, SW)\n(door, Isol, -)", 2, short), (Kind::Astray, Some(1)), "the other is far");
    // One picture in four misses a marker, but the navigator looks three times.
    let misses = attained("(*, SW)\n(door, Isol, -)", 2, camera(0.2));
    assert_eq!(misses, (Kind::Direct, Some(2)));
}

/// Along a corridor to the east, the doors are on the left. On the way back, they are on the right.
#[test]
fn on_land_landmarks_are_counted_along_the_direction_of_travel() {
    let land = Land { radius: 0.15, range: 8.0, stand_off: 0.8, clearance: 0.5 };
    let dots = [
        (0.0, 0.0, ""),
        (2.2, 1.8, "door"),
        (5.0, 2.0, "door"),
        (8.0, 2.6, "door"),
        (4.0, -2.0, "door"),
        (8.5, 6.0, "door"),
    ];
    let world = plane_of_kinds(camera(0.0), &dots);
    let attained = |map: &str, last: DotId| {
        let settings = Settings { speed: 0.5, ..Settings::new(Window::on_land(land).unwrap(), 0.0) };
        let map: CustomMap = map.parse().unwrap();
        let meant = vec![last; map.entries().len()];
        let navigator = Navigator::new(settings, map).unwrap();
        let journey = Traversal::new(&world, &navigator, &meant, Noise::NONE).unwrap();
        journey.run(Point::new(-0.6, -0.6), &mut stream(1, "journey"), |_, _, _| {}).attained
    };
    assert_eq!(attained("(*, NE)\n(door, Left2, -)", 2), [0, 2]);
    assert_eq!(attained("(*, NE)\n(door, Right1, -)", 4), [0, 4]);
    assert_eq!(attained("(*, NE)\n(door, Left1, NW)\n(door, Left1, -)", 2), [0, 1, 2]);
    let there = "(*, NE)\n(door, Left2, NW)\n(door, Left1, NE)";
    assert_eq!(attained(&format!("{there}\n(door, Behind1, -)"), 2), [0, 2, 3, 2]);
    // From the third door, the robot goes on to the north, and turns back to the south and to the west.
    let north = format!("{there}\n(door, Left1, SE)");
    assert_eq!(attained(&format!("{north}\n(door, Behind1, NE)"), 3), [0, 2, 3, 5, 3]);
    assert_eq!(attained(&format!("{north}\n(door, Behind1, NE)\n(door, Right1, -)"), 2), [0, 2, 3, 5, 3, 2]);
    // Driving around a landmark leaves the direction of travel as it is.
    assert_eq!(attained("(*, NE)\n(door, Left1, NW)\n(Same, NE)\n(door, Left1, -)", 2), [0, 1, 1, 2]);
}

/// Whatever direction the robot faces at the start, it finds its heading and then follows the map. If the landmarks are not those
/// around its start, it does not begin to drive.
#[test]
fn on_land_a_robot_that_faces_anywhere_finds_its_heading_first() {
    let land = Land { radius: 0.15, range: 8.0, stand_off: 0.8, clearance: 0.5 };
    let world = plane(&[(0.0, 0.0), (3.0, 2.0), (-2.0, 4.0), (5.0, -3.0), (-4.0, -2.5), (8.5, 5.0)]);
    let start = Point::new(0.6, 0.6);
    let around = Around::at(&world, land, start).unwrap();
    let map: CustomMap = "(*, SW)\n(*, 056, SW)\n(*, 061, -)".parse().unwrap();
    let settings = Settings {
        speed: 0.5,
        heading_unknown: true,
        heading_rad: 0.035,
        ..Settings::new(Window::on_land(land).unwrap(), 0.03)
    };
    let noise = Noise { sigma: 0.03, heading_unknown: true, ..Noise::NONE };
    let driven = |map: CustomMap, seed: u64| {
        let navigator = Navigator::new(settings, map).unwrap();
        let journey = Traversal::new(&world, &navigator, &[0, 1, 5], noise).unwrap();
        let mut headings = Vec::new();
        let report =
            journey.run(start, &mut stream(seed, "journey"), |robot, _, _| headings.push(robot.heading_rad));
        (report.kind, report.distance, headings[0])
    };
    let all: Vec<_> = (0..40).map(|seed| driven(map.clone().starting_among(around.clone()), seed)).collect();
    assert!(all.iter().all(|(kind, ..)| *kind == Kind::Direct), "{all:?}");
    let quarters =
        all.iter().map(|(.., heading_rad)| (heading_rad / std::f64::consts::FRAC_PI_2).floor() as i32);
    assert_eq!(quarters.collect::<std::collections::BTreeSet<_>>().len(), 4, "all around: {all:?}");
    let elsewhere = Around::new(&[10, 20, 30, 40, 50]).unwrap();
    let (kind, distance, _) = driven(map.starting_among(elsewhere), 1);
    assert_eq!((kind, distance), (Kind::CannotLocate, 0.0));
}

/// Killing the process between any two steps must not change anything, since the restarted process restores the state and takes the
/// same steps.
#[test]
fn a_state_survives_a_checkpoint_at_every_step() {
    let world = plane(&[(0.0, 0.0), (7.0, 6.0), (13.0, 14.0), (46.0, 58.0), (15.0, 8.0)]);
    let navigator = navigator();
    let mut helicopter = Helicopter::new(Point::default(), 0.0);
    let (mut state, mut rng, mut view) = (navigator.start(), stream(3, "journey"), Seen::default());
    let mut largest = 0;
    for step in 0..2000 {
        helicopter.look(&world, navigator.settings().window, Noise::of_sigma(0.1), &mut rng, &mut view);
        let bytes = postcard::to_allocvec(&state).unwrap();
        largest = largest.max(bytes.len());
        let mut restored: State = postcard::from_bytes(&bytes).unwrap();
        let output = navigator.step(&mut state, view.view(), if step == 0 { 0.0 } else { STEP_S });
        assert_eq!(navigator.step(&mut restored, view.view(), if step == 0 { 0.0 } else { STEP_S }), output);
        assert_eq!(restored, state);
        if let Some(outcome) = output.outcome {
            assert_eq!(outcome, Outcome::Arrived, "at step {step}");
            assert!(largest < 1000, "{largest}");
            assert!(size_of::<State>() < 7000, "{}", size_of::<State>());
            return;
        }
        helicopter.fly(output.velocity, STEP_S, Noise::NONE, &mut rng);
    }
    panic!("no end");
}

/// Generates a camera's coordinate: usually a position in the window, occasionally nonsense.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![20 => -7.0..7.0, 1 => Just(f64::NAN), 1 => Just(f64::INFINITY), 1 => -1e300..1e300]
}

proptest! {
    #![proptest_config(config(64))]

    /// Whatever the camera shows, a journey ends, and no velocity exceeds the maximum speed.
    #[test]
    fn any_views_give_good_velocities_and_an_end(
        views in prop::collection::vec(
            prop::collection::vec((coordinate(), coordinate()), 0..80),
            1..12,
        ),
        elapsed_s in prop_oneof![Just(0.1), Just(0.0), 0.0..5.0_f64],
    ) {
        let navigator = navigator();
        let mut state = navigator.start();
        for step in 0..20_000 {
            let view: Vec<_> = views[step % views.len()].iter().map(|&(x, y)| Point::new(x, y)).collect();
            let output = navigator.step(&mut state, View::of(&view), elapsed_s);
            prop_assert!(output.velocity.norm() <= 10.0 * (1.0 + 1e-9), "{:?}", output);
            if output.outcome.is_some() {
                prop_assert_eq!(output.velocity, Point::default());
                return Ok(());
            }
            // If no time passes, a journey never ends.
            if elapsed_s < 0.01 && step > 100 {
                return Ok(());
            }
        }
        prop_assert!(false, "no end");
    }
}

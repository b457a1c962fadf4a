//! Tests of paths on small worlds laid out by hand, and of the order of costs on random worlds.

use std::sync::Arc;

use sketchnav_schemas::seed::stream;

use super::*;
use crate::description::Descriptor;
use crate::error::Barrier;
use crate::generate::uniform;
use crate::geometry::Land;
use crate::navigator::Navigator;
use crate::plan::{Plan, Verify};
use crate::reliability::Reliability;
use crate::testing::plane;
use crate::transitions::Kinds;
use crate::traversal::{Kind, Noise, Traversal};
use crate::walls::{Body, Walls};

fn window() -> Window {
    Window::new(10.0, 1.5).unwrap()
}

fn atlas(world: Plane, sigma: f64) -> Atlas {
    Atlas::new(world, window(), Kinds::PAPER, Reliability::fitted(Noise::of_sigma(sigma)))
}

fn path(
    atlas: &Atlas,
    from: DotId,
    to: DotId,
    measure: Measure,
    objective: Objective,
) -> Result<Path, Error> {
    best(atlas, Start::over(&atlas.plane, from).unwrap(), to, measure, objective)
}

#[test]
fn a_line_of_landmarks_is_followed_and_its_distance_is_their_sum() {
    let world = plane(&[(0.0, 0.0), (6.0, 8.0), (12.0, 16.0)]);
    let atlas = Atlas::new(world, window(), Kinds::ISOLATED, Reliability::fitted(Noise::NONE));
    let found = path(&atlas, 0, 2, Measure::Landmarks, Objective::SHORTEST).unwrap();
    assert_eq!(found.landmarks(), [0, 1, 2]);
    assert!((found.distance - 20.0).abs() < 1e-9 && found.unreliability == 0.0);
    assert_eq!(found.legs[0].place, Some(Corner::Sw));
    assert_eq!(found.legs[1].place, None);
    // The window moves to the corner at the start, and once more for the middle landmark, from where the goal is in view.
    let windows = path(&atlas, 0, 2, Measure::Windows, Objective::SHORTEST).unwrap();
    assert!((windows.distance - (50_f64.sqrt() + 10.0)).abs() < 1e-6, "{}", windows.distance);
}

/// Checks S and T of section 5.3 on the same line of landmarks against values computed by hand.
#[test]
fn a_seek_decides_by_one_view_and_stops_once_and_a_trajectory_by_three_and_stops_twice() {
    let settings = Settings::new(window(), 0.0);
    let line = plane(&[(0.0, 0.0), (6.0, 8.0), (12.0, 16.0)]);
    let atlas = Atlas::new(line, window(), Kinds::ISOLATED, Reliability::fitted(Noise::NONE));
    let seeks = path(&atlas, 0, 2, Measure::Windows, Objective::FEWEST_VIEWS).unwrap();
    assert_eq!((seeks.entries(), seeks.sensing()), (3, 3.0));
    // The speed is 10 per second. Within 2.5, the remaining distance decays by exp(-4t) to 0.2, which takes 0.631 s instead of
    // 0.25 s at full speed.
    let stop_s = (2.5_f64 / 0.2).ln() / 4.0 - 0.25;
    let expected_s = (50_f64.sqrt() + 10.0) / 10.0 + 2.0 * stop_s + 3.0 * 0.1;
    assert!((seeks.time_s(&settings) - expected_s).abs() < 1e-9, "{}", seeks.time_s(&settings));
    // A pair of landmarks whose line leads to a third one.
    let atlas = self::atlas(plane(&[(0.0, 0.0), (6.0, 0.5), (40.0, 3.0)]), 0.0);
    let slide = path(&atlas, 0, 2, Measure::Windows, Objective::quickest(&settings)).unwrap();
    assert_eq!((slide.legs.len(), slide.entries(), slide.sensing()), (1, 2, 4.0));
    let expected_s = slide.distance / 10.0 + 2.0 * stop_s + 4.0 * 0.1;
    assert!((slide.time_s(&settings) - expected_s).abs() < 1e-9, "{}", slide.time_s(&settings));
}

#[test]
fn the_start_is_a_goal_too() {
    let atlas = atlas(plane(&[(0.0, 0.0), (6.0, 8.0)]), 0.0);
    assert_eq!(path(&atlas, 1, 1, Measure::Windows, Objective::Ratio).unwrap().legs, []);
}

#[test]
fn what_does_not_lead_there_is_named() {
    // Two parkways whose trajectories miss each other, because the first points north-east and the second north.
    let atlas = atlas(plane(&[(0.0, 0.0), (5.0, 5.0), (60.0, 0.0), (60.0, 6.0)]), 0.0);
    let error = path(&atlas, 0, 3, Measure::Landmarks, Objective::SHORTEST).unwrap_err();
    let Error::Unreachable { start: 0, goal: 3, reached: 2, reaching: 2, from: 1, to: 3, why } = error else {
        panic!("{error}")
    };
    assert!(matches!(why, Barrier::Far { gap, .. } if (gap - 55.0_f64.hypot(1.0)).abs() < 1e-9), "{why}");
    assert_eq!(Start::over(&atlas.plane, 9), Err(Error::UnknownDot { dot: 9, dots: 4 }));
    assert!(path(&atlas, 0, 9, Measure::Landmarks, Objective::SHORTEST).is_err());
}

#[test]
fn a_start_needs_a_dot_in_view() {
    let world = plane(&[(0.0, 0.0), (4.0, 0.0)]);
    assert_eq!(Start::at(&world, window(), Point::new(3.0, 1.0)).unwrap().landmark, 1);
    let error = Start::at(&world, window(), Point::new(30.0, 1.0)).unwrap_err();
    assert_eq!(error, Error::NothingInView { x: 30.0, y: 1.0 });
}

/// Figure 16: the path with the shortest distance from dot to dot is not the one on which the window travels the shortest
/// distance.
#[test]
fn the_window_may_have_a_shorter_way_than_the_landmarks() {
    let mut differ = 0;
    for seed in 0..20 {
        let atlas = atlas(uniform(100, 100.0, seed).unwrap(), 0.0);
        for goal in [10, 50, 90] {
            let Ok(landmarks) = path(&atlas, 0, goal, Measure::Landmarks, Objective::SHORTEST) else {
                continue;
            };
            let windows = path(&atlas, 0, goal, Measure::Windows, Objective::SHORTEST).unwrap();
            let of = |path: &Path, measure| path.distance_by(&atlas, measure);
            assert!(of(&windows, Measure::Windows) <= of(&landmarks, Measure::Windows) + 1e-6);
            assert!(of(&landmarks, Measure::Landmarks) <= of(&windows, Measure::Landmarks) + 1e-6);
            differ += usize::from(windows.landmarks() != landmarks.landmarks());
        }
    }
    assert!(differ > 5, "{differ}");
}

/// The shortest path is never longer than the others, the most reliable path never less reliable, and the D/R path never has a
/// larger ratio.
#[test]
fn costs_are_in_order() {
    let (mut paths, mut compromises) = (0, 0);
    for seed in 0..30 {
        let atlas = atlas(uniform(120, 100.0, seed).unwrap(), 0.15);
        for (from, goal) in [(0, 60), (3, 100), (7, 21)] {
            for measure in [Measure::Landmarks, Measure::Windows] {
                let Ok(shortest) = path(&atlas, from, goal, measure, Objective::SHORTEST) else { continue };
                let find = |objective| path(&atlas, from, goal, measure, objective).unwrap();
                let (sure, ratio) = (find(Objective::MOST_RELIABLE), find(Objective::Ratio));
                let few = find(Objective::FEWEST_ENTRIES);
                for other in [&sure, &ratio, &few] {
                    assert!(shortest.distance <= other.distance + 1e-6);
                    assert!(few.legs.len() <= other.legs.len());
                }
                for other in [&shortest, &ratio, &few] {
                    assert!(sure.unreliability <= other.unreliability + 1e-6);
                }
                for other in [&shortest, &sure, &few] {
                    assert!(ratio.ratio() <= other.ratio() * (1.0 + 1e-9));
                }
                paths += 1;
                compromises += usize::from(
                    ratio.distance > shortest.distance + 1e-6
                        && ratio.unreliability > sure.unreliability + 1e-6,
                );
            }
        }
    }
    assert!(paths > 60 && compromises > 10, "{paths} {compromises}");
}

/// The lower bound of the remaining cost must not affect the result, so the cost must be that of a search without a bound.
#[test]
fn a_search_with_a_bound_finds_what_plain_dijkstra_finds() {
    for seed in 0..10 {
        let atlas = atlas(uniform(80, 80.0, seed).unwrap(), 0.1);
        let costs = plain(&atlas, 0);
        for goal in 1..80 {
            match path(&atlas, 0, goal, Measure::Landmarks, Objective::SHORTEST) {
                Ok(found) => assert!((found.distance - costs[goal as usize]).abs() < 1e-6, "{seed} {goal}"),
                Err(_) => assert_eq!(costs[goal as usize], f64::INFINITY, "{seed} {goal}"),
            }
        }
    }
}

/// The algorithm of Bellman and Ford, for its simplicity.
fn plain(atlas: &Atlas, from: DotId) -> Vec<f64> {
    let mut costs = vec![f64::INFINITY; atlas.plane.len()];
    costs[from as usize] = 0.0;
    for _ in 0..costs.len() {
        for (from, transition) in atlas.transitions.all() {
            let cost = costs[from as usize] + atlas.landmark_distance(from, transition);
            let to = transition.to as usize;
            costs[to] = costs[to].min(cost);
        }
    }
    costs
}

/// A robot comes from the east to a pole and has to continue south-west. Walls keep it from driving directly to the south of the
/// pole, and from the north, the pole or a wall hides the goal.
#[test]
fn on_land_a_path_leads_around_a_landmark() {
    let land = Land { radius: 0.15, range: 8.0, stand_off: 0.8, clearance: 0.5 };
    let window = Window::on_land(land).unwrap();
    let walls = [[(1.2, -0.2), (1.2, -5.0)], [(-0.7, 0.05), (-9.0, 0.05)]];
    let lines = walls.map(|ends| ends.map(|(x, y)| Point::new(x, y)));
    let walls = Walls::new(lines, 0.1, Body { radius: 0.2, keeps: 0.35, merges: 0.4 });
    let world = plane(&[(0.0, 0.0), (-4.0, -5.0)]).among(Arc::new(walls));
    let planned = |words: &[Descriptor]| {
        let kinds = Kinds { words, trajectories: true };
        let atlas = Atlas::new(world.clone(), window, kinds, Reliability::fitted(Noise::NONE));
        let start = Start::at(&atlas.plane, window, Point::new(3.0, 0.57)).unwrap();
        let path = best(&atlas, start, 1, Measure::Windows, Objective::SHORTEST)?;
        Plan::new(&atlas, path, Verify::Nothing)
    };
    let Error::Unreachable { why, .. } = planned(&[Descriptor::Any]).unwrap_err() else { panic!() };
    assert_eq!(why, Barrier::Around);
    let plan = planned(&[Descriptor::Any, Descriptor::Same]).unwrap();
    assert_eq!(plan.map.to_string(), "(*, SW)\n(Same, NW)\n(*, 219, -)\n");
    let settings = Settings { speed: 0.5, ..Settings::new(window, 0.0) };
    let navigator = Navigator::new(settings, plan.map.clone()).unwrap();
    let landmarks = plan.landmarks();
    let journey = Traversal::new(&world, &navigator, &landmarks, Noise::NONE).unwrap();
    let report = journey.run(plan.path.start.centre, &mut stream(1, "journey"), |_, _, _| {});
    assert_eq!((report.kind, &report.attained[..]), (Kind::Direct, &[0, 0, 1][..]), "{report:?}");
}

use sketchnav_schemas::geometry::{Point, wrap_angle};

use super::states::additional_parts;
use super::track::{Track, headings};
use super::*;
use crate::drawn::Drawn;
use crate::plane::{length, resample};
use crate::route::{Command, Kind, Place};
use crate::sketch::Landmark;

const PIXEL: f64 = 5.0 * INCH_M;

fn square(name: &str, x: f64, y: f64, side: f64) -> Landmark {
    let half = side / 2.0;
    let corners = [[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]];
    Landmark { name: name.into(), outline: corners.map(pixels).to_vec() }
}

/// Converts pixels of the PDA to a point of the drawing.
fn pixels([x, y]: [f64; 2]) -> Point<Drawn> {
    Point::new(x * PIXEL, y * PIXEL)
}

/// Creates a sketch with a route in pixels of the PDA.
fn sketch(landmarks: Vec<Landmark>, way: &[[f64; 2]]) -> Sketch {
    let way: Vec<_> = way.iter().copied().map(pixels).collect();
    Sketch { landmarks, route: resample(&way, 4.0 * PIXEL), metres_per_pixel: PIXEL }
}

/// Returns a route that goes straight on, turns left along an arc of `degrees`, and goes straight on again.
fn bend(straight: f64, radius: f64, degrees: f64) -> Vec<[f64; 2]> {
    let arc = (0..=60).map(|i| {
        let angle = f64::from(i) / 60.0 * degrees.to_radians();
        [straight + radius * angle.sin(), radius * (1.0 - angle.cos())]
    });
    let mut way: Vec<_> = std::iter::once([0.0, 0.0]).chain(arc).collect();
    let [x, y] = way[way.len() - 1];
    let (sin, cos) = degrees.to_radians().sin_cos();
    way.push([x + straight * cos, y + straight * sin]);
    way
}

fn commands(route: &Route) -> Vec<(Kind, Command)> {
    route.states.iter().map(|state| (state.kind, state.command)).collect()
}

#[test]
fn a_circle_has_the_turning_rate_of_its_radius() {
    // 10° per second at 25 inches per second make 2° per pixel.
    let radius = 1.0 / 2_f64.to_radians();
    let sketch = sketch(vec![square("desk", 28.0, 28.0, 10.0)], &bend(0.1, radius, 300.0));
    let track = Track::of(&sketch, &Parameters::default()).unwrap();
    for step in &track.steps[4..30] {
        assert!((step.turning_rate - 2.0).abs() < 0.05, "{}", step.turning_rate);
        assert_eq!(step.command, Command::Left);
    }
}

#[test]
fn a_heading_is_the_mean_over_five_points() {
    let points = (0..5).map(|i| [f64::from(i), 0.0]).chain((1..5).map(|i| [4.0, f64::from(i)]));
    let way: Vec<Point<Drawn>> = points.map(Point::from).collect();
    let found = headings(&way);
    let expected = [0.0, 0.0, 0.0, 1_f64.atan2(3.0), 45_f64.to_radians(), 3_f64.atan2(1.0)];
    assert_eq!(found.len(), way.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!(wrap_angle(found - expected).abs() < 1e-12, "{found}, {expected}");
    }
}

#[test]
fn a_turn_before_a_desk_is_a_state_with_the_desk_in_front() {
    // The desk is 30 pixels ahead of the point where the turn begins.
    let desk = square("desk", 65.0, 0.0, 20.0);
    let sketch = sketch(vec![square("chair", -10.0, 0.0, 6.0), desk], &bend(25.0, 20.0, 90.0));
    let route = extract(&sketch, &Parameters::default()).unwrap();
    use Command::{Forward, Left, Stop};
    let expected = [(Kind::Start, Forward), (Kind::Change, Left), (Kind::Change, Forward), (Kind::End, Stop)];
    assert_eq!(commands(&route), expected);
    assert_eq!(route.objects, ["chair", "desk"]);
    assert_eq!(route.states[0].relations.len(), 1, "of the start the chair alone is in view");
    assert_eq!(route.states[0].relations[0].place, Place::Direction(8));
    assert_eq!(route.states[0].relations[0].proximity_m, None);
    let [desk] = &route.states[1].relations[..] else { panic!("{route:?}") };
    assert_eq!((desk.object, desk.place), (1, Place::Direction(0)));
    // From centre to edge, the distance is about 30 pixels. Minus 2 for half the robot, that is 140 inches, ± 22, and ± 4 for a
    // step.
    let range = desk.proximity_m.unwrap();
    assert!((range.middle() / INCH_M - 140.0).abs() < 25.0, "{range:?}");
    assert!((range.high - range.low - 44.0 * INCH_M).abs() < 0.011);
    let width = desk.width.unwrap();
    assert!((width.high - width.middle() - 30.0).abs() < 1.0 || width.low == 0.0);
    // The distances between the states add up to the length of the route.
    let along = route.along();
    let drawn = length(&sketch.route);
    assert!((along[3].unwrap().0 - drawn).abs() < 0.02 && along[1] < along[2]);
}

#[test]
fn objects_are_numbered_as_they_come_in_view() {
    let landmarks = vec![
        square("last", 20.0, 100.0, 6.0),
        square("first", 10.0, -10.0, 6.0),
        square("never", 150.0, 150.0, 4.0),
    ];
    let route = extract(&sketch(landmarks, &[[0.0, 0.0], [0.0, 110.0]]), &Parameters::default()).unwrap();
    assert_eq!(route.objects, ["first", "last"]);
    assert_eq!(commands(&route), [(Kind::Start, Command::Forward), (Kind::End, Command::Stop)]);
}

#[test]
fn pieces_of_a_route_are_what_its_states_are_of() {
    for degrees in [60.0, 120.0, 250.0] {
        let sketch = sketch(vec![square("table", 25.0, 22.0, 8.0)], &bend(25.0, 22.0, degrees));
        let parameters = Parameters { additional_states: false, ..Parameters::default() };
        let found = track::pieces(&sketch.route, &parameters);
        let states = extract(&sketch, &parameters).unwrap().states;
        let commands: Vec<_> = found.iter().map(|piece| piece.command).chain([Command::Stop]).collect();
        assert_eq!(commands, states.iter().map(|state| state.command).collect::<Vec<_>>());
        assert!((found[1].turned_rad.to_degrees() - degrees).abs() < 25.0, "{degrees}: {found:?}");
    }
}

#[test]
fn long_turns_get_states_in_their_middle() {
    let middle = square("table", 25.0, 22.0, 8.0);
    let kinds = |degrees: f64, additional_states| {
        let sketch = sketch(vec![middle.clone()], &bend(25.0, 22.0, degrees));
        let route = extract(&sketch, &Parameters { additional_states, ..Parameters::default() }).unwrap();
        route
            .states
            .iter()
            .filter(|state| state.kind == Kind::Additional)
            .map(|state| state.command)
            .collect::<Vec<_>>()
    };
    assert_eq!(additional_parts(91_f64.to_radians()), [0.5]);
    assert_eq!(additional_parts(181_f64.to_radians()), [1.0 / 3.0, 2.0 / 3.0]);
    assert_eq!(kinds(90.0, true), []);
    assert_eq!(kinds(120.0, true), [Command::Left]);
    assert_eq!(kinds(250.0, true), [Command::Left; 2]);
    assert_eq!(kinds(250.0, false), []);
}

#[test]
fn trembling_is_no_turn() {
    let way: Vec<_> = (0..60).map(|i| [f64::from(i) * 2.0, 0.7 * f64::from(i % 7) / 6.0]).collect();
    let route =
        extract(&sketch(vec![square("desk", 60.0, 15.0, 10.0)], &way), &Parameters::default()).unwrap();
    assert_eq!(commands(&route), [(Kind::Start, Command::Forward), (Kind::End, Command::Stop)]);
}

#[test]
fn a_turn_without_an_object_in_view_names_its_place() {
    let far = square("desk", -60.0, 0.0, 10.0);
    let error = extract(&sketch(vec![far], &bend(40.0, 20.0, 90.0)), &Parameters::default()).unwrap_err();
    let text = error.to_string();
    assert!(
        text.starts_with(
            "step 11 at (40, 0): expected an object within 6.5 m where the robot is to turn left"
        ),
        "{text}"
    );
}

#[test]
fn parameters_out_of_range_are_rejected() {
    let sketch = sketch(vec![square("desk", 30.0, 10.0, 8.0)], &[[0.0, 0.0], [50.0, 0.0]]);
    for parameters in [
        Parameters { sensor_radius_m: 0.0, ..Parameters::default() },
        Parameters { width_tolerance: f64::NAN, ..Parameters::default() },
    ] {
        assert!(matches!(extract(&sketch, &parameters), Err(Error::Number { .. })));
    }
}

#[test]
fn the_view_turns_with_the_sketch() {
    // The same scene, turned by a right angle, yields the same states (Chronis 2007, 5.1).
    let turned = |at: Point<Drawn>| Point::new(-at.y, at.x);
    let upright = sketch(
        vec![square("desk", 65.0, 0.0, 20.0), square("box", 20.0, 25.0, 8.0)],
        &bend(25.0, 20.0, 90.0),
    );
    let mut sideways = upright.clone();
    for landmark in &mut sideways.landmarks {
        landmark.outline.iter_mut().for_each(|at| *at = turned(*at));
    }
    sideways.route.iter_mut().for_each(|at| *at = turned(*at));
    let [one, other] = [upright, sideways].map(|sketch| extract(&sketch, &Parameters::default()).unwrap());
    assert_eq!(one, other);
}

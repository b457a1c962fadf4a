use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, RngSeed};

use super::strokes::classify;
use super::*;

fn stroke(points: &[[f64; 2]]) -> Stroke {
    let points: Vec<_> = points.iter().copied().map(Pixel::from).collect();
    Stroke { points: plane::resample(&points, 1.7) }
}

fn rectangle(x: f64, y: f64, width: f64, height: f64) -> Stroke {
    stroke(&[[x, y], [x + width, y], [x + width, y + height], [x, y + height], [x, y + 0.5]])
}

/// Returns a drawing of a desk and a route below it, on the PDA's canvas.
fn desk() -> Drawing {
    Drawing {
        canvas: [160.0, 160.0],
        strokes: vec![rectangle(40.0, 60.0, 30.0, 20.0), stroke(&[[10.0, 30.0], [120.0, 30.0]])],
        labels: vec![Label { text: " Desk".into(), at: Pixel::new(50.0, 70.0) }],
    }
}

fn read(drawing: &Drawing) -> Result<Sketch, Error> {
    Sketch::read(drawing, &Reading::default())
}

#[test]
fn a_closed_line_is_an_object_and_an_open_one_the_route() {
    let sketch = read(&desk()).unwrap();
    assert_eq!(sketch.landmarks.len(), 1);
    assert_eq!(sketch.landmarks[0].name, "desk");
    assert!((plane::area(&sketch.landmarks[0].outline) / (30.0 * 20.0 * 0.127 * 0.127) - 1.0).abs() < 0.05);
    // The route is 110 pixels of 5 inches long, in steps of 20 inches.
    assert_eq!(sketch.route.len(), 29);
    assert!((plane::length(&sketch.route) - 110.0 * 0.127).abs() < 1e-9);
}

#[test]
fn strokes_are_read_the_same_however_fast_they_were_drawn() {
    let mut slow = desk();
    for stroke in &mut slow.strokes {
        stroke.points = plane::resample(&stroke.points, 0.3);
    }
    let (one, other) = (read(&desk()).unwrap(), read(&slow).unwrap());
    assert_eq!(one.route.len(), other.route.len());
    for (a, b) in one.route.iter().zip(&other.route) {
        assert!(a.distance(b) < 1e-6);
    }
}

#[test]
fn scribbles_delete_what_they_cross_out() {
    let mut drawing = desk();
    drawing.strokes.insert(0, rectangle(90.0, 60.0, 20.0, 20.0));
    let zigzag: Vec<_> =
        (0..9).map(|i| [88.0 + 3.0 * f64::from(i), if i % 2 == 0 { 57.0 } else { 83.0 }]).collect();
    drawing.strokes.push(stroke(&zigzag));
    let found = classify(&drawing).unwrap();
    assert_eq!((found.outlines.len(), found.deleted, found.stray), (1, 1, 0));
    // If it is away from everything else, the scribble is a stray mark.
    let beside = zigzag.iter().map(|[x, y]| [x + 40.0, y + 40.0]).collect::<Vec<_>>();
    *drawing.strokes.last_mut().unwrap() = stroke(&beside);
    let found = classify(&drawing).unwrap();
    assert_eq!((found.outlines.len(), found.deleted, found.stray), (2, 0, 1));
}

#[test]
fn a_dot_and_a_dash_are_stray() {
    let mut drawing = desk();
    drawing.strokes.push(Stroke { points: [[5.0, 5.0], [5.5, 5.2]].map(Pixel::from).into() });
    drawing.strokes.push(Stroke { points: [[100.0, 100.0], [110.0, 101.0]].map(Pixel::from).into() });
    assert_eq!(classify(&drawing).unwrap().stray, 2);
}

#[test]
fn an_object_may_be_drawn_side_by_side() {
    let mut drawing = desk();
    for side in [
        [[90.0, 60.0], [120.0, 60.0]],
        [[120.5, 61.0], [120.0, 80.0]],
        [[90.0, 81.0], [90.0, 60.5]],
        [[119.0, 80.0], [91.0, 80.0]],
    ] {
        drawing.strokes.push(stroke(&side));
    }
    let found = classify(&drawing).unwrap();
    assert_eq!(found.outlines.len(), 2);
    assert!((plane::area(&found.outlines[1]) / 600.0 - 1.0).abs() < 0.1);
}

#[test]
fn a_route_in_two_strokes_goes_on() {
    let mut drawing = desk();
    drawing.strokes.push(stroke(&[[122.0, 31.0], [122.0, 120.0]]));
    let found = classify(&drawing).unwrap();
    let ends = [found.route[0], *found.route.last().unwrap()];
    assert_eq!(ends, [Pixel::new(10.0, 30.0), Pixel::new(122.0, 120.0)]);
}

#[test]
fn a_pen_that_overshoots_closes_the_outline() {
    let mut drawing = desk();
    let corners = [[40.0, 60.0], [70.0, 60.0], [70.0, 80.0], [40.0, 80.0], [40.0, 54.0]];
    drawing.strokes[0] = stroke(&[&[[36.0, 60.0]], &corners[..]].concat());
    let outline = &classify(&drawing).unwrap().outlines[0];
    assert_eq!(plane::self_crossing(outline), None);
    assert!((plane::area(outline) / 600.0 - 1.0).abs() < 0.05);
}

#[test]
fn a_route_from_a_chair_to_a_desk_begins_and_ends_at_their_outlines() {
    let mut drawing = desk();
    drawing.strokes.push(rectangle(5.0, 20.0, 12.0, 20.0));
    drawing.strokes[1] = stroke(&[[10.0, 30.0], [55.0, 30.0], [55.0, 65.0]]);
    let route = read(&drawing).unwrap().route;
    assert!((route[0].x / 0.127 - 17.0).abs() < 2.0 && (route[route.len() - 1].y / 0.127 - 60.0).abs() < 2.0);
}

#[test]
fn errors_name_the_place() {
    let with = |change: &dyn Fn(&mut Drawing)| {
        let mut drawing = desk();
        change(&mut drawing);
        read(&drawing).unwrap_err().to_string()
    };
    type Change<'a> = &'a dyn Fn(&mut Drawing);
    let cases: [(Change<'_>, &str); 9] = [
        (&|d| d.strokes[1] = stroke(&[[10.0, 70.0], [120.0, 70.0]]), "one that enters desk at (40, 70)"),
        (&|d| d.strokes.truncate(1), "found 1 objects and 0 stray marks"),
        (&|d| d.strokes.remove(0).points.clear(), "expected at least one closed outline"),
        (
            &|d| d.strokes.push(stroke(&[[10.0, 120.0], [90.0, 120.0]])),
            "a second one: stroke 3 at (10, 120) besides stroke 2",
        ),
        (&|d| d.strokes.push(rectangle(60.0, 70.0, 30.0, 30.0)), "desk and object 2 cross at (70, 70)"),
        (&|d| d.strokes.push(rectangle(45.0, 65.0, 10.0, 10.0)), "desk and object 2 cross at (45, 65)"),
        (
            &|d| {
                let loops = [[60.0, 80.0], [60.0, 50.0], [50.0, 50.0], [50.0, 80.0]];
                let corners =
                    [&[[40.0, 60.0], [70.0, 60.0], [70.0, 80.0]], &loops[..], &[[40.0, 80.0], [40.0, 60.5]]];
                d.strokes[0] = stroke(&corners.concat());
            },
            "desk: expected an outline that does not cross itself",
        ),
        (
            &|d| d.strokes[1].points[3].x = f64::NAN,
            "stroke 2, point 4: expected a number within ±1000000, found NaN",
        ),
        (&|d| d.canvas[1] = 0.0, "canvas height: expected 1 to 100000, found 0"),
    ];
    for (change, expected) in cases {
        let found = with(change);
        assert!(found.contains(expected), "{found:?}, {expected:?}");
    }
}

#[test]
fn a_raster_has_the_pixels_of_the_pda() {
    let drawing = Drawing { canvas: [1600.0, 800.0], ..desk() };
    let raster = drawing.raster(160);
    let mut points = raster.strokes.iter().flat_map(|stroke| &stroke.points);
    assert!(points.all(|at| (at.x - 5.0) % 10.0 == 0.0 && (at.y - 5.0) % 10.0 == 0.0));
    let found = read(&desk().raster(160)).unwrap();
    assert!(found.route[0].distance(&read(&desk()).unwrap().route[0]) < 0.127);
}

#[test]
fn equal_labels_get_numbers() {
    let mut drawing = desk();
    drawing.strokes.push(rectangle(90.0, 60.0, 20.0, 20.0));
    drawing.labels.push(Label { text: "desk".into(), at: Pixel::new(112.0, 70.0) });
    let names: Vec<_> = read(&drawing).unwrap().landmarks.into_iter().map(|landmark| landmark.name).collect();
    assert_eq!(names, ["desk 1", "desk 2"]);
}

proptest! {
    #![proptest_config(Config {
        rng_seed: RngSeed::Fixed(7), rng_algorithm: RngAlgorithm::ChaCha, failure_persistence: None, ..Config::default()
    })]

    #[test]
    fn any_strokes_are_read_or_rejected(
        strokes in prop::collection::vec(prop::collection::vec([-10.0..170.0, -10.0..170.0], 0..12), 0..6),
    ) {
        let stroke = |points: Vec<[f64; 2]>| Stroke { points: points.into_iter().map(Pixel::from).collect() };
        let strokes = strokes.into_iter().map(stroke).collect();
        let drawing = Drawing { canvas: [160.0, 160.0], strokes, labels: Vec::new() };
        if let Ok(sketch) = read(&drawing) {
            prop_assert!(sketch.route.len() >= 2 && !sketch.landmarks.is_empty());
            prop_assert!(sketch.landmarks.iter().all(|landmark| landmark.outline.len() >= 3));
            prop_assert!(sketch.route.iter().all(|at| at.x.is_finite() && at.y.is_finite()));
        }
    }
}

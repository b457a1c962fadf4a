use super::*;

fn line(points: &[[f64; 2]]) -> Vec<Point<World>> {
    points.iter().map(|p| Point::new(p[0], p[1])).collect()
}

fn task(name: &str, outcome: TaskMark) -> TaskPicture<World> {
    let trail = line(&[[0.0, 0.0], [1.0, 0.5], [2.0, 2.0]]);
    let (marks, place) = (line(&[[2.0, 2.1]]), line(&[[1.5, 1.5], [2.5, 1.5], [2.5, 2.5]]));
    TaskPicture { name: name.to_owned(), marks, place, trail, particles: Vec::new(), outcome }
}

fn floor_of(tasks: &[TaskPicture<World>]) -> String {
    let walls = vec![[Point::new(-1.0, -1.0), Point::new(5.0, -1.0)]];
    let furniture = vec![line(&[[1.0, 1.0], [2.0, 1.0], [1.0, 2.0]])];
    let (shapes, contacts) = (FloorShapes { walls, furniture, markers: Vec::new() }, [Point::new(0.0, 0.0)]);
    floor(&FloorPicture {
        title: "floor",
        shapes: &shapes,
        people: &[],
        views: &[],
        start: Pose::new(0.0, 0.0, 1.0),
        tasks,
        contacts: &contacts,
    })
}

fn sketch_of(width_px: u32, height_px: u32, cells: &[u8]) -> Result<String, PictureError> {
    sketch(&SketchPicture {
        title: "sketch",
        width_px,
        height_px,
        cells,
        start: Some(Pose::new(1.0, 1.0, 0.0)),
        tasks: &[],
    })
}

#[test]
fn base64_agrees_with_rfc_4648_section_10() {
    let pairs = [
        ("", ""),
        ("f", "Zg=="),
        ("fo", "Zm8="),
        ("foo", "Zm9v"),
        ("fooba", "Zm9vYmE="),
        ("foobar", "Zm9vYmFy"),
    ];
    for (plain, coded) in pairs {
        assert_eq!(svg::base64(plain.as_bytes()), coded);
    }
}

#[test]
fn names_cannot_break_the_picture() {
    let text = floor_of(&[task("<b>&\"\u{1}", TaskMark::Reached)]);
    assert!(text.contains("&lt;b&gt;&amp;&quot;\\u0001<"), "{text}");
}

#[test]
fn the_floor_shows_every_task_with_its_end_and_the_scale() {
    let text = floor_of(&[task("0 → 1", TaskMark::Reached), task("1 → 2", TaskMark::Failed)]);
    for part in ["0 → 1", "1 → 2", ">1 m<", "contact", "furniture", "true path"] {
        assert!(text.contains(part), "{part}");
    }
    assert!(text.starts_with("<svg") && text.ends_with("</svg>\n"));
    assert_eq!(text.matches("<g ").count(), text.matches("</g>").count());
}

#[test]
fn an_empty_floor_is_still_a_picture() {
    let nothing = FloorPicture {
        title: "",
        shapes: &FloorShapes::default(),
        people: &[],
        views: &[],
        start: Pose::new(3.0, 4.0, 0.0),
        tasks: &[],
        contacts: &[],
    };
    let text = floor(&nothing);
    assert!(text.contains("viewBox") && !text.contains("NaN") && !text.contains("inf"));
}

#[test]
fn a_sketch_is_drawn_the_right_way_up() {
    // Walls in the lowest row of the sketch must become a dark bottom row of the picture.
    let picture = SketchPicture {
        title: "",
        width_px: 3,
        height_px: 2,
        cells: &[WALL, WALL, WALL, 0, 0, 0],
        start: Some(Pose::new(0.0, 0.0, 0.0)),
        tasks: &[],
    };
    let decoded =
        image::load_from_memory(&wall_png(picture.width_px, picture.height_px, picture.cells).unwrap())
            .unwrap()
            .into_luma8();
    assert_eq!(decoded.dimensions(), (3, 2));
    assert_eq!(decoded.as_raw(), &[255, 255, 255, 48, 48, 48]);
}

#[test]
fn a_full_canvas_stays_below_half_a_megabyte() {
    let (width, height) = (2540_u32, 1252_u32);
    let wobble = |x: u32, y: u32| (x + y / 7 % 5) % 90 < 5 || (y + x / 9 % 6) % 110 < 5;
    let cells: Vec<u8> =
        (0..height).flat_map(|y| (0..width).map(move |x| if wobble(x, y) { WALL } else { 0 })).collect();
    let text = sketch_of(width, height, &cells).unwrap();
    assert!(text.len() < 500_000, "{} bytes", text.len());
}

#[test]
fn cells_of_another_size_are_refused() {
    let error = sketch_of(3, 3, &[0; 8]).unwrap_err();
    assert_eq!(error.to_string(), "sketch cells: expected 3 × 3 of them, found 8");
    assert!(sketch_of(0, 0, &[]).is_err());
}

#[test]
fn a_disc_becomes_a_polygon_around_its_centre() {
    let place = Place { polygon: None, center: Some([1.0, 2.0]), radius_m: Some(1.5) };
    let outline = place_outline(&place);
    assert_eq!(outline.len(), 48);
    assert!(outline.iter().all(|p| (p.distance(&Point::new(1.0, 2.0)) - 1.5).abs() < 1e-9));
}

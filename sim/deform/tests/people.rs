//! At degree 1, drawings are as deformed as those of people, and at degree 0 not at all. The sketcher can read all of them.

use std::path::{Path, PathBuf};

use proptest::prelude::{ProptestConfig, prop_assert, proptest};
use sketchnav_deform::{Deformation, DeformedDrawing, Floor, MOST_DEGREE, PEOPLE, deform, files};
use sketchnav_schemas::codes::FREE;
use sketchnav_schemas::geometry::Point;
use sketchnav_sketch::reading::{ImageTask, Intent, Options};

const SEEDS: u64 = 60;

fn floor(name: &str) -> Floor {
    let missions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions");
    files::floor(&missions.join(format!("{name}/{name}.floor.toml"))).expect("a floor that ships")
}

/// Returns the means of figures over many seeds.
fn means(floor: &Floor, degree: f64, figures: fn(&DeformedDrawing) -> Option<Deformation>) -> [f64; 4] {
    let mut sum = [0.0; 4];
    for seed in 1..=SEEDS {
        let drawing = deform(floor, degree, seed).expect("a degree");
        let found = four(&figures(&drawing).expect("seven places or more"));
        sum.iter_mut().zip(found).for_each(|(sum, value)| *sum += value / SEEDS as f64);
    }
    sum
}

fn four(d: &Deformation) -> [f64; 4] {
    [d.similarity_residual, d.affine_residual, d.anisotropy, d.log_scale_sd]
}

fn assert_like_people(floor: &Floor, tolerance: f64) {
    let (found, people) = (means(floor, 1.0, |drawing| drawing.as_annotated), four(&PEOPLE));
    for (found, people) in found.into_iter().zip(people) {
        assert!((found / people - 1.0).abs() < tolerance, "{}: {found} instead of {people}", floor.name);
    }
}

/// Uses a floor with the shape of the one that people drew. In a long building with narrow rooms, the scatter of the marks would
/// outweigh the deformation.
#[test]
fn degree_1_has_peoples_statistics() {
    assert_like_people(&floor("laboratory"), 0.2);
}

/// Uses the actual floor that people drew.
#[test]
fn degree_1_has_peoples_statistics_on_their_own_floor() {
    let Some(path) = data("sketches/kth/world.yaml") else { return };
    assert_like_people(&files::floor(&path).expect("a map"), 0.12);
}

#[test]
fn the_deformation_grows_with_the_degree() {
    for name in ["building", "laboratory"] {
        let floor = floor(name);
        let [half, one, more] =
            [0.5, 1.0, 1.5].map(|degree| means(&floor, degree, |drawing| drawing.deformation));
        for i in 0..4 {
            assert!(half[i] < one[i] && one[i] < more[i], "{half:?} {one:?} {more:?}");
            // For the anisotropy, the logarithm is proportional to the degree.
            let (half, one) = if i == 2 { (half[i].ln(), one[i].ln()) } else { (half[i], one[i]) };
            assert!((0.38..0.62).contains(&(half / one)), "{i}: {half} of {one}");
        }
    }
}

#[test]
fn degree_0_traces_the_walls() {
    for name in ["building", "laboratory"] {
        let floor = floor(name);
        let drawing = deform(&floor, 0.0, 7).expect("a degree");
        let found = drawing.deformation.expect("seven places or more");
        assert!(found.similarity_residual < 1e-9 && (found.anisotropy - 1.0).abs() < 1e-9, "{found:?}");
        assert!(drawing.forgotten.is_empty());
    }
}

#[test]
fn the_same_seed_gives_the_same_drawing() {
    let floor = floor("building");
    let [a, b, c] = [3, 3, 4].map(|seed| deform(&floor, 1.0, seed).expect("a degree").strokes_json());
    assert!(a == b && a != c);
}

#[test]
fn an_invalid_degree_is_refused() {
    let floor = floor("laboratory");
    for degree in [-0.1, f64::NAN, 99.0] {
        assert!(deform(&floor, degree, 1).is_err(), "{degree}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    /// Nothing is folded over or mirrored: three neighbouring points keep their orientation.
    #[test]
    fn no_drawing_folds(degree in 0.0..MOST_DEGREE, seed in 0_u64..1 << 32) {
        const NEAR_M: f64 = 0.3;
        let floor = floor("building");
        let drawing = deform(&floor, degree, seed).expect("a degree");
        for (i, region) in floor.regions().iter().enumerate() {
            let [a, b, c] = [(0.0, 0.0), (NEAR_M, 0.0), (0.0, NEAR_M)]
                .map(|(dx, dy)| drawing.to_sketch(&Point::new(region.center.x + dx, region.center.y + dy)));
            prop_assert!(a.is_some() != drawing.forgotten.contains(&i), "region {i}");
            let (Some(a), Some(b), Some(c)) = (a, b, c) else { continue };
            let turn = (b.coords() - a.coords()).perp(&(c.coords() - a.coords()));
            prop_assert!(turn > 0.0, "region {i}: {turn}");
        }
    }
}

/// Checks that every region that was not forgotten can be reached in the drawing as the sketcher reads it.
fn all_is_reachable(floor: &Floor, degree: f64, seed: u64) -> Result<(), String> {
    let drawing = deform(floor, degree, seed).map_err(|error| error.to_string())?;
    let options = Options::default();
    let read = sketchnav_sketch::reading::read(drawing.strokes_json().as_bytes(), "drawn.json", &options);
    let read = read.map_err(|error| error.to_string())?;
    let places = floor.regions().iter().filter_map(|region| drawing.to_sketch(&region.center));
    let goals: Vec<[f64; 2]> = places.map(|place| drawing.to_image(&place)).collect();
    let task = |&goal: &[f64; 2]| ImageTask {
        name: "goal".into(),
        points: vec![goal],
        is_named: false,
        resolved: None,
        time_limit_s: 1.0,
    };
    let tasks = goals.iter().map(task).collect();
    let intent = Intent { start: Some(goals[0]), heading_deg: Some(0.0), tasks, ..Intent::default() };
    intent.place(&read, &options.settings).map(drop).map_err(|error| error.to_string())
}

#[test]
fn the_sketcher_finds_a_path_to_every_room() {
    for name in ["building", "laboratory"] {
        let floor = floor(name);
        for (degree, seed) in [0.0, 0.5, 1.0].into_iter().flat_map(|degree| (1..=8).map(move |s| (degree, s)))
        {
            if let Err(error) = all_is_reachable(&floor, degree, seed) {
                panic!("{name}, degree {degree}, seed {seed}: {error}");
            }
        }
    }
}

#[test]
fn the_svg_shows_the_strokes() {
    let drawing = deform(&floor("building"), 1.0, 5).expect("a degree");
    let options = Options::default();
    let strokes = drawing.strokes_json();
    let [a, b] = [strokes.as_bytes(), drawing.svg().as_bytes()]
        .map(|bytes| sketchnav_sketch::reading::read(bytes, "drawn", &options).expect("a drawing"));
    assert_eq!((a.width_px, a.height_px), (b.width_px, b.height_px));
    let differ = a.cells.iter().zip(&b.cells).filter(|(a, b)| (**a == FREE) != (**b == FREE)).count();
    assert!(differ * 50 < a.cells.len(), "{differ} cells of {}", a.cells.len());
    assert!(drawing.png().expect("a picture").starts_with(b"\x89PNG"));
}

/// Returns the path of a file that is not part of the repository, if it is available.
fn data(name: &str) -> Option<PathBuf> {
    let path = needs::data().join(name);
    if !path.is_file() {
        needs::skipped("data", format_args!("{} is not there", path.display()));
    }
    path.is_file().then_some(path)
}

#[test]
fn maps_of_real_buildings_are_drawn() {
    for (map, least_regions) in [("maps/Freiburg79_scan.yaml", 12), ("sketches/kth/world.yaml", 2)] {
        let Some(path) = data(map) else { continue };
        let floor = files::floor(&path).expect("a map");
        assert!(floor.regions().len() >= least_regions, "{map}: {}", floor.regions().len());
        let failed: Vec<_> = (1..=8).filter_map(|seed| all_is_reachable(&floor, 1.0, seed).err()).collect();
        assert!(failed.len() <= 1, "{map}: {failed:?}");
    }
}

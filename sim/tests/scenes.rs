//! The scenes, fields and office floors that ship are those that [`sketchnav_sim::scenes`], [`sketchnav_sim::poles`] and
//! [`sketchnav_sim::offices`] generate.

use std::path::Path;

use sketchnav_sim::offices::Shape;
use sketchnav_sim::scenes::Scene;

const MADE_BY: &str =
    "# Made by sketchnav_sim::scenes; `SKETCHNAV_UPDATE_GOLDEN=1 cargo test -p sketchnav-sim` updates it.\n";

#[test]
fn golden_scenes_are_up_to_date() {
    let scenes = [Scene::a(), Scene::b()].map(|scene| (scene.file_name(), scene.plan()));
    for (file, plan) in scenes.into_iter().chain([("open.floor.toml".to_owned(), Scene::open())]) {
        is_as_made(&format!("landmarks/{file}"), &format!("{MADE_BY}{}", toml::to_string(&plan).unwrap()));
    }
}

#[test]
fn golden_fields_are_up_to_date() {
    let made = toml::to_string(&sketchnav_sim::poles::plan(1)).unwrap();
    is_as_made("directions/poles.floor.toml", &format!("{}{made}", MADE_BY.replace("scenes", "poles")));
}

#[test]
fn golden_floors_are_up_to_date() {
    for shape in Shape::ALL {
        let made = toml::to_string(&shape.plan(1)).unwrap();
        let made_by = MADE_BY.replace("scenes", "offices");
        is_as_made(&format!("offices/{}.floor.toml", shape.name()), &format!("{made_by}{made}"));
    }
}

fn is_as_made(file: &str, made: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions").join(file);
    if std::env::var_os("SKETCHNAV_UPDATE_GOLDEN").is_some() {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, made).unwrap();
    }
    let shipped = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(shipped == made, "{}: not as it is made", path.display());
}

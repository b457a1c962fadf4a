//! The scenes that ship are those that [`sketchnav_sim::scenes`] makes.

use std::path::Path;

use sketchnav_sim::scenes::Scene;

const MADE_BY: &str = "# Made by sketchnav_sim::scenes; `SKETCHNAV_UPDATE_GOLDEN=1 cargo test -p sketchnav-sim` makes it anew.\n";

#[test]
fn golden_scenes_are_as_they_are_made() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions/landmarks");
    let scenes = [Scene::a(), Scene::b()].map(|scene| (scene.file_name(), scene.plan()));
    for (file, plan) in scenes.into_iter().chain([("open.floor.toml".to_owned(), Scene::open())]) {
        let path = folder.join(file);
        let made = format!("{MADE_BY}{}", toml::to_string(&plan).unwrap());
        if std::env::var_os("SKETCHNAV_UPDATE_GOLDEN").is_some() {
            std::fs::create_dir_all(&folder).unwrap();
            std::fs::write(&path, &made).unwrap();
        }
        let shipped = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(shipped == made, "{}: not as it is made", path.display());
    }
}

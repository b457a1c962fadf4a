//! The corridors that ship are those that [`sketchnav_sim::corridors`] makes.

use std::path::Path;

use sketchnav_sim::corridors::Corridor;

const MADE_BY: &str = "# Made by sketchnav_sim::corridors; `SKETCHNAV_UPDATE_GOLDEN=1 cargo test -p sketchnav-sim` makes it anew.\n";

#[test]
fn golden_corridors_are_as_they_are_made() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions/corridor");
    for corridor in Corridor::shipped() {
        let path = folder.join(corridor.file_name());
        let made = format!("{MADE_BY}{}", toml::to_string(&corridor.plan()).unwrap());
        if std::env::var_os("SKETCHNAV_UPDATE_GOLDEN").is_some() {
            std::fs::create_dir_all(&folder).unwrap();
            std::fs::write(&path, &made).unwrap();
        }
        let shipped = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(shipped == made, "{}: not as it is made", path.display());
    }
}

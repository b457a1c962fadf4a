//! Variants of the demo's mission for tests.

use std::fs;
use std::path::Path;

use super::repository;

/// The file name of a mission for runs in real time, whose outcome depends on how busy the machine is: every task has plenty of
/// time, and only those are kept that are reached even if many scans are missed.
pub const PATIENT: &str = "patient.toml";

/// Writes [`PATIENT`] into a folder.
pub fn write_patient(folder: &Path) {
    write(&folder.join(PATIENT), |mission| {
        let tasks = mission["task"].as_array_mut().unwrap();
        tasks.truncate(5);
        for task in tasks {
            task.as_table_mut().unwrap().insert("time_limit_s".into(), 400.0.into());
        }
    });
}

/// Writes the demo's mission, changed by `edit`, to a file.
pub fn write(file: &Path, edit: impl FnOnce(&mut toml::Table)) {
    write_of("building-a.toml", file, edit);
}

/// Like [`write()`], for any mission in the same building.
pub fn write_of(name: &str, file: &Path, edit: impl FnOnce(&mut toml::Table)) {
    let folder = repository().join("sim/missions/building");
    let text = fs::read_to_string(folder.join(name)).unwrap();
    let mut mission: toml::Table = toml::from_str(&text).unwrap();
    for (table, key) in [("world", "floor_plan"), ("navigator", "drawing")] {
        let path = folder.join(mission[table][key].as_str().unwrap());
        mission[table][key] = path.to_str().unwrap().into();
    }
    edit(&mut mission);
    fs::write(file, toml::to_string(&mission).unwrap()).unwrap();
}

//! Prints a fingerprint of everything that the sensors report, for each mission and each robot in the repository. It must not
//! change if a change to the code is meant to be bit-identical.
//! `cargo run --example fingerprint -p sketchnav-sim`.

#[path = "../tests/support/mod.rs"]
mod support;

use std::path::Path;

use sketchnav_schemas::geometry::Pose;
use sketchnav_sim::{Floor, Simulation, files, mission_file};
use support::{Readings, command};

const STEPS: usize = 300;

fn fingerprint(path: &Path, robot: &str) -> Result<u64, Box<dyn std::error::Error>> {
    let (mission, _) = mission_file::load(path)?;
    let (start, robot) = (&mission.start, files::robot(robot)?);
    let pose = Pose::new(start.world[0], start.world[1], start.world_heading_deg.to_radians());
    let mut floor = Floor::new(files::world(&mission.world)?, &robot, pose, 1)?;
    let mut readings = Readings::with_bytes();
    readings.take(&floor);
    for step in 0..STEPS {
        let phase = step as f64;
        let turn = 1.2 * (phase / 37.0).cos();
        floor.step(Some(&command(&floor, 0.5, 0.3 * (phase / 20.0).sin(), turn)));
        readings.take(&floor);
    }
    let bytes = readings.bytes.unwrap_or_default();
    let hash = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3);
    Ok(bytes.iter().fold(0xcbf2_9ce4_8422_2325, hash))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for folder in std::env::args().skip(1) {
        let entries = std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path()));
        let mut files = entries.collect::<Result<Vec<_>, std::io::Error>>()?;
        files.retain(|path| path.extension().is_some_and(|kind| kind == "toml"));
        files.sort();
        for path in files {
            for robot in ["robotino", "turtlebot3"] {
                match fingerprint(&path, robot) {
                    Ok(hash) => println!("{hash:016x} {robot} {}", path.display()),
                    Err(error) => println!("skipped: {robot} {}: {error}", path.display()),
                }
            }
        }
    }
    Ok(())
}

use std::path::{Path, PathBuf};

use super::*;

fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Returns the TOML files in a folder and its subfolders.
fn missions(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let of = |path: PathBuf| if path.is_dir() { missions(&path) } else { vec![path] };
    entries.flat_map(of).filter(|path| path.extension().is_some_and(|it| it == "toml")).collect()
}

/// Neither the drawings that ship with the program nor those by people and robots that the tests use raise any doubts.
#[test]
fn shipped_drawings_cause_no_doubts() {
    let (mut count, data) = (0, needs::data());
    let all = ["sim/missions", "tests/kth", "tests/freiburg"].map(|at| missions(&repository().join(at)));
    for path in all.into_iter().flatten() {
        let text = std::fs::read_to_string(&path).unwrap();
        if !text.contains("kind = \"sketch\"") {
            continue;
        }
        if text.contains(DATA) && !data.exists() {
            needs::skipped("data", format_args!("{} is not there", data.display()));
            continue;
        }
        let folder = tempfile::tempdir().unwrap();
        let copy = with_data(&path, &text.replace(DATA, data.to_str().unwrap()), folder.path());
        let (mission, robot) = sketchnav_sim::mission_file::load(&copy).unwrap();
        let run = RunConfig::lockstep("a", mission, robot, 1);
        let doubts =
            of(&run, &sketchnav_files::Disk).unwrap_or_else(|error| panic!("{}: {error:?}", path.display()));
        let is_unmarked = path.to_string_lossy().ends_with("-unmarked.toml");
        let notice = is_unmarked.then(|| "no start is marked: the robot finds out where it is".to_owned());
        let resolved = notice.into_iter().collect();
        assert_eq!(doubts, Doubts { resolved, ..Doubts::default() }, "{}", path.display());
        count += 1;
    }
    assert!(count >= 7, "{count} missions");
}

/// The path that missions of the tests use for files that are not part of the project.
const DATA: &str = "../../../shared/data";

/// Copies a mission and the files beside it to another folder.
fn with_data(path: &Path, text: &str, folder: &Path) -> PathBuf {
    for entry in std::fs::read_dir(path.parent().unwrap()).unwrap().map(Result::unwrap) {
        if entry.path().is_file() {
            std::fs::copy(entry.path(), folder.join(entry.file_name())).unwrap();
        }
    }
    let copy = folder.join(path.file_name().unwrap());
    std::fs::write(&copy, text).unwrap();
    copy
}

/// Returns the doubts about a drawing with the given content, in a mission in a room of a map.
fn by_drawing(inside: &str, folder: &Path) -> Result<Doubts, Failure> {
    let drawing = format!("<svg xmlns='http://www.w3.org/2000/svg' width='900' height='600'>{inside}</svg>");
    std::fs::write(folder.join("d.svg"), drawing).unwrap();
    let plan = include_str!("../../../../sim/missions/building/building.floor.toml");
    std::fs::write(folder.join("building.floor.toml"), plan).unwrap();
    let mission = "name = 'a'\nrobot = 'turtlebot3'\n[world]\nfloor_plan = 'building.floor.toml'\n\
        [start]\nworld = [2.0, 6.95]\nworld_heading_deg = 0\n[navigator]\nkind = 'sketch'\ndrawing = 'd.svg'\n\
        start = [200, 300]\nstart_heading_deg = 0\n[[task]]\nname = 'g'\ngoal = [400, 300]\n\
        [[task]]\nname = 'r'\nroute = [[400, 300], [700, 300]]\n";
    let path = folder.join("mission.toml");
    std::fs::write(&path, mission).unwrap();
    let (mission, robot) = sketchnav_sim::mission_file::load(&path).unwrap();
    of(&RunConfig::lockstep("a", mission, robot, 1), &sketchnav_files::Disk)
}

#[test]
fn a_drawing_is_doubted_before_the_start() {
    let folder = tempfile::tempdir().unwrap();
    let walls = "<path d='M50 50H850V550H50zM550 50V400' fill='none' stroke='black' stroke-width='6'/>";
    let Doubts { warnings, left_out, .. } = by_drawing(
        &format!("{walls}<text><textPath>a</textPath></text><image href='plan.png'/>"),
        folder.path(),
    )
    .unwrap();
    let [picture, wall] = &warnings[..] else { panic!("{warnings:?}") };
    assert!(picture.starts_with("d.svg: left out: the picture in <image>"), "{picture}");
    assert!(wall.contains("r: the route crosses a wall at (54"), "{wall}");
    assert!(
        left_out[0] == "d.svg: one text, which is neither a wall nor the name of a place",
        "{left_out:?}"
    );
    let corner = "<path d='M850 20h30v20' fill='none' stroke='black' stroke-width='2'/>";
    let Err(Failure::Input(error)) = by_drawing(corner, folder.path()) else { panic!("an open field") };
    let error = error.to_string();
    assert!(error.starts_with("sketcher: navigator.start at (200, 300)"), "{error}");
}

/// A picture of four by two pixels with a transparent last column.
const MAP: &[u8] = b"\x89\x50\x4e\x47\x0d\x0a\x1a\x0a\x00\x00\x00\x0d\x49\x48\x44\x52\x00\x00\x00\x04\x00\x00\x00\x02\x08\x04\
    \x00\x00\x00\xd5\xa1\xb5\xe8\x00\x00\x00\x14\x49\x44\x41\x54\x78\xda\x63\xfc\xff\x9f\x81\x81\x81\x81\x81\
    \x91\x89\x01\x0a\x00\x21\x1f\x02\x03\x48\xe8\x1f\x5d\x00\x00\x00\x00\x49\x45\x4e\x44\xae\x42\x60\x82";

/// Regression test: half of a map was transparent, and so unknown, and the user was not warned.
#[test]
fn a_partly_transparent_map_is_doubted() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let yaml = "image: m.png\nresolution: 1\norigin: [0, 0, 0]\noccupied_thresh: 0.6\nfree_thresh: 0.2\n";
    std::fs::write(place("m.png"), MAP).unwrap();
    std::fs::write(place("d.svg"), "<svg/>").unwrap();
    std::fs::write(place("m.yaml"), yaml).unwrap();
    let mission = "name = 'a'\nrobot = 'turtlebot3'\n[world]\nmap = 'm.yaml'\n[start]\nworld = [1, 1]\n\
        world_heading_deg = 0\n[navigator]\nkind = 'sketch'\ndrawing = 'd.svg'\nstart = [2, 3]\nstart_heading_deg = 0\n\
        [[task]]\nname = 'g'\ngoal = [4, 3]\n";
    std::fs::write(place("mission.toml"), mission).unwrap();
    let (mission, robot) = sketchnav_sim::mission_file::load(&place("mission.toml")).unwrap();
    let mut run = RunConfig::lockstep("a", mission, robot, 1);
    let words = of_map(&run, &sketchnav_files::Disk).unwrap();
    assert!(words.contains("m.yaml: 25.0 % of the map's picture is transparent"), "{words}");
    run.without = vec![Process::World];
    assert_eq!(of_map(&run, &sketchnav_files::Disk), None);
}

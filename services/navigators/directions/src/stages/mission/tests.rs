//! Tests of the mission keys for directions.

use super::*;
use crate::geometry::Window;

const MISSION: &str = "name='m'\nrobot='helicopter'\nworld={plane='p.toml'}\nstart={world=[0,0],world_heading_deg=0}\n\
    [navigator]\nkind='directions'\nplane_file='p.png'\ncalibration=[[0,0,0,0]]\n[[task]]\nname='on'\ngoal=[0.5, 0.9]\n";

fn read(text: &str) -> Result<DirectionsMission, MissionError> {
    DirectionsMission::of(&Mission::parse(text).unwrap())
}

#[test]
fn branching_and_belief_are_for_planes_and_for_a_heading_that_is_right() {
    for (method, read_as) in [("branching", Method::Branching), ("belief", Method::Belief)] {
        let ours = MISSION.replace("kind='directions'", &format!("kind='directions'\nmethod='{method}'"));
        assert_eq!(read(&ours).unwrap().method, read_as);
        for key in ["heading_noise_deg=2.0", "landmark_radius_m=0.15"] {
            let wrong = ours
                .replace("plane_file='p.png'", "floor_file='f.toml'")
                .replace("calibration=[[0,0,0,0]]", key);
            let wrong = if key.starts_with('h') {
                wrong.replace("floor_file='f.toml'", "map_file='m'")
            } else {
                wrong
            };
            let error = read(&wrong).unwrap_err().to_string();
            assert!(
                error.contains("navigator.method") && error.contains(&format!("found {method}")),
                "{error}"
            );
        }
    }
}

#[test]
fn a_mission_says_what_is_seen_and_where_to_go() {
    let mission = read(MISSION).unwrap();
    assert_eq!((mission.method, &mission.goals[..]), (Method::Arrival, &[Point::new(0.5, 0.9)][..]));
    let usual = Settings::new(Window::new(0.1, 0.015).unwrap(), 0.001);
    for method in METHODS {
        let text = MISSION.replace("kind='directions'", &format!("kind='directions'\nmethod='{method}'"));
        let objective = read(&text).unwrap().method.objective(&usual);
        assert_eq!(objective.is_none(), METHODS[..3].contains(&method));
    }
}

#[test]
fn errors_name_the_key() {
    let navigator = |keys: &str| MISSION.replace("kind='directions'", &format!("kind='directions'\n{keys}"));
    let written = MISSION.replace("plane_file='p.png'\ncalibration=[[0,0,0,0]]", "map_file='a.directions'");
    for (text, words) in [
        (
            MISSION.replace("calibration=[[0,0,0,0]]", ""),
            "navigator.calibration: expected at least four known points",
        ),
        (
            MISSION.replace("plane_file='p.png'", ""),
            "navigator: expected one of plane_file, floor_file and map_file, found none",
        ),
        (
            navigator("map_file='a'"),
            "navigator: expected one of plane_file, floor_file and map_file, found both",
        ),
        (navigator("map_noise_m=-1.0"), "navigator.map_noise_m: expected 0 to 10 m, found -1"),
        (navigator("least_probability=50"), "navigator.least_probability: expected 0 to 1, found 50"),
        (navigator("words=['Isol','Lonely']"), "navigator.words: expected some of Obvious, Isol"),
        (
            navigator("verify='nothing'"),
            "navigator.verify: expected no such key for arrival, branching and belief",
        ),
        (
            written
                .replace("kind='directions'", "kind='directions'\nmethod='belief'")
                .replace("goal=[0.5, 0.9]", ""),
            "navigator.method: expected another method with map_file",
        ),
        (
            navigator("method='fast'"),
            "navigator.method: expected arrival, branching, belief, shortest, simplest, fewest-views, quickest, reliable or d-r, found fast",
        ),
        (
            ON_LAND.replace("kind='directions'", "kind='directions'\nmethod='fast'"),
            "navigator.method: expected arrival, shortest, simplest, fewest-views, quickest, reliable or d-r on land or with heading_noise_deg, found fast",
        ),
        (MISSION.replace("goal=[0.5, 0.9]", ""), "task 1 (on).goal: expected a place in metres, found none"),
        (MISSION.replace("goal=", "goals="), "task 1 (on): unknown field `goals`"),
        (written.clone(), "task 1 (on).goal: expected no such key with navigator.map_file"),
        (
            format!("{}[[task]]\nname='two'\n", written.replace("goal=[0.5, 0.9]", "")),
            "task: expected one task with navigator.map_file, found 2",
        ),
    ] {
        let error = read(&text).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn the_heading_at_the_start_may_be_unknown_on_land() {
    let with = |text: &str, keys: &str| {
        read(&text.replace("kind='directions'", &format!("kind='directions'\n{keys}")))
    };
    let mission = with(ON_LAND, "heading='unknown'").unwrap();
    assert!(mission.heading_unknown && (mission.heading_noise_deg - 2.0).abs() < 1e-9, "{mission:?}");
    for (text, keys, words) in [
        (MISSION, "heading='unknown'", "navigator.heading: expected no such key above a plane"),
        (
            ON_LAND,
            "heading='unknown'\nheading_noise_deg=2.0",
            "navigator.heading: expected no such key with heading_noise_deg",
        ),
        (ON_LAND, "heading='north'", "navigator.heading: unknown variant `north`, expected `unknown`"),
    ] {
        let error = with(text, keys).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn a_mission_says_whether_the_map_maker_counts_landmarks() {
    let navigator =
        |keys: &str| read(&MISSION.replace("kind='directions'", &format!("kind='directions'\n{keys}")));
    let counts = |keys: &str| {
        let planned = navigator(keys).unwrap().planned();
        planned.into_iter().filter(|word| matches!(word, Descriptor::Counted(..))).collect::<Vec<_>>()
    };
    assert_eq!(counts(""), [], "not by default, though the navigator understands it");
    assert_eq!(counts("ordinals=true").len(), 4);
    let left = Descriptor::Counted(Side::Left, Ordinal::FIRST);
    assert_eq!(counts("ordinals=true\nwords=['*', 'Isol', 'left']"), [left]);
    for (keys, words) in [
        (
            "ordinals=true\nmethod='d-r'",
            "navigator.ordinals: expected no such key for methods other than `arrival`",
        ),
        ("ordinals=2", "navigator.ordinals: invalid type"),
        (
            "words=['Left2']",
            "navigator.words: expected some of Obvious, Isol, IsolPair, PlusPair, New, Confusable, *, Same, Left, Right",
        ),
    ] {
        let error = navigator(keys).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    let written = MISSION
        .replace("plane_file='p.png'\ncalibration=[[0,0,0,0]]", "map_file='a.directions'\nordinals=true")
        .replace("goal=[0.5, 0.9]", "");
    let error = read(&written).unwrap_err().to_string();
    assert!(error.contains("navigator.ordinals: expected no such key with map_file"), "{error}");
}

const ON_LAND: &str = "name='m'\nrobot='panorama'\nworld={floor_plan='f.toml'}\nstart={world=[0,0],world_heading_deg=0}\n\
    [navigator]\nkind='directions'\nfloor_file='f.toml'\nlandmark_radius_m=0.15\n\
    [navigator.markers]\nstairs=[4]\ndoor=[1, 2]\n[[task]]\nname='on'\ngoal=[0.5, 0.9]\n";

#[test]
fn a_mission_says_which_markers_show_which_kinds() {
    let mission = read(ON_LAND).unwrap();
    let kinds: Vec<_> = mission.markers.keys().map(LandmarkKind::name).collect();
    assert_eq!(kinds, ["door", "stairs"]);
    assert_eq!(
        [2, 3, 4].map(|id| mission.kind(id)),
        [LandmarkKind::of("door"), None, LandmarkKind::of("stairs")]
    );
    for (given, wrong, words) in [
        ("stairs=[4]", "Stairs=[4]", "navigator.markers.Stairs: expected a kind: at most 16 letters"),
        ("stairs=[4]", "isol=[4]", "navigator.markers.isol: expected a kind: "),
        (
            "stairs=[4]",
            "stairs=[4, 2]",
            "navigator.markers.stairs: expected numbers that no other kind has, each once, found marker 2 also for door",
        ),
        (
            "floor_file='f.toml'\nlandmark_radius_m=0.15",
            "map_file='m'",
            "navigator.markers: expected no such key without navigator.landmark_radius_m",
        ),
    ] {
        let error = read(&ON_LAND.replace(given, wrong)).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    let robot = |name: &str| {
        let folder =
            std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../sim/missions/directions");
        sketchnav_sim::files::robot(&folder.join(name).to_string_lossy()).unwrap()
    };
    let mission = Mission::parse(ON_LAND).unwrap();
    assert!(check(&mission, &robot("panorama-camera.toml")).is_ok());
    let error = check(&mission, &robot("panorama.toml")).unwrap_err().to_string();
    assert!(error.contains("[camera]"), "{error}");
}

#[test]
fn what_a_robot_lacks_or_a_parameter_cannot_be_is_said() {
    let robot = |name: &str| sketchnav_sim::robots::find(name).unwrap().unwrap();
    let checked = |text: &str, name: &str| {
        check(&Mission::parse(text).unwrap(), &robot(name)).map_err(|error| error.to_string())
    };
    assert_eq!(checked(MISSION, "helicopter"), Ok(()));
    assert!(checked(MISSION, "robotino").unwrap_err().contains("[view]"));
    for (text, words) in [
        (
            format!("{MISSION}[parameters.planner]\nlooks = 0\n"),
            "parameters.planner: looks: expected at least 1",
        ),
        (format!("{MISSION}[parameters.planner]\nlook = 1\n"), "parameters.planner: unknown field `look`"),
        (
            format!("{MISSION}[parameters.sketcher]\ntrials = 0\n"),
            "parameters.sketcher.trials: expected 1 to",
        ),
        (
            MISSION.replace("world_heading_deg=0", "world_heading_deg=90"),
            "start.world_heading_deg: expected 0, or navigator.heading_noise_deg",
        ),
        (
            MISSION.replace("kind='directions'", "kind='directions'\nwords=['*', 'New']"),
            "navigator.words: expected * and one of Obvious, Isol, IsolPair, PlusPair",
        ),
        (
            MISSION.replace("kind='directions'", "kind='directions'\nwords=['Isol']"),
            "navigator.words: expected * and one of",
        ),
    ] {
        let error = checked(&text, "helicopter").unwrap_err();
        assert!(error.contains(words), "{error}");
    }
}

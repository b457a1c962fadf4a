//! Tests of mission files.

use super::*;

const MISSION: &str = r#"
    name = "m"
    robot = "robotino"
    world = { map = "floor.yaml" }
    start = { world = [1.0, 1.0], world_heading_deg = 90 }
    navigator = { kind = "example", drawing = "s.png", start = [1, 1], start_heading_deg = 90 }
    [[task]]
    name = "kitchen"
    goal = [3, 4]
    there = { center = [1.0, 2.0], radius_m = 1.0 }
"#;

fn refusal(from: &str, to: &str) -> String {
    assert!(MISSION.contains(from));
    Mission::parse(&MISSION.replace(from, to)).unwrap_err().to_string()
}

#[test]
fn a_valid_mission_is_read() {
    assert_eq!(Mission::parse(MISSION).unwrap().task[0].time_limit_s, 180.0);
}

#[test]
fn a_mission_round_trips() {
    let mission = Mission::parse(&format!("{MISSION}\n[parameters.planner]\nmargin_m = 0.1")).unwrap();
    assert_eq!(Mission::parse(&toml::to_string(&mission).unwrap()).unwrap(), mission);
    let json = serde_json::to_string(&mission).unwrap();
    assert_eq!(serde_json::from_str::<Mission>(&json).unwrap(), mission);
}

/// Regression test: a mission without tasks was once reported as "line 1, column 1: missing field `task`".
#[test]
fn a_mission_without_tasks_is_refused() {
    let (tasks, _) = MISSION.split_once("[[task]]").unwrap();
    let error = Mission::parse(tasks).unwrap_err().to_string();
    assert_eq!(error, "task: expected 1 to 64 [[task]], found 0");
}

/// Regression test: "missing field `name`" did not mention the misspelt key.
#[test]
fn a_misspelt_key_that_is_required_is_named() {
    let error = refusal("name = \"kitchen\"", "nmae = \"kitchen\"");
    assert_eq!(error, "task 1.nmae: unknown key; did you mean `name`?");
    let error = refusal("kind = \"example\"", "knd = \"example\"");
    assert_eq!(error, "navigator.knd: unknown key; did you mean `kind`?");
    assert!(refusal("name = \"kitchen\"", "").contains("missing field `name`"));
}

#[test]
fn the_keys_of_a_kind_are_read_and_no_others() {
    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct TaskKeys {
        rounds: f64,
    }
    let mission = |navigator: &str, task: &str| {
        let text = MISSION.replace("drawing = \"s.png\", start = [1, 1], start_heading_deg = 90", navigator);
        Mission::parse(&text.replace("goal = [3, 4]", task)).unwrap()
    };
    let read = mission("", "rounds = 2");
    assert_eq!(read.navigator_keys::<NoKeys>().unwrap(), NoKeys {});
    assert_eq!(read.task_keys::<TaskKeys>().unwrap(), [TaskKeys { rounds: 2.0 }]);
    for (task, error) in [
        ("rounds = 2\ncolour = \"red\"", "task 1 (kitchen): unknown field `colour`, expected `rounds`"),
        ("round = 2", "task 1 (kitchen): unknown field `round`; did you mean `rounds`?"),
        ("rounds = \"two\"", "task 1 (kitchen).rounds: invalid type: string \"two\", expected a number"),
        ("", "task 1 (kitchen): missing field `rounds`"),
    ] {
        assert_eq!(mission("", task).task_keys::<TaskKeys>().unwrap_err().to_string(), error);
    }
    let error = mission("colour = \"red\"", "rounds = 2").navigator_keys::<NoKeys>().unwrap_err().to_string();
    assert!(error.starts_with("navigator: unknown field `colour`"), "{error}");
}

#[test]
fn keys_of_another_kind_are_kept() {
    let other =
        MISSION.replace("kind = \"example\"", "kind = \"walls\", side = \"left\", plan_file = \"p.txt\"");
    let mut mission = Mission::parse(&other.replace("goal = [3, 4]", "rounds = 2")).unwrap();
    assert_eq!(mission.navigator_kind(), "walls");
    assert_eq!(mission.navigator.given["side"].as_str(), Some("left"));
    assert_eq!(mission.task[0].given["rounds"].as_integer(), Some(2));
    let files: Vec<_> = mission.navigator_files_mut().map(|(key, file)| (key, file.clone())).collect();
    let expected = [("navigator.drawing", "s.png"), ("navigator.plan_file", "p.txt")];
    assert_eq!(files, expected.map(|(key, file)| (key.to_owned(), file.to_owned())));
}

#[test]
fn parameters_must_belong_to_known_processes() {
    let error = refusal("[[task]]", "parameters = { mapper = { a = 1 } }\n[[task]]");
    assert!(
        error.contains("expected one of sketcher, localizer, planner") && error.contains("`mapper`"),
        "{error}"
    );
    let mut parameters: Parameters = "localizer.beams = 48".parse().unwrap();
    parameters.extend(&"planner.footprint_padding_m = 0.1".parse().unwrap());
    assert_eq!(parameters.of(Process::Localizer)["beams"].as_integer(), Some(48));
    assert_eq!(parameters.of(Process::Planner)["footprint_padding_m"].as_float(), Some(0.1));
    assert!(parameters.of(Process::Sketcher).is_empty());
}

/// Regression test: the second of two values in one table used to remove the first.
#[test]
fn nested_tables_are_merged_completely() {
    let mut parameters: Parameters = "localizer.belief.hypotheses = 48".parse().unwrap();
    parameters.extend(&"localizer.belief.cone = 0.2".parse().unwrap());
    parameters.extend(&"localizer.belief.cone = 0.3".parse().unwrap());
    let belief = &parameters.of(Process::Localizer)["belief"];
    assert_eq!((belief["hypotheses"].as_integer(), belief["cone"].as_float()), (Some(48), Some(0.3)));
}

#[test]
fn a_task_may_leave_open_where_in_the_world_it_ends() {
    let open = MISSION.replace("there = { center = [1.0, 2.0], radius_m = 1.0 }", "");
    let mission = Mission::parse(&open).unwrap();
    assert!(mission.task[0].there.is_unknown());
    assert!(!toml::to_string(&mission).unwrap().contains("there"));
    assert!(refusal("radius_m = 1.0", "").contains("center and radius_m"));
}

#[test]
fn a_table_overrides_single_values() {
    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Some {
        length_m: f32,
        count: usize,
    }
    let base = Some { length_m: 0.1, count: 3 };
    let with = |text: &str| overlaid(&base, &toml::from_str(text).unwrap());
    assert_eq!(with("").unwrap(), base);
    assert_eq!(with("count = 5").unwrap(), Some { length_m: 0.1, count: 5 });
    let error = with("lenght_m = 5").unwrap_err().to_string();
    assert!(error.contains("lenght_m") && error.contains("`length_m`"), "{error}");
    assert!(with("count = true").unwrap_err().to_string().contains("boolean"));
    let error_of = |text: &str| {
        let parameters: Parameters = text.parse().unwrap();
        parameters.over(Process::Planner, &base).unwrap_err().to_string()
    };
    let slip = error_of("planner.lenght_m = 5");
    assert_eq!(slip, "parameters.planner: unknown field `lenght_m`; did you mean `length_m`?");
    let wrong = error_of("planner.count = true");
    assert_eq!(
        wrong,
        "parameters.planner.count: invalid type: boolean `true`, expected a whole number, 0 or more"
    );
    let outer = [("some".to_owned(), base)].into();
    let within: BTreeMap<String, Some> =
        overlaid(&outer, &toml::from_str("some.count = 7").unwrap()).unwrap();
    assert_eq!(within["some"], Some { length_m: 0.1, count: 7 });
}

#[test]
fn an_invalid_number_is_named_wherever_it_is() {
    // Such a number once reached the services as `null` in a file that we had written.
    for (from, to, key) in [
        ("world_heading_deg = 90", "world_heading_deg = nan", "start.world_heading_deg"),
        ("start = [1, 1]", "start = [nan, 1]", "navigator.start[0]"),
        ("radius_m = 1.0", "radius_m = inf", "task 1.there.radius_m"),
    ] {
        let error = refusal(from, to);
        assert!(error.contains(key) && error.contains("finite"), "{error}");
    }
}

#[test]
fn an_invalid_carry_is_named_by_its_number() {
    let carry = |carry: &str| {
        let world = format!(
            "world = {{ map = \"floor.yaml\", carry = [{{ at_s = 1, to = [2, 2], heading_deg = 0 }}, {carry}] }}"
        );
        refusal("world = { map = \"floor.yaml\" }", &world)
    };
    let error = carry("{ at_s = -1, to = [2, 2], heading_deg = 0 }");
    assert!(error.contains("world.carry 2.at_s: expected 0 to 1000000 s, found -1"), "{error}");
    let error = carry("{ at_s = 1, to = [2, 1e9], heading_deg = 0 }");
    assert!(error.contains("world.carry 2.to: expected -10000 to 10000 m"), "{error}");
    let error = carry("{ at_s = 1, to = [2, 2], heading_deg = 400 }");
    assert!(error.contains("world.carry 2.heading_deg: expected -360 to 360"), "{error}");
    let plane = "world = { plane = \"p.toml\", carry = [{ at_s = 1, to = [2, 2], heading_deg = 0 }] }";
    let error = refusal("world = { map = \"floor.yaml\" }", plane);
    assert!(error.contains("no furniture, person, marker or carry with a plane"), "{error}");
}

/// Regression test: the error printed the place in Rust's debug format: "Place { polygon: None, center: Some([1.0, 2.0]), …".
#[test]
fn an_invalid_place_is_quoted_from_the_file() {
    let error = refusal("center = [1.0, 2.0], radius_m = 1.0", "center = [1.0, 2.5]");
    assert!(error.ends_with("found center = [1, 2.5]"), "{error}");
}

#[test]
fn a_heading_beyond_a_full_turn_is_refused() {
    // A heading of 1e300 degrees once kept the world busy forever.
    assert!(refusal("world_heading_deg = 90", "world_heading_deg = 1e300").contains("-360 to 360"));
}

/// Regression test: all finite numbers were accepted, but a time limit of 1e300 s does not fit into nanoseconds, and a start at
/// 1e39 m does not fit into single precision.
#[test]
fn numbers_beyond_any_building_are_refused_with_their_keys() {
    for (from, to, message) in [
        ("world = [1.0, 1.0]", "world = [1e39, 1.0]", "start.world: expected -10000 to 10000 m, found 1e39"),
        (
            "there =",
            "time_limit_s = 1e300\nthere =",
            "task 1 (kitchen).time_limit_s: expected 0.001 to 1000000 s, found 1e300",
        ),
        ("radius_m = 1.0", "radius_m = 1e-30", "task 1 (kitchen).there.radius_m: expected 0.001 to 10000 m"),
        ("center = [1.0, 2.0]", "center = [1.0, -2e4]", "task 1 (kitchen).there.center: expected -10000"),
    ] {
        let error = refusal(from, to);
        assert!(error.contains(message), "{error}");
    }
    let corners = vec![[1.0, 1.0]; bounds::MOST_CORNERS + 1];
    let error = refusal("center = [1.0, 2.0], radius_m = 1.0", &format!("polygon = {corners:?}"));
    assert!(error.ends_with("there.polygon: expected at most 1000 corners, found 1001"), "{error}");
}

#[test]
fn control_characters_in_a_name_are_refused() {
    assert!(refusal("\"kitchen\"", "\"\\u001b[31m\"").contains("control"));
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig { failure_persistence: None, ..Default::default() })]

    #[test]
    fn no_text_makes_it_panic(text in ".*") {
        let _ = Mission::parse(&text);
    }

    #[test]
    fn damaged_missions_never_panic(at in 0..MISSION.len(), cut in 0..MISSION.len(), put in ".{0,3}") {
        let parts = MISSION.get(..at).zip(MISSION.get(cut.max(at)..));
        if let Some((head, tail)) = parts {
            let _ = Mission::parse(&format!("{head}{put}{tail}"));
        }
    }
}

//! Tests of the commands that people and programs use with a running system (`echo`, `hz`, `channels`, `logs`, `restart`,
//! `send`, `graph`, `doctor` and `snapshot`), and of the program's own manual pages.

use std::path::Path;

use nix::sys::signal::Signal;
use serde_json::Value;
use sketchnav_recordings::Recording;
use sketchnav_schemas::channels::MISSION;
use sketchnav_schemas::message::Text;
use support::{Ended, Place, Running, repository, room};

const NAME: &str = "tools";

fn started(place: &Place) -> Running {
    let mut running = place.start(&format!("run demo --json --system {NAME} --speed 2"));
    place.wait_until_driving(&mut running, NAME);
    running
}

fn ended(running: Running) -> Ended {
    running.signal(Signal::SIGINT);
    running.end()
}

fn lines(ended: &Ended) -> Vec<Value> {
    ended.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn echo_prints_fields_tables_and_several_channels() {
    let place = Place::new();
    let running = started(&place);
    let fields = place.fine("echo estimate --count 3 --field pose.position.x --field tracking");
    for line in lines(&fields) {
        let fields = line["fields"].as_object().unwrap();
        assert!(fields.len() == 2 && fields["pose.position.x"].is_number(), "{fields:?}");
    }
    let table = place.fine("echo odometry --count 3 --csv --field pose.pose.position.x");
    let rows: Vec<_> = table.out.lines().collect();
    assert_eq!(rows[0], "seq,stamp_ns,source_seq,pose.pose.position.x", "{table}");
    assert!(rows.len() == 4 && rows[1..].iter().all(|row| row.split(',').count() == 4), "{table}");
    let several = place.fine("echo --regex scan|odometry --count 40 --field header.stamp.sec");
    let channels: std::collections::BTreeSet<_> =
        lines(&several).iter().map(|line| line["channel"].as_str().unwrap().to_owned()).collect();
    assert_eq!(channels.into_iter().collect::<Vec<_>>(), ["odometry", "scan"]);
    let wrong = place.run("echo estimate --once --field pose.here");
    assert_eq!(wrong.code, Some(2), "{wrong}");
    assert!(wrong.err.contains("pose: expected one of orientation, position, found \"here\""), "{wrong}");
    let wrong = place.run("echo scan --once --csv --field ranges");
    assert!(wrong.code == Some(2) && wrong.err.contains("found a list"), "{wrong}");
    let wrong = place.run("echo --regex nothing.*");
    assert!(wrong.code == Some(2) && wrong.err.contains("--regex: expected a match of"), "{wrong}");
    ended(running);
}

/// `echo` could once print only the messages of a running system, and nothing could print those of a recording.
#[test]
fn echo_prints_a_recording_as_it_prints_a_system() {
    let place = Place::new();
    room::write(place.files());
    let (report, code) = place.mission("run room.toml", "recorded");
    assert_eq!(code, 0, "{report:#}");
    let file = report["recording"].as_str().unwrap();
    let newest = place.fine(&format!("echo status --file {file} --once")).json();
    let all = lines(&place.fine(&format!("echo status --file {file}")));
    assert_eq!((all.last(), &all[0]["seq"]), (Some(&newest), &1.into()));
    assert_eq!(newest["message"]["reason"], all[all.len() - 1]["message"]["reason"]);
    let table =
        place.fine(&format!("echo odometry --file {file} --count 3 --csv --field pose.pose.position.x"));
    let rows: Vec<_> = table.out.lines().collect();
    assert_eq!((rows.len(), rows[0]), (4, "seq,stamp_ns,source_seq,pose.pose.position.x"), "{table}");
    let several = lines(&place.fine(&format!("echo --regex scan|tick --file {file} --count 9")));
    let of = |channel: &str| several.iter().filter(|line| line["channel"] == channel).count();
    assert!(several.len() == 9 && of("scan") > 0 && of("tick") > 0, "{several:?}");
    for (wrong, words) in [
        (format!("echo wind --file {file}"), "found \"wind\""),
        (format!("echo relations --file {file}"), "expected one of"),
        (format!("echo /odom --file {file}"), "did you mean odometry?"),
        (format!("echo {file}"), "echo CHANNEL --file"),
        ("echo status --file nothing.mcap".to_owned(), "nothing.mcap"),
    ] {
        let wrong = place.run(&wrong);
        assert!(wrong.code == Some(2) && wrong.err.contains(words), "{wrong}");
    }
}

#[test]
fn version_identifies_the_build() {
    let place = Place::new();
    let output = place.fine("--version");
    let begin = format!("sketchnav {} (", env!("CARGO_PKG_VERSION"));
    assert!(output.out.starts_with(&begin) && output.out.contains("build "), "{output}");
    assert_eq!(place.fine("-V").out, output.out);
    let usage = place.fine("run --help").out;
    assert!(usage.contains("sketchnav run --resume <DIR>"), "{usage}");
}

/// Writing a mission for a deformed floor used to require looking up its start and goals in an image editor.
#[test]
fn deform_reports_places_and_omissions() {
    let place = Place::new();
    let floor = repository().join("sim/missions/building/building.floor.toml");
    let deform = |options: &str| format!("deform {} -o drawing.svg {options}", floor.display());
    let traced = place.fine(&deform("--degree 0 --place 2.0,6.95,90 --place 14.0,10.6 --json")).json();
    let pixel = |i: usize, axis: usize| traced["places"][i]["at_px"][axis].as_f64().unwrap();
    // A traced drawing has one scale in both directions, and its rows point downwards.
    let px_per_m = [(pixel(1, 0) - pixel(0, 0)) / 12.0, (pixel(0, 1) - pixel(1, 1)) / 3.65];
    assert!((px_per_m[0] - px_per_m[1]).abs() < 0.5, "{px_per_m:?}: {traced:#}");
    assert_eq!(traced["places"][0]["heading_deg"], 90.0, "{traced:#}");
    assert!(traced["rooms"].as_array().unwrap().iter().all(|room| room["at_px"].is_array()), "{traced:#}");
    let names: Vec<_> = traced["left_out"].as_array().unwrap().iter().map(|piece| &piece["name"]).collect();
    assert!(names.contains(&&"desk".into()), "{names:?}");
    let words = place.fine(&deform("--degree 0 --place 14.0,10.6 --place 4.1,12.9")).out;
    for expected in [
        "(14, 10.6) m: goal = [",
        "left out: desk, 1.6 m × 0.8 m at (4.1, 12.9) m",
        "(4.1, 12.9) m: desk at or next to it is left out of the drawing",
        "the room around (",
    ] {
        assert!(words.contains(expected), "{expected}: {words}");
    }
    assert!(!words.contains("may be walls"), "a floor plan says what is furniture: {words}");
    let wrong = place.run(&deform("--place 140,10"));
    assert_eq!(wrong.code, Some(2), "{wrong}");
    assert!(wrong.err.contains("--place 140,10: expected a place in a room"), "{wrong}");
}

/// A history contains up to 128 messages, but `--once` shows only the current state.
#[test]
fn once_prints_the_newest_message() {
    let place = Place::new();
    let running = started(&place);
    let seq = || lines(&place.fine("echo status --once"))[0]["seq"].as_u64().unwrap();
    let first = seq();
    assert_eq!(lines(&place.fine("echo /status --once")).len(), 1, "a topic is a channel, too");
    let history = place.fine("echo status --count 20");
    let newest = lines(&history).iter().map(|line| line["seq"].as_u64().unwrap()).max().unwrap();
    let later = seq();
    assert!(first > 1 && later >= first && later >= newest.min(first + 1), "{first}, {newest}, {later}");
    // A message that stays in the history until a new one arrives is also the latest one.
    assert_eq!(lines(&place.fine("echo sketch --once --field grid.info.width")).len(), 1);
    ended(running);
}

#[test]
fn hz_prints_bandwidth_and_percentiles() {
    let place = Place::new();
    let running = started(&place);
    let output = place.fine("hz estimate --count 20 --json");
    let last = lines(&output).pop().unwrap();
    assert_eq!((&last["channel"], &last["messages"]), (&"estimate".into(), &20.into()), "{last:#}");
    let simulated = last["simulated_rate_hz"].as_f64().unwrap();
    assert!((simulated - 10.0).abs() < 1e-6, "{last:#}");
    assert!(last["bytes_per_second"].as_f64().unwrap() > 0.0, "{last:#}");
    for times in ["interval_ms", "delay_ms"] {
        let at = |share: &str| last[times][share].as_f64().unwrap();
        assert!(at("p50") > 0.0 && at("p50") <= at("p90") && at("p99") <= at("max"), "{last:#}");
    }
    // A reading is its own cause, so it has no delay.
    let last = lines(&place.fine("hz scan --count 5 --json")).pop().unwrap();
    assert!(last["delay_ms"].is_null() && last["interval_ms"].is_object(), "{last:#}");
    ended(running);
}

#[test]
fn channels_lists_the_connected_processes() {
    let place = Place::new();
    let running = started(&place);
    let all = place.fine(&format!("channels {NAME} --json")).json();
    let row = |name: &str| {
        let found = all.as_array().unwrap().iter().find(|row| row["channel"] == name);
        found.unwrap_or_else(|| panic!("{name}: {all:#}"))
    };
    let names = |of: &Value| -> Vec<String> {
        of.as_array().unwrap().iter().map(|peer| peer["process"].as_str().unwrap().to_owned()).collect()
    };
    let scan = row("scan");
    assert_eq!(names(&scan["writers"]), ["world"], "{scan:#}");
    assert_eq!(scan["writers"][0]["pid"], place.pid(NAME, "world"), "{scan:#}");
    let mut readers = names(&scan["readers"]);
    readers.sort();
    assert_eq!(readers, ["localizer", "planner", "recorder"], "{scan:#}");
    assert!(scan["rate_hz"].as_f64().unwrap() > 0.0 && scan["sent"].as_u64().unwrap() > 0, "{scan:#}");
    assert_eq!(row("sketch")["kept"], 1, "{all:#}");
    assert!(all.as_array().unwrap().iter().all(|row| row["channel"] != "rules"), "{all:#}");
    let wrong = place.run("channels nothing");
    assert!(wrong.code == Some(2) && wrong.err.contains("nothing"), "{wrong}");
    ended(running);
}

#[test]
fn an_order_by_hand_pauses_the_mission_and_is_recorded() {
    let place = Place::new();
    let running = started(&place);
    let state = || lines(&place.fine("echo status --once --field state"))[0]["fields"]["state"].clone();
    let output = place.fine(&format!("send pause --system {NAME} --json")).json();
    assert_eq!((&output["order"], &output["seq"]), (&"pause".into(), &2.into()), "{output:#}");
    support::wait_until("a pause", || state() == 2);
    place.fine("send resume");
    support::wait_until("the way on", || state() == 1);
    let wrong = place.run("send start --task 99");
    assert!(wrong.code == Some(2) && wrong.err.contains("--task: expected 1 to 9"), "{wrong}");
    let wrong = place.run("send fly");
    assert!(wrong.code == Some(2) && wrong.err.contains("pause"), "{wrong}");
    says_where_it_is(&place);
    // The planner ends the mission, and with it the run.
    place.fine("send abort");
    let report = running.end().json();
    assert!(report["tasks"][0]["reason"].as_str().unwrap().contains("given up by a person"), "{report:#}");
    let recording = report["recording"].as_str().unwrap();
    let info = place.fine(&format!("info {recording} --json")).json();
    let faults = info["faults"].as_array().unwrap().iter();
    let output: Vec<_> =
        faults.map(|fault| [&fault["kind"], &fault["words"]].map(Value::to_string)).collect();
    let expected = ["pause", "resume", "here", "abort"];
    assert_eq!(output, expected.map(|order| ["\"order given\"".into(), format!("\"send: {order}\"")]));
    let orders: Vec<_> = Recording::open(recording.as_ref())
        .unwrap()
        .channel(MISSION)
        .unwrap()
        .filter_map(|order| order.unwrap().0.here())
        .collect();
    let [here] = orders[..] else { panic!("{orders:?}") };
    assert!(here.at.x == 1700.0 && here.yaw_rad == Some(-std::f64::consts::FRAC_PI_2), "{here:?}");
    place.assert_nothing_left(NAME);
}

#[test]
fn a_robot_is_sent_to_a_room_by_its_name() {
    let place = Place::new();
    let mission = repository().join("sim/missions/building/building-rooms.toml");
    let mut running = place.start(&format!("run {} --json --system {NAME} --speed 2", mission.display()));
    place.wait_until_driving(&mut running, NAME);
    let status = |field: &str| {
        lines(&place.fine(&format!("echo status --once --field {field}")))[0]["fields"][field].clone()
    };
    let told = place.fine("send goal Lounge --json").json();
    assert_eq!((&told["task"], &told["name"]), (&4.into(), &"Lounge".into()), "{told:#}");
    support::wait_until("the fourth task", || status("task") == 3);
    assert_eq!(status("name"), "to rest");
    // No task leads to the store, but it is written on the drawing.
    let told = place.fine("send goal STORE --json").json();
    assert_eq!((&told["task"], &told["name"]), (&serde_json::Value::Null, &"STORE".into()), "{told:#}");
    support::wait_until("the way to the store", || status("task") == 4);
    assert_eq!((status("name"), status("task_count")), ("STORE".into(), 5.into()));
    place.fine("restart planner --kill");
    support::wait_until("the way on", || status("state") == 1);
    assert_eq!((status("name"), status("task")), ("STORE".into(), 4.into()), "the successor goes there, too");
    // The room between them has a name of its own, which the person did not need to know.
    let told = place.fine("send goal the room between office 2 and the store");
    assert!(
        told.out.contains("the room between office 2 and the store is \"office 3\" at (981, 3"),
        "{told}"
    );
    support::wait_until("the way between", || status("name") == "office 3");
    for (wrong, words) in [
        (
            "goal the room between office 1 and the store",
            "sketch-a.svg, found \"office 2\" at (731, 307), \"office 3\" at (981, 327); name the one that you mean",
        ),
        (
            "goal the room left of office 1",
            "found right of office 1 \"office 2\" at (731, 307); below left of",
        ),
        ("goal washroom", "sketch-a.svg, found \"washroom\" at (192, 809) and at (362, 809)"),
        ("goal library", "there are back to work, coffee machine, for a coffee, lounge, office 1, office 2"),
        ("pause lounge", "NAME: expected the order `goal`, found `pause`"),
        ("goal lonuge", "did you mean \"lounge\"?"),
        ("goal lounge --task 2", "--task"),
    ] {
        let wrong = place.run(&format!("send {wrong}"));
        assert!(wrong.code == Some(2) && wrong.err.contains(words), "{words}: {wrong}");
    }
    place.fine("send abort");
    let report = running.end().json();
    assert_eq!(
        report["tasks"].as_array().unwrap().len(),
        4,
        "only the mission's tasks are judged: {report:#}"
    );
    let recording = report["recording"].as_str().unwrap();
    let orders = Recording::open(recording.as_ref()).unwrap().channel(MISSION).unwrap();
    let names: Vec<_> = orders.filter_map(|order| Some(order.unwrap().0.place()?.name)).collect();
    assert_eq!(names.iter().map(Text::as_str).collect::<Vec<_>>(), ["STORE", "office 3"]);
    // The step at which the planner got an order is not recorded.
    let again = place.run(&format!("rerun {recording} --process planner"));
    assert!(again.code == Some(2) && again.err.contains("people took part"), "{again}");
    place.fine(&format!("rerun {recording} --process localizer"));
    place.assert_nothing_left(NAME);
}

/// Sends the order `here`, which the estimate must follow. A position outside the drawing is bad input.
fn says_where_it_is(place: &Place) {
    let output = place.fine("send here --at 1700,300 --heading -90 --json").json();
    assert_eq!(
        (&output["order"], &output["at"]),
        (&"here".into(), &serde_json::json!([1700.0, 300.0])),
        "{output:#}"
    );
    support::wait_until("the estimate there", || {
        let output = place.fine("echo estimate --once --field pose.position.x");
        let fields = lines(&output)[0]["fields"].clone();
        fields["pose.position.x"].as_f64().is_some_and(|x| (x - 1700.0).abs() < 250.0)
    });
    for (wrong, words) in [
        ("here", "expected --at X,Y, found none"),
        ("here --at 300", "expected two numbers"),
        ("here --at 300,-1", "expected a place in the drawing of"),
        ("here --at 99999,1", "found 99999,1"),
        ("here --at 1,1 --heading 720", "-360 to 360 degrees"),
        ("here --at 1,1 --task 2", "--task"),
        ("here --heading 7", "--at"),
        ("pause --at 1,1", "expected the order `here`, found `pause`"),
    ] {
        let wrong = place.run(&format!("send {wrong}"));
        assert!(wrong.code == Some(2) && wrong.err.contains(words), "{words}: {wrong}");
    }
}

#[test]
fn a_process_is_restarted_and_nothing_is_lost() {
    let place = Place::new();
    let running = started(&place);
    for (process, how) in [("localizer", ""), ("world", "--kill"), ("recorder", "--kill")] {
        let before = place.pid(NAME, process);
        let output = place.fine(&format!("restart {process} {how} --json")).json();
        assert_eq!(
            (&output["pid_before"], &output["process"]),
            (&before.into(), &process.into()),
            "{output:#}"
        );
        assert_eq!(output["pid"], place.pid(NAME, process), "{output:#}");
    }
    let wrong = place.run("restart pad");
    assert!(wrong.code == Some(2) && wrong.err.contains("pad: expected a process that runs"), "{wrong}");
    let report = ended(running).json();
    assert_eq!(report["lost_messages"], 0, "{report:#}");
    place.assert_nothing_left(NAME);
}

#[test]
fn logs_are_shown_by_process_followed_to_the_end_and_kept() {
    let place = Place::new();
    let running = started(&place);
    let follow = place.start("logs --follow --json");
    place.fine("restart localizer --kill");
    let report = ended(running).json();
    let output = follow.end();
    assert_eq!(output.code, Some(0), "{output}");
    let output = lines(&output);
    // The recorder reports this about itself when it ends.
    let is_recorders = |line: &Value| {
        let words = line["line"].as_str().unwrap();
        line["process"] == "recorder" && words.contains("messages recorded, 0 missing")
    };
    assert!(output.iter().any(is_recorders), "{output:?}");
    // They were once removed with the system, so nothing of what a process had printed remained.
    let kept = Path::new(report["logs"].as_str().unwrap());
    let of_recorder = output.iter().filter(|line| line["process"] == "recorder");
    let printed: Vec<_> = of_recorder.map(|line| line["line"].as_str().unwrap()).collect();
    let log = std::fs::read_to_string(kept.join("recorder.log")).unwrap();
    assert_eq!(log.lines().collect::<Vec<_>>(), printed);
    let nothing = place.run("logs");
    assert!(nothing.code == Some(2) && nothing.err.contains("no system is running"), "{nothing}");
}

/// On a full disk, a run once failed with exit code 3 because it could not keep its logs.
#[test]
fn a_run_that_cannot_keep_its_logs_reports_this_and_does_not_fail() {
    let place = Place::new();
    room::write(place.files());
    let mut running = place.start(&format!("run room.toml --json --system {NAME} --speed 4 --out out"));
    place.wait_until_driving(&mut running, NAME);
    std::fs::write(place.files().join("out/room-001/logs"), "in the way").unwrap();
    let ended = running.end();
    let report = ended.json();
    assert_eq!((ended.code, &report["logs"]), (Some(0), &Value::Null), "{ended}");
    let why = report["logs_incomplete"].as_str().unwrap();
    assert!(why.contains("logs of the recorder"), "{why}");
    place.assert_nothing_left(NAME);
}

#[test]
fn a_graph_shows_the_rates_of_a_running_system() {
    let place = Place::new();
    let table = place.fine("graph --kind corridor -o table.svg --json").json();
    assert!(table["figures"].is_null() && table["channels"].to_string().contains("relations"), "{table:#}");
    let running = started(&place);
    let output = place.fine(&format!("graph --system {NAME} -o live.svg --json")).json();
    let figures = output["figures"].as_array().unwrap();
    assert_eq!(figures.len(), output["channels"].as_array().unwrap().len(), "{output:#}");
    for file in ["table.svg", "live.svg"] {
        let svg = std::fs::read_to_string(place.files().join(file)).unwrap();
        assert!(svg.contains(">tick</text>") && svg.ends_with("</svg>\n"), "{file}");
    }
    let wrong = place.run("graph --kind flying");
    assert!(wrong.code == Some(2) && wrong.err.contains("--kind: expected one of"), "{wrong}");
    let wrong = place.run("graph -o nowhere/at/all.svg");
    assert!(wrong.code == Some(2) && wrong.err.contains("--output nowhere/at/all.svg"), "{wrong}");
    ended(running);
}

fn finding<'a>(output: &'a Value, check: &str) -> &'a Value {
    let all = output["findings"].as_array().unwrap();
    all.iter().find(|finding| finding["check"] == check).unwrap_or_else(|| panic!("{output:#}"))
}

#[test]
fn doctor_and_ps_find_leftovers_of_a_dead_system() {
    let place = Place::new();
    let output = place.fine("doctor --json").json();
    for check in ["version", "kernel", "shared memory", "folder", "file size", "open files", "leftovers"] {
        assert_eq!(finding(&output, check)["level"], "fine", "{output:#}");
    }
    let running = started(&place);
    running.signal(Signal::SIGKILL);
    running.end();
    support::wait_until("the death of all", || place.living().is_empty());
    let ps = place.fine("ps").out;
    let hint = "tools: its supervisor was killed; resume it with: sketchnav run --resume ";
    assert!(ps.lines().any(|line| line.starts_with(hint)), "{ps}");
    let output = place.fine("doctor --json").json();
    let leftovers = finding(&output, "leftovers");
    assert_eq!(leftovers["level"], "warning", "{output:#}");
    assert!(leftovers["found"].as_str().unwrap().contains(NAME), "{leftovers:#}");
    assert!(leftovers["advice"].as_str().unwrap().contains("sketchnav clean"), "{leftovers:#}");
    place.fine("clean");
    assert_eq!(finding(&place.fine("doctor --json").json(), "leftovers")["level"], "fine");

    let Some(mut limited) = needs::program("bash") else { return };
    let program = place.command("").get_program().to_owned();
    limited.args(["-c", "ulimit -n 64; ulimit -f 1000; exec \"$0\" doctor --json"]).arg(program);
    place.settle(&mut limited);
    let output = Running::spawn(limited).end();
    assert_eq!(output.code, Some(1), "{output}");
    for (check, advice) in [("open files", "ulimit -n"), ("file size", "ulimit -f")] {
        let finding = finding(&output.json(), check).clone();
        assert_eq!(finding["level"], "error", "{finding:#}");
        assert!(finding["advice"].as_str().unwrap().contains(advice), "{finding:#}");
    }
}

#[test]
fn doctor_rejects_a_folder_open_to_others() {
    use std::os::unix::fs::PermissionsExt;
    let place = Place::new();
    std::fs::create_dir(place.root()).unwrap();
    std::fs::set_permissions(place.root(), std::fs::Permissions::from_mode(0o755)).unwrap();
    let output = place.run("doctor --json");
    assert_eq!(output.code, Some(1), "{output}");
    let finding = finding(&output.json(), "folder").clone();
    assert_eq!(finding["level"], "error", "{finding:#}");
    assert!(finding["found"].as_str().unwrap().contains("found mode 0755"), "{finding:#}");
}

/// The recorder was killed before, so the recording so far is in two files.
#[test]
fn a_snapshot_keeps_the_last_seconds_and_recording_continues() {
    let place = Place::new();
    let running = started(&place);
    // By then the robot has looked around and is planning.
    place.fine("echo estimate --count 60 --csv --field header.stamp.sec");
    place.fine("restart recorder --kill");
    let output = place.fine("snapshot --last 2 -o moment.mcap --json").json();
    let second = |key: &str| output[key].as_f64().unwrap();
    assert!((second("end_s") - second("start_s") - 2.0).abs() < 1e-6, "{output:#}");
    let info = place.fine("info moment.mcap --json").json();
    assert_eq!(info["missing"], 0, "{info:#}");
    let messages = place.messages("moment.mcap");
    assert_eq!((messages["/sketch"], messages["/route"]), (1, 1), "{messages:?}");
    // A machine that was busy catches up, and then more than twenty scans fall within two seconds.
    assert!(messages["/scan"] >= 15, "{messages:?}");
    // The snapshot can be judged, although no task has ended yet.
    let judged = place.run("judge moment.mcap --json");
    assert_eq!((judged.code, &judged.json()[0]["cut_off"]), (Some(1), &serde_json::json!(false)), "{judged}");

    place.fine("snapshot --on status --after 0.1 --last 1 --regex scan|odo.* -o scans.mcap");
    let messages = place.messages("scans.mcap");
    assert_eq!(messages.keys().collect::<Vec<_>>(), ["/odometry", "/scan"]);
    place.fine("filter moment.mcap --regex plan|est.* -o plans.mcap");
    assert_eq!(place.messages("plans.mcap").keys().collect::<Vec<_>>(), ["/estimate", "/plan"]);
    for (wrong, words) in [
        ("snapshot --on nothing -o x.mcap", "--on \"nothing\": expected one of"),
        ("snapshot --on relations -o x.mcap", "--on relations: expected one of"),
        ("snapshot --regex nothing -o x.mcap", "--regex: expected a match of"),
    ] {
        let ended = place.run(wrong);
        assert!(ended.code == Some(2) && ended.err.contains(words), "{wrong}: {ended}");
    }
    assert!(!place.files().join("x.mcap").exists());
    assert_eq!(ended(running).json()["lost_messages"], 0);
    place.assert_nothing_left(NAME);
}

#[cfg(feature = "manuals")]
#[test]
fn every_command_has_a_page_and_every_shell_its_completions() {
    let place = Place::new();
    place.fine("man pages");
    let pages: Vec<_> =
        std::fs::read_dir(place.files().join("pages")).unwrap().map(|page| page.unwrap().path()).collect();
    for name in ["sketchnav.1", "sketchnav-run.1", "sketchnav-view.1", "sketchnav-snapshot.1"] {
        assert!(pages.iter().any(|page| page.ends_with(name)), "{name}: {pages:?}");
    }
    for page in pages.iter().filter(|_| needs::has(&["man"])) {
        let mut man = needs::program("man").expect("man, which was there before");
        let shown: Ended = man.args(["--warnings", "-Tutf8", "-l"]).arg(page).output().unwrap().into();
        assert!(shown.code == Some(0) && shown.err.is_empty(), "{}: {}", page.display(), shown.err);
    }
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let completions = place.fine(&format!("completions {shell}"));
        assert!(completions.out.contains("snapshot"), "{shell}");
    }
    let script = place.fine("completions bash").out;
    let Some(mut bash) = needs::program("bash") else { return };
    let parsed: Ended = bash.args(["-nc", &script]).output().unwrap().into();
    assert_eq!(parsed.code, Some(0), "{parsed}");
}

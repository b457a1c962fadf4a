//! The tools for recordings as users call them, on the recording of a real run, compared byte for byte, with their exit
//! codes.

use std::path::Path;
use std::process::Command;

use bytemuck::Zeroable;
use nix::pty::openpty;
use nix::sys::signal::Signal;
use serde_json::Value;
use sketchnav_recordings::reader::Selection;
use sketchnav_recordings::{Recording, Writer};
use sketchnav_schemas::channels::{FAULTS, HEALTH};
use sketchnav_schemas::codes::{FaultKind, Process};
use sketchnav_schemas::message::{Fault, Header, Health, Text};
use support::{Ended, Place, Running, repository, room};

/// Runs the test room in lockstep and returns the recording's path.
fn recorded(place: &Place) -> String {
    room::write(place.files());
    let (report, _) = place.mission("run room.toml", "room");
    report["recording"].as_str().unwrap().to_owned()
}

fn fine(place: &Place, arguments: &str) -> Ended {
    let ended = place.run(arguments);
    assert_eq!(ended.code, Some(0), "{arguments}: {ended}");
    ended
}

/// `sketchnav diff … | head -1` once reported that two recordings were identical, because the exit code of any command was 0 once
/// its output was no longer read.
#[test]
fn closing_the_pipe_does_not_change_the_exit_code() {
    let place = Place::new();
    let golden = repository().join("recordings/golden");
    let [story, log] = ["story.mcap", "log.mcap"].map(|name| golden.join(name).display().to_string());
    for (arguments, code) in [(format!("diff {story} {log}"), 1), (format!("diff {story} {story}"), 0)] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let status = place.command(&arguments).stdout(writer).status().unwrap();
        assert_eq!(status.code(), Some(code), "{arguments}");
    }
}

/// The recording of a run, its replay through live processes, and a rerun of each service agree. The files that the
/// mission named are gone, because the recording contains the drawing and the floor.
#[test]
fn a_run_its_replay_and_its_rerun_are_the_same_bytes() {
    let place = Place::new();
    let recording = recorded(&place);
    for name in [room::MISSION, room::DRAWING, room::FLOOR] {
        std::fs::remove_file(place.files().join(name)).unwrap();
    }
    for process in ["world", "sketcher", "localizer", "planner"] {
        let output = fine(&place, &format!("rerun {recording} --process {process} --json")).json();
        assert_eq!((&output["identical"], &output["difference"]), (&Value::Bool(true), &Value::Null));
        assert!(output["same"].as_u64() > Some(0) && output["same"] == output["recorded"], "{output}");
    }
    for live in ["localizer,planner", "sketcher,localizer,planner", "planner"] {
        fine(&place, &format!("replay {recording} --live {live},recorder --rate max --record again.mcap"));
        fine(&place, &format!("diff {recording} again.mcap"));
    }
    assert!(place.ps().is_empty());
}

#[test]
fn another_parameter_makes_a_difference_that_is_named_and_judged() {
    let place = Place::new();
    let recording = recorded(&place);
    let ended =
        place.run(&format!("rerun {recording} --process localizer --set particles=200 --json -o now.mcap"));
    assert_eq!(ended.code, Some(1), "{ended}");
    let output = ended.json();
    let difference = &output["difference"];
    assert_eq!(
        (difference["channel"].as_str(), difference["seq"].as_u64()),
        (Some("particles"), Some(1)),
        "{output}"
    );
    assert!(difference["what"]["field"]["a"].is_string(), "{output}");
    assert_eq!(output["judged"].as_array().map(Vec::len), Some(2));
    fine(&place, "info now.mcap");
    // All differences are below this tolerance.
    let all = [
        "pose",
        "covariance",
        "scale_a_pxpm",
        "scale_b_pxpm",
        "effective_sample_size",
        "fit",
        "particle_count",
        "tracking",
    ];
    let tolerances: Vec<_> = all.iter().map(|field| format!("--tolerance estimate.{field}=1e9")).collect();
    let line =
        format!("rerun {recording} --process localizer --set particles=200 --json {}", tolerances.join(" "));
    let output = place.run(&line).json();
    // The samples of the particles, which have no tolerance, differ by construction.
    assert_eq!(output["difference"]["channel"], "particles", "{output}");
    // If the tolerance of one field is far too small, that field is reported as different.
    let particles =
        ["count", "total", "particles"].map(|field| format!(" --tolerance particles.{field}=1e9"));
    let line = line.replace("scale_a_pxpm=1e9", "scale_a_pxpm=1e-9") + &particles.concat();
    let output = place.run(&line).json();
    assert_eq!(output["difference"]["channel"], "estimate", "{output}");
    assert_eq!(output["difference"]["what"]["field"]["field"], "scale_a_pxpm", "{output}");
    let wrong =
        ["--set particlez=2", "--set particles=many", "--tolerance estimate=1", "--tolerance estimate.x=1"];
    for wrong in wrong {
        let ended = place.run(&format!("rerun {recording} --process localizer {wrong}"));
        assert_eq!(ended.code, Some(2), "{wrong}: {ended}");
    }
}

#[test]
fn the_tools_have_the_exit_codes_of_mcap() {
    let place = Place::new();
    let recording = recorded(&place);
    let whole = std::fs::read(&recording).unwrap();
    std::fs::write(place.files().join("cut.mcap"), &whole[..whole.len() * 2 / 3]).unwrap();
    std::fs::write(place.files().join("none.mcap"), "no recording at all").unwrap();
    fine(&place, &format!("recover {recording} -o same.mcap"));
    fine(&place, &format!("diff {recording} same.mcap"));
    for (line, code) in [
        ("recover cut.mcap -o saved.mcap --json", 3),
        ("recover none.mcap -o never.mcap", 1),
        ("recover nowhere.mcap -o never.mcap", 1),
        ("recover same.mcap", 2),
        ("filter same.mcap --topics nothing -o never.mcap", 1),
        ("merge same.mcap -o never.mcap", 2),
        ("split same.mcap -o parts", 2),
        // A copy of a file that was cut off is incomplete.
        ("filter cut.mcap -o part.mcap --json", 3),
        ("merge same.mcap cut.mcap -o both.mcap --json", 3),
        ("split cut.mcap --seconds 100 -o parts", 3),
        ("merge same.mcap same.mcap -o both.mcap", 0),
    ] {
        assert_eq!(place.run(line).code, Some(code), "{line}");
    }
    // Reports about part of a run state that it is only a part.
    for line in [
        "judge same.mcap cut.mcap",
        "report cut.mcap -o page.html",
        "rerun cut.mcap --process localizer",
        "diff same.mcap cut.mcap",
    ] {
        let ended = place.run(line);
        assert_eq!(ended.err.matches("is cut off").count(), 1, "{line}: {ended}");
    }
    assert!(place.files().join("saved.mcap").exists());
    assert!(
        !place.files().join("never.mcap").exists() && !place.files().join("never.mcap.unfinished").exists()
    );
    fine(&place, "filter same.mcap --topics scan --start 1 --end 2 -o scans.mcap");
    let info = fine(&place, "info scans.mcap --json").json();
    assert_eq!(info["messages"], 10, "{info}");
}

/// Without live processes, the replay plays for observers, over and over, until it is asked to end.
#[test]
fn a_replay_for_observers_leaves_nothing_behind() {
    let place = Place::new();
    let recording = recorded(&place);
    let replay = place.start(&format!("replay {recording} --rate 100 --loop --system again"));
    let echoed = loop {
        let echoed = place.run("echo estimate --system again --count 400");
        if echoed.code == Some(0) {
            break echoed;
        }
    };
    // Numbers and timestamps keep increasing when the replay starts again.
    let lines: Vec<Value> = echoed.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 400);
    for field in ["seq", "stamp_ns", "source_seq"] {
        assert!(lines.is_sorted_by_key(|line| line[field].as_u64()), "{field}");
    }
    replay.signal(Signal::SIGTERM);
    let ended = replay.end();
    assert_eq!(ended.code, Some(3), "{ended}");
    assert!(place.ps().is_empty());
    fine(&place, &format!("replay {recording} --rate max --start 2 --end 4 --topics scan,odometry"));
    for wrong in [
        "--live world",
        "--live recorder",
        "--rate 0",
        "--remap scan",
        "--topics scna",
        "--topics scan,odomtry",
        "--remap scan:=scna",
        "--remap scna:=scan",
        "--topics recorded",
        "--topics faults --live localizer",
        "--topics estimate --live localizer",
        "--start 1000000 --loop",
        "--start 3 --end 2",
        "--start nan",
        &format!("--live localizer,recorder --record {recording}"),
    ] {
        let ended = place.run(&format!("replay {recording} {wrong}"));
        assert_eq!(ended.code, Some(2), "{wrong}: {ended}");
    }
    let late = place.run(&format!("replay {recording} --start 1000000"));
    assert!(late.err.contains("--start 1000000: expected at most ") && !late.err.contains("/scan"), "{late}");
}

/// Writes a copy of the recording with a localizer's death and a planner's health report in the third second.
fn with_a_fault(recording: &Path, copy: &Path) {
    let recording = Recording::open(recording).unwrap();
    let files: Vec<_> = sketchnav_recordings::sources::of_recording(&recording).cloned().collect();
    let sink = std::fs::File::create(copy).unwrap();
    sketchnav_navigators::register(&[]).unwrap();
    let mut writer = Writer::create_with(sink, &recording.run().unwrap(), &files).unwrap();
    for message in recording.timeline(Selection::default()).unwrap() {
        writer.write_raw(&message.unwrap()).unwrap();
    }
    let header = Header { seq: 1, stamp_ns: 3_000_000_000, source_seq: 30 };
    let (kind, process) = (FaultKind::Died.code(), Process::Localizer.code());
    let fault = Fault { header, kind, process, words: Text::new("by a test"), ..Fault::zeroed() };
    writer.write(FAULTS, &fault, &[]).unwrap();
    let health = Health { header, process: Process::Planner.code(), pid: 1, ..Health::zeroed() };
    writer.write(HEALTH, &health, &[]).unwrap();
    writer.finish().unwrap();
}

/// The replay also sends what the supervisor sent: the orders and, for observers, the faults of the processes. The
/// orders used to be those of the replay itself, and no faults were sent. The health of the recorded planner was played
/// beside that of the live one, which looked like a restart.
#[test]
fn a_replay_includes_messages_of_the_supervisor() {
    let place = Place::new();
    let recording = recorded(&place);
    with_a_fault(recording.as_ref(), &place.files().join("faulty.mcap"));
    let replay = place.start("replay faulty.mcap --rate 100 --loop --system faulty");
    for channel in ["mission", "faults"] {
        let echoed = loop {
            let echoed = place.run(&format!("echo {channel} --system faulty --count 2"));
            if echoed.code == Some(0) {
                break echoed;
            }
        };
        let lines: Vec<Value> = echoed.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        assert_eq!([&lines[0]["seq"], &lines[1]["seq"]], [1, 2], "{echoed}");
        assert_eq!(echoed.out.contains("by a test"), channel == "faults", "{echoed}");
    }
    replay.signal(Signal::SIGTERM);
    assert_eq!(replay.end().code, Some(3));
    // A live planner receives the orders that came before the start, and only the faults of its own system.
    fine(
        &place,
        "replay faulty.mcap --start 2 --end 4 --live planner,recorder --rate max --record part.mcap",
    );
    let info = fine(&place, "info part.mcap --json").json();
    let count = |topic: &str| {
        let topics = info["topics"].as_array().unwrap();
        topics.iter().find(|one| one["topic"] == topic).unwrap()["messages"].as_u64()
    };
    assert_eq!(["/mission", "/faults", "/scan", "/status"].map(count), [1, 0, 20, 20].map(Some), "{info:#}");
    assert_eq!(info["process_restarts"]["planner"].as_u64().unwrap_or(0), 0, "{info:#}");
}

/// The replay runs at full speed, over and over, with standard error in a file. In that case signals were once not
/// checked, and the replay could only be killed.
#[test]
fn a_replay_at_full_speed_ends_on_request() {
    let place = Place::new();
    let recording = recorded(&place);
    let replay = place.start(&format!("replay {recording} --rate max --loop --system endless"));
    let echoed = loop {
        let echoed = place.run("echo estimate --system endless --count 400");
        if echoed.code == Some(0) {
            break echoed;
        }
    };
    assert_eq!(echoed.out.lines().count(), 400);
    replay.signal(Signal::SIGTERM);
    let ended = replay.end();
    assert_eq!(ended.code, Some(3), "{ended}");
    assert!(place.ps().is_empty());
}

/// In the background of a shell, the replay used to configure the terminal for its keys, and was stopped because of
/// that.
#[test]
fn a_replay_in_the_background_continues() {
    let place = Place::new();
    let recording = recorded(&place);
    let terminal = openpty(None, None).unwrap();
    let replay = format!("{} replay {recording} --rate max", support::program().display());
    if !needs::has(&["setsid", "sh"]) {
        return;
    }
    let mut command = needs::program("setsid").unwrap();
    command.args(["--ctty", "--wait", "sh", "-c", &format!("set -m; {replay} & wait $!")]);
    place.settle(&mut command);
    command.stdin(terminal.slave);
    let ended = Running::spawn(command).end();
    assert_eq!(ended.code, Some(0), "{ended}");
}

/// The output used to be created before the input was read, so `-o` with the recording's own name destroyed the
/// recording.
#[test]
fn inputs_are_not_overwritten() {
    let place = Place::new();
    let recording = recorded(&place);
    let (same, page) = (place.files().join("same.mcap"), place.files().join("page.mcap"));
    std::fs::copy(&recording, &same).unwrap();
    std::fs::copy(&recording, &page).unwrap();
    fine(&place, "rerun same.mcap --process localizer -o same.mcap");
    fine(&place, &format!("diff {recording} same.mcap"));
    fine(&place, "filter same.mcap -o same.mcap");
    fine(&place, &format!("diff {recording} same.mcap"));
    for line in ["report page.mcap -o page.mcap", "judge page.mcap --csv page.mcap"] {
        assert_eq!(place.run(line).code, Some(2), "{line}");
    }
    assert_eq!(std::fs::read(&page).unwrap(), std::fs::read(&recording).unwrap());
    // Rerunning a damaged recording is bad input and leaves nothing behind.
    let mut broken = std::fs::read(&page).unwrap();
    let middle = broken.len() / 2;
    broken[middle..middle + 20_000].fill(0);
    std::fs::write(&page, broken).unwrap();
    let ended = place.run("rerun page.mcap --process localizer -o out.mcap");
    assert_eq!(ended.code, Some(2), "{ended}");
    assert!(!place.files().join("out.mcap").exists(), "{ended}");
}

/// The recordings of a mission's runs have the same name, each in its own folder, so their tables used to overwrite
/// each other. The parts of two splits also ended up in one folder.
#[test]
fn results_of_several_recordings_do_not_overwrite_each_other() {
    let place = Place::new();
    let recording = recorded(&place);
    for folder in ["run-001", "run-002"] {
        std::fs::create_dir(place.files().join(folder)).unwrap();
        std::fs::copy(&recording, place.files().join(folder).join("room.mcap")).unwrap();
    }
    let judged = fine(&place, "judge run-001/room.mcap run-002/room.mcap --csv csv --tum tum");
    let names = |folder: &str| {
        let files = std::fs::read_dir(place.files().join(folder)).unwrap();
        let mut names: Vec<_> = files.map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    };
    assert_eq!(names("csv"), ["run-001-room.csv", "run-002-room.csv"]);
    assert_eq!(names("tum").len(), 4);
    assert!(judged.out.contains("run-001-room") && judged.out.contains("run-002-room"), "{judged}");
    fine(&place, "split run-001/room.mcap --seconds 5 -o parts");
    let whole = names("parts");
    assert!(whole.iter().all(|name| name.starts_with("room_") && name.ends_with(".mcap")), "{whole:?}");
    let ended = place.run("split run-001/room.mcap --seconds 50 -o parts");
    assert_eq!((ended.code, names("parts")), (Some(1), whole), "{ended}");
}

#[test]
fn a_page_shows_the_run_and_is_self_contained() {
    let place = Place::new();
    let recording = recorded(&place);
    assert_eq!(fine(&place, &format!("report {recording} -o page.html --json")).json()["page"], "page.html");
    let page = std::fs::read_to_string(place.files().join("page.html")).unwrap();
    for word in ["tasks reached", "Error in local metres", "Local scales", "Latency and health", "<image"] {
        assert!(page.contains(word), "{word}");
    }
    let outside = ["src=", "@import", "url(", "<script", "href=\"http"];
    assert!(outside.iter().all(|reference| !page.contains(reference)));
}

/// Writes a map of four by four cells, and a log with one scan in it.
fn write_log(place: &Place, log: &str, map: &str) {
    let write = |name: &str, text: &[u8]| std::fs::write(place.files().join(name), text).unwrap();
    write("map.pgm", b"P5 4 4 255 \0\0\0\0\xff\xff\xff\xff\xff\xff\xff\xff\0\0\0\0");
    write(map, b"image: map.pgm\nresolution: 1.0\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n");
    write(log, b"FLASER 3 1.0 1.0 1.0 2 2 0 2 2 0 0.1 host 0.1\n");
}

/// The mission of a log used to be written as text with names quoted as in Rust. "\u{308}" is not valid TOML, so a decomposed "ü",
/// as in file names on macOS, was rejected.
#[test]
fn logs_and_maps_may_have_any_name() {
    let place = Place::new();
    let [log, map] = ["bu\u{308}ro.log", "bu\u{308}ro \"a\".yaml"];
    write_log(&place, log, map);
    let mut command = place.command("import -o log.mcap --map");
    command.arg(map).arg(log);
    let ended = Running::spawn(command).end();
    assert_eq!(ended.code, Some(0), "{ended}");
    let run = Recording::open(&place.files().join("log.mcap")).unwrap().run().unwrap();
    assert!(run.mission.world.map.unwrap().ends_with(map));
}

/// For invalid logs and options, the error gives the position of the mistake before anything is written.
#[test]
fn errors_about_logs_begin_with_the_file_name() {
    let place = Place::new();
    let write = |name: &str, text: &[u8]| std::fs::write(place.files().join(name), text).unwrap();
    write_log(&place, "good.log", "map.yaml");
    write("few.log", b"FLASER 180 1 2 3\n");
    write("empty.log", b"");
    write("cut.log.gz", b"\x1f\x8b");
    for name in ["few.log", "empty.log", "cut.log.gz", "."] {
        let ended = place.run(&format!("import {name} --map map.yaml -o log.mcap --json"));
        assert_eq!(ended.code, Some(2), "{name}: {ended}");
        assert!(ended.err.contains(&format!("error: {name}: ")), "{name}: {ended}");
    }
    for wrong in
        ["--range-max nan", "--range-max -5", "--set localizer.particles=0", "--set localizer.none=1", "-o ."]
    {
        let output = if wrong == "-o ." { "" } else { "-o log.mcap" };
        let ended = place.run(&format!("import good.log --map map.yaml {wrong} {output}"));
        assert_eq!(ended.code, Some(2), "{wrong}: {ended}");
    }
    assert!(!place.files().join("log.mcap").exists());
    fine(&place, "import good.log --map map.yaml -o log.mcap");
    // The log was not driven by a planner, so a planner that sends nothing would agree with it byte for byte.
    let ended = place.run("rerun log.mcap --process planner");
    assert_eq!(ended.code, Some(2), "{ended}");
    fine(&place, "rerun log.mcap --process localizer");
}

/// The trajectory errors agree with those that evo computes from the trajectories that the judge writes.
#[test]
fn trajectory_errors_agree_with_evo() {
    let Some(python) = needs::python("evo", "SKETCHNAV_PYTHON", "evo") else { return };
    let place = Place::new();
    let recording = recorded(&place);
    let judged = place.run(&format!("judge {recording} --tum tum --json")).json();
    let stem = Path::new(&recording).file_stem().unwrap().to_str().unwrap();
    let [truth, estimate] =
        ["truth", "estimate"].map(|what| place.files().join(format!("tum/{stem}.{what}.tum")));
    for (metric, options, figures) in
        [("ape", "--align", "absolute_m"), ("rpe", "--delta 10 --delta_unit f", "relative_m")]
    {
        let script = format!("from evo.cli.entry_points import {metric}; {metric}()");
        let result = place.files().join(format!("{metric}.zip"));
        let mut command = Command::new(&python);
        // evo keeps its settings in the home folder.
        command.env("HOME", place.files()).args(["-c", &script, "tum"]).args([&truth, &estimate]);
        command.args(options.split(' ')).arg("--save_results").arg(&result);
        let ended: Ended = command.output().unwrap().into();
        assert_eq!(ended.code, Some(0), "{ended}");
        let read = "import zipfile, sys; print(zipfile.ZipFile(sys.argv[1]).read('stats.json').decode())";
        let stats = Command::new(&python).args(["-c", read]).arg(&result).output().unwrap();
        let stats: Value = serde_json::from_slice(&stats.stdout).unwrap();
        for name in ["rmse", "mean", "median", "std", "min", "max"] {
            let (evo, ours) = (stats[name].as_f64().unwrap(), judged[0][figures][name].as_f64().unwrap());
            assert!((evo - ours).abs() < 1e-6, "{metric} {name}: evo {evo}, ours {ours}");
        }
    }
}

/// rosbags reads the parts in a rosbag2 folder, each of which contains the latched topics.
#[test]
fn rosbags_reads_our_rosbag2_folders() {
    let Some(python) = needs::python("rosbags", "SKETCHNAV_PYTHON", "rosbags") else { return };
    let place = Place::new();
    let recording = recorded(&place);
    fine(&place, &format!("split {recording} --seconds 5 --rosbag2 -o bag"));
    let script = "import sys\nfrom pathlib import Path\nfrom rosbags.rosbag2 import Reader\nwith Reader(Path(sys.argv[1])) as bag:\n    print(sum(1 for c, t, r in bag.messages() if c.topic == '/scan'))\n    print(sum(1 for c, t, r in bag.messages() if c.topic == '/sketch'))\n";
    let read: Ended =
        Command::new(python).args(["-c", script]).arg(place.files().join("bag")).output().unwrap().into();
    assert_eq!(read.code, Some(0), "{read}");
    let counts: Vec<u64> = read.out.lines().map(|line| line.parse().unwrap()).collect();
    let info = fine(&place, &format!("info {recording} --json")).json();
    let topics = info["topics"].as_array().unwrap();
    let scans = topics.iter().find(|topic| topic["topic"] == "/scan").unwrap()["messages"].as_u64();
    let parts = std::fs::read_dir(place.files().join("bag")).unwrap().count() as u64 - 1;
    assert_eq!((Some(counts[0]), counts[1]), (scans, parts));
}

/// On real logs with known maps, the localizer must stay within a cell of the reference.
#[test]
fn real_logs_are_localized_in_their_maps() {
    let Some(logs) = needs::data_file("logs") else { return };
    let data = logs.parent().unwrap();
    let place = Place::new();
    for name in ["freiburg-079", "intel"] {
        let log = data.join(format!("logs/{name}-corrected.log.gz"));
        let map = data.join(format!("maps/map_{name}.yaml"));
        fine(&place, &format!("import {} --map {} -o {name}.mcap", log.display(), map.display()));
        fine(&place, &format!("rerun {name}.mcap --process localizer -o located.mcap"));
        let judged = place.run("judge located.mcap --json").json();
        let median = judged[0]["unaligned_m"]["median"].as_f64().unwrap();
        assert!(median < 0.1, "{name}: {median} m");
    }
}

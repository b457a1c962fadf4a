//! The tools for recordings, as their users call them: on the recording of a real run, byte for byte, with
//! their exit codes.

mod support;

use std::path::{Path, PathBuf};
use std::process::Command;

use nix::sys::signal::Signal;
use serde_json::Value;
use support::{Ended, Place, repository, room};

/// A run of the test room in lockstep; the recording's path.
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

/// The recording of a run, its replay through live processes, and each service executed again agree. The
/// drawing and the floor are inside the recording: the files that the mission named are gone.
#[test]
fn a_run_its_replay_and_its_rerun_are_the_same_bytes() {
    let place = Place::new();
    let recording = recorded(&place);
    for name in [room::MISSION, room::DRAWING, room::FLOOR] {
        std::fs::remove_file(place.files().join(name)).unwrap();
    }
    for process in ["world", "sketcher", "localizer", "planner"] {
        let told = fine(&place, &format!("rerun {recording} --process {process} --json")).json();
        assert_eq!((&told["identical"], &told["difference"]), (&Value::Bool(true), &Value::Null));
        assert!(told["same"].as_u64() > Some(0) && told["same"] == told["recorded"], "{told}");
    }
    for live in ["localizer,planner", "sketcher,localizer,planner", "planner"] {
        fine(&place, &format!("replay {recording} --live {live},recorder --rate max --record again.mcap"));
        fine(&place, &format!("diff {recording} again.mcap"));
    }
    assert!(place.ps().is_empty());
}

#[test]
fn another_parameter_is_a_difference_that_is_named_and_judged() {
    let place = Place::new();
    let recording = recorded(&place);
    let ended =
        place.run(&format!("rerun {recording} --process localizer --set particles=200 --json -o now.mcap"));
    assert_eq!(ended.code, Some(1), "{ended}");
    let told = ended.json();
    let difference = &told["difference"];
    assert_eq!(
        (difference["channel"].as_str(), difference["seq"].as_u64()),
        (Some("estimate"), Some(1)),
        "{told}"
    );
    assert!(difference["what"]["field"]["a"].is_string(), "{told}");
    assert_eq!(told["judged"].as_array().map(Vec::len), Some(2));
    fine(&place, "info now.mcap");
    // Whatever differs, it is not that far apart.
    let all = [
        "pose",
        "covariance",
        "scale_a_pxpm",
        "scale_b_pxpm",
        "effective_sample_size",
        "fit",
        "particle_count",
    ];
    let tolerances: Vec<_> = all.iter().map(|field| format!("--tolerance estimate.{field}=1e9")).collect();
    let line =
        format!("rerun {recording} --process localizer --set particles=200 --json {}", tolerances.join(" "));
    let told = place.run(&line).json();
    // The samples of the particles, to which no tolerance belongs, are others by construction.
    assert_eq!(told["difference"]["channel"], "particles", "{told}");
    // One field whose tolerance is too small by far is a difference of that field.
    let told = place.run(&line.replace("scale_a_pxpm=1e9", "scale_a_pxpm=1e-9")).json();
    assert_eq!(told["difference"]["channel"], "estimate", "{told}");
    assert_eq!(told["difference"]["what"]["field"]["field"], "scale_a_pxpm", "{told}");
    for wrong in ["--set particlez=2", "--set particles=many", "--tolerance estimate=1"] {
        let ended = place.run(&format!("rerun {recording} --process localizer {wrong}"));
        assert_eq!(ended.code, Some(2), "{wrong}: {ended}");
    }
}

#[test]
fn the_tools_have_the_exit_codes_of_mcaps_own() {
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
    ] {
        assert_eq!(place.run(line).code, Some(code), "{line}");
    }
    assert!(place.files().join("saved.mcap").exists());
    assert!(
        !place.files().join("never.mcap").exists() && !place.files().join("never.mcap.unfinished").exists()
    );
    fine(&place, "filter same.mcap --topics scan --start 1 --end 2 -o scans.mcap");
    let info = fine(&place, "info scans.mcap --json").json();
    assert_eq!(info["messages"], 10, "{info}");
}

/// Without anything live it plays for who listens, over and over, until it is asked to end.
#[test]
fn a_replay_for_onlookers_leaves_nothing() {
    let place = Place::new();
    let recording = recorded(&place);
    let replay = place.start(&format!("replay {recording} --rate 100 --loop --system again"));
    let heard = loop {
        let heard = place.run("echo estimate --system again --count 400");
        if heard.code == Some(0) {
            break heard;
        }
    };
    // Numbers and stamps go on when it begins again.
    let lines: Vec<Value> = heard.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
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
        "--topics mission",
        "--topics estimate --live localizer",
        "--start 1000000 --loop",
        "--start 3 --end 2",
        "--start nan",
        &format!("--live localizer,recorder --record {recording}"),
    ] {
        let ended = place.run(&format!("replay {recording} {wrong}"));
        assert_eq!(ended.code, Some(2), "{wrong}: {ended}");
    }
}

/// As fast as it goes, over and over, with standard error in a file: nothing looked for signals then, and the
/// replay could only be killed.
#[test]
fn a_replay_at_full_speed_ends_when_asked_to() {
    let place = Place::new();
    let recording = recorded(&place);
    let replay = place.start(&format!("replay {recording} --rate max --loop --system endless"));
    let heard = loop {
        let heard = place.run("echo estimate --system endless --count 400");
        if heard.code == Some(0) {
            break heard;
        }
    };
    assert_eq!(heard.out.lines().count(), 400);
    replay.signal(Signal::SIGTERM);
    let ended = replay.end();
    assert_eq!(ended.code, Some(3), "{ended}");
    assert!(place.ps().is_empty());
}

/// The output was created before the input was read: `-o` with the recording's own name destroyed it.
#[test]
fn what_is_read_is_not_written_over() {
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
    // A rerun of a damaged recording is bad input, and leaves nothing.
    let mut broken = std::fs::read(&page).unwrap();
    let middle = broken.len() / 2;
    broken[middle..middle + 20_000].fill(0);
    std::fs::write(&page, broken).unwrap();
    let ended = place.run("rerun page.mcap --process localizer -o out.mcap");
    assert_eq!(ended.code, Some(2), "{ended}");
    assert!(!place.files().join("out.mcap").exists(), "{ended}");
}

/// The recordings of a mission's runs have one name, each in a folder of its own: their tables overwrote each
/// other. And parts of two splits lay in one folder.
#[test]
fn of_several_recordings_none_takes_anothers_place() {
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
fn a_page_shows_the_run_and_needs_no_other_file() {
    let place = Place::new();
    let recording = recorded(&place);
    fine(&place, &format!("report {recording} -o page.html"));
    let page = std::fs::read_to_string(place.files().join("page.html")).unwrap();
    for word in ["tasks reached", "Error in local metres", "Local scales", "Latency and health", "<image"] {
        assert!(page.contains(word), "{word}");
    }
    let outside = ["src=", "@import", "url(", "<script", "href=\"http"];
    assert!(outside.iter().all(|reference| !page.contains(reference)));
}

fn python(modules: &str) -> Option<PathBuf> {
    let python = std::env::var_os("SKETCHNAV_PYTHON").map_or_else(|| "python3".into(), PathBuf::from);
    let found = Command::new(&python).args(["-c", &format!("import {modules}")]).output();
    found.is_ok_and(|output| output.status.success()).then_some(python)
}

/// The trajectory errors are those of evo, run as a program on the trajectories that the judge writes.
#[test]
fn trajectory_errors_agree_with_evo() {
    let Some(python) = python("evo") else {
        eprintln!("skipped: no Python with evo 1.38 (SKETCHNAV_PYTHON)");
        return;
    };
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
        // evo keeps settings in the home folder.
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

/// Parts in a folder as rosbag2 has it are read by rosbags, with the latched topics in each.
#[test]
fn a_folder_of_rosbag2_is_read_by_rosbags() {
    let Some(python) = python("rosbags") else {
        eprintln!("skipped: no Python with rosbags 0.11.9 (SKETCHNAV_PYTHON)");
        return;
    };
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

/// Real logs: where the map is known the localizer stays within a cell of the reference.
#[test]
fn real_logs_are_localized_in_their_maps() {
    let data = repository().join("../shared/data");
    if !data.join("logs").is_dir() {
        eprintln!("skipped: no logs in {}", data.display());
        return;
    }
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

//! Runs and recordings must be safe for their users. No file outside of a recording is read, nothing in a recording
//! controls the terminal, and a run that was interrupted at its very end can be completed.

use std::fs;
use std::path::Path;

use sketchnav_recordings::reader::Selection;
use sketchnav_recordings::{Recording, Writer};
use sketchnav_schemas::run::RunConfig;
use support::{Ended, Place, room};

/// Runs the test room and returns its recording.
fn recorded(place: &Place) -> String {
    room::write(place.files());
    place.driven("room.toml")
}

/// Writes the recording as an attacker could have forged it, with a changed run and without files.
fn forged(recording: &str, forged: &Path, change: impl FnOnce(&mut RunConfig)) {
    let recording = Recording::open(recording.as_ref()).unwrap();
    let mut run = recording.run().unwrap();
    change(&mut run);
    sketchnav_navigators::register(&[]).unwrap();
    let mut writer = Writer::create(fs::File::create(forged).unwrap(), &run).unwrap();
    for message in recording.timeline(Selection::default()).unwrap() {
        writer.write_raw(&message.unwrap()).unwrap();
    }
    writer.finish().unwrap();
}

/// `replay` used to copy the files that a forged recording names into another recording, and `rerun` printed their
/// first bytes.
#[test]
fn a_foreign_recording_gets_no_file_of_the_user() {
    const SECRET: &str = "BEGIN OPENSSH PRIVATE KEY";
    let place = Place::new();
    let recording = recorded(&place);
    let secret = place.files().join("id_rsa");
    fs::write(&secret, SECRET).unwrap();
    let path = secret.to_str().unwrap().to_owned();
    forged(&recording, &place.files().join("evil.mcap"), |run| {
        run.mission.navigator.given.insert("drawing".into(), path.clone().into());
        run.mission.world.floor_plan = Some(path.clone());
    });
    for command in [
        "rerun evil.mcap --process sketcher",
        "rerun evil.mcap --process world -o again.mcap",
        "replay evil.mcap --live localizer,planner,recorder --rate max --record again.mcap",
        "replay evil.mcap --live sketcher",
    ] {
        let ended = place.run(command);
        assert_eq!(ended.code, Some(2), "{command}: {ended}");
        assert!(ended.err.contains("evil.mcap") && ended.err.contains(&path), "{command}: {ended}");
        assert!(!ended.err.contains(SECRET) && !ended.out.contains(SECRET), "{command}: {ended}");
        assert!(!place.files().join("again.mcap").exists(), "{command}");
    }
    // Commands that need no file of the run continue without the files, and report this.
    place.fine("replay evil.mcap --rate max");
    place.fine("judge evil.mcap");
    place.page_says("evil.mcap", &["The world is not drawn", "nothing outside a recording is read"]);
}

fn is_tame(ended: &Ended, what: &str) {
    let is_wild = |c: char| (c.is_control() && c != '\n') || matches!(c, '\u{200b}' | '\u{202e}');
    assert!(!ended.out.contains(is_wild) && !ended.err.contains(is_wild), "{what}: {ended}");
    assert!(!format!("{}\n{}", ended.out, ended.err).contains("\nforged"), "{what}: {ended}");
}

/// An error about an escape sequence used to send that sequence to the terminal, and names in recordings got there
/// unfiltered.
#[test]
fn no_text_from_outside_controls_the_terminal() {
    const WILD: &str = "\u{1b}]0;x\u{7}\u{1b}[31m\u{9b}2J\u{202e}\u{200b}\nforged: 9 of 9 tasks reached";
    let place = Place::new();
    let recording = recorded(&place);
    forged(&recording, &place.files().join("wild.mcap"), |run| {
        run.mission.name = format!("wild{WILD}");
        run.mission.task[0].name = format!("task{WILD}");
        run.mission.navigator.given.insert("drawing".into(), format!("/x/{WILD}.svg").into());
        run.robot.name = WILD.into();
    });
    let tools = [
        "info",
        "judge",
        "report -o page.html",
        "rerun --process sketcher",
        "replay --rate max --live sketcher",
    ];
    for tool in tools {
        is_tame(&place.run(&format!("{tool} wild.mcap")), tool);
    }
    let page = fs::read_to_string(place.files().join("page.html")).unwrap();
    assert!(
        page.contains("\\u001b[31m") && !page.contains(['\u{1b}', '\u{9b}', '\u{202e}', '\u{200b}']),
        "{page:.2000}"
    );
    // The names of files, and the keys and names in a mission.
    let mission = fs::read_to_string(place.files().join(room::MISSION)).unwrap();
    let key = WILD.escape_default().to_string().replace("\\u{1b}", "\\u001b").replace("\\u{7}", "\\u0007");
    let key =
        key.replace("\\u{9b}", "\\u009b").replace("\\u{202e}", "\\u202e").replace("\\u{200b}", "\\u200b");
    for (name, text) in [
        (WILD.to_owned(), mission.clone()),
        ("key.toml".to_owned(), format!("\"{key}\" = 1\n{mission}")),
        ("name.toml".to_owned(), mission.replacen("name = \"", &format!("name = \"{key}"), 1)),
        (format!("broken{WILD}.toml"), format!("\u{1b}[31m = = \n{mission}")),
    ] {
        fs::write(place.files().join(&name), text).unwrap();
        for command in ["run", "info", "judge", "no-such-command"] {
            let mut line = place.command(command);
            line.arg(&name);
            let ended = support::Running::spawn(line).end();
            // A mission may have any name.
            let code = if command == "run" && name == WILD { 0 } else { 2 };
            assert_eq!(ended.code, Some(code), "{name:?}: {ended}");
            is_tame(&ended, &name);
        }
    }
}

/// If the supervisor was killed between the end of its system and its report, there used to be neither a table nor
/// pictures, and nothing to resume.
#[test]
fn an_unfinished_end_of_a_run_is_completed_by_resuming() {
    let place = Place::new();
    let recording = recorded(&place);
    let folder = Path::new(&recording).parent().unwrap();
    let pictures = || {
        fs::read_dir(folder).unwrap().filter(|entry| {
            entry.as_ref().unwrap().path().extension().is_some_and(|extension| extension == "svg")
        })
    };
    let drawn = pictures().count();
    pictures().for_each(|entry| fs::remove_file(entry.unwrap().path()).unwrap());
    let report = place.fine(&format!("run --json --resume {}", folder.display())).json();
    assert_eq!((&report["success"], pictures().count()), (&true.into(), drawn), "{report:#}");
    let output = place.fine(&format!("run --resume {}", folder.display()));
    assert!(
        output.out.contains("1 of 1 tasks reached") && output.err.contains("the mission had ended"),
        "{output}"
    );
}

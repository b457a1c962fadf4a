//! Real processes on real shared memory.
//!
//! A test starts this same binary again as actors and talks to them line by line. Orders go to an actor's standard input, and
//! answers come from its standard output. Each test has its own root, so the tests do not affect each other either.

mod actor;
mod hosted;
mod stage;

use std::collections::BTreeMap;
use std::fs::OpenOptions;
use std::os::unix::fs::OpenOptionsExt;
use std::path::PathBuf;

use sketchnav_runtime::CountingAllocator;
use sketchnav_schemas::codes::Process;
use stage::Stage;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

#[test]
fn a_message_passes_between_processes() {
    let stage = Stage::new();
    let mut supervisor = stage.system("round-trip");
    let mut reader = stage.join("round-trip", Process::Planner, &["scan-reader"]);
    let mut writer = stage.join("round-trip", Process::World, &["scan-writer"]);
    reader.begin("until 3");
    assert_eq!(writer.tell("send 3"), "3");
    assert_eq!(reader.answer(), "3");
    assert_eq!(reader.tell("receive"), "0..0 0 lost 0");
    writer.does("leave");
    reader.does("leave");
    supervisor.does("remove");
    assert_eq!(stage.leftovers("round-trip"), Vec::<String>::new());
}

#[test]
fn a_message_is_read_where_it_was_written() {
    let stage = Stage::new();
    let _supervisor = stage.system("zero-copy");
    let mut writer = stage.join("zero-copy", Process::World, &["scan-writer"]);
    let mut reader = stage.join("zero-copy", Process::Localizer, &["scan-reader"]);
    let mut recorder = stage.join("zero-copy", Process::Recorder, &["scan-reader"]);
    let mut places = Vec::new();
    for _ in 0..3 {
        let place = writer.tell("loan");
        assert!(place.contains(" /dev/shm/sketchnav_zero-copy_"), "{place}");
        assert_eq!((reader.tell("hold"), recorder.tell("hold")), (place.clone(), place.clone()));
        places.push(place);
    }
    places.dedup();
    assert_eq!(places.len(), 3, "each message has a place of its own");
}

#[test]
fn a_sketch_is_read_where_it_was_written() {
    let stage = Stage::new();
    let _supervisor = stage.system("zero-copy-slice");
    let mut writer = stage.join("zero-copy-slice", Process::Sketcher, &["sketch-writer"]);
    let mut reader = stage.join("zero-copy-slice", Process::Localizer, &["sketch-reader"]);
    let place = writer.tell("sketch");
    assert!(place.contains(" /dev/shm/sketchnav_zero-copy-slice_"), "{place}");
    assert_eq!(reader.tell("hold-sketch"), place);
}

/// Regression test: eight observers took all places of a channel. A killed recorder could not come back, which ended the
/// mission.
#[test]
fn observers_take_no_readers_place() {
    let stage = Stage::new();
    let _supervisor = stage.system("crowd");
    let join = || stage.join("crowd", Process::Observer, &[]);
    let mut observers: Vec<_> = (0..7).map(|_| join()).collect();
    let answers: Vec<_> = observers.iter_mut().map(|observer| observer.tell("open scan-reader")).collect();
    let refused = "error channel \"scan\" of system \"crowd\": 5 observers read it already, which is the maximum; end one of them \
                   (echo, hz, top) and try again";
    assert_eq!(answers, ["done", "done", "done", "done", "done", refused, refused]);
    for process in [Process::Localizer, Process::Planner, Process::Recorder] {
        let mut reader = stage.join("crowd", process, &[]);
        reader.does("open scan-reader");
        reader.kill();
    }
    // The slot of a killed observer is free again.
    observers[0].kill();
    observers[6].does("open scan-reader");
}

/// Regression test: as root, with `fs.protected_symlinks` off, a link among the files of a system used to make it overwrite an
/// unrelated file.
#[test]
fn a_link_among_the_files_of_a_system_is_reported_and_not_followed() {
    let stage = Stage::new();
    let mut supervisor = stage.system("intruder");
    let victim = stage.folder().join("victim");
    std::fs::write(&victim, "precious").unwrap();
    let owner = stage.shared_memory("intruder", "_owner").remove(0);
    let place = |name: &str| PathBuf::from(owner.to_str().unwrap().replace("_owner", &format!("_{name}")));
    let link = place("checkpoint_localizer_0");
    std::os::unix::fs::symlink(&victim, &link).unwrap();
    let expected = format!("{}: expected a regular file owned by user", link.display());
    let complaint = supervisor.tell("complaint");
    assert!(complaint.starts_with(&expected) && complaint.contains("found a link"), "{complaint}");
    let mut localizer = stage.player();
    let refused = localizer.tell("join intruder localizer");
    assert!(refused.starts_with(&format!("error {expected}")), "{refused}");
    assert_eq!(std::fs::read_to_string(&victim).unwrap(), "precious");
    supervisor.does("remove");
    std::fs::remove_file(&victim).unwrap();
    assert_eq!(stage.leftovers("intruder"), Vec::<String>::new());
}

/// Returns the path of the next file of a system that only has its first one.
fn next_file(stage: &Stage, system: &str) -> PathBuf {
    // All tests share the names in `/dev/shm`.
    let other = format!("{system}-before");
    let mut supervisor = stage.system(&other);
    let path = stage.shared_memory(&other, ".global_mgmt").remove(0).display().to_string();
    supervisor.does("remove");
    let (_, name) = path.split_once("-before_").and_then(|(_, rest)| rest.split_once('_')).unwrap();
    let owner = stage.shared_memory(system, "_owner").remove(0).display().to_string();
    PathBuf::from(owner.replace("_owner", &format!("_{name}")))
}

/// Regression test: a process that saw the first file of a system could create the next one, and the only error was
/// "UnableToGenerateUniqueNodeId".
#[test]
fn a_link_that_blocks_a_start_is_reported() {
    let stage = Stage::new();
    let mut supervisor = stage.player();
    supervisor.does("create-without-joining linked");
    let link = next_file(&stage, "linked");
    std::os::unix::fs::symlink("/nowhere", &link).unwrap();
    let answer = supervisor.tell("join linked supervisor");
    assert!(
        answer.starts_with(&format!("error {}: expected a regular file owned by user", link.display())),
        "{answer}"
    );
    supervisor.does("remove");
    assert_eq!(stage.leftovers("linked"), Vec::<String>::new());
}

/// As root, iceoryx2 0.10 waits forever, silently, for another user to fill a file that it needs itself.
#[test]
fn another_users_file_blocks_the_start() {
    if !nix::unistd::getuid().is_root() {
        println!("notice: skipped, because this user cannot create files of another one");
        return;
    }
    let stage = Stage::new();
    let mut supervisor = stage.player();
    supervisor.does("create-without-joining late");
    let file = next_file(&stage, "late");
    std::fs::write(&file, "").unwrap();
    std::os::unix::fs::chown(&file, Some(65534), Some(65534)).unwrap();
    supervisor.begin("join late supervisor");
    assert_eq!(supervisor.exit_code(), Some(3));
    std::fs::remove_file(&file).unwrap();
    assert_eq!(stage.leftovers("late"), Vec::<String>::new());
}

/// Regression test: a writer whose history had lost its pages used to be killed by SIGBUS, without a message.
#[test]
fn a_writer_with_a_truncated_history_exits_with_a_code() {
    let stage = Stage::new();
    let _supervisor = stage.system("cut");
    let mut world = stage.join("cut", Process::World, &["scan-writer"]);
    world.does_as("send 1", "1");
    let mut files = stage.shared_memory("cut", "");
    files.retain(|path| path.to_string_lossy().contains("_history_scan_"));
    assert_eq!(files.len(), 1, "{files:?}");
    OpenOptions::new().write(true).open(&files[0]).unwrap().set_len(0).unwrap();
    world.begin("send 1");
    assert_eq!(world.exit_code(), Some(3));
}

#[test]
fn sending_and_receiving_allocate_nothing() {
    let stage = Stage::new();
    let _supervisor = stage.system("allocations");
    let mut writer = stage.join("allocations", Process::World, &["scan-writer"]);
    let mut reader = stage.join("allocations", Process::Localizer, &["scan-reader"]);
    // The first message connects the writer and the reader.
    writer.tell("send 1");
    assert_eq!(reader.tell("until 1"), "1");
    reader.begin("count-receiving");
    // There are two messages per round: the scan and the health.
    assert_eq!(writer.tell("count-sending"), "0 and 2000 handles");
    assert_eq!(reader.answer(), "0");
}

#[test]
fn two_systems_side_by_side_do_not_see_each_other() {
    let stage = Stage::new();
    let mut one = stage.system("side-1");
    let mut two = stage.system("side-2");
    let mut writer = stage.join("side-1", Process::World, &["scan-writer"]);
    let mut near = stage.join("side-1", Process::Planner, &["scan-reader"]);
    let mut far = stage.join("side-2", Process::Planner, &["scan-reader"]);
    writer.tell("send 2");
    assert_eq!(near.tell("receive"), "1..2 2 lost 0");
    assert_eq!(far.tell("receive"), "0..0 0 lost 0");
    assert_eq!(one.tell("list"), "side-1 side-2");
    assert!(two.tell("create side-1").contains("is running already"));
    for player in [&mut writer, &mut near] {
        player.does("leave");
    }
    one.does("remove");
    assert_eq!(two.tell("list"), "side-2");
    assert!(stage.leftovers("side-1").iter().all(|name| name == "side-2"));
}

#[test]
fn a_second_writer_is_refused() {
    let stage = Stage::new();
    let _supervisor = stage.system("second");
    let mut writer = stage.join("second", Process::World, &["scan-writer"]);
    let pid = writer.child.id();
    let answer = writer.tell("open second-scan-writer");
    let expected = format!(
        "channel \"scan\" of system \"second\" takes one writer and has one already: world, process {pid}"
    );
    assert_eq!(answer, format!("error {expected}"));
    let mut twin = stage.player();
    let answer = twin.tell("join second world");
    assert_eq!(
        answer,
        format!("error world of system \"second\" is already running as process {pid}; end that one first")
    );
    writer.kill();
    twin.does("join second world");
    twin.does("open scan-writer");
    assert_eq!(twin.tell("send 1"), "1");
}

#[test]
fn no_navigator_opens_the_truth() {
    let stage = Stage::new();
    let _supervisor = stage.system("truth");
    for navigator in [Process::Sketcher, Process::Localizer, Process::Planner] {
        let answer = stage.join("truth", navigator, &[]).tell("open truth-reader");
        let expected = "may not read channel \"truth\"; the table of channels allows recorder, observer";
        assert_eq!(answer, format!("error {navigator} {expected}"));
    }
    stage.join("truth", Process::Recorder, &["truth-reader"]);
    let answer = stage.join("truth", Process::Planner, &[]).tell("open scan-writer");
    assert_eq!(answer, "error planner may not write channel \"scan\"; the table of channels allows world");
}

#[test]
fn a_system_that_is_not_running_is_reported() {
    let stage = Stage::new();
    let _supervisor = stage.system("here");
    let answer = stage.player().tell("join there planner");
    assert!(
        answer.contains("system \"there\" is not running (running: here); `sketchnav run` starts one"),
        "{answer}"
    );
}

#[test]
fn leftovers_of_a_killed_system_are_removed() {
    let stage = Stage::new();
    let mut supervisor = stage.system("swept");
    let mut writer = stage.join("swept", Process::World, &["scan-writer"]);
    let mut reader = stage.join("swept", Process::Planner, &["scan-reader"]);
    writer.tell("send 5");
    reader.tell("hold");
    supervisor.kill();
    assert!(stage.leftovers("swept").len() > 3, "the test needs something to sweep");
    let mut other = stage.player();
    assert_eq!(other.tell("list"), "");
    assert!(other.tell("join swept planner").contains("is not running"));
    assert_eq!(other.tell("sweep"), "swept");
    assert_eq!(stage.leftovers("swept"), Vec::<String>::new());
    for mut player in [writer, reader] {
        assert!(!player.child.wait().unwrap().success(), "a process of the dead system lives");
    }
}

#[test]
fn a_new_system_replaces_a_killed_one() {
    let stage = Stage::new();
    stage.system("again").kill();
    let mut supervisor = stage.system("again");
    let mut writer = stage.join("again", Process::World, &["scan-writer"]);
    assert_eq!(writer.tell("send 1"), "1");
    writer.does("leave");
    supervisor.does("remove");
    assert_eq!(stage.leftovers("again"), Vec::<String>::new());
}

#[test]
fn history_reaches_a_late_reader() {
    let stage = Stage::new();
    let _supervisor = stage.system("late");
    let mut writer = stage.join("late", Process::World, &["scan-writer"]);
    writer.tell("send 100");
    // The writer sleeps until a reader joins; the reader sleeps until it has been served.
    writer.begin("wait");
    let mut reader = stage.join("late", Process::Planner, &["scan-reader"]);
    reader.begin("until 100");
    assert_eq!(writer.answer(), "Message");
    writer.tell("refresh");
    assert_eq!(reader.answer(), "100");
}

#[test]
fn lost_messages_are_counted() {
    let stage = Stage::new();
    let _supervisor = stage.system("lost");
    let mut writer = stage.join("lost", Process::World, &["scan-writer"]);
    let mut reader = stage.join("lost", Process::Planner, &["scan-reader"]);
    writer.tell("send 10");
    assert_eq!(reader.tell("receive"), "1..10 10 lost 0");
    writer.tell("send 200");
    assert_eq!(reader.tell("receive"), "83..210 128 lost 72");
}

#[test]
fn a_dead_reader_blocks_no_writer() {
    let stage = Stage::new();
    let _supervisor = stage.system("dead-reader");
    let mut writer = stage.join("dead-reader", Process::World, &["scan-writer"]);
    let mut dead = stage.join("dead-reader", Process::Localizer, &["scan-reader"]);
    let mut alive = stage.join("dead-reader", Process::Planner, &["scan-reader"]);
    writer.tell("send 1");
    dead.tell("hold");
    dead.kill();
    assert_eq!(writer.tell("send 100"), "101");
    assert_eq!(alive.tell("receive"), "1..101 101 lost 0");
}

/// As root, iceoryx2 0.10 waits forever for the maker of an empty connection.
#[test]
fn a_reader_killed_while_connecting_blocks_no_process() {
    let stage = Stage::new();
    let mut supervisor = stage.system("half-made");
    let mut writer = stage.join("half-made", Process::World, &["scan-writer"]);
    let mut dead = stage.join("half-made", Process::Localizer, &["scan-reader"]);
    writer.tell("send 1");
    assert_eq!(dead.tell("receive"), "1..1 1 lost 0");
    let connections = stage.shared_memory("half-made", ".connection");
    assert!(!connections.is_empty());
    dead.kill();
    for path in &connections {
        std::fs::remove_file(path).unwrap();
        OpenOptions::new().write(true).create_new(true).mode(0o200).open(path).unwrap();
    }
    supervisor.does("clear-dead");
    assert_eq!(stage.shared_memory("half-made", ".connection"), Vec::<PathBuf>::new());
    let mut successor = stage.join("half-made", Process::Localizer, &["scan-reader"]);
    assert_eq!(writer.tell("send 2"), "3");
    assert_eq!(successor.tell("until 3"), "3");
    for player in [&mut writer, &mut successor] {
        player.does("leave");
    }
    supervisor.does("remove");
    assert_eq!(stage.leftovers("half-made"), Vec::<String>::new());
}

#[test]
fn a_request_to_end_wakes_a_sleeper() {
    let stage = Stage::new();
    let _supervisor = stage.system("signal");
    for signal in ["TERM", "INT", "HUP"] {
        let mut sleeper = stage.join("signal", Process::Planner, &["scan-reader"]);
        sleeper.begin("wait");
        for signal in ["STOP", "CONT", signal] {
            let pid = sleeper.child.id().to_string();
            let Some(mut kill) = needs::program("kill") else { return };
            assert!(kill.args([&format!("-{signal}"), &pid]).status().unwrap().success());
        }
        assert_eq!(sleeper.answer(), "Terminate");
        assert_eq!(sleeper.tell("wait"), "Terminate");
    }
}

/// Regression test: when a process was asked to end while it was joining, the signal rang its bell before the process first
/// looked at it. The process took the ring for an old one and slept for good. On a loaded machine, one in five systems that
/// were interrupted right after their start hung.
#[test]
fn a_request_to_end_before_joining_is_honoured() {
    let stage = Stage::new();
    let _supervisor = stage.system("early-signal");
    let mut player = stage.player();
    player.does("be-asked-to-end");
    player.does("join early-signal planner");
    assert_eq!(player.tell("wait"), "Terminate");
}

#[test]
fn every_channel_can_be_opened_as_the_table_says() {
    let mut names = BTreeMap::new();
    sketchnav_navigators::register(&[]).unwrap();
    for spec in sketchnav_schemas::channels::all() {
        assert!(spec.history() <= spec.buffer(), "{}: a reader takes the whole history at once", spec.name);
        assert!(names.insert(spec.name, spec).is_none());
    }
}

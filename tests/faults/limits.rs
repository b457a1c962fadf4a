//! Limits that a shell sets (`ulimit`). A soft limit that is too low is raised. If a hard limit is too low, the error states what
//! is needed.

use support::{Ended, Place, Running, room};

/// Runs `sketchnav` with limits set by the shell.
fn limited(place: &Place, limits: &str, arguments: &str) -> Ended {
    let mut command = needs::program("bash").expect("bash, which was there before");
    command.args(["-c", &format!("{limits}; exec \"$0\" \"$@\"")]).arg(place.command("").get_program());
    command.args(arguments.split_whitespace());
    place.settle(&mut command);
    Running::spawn(command).end()
}

/// With a limit of 64 open files, the error used to refer to `/dev/shm` or came from the shared memory library. With 64 KiB of
/// stack, the program overflowed its stack.
#[test]
fn a_limit_that_is_too_low_is_raised_or_reported() {
    if !needs::has(&["bash"]) {
        return;
    }
    let place = Place::new();
    room::write(place.files());
    let run = "run room.toml --out out --json --system limited";
    let ended = limited(&place, "ulimit -S -n 64; ulimit -S -s 64", run);
    assert_eq!(ended.code, Some(0), "{ended}");
    let recording = ended.json()["recording"].as_str().unwrap().to_owned();
    for (limits, words) in [
        ("ulimit -n 64", "expected a limit of 256 open files or more for a process, found 64: ulimit -n 256"),
        ("ulimit -s 64", "expected a limit of 2048 KiB or more on the stack, found 64 KiB: ulimit -s 2048"),
    ] {
        let ended = limited(&place, limits, run);
        assert!(ended.code == Some(3) && ended.err.contains(words), "{limits}: {ended}");
        place.assert_nothing_left("limited");
    }
    // Commands that need no system need few files.
    let ended = limited(&place, "ulimit -n 64", &format!("info {recording}"));
    assert_eq!(ended.code, Some(0), "{ended}");
    assert_eq!(limited(&place, "ulimit -n 256; ulimit -s 2048", run).code, Some(0));
}

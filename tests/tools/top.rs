//! Tests of `sketchnav top` for programs, which prints the state of a running system at one time.

use nix::sys::signal::Signal;
use serde_json::Value;
use support::{Place, kill_if_alive, send, wait_until};

fn top(place: &Place) -> Value {
    let ended = place.run("top --json --system seen");
    assert_eq!(ended.code, Some(0), "{ended}");
    ended.json()
}

fn rows(snapshot: &Value) -> &[Value] {
    snapshot["processes"].as_array().unwrap()
}

fn row<'a>(snapshot: &'a Value, process: &str) -> &'a Value {
    rows(snapshot).iter().find(|row| row["process"] == process).unwrap_or_else(|| panic!("{snapshot:#}"))
}

#[test]
fn json_shows_the_progress_of_the_processes() {
    let place = Place::new();
    let mut running = place.start("demo --json --system seen --speed 5");
    place.wait_until_driving(&mut running, "seen");
    let snapshot = top(&place);
    assert_eq!((&snapshot["system"], &snapshot["mission"]), (&"seen".into(), &"building-a".into()));
    for process in ["world", "localizer", "planner"] {
        let row = row(&snapshot, process);
        assert_eq!(row["pid"], place.pid("seen", process), "{row:#}");
        assert!(row["rate_hz"].as_f64().unwrap() > 0.0 && row["age_ms"].is_number(), "{row:#}");
        assert_eq!(row["restarts"], 0, "{row:#}");
    }
    assert!(row(&snapshot, "planner")["queue"].is_u64(), "{snapshot:#}");
    assert!(!rows(&snapshot).iter().any(|row| row["process"] == "pad"), "{snapshot:#}");

    let first = place.pid("seen", "localizer");
    kill_if_alive(first);
    place.wait_until_joined(&mut running, "seen", &support::SERVICES);
    send(place.serving("seen", "sketcher")[0], Signal::SIGSTOP);
    let snapshot = top(&place);
    let localizer = row(&snapshot, "localizer");
    assert!(localizer["restarts"] == 1 && localizer["pid"] != first, "{snapshot:#}");
    // The supervisor may already have restarted the stopped process.
    let sketcher = row(&snapshot, "sketcher");
    assert!(sketcher["state"] == "stopped" || sketcher["restarts"] == 1, "{snapshot:#}");
    let output = snapshot["faults"].as_array().unwrap().iter();
    assert!(
        output.into_iter().any(|fault| fault.as_str().unwrap().contains("localizer died")),
        "{snapshot:#}"
    );
    running.signal(Signal::SIGINT);
    running.end();
    place.assert_nothing_left("seen");
}

/// The pad used to have no row, so it could be neither watched nor killed, not even in its own systems.
#[test]
fn json_shows_the_progress_of_the_pad() {
    let place = Place::new();
    let mut running = place.start("demo --json --pad --port 0 --system seen --speed 5");
    place.wait_until_driving(&mut running, "seen");
    place.wait_until_joined(&mut running, "seen", &["pad"]);
    let first = place.pid("seen", "pad");
    let snapshot = top(&place);
    assert_eq!(row(&snapshot, "pad")["pid"], first, "{snapshot:#}");
    kill_if_alive(first);
    wait_until("another pad", || row(&top(&place), "pad")["restarts"] == 1);
    running.signal(Signal::SIGINT);
    running.end();
    place.assert_nothing_left("seen");
}

#[test]
fn a_screen_needs_a_terminal_and_a_system() {
    let place = Place::new();
    let nothing = place.run("top --json");
    assert_eq!(nothing.code, Some(2), "{nothing}");
    assert!(nothing.out.contains("no system is running"), "{nothing}");
    let mut running = place.start("demo --json --system seen --speed 5");
    place.wait_until_driving(&mut running, "seen");
    let once = place.run("top --once");
    assert!(once.out.contains("seen: building-a") && once.out.contains("localizer"), "{once}");
    let screen = place.run("top");
    assert_eq!(screen.code, Some(2), "{screen}");
    assert!(screen.err.contains("expected a terminal"), "{screen}");
    running.signal(Signal::SIGINT);
    running.end();
}

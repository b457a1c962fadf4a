//! Planned faults. Each fault happens once, at its message, and happens again when the plan is played again.

use serde_json::Value;
use support::Place;

/// Writes a plan. Each fault is given as `channel message do`.
fn plan(place: &Place, name: &str, faults: &[&str]) {
    let fault = |words: &&str| {
        let [channel, message, action] = words.split(' ').collect::<Vec<_>>()[..] else { panic!("{words}") };
        let more = match action {
            "delay" => "delay_ms = 300\n",
            "starve" => "share = 0.05\nduration_ms = 1500\n",
            _ => "",
        };
        format!("[[fault]]\nchannel = \"{channel}\"\nmessage = {message}\ndo = \"{action}\"\n{more}\n")
    };
    std::fs::write(place.files().join(name), faults.iter().map(fault).collect::<String>()).unwrap();
}

fn recording(report: &Value) -> &str {
    report["recording"].as_str().unwrap()
}

/// Returns the faults that the plan caused, as described on the channel `faults`, in order.
fn happened(place: &Place, report: &Value) -> Vec<String> {
    let info = place.fine(&format!("info {} --json", recording(report))).json();
    let faults = info["faults"].as_array().unwrap().iter();
    let planned = faults.filter(|fault| fault["kind"] == "injected");
    planned.map(|fault| fault["words"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn faults_hit_before_the_planned_messages_and_lose_nothing() {
    let place = Place::new();
    let (calm, _) = place.mission("run demo --out calm", "calm");
    plan(
        &place,
        "plan.toml",
        &[
            "route 1 kill",
            "estimate 40 kill",
            "estimate 90 corrupt-checkpoint",
            "tick 100 kill",
            "status 120 kill",
            "status 120 kill",
            "status 150 term",
            "latency 60 kill",
            "estimate 999999 kill",
        ],
    );
    let (report, code) = place.mission("run demo --faults plan.toml --out hit", "hit");
    assert_eq!((code, &report["lost_messages"]), (0, &0.into()), "{report:#}");
    // A plan with a typo used to look as if the robot had survived its faults.
    let outstanding = serde_json::json!([{ "number": 9, "words": "kill at estimate 999999" }]);
    assert_eq!(report["outstanding_faults"], outstanding);
    place.fine(&format!("diff {} {}", recording(&calm), recording(&report)));
    let mut words = happened(&place, &report);
    words.sort();
    let mut expected: Vec<_> = [
        (1, "kill", "route 1"),
        (2, "kill", "estimate 40"),
        (3, "corrupt-checkpoint", "estimate 90"),
        (4, "kill", "tick 100"),
        (5, "kill", "status 120"),
        (6, "kill", "status 120"),
        (7, "term", "status 150"),
        (8, "kill", "latency 60"),
    ]
    .map(|(number, action, at)| format!("fault {number} of the plan: {action} at {at}"))
    .into();
    expected.sort();
    assert_eq!(words, expected);
    // The faults must not happen again when the recording is replayed.
    place.fine(&format!(
        "replay {} --live localizer,planner,recorder --rate max --record again.mcap",
        recording(&report)
    ));
    place.fine(&format!("diff {} again.mcap", recording(&report)));
    place.assert_nothing_left("hit");
}

/// The other processes wait for a process that gets little processor time. That process is not killed, although the
/// limit for stopped processes is shorter than the starvation.
#[test]
fn a_starved_process_is_only_slower_in_lockstep() {
    let place = Place::new();
    let (calm, _) = place.mission("run demo --out calm", "calm");
    plan(
        &place,
        "plan.toml",
        &[
            "route 1 starve",
            "estimate 40 starve",
            "tick 100 starve",
            "status 120 starve",
            "status 150 starve",
            "latency 20 starve",
        ],
    );
    let (report, code) = place.mission("run demo --faults plan.toml --stopped-limit 1 --out hit", "hit");
    assert_eq!((code, &report["lost_messages"]), (0, &0.into()), "{report:#}");
    place.fine(&format!("diff {} {}", recording(&calm), recording(&report)));
    let words = happened(&place, &report);
    assert_eq!(words.len(), 6, "{words:?}");
    assert!(words.iter().all(|words| words.ends_with(", 5 % of the time for 1500 ms")), "{words:?}");
    let info = place.fine(&format!("info {} --json", recording(&report))).json();
    let others = info["faults"].as_array().unwrap().iter().filter(|fault| fault["kind"] != "injected");
    assert_eq!(others.count(), 0, "{info:#}");
    place.assert_nothing_left("hit");
}

/// In real time, no process waits for another. The planner is stopped for 95 ms before it may send its command, so that command
/// is late however fast or slow the machine is.
#[test]
fn a_starved_planner_is_late_in_real_time() {
    let place = Place::new();
    plan(&place, "plan.toml", &["command 40 starve"]);
    let running = place.start("run demo --faults plan.toml --speed 5 --json --system hungry --out hungry");
    // Once the late message has appeared on `latency`, it is also in the recording.
    support::wait_until("the end of the starvation", || {
        let output = place.run("echo latency --system hungry --once");
        output.code == Some(0) && output.json()["source_seq"].as_u64().unwrap() > 60
    });
    running.signal(nix::sys::signal::Signal::SIGINT);
    let report = running.end().json();
    // The mission was ended before every task was reached, so `judge` does not succeed.
    let judged = place.run(&format!("judge {} --json", recording(&report))).json();
    let latencies = &judged[0]["latency_ms"];
    let most_ms = latencies["situation to command"]["max"].as_f64().unwrap();
    assert!(most_ms >= 95.0, "{latencies:#}");
    place.assert_nothing_left("hungry");
}

/// When a supervisor is killed, the kernel ends or continues the processes that it had stopped, so none of them remains
/// stopped.
#[test]
fn a_killed_supervisor_leaves_no_process_stopped() {
    let place = Place::new();
    std::fs::write(
        place.files().join("plan.toml"),
        ["latency", "status"].map(|channel| {
            format!("[[fault]]\nchannel = \"{channel}\"\nmessage = 20\ndo = \"starve\"\nshare = 0.01\nduration_ms = 60000\n")
        }).concat(),
    )
    .unwrap();
    let running =
        place.start("run demo --faults plan.toml --speed 1 --json --system orphaned --out orphaned");
    support::wait_until("two starvations", || {
        let output = place.run("echo faults --system orphaned --count 2");
        output.code == Some(0) && output.out.matches("starve at").count() == 2
    });
    running.signal(nix::sys::signal::Signal::SIGKILL);
    running.end();
    support::wait_until("the end of all processes", || place.living().is_empty());
    place.fine("clean");
    place.assert_nothing_left("orphaned");
}

#[test]
fn chaos_draws_starvations_and_repeats_them() {
    let place = Place::new();
    let drawn = place.run("chaos demo --at-messages --signal starve,kill --kills 6 --seed 4 --json");
    assert_eq!(drawn.code, Some(0), "{drawn}");
    let report = drawn.json();
    assert_eq!((&report["kills"], &report["identical"]), (&6.into(), &true.into()), "{report:#}");
    let starvations = report["starvations"].as_u64().unwrap();
    assert!((1..6).contains(&starvations), "{report:#}");
    let schedule = report["schedule"].as_str().unwrap();
    let again = place.run(&format!("chaos demo --schedule {schedule} --seed 4 --json"));
    assert_eq!((again.code, &again.json()["starvations"]), (Some(0), &starvations.into()), "{again}");
    let refused = place.run("chaos demo --signal starve --kills 1");
    assert_eq!(refused.code, Some(2), "{refused}");
    assert!(refused.err.contains("--signal starve: expected --at-messages"), "{refused}");
    assert!(!place.files().join("out/chaos-003").exists());
}

/// A writer that is killed before the same message again and again makes no progress, so the supervisor gives up on it. This
/// failure does not depend on the clock.
#[test]
fn a_failed_runs_schedule_fails_in_the_same_place() {
    let place = Place::new();
    plan(&place, "fatal.toml", &["estimate 77 kill"; 12]);
    let play = |schedule: &str| {
        let ended = place.run(&format!("chaos demo --schedule {schedule} --json"));
        assert_eq!(ended.code, Some(3), "{ended}");
        ended
    };
    let first = play("fatal.toml");
    assert!(first.err.contains("localizer") && first.err.contains("--schedule"), "{first}");
    // The schedule that was played is stored next to the results, and has the same effect when played again.
    let written = place.files().join("out/chaos-001/schedule.toml");
    let again = play(written.to_str().unwrap());
    let place_of = |number: u32| {
        let folder = place.files().join(format!("out/chaos-{number:03}/disturbed"));
        let runs: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        let info = place.fine(&format!("info {} --json", runs[0].display())).json();
        let last = |topic: &str| {
            let topics = info[0]["topics"].as_array().unwrap();
            topics.iter().find(|found| found["topic"] == topic).unwrap()["messages"].clone()
        };
        (last("/estimate"), last("/status"), last("/tick"))
    };
    assert_eq!(place_of(1), place_of(2), "{first}\n{again}");
    assert_eq!(place_of(1).0, 76);
}

#[test]
fn kills_before_messages_lose_nothing_and_can_be_repeated() {
    let place = Place::new();
    let drawn = place.run("chaos demo --at-messages --kills 12 --seed 5 --json");
    assert_eq!(drawn.code, Some(0), "{drawn}");
    let report = drawn.json();
    assert_eq!((&report["kills"], &report["identical"]), (&12.into(), &true.into()), "{report:#}");
    let schedule = report["schedule"].as_str().unwrap();
    let again = place.run(&format!("chaos demo --schedule {schedule} --seed 5 --json"));
    assert_eq!(again.code, Some(0), "{again}");
    let again = again.json();
    // How long a recovery takes differs from run to run.
    let kills = |report: &Value| {
        let by_process = report["by_process"].as_object().unwrap();
        by_process.iter().map(|(name, of)| (name.clone(), of["kills"].clone())).collect::<Vec<_>>()
    };
    assert_eq!((&again["kills"], kills(&again)), (&12.into(), kills(&report)), "{again:#}");
    let words = |report: &Value| {
        let mut words = happened(&place, report);
        words.sort();
        words
    };
    assert_eq!(words(&report), words(&again));
}

/// Random kills happen at times measured by the clock. The schedule that is written afterwards contains the first message at or
/// after each of these times.
#[test]
fn random_faults_are_written_as_a_schedule() {
    let place = Place::new();
    let drawn = place.run("chaos demo --kills 5 --seed 3 --targets localizer,planner --json");
    assert_eq!(drawn.code, Some(0), "{drawn}");
    let report = drawn.json();
    let schedule = report["schedule"].as_str().unwrap();
    let text = std::fs::read_to_string(schedule).unwrap();
    assert_eq!(text.matches("[[fault]]").count(), 5, "{text}");
    let again = place.run(&format!("chaos demo --schedule {schedule} --seed 3 --json"));
    assert_eq!(again.code, Some(0), "{again}");
    assert_eq!(again.json()["kills"], 5, "{again}");
}

#[test]
fn messages_are_delayed_duplicated_and_swapped() {
    let place = Place::new();
    let (calm, _) = place.mission("run demo --out calm", "calm");
    plan(&place, "plan.toml", &["estimate 30 duplicate", "command 40 delay", "tick 50 duplicate"]);
    let (report, code) = place.mission("run demo --faults plan.toml --out hit", "hit");
    assert_eq!(code, 0, "{report:#}");
    // Readers drop messages that they have already received, and in lockstep they wait for late ones.
    place.fine(&format!("diff {} {}", recording(&calm), recording(&report)));
    assert_eq!(happened(&place, &report).len(), 3, "{report:#}");

    // In real time, no process waits for another, so messages that are lost or arrive after the next one are missing.
    plan(&place, "lost.toml", &["plan 3 drop", "particles 2 drop", "plan 6 reorder"]);
    let running = place.start("run demo --faults lost.toml --speed 5 --json --system lossy --out lossy");
    // The delayed message is sent together with the next one. A gap only becomes apparent when the following message
    // arrives.
    for (channel, seq) in [("plan", 8), ("particles", 3)] {
        support::wait_until(channel, || {
            let output = place.run(&format!("echo {channel} --system lossy --once"));
            output.code == Some(0) && output.json()["seq"].as_u64().unwrap() >= seq
        });
    }
    running.signal(nix::sys::signal::Signal::SIGINT);
    let report = running.end().json();
    assert_eq!(report["lost_messages"], 3, "{report:#}");
}

#[test]
fn an_invalid_plan_is_refused_with_the_reason() {
    let place = Place::new();
    for (text, words) in [
        (
            "[[fault]]\nchannel = \"wind\"\nmessage = 1\ndo = \"kill\"",
            "plan.toml: fault 1: channel: expected one of",
        ),
        ("[[fault]]\nchannel = \"scan\"\ndo = \"kill\"", "fault 1: message: expected message or time_s"),
        ("fault = 3", "plan.toml"),
    ] {
        std::fs::write(place.files().join("plan.toml"), text).unwrap();
        for command in ["run demo --faults plan.toml", "chaos demo --schedule plan.toml"] {
            let ended = place.run(command);
            assert_eq!(ended.code, Some(2), "{command}: {ended}");
            assert!(ended.err.contains(words), "{command}: {ended}");
        }
    }
    // `chaos` once drove a whole mission before it read the plan.
    assert!(!place.files().join("out/chaos-001").exists());
    assert_eq!(place.run("run demo --faults nothing.toml").code, Some(2));
}

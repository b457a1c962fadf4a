//! The live view. A third-party viewer decodes every topic of a running demo. A recording is played, paused and searched. Bad input
//! is rejected, and the layout that comes with the project only refers to existing channels, fields and panels.
//!
//! The first test needs node and Foxglove's packages (`.ci/run` installs them). The folder that contains `node_modules`
//! is `SKETCHNAV_FOXGLOVE` or, by default, `target/foxglove`. Without them, the test prints a notice and is skipped.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{BufRead, BufReader};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::Command;

use nix::sys::signal::Signal;
use serde_json::Value;
use sketchnav_recordings::Recording;
use sketchnav_recordings::reader::{RawMessage, Selection};
use sketchnav_schemas::channels;
use support::viewer::{Came, Viewer, view};
use support::{Ended, Place, Running, repository, wait_until};

/// Returns the folder of Foxglove's packages, if this machine has them.
fn packages() -> Option<PathBuf> {
    let folder = std::env::var_os("SKETCHNAV_FOXGLOVE");
    let folder = folder.map_or_else(|| repository().join("target/foxglove"), PathBuf::from);
    let is_there = needs::has(&["node"]) && folder.join("node_modules/@foxglove/ws-protocol").is_dir();
    if !is_there {
        needs::skipped(
            "foxglove",
            "no node, or no @foxglove/ws-protocol, rosmsg, rosmsg2-serialization and ws (SKETCHNAV_FOXGLOVE)",
        );
    }
    is_there.then_some(folder)
}

/// Returns the topics of channels on which a message was sent, and the topics derived from them.
fn spoken(place: &Place, system: &str) -> BTreeSet<String> {
    sketchnav_navigators::register(&[]).unwrap();
    let figures = place.fine(&format!("channels {system} --json")).json();
    let is_spoken = |channel: &&Value| channel["sent"].as_u64().is_none_or(|sent| sent > 0);
    let spoken = figures.as_array().unwrap().iter().filter(is_spoken);
    let specs = spoken.map(|channel| channels::find(channel["channel"].as_str().unwrap()).unwrap());
    let mut topics = BTreeSet::from(["/tf".to_owned(), "/tf_static".to_owned()]);
    for spec in specs.filter(|spec| spec.is_recorded()) {
        topics.insert(format!("/{}", spec.name));
        topics.extend(sketchnav_navigators::derived(spec).map(|derived| derived.topic.to_owned()));
    }
    topics
}

/// Starts a run and returns the link of its view, which is printed to standard error.
fn link_of(running: &mut Command) -> (Running, String) {
    let mut child = running.spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map_while(Result::ok);
    let link = lines.find_map(|line| Some(line[line.find("ws://")?..].trim().to_owned()));
    // The output is read continuously, so that the run never blocks on it.
    std::thread::spawn(move || lines.for_each(drop));
    (Running::of(child), link.expect("the view's link"))
}

#[test]
fn a_third_party_viewer_decodes_every_topic_of_a_running_demo() {
    let Some(packages) = packages() else { return };
    let place = Place::new();
    let (mut running, link) =
        link_of(&mut place.command("run demo --json --system seen --speed 2 --out out --foxglove 0"));
    place.wait_until_driving(&mut running, "seen");
    let wanted = spoken(&place, "seen");
    assert!(wanted.contains("/scan") && wanted.contains("/particles/poses"), "{wanted:?}");
    let list = wanted.iter().cloned().collect::<Vec<_>>().join(",");
    let picture = place.files().join("picture.svg");
    let mut watch = needs::program("node").expect("node, which was there before");
    watch.arg(repository().join("tests/view/watch.mjs")).args([&link, &list]).arg(&picture);
    watch.env("SKETCHNAV_FOXGLOVE", packages);
    let watched: Ended = watch.output().unwrap().into();
    assert_eq!(watched.code, Some(0), "{watched}");
    running.signal(Signal::SIGINT);
    let report = running.end().json();
    assert_eq!(report["lost_messages"], 0, "{report:#}");
    place.assert_nothing_left("seen");

    let watched = watched.json();
    for topic in &wanted {
        assert!(watched[topic]["decoded"].as_u64() > Some(0), "{topic}: {watched:#}");
    }
    shown_messages_equal_the_recorded_ones(&watched, report["recording"].as_str().unwrap());
    let picture = fs::read_to_string(picture).unwrap();
    assert!(picture.matches("<rect").count() > 100 && picture.contains("<polyline"), "{picture:.300}");
    if let Some(folder) = std::env::var_os("SKETCHNAV_PICTURES") {
        fs::write(Path::new(&folder).join("live-view.svg"), picture).unwrap();
    }
}

/// Asserts that on recorded topics, the type and the bytes of every message shown are those in the recording.
fn shown_messages_equal_the_recorded_ones(watched: &Value, recording: &str) {
    let recording = Recording::open(recording.as_ref()).unwrap();
    let mut recorded: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for topic in recording.topics().unwrap() {
        assert_eq!(watched[&topic.name]["type"], topic.ros2_type, "{}", topic.name);
        recorded.insert(topic.name.clone(), BTreeSet::new());
    }
    let hex = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    for message in recording.select(Selection::default()).unwrap() {
        let message = message.unwrap();
        recorded.get_mut(&message.topic.name).unwrap().insert(hex(&message.cdr));
    }
    for (topic, messages) in &recorded {
        let shown = watched[topic]["first"].as_array().unwrap();
        let shown = shown.iter().map(|message| message.as_str().unwrap());
        shown.for_each(|message| assert!(messages.contains(message), "{topic}: {message:.200}"));
    }
}

/// The states of playback, with the numbers that the protocol gives them.
const PLAYING: u8 = 0;
const PAUSED: u8 = 1;
const ENDED: u8 = 3;

/// Returns the recording that is played, which has 30 instants, a sketch and a route.
fn story() -> PathBuf {
    repository().join("recordings/golden/story.mcap")
}

/// Returns the messages of a recording that are shown from a time on.
fn expected(recording: &Recording, from_ns: u64) -> Messages {
    let latched = recording.latched_before(from_ns).unwrap();
    let latched = latched.into_iter().map(|message| RawMessage { stamp_ns: from_ns, ..message });
    let rest = recording.timeline(Selection::default().between(from_ns..u64::MAX)).unwrap();
    let mut all = Messages::new();
    for message in latched.chain(rest.map(Result::unwrap)) {
        all.entry(message.topic.name.clone()).or_default().push((message.stamp_ns, message.cdr));
    }
    all
}

type Messages = BTreeMap<String, Vec<(u64, Vec<u8>)>>;

/// Takes messages until playback has this status and this many messages have arrived, not counting derived ones. The
/// status and the messages come through different queues, so either may be late.
fn take(viewer: &mut Viewer, all: &mut Messages, status: u8, messages: usize) -> Option<(u64, bool, String)> {
    sketchnav_navigators::register(&[]).unwrap();
    let (mut playback, mut count) = (None, all.values().map(Vec::len).sum::<usize>());
    while playback.is_none() || count < messages {
        match viewer.wait() {
            Came::Message(topic, ns, cdr)
                if channels::of_topic(&topic).is_some() || topic.starts_with("/tf") =>
            {
                count += 1;
                all.entry(topic).or_default().push((ns, cdr));
            }
            Came::Playback { status: found, at_ns, did_seek, request } if found == status => {
                playback = Some((at_ns, did_seek, request));
            }
            _ => {}
        }
    }
    playback
}

/// Returns the number of topics of a recording, including derived ones.
fn topic_count(recording: &Recording) -> usize {
    sketchnav_navigators::register(&[]).unwrap();
    let topics = recording.topics().unwrap();
    let specs = topics.iter().filter_map(|topic| channels::of_topic(&topic.name));
    topics.len() + specs.flat_map(sketchnav_navigators::derived).count()
}

#[test]
fn a_recording_is_played_and_seeked_with_latched_messages_first() {
    let place = Place::new();
    let recording = Recording::open(&story()).unwrap();
    let (first_ns, last_ns) = recording.index().unwrap().span_ns().unwrap();
    let (running, link) = view(&place, &format!("{} --paused", story().display()));
    let mut viewer = Viewer::of_all(&link, topic_count(&recording));
    let time = |ns: u64| serde_json::json!({ "sec": ns / 1_000_000_000, "nsec": ns % 1_000_000_000 });
    assert_eq!(viewer.info["dataStartTime"], time(first_ns), "{}", viewer.info);
    assert_eq!(viewer.info["dataEndTime"], time(last_ns), "{}", viewer.info);

    let (mut whole, wanted) = (Messages::new(), expected(&recording, first_ns));
    viewer.ask(true, 8.0, None, "play");
    let playback = take(&mut viewer, &mut whole, PLAYING, 0).unwrap();
    assert_eq!((playback.1, playback.2.as_str()), (false, "play"));
    take(&mut viewer, &mut whole, ENDED, count(&wanted));
    assert!(whole == wanted, "{:?}, expected {:?}", counts(&whole), counts(&wanted));

    let middle_ns = first_ns.midpoint(last_ns);
    let (mut half, wanted) = (Messages::new(), expected(&recording, middle_ns));
    viewer.ask(false, 8.0, Some(middle_ns), "there");
    let playback = take(&mut viewer, &mut half, PAUSED, 0);
    assert_eq!(playback, Some((middle_ns, true, "there".to_owned())));
    viewer.ask(true, 8.0, None, "on");
    take(&mut viewer, &mut half, ENDED, count(&wanted));
    assert!(half == wanted, "{:?}, expected {:?}", counts(&half), counts(&wanted));
    assert!(half["/sketch"].len() == 1 && half["/scan"].len() < whole["/scan"].len(), "{:?}", counts(&half));
    running.signal(Signal::SIGINT);
    let ended = running.end();
    assert_eq!(ended.code, Some(0), "{ended}");
}

fn count(all: &Messages) -> usize {
    all.values().map(Vec::len).sum()
}

fn counts(all: &Messages) -> BTreeMap<&str, usize> {
    all.iter().map(|(topic, messages)| (topic.as_str(), messages.len())).collect()
}

/// A second viewer once received no latched messages, because the first one had already taken them.
#[test]
fn a_second_client_gets_latched_messages_and_channels_are_closed() {
    sketchnav_navigators::register(&[]).unwrap();
    let place = Place::new();
    let mut running = place.start("run demo --json --system seen --speed 2");
    place.wait_until_driving(&mut running, "seen");
    let (view, link) = view(&place, "seen");
    let latched = BTreeSet::from(["/sketch", "/sketch/grid", "/route", "/route/markers", "/tf_static"]);
    let kind = channels::of_kind("sketch").filter(|spec| spec.is_recorded());
    let topics = kind.map(|spec| 1 + sketchnav_navigators::derived(spec).count()).sum::<usize>() + 2;
    let mut viewers = Vec::new();
    for _ in 0..2 {
        let mut viewer = Viewer::of_all(&link, topics);
        let mut missing = latched.clone();
        while !missing.is_empty() {
            if let Came::Message(topic, ..) = viewer.wait() {
                missing.remove(topic.as_str());
            }
        }
        viewers.push(viewer);
    }
    let watches = |place: &Place| {
        let figures = place.fine("channels seen --json").json();
        let is_watched = |channel: &&Value| {
            channel["readers"].as_array().unwrap().iter().any(|reader| reader["pid"] == view.pid())
        };
        figures.as_array().unwrap().iter().filter(is_watched).count()
    };
    assert!(watches(&place) > 10);
    drop(viewers);
    wait_until("a view that has closed its channels", || watches(&place) == 0);
    running.signal(Signal::SIGINT);
    assert_eq!(running.end().json()["lost_messages"], 0);
    let ended = view.end();
    assert_eq!(ended.code, Some(0), "{ended}");
    place.assert_nothing_left("seen");
}

#[test]
fn bad_input_is_refused_before_anything_starts() {
    let place = Place::new();
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port();
    fs::write(place.files().join("letter.mcap"), "Dear Sir").unwrap();
    let story = story().display().to_string();
    for (arguments, words) in [
        (format!("view {story} --port {port}"), "cannot listen there"),
        (format!("run demo --system seen --foxglove {port}"), "cannot listen there"),
        ("view letter.mcap --port 0".to_owned(), "does not begin with the magic bytes"),
        ("view nowhere.mcap --port 0".to_owned(), "nowhere.mcap"),
        ("view nobody --port 0".to_owned(), "nobody"),
        ("view --port 0".to_owned(), "no system is running"),
        ("view nobody --port 0 --loop".to_owned(), "--loop: expected a recording"),
        (format!("view {story} --rate 0"), "expected a number from 0.02 to 64"),
    ] {
        let ended = place.run(&arguments);
        assert_eq!(ended.code, Some(2), "{arguments}: {ended}");
        assert!(ended.err.contains(words), "{arguments}: expected {words:?}: {ended}");
    }
    place.assert_nothing_left("seen");
    assert!(!place.files().join("out/demo-001").exists());
}

/// Returns the panels that a layout arranges.
fn panels(layout: &Value) -> BTreeSet<String> {
    match layout.as_str() {
        Some(panel) => BTreeSet::from([panel.to_owned()]),
        None => ["first", "second"].iter().flat_map(|half| panels(&layout[*half])).collect(),
    }
}

/// Every topic of the layout and every field that it plots exists. Every panel is arranged, and of a kind that both
/// viewers have (Lichtblick: packages/suite-base/src/panels).
#[test]
fn the_layout_refers_to_existing_topics() {
    sketchnav_navigators::register(&[]).unwrap();
    let file = repository().join("docs/foxglove-layout.json");
    let layout: Value = serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap();
    let configured = layout["configById"].as_object().unwrap().keys().cloned().collect::<BTreeSet<_>>();
    assert_eq!(panels(&layout["layout"]), configured);
    let kinds = configured.iter().map(|panel| panel.split('!').next().unwrap());
    assert!(kinds.clone().all(|kind| ["3D", "Plot", "RawMessages"].contains(&kind)), "{configured:?}");
    let mut known: BTreeMap<String, String> = BTreeMap::new();
    for spec in channels::all() {
        known.insert(format!("/{}", spec.name), spec.message.schema());
        known.extend(
            sketchnav_navigators::derived(spec).map(|derived| (derived.topic.to_owned(), derived.schema())),
        );
    }
    let mut named = Vec::new();
    for config in layout["configById"].as_object().unwrap().values() {
        named.extend(config["topics"].as_object().into_iter().flat_map(|topics| topics.keys().cloned()));
        named.extend(config["topicPath"].as_str().map(str::to_owned));
        let paths = config["paths"].as_array().into_iter().flatten();
        named.extend(paths.map(|path| path["value"].as_str().unwrap().to_owned()));
    }
    assert!(named.len() > 10, "{named:?}");
    for path in named {
        let mut parts = path.split('.');
        let topic = parts.next().unwrap();
        let schema = known.get(topic).unwrap_or_else(|| panic!("{topic} of {path}"));
        for field in parts {
            assert!(
                schema.lines().any(|line| line.split_whitespace().nth(1) == Some(field)),
                "{field} of {path}"
            );
        }
    }
}

//! Real processes on real shared memory.
//!
//! A test starts this very binary again as actors and talks to them line by line: an order to an
//! actor's standard input, an answer from its standard output. Each test has a root of its own, so
//! the tests do not see each other either.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Duration;

use nix::sys::signal::{SigSet, Signal, raise};
use sketchnav_runtime::*;
use sketchnav_schemas::channels::{ODOMETRY, SCAN, SKETCH, TRUTH};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::message::{GroundTruth, LaserScan, Odometry, SketchMap};
use sketchnav_schemas::run::RunConfig;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

const LONG: Duration = Duration::from_secs(600);

// ---------------------------------------------------------------------------------------- the actor

/// What an actor has opened.
#[derive(Default)]
struct Actor {
    channels: Option<Channels>,
    scan_writer: Option<Writer<LaserScan>>,
    scan_reader: Option<Reader<LaserScan>>,
    sketch_writer: Option<SliceWriter<SketchMap>>,
    sketch_reader: Option<SliceReader<SketchMap>>,
    odometry_reader: Option<Reader<Odometry>>,
    truth_reader: Option<Reader<GroundTruth>>,
    held: Vec<Sample<LaserScan>>,
    node: Option<Node>,
    system: Option<System>,
}

#[test]
#[ignore = "a process of the other tests, which start it themselves"]
fn actor() {
    let mut actor = Actor::default();
    for line in std::io::stdin().lines() {
        let line = line.unwrap();
        let words: Vec<_> = line.split(' ').collect();
        let answer = actor.obey(&words).unwrap_or_else(|error| format!("error {error}"));
        println!("\n> {answer}");
    }
}

impl Actor {
    fn obey(&mut self, words: &[&str]) -> Result<String> {
        match *words {
            ["create", name] => self.create(name)?,
            ["remove"] => self.remove()?,
            ["join", name, process] => {
                self.node = Some(Node::join(System::open(name)?, process.parse().unwrap())?);
            }
            ["be-asked-to-end"] => {
                // As the supervisor starts a process: the signal waits until somebody listens.
                SigSet::from(Signal::SIGTERM).thread_block().unwrap();
                raise(Signal::SIGTERM).unwrap();
            }
            ["leave"] => *self = Self { system: self.system.take(), ..Self::default() },
            ["open", what] => self.open(what)?,
            ["send", count] => return self.send(count.parse().unwrap()),
            ["receive"] => return self.receive(),
            ["wait"] => return Ok(format!("{:?}", self.node().wait(LONG))),
            ["refresh"] => return Ok(format!("{:?}", self.node().wait(Duration::ZERO))),
            ["until", seq] => return self.receive_until(seq.parse().unwrap()),
            ["loan"] => return self.loan(),
            ["hold"] => return self.hold(),
            ["sketch"] => return self.send_sketch(),
            ["hold-sketch"] => return self.hold_sketch(),
            ["count-sending"] => return self.count_sending(),
            ["count-receiving"] => return self.count_receiving(),
            ["list"] => {
                let names: Vec<_> = System::list()?.iter().map(|s| s.name().to_string()).collect();
                return Ok(names.join(" "));
            }
            ["sweep"] => return Ok(System::sweep_dead()?.join(" ")),
            _ => panic!("no such order: {words:?}"),
        }
        Ok("done".into())
    }

    fn create(&mut self, name: &str) -> Result<()> {
        let system = System::create(&run_config(name))?;
        let node = Node::join(System::open(name)?, Process::Supervisor)?;
        self.channels = Some(Channels::create(&node)?);
        (self.node, self.system) = (Some(node), Some(system));
        Ok(())
    }

    fn remove(&mut self) -> Result<()> {
        let system = self.system.take();
        *self = Self::default();
        system.unwrap().remove()
    }

    fn node(&self) -> &Node {
        self.node.as_ref().unwrap()
    }

    fn open(&mut self, what: &str) -> Result<()> {
        match what {
            "scan-writer" => self.scan_writer = Some(self.node().writer(SCAN)?),
            "second-scan-writer" => drop(self.node().writer(SCAN)?),
            "scan-reader" => self.scan_reader = Some(self.node().reader(SCAN)?),
            "sketch-writer" => self.sketch_writer = Some(self.node().slice_writer(SKETCH)?),
            "sketch-reader" => self.sketch_reader = Some(self.node().slice_reader(SKETCH)?),
            "odometry-reader" => self.odometry_reader = Some(self.node().reader(ODOMETRY)?),
            "truth-reader" => self.truth_reader = Some(self.node().reader(TRUTH)?),
            _ => panic!("no such end: {what}"),
        }
        Ok(())
    }

    fn send(&mut self, count: u64) -> Result<String> {
        let writer = self.scan_writer.as_mut().unwrap();
        for _ in 0..count {
            writer.send(fill)?;
        }
        Ok(writer.last_seq().to_string())
    }

    /// Everything that has come: first and last number, how many, how many lost.
    fn receive(&mut self) -> Result<String> {
        let reader = self.scan_reader.as_mut().unwrap();
        let mut numbers = Vec::new();
        while let Some(scan) = reader.receive()? {
            assert_eq!(scan.ranges_m[100], 2.5);
            numbers.push(scan.header.seq);
        }
        let (first, last) = (numbers.first().unwrap_or(&0), numbers.last().unwrap_or(&0));
        Ok(format!("{first}..{last} {} lost {}", numbers.len(), reader.lost()))
    }

    fn receive_until(&mut self, seq: u64) -> Result<String> {
        loop {
            let reader = self.scan_reader.as_mut().unwrap();
            while let Some(scan) = reader.receive()? {
                if scan.header.seq >= seq {
                    return Ok(scan.header.seq.to_string());
                }
            }
            assert_eq!(self.node().wait(LONG), Wake::Message);
        }
    }

    fn loan(&mut self) -> Result<String> {
        let writer = self.scan_writer.as_mut().unwrap();
        let mut loan = writer.loan()?;
        assert!(loan.ranges_m.iter().all(|&range| range == 0.0));
        fill(&mut loan);
        let place = place_in_file(&raw const *loan);
        loan.send()?;
        Ok(place)
    }

    fn hold(&mut self) -> Result<String> {
        let scan = self.scan_reader.as_mut().unwrap().receive()?.unwrap();
        let place = place_in_file(&raw const *scan);
        self.held.push(scan);
        Ok(place)
    }

    fn send_sketch(&mut self) -> Result<String> {
        let mut loan = self.sketch_writer.as_mut().unwrap().loan(2540 * 1252)?;
        loan.message_mut().width_px = 2540;
        loan.bytes_mut()[2540 * 1252 - 1] = 100;
        let place = place_in_file(loan.bytes_mut().as_ptr());
        loan.send()?;
        Ok(place)
    }

    fn hold_sketch(&mut self) -> Result<String> {
        let sketch = self.sketch_reader.as_mut().unwrap().receive()?.unwrap();
        assert_eq!((sketch.message().width_px, sketch.bytes().len()), (2540, 2540 * 1252));
        assert_eq!((sketch.bytes()[0], sketch.bytes()[2540 * 1252 - 1]), (0, 100));
        Ok(place_in_file(sketch.bytes().as_ptr()))
    }

    /// Allocations of this thread while a thousand messages are sent and the health is reported.
    fn count_sending(&mut self) -> Result<String> {
        let (writer, node) = (self.scan_writer.as_mut().unwrap(), self.node.as_ref().unwrap());
        let mut health = HealthReporter::new(node)?;
        health.report(0)?;
        let (before, handles) = (allocations_of_this_thread(), loan_handles_of_this_thread());
        for stamp_ns in 0..1000 {
            let step = Step::begin();
            writer.send(fill)?;
            node.wait(Duration::ZERO);
            health.end(step);
            health.report(stamp_ns)?;
        }
        let handles = loan_handles_of_this_thread() - handles;
        Ok(format!("{} and {handles} handles", allocations_since(before)))
    }

    /// Allocations of this thread while it receives up to message 1000.
    fn count_receiving(&mut self) -> Result<String> {
        let (reader, node) = (self.scan_reader.as_mut().unwrap(), self.node.as_ref().unwrap());
        let before = allocations_of_this_thread();
        loop {
            while let Some(scan) = reader.receive()? {
                if scan.header.seq == 1000 {
                    return Ok(allocations_since(before));
                }
            }
            node.wait(LONG);
        }
    }
}

fn allocations_since(before: u64) -> String {
    let counted = allocations_of_this_thread() - before;
    drop(std::hint::black_box(Box::new(0)));
    assert!(allocations_of_this_thread() > before + counted, "the counter does not count");
    counted.to_string()
}

fn fill(scan: &mut LaserScan) {
    scan.beam_count = 683;
    scan.ranges_m[100] = 2.5;
}

/// Which byte of which file an address is: the file's device, inode and path, and the offset.
fn place_in_file<T>(address: *const T) -> String {
    let address = address as usize;
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
    for line in maps.lines() {
        let words: Vec<_> = line.split_whitespace().collect();
        let (from, to) = words[0].split_once('-').unwrap();
        let hex = |text: &str| usize::from_str_radix(text, 16).unwrap();
        if (hex(from)..hex(to)).contains(&address) {
            let offset = hex(words[2]) + address - hex(from);
            return format!("{} {} {} {offset}", words[3], words[4], words[5]);
        }
    }
    panic!("{address:#x} is not mapped");
}

fn run_config(name: &str) -> RunConfig {
    let mut run: RunConfig = serde_json::from_str(include_str!("run.json")).unwrap();
    run.system = name.into();
    run
}

// ------------------------------------------------------------------------------- talking to actors

/// A root of systems that is this test's own.
struct Stage {
    root: tempfile::TempDir,
}

/// A process on a stage.
struct Player {
    child: Child,
    orders: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl Stage {
    fn new() -> Self {
        Self { root: tempfile::tempdir().unwrap() }
    }

    fn player(&self) -> Player {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["actor", "--exact", "--ignored", "--nocapture"])
            .env("XDG_RUNTIME_DIR", self.root.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let orders = child.stdin.take().unwrap();
        let answers = BufReader::new(child.stdout.take().unwrap());
        Player { child, orders, answers }
    }

    /// A supervisor of the system `name`.
    fn system(&self, name: &str) -> Player {
        let mut supervisor = self.player();
        supervisor.does(&format!("create {name}"));
        supervisor
    }

    fn join(&self, name: &str, process: Process, ends: &[&str]) -> Player {
        let mut player = self.player();
        player.does(&format!("join {name} {process}"));
        for end in ends {
            player.does(&format!("open {end}"));
        }
        player
    }

    fn folder(&self) -> PathBuf {
        self.root.path().join("sketchnav")
    }

    /// What lies in the root, but for its guard, and in shared memory under the name of `system`.
    fn leftovers(&self, system: &str) -> Vec<String> {
        let names = |path: &Path| -> Vec<String> {
            let entries = std::fs::read_dir(path).unwrap();
            entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect()
        };
        let mut found = names(&self.folder());
        found.retain(|name| name != ".guard");
        let mark = format!("sketchnav_{system}_");
        found.extend(names(Path::new("/dev/shm")).into_iter().filter(|name| name.starts_with(&mark)));
        found
    }
}

impl Drop for Stage {
    /// The supervisors of most tests are killed with their players.
    fn drop(&mut self) {
        let mut sweeper = self.player();
        sweeper.begin("sweep");
        let mut line = String::new();
        while sweeper.answers.read_line(&mut line).is_ok_and(|read| read > 0) && !line.starts_with("> ") {
            line.clear();
        }
    }
}

impl Player {
    fn tell(&mut self, order: &str) -> String {
        self.begin(order);
        self.answer()
    }

    fn begin(&mut self, order: &str) {
        writeln!(self.orders, "{order}").unwrap();
    }

    fn answer(&mut self) -> String {
        let mut line = String::new();
        while self.answers.read_line(&mut line).unwrap() > 0 {
            if let Some(answer) = line.trim_end_matches('\n').strip_prefix("> ") {
                return answer.to_string();
            }
            line.clear();
        }
        panic!("the actor has ended");
    }

    fn does(&mut self, order: &str) {
        assert_eq!(self.tell(order), "done", "{order}");
    }

    fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

impl Drop for Player {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

// ------------------------------------------------------------------------------------------- tests

#[test]
fn a_message_goes_from_process_to_process() {
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

#[test]
fn sending_and_receiving_allocate_nothing() {
    let stage = Stage::new();
    let _supervisor = stage.system("allocations");
    let mut writer = stage.join("allocations", Process::World, &["scan-writer"]);
    let mut reader = stage.join("allocations", Process::Localizer, &["scan-reader"]);
    // The first message connects the two.
    writer.tell("send 1");
    assert_eq!(reader.tell("until 1"), "1");
    reader.begin("count-receiving");
    // Two messages a round: the scan and the health.
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
        format!("error world of system \"second\" runs already as process {pid}; end that one first")
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
fn a_system_that_does_not_run_is_named() {
    let stage = Stage::new();
    let _supervisor = stage.system("here");
    let answer = stage.player().tell("join there planner");
    assert!(
        answer.contains("system \"there\" is not running (running: here); `sketchnav run` starts one"),
        "{answer}"
    );
}

#[test]
fn what_a_killed_system_leaves_is_swept() {
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
fn a_new_system_takes_the_place_of_a_killed_one() {
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
    // The writer sleeps until a reader comes; the reader sleeps until it has been served.
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
fn a_dead_reader_stops_nobody() {
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

#[test]
fn a_request_to_end_wakes_a_sleeper() {
    let stage = Stage::new();
    let _supervisor = stage.system("signal");
    for signal in ["TERM", "INT", "HUP"] {
        let mut sleeper = stage.join("signal", Process::Planner, &["scan-reader"]);
        sleeper.begin("wait");
        for signal in ["STOP", "CONT", signal] {
            let pid = sleeper.child.id().to_string();
            assert!(Command::new("kill").args([&format!("-{signal}"), &pid]).status().unwrap().success());
        }
        assert_eq!(sleeper.answer(), "Terminate");
        assert_eq!(sleeper.tell("wait"), "Terminate");
    }
}

/// A process that was asked to end while it joined had its bell rung by the signal before it first
/// looked at the bell, took the ring for an old one and slept for good; one in five systems that were
/// interrupted at once hung on a loaded machine.
#[test]
fn a_request_to_end_before_joining_is_heard() {
    let stage = Stage::new();
    let _supervisor = stage.system("early-signal");
    let mut player = stage.player();
    player.does("be-asked-to-end");
    player.does("join early-signal planner");
    assert_eq!(player.tell("wait"), "Terminate");
}

#[test]
fn both_ends_of_every_channel_fit_the_table() {
    let mut names = BTreeMap::new();
    for spec in sketchnav_schemas::channels::TABLE {
        assert!(spec.history <= spec.buffer, "{}: a reader takes the whole history at once", spec.name);
        assert!(names.insert(spec.name, spec).is_none());
    }
}

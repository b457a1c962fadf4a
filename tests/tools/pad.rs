//! Tests of the pad with its whole system, with real processes over shared memory and a page over real sockets.

use std::io::{Read, Write};
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

use nix::sys::signal::Signal;
use serde_json::{Value, json};
use sketchnav_recordings::reader::Recording;
use sketchnav_schemas::channels::{DRAWING, ORDERS, UNDERSTOOD};
use sketchnav_schemas::codes::Order;
use sketchnav_sketch::messages::{ROUTE, SKETCH};
use sketchnav_sketch::reading::Options;
use support::page::{Page, TOKEN, body, free_port, parsed, request, wait_for};
use support::{Place, Running, kill_if_alive, repository, wait_until};

const LABORATORY: &str = "sim/missions/laboratory/laboratory-route.toml";

/// A system with a pad, and the port of the pad.
struct Stage {
    place: Place,
    running: Running,
    port: u16,
    name: &'static str,
}

impl Stage {
    fn new(name: &'static str, options: &str) -> Self {
        let (place, port) = (Place::new(), free_port());
        let mission = repository().join(LABORATORY);
        let line = format!(
            "pad --mission {} --port {port} --system {name} --out out --save saved {options}",
            mission.display()
        );
        std::fs::create_dir(place.files().join("saved")).unwrap();
        let mut running = place.start(&line);
        wait_for(&mut running, port);
        Self { place, running, port, name }
    }

    fn page(&self) -> Page {
        Page::open(self.port, None)
    }

    /// Ends the system as a person would. Returns the place and the path of the recording.
    fn end(self) -> (Place, std::path::PathBuf) {
        self.running.signal(Signal::SIGINT);
        let ended = self.running.end();
        assert_eq!(ended.code, Some(0), "{ended}");
        self.place.assert_nothing_left(self.name);
        let recording = self.place.files().join("out/laboratory-route-001/laboratory-route.mcap");
        assert!(ended.err.contains("laboratory-route.mcap"), "{ended}");
        (self.place, recording)
    }
}

fn strokes() -> Vec<u8> {
    std::fs::read(repository().join("sim/missions/laboratory/sketch-route.json")).unwrap()
}

/// Returns the laboratory's first route, which leads around the pallet.
fn route() -> Value {
    let mission = std::fs::read_to_string(repository().join(LABORATORY)).unwrap();
    let mission = sketchnav_schemas::mission::Mission::parse(&mission).unwrap();
    let sketch = sketchnav_sketch::mission::SketchMission::of(&mission).unwrap();
    json!({ "route": sketch.tasks[0].aim.route().unwrap() })
}

/// Returns the keys of an answer, in alphabetical order.
fn keys(answer: &Value) -> Vec<&str> {
    let mut keys: Vec<_> = answer.as_object().unwrap().keys().map(String::as_str).collect();
    keys.sort_unstable();
    keys
}

/// Draws on the page and sends the drawing and the path. The link limit is raised so that a machine that is busy for a
/// while does not count as a lost link. The answers must have the keys in the table of `services/pad/src/protocol.rs`,
/// which was once out of date.
fn draw(page: &mut Page) {
    assert_eq!(keys(&page.must("/api/limit", &json!({ "link_limit_s": 60 }))), ["ok"]);
    let (status, answer) = page.post("/api/sketch", &strokes());
    assert_eq!(status, 200, "{answer}");
    assert_eq!((&answer["ok"], &answer["width_px"]), (&json!(true), &json!(1320)));
    let facts = ["doubts", "height_px", "ok", "seq", "wall_direction_rad", "width_px"];
    assert_eq!(keys(&answer), facts);
    assert_eq!(keys(&page.must("/api/path", &route())), facts);
    page.until_allowed("execute");
}

#[test]
fn a_drawing_is_driven_aborted_restored_and_recorded() {
    let stage = Stage::new("drawn", "--speed 3");
    let mut page = stage.page();
    assert_eq!((&page.hello["drives"], &page.hello["mode"]), (&json!(true), &json!("draws")));
    page.until_state("no-sketch");
    page.until_allowed("sketch");
    assert_eq!(page.order("execute").0, 409);
    draw(&mut page);

    // A second page sees everything, but may not drive.
    let mut second = stage.page();
    assert_eq!((&second.hello["drives"], &second.hello["path"]), (&json!(false), &route()));
    let sent: Value = serde_json::from_slice(&strokes()).unwrap();
    assert_eq!(second.hello["drawing"], sent);
    assert_eq!(second.order("execute").0, 403);

    assert_eq!(page.order("execute").0, 200);
    assert_eq!(page.post("/api/sketch", &strokes()).0, 409, "not while it drives");
    page.until("way driven", |feed| feed["task"]["path_m"].as_f64().is_some_and(|way| way > 1.0));
    second.say(&json!({ "abort": true }));
    page.until_state("aborted");
    let stopped = page.until("standing", |feed| feed["speed_mps"].as_f64().is_some_and(|speed| speed < 0.01));
    page.until_allowed("restore");
    assert_eq!(page.order("restore").0, 200);
    page.until_state("driving");
    let ended = page.until_state("ended");
    assert_eq!(ended["task"]["reached"], 1, "{ended}");
    assert!(stopped["pose"]["x"] != ended["pose"]["x"]);
    page.say(&json!({ "ping": 7 }));

    let answer = page.must("/api/mission", &json!({ "name": "My room" }));
    let files = answer["files"].clone();
    assert_eq!((keys(&answer), keys(&files[0])), (vec!["files", "ok"], vec!["name", "text"]));
    assert_eq!((&files[0]["name"], &files[1]["name"]), (&json!("my-room.toml"), &json!("my-room.json")));
    let (place, recording) = stage.end();
    arrived_as_drawn(&recording);
    let again = place.run("run saved/my-room.toml --json --system again");
    assert_eq!(again.code, Some(0), "{again}");
    assert!(again.out.contains("according to the robot only"), "{again}");
    // The saved drawing is the one that was learned, byte for byte.
    place.fine(&format!("learn {} -o my-room.learned", recording.display()));
    place.fine("run saved/my-room.toml --learned my-room.learned --system learned --out learned");
    for tool in ["info FILE", "judge FILE", "report FILE -o page.html"] {
        let output = place.run(&tool.replace("FILE", &recording.display().to_string()));
        assert_eq!(output.code, Some(0), "{tool}: {output}");
    }
    let judged = place.run(&format!("judge {} --json", recording.display())).json();
    let task = &judged[0]["verdict"]["tasks"][0];
    assert_eq!((&task["name"], &task["state"]), (&json!("route"), &json!("reached")), "{judged}");
    assert!(
        task["reason"].as_str().is_some_and(|words| words.contains("according to the robot only")),
        "{task}"
    );
    let page = std::fs::read_to_string(place.files().join("page.html")).unwrap();
    assert!(page.contains("1 of 1 tasks reached"));
    let again = place.run(&format!("rerun {} --process sketcher", recording.display()));
    assert_eq!(again.code, Some(0), "{again}");
    let refused = place.run(&format!("rerun {} --process planner", recording.display()));
    assert!(refused.code == Some(2) && refused.err.contains("people took part"), "{refused}");
}

/// Asserts that the localizer received exactly what the sketcher's code makes of the bytes that were drawn, and that
/// the walls are where the pen was.
fn arrived_as_drawn(recording: &Path) {
    let recording = Recording::open(recording).unwrap();
    let sent: Vec<_> = recording.channel(DRAWING).unwrap().map(Result::unwrap).collect();
    assert_eq!((sent.len(), &sent[0].1), (2, &strokes()));
    let (map, cells) = recording.channel(SKETCH).unwrap().next().unwrap().unwrap();
    let drawing = sketchnav_sketch::reading::read(&strokes(), "strokes", &Options::default()).unwrap();
    assert_eq!((map.width_px, map.height_px, &cells), (drawing.width_px, drawing.height_px, &drawing.cells));
    let strokes: Value = serde_json::from_slice(&strokes()).unwrap();
    for point in strokes["strokes"].as_array().unwrap().iter().flat_map(|s| s["points"].as_array().unwrap()) {
        let at = [point[0].as_f64().unwrap(), point[1].as_f64().unwrap()];
        let cell = drawing.cell(&drawing.from_image(at));
        assert_eq!(cell, Some(sketchnav_schemas::codes::WALL), "{at:?}");
    }
    let (route, _) = recording.channel(ROUTE).unwrap().next().unwrap().unwrap();
    let first = route.points(&route.tasks()[0]).next().unwrap();
    assert_eq!(drawing.to_image(&first), [222.0, 221.0]);
    let answers: Vec<_> = recording.channel(UNDERSTOOD).unwrap().map(|m| m.unwrap().0.accepted).collect();
    assert_eq!(answers, [1, 1]);
    let orders: Vec<_> = recording.channel(ORDERS).unwrap().map(|m| m.unwrap().0.order).collect();
    assert_eq!(orders, [Order::Start, Order::Abort, Order::Resume].map(Order::code));
}

#[test]
fn invalid_requests_are_refused_and_the_mission_continues() {
    let stage = Stage::new("guarded", "--speed 3");
    let mut page = stage.page();
    draw(&mut page);
    assert_eq!(page.order("execute").0, 200);
    page.until_state("driving");
    let session = page.session();
    let own = ("x-sketchnav-session", session.as_str());
    let json = ("content-type", "application/json");
    let port = stage.port;
    let post = |path: &str, headers: &[(&str, &str)], body: &[u8]| {
        request(port, &format!("POST {path}"), headers, body)
    };
    let abort = br#"{"order":"abort"}"#;
    let refused = |answer: (u16, Value), status: u16, words: &str| {
        assert_eq!(answer.0, status, "{words}: {}", answer.1);
        assert!(answer.1["error"].as_str().is_some_and(|said| said.contains(words)), "{words}: {}", answer.1);
    };
    refused(post("/api/order", &[own, json, ("origin", "http://evil.example")], abort), 403, "origin");
    refused(post("/api/order", &[own, json, ("host", "evil.example:80")], abort), 403, "host");
    refused(post("/api/order", &[json], abort), 403, "session");
    refused(post("/api/order", &[("x-sketchnav-session", "made up"), json], abort), 403, "session");
    refused(post("/api/order", &[own, json], b"{\"order\":"), 400, "the order");
    refused(post("/api/order", &[own, json], br#"{"order":"explode"}"#), 400, "explode");
    let million =
        format!("{{\"canvas\":[9,9],\"strokes\":[{{\"points\":[{}[1,1]]}}]}}", "[1,1],".repeat(1_000_000));
    refused(post("/api/sketch", &[own, json], million.as_bytes()), 413, "262144 points");
    refused(post("/api/sketch", &[own, ("content-type", "image/png")], &vec![0; 9 << 20]), 413, "8388608");
    refused(post("/api/sketch", &[own, ("content-type", "text/html")], b"x"), 400, "content-type");
    refused(post("/api/path", &[own, json], b"[1"), 400, "the path");
    refused(post("/api/nothing", &[own, json], b""), 404, "nothing");
    assert_eq!(page.until_state("ended")["task"]["reached"], 1, "the mission went on");
    // Once the robot stands still, drawings and paths that the sketcher cannot use are rejected with the sketcher's
    // reason.
    refused(page.post_as("/api/sketch", "image/png", b"\x89PNG\r\n\x1a\nnothing"), 422, "PNG");
    refused(page.post("/api/path", br#"{"route":[[0,0],[222,221]]}"#), 422, "route point 1");
    let uploads = (0..20).map(|_| page.post("/api/path", b"{}").0);
    assert!(uploads.collect::<Vec<_>>().contains(&429));
    stage.end();
}

#[test]
fn a_configured_token_is_required() {
    let stage = Stage::new("tokened", "--token abcdefgh12345678");
    let get =
        |path: &str, headers: &[(&str, &str)]| request(stage.port, &format!("GET {path}"), headers, b"").0;
    assert_eq!(get("/", &[]), 200);
    assert_eq!(get("/api/walls.png", &[]), 401);
    assert_eq!(get("/api/walls.png?token=abcdefgh12345679", &[]), 401);
    assert_eq!(get("/api/walls.png?token=abcdefgh12345678", &[]), 404);
    assert_eq!(get("/api/walls.png", &[("x-sketchnav-token", "abcdefgh12345678")]), 404);
    assert_eq!(get("/ws", &[]), 401);
    stage.end();
}

#[test]
fn losing_the_drivers_connection_pauses_the_robot() {
    let stage = Stage::new("unattended", "--speed 3");
    let mut driver = stage.page();
    draw(&mut driver);
    assert_eq!(driver.post("/api/limit", br#"{"link_limit_s":0.2}"#).0, 400);
    assert_eq!(driver.order("execute").0, 200);
    driver.until("way driven", |feed| feed["task"]["path_m"].as_f64().is_some_and(|way| way > 0.2));
    let mut watcher = stage.page();
    driver.must("/api/limit", &json!({ "link_limit_s": 1 }));
    let session = driver.session();
    driver.vanish();
    let paused = watcher.until_state("paused");
    let warned = |feed: &Value| {
        let warnings = feed["warnings"].as_array().cloned().unwrap_or_default();
        warnings.iter().any(|w| {
            w["kind"] == "stopped" && w["text"] == "stopped: the link to the page that drives was lost"
        })
    };
    watcher.until("the reason", warned);
    assert_eq!(paused["drives"], false);
    // The page that had control comes back and still has control.
    let mut back = Page::open(stage.port, Some(&session));
    assert_eq!(back.hello["drives"], true);
    assert_eq!(watcher.post("/api/wheel", b"").0, 403);
    back.must("/api/limit", &json!({ "link_limit_s": 60 }));
    back.until_allowed("restore");
    assert_eq!(back.order("restore").0, 200);
    back.until_state("ended");
    // If that page does not come back, control becomes free.
    let mut watcher = stage.page();
    back.must("/api/limit", &json!({ "link_limit_s": 1 }));
    back.vanish();
    while watcher.post("/api/wheel", b"").0 != 200 {
        watcher.read();
    }
    watcher.until("the wheel", |feed| feed["drives"] == true);
    stage.end();
}

#[test]
fn the_drawing_is_driven_whichever_process_is_killed() {
    let stage = Stage::new("killed", "--speed 3");
    let mut page = stage.page();
    let (place, name) = (&stage.place, stage.name);
    let kill = |process: &str| {
        let before = place.serving(name, process);
        before.iter().for_each(|&pid| kill_if_alive(pid));
        wait_until(process, || place.serving(name, process).iter().any(|pid| !before.contains(pid)));
    };
    page.must("/api/limit", &json!({ "link_limit_s": 60 }));
    // The sketcher is killed between the sketch and the path, and still has the sketch after its restart.
    assert_eq!(page.post("/api/sketch", &strokes()).0, 200);
    kill("sketcher");
    page.must("/api/path", &route());
    for process in ["planner", "localizer", "sketcher"] {
        kill(process);
    }
    page.until_allowed("execute");
    let saved = json!({ "name": "Saved twice" });
    page.must("/api/mission", &saved);
    let session = page.session();
    kill("pad");
    page.vanish();
    let mut page = {
        wait_until("the pad", || std::net::TcpStream::connect(("127.0.0.1", stage.port)).is_ok());
        Page::open(stage.port, Some(&session))
    };
    assert_eq!((&page.hello["drives"], &page.hello["path"]), (&json!(true), &route()));
    // The pad keeps track of its own mission files and does not replace any others.
    page.must("/api/mission", &saved);
    std::fs::write(place.files().join("saved/my-floor.toml"), "by hand").unwrap();
    let (status, refused) = page.post("/api/mission", br#"{"name":"My floor"}"#);
    assert!(status == 409 && refused["error"].as_str().unwrap().contains("my-floor.toml"), "{refused}");
    page.until_allowed("execute");
    assert_eq!(page.order("execute").0, 200);
    page.until("way driven", |feed| feed["task"]["path_m"].as_f64().is_some_and(|way| way > 1.0));
    for process in ["sketcher", "planner", "localizer", "recorder", "world"] {
        kill(process);
        page.until("more driven", |feed| feed["task"]["state"] == "driving" || feed["state"] == "ended");
    }
    let ended = page.until_state("ended");
    assert_eq!(ended["task"]["reached"], 1, "{ended}");
    stage.end();
}

/// Even if the pad and the sketcher die at any time, or both at once, a drawing that is sent under one name is accepted exactly
/// once.
#[test]
fn requests_are_taken_once_whichever_process_dies() {
    let stage = Stage::new("sent", "--speed 2");
    let mut page = stage.page();
    page.must("/api/limit", &json!({ "link_limit_s": 60 }));
    page.until_allowed("sketch");
    let (session, path) = (page.session(), route().to_string());
    let sendings = [("/api/sketch", strokes()), ("/api/path", path.into_bytes())];
    for round in 0..6_u64 {
        let (path, body) = &sendings[round as usize % 2];
        let name = format!("sending {round}");
        let victims = ["pad", "sketcher"].map(|process| stage.place.serving(stage.name, process));
        let killer = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(3 * round));
            victims.iter().flatten().for_each(|&pid| kill_if_alive(pid));
        });
        let mut answer = page.send(path, body, &name);
        killer.join().unwrap();
        while answer.is_none() {
            wait_until("the pad", || std::net::TcpStream::connect(("127.0.0.1", stage.port)).is_ok());
            let Ok(back) = Page::try_open(stage.port, Some(&session)) else { continue };
            page = back;
            answer = page.send(path, body, &name);
        }
        let (status, answer) = answer.unwrap();
        assert_eq!(status, 200, "{name}: {answer}");
        // Sending the drawing again under the same name gives the same answer, and no second drawing. The pad may still
        // be about to die.
        page = loop {
            if let Ok(back) = Page::try_open(stage.port, Some(&session)) {
                break back;
            }
        };
        assert_eq!(page.send(path, body, &name).unwrap_or((200, answer.clone())), (200, answer), "{name}");
    }
    assert_eq!(page.hello["path"], route());
    page.until_allowed("execute");
    let (_place, recording) = stage.end();
    let recording = Recording::open(&recording).unwrap();
    let taken: Vec<_> = recording.channel(DRAWING).unwrap().map(|m| m.unwrap().0.header.seq).collect();
    assert_eq!(taken, [1, 2, 3, 4, 5, 6]);
    let answers = recording.channel(UNDERSTOOD).unwrap().map(|m| m.unwrap().0);
    let answers: Vec<_> = answers.map(|answer| (answer.header.source_seq, answer.accepted)).collect();
    assert_eq!(answers, (1..=6).map(|drawing| (drawing, 1)).collect::<Vec<_>>());
}

/// A pad whose checkpoints are damaged no longer has anything that was drawn. A driving robot can still be stopped, and drawings
/// that are sent again are accepted.
#[test]
fn a_pad_without_its_state_stops_the_robot_and_continues() {
    let stage = Stage::new("forgetful", "--speed 1");
    let mut page = stage.page();
    draw(&mut page);
    assert_eq!(page.order("execute").0, 200);
    page.until("way driven", |feed| feed["task"]["path_m"].as_f64().is_some_and(|way| way > 0.2));
    let slots: Vec<_> = stage.place.files_of(stage.name);
    let slots: Vec<_> = slots.iter().filter(|path| path.contains("checkpoint_pad_")).collect();
    assert_eq!(slots.len(), 2, "{slots:?}");
    let before = stage.place.serving(stage.name, "pad");
    for slot in slots {
        let file = std::fs::OpenOptions::new().read(true).write(true).open(slot).unwrap();
        let mut byte = [0];
        file.read_exact_at(&mut byte, 40).unwrap();
        file.write_all_at(&[!byte[0]], 40).unwrap();
    }
    before.iter().for_each(|&pid| kill_if_alive(pid));
    wait_until("the pad", || stage.place.serving(stage.name, "pad").iter().any(|pid| !before.contains(pid)));
    let mut page = loop {
        if let Ok(page) = Page::try_open(stage.port, None) {
            break page;
        }
    };
    assert_eq!((&page.hello["drives"], &page.hello["drawing"]), (&json!(true), &Value::Null));
    page.until_allowed("abort");
    assert_eq!(page.order("abort").0, 200);
    page.until_state("no-sketch");
    page.until_allowed("sketch");
    draw(&mut page);
    stage.end();
}

/// In spite of silent connections, bodies that never arrive and pages that only watch, the driving page keeps working,
/// and a new page with a request is served.
#[test]
fn a_flood_of_connections_locks_out_no_user() {
    let stage = Stage::new("flooded", "--speed 3");
    let mut driver = stage.page();
    draw(&mut driver);
    assert_eq!(driver.order("execute").0, 200);
    driver.until_state("driving");
    let connect = || {
        let stream = std::net::TcpStream::connect(("127.0.0.1", stage.port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(120))).unwrap();
        stream
    };
    let said = |mut stream: std::net::TcpStream| {
        let mut text = String::new();
        let _ = stream.read_to_string(&mut text);
        parsed(&text).unwrap_or_else(|| panic!("no answer: {text:?}"))
    };
    let silent: Vec<_> = (0..300)
        .map(|_| {
            let mut stream = connect();
            stream.write_all(b"GET / HTTP/1.1\r\nhost: ").unwrap();
            stream
        })
        .collect();
    let mut silent = silent.into_iter();
    let (status, words) = said(silent.next().unwrap());
    assert!(status == 503 && words["error"].as_str().unwrap().contains("too many"), "{status} {words}");
    assert_eq!(request(stage.port, "GET /", &[], b"").0, 200, "a newcomer's page");
    let mut newcomer = stage.page();
    newcomer.until_state("driving");
    let (status, words) = said(silent.next_back().unwrap());
    assert!(status == 408 || status == 503, "in the end it gets the reason: {status} {words}");
    // Each wait above and below takes ten seconds, and a page that sends nothing for twenty seconds is assumed to be
    // gone.
    newcomer.respond();
    let mut talkative = connect();
    talkative.write_all(&[b"GET / HTTP/1.1\r\nx: ".as_slice(), &[b'x'; 20_000]].concat()).unwrap();
    assert_eq!(said(talkative).0, 431);

    // A page that only watches may have a few requests in progress, but does not use up the places for drawings.
    let session = newcomer.session();
    let head = format!(
        "POST /api/order HTTP/1.1\r\nhost: 127.0.0.1:{}\r\nx-sketchnav-session: {session}\r\nx-sketchnav-token: {TOKEN}\r\ncontent-length: 90\r\n\r\n",
        stage.port
    );
    let slow: Vec<_> = (0..6)
        .map(|_| {
            let mut stream = connect();
            stream.write_all(head.as_bytes()).unwrap();
            stream
        })
        .collect();
    wait_until("too many of one session", || {
        let (status, answer) = newcomer.post("/api/wheel", b"");
        status == 429 && answer["error"].as_str().unwrap().contains("at the same time")
    });
    let (status, words) = said(slow.into_iter().next().unwrap());
    assert!(status == 408 && words["error"].as_str().unwrap().contains("within"), "{status} {words}");
    newcomer.respond();

    // There are as many pages as allowed, and one more. The driving page has a reserved place.
    let pages: Vec<_> = (1..16).map(|_| stage.page()).collect();
    let (status, words) = request(stage.port, "GET /api/seat", &[], b"");
    assert!(status == 503 && words["error"].as_str().unwrap().contains("open pages"), "{status} {words}");
    let session = driver.session();
    driver.vanish();
    let mut driver = Page::open(stage.port, Some(&session));
    assert_eq!(driver.hello["drives"], true);
    let ended = driver.until_state("ended");
    assert_eq!(ended["task"]["reached"], 1, "{ended}");
    assert_eq!(driver.order("again").0, 200);
    drop((pages, silent));
    stage.end();
}

/// Checks the text that Prometheus would read, with Prometheus's own tool if this machine has it.
fn are_metrics(text: &str) {
    for line in
        ["sketchnav_process_up{process=\"localizer\"} 1", "# TYPE sketchnav_channel_messages_total counter"]
    {
        assert!(text.lines().any(|found| found == line), "{line}: {text}");
    }
    let scans = text
        .lines()
        .find_map(|line| line.strip_prefix("sketchnav_channel_messages_total{channel=\"scan\"} "));
    assert!(scans.unwrap().parse::<u64>().unwrap() > 0, "{text}");
    let Some(mut promtool) = needs::program("promtool") else { return };
    let mut promtool = promtool.args(["check", "metrics"]).stdin(Stdio::piped()).spawn().unwrap();
    promtool.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
    assert!(promtool.wait().unwrap().success(), "{text}");
}

/// Changes of the shared drawing by a page that does not drive.
fn change(entries: &[Value]) -> Value {
    json!({ "sheet": { "id": "kitchen", "canvas": [2540, 1252] }, "instead": "", "entries": entries })
}

fn wall(id: &str, time: u64) -> Value {
    let shape = json!({ "strokes": { "points": [[1, 1], [200, 1]], "width_px": 5 } });
    json!({ "id": id, "time": time, "by": "anna", "order": 1, "shape": shape })
}

/// A page that sends invalid changes, too many or too large ones changes nothing, and the others still draw, and stop the robot.
#[test]
fn all_pages_hear_what_one_draws_and_a_flood_stops_nobody() {
    let stage = Stage::new("together", "");
    let (mut driver, mut guest) = (stage.page(), stage.page());
    guest.must("/api/draw", &change(&[wall("a", 1)]));
    driver.until_it("the wall", |page| page.drawn.contains_key("a"));
    let presence = json!({ "name": "Berta", "sheet": "kitchen", "at": [5, 5], "draft": [[1, 1], [5, 5]] });
    guest.say(&json!({ "presence": presence }));
    driver.until_it("Berta", |page| page.people["all"][1]["name"] == "Berta");
    let mut late = stage.page();
    late.until_it("the drawing", |page| page.drawn.contains_key("a"));

    for (body, status, words) in [
        (b"{".to_vec(), 400, "the change"),
        (change(&[wall("b", 1), wall("<b>", 1)]).to_string().into_bytes(), 400, "entries[1]"),
        (vec![b' '; (8 << 20) + 1], 413, "bytes"),
    ] {
        let (found, answer) = guest.post("/api/draw", &body);
        assert_eq!(found, status, "{answer}");
        assert!(answer["error"].as_str().unwrap().contains(words), "{answer}");
    }
    for i in 0..200 {
        let (status, answer) = guest.post("/api/draw", change(&[wall("c", 2 + i)]).to_string().as_bytes());
        assert!([200, 429].contains(&status), "{answer}");
    }
    driver.must("/api/draw", &change(&[wall("d", 1)]));
    driver.until_it("its own wall", |page| page.drawn.contains_key("d"));
    assert_eq!(driver.drawn.keys().map(String::as_str).collect::<Vec<_>>(), ["a", "c", "d"]);
    assert_eq!(driver.order("abort").0, 409, "nothing is in progress");
    stage.end();
}

#[test]
fn a_mission_from_a_file_is_watched_aborted_and_resumed() {
    let (place, port) = (Place::new(), free_port());
    let mission = repository().join(LABORATORY);
    let line = format!("run {} --speed 5 --pad --port {port} --system watched --json", mission.display());
    let mut running = place.start(&line);
    wait_for(&mut running, port);
    let mut page = Page::open(port, None);
    page.until("walls", |feed| feed["walls"] != 0);
    while page.hello["canvas"] != json!([1320, 980]) {
        page.read();
    }
    assert_eq!(page.hello["mode"], "watches");
    page.until_allowed("abort");
    are_metrics(&body(port, "/metrics"));
    assert_eq!(page.post("/api/sketch", &strokes()).0, 409);
    assert_eq!(page.order("abort").0, 200);
    page.until_state("aborted");
    page.until_allowed("restore");
    assert_eq!(page.order("restore").0, 200);
    page.until_state("driving");
    drop(page);
    let ended = running.end();
    assert!(ended.code == Some(0) || ended.code == Some(1), "{ended}");
    assert!(!ended.out.contains("aborted"), "{ended}");
    // The figures that the pad reports when it ends appear in the report like those of any other process. They were
    // once missing.
    let report = ended.json();
    let processes: Vec<_> = report["processes"].as_array().unwrap().iter().map(|p| &p["process"]).collect();
    assert!(processes.contains(&&json!("pad")), "{report}");
}

/// Returns the number that follows `before` in the first of the feed's texts in which there is one, such as "37 % of
/// the route".
fn number_in_words(feed: &Value, before: &str) -> Option<u64> {
    let mut words = feed["words"].as_array()?.iter().filter_map(Value::as_str);
    words.find_map(|words| words.split_once(before)?.1.split(' ').next()?.parse().ok())
}

/// The page for a route past landmarks shows the matched state, the objects that match it, and the position along the
/// route.
#[test]
fn a_route_past_landmarks_is_watched() {
    let (place, port) = (Place::new(), free_port());
    let mission = repository().join("sim/missions/landmarks/scene-a.toml");
    let line = format!("run {} --speed 4 --pad --port {port} --system landmarks --json", mission.display());
    let mut running = place.start(&line);
    wait_for(&mut running, port);
    let mut page = Page::open(port, None);
    page.until("walls", |feed| feed["walls"] != 0);
    page.until("a matched state", |feed| number_in_words(feed, "until state ") > Some(3));
    page.until("a place half-way", |feed| number_in_words(feed, "") > Some(50));
    let is_object = |shape: &Value| {
        let is_round = shape["shape"] == "rings" || shape["shape"] == "discs";
        is_round && shape["points"].as_array().is_some_and(|all| !all.is_empty())
    };
    page.until("objects", |feed| feed["scene"].as_array().is_some_and(|scene| scene.iter().any(is_object)));
    page.until("a pose", |feed| feed["pose"]["tracking"] == "tracking");
    drop(page);
    let ended = running.end();
    assert_eq!(ended.code, Some(0), "{ended}");
}

/// A run that failed at its start once left an empty folder. The folder was only removed if a system could not be
/// started, but not if a page had no address to listen on. (192.0.2.1 belongs to no host: RFC 5737.)
#[test]
fn a_page_without_an_address_leaves_no_folder() {
    let place = Place::new();
    let mission = repository().join(LABORATORY);
    let site = "--bind 192.0.2.1 --port 0 --out out";
    for command in [format!("run {} --pad {site}", mission.display()), format!("demo --pad {site}")] {
        let ended = place.run(&command);
        assert!(ended.code == Some(2) && ended.err.contains("192.0.2.1"), "{command}: {ended}");
        let left = std::fs::read_dir(place.files().join("out")).map_or(0, Iterator::count);
        assert_eq!(left, 0, "{command}");
    }
}

/// While the sketcher reads a large photo, the planner of a mission from a file waits, or sends nothing at all in
/// lockstep. The pad used to answer an abort with `ok` during that time without passing it on, and the robot drove off
/// a second later. Here the sketcher is not started until the mission has been aborted.
#[test]
fn an_abort_before_the_robot_drives_is_obeyed() {
    for (name, speed) in [("early", "2"), ("early-lockstep", "max")] {
        let (place, port) = (Place::new(), free_port());
        let mission = repository().join(LABORATORY);
        let options = format!("--speed {speed} --pad --port {port} --system {name} --without sketcher");
        let mut running = place.start(&format!("run {} {options}", mission.display()));
        wait_for(&mut running, port);
        let mut page = Page::open(port, None);
        let (status, answer) = page.order("abort");
        assert_eq!((status, &answer["ok"]), (200, &json!(true)), "{answer}");
        let sketcher = place.start(&format!("serve sketcher --system {name}"));
        page.until_allowed("restore");
        assert_eq!((&page.feed["state"], &page.feed["task"]["path_m"]), (&json!("aborted"), &json!(0.0)));
        // There is nothing left to abort, as the answer states.
        let (status, answer) = page.order("abort");
        assert!(status == 409 && answer["error"].as_str().unwrap().contains("aborted"), "{status} {answer}");
        assert_eq!(page.order("restore").0, 200);
        drop(page);
        running.signal(Signal::SIGINT);
        let _ = (running.end(), sketcher.end());
        place.assert_nothing_left(name);
    }
}

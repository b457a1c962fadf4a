//! The pad's page in a real browser, driven through playwright-core, for the test and the benchmark.

use std::env::var_os;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

use sketchnav_schemas::mission::Mission;
use sketchnav_sketch::mission::SketchMission;

use needs::skipped;

use super::{Ended, Place, Running, repository};

/// The mission whose drawing and route the pen follows.
pub const MISSION: &str = "sim/missions/routes/court-01";
/// Maximum time for the whole script in the browser, which exceeds any wait in the script.
const LIMIT: Duration = Duration::from_secs(420);

/// A browser and the library that drives it.
pub struct Browser {
    playwright: PathBuf,
    chromium: PathBuf,
}

impl Browser {
    /// Finds the browser and the library, or prints a notice if either is missing.
    pub fn find() -> Option<Self> {
        let folder = || repository().join("target/browser");
        let playwright = var_os("SKETCHNAV_PLAYWRIGHT").map_or_else(folder, PathBuf::from);
        let chromium = var_os("SKETCHNAV_CHROMIUM").map_or_else(|| "/usr/bin/chromium".into(), PathBuf::from);
        let is_there = playwright.join("node_modules/playwright-core").is_dir() && chromium.exists();
        if !is_there {
            skipped(
                "browser",
                "no playwright-core (SKETCHNAV_PLAYWRIGHT) or no chromium (SKETCHNAV_CHROMIUM)",
            );
        }
        (is_there && needs::has(&["node"])).then_some(Self { playwright, chromium })
    }

    /// Draws like a person with a pen, sends the drawing, drives, stops and arrives on the page at `link`. The output
    /// contains the measurements.
    pub fn draws_and_drives(&self, place: &Place, link: &str, feed_seconds: u32) -> Ended {
        let mut script = drawing_script("browser.mjs", place, link);
        script.env("SKETCHNAV_FEED_SECONDS", feed_seconds.to_string());
        script.env("SKETCHNAV_PAD_PID", place.pid("pad", "pad").to_string());
        self.runs(script)
    }

    /// Takes part in a study on the page at `link`.
    pub fn takes_part(&self, place: &Place, link: &str) -> Ended {
        self.runs(drawing_script("study.mjs", place, link))
    }

    /// Selects, moves, turns and edits shapes on the page at `link`, with mouse, pen, fingers and keys.
    pub fn selects(&self, place: &Place, link: &str) -> Ended {
        let mut script = needs::program("node").expect("node, which was there before");
        script.arg(repository().join("tests/pad/selecting.mjs")).arg(link).arg(place.files());
        self.runs(script)
    }

    /// Draws, closes pages, kills the browser and uses the library on the page at `link` (`phase` is `draws`), or, after the
    /// server has ended, opens the page again in the same browser profile (`offline`).
    pub fn keeps(&self, place: &Place, link: &str, phase: &str) -> Ended {
        let mut script = needs::program("node").expect("node, which was there before");
        script.arg(repository().join("tests/pad/keeping.mjs")).arg(link).arg(place.files()).arg(phase);
        self.runs(script)
    }

    /// Imports drawings and pictures of other programs, and saves pictures, on the page at `link`.
    pub fn exchanges(&self, place: &Place, link: &str) -> Ended {
        let mut script = needs::program("node").expect("node, which was there before");
        script.arg(repository().join("tests/pad/exchanging.mjs")).arg(link).arg(place.files());
        self.runs(script)
    }

    /// Makes a drawing that no robot could drive by, and repairs it, on the page at `link`.
    pub fn checks(&self, place: &Place, link: &str) -> Ended {
        let mut script = needs::program("node").expect("node, which was there before");
        script.arg(repository().join("tests/pad/checking.mjs")).arg(link).arg(place.files());
        self.runs(script)
    }

    /// Draws the demo's building on the page at `link`, accepts the robot's learned map, drives in it, and rejects it.
    pub fn learns(&self, place: &Place, link: &str) -> Ended {
        let mut script = needs::program("node").expect("node, which was there before");
        script.arg(repository().join("tests/pad/learning.mjs")).arg(link);
        script.arg(repository().join("sim/missions/building/sketch-a.svg")).arg(place.files());
        self.runs(script)
    }

    /// Draws the hall on the page at `link` with a goal but no start, and lets the robot find out where it is.
    pub fn finds_the_start(&self, place: &Place, link: &str) -> Ended {
        let mut script = needs::program("node").expect("node, which was there before");
        script.arg(repository().join("tests/pad/unmarked.mjs")).arg(link);
        script.arg(repository().join("sim/missions/hall/hall.svg")).arg(place.files());
        self.runs(script)
    }

    /// Draws a route past landmarks on the page at `link`, marks the position of the lost robot, and draws the rest of the route.
    pub fn passes_landmarks(&self, place: &Place, link: &str) -> Ended {
        let mut script = needs::program("node").expect("node, which was there before");
        script.arg(repository().join("tests/pad/landmarks.mjs")).arg(link);
        script.arg(repository().join("sim/missions/landmarks/sketches/pad.json")).arg(place.files());
        self.runs(script)
    }

    /// Waits until the robot asks on the page at `link`, and answers with a tap and with a button.
    pub fn answers(&self, place: &Place, link: &str) -> Ended {
        let mut script = needs::program("node").expect("node, which was there before");
        script.arg(repository().join("tests/pad/asking.mjs")).arg(link).arg(place.files());
        self.runs(script)
    }

    /// Asks for the wheel on one page at `link` and hands it over on another, while the robot drives.
    pub fn hands_over(&self, place: &Place, link: &str) -> Ended {
        let mut script = needs::program("node").expect("node, which was there before");
        script.arg(repository().join("tests/pad/handing.mjs")).arg(link).arg(place.files());
        self.runs(script)
    }

    /// Draws on several pages at `link` at once, breaks a link, hands over the wheel and drives.
    pub fn draws_together(&self, place: &Place, link: &str) -> Ended {
        let mut script = drawing_script("together.mjs", place, link);
        script.env("SKETCHNAV_PAD_PID", place.pid("pad", "pad").to_string());
        self.runs(script)
    }

    fn runs(&self, mut script: Command) -> Ended {
        script.env("SKETCHNAV_PLAYWRIGHT", &self.playwright).env("SKETCHNAV_CHROMIUM", &self.chromium);
        script.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        Running::spawn(script).end_within(LIMIT)
    }
}

/// Returns a script that draws the mission's map and route on the page at `link`.
fn drawing_script(name: &str, place: &Place, link: &str) -> Command {
    let route = place.files().join("route.json");
    let sketch = SketchMission::of(&mission()).unwrap();
    fs::write(&route, serde_json::to_vec(&sketch.tasks[0].aim.route()).unwrap()).unwrap();
    let mut script = needs::program("node").expect("node, which was there before");
    script.arg(repository().join("tests/pad").join(name)).arg(link);
    script.arg(repository().join(format!("{MISSION}.json"))).arg(route).arg(place.files());
    script
}

/// Reads the mission whose drawing and route the pen follows.
pub fn mission() -> Mission {
    let file = repository().join(format!("{MISSION}.toml"));
    Mission::parse(&fs::read_to_string(file).unwrap()).unwrap()
}

/// Starts the pad, as the system `pad`, in the mission's world, and returns the link that it prints.
pub fn pad(place: &Place) -> (Running, String) {
    pad_in(place, MISSION, 1)
}

/// Like [`pad`], but in the world of any mission of the repository, and `speed` times as fast as real time.
pub fn pad_in(place: &Place, mission: &str, speed: u32) -> (Running, String) {
    let file = repository().join(format!("{mission}.toml"));
    let options = format!("--port 0 --system pad --out results --speed {speed}");
    let mut command = place.command(&format!("pad --mission {} {options}", file.display()));
    let mut child = command.spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let link = lines.by_ref().map_while(Result::ok).find_map(|line| {
        let at = line.find("http://")?;
        line[at..].split_whitespace().next().map(str::to_owned)
    });
    // The pad's output must be read continuously, so that the pad never blocks on it.
    std::thread::spawn(move || lines.for_each(drop));
    let mut pad = Running::of(child);
    place.wait_until_joined(&mut pad, "pad", &["pad"]);
    (pad, link.expect("the pad's link"))
}

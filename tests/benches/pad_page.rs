//! Measures the cost of the pad's page in a browser: the time from pen to ink with 500 strokes on the sheet, the feed of a
//! mission at 10 Hz, and the size of the page.
//!
//! `cargo bench --bench pad_page` draws and drives with the browser of the test `pad_browser`, and prints a line for
//! each measurement.

use nix::sys::signal::Signal;
use serde_json::Value;
use support::Place;
use support::browser::{Browser, pad};

/// Duration of watching the feed, in seconds.
const FEED_SECONDS: u32 = 10;
/// Duration of a frame at 60 Hz, in milliseconds.
const FRAME_MS: f64 = 1000.0 / 60.0;
/// Maximum cost of the feed, in cores.
const FEED_CORES: f64 = 0.25;

fn main() {
    // `cargo test --benches` only checks that the benchmark starts.
    if std::env::args().any(|argument| argument == "--test") {
        return;
    }
    let Some(browser) = Browser::find() else { return };
    let place = Place::new();
    let (pad, link) = pad(&place);
    let ended = browser.draws_and_drives(&place, &link, FEED_SECONDS);
    assert_eq!(ended.code, Some(0), "{ended}");
    print(&ended.json());
    pad.signal(Signal::SIGINT);
    pad.end();
}

fn print(figures: &Value) {
    let figure = |name: &str| figures[name].as_f64().unwrap_or(f64::NAN);
    let (median, worst) = (figure("pen_to_ink_median_ms"), figure("pen_to_ink_worst_ms"));
    println!(
        "pen to ink, 500 strokes on the sheet: {median:.1} ms (median), {worst:.1} ms (worst); a frame is {FRAME_MS:.1} ms"
    );
    let (renderers, gpu) = (figure("feed_renderers_cores"), figure("feed_gpu_process_cores"));
    println!(
        "feed of {:.1} Hz: {renderers:.2} of a core in the page's processes, {gpu:.2} in the one that draws for it, {:.2} together; \
         the bar is {FEED_CORES}",
        figure("feed_hz"),
        renderers + gpu,
    );
    println!("link: {:.1} ms", figure("link_ms"));
    let [files, bytes, compressed] = ["page_files", "page_bytes", "page_gzip_bytes"].map(figure);
    println!(
        "page: {files} files, {:.0} kB, {:.0} kB compressed by gzip, each by itself",
        bytes / 1e3,
        compressed / 1e3
    );
}

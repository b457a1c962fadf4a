//! Measures how the cost of a survey and of a path grows with the number of dots, at one dot per window. Prints a table and the
//! exponent of the growth.

use std::time::Instant;

use sketchnav_directions::generate::uniform;
use sketchnav_directions::path::{Atlas, Measure, Objective, Start, best};
use sketchnav_directions::plane::Plane;
use sketchnav_directions::reliability::Reliability;
use sketchnav_directions::transitions::{Kinds, Transitions};
use sketchnav_directions::traversal::Noise;
use sketchnav_directions::{Error, Window};

#[allow(clippy::disallowed_methods, reason = "an example measures time")]
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let begin = Instant::now();
    let result = work();
    (result, begin.elapsed().as_secs_f64())
}

/// Peak memory usage of this process, in GiB, or 0 if the system doesn't report it.
#[allow(clippy::disallowed_methods, reason = "an example measures memory")]
fn peak_gib() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kib = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    kib.unwrap_or(0.0) / (1024.0 * 1024.0)
}

struct Row {
    dots: f64,
    transitions_s: f64,
}

fn row(dots: usize) -> Result<Row, Error> {
    let window = Window::new(10.0, 1.5)?;
    let side = 10.0 * (dots as f64).sqrt();
    let places = uniform(dots, side, 1)?.dots().to_vec();
    let (plane, index_s) = timed(|| Plane::new(places));
    let plane = plane?;
    let (transitions, transitions_s) = timed(|| Transitions::new(&plane, window, Kinds::PAPER));
    let (components, components_s) = timed(|| transitions.components());
    drop(transitions);
    let (atlas, atlas_s) =
        timed(|| Atlas::new(plane, window, Kinds::PAPER, Reliability::fitted(Noise::of_sigma(0.15))));
    // The path leads from near the south-west to near the north-east, within the largest component.
    let largest = (0..).zip(&components.sizes).max_by_key(|(_, size)| **size).map_or(0, |(name, _)| name);
    let members = || (0..dots as u32).filter(|&dot| components.of[dot as usize] == largest);
    let sum = |dot: &u32| (atlas.plane.dot(*dot).x + atlas.plane.dot(*dot).y) as i64;
    let (from, to) = (members().min_by_key(sum).unwrap_or(0), members().max_by_key(sum).unwrap_or(0));
    let start = Start::over(&atlas.plane, from)?;
    let find = |measure, objective| timed(|| best(&atlas, start, to, measure, objective));
    let (landmarks, landmarks_s) = find(Measure::Landmarks, Objective::SHORTEST);
    let (windows, windows_s) = find(Measure::Windows, Objective::SHORTEST);
    let (_, sure_s) = find(Measure::Landmarks, Objective::MOST_RELIABLE);
    println!(
        "{dots:>8} {index_s:>7.3} {transitions_s:>11.3} {components_s:>10.3} {atlas_s:>8.3} {landmarks_s:>9.3} \
         {windows_s:>8.3} {sure_s:>8.3} {:>6} {:>6.2}  {} components, largest {}",
        windows.map_or(0, |path| path.legs.len()),
        peak_gib(),
        components.count(),
        components.sizes.iter().max().unwrap_or(&0),
    );
    landmarks?;
    Ok(Row { dots: dots as f64, transitions_s })
}

fn main() -> Result<(), Error> {
    println!(
        "{:>8} {:>7} {:>11} {:>10} {:>8} {:>9} {:>8} {:>8} {:>6} {:>6}",
        "dots",
        "index",
        "transitions",
        "components",
        "atlas",
        "landmarks",
        "windows",
        "reliable",
        "legs",
        "GiB"
    );
    let most = std::env::args().nth(1).and_then(|word| word.parse().ok()).unwrap_or(1_000_000);
    let sizes = [1_000, 10_000, 100_000, 1_000_000].into_iter().filter(|&dots| dots <= most);
    let rows = sizes.map(row).collect::<Result<Vec<_>, _>>()?;
    if let [first, .., last] = &rows[..] {
        let exponent = (last.transitions_s / first.transitions_s).ln() / (last.dots / first.dots).ln();
        println!("transitions take time in proportion to the number of dots to the power of {exponent:.2}");
    }
    Ok(())
}

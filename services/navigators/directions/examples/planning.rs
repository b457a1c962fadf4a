//! Measures how long the methods take to plan a mission, by the number of dots, at one dot per window. Arguments: the error of a
//! position in mm (1 by default), and numbers of dots, if not 100, 1,000, 3,000 and 20,000.

use std::time::Instant;

use sketchnav_directions::arrival::{Effort, Pilot, WORDS, most_probable};
use sketchnav_directions::branching::{most_probable_branching, words};
use sketchnav_directions::description::Vocabulary;
use sketchnav_directions::generate::uniform;
use sketchnav_directions::navigator::Settings;
use sketchnav_directions::path::{Atlas, Measure, Objective, Start, best};
use sketchnav_directions::plan::Plan;
use sketchnav_directions::reliability::Reliability;
use sketchnav_directions::transitions::Kinds;
use sketchnav_directions::traversal::Noise;
use sketchnav_directions::{Descriptor, DotId, Error, Window};

#[expect(clippy::disallowed_methods, reason = "an example measures time")]
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let begin = Instant::now();
    let result = work();
    (result, begin.elapsed().as_secs_f64())
}

fn atlas(dots: usize, words: &[Descriptor], pilot: &Pilot) -> Result<Atlas, Error> {
    let plane = uniform(dots, 100.0 * (dots as f64).sqrt(), 1)?;
    let kinds = Kinds { words, trajectories: true };
    Ok(Atlas::new(plane, pilot.settings.window, kinds, Reliability::fitted(pilot.noise)))
}

/// Returns the start near one corner of the plane, and the dots from the opposite corner inwards.
fn across(atlas: &Atlas) -> Result<(Start, impl Iterator<Item = DotId>), Error> {
    let mut order: Vec<DotId> = (0..atlas.plane.len() as DotId).collect();
    let sum = |dot: &DotId| atlas.plane.dot(*dot).x + atlas.plane.dot(*dot).y;
    order.sort_by(|a, b| sum(a).total_cmp(&sum(b)));
    Ok((Start::over(&atlas.plane, order[0])?, order.into_iter().rev()))
}

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let sigma = arguments.next().and_then(|word| word.parse().ok()).unwrap_or(1.0);
    let given: Vec<usize> = arguments.filter_map(|word| word.parse().ok()).collect();
    let sizes = if given.is_empty() { vec![100, 1_000, 3_000, 20_000] } else { given };
    let settings = Settings::new(Window::new(100.0, 15.0)?, sigma);
    let pilot = Pilot { settings, noise: Noise::of_sigma(sigma) };
    let branching = words(Vocabulary::ALL);
    println!(
        "{:>8} {:>10} {:>8} {:>6} {:>7} {:>10}",
        "dots", "method", "atlas s", "plan s", "entries", "arrival %"
    );
    for dots in sizes {
        for (name, words) in [("simulated", &WORDS[..]), ("branching", &branching)] {
            let (atlas, atlas_s) = timed(|| atlas(dots, words, &pilot));
            let atlas = atlas?;
            let (start, mut goals) = across(&atlas)?;
            let leads =
                |&goal: &DotId| best(&atlas, start, goal, Measure::Windows, Objective::SHORTEST).is_ok();
            let goal = goals.find(leads).ok_or(Error::NoDots)?;
            let (plan, plan_s): (Result<Plan, Error>, f64) = timed(|| match name {
                "simulated" => most_probable(&atlas, start, goal, &pilot, Effort::USUAL, 1),
                _ => most_probable_branching(&atlas, start, goal, &pilot, Effort::USUAL, 1),
            });
            let plan = plan?;
            let arrival = 100.0 * plan.probability.unwrap_or(0.0);
            println!(
                "{dots:>8} {name:>10} {atlas_s:>8.2} {plan_s:>6.2} {:>7} {arrival:>10.1}",
                plan.map.entries().len()
            );
        }
    }
    Ok(())
}

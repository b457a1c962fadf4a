//! Compares the success of straight maps, branching maps, and a belief without a map on a choice of worlds. Arguments: the number
//! of worlds, the first seed, and optionally position errors in mm and methods.

use std::time::Instant;

use sketchnav_directions::arrival::Effort;
use sketchnav_directions::experiments::{Case, Choice, Setting, Success};
use sketchnav_schemas::statistics::mean;

#[expect(clippy::disallowed_methods, reason = "an example measures time")]
fn main() -> Result<(), sketchnav_directions::Error> {
    let mut arguments = std::env::args().skip(1);
    let worlds: u64 = arguments.next().and_then(|word| word.parse().ok()).unwrap_or(20);
    let first: u64 = arguments.next().and_then(|word| word.parse().ok()).unwrap_or(700_000);
    let rest: Vec<String> = arguments.collect();
    let sigmas: Vec<f64> = rest.iter().filter_map(|word| word.parse().ok()).collect();
    let names = rest.len() > sigmas.len();
    let chosen = |name: &str| !names || rest.iter().any(|word| word == name);
    let effort = Effort::USUAL;
    for sigma in if sigmas.is_empty() { vec![5.0, 3.0, 1.0] } else { sigmas } {
        for (name, choice) in [
            ("simulated", Choice::Simulated(effort)),
            ("branching", Choice::Branching(effort)),
            ("belief", Choice::Belief(effort)),
        ]
        .into_iter()
        .filter(|(name, _)| chosen(name))
        {
            let begin = Instant::now();
            let setting = Setting::of_sigma(sigma)?;
            let case = Case { name: name.into(), method: name, choice, setting, journeys: 20 };
            let attempts =
                (first..first + worlds).map(|seed| case.attempt(seed)).collect::<Result<Vec<_>, _>>()?;
            let result = Success::of(&attempts);
            let each_s = begin.elapsed().as_secs_f64() / f64::from(result.planned.max(1));
            println!(
                "{sigma} mm {name}: {:.1} % of {} worlds, stated {:.1} %, {:.1} entries, {each_s:.2} s a world, kinds {:?}",
                100.0 * mean(&result.arrived),
                result.planned,
                100.0 * mean(&result.stated.iter().map(|(stated, _)| *stated).collect::<Vec<_>>()),
                mean(&result.entries),
                result.tally.counts,
            );
        }
    }
    Ok(())
}

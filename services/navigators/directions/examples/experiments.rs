//! Prints the tables of the experiments. Words choose among them: `worlds`, `journeys`, `calibration`; none means all. A
//! number says over how many worlds the journeys go; by default 200.

use sketchnav_directions::arrival::Effort;
use sketchnav_directions::experiments::{self, Setting};
use sketchnav_directions::{Error, fit};

fn worlds() -> Result<(), Error> {
    println!("{}", experiments::windows(&[25, 50, 100, 200, 300, 400, 600, 800, 1200], 20, 1)?);
    println!("{}", experiments::parkways(&[10, 25, 50, 75, 100, 150, 200, 300, 450], 20, 1)?);
    println!("{}", experiments::components(&[25, 50, 100, 150, 200, 300, 450], 20, 1)?);
    println!("{}", experiments::reliability(fit::Effort::FULL, 1995));
    println!("{}", experiments::costs_of_one_world(2)?);
    println!("{}", experiments::recoverable(&[50, 100, 150, 200, 300], 10, 1)?);
    Ok(())
}

fn main() -> Result<(), Error> {
    let (numbers, words): (Vec<String>, Vec<String>) =
        std::env::args().skip(1).partition(|word| word.parse::<u64>().is_ok());
    let worlds_number = numbers.first().and_then(|word| word.parse().ok()).unwrap_or(200);
    let wants = |word: &str| words.is_empty() || words.iter().any(|chosen| chosen == word);
    if wants("worlds") {
        worlds()?;
    }
    if wants("journeys") {
        println!("{}", experiments::words_and_windows(1.0, 0..worlds_number, 5)?);
        println!("{}", experiments::clutter(3.0, 0..worlds_number, 5)?);
        println!("{}", experiments::costs(&[1.0, 3.0, 5.0], 1, 0..worlds_number, 5)?);
        println!("{}", experiments::costs(&[5.0], 9, 0..worlds_number, 5)?);
    }
    if wants("calibration") {
        let worlds = 1000..1000 + worlds_number;
        let sigmas = [1.0, 2.0, 3.0, 5.0, 8.0].map(Setting::of_sigma);
        let settings = sigmas.into_iter().collect::<Result<Vec<_>, _>>()?;
        println!("{}", experiments::calibration(&settings, Effort::USUAL, worlds.clone(), 4)?.table());
        println!("All errors at once:");
        println!(
            "{}",
            experiments::calibration(&[Setting::of_all_errors()?], Effort::USUAL, worlds, 4)?.table()
        );
    }
    Ok(())
}

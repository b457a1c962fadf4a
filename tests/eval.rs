//! Experiments: what their figures rest on is what the processes do.

mod support;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use support::{Ended, Place, repository};

/// Runs a suite of this checkout.
fn eval(place: &Place, arguments: &str) -> Ended {
    place.run(&format!("eval {arguments} --project {}", repository().display()))
}

#[test]
fn trials_by_the_processes_give_the_same_messages() {
    let place = Place::new();
    let ended = eval(
        &place,
        "laboratory --drawings a --trials 1 --method beam,boniardi-2015 --check-processes 2 --json",
    );
    assert_eq!(ended.code, Some(0), "{ended}");
    let found = &ended.json()["processes"];
    assert_eq!((&found["checked"], &found["identical"]), (&2.into(), &2.into()), "{found:#}");
}

/// Nothing to check was once an error, after all had been driven, and no figure was told.
#[test]
fn a_check_of_no_trial_is_none() {
    let place = Place::new();
    let ended = eval(&place, "laboratory --drawings a --trials 1 --sample 1 --check-processes 0 --json");
    assert_eq!(ended.code, Some(0), "{ended}");
    assert_eq!(ended.json()["processes"]["checked"], 0, "{ended}");
}

/// Whoever took the folder of `--output` away while hours of trials were driven lost all their results. They are printed
/// all the same. A folder that is missing from the beginning is told before anything is driven.
#[test]
fn results_are_printed_also_where_no_report_can_be_written() {
    let place = Place::new();
    let taken = place.files().join("taken");
    std::fs::create_dir(&taken).unwrap();
    let one = "laboratory --drawings a --trials 1 --sample 1 --json";
    let ended = eval(&place, &format!("{one} --output {}", taken.display()));
    assert_eq!(ended.code, Some(3), "{ended}");
    assert!(ended.err.contains("taken"), "{ended}");
    assert!(!ended.json()["outcomes"].as_array().unwrap().is_empty(), "{ended}");
    let ended = eval(&place, &format!("{one} --output {}/nowhere/page.html", place.files().display()));
    assert_eq!(ended.code, Some(2), "{ended}");
    assert!(ended.err.contains("--output: expected a file in an existing folder"), "{ended}");
}

/// The folders of missions and data were those of the machine that compiled the program, and a suite that found no data
/// there drove nothing and succeeded.
#[test]
fn who_lacks_missions_or_data_or_trials_is_told_what_to_do() {
    let place = Place::new();
    for (arguments, words) in [
        (
            format!("--project {} --data {}", repository().display(), place.files().display()),
            "SKETCHNAV_DATA",
        ),
        (String::new(), "--project DIR"),
    ] {
        let ended = place.run(&format!("eval people {arguments}"));
        assert_eq!(ended.code, Some(2), "{ended}");
        assert!(ended.err.contains(words), "{ended}");
    }
    let ended = eval(&place, "laboratory --sample 0");
    assert_eq!(ended.code, Some(2), "{ended}");
    assert!(ended.err.contains("no trial"), "{ended}");
}

/// One in eight numbers of a run once reached the processes with another last bit: the parser of JSON
/// rounded them as it liked.
#[test]
fn the_numbers_of_a_run_lose_no_bit_on_their_way_to_the_processes() {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    for _ in 0..10_000 {
        let number = 2540.0 * rng.random::<f64>();
        let text = serde_json::to_string(&number).unwrap();
        assert_eq!(serde_json::from_str::<f64>(&text).unwrap().to_bits(), number.to_bits(), "{text}");
    }
}

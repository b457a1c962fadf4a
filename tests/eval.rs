//! Experiments: what their figures rest on is what the processes do.

mod support;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use support::Place;

#[test]
fn trials_by_the_processes_give_the_same_messages() {
    let place = Place::new();
    let arguments = "eval laboratory --drawings a --trials 1 --method ours,paper --check-processes 2 --json";
    let ended = place.run(arguments);
    assert_eq!(ended.code, Some(0), "{ended}");
    let found = &ended.json()["processes"];
    assert_eq!((&found["checked"], &found["identical"]), (&2.into(), &2.into()), "{found:#}");
}

/// Nothing to check was once an error, after all had been driven, and no figure was told.
#[test]
fn a_check_of_no_trial_is_none() {
    let place = Place::new();
    let ended = place.run("eval laboratory --drawings a --trials 1 --sample 1 --check-processes 0 --json");
    assert_eq!(ended.code, Some(0), "{ended}");
    assert_eq!(ended.json()["processes"]["checked"], 0, "{ended}");
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

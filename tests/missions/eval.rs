//! The figures of experiments agree with those of separate processes.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use support::{Ended, Place, repository};

/// Runs a suite of this checkout.
fn eval(place: &Place, arguments: &str) -> Ended {
    place.run(&format!("eval {arguments} --project {}", repository().display()))
}

#[test]
fn trials_run_as_processes_give_the_same_messages() {
    let place = Place::new();
    let ended = eval(
        &place,
        "laboratory --drawings a --trials 1 --method beam,boniardi-2015 --check-processes 2 --json",
    );
    assert_eq!(ended.code, Some(0), "{ended}");
    let found = &ended.json()["processes"];
    assert_eq!((&found["checked"], &found["identical"]), (&2.into(), &2.into()), "{found:#}");
}

/// With nothing to check, `eval` once failed after everything had been driven, and printed no figures.
#[test]
fn checking_no_trial_is_allowed() {
    let place = Place::new();
    let ended = eval(&place, "laboratory --drawings a --trials 1 --sample 1 --check-processes 0 --json");
    assert_eq!(ended.code, Some(0), "{ended}");
    assert_eq!(ended.json()["processes"]["checked"], 0, "{ended}");
}

/// If the folder of `--output` was removed while trials were driven for hours, all results used to be lost. They are
/// now printed anyway. A folder that is missing from the start is reported before anything is driven.
#[test]
fn results_are_printed_even_if_no_report_can_be_written() {
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

/// The folders of missions and data used to be those of the machine that compiled the program, and a suite without data succeeded
/// without driving anything.
#[test]
fn missing_missions_data_or_trials_are_reported_with_a_remedy() {
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

/// One in eight numbers of a run once reached the processes with a different last bit, because the JSON parser rounded
/// inexactly.
#[test]
fn numbers_reach_the_processes_bit_for_bit() {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    for _ in 0..10_000 {
        let number = 2540.0 * rng.random::<f64>();
        let text = serde_json::to_string(&number).unwrap();
        assert_eq!(serde_json::from_str::<f64>(&text).unwrap().to_bits(), number.to_bits(), "{text}");
    }
}

/// A few drives that take hardly any time.
const FEW: &str = "laboratory --drawings a --trials 3 --seed 3";

/// Drives the jobs of [`FEW`] one by one into the folder `parts`, each as a separate machine would. Returns the number
/// of jobs.
fn in_parts(place: &Place) -> usize {
    std::fs::create_dir(place.files().join("parts")).unwrap();
    let listed = eval(place, &format!("{FEW} --list-jobs --json")).json();
    let jobs = listed["jobs"].as_array().unwrap().len();
    for job in 1..=jobs {
        let ended = eval(place, &format!("{FEW} --job {job} -o parts/{job}.json"));
        assert_eq!(ended.code, Some(0), "{ended}");
    }
    jobs
}

/// Returns the report without figures that were measured by the clock.
fn timeless(output: &Ended) -> serde_json::Value {
    let mut output = output.json();
    output["wall_seconds"] = 0.into();
    output["outcomes"]
        .as_array_mut()
        .unwrap()
        .iter_mut()
        .for_each(|ended| ended["cost"]["busy_s"] = 0.into());
    output
}

#[test]
fn an_experiment_in_parts_has_the_report_of_one_machine_byte_for_byte() {
    let place = Place::new();
    let jobs = in_parts(&place);
    assert_eq!(jobs, 3);
    // A worker that was assumed dead delivers after all. Its part contains a range of jobs.
    let ended = eval(&place, &format!("{FEW} --job 2-3 -o parts/again.json"));
    assert_eq!(ended.code, Some(0), "{ended}");
    let local = eval(&place, &format!("{FEW} -o page.html --verbose"));
    let page = || std::fs::read(place.files().join("page.html")).unwrap();
    let local_page = page();
    let merged = eval(&place, &format!("{FEW} -o page.html --verbose --merge parts"));
    assert_eq!((merged.code, local.code), (Some(0), Some(0)), "{merged}");
    assert_eq!(merged.out, local.out);
    assert!(page() == local_page, "the pages differ");
    let [local, merged] =
        ["", "--merge=parts"].map(|options| timeless(&eval(&place, &format!("{FEW} --json {options}"))));
    assert_eq!(local, merged);
}

/// A study of three worlds. Each of them is a job.
const STUDY: &str = "directions-views --trials 3 --seed 2";

#[test]
fn a_study_in_parts_has_the_report_of_one_machine_byte_for_byte() {
    let place = Place::new();
    std::fs::create_dir(place.files().join("parts")).unwrap();
    let listed = eval(&place, &format!("{STUDY} --list-jobs --json")).json();
    assert_eq!(listed["jobs"].as_array().unwrap().len(), 3);
    for jobs in ["1", "2-3", "3"] {
        let ended = eval(&place, &format!("{STUDY} --job {jobs} -o parts/{jobs}.json"));
        assert_eq!(ended.code, Some(0), "{ended}");
    }
    let page = || std::fs::read(place.files().join("page.html")).unwrap();
    for option in ["", "--json"] {
        let local = eval(&place, &format!("{STUDY} {option} -o page.html"));
        let local_page = page();
        let merged = eval(&place, &format!("{STUDY} {option} -o page.html --merge parts"));
        assert_eq!((merged.code, local.code), (Some(0), Some(0)), "{merged}");
        assert_eq!(merged.out, local.out);
        assert!(page() == local_page, "the pages differ");
    }
    let refused = |options: &str, words: &str| {
        let ended = eval(&place, options);
        assert_eq!(ended.code, Some(2), "{options}: {ended}");
        assert!(ended.err.contains(words), "{options}: {ended}");
    };
    refused("directions-views --trials 4 --seed 2 --merge parts", "experiment: expected 4 jobs");
    refused("directions-views --trials 3 --seed 1 --merge parts", "seed: expected 1, found 2");
    refused("directions-success --trials 3 --seed 2 --merge parts", "suite: expected directions-success");
    refused(&format!("{STUDY} --job 4 -o parts/none.json"), "--job: expected numbers from 1 to 3, found 4-4");
    refused("directions-paths --list-jobs", "--list-jobs: directions-paths is not divided into jobs");
}

#[test]
fn missing_and_foreign_parts_are_refused() {
    let place = Place::new();
    let jobs = in_parts(&place);
    let refused = |options: &str, words: &str| {
        let ended = eval(&place, options);
        assert_eq!(ended.code, Some(2), "{options}: {ended}");
        assert!(ended.err.contains(words), "{options}: {ended}");
    };
    let other_seed = FEW.replace("--seed 3", "--seed 4");
    refused(&format!("{other_seed} --merge parts"), "seed: expected 4, found 3");
    refused("laboratory --drawings b --trials 3 --seed 3 --merge parts", "experiment: expected");
    refused(&format!("{FEW} --set localizer.beams=30 --merge parts"), "merge with the options of the jobs");
    refused(&format!("{FEW} --job {} -o parts/none.json", jobs + 1), "--job: expected numbers from 1 to");
    refused(&format!("{FEW} --job 0 -o parts/none.json"), "expected the number of a job");
    refused(&format!("{FEW} --merge nowhere"), "--merge nowhere");

    let part = place.files().join("parts/1.json");
    let text = std::fs::read_to_string(&part).unwrap();
    let edited = |from: &str, to: &str| {
        assert!(text.contains(from), "{text}");
        std::fs::write(&part, text.replace(from, to)).unwrap();
    };
    let architecture = format!("\"architecture\":\"{}\"", std::env::consts::ARCH);
    edited(&architecture, "\"architecture\":\"abacus\"");
    refused(&format!("{FEW} --merge parts"), "--accept machine");
    let taken = eval(&place, &format!("{FEW} --merge parts --accept machine"));
    assert_eq!(taken.code, Some(0), "{taken}");
    edited("\"program\":\"", "\"program\":\"9");
    refused(&format!("{FEW} --merge parts --accept machine"), "--accept program");
    edited("\"outcomes\"", "\"results\"");
    refused(&format!("{FEW} --merge parts"), "expected a part that `eval --job` wrote");
    std::fs::remove_file(&part).unwrap();
    refused(&format!("{FEW} --merge parts"), "found none of 1");
}

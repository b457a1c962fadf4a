//! Checks that `qsrlib` reproduces all of QSRlib's own expected results, from strands_qsr_lib 0.4.1.
//!
//! The data is not part of the project. If `data/qsr` is missing, these tests only print a notice.

#![expect(clippy::disallowed_methods, reason = "tests read the conformance data")]

use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;
use std::path::{Path, PathBuf};

use flate2::read::GzDecoder;
use serde_json::Value;
use sketchnav_qualitative::argd::{Bound, Scale};
use sketchnav_qualitative::qsrlib::{At, ObjectState, Parameters, Which, World, qtc, request};
use sketchnav_qualitative::{Converse, Point};

fn folder() -> Option<PathBuf> {
    let folder = needs::data().join("qsr");
    if folder.is_dir() {
        Some(folder)
    } else {
        needs::skipped("data", format!("no {}", folder.display()));
        None
    }
}

fn unpacked(path: &Path) -> String {
    let packed = std::fs::File::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut text = String::new();
    GzDecoder::new(packed).read_to_string(&mut text).unwrap();
    text
}

/// Reads a table that lists the name, x, y and optionally width and length of each object. The times are 1, 2, 3 and so on.
fn world(path: &Path, columns: usize) -> World {
    let mut world = World::default();
    for (i, line) in unpacked(path).lines().skip(1).enumerate() {
        let fields: Vec<_> = line.trim().split(',').collect();
        let objects: Vec<_> = fields.chunks(columns).collect();
        world.names = objects.iter().map(|object| object[0].to_owned()).collect();
        let state = |object: &&[&str]| {
            let number = |at: usize| object.get(at).map_or(0.0, |field| field.parse::<f64>().unwrap());
            ObjectState { position: Point::new(number(1), number(2)).unwrap(), size: [number(3), number(4)] }
        };
        world.states.push((i as f64 + 1.0, objects.iter().map(state).collect()));
    }
    assert!(world.states.len() > 10 && world.names.len() > 1);
    world
}

fn scale() -> Option<Scale> {
    let labels = [("close", 10.0), ("near", 20.0), ("far", 30.0), ("veryfar", 40.0)];
    Some(Scale::new(labels, Bound::Upper).unwrap())
}

/// Returns `qsrs_for` with the objects of the given numbers.
fn only(which: Which, numbers: &[usize]) -> Option<Vec<Vec<String>>> {
    Some(vec![numbers.iter().take(which.arity()).map(|number| format!("o{number}")).collect()])
}

/// Returns the parameters that the name of a file implies, following QSRlib's testers.
fn parameters(which: Which, case: &str) -> Parameters {
    let defaults = Parameters { scale: scale(), ..Parameters::default() };
    let first = if which == Which::Mos { only(which, &[1]) } else { only(which, &[1, 2]) };
    let second = if which == Which::Mos { only(which, &[2]) } else { only(which, &[2, 1]) };
    match case {
        "defaults" => defaults,
        "q_factor_2p0" => Parameters { quantisation_factor: 2.0, ..defaults },
        "custom" => Parameters { quantisation_factor: 2.0, qsrs_for: first, ..defaults },
        "qsrs_for_global_namespace" => Parameters { qsrs_for: second, ..defaults },
        "qsrs_for_qsr_namespace" => Parameters { qsrs_for: first, ..defaults },
        "validate_nocollapse" => Parameters { no_collapse: true, ..defaults },
        "validate_nonocollapse" => defaults,
        "novalidate_nocollapse" => Parameters { no_collapse: true, validate: false, ..defaults },
        "novalidate_nonocollapse" => Parameters { validate: false, ..defaults },
        other => panic!("no such case: {other}"),
    }
}

fn lines(path: &Path) -> Vec<String> {
    serde_json::from_str(&unpacked(path)).unwrap()
}

/// Formats answers as QSRlib does, for example `1.0,o1,o2,{'rcc8': 'dc'}`.
fn answers(which: Which, world: &World, parameters: &Parameters) -> Vec<String> {
    let answers = request(which, world, parameters).unwrap();
    answers
        .iter()
        .map(|answer| format!("{},{},{{'{which}': '{}'}}", answer.at, answer.between, answer.relation))
        .collect()
}

fn assert_same(name: &str, mut expected: Vec<String>, mut found: Vec<String>) {
    expected.sort();
    found.sort();
    let differences: Vec<_> =
        expected.iter().zip(&found).filter(|(expected, found)| expected != found).take(5).collect();
    assert!(differences.is_empty(), "{name}: expected, found: {differences:?}");
    assert_eq!(expected.len(), found.len(), "{name}");
}

#[test]
fn every_expected_file_of_one_calculus_is_reproduced() {
    let Some(folder) = folder() else { return };
    let worlds = ["data1", "data2"].map(|name| (name, world(&folder.join(format!("{name}.csv.gz")), 5)));
    let mut count = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let Some((data, rest)) = name.strip_suffix(".txt.gz").and_then(|name| name.split_once('_')) else {
            continue;
        };
        let (Some((_, world)), Some((which, case))) =
            (worlds.iter().find(|(name, _)| *name == data), rest.split_once('_'))
        else {
            continue;
        };
        // `multiple` contains all calculi at once and is tested separately; `argprobd` uses random numbers.
        let Ok(which) = which.parse::<Which>() else {
            assert!(["multiple", "argprobd", "first100"].contains(&which), "{name}");
            continue;
        };
        assert_same(&name, lines(&path), answers(which, world, &parameters(which, case)));
        count += 1;
    }
    assert!(count >= 79, "{count} files");
}

/// Splits a line of a file with several calculi into its time and objects, and its relations except `argprobd`.
fn combined(line: &str) -> (String, BTreeSet<String>) {
    let (key, list) = line.split_once(",[").unwrap();
    let words = list.trim_end_matches(']').split(", ").map(|word| word.trim_matches('\'').to_owned());
    (key.to_owned(), words.filter(|word| !word.starts_with("argprobd")).collect())
}

/// Requests several calculi at once. QTC is neither collapsed nor validated, so that all relations have the same times.
fn multiple(
    world: &World,
    of: impl Fn(Which) -> Option<Vec<Vec<String>>>,
) -> BTreeMap<String, BTreeSet<String>> {
    let mut found = BTreeMap::<_, BTreeSet<_>>::new();
    for which in Which::ALL.iter().filter(|which| which.arity() <= world.names.len()) {
        let plain =
            Parameters { no_collapse: true, validate: false, scale: scale(), ..Parameters::default() };
        for answer in request(*which, world, &Parameters { qsrs_for: of(*which), ..plain }).unwrap() {
            let words = found.entry(format!("{},{}", answer.at, answer.between)).or_default();
            words.insert(format!("{which}:{}", answer.relation));
        }
    }
    found
}

#[test]
fn every_expected_file_of_several_calculi_is_reproduced() {
    let Some(folder) = folder() else { return };
    let first_100 = world(&folder.join("data2_first100.csv.gz"), 5);
    let check = |name: &str, world: &World, of: &dyn Fn(Which) -> Option<Vec<Vec<String>>>| {
        let expected: BTreeMap<_, _> =
            lines(&folder.join(format!("{name}.txt.gz"))).iter().map(|line| combined(line)).collect();
        let found = multiple(world, of);
        for (key, words) in &expected {
            assert_eq!(found.get(key), Some(words), "{name}: {key}");
        }
        assert_eq!(expected.len(), found.len(), "{name}");
    };
    check("data1_multiple_defaults", &world(&folder.join("data1.csv.gz"), 5), &|_| None);
    check("data2_first100_multiple_defaults", &first_100, &|_| None);
    let global = |which: Which| match which {
        Which::Mos => only(which, &[2]),
        Which::Tpcc => only(which, &[3, 2, 1]),
        _ => only(which, &[2, 1]),
    };
    check("data2_first100_multiple_qsrs_for_global_namespace", &first_100, &global);
    let picked = |which: Which| match which {
        Which::Rcc2 | Which::Qtcbs | Which::Mwe | Which::Mos | Which::Tpcc => Some(only(which, &[1, 2, 3])),
        _ => None,
    };
    let own = |which: Which| picked(which).unwrap_or_default();
    check("data2_first100_multiple_qsrs_for_qsr_namespace", &first_100, &own);
    let over_global = |which: Which| picked(which).unwrap_or_else(|| global(which));
    check("data2_first100_multiple_qsrs_for_qsr_namespace_over_global", &first_100, &over_global);
}

#[test]
fn the_expected_files_of_real_trajectories_are_reproduced() {
    let Some(folder) = folder() else { return };
    let world = world(&folder.join("qtc.csv.gz"), 3);
    for which in [Which::Qtcbs, Which::Qtccs, Which::Qtcbcs] {
        let path = folder.join(format!("{which}_nocollapse.txt.gz"));
        let expected: Vec<Value> = serde_json::from_str(&unpacked(&path)).unwrap();
        let expected: Vec<_> = expected.iter().map(|line| line[which.word()].as_str().unwrap()).collect();
        let parameters = Parameters {
            quantisation_factor: 0.01,
            distance_threshold: 1.2,
            no_collapse: true,
            validate: false,
            qsrs_for: Some(vec![vec!["human".to_owned(), "robot".to_owned()]]),
            ..Parameters::default()
        };
        let answers = request(which, &world, &parameters).unwrap();
        let found: Vec<_> = answers.iter().map(|answer| answer.relation.as_str()).collect();
        assert_eq!(expected, found, "{which}");
        assert!(answers.iter().all(|answer| matches!(answer.at, At::Time(_))));

        let whole = Parameters { no_collapse: false, validate: true, ..parameters };
        let answers = request(which, &world, &whole).unwrap();
        let found: Vec<_> = answers.iter().map(|answer| answer.relation.as_str()).collect();
        assert_eq!(found.join(" "), COLLAPSED[which as usize - Which::Qtcbcs as usize], "{which}");
        let places: Vec<_> = (1..=found.len()).map(At::Place).collect();
        assert_eq!(answers.iter().map(|answer| answer.at).collect::<Vec<_>>(), places);
    }
}

/// Expected results of QSRlib's QTC tester, collapsed and validated, for QTC_BC, QTC_B and QTC_C.
const COLLAPSED: [&str; 3] = [
    "-,- -,0 -,0,+,0 -,0,+,+ 0,0,+,+ 0,0,+,0 0,+,+,0 +,+,+,0 +,+",
    "-,- -,0 0,0 0,+ +,+",
    "-,-,0,0 -,-,+,0 -,0,+,0 -,0,+,+ 0,0,+,+ 0,0,+,0 0,+,+,0 +,+,+,0 +,+,0,0",
];

#[test]
fn the_relation_of_the_other_is_the_converse() {
    let Some(folder) = folder() else { return };
    let world = world(&folder.join("qtc.csv.gz"), 3);
    let pairs: Vec<_> =
        world.states.iter().map(|(_, states)| [states[0].position, states[1].position]).collect();
    let swapped: Vec<_> = pairs.iter().map(|[k, l]| [*l, *k]).collect();
    for which in [Which::Qtcbs, Which::Qtccs, Which::Qtcbcs] {
        let [one, other] = [&pairs, &swapped].map(|pairs| qtc(which, pairs, &Parameters::default()));
        assert_eq!(one, other.iter().map(|relation| relation.converse()).collect::<Vec<_>>(), "{which}");
    }
}

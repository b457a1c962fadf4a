//! The page on real robots describes robot files as they are: every key, which of them are required, and an example.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use sketchnav_schemas::robot::{Drive, Robot};
use support::pages::Page;
use support::repository;
use toml::{Table, Value};

const PAGE: &str = "docs/real-robot.md";
/// The heading on the page.
const SECTION: &str = "A robot file";

/// Returns the keys of a table that a robot file may have, from the error about an unknown one. They include keys that no robot uses.
fn keys_in(table: &str) -> Vec<String> {
    let header = if table.is_empty() { String::new() } else { format!("[{table}]\n") };
    let error = toml::from_str::<Robot>(&format!("{header}no-such-key = 1")).unwrap_err().to_string();
    let (_, known) = error.split_once("expected ").unwrap_or_else(|| panic!("[{table}]: {error}"));
    known.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// Returns the dotted keys of all values of a robot file.
fn keys(table: &str, full: &Table) -> BTreeSet<String> {
    let within = |key: String| if table.is_empty() { key } else { format!("{table}.{key}") };
    let deeper = |key: String| match at(full, &key) {
        Some(Value::Table(_)) => keys(&key, full),
        _ => BTreeSet::from([key]),
    };
    keys_in(table).into_iter().map(within).flat_map(deeper).collect()
}

fn at<'a>(table: &'a Table, key: &str) -> Option<&'a Value> {
    let mut parts = key.split('.');
    let first = table.get(parts.next()?);
    parts.fold(first, |value, part| value?.get(part))
}

fn merge(into: &mut Table, other: &Table) {
    for (key, value) in other {
        match value {
            Value::Table(more) => {
                let inner = into.entry(key.as_str()).or_insert_with(|| Value::Table(Table::new()));
                merge(inner.as_table_mut().unwrap(), more);
            }
            _ => drop(into.insert(key.clone(), value.clone())),
        }
    }
}

/// Returns the tables of all robots that ship, as one robot that has everything.
fn full() -> Table {
    let mut full = Table::new();
    for entry in fs::read_dir(repository().join("sim/robots")).unwrap() {
        merge(&mut full, &toml::from_str(&fs::read_to_string(entry.unwrap().path()).unwrap()).unwrap());
    }
    full
}

/// Returns whether each documented key is required.
fn documented() -> BTreeMap<String, bool> {
    let page = Page::of(PAGE);
    let mut found = BTreeMap::new();
    for (number, line, _) in page.lines().filter(|(_, line, is_code)| !is_code && line.starts_with("| `")) {
        let cells: Vec<_> = line.split('|').map(str::trim).collect();
        let ["", names, _unit, default, _meaning, ""] = cells[..] else { continue };
        for name in names.split('`').skip(1).step_by(2) {
            let before = found.insert(name.to_owned(), default == "*required*");
            assert_eq!(before, None, "{PAGE}:{number}: {name} twice");
        }
    }
    found
}

/// There was no list of the keys: whoever described a robot had to read the source code or to copy another robot.
#[test]
fn every_key_of_a_robot_file_is_on_the_page() {
    let (full, documented) = (full(), documented());
    let (known, listed) = (keys("", &full), documented.keys().cloned().collect::<BTreeSet<_>>());
    assert!(known.len() > 50 && known.contains("camera.pixels.width_px"), "{known:?}");
    assert_eq!(listed, known, "{PAGE}");
}

#[test]
fn the_page_says_which_keys_of_a_robot_file_are_required() {
    let full = full();
    toml::from_str::<Robot>(&full.to_string()).unwrap();
    for (key, is_required) in documented() {
        let mut less = full.clone();
        let (table, last) =
            key.rsplit_once('.').map_or((None, key.as_str()), |(table, last)| (Some(table), last));
        let parts = table.into_iter().flat_map(|table| table.split('.'));
        let table = parts.fold(&mut less, |table, part| table[part].as_table_mut().unwrap());
        table.remove(last);
        let read = toml::from_str::<Robot>(&less.to_string());
        assert_eq!(read.is_err(), is_required, "{PAGE}: {key}: {read:?}");
    }
}

#[test]
fn the_example_of_a_robot_file_is_valid() {
    let blocks = Page::of(PAGE).blocks();
    let example = blocks.iter().find(|block| block.heading == SECTION && block.language == "toml").unwrap();
    let robot = Robot::parse(&example.text()).unwrap();
    assert_eq!(robot.drive, Drive::Differential);
    robot.laser().unwrap();
    robot.odometry().unwrap();
}

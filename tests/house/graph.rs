//! The graph of dependencies according to the manifests and `Cargo.lock`. Cargo's own answer needs the sources of every crate
//! that any feature might use, which a fresh machine has never downloaded.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use support::repository;
use toml::{Table, Value};

/// The manifest of a crate of the workspace.
pub struct Manifest {
    /// The crate's folder.
    pub folder: PathBuf,
    table: Table,
}

fn parse(path: &Path) -> Table {
    let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    text.parse().unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn texts(list: &Value) -> Vec<String> {
    list.as_array().unwrap().iter().map(|item| item.as_str().unwrap().to_owned()).collect()
}

impl Manifest {
    /// The manifest in a folder of the repository.
    pub fn read(folder: &Path) -> Self {
        let folder = repository().join(folder);
        Self { table: parse(&folder.join("Cargo.toml")), folder }
    }

    /// The manifests of all crates of the workspace.
    pub fn members() -> impl Iterator<Item = Self> {
        let members = texts(&Self::read(Path::new("")).table["workspace"]["members"]);
        members.into_iter().map(|folder| Self::read(Path::new(&folder)))
    }

    /// The folders that `cargo run` and `cargo test` build.
    pub fn default_members(&self) -> Vec<PathBuf> {
        texts(&self.table["workspace"]["default-members"]).into_iter().map(PathBuf::from).collect()
    }

    /// The crate's name.
    pub fn name(&self) -> String {
        self.table["package"]["name"].as_str().unwrap().to_owned()
    }

    /// The names of the crates that it depends on, except those for tests, filtered by `keep`.
    pub fn dependencies(&self, keep: impl Fn(&Value) -> bool) -> BTreeSet<String> {
        let tables =
            ["dependencies", "build-dependencies"].into_iter().filter_map(|name| self.table.get(name));
        let all = tables.flat_map(|table| table.as_table().unwrap());
        all.filter(|(_, value)| keep(value)).map(|(name, _)| name.clone()).collect()
    }

    /// Whether `cargo test` runs the examples of its documentation.
    pub fn tests_its_documentation(&self) -> bool {
        self.table.get("lib").and_then(|lib| lib.get("doctest")).is_none_or(|it| it.as_bool() == Some(true))
    }
}

/// The names of the crates that each crate depends on. For third-party crates these are all that any feature used somewhere may
/// bring in.
pub fn dependencies() -> BTreeMap<String, BTreeSet<String>> {
    let lock = parse(&repository().join("Cargo.lock"));
    let mut all = BTreeMap::<_, BTreeSet<_>>::new();
    for package in lock["package"].as_array().unwrap() {
        let names = package.get("dependencies").map(texts).unwrap_or_default();
        let names = names.iter().map(|entry| entry.split(' ').next().unwrap().to_owned());
        all.entry(package["name"].as_str().unwrap().to_owned()).or_default().extend(names);
    }
    all.extend(Manifest::members().map(|manifest| (manifest.name(), manifest.dependencies(|_| true))));
    all
}

/// The names of all crates on which one depends, directly or indirectly.
pub fn reached<'a>(from: &'a str, all: &'a BTreeMap<String, BTreeSet<String>>) -> BTreeSet<&'a str> {
    let (mut reached, mut open) = (BTreeSet::new(), vec![from]);
    while let Some(name) = open.pop() {
        for next in all.get(name).into_iter().flatten().map(String::as_str) {
            if reached.insert(next) {
                open.push(next);
            }
        }
    }
    reached
}

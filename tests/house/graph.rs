//! The graph of dependencies according to the manifests and `Cargo.lock`. Cargo itself could only report it after
//! downloading the sources of every crate that any feature might use, which a fresh machine does not have.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use support::repository;
use toml::{Table, Value};

/// The manifest of a crate in the workspace.
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
    /// Reads the manifest in a folder of the repository.
    pub fn read(folder: &Path) -> Self {
        let folder = repository().join(folder);
        Self { table: parse(&folder.join("Cargo.toml")), folder }
    }

    /// Reads the manifests of all crates in the workspace.
    pub fn members() -> impl Iterator<Item = Self> {
        let members = texts(&Self::read(Path::new("")).table["workspace"]["members"]);
        members.into_iter().map(|folder| Self::read(Path::new(&folder)))
    }

    /// Returns the folders of the crates that `cargo run` and `cargo test` build by default.
    pub fn default_members(&self) -> Vec<PathBuf> {
        texts(&self.table["workspace"]["default-members"]).into_iter().map(PathBuf::from).collect()
    }

    /// Returns the crate's name.
    pub fn name(&self) -> String {
        self.table["package"]["name"].as_str().unwrap().to_owned()
    }

    /// Returns the names of the crates that this crate depends on, if `keep` returns true for their entries.
    /// Dependencies of tests are left out.
    pub fn dependencies(&self, keep: impl Fn(&Value) -> bool) -> BTreeSet<String> {
        let tables =
            ["dependencies", "build-dependencies"].into_iter().filter_map(|name| self.table.get(name));
        let all = tables.flat_map(|table| table.as_table().unwrap());
        all.filter(|(_, value)| keep(value)).map(|(name, _)| name.clone()).collect()
    }

    /// Returns true if `cargo test` runs the examples in the crate's documentation.
    pub fn tests_its_documentation(&self) -> bool {
        self.table.get("lib").and_then(|lib| lib.get("doctest")).is_none_or(|it| it.as_bool() == Some(true))
    }
}

/// Returns the names of the crates that each crate depends on. For a third-party crate, they include everything that
/// any feature used in the workspace may require.
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

/// Returns the names of all crates that a crate depends on, directly or indirectly.
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

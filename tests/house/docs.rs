//! Checks that the documentation is true as far as a program can check it: links and anchors lead somewhere, named tests and files
//! exist, commands are accepted and the cheap ones run, and figures and code agree with their sources.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use regex_lite::Regex;
use serde_json::Value;
use sketchnav_lab::experiments::figures::Figures;
use sketchnav_schemas::channels;
use support::pages::{self, Page};
use support::{Place, repository};

/// The change log, which is not checked against the program because it also describes earlier versions.
const CHANGES: &str = "CHANGELOG.md";
fn pattern(text: &str) -> Regex {
    Regex::new(text).unwrap()
}

/// Errors in the documentation, each with its page and line.
#[derive(Default)]
struct Findings(Vec<String>);

impl Findings {
    fn add(&mut self, page: &Page, line: usize, words: impl std::fmt::Display) {
        self.0.push(format!("{}:{line}: {words}", page.name()));
    }

    fn are_none(self) {
        assert!(self.0.is_empty(), "{}", self.0.join("\n"));
    }
}

/// Returns the anchor that GitHub makes from a heading.
fn anchor(heading: &str) -> String {
    let of = |c: char| match c {
        ' ' => Some('-'),
        '-' | '_' => Some(c),
        c if c.is_alphanumeric() => Some(c.to_ascii_lowercase()),
        _ => None,
    };
    heading.chars().filter_map(of).collect()
}

#[test]
fn every_link_leads_somewhere() {
    let links = [pattern(r"\]\(([^)\s]+)\)"), pattern(r#"src="([^"]+)""#)];
    let mut findings = Findings::default();
    for page in pages::all() {
        for (number, line, is_code) in page.lines() {
            if is_code {
                continue;
            }
            for link in links.iter().flat_map(|link| link.captures_iter(line)) {
                let link = link.get(1).unwrap().as_str();
                if let Some(wrong) = (!link.contains("://")).then(|| follow(&page, link)).flatten() {
                    findings.add(&page, number, format!("{link}: {wrong}"));
                }
            }
        }
    }
    findings.are_none();
}

/// Describes the problem with a link on a page, or returns `None` if its target exists.
fn follow(page: &Page, link: &str) -> Option<&'static str> {
    let (file, heading) = link.split_once('#').map_or((link, None), |(file, heading)| (file, Some(heading)));
    let folder = repository().join(page.path.parent().unwrap());
    let target = if file.is_empty() { repository().join(&page.path) } else { folder.join(file) };
    if !target.exists() {
        return Some("no such file");
    }
    let heading = heading?;
    let target = fs::canonicalize(target).unwrap();
    let target = target.strip_prefix(fs::canonicalize(repository()).unwrap()).unwrap();
    let is_there = Page::of(target.to_str().unwrap()).headings().any(|found| anchor(found) == heading);
    (!is_there).then_some("no such heading")
}

/// Finds all files of the project that contain source code.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        if path.is_dir() && !name.starts_with('.') && name != "target" {
            sources(&path, found);
        } else if [".rs", ".js", ".py"].iter().any(|end| name.ends_with(end)) {
            found.push(path);
        }
    }
}

/// Each guarantee is backed by a test, so the tests that pages name must exist.
#[test]
fn named_tests_and_files_exist() {
    let mut files = Vec::new();
    sources(repository(), &mut files);
    let functions = pattern(r"fn (\w+)");
    let texts: Vec<_> = files.iter().map(|file| fs::read_to_string(file).unwrap()).collect();
    let functions: BTreeSet<_> = texts
        .iter()
        .flat_map(|text| functions.captures_iter(text))
        .map(|found| found.get(1).unwrap().as_str())
        .collect();
    // The names of tests are sentences, so they have more words than other names.
    let named_test = pattern(r"`([a-z0-9]+(?:_[a-z0-9]+){4,})`");
    let named_file = pattern(r"`([\w/-]+\.(?:rs|js|py))`");
    let mut findings = Findings::default();
    for page in pages::all() {
        for (number, line, _) in page.lines().filter(|(_, _, is_code)| !is_code) {
            for found in named_test.captures_iter(line) {
                let name = found.get(1).unwrap().as_str();
                if !functions.contains(name) {
                    findings.add(&page, number, format!("{name}: no such test"));
                }
            }
            for found in named_file.captures_iter(line) {
                let name = Path::new(found.get(1).unwrap().as_str());
                if !files.iter().any(|file| file.ends_with(name)) {
                    findings.add(&page, number, format!("{}: no such file", name.display()));
                }
            }
        }
    }
    findings.are_none();
}

/// Returns the words of each `sketchnav` command in code blocks and inline code, with its line number and whether the
/// command is complete.
fn commands(page: &Page) -> Vec<(usize, Vec<String>, bool)> {
    let in_line = pattern(r"`(sketchnav [^`]+)`");
    let mut commands = Vec::new();
    for (number, line, is_code) in page.lines() {
        let line = line.trim().strip_prefix("$ ").unwrap_or(line.trim());
        if is_code {
            let starts = ["sketchnav ", "cargo run -- ", "cargo run --release -- "];
            let start = starts.iter().find(|start| line.starts_with(**start));
            if let Some(start) = start {
                // Comments and redirections are not the program's arguments.
                let line = line[start.len()..].split(" #").next().unwrap().split(" > ").next().unwrap();
                commands.push((number, words(line.strip_suffix(" &").unwrap_or(line)), true));
            }
        } else {
            let found = in_line.captures_iter(line).map(|found| found.get(1).unwrap().as_str());
            commands.extend(found.map(|command| (number, words(&command["sketchnav ".len()..]), false)));
        }
    }
    commands
}

/// Splits a line into words as a shell would, as far as the pages need that.
fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quoted = None;
    for c in line.trim().chars() {
        match (quoted, c) {
            (None, ' ') => words.push(String::new()),
            (None, '"' | '\'') => quoted = Some(c),
            (Some(quote), c) if c == quote => quoted = None,
            _ => words.last_mut().unwrap().push(c),
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Returns true if a word is a placeholder, which is written in capitals.
fn is_placeholder(word: &str) -> bool {
    word.len() > 1 && word.chars().all(|c| c.is_ascii_uppercase() || !c.is_alphanumeric())
        || word.contains('…')
}

#[test]
fn every_documented_command_is_valid() {
    let mut findings = Findings::default();
    for page in pages::all().into_iter().filter(|page| page.name() != CHANGES) {
        for (number, words, is_whole) in commands(&page) {
            let wrong = match is_whole && !words.iter().any(|word| is_placeholder(word)) {
                true => {
                    let words = std::iter::once("sketchnav".to_owned()).chain(words.clone());
                    let parsed = sketchnav::command_line().try_get_matches_from(words);
                    parsed.err().map(|error| error.to_string())
                }
                false => unknown_option(&words),
            };
            if let Some(wrong) = wrong {
                findings.add(&page, number, format!("{}: {wrong}", words.join(" ")));
            }
        }
    }
    findings.are_none();
}

/// Describes the first command or option that does not exist, if there is one.
fn unknown_option(words: &[String]) -> Option<String> {
    let (name, options) = words.split_first()?;
    let line = sketchnav::command_line();
    if is_placeholder(name) {
        return None;
    }
    let Some(command) = line.find_subcommand(name) else { return Some(format!("no command {name}")) };
    let is_known = |option: &str| {
        let is_long = |long: &str| command.get_arguments().any(|known| known.get_long() == Some(long));
        let is_short = |short: char| command.get_arguments().any(|known| known.get_short() == Some(short));
        match option.strip_prefix("--") {
            Some(long) => is_long(long.split('=').next().unwrap()) || long == "help",
            None => option.chars().nth(1).is_none_or(is_short),
        }
    };
    let is_option =
        |word: &&String| word.starts_with('-') && !word[1..].starts_with(|c: char| c.is_ascii_digit());
    options
        .iter()
        .filter(is_option)
        .find(|option| !is_known(option))
        .map(|option| format!("no option {option}"))
}

/// The checks above find the errors that they are meant to find.
#[test]
fn a_wrong_command_a_wrong_link_and_a_wrong_anchor_are_found() {
    let found = |line: &str| unknown_option(&words(line));
    assert_eq!(found("run demo --sped 2"), Some("no option --sped".to_owned()));
    assert_eq!(found("walk demo"), Some("no command walk".to_owned()));
    assert_eq!(found("run MISSION --speed 2 --pad"), None);
    assert_eq!(words("run 'a b' --set x=1"), ["run", "a b", "--set", "x=1"]);
    let readme = Page::of("README.md");
    assert_eq!(follow(&readme, "docs/nowhere.md"), Some("no such file"));
    assert_eq!(follow(&readme, "ARCHITECTURE.md#nowhere"), Some("no such heading"));
    assert_eq!(follow(&readme, "ARCHITECTURE.md#where-we-leave-the-papers"), None);
}

/// Some pages once built optional features with `cargo build`, others with `cargo run` or `cargo install`, and readers wondered
/// whether the programs differed.
#[test]
fn optional_features_are_built_in_one_way_on_all_pages() {
    let building = pattern(r"cargo (build|check|install|run)\b[^`#]* --features");
    let (mut findings, mut count) = (Findings::default(), 0);
    for page in pages::all().into_iter().filter(|page| page.name() != CHANGES) {
        for (number, line, _) in page.lines() {
            for found in building.captures_iter(line) {
                count += 1;
                if &found[1] != "build" {
                    findings.add(
                        &page,
                        number,
                        format!("{}: expected `cargo build --features …`", &found[0]),
                    );
                }
            }
        }
    }
    assert!(count >= 4, "the test sees what is there: {count}");
    findings.are_none();
}

#[test]
fn every_command_is_documented() {
    let page = Page::of("docs/commands.md");
    let text = page.text();
    for command in sketchnav::command_line().get_subcommands().map(|command| command.get_name().to_owned()) {
        let named =
            [format!("`{command}`"), format!("`sketchnav {command}`"), format!("`sketchnav {command} ")];
        assert!(named.iter().any(|name| text.contains(name)), "docs/commands.md does not name {command}");
    }
}

#[test]
fn commands_for_missions_run() {
    pages::run("docs/missions.md", "A mission by a drawing, step by step");
    pages::run("docs/missions.md", "Run it");
}

#[test]
fn commands_for_recordings_run() {
    pages::run("docs/recordings.md", "Recordings");
}

#[test]
fn commands_for_landmarks_run() {
    pages::run("docs/navigators/landmarks.md", "A mission");
    pages::run("docs/navigators/landmarks.md", "Labels");
}

/// A code block that no test runs must be marked by a language other than `sh`.
#[test]
fn every_section_with_commands_is_tested() {
    let run = [
        ("docs/missions.md", "A mission by a drawing, step by step"),
        ("docs/missions.md", "Run it"),
        ("docs/recordings.md", "Recordings"),
        ("docs/navigators/landmarks.md", "A mission"),
        ("docs/navigators/landmarks.md", "Labels"),
    ];
    for page in pages::all().iter().filter(|page| page.name() != "docs/ecosystem.md") {
        for heading in page.sections() {
            assert!(run.contains(&(page.name().as_str(), heading.as_str())), "{}: {heading}", page.name());
        }
    }
}

/// Runs the first mission on a page in a place.
fn drive_the_mission_of(page: &str, place: &Place) {
    let blocks = Page::of(page).blocks();
    let mission = blocks.iter().find(|block| block.language == "toml").unwrap().text();
    pages::settle(place);
    fs::write(place.files().join("mission.toml"), mission).unwrap();
    let report: Value = place.fine("run mission.toml --out out --json").json();
    assert_eq!(report["success"], true, "{page}: {report:#}");
}

#[test]
fn the_first_mission_of_the_readme_reaches_its_goal() {
    drive_the_mission_of("README.md", &Place::new());
}

#[test]
fn the_mission_of_the_corridor_page_reaches_its_end() {
    drive_the_mission_of("docs/navigators/corridor.md", &Place::new());
}

#[test]
fn the_mission_in_the_page_on_navigators_is_driven() {
    let mission = repository().join("tests/stranger/wall.toml");
    let place = Place::of_program("wall_follower");
    let report: Value = place.fine(&format!("run {} --out out --json", mission.display())).json();
    assert_eq!(report["success"], true, "{report:#}");
}

/// The page once used a different name for a trait than the code.
#[test]
fn code_in_the_page_on_navigators_equals_the_file() {
    let file = fs::read_to_string(repository().join("tests/stranger/wall_follower.rs")).unwrap();
    let blocks = Page::of("docs/write-a-navigator.md").blocks();
    let code: Vec<_> = blocks.iter().filter(|block| block.language == "rust").collect();
    assert!(code.len() > 8, "{}", code.len());
    for block in code {
        assert!(file.contains(&block.text()), "{}: not in the file:\n{}", block.heading, block.text());
    }
}

/// Compares the defaults in a page's rows ``| `localizer.belief.hypotheses` | 300 |`` with the real ones, and returns
/// the number of rows. Rows below a header ``| `[parameters.localizer]` |`` omit the process.
fn compare_defaults(page: &str, parameters: &Value) -> usize {
    let header = pattern(r"^\| `\[parameters\.(\w+)\]`");
    let (page, mut process, mut count) = (Page::of(page), None, 0);
    for (number, line, _) in page.lines() {
        let cells: Vec<_> = line.split('|').map(str::trim).collect();
        if let Some(found) = header.captures(line) {
            process = Some(found.get(1).unwrap().as_str());
        } else if cells.len() < 4 {
            process = None;
        } else if let Some(names) = names(cells[1], process) {
            let is_one = names.len() == 1;
            let defaults: Vec<_> = if is_one { vec![cells[2]] } else { cells[2].split(", ").collect() };
            assert_eq!(names.len(), defaults.len(), "{}:{number}", page.name());
            for (name, default) in names.iter().zip(defaults) {
                let found = parameters.pointer(name);
                let found = found.unwrap_or_else(|| panic!("{}:{number}: no {name}", page.name()));
                assert_eq!(shown(found), default.trim_matches('`'), "{}:{number}: {name}", page.name());
                count += 1;
            }
        }
    }
    count
}

/// Returns the paths of the parameters in a cell. For example, ``"`planner.gain`, `.weight`"`` names two parameters of
/// one table.
fn names(cell: &str, process: Option<&str>) -> Option<Vec<String>> {
    let mut names = cell.split(", ").map(|name| name.trim_matches(['`', '.']));
    let first = names.next().filter(|_| cell.starts_with('`'))?;
    let of_process = |word: &str| first.split_once('.').is_some_and(|(found, _)| found == word);
    let table = match process {
        Some(process) => process.to_owned(),
        None if ["sketcher", "localizer", "planner"].into_iter().any(of_process) => {
            first.rsplit_once('.')?.0.replace('.', "/")
        }
        None => return None,
    };
    let last = |name: &str| name.rsplit('.').next().unwrap_or(name).to_owned();
    Some(std::iter::once(first).chain(names).map(|name| format!("/{table}/{}", last(name))).collect())
}

/// When a parameter is renamed or its default changes, the page must follow.
#[test]
fn parameters_of_the_sketch_page_have_the_defaults_of_the_code() {
    let parameters = serde_json::json!({
        "localizer": sketchnav_sketch::filter::parameters::Parameters::default(),
        "planner": sketchnav_sketch::paths::parameters::Parameters::default(),
        "sketcher": sketchnav_sketch::reading::Settings::default(),
    });
    let checked = compare_defaults("docs/navigators/sketch.md", &parameters);
    assert!(checked > 40, "{checked}");
}

#[test]
fn parameters_of_the_other_navigators_pages_have_the_defaults_of_the_code() {
    use sketchnav_directions::arrival::Effort;
    use sketchnav_directions::{Window, navigator};
    use sketchnav_landmarks::{extraction, mission};

    let landmarks = serde_json::json!({
        "localizer": mission::LocalizerParameters::default(),
        "planner": mission::PlannerParameters::default(),
        "sketcher": extraction::Parameters::default(),
    });
    assert!(compare_defaults("docs/navigators/landmarks.md", &landmarks) >= 12);
    let corridor = serde_json::json!({
        "localizer": sketchnav_corridor::perception::Parameters::default(),
        "planner": sketchnav_corridor::planner::Parameters::default(),
    });
    assert_eq!(compare_defaults("docs/navigators/corridor.md", &corridor), 10);
    let Effort { trials, trial_journeys, journeys } = Effort::USUAL;
    let directions = serde_json::json!({
        "planner": navigator::Settings::new(Window::new(0.1, 0.015).unwrap(), 0.001),
        "sketcher": { "trials": trials, "trial_journeys": trial_journeys, "journeys": journeys },
    });
    assert_eq!(compare_defaults("docs/navigators/directions.md", &directions), 9);
}

/// Formats a value as people would write it.
fn shown(value: &Value) -> String {
    match value {
        Value::Number(number) => ((number.as_f64().unwrap() * 1e4).round() / 1e4).to_string(),
        Value::String(text) => text.clone(),
        Value::Array(items) => items.iter().map(shown).collect::<Vec<_>>().join(", "),
        other => other.to_string(),
    }
}

#[test]
fn figures_in_the_readme_are_in_the_results() {
    let readme = Page::of("README.md");
    let results = Page::of("docs/results.md");
    let figures = pattern(r"[\d.]+ %(?: \(\d+ to \d+\))?");
    let found: Vec<_> = figures.find_iter(readme.text()).map(|found| found.as_str()).collect();
    assert!(found.len() >= 6, "{found:?}");
    for figure in found {
        assert!(results.text().contains(figure), "README.md has {figure:?}, docs/results.md has not");
    }
}

/// Figures used to be copied by hand, and some came from a different version than the code. Now `eval all --page`
/// writes them, and figures without an entry in its file are marked with a dagger.
#[test]
fn figures_on_the_pages_come_from_the_results() {
    let file = repository().join("docs/results.json");
    let kept = file.is_file().then(|| fs::read_to_string(&file).unwrap());
    assert!(kept.as_ref().is_none_or(|text| text.len() < 500_000), "docs/results.json is large");
    let figures: Figures =
        kept.map(|text| serde_json::from_str(&text).expect("docs/results.json")).unwrap_or_default();
    for page in ["docs/results.md", "docs/outline.md", "README.md"].map(Page::of) {
        let filled = figures.fill(page.text()).unwrap_or_else(|error| panic!("{}: {error}", page.name()));
        let lines = filled.page.lines().zip(page.text().lines()).zip(1..);
        let wrong: Vec<_> = lines
            .filter(|((new, old), _)| new != old)
            .map(|((new, _), number)| format!("{}:{number}: expected {new}", page.name()))
            .collect();
        assert!(wrong.is_empty() && filled.page == page.text(), "{}", wrong.join("\n"));
    }
}

/// The page of results names every suite and study, with a command.
#[test]
fn every_suite_is_in_the_results() {
    let results = Page::of("docs/results.md");
    let suites = sketchnav_lab::experiments::suites::names();
    let studies = sketchnav_lab::experiments::studies::names();
    for name in suites.chain(studies) {
        assert!(
            results.text().contains(&format!("`{name}`")) || results.text().contains(&format!("eval {name}")),
            "{name}"
        );
    }
}

/// The channels in the README's picture exist.
#[test]
fn channels_of_the_readme_exist() {
    sketchnav_navigators::register(&[]).unwrap();
    let readme = Page::of("README.md");
    let picture = readme.blocks().into_iter().find(|block| block.text().contains("──▶")).unwrap().text();
    for name in
        ["drawing", "sketch", "route", "estimate", "command", "scan", "odometry", "tick", "faults", "health"]
    {
        assert!(picture.contains(name) && channels::find(name).is_some(), "{name}");
    }
}

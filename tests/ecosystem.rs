//! `docs/ecosystem.md` says what is true: every command of it is run, section by section.

mod support;

use std::process::Command;

use nix::sys::signal::Signal;
use support::{Place, Running, repository};

/// A heading and the commands below it.
struct Section {
    heading: String,
    commands: Vec<String>,
}

fn sections() -> Vec<Section> {
    let page = std::fs::read_to_string(repository().join("docs/ecosystem.md")).unwrap();
    let mut sections = Vec::new();
    let mut is_code = false;
    for line in page.lines() {
        match line {
            "```sh" => is_code = true,
            "```" => is_code = false,
            _ if is_code => {
                let section: &mut Section = sections.last_mut().unwrap();
                section.commands.push(line.to_owned());
            }
            _ => {
                if let Some(heading) = line.strip_prefix("## ") {
                    sections.push(Section { heading: heading.to_owned(), commands: Vec::new() });
                }
            }
        }
    }
    sections
}

/// The words of a command as a shell has them, as far as this page uses it.
fn shell(place: &Place, line: &str) -> Command {
    let program = place.command("");
    let folder = std::path::Path::new(program.get_program()).parent().unwrap().to_owned();
    let path = std::env::var("PATH").unwrap_or_default();
    let mut command = Command::new("bash");
    command.args(["-euc", &format!("exec {line}")]);
    place.settle(&mut command);
    command.env("PATH", format!("{}:{path}", folder.display()));
    command.env("CHECKOUT", repository());
    command
}

/// The name that `--system` gives.
fn system_of(line: &str) -> Option<&str> {
    line.split_whitespace().skip_while(|word| *word != "--system").nth(1)
}

fn run(section: &str) {
    let all = sections();
    let section = all.iter().find(|found| found.heading == section).unwrap();
    assert!(!section.commands.is_empty());
    if !cfg!(feature = "ros2") && section.commands.iter().any(|line| line.contains("bridge ros2")) {
        return support::skipped("ros2", "built without the feature ros2");
    }
    let place = Place::new();
    let mut behind: Vec<Running> = Vec::new();
    for line in &section.commands {
        if let Some(line) = line.strip_suffix(" &") {
            let mut running = Running::spawn(shell(&place, line));
            if let Some(system) = system_of(line) {
                place.wait_until_driving(&mut running, system);
            }
            behind.push(running);
            continue;
        }
        let ended = Running::spawn(shell(&place, line)).end();
        assert_eq!(ended.code, Some(0), "{line}: {ended}");
    }
    for running in behind {
        // It may have ended by itself, by an order of the page.
        let _ = nix::sys::signal::kill(nix::unistd::Pid::from_raw(running.pid() as i32), Signal::SIGINT);
        running.end();
    }
    assert_eq!(place.living(), []);
}

macro_rules! sections {
    ($($test:ident: $heading:literal,)*) => {
        $(#[test]
        fn $test() {
            run($heading);
        })*

        #[test]
        fn every_section_with_commands_is_run() {
            let tested = [$($heading),*];
            for section in sections().iter().filter(|section| !section.commands.is_empty()) {
                assert!(tested.contains(&section.heading.as_str()), "{}", section.heading);
            }
        }
    };
}

sections! {
    the_machine_is_checked: "A machine that does not run it",
    a_running_system_is_looked_at: "A running system",
    an_experiment_is_driven_in_parts: "Experiments on many machines",
    faults_are_planned_and_played_again: "Faults by plan",
    ros_2_hears_the_robot: "ROS 2 on other hosts",
}

/// The plain build has no DDS in it.
#[cfg(not(feature = "ros2"))]
#[test]
fn a_build_without_ros_2_says_how_to_get_one_with_it() {
    let ended = Place::new().run("bridge ros2 --system lab");
    assert_eq!(ended.code, Some(2), "{ended}");
    assert!(ended.err.contains("cargo build --release --features ros2"), "{ended}");
}

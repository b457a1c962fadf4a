//! Checks that `docs/ecosystem.md` is true by running all its commands, section by section.

use support::pages::{Page, run};

const PAGE: &str = "docs/ecosystem.md";

/// Commands that need a build with a feature, and whether this build has the feature.
const FEATURES: [(&str, &str, bool); 6] = [
    ("--rmw zenoh", "zenoh", cfg!(feature = "zenoh")),
    ("bridge ros2", "ros2", cfg!(feature = "ros2")),
    ("sketchnav view", "foxglove", cfg!(feature = "foxglove")),
    ("--foxglove", "foxglove", cfg!(feature = "foxglove")),
    ("sketchnav completions", "manuals", cfg!(feature = "manuals")),
    ("sketchnav man", "manuals", cfg!(feature = "manuals")),
];

/// Returns true if this build has all features that the commands in a section need. The plain build has no DDS, no
/// Zenoh, no live view and no manual pages.
fn has_what_it_needs(heading: &str) -> bool {
    let commands = Page::of(PAGE).commands(heading);
    let lacks = |line: &String| {
        let needed = FEATURES.into_iter().find(|(words, ..)| line.contains(words));
        needed.filter(|(.., has)| !has).map(|(_, feature, _)| feature)
    };
    let lacking = commands.iter().find_map(lacks);
    if let Some(feature) = lacking {
        needs::skipped(feature, format_args!("built without the feature {feature}"));
    }
    lacking.is_none()
}

macro_rules! sections {
    ($($test:ident: $heading:literal,)*) => {
        $(#[test]
        fn $test() {
            if has_what_it_needs($heading) {
                run(PAGE, $heading);
            }
        })*

        #[test]
        fn every_section_with_commands_is_run() {
            let tested = [$($heading),*];
            for heading in Page::of(PAGE).sections() {
                assert!(tested.contains(&heading.as_str()), "{heading}");
            }
        }
    };
}

sections! {
    the_machine_is_checked: "A machine that does not run it",
    a_running_system_is_looked_at: "A running system",
    a_recording_is_kept_in_pieces: "Recordings, for users of rosbag2",
    completions_and_pages_are_written: "Completions and manual pages",
    a_system_and_a_recording_are_shown: "Live view",
    an_experiment_is_driven_in_parts: "Experiments on many machines",
    faults_are_planned_and_played_again: "Faults by plan",
    ros_2_hears_the_robot: "ROS 2 on other hosts",
    rmw_zenoh_hears_the_robot: "ROS 2 by Zenoh",
}

#[cfg(not(feature = "zenoh"))]
#[test]
fn a_build_without_zenoh_says_how_to_add_it() {
    let ended = support::Place::new().run("bridge ros2 --system lab --rmw zenoh");
    assert_eq!(ended.code, Some(2), "{ended}");
    assert!(ended.err.contains("cargo build --features zenoh"), "{ended}");
}

#[cfg(not(feature = "ros2"))]
#[test]
fn a_build_without_ros_2_says_how_to_add_it() {
    let ended = support::Place::new().run("bridge ros2 --system lab");
    assert_eq!(ended.code, Some(2), "{ended}");
    assert!(ended.err.contains("cargo build --features ros2"), "{ended}");
}

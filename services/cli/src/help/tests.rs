//! Tests of the pages and how they are rendered.

use std::fs;
use std::path::Path;

use super::*;

/// Finds the pages in a folder of the documentation.
fn pages_in(folder: &str) -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    for entry in fs::read_dir(root.join(folder)).unwrap() {
        let path = entry.unwrap().path();
        let name = path.strip_prefix(root).unwrap().to_str().unwrap();
        match path.is_dir() {
            true => found.extend(pages_in(name)),
            false if name.ends_with(".md") => found.push(name.to_owned()),
            false => {}
        }
    }
    found
}

#[test]
fn every_page_of_the_documentation_is_a_topic() {
    let found = pages_in("docs");
    assert!(found.len() > 12, "{found:?}");
    for path in found {
        assert!(Page::at(&path).is_some(), "{path} is not in PAGES");
    }
    let topics: BTreeSet<_> = PAGES.iter().map(Page::topic).collect();
    assert_eq!(topics.len(), PAGES.len(), "{topics:?}");
    for page in PAGES {
        assert_eq!(Page::of(&page.topic()).unwrap().path, page.path);
        assert_eq!(Page::of(page.path).unwrap().path, page.path);
    }
}

/// The list by task is the only list of the pages that readers see, so it has to name all of them.
#[test]
fn the_list_names_every_other_page_by_its_topic() {
    let list = plain::page(Page::at(INDEX).unwrap(), COLUMNS).to_lowercase();
    for page in PAGES.iter().filter(|page| page.path != INDEX) {
        assert!(list.contains(&format!("[{}]", page.topic())), "{}:\n{list}", page.topic());
    }
    assert!(list.lines().all(|line| !line.starts_with(' ')), "a task takes several lines:\n{list}");
    let named = list.split('[').skip(1).filter_map(|after| after.split_once(']'));
    for (topic, _) in named {
        assert!(Page::of(topic).is_some(), "{topic}");
    }
}

#[test]
fn every_page_ends_with_what_to_read_next() {
    for page in PAGES.iter().filter(|page| ![INDEX, "README.md"].contains(&page.path)) {
        let last = page.text.trim_end().rsplit("\n\n").next().unwrap();
        assert!(last.starts_with("Next: ") && last.contains("]("), "{}: {last}", page.path);
    }
}

#[test]
fn no_page_shows_its_markup_or_is_wider_than_the_terminal() {
    for page in PAGES {
        for columns in [40, COLUMNS] {
            let text = plain::page(page, columns);
            assert!(text.lines().next().is_some_and(|line| !line.starts_with('#')), "{}", page.path);
            let is_prose = |line: &&str| !line.trim_start().starts_with('`') && !line.starts_with("    ");
            for line in text.lines().filter(is_prose) {
                let markup = ["](", "<!--", "<br", "|---"].iter().find(|markup| line.contains(**markup));
                assert_eq!(markup, None, "{}: {line}", page.path);
                let has_long_word = line.split_whitespace().count() < 3;
                assert!(has_long_word || line.chars().count() <= columns, "{}: {line}", page.path);
            }
        }
    }
}

#[test]
fn a_small_page_is_plain_text() {
    let text = "\
# A page

Draw it on the [pad](pad.md), with
`--pad`, or in **any** *program*; see [channels](../schemas/src/channels.rs), [`LICENSE`](../LICENSE),
[MCAP](https://mcap.dev) and [Missions](missions.md#run-it).

## Figures

| what | share |
|---|---|
| all<br>of them | <!--= people share-->84.5 %<!--=--> |
| none | – |

| | |
|---|---|
| ![a robot](robot.png) | [The list](README.md) |

1. Draw the place, which may take a minute or two.
   - Walls
   - Doors

   ```sh
   sketchnav run demo
   ```
2. Send it.

### Details

Next: [below](#figures).
";
    let expected = "\
A page
======

Draw it on the [pad], with `--pad`, or
in any *program*; see channels
(schemas/src/channels.rs), `LICENSE`,
MCAP (https://mcap.dev) and [Missions].

Figures
-------

what     share
────────────────
all      84.5 %
of them

none     –

(picture: a robot)  The list [topics]

1. Draw the place, which may take a
   minute or two.
   - Walls
   - Doors

       sketchnav run demo

2. Send it.

Details

Next: below.";
    let page = Page { path: "docs/page.md", text };
    assert_eq!(plain::page(&page, 40), expected);
}

#[test]
fn an_unknown_topic_gets_suggestions() {
    for (word, meant) in
        [("mision", "missions"), ("robot", "real-robot"), ("kill", "results"), ("Landmark", "landmarks")]
    {
        assert!(near(word).iter().any(|near| near == meant), "{word}: {:?}", near(word));
    }
    assert_eq!(
        unknown("qqqqqq"),
        "help: expected a command or a page, found \"qqqqqq\"; `sketchnav help` lists both"
    );
    assert!(unknown("mision").contains("did you mean missions? "), "{}", unknown("mision"));
}

#[test]
fn help_for_a_command_equals_its_help_option() {
    let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    for line in ["run", "bridge ros2", "help"] {
        let help = of_command(&words(line)).unwrap();
        assert_eq!(help.exit_code(), 0);
        let option = format!("sketchnav {line} --help");
        let printed = Cli::command().try_get_matches_from(option.split(' ')).unwrap_err();
        assert_eq!(help.render().to_string(), printed.render().to_string());
    }
    assert!(of_command(&words("run demo")).is_none() && of_command(&words("missions")).is_none());
}

/// Regression test: `sketchnav help ros2` was an error, although a page begins with what users of ROS 2 look for.
#[test]
fn other_words_for_a_topic_lead_to_its_page() {
    for (alias, topic) in ALIASES {
        let page = Page::of(alias).unwrap();
        assert_eq!(page.topic(), *topic);
        assert!(page.has_heading_with("ros 2"), "{alias}");
    }
}

use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, RngSeed};
use sketchnav_qualitative::hof::Surround;

use super::*;
use crate::drawn::DrawnMetres;
use crate::error::Error;
use crate::route::{Command, INCH_M, Kind, MOST_M, Place, Range, Relation, Route, State};

#[test]
fn a_sentence_that_a_person_wrote_is_read() {
    let route =
        read("When an object is left and another is ahead, at most 2 m away, then turn right").unwrap();
    assert_eq!(route.states.len(), 3);
    let [start, state, end] = &route.states[..] else { panic!("{route:?}") };
    assert_eq!((start.kind, start.command), (Kind::Start, Command::Forward));
    assert_eq!((end.kind, end.command), (Kind::End, Command::Stop));
    assert_eq!((state.kind, state.command), (Kind::Change, Command::Right));
    let near = Some(Range { low: 0.0, high: 2.0 });
    let expected = [
        Relation { object: 0, place: Place::Direction(4), proximity_m: None, width: None, landmark: None },
        Relation { object: 1, place: Place::Direction(0), proximity_m: near, width: None, landmark: None },
    ];
    assert_eq!(state.relations, expected);
    assert_eq!(route.objects, ["", ""]);
}

/// Chronis 2007, figure 4.10, word for word.
const PUBLISHED: &str = "
1. When Object #1 is in direction 9
and Object #2 is in direction 13
Then Move forward
2. When Object #3 is in direction 15 at proximity 135 with width 47
Then Turn right
3. When Object #3 is in direction 5 at proximity 80 with width 61
or Object #3 is in direction 6 at proximity 120 with width 33
and Object #2 is in direction 12
Then Move forward
4. When Object #4 is in direction 14 at proximity 110 with width 65
Then Turn left
5. When Object #5 is in direction 0 at proximity 65 with width 61
Then Move forward
6. When Object #3 is in direction 5
and Object #4 is in direction 11
and Object #5 is in direction 0
Then Stop
";

#[test]
fn the_published_path_description_is_read_and_printed() {
    let text = PUBLISHED.replacen("1. When", "1. At the start, when", 1);
    let route = read(&text).unwrap();
    assert_eq!(route.objects, ["object #1", "object #2", "object #3", "object #4", "object #5"]);
    let commands: Vec<_> = route.states.iter().map(|state| state.command).collect();
    use Command::{Forward, Left, Right, Stop};
    assert_eq!(commands, [Forward, Right, Forward, Left, Forward, Stop]);
    let groups: Vec<_> = route.states[2].groups().map(<[Relation]>::len).collect();
    assert_eq!(groups, [2, 1]);
    let range = route.states[1].relations[0].proximity_m.unwrap();
    assert!((range.low / INCH_M - 113.0).abs() < 1e-9 && (range.high / INCH_M - 157.0).abs() < 1e-9);
    let table = table(&route);
    for row in [
        "Object #1 (object #1) is in direction 9\n",
        "Object #3 (object #3) is in direction 15 at proximity 135 with width 47\n    Turn right\n",
        "or Object #3 (object #3) is in direction 6 at proximity 120 with width 33\nand Object #2",
        "    END: Stop\n",
    ] {
        let row = row.replace(" (object #1)", "").replace(" (object #3)", "");
        assert!(table.contains(&row), "{row:?} in {table}");
    }
    assert_eq!(read(&print(&route)).unwrap(), route);
}

#[test]
fn directions_have_words() {
    let place = |words: &str| {
        let route = read(&format!("When the desk is {words}, then turn left.")).unwrap();
        route.states[1].relations.iter().map(|relation| relation.place).collect::<Vec<_>>()
    };
    for (words, direction) in [
        ("ahead", 0),
        ("in front of the robot", 0),
        ("ahead slightly left", 1),
        ("front-left", 2),
        ("left slightly ahead", 3),
        ("to the left", 4),
        ("on the left", 4),
        ("left slightly behind", 5),
        ("left-rear", 6),
        ("behind slightly right", 9),
        ("right slightly ahead", 13),
        ("ahead slightly right", 15),
        ("in direction 11", 11),
    ] {
        assert_eq!(place(words), [Place::Direction(direction)], "{words}");
    }
    assert_eq!(place("roughly ahead"), [15, 0, 1].map(Place::Direction));
    assert_eq!(place("around the robot"), [Place::Surrounds(Surround::Completely)]);
    assert_eq!(place("around the robot but for right"), [Place::Surrounds(Surround::OpeningAt(12))]);
    assert_eq!(place("left, or ahead"), [4, 0].map(Place::Direction));
}

#[test]
fn errors_name_line_and_word_and_the_nearest_word() {
    let cases = [
        ("When the desk is ahaed, then turn left.", "line 1, word 5: expected a direction, as \"ahead\""),
        ("When the desk is ahaed, then turn left.", "found \"ahaed\"; did you mean \"ahead\"?"),
        (
            "# a route\n\nWhen the desk is left thn turn left.",
            "line 3, word 6: expected \"then\", found \"thn\"; did you mean \"then\"?",
        ),
        ("When the desk is left, then turn rihgt.", "found \"rihgt\"; did you mean \"right\"?"),
        ("When the desk is left, then trun right.", "found \"trun\"; did you mean \"turn\"?"),
        ("When the desk, then turn right.", "line 1, word 3: expected \"is\", found \",\""),
        ("When the desk is left, at most 2 metrs away, then stop.", "did you mean \"metre\"?"),
        (
            "When the desk is left, at most far away, then stop.",
            "word 8: expected a number from 0 to 10000, found \"far\"",
        ),
        ("When the desk is left", "line 1, end of line: expected \"then\", found \"\""),
        ("When the desk is in direction 16, then stop.", "expected a direction from 0 to 15, found \"16\""),
        ("Whenn the desk is left, then stop.", "found \"whenn\"; did you mean \"when\"?"),
        ("When the \"desk is left, then stop.", "line 1, word 3: expected a closing quote"),
        ("When a box is 3 to 2 m away, then stop.", "expected a direction"),
        (
            "When a box is left, 3 to 2 m away, then stop.",
            "word 8: expected a number of at least 3, found \"2\"",
        ),
        ("Move forward. Stop. When a box is left, then turn left.", "nothing after the sentence that stops"),
        ("When a box is left and the box is right, then turn left.", "each object once"),
        ("At the start, stop.", "expected \"move forward\""),
        (
            "When a box is ahead slightly behind, then stop.",
            "expected \"left\" or \"right\", found \"behind\"",
        ),
    ];
    for (text, expected) in cases {
        let found = read(text).expect_err(text).to_string();
        assert!(found.contains(expected), "{text:?}: {found:?}, {expected:?}");
    }
    assert!(matches!(read("Move forward. Turn left."), Err(Error::Word { .. })));
}

#[test]
fn a_bare_text_is_a_route_to_the_next_object() {
    for text in ["", "# nothing\n", "Move forward.", "Move forward. Stop."] {
        let route = read(text).unwrap();
        assert_eq!(route.states.iter().map(|state| state.kind).collect::<Vec<_>>(), [Kind::Start, Kind::End]);
    }
}

#[test]
fn the_text_of_the_documentation_is_read() {
    let text =
        "# Comments and blank lines are skipped. Sentences may go over several lines, and may be numbered.
        At the start, move forward.
        When an object is left and another is ahead, at most 2 m away, then turn right.
        After 4.2 m, when the desk is ahead slightly left, 1 to 2.5 m away, with width 20 to 70, or ahead,
          and the trash is roughly behind-left, then move forward.
        At the end, when the cabinet is right, then stop.";
    let route = read(text).unwrap();
    assert_eq!(route.states.iter().map(|state| state.relations.len()).collect::<Vec<_>>(), [0, 2, 5, 1]);
    assert_eq!(route.states[2].after, Some(DrawnMetres(4.2)));
    assert_eq!(read(&print(&route)).unwrap(), route);
}

fn range(most: u32, top: f64) -> impl Strategy<Value = Option<Range>> {
    let numbers = (0..most, 0..most, prop::bool::weighted(0.2));
    prop::option::of(numbers.prop_map(move |(a, b, is_open)| {
        let [low, high] = [a.min(b), a.max(b)].map(|n| f64::from(n) / 100.0);
        Range { low, high: if is_open { top } else { high } }
    }))
}

fn place() -> impl Strategy<Value = Place> {
    let surround = (0..3, 0_usize..16).prop_map(|(kind, i)| match kind {
        0 => Surround::From(i),
        1 => Surround::OpeningAt(i),
        _ => Surround::Completely,
    });
    prop_oneof![4 => (0_u8..16).prop_map(Place::Direction), 1 => surround.prop_map(Place::Surrounds)]
}

type Group = (usize, Vec<(Place, Option<Range>, Option<Range>)>);

fn state() -> impl Strategy<Value = (Vec<Group>, usize, Option<u16>)> {
    let relation = (place(), range(2000, MOST_M), range(18_000, 180.0));
    let group = (0_usize..7, prop::collection::vec(relation, 1..4));
    (prop::collection::vec(group, 1..4), 0_usize..3, prop::option::of(any::<u16>()))
}

/// Names as people write them. An empty one stands for an anonymous object.
const NAMES: [&str; 7] = ["desk", "trash can", "object #3", "", "is", "Desk, left", "#"];

fn route() -> impl Strategy<Value = Route> {
    prop::collection::vec(state(), 0..5).prop_map(|states| {
        let mut route = Route { objects: NAMES.map(String::from).to_vec(), states: Vec::new() };
        let after = |after: Option<u16>| after.map(|after| DrawnMetres(f64::from(after) / 100.0));
        let last = states.len();
        let mut before = Command::Forward;
        route.states.push(State { kind: Kind::Start, relations: vec![], command: before, after: None });
        for (i, (groups, command, drawn)) in states.into_iter().enumerate() {
            let command = [Command::Forward, Command::Left, Command::Right][command];
            let kind = if command == before { Kind::Additional } else { Kind::Change };
            let mut relations: Vec<Relation> = Vec::new();
            for (object, places) in groups {
                let object = if NAMES[object].is_empty() {
                    // An anonymous object cannot be referred to again, so each mention is a new object.
                    route.objects.push(String::new());
                    route.objects.len() - 1
                } else {
                    object
                };
                if relations.iter().all(|other| other.object != object) {
                    let new = |(place, proximity_m, width)| Relation {
                        object,
                        place,
                        proximity_m,
                        width,
                        landmark: None,
                    };
                    relations.extend(places.into_iter().map(new));
                }
            }
            before = command;
            let is_end = i + 1 == last && i % 2 == 0;
            let (kind, command) = if is_end { (Kind::End, Command::Stop) } else { (kind, command) };
            route.states.push(State { kind, relations, command, after: after(drawn) });
        }
        if before != Command::Stop && route.states.last().is_none_or(|last| last.kind != Kind::End) {
            route.states.push(State {
                kind: Kind::End,
                relations: vec![],
                command: Command::Stop,
                after: None,
            });
        }
        route
    })
}

proptest! {
    #![proptest_config(Config {
        rng_seed: RngSeed::Fixed(11), rng_algorithm: RngAlgorithm::ChaCha, failure_persistence: None, ..Config::default()
    })]

    #[test]
    fn what_is_printed_is_read_again(route in route()) {
        let text = print(&route);
        let found = read(&text);
        prop_assert_eq!(found.as_ref(), Ok(&route.normalized()), "{}", text);
    }

    #[test]
    fn any_text_is_read_or_rejected(
        words in prop::collection::vec(prop::sample::select(vec![
            "when", "the", "desk", "is", "left", "slightly", "ahead", ",", ".", "and", "or", "then", "turn", "right", "at",
            "most", "2", "m", "away", "with", "width", "to", "3", "\"", "another", "around", "robot", "stop", "end", "\n", "#1",
        ]), 0..30),
    ) {
        if let Ok(route) = read(&words.join(" ")) {
            prop_assert!(route.check().is_ok());
            prop_assert_eq!(read(&print(&route)), Ok(route.normalized()));
        }
    }
}

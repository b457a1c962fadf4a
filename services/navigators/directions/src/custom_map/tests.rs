//! Tests of parsing and printing custom maps.

use proptest::prelude::*;

use super::*;
use crate::testing::config;

fn parsed(text: &str) -> CustomMap {
    text.parse().unwrap_or_else(|error| panic!("{error}"))
}

fn error(text: &str) -> String {
    text.parse::<CustomMap>().unwrap_err().to_string()
}

/// Returns a signature with one dot in each of the first `count` quadrants.
pub fn counting(count: usize) -> Signature {
    let mut signature = Signature::default();
    Corner::ALL.into_iter().take(count).for_each(|quadrant| signature.occupy(quadrant));
    signature
}

#[test]
fn a_panorama_that_is_most_like_what_is_seen_decides() {
    let map = parsed("(Isol, (none+point+pair+none, -), (group+point+none+none, SW, Isol), -)");
    let verification = map.entries()[0].verification.unwrap();
    let response = |words: &str| verification.response(Signature::of_words(words).unwrap());
    let back = Response::Recover(Recovery { corner: Corner::Sw, word: Descriptor::Isolated });
    assert_eq!(response("none+point+pair+none"), Response::Correct);
    assert_eq!(response("none+pair+point+none"), Response::Correct, "two are off by one");
    assert_eq!(response("pair+point+none+none"), back);
    assert_eq!(response("none+point+pair+group"), Response::Lost, "three more in one quadrant");
    assert_eq!(parsed(&map.to_string()), map);
}

#[test]
fn figure_17_is_read() {
    let map = parsed("(Isol, SW)\n(Isol, Trajp, SE)\n(Isol, (4, SW, Isol), (2, SE, Isol), (3, -), SW)");
    let [seek, slide, verify] = map.entries() else { panic!("{map}") };
    assert_eq!((seek.word, seek.trajectory, seek.place), (Descriptor::Isolated, None, Some(Corner::Sw)));
    assert_eq!((slide.trajectory, slide.place), (Some(Direction::Forward), Some(Corner::Se)));
    let verification = verify.verification.unwrap();
    let back = |corner| Response::Recover(Recovery { corner, word: Descriptor::Isolated });
    let responses: Vec<_> = (0..5).map(|count| verification.response(counting(count))).collect();
    let lost = Response::Lost;
    assert_eq!(responses, [lost, lost, back(Corner::Se), Response::Correct, back(Corner::Sw)]);
}

#[test]
fn the_example_of_6_3_4_is_read_with_its_brackets() {
    let map = parsed("((Isol,SE), (Isol,NE), (Isol,NE), (Isol,Trajp, (2,NW,Isol), (1,-),-))");
    assert_eq!(map.entries().len(), 4);
    assert_eq!(map.entries()[3].place, None);
    assert_eq!(map.entries()[3].to_string(), "(Isol, Trajp, (2, NW, Isol), (1, -), -)");
}

#[test]
fn a_map_that_branches_is_read() {
    let map = parsed(
        "(*, SW)\n(Isol, (point+none+none+pair, NE, 4), (-, SE, 4), (none+point+pair+none, -), SW)\n\
         (Isol, (*, NE, 4), (point+point+none+none, -), -)\n\
         (Isol, Trajn, (none+point+pair+none, SW, 3), (*, SE, 2), -)",
    );
    assert!(map.branches());
    let sees = |entry: usize, words: &str| {
        map.entries()[entry].verification.unwrap().response(Signature::of_words(words).unwrap())
    };
    let to = |corner, entry| Response::Branch(Branch { corner, entry });
    assert_eq!(sees(1, "none+point+pair+none"), Response::Correct);
    assert_eq!(sees(1, "point+none+none+group"), to(Corner::Ne, 3));
    assert_eq!(sees(1, "group+group+group+group"), Response::Lost, "like nothing that the entry names");
    assert_eq!(sees(2, "group+group+group+group"), to(Corner::Ne, 3), "any other");
    let way = Way::Branch(Branch { corner: Corner::Se, entry: 3 });
    assert_eq!(map.entries()[1].verification.unwrap().without_landmark(), Some(way));
    assert_eq!(map.entries()[3].place, None, "none of its signs is right");
    assert_eq!(parsed(&map.to_string()), map);
    assert!(!parsed("(*, SW)\n(Isol, (2, SE, Isol), (3, -), -)").branches());
}

#[test]
fn who_says_the_same_of_every_landmark_does_not_look_around() {
    let looks = |entry: &str| {
        let map = parsed(&format!("(*, SW)\n{entry}\n(Isol, -)"));
        map.entries()[1].verification.is_some_and(Verification::looks_around)
    };
    assert!(looks("(Isol, (3, -), SW)") && looks("(Isol, (*, SW, 3), (point+none+none+none, -), SE)"));
    assert!(!looks("(Isol, (-, NE, 2), SW)") && !looks("(Isol, (*, SW, 3), -)") && !looks("(Isol, SW)"));
}

#[test]
fn case_comments_and_white_space_do_not_matter() {
    let plain = parsed("(*, SW)\n(Isol, Trajn, -)");
    assert_eq!(parsed("# two\n ( * ,sw ) # start\n\n\t(ISOL,\n trajN,-),"), plain);
}

#[test]
fn errors_name_line_column_and_word() {
    for (text, expected) in [
        ("", "line 1, column 1: expected \"(\" of an entry, found the end"),
        ("(Isol, SW)\n(Isolated, NE)", "line 2, column 2: expected a landmark: "),
        (
            "(Isol, UP)",
            "line 1, column 8: expected a bearing (000 to 359), \"Trajp\", \"Trajn\", \"(\", a corner (SE, SW, NE, NW) or \"-\", found \"UP\"",
        ),
        ("(Isol, 360, SW)", "line 1, column 8: expected a bearing from 000 to 359, found \"360\""),
        ("(Isol, 045 SW)", "line 1, column 12: expected \",\", found \"SW\""),
        ("(Isol, SW", "line 1, column 10: expected \")\", found the end"),
        (
            "(Isol, (5, -), SW)",
            "line 1, column 9: expected a quadrant occupancy count from 0 to 4, four of none, point, pair and group joined by \"+\", \"*\" for any other sign, or \"-\" for no landmark, found \"5\"",
        ),
        (
            "(Isol, (3, -), (3, SW, Isol), SW)",
            "line 1, column 17: expected a count that the entry does not have yet",
        ),
        (
            "(Isol, (3, -), (2, -), SW)",
            "line 1, column 20: expected a corner, since the entry has its right count",
        ),
        ("(Isol, (3, SW, Isol), SW)", "line 1, column 8: expected a clause with the right count"),
        ("(Isol, -)\n(Isol, -)", "line 1, column 1: expected a corner at the end of each entry but the last"),
        (
            "(Same, SW)\n(Isol, -)",
            "line 1, column 1: expected a landmark other than \"Same\", since there is none",
        ),
        (
            "(*, SW)\n(door, Same, -)",
            "line 2, column 1: expected a landmark other than \"Same\", since that is known without",
        ),
        ("(*, SW)\n(door, SW)", "line 2, column 2: expected a landmark: "),
        ("(*, SW)\n(big_door, Isol, -)", "line 2, column 2: expected a landmark: "),
        ("(*, SW)\n(New, Isol, -)", "line 2, column 7: expected a bearing (000 to 359), "),
        ("(*, SW)\n(Isol, (2, SE, door, Isol), (3, -), -)", "line 2, column 16: expected a landmark: "),
        (
            "(*, SW)\n(Same, Trajp, -)",
            "line 2, column 1: expected a landmark other than \"Same\", since a line",
        ),
        ("(Isol, SW) )", "line 1, column 12: expected \"(\" of an entry, found \")\""),
        ("((Isol, SW)", "line 1, column 12: expected \"(\" of an entry or \")\" of the map, found the end"),
        (
            "(*, SW)\n(Isol, (3, NE, 4), -)",
            "line 2, column 16: expected a word for a landmark, or the number of an entry of this map, found \"4\"",
        ),
        ("(Isol, (3, NE, 0), -)", "line 1, column 16: expected the number of an entry, from 1, found \"0\""),
        (
            "(Isol, (3, NE, 1x), -)",
            "line 1, column 16: expected the number of an entry, from 1, found \"1x\"",
        ),
        (
            "(Isol, (-, -), SW)",
            "line 1, column 12: expected a corner, since without a landmark none is right",
        ),
        (
            "(*, SW)\n(Isol, (3, NE, 1), SW)\n(Isol, -)",
            "line 2, column 1: expected \"-\" at the end of an entry that takes no landmark as right",
        ),
        (
            "(*, SW)\n(Isol, (3, NE, 1), -)\n(Isol, -)",
            "line 3, column 1: expected an entry that the one before it or a branch leads to",
        ),
        ("(Isol, Trajp, Trajn, SW)", "line 1, column 15: expected \"(\", a corner"),
        (
            "(Isol, (3, UP, Isol), (2, -), SW)",
            "line 1, column 12: expected a corner (SE, SW, NE, NW) or \"-\", found \"UP\"",
        ),
        ("(Isol, (3, SW, Lone), (2, -), SW)", "line 1, column 16: expected a landmark: "),
        ("(Isol, (3, SW Isol), (2, -), SW)", "line 1, column 15: expected \",\", found \"Isol\""),
        ("(Isol, (3, SW, 1, 2), (2, -), SW)", "line 1, column 17: expected \")\", found \",\""),
        (
            "(Isol, (none+two+none+none, -), SW)",
            "line 1, column 9: expected a quadrant occupancy count from 0 to 4, four of none, point, pair and group joined by",
        ),
        ("(Isol, (point+none+none, NE, 1), -)", "line 1, column 9: expected a quadrant occupancy count"),
        (
            "(Isol, (*, NE, 1), (*, SE, 1), -)",
            "line 1, column 21: expected a count that the entry does not have yet, found \"*\"",
        ),
        ("(Isol, (3, NE, 99999999999), -)", "line 1, column 16: expected the number of an entry, from 1"),
        ("(Isol, (3, NE, 10001), -)", "line 1, column 16: expected the number of an entry, from 1"),
        ("(Isol, (3, NE, 1), -", "line 1, column 21: expected \")\", found the end"),
    ] {
        let found = error(text);
        assert!(found.contains(expected), "{text:?}: {found}");
    }
}

/// Sentences may span several lines and contain comments.
#[test]
fn a_map_in_sentences_is_read() {
    let map = parsed(
        "# through the hall\n1. Take the landmark closest to the middle of the window. Move it to the\n   south-west corner and \
         go on at 2.\n2. Seek the most isolated landmark at a bearing of 053°. If there is none, move the last landmark to the \
         north-east corner and go on at 2. If it has one to the north-west, two to the south-east and more than two to the \
         south-west, it is the right one: move it to the south-east corner and go on at 3.\n3. Seek the closest landmark. It is \
         the goal.",
    );
    let same = "(*, SW)\n(Isol, 053, (-, NE, 2), (point+none+pair+group, -), SE)\n(*, -)";
    assert_eq!(map, parsed(same));
}

#[test]
fn errors_in_sentences_name_line_column_and_word() {
    const FIRST: &str = "1. Take the landmark closest to the middle of the window. Move it to the south-west corner and go on at 2.\n";
    for (text, expected) in [
        ("1 Take the", "line 1, column 3: expected \".\" after the number of an entry, found \"Take\""),
        ("2. Seek", "line 1, column 1: expected the number of the next entry, found \"2\""),
        ("1. Fly to", "line 1, column 4: expected \"Seek\" or \"Slide along the line towards\""),
        (
            "1. Seek the lonely landmark.",
            "line 1, column 9: expected a landmark: \"the only landmark in view\"",
        ),
        (
            "1. Seek the closest landmark.",
            "line 1, column 30: expected a sentence that says what to do with the landmark",
        ),
        (
            "1. Seek the closest landmark at a bearing of 360°.",
            "line 1, column 46: expected a bearing from 000° to 359°",
        ),
        (
            "1. Slide along the line towards the closest landmark.",
            "column 53: expected \"until a new landmark comes in\"",
        ),
        (
            "1. Seek the closest landmark. Move it to the upper corner",
            "column 46: expected a corner: south-east",
        ),
        (
            "1. Seek the closest landmark. Move it to the south-west corner and go on at 3.",
            "column 77: expected \"and go on at\" and the number of the next entry, found \"3\"",
        ),
        (
            "1. Seek the closest big_door. It is the goal.",
            "line 1, column 9: expected a landmark: \"the only landmark in view\"",
        ),
        (
            "1. Seek the closest door. If 2 of its quadrants hold landmarks, move it to the south-west corner and seek the closest \
             door from there.",
            "line 1, column 107: expected a landmark of any kind, since ways back know no kinds",
        ),
        ("1. Seek the closest landmark. If it is red, it is the goal.", "column 34: expected a condition: "),
        (
            "1. Seek the closest landmark. If it has one to the north, it is the goal.",
            "column 52: expected north-west, north-east, south-east or south-west, each at most once, found \"north\"",
        ),
        (
            "1. Seek the closest landmark. It is the goal. If it looks different, it is the goal.",
            "column 47: expected the next entry, since the sentence about the right landmark comes last",
        ),
        (
            "1. Seek the closest landmark. It is the goal: move it to the south-west corner.\n2. Seek",
            "line 1, column 45: expected \"go on at\" and a number: only the last entry may move the goal",
        ),
    ] {
        let found = error(text);
        assert!(found.contains(expected), "{text:?}: {found}");
    }
    for (rest, expected) in [
        (
            "2. Seek the closest landmark. If there is none, move the last landmark to the south-east corner and go on at 4. It \
             is the goal.",
            "line 2, column 110: expected a word for a landmark, or the number of an entry of this map, found \"4\"",
        ),
        (
            "2. Seek the closest landmark. If there is none, it is the goal.",
            "expected a corner, since without a landmark none is right",
        ),
        ("", "line 1, column 105: expected \"It is the goal\" in the last entry, found \"2\""),
    ] {
        let found = error(&format!("{FIRST}{rest}"));
        assert!(found.contains(expected), "{rest:?}: {found}");
    }
}

#[test]
fn an_entry_has_at_most_eight_signs_beside_the_right_one_and_a_map_ten_thousand_entries() {
    let sign = |code: u8| format!("({}, NE, 1), ", Signature::of_code(code));
    let signs = |count: u8| (0..count).map(sign).collect::<String>();
    assert!(format!("(Isol, {}(*, -), SW)", signs(8)).parse::<CustomMap>().is_ok());
    for (text, expected) in [
        (format!("(Isol, {}-)", signs(9)), "line 1, column 8: expected at most eight ways back"),
        (format!("(Isol, {}(*, -), SW)", signs(9)), "expected at most eight ways back"),
        ("(Isol, SW)\n".repeat(MOST_ENTRIES + 1), "line 10001, column 1: expected at most 10000 entries"),
    ] {
        let found = error(&text);
        assert!(found.contains(expected), "{text:?}: {found}");
    }
}

#[test]
fn maps_that_cannot_be_followed_are_rejected() {
    let plain = parsed("(Isol, -)").entries()[0];
    let entry = |place| Entry { place, ..plain };
    assert!(matches!(CustomMap::new(Vec::new()), Err(Error::MapLength { found: 0, .. })));
    let early = CustomMap::new(vec![entry(Some(Corner::Se)), entry(None), entry(None)]);
    assert_eq!(early, Err(Error::NoCorner { entry: 2 }));
    assert!(Verification::new(5).is_err());
}

fn recovery() -> impl Strategy<Value = Recovery> {
    (0_usize..4, 0_usize..8)
        .prop_map(|(corner, word)| Recovery { corner: Corner::ALL[corner], word: Descriptor::ALL[word] })
}

fn entry() -> impl Strategy<Value = Entry> {
    let verification =
        (0_u8..5, prop::array::uniform5(prop::option::of(recovery()))).prop_map(|(expected, ways)| {
            let add = |all: Verification, (count, way): (u8, Option<Recovery>)| match way {
                Some(way) => all.recovering(count, way),
                None => all,
            };
            (0..).zip(ways).fold(Verification::new(expected).unwrap(), add)
        });
    of_verification(verification)
}

fn of_verification(verification: impl Strategy<Value = Verification>) -> impl Strategy<Value = Entry> {
    let direction = prop::option::of(
        prop::bool::ANY.prop_map(|p| if p { Direction::Forward } else { Direction::Backward }),
    );
    let bearing = prop::option::of(0..FULL_TURN_DEG);
    let kind = prop::option::of(
        "[a-z][-a-z0-9]{0,15}".prop_filter_map("a word of maps", |name| LandmarkKind::of(&name)),
    );
    (kind, 0_usize..7, bearing, direction, prop::option::of(verification), 0_usize..4).prop_map(
        |(kind, word, bearing_deg, trajectory, verification, place)| Entry {
            kind,
            word: Descriptor::ALL[word],
            bearing_deg,
            trajectory,
            verification,
            place: Some(Corner::ALL[place]),
        },
    )
}

/// Generates entries, some of which branch to one of the first three entries.
fn branching_entry() -> impl Strategy<Value = Entry> {
    let seen = prop_oneof![
        (0_u8..=255).prop_map(|code| Sign::Panorama(Signature::of_code(code))),
        (0_u8..5).prop_map(Sign::Count),
    ];
    let sign = prop_oneof![4 => seen.clone(), 1 => Just(Sign::Other), 1 => Just(Sign::Nothing)];
    let branch =
        (0_usize..4, 0_u16..3).prop_map(|(corner, entry)| Branch { corner: Corner::ALL[corner], entry });
    let way = prop_oneof![branch.prop_map(Way::Branch), recovery().prop_map(Way::Recover)];
    let right = prop::option::of(prop_oneof![4 => seen, 1 => Just(Sign::Other)]);
    let verification = (right, prop::collection::vec((sign, way), 0..12)).prop_map(|(right, ways)| {
        let own = right.map_or(Verification::default(), |right| Verification::new(right).unwrap());
        ways.into_iter().fold(own, |all, (sign, way)| all.leading(sign, way))
    });
    (of_verification(verification), prop::bool::ANY).prop_map(|(mut entry, ends)| {
        // An entry without any sign has no verification, and an entry that only recovers has a right sign.
        let is_empty = |signs: &Verification| signs.expected().is_none() && signs.branches().next().is_none();
        entry.verification = entry.verification.filter(|signs| !is_empty(signs));
        entry.place = entry.place.filter(|_| !ends && entry.verification.is_none_or(Verification::accepts));
        entry
    })
}

/// Generates maps of such entries. If nothing leads to an entry, the previous one is made to.
fn branching_map() -> impl Strategy<Value = CustomMap> {
    prop::collection::vec(branching_entry(), 3..9).prop_map(|mut entries| {
        for after in 1..entries.len() {
            let is_led_to = entries.iter().flat_map(Entry::branches).any(|to| usize::from(to) == after);
            let before = &mut entries[after - 1];
            if before.place.is_none() && !is_led_to {
                before.verification = before.verification.filter(|signs| signs.accepts());
                before.place = Some(Corner::Se);
            }
        }
        // Without the branches of an entry, another entry may be unreachable.
        CustomMap::new(entries.clone()).unwrap_or_else(|_| {
            entries.iter_mut().for_each(|entry| (entry.verification, entry.place) = (None, Some(Corner::Se)));
            CustomMap::new(entries).unwrap()
        })
    })
}

proptest! {
    #![proptest_config(config(128))]

    #[test]
    fn what_is_printed_is_read_again(mut entries in prop::collection::vec(entry(), 1..12), ends: bool) {
        if ends {
            entries.last_mut().unwrap().place = None;
        }
        let map = CustomMap::new(entries).unwrap();
        prop_assert_eq!(parsed(&map.to_string()), map.clone());
        let bytes = postcard::to_allocvec(&map).unwrap();
        prop_assert_eq!(postcard::from_bytes::<CustomMap>(&bytes).unwrap(), map);
    }

    #[test]
    fn a_map_that_branches_is_read_as_it_is_printed(map in branching_map()) {
        let text = map.to_string();
        prop_assert_eq!(parsed(&text).to_string(), text);
        prop_assert_eq!(parsed(&map.to_string()), map.clone());
        let bytes = postcard::to_allocvec(&map).unwrap();
        prop_assert_eq!(postcard::from_bytes::<CustomMap>(&bytes).unwrap(), map);
    }

    #[test]
    fn a_map_is_read_as_it_is_said(
        map in prop_oneof![
            branching_map(),
            prop::collection::vec(entry(), 1..12).prop_map(|entries| CustomMap::new(entries).unwrap()),
        ],
    ) {
        let text = map.sentences();
        prop_assert_eq!(parsed(&text), map.clone());
        prop_assert_eq!(parsed(&text).sentences(), text);
    }

    /// Some characters of a map in sentences are missing or replaced by others.
    #[test]
    fn damaged_sentences_are_read_or_rejected(
        map in branching_map(),
        at: prop::sample::Index,
        length in 0_usize..12,
        slip in "[(),:.\\-0-9a-z° \n]{0,4}",
    ) {
        let mut text = map.sentences();
        let is_at = |at: &usize| text.is_char_boundary(*at);
        let begin = (0..=at.index(text.len())).rev().find(is_at).unwrap();
        let end = ((begin + length).min(text.len())..=text.len()).find(is_at).unwrap();
        text.replace_range(begin..end, &slip);
        match text.parse::<CustomMap>() {
            Ok(map) => prop_assert_eq!(parsed(&map.sentences()), map),
            Err(error) => prop_assert!(error.to_string().starts_with("line "), "{}: {}", text, error),
        }
    }

    /// Some characters of a branching map are missing or replaced by others.
    #[test]
    fn a_damaged_map_is_read_or_rejected(
        map in branching_map(),
        at: prop::sample::Index,
        length in 0_usize..12,
        slip in "[(),\\-\\* 0-9NSEWnone+pair]{0,4}",
    ) {
        let mut text = map.to_string();
        let begin = at.index(text.len());
        text.replace_range(begin..(begin + length).min(text.len()), &slip);
        match text.parse::<CustomMap>() {
            Ok(map) => prop_assert_eq!(parsed(&map.to_string()), map),
            Err(error) => prop_assert!(error.to_string().starts_with("line "), "{}: {}", text, error),
        }
    }

    #[test]
    fn any_text_is_read_or_rejected(text in "[(),#\\-\\* \n0-5ISOLTRAJPNEWisoltrajpnew€]{0,60}") {
        if let Ok(map) = text.parse::<CustomMap>() {
            prop_assert_eq!(parsed(&map.to_string()), map);
        }
    }
}

//! References to places in words: a name, or a room by its position relative to others, as in "the room left of the kitchen".
//!
//! ```text
//! reference = [the] room relation | name
//! relation  = side reference | nearest to reference | between reference and reference
//! side      = [to the] left of | [to the] right of | above | below | above left of | above right of | below left of | below right of
//! ```
//!
//! A name may be put in quotes, and must be if it contains the word "and" and stands between the words "between" and "and".

use std::fmt;

/// A place that a person refers to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reference {
    /// A place by its name, as written, which may begin with an article.
    Name(String),
    /// A room by its position.
    Room(Box<Relation>),
}

/// The position of a room relative to other places.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Relation {
    /// On one side of a place.
    Beside(Side, Reference),
    /// Nearest to a place.
    Nearest(Reference),
    /// Between two places.
    Between(Reference, Reference),
}

/// A side of a place, as one sees it on the sheet, counter-clockwise from the right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// To the right.
    Right,
    /// Farther up, and to the right.
    AboveRight,
    /// Farther up.
    Above,
    /// Farther up, and to the left.
    AboveLeft,
    /// To the left.
    Left,
    /// Farther down, and to the left.
    BelowLeft,
    /// Farther down.
    Below,
    /// Farther down, and to the right.
    BelowRight,
}

/// The reason why a relation cannot be understood.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ReferenceError {
    /// The name of a place is missing.
    #[error("expected the name of a place after {after:?}, found nothing")]
    NoName {
        /// The words before the name.
        after: String,
    },
    /// The second of two places is missing.
    #[error("expected `and` with a second place after `between`, found {found:?}")]
    NoSecond {
        /// The words after `between`.
        found: String,
    },
    /// The text is too long to refer to a place.
    #[error("expected at most {MAX_WORDS} words, found {found}")]
    TooLong {
        /// Number of words.
        found: usize,
    },
    /// A quoted name does not end.
    #[error("expected a closing quote, found {found:?}")]
    NoQuote {
        /// The words from the opening quote.
        found: String,
    },
    /// Something follows a quoted name.
    #[error("expected nothing after the quoted name, found {found:?}")]
    Rest {
        /// The words after it.
        found: String,
    },
}

/// The words of each relation, longer ones before those that they begin with.
const SIDES: [(&[&str], Side); 10] = [
    (&["to", "the", "left", "of"], Side::Left),
    (&["to", "the", "right", "of"], Side::Right),
    (&["above", "left", "of"], Side::AboveLeft),
    (&["above", "right", "of"], Side::AboveRight),
    (&["below", "left", "of"], Side::BelowLeft),
    (&["below", "right", "of"], Side::BelowRight),
    (&["left", "of"], Side::Left),
    (&["right", "of"], Side::Right),
    (&["above"], Side::Above),
    (&["below"], Side::Below),
];
const ROOM: [&[&str]; 2] = [&["the", "room"], &["room"]];
const NEAREST: &[&str] = &["nearest", "to"];
const BETWEEN: &[&str] = &["between"];
const AND: &[&str] = &["and"];
/// Maximum number of words, which bounds how deep relations are nested.
const MAX_WORDS: usize = 200;
/// Characters that may enclose a name.
const QUOTES: [char; 2] = ['"', '\''];

impl Side {
    /// All sides, in the order of the directions of [`DrawnRooms`](crate::rooms::DrawnRooms).
    pub const ALL: [Self; crate::rooms::DIRECTIONS] = [
        Self::Right,
        Self::AboveRight,
        Self::Above,
        Self::AboveLeft,
        Self::Left,
        Self::BelowLeft,
        Self::Below,
        Self::BelowRight,
    ];

    /// Returns the words of the relation.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Right => "right of",
            Self::AboveRight => "above right of",
            Self::Above => "above",
            Self::AboveLeft => "above left of",
            Self::Left => "left of",
            Self::BelowLeft => "below left of",
            Self::Below => "below",
            Self::BelowRight => "below right of",
        }
    }
}

impl Reference {
    /// Parses a reference. Case and spaces are ignored, except in names. Text that is no relation is a name.
    ///
    /// # Errors
    /// [`ReferenceError`] if the text begins like a relation and does not end like one.
    pub fn parse(text: &str) -> Result<Self, ReferenceError> {
        let words: Vec<&str> = text.split_whitespace().collect();
        if words.len() > MAX_WORDS {
            return Err(ReferenceError::TooLong { found: words.len() });
        }
        let mut rest = &words[..];
        let found = reference(&mut rest, false, "")?;
        if rest.is_empty() { Ok(found) } else { Err(ReferenceError::Rest { found: rest.join(" ") }) }
    }

    /// Returns true if the text mentions a room or a relation without being one, so that whoever wrote it may have meant one.
    pub fn may_be_meant(text: &str) -> bool {
        let words: Vec<&str> = text.split_whitespace().collect();
        let is_relation = |from: &[&str]| {
            let words = SIDES.iter().map(|(words, _)| *words).chain([NEAREST, BETWEEN, &["the", "room"]]);
            words.into_iter().any(|words| after(from, words).is_some())
        };
        (0..words.len()).any(|from| is_relation(&words[from..]))
    }
}

/// Returns the words after `expected` if the words begin with it.
fn after<'a, 'b>(words: &'b [&'a str], expected: &[&str]) -> Option<&'b [&'a str]> {
    let begins = words.len() >= expected.len()
        && expected.iter().zip(words).all(|(expected, word)| word.eq_ignore_ascii_case(expected));
    begins.then(|| &words[expected.len()..])
}

/// Takes a reference from the beginning of the words. If it is the first of two, it ends at the word "and".
fn reference(words: &mut &[&str], ends_at_and: bool, preceding: &str) -> Result<Reference, ReferenceError> {
    let rooms = ROOM.iter().find_map(|room| after(words, room));
    if let Some(mut rest) = rooms
        && let Some(relation) = relation(&mut rest, ends_at_and)?
    {
        *words = rest;
        return Ok(Reference::Room(Box::new(relation)));
    }
    name(words, ends_at_and, preceding).map(Reference::Name)
}

/// Takes a relation from the beginning of the words, or returns `None` if they do not begin with one.
fn relation(words: &mut &[&str], ends_at_and: bool) -> Result<Option<Relation>, ReferenceError> {
    let side = SIDES.iter().find_map(|(expected, side)| Some((after(words, expected)?, *side)));
    if let Some((rest, side)) = side {
        *words = rest;
        return reference(words, ends_at_and, side.words()).map(|of| Some(Relation::Beside(side, of)));
    }
    if let Some(rest) = after(words, NEAREST) {
        *words = rest;
        return reference(words, ends_at_and, "nearest to").map(|of| Some(Relation::Nearest(of)));
    }
    let Some(rest) = after(words, BETWEEN) else { return Ok(None) };
    *words = rest;
    let first = reference(words, true, "between")?;
    let Some(second) = after(words, AND) else {
        return Err(ReferenceError::NoSecond { found: rest.join(" ") });
    };
    *words = second;
    reference(words, ends_at_and, "and").map(|second| Some(Relation::Between(first, second)))
}

/// Takes a name from the beginning of the words.
fn name(words: &mut &[&str], ends_at_and: bool, preceding: &str) -> Result<String, ReferenceError> {
    // An article may precede the quotes.
    if let Some(rest) = after(words, &["the"])
        && rest.first().is_some_and(|word| word.starts_with(QUOTES))
    {
        *words = rest;
    }
    let quote = words.first().and_then(|word| word.chars().next()).filter(|first| QUOTES.contains(first));
    let (name, count) = match quote {
        Some(quote) => quoted(words, quote)?,
        None => {
            let is_end = |word: &&str| ends_at_and && word.eq_ignore_ascii_case(AND[0]);
            let count = words.iter().position(is_end).unwrap_or(words.len());
            (words[..count].join(" "), count)
        }
    };
    if name.is_empty() && !preceding.is_empty() {
        return Err(ReferenceError::NoName { after: preceding.to_owned() });
    }
    *words = &words[count..];
    Ok(name)
}

/// Returns the name in quotes at the beginning of the words, and the number of its words.
fn quoted(words: &[&str], quote: char) -> Result<(String, usize), ReferenceError> {
    let text = words.join(" ");
    let inner = &text[quote.len_utf8()..];
    let (name, rest) =
        inner.split_once(quote).ok_or_else(|| ReferenceError::NoQuote { found: text.clone() })?;
    if !rest.is_empty() && !rest.starts_with(' ') {
        return Err(ReferenceError::Rest { found: rest.to_owned() });
    }
    let count = words.len() - rest.split_whitespace().count();
    Ok((name.trim().to_owned(), count))
}

impl fmt::Display for Reference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Room(relation) => write!(f, "the room {relation}"),
            Self::Name(name) => {
                let quote =
                    QUOTES.iter().find(|quote| !name.contains(**quote)).filter(|_| needs_quotes(name));
                match quote {
                    Some(quote) => write!(f, "{quote}{name}{quote}"),
                    None => f.write_str(name),
                }
            }
        }
    }
}

/// Returns true if a name without quotes would be understood as something else.
fn needs_quotes(name: &str) -> bool {
    let is_name = || Reference::parse(name).is_ok_and(|read| read == Reference::Name(name.to_owned()));
    let words: Vec<&str> = name.split(' ').collect();
    // After "above", the name "left of the stairs" would be part of the side.
    let continues_side = || ["left", "right"].iter().any(|side| after(&words, &[side, "of"]).is_some());
    words.iter().any(|word| word.eq_ignore_ascii_case(AND[0])) || continues_side() || !is_name()
}

impl fmt::Display for Relation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Beside(side, of) => write!(f, "{} {of}", side.words()),
            Self::Nearest(to) => write!(f, "nearest to {to}"),
            Self::Between(first, second) => write!(f, "between {first} and {second}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn name(name: &str) -> Reference {
        Reference::Name(name.to_owned())
    }

    fn room(relation: Relation) -> Reference {
        Reference::Room(Box::new(relation))
    }

    #[test]
    fn a_room_is_described_by_its_position() {
        for (text, expected) in [
            ("kitchen", name("kitchen")),
            ("the kitchen", name("the kitchen")),
            ("room 5", name("room 5")),
            ("the room left of the kitchen", room(Relation::Beside(Side::Left, name("the kitchen")))),
            (" The  ROOM to the left of Office  3 ", room(Relation::Beside(Side::Left, name("Office 3")))),
            ("room above stairs", room(Relation::Beside(Side::Above, name("stairs")))),
            (
                "the room above left of the stairs",
                room(Relation::Beside(Side::AboveLeft, name("the stairs"))),
            ),
            ("room Below Right of Bath", room(Relation::Beside(Side::BelowRight, name("Bath")))),
            ("the room nearest to the bath", room(Relation::Nearest(name("the bath")))),
            ("the room between kitchen and bath", room(Relation::Between(name("kitchen"), name("bath")))),
            (
                "the room between \"food and drink\" and bath",
                room(Relation::Between(name("food and drink"), name("bath"))),
            ),
            ("the room below the \"store\"", room(Relation::Beside(Side::Below, name("store")))),
            ("the room below food and drink", room(Relation::Beside(Side::Below, name("food and drink")))),
            (
                "the room above the room right of the lounge",
                room(Relation::Beside(Side::Above, room(Relation::Beside(Side::Right, name("the lounge"))))),
            ),
            (
                "the room between the room below the bath and the hall",
                room(Relation::Between(
                    room(Relation::Beside(Side::Below, name("the bath"))),
                    name("the hall"),
                )),
            ),
        ] {
            assert_eq!(Reference::parse(text), Ok(expected), "{text}");
        }
    }

    /// Regression test: the stack overflowed.
    #[test]
    fn a_text_without_end_is_refused() {
        let error = Reference::parse(&"the room left of ".repeat(20_000)).unwrap_err().to_string();
        assert_eq!(error, "expected at most 200 words, found 80000");
    }

    #[test]
    fn half_a_relation_is_refused_with_what_is_missing() {
        for (text, words) in [
            ("the room left of", "expected the name of a place after \"left of\", found nothing"),
            (
                "the room between kitchen",
                "expected `and` with a second place after `between`, found \"kitchen\"",
            ),
            ("the room between kitchen and ", "expected the name of a place after \"and\", found nothing"),
            ("the room between and bath", "expected the name of a place after \"between\", found nothing"),
            ("the room above \"the bath", "expected a closing quote, found \"\\\"the bath\""),
            ("the room above 'l'ora'", "expected nothing after the quoted name, found \"ora'\""),
            ("the room above \"bath\" here", "expected nothing after the quoted name, found \"here\""),
        ] {
            assert_eq!(Reference::parse(text).unwrap_err().to_string(), words, "{text}");
        }
    }

    #[test]
    fn a_relation_that_is_not_known_is_noticed() {
        for (text, expected) in [
            ("the room behind the kitchen", true),
            ("left of the kitchen", true),
            ("office nearest to the stairs", true),
            ("kitchen", false),
            ("the kitchen", false),
        ] {
            assert_eq!(Reference::may_be_meant(text), expected, "{text}");
        }
    }

    fn references() -> impl Strategy<Value = Reference> {
        let word = prop_oneof![
            Just("the"),
            Just("room"),
            Just("left"),
            Just("above"),
            Just("of"),
            Just("and"),
            Just("between"),
            Just("to"),
            Just("nearest"),
            Just("kitchen"),
            Just("Küche"),
            Just("3"),
            Just("l'ora")
        ];
        let names = prop::collection::vec(word, 1..5).prop_map(|words| Reference::Name(words.join(" ")));
        names.prop_recursive(3, 8, 2, |inner| {
            let side = prop::sample::select(&Side::ALL[..]);
            prop_oneof![
                (side, inner.clone()).prop_map(|(side, of)| room(Relation::Beside(side, of))),
                inner.clone().prop_map(|to| room(Relation::Nearest(to))),
                (inner.clone(), inner).prop_map(|(a, b)| room(Relation::Between(a, b))),
            ]
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn what_is_written_is_read_back(reference in references()) {
            let text = reference.to_string();
            prop_assert_eq!(Reference::parse(&text), Ok(reference), "{}", text);
        }

        #[test]
        fn any_text_is_a_reference_or_refused(text in "(the |room |left of |above |between |and |\"|'|[a-z ü]){0,12}") {
            if let Ok(reference) = Reference::parse(&text) {
                prop_assert_eq!(Reference::parse(&reference.to_string()), Ok(reference));
            }
        }
    }
}

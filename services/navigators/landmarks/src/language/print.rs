//! Prints routes in words.

use std::fmt::Write;

use sketchnav_qualitative::hof::Surround;

use crate::drawn::DrawnMetres;
use crate::route::{Command, INCH_M, Kind, MOST_M, Place, Range, Relation, Route, State};

/// Words for the directions, in order from 0.
pub(super) const DIRECTION_WORDS: [&str; 16] = [
    "ahead",
    "ahead slightly left",
    "ahead-left",
    "left slightly ahead",
    "left",
    "left slightly behind",
    "behind-left",
    "behind slightly left",
    "behind",
    "behind slightly right",
    "behind-right",
    "right slightly behind",
    "right",
    "right slightly ahead",
    "ahead-right",
    "ahead slightly right",
];

/// Words that must not occur in a name without quotes.
pub(super) const RESERVED: [&str; 11] =
    ["a", "an", "the", "another", "is", "and", "or", "then", "when", "after", "at"];

/// Returns the route in words. [`super::read()`] converts the words back into the same route, with its
/// objects in the order in which they are mentioned.
///
/// # Panics
/// If a relation refers to no object of the route, which [`Route::check`] rules out.
pub fn print(route: &Route) -> String {
    let mut text = String::new();
    for state in &route.states {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{}", sentence(route, state));
    }
    text
}

fn sentence(route: &Route, state: &State) -> String {
    let mut parts = Vec::new();
    match (state.kind, state.after) {
        (Kind::Start, _) => parts.push("at the start".to_owned()),
        (Kind::End, None) => parts.push("at the end".to_owned()),
        (Kind::End, Some(DrawnMetres(after))) => parts.push(format!("at the end, after {after} m")),
        (_, Some(DrawnMetres(after))) => parts.push(format!("after {after} m")),
        (_, None) => {}
    }
    if state.relations.is_empty() {
        parts.push(state.command.to_string());
    } else {
        parts.push(format!("when {}, then {}", conditions(route, state), state.command));
    }
    let text = parts.join(", ") + ".";
    text[..1].to_uppercase() + &text[1..]
}

fn conditions(route: &Route, state: &State) -> String {
    let mut anonymous = 0;
    let groups = state.groups().map(|group| {
        let name = &route.objects[group[0].object];
        anonymous += usize::from(name.is_empty());
        let subject = match (name.is_empty(), anonymous) {
            (true, 1) => "an object".to_owned(),
            (true, _) => "another".to_owned(),
            _ => format!("the {}", quoted(name)),
        };
        let places: Vec<_> = group.iter().map(relation).collect();
        format!("{subject} is {}", places.join(", or "))
    });
    groups.collect::<Vec<_>>().join(", and ")
}

/// Returns a name as it is read back.
pub fn spoken(name: &str) -> String {
    name.replace(['"', '\n', '\r'], "'")
}

/// Returns a name, in quotes if it would not be read back as the same name without them.
fn quoted(name: &str) -> String {
    let is_plain = |word: &str| {
        !RESERVED.contains(&word)
            && word.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_#".contains(c))
            && (!word.starts_with('#') || word[1..].starts_with(|c: char| c.is_ascii_digit()))
    };
    let is_single_spaced = name.split(' ').all(|word| !word.is_empty());
    if is_single_spaced && name.split(' ').all(is_plain) && name != "object" {
        name.to_owned()
    } else {
        format!("\"{}\"", spoken(name))
    }
}

fn relation(relation: &Relation) -> String {
    let mut text = place(relation.place);
    if let Some(range) = relation.proximity_m {
        text += &match range {
            Range { low, high } if high >= MOST_M => format!(", at least {low} m away"),
            Range { low: 0.0, high } => format!(", at most {high} m away"),
            Range { low, high } => format!(", {low} to {high} m away"),
        };
    }
    if let Some(Range { low, high }) = relation.width {
        text += &format!(", with width {low} to {high}");
    }
    text
}

fn place(place: Place) -> String {
    let direction = |i: usize| DIRECTION_WORDS[i % DIRECTION_WORDS.len()];
    match place {
        Place::Direction(i) => direction(usize::from(i)).to_owned(),
        Place::Surrounds(Surround::Completely) => "around the robot".to_owned(),
        Place::Surrounds(Surround::From(i)) => format!("around the robot from {}", direction(i)),
        Place::Surrounds(Surround::OpeningAt(i)) => format!("around the robot but for {}", direction(i)),
    }
}

/// Returns the route as printed in Chronis 2007 (table 4.1): with numbered objects, directions as numbers, and proximities in
/// inches. A range is represented by its middle.
///
/// # Panics
/// See [`print()`].
pub fn table(route: &Route) -> String {
    let mut text = String::new();
    for state in &route.states {
        for (i, relation) in state.relations.iter().enumerate() {
            let joint = match i {
                0 => "",
                _ if state.relations[i - 1].object == relation.object => "or ",
                _ => "and ",
            };
            let _ = write!(text, "{joint}Object #{}", relation.object + 1);
            let name = &route.objects[relation.object];
            if !name.is_empty() && !name.starts_with("object ") {
                let _ = write!(text, " ({name})");
            }
            let _ = match relation.place {
                Place::Direction(i) => write!(text, " is in direction {i}"),
                Place::Surrounds(Surround::Completely) => write!(text, " surrounds the robot"),
                Place::Surrounds(Surround::From(i)) => write!(text, " surrounds the robot in direction {i}"),
                Place::Surrounds(Surround::OpeningAt(i)) => {
                    write!(text, " surrounds the robot with opening in direction {i}")
                }
            };
            if let Some(range) = relation.proximity_m {
                let _ = write!(text, " at proximity {:.0}", range.middle() / INCH_M);
            }
            if let Some(range) = relation.width {
                let _ = write!(text, " with width {:.0}", range.middle());
            }
            text.push('\n');
        }
        let begin = match state.kind {
            Kind::Start => "START: ",
            Kind::End => "END: ",
            Kind::Change | Kind::Additional => "",
        };
        let command = state.command.to_string();
        let _ = writeln!(text, "    {begin}{}{}", command[..1].to_uppercase(), &command[1..]);
    }
    text
}

/// The words of each command that [`super::read()`] accepts.
pub(super) const COMMANDS: [(&[&str], Command); 6] = [
    (&["move", "forward"], Command::Forward),
    (&["go", "straight"], Command::Forward),
    (&["go", "forward"], Command::Forward),
    (&["turn", "left"], Command::Left),
    (&["turn", "right"], Command::Right),
    (&["stop"], Command::Stop),
];

//! Parses a custom map that is written in English sentences, as [`CustomMap::in_words`] writes it.
//!
//! ```text
//! 1. Take the landmark closest to the middle of the window. Move it to the south-west corner and go on at 2.
//! 2. Seek the most isolated landmark at a bearing of 053°. It is the goal.
//! ```
//!
//! Sentences are translated into the symbols of a map, and each symbol keeps the position of the words that it stands for. Errors
//! therefore name lines and columns of the original text.

use super::parse::{Symbol, Token, tokens};
use super::words::{AROUND, DOTS, around_noun, corner_name};
use super::{CustomMap, Direction, FULL_TURN_DEG, MOST_ENTRIES};
use crate::description::Descriptor;
use crate::error::Error;
use crate::geometry::Corner;
use crate::markers::{ANY_KIND, LandmarkKind};
use crate::signature::Signature;

/// Returns true if a map is written in sentences, whose entries begin with their numbers.
pub(super) fn are_sentences(text: &str) -> bool {
    tokens(text).first().is_some_and(|token| token.text.starts_with(|c: char| c.is_ascii_digit()))
}

/// Translates sentences into symbols.
pub(super) fn symbols(text: &str) -> Result<Vec<Symbol>, Error> {
    let mut reader = Sentences { words: split(text), next: 0, end: Token::end_of(text), symbols: Vec::new() };
    let mut number = 0;
    loop {
        number += 1;
        let end = reader.entry(number)?;
        let is_last = reader.peek(0).text.is_empty();
        match end {
            End::MovesGoal(token) if !is_last => {
                return Err(token.error("\"go on at\" and a number: only the last entry may move the goal"));
            }
            End::GoesOn(token) if is_last => {
                return Err(token.error("\"It is the goal\" in the last entry"));
            }
            _ if is_last => return Ok(reader.symbols),
            _ => {}
        }
    }
}

/// Splits the tokens of a text once more, so that full stops and colons stand alone.
fn split(text: &str) -> Vec<Token<'_>> {
    let mut words = Vec::new();
    for token in tokens(text) {
        let word = token.text.trim_end_matches(['.', ':']);
        let whole = Token { text: word, ..token };
        words.extend((!word.is_empty()).then_some(whole));
        let column = token.column + word.chars().count();
        let marks = token.text[word.len()..].char_indices();
        words.extend(marks.map(|(at, _)| Token {
            text: &token.text[word.len() + at..=word.len() + at],
            column: column + at,
            ..token
        }));
    }
    words
}

struct Sentences<'a> {
    words: Vec<Token<'a>>,
    next: usize,
    end: Token<'a>,
    symbols: Vec<Symbol>,
}

/// What an entry does with the right landmark, with the token that says so.
#[derive(Debug, Clone, Copy)]
enum End<'a> {
    /// It is the goal, or the entry has no right landmark.
    Stops,
    /// It is the goal, and is moved to a corner.
    MovesGoal(Token<'a>),
    /// It leads to the next entry.
    GoesOn(Token<'a>),
}

impl<'a> Sentences<'a> {
    fn peek(&self, ahead: usize) -> Token<'a> {
        self.words.get(self.next + ahead).copied().unwrap_or(self.end)
    }

    fn take(&mut self) -> Token<'a> {
        let token = self.peek(0);
        self.next += 1;
        token
    }

    /// Skips these words, if they are next.
    fn says(&mut self, words: &str) -> bool {
        let count = words.split(' ').count();
        let says = words.split(' ').enumerate().all(|(ahead, word)| self.peek(ahead).is(word));
        self.next += if says { count } else { 0 };
        says
    }

    fn expect(&mut self, words: &str, expected: &'static str) -> Result<(), Error> {
        if self.says(words) { Ok(()) } else { Err(self.peek(0).error(expected)) }
    }

    fn stop(&mut self) -> Result<(), Error> {
        self.expect(".", "the end of the sentence")
    }

    /// Adds symbols at the place of a token.
    fn write(&mut self, at: Token<'_>, symbols: &[&str]) {
        let symbol = |text: &&str| Symbol { text: (*text).to_owned(), line: at.line, column: at.column };
        self.symbols.extend(symbols.iter().map(symbol));
    }

    fn entry(&mut self, number: usize) -> Result<End<'a>, Error> {
        let begin = self.take();
        if number > MOST_ENTRIES {
            return Err(begin.error("at most 10000 entries"));
        }
        if begin.text.parse() != Ok(number) {
            return Err(begin.error("the number of the next entry"));
        }
        self.expect(".", "\".\" after the number of an entry")?;
        self.write(begin, &["("]);
        self.sought(number == 1)?;
        let first = self.peek(0);
        if self.is_at_end_of_entry() {
            return Err(first.error("a sentence that says what to do with the landmark"));
        }
        let mut right = None;
        while !self.is_at_end_of_entry() {
            let sentence = self.peek(0);
            if right.is_some() {
                return Err(
                    sentence.error("the next entry, since the sentence about the right landmark comes last")
                );
            }
            right = self.sentence(number)?.map(|(corner, end)| (sentence, corner, end));
        }
        let (at, corner, end) = right.unwrap_or((first, None, End::Stops));
        self.write(at, &[corner.map_or("-", Corner::word), ")"]);
        Ok(end)
    }

    fn is_at_end_of_entry(&self) -> bool {
        let token = self.peek(0);
        token.text.is_empty() || token.text.parse::<usize>().is_ok()
    }

    /// Parses the sentence about the landmark that an entry seeks.
    fn sought(&mut self, is_first: bool) -> Result<(), Error> {
        let begin = self.peek(0);
        if is_first && let Some(kind) = self.says_around(["take the", " closest to the middle of the window"])
        {
            self.write_landmark(begin, kind, Descriptor::Any);
            return self.stop();
        }
        let ways = [
            ("slide along the line towards", Direction::Forward),
            ("slide along the line away from", Direction::Backward),
        ];
        let slides = ways.into_iter().find(|(words, _)| self.says(words)).map(|(_, way)| way);
        if slides.is_none() {
            self.expect("seek", "\"Seek\" or \"Slide along the line towards\" or \"away from\" a landmark")?;
        }
        let at = self.peek(0);
        let by_bearing = self.says_around(["the", " at a bearing of"]);
        let is_known_by_bearing = by_bearing.is_some();
        let (kind, word) = match by_bearing {
            Some(kind) => (kind, Descriptor::Any),
            None => self.landmark()?,
        };
        self.write_landmark(at, kind, word);
        if is_known_by_bearing || self.says("at a bearing of") {
            let token = self.take();
            let degrees = token.text.strip_suffix('°').and_then(|text| text.parse().ok());
            let degrees = degrees.filter(|degrees: &u16| *degrees < FULL_TURN_DEG);
            let degrees = degrees.ok_or_else(|| token.error("a bearing from 000° to 359°"))?;
            self.write(token, &[format!("{degrees:03}").as_str(), ","]);
        }
        if let Some(way) = slides {
            self.expect("until a new landmark comes in", "\"until a new landmark comes in\"")?;
            self.write(begin, &[way.word(), ","]);
        }
        self.stop()
    }

    /// Parses a landmark. Returns its kind, if that matters, and the word for it.
    fn landmark(&mut self) -> Result<(Option<LandmarkKind>, Descriptor), Error> {
        const EXPECTED: &str = "a landmark: \"the only landmark in view\", \"the most isolated landmark\", \"the farther landmark \
            of the most isolated pair\", \"the farther landmark of the two in view\", \"the only landmark that has just come into \
            view\", \"any landmark in view\", \"the closest landmark\", \"the same landmark\" or \"the landmark at a bearing of\", \
            or one of these with a kind in place of \"landmark\"";
        let says = |word: Descriptor| Some((self.says_around(around_noun(word))?, word));
        let found = Descriptor::ALL.into_iter().find_map(says);
        found.ok_or_else(|| self.peek(0).error(EXPECTED))
    }

    /// Skips the words before and after the noun for a landmark, if they are next. Returns the kind that the noun names, if it
    /// names one.
    fn says_around(&mut self, [before, after]: [&str; 2]) -> Option<Option<LandmarkKind>> {
        let begin = self.next;
        let noun =
            self.says(before).then(|| self.take()).filter(|_| after.is_empty() || self.says(&after[1..]));
        let kind = noun.and_then(|noun| match noun.is(ANY_KIND) {
            true => Some(None),
            false => LandmarkKind::of(&noun.text.to_ascii_lowercase()).map(Some),
        });
        if kind.is_none() {
            self.next = begin;
        }
        kind
    }

    fn write_landmark(&mut self, at: Token<'_>, kind: Option<LandmarkKind>, word: Descriptor) {
        if let Some(kind) = kind {
            self.write(at, &[kind.name(), ","]);
        }
        self.write(at, &[word.word(), ","]);
    }

    /// Parses a sentence about the landmark that was attained. If that is the right one, returns the corner to move it to.
    fn sentence(&mut self, number: usize) -> Result<Option<(Option<Corner>, End<'a>)>, Error> {
        let begin = self.peek(0);
        let sign = if self.says("if") { Some(self.condition()?) } else { None };
        if let Some(sign) = &sign {
            self.expect(",", "\",\" after the condition")?;
            self.write(begin, &["(", sign.as_str(), ","]);
        }
        let right = if self.says("it is the goal") {
            Some(self.goal()?)
        } else if sign.is_none() || self.says("it is the right one :") {
            self.expect("move it to the", "\"Move it to the\" and a corner, \"It is the goal\", or \"If\"")?;
            let corner = self.corner()?;
            let to = self.go_on_at(Some(number + 1))?;
            Some((Some(corner), End::GoesOn(to)))
        } else {
            self.way(sign.as_deref() == Some("-"))?;
            None
        };
        if sign.is_some() {
            let closing: &[&str] = if right.is_none() { &[")", ","] } else { &["-", ")", ","] };
            self.write(begin, closing);
        }
        self.stop().map(|()| right)
    }

    /// Parses what to do with the goal, if anything.
    fn goal(&mut self) -> Result<(Option<Corner>, End<'a>), Error> {
        let at = self.peek(0);
        if !self.says(":") {
            return Ok((None, End::Stops));
        }
        self.expect("move it to the", "\"move it to the\" and a corner")?;
        Ok((Some(self.corner()?), End::MovesGoal(at)))
    }

    /// Parses how to go on from a landmark that is not the right one or, if there is none, from the last landmark.
    fn way(&mut self, is_from_last: bool) -> Result<(), Error> {
        let at = self.peek(0);
        match is_from_last {
            true => self
                .expect("move the last landmark to the", "\"move the last landmark to the\" and a corner")?,
            false => self.expect(
                "move it to the",
                "\"move it to the\" and a corner, \"it is the right one\" or \"it is the goal\"",
            )?,
        }
        let corner = self.corner()?;
        self.write(at, &[corner.word(), ","]);
        let at = self.peek(0);
        if self.says("and seek") {
            let sought = self.peek(0);
            let (None, word) = self.landmark()? else {
                return Err(sought.error("a landmark of any kind, since ways back know no kinds"));
            };
            self.write(at, &[word.word()]);
            return self.expect("from there", "\"from there\"");
        }
        let to = self.go_on_at(None)?;
        self.write(to, &[to.text]);
        Ok(())
    }

    /// Parses the number of the entry that follows. Returns its token.
    fn go_on_at(&mut self, wanted: Option<usize>) -> Result<Token<'a>, Error> {
        let expected = match wanted {
            Some(_) => "\"and go on at\" and the number of the next entry",
            None => "\"and go on at\" and the number of an entry, or \"and seek\" a landmark",
        };
        self.expect("and go on at", expected)?;
        let token = self.take();
        let number = token.text.parse::<usize>().ok();
        let is_right = number.is_some_and(|number| wanted.is_none_or(|wanted| wanted == number));
        if is_right { Ok(token) } else { Err(token.error(expected)) }
    }

    fn corner(&mut self) -> Result<Corner, Error> {
        let token = self.take();
        let corner = Corner::ALL.into_iter().find(|corner| token.is(corner_name(*corner)));
        let corner = corner
            .ok_or_else(|| token.error("a corner: south-east, south-west, north-east or north-west"))?;
        self.expect("corner", "\"corner\"")?;
        Ok(corner)
    }

    /// Parses a condition about what is around a landmark. Returns its sign, as it is written in symbols.
    fn condition(&mut self) -> Result<String, Error> {
        const EXPECTED: &str = "a condition: \"there is none\", \"it looks different\", the number \"of its quadrants\", or \"it \
            has\" and how many landmarks where";
        let fixed = [
            ("there is none", "-"),
            ("it looks different", "*"),
            ("none of its quadrants holds a landmark", "0"),
            ("one of its quadrants holds landmarks", "1"),
            ("it has no landmark around it", "none+none+none+none"),
        ];
        if let Some((_, sign)) = fixed.into_iter().find(|(words, _)| self.says(words)) {
            return Ok(sign.to_owned());
        }
        if self.says("it has") {
            return self.around();
        }
        let count = self.peek(0).text;
        let is_count = matches!(count, "2" | "3" | "4");
        if is_count && self.says(&format!("{count} of its quadrants hold landmarks")) {
            return Ok(count.to_owned());
        }
        Err(self.peek(0).error(EXPECTED))
    }

    /// Parses what a panorama shows, quadrant by quadrant.
    fn around(&mut self) -> Result<String, Error> {
        let mut seen = Signature::default();
        loop {
            let at = self.peek(0);
            let dots = (1..DOTS.len()).find(|dots| self.says(DOTS[*dots]));
            let dots =
                dots.ok_or_else(|| at.error("how many landmarks: \"one\", \"two\" or \"more than two\""))?;
            self.expect("to the", "\"to the\" and where the landmarks are")?;
            let at = self.take();
            let quadrant = Corner::ROUND.into_iter().zip(AROUND).find(|(_, name)| at.is(name));
            let (quadrant, _) = quadrant.filter(|(quadrant, _)| !seen.has(*quadrant)).ok_or_else(|| {
                at.error("north-west, north-east, south-east or south-west, each at most once")
            })?;
            (0..dots).for_each(|_| seen.occupy(quadrant));
            // A comma also ends the condition, in which case no number of landmarks follows it.
            let follows =
                self.peek(0).is(",") && DOTS[1..].iter().any(|dots| self.peek(1).is(first_word(dots)));
            let goes_on = self.says("and") || (follows && self.says(","));
            if !goes_on {
                return Ok(seen.to_string());
            }
        }
    }
}

fn first_word(words: &str) -> &str {
    words.split(' ').next().unwrap_or_default()
}

impl CustomMap {
    /// Returns the map in sentences, one line for each entry with its number. The text can be parsed again.
    pub fn sentences(&self) -> String {
        (1..).zip(self.in_words()).map(|(entry, words)| format!("{entry}. {words}\n")).collect()
    }
}

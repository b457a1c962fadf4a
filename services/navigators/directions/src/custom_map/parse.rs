//! Parses custom maps. Errors name the line and the column, what was expected there, and the word that was found.

use std::str::FromStr;

use super::{
    Branch, CustomMap, Direction, Entry, FULL_TURN_DEG, MOST_ENTRIES, MOST_WAYS, Recovery, Sign,
    Verification, Way, sentences,
};
use crate::description::Descriptor;
use crate::error::Error;
use crate::geometry::Corner;
use crate::markers::LandmarkKind;
use crate::signature::Signature;

/// A bracket, a comma or a word, with its line and column, both from 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Token<'a> {
    pub text: &'a str,
    pub line: usize,
    pub column: usize,
}

/// A token of a map in sentences, with the position of the words that it stands for.
#[derive(Debug)]
pub(super) struct Symbol {
    pub text: String,
    pub line: usize,
    pub column: usize,
}

impl Symbol {
    fn token(&self) -> Token<'_> {
        Token { text: &self.text, line: self.line, column: self.column }
    }
}

impl Token<'_> {
    /// Returns the empty token at the end of a text.
    pub fn end_of(text: &str) -> Self {
        let line = text.lines().count().max(1);
        let column = text.lines().last().unwrap_or_default().chars().count() + 1;
        Self { text: "", line, column }
    }

    pub fn error(self, expected: &'static str) -> Error {
        let found = match self.text {
            "" => "the end".to_owned(),
            text => format!("{:?}", text.chars().take(40).collect::<String>()),
        };
        Error::Map { line: self.line, column: self.column, expected, found }
    }

    pub fn is(self, word: &str) -> bool {
        self.text.eq_ignore_ascii_case(word)
    }
}

/// Splits a text into tokens. Comments are left out.
pub(super) fn tokens(text: &str) -> Vec<Token<'_>> {
    let mut found = Vec::new();
    for (line, content) in (1..).zip(text.lines()) {
        let content = content.split('#').next().unwrap_or_default();
        let mut rest = content;
        while let Some(start) = rest.find(|c: char| !c.is_whitespace()) {
            rest = &rest[start..];
            let ends = |c: char| c.is_whitespace() || matches!(c, '(' | ')' | ',');
            let first = rest.chars().next().map_or(0, char::len_utf8);
            let length =
                if rest.starts_with(['(', ')', ',']) { first } else { rest.find(ends).unwrap_or(rest.len()) };
            let column = content[..content.len() - rest.len()].chars().count() + 1;
            found.push(Token { text: &rest[..length], line, column });
            rest = &rest[length..];
        }
    }
    found
}

/// The remaining tokens, followed by any number of empty ones.
struct Reader<'a> {
    tokens: Vec<Token<'a>>,
    next: usize,
    end: Token<'a>,
    /// The numbers of the entries that branches lead to, from 1, with the tokens that name them.
    targets: Vec<(usize, Token<'a>)>,
}

impl<'a> Reader<'a> {
    fn new(tokens: Vec<Token<'a>>, end: Token<'a>) -> Self {
        Self { tokens, next: 0, end, targets: Vec::new() }
    }

    fn peek(&self, ahead: usize) -> Token<'a> {
        self.tokens.get(self.next + ahead).copied().unwrap_or(self.end)
    }

    fn take(&mut self) -> Token<'a> {
        let token = self.peek(0);
        self.next += 1;
        token
    }

    fn skips(&mut self, word: &str) -> bool {
        let is_there = self.peek(0).is(word);
        self.next += usize::from(is_there);
        is_there
    }

    fn expect(&mut self, word: &'static str, expected: &'static str) -> Result<(), Error> {
        let token = self.take();
        if token.is(word) { Ok(()) } else { Err(token.error(expected)) }
    }

    fn map(&mut self) -> Result<CustomMap, Error> {
        let is_bracketed = self.peek(0).is("(") && self.peek(1).is("(");
        self.next += usize::from(is_bracketed);
        let (mut entries, mut begins) = (Vec::new(), Vec::new());
        while self.peek(0).is("(") || entries.is_empty() {
            let begin = self.peek(0);
            entries.push(self.entry()?);
            begins.push(begin);
            if entries.len() > MOST_ENTRIES {
                return Err(begin.error("at most 10000 entries"));
            }
            self.skips(",");
        }
        if is_bracketed {
            self.expect(")", "\"(\" of an entry or \")\" of the map")?;
        }
        match self.peek(0) {
            Token { text: "", .. } => {}
            token => return Err(token.error("\"(\" of an entry")),
        }
        if let Some((_, token)) = self.targets.iter().find(|(to, _)| *to > entries.len()) {
            return Err(token.error("a word for a landmark, or the number of an entry of this map"));
        }
        CustomMap::new(entries).map_err(|error| match error {
            Error::NoCorner { entry } => {
                begins[entry - 1].error("a corner at the end of each entry but the last, not \"-\"")
            }
            Error::NothingRight { entry } => {
                begins[entry - 1].error("\"-\" at the end of an entry that takes no landmark as right")
            }
            Error::NotLedTo { entry } => {
                begins[entry - 1].error("an entry that the one before it or a branch leads to")
            }
            Error::Same { entry, expected } => begins[entry - 1].error(expected),
            other => other,
        })
    }

    fn entry(&mut self) -> Result<Entry, Error> {
        self.expect("(", "\"(\" of an entry")?;
        let kind = self.kind();
        let word = self.descriptor()?;
        self.expect(",", "\",\"")?;
        let bearing_deg = self.bearing()?;
        let trajectory = [Direction::Forward, Direction::Backward].into_iter().find(|d| self.skips(d.word()));
        if trajectory.is_some() {
            self.expect(",", "\",\"")?;
        }
        let verification = self.verification()?;
        let token = self.take();
        let expected = match (bearing_deg, trajectory, verification) {
            (None, None, None) => {
                "a bearing (000 to 359), \"Trajp\", \"Trajn\", \"(\", a corner (SE, SW, NE, NW) or \"-\""
            }
            _ => "\"(\", a corner (SE, SW, NE, NW) or \"-\"",
        };
        let place =
            if token.is("-") { None } else { Some(corner(token).ok_or_else(|| token.error(expected))?) };
        self.expect(")", "\")\"")?;
        Ok(Entry { kind, word, bearing_deg, trajectory, verification, place })
    }

    /// Parses a kind of landmark, if there is one before the word for the landmark.
    fn kind(&mut self) -> Option<LandmarkKind> {
        let is_before_word =
            self.peek(1).is(",") && Descriptor::ALL.iter().any(|word| self.peek(2).is(word.word()));
        let kind = LandmarkKind::of(&self.peek(0).text.to_ascii_lowercase()).filter(|_| is_before_word);
        self.next += if kind.is_some() { 2 } else { 0 };
        kind
    }

    fn bearing(&mut self) -> Result<Option<u16>, Error> {
        let token = self.peek(0);
        if !token.text.starts_with(|c: char| c.is_ascii_digit()) {
            return Ok(None);
        }
        self.next += 1;
        let bearing_deg = token.text.parse().ok().filter(|&bearing_deg| bearing_deg < FULL_TURN_DEG);
        let bearing_deg = bearing_deg.ok_or_else(|| token.error("a bearing from 000 to 359"))?;
        self.expect(",", "\",\"")?;
        Ok(Some(bearing_deg))
    }

    fn descriptor(&mut self) -> Result<Descriptor, Error> {
        const EXPECTED: &str = "a landmark: \"Obvious\", \"Isol\", \"IsolPair\", \"PlusPair\", \"New\", \"Confusable\", \"Same\" or \"*\", \
            with or without a kind before it";
        let token = self.take();
        Descriptor::ALL.into_iter().find(|word| token.is(word.word())).ok_or_else(|| token.error(EXPECTED))
    }

    /// Parses all clauses of an entry about signs. Unless one of them branches, one must state the right sign.
    fn verification(&mut self) -> Result<Option<Verification>, Error> {
        let begin = self.peek(0);
        let mut clauses: Vec<(Sign, Option<Way>)> = Vec::new();
        while self.skips("(") {
            let token = self.take();
            let sign = sign(token)?;
            if clauses.iter().any(|&(other, _)| other == sign) {
                return Err(token.error("a count that the entry does not have yet"));
            }
            self.expect(",", "\",\"")?;
            let second = self.take();
            let way = if second.is("-") {
                if sign == Sign::Nothing {
                    return Err(second.error("a corner, since without a landmark none is right"));
                }
                if clauses.iter().any(|(_, way)| way.is_none()) {
                    return Err(second.error("a corner, since the entry has its right count"));
                }
                None
            } else {
                let corner =
                    corner(second).ok_or_else(|| second.error("a corner (SE, SW, NE, NW) or \"-\""))?;
                self.expect(",", "\",\"")?;
                Some(self.way(corner)?)
            };
            self.expect(")", "\")\"")?;
            self.expect(",", "\",\"")?;
            clauses.push((sign, way));
            if clauses.len() > MOST_WAYS + 1 {
                return Err(token.error("at most eight ways back"));
            }
        }
        if clauses.is_empty() {
            return Ok(None);
        }
        let right = clauses.iter().find(|(_, way)| way.is_none());
        let branches = clauses.iter().any(|(_, way)| matches!(way, Some(Way::Branch(_))));
        let mut all = match right {
            Some(&(right, _)) => Verification::new(right)?,
            None if branches => Verification::default(),
            None => return Err(begin.error("a clause with the right count, as \"(3, -)\"")),
        };
        let ways = clauses.iter().filter_map(|&(sign, way)| Some((sign, way?)));
        if ways.clone().count() > MOST_WAYS {
            return Err(begin.error("at most eight ways back"));
        }
        for (sign, way) in ways {
            all = all.leading(sign, way);
        }
        Ok(Some(all))
    }

    /// Parses what follows the corner of a clause, which is either a word or the number of an entry.
    fn way(&mut self, corner: Corner) -> Result<Way, Error> {
        let token = self.peek(0);
        if !token.text.starts_with(|c: char| c.is_ascii_digit()) {
            return Ok(Way::Recover(Recovery { corner, word: self.descriptor()? }));
        }
        self.next += 1;
        let number = token.text.parse().ok().filter(|number| (1..=MOST_ENTRIES).contains(number));
        let number = number.ok_or_else(|| token.error("the number of an entry, from 1"))?;
        self.targets.push((number, token));
        Ok(Way::Branch(Branch { corner, entry: (number - 1) as u16 }))
    }
}

fn sign(token: Token<'_>) -> Result<Sign, Error> {
    const EXPECTED: &str = "a quadrant occupancy count from 0 to 4, four of none, point, pair and group joined by \"+\", \
                            \"*\" for any other sign, or \"-\" for no landmark";
    match token.text {
        "*" => Ok(Sign::Other),
        "-" => Ok(Sign::Nothing),
        "0" | "1" | "2" | "3" | "4" => Ok(Sign::Count(token.text.as_bytes()[0] - b'0')),
        text => Signature::of_words(text).map(Sign::Panorama).ok_or_else(|| token.error(EXPECTED)),
    }
}

fn corner(token: Token<'_>) -> Option<Corner> {
    Corner::ALL.into_iter().find(|corner| token.is(corner.word()))
}

impl FromStr for CustomMap {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let end = Token::end_of(text);
        if !sentences::are_sentences(text) {
            return Reader::new(tokens(text), end).map();
        }
        let symbols = sentences::symbols(text)?;
        Reader::new(symbols.iter().map(Symbol::token).collect(), end).map()
    }
}

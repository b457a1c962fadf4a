//! Splits a text into words, keeping their positions for error messages.

use sketchnav_schemas::nearest::{composed, nearest};

use crate::error::{Error, WordPlace};

/// A word, a quoted name, or one of the marks `,`, `.`, `:` and `;`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Token {
    pub text: String,
    pub is_quoted: bool,
    line: usize,
    word: usize,
}

/// The words of a text, and how many of them have been read.
#[derive(Debug)]
pub(super) struct Words {
    tokens: Vec<Token>,
    next: usize,
}

impl Words {
    /// Splits a text into words with composed letters. A `#` at the start of a word begins a comment, unless a digit follows.
    pub fn of(text: &str) -> Result<Self, Error> {
        let mut tokens = Vec::new();
        for (i, line) in composed(text).lines().enumerate() {
            split(line, i + 1, &mut tokens)?;
        }
        Ok(Self { tokens, next: 0 })
    }

    pub fn is_at_end(&self) -> bool {
        self.next == self.tokens.len()
    }

    /// Returns the next word, or "" at the end.
    pub fn peek(&self) -> &str {
        self.peek_at(0)
    }

    /// Returns the word `ahead` places after the next one. A quoted name is returned as a quotation mark, since it is never a
    /// word of the language.
    pub fn peek_at(&self, ahead: usize) -> &str {
        match self.tokens.get(self.next + ahead) {
            Some(token) if !token.is_quoted => &token.text,
            Some(_) => "\"",
            None => "",
        }
    }

    pub fn next(&mut self) -> Option<Token> {
        let token = self.tokens.get(self.next).cloned();
        self.next += usize::from(token.is_some());
        token
    }

    /// Steps back by one word.
    pub fn back(&mut self) {
        self.next = self.next.saturating_sub(1);
    }

    /// Takes the next word if it equals `word`, and returns whether it did.
    pub fn take(&mut self, word: &str) -> bool {
        let is_it = self.peek() == word;
        self.next += usize::from(is_it);
        is_it
    }

    /// Takes the next words if all of them equal `words`, and returns whether they did. Otherwise, none is taken.
    pub fn take_all(&mut self, words: &[&str]) -> bool {
        let are_they = words.iter().enumerate().all(|(i, word)| self.peek_at(i) == *word);
        self.next += if are_they { words.len() } else { 0 };
        are_they
    }

    /// Takes the next word, which must be one of `words`, and returns its index among them.
    pub fn expect(&mut self, words: &[&str]) -> Result<usize, Error> {
        match words.iter().position(|word| self.peek() == *word) {
            Some(i) => {
                self.next += 1;
                Ok(i)
            }
            None => Err(self.error(&one_of(words), words)),
        }
    }

    /// Takes a number from 0 to `most`.
    pub fn number(&mut self, most: f64) -> Result<f64, Error> {
        let found = self.peek().parse::<f64>().ok().filter(|number| (0.0..=most).contains(number));
        let number = found.ok_or_else(|| self.error(&format!("a number from 0 to {most}"), &[]))?;
        self.next += 1;
        Ok(number)
    }

    /// Returns an error at the next word.
    pub fn error(&self, expected: &str, known: &[&str]) -> Error {
        let (line, place, found) = match (self.tokens.get(self.next), self.tokens.last()) {
            (Some(token), _) => (token.line, WordPlace::Word(token.word), token.text.clone()),
            (None, last) => (last.map_or(1, |token| token.line), WordPlace::End, String::new()),
        };
        let nearest = nearest(&found, known.iter().copied()).map(str::to_owned);
        Error::Word { line, place, expected: expected.into(), found, nearest }
    }
}

fn one_of(words: &[&str]) -> String {
    let quoted: Vec<_> = words.iter().map(|word| format!("{word:?}")).collect();
    quoted.join(" or ")
}

fn split(line: &str, number: usize, tokens: &mut Vec<Token>) -> Result<(), Error> {
    let mut rest = line.trim_start();
    let mut word = 0;
    while !rest.is_empty() {
        let is_comment = rest.starts_with('#') && !rest[1..].starts_with(|c: char| c.is_ascii_digit());
        if is_comment {
            break;
        }
        word += 1;
        let mut push =
            |text: &str, is_quoted| tokens.push(Token { text: text.into(), is_quoted, line: number, word });
        if let Some(quoted) = rest.strip_prefix('"') {
            let Some((name, after)) = quoted.split_once('"') else {
                let place = WordPlace::Word(word);
                let (expected, found) = ("a closing quote".into(), rest.into());
                return Err(Error::Word { line: number, place, expected, found, nearest: None });
            };
            push(name, true);
            rest = after;
            // Punctuation after a closing quote is part of the same word.
            let marks = rest.len() - rest.trim_start_matches([',', '.', ':', ';']).len();
            rest[..marks].chars().for_each(|mark| push(mark.encode_utf8(&mut [0; 4]), false));
            rest = rest[marks..].trim_start();
            continue;
        }
        let end = rest.find(|c: char| c.is_whitespace() || c == '"').unwrap_or(rest.len());
        let bare = rest[..end].trim_end_matches([',', '.', ':', ';']);
        if !bare.is_empty() {
            push(&bare.to_lowercase(), false);
        }
        rest[bare.len()..end].chars().for_each(|mark| push(mark.encode_utf8(&mut [0; 4]), false));
        rest = rest[end..].trim_start();
    }
    Ok(())
}

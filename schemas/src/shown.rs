//! Makes text from outside safe to show on a terminal, on a page or in a picture.
//!
//! File names, task names, mission keys and text in recordings may come from anyone. A terminal obeys the
//! control characters in such text, bidirectional controls and zero-width characters make it read as
//! something else, and a line break inside a name starts a line that looks like our own output. All of these
//! are shown as JSON escapes (`\u001b`), so that a JSON object keeps its meaning when it is filtered.
//!
//! All output is filtered here as it is written: [`say!`](crate::say) and the printing macros of the command
//! line use [`one_line`]. Our own styles are added afterwards.

use std::fmt::{self, Arguments, Display, Formatter, Write};
use std::io;

/// Displays text on one line. Line breaks in it are escaped as well.
#[derive(Debug, Clone, Copy)]
pub struct OneLine<T>(pub T);

/// Displays text with line breaks of our own, such as a table or a page.
#[derive(Debug, Clone, Copy)]
pub struct Lines<T>(pub T);

/// Filters text like [`OneLine`].
pub fn one_line(text: impl Display) -> String {
    OneLine(text).to_string()
}

/// Filters text like [`Lines`].
pub fn lines(text: impl Display) -> String {
    Lines(text).to_string()
}

/// Writes a line to standard error. If that fails, the line is dropped. [`say!`](crate::say) takes a format.
pub fn aside(text: Arguments<'_>) {
    let _ = io::Write::write_fmt(&mut io::stderr().lock(), format_args!("{}\n", OneLine(text)));
}

/// Prints a line to standard error. Unlike `eprintln!`, it does not panic and escapes everything that could control a
/// terminal.
#[macro_export]
macro_rules! say {
    ($($text:tt)*) => { $crate::shown::aside(format_args!($($text)*)) };
}

impl<T: Display> Display for OneLine<T> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(Filter { out: f, breaks_lines: false }, "{}", self.0)
    }
}

impl<T: Display> Display for Lines<T> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(Filter { out: f, breaks_lines: true }, "{}", self.0)
    }
}

/// Passes on visible characters and escapes the rest.
struct Filter<'a, 'b> {
    out: &'a mut Formatter<'b>,
    breaks_lines: bool,
}

impl Write for Filter<'_, '_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let mut rest = text;
        let breaks_lines = self.breaks_lines;
        while let Some((at, c)) = rest.char_indices().find(|&(_, c)| is_escaped(c, breaks_lines)) {
            self.out.write_str(&rest[..at])?;
            write_escaped(self.out, c)?;
            rest = &rest[at + c.len_utf8()..];
        }
        self.out.write_str(rest)
    }
}

fn is_escaped(c: char, breaks_lines: bool) -> bool {
    match c {
        '\t' => false,
        '\n' => !breaks_lines,
        ' '..='~' => false,
        _ => c.is_control() || !is_seen(c),
    }
}

/// Returns true if a character beyond ASCII is visible or a space. Unicode's format characters (bidirectional
/// controls, joiners, zero-width spaces, tags), line separators and unassigned characters are invisible.
fn is_seen(c: char) -> bool {
    let is_space = c.is_whitespace() && !matches!(c, '\u{2028}' | '\u{2029}');
    // The standard library knows which characters are invisible, but its method for a single character also escapes marks
    // such as accents, which are harmless after a letter. The method for a whole text does not.
    let mut bytes = [b'a', 0, 0, 0, 0];
    let length = 1 + c.encode_utf8(&mut bytes[1..]).len();
    let text = str::from_utf8(&bytes[..length]).unwrap_or_default();
    is_space || text.escape_debug().nth(1) == Some(c)
}

fn write_escaped(out: &mut Formatter<'_>, c: char) -> fmt::Result {
    match c {
        '\n' => out.write_str("\\n"),
        '\r' => out.write_str("\\r"),
        _ => c.encode_utf16(&mut [0; 2]).iter().try_for_each(|unit| write!(out, "\\u{unit:04x}")),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn control_and_invisible_characters_are_escaped() {
        for (text, shown) in [
            ("\u{1b}[31mred\u{1b}[0m", "\\u001b[31mred\\u001b[0m"),
            ("title\u{1b}]0;x\u{7}", "title\\u001b]0;x\\u0007"),
            ("c1 \u{9b}31m \u{90}", "c1 \\u009b31m \\u0090"),
            (
                "bidi \u{202e}gpj.exe\u{2066}\u{2069}\u{200f}\u{61c}",
                "bidi \\u202egpj.exe\\u2066\\u2069\\u200f\\u061c",
            ),
            (
                "zero\u{200b}width\u{200d}\u{2060}\u{feff}\u{ad}",
                "zero\\u200bwidth\\u200d\\u2060\\ufeff\\u00ad",
            ),
            ("tag \u{e0041}", "tag \\udb40\\udc41"),
            ("a\nreached: 9 of 9\r\u{2028}\u{85}", "a\\nreached: 9 of 9\\r\\u2028\\u0085"),
            ("del \u{7f}\u{8}\0", "del \\u007f\\u0008\\u0000"),
        ] {
            assert_eq!(one_line(text), shown);
        }
        assert_eq!(lines("a\n\u{1b}b\r\n"), "a\n\\u001bb\\r\n");
    }

    #[test]
    fn visible_characters_are_unchanged() {
        // Including a decomposed accent, a narrow space, ideographs, arrows, box drawing, quotes and backslashes.
        let text = "0 → 1\te\u{301} 3,0\u{202f}m\u{a0}日本語\u{3000}العربية हिन्दी 🙂 ├─┤ \"a\" 'b' \\n × –";
        assert_eq!(one_line(text), text);
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn arbitrary_text_becomes_one_line_without_control_characters(text in "\\PC*|.*|[\u{1b}\u{9b}\u{202e}\n\r a-z]*") {
            let shown = one_line(&text);
            prop_assert!(!shown.contains(|c: char| c.is_control() && c != '\t'), "{shown:?}");
            prop_assert_eq!(one_line(&shown), shown);
        }

        /// JSON may be filtered as it is written, because it remains the same object.
        #[test]
        fn escaped_json_parses_to_the_same_object(text in ".*|[\u{1b}\u{9b}\u{202e}\u{e0041}\n\" a-z\\\\]*") {
            let shown = one_line(serde_json::json!({ "name": text }));
            let read: serde_json::Value = serde_json::from_str(&shown).unwrap();
            prop_assert_eq!(read["name"].as_str(), Some(text.as_str()));
        }
    }
}

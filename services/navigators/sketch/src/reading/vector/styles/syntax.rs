//! The syntax of CSS as used in drawings: rules, declarations and functions, with their strings, brackets and comments. This module
//! does not interpret properties. (CSS Syntax Module Level 3.)

use std::borrow::Cow;

/// A declaration `name: value` of a rule or of a `style` attribute.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Declaration<'a> {
    pub name: &'a str,
    pub value: &'a str,
    pub important: bool,
}

/// A part of a style sheet: the prelude, and the body of its block. There is no body if the part ends with a semicolon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Block<'a> {
    pub prelude: &'a str,
    pub body: Option<&'a str>,
}

/// Returns the index of the first of `stops` outside strings, brackets and escapes, or the text's length if there is none.
pub(super) fn find(text: &str, stops: &[u8]) -> usize {
    let (mut closers, mut quote, mut escaped) = (Vec::new(), None, false);
    for (at, byte) in text.bytes().enumerate() {
        match (byte, quote) {
            _ if escaped => escaped = false,
            (b'\\', _) => escaped = true,
            (_, Some(open)) if byte == open || byte == b'\n' => quote = None,
            (_, Some(_)) => {}
            (b'"' | b'\'', None) => quote = Some(byte),
            _ if closers.is_empty() && stops.contains(&byte) => return at,
            (b'(', None) => closers.push(b')'),
            (b'[', None) => closers.push(b']'),
            (b'{', None) => closers.push(b'}'),
            _ if closers.last() == Some(&byte) => drop(closers.pop()),
            _ => {}
        }
    }
    text.len()
}

/// Splits a text at the separators outside strings and brackets, and trims the pieces.
pub(super) fn split(text: &str, separator: u8) -> impl Iterator<Item = &str> {
    let mut rest = Some(text);
    std::iter::from_fn(move || {
        let text = rest?;
        let end = find(text, &[separator]);
        rest = text.get(end + 1..);
        Some(text[..end].trim())
    })
}

/// Splits a value into words at the white space outside brackets.
pub(super) fn words(text: &str) -> impl Iterator<Item = &str> {
    let mut rest = text.trim();
    std::iter::from_fn(move || {
        let end = find(rest, b" \t\r\n\x0c");
        let word = &rest[..end];
        rest = rest[end..].trim_start();
        (!word.is_empty()).then_some(word)
    })
}

/// Returns the declarations of a block. Anything else in it is ignored, as CSS requires.
pub(super) fn declarations(block: &str) -> impl Iterator<Item = Declaration<'_>> {
    split(block, b';').filter_map(|text| {
        let (name, value) = text.split_once(':')?;
        let (name, value) = (name.trim_end(), value.trim());
        let is_name = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_');
        if name.is_empty() || !name.chars().all(is_name) {
            return None;
        }
        let (value, important) = match value.rsplit_once('!') {
            Some((before, word)) if word.trim().eq_ignore_ascii_case("important") => {
                (before.trim_end(), true)
            }
            _ => (value, false),
        };
        Some(Declaration { name, value, important })
    })
}

/// Returns the rules and at-rules of a style sheet.
pub(super) fn blocks(sheet: &str) -> impl Iterator<Item = Block<'_>> {
    let mut rest = sheet;
    std::iter::from_fn(move || {
        rest = skip(rest);
        if rest.is_empty() {
            return None;
        }
        let stops: &[u8] = if rest.starts_with('@') { b"{;" } else { b"{" };
        let end = find(rest, stops);
        let prelude = rest[..end].trim();
        if rest[end..].starts_with('{') {
            let inside = &rest[end + 1..];
            let close = find(inside, b"}");
            rest = inside.get(close + 1..).unwrap_or("");
            return Some(Block { prelude, body: Some(&inside[..close]) });
        }
        rest = rest.get(end + 1..).unwrap_or("");
        Some(Block { prelude, body: None })
    })
}

/// Skips white space, stray semicolons and braces, and the marks that used to hide style sheets from browsers of the nineties.
fn skip(text: &str) -> &str {
    let mut rest = text.trim_start();
    while let Some(after) = ["<!--", "-->", ";", "}"].into_iter().find_map(|mark| rest.strip_prefix(mark)) {
        rest = after.trim_start();
    }
    rest
}

/// Returns the name, in lower case, and the arguments of a value that is a single function call.
pub(super) fn function(value: &str) -> Option<(String, &str)> {
    let value = value.trim();
    let open = value.find('(')?;
    let (name, inside) = (&value[..open], &value[open + 1..]);
    if name.is_empty() || !name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'-') {
        return None;
    }
    let close = find(inside, b")");
    // CSS implicitly closes whatever is still open at the end.
    (close + 1 >= inside.len()).then(|| (name.to_ascii_lowercase(), inside[..close].trim()))
}

/// Returns the text without its comments. A comment between two names becomes a space.
pub(super) fn without_comments(text: &str) -> Cow<'_, str> {
    if !text.contains("/*") {
        return text.into();
    }
    let (mut kept, mut rest) = (String::with_capacity(text.len()), text);
    while let Some(start) = comment(rest) {
        kept.push_str(&rest[..start]);
        let inside = &rest[start + 2..];
        rest = inside.find("*/").map_or("", |end| &inside[end + 2..]);
        let is_name = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || matches!(c, '-' | '_'));
        if is_name(kept.chars().next_back()) && is_name(rest.chars().next()) {
            kept.push(' ');
        }
    }
    kept.push_str(rest);
    kept.into()
}

/// Returns the index of the first comment outside strings.
fn comment(text: &str) -> Option<usize> {
    let (bytes, mut quote) = (text.as_bytes(), None);
    let mut at = 0;
    while at < bytes.len() {
        match (bytes[at], quote) {
            (b'\\', _) => at += 1,
            (byte, Some(open)) if byte == open || byte == b'\n' => quote = None,
            (byte @ (b'"' | b'\''), None) => quote = Some(byte),
            (b'/', None) if bytes.get(at + 1) == Some(&b'*') => return Some(at),
            _ => {}
        }
        at += 1;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairs(block: &str) -> Vec<(&str, &str, bool)> {
        declarations(block).map(|one| (one.name, one.value, one.important)).collect()
    }

    #[test]
    fn declarations_end_outside_of_strings_and_brackets() {
        let block =
            r#"fill: url("a;b.svg#c"); stroke:rgb(0 0 0 / 100%) ! IMPORTANT;; *width: 3; --a: {x;y}; stroke"#;
        assert_eq!(
            pairs(block),
            [
                ("fill", r#"url("a;b.svg#c")"#, false),
                ("stroke", "rgb(0 0 0 / 100%)", true),
                ("--a", "{x;y}", false),
            ]
        );
        assert_eq!(pairs(r"content: '\';fill:red'; fill: blue").len(), 2);
        assert_eq!(pairs(""), []);
    }

    #[test]
    fn a_sheet_is_rules_and_at_rules() {
        let sheet =
            "<!-- @import 'a.css'; path, .b > c { fill: red } @media print { a { fill: blue } } --> d{";
        let found: Vec<_> = blocks(sheet).map(|block| (block.prelude, block.body)).collect();
        assert_eq!(
            found,
            [
                ("@import 'a.css'", None),
                ("path, .b > c", Some(" fill: red ")),
                ("@media print", Some(" a { fill: blue } ")),
                ("d", Some("")),
            ]
        );
    }

    #[test]
    fn functions_are_whole_values() {
        assert_eq!(function(" RGB(1, var(--a, 2)) "), Some(("rgb".into(), "1, var(--a, 2)")));
        assert_eq!(function("rgb(1"), Some(("rgb".into(), "1")));
        assert_eq!(function("url(#a) red"), None);
        assert_eq!(function("red"), None);
        assert_eq!(split("a, f(b, c), 'd, e'", b',').collect::<Vec<_>>(), ["a", "f(b, c)", "'d, e'"]);
        assert_eq!(words(" url(#a b)  rgb(1 2 3) ").collect::<Vec<_>>(), ["url(#a b)", "rgb(1 2 3)"]);
    }

    #[test]
    fn comments_separate_names_and_stay_in_strings() {
        assert_eq!(without_comments("a/**/b{/* x } */fill:red}/* end"), "a b{fill:red}");
        assert_eq!(without_comments("url('/*')/**/"), "url('/*')");
    }
}

//! Guesses what was meant by an unknown word.

use unicode_normalization::UnicodeNormalization;

/// Returns the word in `known` that is nearest to `word`, or `None` if none is near enough. The distance is
/// the number of edits, and at most half as many edits are allowed as the known word has letters. An edit
/// changes, adds or removes a letter, or swaps two neighbouring letters (optimal string alignment).
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let edits = known.into_iter().map(|known| (strsim::osa_distance(word, known), known));
    let near = edits.filter(|(edits, known)| 2 * edits <= known.chars().count().max(2) && !word.is_empty());
    near.min_by_key(|(edits, _)| *edits).map(|(_, known)| known)
}

/// Rewrites serde's message about an unknown key to suggest the key that was probably meant, instead of
/// listing all keys. Any other message is left unchanged, as is a message about a key that does not resemble
/// any other.
pub(crate) fn without_list(message: &str) -> String {
    let mut quoted = message.strip_prefix("unknown field ").unwrap_or_default().split('`').skip(1).step_by(2);
    let unknown = quoted.next().unwrap_or_default();
    match nearest(unknown, quoted) {
        Some(meant) => format!("unknown field `{unknown}`; did you mean `{meant}`?"),
        None => message.to_owned(),
    }
}

/// Returns a text in Unicode's normalization form C, in which letters with accents are single characters. Programs differ in how
/// they write them: file names and some editors on macOS have "ü" as a "u" with a combining mark.
pub fn composed(text: &str) -> String {
    text.nfc().collect()
}

/// Returns a name as it is compared: in lower case, with single spaces and composed characters.
pub fn folded(name: &str) -> String {
    composed(&name.split_whitespace().collect::<Vec<_>>().join(" ").to_lowercase())
}

/// Returns the index of the known name that was probably meant by an unknown one, or `None`. Names are
/// compared like words in [`nearest`], ignoring case, spaces and how letters are encoded.
pub fn nearest_name(name: &str, known: &[&str]) -> Option<usize> {
    let all: Vec<_> = known.iter().map(|known| folded(known)).collect();
    let meant = nearest(&folded(name), all.iter().map(String::as_str))?;
    all.iter().position(|known| known == meant)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_compared_without_case_and_spaces() {
        assert_eq!(nearest_name("ofice  3", &["Kitchen", "Office 3"]), Some(1));
        assert_eq!(nearest_name("library", &["Kitchen", "Office 3"]), None);
    }

    /// "Büro" typed on macOS is five characters, and did not name the place that a drawing from another machine calls "Büro".
    #[test]
    fn names_are_compared_without_regard_to_how_their_letters_are_encoded() {
        for (composed, combining) in
            [("Büro", "Bu\u{308}ro"), ("ÉTÉ", "E\u{301}te\u{301}"), ("한글", "\u{1112}\u{1161}\u{11ab}글")]
        {
            assert_ne!(composed, combining);
            assert_eq!(folded(composed), folded(combining));
            assert_eq!(super::composed(combining).chars().count(), composed.chars().count());
        }
        assert_eq!(nearest_name("Bu\u{308}ro 12", &["Büro 1"]), Some(0));
    }

    #[test]
    fn a_misspelt_name_gets_a_suggestion() {
        let known = ["particles", "least_particles", "max_speed_mps", "right", "left"];
        for (word, meant) in [
            ("particels", Some("particles")),
            ("max_sped_mps", Some("max_speed_mps")),
            ("max_speed", Some("max_speed_mps")),
            ("rihgt", Some("right")),
            ("sideways", None),
            ("pen", None),
            ("", None),
        ] {
            assert_eq!(nearest(word, known), meant, "{word}");
        }
    }

    #[test]
    fn without_a_similar_key_the_list_is_shown() {
        let of =
            |key: &str| without_list(&format!("unknown field `{key}`, expected one of `beams`, `hit_width`"));
        assert_eq!(of("beam"), "unknown field `beam`; did you mean `beams`?");
        assert_eq!(of("colour"), "unknown field `colour`, expected one of `beams`, `hit_width`");
        let other = "invalid type: boolean `true`, expected usize";
        assert_eq!(without_list(other), other);
    }
}

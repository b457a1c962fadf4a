//! Reads TOML that people write. Errors use the terms of TOML rather than those of Rust.

use serde::de::DeserializeOwned;

/// Rust's names for numbers, as used in serde's messages, and what people call them.
const NUMBERS: [(&[&str], &str); 3] = [
    (&["f32", "f64"], "a number"),
    (&["u8", "u16", "u32", "u64", "usize"], "a whole number, 0 or more"),
    (&["i8", "i16", "i32", "i64", "isize"], "a whole number"),
];

/// The text is not TOML, or has an unknown key or a value of the wrong type. The message shows the line.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct TomlError(String);

impl From<toml::de::Error> for TomlError {
    fn from(error: toml::de::Error) -> Self {
        Self(in_words(&error.to_string()))
    }
}

/// Parses a file.
///
/// # Errors
/// [`TomlError`], which gives the place in the text.
pub fn read<T: DeserializeOwned>(text: &str) -> Result<T, TomlError> {
    Ok(toml::from_str(text)?)
}

/// Rewrites serde's description of an expected value: `a number` instead of `f64`, `a list of 2` instead of `an array of length 2`.
pub fn in_words(message: &str) -> String {
    let lines = message.split('\n').map(|line| match line.rsplit_once(", expected ") {
        Some((found, expected)) if line.starts_with("invalid ") => {
            format!("{found}, expected {}", expectation(expected))
        }
        _ => line.to_owned(),
    });
    lines.collect::<Vec<_>>().join("\n")
}

fn expectation(rust: &str) -> String {
    if let Some((_, words)) = NUMBERS.iter().find(|(types, _)| types.contains(&rust)) {
        return (*words).to_owned();
    }
    let sized =
        ["an array of length ", "a tuple of size "].iter().find_map(|prefix| rust.strip_prefix(prefix));
    match (sized, rust) {
        (Some(length), _) => format!("a list of {length}"),
        (None, "a sequence") => "a list".to_owned(),
        (None, "a map") => "a table".to_owned(),
        (None, _) if rust.starts_with("struct ") => "a table".to_owned(),
        (None, _) => rust.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    fn refusal<T: DeserializeOwned + std::fmt::Debug>(text: &str) -> String {
        read::<BTreeMap<String, T>>(text).unwrap_err().to_string()
    }

    /// Regression test: errors once named Rust's types: "invalid type: string \"x\", expected f64".
    #[test]
    fn errors_call_types_what_people_call_them() {
        let of_text = "a = \"x, expected f64\"\n";
        for (error, words) in [
            (refusal::<f64>(of_text), "expected f64\", expected a number"),
            (refusal::<usize>(of_text), "expected a whole number, 0 or more"),
            (refusal::<i64>(of_text), "expected a whole number"),
            (refusal::<[f64; 2]>("a = [1]\n"), "invalid length 1, expected a list of 2"),
            (refusal::<Vec<f64>>(of_text), "expected a list"),
            (refusal::<BTreeMap<String, f64>>(of_text), "expected a table"),
            (refusal::<bool>(of_text), "expected a boolean"),
        ] {
            assert!(error.contains("line 1") && error.trim_end().ends_with(words), "{error}");
        }
    }
}

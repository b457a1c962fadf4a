//! Custom properties and `var()`. (CSS Custom Properties for Cascading Variables, Level 1.)

use std::collections::BTreeMap;
use std::rc::Rc;

use super::syntax::{find, function};

/// Maximum length of a value after substitution, in bytes, since ten lines of `var()` can expand to a billion words.
const MOST_BYTES: usize = 16 << 10;
/// Maximum depth of properties that refer to each other.
const MOST_DEPTH: usize = 32;

/// Why a value with `var()` cannot be resolved.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Unresolved {
    /// The custom property has no value here, and the reference has no fallback.
    Missing(String),
    /// The custom property refers to itself, or the value grows indefinitely.
    Endless(String),
}

impl Unresolved {
    pub fn words(&self) -> String {
        match self {
            Self::Missing(name) => format!("{name} has no value here and no fallback"),
            Self::Endless(name) => format!("{name} refers to itself, or to too much"),
        }
    }
}

/// The custom properties of an element, inherited ones included.
#[derive(Debug, Clone, Default)]
pub(super) struct Variables(Rc<BTreeMap<String, Result<String, Unresolved>>>);

impl Variables {
    /// Returns the custom properties of a child element with the declarations `own`.
    pub fn with(&self, own: &BTreeMap<&str, &str>) -> Self {
        if own.is_empty() {
            return self.clone();
        }
        let mut element = Element { own, inherited: self, known: BTreeMap::new() };
        let mut all = (*self.0).clone();
        for &name in own.keys() {
            match element.value(name, 0) {
                Some(value) => drop(all.insert(name.to_owned(), value)),
                None => drop(all.remove(name)),
            }
        }
        Self(all.into())
    }

    /// Returns the number of custom properties.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    fn get(&self, name: &str) -> Result<String, Unresolved> {
        self.0.get(name).cloned().unwrap_or_else(|| Err(Unresolved::Missing(name.to_owned())))
    }

    /// Returns a value with each `var()` replaced.
    pub fn resolve(&self, value: &str) -> Result<String, Unresolved> {
        substituted(value, 0, &mut |name| self.get(name))
    }
}

/// The custom properties of one element while they are being computed. Each is computed only once.
struct Element<'a> {
    own: &'a BTreeMap<&'a str, &'a str>,
    inherited: &'a Variables,
    /// The element's own properties computed so far, with `None` for those that are unset.
    known: BTreeMap<String, Option<Result<String, Unresolved>>>,
}

impl Element<'_> {
    /// Returns the value of a property, or `None` if it has none.
    fn value(&mut self, name: &str, depth: usize) -> Option<Result<String, Unresolved>> {
        let Some(&declared) = self.own.get(name) else { return self.inherited.0.get(name).cloned() };
        if let Some(known) = self.known.get(name) {
            return known.clone();
        }
        let endless = || Some(Err(Unresolved::Endless(name.to_owned())));
        if depth > MOST_DEPTH {
            return endless();
        }
        // If this is looked up again before the value is known, the property refers to itself.
        self.known.insert(name.to_owned(), endless());
        let value = match declared.to_ascii_lowercase().as_str() {
            "inherit" | "unset" | "revert" | "revert-layer" => self.inherited.0.get(name).cloned(),
            "initial" => None,
            _ => Some(substituted(declared, 0, &mut |other| {
                self.value(other, depth + 1).unwrap_or_else(|| Err(Unresolved::Missing(other.to_owned())))
            })),
        };
        self.known.insert(name.to_owned(), value.clone());
        value
    }
}

/// Returns true if a value refers to a custom property.
pub(super) fn refers(value: &str) -> bool {
    reference(value).is_some()
}

/// Returns the index of the first `var(`.
fn reference(value: &str) -> Option<usize> {
    let bytes = value.as_bytes();
    bytes.windows(4).enumerate().map(|(at, four)| (at, four.eq_ignore_ascii_case(b"var("))).find_map(
        |(at, is_var)| {
            let is_name = |byte: &u8| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_');
            (is_var && !at.checked_sub(1).is_some_and(|before| is_name(&bytes[before]))).then_some(at)
        },
    )
}

fn substituted(
    value: &str,
    depth: usize,
    look_up: &mut dyn FnMut(&str) -> Result<String, Unresolved>,
) -> Result<String, Unresolved> {
    let endless = |name: &str| Err(Unresolved::Endless(name.to_owned()));
    if depth > MOST_DEPTH || value.len() > MOST_BYTES {
        return endless("the value");
    }
    let (mut text, mut rest) = (String::new(), value);
    while let Some(at) = reference(rest) {
        text.push_str(&rest[..at]);
        let close = (at + 4 + find(&rest[at + 4..], b")") + 1).min(rest.len());
        let (_, arguments) = function(&rest[at..close]).unwrap_or_default();
        let comma = find(arguments, b",");
        let name = arguments[..comma].trim();
        let value = match (look_up(name), arguments.get(comma + 1..)) {
            (Ok(value), _) => value,
            (Err(_), Some(fallback)) => substituted(fallback, depth + 1, look_up)?,
            (Err(why), None) => return Err(why),
        };
        text.push_str(value.trim());
        if text.len() > MOST_BYTES {
            return endless(name);
        }
        rest = &rest[close..];
    }
    text.push_str(rest);
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn variables(own: &[(&'static str, &'static str)]) -> Variables {
        Variables::default().with(&own.iter().copied().collect())
    }

    #[test]
    fn references_are_replaced_by_values_or_fallbacks() {
        let known = variables(&[("--ink", "#111"), ("--wall", "var(--ink)"), ("--empty", "")]);
        for (value, expected) in [
            ("var(--ink)", "#111"),
            ("VAR( --wall , red)", "#111"),
            ("var(--none, #222)", "#222"),
            ("var(--none, var(--wall))", "#111"),
            ("rgb(var(--none, 1, 2, 3))", "rgb(1, 2, 3)"),
            ("var(--empty)", ""),
            ("somevar(--x)", "somevar(--x)"),
        ] {
            assert_eq!(known.resolve(value).as_deref(), Ok(expected), "{value}");
        }
        assert_eq!(known.resolve("var(--none)"), Err(Unresolved::Missing("--none".into())));
    }

    #[test]
    fn an_element_inherits_and_overrides() {
        let outer = variables(&[("--a", "1"), ("--b", "2"), ("--c", "var(--a)")]);
        let inner = outer.with(&BTreeMap::from([("--a", "9"), ("--b", "initial")]));
        // Values computed for the outer element do not change.
        assert_eq!(inner.resolve("var(--a) var(--c)").as_deref(), Ok("9 1"));
        assert!(inner.resolve("var(--b)").is_err());
    }

    #[test]
    fn circles_and_avalanches_end() {
        let circle = variables(&[("--a", "var(--b)"), ("--b", "var(--a)")]);
        assert_eq!(circle.resolve("var(--a, red)").as_deref(), Ok("red"));
        assert!(matches!(circle.resolve("var(--a)"), Err(Unresolved::Endless(_))));
        let names: Vec<_> =
            (0..30).map(|i| (format!("--v{i}"), format!("var(--v{}) ", i + 1).repeat(10))).collect();
        let mut own: BTreeMap<_, _> =
            names.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect();
        own.insert("--v30", "a long word");
        let avalanche = Variables::default().with(&own);
        assert!(matches!(avalanche.resolve("var(--v0)"), Err(Unresolved::Endless(_))));
    }
}

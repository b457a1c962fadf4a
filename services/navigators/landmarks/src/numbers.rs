//! Checks of numbers that people set: each struct of parameters has a `check` of its own, by these.

use crate::error::Error;

/// The greatest number.
const MOST: f64 = 1e6;

/// Numbers with their names.
pub type Named<'a> = &'a [(&'a str, f64)];

/// Something is divided by these, or nothing goes on without them.
///
/// # Errors
/// [`Error::Number`] with the first one that is not above 0, not a number or huge.
pub fn above_0(numbers: Named<'_>) -> Result<(), Error> {
    find(numbers, "a number above 0, at most 1000000", |number| number > 0.0)
}

/// # Errors
/// [`Error::Number`] with the first one that is negative, not a number or huge.
pub fn from_0_on(numbers: Named<'_>) -> Result<(), Error> {
    find(numbers, "a number from 0 on, at most 1000000", |number| number >= 0.0)
}

/// A check of a table within another one: its errors name both.
///
/// # Errors
/// That of the check.
pub fn within(table: &str, checked: Result<(), Error>) -> Result<(), Error> {
    checked.map_err(|error| match error {
        Error::Number { what, expected, found } => {
            Error::Number { what: format!("{table}.{what}"), expected, found }
        }
        other => other,
    })
}

fn find(numbers: Named<'_>, expected: &'static str, holds: fn(f64) -> bool) -> Result<(), Error> {
    match numbers.iter().find(|(_, number)| !(holds(*number) && *number <= MOST)) {
        Some((what, found)) => Err(Error::Number { what: (*what).to_owned(), expected, found: *found }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_is_named_by_its_table() {
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY, 2e6] {
            let error = within("belief", above_0(&[("cone", 1.0), ("way", wrong)])).unwrap_err().to_string();
            assert!(error.starts_with("belief.way: expected a number above 0"), "{error}");
        }
        assert_eq!(from_0_on(&[("a", 0.0), ("b", 1e6)]), Ok(()));
        assert!(from_0_on(&[("a", -0.1)]).is_err());
    }
}

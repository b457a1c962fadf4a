//! Range checks for numbers that people set. The `check` methods of the parameter structs use these.

use crate::error::Error;

/// Maximum value of any number.
const MOST: f64 = 1e6;

/// Numbers and the names of their keys.
pub type Named<'a> = &'a [(&'a str, f64)];

/// Checks that numbers are above 0, because the code divides by them or because the robot would not move otherwise.
///
/// # Errors
/// [`Error::Number`] with the first number that is not above 0, is NaN, or is greater than 1000000.
pub fn above_0(numbers: Named<'_>) -> Result<(), Error> {
    find(numbers, "a number above 0, at most 1000000", |number| number > 0.0)
}

/// Checks that numbers are 0 or above.
///
/// # Errors
/// [`Error::Number`] with the first number that is negative, is NaN, or is greater than 1000000.
pub fn from_0_on(numbers: Named<'_>) -> Result<(), Error> {
    find(numbers, "a number from 0 to 1000000", |number| number >= 0.0)
}

/// Adds the name of the surrounding table to the error of a check.
///
/// # Errors
/// The error of the check, with `table` in front of the name of the number.
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

//! The methods that can be told to drive: ours, and the published ones that it is measured against.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Which set of parameters the localizer and the planner begin with: the key `method` of a mission.
/// The mission's tables `parameters.localizer` and `parameters.planner` change single values of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// This project's own.
    #[default]
    Ours,
    /// Boniardi et al. 2015 (paper 001): two local scales, tracked.
    Paper,
    /// Its special case without tracking: one scale for both directions, as the first scan says it.
    FixedScale,
    /// Its special case of its predecessor (Behzadian et al. 2015): one local scale, tracked.
    OneScale,
}

impl Method {
    /// Every method.
    pub const ALL: [Self; 4] = [Self::Ours, Self::Paper, Self::FixedScale, Self::OneScale];

    /// The word for people and files.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Ours => "ours",
            Self::Paper => "paper",
            Self::FixedScale => "fixed-scale",
            Self::OneScale => "one-scale",
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

impl FromStr for Method {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let known = || Self::ALL.map(Self::word).join(", ");
        let found = Self::ALL.into_iter().find(|method| method.word() == word);
        found.ok_or_else(|| format!("expected one of {}, found {word:?}", known()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_and_command_line_have_the_same_words() {
        for method in Method::ALL {
            assert_eq!(method.word().parse(), Ok(method));
            assert_eq!(toml::Value::try_from(method).unwrap().as_str(), Some(method.word()));
        }
        let error = "theirs".parse::<Method>().unwrap_err();
        assert!(error.contains("ours, paper, fixed-scale, one-scale") && error.contains("theirs"), "{error}");
    }
}

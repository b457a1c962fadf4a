//! The methods of the kind `sketch`: this project's own, and the published ones that they are compared with.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// The set of parameters that the localizer and the planner start from, chosen by the key `navigator.method` of a mission. The
/// mission's tables `parameters.localizer` and `parameters.planner` can override individual values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(try_from = "String", into = "&'static str")]
pub enum Method {
    /// This project's own. On an open floor, it aligns the outline of what the robot has seen with the
    /// outline of the drawing. Once the robot has seen rooms, and along drawn routes, it drives like
    /// [`Self::Beam`].
    #[default]
    Outline,
    /// This project's own. A particle filter that weights beams by the likelihood of their ranges, given what the drawing shows in
    /// their direction.
    Beam,
    /// Boniardi et al. 2015, which tracks two local scales.
    Boniardi2015,
    /// [`Self::Boniardi2015`] without tracking: the first scan fixes a single scale for both directions.
    Boniardi2015FixedScale,
    /// Behzadian et al. 2015, the predecessor of [`Self::Boniardi2015`], which tracks one local scale.
    Behzadian2015,
}

impl Method {
    /// Every method.
    pub const ALL: [Self; 5] =
        [Self::Outline, Self::Beam, Self::Boniardi2015, Self::Boniardi2015FixedScale, Self::Behzadian2015];

    /// Returns true if the method is this project's own, and not a published one.
    pub const fn is_ours(self) -> bool {
        matches!(self, Self::Outline | Self::Beam)
    }

    /// Returns true if the robot can find out where it is in a drawing, so that nobody has to mark the start.
    pub const fn finds_start(self) -> bool {
        matches!(self, Self::Outline)
    }

    /// Returns the method's name as written in mission files and on the command line.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Beam => "beam",
            Self::Outline => "outline",
            Self::Boniardi2015 => "boniardi-2015",
            Self::Boniardi2015FixedScale => "boniardi-2015-fixed-scale",
            Self::Behzadian2015 => "behzadian-2015",
        }
    }
}

impl TryFrom<String> for Method {
    type Error = String;

    fn try_from(word: String) -> Result<Self, String> {
        word.parse()
    }
}

impl From<Method> for &'static str {
    fn from(method: Method) -> Self {
        method.word()
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
        // Former names are refused, and the error lists the current ones.
        for old in ["ours", "paper", "fixed-scale", "one-scale"] {
            let error = old.parse::<Method>().unwrap_err();
            let words = "outline, beam, boniardi-2015, boniardi-2015-fixed-scale, behzadian-2015";
            assert!(error.contains(words) && error.contains(old), "{error}");
        }
    }
}

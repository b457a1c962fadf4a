//! The records of a study, which are JSON files that are written once each.

use std::collections::BTreeMap;
use std::fmt::Display;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::mission::Place;

/// The version of all these files.
pub const VERSION: u32 = 1;
/// Maximum length of a participant's code, in characters.
pub const MAX_CODE: usize = 32;
/// Maximum length of a participant's suggestions, in characters.
pub const MAX_SUGGESTIONS: usize = 2000;
/// Range of valid ages, in years.
const AGES: [u8; 2] = [1, 120];
/// Maximum drawing time, in seconds: a day.
const MAX_S: f64 = 86_400.0;
/// Maximum number of strokes, undone steps or uses of the eraser.
const MAX_COUNT: u32 = 1_000_000;

/// A statement for participants to rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Statement {
    /// Its key in [`Answers`].
    pub key: &'static str,
    /// The wording of the statement. It is ours, and asks about what the text of the paper reports.
    pub text: &'static str,
    /// What Boniardi et al. 2016, V-A, report about it.
    #[serde(skip)]
    pub published: &'static str,
}

/// The statements, in the order of the questions.
pub const STATEMENTS: [Statement; 6] = [
    Statement {
        key: "intuitive",
        text: "Drawing a place is a natural way to describe it to a robot.",
        published: "mean 4.09",
    },
    Statement {
        key: "faithful",
        text: "My drawing shows everything that matters about the place.",
        published: "30 % strongly agree (together with the next)",
    },
    Statement {
        key: "easier",
        text: "Drawing on this page is easier than on paper.",
        published: "30 % strongly agree (together with the previous)",
    },
    Statement {
        key: "sufficient",
        text: "The page offers all that I needed to get the robot to its goal.",
        published: "53 % agree, almost nobody strongly",
    },
    Statement {
        key: "steps",
        text: "It took only a few steps to get the robot going.",
        published: "praised, no figure",
    },
    Statement { key: "editing", text: "Changing the drawing was easy.", published: "praised, no figure" },
];

/// The Likert scale of the paper, as words for 1 to 5.
pub const SCALE: [&str; 5] = ["Strongly disagree", "Disagree", "Neutral", "Agree", "Strongly agree"];

/// An error in a file, or in what a page sends.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RecordError {
    /// Not JSON of the expected form.
    #[error("expected {expected} in JSON: {reason}")]
    Form {
        /// What was expected.
        expected: &'static str,
        /// What is wrong with it, and where.
        reason: String,
    },
    /// An invalid value.
    #[error("{key}: expected {expected}, found {found}")]
    Value {
        /// The key.
        key: String,
        /// What was expected.
        expected: String,
        /// What was found.
        found: String,
    },
}

impl RecordError {
    fn value(key: impl Display, expected: impl Display, found: impl Display) -> Self {
        Self::Value { key: key.to_string(), expected: expected.to_string(), found: found.to_string() }
    }
}

/// A file of a study.
pub trait Record: Serialize + DeserializeOwned {
    /// Its name.
    const FILE: &'static str;
    /// What it is, in words.
    const WHAT: &'static str;

    /// Checks the values.
    ///
    /// # Errors
    /// [`RecordError::Value`].
    fn check(&self) -> Result<(), RecordError>;

    /// Parses the file.
    ///
    /// # Errors
    /// [`RecordError`].
    fn parse(bytes: &[u8]) -> Result<Self, RecordError> {
        let parsed: Result<Self, _> = serde_json::from_slice(bytes);
        let record =
            parsed.map_err(|error| RecordError::Form { expected: Self::WHAT, reason: error.to_string() })?;
        record.check().map(|()| record)
    }

    /// The content of the file.
    fn text(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}

/// The subject of the study, which is the same for all participants.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Facts {
    /// [`VERSION`].
    pub version: u32,
    /// The mission that provides the world, the robot and the start.
    pub mission: String,
    /// The robot's method.
    pub method: String,
    /// The robot's true heading at its start, in degrees counter-clockwise from the world's x axis.
    pub start_heading_deg: f64,
    /// The robot's goal in the true world, or unknown if the mission does not give one.
    #[serde(default, skip_serializing_if = "Place::is_unknown")]
    pub goal: Place,
    /// Whether the page shows the floor from above before participants draw.
    pub shows_floor: bool,
}

impl Record for Facts {
    const FILE: &'static str = "study.json";
    const WHAT: &'static str = "the description of a study";

    fn check(&self) -> Result<(), RecordError> {
        match self.version {
            VERSION => Ok(()),
            found => Err(RecordError::value("version", VERSION, found)),
        }
    }
}

impl Facts {
    /// Which study it is, in words.
    pub fn words(&self) -> String {
        let Self { mission, method, .. } = self;
        format!("the mission {mission:?} by the method {method:?}")
    }
}

/// The orientation of a sheet or a screen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Orientation {
    /// Wider than high.
    Landscape,
    /// Higher than wide.
    Portrait,
}

impl Orientation {
    /// Both orientations, in the order of the paper's groups.
    pub const ALL: [Self; 2] = [Self::Landscape, Self::Portrait];

    /// Its name.
    pub fn word(self) -> &'static str {
        match self {
            Self::Landscape => "landscape",
            Self::Portrait => "portrait",
        }
    }
}

/// A participant at the beginning.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Participant {
    /// The code that represents a person, made of lower-case letters, digits and hyphens. It is also the name
    /// of the folder.
    pub code: String,
    /// Age in years, if the participant gives it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub age: Option<u8>,
    /// The group: the orientation of the sheet.
    pub sheet: Orientation,
}

impl Record for Participant {
    const FILE: &'static str = "participant.json";
    const WHAT: &'static str = "a participant";

    fn check(&self) -> Result<(), RecordError> {
        let known = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        let is_code = (1..=MAX_CODE).contains(&self.code.len())
            && self.code.chars().all(known)
            && !self.code.starts_with('-');
        if !is_code || super::folder::OWN.contains(&self.code.as_str()) {
            let expected = format!("1 to {MAX_CODE} lower-case letters, digits and hyphens, such as p-07");
            return Err(RecordError::value("code", expected, format!("{:?}", self.code)));
        }
        match self.age.filter(|age| !(AGES[0]..=AGES[1]).contains(age)) {
            Some(age) => Err(RecordError::value("age", format!("{} to {}", AGES[0], AGES[1]), age)),
            None => Ok(()),
        }
    }
}

/// The page's measurements while a participant draws.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measures {
    /// Time from the beginning of the map's first stroke to its last change, in seconds.
    pub drawing_s: f64,
    /// The same for the path.
    pub path_s: f64,
    /// Number of strokes, boxes and shapes that were drawn, including those undone later.
    pub strokes: u32,
    /// Number of steps of the map that were undone.
    pub undone: u32,
    /// Number of times that the eraser changed the map.
    pub erased: u32,
    /// Orientation of the screen at the first stroke.
    pub screen: Orientation,
}

impl Measures {
    /// Checks the values.
    ///
    /// # Errors
    /// [`RecordError::Value`].
    pub fn check(&self) -> Result<(), RecordError> {
        for (key, seconds) in [("drawing_s", self.drawing_s), ("path_s", self.path_s)] {
            if !(0.0..=MAX_S).contains(&seconds) {
                return Err(RecordError::value(key, format!("0 to {MAX_S} seconds"), seconds));
            }
        }
        for (key, count) in [("strokes", self.strokes), ("undone", self.undone), ("erased", self.erased)] {
            if count > MAX_COUNT {
                return Err(RecordError::value(key, format!("at most {MAX_COUNT}"), count));
            }
        }
        Ok(())
    }
}

/// A participant's drive, recorded when it begins.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drive {
    /// The drawing's file in the participant's folder.
    pub drawing: String,
    /// The path's file there.
    pub path: String,
    /// The recording. The path is relative to the study's folder if the recording is in it.
    pub recording: String,
    /// The page's measurements.
    pub measures: Measures,
}

impl Record for Drive {
    const FILE: &'static str = "drive.json";
    const WHAT: &'static str = "a drive";

    fn check(&self) -> Result<(), RecordError> {
        self.measures.check()
    }
}

/// A participant's answers.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Answers {
    /// For each of [`STATEMENTS`], by its key, a rating from 1 to 5 on [`SCALE`].
    pub ratings: BTreeMap<String, u8>,
    /// What could be better, in the participant's words.
    #[serde(default)]
    pub suggestions: String,
}

impl Record for Answers {
    const FILE: &'static str = "answers.json";
    const WHAT: &'static str = "a participant's answers";

    fn check(&self) -> Result<(), RecordError> {
        for Statement { key, .. } in STATEMENTS {
            let rating = self.ratings.get(key).copied();
            if !rating.is_some_and(|rating| (1..=SCALE.len()).contains(&usize::from(rating))) {
                let found = rating.map_or_else(|| "none".into(), |rating| rating.to_string());
                return Err(RecordError::value(
                    format!("ratings.{key}"),
                    format!("1 to {}", SCALE.len()),
                    found,
                ));
            }
        }
        if let Some(odd) = self.ratings.keys().find(|key| STATEMENTS.iter().all(|known| known.key != **key)) {
            let known = STATEMENTS.map(|statement| statement.key).join(", ");
            return Err(RecordError::value("ratings", known, format!("{odd:?}")));
        }
        match self.suggestions.chars().count() {
            ..=MAX_SUGGESTIONS => Ok(()),
            found => {
                Err(RecordError::value("suggestions", format!("at most {MAX_SUGGESTIONS} characters"), found))
            }
        }
    }
}

/// How a drive ended, judged from its recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outcome {
    /// Whether the robot reported that it had arrived and, if the goal is known, was in fact there.
    pub success: bool,
    /// The last state reported by the planner.
    pub state: String,
    /// The planner's reason.
    #[serde(default)]
    pub reason: String,
    /// Simulation time of the drive, in seconds.
    pub time_s: f64,
    /// Length of the true path, metres.
    pub path_m: f64,
    /// Distance from the true position at the end to the goal, in metres, if the goal is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub final_error_m: Option<f64>,
    /// Rotation of the drawing relative to the floor, in degrees counter-clockwise: the heading at the start
    /// in the drawing, minus the true one. It includes the error of the direction in which the participant
    /// began the path.
    pub rotation_deg: f64,
}

impl Record for Outcome {
    const FILE: &'static str = "outcome.json";
    const WHAT: &'static str = "the outcome of a drive";

    fn check(&self) -> Result<(), RecordError> {
        match self.rotation_deg {
            -180.0..=180.0 => Ok(()),
            found => Err(RecordError::value("rotation_deg", "-180 to 180", found)),
        }
    }
}

/// Everything that is known about a participant.
#[derive(Debug, Clone, PartialEq)]
pub struct Kept {
    /// Who it is.
    pub participant: Participant,
    /// The drive, once it has begun.
    pub drive: Option<Drive>,
    /// The answers, once they are given.
    pub answers: Option<Answers>,
    /// The outcome, once the drive has been judged.
    pub outcome: Option<Outcome>,
}

#[cfg(test)]
pub(super) mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Measures that took this long.
    pub fn measures(drawing_s: f64) -> Measures {
        let screen = Orientation::Landscape;
        Measures { drawing_s, path_s: 4.5, strokes: 12, undone: 2, erased: 1, screen }
    }

    /// The same answer to every statement.
    pub fn answers(rating: u8, suggestions: &str) -> Answers {
        let ratings = STATEMENTS.iter().map(|statement| (statement.key.to_owned(), rating)).collect();
        Answers { ratings, suggestions: suggestions.into() }
    }

    fn participant(code: &str) -> Participant {
        Participant { code: code.into(), age: None, sheet: Orientation::Portrait }
    }

    #[test]
    fn a_code_is_a_name_of_a_folder_and_nothing_else() {
        for code in ["p-07", "7", "anna"] {
            assert_eq!(participant(code).check(), Ok(()), "{code}");
        }
        for code in ["", "-p", "P7", "a/b", "..", "a b", "ä", "index.html", "recordings", &"x".repeat(33)] {
            let words = participant(code).check().unwrap_err().to_string();
            assert!(words.starts_with("code: expected 1 to 32 lower-case letters"), "{words}");
        }
    }

    #[test]
    fn what_is_wrong_is_named_with_its_key() {
        let error = |text: &str| Answers::parse(text.as_bytes()).unwrap_err().to_string();
        assert!(error("{").starts_with("expected a participant's answers in JSON: EOF"), "{}", error("{"));
        assert!(error(r#"{"ratings":{}}"#).contains("ratings.intuitive: expected 1 to 5, found none"));
        let text = answers(3, "").text().replace("\"editing\": 3", "\"editing\": 6");
        assert_eq!(error(&text), "ratings.editing: expected 1 to 5, found 6");
        let text = answers(3, "").text().replace("\"editing\": 3", "\"editing\": 3, \"odd\": 1");
        assert!(error(&text).ends_with("found \"odd\""));
        assert_eq!(
            answers(1, &"x".repeat(2001)).check().unwrap_err().to_string(),
            "suggestions: expected at most 2000 characters, found 2001"
        );
        for seconds in [-1.0, f64::NAN, 1e6] {
            assert!(
                measures(seconds).check().unwrap_err().to_string().starts_with("drawing_s: expected 0 to")
            );
        }
        let young = Participant { age: Some(0), ..participant("a") };
        assert_eq!(young.check().unwrap_err().to_string(), "age: expected 1 to 120, found 0");
    }

    fn orientation() -> impl Strategy<Value = Orientation> {
        prop::sample::select(Orientation::ALL.to_vec())
    }

    prop_compose! {
        fn any_measures()(
            drawing_s in 0.0..MAX_S, path_s in 0.0..MAX_S, strokes in 0..MAX_COUNT, undone in 0..MAX_COUNT,
            erased in 0..MAX_COUNT, screen in orientation(),
        ) -> Measures {
            Measures { drawing_s, path_s, strokes, undone, erased, screen }
        }
    }

    prop_compose! {
        /// A participant who has finished.
        pub fn any_kept()(
            code in "[a-z0-9][a-z0-9-]{0,20}", age in prop::option::of(AGES[0]..=AGES[1]), sheet in orientation(),
            measures in any_measures(), ratings in prop::collection::vec(1..=5_u8, STATEMENTS.len()),
            suggestions in any::<String>(), success in any::<bool>(), state in ".{0,20}", reason in any::<String>(),
            final_error_m in prop::option::of(0.0..1e3), rotation_deg in -180.0..=180.0,
        ) -> Kept {
            let recording = format!("recordings/{code}.mcap");
            let keys = STATEMENTS.iter().map(|statement| statement.key.to_owned());
            Kept {
                participant: Participant { code, age, sheet },
                drive: Some(Drive { drawing: "drawing-1.json".into(), path: "path-1.json".into(), recording, measures }),
                answers: Some(Answers { ratings: keys.zip(ratings).collect(), suggestions }),
                outcome: Some(Outcome { success, state, reason, time_s: 1.5, path_m: 2.5, final_error_m, rotation_deg }),
            }
        }
    }

    fn is_read_as_written<T: Record + PartialEq + std::fmt::Debug>(record: &T) -> Result<(), TestCaseError> {
        prop_assert_eq!(&T::parse(record.text().as_bytes()).unwrap(), record);
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn whatever_is_kept_is_read_as_it_was_written(kept in any_kept()) {
            is_read_as_written(&kept.drive.unwrap())?;
            is_read_as_written(&kept.answers.unwrap())?;
            is_read_as_written(&kept.outcome.unwrap())?;
        }

        #[test]
        fn no_file_panics(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = (Facts::parse(&bytes), Participant::parse(&bytes), Drive::parse(&bytes));
            let _ = (Answers::parse(&bytes), Outcome::parse(&bytes));
        }
    }
}

//! Rule files, which define how to move for each relation of a pair of markers (Patil 2019, 3.1.3).
//!
//! A file defines named moves and one or more rule sets. A set has a calculus, and exactly one rule for each
//! combination of relations. Sets are consulted in order until one calls for a sideways move. If none does,
//! the move of the last set is used.

use std::collections::BTreeMap;

use serde::Deserialize;
use sketchnav_schemas::message::Twist;
use sketchnav_schemas::toml_text;

use crate::error::RulesError;
use crate::messages::{PairedMarker, Relations, Trend};

/// Published rules for QTC_B.
pub const QTC_B: &str = include_str!("../rules/qtc-b.toml");
/// Published rules for ARGD.
pub const ARGD: &str = include_str!("../rules/argd.toml");
/// Published rules for both calculi, combined.
pub const COMBINED: &str = include_str!("../rules/combined.toml");

/// Names of the distance classes, nearest first.
pub const CLASSES: [&str; 3] = ["near", "medium", "far"];
/// Maximum speed of a move along each axis, in metres per second.
const MOST_MPS: f64 = 2.0;
const SIGNS: [char; 3] = ['-', '0', '+'];

/// The velocity that a rule calls for.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Move {
    /// Forward speed, in metres per second.
    #[serde(default)]
    pub forward_mps: f64,
    /// Speed to the left, in metres per second.
    #[serde(default)]
    pub left_mps: f64,
}

impl Move {
    /// Returns the move as a velocity without rotation.
    pub fn twist(self) -> Twist {
        Twist { vx_mps: self.forward_mps, vy_mps: self.left_mps, yaw_rate_radps: 0.0 }
    }

    fn mean(self, other: Self) -> Self {
        Self {
            forward_mps: f64::midpoint(self.forward_mps, other.forward_mps),
            left_mps: f64::midpoint(self.left_mps, other.left_mps),
        }
    }
}

/// Meaning of the sign + of a QTC relation in a rule set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Plus {
    /// Towards the robot, as in the printed rules (Patil 2019, 3.1.3).
    Towards,
    /// Away from the robot, as in QTC (Van de Weghe 2004) and QSRlib.
    Away,
}

/// The rules of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Rules {
    sets: Vec<Set>,
}

#[derive(Debug, Clone, PartialEq)]
enum Set {
    /// Moves by the signs of the marker and of the robot, one for a marker on the left and one for a marker on the right.
    QtcB { plus: Plus, answers: [[Move; 2]; 9] },
    /// Moves by the distance classes of the left and the right marker.
    Argd { answers: [Move; 9] },
}

/// A rule file as written by a person, before it is checked.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    moves: BTreeMap<String, Move>,
    set: Vec<WrittenSet>,
}

#[derive(Debug, Deserialize)]
#[serde(tag = "calculus", rename_all = "kebab-case", deny_unknown_fields)]
enum WrittenSet {
    QtcB { plus: Plus, rule: Vec<QtcRule> },
    Argd { rule: Vec<ArgdRule> },
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct QtcRule {
    relation: String,
    left: String,
    right: String,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ArgdRule {
    left: String,
    right: String,
    r#move: String,
}

impl Rules {
    /// Reads a rule file.
    ///
    /// # Errors
    /// [`RulesError`], which names the set, the rule and what was expected.
    pub fn parse(text: &str) -> Result<Self, RulesError> {
        let File { moves, set } = toml_text::read(text)?;
        for (name, Move { forward_mps, left_mps }) in &moves {
            for found_mps in [*forward_mps, *left_mps] {
                let holds = found_mps.abs() <= MOST_MPS;
                let wrong = || RulesError::Speed { name: name.clone(), most_mps: MOST_MPS, found_mps };
                holds.then_some(()).ok_or_else(wrong)?;
            }
        }
        if set.is_empty() {
            return Err(RulesError::Empty);
        }
        let sets = set.iter().enumerate().map(|(i, set)| Reader { set: i + 1, moves: &moves }.read(set));
        Ok(Self { sets: sets.collect::<Result<_, _>>()? })
    }

    /// Returns the number of rule sets.
    pub fn len(&self) -> usize {
        self.sets.len()
    }

    /// Always returns false, since a file without a rule set is rejected.
    pub fn is_empty(&self) -> bool {
        self.sets.is_empty()
    }

    /// Returns the move for the relations of a pair, or `None` if they are not known yet.
    pub fn answer(&self, relations: &Relations) -> Option<Move> {
        let mut answer = None;
        for set in &self.sets {
            let next = set.answer(&relations.left, &relations.right);
            answer = next.or(answer);
            if answer.is_some_and(|answer| answer.left_mps != 0.0) {
                break;
            }
        }
        answer
    }
}

impl Set {
    /// Returns the move for a pair, or `None` if its relations are not yet known. With QTC_B, the relation of each marker requires
    /// a separate move, one after the other (Patil 2019, 3.2.4). Since both moves apply for the same time, the result is their
    /// mean.
    fn answer(&self, left: &PairedMarker, right: &PairedMarker) -> Option<Move> {
        match self {
            Self::QtcB { plus, answers } => {
                let by = |marker: &PairedMarker, side: usize| {
                    let index =
                        qtc_index(plus.sign(marker.marker_trend())?, plus.sign(marker.robot_trend())?);
                    Some(answers[index][side])
                };
                Some(by(left, 0)?.mean(by(right, 1)?))
            }
            Self::Argd { answers } => {
                let class = |marker: &PairedMarker| {
                    Some(marker.distance_class as usize).filter(|class| *class < CLASSES.len())
                };
                Some(answers[class(left)? * CLASSES.len() + class(right)?])
            }
        }
    }
}

impl Plus {
    /// Returns the index in [`SIGNS`] of a trend's sign, or `None` if the trend is unknown.
    fn sign(self, trend: Trend) -> Option<usize> {
        match (trend, self) {
            (Trend::Unknown, _) => None,
            (Trend::Stable, _) => Some(1),
            (Trend::Towards, Self::Away) | (Trend::Away, Self::Towards) => Some(0),
            (Trend::Away, Self::Away) | (Trend::Towards, Self::Towards) => Some(2),
        }
    }
}

fn qtc_index(marker: usize, robot: usize) -> usize {
    marker * SIGNS.len() + robot
}

/// Reads a rule set and checks that it covers every combination.
struct Reader<'a> {
    /// Number of the set, from 1.
    set: usize,
    moves: &'a BTreeMap<String, Move>,
}

impl Reader<'_> {
    fn read(&self, set: &WrittenSet) -> Result<Set, RulesError> {
        match set {
            WrittenSet::QtcB { plus, rule } => self.qtc(*plus, rule),
            WrittenSet::Argd { rule } => self.argd(rule),
        }
    }

    fn qtc(&self, plus: Plus, rules: &[QtcRule]) -> Result<Set, RulesError> {
        let mut answers = [None; 9];
        for (i, QtcRule { relation, left, right }) in rules.iter().enumerate() {
            let row = Row { reader: self, rule: i + 1 };
            let index = qtc_relation(relation).ok_or_else(|| {
                row.wrong("relation", "two of the signs -, 0 and +, such as \"-,0\"".into(), relation)
            })?;
            row.put(
                &mut answers[index],
                "relation",
                relation,
                [row.r#move("left", left)?, row.r#move("right", right)?],
            )?;
        }
        let name = |index: usize| format!("relation \"{},{}\"", SIGNS[index / 3], SIGNS[index % 3]);
        Ok(Set::QtcB { plus, answers: self.whole(answers, "qtc-b", name)? })
    }

    fn argd(&self, rules: &[ArgdRule]) -> Result<Set, RulesError> {
        let mut answers = [None; 9];
        for (i, ArgdRule { left, right, r#move }) in rules.iter().enumerate() {
            let row = Row { reader: self, rule: i + 1 };
            let index = row.class("left", left)? * CLASSES.len() + row.class("right", right)?;
            let pair = format!("{left}, {right}");
            row.put(&mut answers[index], "left, right", &pair, row.r#move("move", r#move)?)?;
        }
        let name =
            |index: usize| format!("left \"{}\", right \"{}\"", CLASSES[index / 3], CLASSES[index % 3]);
        Ok(Set::Argd { answers: self.whole(answers, "argd", name)? })
    }

    /// Returns all moves, or an error if one is missing.
    fn whole<T: Copy + Default>(
        &self,
        answers: [Option<T>; 9],
        calculus: &'static str,
        name: impl Fn(usize) -> String,
    ) -> Result<[T; 9], RulesError> {
        match answers.iter().position(Option::is_none) {
            Some(hole) => Err(RulesError::Hole { set: self.set, calculus, missing: name(hole) }),
            None => Ok(answers.map(Option::unwrap_or_default)),
        }
    }
}

/// A rule of a set, and its number from 1.
struct Row<'a> {
    reader: &'a Reader<'a>,
    rule: usize,
}

impl Row<'_> {
    fn wrong(&self, key: &'static str, expected: String, found: &str) -> RulesError {
        RulesError::Row { set: self.reader.set, rule: self.rule, key, expected, found: found.to_owned() }
    }

    fn r#move(&self, key: &'static str, name: &str) -> Result<Move, RulesError> {
        let known = || format!("one of {}", self.reader.moves.keys().cloned().collect::<Vec<_>>().join(", "));
        self.reader.moves.get(name).copied().ok_or_else(|| self.wrong(key, known(), name))
    }

    fn class(&self, key: &'static str, name: &str) -> Result<usize, RulesError> {
        let place = CLASSES.iter().position(|class| *class == name);
        place.ok_or_else(|| self.wrong(key, format!("one of {}", CLASSES.join(", ")), name))
    }

    fn put<T>(
        &self,
        slot: &mut Option<T>,
        key: &'static str,
        found: &str,
        answer: T,
    ) -> Result<(), RulesError> {
        match slot.replace(answer) {
            Some(_) => Err(self.wrong(key, "a combination that no other rule answers".into(), found)),
            None => Ok(()),
        }
    }
}

fn qtc_relation(text: &str) -> Option<usize> {
    let sign = |text: &str| {
        let text = text.trim();
        SIGNS.iter().position(|sign| text.len() == 1 && text.starts_with(*sign))
    };
    let (marker, robot) = text.split_once(',')?;
    Some(qtc_index(sign(marker)?, sign(robot)?))
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::*;

    fn pair(left: (Trend, u32), right: (Trend, u32)) -> Relations {
        let marker = |(trend, distance_class): (Trend, u32)| PairedMarker {
            marker_trend: trend.code(),
            robot_trend: Trend::Stable.code(),
            distance_class,
            ..Zeroable::zeroed()
        };
        Relations { left: marker(left), right: marker(right), ..Zeroable::zeroed() }
    }

    fn sideways(rules: &Rules, left: (Trend, u32), right: (Trend, u32)) -> f64 {
        rules.answer(&pair(left, right)).unwrap().left_mps
    }

    /// Checks the printed rules (Patil 2019, 3.1.3) line by line, as far as the robot is at rest in its own frame.
    #[test]
    fn the_printed_rules_for_qtc_b_turn_away_from_approaching_markers() {
        let rules = Rules::parse(QTC_B).unwrap();
        let (near, away, still) = ((Trend::Towards, 0), (Trend::Away, 0), (Trend::Stable, 0));
        assert!(sideways(&rules, near, still) < 0.0, "the left one comes nearer: to the right");
        assert!(sideways(&rules, still, near) > 0.0);
        assert_eq!([sideways(&rules, near, near), sideways(&rules, away, away)], [0.0; 2]);
        assert_eq!(rules.answer(&pair((Trend::Unknown, 0), near)), None);
    }

    /// In QTC, + means away. With this meaning, the printed rules turn away from the marker that recedes, and thus into the other
    /// wall.
    #[test]
    fn with_the_sign_of_qtc_the_printed_rules_steer_into_the_wall() {
        let rules = Rules::parse(&QTC_B.replace("plus = \"towards\"", "plus = \"away\"")).unwrap();
        let (near, away, still) = ((Trend::Towards, 0), (Trend::Away, 0), (Trend::Stable, 0));
        assert_eq!(sideways(&rules, near, still), 0.0);
        assert!(sideways(&rules, away, still) < 0.0, "away from the left wall, which is left already");
    }

    #[test]
    fn the_printed_rules_for_argd_turn_to_the_farther_side() {
        let rules = Rules::parse(ARGD).unwrap();
        let at = |class| (Trend::Unknown, class);
        let of = |left, right| sideways(&rules, at(left), at(right));
        assert_eq!([of(0, 0), of(1, 1), of(2, 2)], [0.0; 3]);
        assert_eq!([of(0, 1), of(0, 2), of(1, 2)], [-0.02, -0.05, -0.02]);
        assert_eq!([of(1, 0), of(2, 0), of(2, 1)], [0.02, 0.05, 0.02]);
    }

    #[test]
    fn the_first_rule_set_that_moves_sideways_is_followed() {
        let rules = Rules::parse(COMBINED).unwrap();
        assert_eq!(rules.len(), 2);
        assert_eq!(sideways(&rules, (Trend::Stable, 0), (Trend::Towards, 1)), -0.02, "by distance");
        assert_eq!(sideways(&rules, (Trend::Stable, 1), (Trend::Towards, 1)), 0.025, "by trajectory");
    }

    /// The combined file repeats the other two files.
    #[test]
    fn the_combined_rules_contain_both_sets() {
        let [both, distances, trajectories] = [COMBINED, ARGD, QTC_B].map(|text| Rules::parse(text).unwrap());
        assert_eq!(both.sets, [distances.sets, trajectories.sets].concat());
    }

    #[test]
    fn errors_name_the_set_the_rule_and_what_was_expected() {
        let row = "    { relation = \"+,-\", left = \"right\", right = \"left\" },\n";
        for (from, to, words) in [
            (row, "", "set 1 (qtc-b): expected a rule for relation \"+,-\", found none"),
            (
                row,
                "    { relation = \"+,*\", left = \"right\", right = \"left\" },\n",
                "set 1, rule 9: relation: expected two of the signs -, 0 and +",
            ),
            (
                row,
                "    { relation = \"+,+\", left = \"right\", right = \"left\" },\n",
                "set 1, rule 9: relation: expected a combination that no other rule answers, found \"+,+\"",
            ),
            (
                row,
                "    { relation = \"+,-\", left = \"up\", right = \"left\" },\n",
                "set 1, rule 9: left: expected one of forward, left, right, found \"up\"",
            ),
            (
                "left_mps = 0.05",
                "left_mps = 50",
                "moves.left: expected at most 2 m/s in each direction, found 50",
            ),
            (
                "left_mps = 0.05",
                "left_mps = nan",
                "moves.left: expected at most 2 m/s in each direction, found NaN",
            ),
            ("plus = \"towards\"", "plus = \"up\"", "unknown variant `up`"),
            ("calculus = \"qtc-b\"", "calculus = \"rcc8\"", "unknown variant `rcc8`"),
        ] {
            let text = QTC_B.replacen(from, to, 1);
            assert_ne!(text, QTC_B, "{from}");
            let error = Rules::parse(&text).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
        let error = Rules::parse(&ARGD.replacen("left = \"near\"", "left = \"close\"", 1)).unwrap_err();
        assert!(
            error
                .to_string()
                .contains("set 1, rule 1: left: expected one of near, medium, far, found \"close\""),
            "{error}"
        );
    }

    mod any {
        use proptest::prelude::*;
        use proptest::test_runner::RngSeed;

        use super::*;

        proptest! {
            #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() })]

            #[test]
            fn no_text_makes_it_panic(text in ".*") {
                let _ = Rules::parse(&text);
            }

            /// If any one character of the file is replaced, the file is either rejected or still answers every pair of known
            /// relations.
            #[test]
            fn parsed_rules_cover_every_relation(at in 0..QTC_B.len(), by in any::<char>(), left in 0..3_u32, right in 0..3_u32) {
                let mut text: Vec<char> = QTC_B.chars().collect();
                let at = at.min(text.len() - 1);
                text[at] = by;
                if let Ok(rules) = Rules::parse(&text.into_iter().collect::<String>()) {
                    let trend = |code| (Trend::from_code(code + 1).unwrap(), 0);
                    prop_assert!(rules.answer(&pair(trend(left), trend(right))).is_some());
                }
            }
        }
    }
}

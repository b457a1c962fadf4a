//! Forms of markers. They determine how a figure is written, and which part of a whole experiment or of a study's table is shown.

use std::fmt::Write as _;

use super::{Method, Wrong, one_of};
use crate::experiments::outcome::Kind;
use crate::experiments::statistics::Tally;
use crate::experiments::studies::{Table, report};

/// Words for the variants of [`Whole`], for error messages.
pub const WHOLE_FORMS: &str = "lines, verdicts, notices or groups";
/// Words for the variants of [`Form`], for error messages.
pub const FORMS: &str = "share, percent, of or rated, each also with -on-sketch or -by-place, reached, attempts, known, majority, displacement, touched, or how tasks ended";

/// The part of a whole experiment that is shown.
#[derive(Clone, Copy)]
pub enum Whole {
    /// A row for each line of the experiment's table and a column for each method.
    Lines,
    /// The conditions of Patil 2019.
    Verdicts,
    /// Notices that readers need to know.
    Notices,
    /// A row for each group of the experiment's lines and two columns for each method, by the true pose and on the sketch.
    Groups,
}

impl Whole {
    pub fn read(word: &str) -> Option<Self> {
        Some(match word {
            "lines" => Self::Lines,
            "verdicts" => Self::Verdicts,
            "notices" => Self::Notices,
            "groups" => Self::Groups,
            _ => return None,
        })
    }
}

/// The part of a study's table that is shown.
pub enum Shown {
    /// The whole table.
    Whole,
    /// One cell, given by its column and row, in percent or not. If the table has an interval and a count for it, these are shown,
    /// too.
    Cell { column: String, row: String, is_percent: bool },
}

impl Shown {
    pub fn read(form: &str, words: &str) -> Result<Self, Wrong> {
        let cell = |is_percent| match words.split_once(": ") {
            Some((column, row)) => Ok(Self::Cell { column: column.into(), row: row.into(), is_percent }),
            None => Err(("COLUMN: ROW".to_owned(), words.to_owned())),
        };
        match form {
            "table" if words.is_empty() => Ok(Self::Whole),
            "percent" => cell(true),
            "number" => cell(false),
            _ => Err(one_of("table, percent, number", form)),
        }
    }

    pub fn of(&self, table: &Table) -> Result<String, Wrong> {
        let Self::Cell { column, row, is_percent } = self else {
            return Ok(format!("\n\n{}", report::words(table).markdown()));
        };
        let head = &table.head[1..];
        let at = head.iter().position(|known| known == column);
        let at = at.ok_or_else(|| one_of(&head.join("; "), column))?;
        let names = || table.rows.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join("; ");
        let found = table.rows.iter().find(|(name, _)| name == row);
        let (_, values) = found.ok_or_else(|| one_of(&names(), row))?;
        let (unit, digits): (_, fn(f64) -> String) = match is_percent {
            true => (" %", |value| format!("{value:.1}")),
            false => ("", report::number),
        };
        let is = |place: usize, name: &str| head.get(place).is_some_and(|known| known == name);
        let mut text = format!("{}{unit}", digits(values[at]));
        if is(at + 1, "low") && is(at + 2, "high") {
            let _ = write!(text, " ({} to {})", digits(values[at + 1]), digits(values[at + 2]));
            let count = head.iter().rposition(|name| COUNTS.contains(&name.as_str()));
            text.extend(count.map(|count| format!(" of {}", values[count])));
        }
        Ok(text)
    }
}

/// Columns that contain the number of cases on which a share or a mean is based.
const COUNTS: [&str; 2] = ["worlds", "journeys"];

/// How a figure is written, and by which criterion a task counts as reached.
#[derive(Clone, Copy)]
pub struct Form {
    style: Style,
    judgement: Judgement,
}

/// Criterion by which a task counts as reached.
#[derive(Clone, Copy, PartialEq)]
enum Judgement {
    /// By the true final position and the true path.
    Truth,
    /// By the robot's own pose in the drawing.
    Sketch,
    /// By the true final position, regardless of the path.
    Place,
}

#[derive(Clone, Copy)]
enum Style {
    /// `97.5 % (95 to 99) of 320`, or `97.5 % (92 to 100 over 10 drawings) of 320` if drawings repeat.
    Share,
    /// `97.5 %`.
    Percent,
    /// `54 of 55`.
    Of,
    /// `54 of 55 (98 %; 90 to 100)`, with the same interval as [`Self::Share`].
    Rated,
    /// `55`.
    Attempts,
    /// `80.9 %`, the share of failures that the robot is aware of.
    Known,
    /// `9 of 12`, the number of lines on which most tasks were reached.
    Majority,
    /// `0.21 m`, the mean distance from the drawn route.
    Displacement,
    /// `3 of 55`, the number of tasks in which the robot touched something.
    Touched,
    /// The number of tasks with this outcome.
    Count(Kind),
}

impl Form {
    /// `97.5 % (95 to 99) of 320`.
    pub const SHARE: Self = Self { style: Style::Share, judgement: Judgement::Truth };
    /// `54 of 55 (98 %; 90 to 100)`.
    pub const RATED: Self = Self { style: Style::Rated, judgement: Judgement::Truth };
    /// `54 of 55 (98 %; 90 to 100)`, judged on the sketch.
    pub const RATED_ON_SKETCH: Self = Self { style: Style::Rated, judgement: Judgement::Sketch };

    pub fn read(word: &str) -> Option<Self> {
        let (word, judgement) = match (word.strip_suffix("-on-sketch"), word.strip_suffix("-by-place")) {
            (Some(word), _) => (word, Judgement::Sketch),
            (_, Some(word)) => (word, Judgement::Place),
            _ => (word, Judgement::Truth),
        };
        let style = match word {
            "share" => Style::Share,
            "percent" => Style::Percent,
            "of" => Style::Of,
            "rated" => Style::Rated,
            // The other figures do not depend on which tasks were reached, so they have no judgement.
            _ if judgement != Judgement::Truth => return None,
            "attempts" => Style::Attempts,
            "known" => Style::Known,
            "majority" => Style::Majority,
            "displacement" => Style::Displacement,
            "touched" => Style::Touched,
            _ => Style::Count(Kind::ALL.into_iter().find(|kind| kind.word().replace(' ', "-") == word)?),
        };
        Some(Self { style, judgement })
    }

    /// Returns the figure over all tasks driven by a method, or `None` if it is not stored.
    pub fn of_method(self, method: &Method) -> Option<String> {
        match self.style {
            Style::Majority => {
                let passed = method.lines.values().filter(|tally| tally.is_mostly_reached()).count();
                Some(format!("{passed} of {}", method.lines.len()))
            }
            _ => self.of(method.total),
        }
    }

    /// Returns the figure, or `None` if it is not stored.
    pub fn of(self, tally: Tally) -> Option<String> {
        let tally = match self.judgement {
            Judgement::Truth => tally,
            Judgement::Sketch => tally.judged(tally.on_sketch?),
            Judgement::Place => tally.judged(tally.by_place?),
        };
        let Tally { reached, attempts, .. } = tally;
        Some(match self.style {
            Style::Share => format!("{} ({}) of {attempts}", percent(tally.rate()), tally.interval_words()),
            Style::Percent => percent(tally.rate()),
            Style::Of => format!("{reached} of {attempts}"),
            Style::Rated => {
                let rate = tally.rate().map_or("–".to_owned(), |rate| format!("{:.0}", 100.0 * rate));
                format!("{reached} of {attempts} ({rate} %; {})", tally.interval_words())
            }
            Style::Attempts => attempts.to_string(),
            Style::Known => percent(tally.share_that_knows()),
            Style::Majority => format!("{} of 1", u8::from(tally.is_mostly_reached())),
            Style::Displacement if reached == 0 => "–".to_owned(),
            Style::Displacement => format!("{:.2} m", tally.displacement_m?),
            Style::Touched => format!("{} of {attempts}", tally.with_collision),
            Style::Count(kind) => tally.count(kind).to_string(),
        })
    }
}

/// Formats a rate like `97.5 %`, but `100 %` and `0 %` without decimals.
fn percent(rate: Option<f64>) -> String {
    match rate {
        None => "–".to_owned(),
        Some(rate) if rate == 0.0 || rate == 1.0 => format!("{:.0} %", 100.0 * rate),
        Some(rate) => format!("{:.1} %", 100.0 * rate),
    }
}

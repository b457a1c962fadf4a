//! Orders from ROS 2. An order is a word, followed by the number of a task or, if the word is `goal`, by a
//! name.
//!
//! Any node in the domain may send orders, so their rate is limited, and invalid ones are reported on standard error.

use std::time::Duration;

use sketchnav_runtime::Ordered;
use sketchnav_schemas::codes::Order;

/// Maximum number of orders per second. A person gives fewer.
const MAX_A_SECOND: u32 = 10;
/// Maximum number of characters of a text that are printed.
const MAX_SHOWN: usize = 40;
/// Finds the task or place that a name refers to, or returns the reason why there is none.
pub type FindGoal<'a> = dyn Fn(&str) -> Result<Ordered, String> + 'a;

/// Maximum length of a text that is looked at, in bytes. Names in missions are shorter.
const MAX_BYTES: usize = 256;

/// Why an order was rejected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum OrderError {
    /// The word is unknown.
    #[error("{found:?}: expected {}", words())]
    Word {
        /// The text.
        found: String,
    },
    /// No task of the mission has this number, or a word other than `goal` is followed by a name.
    #[error("{found:?}: expected a task from 1 to {count}")]
    Task {
        /// The text.
        found: String,
        /// Number of tasks in the mission.
        count: u32,
    },
    /// The name refers to nothing, or to several things.
    #[error("{0}")]
    Name(String),
    /// Too many orders in a second.
    #[error("expected at most {MAX_A_SECOND} orders a second, the others are dropped")]
    Flood,
}

fn words() -> String {
    let words: Vec<_> = Order::ALL.iter().filter(|order| is_word(order)).map(|order| order.word()).collect();
    format!("one of {}, followed by a task if it needs one", words.join(", "))
}

/// Returns true if an order consists of words only. `here` does not, because it needs a position in the sketch.
fn is_word(order: &Order) -> bool {
    *order != Order::Here
}

/// Parses an order such as `pause`, `goal 3` or `goal kitchen`. Tasks are counted from 1 in the text, up to `task_count`, and
/// `find` looks up names.
///
/// # Errors
/// [`OrderError`] with what was found.
pub fn parse(text: &str, task_count: usize, find: &FindGoal<'_>) -> Result<Ordered, OrderError> {
    let found = || text.chars().take(MAX_SHOWN).collect::<String>();
    let trimmed = text.trim();
    let (word, rest) = trimmed.split_once(char::is_whitespace).unwrap_or((trimmed, ""));
    let order = word.parse().ok().filter(is_word).filter(|_| text.len() <= MAX_BYTES);
    let order = order.ok_or_else(|| OrderError::Word { found: found() })?;
    let (rest, count) = (rest.trim(), task_count.max(1) as u32);
    let task = if rest.is_empty() { Some(1) } else { rest.parse().ok() };
    match task {
        Some(task) if (1..=count).contains(&task) => Ok(Ordered::new(order, task - 1)),
        None if order == Order::Goal && rest.parse::<f64>().is_err() => find(rest).map_err(OrderError::Name),
        _ => Err(OrderError::Task { found: found(), count }),
    }
}

/// Limits the number of orders per second.
#[derive(Debug, Default)]
pub struct Allowance {
    second: u64,
    taken: u32,
}

impl Allowance {
    /// Records an order that arrived at `now`. Returns true if it may be executed.
    ///
    /// # Errors
    /// [`OrderError::Flood`] for the first order above the limit in a second. Later orders in the same second yield
    /// `Ok(false)`, so that the flood is reported only once.
    pub fn take(&mut self, now: Duration) -> Result<bool, OrderError> {
        if self.second != now.as_secs() {
            (self.second, self.taken) = (now.as_secs(), 0);
        }
        self.taken = self.taken.saturating_add(1);
        match self.taken {
            ..=MAX_A_SECOND => Ok(true),
            taken if taken == MAX_A_SECOND + 1 => Err(OrderError::Flood),
            _ => Ok(false),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KITCHEN: Ordered = Ordered::new(Order::Goal, 3);

    /// Parses an order for a mission with nine tasks. The kitchen is the goal of the fourth one.
    fn parse(text: &str) -> Result<Ordered, OrderError> {
        super::parse(text, 9, &|name| match name {
            "kitchen" => Ok(KITCHEN),
            _ => Err("did you mean kitchen?".to_owned()),
        })
    }

    #[test]
    fn an_order_is_a_word_and_optionally_a_task() {
        assert_eq!(parse("pause"), Ok(Ordered::new(Order::Pause, 0)));
        assert_eq!(parse(" start  3 "), Ok(Ordered::new(Order::Start, 2)));
        assert_eq!(parse("goal 9"), Ok(Ordered::new(Order::Goal, 8)));
        assert_eq!(parse("abort"), Ok(Ordered::new(Order::Abort, 0)));
    }

    /// Regression test: `sketchnav send goal kitchen` used to work, and the same order from ROS 2 did not.
    #[test]
    fn a_goal_may_be_a_name() {
        assert_eq!(parse("goal  kitchen "), Ok(KITCHEN));
        let error = parse("goal kichen").unwrap_err().to_string();
        assert_eq!(error, "did you mean kitchen?");
    }

    #[test]
    fn the_error_for_an_invalid_order_lists_the_valid_ones() {
        for wrong in ["", "go", "START", "\0", "öffne", "here"] {
            let error = parse(wrong).unwrap_err().to_string();
            assert!(error.contains("expected one of start, abort, pause"), "{wrong:?}: {error}");
        }
        for wrong in ["start 0", "start 10", "goal -1", "goal 10", "start x", "start 1 2"] {
            let error = parse(wrong).unwrap_err().to_string();
            assert!(error.contains("expected a task from 1 to 9"), "{wrong:?}: {error}");
        }
    }

    /// Regression test: a text of a megabyte was once printed in full.
    #[test]
    fn a_long_text_is_abbreviated() {
        for text in ["ü".repeat(1 << 20), format!("goal {}", "ü".repeat(1 << 20))] {
            let error = parse(&text).unwrap_err().to_string();
            assert!(error.len() < 250, "{}", error.len());
        }
    }

    #[test]
    fn a_flood_is_reported_once_per_second() {
        let mut allowance = Allowance::default();
        let mut at =
            |second| (0..30).map(|_| allowance.take(Duration::from_secs(second))).collect::<Vec<_>>();
        for second in [0, 5] {
            let results = at(second);
            assert_eq!(results.iter().filter(|results| **results == Ok(true)).count(), 10);
            assert_eq!(results.iter().filter(|results| results.is_err()).count(), 1);
        }
    }
}

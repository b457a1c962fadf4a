//! Orders from ROS 2. An order is a word, followed by the number of a task or, if the word is `goal`, by a
//! name.
//!
//! Any node in the domain may send orders, so their rate is limited, and invalid ones are reported on standard error.

use std::time::Duration;

use sketchnav_schemas::codes::Order;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::named::{self, NameError};

/// Maximum number of orders per second. A person gives fewer.
const MAX_A_SECOND: u32 = 10;
/// Maximum number of characters of a text that are printed.
const MAX_SHOWN: usize = 40;
/// Maximum length of a text that is looked at, in bytes. Names in missions are shorter.
const MAX_BYTES: usize = 256;

/// The reason why an order was rejected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum OrderError {
    /// The word is unknown.
    #[error("{found:?}: expected {}", words())]
    Word {
        /// The text.
        found: String,
    },
    /// The number is not that of a task of the mission, or a word other than `goal` is followed by a name.
    #[error("{found:?}: expected a task from 1 to {count}")]
    Task {
        /// The text.
        found: String,
        /// Number of tasks in the mission.
        count: u32,
    },
    /// The name means no task.
    #[error(transparent)]
    Name(#[from] NameError),
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

/// Parses an order such as `pause`, `goal 3` or `goal kitchen`. Returns the order and the index of its task,
/// from 0, whereas tasks are counted from 1 in the text. A name refers to the task of that name or, if there
/// is none, to the place that is its goal.
///
/// # Errors
/// [`OrderError`] with what was found.
pub fn parse(text: &str, mission: &Mission) -> Result<(Order, u32), OrderError> {
    let found = || text.chars().take(MAX_SHOWN).collect::<String>();
    let trimmed = text.trim();
    let (word, rest) = trimmed.split_once(char::is_whitespace).unwrap_or((trimmed, ""));
    let order = word.parse().ok().filter(is_word).filter(|_| text.len() <= MAX_BYTES);
    let order = order.ok_or_else(|| OrderError::Word { found: found() })?;
    let (rest, count) = (rest.trim(), mission.task.len().max(1) as u32);
    let task = if rest.is_empty() { Some(1) } else { rest.parse().ok() };
    match task {
        Some(task) if (1..=count).contains(&task) => Ok((order, task - 1)),
        None if order == Order::Goal && rest.parse::<f64>().is_err() => {
            Ok((order, named::task(mission, rest)? as u32))
        }
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

    /// Returns a mission with nine tasks, `place 1` to `place 9`. The goal of the fourth one is the kitchen.
    fn mission() -> Mission {
        let mut text =
            "name = 'm'\nrobot = 'robotino'\nworld = { map = 'm.yaml' }\nnavigator = { kind = 'sketch' }\n\
             start = { world = [0, 0], world_heading_deg = 0 }\n"
                .to_owned();
        for task in 1..=9 {
            let goal = if task == 4 { "'Kitchen'" } else { "[1, 2]" };
            text += &format!("[[task]]\nname = 'place {task}'\ngoal = {goal}\n");
        }
        Mission::parse(&text).unwrap()
    }

    fn parse(text: &str) -> Result<(Order, u32), OrderError> {
        super::parse(text, &mission())
    }

    #[test]
    fn an_order_is_a_word_and_optionally_a_task() {
        assert_eq!(parse("pause"), Ok((Order::Pause, 0)));
        assert_eq!(parse(" start  3 "), Ok((Order::Start, 2)));
        assert_eq!(parse("goal 9"), Ok((Order::Goal, 8)));
        assert_eq!(parse("abort"), Ok((Order::Abort, 0)));
    }

    /// `sketchnav send goal kitchen` used to work, and the same order from ROS 2 did not.
    #[test]
    fn a_goal_may_be_a_name() {
        assert_eq!(parse("goal kitchen"), Ok((Order::Goal, 3)));
        assert_eq!(parse("goal  Place   7 "), Ok((Order::Goal, 6)));
        let error = parse("goal kichen").unwrap_err().to_string();
        assert!(error.ends_with("did you mean \"Kitchen\"?"), "{error}");
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

    /// A text of a megabyte was once printed in full.
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

//! Orders from ROS 2. An order is a word, followed by the number of the task if it names one.
//!
//! Any node in the domain may send orders, so their rate is limited, and invalid ones are reported on standard error.

use std::time::Duration;

use sketchnav_schemas::codes::Order;

/// Maximum number of orders per second. A person gives fewer.
const MAX_A_SECOND: u32 = 10;
/// Maximum number of characters of a text that are printed.
const MAX_SHOWN: usize = 40;

/// Reasons why an order was rejected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum OrderError {
    /// The word is unknown.
    #[error("{found:?}: expected {}", words())]
    Word {
        /// The text.
        found: String,
    },
    /// The number is not that of a task of the mission.
    #[error("{found:?}: expected a task from 1 to {count}")]
    Task {
        /// The text.
        found: String,
        /// Number of tasks in the mission.
        count: u32,
    },
    /// Too many orders in a second.
    #[error("expected at most {MAX_A_SECOND} orders a second, the others are dropped")]
    Flood,
}

fn words() -> String {
    let words: Vec<_> = Order::ALL.iter().filter(|order| is_word(order)).map(|order| order.word()).collect();
    format!("one of {}, followed by a task number if it needs one", words.join(", "))
}

/// Returns true if an order consists of words only. `here` does not, because it needs a position in the sketch.
fn is_word(order: &Order) -> bool {
    *order != Order::Here
}

/// Parses an order such as `pause` or `goal 3`, for a mission with `task_count` tasks. Tasks are counted from 1 in the text,
/// and from 0 in the result.
///
/// # Errors
/// [`OrderError`] with what was found.
pub fn parse(text: &str, task_count: u32) -> Result<(Order, u32), OrderError> {
    let found = || text.chars().take(MAX_SHOWN).collect::<String>();
    let mut parts = text.split_whitespace();
    let order = parts.next().and_then(|word| word.parse().ok()).filter(is_word);
    let order = order.ok_or_else(|| OrderError::Word { found: found() })?;
    let task = match (parts.next(), parts.next()) {
        (None, _) => Some(1),
        (Some(number), None) => number.parse().ok(),
        _ => None,
    };
    let count = task_count.max(1);
    match task.filter(|task| (1..=count).contains(task)) {
        Some(task) => Ok((order, task - 1)),
        None => Err(OrderError::Task { found: found(), count }),
    }
}

/// Limits the number of orders per second.
#[derive(Debug, Default)]
pub struct Allowance {
    second: u64,
    taken: u32,
}

impl Allowance {
    /// Takes an order that arrived at `now` into account. Returns true if it may be given.
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

    #[test]
    fn an_order_is_a_word_and_optionally_a_task() {
        assert_eq!(parse("pause", 9), Ok((Order::Pause, 0)));
        assert_eq!(parse(" start  3 ", 9), Ok((Order::Start, 2)));
        assert_eq!(parse("goal 9", 9), Ok((Order::Goal, 8)));
        assert_eq!(parse("abort", 0), Ok((Order::Abort, 0)));
    }

    #[test]
    fn the_error_for_an_invalid_order_lists_the_valid_ones() {
        for wrong in ["", "go", "START", "\0", "öffne", "here"] {
            let error = parse(wrong, 9).unwrap_err().to_string();
            assert!(error.contains("expected one of start, abort, pause"), "{wrong:?}: {error}");
        }
        for wrong in ["start 0", "start 10", "start -1", "start x", "start 1 2"] {
            let error = parse(wrong, 9).unwrap_err().to_string();
            assert!(error.contains("expected a task from 1 to 9"), "{wrong:?}: {error}");
        }
    }

    /// A text of a megabyte was once printed in full.
    #[test]
    fn a_long_text_is_abbreviated() {
        let error = parse(&"ü".repeat(1 << 20), 9).unwrap_err();
        assert!(error.to_string().len() < 250, "{}", error.to_string().len());
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

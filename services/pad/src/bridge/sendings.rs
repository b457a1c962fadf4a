//! Makes sending idempotent, using the names that pages give to what they send, and the responses to it.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::board::Answer;
use crate::protocol::Refusal;

/// The names that the page has given to its sendings.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Sendings {
    /// The one that has no answer yet.
    pub(super) pending: Option<String>,
    /// The one that was answered last, and the answer: its facts in JSON, or why it was refused.
    pub(super) answered: Option<(String, Result<String, String>)>,
}

impl Sendings {
    /// Returns the answer to a repeated sending: `None` if the sending is new, `Some(None)` if there is no answer yet.
    pub(super) fn again(&self, name: Option<&str>) -> Option<Option<Answer>> {
        let name = name?;
        if self.pending.as_deref() == Some(name) {
            return Some(None);
        }
        let (_, answer) = self.answered.as_ref().filter(|(answered, _)| answered == name)?;
        let facts = |text: String| serde_json::from_str(&text).unwrap_or_default();
        Some(Some(answer.clone().map(facts).map_err(Refusal::Drawing)))
    }

    pub(super) fn answer(&mut self, answer: &Answer) {
        let kept = answer.as_ref().map(Value::to_string).map_err(Refusal::to_string);
        self.answered = self.pending.take().map(|name| (name, kept));
    }
}

//! Selects fields of a message by path, such as `pose.pose.position.x` or `ranges[3]`.

use serde_json::Value;

/// A step of a path.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Step {
    Name(String),
    Index(usize),
}

/// A path to a field.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    text: String,
    steps: Vec<Step>,
}

/// The reason why a path cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FieldError {
    /// The text is not a path.
    #[error("--field {text:?}: expected names and indices, such as pose.pose.position.x or ranges[3]")]
    Path {
        /// The text.
        text: String,
    },
    /// The message has no such field.
    #[error("--field {text:?}: {at}: expected {expected}, found {found}")]
    Missing {
        /// The path.
        text: String,
        /// The part of the path that exists.
        at: String,
        /// The fields that exist at that point.
        expected: String,
        /// The next step of the path.
        found: String,
    },
    /// The field does not fit into a single cell of a table.
    #[error("--field {text:?}: expected a number, a text or a truth value for a table, found {found}")]
    NoCell {
        /// The path.
        text: String,
        /// A description of the field.
        found: &'static str,
    },
}

impl Field {
    /// Parses a path.
    ///
    /// # Errors
    /// [`FieldError::Path`] if the text is not a path.
    pub fn parse(text: &str) -> Result<Self, FieldError> {
        let steps = text.split('.').map(part).collect::<Option<Vec<_>>>();
        let wrong = || FieldError::Path { text: text.to_owned() };
        Ok(Self { text: text.to_owned(), steps: steps.ok_or_else(wrong)?.concat() })
    }

    /// Returns the path as it was given.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Returns the field's value in a message.
    ///
    /// # Errors
    /// [`FieldError::Missing`] if a step of the path does not exist. The error names that step and the fields that do
    /// exist.
    pub fn of<'a>(&self, message: &'a Value) -> Result<&'a Value, FieldError> {
        let mut value = message;
        let mut at = "message".to_owned();
        for step in &self.steps {
            let (next, found) = match step {
                Step::Name(name) => (value.get(name.as_str()), format!("{name:?}")),
                Step::Index(index) => (value.get(index), format!("[{index}]")),
            };
            let expected = || expected(value, step);
            value = next.ok_or_else(|| FieldError::Missing {
                text: self.text.clone(),
                at: at.clone(),
                expected: expected(),
                found: found.clone(),
            })?;
            at = found.trim_matches('"').to_owned();
        }
        Ok(value)
    }

    /// Returns the field's value as a cell of a table.
    ///
    /// # Errors
    /// Any error of [`Field::of`], and [`FieldError::NoCell`] if the value does not fit into a single cell.
    pub fn cell(&self, message: &Value) -> Result<String, FieldError> {
        let value = self.of(message)?;
        let no_cell = |found| FieldError::NoCell { text: self.text.clone(), found };
        match value {
            Value::Array(_) => Err(no_cell("a list; name an element of it")),
            Value::Object(_) => Err(no_cell("a message; name a field of it")),
            Value::String(text) => Ok(text.clone()),
            Value::Null => Ok(String::new()),
            other => Ok(other.to_string()),
        }
    }

    /// Returns all fields of a message that are not inside a list, in the message's order.
    pub fn all_of(message: &Value) -> Vec<Self> {
        let mut found = Vec::new();
        collect(message, &mut Vec::new(), &mut found);
        found
    }
}

/// Parses a name that may be followed by indices.
fn part(text: &str) -> Option<Vec<Step>> {
    let (name, mut rest) = text.split_at(text.find('[').unwrap_or(text.len()));
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if name.is_empty() || !name.chars().all(is_name) {
        return None;
    }
    let mut steps = vec![Step::Name(name.to_owned())];
    while let Some((index, after)) = rest.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
        steps.push(Step::Index(index.parse().ok()?));
        rest = after;
    }
    rest.is_empty().then_some(steps)
}

fn expected(value: &Value, step: &Step) -> String {
    match (value, step) {
        (Value::Object(fields), _) => {
            let names: Vec<_> = fields.keys().map(String::as_str).collect();
            format!("one of {}", names.join(", "))
        }
        (Value::Array(list), _) if list.is_empty() => "nothing, because the list is empty".to_owned(),
        (Value::Array(list), _) => format!("an index from 0 to {}, such as [0]", list.len() - 1),
        _ => "the end of the path".to_owned(),
    }
}

fn collect(value: &Value, path: &mut Vec<String>, found: &mut Vec<Field>) {
    match value {
        Value::Object(fields) => {
            for (name, value) in fields {
                path.push(name.clone());
                collect(value, path, found);
                path.pop();
            }
        }
        Value::Array(_) => {}
        _ => {
            let steps = path.iter().cloned().map(Step::Name).collect();
            found.push(Field { text: path.join("."), steps });
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::json;

    use super::*;

    fn field(text: &str) -> Field {
        Field::parse(text).unwrap()
    }

    #[test]
    fn a_path_leads_to_its_value() {
        let message = json!({ "a": { "b": [1, { "c": "x" }] }, "d": true });
        assert_eq!(field("a.b[1].c").of(&message), Ok(&json!("x")));
        assert_eq!(field("a.b[0]").cell(&message), Ok("1".to_owned()));
        assert_eq!(field("d").cell(&message), Ok("true".to_owned()));
        assert_eq!(Field::all_of(&message), [field("d")]);
    }

    #[test]
    fn the_error_for_a_wrong_path_lists_the_fields() {
        let message = json!({ "a": { "b": [1, 2] } });
        let error_of = |text: &str| field(text).cell(&message).unwrap_err().to_string();
        assert!(error_of("a.x").contains("a: expected one of b, found \"x\""), "{}", error_of("a.x"));
        assert!(error_of("a.b[2]").contains("expected an index from 0 to 1"), "{}", error_of("a.b[2]"));
        assert!(error_of("a.b").contains("found a list"), "{}", error_of("a.b"));
        assert!(error_of("a").contains("found a message"), "{}", error_of("a"));
        for wrong in ["", "a..b", "[3]", "a[", "a[x]", "a[1]b", "a b"] {
            assert!(Field::parse(wrong).is_err(), "{wrong}");
        }
    }

    proptest! {
        #[test]
        fn any_text_is_a_path_or_an_error(text in ".{0,40}") {
            let _ = Field::parse(&text).map(|field| field.of(&json!({ "a": [0] })).is_ok());
        }
    }
}

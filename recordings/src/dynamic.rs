//! Decodes any ROS 2 message into JSON, using the schema that the file contains for its topic. This makes it
//! possible to read recordings by other software whose types are unknown to this project. Messages that are
//! already JSON are passed on.
//!
//! This module is pure, and checks every length against the bytes that exist. Sources: the MCAP specification
//! (`ros2msg`), OMG DDS-XTypes 1.3, section 7.4 (plain CDR, version 1).

mod cdr;
mod definition;

use std::collections::BTreeMap;
use std::sync::Arc;

use serde_json::Value;

use crate::content::RawMessage;
use crate::directory::Topic;
use crate::error::RecordingError;
use crate::foreign::Form;
use definition::Types;

/// The reason why a message cannot be read by its schema.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DynamicError {
    /// The definition is written in an unsupported language.
    #[error("expected a definition in ros2msg, found {found:?}")]
    Language {
        /// The language's name.
        found: String,
    },
    /// A line of the definition is invalid.
    #[error("the definition of {kind}: expected a field, found {line:?}")]
    Line {
        /// The type.
        kind: String,
        /// The line.
        line: String,
    },
    /// The definition names a type that it does not define.
    #[error("expected the definition of {kind}, found none in the file")]
    Undefined {
        /// The type.
        kind: String,
    },
    /// Types contain each other endlessly.
    #[error("{kind}: the type contains itself")]
    Endless {
        /// The type.
        kind: String,
    },
    /// A type whose characters are not supported, such as `wstring`.
    #[error("type not supported: {kind}")]
    NotRead {
        /// The type.
        kind: String,
    },
    /// The bytes before the message declare another encoding.
    #[error("expected plain CDR, which begins with 00 00 or 00 01, found {found:02x?}")]
    Encapsulation {
        /// The first bytes of the message.
        found: Vec<u8>,
    },
    /// The message ends before its definition does.
    #[error("byte {at}: expected {expected}, found the end of the message")]
    Short {
        /// Offset from the start of the message, in bytes.
        at: usize,
        /// What should have followed.
        expected: &'static str,
    },
    /// The message continues after its definition.
    #[error("expected the end of the message, found {bytes} more bytes")]
    Surplus {
        /// Number of surplus bytes.
        bytes: usize,
    },
    /// A JSON message is not valid JSON.
    #[error("expected JSON: {reason}")]
    Json {
        /// The parser's error.
        reason: String,
    },
}

impl DynamicError {
    /// Returns true if only this message is at fault, and not the definition that it shares with the other messages of its
    /// topic.
    pub fn is_one_message(&self) -> bool {
        use DynamicError::{Encapsulation, Json, Short, Surplus};
        matches!(self, Encapsulation { .. } | Short { .. } | Surplus { .. } | Json { .. })
    }
}

/// Decodes messages of any topic, and caches their definitions.
#[derive(Debug, Default)]
pub struct Decoder {
    known: BTreeMap<String, Known>,
}

#[derive(Debug)]
struct Known {
    topic: Arc<Topic>,
    types: Result<Types, DynamicError>,
}

impl Decoder {
    /// Decodes the message into JSON: an object with the fields of its definition, sorted by name.
    ///
    /// # Errors
    /// [`RecordingError::Form`] if it is not a ROS 2 message, [`RecordingError::Dynamic`] if it does not match its
    /// definition.
    pub fn decode(&mut self, message: &RawMessage) -> Result<Value, RecordingError> {
        let topic = &message.topic;
        let wrong = |source| RecordingError::Dynamic {
            topic: topic.name.clone(),
            stamp_ns: message.stamp_ns,
            source,
        };
        match Form::of(topic) {
            Form::Json => json(&message.cdr).map_err(wrong),
            Form::Ros2 => {
                let types = self.types(topic).as_ref().map_err(|error| wrong(error.clone()))?;
                cdr::decode(&message.cdr, types).map_err(|why| wrong(undefined(why, topic)))
            }
            form => {
                let (topic, found) = (topic.name.clone(), form.words(topic));
                Err(RecordingError::Form { topic, found, way_on: form.way_on() })
            }
        }
    }

    fn types(&mut self, topic: &Arc<Topic>) -> &Result<Types, DynamicError> {
        // A file may declare a topic more than once, with different definitions, so the cached one may be another.
        if self.known.get(&topic.name).is_some_and(|known| !Arc::ptr_eq(&known.topic, topic)) {
            self.known.remove(&topic.name);
        }
        let known = || Known { topic: Arc::clone(topic), types: Types::of(&topic.schema) };
        &self.known.entry(topic.name.clone()).or_insert_with(known).types
    }
}

/// Recorders that did not find a definition leave it empty, which looks like the definition of a message
/// without fields. Such a definition is reported as missing.
fn undefined(why: DynamicError, topic: &Topic) -> DynamicError {
    match why {
        DynamicError::Surplus { .. } if topic.schema.data.trim_ascii().is_empty() => {
            DynamicError::Undefined { kind: topic.ros2_type.clone() }
        }
        why => why,
    }
}

fn json(text: &[u8]) -> Result<Value, DynamicError> {
    serde_json::from_slice(text).map_err(|error| DynamicError::Json { reason: error.to_string() })
}

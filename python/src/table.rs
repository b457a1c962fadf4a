//! Channels and messages for Python: describes their layouts in JSON, and adds those that Python declares.

use std::sync::{Mutex, PoisonError};

use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use serde_json::{Value, json};
use sketchnav_schemas::channels::{self, ChannelSpec, Role as ChannelRole};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::declared::{Declaration, Row};
use sketchnav_schemas::layout::{Field, Kind, Layout, Role};

use crate::function;

/// The channels that Python refers to. A channel's number is its index.
static KNOWN: Mutex<Vec<&'static ChannelSpec>> = Mutex::new(Vec::new());

/// Returns the channel with this number.
pub fn spec(number: usize) -> PyResult<&'static ChannelSpec> {
    let known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    known
        .get(number)
        .copied()
        .ok_or_else(|| PyKeyError::new_err(format!("no channel has the number {number}")))
}

fn number(spec: &'static ChannelSpec) -> usize {
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    known.iter().position(|known| std::ptr::eq(*known, spec)).unwrap_or_else(|| {
        known.push(spec);
        known.len() - 1
    })
}

/// Returns a copy of the text that is never freed. Equal texts share one copy.
pub fn interned(text: &str) -> &'static str {
    static KNOWN: Mutex<Vec<&'static str>> = Mutex::new(Vec::new());
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = known.iter().find(|known| **known == text) {
        return known;
    }
    let text: &'static str = String::leak(text.to_owned());
    known.push(text);
    text
}

fn layout(layout: &Layout) -> Value {
    let fields: Vec<_> = layout.fields.iter().map(field).collect();
    json!({ "name": layout.name, "size": layout.size(), "fields": fields })
}

fn field(field: &Field) -> Value {
    let role = match field.role {
        Role::Value => Value::Null,
        Role::Count => json!("count"),
        Role::Zero => json!("zero"),
        Role::Counted(count) => json!({ "counted": count }),
        Role::Code(values) => {
            json!({ "code": values.iter().map(|value| (value.name, value.code)).collect::<Vec<_>>() })
        }
    };
    json!({ "name": field.name, "offset": field.offset, "kind": kind(&field.kind), "role": role })
}

fn kind(kind: &Kind) -> Value {
    match kind {
        Kind::U32 => json!("u32"),
        Kind::U64 => json!("u64"),
        Kind::F32 => json!("f32"),
        Kind::F64 => json!("f64"),
        Kind::Text(bytes) => json!({ "text": bytes }),
        Kind::Array(element, length) => json!({ "array": [self::kind(element), length] }),
        Kind::Struct(inner) => json!({ "struct": layout(inner) }),
    }
}

/// Declares the channel that this JSON describes.
fn declare(text: &str) -> Result<&'static ChannelSpec, String> {
    let value: Value = serde_json::from_str(text).map_err(|error| error.to_string())?;
    let word = |key: &str| value[key].as_str().unwrap_or_default().to_owned();
    let name = word("name");
    let process = |word: &str| word.parse::<Process>().map_err(|error| format!("channel {name:?}: {error}"));
    let role = match word("role").as_str() {
        "instruction" => ChannelRole::Instruction,
        "detail" => ChannelRole::Detail,
        "situation" => ChannelRole::Situation,
        other => {
            return Err(format!(
                "channel {name:?}: role: expected instruction, detail or situation, found {other:?}"
            ));
        }
    };
    let readers = value["readers"].as_array().into_iter().flatten().filter_map(Value::as_str).map(process);
    let size = |key: &str| value[key].as_u64().map_or(0, |size| size as usize);
    let row = Row {
        role,
        writer: process(&word("writer"))?,
        readers: readers.collect::<Result<_, _>>()?,
        per_tick: size("per_tick"),
        max_cells: size("max_cells"),
        name: name.clone(),
    };
    let mut declaration: Declaration = serde_json::from_value(value["message"].clone())
        .map_err(|error| format!("message of channel {name:?}: {error}"))?;
    declaration.has_slice = row.max_cells > 0;
    let message = declaration.declare().map_err(|error| error.to_string())?;
    row.declare(interned(&word("kind")), message).map_err(|error| error.to_string())
}

/// Adds the functions of this module.
pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    function(module, c"find", |arguments| {
        let (name,) = arguments.extract::<(String,)>()?;
        let names =
            || PyKeyError::new_err(format!("channel {name:?}: expected one of {}", channels::names()));
        channels::find(&name).map(number).ok_or_else(names)
    })?;
    function(module, c"layout", |arguments| {
        let (channel,) = arguments.extract::<(usize,)>()?;
        let message = &spec(channel)?.message;
        let mut value = layout(&message.layout());
        value["type"] = json!(message.type_name());
        Ok(value.to_string())
    })?;
    function(module, c"schema", |arguments| {
        let (channel,) = arguments.extract::<(usize,)>()?;
        Ok(spec(channel)?.message.schema())
    })?;
    function(module, c"names", |_| Ok(channels::all().map(|spec| spec.name.to_owned()).collect::<Vec<_>>()))?;
    function(module, c"declare", |arguments| {
        let (text,) = arguments.extract::<(String,)>()?;
        declare(&text).map(number).map_err(PyValueError::new_err)
    })
}

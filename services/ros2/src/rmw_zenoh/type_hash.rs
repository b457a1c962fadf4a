//! Computes the hash of a ROS 2 type (RIHS01, REP 2016) from its definition and those of the types that it uses.
//!
//! The hash is the SHA-256 of a description in JSON. Comments and constants do not affect it.

use std::collections::BTreeMap;

use sha2::{Digest, Sha256};

/// The offset of an array's type number from that of its elements.
const ARRAY: u32 = 48;
const BOUNDED_SEQUENCE: u32 = 96;
const SEQUENCE: u32 = 144;
const NESTED: u32 = 1;
const BOUNDED_STRING: u32 = 21;

/// Why the hash of a type cannot be computed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the definition of {kind}: expected {expected}, found {found:?}")]
pub struct DefinitionError {
    kind: String,
    expected: &'static str,
    found: String,
}

/// Returns the hash of `package/msg/Type`, computed from its `ros2msg` schema: its definition, followed by those of the types
/// that it uses.
///
/// # Errors
/// [`DefinitionError`] if the schema is invalid, or contains something unknown to ROS 2.
pub fn of_schema(kind: &str, schema: &str) -> Result<String, DefinitionError> {
    let mut texts = BTreeMap::new();
    let mut name = kind.to_owned();
    for line in schema.lines() {
        if let Some(next) = line.strip_prefix("MSG: ") {
            name = full(next);
        } else if !line.starts_with("===") {
            texts.entry(name.clone()).or_insert_with(Vec::new).push(line);
        }
    }
    let describe = |name: &String| {
        let lines = texts.get(name).map(Vec::as_slice).unwrap_or_default();
        description(name, lines)
    };
    let described = describe(&name_of(kind, &texts)?)?;
    let others = texts.keys().filter(|name| *name != kind).map(describe);
    let others = others.collect::<Result<Vec<_>, _>>()?.join(", ");
    let text = format!(r#"{{"type_description": {described}, "referenced_type_descriptions": [{others}]}}"#);
    let digest = Sha256::digest(text.as_bytes());
    Ok(digest.iter().fold("RIHS01_".to_owned(), |hash, byte| format!("{hash}{byte:02x}")))
}

fn name_of(kind: &str, texts: &BTreeMap<String, Vec<&str>>) -> Result<String, DefinitionError> {
    let error = || DefinitionError { kind: kind.to_owned(), expected: "a text", found: String::new() };
    texts.contains_key(kind).then(|| kind.to_owned()).ok_or_else(error)
}

/// Converts `package/Type` into `package/msg/Type`.
fn full(name: &str) -> String {
    name.replacen('/', "/msg/", 1)
}

fn description(kind: &str, lines: &[&str]) -> Result<String, DefinitionError> {
    let mut fields = Vec::new();
    for line in lines {
        let mut words = line.split('#').next().unwrap_or_default().split_whitespace();
        let (Some(of), Some(name)) = (words.next(), words.next()) else { continue };
        let is_constant = name.contains('=') || words.next().is_some_and(|word| word.starts_with('='));
        if !is_constant {
            let error = |expected| DefinitionError { kind: kind.to_owned(), expected, found: of.to_owned() };
            fields.push(field(of, name).map_err(error)?);
        }
    }
    if fields.is_empty() {
        // The field that ROS 2 adds to a message without fields.
        fields.extend(field("uint8", "structure_needs_at_least_one_member").ok());
    }
    Ok(format!(r#"{{"type_name": "{kind}", "fields": [{}]}}"#, fields.join(", ")))
}

fn field(of: &str, name: &str) -> Result<String, &'static str> {
    let number = |text: &str| text.parse::<u32>().map_err(|_| "a number as a bound");
    let (element, more, capacity) = match of.strip_suffix(']').and_then(|of| of.split_once('[')) {
        None => (of, 0, 0),
        Some((element, "")) => (element, SEQUENCE, 0),
        Some((element, length)) => match length.strip_prefix("<=") {
            Some(bound) => (element, BOUNDED_SEQUENCE, number(bound)?),
            None => (element, ARRAY, number(length)?),
        },
    };
    let (id, string_capacity, nested) = match element.split_once("<=") {
        Some(("string", bound)) => (BOUNDED_STRING, number(bound)?, String::new()),
        Some(_) => return Err("a string with a bound"),
        None if element.contains('/') => (NESTED, 0, full(element)),
        None => (primitive(element).ok_or("a type of ROS 2, with its package")?, 0, String::new()),
    };
    Ok(format!(
        r#"{{"name": "{name}", "type": {{"type_id": {}, "capacity": {capacity}, "string_capacity": {string_capacity}, "nested_type_name": "{nested}"}}}}"#,
        id + more
    ))
}

fn primitive(name: &str) -> Option<u32> {
    Some(match name {
        "int8" => 2,
        "uint8" => 3,
        "int16" => 4,
        "uint16" => 5,
        "int32" => 6,
        "uint32" => 7,
        "int64" => 8,
        "uint64" => 9,
        "float32" => 10,
        "float64" => 11,
        "char" => 13,
        "bool" => 15,
        "byte" => 16,
        "string" => 17,
        "wstring" => 18,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topics;
    use sketchnav_schemas::channels;

    /// The expected hashes are those that appear in the keys of ROS 2 Jazzy and Kilted.
    #[test]
    fn standard_types_have_the_hashes_of_ros_2() {
        for (kind, hash) in [
            ("std_msgs/msg/String", "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"),
            ("sensor_msgs/msg/LaserScan", "64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828"),
            ("nav_msgs/msg/Odometry", "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"),
            ("tf2_msgs/msg/TFMessage", "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"),
            ("rosgraph_msgs/msg/Clock", "692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564"),
            (
                "diagnostic_msgs/msg/DiagnosticArray",
                "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
            ),
            ("geometry_msgs/msg/Twist", "9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"),
            (
                "visualization_msgs/msg/MarkerArray",
                "86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf",
            ),
        ] {
            assert_eq!(of_schema(kind, &topics::schema(kind)), Ok(format!("RIHS01_{hash}")), "{kind}");
        }
    }

    #[test]
    fn every_channel_has_a_hash() {
        sketchnav_navigators::register(&[]).unwrap();
        for spec in channels::all() {
            let kind = spec.message.ros2;
            assert!(of_schema(kind, &topics::schema(kind)).is_ok(), "{kind}");
        }
    }

    #[test]
    fn comments_and_constants_do_not_change_the_hash() {
        let hash = |text: &str| of_schema("a/msg/B", text).unwrap();
        let plain = hash("uint32 code\nstring<=8[<=3] names\n");
        assert_eq!(
            hash("# B\nuint32 ONE=1 # one\nuint32 TWO = 2\n\nuint32 code # it\nstring<=8[<=3] names"),
            plain
        );
        assert_ne!(hash("uint32 code\nstring<=8[3] names\n"), plain);
    }

    #[test]
    fn an_invalid_definition_is_reported() {
        let error = |text: &str| of_schema("a/msg/B", text).unwrap_err().to_string();
        assert_eq!(error(""), "the definition of a/msg/B: expected a text, found \"\"");
        assert!(
            error("Header header").contains("expected a type of ROS 2, with its package, found \"Header\"")
        );
        assert!(error("uint8[many] data").contains("expected a number as a bound"));
    }
}

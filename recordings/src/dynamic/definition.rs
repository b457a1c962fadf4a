//! Parses the definitions of messages as stored in MCAP: the `.msg` text of the type, followed by the texts
//! of the types in it, each after a line of `=` and a line `MSG: package/Type`.

use std::collections::BTreeMap;

use super::DynamicError;
use crate::records::Schema;

/// A primitive type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Primitive {
    Bool,
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
    Text,
}

impl Primitive {
    fn of(word: &str) -> Option<Self> {
        Some(match word {
            "bool" => Self::Bool,
            "byte" | "char" | "uint8" => Self::U8,
            "int8" => Self::I8,
            "uint16" => Self::U16,
            "int16" => Self::I16,
            "uint32" => Self::U32,
            "int32" => Self::I32,
            "uint64" => Self::U64,
            "int64" => Self::I64,
            "float32" => Self::F32,
            "float64" => Self::F64,
            "string" => Self::Text,
            _ => return None,
        })
    }
}

/// The type of a field, or of the entries of its list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Kind {
    Primitive(Primitive),
    /// The message with this name.
    Message(String),
}

/// Whether a field is a single value or a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Count {
    One,
    /// A list of fixed length, whose length is not transmitted.
    Fixed(usize),
    /// A list of variable length, which begins with its length.
    Any,
}

/// A field of a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    pub name: String,
    pub kind: Kind,
    pub count: Count,
}

/// The type of a message and the types in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Types {
    pub root: String,
    by_name: BTreeMap<String, Vec<Field>>,
}

impl Types {
    /// Parses the types of a schema.
    pub fn of(schema: &Schema) -> Result<Self, DynamicError> {
        let Schema { name, encoding, data } = schema;
        if encoding != "ros2msg" {
            return Err(DynamicError::Language { found: encoding.clone() });
        }
        let text = String::from_utf8_lossy(data);
        let root = short(name);
        // Files omit these two types, since every reader knows them.
        let known = TIMES.map(|(_, name)| (name.to_owned(), fields_of_time()));
        let mut by_name: BTreeMap<_, _> = known.into_iter().chain([(root.clone(), Vec::new())]).collect();
        let mut current = root.clone();
        for line in text.lines() {
            let line = line.trim();
            if is_rule(line) {
                continue;
            }
            if let Some(next) = line.strip_prefix("MSG: ") {
                current = short(next.trim());
                by_name.insert(current.clone(), Vec::new());
            } else if let Some(field) = field(line, &current)? {
                by_name.entry(current.clone()).or_default().push(field);
            }
        }
        Ok(Self { root, by_name })
    }

    /// Returns the fields of a type.
    pub fn fields(&self, name: &str) -> Result<&[Field], DynamicError> {
        let fields = self.by_name.get(name).map(Vec::as_slice);
        fields.ok_or_else(|| DynamicError::Undefined { kind: name.to_owned() })
    }
}

/// The names that older definitions use for two types.
const TIMES: [(&str, &str); 2] =
    [("time", "builtin_interfaces/Time"), ("duration", "builtin_interfaces/Duration")];

fn fields_of_time() -> Vec<Field> {
    let field = |name: &str, primitive| {
        let (name, kind) = (name.to_owned(), Kind::Primitive(primitive));
        Field { name, kind, count: Count::One }
    };
    vec![field("sec", Primitive::I32), field("nanosec", Primitive::U32)]
}

/// Returns true if a line separates two definitions.
fn is_rule(line: &str) -> bool {
    line.len() >= 3 && line.bytes().all(|byte| byte == b'=')
}

/// Shortens the name of a type, such as `sensor_msgs/msg/LaserScan` to `sensor_msgs/LaserScan`.
fn short(name: &str) -> String {
    match name.split('/').collect::<Vec<_>>().as_slice() {
        [package, .., kind] => format!("{package}/{kind}"),
        _ => name.to_owned(),
    }
}

/// Parses the field that a line in the definition of `within` declares. Returns `None` for a comment, a constant or an empty
/// line.
fn field(line: &str, within: &str) -> Result<Option<Field>, DynamicError> {
    let plain = line.split('#').next().unwrap_or_default().trim();
    if plain.is_empty() {
        return Ok(None);
    }
    let wrong = || DynamicError::Line { kind: within.to_owned(), line: line.to_owned() };
    let (kind, rest) = plain.split_once(char::is_whitespace).ok_or_else(wrong)?;
    let rest = rest.trim_start();
    let name: String = rest.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '_').collect();
    if name.is_empty() {
        return Err(wrong());
    }
    if rest[name.len()..].trim_start().starts_with('=') {
        return Ok(None);
    }
    let (base, count) = counted(kind).ok_or_else(wrong)?;
    // A string may be bounded, which its bytes do not show.
    let base = base.split("<=").next().unwrap_or_default();
    let kind = match Primitive::of(base) {
        Some(primitive) => Kind::Primitive(primitive),
        None if base == "wstring" => return Err(DynamicError::NotRead { kind: base.to_owned() }),
        None => Kind::Message(full(base, within)),
    };
    Ok(Some(Field { name, kind, count }))
}

/// Splits a type into its base and the kind of list.
fn counted(kind: &str) -> Option<(&str, Count)> {
    let Some((base, list)) = kind.split_once('[') else { return Some((kind, Count::One)) };
    let length = list.strip_suffix(']')?;
    let is_bounded = length.is_empty() || length.starts_with("<=");
    let count = if is_bounded { Count::Any } else { Count::Fixed(length.parse().ok()?) };
    Some((base, count))
}

/// Returns the full name of a message type from the name that the definition of `within` uses for it.
fn full(name: &str, within: &str) -> String {
    if name.contains('/') {
        return short(name);
    }
    if name == "Header" {
        return "std_msgs/Header".to_owned();
    }
    if let Some((_, time)) = TIMES.iter().find(|(word, _)| *word == name) {
        return (*time).to_owned();
    }
    let package = within.split('/').next().unwrap_or_default();
    format!("{package}/{name}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn types(text: &str) -> Result<Types, DynamicError> {
        let (name, encoding) = ("a_msgs/msg/A".to_owned(), "ros2msg".to_owned());
        Types::of(&Schema { name, encoding, data: text.as_bytes().to_vec() })
    }

    #[test]
    fn fields_constants_comments_and_lists() {
        let text = "# a comment\nuint8 ONE = 1\nstring TEXT=\"a # b\"\nint32[<=5] few\nfloat64[9] nine\nB[] others # more\n\
                    string<=10 name 'default'\nstd_msgs/Header header\n\n================\nMSG: a_msgs/B\nbool is_set true\n";
        let types = types(text).unwrap();
        let fields: Vec<_> =
            types.fields("a_msgs/A").unwrap().iter().map(|f| (f.name.as_str(), f.count)).collect();
        let expected = [
            ("few", Count::Any),
            ("nine", Count::Fixed(9)),
            ("others", Count::Any),
            ("name", Count::One),
            ("header", Count::One),
        ];
        assert_eq!(fields, expected);
        assert_eq!(types.fields("a_msgs/A").unwrap()[2].kind, Kind::Message("a_msgs/B".to_owned()));
        assert_eq!(types.fields("a_msgs/B").unwrap()[0].kind, Kind::Primitive(Primitive::Bool));
        assert!(types.fields("std_msgs/Header").is_err());
    }

    /// Regression test: `time stamp` was mistaken for a type that the file does not define, so no message with a header was
    /// read.
    #[test]
    fn times_need_no_definition() {
        let types = types("time stamp\nduration[2] lasted\nbuiltin_interfaces/Time again\n").unwrap();
        for field in types.fields("a_msgs/A").unwrap() {
            let Kind::Message(name) = &field.kind else { panic!("{field:?}") };
            let names: Vec<_> = types.fields(name).unwrap().iter().map(|field| field.name.as_str()).collect();
            assert_eq!(names, ["sec", "nanosec"], "{name}");
        }
        // A definition in the file takes precedence, and its fields are not added to the built-in ones.
        let own = Types::of(&Schema {
            name: "a_msgs/msg/A".to_owned(),
            encoding: "ros2msg".to_owned(),
            data: b"time t\n===\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n".to_vec(),
        });
        assert_eq!(own.unwrap().fields("builtin_interfaces/Time").unwrap().len(), 2);
    }

    #[test]
    fn an_invalid_field_is_named() {
        for text in ["uint8", "uint8[x] a", "uint8[3 a", "uint8 =3", "wstring a"] {
            assert!(types(text).is_err(), "{text}");
        }
        let other = Schema { encoding: "ros2idl".to_owned(), ..Schema::default() };
        assert_eq!(Types::of(&other), Err(DynamicError::Language { found: "ros2idl".to_owned() }));
    }
}

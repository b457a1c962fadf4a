//! Decodes plain CDR of either byte order into JSON.

use serde_json::{Map, Number, Value};

use super::DynamicError;
use super::definition::{Count, Field, Kind, Primitive, Types};

/// Maximum nesting depth of messages.
const MAX_DEPTH: usize = 32;
/// Size of the encapsulation header before the message. Alignment counts from its end.
const ENCAPSULATION_BYTES: usize = 4;
/// Maximum number of bytes after the message, which writers may use to fill the last word.
const MAX_PADDING: usize = 3;

/// Decodes the message in `bytes`.
pub fn decode(bytes: &[u8], types: &Types) -> Result<Value, DynamicError> {
    let found =
        || DynamicError::Encapsulation { found: bytes.iter().take(ENCAPSULATION_BYTES).copied().collect() };
    let (head, body) = bytes.split_at_checked(ENCAPSULATION_BYTES).ok_or_else(found)?;
    let is_big_endian = match head {
        [0, 0, ..] => true,
        [0, 1, ..] => false,
        _ => return Err(found()),
    };
    let mut reader = Reader { body, at: 0, is_big_endian };
    let value = message(&mut reader, types, &types.root, 0)?;
    match body.len() - reader.at {
        0..=MAX_PADDING => Ok(value),
        bytes => Err(DynamicError::Surplus { bytes }),
    }
}

fn message(reader: &mut Reader<'_>, types: &Types, name: &str, depth: usize) -> Result<Value, DynamicError> {
    if depth == MAX_DEPTH {
        return Err(DynamicError::Endless { kind: name.to_owned() });
    }
    let fields = types.fields(name)?;
    if fields.is_empty() {
        // A struct must have a member, so ROS 2 gives an empty message one byte.
        reader.take(1, "the byte of an empty message")?;
    }
    let values = fields.iter().map(|f| Ok((f.name.clone(), field(reader, types, f, depth)?)));
    Ok(Value::Object(values.collect::<Result<Map<_, _>, _>>()?))
}

fn field(reader: &mut Reader<'_>, types: &Types, field: &Field, depth: usize) -> Result<Value, DynamicError> {
    let count = match field.count {
        Count::One => return value(reader, types, &field.kind, depth),
        Count::Fixed(count) => count,
        Count::Any => u32::from_ne_bytes(reader.number("the length of a list")?) as usize,
    };
    // Each entry takes at least one byte.
    if count > reader.body.len() - reader.at {
        return Err(DynamicError::Short { at: reader.offset(), expected: "the entries of a list" });
    }
    let entries = (0..count).map(|_| value(reader, types, &field.kind, depth));
    Ok(Value::Array(entries.collect::<Result<_, _>>()?))
}

fn value(reader: &mut Reader<'_>, types: &Types, kind: &Kind, depth: usize) -> Result<Value, DynamicError> {
    match kind {
        Kind::Primitive(primitive) => reader.primitive(*primitive),
        Kind::Message(name) => message(reader, types, name, depth + 1),
    }
}

/// Reads the fields of a message one after another.
struct Reader<'a> {
    body: &'a [u8],
    at: usize,
    is_big_endian: bool,
}

impl<'a> Reader<'a> {
    /// Returns the offset from the start of the message as stored in the file, including the encapsulation header.
    fn offset(&self) -> usize {
        self.at + ENCAPSULATION_BYTES
    }

    fn take(&mut self, count: usize, expected: &'static str) -> Result<&'a [u8], DynamicError> {
        let taken = self.at.checked_add(count).and_then(|end| self.body.get(self.at..end));
        let taken = taken.ok_or(DynamicError::Short { at: self.offset(), expected })?;
        self.at += count;
        Ok(taken)
    }

    /// Reads an aligned number of `N` bytes, and returns it in the byte order of this machine.
    fn number<const N: usize>(&mut self, expected: &'static str) -> Result<[u8; N], DynamicError> {
        self.at = self.at.next_multiple_of(N);
        let mut bytes = [0; N];
        bytes.copy_from_slice(self.take(N, expected)?);
        if self.is_big_endian != cfg!(target_endian = "big") {
            bytes.reverse();
        }
        Ok(bytes)
    }

    fn primitive(&mut self, primitive: Primitive) -> Result<Value, DynamicError> {
        const NUMBER: &str = "a number";
        Ok(match primitive {
            Primitive::Bool => Value::Bool(self.number::<1>("a truth value")? != [0]),
            Primitive::U8 => u8::from_ne_bytes(self.number(NUMBER)?).into(),
            Primitive::I8 => i8::from_ne_bytes(self.number(NUMBER)?).into(),
            Primitive::U16 => u16::from_ne_bytes(self.number(NUMBER)?).into(),
            Primitive::I16 => i16::from_ne_bytes(self.number(NUMBER)?).into(),
            Primitive::U32 => u32::from_ne_bytes(self.number(NUMBER)?).into(),
            Primitive::I32 => i32::from_ne_bytes(self.number(NUMBER)?).into(),
            Primitive::U64 => u64::from_ne_bytes(self.number(NUMBER)?).into(),
            Primitive::I64 => i64::from_ne_bytes(self.number(NUMBER)?).into(),
            Primitive::F32 => real(f32::from_ne_bytes(self.number(NUMBER)?).into()),
            Primitive::F64 => real(f64::from_ne_bytes(self.number(NUMBER)?)),
            Primitive::Text => self.text()?.into(),
        })
    }

    /// Reads a text. Its length includes the zero at its end, which some writers omit for an empty text.
    fn text(&mut self) -> Result<String, DynamicError> {
        let length = u32::from_ne_bytes(self.number("the length of a text")?) as usize;
        let bytes = self.take(length, "a text")?;
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        Ok(String::from_utf8_lossy(bytes).into_owned())
    }
}

/// Converts a number into JSON. Numbers that are not finite become null, because JSON cannot express them.
fn real(number: f64) -> Value {
    Number::from_f64(number).map_or(Value::Null, Value::Number)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::json;

    use super::*;
    use crate::records::Schema;

    const TEXT: &str = "uint8 a\nfloat64 b\nstring c\nint16[] d\nE e\nbool[2] f\n====\nMSG: p/E\n";

    fn types() -> Types {
        let (name, encoding) = ("p/msg/M".to_owned(), "ros2msg".to_owned());
        Types::of(&Schema { name, encoding, data: TEXT.as_bytes().to_vec() }).unwrap()
    }

    /// Returns the same message in either byte order, encoded by hand.
    fn bytes(is_big_endian: bool) -> Vec<u8> {
        let order = |mut bytes: Vec<u8>| {
            if is_big_endian {
                bytes.reverse();
            }
            bytes
        };
        let mut body = vec![7, 0, 0, 0, 0, 0, 0, 0];
        body.extend(order(1.5_f64.to_le_bytes().to_vec()));
        body.extend(order(3_u32.to_le_bytes().to_vec()));
        body.extend(b"hi\0\0");
        body.extend(order(2_u32.to_le_bytes().to_vec()));
        body.extend(order((-2_i16).to_le_bytes().to_vec()));
        body.extend(order(5_i16.to_le_bytes().to_vec()));
        body.extend([0, 1, 0]);
        [vec![0, u8::from(!is_big_endian), 0, 0], body].concat()
    }

    #[test]
    fn both_byte_orders_decode_alike() {
        let expected = json!({ "a": 7, "b": 1.5, "c": "hi", "d": [-2, 5], "e": {}, "f": [true, false] });
        for is_big_endian in [false, true] {
            assert_eq!(decode(&bytes(is_big_endian), &types()), Ok(expected.clone()));
        }
        let mut padded = bytes(false);
        padded.extend([0; 3]);
        assert_eq!(decode(&padded, &types()), Ok(expected));
        padded.push(0);
        assert_eq!(decode(&padded, &types()), Err(DynamicError::Surplus { bytes: 4 }));
    }

    #[test]
    fn an_encoding_other_than_plain_cdr_is_named() {
        let mut other = bytes(false);
        other[1] = 7;
        assert!(matches!(decode(&other, &types()), Err(DynamicError::Encapsulation { .. })));
        let (name, encoding) = ("p/msg/M".to_owned(), "ros2msg".to_owned());
        let endless = Types::of(&Schema { name, encoding, data: b"M m".to_vec() }).unwrap();
        assert!(matches!(decode(&bytes(false), &endless), Err(DynamicError::Endless { .. })));
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Since no length is trusted, any sequence of bytes results in either an error or a message.
        #[test]
        fn arbitrary_bytes_are_decoded_or_rejected(
            cut in 0..50_usize,
            flips in prop::collection::vec((4..44_usize, any::<u8>()), 0..6),
        ) {
            let mut bytes = bytes(false);
            for (at, by) in flips {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte ^= by;
                }
            }
            bytes.truncate(cut);
            let _ = decode(&bytes, &types());
        }
    }
}

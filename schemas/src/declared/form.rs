//! ROS 2 form of declared messages, read and written according to their layout.
//!
//! Every message is checked by [`verify`] before it is written, so writing cannot fail and reading yields the
//! same bytes.

use std::fmt;

use bytemuck::Pod;
use ros2_interfaces_jazzy_serde::std_msgs::msg::Header as HeaderForm;
use serde::de::{DeserializeSeed, Deserializer, Error as _, SeqAccess, Visitor};
use serde::ser::{SerializeSeq, SerializeStruct, SerializeTuple, Serializer};
use serde::{Deserialize, Serialize};

use super::{DeclareError, Declared, SLICE, expect};
use crate::erased::{self, JsonError, Operations, Owned, Spare};
use crate::layout::{Field, Kind, Layout, Role};
use crate::message::{PoseM, PosePx, Twist, fingerprint};
use crate::ros2::parts::{counted_bytes, expect as expect_value, header, header_form, no_cells};
use crate::ros2::{self, Field as _, Ros2Error};
use crate::valid::Invalid;

/// Types whose forms are not written number by number.
enum Standard {
    Point,
    Point32,
    PoseM,
    PosePx,
    Twist,
}

impl Standard {
    fn of(kind: &Kind) -> Option<Self> {
        match kind {
            Kind::Array(element, 2) if **element == Kind::F64 => Some(Self::Point),
            Kind::Array(element, 2) if **element == Kind::F32 => Some(Self::Point32),
            Kind::Struct(layout) if layout.name == "PoseM" => Some(Self::PoseM),
            Kind::Struct(layout) if layout.name == "PosePx" => Some(Self::PosePx),
            Kind::Struct(layout) if layout.name == "Twist" => Some(Self::Twist),
            _ => None,
        }
    }
}

/// Evaluates an expression with the type of a [`Standard`] form as `T`.
macro_rules! with_standard {
    ($standard:expr, $T:ident => $do:expr) => {
        match $standard {
            Standard::Point => {
                type $T = [f64; 2];
                $do
            }
            Standard::Point32 => {
                type $T = [f32; 2];
                $do
            }
            Standard::PoseM => {
                type $T = PoseM;
                $do
            }
            Standard::PosePx => {
                type $T = PosePx;
                $do
            }
            Standard::Twist => {
                type $T = Twist;
                $do
            }
        }
    };
}

/// Returns the type of a field in the `.msg`, or `None` if the field is not transmitted.
pub(super) fn msg(kind: &Kind, role: Role, place: &str) -> Result<Option<String>, DeclareError> {
    Ok(match (role, kind) {
        (Role::Count | Role::Zero, _) => None,
        (Role::Counted(_), Kind::Array(element, _)) => Some(format!("{}[]", name(element, place)?)),
        _ => Some(name(kind, place)?),
    })
}

fn name(kind: &Kind, place: &str) -> Result<String, DeclareError> {
    if let Some(standard) = Standard::of(kind) {
        return Ok(with_standard!(standard, T => T::msg()));
    }
    Ok(match kind {
        Kind::U32 => u32::msg(),
        Kind::U64 => u64::msg(),
        Kind::F32 => f32::msg(),
        Kind::F64 => f64::msg(),
        Kind::Text(_) => "string".to_owned(),
        Kind::Struct(layout) => format!("sketchnav_msgs/{}", layout.name),
        Kind::Array(element, length) => {
            let is_number = matches!(**element, Kind::U32 | Kind::U64 | Kind::F32 | Kind::F64);
            let expected = "numbers in an array without a count, and no array in an array";
            expect(is_number, place, expected, format_args!("{length} of another type"))?;
            format!("{}[{length}]", name(element, place)?)
        }
    })
}

impl Operations for Declared {
    fn type_name(&self) -> String {
        format!("{}/{:016x}", self.name, fingerprint(&self.layout.expanded()))
    }

    fn schema(&self) -> String {
        self.schema.clone()
    }

    fn layout(&self) -> Layout {
        self.layout.clone()
    }

    fn check(&self, _: &[u8]) -> Result<(), Invalid> {
        Ok(())
    }

    fn spare(&self) -> Spare {
        Box::new(HeaderForm::default())
    }

    fn encode(
        &self,
        message: &[u8],
        cells: &[u8],
        spare: &mut Spare,
        out: &mut Vec<u8>,
    ) -> Result<(), Ros2Error> {
        let memory = spare.downcast_mut::<HeaderForm>().map(std::mem::take);
        let form = self.form(message, cells, memory.unwrap_or_default())?;
        ros2::encode(&form, out)?;
        if let Some(memory) = spare.downcast_mut() {
            *memory = form.header;
        }
        Ok(())
    }

    fn decode(&self, cdr: &[u8], seq: u64) -> Result<Owned, Ros2Error> {
        let mut owned = Owned::default();
        let (message, _) = owned.blank(self.layout.size(), 0);
        let (form, source_seq, cells) =
            ros2::decode_by(Whole { declared: self, message: &mut *message }, cdr)?;
        let mut exact = Vec::with_capacity(cdr.len());
        *erased::header_mut(message) = header(&form, seq, source_seq)?;
        ros2::encode(&self.form(message, &cells, form)?, &mut exact)?;
        ros2::expect_same(self.ros2, cdr, exact)?;
        owned.set_cells(cells);
        Ok(owned)
    }

    fn json(&self, message: &[u8], cells: &[u8]) -> Result<serde_json::Value, JsonError> {
        Ok(serde_json::to_value(self.form(message, cells, HeaderForm::default())?)?)
    }
}

impl Declared {
    fn form<'a>(
        &'a self,
        message: &'a [u8],
        cells: &'a [u8],
        spare: HeaderForm,
    ) -> Result<Form<'a>, Ros2Error> {
        if !self.has_slice {
            no_cells(cells)?;
        }
        verify(&self.layout, message)?;
        Ok(Form {
            header: header_form(erased::header(message), &self.frame, spare)?,
            declared: self,
            message,
            cells,
        })
    }

    /// Returns the fields after the header.
    fn body(&self) -> &[Field] {
        &self.layout.fields[1..]
    }
}

/// Checks that decoding the encoded message yields the same bytes.
fn verify(layout: &Layout, bytes: &[u8]) -> Result<(), Ros2Error> {
    for field in &layout.fields {
        let (name, value) = (field.name, within(field, bytes));
        match field.role {
            Role::Zero => expect_value(read::<u32>(value) == 0, name, "0", read::<u32>(value).into())?,
            Role::Counted(count) => {
                let Kind::Array(element, _) = &field.kind else { continue };
                let used = counted_bytes(name, value, element.size(), counter(layout, count, bytes))?;
                used.chunks_exact(element.size()).try_for_each(|entry| verify_kind(element, name, entry))?;
            }
            Role::Value | Role::Code(_) | Role::Count => verify_kind(&field.kind, name, value)?,
        }
    }
    Ok(())
}

fn verify_kind(kind: &Kind, name: &'static str, value: &[u8]) -> Result<(), Ros2Error> {
    match kind {
        Kind::Text(_) => {
            let text = text(value);
            let is_whole = value[text.len()..].iter().all(|&byte| byte == 0);
            if is_whole { Ok(()) } else { Err(Ros2Error::Text { field: name }) }
        }
        Kind::Struct(layout) => verify(layout, value),
        _ => Ok(()),
    }
}

fn within<'a>(field: &Field, bytes: &'a [u8]) -> &'a [u8] {
    &bytes[field.offset..field.offset + field.kind.size()]
}

fn read<T: Pod>(bytes: &[u8]) -> T {
    bytemuck::pod_read_unaligned(bytes)
}

/// Returns the text up to the first zero, or up to the first byte that is not UTF-8.
fn text(bytes: &[u8]) -> &str {
    let bytes = bytes.split(|&byte| byte == 0).next().unwrap_or_default();
    bytes.utf8_chunks().next().map_or("", |chunk| chunk.valid())
}

/// Returns the value of the field that counts a list.
fn counter(layout: &Layout, count: &str, bytes: &[u8]) -> u32 {
    let field = layout.fields.iter().find(|field| field.name == count);
    field.map_or(0, |field| read(within(field, bytes)))
}

fn travels(field: &&Field) -> bool {
    !matches!(field.role, Role::Count | Role::Zero)
}

/// A message with its cells, as transmitted.
struct Form<'a> {
    header: HeaderForm,
    declared: &'a Declared,
    message: &'a [u8],
    cells: &'a [u8],
}

impl Serialize for Form<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (declared, fields) = (self.declared, self.declared.body());
        let length = 2 + fields.iter().filter(travels).count() + usize::from(declared.has_slice);
        let mut form = serializer.serialize_struct(declared.layout.name, length)?;
        form.serialize_field("header", &self.header)?;
        form.serialize_field("source_seq", &erased::header(self.message).source_seq)?;
        write(&declared.layout, fields, self.message, &mut form)?;
        if declared.has_slice {
            form.serialize_field(SLICE, self.cells)?;
        }
        form.end()
    }
}

fn write<S: SerializeStruct>(
    layout: &Layout,
    fields: &[Field],
    bytes: &[u8],
    form: &mut S,
) -> Result<(), S::Error> {
    for field in fields.iter().filter(travels) {
        let value = within(field, bytes);
        match (field.role, &field.kind) {
            (Role::Counted(count), Kind::Array(element, _)) => {
                let used = counter(layout, count, bytes) as usize * element.size();
                form.serialize_field(field.name, &List { element, bytes: &value[..used] })?;
            }
            (_, kind) => form.serialize_field(field.name, &Value { kind, bytes: value })?,
        }
    }
    Ok(())
}

/// The entries of a list that are in use.
struct List<'a> {
    element: &'a Kind,
    bytes: &'a [u8],
}

impl Serialize for List<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let entries = self.bytes.chunks_exact(self.element.size());
        let mut list = serializer.serialize_seq(Some(entries.len()))?;
        for bytes in entries {
            list.serialize_element(&Value { kind: self.element, bytes })?;
        }
        list.end()
    }
}

struct Value<'a> {
    kind: &'a Kind,
    bytes: &'a [u8],
}

impl Serialize for Value<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self { kind, bytes } = self;
        if let Some(standard) = Standard::of(kind) {
            return with_standard!(standard, T => {
                let form = read::<T>(bytes).to_form_in("", Default::default());
                form.map_err(serde::ser::Error::custom)?.serialize(serializer)
            });
        }
        match kind {
            Kind::U32 => read::<u32>(bytes).serialize(serializer),
            Kind::U64 => read::<u64>(bytes).serialize(serializer),
            Kind::F32 => read::<f32>(bytes).serialize(serializer),
            Kind::F64 => read::<f64>(bytes).serialize(serializer),
            Kind::Text(_) => text(bytes).serialize(serializer),
            Kind::Array(element, length) => {
                let mut array = serializer.serialize_tuple(*length)?;
                for bytes in bytes.chunks_exact(element.size()) {
                    array.serialize_element(&Value { kind: element, bytes })?;
                }
                array.end()
            }
            Kind::Struct(layout) => {
                let length = layout.fields.iter().filter(travels).count();
                let mut form = serializer.serialize_struct(layout.name, length)?;
                write(layout, &layout.fields, bytes, &mut form)?;
                form.end()
            }
        }
    }
}

/// Reads a message into its zeroed memory. Yields the ROS 2 header, the cause and the slice.
struct Whole<'a> {
    declared: &'a Declared,
    message: &'a mut [u8],
}

impl<'de> DeserializeSeed<'de> for Whole<'_> {
    type Value = (HeaderForm, u64, Vec<u8>);
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_tuple(usize::MAX, self)
    }
}

impl<'de> Visitor<'de> for Whole<'_> {
    type Value = (HeaderForm, u64, Vec<u8>);
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.declared.ros2)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut from: A) -> Result<Self::Value, A::Error> {
        let missing = || A::Error::custom("expected a header");
        let header = from.next_element()?.ok_or_else(missing)?;
        let source_seq = from.next_element()?.ok_or_else(missing)?;
        fill(&self.declared.layout, self.declared.body(), self.message, &mut from)?;
        let cells = if self.declared.has_slice { from.next_element()? } else { None };
        Ok((header, source_seq, cells.unwrap_or_default()))
    }
}

fn fill<'de, A: SeqAccess<'de>>(
    layout: &Layout,
    fields: &[Field],
    bytes: &mut [u8],
    from: &mut A,
) -> Result<(), A::Error> {
    for field in fields.iter().filter(travels) {
        let missing = || A::Error::custom(format_args!("expected the field {}", field.name));
        let value = &mut bytes[field.offset..field.offset + field.kind.size()];
        match (field.role, &field.kind) {
            (Role::Counted(count), Kind::Array(element, _)) => {
                let used = from.next_element_seed(Entries { element, bytes: value })?.ok_or_else(missing)?;
                if let Some(counter) = layout.fields.iter().find(|counter| counter.name == count) {
                    bytes[counter.offset..][..4].copy_from_slice(bytemuck::bytes_of(&used));
                }
            }
            (_, kind) => from.next_element_seed(Slot { kind, bytes: value })?.ok_or_else(missing)?,
        }
    }
    Ok(())
}

/// Reads a value into its zeroed memory.
struct Slot<'a> {
    kind: &'a Kind,
    bytes: &'a mut [u8],
}

impl<'de> DeserializeSeed<'de> for Slot<'_> {
    type Value = ();
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        let Self { kind, bytes } = self;
        if let Some(standard) = Standard::of(kind) {
            return with_standard!(standard, T => {
                let form = <T as ros2::Field>::Form::deserialize(deserializer)?;
                let value = T::from_form(&form).map_err(D::Error::custom)?;
                bytes.copy_from_slice(bytemuck::bytes_of(&value));
                Ok(())
            });
        }
        match kind {
            Kind::U32 => bytes.copy_from_slice(bytemuck::bytes_of(&u32::deserialize(deserializer)?)),
            Kind::U64 => bytes.copy_from_slice(bytemuck::bytes_of(&u64::deserialize(deserializer)?)),
            Kind::F32 => bytes.copy_from_slice(bytemuck::bytes_of(&f32::deserialize(deserializer)?)),
            Kind::F64 => bytes.copy_from_slice(bytemuck::bytes_of(&f64::deserialize(deserializer)?)),
            Kind::Text(_) => {
                let text = String::deserialize(deserializer)?;
                // A text that is too long is truncated here, and detected when the message is compared with what was read.
                let length = text.len().min(bytes.len());
                bytes[..length].copy_from_slice(&text.as_bytes()[..length]);
            }
            Kind::Array(_, length) => deserializer.deserialize_tuple(*length, Slot { kind, bytes })?,
            Kind::Struct(layout) => {
                let length = layout.fields.iter().filter(travels).count();
                deserializer.deserialize_tuple(length, Slot { kind, bytes })?;
            }
        }
        Ok(())
    }
}

impl<'de> Visitor<'de> for Slot<'_> {
    type Value = ();
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the fields of a struct or the entries of an array")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut from: A) -> Result<(), A::Error> {
        match self.kind {
            Kind::Struct(layout) => fill(layout, &layout.fields, self.bytes, &mut from)?,
            Kind::Array(element, _) => {
                for bytes in self.bytes.chunks_exact_mut(element.size()) {
                    from.next_element_seed(Slot { kind: element, bytes })?;
                }
            }
            _ => {}
        }
        Ok(())
    }
}

/// Reads the entries of a list into its zeroed memory. Yields their number.
struct Entries<'a> {
    element: &'a Kind,
    bytes: &'a mut [u8],
}

impl<'de> DeserializeSeed<'de> for Entries<'_> {
    type Value = u32;
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<u32, D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for Entries<'_> {
    type Value = u32;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut from: A) -> Result<u32, A::Error> {
        let size = self.element.size();
        let mut count = 0;
        for bytes in self.bytes.chunks_exact_mut(size) {
            if from.next_element_seed(Slot { kind: self.element, bytes })?.is_none() {
                return Ok(count);
            }
            count += 1;
        }
        let mut beyond = vec![0; size];
        match from.next_element_seed(Slot { kind: self.element, bytes: &mut beyond })? {
            None => Ok(count),
            Some(()) => Err(A::Error::custom(format_args!("expected at most {count} entries in a list"))),
        }
    }
}

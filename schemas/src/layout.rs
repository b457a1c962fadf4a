//! Memory layout of messages, derived from their declarations.
//!
//! The layout is used for the fingerprint in a channel's type name, for naming the field where two recordings differ, and for
//! generating random samples. Messages have no padding, as their `Pod` derive guarantees, so an offset is the sum of the preceding
//! sizes. To read a message, use its struct rather than the layout.

use bytemuck::Pod;

use crate::codes::Value;
use crate::message::{Message, Text};

/// A type inside a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Kind {
    /// `u32`.
    U32,
    /// `u64`.
    U64,
    /// `f32`.
    F32,
    /// `f64`.
    F64,
    /// A [`Text`] with its capacity in bytes.
    Text(usize),
    /// An array with its length.
    Array(Box<Kind>, usize),
    /// A struct.
    Struct(Layout),
}

/// The role of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// A plain value.
    Value,
    /// The number of a [`crate::codes::Code`] with the given values.
    Code(&'static [Value]),
    /// The number of entries of a list that are in use.
    Count,
    /// A list. The named field contains the number of entries in use, and the rest are zero.
    Counted(&'static str),
    /// Always zero. Used instead of padding.
    Zero,
}

/// A type that a message can consist of.
pub trait Part: Pod {
    /// Returns the representation of the type in memory.
    fn kind() -> Kind;
}

macro_rules! numbers {
    ($($number:ty: $kind:ident),*) => {
        $(impl Part for $number {
            fn kind() -> Kind {
                Kind::$kind
            }
        })*
    };
}

numbers!(u32: U32, u64: U64, f32: F32, f64: F64);

impl<const N: usize> Part for Text<N> {
    fn kind() -> Kind {
        Kind::Text(N)
    }
}

impl<T: Part, const N: usize> Part for [T; N]
where
    [T; N]: Pod,
{
    fn kind() -> Kind {
        Kind::Array(Box::new(T::kind()), N)
    }
}

/// A named part of a struct.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    /// The field's name.
    pub name: &'static str,
    /// Offset from the start of the struct, in bytes.
    pub offset: usize,
    /// The field's type.
    pub kind: Kind,
    /// The field's role.
    pub role: Role,
}

/// The fields of a struct, in order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    /// The struct's name.
    pub name: &'static str,
    /// One `field: type` per line, as declared.
    pub declaration: &'static str,
    /// The fields, in order.
    pub fields: Vec<Field>,
}

/// A number or text inside a message, the smallest unit with a name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Leaf {
    /// Path of the leaf: `header.seq`, `ranges_m[3]`, `tasks[0].name`.
    pub path: String,
    /// Offset from the start of the message, in bytes.
    pub offset: usize,
    kind: Kind,
}

impl Kind {
    pub(crate) fn size(&self) -> usize {
        match self {
            Self::U32 | Self::F32 => 4,
            Self::U64 | Self::F64 => 8,
            Self::Text(bytes) => *bytes,
            Self::Array(element, count) => element.size() * count,
            Self::Struct(layout) => layout.size(),
        }
    }

    /// Returns the layout of a struct, or of the structs in an array.
    pub(crate) fn layout(&self) -> Option<&Layout> {
        match self {
            Self::Struct(layout) => Some(layout),
            Self::Array(element, _) => element.layout(),
            _ => None,
        }
    }
}

impl Layout {
    /// Returns the layout of a message type.
    pub fn of<T: Message>() -> Self {
        T::layout()
    }

    /// Creates the layout of a struct with the given fields, in order and without padding.
    pub fn new(
        name: &'static str,
        declaration: &'static str,
        parts: impl IntoIterator<Item = (&'static str, Kind, Role)>,
    ) -> Self {
        let mut end = 0;
        let place = |(name, kind, role): (_, Kind, _)| {
            let offset = end;
            end += kind.size();
            Field { name, offset, kind, role }
        };
        Self { name, declaration, fields: parts.into_iter().map(place).collect() }
    }

    /// Returns the declarations of the struct and of every struct in it, as one text. The type name of a channel
    /// contains a fingerprint of this text.
    pub fn expanded(&self) -> String {
        let mut text = self.declaration.to_owned();
        for part in self.fields.iter().filter_map(|field| field.kind.layout()) {
            text.push_str(&format!("{} {{\n{}}}\n", part.name, part.expanded()));
        }
        text
    }

    /// Returns the size of the struct, in bytes.
    pub fn size(&self) -> usize {
        self.fields.iter().map(|f| f.kind.size()).sum()
    }

    /// Returns the number or text that contains the byte at `offset`, or `None` if the offset is beyond the
    /// end.
    pub fn leaf_at(&self, offset: usize) -> Option<Leaf> {
        let field = self.fields.iter().rev().find(|f| f.offset <= offset)?;
        descend(field.name.to_owned(), &field.kind, field.offset, offset - field.offset)
    }

    /// Returns all numbers and texts that differ between two messages of this layout, in order.
    pub fn differences<'a>(&'a self, a: &'a [u8], b: &'a [u8]) -> impl Iterator<Item = Leaf> + 'a {
        let mut from = 0;
        std::iter::from_fn(move || {
            let offset = a.iter().zip(b).skip(from).position(|(x, y)| x != y)? + from;
            let leaf = self.leaf_at(offset)?;
            from = leaf.offset + leaf.kind.size();
            Some(leaf)
        })
    }
}

fn descend(path: String, kind: &Kind, start: usize, inside: usize) -> Option<Leaf> {
    match kind {
        _ if inside >= kind.size() => None,
        Kind::Struct(layout) => {
            let leaf = layout.leaf_at(inside)?;
            Some(Leaf { path: format!("{path}.{}", leaf.path), offset: start + leaf.offset, ..leaf })
        }
        Kind::Array(element, _) => {
            let index = inside / element.size();
            let skipped = index * element.size();
            descend(format!("{path}[{index}]"), element, start + skipped, inside - skipped)
        }
        leaf => Some(Leaf { path, offset: start, kind: leaf.clone() }),
    }
}

impl Leaf {
    /// Returns the value in `message` as a number, or `None` for a text.
    pub fn number(&self, message: &[u8]) -> Option<f64> {
        let bytes = message.get(self.offset..self.offset + self.kind.size())?;
        match self.kind {
            Kind::U32 => Some(u32::from_le_bytes(bytes.try_into().ok()?).into()),
            Kind::F32 => Some(f32::from_le_bytes(bytes.try_into().ok()?).into()),
            Kind::U64 => Some(u64::from_le_bytes(bytes.try_into().ok()?) as f64),
            Kind::F64 => Some(f64::from_le_bytes(bytes.try_into().ok()?)),
            _ => None,
        }
    }

    /// Formats the value in `message` for people to read. NaNs are followed by their bits, because they print alike even if they
    /// differ.
    pub fn show(&self, message: &[u8]) -> String {
        let bytes = message.get(self.offset..self.offset + self.kind.size()).unwrap_or_default();
        match (&self.kind, bytes.try_into(), bytes.try_into()) {
            (Kind::U32, Ok(four), _) => u32::from_le_bytes(four).to_string(),
            (Kind::F32, Ok(four), _) => show_float(f32::from_le_bytes(four), u32::from_le_bytes(four)),
            (Kind::U64, _, Ok(eight)) => u64::from_le_bytes(eight).to_string(),
            (Kind::F64, _, Ok(eight)) => show_float(f64::from_le_bytes(eight), u64::from_le_bytes(eight)),
            _ => format!("{:?}", String::from_utf8_lossy(bytes).trim_end_matches('\0')),
        }
    }
}

fn show_float<F: Into<f64> + Copy + std::fmt::Debug>(value: F, bits: impl std::fmt::LowerHex) -> String {
    if value.into().is_nan() { format!("NaN (bits {bits:#x})") } else { format!("{value:?}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::{LaserScan, MissionStatus, Odometry, People, WalkingPerson};

    #[test]
    fn each_byte_maps_to_its_field() {
        let offset = std::mem::offset_of!(LaserScan, ranges_m) + 3 * 4 + 1;
        let leaf = Layout::of::<LaserScan>().leaf_at(offset).unwrap();
        assert_eq!((leaf.path.as_str(), leaf.offset), ("ranges_m[3]", offset - 1));
        let offset = std::mem::offset_of!(People, people) + size_of::<WalkingPerson>() + 8;
        assert_eq!(Layout::of::<People>().leaf_at(offset).unwrap().path, "people[1].y_m");
        assert_eq!(Layout::of::<People>().leaf_at(size_of::<People>()), None);
    }

    #[test]
    fn differences_are_reported_with_both_values() {
        let mut a: MissionStatus = bytemuck::Zeroable::zeroed();
        let b = a;
        a.remaining_m = 2.5;
        a.reason = crate::message::Text::new("later");
        let (a, b) = (bytemuck::bytes_of(&a), bytemuck::bytes_of(&b));
        let leaf = Layout::of::<MissionStatus>().differences(a, b).next().unwrap();
        assert_eq!(
            (leaf.path.as_str(), leaf.show(a), leaf.show(b)),
            ("remaining_m", "2.5".into(), "0.0".into())
        );
    }

    /// Regression test: two builds that disagreed about a nested struct (`PoseM` inside `Odometry`) used to connect on a
    /// channel, because the fingerprint covered only the message's own list of fields.
    #[test]
    fn a_fingerprint_covers_nested_structs() {
        let text = Odometry::layout().expanded();
        assert!(text.contains("orientation_w: f64") && text.contains("source_seq: u64"), "{text}");
    }
}

//! The memory layout of messages, derived from their declarations.
//!
//! It is used for the fingerprint in a channel's type name, for naming the field in which two recordings differ, and for random
//! samples. Messages have no padding (their `Pod` derive refuses it), so an offset is the sum of the sizes before it. It is
//! never needed for reading a message; the struct is for that.

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
    /// A [`Text`] of this many bytes.
    Text(usize),
    /// This many of the same.
    Array(Box<Kind>, usize),
    /// A struct.
    Struct(Layout),
}

/// The role of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Its own value.
    Value,
    /// The number of a [`crate::codes::Code`] with these values.
    Code(&'static [Value]),
    /// How many entries of a list count.
    Count,
    /// A list; the field of this name says how many of its entries count, and the rest are zero.
    Counted(&'static str),
    /// Always zero: fills what would be padding.
    Zero,
}

/// A type that messages are made of.
pub trait Part: Pod {
    /// Its representation in memory.
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
    /// Bytes from the start of the struct.
    pub offset: usize,
    /// Its type.
    pub kind: Kind,
    /// Its role.
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

/// A number or text inside a message: the smallest thing that has a name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Leaf {
    /// `header.seq`, `ranges_m[3]`, `tasks[0].name`.
    pub path: String,
    /// Bytes from the start of the message.
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

    /// The layout of the struct, or of an array's struct elements.
    pub(crate) fn layout(&self) -> Option<&Layout> {
        match self {
            Self::Struct(layout) => Some(layout),
            Self::Array(element, _) => element.layout(),
            _ => None,
        }
    }
}

impl Layout {
    /// The layout of a message type.
    pub fn of<T: Message>() -> Self {
        T::layout()
    }

    /// A struct with these fields, in order, without padding.
    pub fn new<const N: usize>(
        name: &'static str,
        declaration: &'static str,
        parts: [(&'static str, Kind, Role); N],
    ) -> Self {
        let mut end = 0;
        let place = |(name, kind, role): (_, Kind, _)| {
            let offset = end;
            end += kind.size();
            Field { name, offset, kind, role }
        };
        Self { name, declaration, fields: parts.map(place).into() }
    }

    /// The declarations of the struct and of every struct in it, as one text, of which a channel's type name has a fingerprint.
    pub fn expanded(&self) -> String {
        let mut text = self.declaration.to_owned();
        for part in self.fields.iter().filter_map(|field| field.kind.layout()) {
            text.push_str(&format!("{} {{\n{}}}\n", part.name, part.expanded()));
        }
        text
    }

    /// Size of the struct, bytes.
    pub fn size(&self) -> usize {
        self.fields.iter().map(|f| f.kind.size()).sum()
    }

    /// The number or text to which the byte at `offset` belongs; `None` beyond the end.
    pub fn leaf_at(&self, offset: usize) -> Option<Leaf> {
        let field = self.fields.iter().rev().find(|f| f.offset <= offset)?;
        descend(field.name.to_owned(), &field.kind, field.offset, offset - field.offset)
    }

    /// Every number and text in which two messages of this layout differ, in order.
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
    /// The value in `message`; `None` for a text.
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

    /// The value in `message`, for people; a number that prints like another one but differs in its
    /// bits is followed by them.
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
    fn a_byte_belongs_to_the_field_that_the_compiler_put_there() {
        let offset = std::mem::offset_of!(LaserScan, ranges_m) + 3 * 4 + 1;
        let leaf = Layout::of::<LaserScan>().leaf_at(offset).unwrap();
        assert_eq!((leaf.path.as_str(), leaf.offset), ("ranges_m[3]", offset - 1));
        let offset = std::mem::offset_of!(People, people) + size_of::<WalkingPerson>() + 8;
        assert_eq!(Layout::of::<People>().leaf_at(offset).unwrap().path, "people[1].y_m");
        assert_eq!(Layout::of::<People>().leaf_at(size_of::<People>()), None);
    }

    #[test]
    fn differences_are_named_with_both_values() {
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

    /// Two builds that disagreed about a nested struct (`PoseM` inside `Odometry`) used to meet on a channel. The
    /// fingerprint covered the message's own field list only.
    #[test]
    fn a_fingerprint_covers_nested_structs() {
        let text = Odometry::layout().expanded();
        assert!(text.contains("orientation_w: f64") && text.contains("source_seq: u64"), "{text}");
    }
}

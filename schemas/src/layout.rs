//! What lies where in a message, derived from the text of its declaration.
//!
//! For the golden file that holds the layouts still, for the fingerprint in a channel's type name,
//! and for naming the field in which two recordings differ. Messages have no padding (their `Pod`
//! derive refuses it), so an offset is the sum of the sizes before it. Never needed to read a
//! message: for that there is the struct.

use crate::message::{Header, Message, Particle, PoseM, PosePx, RouteTask, Twist};

/// The structs that messages are made of, with their declarations.
pub const PARTS: &[(&str, &str)] = &[
    ("Header", Header::FIELDS),
    ("PoseM", PoseM::FIELDS),
    ("PosePx", PosePx::FIELDS),
    ("Twist", Twist::FIELDS),
    ("RouteTask", RouteTask::FIELDS),
    ("Particle", Particle::FIELDS),
];

/// A type inside a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Kind {
    U32,
    U64,
    F32,
    F64,
    Text(usize),
    Array(Box<Kind>, usize),
    Struct(Layout),
}

/// A named part of a struct.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    /// The field's name.
    pub name: &'static str,
    /// Its type as declared.
    pub declared: &'static str,
    /// Bytes from the start of the struct.
    pub offset: usize,
    pub(crate) kind: Kind,
}

/// The fields of a struct, in order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
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
    /// `None` where the declaration uses a type that messages may not hold.
    fn parse(text: &'static str) -> Option<Self> {
        match text {
            "u32" => Some(Self::U32),
            "u64" => Some(Self::U64),
            "f32" => Some(Self::F32),
            "f64" => Some(Self::F64),
            _ => Self::parse_text(text)
                .or_else(|| Self::parse_array(text))
                .or_else(|| Self::parse_struct(text)),
        }
    }

    fn parse_text(text: &str) -> Option<Self> {
        text.strip_prefix("Text<")?.strip_suffix('>')?.parse().ok().map(Self::Text)
    }

    fn parse_array(text: &'static str) -> Option<Self> {
        let (element, count) = text.strip_prefix('[')?.strip_suffix(']')?.rsplit_once("; ")?;
        Some(Self::Array(Box::new(Self::parse(element)?), count.parse().ok()?))
    }

    fn parse_struct(text: &str) -> Option<Self> {
        let (_, declaration) = PARTS.iter().find(|(name, _)| *name == text)?;
        Layout::parse(declaration).map(Self::Struct)
    }

    pub(crate) fn size(&self) -> usize {
        match self {
            Self::U32 | Self::F32 => 4,
            Self::U64 | Self::F64 => 8,
            Self::Text(bytes) => *bytes,
            Self::Array(element, count) => element.size() * count,
            Self::Struct(layout) => layout.size(),
        }
    }
}

impl Layout {
    /// The layout of a message type.
    ///
    /// # Panics
    /// Where a declaration uses a type that is neither a number nor a text nor one of [`PARTS`];
    /// a test goes through all messages.
    pub fn of<T: Message>() -> Self {
        Self::parse(T::LAYOUT).unwrap_or_else(|| panic!("{}: a type unknown to layout::PARTS", T::NAME))
    }

    /// The layout of a declaration: one `field: type` a line. `None` where a type is unknown.
    pub fn parse(declaration: &'static str) -> Option<Self> {
        let mut offset = 0;
        let mut fields = Vec::new();
        for line in declaration.lines() {
            let (name, declared) = line.split_once(": ")?;
            let kind = Kind::parse(declared)?;
            let size = kind.size();
            fields.push(Field { name, declared, offset, kind });
            offset += size;
        }
        Some(Self { fields })
    }

    /// Size of the struct, bytes.
    pub fn size(&self) -> usize {
        self.fields.iter().map(|f| f.kind.size()).sum()
    }

    /// The number or text that the byte at `offset` belongs to; `None` behind the end.
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

/// The declaration of `T` and of every struct in it, as one text: what a channel's type name is a
/// fingerprint of.
pub fn expanded(declaration: &str) -> String {
    let mut text = declaration.to_owned();
    for (name, fields) in PARTS {
        if names(declaration, name) {
            text.push_str(&format!("{name} {{\n{}}}\n", expanded(fields)));
        }
    }
    text
}

fn names(declaration: &str, part: &str) -> bool {
    let types = declaration.lines().filter_map(|line| line.split_once(": ")).map(|(_, declared)| declared);
    types.into_iter().any(|declared| declared.split(['[', ']', ';', ' ']).any(|word| word == part))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::channels::{self, Channel, ChannelVisitor};
    use crate::message::{LaserScan, MissionStatus, Route};
    use crate::ros2::Ros2;

    struct Sizes;

    impl ChannelVisitor for Sizes {
        type Error = String;
        fn visit<T: Ros2>(&mut self, _: Channel<T>) -> Result<(), String> {
            assert_eq!(Layout::of::<T>().size(), size_of::<T>(), "{}", T::NAME);
            Ok(())
        }
    }

    #[test]
    fn every_declaration_is_understood_and_has_the_size_of_its_struct() {
        channels::visit(&mut Sizes).unwrap();
    }

    #[test]
    fn a_byte_belongs_to_the_field_that_the_compiler_put_there() {
        let offset = std::mem::offset_of!(LaserScan, ranges_m) + 3 * 4 + 1;
        let leaf = Layout::of::<LaserScan>().leaf_at(offset).unwrap();
        assert_eq!((leaf.path.as_str(), leaf.offset), ("ranges_m[3]", offset - 1));
        let offset = std::mem::offset_of!(Route, points_px) + 16 * 5 + 8;
        assert_eq!(Layout::of::<Route>().leaf_at(offset).unwrap().path, "points_px[5][1]");
        let offset = std::mem::offset_of!(Route, tasks) + size_of::<RouteTask>() + 32;
        assert_eq!(Layout::of::<Route>().leaf_at(offset).unwrap().path, "tasks[1].first_point");
        assert_eq!(Layout::of::<Route>().leaf_at(size_of::<Route>()), None);
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

    /// Two builds that disagreed about a nested struct (`PoseM` inside `Odometry`) used to meet on a
    /// channel, because the fingerprint covered the message's own field list only.
    #[test]
    fn a_fingerprint_covers_nested_structs() {
        let text = expanded(crate::message::Odometry::LAYOUT);
        assert!(text.contains("orientation_w: f64") && text.contains("source_seq: u64"), "{text}");
    }
}

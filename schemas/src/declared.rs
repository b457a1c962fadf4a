//! Messages and channels that are declared at run time, for example by a navigator in another language.
//!
//! A [`Declaration`] is equivalent to a struct in [`messages!`](crate::declare::messages): it yields the same layout, the same
//! fingerprint, the same `.msg` text and the same bytes, so processes that use one can exchange messages with processes that use
//! the other. The checks that the compiler makes for the macro's structs are made here when the message is declared, and errors
//! name the field.
//!
//! Declared types and channels exist until the program ends, like those in its source.

mod form;

use serde::Deserialize;

use crate::channels::{ChannelSpec, Role as ChannelRole};
use crate::codes::{Process, Value};
use crate::erased::{ALIGNMENT, MessageType};
use crate::layout::{Kind, Layout, Part as _, Role};
use crate::message::{Header, Message as _, PoseM, PosePx, Tick, Twist};
use crate::ros2::definitions::{self, Definition, Line};
use crate::ros2::own::{SLICE_DOC, message_text};

/// Maximum size of a declared message, not including the slice after it, in bytes.
pub const MAX_MESSAGE_BYTES: usize = 1 << 20;
/// Maximum length of the slice after a declared message, in bytes.
pub const MAX_CELLS: usize = 16 << 20;
/// Name of the field for the slice after a message.
const SLICE: &str = "data";

/// A message.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Declaration {
    /// Name, comment and fields, not counting the header.
    pub body: Struct,
    /// Version of the message.
    pub version: u32,
    /// Frame for the header. Empty if no field is in a frame.
    #[serde(default)]
    pub frame: String,
    /// Whether a slice of bytes follows the message.
    #[serde(default)]
    pub has_slice: bool,
}

/// A struct: the body of a message or a part of one.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Struct {
    /// Name, in the form `WalkingPerson`.
    pub name: String,
    /// The comment, line by line.
    #[serde(default)]
    pub doc: Vec<String>,
    /// The fields, in order.
    pub fields: Vec<Field>,
}

/// A field of a [`Struct`].
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Field {
    /// Name, in the form `range_max_m`.
    pub name: String,
    /// The comment, line by line.
    #[serde(default)]
    pub doc: Vec<String>,
    /// The type.
    pub kind: Type,
    /// Anything that the type cannot express.
    #[serde(default)]
    pub way: Way,
}

/// The type of a field.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Type {
    /// `u32`.
    U32,
    /// `u64`.
    U64,
    /// `f32`.
    F32,
    /// `f64`.
    F64,
    /// Text of up to the given number of bytes.
    Text(usize),
    /// [`PoseM`].
    PoseM,
    /// [`PosePx`].
    PosePx,
    /// [`Twist`].
    Twist,
    /// An array with its length.
    Array(Box<Type>, usize),
    /// A struct with its own `.msg`.
    Part(Struct),
}

/// The words after a field's type, as in [`crate::declare`].
#[derive(Debug, Clone, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Way {
    /// No words.
    #[default]
    Itself,
    /// `as Code`, with the name, number and comment of each value.
    Code(Vec<(String, u32, String)>),
    /// `as Count`.
    Count,
    /// `where` the given field `counts`.
    Counted(String),
    /// `as Zero`.
    Zero,
}

/// A row of the table of channels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// See [`ChannelSpec::name`].
    pub name: String,
    /// See [`ChannelSpec::role`].
    pub role: ChannelRole,
    /// See [`ChannelSpec::writer`].
    pub writer: Process,
    /// See [`ChannelSpec::readers`].
    pub readers: Vec<Process>,
    /// See [`ChannelSpec::per_tick`].
    pub per_tick: usize,
    /// See [`ChannelSpec::max_cells`].
    pub max_cells: usize,
}

/// The reason why a message or a channel cannot be declared.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{place}: expected {expected}, found {found}")]
pub struct DeclareError {
    /// The message, channel or field, as in `Walls.ahead_m`.
    pub place: String,
    /// What was expected.
    pub expected: String,
    /// What was found.
    pub found: String,
}

fn expect(
    holds: bool,
    place: &str,
    expected: impl Into<String>,
    found: impl ToString,
) -> Result<(), DeclareError> {
    let error = || DeclareError { place: place.into(), expected: expected.into(), found: found.to_string() };
    if holds { Ok(()) } else { Err(error()) }
}

/// A struct with its layout.
struct Placed {
    layout: Layout,
    lines: Vec<Line>,
    parts: Vec<Definition>,
}

/// A declared message type.
struct Declared {
    /// See [`Message::NAME`](crate::message::Message::NAME).
    name: &'static str,
    ros2: &'static str,
    layout: Layout,
    frame: String,
    has_slice: bool,
    schema: String,
}

impl Declaration {
    /// Declares the message.
    ///
    /// # Errors
    /// [`DeclareError`] if `messages!` would reject the declaration.
    pub fn declare(&self) -> Result<MessageType, DeclareError> {
        let Self { body, version, frame, has_slice } = self;
        let is_frame = frame.bytes().all(|b| b.is_ascii_alphanumeric() || b"_/".contains(&b));
        expect(is_frame, &body.name, "a frame of letters, digits, _ and /", format_args!("{frame:?}"))?;
        let placed = body.place(true)?;
        if let Some(field) = body.fields.iter().find(|field| *has_slice && field.name == SLICE) {
            expect(false, &body.name, "another name than that of the slice after the message", &field.name)?;
        }
        let slice =
            Line { doc: SLICE_DOC, name: SLICE, kind: has_slice.then(|| "uint8[]".to_owned()), values: &[] };
        let text = message_text(docs(&body.doc), frame, placed.lines, slice);
        let own = Definition { name: leaked(format!("sketchnav_msgs/{}", body.name)), text };
        let ros2 = leaked(format!("sketchnav_msgs/msg/{}", body.name));
        let declared: &'static Declared = Box::leak(Box::new(Declared {
            name: leaked(format!("sketchnav/{}/{version}", body.name)),
            ros2,
            schema: definitions::schema(ros2, &[vec![own], placed.parts].concat()),
            layout: placed.layout,
            frame: frame.clone(),
            has_slice: *has_slice,
        }));
        let size = declared.layout.size();
        Ok(MessageType { name: declared.name, size, ros2, operations: declared })
    }
}

impl Struct {
    /// Computes the layout of the struct, beginning with a message header if `is_message`.
    fn place(&self, is_message: bool) -> Result<Placed, DeclareError> {
        self.check_names(is_message)?;
        let (mut declaration, mut placed) = (String::new(), Vec::new());
        let (mut lines, mut parts, mut end) = (Vec::new(), Vec::new(), 0);
        if is_message {
            declaration.extend(Tick::LAYOUT.lines().next());
            declaration.push('\n');
            placed.push(("header", Header::kind(), Role::Value));
            end = size_of::<Header>();
        }
        for field in &self.fields {
            let place = format!("{}.{}", self.name, field.name);
            let kind = field.kind.kind(&place, &mut parts)?;
            let role = self.role(field, &place)?;
            let (alignment, name) = (alignment(&kind), leaked(field.name.clone()));
            let expected = "no gap before the field: larger fields first, or a u32 that is always zero";
            let found = format_args!("an offset of {end} bytes for an alignment of {alignment}");
            expect(end.is_multiple_of(alignment), &place, expected, found)?;
            end = end.saturating_add(kind.size());
            expect(end <= MAX_MESSAGE_BYTES, &place, format!("at most {MAX_MESSAGE_BYTES} bytes"), end)?;
            declaration.push_str(&format!("{name}: {}\n", field.kind.word()));
            let values = if let Role::Code(values) = role { values } else { &[] };
            lines.push(Line { doc: docs(&field.doc), name, kind: form::msg(&kind, role, &place)?, values });
            placed.push((name, kind, role));
        }
        let whole = if is_message { ALIGNMENT } else { self.alignment(&placed) };
        let expected =
            format!("a size that is a multiple of {whole} bytes, padded with a u32 that is always zero");
        expect(end > 0 && end.is_multiple_of(whole), &self.name, expected, end)?;
        let layout = Layout::new(leaked(self.name.clone()), leaked(declaration), placed);
        Ok(Placed { layout, lines, parts })
    }

    fn alignment(&self, placed: &[(&'static str, Kind, Role)]) -> usize {
        placed.iter().map(|(_, kind, _)| alignment(kind)).max().unwrap_or(1)
    }

    fn check_names(&self, is_message: bool) -> Result<(), DeclareError> {
        let name = &self.name;
        let is_type = name.starts_with(|c: char| c.is_ascii_uppercase())
            && name.bytes().all(|byte| byte.is_ascii_alphanumeric());
        expect(is_type, name, "a name such as WalkingPerson", format_args!("{name:?}"))?;
        let is_free = ![Header::layout(), PoseM::layout(), PosePx::layout(), Twist::layout()]
            .iter()
            .any(|layout| layout.name == name);
        expect(is_free, name, "a name that no common type has", name)?;
        for (i, field) in self.fields.iter().enumerate() {
            let (name, place) = (&field.name, format!("{}.{}", self.name, field.name));
            let is_field = name.starts_with(|c: char| c.is_ascii_lowercase())
                && name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_');
            expect(is_field, &place, "a name such as range_max_m", format_args!("{name:?}"))?;
            let is_first = self.fields[..i].iter().all(|other| other.name != *name);
            let is_own = !is_message || !["header", "source_seq"].contains(&name.as_str());
            expect(is_first && is_own, &place, "a name that no other field has", name)?;
        }
        Ok(())
    }

    fn role(&self, field: &Field, place: &str) -> Result<Role, DeclareError> {
        let is_u32 = field.kind == Type::U32;
        Ok(match &field.way {
            Way::Itself => Role::Value,
            Way::Zero => {
                expect(is_u32, place, "a u32 that is always zero", field.kind.word())?;
                Role::Zero
            }
            Way::Count => {
                expect(is_u32, place, "a u32 that counts a list", field.kind.word())?;
                let lists = self.fields.iter().filter(|list| list.way == Way::Counted(field.name.clone()));
                expect(lists.clone().count() == 1, place, "one list that it counts", lists.count())?;
                Role::Count
            }
            Way::Counted(count) => {
                let is_list = matches!(field.kind, Type::Array(..));
                expect(is_list, place, "an array of which some entries are in use", field.kind.word())?;
                let counter = self.fields.iter().find(|counter| counter.name == *count);
                let is_count = counter.is_some_and(|counter| counter.way == Way::Count);
                expect(is_count, place, "the name of a field that counts", format_args!("{count:?}"))?;
                Role::Counted(leaked(count.clone()))
            }
            Way::Code(values) => {
                expect(is_u32, place, "a u32 for the number of a code", field.kind.word())?;
                let value = |(name, code, doc): &(String, u32, String)| Value {
                    name: leaked(name.clone()),
                    code: *code,
                    doc: leaked(doc.clone()),
                };
                Role::Code(Vec::leak(values.iter().map(value).collect()))
            }
        })
    }
}

impl Type {
    /// Returns the type in Rust syntax.
    fn word(&self) -> String {
        match self {
            Self::U32 => "u32".to_owned(),
            Self::U64 => "u64".to_owned(),
            Self::F32 => "f32".to_owned(),
            Self::F64 => "f64".to_owned(),
            Self::Text(bytes) => format!("Text<{bytes}>"),
            Self::PoseM => PoseM::layout().name.to_owned(),
            Self::PosePx => PosePx::layout().name.to_owned(),
            Self::Twist => Twist::layout().name.to_owned(),
            Self::Array(element, length) => format!("[{}; {length}]", element.word()),
            Self::Part(part) => part.name.clone(),
        }
    }

    /// Computes the layout of the type and adds the `.msg` texts that it needs to `parts`.
    fn kind(&self, place: &str, parts: &mut Vec<Definition>) -> Result<Kind, DeclareError> {
        let length = |length: usize| {
            let is_length = (1..=MAX_MESSAGE_BYTES).contains(&length);
            expect(is_length, place, format!("a length from 1 to {MAX_MESSAGE_BYTES}"), length)
        };
        Ok(match self {
            Self::U32 => Kind::U32,
            Self::U64 => Kind::U64,
            Self::F32 => Kind::F32,
            Self::F64 => Kind::F64,
            Self::Text(bytes) => {
                length(*bytes)?;
                Kind::Text(*bytes)
            }
            Self::PoseM => PoseM::kind(),
            Self::PosePx => PosePx::kind(),
            Self::Twist => Twist::kind(),
            Self::Array(element, count) => {
                length(*count)?;
                Kind::Array(Box::new(element.kind(place, parts)?), *count)
            }
            Self::Part(part) => {
                let placed = part.place(false)?;
                let name = leaked(format!("sketchnav_msgs/{}", part.name));
                let text = definitions::compose(docs(&part.doc), &placed.lines);
                parts.push(Definition { name, text });
                parts.extend(placed.parts);
                Kind::Struct(placed.layout)
            }
        })
    }
}

impl Row {
    /// Declares a channel with messages of this type for navigators of kind `kind`.
    ///
    /// # Errors
    /// [`DeclareError`] if the name is invalid, or a number is out of bounds.
    pub fn declare(
        &self,
        kind: &'static str,
        message: MessageType,
    ) -> Result<&'static ChannelSpec, DeclareError> {
        let name = &self.name;
        let is_name = name.starts_with(|c: char| c.is_ascii_lowercase())
            && name.len() <= 32
            && name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_');
        let place = format!("channel {name:?}");
        expect(is_name, &place, "a name of at most 32 letters such as walls_seen", format_args!("{name:?}"))?;
        expect((1..=8).contains(&self.per_tick), &place, "1 to 8 messages per tick", self.per_tick)?;
        expect(self.max_cells <= MAX_CELLS, &place, format!("at most {MAX_CELLS} cells"), self.max_cells)?;
        Ok(Box::leak(Box::new(ChannelSpec {
            name: leaked(name.clone()),
            writer: Some(self.writer),
            readers: Vec::leak(self.readers.clone()),
            role: self.role,
            kind: Some(kind),
            per_tick: self.per_tick,
            max_cells: self.max_cells,
            message,
        })))
    }
}

/// Returns the alignment that the compiler uses for a type, in bytes.
fn alignment(kind: &Kind) -> usize {
    match kind {
        Kind::U32 | Kind::F32 => 4,
        Kind::U64 | Kind::F64 => 8,
        Kind::Text(_) => 1,
        Kind::Array(element, _) => alignment(element),
        Kind::Struct(layout) => layout.fields.iter().map(|field| alignment(&field.kind)).max().unwrap_or(1),
    }
}

/// Returns a comment as the macro sees it: each line begins with the space after the slashes.
fn docs(doc: &[String]) -> &'static [&'static str] {
    let line = |line: &String| leaked(format!(" {}", line.trim()).trim_end().to_owned());
    Vec::leak(doc.iter().map(line).collect())
}

fn leaked(text: String) -> &'static str {
    String::leak(text)
}

#[cfg(test)]
mod tests;

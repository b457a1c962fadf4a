//! Structs and messages with a `.msg` defined by this project: what the macros generate for them, and the
//! implementations based on it.

use ros2_interfaces_jazzy_serde::std_msgs::msg::Header as HeaderForm;
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use super::definitions::{self, Definition, Line};
use super::parts::{expect, fill, header, header_form, list, no_cells};
use super::{Field, Ros2, Ros2Error};
use crate::codes::{Code, Value};
use crate::layout::Part;
use crate::message::Message;

/// How a field of type `T` is converted.
pub trait Way<T> {
    /// The field's form, or `()` if it has none.
    type Form: Default + Serialize + DeserializeOwned + Send + 'static;
    /// The values that the field takes, if it is the number of a code.
    const CONSTANTS: &'static [Value] = &[];

    /// Returns the field's type in the `.msg`, or `None` if it has no line there.
    fn msg() -> Option<String>;

    /// Returns the `.msg` texts of this project that the field needs.
    fn definitions() -> Vec<Definition> {
        Vec::new()
    }

    /// Converts `value` into its form, using the memory of `spare`. If `value` is a list, its first `count` entries are in
    /// use.
    ///
    /// # Errors
    /// [`Ros2Error`] if the form cannot express the value.
    fn to_form_in(
        value: &T,
        count: u32,
        field: &'static str,
        spare: Self::Form,
    ) -> Result<Self::Form, Ros2Error>;

    /// Sets `value`, which is zero, to the content of the form. If it is a list, sets `count` to the number of entries.
    ///
    /// # Errors
    /// [`Ros2Error`] if the form does not fit into the value.
    fn fill(value: &mut T, count: &mut u32, field: &'static str, form: &Self::Form) -> Result<(), Ros2Error>;
}

/// The field is converted according to its type.
#[derive(Debug)]
pub struct Itself;

impl<T: Field> Way<T> for Itself {
    type Form = T::Form;

    fn msg() -> Option<String> {
        Some(T::msg())
    }

    fn definitions() -> Vec<Definition> {
        T::definitions()
    }

    fn to_form_in(value: &T, _: u32, field: &'static str, spare: T::Form) -> Result<T::Form, Ros2Error> {
        value.to_form_in(field, spare)
    }

    fn fill(value: &mut T, _: &mut u32, _: &'static str, form: &T::Form) -> Result<(), Ros2Error> {
        *value = T::from_form(form)?;
        Ok(())
    }
}

/// The field is converted to a list of the entries in use.
#[derive(Debug)]
pub struct Counted;

impl<T: Field, const N: usize> Way<[T; N]> for Counted {
    type Form = Vec<T::Form>;

    fn msg() -> Option<String> {
        Some(format!("{}[]", T::msg()))
    }

    fn definitions() -> Vec<Definition> {
        T::definitions()
    }

    fn to_form_in(
        value: &[T; N],
        count: u32,
        field: &'static str,
        spare: Self::Form,
    ) -> Result<Self::Form, Ros2Error> {
        list(field, value, count, spare)
    }

    fn fill(
        value: &mut [T; N],
        count: &mut u32,
        field: &'static str,
        form: &Self::Form,
    ) -> Result<(), Ros2Error> {
        *count = fill(field, value, form)?;
        Ok(())
    }
}

/// The field is omitted, because another field's form implies it.
#[derive(Debug)]
pub struct Implied;

impl Way<u32> for Implied {
    type Form = ();

    fn msg() -> Option<String> {
        None
    }

    fn to_form_in(_: &u32, _: u32, _: &'static str, (): ()) -> Result<(), Ros2Error> {
        Ok(())
    }

    fn fill(_: &mut u32, _: &mut u32, _: &'static str, (): &()) -> Result<(), Ros2Error> {
        Ok(())
    }
}

/// Returns true if a field's form is empty, in which case it takes no bytes in CDR and no field in JSON.
pub fn is_implied<T>(_: &T) -> bool {
    size_of::<T>() == 0
}

/// The field is omitted, because it is always zero.
#[derive(Debug)]
pub struct Zero;

impl Way<u32> for Zero {
    type Form = ();

    fn msg() -> Option<String> {
        None
    }

    fn to_form_in(value: &u32, _: u32, field: &'static str, (): ()) -> Result<(), Ros2Error> {
        expect(*value == 0, field, "0", (*value).into())
    }

    fn fill(_: &mut u32, _: &mut u32, _: &'static str, (): &()) -> Result<(), Ros2Error> {
        Ok(())
    }
}

/// The field is converted to the number of a code.
impl<C: Code> Way<u32> for C {
    type Form = u32;
    const CONSTANTS: &'static [Value] = C::VALUES;

    fn msg() -> Option<String> {
        Some(u32::msg())
    }

    fn to_form_in(value: &u32, _: u32, _: &'static str, _: u32) -> Result<u32, Ros2Error> {
        Ok(*value)
    }

    fn fill(value: &mut u32, _: &mut u32, _: &'static str, form: &u32) -> Result<(), Ros2Error> {
        *value = *form;
        Ok(())
    }
}

/// A struct with its own `.msg`. The header of a message is not among these fields.
pub trait Own: Part {
    /// The forms of the fields, in order.
    type Form: Default + Serialize + DeserializeOwned + Send + 'static;
    /// ROS 2 name, `sketchnav_msgs/Type`.
    const NAME: &'static str;
    /// The struct's comment.
    const DOC: &'static [&'static str];

    /// Returns the fields in the `.msg`.
    fn lines() -> Vec<Line>;

    /// Returns the `.msg` texts of the structs inside this one.
    fn parts() -> Vec<Definition>;

    /// Converts the fields into their forms, using the memory of `spare`.
    ///
    /// # Errors
    /// [`Ros2Error`] if a form cannot express a field.
    fn to_form_in(&self, spare: Self::Form) -> Result<Self::Form, Ros2Error>;

    /// Sets the fields, which are zero, to the content of the form.
    ///
    /// # Errors
    /// [`Ros2Error`] if a form does not fit into its field.
    fn fill(&mut self, form: &Self::Form) -> Result<(), Ros2Error>;
}

/// A struct inside messages with its own `.msg`.
pub trait OwnPart: Own {}

impl<T: OwnPart> Field for T {
    type Form = <T as Own>::Form;

    fn msg() -> String {
        T::NAME.to_owned()
    }

    fn definitions() -> Vec<Definition> {
        let text = definitions::compose(T::DOC, &T::lines());
        [vec![Definition { name: T::NAME, text }], T::parts()].concat()
    }

    fn to_form_in(&self, _: &'static str, spare: Self::Form) -> Result<Self::Form, Ros2Error> {
        Own::to_form_in(self, spare)
    }

    fn from_form(form: &Self::Form) -> Result<Self, Ros2Error> {
        let mut value = T::zeroed();
        value.fill(form)?;
        Ok(value)
    }
}

/// A message with its own `.msg`.
pub trait OwnMessage: Own + Message {
    /// The form of the slice that follows the message, or `()` if there is none.
    type Slice: Slice;
    /// ROS 2 type, `sketchnav_msgs/msg/Type`.
    const TYPE: &'static str;
    /// The frame that the header names. Empty if no field is in a frame.
    const FRAME: &'static str;
    /// The name of the field with the slice. Empty if there is none.
    const SLICE: &'static str;
}

/// The form of the slice that follows a message.
pub trait Slice: Default + Serialize + DeserializeOwned + Send + 'static {
    /// Returns the type of the slice in the `.msg`, or `None` if it has no line there.
    fn msg() -> Option<String>;

    /// Stores `cells` in the memory of `self`.
    ///
    /// # Errors
    /// [`Ros2Error`] if there are cells but the message has no slice.
    fn holding(self, cells: &[u8]) -> Result<Self, Ros2Error>;

    /// Returns the slice.
    fn cells(self) -> Vec<u8>;
}

impl Slice for () {
    fn msg() -> Option<String> {
        None
    }

    fn holding(self, cells: &[u8]) -> Result<(), Ros2Error> {
        no_cells(cells)
    }

    fn cells(self) -> Vec<u8> {
        Vec::new()
    }
}

impl Slice for Vec<u8> {
    fn msg() -> Option<String> {
        Some("uint8[]".to_owned())
    }

    fn holding(mut self, cells: &[u8]) -> Result<Self, Ros2Error> {
        self.clear();
        self.extend_from_slice(cells);
        Ok(self)
    }

    fn cells(self) -> Vec<u8> {
        self
    }
}

/// The form of a message of `sketchnav_msgs`.
#[derive(Default, Serialize, Deserialize)]
pub struct Stamped<B, S> {
    header: HeaderForm,
    source_seq: u64,
    body: B,
    slice: S,
}

impl<T: OwnMessage> Ros2 for T {
    type Form = Stamped<<T as Own>::Form, T::Slice>;
    const TYPE: &'static str = T::TYPE;

    fn definitions() -> Vec<Definition> {
        [vec![Definition { name: <T as Own>::NAME, text: text::<T>() }], T::parts()].concat()
    }

    fn to_ros2_in(&self, cells: &[u8], spare: Self::Form) -> Result<Self::Form, Ros2Error> {
        Ok(Stamped {
            header: header_form(self.header(), T::FRAME, spare.header)?,
            source_seq: self.header().source_seq,
            body: self.to_form_in(spare.body)?,
            slice: spare.slice.holding(cells)?,
        })
    }

    fn from_ros2(form: Self::Form, seq: u64) -> Result<(Self, Vec<u8>), Ros2Error> {
        let mut message = T::zeroed();
        *message.header_mut() = header(&form.header, seq, form.source_seq)?;
        message.fill(&form.body)?;
        Ok((message, form.slice.cells()))
    }
}

fn text<T: OwnMessage>() -> String {
    let slice = Line { doc: SLICE_DOC, name: T::SLICE, kind: T::Slice::msg(), values: &[] };
    message_text(T::DOC, T::FRAME, T::lines(), slice)
}

/// The comment of the slice after a message.
pub(crate) const SLICE_DOC: &[&str] = &[" The slice after the message."];

/// Returns the `.msg` text of a message with the given fields: its comment with the frame, the header, the cause, the fields and
/// the slice.
pub(crate) fn message_text(doc: &[&str], frame: &str, fields: Vec<Line>, slice: Line) -> String {
    let frame = (!frame.is_empty()).then(|| format!(" Frame: {frame}."));
    let doc: Vec<_> = doc.iter().copied().chain(frame.as_deref()).collect();
    let line = |doc, name, kind| Line { doc, name, kind, values: &[] };
    let mut lines = vec![
        line(&[], "header", Some("std_msgs/Header".to_owned())),
        line(&[" Number of the message that caused this one."], "source_seq", Some(u64::msg())),
    ];
    lines.extend(fields);
    lines.push(slice);
    definitions::compose(&doc, &lines)
}

//! The ROS 2 form of every message, encoded as little-endian CDR after the four bytes of the encapsulation
//! header. Where a standard message type exists, it is used; all others are in `sketchnav_msgs`.
//!
//! A message is converted into its ROS 2 form and back into exactly the same bytes. A message that could not
//! be converted back is rejected with an error instead of being written. The form leaves out `header.seq`,
//! which is the sequence number of the recorded message, and the zeros beyond the counts.
//!
//! The forms of `sketchnav_msgs`, the conversions and the `.msg` texts are generated from the declarations of
//! the messages. A [`Field`] is converted according to its type, or in a [`Way`] that the declaration names.
//! Messages that are, or contain, standard ROS 2 messages are mapped by hand: those common to all navigators
//! in `standard.rs`, with the help of [`parts`].
//!
//! [`definitions`] contains the `.msg` texts, and [`transforms`] the transforms that viewers need in addition to the messages.
//! `derived` turns messages that are specific to this project into standard ones, such as a plan into a `nav_msgs/Path`, for
//! viewers that know only those.

pub mod definitions;
pub mod derived;
mod fields;
pub(crate) mod own;
pub mod parts;
pub mod shapes;
mod standard;
pub mod transforms;

pub use definitions::{Definition, Line};
pub use fields::{Field, pose};
pub use own::{Counted, Implied, Itself, Own, OwnMessage, OwnPart, Slice, Stamped, Way, Zero, is_implied};
pub use ros2_interfaces_jazzy_serde as forms;

use std::marker::PhantomData;

use byteorder::LittleEndian;
use cdr_encoding::CdrDeserializer;
use serde::{
    Serialize,
    de::{DeserializeOwned, DeserializeSeed},
};

use crate::message::Message;

/// The encapsulation header of little-endian CDR.
pub const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];
/// Tolerance for numbers that can only be 0 in this project's messages, such as the x and y of an
/// orientation.
pub const ROUNDING: f64 = 1e-9;
/// The expected value of such numbers, as used in errors.
pub const PLANAR: &str = "0, as in a planar pose without tilt or covariance";

/// A message with a ROS 2 form.
pub trait Ros2: Message {
    /// The form as a struct with the fields of the `.msg`, in the same order.
    type Form: Default + Serialize + DeserializeOwned + Send + 'static;
    /// ROS 2 type, `package/msg/Type`.
    const TYPE: &'static str;

    /// Converts the message into its ROS 2 form, reusing the memory of `spare`, which is the form of any earlier message or the
    /// default. Allocates only if the capacity of `spare` is too small. `cells` is the slice that follows the message, and is empty
    /// if the channel has none.
    ///
    /// # Errors
    /// [`Ros2Error`] if the message contains something that the form cannot express.
    fn to_ros2_in(&self, cells: &[u8], spare: Self::Form) -> Result<Self::Form, Ros2Error>;

    /// Like [`Ros2::to_ros2_in`], but allocates the memory of the form.
    ///
    /// # Errors
    /// [`Ros2Error`] if the message contains something that the form cannot express.
    fn to_ros2(&self, cells: &[u8]) -> Result<Self::Form, Ros2Error> {
        self.to_ros2_in(cells, Self::Form::default())
    }

    /// Converts the form into the message number `seq` and the slice that follows it.
    ///
    /// # Errors
    /// [`Ros2Error`] if the form contains something that the message cannot express.
    fn from_ros2(form: Self::Form, seq: u64) -> Result<(Self, Vec<u8>), Ros2Error>;

    /// Returns the `.msg` texts of this project that the form needs: those of the message and of the structs in it.
    fn definitions() -> Vec<Definition> {
        Vec::new()
    }

    /// Returns the `ros2msg` schema: the `.msg` text, followed by the texts that it depends on.
    fn schema() -> String {
        definitions::schema(Self::TYPE, &Self::definitions())
    }

    /// Appends the message in CDR to `out`, which should be empty because alignment is counted from its start.
    ///
    /// # Errors
    /// [`Ros2Error`] if decoding would not yield the same message. In that case, the content of `out` is
    /// unusable.
    fn to_cdr(&self, cells: &[u8], out: &mut Vec<u8>) -> Result<(), Ros2Error> {
        self.to_cdr_by(cells, &mut Self::Form::default(), out)
    }

    /// Like [`Ros2::to_cdr`], but reuses the memory of `form`. If `form` is that of an earlier message and the capacity of `out` is
    /// sufficient, nothing is allocated.
    ///
    /// # Errors
    /// Same errors as [`Ros2::to_cdr`].
    fn to_cdr_by(&self, cells: &[u8], form: &mut Self::Form, out: &mut Vec<u8>) -> Result<(), Ros2Error> {
        *form = self.to_ros2_in(cells, std::mem::take(form))?;
        encode(form, out)
    }

    /// Decodes message number `seq`, and the slice that follows it, from `bytes`. Allocates at most a few
    /// times the length of `bytes` plus the size of the message.
    ///
    /// # Errors
    /// [`Ros2Error::Rounded`] if `bytes` differ from what [`Ros2::to_cdr`] would have written only by
    /// rounding errors, or another [`Ros2Error`] if they differ in any other way.
    fn from_cdr(bytes: &[u8], seq: u64) -> Result<(Self, Vec<u8>), Ros2Error> {
        let (message, cells) = Self::from_ros2(decode::<Self::Form>(bytes)?, seq)?;
        let mut again = Vec::with_capacity(bytes.len());
        message.to_cdr(&cells, &mut again)?;
        expect_same(Self::TYPE, bytes, again)?;
        Ok((message, cells))
    }
}

/// Appends any ROS 2 form in CDR to `out`.
///
/// # Errors
/// [`Ros2Error::Cdr`], which never occurs with a valid form.
pub fn encode<F: Serialize>(form: &F, out: &mut Vec<u8>) -> Result<(), Ros2Error> {
    out.extend_from_slice(&ENCAPSULATION);
    cdr_encoding::to_writer::<F, LittleEndian, _>(&mut *out, form)?;
    Ok(())
}

/// Decodes any ROS 2 form from CDR.
///
/// # Errors
/// [`Ros2Error`] if the bytes are truncated, too many, or not little-endian CDR.
pub fn decode<F: DeserializeOwned>(bytes: &[u8]) -> Result<F, Ros2Error> {
    decode_by(PhantomData::<F>, bytes)
}

/// Like [`decode`], but `seed` reads the form.
pub(crate) fn decode_by<'a, S: DeserializeSeed<'a>>(seed: S, bytes: &'a [u8]) -> Result<S::Value, Ros2Error> {
    let found = bytes.get(..4).unwrap_or(bytes);
    if found != ENCAPSULATION {
        return Err(Ros2Error::Encapsulation { found: found.to_vec() });
    }
    let body = &bytes[4..];
    let mut deserializer = CdrDeserializer::<LittleEndian>::new(body);
    let form = seed.deserialize(&mut deserializer)?;
    let used = deserializer.bytes_consumed();
    if used == body.len() { Ok(form) } else { Err(Ros2Error::Surplus { bytes: body.len() - used }) }
}

/// Checks that `bytes` are `exact`, the encoding of the message that was decoded from them.
pub(crate) fn expect_same(kind: &'static str, bytes: &[u8], exact: Vec<u8>) -> Result<(), Ros2Error> {
    if bytes == exact { Ok(()) } else { Err(foreign(kind, bytes, exact)) }
}

/// Returns the error that describes where `bytes` differ from `exact`, the encoding of the message that was decoded from them.
fn foreign(kind: &'static str, bytes: &[u8], exact: Vec<u8>) -> Ros2Error {
    /// Alignment of the largest numbers, counted from the end of the encapsulation header.
    const ALIGNMENT: usize = size_of::<f64>();
    let (head, places) = (ENCAPSULATION.len(), exact[ENCAPSULATION.len()..].chunks(ALIGNMENT));
    let differs = |a: &[u8], b: &[u8]| a.iter().zip(b).position(|(a, b)| a != b);
    for (place, (found, exact)) in bytes[head..].chunks(ALIGNMENT).zip(places).enumerate() {
        let Some(within) = differs(found, exact) else { continue };
        let offset = head + place * ALIGNMENT;
        match <[u8; ALIGNMENT]>::try_from(found).map(f64::from_le_bytes) {
            Ok(number) if exact == [0; ALIGNMENT] && number.abs() <= ROUNDING => {}
            Ok(found) if exact == [0; ALIGNMENT] => return Ros2Error::NotZero { kind, offset, found },
            _ => return Ros2Error::Foreign { kind, offset: offset + within },
        }
    }
    match bytes.len() == exact.len() {
        true => Ros2Error::Rounded { kind, exact },
        false => Ros2Error::Foreign { kind, offset: bytes.len().min(exact.len()) },
    }
}

/// The reason why a message cannot be converted into its ROS 2 form, or a form into a message.
#[derive(Debug, thiserror::Error)]
pub enum Ros2Error {
    /// Not little-endian CDR.
    #[error("expected CDR in little endian, which begins with 00 01 00 00, found {found:02x?}")]
    Encapsulation {
        /// The first bytes.
        found: Vec<u8>,
    },
    /// The CDR is truncated, or a text in it is not UTF-8.
    #[error("not the CDR of the message: {0}")]
    Cdr(#[from] cdr_encoding::Error),
    /// The CDR continues after the end of the message.
    #[error("expected the end of the message, found {bytes} more bytes")]
    Surplus {
        /// The number of surplus bytes.
        bytes: usize,
    },
    /// A number that should be 0 is off by at most [`ROUNDING`], or is −0.
    #[error("{kind}: expected exactly {PLANAR}, found rounding errors")]
    Rounded {
        /// The ROS 2 type.
        kind: &'static str,
        /// The CDR of the same message with these numbers set to 0.
        exact: Vec<u8>,
    },
    /// A number that must be 0 in the message is not, for example because an orientation is tilted.
    #[error("{kind}: byte {offset}: expected {PLANAR}, found {found}")]
    NotZero {
        /// The ROS 2 type.
        kind: &'static str,
        /// Offset of the number from the start, in bytes.
        offset: usize,
        /// The number.
        found: f64,
    },
    /// The form contains something that the message cannot express, such as another frame or a text that is too long.
    #[error("{kind}: byte {offset}: expected a value that fits into a sketchnav message")]
    Foreign {
        /// The ROS 2 type.
        kind: &'static str,
        /// Offset from the start, in bytes.
        offset: usize,
    },
    /// An invalid value.
    #[error("{field}: expected {expected}, found {found}")]
    Value {
        /// The field.
        field: &'static str,
        /// What was expected.
        expected: &'static str,
        /// What was found.
        found: u64,
    },
    /// A text field that is not UTF-8, or continues after its end.
    #[error("{field}: expected UTF-8 and then zeros only")]
    Text {
        /// The field.
        field: &'static str,
    },
}

#[cfg(test)]
mod tests;

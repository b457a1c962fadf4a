//! Message types as values, for messages whose type is known only at run time.
//!
//! Code that treats all channels alike (the runtime, the recorder, a replay, `echo`) works with bytes and a
//! [`MessageType`]. A message consists of the bytes of its struct, aligned to eight, and may be followed by a
//! slice of bytes, called its cells.

use std::any::Any;
use std::marker::PhantomData;

use bytemuck::Pod;

use crate::layout::Layout;
use crate::message::{Header, Message, fingerprint};
use crate::ros2::{Ros2, Ros2Error};
use crate::valid::Invalid;

/// Alignment of every message in memory, in bytes.
pub const ALIGNMENT: usize = 8;

/// Size, names and operations of a message type.
#[derive(Clone, Copy)]
pub struct MessageType {
    /// Name of the struct.
    pub name: &'static str,
    /// Size of the struct, in bytes. A multiple of [`ALIGNMENT`].
    pub size: usize,
    /// ROS 2 type, `package/msg/Type`.
    pub ros2: &'static str,
    pub(crate) operations: &'static dyn Operations,
}

/// The operations of a message type, either compiled from a declaration in the source or interpreted from one
/// made at run time. [`MessageType`] describes each of them.
pub(crate) trait Operations: Sync {
    fn type_name(&self) -> String;
    fn schema(&self) -> String;
    fn layout(&self) -> Layout;
    fn check(&self, message: &[u8]) -> Result<(), Invalid>;
    fn spare(&self) -> Spare;
    fn encode(
        &self,
        message: &[u8],
        cells: &[u8],
        spare: &mut Spare,
        out: &mut Vec<u8>,
    ) -> Result<(), Ros2Error>;
    fn decode(&self, cdr: &[u8], seq: u64) -> Result<Owned, Ros2Error>;
    fn json(&self, message: &[u8], cells: &[u8]) -> Result<serde_json::Value, JsonError>;
}

/// The ROS 2 form of an earlier message, whose memory is reused for the next one. See [`MessageType::encode`].
pub type Spare = Box<dyn Any + Send>;

/// The reason why a message cannot be converted to JSON.
pub type JsonError = Box<dyn std::error::Error + Send + Sync>;

impl MessageType {
    /// Returns the description of the message type `T`.
    pub const fn of<T: Ros2>() -> Self {
        const { assert!(size_of::<T>().is_multiple_of(ALIGNMENT) && align_of::<T>() <= ALIGNMENT) };
        Self { name: T::NAME, size: size_of::<T>(), ros2: T::TYPE, operations: &Compiled::<T>(PhantomData) }
    }

    /// Returns the name, the version and a fingerprint of the layout. If two builds disagree about the type, its fingerprints
    /// differ.
    pub fn type_name(&self) -> String {
        self.operations.type_name()
    }

    /// Returns a fingerprint of [`MessageType::type_name`].
    pub fn fingerprint(&self) -> u64 {
        fingerprint(&self.type_name())
    }

    /// Returns the `ros2msg` schema: the `.msg` text and those of the types that it depends on.
    pub fn schema(&self) -> String {
        self.operations.schema()
    }

    /// Returns the memory layout of the type.
    pub fn layout(&self) -> Layout {
        self.operations.layout()
    }

    /// Checks the contents of `message`. See [`crate::valid`].
    ///
    /// # Errors
    /// [`Invalid`] with the first invalid field.
    ///
    /// # Panics
    /// Panics if `message` does not have the size and alignment of this type. The same is true of the other
    /// methods that take a message.
    pub fn check(&self, message: &[u8]) -> Result<(), Invalid> {
        self.operations.check(message)
    }

    /// Creates the spare memory that [`MessageType::encode`] needs.
    pub fn spare(&self) -> Spare {
        self.operations.spare()
    }

    /// Encodes the message as CDR and appends it to `out`. Does not allocate if `spare` and `out` have already been used for a
    /// message of the same length.
    ///
    /// # Errors
    /// [`Ros2Error`] if decoding would not yield the same message. In that case, the content of `out` is
    /// unusable.
    pub fn encode(
        &self,
        message: &[u8],
        cells: &[u8],
        spare: &mut Spare,
        out: &mut Vec<u8>,
    ) -> Result<(), Ros2Error> {
        self.operations.encode(message, cells, spare, out)
    }

    /// Decodes message number `seq` from its CDR.
    ///
    /// # Errors
    /// [`Ros2Error`] if `cdr` is not what [`MessageType::encode`] would have written.
    pub fn decode(&self, cdr: &[u8], seq: u64) -> Result<Owned, Ros2Error> {
        self.operations.decode(cdr, seq)
    }

    /// Converts the message into the JSON of its ROS 2 form.
    ///
    /// # Errors
    /// [`Ros2Error`] as from [`MessageType::encode`], or an error of the conversion into JSON.
    pub fn json(&self, message: &[u8], cells: &[u8]) -> Result<serde_json::Value, JsonError> {
        self.operations.json(message, cells)
    }
}

impl std::fmt::Debug for MessageType {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

/// The operations that were compiled for `T`.
struct Compiled<T>(PhantomData<fn() -> T>);

impl<T: Ros2> Operations for Compiled<T> {
    fn type_name(&self) -> String {
        T::type_name()
    }

    fn schema(&self) -> String {
        T::schema()
    }

    fn layout(&self) -> Layout {
        T::layout()
    }

    fn check(&self, message: &[u8]) -> Result<(), Invalid> {
        bytemuck::from_bytes::<T>(message).check()
    }

    fn spare(&self) -> Spare {
        Box::new(T::Form::default())
    }

    fn encode(
        &self,
        message: &[u8],
        cells: &[u8],
        spare: &mut Spare,
        out: &mut Vec<u8>,
    ) -> Result<(), Ros2Error> {
        let message: &T = bytemuck::from_bytes(message);
        match spare.downcast_mut::<T::Form>() {
            Some(form) => message.to_cdr_by(cells, form, out),
            None => message.to_cdr(cells, out),
        }
    }

    fn decode(&self, cdr: &[u8], seq: u64) -> Result<Owned, Ros2Error> {
        let (message, cells) = T::from_cdr(cdr, seq)?;
        Ok(Owned::new(&message, cells))
    }

    fn json(&self, message: &[u8], cells: &[u8]) -> Result<serde_json::Value, JsonError> {
        let message: &T = bytemuck::from_bytes(message);
        let mut form = serde_json::to_value(message.to_ros2(cells)?)?;
        if let Some(fields) = form.as_object_mut() {
            flatten(fields);
        }
        Ok(form)
    }
}

/// Flattens the form of one of our own messages, so that its JSON has the same fields as the `.msg`. If there is no slice, its
/// field is omitted.
fn flatten(form: &mut serde_json::Map<String, serde_json::Value>) {
    if let Some(serde_json::Value::Object(body)) = form.remove("body") {
        form.extend(body);
    }
    if let Some(slice) = form.remove("slice").filter(|slice| !slice.is_null()) {
        form.insert("data".to_owned(), slice);
    }
}

/// Returns the header at the start of a message.
///
/// # Panics
/// Panics if `message` is shorter than a header or not aligned.
pub fn header(message: &[u8]) -> &Header {
    bytemuck::from_bytes(&message[..size_of::<Header>()])
}

/// Returns the header at the start of a message, for modification. Panics like [`header`].
pub fn header_mut(message: &mut [u8]) -> &mut Header {
    bytemuck::from_bytes_mut(&mut message[..size_of::<Header>()])
}

/// An owned message with its cells.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Owned {
    words: Vec<u64>,
    cells: Vec<u8>,
}

impl Owned {
    /// Creates an owned copy of `message`.
    pub fn new<T: Message>(message: &T, cells: Vec<u8>) -> Self {
        let mut owned = Self { words: Vec::new(), cells };
        owned.words.resize(size_of::<T>() / ALIGNMENT, 0);
        bytemuck::cast_slice_mut(&mut owned.words).copy_from_slice(bytemuck::bytes_of(message));
        owned
    }

    /// Returns zeroed memory for a message of `size` bytes followed by `cells` bytes. Reuses the existing
    /// allocation.
    pub fn blank(&mut self, size: usize, cells: usize) -> (&mut [u8], &mut [u8]) {
        self.words.clear();
        self.words.resize(size / ALIGNMENT, 0);
        self.cells.clear();
        self.cells.resize(cells, 0);
        (bytemuck::cast_slice_mut(&mut self.words), &mut self.cells)
    }

    /// Replaces the slice that follows the message.
    pub(crate) fn set_cells(&mut self, cells: Vec<u8>) {
        self.cells = cells;
    }

    /// Returns the bytes of the message, without its cells.
    pub fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.words)
    }

    /// Returns the slice that follows the message.
    pub fn cells(&self) -> &[u8] {
        &self.cells
    }

    /// Returns the message as a `T`. Panics if `T` has another size.
    pub fn typed<T: Pod>(&self) -> &T {
        bytemuck::from_bytes(self.bytes())
    }
}

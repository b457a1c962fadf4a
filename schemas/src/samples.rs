//! Generates random valid messages, for testing code that carries messages. Not used in a running system. The module also
//! defines a kind of navigator for such tests, [`example`], and [`rejected`], which tests the checks of messages.
//!
//! A sample is random in every bit that a message does not determine. Its floats are arbitrary, including
//! infinities and NaN with any payload.

use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use crate::layout::{Field, Kind, Layout, Role};
use crate::message::{Header, Message};
use crate::ros2::Ros2;

/// Longest side of a sketch, in pixels.
const MAX_SIDE_PX: u32 = 40;
const LETTERS: &[char] = &['a', 'Z', '0', ' ', '→', 'ü', '点', '🤖'];

/// Returns a random valid message with the number `seq`, and the slice that follows it. The timestamp is `seq` tenths
/// of a second.
pub fn sample<T: Ros2>(random: &mut Pcg64Mcg, seq: u64) -> (T, Vec<u8>) {
    let mut message = T::zeroed();
    let layout = Layout::of::<T>();
    let bytes = bytemuck::bytes_of_mut(&mut message);
    random.fill(bytes);
    for field in &layout.fields {
        settle(&field.kind, &mut bytes[field.offset..field.offset + field.kind.size()], random);
    }
    let cells = settle_roles(&layout, bytes, random);
    let source_seq = if T::TYPE.starts_with("sketchnav") { random.random() } else { seq };
    *message.header_mut() = Header { seq, stamp_ns: seq * 100_000_000, source_seq };
    (message, cells)
}

/// Makes the values valid that do not depend on others, such as texts.
fn settle(kind: &Kind, bytes: &mut [u8], random: &mut Pcg64Mcg) {
    match kind {
        Kind::Text(_) => write_text(bytes, random),
        Kind::Array(element, _) => {
            bytes.chunks_exact_mut(element.size()).for_each(|part| settle(element, part, random));
        }
        Kind::Struct(layout) => {
            for field in &layout.fields {
                settle(&field.kind, &mut bytes[field.offset..field.offset + field.kind.size()], random);
            }
        }
        Kind::U32 | Kind::U64 | Kind::F32 | Kind::F64 => {}
    }
}

fn write_text(bytes: &mut [u8], random: &mut Pcg64Mcg) {
    bytes.fill(0);
    let mut end = 0;
    for _ in 0..random.random_range(0..=bytes.len()) {
        let letter = LETTERS[random.random_range(0..LETTERS.len())];
        if end + letter.len_utf8() <= bytes.len() {
            letter.encode_utf8(&mut bytes[end..]);
            end += letter.len_utf8();
        }
    }
}

/// Makes the values valid that depend on others: counts, sizes and zeros. Returns the slice that follows the message.
fn settle_roles(layout: &Layout, bytes: &mut [u8], random: &mut Pcg64Mcg) -> Vec<u8> {
    let place = |name: &str| layout.fields.iter().find(|f| f.name == name);
    for field in &layout.fields {
        match field.role {
            Role::Counted(count) => {
                let counted = cut_list(field, bytes, random);
                place(count).into_iter().for_each(|count| write_u32(bytes, count.offset, counted));
            }
            Role::Zero => write_u32(bytes, field.offset, 0),
            Role::Value | Role::Code(_) | Role::Count => {}
        }
    }
    let (Some(width), Some(height)) = (place("width_px"), place("height_px")) else { return Vec::new() };
    let sides = [random.random_range(0..=MAX_SIDE_PX), random.random_range(0..=MAX_SIDE_PX)];
    write_u32(bytes, width.offset, sides[0]);
    write_u32(bytes, height.offset, sides[1]);
    (0..sides[0] * sides[1]).map(|_| random.random()).collect()
}

/// Keeps a random number of entries of a list and zeroes the rest.
fn cut_list(list: &Field, bytes: &mut [u8], random: &mut Pcg64Mcg) -> u32 {
    let Kind::Array(element, capacity) = &list.kind else { return 0 };
    let counted = random.random_range(0..=*capacity);
    bytes[list.offset + counted * element.size()..list.offset + list.kind.size()].fill(0);
    counted as u32
}

fn write_u32(bytes: &mut [u8], offset: usize, value: u32) {
    bytes[offset..offset + 4].copy_from_slice(&value.to_ne_bytes());
}

/// A change that makes a message invalid.
pub type Spoil<T> = fn(&mut T);

/// Asserts that a message is valid, and that each of these changes makes it invalid.
///
/// # Panics
/// Panics if either is not the case.
pub fn rejected<T: Message>(valid: T, spoils: &[Spoil<T>]) {
    assert!(valid.is_valid());
    for (i, spoil) in spoils.iter().enumerate() {
        let mut spoilt = valid;
        spoil(&mut spoilt);
        assert!(!spoilt.is_valid(), "{} {i}", T::NAME);
    }
}

/// The channels of a kind of navigator that only exists for testing code that carries every navigator's
/// messages.
pub mod example {
    use crate::channels;
    use crate::declare::{channels, messages};

    /// The name of the kind.
    pub const KIND: &str = "example";

    messages! {
        /// An instruction with a slice after it.
        pub struct ExampleMap version 1 in "map" with data {
            /// A number.
            pub number: u64,
        }

        /// A situation.
        pub struct ExamplePlace version 1 in "map" {
            /// A position.
            pub at_m: [f64; 2],
        }

        /// A detail that nothing waits for.
        pub struct ExampleDetail version 1 in "map" {
            /// A number.
            pub number: u64,
        }
    }

    channels! {
        of KIND;
        /// An instruction.
        MAP: Instruction ExampleMap = "example_map", Sketcher => [Localizer, Planner, Pad], behind it up to 1 << 20;
        /// A detail.
        DETAIL: Detail ExampleDetail = "example_detail", Localizer => [Pad];
        /// A situation.
        PLACE: Situation ExamplePlace = "example_place", Localizer => [Planner, Pad];
    }

    /// Adds the channels of the kind to the table.
    ///
    /// # Panics
    /// Panics if another kind has channels with these names.
    pub fn register() {
        channels::register(KIND, CHANNELS).expect("names that no other kind has");
    }
}

//! The macros that declare messages. From one declaration, they generate the message in memory, its layout,
//! its ROS 2 form, the conversions in both directions, and the text of its `.msg` file.
//!
//! A navigator declares its own messages with [`messages!`](messages), [`parts!`](parts), [`codes!`](codes)
//! and [`channels!`](channels). Its crate must depend on `bytemuck` (with `derive`) and `serde` (with
//! `derive`). All other macros are internal.
//!
//! A field's form in ROS 2 is determined by its type, as described in [`crate::ros2::Field`]. Anything that the type cannot express
//! follows it, as described in [`crate::ros2::Way`]:
//!
//! - `state: u32 as TaskState` is the number of a [`crate::codes::Code`], the values of which become
//!   constants.
//! - `tasks: [RouteTask; 64] where task_count counts` is a list. It needs a field `task_count: u32 as Count`.
//! - `reserved: u32 as Zero` is not transmitted.

/// Declares a struct that is part of messages: its fields in memory and its layout.
#[doc(hidden)]
#[macro_export]
macro_rules! __layout {
    ($(#[doc = $doc:literal])* pub struct $name:ident { $(
        $(#[doc = $field_doc:literal])*
        pub $field:ident: $type:ty $(as $way:ident)? $(where $count:ident counts)?,
    )* }) => {
        $(#[doc = $doc])*
        #[repr(C)]
        #[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        pub struct $name { $($(#[doc = $field_doc])* pub $field: $type,)* }

        impl $name {
            /// One `field: type` per line, in order.
            pub const FIELDS: &'static str = concat!($(stringify!($field), ": ", stringify!($type), "\n",)*);

            /// Returns the memory layout of the struct.
            pub fn layout() -> $crate::layout::Layout {
                use $crate::{declare::role, layout::{Layout, Part, Role}};
                Layout::new(stringify!($name), Self::FIELDS, [
                    $((stringify!($field), <$type as Part>::kind(), role!($($way)? $(where $count)?)),)*
                ])
            }
        }

        impl $crate::layout::Part for $name {
            fn kind() -> $crate::layout::Kind {
                $crate::layout::Kind::Struct($name::layout())
            }
        }
    };
}

/// The role of a field, given the words after its type.
#[doc(hidden)]
#[macro_export]
macro_rules! __role {
    () => {
        Role::Value
    };
    (where $count:ident) => {
        Role::Counted(stringify!($count))
    };
    (Count) => {
        Role::Count
    };
    (Zero) => {
        Role::Zero
    };
    ($code:ident) => {
        Role::Code(<$code as $crate::codes::Code>::VALUES)
    };
}

/// The conversion of a field, given the words after its type.
#[doc(hidden)]
#[macro_export]
macro_rules! __way {
    () => {
        $crate::ros2::Itself
    };
    (where $count:ident) => {
        $crate::ros2::Counted
    };
    (Count) => {
        $crate::ros2::Implied
    };
    (Zero) => {
        $crate::ros2::Zero
    };
    ($code:ident) => {
        $code
    };
}

/// Expands to the second argument if there is one, otherwise to the first.
#[doc(hidden)]
#[macro_export]
macro_rules! __or {
    ($default:expr;) => {
        $default
    };
    ($default:expr; $given:expr) => {
        $given
    };
}

/// The form of the slice that follows a message.
#[doc(hidden)]
#[macro_export]
macro_rules! __slice {
    () => { () };
    ($slice:ident) => { Vec<u8> };
}

/// Generates the ROS 2 form of a struct, field by field.
#[doc(hidden)]
#[macro_export]
macro_rules! __own {
    ($(#[doc = $doc:literal])* $name:ident { $(
        $(#[doc = $field_doc:literal])*
        pub $field:ident: $type:ty $(as $way:ident)? $(where $count:ident counts)?,
    )* }) => {
        const _: () = {
            use $crate::declare::{or, way};
            use $crate::ros2::{Definition, Line, Own, Ros2Error, Way, is_implied};

            /// The form, with the same fields as the `.msg`.
            #[derive(Default, serde::Serialize, serde::Deserialize)]
            pub struct Form { $(
                #[serde(skip_serializing_if = "is_implied")]
                $field: <way!($($way)? $(where $count)?) as Way<$type>>::Form,
            )* }

            impl Own for $name {
                type Form = Form;
                const NAME: &'static str = concat!("sketchnav_msgs/", stringify!($name));
                const DOC: &'static [&'static str] = &[$($doc),*];

                fn lines() -> Vec<Line> {
                    vec![$(Line {
                        doc: &[$($field_doc),*],
                        name: stringify!($field),
                        kind: <way!($($way)? $(where $count)?) as Way<$type>>::msg(),
                        values: <way!($($way)? $(where $count)?) as Way<$type>>::CONSTANTS,
                    }),*]
                }

                fn parts() -> Vec<Definition> {
                    [$(<way!($($way)? $(where $count)?) as Way<$type>>::definitions()),*].concat()
                }

                fn to_form_in(&self, spare: Form) -> Result<Form, Ros2Error> {
                    Ok(Form { $($field: <way!($($way)? $(where $count)?) as Way<$type>>::to_form_in(
                        &self.$field,
                        or!(0; $(self.$count)?),
                        stringify!($field),
                        spare.$field,
                    )?,)* })
                }

                fn fill(&mut self, form: &Form) -> Result<(), Ros2Error> {
                    $(<way!($($way)? $(where $count)?) as Way<$type>>::fill(
                        &mut self.$field,
                        or!(&mut 0; $(&mut self.$count)?),
                        stringify!($field),
                        &form.$field,
                    )?;)*
                    Ok(())
                }
            }
        };
    };
}

/// Declares structs that are used inside messages and have their own `.msg`.
#[doc(hidden)]
#[macro_export]
macro_rules! __parts {
    ($($(#[doc = $doc:literal])* pub struct $name:ident $fields:tt)*) => {$(
        $crate::declare::layout! { $(#[doc = $doc])* pub struct $name $fields }
        $crate::declare::own! { $(#[doc = $doc])* $name $fields }
        impl $crate::ros2::OwnPart for $name {}
    )*};
}

/// Declares messages. A message with `in "frame"` has a generated `.msg`, and any other is mapped by hand. `with data` names the
/// field for the slice that follows the message, and `valid if check` names the function that checks the contents.
#[doc(hidden)]
#[macro_export]
macro_rules! __messages {
    ($(
        $(#[doc = $doc:literal])*
        pub struct $name:ident version $version:literal
            $(in $frame:literal)? $(with $slice:ident)? $(valid if $check:path)? { $($fields:tt)* }
    )*) => {$(
        $crate::declare::layout! { $(#[doc = $doc])* pub struct $name {
            /// Number, time and cause.
            pub header: $crate::message::Header,
            $($fields)*
        } }

        // SAFETY: the layout string is made from the tokens of the declaration itself.
        unsafe impl $crate::message::Message for $name {
            const NAME: &'static str = concat!("sketchnav/", stringify!($name), "/", $version);
            const LAYOUT: &'static str = $name::FIELDS;
            fn layout() -> $crate::layout::Layout { $name::layout() }
            fn check(&self) -> Result<(), $crate::valid::Invalid> {
                $crate::declare::or!(Ok(()); $($check(self))?)
            }
            fn header(&self) -> &$crate::message::Header { &self.header }
            fn header_mut(&mut self) -> &mut $crate::message::Header { &mut self.header }
        }

        $crate::declare::own_message! {
            [$($frame)?] [$($slice)?] $(#[doc = $doc])* $name { $($fields)* }
        }
    )*};
}

/// Generates the ROS 2 form of a message that is not mapped by hand.
#[doc(hidden)]
#[macro_export]
macro_rules! __own_message {
    ([] [] $(#[doc = $doc:literal])* $name:ident $fields:tt) => {};
    ([$frame:literal] [$($slice:ident)?] $(#[doc = $doc:literal])* $name:ident $fields:tt) => {
        $crate::declare::own! { $(#[doc = $doc])* $name $fields }

        impl $crate::ros2::OwnMessage for $name {
            type Slice = $crate::declare::slice!($($slice)?);
            const TYPE: &'static str = concat!("sketchnav_msgs/msg/", stringify!($name));
            const FRAME: &'static str = $frame;
            const SLICE: &'static str = concat!("", $(stringify!($slice))?);
        }
    };
}

/// Declares rows of the table of channels, either for one kind of navigator or for all of them.
#[doc(hidden)]
#[macro_export]
macro_rules! __channels {
    (of $kind:expr; $($rows:tt)*) => {
        $crate::declare::channels! { @of Some($kind); $($rows)* }
    };
    (@of $kind:expr;
        $($(#[$meta:meta])* $constant:ident: $role:ident $message:ty = $name:literal, $writer:ident => [$($reader:ident),*]
        $(, up to $per_tick:literal a tick)? $(, behind it up to $cells:expr)?;)*) => {
        $($(#[$meta])* pub const $constant: $crate::channels::Channel<$message> =
            $crate::channels::Channel::of(&$crate::channels::ChannelSpec {
                name: $name,
                writer: $crate::declare::writer!($writer),
                readers: &[$($crate::codes::Process::$reader),*],
                role: $crate::channels::Role::$role,
                kind: $kind,
                per_tick: $crate::declare::or!(1; $($per_tick)?),
                max_cells: $crate::declare::or!(0; $($cells)?),
                message: $crate::erased::MessageType::of::<$message>(),
            });)*

        /// The channels declared here, in the order in which their writers write them within an instant.
        pub const CHANNELS: &[&$crate::channels::ChannelSpec] = &[$($constant.spec),*];

        /// Visits each of the channels with its message type, and stops at the first error.
        ///
        /// # Errors
        /// The visitor's error.
        pub fn visit<V: $crate::channels::ChannelVisitor>(visitor: &mut V) -> Result<(), V::Error> {
            $(visitor.visit($constant)?;)*
            Ok(())
        }
    };
    ($($rows:tt)*) => {
        $crate::declare::channels! { @of None; $($rows)* }
    };
}

/// The writer of a channel.
#[doc(hidden)]
#[macro_export]
macro_rules! __writer {
    (every) => {
        None
    };
    ($process:ident) => {
        Some($crate::codes::Process::$process)
    };
}

/// Declares enumerations whose values are the numbers stored in fields.
#[doc(hidden)]
#[macro_export]
macro_rules! __codes {
    ($($(#[$meta:meta])* pub enum $name:ident { $($(#[doc = $doc:literal])* $variant:ident = $value:literal $text:literal,)* })*) => {$(
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(u32)]
        pub enum $name { $($(#[doc = $doc])* $variant = $value,)* }

        impl $crate::codes::Code for $name {
            const VALUES: &'static [$crate::codes::Value] = &[$(
                $crate::codes::Value { name: stringify!($variant), code: $value, doc: concat!($($doc),*) },
            )*];
        }

        impl $name {
            /// Every value, in order.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// Returns the number in the message.
            pub const fn code(self) -> u32 { self as u32 }

            /// Returns the value with the given number, or `None` if there is none.
            pub fn from_code(code: u32) -> Option<Self> {
                Self::ALL.iter().copied().find(|v| v.code() == code)
            }

            /// Returns the name of this value, as used in files and in output.
            pub const fn word(self) -> &'static str {
                match self { $(Self::$variant => $text,)* }
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result { f.write_str(self.word()) }
        }

        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_str(self.word())
            }
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let word = String::deserialize(deserializer)?;
                word.parse().map_err(serde::de::Error::custom)
            }
        }

        impl std::str::FromStr for $name {
            type Err = String;
            fn from_str(word: &str) -> Result<Self, String> {
                Self::ALL.iter().copied().find(|v| v.word() == word).ok_or_else(|| {
                    let known: Vec<_> = Self::ALL.iter().map(|v| v.word()).collect();
                    format!("expected one of {}, found {word:?}", known.join(", "))
                })
            }
        }
    )*};
}

pub use {
    __channels as channels, __codes as codes, __layout as layout, __messages as messages, __or as or,
    __own as own, __own_message as own_message, __parts as parts, __role as role, __slice as slice,
    __way as way, __writer as writer,
};

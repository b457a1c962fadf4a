//! A message as iceoryx2 sees it.

use std::any::TypeId;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use bytemuck::Zeroable;
use iceoryx2::prelude::ZeroCopySend;
use sketchnav_schemas::message::Message;

/// A message of the schemas, which know no iceoryx2.
#[repr(transparent)]
#[derive(Clone, Copy)]
pub(crate) struct Wire<T>(pub(crate) T);

// SAFETY: a message is plain old data of fixed layout without pointers, `#[repr(C)]`, and this wrapper
// is transparent. The name has a fingerprint of the layout.
unsafe impl<T: Message> ZeroCopySend for Wire<T> {
    unsafe fn type_name() -> &'static str {
        type_name::<T>()
    }
}

impl<T: Message> Default for Wire<T> {
    fn default() -> Self {
        Self(T::zeroed())
    }
}

impl<T: Message> std::fmt::Debug for Wire<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {:?}", T::NAME, self.0.header())
    }
}

// SAFETY: a transparent wrapper of a zeroable type.
unsafe impl<T: Message> Zeroable for Wire<T> {}

/// The message's type name, made once for each type.
pub(crate) fn type_name<T: Message>() -> &'static str {
    static NAMES: Mutex<BTreeMap<TypeId, &'static str>> = Mutex::new(BTreeMap::new());
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    names.entry(TypeId::of::<T>()).or_insert_with(|| T::type_name().leak())
}

//! Generates the C++ header `cpp/sketchnav.hpp`, which contains the layouts of all messages.
//!
//! A structure has the same bytes as the message, as `static_assert`s verify. The values of codes become
//! constants of the structure.

use std::collections::BTreeSet;
use std::fmt::Write;

use crate::channels;
use crate::layout::{Field, Kind, Layout, Role};
use crate::ros2::definitions::constant;

const OPENING: &str = "\
// The layout of each message. Generated from the layout table (schemas/src/cpp.rs); not to be edited.
//
// A channel's service carries the attribute \"message\" with the type's name and the fingerprint of its layout: compare it
// with `type` before reading. A message is a slice of eight-byte words; its cells follow the structure.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace sketchnav {
";

/// Returns the text of the header.
pub fn header() -> String {
    let mut text = String::from(OPENING);
    let mut known = BTreeSet::new();
    for spec in channels::all() {
        structure(&spec.message.layout(), &mut known, &mut text);
    }
    text.push_str(
        "\n/// A channel: its messages, and whether several processes write it.\nstruct Channel {\n",
    );
    text.push_str(
        "    const char* name;\n    const char* type;\n    std::size_t size;\n    bool many_writers;\n};\n",
    );
    let count = channels::all().count();
    let _ = writeln!(text, "\ninline constexpr std::array<Channel, {count}> CHANNELS{{{{");
    for spec in channels::all() {
        let (name, kind) = (spec.name, spec.message.type_name());
        let _ = writeln!(
            text,
            "    {{{name:?}, {kind:?}, sizeof({}), {}}},",
            spec.message.layout().name,
            spec.writer.is_none()
        );
    }
    text.push_str("}};\n\n}  // namespace sketchnav\n");
    text
}

/// Writes a structure, after the structures that it contains, and the assertions about its size. Each structure is written
/// once.
fn structure(layout: &Layout, known: &mut BTreeSet<&'static str>, text: &mut String) {
    if known.contains(layout.name) {
        return;
    }
    for part in layout.fields.iter().filter_map(|field| field.kind.layout()) {
        structure(part, known, text);
    }
    known.insert(layout.name);
    let name = layout.name;
    let _ = writeln!(text, "\nstruct {name} {{");
    for field in &layout.fields {
        codes(field, text);
        let (kind, shape) = declared(&field.kind);
        let _ = writeln!(text, "    {kind} {}{shape};", field.name);
    }
    text.push_str("};\n");
    let _ = writeln!(
        text,
        "static_assert(std::is_trivially_copyable_v<{name}> && sizeof({name}) == {});",
        layout.size()
    );
    for Field { name: field, offset, .. } in &layout.fields {
        let _ = writeln!(text, "static_assert(offsetof({name}, {field}) == {offset});");
    }
}

/// Writes the values that a field can have as constants next to it.
fn codes(field: &Field, text: &mut String) {
    let Role::Code(values) = field.role else { return };
    for value in values {
        let prefix = constant(value.name);
        let name = format!("{}_{prefix}", field.name.to_uppercase());
        let _ = writeln!(text, "    static constexpr std::uint32_t {name} = {};", value.code);
    }
}

/// Returns the C++ type of an element and the array dimensions that follow the field's name.
fn declared(kind: &Kind) -> (String, String) {
    match kind {
        Kind::U32 => ("std::uint32_t".to_owned(), String::new()),
        Kind::U64 => ("std::uint64_t".to_owned(), String::new()),
        Kind::F32 => ("float".to_owned(), String::new()),
        Kind::F64 => ("double".to_owned(), String::new()),
        Kind::Text(bytes) => ("char".to_owned(), format!("[{bytes}]")),
        Kind::Struct(layout) => (layout.name.to_owned(), String::new()),
        Kind::Array(element, count) => {
            let (kind, shape) = declared(element);
            (kind, format!("[{count}]{shape}"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_channel_and_structure_is_generated_once() {
        let text = header();
        for spec in channels::all() {
            assert_eq!(text.matches(&format!("    {{{:?}, ", spec.name)).count(), 1, "{}", spec.name);
            let definition = format!("\nstruct {} {{\n", spec.message.layout().name);
            assert_eq!(text.matches(&definition).count(), 1, "{definition}");
        }
    }
}

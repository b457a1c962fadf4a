//! Generates the layouts of all channels as a Python module, the content of `python/sketchnav/_layouts.py`.
//!
//! Each message becomes a NumPy structure with the same bytes, so that Python can read shared memory directly, without copying.

use std::collections::BTreeSet;
use std::fmt::Write;

use crate::channels;
use crate::codes::Process;
use crate::layout::{Kind, Layout};

/// Returns the text of the module.
pub fn layouts() -> String {
    let mut text = String::from(
        "\"\"\"The layout of each message. Generated from the layout table (schemas/src/python.rs); not to be edited.\"\"\"\n\n\
         import numpy as np\n",
    );
    let mut known = BTreeSet::new();
    for spec in channels::all() {
        structure(&spec.message.layout(), &mut known, &mut text);
    }
    text.push_str("\n# Channel: type with the fingerprint of its layout, structure, whether several processes write it, the pipeline's readers.\n");
    text.push_str("CHANNELS = {\n");
    for spec in channels::all() {
        let (layout, many) = (spec.message.layout(), if spec.writer.is_none() { "True" } else { "False" });
        // The recorder reads every channel in order to record it.
        let readers = spec.readers.iter().copied().chain([Process::Recorder]);
        let readers: Vec<_> = readers.map(|process| format!("{:?}", process.word())).collect();
        let _ = writeln!(
            text,
            "    {:?}: ({:?}, {}, {many}, ({},)),",
            spec.name,
            spec.message.type_name(),
            layout.name,
            readers.join(", ")
        );
    }
    text.push_str("}\n");
    text
}

/// Writes a structure, after the structures that it contains. Each structure is written once.
fn structure(layout: &Layout, known: &mut BTreeSet<&'static str>, text: &mut String) {
    if known.contains(layout.name) {
        return;
    }
    for field in &layout.fields {
        if let Some(part) = field.kind.layout() {
            structure(part, known, text);
        }
    }
    known.insert(layout.name);
    let _ = writeln!(text, "\n{} = np.dtype(\n    [", layout.name);
    for field in &layout.fields {
        let (kind, shape) = numpy(&field.kind);
        let shape = if shape.is_empty() { String::new() } else { format!(", ({},)", join(&shape)) };
        let _ = writeln!(text, "        ({:?}, {kind}{shape}),", field.name);
    }
    text.push_str("    ]\n)\n");
}

/// Returns the NumPy type of an element and the length of each array dimension.
fn numpy(kind: &Kind) -> (String, Vec<usize>) {
    match kind {
        Kind::U32 => ("\"<u4\"".to_owned(), Vec::new()),
        Kind::U64 => ("\"<u8\"".to_owned(), Vec::new()),
        Kind::F32 => ("\"<f4\"".to_owned(), Vec::new()),
        Kind::F64 => ("\"<f8\"".to_owned(), Vec::new()),
        Kind::Text(bytes) => (format!("\"S{bytes}\""), Vec::new()),
        Kind::Struct(layout) => (layout.name.to_owned(), Vec::new()),
        Kind::Array(element, count) => {
            let (kind, mut shape) = numpy(element);
            shape.insert(0, *count);
            (kind, shape)
        }
    }
}

fn join(shape: &[usize]) -> String {
    shape.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_channel_and_structure_is_generated_once() {
        let text = layouts();
        for spec in channels::all() {
            assert_eq!(text.matches(&format!("    {:?}: (", spec.name)).count(), 1, "{}", spec.name);
            let definition = format!("\n{} = np.dtype(", spec.message.layout().name);
            assert_eq!(text.matches(&definition).count(), 1, "{definition}");
        }
    }
}

//! Holds the layout of every message still: processes of two builds, recordings and readers in other
//! languages rely on it. On purpose: raise the message's version, then
//! `SKETCHNAV_UPDATE_GOLDEN=1 cargo test -p sketchnav-schemas --test layouts`.

use std::fmt::Write;
use std::path::Path;

use sketchnav_schemas::channels::{self, Channel, ChannelVisitor};
use sketchnav_schemas::layout::{Layout, PARTS};
use sketchnav_schemas::ros2::Ros2;

#[derive(Default)]
struct Layouts(String);

impl Layouts {
    fn fields(&mut self, layout: &Layout) -> std::fmt::Result {
        for field in &layout.fields {
            writeln!(self.0, "{:8}  {}: {}", field.offset, field.name, field.declared)?;
        }
        writeln!(self.0)
    }
}

impl ChannelVisitor for Layouts {
    type Error = std::fmt::Error;

    fn fixed<T: Ros2>(&mut self, channel: Channel<T>) -> std::fmt::Result {
        writeln!(self.0, "{} on channel {}, ROS 2 {}", T::type_name(), channel.spec.name, T::TYPE)?;
        writeln!(self.0, "size {} align {}", size_of::<T>(), align_of::<T>())?;
        self.fields(&Layout::of::<T>())
    }

    fn sliced<T: Ros2>(&mut self, channel: Channel<T>) -> std::fmt::Result {
        self.fixed(channel)
    }
}

fn layouts() -> String {
    let mut text = Layouts::default();
    for (name, declaration) in PARTS {
        let layout = Layout::parse(declaration).expect("a part that is made of parts");
        writeln!(text.0, "{name}\nsize {}", layout.size()).expect("writing to a string");
        text.fields(&layout).expect("writing to a string");
    }
    channels::visit(&mut text).expect("writing to a string");
    text.0
}

#[test]
fn layouts_are_those_of_the_golden_file() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/layouts.golden.txt");
    let found = layouts();
    if std::env::var_os("SKETCHNAV_UPDATE_GOLDEN").is_some() {
        std::fs::write(&path, &found).expect("the golden file can be written");
    }
    let expected = std::fs::read_to_string(&path).unwrap_or_default();
    let first = found.lines().zip(expected.lines()).find(|(found, expected)| found != expected);
    assert!(
        found == expected,
        "a message's layout changed; first difference (now, golden): {first:?}.\n\
         If that is meant: raise the message's version in message.rs, then run\n\
         SKETCHNAV_UPDATE_GOLDEN=1 cargo test -p sketchnav-schemas --test layouts"
    );
}

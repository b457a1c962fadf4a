//! Every message that the macros declare with its own `.msg`, declared once more at run time from its layout and its schema: the
//! fingerprint, the layout, the schema, the bytes in CDR and the JSON are the same.

use std::convert::Infallible;

use proptest::prelude::*;
use sketchnav_schemas::channels::{Channel, ChannelVisitor};
use sketchnav_schemas::declared::{Declaration, Field, Struct, Type, Way};
use sketchnav_schemas::erased::{MessageType, Owned};
use sketchnav_schemas::layout::{self, Kind, Layout, Role};
use sketchnav_schemas::ros2::Ros2;
use sketchnav_schemas::samples::sample;
use sketchnav_schemas::seed::stream;

const PACKAGE: &str = "sketchnav_msgs/";

/// The comments of a `.msg` text.
#[derive(Default)]
struct Comments {
    own: Vec<String>,
    of_fields: Vec<(String, Vec<String>)>,
}

impl Comments {
    /// Returns the comments of the text of `name` in a schema.
    fn of(name: &str, schema: &str) -> Self {
        let mut texts = schema.split("=\nMSG: ");
        let own = texts.next().unwrap_or_default();
        let named = texts.find_map(|text| text.strip_prefix(PACKAGE)?.strip_prefix(name)?.strip_prefix('\n'));
        let text = named.unwrap_or(own);
        let (head, body) = text
            .split_once("\n\n")
            .unwrap_or_else(|| panic!("{name}: expected a comment, then fields: {text}"));
        let comment = |line: &str| line.strip_prefix('#').map(|line| line.trim().to_owned());
        let mut comments = Self { own: head.lines().filter_map(comment).collect(), of_fields: Vec::new() };
        let mut doc = Vec::new();
        for line in body.lines() {
            match (comment(line), line.split_whitespace().nth(1)) {
                (Some(line), _) => doc.push(line),
                (None, Some(field)) => comments.of_fields.push((field.to_owned(), std::mem::take(&mut doc))),
                (None, None) => {}
            }
        }
        comments
    }

    fn field(&self, name: &str) -> Vec<String> {
        self.of_fields.iter().find(|(field, _)| field == name).map(|(_, doc)| doc.clone()).unwrap_or_default()
    }
}

fn kind(kind: &Kind, schema: &str) -> Type {
    match kind {
        Kind::U32 => Type::U32,
        Kind::U64 => Type::U64,
        Kind::F32 => Type::F32,
        Kind::F64 => Type::F64,
        Kind::Text(bytes) => Type::Text(*bytes),
        Kind::Array(element, length) => Type::Array(Box::new(self::kind(element, schema)), *length),
        Kind::Struct(layout) => match layout.name {
            "PoseM" => Type::PoseM,
            "PosePx" => Type::PosePx,
            "Twist" => Type::Twist,
            _ => Type::Part(body(layout, &layout.fields, schema)),
        },
    }
}

fn body(layout: &Layout, fields: &[layout::Field], schema: &str) -> Struct {
    let comments = Comments::of(layout.name, schema);
    let field = |field: &layout::Field| Field {
        name: field.name.to_owned(),
        doc: comments.field(field.name),
        kind: kind(&field.kind, schema),
        way: match field.role {
            Role::Value => Way::Itself,
            Role::Count => Way::Count,
            Role::Zero => Way::Zero,
            Role::Counted(count) => Way::Counted(count.to_owned()),
            Role::Code(values) => {
                let value = |value: &sketchnav_schemas::codes::Value| {
                    (value.name.to_owned(), value.code, value.doc.to_owned())
                };
                Way::Code(values.iter().map(value).collect())
            }
        },
    };
    Struct {
        name: layout.name.to_owned(),
        doc: comments.own.clone(),
        fields: fields.iter().map(field).collect(),
    }
}

/// Begins the fields of a `.msg` that is generated, unlike those of messages that are mapped by hand.
const GENERATED: &str = "\n\nstd_msgs/Header header\n# Number of the message that caused this one.\n";

/// Declares the message of `T` at run time, or returns `None` if it is mapped by hand.
fn declared<T: Ros2>() -> Option<MessageType> {
    let (layout, schema) = (T::layout(), T::schema());
    if !schema.contains(GENERATED) {
        return None;
    }
    let mut body = body(&layout, &layout.fields[1..], &schema);
    let frame = body.doc.pop_if(|line| line.starts_with("Frame: "));
    let frame =
        frame.map_or_else(String::new, |line| line["Frame: ".len()..].trim_end_matches('.').to_owned());
    let version = T::NAME.rsplit('/').next().and_then(|version| version.parse().ok()).expect("a version");
    let has_slice = schema.contains("\nuint8[] data\n");
    Some(Declaration { body, version, frame, has_slice }.declare().unwrap_or_else(|error| panic!("{error}")))
}

struct Same(u64, usize);

impl ChannelVisitor for Same {
    type Error = Infallible;
    fn visit<T: Ros2>(&mut self, channel: Channel<T>) -> Result<(), Infallible> {
        let (compiled, Some(declared)) = (channel.spec.message, declared::<T>()) else { return Ok(()) };
        assert_eq!(declared.schema(), compiled.schema());
        assert_eq!(declared.layout().expanded(), compiled.layout().expanded());
        assert_eq!(declared.type_name(), compiled.type_name());
        assert_eq!(declared.layout(), compiled.layout());
        let seq = 1 + self.0 % 1_000_000;
        let (message, cells) = sample::<T>(&mut stream(self.0, T::NAME), seq);
        let bytes = bytemuck::bytes_of(&message);
        let cdr = |type_: &MessageType| {
            let mut out = Vec::new();
            type_.encode(bytes, &cells, &mut type_.spare(), &mut out).map(|()| out)
        };
        let written = cdr(&compiled).unwrap();
        assert!(cdr(&declared).unwrap() == written, "{}: other bytes", T::NAME);
        assert!(
            declared.decode(&written, seq).unwrap() == Owned::new(&message, cells.clone()),
            "{}",
            T::NAME
        );
        assert_eq!(
            declared.json(bytes, &cells).unwrap(),
            compiled.json(bytes, &cells).unwrap(),
            "{}",
            T::NAME
        );
        self.1 += 1;
        Ok(())
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn every_message_of_its_own_is_the_same_when_declared_at_run_time(seed: u64) {
        let mut same = Same(seed, 0);
        let Ok(()) = sketchnav_navigators::visit(&mut same);
        prop_assert!(same.1 >= 20, "only {} messages", same.1);
    }
}

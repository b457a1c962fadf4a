use super::*;
use crate::codes::{Code, TaskState};
use crate::declare::{messages, parts};
use crate::erased::Owned;
use crate::message::{Message, Text};
use crate::ros2::Ros2;

parts! {
    /// A wall.
    pub struct DeclaredWall {
        /// Where it begins.
        pub from_m: [f64; 2],
        /// How sure it is.
        pub certainty: f32,
        /// Number of points on it.
        pub points: u32,
    }
}

messages! {
    /// What a robot makes of a room. See [`crate::message::Header`].
    pub struct DeclaredRoom version 3 in "map" with data {
        /// Where the robot is.
        pub pose: PoseM,
        /// Its velocity.
        pub twist: Twist,
        /// A square matrix.
        pub covariance: [f64; 9],
        /// The walls.
        pub walls: [DeclaredWall; 4] where wall_count counts,
        /// Number of entries of `walls` in use.
        pub wall_count: u32 as Count,
        /// The state of the task.
        pub state: u32 as TaskState,
        /// The name of the room.
        pub name: Text<24>,
        /// A corner.
        pub corner_m: [f32; 2],
        /// A share.
        pub share: f32,
        /// Zero.
        pub reserved: u32 as Zero,
    }
}

fn field(name: &str, doc: &str, kind: Type, way: Way) -> Field {
    let doc = if doc.is_empty() { Vec::new() } else { vec![doc.to_owned()] };
    Field { name: name.to_owned(), doc, kind, way }
}

fn array(element: Type, length: usize) -> Type {
    Type::Array(Box::new(element), length)
}

fn room() -> Declaration {
    let wall = Struct {
        name: "DeclaredWall".to_owned(),
        doc: vec!["A wall.".to_owned()],
        fields: vec![
            field("from_m", "Where it begins.", array(Type::F64, 2), Way::Itself),
            field("certainty", "How sure it is.", Type::F32, Way::Itself),
            field("points", "Number of points on it.", Type::U32, Way::Itself),
        ],
    };
    let values = TaskState::VALUES.iter().map(|value| (value.name.into(), value.code, value.doc.into()));
    let body = Struct {
        name: "DeclaredRoom".to_owned(),
        doc: vec!["What a robot makes of a room. See [`crate::message::Header`].".to_owned()],
        fields: vec![
            field("pose", "Where the robot is.", Type::PoseM, Way::Itself),
            field("twist", "Its velocity.", Type::Twist, Way::Itself),
            field("covariance", "A square matrix.", array(Type::F64, 9), Way::Itself),
            field("walls", "The walls.", array(Type::Part(wall), 4), Way::Counted("wall_count".into())),
            field("wall_count", "", Type::U32, Way::Count),
            field("state", "The state of the task.", Type::U32, Way::Code(values.collect())),
            field("name", "The name of the room.", Type::Text(24), Way::Itself),
            field("corner_m", "A corner.", array(Type::F32, 2), Way::Itself),
            field("share", "A share.", Type::F32, Way::Itself),
            field("reserved", "", Type::U32, Way::Zero),
        ],
    };
    Declaration { body, version: 3, frame: "map".to_owned(), has_slice: true }
}

#[test]
fn what_is_declared_at_run_time_is_what_the_macro_declares() {
    let (declared, compiled) = (room().declare().unwrap(), MessageType::of::<DeclaredRoom>());
    assert_eq!(declared.type_name(), DeclaredRoom::type_name());
    assert_eq!((declared.name, declared.size, declared.ros2), (compiled.name, compiled.size, compiled.ros2));
    assert_eq!(declared.layout(), DeclaredRoom::layout());
    assert_eq!(declared.schema(), DeclaredRoom::schema());
}

#[test]
fn a_fingerprint_changes_with_a_field_but_not_with_a_comment() {
    let name = room().declare().unwrap().type_name();
    let mut other = room();
    other.body.fields[0].doc.clear();
    assert_eq!(other.declare().unwrap().type_name(), name);
    other.body.fields[8].name = "part".to_owned();
    assert_ne!(other.declare().unwrap().type_name(), name);
}

#[test]
fn what_would_not_come_back_is_rejected() {
    let room = room().declare().unwrap();
    let layout = room.layout();
    let offset = |name: &str| layout.fields.iter().find(|field| field.name == name).unwrap().offset;
    let refusal = |name: &str, inside: usize, byte: u8| {
        let mut owned = Owned::default();
        let (message, _) = owned.blank(room.size, 0);
        crate::erased::header_mut(message).seq = 1;
        message[offset(name) + inside] = byte;
        room.encode(message, &[], &mut room.spare(), &mut Vec::new()).map_err(|error| error.to_string())
    };
    assert_eq!(refusal("share", 0, 1), Ok(()));
    let rejected = [
        (refusal("reserved", 0, 1), "reserved: expected 0, found 1"),
        (refusal("wall_count", 0, 5), "walls: expected a count within the capacity, found 5"),
        (refusal("walls", 25, 1), "walls: expected only zeros beyond the count, found 1"),
        (refusal("name", 3, b'x'), "name: expected UTF-8 and then zeros only"),
        (refusal("name", 0, 0xff), "name: expected UTF-8 and then zeros only"),
    ];
    for (found, expected) in rejected {
        assert_eq!(found, Err(expected.to_owned()));
    }
}

#[test]
fn a_list_that_claims_more_than_it_can_hold_ends_at_its_capacity() {
    let room = room().declare().unwrap();
    let mut owned = Owned::default();
    let (message, _) = owned.blank(room.size, 0);
    crate::erased::header_mut(message).seq = 1;
    let mut cdr = Vec::new();
    room.encode(message, &[7; 3], &mut room.spare(), &mut cdr).unwrap();
    assert_eq!(room.decode(&cdr, 1).unwrap().cells(), [7; 3]);
    let length = cdr.windows(4).rposition(|four| four == [3, 0, 0, 0]).unwrap();
    cdr[length..length + 4].fill(0xff);
    assert!(matches!(room.decode(&cdr, 1), Err(crate::ros2::Ros2Error::Cdr(_))));
}

/// A change that makes a declaration invalid.
type Spoil = fn(&mut Declaration);

#[test]
fn what_the_compiler_would_refuse_is_refused_with_the_place() {
    let spoils: [(Spoil, &str); 14] = [
        (|it| it.body.name = "walls".into(), "walls: expected a name such as WalkingPerson, found \"walls\""),
        (|it| it.body.name = "PoseM".into(), "PoseM: expected a name that no common type has, found PoseM"),
        (
            |it| it.frame = "a b".into(),
            "DeclaredRoom: expected a frame of letters, digits, _ and /, found \"a b\"",
        ),
        (
            |it| it.body.fields[1].name = "Twist".into(),
            "DeclaredRoom.Twist: expected a name such as range_max_m, found \"Twist\"",
        ),
        (
            |it| it.body.fields[1].name = "pose".into(),
            "DeclaredRoom.pose: expected a name that no other field has, found pose",
        ),
        (
            |it| it.body.fields[1].name = "header".into(),
            "DeclaredRoom.header: expected a name that no other field has, found header",
        ),
        (
            |it| it.body.fields[1].name = "data".into(),
            "DeclaredRoom: expected another name than that of the slice after the message, found data",
        ),
        (
            |it| drop(it.body.fields.remove(5)),
            "DeclaredRoom: expected a size that is a multiple of 8 bytes, padded with a u32 that is always zero, found 292",
        ),
        (
            |it| it.body.fields.swap(0, 5),
            "DeclaredRoom.twist: expected no gap before the field: larger fields first, or a u32 that is always zero, \
             found an offset of 28 bytes for an alignment of 8",
        ),
        (
            |it| it.body.fields[2].kind = array(Type::PoseM, 2),
            "DeclaredRoom.covariance: expected numbers in an array without a count, and no array in an array, \
             found 2 of another type",
        ),
        (
            |it| it.body.fields[3].way = Way::Counted("share".into()),
            "DeclaredRoom.walls: expected the name of a field that counts, found \"share\"",
        ),
        (
            |it| it.body.fields[3].way = Way::Itself,
            "DeclaredRoom.walls: expected numbers in an array without a count, and no array in an array, \
             found 4 of another type",
        ),
        (
            |it| it.body.fields[2].kind = array(Type::F64, 1 << 20),
            "DeclaredRoom.covariance: expected at most 1048576 bytes, found 8388688",
        ),
        (
            |it| it.body.fields[2].way = Way::Zero,
            "DeclaredRoom.covariance: expected a u32 that is always zero, found [f64; 9]",
        ),
    ];
    for (spoil, expected) in spoils {
        let mut declaration = room();
        spoil(&mut declaration);
        assert_eq!(declaration.declare().unwrap_err().to_string(), expected);
    }
}

#[test]
fn a_channel_has_a_name_and_bounds() {
    let message = room().declare().unwrap();
    let row = Row {
        name: "rooms".to_owned(),
        role: ChannelRole::Situation,
        writer: Process::Localizer,
        readers: vec![Process::Planner],
        per_tick: 1,
        max_cells: 0,
    };
    let spec = row.declare("declared", message).unwrap();
    assert!(spec.may_read(Process::Planner) && spec.belongs_to("declared") && !spec.belongs_to("other"));
    let bad = [
        Row { name: "my rooms".to_owned(), ..row.clone() },
        Row { per_tick: 0, ..row.clone() },
        Row { max_cells: MAX_CELLS + 1, ..row },
    ];
    for row in bad {
        assert!(row.declare("declared", message).is_err(), "{row:?}");
    }
}

//! Standard messages derived from our own, for viewers. For example, a 3D panel can draw a `nav_msgs/Path`,
//! but not a `Plan`.
//!
//! Each derived topic belongs to a channel, and each of its messages is made from one message of that
//! channel. Derived messages are never read back and are not recorded. [`COMMON`] lists the topics derived
//! from the channels common to all navigators, and each navigator lists those derived from its own channels.
//! Their messages are built from [`shapes`](super::shapes).

use ros2_interfaces_jazzy_serde::visualization_msgs::msg::MarkerArray;
use serde::Serialize;

use super::shapes::{PERSON_COLOR, REMEMBERED_COLOR, SEEN_COLOR, Shapes};
use super::{Ros2Error, definitions};
use crate::channels::{ChannelSpec, PEOPLE, VIEW};
use crate::message::{DotView, Message, People};

/// A topic of standard messages, each made from one message of a channel.
#[derive(Debug, Clone, Copy)]
pub struct Derived {
    /// Name of the topic, such as `/plan/global`.
    pub topic: &'static str,
    /// The channel that the topic is derived from.
    pub of: &'static ChannelSpec,
    /// ROS 2 type, such as `nav_msgs/msg/Path`.
    pub ros2: &'static str,
    encode: Encode,
}

/// Appends the messages derived from a message and its cells to a buffer, in CDR.
pub type Encode = fn(&[u8], &[u8], &mut Vec<u8>) -> Result<(), Ros2Error>;

impl Derived {
    /// Returns the `ros2msg` schema of the topic.
    pub fn schema(&self) -> String {
        definitions::schema(self.ros2, &[])
    }

    /// Creates a topic. For [`derived!`](derived).
    #[doc(hidden)]
    pub const fn new(
        topic: &'static str,
        of: &'static ChannelSpec,
        ros2: &'static str,
        encode: Encode,
    ) -> Self {
        Self { topic, of, ros2, encode }
    }

    /// Appends the messages derived from a message of the channel to `out`, in CDR.
    ///
    /// # Errors
    /// [`Ros2Error`] if the message cannot be expressed in ROS 2. In that case, the content of `out` is
    /// unusable.
    ///
    /// # Panics
    /// If `message` does not have the channel's size and alignment.
    pub fn encode(&self, message: &[u8], cells: &[u8], out: &mut Vec<u8>) -> Result<(), Ros2Error> {
        (self.encode)(message, cells, out)
    }
}

/// Encodes a derived message. For [`derived!`](derived).
#[doc(hidden)]
pub fn encode<T: Message, F: Serialize>(
    form: fn(&T, &[u8]) -> Result<F, Ros2Error>,
    (message, cells): (&[u8], &[u8]),
    out: &mut Vec<u8>,
) -> Result<(), Ros2Error> {
    super::encode(&form(bytemuck::from_bytes(message), cells)?, out)
}

#[doc(hidden)]
#[macro_export]
macro_rules! __derived {
    ($($topic:literal: $ros2:literal = $form:ident($channel:path);)*) => {
        &[$($crate::ros2::derived::Derived::new($topic, $channel.spec, $ros2, |message, cells, out| {
            $crate::ros2::derived::encode($form, (message, cells), out)
        })),*]
    };
}

/// Declares a list of derived topics. In `"/plan/global": "nav_msgs/msg/Path" = global_path(PLAN);`, the function
/// `global_path(&Plan, &[u8]) -> Result<Path, Ros2Error>` makes the topic's messages from those of the channel `PLAN`.
#[doc(inline)]
pub use __derived as derived;

/// The derived topics of the channels common to all navigators.
pub const COMMON: &[Derived] = derived! {
    "/view/markers": "visualization_msgs/msg/MarkerArray" = dot_markers(VIEW);
    "/people/markers": "visualization_msgs/msg/MarkerArray" = people_markers(PEOPLE);
};

/// Draws the edges of the window and the dots in view.
fn dot_markers(view: &DotView, _: &[u8]) -> Result<MarkerArray, Ros2Error> {
    let (side_m, half_m) = (f64::from(view.side_m), f64::from(view.side_m) / 2.0);
    let mut shapes = Shapes::new(&view.header, "window")?;
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]];
    let corners = corners.into_iter().map(|corner| corner.map(|side: f64| side * half_m));
    shapes.line(corners, side_m / 100.0, REMEMBERED_COLOR);
    for dot in view.dots() {
        shapes.disc([dot.x_m, dot.y_m].map(f64::from), side_m / 30.0, SEEN_COLOR);
    }
    Ok(shapes.finish())
}

fn people_markers(people: &People, _: &[u8]) -> Result<MarkerArray, Ros2Error> {
    let mut shapes = Shapes::new(&people.header, "world")?;
    for person in people.people() {
        shapes.disc([person.x_m, person.y_m], 2.0 * person.radius_m, PERSON_COLOR);
    }
    Ok(shapes.finish())
}

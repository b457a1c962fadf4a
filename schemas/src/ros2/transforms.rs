//! The transforms that viewers need to place the messages. `/tf` follows the odometry, and `/tf_static` contains the pose of the
//! laser. They are derived from other messages and never read back.

use ros2_interfaces_jazzy_serde::{
    geometry_msgs::msg::{Quaternion, Transform, TransformStamped, Vector3},
    tf2_msgs::msg::TFMessage,
};

use super::parts::{header_form, string};
use super::{Ros2Error, definitions, encode};
use crate::message::{Header, Odometry, PoseM};
use crate::robot::Laser;

/// The topic of the transform odom → base_link.
pub const TF: &str = "/tf";
/// The topic of the transform base_link → laser.
pub const TF_STATIC: &str = "/tf_static";
/// The ROS 2 type of both topics.
pub const TYPE: &str = "tf2_msgs/msg/TFMessage";

/// Returns the `ros2msg` schema of both topics.
pub fn schema() -> String {
    definitions::schema(TYPE, &[])
}

/// The form of the messages of both topics.
pub type Form = TFMessage;

/// Appends the transform odom → base_link at the time of `odometry` to `out`, in CDR, reusing the memory of
/// `form`.
///
/// # Errors
/// [`Ros2Error`] if the header cannot be expressed in ROS 2.
pub fn base_in_odom(odometry: &Odometry, form: &mut Form, out: &mut Vec<u8>) -> Result<(), Ros2Error> {
    let spare = std::mem::take(form);
    *form = transform(&odometry.header, "odom", "base_link", &odometry.pose, spare)?;
    encode(form, out)
}

/// Appends the transform base_link → laser, which is the pose at which `laser` is mounted, to `out`, in CDR.
///
/// # Errors
/// [`Ros2Error`], which never occurs with a valid laser.
pub fn laser_in_base(laser: &Laser, out: &mut Vec<u8>) -> Result<(), Ros2Error> {
    let mount = PoseM::new(&laser.mount());
    let latched = Header { seq: 1, stamp_ns: 0, source_seq: 0 };
    encode(&transform(&latched, "base_link", "laser", &mount, Form::default())?, out)
}

fn transform(
    header: &Header,
    parent: &str,
    child: &str,
    pose: &PoseM,
    spare: Form,
) -> Result<Form, Ros2Error> {
    let mut transforms = spare.transforms;
    let spare = transforms.pop().unwrap_or_default();
    transforms.clear();
    transforms.push(TransformStamped {
        header: header_form(header, parent, spare.header)?,
        child_frame_id: string(child, spare.child_frame_id),
        transform: Transform {
            translation: Vector3 { x: pose.x_m, y: pose.y_m, z: 0.0 },
            rotation: Quaternion { x: 0.0, y: 0.0, z: pose.orientation_z, w: pose.orientation_w },
        },
    });
    Ok(Form { transforms })
}

//! The ROS 2 forms of the types that messages are made of. Nothing is recomputed, so every number keeps its
//! bits.

use ros2_interfaces_jazzy_serde::geometry_msgs::msg::{
    Point, Point32, Pose, Quaternion, Twist as TwistForm, Vector3,
};
use serde::{Serialize, de::DeserializeOwned};

use super::parts::text_form;
use super::{Definition, Ros2Error};
use crate::layout::Part;
use crate::message::{PoseM, PosePx, Text, Twist};

/// A type that messages are made of, with its ROS 2 form.
pub trait Field: Part {
    /// The ROS 2 form of the type.
    type Form: Default + Serialize + DeserializeOwned + Send + 'static;

    /// Returns the name of the type in a `.msg`.
    fn msg() -> String;

    /// Returns the `.msg` texts of this project that the type needs.
    fn definitions() -> Vec<Definition> {
        Vec::new()
    }

    /// Converts the value of `field` into its form, using the memory of `spare`.
    ///
    /// # Errors
    /// [`Ros2Error`] if the form cannot express the value.
    fn to_form_in(&self, field: &'static str, spare: Self::Form) -> Result<Self::Form, Ros2Error>;

    /// Converts a form into a value. Anything in the form that the type cannot express is left out.
    ///
    /// # Errors
    /// [`Ros2Error`] if the form does not fit into the type.
    fn from_form(form: &Self::Form) -> Result<Self, Ros2Error>;
}

/// Implements [`Field`] for types whose form can be copied.
macro_rules! fields {
    ($($type:ty as $form:ty, $msg:literal, $to:expr, $from:expr;)*) => {$(
        impl Field for $type {
            type Form = $form;

            fn msg() -> String {
                $msg.to_owned()
            }

            fn to_form_in(&self, _: &'static str, _: $form) -> Result<$form, Ros2Error> {
                let to: fn(&Self) -> $form = $to;
                Ok(to(self))
            }

            fn from_form(form: &$form) -> Result<Self, Ros2Error> {
                let from: fn(&$form) -> Self = $from;
                Ok(from(form))
            }
        }
    )*};
}

fields! {
    u32 as u32, "uint32", |value| *value, |form| *form;
    u64 as u64, "uint64", |value| *value, |form| *form;
    f32 as f32, "float32", |value| *value, |form| *form;
    f64 as f64, "float64", |value| *value, |form| *form;
    [u32; 8] as [u32; 8], "uint32[8]", |value| *value, |form| *form;
    [u64; 16] as [u64; 16], "uint64[16]", |value| *value, |form| *form;
    // Square matrices are stored row by row. Two numbers are a point.
    [f64; 4] as [f64; 4], "float64[4]", |value| *value, |form| *form;
    [f64; 9] as [f64; 9], "float64[9]", |value| *value, |form| *form;
    [f64; 16] as [f64; 16], "float64[16]", |value| *value, |form| *form;
    [f64; 25] as [f64; 25], "float64[25]", |value| *value, |form| *form;
    [f64; 2] as Point, "geometry_msgs/Point", |p| point(p[0], p[1]), |form| [form.x, form.y];
    [f32; 2] as Point32, "geometry_msgs/Point32",
        |p| Point32 { x: p[0], y: p[1], z: 0.0 }, |form| [form.x, form.y];
    PoseM as Pose, "geometry_msgs/Pose",
        |p| pose(p.x_m, p.y_m, p.orientation_z, p.orientation_w), pose_m;
    PosePx as Pose, "geometry_msgs/Pose",
        |p| pose(p.x_px, p.y_px, p.orientation_z, p.orientation_w), pose_px;
    Twist as TwistForm, "geometry_msgs/Twist", twist_form, twist;
}

impl<const N: usize> Field for Text<N> {
    type Form = String;

    fn msg() -> String {
        "string".to_owned()
    }

    fn to_form_in(&self, field: &'static str, spare: String) -> Result<String, Ros2Error> {
        text_form(field, self, spare)
    }

    fn from_form(form: &String) -> Result<Self, Ros2Error> {
        Ok(Self::new(form))
    }
}

fn point(x: f64, y: f64) -> Point {
    Point { x, y, z: 0.0 }
}

/// Returns a planar pose from its position and the z and w of its quaternion.
pub fn pose(x: f64, y: f64, z_turn: f64, w_turn: f64) -> Pose {
    let orientation = Quaternion { x: 0.0, y: 0.0, z: z_turn, w: w_turn };
    Pose { position: point(x, y), orientation }
}

fn pose_m(form: &Pose) -> PoseM {
    let (position, turn) = (&form.position, &form.orientation);
    PoseM { x_m: position.x, y_m: position.y, orientation_z: turn.z, orientation_w: turn.w }
}

fn pose_px(form: &Pose) -> PosePx {
    let (position, turn) = (&form.position, &form.orientation);
    PosePx { x_px: position.x, y_px: position.y, orientation_z: turn.z, orientation_w: turn.w }
}

fn twist_form(twist: &Twist) -> TwistForm {
    TwistForm {
        linear: Vector3 { x: twist.vx_mps, y: twist.vy_mps, z: 0.0 },
        angular: Vector3 { x: 0.0, y: 0.0, z: twist.yaw_rate_radps },
    }
}

fn twist(form: &TwistForm) -> Twist {
    Twist { vx_mps: form.linear.x, vy_mps: form.linear.y, yaw_rate_radps: form.angular.z }
}

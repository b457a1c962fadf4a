//! The pieces that several forms share: headers, poses, counted lists, texts. Internal.

use ros2_interfaces_jazzy_serde::{
    builtin_interfaces::msg::Time,
    geometry_msgs::msg::{Point, Point32, Pose, Quaternion, Twist as TwistForm, Vector3},
    std_msgs::msg::Header as HeaderForm,
};

use super::Ros2Error;
use crate::message::{Header, PoseM, PosePx, Text, Twist};

const NS_PER_S: u64 = 1_000_000_000;

/// Refuses with [`Ros2Error::Value`] unless `holds`.
pub fn expect(holds: bool, field: &'static str, expected: &'static str, found: u64) -> Result<(), Ros2Error> {
    if holds { Ok(()) } else { Err(Ros2Error::Value { field, expected, found }) }
}

/// `text` in the memory of `spare`.
pub fn string(text: &str, mut spare: String) -> String {
    spare.clear();
    spare.push_str(text);
    spare
}

/// The stamp with `frame`.
pub fn header_form(header: &Header, frame: &str, spare: HeaderForm) -> Result<HeaderForm, Ros2Error> {
    let expected = "a recorded message's number: 1 to 4294967295";
    expect((1..=u32::MAX.into()).contains(&header.seq), "header.seq", expected, header.seq)?;
    Ok(HeaderForm { stamp: time(header.stamp_ns)?, frame_id: string(frame, spare.frame_id) })
}

/// The same for a sensor reading, which is its own cause.
pub fn reading_form(header: &Header, frame: &str, spare: HeaderForm) -> Result<HeaderForm, Ros2Error> {
    let expected = "header.seq, for a reading is its own cause";
    expect(header.source_seq == header.seq, "header.source_seq", expected, header.source_seq)?;
    header_form(header, frame, spare)
}

fn time(stamp_ns: u64) -> Result<Time, Ros2Error> {
    let expected = "less than 2^31 seconds, in nanoseconds";
    match i32::try_from(stamp_ns / NS_PER_S) {
        Ok(sec) => Ok(Time { sec, nanosec: (stamp_ns % NS_PER_S) as u32 }),
        Err(_) => Err(Ros2Error::Value { field: "header.stamp_ns", expected, found: stamp_ns }),
    }
}

/// The message's header out of the form's, the message's number and its cause.
pub fn header(form: &HeaderForm, seq: u64, source_seq: u64) -> Result<Header, Ros2Error> {
    let (sec, nanosec) = (form.stamp.sec, form.stamp.nanosec);
    let Ok(seconds) = u64::try_from(sec) else {
        let expected = "seconds since the mission's start, 0 or more";
        return Err(Ros2Error::Value { field: "header.stamp.sec", expected, found: sec as u64 });
    };
    expect(u64::from(nanosec) < NS_PER_S, "header.stamp.nanosec", "less than 1000000000", nanosec.into())?;
    Ok(Header { seq, stamp_ns: seconds * NS_PER_S + u64::from(nanosec), source_seq })
}

/// A planar point.
pub fn point(x: f64, y: f64) -> Point {
    Point { x, y, z: 0.0 }
}

/// A planar pose with the z and w of its quaternion.
pub fn pose(x: f64, y: f64, z_turn: f64, w_turn: f64) -> Pose {
    let orientation = Quaternion { x: 0.0, y: 0.0, z: z_turn, w: w_turn };
    Pose { position: point(x, y), orientation }
}

/// A pose in metres.
pub fn pose_m_form(p: &PoseM) -> Pose {
    pose(p.x_m, p.y_m, p.orientation_z, p.orientation_w)
}

/// A pose in pixels.
pub fn pose_px_form(p: &PosePx) -> Pose {
    pose(p.x_px, p.y_px, p.orientation_z, p.orientation_w)
}

/// A pose in metres.
pub fn pose_m(form: &Pose) -> PoseM {
    let (position, turn) = (&form.position, &form.orientation);
    PoseM { x_m: position.x, y_m: position.y, orientation_z: turn.z, orientation_w: turn.w }
}

/// A pose in pixels.
pub fn pose_px(form: &Pose) -> PosePx {
    let (position, turn) = (&form.position, &form.orientation);
    PosePx { x_px: position.x, y_px: position.y, orientation_z: turn.z, orientation_w: turn.w }
}

/// A velocity.
pub fn twist_form(twist: &Twist) -> TwistForm {
    TwistForm {
        linear: Vector3 { x: twist.vx_mps, y: twist.vy_mps, z: 0.0 },
        angular: Vector3 { x: 0.0, y: 0.0, z: twist.yaw_rate_radps },
    }
}

/// A velocity.
pub fn twist(form: &TwistForm) -> Twist {
    Twist { vx_mps: form.linear.x, vy_mps: form.linear.y, yaw_rate_radps: form.angular.z }
}

/// A point in single precision.
pub fn point32(p: &[f32; 2]) -> Point32 {
    Point32 { x: p[0], y: p[1], z: 0.0 }
}

/// The entries of `all` that count; refuses a count above the capacity and entries behind the count
/// that are not zero, for these do not travel.
fn counted<'a, T: bytemuck::Pod>(
    field: &'static str,
    all: &'a [T],
    count: u32,
) -> Result<&'a [T], Ros2Error> {
    let Some((counted, tail)) = all.split_at_checked(count as usize) else {
        let expected = "a count within the capacity";
        return Err(Ros2Error::Value { field, expected, found: count.into() });
    };
    let is_zero = |entry: &T| bytemuck::bytes_of(entry).iter().all(|&b| b == 0);
    let first_used = tail.iter().position(|entry| !is_zero(entry));
    match first_used {
        None => Ok(counted),
        Some(i) => {
            let expected = "zeros behind the count, not an entry at this index";
            Err(Ros2Error::Value { field, expected, found: u64::from(count) + i as u64 })
        }
    }
}

/// The entries of `all` that count, each turned into its form, in the memory of `spare`, which then has
/// room for all. Refuses what [`counted`] refuses.
pub fn list<T: bytemuck::Pod, F: Default>(
    field: &'static str,
    all: &[T],
    count: u32,
    mut spare: Vec<F>,
    convert: impl Fn(&T, F) -> Result<F, Ros2Error>,
) -> Result<Vec<F>, Ros2Error> {
    let entries = counted(field, all, count)?;
    spare.reserve_exact(all.len().saturating_sub(spare.len()));
    spare.resize_with(entries.len(), F::default);
    for (form, entry) in spare.iter_mut().zip(entries) {
        *form = convert(entry, std::mem::take(form))?;
    }
    Ok(spare)
}

/// Fills the start of `all` and gives the count; refuses what does not fit.
pub fn fill<T, F>(
    field: &'static str,
    all: &mut [T],
    forms: &[F],
    convert: impl Fn(&F) -> Result<T, Ros2Error>,
) -> Result<u32, Ros2Error> {
    let expected = "a count within the capacity";
    expect(forms.len() <= all.len(), field, expected, forms.len() as u64)?;
    for (entry, form) in all.iter_mut().zip(forms) {
        *entry = convert(form)?;
    }
    Ok(forms.len() as u32)
}

/// The text as a string in the memory of `spare`, which then has room for any; refuses what would not
/// come back the same.
pub fn text_form<const N: usize>(
    field: &'static str,
    text: &Text<N>,
    mut spare: String,
) -> Result<String, Ros2Error> {
    spare.reserve_exact(N.saturating_sub(spare.len()));
    let holds = Text::<N>::new(text.as_str()) == *text;
    if holds { Ok(string(text.as_str(), spare)) } else { Err(Ros2Error::Text { field }) }
}

/// Refuses a slice behind a message that has none.
pub fn no_cells(cells: &[u8]) -> Result<(), Ros2Error> {
    expect(cells.is_empty(), "cells", "no slice behind this message", cells.len() as u64)
}

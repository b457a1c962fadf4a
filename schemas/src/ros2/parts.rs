//! Building blocks that several forms share: headers, counted lists and texts.

use ros2_interfaces_jazzy_serde::{builtin_interfaces::msg::Time, std_msgs::msg::Header as HeaderForm};

use super::{Field, Ros2Error};
use crate::message::{Header, Text};
use crate::time::NS_PER_S;

/// Checks a condition on a field.
///
/// # Errors
/// [`Ros2Error::Value`] if the condition is false.
pub fn expect(holds: bool, field: &'static str, expected: &'static str, found: u64) -> Result<(), Ros2Error> {
    if holds { Ok(()) } else { Err(Ros2Error::Value { field, expected, found }) }
}

/// Returns `text`, reusing the memory of `spare`.
pub fn string(text: &str, mut spare: String) -> String {
    spare.clear();
    spare.push_str(text);
    spare
}

/// Returns the ROS 2 header with the message's time and `frame`.
///
/// # Errors
/// [`Ros2Error::Value`] if the message's number or time does not fit into the form.
pub fn header_form(header: &Header, frame: &str, spare: HeaderForm) -> Result<HeaderForm, Ros2Error> {
    let expected =
        "a number from 1 to 4294967295, by which messages refer to each other (other tools write 0)";
    expect((1..=u32::MAX.into()).contains(&header.seq), "header.seq", expected, header.seq)?;
    Ok(HeaderForm { stamp: time(header.stamp_ns)?, frame_id: string(frame, spare.frame_id) })
}

/// Like [`header_form`], but for a sensor reading, which is its own cause.
///
/// # Errors
/// Any error of [`header_form`], and [`Ros2Error::Value`] if the cause is another message.
pub fn reading_form(header: &Header, frame: &str, spare: HeaderForm) -> Result<HeaderForm, Ros2Error> {
    let expected = "header.seq, because a reading is its own cause";
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

/// Returns the message's header, given its ROS 2 header, its number and its cause.
///
/// # Errors
/// [`Ros2Error::Value`] if the time is before the mission's start or its nanoseconds are a second or more.
pub fn header(form: &HeaderForm, seq: u64, source_seq: u64) -> Result<Header, Ros2Error> {
    let (sec, nanosec) = (form.stamp.sec, form.stamp.nanosec);
    let Ok(seconds) = u64::try_from(sec) else {
        let expected = "seconds since the mission's start, 0 or more";
        return Err(Ros2Error::Value { field: "header.stamp.sec", expected, found: sec as u64 });
    };
    expect(u64::from(nanosec) < NS_PER_S, "header.stamp.nanosec", "less than 1000000000", nanosec.into())?;
    Ok(Header { seq, stamp_ns: seconds * NS_PER_S + u64::from(nanosec), source_seq })
}

/// Returns the entries of `all` in use. Rejects counts above the capacity, and entries beyond the count that
/// are not zero, since these would be lost.
fn counted<'a, T: bytemuck::Pod>(
    field: &'static str,
    all: &'a [T],
    count: u32,
) -> Result<&'a [T], Ros2Error> {
    Ok(bytemuck::cast_slice(counted_bytes(field, bytemuck::cast_slice(all), size_of::<T>(), count)?))
}

/// Like [`counted`], for entries of `size` bytes each.
pub(crate) fn counted_bytes<'a>(
    field: &'static str,
    all: &'a [u8],
    size: usize,
    count: u32,
) -> Result<&'a [u8], Ros2Error> {
    let Some((counted, tail)) = all.split_at_checked((count as usize).saturating_mul(size)) else {
        let expected = "a count within the capacity";
        return Err(Ros2Error::Value { field, expected, found: count.into() });
    };
    match tail.iter().position(|&byte| byte != 0) {
        None => Ok(counted),
        Some(i) => {
            let expected = "only zeros beyond the count";
            Err(Ros2Error::Value { field, expected, found: u64::from(count) + (i / size) as u64 })
        }
    }
}

/// Converts the entries of `all` in use into their forms, reusing the memory of `spare`, whose capacity afterwards suffices for all
/// entries.
///
/// # Errors
/// [`Ros2Error::Value`] if the count is above the capacity or an entry beyond the count is not zero, since
/// such an entry would be lost.
pub fn list<T: Field>(
    field: &'static str,
    all: &[T],
    count: u32,
    mut spare: Vec<T::Form>,
) -> Result<Vec<T::Form>, Ros2Error> {
    let entries = counted(field, all, count)?;
    spare.reserve_exact(all.len().saturating_sub(spare.len()));
    spare.resize_with(entries.len(), T::Form::default);
    for (form, entry) in spare.iter_mut().zip(entries) {
        *form = entry.to_form_in(field, std::mem::take(form))?;
    }
    Ok(spare)
}

/// Converts `forms` into the first entries of `all` and returns their number.
///
/// # Errors
/// [`Ros2Error::Value`] if there are more forms than entries, and any error of [`Field::from_form`].
pub fn fill<T: Field>(field: &'static str, all: &mut [T], forms: &[T::Form]) -> Result<u32, Ros2Error> {
    let expected = "a count within the capacity";
    expect(forms.len() <= all.len(), field, expected, forms.len() as u64)?;
    for (entry, form) in all.iter_mut().zip(forms) {
        *entry = T::from_form(form)?;
    }
    Ok(forms.len() as u32)
}

/// Returns the text as a string, reusing the memory of `spare`, whose capacity afterwards suffices for any text of this type.
///
/// # Errors
/// [`Ros2Error::Text`] if converting the string back would not yield the same bytes.
pub fn text_form<const N: usize>(
    field: &'static str,
    text: &Text<N>,
    mut spare: String,
) -> Result<String, Ros2Error> {
    spare.reserve_exact(N.saturating_sub(spare.len()));
    let holds = Text::<N>::new(text.as_str()) == *text;
    if holds { Ok(string(text.as_str(), spare)) } else { Err(Ros2Error::Text { field }) }
}

/// Checks that there is no slice, for a message that does not have one.
///
/// # Errors
/// [`Ros2Error::Value`] if there is a slice.
pub fn no_cells(cells: &[u8]) -> Result<(), Ros2Error> {
    expect(cells.is_empty(), "cells", "no slice after this message", cells.len() as u64)
}

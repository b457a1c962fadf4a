//! Reads objects from a recording: the true poses of the robot and the people or, in recordings by other
//! software, the positions in the topics.

use std::collections::BTreeSet;

use anyhow::{Context, ensure};
use sketchnav_recordings::reader::Recording;
use sketchnav_schemas::channels::{PEOPLE, TRUTH};
use sketchnav_schemas::message::{Header, People};
use sketchnav_schemas::time::seconds;

use super::{Body, Track};
use crate::output::say;
use crate::poses::{self, Place, Way};
use crate::recordings::tell_cut_off;
use crate::recordings::whole::Whole;

/// Reads the objects `robot`, `person-1`, `person-2` … from a recording of ours, or one object per topic from any
/// other.
///
/// # Errors
/// If the recording cannot be read or contains no positions.
pub fn read(whole: &Whole) -> anyhow::Result<Vec<Track>> {
    let recording = Recording::open(whole.path())?;
    if recording.index()?.is_cut_off() {
        tell_cut_off(whole.name().display());
    }
    if recording.has_run() { of_ours(&recording) } else { of_others(&recording) }
}

/// Reads each topic with positions as an object, named like the topic.
fn of_others(recording: &Recording) -> anyhow::Result<Vec<Track>> {
    let (ways, file) = (poses::read(recording)?, recording.path().display());
    ensure!(!ways.is_empty(), "{file}: expected a topic of one of the types {}, found none", poses::types());
    ways.iter().filter_map(Way::notice).for_each(|words| say!("notice: {words}"));
    let frames: BTreeSet<_> = ways.iter().map(|way| way.frame.as_str()).collect();
    if frames.len() > 1 {
        let each: Vec<_> = ways.iter().map(|way| format!("{} in {:?}", way.name, way.frame)).collect();
        say!("notice: places are compared as if these frames were one: {}", each.join(", "));
    }
    Ok(ways.into_iter().map(track_of).collect())
}

fn track_of(way: Way) -> Track {
    let body = |place: &Place| Body { at: place.at_m, heading_rad: place.heading_rad, size_m: None };
    let samples = way.places.iter().map(|place| (place.time_s, body(place))).collect();
    Track { name: way.name, samples }
}

fn of_ours(recording: &Recording) -> anyhow::Result<Vec<Track>> {
    let file = recording.path();
    let place = || file.display().to_string();
    let robot = recording.run()?.robot;
    let truth = recording.all(TRUTH).with_context(place)?;
    ensure!(!truth.is_empty(), "{}: expected true poses of the robot, found none", file.display());
    let [half_length_m, half_width_m] = robot.half_extents_m();
    // The size of the axis-aligned bounding box around the rotated footprint.
    let around = |sin: f64, cos: f64| match robot.footprint {
        None => [2.0 * robot.radius_m; 2],
        Some(_) => [
            half_length_m * cos.abs() + half_width_m * sin.abs(),
            half_length_m * sin.abs() + half_width_m * cos.abs(),
        ]
        .map(|half_m| 2.0 * half_m),
    };
    let body = |pose: sketchnav_schemas::geometry::Pose<_>| {
        let (sin, cos) = pose.yaw_rad.sin_cos();
        Body { at: [pose.x, pose.y], heading_rad: Some(pose.yaw_rad), size_m: Some(around(sin, cos)) }
    };
    let samples = truth.iter().map(|truth| (time_s(&truth.header), body(truth.pose()))).collect();
    let robot = Track { name: "robot".to_owned(), samples };
    let people = recording.all(PEOPLE).with_context(place)?;
    let count = people.iter().map(|people| people.people().len()).max().unwrap_or_default();
    Ok(std::iter::once(robot).chain((0..count).map(|person| track(&people, person))).collect())
}

fn track(people: &[People], person: usize) -> Track {
    let sample = |all: &People| {
        let walking = all.people().get(person)?;
        let size_m = Some([2.0 * walking.radius_m; 2]);
        let body = Body { at: [walking.x_m, walking.y_m], heading_rad: None, size_m };
        Some((time_s(&all.header), body))
    };
    Track { name: format!("person-{}", person + 1), samples: people.iter().filter_map(sample).collect() }
}

fn time_s(header: &Header) -> f64 {
    seconds(header.stamp_ns)
}

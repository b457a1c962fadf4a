//! What the map-maker sees before it plans: the dots of a picture, or the landmarks and walls of a floor
//! plan.

use std::path::Path;
use std::sync::Arc;

use sketchnav_dots::DotsError;
use sketchnav_dots::alike::{Odd, alike};
use sketchnav_dots::calibration::Review;
use sketchnav_dots::camera::{Camera, Known};
use sketchnav_dots::picture::{self, Reading};
use sketchnav_schemas::floor_plan::{FloorPlan, Furniture};
use sketchnav_schemas::robot::MarkerCamera;
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::Files;

use super::error::DirectionsError;
use super::mission::{DirectionsMission, LandKeys, Source};
use super::settings;
use crate::geometry::{Point, Window};
use crate::markers::{Marker, Markers, reach_m};
use crate::navigator::tracks::nearest;
use crate::plane::Plane;
use crate::walls::{Body, Walls};

/// The dots, or the landmarks on a floor, as the map-maker sees them.
pub(super) struct Seen {
    pub plane: Plane,
    /// Standard deviation of a position on each axis, in metres.
    pub noise_m: f64,
    pub notices: Vec<String>,
}

/// Returns the map-maker's view, or `None` if the map was written by hand.
pub(super) fn seen(
    run: &RunConfig,
    read: &DirectionsMission,
    files: &Files<'_>,
) -> Result<Option<Seen>, DirectionsError> {
    let (window, sigma_m) = settings::sight(&run.mission, &run.robot)?;
    match &read.source {
        Source::Picture { file, calibration, noise_m } => {
            let (plane, spread_m, notices) =
                see(&bytes("navigator.plane_file", file, files)?, file, calibration, window)?;
            // If the mission doesn't state the error, it is estimated from the residuals of the known points. With four points
            // there are none, since a transform always fits four points exactly.
            let noise_m = noise_m.or(spread_m).unwrap_or(sigma_m);
            Ok(Some(Seen { plane, noise_m, notices }))
        }
        Source::Floor { file, noise_m } => {
            let (bytes, body) =
                (bytes("navigator.floor_file", file, files)?, settings::body(&run.mission, &run.robot)?);
            let plan = floor_plan(&bytes, file)?;
            let plane = floor(&plan, file, read.land, body)?;
            let noise_m = noise_m.unwrap_or(sigma_m);
            let Some(camera) = settings::camera(&run.mission, &run.robot)? else {
                return Ok(Some(Seen { plane, noise_m, notices: Vec::new() }));
            };
            let (markers, notices) = markers(&plan, file, read, plane.dots(), camera)?;
            Ok(Some(Seen { plane: plane.marked(Some(Arc::new(markers))), noise_m, notices }))
        }
        Source::Map { .. } => Ok(None),
    }
}

/// Returns the file named by a key of the mission.
pub(super) fn bytes(key: &'static str, file: &str, files: &Files<'_>) -> Result<Vec<u8>, DirectionsError> {
    let wrong = |reason: std::io::Error| DirectionsError::File {
        key,
        file: file.to_owned(),
        reason: reason.to_string(),
    };
    files(file).map_err(wrong)
}

/// File name extensions of maps for `map_server`.
const OF_MAPS: [&str; 4] = ["yaml", "yml", "pgm", "png"];

fn wrong_floor(file: &str, reason: String) -> DirectionsError {
    DirectionsError::File { key: "navigator.floor_file", file: file.to_owned(), reason }
}

/// Reads a floor plan.
fn floor_plan(bytes: &[u8], file: &str) -> Result<FloorPlan, DirectionsError> {
    let wrong = |reason: String| wrong_floor(file, reason);
    let ending = Path::new(file).extension().unwrap_or_default();
    if OF_MAPS.iter().any(|of_map| ending.eq_ignore_ascii_case(of_map)) {
        let found = "found a map of map_server, which doesn't say which of its obstacles are landmarks";
        return Err(wrong(format!("expected a floor plan (TOML) with walls and round furniture, {found}")));
    }
    let text =
        std::str::from_utf8(bytes).map_err(|_| wrong("expected UTF-8, found other bytes".to_owned()))?;
    toml::from_str(text).map_err(|error| wrong(error.message().to_owned()))
}

/// Returns the landmarks of a floor together with its walls.
fn floor(plan: &FloorPlan, file: &str, land: Option<LandKeys>, body: Body) -> Result<Plane, DirectionsError> {
    let wrong = |reason: String| wrong_floor(file, reason);
    let radius_m = land.map_or(0.0, |land| land.radius_m);
    let places: Vec<_> = pillars(plan, radius_m).map(|[x, y]| Point::new(x, y)).collect();
    if places.is_empty() {
        return Err(wrong(format!("expected round furniture with a radius of {radius_m} m, found none")));
    }
    let walls = walls(plan, radius_m, body);
    if let Some(end) = walls.lines().flatten().find(|end| !(end.x.is_finite() && end.y.is_finite())) {
        return Err(wrong(format!("expected walls and furniture in metres, found ({}, {})", end.x, end.y)));
    }
    let plane = Plane::new(places).map_err(|cause| DirectionsError::Map { file: file.to_owned(), cause })?;
    Ok(plane.among(Arc::new(walls)))
}

/// Returns the markers on the landmarks of a floor, and notices about markers that are not on any landmark.
fn markers(
    plan: &FloorPlan,
    file: &str,
    read: &DirectionsMission,
    landmarks: &[Point],
    camera: &MarkerCamera,
) -> Result<(Markers, Vec<String>), DirectionsError> {
    let radius_m = read.land.map_or(0.0, |land| land.radius_m);
    let in_file = |cause| DirectionsError::Map { file: file.to_owned(), cause };
    let shown = Markers::new(camera.clone(), landmarks, radius_m, kinds(plan, read)).map_err(in_file)?;
    let is_beside = |id: u32| {
        let mut own = plan.marker.iter().filter(|marker| marker.id == id);
        own.any(|marker| {
            nearest(landmarks, Point::new(marker.at[0], marker.at[1]), reach_m(radius_m)).is_some()
        })
    };
    let numbers = read.markers.iter().flat_map(|(kind, numbers)| numbers.iter().map(move |id| (*kind, *id)));
    let apart = numbers.filter(|(_, id)| !is_beside(*id));
    let notices = apart.map(|(kind, id)| format!("{file}: marker {id} ({kind}) is not beside any landmark"));
    Ok((shown, notices.collect()))
}

/// Returns the markers of a floor for which the mission defines a kind.
pub fn kinds<'a>(plan: &'a FloorPlan, read: &'a DirectionsMission) -> impl Iterator<Item = Marker> + 'a {
    plan.marker.iter().filter_map(|marker| {
        let at = Point::new(marker.at[0], marker.at[1]);
        Some(Marker { kind: read.kind(marker.id)?, at, facing_rad: marker.facing_deg.to_radians() })
    })
}

/// Returns the landmarks of a floor: round furniture with the given radius, give or take 10 %.
pub fn pillars(plan: &FloorPlan, radius_m: f64) -> impl Iterator<Item = [f64; 2]> + '_ {
    plan.furniture.iter().filter(move |piece| is_pillar(piece, radius_m)).filter_map(|piece| piece.center)
}

/// Returns the walls of a floor and all furniture except landmarks.
pub fn walls(plan: &FloorPlan, radius_m: f64, body: Body) -> Walls {
    Walls::of_floor(plan, |piece| is_pillar(piece, radius_m), body)
}

fn is_pillar(piece: &Furniture, radius_m: f64) -> bool {
    piece.radius_m.is_some_and(|own| (own - radius_m).abs() <= 0.1 * radius_m)
}

/// Reads a picture. Returns the plane, the standard deviation of a position in metres if the known points reveal it, and
/// notices about anything suspicious.
fn see(
    bytes: &[u8],
    file: &str,
    known: &[Known],
    window: Window,
) -> Result<(Plane, Option<f64>, Vec<String>), DirectionsError> {
    let in_picture = |cause| DirectionsError::Picture { file: file.to_owned(), cause };
    let (camera, review) = camera(known, window)?;
    let Reading { spots, uneven, dust, .. } = picture::read(bytes).map_err(in_picture)?;
    let usual = camera.area(known[0].pixel).unwrap_or(1.0);
    let (dots, odd) = alike(spots, |at| camera.area(at).unwrap_or(usual).abs());
    let places = dots.iter().map(|dot| camera.place(dot.at).map(|[x, y]| Point::new(x, y)));
    let places = places.collect::<Result<_, _>>().map_err(in_picture)?;
    let mut notices = calibration_notices(&review);
    notices.extend(uneven.map(|light| format!("{file}: {light}")));
    notices
        .extend(left_out(&odd, dust).map(|words| format!("{file}: {words}; {} dots are left", dots.len())));
    let plane = Plane::new(places).map_err(|cause| DirectionsError::Map { file: file.to_owned(), cause })?;
    Ok((plane, camera.spread(known), notices))
}

/// Calibrates the camera from known points, and checks that they agree.
fn camera(known: &[Known], window: Window) -> Result<(Camera, Review), DirectionsError> {
    let review = Review::of(known);
    let disagree = || DirectionsError::Calibration(DotsError::Disagree(review.to_string()));
    let camera = match Camera::calibrated(known) {
        Err(DotsError::Behind { .. }) if !review.agrees() => return Err(disagree()),
        camera => camera.map_err(DirectionsError::Calibration)?,
    };
    // With position errors of half a window, every dot could be mistaken for another.
    let is_useless = camera.spread(known).is_some_and(|spread_m| spread_m >= window.side / 2.0);
    if !review.agrees() && is_useless {
        return Err(disagree());
    }
    Ok((camera, review))
}

fn calibration_notices(review: &Review) -> Vec<String> {
    let disagree = (!review.agrees()).then(|| format!("navigator.calibration: {review}"));
    let mirrored = review.is_mirrored.then(|| {
        "navigator.calibration: the picture shows the plane as if from below; rows are counted from its top".to_owned()
    });
    let unchecked = review.is_unchecked().then(|| format!("navigator.calibration: {review}"));
    disagree.into_iter().chain(mirrored).chain(unchecked).collect()
}

/// Maximum number of odd spots that a notice describes one by one.
const DESCRIBED: usize = 3;

/// Returns a notice about the spots that are not dots, or `None` if there are none.
fn left_out(odd: &[Odd], dust: usize) -> Option<String> {
    if odd.is_empty() {
        return (dust > 0).then(|| format!("left out {dust} specks of less than three pixels"));
    }
    let mut words: Vec<String> = odd.iter().take(DESCRIBED).map(Odd::to_string).collect();
    if odd.len() > DESCRIBED {
        words.push("…".to_owned());
    }
    let specks = if dust > 0 { format!(", and {dust} specks") } else { String::new() };
    Some(format!("left out spots that are no dots: {}{specks} ({})", odd.len(), words.join("; ")))
}

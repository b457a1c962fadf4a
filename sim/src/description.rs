//! The objects and people in a world, in the form that physics, range sensors and pictures need. Coordinates are in metres, in
//! frame `World`.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::bounds;
use sketchnav_schemas::floor_plan::{Furniture, Marker, Person};
use sketchnav_schemas::mission::{Place, Task, task_key};

use crate::convex::{Convex, Segment};
use crate::error::{SimError, check, check_within};
use crate::ros_map::{OccupancyMap, TRANSPARENT};

/// A floor, as created by [`crate::floor_plan::describe`] or [`crate::ros_map::OccupancyMap::describe`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct WorldDescription {
    /// Display name of the floor.
    pub name: String,
    /// Faces of the walls, which the laser sees and pictures show.
    pub outline: Vec<Segment>,
    /// Walls as solids, which the robot collides with. They may overlap.
    pub walls: Vec<Convex>,
    /// Furniture.
    pub furniture: Vec<Convex>,
    /// People walking around.
    pub people: Vec<Person>,
    /// Markers, each with a unique number.
    #[serde(default)]
    pub markers: Vec<Marker>,
    /// The map that the floor was created from, if any. It is needed to look up points that are far from free cells, because the
    /// walls include only the solid cells near free ones.
    #[serde(skip)]
    pub map: Option<OccupancyMap>,
}

/// Tolerance for the distance of a marker from a face, in metres.
const MARKER_SLACK_M: f64 = 0.02;

/// Maximum number of steps along each axis when an area is searched for free floor.
const MOST_STEPS: f64 = 400.0;

/// Bounding box of something, in metres.
pub(crate) struct Extent {
    low: [f64; 2],
    high: [f64; 2],
}

impl Extent {
    /// Returns the extent of some points. Without points, it does not meet any other extent.
    pub(crate) fn of(points: impl IntoIterator<Item = [f64; 2]>) -> Self {
        let nothing = Self { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] };
        points.into_iter().fold(nothing, |Self { low, high }, at| Self {
            low: [low[0].min(at[0]), low[1].min(at[1])],
            high: [high[0].max(at[0]), high[1].max(at[1])],
        })
    }

    /// Returns true if the two extents have a point in common.
    pub(crate) fn meets(&self, other: &Self) -> bool {
        (0..2).all(|axis| self.low[axis] <= other.high[axis] && other.low[axis] <= self.high[axis])
    }

    /// Describes what is wrong with a position outside walls of this extent.
    pub(crate) fn outside(&self) -> String {
        let Self { low: [left, bottom], high: [right, top] } = self;
        format!("outside the walls, which reach from ({left:.2}, {bottom:.2}) to ({right:.2}, {top:.2}) m")
    }
}

impl WorldDescription {
    /// Returns the extent of the walls.
    pub(crate) fn extent(&self) -> Extent {
        Extent::of(self.outline.iter().flatten().copied())
    }

    /// Checks that the robot starts on free floor.
    ///
    /// # Errors
    /// [`SimError::Value`], which gives the position and what was found there.
    pub fn check_start(&self, at: [f64; 2]) -> Result<(), SimError> {
        self.check_within("start.world", at)
    }

    /// Checks that the place given by a key of a mission lies within the walls and, on a map, on free floor.
    ///
    /// # Errors
    /// [`SimError::Value`] if it does not.
    pub(crate) fn check_within(&self, key: &str, at: [f64; 2]) -> Result<(), SimError> {
        let in_map = self.map.as_ref().filter(|map| map.extent().meets(&Extent::of([at])));
        let (expected, what) = match in_map {
            Some(map) => ("a free place", map.solid_at(at).map(|what| format!("in {what}"))),
            None if self.extent().meets(&Extent::of([at])) => return Ok(()),
            None => ("a place within the walls", Some(self.extent().outside())),
        };
        let Some(what) = what else { return Ok(()) };
        let found = format!("({}, {}) m, {what}", at[0], at[1]);
        Err(SimError::Value { key: key.into(), expected, found })
    }

    /// Checks that the `there` of each task overlaps the area within the walls and, on a map, free floor.
    /// Otherwise, no robot could ever get there.
    ///
    /// # Errors
    /// [`SimError::Value`], which gives the task, the area, and the extent of the walls or what was found
    /// there.
    pub fn check_places(&self, tasks: &[Task]) -> Result<(), SimError> {
        let walls = self.extent();
        for (i, Task { name, there, .. }) in tasks.iter().enumerate() {
            if there.is_unknown() {
                continue;
            }
            let place = Extent::of(outermost(there));
            let [low, high] = [place.low, place.high];
            let from_to = format!("({:.2}, {:.2}) to ({:.2}, {:.2}) m", low[0], low[1], high[0], high[1]);
            let in_map = self.map.as_ref().filter(|map| map.extent().meets(&place));
            let (expected, found) = match in_map {
                Some(map) => match without_floor(map, there, &place) {
                    Some(what) => ("a place that reaches onto free floor", format!("{from_to}, in {what}")),
                    None => continue,
                },
                None if walls.meets(&place) => continue,
                None => ("a place within the walls", format!("{from_to}, {}", walls.outside())),
            };
            return Err(SimError::Value { key: format!("{}.there", task_key(i + 1, name)), expected, found });
        }
        Ok(())
    }

    /// Adds furniture to the world.
    ///
    /// # Errors
    /// [`SimError::Value`], which gives the number and the name of a piece that has no shape, more than one
    /// shape, or an impossible one.
    pub fn add_furniture(&mut self, furniture: &[Furniture]) -> Result<(), SimError> {
        let count = self.furniture.len() + furniture.len();
        check(count <= bounds::MOST_FURNITURE, "furniture", "at most 2000 pieces", count)?;
        for (i, piece) in furniture.iter().enumerate() {
            let key = format!("furniture {} {:?}", i + 1, piece.name);
            self.furniture.push(solid(piece, &key)?);
        }
        Ok(())
    }

    /// Adds markers to the world. The walls and furniture that they hang on must be added first.
    ///
    /// # Errors
    /// [`SimError::Value`], which gives the number of a marker that is inside a wall, is not on any face, or
    /// has the same number as another.
    pub fn add_markers(&mut self, markers: &[Marker]) -> Result<(), SimError> {
        let count = self.markers.len() + markers.len();
        check(count <= bounds::MOST_MARKERS, "marker", "at most 1000 markers", count)?;
        for (i, marker) in markers.iter().enumerate() {
            let key = |part: &str| format!("marker {} (id {}).{part}", i + 1, marker.id);
            check_within(key("at"), bounds::COORDINATE_M, &marker.at)?;
            check_within(key("facing_deg"), bounds::ANGLE_DEG, &[marker.facing_deg])?;
            check(
                self.is_on_a_face(marker.at),
                key("at"),
                "a place on the face of a wall or of furniture",
                marker.at,
            )?;
            let facing = marker.facing_deg.to_radians();
            let before =
                Vector2::from(marker.at) + 2.0 * MARKER_SLACK_M * Vector2::new(facing.cos(), facing.sin());
            let looks_away = !self.solids().any(|solid| solid.contains(before.into()));
            let away = "a direction away from the wall or furniture that it is on";
            check(looks_away, key("facing_deg"), away, marker.facing_deg)?;
            let is_new = self.markers.iter().all(|other| other.id != marker.id);
            check(is_new, key("id"), "a number that no other marker has", marker.id)?;
            self.markers.push(*marker);
        }
        Ok(())
    }

    fn solids(&self) -> impl Iterator<Item = &Convex> {
        self.walls.iter().chain(&self.furniture)
    }

    fn is_on_a_face(&self, at: [f64; 2]) -> bool {
        let faces = self.outline.iter().copied().chain(self.furniture.iter().flat_map(Convex::edges));
        faces.into_iter().any(|face| distance_m(&face, at) <= MARKER_SLACK_M)
    }

    /// Adds people to the world.
    ///
    /// # Errors
    /// [`SimError::Value`], which gives the number of the person and what was expected.
    pub fn add_people(&mut self, people: &[Person]) -> Result<(), SimError> {
        let count = self.people.len() + people.len();
        check(count <= bounds::MOST_PEOPLE, "person", "at most 100 people", count)?;
        for (i, person) in people.iter().enumerate() {
            check_person(person, &format!("person {}", i + 1))?;
            self.people.push(person.clone());
        }
        Ok(())
    }
}

/// Returns the distance from a point to a face, in metres.
fn distance_m([a, b]: &Segment, at: [f64; 2]) -> f64 {
    let (a, b, at) = (Vector2::from(*a), Vector2::from(*b), Vector2::from(at));
    let along = b - a;
    let share = ((at - a).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (at - a - along * share).norm()
}

/// Describes what covers an area, or returns `None` if part of its floor is free.
fn without_floor(map: &OccupancyMap, there: &Place, around: &Extent) -> Option<&'static str> {
    let steps = [0, 1].map(|axis| {
        let length_m = around.high[axis] - around.low[axis];
        (length_m / map.resolution_m()).ceil().clamp(1.0, MOST_STEPS) as usize
    });
    let along = |axis: usize, step: usize| {
        let share = (step as f64 + 0.5) / steps[axis] as f64;
        around.low[axis] + share * (around.high[axis] - around.low[axis])
    };
    let points = (0..steps[0]).flat_map(|x| (0..steps[1]).map(move |y| (x, y)));
    let inside = points.map(|(x, y)| [along(0, x), along(1, y)]).filter(|[x, y]| there.contains(*x, *y));
    let mut found = None;
    for at in inside {
        let what = map.solid_at(at)?;
        found = found.filter(|known| *known == TRANSPARENT).or(Some(what));
    }
    found
}

/// Returns the outermost points of an area.
fn outermost(place: &Place) -> Vec<[f64; 2]> {
    let disc = place.center.zip(place.radius_m).into_iter();
    let disc = disc.flat_map(|([x, y], radius)| [[x - radius, y - radius], [x + radius, y + radius]]);
    place.polygon.iter().flatten().copied().chain(disc).collect()
}

fn solid(piece: &Furniture, key: &str) -> Result<Convex, SimError> {
    let part = |part: &str| format!("{key}.{part}");
    check_within(part("center"), bounds::COORDINATE_M, piece.center.as_ref().map_or(&[][..], |at| &at[..]))?;
    check_within(part("yaw_deg"), bounds::ANGLE_DEG, &[piece.yaw_deg])?;
    match (&piece.polygon, piece.center, piece.size, piece.radius_m) {
        (Some(corners), None, None, None) => polygon(corners, part("polygon")),
        (None, Some(center), Some(size), None) => {
            check_within(part("size"), bounds::FURNITURE_SIZE_M, &size)?;
            Ok(Convex::rectangle(center, size, piece.yaw_deg.to_radians()))
        }
        (None, Some(center), None, Some(radius_m)) => {
            check_within(part("radius_m"), bounds::FURNITURE_SIZE_M, &[radius_m])?;
            Ok(Convex::disc(center, radius_m))
        }
        _ => Err(SimError::Value {
            key: key.to_owned(),
            expected: "either polygon, or center and size, or center and radius_m",
            found: shape(piece),
        }),
    }
}

/// Lists the keys with which a piece of furniture gives its shape, for an error.
fn shape(piece: &Furniture) -> String {
    let keys = [
        ("polygon", piece.polygon.is_some()),
        ("center", piece.center.is_some()),
        ("size", piece.size.is_some()),
        ("radius_m", piece.radius_m.is_some()),
    ];
    let found: Vec<_> = keys.into_iter().filter(|(_, is_there)| *is_there).map(|(key, _)| key).collect();
    if found.is_empty() { "none".to_owned() } else { found.join(", ") }
}

fn polygon(corners: &[[f64; 2]], key: String) -> Result<Convex, SimError> {
    check(corners.len() <= bounds::MOST_CORNERS, key.as_str(), "at most 1000 corners", corners.len())?;
    check_within(key.as_str(), bounds::COORDINATE_M, corners.as_flattened())?;
    Convex::polygon(corners).filter(is_broad).ok_or_else(|| SimError::Value {
        key,
        expected: "the corners of a convex polygon of 1 mm or more, one after the other",
        found: format!("{} corners, the first at {:?}", corners.len(), corners.first()),
    })
}

/// Returns true if a polygon has the minimum size of furniture.
fn is_broad(polygon: &Convex) -> bool {
    let least_m = bounds::FURNITURE_SIZE_M.least;
    polygon.edges().any(|[a, b]| (a[0] - b[0]).hypot(a[1] - b[1]) >= least_m)
}

fn check_person(person: &Person, key: &str) -> Result<(), SimError> {
    let part = |part: &str| format!("{key}.{part}");
    let count = person.waypoints.len();
    check(count > 0, part("waypoints"), "1 waypoint or more", count)?;
    check(count <= bounds::MOST_CORNERS, part("waypoints"), "at most 1000 waypoints", count)?;
    check_within(part("waypoints"), bounds::COORDINATE_M, person.waypoints.as_flattened())?;
    check_within(part("radius_m"), bounds::PERSON_RADIUS_M, &[person.radius_m])?;
    check_within(part("speed_mps"), bounds::SPEED_MPS, &[person.speed_mps])?;
    check_within(part("pause_s"), bounds::PAUSE_S, &[person.pause_s])
}

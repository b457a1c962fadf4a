//! What stands and walks in a world, ready for physics, laser and pictures. Metres, frame `World`.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::floor_plan::{Furniture, Person};

use crate::convex::{Convex, Segment};
use crate::error::{SimError, check, check_finite};

/// A floor: made by [`crate::floor_plan::describe`] or [`crate::ros_map::OccupancyMap::describe`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct WorldDescription {
    /// Name, for people.
    pub name: String,
    /// The faces of the walls: what the laser sees of them, and what a picture shows.
    pub outline: Vec<Segment>,
    /// The walls as solids: what the robot runs into. They may overlap.
    pub walls: Vec<Convex>,
    /// What stands around.
    pub furniture: Vec<Convex>,
    /// Who walks around.
    pub people: Vec<Person>,
}

impl WorldDescription {
    /// Puts `furniture` into the world.
    ///
    /// # Errors
    /// [`SimError::Value`] with the piece's number and name where it has no shape, two, or none that can be.
    pub fn add_furniture(&mut self, furniture: &[Furniture]) -> Result<(), SimError> {
        for (i, piece) in furniture.iter().enumerate() {
            let key = format!("furniture {} {:?}", i + 1, piece.name);
            self.furniture.push(solid(piece, &key)?);
        }
        Ok(())
    }

    /// Puts `people` into the world.
    ///
    /// # Errors
    /// [`SimError::Value`] with the person's number and what was expected.
    pub fn add_people(&mut self, people: &[Person]) -> Result<(), SimError> {
        for (i, person) in people.iter().enumerate() {
            check_person(person, &format!("person {}", i + 1))?;
            self.people.push(person.clone());
        }
        Ok(())
    }
}

fn solid(piece: &Furniture, key: &str) -> Result<Convex, SimError> {
    match (&piece.polygon, piece.center, piece.size, piece.radius_m) {
        (Some(corners), None, None, None) => polygon(corners, key),
        (None, Some(center), Some(size), None) => {
            check_finite(format!("{key}.center"), &[center[0], center[1], piece.yaw_deg])?;
            let holds = size.iter().all(|s| s.is_finite() && *s > 0.0);
            check(holds, format!("{key}.size"), "two numbers above 0", size)?;
            Ok(Convex::rectangle(center, size, piece.yaw_deg.to_radians()))
        }
        (None, Some(center), None, Some(radius_m)) => {
            check_finite(format!("{key}.center"), &center)?;
            let holds = radius_m.is_finite() && radius_m > 0.0;
            check(holds, format!("{key}.radius_m"), "a number above 0", radius_m)?;
            Ok(Convex::disc(center, radius_m))
        }
        _ => Err(SimError::Value {
            key: key.to_owned(),
            expected: "either polygon, or center and size, or center and radius_m",
            found: format!("{piece:?}"),
        }),
    }
}

fn polygon(corners: &[[f64; 2]], key: &str) -> Result<Convex, SimError> {
    let key = format!("{key}.polygon");
    check_finite(key.as_str(), corners.as_flattened())?;
    Convex::polygon(corners).ok_or_else(|| SimError::Value {
        key,
        expected: "the corners of a convex polygon, one after the other",
        found: format!("{corners:?}"),
    })
}

fn check_person(person: &Person, key: &str) -> Result<(), SimError> {
    let count = person.waypoints.len();
    check(count > 0, format!("{key}.waypoints"), "1 waypoint or more", count)?;
    check_finite(format!("{key}.waypoints"), person.waypoints.as_flattened())?;
    let above_0 = |v: f64| v.is_finite() && v > 0.0;
    check(above_0(person.radius_m), format!("{key}.radius_m"), "a number above 0", person.radius_m)?;
    let speed = person.speed_mps;
    check(above_0(speed), format!("{key}.speed_mps"), "a number above 0", speed)?;
    let pause = person.pause_s;
    check(pause.is_finite() && pause >= 0.0, format!("{key}.pause_s"), "a number of 0 or more", pause)
}

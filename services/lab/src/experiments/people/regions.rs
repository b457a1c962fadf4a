//! The rooms of the environment that the ten people drew.

use serde::Deserialize;
use sketchnav_schemas::geometry::encloses;
use sketchnav_schemas::mission::Place;

use crate::error::EvalError;
use crate::experiments::ground::to_outline_m;

/// Maximum distance of a mark from its region, in metres.
const NEAR_M: f64 = 1.0;

/// The regions of the environment. A position that lies in several of them is in the first.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Regions {
    region: Vec<Region>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Region {
    name: String,
    /// Corners, in metres.
    polygon: Vec<[f64; 2]>,
    /// True if a robot can enter the region.
    #[serde(default = "yes")]
    enterable: bool,
}

fn yes() -> bool {
    true
}

impl Regions {
    /// Returns the regions that are stored in the repository.
    ///
    /// # Errors
    /// [`EvalError::Data`] if the file is malformed.
    pub fn shipped() -> Result<Self, EvalError> {
        toml::from_str(include_str!("regions.toml"))
            .map_err(|cause| EvalError::Data { what: "regions of the suite people", cause })
    }

    /// Returns the region of a position, in metres: the one that contains it or, since marks slip over walls, the nearest one
    /// within a metre.
    pub fn of(&self, at: [f64; 2]) -> Option<usize> {
        if let Some(region) = self.region.iter().position(|region| encloses(&region.polygon, at)) {
            return Some(region);
        }
        let distances = self.region.iter().map(|region| to_outline_m(&region.polygon, at)).enumerate();
        distances.filter(|(_, d)| *d <= NEAR_M).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(region, _)| region)
    }

    /// Returns the name of a region.
    pub fn name(&self, region: usize) -> &str {
        &self.region[region].name
    }

    /// Returns the names and corners of the regions that a robot can enter.
    pub fn enterable(&self) -> impl Iterator<Item = (&str, &[[f64; 2]])> {
        let regions = self.region.iter().filter(|region| region.enterable);
        regions.map(|region| (region.name.as_str(), region.polygon.as_slice()))
    }

    /// Returns true if a robot can enter the region.
    pub fn is_enterable(&self, region: usize) -> bool {
        self.region[region].enterable
    }

    /// Returns several regions as a single place, whose error is measured from `center`. (If two regions overlap at a door, the
    /// overlapping strip of a third of a metre is in neither.)
    pub fn union(&self, regions: &[usize], center: [f64; 2]) -> Place {
        place(regions.iter().map(|&region| self.region[region].polygon.clone()).collect(), center)
    }
}

/// Joins polygons into one. Cuts lead from the first corner of the first polygon to each other polygon and back. They have no area,
/// so the even-odd rule ignores them.
fn place(polygons: Vec<Vec<[f64; 2]>>, center: [f64; 2]) -> Place {
    let mut corners: Vec<[f64; 2]> = Vec::new();
    let anchor = polygons[0][0];
    for polygon in polygons {
        corners.extend(&polygon);
        corners.push(polygon[0]);
        corners.push(anchor);
    }
    Place { polygon: Some(corners), center: Some(center), radius_m: None }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(at: [f64; 2]) -> Option<String> {
        let regions = Regions::shipped().unwrap();
        regions.of(at).map(|region| regions.name(region).to_owned())
    }

    #[test]
    fn places_belong_to_their_rooms() {
        assert_eq!(of([18.0, 12.84]).as_deref(), Some("hall"));
        assert_eq!(of([8.1, 12.6]).as_deref(), Some("left arm"));
        assert_eq!(of([23.64, 20.3]).as_deref(), Some("upper nook"));
        assert_eq!(of([24.3, 4.4]).as_deref(), Some("lower corridor"));
        assert_eq!(of([8.8, 7.0]).as_deref(), Some("slit"));
        assert_eq!(of([7.5, 7.0]).as_deref(), Some("left arm"), "a mark in a wall");
        assert_eq!(of([1.0, 1.0]), None);
    }

    #[test]
    fn a_union_contains_its_parts_and_nothing_between() {
        let regions = Regions::shipped().unwrap();
        let both = regions.union(&[1, 3], [0.0, 0.0]);
        assert!(both.contains(23.64, 20.3) && both.contains(8.1, 12.6));
        assert!(!both.contains(18.0, 12.84) && !both.contains(15.0, 17.0));
    }
}

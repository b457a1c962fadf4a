//! A floor as a person would draw it: the centre lines of its walls between doors, its rooms, and the openings between them.
//! Furniture is left out.

use nalgebra::Vector2;
use sketchnav_schemas::floor_plan::FloorPlan;
use sketchnav_schemas::geometry::{Point, World};
use sketchnav_sim::ros_map::OccupancyMap;

use crate::error::DeformError;
use crate::grid::Solid;
use crate::regions::{Doorway, LEAST_AREA_M2, Region, Regions};
use crate::trace;

/// Minimum number of places, which is about as many as people marked in a floor and a drawing of it.
const LEAST_PLACES: usize = 7;
/// Minimum distance of a place in a hall from the walls, in metres.
const PLACE_CLEARANCE_M: f64 = 0.6;

/// What a drawing of a floor may contain. Coordinates are in metres, in frame `World`.
#[derive(Debug, Clone, PartialEq)]
pub struct Floor {
    /// Display name of the floor.
    pub name: String,
    pub(crate) walls: Vec<Vec<Vector2<f64>>>,
    pub(crate) regions: Regions,
    places: Vec<Point<World>>,
    furniture: Vec<Furnishing>,
}

/// A piece of furniture. Drawings do not show these.
#[derive(Debug, Clone, PartialEq)]
pub struct Furnishing {
    /// Name of the piece, or empty if it has none.
    pub name: String,
    /// Centre of the piece.
    pub center: Point<World>,
    /// Extent of the piece along x and y, in metres.
    pub size_m: [f64; 2],
}

impl Floor {
    /// Creates a floor from a floor plan.
    ///
    /// # Errors
    /// - [`DeformError::World`] if the plan is invalid.
    /// - [`DeformError::TooLarge`] if the walls extend too far.
    /// - [`DeformError::NoRegions`] if it has no enclosed room.
    pub fn of_plan(plan: &FloorPlan) -> Result<Self, DeformError> {
        let world = sketchnav_sim::floor_plan::describe(plan)?;
        let regions = Regions::of(&Solid::of_walls(&world)?);
        let lines = sketchnav_sim::floor_plan::middle_lines(plan)?;
        let walls = lines.into_iter().map(|line| line.map(Vector2::from).to_vec()).collect();
        let pieces = plan.furniture.iter().zip(&world.furniture);
        let furniture = pieces
            .map(|(piece, solid)| Furnishing::of(&piece.name, solid.corners().iter().copied()))
            .collect();
        Self::checked(plan.name.clone(), walls, regions, furniture)
    }

    /// Creates a floor from a map. Anything smaller than 2 m that stands free within a room counts as furniture and is left out.
    ///
    /// # Errors
    /// [`DeformError::NoRegions`] if the map has no enclosed room.
    pub fn of_map(map: &OccupancyMap, name: &str) -> Result<Self, DeformError> {
        let mut solid = Solid::of_map(map);
        let furnished = Regions::of(&solid);
        let removed = trace::remove_furniture(&mut solid, &furnished);
        let half_m = solid.grid.cell_m / 2.0;
        let corners = |&i: &usize| {
            let middle = solid.grid.middle(i);
            [middle.add_scalar(-half_m).into(), middle.add_scalar(half_m).into()]
        };
        let furniture: Vec<_> =
            removed.iter().map(|piece| Furnishing::of("", piece.iter().flat_map(corners))).collect();
        let regions = Regions::of(&solid);
        let walls = trace::walls(&solid, &regions);
        Self::checked(name.to_owned(), walls, regions, furniture)
    }

    fn checked(
        name: String,
        walls: Vec<Vec<Vector2<f64>>>,
        regions: Regions,
        furniture: Vec<Furnishing>,
    ) -> Result<Self, DeformError> {
        if regions.list.is_empty() || walls.is_empty() {
            return Err(DeformError::NoRegions { name, least_m2: LEAST_AREA_M2 });
        }
        let places = places(&regions);
        Ok(Self { name, walls, regions, places, furniture })
    }

    /// Returns the lines of the walls, from corner to corner.
    pub fn walls(&self) -> impl Iterator<Item = Vec<[f64; 2]>> {
        self.walls.iter().map(|line| line.iter().map(|&corner| corner.into()).collect())
    }

    /// Returns the rooms, the corridors, and the parts of halls.
    pub fn regions(&self) -> &[Region] {
        &self.regions.list
    }

    /// Returns the furniture, which drawings leave out: that of the plan, or everything in a map that counts as furniture.
    pub fn furniture(&self) -> &[Furnishing] {
        &self.furniture
    }

    /// Returns the openings between the regions.
    pub fn doorways(&self) -> &[Doorway] {
        &self.regions.doorways
    }

    /// Returns the index of the region at a point, or `None` in walls and outside.
    pub fn region_at(&self, place: &Point<World>) -> Option<usize> {
        self.regions.at(place.coords())
    }

    /// Returns the places that a person would mark on the floor and in a drawing. These are the centres of
    /// the regions and, if there are too few of them, the points farthest from all others, up to seven in
    /// total.
    pub fn places(&self) -> &[Point<World>] {
        &self.places
    }
}

impl Furnishing {
    fn of(name: &str, corners: impl IntoIterator<Item = [f64; 2]>) -> Self {
        let mut low = Vector2::repeat(f64::INFINITY);
        let mut high = Vector2::repeat(f64::NEG_INFINITY);
        for corner in corners.into_iter().map(Vector2::from) {
            (low, high) = (low.inf(&corner), high.sup(&corner));
        }
        Self { name: name.to_owned(), center: ((low + high) / 2.0).into(), size_m: (high - low).into() }
    }
}

fn places(regions: &Regions) -> Vec<Point<World>> {
    let mut places: Vec<Point<World>> = regions.list.iter().map(|region| region.center).collect();
    if places.len() >= LEAST_PLACES {
        return places;
    }
    let open = open_places(regions);
    while places.len() < LEAST_PLACES {
        let lonely = |p: &Point<World>| places.iter().map(|q| q.distance(p)).fold(f64::INFINITY, f64::min);
        match open.iter().max_by(|a, b| lonely(a).total_cmp(&lonely(b))) {
            Some(place) => places.push(*place),
            None => break,
        }
    }
    places
}

/// Returns the centres of all cells that are well away from walls.
fn open_places(regions: &Regions) -> Vec<Point<World>> {
    let grid = &regions.grid;
    let closed: Vec<bool> = (0..grid.len()).map(|i| regions.at_cell(i).is_none()).collect();
    let depth_m = grid.distances_m(&closed);
    let open = (0..grid.len()).filter(|&i| depth_m[i] >= PLACE_CLEARANCE_M);
    open.map(|i| grid.middle(i).into()).collect()
}

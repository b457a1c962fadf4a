//! The true floor as a grid of the positions where the robot fits, with shortest paths. Positions are in metres, in the frame
//! `World`.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use sketchnav_sim::convex::Convex;
use sketchnav_sim::description::WorldDescription;
use sketchnav_sim::ros_map::OccupancyMap;

/// Steps to the eight neighbours of a cell, with their lengths in thousandths of a cell.
const STEPS: [(i64, i64, u64); 8] = [
    (1, 0, 1000),
    (-1, 0, 1000),
    (0, 1, 1000),
    (0, -1, 1000),
    (1, 1, 1414),
    (1, -1, 1414),
    (-1, 1, 1414),
    (-1, -1, 1414),
];

/// A grid of the positions where a disc of a given radius fits.
#[derive(Debug, Clone)]
pub struct Ground {
    width: i64,
    height: i64,
    fits: Vec<bool>,
    resolution_m: f64,
    origin_m: [f64; 2],
    clearance_m: f64,
}

impl Ground {
    /// Creates the ground of a map, for a robot whose centre must be at least `clearance_m` from the nearest wall.
    pub fn new(map: &OccupancyMap, clearance_m: f64) -> Self {
        let (width, height) = map.raster().size();
        let (width, height) = (width as i64, height as i64);
        let resolution_m = map.resolution_m();
        let reach = (clearance_m / resolution_m).ceil() as i64;
        let near = |dx: i64, dy: i64| {
            // Measure from the centre of this cell to the nearest point of the other cell.
            let gap = |d: i64| (d.abs() as f64 - 0.5).max(0.0) * resolution_m;
            gap(dx).hypot(gap(dy)) < clearance_m
        };
        let disc: Vec<_> = (-reach..=reach)
            .flat_map(|dy| (-reach..=reach).map(move |dx| (dx, dy)))
            .filter(|&(dx, dy)| near(dx, dy))
            .collect();
        let fits = |i: i64| {
            let (x, y) = (i % width, i / width);
            disc.iter().all(|(dx, dy)| !map.raster().is_solid(x + dx, y + dy))
        };
        let fits = (0..width * height).map(fits).collect();
        Self { width, height, fits, resolution_m, origin_m: map.origin_m(), clearance_m }
    }

    /// Creates the ground of any world, divided into cells of `resolution_m`. People who walk there do not count as obstacles.
    pub fn of_world(world: &WorldDescription, resolution_m: f64, clearance_m: f64) -> Self {
        let corners = || world.outline.iter().flatten();
        let extent = |axis: usize| {
            let along = corners().map(|corner| corner[axis]);
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
        };
        let ((left, right), (bottom, top)) = (extent(0), extent(1));
        let cells = |length: f64| (length / resolution_m).ceil().max(0.0) as i64;
        let (width, height) = (cells(right - left), cells(top - bottom));
        let origin_m = [left, bottom];
        let mut ground = Self { width, height, fits: Vec::new(), resolution_m, origin_m, clearance_m };
        let solids: Vec<_> =
            world.walls.iter().chain(&world.furniture).map(|solid| (extent_m(solid), solid)).collect();
        let fits = |i| {
            let at = ground.middle(i);
            // The bounding boxes rule out most solids.
            let is_away = |[low, high]: &[[f64; 2]; 2]| {
                (0..2).any(|axis| at[axis] < low[axis] - clearance_m || at[axis] > high[axis] + clearance_m)
            };
            solids.iter().all(|(extent, solid)| is_away(extent) || gap_m(solid, at) >= clearance_m)
        };
        ground.fits = (0..(width * height) as usize).map(fits).collect();
        ground
    }

    /// Adds a solid obstacle.
    pub fn put(&mut self, solid: &Convex) {
        for i in 0..self.fits.len() {
            self.fits[i] = self.fits[i] && gap_m(solid, self.middle(i)) >= self.clearance_m;
        }
    }

    /// Returns true if a robot at the given position keeps its clearance from a solid.
    pub fn clears(&self, solid: &Convex, at: [f64; 2]) -> bool {
        gap_m(solid, at) >= self.clearance_m
    }

    /// Returns true if the robot fits at a position.
    pub fn fits(&self, at: [f64; 2]) -> bool {
        self.index(at).is_some_and(|cell| self.fits[cell])
    }

    /// Returns all positions where the robot fits.
    pub fn places(&self) -> impl Iterator<Item = [f64; 2]> {
        (0..self.fits.len()).filter(|&i| self.fits[i]).map(|i| self.middle(i))
    }

    /// Returns the nearest position where the robot fits, among those accepted by `counts`.
    pub fn nearest(&self, at: [f64; 2], counts: impl Fn([f64; 2]) -> bool) -> Option<[f64; 2]> {
        let distance = |p: &[f64; 2]| (p[0] - at[0]).hypot(p[1] - at[1]);
        self.places().filter(|&p| counts(p)).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// Returns the shortest path between two positions, as the centres of its cells, or `None` if there is none.
    pub fn way(&self, from: [f64; 2], to: [f64; 2]) -> Option<Vec<[f64; 2]>> {
        let (from, to) = (self.index(from)?, self.index(to)?);
        let mut costs = vec![u64::MAX; self.fits.len()];
        let mut before = vec![usize::MAX; self.fits.len()];
        let mut open = BinaryHeap::from([Reverse((0, from))]);
        costs[from] = 0;
        while let Some(Reverse((cost, cell))) = open.pop() {
            if cell == to {
                return Some(self.trace(&before, from, to));
            }
            if cost > costs[cell] {
                continue;
            }
            for (next, step) in self.neighbours(cell) {
                if cost + step < costs[next] {
                    (costs[next], before[next]) = (cost + step, cell);
                    open.push(Reverse((cost + step, next)));
                }
            }
        }
        None
    }

    fn trace(&self, before: &[usize], from: usize, to: usize) -> Vec<[f64; 2]> {
        let back = std::iter::successors(Some(to), |&cell| (cell != from).then(|| before[cell]));
        let mut way: Vec<_> = back.map(|cell| self.middle(cell)).collect();
        way.reverse();
        way
    }

    fn neighbours(&self, cell: usize) -> impl Iterator<Item = (usize, u64)> + '_ {
        let (x, y) = (cell as i64 % self.width, cell as i64 / self.width);
        STEPS.iter().filter_map(move |(dx, dy, cost)| {
            let (x, y) = (x + dx, y + dy);
            let inside = (0..self.width).contains(&x) && (0..self.height).contains(&y);
            let next = (y * self.width + x) as usize;
            (inside && self.fits[next]).then_some((next, *cost))
        })
    }

    fn middle(&self, i: usize) -> [f64; 2] {
        let cell = [i as i64 % self.width, i as i64 / self.width];
        [0, 1].map(|axis| self.origin_m[axis] + (cell[axis] as f64 + 0.5) * self.resolution_m)
    }

    fn index(&self, at: [f64; 2]) -> Option<usize> {
        let [x, y] = [0, 1].map(|axis| ((at[axis] - self.origin_m[axis]) / self.resolution_m).floor() as i64);
        let inside = (0..self.width).contains(&x) && (0..self.height).contains(&y);
        inside.then_some((y * self.width + x) as usize)
    }
}

/// Returns the corners of the bounding box of a solid, in metres.
fn extent_m(solid: &Convex) -> [[f64; 2]; 2] {
    let corners = solid.corners().iter();
    corners.fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[low, high], at| {
        [[low[0].min(at[0]), low[1].min(at[1])], [high[0].max(at[0]), high[1].max(at[1])]]
    })
}

/// Returns the distance from a position to a solid, in metres, which is 0 inside it.
fn gap_m(solid: &Convex, at: [f64; 2]) -> f64 {
    let outside =
        |[a, b]: [[f64; 2]; 2]| (b[0] - a[0]) * (at[1] - a[1]) - (b[1] - a[1]) * (at[0] - a[0]) < 0.0;
    if !solid.edges().any(outside) {
        return 0.0;
    }
    solid.edges().map(|[a, b]| to_edge_m(&a, &b, at)).fold(f64::INFINITY, f64::min)
}

/// Returns the distance from a position to the nearest edge of a closed polygon, in metres.
pub fn to_outline_m(polygon: &[[f64; 2]], at: [f64; 2]) -> f64 {
    let edges = polygon.iter().zip(polygon.iter().cycle().skip(1));
    edges.map(|(a, b)| to_edge_m(a, b, at)).fold(f64::INFINITY, f64::min)
}

/// Returns the distance from a position to the line segment between two points, in metres.
pub fn to_edge_m(a: &[f64; 2], b: &[f64; 2], at: [f64; 2]) -> f64 {
    let (along, to) = ([b[0] - a[0], b[1] - a[1]], [at[0] - a[0], at[1] - a[1]]);
    let length = along[0] * along[0] + along[1] * along[1];
    let t = if length > 0.0 { ((to[0] * along[0] + to[1] * along[1]) / length).clamp(0.0, 1.0) } else { 0.0 };
    (to[0] - t * along[0]).hypot(to[1] - t * along[1])
}

/// Returns the length of a path, in metres.
pub fn length_m(way: &[[f64; 2]]) -> f64 {
    way.windows(2).map(|pair| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1])).sum()
}

/// Returns the direction in which a path sets out, in degrees: towards its first point that is at least `ahead_m` away, or its end.
pub fn departure_deg(way: &[[f64; 2]], ahead_m: f64) -> Option<f64> {
    let from = way.first()?;
    let far = |p: &&[f64; 2]| (p[0] - from[0]).hypot(p[1] - from[1]) >= ahead_m;
    let to = way.iter().find(far).or(way.last().filter(|last| *last != from))?;
    Some((to[1] - from[1]).atan2(to[0] - from[0]).to_degrees())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sketchnav_sim::ros_map::MapInfo;

    /// Returns a ground of seven by five cells of half a metre. A wall in the middle has a gap at the top.
    fn ground(clearance_m: f64) -> Ground {
        let yaml =
            "image: m\nresolution: 0.5\norigin: [10.0, 0.0, 0]\noccupied_thresh: 0.65\nfree_thresh: 0.2\n";
        let row = |wall: &str| format!("254 254 254 {wall} 254 254 254\n");
        let pixels = row("254") + &row("254") + &row("0").repeat(3);
        let info = MapInfo::parse(yaml).unwrap();
        let map = OccupancyMap::decode(&info, format!("P2\n7 5\n255\n{pixels}").as_bytes()).unwrap();
        Ground::new(&map, clearance_m)
    }

    #[test]
    fn the_shortest_path_leads_around_the_wall() {
        let way = ground(0.1).way([10.25, 0.25], [13.25, 0.25]).unwrap();
        assert_eq!((way[0], way[way.len() - 1]), ([10.25, 0.25], [13.25, 0.25]));
        assert!(way.iter().any(|p| p[1] > 1.5), "{way:?}");
        assert!((length_m(&way) - 6.0 * 0.5 * 2_f64.sqrt()).abs() < 1e-9, "six steps across: {way:?}");
        assert!(departure_deg(&way, 1.0).unwrap() > 30.0);
    }

    #[test]
    fn paths_keep_clear_of_boxes() {
        let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]];
        let outline = (0..4).map(|i| [corners[i], corners[(i + 1) % 4]]).collect();
        let furniture = vec![Convex::rectangle([2.0, 0.5], [1.0, 1.0], 0.0)];
        let world = WorldDescription { outline, furniture, ..Default::default() };
        let ground = Ground::of_world(&world, 0.1, 0.3);
        let at = ground.nearest([2.0, 0.5], |_| true).unwrap();
        assert!((gap_m(&world.furniture[0], at) - 0.3).abs() < 0.1, "{at:?}");
        assert_eq!(gap_m(&world.furniture[0], [2.1, 0.6]), 0.0);
        let way = ground.way([0.55, 0.55], [3.45, 0.55]).unwrap();
        assert!(way.iter().any(|p| p[1] > 1.29) && way.iter().all(|p| gap_m(&world.furniture[0], *p) >= 0.3));
    }

    #[test]
    fn a_large_robot_has_no_path() {
        assert!(ground(0.8).way([10.25, 0.25], [13.25, 0.25]).is_none());
    }

    #[test]
    fn the_nearest_free_place_keeps_clear_of_walls() {
        let at = ground(0.4).nearest([10.0, 0.0], |_| true).unwrap();
        assert_eq!(at, [10.75, 0.75]);
        assert_eq!(ground(0.4).nearest([10.0, 0.0], |_| false), None);
    }
}

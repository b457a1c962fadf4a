//! Finds the rooms of a floor and the openings between them, by the watersheds of the distance from the walls. There is an opening
//! wherever free space narrows between two wider areas.
//!
//! The outside does not count as a room, and neither does anything that is joined to the rest only by a slit.

use nalgebra::Vector2;
use sketchnav_schemas::geometry::{Point, World};

use crate::grid::{Grid, Solid};
use crate::outline;

/// Maximum width of an opening, as a share of the narrower of the two areas that it joins.
const NARROWING: f64 = 0.7;
/// Half the maximum width of an opening, in metres.
const WIDEST_M: f64 = 1.0;
/// Half the minimum width of an opening that can be passed, in metres.
const NARROWEST_M: f64 = 0.25;
/// Minimum area of a region, in square metres.
pub(crate) const LEAST_AREA_M2: f64 = 2.0;
/// Label of cells that belong to no region.
const NOWHERE: u32 = 0;

/// A room, a corridor, or a part of a hall. Coordinates are in metres, in frame `World`.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// Point of the region that is farthest from the walls.
    pub center: Point<World>,
    /// Distance of the centre from the walls, in metres.
    pub clearance_m: f64,
    /// Free area of the region, in square metres.
    pub area_m2: f64,
    /// Outline of the region, a simple polygon along the cells.
    pub polygon: Vec<[f64; 2]>,
}

/// An opening between two regions, such as a door.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Doorway {
    /// Indices of the regions that the opening joins.
    pub regions: [usize; 2],
    /// The two sides of the opening, in metres.
    pub jambs: [Point<World>; 2],
}

/// The regions of a floor, and which of them each cell is in.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Regions {
    pub grid: Grid,
    /// Index of each cell's region plus 1, or 0 if it belongs to none.
    labels: Vec<u32>,
    pub list: Vec<Region>,
    pub doorways: Vec<Doorway>,
}

impl Regions {
    pub fn of(solid: &Solid) -> Self {
        let depth_m = solid.grid.distances_m(&solid.cells);
        let mut basins = Basins::flood(&solid.grid, &depth_m);
        basins.merge_small(&solid.grid);
        let kept = basins.kept(solid);
        let mut labels: Vec<u32> = basins.labels.clone();
        for label in &mut labels {
            let root = basins.find(*label);
            *label = kept.iter().position(|&k| k == root).map_or(NOWHERE, |i| i as u32 + 1);
        }
        let list = (0..kept.len()).map(|i| region(&solid.grid, &labels, &depth_m, i)).collect();
        let doorways = doorways(&solid.grid, &labels);
        Self { grid: solid.grid.clone(), labels, list, doorways }
    }

    /// Returns the region at a point.
    pub fn at(&self, place: Vector2<f64>) -> Option<usize> {
        self.grid.index(place).and_then(|i| self.at_cell(i))
    }

    /// Returns the region of a cell.
    pub fn at_cell(&self, i: usize) -> Option<usize> {
        (self.labels[i] as usize).checked_sub(1)
    }
}

/// A saddle between two basins, and its distance from the walls.
struct Saddle {
    depth_m: f64,
    basins: [u32; 2],
}

/// Watersheds as a union-find structure, in which label 0 stands for no basin.
struct Basins {
    labels: Vec<u32>,
    parent: Vec<u32>,
    peak_m: Vec<f64>,
    cells: Vec<usize>,
    saddles: Vec<Saddle>,
}

impl Basins {
    /// Floods the floor, from the widest areas to the walls.
    fn flood(grid: &Grid, depth_m: &[f64]) -> Self {
        let mut order: Vec<usize> = (0..grid.len()).filter(|&i| depth_m[i] > 0.0).collect();
        order.sort_by(|&a, &b| depth_m[b].total_cmp(&depth_m[a]).then(a.cmp(&b)));
        let labels = vec![NOWHERE; grid.len()];
        let mut basins = Self { labels, parent: vec![0], peak_m: vec![0.0], cells: vec![0], saddles: vec![] };
        for i in order {
            basins.add(grid, i, depth_m);
        }
        basins
    }

    fn add(&mut self, grid: &Grid, i: usize, depth_m: &[f64]) {
        let mut deepest: Option<usize> = None;
        for k in grid.around(i) {
            if self.labels[k] == NOWHERE {
                continue;
            }
            self.meet(deepest.map_or(NOWHERE, |d| self.labels[d]), self.labels[k], depth_m[i]);
            if deepest.is_none_or(|d| depth_m[k] > depth_m[d]) {
                deepest = Some(k);
            }
        }
        self.labels[i] = match deepest {
            Some(d) => self.find(self.labels[d]),
            None => self.begin(depth_m[i]),
        };
        self.cells[self.labels[i] as usize] += 1;
    }

    fn begin(&mut self, peak_m: f64) -> u32 {
        let label = self.parent.len() as u32;
        self.parent.push(label);
        self.peak_m.push(peak_m);
        self.cells.push(0);
        label
    }

    /// Handles two basins that meet at a distance `depth_m` from the walls. They are either merged or joined by an opening.
    fn meet(&mut self, a: u32, b: u32, depth_m: f64) {
        let (a, b) = (self.find(a), self.find(b));
        if a == b || a == NOWHERE {
            return;
        }
        let peak_m = self.peak_m[a as usize].min(self.peak_m[b as usize]);
        if depth_m >= NARROWING * peak_m || depth_m >= WIDEST_M {
            self.join(a, b);
        } else {
            self.saddles.push(Saddle { depth_m, basins: [a, b] });
        }
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        if a == b {
            return;
        }
        let (high, low) = if self.peak_m[a as usize] >= self.peak_m[b as usize] { (a, b) } else { (b, a) };
        self.parent[low as usize] = high;
        self.cells[high as usize] += self.cells[low as usize];
    }

    fn find(&self, mut label: u32) -> u32 {
        while self.parent[label as usize] != label {
            label = self.parent[label as usize];
        }
        label
    }

    /// Merges each basin that is too small for a room with the one on the other side of its widest opening.
    fn merge_small(&mut self, grid: &Grid) {
        let least = (LEAST_AREA_M2 / grid.cell_m.powi(2)) as usize;
        let mut saddles = std::mem::take(&mut self.saddles);
        saddles.sort_by(|a, b| b.depth_m.total_cmp(&a.depth_m));
        for saddle in &saddles {
            let [a, b] = saddle.basins.map(|label| self.find(label) as usize);
            if self.cells[a].min(self.cells[b]) < least {
                self.join(a as u32, b as u32);
            }
        }
        self.saddles = saddles;
    }

    /// Returns the largest set of regions that are joined by openings, none of which reaches the rim.
    fn kept(&self, solid: &Solid) -> Vec<u32> {
        let least = (LEAST_AREA_M2 / solid.grid.cell_m.powi(2)) as usize;
        let mut outside = vec![false; self.parent.len()];
        for i in (0..self.labels.len()).filter(|&i| solid.grid.at_rim(i)) {
            outside[self.find(self.labels[i]) as usize] = true;
        }
        let inside = |label: u32| {
            let label = self.find(label) as usize;
            label > 0 && !outside[label] && self.cells[label] >= least
        };
        let mut sets: Vec<Vec<u32>> = Vec::new();
        for label in (1..self.parent.len() as u32).filter(|&l| self.parent[l as usize] == l && inside(l)) {
            if !sets.iter().any(|set| set.contains(&label)) {
                sets.push(self.joined(label, &inside));
            }
        }
        let area = |set: &Vec<u32>| set.iter().map(|&label| self.cells[label as usize]).sum::<usize>();
        sets.into_iter().max_by_key(area).unwrap_or_default()
    }

    /// Returns the regions joined to a region by passable openings, in the order of their labels.
    fn joined(&self, from: u32, inside: &impl Fn(u32) -> bool) -> Vec<u32> {
        let mut set = vec![from];
        loop {
            let passable = self.saddles.iter().filter(|saddle| saddle.depth_m >= NARROWEST_M);
            let more =
                passable.map(|saddle| saddle.basins.map(|label| self.find(label))).find_map(|[a, b]| {
                    let new = match (set.contains(&a), set.contains(&b)) {
                        (true, false) => b,
                        (false, true) => a,
                        _ => return None,
                    };
                    inside(new).then_some(new)
                });
            match more {
                Some(label) => set.push(label),
                None => break,
            }
        }
        set.sort_unstable();
        set
    }
}

fn region(grid: &Grid, labels: &[u32], depth_m: &[f64], index: usize) -> Region {
    let label = index as u32 + 1;
    let cells = || (0..labels.len()).filter(|&i| labels[i] == label);
    let deepest = cells().max_by(|&a, &b| depth_m[a].total_cmp(&depth_m[b]).then(b.cmp(&a))).unwrap_or(0);
    Region {
        center: grid.middle(deepest).into(),
        clearance_m: depth_m[deepest],
        area_m2: cells().count() as f64 * grid.cell_m.powi(2),
        polygon: outline::polygon(grid, |i| labels[i] == label),
    }
}

/// Finds the openings, which are the connected sets of cells where two regions touch.
fn doorways(grid: &Grid, labels: &[u32]) -> Vec<Doorway> {
    let mut seen = vec![false; labels.len()];
    let mut found = Vec::new();
    for i in 0..labels.len() {
        let Some(pair) = pair(grid, labels, i).filter(|_| !seen[i]) else { continue };
        let mut cells = Vec::new();
        let mut waiting = vec![i];
        while let Some(i) = waiting.pop() {
            if std::mem::replace(&mut seen[i], true) {
                continue;
            }
            cells.push(grid.middle(i));
            waiting.extend(grid.around(i).filter(|&k| self::pair(grid, labels, k) == Some(pair)));
        }
        let regions = pair.map(|label| label as usize - 1);
        found.push(Doorway { regions, jambs: farthest_apart(&cells).map(Point::from) });
    }
    found
}

/// Returns the labels of the two regions that touch at a cell, the lower label first.
fn pair(grid: &Grid, labels: &[u32], i: usize) -> Option<[u32; 2]> {
    let own = labels[i];
    let other = grid.around(i).map(|k| labels[k]).find(|&label| label != NOWHERE && label != own);
    other.filter(|_| own != NOWHERE).map(|other| [own.min(other), own.max(other)])
}

fn farthest_apart(places: &[Vector2<f64>]) -> [Vector2<f64>; 2] {
    let mut best = [places[0]; 2];
    for (i, a) in places.iter().enumerate() {
        for b in &places[i + 1..] {
            if (a - b).norm_squared() > (best[0] - best[1]).norm_squared() {
                best = [*a, *b];
            }
        }
    }
    best
}

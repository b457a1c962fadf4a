//! Divides free space into regions at its narrow passages.
//!
//! The regions are those of the watershed of the distance transform (F. Meyer, Topographic distance and watershed lines, Signal
//! Processing 1994), with cells flooded from the largest clearance down. When two floods meet at a saddle, they become one region
//! unless the saddle is much narrower than the smaller of the two. This ratio does not depend on the scale, so it works for
//! drawings as well.

use std::collections::BTreeMap;

use sketchnav_mapping::region::Region;
use sketchnav_motion::weighted_grid::chamfer;

/// Label of a cell that belongs to no region.
pub const NONE: u16 = 0;
/// Steps to the eight neighbours.
const AROUND: [[i64; 2]; 8] = [[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, 1], [1, -1], [-1, -1]];

/// Settings for dividing free space.
#[derive(Debug, Clone, Copy)]
pub struct Dividing {
    /// Share of the smaller region's clearance below which a saddle is a passage between two regions.
    pub ratio: f32,
    /// Clearance above which a saddle is never a passage, in cells.
    pub widest: f32,
    /// Area, in cells, below which a region becomes part of the neighbour with the longest common border.
    pub least_area: usize,
}

/// Free space divided into regions.
#[derive(Debug, Clone)]
pub struct Partition {
    /// Number of cells in a row.
    pub width: usize,
    /// The region of each cell, from 1, or [`NONE`].
    pub labels: Vec<u16>,
    /// Distance of each cell to the nearest solid one, in cells.
    pub clearance: Vec<f32>,
    /// The number of cells and the largest clearance of each region. The first entry is for [`NONE`].
    pub regions: Vec<(usize, f32)>,
}

impl Partition {
    /// Divides the cells of `free`. Clearance is measured to the cells of `solid`. A small region with a cell in `open` is
    /// discarded instead of being joined to a neighbour, because it is the visible part of a larger one.
    pub fn new(free: &Region, solid: &Region, open: &Region, dividing: &Dividing) -> Self {
        let width = free.width();
        let mut clearance = vec![0.0; free.cells()];
        if width > 2 && free.height() > 2 {
            let cap = (width + free.height()) as f32;
            chamfer(|cell| solid.contains(cell), width, 1.0, cap, &mut clearance);
        }
        let mut flood = Flood::new(free, &clearance, dividing);
        let mut partition = Self { width, labels: flood.labels(), clearance, regions: Vec::new() };
        partition.join_small(open, dividing.least_area);
        partition.number();
        partition
    }

    /// Joins regions that are too small to their neighbours, the smallest first.
    fn join_small(&mut self, open: &Region, least_area: usize) {
        let most = self.labels.iter().copied().max().unwrap_or_default() as usize + 1;
        let (mut area, mut is_open) = (vec![0_usize; most], vec![false; most]);
        for (cell, &label) in self.labels.iter().enumerate() {
            area[label as usize] += 1;
            is_open[label as usize] |= open.contains(cell);
        }
        area[NONE as usize] = 0;
        let mut borders: Vec<BTreeMap<u16, usize>> = vec![BTreeMap::new(); most];
        for [a, b] in self.contacts().map(|[a, b]| [self.labels[a], self.labels[b]]) {
            *borders[a as usize].entry(b).or_default() += 1;
            *borders[b as usize].entry(a).or_default() += 1;
        }
        // The new label of each label.
        let mut now: Vec<u16> = (0..most as u16).collect();
        while let Some(small) =
            (1..most).filter(|k| (1..least_area).contains(&area[*k])).min_by_key(|k| area[*k])
        {
            let to = borders[small].iter().max_by_key(|(label, length)| (**length, **label));
            let to = to.map(|(label, _)| *label as usize).filter(|_| !is_open[small]).unwrap_or_default();
            let joined = std::mem::take(&mut borders[small]);
            for (other, length) in joined {
                borders[other as usize].remove(&(small as u16));
                if to != NONE as usize && other as usize != to {
                    *borders[to].entry(other).or_default() += length;
                    *borders[other as usize].entry(to as u16).or_default() += length;
                }
            }
            if to != NONE as usize {
                area[to] += area[small];
                is_open[to] |= is_open[small];
            }
            area[small] = 0;
            now.iter_mut().filter(|label| **label as usize == small).for_each(|label| *label = to as u16);
        }
        self.labels.iter_mut().for_each(|label| *label = now[*label as usize]);
    }

    /// Renumbers the regions without gaps.
    fn number(&mut self) {
        let mut numbers = vec![NONE; self.labels.iter().copied().max().unwrap_or_default() as usize + 1];
        self.regions = vec![(0, 0.0)];
        for (label, clearance) in self.labels.iter_mut().zip(&self.clearance).filter(|(label, _)| **label > 0)
        {
            let number = &mut numbers[*label as usize];
            if *number == NONE {
                *number = self.regions.len() as u16;
                self.regions.push((0, 0.0));
            }
            *label = *number;
            let (area, peak) = &mut self.regions[*number as usize];
            (*area, *peak) = (*area + 1, peak.max(*clearance));
        }
    }

    /// Returns the pairs of cells that share a side and belong to different regions.
    pub fn contacts(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        let pair = |a: usize, b: usize| {
            let [x, y] = [self.labels[a], *self.labels.get(b)?];
            (x != y && x != NONE && y != NONE).then_some([a, b])
        };
        (0..self.labels.len()).flat_map(move |cell| {
            let right = ((cell + 1) % self.width > 0).then(|| pair(cell, cell + 1)).flatten();
            [right, pair(cell, cell + self.width)].into_iter().flatten()
        })
    }

    /// Returns the region at a place, given in cells, or the nearest region if the place lies outside all of them.
    pub fn at(&self, place: [f64; 2]) -> Option<u16> {
        let square = |cell: usize| {
            let (x, y) = ((cell % self.width) as f64 + 0.5, (cell / self.width) as f64 + 0.5);
            (x - place[0]).powi(2) + (y - place[1]).powi(2)
        };
        let labelled = (0..self.labels.len()).filter(|cell| self.labels[*cell] != NONE);
        let nearest = labelled.min_by(|a, b| square(*a).total_cmp(&square(*b)))?;
        Some(self.labels[nearest])
    }

    /// Returns the length of the path from `start` to each cell through regions, in cells, or `u32::MAX`.
    pub fn distances(&self, start: usize) -> Vec<u32> {
        let mut distances = vec![u32::MAX; self.labels.len()];
        let mut queue = std::collections::VecDeque::from([start]);
        distances[start] = 0;
        while let Some(cell) = queue.pop_front() {
            for next in sides(cell, self.width, self.labels.len()) {
                if self.labels[next] != NONE && distances[next] == u32::MAX {
                    distances[next] = distances[cell] + 1;
                    queue.push_back(next);
                }
            }
        }
        distances
    }
}

/// Returns the cells that share a side with a cell.
pub fn sides(cell: usize, width: usize, cells: usize) -> impl Iterator<Item = usize> {
    let column = cell % width;
    let left = (column > 0).then(|| cell - 1);
    let right = (column + 1 < width).then_some(cell + 1);
    let above = Some(cell + width).filter(|next| *next < cells);
    [left, right, cell.checked_sub(width), above].into_iter().flatten()
}

/// Flooding from the largest clearance down.
struct Flood {
    /// The basin of each cell, or `u32::MAX`.
    basins: Vec<u32>,
    /// The basin into which each basin was merged, or itself.
    parents: Vec<u32>,
}

impl Flood {
    fn new(free: &Region, clearance: &[f32], dividing: &Dividing) -> Self {
        const DRY: u32 = u32::MAX;
        let mut order: Vec<_> = free.iter().filter(|cell| clearance[*cell] > 0.0).collect();
        order.sort_by(|a, b| clearance[*b].total_cmp(&clearance[*a]));
        let mut flood = Self { basins: vec![DRY; clearance.len()], parents: Vec::new() };
        let mut peaks: Vec<f32> = Vec::new();
        for cell in order {
            let at = free.at(cell);
            let near = AROUND.iter().filter_map(|[x, y]| {
                let next = free.index([at[0] + x, at[1] + y])?;
                let height = clearance[next] - if x * y == 0 { 0.0 } else { 1e-3 };
                (flood.basins[next] != DRY).then_some((flood.basins[next], height))
            });
            let near: Vec<_> = near.collect();
            let Some((uphill, _)) = near.iter().copied().reduce(|a, b| if b.1 > a.1 { b } else { a }) else {
                flood.basins[cell] = peaks.len() as u32;
                flood.parents.push(peaks.len() as u32);
                peaks.push(clearance[cell]);
                continue;
            };
            flood.basins[cell] = uphill;
            let mut roots: Vec<_> = near.iter().map(|(basin, _)| flood.root(*basin)).collect();
            roots.sort_unstable();
            roots.dedup();
            let highest = |a: u32, b: u32| if peaks[b as usize] > peaks[a as usize] { b } else { a };
            let Some(main) = roots.iter().copied().reduce(highest) else { continue };
            for root in roots.into_iter().filter(|root| *root != main) {
                let least = dividing.widest.min(dividing.ratio * peaks[root as usize]);
                if clearance[cell] > least {
                    flood.parents[root as usize] = main;
                }
            }
        }
        flood
    }

    fn root(&mut self, mut basin: u32) -> u32 {
        while self.parents[basin as usize] != basin {
            let parent = self.parents[basin as usize];
            self.parents[basin as usize] = self.parents[parent as usize];
            basin = parent;
        }
        basin
    }

    /// Returns the label of each cell. Basins beyond the largest label are left out.
    fn labels(&mut self) -> Vec<u16> {
        let mut numbers = BTreeMap::new();
        (0..self.basins.len())
            .map(|cell| match self.basins[cell] {
                u32::MAX => NONE,
                basin => {
                    let next = numbers.len() + 1;
                    let root = self.root(basin);
                    u16::try_from(*numbers.entry(root).or_insert(next)).unwrap_or(NONE)
                }
            })
            .collect()
    }
}

//! Doors as wide as doors are.
//!
//! Who draws a door leaves a gap in a wall. The gap is a sign: where it is counts, how wide it is does not,
//! and hasty hands leave it narrow. Taken for a measure it tells the filter that the drawing is smaller here
//! than it is, and the robot drives past the right door. So a gap in a wall that is narrower than a door is
//! widened, on both sides, before the filter looks at the drawing. Nothing is made narrower.

use crate::sketch::Sketch;

/// A gap narrower than this share of a door is a slip of the pen, no door.
const SLIP: f32 = 0.2;
/// Cosine of the least angle between the two sides of a gap, seen from its middle.
const OPPOSITE: f32 = -0.7;
/// Beyond a gap there is more room than in it, by this factor. (In a corridor there is as much.)
const OPENS_OUT: f32 = 1.15;
/// A wall may lie so far beside the gap's line, as a share of the gap, ...
const BESIDE: f32 = 0.5;
/// ... and lead away from it by this slope.
const SLOPE: f32 = 0.3;
/// Walls fill less than this share of what lies around the gap's line.
const THIN: f32 = 0.5;
/// Of the wall beside it a gap takes no more than this share: small rooms have doors drawn small.
const TAKES: f32 = 0.25;

/// `sketch` with each gap in a wall at least `door_px` wide; `None` where that changes nothing.
pub fn widened(sketch: &Sketch, door_px: f32) -> Option<Sketch> {
    let nearest = Nearest::new(sketch, door_px);
    let mut gaps = nearest.gaps(SLIP * door_px..door_px);
    gaps.sort_by(|a, b| a.width_px.total_cmp(&b.width_px));
    let mut doors: Vec<Gap> = Vec::new();
    let mut cleared = vec![false; sketch.walls().len()];
    for gap in gaps {
        let is_known = doors.iter().any(|door| length(minus(door.middle(), gap.middle())) < door_px);
        if is_known || !nearest.opens_out(&gap) {
            continue;
        }
        let missing_px = (door_px - gap.width_px) / 2.0;
        for side in gap.sides() {
            side.clear(sketch, side.yields_px(sketch, missing_px), &mut cleared);
        }
        doors.push(gap);
    }
    cleared.contains(&true).then(|| sketch.cleared(&cleared))
}

type Vector = [f32; 2];

fn plus(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1]]
}

fn minus(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1]]
}

fn length([x, y]: Vector) -> f32 {
    x.hypot(y)
}

fn dot(a: Vector, b: Vector) -> f32 {
    a[0] * b[0] + a[1] * b[1]
}

/// Two wall cells with free cells between.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Gap {
    ends: [Vector; 2],
    width_px: f32,
}

/// One end of a gap.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Side {
    end: Vector,
    /// Unit vector away from the gap, the way that its wall goes.
    away: Vector,
    width_px: f32,
}

impl Gap {
    fn between(a: Vector, b: Vector) -> Self {
        Self { ends: [a, b], width_px: length(minus(a, b)) - 1.0 }
    }

    fn middle(&self) -> Vector {
        let [a, b] = self.ends;
        [(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0]
    }

    fn sides(&self) -> [Side; 2] {
        let [a, b] = self.ends;
        let side = |end, other| {
            let away = minus(end, other).map(|v| v / (self.width_px + 1.0));
            Side { end, away, width_px: self.width_px }
        };
        [side(a, b), side(b, a)]
    }
}

impl Side {
    /// How far beside the gap's line its wall may lie, `along` pixels from the gap's end.
    fn band_px(&self, along: f32) -> f32 {
        BESIDE * self.width_px + SLOPE * along.max(0.0)
    }

    /// The place so far along the wall and so far beside the gap's line.
    fn at(&self, along: f32, beside: f32) -> Vector {
        let ([x, y], [dx, dy]) = (self.end, self.away);
        [x + dx * along - dy * beside, y + dy * along + dx * beside]
    }

    /// How much of its wall the side gives to the gap, at most `missing_px`, and of the wall's length up to
    /// where it ends or another meets it no more than its share. Nothing where it goes on for less than the
    /// gap is wide (a post), or where all is solid.
    fn yields_px(&self, sketch: &Sketch, missing_px: f32) -> f32 {
        let is_wall = |along: f32, beside: i32| {
            let [x, y] = self.at(along, beside as f32);
            sketch.is_wall_cell(x.round() as i64, y.round() as i64)
        };
        let around = self.width_px.ceil() as i32;
        let (mut yields_px, mut walls, mut cells) = (missing_px, 0, 0);
        for along in (0..=(missing_px / TAKES).ceil() as usize).map(|along| along as f32) {
            let band = self.band_px(along).ceil() as i32;
            let ends = !(-band..=band).any(|beside| is_wall(along, beside));
            if ends && along < self.width_px {
                return 0.0;
            }
            if ends || is_wall(along, band + 1) || is_wall(along, -band - 1) {
                yields_px = yields_px.min(TAKES * along);
                break;
            }
            walls += (-around..=around).filter(|&beside| is_wall(along, beside)).count();
            cells += 2 * around as usize + 1;
        }
        if walls as f32 > THIN * cells as f32 { 0.0 } else { yields_px }
    }

    /// Marks the wall's cells up to `along_px` from the gap.
    fn clear(&self, sketch: &Sketch, along_px: f32, cleared: &mut [bool]) {
        if along_px < 1.0 {
            return;
        }
        let reach = along_px + self.band_px(along_px);
        let [columns, rows] = [(0, sketch.width()), (1, sketch.height())].map(|(axis, size)| {
            let cell = |v: f32| v.clamp(0.0, size as f32 - 1.0) as usize;
            cell(self.end[axis] - reach)..=cell(self.end[axis] + reach)
        });
        for row in rows {
            for column in columns.clone() {
                let from_end = minus([column as f32, row as f32], self.end);
                let along = dot(from_end, self.away);
                let beside = dot(from_end, [-self.away[1], self.away[0]]);
                cleared[row * sketch.width() + column] |=
                    (-1.0..along_px - 0.5).contains(&along) && beside.abs() <= self.band_px(along);
            }
        }
    }
}

/// Of each free cell the nearest wall cell, where that is no farther than half a door.
struct Nearest<'a> {
    sketch: &'a Sketch,
    /// From the cell to its wall, in cells.
    to_wall: Vec<Option<[i16; 2]>>,
}

impl<'a> Nearest<'a> {
    /// By two passes over the eight neighbours, who know the nearest wall or one hardly farther away
    /// (Danielsson 1980).
    fn new(sketch: &'a Sketch, door_px: f32) -> Self {
        let [width, height] = [sketch.width(), sketch.height()];
        let to_wall = sketch.walls().iter().map(|&wall| wall.then_some([0, 0])).collect();
        let mut nearest = Self { sketch, to_wall };
        let reach_px = door_px / 2.0 + 2.0;
        for row in 0..height {
            for column in 0..width {
                nearest.ask([column, row], [[-1, 0], [-1, -1], [0, -1], [1, -1]], reach_px);
            }
            (0..width).rev().for_each(|column| nearest.ask([column, row], [[1, 0]], reach_px));
        }
        for row in (0..height).rev() {
            for column in (0..width).rev() {
                nearest.ask([column, row], [[1, 0], [1, 1], [0, 1], [-1, 1]], reach_px);
            }
            (0..width).for_each(|column| nearest.ask([column, row], [[-1, 0]], reach_px));
        }
        nearest
    }

    /// Takes a neighbour's wall where it is nearer than the cell's own.
    fn ask<const N: usize>(&mut self, [column, row]: [usize; 2], neighbours: [[i16; 2]; N], reach_px: f32) {
        let at = row * self.sketch.width() + column;
        for [dx, dy] in neighbours {
            let there = [column.wrapping_add_signed(dx.into()), row.wrapping_add_signed(dy.into())];
            let Some([x, y]) = self.get(there) else { continue };
            let (found, reach2) = ([x + dx, y + dy], (reach_px * reach_px) as i32);
            if self.to_wall[at].map_or(reach2, squared) > squared(found) {
                self.to_wall[at] = Some(found);
            }
        }
    }

    fn get(&self, [column, row]: [usize; 2]) -> Option<[i16; 2]> {
        let inside = column < self.sketch.width() && row < self.sketch.height();
        inside.then(|| self.to_wall[row * self.sketch.width() + column]).flatten()
    }

    /// Where two neighbours have their walls on opposite sides there is a gap between these.
    fn gaps(&self, widths_px: std::ops::Range<f32>) -> Vec<Gap> {
        let width = self.sketch.width();
        let gap = |at: usize, [dx, dy]: [usize; 2]| {
            let (column, row) = (at % width, at / width);
            let here = self.to_wall[at]?.map(f32::from);
            let there = self.get([column + dx, row + dy])?.map(f32::from);
            let (place, next) = ([column as f32, row as f32], [(column + dx) as f32, (row + dy) as f32]);
            let gap = Gap::between(plus(place, here), plus(next, there));
            let is_opposite = dot(here, there) < OPPOSITE * length(here) * length(there);
            (is_opposite && widths_px.contains(&gap.width_px)).then_some(gap)
        };
        (0..self.to_wall.len()).flat_map(|at| [gap(at, [1, 0]), gap(at, [0, 1])]).flatten().collect()
    }

    /// Whether there is more room on both sides of the wall than in the gap.
    fn opens_out(&self, gap: &Gap) -> bool {
        let [middle, side] = [gap.middle(), gap.sides()[0].away];
        let step = gap.width_px / 2.0 + 3.0;
        [step, -step].iter().all(|step| {
            let place = [middle[0] - step * side[1], middle[1] + step * side[0]];
            let cell = place.map(|v| if v < 0.0 { usize::MAX } else { v.round() as usize });
            let is_wide = |to_wall: [i16; 2]| length(to_wall.map(f32::from)) > OPENS_OUT * gap.width_px / 2.0;
            self.get(cell).is_none_or(is_wide)
        })
    }
}

fn squared([x, y]: [i16; 2]) -> i32 {
    i32::from(x).pow(2) + i32::from(y).pow(2)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use sketchnav_schemas::codes::{FREE, WALL};

    use super::*;

    const SIZE: usize = 200;
    const DOOR_PX: f32 = 30.0;

    /// A sheet of 200 × 200 px; `is_wall` says which cells are wall.
    fn sheet(is_wall: impl Fn(usize, usize) -> bool) -> Sketch {
        let cell = |i: usize| if is_wall(i % SIZE, i / SIZE) { WALL } else { FREE };
        Sketch::new(SIZE, SIZE, &(0..SIZE * SIZE).map(cell).collect::<Vec<u8>>(), 0.0).unwrap()
    }

    /// Whether a row is one of the three that a wall along the sheet's middle fills.
    fn is_in_wall(row: usize) -> bool {
        (99..=101).contains(&row)
    }

    /// The columns of row 100 that are free.
    fn open(sketch: &Sketch) -> Vec<i64> {
        (0..SIZE as i64).filter(|&column| !sketch.is_wall_cell(column, 100)).collect()
    }

    #[test]
    fn a_narrow_door_becomes_as_wide_as_a_door_to_both_sides() {
        let found = widened(&sheet(|x, y| is_in_wall(y) && !(95..105).contains(&x)), DOOR_PX).unwrap();
        assert_eq!(open(&found), (85..115).collect::<Vec<i64>>());
    }

    #[test]
    fn a_wide_door_and_a_slip_of_the_pen_stay_as_they_are() {
        for open in [80..120, 98..102] {
            assert!(widened(&sheet(|x, y| is_in_wall(y) && !open.contains(&x)), DOOR_PX).is_none());
        }
    }

    #[test]
    fn a_narrow_corridor_is_no_door() {
        let walls = sheet(|x, y| (20..180).contains(&y) && [90, 91, 110, 111].contains(&x));
        assert!(widened(&walls, DOOR_PX).is_none());
    }

    #[test]
    fn a_passage_through_solid_wall_stays_as_it_is() {
        let solid = sheet(|x, y| (70..130).contains(&y) && !(92..108).contains(&x));
        assert!(widened(&solid, DOOR_PX).is_none());
    }

    /// A wall that runs on past both sides of the door: there is no more room beyond than in the gap.
    #[test]
    fn a_door_along_another_wall_stays_as_it_is() {
        let walls = sheet(|x, y| (88..=90).contains(&x) || is_in_wall(y) && x > 103);
        assert!(widened(&walls, DOOR_PX).is_none());
    }

    /// Two walls 32 px apart, between them a door of 17 px: some 8 px of wall on each side, of which a quarter.
    #[test]
    fn a_door_takes_no_more_than_its_share_of_the_wall_beside_it() {
        let across = |x: usize, y: usize| y > 100 && [83, 84, 117, 118].contains(&x);
        let found = widened(&sheet(|x, y| across(x, y) || is_in_wall(y) && !(92..109).contains(&x)), DOOR_PX);
        let open = open(&found.unwrap());
        assert!((18..=22).contains(&open.len()) && open.contains(&90) && !open.contains(&87), "{open:?}");
    }

    proptest! {
        /// A door in a wall at any angle, more than twice as wide as the pen.
        #[test]
        fn a_door_is_widened_in_a_wall_that_runs_anywhere(
            angle in 0.0_f32..std::f32::consts::PI,
            gap in 12.0_f32..26.0,
            pen in 1.0_f32..2.7,
        ) {
            let (sin, cos) = angle.sin_cos();
            let place = |x: usize, y: usize| {
                let (dx, dy) = (x as f32 - 100.0, y as f32 - 100.0);
                (dx * cos + dy * sin, dy * cos - dx * sin)
            };
            let drawn = sheet(|x, y| {
                let (along, beside) = place(x, y);
                beside.abs() <= pen && along.abs() > gap / 2.0
            });
            let found = widened(&drawn, DOOR_PX).unwrap();
            for (x, y) in (0..SIZE * SIZE).map(|i| (i % SIZE, i / SIZE)) {
                let (along, beside) = place(x, y);
                let [was, is] = [&drawn, &found].map(|s| s.is_wall_cell(x as i64, y as i64));
                prop_assert!(was || !is, "a wall grew at {x}, {y}");
                if beside.abs() <= pen && along.abs() < DOOR_PX / 2.0 - 3.0 {
                    prop_assert!(!is, "still wall at {along}, {beside}");
                }
                if along.abs() > DOOR_PX / 2.0 + 3.0 {
                    prop_assert!(was == is, "opened too far at {along}, {beside}");
                }
            }
        }

        /// Whatever is drawn: no wall grows, and nothing panics.
        #[test]
        fn no_drawing_gets_more_walls(seed in any::<u64>(), strokes in 0usize..12, door_px in 1.0_f32..120.0) {
            let mut state = seed;
            let mut draw = || {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (state >> 33) as f32 / (1u64 << 31) as f32 * SIZE as f32
            };
            let lines: Vec<[f32; 4]> = (0..strokes).map(|_| std::array::from_fn(|_| draw())).collect();
            let is_near = |[ax, ay, bx, by]: [f32; 4], x: f32, y: f32| {
                let (dx, dy) = (bx - ax, by - ay);
                let t = (((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy).max(1e-6)).clamp(0.0, 1.0);
                (x - ax - t * dx).hypot(y - ay - t * dy) < 2.0
            };
            let drawn = sheet(|x, y| lines.iter().any(|&line| is_near(line, x as f32, y as f32)));
            if let Some(found) = widened(&drawn, door_px) {
                prop_assert!(drawn.walls().iter().zip(found.walls()).all(|(was, is)| *was || !is));
            }
        }
    }
}

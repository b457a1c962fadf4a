//! A small building, with walls as line segments, furniture, a drawing of the walls, and what a laser sees.

use bytemuck::Zeroable;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use sketchnav_schemas::codes::WALL;
use sketchnav_schemas::message::LaserScan;
use sketchnav_schemas::seed;
use sketchnav_sketch::sketch::SketchGrid;

type Segment = [[f64; 2]; 2];

/// Returns the walls, in metres, of a corridor of 16 m with three rooms on either side.
fn walls() -> Vec<Segment> {
    let mut walls = vec![
        [[0.0, 0.0], [16.0, 0.0]],
        [[16.0, 0.0], [16.0, 12.0]],
        [[16.0, 12.0], [0.0, 12.0]],
        [[0.0, 12.0], [0.0, 0.0]],
    ];
    for x in [5.0, 10.5] {
        walls.push([[x, 0.0], [x, 5.0]]);
        walls.push([[x + 0.5, 7.0], [x + 0.5, 12.0]]);
    }
    for (y, doors) in [(5.0, [2.0, 8.0, 13.5]), (7.0, [3.5, 7.0, 14.0])] {
        let mut from = 0.0;
        for door in doors {
            walls.push([[from, y], [door - 0.5, y]]);
            from = door + 0.5;
        }
        walls.push([[from, y], [16.0, y]]);
    }
    walls
}

/// Furniture that is not drawn, as centre and radius of discs, in metres.
const FURNITURE: [[f64; 3]; 5] =
    [[1.0, 1.0, 0.4], [7.0, 1.2, 0.5], [11.5, 10.5, 0.5], [15.2, 6.0, 0.3], [4.4, 11.0, 0.6]];

/// The robot's path, which leads out of a room, along the corridor, and into other rooms and back.
pub const WAY: [[f64; 2]; 15] = [
    [2.0, 2.5],
    [2.0, 6.0],
    [7.0, 6.0],
    [7.0, 9.0],
    [9.0, 10.0],
    [7.0, 9.0],
    [7.0, 6.0],
    [8.0, 6.0],
    [8.0, 3.0],
    [8.0, 6.0],
    [13.5, 6.0],
    [13.5, 3.0],
    [13.5, 6.0],
    [14.0, 6.0],
    [14.0, 9.0],
];

/// A drawing of the building, which may be stretched, turned and have shaky corners.
#[derive(Debug, Clone, Copy)]
pub struct Drawing {
    /// Width and height, in pixels.
    pub size: [usize; 2],
    /// Scale along the corridor, in pixels per metre.
    pub a: f64,
    /// Scale across the corridor, in pixels per metre.
    pub b: f64,
    /// Rotation of the paper, in radians.
    pub turn_rad: f64,
    /// Standard deviation of the corners' positions, in pixels.
    pub wobble_px: f64,
}

impl Drawing {
    pub fn px(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.turn_rad.sin_cos();
        let (x, y) = ((x - 8.0) * self.a, (y - 6.0) * self.b);
        let [width, height] = self.size.map(|s| s as f64 / 2.0);
        [width + cos * x - sin * y, height + sin * x + cos * y]
    }

    pub fn sketch(&self) -> SketchGrid {
        let [width, height] = self.size;
        let mut rng = seed::stream(11, "wobble");
        let mut cells = vec![0u8; width * height];
        for wall in walls() {
            let [from, to] =
                wall.map(|corner| self.px(corner).map(|c| c + self.wobble_px * normal(&mut rng)));
            let steps = ((to[0] - from[0]).hypot(to[1] - from[1]) * 2.0).ceil();
            for k in 0..=steps as usize {
                let t = k as f64 / steps;
                let at = [0, 1].map(|i| (from[i] + t * (to[i] - from[i])) as usize);
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    cells[(at[1] + dy) * width + at[0] + dx] = WALL;
                }
            }
        }
        SketchGrid::new(width, height, &cells, self.turn_rad).unwrap()
    }
}

/// Returns a scan of `beams` beams from a pose (x m, y m, yaw rad). The last beam is as far to the left as the first is to the
/// right, and each range has an error.
pub fn scan_from(
    [x, y, yaw]: [f64; 3],
    beams: usize,
    first_rad: f32,
    range_max_m: f32,
    mut error_m: impl FnMut() -> f64,
) -> LaserScan {
    let walls = walls();
    let mut scan = LaserScan::zeroed();
    (scan.beam_count, scan.range_min_m, scan.range_max_m) = (beams as u32, 0.02, range_max_m);
    (scan.angle_min_rad, scan.angle_max_rad) = (first_rad, -first_rad);
    scan.angle_increment_rad = -2.0 * first_rad / (beams - 1) as f32;
    for i in 0..beams {
        let range = range([x, y], yaw + f64::from(scan.angle_rad(i)), &walls) + error_m();
        scan.ranges_m[i] = if range > range_max_m.into() { f32::INFINITY } else { range as f32 };
    }
    scan
}

/// Returns the distance to the first wall or piece of furniture.
fn range(from: [f64; 2], direction: f64, walls: &[Segment]) -> f64 {
    let (dy, dx) = direction.sin_cos();
    let to_walls = walls.iter().filter_map(|[p, q]| {
        let (ex, ey) = (q[0] - p[0], q[1] - p[1]);
        let (px, py) = (p[0] - from[0], p[1] - from[1]);
        let across = dx * ey - dy * ex;
        let (t, u) = ((px * ey - py * ex) / across, (px * dy - py * dx) / across);
        (t > 0.0 && (0.0..=1.0).contains(&u)).then_some(t)
    });
    let to_discs = FURNITURE.iter().filter_map(|[x, y, radius]| {
        let along = (x - from[0]) * dx + (y - from[1]) * dy;
        let away = ((x - from[0]) * dy - (y - from[1]) * dx).abs();
        (along > 0.0 && away < *radius).then(|| along - (radius * radius - away * away).sqrt())
    });
    to_walls.chain(to_discs).fold(f64::INFINITY, f64::min)
}

pub fn normal(rng: &mut Pcg64Mcg) -> f64 {
    StandardNormal.sample(rng)
}

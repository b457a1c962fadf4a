//! A camera that looks straight down on a plane of dots: which dots it shows, and how accurately (Park and
//! Kender 1995, 3.1).
//!
//! Each dot has an independent error in each view. Some dots are missed, and some dots that are shown do not exist.

use rand::RngExt;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Pose, World};
use sketchnav_schemas::message::{DotView, MAX_DOTS, SeenDot};
use sketchnav_schemas::robot::DotCamera;

use super::DRAWS_PER_READING;

/// A camera over a plane of dots.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DownCamera {
    model: DotCamera,
    stream: Pcg64Mcg,
}

impl DownCamera {
    /// Creates the camera `model`. Its noise comes from `stream`.
    pub fn new(model: &DotCamera, stream: Pcg64Mcg) -> Self {
        Self { model: model.clone(), stream }
    }

    /// Fills in view number `number` from above `robot`, except for the header. The same arguments give the
    /// same view. If there are more dots than fit into a message, those nearest to the centre are kept.
    pub fn fill(&self, robot: &Pose<World>, dots: &[[f64; 2]], number: u64, view: &mut DotView) {
        view.side_m = self.model.side_m as f32;
        view.margin_m = self.model.margin_m as f32;
        view.frame_time_s = (1.0 / self.model.rate_hz) as f32;
        let mut stream = self.stream.clone();
        stream.advance(u128::from(number) * DRAWS_PER_READING);
        let (mut seen, mut count) = ([SeenDot { x_m: 0.0, y_m: 0.0 }; MAX_DOTS], 0);
        for dot in self.shown(robot, dots) {
            if let Some(dot) = self.measure(dot, &mut stream) {
                keep(&mut seen, &mut count, dot);
            }
        }
        let half = self.half_m();
        for _ in 0..poisson(self.model.false_dots, &mut stream) {
            let at = [stream.random_range(-half..=half), stream.random_range(-half..=half)];
            keep(&mut seen, &mut count, dot(at));
        }
        // Sorting keeps the order from revealing which dot is which.
        seen[..count].sort_by(|a, b| a.y_m.total_cmp(&b.y_m).then(a.x_m.total_cmp(&b.x_m)));
        view.dots[..count].copy_from_slice(&seen[..count]);
        view.dot_count = count as u32;
    }

    /// Returns half the side length of the area that the camera sees, in metres.
    fn half_m(&self) -> f64 {
        self.model.side_m / 2.0 + self.model.margin_m
    }

    /// Returns the dots that the camera sees, in the axes of its window.
    fn shown(&self, robot: &Pose<World>, dots: &[[f64; 2]]) -> impl Iterator<Item = [f64; 2]> {
        let ((sin, cos), half, [x, y]) = (robot.yaw_rad.sin_cos(), self.half_m(), [robot.x, robot.y]);
        let relative = move |dot: &[f64; 2]| {
            let (east, north) = (dot[0] - x, dot[1] - y);
            [east * cos + north * sin, north * cos - east * sin]
        };
        dots.iter().map(relative).filter(move |at| at.iter().all(|v| v.abs() <= half))
    }

    /// Returns a dot as measured, or `None` if the camera misses it.
    fn measure(&self, at: [f64; 2], stream: &mut Pcg64Mcg) -> Option<SeenDot> {
        let is_missed = stream.random::<f64>() < self.model.miss;
        let noise_m = self.model.noise_m;
        let at = at.map(|v| v + stream.sample::<f64, _>(StandardNormal) * noise_m);
        (!is_missed).then_some(dot(at))
    }
}

fn dot([x, y]: [f64; 2]) -> SeenDot {
    SeenDot { x_m: x as f32, y_m: y as f32 }
}

/// Adds a dot, replacing the farthest one if the view is full.
fn keep(seen: &mut [SeenDot; MAX_DOTS], count: &mut usize, dot: SeenDot) {
    let far = |dot: &SeenDot| dot.x_m.hypot(dot.y_m);
    if *count < MAX_DOTS {
        seen[*count] = dot;
        *count += 1;
    } else if let Some(furthest) = seen.iter_mut().max_by(|a, b| far(a).total_cmp(&far(b)))
        && far(&dot) < far(furthest)
    {
        *furthest = dot;
    }
}

/// Returns a Poisson-distributed number by Knuth's product of random numbers, which is fast enough for a small mean.
fn poisson(mean: f64, stream: &mut Pcg64Mcg) -> u32 {
    let (limit, mut product, mut count) = ((-mean).exp(), stream.random::<f64>(), 0);
    while product > limit {
        product *= stream.random::<f64>();
        count += 1;
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;
    use sketchnav_schemas::message::Message;
    use sketchnav_schemas::seed;

    fn camera(change: impl FnOnce(&mut DotCamera)) -> DownCamera {
        let mut model = DotCamera {
            model: "c".into(),
            side_m: 2.0,
            margin_m: 0.5,
            rate_hz: 10.0,
            noise_m: 0.0,
            miss: 0.0,
            false_dots: 0.0,
        };
        change(&mut model);
        DownCamera::new(&model, seed::stream(1, "world/view"))
    }

    fn view(camera: &DownCamera, robot: Pose<World>, dots: &[[f64; 2]], number: u64) -> DotView {
        let mut view = DotView::zeroed();
        camera.fill(&robot, dots, number, &mut view);
        assert!(view.is_valid());
        view
    }

    fn places(view: &DotView) -> Vec<[f32; 2]> {
        view.dots().iter().map(|dot| [dot.x_m, dot.y_m]).collect()
    }

    #[test]
    fn the_window_shows_its_dots_and_margin_in_its_own_axes() {
        let quarter = Pose::new(10.0, 10.0, std::f64::consts::FRAC_PI_2);
        let seen = view(&camera(|_| ()), quarter, &[[11.0, 10.0], [10.0, 11.4], [10.0, 11.6]], 0);
        let expected = [[0.0, -1.0], [1.4, 0.0]];
        for (found, expected) in places(&seen).iter().zip(expected) {
            assert!(
                (found[0] - expected[0]).abs() < 1e-6 && (found[1] - expected[1]).abs() < 1e-6,
                "{found:?}"
            );
        }
        assert_eq!(seen.dot_count, 2);
    }

    #[test]
    fn errors_have_the_stated_size() {
        let camera = camera(|model| (model.noise_m, model.miss, model.false_dots) = (0.05, 0.2, 0.3));
        let origin = Pose::new(0.0, 0.0, 0.0);
        let all: Vec<_> = (0..4000).map(|number| view(&camera, origin, &[[0.2, 0.1]], number)).collect();
        let count: u32 = all.iter().map(|view| view.dot_count).sum();
        assert!((f64::from(count) / 4000.0 - 1.1).abs() < 0.05, "{count}");
        let true_ones: Vec<f32> = (all.iter().flat_map(places))
            .map(|[x, y]| (x - 0.2).hypot(y - 0.1))
            .filter(|off| *off < 0.2)
            .collect();
        let square = true_ones.iter().map(|off| off * off).sum::<f32>() / true_ones.len() as f32;
        assert!((square.sqrt() - 0.0707).abs() < 0.01, "{square}");
        assert_eq!(places(&view(&camera, origin, &[[0.2, 0.1]], 7)), places(&all[7]));
    }

    #[test]
    fn in_a_crowd_the_nearest_dots_are_kept() {
        let crowd: Vec<_> = (0..100).map(|k| [0.01 * f64::from(k), 0.0]).collect();
        let seen = view(&camera(|_| ()), Pose::new(0.0, 0.0, 0.0), &crowd, 0);
        assert_eq!(seen.dot_count as usize, MAX_DOTS);
        assert!(places(&seen).iter().all(|[x, _]| *x < 0.635));
    }
}

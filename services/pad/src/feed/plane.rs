//! What there is to see of journeys by custom maps: the plane as the map-maker sees it, and the window where it is if the
//! navigator is right about its landmark. Where dots in the window lie beside those of the plane, it is wrong.

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use sketchnav_schemas::message::{Description, Itinerary, Journey};

use super::{PlanView, PoseView, tenth};

/// The longer side of the canvas, pixels.
const SIDE_PX: f64 = 1000.0;
/// What is left around the dots, pixels.
const RIM_PX: f64 = 60.0;
/// Radius of a dot, pixels.
const DOT_PX: f64 = 6.0;

/// A plane on a canvas.
#[derive(Debug, Clone, PartialEq)]
pub struct Ground {
    low_m: [f64; 2],
    px_per_m: f64,
    /// Width and height.
    pub size_px: [u32; 2],
    dots_m: Vec<[f64; 2]>,
}

impl Ground {
    /// Of the dots as the map-maker sees them; `None` without a dot.
    pub fn of(dots_m: Vec<[f64; 2]>) -> Option<Self> {
        let extent = |axis: usize| {
            let along = dots_m.iter().map(|dot| dot[axis]);
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
        };
        let [(left, right), (bottom, top)] = [extent(0), extent(1)];
        let (width_m, height_m) = (right - left, top - bottom);
        let longer_m = width_m.max(height_m);
        if !longer_m.is_finite() {
            return None;
        }
        let px_per_m = (SIDE_PX - 2.0 * RIM_PX) / longer_m.max(1e-6);
        let side_px = |length_m: f64| (length_m * px_per_m + 2.0 * RIM_PX).round() as u32;
        let size_px = [side_px(width_m), side_px(height_m)];
        Some(Self { low_m: [left, bottom], px_per_m, size_px, dots_m })
    }

    /// A place on the canvas, tenths of a pixel.
    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let across = RIM_PX + (x - self.low_m[0]) * self.px_per_m;
        let down = f64::from(self.size_px[1]) - RIM_PX - (y - self.low_m[1]) * self.px_per_m;
        [tenth(across), tenth(down)]
    }

    /// The dots, black on nothing, as a PNG.
    pub fn picture(&self) -> Option<Vec<u8>> {
        let [width, height] = self.size_px;
        let mut alpha = vec![0_u8; width as usize * height as usize];
        for dot in &self.dots_m {
            let [x, y] = self.at(*dot);
            let around = |middle: f64, most: u32| {
                let (low, high) = (middle - DOT_PX - 1.0, middle + DOT_PX + 1.0);
                (low.max(0.0) as u32)..(high.max(0.0) as u32).min(most)
            };
            for (row, column) in
                around(y, height).flat_map(|row| around(x, width).map(move |column| (row, column)))
            {
                let far = (f64::from(column) + 0.5 - x).hypot(f64::from(row) + 0.5 - y);
                let own = ((DOT_PX - far + 0.5).clamp(0.0, 1.0) * 255.0) as u8;
                let pixel = &mut alpha[row as usize * width as usize + column as usize];
                *pixel = (*pixel).max(own);
            }
        }
        let pixels: Vec<u8> = alpha.into_iter().flat_map(|alpha| [0, alpha]).collect();
        let mut png = Vec::new();
        PngEncoder::new(&mut png).write_image(&pixels, width, height, ExtendedColorType::La8).ok()?;
        Some(png)
    }

    /// The planned landmarks of the task under way, from the one at hand on, and the window as a square around its centre.
    pub fn plan(
        &self,
        itinerary: &Itinerary,
        journey: &Journey,
        window: Option<([f64; 2], f64)>,
    ) -> PlanView {
        let landmarks =
            itinerary.landmarks(journey.task as usize).skip(journey.accepted.saturating_sub(1) as usize);
        let global = landmarks.map(|landmark| self.at([landmark.x_m.into(), landmark.y_m.into()]));
        let square = window.map(|([x, y], side_m)| {
            let half = side_m / 2.0;
            let corners = [[-half, -half], [half, -half], [half, half], [-half, half], [-half, -half]];
            corners.map(|[dx, dy]| self.at([x + dx, y + dy])).to_vec()
        });
        PlanView { global: global.collect(), local: square.unwrap_or_default() }
    }

    /// The window as the page shows a robot.
    pub fn pose(&self, centre: [f64; 2]) -> PoseView {
        let [x, y] = self.at(centre);
        let (ellipse, radius_px) = ([0.0; 3], 4.0);
        PoseView {
            x,
            y,
            heading_rad: std::f64::consts::FRAC_PI_2,
            ellipse,
            radius_px,
            tracking: "tracking",
            effective: 1.0,
        }
    }

    /// The dots in view.
    pub fn seen(&self, description: &Description, [x, y]: [f64; 2]) -> Vec<[f64; 2]> {
        let place = |dot: &sketchnav_schemas::message::DescribedDot| {
            self.at([x + f64::from(dot.x_m), y + f64::from(dot.y_m)])
        };
        description.dots().iter().map(place).collect()
    }
}

/// Where the window's centre is if the landmark that the navigator has attained last is the one that its map means.
pub fn centre(itinerary: &Itinerary, journey: &Journey) -> Option<[f64; 2]> {
    let attained = journey.accepted.checked_sub(1)? as usize;
    let landmark =
        itinerary.landmarks(journey.task as usize).nth(attained).filter(|_| journey.has_reference == 1)?;
    Some([f64::from(landmark.x_m) - journey.reference_x_m, f64::from(landmark.y_m) - journey.reference_y_m])
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;
    use sketchnav_schemas::message::{DescribedDot, PlannedLandmark};

    #[test]
    fn the_window_is_where_its_landmark_says() {
        let ground = Ground::of(vec![[0.0, 0.0], [1.0, 0.5]]).unwrap();
        assert_eq!(ground.size_px, [1000, 560]);
        assert_eq!(ground.at([1.0, 0.5]), [940.0, 60.0]);
        let mut itinerary: Box<Itinerary> = bytemuck::zeroed_box();
        itinerary.landmark_count = 2;
        itinerary.landmarks[1] = PlannedLandmark { task: 0, dot: 1, x_m: 1.0, y_m: 0.5 };
        let mut journey = Journey::zeroed();
        assert_eq!(centre(&itinerary, &journey), None);
        (journey.accepted, journey.has_reference, journey.reference_x_m) = (2, 1, 0.25);
        let at = centre(&itinerary, &journey).unwrap();
        assert_eq!(at, [0.75, 0.5]);
        let plan = ground.plan(&itinerary, &journey, Some((at, 0.5)));
        assert_eq!((plan.global.len(), plan.local.len()), (1, 5));
        let mut description = Description::zeroed();
        description.dot_count = 1;
        description.dots[0] = DescribedDot { x_m: 0.25, y_m: 0.0, isolation: 0, quadrants: 0 };
        assert_eq!(ground.seen(&description, at), [[940.0, 60.0]], "on the dot of the plane");
    }

    #[test]
    fn dots_are_black_on_nothing() {
        let ground = Ground::of(vec![[0.0, 0.0], [1.0, 1.0]]).unwrap();
        let picture = image::load_from_memory(&ground.picture().unwrap()).unwrap().to_luma_alpha8();
        assert_eq!((picture.get_pixel(940, 60).0, picture.get_pixel(500, 500).0[1]), ([0, 255], 0));
        assert!(Ground::of(Vec::new()).is_none());
        assert!(Ground::of(vec![[0.5, 0.5]]).unwrap().picture().is_some());
    }
}

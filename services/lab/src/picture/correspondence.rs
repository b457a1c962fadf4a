//! Draws the correspondence between a drawing and what a robot has seen. One picture shows the outline of the drawing, and the
//! other one the partners of its samples on the floor. A sample and its partner have the same colour.

use sketchnav_schemas::geometry::{Point, Pose, Sketch, World};
use sketchnav_schemas::message::GroundTruth;
use sketchnav_sketch::messages::{Correspondence, CourseAim, OutlineSample, PartnerKind};

use super::svg::{GREEN, Sheet, View};
use super::{DrawnGoal, FloorShapes, PictureError};

/// The partners on the floor, for [`seen_outline`].
#[derive(Debug, Clone)]
pub struct SeenOutline<'a> {
    /// Heading of the picture.
    pub title: &'a str,
    /// Walls and objects on the floor.
    pub shapes: &'a FloorShapes,
    /// True pose of the origin of the robot's map.
    pub origin: Pose<World>,
    /// True path of the robot.
    pub trail: &'a [Point<World>],
    /// The correspondence between the drawing and the map.
    pub found: &'a Correspondence,
}

/// Draws the outline in the drawing as SVG.
///
/// # Errors
/// [`PictureError`] if the number of cells does not match the size, or if they cannot be encoded as a PNG.
pub fn drawn_outline(drawn: &DrawnGoal<'_>, found: &Correspondence) -> Result<String, PictureError> {
    let mut sheet = drawn.sheet()?;
    for (k, sample) in found.samples().iter().enumerate() {
        let at = Point::<Sketch>::new(sample.x_px.into(), sample.y_px.into());
        dot(&mut sheet, &at, &colour(k, found), sample);
    }
    drawn.mark(&mut sheet);
    words(&mut sheet, found);
    Ok(sheet.finish())
}

/// Returns the true pose of the origin of the robot's map, which follows from the robot's true pose and its pose in the map.
pub fn origin_of(found: &Correspondence, truth: &[GroundTruth]) -> Pose<World> {
    let until = truth.partition_point(|truth| truth.header.stamp_ns <= found.header.stamp_ns);
    let Some(truth) = truth[..until].last() else { return Pose::new(0.0, 0.0, 0.0) };
    let robot = Pose::<World>::new(found.robot.x_m, found.robot.y_m, found.robot.yaw_rad());
    let back = robot.motion_to(&Pose::new(0.0, 0.0, 0.0));
    truth.pose().compose(&back)
}

/// Draws the partners on the floor as SVG.
pub fn seen_outline(picture: &SeenOutline<'_>) -> String {
    let found = picture.found;
    let at = |[x, y]: [f64; 2]| picture.origin.compose(&Pose::<World>::new(x, y, 0.0)).position();
    let partners: Vec<_> =
        found.samples().iter().map(|sample| at([sample.x_m.into(), sample.y_m.into()])).collect();
    let walls = picture.shapes.walls.iter().flatten();
    let view = View::around(walls.chain(&partners).chain(picture.trail));
    let mut sheet = Sheet::new(view, picture.title);
    sheet
        .segments(&picture.shapes.walls, "stroke=\"#b9c0cc\" stroke-width=\"2.4\" stroke-linecap=\"square\"");
    sheet.line(picture.trail, "stroke=\"#2f6fd0\" stroke-width=\"3\" stroke-opacity=\"0.55\"");
    let way = &found.way_m[..(found.way_count as usize).min(found.way_m.len())];
    let way: Vec<_> = way.iter().map(|place| at(place.map(f64::from))).collect();
    sheet.line(&way, "stroke=\"#1d8a4a\" stroke-width=\"3.5\" stroke-dasharray=\"9 6\"");
    let (seen, unseen) = corrected(found.samples(), &partners);
    sheet.segments(&seen, "stroke=\"#49566b\" stroke-width=\"2\" stroke-opacity=\"0.7\"");
    let dashed = "stroke=\"#49566b\" stroke-width=\"1.4\" stroke-opacity=\"0.6\" stroke-dasharray=\"3 5\"";
    sheet.segments(&unseen, dashed);
    for (k, (sample, at)) in found.samples().iter().zip(&partners).enumerate() {
        if sample.partner != PartnerKind::Nothing.code() {
            dot(&mut sheet, at, &colour(k, found), sample);
        }
    }
    let robot = found.robot.yaw_rad();
    let robot = picture.origin.compose(&Pose::<World>::new(found.robot.x_m, found.robot.y_m, robot));
    super::marks::start(&mut sheet, &robot);
    if found.seen_share > 0.0 {
        sheet.cross(&at(found.goal_m), GREEN);
    }
    if found.rival_margin >= 0.0 {
        sheet.cross(&at(found.rival_m), "#c2410c");
    }
    sheet.scale_bar(1.0);
    sheet.caption("Dark line: the drawing as corrected by the floor; dotted where the robot has not looked.");
    words(&mut sheet, found);
    sheet.finish()
}

type Segments = Vec<[Point<World>; 2]>;

/// Returns the drawing as corrected by the floor: an outline through the partners of its samples, as pieces along walls that were
/// seen and pieces through gaps. Samples without a partner are left out.
fn corrected(samples: &[OutlineSample], partners: &[Point<World>]) -> (Segments, Segments) {
    let has_partner = |(sample, _): &(&OutlineSample, _)| sample.partner != PartnerKind::Nothing.code();
    let placed: Vec<_> = samples.iter().zip(partners).filter(has_partner).collect();
    let is_wall = |sample: &OutlineSample| sample.partner == PartnerKind::Wall.code();
    let (mut seen, mut unseen) = (Vec::new(), Vec::new());
    for ((a, from), (b, to)) in placed.iter().zip(placed.iter().cycle().skip(1)) {
        let segments = if is_wall(a) && is_wall(b) { &mut seen } else { &mut unseen };
        segments.push([**from, **to]);
    }
    (seen, unseen)
}

/// Returns the colour of a sample. The colours run through the colour wheel once around the outline.
fn colour(sample: usize, found: &Correspondence) -> String {
    let turn = 6.0 * sample as f64 / f64::from(found.sample_count.max(1));
    let channel = |shift: f64| {
        let off = ((turn + shift) % 6.0 - 3.0).abs() - 1.0;
        (40.0 + 160.0 * off.clamp(0.0, 1.0)) as u8
    };
    format!("#{:02x}{:02x}{:02x}", channel(0.0), channel(4.0), channel(2.0))
}

fn dot<F>(sheet: &mut Sheet, at: &Point<F>, colour: &str, sample: &OutlineSample) {
    let [x, y] = sheet.view.at(at);
    let radius = 3.0 + 40.0 * f64::from(sample.goal_share).clamp(0.0, 0.25);
    let style = match PartnerKind::from_code(sample.partner) {
        Some(PartnerKind::Wall) => format!("fill=\"{colour}\""),
        Some(PartnerKind::Gap) => format!("fill=\"#ffffff\" stroke=\"{colour}\" stroke-width=\"2\""),
        _ => "fill=\"#c7ccd4\"".to_owned(),
    };
    sheet.raw(format_args!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" {style}/>"));
}

fn words(sheet: &mut Sheet, found: &Correspondence) {
    let aim = CourseAim::from_code(found.aim).unwrap_or(CourseAim::None);
    let margin = match found.rival_margin {
        margin if margin >= 0.0 => format!("; the best rival costs {margin:.2} more"),
        _ => String::new(),
    };
    let key = "Filled: seen as wall. Hollow: behind a gap. Grey: no partner. Larger: more of the goal.";
    let shares = [found.seen_share, found.hidden_share].map(|share| 100.0 * share);
    let summary = format!(
        "{:.0} % of the goal's outline seen, {:.0} % behind gaps; aim: {aim}{margin}.",
        shares[0], shares[1]
    );
    [key, &summary].into_iter().for_each(|line| sheet.caption(line));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corrected_drawing_is_closed_and_omits_unmatched_parts() {
        let kinds = [PartnerKind::Wall, PartnerKind::Wall, PartnerKind::Nothing, PartnerKind::Gap];
        let sample =
            |kind: PartnerKind| OutlineSample { partner: kind.code(), ..bytemuck::Zeroable::zeroed() };
        let partners: Vec<_> = (0..4).map(|k| Point::<World>::new(f64::from(k), 0.0)).collect();
        let (seen, unseen) = corrected(&kinds.map(sample), &partners);
        let places = |segments: Segments| segments.iter().map(|[a, b]| [a.x, b.x]).collect::<Vec<_>>();
        assert_eq!(places(seen), [[0.0, 1.0]]);
        assert_eq!(places(unseen), [[1.0, 3.0], [3.0, 0.0]]);
        assert_eq!(corrected(&[], &[]), (Vec::new(), Vec::new()));
    }
}

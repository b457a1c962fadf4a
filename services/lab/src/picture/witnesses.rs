//! Draws the answers of three witnesses about a goal: the regions and doors of the drawing, those of the robot's map, and where
//! each witness locates the goal. A region of the drawing and its partner have the same colour.

use sketchnav_schemas::geometry::{Point, Pose, Sketch, World};
use sketchnav_sketch::rooms::{Answer, Floor, Kind};

use super::svg::{INK, Sheet, View};
use super::{DrawnGoal, FloorShapes, PictureError};

/// Names of the witnesses, each with its colour.
const WITNESSES: [(&str, &str); 3] =
    [("particle filter", "#2f6fd0"), ("outline", "#c2410c"), ("regions and doors", "#8a3ffc")];
/// Hue of the first region, and difference between the hues of successive regions, in degrees. This difference, the golden angle,
/// ensures that successive numbers never have similar hues.
const HUES: [f64; 2] = [30.0, 137.5];
const NO_PARTNER: &str = "#aab0ba";

/// Where each witness locates the goal, for [`claims`].
#[derive(Debug, Clone)]
pub struct Claims<'a> {
    /// Heading of the picture.
    pub title: &'a str,
    /// Walls and objects on the floor.
    pub shapes: &'a FloorShapes,
    /// True path of the robot.
    pub trail: &'a [Point<World>],
    /// Corners of the true place of the goal.
    pub place: &'a [Point<World>],
    /// Where the filter, the outline, and regions and doors locate the goal, in this order.
    pub claims: [Option<Point<World>>; 3],
    /// True pose of the origin of the robot's map.
    pub origin: Pose<World>,
    /// The regions and doors of the robot's map, and the answer based on them, if there is one.
    pub rooms: Option<(&'a Floor, &'a Answer)>,
}

/// Draws the regions and doors of a drawing as SVG. `rooms` contains them and the answer about them, if there is one.
///
/// # Errors
/// [`PictureError`] if the number of cells does not match the size, or if they cannot be encoded as a PNG.
pub fn drawn_rooms(drawn: &DrawnGoal<'_>, rooms: Option<(&Floor, &Answer)>) -> Result<String, PictureError> {
    let mut sheet = drawn.sheet()?;
    if let Some((floor, answer)) = rooms {
        let colour = |room| {
            let has_partner = answer.regions.iter().any(|[drawn, _]| *drawn == room);
            if has_partner { hue(room) } else { NO_PARTNER.to_owned() }
        };
        regions(&mut sheet, floor, |[x, y]| Point::<Sketch>::new(x, y), colour);
    }
    drawn.mark(&mut sheet);
    sheet.caption("Lines: outlines of regions. Dots: doors. Green cross: the goal.");
    Ok(sheet.finish())
}

/// Draws where each witness locates the goal, as SVG.
pub fn claims(picture: &Claims<'_>) -> String {
    let at = |[x, y]: [f64; 2]| picture.origin.compose(&Pose::<World>::new(x, y, 0.0)).position();
    let walls = picture.shapes.walls.iter().flatten();
    let view = View::around(walls.chain(picture.trail).chain(picture.claims.iter().flatten()));
    let mut sheet = Sheet::new(view, picture.title);
    let grey = "stroke=\"#b9c0cc\" stroke-width=\"2.4\" stroke-linecap=\"square\"";
    sheet.segments(&picture.shapes.walls, grey);
    sheet.polygon(picture.place, "fill=\"#1d8a4a\" fill-opacity=\"0.15\" stroke=\"#1d8a4a\"");
    if let Some((floor, answer)) = picture.rooms {
        let colour = |room| {
            let drawn = answer.regions.iter().find(|[_, seen]| *seen == room);
            drawn.map_or_else(|| NO_PARTNER.to_owned(), |[drawn, _]| hue(*drawn))
        };
        regions(&mut sheet, floor, at, colour);
        for &place in &answer.places {
            let [x, y] = sheet.view.at(&at(place));
            let fill = WITNESSES[2].1;
            sheet.raw(format_args!(
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{fill}\" fill-opacity=\"0.35\"/>"
            ));
        }
    }
    sheet.line(picture.trail, "stroke=\"#49566b\" stroke-width=\"2.5\" stroke-opacity=\"0.6\"");
    for ((_, colour), claim) in WITNESSES.iter().zip(&picture.claims) {
        claim.iter().for_each(|claim| sheet.cross(claim, colour));
    }
    sheet.scale_bar(1.0);
    for (((name, colour), claim), column) in WITNESSES.iter().zip(&picture.claims).zip(0..) {
        let name = if claim.is_some() { format!("✕ {name}") } else { format!("{name}: nowhere yet") };
        sheet.text(
            [24.0 + 260.0 * f64::from(column), sheet.bottom + 12.0],
            16.0,
            "start",
            colour,
            "600",
            &name,
        );
    }
    sheet.bottom += 22.0;
    sheet.caption(
        "Crosses: the goal according to each witness. Green: its true place. Grey line: the robot's path.",
    );
    sheet.caption("Colours: regions with a partner in the drawing. Dots: doors. Dashed: gaps, not seen yet.");
    sheet.finish()
}

/// Draws the outlines of all regions and the doors between them. `at` converts positions from the drawing or the map.
fn regions<F>(
    sheet: &mut Sheet,
    floor: &Floor,
    at: impl Fn([f64; 2]) -> Point<F>,
    colour: impl Fn(u16) -> String,
) {
    let at = |place| at(floor.frame.to_place(place));
    for (room, label) in floor.rooms.iter().zip(0..) {
        let (mut walls, mut gaps) = (Vec::new(), Vec::new());
        for (token, next) in room.tokens.iter().zip(room.tokens.iter().cycle().skip(1)) {
            let piece = [at(token.place), at(next.place)];
            match [token.kind, next.kind] {
                kinds if kinds.iter().any(|kind| matches!(kind, Kind::Cut)) => {}
                kinds if kinds.iter().any(|kind| matches!(kind, Kind::Gap | Kind::NarrowGap)) => {
                    gaps.push(piece)
                }
                _ => walls.push(piece),
            }
        }
        let stroke = format!("stroke=\"{}\" stroke-linecap=\"round\"", colour(label));
        sheet.segments(&walls, &format!("{stroke} stroke-width=\"4\""));
        sheet.segments(&gaps, &format!("{stroke} stroke-width=\"2.5\" stroke-dasharray=\"3 7\""));
    }
    for door in &floor.doors {
        let [x, y] = sheet.view.at(&at(door.place));
        sheet.raw(format_args!(
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"6\" fill=\"#ffffff\" stroke=\"{INK}\" stroke-width=\"2.5\"/>"
        ));
    }
}

/// Returns the colour of a region of the drawing.
fn hue(room: u16) -> String {
    let degrees = (HUES[0] + HUES[1] * f64::from(room)) % 360.0;
    format!("hsl({degrees:.0} 65% 42%)")
}

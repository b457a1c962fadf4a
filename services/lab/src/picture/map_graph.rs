//! Draws custom maps as graphs. Each entry has a row, which shows the landmark to seek and the signs that determine how to
//! continue.
//!
//! The path along the right landmarks leads downwards. Branches to other entries are arcs on the left, which are blue if they lead
//! to later entries and orange otherwise. A sign is drawn as the four quadrants around the landmark, with north up, each with the
//! dots in it. `NE → 4` means: move the landmark to the corner NE and continue at entry 4.

use std::fmt::Write;

use sketchnav_directions::custom_map::graph::{Edge, Node};
use sketchnav_directions::custom_map::{Direction, Entry, Recovery, Sign, Verification};
use sketchnav_directions::{Corner, CustomMap, Signature};

use super::svg::{GREEN, INK, RED, SHEET_WIDTH, Sheet, View};

/// Colour of the legend.
const QUIET: &str = "#5a6b86";
/// Colour of branches to later entries.
const ON: &str = "#2f6fd0";
/// Colour of branches to the same or an earlier entry.
const BACK: &str = "#c2600c";

/// Height of a row of signs.
const ROW: f64 = 44.0;
/// Height of the name of a map.
const NAME: f64 = 40.0;
/// Height of the legend.
const LEGEND: f64 = 34.0;
/// Horizontal position of the circles that represent entries.
const COLUMN: f64 = 250.0;
/// Radius of these circles.
const RADIUS: f64 = 14.0;
/// Left edge of the text.
const WORDS: f64 = 284.0;
/// Left edge of the first sign.
const SIGNS: f64 = 440.0;
/// Size of a sign.
const SIGN: f64 = 26.0;
/// Width of a sign, including the entry that it leads to.
const CHIP: f64 = 122.0;
/// Maximum number of signs in a line.
const CHIPS: usize = 6;
/// Distance of the widest arc from the circles of the entries.
const BULGE: f64 = 225.0;

/// Returns an SVG image of custom maps, each with its name.
pub fn map_graph(title: &str, maps: &[(&str, &CustomMap)]) -> String {
    let heights = maps.iter().map(|(_, map)| NAME + rows(map).iter().sum::<f64>());
    let mut sheet = Sheet::new(View::plain(heights.sum::<f64>() + LEGEND), title);
    let [_, mut top, _, height] = sheet.view.frame();
    legend(&mut sheet, top + height - LEGEND / 2.0);
    for (name, map) in maps {
        sheet.text([36.0, top + 26.0], 15.0, "start", INK, "600", name);
        top += NAME;
        top += graph(&mut sheet, map, top);
    }
    sheet.finish()
}

/// Returns the height of each entry's row, followed by that of the goal.
fn rows(map: &CustomMap) -> Vec<f64> {
    let of = |entry: usize| ROW * chips(map, entry).len().div_ceil(CHIPS).max(1) as f64;
    (0..map.entries().len()).map(of).chain([ROW]).collect()
}

/// A sign that is drawn beside an entry, and the entry or landmark that it leads to.
struct Chip {
    sign: Option<Sign>,
    words: String,
    colour: &'static str,
}

fn chips(map: &CustomMap, entry: usize) -> Vec<Chip> {
    let edge = |edge: Edge| {
        let to = match edge.to {
            Node::Entry(to) => (to + 1).to_string(),
            Node::Goal => "goal".to_owned(),
        };
        let words = match edge.corner {
            Some(corner) => format!("{} → {to}", corner.word()),
            None => to,
        };
        Chip { sign: edge.sign, words, colour: colour(edge) }
    };
    let signs = map.entries()[entry].verification;
    let back = |(sign, Recovery { corner, word }): (Sign, Recovery)| Chip {
        sign: Some(sign),
        words: format!("{}, {word}", corner.word()),
        colour: RED,
    };
    let recoveries = signs.into_iter().flat_map(Verification::recoveries).map(back);
    map.edges(entry).map(edge).chain(recoveries).collect()
}

fn colour(edge: Edge) -> &'static str {
    match edge.to {
        _ if edge.is_right => GREEN,
        Node::Entry(to) if to <= edge.from => BACK,
        _ => ON,
    }
}

/// Draws a map whose top edge is at `top`. Returns the height of the map.
fn graph(sheet: &mut Sheet, map: &CustomMap, top: f64) -> f64 {
    let rows = rows(map);
    let middle = |row: usize| top + rows[..row].iter().sum::<f64>() + ROW / 2.0;
    let goal = map.entries().len();
    let row = |node: Node| match node {
        Node::Entry(entry) => entry,
        Node::Goal => goal,
    };
    let mut edges: Vec<Edge> = (0..goal).flat_map(|entry| map.edges(entry)).collect();
    // Several signs may lead to the same entry. The right one is drawn above the others.
    edges.sort_by_key(|edge| (edge.from, row(edge.to), edge.is_right));
    for edge in &edges {
        let (from, to) = (middle(edge.from), middle(row(edge.to)));
        match row(edge.to) == edge.from + 1 {
            true => arrow_down(sheet, [from, to], colour(*edge)),
            false => arc(sheet, [from, to], rows.iter().sum(), colour(*edge)),
        }
    }
    for (number, entry) in map.entries().iter().enumerate() {
        let y = middle(number);
        circle(sheet, y, &(number + 1).to_string(), INK);
        sheet.text([WORDS, y + 5.0], 15.0, "start", INK, "500", &command(entry));
        for (place, chip) in chips(map, number).iter().enumerate() {
            let (column, line) = ((place % CHIPS) as f64, (place / CHIPS) as f64);
            draw_chip(sheet, [SIGNS + column * CHIP, y + line * ROW], chip);
        }
    }
    circle(sheet, middle(goal), "", GREEN);
    sheet.text([WORDS, middle(goal) + 5.0], 15.0, "start", GREEN, "600", "goal");
    rows.iter().sum()
}

/// Returns a short description of the landmark that an entry seeks.
fn command(entry: &Entry) -> String {
    let bearing = entry.bearing_deg.map_or(String::new(), |bearing| format!(" {bearing:03}°"));
    let slide = match entry.trajectory {
        None => "",
        Some(Direction::Forward) => ", slide on",
        Some(Direction::Backward) => ", slide back",
    };
    format!("{}{bearing}{slide}", entry.landmark())
}

fn circle(sheet: &mut Sheet, y: f64, text: &str, colour: &str) {
    sheet.raw(format_args!(
        "<circle cx=\"{COLUMN}\" cy=\"{y:.1}\" r=\"{RADIUS}\" fill=\"#ffffff\" stroke=\"{colour}\" stroke-width=\"2\"/>"
    ));
    if text.is_empty() {
        sheet.raw(format_args!("<circle cx=\"{COLUMN}\" cy=\"{y:.1}\" r=\"8\" fill=\"{colour}\"/>"));
    }
    sheet.text([COLUMN, y + 5.0], 13.0, "middle", colour, "600", text);
}

fn arrow_down(sheet: &mut Sheet, [from, to]: [f64; 2], colour: &str) {
    let end = to - RADIUS - 2.0;
    sheet.raw(format_args!(
        "<path d=\"M{COLUMN} {:.1}V{end:.1}m-5 -7l5 7 5 -7\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>",
        from + RADIUS
    ));
}

/// Draws an arc on the left of the entries. The farther apart they are, the wider the arc. `height` is the height of the whole
/// graph.
fn arc(sheet: &mut Sheet, [from, to]: [f64; 2], height: f64, colour: &str) {
    let x = COLUMN - RADIUS;
    // An entry may lead to itself.
    let (from, to) = if from == to { (from - 7.0, to + 7.0) } else { (from - 3.0, to + 3.0) };
    let left = x - 34.0 - (BULGE - 34.0) * ((to - from).abs() / height).sqrt();
    sheet.raw(format_args!(
        "<path d=\"M{x:.1} {from:.1}C{left:.1} {from:.1} {left:.1} {to:.1} {:.1} {to:.1}m-8 -5l8 5 -8 5\" fill=\"none\" \
         stroke=\"{colour}\" stroke-width=\"1.6\" stroke-opacity=\"0.85\"/>",
        x - 1.0
    ));
}

fn draw_chip(sheet: &mut Sheet, [x, y]: [f64; 2], chip: &Chip) {
    let words = match chip.sign {
        Some(sign) => {
            draw_sign(sheet, [x, y], sign, chip.colour);
            chip.words.clone()
        }
        None => format!("any: {}", chip.words),
    };
    let begin = x + chip.sign.map_or(0.0, |_| SIGN + 8.0);
    sheet.text([begin, y + 5.0], 14.0, "start", chip.colour, "500", &words);
}

/// Draws a sign, given the middle of its left edge.
fn draw_sign(sheet: &mut Sheet, [x, y]: [f64; 2], sign: Sign, colour: &str) {
    let (left, top, half) = (x, y - SIGN / 2.0, SIGN / 2.0);
    sheet.raw(format_args!(
        "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{SIGN}\" height=\"{SIGN}\" rx=\"3\" fill=\"#ffffff\" stroke=\"{colour}\"/>"
    ));
    match sign {
        Sign::Panorama(seen) => {
            let dots = dots(seen, [left + half, y]);
            sheet.raw(format_args!(
                "<path d=\"M{left:.1} {y:.1}h{SIGN}M{:.1} {top:.1}v{SIGN}\" stroke=\"{colour}\" stroke-opacity=\"0.3\"/>{dots}",
                left + half
            ));
        }
        sign => sheet.text([left + half, y + 5.0], 14.0, "middle", INK, "600", &sign.to_string()),
    }
}

/// Returns the dots of a panorama around this point.
fn dots(seen: Signature, [x, y]: [f64; 2]) -> String {
    let mut shapes = String::new();
    for quadrant in Corner::ALL {
        let (inward, middle) = (quadrant.inward(), SIGN / 4.0);
        let places: &[[f64; 2]] = match seen.dots(quadrant) {
            0 => &[],
            1 => &[[0.0, 0.0]],
            2 => &[[-2.7, 0.0], [2.7, 0.0]],
            _ => &[[-2.9, 2.2], [2.9, 2.2], [0.0, -2.6]],
        };
        for [dx, dy] in places {
            let (cx, cy) = (x + inward.x * middle + dx, y - inward.y * middle + dy);
            // Writing into a `String` cannot fail.
            let _ = write!(shapes, "<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"2\" fill=\"{INK}\"/>");
        }
    }
    shapes
}

fn legend(sheet: &mut Sheet, y: f64) {
    let example = Signature::of_words("none+point+pair+group").map(Sign::Panorama);
    for (x, sign) in [(40.0, example), (480.0, Some(Sign::Other)), (604.0, Some(Sign::Nothing))] {
        if let Some(sign) = sign {
            draw_sign(sheet, [x, y], sign, QUIET);
        }
    }
    for (x, words) in [
        (74.0, "around the landmark: none, one, two and more, clockwise from the NW"),
        (514.0, "any other"),
        (638.0, "no landmark"),
    ] {
        sheet.text([x, y + 4.5], 12.0, "start", QUIET, "400", words);
    }
    let mut x = 740.0;
    for (words, colour) in [("right", GREEN), ("branch on", ON), ("branch back", BACK), ("recovery", RED)] {
        sheet.raw(format_args!("<path d=\"M{x:.1} {y:.1}h22\" stroke=\"{colour}\" stroke-width=\"2.4\"/>"));
        sheet.text([x + 28.0, y + 4.5], 12.0, "start", QUIET, "400", words);
        x += 40.0 + 7.4 * words.len() as f64;
    }
    debug_assert!(x < SHEET_WIDTH);
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAP: &str = "(*, SW)\n(Isol, (point+none+group+pair, NE, 4), (-, SE, 1), (none+point+none+none, -), SW)\n\
                       (Isol, -)\n(Isol, Trajn, (3, SW, IsolPair), (2, NE, 2), (1, -), -)\n";

    #[test]
    fn a_map_has_arrows_for_its_branches_and_circles_for_its_entries() {
        let map: CustomMap = MAP.parse().unwrap();
        let svg = map_graph("a map", &[("there <and> back", &map)]);
        // Downwards: 1 to 2, 2 to 3, 4 to the goal. Arcs: 2 to 4, 2 to 1, 3 to the goal, 4 to 2.
        let of = |pattern: &str| svg.matches(pattern).count();
        assert_eq!((of("V"), of("C")), (3, 4), "{svg}");
        assert_eq!(of("r=\"14\""), 5);
        assert!(svg.contains("there &lt;and&gt; back") && svg.contains(">Isol, slide back<"), "{svg}");
        // Signs with one, three and two dots, one with one dot, and those in the legend.
        assert_eq!(of("r=\"2\""), 6 + 1 + 6);
    }

    #[test]
    fn many_signs_take_several_rows() {
        let signs: String = (0..8).map(|code| format!("({}, NE, 1), ", Signature::of_code(code))).collect();
        let map: CustomMap = format!("(*, SW)\n(Isol, {signs}(*, -), -)").parse().unwrap();
        assert_eq!(rows(&map), [ROW, 2.0 * ROW, ROW]);
    }
}

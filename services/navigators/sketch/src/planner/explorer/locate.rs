//! Locates a goal once, by the outline of what was seen and without driving.

use sketchnav_mapping::Survey;
use sketchnav_mapping::alignment::{Aligner, Anchor, Problem, Search, Weights, turn_by_walls};
use sketchnav_mapping::outline::{Place, SeenOutline};
use sketchnav_schemas::geometry::{Point, Pose, Sketch};

use super::course::Likely;
use super::emphasis;
use super::paper::Paper;
use crate::filter::Start;
use crate::paths::parameters::Parameters;
use crate::sketch::SketchGrid;

/// Aligns the outline of a survey with the drawing's, as the planner does while driving. Returns the goal's place in the map, in
/// metres, or `None` if more of its surroundings lies behind gaps than `parameters.goal_hidden_share`.
pub fn locate(
    sketch: &SketchGrid,
    start: Pose<Sketch>,
    goal: Point<Sketch>,
    survey: &Survey,
    parameters: &Parameters,
) -> Option<Place> {
    let exact = Start { pose: start, spread_px: 0.0, spread_rad: 0.0 };
    let paper = Paper::new(sketch, &exact, parameters.building_size_m)?;
    let shares = paper.shares(goal);
    let seen = SeenOutline::of_map(survey, &[], &paper.taking());
    let turn_rad = turn_by_walls(&paper.outline, &seen, start.yaw_rad);
    let anchor = Anchor { drawn: [start.x, start.y], seen: [0.0; 2], scale_m: paper.scale_m };
    let weights = Weights { away_m: parameters.rival_away_m, ..Weights::default() };
    let emphasis = emphasis(&shares, parameters.goal_emphasis);
    let mut aligner = Aligner::default();
    let (drawn, seen, anchor) = (&paper.outline, &seen, Some(&anchor));
    aligner.set(&weights, &Problem { drawn, seen, turn_rad, anchor, emphasis: &emphasis, forbidden: &[] });
    let likely = Likely::new(&shares, seen, &Search::whole(&mut aligner)?);
    likely.place.filter(|_| likely.hidden < parameters.goal_hidden_share)
}

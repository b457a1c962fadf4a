//! Fills the messages in the memory they are sent from; their headers are the sender's.

use sketchnav_schemas::message::{PosePx, Route, RouteTask, SketchMap, Text, Understood};

use crate::drawing::Drawing;
use crate::places::Places;

/// Fills a sketch message; its cells follow by [`fill_cells`].
pub fn fill_sketch(drawing: &Drawing, places: &Places, map: &mut SketchMap) {
    map.width_px = drawing.width_px;
    map.height_px = drawing.height_px;
    map.wall_direction_rad = drawing.wall_direction_rad;
    map.pen_width_px = drawing.pen_width_px;
    map.start = PosePx::new(&places.start);
    map.start_spread_px = places.start_spread_px;
    map.start_spread_rad = places.start_spread_rad;
}

/// Fills what is said to a drawing: what holds now, and why it was refused, where it was. The numbers of what was
/// sent are the sender's.
pub fn fill_understood(drawing: Option<&Drawing>, refusal: Option<&str>, answer: &mut Understood) {
    answer.accepted = refusal.is_none().into();
    if let Some(drawing) = drawing {
        answer.sketch_width_px = drawing.width_px;
        answer.sketch_height_px = drawing.height_px;
        answer.scale = drawing.scale;
        answer.wall_direction_rad = drawing.wall_direction_rad;
    }
    answer.words = refusal.map_or(Text([0; 256]), Text::new);
}

/// Fills the cells of a sketch message, row 0 at the bottom; there are as many as the drawing has.
pub fn fill_cells(drawing: &Drawing, cells: &mut [u8]) {
    cells.copy_from_slice(&drawing.cells);
}

/// Fills a route message; what lies behind its counts becomes zero.
///
/// Tasks and points beyond what the message holds are left out; [`Intent::place`](crate::Intent::place)
/// lets no such places through.
pub fn fill_route(places: &Places, route: &mut Route) {
    let nothing = RouteTask { name: Text([0; 32]), first_point: 0, point_count: 0, time_limit_s: 0.0 };
    route.tasks.fill(nothing);
    route.points_px.fill([0.0; 2]);
    let mut first_point = 0;
    for (task, errand) in route.tasks.iter_mut().zip(&places.errands) {
        let point_count = errand.points.len() as u32;
        let name = Text::new(&errand.name);
        *task = RouteTask { name, first_point, point_count, time_limit_s: errand.time_limit_s };
        first_point += point_count;
    }
    let points = places.errands.iter().flat_map(|errand| &errand.points);
    for (place, point) in route.points_px.iter_mut().zip(points) {
        *place = [point.x, point.y];
    }
    route.task_count = places.errands.len().min(route.tasks.len()) as u32;
    route.point_count = first_point.min(route.points_px.len() as u32);
}

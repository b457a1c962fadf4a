//! Draws a run as two pictures: the drawing with the estimated path, and the true floor with the true path.

use crate::judge::{self, TaskSpan};
use crate::picture::{
    self, Claims, DrawnGoal, FloorPicture, FloorShapes, PictureError, SeenOutline, SketchPicture, TaskMark,
    TaskPicture,
};
use sketchnav_schemas::geometry::{Point, Pose, Sketch, World};
use sketchnav_schemas::message::Message;
use sketchnav_sketch::messages::Correspondence;
use sketchnav_sketch::mission::SketchMission;
use sketchnav_sketch::reading::DrawnMap;

use crate::error::EvalError;
use crate::experiments::outcome::Kind;
use crate::experiments::run::{Driven, kind_of};
use crate::experiments::trial::{Sheet, Trial};
use crate::experiments::witnesses::Asked;

/// Returns the pictures of a run as SVG, each with its name: `sketch`, if there is a drawing, and `floor`. For the method
/// `outline`, it adds `outline-sketch` and `outline-floor`, which show the correspondence at the end of the run. If regions joined
/// by doors are asked, it adds `rooms-sketch` and `witnesses-floor`, which show their answer and those of the other witnesses.
///
/// # Errors
/// [`EvalError`] if the world or the drawing cannot be drawn.
pub fn draw(trial: &Trial, driven: &Driven) -> Result<Vec<(&'static str, String)>, EvalError> {
    let spans = judge::spans(driven.run.mission.task.len(), &driven.log.status);
    let spans = &spans[..driven.verdicts.len()];
    let drawn = trial.sheet.as_ref().zip(driven.sketch.as_ref());
    let mut pictures = Vec::new();
    if let Some((sheet, mission)) = drawn {
        pictures.push(("sketch", sketch(trial, driven, (sheet, mission), spans)?));
    }
    pictures.push(("floor", floor(trial, driven, spans)?));
    if let Some(((sheet, mission), found)) = drawn.zip(driven.log.correspondences.last()) {
        pictures.push(("outline-sketch", outline_sketch(driven, (sheet, mission), found)?));
        pictures.push(("outline-floor", outline_floor(driven, found)?));
    }
    let last = driven.verdicts.len().checked_sub(1);
    let asked = last.and_then(|task| Some((task, driven.witness.as_ref()?.ask(&driven.log, task)?)));
    if let Some(((sheet, mission), (task, asked))) = drawn.zip(asked) {
        pictures.push(("rooms-sketch", rooms_sketch(driven, (sheet, mission), &asked)?));
        pictures.push(("witnesses-floor", witnesses_floor(driven, task, &asked)?));
    }
    Ok(pictures)
}

fn sketch(
    trial: &Trial,
    driven: &Driven,
    (sheet, mission): (&Sheet, &SketchMission),
    spans: &[Option<TaskSpan>],
) -> Result<String, PictureError> {
    let paper = &sheet.paper;
    let tasks: Vec<_> = (0..spans.len())
        .map(|i| TaskPicture {
            name: name(trial, driven, spans, i),
            marks: mission.tasks[i].aim.points().iter().map(|&at| paper.from_image(at)).collect(),
            place: Vec::new(),
            trail: picture::trail(of(&spans[i], &driven.log.estimates)),
            particles: Vec::new(),
            outcome: outcome(trial, driven, spans, i),
        })
        .collect();
    let marked = marked_start(paper, mission);
    // A drawn route also serves as the start mark.
    let first = driven.log.estimates.first().filter(|estimate| estimate.is_placed());
    let believed = first.map(|estimate| estimate.pose.pose());
    picture::sketch(&SketchPicture {
        title: &title(driven, "the sketch, with the robot's estimate"),
        width_px: paper.width_px,
        height_px: paper.height_px,
        cells: &paper.cells,
        start: marked.or(believed),
        tasks: &tasks,
    })
}

fn floor(trial: &Trial, driven: &Driven, spans: &[Option<TaskSpan>]) -> Result<String, EvalError> {
    let mission = &driven.run.mission;
    let world = sketchnav_sim::files::world(&mission.world)?;
    let point = |p: &[f64; 2]| Point::<World>::new(p[0], p[1]);
    let tasks: Vec<_> = (0..spans.len())
        .map(|i| TaskPicture {
            name: name(trial, driven, spans, i),
            marks: vec![point(&mission.task[i].there.middle())],
            place: picture::place_outline(&mission.task[i].there),
            trail: of(&spans[i], &driven.log.truth).iter().map(|t| t.pose().position()).collect(),
            particles: Vec::new(),
            outcome: outcome(trial, driven, spans, i),
        })
        .collect();
    let began = driven.log.contacts.iter().filter(|contact| contact.begins == 1);
    let contacts: Vec<_> =
        began.map(|contact| Point::new(contact.position_m[0], contact.position_m[1])).collect();
    let start = &mission.start;
    Ok(picture::floor(&FloorPicture {
        title: &title(driven, "the true floor, with the robot's true path"),
        shapes: &FloorShapes::of(&world),
        people: &[],
        views: &[],
        start: Pose::new(start.world[0], start.world[1], start.world_heading_deg.to_radians()),
        tasks: &tasks,
        contacts: &contacts,
    }))
}

fn outline_sketch(
    driven: &Driven,
    (sheet, mission): (&Sheet, &SketchMission),
    found: &Correspondence,
) -> Result<String, PictureError> {
    let goal = mission.tasks.last().and_then(|task| task.aim.points().last().copied());
    let goal = goal.map_or(Point::new(0.0, 0.0), |at| sheet.paper.from_image(at));
    let title = title(driven, "the sketch's outline");
    picture::drawn_outline(&drawn_goal(&title, (sheet, mission), goal), found)
}

fn outline_floor(driven: &Driven, found: &Correspondence) -> Result<String, EvalError> {
    let world = sketchnav_sim::files::world(&driven.run.mission.world)?;
    let origin = picture::origin_of(found, &driven.log.truth);
    Ok(picture::seen_outline(&SeenOutline {
        title: &title(driven, "its partners in what was seen"),
        shapes: &FloorShapes::of(&world),
        origin,
        trail: &true_trail(driven),
        found,
    }))
}

fn rooms_sketch(
    driven: &Driven,
    (sheet, mission): (&Sheet, &SketchMission),
    asked: &Asked,
) -> Result<String, PictureError> {
    let title = title(driven, "the sketch as regions joined by doors");
    let rooms = asked.rooms.as_ref().map(|rooms| (&rooms.drawing, &rooms.answer));
    picture::drawn_rooms(&drawn_goal(&title, (sheet, mission), asked.goal), rooms)
}

fn drawn_goal<'a>(
    title: &'a str,
    (Sheet { paper, .. }, mission): (&'a Sheet, &SketchMission),
    goal: Point<Sketch>,
) -> DrawnGoal<'a> {
    DrawnGoal {
        title,
        width_px: paper.width_px,
        height_px: paper.height_px,
        cells: &paper.cells,
        start: marked_start(paper, mission),
        goal,
    }
}

fn witnesses_floor(driven: &Driven, task: usize, asked: &Asked) -> Result<String, EvalError> {
    let world = sketchnav_sim::files::world(&driven.run.mission.world)?;
    Ok(picture::claims(&Claims {
        title: &title(driven, "where three witnesses locate the goal"),
        shapes: &FloorShapes::of(&world),
        trail: &true_trail(driven),
        place: &picture::place_outline(&driven.run.mission.task[task].there),
        claims: asked.claims,
        origin: asked.origin,
        rooms: asked.rooms.as_ref().map(|rooms| (&rooms.map, &rooms.answer)),
    }))
}

fn true_trail(driven: &Driven) -> Vec<Point<World>> {
    driven.log.truth.iter().map(|truth| truth.pose().position()).collect()
}

/// Returns the start as marked in the drawing.
fn marked_start(paper: &DrawnMap, mission: &SketchMission) -> Option<Pose<Sketch>> {
    let at = paper.from_image(mission.start?);
    Some(Pose::new(at.x, at.y, mission.start_heading_deg.unwrap_or_default().to_radians()))
}

fn title(driven: &Driven, what: &str) -> String {
    format!("{}, seed {}: {what}", driven.run.mission.name, driven.run.seed)
}

fn name(trial: &Trial, driven: &Driven, spans: &[Option<TaskSpan>], task: usize) -> String {
    let kind = kind_of(trial, driven, spans[task].as_ref(), task);
    format!("{}: {}", driven.verdicts[task].name, kind.word())
}

fn of<'a, T: Message>(span: &Option<TaskSpan>, messages: &'a [T]) -> &'a [T] {
    span.as_ref().map_or(&[], |span| span.of(messages))
}

fn outcome(trial: &Trial, driven: &Driven, spans: &[Option<TaskSpan>], task: usize) -> TaskMark {
    match (&spans[task], kind_of(trial, driven, spans[task].as_ref(), task)) {
        (None, _) => TaskMark::NotBegun,
        (Some(_), Kind::Reached) => TaskMark::Reached,
        (Some(_), _) => TaskMark::Failed,
    }
}

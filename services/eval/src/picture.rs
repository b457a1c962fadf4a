//! A driven run as two pictures: the drawing with the estimated way, the true floor with the true way.

use sketchnav_recordings::judge::{self, TaskSpan};
use sketchnav_recordings::picture::{self, FloorPicture, Outcome, PictureError, SketchPicture, TaskPicture};
use sketchnav_schemas::geometry::{Point, Pose, World};
use sketchnav_schemas::message::Message;

use crate::error::EvalError;
use crate::run::Driven;
use crate::trial::Trial;

/// The pictures of a run as SVG, each with what it shows: `sketch`, `floor`.
///
/// # Errors
/// [`EvalError`] where the world or the drawing cannot be drawn.
pub fn draw(trial: &Trial, driven: &Driven) -> Result<[(&'static str, String); 2], EvalError> {
    let spans = judge::spans(driven.run.mission.task.len(), &driven.log.status);
    let spans = &spans[..driven.verdicts.len()];
    Ok([("sketch", sketch(trial, driven, spans)?), ("floor", floor(driven, spans)?)])
}

fn sketch(trial: &Trial, driven: &Driven, spans: &[Option<TaskSpan>]) -> Result<String, PictureError> {
    let paper = &trial.paper;
    let tasks: Vec<_> = (0..spans.len())
        .map(|i| {
            let task = &driven.run.mission.task[i];
            let points = task.route.clone().or(task.goal.map(|goal| vec![goal])).unwrap_or_default();
            TaskPicture {
                name: name(driven, i),
                marks: points.into_iter().map(|at| paper.from_image(at)).collect(),
                place: Vec::new(),
                trail: of(&spans[i], &driven.log.estimates)
                    .iter()
                    .map(|e| e.pose.pose().position())
                    .collect(),
                particles: Vec::new(),
                outcome: outcome(driven, spans, i),
            }
        })
        .collect();
    let start = &driven.run.mission.start;
    let at = start.sketch.map(|at| paper.from_image(at)).unwrap_or(Point::new(0.0, 0.0));
    let heading_deg = start.sketch_heading_deg.unwrap_or_default();
    picture::sketch(&SketchPicture {
        title: &title(driven, "the sketch, and where the robot believed to be"),
        width_px: paper.width_px,
        height_px: paper.height_px,
        cells: &paper.cells,
        start: Pose::new(at.x, at.y, heading_deg.to_radians()),
        tasks: &tasks,
    })
}

fn floor(driven: &Driven, spans: &[Option<TaskSpan>]) -> Result<String, EvalError> {
    let mission = &driven.run.mission;
    let world = sketchnav_sim::files::world(&mission.world)?;
    let point = |p: &[f64; 2]| Point::<World>::new(p[0], p[1]);
    let walls: Vec<_> = world.outline.iter().map(|s| [point(&s[0]), point(&s[1])]).collect();
    let furniture: Vec<Vec<_>> =
        world.furniture.iter().map(|piece| piece.corners().iter().map(point).collect()).collect();
    let tasks: Vec<_> = (0..spans.len())
        .map(|i| TaskPicture {
            name: name(driven, i),
            marks: vec![point(&mission.task[i].there.middle())],
            place: picture::place_outline(&mission.task[i].there),
            trail: of(&spans[i], &driven.log.truth).iter().map(|t| t.pose().position()).collect(),
            particles: Vec::new(),
            outcome: outcome(driven, spans, i),
        })
        .collect();
    let began = driven.log.contacts.iter().filter(|contact| contact.begins == 1);
    let contacts: Vec<_> = began.map(|contact| Point::new(contact.x_m, contact.y_m)).collect();
    let start = &mission.start;
    Ok(picture::floor(&FloorPicture {
        title: &title(driven, "the true floor, and where the robot truly was"),
        walls: &walls,
        furniture: &furniture,
        start: Pose::new(start.world[0], start.world[1], start.world_heading_deg.to_radians()),
        tasks: &tasks,
        contacts: &contacts,
    }))
}

fn title(driven: &Driven, what: &str) -> String {
    format!("{}, seed {}: {what}", driven.run.mission.name, driven.run.seed)
}

fn name(driven: &Driven, task: usize) -> String {
    let verdict = &driven.verdicts[task];
    format!("{}: {}", verdict.name, crate::outcome::Kind::of(verdict).word())
}

fn of<'a, T: Message>(span: &Option<TaskSpan>, messages: &'a [T]) -> &'a [T] {
    span.as_ref().map_or(&[], |span| span.of(messages))
}

fn outcome(driven: &Driven, spans: &[Option<TaskSpan>], task: usize) -> Outcome {
    match (&spans[task], driven.verdicts[task].reached) {
        (None, _) => Outcome::NotBegun,
        (Some(_), true) => Outcome::Reached,
        (Some(_), false) => Outcome::Failed,
    }
}

//! The part of a page about a run in a drawing: the estimated path, some snapshots, and the parts of the drawing that corresponded
//! to what the robot saw.

use maud::{Markup, PreEscaped, html};
use sketchnav_files::Files;
use sketchnav_recordings::Recording;
use sketchnav_recordings::reader::{RawMessage, Selection};
use sketchnav_recordings::writer::topic_name;
use sketchnav_schemas::geometry::{Point, Pose, Sketch};
use sketchnav_schemas::run::RunConfig;
use sketchnav_schemas::time::seconds;
use sketchnav_sketch::messages::{PLAN, Particles, Plan, SketchMap};

use super::{outcome, within};
use crate::judge::log::Log;
use crate::judge::{self, TaskSpan, Verdict};
use crate::picture::{self, Moment, SketchPicture, TaskPicture};

/// Number of snapshots that are shown.
const MOMENTS: usize = 4;

/// Draws the drawing with the estimated trajectory, or returns `None` if the recording contains no drawing.
pub fn picture(run: &RunConfig, log: &Log, verdict: &Verdict) -> anyhow::Result<Option<String>> {
    let Some((map, cells)) = &log.sketch else { return Ok(None) };
    let spans = judge::spans(run.mission.task.len(), &log.status);
    let tasks = sketch_tasks(run, log, verdict, &spans);
    let svg = picture::sketch(&SketchPicture {
        title: &format!("{}, seed {}: the sketch, with the localizer's estimate", run.mission.name, run.seed),
        width_px: map.width_px,
        height_px: map.height_px,
        cells,
        start: start(map),
        tasks: &tasks,
    })?;
    Ok(Some(svg))
}

/// Returns the start, unless nobody has marked it. In a learned map, it is the likeliest place.
fn start(map: &SketchMap) -> Option<Pose<Sketch>> {
    let size = [map.width_px, map.height_px].map(|side| side as usize);
    (map.is_learned() || !map.start().is_anywhere(size)).then(|| map.start.pose())
}

fn sketch_tasks(
    run: &RunConfig,
    log: &Log,
    verdict: &Verdict,
    spans: &[Option<TaskSpan>],
) -> Vec<TaskPicture<Sketch>> {
    let task = |i: usize| {
        let route = log.route.as_deref();
        let marks = route.and_then(|route| Some(route.points(route.tasks().get(i)?).collect()));
        let particles = within(&spans[i], &log.particles).last().map(cloud);
        TaskPicture {
            name: verdict.tasks[i].name.clone(),
            marks: marks.unwrap_or_default(),
            place: Vec::new(),
            trail: picture::trail(within(&spans[i], &log.estimates)),
            particles: particles.unwrap_or_default(),
            outcome: outcome(&spans[i], &verdict.tasks[i]),
        }
    };
    (0..run.mission.task.len()).map(task).collect()
}

/// Returns the positions of the particles.
fn cloud(particles: &Particles) -> Vec<Point<Sketch>> {
    let count = (particles.count as usize).min(particles.particles.len());
    particles.particles[..count].iter().map(|p| Point::new(p.x_px.into(), p.y_px.into())).collect()
}

/// Draws snapshots spread evenly over the path, from its beginning, where they are easiest to understand, to its end.
pub fn moments(recording: &Recording, log: &Log) -> anyhow::Result<Markup> {
    let (Some((map, cells)), particles) = (&log.sketch, &log.particles) else {
        return Ok(html! {});
    };
    if particles.is_empty() {
        return Ok(html! {});
    }
    let last = particles.len() - 1;
    let mut shown: Vec<usize> = (0..MOMENTS).map(|i| i * last / (MOMENTS - 1).max(1)).collect();
    shown.dedup();
    let mut figures = Vec::new();
    for index in shown {
        let cloud_of = &particles[index];
        let until = cloud_of.header.stamp_ns;
        let end = log.estimates.partition_point(|e| e.header.stamp_ns <= until);
        let Some(estimate) = log.estimates[..end].last() else { continue };
        let trail = picture::trail(&log.estimates[..end]);
        figures.push(picture::moment(&Moment {
            title: &format!("{:.0} s: particles, the path so far, the plan", seconds(until)),
            width_px: map.width_px,
            height_px: map.height_px,
            cells,
            pose: estimate.pose.pose(),
            trail: &trail,
            particles: &cloud(cloud_of),
            plan: &plan_at(recording, until)?,
        })?);
    }
    Ok(html! {
        h2 { "Moments" }
        div.pictures { @for svg in &figures { figure { (PreEscaped(svg)) } } }
    })
}

/// Draws which parts of the drawing corresponded to the robot's map, both along the path and at its end.
pub fn correspondences(run: &RunConfig, files: &dyn Files, log: &Log) -> anyhow::Result<Markup> {
    let (Some((map, cells)), Some(last)) = (&log.sketch, log.correspondences.len().checked_sub(1)) else {
        return Ok(html! {});
    };
    let shapes = sketchnav_sim::files::world_in(files, &run.mission.world);
    let shapes = shapes.map(|world| picture::FloorShapes::of(&world)).unwrap_or_default();
    let mut shown = vec![last / 3, 2 * last / 3, last];
    shown.dedup();
    let mut figures = Vec::new();
    for found in shown.into_iter().map(|index| &log.correspondences[index]) {
        let until = found.header.stamp_ns;
        let origin = picture::origin_of(found, &log.truth);
        let seen = log.truth.iter().take_while(|truth| truth.header.stamp_ns <= until);
        let trail: Vec<_> = seen.map(|truth| truth.pose().position()).collect();
        let goal = log.goal_at(until);
        let drawn = picture::DrawnGoal {
            title: &format!("{:.0} s: the sketch's outline", seconds(until)),
            width_px: map.width_px,
            height_px: map.height_px,
            cells,
            start: start(map),
            goal: goal.unwrap_or(Point::new(0.0, 0.0)),
        };
        figures.push(picture::drawn_outline(&drawn, found)?);
        figures.push(picture::seen_outline(&picture::SeenOutline {
            title: &format!("{:.0} s: its partners in what was seen", seconds(until)),
            shapes: &shapes,
            origin,
            trail: &trail,
            found,
        }));
    }
    Ok(html! {
        h2 { "What in the drawing corresponds to what was seen" }
        p { "A piece of the drawing's outline and its partner have the same colour. Green cross: the goal. Red cross: where the best rival places it." }
        div.pictures { @for svg in &figures { figure { (PreEscaped(svg)) } } }
    })
}

/// Returns the plan in force at a point in time: the last one sent in the minute before it.
fn plan_at(recording: &Recording, stamp_ns: u64) -> anyhow::Result<Vec<Point<Sketch>>> {
    const LOOK_BACK_NS: u64 = 60_000_000_000;
    let times = stamp_ns.saturating_sub(LOOK_BACK_NS)..stamp_ns + 1;
    let selection = Selection::of_topics([topic_name(PLAN.spec.name)]).between(times);
    let mut last: Option<RawMessage> = None;
    for plan in recording.select(selection)? {
        last = Some(plan?);
    }
    let Some(last) = last else { return Ok(Vec::new()) };
    let (plan, _) = last.typed::<Plan>()?;
    let count = (plan.global_count as usize).min(plan.global_px.len());
    Ok(plan.global_px[..count].iter().map(|p| Point::new(p[0].into(), p[1].into())).collect())
}

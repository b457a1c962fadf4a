//! The part of a report about landmarks: the sketch with its states, the true scene with the path and the matches, histograms of
//! forces at the matches, and what the robot reported about its position.

use std::fmt::Write;

use crate::judge::log::Log;
use crate::page;
use crate::picture::FloorShapes;
use crate::picture::svg::{INK, Sheet, View};
use maud::{Markup, PreEscaped, html};
use sketchnav_files::Files;
use sketchnav_landmarks::drawn::DrawnMetres;
use sketchnav_landmarks::instructions::Instructions;
use sketchnav_landmarks::messages::{LandmarkEvent, LandmarkProgress, LandmarkView};
use sketchnav_landmarks::perception::{Perceiving, Perception};
use sketchnav_landmarks::plane;
use sketchnav_landmarks::ring::Ring;
use sketchnav_landmarks::route::Route;
use sketchnav_landmarks::view;
use sketchnav_schemas::geometry::{Base, Point, Pose, World};
use sketchnav_schemas::message::GroundTruth;
use sketchnav_schemas::run::RunConfig;
use sketchnav_schemas::time::seconds;

/// Number of points in time for which histograms are shown.
const MOMENTS: usize = 6;
/// Colours of the objects in the pictures of histograms.
const COLOURS: [&str; 6] = ["#2563eb", "#d97706", "#059669", "#7c3aed", "#dc2626", "#0891b2"];
/// Width of the border around the content of a picture, as a share of its size. In the picture of the true scene, the border around
/// the path is `AROUND_M` metres wide.
const BORDER: f64 = 0.06;
const AROUND_M: f64 = 1.5;
/// Maximum distance of the objects that are shown, in metres.
const SEEN_M: f64 = 6.5;

/// What a recording contains about landmarks.
pub struct Landmarks<'a> {
    instructions: Instructions,
    route: Option<Route>,
    views: &'a [LandmarkView],
    progress: &'a [LandmarkProgress],
}

/// A point in time at which a state was matched or the drive ended.
struct Moment<'a> {
    view: &'a LandmarkView,
    progress: &'a LandmarkProgress,
    truth: Option<Pose<World>>,
    label: String,
}

impl<'a> Landmarks<'a> {
    /// Reads the route from a log, or returns `None` if another navigator drove.
    ///
    /// # Errors
    /// Fails if the route is invalid.
    pub fn of(log: &'a Log) -> anyhow::Result<Option<Self>> {
        if log.landmark_route.is_empty() {
            return Ok(None);
        }
        let instructions = Instructions::read(&log.landmark_route)?;
        let route = instructions.route()?;
        Ok(Some(Self { instructions, route, views: &log.landmark_views, progress: &log.landmark_progress }))
    }

    /// Returns the pictures, with explanations.
    pub fn section(&self, run: &RunConfig, files: &dyn Files, truth: &[GroundTruth]) -> Markup {
        let moments = self.moments(truth);
        html! {
            h2 { "Landmarks" }
            div.pictures {
                @if let Some(svg) = self.sketch_picture() { figure { (PreEscaped(svg)) } }
                @if let Some(svg) = scene_picture(run, files, truth, &moments) { figure { (PreEscaped(svg)) } }
            }
            @if !self.instructions.words.is_empty() {
                h2 { "The states in words" }
                pre { (self.instructions.words) }
                (self.matches(&moments))
            }
            @if let Some(svg) = histograms(run, &moments) {
                h2 { "Histograms of forces" }
                p.small { "The histogram of constant forces of each visible object; ahead is up, and the radius is the greatest force." }
                div.pictures { figure { (PreEscaped(svg)) } }
            }
        }
    }

    /// Returns the points in time at which states were matched, and the end of the drive.
    fn moments(&self, truth: &[GroundTruth]) -> Vec<Moment<'_>> {
        let is_event = |said: &&LandmarkProgress| said.event != LandmarkEvent::Nothing.code();
        let moment = |progress: &'_ LandmarkProgress| {
            let stamp_ns = progress.header.stamp_ns;
            let at = self.views.partition_point(|view| view.header.stamp_ns < stamp_ns);
            let label = match LandmarkEvent::from_code(progress.event) {
                Some(LandmarkEvent::Matched) => progress.next.to_string(),
                event => event.map_or("", LandmarkEvent::word).to_owned(),
            };
            let true_at = truth.partition_point(|truth| truth.header.stamp_ns < stamp_ns);
            Some((self.views.get(at)?, label, truth.get(true_at).map(GroundTruth::pose)))
        };
        let events = self.progress.iter().filter(is_event);
        events
            .filter_map(|progress| {
                let (view, label, truth) = moment(progress)?;
                Some(Moment { view, progress, truth, label })
            })
            .collect()
    }

    fn matches(&self, moments: &[Moment<'_>]) -> Markup {
        let header = ["state", "time", "command", "met by what is seen"].map(str::to_owned);
        let row = |moment: &Moment<'_>| {
            let state = self.route.as_ref().and_then(|route| view::state_of(route, moment.progress));
            let names = self.route.as_ref().map_or(Vec::new(), |route| view::met(route, moment.progress));
            let command = state.map_or(String::new(), |state| state.command.to_string());
            let time = format!("{:.1} s", seconds(moment.progress.header.stamp_ns));
            vec![moment.label.clone(), time, command, names.join(", ")]
        };
        page::table(&header, &moments.iter().map(row).collect::<Vec<_>>())
    }

    /// Draws the sketch with its states and the estimated trajectory, or returns `None` if the route was given in words.
    pub fn sketch_picture(&self) -> Option<String> {
        let sketch = self.instructions.sketch.as_ref()?;
        let all = || sketch.route.iter().chain(sketch.landmarks.iter().flat_map(|one| &one.outline));
        let mut sheet = sheet(
            "The sketch with its states and the robot's estimate",
            all().copied().map(<[f64; 2]>::from),
        );
        for landmark in &sketch.landmarks {
            sheet.polygon(&landmark.outline, "fill=\"#eef1f6\" stroke=\"#5b6472\" stroke-width=\"2\"");
            named(&mut sheet, &landmark.name, &landmark.outline);
        }
        sheet.line(&sketch.route, "stroke=\"#9aa3b2\" stroke-width=\"5\" stroke-dasharray=\"2 9\"");
        let trail = self.views.iter().map(|view| view.in_sketch().position());
        sheet.line(&trail.collect::<Vec<_>>(), "stroke=\"#2563eb\" stroke-width=\"3\"");
        let along = self.route.as_ref().map_or(Vec::new(), Route::along);
        for (i, along) in along.iter().enumerate() {
            let Some(DrawnMetres(along)) = along else { continue };
            let at = plane::at_length(&sketch.route, *along);
            mark(&mut sheet, &at, &(i + 1).to_string(), "#d97706");
        }
        Some(sheet.finish())
    }
}

fn sheet(title: &str, points: impl Iterator<Item = [f64; 2]>) -> Sheet {
    let mut bounds = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    for at in points {
        for axis in 0..2 {
            bounds[0][axis] = bounds[0][axis].min(at[axis]);
            bounds[1][axis] = bounds[1][axis].max(at[axis]);
        }
    }
    Sheet::new(View::new(bounds[0], bounds[1], BORDER), title)
}

fn named<P: Copy + Into<[f64; 2]>>(sheet: &mut Sheet, name: &str, outline: &[P]) {
    let corners = || outline.iter().map(|at| (*at).into());
    let middle =
        [0, 1].map(|axis| corners().map(|at: [f64; 2]| at[axis]).sum::<f64>() / outline.len() as f64);
    let [x, y] = sheet.view.at(&Point::<Base>::from(middle));
    sheet.text([x, y + 5.0], 16.0, "middle", INK, "500", name);
}

fn mark<F>(sheet: &mut Sheet, at: &Point<F>, text: &str, colour: &str) {
    let [x, y] = sheet.view.at(at);
    sheet.raw(format_args!(
        "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"13\" fill=\"{colour}\" stroke=\"#ffffff\" stroke-width=\"2\"/>"
    ));
    sheet.text([x, y + 5.0], 14.0, "middle", "#ffffff", "600", text);
}

/// Draws the true scene, or returns `None` if the recording does not contain its floor.
fn scene_picture(
    run: &RunConfig,
    files: &dyn Files,
    truth: &[GroundTruth],
    moments: &[Moment<'_>],
) -> Option<String> {
    let world = sketchnav_sim::files::world_in(files, &run.mission.world).ok()?;
    let shapes = FloorShapes::of(&world);
    let way: Vec<_> = truth.iter().map(|truth| truth.pose().position()).collect();
    let around =
        way.iter().flat_map(|at| [[at.x - AROUND_M, at.y - AROUND_M], [at.x + AROUND_M, at.y + AROUND_M]]);
    let is_near = |corner: &&Point<World>| way.iter().any(|at| at.distance(corner) < SEEN_M);
    let seen = shapes.furniture.iter().flatten().filter(is_near).map(|at| [at.x, at.y]);
    let mut sheet = sheet("The true scene: the path, and what matched", around.chain(seen));
    for polygon in &shapes.furniture {
        sheet.polygon(polygon, "fill=\"#e6dccb\" stroke=\"#8a7a5c\" stroke-width=\"2\"");
    }
    for furniture in &run.mission.world.furniture {
        if let Some(polygon) = &furniture.polygon {
            named(&mut sheet, &furniture.name, polygon);
        }
    }
    sheet.line(&way, "stroke=\"#059669\" stroke-width=\"4\"");
    for moment in moments {
        let Some(truth) = moment.truth else { continue };
        for met in moment.progress.met() {
            let Some(seen) = view::objects(moment.view).nth(met.object as usize) else { continue };
            let Some(direction) = seen.place.direction() else { continue };
            let (sin, cos) = (f64::from(direction) * std::f64::consts::FRAC_PI_8).sin_cos();
            let far = seen.proximity_m + run.robot.radius_m;
            let to = truth.compose(&Pose::<Base>::new(far * cos, far * sin, 0.0)).position();
            sheet.line(
                &[truth.position(), to],
                "stroke=\"#d97706\" stroke-width=\"2\" stroke-dasharray=\"5 4\"",
            );
        }
    }
    for moment in moments {
        if let Some(truth) = moment.truth {
            let text = if moment.label.len() <= 2 { &moment.label } else { "■" };
            mark(&mut sheet, &truth.position(), text, "#d97706");
        }
    }
    sheet.scale_bar(1.0);
    Some(sheet.finish())
}

/// Draws a rose for each point in time, with the histograms of the objects that the robot saw.
fn histograms(run: &RunConfig, moments: &[Moment<'_>]) -> Option<String> {
    let ring = Ring::of(&run.robot).ok()?;
    let settings = Perceiving {
        robot_m: 2.0 * run.robot.radius_m,
        ring_m: ring.ring_m(),
        range_max_m: ring.range_max_m(),
        ..Perceiving::default()
    };
    let mut perception = Perception::nomad(settings).ok()?;
    let shown = &moments[moments.len().saturating_sub(MOMENTS)..];
    if shown.is_empty() {
        return None;
    }
    let points =
        [[-1.2, -1.2], [2.6 * shown.len().min(3) as f64 - 1.4, 1.2 + 2.6 * ((shown.len() - 1) / 3) as f64]];
    let mut sheet = sheet("Histograms of forces where states were matched", points.into_iter());
    let rows = (shown.len() - 1) / 3;
    for (i, moment) in shown.iter().enumerate() {
        let centre = [2.6 * (i % 3) as f64, 2.6 * (rows - i / 3) as f64];
        rose(&mut sheet, centre, moment, &mut perception);
    }
    Some(sheet.finish())
}

fn rose(sheet: &mut Sheet, centre: [f64; 2], moment: &Moment<'_>, perception: &mut Perception) {
    let [x, y] = sheet.view.at(&Point::<Base>::new(centre[0], centre[1]));
    let radius = sheet.view.scale;
    sheet.raw(format_args!(
        "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"none\" stroke=\"#d9dde4\"/><circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"6\" fill=\"#20242c\"/>"
    ));
    let mut title = String::new();
    let _ = write!(title, "{} · {:.1} s", moment.label, seconds(moment.view.header.stamp_ns));
    sheet.text([x, y - radius - 8.0], 16.0, "middle", INK, "600", &title);
    for (k, seen) in view::objects(moment.view).enumerate() {
        // Keep only the ranges of this object.
        let mut ranges = [f64::INFINITY; 16];
        for i in 0..usize::from(seen.beams[1]).min(16) {
            let beam = (usize::from(seen.beams[0]) + i) % 16;
            ranges[beam] = moment.view.sectors_m[beam];
        }
        if perception.see(&ranges).is_err() {
            continue;
        }
        let forces: Vec<f64> =
            perception.histograms()[0].iter().map(|force| force.finite().unwrap_or(0.0)).collect();
        let most = forces.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let outline: Vec<_> = forces
            .iter()
            .enumerate()
            .map(|(i, force)| {
                let angle =
                    i as f64 / forces.len() as f64 * std::f64::consts::TAU + std::f64::consts::FRAC_PI_2;
                let length = force / most;
                Point::<Base>::new(centre[0] + length * angle.cos(), centre[1] + length * angle.sin())
            })
            .collect();
        let colour = COLOURS[k % COLOURS.len()];
        sheet.polygon(
            &outline,
            &format!("fill=\"{colour}\" fill-opacity=\"0.25\" stroke=\"{colour}\" stroke-width=\"1.5\""),
        );
    }
}
